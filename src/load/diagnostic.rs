//! Messages of loading: a fault or warning is a value with a place, the numbers and a remedy. Only `cli` prints.

use super::limits::OverBudget;
use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// Code of every fault for lack of memory.
pub(crate) const OVER_MEMORY: &str = "over-memory";

/// Remedy for a lack of memory.
pub(crate) const RAISE_MEMORY: &str = "raise --max-memory";

/// Remedy for a truncated file.
pub(super) const CUT_OFF: &str = "it was cut off; get it again";

/// Remedy for a file whose contents contradict themselves.
pub(super) const DAMAGED: &str = "it is damaged; export it again";

/// A fault or warning for the user.
///
/// Displayed as `file:place: text (×count); remedy`, one line, lower case after the place, no final period.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable kebab-case name of this kind of message, such as `gltf-index-out-of-range`.
    pub code: &'static str,
    /// File that the message is about.
    pub file: PathBuf,
    /// Line (`118`) or JSON path (`meshes[2].primitives[0].indices`); empty: the file as a whole.
    pub place: String,
    /// What is wrong, with the numbers.
    pub text: String,
    /// What the user can do, or what is drawn instead; may be empty.
    pub remedy: String,
    /// Number of occurrences; the place is that of the first.
    pub count: u32,
}

impl Diagnostic {
    /// Message with a count of 1.
    pub fn new(
        code: &'static str,
        file: impl Into<PathBuf>,
        place: impl Into<String>,
        text: impl Into<String>,
    ) -> Self {
        Self { code, file: file.into(), place: place.into(), text: text.into(), remedy: String::new(), count: 1 }
    }

    /// Fault: something takes more memory than is left.
    pub(super) fn over_memory(file: impl Into<PathBuf>, place: impl Into<String>, text: impl Into<String>) -> Self {
        Self::new(OVER_MEMORY, file, place, text).remedy(RAISE_MEMORY)
    }

    /// Fault: a file needs more memory than is left.
    pub(super) fn over_budget(file: &Path, over: OverBudget) -> Self {
        Self::over_memory(file, "", over.to_string())
    }

    /// Sets the remedy.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = remedy.into();
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A file name may hold anything; a message must stay one line and keep control characters from the terminal.
        let clean = |s: &str| s.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect::<String>();
        if !self.file.as_os_str().is_empty() {
            write!(f, "{}:", clean(&self.file.to_string_lossy()))?;
            if !self.place.is_empty() {
                write!(f, "{}:", clean(&self.place))?;
            }
            f.write_str(" ")?;
        }
        // Messages of libraries may end in an empty line.
        f.write_str(&clean(self.text.trim_end()))?;
        if self.count > 1 {
            write!(f, " (×{})", self.count)?;
        }
        if !self.remedy.is_empty() {
            write!(f, "; {}", clean(&self.remedy))?;
        }
        Ok(())
    }
}

/// Why nothing could be loaded; the variant tells whether a retry can help.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read: a retry may help (exit code 1).
    #[error("{what}: {source}")]
    Read {
        /// What was being read.
        what: Box<Diagnostic>,
        /// The I/O error.
        source: std::io::Error,
    },
    /// The input is broken, unsupported, empty or too large: a retry is useless (exit code 3), except where it needs more
    /// memory than it may take (exit code 1).
    #[error("{}", join(.0))]
    Input(
        /// Every fault found, at least one.
        Vec<Diagnostic>,
    ),
}

fn join(faults: &[Diagnostic]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

impl From<Diagnostic> for LoadError {
    fn from(fault: Diagnostic) -> Self {
        Self::Input(vec![fault])
    }
}

/// Collects warnings; repeated ones of a kind are counted.
///
/// Only 20 kinds of one code are kept; the others become one last warning of that code, which counts them. So
/// neither memory nor the list grows with the number of warnings.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    list: Vec<(Kind, Diagnostic)>,
    /// Index in the list, by kind.
    known: HashMap<Kind, usize>,
    /// Number of kinds met, by code.
    kinds: HashMap<&'static str, usize>,
}

