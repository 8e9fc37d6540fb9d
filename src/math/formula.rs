//! Functions as formulas without branches and calls, which compilers can vectorise: the same bits on every instruction set,
//! vectorised or not.

use std::f32::consts::{FRAC_PI_2, PI};

/// From here on every float is an integer: adding this number rounds to integers.
pub const WHOLE: f32 = 8_388_608.0;

/// Largest integer not above `x`, without the library call that x86-64 needs for it before SSE4.1, and without casts, which
/// compilers do not vectorise.
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    let whole = WHOLE.copysign(x);
    let nearest = (x + whole) - whole;
    let below = if nearest > x { nearest - 1.0 } else { nearest };
    if x.abs() < WHOLE { below } else { x }
}

/// [`floor`] of a single number: with casts, which are faster there, and a branch that is well predicted for non-negative
/// numbers.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "within ±2²³ both casts are exact")]
pub fn floor_of_one(x: f32) -> f32 {
    let truncated = x as i32 as f32;
    let below = if truncated > x { truncated - 1.0 } else { truncated };
    if x.abs() < WHOLE { below } else { x }
}

/// Converts an integral `x` within ±2³¹.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the lowest bits are the number")]
pub fn integer(x: f32) -> i32 {
    /// 1.5 · 2⁵²: near it floats are integers.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    (f64::from(x) + WHOLE).to_bits() as i32
}

/// Converts an integral `x` within ±2²²: two instructions, with lanes as wide as the float's.
#[inline(always)]
pub fn near_integer(x: f32) -> i32 {
    /// 1.5 · 2²³: near it floats are integers.
    const WHOLE: f32 = 12_582_912.0;
    (x + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits()).cast_signed()
}

/// 0 up to `from`, 1 from `to` on, and a smooth cubic in between.
#[inline(always)]
pub fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Angle of the point (`x`, `y`) from the x axis, −π … π, to 5e-7; 0 for the origin.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    /// Polynomial in t² for the arctangent of t over t: minimax fit on 0 ≤ t ≤ 1.
    const FIT: [f32; 8] = [
        0.999_999_4,
        -0.333_300_32,
        0.199_484_11,
        -0.139_174_46,
        0.096_638_1,
        -0.056_195_922,
        0.022_052_402,
        -0.004_105_173,
    ];
    let (wide, high) = (x.abs(), y.abs());
    let (least, most) = (wide.min(high), wide.max(high));
    let t = if most > 0.0 { least / most } else { 0.0 };
    let squared = t * t;
    let [first @ .., last] = FIT;
    let from_axis = t * first.iter().rev().fold(last, |sum, c| sum * squared + c);
    let right = if high > wide { FRAC_PI_2 - from_axis } else { from_axis };
    let upper = if x < 0.0 { PI - right } else { right };
    upper.copysign(y)
}

/// Base-2 logarithm of a positive, finite, normal `x`, to 5e-6 between 2⁻⁶⁰ and 2⁶⁰ and 7e-6 beyond; exact for powers of two;
/// −127 for 0.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "an exponent")]
pub fn log2(x: f32) -> f32 {
    /// Polynomial in m for (log₂(1 + m) − m) / (m (1 − m)): fitted to 0 ≤ m ≤ 1 for the least error of the logarithm.
    const FIT: [f32; 5] = [0.442_553_73, -0.275_708_32, 0.182_354, -0.096_543, 0.026_128_728];
    let bits = x.to_bits();
    let exponent = (bits >> 23).wrapping_sub(127).cast_signed() as f32;
    let m = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0;
    let [first @ .., last] = FIT;
    exponent + (m + m * (1.0 - m) * first.iter().rev().fold(last, |sum, c| sum * m + c))
}

