//! Files named by URIs, also where the URI leads nowhere: it is often a path on another machine.

use crate::load::finder::Finder;
use crate::load::limits::{Budget, OverBudget};
use crate::load::paths::{FileFault, Resolver, taken_from};
use crate::load::{Diagnostic, Warnings};
use percent_encoding::percent_decode_str;
use std::path::{Path, PathBuf};

/// Reads the files that the URIs of one model name.
pub(super) struct Reader<'a> {
    /// Path of the model.
    pub file: &'a Path,
    pub resolver: &'a mut Resolver,
    /// Number of names that were found nowhere.
    pub missed: usize,
}

/// Reason why a file was not read.
pub(super) enum Unread {
    TooLarge(OverBudget),
    Fault(FileFault),
}

impl Reader<'_> {
    /// Reads the file that `uri`, written at `place`, leads to, or else one of the same name near the model, with a warning.
    pub(super) fn read(
        &mut self,
        uri: &str,
        place: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<u8>, Unread> {
        let why = match self.resolver.read_uri_within(uri, budget) {
            Ok(found) => {
                let found = found.map_err(Unread::TooLarge)?;
                found.note(uri, self.file, place).into_iter().for_each(|note| warnings.push(note));
                return Ok(found.bytes);
            }
            Err(why) => why,
        };
        let Some(path) = self.near(uri, &why) else { return Err(Unread::Fault(why)) };
        if matches!(why, FileFault::Outside { .. }) && !uri.starts_with('/') {
            // Names the remedy for reading the named file, which a path on another machine does not have.
            warnings.push(why.diagnose(self.file, place));
        }
        let bytes = self.resolver.read_file_within(&path, budget).map_err(Unread::Fault)?;
        let bytes = bytes.map_err(Unread::TooLarge)?;
        warnings.push(Diagnostic::new("file-elsewhere", self.file, place, taken_from(uri, &path)));
        Ok(bytes)
    }

    /// Path of a file of that name near the model, if there is one. Files that exist but cannot be read are not looked for
    /// elsewhere, nor are those on a network.
    fn near(&mut self, uri: &str, why: &FileFault) -> Option<PathBuf> {
        let is_elsewhere =
            matches!(why, FileFault::Scheme(_) | FileFault::Outside { .. } | FileFault::OutsideArchive(_));
        if !(is_elsewhere || why.is_missing()) {
            return None;
        }
        let uri = uri.strip_prefix("file://").unwrap_or(uri);
        if uri.contains("://") {
            return None;
        }
        let name = percent_decode_str(uri.split('?').next()?).decode_utf8().ok()?;
        let found = Finder { resolver: self.resolver, missed: &mut self.missed }.find(&name, &[Path::new("")]);
        found.ok().filter(|place| place.guessed).map(|place| place.path)
    }
}
