//! Faces, points and lines -> scene: for OBJ files, and for files that hold geometry alone.

use super::Geometry;
use super::{assemble, up, wire_statements};
use crate::load::limits::{Budget, OverBudget};
use crate::load::mtl;
use crate::load::paths::Resolver;
use crate::load::place::place;
use crate::load::tangents;
use crate::load::wires::{self, Wires};
use crate::load::{Diagnostic, Facts, LoadError, LoadOptions, Loaded, Source, Warnings};
use crate::math::{DAffine3, DVec3};
use crate::scene::{AlphaMode, Instance, Mesh, Scene, UpAxis};
use assemble::Assembled;
use std::path::Path;

/// Names and message codes of a kind of file.
pub(in crate::load) struct Kind<'a> {
    /// Name of the format for reports.
    pub format: &'a str,
    /// Diagnostic codes for faces, in the order of [`warn_of_faces`].
    pub of_faces: [&'static str; 5],
    /// Diagnostic code for a file without faces.
    pub no_faces: &'static str,
    /// Formats the place of a face: its line, or its number.
    pub place: fn(u32) -> String,
    /// Default up axis, and the reason.
    pub otherwise: (UpAxis, &'a str),
    /// Makes the materials that runs name, from the files that the geometry names.
    pub materials: mtl::Make,
}

/// Makes the scene; `warnings` continue those of reading.
///
/// # Errors
/// When memory would exceed the budget.
pub(in crate::load) fn finish(
    mut geometry: Geometry,
    kind: &Kind,
    source: &Source,
    options: &LoadOptions,
    mut warnings: Warnings,
    budget: &mut Budget,
) -> Result<Loaded, LoadError> {
    let file = source.path.as_path();
    let mut resolver = Resolver::new(source, options);
    let placed = place(&geometry.soup.positions);
    if !geometry.triangles.is_empty() && !assemble::stay_as_they_are(&geometry.triangles, &placed.positions) {
        geometry.spell_out();
    }
    let soup = std::mem::take(&mut geometry.soup);
    let vertices = soup.positions.len();
    let (colored, is_see_through) = (!soup.colors.is_empty(), !soup.alphas.is_empty());
    let flatness = assemble::flatness(&placed.positions, geometry.places);
    let mut assembled = if geometry.triangles.is_empty() {
        assemble::assemble(&geometry, &soup, &placed, options.polygons, flatness)
    } else {
        assemble::as_they_are(&mut geometry, &soup, &placed)
    };
    let (wire_runs, mut wires): (Vec<u32>, Vec<Wires>) =
        wire_statements::assemble(&geometry, &soup, &placed).into_iter().unzip();
    drop(soup);
    warn_of_faces(&assembled, kind, file, &mut warnings);
    if geometry.faces.is_empty() && assembled.meshes.is_empty() && wires.is_empty() {
        let text = format!("{} vertices and no face: there is nothing to draw", vertices);
        warnings.push(Diagnostic::new(kind.no_faces, file, "", text));
    }

    // Determine the up axis, the materials and the placement.
    let (runs, meshes): (Vec<u32>, Vec<Mesh>) = std::mem::take(&mut assembled.meshes).into_iter().unzip();
    let (guessed, reason) = up::guess(&geometry.comments, &meshes, &placed, kind.otherwise);
    let name = |run: &u32| geometry.runs[*run as usize].material.map(|id| geometry.names[id as usize].as_str());
    let names: Vec<Option<&str>> = runs.iter().chain(&wire_runs).map(name).collect();
    let mut reading = mtl::Reading { file, options, colored, resolver: &mut resolver, budget, warnings: &mut warnings };
    let mut materials = (kind.materials)(&geometry.sources, &names, &mut reading);
    if is_see_through {
        materials.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Blend);
    }
    let (reading, decoding) = (resolver.reading(), materials.decoding);
    let of_wires = materials.of_name.get(meshes.len()..).unwrap_or_default();
    wires.iter_mut().zip(of_wires).for_each(|(wires, &material)| wires.mesh.material = material);
    let up = options.up.unwrap_or(guessed);
    let mut scene = scene(meshes, materials, placed.center, up, options.smooth.is_some(), budget)
        .map_err(|over| Diagnostic::over_budget(file, over))?;

    let (files, hash, gaps) = resolver.finish();
    let mut facts = Facts {
        format: kind.format.into(),
        generator: generator(&geometry.comments),
        faces: assembled.faces,
        dropped: dropped(&geometry, &assembled),
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

/// Adds points and lines to the scene, moved to their place in the file; warns of those that are not drawn as
/// specified.
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
    wires::draw(wires, &places, scene, budget, facts, file, widths).map_err(|over| Diagnostic::over_budget(file, over))
}

/// Bytes per corner for making tangents; a corner that becomes a vertex has a position, a normal, coordinates and a colour.
const OF_TANGENTS: u64 = tangents::OF_CORNER + 4 * 16;

/// Scene with one instance of each mesh, moved to its place in the file. Meshes with smooth normals get tangents later.
///
/// # Errors
/// When tangents for normal maps would exceed `budget`.
fn scene(
    mut meshes: Vec<Mesh>,
    materials: mtl::Materials,
    center: DVec3,
    up: UpAxis,
    smooths: bool,
    budget: &mut Budget,
) -> Result<Scene, OverBudget> {
    let mtl::Materials { materials, textures, bitmaps, of_name, .. } = materials;
    for (mesh, material) in meshes.iter_mut().zip(of_name) {
        mesh.material = material;
        if let Some(map) = materials.get(material as usize).and_then(|m| m.normal_map.as_ref()) {
            budget.take(3 * mesh.triangles.len() as u64, OF_TANGENTS)?;
            if smooths && mesh.normals.is_empty() {
                mesh.tangents_along = Some(map.coordinates());
            } else {
                tangents::generate(mesh, map.coordinates());
            }
        }
    }
    let world_from_object = DAffine3::from_translation(center);
    let instance = |(mesh, m): (u32, &Mesh)| Instance { name: m.name.clone(), mesh, world_from_object };
    let instances = (0..).zip(&meshes).map(instance).collect();
    Ok(Scene { meshes, instances, materials, textures, bitmaps, up, ..Scene::default() })
}

/// Adds warnings about dropped and changed faces.
fn warn_of_faces(assembled: &Assembled, kind: &Kind, file: &Path, warnings: &mut Warnings) {
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
    for (code, ((count, first), text)) in kind.of_faces.into_iter().zip(told).filter(|(_, ((count, _), _))| *count > 0)
    {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        warnings.push(Diagnostic { count, ..Diagnostic::new(code, file, (kind.place)(first), text) });
    }
}

fn dropped(geometry: &Geometry, assembled: &Assembled) -> Vec<(String, u64)> {
    let reasons = [
        ("fewer than 3 corners", u64::from(geometry.few_corners)),
        ("a corner that is not finite", assembled.not_finite.0),
        ("fewer than 3 different corners", assembled.collapsed.0),
        ("corners that rounding joins, far from the middle", assembled.rounded.0),
    ];
    reasons.into_iter().filter(|r| r.1 > 0).map(|(reason, count)| (reason.into(), count)).collect()
}

/// Comment by which a program names itself, if any.
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
