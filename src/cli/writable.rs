//! Checks, before any work, whether a file may be written under a name.

use super::archives;
use super::output_name::{collision, identity};
use super::outputs::Target;
use crate::image::{destination, folder_takes, was_written_by_meshray};
use crate::load::{Diagnostic, archive};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Set of input files, which no output may replace.
///
/// Clones share one set: files added to one are known to all.
#[derive(Clone, Debug, Default)]
pub(super) struct Sources(Arc<Mutex<HashSet<PathBuf>>>);

impl Sources {
    /// Set of these files, except `-` (standard input).
    pub(super) fn of(files: impl IntoIterator<Item: AsRef<Path>>) -> Self {
        let sources = Self::default();
        sources.add(files);
        sources
    }

    /// Adds files.
    pub(super) fn add(&self, files: impl IntoIterator<Item: AsRef<Path>>) {
        let named = files.into_iter().filter(|file| file.as_ref() != Path::new("-"));
        // For files in an archive, the archive itself is read.
        let files: Vec<PathBuf> = named.map(|file| identity(archives::on_disk(file.as_ref()))).collect();
        self.known().extend(files);
    }

    fn known(&self) -> MutexGuard<'_, HashSet<PathBuf>> {
        // No operation under the lock can panic halfway, so a poisoned lock is harmless.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Refuses `path`, given with `flag`, if it is one of the files.
    pub(super) fn spared_by(&self, path: &Path, flag: &str) -> Result<(), Diagnostic> {
        let file = identity(path);
        if self.known().contains(&file) {
            let fault = Diagnostic::new("output-is-input", path, "", "would replace a file that is read");
            return Err(fault.remedy(format!("name another with {flag}")));
        }
        Ok(())
    }

    /// Refuses a picture target that is one of the files.
    pub(super) fn spared_by_target(&self, target: &Target) -> Result<(), Diagnostic> {
        target.path().map_or(Ok(()), |path| self.spared_by(path, "-o"))
    }
}

/// Code of the fault when a file's folder is missing.
pub(super) const NO_FOLDER: &str = "output-folder";

/// Refuses `path`, given with `flag`, if its folder is missing, if it is a folder itself or read-only, or if it is one of
/// `sources`.
pub(super) fn check(path: &Path, flag: &str, sources: &Sources) -> Result<(), Diagnostic> {
    let fault = |code, text: &str, remedy: &str| Err(Diagnostic::new(code, path, "", text).remedy(remedy));
    let goal = destination(path);
    let folder = goal.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.exists() && !folder.is_dir() || archive::split(folder).is_some() {
        return fault("output-in-file", "what should be its folder is a file", &format!("name another with {flag}"));
    }
    if !folder.is_dir() {
        return fault(NO_FOLDER, "its folder is not there", &format!("create it, or name another with {flag}"));
    }
    if !folder_takes(path) {
        return fault("output-read-only", "its folder takes no files", &format!("name another with {flag}"));
    }
    if path.is_dir() {
        return fault("output-is-folder", "is a folder", &format!("name a file in it with {flag}"));
    }
    if std::fs::metadata(&goal).is_ok_and(|old| old.is_file() && old.permissions().readonly()) {
        return fault("output-read-only", "exists and is read-only", &format!("name another with {flag}"));
    }
    sources.spared_by(path, flag)
}

/// Like [`check`], but `growth` and folders below it may be missing, as they are created; its parent must exist.
pub(super) fn check_in(path: &Path, flag: &str, growth: Option<&Path>, sources: &Sources) -> Result<(), Diagnostic> {
    match check(path, flag, sources) {
        Err(fault) if fault.code == NO_FOLDER && growth.is_some_and(can_be) => Ok(()),
        checked => checked,
    }
}

/// Checks a picture target: standard output must be no terminal, and a file must be one that may be created or replaced.
///
/// For `growth` see [`check_in`].
pub(super) fn check_target(target: &Target, growth: Option<&Path>, sources: &Sources) -> Result<(), Diagnostic> {
    let Some(path) = target.path() else {
        use std::io::IsTerminal;
        let text = "standard output is a terminal, which shows no pictures";
        let fault = Diagnostic::new("output-terminal", "", "", text).remedy("redirect it, or name a file with -o");
        return if std::io::stdout().is_terminal() { Err(fault) } else { Ok(()) };
    };
    check_in(path, "-o", growth, sources)?;
    if matches!(target, Target::Default(_)) && path.exists() && !was_written_by_meshray(path) {
        let fault = Diagnostic::new("output-not-ours", path, "", "exists and is no picture that meshray wrote");
        return Err(fault.remedy("move it away, or name another output with -o"));
    }
    Ok(())
}

/// Whether a folder exists, or can be created in an existing one; false for a dangling link.
fn can_be(folder: &Path) -> bool {
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    folder.is_dir() || folder.symlink_metadata().is_err() && parent.is_dir() && folder_takes(folder)
}

/// Runs [`check`] for every `--report` before any work; no two may be the same file.
pub(super) fn check_reports(paths: &[PathBuf], sources: &Sources) -> Result<(), Diagnostic> {
    if let Some((_, later)) = collision(paths) {
        let fault = Diagnostic::new("output-twice", paths[later].as_path(), "", "is named twice");
        return Err(fault.remedy("give each --report a name of its own"));
    }
    paths.iter().try_for_each(|path| check(path, "--report", sources))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_files_that_are_read_are_refused_with_the_flag_that_names_another() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let sources = Sources::of([at("model.obj"), "-".into()]);
        let code = |path: &Path| check(path, "--plot", &sources).map_err(|fault| (fault.code, fault.remedy));
        assert_eq!(code(&at("page.html")), Ok(()));
        for (path, expected) in [
            (at("none/page.html"), "output-folder"),
            (dir.path().into(), "output-is-folder"),
            (at("./model.obj"), "output-is-input"),
        ] {
            let (code, remedy) = code(&path).unwrap_err();
            assert!(code == expected && remedy.contains("--plot"), "{code} {remedy}");
        }
        assert_eq!(code(Path::new("-")), Ok(()), "standard input is no file");
        let kept = at("kept.html");
        std::fs::write(&kept, "x").unwrap();
        let mut permissions = std::fs::metadata(&kept).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&kept, permissions).unwrap();
        assert_eq!(code(&kept).map_err(|(code, _)| code), Err("output-read-only"));
    }
}
