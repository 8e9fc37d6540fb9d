//! Wavefront OBJ and MTL -> scene.
//!
//! The text goes through `statements` (lines, numbers, names, faces; every error with its line), which leave vertices and
//! corners (`soup`). These are centred in `f64` and rounded (`load::place`), and become one mesh and one instance for each run of
//! faces with the same object, group and material (`assemble`). Materials come from MTL files (`mtl`).
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
mod join;
mod lines;
mod mtl;
pub(super) mod number;
mod pairs;
mod smooth;
mod soup;
mod split;
mod statements;
mod strokes;
mod up;

use super::limits::{Budget, OverBudget};
use super::paths::Resolver;
use super::place::place;
use super::tangents;
use super::wires::{self, Wires};
use super::{Diagnostic, Facts, LoadError, LoadOptions, Loaded, Source, Warnings};
use crate::math::{DAffine3, DVec3};
use crate::scene::{Instance, Mesh, Scene, UpAxis};
use assemble::Assembled;
use statements::Statements;
use std::path::Path;

/// Loads an OBJ file and the MTL files and pictures it names; whatever that takes comes out of `budget`.
///
/// # Errors
/// When a face refers to what is not there, or when it would take more than is left. A file without faces is an empty
/// scene.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let file = source.path.as_path();
    let mut warnings = Warnings::default();
    let mut resolver = Resolver::new(source, options);

    // Geometry.
    let mut statements = statements::read(&encoding::to_ascii_superset(&source.bytes), file, budget)?;
    statements.odd.warn(file, &mut warnings);
    let coding = color::settle(&mut statements.soup.colors);
    coding.warning(["obj-color-bytes", "obj-color-range"], file).into_iter().for_each(|told| warnings.push(told));
    let soup = std::mem::take(&mut statements.soup);
    let colored = !soup.colors.is_empty();
    let placed = place(&soup.positions);
    let flatness = assemble::flatness(&placed.positions, statements.places);
    let mut assembled = assemble::assemble(&statements, &soup, &placed, options.polygons, flatness);
    let (wire_runs, mut wires): (Vec<u32>, Vec<Wires>) =
        strokes::assemble(&statements, &soup, &placed).into_iter().unzip();
    drop(soup);
    let codes = ["obj-not-finite", "obj-equal-corners", "obj-rounded-face", "obj-crossing-face", "obj-turned-face"];
    warn_of_faces(&assembled, codes, |line| line.to_string(), file, &mut warnings);
    if statements.faces.is_empty() && wires.is_empty() {
        let text = format!("{} vertices and no face: there is nothing to draw", statements.counts[0]);
        warnings.push(Diagnostic::new("obj-no-faces", file, "", text));
    }

    // Which way is up, what everything is made of, and where it stands.
    let (runs, meshes): (Vec<u32>, Vec<Mesh>) = std::mem::take(&mut assembled.meshes).into_iter().unzip();
    let (guessed, reason) = up::guess(&statements.comments, &meshes, &placed, up::UNSAID);
    let name = |run: &u32| statements.runs[*run as usize].material.map(|id| statements.names[id as usize].as_str());
    let names: Vec<Option<&str>> = runs.iter().chain(&wire_runs).map(name).collect();
    let mut reading = mtl::Reading { file, options, colored, resolver: &mut resolver, budget, warnings: &mut warnings };
    let materials = mtl::load(&statements.libraries, &names, &mut reading);
    let (reading, decoding) = (resolver.reading(), materials.decoding);
    let of_wires = materials.of_name.get(meshes.len()..).unwrap_or_default();
    wires.iter_mut().zip(of_wires).for_each(|(wires, &material)| wires.mesh.material = material);
    let up = options.up.unwrap_or(guessed);
    let mut scene =
        scene(meshes, materials, placed.center, up, budget).map_err(|over| bare::over_memory(file, over))?;

    let (files, hash, gaps) = resolver.finish();
    let mut facts = Facts {
        format: "Wavefront OBJ".into(),
        generator: generator(&statements.comments),
        faces: assembled.faces,
        dropped: dropped(&statements, &assembled),
        up_reason: options.up.is_none().then_some(reason),
        max_rounding: placed.max_rounding,
        files,
        gaps,
        hash,
        reading,
        decoding,
        ..Facts::default()
    };
    let lost = draw(&wires, placed.center, &mut scene, budget, &mut facts, file, options.wire_widths)?;
    lost.into_iter().for_each(|warning| warnings.push(warning));
    Ok(Loaded { scene, warnings: warnings.into_vec(), facts })
}

