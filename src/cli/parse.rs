//! Parsers of the values of flags: sizes, vectors, angles, colours. Errors say what is expected.

use crate::bench::range::{Spacing, values};
use crate::generate::MAX_TRIANGLES;
use crate::image::diff::PIXELS_PER_DEGREES;
use crate::math::Vec3;
use crate::math::simd::{Level, UnknownLevel};
use crate::named::{Named, UnknownName};
use crate::render::{Cost, Tape};
use crate::scene::{Background, Environment, MAX_DEPTH, MAX_STOPS, Scene};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::fmt;
use std::path::PathBuf;

/// Longest side of a picture, in pixels.
pub(super) const MAX_SIDE: u32 = crate::render::Settings::MOST_SIDE;

/// `--ortho` as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ortho {
    /// Height framed as the perspective camera would be.
    Auto,
    /// Height in world units from the lower to the upper edge.
    Height(f64),
}

/// Parses width and height, each 1 to [`MAX_SIDE`]; a single number is both.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |s: &str| s.trim().parse::<u32>().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    let (w, h) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    side(w).zip(side(h)).ok_or_else(|| {
        format!("write width x height, such as 800x600, or one number for a square: each whole, from 1 to {MAX_SIDE}")
    })
}

/// Parses column and row of a pixel.
pub(super) fn pixel(text: &str) -> Result<(u32, u32), String> {
    let side = |s: &str| s.trim().parse::<u32>().ok();
    let pixel = text.split_once(',').and_then(|(x, y)| Some((side(x)?, side(y)?)));
    pixel.ok_or_else(|| "write column,row from the top left, such as 400,300".into())
}

/// Parses cell counts on the three axes; the structure checks their range.
pub(super) fn cells(text: &str) -> Result<[u32; 3], String> {
    let parts: Option<Vec<u32>> = text.split(['x', 'X', '×']).map(|n| n.trim().parse().ok()).collect();
    parts.and_then(|p| <[u32; 3]>::try_from(p).ok()).ok_or_else(|| "write three whole numbers, such as 46x46x3".into())
}

/// Parses three finite numbers within the range of coordinates.
pub(super) fn vec3(text: &str) -> Result<[f64; 3], String> {
    let parts: Option<Vec<f64>> = text.split(',').map(|p| finite(p).ok()).collect();
    let parts = parts.and_then(|p| <[f64; 3]>::try_from(p).ok()).ok_or("write three numbers, such as 1,0.5,-2")?;
    let far = Scene::LARGEST;
    if parts.iter().all(|x| x.abs() <= far) {
        Ok(parts)
    } else {
        Err(format!("write numbers from -{far:e} to {far:e}"))
    }
}

/// Parses a direction: three finite numbers, not all 0.
pub(super) fn direction(text: &str) -> Result<[f64; 3], String> {
    let direction = vec3(text)?;
    if direction == [0.0; 3] {
        Err("three zeros are no direction; write one, such as 0,0,1".into())
    } else {
        Ok(direction)
    }
}

fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse::<f64>().ok().filter(|n| n.is_finite()).ok_or_else(|| "write a number".into())
}

fn number_within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let n = finite(text)?;
    if (low..=high).contains(&n) { Ok(n) } else { Err(format!("write a number from {low} to {high}")) }
}

/// Parses a field of view in degrees.
pub(super) fn fov(text: &str) -> Result<f64, String> {
    number_within(text, 0.1, 170.0)
}

/// Parses a time into seconds, with an optional unit: `1.5`, `1.5s`, `250ms`.
pub(super) fn time(text: &str) -> Result<f64, String> {
    let wrong = || "write a time from 0, such as 1.5, 1.5s or 250ms".to_owned();
    let (number, units) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1000.0),
        (None, Some(number)) => (number, 1.0),
        (None, None) => (text, 1.0),
    };
    finite(number).ok().map(|n| n / units).filter(|&n| n >= 0.0).ok_or_else(wrong)
}

