//! STL, the format of stereolithography (3D Systems, 1988) -> scene: triangles as text or in binary.
//!
//! Every triangle brings places of its own; those that are equal bit for bit become one vertex, so that faces are
//! connected. Surfaces are flat: the normal that the file gives for a facet says nothing that its corners do not, and is
//! often wrong, so that it is not read. Its two bytes of attributes are a colour where something says so.
//!
//! The reader is our own: crates for STL take a binary file that begins with `solid` for text, and do not say where in the
//! file a fault is.

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

/// How triangles are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As words.
    Text,
    /// As records of 50 bytes.
    Binary,
}

/// Loads an STL file; whatever that takes comes out of `budget`.
///
/// # Errors
/// When the text is not understood, or a binary file holds fewer triangles than it says: with the line or byte. A file
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

/// What the memory comes out of that triangles are made with.
struct Making<'a> {
    file: &'a Path,
    budget: &'a mut Budget,
    /// Bytes of what is forgotten when vertices are known.
    held: u64,
}

impl Making<'_> {
    /// Takes the memory of so many triangles, before they are made.
    fn take(&mut self, triangles: usize) -> Result<(), Diagnostic> {
        let taken = PlainMesh::charge_faces(self.budget, triangles as u64, 3);
        taken.map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    /// Takes the memory of so many triangles' colours, before they are made.
    fn take_colors(&mut self, triangles: usize) -> Result<(), Diagnostic> {
        let taken = self.budget.take(triangles as u64, PlainMesh::COLOR);
        taken.map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    /// Makes sure of room for what is held until vertices are known, so many times so many bytes more than before.
    fn hold(&mut self, count: usize, bytes: u64) -> Result<(), Diagnostic> {
        self.held = self.held.saturating_add((count as u64).saturating_mul(bytes));
        let mut for_now = *self.budget;
        for_now.take(self.held, 1).map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    /// Triangles whose memory was taken: corner `c` is at `place(c)`, and equal places, which are told by their `bits`, become
    /// one vertex. There are as many colours as triangles, or none.
    ///
    /// # Errors
    /// When there are too many, or memory for what joins them is not left.
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
        // Adding 0 makes one zero of two.
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
