//! FLIP of linear pictures of any range: the largest difference over all exposures at which somebody may view them.

use super::{Displayed, flip};
use crate::image::tone::luminance;
use rayon::prelude::*;

/// Curve of K. Narkowicz, "ACES Filmic Tone Mapping Curve" (2015), with its exposure of 0.6: three coefficients of the
/// numerator and three of the denominator.
const CURVE: [f64; 6] = [2.51 * 0.36, 0.03 * 0.6, 0.0, 2.43 * 0.36, 0.59 * 0.6, 0.14];

/// Display value of the brightest pixel at the darkest exposure, and of the median pixel at the brightest.
const BRIGHT: f64 = 0.85;

/// Exposures, in stops: from the one at which the brightest pixel of the reference is just not blown out, to the one at
/// which its median pixel is not; where that is black, the median of the pixels that are not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The darkest exposure.
    pub first: f64,
    /// The brightest exposure.
    pub last: f64,
    /// Number of exposures, at equal distances.
    pub count: u32,
}

impl Exposures {
    /// Largest exposure, in stops either way; nobody views a picture beyond it.
    const MOST: f64 = 40.0;

    /// Exposures for a picture, linear Rec. 709.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a few tens")]
    pub fn of(reference: &[[f32; 3]]) -> Self {
        let mut lights: Vec<f32> = reference.iter().map(|&p| luminance(p)).filter(|y| y.is_finite()).collect();
        lights.sort_unstable_by(f32::total_cmp);
        let lit = &lights[lights.partition_point(|&y| y <= 0.0)..];
        let Some(&most) = lit.last() else { return Self { first: 0.0, last: 0.0, count: 1 } };
        let median = Some(middle(&lights)).filter(|&y| y > 0.0).unwrap_or_else(|| middle(lit));
        let stops = |light: f64| libm::log2(shown_at(BRIGHT) / light).clamp(-Self::MOST, Self::MOST);
        let most = f64::from(most);
        let (first, last) = (stops(most), stops(median));
        Self { first, last, count: ((last - first).ceil() as u32).max(2) }
    }

    /// The `k`th exposure, counted from 0.
    pub fn stops(&self, k: u32) -> f64 {
        self.first + (self.last - self.first) * f64::from(k) / f64::from(self.count.max(2) - 1)
    }
}

/// Median of a sorted, non-empty list: the mean of the two in the middle.
fn middle(sorted: &[f32]) -> f64 {
    let n = sorted.len();
    0.5 * (f64::from(sorted[(n - 1) / 2]) + f64::from(sorted[n / 2]))
}

/// FLIP of each pixel: the maximum over all exposures. Both pictures have `width` columns and one size, linear Rec. 709.
pub fn flip_of_any_range(
    width: usize,
    reference: &[[f32; 3]],
    test: &[[f32; 3]],
    exposures: Exposures,
    pixels_per_degree: f64,
) -> Vec<f32> {
    let mut worst = vec![0.0_f32; reference.len()];
    for k in 0..exposures.count {
        let gain = libm::exp2(exposures.stops(k));
        let [a, b] = [reference, test].map(|pixels| developed(pixels, gain));
        let shown = |pixels| Displayed { width, pixels };
        let values = flip(shown(&a), shown(&b), pixels_per_degree);
        worst.iter_mut().zip(values).for_each(|(worst, value)| *worst = worst.max(value));
    }
    worst
}

#[expect(clippy::cast_possible_truncation, reason = "single precision is enough for a colour")]
fn developed(pixels: &[[f32; 3]], gain: f64) -> Vec<[f32; 3]> {
    pixels.par_iter().map(|pixel| pixel.map(|c| curve(f64::from(c) * gain) as f32)).collect()
}

fn curve(x: f64) -> f64 {
    let [a, b, c, d, e, f] = CURVE;
    // Negative light is black; beyond any display, infinity included, the curve is flat.
    let x = x.clamp(0.0, 1e6);
    (((a * x + b) * x + c) / ((d * x + e) * x + f)).clamp(0.0, 1.0)
}

/// Inverse of the curve: light that is displayed as `value`, which is greater than 0.
fn shown_at(value: f64) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|k: usize| CURVE[k] - value * CURVE[k + 3]);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_run_from_the_brightest_to_the_median_pixel() {
        assert!((curve(shown_at(BRIGHT)) - BRIGHT).abs() < 1e-12);
        let grey = |y: f32| [y; 3];
        let exposures = Exposures::of(&[grey(0.0), grey(0.5), grey(1.0), grey(1.0), grey(16.0)]);
        assert!((exposures.last - exposures.first - 4.0).abs() < 1e-6 && exposures.count == 4, "{exposures:?}");
        assert!((curve(16.0 * libm::exp2(exposures.stops(0))) - BRIGHT).abs() < 1e-6);
        assert!((curve(libm::exp2(exposures.stops(3))) - BRIGHT).abs() < 1e-6);
        assert_eq!(Exposures::of(&[grey(0.0)]).count, 1);
        // As the authors' program computes them: black pixels count, and of two in the middle the mean.
        let stops = |lights: &[f32]| {
            let Exposures { first, last, .. } = Exposures::of(&lights.iter().map(|&y| grey(y)).collect::<Vec<_>>());
            [first, last].map(|stops| (1000.0 * stops).round())
        };
        assert_eq!(stops(&[0.1, 0.2, 0.4, 0.8]), [1405.0, 2820.0]);
        assert_eq!(stops(&[0.01, 0.01, 1.0, 1.0]), [1083.0, 2069.0]);
        // Mostly black.
        assert_eq!(stops(&[0.0, 0.0, 0.0, 1.0]), [1083.0, 1083.0]);
    }

    #[test]
    fn differences_among_highlights_and_in_the_dark_are_both_seen() {
        let mut reference = vec![[0.01_f32; 3]; 64 * 64];
        reference[..64 * 16].fill([200.0; 3]);
        let exposures = Exposures::of(&reference);
        let differing = |rows: std::ops::Range<usize>, to: f32| {
            let mut test = reference.clone();
            test[64 * rows.start..64 * rows.end].fill([to; 3]);
            let values = flip_of_any_range(64, &reference, &test, exposures, super::super::PIXELS_PER_DEGREE);
            (values[64 * 4 + 32], values[64 * 56 + 32])
        };
        let (bright, dark) = differing(0..8, 100.0);
        assert!(bright > 0.05 && dark == 0.0, "{bright} {dark}");
        let (bright, dark) = differing(48..64, 0.02);
        assert!(bright == 0.0 && dark > 0.05, "{bright} {dark}");
    }

    #[test]
    fn values_that_are_no_numbers_do_no_harm() {
        let reference = [[1.0; 3], [f32::INFINITY; 3], [f32::NAN, 0.0, 0.0], [-1.0; 3]];
        let exposures = Exposures::of(&reference);
        let values = flip_of_any_range(2, &reference, &[[1.0; 3]; 4], exposures, super::super::PIXELS_PER_DEGREE);
        assert_eq!(values.len(), 4);
    }
}
