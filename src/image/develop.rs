//! Linear pixels -> coded samples for display formats: un-premultiply, expose, tone map, composite over the background,
//! apply the sRGB curve. Rows are independent, so the result does not depend on threads.

use super::srgb;
use super::{Output, Picture};
use crate::math::simd::{Kernel, LANES, Level, Simd};
use rayon::prelude::*;

/// Coded samples, rows from the top, 3 (opaque) or 4 channels per pixel; alpha is straight.
pub(super) struct Raster<T> {
    /// Columns.
    pub(super) width: u32,
    /// Rows.
    pub(super) height: u32,
    /// Channels per pixel, 3 or 4.
    pub(super) channels: u32,
    /// `width × height × channels` samples.
    pub(super) samples: Vec<T>,
}

/// Pixels developed together: enough that loops over them are vectorized; loops over fewer would be unrolled.
const TOGETHER: usize = 64;

/// One channel of [`TOGETHER`] pixels.
type Channel = [f32; TOGETHER];

/// A coded sample: 8 or 16 bits.
pub(super) trait Sample: Copy + Default + Eq + Send + Sync {
    /// The largest code.
    const MAX: Self;
    /// The largest code, as `f32`.
    const STEPS: f32;
    /// Codes of linear light on the sRGB curve.
    fn codes(linear: &Channel) -> [Self; TOGETHER];
    /// Code of a coverage 0..=1; not on the sRGB curve.
    fn alpha(coverage: f32) -> Self;
    /// That code before its fraction is cut off.
    #[inline(always)]
    fn uncut(coverage: f32) -> f32 {
        coverage.clamp(0.0, 1.0) * Self::STEPS + 0.5
    }
    /// Whether the coverage has the largest code.
    #[inline(always)]
    fn is_solid(coverage: f32) -> bool {
        Self::uncut(coverage) >= Self::STEPS
    }
}

impl Sample for u8 {
    const MAX: Self = Self::MAX;
    const STEPS: f32 = 255.0;
    #[inline(always)]
    fn codes(linear: &Channel) -> [Self; TOGETHER] {
        srgb::encode8_lanes(linear)
    }
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range, and the cast maps NaN to 0")]
    fn alpha(coverage: f32) -> Self {
        Self::uncut(coverage) as Self
    }
}

impl Sample for u16 {
    const MAX: Self = Self::MAX;
    const STEPS: f32 = 65_535.0;
    #[inline(always)]
    fn codes(linear: &Channel) -> [Self; TOGETHER] {
        let codes = srgb::codes16();
        linear.map(|light| codes.code(light))
    }
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range, and the cast maps NaN to 0")]
    fn alpha(coverage: f32) -> Self {
        Self::uncut(coverage) as Self
    }
}

/// Develops a whole picture.
pub(super) fn raster<T: Sample>(picture: &Picture, output: &Output) -> Raster<T> {
    let width = (picture.width as usize).max(1);
    // Without early exit from a row, so that the loop is vectorized.
    let is_opaque = |row: &[[f32; 4]]| row.iter().fold(true, |all, p| all & T::is_solid(p[3]));
    let opaque = output.background.is_some() || picture.beauty.par_chunks(width).all(is_opaque);
    let channels = if opaque { 3 } else { 4 };
    let mut samples = vec![T::default(); picture.beauty.len() * channels];
    let rows = samples.par_chunks_mut(width * channels).zip(picture.beauty.par_chunks(width));
    let (developer, level) = (&Developer::new(output), Level::best());
    if output.background.is_some() && picture.veil.len() == picture.beauty.len() {
        let rows = rows.zip(picture.veil.par_chunks(width));
        rows.for_each(|((out, row), veil)| level.run(Row::<T, 3> { developer, row, veil: Some(veil), out }));
    } else {
        rows.for_each(|(out, row)| match opaque {
            true => level.run(Row::<T, 3> { developer, row, veil: None, out }),
            false => level.run(Row::<T, 4> { developer, row, veil: None, out }),
        });
    }
    Raster { width: picture.width, height: picture.height, channels: if opaque { 3 } else { 4 }, samples }
}

