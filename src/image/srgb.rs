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
    #[expect(clippy::cast_possible_truncation, reason = "the table was built for codes up to 255")]
    {
        codes8().code(linear) as u8
    }
}

/// The table of 8-bit codes, for loops that should not look for it again and again.
pub(super) fn codes8() -> &'static Codes {
    static CODES: LazyLock<Codes> = LazyLock::new(|| Codes::new(255, 16));
    &CODES
}

/// The table of 16-bit codes.
pub(super) fn codes16() -> &'static Codes {
    static CODES: LazyLock<Codes> = LazyLock::new(|| Codes::new(65_535, 12));
    &CODES
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn narrow(x: f64) -> f32 {
    x as f32
}

/// Where each code begins, and a way to get near without a search.
pub(super) struct Codes {
    /// `begin[c]` is the smallest linear value of code `c`; `begin[0]` is minus infinity, one past the last is infinity.
    begin: Vec<f32>,
    /// The linear values that share their leading bits, from `lowest` to 1.
    buckets: Vec<Bucket>,
    /// First value of the first bucket; its code is 0.
    lowest: f32,
    /// Bits below a bucket's leading ones.
    shift: u32,
}

struct Bucket {
    /// Code of its first value.
    code: u16,
    /// Where the next code begins.
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

    /// The code nearest to linear light.
    #[inline]
    pub(super) fn code(&self, linear: f32) -> u16 {
        let (mut code, linear) = self.near(linear);
        while linear >= self.begin[usize::from(code) + 1] {
            code += 1;
        }
        code
    }

    /// The code where the bucket of linear light begins, or the next; of the 8-bit table, no bucket of which holds more than
    /// one step, the code nearest to it. And the light within the table.
    #[inline(always)]
    pub(super) fn near(&self, linear: f32) -> (u16, f32) {
        // Comparisons that NaN fails, each one instruction.
        let linear = if linear > self.lowest { linear } else { self.lowest };
        let linear = if linear < 1.0 { linear } else { 1.0 };
        let bucket = &self.buckets[((linear.to_bits() - self.lowest.to_bits()) >> self.shift) as usize];
        // An addition does what a branch would have to guess.
        (bucket.code + u16::from(linear >= bucket.next), linear)
    }
}

/// The smallest `f32` that is not below `x`.
fn round_up(x: f64) -> f32 {
    let near = narrow(x);
    if f64::from(near) < x { near.next_up() } else { near }
}

/// The curve by chords between values that are an even ratio apart in every doubling: for estimates, where a rounded code
/// would add steps of its own.
pub(super) struct Chords {
    /// Codes 0..=1 where the chords begin, and of 1; the rest is room, so that no index is outside.
    ends: Box<[f32; Self::ROOM]>,
}

impl Chords {
    /// Where they begin: below, the curve is straight.
    const FIRST: f32 = 1.0 / 512.0;
    /// Bits of the fraction of a number within a chord: 128 chords a doubling.
    const WITHIN: u32 = 23 - 7;
    /// A power of two above the nine doublings' number of ends.
    const ROOM: usize = 1 << 11;

    /// All of them, found once.
    pub(super) fn get() -> &'static Self {
        static CHORDS: LazyLock<Chords> = LazyLock::new(|| {
            let starts = (Chords::FIRST.to_bits() >> Chords::WITHIN)..=(1.0_f32.to_bits() >> Chords::WITHIN);
            let value = |start: u32| f64::from(f32::from_bits(start << Chords::WITHIN));
            let mut ends = Box::new([1.0; Chords::ROOM]);
            ends.iter_mut().zip(starts).for_each(|(end, start)| *end = narrow(encode(value(start))));
            Chords { ends }
        });
        &CHORDS
    }

    /// The code 0..=1 of linear light, which is held in 0..=1, within 3·10⁻⁶ of it; 0 of NaN.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "16 bits")]
    pub(super) fn code(&self, linear: f32) -> f32 {
        let light = if linear > Self::FIRST { linear } else { Self::FIRST };
        let light = if light < 1.0 { light } else { 1.0 };
        let bits = light.to_bits();
        let start = ((bits - Self::FIRST.to_bits()) >> Self::WITHIN) as usize;
        let (from, to) = (self.ends[start % Self::ROOM], self.ends[(start + 1) % Self::ROOM]);
        let part = (bits & ((1 << Self::WITHIN) - 1)) as f32 / (1 << Self::WITHIN) as f32;
        let curved = from + (to - from) * part;
        let straight = if linear > 0.0 { 12.92 * linear } else { 0.0 };
        if linear > Self::FIRST { curved } else { straight }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encode16(linear: f32) -> u16 {
        codes16().code(linear)
    }

    #[test]
    fn chords_are_near_the_curve() {
        let chords = Chords::get();
        for i in 0..200_000 {
            let linear = i as f32 / 199_999.0;
            let linear = linear * linear;
            let error = f64::from(chords.code(linear)) - encode(f64::from(linear));
            assert!(error.abs() < 3e-6, "{linear}: {error:e}");
        }
        let odd = [-1.0, f32::NAN, 2.0, f32::INFINITY, f32::NEG_INFINITY].map(|linear| chords.code(linear));
        assert_eq!(odd, [0.0, 0.0, 1.0, 1.0, 0.0]);
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
    fn no_bucket_of_the_small_table_holds_two_steps() {
        let codes = codes8();
        let bucket = |&light: &f32| (light.to_bits() - codes.lowest.to_bits()) >> codes.shift;
        let steps: Vec<u32> = codes.begin[1..=255].iter().map(bucket).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
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
