//! Zip archives, as most models are downloaded: folders of files that are read where they are, without unpacking.
//!
//! What lies in an archive has the path of the archive and then its own: `ship.zip/textures/hull.png`. Archives are not
//! trusted: only a directory of bounded size is read, names that lead out of the archive are none, a file is never larger
//! than its entry says, and its checksum has to be right. An archive in an archive is a file like others, unless it is all that
//! could be the model.

mod letters;
mod model;
mod opened;
mod tests;

pub use model::{Offered, is_called_an_archive};
pub(super) use model::{named_model, only_model, source, unreadable};
pub(crate) use opened::{in_archive, opened, split};

use super::Diagnostic;
use super::detect::{ZIP, is_called_a_model, is_zipped_kind};
use flate2::read::DeflateDecoder;
use rawzip::{CompressionMethod, ReaderAt, ZipArchive, ZipArchiveEntryWayfinder, ZipFileHeaderRecord, ZipLocator};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{MAIN_SEPARATOR, Path, PathBuf};

/// Bytes of the directory of an archive that are read at most: of more than a hundred thousand names.
const DIRECTORY: u64 = 1 << 24;

/// Bytes of memory that a byte of the directory becomes, at most: names are short, and each comes with a few numbers.
const PER_BYTE: u64 = 4;

/// How an archive begins that has no files.
const EMPTY: &[u8] = b"PK\x05\x06";

/// What is read at a time of a directory; no entry of it is longer.
const CHUNK: usize = 1 << 18;

/// What is unpacked at a time.
const PACKED: usize = 1 << 16;

/// A zip archive, of which the names of all files are known.
pub struct Archive {
    path: PathBuf,
    zip: ZipArchive<Box<dyn ReaderAt + Send + Sync>>,
    /// By name, with `/` between folders.
    entries: BTreeMap<String, Entry>,
    /// Bytes of memory that it takes.
    held: u64,
    /// Bytes of all files in it, once they are unpacked, for each model there.
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

/// Why an archive, or a file in it, cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveFault {
    /// It is called an archive.
    #[error("this is no zip archive")]
    None,
    /// It is not all of one.
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
    /// The code of messages about it.
    pub const CODE: &str = "archive-unreadable";

    /// What helps.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::None | Self::Damaged(_) | Self::Spoiled(_) => "get the archive again",
            Self::Crowded(_) => "unpack it first",
            Self::Encrypted => "unpack it first, with its password",
            Self::Method(_) => "unpack it first, or pack it with Deflate",
        }
    }

    /// This fault as a message about a file.
    pub fn diagnose(&self, file: &Path) -> Diagnostic {
        Diagnostic::new(Self::CODE, file, "", self.to_string()).remedy(self.remedy())
    }

    /// What is wrong with an archive, if that is what an error tells.
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

/// Whether a file of this name that begins so is an archive to be looked into; some kinds of model are zip archives, too.
pub(super) fn is_archive(path: &Path, bytes: &[u8]) -> bool {
    let begins = bytes.starts_with(ZIP) || bytes.starts_with(EMPTY);
    begins && !is_zipped_kind(path)
}

