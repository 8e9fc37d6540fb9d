//! Colours as the eye sees them from a distance, and their perceived differences.

use super::Displayed;
use super::filter::{Along, bell, filtered};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Rec. 709 to CIE XYZ (ITU-R BT.709 primaries, D65), rows.
const XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// Inverse of [`XYZ`].
const RGB: [[f64; 3]; 3] = [
    [3.241_003_275, -1.537_398_934, -0.498_615_861],
    [-0.969_224_334, 1.875_930_071, 0.041_554_224],
    [0.055_639_423, -0.204_011_202, 1.057_148_933],
];

/// Contrast sensitivity of the eye for luminance, red against green, and blue against yellow: two Gaussians each, as weight
/// and width (table 1 of the paper).
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// Exponent that colour differences are raised to.
const POWER: f32 = 0.7;
/// Knee of the error mapping, as a fraction of the largest difference.
const KNEE: f32 = 0.4;
/// Value of the error mapping at the knee.
const AT_KNEE: f32 = 0.95;

/// Colour of CIE L*a*b*, its chroma reduced where it is dark (R. W. G. Hunt, "Light and dark adaptation and the
/// perception of color", 1952).
pub(super) type Seen = [f32; 3];

/// Perceived colour of each pixel.
pub(super) fn perceived(picture: Displayed, pixels_per_degree: f64) -> Vec<Seen> {
    let (taps, [first, second]) = taps(pixels_per_degree);
    let opponent: Vec<[f32; 4]> = picture.pixels.par_iter().map(|&p| opponent(p)).collect();
    let rows = filtered(picture.width, &opponent, &taps, Along::Rows);
    let blurred = filtered(picture.width, &rows, &taps, Along::Columns);
    blurred.into_par_iter().map(|[y, cx, a, b]| hunt(lab(displayed([y, cx, first * a + second * b])))).collect()
}

/// Difference of two colours, 0..=1; `most` is [`largest_difference`].
pub(super) fn difference(a: Seen, b: Seen, most: f32) -> f32 {
    let d = libm::powf(distance(a, b), POWER);
    let knee = KNEE * most;
    if d < knee { AT_KNEE / knee * d } else { AT_KNEE + (d - knee) / (most - knee) * (1.0 - AT_KNEE) }
}

/// Largest difference of two colours that can be displayed, pure green and pure blue.
pub(super) fn largest_difference() -> f32 {
    libm::powf(distance(hunt(lab([0.0, 1.0, 0.0])), hunt(lab([0.0, 0.0, 1.0]))), POWER)
}

/// Distance of two colours: HyAB of S. Abasi, M. A. Tehran, M. D. Fairchild, "Distance metrics for very large color
/// differences" (2020).
fn distance(a: Seen, b: Seen) -> f32 {
    let chroma = [a[1] - b[1], a[2] - b[2]];
    (a[0] - b[0]).abs() + (chroma[0] * chroma[0] + chroma[1] * chroma[1]).sqrt()
}

/// Filters of luminance, red against green, and both Gaussians of blue against yellow, each of sum 1; and the weights of the
/// latter two.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few tens; weights are single")]
fn taps(pixels_per_degree: f64) -> (Vec<[f32; 4]>, [f32; 2]) {
    let sigma = |width: f64| (width / (2.0 * PI * PI)).sqrt() * pixels_per_degree;
    let widest = SENSITIVITY.iter().flatten().map(|&(_, width)| width).fold(0.0, f64::max);
    let radius = (3.0 * sigma(widest)).ceil() as usize;
    let bells = [SENSITIVITY[0][0], SENSITIVITY[1][0], SENSITIVITY[2][0], SENSITIVITY[2][1]];
    let curves = bells.map(|(_, width)| bell(sigma(width), radius));
    let sums = curves.each_ref().map(|curve| curve.iter().sum::<f64>());
    let taps = (0..=2 * radius).map(|k| [0, 1, 2, 3].map(|n: usize| (curves[n][k] / sums[n]) as f32)).collect();
    // In two dimensions a Gaussian of height h has the sum h · (sum of its curve)².
    let volume = |n: usize| bells[n].0 * (PI / bells[n].1).sqrt() * sums[n] * sums[n];
    let all = volume(2) + volume(3);
    (taps, [(volume(2) / all) as f32, (volume(3) / all) as f32])
}

/// Luminance, red against green and blue against yellow (twice, as it is filtered twice): YCxCz.
fn opponent(pixel: [f32; 3]) -> [f32; 4] {
    let [x, y, z] = relative(pixel);
    let blue = 200.0 * (y - z);
    [116.0 * y - 16.0, 500.0 * (x - y), blue, blue]
}

/// Converts YCxCz to linear Rec. 709, clamped to what a display can show.
#[expect(clippy::cast_possible_truncation, reason = "single precision is enough for a colour")]
fn displayed([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let white = white();
    let xyz = [f64::from(y + cx / 500.0) * white[0], f64::from(y) * white[1], f64::from(y - cz / 200.0) * white[2]];
    RGB.map(|row| dot(row, xyz).clamp(0.0, 1.0) as f32)
}

fn lab(pixel: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let curve =
        |t: f32| if t > DELTA * DELTA * DELTA { libm::cbrtf(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = relative(pixel).map(curve);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn hunt([l, a, b]: [f32; 3]) -> Seen {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// CIE XYZ relative to white.
#[expect(clippy::cast_possible_truncation, reason = "single precision is enough for a colour")]
fn relative(pixel: [f32; 3]) -> [f32; 3] {
    let (pixel, white) = (pixel.map(f64::from), white());
    [0, 1, 2].map(|k: usize| (dot(XYZ[k], pixel) / white[k]) as f32)
}

fn white() -> [f64; 3] {
    XYZ.map(|row| row.iter().sum())
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_to_the_opponent_space_and_back() {
        for pixel in [[0.0; 3], [1.0; 3], [0.2, 0.7, 0.1], [1.0, 0.0, 0.3]] {
            let [y, cx, cz, _] = opponent(pixel);
            let back = displayed([y, cx, cz]);
            assert!(pixel.iter().zip(back).all(|(a, b)| (a - b).abs() < 2e-5), "{pixel:?} {back:?}");
        }
    }

    #[test]
    fn white_and_black_have_the_lightness_of_the_standard() {
        assert!((lab([1.0; 3])[0] - 100.0).abs() < 1e-3 && lab([1.0; 3])[1].abs() < 1e-3);
        assert!(lab([0.0; 3])[0].abs() < 1e-3);
        // Half the light: L* = 116 ∛0.5 − 16.
        assert!((lab([0.5; 3])[0] - 76.069).abs() < 1e-2);
    }

    #[test]
    fn the_filters_lose_no_light() {
        let (taps, [a, b]) = taps(super::super::PIXELS_PER_DEGREE);
        for n in 0..4 {
            assert!((taps.iter().map(|tap| tap[n]).sum::<f32>() - 1.0).abs() < 1e-5);
        }
        assert!((a + b - 1.0).abs() < 1e-6 && a > b && taps.len() == 21);
    }
}
