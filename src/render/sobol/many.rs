//! The first two coordinates of many points at a time.
//!
//! The same numbers as [`super::point`] gives, without its tables: of these two dimensions the bits of a point are a formula of
//! the bits of its index, which the compiler turns into lanes.

use super::{mix, turned};
use crate::math::simd::{Kernel, LANES, Level, Simd};

/// Points that are found at a time.
const RUN: usize = 64;

/// Points that are wanted, by number and place.
pub(in crate::render) struct Many {
    count: usize,
    index: [u32; RUN],
    key: [u32; RUN],
    found: [[f64; RUN]; 2],
}

impl Default for Many {
    fn default() -> Self {
        Self { count: 0, index: [0; RUN], key: [0; RUN], found: [[0.0; RUN]; 2] }
    }
}

impl Many {
    /// Appends a point of each of these keys, which are told with its index.
    pub(in crate::render) fn find(&mut self, wanted: impl Iterator<Item = (u32, u32)>, found: &mut Vec<[f64; 2]>) {
        wanted.for_each(|(key, index)| {
            let at = self.count % RUN;
            (self.index[at], self.key[at]) = (index, key);
            self.count += 1;
            if self.count == RUN {
                self.flush(found);
            }
        });
        self.flush(found);
    }

    fn flush(&mut self, found: &mut Vec<[f64; 2]>) {
        Level::best().run(Scatter(self));
        let [x, y] = &self.found;
        found.extend(x.iter().zip(y).take(self.count).map(|(x, y)| [*x, *y]));
        self.count = 0;
    }
}

struct Scatter<'a>(&'a mut Many);

impl Kernel for Scatter<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Many { count, index, key, found: [x, y] } = self.0;
        for i in 0..count.next_multiple_of(LANES).min(RUN) {
            [x[i], y[i]] = square(index[i], key[i]);
        }
    }
}

/// [`super::point`] of two dimensions.
#[inline(always)]
pub(in crate::render) fn square(index: u32, key: u32) -> [f64; 2] {
    let index = turned(index.reverse_bits(), key).reverse_bits();
    let across = turned(index, mix(key, 1)).reverse_bits();
    let down = turned(shifted(index), mix(key, 2)).reverse_bits();
    [fraction(across), fraction(down)]
}

#[inline(always)]
fn fraction(x: u32) -> f64 {
    f64::from(x) / 4_294_967_296.0
}

/// The bits of the second dimension, the last first. Its direction numbers are the powers of 1 + x, as polynomials over
/// bits: this puts 1 + x for x, and as (1 + x)ᵏ is 1 + xᵏ where k is a power of two, it takes five steps.
#[inline(always)]
fn shifted(mut index: u32) -> u32 {
    index ^= index >> 1 & 0x5555_5555;
    index ^= index >> 2 & 0x3333_3333;
    index ^= index >> 4 & 0x0f0f_0f0f;
    index ^= index >> 8 & 0x00ff_00ff;
    index ^ (index >> 16 & 0x0000_ffff)
}

#[cfg(test)]
mod tests {
    use super::super::point;
    use super::*;

    #[test]
    fn many_points_are_those_of_one_by_one() {
        let (mut many, mut found) = (Many::default(), Vec::new());
        for count in [0, 1, 63, 64, 65, 500] {
            let wanted = (0..count).map(|i| (mix(3, i), if i % 3 == 0 { i } else { mix(4, i) >> (i % 32) }));
            found.clear();
            many.find(wanted.clone(), &mut found);
            assert!(found.iter().copied().eq(wanted.map(|(key, index)| point::<2>(index, key))), "{count}");
        }
    }
}
