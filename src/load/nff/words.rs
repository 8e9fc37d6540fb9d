//! Text -> words with their lines. NFF is a stream of words: line ends count as white space.

use crate::load::Diagnostic;
use crate::load::diagnostic::CUT_OFF;
use crate::math::DVec3;
use std::path::Path;

/// Cursor over the words of the file.
pub(super) struct Words<'a> {
    file: &'a Path,
    /// Text behind [`Self::next`].
    rest: &'a str,
    /// Line that `rest` starts in, from 1.
    rest_line: u32,
    /// The next word, and its line.
    next: Option<(&'a str, u32)>,
    /// Line of the last word consumed, from 1.
    pub(super) line: u32,
}

impl<'a> Words<'a> {
    /// Cursor at the start of a text; `#` starts a comment.
    pub(super) fn new(file: &'a Path, text: &'a str) -> Self {
        let mut words = Self { file, rest: text, rest_line: 1, next: None, line: 1 };
        words.next = words.find();
        words
    }

    /// Skips white space and comments, and reads the word behind them.
    fn find(&mut self) -> Option<(&'a str, u32)> {
        let bytes = self.rest.as_bytes();
        let (mut at, mut in_comment) = (0, false);
        while let Some(&byte) = bytes.get(at).filter(|b| in_comment || **b == b'#' || b.is_ascii_whitespace()) {
            // CR LF is one line end, counted at the LF.
            let ends = byte == b'\n' || (byte == b'\r' && bytes.get(at + 1) != Some(&b'\n'));
            self.rest_line = self.rest_line.saturating_add(u32::from(ends));
            in_comment = (in_comment || byte == b'#') && !matches!(byte, b'\n' | b'\r');
            at += 1;
        }
        let ends = |b: &u8| *b == b'#' || b.is_ascii_whitespace();
        let end = bytes[at..].iter().position(ends).map_or(bytes.len(), |length| at + length);
        let word = self.rest.get(at..end).filter(|word| !word.is_empty())?;
        self.rest = self.rest.get(end..).unwrap_or_default();
        Some((word, self.rest_line))
    }

    /// Returns the next word without consuming it.
    pub(super) fn peek(&self) -> Option<&'a str> {
        self.next.map(|(word, _)| word)
    }

    /// Consumes the next word.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        let (word, line) = self.next?;
        self.line = line;
        self.next = self.find();
        Some(word)
    }

    /// Fault at the last word.
    pub(super) fn fault(&self, text: impl Into<String>, remedy: &str) -> Diagnostic {
        self.fault_at(self.line, text, remedy)
    }

    /// Fault on an earlier line.
    pub(super) fn fault_at(&self, line: u32, text: impl Into<String>, remedy: &str) -> Diagnostic {
        Diagnostic::new("nff-syntax", self.file, line.to_string(), text).remedy(remedy)
    }

    /// Reads a finite number of statement `of`.
    pub(super) fn number(&mut self, of: &str) -> Result<f64, Diagnostic> {
        let Some(word) = self.next() else {
            return Err(self.fault(format!("the file ends inside `{of}`, where a number should follow"), CUT_OFF));
        };
        match word.parse::<f64>() {
            Ok(n) if n.is_finite() => Ok(n),
            _ => Err(self.fault(format!("`{word}` is no number, in `{of}`"), "write one")),
        }
    }

    /// Reads `N` numbers.
    pub(super) fn numbers<const N: usize>(&mut self, of: &str) -> Result<[f64; N], Diagnostic> {
        let mut all = [0.0; N];
        for n in &mut all {
            *n = self.number(of)?;
        }
        Ok(all)
    }

    /// Reads three numbers.
    pub(super) fn point(&mut self, of: &str) -> Result<DVec3, Diagnostic> {
        self.numbers::<3>(of).map(DVec3::from)
    }

    /// Reads a whole number from `low` to a million.
    pub(super) fn whole(&mut self, of: &str, low: u32) -> Result<u32, Diagnostic> {
        let n = self.number(of)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        if n.fract() == 0.0 && (f64::from(low)..=1e6).contains(&n) {
            return Ok(n as u32);
        }
        Err(self.fault(format!("`{of}` has {n}, which is no whole number from {low} to 1000000"), "write one"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_with_their_lines_whatever_ends_these_and_without_comments() {
        let text = "# v\n a  b#c\r\n\r\n#x # y\rd\r\r\te\n#\nf # last";
        let mut words = Words::new(Path::new("a.nff"), text);
        let mut all = Vec::new();
        while let Some(word) = words.next() {
            all.push((word, words.line));
        }
        assert_eq!(all, [("a", 2), ("b", 2), ("d", 5), ("e", 7), ("f", 9)]);
        assert_eq!((words.peek(), words.next()), (None, None));
    }
}
