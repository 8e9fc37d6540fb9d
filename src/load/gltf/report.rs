//! Gathers what is wrong with a file, sorted by the table of [`super::codes`].

use super::codes::{Code, Verdict};
use crate::load::{Diagnostic, LoadError, Warnings};
use std::path::{Path, PathBuf};

/// Faults listed before the rest is only counted.
const SHOWN: usize = 20;

/// Faults that refuse the file, and warnings.
#[derive(Clone, Debug)]
pub(super) struct Report {
    file: PathBuf,
    faults: Vec<Diagnostic>,
    hidden: usize,
    pub(super) warnings: Warnings,
}

impl Report {
    pub(super) fn new(file: &Path) -> Self {
        Self { file: file.into(), faults: Vec::new(), hidden: 0, warnings: Warnings::default() }
    }

    /// Files a fault under its code's verdict at `place`.
    pub(super) fn add(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>) {
        match code.verdict_at(place.as_ref()) {
            Verdict::Refuse => self.refuse(code, place, text),
            Verdict::Warn => self.warn(code, place, text),
            Verdict::Accept => {}
        }
    }

    /// Files a fault that refuses the file whatever the table says of the milder cases of its code.
    pub(super) fn refuse(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>) {
        self.fault(Diagnostic::new(code.name(), &self.file, place.as_ref(), text));
    }

    /// Files a fault as a warning, whatever the table says of the graver cases of its code.
    pub(super) fn warn(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>) {
        let warning = Diagnostic::new(code.name(), &self.file, place.as_ref(), text);
        let why = code.row().why;
        let remedy = if code.row().verdict == Verdict::Warn { why } else { "" };
        self.warnings.push(warning.remedy(remedy));
    }

    /// Files a fault made elsewhere.
    pub(super) fn fault(&mut self, fault: Diagnostic) {
        if self.faults.len() < SHOWN {
            self.faults.push(fault);
        } else {
            self.hidden += 1;
        }
    }

    /// Takes over what another part found.
    pub(super) fn merge(&mut self, other: Self) {
        other.faults.into_iter().for_each(|fault| self.fault(fault));
        self.hidden += other.hidden;
        self.warnings.extend(other.warnings);
    }

    /// Stops here when anything refuses the file.
    pub(super) fn check(&mut self) -> Result<(), LoadError> {
        if self.faults.is_empty() {
            return Ok(());
        }
        if self.hidden > 0 {
            let text = format!("{} more faults", self.hidden);
            self.faults.push(Diagnostic::new("gltf-more-faults", &self.file, "", text));
        }
        Err(LoadError::Input(std::mem::take(&mut self.faults)))
    }
}
