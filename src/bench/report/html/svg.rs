//! SVG scales, lines and text of plots, small enough for a phone: 440 units wide.

use crate::number::short;
use std::fmt::Write;

/// Width of a plot in SVG units.
pub(crate) const WIDTH: f64 = 440.0;

/// Maps values (linear) or their decimal logarithms in `low..high` to coordinates `from..to`.
pub(crate) struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    is_even: bool,
}

impl Scale {
    /// Logarithmic scale of whole decades around the positive values.
    pub(crate) fn around(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for log in values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10) {
            (low, high) = (low.min(log), high.max(log));
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let (low, high) = ((low - 0.02).floor(), (high + 0.02).ceil());
        Self { low, high: high.max(low + 1.0), from, to, is_even: false }
    }

    /// Logarithmic scale of the values with a margin of a tenth of their range on both sides, nearly a decade at least.
    pub(crate) fn fitting(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Self {
        let tight = Self::tight(values, from, to);
        let (middle, half) = ((tight.low + tight.high) * 0.5, ((tight.high - tight.low) * 0.6).max(0.4));
        Self { low: middle - half, high: middle + half, ..tight }
    }

    /// Logarithmic scale from the least value to the greatest; spans at least a factor of 1.6.
    pub(crate) fn tight(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        Self { is_even: false, ..Self::between(logs, 0.2, from, to) }
    }

    /// Linear scale from the least value to the greatest.
    pub(crate) fn even(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        Self { is_even: true, ..Self::between(values, 1.0, from, to) }
    }

    fn between(values: impl Iterator<Item = f64>, least: f64, from: f64, to: f64) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let more = (least - (high - low)).max(0.0) * 0.5;
        Self { low: low - more, high: high + more, from, to, is_even: false }
    }

    /// Coordinate of a value, clamped to the scale; 0 maps to the start of a logarithmic scale.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let value = if self.is_even { value } else { value.max(1e-300).log10() };
        let part = (value - self.low) / (self.high - self.low);
        self.from + part.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// Tick values: whole decades on long scales, parts of them on short ones.
    pub(crate) fn ticks(&self) -> Vec<f64> {
        let span = self.high - self.low;
        if self.is_even {
            return self.multiples((span / 6.0).ceil().max(1.0));
        }
        let are_whole = self.low.fract() == 0.0 && self.high.fract() == 0.0;
        match span {
            s if s >= 2.5 || are_whole => {
                self.multiples((s / 6.0).ceil()).into_iter().map(|decade| 10f64.powf(decade)).collect()
            }
            s if s >= 1.0 => self.within_decades(&[1.0, 2.0, 5.0]),
            s if s >= 0.6 => self.within_decades(&[1.0, 2.0, 3.0, 5.0]),
            s if s >= 0.35 => self.within_decades(&[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]),
            _ => self.within_decades(&[
                1.0, 1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2.0, 2.25, 2.5, 2.75, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0,
            ]),
        }
    }

    /// Values at intervals of `step`, from the first integer on the scale.
    fn multiples(&self, step: f64) -> Vec<f64> {
        let first = (self.low - 1e-9).ceil();
        (0..).map(|i| first + f64::from(i) * step).take_while(|v| *v <= self.high + 1e-9).collect()
    }

    #[expect(clippy::cast_possible_truncation, reason = "decades of floats are small")]
    fn within_decades(&self, parts: &[f64]) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.floor() as i32;
        let all = decades.flat_map(|decade| parts.iter().map(move |m| m * 10f64.powi(decade)));
        all.filter(|t| (self.low - 1e-9..=self.high + 1e-9).contains(&t.log10())).collect()
    }
}

/// Formats round seconds with a unit: `20 µs`.
pub(crate) fn unit(seconds: f64) -> String {
    let scaled = |factor: f64, unit: &str| format!("{} {unit}", plain(&short(seconds * factor)));
    match seconds {
        s if s < 0.99e-6 => scaled(1e9, "ns"),
        s if s < 0.99e-3 => scaled(1e6, "µs"),
        s if s < 0.99 => scaled(1e3, "ms"),
        _ => scaled(1.0, "s"),
    }
}

/// Formats a large round number: `2e5`.
pub(crate) fn power(number: f64) -> String {
    format!("{number:.1e}").replace(".0e", "e")
}

/// Strips trailing zeros: `1.50` becomes `1.5`.
pub(crate) fn plain(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

/// Moves ascending positions apart by at least `gap`, none beyond `end`.
pub(crate) fn spread_out(places: &[f64], gap: f64, end: f64) -> Vec<f64> {
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

pub(crate) fn open(height: f64, label: &str) -> String {
    format!("<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{label}\">")
}

pub(crate) fn rule(svg: &mut String, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], class: &str) {
    // Writing to a string cannot fail, here and below.
    let _ = write!(svg, "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>");
}

pub(crate) fn words(svg: &mut String, x: f64, y: f64, anchor: &str, class: &str, text: &str) {
    let _ = write!(svg, "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
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
    fn an_even_scale_has_values_and_a_narrow_one_enough_ticks() {
        let even = Scale::even([0.0, 10.0].into_iter(), 0.0, 100.0);
        assert_eq!([0.0, 3.0, 10.0].map(|v| even.at(v)), [0.0, 30.0, 100.0]);
        assert_eq!(even.ticks(), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        for (low, high) in
            [(1.0, 1.1), (3.1, 5.0), (0.4, 2.0), (1.07, 2.84), (7e-7, 9e-6), (1.0, 64.0), (0.5, 64.0), (1e3, 1e9)]
        {
            let scale = Scale::tight([low, high].into_iter(), 0.0, 100.0);
            let ticks = scale.ticks();
            assert!((2..=8).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            assert!(ticks.iter().all(|&t| (-0.1..100.1).contains(&scale.at(t))), "{low} {high}: {ticks:?}");
        }
        assert_eq!([1.1 * 1e4, 2e5].map(power), ["1.1e4", "2e5"]);
        assert_eq!([1.5e-6, 2e-3, 0.5, 10.0].map(unit), ["1.5 µs", "2 ms", "500 ms", "10 s"]);
    }

    #[test]
    fn a_scale_has_whole_decades_and_keeps_nothing_at_its_start() {
        let scale = Scale::around([0.0, 3.0, 250.0].into_iter(), 0.0, 300.0);
        assert_eq!((scale.low, scale.high, scale.ticks()), (0.0, 3.0, vec![1.0, 10.0, 100.0, 1000.0]));
        assert_eq!([0.0, 1.0, 10.0, 1e9].map(|v| scale.at(v)), [0.0, 0.0, 100.0, 300.0]);
    }
}
