//! Edges and points in the luminance, as receptive fields of the eye detect them.

use super::Displayed;
use super::filter::{Along, Taps, bell, filtered, places};
use rayon::prelude::*;

/// Width of a feature, in degrees of the visual field.
const WIDTH: f64 = 0.082;

/// Strengths of the edge and of the point at a pixel.
pub(super) type Features = [f32; 2];

/// Features of each pixel.
pub(super) fn features(picture: Displayed, pixels_per_degree: f64) -> Vec<Features> {
    let (smooth, slope, bend) = curves(pixels_per_degree);
    let every = |f: &dyn Fn(usize) -> [f32; 4]| (0..smooth.len()).map(f).collect::<Taps<4>>();
    let light: Vec<[f32; 4]> = picture.pixels.par_iter().map(|&p| [luminance(p); 4]).collect();
    let rows = every(&|k| [slope[k], bend[k], smooth[k], smooth[k]]);
    let columns = every(&|k| [smooth[k], smooth[k], slope[k], bend[k]]);
    let across = filtered(picture.width, &light, &rows, Along::Rows);
    let both = filtered(picture.width, &across, &columns, Along::Columns);
    let length = |a: f32, b: f32| (a * a + b * b).sqrt();
    both.into_par_iter()
        .map(|[edge_x, point_x, edge_y, point_y]| [length(edge_x, edge_y), length(point_x, point_y)])
        .collect()
}

/// Difference of features, 0..=1.
pub(super) fn difference(a: Features, b: Features) -> f32 {
    let most = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    (most * std::f32::consts::FRAC_1_SQRT_2).sqrt()
}

/// A Gaussian, its first and its second derivative; positive weights sum to 1, negative ones to −1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few tens; weights are single")]
fn curves(pixels_per_degree: f64) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
    let sigma = 0.5 * WIDTH * pixels_per_degree;
    let radius = (3.0 * sigma).ceil() as usize;
    let bell = bell(sigma, radius);
    let slope = places(radius).zip(&bell).map(|(x, g)| -x * g).collect();
    let bend = places(radius).zip(&bell).map(|(x, g)| (x * x / (sigma * sigma) - 1.0) * g).collect();
    let single = |curve: Vec<f64>| balanced(curve).into_iter().map(|x| x as f32).collect();
    (single(bell), single(slope), single(bend))
}

fn balanced(curve: Vec<f64>) -> Vec<f64> {
    let above: f64 = curve.iter().filter(|&&x| x > 0.0).sum();
    let below: f64 = -curve.iter().filter(|&&x| x < 0.0).sum::<f64>();
    curve
        .into_iter()
        .map(|x| {
            if x > 0.0 {
                x / above
            } else if x < 0.0 {
                x / below
            } else {
                0.0
            }
        })
        .collect()
}

fn luminance([r, g, b]: [f32; 3]) -> f32 {
    crate::image::tone::luminance([r, g, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_an_edge_and_an_even_area_is_nothing() {
        let half: Vec<[f32; 3]> = (0..41 * 41).map(|k| if k % 41 < 20 { [0.0; 3] } else { [1.0; 3] }).collect();
        let found = features(Displayed { width: 41, pixels: &half }, super::super::PIXELS_PER_DEGREE);
        let [edge, point] = found[20 * 41 + 20];
        assert!(edge > 0.9 && point < edge, "{edge} {point}");
        let [edge, point] = found[20 * 41 + 1];
        assert!(edge < 1e-5 && point < 1e-5, "{edge} {point}");
    }

    #[test]
    fn weights_balance() {
        let (smooth, slope, bend) = curves(67.0);
        assert!((smooth.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        for curve in [slope, bend] {
            assert!(curve.iter().sum::<f32>().abs() < 1e-5);
            assert!((curve.iter().map(|x| x.abs()).sum::<f32>() - 2.0).abs() < 1e-5);
        }
    }
}
