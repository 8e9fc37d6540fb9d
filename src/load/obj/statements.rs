//! OBJ text -> checked statements: numbers that any parser reads, faces with absolute vertex numbers, and everything
//! that stands between them (names, materials, smoothing groups, colours), which `tobj` drops or gets wrong.
//!
//! The text's own errors end here, with their line: after this nothing refers to what is not there.

use super::encoding::decode_name;
use super::lines::{Lines, keyword, without_comment, words};
use super::number;
use crate::load::{Diagnostic, LoadError, Warnings};
use std::collections::HashMap;
use std::path::Path;

/// One face, without its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    /// Which of [`Statements::runs`].
    pub run: u32,
    /// Smoothing group; 0: none.
    pub smoothing: u32,
    /// Number of corners, at least 3.
    pub arity: u32,
    /// Where it starts in the file.
    pub line: u32,
    /// Which of the file's faces, from 0; those that are not kept count.
    pub number: u32,
}

/// What faces between two `o`, `g` or `usemtl` statements share; indices into [`Statements::names`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Run {
    pub object: u32,
    pub group: u32,
    /// `None` before the first `usemtl`.
    pub material: Option<u32>,
}

/// How often something odd was met, and where first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub count: u32,
    line: u32,
    word: String,
}

impl Tally {
    fn note(&mut self, line: u32, word: &[u8]) {
        if self.count == 0 {
            self.line = line;
            self.word = crate::load::paths::shorten(&decode_name(word));
        }
        self.count = self.count.saturating_add(1);
    }
}

/// Odd things, counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Oddities {
    pub points: Tally,
    pub lines: Tally,
    pub curves: Tally,
    pub few_corners: Tally,
    unknown: Tally,
    number: Tally,
    short: Tally,
    weight: Tally,
    columns: Tally,
    smoothing: Tally,
    absent: Tally,
}

/// A whole file's statements.
#[derive(Clone, Debug, Default)]
pub(super) struct Statements {
    /// `v`, `vt` and `vn` lines of plain numbers, in the file's order.
    pub numbers: Vec<u8>,
    /// How many `v`, `vt` and `vn` there are.
    pub counts: [u32; 3],
    /// Corners of all faces: numbers of `v`, `vt` and `vn` from 1; 0: none given.
    pub corners: Vec<[u32; 3]>,
    pub faces: Vec<Face>,
    pub runs: Vec<Run>,
    /// Names; 0 is the empty one.
    pub names: Vec<String>,
    /// `mtllib` arguments, with their lines.
    pub libraries: Vec<(u32, String)>,
    /// Red, green, blue of each vertex as written, white where none are; empty when no vertex has any.
    pub colors: Vec<[f32; 3]>,
    /// Decimal places of the finest coordinate.
    pub places: i32,
    /// The first comments, without their signs.
    pub comments: Vec<String>,
    pub odd: Oddities,
}

/// Comments that are kept: generators write theirs first.
const COMMENTS: usize = 64;

/// Statements of free-form geometry that draw something.
const CURVES: [&[u8]; 5] = [b"curv", b"curv2", b"surf", b"bzp", b"bsp"];

/// Statements that change nothing in what is drawn.
const SILENT: [&[u8]; 29] = [
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
    b"call",
    b"csh",
    b"vw",
];

/// Reads the whole text.
///
/// # Errors
/// When a face names what is not there, or its corners cannot be read.
pub(super) fn read(text: &[u8], file: &Path) -> Result<Statements, LoadError> {
    let mut reader =
        Reader { out: Statements { names: vec![String::new()], ..Default::default() }, ..Reader::new(file) };
    let mut lines = Lines::new(text);
    while let Some((line, text)) = lines.next() {
        reader.line = line;
        reader.statement(text);
    }
    reader.finish()
}

struct Reader<'a> {
    file: &'a Path,
    line: u32,
    out: Statements,
    name_ids: HashMap<String, u32>,
    run_ids: HashMap<Run, u32>,
    current: Run,
    /// Index of `current` in `out.runs`, once a face needed it.
    run: Option<u32>,
    smoothing: u32,
    face_count: u32,
    /// The first fault, counting those after it.
    fault: Option<Diagnostic>,
    /// Numbers of vertices that were not there yet when a face named them: (line, corner, kind, number).
    forward: Vec<(u32, u32, usize, u32)>,
}

