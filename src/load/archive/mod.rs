//! Zip archives, as most models are downloaded: folders of files that are read in place, without unpacking.
//!
//! The path of a file in an archive is the archive's path followed by its own: `ship.zip/textures/hull.png`. Archives are not
//! trusted: the directory is read up to a bounded size, names that lead out of the archive are skipped, a file is never larger
//! than its entry says, and its checksum has to be right. An archive in an archive is an ordinary file, unless it is the only
//! candidate for the model.

mod letters;
mod model;
mod opened;
mod tests;

pub use model::{ArchiveModel, is_called_an_archive};
pub(super) use model::{named_model, only_model, source, unreadable};
pub(crate) use opened::{in_archive, opened, split};

use super::Diagnostic;
use super::detect::{ZIP, is_zipped_kind};
use flate2::read::DeflateDecoder;
use rawzip::{CompressionMethod, ReaderAt, ZipArchive, ZipArchiveEntryWayfinder, ZipFileHeaderRecord, ZipLocator};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{MAIN_SEPARATOR, Path, PathBuf};

/// Largest directory that is read, in bytes: enough for more than a hundred thousand names.
const DIRECTORY: u64 = 1 << 24;

/// Upper bound of the bytes of memory per byte of the directory: names are short, and each comes with a few numbers.
const PER_BYTE: u64 = 4;

/// First bytes of an archive without files.
const EMPTY: &[u8] = b"PK\x05\x06";

/// Bytes of the directory that are read at a time; no entry is longer.
const CHUNK: usize = 1 << 18;

/// Bytes of packed data that are read at a time.
const PACKED: usize = 1 << 16;

/// A zip archive whose directory has been read.
pub struct Archive {
    path: PathBuf,
    zip: ZipArchive<Box<dyn ReaderAt + Send + Sync>>,
    /// Files by name, with `/` between folders.
    entries: BTreeMap<String, Entry>,
    /// Bytes of memory that the archive takes.
    held: u64,
    /// Bytes of all its files once unpacked, divided by the number of models.
    share: u64,
}

/// A file in an archive.
#[derive(Clone, Copy, Debug)]
struct Entry {
    way: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    is_encrypted: bool,
}

impl Entry {
    fn of(record: &ZipFileHeaderRecord) -> Self {
        Self {
            way: record.wayfinder(),
            method: record.compression_method(),
            is_encrypted: record.flags().is_encrypted(),
        }
    }

    fn length(&self) -> u64 {
        self.way.uncompressed_size_hint()
    }
}

/// Reason why an archive, or a file in it, cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveFault {
    /// The file has an archive's name but is no zip archive.
    #[error("this is no zip archive")]
    None,
    /// The archive is damaged or incomplete.
    #[error("the archive is damaged: {0}")]
    Damaged(String),
    /// The directory is larger than is read; its bytes.
    #[error("the directory of the archive has {0} bytes where {DIRECTORY} are read")]
    Crowded(u64),
    /// The file is protected by a password.
    #[error("it is encrypted")]
    Encrypted,
    /// The file is packed by a method other than Deflate.
    #[error("it is packed by {0}, which is not known here")]
    Method(String),
    /// The unpacked data is not what was packed.
    #[error("it is damaged: {0}")]
    Spoiled(String),
}

impl ArchiveFault {
    /// Code of the diagnostics about this fault.
    pub const CODE: &str = "archive-unreadable";

    /// Returns what the user can do about this fault.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::None | Self::Damaged(_) | Self::Spoiled(_) => "get the archive again",
            Self::Crowded(_) => "unpack it first",
            Self::Encrypted => "unpack it first, with its password",
            Self::Method(_) => "unpack it first, or pack it with Deflate",
        }
    }

    /// Returns this fault as a diagnostic about a file.
    pub fn diagnose(&self, file: &Path) -> Diagnostic {
        Diagnostic::new(Self::CODE, file, "", self.to_string()).remedy(self.remedy())
    }

    /// Returns the archive fault inside an error, if there is one.
    pub fn of(error: &io::Error) -> Option<&Self> {
        error.get_ref()?.downcast_ref()
    }
}

impl From<ArchiveFault> for io::Error {
    fn from(fault: ArchiveFault) -> Self {
        Self::new(ErrorKind::InvalidData, fault)
    }
}

impl fmt::Debug for Archive {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Archive").field("path", &self.path).field("files", &self.entries.len()).finish_non_exhaustive()
    }
}

