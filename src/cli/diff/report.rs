//! The figures of a difference, as text and as JSON.

use super::Compared;
use super::args::DiffArgs;
use crate::cli::version::SHORT;
use crate::image::Picture;
use crate::image::diff::{LayerDifference, Space, values};
use crate::number::grouped;
use serde_json::{Value, json};
use std::fmt::Write;

/// Text report: one line per figure.
pub(super) fn text(args: &DiffArgs, compared: &Compared) -> String {
    let (d, looks) = (&compared.difference, &compared.looks);
    let (width, height) = (compared.expected.width, compared.expected.height);
    let values = match (compared.space, d.channels) {
        (Space::Display, 3) => "display colour, 0 to 1",
        (Space::Display, _) => "display colour over black and coverage, 0 to 1",
        (Space::Linear, 3) => "linear light",
        (Space::Linear, _) => "linear light over black and coverage",
    };
    let mut lines = vec![("", format!("{width}×{height} pixels, {values}"))];
    let (x, y) = d.worst;
    lines.push(("RMSE", figure(d.rmse)));
    lines.push(("relative RMSE", format!("{} of the root mean square expected", figure(d.relative_rmse))));
    let bias = if d.bias.is_finite() { format!("{:+.3e}", d.bias) } else { figure(d.bias) };
    lines.push(("bias", format!("{bias} mean of actual − expected")));
    lines.push((
        "max",
        format!(
            "{} at ({x}, {y}): {} expected, {}",
            figure(d.max),
            at(compared, Side::Expected),
            at(compared, Side::Actual)
        ),
    ));
    lines.push(("PSNR", decibels(d.psnr)));
    let (x, y) = looks.worst;
    let exposures = looks.exposures.map_or_else(String::new, |e| {
        format!("; the worst of {} exposures, {:+.1} to {:+.1} stops", e.count, e.first, e.last)
    });
    lines.push(("FLIP", format!("{} mean, {} max at ({x}, {y}){exposures}", figure(looks.mean), figure(looks.max))));
    let share = 100.0 * d.over as f64 / d.pixels.max(1) as f64;
    let beyond = if args.threshold > 0.0 { format!(" by more than {}", args.threshold) } else { String::new() };
    lines.push(("pixels", format!("{} of {} differ{beyond} ({share:.2} %)", grouped(d.over), grouped(d.pixels))));
    for layer in &compared.layers {
        let differ = format!("{} of {} values differ", grouped(layer.differing), grouped(layer.values));
        let what = match (LayerDifference::is_name(&layer.name), layer.of_one) {
            (true, _) => differ,
            (false, 0) => format!("RMSE {}, max {}, {differ}", figure(layer.rmse), figure(layer.max)),
            (false, n) => {
                let rmse = figure(layer.rmse);
                format!("RMSE {rmse} without {} that only one of the files has, {differ}", grouped(n))
            }
        };
        lines.push((&layer.name, what));
    }
    for name in &compared.layers_of_one {
        lines.push((name, "only one of the files has it".into()));
    }
    let names = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    lines.iter().fold(String::new(), |mut text, (name, what)| {
        // Writing to a string does not fail.
        let _ = if name.is_empty() { writeln!(text, "{what}") } else { writeln!(text, "  {name:<names$}  {what}") };
        text
    })
}

/// JSON report.
pub(super) fn json(args: &DiffArgs, compared: &Compared, broken: &[String]) -> String {
    let (d, looks) = (&compared.difference, &compared.looks);
    let exposures = looks.exposures.map(|e| json!({"first": e.first, "last": e.last, "count": e.count}));
    let layers: Vec<Value> = compared
        .layers
        .iter()
        .map(|l| {
            json!({
                "name": l.name, "rmse": l.rmse, "max": l.max,
                "differing": l.differing, "of_one": l.of_one, "values": l.values,
            })
        })
        .collect();
    let report = json!({
        "schema": "meshray-diff/1",
        "version": SHORT,
        "expected": args.expected.to_string_lossy(),
        "actual": args.actual.to_string_lossy(),
        "width": compared.expected.width,
        "height": compared.expected.height,
        "space": if compared.space == Space::Display { "display" } else { "linear" },
        "channels": d.channels,
        "rmse": d.rmse,
        "relative_rmse": d.relative_rmse,
        "bias": d.bias,
        "max": d.max,
        "worst": {
            "x": d.worst.0, "y": d.worst.1,
            "expected": compared_values(compared, Side::Expected), "actual": compared_values(compared, Side::Actual),
        },
        "psnr": d.psnr,
        "threshold": args.threshold,
        "pixels_over": d.over,
        "pixels": d.pixels,
        "flip": {
            "mean": looks.mean, "max": looks.max, "worst": {"x": looks.worst.0, "y": looks.worst.1},
            "pixels_per_degree": args.pixels_per_degree, "exposures": exposures,
        },
        "layers": layers,
        "layers_of_one": compared.layers_of_one,
        "left_out": compared.left_out,
        "broken": broken,
    });
    format!("{report:#}\n")
}

/// One of the two pictures.
#[derive(Clone, Copy)]
enum Side {
    Expected,
    Actual,
}

/// Compared values of the worst pixel.
fn compared_values(compared: &Compared, side: Side) -> Vec<f64> {
    let picture: &Picture = match side {
        Side::Expected => &compared.expected,
        Side::Actual => &compared.actual,
    };
    let (x, y) = compared.difference.worst;
    let pixel = picture.beauty.get(y as usize * picture.width as usize + x as usize).copied().unwrap_or_default();
    values(pixel, compared.space).into_iter().take(compared.difference.channels as usize).collect()
}

fn at(compared: &Compared, side: Side) -> String {
    compared_values(compared, side).into_iter().map(figure).collect::<Vec<_>>().join(" ")
}

/// Formats a signal-to-noise ratio.
fn decibels(psnr: f64) -> String {
    match psnr {
        f64::INFINITY => "infinite: the colours are equal".into(),
        // Avoid a negative zero.
        finite if finite.is_finite() => format!("{:.2} dB", (finite * 100.0).round() / 100.0 + 0.0),
        other => figure(other),
    }
}

/// Formats a number with five decimals, or, if it is small or large, in scientific notation with four digits.
fn figure(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        f64::INFINITY => "infinite".into(),
        f64::NEG_INFINITY => "-infinite".into(),
        x if x.is_nan() => "not defined".into(),
        x if x.abs() >= 1e-3 && x.abs() < 1e4 => format!("{x:.5}"),
        x => format!("{x:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_errors_keep_their_digits() {
        assert_eq!([0.0, 0.0123, 4.2e-7, f64::INFINITY].map(figure), ["0", "0.01230", "4.200e-7", "infinite"]);
    }

    #[test]
    fn what_is_no_finite_number_is_called_what_it_is() {
        assert_eq!([f64::NAN, f64::NEG_INFINITY].map(figure), ["not defined", "-infinite"]);
        let ratios = [f64::INFINITY, 30.0, -0.0, -0.001, f64::NEG_INFINITY, f64::NAN].map(decibels);
        assert_eq!(
            ratios,
            ["infinite: the colours are equal", "30.00 dB", "0.00 dB", "0.00 dB", "-infinite", "not defined"]
        );
    }
}
