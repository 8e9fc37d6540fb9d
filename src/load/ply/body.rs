//! The values of a PLY file, one after another, as text or as bytes.

use super::header::{Element, Encoding, Header, Kind};
use super::packed::Packed;
use crate::load::diagnostic::{CUT_OFF, DAMAGED};
use crate::load::paths::shorten;
use crate::load::text::words::Words;
use crate::load::{Diagnostic, Source};
use std::path::Path;

/// Where the reading is. Whole numbers of every kind are exact in `f64`.
pub(super) struct Body<'a> {
    file: &'a Path,
    /// Of a text; elsewhere only where the reading is.
    pub words: Words<'a>,
    encoding: Encoding,
}

/// Why there is no value.
pub(super) enum Missing {
    /// The file ends.
    End,
    /// This word is no number.
    Word(String),
}

impl<'a> Body<'a> {
    /// The values behind the header.
    pub(super) fn new(header: &Header, source: &'a Source) -> Self {
        let words = Words::new(&source.bytes, header.length, header.lines.saturating_add(1));
        Self { file: &source.path, words, encoding: header.encoding }
    }

    /// A fault of the value read last, or of the one that is missing.
    pub(super) fn fault(&self, text: impl Into<String>, remedy: &str) -> Diagnostic {
        let place = match self.encoding {
            Encoding::Text => self.words.line.to_string(),
            _ => format!("byte {}", self.words.at),
        };
        Diagnostic::new("ply-body", self.file, place, text).remedy(remedy)
    }

    /// The fault of a missing value: `what` it is.
    pub(super) fn missing(&self, missing: &Missing, what: &str) -> Diagnostic {
        match missing {
            Missing::End => self.fault(format!("the file ends before {what}"), CUT_OFF),
            Missing::Word(word) => self.fault(format!("`{}` is no number, in {what}", shorten(word)), DAMAGED),
        }
    }

    /// Bytes that a value takes at least.
    pub(super) fn least(&self, kind: Kind) -> u64 {
        if self.encoding == Encoding::Text { 1 } else { kind.size() as u64 }
    }

    /// Bytes that have not been read.
    pub(super) fn left(&self) -> u64 {
        self.words.rest().len() as u64
    }

    /// A warning when something follows what the header counts. Blanks do not count, nor does what the last line of a text
    /// ends with.
    pub(super) fn behind(&self) -> Option<Diagnostic> {
        let rest = self.words.rest();
        let rest = if self.encoding == Encoding::Text { rest.trim_ascii() } else { rest };
        (!rest.is_empty()).then(|| {
            let text = format!("{} bytes follow what the header counts", rest.len());
            Diagnostic { code: "ply-bytes-behind", ..self.fault(text, "they are not read") }
        })
    }

    /// Refuses an element that claims more than there are bytes for.
    pub(super) fn check_count(&self, element: &Element) -> Result<(), Diagnostic> {
        let (count, least, left) = (element.count, element.least(self.encoding), self.left());
        if count.checked_mul(least).is_some_and(|bytes| bytes <= left) {
            return Ok(());
        }
        let name = shorten(&element.name);
        let text = format!("the header claims {count} × `{name}` of at least {least} bytes, but {left} bytes are left");
        Err(self.fault(text, CUT_OFF))
    }

    /// The next value.
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

    /// The line of the next word of a text, and that of the last one; `None` for other files, and behind the last word.
    pub(super) fn lines(&mut self) -> Option<[u32; 2]> {
        if self.encoding != Encoding::Text {
            return None;
        }
        let last = self.words.line;
        self.words.find().then_some([self.words.line, last])
    }

    /// The next word of a text, which must be a number.
    #[inline]
    fn number(&mut self) -> Result<f64, Missing> {
        self.words.number().map_err(|word| match word {
            [] => Missing::End,
            word => Missing::Word(String::from_utf8_lossy(word).into_owned()),
        })
    }

    /// The rows of an element that begins here, where they all take the same bytes ([`Packed::of`]).
    pub(super) fn packed(&self, element: &Element, in_lists: Option<usize>) -> Option<Packed<'a>> {
        Packed::of(element, self.encoding, self.words.rest(), in_lists)
    }

    /// Goes on behind these rows.
    pub(super) fn pass_packed(&mut self, rows: &Packed) {
        self.words.at += rows.length();
    }

    /// Passes over `count` values of a binary file, of `size` bytes each; whether there are so many.
    fn skip(&mut self, count: u64, size: usize) -> bool {
        let bytes = count.checked_mul(size as u64).filter(|&bytes| bytes <= self.left());
        // As many bytes as there are in memory.
        self.words.at += bytes.map_or(0, |bytes| bytes as usize);
        bytes.is_some()
    }

    /// Passes over values that nobody asks for.
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
