//! FLIP: how different two pictures look to somebody who alternates between them.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images" (2020); for linear pictures of any range P. Andersson, J. Nilsson, P. Shirley, T. Akenine-Möller,
//! "Visualizing Errors in Rendered High Dynamic Range Images" (2021).
//!
//! Each pixel gets a value from 0 (no visible difference) to 1. Colours are filtered as the eye does from a given
//! distance, and compared in a perceptually uniform space (`color`); edges and points are detected and compared
//! (`features`), and their difference raises that of the colours.

mod color;
mod features;
mod filter;
pub mod range;

use rayon::prelude::*;

/// Pixels per degree of the visual field, for a screen of 3840 columns and 0.7 m, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// A displayed picture: linear Rec. 709, 0..=1, rows from the top.
#[derive(Clone, Copy, Debug)]
pub struct Displayed<'a> {
    /// Columns.
    pub width: usize,
    /// `width × height` pixels.
    pub pixels: &'a [[f32; 3]],
}

/// FLIP of each pixel; both pictures have the same size.
pub fn flip(reference: Displayed, test: Displayed, pixels_per_degree: f64) -> Vec<f32> {
    let [seen, other] = [reference, test].map(|picture| color::perceived(picture, pixels_per_degree));
    let [marks, others] = [reference, test].map(|picture| features::features(picture, pixels_per_degree));
    let most = color::largest_difference();
    let colors = seen.par_iter().zip(&other).map(|(&a, &b)| color::difference(a, b, most));
    let features = marks.par_iter().zip(&others).map(|(&a, &b)| features::difference(a, b));
    colors.zip(features).map(|(color, feature)| libm::powf(color, 1.0 - feature)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::srgb;
    use crate::math::random::Random;

    /// Smooth shades, an edge, a dot and noise: everything that the metric detects.
    fn picture(width: u32, height: u32, seed: u64) -> Vec<[u8; 3]> {
        let mut random = Random::new(seed);
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        places
            .map(|(x, y)| {
                let noise = (random.unit() * 24.0) as u8;
                let edge = if x > width / 2 { 90 } else { 0 };
                let dot = if seed > 1 && (x, y) == (width / 4, height / 3) { 60 } else { 0 };
                [x as u8 + noise + 2 * dot, (y * 2) as u8 + edge / 2 + dot, 40 + noise + edge]
            })
            .collect()
    }

    fn linear(codes: &[[u8; 3]]) -> Vec<[f32; 3]> {
        codes.iter().map(|pixel| pixel.map(srgb::decode8)).collect()
    }

    fn of(width: u32, reference: &[[u8; 3]], test: &[[u8; 3]]) -> Vec<f32> {
        let (a, b) = (linear(reference), linear(test));
        let shown = |pixels| Displayed { width: width as usize, pixels };
        flip(shown(&a), shown(&b), PIXELS_PER_DEGREE)
    }

    #[test]
    fn values_are_those_of_the_authors_program() {
        let (width, height) = (61, 47);
        let (a, b) = (picture(width, height, 1), picture(width, height, 2));
        let image = |codes: &[[u8; 3]]| nv_flip::FlipImageRgb8::with_data(width, height, codes.as_flattened());
        let expected = nv_flip::flip(image(&a), image(&b), PIXELS_PER_DEGREE as f32).to_vec();
        let ours = of(width, &a, &b);
        let worst = ours.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        let most = expected.iter().copied().fold(0.0, f32::max);
        assert!(worst < 1e-4 && most > 0.1, "{worst} of {most}");
    }

    #[test]
    fn equal_pictures_look_equal_and_opposite_ones_as_different_as_can_be() {
        let a = picture(20, 20, 1);
        assert!(of(20, &a, &a).iter().all(|&x| x == 0.0));
        let (green, blue) = ([[0, 255, 0]; 400], [[0, 0, 255]; 400]);
        assert!(of(20, &green, &blue).iter().all(|&x| (x - 1.0).abs() < 1e-5));
    }

    #[test]
    fn a_dot_is_seen_where_it_is_and_less_from_afar() {
        let grey = vec![[120; 3]; 41 * 41];
        let mut dotted = grey.clone();
        dotted[20 * 41 + 20] = [255; 3];
        let near = of(41, &grey, &dotted);
        let most = near.iter().copied().fold(0.0, f32::max);
        assert!(near[20 * 41 + 20] == most && near[0] == 0.0, "{most}");
        let (a, b) = (linear(&grey), linear(&dotted));
        let shown = |pixels| Displayed { width: 41, pixels };
        let far = flip(shown(&a), shown(&b), 4.0 * PIXELS_PER_DEGREE);
        assert!(far[20 * 41 + 20] < 0.5 * most);
    }

    #[test]
    fn a_picture_of_one_pixel_or_none_has_values_too() {
        assert!((of(1, &[[0; 3]], &[[255; 3]])[0] - 1.0).abs() < 0.1);
        assert!(of(0, &[], &[]).is_empty());
    }
}
