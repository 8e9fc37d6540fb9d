//! Text -> words separated by white space, on any lines, and their numbers.

use crate::load::number::{self, Respelled};

/// Cursor over the words of a text.
pub(in crate::load) struct Words<'a> {
    pub bytes: &'a [u8],
    /// Offset of the next byte.
    pub at: usize,
    /// Line of the word read last, from 1.
    pub line: u32,
    /// Decimal places of the finest number.
    pub places: i32,
    pub respelled: Respelled,
}

impl<'a> Words<'a> {
    /// Cursor at byte `at`, which lies on this line.
    pub(in crate::load) fn new(bytes: &'a [u8], at: usize, line: u32) -> Self {
        Self { bytes, at, line, places: 0, respelled: Respelled::default() }
    }

    /// Unread bytes.
    #[inline]
    pub(in crate::load) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Advances to the next word; returns whether there is one.
    #[inline]
    pub(in crate::load) fn find(&mut self) -> bool {
        while let Some(&b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            // CR LF is one line end, counted at the LF.
            let ends = b == b'\n' || (b == b'\r' && self.bytes.get(self.at + 1) != Some(&b'\n'));
            self.line = self.line.saturating_add(u32::from(ends));
            self.at += 1;
        }
        self.at < self.bytes.len()
    }

    /// Reads the next word.
    pub(in crate::load) fn next(&mut self) -> Option<&'a [u8]> {
        self.find().then(|| self.take())
    }

    /// Reads the next word on this line.
    pub(in crate::load) fn next_in_line(&mut self) -> Option<&'a [u8]> {
        let is_blank = |b: &&u8| b.is_ascii_whitespace() && !ends_line(b);
        self.at += self.rest().iter().take_while(is_blank).count();
        Some(self.take()).filter(|word| !word.is_empty())
    }

    /// Reads the next word, which must be a number.
    ///
    /// # Errors
    /// The word that is not a number; empty at the end of the text.
    #[inline]
    pub(in crate::load) fn number(&mut self) -> Result<f64, &'a [u8]> {
        self.find();
        if let Some(plain) = number::plain(self.rest()) {
            self.at += plain.length;
            self.places = self.places.max(plain.places);
            return Ok(plain.value);
        }
        let word = self.take();
        self.respelled.value(self.line, word).ok_or(word)
    }

    /// Reads the rest of the line.
    pub(in crate::load) fn rest_of_line(&mut self) -> &'a [u8] {
        self.take_until(ends_line)
    }

    fn take(&mut self) -> &'a [u8] {
        self.take_until(u8::is_ascii_whitespace)
    }

    fn take_until(&mut self, ends: impl Fn(&u8) -> bool) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(ends).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }
}

fn ends_line(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_numbers_come_with_their_lines_whatever_ends_these() {
        let mut words = Words::new(b"x\r\n a\r\r1.50\n\n2e1 1,5 no\r\n", 1, 1);
        assert_eq!((words.next(), words.line), (Some(&b"a"[..]), 2));
        assert_eq!((words.number(), words.line, words.places), (Ok(1.5), 4, 2));
        assert_eq!((words.number(), words.number(), words.line), (Ok(20.0), Ok(1.5), 6));
        assert_eq!((words.number(), words.line), (Err(&b"no"[..]), 6));
        assert_eq!((words.number(), words.next(), words.rest_of_line()), (Err(&[][..]), None, &[][..]));
        assert_eq!(words.line, 7);
    }

    #[test]
    fn the_rest_of_a_line_is_taken_as_it_is() {
        let mut words = Words::new(b"solid  a b \r\nfacet", 5, 1);
        assert_eq!((words.rest_of_line(), words.next(), words.line), (&b"  a b "[..], Some(&b"facet"[..]), 2));
        words.at = 5;
        let in_line: [_; 3] = std::array::from_fn(|_| words.next_in_line());
        assert_eq!((in_line, words.at), ([Some(&b"a"[..]), Some(b"b"), None], 11));
    }
}
