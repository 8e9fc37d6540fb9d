//! Eight `f32` at once, on whatever the processor has.
//!
//! A [`Kernel`] is written once over [`Simd`]; [`Level::run`] compiles it for each instruction set and takes the best one
//! that the machine offers. Nothing is fused and every operation rounds as its scalar form does, so that a kernel gives
//! the same bits on every level.
//!
//! The only `unsafe` code of the library is here and in [`avx2`](self): a value of a level's token type exists only after
//! the processor was asked, and the operations of a level take its token.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;

use std::sync::LazyLock;

pub use portable::Portable;

/// Numbers in one register.
pub const LANES: usize = 8;

/// Eight numbers in memory, as nodes and blocks store them.
pub type Row = [f32; LANES];

/// The operations of one instruction set. A value of the type is the proof that the machine has it.
///
/// Comparisons give a mask: bit k is set where lane k holds.
pub trait Simd: Copy {
    /// Eight numbers.
    type Lanes: Copy;
    /// Eight numbers of double precision.
    type Doubles: Copy;

    /// The same number in all lanes.
    fn splat(self, x: f32) -> Self::Lanes;
    /// From memory.
    fn load(self, row: &Row) -> Self::Lanes;
    /// One of six rows.
    fn pick(self, rows: &[Row; 6], pick: Pick) -> Self::Lanes;
    /// To memory.
    fn store(self, a: Self::Lanes) -> Row;
    /// a + b.
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a − b.
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a · b.
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a / b.
    fn div(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// |a|.
    fn abs(self, a: Self::Lanes) -> Self::Lanes;
    /// The greater of both; b where one is NaN.
    fn greater(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// The smaller of both; b where one is NaN.
    fn smaller(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a < b; false where one is NaN.
    fn less(self, a: Self::Lanes, b: Self::Lanes) -> u32;
    /// a ≤ b; false where one is NaN.
    fn at_most(self, a: Self::Lanes, b: Self::Lanes) -> u32;
    /// Rows become columns: lane k of the i-th result is lane i of the k-th row.
    fn transpose(self, rows: &[Row; LANES]) -> [Self::Lanes; LANES];
    /// The same number in all lanes.
    fn splat_f64(self, x: f64) -> Self::Doubles;
    /// The same numbers in double precision.
    fn widen(self, a: Self::Lanes) -> Self::Doubles;
    /// The nearest numbers in single precision.
    fn narrow(self, a: Self::Doubles) -> Self::Lanes;
    /// From memory.
    fn load_f64(self, row: &[f64; LANES]) -> Self::Doubles;
    /// To memory.
    fn store_f64(self, a: Self::Doubles) -> [f64; LANES];
    /// a + b.
    fn add_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// a − b.
    fn sub_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// a · b.
    fn mul_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// a / b.
    fn div_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// |a|.
    fn abs_f64(self, a: Self::Doubles) -> Self::Doubles;
    /// The greater of both; b where one is NaN.
    fn greater_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// The smaller of both; b where one is NaN.
    fn smaller_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// a < b; false where one is NaN.
    fn less_f64(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// To memory in another order: place k gets the lane that byte k of `order` names, 0 to 7.
    fn arrange(self, a: Self::Lanes, order: Order, to: &mut Row);
    /// The same for eight words.
    fn arrange_words(self, words: &[u32; LANES], order: Order, to: &mut [u32; LANES]);
    /// Tells the processor that this is read soon.
    fn prefetch<T>(self, at: &T);
}

/// Which of six rows: found once and used often, without a test that it is one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pick(usize);

impl Pick {
    /// Row `i` of 0 to 5.
    #[inline(always)]
    pub const fn new(i: usize) -> Self {
        Self(i % 6)
    }
}

/// Lanes in some order, one a byte, the first in the lowest.
pub type Order = u64;

/// Code that is compiled once for each instruction set.
///
/// `run` and all that it calls with a token are `#[inline(always)]`. Lanes must not pass through closures or `map`: what
/// is not inlined is compiled without the instructions, and lanes go through memory.
pub trait Kernel {
    /// What it gives.
    type Output;

    /// Runs on one instruction set.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
}

static BEST: LazyLock<Level> = LazyLock::new(|| *Level::all().last().unwrap_or(&Level::PORTABLE));

impl Level {
    /// What every machine has.
    pub const PORTABLE: Self = Self(Set::Portable);

    /// All that this machine has, the fastest last.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::PORTABLE];
        #[cfg(target_arch = "x86_64")]
        all.extend(avx2::Avx2::detect().map(|token| Self(Set::Avx2(token))));
        all
    }

    /// The fastest that this machine has.
    #[inline]
    pub fn best() -> Self {
        *BEST
    }

    /// As printed.
    pub fn name(self) -> &'static str {
        match self.0 {
            Set::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(_) => "AVX2",
        }
    }

    /// Runs a kernel.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(token) => token.run(kernel),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All operations in double precision on the same rows, as bits.
    struct Doubly(Row, Row);

    impl Kernel for Doubly {
        type Output = Vec<u64>;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Vec<u64> {
            let third = s.splat_f64(1.0 / 3.0);
            let a = s.mul_f64(s.widen(s.load(&self.0)), third);
            let b = s.load_f64(&self.1.map(f64::from));
            let results = [
                s.add_f64(a, b),
                s.sub_f64(a, b),
                s.mul_f64(a, b),
                s.div_f64(a, b),
                s.abs_f64(a),
                s.greater_f64(a, b),
                s.smaller_f64(a, b),
                s.widen(s.narrow(a)),
            ];
            let bits = |x: f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
            let numbers = results.into_iter().flat_map(|r| s.store_f64(r)).map(bits);
            numbers.chain([u64::from(s.less_f64(a, b))]).collect()
        }
    }

    /// Eight rows as columns, and back.
    struct Turned([Row; LANES]);

    impl Kernel for Turned {
        type Output = [Row; LANES];

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> [Row; LANES] {
            let columns = s.transpose(&self.0);
            let mut rows = [[0.0; LANES]; LANES];
            for k in 0..LANES {
                rows[k] = s.store(columns[k]);
            }
            rows
        }
    }

    #[test]
    fn rows_become_columns_on_every_level() {
        let rows: [Row; LANES] = std::array::from_fn(|i| std::array::from_fn(|k| (8 * i + k) as f32));
        for level in Level::all() {
            let turned = level.run(Turned(rows));
            assert!((0..64).all(|i| turned[i % 8][i / 8] == rows[i / 8][i % 8]), "{}", level.name());
        }
    }

    const HARD: [f32; 10] =
        [0.0, -0.0, 1.0, -3.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-42, f32::MAX, f32::MIN_POSITIVE];

    /// All operations on two rows, as bits.
    struct Everything(Row, Row);

    impl Kernel for Everything {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Vec<u32> {
            let (a, b) = (s.load(&self.0), s.load(&self.1));
            let results = [
                s.add(a, b),
                s.sub(a, b),
                s.mul(a, b),
                s.div(a, b),
                s.abs(a),
                s.greater(a, b),
                s.smaller(a, b),
                s.splat(self.0[1]),
            ];
            // The sign and payload of a NaN are nobody's business.
            let bits = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
            let order = 0x0706_0102_0005_0304;
            let (mut arranged, mut words) = ([0.0; LANES], [0; LANES]);
            s.arrange(a, order, &mut arranged);
            s.arrange_words(&self.1.map(f32::to_bits), order, &mut words);
            s.prefetch(&self.0);
            let mut rows = [self.0; 6];
            rows[4] = self.1;
            let picked = s.store(s.pick(&rows, Pick::new(4)));
            let numbers = results
                .into_iter()
                .flat_map(|r| s.store(r))
                .chain(arranged)
                .chain(picked)
                .chain(words.map(f32::from_bits))
                .map(bits);
            numbers.chain([s.less(a, b), s.at_most(a, b)]).collect()
        }
    }

    #[test]
    fn every_level_rounds_and_compares_like_plain_numbers() {
        for (i, &x) in HARD.iter().enumerate() {
            for &y in &HARD {
                let a: Row = std::array::from_fn(|k| HARD[(i + k) % HARD.len()]);
                let b: Row = std::array::from_fn(|k| if k % 2 == 0 { x } else { y });
                let expected = Level::PORTABLE.run(Everything(a, b));
                for level in Level::all() {
                    assert_eq!(level.run(Everything(a, b)), expected, "{} {a:?} {b:?}", level.name());
                    let doubly = Level::PORTABLE.run(Doubly(a, b));
                    assert_eq!(level.run(Doubly(a, b)), doubly, "{} {a:?} {b:?}", level.name());
                }
            }
        }
    }

    #[test]
    fn the_second_operand_wins_over_nan() {
        let s = Portable;
        let (nan, one) = (s.splat(f32::NAN), s.splat(1.0));
        assert_eq!((s.store(s.greater(nan, one))[0], s.store(s.smaller(nan, one))[0]), (1.0, 1.0));
        assert!(s.store(s.greater(one, nan))[0].is_nan() && s.store(s.smaller(one, nan))[0].is_nan());
        assert_eq!((s.less(nan, one), s.at_most(one, nan), s.less(one, s.splat(2.0))), (0, 0, 255));
    }
}
