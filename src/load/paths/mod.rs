//! Which files a model may name, and which files were read.
//!
//! A glTF or MTL names other files, and its author is not trusted: files are read only below a root folder, after
//! symbolic links are resolved, and never from a network. Every file read is listed and hashed, so that a picture can
//! record exactly what it was made from.

#[cfg(test)]
mod tests;
mod volume;

use super::archive::{ArchiveFault, source};
use super::limits::{Budget, OverBudget};
use super::{Diagnostic, Limits, LoadError, LoadOptions, Source};
use crate::stopwatch::{Spent, Stopwatch};
use percent_encoding::percent_decode_str;
use std::cell::Cell;
use std::collections::HashMap;
use std::io;
use std::path::{Component, Path, PathBuf};
use volume::{Unread, Volume};
use xxhash_rust::xxh3::xxh3_128;

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRead {
    /// Path as named, relative to the folder of the model as the user named it.
    pub path: PathBuf,
    /// xxh3-128 of the file's bytes.
    pub hash: u128,
}

impl AsRef<Path> for FileRead {
    fn as_ref(&self) -> &Path {
        &self.path
    }
}

/// Reads the files that a model names.
#[derive(Clone, Debug)]
pub struct Resolver {
    /// Where all named files lie.
    volume: Volume,
    /// Whether the model is standard input, which has no folder.
    from_stdin: bool,
    /// Folder that relative names start from; canonical.
    base: PathBuf,
    /// The base folder as the user named it.
    named: PathBuf,
    /// Folder outside of which nothing is read; canonical.
    root: PathBuf,
    /// Limits of each file.
    limits: Limits,
    /// Files read, each with the hash that it contributes to the total hash.
    read: Vec<(FileRead, u128)>,
    /// Index into `read`, by canonical path.
    known: HashMap<PathBuf, usize>,
    /// Entries of the folders searched for a name in another case, by lower-case name.
    listed: HashMap<PathBuf, HashMap<String, String>>,
    reading: Spent,
    /// Whether a file was missing at a path where it was looked up.
    gaps: Cell<bool>,
}

/// A file found and read.
#[derive(Debug)]
pub struct Found {
    /// Path relative to the model's folder, or absolute.
    pub path: PathBuf,
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// Whether the file lies elsewhere than its name says.
    pub guessed: bool,
}

impl Found {
    /// Diagnostic that the file lies elsewhere than `name` says, at `place` in `file`.
    pub fn note(&self, name: &str, file: &Path, place: &str) -> Option<Diagnostic> {
        self.guessed.then(|| Diagnostic::new("file-elsewhere", file, place, taken_from(name, &self.path)))
    }
}

/// Why a named file was not read.
#[derive(Debug, thiserror::Error)]
pub enum FileFault {
    /// The file lies outside the root.
    #[error("'{name}' lies outside {within}, where nothing is read")]
    Outside {
        /// Name as written in the model.
        name: String,
        /// The folder that it lies outside of, in words.
        within: String,
        /// Value of `--root` that would allow it; `None` where names are relative to the root.
        root: Option<PathBuf>,
    },
    /// The file lies outside the archive of the model.
    #[error("'{0}' lies outside the archive, and nothing else is read")]
    OutsideArchive(String),
    /// The file does not exist.
    #[error("'{0}' is not there")]
    Missing(String),
    /// The file does not exist in the archive of the model.
    #[error("'{0}' is not in the archive")]
    MissingInArchive(String),
    /// The path is that of a folder, a device or the like.
    #[error("'{0}' is not a plain file")]
    NotAFile(String),
    /// The file is larger than [`super::Limits::file`].
    #[error("'{name}' has {bytes} bytes where {limit} are allowed")]
    TooLarge {
        /// Name as written in the model.
        name: String,
        /// Size of the file.
        bytes: u64,
        /// Largest size allowed.
        limit: u64,
        /// Remedy, if there is one.
        remedy: &'static str,
    },
    /// The name is a URI of another machine or of an unknown scheme.
    #[error("'{0}' is not a relative file name, and nothing is fetched from elsewhere")]
    Scheme(String),
    /// The name cannot be a URI or file name.
    #[error("'{0}' is not a valid URI")]
    BadUri(String),
    /// I/O error.
    #[error("'{name}': {source}")]
    Io {
        /// Name as written in the model.
        name: String,
        /// The error of the system.
        source: io::Error,
    },
    /// The archive that holds the file cannot unpack it.
    #[error("'{name}' cannot be unpacked: {fault}")]
    Packed {
        /// Name as written in the model.
        name: String,
        /// Reason.
        fault: String,
        /// Remedy.
        remedy: &'static str,
    },
}

