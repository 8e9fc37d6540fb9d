//! The first two coordinates of a point, for vectorised loops.
//!
//! The same numbers as those of [`super::point`], without its tables: in these two dimensions the bits of a point are a closed
//! formula of the bits of its index, which the compiler vectorises.

use super::{mix, turned};

/// [`super::point`] in two dimensions.
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

/// Bits of the second dimension, the last first. Its direction numbers are the powers of 1 + x, as polynomials over bits: this
/// substitutes 1 + x for x, and as (1 + x)ᵏ is 1 + xᵏ where k is a power of two, it takes five steps.
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
    fn the_formula_gives_the_points_of_the_tables() {
        for i in 0..2000 {
            let (key, index) = (mix(3, i), if i % 3 == 0 { i } else { mix(4, i) >> (i % 32) });
            assert_eq!(square(index, key), point::<2>(index, key), "{index} of {key}");
        }
    }
}
