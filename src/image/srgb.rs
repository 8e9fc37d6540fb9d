//! The sRGB transfer function (IEC 61966-2-1:1999) between linear light and coded values, rounded correctly.
//!
//! Coding goes by thresholds: code `c` begins at the linear value whose exact code is `c - 1/2`. They are found once
//! with `libm`, so the same linear value has the same code on every machine, and no power is taken for a pixel.

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

/// The 8-bit code nearest to linear light; below 0 and NaN are 0, above 1 is 255.
pub fn encode8(linear: f32) -> u8 {
    static CODES: LazyLock<Codes> = LazyLock::new(|| Codes::new(255, 16));
    #[expect(clippy::cast_possible_truncation, reason = "the table was built for codes up to 255")]
    {
        CODES.code(linear) as u8
    }
}

/// The 16-bit code nearest to linear light; below 0 and NaN are 0, above 1 is 65 535.
pub fn encode16(linear: f32) -> u16 {
    static CODES: LazyLock<Codes> = LazyLock::new(|| Codes::new(65_535, 12));
    CODES.code(linear)
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// Where each code begins, and a way to get near without a search.
struct Codes {
    /// `begin[c]` is the smallest linear value of code `c`; `begin[0]` is minus infinity.
    begin: Vec<f32>,
    /// Code of the first value of each bucket; a bucket is the values that share their leading bits.
    first: Vec<u16>,
    /// Leading bits of the first bucket.
    low: u32,
    /// Bits below a bucket's leading ones.
    shift: u32,
}

impl Codes {
    fn new(max: u16, shift: u32) -> Self {
        let mut begin = vec![f32::NEG_INFINITY];
        begin.extend((1..=max).map(|c| round_up(decode((f64::from(c) - 0.5) / f64::from(max)))));
        let low = begin[1].to_bits() >> shift;
        let high = begin[usize::from(max)].to_bits() >> shift;
        let first = (low..=high)
            .map(|bucket| {
                let value = f32::from_bits(bucket << shift);
                u16::try_from(begin.partition_point(|&b| b <= value) - 1).unwrap_or(max)
            })
            .collect();
        Self { begin, first, low, shift }
    }

    fn code(&self, linear: f32) -> u16 {
        let max = self.begin.len() - 1;
        if linear < self.begin[1] || linear.is_nan() {
            return 0;
        }
        let bucket = ((linear.to_bits() >> self.shift) - self.low) as usize;
        let mut code = self.first.get(bucket).map_or(max, |&c| usize::from(c));
        while code < max && linear >= self.begin[code + 1] {
            code += 1;
        }
        u16::try_from(code).unwrap_or(u16::MAX)
    }
}

/// The smallest `f32` that is not below `x`.
fn round_up(x: f64) -> f32 {
    let near = narrow(x);
    if f64::from(near) < x { near.next_up() } else { near }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        // Steps that are prime to the tables' buckets, over all floats from 2^-30 to just over 1.
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