impl FileFault {
    /// Diagnostic code for a missing file.
    pub const MISSING: &str = "file-missing";

    /// Whether the fault is that the file does not exist.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing(_) | Self::MissingInArchive(_))
    }

    /// Fault for an error while a file was located or read: of the system, or of its archive.
    fn of(name: String, source: io::Error) -> Self {
        match ArchiveFault::of(&source) {
            Some(why) => Self::Packed { name, fault: why.to_string(), remedy: why.remedy() },
            None => Self::Io { name, source },
        }
    }

    /// Diagnostic for this fault at `place` in `file`.
    pub fn diagnose(&self, file: &Path, place: &str) -> Diagnostic {
        let (code, remedy) = match self {
            Self::Outside { root: Some(root), .. } => {
                ("file-outside-root", format!("allow it with --root '{}'", root.display()))
            }
            Self::Outside { root: None, .. } => (
                "file-outside-root",
                "name the model's file instead of standard input, and its root with --root".into(),
            ),
            Self::OutsideArchive(_) => ("file-outside-root", "unpack it, with what is missing in its place".into()),
            Self::MissingInArchive(_) => {
                (Self::MISSING, "look for an archive with all files, or unpack it and put this one in its place".into())
            }
            Self::Missing(name) if name.contains(['/', '\\']) => {
                (Self::MISSING, "put it there, as seen from the model's folder".into())
            }
            Self::Missing(_) => (Self::MISSING, "put it beside the model".into()),
            Self::NotAFile(_) => ("file-not-plain", "name a file".into()),
            Self::TooLarge { remedy, .. } => ("file-too-large", (*remedy).into()),
            Self::Scheme(uri) if is_on_a_drive(uri) => ("uri-scheme", "name it by a relative path".into()),
            Self::Scheme(_) => ("uri-scheme", "download it and name it by a relative path".into()),
            Self::BadUri(_) => ("uri-invalid", "name the file by a relative path".into()),
            Self::Io { .. } => ("file-unreadable", "see that it may be read".into()),
            Self::Packed { remedy, .. } => (ArchiveFault::CODE, (*remedy).into()),
        };
        Diagnostic::new(code, file, place, self.to_string()).remedy(remedy)
    }
}

impl Resolver {
    /// Resolver for the files that `source` names; `source` itself is the first file read.
    ///
    /// Relative names start from the folder of `source`; where `source` has none (standard input), from the root, or
    /// else from the current folder. For a model in an archive, the archive is the root.
    pub fn new(source: &Source, options: &LoadOptions) -> Self {
        let current = || PathBuf::from(".");
        let folder = source.path.parent().filter(|p| !p.as_os_str().is_empty());
        let base = match folder {
            Some(folder) => folder.to_path_buf(),
            None if source.is_stdin() => options.root.clone().unwrap_or_else(current),
            None => current(),
        };
        let named = if folder.is_none() && base == current() { PathBuf::new() } else { base.clone() };
        let volume = source.within.clone().map_or(Volume::Disk, Volume::Archive);
        // Canonical, regardless of the root.
        let whole = |path: &PathBuf| volume.canonical(path, Path::new("")).unwrap_or_else(|_| path.clone());
        let base = whole(&base);
        let root = match (&source.within, &options.root) {
            (Some(archive), _) => archive.path().to_path_buf(),
            (None, Some(root)) => whole(root),
            (None, None) => base.clone(),
        };
        let canonical = whole(&source.path);
        let mut resolver = Self {
            volume,
            from_stdin: source.is_stdin(),
            base,
            named,
            root,
            limits: options.limits,
            read: Vec::new(),
            known: HashMap::new(),
            listed: HashMap::new(),
            reading: Spent::default(),
            gaps: Cell::new(false),
        };
        resolver.note(canonical, source.path.clone(), &source.bytes);
        resolver
    }

