//! How different two pictures are, and what a picture is like: numbers, and a picture of the difference.
//!
//! Differences are those of the display codes (sRGB, 0..=1), where equal steps look about equal, or of the linear
//! values. Sums run over rows in order, so that they do not depend on threads.

use super::develop::Developer;
use super::{Output, Picture, ToneMap, srgb, tone};

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// Premultiplied linear values as they are.
    Linear,
    /// sRGB codes 0..=1 of the colour over black, and coverage.
    Display,
}

/// How different two pictures of one size are, over all pixels and four channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Largest difference of a channel; infinite where just one of two values is a number.
    pub max: f64,
    /// Peak signal-to-noise ratio for a peak of 1, decibels; infinite for equal pictures.
    pub psnr: f64,
    /// Pixels with a channel that differs by more than the threshold.
    pub over: u64,
    /// Pixels compared.
    pub pixels: u64,
}

/// Compares two pictures; `None` when their sizes differ.
pub fn compare(expected: &Picture, actual: &Picture, space: Space, threshold: f64) -> Option<Difference> {
    if (expected.width, expected.height, expected.beauty.len()) != (actual.width, actual.height, actual.beauty.len()) {
        return None;
    }
    let (mut sum, mut max, mut over) = (0.0, 0.0_f64, 0);
    for (&a, &b) in expected.beauty.iter().zip(&actual.beauty) {
        let mut worst = 0.0_f64;
        for d in channel_differences(a, b, space) {
            sum += d * d;
            worst = worst.max(d);
        }
        max = max.max(worst);
        over += u64::from(worst > threshold);
    }
    let pixels = expected.beauty.len() as u64;
    let mse = if pixels == 0 { 0.0 } else { sum / (pixels * 4) as f64 };
    Some(Difference { rmse: mse.sqrt(), max, psnr: -10.0 * libm::log10(mse), over, pixels })
}

fn channel_differences(a: [f32; 4], b: [f32; 4], space: Space) -> [f64; 4] {
    let (a, b) = match space {
        Space::Linear => (a.map(f64::from), b.map(f64::from)),
        Space::Display => (display(a), display(b)),
    };
    std::array::from_fn(|i| match (a[i].is_nan(), b[i].is_nan()) {
        (true, true) => 0.0,
        (false, false) if a[i] == b[i] => 0.0,
        (false, false) => (a[i] - b[i]).abs(),
        _ => f64::INFINITY,
    })
}

fn display([r, g, b, a]: [f32; 4]) -> [f64; 4] {
    let coded = |c: f32| srgb::encode(f64::from(c).clamp(0.0, 1.0));
    [coded(r), coded(g), coded(b), f64::from(a)]
}

/// Expected, difference, actual, side by side; the difference is that of the display codes, `gain` times, on black.
/// Where sizes differ, what is missing is clear.
pub fn side_by_side(expected: &Picture, actual: &Picture, gain: f32) -> Picture {
    let (width, height) = (expected.width.max(actual.width), expected.height.max(actual.height));
    let mut beauty = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..height {
        let row = |picture: &Picture| (0..width).map(|x| pixel(picture, x, y)).collect::<Vec<_>>();
        let (left, right) = (row(expected), row(actual));
        beauty.extend(&left);
        beauty.extend(left.iter().zip(&right).map(|(&a, &b)| difference_color(a, b, gain)));
        beauty.extend(&right);
    }
    Picture { width: width * 3, height, beauty, layers: None }
}

fn pixel(picture: &Picture, x: u32, y: u32) -> [f32; 4] {
    let inside = x < picture.width && y < picture.height;
    let at = y as usize * picture.width as usize + x as usize;
    if inside { picture.beauty.get(at).copied().unwrap_or_default() } else { [0.0; 4] }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn difference_color(a: [f32; 4], b: [f32; 4], gain: f32) -> [f32; 4] {
    let [r, g, blue, coverage] = channel_differences(a, b, Space::Display).map(|d| d as f32 * gain);
    // Where only the coverage differs, grey shows it.
    [r, g, blue].map(|c| srgb::decode(f64::from(c.max(coverage).min(1.0))) as f32).into_rgba()
}

/// A colour with full coverage.
trait IntoRgba {
    fn into_rgba(self) -> [f32; 4];
}

impl IntoRgba for [f32; 3] {
    fn into_rgba(self) -> [f32; 4] {
        [self[0], self[1], self[2], 1.0]
    }
}

/// What a developed picture is like where it is covered: is it too dark, blown out, empty?
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Fraction of pixels with any coverage.
    pub coverage: f64,
    /// Mean luma (Rec. 709 weights of the sRGB codes, 0..=1), weighted by coverage.
    pub mean_luminance: f64,
    /// Fraction of the covered pixels with a channel at its largest 8-bit code.
    pub clipped: f64,
    /// Pixels with a value that is no number.
    pub not_numbers: u64,
}

