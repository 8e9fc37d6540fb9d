//! Joins runs of lines, which were read in parallel, into the statements of the whole text, as if read sequentially.

use super::chunk::{COMMENTS, Chunk, NO_COLOR, OPEN, count, resolve};
use super::statements::Statements;
use crate::load::geometry::{Corner, FaceSpan, Geometry, LARGEST, NONE, Run, Soup, WireStatement};
use crate::math::{DVec2, DVec3, Vec3};
use crate::parts::{cut, joined};
use rayon::prelude::*;
use std::collections::HashMap;

/// Statements of the whole text, and whether its faces are valid.
pub(super) struct Joined {
    pub statements: Statements,
    /// Whether a corner cannot be read, or names a vertex, coordinate or normal that does not exist.
    pub faulty: bool,
}

/// Start of a run of lines in the whole text: counts of what stands before it.
#[derive(Clone, Copy, Debug, Default)]
struct Preceding {
    counts: [u32; 3],
    lines: u32,
    faces: u32,
    smoothing: u32,
}

/// Joins runs in the order of the text.
///
/// # Errors
/// The number of vertices, corners or faces, when that exceeds [`LARGEST`].
pub(super) fn join(mut chunks: Vec<Chunk>) -> Result<Joined, u64> {
    let mut out = Statements::default();
    let mut table = Table::new();
    let mut last = Run::default();
    let mut before = Preceding::default();
    let (mut begins, mut runs) = (Vec::with_capacity(chunks.len()), Vec::with_capacity(chunks.len()));
    check_sizes(&chunks)?;
    for chunk in &mut chunks {
        begins.push(before);
        runs.push(table.take(chunk, &mut last));
        gather(&mut out, chunk, before.lines);
        before.advance(chunk);
    }
    let counts = before.counts;

    let colors = chunks.iter().any(|c| !c.colors.is_empty());
    let colors = if colors { all_colors(&chunks, &begins, counts[0]) } else { painted(&chunks, counts[0]) };
    let (positions, uvs, normals) = vertices(&mut chunks);
    let face_spans = face_spans(&chunks, &begins, &runs);
    let is_plain = uvs.is_empty() && normals.is_empty() && colors.is_empty() && table.runs.len() == 1;
    let plain = if is_plain { triangles(&chunks, &begins, counts[0], &face_spans) } else { None };
    let there = VertexCounts { counts, uvs: &uvs, normals: &normals };
    let (corners, mut faulty) = if plain.is_some() { (Vec::new(), false) } else { corners(&chunks, &begins, &there) };
    let wire_corners = wire_statements(&chunks, &begins, &runs, &there, &mut out);
    faulty |= chunks.iter().any(|c| c.faulty);
    drop(chunks);
    let soup = Soup { positions, uvs, normals, colors, alphas: Vec::new(), corners, wire_corners };
    out.geometry = Geometry { soup, names: table.names, runs: table.runs, ..out.geometry };
    match plain {
        Some(triangles) => (out.geometry.triangles, out.geometry.face_spans) = (triangles, face_spans),
        None => out.geometry.faces = FaceSpan::all(&face_spans),
    }
    Ok(Joined { statements: out, faulty })
}

/// Faces of all runs of lines, renumbered for the whole text.
fn face_spans(chunks: &[Chunk], begins: &[Preceding], runs: &[Vec<u32>]) -> Vec<FaceSpan> {
    let mut all: Vec<FaceSpan> = Vec::with_capacity(chunks.iter().map(|chunk| chunk.faces.len()).sum());
    let mut first = 0;
    for ((chunk, before), runs) in chunks.iter().zip(begins).zip(runs) {
        for &FaceSpan { mut face, count: faces } in &chunk.faces {
            face.first += first;
            face.run = runs[face.run as usize];
            face.line = face.line.saturating_add(before.lines);
            face.number += before.faces;
            face.smoothing = if face.smoothing == OPEN { before.smoothing } else { face.smoothing };
            match all.last_mut() {
                Some(last) if last.face(last.count) == face => last.count += faces,
                _ => all.push(FaceSpan { face, count: faces }),
            }
        }
        first += count(chunk.corners.len());
    }
    all
}

