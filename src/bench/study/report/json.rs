//! Study as JSON.
//!
//! # Schema `meshray-study/1`
//! One JSON object: `version`, `file`, `hash`, `view`, `width`, `height`, `threads`, `machine`, `passes`, `seed`; `reference`
//! (`samples` per pixel, `error` of the reference itself, `channels` compared); `rows` in the order of measurement, each with
//! `flags`, `knob`, `cpu_seconds` and `wall_seconds` (`median`, `min`, `max`), `samples` (primary rays per pixel), `rmse`,
//! `noise`, `bias`, `max`, `worst` (`x`, `y`), `flip`, `is_on_front`; `advice` (`purpose`, `flags` or null, `why`); `complete`.
//! Errors are display codes 0..=1; an `rmse` below half of the reference's `error` cannot be distinguished from 0. Keys are only
//! ever added.

use crate::bench::clock::Spread;
use crate::bench::machine::Machine;
use crate::bench::study::Study;
use crate::number::hash;
use serde_json::{Value, json};

/// Writes the whole study.
pub fn write(study: &Study) -> String {
    let front = study.front();
    let rows: Vec<Value> = study
        .rows
        .iter()
        .enumerate()
        .map(|(i, row)| {
            json!({
                "flags": row.setting.flags,
                "knob": row.setting.knob.name(),
                "cpu_seconds": spread(&row.cpu),
                "wall_seconds": spread(&row.wall),
                "samples": row.samples,
                "rmse": row.error.rmse,
                "noise": row.error.noise,
                "bias": row.error.bias,
                "max": row.error.max,
                "worst": {"x": row.error.worst.0, "y": row.error.worst.1},
                "flip": row.error.flip,
                "is_on_front": front.contains(&i),
            })
        })
        .collect();
    let flags = |row: Option<usize>| row.map(|i| study.rows[i].setting.flags.clone());
    let advice: Vec<Value> = study
        .advice()
        .into_iter()
        .map(|a| json!({"purpose": a.purpose.name(), "flags": flags(a.row), "why": a.why}))
        .collect();
    let whole = json!({
        "schema": "meshray-study/1",
        "version": env!("CARGO_PKG_VERSION"),
        "file": study.name,
        "hash": hash(study.hash),
        "view": study.view,
        "width": study.size.0,
        "height": study.size.1,
        "threads": study.threads,
        "machine": Machine::here().line(),
        "passes": study.plan.renderings(),
        "seed": study.plan.seed,
        "reference": {
            "samples": study.reference.samples,
            "error": study.reference.error,
            "channels": study.reference.channels(),
        },
        "rows": rows,
        "advice": advice,
        "complete": study.complete,
    });
    format!("{whole:#}\n")
}

fn spread(spread: &Spread) -> Value {
    json!({"median": spread.median(), "min": spread.min(), "max": spread.max()})
}
