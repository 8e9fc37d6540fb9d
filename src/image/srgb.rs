//! The sRGB transfer function (IEC 61966-2-1:1999) between linear light and coded values, rounded correctly.
//!
//! Exact codes go by thresholds: code `c` begins at the linear value whose exact code is `c - 1/2`. The thresholds are computed
//! once with `libm`, so the same linear value has the same code on every machine. Most 8-bit codes need none: a polynomial
//! is accurate enough to be sure of them, and thresholds decide the others.

use crate::math::formula::WHOLE;
use std::sync::LazyLock;

/// Coded value (0..=1) of linear light (0..=1).
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// Linear light (0..=1) of a coded value (0..=1).
pub fn decode(coded: f64) -> f64 {
    if coded <= 0.040_45 { coded / 12.92 } else { libm::pow((coded + 0.055) / 1.055, 2.4) }
}

/// Linear light of an 8-bit code.
pub fn decode8(code: u8) -> f32 {
    static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|c| narrow(decode(c as f64 / 255.0))));
    LINEAR[usize::from(code)]
}

/// Linear light of a 16-bit code.
pub fn decode16(code: u16) -> f32 {
    narrow(decode(f64::from(code) / 65_535.0))
}

/// Nearest 8-bit code of linear light; below 0 and NaN give 0, above 1 gives 255.
pub fn encode8(linear: f32) -> u8 {
    #[expect(clippy::cast_possible_truncation, reason = "the table was built for codes up to 255")]
    {
        codes8().code(linear) as u8
    }
}

/// Table of the 8-bit codes.
fn codes8() -> &'static Codes {
    static CODES: LazyLock<Codes> = LazyLock::new(|| Codes::new(255, 16));
    &CODES
}

/// Table of the 16-bit codes.
pub(super) fn codes16() -> &'static Codes {
    static CODES: LazyLock<Codes> = LazyLock::new(|| Codes::new(65_535, 12));
    &CODES
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// Lower bound of each code, and buckets that find the code almost without a search.
pub(super) struct Codes {
    /// `begin[c]` is the smallest linear value of code `c`; `begin[0]` is minus infinity, one past the last is infinity.
    begin: Vec<f32>,
    /// Buckets of linear values that share their leading bits, from `lowest` to 1.
    buckets: Vec<Bucket>,
    /// First value of the first bucket; its code is 0.
    lowest: f32,
    /// Number of bits below a bucket's leading ones.
    shift: u32,
}

struct Bucket {
    /// Code of the bucket's first value.
    code: u16,
    /// Linear value at which the next code begins.
    next: f32,
}

impl Codes {
    fn new(max: u16, shift: u32) -> Self {
        let mut begin = vec![f32::NEG_INFINITY];
        begin.extend((1..=max).map(|c| round_up(decode((f64::from(c) - 0.5) / f64::from(max)))));
        begin.push(f32::INFINITY);
        let low = begin[1].to_bits() >> shift;
        let high = 1.0_f32.to_bits() >> shift;
        let bucket = |bits: u32| {
            let value = f32::from_bits(bits << shift);
            let next = begin.partition_point(|&b| b <= value);
            Bucket { code: u16::try_from(next - 1).unwrap_or(max), next: begin[next] }
        };
        let buckets = (low..=high).map(bucket).collect();
        Self { begin, buckets, lowest: f32::from_bits(low << shift), shift }
    }

    /// Nearest code of linear light.
    #[inline]
    pub(super) fn code(&self, linear: f32) -> u16 {
        // Comparisons that NaN fails, each one instruction.
        let linear = if linear > self.lowest { linear } else { self.lowest };
        let linear = if linear < 1.0 { linear } else { 1.0 };
        let bucket = &self.buckets[((linear.to_bits() - self.lowest.to_bits()) >> self.shift) as usize];
        // Mostly one of two codes. An addition avoids a branch that would be mispredicted.
        let mut code = bucket.code + u16::from(linear >= bucket.next);
        while linear >= self.begin[usize::from(code) + 1] {
            code += 1;
        }
        code
    }
}

/// Smallest `f32` that is not below `x`.
fn round_up(x: f64) -> f32 {
    let near = narrow(x);
    if f64::from(near) < x { near.next_up() } else { near }
}

/// Coded value 0..=1 of linear light, which is clamped to 0..=1, within 6·10⁻⁷; 0 for NaN. Made of a few roots and products,
/// which compilers vectorize, with the same bits everywhere.
#[inline(always)]
pub(super) fn curve(linear: f32) -> f32 {
    /// Linear light below which the curve is straight.
    const STRAIGHT: f32 = 0.003_130_8;
    /// Minimax polynomial in the fourth root for the rest of the curve, found by E. Y. Remez' exchange (1934).
    const OF_ROOT: [f32; 8] = [
        -0.058_446_59,
        0.123_575_87,
        1.461_525_9,
        -1.155_896_4,
        1.209_151_7,
        -0.898_414_6,
        0.394_714_27,
        -0.076_210_52,
    ];
    // Comparisons that NaN fails, each one instruction.
    let light = if linear > 0.0 { linear } else { 0.0 };
    let light = if light < 1.0 { light } else { 1.0 };
    let root = light.sqrt().sqrt();
    let [rest @ .., last] = OF_ROOT;
    let curved = rest.iter().rev().fold(last, |sum, of| sum * root + of);
    if light > STRAIGHT { curved } else { 12.92 * light }
}

