//! Finds the invalid corners of a text that cannot be read: a pass of its own, line by line, that only such texts
//! need.

use super::chunk::{ATTRIBUTES, count, whole};
use super::statements::Tally;
use crate::load::Diagnostic;
use crate::load::diagnostic::DAMAGED;
use crate::load::text::encoding::decode_name;
use crate::load::text::lines::{Lines, keyword, words};
use std::path::Path;

/// Finds the first fault, with the number of all of its kind. Where there is none, counts the corners that name texture
/// coordinates or normals of which the file has none at all: such faces can still be drawn.
pub(super) fn find(text: &[u8], file: &Path) -> Result<Tally, Diagnostic> {
    let mut look = FaultSearch { file, line: 0, counts: [0; 3], faults: Vec::new(), forward: Vec::new() };
    let mut lines = Lines::new(text);
    while let Some((line, text)) = lines.next() {
        look.line = line;
        match keyword(text) {
            (b"v", _) => look.counts[0] = look.counts[0].saturating_add(1),
            (b"vt", _) => look.counts[1] = look.counts[1].saturating_add(1),
            (b"vn", _) => look.counts[2] = look.counts[2].saturating_add(1),
            (b"f" | b"fo", rest) => look.face(rest),
            _ => {}
        }
    }
    look.finish()
}

struct FaultSearch<'a> {
    file: &'a Path,
    line: u32,
    /// Numbers of `v`, `vt` and `vn` so far.
    counts: [u32; 3],
    /// First fault of each kind and its line; its count includes the others of its kind.
    faults: Vec<(u32, Diagnostic)>,
    /// Numbers that named data not yet defined: (line, corner, kind, number).
    forward: Vec<(u32, u32, usize, u32)>,
}

impl FaultSearch<'_> {
    fn face(&mut self, rest: &[u8]) {
        for (i, word) in words(rest).enumerate() {
            if let Err(fault) = self.corner(word, count(i) + 1) {
                return self.refuse(self.line, fault);
            }
        }
    }

    /// Checks `v`, `v/vt`, `v//vn` or `v/vt/vn`; numbers count from 1, or back from the last one with −1.
    fn corner(&mut self, word: &[u8], corner: u32) -> Result<(), Diagnostic> {
        for (kind, part) in word.split(|&b| b == b'/').enumerate() {
            if part.is_empty() && kind > 0 {
                continue;
            }
            let Some(number) = whole(part).filter(|_| kind < 3) else { return Err(self.unreadable(word, corner)) };
            // None; the reader has counted it.
            if number == 0 && kind > 0 {
                continue;
            }
            let known = i64::from(self.counts[kind]);
            let absolute = if number < 0 { known + 1 + number } else { number };
            let absolute = u32::try_from(absolute).ok().filter(|&a| a > 0);
            let absolute = absolute.ok_or_else(|| self.out_of_range(self.line, corner, kind, number))?;
            if i64::from(absolute) > known {
                self.forward.push((self.line, corner, kind, absolute));
            }
        }
        Ok(())
    }

    fn unreadable(&self, word: &[u8], corner: u32) -> Diagnostic {
        let word = crate::load::paths::shorten(&decode_name(word));
        let text =
            format!("corner {corner} of the face is '{word}', which is not of the form v, v/vt, v//vn or v/vt/vn");
        Diagnostic::new("obj-bad-face", self.file, self.line.to_string(), text)
    }

    fn out_of_range(&self, line: u32, corner: u32, kind: usize, number: i64) -> Diagnostic {
        let what = ATTRIBUTES[kind];
        let there = self.counts[kind];
        let (code, text) = match number {
            0 => ("obj-index-zero", format!("corner {corner} of the face names {what} 0, but numbers start at 1")),
            1.. => {
                ("obj-index-range", format!("corner {corner} of the face names {what} {number}, but there are {there}"))
            }
            _ => (
                "obj-index-range",
                format!("corner {corner} of the face names {what} {number}, but {there} stand before it"),
            ),
        };
        Diagnostic::new(code, self.file, line.to_string(), text).remedy(DAMAGED)
    }

    fn refuse(&mut self, line: u32, fault: Diagnostic) {
        let Some((first, known)) = self.faults.iter_mut().find(|(_, known)| known.code == fault.code) else {
            return self.faults.push((line, fault));
        };
        let count = known.count.saturating_add(1);
        if line < *first {
            (*first, *known) = (line, fault);
        }
        known.count = count;
    }

    fn finish(mut self) -> Result<Tally, Diagnostic> {
        let mut absent = Tally::default();
        for (line, corner, kind, number) in std::mem::take(&mut self.forward) {
            if kind > 0 && self.counts[kind] == 0 {
                absent.note(line, ["", "texture coordinates", "normals"][kind].as_bytes());
            } else if number > self.counts[kind] {
                let fault = self.out_of_range(line, corner, kind, i64::from(number));
                self.refuse(line, fault);
            }
        }
        let first = self.faults.into_iter().min_by_key(|(line, _)| *line);
        first.map_or(Ok(absent), |(_, fault)| Err(fault))
    }
}
