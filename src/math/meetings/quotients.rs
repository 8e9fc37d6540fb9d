//! Quotients in lanes, rounded once where that is certain, and the weights made of them.

use super::super::bounds::{PLANE_TERMS_F64, POSITION_T};
use super::super::simd::{Lanewise, ROUNDED};

/// A term is certain enough when it is larger than this part of the sum of the sizes of what it is made of.
///
/// [`Bounded::over`](crate::math::quotient::Bounded) finds a quotient to an error of 3/2 of those of its terms and 4 u, relative;
/// half of [`POSITION_T`], but for a thousandth, is left for each term, which errs by [`PLANE_TERMS_F64`] of that sum. The sum
/// may be computed in `f32`: fewer than 16 roundings.
pub(super) const SURE: f32 = {
    assert!(ROUNDED == POSITION_T);
    (PLANE_TERMS_F64 * (1.5 * 1.001 * 2.0 / POSITION_T)) as f32 * (1.0 + 16.0 * f32::EPSILON)
};

/// Quotients of bounded terms.
pub(super) struct Quotients<L, D> {
    /// Rounded once.
    pub(super) rounded: L,
    /// To a relative error of [`POSITION_T`].
    pub(super) value: D,
    /// The lanes in which both are certain.
    pub(super) sure: u32,
}

/// n / d, where both are larger than what is asked of them: [`Bounded::over`](crate::math::quotient::Bounded) in lanes. What is
/// certain here is certain there, and never the other way round.
#[inline(always)]
pub(super) fn quotient<S: Lanewise<N>, const N: usize>(
    s: S,
    [numerator, n_bound]: [S::Doubles; 2],
    [denominator, d_bound]: [S::Doubles; 2],
) -> Quotients<S::Lanes, S::Doubles> {
    let value = s.mul_f64(numerator, s.div_f64(s.splat_f64(1.0), denominator));
    let rounded = s.narrow(value);
    let certain = s.less_f64(n_bound, s.abs_f64(numerator)) & s.less_f64(d_bound, s.abs_f64(denominator));
    // Below the normal numbers zero gets a sign, which is left to the scalar form.
    let sure = certain & s.rounds_surely(value) & s.less(s.splat(f32::MIN_POSITIVE), s.abs(rounded));
    Quotients { rounded, value, sure }
}

/// Weights within 0 to 1, and their sum, too; rounded, 0 for a NaN.
#[inline(always)]
pub(super) fn clamped<S: Lanewise<N>, const N: usize>(s: S, u: S::Doubles, v: S::Doubles) -> [S::Lanes; 2] {
    // Rounding keeps the order, and neither bound is rounded.
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let u = s.smaller(s.greater(s.narrow(u), zero), one);
    let v = s.smaller(s.greater(s.narrow(v), zero), one);
    [u, s.choose(s.less(one, s.add(u, v)), s.sub(one, u), v)]
}