/// 2 to the power of `x`, −126 … 127, with a relative error of 2e-7; exact for integers.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    /// Polynomial in f for (2ᶠ − 1 − f) / (f (f − 1)): fitted to 0 ≤ f ≤ 1 for the least error of the power.
    const FIT: [f32; 4] = [0.306_848_26, 0.066_688_99, 0.010_870_314, 0.001_879_318_6];
    let whole = floor(x);
    let f = x - whole;
    let [first @ .., last] = FIT;
    let part = 1.0 + (f + f * (f - 1.0) * first.iter().rev().fold(last, |sum, c| sum * f + c));
    f32::from_bits((integer(whole) + 127).cast_unsigned() << 23) * part
}

/// `x` ≥ 0 to the power of `exponent`, 0 … 1, with a relative error of 5e-6 between 2⁻⁶⁰ and 2⁶⁰ and 7e-6 beyond.
#[inline(always)]
pub fn root(x: f32, exponent: f32) -> f32 {
    let power = exp2((exponent * log2(x)).max(-126.0));
    if x > 0.0 { power } else { 0.0 }
}

/// `x` ≥ 0 to the power of `exponent`, 1 … 1000, with a relative error of 5e-6 · `exponent`: 2⁻¹²⁶ … 2¹²⁷, and 0 for 0.
#[inline(always)]
pub fn power(x: f32, exponent: f32) -> f32 {
    let power = exp2((exponent * log2(x)).clamp(-126.0, 127.0));
    if x > 0.0 { power } else { 0.0 }
}

