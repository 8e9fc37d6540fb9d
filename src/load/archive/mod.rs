//! Zip archives, as most models are downloaded: folders of files that are read where they are, without unpacking.
//!
//! What lies in an archive has the path of the archive and then its own: `ship.zip/textures/hull.png`. Archives are not
//! trusted: only a directory of bounded size is read, names that lead out of the archive are none, a file is never larger
//! than its entry says, and its checksum has to be right.

mod tests;

use super::detect::{ZIP, is_called_a_model, is_zipped_kind};
use super::limits::Limits;
use super::paths::{FileFault, lexical, shorten, shown};
use super::suggest::nearest;
use super::{Diagnostic, LoadError, Source};
use flate2::read::DeflateDecoder;
use rawzip::{CompressionMethod, ReaderAt, ZipArchive, ZipArchiveEntryWayfinder, ZipLocator};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Bytes of the directory of an archive that are read at most: half a million names and more.
const DIRECTORY: u64 = 1 << 26;

/// How an archive begins that has no files.
const EMPTY: &[u8] = b"PK\x05\x06";

/// What is read at a time of a directory; no entry of it is longer.
const CHUNK: usize = 1 << 18;

/// A zip archive, of which the names of all files are known.
pub struct Archive {
    path: PathBuf,
    zip: ZipArchive<Box<dyn ReaderAt + Send + Sync>>,
    /// By name, with `/` between folders.
    entries: BTreeMap<String, Entry>,
    /// Bytes of it that are in memory.
    held: u64,
}

/// A file in an archive.
#[derive(Clone, Copy, Debug)]
struct Entry {
    way: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    is_encrypted: bool,
}

impl Entry {
    fn length(&self) -> u64 {
        self.way.uncompressed_size_hint()
    }
}

/// Why an archive, or a file in it, cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveFault {
    /// It is no archive, or not all of one.
    #[error("the archive is damaged: {0}")]
    Damaged(String),
    /// There are more names than are read.
    #[error("the directory of the archive has {0} bytes where {DIRECTORY} are read")]
    Crowded(u64),
    /// It is protected by a password.
    #[error("it is encrypted")]
    Encrypted,
    /// It is packed by a method other than Deflate.
    #[error("it is packed by {0}, which is not known here")]
    Method(String),
    /// What is unpacked is not what was packed.
    #[error("it is damaged: {0}")]
    Spoiled(String),
}

impl ArchiveFault {
    /// What helps.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Damaged(_) | Self::Spoiled(_) => "get the archive again",
            Self::Crowded(_) => "unpack it first",
            Self::Encrypted => "unpack it first, with its password",
            Self::Method(_) => "unpack it first, or pack it with Deflate",
        }
    }

    /// This fault as a message about a file.
    pub fn diagnose(&self, file: &Path) -> Diagnostic {
        Diagnostic::new(Self::CODE, file, "", self.to_string()).remedy(self.remedy())
    }

    /// The code of its messages.
    pub const CODE: &str = "archive-unreadable";
}

impl fmt::Debug for Archive {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Archive").field("path", &self.path).field("files", &self.entries.len()).finish()
    }
}

/// Whether a file has the name of a zip archive.
pub fn is_called_an_archive(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zip"))
}

/// Whether a file of this name that begins so is an archive to be looked into; some kinds of model are zip archives, too.
pub(super) fn is_archive(path: &Path, bytes: &[u8]) -> bool {
    let begins = bytes.starts_with(ZIP) || bytes.starts_with(EMPTY);
    begins && !is_zipped_kind(path)
}

