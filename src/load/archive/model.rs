//! Choice of the file in an archive that is the model.

use super::{Archive, ArchiveFault};
use crate::load::detect::{MODELS, is_called_a_model};
use crate::load::limits::Limits;
use crate::load::paths::{FileFault, shorten, shown};
use crate::load::suggest::nearest;
use crate::load::{Diagnostic, LoadError, Source, too_large};
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A model in an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArchiveModel<'a> {
    /// Path of its file, with `/` between folders.
    pub name: &'a str,
    /// Files beside it that differ only in the extension: the same model in other formats.
    pub others: Vec<&'a str>,
}

impl ArchiveModel<'_> {
    /// Diagnostic about the archive that the other formats are not drawn; `None` if there are none.
    pub fn note(&self, archive: &Path) -> Option<Diagnostic> {
        let first = self.others.first()?;
        let more = if self.others.len() > 1 { format!(" and {} more", self.others.len() - 1) } else { String::new() };
        let text = format!("'{}' is drawn, and not '{}'{more} beside it", shorten(self.name), shorten(first));
        let remedy = format!("name another format by its path: '{}'", archive.join(first).display());
        Some(Diagnostic::new("archive-formats", archive, "", text).remedy(remedy))
    }
}

/// Returns whether a file has the extension of a zip archive.
pub fn is_called_an_archive(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zip"))
}

impl Archive {
    /// Returns the models below a folder, in order, each in one format; hidden files are skipped, and the companion files that
    /// macOS adds.
    pub fn models(&self, folder: &Path) -> Vec<ArchiveModel<'_>> {
        let files = self.below(folder).filter(|name| is_shown(name) && is_called_a_model(Path::new(name)));
        let mut by_stem: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        files.for_each(|name| {
            by_stem.entry(name.rsplit_once('.').map_or(name, |(stem, _)| stem)).or_default().push(name)
        });
        let offered = by_stem.into_values().map(|mut files| {
            files.sort_by_key(|name| {
                let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
                MODELS.iter().position(|kind| extension.eq_ignore_ascii_case(kind))
            });
            ArchiveModel { name: files.remove(0), others: files }
        });
        offered.collect()
    }
}

impl Archive {
    /// Name of the only inner archive, in an archive that has no models.
    fn only_archive(&self) -> Option<&str> {
        let mut inner = self.archives();
        let only = inner.next().filter(|_| inner.next().is_none())?;
        self.models(Path::new("")).is_empty().then_some(only)
    }

    /// Returns whether the archive can be loaded without naming a model.
    pub fn is_one_model(&self) -> bool {
        self.only_archive().is_some() || self.models(Path::new("")).len() == 1
    }

    /// Names of the archives in the archive.
    fn archives(&self) -> impl Iterator<Item = &str> {
        let names = self.entries.keys().map(String::as_str);
        names.filter(|name| is_shown(name) && is_called_an_archive(Path::new(name)))
    }
}

/// Returns whether a file in an archive is meant for users: neither hidden nor added by macOS.
fn is_shown(name: &str) -> bool {
    name.split('/').all(|part| !part.starts_with('.') && part != "__MACOSX")
}

/// Reads the only model of an archive, or that of its only inner archive if there are no models, as when a packed model was
/// packed again together with a licence.
pub(in crate::load) fn only_model(archive: Arc<Archive>, limits: &Limits) -> Result<Source, LoadError> {
    if let Some(inner) = archive.only_archive() {
        let path = archive.path_of(inner);
        let inner = source(archive.clone(), Path::new(inner), limits)?;
        let inner = Archive::from_bytes(&path, inner.bytes).map_err(|error| unreadable(error, &path))?;
        // One level only: an archive may contain itself.
        return model_of(Arc::new(inner), limits);
    }
    model_of(archive, limits)
}

/// Reads the only model that lies in the archive itself.
fn model_of(archive: Arc<Archive>, limits: &Limits) -> Result<Source, LoadError> {
    let models = archive.models(Path::new(""));
    let [ArchiveModel { name, .. }] = &models[..] else { return Err(none_or_several(&archive, &models).into()) };
    let (name, note) = (PathBuf::from(name), models[0].note(&archive.path));
    Ok(Source { note, ..source(archive, &name, limits)? })
}

