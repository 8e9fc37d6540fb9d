//! Which files a model may name, and which were read.
//!
//! A glTF or MTL names other files, and whoever wrote it is not trusted: files are read only below a root folder, after
//! symbolic links are resolved, and never from a network. Everything read is listed and hashed, so that a picture can
//! say exactly what it was made from.

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
    /// As it was named, from the folder of the model as that was.
    pub path: PathBuf,
    /// xxh3-128 of its bytes.
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
    /// Where all that is named lies.
    volume: Volume,
    /// Whether the model is standard input, which lies nowhere.
    from_stdin: bool,
    /// Folder that relative names start from; canonical.
    base: PathBuf,
    /// The folder as the user named it.
    named: PathBuf,
    /// Nothing outside this folder is read; canonical.
    root: PathBuf,
    /// Limits of each file.
    limits: Limits,
    /// Each with what it counts for in the hash of all.
    read: Vec<(FileRead, u128)>,
    /// Canonical path -> index into `read`.
    known: HashMap<PathBuf, usize>,
    /// What lies in the folders that were looked through for a name in another case: names by their small letters.
    listed: HashMap<PathBuf, HashMap<String, String>>,
    reading: Spent,
    /// Whether anything was looked for where it was not.
    gaps: Cell<bool>,
}

/// A file that was read.
#[derive(Debug)]
pub struct Found {
    /// Path relative to the model's folder, or absolute.
    pub path: PathBuf,
    /// What it holds.
    pub bytes: Vec<u8>,
    /// Whether it lies elsewhere than its name says.
    pub guessed: bool,
}

impl Found {
    /// A note that the file lies elsewhere than `name` says, about `place` in `file`.
    pub fn note(&self, name: &str, file: &Path, place: &str) -> Option<Diagnostic> {
        self.guessed.then(|| Diagnostic::new("file-elsewhere", file, place, taken_from(name, &self.path)))
    }
}

/// Why a named file was not read.
#[derive(Debug, thiserror::Error)]
pub enum FileFault {
    /// It lies outside the root.
    #[error("'{name}' lies outside {within}, where nothing is read")]
    Outside {
        /// As written in the model.
        name: String,
        /// What it lies outside of, in words.
        within: String,
        /// The `--root` that would allow it; `None` where names start from the root.
        root: Option<PathBuf>,
    },
    /// It lies outside the archive of the model.
    #[error("'{0}' lies outside the archive, and nothing else is read")]
    OutsideArchive(String),
    /// There is no such file.
    #[error("'{0}' is not there")]
    Missing(String),
    /// There is none in the archive of the model.
    #[error("'{0}' is not in the archive")]
    MissingInArchive(String),
    /// It is a folder, a device or the like.
    #[error("'{0}' is not a plain file")]
    NotAFile(String),
    /// It is larger than [`super::Limits::file`].
    #[error("'{name}' has {bytes} bytes where {limit} are allowed")]
    TooLarge {
        /// As written in the model.
        name: String,
        /// Its size.
        bytes: u64,
        /// The limit.
        limit: u64,
        /// What lets it in, if anything does.
        remedy: &'static str,
    },
    /// The name is a URI of another machine or an unknown scheme.
    #[error("'{0}' is not a relative file name, and nothing is fetched from elsewhere")]
    Scheme(String),
    /// The name cannot be a URI or file name.
    #[error("'{0}' is not a valid URI")]
    BadUri(String),
    /// The system refused.
    #[error("'{name}': {source}")]
    Io {
        /// As written in the model.
        name: String,
        /// What the system said.
        source: io::Error,
    },
    /// The archive that it lies in does not give it.
    #[error("'{name}' cannot be unpacked: {fault}")]
    Packed {
        /// As written in the model.
        name: String,
        /// Why.
        fault: String,
        /// What helps.
        remedy: &'static str,
    },
}

impl FileFault {
    /// The code of a file that is not there.
    pub const MISSING: &str = "file-missing";

