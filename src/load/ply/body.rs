//! Reads the values of a PLY file in sequence, as text or binary.

use super::header::{Element, Encoding, Header, Kind};
use super::packed::Packed;
use crate::load::diagnostic::{CUT_OFF, DAMAGED};
use crate::load::paths::shorten;
use crate::load::text::words::Words;
use crate::load::{Diagnostic, Source};
use std::path::Path;

/// Cursor over the values. Integers of every kind are exact in `f64`.
pub(super) struct Body<'a> {
    file: &'a Path,
    /// Words of a text file; for binary files only the position.
    pub words: Words<'a>,
    encoding: Encoding,
}

/// Why a value could not be read.
pub(super) enum Missing {
    /// End of the file.
    End,
    /// A word that is not a number.
    Word(String),
}

impl<'a> Body<'a> {
    /// Cursor at the first value, behind the header.
    pub(super) fn new(header: &Header, source: &'a Source) -> Self {
        let words = Words::new(&source.bytes, header.length, header.lines.saturating_add(1));
        Self { file: &source.path, words, encoding: header.encoding }
    }

    /// Fault at the value read last, or at the missing one.
    pub(super) fn fault(&self, text: impl Into<String>, remedy: &str) -> Diagnostic {
        let place = match self.encoding {
            Encoding::Text => self.words.line.to_string(),
            _ => format!("byte {}", self.words.at),
        };
        Diagnostic::new("ply-body", self.file, place, text).remedy(remedy)
    }

    /// Fault for a missing value, which `what` describes.
    pub(super) fn missing(&self, missing: &Missing, what: &str) -> Diagnostic {
        match missing {
            Missing::End => self.fault(format!("the file ends before {what}"), CUT_OFF),
            Missing::Word(word) => self.fault(format!("`{}` is no number, in {what}", shorten(word)), DAMAGED),
        }
    }

    /// Smallest number of bytes of a value.
    pub(super) fn least(&self, kind: Kind) -> u64 {
        if self.encoding == Encoding::Text { 1 } else { kind.size() as u64 }
    }

    /// Number of unread bytes.
    pub(super) fn left(&self) -> u64 {
        self.words.rest().len() as u64
    }

    /// Warning when bytes follow what the header counts; white space alone does not count.
    pub(super) fn behind(&self) -> Option<Diagnostic> {
        let rest = self.words.rest();
        let is_blank = rest.iter().all(u8::is_ascii_whitespace);
        let rest = if self.encoding == Encoding::Text || is_blank { rest.trim_ascii() } else { rest };
        (!rest.is_empty()).then(|| {
            let text = format!("{} bytes follow what the header counts", rest.len());
            Diagnostic { code: "ply-bytes-behind", ..self.fault(text, "they are not read") }
        })
    }

    /// Refuses an element that claims more than the remaining bytes can hold.
    pub(super) fn check_count(&self, element: &Element) -> Result<(), Diagnostic> {
        let (count, least, left) = (element.count, element.least(self.encoding), self.left());
        if count.checked_mul(least).is_some_and(|bytes| bytes <= left) {
            return Ok(());
        }
        let name = shorten(&element.name);
        let text = format!("the header claims {count} × `{name}` of at least {least} bytes, but {left} bytes are left");
        Err(self.fault(text, CUT_OFF))
    }

    /// Reads the next value.
    #[inline]
    pub(super) fn value(&mut self, kind: Kind) -> Result<f64, Missing> {
        match self.encoding {
            Encoding::Text => self.number(),
            Encoding::LittleEndian => self.binary(kind, false),
            Encoding::BigEndian => self.binary(kind, true),
        }
    }

    #[inline]
    fn binary(&mut self, kind: Kind, big: bool) -> Result<f64, Missing> {
        let value = kind.value(self.words.rest(), big).ok_or(Missing::End)?;
        self.words.at += kind.size();
        Ok(value)
    }

    /// Lines of the next and of the last word of a text; `None` for binary files, and behind the last word.
    pub(super) fn lines(&mut self) -> Option<[u32; 2]> {
        if self.encoding != Encoding::Text {
            return None;
        }
        let last = self.words.line;
        self.words.find().then_some([self.words.line, last])
    }

    /// Reads the next word of a text, which must be a number.
    #[inline]
    fn number(&mut self) -> Result<f64, Missing> {
        self.words.number().map_err(|word| match word {
            [] => Missing::End,
            word => Missing::Word(String::from_utf8_lossy(word).into_owned()),
        })
    }

    /// Rows of the element that begins here, if all have the same size ([`Packed::of`]).
    pub(super) fn packed(&self, element: &Element, in_lists: Option<usize>) -> Option<Packed<'a>> {
        Packed::of(element, self.encoding, self.words.rest(), in_lists)
    }

    /// Advances behind these rows.
    pub(super) fn pass_packed(&mut self, rows: &Packed) {
        self.words.at += rows.length();
    }

    /// Skips `count` values of `size` bytes each in a binary file; returns whether there are that many.
    fn skip(&mut self, count: u64, size: usize) -> bool {
        let bytes = count.checked_mul(size as u64).filter(|&bytes| bytes <= self.left());
        // No more than the bytes in memory, so it fits `usize`.
        self.words.at += bytes.map_or(0, |bytes| bytes as usize);
        bytes.is_some()
    }

    /// Skips values that are not needed.
    pub(super) fn pass(&mut self, count: u64, kind: Kind) -> Result<(), Missing> {
        if self.encoding != Encoding::Text {
            return if self.skip(count, kind.size()) { Ok(()) } else { Err(Missing::End) };
        }
        for _ in 0..count {
            self.number()?;
        }
        Ok(())
    }
}