/// The same of a plain file that is open, by what it begins with; its position is behind that.
pub(super) fn begins_as_archive(path: &Path, file: &mut File) -> io::Result<bool> {
    let mut start = [0; ZIP.len()];
    match file.read_exact(&mut start) {
        Ok(()) => Ok(is_archive(path, &start)),
        Err(short) if short.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

/// The path of a plain file that a path goes through as if it were a folder, and the rest of it.
pub(crate) fn split(path: &Path) -> Option<(&Path, &Path)> {
    let above = path.ancestors().skip(1).find(|above| above.metadata().is_ok())?;
    let rest = path.strip_prefix(above).ok()?;
    above.is_file().then_some((above, rest))
}

/// The archive that a path names, or leads into; `None` where there is none that can be read.
pub fn of_path(path: &Path) -> Option<Archive> {
    let named = if is_called_an_archive(path) { Archive::open(path).ok().flatten() } else { None };
    named.or_else(|| in_archive(path).ok().flatten().map(|(archive, _)| archive))
}

/// Unpacks a file in an archive, by its whole path.
///
/// # Errors
/// Those of the system, and an [`ArchiveFault`] as the inner error of one.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (archive, name) = in_archive(path)?.ok_or(io::ErrorKind::NotFound)?;
    archive.read(&name, Limits::default().file)
}

/// Whether there is such a file, on disk or in an archive.
pub fn is_there(path: &Path) -> bool {
    path.exists() || in_archive(path).is_ok_and(|found| found.is_some_and(|(archive, name)| archive.has(&name)))
}

/// The archive that a path leads into, and the path of the file in it; `None` if it leads into none.
pub(super) fn in_archive(path: &Path) -> io::Result<Option<(Archive, PathBuf)>> {
    let Some((above, rest)) = split(path) else { return Ok(None) };
    Ok(Archive::open(above)?.map(|archive| (archive, rest.to_path_buf())))
}

impl Archive {
    /// Looks into an archive on disk; `None` if that file is none.
    ///
    /// # Errors
    /// Those of the system, and an [`ArchiveFault`] as the inner error of one.
    pub fn open(path: &Path) -> io::Result<Option<Self>> {
        let mut file = File::open(path)?;
        if !begins_as_archive(path, &mut file)? {
            return Ok(None);
        }
        Self::of_file(path, file).map(Some)
    }

    /// The same of one that is open.
    ///
    /// # Errors
    /// Those of [`Self::open`].
    pub(super) fn of_file(path: &Path, file: File) -> io::Result<Self> {
        let length = file.metadata()?.len();
        Self::new(path, Box::new(rawzip::FileReader::from(file)), length)
    }

    /// Looks into an archive in memory.
    ///
    /// # Errors
    /// An [`ArchiveFault`] as the inner error.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> io::Result<Self> {
        let held = bytes.len() as u64;
        Ok(Self { held, ..Self::new(path, Box::new(bytes), held)? })
    }

    fn new(path: &Path, reader: Box<dyn ReaderAt + Send + Sync>, length: u64) -> io::Result<Self> {
        let damaged = |error: rawzip::Error| fault(ArchiveFault::Damaged(lower(&error.to_string())));
        let mut chunk = vec![0; CHUNK];
        let zip =
            ZipLocator::new().locate_in_reader(reader, &mut chunk, length).map_err(|(_, error)| damaged(error))?;
        let directory = zip.end_offset().saturating_sub(zip.directory_offset());
        if directory > DIRECTORY {
            return Err(fault(ArchiveFault::Crowded(directory)));
        }
        let mut entries = BTreeMap::new();
        let mut all = zip.entries(&mut chunk);
        while let Some(entry) = all.next_entry().map_err(damaged)? {
            let name = (!entry.is_dir()).then(|| name_of(entry.file_path().as_bytes())).flatten();
            let (method, is_encrypted) = (entry.compression_method(), entry.flags().is_encrypted());
            let found = Entry { way: entry.wayfinder(), method, is_encrypted };
            name.into_iter().for_each(|name| _ = entries.insert(name, found));
        }
        Ok(Self { path: lexical(path), zip, entries, held: 0 })
    }

    /// Bytes that it takes in memory: nothing to speak of where it lies on disk.
    pub(super) fn held(&self) -> u64 {
        self.held
    }

    /// Its own path, as it was named but for `.` and `..`.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The names of all models in it, in order; what is hidden is none, nor what a Mac has put beside each file.
    pub fn models(&self) -> impl Iterator<Item = &str> {
        let is_shown = |name: &&str| name.split('/').all(|part| !part.starts_with('.') && part != "__MACOSX");
        self.entries.keys().map(String::as_str).filter(is_shown).filter(|name| is_called_a_model(Path::new(name)))
    }

    /// Bytes of all files in it, once they are unpacked.
    pub fn unpacked(&self) -> u64 {
        self.entries.values().map(Entry::length).fold(0, u64::saturating_add)
    }

    /// Whether a file of this name is in it.
    pub fn has(&self, name: &Path) -> bool {
        self.entry(name).is_some()
    }

    /// Whether any file in it lies in a folder of this name.
    pub fn has_folder(&self, name: &Path) -> bool {
        self.names_in(name).next().is_some()
    }

    /// Bytes of a file in it, once it is unpacked, as the archive says; `None` if there is no such file.
    pub fn length(&self, name: &Path) -> Option<u64> {
        self.entry(name).map(Entry::length)
    }

    /// The names of what lies in a folder, some of them more than once.
    pub fn names_in(&self, folder: &Path) -> impl Iterator<Item = &str> {
        let start = slashed(folder).map(|name| if name.is_empty() { name } else { name + "/" });
        start.into_iter().flat_map(|start| {
            let below = self.entries.range(start.clone()..);
            below.map_while(move |(name, _)| name.strip_prefix(&start)?.split('/').next())
        })
    }

    fn entry(&self, name: &Path) -> Option<&Entry> {
        self.entries.get(&slashed(name)?)
    }

    /// Unpacks a file of at most so many bytes.
    ///
    /// # Errors
    /// Those of the system, with an [`ArchiveFault`] as the inner error where the archive is at fault; what is larger is an
    /// error of the kind [`io::ErrorKind::FileTooLarge`].
    pub fn read(&self, name: &Path, most: u64) -> io::Result<Vec<u8>> {
        let entry = self.entry(name).ok_or(io::ErrorKind::NotFound)?;
        let length = entry.length();
        if length > most {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        if entry.is_encrypted {
            return Err(fault(ArchiveFault::Encrypted));
        }
        let damaged = |why: String| fault(ArchiveFault::Spoiled(lower(&why)));
        let found = self.zip.get_entry(entry.way).map_err(|error| damaged(error.to_string()))?;
        let packed: Box<dyn Read + '_> = match entry.method {
            CompressionMethod::STORE => Box::new(found.reader()),
            CompressionMethod::DEFLATE => Box::new(DeflateDecoder::new_with_buf(found.reader(), vec![0; CHUNK])),
            other => {
                let name = other.name().map_or_else(|| format!("method {}", other.as_u16()), str::to_owned);
                return Err(fault(ArchiveFault::Method(name)));
            }
        };
        // Of an entry that lies about its length no more is unpacked than tells so.
        let mut checked = found.verifying_reader(packed.take(length.saturating_add(1)));
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(usize::try_from(length).map_or(0, |length| length.saturating_add(1)))?;
        checked.read_to_end(&mut bytes).map_err(|error| damaged(error.to_string()))?;
        Ok(bytes)
    }
}

