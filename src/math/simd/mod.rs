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

    /// The same number in all lanes.
    fn splat(self, x: f32) -> Self::Lanes;
    /// From memory.
    fn load(self, row: &Row) -> Self::Lanes;
    /// To memory.
    fn store(self, a: Self::Lanes) -> Row;
    /// a + b.
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a − b.
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a · b.
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
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
}

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

    const HARD: [f32; 10] =
        [0.0, -0.0, 1.0, -3.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-42, f32::MAX, f32::MIN_POSITIVE];

    /// All operations on two rows, as bits.
    struct Everything(Row, Row);

    impl Kernel for Everything {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Vec<u32> {
            let (a, b) = (s.load(&self.0), s.load(&self.1));
            let results =
                [s.add(a, b), s.sub(a, b), s.mul(a, b), s.abs(a), s.greater(a, b), s.smaller(a, b), s.splat(self.0[1])];
            // The sign and payload of a NaN are nobody's business.
            let bits = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
            let numbers = results.into_iter().flat_map(|r| s.store(r)).map(bits);
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
