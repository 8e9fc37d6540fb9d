//! Paths into archives, as they are typed.

use crate::load::Limits;
use crate::load::archive::{ArchiveFault, in_archive, split};
use std::io;
use std::path::Path;

/// The file on disk that is read for a path: the archive that it leads into, or what it names itself.
pub(super) fn on_disk(path: &Path) -> &Path {
    split(path).map_or(path, |(above, _)| above)
}

/// Whether there is such a file, on disk or in an archive.
pub(super) fn is_there(path: &Path) -> bool {
    path.exists() || in_archive(path).is_ok_and(|found| found.is_some_and(|(archive, name)| archive.has(name)))
}

/// Unpacks a file in an archive, by its whole path.
///
/// # Errors
/// Those of the system, and an [`ArchiveFault`] as the inner error of one.
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (archive, name) = in_archive(path)?.ok_or(ArchiveFault::None)?;
    archive.read(name, Limits::default().file)
}
