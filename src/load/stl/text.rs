//! STL as text: `solid`, then for each triangle `facet normal x y z`, `outer loop`, three times `vertex x y z`, `endloop`,
//! `endfacet`; at the end `endsolid`. There may be several solids.
//!
//! Words may stand on any lines and in any case, as programs write them. Some split `endloop` and the like in two, omit
//! `endfacet`, or write colours, in formats of their own that are not read.

use super::Making;
use crate::load::diagnostic::{CUT_OFF, DAMAGED};
use crate::load::geometry::plain_mesh::PlainMesh;
use crate::load::paths::shorten;
use crate::load::text::{without_mark, words};
use crate::load::{Diagnostic, Source};
use crate::math::DVec3;
use std::path::Path;

/// Bytes of the positions of a facet, in a list that grows by being copied to twice its capacity.
const FACET: u64 = 3 * 3 * size_of::<DVec3>() as u64;

/// Reads every triangle.
///
/// # Errors
/// At the first word that is out of place, with its line; colours never are. A solid without its end may be complete
/// nevertheless, and costs a warning.
pub(super) fn read(source: &Source, mut making: Making) -> Result<PlainMesh, Diagnostic> {
    // Files copied in blocks are padded with zeros.
    let length = source.bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    let bytes = without_mark(&source.bytes[..length]);
    let mut words = Words { file: &source.path, words: words::Words::new(bytes, 0, 1) };
    let (mut facets, mut names, mut open) = (Vec::new(), Vec::new(), false);
    while let Some(word) = words.next() {
        if is(word, "solid") {
            open = true;
            let name = words.name();
            if names.is_empty() && !name.is_empty() {
                names.push(name);
            }
        } else if is(word, "facet") {
            making.take(1)?;
            making.hold(1, FACET)?;
            facets.push(facet(&mut words)?);
        } else if ends_solid(word) || (is(word, "end") && words.expect("solid").is_ok()) {
            open = false;
            words.pass_name();
        } else if word.starts_with(b"#") {
            words.words.rest_of_line();
        } else if is_color(word) {
            words.pass_numbers();
        } else {
            return Err(words.fault(word, "`solid`, `facet` or `endsolid`"));
        }
    }
    let corners: &[DVec3] = facets.as_flattened();
    let bits = |place: DVec3| place.to_array().map(f64::to_bits);
    let mut bare = making.triangles(corners.len(), |corner| corners[corner], bits, Vec::new())?;
    let words = words.words;
    bare.places = Some(words.places);
    bare.comments = names;
    bare.told.extend(words.respelled.told("stl-number", &source.path));
    if open {
        let place = words.line.to_string();
        let warning = Diagnostic::new("stl-no-end", &source.path, place, "the file ends without `endsolid`");
        bare.told.push(warning.remedy("it may have been cut off"));
    }
    Ok(bare)
}

/// Reads the three positions of a facet; its normal may be anything.
fn facet(words: &mut Words) -> Result<[DVec3; 3], Diagnostic> {
    words.expect("normal")?;
    for _ in 0..3 {
        words.next();
    }
    words.expect("outer")?;
    words.expect("loop")?;
    let mut corners = [DVec3::ZERO; 3];
    for corner in &mut corners {
        words.expect("vertex")?;
        *corner = DVec3::new(words.number()?, words.number()?, words.number()?);
    }
    words.end("endloop")?;
    words.end_of_facet()?;
    Ok(corners)
}

/// Whether a word is `endsolid`; some programs join it with the name.
fn ends_solid(word: &[u8]) -> bool {
    const END: &str = "endsolid";
    word.get(..END.len()).is_some_and(|start| is(start, END))
}

fn is_color(word: &[u8]) -> bool {
    is(word, "color") || is(word, "colour")
}

/// Whether a word is this keyword, in any case.
fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

struct Words<'a> {
    file: &'a Path,
    words: words::Words<'a>,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        self.words.next()
    }

    /// Reads the name of a solid, of any words: up to the end of the line, or to the first facet on it.
    fn name(&mut self) -> String {
        let (start, mut end) = (self.words.at, self.words.at);
        while let Some(word) = self.words.next_in_line() {
            let behind = self.words.at;
            if is(word, "facet") && self.words.next_in_line().is_some_and(|word| is(word, "normal")) {
                self.words.at = end;
                break;
            }
            (self.words.at, end) = (behind, behind);
        }
        let name = String::from_utf8_lossy(&self.words.bytes[start..end]);
        name.split_ascii_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Skips the name behind `endsolid`: up to the end of the line, or to a solid that has a facet on it.
    fn pass_name(&mut self) {
        let mut solid = None;
        loop {
            let before = self.words.at;
            match self.words.next_in_line() {
                Some(word) if is(word, "solid") => solid = Some(before),
                Some(word) if is(word, "facet") && solid.is_some() => break,
                Some(_) => {}
                None => return,
            }
        }
        self.words.at = solid.unwrap_or(self.words.at);
    }

    fn fault(&self, word: &[u8], expected: &str) -> Diagnostic {
        let text = match word {
            [] => format!("the file ends where {expected} should follow"),
            word => format!("`{}` where {expected} should be", shorten(&String::from_utf8_lossy(word))),
        };
        let remedy = if word.is_empty() { CUT_OFF } else { DAMAGED };
        Diagnostic::new("stl-syntax", self.file, self.words.line.to_string(), text).remedy(remedy)
    }

    fn expect(&mut self, keyword: &str) -> Result<(), Diagnostic> {
        self.pass_color();
        let word = self.next().unwrap_or_default();
        if is(word, keyword) { Ok(()) } else { Err(self.fault(word, &format!("`{keyword}`"))) }
    }

    /// Returns the next word without consuming it.
    fn peek(&mut self) -> &'a [u8] {
        let (at, line) = (self.words.at, self.words.line);
        let word = self.next().unwrap_or_default();
        (self.words.at, self.words.line) = (at, line);
        word
    }

    /// Skips the numbers of a colour.
    fn pass_numbers(&mut self) {
        let is_number = |word: &[u8]| word.first().is_some_and(|b| b.is_ascii_digit() || b"+-.".contains(b));
        for _ in 0..4 {
            if is_number(self.peek()) {
                self.next();
            }
        }
    }

    /// Skips a colour, if one comes next.
    fn pass_color(&mut self) {
        if is_color(self.peek()) {
            self.next();
            self.pass_numbers();
        }
    }

    /// Expects a keyword that begins with `end`, as one word or two.
    fn end(&mut self, keyword: &str) -> Result<(), Diagnostic> {
        self.pass_color();
        match keyword.strip_prefix("end").filter(|_| is(self.peek(), "end")) {
            Some(rest) => {
                self.next();
                self.expect(rest)
            }
            None => self.expect(keyword),
        }
    }

    /// Expects `endfacet`, which some programs omit, and skips the numbers of a colour that others write behind it.
    fn end_of_facet(&mut self) -> Result<(), Diagnostic> {
        self.pass_color();
        let next = self.peek();
        if next.is_empty() || is(next, "facet") || ends_solid(next) {
            return Ok(());
        }
        self.end("endfacet")?;
        self.pass_numbers();
        Ok(())
    }

    fn number(&mut self) -> Result<f64, Diagnostic> {
        self.words.number().map_err(|word| self.fault(word, "a number"))
    }
}
