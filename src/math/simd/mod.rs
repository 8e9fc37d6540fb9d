//! Eight, sixteen and thirty-two `f32` at once, on whatever the processor has.
//!
//! A [`Kernel`] is written once over [`Simd`]; [`Level::run`] compiles it for each instruction set and takes the best one
//! that the machine offers. Every operation but `mul_add` and its kin rounds as its scalar form does, so that a kernel
//! gives the same bits on every level.
//!
//! The only `unsafe` code of the library is in `avx2`, `avx512` and `neon`: a value of a level's token type exists only after
//! the processor was asked, and the operations of a level take its token.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
mod pair;
mod portable;
#[cfg(test)]
mod tests;

use std::str::FromStr;
use std::sync::OnceLock;

use thiserror::Error;

pub use portable::Portable;

/// Lanes of the boxes of a node and the triangles of a block.
pub const LANES: usize = 8;

/// Lanes of the rays of a packet.
pub const WIDE: usize = 16;

/// Lanes of the rays of a broad packet.
pub const BROAD: usize = 32;

/// Eight numbers in memory, as nodes and blocks store them.
pub type Row = [f32; LANES];

/// See [`Lanewise::rounds_surely`].
pub const ROUNDED: f64 = 1.0 / (1u64 << 40) as f64;

/// What makes a double that is too near to the middle between two floats carry over the bits of [`NEAR_MIDDLE`]: the last 29
/// bits are cut off when it is rounded, and 2⁻⁴⁰ of it is at most 2¹³ in units of the last. Twice that is kept away from.
#[cfg(target_arch = "x86_64")]
const MIDDLE: i64 = (1 << 14) - (1 << 28);

/// The bits that are zero then.
#[cfg(target_arch = "x86_64")]
const NEAR_MIDDLE: i64 = (1 << 29) - (1 << 15);

/// Arithmetic of one instruction set on `N` numbers at once. A value of the type is the proof that the machine has it.
///
/// Comparisons give a mask: bit k is set where lane k holds.
pub trait Lanewise<const N: usize>: Copy {
    /// N numbers.
    type Lanes: Copy;
    /// N numbers of double precision.
    type Doubles: Copy;