/// Nearest 8-bit codes of linear light, as [`encode8`] finds them, side by side.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the lowest bits are the code")]
pub(super) fn encode8_lanes<const N: usize>(linear: &[f32; N]) -> [u8; N] {
    /// Error bound of the curve and of the product's rounding, in codes: 255 · (6·10⁻⁷ + 2⁻²³), and some margin.
    const OFF: f32 = 3e-4;
    let mut codes = [0; N];
    let mut unsure = 0;
    for i in 0..N {
        // Nearest code without a cast, which compilers do not vectorize.
        let code = 255.0 * curve(linear[i]);
        let rounded = code + WHOLE;
        unsure |= u32::from((code - (rounded - WHOLE)).abs() > 0.5 - OFF);
        codes[i] = rounded.to_bits() as u8;
    }
    if unsure != 0 {
        codes = linear.map(encode8);
    }
    codes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encode16(linear: f32) -> u16 {
        codes16().code(linear)
    }

    #[test]
    fn the_formula_is_near_the_curve() {
        for i in 0..200_000 {
            let linear = i as f32 / 199_999.0;
            let linear = linear * linear;
            let error = f64::from(curve(linear)) - encode(f64::from(linear));
            assert!(error.abs() < 6e-7, "{linear}: {error:e}");
        }
        let odd = [-1.0, f32::NAN, f32::NEG_INFINITY].map(curve);
        assert_eq!(odd, [0.0, 0.0, 0.0]);
        assert_eq!([2.0, f32::INFINITY].map(curve), [curve(1.0); 2]);
    }

    #[test]
    fn codes_side_by_side_are_those_of_one_by_one() {
        let odd = [f32::NAN, -0.0, -1.0, f32::NEG_INFINITY, 1e-30, 1.0, 1.000_001, f32::INFINITY];
        assert_eq!(encode8_lanes(&odd), odd.map(encode8));
        // Around each step, where the formula must not decide alone, and between steps.
        for step in
            codes8().begin[1..256].iter().flat_map(|begin| (-40..40).map(|k| (begin.to_bits() as i32 + k) as u32))
        {
            let light = [f32::from_bits(step), f32::from_bits(step + 4000), f32::from_bits(step - 4000)];
            assert_eq!(encode8_lanes(&light), light.map(encode8), "{light:?}");
        }
        for bits in (0x3080_0000..0x3f80_0010_u32).step_by(2_503) {
            let light = [f32::from_bits(bits)];
            assert_eq!(encode8_lanes(&light), light.map(encode8), "{light:?}");
        }
    }

    #[test]
    fn known_values_come_out() {
        for (linear, code) in
            [(0.0, 0), (1.0, 255), (0.5, 188), (0.18, 118), (0.214_041_14, 128), (0.003_035_27, 10), (0.8, 231)]
        {
            assert_eq!(encode8(linear), code, "{linear}");
        }
        assert_eq!(encode16(0.5), 48_192);
        assert_eq!(encode16(1.0), 65_535);
    }

    #[test]
    fn every_code_comes_back() {
        for code in 0..=255 {
            assert_eq!(encode8(decode8(code)), code);
        }
        for code in 0..=65_535 {
            assert_eq!(encode16(decode16(code)), code);
        }
    }

    #[test]
    fn codes_are_the_formula_rounded() {
        // Stride prime to the tables' buckets, over all floats from 2^-30 to just over 1.
        for bits in (0x3080_0000..0x3f80_0010_u32).step_by(2_503) {
            let linear = f32::from_bits(bits);
            let exact = encode(f64::from(linear)).clamp(0.0, 1.0);
            let near = |code: f64, scaled: f64| (code - scaled).abs() <= 0.5 + 1e-7;
            assert!(near(f64::from(encode8(linear)), exact * 255.0), "{linear} {exact}");
            assert!(near(f64::from(encode16(linear)), exact * 65_535.0), "{linear} {exact}");
        }
    }

    #[test]
    fn values_out_of_range_are_clipped() {
        for x in [f32::NAN, -0.0, -1.0, f32::NEG_INFINITY, 1e-30] {
            assert_eq!((encode8(x), encode16(x)), (0, 0), "{x}");
        }
        for x in [1.0, 1.000_001, 7.0, f32::INFINITY, f32::MAX] {
            assert_eq!((encode8(x), encode16(x)), (255, 65_535), "{x}");
        }
    }

    #[test]
    fn the_two_directions_undo_each_other() {
        for step in 0..=1000 {
            let coded = f64::from(step) / 1000.0;
            assert!((encode(decode(coded)) - coded).abs() < 1e-6, "{coded}");
        }
    }
}
