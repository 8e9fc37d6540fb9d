//! Linear pixels -> coded samples for display formats: un-premultiply, expose, tone map, lay the background behind,
//! apply the sRGB curve. Rows are independent, so threads do not show in the result.

use super::srgb::{self, Codes};
use super::{Output, Picture};
use rayon::prelude::*;

/// Coded samples, rows from the top, 3 (opaque) or 4 channels each pixel; alpha is straight.
pub(super) struct Raster<T> {
    /// Columns.
    pub(super) width: u32,
    /// Rows.
    pub(super) height: u32,
    /// 3 or 4.
    pub(super) channels: u32,
    /// `width × height × channels` samples.
    pub(super) samples: Vec<T>,
}

/// A coded sample: 8 or 16 bits.
pub(super) trait Sample: Copy + Default + Eq + Send + Sync {
    /// The largest code.
    const MAX: Self;
    /// The table of its sRGB codes.
    fn codes() -> &'static Codes;
    /// A code of that table.
    fn narrow(code: u16) -> Self;
    /// Code of a coverage 0..=1; not on the sRGB curve.
    fn alpha(coverage: f32) -> Self;
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range, and the cast maps NaN to 0")]
impl Sample for u8 {
    const MAX: Self = Self::MAX;
    fn codes() -> &'static Codes {
        srgb::codes8()
    }
    fn narrow(code: u16) -> Self {
        code as Self
    }
    fn alpha(coverage: f32) -> Self {
        (coverage.clamp(0.0, 1.0) * 255.0 + 0.5) as Self
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range, and the cast maps NaN to 0")]
impl Sample for u16 {
    const MAX: Self = Self::MAX;
    fn codes() -> &'static Codes {
        srgb::codes16()
    }
    fn narrow(code: u16) -> Self {
        code
    }
    fn alpha(coverage: f32) -> Self {
        (coverage.clamp(0.0, 1.0) * 65_535.0 + 0.5) as Self
    }
}

/// Develops a whole picture.
pub(super) fn raster<T: Sample>(picture: &Picture, output: &Output) -> Raster<T> {
    let developer = Developer::new(output);
    let opaque = output.background.is_some() || picture.beauty.par_iter().all(|p| T::alpha(p[3]) == T::MAX);
    let channels = if opaque { 3 } else { 4 };
    let codes = T::codes();
    let width = picture.width as usize;
    let mut samples = vec![T::default(); picture.beauty.len() * channels];
    let rows = samples.par_chunks_mut((width * channels).max(1)).zip(picture.beauty.par_chunks(width.max(1)));
    rows.for_each(|(out, row)| {
        let mut last = ([f32::NAN; 4], [T::default(); 4]);
        for (coded, &pixel) in out.chunks_exact_mut(channels).zip(row) {
            // Large parts of a picture are one colour.
            if pixel != last.0 {
                let [r, g, b, a] = developer.pixel(pixel);
                let [r, g, b] = [r, g, b].map(|c| T::narrow(codes.code(c)));
                last = (pixel, [r, g, b, T::alpha(a)]);
            }
            coded.copy_from_slice(&last.1[..channels]);
        }
    });
    Raster { width: picture.width, height: picture.height, channels: if opaque { 3 } else { 4 }, samples }
}

/// The steps for one pixel.
pub(super) struct Developer<'a> {
    output: &'a Output,
    gain: f32,
}

impl<'a> Developer<'a> {
    /// Takes what depends on the settings out of the loop over pixels.
    pub(super) fn new(output: &'a Output) -> Self {
        Self { output, gain: libm::exp2f(output.exposure) }
    }

