//! Binary STL: 80 bytes of anything, the number of triangles, and 50 bytes for each.

use super::Making;
use crate::load::diagnostic::CUT_OFF;
use crate::load::geometry::plain_mesh::PlainMesh;
use crate::load::{Diagnostic, Source};
use crate::math::DVec3;
use crate::scene::Material;
use crate::scene::color::to_srgb;
use rayon::prelude::*;

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

/// Reads every triangle. A header that claims none, or as many as can be, is not believed where whole ones follow: programs
/// write it first, and some never come back to it.
///
/// # Errors
/// When there are fewer than the header claims. What follows them is not looked at; a warning counts it.
pub(super) fn read(source: &Source, mut making: Making) -> Result<PlainMesh, Diagnostic> {
    let bytes = source.bytes.as_slice();
    let fault = |at: usize, text: String| {
        let fault = Diagnostic::new("stl-cut-off", &source.path, format!("byte {at}"), text);
        fault.remedy(CUT_OFF)
    };
    let claimed = claimed(bytes)
        .ok_or_else(|| fault(bytes.len(), format!("the file ends inside its header of {HEADER} bytes")))?;
    let (records, rest) = bytes[HEADER..].as_chunks::<TRIANGLE>();
    let is_claim = claimed != 0 && claimed != u64::from(u32::MAX);
    let uncounted = !is_claim && !records.is_empty() && rest.is_empty();
    if (records.len() as u64) < claimed && !uncounted {
        let text = format!("the header claims {claimed} triangles, but only {} are there", records.len());
        return Err(fault(HEADER + records.len() * TRIANGLE, text));
    }
    // As many as there are in memory.
    let records = if uncounted { records } else { &records[..claimed as usize] };
    let paint = Paint::of(&bytes[..80], records);
    making.take(records.len())?;
    let mut colors = Vec::new();
    if let Some(paint) = paint {
        making.take_colors(records.len())?;
        records.par_iter().map(|record| paint.color(attributes(record))).collect_into_vec(&mut colors);
    }
    // What was single precision is told apart as such.
    let bits = |place: DVec3| place.as_vec3().to_array().map(f32::to_bits);
    let mut bare = making.triangles(3 * records.len(), |corner| place(records, corner), bits, colors)?;
    if uncounted {
        let text = format!("the header claims {claimed} triangles, but {} are there", records.len());
        let warning = Diagnostic::new("stl-uncounted", &source.path, "byte 80", text);
        bare.told.push(warning.remedy("they are drawn"));
    }
    bare.told.extend(behind(source, records.len()));
    let said = String::from_utf8_lossy(&bytes[..80]);
    bare.comments.push(said.trim_matches(|c: char| c.is_control() || c.is_whitespace()).into());
    Ok(bare)
}

/// Where a corner is; each triangle has three, behind its normal.
fn place(records: &[[u8; TRIANGLE]], corner: usize) -> DVec3 {
    let record = &records[corner / 3];
    let number = |k: usize| f64::from(f32::from_le_bytes([record[k], record[k + 1], record[k + 2], record[k + 3]]));
    let at = 12 * (1 + corner % 3);
    DVec3::new(number(at), number(at + 4), number(at + 8))
}

/// A warning when bytes follow the triangles that are read.
fn behind(source: &Source, triangles: usize) -> Option<Diagnostic> {
    let end = HEADER + triangles * TRIANGLE;
    let bytes = source.bytes.len().checked_sub(end).filter(|bytes| *bytes > 0)?;
    let text = format!("{bytes} bytes follow the {triangles} triangles that the header claims");
    let warning = Diagnostic::new("stl-bytes-behind", &source.path, format!("byte {end}"), text);
    Some(warning.remedy("they are not read"))
}

/// The two bytes behind the corners.
fn attributes(record: &[u8; TRIANGLE]) -> u16 {
    u16::from_le_bytes([record[TRIANGLE - 2], record[TRIANGLE - 1]])
}

/// What attributes mean where they are colours, five bits to a part.
struct Paint {
    /// Where red, green and blue begin.
    parts: [u32; 3],
    /// The highest bit of triangles that have a colour of their own.
    own: u16,
    /// The colour of the others; none of them has one where this is everything that the file says.
    whole: [f32; 4],
    is_all: bool,
}

impl Paint {
    /// In either of the two ways in use: Materialise Magics writes `COLOR=` and four bytes into the header, the colour of the
    /// whole, and a triangle has its own where the highest bit is clear; VisCAM and SolidView write no more than triangles with
    /// the highest bit set, and the other order of parts. `None` where there is no sign of either. MeshLab writes Magics' sign
    /// and sets the bit of all triangles, which have colours of their own all the same.
    fn of(header: &[u8], records: &[[u8; TRIANGLE]]) -> Option<Self> {
        const SIGN: &[u8] = b"COLOR=";
        const OWN: u16 = 1 << 15;
        let sign = header.windows(SIGN.len()).position(|word| word == SIGN);
        if let Some(&[red, green, blue]) = sign.and_then(|at| header[at + SIGN.len()..].first_chunk()) {
            let [r, g, b] = [red, green, blue].map(|c| f32::from(c) / 255.0);
            // Programs that know the colour of the whole alone leave the attributes 0, which would be black.
            let is_all = records.iter().all(|record| attributes(record) == 0);
            let all_set = records.iter().all(|record| attributes(record) & OWN != 0);
            let differ = records.windows(2).any(|pair| attributes(&pair[0]) != attributes(&pair[1]));
            let own = if all_set && differ { OWN } else { 0 };
            return Some(Self { parts: [0, 5, 10], own, whole: [r, g, b, 1.0], is_all });
        }
        let [r, g, b] = Material::plain().base_color.to_array().map(to_srgb);
        let is_painted = records.iter().any(|record| attributes(record) & OWN != 0);
        is_painted.then_some(Self { parts: [10, 5, 0], own: OWN, whole: [r, g, b, 1.0], is_all: false })
    }

    /// sRGB-coded, and opaque.
    fn color(&self, attributes: u16) -> [f32; 4] {
        if self.is_all || attributes & (1 << 15) != self.own {
            return self.whole;
        }
        let [r, g, b] = self.parts.map(|part| f32::from((attributes >> part) & 31) / 31.0);
        [r, g, b, 1.0]
    }
}
