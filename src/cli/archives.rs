//! Paths into archives, as typed.

use crate::load::Limits;
use crate::load::archive::{ArchiveFault, in_archive, split};
use std::io;
use std::path::Path;

/// File on disk that a path refers to: the archive it leads into, or the file itself.
pub(super) fn on_disk(path: &Path) -> &Path {
    split(path).map_or(path, |(above, _)| above)
}

/// Whether a file exists, on disk or in an archive.
pub(super) fn is_there(path: &Path) -> bool {
    path.exists() || in_archive(path).is_ok_and(|found| found.is_some_and(|(archive, name)| archive.has(name)))
}

/// Unpacks a file in an archive, given its whole path.
///
/// # Errors
/// I/O errors, or one that wraps an [`ArchiveFault`].
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (archive, name) = in_archive(path)?.ok_or(ArchiveFault::None)?;
    archive.read(name, Limits::default().file)
}
