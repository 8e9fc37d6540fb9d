//! Study as text: a line per setting as it is measured, then the front and the recommendations.

use crate::bench::study::Study;
use crate::bench::study::measure::Row;
use crate::number::seconds;
use std::fmt::Write;

/// Text above the rows.
pub fn head(study: &Study) -> String {
    let (width, height) = study.size;
    format!(
        "{}: {width}×{height}, {}; the reference has {} samples a pixel and is itself {:.5} off\n\
         errors are of the displayed picture, codes 0 to 1; times of the processor, median of {}\n\
         {:<38}{:>10}{:>10}{:>9}{:>9}{:>9}{:>8}{:>8}\n",
        study.name,
        study.view,
        study.reference.samples,
        study.reference.error,
        study.plan.renderings(),
        "",
        "CPU time",
        "samples",
        "RMSE",
        "noise",
        "bias",
        "max",
        "FLIP"
    )
}

/// Line of one setting.
pub fn row(row: &Row) -> String {
    let error = row.error;
    format!(
        "{:<38}{:>10}{:>10.1}{:>9}{:>9.4}{:>9.4}{:>8.3}{:>8.4}\n",
        row.setting.flags,
        seconds(row.cpu.median()),
        row.samples,
        error.formatted(4),
        error.noise,
        error.bias,
        error.max,
        error.flip
    )
}

/// Front and recommendations, after the rows.
pub fn conclusion(study: &Study) -> String {
    let mut out = "\nnothing is both faster and nearer than these:\n".to_owned();
    for i in study.front() {
        let row = &study.rows[i];
        // Writing to a string does not fail.
        let _ =
            writeln!(out, "  {:>10}  {:>7}  {}", seconds(row.cpu.median()), row.error.formatted(4), row.setting.flags);
    }
    out += "\nuse\n";
    for advice in study.advice() {
        let flags = advice.row.map_or("nothing that was tried", |i| study.rows[i].setting.flags.as_str());
        let _ = writeln!(out, "  for {}: {flags}\n    {}", advice.purpose, advice.why);
    }
    if !study.complete {
        out += "not every setting was measured\n";
    }
    out
}