/// Returns whether a file with this name and these first bytes is an archive to be opened; some model formats are zip archives,
/// too.
pub(super) fn is_archive(path: &Path, bytes: &[u8]) -> bool {
    let begins = bytes.starts_with(ZIP) || bytes.starts_with(EMPTY);
    begins && !is_zipped_kind(path)
}

/// Returns whether a file on disk is an archive.
fn is_archive_on_disk(path: &Path) -> io::Result<bool> {
    let (mut file, mut start) = (File::open(path)?, [0; ZIP.len()]);
    match file.read_exact(&mut start) {
        Ok(()) => Ok(is_archive(path, &start)),
        Err(short) if short.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

impl Archive {
    /// Opens an archive on disk.
    ///
    /// # Errors
    /// Those of the system, or an [`ArchiveFault`] as the inner error.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Self::new(path, Box::new(rawzip::FileReader::from(file)), length)
    }

    /// Opens an archive in memory.
    ///
    /// # Errors
    /// An [`ArchiveFault`] as the inner error.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> io::Result<Self> {
        let length = bytes.len() as u64;
        let archive = Self::new(path, Box::new(bytes), length)?;
        Ok(Self { held: archive.held.saturating_add(length), ..archive })
    }

    fn new(path: &Path, reader: Box<dyn ReaderAt + Send + Sync>, length: u64) -> io::Result<Self> {
        let damaged = |error| as_fault(error, ArchiveFault::Damaged);
        let mut chunk = vec![0; CHUNK];
        let zip = located(reader, &mut chunk, length).map_err(damaged)?;
        let directory = zip.end_offset().saturating_sub(zip.directory_offset());
        if directory > DIRECTORY {
            return Err(ArchiveFault::Crowded(directory).into());
        }
        let mut entries = BTreeMap::new();
        let mut all = zip.entries(&mut chunk);
        while let Some(record) = all.next_entry().map_err(damaged)? {
            if let Some(name) = name_of(record.file_path().as_bytes()) {
                entries.insert(name, Entry::of(&record));
            }
        }
        let unpacked = entries.values().fold(0_u64, |sum, entry: &Entry| sum.saturating_add(entry.length()));
        let archive = Self { path: path.into(), zip, entries, held: PER_BYTE * directory, share: 0 };
        let models = archive.models(Path::new("")).len() as u64;
        Ok(Self { share: unpacked / models.max(1), ..archive })
    }

    /// Path of the archive, as the user named it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of memory that the archive takes: for its directory, and for all of its data where that is in memory.
    pub(super) fn held(&self) -> u64 {
        self.held
    }

    /// Bytes of all its files once unpacked, divided by the number of models.
    pub fn share(&self) -> u64 {
        self.share
    }

    /// Name in the archive of the file with this path, with `/` between folders; `None` if the path lies outside.
    pub(super) fn inside(&self, path: &Path) -> Option<String> {
        plain(path.strip_prefix(&self.path).ok()?)
    }

    /// Path of the file with this name in the archive.
    pub(super) fn path_of(&self, name: &str) -> PathBuf {
        if name.is_empty() { self.path.clone() } else { self.path.join(name) }
    }

    /// Returns whether the archive has a file of this name.
    pub fn has(&self, name: &Path) -> bool {
        self.entry(name).is_some()
    }

    /// Returns whether the archive has a file below a folder of this name.
    pub fn has_folder(&self, name: &Path) -> bool {
        self.names_in(name).next().is_some()
    }

    /// Unpacked bytes of a file, as the directory states; `None` if there is no such file.
    pub fn length(&self, name: &Path) -> Option<u64> {
        self.entry(name).map(Entry::length)
    }

    /// Names of the files and folders directly in a folder.
    pub fn names_in(&self, folder: &Path) -> impl Iterator<Item = &str> {
        let mut last = None;
        let names = self.below(folder).map(|name| name.split('/').next().unwrap_or_default());
        // Entries are sorted, so those below one child folder are adjacent.
        names.filter(move |name| last.replace(*name) != Some(*name))
    }

    /// Paths of all files below a folder, relative to it.
    fn below(&self, folder: &Path) -> impl Iterator<Item = &str> {
        let start = plain(folder).map(|name| if name.is_empty() { name } else { name + "/" });
        start.into_iter().flat_map(|start| {
            let below = self.entries.range(start.clone()..);
            below.map_while(move |(name, _)| name.strip_prefix(&start))
        })
    }

    fn entry(&self, name: &Path) -> Option<&Entry> {
        self.entries.get(&plain(name)?)
    }

    /// Unpacks a file of at most `most` bytes.
    ///
    /// # Errors
    /// Those of the system, with an [`ArchiveFault`] as the inner error where the archive is at fault; a larger file is an error
    /// of the kind [`ErrorKind::FileTooLarge`].
    pub fn read(&self, name: &Path, most: u64) -> io::Result<Vec<u8>> {
        let entry = self.entry(name).ok_or(ErrorKind::NotFound)?;
        let length = entry.length();
        if length > most {
            return Err(ErrorKind::FileTooLarge.into());
        }
        if entry.is_encrypted {
            return Err(ArchiveFault::Encrypted.into());
        }
        let found = self.zip.get_entry(entry.way).map_err(|error| as_fault(error, ArchiveFault::Spoiled))?;
        let packed: Box<dyn Read + '_> = match entry.method {
            CompressionMethod::STORE => Box::new(found.reader()),
            CompressionMethod::DEFLATE => Box::new(DeflateDecoder::new_with_buf(found.reader(), vec![0; PACKED])),
            other => {
                let name = other.name().map_or_else(|| format!("method {}", other.as_u16()), str::to_owned);
                return Err(ArchiveFault::Method(name).into());
            }
        };
        // One byte more than the stated length is enough to detect an entry that lies about it.
        let mut checked = found.verifying_reader(packed.take(length.saturating_add(1)));
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(usize::try_from(length).map_or(0, |length| length.saturating_add(1)))?;
        match checked.read_to_end(&mut bytes) {
            Ok(_) => Ok(bytes),
            Err(error) => match error.kind() {
                ErrorKind::InvalidData | ErrorKind::InvalidInput | ErrorKind::UnexpectedEof => {
                    Err(ArchiveFault::Spoiled(lower(&error.to_string())).into())
                }
                _ => Err(error),
            },
        }
    }
}

