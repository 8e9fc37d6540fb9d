//! Differences of two pictures: numbers, and pictures of the difference.
//!
//! Differences are those of the display codes (sRGB, 0..=1), where equal steps look about equal, or of the linear
//! values. Sums run over rows in order, so that they do not depend on threads. [`flip`](mod@flip) computes how different
//! the pictures look to an eye.

pub mod flip;
mod flip_pictures;
mod layers;

pub use flip_pictures::{FlipResult, PIXELS_PER_DEGREES, looks};
pub use layers::{LayerDifference, layer_differences};

use super::{Picture, srgb};

/// Values that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// Premultiplied linear values, unchanged.
    Linear,
    /// sRGB codes 0..=1 of the colour over black, and coverage. Linear pixels get neither exposure nor tone map: a picture that
    /// was rendered is compared with another one, not with its own PNG.
    Display,
}

/// Difference of two pictures of one size, over all pixels; over three channels, or four where a pixel of either is
/// not fully covered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Number of channels compared: 3 or 4.
    pub channels: u32,
    /// Root mean squared difference.
    pub rmse: f64,
    /// Root mean squared error, relative to the root mean square of the expected values, where values that are not finite
    /// count as 0; infinite where the expected picture is black.
    pub relative_rmse: f64,
    /// Mean of actual less expected values, over the colour channels: error that noise does not explain.
    pub bias: f64,
    /// Largest difference of a channel; infinite where just one of two values is a number.
    pub max: f64,
    /// Column and row of the first pixel with the largest difference.
    pub worst: (u32, u32),
    /// Peak signal-to-noise ratio for a peak of 1, decibels; infinite for equal pictures.
    pub psnr: f64,
    /// Number of pixels with a channel that differs by more than the threshold.
    pub over: u64,
    /// Number of pixels compared.
    pub pixels: u64,
}

/// Compares two pictures; `None` when their sizes differ, or pixels are missing.
pub fn compare(expected: &Picture, actual: &Picture, space: Space, threshold: f64) -> Option<Difference> {
    if !are_alike(expected, actual) {
        return None;
    }
    let channels = if is_covered(expected) && is_covered(actual) { 3 } else { 4 };
    let (mut sum, mut energy, mut bias) = (0.0, 0.0, 0.0);
    let (mut max, mut worst, mut over) = (0.0_f64, 0, 0);
    for (i, (&a, &b)) in expected.beauty.iter().zip(&actual.beauty).enumerate() {
        let (differences, a, b) = (channel_differences(a, b, space), values(a, space), values(b, space));
        let mut most = 0.0_f64;
        for (c, d) in differences.into_iter().enumerate().take(channels) {
            sum += d * d;
            energy += if a[c].is_finite() { a[c] * a[c] } else { 0.0 };
            bias += if c < 3 && d > 0.0 { b[c] - a[c] } else { 0.0 };
            most = most.max(d);
        }
        if most > max {
            (max, worst) = (most, i);
        }
        over += u64::from(most > threshold);
    }
    let pixels = expected.beauty.len();
    let mean = |sum: f64, channels: usize| if pixels == 0 { 0.0 } else { sum / (pixels * channels) as f64 };
    let mse = mean(sum, channels);
    Some(Difference {
        channels: if channels == 3 { 3 } else { 4 },
        rmse: mse.sqrt(),
        relative_rmse: if sum == 0.0 { 0.0 } else { (sum / energy).sqrt() },
        bias: mean(bias, 3),
        max,
        worst: place(worst, expected.width),
        psnr: -10.0 * libm::log10(mse),
        over,
        pixels: pixels as u64,
    })
}

/// Largest difference of a channel, for each pixel of two pictures; `None` when their sizes differ, or pixels are missing.
pub fn greatest(expected: &Picture, actual: &Picture, space: Space) -> Option<Vec<f64>> {
    let pixels = are_alike(expected, actual).then(|| expected.beauty.iter().zip(&actual.beauty))?;
    Some(pixels.map(|(&a, &b)| channel_differences(a, b, space).into_iter().fold(0.0, f64::max)).collect())
}

