//! Measures one setting: cost, error, and the part of the error that is noise.

use super::reference::{Reference, codes};
use super::{Plan, Setting, Subject};
use crate::bench::clock::Spread;
use crate::image::Picture;
use crate::image::diff::flip::{Displayed, PIXELS_PER_DEGREE, flip};
use crate::image::srgb;
use crate::render::{Settings, render};
use crate::stopwatch::Stopwatch;

/// Half the side of a crop, in pixels.
const CROP: usize = 12;

/// Measurements of one setting.
#[derive(Clone, Debug)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// CPU seconds of a rendering, all threads together.
    pub cpu: Spread,
    /// Wall-clock seconds of a rendering.
    pub wall: Spread,
    /// Mean number of primary rays per pixel.
    pub samples: f64,
    /// Error of the renderings.
    pub error: Error,
    /// Crop around the pixel with the greatest error.
    pub crop: Crop,
}

/// Error of renderings, in display codes 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// Root mean square error of a rendering, with the reference's own error subtracted.
    pub rmse: f64,
    /// Detection limit: a smaller error cannot be distinguished from 0, because of the reference's own error.
    pub least: f64,
    /// Deviation of a rendering from the mean of all, which more samples lessen.
    pub noise: f64,
    /// Deviation of the mean of all from the reference, which more samples do not lessen.
    pub bias: f64,
    /// Greatest error of a channel of the first rendering.
    pub max: f64,
    /// Mean FLIP of the first rendering, over black.
    pub flip: f64,
    /// Column and row of the greatest error.
    pub worst: (u32, u32),
}

impl Error {
    /// Upper bound of [`Self::rmse`], given the detection limit.
    pub fn known(&self) -> f64 {
        self.rmse.max(self.least)
    }

    /// Formats [`Self::rmse`] with `digits` decimals, as `<` the detection limit where it is below.
    pub fn formatted(&self, digits: usize) -> String {
        let (sign, error) = (if self.rmse < self.least { "<" } else { "" }, self.known());
        let rounded = format!("{error:.digits$}");
        // A non-zero value must not be rounded to zero.
        let is_lost = error > 0.0 && rounded.bytes().all(|digit| matches!(digit, b'0' | b'.'));
        if is_lost { format!("{sign}{error:.1e}") } else { format!("{sign}{rounded}") }
    }
}

/// Square of pixels around the worst one, displayed over black.
#[derive(Clone, Debug, PartialEq)]
pub struct Crop {
    /// Crop of the reference.
    pub expected: Picture,
    /// Crop of the first rendering.
    pub actual: Picture,
}

pub(super) fn measure(subject: &Subject, plan: &Plan, reference: &Reference, setting: Setting) -> Row {
    let accel = subject.accel.clone().tested_by(setting.test);
    let (mut cpu, mut wall, mut samples) = (Spread::default(), Spread::default(), 0.0);
    let mut pictures = Vec::new();
    for pass in 0..plan.renderings() {
        let settings = Settings { seed: plan.seed.wrapping_add(u64::from(pass)), ..setting.settings.clone() };
        let watch = Stopwatch::of_all_threads();
        let rendered = render(&subject.job(&settings, &accel), &());
        let spent = watch.read();
        // Fall back to wall-clock time where the system does not report CPU time.
        cpu.push(if spent.cpu.is_zero() { spent.wall } else { spent.cpu }.as_secs_f64());
        wall.push(spent.wall.as_secs_f64());
        samples = rendered.sampled.samples();
        pictures.push(codes(&rendered.picture, subject));
    }
    let error = error(reference, &pictures);
    let crop = Crop {
        expected: cut(reference.width, &reference.pixels, error.worst),
        actual: cut(reference.width, &pictures[0], error.worst),
    };
    Row { setting, cpu, wall, samples, error, crop }
}

/// Part of the reference's estimated own error that serves as detection limit.
const TOLD: f64 = 0.5;

/// Error of one setting; `pictures` are its renderings, at least two.
fn error(reference: &Reference, pictures: &[Vec<[f64; 4]>]) -> Error {
    let channels = reference.channels();
    let n = pictures.len() as f64;
    let (mut squares, mut variance) = (0.0, 0.0);
    let (mut max, mut worst) = (0.0_f64, 0);
    for (i, expected) in reference.pixels.iter().enumerate() {
        for c in 0..channels {
            let mean = pictures.iter().map(|picture| picture[i][c]).sum::<f64>() / n;
            for picture in pictures {
                squares += (picture[i][c] - expected[c]) * (picture[i][c] - expected[c]) / n;
                variance += (picture[i][c] - mean) * (picture[i][c] - mean) / (n - 1.0);
            }
            let off = (pictures[0][i][c] - expected[c]).abs();
            if off > max {
                (max, worst) = (off, i);
            }
        }
    }
    let values = (reference.pixels.len() * channels).max(1) as f64;
    let noise = variance / values;
    // The error is no less than the spread of the pictures around their mean, even if the reference's own error is large.
    let square = (squares / values - reference.error * reference.error).max(noise * (n - 1.0) / n);
    let place = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
    let width = (reference.width as usize).max(1);
    Error {
        rmse: square.sqrt(),
        least: TOLD * reference.error,
        noise: noise.sqrt(),
        bias: (square - noise).max(0.0).sqrt(),
        max,
        flip: looks(reference, &pictures[0]),
        worst: (place(worst % width), place(worst / width)),
    }
}

