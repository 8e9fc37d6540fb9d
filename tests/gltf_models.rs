//! Every glTF model that others made: what is valid loads, what is broken ends in a message.
//!
//! Runs only when `MESHRAY_SHARED` names the folder that holds `models/`.

use meshray::load::{LoadError, LoadOptions, Loaded, load};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::Instant;

fn models() -> Option<PathBuf> {
    let shared = std::env::var_os("MESHRAY_SHARED").map(PathBuf::from);
    if shared.is_none() {
        println!("MESHRAY_SHARED is not set: 0 shared glTF models");
    }
    shared.map(|shared| shared.join("models"))
}

fn find(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let is_model = path.extension().is_some_and(|e| e == "gltf" || e == "glb");
        if path.is_dir() {
            find(&path, out);
        } else if is_model {
            out.push(path);
        }
    }
}

/// What became of a file; a panic is the error.
fn try_load(path: &Path) -> Result<Result<Loaded, LoadError>, ()> {
    catch_unwind(|| load(path, &LoadOptions::default())).map_err(drop)
}

/// Checks that every index in a scene leads somewhere, and that numbers are numbers.
fn check(loaded: &Loaded) -> Result<(), String> {
    let scene = &loaded.scene;
    let ensure = |right: bool, what: &str| if right { Ok(()) } else { Err(what.to_owned()) };
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        let fits = |length: usize| length == 0 || length == count;
        ensure((mesh.material as usize) < scene.materials.len(), "material")?;
        ensure(mesh.triangles.iter().flatten().all(|&v| (v as usize) < count), "corner")?;
        ensure(mesh.positions.iter().all(|p| p.is_finite()), "position")?;
        ensure(fits(mesh.normals.len()) && fits(mesh.tangents.len()) && fits(mesh.colors.len()), "length")?;
        ensure(mesh.uvs.iter().all(|uvs| fits(uvs.len())), "uv length")?;
        ensure(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "normal")?;
        ensure(mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-4), "tangent")?;
    }
    ensure(scene.instances.iter().all(|i| (i.mesh as usize) < scene.meshes.len()), "instance")?;
    ensure(scene.instances.iter().all(|i| i.world_from_object.is_finite()), "place")?;
    ensure(scene.textures.iter().all(|t| (t.bitmap as usize) < scene.bitmaps.len()), "bitmap")?;
    let maps = scene.materials.iter().flat_map(|m| [&m.base_color_map, &m.normal_map, &m.emission_map]);
    ensure(maps.flatten().all(|r| (r.texture as usize) < scene.textures.len()), "texture")
}

#[test]
fn shared_gltf_models_load() {
    let Some(folder) = models() else { return };
    let (mut files, mut failures, mut refused) = (Vec::new(), Vec::new(), 0);
    find(&folder, &mut files);
    files.retain(|f| !f.starts_with(folder.join("invalid")));
    files.sort();
    for file in &files {
        let start = Instant::now();
        let name = file.strip_prefix(&folder).unwrap_or(file).display();
        match try_load(file) {
            Err(()) => failures.push(format!("{name}: panic")),
            Ok(Ok(loaded)) => {
                if let Err(what) = check(&loaded) {
                    failures.push(format!("{name}: wrong {what}"));
                }
                let faces = loaded.facts.faces;
                println!("{name}: {faces} faces, {} instances, {:.0?}", loaded.scene.instances.len(), start.elapsed());
                loaded.warnings.iter().for_each(|w| println!("    {w}"));
            }
            Ok(Err(error)) => {
                refused += 1;
                println!("{name}: {error}");
                if !error.to_string().contains("is required to draw this file") {
                    failures.push(format!("{name}: {error}"));
                }
            }
        }
    }
    println!("{} files, {refused} refused", files.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn shared_invalid_gltf_files_end_in_a_message() {
    let Some(folder) = models() else { return };
    let (mut files, mut panics) = (Vec::new(), Vec::new());
    find(&folder.join("invalid"), &mut files);
    for file in &files {
        match try_load(file) {
            Err(()) => panics.push(file.display().to_string()),
            Ok(Ok(loaded)) => println!("{}: drawn, {} warnings", file.display(), loaded.warnings.len()),
            Ok(Err(error)) => println!("{error}"),
        }
    }
    println!("{} files", files.len());
    assert!(panics.is_empty(), "panics: {}", panics.join(", "));
}
