//! Folders among the inputs, and archives with several models: all models in them, and where in them each lies.

use super::exit::Exit;
use crate::load::archive::{self, Archive, is_called_an_archive};
use crate::load::{Diagnostic, is_called_a_model};
use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The inputs, with all models in a folder, and in those in it, in its place, in the order of their names, each once. What is
/// hidden is left out, and links to folders are not followed. Scene files are no models: they are rendered where they are named.
/// A zip archive with one model stands for that, and one with several is a folder.
///
/// `tell` hears of folders without a model, and of those that cannot be read; how the command ends because of these, too.
pub(super) fn unfold(inputs: &[PathBuf], mut tell: impl FnMut(&Diagnostic)) -> (Vec<PathBuf>, Exit) {
    let (mut models, mut ended) = (Vec::new(), Exit::Done);
    let mut known: HashSet<PathBuf> = inputs.iter().filter(|input| !is_folder(input)).cloned().collect();
    for input in inputs {
        if !is_folder(input) {
            let several = is_archive(input).then(|| models_of(input).ok()).flatten().filter(|found| found.len() > 1);
            match several {
                Some(found) => models.extend(found.into_iter().filter(|model| known.insert(model.clone()))),
                // What is wrong with an archive is told where it is loaded.
                None => models.push(input.clone()),
            }
            continue;
        }
        let (found, faults) = models_in(input);
        if found.is_empty() && faults.is_empty() {
            let remedy =
                "name one with .glb, .gltf, .vrm, .obj, .ply, .stl, .nff or .zip files, or a scene file itself";
            tell(&Diagnostic::new("folder-empty", input, "", "no model is in this folder").remedy(remedy));
            ended = ended.max(Exit::Input);
        }
        for (fault, exit) in faults {
            tell(&fault);
            ended = ended.max(exit);
        }
        models.extend(found.into_iter().filter(|model| known.insert(model.clone())));
    }
    (models, ended)
}

/// The folders among the inputs, and the archives.
pub(super) fn of(inputs: &[PathBuf]) -> Vec<PathBuf> {
    inputs.iter().filter(|input| is_folder(input) || is_archive(input)).cloned().collect()
}

/// Whether it is a file with the name of an archive.
fn is_archive(input: &Path) -> bool {
    is_called_an_archive(input) && input.is_file()
}

/// What the models in an archive are called among the inputs: one alone as the archive.
fn models_of(path: &Path) -> io::Result<Vec<PathBuf>> {
    // What is none, whatever its name, has no models.
    let Some(archive) = Archive::open(path)? else { return Ok(Vec::new()) };
    let names: Vec<&str> = archive.models().collect();
    Ok(match names[..] {
        [_] => vec![path.to_path_buf()],
        _ => names.iter().map(|name| path.join(name)).collect(),
    })
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

/// What is told of a folder or an archive that cannot be read, and how the command ends because of it.
type Fault = (Diagnostic, Exit);

/// All models in a folder and in those in it, in the order of their names, and what cannot be read.
fn models_in(folder: &Path) -> (Vec<PathBuf>, Vec<Fault>) {
    let (mut models, mut faults, mut left) = (Vec::new(), Vec::new(), vec![folder.to_path_buf()]);
    while let Some(folder) = left.pop() {
        if let Err(error) = look_into(&folder, &mut models, &mut left, &mut faults) {
            faults.push((Diagnostic::new("folder-unreadable", folder, "", error.to_string()), Exit::Failed));
        }
    }
    models.sort_unstable();
    (models, faults)
}

/// The models in a folder itself and in the archives there, and the folders in it.
fn look_into(
    folder: &Path,
    models: &mut Vec<PathBuf>,
    folders: &mut Vec<PathBuf>,
    faults: &mut Vec<Fault>,
) -> io::Result<()> {
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
        } else if is_archive(&path) {
            match models_of(&path) {
                Ok(found) => models.extend(found),
                Err(error) => faults.push(unreadable(error, &path)),
            }
        }
    }
    Ok(())
}

/// What is told of an archive that cannot be looked into.
fn unreadable(error: io::Error, path: &Path) -> Fault {
    match archive::of_archive(&error) {
        Some(fault) => (fault.diagnose(path), Exit::Input),
        None => (Diagnostic::new("file-unreadable", path, "", error.to_string()), Exit::Failed),
    }
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
