//! Wavefront OBJ and MTL -> scene.
//!
//! The text becomes `statements` (lines, numbers, names, faces; every error with its line), which hold the
//! geometry of the file (`load::geometry`): vertices, faces, points and lines in runs of one object, group and material.
//!
//! What the format leaves open is decided so: faces without normals are flat unless a smoothing group says otherwise;
//! vertex colours are sRGB-coded, MTL colours linear; the fourth number of a vertex is a weight for rational curves and
//! ignored; every surface is seen from both sides; a face whose normals point to its back is flipped.

mod chunk;
mod faults;
mod join;
mod split;
mod statements;

use super::geometry::finish::{Kind, finish};
use super::geometry::{color, up};
use super::limits::Budget;
use super::mtl;
use super::text::encoding::to_ascii_superset;
use super::{LoadError, LoadOptions, Loaded, Source, Warnings};

/// Loads an OBJ file and the MTL files and pictures it names; its memory is taken from `budget`.
///
/// # Errors
/// When a face names data that does not exist, or when loading would exceed the budget. A file without faces is an empty
/// scene.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let file = source.path.as_path();
    let mut warnings = Warnings::default();
    let mut statements = statements::read(&to_ascii_superset(&source.bytes), file, budget)?;
    statements.odd.warn(file, &mut warnings);
    let coding = color::settle(&mut statements.geometry.soup.colors);
    coding.warning(["obj-color-bytes", "obj-color-range"], file).into_iter().for_each(|told| warnings.push(told));
    let kind = Kind {
        format: "Wavefront OBJ",
        of_faces: ["obj-not-finite", "obj-equal-corners", "obj-rounded-face", "obj-crossing-face", "obj-turned-face"],
        no_faces: "obj-no-faces",
        place: |line| line.to_string(),
        otherwise: up::UNSAID,
        materials: mtl::load,
    };
    finish(statements.geometry, &kind, source, options, warnings, budget)
}

#[cfg(test)]
mod fuzz;
#[cfg(test)]
mod tests;