/// Sine and cosine of an angle in full turns, 0 ≤ `turns` ≤ 1, to 2e-7.
#[inline(always)]
pub fn sin_cos_of_turns(turns: f32) -> (f32, f32) {
    /// Polynomials in r² for the sine of r turns over r, and for its cosine: minimax fit on −⅛ ≤ r ≤ ⅛.
    const SINE: [f32; 4] = [6.283_185_5, -41.341_63, 81.588_13, -75.240_07];
    const COSINE: [f32; 5] = [1.0, -19.739_208, 64.939_316, -85.442_856, 59.220_406];
    let quarter = floor(turns * 4.0 + 0.5);
    let r = turns - quarter * 0.25;
    let quarter = integer(quarter);
    let squared = r * r;
    let sum = |fit: &[f32]| fit.iter().rev().fold(0.0, |sum, c| sum * squared + c);
    let (sine, cosine) = (r * sum(&SINE), sum(&COSINE));
    let is_odd = quarter & 1 == 1;
    let (sine, cosine) = if is_odd { (cosine, sine) } else { (sine, cosine) };
    // The quarter turn decides the signs: the cosine is negated in the second and third, …
    let minus_cosine = (quarter + 1) & 2 != 0;
    // … and the sine in the third and fourth.
    let minus_sine = quarter & 2 != 0;
    (if minus_sine { -sine } else { sine }, if minus_cosine { -cosine } else { cosine })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn floors_are_those_of_the_standard_library() {
        let some = [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 7.999_999_5, -3.000_000_2, 8_388_607.5, -8_388_607.5, 3e9, -3e9];
        let infinite = [f32::INFINITY, f32::NEG_INFINITY];
        for x in some.into_iter().chain(infinite) {
            assert_eq!([floor(x), floor_of_one(x)], [x.floor(); 2], "{x}");
        }
        for bits in (0..u32::MAX).step_by(65_521) {
            let x = f32::from_bits(bits);
            let floors = [floor(x), floor_of_one(x)];
            assert!(floors == [x.floor(); 2] || x.is_nan() && floors.iter().all(|floor| floor.is_nan()), "{x}");
        }
    }

    #[test]
    fn whole_numbers_become_integers() {
        for x in [0, 1, -1, 7, -8, 65_537, 8_388_607, -8_388_608, 16_777_215, -16_777_216, 2_147_483_520, i32::MIN] {
            assert_eq!(integer(x as f32), x);
        }
        for x in [0, 1, -1, 7, -8, 65_537, 4_194_303, -4_194_304] {
            assert_eq!(near_integer(x as f32), x);
        }
    }

    #[test]
    fn angles_are_arctangents_all_around() {
        let mut random = Random::new(3);
        let mut worst = 0.0_f64;
        for _ in 0..100_000 {
            let (x, y) = (random.unit() * 2.0 - 1.0, random.unit() * 2.0 - 1.0);
            worst = worst.max((f64::from(atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs());
        }
        assert!(worst < 5e-7, "{worst}");
        let axes = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)];
        for (y, x) in axes {
            assert!((atan2(y, x) - libm::atan2f(y, x)).abs() < 5e-7, "{y} {x}: {}", atan2(y, x));
        }
    }

    #[test]
    fn logarithms_are_near_and_those_of_powers_of_two_exact() {
        let mut random = Random::new(4);
        for k in 0..60_000_u16 {
            let x = 1.0 + random.unit() * f32::from(k);
            assert!((f64::from(log2(x)) - f64::from(x).log2()).abs() < 5e-6, "{x}");
        }
        for k in 0..100_u8 {
            assert_eq!(log2(libm::exp2f(f32::from(k))), f32::from(k));
            assert_eq!(log2(libm::exp2f(-f32::from(k))), -f32::from(k));
        }
        for _ in 0..60_000 {
            let x = random.unit() + f32::MIN_POSITIVE;
            assert!((f64::from(log2(x)) - f64::from(x).log2()).abs() < 5e-6, "{x}");
        }
    }

    #[test]
    fn powers_of_two_are_near_and_those_of_whole_numbers_exact() {
        let mut random = Random::new(5);
        for _ in 0..100_000 {
            let x = random.unit() * 252.0 - 126.0;
            let power = f64::from(exp2(x)) / f64::from(x).exp2();
            assert!((power - 1.0).abs() < 2e-7, "{x} {power}");
        }
        for k in -126..=127_i16 {
            assert_eq!(f64::from(exp2(f32::from(k))), f64::from(k).exp2());
        }
    }

    #[test]
    fn roots_are_those_of_the_standard_library() {
        let mut random = Random::new(6);
        for _ in 0..100_000 {
            let (x, exponent) = (random.unit() * 2.0, random.unit());
            let expected = f64::from(x).powf(f64::from(exponent));
            assert!((f64::from(root(x, exponent)) / expected - 1.0).abs() < 4e-6, "{x} {exponent}");
        }
        assert_eq!([root(0.0, 0.5), root(0.0, 1e-6), root(1.0, 0.3), root(0.25, 0.5)], [0.0, 0.0, 1.0, 0.5]);
    }

    #[test]
    fn high_powers_are_those_of_the_standard_library() {
        let mut random = Random::new(7);
        for _ in 0..100_000 {
            let (x, exponent) = (random.unit(), 1.0 + random.unit() * 250.0);
            let (found, expected) = (f64::from(power(x, exponent)), f64::from(x).powf(f64::from(exponent)));
            assert!((found - expected).abs() < 5e-6 * f64::from(exponent) * expected + 1.2e-38, "{x} {exponent}");
        }
        assert_eq!(
            [power(0.0, 3.0), power(1.0, 204.0), power(0.5, 9.0), power(1e-30, 204.0)],
            [0.0, 1.0, 0.001_953_125, 2f32.powi(-126)]
        );
    }

    #[test]
    fn sines_and_cosines_of_turns_are_those_of_the_standard_library() {
        let mut random = Random::new(3);
        let eighths = (0..=8).map(|i| i as f32 / 8.0);
        for turns in eighths.chain((0..100_000).map(|_| random.unit())) {
            let (sine, cosine) = sin_cos_of_turns(turns);
            let (expected_sine, expected_cosine) = (f64::from(turns) * std::f64::consts::TAU).sin_cos();
            assert!((f64::from(sine) - expected_sine).abs() < 2e-7, "{turns} {sine} {expected_sine}");
            assert!((f64::from(cosine) - expected_cosine).abs() < 2e-7, "{turns} {cosine} {expected_cosine}");
        }
    }
}
