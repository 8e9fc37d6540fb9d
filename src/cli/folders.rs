//! Expands folders and archives among the inputs into their models, and finds each model's path below its folder.

use super::exit::Exit;
use super::message::Severity;
use crate::load::archive::{ArchiveFault, in_archive, is_called_an_archive, opened, split};
use crate::load::{Diagnostic, is_called_a_model};
use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Replaces each folder among the inputs by all models in it and its subfolders, sorted by name, each once. Hidden entries are
/// skipped, and links to folders are not followed. Scene files do not count as models: they are rendered only where named. A zip
/// archive with one model stands for that model; one with several is treated as a folder, as are folders in it. In folders,
/// archives are skipped if they were unpacked in place: a folder or model of the same name is beside them.
///
/// Calls `tell` for folders without a model, for those that cannot be read, and for skipped archives; also returns the exit code
/// that results.
pub(super) fn unfold(inputs: &[PathBuf], mut tell: impl FnMut(Severity, &Diagnostic)) -> (Vec<PathBuf>, Exit) {
    let (mut models, mut ended) = (Vec::new(), Exit::Done);
    let mut known: HashSet<PathBuf> = inputs.iter().filter(|input| !is_folder(input)).cloned().collect();
    for input in inputs {
        let mut found = Found::default();
        if is_folder(input) {
            found.add_folder(input);
            if found.models.is_empty() && found.told.iter().all(|(.., exit)| *exit == Exit::Done) {
                let remedy =
                    "name one with .glb, .gltf, .vrm, .obj, .ply, .stl, .nff or .zip files, or a scene file itself";
                let fault = Diagnostic::new("folder-empty", input, "", "no model is in this folder").remedy(remedy);
                found.told.push((Severity::Error, fault, Exit::Input));
            }
        } else if !found.add_several(input) {
            models.push(if is_archive(input) { without_slash(input) } else { input.clone() });
        }
        for (severity, what, exit) in found.told {
            tell(severity, &what);
            ended = ended.max(exit);
        }
        models.extend(found.models.into_iter().filter(|model| known.insert(model.clone())));
    }
    (models, ended)
}

/// Folders, archives, and folders in archives among the inputs.
pub(super) fn of(inputs: &[PathBuf]) -> Vec<PathBuf> {
    let holds = |input: &&PathBuf| is_folder(input) || is_archive(input) || is_folder_in_archive(input);
    inputs.iter().filter(holds).cloned().collect()
}

/// Whether the input is a folder; `-` never is, even if a folder of that name exists.
fn is_folder(input: &Path) -> bool {
    input != Path::new("-") && input.is_dir()
}

/// Whether the input is a file named like an archive.
fn is_archive(input: &Path) -> bool {
    is_called_an_archive(input) && without_slash(input).is_file()
}

/// Whether the input is a folder in an archive.
fn is_folder_in_archive(input: &Path) -> bool {
    in_archive(input).is_ok_and(|found| found.is_some_and(|(archive, name)| archive.has_folder(name)))
}

/// The path without a trailing slash.
fn without_slash(path: &Path) -> PathBuf {
    path.components().collect()
}

/// Path from the first of the folders that contains the input to the input's own folder; empty if they are the same. An archive
/// on that path, or named itself, counts as a folder with its name minus the extension.
pub(super) fn way_below(folders: &[PathBuf], input: &Path) -> PathBuf {
    let Some(folder) = folders.iter().find(|folder| input.starts_with(folder)) else { return PathBuf::new() };
    let rest = |path: &Path| path.strip_prefix(folder).map_or_else(|_| PathBuf::new(), Path::to_path_buf);
    let way = match split(input) {
        Some((archive, name)) if archive.starts_with(folder) => {
            // If the archive itself was named, `rest` is empty and only its own name is left.
            let way = rest(archive).with_file_name(archive.file_stem().unwrap_or_default());
            // Joining an empty path would append a slash.
            let inside = name.parent().filter(|inside| !inside.as_os_str().is_empty());
            inside.map_or_else(|| way.clone(), |inside| way.join(inside))
        }
        _ => rest(input).parent().map(Path::to_path_buf).unwrap_or_default(),
    };
    let is_below = way.components().all(|part| part != Component::ParentDir);
    if is_below { way } else { PathBuf::new() }
}

/// Models found in a folder or an archive.
#[derive(Default)]
struct Found {
    models: Vec<PathBuf>,
    /// Diagnostics to report, and the exit codes that they cause.
    told: Vec<(Severity, Diagnostic, Exit)>,
}

