//! Reads a run of whole lines into its statements, without knowing what stands before it.
//!
//! What depends on earlier lines is left open and resolved when the runs are joined (`join`): numbers of lines and
//! faces count from the start of the run, vertex numbers that count back are relative to it, and names and smoothing
//! groups that were set before are [`OPEN`]. Most lines are plain (`v`, `vt`, `vn` or `f` with numbers as programs print
//! them) and read in one pass over their bytes; all others are read word by word.

use super::statements::Oddities;
use crate::load::geometry::{Face, FaceSpan, LARGEST, Run, WireStatement};
use crate::load::number::{self, Plain};
use crate::load::text::encoding::decode_name;
use crate::load::text::lines::{Lines, keyword, without_comment, words};
use crate::math::{DVec2, DVec3, Vec3};
use std::collections::HashMap;

/// Stands for a name, smoothing group or material that was set before the run.
pub(super) const OPEN: u32 = u32::MAX;

/// Marks a vertex number as relative to the start of the run; the other bits hold the number plus [`LARGEST`].
const RELATIVE: u32 = 1 << 31;

/// Absolute vertex number, given how many vertices precede the run; `None` for a number before the first.
pub(super) fn resolve(number: u32, before: u32) -> Option<u32> {
    if number & RELATIVE == 0 {
        return Some(number);
    }
    let absolute = i64::from(before) + i64::from(number & !RELATIVE) - i64::from(LARGEST);
    u32::try_from(absolute).ok().filter(|&n| n > 0)
}

/// Contents of a run of lines.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunk {
    pub positions: Vec<DVec3>,
    /// Texture coordinates, v upwards.
    pub uvs: Vec<DVec2>,
    /// Unit normals; zero where they have no direction.
    pub normals: Vec<Vec3>,
    /// Colours as written, [`NO_COLOR`] for vertices without one; may be shorter than `positions`.
    pub colors: Vec<[f32; 3]>,
    /// Colours in comments of ZBrush, 0…255: those of the first vertices of the file, in order.
    pub paint: Vec<[u8; 3]>,
    /// Corners of all faces.
    pub corners: Corners,
    /// Corners of faces that have too few.
    pub dropped: Vec<[u32; 3]>,
    pub faces: Vec<FaceSpan>,
    /// Points and lines.
    pub wire_statements: Vec<WireStatement>,
    /// Corners of points and lines, as [`Self::corners`].
    pub wire_corners: Vec<[u32; 3]>,
    pub runs: Vec<Run>,
    /// Names; 0 is the empty one.
    pub names: Vec<String>,
    pub libraries: Vec<(u32, String)>,
    pub places: i32,
    pub comments: Vec<String>,
    pub odd: Oddities,
    /// Number of lines, and of faces of any number of corners.
    pub lines: u32,
    pub face_count: u32,
    /// Run of the last faces.
    pub last: Run,
    pub smoothing: u32,
    /// Whether a corner cannot be read: the file is refused, and another pass finds out why.
    pub faulty: bool,
}

/// Corners: numbers of `v`, `vt`, `vn` from 1, for [`resolve`]; 0: none.
#[derive(Clone, Debug, Default)]
pub(super) struct Corners {
    /// Numbers of `v` alone, while no corner names anything else: the case of most scans.
    vertices: Vec<u32>,
    all: Vec<[u32; 3]>,
}

impl Corners {
    pub(super) fn len(&self) -> usize {
        self.vertices.len().max(self.all.len())
    }

    #[inline]
    pub(super) fn get(&self, i: usize) -> [u32; 3] {
        self.all.get(i).copied().unwrap_or_else(|| [self.vertices[i], 0, 0])
    }

    /// Numbers of `v`, where no corner names anything else.
    pub(super) fn vertices_alone(&self) -> Option<&[u32]> {
        self.all.is_empty().then_some(&self.vertices)
    }

    #[inline]
    fn push(&mut self, corner: [u32; 3]) {
        match corner {
            [vertex, 0, 0] if self.all.is_empty() => self.vertices.push(vertex),
            _ => {
                if !self.vertices.is_empty() {
                    self.all.extend(std::mem::take(&mut self.vertices).into_iter().map(|vertex| [vertex, 0, 0]));
                }
                self.all.push(corner);
            }
        }
    }

