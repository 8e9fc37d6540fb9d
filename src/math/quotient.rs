//! Quotients rounded to the nearest `f32`, and the filter that makes exactness cheap.
//!
//! A distance t = numerator/denominator of a planar prim is *defined* as the exact quotient, rounded once. It is thus a
//! function of ray and prim alone: no structure, kernel or order of corners can change a bit of it.

use super::bounds::EXACT_QUOTIENT;
use super::expansion::Expansion;

/// A computed number with a bound of its absolute error.
#[derive(Clone, Copy, Debug)]
pub struct Bounded {
    /// Computed value.
    pub value: f64,
    /// Bound of |value − exact|.
    pub error: f64,
}

impl Bounded {
    /// Quotient, or `None` if the sign of either term is uncertain. Neither the reciprocal of the denominator nor its product
    /// with the numerator may over- or underflow, which those of terms made of `f32` coordinates do not.
    #[inline(always)]
    pub fn over(self, denominator: Self) -> Option<Self> {
        let (n, d) = (self.value.abs(), denominator.value.abs());
        // Also false for NaN.
        if denominator.error < 0.25 * d && self.error < 0.25 * n {
            // |(n + e)/(d + f) − n/d| = |e − f n/d| / |d + f|, and |d + f| ≥ 3/4 |d|; 3/2 covers that and the roundings here.
            // The reciprocal and the product of the quotient itself are one rounding each.
            let reciprocal = 1.0 / denominator.value;
            let value = self.value * reciprocal;
            let size = value.abs();
            let error =
                (self.error + denominator.error * size) * (1.5 * reciprocal.abs()) + size * (2.0 * f64::EPSILON);
            Some(Self { value, error })
        } else {
            None
        }
    }

    /// Whether the error is below the given fraction of the value.
    #[inline]
    pub fn is_within(self, relative: f64) -> bool {
        self.error < self.value.abs() * relative
    }

    /// The `f32` nearest to every possible exact value, or `None` if there are several.
    #[inline]
    pub fn nearest(self) -> Option<f32> {
        let spread = self.error * 1.001;
        let (lo, hi) = (round(self.value - spread), round(self.value + spread));
        (lo.to_bits() == hi.to_bits()).then_some(lo)
    }
}

/// `numerator` / `denominator` with a relative error of [`EXACT_QUOTIENT`].
pub fn approximate<const N: usize>(numerator: &Expansion<N>, denominator: &Expansion<96>) -> f64 {
    numerator.approximate() / denominator.approximate()
}

/// `numerator` / `denominator`, correctly rounded; the denominator is not zero. `M` ≥ `N` + 192.
pub fn rounded<const N: usize, const M: usize>(numerator: &Expansion<N>, denominator: &Expansion<96>) -> f32 {
    rounded_within::<N, M>(numerator, denominator, EXACT_QUOTIENT)
}

/// [`rounded`] where `doubt` is the relative error of [`approximate`].
fn rounded_within<const N: usize, const M: usize>(
    numerator: &Expansion<N>,
    denominator: &Expansion<96>,
    doubt: f64,
) -> f32 {
    if numerator.sign() == 0 {
        return 0.0;
    }
    let t = approximate(numerator, denominator);
    let (lo, hi) = (round(t - t.abs() * doubt), round(t + t.abs() * doubt));
    if lo.to_bits() == hi.to_bits() {
        return lo;
    }
    // Between two neighbours: on which side of their midpoint lies numerator/denominator?
    let middle = middle(lo, hi);
    let mut above = Expansion::<M>::ZERO;
    for &x in numerator.terms() {
        above.add(x);
    }
    above.add_product(denominator.terms(), &[middle], -1.0);
    match above.sign() * denominator.sign() {
        1 => hi,
        -1 => lo,
        _ => round(middle),
    }
}

/// Rounds to the nearest `f32`, ties to even; but a negative number never becomes zero, so that hits behind a ray stay there.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
pub fn round(t: f64) -> f32 {
    let r = t as f32;
    if t < 0.0 && r == 0.0 { -f32::from_bits(1) } else { r }
}

/// Midpoint of two neighbouring floats; 2¹²⁸ stands for the successor of the largest float.
fn middle(lo: f32, hi: f32) -> f64 {
    let widen = |x: f32| {
        if x.is_infinite() { f64::from(x.signum()) * 2.0 * (1u128 << 127) as f64 } else { f64::from(x) }
    };
    (widen(lo) + widen(hi)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 (1 + 2⁻²⁴) + 2⁻⁸⁰ over 3: just above the midpoint between 1 and the next float.
    fn above_the_middle(doubt: f64) -> f32 {
        let (mut numerator, mut denominator) = (Expansion::<8>::ZERO, Expansion::<96>::ZERO);
        numerator.add(3.0 * (1.0 + f64::from(f32::EPSILON) / 2.0));
        numerator.add(2f64.powi(-80));
        denominator.add(3.0);
        rounded_within::<8, 200>(&numerator, &denominator, doubt)
    }

    #[test]
    fn a_quotient_just_above_a_middle_is_rounded_up_and_would_not_be_without_the_margin() {
        assert_eq!(above_the_middle(EXACT_QUOTIENT), 1f32.next_up());
        assert_eq!(above_the_middle(0.0), 1.0);
    }
}
