//! Files that a URI does not lead to, looked for near the model: the name is often that of another machine.

use crate::load::mtl::Finder;
use crate::load::paths::Resolver;
use percent_encoding::percent_decode_str;
use std::path::{Path, PathBuf};

/// Where such a file lies, if it does; `missed` counts the names that were found nowhere. Nothing is looked for in place of
/// what is on a network.
pub(super) fn find(uri: &str, resolver: &mut Resolver, missed: &mut usize) -> Option<PathBuf> {
    let uri = uri.strip_prefix("file://").unwrap_or(uri);
    if uri.contains("://") {
        return None;
    }
    let name = percent_decode_str(uri.split('?').next()?).decode_utf8().ok()?;
    let mut finder = Finder { resolver, missed: *missed };
    let found = finder.find(&name, &[Path::new("")]);
    *missed = finder.missed;
    found.ok().map(|place| place.path)
}