/// Pixels as an 8-bit PNG would hold them: sRGB codes and straight alpha, rows from the top.
pub fn rgba8(picture: &Picture, output: &Output) -> Vec<[u8; 4]> {
    let Raster { channels, samples, .. } = raster::<u8>(picture, output);
    if channels == 4 {
        return samples.as_chunks().0.to_vec();
    }
    samples.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, u8::MAX]).collect()
}

/// Kernel that develops one row.
struct Row<'a, T, const CHANNELS: usize> {
    developer: &'a Developer<'a>,
    row: &'a [[f32; 4]],
    /// The row of [`Picture::veil`], where there is glass before a background.
    veil: Option<&'a [[f32; 4]]>,
    out: &'a mut [T],
}

impl<T: Sample, const CHANNELS: usize> Kernel for Row<'_, T, CHANNELS> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let blocks = self.out.as_chunks_mut::<CHANNELS>().0.chunks_mut(TOGETHER).zip(self.row.chunks(TOGETHER));
        let put = |out: &mut [[T; CHANNELS]], coded: &[[T; TOGETHER]; 4]| {
            for (i, out) in out.iter_mut().enumerate().take(TOGETHER) {
                *out = std::array::from_fn(|c| coded[c][i]);
            }
        };
        if let Some(veil) = self.veil {
            for ((out, pixels), veil) in blocks.zip(veil.chunks(TOGETHER)) {
                let mut lanes = columns(s, pixels);
                let veils: [Channel; 4] =
                    std::array::from_fn(|c| std::array::from_fn(|i| veil.get(i).map_or(0.0, |veil| veil[c])));
                self.developer.develop_glass(&mut lanes, &veils);
                put(out, &coded::<T, CHANNELS>(&lanes));
            }
            return;
        }
        let (mut last, mut last_coded) = ([[f32::NAN; 4]; TOGETHER], [[T::default(); TOGETHER]; 4]);
        for (out, pixels) in blocks {
            // Large parts of a picture are one colour: reuse the codes of equal pixels.
            if last[..pixels.len()] != *pixels {
                last[..pixels.len()].copy_from_slice(pixels);
                let mut lanes = columns(s, &last);
                self.developer.develop(&mut lanes);
                last_coded = coded::<T, CHANNELS>(&lanes);
            }
            put(out, &last_coded);
        }
    }
}

/// Transposes at most [`TOGETHER`] pixels into one array per channel.
#[inline(always)]
fn columns<S: Simd>(s: S, pixels: &[[f32; 4]]) -> [Channel; 4] {
    let mut columns = [[0.0; TOGETHER]; 4];
    for (k, eight) in pixels.chunks(LANES).enumerate().take(TOGETHER / LANES) {
        let rows = s.columns(std::array::from_fn(|i| &eight[i.min(eight.len() - 1)]));
        for (column, row) in columns.iter_mut().zip(rows) {
            column.as_chunks_mut().0[k] = s.store(row);
        }
    }
    columns
}

/// Codes of display light and, with 4 channels, of coverage.
#[inline(always)]
fn coded<T: Sample, const CHANNELS: usize>([r, g, b, coverage]: &[Channel; 4]) -> [[T; TOGETHER]; 4] {
    let alpha = if CHANNELS == 4 { coverage.map(T::alpha) } else { [T::MAX; TOGETHER] };
    [T::codes(r), T::codes(g), T::codes(b), alpha]
}

/// The steps of development for one pixel.
pub(crate) struct Developer<'a> {
    output: &'a Output,
    gain: f32,
}

impl<'a> Developer<'a> {
    /// Hoists what depends on the settings out of the loop over pixels.
    pub(crate) fn new(output: &'a Output) -> Self {
        Self { output, gain: libm::exp2f(output.exposure) }
    }