    /// Reads a file named by a URI reference (RFC 3986): percent escapes are decoded, schemes refused.
    ///
    /// `data:` URIs are handled elsewhere.
    pub fn read_uri(&mut self, uri: &str) -> Result<Found, FileFault> {
        let name = file_name_of_uri(uri)?;
        let (path, guessed) = self.find(&name, uri)?;
        Ok(Found { bytes: self.read_file(&path)?, path, guessed })
    }

    /// Reads a file named by a URI. Its bytes are taken from the budget before it is read.
    pub fn read_uri_within(&mut self, uri: &str, budget: &mut Budget) -> Result<Result<Found, OverBudget>, FileFault> {
        let name = file_name_of_uri(uri)?;
        let (path, guessed) = self.find(&name, uri)?;
        Ok(self.read_file_within(&path, budget)?.map(|bytes| Found { bytes, path, guessed }))
    }

    /// Path of a file named by a URI, and whether it is a guess.
    fn find(&mut self, name: &str, uri: &str) -> Result<(PathBuf, bool), FileFault> {
        let slashed = name.replace('\\', "/");
        // Exporters often write names with a literal '%' unescaped, or with another system's slashes.
        for path in [name, uri, &slashed].map(PathBuf::from) {
            match self.locate(&path) {
                Ok(_) => return Ok((path, false)),
                Err(fault) if fault.is_missing() => {}
                Err(fault) => return Err(fault),
            }
        }
        let in_any_case = self.in_any_case(Path::new(&slashed));
        in_any_case.map(|path| (path, true)).ok_or_else(|| self.missing(Path::new(name)))
    }

    /// Fault that there is no file of this name.
    pub(super) fn missing(&self, name: &Path) -> FileFault {
        match self.volume {
            Volume::Disk => FileFault::Missing(shown(name)),
            Volume::Archive(_) => FileFault::MissingInArchive(shown(name)),
        }
    }

    /// Path of an existing plain file below the root that differs from `name` only in the case of letters, of
    /// the file or of folders; of several, the first by name.
    pub fn in_any_case(&mut self, name: &Path) -> Option<PathBuf> {
        let mut path = PathBuf::new();
        for part in name.components() {
            match part {
                Component::CurDir => {}
                Component::Normal(part) if self.canonical(&path.join(part)).is_err() => {
                    let part = part.to_str()?.to_ascii_lowercase();
                    let listed = self.listed(&path)?.get(&part)?;
                    path.push(listed);
                }
                part => path.push(part),
            }
        }
        self.locate(&path).is_ok().then_some(path)
    }

    /// Entries of a folder below the root, by lower-case name.
    fn listed(&mut self, folder: &Path) -> Option<&HashMap<String, String>> {
        let folder = self.canonical(folder).ok()?;
        let folder = folder.starts_with(&self.root).then_some(folder)?;
        let list = |folder: &PathBuf| {
            let mut names = self.volume.names_in(folder);
            // Of names equal in lower case, the first by name is inserted last and stays.
            names.sort_unstable_by(|a, b| b.cmp(a));
            names.into_iter().map(|name| (name.to_ascii_lowercase(), name)).collect()
        };
        Some(self.listed.entry(folder).or_insert_with_key(list))
    }