    /// Whether there is no such file.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing(_) | Self::MissingInArchive(_))
    }

    /// What was said of a file when it was looked for or read: by the system, or of the archive that it lies in.
    fn of(name: String, source: io::Error) -> Self {
        match ArchiveFault::of(&source) {
            Some(why) => Self::Packed { name, fault: why.to_string(), remedy: why.remedy() },
            None => Self::Io { name, source },
        }
    }

    /// This fault as a message about `place` in `file`.
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
    /// A resolver for what `source` names; `source` itself is the first file read.
    ///
    /// Relative names start from the folder of `source`; where `source` has none (standard input), from the root, or
    /// else from the current folder. Of an archive the archive is the root.
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
        // Wherever it is.
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

    /// Reads a file that a URI reference (RFC 3986) names: percent escapes are decoded, schemes refused.
    ///
    /// `data:` URIs are not for this.
    pub fn read_uri(&mut self, uri: &str) -> Result<Found, FileFault> {
        let name = file_name_of_uri(uri)?;
        let (path, guessed) = self.find(&name, uri)?;
        Ok(Found { bytes: self.read_file(&path)?, path, guessed })
    }

    /// Reads what a URI names, if the file's bytes are left of the budget, from which they are taken before it is read.
    pub fn read_uri_within(&mut self, uri: &str, budget: &mut Budget) -> Result<Result<Found, OverBudget>, FileFault> {
        let name = file_name_of_uri(uri)?;
        let (path, guessed) = self.find(&name, uri)?;
        Ok(self.read_file_within(&path, budget)?.map(|bytes| Found { bytes, path, guessed }))
    }

    /// Where a file is that a URI names, and whether that is a guess.
    fn find(&mut self, name: &str, uri: &str) -> Result<(PathBuf, bool), FileFault> {
        let slashed = name.replace('\\', "/");
        // Exporters write names with a literal '%' unescaped, or with another system's slashes, often enough.
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

    /// That there is no file of this name.
    pub(super) fn missing(&self, name: &Path) -> FileFault {
        match self.volume {
            Volume::Disk => FileFault::Missing(shown(name)),
            Volume::Archive(_) => FileFault::MissingInArchive(shown(name)),
        }
    }

    /// The path of an existing plain file below the root that differs from `name` only in the case of letters, be it of
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

    /// What lies in a folder below the root: names by their small letters.
    fn listed(&mut self, folder: &Path) -> Option<&HashMap<String, String>> {
        let folder = self.canonical(folder).ok()?;
        let folder = folder.starts_with(&self.root).then_some(folder)?;
        let list = |folder: &PathBuf| {
            let mut names = self.volume.names_in(folder);
            // Of names that are the same in small letters, the first is the last to be put in.
            names.sort_unstable_by(|a, b| b.cmp(a));
            names.into_iter().map(|name| (name.to_ascii_lowercase(), name)).collect()
        };
        Some(self.listed.entry(folder).or_insert_with_key(list))
    }

    /// Reads a file named by a path, relative to the model or absolute.
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

    /// Reads a file by its name, if its bytes are left of the budget, from which they are taken before it is read.
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
        // It may have grown meanwhile, or the system does not say how long it is.
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

    /// Whether what is named so lies in the folder of a file that [`Self::locate`] has found.
    pub(super) fn lies_beside(&self, named: &Path, canonical: &Path) -> bool {
        let folder = named.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        self.volume.canonical(folder, &self.root).is_ok_and(|folder| canonical.parent() == Some(&*folder))
    }

    /// A file as it is named, from the folder of the model as that was.
    pub fn as_named(&self, name: &Path) -> PathBuf {
        self.named.join(name)
    }

    /// Time that reading named files has taken.
    pub fn reading(&self) -> Spent {
        self.reading
    }

    /// Nothing outside this folder is read; canonical.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The canonical path of an existing plain file below the root: opening anything else, such as a pipe, could wait
    /// for ever.
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
            // Whether a file outside the root exists is nobody's business.
            Err(_) if self.volume.leads_out(&wanted, &self.root) => Err(outside(&lexical(&wanted))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                self.gaps.set(true);
                Err(self.missing(name))
            }
            Err(source) => Err(FileFault::of(shown, source)),
        }
    }

    /// The one path of what is there under a name.
    fn canonical(&self, name: &Path) -> io::Result<PathBuf> {
        self.volume.canonical(&self.base.join(name), &self.root)
    }

    /// What is told of a file outside the root.
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

    /// Bytes of a file that [`Self::locate`] has found; 0 where the system does not say.
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

    /// Every file read, in the order first read, and the xxh3-128 of their xxh3-128 hashes (little-endian) in that
    /// order, and whether any was looked for where it was not.
    pub fn finish(self) -> (Vec<FileRead>, u128, bool) {
        let hashes: Vec<u8> = self.read.iter().flat_map(|(_, counted)| counted.to_le_bytes()).collect();
        (self.read.into_iter().map(|(file, _)| file).collect(), xxh3_128(&hashes), self.gaps.get())
    }
}

/// The file name that a relative URI reference stands for.
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

/// Whether a name begins with the letter of a drive, as other systems' do.
fn is_on_a_drive(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|letter| letter.is_ascii_alphabetic()) && chars.next() == Some(':')
}

/// A file name in messages: whole, unless no system has names so long.
pub(crate) fn shown(name: &Path) -> String {
    const LONGEST: usize = 255;
    let name = name.to_string_lossy();
    if name.chars().nth(LONGEST).is_some() { shorten(&name) } else { name.into_owned() }
}

/// That a file lies elsewhere than its name says.
pub(crate) fn taken_from(name: &str, path: &Path) -> String {
    format!("'{}' is taken from '{}'", shorten(name), path.display())
}

/// The beginning of a text that may be megabytes long.
pub(crate) fn shorten(text: &str) -> String {
    const KEPT: usize = 80;
    if text.chars().nth(KEPT).is_none() { text.into() } else { text.chars().take(KEPT).chain(['…']).collect() }
}

/// `path` with `.` and `..` taken out by text alone; above a root there is nothing, and `..` that lead out of a relative path
/// stay.
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

/// The innermost folder that holds both.
fn common_folder(folder: &Path, file: &Path) -> PathBuf {
    let both = folder.components().zip(file.parent().unwrap_or(file).components());
    both.take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
}
