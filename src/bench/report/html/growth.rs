//! Growth of cost with size: plots and tables.

use super::super::Report;
use super::super::cost::{Cost, costs};
use super::super::growth::{Curve, METHOD, kinds, sentences, tables};
use super::lines::{Lines, Series, plot};
use super::svg::{plain, power, unit};
use super::{escaped, figure, table};
use crate::number::{bytes, grouped, short};

/// Growth section; empty if the models are not a family in growing sizes.
pub(super) fn section(report: &Report) -> String {
    let (Some(family), false) = (report.family, report.models.is_empty()) else { return String::new() };
    let sizes: Vec<String> = report.models.iter().map(|m| grouped(m.prims as u64)).collect();
    let mut out = format!("<section><h2>Growth: {family}</h2>\n<p>Scenes of {} prims (N).</p>\n", sizes.join(", "));
    sentences(report).iter().for_each(|text| out += &format!("<p>{}.</p>\n", escaped(text)));
    costs(report).for_each(|cost| out += &curves(report, cost));
    tables(report).iter().for_each(|shown| out += &table(shown));
    out + &format!("<p>{}.</p>\n</section>\n", escaped(METHOD))
}

fn curves(report: &Report, cost: Cost) -> String {
    let curve = |kind| Curve::of(&report.models, kind, cost, None);
    let curves: Vec<Curve> = kinds(report).into_iter().map(curve).collect();
    let nothing: Vec<&str> =
        curves.iter().filter(|c| c.points.iter().all(|p| p.1 <= 0.0)).map(|c| c.kind.name()).collect();
    let of = |curve: Curve| {
        let label = format!("{} {}", curve.kind, curve.short_exponent()).trim_end().to_owned();
        Series { kind: curve.kind, label, points: curve.points, ringed: None, boxed: None, level: None }
    };
    let svg = plot(&Lines {
        label: &format!("{} against the number of prims, by structure", cost.title()),
        below: "prims of the scene (N)",
        is_even: false,
        shown: [&power, &|y| tick(cost, y)],
        series: curves.into_iter().map(of).collect(),
    });
    let none =
        if nothing.is_empty() { String::new() } else { format!(" Nothing at any size: {}.", nothing.join(", ")) };
    let caption = format!("Both scales are logarithmic; beside each name the exponent of N. Lower is better.{none}");
    figure(cost.title(), &caption, &svg)
}

/// Label of a tick of a cost axis.
pub(super) fn tick(cost: Cost, value: f64) -> String {
    match cost {
        Cost::Tests | Cost::Visits if value >= 1e5 => power(value),
        Cost::Tests | Cost::Visits => plain(&short(value)).to_owned(),
        Cost::Time | Cost::Build => unit(value),
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive; less than a byte is none"
        )]
        Cost::Memory => {
            let text = bytes(value.round() as u64);
            let (number, unit) = text.split_once(' ').unwrap_or((&text, ""));
            format!("{} {unit}", plain(number))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_values_have_no_digits_to_spare() {
        let shown =
            [(Cost::Tests, 0.5), (Cost::Tests, 10.0), (Cost::Visits, 2e5), (Cost::Memory, 1500.0), (Cost::Memory, 2e6)];
        assert_eq!(shown.map(|(c, v)| tick(c, v)), ["0.5", "10", "2e5", "1.5 kB", "2 MB"]);
        assert_eq!([(Cost::Time, 1.5e-6), (Cost::Build, 0.5)].map(|(c, v)| tick(c, v)), ["1.5 µs", "500 ms"]);
    }
}