/// Maximum number of pictures of a sequence.
const MAX_PICTURES: u32 = 100_000;

/// `--frames`: numbers from `first` up to but excluding `end`, at least one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frames {
    pub first: u32,
    pub end: u32,
}

impl fmt::Display for Frames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.end)
    }
}

/// Parses `A..B` without B, or `A..=B` with it.
pub(super) fn frames(text: &str) -> Result<Frames, String> {
    let whole = |s: &str| s.trim().parse::<u32>().ok();
    let (first, last) = text.split_once("..").ok_or("write A..B, or A..=B to take in B, such as 0..48")?;
    let end = match last.strip_prefix('=') {
        Some(last) => whole(last).and_then(|last| last.checked_add(1)),
        None => whole(last),
    };
    let (first, end) = whole(first)
        .zip(end)
        .ok_or_else(|| format!("the ends are whole numbers from 0 to {}, such as 0..48", u32::MAX))?;
    match end.checked_sub(first) {
        None | Some(0) => Err("there are no frames between these ends".into()),
        Some(count) if count > MAX_PICTURES => Err(format!("at most {MAX_PICTURES} frames")),
        Some(_) => Ok(Frames { first, end }),
    }
}

/// `--turntable`: pictures of one turn, or a single one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turns {
    pub count: u32,
    /// Index of the single picture requested, from 0.
    pub only: Option<u32>,
}

/// Parses `N`, or `I/N` for picture I alone.
pub(super) fn turns(text: &str) -> Result<Turns, String> {
    let whole = |s: &str| s.trim().parse::<u32>().ok();
    let (only, count) = match text.split_once('/') {
        Some((only, count)) => (Some(whole(only)), whole(count)),
        None => (None, whole(text)),
    };
    let count = count.filter(|n| (1..=MAX_PICTURES).contains(n));
    let count = count.ok_or_else(|| format!("write a number of pictures from 1 to {MAX_PICTURES}"))?;
    match only {
        None => Ok(Turns { count, only: None }),
        Some(Some(only)) if only < count => Ok(Turns { count, only: Some(only) }),
        Some(_) => Err(format!("write I/{count} with I from 0 to {}", count - 1)),
    }
}

/// Parses an exposure in stops.
#[expect(clippy::cast_possible_truncation, reason = "the range fits f32")]
pub(super) fn exposure(text: &str) -> Result<f32, String> {
    let most = f64::from(MAX_STOPS);
    number_within(text, -most, most).map(|n| n as f32)
}

/// Parses a weight from 0 to 1.
#[expect(clippy::cast_possible_truncation, reason = "the range fits f32")]
pub(super) fn cutoff(text: &str) -> Result<f32, String> {
    number_within(text, 0.0, 1.0).map(|n| n as f32)
}

/// Parses an error or a difference of channels.
#[expect(clippy::cast_possible_truncation, reason = "the range fits f32")]
pub(super) fn error(text: &str) -> Result<f32, String> {
    number_within(text, 1e-6, 1e6).map(|n| n as f32)
}

/// Parses a probability, as a fraction or in percent.
pub(super) fn confidence(text: &str) -> Result<f64, String> {
    let n = match text.strip_suffix('%') {
        Some(percent) => finite(percent)? / 100.0,
        // Above 1 it must be a percentage.
        None => match finite(text)? {
            n if n > 1.0 => n / 100.0,
            n => n,
        },
    };
    let known = (0.5..=0.9999).contains(&n);
    if known { Ok(n) } else { Err("write a confidence from 50% to 99.99%".into()) }
}

/// Parses a radius.
pub(super) fn radius(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|&n| n >= 0.0).ok_or_else(|| "write a radius, 0 or more".into())
}

/// Focus as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Focus {
    /// Distance along the line of sight.
    Distance(f64),
    /// Distance of this point.
    Point([f64; 3]),
}