    /// sRGB codes 0..=1, times coverage, and coverage of a premultiplied linear pixel; within 6·10⁻⁷.
    pub(crate) fn coded(&self, pixel: [f32; 4]) -> [f32; 4] {
        let mut lanes = pixel.map(|c| [c]);
        self.coded_lanes(&mut lanes);
        lanes.map(|[c]| c)
    }

    /// [`Self::coded`] with the light of the background that comes through glass.
    pub(crate) fn coded_through_glass(&self, pixel: [f32; 4], veil: [f32; 4]) -> [f32; 4] {
        let mut lanes = pixel.map(|c| [c]);
        self.coded_glass(&mut lanes, &veil.map(|c| [c]));
        lanes.map(|[c]| c)
    }

    /// [`Self::coded`] for pixels side by side, as one array per channel.
    #[inline(always)]
    pub(crate) fn coded_lanes<const N: usize>(&self, pixels: &mut [[f32; N]; 4]) {
        self.develop(pixels);
        self.code(pixels);
    }

    /// [`Self::coded_lanes`] with the light of the background that comes through glass ([`Picture::veil`]).
    #[inline(always)]
    pub(crate) fn coded_glass<const N: usize>(&self, pixels: &mut [[f32; N]; 4], veil: &[[f32; N]; 4]) {
        self.develop_glass(pixels, veil);
        self.code(pixels);
    }

    #[inline(always)]
    fn code<const N: usize>(&self, pixels: &mut [[f32; N]; 4]) {
        let [r, g, b, coverage] = pixels;
        for channel in [r, g, b] {
            for i in 0..N {
                channel[i] = srgb::curve(channel[i]) * coverage[i];
            }
        }
    }

    /// Display light (linear, straight, 0..=1) and coverage of a premultiplied linear pixel.
    pub(super) fn pixel(&self, pixel: [f32; 4]) -> [f32; 4] {
        let mut lanes = pixel.map(|c| [c]);
        self.develop(&mut lanes);
        lanes.map(|[c]| c)
    }

    /// Develops premultiplied linear pixels side by side, as one array per channel.
    #[inline(always)]
    fn develop<const N: usize>(&self, pixels: &mut [[f32; N]; 4]) {
        let [r, g, b, coverage] = pixels;
        let (mut weight, mut light) = ([1.0; N], [[0.0; N]; 3]);
        for i in 0..N {
            let part = if coverage[i] > 0.0 { coverage[i] } else { 0.0 };
            coverage[i] = if part < 1.0 { part } else { 1.0 };
            // Light without coverage (a glint on clear glass) adds to what is behind it; straight alpha cannot hold it.
            weight[i] = if part > 0.0 { coverage[i] } else { 1.0 };
            let scale = self.gain / weight[i];
            (light[0][i], light[1][i], light[2][i]) = (r[i] * scale, g[i] * scale, b[i] * scale);
        }
        self.output.tone_map.map_lanes(&mut light);
        // No branch in the loops, so that they are vectorized.
        let Some(behind) = self.output.background else {
            let covered = *coverage;
            for (channel, light) in [r, g, b].into_iter().zip(&light) {
                *channel = std::array::from_fn(|i| if covered[i] > 0.0 { light[i] } else { 0.0 });
            }
            return;
        };
        let clear = coverage.map(|coverage| 1.0 - coverage);
        for ((channel, light), behind) in [r, g, b].into_iter().zip(&light).zip(behind) {
            *channel = std::array::from_fn(|i| light[i] * weight[i] + behind * clear[i]);
        }
        *coverage = [1.0; N];
    }

