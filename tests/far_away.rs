//! A mesh far from the origin looks like the same mesh at the origin.
//!
//! At 10⁷, where maps and industrial plants place objects, single precision has steps of 1: only coordinates that are read,
//! centred and placed in double precision keep the shape.

use crate::common::still;
use meshray::accel::AccelKind;
use meshray::image::Picture;
use meshray::image::diff::{Space, compare};
use meshray::load::{LoadOptions, load_bytes};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

const RINGS: u32 = 40;
const STEPS: u32 = 64;

/// A point of a sitting animal with two long ears, about 2 across, in millionths; on the ground at y = 0.
fn animal(ring: u32, step: u32) -> [i64; 3] {
    let (polar, around) = (f64::from(ring) / f64::from(RINGS) * TAU / 2.0, f64::from(step) / f64::from(STEPS) * TAU);
    let bump = |at_polar: f64, at_around: f64, width: f64| {
        let turned = (around - at_around + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        let (down, aside) = (polar - at_polar, turned * at_polar.sin());
        (-(down * down + aside * aside) / (width * width)).exp()
    };
    let ears = bump(0.42, 0.9, 0.13) + bump(0.42, TAU / 2.0 - 0.9, 0.13);
    let radius = 0.8 + 0.5 * bump(0.8, TAU / 4.0, 0.45) + 0.9 * ears + 0.2 * bump(1.9, TAU * 0.75, 0.3);
    let point =
        [polar.sin() * around.cos() * radius, polar.cos() * radius + 0.6, polar.sin() * around.sin() * radius * 1.2];
    let [x, y, z] = point.map(|c| (c * 1e6).round() as i64);
    [x, y.max(0), z]
}

/// OBJ text of the animal with `shift` added to every coordinate, exactly: six decimals whatever the integer part.
fn text(shift: i64) -> String {
    let mut text = String::new();
    for ring in 0..=RINGS {
        for step in 0..STEPS {
            let [x, y, z] = animal(ring, step).map(|c| decimal(c + shift * 1_000_000));
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
    }
    for ring in 0..RINGS {
        for step in 0..STEPS {
            let corner = |ring: u32, step: u32| ring * STEPS + step % STEPS + 1;
            let (a, b) = (corner(ring, step), corner(ring, step + 1));
            let (c, d) = (corner(ring + 1, step), corner(ring + 1, step + 1));
            writeln!(text, "f {a} {b} {c}\nf {b} {d} {c}").unwrap();
        }
    }
    text
}

fn decimal(millionths: i64) -> String {
    let sign = if millionths < 0 { "-" } else { "" };
    format!("{sign}{}.{:06}", millionths.abs() / 1_000_000, millionths.abs() % 1_000_000)
}

fn picture(text: String) -> Picture {
    let loaded = load_bytes(Path::new("animal.obj"), text.into_bytes(), &LoadOptions::default()).unwrap();
    still(loaded.scene, AccelKind::default(), 240, 180).unwrap()
}

/// Not bit for bit: in double precision the decimals themselves are rounded by 10⁻⁹ at 10⁷, and so is the eye's position. That is
/// far less than a pixel, so no pixel code changes by more than a rounding.
#[test]
fn an_obj_ten_million_away_gives_the_picture_of_the_one_at_the_origin() {
    let near = picture(text(0));
    for shift in [10_000_000, -10_000_000] {
        let difference = compare(&near, &picture(text(shift)), Space::Display, 1.0 / 255.0).unwrap();
        assert_eq!(difference.over, 0, "{shift}: {difference:?}");
    }
    let covered = near.beauty.iter().filter(|p| p[3] > 0.5).count();
    assert!(covered * 4 > near.beauty.len(), "the animal is seen");
}