/// Parses a distance or a point.
pub(super) fn focus(text: &str) -> Result<Focus, String> {
    if text.contains(',') { vec3(text).map(Focus::Point) } else { above_zero(text).map(Focus::Distance) }
}

/// Parses the name of a value of type `T`.
pub(super) fn named<T: Named>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::names()).try_map(|name: String| name.parse::<T>())
}

/// Parses the maximum number of bounces after the primary ray.
pub(super) fn depth() -> impl TypedValueParser<Value = u32> {
    clap::value_parser!(u32).range(0..=i64::from(MAX_DEPTH))
}

/// Parses a height, or `auto`.
pub(super) fn ortho(text: &str) -> Result<Ortho, String> {
    if text == "auto" {
        return Ok(Ortho::Auto);
    }
    let height = finite(text)?;
    if height > 0.0 { Ok(Ortho::Height(height)) } else { Err("the height must be above 0".into()) }
}

/// Parses a number not below 0.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|&n| n >= 0.0).ok_or_else(|| "write 0 or a number above it".into())
}

/// Parses a number above 0.
pub(super) fn above_zero(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|&n| n > 0.0).ok_or_else(|| "write a number above 0".into())
}

/// Costs to store as layers; `--layers` alone names none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CostList(pub Vec<Cost>);

/// Parses a comma-separated list of costs, possibly empty.
pub(super) fn costs(text: &str) -> Result<CostList, String> {
    let mut costs = Vec::new();
    for name in text.split(',').filter(|_| !text.is_empty()) {
        let cost: Cost = name.trim().parse().map_err(|e: UnknownName| e.to_string())?;
        if !costs.contains(&cost) {
            costs.push(cost);
        }
    }
    Ok(CostList(costs))
}

/// Parses a bit depth: 8 or 16.
pub(super) fn bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("a PNG has 8 or 16 bits a channel; EXR stores floats".into()),
    }
}

/// Parses a count of at least one.
pub(super) fn positive(text: &str) -> Result<usize, String> {
    text.parse().ok().or_else(|| in_powers(text)).filter(|&n| n > 0).ok_or_else(|| "write a number from 1".into())
}

/// Parses a number of rays per class, at most as many as a recording is sure to hold.
pub(super) fn rays(text: &str) -> Result<usize, String> {
    const MOST: usize = Tape::LIMIT / 2;
    positive(text).ok().filter(|&n| n <= MOST).ok_or_else(|| format!("write a number from 1 to {MOST}"))
}

/// Parses a whole number written as `1e6`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
fn in_powers(text: &str) -> Option<usize> {
    /// Beyond this, `f64` lacks some whole numbers.
    const MOST: f64 = (1_u64 << 53) as f64;
    let number = text.parse::<f64>().ok().filter(|n| n.fract() == 0.0 && (0.0..=MOST).contains(n))?;
    usize::try_from(number as u64).ok()
}

/// Parses a number of triangles within the range of generated scenes, also as `1e6`.
pub(super) fn triangles(text: &str) -> Result<usize, String> {
    let number = text.parse::<f64>().ok().filter(|n| (1.0..=MAX_TRIANGLES as f64).contains(n));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
    number.map(|n| n as usize).ok_or_else(|| "write a number of triangles from 1 to 1e7".into())
}

/// Numbers of triangles, in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sizes(pub Vec<usize>);

/// Parses a list or a range of numbers of triangles, each within the range of [`triangles`].
pub(super) fn sizes(text: &str) -> Result<Sizes, String> {
    let sizes = values(text, Spacing::Tens, true)?;
    sizes.iter().map(|n| triangles(&n.to_string())).collect::<Result<_, _>>().map(Sizes)
}

