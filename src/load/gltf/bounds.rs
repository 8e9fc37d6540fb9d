//! Declared bounds of accessors against their data.
//!
//! Nothing is drawn from declared bounds; that they are wrong is a sign that the data is.

use super::accessor::{Extent, Reader, Unreadable};
use super::codes::Code;
use super::report::Report;
use gltf::json::Index;
use rayon::prelude::*;
use serde_json::Value;

/// Rounding to six digits, as many exporters write bounds, relative to the value or to 1.
const ROUNDED: f64 = 1e-5;

/// Checks every accessor that declares bounds, and every sparse one.
pub(super) fn check(reader: Reader, report: &mut Report) {
    let accessors = reader.root.accessors.par_iter().enumerate();
    let extents: Vec<_> = accessors
        .map(|(i, accessor)| {
            let wanted = accessor.min.is_some() || accessor.max.is_some() || accessor.sparse.is_some();
            wanted.then(|| reader.extent(Index::new(u32::try_from(i).ok()?))).flatten()
        })
        .collect();
    for (i, (accessor, extent)) in reader.root.accessors.iter().zip(extents).enumerate() {
        let place = format!("accessors[{i}]");
        match extent {
            Some(Ok(extent)) => {
                compare(&extent, accessor.min.as_ref(), false, &place, report);
                compare(&extent, accessor.max.as_ref(), true, &place, report);
            }
            Some(Err(Unreadable::Data(code, text))) => report.add(code, place, text),
            // Whoever needs the data tells of it.
            Some(Err(_)) | None => {}
        }
    }
}

fn compare(extent: &Extent, declared: Option<&Value>, upper: bool, place: &str, report: &mut Report) {
    let name = if upper { "max" } else { "min" };
    let list = declared.and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_f64);
    for (k, (declared, (lo, hi))) in list.zip(extent).enumerate() {
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