    /// Reads a file by its path, relative to the model or absolute.
    pub fn read_file(&mut self, name: &Path) -> Result<Vec<u8>, FileFault> {
        let path = self.locate(name)?;
        let watch = Stopwatch::of_this_thread();
        let (limit, remedy) = (self.limits.file, self.limits.remedy_for_file());
        let bytes = self.volume.read(&path, limit).map_err(|why| {
            let name = shown(name);
            match why {
                Unread::NotAFile => FileFault::NotAFile(name),
                Unread::TooLarge(bytes) => FileFault::TooLarge { name, bytes, limit, remedy },
                Unread::Io(source) => FileFault::of(name, source),
            }
        })?;
        self.reading += watch.read();
        self.note(path, self.as_named(name), &bytes);
        Ok(bytes)
    }

    /// Reads a file by its path. Its bytes are taken from the budget before it is read.
    pub fn read_file_within(
        &mut self,
        name: &Path,
        budget: &mut Budget,
    ) -> Result<Result<Vec<u8>, OverBudget>, FileFault> {
        let said = self.length(&self.locate(name)?);
        if said <= self.limits.file
            && let Err(over) = budget.take(said, 1)
        {
            return Ok(Err(over));
        }
        let bytes = self.read_file(name)?;
        // The file may have grown since, or its length was unknown.
        Ok(budget.take((bytes.len() as u64).saturating_sub(said), 1).map(|()| bytes))
    }

    /// Reads a model that [`Self::locate`] has found.
    pub(super) fn read_model(&self, canonical: &Path) -> Result<Source, LoadError> {
        match &self.volume {
            Volume::Disk => super::read_source(canonical, &self.limits),
            Volume::Archive(archive) => {
                let name = canonical.strip_prefix(archive.path()).unwrap_or(canonical);
                source(archive.clone(), name, &self.limits)
            }
        }
    }

    /// Whether the folder of `named` is that of a file that [`Self::locate`] has found.
    pub(super) fn lies_beside(&self, named: &Path, canonical: &Path) -> bool {
        let folder = named.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        self.volume.canonical(folder, &self.root).is_ok_and(|folder| canonical.parent() == Some(&*folder))
    }

    /// Path of a file relative to the folder of the model as the user named it.
    pub fn as_named(&self, name: &Path) -> PathBuf {
        self.named.join(name)
    }

    /// Time spent on reading named files.
    pub fn reading(&self) -> Spent {
        self.reading
    }

    /// Folder outside of which nothing is read; canonical.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Canonical path of an existing plain file below the root. Other files are refused: opening a pipe, for example, could
    /// wait for ever.
    pub fn locate(&self, name: &Path) -> Result<PathBuf, FileFault> {
        let shown = shown(name);
        if name.as_os_str().is_empty() || name.as_os_str().as_encoded_bytes().contains(&0) {
            return Err(FileFault::BadUri(shown));
        }
        let outside = |path: &Path| match self.volume {
            Volume::Archive(_) => FileFault::OutsideArchive(shown.clone()),
            Volume::Disk => self.outside(shown.clone(), path),
        };
        let wanted = self.base.join(name);
        match self.canonical(name) {
            Ok(path) if path.starts_with(&self.root) => match self.volume.is_file(&path) {
                Ok(true) => Ok(path),
                Ok(false) => Err(FileFault::NotAFile(shown)),
                Err(source) => Err(FileFault::of(shown, source)),
            },
            Ok(path) => Err(outside(&path)),
            // Do not reveal whether a file outside the root exists.
            Err(_) if self.volume.leads_out(&wanted, &self.root) => Err(outside(&lexical(&wanted))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                self.gaps.set(true);
                Err(self.missing(name))
            }
            Err(source) => Err(FileFault::of(shown, source)),
        }
    }

    /// Canonical path of an existing file.
    fn canonical(&self, name: &Path) -> io::Result<PathBuf> {
        self.volume.canonical(&self.base.join(name), &self.root)
    }

