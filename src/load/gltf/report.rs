//! Collects the faults of a file, sorted by the table of [`super::codes`].

use super::codes::{self, Code, Verdict};
use crate::load::diagnostic::CUT_OFF;
use crate::load::{Diagnostic, LoadError, Warnings};
use std::path::{Path, PathBuf};

/// Most faults that are listed; the rest is only counted.
const SHOWN: usize = 20;

/// Most places of left-out parts that are remembered.
const LEFT_OUT: usize = 1 << 16;

/// Faults that refuse the file, and warnings.
#[derive(Clone, Debug)]
pub(super) struct Report {
    file: PathBuf,
    faults: Warnings,
    pub(super) warnings: Warnings,
    /// Whether invalid parts that can be left out are, rather than refusing the file; and their places.
    leaves_out: bool,
    left_out: Vec<String>,
}

impl Report {
    pub(super) fn new(file: &Path) -> Self {
        let (faults, warnings) = (Warnings::default(), Warnings::default());
        Self { file: file.into(), faults, warnings, leaves_out: false, left_out: Vec::new() }
    }

    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    /// Sets whether faults in parts that can be left out become warnings, with their places recorded.
    pub(super) fn leave_out(&mut self, whether: bool) {
        self.leaves_out = whether;
    }

    /// Returns the recorded places, in the order of their faults, and clears them.
    pub(super) fn take_left_out(&mut self) -> Vec<String> {
        std::mem::take(&mut self.left_out)
    }

    /// Returns whether a fault refuses the file.
    pub(super) fn refuses(&self) -> bool {
        !self.faults.is_empty()
    }

    /// Takes over the faults of another report that refuse the file, without its warnings.
    pub(super) fn take_faults(&mut self, other: Self) {
        self.faults.extend(other.faults);
    }

    /// Files a fault by the verdict of its code at `place`.
    pub(super) fn add(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>) {
        match code.verdict_at(place.as_ref()) {
            Verdict::Refuse => self.refuse(code, place, text),
            // Parts that a picture can do without.
            Verdict::Warn if code.row().verdict == Verdict::Refuse => {
                self.warn_with(code, place, text, "it is left out")
            }
            Verdict::Warn => self.warn(code, place, text),
            Verdict::Accept => {}
        }
    }

    /// Refuses the file, even if the table is milder on the code.
    pub(super) fn refuse(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>) {
        if self.leaves_out && codes::can_be_left_out(place.as_ref()) && self.left_out.len() < LEFT_OUT {
            self.left_out.push(place.as_ref().to_owned());
            return self.warn_with(code, place, text, "it is left out");
        }
        self.refuse_with(code, place, text, code.remedy());
    }

    /// Refuses the file, with another remedy than the code's.
    pub(super) fn refuse_with(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>, remedy: &str) {
        let fault = Diagnostic::new(code.name(), &self.file, place.as_ref(), text).remedy(remedy);
        let kind = kind(&fault);
        self.faults.push_kind(fault, kind);
    }

    /// Warns, even if the table is stricter on the code.
    pub(super) fn warn(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>) {
        let why = code.row().why;
        self.warn_with(code, place, text, if code.row().verdict == Verdict::Warn { why } else { "" });
    }

    /// Warns of a fault with another consequence than in the table.
    pub(super) fn warn_with(&mut self, code: Code, place: impl AsRef<str>, text: impl Into<String>, remedy: &str) {
        let warning = Diagnostic::new(code.name(), &self.file, place.as_ref(), text);
        let kind = kind(&warning);
        self.warnings.push_kind(warning.remedy(remedy), kind);
    }

    /// Warns of something for which the validator has no code.
    pub(super) fn note(&mut self, code: &'static str, place: impl AsRef<str>, text: impl Into<String>, remedy: &str) {
        let warning = Diagnostic::new(code, &self.file, place.as_ref(), text);
        let kind = kind(&warning);
        self.warnings.push_kind(warning.remedy(remedy), kind);
    }

    /// Adds a fault that refuses the file.
    pub(super) fn fault(&mut self, fault: Diagnostic) {
        self.faults.push(fault);
    }

