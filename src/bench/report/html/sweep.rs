//! Cost of a parameter over its values: the U-shaped curves.

use super::super::cost::{Cost, costs};
use super::super::sweep::{Curve, curves, sentences, tables};
use super::super::{Model, Report};
use super::growth::tick;
use super::lines::{Lines, Series, plot};
use super::svg::plain;
use super::{escaped, figure, table};
use crate::bench::row::Row;
use crate::bench::sweep::Sweep;

/// Figures of a parameter sweep, which replace the usual ones.
pub(super) fn figures(report: &Report, model: &Model, sweep: &Sweep) -> String {
    let said: String = sentences(report, model).iter().map(|text| format!("<p>{}.</p>\n", escaped(text))).collect();
    let plots: String = costs(report).map(|cost| one(report, model, sweep, cost)).collect();
    let tables: String = tables(report, model).iter().map(table).collect();
    said + &plots + &tables
}

fn one(report: &Report, model: &Model, sweep: &Sweep, cost: Cost) -> String {
    let value = |row: Option<&Row>| row.and_then(|r| r.setting).and_then(|s| s.value);
    let of = |curve: &Curve| Series {
        kind: curve.kind,
        points: curve.points(model, cost),
        label: curve.kind.to_string(),
        ringed: value(Some(curve.best)),
        boxed: value(curve.default),
        level: curve.default.filter(|d| value(Some(d)).is_none()).map(|d| cost.of(model, d, None)),
    };
    let series: Vec<Series> = curves(report, model).iter().map(of).collect();
    let level = if series.iter().any(|s| s.level.is_some()) { ", or dashed where it has no such value" } else { "" };
    let by = if report.is_timed() { "the least time" } else { "the fewest tests and visits together" };
    let caption = format!("Lower is better. Circle: the value with {by}; square: the default{level}.");
    let svg = plot(&Lines {
        label: &format!("{} against {}, by structure", cost.title(), sweep.parameter),
        below: sweep.parameter.name(),
        is_even: sweep.parameter.is_even(),
        shown: [&|v| plain(&format!("{v:.4}")).to_owned(), &|y| tick(cost, y)],
        series,
    });
    figure(cost.title(), &caption, &svg)
}
