//! One formula in two precisions: [`f64`] first, and [`Double`], twice as long, where `f64` cannot decide.
//!
//! A [`Double`] is the unevaluated sum of two `f64`. Algorithms and bounds after M. Joldeş, J.-M. Muller, V. Popescu,
//! *Tight and Rigorous Error Bounds for Basic Building Blocks of Double-Word Arithmetic*, 2017.

use super::expansion::{two_product, two_sum};
use super::{DVec3, Vec3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number type with a known relative error of every operation.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Bound of the relative error of a sum, difference or product; quotient and root err by at most twice that.
    const UNIT: f64;

    /// Converts an `f64`.
    fn of(x: f64) -> Self;

    /// Nearest `f64`.
    fn value(self) -> f64;

    /// Square root of a non-negative number.
    fn sqrt(self) -> Self;
}

impl Real for f64 {
    const UNIT: f64 = super::bounds::U64;

    fn of(x: f64) -> Self {
        x
    }

    fn value(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

/// Double-length number hi + lo, where hi is the nearest `f64` to the sum.
#[derive(Clone, Copy, Debug)]
pub struct Double {
    hi: f64,
    lo: f64,
}

/// `two_sum` for |a| ≥ |b|.
fn fast_two_sum(a: f64, b: f64) -> Double {
    let hi = a + b;
    Double { hi, lo: b - (hi - a) }
}

impl Real for Double {
    /// 8 u²: sums err by 3 u² + 13 u³, products by 7 u², quotients by 15 u² + 56 u³, all relative; the root, one step of
    /// Newton's method in [`Double`] from the `f64` root, by less than 4 u².
    const UNIT: f64 = 8.0 * super::bounds::U64 * super::bounds::U64;

    fn of(x: f64) -> Self {
        Self { hi: x, lo: 0.0 }
    }

    fn value(self) -> f64 {
        self.hi
    }

    fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::of(0.0);
        }
        let root = self.hi.sqrt();
        let (square, error) = two_product(root, root);
        let rest = (self.hi - square) - error + self.lo;
        fast_two_sum(root, rest / (2.0 * root))
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, b: Self) -> Self {
        let (hi, error) = two_sum(self.hi, b.hi);
        let (lo, small) = two_sum(self.lo, b.lo);
        let sum = fast_two_sum(hi, error + lo);
        fast_two_sum(sum.hi, small + sum.lo)
    }
}

impl Neg for Double {
    type Output = Self;

    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, b: Self) -> Self {
        let (hi, error) = two_product(self.hi, b.hi);
        fast_two_sum(hi, error + (self.hi * b.lo + self.lo * b.hi))
    }
}

impl Div for Double {
    type Output = Self;

    fn div(self, b: Self) -> Self {
        let first = self.hi / b.hi;
        let product = b * Self::of(first);
        let rest = (self.hi - product.hi) + (self.lo - product.lo);
        fast_two_sum(first, rest / b.hi)
    }
}

/// Vector of three numbers.
#[derive(Clone, Copy, Debug)]
pub struct Real3<R>(pub [R; 3]);

impl<R: Real> Real3<R> {
    /// Converts a point in `f64`.
    pub fn of(p: DVec3) -> Self {
        Self(p.to_array().map(R::of))
    }

    /// `p` − `q`, each coordinate rounded once.
    pub fn difference(p: Vec3, q: Vec3) -> Self {
        Self([0, 1, 2].map(|k| R::of(f64::from(p[k])) - R::of(f64::from(q[k]))))
    }

    /// Product with a number.
    pub fn times(self, factor: R) -> Self {
        Self(self.0.map(|x| x * factor))
    }

    /// Sum.
    pub fn plus(self, b: Self) -> Self {
        Self([0, 1, 2].map(|k| self.0[k] + b.0[k]))
    }

    /// Difference.
    pub fn minus(self, b: Self) -> Self {
        Self([0, 1, 2].map(|k| self.0[k] - b.0[k]))
    }

    /// Dot product.
    pub fn dot(self, b: Self) -> R {
        self.0[0] * b.0[0] + self.0[1] * b.0[1] + self.0[2] * b.0[2]
    }

    /// Cross product.
    pub fn cross(self, b: Self) -> Self {
        Self([(1, 2), (2, 0), (0, 1)].map(|(i, j)| self.0[i] * b.0[j] - self.0[j] * b.0[i]))
    }

    /// Nearest point in `f64`.
    pub fn value(self) -> DVec3 {
        DVec3::from_array(self.0.map(R::value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dashu::base::Abs;
    use dashu::rational::RBig;
    use proptest::prelude::*;

    fn exact(x: f64) -> RBig {
        RBig::try_from(x).unwrap_or_default()
    }

    fn sum(x: Double) -> RBig {
        exact(x.hi) + exact(x.lo)
    }

    fn double() -> impl Strategy<Value = Double> {
        (-1.0f64..1.0, -1.0f64..1.0, -60i32..60)
            .prop_map(|(a, b, e)| fast_two_sum(a * 2f64.powi(e), b * 2f64.powi(e - 54)))
    }

    fn close(got: Double, want: &RBig, units: u32) -> bool {
        (sum(got) - want).abs() <= want.clone().abs() * exact(Double::UNIT) * RBig::from(units)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]
        #[test]
        fn operations_err_by_no_more_than_they_say(a in double(), b in double()) {
            prop_assert!(close(a + b, &(sum(a) + sum(b)), 1));
            prop_assert!(close(a - b, &(sum(a) - sum(b)), 1));
            prop_assert!(close(a * b, &(sum(a) * sum(b)), 1));
            if b.hi != 0.0 {
                prop_assert!(close(a / b, &(sum(a) / sum(b)), 2));
            }
            let a = if a.hi < 0.0 { -a } else { a };
            // A relative error of e in the root is 2 e in its square.
            let root = sum(a.sqrt());
            prop_assert!((&root * &root - sum(a)).abs() <= sum(a) * exact(Double::UNIT) * RBig::from(2));
        }
    }

    #[test]
    fn numbers_that_nearly_cancel_keep_their_difference() {
        let third = Double::of(1.0) / Double::of(3.0);
        let rest = third * Double::of(3.0) - Double::of(1.0);
        assert!(rest.hi.abs() < 1e-31 && third.lo != 0.0);
    }
}