impl<'a> Reader<'a> {
    fn new(file: &'a Path) -> Self {
        Self {
            file,
            line: 0,
            out: Statements::default(),
            name_ids: HashMap::from([(String::new(), 0)]),
            run_ids: HashMap::new(),
            current: Run::default(),
            run: None,
            smoothing: 0,
            face_count: 0,
            fault: None,
            forward: Vec::new(),
        }
    }

    fn statement(&mut self, text: &[u8]) {
        let (word, rest) = keyword(text);
        match word {
            b"v" => self.vertex(rest),
            b"vt" => self.numbers(1, b"vt ", rest, 2, "0"),
            b"vn" => self.numbers(2, b"vn ", rest, 3, "nan"),
            b"f" | b"fo" => self.face(rest),
            b"o" => self.rename(|run, name| *run = Run { object: name, group: 0, ..*run }, without_comment(rest)),
            b"g" if rest == b"default" => self.rename(|run, name| run.group = name, b""),
            b"g" => self.rename(|run, name| run.group = name, without_comment(rest)),
            b"usemtl" => self.rename(|run, name| run.material = Some(name), rest),
            b"s" => self.smoothing_group(rest),
            b"mtllib" => self.out.libraries.push((self.line, decode_name(rest))),
            b"l" => self.out.odd.lines.note(self.line, word),
            b"p" => words(rest).for_each(|_| self.out.odd.points.note(self.line, word)),
            // Continued blank lines leave no word.
            b"" => {}
            _ if word.starts_with(b"#") => self.comment(text),
            _ if CURVES.contains(&word) => self.out.odd.curves.note(self.line, word),
            _ if SILENT.contains(&word) => {}
            _ => self.out.odd.unknown.note(self.line, word),
        }
    }

    fn comment(&mut self, text: &[u8]) {
        if self.out.comments.len() < COMMENTS {
            let text = decode_name(text);
            let text = text.trim_matches(|c: char| c == '#' || c.is_whitespace());
            if !text.is_empty() {
                self.out.comments.push(crate::load::paths::shorten(text));
            }
        }
    }

    /// A `v` statement: three coordinates, then perhaps a weight, or a colour, or a colour with alpha.
    fn vertex(&mut self, rest: &[u8]) {
        self.numbers(0, b"v ", rest, 3, "0");
        let mut more = [&b""[..]; 4];
        let extra = words(rest).skip(3).enumerate().map(|(i, w)| more.get_mut(i).map(|m| *m = w)).count();
        match extra {
            0 => {}
            1 => self.out.odd.weight.note(self.line, more[0]),
            3 | 4 => self.color([more[0], more[1], more[2]]),
            _ => self.out.odd.columns.note(self.line, more[0]),
        }
        if !self.out.colors.is_empty() {
            self.out.colors.resize(self.out.counts[0] as usize, [1.0; 3]);
        }
    }

    fn color(&mut self, words: [&[u8]; 3]) {
        let color = words.map(|w| number::check(w).word.parse::<f32>().unwrap_or(f32::NAN));
        if color.iter().all(|c| c.is_finite()) {
            self.out.colors.resize(self.out.counts[0] as usize - 1, [1.0; 3]);
            self.out.colors.push(color);
        }
    }

    /// Writes a line of `wanted` numbers; missing ones become `filler`.
    fn numbers(&mut self, kind: usize, start: &[u8], rest: &[u8], wanted: usize, filler: &str) {
        self.out.numbers.extend_from_slice(start);
        let mut found = 0;
        for word in words(rest).take(wanted) {
            let number = number::check(word);
            if number.odd {
                self.out.odd.number.note(self.line, word);
            }
            if kind == 0 {
                self.out.places = number.places.map_or(self.out.places, |p| p.max(self.out.places));
            }
            self.out.numbers.extend_from_slice(number.word.as_bytes());
            self.out.numbers.push(b' ');
            found += 1;
        }
        // `vt u` is legal; anything else this short is not.
        if found < wanted && !(kind == 1 && found == 1) {
            self.out.odd.short.note(self.line, rest);
        }
        for _ in found..wanted {
            self.out.numbers.extend_from_slice(filler.as_bytes());
            self.out.numbers.push(b' ');
        }
        self.out.numbers.push(b'\n');
        self.out.counts[kind] = self.out.counts[kind].saturating_add(1);
    }

