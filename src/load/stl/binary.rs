//! Binary STL: 80 bytes of anything, the number of triangles, and 50 bytes for each.

use super::Triangles;
use crate::load::geometry::bare::Bare;
use crate::load::{Diagnostic, Source};
use crate::math::DVec3;

/// Bytes before the first triangle.
const HEADER: usize = 84;

/// Bytes of a triangle: a normal, three places, and two bytes of attributes.
const TRIANGLE: usize = 50;

/// How many triangles the header claims.
fn claimed(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..HEADER)?.first_chunk::<4>()?;
    Some(u64::from(u32::from_le_bytes(*count)))
}

/// Whether the file is as long as a binary STL of so many triangles: hardly anything else is.
pub(in crate::load) fn is_exact(bytes: &[u8]) -> bool {
    claimed(bytes).is_some_and(|count| HEADER as u64 + count * TRIANGLE as u64 == bytes.len() as u64)
}

/// Reads every triangle. A header that claims none is not believed where whole ones follow: programs write it first, and
/// some never come back to it.
///
/// # Errors
/// When there are fewer than the header claims. What follows them is not looked at; a warning counts it.
pub(super) fn read(source: &Source, mut out: Triangles) -> Result<Bare, Diagnostic> {
    let bytes = source.bytes.as_slice();
    let fault = |at: usize, text: String| {
        let fault = Diagnostic::new("stl-cut-off", &source.path, format!("byte {at}"), text);
        fault.remedy("it was cut off; get it again")
    };
    let claimed = claimed(bytes)
        .ok_or_else(|| fault(bytes.len(), format!("the file ends inside its header of {HEADER} bytes")))?;
    let (records, rest) = bytes[HEADER..].as_chunks::<TRIANGLE>();
    if (records.len() as u64) < claimed {
        let text = format!("the header claims {claimed} triangles, but only {} are there", records.len());
        return Err(fault(HEADER + records.len() * TRIANGLE, text));
    }
    let uncounted = claimed == 0 && !records.is_empty() && rest.is_empty();
    // As many as there are in memory.
    let records = if uncounted { records } else { &records[..claimed as usize] };
    for record in records {
        let number = |k: usize| {
            let bytes = [record[k], record[k + 1], record[k + 2], record[k + 3]];
            f64::from(f32::from_le_bytes(bytes))
        };
        let place = |k: usize| DVec3::new(number(k), number(k + 4), number(k + 8));
        out.add([place(12), place(24), place(36)])?;
    }
    let mut bare = out.bare;
    if uncounted {
        let text = format!("the header claims 0 triangles, but {} are there", records.len());
        let warning = Diagnostic::new("stl-uncounted", &source.path, "byte 80", text);
        bare.told.push(warning.remedy("they are drawn"));
    }
    bare.told.extend(behind(source, records.len()));
    if are_colored(&bytes[..80], records) {
        let text = "colours in the attribute bytes of triangles are not drawn";
        let warning = Diagnostic::new("stl-colors", &source.path, "", text);
        bare.told.push(warning.remedy("export it as PLY or glTF"));
    }
    let said = String::from_utf8_lossy(&bytes[..80]);
    bare.comments.push(said.trim_matches(|c: char| c.is_control() || c.is_whitespace()).into());
    Ok(bare)
}

/// A warning when bytes follow the triangles that are read.
fn behind(source: &Source, triangles: usize) -> Option<Diagnostic> {
    let end = HEADER + triangles * TRIANGLE;
    let bytes = source.bytes.len().checked_sub(end).filter(|bytes| *bytes > 0)?;
    let text = format!("{bytes} bytes follow the {triangles} triangles that the header claims");
    let warning = Diagnostic::new("stl-bytes-behind", &source.path, format!("byte {end}"), text);
    Some(warning.remedy("they are not read"))
}

/// Whether attributes mean colours: where the header has a colour of the whole, as Magics writes it, or a triangle has the
/// bit by which VisCAM and SolidView say that it has one.
fn are_colored(header: &[u8], records: &[[u8; TRIANGLE]]) -> bool {
    let by_header = header.windows(6).any(|word| word == b"COLOR=");
    by_header || records.iter().any(|record| record[TRIANGLE - 1] & 0x80 != 0)
}