    /// Fault for a file outside the root.
    fn outside(&self, name: String, path: &Path) -> FileFault {
        FileFault::Outside {
            name,
            within: match self.root == self.base {
                true => "the model's folder".into(),
                false => format!("'{}'", self.root.display()),
            },
            root: (!self.from_stdin).then(|| common_folder(&self.root, path)),
        }
    }

    /// Length in bytes of a file that [`Self::locate`] has found; 0 where unknown.
    pub fn length(&self, canonical: &Path) -> u64 {
        self.volume.length(canonical)
    }

    fn note(&mut self, canonical: PathBuf, shown: PathBuf, bytes: &[u8]) {
        self.known.entry(canonical).or_insert_with(|| {
            let hash = xxh3_128(bytes);
            self.read.push((FileRead { path: shown, hash }, hash));
            self.read.len() - 1
        });
    }

    /// Adds the files of a model that was loaded on behalf of this one; `hash` is that of all of them.
    pub fn absorb(&mut self, files: &[FileRead], hash: u128, gaps: bool) {
        self.gaps.set(self.gaps.get() || gaps);
        let rest = files.iter().skip(1).map(|file| (file.clone(), 0));
        self.read.extend(files.first().map(|file| (file.clone(), hash)));
        self.read.extend(rest);
    }

    /// All files read, in the order first read; the xxh3-128 of their xxh3-128 hashes (little-endian) in that
    /// order; and whether a file was missing at a path where it was looked up.
    pub fn finish(self) -> (Vec<FileRead>, u128, bool) {
        let hashes: Vec<u8> = self.read.iter().flat_map(|(_, counted)| counted.to_le_bytes()).collect();
        (self.read.into_iter().map(|(file, _)| file).collect(), xxh3_128(&hashes), self.gaps.get())
    }
}

/// File name of a relative URI reference.
fn file_name_of_uri(uri: &str) -> Result<String, FileFault> {
    let scheme = uri.split_once(':').map(|(scheme, _)| scheme);
    let is_scheme = |s: &str| {
        s.starts_with(|c: char| c.is_ascii_alphabetic())
            && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    };
    if uri.starts_with(':') {
        return Err(FileFault::BadUri(shorten(uri)));
    }
    if scheme.is_some_and(is_scheme) || uri.starts_with("//") {
        return Err(FileFault::Scheme(shorten(uri)));
    }
    percent_decode_str(uri).decode_utf8().map(|s| s.into_owned()).map_err(|_| FileFault::BadUri(shorten(uri)))
}

/// Whether a name begins with a drive letter, as on other systems.
fn is_on_a_drive(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|letter| letter.is_ascii_alphabetic()) && chars.next() == Some(':')
}

/// File name for messages: whole, unless it is longer than any system allows.
pub(crate) fn shown(name: &Path) -> String {
    const LONGEST: usize = 255;
    let name = name.to_string_lossy();
    if name.chars().nth(LONGEST).is_some() { shorten(&name) } else { name.into_owned() }
}

/// Message that a file lies elsewhere than its name says.
pub(crate) fn taken_from(name: &str, path: &Path) -> String {
    format!("'{}' is taken from '{}'", shorten(name), path.display())
}

/// Beginning of a text that may be megabytes long.
pub(crate) fn shorten(text: &str) -> String {
    const KEPT: usize = 80;
    if text.chars().nth(KEPT).is_none() { text.into() } else { text.chars().take(KEPT).chain(['…']).collect() }
}

/// Resolves `.` and `..` in `path` by text alone; `..` at a root stays at the root, and `..` that lead out of a relative path
/// are kept.
pub(crate) fn lexical(path: &Path) -> PathBuf {
    let mut clean = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if clean.file_name().is_some() || clean.has_root() => {
                clean.pop();
            }
            other => clean.push(other),
        }
    }
    clean
}

/// Innermost folder that holds both.
fn common_folder(folder: &Path, file: &Path) -> PathBuf {
    let both = folder.components().zip(file.parent().unwrap_or(file).components());
    both.take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
}