/// Looks at a picture through the tone map and exposure of `output`, without its background.
pub fn look(picture: &Picture, output: &Output) -> Look {
    let output = Output { background: None, ..output.clone() };
    let developer = Developer::new(&output);
    let (mut covered, mut clipped, mut not_numbers) = (0_u64, 0_u64, 0);
    let (mut luma, mut weight) = (0.0, 0.0);
    for &p in &picture.beauty {
        not_numbers += u64::from(p.iter().any(|c| c.is_nan()));
        let [r, g, b, a] = developer.pixel(p);
        if a > 0.0 {
            let codes = [r, g, b].map(srgb::encode8);
            covered += 1;
            clipped += u64::from(codes.contains(&255));
            luma += f64::from(a) * f64::from(tone::luminance(codes.map(f32::from))) / 255.0;
            weight += f64::from(a);
        }
    }
    let ratio = |n: u64, of: u64| if of == 0 { 0.0 } else { n as f64 / of as f64 };
    Look {
        coverage: ratio(covered, picture.beauty.len() as u64),
        mean_luminance: if weight > 0.0 { luma / weight } else { 0.0 },
        clipped: ratio(clipped, covered),
        not_numbers,
    }
}

/// The choices that show a picture's values as they are.
pub fn as_is() -> Output {
    Output { tone_map: ToneMap::None, ..Output::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: &[[f32; 4]]) -> Picture {
        Picture { width: pixels.len() as u32, height: 1, beauty: pixels.to_vec(), layers: None }
    }

    #[test]
    fn equal_pictures_differ_by_nothing() {
        let picture = of(&[[0.1, 0.2, 0.3, 1.0], [f32::NAN, f32::INFINITY, 0.0, 0.0]]);
        for space in [Space::Linear, Space::Display] {
            let d = compare(&picture, &picture, space, 0.0).unwrap();
            assert_eq!((d.rmse, d.max, d.psnr, d.over, d.pixels), (0.0, 0.0, f64::INFINITY, 0, 2));
        }
    }

    #[test]
    fn one_channel_off_gives_the_numbers_by_hand() {
        let (a, b) = (of(&[[0.0; 4], [0.0; 4]]), of(&[[0.0; 4], [0.5, 0.0, 0.0, 0.0]]));
        let d = compare(&a, &b, Space::Linear, 0.4).unwrap();
        // 0.25 over eight values.
        assert!((d.rmse - 0.03125_f64.sqrt()).abs() < 1e-12 && d.max == 0.5 && d.over == 1);
        assert!((d.psnr - 15.051_5).abs() < 1e-4);
        assert_eq!(compare(&a, &b, Space::Linear, 0.5).unwrap().over, 0);
        assert!((compare(&a, &b, Space::Display, 0.0).unwrap().max - 0.735_36).abs() < 1e-4);
    }

    #[test]
    fn a_value_that_is_no_number_is_infinitely_wrong() {
        let d = compare(&of(&[[0.0; 4]]), &of(&[[f32::NAN, 0.0, 0.0, 0.0]]), Space::Display, 1e9).unwrap();
        assert_eq!((d.max, d.over), (f64::INFINITY, 1));
    }

    #[test]
    fn sizes_must_agree() {
        assert_eq!(compare(&of(&[[0.0; 4]]), &of(&[[0.0; 4]; 2]), Space::Linear, 0.0), None);
    }

    #[test]
    fn the_difference_picture_shows_both_and_what_lies_between() {
        let (a, b) = (of(&[[1.0; 4], [0.5; 4]]), of(&[[0.0, 1.0, 1.0, 1.0], [0.5; 4]]));
        let all = side_by_side(&a, &b, 1.0);
        assert_eq!((all.width, all.height), (6, 1));
        assert_eq!(all.beauty[2], [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(all.beauty[3], [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(all.beauty[4], b.beauty[0]);
        let uneven = side_by_side(&a, &of(&[[1.0; 4]]), 1.0);
        assert_eq!((uneven.width, uneven.beauty.len(), uneven.beauty[5]), (6, 6, [0.0; 4]));
    }

    #[test]
    fn a_look_counts_only_what_is_covered() {
        let grey = srgb::decode8(128);
        let picture = of(&[[grey, grey, grey, 1.0], [1.0; 4], [0.0; 4], [0.5, 0.0, 0.0, 0.5]]);
        let look = look(&picture, &as_is());
        assert_eq!((look.coverage, look.not_numbers), (0.75, 0));
        assert!((look.clipped - 2.0 / 3.0).abs() < 1e-12);
        let mean = (128.0 / 255.0 + 1.0 + 0.5 * 0.2126) / 2.5;
        assert!((look.mean_luminance - mean).abs() < 1e-6, "{look:?}");
    }
}
