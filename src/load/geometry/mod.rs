//! Geometry without a hierarchy -> scene: vertices, faces, points and lines, in runs that share a name and a material.
//!
//! The geometry comes from the statements of an OBJ ([`obj`](super::obj)), or is all that other formats hold
//! ([`plain_mesh`]). It is centred in `f64` and rounded ([`place`](super::place)), and becomes one mesh and one instance for
//! each run (`assemble`); points and lines (`wire_statements`) get a width ([`wires`](super::wires)); materials come from the
//! MTL files or pictures that it names ([`mtl`](super::mtl), `plain_mesh::pictures`); `finish` runs all these steps.

mod assemble;
pub(super) mod color;
pub(super) mod finish;
#[cfg(test)]
pub(super) mod invariants;
mod pairs;
pub(super) mod plain_mesh;
mod smoothing_groups;
mod soup;
pub(super) mod up;
mod wire_statements;

pub(super) use soup::{Corner, NONE, Soup};

use std::ops::Range;

/// Largest number of a vertex, so that counts of corners, faces and normals can be added without overflow.
pub(super) const LARGEST: u32 = u32::MAX / 4;

/// Geometry of a file, before it is placed in a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Geometry {
    pub soup: Soup,
    /// Vertices of triangles, for a file without other faces, without attributes of corners except those of
    /// vertices, and without normals: most scans. [`Self::faces`] and the lists beside it are empty then.
    pub triangles: Vec<[u32; 3]>,
    /// Lines and numbers of the triangles in the file; empty where the line of each is its number.
    pub face_spans: Vec<FaceSpan>,
    pub faces: Vec<Face>,
    pub wire_statements: Vec<WireStatement>,
    /// Whether every vertex is a point instead, with the normal of the same index; texture coordinates are ignored.
    pub is_cloud: bool,
    pub runs: Vec<Run>,
    /// Names; 0 is the empty one.
    pub names: Vec<String>,
    /// Files that runs have their materials from: MTL files or pictures, with the lines that name them.
    pub sources: Vec<(u32, String)>,
    /// Decimal places of the finest coordinate.
    pub places: i32,
    /// The first comments of the file, without comment characters.
    pub comments: Vec<String>,
    /// Number of faces with fewer than 3 corners.
    pub few_corners: u32,
}

/// One face, without its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    /// Index into [`Geometry::runs`].
    pub run: u32,
    /// Smoothing group; 0: none.
    pub smoothing: u32,
    /// Number of corners, at least 3.
    pub arity: u32,
    /// Line in the file.
    pub line: u32,
    /// Index of the face in the file, counting dropped faces.
    pub number: u32,
    /// Index of its first corner in [`Soup::corners`].
    pub first: u32,
}

impl Face {
    /// Range of its corners in [`Soup::corners`].
    pub(super) fn corners(&self) -> Range<usize> {
        self.first as usize..self.first as usize + self.arity as usize
    }
}

/// Faces on consecutive lines, with equal numbers of corners and equal attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FaceSpan {
    /// The first face.
    pub face: Face,
    pub count: u32,
}

impl FaceSpan {
    /// The `i`th face; the one behind the last is the face that may extend the span.
    pub(super) fn face(&self, i: u32) -> Face {
        let Face { line, number, first, arity, .. } = self.face;
        let (line, number) = (line.saturating_add(i), number.saturating_add(i));
        Face { line, number, first: first.saturating_add(i.saturating_mul(arity)), ..self.face }
    }

    /// All faces of several spans.
    pub(super) fn all(some: &[Self]) -> Vec<Face> {
        let mut faces = Vec::with_capacity(some.iter().map(|span| span.count as usize).sum());
        some.iter().for_each(|span| faces.extend((0..span.count).map(|i| span.face(i))));
        faces
    }
}

/// One `p` or `l` statement, without its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WireStatement {
    /// Index into [`Geometry::runs`].
    pub run: u32,
    /// Line in the file.
    pub line: u32,
    /// Number of corners, at least 1, or 2 for a line.
    pub arity: u32,
    /// Whether its corners are joined.
    pub joined: bool,
}

/// State shared by faces between two `o`, `g` or `usemtl` statements; indices into [`Geometry::names`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Run {
    pub object: u32,
    pub group: u32,
    /// `None` before the first `usemtl`.
    pub material: Option<u32>,
}

impl Geometry {
    /// Converts the triangles into faces.
    #[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 corners")]
    pub(super) fn spell_out(&mut self) {
        let triangles = std::mem::take(&mut self.triangles);
        let corner = |&position: &u32| Corner { position, uv: NONE, normal: NONE };
        self.soup.corners = triangles.as_flattened().iter().map(corner).collect();
        let mut face_spans = std::mem::take(&mut self.face_spans);
        if face_spans.is_empty() {
            let face = Face { run: 0, smoothing: 0, arity: 3, line: 0, number: 0, first: 0 };
            face_spans.push(FaceSpan { face, count: triangles.len() as u32 });
        }
        self.faces = FaceSpan::all(&face_spans);
    }

    /// Makes every vertex a point; the `i`th has the `i`th normal where there are as many.
    pub(super) fn draw_points(&mut self) {
        self.is_cloud = true;
        if self.soup.normals.len() != self.soup.positions.len() {
            self.soup.normals.clear();
        }
        if self.runs.is_empty() {
            self.runs.push(Run::default());
        }
        if self.names.is_empty() {
            self.names.push(String::new());
        }
    }
}