/// Whether two pictures have the same size and no missing pixels.
fn are_alike(expected: &Picture, actual: &Picture) -> bool {
    let size = |picture: &Picture| (picture.width, picture.height);
    let is_whole = |picture: &Picture| picture.beauty.len() == picture.width as usize * picture.height as usize;
    size(expected) == size(actual) && is_whole(expected) && is_whole(actual)
}

fn is_covered(picture: &Picture) -> bool {
    picture.beauty.iter().all(|p| p[3] == 1.0)
}

#[expect(clippy::cast_possible_truncation, reason = "a picture has at most 2^32 columns and rows")]
fn place(pixel: usize, width: u32) -> (u32, u32) {
    let width = (width as usize).max(1);
    ((pixel % width) as u32, (pixel / width) as u32)
}

fn channel_differences(a: [f32; 4], b: [f32; 4], space: Space) -> [f64; 4] {
    let ((a, steps), (b, _)) = (in_steps(a, space), in_steps(b, space));
    std::array::from_fn(|i| distance(a[i], b[i]) / steps)
}

fn distance(a: f64, b: f64) -> f64 {
    match (a.is_nan(), b.is_nan()) {
        (true, true) => 0.0,
        (false, false) if a == b => 0.0,
        (false, false) => (a - b).abs(),
        _ => f64::INFINITY,
    }
}

/// Values of a pixel that are compared.
pub fn values(pixel: [f32; 4], space: Space) -> [f64; 4] {
    let (values, steps) = in_steps(pixel, space);
    values.map(|value| value / steps)
}

/// Values of a pixel that are compared, and the number of steps that 1 is divided into. 8-bit and 16-bit codes are whole numbers
/// of steps, so that equal differences of codes are equal numbers even after a detour through light.
fn in_steps([r, g, b, a]: [f32; 4], space: Space) -> ([f64; 4], f64) {
    /// Steps from 0 to 1: those of 16-bit codes.
    const STEPS: f64 = 65535.0;
    /// Bound on the error of a code after single-precision light, in steps.
    const ROUNDING: f64 = 0.01;
    let stepped = |code: f64| {
        let (steps, whole) = (code * STEPS, (code * STEPS).round());
        if (steps - whole).abs() < ROUNDING { whole } else { steps }
    };
    let coded = |c: f32| stepped(srgb::encode(f64::from(c).clamp(0.0, 1.0)));
    match space {
        Space::Linear => ([r, g, b, a].map(f64::from), 1.0),
        Space::Display => ([coded(r), coded(g), coded(b), stepped(f64::from(a))], STEPS),
    }
}

/// Places expected, difference and actual side by side; the difference is that of the display codes, times `gain`, on black.
/// Where sizes differ, missing pixels are clear.
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
    Picture::of(width * 3, height, beauty)
}

