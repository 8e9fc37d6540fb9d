//! Where the files of a model lie: on disk, or in the archive that it is read from.

use super::super::archive::Archive;
use super::super::whole;
use super::lexical;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Names in one folder that are looked at; bounds the time.
const LISTED: usize = 10_000;

#[derive(Clone, Debug)]
pub(super) enum Volume {
    Disk,
    Archive(Arc<Archive>),
}

/// Why a file was not read.
#[derive(Debug)]
pub(super) enum Unread {
    NotAFile,
    /// It has so many bytes.
    TooLarge(u64),
    Io(io::Error),
}

impl From<io::Error> for Unread {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl Volume {
    /// The one path of a file or folder that is there; an archive knows no links.
    pub(super) fn canonical(&self, path: &Path) -> io::Result<PathBuf> {
        match self {
            Self::Disk => path.canonicalize(),
            Self::Archive(archive) => {
                let clean = lexical(path);
                let is_there =
                    clean.strip_prefix(archive.path()).is_ok_and(|name| archive.has(name) || archive.has_folder(name));
                if is_there { Ok(clean) } else { Err(io::ErrorKind::NotFound.into()) }
            }
        }
    }

    /// Whether something that is there is a plain file.
    pub(super) fn is_file(&self, canonical: &Path) -> io::Result<bool> {
        match self {
            Self::Disk => fs::metadata(canonical).map(|meta| meta.is_file()),
            Self::Archive(archive) => Ok(archive.has(within(archive, canonical))),
        }
    }

    /// Bytes of a file; 0 where nobody says.
    pub(super) fn length(&self, canonical: &Path) -> u64 {
        match self {
            Self::Disk => fs::metadata(canonical).map_or(0, |meta| meta.len()),
            Self::Archive(archive) => archive.length(within(archive, canonical)).unwrap_or(0),
        }
    }

    /// The names of what lies in a folder.
    pub(super) fn names_in(&self, canonical: &Path) -> Vec<String> {
        match self {
            Self::Disk => {
                let entries = fs::read_dir(canonical).into_iter().flatten().take(LISTED).flatten();
                entries.filter_map(|entry| entry.file_name().into_string().ok()).collect()
            }
            Self::Archive(archive) => {
                let mut names: Vec<String> =
                    archive.names_in(within(archive, canonical)).take(LISTED).map(str::to_owned).collect();
                names.dedup();
                names
            }
        }
    }

    /// Reads a plain file of at most so many bytes.
    pub(super) fn read(&self, canonical: &Path, most: u64) -> Result<Vec<u8>, Unread> {
        match self {
            Self::Disk => {
                let file = File::open(canonical)?;
                let meta = file.metadata()?;
                if !meta.is_file() {
                    return Err(Unread::NotAFile);
                }
                if meta.len() > most {
                    return Err(Unread::TooLarge(meta.len()));
                }
                // What other threads would do meanwhile is not in this one's time.
                let bytes = whole::read_in_turn(file, meta.len(), most)?;
                if bytes.len() as u64 > most { Err(Unread::TooLarge(bytes.len() as u64)) } else { Ok(bytes) }
            }
            Self::Archive(archive) => match archive.read(within(archive, canonical), most) {
                Err(error) if error.kind() == io::ErrorKind::FileTooLarge => {
                    Err(Unread::TooLarge(self.length(canonical)))
                }
                read => Ok(read?),
            },
        }
    }
}

/// The name in an archive of what has this path.
fn within<'p>(archive: &Archive, path: &'p Path) -> &'p Path {
    path.strip_prefix(archive.path()).unwrap_or(path)
}
