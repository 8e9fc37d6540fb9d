//! Tables of a model, for every format: composition of each structure, and its cost per ray class.

use super::table::Table;
use super::{Model, Rays, Report};
use crate::accel::Count;
use crate::bench::row::{ClassRow, Row};
use crate::number::{bytes, grouped, seconds, short, whole};

/// Memory, composition and build cost of each structure.
pub(super) fn structures(report: &Report, model: &Model) -> Table {
    let mut columns = vec!["structure", "memory", "n_in", "n_v", "n_ev", "n_oiv"];
    if report.is_timed() {
        columns.extend(["t_b", "min..max", "Mrays/s", "break-even"]);
    }
    let cells = |row: &Row| {
        let s = row.made_of;
        let mut cells = vec![name(row), bytes(s.bytes)];
        cells.extend([s.n_in, s.n_v, s.n_ev, s.n_oiv].map(grouped));
        if report.is_timed() {
            cells.push(seconds(row.build.median()));
            cells.push(format!("{}..{}", seconds(row.build.min()), seconds(row.build.max())));
            cells.push(short(1e-6 / model.seconds_per_ray(row)));
            cells.push(model.break_even(row).map_or("-".into(), whole));
        }
        cells
    };
    Table { title: "Structures".into(), columns: owned(&columns), rows: model.rows.iter().map(cells).collect() }
}

/// Cost of the rays of the `i`th class in each structure. Below a structure that got a sample stand its number of rays and half
/// the 95 % interval of each count.
pub(super) fn class(report: &Report, model: &Model, i: usize, rays: &Rays) -> Table {
    let sample = match rays.asked == rays.kept as u64 {
        true => String::new(),
        false => format!(", an even sample of {}", grouped(rays.asked)),
    };
    let complete = model.rows.iter().find(|row| !row.sampled).and_then(|row| row.classes.get(i));
    let required = complete.map_or(String::new(), |class| format!(", n_min {:.3}", class.n_min()));
    let title = format!("{}: {} rays{sample}{required}", rays.class.name(), grouped(rays.kept as u64));

    let mut columns = vec!["structure"];
    if report.is_timed() {
        columns.extend(["Mrays/s", "min..max"]);
    }
    columns.extend(Count::ALL.map(Count::name));
    columns.push("culled");
    let of_row = |row: &Row| {
        let Some(class) = row.classes.get(i) else { return Vec::new() };
        let mut lines = vec![costs(report, model, row, class)];
        if row.sampled && class.is_sampled() {
            lines.push(certainty(report, class));
        }
        lines
    };
    Table { title, columns: owned(&columns), rows: model.rows.iter().flat_map(of_row).collect() }
}

fn costs(report: &Report, model: &Model, row: &Row, class: &ClassRow) -> Vec<String> {
    let mut cells = vec![name(row)];
    if report.is_timed() {
        let [median, min, max] = class.rates().map(short);
        cells.extend([median, format!("{min}..{max}")]);
    }
    cells.extend(Count::ALL.map(|count| short(class.per_ray(count))));
    cells.push(culled(class, model.prims));
    cells
}

/// Line with the confidence of a sample, below that of its structure.
fn certainty(report: &Report, class: &ClassRow) -> Vec<String> {
    let mut cells = vec![format!("  {} rays", grouped(class.counts.queries))];
    if report.is_timed() {
        cells.extend([String::new(), String::new()]);
    }
    cells.extend(Count::ALL.map(|count| format!("±{}", short(class.interval(count)))));
    cells.push("(95 %)".into());
    cells
}

/// Name of a row's structure; a star marks a sample.
pub(super) fn name(row: &Row) -> String {
    format!("{}{}", row.kind, if row.sampled { "*" } else { "" })
}

/// Culled share in per cent, with enough digits to distinguish it from 100.
fn culled(class: &ClassRow, prims: usize) -> String {
    match class.culled(prims) * 100.0 {
        p if p > 99.0 && p < 100.0 => format!("{:.4}%", p.min(99.9999)),
        p => format!("{p:.1}%"),
    }
}

fn owned(titles: &[&str]) -> Vec<String> {
    titles.iter().map(|title| (*title).into()).collect()
}