/// A model in an archive: the only one there.
pub(super) fn only_model(archive: Archive, limits: &Limits) -> Result<Source, LoadError> {
    let names: Vec<&str> = archive.models().collect();
    let [name] = names[..] else { return Err(none_or_several(&archive, &names).into()) };
    let name = PathBuf::from(name);
    source(Arc::new(archive), &name, limits)
}

/// The model of an archive that is named.
pub(super) fn named_model(archive: Archive, name: &Path, limits: &Limits) -> Result<Source, LoadError> {
    if archive.has(name) {
        return source(Arc::new(archive), name, limits);
    }
    let path = archive.path.join(name);
    if archive.has_folder(name) {
        let fault = Diagnostic::new("file-not-plain", path, "", "is a folder in an archive");
        return Err(fault.remedy("name a file in it").into());
    }
    let names: Vec<&str> = archive.models().collect();
    let (archive, name) = (archive.path.display(), shown(name));
    let remedy = match (nearest(&name, names.iter().copied()), &names[..]) {
        (Some(meant), _) => format!("did you mean '{archive}/{meant}'?"),
        (None, [first, ..]) => format!("it has {} models, the first is '{archive}/{first}'", names.len()),
        (None, []) => "it has no model".into(),
    };
    Err(Diagnostic::new(FileFault::MISSING, path, "", "is not in the archive").remedy(remedy).into())
}

