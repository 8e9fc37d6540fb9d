//! Binary STL: 80 arbitrary bytes, the number of triangles, and 50 bytes for each.

use super::Making;
use crate::load::diagnostic::CUT_OFF;
use crate::load::geometry::plain_mesh::PlainMesh;
use crate::load::{Diagnostic, Source};
use crate::math::DVec3;
use crate::scene::Material;
use crate::scene::color::to_srgb;
use rayon::prelude::*;

/// Offset of the first triangle, in bytes.
const HEADER: usize = 84;

/// Size of a triangle, in bytes: a normal, three positions, and two bytes of attributes.
const TRIANGLE: usize = 50;

/// Number of triangles that the header claims.
fn claimed(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(80..HEADER)?.first_chunk::<4>()?;
    Some(u64::from(u32::from_le_bytes(*count)))
}

/// Whether the length of the file matches its count of triangles: other files hardly ever do.
pub(in crate::load) fn is_exact(bytes: &[u8]) -> bool {
    claimed(bytes).is_some_and(|count| HEADER as u64 + count * TRIANGLE as u64 == bytes.len() as u64)
}

/// Reads every triangle. A count of 0, or the largest possible one, is ignored where whole triangles follow: programs
/// write the header first, and some never update it.
///
/// # Errors
/// When there are fewer triangles than the header claims. Bytes behind them are ignored; a warning counts them.
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
    // No more than the records in memory.
    let records = if uncounted { records } else { &records[..claimed as usize] };
    let paint = Paint::of(&bytes[..80], records);
    making.take(records.len())?;
    let mut colors = Vec::new();
    if let Some(paint) = paint {
        making.take_colors(records.len())?;
        records.par_iter().map(|record| paint.color(attributes(record))).collect_into_vec(&mut colors);
    }
    // Positions come from single precision, so converting them back is exact.
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

/// Position of a corner; each triangle has three, behind its normal.
fn place(records: &[[u8; TRIANGLE]], corner: usize) -> DVec3 {
    let record = &records[corner / 3];
    let number = |k: usize| f64::from(f32::from_le_bytes([record[k], record[k + 1], record[k + 2], record[k + 3]]));
    let at = 12 * (1 + corner % 3);
    DVec3::new(number(at), number(at + 4), number(at + 8))
}

/// Warning when bytes follow the triangles that are read.
fn behind(source: &Source, triangles: usize) -> Option<Diagnostic> {
    let end = HEADER + triangles * TRIANGLE;
    let bytes = source.bytes.len().checked_sub(end).filter(|bytes| *bytes > 0)?;
    let text = format!("{bytes} bytes follow the {triangles} triangles that the header claims");
    let warning = Diagnostic::new("stl-bytes-behind", &source.path, format!("byte {end}"), text);
    Some(warning.remedy("they are not read"))
}

/// Attributes of a triangle: the two bytes behind its corners.
fn attributes(record: &[u8; TRIANGLE]) -> u16 {
    u16::from_le_bytes([record[TRIANGLE - 2], record[TRIANGLE - 1]])
}

/// Interpretation of attributes as colours, five bits per channel.
struct Paint {
    /// Shifts of red, green and blue.
    parts: [u32; 3],
    /// Highest bit of the attributes of triangles with a colour of their own.
    own: u16,
    /// Colour of the other triangles; of all triangles where `is_all`, as the file gives no other.
    whole: [f32; 4],
    is_all: bool,
}

impl Paint {
    /// Detects either of the two conventions: Materialise Magics writes `COLOR=` and four bytes into the header, the colour
    /// of the whole, and clears the highest bit of triangles with their own colour; VisCAM and SolidView only set the highest bit
    /// of coloured triangles, and order the channels in reverse. `None` where there is no sign of either. MeshLab writes
    /// Magics' sign and sets the bit of all triangles, which have colours of their own nevertheless.
    fn of(header: &[u8], records: &[[u8; TRIANGLE]]) -> Option<Self> {
        const SIGN: &[u8] = b"COLOR=";
        const OWN: u16 = 1 << 15;
        let sign = header.windows(SIGN.len()).position(|word| word == SIGN);
        if let Some(&[red, green, blue]) = sign.and_then(|at| header[at + SIGN.len()..].first_chunk()) {
            let [r, g, b] = [red, green, blue].map(|c| f32::from(c) / 255.0);
            // Programs that know only the colour of the whole leave the attributes 0, which would be black.
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

    /// Colour of a triangle, sRGB-coded and opaque.
    fn color(&self, attributes: u16) -> [f32; 4] {
        if self.is_all || attributes & (1 << 15) != self.own {
            return self.whole;
        }
        let [r, g, b] = self.parts.map(|part| f32::from((attributes >> part) & 31) / 31.0);
        [r, g, b, 1.0]
    }
}
