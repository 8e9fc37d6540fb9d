//! Statistics of a developed picture (too dark, blown out, empty?), and the developed picture itself.

use super::develop::Developer;
use super::{Output, Picture, ToneMap, srgb, tone};

/// Statistics of a developed picture where it is covered: is it too dark, blown out, empty?
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureStatistics {
    /// Fraction of pixels with any coverage.
    pub coverage: f64,
    /// Mean luma (Rec. 709 weights of the sRGB codes, 0..=1), weighted by coverage.
    pub mean_luminance: f64,
    /// Fraction of the covered pixels with a channel at its largest 8-bit code.
    pub clipped: f64,
    /// Number of pixels with a NaN.
    pub not_numbers: u64,
}

/// Computes the statistics of a picture through the tone map and exposure of `output`, without its background.
pub fn look(picture: &Picture, output: &Output) -> PictureStatistics {
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
    PictureStatistics {
        coverage: ratio(covered, picture.beauty.len() as u64),
        mean_luminance: if weight > 0.0 { luma / weight } else { 0.0 },
        clipped: ratio(clipped, covered),
        not_numbers,
    }
}

/// Choices that show a picture's values unchanged.
pub fn as_is() -> Output {
    Output { tone_map: ToneMap::None, ..Output::default() }
}

/// Develops a picture into display light, through the tone map and exposure of `output`: premultiplied, 0..=1, plus the light of
/// a known background that comes through glass.
pub fn developed(picture: &Picture, output: &Output) -> Picture {
    let output = Output { background: None, ..output.clone() };
    let developer = Developer::new(&output);
    let pixel = |(i, &p): (usize, &[f32; 4])| {
        let [r, g, b, a] = developer.pixel(p);
        let [x, y, z, _] = picture.veil.get(i).copied().unwrap_or_default();
        [r * a + x, g * a + y, b * a + z, a]
    };
    Picture::of(picture.width, picture.height, picture.beauty.iter().enumerate().map(pixel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: &[[f32; 4]]) -> Picture {
        Picture::of(pixels.len() as u32, 1, pixels.to_vec())
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