/// Locates the directory of an archive of `length` bytes; the comment behind it may contain what looks like another one.
fn located<R: ReaderAt>(mut reader: R, chunk: &mut [u8], length: u64) -> Result<ZipArchive<R>, rawzip::Error> {
    /// Most directories that are tried; bounds the time.
    const TRIES: usize = 16;
    let mut end = length;
    for left in (0..TRIES).rev() {
        let error = match ZipLocator::new().locate_in_reader(reader, chunk, end) {
            Ok(zip) => return Ok(zip),
            Err((back, error)) => {
                reader = back;
                error
            }
        };
        match error.eocd_offset().filter(|at| left > 0 && *at < end) {
            Some(at) => end = at,
            None => return Err(error),
        }
    }
    // Not reached: the last try returns from the loop.
    Err(rawzip::Error::from(rawzip::ErrorKind::MissingEndOfCentralDirectory))
}

/// Returns an error of the system as it is, and any other as a fault of the archive.
fn as_fault(error: rawzip::Error, fault: impl Fn(String) -> ArchiveFault) -> io::Error {
    match error.into_kind() {
        rawzip::ErrorKind::IO(error) if error.kind() != ErrorKind::UnexpectedEof => error,
        other => fault(lower(&other.to_string())).into(),
    }
}

/// Decodes the name of an entry to a plain path; `None` for folders and for names that lead out of the archive.
fn name_of(bytes: &[u8]) -> Option<String> {
    let name = letters::of(bytes).replace('\\', "/");
    let is_folder = name.ends_with('/');
    plain(Path::new(name.trim_start_matches('/'))).filter(|name| !is_folder && !name.is_empty())
}

/// Normalises a path in an archive, with `/` between folders; `None` if it leads out. A drive letter of another system is a
/// plain name.
fn plain(path: &Path) -> Option<String> {
    let text = path.to_str()?;
    let text = if MAIN_SEPARATOR == '/' { text.into() } else { text.replace(MAIN_SEPARATOR, "/") };
    let mut parts = Vec::new();
    for (i, part) in text.split('/').enumerate() {
        match part {
            // An absolute path.
            "" if i == 0 && text.len() > 1 => return None,
            "" | "." => {}
            ".." => _ = parts.pop()?,
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// Lower-cases the first letter of a text that follows a colon.
fn lower(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}
