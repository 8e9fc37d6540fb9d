//! Decodes stored texels to linear values.
//!
//! The sRGB curve of IEC 61966-2-1, tabulated for every stored value, so that a lookup is exact and needs no `pow`.

use super::ColorSpace;
use crate::math::Vec4;
use crate::scene::{Bitmap, Pixels};
use std::sync::LazyLock;

/// Linear value of each 8-bit sRGB value.
static SRGB8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f64 / 255.0)));

/// Each 8-bit value divided by 255.
static UNIT8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| narrow(i as f64 / 255.0)));

/// Linear value of each 8-bit sRGB value, in units of 2⁻¹² steps of 1/65535: the sum of four fits 32 bits.
static FIXED_SRGB8: LazyLock<[u32; 256]> = LazyLock::new(|| std::array::from_fn(|i| fixed(i as f64 / 255.0)));

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 65535 · 2¹²")]
fn fixed(s: f64) -> u32 {
    (curve(s) * 65535.0 * f64::from(1 << FRACTION) + 0.5) as u32
}

/// Number of fractional bits in the values of [`fixed8`].
pub(super) const FRACTION: u32 = 12;

/// Linear value of each stored 8-bit colour, in units of 2⁻¹² steps of 1/65535.
pub(super) fn fixed8(space: ColorSpace) -> &'static [u32; 256] {
    match space {
        ColorSpace::Srgb | ColorSpace::SrgbCutOut => &FIXED_SRGB8,
        ColorSpace::Linear => &FIXED_UNIT8,
    }
}

/// Stored 8-bit data values (not colours), in the units of [`fixed8`].
static FIXED_UNIT8: [u32; 256] = {
    let (mut table, mut i) = ([0; 256], 0);
    while i < 256 {
        table[i as usize] = (i * 257) << FRACTION;
        i += 1;
    }
    table
};

/// Linear value of each 16-bit sRGB value; computed when the first such bitmap is read.
static SRGB16: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=u16::MAX).map(|i| linear_from_srgb(f64::from(i) / 65535.0)).collect());

/// sRGB curve for one channel, 0…1 to 0…1.
fn linear_from_srgb(s: f64) -> f32 {
    narrow(curve(s))
}

fn curve(s: f64) -> f64 {
    if s <= 0.04045 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) }
}

#[expect(clippy::cast_possible_truncation, reason = "texels are f32")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// Stored texels of a bitmap, row by row, with their interpretation.
#[derive(Clone, Copy)]
pub(super) enum Texels<'a> {
    /// With the decoding table of colours.
    Rgb8(&'a [[u8; 3]], &'static [f32; 256]),
    /// With the decoding table of colours.
    Rgba8(&'a [[u8; 4]], &'static [f32; 256]),
    Rgba16(&'a [[u16; 4]], ColorSpace),
}

impl<'a> Texels<'a> {
    /// Texels of a bitmap, in one colour space.
    #[inline]
    pub(super) fn new(bitmap: &'a Bitmap, space: ColorSpace) -> Self {
        match &bitmap.pixels {
            Pixels::Rgb8(texels) => Self::Rgb8(texels.as_chunks().0, table8(space)),
            Pixels::Rgba8(texels) => Self::Rgba8(texels, table8(space)),
            Pixels::Rgba16(texels) => Self::Rgba16(texels, space),
        }
    }

    /// Linear RGBA of texel `index`; opaque white where there is none. Alpha is never curved.
    #[inline(always)]
    pub(super) fn get(self, index: usize) -> Vec4 {
        match self {
            Self::Rgb8(texels, colors) => texels.get(index).map_or(Vec4::ONE, |&texel| solid8(texel, colors)),
            Self::Rgba8(texels, colors) => texels.get(index).map_or(Vec4::ONE, |&texel| decode8(texel, colors)),
            Self::Rgba16(texels, space) => texels.get(index).map_or(Vec4::ONE, |&texel| decode16(texel, space)),
        }
    }
}

/// Linear value of each 8-bit colour.
fn table8(space: ColorSpace) -> &'static [f32; 256] {
    match space {
        ColorSpace::Srgb | ColorSpace::SrgbCutOut => &SRGB8,
        ColorSpace::Linear => &UNIT8,
    }
}

/// Linear RGBA of a texel, its colours looked up.
#[inline(always)]
pub(super) fn decode8([r, g, b, a]: [u8; 4], colors: &[f32; 256]) -> Vec4 {
    let color = |c: u8| colors[usize::from(c)];
    Vec4::new(color(r), color(g), color(b), unit8(a))
}

/// An 8-bit data value (not a colour), 0 … 1: the same as a table would hold, since the quotient in `f64` is never so near the
/// middle of two `f32` that it matters.
#[inline(always)]
pub(super) fn unit8(code: u8) -> f32 {
    f32::from(code) / 255.0
}

/// A 16-bit data value (not a colour), 0 … 1.
#[inline(always)]
pub(super) fn unit16(code: u16) -> f32 {
    f32::from(code) / 65535.0
}

/// Like [`decode8`], for a texel without alpha.
#[inline(always)]
pub(super) fn solid8([r, g, b]: [u8; 3], colors: &[f32; 256]) -> Vec4 {
    let color = |c: u8| colors[usize::from(c)];
    Vec4::new(color(r), color(g), color(b), 1.0)
}

#[inline]
fn decode16([r, g, b, a]: [u16; 4], space: ColorSpace) -> Vec4 {
    match space {
        ColorSpace::Linear => Vec4::new(unit16(r), unit16(g), unit16(b), unit16(a)),
        ColorSpace::Srgb | ColorSpace::SrgbCutOut => {
            let color = |c: u16| SRGB16[usize::from(c)];
            Vec4::new(color(r), color(g), color(b), unit16(a))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_meets_its_published_values() {
        assert_eq!((SRGB8[0], SRGB8[255]), (0.0, 1.0));
        // The middle grey of the standard, and both sides of the joint between line and power.
        assert!((SRGB8[188] - 0.502_886).abs() < 1e-6);
        assert!((SRGB8[10] - 0.003_035_27).abs() < 1e-8 && (SRGB8[11] - 0.003_346_536).abs() < 1e-8);
    }

    #[test]
    fn eight_and_sixteen_bits_of_one_colour_decode_alike() {
        for i in 0..=255u8 {
            let wide = u16::from(i) * 257;
            for space in [ColorSpace::Srgb, ColorSpace::Linear] {
                let (a, b) = (decode8([i; 4], table8(space)), decode16([wide; 4], space));
                assert!((a - b).abs().max_element() < 1e-7, "{i} {space:?}: {a} {b}");
            }
        }
    }

    #[test]
    fn every_alpha_is_its_share_of_255_rounded_once() {
        for i in 0..=255u8 {
            assert_eq!(decode8([0, 0, 0, i], table8(ColorSpace::Srgb)).w.to_bits(), UNIT8[usize::from(i)].to_bits());
        }
    }

    #[test]
    fn alpha_is_linear_in_both_spaces() {
        assert_eq!(decode8([0, 0, 0, 51], table8(ColorSpace::Srgb)).w, 0.2);
        assert_eq!(decode8([0, 0, 0, 51], table8(ColorSpace::Linear)).w, 0.2);
    }
}