/// Vertices of the triangles, where the text holds only triangles that name positions alone; `None` otherwise, and where a
/// vertex is not below `vertices`.
fn triangles(chunks: &[Chunk], begins: &[Preceding], vertices: u32, face_spans: &[FaceSpan]) -> Option<Vec<[u32; 3]>> {
    let is_plain = |span: &FaceSpan| (span.face.arity, span.face.smoothing) == (3, 0);
    let of_faces = |chunk: &Chunk| chunk.wire_statements.is_empty() && chunk.dropped.is_empty() && !chunk.faulty;
    let faces: u64 = chunks.iter().map(|chunk| u64::from(chunk.face_count)).sum();
    let drawn: u64 = face_spans.iter().map(|span| u64::from(span.count)).sum();
    if drawn == 0 || drawn != faces || !face_spans.iter().all(is_plain) || !chunks.iter().all(of_faces) {
        return None;
    }
    let numbers = chunks.iter().map(|chunk| chunk.corners.vertices_alone()).collect::<Option<Vec<&[u32]>>>()?;
    let mut all: Vec<[u32; 3]> = bytemuck::zeroed_vec(usize::try_from(drawn).ok()?);
    let parts = cut(&mut all, numbers.iter().map(|numbers| numbers.len() / 3));
    let fill = |((part, numbers), before): ((&mut [[u32; 3]], &[u32]), &Preceding)| {
        part.as_flattened_mut().iter_mut().zip(numbers).all(|(vertex, &number)| {
            // 0 means none; it wraps to a number that is never below `vertices`.
            *vertex = resolve(number, before.counts[0]).unwrap_or(0).wrapping_sub(1);
            *vertex < vertices
        })
    };
    parts.into_par_iter().zip(numbers).zip(begins).all(fill).then_some(all)
}

fn check_sizes(chunks: &[Chunk]) -> Result<(), u64> {
    let sum = |of: fn(&Chunk) -> usize| chunks.iter().map(|c| of(c) as u64).sum::<u64>();
    let sizes = [
        sum(|c| c.positions.len()),
        sum(|c| c.uvs.len()),
        sum(|c| c.normals.len()),
        sum(|c| c.corners.len()),
        sum(|c| c.wire_corners.len()),
        sum(|c| c.face_count as usize),
    ];
    let largest = sizes.into_iter().max().unwrap_or_default();
    if largest > u64::from(LARGEST) { Err(largest) } else { Ok(()) }
}

#[expect(clippy::cast_possible_truncation, reason = "sizes were checked to fit")]
impl Preceding {
    fn advance(&mut self, chunk: &Chunk) {
        let sizes = [chunk.positions.len(), chunk.uvs.len(), chunk.normals.len()];
        for (count, size) in self.counts.iter_mut().zip(sizes) {
            *count += size as u32;
        }
        self.lines = self.lines.saturating_add(chunk.lines);
        self.faces += chunk.face_count;
        if chunk.smoothing != OPEN {
            self.smoothing = chunk.smoothing;
        }
    }
}

/// Moves what needs no renumbering, except for lines, to the whole.
fn gather(out: &mut Statements, chunk: &mut Chunk, lines: u32) {
    let geometry = &mut out.geometry;
    let library = |(line, name): (u32, String)| (line.saturating_add(lines), name);
    geometry.sources.extend(std::mem::take(&mut chunk.libraries).into_iter().map(library));
    let room = COMMENTS - geometry.comments.len();
    geometry.comments.extend(std::mem::take(&mut chunk.comments).into_iter().take(room));
    geometry.places = geometry.places.max(chunk.places);
    out.odd.append(std::mem::take(&mut chunk.odd), lines);
}

/// Interned names and runs of the whole text.
struct Table {
    names: Vec<String>,
    name_ids: HashMap<String, u32>,
    runs: Vec<Run>,
    run_ids: HashMap<Run, u32>,
}

impl Table {
    fn new() -> Self {
        Self {
            names: vec![String::new()],
            name_ids: HashMap::from([(String::new(), 0)]),
            runs: Vec::new(),
            run_ids: HashMap::new(),
        }
    }

    /// Number in the whole text of each run of a chunk. `last` is the run of the faces before the chunk, and becomes that of
    /// its last faces.
    fn take(&mut self, chunk: &mut Chunk, last: &mut Run) -> Vec<u32> {
        let names: Vec<u32> = std::mem::take(&mut chunk.names).into_iter().map(|name| self.name(name)).collect();
        let known = |id: u32, open: u32| if id == OPEN { open } else { names[id as usize] };
        let before = *last;
        let closed = |run: &Run| Run {
            object: known(run.object, before.object),
            group: known(run.group, before.group),
            material: if run.material == Some(OPEN) { before.material } else { run.material.map(|m| known(m, 0)) },
        };
        let runs = chunk.runs.iter().map(|run| self.run(closed(run))).collect();
        *last = closed(&chunk.last);
        runs
    }

    fn name(&mut self, name: String) -> u32 {
        let next = count(self.names.len());
        if let Some(&known) = self.name_ids.get(&name) {
            return known;
        }
        self.names.push(name.clone());
        self.name_ids.insert(name, next);
        next
    }

    fn run(&mut self, run: Run) -> u32 {
        let next = count(self.runs.len());
        let id = *self.run_ids.entry(run).or_insert(next);
        if id == next {
            self.runs.push(run);
        }
        id
    }
}