/// Whether a file on disk is an archive.
fn is_archive_on_disk(path: &Path) -> io::Result<bool> {
    let (mut file, mut start) = (File::open(path)?, [0; ZIP.len()]);
    match file.read_exact(&mut start) {
        Ok(()) => Ok(is_archive(path, &start)),
        Err(short) if short.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

impl Archive {
    /// Looks into an archive on disk.
    ///
    /// # Errors
    /// Those of the system, and an [`ArchiveFault`] as the inner error of one.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Self::new(path, Box::new(rawzip::FileReader::from(file)), length)
    }

    /// Looks into an archive in memory.
    ///
    /// # Errors
    /// An [`ArchiveFault`] as the inner error.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> io::Result<Self> {
        let length = bytes.len() as u64;
        let archive = Self::new(path, Box::new(bytes), length)?;
        Ok(Self { held: archive.held.saturating_add(length), ..archive })
    }

    fn new(path: &Path, reader: Box<dyn ReaderAt + Send + Sync>, length: u64) -> io::Result<Self> {
        let damaged = |error| told(error, ArchiveFault::Damaged);
        let mut chunk = vec![0; CHUNK];
        let zip = located(reader, &mut chunk, length).map_err(damaged)?;
        let directory = zip.end_offset().saturating_sub(zip.directory_offset());
        if directory > DIRECTORY {
            return Err(ArchiveFault::Crowded(directory).into());
        }
        let (mut entries, mut unpacked, mut models) = (BTreeMap::new(), 0_u64, 0_u64);
        let mut all = zip.entries(&mut chunk);
        while let Some(record) = all.next_entry().map_err(damaged)? {
            if let Some(name) = name_of(record.file_path().as_bytes()) {
                models += u64::from(is_called_a_model(Path::new(&name)));
                let entry = Entry::of(&record);
                unpacked = unpacked.saturating_add(entry.length());
                entries.insert(name, entry);
            }
        }
        let share = unpacked / models.max(1);
        Ok(Self { path: path.into(), zip, entries, held: PER_BYTE * directory, share })
    }

    /// Its own path, as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of memory that it takes: of what its directory says, and of all of it where it does not lie on disk.
    pub(super) fn held(&self) -> u64 {
        self.held
    }

    /// Bytes of all files in it, once they are unpacked, for each model there.
    pub fn share(&self) -> u64 {
        self.share
    }

    /// The name in it of what has this path, with `/` between folders; `None` of what lies elsewhere.
    pub(super) fn inside(&self, path: &Path) -> Option<String> {
        plain(path.strip_prefix(&self.path).ok()?)
    }

    /// The path of what has this name in it.
    pub(super) fn path_of(&self, name: &str) -> PathBuf {
        if name.is_empty() { self.path.clone() } else { self.path.join(name) }
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

    /// The names of what lies in a folder.
    pub fn names_in(&self, folder: &Path) -> impl Iterator<Item = &str> {
        let mut last = None;
        let names = self.below(folder).map(|name| name.split('/').next().unwrap_or_default());
        // All in one folder stand together.
        names.filter(move |name| last.replace(*name) != Some(*name))
    }

    /// The names of all files in a folder and in those in it, from that folder.
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

    /// Unpacks a file of at most so many bytes.
    ///
    /// # Errors
    /// Those of the system, with an [`ArchiveFault`] as the inner error where the archive is at fault; what is larger is an
    /// error of the kind [`ErrorKind::FileTooLarge`].
    pub fn read(&self, name: &Path, most: u64) -> io::Result<Vec<u8>> {
        let entry = self.entry(name).ok_or(ErrorKind::NotFound)?;
        let length = entry.length();
        if length > most {
            return Err(ErrorKind::FileTooLarge.into());
        }
        if entry.is_encrypted {
            return Err(ArchiveFault::Encrypted.into());
        }
        let found = self.zip.get_entry(entry.way).map_err(|error| told(error, ArchiveFault::Spoiled))?;
        let packed: Box<dyn Read + '_> = match entry.method {
            CompressionMethod::STORE => Box::new(found.reader()),
            CompressionMethod::DEFLATE => Box::new(DeflateDecoder::new_with_buf(found.reader(), vec![0; PACKED])),
            other => {
                let name = other.name().map_or_else(|| format!("method {}", other.as_u16()), str::to_owned);
                return Err(ArchiveFault::Method(name).into());
            }
        };
        // Of an entry that lies about its length no more is unpacked than tells so.
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

/// Finds the directory of an archive of so many bytes: behind it there may be a remark, in which another seems to begin.
fn located<R: ReaderAt>(mut reader: R, chunk: &mut [u8], length: u64) -> Result<ZipArchive<R>, rawzip::Error> {
    /// Directories that are tried; bounds the time.
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
    // The last try ends in the loop.
    Err(rawzip::Error::from(rawzip::ErrorKind::MissingEndOfCentralDirectory))
}

/// An error as that of the system which it is, or as a fault of the archive.
fn told(error: rawzip::Error, fault: impl Fn(String) -> ArchiveFault) -> io::Error {
    match error.into_kind() {
        rawzip::ErrorKind::IO(error) if error.kind() != ErrorKind::UnexpectedEof => error,
        other => fault(lower(&other.to_string())).into(),
    }
}

/// What an archive calls a file, as a plain path; `None` of folders and of what leads out of it.
fn name_of(bytes: &[u8]) -> Option<String> {
    let name = letters::of(bytes).replace('\\', "/");
    let is_folder = name.ends_with('/');
    plain(Path::new(name.trim_start_matches('/'))).filter(|name| !is_folder && !name.is_empty())
}

/// A path in an archive, with `/` between its folders; `None` if it leads out. What other systems take for a drive is a name.
fn plain(path: &Path) -> Option<String> {
    let text = path.to_str()?;
    let text = if MAIN_SEPARATOR == '/' { text.into() } else { text.replace(MAIN_SEPARATOR, "/") };
    let mut parts = Vec::new();
    for (i, part) in text.split('/').enumerate() {
        match part {
            // From the root on.
            "" if i == 0 && text.len() > 1 => return None,
            "" | "." => {}
            ".." => _ = parts.pop()?,
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// A text that goes on behind a colon.
fn lower(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}