/// Key of a warning: a code, a file, and a text that tells kinds of one code apart.
type Kind = (&'static str, PathBuf, String);

impl Warnings {
    /// Largest number of kinds of one code that are kept.
    const KEPT: usize = 20;

    /// Adds a warning, or counts it when one with the same code, file and text exists.
    pub fn push(&mut self, warning: Diagnostic) {
        let kind = warning.text.clone();
        self.push_kind(warning, kind);
    }

    /// Adds a warning, or counts it when one with the same code, file and `kind` exists, whatever their texts.
    pub fn push_kind(&mut self, warning: Diagnostic, kind: String) {
        let kind = (warning.code, warning.file.clone(), kind);
        if let Some(&at) = self.known.get(&kind) {
            return self.count(at, warning.count);
        }
        let kept = self.kinds.entry(warning.code).or_default();
        *kept += 1;
        if *kept <= Self::KEPT {
            return self.keep(kind, warning);
        }
        // Key that no kind has: no text is a lone zero byte.
        let rest = (warning.code, PathBuf::new(), "\0".to_owned());
        match self.known.get(&rest) {
            Some(&at) => {
                let listed = &mut self.list[at].1;
                if listed.file != warning.file {
                    listed.file = PathBuf::new();
                }
                self.count(at, warning.count);
            }
            None => {
                let text = "more of this kind are not listed";
                self.keep(
                    rest,
                    Diagnostic { text: text.into(), remedy: String::new(), place: String::new(), ..warning },
                );
            }
        }
    }

    fn keep(&mut self, kind: Kind, warning: Diagnostic) {
        self.known.insert(kind.clone(), self.list.len());
        self.list.push((kind, warning));
    }

    fn count(&mut self, at: usize, more: u32) {
        let known = &mut self.list[at].1;
        known.count = known.count.saturating_add(more);
    }

    /// Whether there are no warnings.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All warnings, in the order first met.
    pub fn into_vec(self) -> Vec<Diagnostic> {
        self.list.into_iter().map(|(_, warning)| warning).collect()
    }

    /// Adds the warnings of another collection.
    pub fn extend(&mut self, other: Self) {
        other.list.into_iter().for_each(|((_, _, kind), warning)| self.push_kind(warning, kind));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warning(code: &'static str, text: String) -> Diagnostic {
        Diagnostic::new(code, "a.obj", "1", text)
    }

    #[test]
    fn equal_warnings_are_counted_and_the_first_place_is_kept() {
        let mut warnings = Warnings::default();
        warnings.push(warning("a", "x".into()));
        warnings.push(Diagnostic { place: "2".into(), count: u32::MAX, ..warning("a", "x".into()) });
        warnings.push(warning("b", "x".into()));
        warnings.push_kind(warning("b", "y".into()), "x".into());
        let list = warnings.into_vec();
        assert_eq!(list.iter().map(|w| (w.code, w.count)).collect::<Vec<_>>(), [("a", u32::MAX), ("b", 2)]);
        assert_eq!(list[0].place, "1");
    }

    #[test]
    fn of_one_code_so_many_kinds_are_listed_and_the_others_counted() {
        let mut warnings = Warnings::default();
        for i in 0..100_000 {
            let mut one = Warnings::default();
            one.push(warning("a", format!("text {i}")));
            warnings.extend(one);
        }
        let mut twice = warnings.clone();
        twice.extend(warnings.clone());
        assert!(warnings.known.len() <= Warnings::KEPT + 1, "memory does not grow");
        let list = warnings.into_vec();
        assert_eq!(list.len(), Warnings::KEPT + 1);
        let last = list.last().unwrap().to_string();
        assert_eq!(last, "a.obj: more of this kind are not listed (×99980)");
        let total: u32 = twice.into_vec().iter().map(|w| w.count).sum();
        assert_eq!(total, 200_000);
    }

    #[test]
    fn what_is_only_counted_names_a_file_if_all_are_of_that() {
        let mut warnings = Warnings::default();
        for i in 0..Warnings::KEPT + 5 {
            let file = if i < Warnings::KEPT + 2 { "a.obj" } else { "b.obj" };
            warnings.push(Diagnostic { file: file.into(), ..warning("a", format!("text {i}")) });
        }
        assert_eq!(warnings.into_vec().last().unwrap().to_string(), "more of this kind are not listed (×5)");
    }
}