    /// Takes over faults and warnings of another report.
    pub(super) fn merge(&mut self, other: Self) {
        self.faults.extend(other.faults);
        self.warnings.extend(other.warnings);
    }

    /// Fails with all faults so far, if any refuses the file.
    pub(super) fn check(&mut self) -> Result<(), LoadError> {
        if self.faults.is_empty() {
            return Ok(());
        }
        let mut faults = std::mem::take(&mut self.faults).into_vec();
        if faults.iter().any(|fault| fault.code == Code::AccessorTooLong.name()) {
            let why = self.warnings.clone().into_vec().into_iter().filter(says_that_data_is_missing);
            faults.splice(0..0, why.map(|why| why.remedy(CUT_OFF)));
        }
        let rest = faults.split_off(SHOWN.min(faults.len()));
        if !rest.is_empty() {
            let hidden: u64 = rest.iter().map(|fault| u64::from(fault.count)).sum();
            faults.push(Diagnostic::new("gltf-more-faults", &self.file, "", format!("{hidden} more faults")));
        }
        Err(LoadError::Input(faults))
    }
}

/// Returns whether a warning explains missing data.
fn says_that_data_is_missing(warning: &Diagnostic) -> bool {
    let codes = [
        Code::GlbLengthMismatch,
        Code::GlbUnexpectedEndOfChunkData,
        Code::GlbChunkTooBig,
        Code::BufferByteLengthMismatch,
    ];
    codes.iter().any(|code| code.name() == warning.code)
}

/// Text of a message without its numbers: the same fault at another node, with another value, has the same kind.
fn kind(message: &Diagnostic) -> String {
    let mut kind = String::with_capacity(message.place.len() + message.text.len());
    for part in [&message.place, &message.text] {
        let (mut quoted, mut number) = (false, false);
        for c in part.chars() {
            quoted ^= c == '\'';
            let goes_on = number && matches!(c, '.' | 'e' | '-' | '+');
            if quoted || !(c.is_ascii_digit() || goes_on) {
                number = false;
                kind.push(c);
            } else if !number {
                number = true;
                kind.truncate(kind.strip_suffix('-').unwrap_or(&kind).len());
                kind.push('#');
            }
        }
        kind.push(' ');
    }
    kind
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_fault_elsewhere_or_with_other_numbers_is_counted() {
        let mut report = Report::new(Path::new("a.gltf"));
        for i in 0..1000 {
            let text = format!("the rotation has length {:.6}, not 1", 2.0 + f64::from(i));
            report.add(Code::RotationNonUnit, format!("nodes[{i}].rotation"), text);
            let number = ["0.5", "-3", "-1e-9", "7"][i as usize % 4];
            report.add(Code::InvalidIndex, format!("nodes[{i}].mesh"), format!("{number} where an index should be"));
        }
        report.add(Code::InvalidIndex, "nodes[5].mesh", "'5' where an index should be");
        report.add(Code::InvalidIndex, "nodes[5].mesh", "'6' where an index should be");
        let Err(LoadError::Input(faults)) = report.check() else { panic!("no faults") };
        let lines: Vec<String> = report.warnings.into_vec().iter().chain(&faults).map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "a.gltf:nodes[0].rotation: the rotation has length 2.000000, not 1 (×1000); the rotation is made unit",
                "a.gltf:nodes[0].mesh: 0.5 where an index should be (×1000); it is damaged; export it again",
                "a.gltf:nodes[5].mesh: '5' where an index should be; it is damaged; export it again",
                "a.gltf:nodes[5].mesh: '6' where an index should be; it is damaged; export it again",
            ]
        );
    }

    #[test]
    fn faults_of_many_kinds_end_in_one_line_that_counts_the_rest() {
        let mut report = Report::new(Path::new("a.gltf"));
        let codes = [Code::InvalidIndex, Code::TypeMismatch];
        for name in (0..60).map(|i| format!("'{i}'")) {
            codes.into_iter().for_each(|code| report.add(code, "nodes[0]", name.as_str()));
        }
        let Err(LoadError::Input(faults)) = report.check() else { panic!("no faults") };
        assert_eq!((faults.len(), faults[SHOWN].text.as_str()), (SHOWN + 1, "100 more faults"));
    }
}