    /// One number in all lanes.
    fn splat(self, x: f32) -> Self::Lanes;
    /// From memory.
    fn load(self, row: &[f32; N]) -> Self::Lanes;
    /// To memory.
    fn store(self, a: Self::Lanes) -> [f32; N];
    /// a + b.
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a − b.
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a · b.
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a / b.
    fn div(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a · b + c, rounded once or twice: for what is bounded either way, and decides no bit of an answer.
    fn mul_add(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// a · b − c, in the same way.
    fn mul_sub(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// c − a · b, in the same way.
    fn sub_mul(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// |a|.
    fn abs(self, a: Self::Lanes) -> Self::Lanes;
    /// The greater of both; b where one is NaN.
    fn greater(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// The greater of both sizes; either where one is NaN.
    #[inline(always)]
    fn larger(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
        self.greater(self.abs(a), self.abs(b))
    }
    /// The smaller of both; b where one is NaN.
    fn smaller(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// The later of two distances along a ray, neither NaN; either where both have a negative sign or are zero. By their bits
    /// where the machine compares words in less time.
    #[inline(always)]
    fn later(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
        self.greater(a, b)
    }
    /// The sooner of two distances along a ray, neither NaN; either where both have a negative sign or are zero.
    #[inline(always)]
    fn sooner(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
        self.smaller(a, b)
    }
    /// The latest of distances along a ray, none NaN; any of them where all have a negative sign, either of two zeros.
    #[inline(always)]
    fn latest(self, a: Self::Lanes) -> f32 {
        self.greatest(a)
    }
    /// Where a distance that has no negative sign is no later than another, neither NaN; also false where that one is −0.
    #[inline(always)]
    fn in_order(self, a: Self::Lanes, b: Self::Lanes) -> u32 {
        self.at_most(a, b)
    }
    /// a < b; false where one is NaN.
    fn less(self, a: Self::Lanes, b: Self::Lanes) -> u32;
    /// a ≤ b; false where one is NaN.
    fn at_most(self, a: Self::Lanes, b: Self::Lanes) -> u32;
    /// `a` in the lanes of `mask`, else `b`.
    fn choose(self, mask: u32, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Which lanes have a negative sign, that of zero and NaN included.
    fn signs(self, a: Self::Lanes) -> u32;
    /// The sizes of `a` with the signs of `b`.
    fn with_sign(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// The smallest of all lanes, of which none is NaN; of two zeros either.
    fn least(self, a: Self::Lanes) -> f32;
    /// The greatest of all lanes, of which none is NaN; of two zeros either.
    fn greatest(self, a: Self::Lanes) -> f32;
    /// [`Self::least`] of each of four.
    #[inline(always)]
    fn least_of_each(self, [a, b, c, d]: [Self::Lanes; 4]) -> [f32; 4] {
        [self.least(a), self.least(b), self.least(c), self.least(d)]
    }
    /// A word to memory in the lanes of `mask`; the others stay.
    fn put_word(self, mask: u32, word: u32, to: &mut [u32; N]);
    /// Where a word stands.
    fn find_word(self, word: u32, among: &[u32; N]) -> u32;
    /// One number in all lanes.
    fn splat_f64(self, x: f64) -> Self::Doubles;
    /// Numbers in double precision.
    fn widen(self, a: Self::Lanes) -> Self::Doubles;
    /// The nearest numbers in single precision.
    fn narrow(self, a: Self::Doubles) -> Self::Lanes;
    /// To memory.
    fn store_f64(self, a: Self::Doubles) -> [f64; N];
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
    /// Where all numbers within a part [`ROUNDED`] of the finite `a`, which is in the normal range of single precision, have
    /// the same nearest number there; it may also be false where they have.
    #[inline(always)]
    fn rounds_surely(self, a: Self::Doubles) -> u32 {
        let room = self.mul_f64(self.abs_f64(a), self.splat_f64(ROUNDED));
        let (low, high) = (self.narrow(self.sub_f64(a, room)), self.narrow(self.add_f64(a, room)));
        self.at_most(low, high) & self.at_most(high, low)
    }
    /// a < b; false where one is NaN.
    fn less_f64(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// `a` in the lanes of `mask`, else `b`.
    fn choose_f64(self, mask: u32, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
}

/// One instruction set: eight lanes, what nodes and blocks need besides, and sixteen lanes.
pub trait Simd: Lanewise<LANES> {
    /// Sixteen lanes of the same machine.
    type Wide: Lanewise<WIDE>;
    /// Thirty-two lanes of it.
    type Broad: Lanewise<BROAD>;
    /// Whether these fit into its registers: elsewhere numbers go through memory, and sixteen lanes are faster (measured).
    const BROAD_FITS: bool;

    /// Sixteen lanes.
    fn wide(self) -> Self::Wide;
    /// Thirty-two lanes.
    fn broad(self) -> Self::Broad;
    /// Which words have their highest bit set.
    fn high_bits(self, words: &[u32; LANES]) -> u32;
    /// The row of an axis.
    fn along(self, rows: &[Row; 3], axis: Axis) -> Self::Lanes;
    /// One of six rows.
    fn pick(self, rows: &[Row; 6], pick: Pick) -> Self::Lanes;
    /// Rows of four become columns: lane k of the i-th result is number i of the k-th row.
    fn columns(self, rows: [&[f32; 4]; LANES]) -> [Self::Lanes; 4];
    /// Columns as rows again.
    fn rows(self, columns: [Self::Lanes; 4]) -> [[f32; 4]; LANES];
    /// To memory in another order: place k gets the lane, 0 to 7, that the `k`th four bits of `order` name.
    fn arrange(self, a: Self::Lanes, order: Order, to: &mut Row);
    /// Eight words to memory in another order, as [`Self::arrange`] does.
    fn arrange_words(self, words: &[u32; LANES], order: Order, to: &mut [u32; LANES]);
    /// Those of eight numbers that are at these places, by the lowest three bits of each.
    fn among(self, table: &Row, places: &[u32; LANES]) -> Self::Lanes;
    /// Tells the processor that the first four cache lines of one of both are read soon, without a branch; elements that
    /// there are not do no harm.
    fn prefetch_either<T, U>(self, first: bool, a: (&[T], usize), b: (&[U], usize));
    /// Tells the processor that all of this is read soon.
    fn prefetch<T>(self, all: &[T]);
}

/// Which of six rows, by the bytes before it: found once and used often, without a test that it is one of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pick(u32);

impl Pick {
    /// Row `i` of 0 to 5.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "less than 6 rows")]
    pub const fn new(i: usize) -> Self {
        Self((i % 6 * size_of::<Row>()) as u32)
    }

    /// The other row of a pair: 0 and 1, 2 and 3, 4 and 5.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a row is small")]
    pub const fn other(self) -> Self {
        Self(self.0 ^ size_of::<Row>() as u32)
    }
}

/// Which of three axes, by the bytes before its row: found once and used often, without a test that it is one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis(u32);

impl Axis {
    /// Axis `i` of 0 to 2.
    #[inline(always)]
    pub const fn new(i: usize) -> Self {
        Self((i % 3 * size_of::<Row>()) as u32)
    }
}

/// Lanes in some order, four bits each, the first in the lowest.
pub type Order = u32;

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

/// Room on the stack that begins where a cache line does, and makes the whole frame of the function that has it begin there.
///
/// Without it a frame begins at any multiple of sixteen bytes, and where a compiler has no registers left it keeps vectors in
/// places that may lie across two lines. Where two pages meet in one of them, rays one by one are 20 to 40 % slower, and where
/// the stack begins differs from one start of a program to the next.
#[cfg(target_arch = "x86_64")]
#[repr(align(64))]
struct LineOnStack(#[expect(dead_code, reason = "it is there to be somewhere")] u8);

#[cfg(target_arch = "x86_64")]
impl LineOnStack {
    /// Makes the caller's frame begin there. What is constant, or not looked at, would not be on the stack.
    #[inline(always)]
    fn align() {
        std::hint::black_box(&mut Self(0));
    }
}

/// An instruction set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(avx512::Avx512),
    #[cfg(target_arch = "aarch64")]
    Neon,
}

/// What [`Level::best`] gives, once it has been asked for or chosen.
static CHOSEN: OnceLock<Level> = OnceLock::new();

/// A name that is no level of this machine, and those that are.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("no instruction set of this machine is named {0:?}; there are: {names}", names = names(.1))]
pub struct UnknownLevel(String, Vec<Level>);

/// As they are typed.
fn names(levels: &[Level]) -> String {
    levels.iter().map(|level| level.word()).collect::<Vec<_>>().join(", ")
}

impl FromStr for Level {
    type Err = UnknownLevel;

    /// One of [`Level::all`], by its name or [`Level::word`].
    fn from_str(text: &str) -> Result<Self, UnknownLevel> {
        let all = Self::all();
        let named = |level: &&Self| [level.name(), level.word()].iter().any(|name| name.eq_ignore_ascii_case(text));
        all.iter().find(named).copied().ok_or_else(|| UnknownLevel(text.into(), all.clone()))
    }
}

/// Runs a kernel's portable form, apart from where the others are called: without optimisation kernels have frames of a
/// megabyte, and one that holds two of them is too large for the stacks of threads.
#[inline(never)]
pub(crate) fn portably<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Portable)
}

impl Level {
    /// What every machine has.
    pub const PORTABLE: Self = Self(Set::Portable);

    /// All that this machine has, the fastest last.
    pub fn all() -> Vec<Self> {
        let all = [Self::PORTABLE].into_iter();
        #[cfg(target_arch = "x86_64")]
        let all = all
            .chain(avx2::Avx2::detect().map(|token| Self(Set::Avx2(token))))
            .chain(avx512::Avx512::detect().map(|token| Self(Set::Avx512(token))));
        #[cfg(target_arch = "aarch64")]
        let all = all.chain([Self(Set::Neon)]);
        all.collect()
    }

    /// The fastest that this machine has, unless another was chosen ([`Self::choose`]).
    #[inline]
    pub fn best() -> Self {
        *CHOSEN.get_or_init(|| *Self::all().last().unwrap_or(&Self::PORTABLE))
    }

    /// Makes this the level that [`Self::best`] gives to the whole process: to be called before anything is loaded or built.
    /// Answers are the same on every level, times are not. Levels are compared within a process by
    /// [`Wide::at_level`](crate::accel::Wide::at_level).
    ///
    /// # Errors
    ///
    /// The level that was given out before, where it is another.
    pub fn choose(self) -> Result<(), Self> {
        let chosen = *CHOSEN.get_or_init(|| self);
        if chosen == self { Ok(()) } else { Err(chosen) }
    }

    /// As printed.
    pub fn name(self) -> &'static str {
        match self.0 {
            Set::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(_) => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(_) => "AVX-512",
            #[cfg(target_arch = "aarch64")]
            Set::Neon => "NEON",
        }
    }

    /// As typed: the name in small letters, without a hyphen.
    pub fn word(self) -> &'static str {
        match self.0 {
            Set::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(_) => "avx512",
            #[cfg(target_arch = "aarch64")]
            Set::Neon => "neon",
        }
    }

    /// Runs a kernel.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Portable => portably(kernel),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(token) => token.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(token) => token.run(kernel),
            #[cfg(target_arch = "aarch64")]
            Set::Neon => neon::Neon.run(kernel),
        }
    }

    /// Runs a kernel for which code for the widest lanes is not worth its size: AVX2 where there is AVX-512.
    #[inline]
    pub fn run_narrow<K: Kernel>(self, kernel: K) -> K::Output {
        if self == Self::PORTABLE { portably(kernel) } else { self.run_vectors(kernel) }
    }

    /// Runs a kernel that is compiled for vectors alone, AVX2's or NEON's: the scalar form takes many times as long to
    /// compile, too long for kernels that only tests run.
    ///
    /// # Panics
    ///
    /// Where there are no such vectors.
    #[inline]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64")),
        expect(unused_variables, reason = "no other machine has such vectors")
    )]
    pub(crate) fn run_vectors<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Set::Avx512(token) => token.narrow().run(kernel),
            #[cfg(target_arch = "x86_64")]
            Set::Avx2(token) => token.run(kernel),
            #[cfg(target_arch = "aarch64")]
            Set::Neon => neon::Neon.run(kernel),
            Set::Portable => unreachable!("{} has no vectors of eight", self.name()),
        }
    }
}
