//! Wavefront OBJ and MTL -> scene.
//!
//! The text goes through `statements` (lines, numbers, names, faces; every error with its line), which leave vertices and
//! corners (`soup`). What follows is that of all geometry without a hierarchy (`finish`): it is centred in `f64` and rounded
//! (`load::place`), and becomes one mesh and one instance for each run of faces with the same object, group and material
//! (`assemble`). Materials come from MTL files (`mtl`). Files of other formats that hold geometry alone are given as such
//! (`bare`).
//!
//! Points and lines (`strokes`) get a width (`load::wires`).
//!
//! What the text leaves open is decided so: faces without normals are flat unless a smoothing group says otherwise;
//! vertex colours are sRGB-coded, MTL colours linear; the fourth number of a vertex is a weight for rational curves and
//! ignored; every surface is seen from both sides; a face whose normals point to its back is turned round.

mod assemble;
pub(super) mod bare;
mod chunk;
mod color;
mod encoding;
mod faults;
mod finish;
mod join;
mod lines;
mod mtl;
mod pairs;
mod smooth;
mod soup;
mod split;
mod statements;
mod strokes;
mod up;

use super::limits::Budget;
use super::{LoadError, LoadOptions, Loaded, Source, Warnings};
use finish::Kind;

/// Loads an OBJ file and the MTL files and pictures it names; whatever that takes comes out of `budget`.
///
/// # Errors
/// When a face refers to what is not there, or when it would take more than is left. A file without faces is an empty
/// scene.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let file = source.path.as_path();
    let mut warnings = Warnings::default();
    let mut statements = statements::read(&encoding::to_ascii_superset(&source.bytes), file, budget)?;
    statements.odd.warn(file, &mut warnings);
    let coding = color::settle(&mut statements.soup.colors);
    coding.warning(["obj-color-bytes", "obj-color-range"], file).into_iter().for_each(|told| warnings.push(told));
    let kind = Kind {
        format: "Wavefront OBJ",
        of_faces: ["obj-not-finite", "obj-equal-corners", "obj-rounded-face", "obj-crossing-face", "obj-turned-face"],
        no_faces: "obj-no-faces",
        place: |line| line.to_string(),
        otherwise: up::UNSAID,
    };
    finish::finish(statements, &kind, (source, options), warnings, budget)
}

#[cfg(test)]
pub(super) mod fuzz;
#[cfg(test)]
mod tests;
