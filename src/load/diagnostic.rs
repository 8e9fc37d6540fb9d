//! What loading has to tell: one fault or warning is a value with a place, the numbers and a remedy. Only `cli` prints.

use std::fmt;
use std::path::PathBuf;

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
    /// What the user can do; may be empty.
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
        f.write_str(&clean(&self.text))?;
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
    /// The input is broken, unsupported, empty or too large: a retry is useless (exit code 3).
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

/// Gathers warnings; equal (code, file, text) are counted, not repeated.
#[derive(Clone, Debug, Default)]
pub struct Warnings {
    list: Vec<Diagnostic>,
}

impl Warnings {
    /// Adds one, or counts it when an equal one is there.
    pub fn push(&mut self, warning: Diagnostic) {
        let same = |w: &&mut Diagnostic| w.code == warning.code && w.text == warning.text && w.file == warning.file;
        match self.list.iter_mut().find(same) {
            Some(known) => known.count += warning.count,
            None => self.list.push(warning),
        }
    }

    /// All of them, in the order first met.
    pub fn into_vec(self) -> Vec<Diagnostic> {
        self.list
    }

    /// Adds those of another.
    pub fn extend(&mut self, other: Self) {
        other.list.into_iter().for_each(|w| self.push(w));
    }
}
