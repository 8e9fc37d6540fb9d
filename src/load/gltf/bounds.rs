//! Compares the declared bounds of accessors with their data.
//!
//! Rendering does not use declared bounds; wrong ones are a sign of wrong data.

use super::accessor::{Extent, Format, Reader, Unreadable};
use super::codes::Code;
use super::report::Report;
use gltf::json::Index;
use gltf::json::accessor::Accessor;
use rayon::prelude::*;
use serde_json::Value;

/// Tolerance, relative to the value or to 1: many exporters round bounds to six digits.
const ROUNDED: f64 = 1e-5;

/// Bytes that may always be read, in addition to twice the size of the buffers.
const FREE: u64 = 1 << 28;

/// Checks accessors that declare bounds, and sparse ones.
///
/// Accessors may overlap, so that a small file can declare any amount of data: the bytes read are limited to what ordinary files
/// have.
pub(super) fn check(reader: Reader, report: &mut Report) {
    let mut left = (reader.buffers.len() + reader.decoded.len()).saturating_mul(2).saturating_add(FREE);
    let affordable = |accessor: &Accessor| {
        let wanted = accessor.min.is_some() || accessor.max.is_some() || accessor.sparse.is_some();
        let size = Format::of(accessor).map_or(0, |format| format.size() as u64);
        let after = left.checked_sub(accessor.count.0.saturating_mul(size)).filter(|_| wanted);
        left = after.unwrap_or(left);
        after.is_some()
    };
    let affordable: Vec<bool> = reader.root.accessors.iter().map(affordable).collect();
    let extents: Vec<_> = affordable
        .par_iter()
        .enumerate()
        .map(|(i, affordable)| affordable.then(|| reader.extent(Index::new(u32::try_from(i).ok()?))).flatten())
        .collect();
    for (i, (accessor, extent)) in reader.root.accessors.iter().zip(extents).enumerate() {
        let place = format!("accessors[{i}]");
        match extent {
            Some(Ok(extent)) => {
                compare(&extent, accessor.min.as_ref(), false, &place, report);
                compare(&extent, accessor.max.as_ref(), true, &place, report);
            }
            Some(Err(Unreadable::Data(code, text))) => report.add(code, place, text),
            // Reported by whoever needs the data.
            Some(Err(_)) | None => {}
        }
    }
}

fn compare(extent: &Extent, declared: Option<&Value>, upper: bool, place: &str, report: &mut Report) {
    let name = if upper { "max" } else { "min" };
    let list = declared.and_then(Value::as_array).into_iter().flatten().map(Value::as_f64);
    for (k, (declared, (lo, hi))) in list.zip(extent).enumerate() {
        let Some(declared) = declared else { continue };
        let actual = if upper { *hi } else { *lo };
        if !actual.is_finite() || (declared - actual).abs() <= ROUNDED * actual.abs().max(1.0) {
            continue;
        }
        let place = format!("{place}.{name}[{k}]");
        let text = format!("declared bounds differ from the data ({declared} and {actual} here)");
        let outside = if upper { actual > declared } else { actual < declared };
        let code = match (outside, upper) {
            (true, true) => Code::AccessorElementOutOfMaxBound,
            (true, false) => Code::AccessorElementOutOfMinBound,
            (false, true) => Code::AccessorMaxMismatch,
            (false, false) => Code::AccessorMinMismatch,
        };
        report.add(code, place, text);
    }
}
