//! Tone mapping: scene light (0 to infinity) to display light (0 to 1), both linear Rec. 709.
//!
//! Curves: *PBR Neutral* (Khronos Group, 2024), which preserves base colours up to 0.8 and fades highlights to
//! white; *Reinhard* on luminance (Reinhard, Stark, Shirley, Ferwerda, "Photographic Tone Reproduction for Digital
//! Images", 2002); *ACES* as fitted by Stephen Hill (2016) to the reference rendering and Rec. 709 output transforms.

use crate::named::names;

/// Curve from scene light to display light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneMap {
    /// Clamped to 1.
    None,
    /// Luminance L becomes L / (1 + L).
    Reinhard,
    /// Filmic: more contrast, coloured highlights turn white.
    Aces,
    /// Colours preserved up to 0.8, soft highlights.
    #[default]
    Neutral,
}

/// Largest light before the curves; keeps infinities out of them, where they would turn into NaN.
const BRIGHTEST: f32 = 1e12;

/// Luminance weights of linear Rec. 709.
pub const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

names!(ToneMap, "tone map", None => "none", Reinhard => "reinhard", Aces => "aces", Neutral => "neutral");

impl ToneMap {
    /// Display light of a straight (not premultiplied) colour, each channel 0..=1; NaN and negative light are black.
    pub fn map(self, color: [f32; 3]) -> [f32; 3] {
        let mut lanes = color.map(|c| [c]);
        self.map_lanes(&mut lanes);
        lanes.map(|[c]| c)
    }

    /// Maps several colours at once, as one array per channel: without branches, so that the compiler vectorizes the loops, and
    /// each colour comes out as it would alone.
    #[inline(always)]
    pub(super) fn map_lanes<const N: usize>(self, color: &mut [[f32; N]; 3]) {
        hold(color, BRIGHTEST);
        match self {
            Self::None => {}
            Self::Reinhard => reinhard(color),
            Self::Aces => aces(color),
            Self::Neutral => neutral(color),
        }
        hold(color, 1.0);
    }
}

/// Clamps all channels to 0..=`most`.
#[inline(always)]
fn hold<const N: usize>(color: &mut [[f32; N]; 3], most: f32) {
    for channel in color {
        for c in channel {
            *c = within(*c, most);
        }
    }
}

/// Clamps `x` to 0..=`most`; NaN becomes 0. Written so that each comparison is one instruction.
#[inline(always)]
fn within(x: f32, most: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < most { x } else { most }
}

/// The smaller of two numbers that are not NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers that are not NaN.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn reinhard<const N: usize>(color: &mut [[f32; N]; 3]) {
    let [r, g, b] = color;
    for i in 0..N {
        let scale = 1.0 / (1.0 + dot(LUMINANCE, [r[i], g[i], b[i]]));
        (r[i], g[i], b[i]) = (r[i] * scale, g[i] * scale, b[i] * scale);
    }
}

/// Linear Rec. 709 luminance.
pub fn luminance(color: [f32; 3]) -> f32 {
    dot(LUMINANCE, color)
}