    fn smoothing_group(&mut self, rest: &[u8]) {
        let word = words(rest).next().unwrap_or_default();
        self.smoothing = match word {
            b"off" | b"" => 0,
            b"on" => 1,
            _ => std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).unwrap_or_else(|| {
                self.out.odd.smoothing.note(self.line, word);
                0
            }),
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
        set(&mut self.current, id);
        self.run = None;
    }

    fn face(&mut self, rest: &[u8]) {
        let number = self.face_count;
        self.face_count = self.face_count.saturating_add(1);
        let first = self.out.corners.len();
        for (i, word) in words(rest).enumerate() {
            match self.corner(word, count(i) + 1) {
                Ok(corner) => self.out.corners.push(corner),
                Err(fault) => return self.refuse(fault),
            }
        }
        let arity = count(self.out.corners.len() - first);
        if arity < 3 {
            self.out.corners.truncate(first);
            return self.out.odd.few_corners.note(self.line, rest);
        }
        let run = self.run();
        self.out.faces.push(Face { run, smoothing: self.smoothing, arity, line: self.line, number });
    }

    fn run(&mut self) -> u32 {
        if let Some(run) = self.run {
            return run;
        }
        let next = count(self.out.runs.len());
        let run = *self.run_ids.entry(self.current).or_insert(next);
        if run == next {
            self.out.runs.push(self.current);
        }
        self.run = Some(run);
        run
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`; numbers count from 1, or back from the last one with −1.
    fn corner(&mut self, word: &[u8], corner: u32) -> Result<[u32; 3], Diagnostic> {
        let mut out = [0; 3];
        for (kind, part) in word.split(|&b| b == b'/').enumerate() {
            if part.is_empty() && kind > 0 {
                continue;
            }
            let Some(number) = whole(part).filter(|_| kind < 3) else { return Err(self.unreadable(word, corner)) };
            let known = i64::from(self.out.counts[kind]);
            let absolute = if number < 0 { known + 1 + number } else { number };
            out[kind] = u32::try_from(absolute)
                .ok()
                .filter(|&a| a > 0)
                .ok_or_else(|| self.out_of_range(self.line, corner, kind, number))?;
            if absolute > known {
                self.forward.push((self.line, corner, kind, out[kind]));
            }
        }
        Ok(out)
    }

    fn unreadable(&self, word: &[u8], corner: u32) -> Diagnostic {
        let word = crate::load::paths::shorten(&decode_name(word));
        let text =
            format!("corner {corner} of the face is '{word}', which is not of the form v, v/vt, v//vn or v/vt/vn");
        Diagnostic::new("obj-bad-face", self.file, self.line.to_string(), text)
    }

    fn out_of_range(&self, line: u32, corner: u32, kind: usize, number: i64) -> Diagnostic {
        let what = ["vertex", "texture coordinate", "normal"][kind];
        let there = self.out.counts[kind];
        let (code, text) = match number {
            0 => ("obj-index-zero", format!("corner {corner} of the face names {what} 0, but numbers start at 1")),
            1.. => {
                ("obj-index-range", format!("corner {corner} of the face names {what} {number}, but there are {there}"))
            }
            _ => (
                "obj-index-range",
                format!("corner {corner} of the face names {what} {number}, but {there} stand before it"),
            ),
        };
        Diagnostic::new(code, self.file, line.to_string(), text).remedy("export the model again")
    }

    fn refuse(&mut self, fault: Diagnostic) {
        match &mut self.fault {
            Some(first) => first.count = first.count.saturating_add(1),
            None => self.fault = Some(fault),
        }
    }

    fn finish(mut self) -> Result<Statements, LoadError> {
        for (line, corner, kind, number) in std::mem::take(&mut self.forward) {
            if kind > 0 && self.out.counts[kind] == 0 {
                // Coordinates or normals were left out as a whole: the faces can still be drawn.
                self.out.odd.absent.note(line, ["", "texture coordinates", "normals"][kind].as_bytes());
            } else if number > self.out.counts[kind] {
                let fault = self.out_of_range(line, corner, kind, i64::from(number));
                self.refuse(fault);
            }
        }
        for corner in &mut self.out.corners {
            *corner = [0, 1, 2].map(|kind| if self.out.counts[kind] == 0 { 0 } else { corner[kind] });
        }
        // A quarter of u32, so that counts of corners, faces and normals can be added up.
        let counts = self.out.counts.into_iter().chain([self.face_count, count(self.out.corners.len())]);
        if let Some(largest) = counts.max().filter(|&c| c > u32::MAX / 4) {
            let text = format!("{largest} vertices, corners or faces are more than {}", u32::MAX / 4);
            return Err(Diagnostic::new("obj-too-large", self.file, "", text).remedy("split the file").into());
        }
        match self.fault {
            Some(fault) => Err(fault.into()),
            None => Ok(self.out),
        }
    }
}

impl Oddities {
    /// One warning for each kind met.
    pub(super) fn warn(&self, file: &Path, warnings: &mut Warnings) {
        let mut warn = |code, tally: &Tally, text: String, remedy: &str| {
            if tally.count > 0 {
                let warning = Diagnostic::new(code, file, tally.line.to_string(), text).remedy(remedy);
                warnings.push(Diagnostic { count: tally.count, ..warning });
            }
        };
        let not_drawn = "has no surface and is not drawn";
        warn("obj-points", &self.points, format!("a point {not_drawn}"), "");
        warn("obj-lines", &self.lines, format!("a line {not_drawn}"), "");
        let curve = format!("free-form geometry ('{}') is not drawn", self.curves.word);
        warn("obj-free-form", &self.curves, curve, "export it as polygons");
        let few = "a face with fewer than 3 corners is dropped";
        warn("obj-few-corners", &self.few_corners, few.into(), "");
        warn("obj-unknown-statement", &self.unknown, format!("'{}' is not an OBJ statement", self.unknown.word), "");
        let odd = format!("'{}' is not a number as OBJ writes them; what could be read is used", self.number.word);
        warn("obj-odd-number", &self.number, odd, "");
        let short = format!("too few numbers: '{}'", self.short.word);
        warn("obj-short-vector", &self.short, short, "the missing ones count as 0");
        let weight = "a vertex weight (fourth number) is ignored: it is for rational curves";
        warn("obj-vertex-weight", &self.weight, weight.into(), "");
        let columns = "numbers after the coordinates are neither a weight nor a colour and are ignored";
        warn("obj-vertex-columns", &self.columns, columns.into(), "");
        let absent = format!("a corner names {}, but the file has none; it is drawn without", self.absent.word);
        warn("obj-absent-attribute", &self.absent, absent, "");
        let smoothing = format!("smoothing group '{}' is not a number; faces are flat", self.smoothing.word);
        warn("obj-smoothing-group", &self.smoothing, smoothing, "");
    }
}

/// A whole number, if the word is one.
fn whole(word: &[u8]) -> Option<i64> {
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

/// Lengths beyond `u32` are refused at the end of reading; until then they only must not wrap.
fn count(length: usize) -> u32 {
    u32::try_from(length).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Statements {
        read(text.as_bytes(), Path::new("m.obj")).unwrap()
    }

    fn fault(text: &str) -> String {
        read(text.as_bytes(), Path::new("m.obj")).unwrap_err().to_string()
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    #[test]
    fn negative_numbers_count_back_from_the_last_vertex_read() {
        let s = of(&format!("{TRIANGLE}vt 0 0\nf -3/-1 -2 -1//\n{TRIANGLE}f -3 -2 -1"));
        assert_eq!(s.corners, [[1, 1, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0, 0], [6, 0, 0]]);
    }

    #[test]
    fn a_face_may_name_a_vertex_that_comes_later() {
        assert_eq!(of(&format!("f 1 2 3\n{TRIANGLE}")).corners.len(), 3);
    }

    #[test]
    fn numbers_of_what_is_not_there_are_told_with_line_and_corner() {
        let start = "m.obj:4: corner 2 of the face names";
        assert!(fault(&format!("{TRIANGLE}f 1 0 3")).starts_with(&format!("{start} vertex 0, but numbers start at 1")));
        assert!(fault(&format!("{TRIANGLE}f 1 9 3")).starts_with(&format!("{start} vertex 9, but there are 3")));
        assert!(
            fault(&format!("{TRIANGLE}f 1 -4 3")).starts_with(&format!("{start} vertex -4, but 3 stand before it"))
        );
        let start = format!("{TRIANGLE}vt 0 0\nvn 0 0 1\n");
        assert!(fault(&format!("{start}f 1/2 2 3")).contains("texture coordinate 2, but there are 1"));
        assert!(fault(&format!("{start}f 1//2 2 3\nf 1//3 2 3")).contains("normal 2, but there are 1 (×2)"));
        assert!(fault(&format!("{TRIANGLE}f 1 x 3")).contains("corner 2 of the face is 'x'"));
        assert!(fault(&format!("{TRIANGLE}f 1 1/1/1/1 3")).contains("not of the form"));
        assert!(fault(&format!("{TRIANGLE}f 1 99999999999999999999 3")).contains("not of the form"));
    }

    #[test]
    fn coordinates_and_normals_left_out_as_a_whole_are_only_a_warning() {
        let s = of(&format!("{TRIANGLE}f 1/1/1 2/2/1 3/3/1"));
        assert_eq!(s.corners, [[1, 0, 0], [2, 0, 0], [3, 0, 0]]);
        assert_eq!(s.odd.absent.count, 6);
    }

    #[test]
    fn runs_with_the_same_names_and_material_are_one() {
        let text = "o a\nusemtl r\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl r\nf 1 2 3\ng x\nf 1 2 3\no b\nf 1 2 3";
        let s = of(&format!("{TRIANGLE}{text}"));
        assert_eq!(s.faces.iter().map(|f| f.run).collect::<Vec<_>>(), [0, 1, 0, 2, 3]);
        let named = |run: usize| {
            let Run { object, group, material } = s.runs[run];
            let name = |id: u32| s.names[id as usize].as_str();
            (name(object), name(group), name(material.unwrap()))
        };
        assert_eq!((named(2), named(3)), (("a", "x", "r"), ("b", "", "r")));
    }

    #[test]
    fn smoothing_groups_are_numbers_on_or_off() {
        let s = of(&format!("{TRIANGLE}f 1 2 3\ns 7\nf 1 2 3\ns off\nf 1 2 3\ns on\nf 1 2 3\ns x\nf 1 2 3"));
        assert_eq!(s.faces.iter().map(|f| f.smoothing).collect::<Vec<_>>(), [0, 7, 0, 1, 0]);
        assert_eq!(s.odd.smoothing.count, 1);
    }

    #[test]
    fn colors_on_some_vertices_leave_the_others_white() {
        let s = of("v 0 0 0\nv 1 0 0 1 0.5 0\nv 2 0 0\nv 3 0 0 0 0 1 0.5\nv 4 0 0 0.5");
        assert_eq!(s.colors, [[1.0; 3], [1.0, 0.5, 0.0], [1.0; 3], [0.0, 0.0, 1.0], [1.0; 3]]);
        assert_eq!(s.odd.weight.count, 1);
        assert!(of("v 0 0 0\nv 1 1 1").colors.is_empty());
    }

    #[test]
    fn points_lines_and_curves_are_counted_and_short_faces_dropped() {
        let s = of(&format!("{TRIANGLE}p 1 2 3\nl 1 2 3\nsurf 0 1 0 1 1\nf 1 2\nf\nf 1 2 3\nhello"));
        assert_eq!((s.odd.points.count, s.odd.lines.count, s.odd.curves.count), (3, 1, 1));
        assert_eq!((s.odd.few_corners.count, s.odd.unknown.count), (2, 1));
        assert_eq!(s.faces, [Face { run: 0, smoothing: 0, arity: 3, line: 9, number: 2 }]);
    }

    #[test]
    fn numbers_come_out_plain_and_complete() {
        let s = of("v 1,5 0 # hi\nvt 0.5\nvn 1 0\nv 1 2 3 # hi\nvt 1 2 3");
        let text = String::from_utf8(s.numbers).unwrap();
        assert_eq!(text, "v 1.5 0 0 \nvt 0.5 0 \nvn 1 0 nan \nv 1 2 3 \nvt 1 2 \n");
        assert_eq!((s.odd.short.count, s.odd.number.count), (2, 1));
    }
}
