//! Files that a URI does not lead to, looked for near the model: the name is often that of another machine.

use crate::load::finder::Finder;
use crate::load::paths::{FileFault, Resolver};
use percent_encoding::percent_decode_str;
use std::path::{Path, PathBuf};

/// Where such a file lies, if it does; `missed` counts the names that were found nowhere. What was found and cannot be read is
/// not looked for elsewhere, nor is what is on a network.
pub(super) fn find(uri: &str, why: &FileFault, resolver: &mut Resolver, missed: &mut usize) -> Option<PathBuf> {
    if !matches!(why, FileFault::Missing(_) | FileFault::Scheme(_) | FileFault::Outside { .. }) {
        return None;
    }
    let uri = uri.strip_prefix("file://").unwrap_or(uri);
    if uri.contains("://") {
        return None;
    }
    let name = percent_decode_str(uri.split('?').next()?).decode_utf8().ok()?;
    let found = Finder { resolver, missed }.find(&name, &[Path::new("")]);
    found.ok().filter(|place| place.guessed).map(|place| place.path)
}

/// Whether it is told how the file that was named could be read, although another was found: not of a place on another machine.
pub(super) fn is_near(uri: &str, why: &FileFault) -> bool {
    matches!(why, FileFault::Outside { .. }) && !uri.starts_with('/')
}
