//! FLIP of whole pictures, also transparent ones.

use super::flip::range::{Exposures, flip_of_any_range};
use super::flip::{Displayed, flip};
use super::{Space, place};
use crate::image::Picture;
use std::ops::RangeInclusive;

/// Viewing conditions allowed, in pixels per degree. At the upper end the visual field spans as many pixels, and filters of
/// that size take minutes; at the lower end a pixel is larger than the visual field.
pub const PIXELS_PER_DEGREES: RangeInclusive<f64> = 0.01..=1000.0;

/// Result of FLIP: how different two pictures look.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipResult {
    /// FLIP of each pixel, 0..=1.
    pub values: Vec<f32>,
    /// Mean of the values.
    pub mean: f64,
    /// Largest value.
    pub max: f64,
    /// Column and row of the first pixel with the largest value.
    pub worst: (u32, u32),
    /// Exposures used for linear pictures.
    pub exposures: Option<Exposures>,
}

/// Computes FLIP of two pictures at `pixels_per_degree`, one of [`PIXELS_PER_DEGREES`]; `None` when their sizes
/// differ, pixels are missing, or `pixels_per_degree` lies outside that range.
///
/// Displayed pictures with transparent parts are compared on black and on white, and the worse of both counts for each
/// pixel. Linear pictures are compared on black, at every exposure that suits them. NaNs are black to their
/// neighbours; a pixel with a NaN in just one picture differs by 1, in both pictures by 0.
pub fn looks(expected: &Picture, actual: &Picture, space: Space, pixels_per_degree: f64) -> Option<FlipResult> {
    let can_be_seen = PIXELS_PER_DEGREES.contains(&pixels_per_degree);
    if !(can_be_seen && super::are_alike(expected, actual)) {
        return None;
    }
    let width = expected.width as usize;
    let (mut values, exposures) = match space {
        Space::Display => {
            let on = |back: f32| {
                let [a, b] = [expected, actual].map(|picture| displayed(picture, back));
                let shown = |pixels| Displayed { width, pixels };
                flip(shown(&a), shown(&b), pixels_per_degree)
            };
            let mut values = on(0.0);
            if [expected, actual].iter().any(|picture| !super::is_covered(picture)) {
                values.iter_mut().zip(on(1.0)).for_each(|(worse, other)| *worse = worse.max(other));
            }
            (values, None)
        }
        Space::Linear => {
            let [a, b] = [expected, actual].map(light);
            let exposures = Exposures::of(&a);
            (flip_of_any_range(width, &a, &b, exposures, pixels_per_degree), Some(exposures))
        }
    };
    let pixels = expected.beauty.iter().zip(&actual.beauty);
    for (value, (a, b)) in values.iter_mut().zip(pixels) {
        match [a, b].map(|pixel| pixel.iter().any(|c| c.is_nan())) {
            [false, false] => {}
            [true, true] => *value = 0.0,
            _ => *value = 1.0,
        }
    }
    let (mut sum, mut max, mut worst) = (0.0, 0.0, 0);
    for (i, &value) in values.iter().enumerate() {
        sum += f64::from(value);
        if f64::from(value) > max {
            (max, worst) = (f64::from(value), i);
        }
    }
    let mean = sum / values.len().max(1) as f64;
    Some(FlipResult { mean, max, worst: place(worst, expected.width), values, exposures })
}

/// Linear pixels over black, NaN as black.
fn light(picture: &Picture) -> Vec<[f32; 3]> {
    picture.beauty.iter().map(|&[r, g, b, _]| [r, g, b].map(|c| if c.is_nan() { 0.0 } else { c })).collect()
}

/// Premultiplied pixels over a grey, as display light, NaN as black.
fn displayed(picture: &Picture, back: f32) -> Vec<[f32; 3]> {
    let shown = |c: f32| if c > 0.0 { c.min(1.0) } else { 0.0 };
    let over = |&[r, g, b, a]: &[f32; 4]| [r, g, b].map(|c| shown(c + back * (1.0 - a)));
    picture.beauty.iter().map(over).collect()
}

#[cfg(test)]
mod tests {
    use super::super::flip::PIXELS_PER_DEGREE;
    use super::*;

    fn grey(width: u32, value: f32, alpha: f32) -> Picture {
        Picture::of(width, width, vec![[value, value, value, alpha]; (width * width) as usize])
    }

    #[test]
    fn transparency_is_seen_though_both_are_alike_on_black() {
        let (clear, black) = (grey(9, 0.0, 0.0), grey(9, 0.0, 1.0));
        let looks = looks(&clear, &black, Space::Display, PIXELS_PER_DEGREE).unwrap();
        assert!(looks.mean > 0.9 && looks.exposures.is_none(), "{}", looks.mean);
    }

    #[test]
    fn nobody_looks_at_pictures_of_two_sizes_or_from_nowhere() {
        let (small, large) = (grey(2, 0.5, 1.0), grey(3, 0.5, 1.0));
        for space in [Space::Display, Space::Linear] {
            let seen = |a: &Picture, b: &Picture, ppd| looks(a, b, space, ppd).is_some();
            assert!(seen(&small, &small, PIXELS_PER_DEGREE) && !seen(&small, &large, PIXELS_PER_DEGREE));
            assert!(!seen(&small, &Picture::of(2, 2, vec![[0.5; 4]; 3]), PIXELS_PER_DEGREE), "a pixel is missing");
            for ppd in [0.0, -5.0, f64::NAN, f64::INFINITY, 1e6] {
                assert!(!seen(&small, &small, ppd), "{ppd}");
            }
        }
    }

    #[test]
    fn the_worst_pixel_is_found() {
        let (a, mut b) = (grey(31, 0.2, 1.0), grey(31, 0.2, 1.0));
        b.beauty[31 * 17 + 4] = [1.0, 0.0, 0.0, 1.0];
        for space in [Space::Display, Space::Linear] {
            let looks = looks(&a, &b, space, PIXELS_PER_DEGREE).unwrap();
            assert_eq!(looks.worst, (4, 17), "{space:?}");
            assert!(looks.max > 0.2 && looks.mean < 0.1 * looks.max);
        }
    }

    #[test]
    fn a_pixel_that_is_no_number_in_one_picture_alone_looks_as_different_as_can_be() {
        let (a, mut b) = (grey(4, 0.5, 1.0), grey(4, 0.5, 1.0));
        b.beauty[6] = [f32::NAN, 0.5, 0.5, 1.0];
        for space in [Space::Display, Space::Linear] {
            let found = looks(&a, &b, space, PIXELS_PER_DEGREE).unwrap();
            assert_eq!((found.max, found.values[6], found.worst), (1.0, 1.0, (2, 1)), "{space:?}");
            assert!(found.values[5] > 0.0, "{space:?}: its neighbours see a black dot");
            assert!(looks(&b, &b, space, PIXELS_PER_DEGREE).unwrap().values.iter().all(|&v| v == 0.0), "{space:?}");
        }
    }
}
