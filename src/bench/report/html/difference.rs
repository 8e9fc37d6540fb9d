//! Difference image of the test counts of two structures.

use super::super::{Model, Report};
use super::heat::indexed;
use crate::accel::AccelKind;
use crate::bench::row::Row;
use crate::number::grouped;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// Blue, white, orange: distinguishable with any kind of colour vision; darker with growing difference.
const COLORS: [[u8; 3]; 5] = [[0, 58, 112], [92, 164, 214], [247, 247, 247], [242, 158, 84], [150, 54, 0]];

/// Palette index of no difference, in 0 to 254.
const MIDDLE: f64 = 127.0;

/// Figure of the difference of two structures; empty without two structures that have maps.
pub(super) fn figure(report: &Report, model: &Model) -> String {
    let Some([a, b]) = pair(report, model) else { return asked_in_vain(report) };
    let differences: Vec<i64> =
        a.tests_by_pixel.iter().zip(&b.tests_by_pixel).map(|(&a, &b)| i64::from(a) - i64::from(b)).collect();
    let max = differences.iter().map(|d| d.unsigned_abs()).max().unwrap_or(0).max(1);
    let pixels: Vec<u8> = differences.iter().map(|&d| place(d, max)).collect();
    let Ok(png) = indexed(&pixels, model.width, model.height, color) else { return String::new() };
    let share = |holds: fn(i64) -> bool| {
        let count = differences.iter().filter(|&&d| holds(d)).count();
        100.0 * count as f64 / differences.len().max(1) as f64
    };
    let mean = differences.iter().sum::<i64>() as f64 / differences.len().max(1) as f64;
    let (more, fewer, same) = (share(|d| d > 0), share(|d| d < 0), share(|d| d == 0));
    let [a, b] = [a, b].map(|row| row.kind);
    format!(
        "<figure class=\"difference\"><h3>Tests in each pixel: {a} minus {b}</h3><figcaption>{a} tests fewer shapes than \
         {b} in {fewer:.1} % of the pixels (blue), more in {more:.1} % (orange), as many in {same:.1} % (white); {mean:+.2} a \
         pixel on average. The scale is logarithmic to both sides.</figcaption>{}<img alt=\"{a} minus {b}\" \
         width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\"></figure>\n",
        legend(max, a),
        model.width,
        model.height,
        STANDARD.encode(png)
    )
}

/// Requested pair of structures; by default the two fast ones, or else the first two that have maps.
fn pair<'a>(report: &Report, model: &'a Model) -> Option<[&'a Row; 2]> {
    let mapped = || model.rows.iter().filter(|r| !r.tests_by_pixel.is_empty());
    let find = |kind: AccelKind| mapped().find(|r| r.kind == kind);
    let both = |[a, b]: [AccelKind; 2]| Some([find(a)?, find(b)?]);
    if let Some(asked) = report.compare {
        return both(asked);
    }
    both([AccelKind::FastOctree, AccelKind::FastBvh]).or_else(|| {
        let mut first = mapped();
        Some([first.next()?, first.next()?])
    })
}

fn asked_in_vain(report: &Report) -> String {
    let Some([a, b]) = report.compare else { return String::new() };
    format!(
        "<p>No image of {a} minus {b}: one of them got a sample of the rays only, was left out, or is not done.</p>\n"
    )
}

/// Palette index of a difference, 0 to 254.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 254")]
fn place(difference: i64, max: u64) -> u8 {
    let part = libm::log1p(difference.unsigned_abs() as f64) / libm::log1p(max as f64);
    (MIDDLE + MIDDLE * part.min(1.0) * difference.signum() as f64).round() as u8
}

/// Interpolates linearly in [`COLORS`].
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
fn color(place: u8) -> [u8; 3] {
    let along = (f64::from(place) / (2.0 * MIDDLE)).min(1.0) * (COLORS.len() - 1) as f64;
    let first = (along as usize).min(COLORS.len() - 2);
    let part = along - first as f64;
    let [a, b] = [COLORS[first], COLORS[first + 1]];
    [0, 1, 2].map(|k| (f64::from(a[k]) * (1.0 - part) + f64::from(b[k]) * part).round() as u8)
}

/// Colour scale with numbers and the meaning of its ends.
fn legend(max: u64, first: AccelKind) -> String {
    const LEFT: f64 = 36.0;
    const LONG: f64 = 400.0;
    let mut svg = String::from(
        "<svg class=\"scale\" viewBox=\"0 0 472 52\" role=\"img\" aria-label=\"scale of the difference\"><defs>\
         <linearGradient id=\"difference\">",
    );
    // Writing to a string cannot fail, here and below.
    for (i, [r, g, b]) in COLORS.iter().enumerate() {
        let _ = write!(svg, "<stop offset=\"{}%\" stop-color=\"rgb({r},{g},{b})\"/>", 100 * i / (COLORS.len() - 1));
    }
    let _ = write!(
        svg,
        "</linearGradient></defs><rect x=\"{LEFT}\" y=\"2\" width=\"{LONG}\" height=\"14\" fill=\"url(#difference)\"/>"
    );
    let decades = (0..18).map(|d| 10u64.pow(d)).take_while(|&tick| (tick as f64) < 0.4 * max as f64);
    // Show every second decade if all would not fit.
    let step = if max > 2000 { 2 } else { 1 };
    let ticks: Vec<u64> = decades.step_by(step).chain([max]).collect();
    let mut tick = |value: i64, sign: &str| {
        let x = LEFT + LONG * f64::from(place(value, max)) / (2.0 * MIDDLE);
        let number = grouped(value.unsigned_abs());
        let _ = write!(svg, "<text x=\"{x:.0}\" y=\"31\" text-anchor=\"middle\">{sign}{number}</text>");
    };
    tick(0, "");
    for value in ticks.into_iter().filter_map(|t| i64::try_from(t).ok()) {
        tick(value, "+");
        tick(-value, "−");
    }
    let _ = write!(
        svg,
        "<text class=\"soft\" x=\"{LEFT}\" y=\"48\">fewer tests in {first}</text><text class=\"soft\" x=\"{}\" y=\"48\" \
         text-anchor=\"end\">more tests in {first}</text></svg>",
        LEFT + LONG
    );
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_difference_is_white_and_both_sides_get_darker_alike() {
        assert_eq!([place(0, 50), place(50, 50), place(-50, 50), place(-900, 50)], [127, 254, 0, 0]);
        assert!((0..50).all(|d| place(d, 50) - 127 == 127 - place(-d, 50)));
        assert_eq!([color(0), color(127), color(254)], [COLORS[0], COLORS[2], COLORS[4]]);
        let light = |p: u8| color(p).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert!((0..120).step_by(5).all(|p| light(p) < light(p + 5) && light(254 - p) < light(249 - p)));
        // More red than blue is a contrast that all kinds of colour vision perceive.
        assert!(color(60)[2] > color(60)[0] + 50 && color(200)[0] > color(200)[2] + 50);
    }
}
