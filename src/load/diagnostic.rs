//! What loading has to tell: one fault or warning is a value with a place, the numbers and a remedy. Only `cli` prints.

use super::limits::OverBudget;
use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// The code of everything that takes more memory than is left.
pub(crate) const OVER_MEMORY: &str = "over-memory";

/// What helps against that.
pub(crate) const RAISE_MEMORY: &str = "raise --max-memory";

/// What helps against a file that ends too early.
pub(super) const CUT_OFF: &str = "it was cut off; get it again";

/// What helps against a file that says what cannot be.
pub(super) const DAMAGED: &str = "it is damaged; export it again";

/// One thing worth telling the user.
///
/// Displayed as `file:place: text (×count); remedy`, one line, lower case after the place, no final period.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable kebab-case name of this kind of message, such as `gltf-index-out-of-range`.
    pub code: &'static str,
    /// The file it is about.
    pub file: PathBuf,
    /// Line (`118`) or JSON path (`meshes[2].primitives[0].indices`); empty: the file as a whole.
    pub place: String,
    /// What is wrong, with the numbers.
    pub text: String,
    /// What the user can do, or what is drawn all the same; may be empty.
    pub remedy: String,
    /// How often it was met; the place is the first.
    pub count: u32,
}

impl Diagnostic {
    /// A message met once.
    pub fn new(
        code: &'static str,
        file: impl Into<PathBuf>,
        place: impl Into<String>,
        text: impl Into<String>,
    ) -> Self {
        Self { code, file: file.into(), place: place.into(), text: text.into(), remedy: String::new(), count: 1 }
    }

    /// Something takes more memory than is left.
    pub(super) fn over_memory(file: impl Into<PathBuf>, place: impl Into<String>, text: impl Into<String>) -> Self {
        Self::new(OVER_MEMORY, file, place, text).remedy(RAISE_MEMORY)
    }

    /// A file holds more than memory is left for.
    pub(super) fn over_budget(file: &Path, over: OverBudget) -> Self {
        Self::over_memory(file, "", over.to_string())
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = remedy.into();
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A file name may hold anything; a message must stay one line and leave the terminal alone.
        let clean = |s: &str| s.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect::<String>();
        if !self.file.as_os_str().is_empty() {
            write!(f, "{}:", clean(&self.file.to_string_lossy()))?;
            if !self.place.is_empty() {
                write!(f, "{}:", clean(&self.place))?;
            }
            f.write_str(" ")?;
        }
        // Texts of libraries may end in an empty line.
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

/// Why nothing could be loaded; what a retry can do decides the kind.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read: a retry may help (exit code 1).
    #[error("{what}: {source}")]
    Read {
        /// What was being read.
        what: Box<Diagnostic>,
        /// What the system said.
        source: std::io::Error,
    },
    /// The input is broken, unsupported, empty or too large: a retry is useless (exit code 3), but for one that needs more
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

/// Gathers warnings; those of one kind are counted, not repeated.
///
/// Of one code, only so many kinds are kept; the others become one last warning of that code, which counts them. So
/// neither memory nor the list grows with the number of warnings.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    list: Vec<(Kind, Diagnostic)>,
    /// Where each kind is in the list.
    known: HashMap<Kind, usize>,
    /// How many kinds of each code are kept.
    kinds: HashMap<&'static str, usize>,
}

/// What is told once: a code, a file, and what tells kinds of one code apart.
type Kind = (&'static str, PathBuf, String);

impl Warnings {
    /// Kinds of one code that are kept.
    const KEPT: usize = 20;

    /// Adds one, or counts it when one with the same code, file and text is there.
    pub fn push(&mut self, warning: Diagnostic) {
        let kind = warning.text.clone();
        self.push_kind(warning, kind);
    }

    /// Adds one, or counts it when one with the same code, file and `kind` is there, whatever their texts say.
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
        // The name of no kind: texts have no control characters that matter.
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

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All of them, in the order first met.
    pub fn into_vec(self) -> Vec<Diagnostic> {
        self.list.into_iter().map(|(_, warning)| warning).collect()
    }

    /// Adds those of another.
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
