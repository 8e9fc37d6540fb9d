//! Folders among the inputs: all models in them, and where in them each lies.

use super::exit::Exit;
use crate::load::Diagnostic;
use crate::load::is_called_a_model;
use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The inputs, with all models in a folder, and in those in it, in its place, in the order of their names, each once. What is
/// hidden is left out, and links to folders are not followed. Scene files are no models: they are rendered where they are named.
///
/// `tell` hears of folders without a model, and of those that cannot be read; how the command ends because of these, too.
pub(super) fn unfold(inputs: &[PathBuf], mut tell: impl FnMut(&Diagnostic)) -> (Vec<PathBuf>, Exit) {
    let (mut models, mut ended) = (Vec::new(), Exit::Done);
    let mut known: HashSet<PathBuf> = inputs.iter().filter(|input| !is_folder(input)).cloned().collect();
    for input in inputs {
        if !is_folder(input) {
            models.push(input.clone());
            continue;
        }
        let (found, faults) = models_in(input);
        if found.is_empty() && faults.is_empty() {
            let remedy = "name one with .glb, .gltf, .vrm, .obj, .ply, .stl or .nff files, or a scene file itself";
            tell(&Diagnostic::new("folder-empty", input, "", "no model is in this folder").remedy(remedy));
            ended = ended.max(Exit::Input);
        }
        for (folder, error) in faults {
            tell(&Diagnostic::new("folder-unreadable", folder, "", error.to_string()));
            ended = ended.max(Exit::Failed);
        }
        models.extend(found.into_iter().filter(|model| known.insert(model.clone())));
    }
    (models, ended)
}

/// The folders among the inputs.
pub(super) fn of(inputs: &[PathBuf]) -> Vec<PathBuf> {
    inputs.iter().filter(|input| is_folder(input)).cloned().collect()
}

/// Whether it is a folder, whatever lies there under the name of standard input.
fn is_folder(input: &Path) -> bool {
    input != Path::new("-") && input.is_dir()
}

/// The way from the first of these folders that an input lies in to the input's own; empty if that is the same.
pub(super) fn way_below(folders: &[PathBuf], input: &Path) -> PathBuf {
    let rest = folders.iter().find_map(|folder| input.strip_prefix(folder).ok());
    let is_below = |way: &&Path| way.components().all(|part| part != Component::ParentDir);
    rest.and_then(Path::parent).filter(is_below).map_or_else(PathBuf::new, Path::to_path_buf)
}

/// All models in a folder and in those in it, in the order of their names, and the folders that cannot be read.
fn models_in(folder: &Path) -> (Vec<PathBuf>, Vec<(PathBuf, io::Error)>) {
    let (mut models, mut faults, mut left) = (Vec::new(), Vec::new(), vec![folder.to_path_buf()]);
    while let Some(folder) = left.pop() {
        if let Err(error) = look_into(&folder, &mut models, &mut left) {
            faults.push((folder, error));
        }
    }
    models.sort_unstable();
    (models, faults)
}

/// The models in a folder itself, and the folders in it.
fn look_into(folder: &Path, models: &mut Vec<PathBuf>, folders: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().as_encoded_bytes().starts_with(b".") {
            continue;
        }
        let (path, kind) = (entry.path(), entry.file_type()?);
        if kind.is_dir() {
            folders.push(path);
        } else if is_called_a_model(&path) && path.is_file() {
            models.push(path);
        }
    }
    Ok(())
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
        let mut told = Vec::new();
        let inputs = [at("all"), at("lone.toml"), "-".into(), at("none"), at("all/b"), at("gone.obj")];
        let (found, ended) = unfold(&inputs, |fault| told.push((fault.code, fault.file.clone())));
        let expected = names.map(at).into_iter().chain([at("lone.toml"), "-".into(), at("gone.obj")]);
        assert_eq!(found, expected.collect::<Vec<_>>(), "each once");
        assert_eq!((told, ended), (vec![("folder-empty", at("none"))], Exit::Input));
    }

    #[test]
    fn where_a_model_lies_is_told_from_the_folder_that_was_named() {
        let below = |folder: &str, input: &str| way_below(&[folder.into()], Path::new(input));
        assert_eq!(below("all", "all/b/c/x.glb"), Path::new("b/c"));
        assert_eq!(below("all/", "all/x.glb"), Path::new(""));
        assert_eq!(below(".", "./b/x.glb"), Path::new("b"));
        assert_eq!(below("all", "other/b/x.glb"), Path::new(""));
        assert_eq!(below("all", "all/../x/y.glb"), Path::new(""), "named beside the folder");
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
        assert_eq!(unfold(&[at("all")], |fault| panic!("{fault}")), (vec![at("all/one.obj")], Exit::Done));
    }
}
