//! Plots as SVG, small enough for a phone: 440 units wide.

use super::super::Model;
use super::super::number::{grouped, seconds, short};
use crate::bench::compare::{Count, Row};
use crate::bench::rays::Class;
use std::fmt::Write;

const WIDTH: f64 = 440.0;

/// A logarithmic scale: decades from `low` on, along `from..to`.
struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    /// Whole decades around the values that are above 0.
    fn around(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for log in values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10) {
            (low, high) = (low.min(log), high.max(log));
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let (low, high) = ((low - 0.02).floor(), (high + 0.02).ceil());
        Self { low, high: high.max(low + 1.0), from, to }
    }

    /// Just around the values, with one more part in ten on both sides, and nearly a decade at least.
    fn fitting(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Self {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let low = logs.clone().fold(f64::INFINITY, f64::min);
        let high = logs.fold(f64::NEG_INFINITY, f64::max);
        let (middle, half) = ((low + high) * 0.5, ((high - low) * 0.6).max(0.4));
        if low > high {
            return Self::around(std::iter::empty(), from, to);
        }
        Self { low: middle - half, high: middle + half, from, to }
    }

    /// Where a value lies; what is 0 or below the scale lies at its start.
    fn at(&self, value: f64) -> f64 {
        let part = (value.max(1e-300).log10() - self.low) / (self.high - self.low);
        self.from + part.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// The decades, every second or third one where there are many; 1, 2, 5 of each where there are few.
    #[expect(clippy::cast_possible_truncation, reason = "decades of floats are small")]
    fn ticks(&self) -> Vec<f64> {
        let (low, high) = (self.low.ceil() as i32, self.high.floor() as i32);
        if self.high - self.low < 2.5 && self.low.fract() != 0.0 {
            let all = (low - 1..=high).flat_map(|decade| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(decade)));
            return all.filter(|t| (self.low..=self.high).contains(&t.log10())).collect();
        }
        let step = usize::try_from((high - low) / 6 + 1).unwrap_or(1);
        (low..=high).step_by(step).map(|decade| 10f64.powi(decade)).collect()
    }
}

/// Each structure a row, each class a mark: its tests a ray.
pub(super) fn tests(model: &Model) -> String {
    const LEFT: f64 = 92.0;
    const ROW: f64 = 40.0;
    const TOP: f64 = 44.0;
    let bottom = TOP + ROW * model.rows.len() as f64;
    let values = model.rows.iter().flat_map(|r| r.classes.iter().map(|c| c.per_ray(Count::It)));
    let scale = Scale::around(values.chain([model.prims as f64]), LEFT + 10.0, WIDTH - 30.0);
    let mut svg = open(bottom + 38.0, "Ray/prim tests a ray by structure and class of rays");

    legend(&mut svg, model);
    for tick in scale.ticks() {
        let x = scale.at(tick);
        rule(&mut svg, [x, TOP], [x, bottom], "");
        let label = if tick < 1.0 { format!("{tick}") } else { grouped(tick as u64) };
        words(&mut svg, x, bottom + 15.0, "middle", "soft", &label);
    }
    let all = scale.at(model.prims as f64);
    rule(&mut svg, [all, TOP - 4.0], [all, bottom], "n");
    words(&mut svg, all.min(WIDTH - 2.0), bottom + 32.0, "end", "soft", "dashed: N, every prim tested");
    for (row, y) in model.rows.iter().zip(0..).map(|(row, i)| (row, TOP + ROW * f64::from(i))) {
        rule(&mut svg, [LEFT, y + ROW], [WIDTH - 8.0, y + ROW], "");
        words(&mut svg, LEFT - 4.0, y + ROW * 0.5 + 4.0, "end", "", &super::name(row));
        let lanes = row.classes.len().max(1) as f64;
        for (i, (class, rays)) in row.classes.iter().zip(&model.rays).enumerate() {
            let value = class.per_ray(Count::It);
            let lane = y + ROW * (0.14 + 0.72 * (i as f64 + 0.5) / lanes);
            mark(&mut svg, rays.class, scale.at(value), lane, &format!("{}: {}", rays.class.name(), short(value)));
        }
    }
    svg + "</svg>"
}

