//! Quotients in lanes, rounded once where that is certain, and weights made from them.

use super::super::bounds::{PLANE_TERMS_F64, POSITION_T};
use super::super::simd::{Lanewise, ROUNDED};

/// Smallest size of a certain term, relative to the sum of the sizes of its own terms.
///
/// [`Bounded::over`](crate::math::quotient::Bounded) computes a quotient with a relative error of 3/2 of those of its terms
/// and 4 u; half of [`POSITION_T`], but for a thousandth, is left for each term, which errs by [`PLANE_TERMS_F64`] of that
/// sum. The sum may be computed in `f32`: fewer than 16 roundings.
pub(super) const SURE: f32 = {
    assert!(ROUNDED == POSITION_T);
    (PLANE_TERMS_F64 * (1.5 * 1.001 * 2.0 / POSITION_T)) as f32 * (1.0 + 16.0 * f32::EPSILON)
};

/// Quotients of bounded terms.
pub(super) struct Quotients<L, D> {
    /// Quotients rounded once.
    pub(super) rounded: L,
    /// Quotients with a relative error of [`POSITION_T`].
    pub(super) value: D,
    /// Bit mask of the lanes in which both are certain.
    pub(super) sure: u32,
}

/// n / d where both exceed their bounds: [`Bounded::over`](crate::math::quotient::Bounded) in lanes. Lanes that are certain
/// here are certain there, but not vice versa.
#[inline(always)]
pub(super) fn quotient<S: Lanewise<N>, const N: usize>(
    s: S,
    [numerator, n_bound]: [S::Doubles; 2],
    [denominator, d_bound]: [S::Doubles; 2],
) -> Quotients<S::Lanes, S::Doubles> {
    let value = s.mul_f64(numerator, s.div_f64(s.splat_f64(1.0), denominator));
    let rounded = s.narrow(value);
    let certain = s.less_f64(n_bound, s.abs_f64(numerator)) & s.less_f64(d_bound, s.abs_f64(denominator));
    // Below the normal numbers zero would need a sign, which is left to the scalar form.
    let sure = certain & s.rounds_surely(value) & s.less(s.splat(f32::MIN_POSITIVE), s.abs(rounded));
    Quotients { rounded, value, sure }
}

/// Rounds the weights and clamps them and their sum to 0..=1; NaN becomes 0.
#[inline(always)]
pub(super) fn clamped<S: Lanewise<N>, const N: usize>(s: S, u: S::Doubles, v: S::Doubles) -> [S::Lanes; 2] {
    // Rounding is monotonic, and neither bound is rounded.
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let u = s.smaller(s.greater(s.narrow(u), zero), one);
    let v = s.smaller(s.greater(s.narrow(v), zero), one);
    [u, s.choose(s.less(one, s.add(u, v)), s.sub(one, u), v)]
}