    fn truncate(&mut self, len: usize) {
        self.vertices.truncate(len);
        self.all.truncate(len);
    }
}

/// Number of comments that are kept: generators write theirs first.
pub(super) const COMMENTS: usize = 64;

/// Start of comments in which ZBrush writes the colours of vertices.
const PAINT: &[u8] = b"#MRGB ";

/// Statements of free-form geometry that draws something.
const CURVES: [&[u8]; 5] = [b"curv", b"curv2", b"surf", b"bzp", b"bsp"];

/// Statements that stand for others: those of another file, or the output of a command.
const CALLS: [&[u8]; 2] = [b"call", b"csh"];

/// Statements that do not change what is drawn.
const SILENT: [&[u8]; 27] = [
    b"vp",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"ctech",
    b"stech",
    b"cdc",
    b"cdp",
    b"res",
    b"mg",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"maplib",
    b"usemap",
    b"shadow_obj",
    b"trace_obj",
    b"vw",
];

/// Marks a vertex without a colour; no file can express it.
pub(super) const NO_COLOR: [f32; 3] = [f32::NAN; 3];

/// Reads a run of whole lines.
pub(super) fn read(text: &[u8]) -> Chunk {
    let last = Run { object: OPEN, group: OPEN, material: Some(OPEN) };
    let out = Chunk { names: vec![String::new()], last, smoothing: OPEN, ..Chunk::default() };
    let name_ids = HashMap::from([(String::new(), 0)]);
    let mut reader = Reader { out, line: 1, name_ids, run_ids: HashMap::new(), run: None };
    let mut lines = Lines::new(text);
    loop {
        if let Some(length) = reader.plain(lines.rest(), lines.number()) {
            lines.pass(length);
        } else if let Some((line, text)) = lines.next() {
            reader.line = line;
            reader.statement(text);
        } else {
            break;
        }
    }
    reader.out.lines = lines.number() - 1;
    reader.out
}

struct Reader {
    out: Chunk,
    /// Current line, from 1.
    line: u32,
    name_ids: HashMap<String, u32>,
    run_ids: HashMap<Run, u32>,
    /// Index of `out.last` in `out.runs`, once a face needed it.
    run: Option<u32>,
}

/// Plain lines.
impl Reader {
    /// Reads the plain line that `text` starts with and returns its length with the line end; `None` if nothing was read.
    #[inline]
    fn plain(&mut self, text: &[u8], line: u32) -> Option<usize> {
        match text {
            [b'v', b' ', ..] => self.plain_vertex(text),
            [b'v', b'n', b' ', ..] => self.plain_normal(text),
            [b'v', b't', b' ', ..] => self.plain_coordinate(text),
            [b'f', b' ', ..] => {
                self.line = line;
                self.plain_face(text)
            }
            _ => None,
        }
    }

    fn plain_vertex(&mut self, text: &[u8]) -> Option<usize> {
        let mut at = 1;
        let [x, y, z] = [next_number(text, &mut at)?, next_number(text, &mut at)?, next_number(text, &mut at)?];
        let end = line_end(text, at)?;
        self.out.places = self.out.places.max(x.places).max(y.places).max(z.places);
        self.push_position(DVec3::new(x.value, y.value, z.value));
        Some(end)
    }

    fn plain_normal(&mut self, text: &[u8]) -> Option<usize> {
        let mut at = 2;
        let [x, y, z] = [next_number(text, &mut at)?, next_number(text, &mut at)?, next_number(text, &mut at)?];
        let end = line_end(text, at)?;
        self.push_normal(DVec3::new(x.value, y.value, z.value));
        Some(end)
    }

    fn plain_coordinate(&mut self, text: &[u8]) -> Option<usize> {
        let mut at = 2;
        let [u, v] = [next_number(text, &mut at)?, next_number(text, &mut at)?];
        // Some programs write a third one; it is ignored.
        let end = line_end(text, at).or_else(|| next_number(text, &mut at).and_then(|_| line_end(text, at)))?;
        self.out.uvs.push(DVec2::new(u.value, v.value));
        Some(end)
    }

