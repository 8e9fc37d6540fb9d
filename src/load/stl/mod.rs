//! STL, the format of stereolithography (3D Systems, 1988) -> scene: triangles as text or in binary.
//!
//! Every triangle brings positions of its own; bitwise equal ones become one vertex, so that faces are
//! connected. Surfaces are flat: the normal that the file gives for a facet follows from its corners, and is
//! often wrong, so that it is not read. Its two bytes of attributes are a colour where the file marks them as such.
//!
//! The reader is our own: crates for STL take a binary file that begins with `solid` for text, and do not report where in
//! the file a fault is.

mod binary;
mod text;
mod weld;

use super::geometry::plain_mesh::{self, PlainMesh};
use super::limits::Budget;
use super::{Diagnostic, LoadError, LoadOptions, Loaded, Source};
use crate::math::DVec3;
use crate::scene::UpAxis;
use bytemuck::Pod;
use rayon::prelude::*;
use std::path::Path;
use weld::{Welded, weld};

pub(super) use binary::is_exact;

/// Encoding of the triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Words.
    Text,
    /// Records of 50 bytes.
    Binary,
}

/// Loads an STL file; its memory is taken from `budget`.
///
/// # Errors
/// When the text is invalid, or a binary file holds fewer triangles than it claims: with the line or byte. A file
/// without triangles is an empty scene.
pub fn load(
    source: &Source,
    encoding: Encoding,
    options: &LoadOptions,
    budget: &mut Budget,
) -> Result<Loaded, LoadError> {
    let making = Making { file: &source.path, budget: &mut *budget, held: 0 };
    let (bare, format) = match encoding {
        Encoding::Text => (text::read(source, making)?, "STL (ascii)"),
        Encoding::Binary => (binary::read(source, making)?, "STL (binary)"),
    };
    // Layers are built upwards along z.
    let otherwise = (UpAxis::Z, "STL does not say; what is made to be printed stands on the xy plane");
    plain_mesh::load(bare, format, otherwise, source, options, budget)
}

/// Memory accounting while triangles are made.
struct Making<'a> {
    file: &'a Path,
    budget: &'a mut Budget,
    /// Bytes that are freed once vertices are known.
    held: u64,
}

impl Making<'_> {
    /// Takes the memory of `triangles` triangles, before they are made.
    fn take(&mut self, triangles: usize) -> Result<(), Diagnostic> {
        let taken = PlainMesh::charge_faces(self.budget, triangles as u64, 3);
        taken.map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    /// Takes the memory of the colours of `triangles` triangles, before they are made.
    fn take_colors(&mut self, triangles: usize) -> Result<(), Diagnostic> {
        let taken = self.budget.take(triangles as u64, PlainMesh::COLOR);
        taken.map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    /// Checks that the budget has room for a further `count` items of `bytes` bytes, held until vertices are known.
    fn hold(&mut self, count: usize, bytes: u64) -> Result<(), Diagnostic> {
        self.held = self.held.saturating_add((count as u64).saturating_mul(bytes));
        let mut for_now = *self.budget;
        for_now.take(self.held, 1).map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    /// Makes triangles whose memory was taken: corner `c` lies at `place(c)`, and positions with equal `bits` become
    /// one vertex. There are as many colours as triangles, or none.
    ///
    /// # Errors
    /// When there are too many corners, or too little memory is left for welding.
    fn triangles<P: Pod + Eq + Send + Sync>(
        mut self,
        corners: usize,
        place: impl Fn(usize) -> DVec3 + Sync,
        bits: impl Fn(DVec3) -> P + Sync,
        colors: Vec<[f32; 4]>,
    ) -> Result<PlainMesh, Diagnostic> {
        self.hold(corners, weld::cost::<P>())?;
        if corners > weld::LARGEST {
            let text = format!("more than {} corners", weld::LARGEST);
            return Err(Diagnostic::new("stl-too-large", self.file, "", text).remedy("split the file"));
        }
        // Adding 0 maps −0 to +0.
        let Welded { firsts, vertices } = weld(corners, |corner| bits(place(corner) + DVec3::ZERO));
        PlainMesh::charge_vertices(self.budget, firsts.len() as u64)
            .map_err(|over| Diagnostic::over_budget(self.file, over))?;
        let positions = firsts.par_iter().map(|&corner| place(corner as usize)).collect();
        Ok(PlainMesh::of_triangles(positions, vertices, colors))
    }
}

#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod tests;
