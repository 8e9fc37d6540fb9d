//! Text -> words with their lines. NFF is a stream of words: line ends count as blanks.

use crate::load::Diagnostic;
use crate::math::DVec3;
use std::path::Path;

/// The words of the file, one after another.
pub(super) struct Words<'a> {
    file: &'a Path,
    list: Vec<(&'a str, u32)>,
    at: usize,
    /// Line of the last word that was taken, from 1.
    pub(super) line: u32,
}

impl<'a> Words<'a> {
    /// Splits the text; `#` starts a comment.
    pub(super) fn new(file: &'a Path, text: &'a str) -> Self {
        let mut list = Vec::new();
        for (number, line) in (1u32..).zip(text.lines().flat_map(|l| l.split('\r'))) {
            let said = line.split('#').next().unwrap_or_default();
            list.extend(said.split_ascii_whitespace().map(|word| (word, number)));
        }
        Self { file, list, at: 0, line: 1 }
    }

    /// The next word, left where it is.
    pub(super) fn peek(&self) -> Option<&'a str> {
        self.list.get(self.at).map(|(word, _)| *word)
    }

    /// Takes the next word.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        let (word, line) = *self.list.get(self.at)?;
        (self.at, self.line) = (self.at + 1, line);
        Some(word)
    }

    /// A fault at the last word.
    pub(super) fn fault(&self, text: impl Into<String>, remedy: &str) -> Diagnostic {
        Diagnostic::new("nff-syntax", self.file, self.line.to_string(), text).remedy(remedy)
    }

    /// A finite number of statement `of`.
    pub(super) fn number(&mut self, of: &str) -> Result<f64, Diagnostic> {
        let Some(word) = self.next() else {
            return Err(self.fault(format!("the file ends inside `{of}`, where a number should follow"), ""));
        };
        match word.parse::<f64>() {
            Ok(n) if n.is_finite() => Ok(n),
            _ => Err(self.fault(format!("`{word}` is no number, in `{of}`"), "")),
        }
    }

    /// `N` numbers.
    pub(super) fn numbers<const N: usize>(&mut self, of: &str) -> Result<[f64; N], Diagnostic> {
        let mut all = [0.0; N];
        for n in &mut all {
            *n = self.number(of)?;
        }
        Ok(all)
    }

    /// Three numbers.
    pub(super) fn point(&mut self, of: &str) -> Result<DVec3, Diagnostic> {
        self.numbers::<3>(of).map(DVec3::from)
    }

    /// A whole number from `low` to a million.
    pub(super) fn whole(&mut self, of: &str, low: u32) -> Result<u32, Diagnostic> {
        let n = self.number(of)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        if n.fract() == 0.0 && (f64::from(low)..=1e6).contains(&n) {
            return Ok(n as u32);
        }
        Err(self.fault(format!("`{of}` has {n}, which is no whole number from {low} to 1000000"), ""))
    }
}