fn pixel(picture: &Picture, x: u32, y: u32) -> [f32; 4] {
    let inside = x < picture.width && y < picture.height;
    let at = y as usize * picture.width as usize + x as usize;
    if inside { picture.beauty.get(at).copied().unwrap_or_default() } else { [0.0; 4] }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn difference_color(a: [f32; 4], b: [f32; 4], gain: f32) -> [f32; 4] {
    let [r, g, blue, coverage] = channel_differences(a, b, Space::Display).map(|d| d as f32 * gain);
    // Where only the coverage differs, it shows as grey.
    let [r, g, b] = [r, g, blue].map(|c| srgb::decode(f64::from(c.max(coverage).min(1.0))) as f32);
    [r, g, b, 1.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: &[[f32; 4]]) -> Picture {
        Picture::of(pixels.len() as u32, 1, pixels.to_vec())
    }

    #[test]
    fn equal_pictures_differ_by_nothing() {
        let picture = of(&[[0.1, 0.2, 0.3, 1.0], [f32::NAN, f32::INFINITY, 0.0, 0.0]]);
        for space in [Space::Linear, Space::Display] {
            let d = compare(&picture, &picture, space, 0.0).unwrap();
            assert_eq!((d.rmse, d.max, d.psnr, d.over, d.pixels), (0.0, 0.0, f64::INFINITY, 0, 2));
            assert_eq!((d.relative_rmse, d.bias), (0.0, 0.0), "{space:?}");
        }
    }

    #[test]
    fn what_is_infinite_in_both_pictures_hides_nothing_of_the_rest() {
        let [a, b] = [0.5, 1.0].map(|red| of(&[[f32::INFINITY, 0.0, 0.0, 1.0], [red, 0.0, 0.0, 1.0]]));
        let d = compare(&a, &b, Space::Linear, 0.0).unwrap();
        assert_eq!((d.relative_rmse, d.bias), (1.0, 0.5 / 6.0));
        let d = compare(&a, &of(&[[0.0, 0.0, 0.0, 1.0]; 2]), Space::Linear, 0.0).unwrap();
        assert_eq!((d.relative_rmse, d.bias), (f64::INFINITY, f64::NEG_INFINITY));
    }

    #[test]
    fn one_channel_off_gives_the_numbers_by_hand() {
        let (a, b) = (of(&[[0.0; 4], [0.0; 4]]), of(&[[0.0; 4], [0.5, 0.0, 0.0, 0.0]]));
        let d = compare(&a, &b, Space::Linear, 0.4).unwrap();
        // 0.25 over eight values.
        assert!((d.rmse - 0.03125_f64.sqrt()).abs() < 1e-12 && d.max == 0.5 && d.over == 1);
        assert_eq!((d.channels, d.worst, d.bias), (4, (1, 0), 0.5 / 6.0));
        assert!((d.psnr - 15.051_5).abs() < 1e-4);
        assert_eq!(compare(&a, &b, Space::Linear, 0.5).unwrap().over, 0);
        assert!((compare(&a, &b, Space::Display, 0.0).unwrap().max - 0.735_36).abs() < 1e-4);
    }

    #[test]
    fn opaque_pictures_have_three_channels_to_differ_in() {
        let (a, b) = (of(&[[0.5, 0.5, 0.5, 1.0]]), of(&[[0.5, 0.5, 0.2, 1.0]]));
        let d = compare(&a, &b, Space::Linear, 0.0).unwrap();
        assert!((d.rmse - (0.09_f64 / 3.0).sqrt()).abs() < 1e-7 && d.channels == 3);
        assert!((d.relative_rmse - (0.09_f64 / 0.75).sqrt()).abs() < 1e-7 && (d.bias + 0.1).abs() < 1e-7);
        assert_eq!(greatest(&a, &b, Space::Linear).unwrap(), [0.5 - f64::from(0.2_f32)]);
        let black = of(&[[0.0, 0.0, 0.0, 1.0]]);
        assert_eq!(compare(&black, &a, Space::Linear, 0.0).unwrap().relative_rmse, f64::INFINITY);
    }

    #[test]
    fn a_value_that_is_no_number_is_infinitely_wrong() {
        let d = compare(&of(&[[0.0; 4]]), &of(&[[f32::NAN, 0.0, 0.0, 0.0]]), Space::Display, 1e9).unwrap();
        assert_eq!((d.max, d.over), (f64::INFINITY, 1));
    }

    #[test]
    fn codes_that_differ_by_one_differ_alike_whatever_they_are() {
        let of = |first: u8| {
            let pixel = |code: u8| {
                let light = srgb::decode8(code);
                [light, light, light, f32::from(code) / 255.0]
            };
            Picture::of(255, 1, (first..=first + 254).map(pixel).collect())
        };
        let d = compare(&of(0), &of(1), Space::Display, 1.0 / 255.0).unwrap();
        assert_eq!((d.max, d.worst, d.over, d.channels), (1.0 / 255.0, (0, 0), 0, 4));
        assert_eq!(compare(&of(0), &of(1), Space::Display, 0.003_921_5).unwrap().over, 255);
        let wide = |first: u32| {
            let light = |code: u32| srgb::decode(f64::from(code) / 65535.0) as f32;
            Picture::of(65535, 1, (first..first + 65535).map(|code| [light(code), 0.0, 0.0, 1.0]).collect())
        };
        let d = compare(&wide(0), &wide(1), Space::Display, 1.0 / 65535.0).unwrap();
        assert_eq!((d.max, d.over), (1.0 / 65535.0, 0));
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
}