fn all_colors(chunks: &[Chunk], begins: &[Preceding], positions: u32) -> Vec<[f32; 3]> {
    let mut all = vec![NO_COLOR; positions as usize];
    for (chunk, before) in chunks.iter().zip(begins) {
        let first = before.counts[0] as usize;
        all[first..first + chunk.colors.len()].copy_from_slice(&chunk.colors);
    }
    all
}

/// Colours of vertices from ZBrush's comments; empty where there are none.
fn painted(chunks: &[Chunk], positions: u32) -> Vec<[f32; 3]> {
    let mut paint = chunks.iter().flat_map(|chunk| &chunk.paint).peekable();
    if paint.peek().is_none() {
        return Vec::new();
    }
    let unit = |color: &[u8; 3]| color.map(|c| f32::from(c) / 255.0);
    let mut all: Vec<[f32; 3]> = paint.take(positions as usize).map(unit).collect();
    all.resize(positions as usize, NO_COLOR);
    all
}

fn vertices(chunks: &mut [Chunk]) -> (Vec<DVec3>, Vec<DVec2>, Vec<Vec3>) {
    let positions = joined(chunks.iter_mut().map(|c| std::mem::take(&mut c.positions)).collect());
    let uvs = joined(chunks.iter_mut().map(|c| std::mem::take(&mut c.uvs)).collect());
    let normals = joined(chunks.iter_mut().map(|c| std::mem::take(&mut c.normals)).collect());
    (positions, uvs, normals)
}

/// Vertex data that corners may name.
struct VertexCounts<'a> {
    counts: [u32; 3],
    uvs: &'a [DVec2],
    normals: &'a [Vec3],
}

impl VertexCounts<'_> {
    /// The corner, and whether it names a vertex, coordinate or normal that does not exist.
    #[inline]
    fn corner(&self, numbers: &[u32; 3], before: &Preceding) -> (Corner, bool) {
        let number = |kind: usize| resolve(numbers[kind], before.counts[kind]).filter(|&n| n <= self.counts[kind]);
        let [position, uv, normal] = [number(0), number(1), number(2)];
        // 0 means none.
        let index = |number: Option<u32>| number.map_or(NONE, |n| n.wrapping_sub(1));
        let (uv_index, normal_index) = (index(uv), index(normal));
        let is_finite = self.uvs.get(uv_index as usize).is_some_and(|uv| uv.is_finite());
        let has_length = self.normals.get(normal_index as usize).is_some_and(|&n| n != Vec3::ZERO);
        let corner = Corner {
            position: index(position),
            uv: if is_finite { uv_index } else { NONE },
            normal: if has_length { normal_index } else { NONE },
        };
        (corner, position.is_none() || uv.is_none() || normal.is_none())
    }
}

/// Moves points and lines to the whole and returns their corners. Those that name a missing vertex are counted and left out.
fn wire_statements(
    chunks: &[Chunk],
    begins: &[Preceding],
    runs: &[Vec<u32>],
    there: &VertexCounts,
    out: &mut Statements,
) -> Vec<Corner> {
    let mut corners = Vec::with_capacity(chunks.iter().map(|c| c.wire_corners.len()).sum());
    for ((chunk, before), runs) in chunks.iter().zip(begins).zip(runs) {
        let mut rest = chunk.wire_corners.as_slice();
        for wire in &chunk.wire_statements {
            let (numbers, after) = rest.split_at(wire.arity as usize);
            rest = after;
            let own = numbers.iter().map(|numbers| there.corner(numbers, before).0);
            let first = corners.len();
            corners.extend(own);
            let line = wire.line.saturating_add(before.lines);
            if corners[first..].iter().any(|corner| corner.position == NONE) {
                corners.truncate(first);
                out.odd.wire_statements.note(line, if wire.joined { b"l" } else { b"p" });
            } else {
                out.geometry.wire_statements.push(WireStatement { run: runs[wire.run as usize], line, ..*wire });
            }
        }
    }
    corners
}

/// Corners of all faces, and whether one of them, or of the dropped faces, names data that does not exist.
fn corners(chunks: &[Chunk], begins: &[Preceding], there: &VertexCounts) -> (Vec<Corner>, bool) {
    // The threads that fill the parts are the ones that touch the pages first.
    let mut all: Vec<Corner> = bytemuck::zeroed_vec(chunks.iter().map(|c| c.corners.len()).sum());
    let parts = cut(&mut all, chunks.iter().map(|chunk| chunk.corners.len()));
    let fill = |((part, chunk), before): ((&mut [Corner], &Chunk), &Preceding)| {
        let mut faulty = chunk.dropped.iter().any(|numbers| there.corner(numbers, before).1);
        for (i, corner) in part.iter_mut().enumerate() {
            let odd;
            (*corner, odd) = there.corner(&chunk.corners.get(i), before);
            faulty |= odd;
        }
        faulty
    };
    let faulty = parts.into_par_iter().zip(chunks).zip(begins).map(fill).reduce(|| false, |a, b| a | b);
    (all, faulty)
}
