//! Low-discrepancy points in squares and cubes, in a random order of their own for every key.
//!
//! The sequence is I. M. Sobol's (1967) with the direction numbers of S. Joe and F. Y. Kuo, "Constructing Sobol Sequences with
//! Better Two-Dimensional Projections" (2008), scrambled after A. B. Owen (1995) by hashing, as in B. Burley, "Practical
//! Hash-based Owen Scrambling" (2020), with N. Vegdahl's permutation ("Building a Better LK Hash", 2021). Each point of a
//! scrambling is uniformly distributed over the cube, so that the mean of a function over the points is unbiased, and scramblings
//! of different keys are independent.

mod square;

pub(super) use square::square;

/// Number of dimensions that are stratified together.
pub(super) const DIMENSIONS: usize = 4;

/// Contribution of each byte of an index, for each dimension.
static TABLES: [[[u32; 256]; 4]; DIMENSIONS] = tables();

/// Degree, inner coefficients and first direction numbers of each dimension's primitive polynomial after the first.
const POLYNOMIALS: [(usize, u32, [u32; 3]); DIMENSIONS - 1] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

const fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0; 32];
    let mut i = 0;
    if dimension == 0 {
        while i < 32 {
            v[i] = 1 << (31 - i);
            i += 1;
        }
        return v;
    }
    let (degree, inner, first) = POLYNOMIALS[dimension - 1];
    while i < 32 {
        if i < degree {
            v[i] = first[i] << (31 - i);
        } else {
            v[i] = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                v[i] ^= ((inner >> (degree - 1 - k)) & 1) * v[i - k];
                k += 1;
            }
        }
        i += 1;
    }
    v
}

const fn tables() -> [[[u32; 256]; 4]; DIMENSIONS] {
    let mut tables = [[[0; 256]; 4]; DIMENSIONS];
    let mut dimension = 0;
    while dimension < DIMENSIONS {
        let v = directions(dimension);
        let mut byte = 0;
        while byte < 4 {
            let mut value = 1;
            while value < 256 {
                let lowest = (value as u32).trailing_zeros() as usize;
                tables[dimension][byte][value] = tables[dimension][byte][value & (value - 1)] ^ v[8 * byte + lowest];
                value += 1;
            }
            byte += 1;
        }
        dimension += 1;
    }
    tables
}

/// The `index`th number of a dimension's sequence, as a fraction of 2³².
#[inline]
fn sobol(index: u32, dimension: usize) -> u32 {
    let [a, b, c, d] = index.to_le_bytes();
    let table = &TABLES[dimension];
    table[0][a as usize] ^ table[1][b as usize] ^ table[2][c as usize] ^ table[3][d as usize]
}

/// Flips the bits of a fraction, each depending on the bits above it.
#[inline]
fn scramble(x: u32, key: u32) -> u32 {
    turned(x.reverse_bits(), key).reverse_bits()
}

/// [`scramble`] of reversed bits: the upper bits become the lowest.
#[inline(always)]
fn turned(mut x: u32, key: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Hashes two numbers to 32 bits.
#[inline(always)]
pub(in crate::render) fn mix(a: u32, b: u32) -> u32 {
    // The finalizer of A. Appleby's MurmurHash3 (2011), once for each word.
    let stir = |mut x: u32| {
        x ^= x >> 16;
        x = x.wrapping_mul(0x85eb_ca6b);
        x ^= x >> 13;
        x = x.wrapping_mul(0xc2b2_ae35);
        x ^ (x >> 16)
    };
    stir(stir(a.wrapping_add(0x9e37_79b9)).wrapping_add(b).wrapping_mul(0x9e37_79b1))
}

/// The `index`th point of a key's sequence, each coordinate 0 ≤ x < 1; the first 2ᵏ points of every key lie in different cells
/// of each division of the first two axes into 2ᵏ.
pub(super) fn point<const N: usize>(index: u32, key: u32) -> [f64; N] {
    // A permutation that keeps aligned runs of 2ᵏ together.
    let index = scramble(index, key);
    #[expect(clippy::cast_possible_truncation, reason = "a small number")]
    let axis = |d: usize| f64::from(scramble(sobol(index, d), mix(key, d as u32 + 1))) / 4_294_967_296.0;
    std::array::from_fn(axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_the_published_one() {
        let at = |i| [0, 1, 2, 3].map(|d| f64::from(sobol(i, d)) / 4_294_967_296.0);
        assert_eq!(at(0), [0.0; 4]);
        assert_eq!(at(1), [0.5; 4]);
        assert_eq!(at(2), [0.25, 0.75, 0.75, 0.75]);
        assert_eq!(at(3), [0.75, 0.25, 0.25, 0.25]);
        assert_eq!(at(4), [0.125, 0.625, 0.375, 0.125]);
    }

    #[test]
    fn runs_of_a_power_of_two_put_one_point_into_each_cell_of_every_division() {
        for key in [0, 1, 77, 0xdead_beef] {
            for bits in 0..=8_u32 {
                let run = 1_u32 << bits;
                for start in [0, 3 * run] {
                    for across in 0..=bits {
                        let (columns, rows) = (1_u32 << across, 1_u32 << (bits - across));
                        let mut cells: Vec<u32> = (start..start + run)
                            .map(|i| {
                                let [x, y] = point::<2>(i, key);
                                (x * f64::from(columns)) as u32 * rows + (y * f64::from(rows)) as u32
                            })
                            .collect();
                        cells.sort_unstable();
                        assert!(cells.into_iter().eq(0..run), "key {key}: {columns}×{rows} from {start}");
                    }
                }
            }
        }
    }

    #[test]
    fn keys_give_independent_sequences() {
        // The mean of x·y over the first points of many keys, and the correlation of the first points of adjacent keys: each a
        // sum of independent numbers when keys are.
        let n = 20_000_u32;
        let first: Vec<[f64; 2]> = (0..=n).map(|key| point::<2>(0, mix(5, key))).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..n as usize).map(f).sum::<f64>() / f64::from(n);
        let centred = |i: usize, d: usize| first[i][d] - 0.5;
        for (what, found) in [
            ("x", mean(&|i| centred(i, 0))),
            ("x and y", mean(&|i| centred(i, 0) * centred(i, 1) * 3.46)),
            ("neighbours", mean(&|i| centred(i, 0) * centred(i + 1, 0) * 3.46)),
        ] {
            // Four standard errors of a number uniform over 0…1.
            assert!(found.abs() < 4.0 * 0.2887 / f64::from(n).sqrt(), "{what}: {found}");
        }
    }

    #[test]
    fn a_smooth_function_is_integrated_far_better_than_by_chance() {
        let squared = |key: u32| {
            let n = 256;
            let sum: f64 = (0..n).map(|i| point::<2>(i, key)).map(|[x, y]| (x + y * y).sin()).sum();
            // ∫ sin(x + y²) over the unit square, by the midpoint rule of 2000².
            (sum / f64::from(n) - 0.676_889_5).powi(2)
        };
        let mse = (0..64).map(|k| squared(mix(9, k))).sum::<f64>() / 64.0;
        // Random points would have the variance 0.06 / 256.
        assert!(mse < 1e-7, "{mse}");
    }
}