/// Reads the model of an archive that has this name.
pub(in crate::load) fn named_model(archive: Arc<Archive>, name: &Path, limits: &Limits) -> Result<Source, LoadError> {
    if archive.has(name) {
        return source(archive, name, limits);
    }
    let path = archive.path.join(name);
    if archive.has_folder(name) {
        let fault = Diagnostic::new("file-not-plain", path, "", "is a folder in an archive");
        return Err(fault.remedy("name a file in it").into());
    }
    let models = archive.models(Path::new(""));
    let (archive, name) = (archive.path.display(), shown(name));
    let remedy = match (nearest(&name, models.iter().map(|model| model.name)), &models[..]) {
        (Some(meant), _) => format!("did you mean '{archive}/{meant}'?"),
        (None, [ArchiveModel { name, .. }]) => format!("its model is '{archive}/{name}'"),
        (None, [ArchiveModel { name, .. }, ..]) => {
            format!("it has {} models, the first is '{archive}/{name}'", models.len())
        }
        (None, []) => "it has no model".into(),
    };
    Err(Diagnostic::new(FileFault::MISSING, path, "", "is not in the archive").remedy(remedy).into())
}

/// Reads a file of an archive into memory.
pub(in crate::load) fn source(archive: Arc<Archive>, name: &Path, limits: &Limits) -> Result<Source, LoadError> {
    let path = archive.path.join(name);
    match archive.read(name, limits.file) {
        Ok(bytes) => Ok(Source { path, bytes, within: Some(archive), note: None }),
        Err(error) if error.kind() == ErrorKind::FileTooLarge => {
            Err(too_large(&path, archive.length(name).unwrap_or_default(), limits).into())
        }
        Err(error) => Err(unreadable(error, &path)),
    }
}

/// Error for a named model or archive that cannot be read.
pub(in crate::load) fn unreadable(error: io::Error, path: &Path) -> LoadError {
    if let Some(fault) = ArchiveFault::of(&error) {
        return fault.diagnose(path).into();
    }
    LoadError::Read { what: Box::new(Diagnostic::new("file-unreadable", path, "", "cannot be read")), source: error }
}

/// Diagnostic for an archive with several models, or with none.
fn none_or_several(archive: &Archive, models: &[ArchiveModel]) -> Diagnostic {
    /// Most names that are listed.
    const TOLD: usize = 4;
    let list = |names: &mut dyn Iterator<Item = &str>| {
        names.take(TOLD).map(|name| format!("'{}'", shorten(name))).collect::<Vec<_>>().join(", ")
    };
    let (path, told) = (&archive.path, |code, text: String| Diagnostic::new(code, archive.path.as_path(), "", text));
    let Some(first) = models.first() else {
        let shown = || archive.entries.keys().map(String::as_str).filter(|name| is_shown(name));
        let held = list(&mut shown());
        let text = match shown().count() {
            0 => "no file is in this archive".into(),
            count if count > TOLD => format!("no model is in this archive: it has {held} and {} more", count - TOLD),
            _ => format!("no model is in this archive: it has {held}"),
        };
        let remedy = match archive.archives().next() {
            Some(inner) => format!("unpack it, and name '{}'", shorten(inner)),
            None => "meshray reads .glb, .gltf, .vrm, .obj, .ply, .stl and .nff files in it".into(),
        };
        return told("archive-empty", text).remedy(remedy);
    };
    let (count, held) = (models.len(), list(&mut models.iter().map(|model| model.name)));
    let dots = if count > TOLD { ", …" } else { "" };
    let example = format!("name one, as in '{}'", path.join(first.name).display());
    let remedy =
        if path.is_file() { example } else { "keep it as a file, and name one behind the path of that".into() };
    told("archive-several", format!("{count} models are in this archive: {held}{dots}")).remedy(remedy)
}