    /// Display light (linear, straight, 0..=1) and coverage of a premultiplied linear pixel.
    pub(super) fn pixel(&self, [r, g, b, coverage]: [f32; 4]) -> [f32; 4] {
        let coverage = if coverage > 0.0 { coverage.min(1.0) } else { 0.0 };
        // Light without coverage (a glint on clear glass) adds to what is behind it; straight alpha cannot hold it.
        let weight = if coverage > 0.0 { coverage } else { 1.0 };
        let scale = self.gain / weight;
        let color = self.output.tone_map.map([r, g, b].map(|c| c * scale));
        match self.output.background {
            None if coverage > 0.0 => [color[0], color[1], color[2], coverage],
            None => [0.0; 4],
            Some(behind) => {
                let over = |i: usize| color[i] * weight + behind[i] * (1.0 - coverage);
                [over(0), over(1), over(2), 1.0]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::ToneMap;

    fn one(pixel: [f32; 4], output: &Output) -> (u32, Vec<u8>) {
        let picture = Picture { width: 1, height: 1, beauty: vec![pixel], layers: None };
        let raster = raster(&picture, output);
        (raster.channels, raster.samples)
    }

    fn plain() -> Output {
        Output { tone_map: ToneMap::None, ..Output::default() }
    }

    #[test]
    fn an_edge_pixel_keeps_the_colour_of_the_surface() {
        // Half covered by light 0.5, premultiplied.
        assert_eq!(one([0.25, 0.25, 0.25, 0.5], &plain()), (4, vec![188, 188, 188, 128]));
    }

    #[test]
    fn opaque_pictures_have_no_alpha_channel() {
        assert_eq!(one([0.5, 0.0, 1.0, 1.0], &plain()), (3, vec![188, 0, 255]));
        // A sum of sample weights may miss 1 by a rounding.
        assert_eq!(one([0.5, 0.0, 1.0, 1.0_f32.next_down()], &plain()).0, 3);
    }

    #[test]
    fn a_white_background_stays_white_under_every_tone_map() {
        for tone_map in ToneMap::ALL {
            let output = Output { tone_map, exposure: -3.0, background: Some([1.0; 3]), ..Output::default() };
            assert_eq!(one([0.0; 4], &output), (3, vec![255; 3]), "{tone_map}");
        }
    }

    #[test]
    fn a_background_is_mixed_in_linear_light_after_the_tone_map() {
        let output = Output { tone_map: ToneMap::Reinhard, background: Some([0.0, 0.0, 1.0]), ..Output::default() };
        // Straight white becomes 0.5, half of it over half a blue: 0.25, 0.25, 0.75.
        assert_eq!(one([0.5, 0.5, 0.5, 0.5], &output), (3, vec![137, 137, 225]));
    }

    #[test]
    fn exposure_counts_in_stops() {
        let output = Output { exposure: -1.0, ..plain() };
        assert_eq!(one([1.0, 0.5, 0.0, 1.0], &output).1, vec![188, srgb::encode8(0.25), 0]);
    }

    #[test]
    fn empty_pixels_are_black_and_clear_and_odd_ones_harmless() {
        assert_eq!(one([0.0; 4], &plain()), (4, vec![0; 4]));
        assert_eq!(one([0.5, 0.5, 0.5, 0.0], &plain()), (4, vec![0; 4]));
        assert_eq!(one([f32::NAN; 4], &plain()), (4, vec![0; 4]));
        assert_eq!(one([f32::INFINITY, f32::NAN, -1.0, 2.0], &plain()), (3, vec![255, 0, 0]));
    }

    #[test]
    fn light_without_coverage_adds_to_the_background() {
        let output = Output { background: Some([0.25; 3]), ..plain() };
        assert_eq!(one([0.25, 0.0, 0.0, 0.0], &output).1, vec![188, 137, 137]);
    }

    #[test]
    fn sixteen_bits_hold_finer_steps() {
        let beauty = vec![[0.125, 0.125_02, 0.0, 0.25]];
        let picture = Picture { width: 1, height: 1, beauty, layers: None };
        let raster: Raster<u16> = raster(&picture, &plain());
        assert_eq!(raster.samples[3], 16_384);
        assert_ne!(raster.samples[0], raster.samples[1]);
    }
}