/// Parses bytes with an optional binary suffix: `500M`, `2G`, `2GiB`.
pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let wrong = || "write a size such as 500M or 2G".to_owned();
    let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let number: u64 = text[..digits].parse().map_err(|_| wrong())?;
    let shift = match text[digits..].to_ascii_uppercase().as_str() {
        "" | "B" => 0,
        "K" | "KB" | "KIB" => 10,
        "M" | "MB" | "MIB" => 20,
        "G" | "GB" | "GIB" => 30,
        "T" | "TB" | "TIB" => 40,
        _ => return Err(wrong()),
    };
    number.checked_mul(1 << shift).filter(|&n| n > 0).ok_or_else(wrong)
}

/// Parses a background: a colour, `transparent` or `env`.
pub(super) fn background(text: &str) -> Result<Background, String> {
    match text {
        "transparent" => Ok(Background::Transparent),
        "env" | "environment" => Ok(Background::Environment),
        _ => crate::scene::color::parse(text)
            .map(Background::Color)
            .map_err(|wrong| format!("{wrong}; or `transparent`, or `env`")),
    }
}

/// Environment as typed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Env {
    /// Built-in environment.
    BuiltIn(Environment),
    /// Panorama picture.
    File(PathBuf),
}

/// Parses `studio`, `white`, `black`, or a file name.
pub(super) fn env(text: &str) -> Result<Env, String> {
    match text {
        "studio" => Ok(Env::BuiltIn(Environment::Studio)),
        "white" => Ok(Env::BuiltIn(Environment::Constant(Vec3::ONE))),
        "black" => Ok(Env::BuiltIn(Environment::Black)),
        "" => Err("name a picture, or `studio`, `white`, `black`".into()),
        file => Ok(Env::File(file.into())),
    }
}

/// Parses the angular diameter of a disc in the sky, in degrees.
pub(super) fn sun(text: &str) -> Result<f64, String> {
    degrees(text)
        .ok()
        .filter(|d| (0.0..=180.0).contains(d))
        .ok_or_else(|| "write an angle of 0 to 180 degrees".to_owned())
}

/// Parses the angle between two faces: degrees are typed, radians returned.
pub(super) fn lean(text: &str) -> Result<f64, String> {
    sun(text).map(f64::to_radians)
}

/// Parses an angle in degrees.
pub(super) fn degrees(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|d: &f64| d.is_finite()).ok_or_else(|| "write an angle in degrees such as 90".to_owned())
}

/// Parses the pixels per degree of the visual field.
pub(super) fn pixels_per_degree(text: &str) -> Result<f64, String> {
    let wrong = || format!("write a number from {} to {}", PIXELS_PER_DEGREES.start(), PIXELS_PER_DEGREES.end());
    finite(text).ok().filter(|n| PIXELS_PER_DEGREES.contains(n)).ok_or_else(wrong)
}

/// Parses the name of an instruction set that the machine has.
pub(super) fn level(text: &str) -> Result<Level, String> {
    text.parse().map_err(|e: UnknownLevel| e.to_string())
}

