//! Vectors in `f64`, one in each lane.

use super::super::simd::Lanewise;

/// A vector in each lane.
pub(super) struct Vectors<S: Lanewise<N>, const N: usize>(pub(super) [S::Doubles; 3]);

impl<S: Lanewise<N>, const N: usize> Vectors<S, N> {
    #[inline(always)]
    pub(super) fn of(s: S, [x, y, z]: [S::Lanes; 3]) -> Self {
        Self([s.widen(x), s.widen(y), s.widen(z)])
    }

    #[inline(always)]
    pub(super) fn minus(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([s.sub_f64(a, *x), s.sub_f64(b, *y), s.sub_f64(c, *z)])
    }

    #[inline(always)]
    pub(super) fn abs(&self, s: S) -> Self {
        let [x, y, z] = self.0;
        Self([s.abs_f64(x), s.abs_f64(y), s.abs_f64(z)])
    }

    #[inline(always)]
    pub(super) fn dot(&self, s: S, Self([x, y, z]): &Self) -> S::Doubles {
        let [a, b, c] = self.0;
        s.add_f64(s.add_f64(s.mul_f64(a, *x), s.mul_f64(b, *y)), s.mul_f64(c, *z))
    }

    #[inline(always)]
    pub(super) fn cross(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([
            s.sub_f64(s.mul_f64(b, *z), s.mul_f64(*y, c)),
            s.sub_f64(s.mul_f64(c, *x), s.mul_f64(*z, a)),
            s.sub_f64(s.mul_f64(a, *y), s.mul_f64(*x, b)),
        ])
    }

    /// Rotates the axes so that x comes last in the lanes of the first mask, y in those of the second, and z elsewhere.
    #[inline(always)]
    pub(super) fn turned(&self, s: S, [along_x, along_y]: [u32; 2]) -> [S::Doubles; 3] {
        let [x, y, z] = self.0;
        let last = s.choose_f64(along_x, x, s.choose_f64(along_y, y, z));
        let first = s.choose_f64(along_x, y, s.choose_f64(along_y, z, x));
        let second = s.choose_f64(along_x, z, s.choose_f64(along_y, x, y));
        [first, second, last]
    }
}
