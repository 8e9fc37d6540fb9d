//! Geometry without a hierarchy -> scene: vertices, faces, points and lines, in runs that share a name and a material.
//!
//! The text of an OBJ leaves it ([`obj`](super::obj)), files of other formats hold nothing else ([`plain_mesh`]). It is
//! centred in `f64` and rounded ([`place`](super::place)), and becomes one mesh and one instance for each run (`assemble`),
//! points and lines (`wire_statements`) get a width ([`wires`](super::wires)), materials come from the MTL files or
//! pictures that it names ([`mtl`](super::mtl), `plain_mesh::pictures`); `finish` is the whole way.

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

/// The largest number of a vertex, so that counts of corners, faces and normals can be added up.
pub(super) const LARGEST: u32 = u32::MAX / 4;

/// What a file holds, before it has a place in a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Geometry {
    pub soup: Soup,
    /// The vertices of triangles, of a file that has no other faces and says nothing of their corners but what it says of
    /// vertices, and no normals: most scans. [`Self::faces`] and what goes with them are empty then.
    pub triangles: Vec<[u32; 3]>,
    /// Where these stand in the file; empty where the line of each is its number.
    pub face_spans: Vec<FaceSpan>,
    pub faces: Vec<Face>,
    pub wire_statements: Vec<WireStatement>,
    /// Whether every vertex is a point instead, which has the normal of the same number; coordinates do not count.
    pub is_cloud: bool,
    pub runs: Vec<Run>,
    /// Names; 0 is the empty one.
    pub names: Vec<String>,
    /// What runs have their materials from: MTL files, or pictures, which these name; with the lines that name them.
    pub sources: Vec<(u32, String)>,
    /// Decimal places of the finest coordinate.
    pub places: i32,
    /// What the file says of itself: the first comments, without their signs.
    pub comments: Vec<String>,
    /// Faces that had fewer than 3 corners.
    pub few_corners: u32,
}

/// One face, without its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    /// Which of [`Geometry::runs`].
    pub run: u32,
    /// Smoothing group; 0: none.
    pub smoothing: u32,
    /// Number of corners, at least 3.
    pub arity: u32,
    /// Where it starts in the file.
    pub line: u32,
    /// Which of the file's faces, from 0; those that are not kept count.
    pub number: u32,
    /// The first of its corners in [`Soup::corners`].
    pub first: u32,
}

impl Face {
    /// Its corners in [`Soup::corners`].
    pub(super) fn corners(&self) -> Range<usize> {
        self.first as usize..self.first as usize + self.arity as usize
    }
}

/// Faces that follow each other line by line, with as many corners each, and all else that they share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FaceSpan {
    /// The first of them.
    pub face: Face,
    pub count: u32,
}

impl FaceSpan {
    /// The `i`th of them; the one behind the last is what may be added.
    pub(super) fn face(&self, i: u32) -> Face {
        let Face { line, number, first, arity, .. } = self.face;
        let (line, number) = (line.saturating_add(i), number.saturating_add(i));
        Face { line, number, first: first.saturating_add(i.saturating_mul(arity)), ..self.face }
    }

    /// All faces of some of them.
    pub(super) fn all(some: &[Self]) -> Vec<Face> {
        let mut faces = Vec::with_capacity(some.iter().map(|span| span.count as usize).sum());
        some.iter().for_each(|span| faces.extend((0..span.count).map(|i| span.face(i))));
        faces
    }
}

/// One `p` or `l` statement, without its corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WireStatement {
    /// Which of [`Geometry::runs`].
    pub run: u32,
    /// Where it stands in the file.
    pub line: u32,
    /// Number of corners, at least 1, or 2 of a line.
    pub arity: u32,
    /// Whether its corners are joined.
    pub joined: bool,
}

/// What faces between two `o`, `g` or `usemtl` statements share; indices into [`Geometry::names`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Run {
    pub object: u32,
    pub group: u32,
    /// `None` before the first `usemtl`.
    pub material: Option<u32>,
}

impl Geometry {
    /// Makes faces of the triangles.
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
