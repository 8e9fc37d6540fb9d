//! PLY, the Stanford triangle format (G. Turk, *The PLY Polygon File Format*, 1994) -> scene: text or binary in either
//! byte order, and the pictures that it names.
//!
//! A header lists elements and their properties (`header`); their values follow in that order (`body`). The loader reads
//! (`geometry`), under the names that programs use (`meaning`): of `vertex` the position, normal, texture
//! coordinates, colour and opacity; of `face` its list of vertices, its colour, and the texture coordinates and picture of
//! its corners (`texcoord`, `texnumber`); of `tristrips` the vertices, where −1 starts another strip; of `edge` its `vertex1`
//! and `vertex2`, and its colour. Pictures are those of comments `TextureFile`. Vertices that nothing joins, as in scanned
//! clouds, are points. Contents that would change the look and are not read cost a warning (`told`).
//!
//! What the format leaves open is decided as for OBJ: colours are sRGB-coded, faces without normals flat, and every
//! surface is seen from both sides. Integer colours are 0…255, or 0…65535 where they have 16 bits; floats are 0…1, or 0…255
//! where they are far above 1.
//!
//! The reader is our own: the crates for PLY allocate memory by the counts that a header claims, or do not report where in
//! the file a fault is.

mod body;
mod geometry;
mod header;
mod meaning;
mod packed;
mod told;

use super::geometry::plain_mesh;
use super::limits::Budget;
use super::{LoadError, LoadOptions, Loaded, Source};
use crate::scene::UpAxis;
use header::{Encoding, Header};

/// Loads a PLY file; its memory is taken from `budget`.
///
/// # Errors
/// When the header is invalid, values are missing or not numbers, or a face names a vertex that does not exist:
/// with the line, or in binary files the byte. A file without vertices is an empty scene.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let header = Header::read(&source.bytes, &source.path)?;
    let bare = geometry::read(&header, source, budget)?;
    let format = match header.encoding {
        Encoding::Text => "PLY (ascii)",
        Encoding::LittleEndian => "PLY (binary, little-endian)",
        Encoding::BigEndian => "PLY (binary, big-endian)",
    };
    let otherwise = (UpAxis::Y, "PLY does not say, and nothing speaks for +Z");
    plain_mesh::load(bare, format, otherwise, source, options, budget)
}

#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod tests;