fn looks(reference: &Reference, picture: &[[f64; 4]]) -> f64 {
    let [a, b] = [&reference.pixels[..], picture].map(|pixels| pixels.iter().map(light).collect::<Vec<_>>());
    let shown = |pixels| Displayed { width: reference.width as usize, pixels };
    let values = flip(shown(&a), shown(&b), PIXELS_PER_DEGREE);
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len().max(1) as f64
}

#[expect(clippy::cast_possible_truncation, reason = "a colour")]
fn light(&[r, g, b, _]: &[f64; 4]) -> [f32; 3] {
    [r, g, b].map(|code| srgb::decode(code) as f32)
}

/// Crops the pixels around a position, clipped at the borders.
fn cut(width: u32, pixels: &[[f64; 4]], (x, y): (u32, u32)) -> Picture {
    let columns = width as usize;
    let rows = pixels.len().checked_div(columns).unwrap_or(0);
    let around = |at: u32, end: usize| {
        let from = (at as usize).saturating_sub(CROP).min(end.saturating_sub(2 * CROP));
        from..(from + 2 * CROP).min(end)
    };
    let (across, down) = (around(x, columns), around(y, rows));
    let count = |range: &std::ops::Range<usize>| u32::try_from(range.len()).unwrap_or(0);
    let (width, height) = (count(&across), count(&down));
    let opaque = |pixel: &[f64; 4]| {
        let [r, g, b] = light(pixel);
        [r, g, b, 1.0]
    };
    let beauty = down.flat_map(|y| across.clone().map(move |x| y * columns + x)).map(|i| opaque(&pixels[i])).collect();
    Picture::of(width, height, beauty)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference(error: f64) -> Reference {
        Reference { width: 40, pixels: vec![[0.5, 0.5, 0.5, 1.0]; 40 * 30], is_transparent: false, error, samples: 1 }
    }

    fn all(code: f64) -> Vec<[f64; 4]> {
        vec![[code, code, code, 1.0]; 40 * 30]
    }

    #[test]
    fn noise_and_bias_are_told_apart() {
        let noisy = error(&reference(0.0), &[all(0.4), all(0.6)]);
        // The two deviate by 0.1 from their mean; the variance estimated from two pictures is twice that squared.
        assert!((noisy.rmse - 0.1).abs() < 1e-12 && noisy.bias < 1e-9 && noisy.noise > 0.1);
        let biased = error(&reference(0.0), &[all(0.4), all(0.4)]);
        assert!((biased.bias - 0.1).abs() < 1e-12 && biased.noise == 0.0 && biased.flip > 0.0);
        let both = error(&reference(0.0), &[all(0.8), all(0.7), all(0.6)]);
        assert!((both.rmse.powi(2) - both.noise.powi(2) - both.bias.powi(2)).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_nothing_is_not_told_as_nothing() {
        let told = |rmse: f64, least: f64| Error { rmse, least, ..error(&reference(0.0), &[all(0.5)]) }.formatted(4);
        assert_eq!([told(0.012_34, 0.0), told(0.0, 0.0), told(1e-6, 0.0)], ["0.0123", "0.0000", "1.0e-6"]);
        assert_eq!([told(0.0, 0.002), told(0.0, 2.5e-9)], ["<0.0020", "<2.5e-9"]);
    }

    #[test]
    fn a_reference_that_is_off_makes_no_error_smaller_than_how_far_pictures_lie_apart() {
        let found = error(&reference(0.2), &[all(0.4), all(0.6)]);
        assert!((found.rmse - 0.1).abs() < 1e-12, "{}", found.rmse);
    }

    #[test]
    fn the_error_of_the_reference_is_taken_off() {
        let found = error(&reference(0.06), &[all(0.4), all(0.4)]);
        assert!((found.rmse - 0.08).abs() < 1e-12);
        assert_eq!(error(&reference(0.2), &[all(0.4), all(0.4)]).rmse, 0.0);
    }

    #[test]
    fn an_error_far_below_that_of_the_reference_is_told_as_less_than_can_be_known() {
        let told = |off: f64| error(&reference(off), &[all(0.4), all(0.4)]).formatted(4);
        assert_eq!([0.0, 0.06, 0.099].map(told), ["0.1000", "0.0800", "<0.0495"]);
    }

    #[test]
    fn the_worst_pixel_is_cut_out_with_what_is_around_it() {
        let mut picture = all(0.5);
        picture[29 * 40 + 2][1] = 1.0;
        let found = error(&reference(0.0), &[picture.clone(), picture.clone()]);
        assert_eq!((found.worst, found.max), ((2, 29), 0.5));
        let crop = cut(40, &picture, found.worst);
        assert_eq!((crop.width, crop.height), (24, 24));
        assert!(crop.beauty[23 * 24 + 2][1] > 0.99 && crop.beauty[0][1] < 0.3);
        assert_eq!(cut(3, &picture[..9], (1, 1)).beauty.len(), 9);
    }
}