impl Found {
    /// Adds all models in a folder and its subfolders, sorted by name, and faults of what cannot be read.
    fn add_folder(&mut self, folder: &Path) {
        let (mut left, mut archives) = (vec![folder.to_path_buf()], Vec::new());
        while let Some(folder) = left.pop() {
            if let Err(error) = self.look_into(&folder, &mut left, &mut archives) {
                let fault = Diagnostic::new("folder-unreadable", folder, "", error.to_string());
                self.told.push((Severity::Error, fault, Exit::Failed));
            }
        }
        // All folders with models, and all models' paths without extension.
        let known: HashSet<PathBuf> = {
            let ways = self.models.iter().flat_map(|model| model.ancestors().skip(1).take_while(|way| *way != folder));
            ways.map(Path::to_path_buf).chain(self.models.iter().map(|model| model.with_extension(""))).collect()
        };
        archives.sort_unstable();
        for archive in archives {
            let unpacked = archive.with_extension("");
            if known.contains(&unpacked) {
                let text =
                    format!("left out, as '{}' is beside it", unpacked.file_name().unwrap_or_default().display());
                let note = Diagnostic::new("archive-unpacked", archive, "", text);
                self.told.push((Severity::Info, note.remedy("name the archive itself to have it"), Exit::Done));
            } else {
                self.add_archive(&archive);
            }
        }
        self.models.sort_unstable();
    }

    /// Adds the models directly in a folder, and collects its subfolders and archives.
    fn look_into(&mut self, folder: &Path, folders: &mut Vec<PathBuf>, archives: &mut Vec<PathBuf>) -> io::Result<()> {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            if entry.file_name().as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let (path, kind) = (entry.path(), entry.file_type()?);
            if kind.is_dir() {
                folders.push(path);
            } else if is_called_a_model(&path) && path.is_file() {
                self.models.push(path);
            } else if is_archive(&path) {
                archives.push(path);
            }
        }
        Ok(())
    }

    /// Adds the models of an archive; a single model goes by the archive's own name.
    fn add_archive(&mut self, path: &Path) {
        match opened(path).and_then(|archive| archive.ok_or(ArchiveFault::None.into())) {
            Ok(archive) if archive.is_one_model() => self.models.push(path.into()),
            Ok(_) => _ = self.add_several(path),
            Err(error) => {
                let told = match ArchiveFault::of(&error) {
                    Some(fault) => (Severity::Error, fault.diagnose(path), Exit::Input),
                    None => {
                        let fault = Diagnostic::new("file-unreadable", path, "", error.to_string());
                        (Severity::Error, fault, Exit::Failed)
                    }
                };
                self.told.push(told);
            }
        }
    }

    /// Adds the models of an archive with several, or of a folder in an archive. Returns false for anything else; its faults are
    /// reported when it is loaded.
    fn add_several(&mut self, path: &Path) -> bool {
        let path = &without_slash(path);
        let whole = if is_archive(path) { opened(path).ok().flatten() } else { None };
        let (archive, folder) = match (whole, in_archive(path)) {
            (Some(archive), _) => (archive, Path::new("")),
            (None, Ok(Some((archive, name)))) if !archive.has(name) => (archive, name),
            _ => return false,
        };
        let models = archive.models(folder);
        if models.is_empty() || models.len() == 1 && folder == Path::new("") {
            return false;
        }
        for model in models {
            let note = model.note(path).map(|note| (Severity::Warning, note, Exit::Done));
            self.told.extend(note);
            self.models.push(path.join(model.name));
        }
        true
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
        let (found, ended) = unfold(&inputs, |_, fault| told.push((fault.code, fault.file.clone())));
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
        // Paths into archives; a file with such a name suffices.
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("all")).unwrap();
        fs::write(dir.path().join("all/pack.zip"), "").unwrap();
        let below = |folder: &str, input: &str| way_below(&[dir.path().join(folder)], &dir.path().join(input));
        assert_eq!(below("", "all/pack.zip"), Path::new("all"));
        assert_eq!(below("all", "all/pack.zip/x.glb").as_os_str(), "pack", "and no slash");
        assert_eq!(below("", "all/pack.zip/b/x.glb"), Path::new("all/pack/b"));
        assert_eq!(below("all/pack.zip", "all/pack.zip/b/x.glb"), Path::new("pack/b"));
        assert_eq!(below("all/pack.zip/b", "all/pack.zip/b/c/x.glb"), Path::new("c"));
        assert_eq!(below("all/pack.zip", "all/pack.zip"), Path::new(""));
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
        assert_eq!(unfold(&[at("all")], |_, fault| panic!("{fault}")), (vec![at("all/one.obj")], Exit::Done));
    }
}