    fn plain_face(&mut self, text: &[u8]) -> Option<usize> {
        let first = self.out.corners.len();
        let mut at = 1;
        let end = loop {
            at += text[at..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
            if let Some(end) = line_end(text, at) {
                break Some(end);
            }
            let Some(corner) = plain_corner(text, &mut at) else { break None };
            self.out.corners.push(corner);
        };
        let arity = self.out.corners.len() - first;
        if end.is_none() || arity < 3 {
            self.out.corners.truncate(first);
            return None;
        }
        self.push_face(count(arity));
        end
    }
}

/// Number behind white space, which must be present.
#[inline]
fn next_number(text: &[u8], at: &mut usize) -> Option<Plain> {
    let rest = &text[*at..];
    let start = rest.iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
    let number = number::plain(&rest[start..])?;
    *at += start + number.length;
    Some(number)
}

/// Start of the next line if only white space is left on this one.
#[inline]
fn line_end(text: &[u8], at: usize) -> Option<usize> {
    let end = at + text[at..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
    match &text[end..] {
        [] => Some(end),
        [b'\n', ..] => Some(end + 1),
        [b'\r', b'\n', ..] => Some(end + 2),
        [b'\r', ..] => Some(end + 1),
        _ => None,
    }
}

/// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn` of positive numbers.
#[inline]
fn plain_corner(text: &[u8], at: &mut usize) -> Option<[u32; 3]> {
    let mut corner = [plain_index(text, at)?, 0, 0];
    if text.get(*at) == Some(&b'/') {
        *at += 1;
        if text.get(*at) != Some(&b'/') {
            corner[1] = plain_index(text, at)?;
        }
        if text.get(*at) == Some(&b'/') {
            *at += 1;
            corner[2] = plain_index(text, at)?;
        }
    }
    text.get(*at).is_none_or(u8::is_ascii_whitespace).then_some(corner)
}

#[inline]
fn plain_index(text: &[u8], at: &mut usize) -> Option<u32> {
    /// Most digits; longer numbers may be too large.
    const DIGITS: usize = 9;
    let (mut index, start) = (0u32, *at);
    while let Some(digit) = text.get(*at).map(|b| b.wrapping_sub(b'0')).filter(|&d| d < 10) {
        index = index.wrapping_mul(10).wrapping_add(u32::from(digit));
        *at += 1;
    }
    (*at - start <= DIGITS && index > 0).then_some(index)
}

/// All other lines.
impl Reader {
    fn statement(&mut self, text: &[u8]) {
        let (word, rest) = keyword(text);
        match word {
            b"v" => self.vertex(rest),
            b"vt" => {
                let [u, v] = self.numbers(1, rest, 0.0);
                self.out.uvs.push(DVec2::new(u, v));
            }
            b"vn" => {
                let normal = self.normal(rest);
                self.push_normal(normal);
            }
            b"f" | b"fo" => self.face(rest),
            b"o" => self.rename(|run, name| *run = Run { object: name, group: 0, ..*run }, without_comment(rest)),
            b"g" if rest == b"default" => self.rename(|run, name| run.group = name, b""),
            b"g" => self.rename(|run, name| run.group = name, without_comment(rest)),
            b"usemtl" => self.rename(|run, name| run.material = Some(name), rest),
            b"s" => self.smoothing_group(rest),
            b"mtllib" => self.out.libraries.push((self.line, decode_name(rest))),
            b"l" => self.wire(rest, true),
            b"p" => self.wire(rest, false),
            // Continued blank lines hold no word.
            b"" => {}
            _ if word.starts_with(b"#") => self.comment(text),
            _ if CURVES.contains(&word) => self.out.odd.curves.note(self.line, word),
            _ if CALLS.contains(&word) => self.out.odd.calls.note(self.line, word),
            _ if SILENT.contains(&word) => {}
            _ => self.out.odd.unknown.note(self.line, word),
        }
    }

    fn comment(&mut self, text: &[u8]) {
        if let Some(paint) = text.trim_ascii().strip_prefix(PAINT) {
            return self.paint(paint.trim_ascii());
        }
        if self.out.comments.len() < COMMENTS {
            let text = decode_name(text);
            let text = text.trim_matches(|c: char| c == '#' || c.is_whitespace());
            if !text.is_empty() {
                self.out.comments.push(crate::load::paths::shorten(text));
            }
        }
    }

    /// Reads a mask and red, green and blue of each vertex, two hexadecimal digits each.
    fn paint(&mut self, digits: &[u8]) {
        let digit = |d: u8| char::from(d).to_digit(16).and_then(|d| u8::try_from(d).ok());
        let byte = |[high, low]: [u8; 2]| Some(16 * digit(high)? + digit(low)?);
        let of_vertices = digits.as_chunks::<8>().0.iter();
        let colors =
            of_vertices.map_while(|&[_, _, a, b, c, d, e, f]| Some([byte([a, b])?, byte([c, d])?, byte([e, f])?]));
        self.out.paint.extend(colors);
    }

    /// Reads a `v` statement: three coordinates, optionally a weight, or a colour, or a colour with alpha.
    fn vertex(&mut self, rest: &[u8]) {
        let position = self.numbers(3, rest, 0.0);
        for word in words(rest).take(3) {
            let places = number::check(word).places;
            self.out.places = places.map_or(self.out.places, |p| p.max(self.out.places));
        }
        self.push_position(position.into());
        let mut more = [&b""[..]; 4];
        let extra = words(rest).skip(3).enumerate().map(|(i, w)| more.get_mut(i).map(|m| *m = w)).count();
        match extra {
            0 => {}
            1 => self.out.odd.weight.note(self.line, more[0]),
            3 => self.color([more[0], more[1], more[2]]),
            4 => {
                self.color([more[0], more[1], more[2]]);
                if number::check(more[3]).word.parse().is_ok_and(|alpha: f32| alpha < 1.0) {
                    self.out.odd.alpha.note(self.line, more[3]);
                }
            }
            _ => self.out.odd.columns.note(self.line, more[0]),
        }
    }

    /// Sets the colour of the last vertex.
    fn color(&mut self, words: [&[u8]; 3]) {
        let color = words.map(|w| {
            let checked = number::check(w);
            let value = checked.word.parse::<f32>().unwrap_or(f32::NAN);
            if checked.odd || !value.is_finite() {
                self.out.odd.number.note(self.line, w);
            }
            value
        });
        if color.iter().all(|c| c.is_finite()) {
            self.out.colors.resize(self.out.positions.len() - 1, NO_COLOR);
            self.out.colors.push(color);
        }
    }

    /// First numbers of a line, of which at least `needed` should exist; missing ones become `filler`.
    fn numbers<const N: usize>(&mut self, needed: usize, rest: &[u8], filler: f64) -> [f64; N] {
        let (mut numbers, mut found) = ([filler; N], 0);
        for (number, word) in numbers.iter_mut().zip(words(rest)) {
            let checked = number::check(word);
            if checked.odd {
                self.out.odd.number.note(self.line, word);
            }
            *number = checked.word.parse().unwrap_or(f64::NAN);
            found += 1;
        }
        if found < needed {
            self.out.odd.short.note(self.line, rest);
        }
        numbers
    }

    /// Reads a normal, which counts only with all three of its numbers.
    fn normal(&mut self, rest: &[u8]) -> DVec3 {
        let mut normal = [f64::NAN; 3];
        for (number, word) in normal.iter_mut().zip(words(rest)) {
            let checked = number::check(word);
            *number = checked.word.parse().unwrap_or(f64::NAN);
            if checked.odd && !number.is_nan() {
                self.out.odd.number.note(self.line, word);
            }
        }
        if normal.iter().any(|number| number.is_nan()) {
            self.out.odd.normal.note(self.line, rest);
        }
        normal.into()
    }

    fn smoothing_group(&mut self, rest: &[u8]) {
        let word = words(rest).next().unwrap_or_default();
        self.out.smoothing = match word {
            b"off" | b"" => 0,
            b"on" => 1,
            _ => match std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).filter(|&group| group != OPEN) {
                Some(group) => group,
                None => {
                    self.out.odd.smoothing.note(self.line, word);
                    0
                }
            },
        };
    }

    fn rename(&mut self, set: impl Fn(&mut Run, u32), name: &[u8]) {
        let name = decode_name(name);
        let id = match self.name_ids.get(&name) {
            Some(&id) => id,
            None => {
                let id = count(self.out.names.len());
                self.out.names.push(name.clone());
                self.name_ids.insert(name, id);
                id
            }
        };
        set(&mut self.out.last, id);
        self.run = None;
    }

    fn face(&mut self, rest: &[u8]) {
        let first = self.out.corners.len();
        for word in words(rest) {
            match self.corner(word) {
                Some(corner) => self.out.corners.push(corner),
                None => self.out.faulty = true,
            }
        }
        let arity = count(self.out.corners.len() - first);
        if arity < 3 {
            let corners = &self.out.corners;
            self.out.dropped.extend((first..corners.len()).map(|i| corners.get(i)));
            self.out.corners.truncate(first);
            self.out.face_count = self.out.face_count.saturating_add(1);
            return self.out.odd.few_corners.note(self.line, rest);
        }
        self.push_face(arity);
    }

    /// Reads a `p` or `l` statement; an invalid one is counted and left out.
    fn wire(&mut self, rest: &[u8], joined: bool) {
        let first = self.out.wire_corners.len();
        for word in words(rest) {
            let Some(corner) = self.corner(word) else {
                self.out.wire_corners.truncate(first);
                break;
            };
            self.out.wire_corners.push(corner);
        }
        let arity = count(self.out.wire_corners.len() - first);
        if arity < if joined { 2 } else { 1 } {
            self.out.wire_corners.truncate(first);
            return self.out.odd.wire_statements.note(self.line, rest);
        }
        let run = self.run();
        self.out.wire_statements.push(WireStatement { run, line: self.line, arity, joined });
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`; numbers count from 1, or back from the last one with −1. Some programs write 0
    /// for a missing coordinate or normal.
    fn corner(&mut self, word: &[u8]) -> Option<[u32; 3]> {
        let known = [self.out.positions.len(), self.out.uvs.len(), self.out.normals.len()];
        let mut out = [0; 3];
        for (kind, part) in word.split(|&b| b == b'/').enumerate() {
            if part.is_empty() && kind > 0 {
                continue;
            }
            let number = whole(part).filter(|_| kind < 3)?;
            out[kind] = match u32::try_from(number) {
                Ok(0) if kind > 0 => {
                    self.out.odd.zero.note(self.line, ATTRIBUTES[kind].as_bytes());
                    0
                }
                // More than there can be: names nothing that exists, like the largest.
                Ok(number) if kind > 0 => number.min(LARGEST),
                Ok(number) => Some(number).filter(|n| (1..=LARGEST).contains(n))?,
                Err(_) => {
                    let biased = i64::try_from(known[kind]).ok()? + 1 + number + i64::from(LARGEST);
                    RELATIVE | u32::try_from(biased).ok().filter(|&n| n < RELATIVE)?
                }
            };
        }
        Some(out)
    }
}

/// Kinds of data that the numbers of a corner name.
pub(super) const ATTRIBUTES: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Steps shared by plain and other lines.
impl Reader {
    #[inline]
    fn push_position(&mut self, position: DVec3) {
        self.out.positions.push(position);
    }

    #[inline]
    fn push_normal(&mut self, normal: DVec3) {
        self.out.normals.push(normal.normalize_or_zero().as_vec3());
    }

    #[inline]
    fn push_face(&mut self, arity: u32) {
        let run = self.run();
        let (line, number) = (self.line, self.out.face_count);
        let first = count(self.out.corners.len()).saturating_sub(arity);
        let face = Face { run, smoothing: self.out.smoothing, arity, line, number, first };
        match self.out.faces.last_mut() {
            Some(span) if span.face(span.count) == face => span.count += 1,
            _ => self.out.faces.push(FaceSpan { face, count: 1 }),
        }
        self.out.face_count = self.out.face_count.saturating_add(1);
    }

    fn run(&mut self) -> u32 {
        if let Some(run) = self.run {
            return run;
        }
        let next = count(self.out.runs.len());
        let run = *self.run_ids.entry(self.out.last).or_insert(next);
        if run == next {
            self.out.runs.push(self.out.last);
        }
        self.run = Some(run);
        run
    }
}

/// Parses a whole number.
pub(super) fn whole(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        _ => (false, word),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let value = digits.iter().try_fold(0, |sum, &d| d.is_ascii_digit().then(|| sum * 10 + i64::from(d - b'0')))?;
    Some(if negative { -value } else { value })
}

/// Length as `u32`. Larger ones saturate here, and are refused at the end of reading.
pub(super) fn count(length: usize) -> u32 {
    u32::try_from(length).unwrap_or(u32::MAX)
}
