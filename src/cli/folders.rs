//! Folders among the inputs: all models in them, and where in them each lies.

use super::exit::Exit;
use crate::load::Diagnostic;
use crate::load::detect::is_called_a_model;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The inputs, with all models in a folder, and in those in it, in its place, in the order of their names. What is hidden is
/// left out, and links to folders are not followed. Scene files are no models: they are rendered where they are named.
///
/// # Errors
/// Of a folder without a model, and of one that cannot be read: how the command ends, too.
pub(super) fn unfold(inputs: &[PathBuf]) -> Result<Vec<PathBuf>, (Box<Diagnostic>, Exit)> {
    let mut models = Vec::new();
    for input in inputs {
        if !input.is_dir() {
            models.push(input.clone());
            continue;
        }
        let found = models_in(input).map_err(|(folder, error)| {
            (Box::new(Diagnostic::new("folder-unreadable", folder, "", error.to_string())), Exit::Failed)
        })?;
        if found.is_empty() {
            let fault = Diagnostic::new("folder-empty", input, "", "no model is in this folder");
            let remedy = "name one with .glb, .gltf, .obj, .ply, .stl or .nff files, or a scene file itself";
            return Err((Box::new(fault.remedy(remedy)), Exit::Input));
        }
        models.extend(found);
    }
    Ok(models)
}

/// The folders among the inputs.
pub(super) fn of(inputs: &[PathBuf]) -> Vec<PathBuf> {
    inputs.iter().filter(|input| input.is_dir()).cloned().collect()
}

/// The way from the first of these folders that an input lies in to the input's own; `.` if that is the same.
pub(super) fn way_below(folders: &[PathBuf], input: &Path) -> PathBuf {
    let rest = folders.iter().find_map(|folder| input.strip_prefix(folder).ok());
    let is_below =
        |way: &&Path| !way.as_os_str().is_empty() && way.components().all(|part| part != Component::ParentDir);
    let way = rest.and_then(Path::parent).filter(is_below);
    way.unwrap_or(Path::new(".")).to_path_buf()
}

fn models_in(folder: &Path) -> Result<Vec<PathBuf>, (PathBuf, io::Error)> {
    let (mut models, mut left) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(folder) = left.pop() {
        let fault = |error| (folder.clone(), error);
        for entry in fs::read_dir(&folder).map_err(fault)? {
            let entry = entry.map_err(fault)?;
            if entry.file_name().as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let (path, kind) = (entry.path(), entry.file_type().map_err(fault)?);
            if kind.is_dir() {
                left.push(path);
            } else if is_called_a_model(&path) && path.is_file() {
                models.push(path);
            }
        }
    }
    models.sort_unstable();
    Ok(models)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_models_in_a_folder_stand_for_it() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for folder in ["all/b/c", "all/.git", "none/deep"] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        let names = ["all/b/c/x.GLTF", "all/b/y.obj", "all/z.glb"];
        for name in names.iter().chain(&["all/b/y.mtl", "all/.git/g.obj", "all/.h.obj", "all/Cargo.toml", "lone.toml"])
        {
            fs::write(at(name), "").unwrap();
        }
        let found = unfold(&[at("all"), at("lone.toml"), "-".into(), at("gone.obj")]).unwrap();
        let expected = names.map(at).into_iter().chain([at("lone.toml"), "-".into(), at("gone.obj")]);
        assert_eq!(found, expected.collect::<Vec<_>>());
        let (fault, exit) = unfold(&[at("none")]).unwrap_err();
        assert_eq!((fault.code, exit), ("folder-empty", Exit::Input));
    }

    #[test]
    fn where_a_model_lies_is_told_from_the_folder_that_was_named() {
        let below = |folder: &str, input: &str| way_below(&[folder.into()], Path::new(input));
        assert_eq!(below("all", "all/b/c/x.glb"), Path::new("b/c"));
        assert_eq!(below("all/", "all/x.glb"), Path::new("."));
        assert_eq!(below(".", "./b/x.glb"), Path::new("b"));
        assert_eq!(below("all", "other/b/x.glb"), Path::new("."));
        assert_eq!(below("all", "all/../x/y.glb"), Path::new("."), "named beside the folder");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_folder_is_not_followed_and_one_to_a_model_is() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("all")).unwrap();
        fs::write(at("model.obj"), "").unwrap();
        std::os::unix::fs::symlink(at("all"), at("all/round")).unwrap();
        std::os::unix::fs::symlink(at("model.obj"), at("all/one.obj")).unwrap();
        std::os::unix::fs::symlink(at("gone.obj"), at("all/two.obj")).unwrap();
        assert_eq!(unfold(&[at("all")]).unwrap(), [at("all/one.obj")]);
    }
}
