//! Where the files of a model lie: on disk, or in the archive that the model is read from.

use super::lexical;
use crate::load::archive::{Archive, in_archive, opened, split};
use crate::load::whole;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest number of names that are listed from one folder; bounds the time.
const LISTED: usize = 10_000;

#[derive(Clone, Debug)]
pub(super) enum Volume {
    /// The disk, including files in archives whose path is named.
    Disk,
    Archive(Arc<Archive>),
}

/// Why a file was not read.
#[derive(Debug)]
pub(super) enum Unread {
    NotAFile,
    /// The file has this many bytes.
    TooLarge(u64),
    Io(io::Error),
}

impl From<io::Error> for Unread {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl Volume {
    /// Canonical path of an existing file or folder; archives have no links. Archives outside the root are not opened, whatever
    /// they hold.
    pub(super) fn canonical(&self, path: &Path, root: &Path) -> io::Result<PathBuf> {
        match self {
            Self::Disk => match path.canonicalize() {
                Err(error) if may_lead_into_a_file(&error) => in_file(path, root)?.ok_or(error),
                found => found,
            },
            Self::Archive(archive) => {
                let name = archive.inside(path).ok_or(ErrorKind::NotFound)?;
                let is_there = archive.has(Path::new(&name)) || archive.has_folder(Path::new(&name));
                if is_there { Ok(archive.path_of(&name)) } else { Err(ErrorKind::NotFound.into()) }
            }
        }
    }

    /// Whether a path leads out of the root, by its text alone.
    pub(super) fn leads_out(&self, path: &Path, root: &Path) -> bool {
        match self {
            Self::Disk => !lexical(path).starts_with(root),
            Self::Archive(archive) => archive.inside(path).is_none(),
        }
    }

    /// Whether an existing path is a plain file.
    pub(super) fn is_file(&self, canonical: &Path) -> io::Result<bool> {
        match self.within(canonical)? {
            None => fs::metadata(canonical).map(|meta| meta.is_file()),
            Some((archive, name)) => Ok(archive.has(name)),
        }
    }

    /// Length of a file in bytes; 0 where unknown.
    pub(super) fn length(&self, canonical: &Path) -> u64 {
        match self.within(canonical) {
            Ok(Some((archive, name))) => archive.length(name).unwrap_or(0),
            _ => fs::metadata(canonical).map_or(0, |meta| meta.len()),
        }
    }

    /// Names of the entries of a folder.
    pub(super) fn names_in(&self, canonical: &Path) -> Vec<String> {
        let listed = |archive: &Archive, name| archive.names_in(name).take(LISTED).map(str::to_owned).collect();
        if let Ok(Some((archive, name))) = self.within(canonical) {
            return listed(&archive, name);
        }
        // A path into an archive treats it as a folder.
        if canonical.is_file() {
            return opened(canonical).ok().flatten().map_or_else(Vec::new, |archive| listed(&archive, Path::new("")));
        }
        let entries = fs::read_dir(canonical).into_iter().flatten().take(LISTED).flatten();
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect()
    }

    /// Reads a plain file of at most `most` bytes.
    pub(super) fn read(&self, canonical: &Path, most: u64) -> Result<Vec<u8>, Unread> {
        if let Some((archive, name)) = self.within(canonical)? {
            return archive.read(name, most).map_err(|error| match error.kind() {
                ErrorKind::FileTooLarge => Unread::TooLarge(archive.length(name).unwrap_or(0)),
                _ => Unread::Io(error),
            });
        }
        let file = File::open(canonical)?;
        let meta = file.metadata()?;
        if !meta.is_file() {
            return Err(Unread::NotAFile);
        }
        if meta.len() > most {
            return Err(Unread::TooLarge(meta.len()));
        }
        // Sequential, so that the thread's measured time holds no other work.
        let bytes = whole::read_in_turn(file, meta.len(), most)?;
        if bytes.len() as u64 > most { Err(Unread::TooLarge(bytes.len() as u64)) } else { Ok(bytes) }
    }

    /// Archive that holds the file, and its name there; `None` if it lies on disk.
    fn within<'p>(&self, canonical: &'p Path) -> io::Result<Option<(Arc<Archive>, &'p Path)>> {
        match self {
            Self::Disk => in_archive(canonical),
            Self::Archive(archive) => {
                let name = canonical.strip_prefix(archive.path()).unwrap_or(canonical);
                Ok(Some((archive.clone(), name)))
            }
        }
    }
}

/// Whether an error may mean that a path leads through a file.
fn may_lead_into_a_file(error: &io::Error) -> bool {
    error.kind() == ErrorKind::NotADirectory || cfg!(windows) && error.kind() == ErrorKind::NotFound
}

/// Canonical path of a file in an archive on disk, or of one in an archive outside the root, unchecked; `None` for other
/// paths.
fn in_file(path: &Path, root: &Path) -> io::Result<Option<PathBuf>> {
    let Some((above, rest)) = split(path) else { return Ok(None) };
    let whole = above.canonicalize()?.join(rest);
    if !whole.starts_with(root) {
        return Ok(Some(whole));
    }
    let Some((archive, name)) = in_archive(&whole)? else { return Ok(None) };
    let is_there = archive.has(name) || archive.has_folder(name);
    let found = archive.inside(&whole).filter(|_| is_there).ok_or(ErrorKind::NotFound)?;
    Ok(Some(archive.path_of(&found)))
}