    /// Develops pixels where glass stands before the background. The light of a surface that covers part of a pixel is developed
    /// as if it covered all of it, then weighted by coverage. Glass that shows a lamp covers next to nothing, and its own light
    /// may be brighter than that weight allows: in proportion to the part of glass, the unweighted development is used.
    #[inline(always)]
    fn develop_glass<const N: usize>(&self, pixels: &mut [[f32; N]; 4], veil: &[[f32; N]; 4]) {
        let mut shown = [[0.0; N]; 3];
        for (shown, channel) in shown.iter_mut().zip(&*pixels) {
            (0..N).for_each(|i| shown[i] = channel[i] * self.gain);
        }
        self.output.tone_map.map_lanes(&mut shown);
        let (covered, behind) = (pixels[3], self.output.background.unwrap_or_default());
        self.develop(pixels);
        let [.., glass] = veil;
        for (c, ((channel, shown), veil)) in pixels.iter_mut().zip(&shown).zip(veil).enumerate() {
            for i in 0..N {
                let part = covered[i].clamp(0.0, 1.0);
                let more = shown[i] + behind[c] * (1.0 - part) - channel[i];
                channel[i] += if more > 0.0 { more * glass[i] } else { 0.0 } + veil[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::ToneMap;

    fn one(pixel: [f32; 4], output: &Output) -> (u32, Vec<u8>) {
        let picture = Picture::of(1, 1, vec![pixel]);
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
        // A sum of sample weights may miss 1 by a rounding error.
        assert_eq!(one([0.5, 0.0, 1.0, 1.0_f32.next_down()], &plain()).0, 3);
    }

    #[test]
    fn what_is_shown_on_a_screen_has_straight_alpha_whether_or_not_the_file_would() {
        let (opaque, half) = ([1.0, 0.0, 0.0, 1.0], [0.5, 0.0, 0.0, 0.5]);
        let shown = |pixels: Vec<[f32; 4]>| rgba8(&Picture::of(pixels.len() as u32, 1, pixels), &plain());
        assert_eq!(shown(vec![opaque]), [[255, 0, 0, 255]]);
        assert_eq!(shown(vec![half, opaque]), [[255, 0, 0, 128], [255, 0, 0, 255]]);
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
    fn glass_takes_its_colour_off_the_background_at_every_exposure_and_shows_lamps() {
        for exposure in [-3.0, 0.0, 3.0] {
            let output = Output { exposure, background: Some([0.5; 3]), ..Output::default() };
            // Red glass that transmits 1, 0.2 and 0.2, and clear glass with a lamp in it.
            let light = 44.0 * libm::exp2f(-exposure);
            let beauty = vec![[0.0, 0.0, 0.0, 0.8], [light, light, light, 0.08]];
            let veil = vec![[0.4, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]];
            let raster: Raster<u8> = raster(&Picture { width: 2, height: 1, beauty, layers: None, veil }, &output);
            let (glass, lamp) = raster.samples.split_at(3);
            assert_eq!(glass, [0.5, 0.1, 0.1].map(srgb::encode8), "{exposure}");
            assert!(lamp.iter().all(|&c| c > 250), "{lamp:?}");
        }
    }

    #[test]
    fn edges_of_what_is_bright_and_solid_look_alike_with_glass_elsewhere() {
        let output = Output { background: Some([0.1; 3]), ..Output::default() };
        let beauty = vec![[2.5, 5.0, 10.0, 0.5], [1.0, 1.0, 1.0, 1.0], [0.3, 0.0, 0.0, 0.01]];
        let of = |veil| -> Vec<u8> {
            raster(&Picture { width: 3, height: 1, beauty: beauty.clone(), layers: None, veil }, &output).samples
        };
        assert_eq!(of(vec![[0.0; 4]; 3]), of(Vec::new()));
    }

    #[test]
    fn sixteen_bits_hold_finer_steps() {
        let beauty = vec![[0.125, 0.125_02, 0.0, 0.25]];
        let picture = Picture::of(1, 1, beauty);
        let raster: Raster<u16> = raster(&picture, &plain());
        assert_eq!(raster.samples[3], 16_384);
        assert_ne!(raster.samples[0], raster.samples[1]);
    }
}
