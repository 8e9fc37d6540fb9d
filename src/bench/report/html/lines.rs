//! Line plots, one line per structure: a cost against a size or a parameter.

use super::svg::{Scale, open, rule, spread_out, words};
use crate::accel::AccelKind;
use std::fmt::Write;

/// Line of one structure.
pub(super) struct Series {
    /// Structure, which determines colour and marks.
    pub(super) kind: AccelKind,
    /// Points by ascending x; y = 0 cannot be shown.
    pub(super) points: Vec<(f64, f64)>,
    /// Name of the line, with a number.
    pub(super) label: String,
    /// X of the point to circle.
    pub(super) ringed: Option<f64>,
    /// X of the point to frame with a square.
    pub(super) boxed: Option<f64>,
    /// Y of a horizontal line across the plot.
    pub(super) level: Option<f64>,
}

/// Contents of a plot.
pub(super) struct Lines<'a> {
    /// Accessible label.
    pub(super) label: &'a str,
    /// Label of the x axis.
    pub(super) below: &'a str,
    /// Whether the x axis is linear; otherwise logarithmic.
    pub(super) is_even: bool,
    /// Formatters of x and y values.
    pub(super) shown: [&'a dyn Fn(f64) -> String; 2],
    /// Lines of the plot.
    pub(super) series: Vec<Series>,
}

const LEFT: f64 = 58.0;
const RIGHT: f64 = 292.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 300.0;

/// Plots the lines. Names stand in a separate column in the order of the lines' ends, so that none overlap.
pub(super) fn plot(lines: &Lines) -> String {
    let points = || lines.series.iter().flat_map(|s| s.points.iter().copied()).filter(|p| p.1 > 0.0);
    let x = match lines.is_even {
        true => Scale::even(points().map(|p| p.0), LEFT + 8.0, RIGHT - 8.0),
        false => Scale::tight(points().map(|p| p.0), LEFT + 8.0, RIGHT - 8.0),
    };
    let levels = lines.series.iter().filter_map(|s| s.level).filter(|y| *y > 0.0);
    let y = Scale::tight(points().map(|p| p.1).chain(levels), BOTTOM - 8.0, TOP + 8.0);
    let mut svg = open(BOTTOM + 40.0, lines.label);
    axes(&mut svg, lines, &x, &y);

    let mut drawn: Vec<&Series> = lines.series.iter().filter(|s| s.points.iter().any(|p| p.1 > 0.0)).collect();
    let end = |s: &Series| s.points.iter().rfind(|p| p.1 > 0.0).map_or((0.0, 0.0), |&(px, py)| (x.at(px), y.at(py)));
    drawn.sort_by(|a, b| end(a).1.total_cmp(&end(b).1));
    let places: Vec<f64> = drawn.iter().map(|s| end(s).1).collect();
    for (series, label) in drawn.iter().zip(spread_out(&places, 15.0, BOTTOM)) {
        let (px, py) = end(series);
        rule(&mut svg, [px, py], [RIGHT + 6.0, label], "");
        sample(&mut svg, series.kind, RIGHT + 13.0, label);
        words(&mut svg, RIGHT + 22.0, label + 4.0, "start", "", &series.label);
    }
    for series in drawn {
        line(&mut svg, series, lines, &x, &y);
    }
    svg + "</svg>"
}

fn axes(svg: &mut String, lines: &Lines, x: &Scale, y: &Scale) {
    let [shown_x, shown_y] = lines.shown;
    for tick in x.ticks() {
        rule(svg, [x.at(tick), TOP], [x.at(tick), BOTTOM], "");
        words(svg, x.at(tick), BOTTOM + 15.0, "middle", "soft", &shown_x(tick));
    }
    for tick in y.ticks() {
        rule(svg, [LEFT, y.at(tick)], [RIGHT, y.at(tick)], "");
        words(svg, LEFT - 5.0, y.at(tick) + 4.0, "end", "soft", &shown_y(tick));
    }
    words(svg, (LEFT + RIGHT) * 0.5, BOTTOM + 33.0, "middle", "soft", lines.below);
}

fn line(svg: &mut String, series: &Series, lines: &Lines, x: &Scale, y: &Scale) {
    let (kind, [shown_x, shown_y]) = (series.kind, lines.shown);
    let seen: Vec<_> = series.points.iter().filter(|p| p.1 > 0.0).collect();
    let places: Vec<String> = seen.iter().map(|p| format!("{:.1},{:.1}", x.at(p.0), y.at(p.1))).collect();
    // Writing to a string cannot fail, here and below.
    if let Some(level) = series.level.filter(|l| *l > 0.0) {
        let y = y.at(level);
        let _ =
            write!(svg, "<line class=\"k-{kind} level\" x1=\"{LEFT}\" y1=\"{y:.1}\" x2=\"{RIGHT}\" y2=\"{y:.1}\"/>");
    }
    let _ = write!(svg, "<polyline class=\"k-{kind}\" points=\"{}\"/>", places.join(" "));
    for &&(px, py) in &seen {
        mark(svg, kind, x.at(px), y.at(py), &format!("{kind} at {}: {}", shown_x(px), shown_y(py)));
        let (px_at, py_at) = (x.at(px), y.at(py));
        if series.ringed == Some(px) {
            let _ = write!(svg, "<circle class=\"k-{kind} around\" cx=\"{px_at:.1}\" cy=\"{py_at:.1}\" r=\"9\"/>");
        }
        if series.boxed == Some(px) {
            let [left, top] = [px_at - 7.0, py_at - 7.0];
            let _ = write!(
                svg,
                "<rect class=\"k-{kind} around\" x=\"{left:.1}\" y=\"{top:.1}\" width=\"14\" height=\"14\"/>"
            );
        }
    }
}

/// Mark for the legend.
fn sample(svg: &mut String, kind: AccelKind, x: f64, y: f64) {
    mark(svg, kind, x, y, kind.name());
}

/// Draws a mark in the structure's colour and shape; no two structures share a shape.
fn mark(svg: &mut String, kind: AccelKind, x: f64, y: f64, title: &str) {
    let shape = match kind {
        AccelKind::None => "M-4-4L4 4M-4 4L4-4",
        AccelKind::Transform => "M0-5V5M-5 0H5",
        AccelKind::Spheres => "M-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0z",
        AccelKind::Boxes => "M-3-3h6v6h-6z",
        AccelKind::Bvh => "M0 4.5L4.5-4H-4.5z",
        AccelKind::Grid => "M-4-4h8v8h-8z",
        AccelKind::GridOctree => "M0-5L5 0L0 5L-5 0z",
        AccelKind::GridBvh => "M0-4.5L4.5 4H-4.5z",
        AccelKind::Octree => "M-4.5 0L4-4.5V4.5z",
        AccelKind::FastOctree => "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z",
        AccelKind::FastBvh => "M4.5 0L-4-4.5V4.5z",
    };
    let _ = write!(
        svg,
        "<path class=\"k-{kind}\" transform=\"translate({x:.1} {y:.1})\" d=\"{shape}\"><title>{title}</title></path>"
    );
}
