//! The scalar form: what the other levels must equal bit for bit.

use super::{LANES, Row, Simd};

/// Needs nothing of the processor.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

#[inline(always)]
fn each(a: Row, b: Row, f: impl Fn(f32, f32) -> f32) -> Row {
    std::array::from_fn(|k| f(a[k], b[k]))
}

#[inline(always)]
fn mask(a: Row, b: Row, holds: impl Fn(f32, f32) -> bool) -> u32 {
    (0..LANES).fold(0, |mask, k| mask | u32::from(holds(a[k], b[k])) << k)
}

impl Simd for Portable {
    type Lanes = Row;

    #[inline(always)]
    fn splat(self, x: f32) -> Row {
        [x; LANES]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Row {
        *row
    }

    #[inline(always)]
    fn store(self, a: Row) -> Row {
        a
    }

    #[inline(always)]
    fn add(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn abs(self, a: Row) -> Row {
        a.map(f32::abs)
    }

    #[inline(always)]
    fn greater(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn smaller(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn less(self, a: Row, b: Row) -> u32 {
        mask(a, b, |a, b| a < b)
    }

    #[inline(always)]
    fn at_most(self, a: Row, b: Row) -> u32 {
        mask(a, b, |a, b| a <= b)
    }
}
