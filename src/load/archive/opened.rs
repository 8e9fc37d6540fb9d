//! Paths that lead into archives.

use super::{Archive, is_archive_on_disk};
use std::fs::Metadata;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// What identifies an unchanged file: its length, its time of modification and, on Unix, its inode number.
type Stamp = (u64, Option<SystemTime>, u64);

fn stamp(metadata: &Metadata) -> Stamp {
    #[cfg(unix)]
    let file = std::os::unix::fs::MetadataExt::ino(metadata);
    #[cfg(not(unix))]
    let file = 0;
    (metadata.len(), metadata.modified().ok(), file)
}

/// The archive opened last: models of one archive are mostly read one after the other.
static LAST: Mutex<Option<(PathBuf, Stamp, Arc<Archive>)>> = Mutex::new(None);

/// Opens an archive on disk, or returns it if it was the last one opened; `None` if the file is not an archive.
///
/// # Errors
/// Those of [`Archive::open`].
pub(crate) fn opened(path: &Path) -> io::Result<Option<Arc<Archive>>> {
    if !is_archive_on_disk(path)? {
        return Ok(None);
    }
    let stamp = stamp(&path.metadata()?);
    // Held while opening, so that threads that want the same archive wait for it.
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, _, archive)) = last.as_ref().filter(|(known, then, _)| known == path && *then == stamp) {
        return Ok(Some(archive.clone()));
    }
    let archive = Arc::new(Archive::open(path)?);
    *last = Some((path.to_path_buf(), stamp, archive.clone()));
    Ok(Some(archive))
}

/// Splits a path that runs through a plain file as if it were a folder into that file and the rest.
pub(crate) fn split(path: &Path) -> Option<(&Path, &Path)> {
    let above = path.ancestors().find(|above| above.metadata().is_ok())?;
    let rest = path.strip_prefix(above).ok()?;
    (above.is_file() && above != path).then_some((above, rest))
}

/// The archive that a path leads into, and the rest of the path; `None` if it leads into none.
///
/// # Errors
/// Those of [`Archive::open`].
pub(crate) fn in_archive(path: &Path) -> io::Result<Option<(Arc<Archive>, &Path)>> {
    let Some((above, rest)) = split(path) else { return Ok(None) };
    Ok(opened(above)?.map(|archive| (archive, rest)))
}