/// Each structure a point: seconds to build, seconds for a ray.
pub(super) fn times(model: &Model) -> String {
    const LEFT: f64 = 62.0;
    const RIGHT: f64 = 330.0;
    const TOP: f64 = 12.0;
    const BOTTOM: f64 = 270.0;
    let mut rows: Vec<&Row> = model.rows.iter().filter(|r| !r.sampled).collect();
    let x = Scale::fitting(rows.iter().map(|r| r.build.median()), LEFT, RIGHT);
    let y = Scale::fitting(rows.iter().map(|r| model.seconds_per_ray(r)), BOTTOM, TOP);
    let mut svg = open(BOTTOM + 42.0, "Seconds for a ray against seconds to build, by structure");
    for tick in x.ticks() {
        rule(&mut svg, [x.at(tick), TOP], [x.at(tick), BOTTOM], "");
        words(&mut svg, x.at(tick), BOTTOM + 15.0, "middle", "soft", &unit(tick));
    }
    for tick in y.ticks() {
        rule(&mut svg, [LEFT, y.at(tick)], [RIGHT, y.at(tick)], "");
        words(&mut svg, LEFT - 5.0, y.at(tick) + 4.0, "end", "soft", &unit(tick));
    }
    words(&mut svg, (LEFT + RIGHT) * 0.5, BOTTOM + 34.0, "middle", "soft", "time to build; up: time of a ray");

    // Names stand in a column of their own, in the order of the points, so that none covers another.
    rows.sort_by(|a, b| model.seconds_per_ray(b).total_cmp(&model.seconds_per_ray(a)));
    let places: Vec<f64> = rows.iter().map(|r| y.at(model.seconds_per_ray(r))).collect();
    for (row, (place, label)) in rows.iter().zip(places.iter().zip(spread_out(&places, 15.0, BOTTOM))) {
        let px = x.at(row.build.median());
        rule(&mut svg, [px, *place], [RIGHT + 8.0, label], "");
        let told = format!(
            "{}: {} a ray, built in {}",
            row.kind,
            seconds(model.seconds_per_ray(row)),
            seconds(row.build.median())
        );
        let _ = write!(
            svg,
            "<circle class=\"dot\" cx=\"{px:.1}\" cy=\"{place:.1}\" r=\"4.5\"><title>{told}</title></circle>"
        );
        words(&mut svg, RIGHT + 11.0, label + 4.0, "start", "", &super::name(row));
    }
    svg + "</svg>"
}

/// A round number of seconds: `20 µs`.
fn unit(seconds: f64) -> String {
    let scaled = |factor: f64, unit: &str| format!("{} {unit}", grouped((seconds * factor).round() as u64));
    match seconds {
        s if s < 0.99e-6 => scaled(1e9, "ns"),
        s if s < 0.99e-3 => scaled(1e6, "µs"),
        s if s < 0.99 => scaled(1e3, "ms"),
        _ => scaled(1.0, "s"),
    }
}

/// Ascending places moved apart by at least `gap`, none beyond `end`.
fn spread_out(places: &[f64], gap: f64, end: f64) -> Vec<f64> {
    let mut moved: Vec<f64> = Vec::new();
    for &place in places {
        moved.push(moved.last().map_or(place, |&before| place.max(before + gap)));
    }
    let mut limit = end;
    for place in moved.iter_mut().rev() {
        *place = place.min(limit);
        limit = *place - gap;
    }
    moved
}

fn open(height: f64, label: &str) -> String {
    format!("<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{label}\">")
}

fn rule(svg: &mut String, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) {
    // Writing to a string cannot fail, here and below.
    let _ = write!(svg, "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>");
}

fn words(svg: &mut String, x: f64, y: f64, anchor: &str, class: &str, text: &str) {
    let _ = write!(svg, "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
}

/// The marks and their names in two lines.
fn legend(svg: &mut String, model: &Model) {
    for (i, rays) in model.rays.iter().enumerate() {
        let (x, y) = (100.0 + 112.0 * (i % 3) as f64, 12.0 + 18.0 * (i / 3) as f64);
        mark(svg, rays.class, x, y, rays.class.name());
        words(svg, x + 9.0, y + 4.0, "start", "", rays.class.name());
    }
}

/// Colour and shape of a class.
fn mark(svg: &mut String, class: Class, x: f64, y: f64, title: &str) {
    let shape = match class {
        Class::Primary => "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0-9 0z",
        Class::Shadow => "M-4-4h8v8h-8z",
        Class::Reflected => "M0-5.5L5.5 0L0 5.5L-5.5 0z",
        Class::Refracted => "M0-5L5 4.5H-5z",
        Class::Diffuse => "M0 5L5-4.5H-5z",
    };
    let name = class.name();
    let _ = write!(
        svg,
        "<path class=\"{name}\" transform=\"translate({x:.1} {y:.1})\" d=\"{shape}\"><title>{title}</title></path>"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_never_cover_each_other() {
        let moved = spread_out(&[10.0, 11.0, 12.0, 95.0, 99.0], 15.0, 100.0);
        assert!(moved.windows(2).all(|w| w[1] - w[0] >= 14.99) && moved[4] <= 100.0, "{moved:?}");
    }

    #[test]
    fn a_scale_has_whole_decades_and_keeps_nothing_at_its_start() {
        let scale = Scale::around([0.0, 3.0, 250.0].into_iter(), 0.0, 300.0);
        assert_eq!((scale.low, scale.high, scale.ticks()), (0.0, 3.0, vec![1.0, 10.0, 100.0, 1000.0]));
        assert_eq!([0.0, 1.0, 10.0, 1e9].map(|v| scale.at(v)), [0.0, 0.0, 100.0, 300.0]);
    }
}