/// Puts points and lines into the scene, moved to where the file has them; warnings of those that are not drawn as
/// they are.
fn draw(
    wires: &[Wires],
    center: DVec3,
    scene: &mut Scene,
    budget: &mut Budget,
    facts: &mut Facts,
    file: &Path,
    widths: Option<[f64; 2]>,
) -> Result<Vec<Diagnostic>, Diagnostic> {
    let world_from_object = DAffine3::from_translation(center);
    let place = |(mesh, of): (u32, &Wires)| Instance { name: of.mesh.name.clone(), mesh, world_from_object };
    let places: Vec<Instance> = (0..).zip(wires).map(place).collect();
    wires::draw(wires, &places, scene, budget, facts, file, widths).map_err(|over| bare::over_memory(file, over))
}

/// Bytes that making tangents takes a corner; as a vertex of its own it has a place, a normal, coordinates and a colour.
const OF_TANGENTS: u64 = tangents::OF_CORNER + 4 * 16;

/// One instance of each mesh, moved to where the file has it.
///
/// # Errors
/// When tangents for normal maps would take more than is left of `budget`.
fn scene(
    mut meshes: Vec<Mesh>,
    materials: mtl::Materials,
    center: DVec3,
    up: UpAxis,
    budget: &mut Budget,
) -> Result<Scene, OverBudget> {
    let mtl::Materials { materials, textures, bitmaps, of_name, .. } = materials;
    for (mesh, material) in meshes.iter_mut().zip(of_name) {
        mesh.material = material;
        if materials.get(material as usize).is_some_and(|m| m.normal_map.is_some()) {
            budget.take(3 * mesh.triangles.len() as u64, OF_TANGENTS)?;
            tangents::generate(mesh, 0);
        }
    }
    let world_from_object = DAffine3::from_translation(center);
    let instance = |(mesh, m): (u32, &Mesh)| Instance { name: m.name.clone(), mesh, world_from_object };
    let instances = (0..).zip(&meshes).map(instance).collect();
    Ok(Scene { meshes, instances, materials, textures, bitmaps, up, ..Scene::default() })
}

/// Tells what became of faces, in the order of `codes`; `place` names the first of a kind.
fn warn_of_faces(
    assembled: &Assembled,
    codes: [&'static str; 5],
    place: impl Fn(u32) -> String,
    file: &Path,
    warnings: &mut Warnings,
) {
    let told = [
        (assembled.not_finite, "a face is dropped: a corner is not a finite number, or over 1e18"),
        (assembled.collapsed, "a face is dropped: it has fewer than 3 different corners"),
        (
            assembled.rounded,
            "a face is dropped: it is so small and so far from the middle that rounding joins its corners",
        ),
        (assembled.crossing, "a face crosses itself; it is cut as well as can be"),
        (assembled.turned, "a face is wound against its normals; it is turned round"),
    ];
    for (code, ((count, first), text)) in codes.into_iter().zip(told).filter(|(_, ((count, _), _))| *count > 0) {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        warnings.push(Diagnostic { count, ..Diagnostic::new(code, file, place(first), text) });
    }
}

fn dropped(statements: &Statements, assembled: &Assembled) -> Vec<(String, u64)> {
    let reasons = [
        ("fewer than 3 corners", u64::from(statements.odd.few_corners.count)),
        ("a corner that is not finite", assembled.not_finite.0),
        ("fewer than 3 different corners", assembled.collapsed.0),
        ("corners that rounding joins, far from the middle", assembled.rounded.0),
    ];
    reasons.into_iter().filter(|r| r.1 > 0).map(|(reason, count)| (reason.into(), count)).collect()
}

/// The comment by which a program names itself, if any.
fn generator(comments: &[String]) -> String {
    const WORDS: [&str; 12] = [
        "export",
        "generated",
        "created",
        "written",
        "converted",
        "blender",
        "rhino",
        "maya",
        "3ds",
        "max2obj",
        "zbrush",
        "freecad",
    ];
    let names_a_program = |c: &&String| WORDS.iter().any(|w| c.to_lowercase().contains(w));
    comments.iter().find(names_a_program).cloned().unwrap_or_default()
}

#[cfg(test)]
pub(super) mod fuzz;
#[cfg(test)]
mod tests;