/// Formats a linear colour as text that [`background`] reads back exactly.
pub(super) fn color_text(c: Vec3) -> String {
    format!("{},{},{}", c.x, c.y, c.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_two_sides_of_at_least_one_and_a_single_number_is_a_square() {
        assert_eq!(size("800x600"), Ok((800, 600)));
        assert_eq!(size("1X65535"), Ok((1, 65535)));
        assert_eq!(size("256"), Ok((256, 256)));
        for wrong in ["", "0", "65536", "800x", "x600", "0x5", "5x0", "x", "-1x5", "65536x1", "1.5x2", "99999999999x1"]
        {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_of_things_are_whole_and_may_be_powers() {
        assert_eq!([positive("7"), positive("1e3"), positive("2.5e4")], [Ok(7), Ok(1000), Ok(25_000)]);
        for wrong in ["0", "-1", "1.5", "1e-3", "1e16", "1e300", "nan", "inf", ""] {
            assert!(positive(wrong).is_err(), "{wrong}");
        }
        assert_eq!(rays("524288"), Ok(524_288));
        assert!(rays("524289").unwrap_err().ends_with("524288"));
    }

    #[test]
    fn vectors_have_three_finite_parts() {
        assert_eq!(vec3("-1, 2.5,3e2"), Ok([-1.0, 2.5, 300.0]));
        assert_eq!(vec3("1e18,-1e18,0"), Ok([1e18, -1e18, 0.0]));
        for wrong in ["1,2", "1,2,3,4", "1,2,nan", "inf,0,0", "", "1,1.1e18,0"] {
            assert!(vec3(wrong).is_err(), "{wrong}");
        }
        assert_eq!((direction("0,0,-1"), direction("0,-0,0").is_err()), (Ok([0.0, 0.0, -1.0]), true));
    }

    #[test]
    fn costs_are_listed_with_commas_and_none_is_a_list_too() {
        assert_eq!(costs("steps,tests,steps"), Ok(CostList(vec![Cost::Steps, Cost::Tests])));
        assert_eq!(costs(""), Ok(CostList(Vec::new())));
        assert!(costs("tests,stpes").unwrap_err().contains("steps"));
    }

    #[test]
    fn numbers_of_triangles_come_in_lists_and_ranges_up_to_ten_million() {
        assert_eq!(sizes("1e3..1e7").map(|s| s.0), Ok(vec![1000, 10_000, 100_000, 1_000_000, 10_000_000]));
        assert_eq!(sizes("500,1e3").map(|s| s.0), Ok(vec![500, 1000]));
        for wrong in ["0", "0,5", "1e3..1e8", "many", "1e4..1e3"] {
            assert!(sizes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn memory_sizes_take_binary_suffixes() {
        assert_eq!(bytes("500"), Ok(500));
        assert_eq!(bytes("2G"), Ok(2 << 30));
        assert_eq!(bytes("3MiB"), Ok(3 << 20));
        for wrong in ["", "G", "0", "2X", "99999999999T", "-1"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn ranges_of_frames_hold_one_at_least() {
        assert_eq!(frames("0..48"), Ok(Frames { first: 0, end: 48 }));
        assert_eq!(frames("7..=7"), Ok(Frames { first: 7, end: 8 }));
        for text in ["3..3", "4..3", "..3", "3..", "3", "a..b", "0..=4294967295", "0..4000000", "-1..2"] {
            assert!(frames(text).is_err(), "{text}");
        }
        assert_eq!(turns("36"), Ok(Turns { count: 36, only: None }));
        assert_eq!(turns("0/4"), Ok(Turns { count: 4, only: Some(0) }));
        for text in ["0", "4/4", "-1/4", "/4", "4/", "a"] {
            assert!(turns(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_confidence_is_a_probability_or_a_percentage() {
        for (text, expected) in [("0.9", 0.9), ("90%", 0.9), ("90", 0.9), ("99.99", 0.9999), ("0.5", 0.5)] {
            assert!((confidence(text).unwrap() - expected).abs() < 1e-12, "{text}");
        }
        for text in ["0.4", "1", "5", "49", "100", "100%", "-90", "nan"] {
            assert!(confidence(text).is_err(), "{text}");
        }
    }

    #[test]
    fn times_have_a_unit_or_are_seconds() {
        assert_eq!(["1.5", "1.5s", "250ms", "0"].map(|t| time(t).unwrap()), [1.5, 1.5, 0.25, 0.0]);
        for text in ["-1", "ms", "", "1m", "inf", "nan", "1 s s"] {
            assert!(time(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_background_survives_being_written_down() {
        let Ok(Background::Color(c)) = background("#336699") else { panic!("no colour") };
        assert_eq!(background(&color_text(c)), Ok(Background::Color(c)));
        assert_eq!(background("env"), Ok(Background::Environment));
        assert!(background("purplish").unwrap_err().contains("transparent"));
    }
}
