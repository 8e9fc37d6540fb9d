//! FLIP of whole pictures, transparent ones among them.

use super::flip::range::{Exposures, flip_of_any_range};
use super::flip::{Displayed, flip};
use super::{Space, place};
use crate::image::Picture;

/// How different two pictures look.
#[derive(Clone, Debug, PartialEq)]
pub struct Looks {
    /// FLIP of each pixel, 0..=1.
    pub values: Vec<f32>,
    /// Its mean.
    pub mean: f64,
    /// The greatest.
    pub max: f64,
    /// Column and row of the first pixel with that.
    pub worst: (u32, u32),
    /// Exposures that linear pictures were looked at with.
    pub exposures: Option<Exposures>,
}

/// Looks at two pictures of one size, at so many pixels a degree.
///
/// Displayed pictures with transparent parts are looked at on black and on white, and the worse of both counts for each
/// pixel. Linear pictures are looked at on black, at every exposure that suits them.
pub fn looks(expected: &Picture, actual: &Picture, space: Space, pixels_per_degree: f64) -> Looks {
    let width = expected.width as usize;
    let (values, exposures) = match space {
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
            let [a, b] = [expected, actual].map(|p| p.beauty.iter().map(|&[r, g, b, _]| [r, g, b]).collect::<Vec<_>>());
            let exposures = Exposures::of(&a);
            (flip_of_any_range(width, &a, &b, exposures, pixels_per_degree), Some(exposures))
        }
    };
    let (mut sum, mut max, mut worst) = (0.0, 0.0, 0);
    for (i, &value) in values.iter().enumerate() {
        sum += f64::from(value);
        if f64::from(value) > max {
            (max, worst) = (f64::from(value), i);
        }
    }
    let mean = sum / values.len().max(1) as f64;
    Looks { mean, max, worst: place(worst, expected.width), values, exposures }
}

/// Premultiplied pixels over a grey, as light of the display. What is no number is black.
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
        Picture {
            width,
            height: width,
            beauty: vec![[value, value, value, alpha]; (width * width) as usize],
            layers: None,
        }
    }

    #[test]
    fn transparency_is_seen_though_both_are_alike_on_black() {
        let (clear, black) = (grey(9, 0.0, 0.0), grey(9, 0.0, 1.0));
        let looks = looks(&clear, &black, Space::Display, PIXELS_PER_DEGREE);
        assert!(looks.mean > 0.9 && looks.exposures.is_none(), "{}", looks.mean);
    }

    #[test]
    fn the_worst_pixel_is_found() {
        let (a, mut b) = (grey(31, 0.2, 1.0), grey(31, 0.2, 1.0));
        b.beauty[31 * 17 + 4] = [1.0, 0.0, 0.0, 1.0];
        for space in [Space::Display, Space::Linear] {
            let looks = looks(&a, &b, space, PIXELS_PER_DEGREE);
            assert_eq!(looks.worst, (4, 17), "{space:?}");
            assert!(looks.max > 0.2 && looks.mean < 0.1 * looks.max);
        }
    }

    #[test]
    fn values_that_are_no_numbers_are_looked_at_as_black() {
        let (a, b) = (grey(9, f32::NAN, 1.0), grey(9, 0.0, 1.0));
        assert_eq!(looks(&a, &b, Space::Display, PIXELS_PER_DEGREE).max, 0.0);
    }
}