/// A file in an archive, in memory.
pub(super) fn source(archive: Arc<Archive>, name: &Path, limits: &Limits) -> Result<Source, LoadError> {
    let path = archive.path.join(name);
    match archive.read(name, limits.file) {
        Ok(bytes) => Ok(Source { path, bytes, within: Some(archive) }),
        Err(error) if error.kind() == io::ErrorKind::FileTooLarge => {
            Err(super::too_large(&path, archive.length(name).unwrap_or_default(), limits).into())
        }
        Err(error) => Err(unreadable(error, &path)),
    }
}

/// Why a model or an archive that was named cannot be read.
pub(super) fn unreadable(error: io::Error, path: &Path) -> LoadError {
    if let Some(fault) = of_archive(&error) {
        return fault.diagnose(path).into();
    }
    LoadError::Read { what: Box::new(Diagnostic::new("file-unreadable", path, "", "cannot be read")), source: error }
}

/// What is wrong with an archive, if that is what an error tells.
pub fn of_archive(error: &io::Error) -> Option<&ArchiveFault> {
    error.get_ref()?.downcast_ref()
}

/// What is told where it is not clear which model of an archive is meant, and of one without any.
fn none_or_several(archive: &Archive, models: &[&str]) -> Diagnostic {
    /// So many are told.
    const TOLD: usize = 4;
    let list = |names: &mut dyn Iterator<Item = &str>| {
        names.take(TOLD).map(|name| format!("'{}'", shorten(name))).collect::<Vec<_>>().join(", ")
    };
    let path = &archive.path;
    let Some(first) = models.first() else {
        let held = list(&mut archive.entries.keys().map(String::as_str));
        let text = match archive.entries.len() {
            0 => "this archive is empty".into(),
            count if count > TOLD => format!("no model is in this archive: it has {held} and {} more", count - TOLD),
            _ => format!("no model is in this archive: it has {held}"),
        };
        let remedy = "meshray reads .glb, .gltf, .vrm, .obj, .ply, .stl and .nff files in it";
        return Diagnostic::new("archive-empty", path.as_path(), "", text).remedy(remedy);
    };
    let (count, held) = (models.len(), list(&mut models.iter().copied()));
    let dots = if count > TOLD { ", …" } else { "" };
    let text = format!("{count} models are in this archive: {held}{dots}");
    let remedy = format!("name one, as in '{}'", path.join(first).display());
    Diagnostic::new("archive-several", path.as_path(), "", text).remedy(remedy)
}

/// What an archive calls a file, as a plain path; `None` if that leads out of it.
fn name_of(bytes: &[u8]) -> Option<String> {
    let name = String::from_utf8_lossy(bytes).replace('\\', "/");
    slashed(Path::new(name.trim_start_matches('/'))).filter(|name| !name.is_empty())
}

/// A path in an archive, with `/` between its folders; `None` if it leads out.
fn slashed(path: &Path) -> Option<String> {
    let clean = lexical(path);
    let plain = |part| match part {
        Component::Normal(part) => part.to_str(),
        _ => None,
    };
    let parts: Vec<&str> = clean.components().map(plain).collect::<Option<_>>()?;
    Some(parts.join("/"))
}

fn fault(fault: ArchiveFault) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, fault)
}

/// A text that goes on behind a colon.
fn lower(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}