#[inline(always)]
fn aces<const N: usize>(color: &mut [[f32; N]; 3]) {
    // Rec. 709 into the rendering space of the fit, and back; rows sum to 1, so that grey stays grey.
    const TO_FIT: [[f32; 3]; 3] =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const FROM_FIT: [[f32; 3]; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let [r, g, b] = color;
    for i in 0..N {
        let color = [r[i], g[i], b[i]];
        let mut fitted = [0.0; 3];
        for (fitted, row) in fitted.iter_mut().zip(TO_FIT) {
            let v = dot(row, color);
            *fitted = (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
        }
        (r[i], g[i], b[i]) = (dot(FROM_FIT[0], fitted), dot(FROM_FIT[1], fitted), dot(FROM_FIT[2], fitted));
    }
}

#[inline(always)]
fn neutral<const N: usize>(color: &mut [[f32; N]; 3]) {
    /// Reflectance of a dielectric at normal incidence: subtracted by the curve, so that a fully lit base colour comes out
    /// unchanged.
    const F90_OFFSET: f32 = 0.04;
    /// Peak below which colours are kept, above which they are compressed.
    const START: f32 = 0.8 - F90_OFFSET;
    /// How fast compressed colours fade to white.
    const DESATURATION: f32 = 0.15;
    const ROOM: f32 = 1.0 - START;
    let [r, g, b] = color;
    for i in 0..N {
        let darkest = smaller(smaller(r[i], g[i]), b[i]);
        let part = darkest - 6.25 * darkest * darkest;
        let offset = if darkest < 2.0 * F90_OFFSET { part } else { F90_OFFSET };
        let (x, y, z) = (r[i] - offset, g[i] - offset, b[i] - offset);
        let peak = greater(greater(x, y), z);
        // Discarded for peaks below the start.
        let new_peak = 1.0 - ROOM * ROOM / (peak + ROOM - START);
        let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
        let (scale, rest) = (new_peak / peak, new_peak * white);
        let kept = peak < START;
        r[i] = if kept { x } else { x * scale * (1.0 - white) + rest };
        g[i] = if kept { y } else { y * scale * (1.0 - white) + rest };
        b[i] = if kept { z } else { z * scale * (1.0 - white) + rest };
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f32; 3], b: [f32; 3], tolerance: f32) -> bool {
        (0..3).all(|i| (a[i] - b[i]).abs() <= tolerance)
    }

    #[test]
    fn neutral_keeps_a_lit_base_colour_but_for_the_dielectric_sheen() {
        assert!(close(ToneMap::Neutral.map([0.5, 0.3, 0.2]), [0.46, 0.26, 0.16], 1e-6));
        // With one black channel nothing is subtracted.
        assert!(close(ToneMap::Neutral.map([0.5, 0.0, 0.2]), [0.5, 0.0, 0.2], 1e-6));
    }

    /// By hand from the published formula: x = 1: offset 0.04, peak 0.96, 1 - 0.24²/0.44; x = 4: 1 - 0.24²/3.44.
    #[test]
    fn neutral_compresses_white_as_published() {
        assert!(close(ToneMap::Neutral.map([1.0; 3]), [1.0 - 0.0576 / 0.44; 3], 1e-6));
        assert!(close(ToneMap::Neutral.map([4.0; 3]), [1.0 - 0.0576 / 3.44; 3], 1e-6));
    }

    /// By hand: (2, 0, 0): no offset, peak 2, new peak 1 - 0.0576/1.48 = 0.961081, white 1 - 1/(0.15·1.038919 + 1).
    #[test]
    fn neutral_fades_a_bright_red_towards_white() {
        let white = 1.0 - 1.0 / (0.15 * 1.038_919 + 1.0);
        assert!(close(ToneMap::Neutral.map([2.0, 0.0, 0.0]), [0.961_081, 0.961_081 * white, 0.961_081 * white], 1e-5));
    }

    #[test]
    fn neutral_is_smooth_where_compression_begins() {
        let (below, above) = (ToneMap::Neutral.map([0.799_99; 3]), ToneMap::Neutral.map([0.800_01; 3]));
        assert!(close(below, above, 3e-5));
    }

    #[test]
    fn aces_keeps_grey_grey_and_black_black() {
        let grey = ToneMap::Aces.map([0.18; 3]);
        assert!((grey[0] - grey[1]).abs() < 1e-4 && (grey[1] - grey[2]).abs() < 1e-4, "{grey:?}");
        // The fit at 0.18 by hand: (0.18·0.2045786 - 0.000090537) / (0.18·(0.983729·0.18 + 0.432951) + 0.238081).
        assert!(close(grey, [0.105_65; 3], 2e-4), "{grey:?}");
        assert_eq!(ToneMap::Aces.map([0.0; 3]), [0.0; 3]);
    }

    #[test]
    fn reinhard_halves_white() {
        assert!(close(ToneMap::Reinhard.map([1.0; 3]), [0.5; 3], 1e-6));
    }

    #[test]
    fn every_curve_rises_and_stays_in_range_whatever_comes_in() {
        for curve in ToneMap::ALL {
            let mut last = -1.0;
            for step in 0..2000 {
                let x = (step as f32 * 0.02 - 20.0).exp2();
                let y = curve.map([x; 3])[1];
                assert!(y >= last - 1e-6 && y <= 1.0, "{curve} at {x}: {y} after {last}");
                last = y;
            }
            for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX] {
                for color in [[odd; 3], [odd, 0.2, 0.0], [0.0, 0.1, odd]] {
                    let out = curve.map(color);
                    assert!(out.iter().all(|c| (0.0..=1.0).contains(c)), "{curve} of {color:?}: {out:?}");
                }
            }
        }
    }

    #[test]
    fn a_colour_comes_out_the_same_beside_others() {
        let values = [0.0, 1e-9, 0.03, 0.0799, 0.08, 0.3, 0.76, 0.81, 1.0, 7.5, 1e9, f32::INFINITY, f32::NAN, -2.0];
        let color = |i: usize| [i, i / 14, i / 196].map(|k| values[k % 14]);
        for curve in ToneMap::ALL {
            for first in (0..14 * 14 * 14).step_by(8) {
                let mut lanes: [[f32; 8]; 3] = [0, 1, 2].map(|c| std::array::from_fn(|i| color(first + i)[c]));
                curve.map_lanes(&mut lanes);
                let [r, g, b] = lanes;
                for (i, beside) in r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).enumerate() {
                    let alone = curve.map(color(first + i));
                    assert_eq!(alone.map(f32::to_bits), beside.map(f32::to_bits), "{curve} {:?}", color(first + i));
                }
            }
        }
    }
}
