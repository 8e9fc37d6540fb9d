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

use super::geometry::bare::{self, Bare, Said};
use super::limits::Budget;
use super::{Diagnostic, LoadError, LoadOptions, Loaded, Source};
use crate::math::DVec3;
use crate::scene::UpAxis;
use std::collections::HashMap;
use std::path::Path;

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
    let triangles = Triangles { file: &source.path, budget, bare: Bare::default(), known: HashMap::new() };
    let (bare, format) = match encoding {
        Encoding::Text => (text::read(source, triangles)?, "STL (ascii)"),
        Encoding::Binary => (binary::read(source, triangles)?, "STL (binary)"),
    };
    // Layers are built upwards along z.
    let otherwise = (UpAxis::Z, "STL does not say; what is made to be printed stands on the xy plane");
    bare::load(bare, format, otherwise, source, options, budget)
}

/// Triangles one after another, whose equal places become one vertex.
struct Triangles<'a> {
    file: &'a Path,
    budget: &'a mut Budget,
    bare: Bare,
    /// Vertices by the bits of their places.
    known: HashMap<[u64; 3], u32>,
}

impl Triangles<'_> {
    /// Bytes that a vertex takes in the table, which is never less than half full once it has grown.
    const KNOWN: u64 = 2 * 40;

    fn add(&mut self, corners: [DVec3; 3], color: Option<[f32; 4]>) -> Result<(), Diagnostic> {
        let painted = u64::from(color.is_some());
        let taken = Bare::charge_face(self.budget, 3).and_then(|()| self.budget.take(painted, Bare::COLOR));
        taken.map_err(|over| Diagnostic::over_budget(self.file, over))?;
        let mut numbers = [0; 3];
        for (number, place) in numbers.iter_mut().zip(corners) {
            *number = self.vertex(place)?;
        }
        self.bare.face(&numbers, &Said { color, ..Said::default() });
        Ok(())
    }

    fn vertex(&mut self, place: DVec3) -> Result<u32, Diagnostic> {
        // Adding 0 makes one zero of two.
        let key = place.to_array().map(|x| (x + 0.0).to_bits());
        if let Some(&number) = self.known.get(&key) {
            return Ok(number);
        }
        let taken = Bare::charge_vertices(self.budget, 1).and_then(|()| self.budget.take(1, Self::KNOWN));
        taken.map_err(|over| Diagnostic::over_budget(self.file, over))?;
        let number = self.bare.positions.len();
        if number as u64 >= Bare::LARGEST {
            let text = format!("more than {} vertices", Bare::LARGEST);
            return Err(Diagnostic::new("stl-too-large", self.file, "", text).remedy("split the file"));
        }
        #[expect(clippy::cast_possible_truncation, reason = "checked just before")]
        let number = number as u32;
        self.known.insert(key, number);
        self.bare.positions.push(place);
        Ok(number)
    }
}

#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod tests;
