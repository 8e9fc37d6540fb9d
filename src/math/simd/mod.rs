//! SIMD: eight, sixteen and thirty-two `f32` lanes on the best instruction set of the processor.
//!
//! A [`Kernel`] is written once over [`Simd`]; [`Level::run`] compiles it for each instruction set and takes the best one of
//! the machine. Every operation except `mul_add` and its kin rounds like its scalar form, so that a kernel gives the same
//! bits on every level.
//!
//! The only `unsafe` code of the library is in `avx2`, `avx512` and `neon`: a token of a level exists only after the
//! processor's features were checked, and the operations of a level take its token.

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

/// Lanes for the boxes of a node and the triangles of a block.
pub const LANES: usize = 8;

/// Lanes for the rays of a packet.
pub const WIDE: usize = 16;

/// Lanes for the rays of a broad packet.
pub const BROAD: usize = 32;

/// Eight numbers in memory, as nodes and blocks store them.
pub type Row = [f32; LANES];

/// Relative margin of [`Lanewise::rounds_surely`].
pub const ROUNDED: f64 = 1.0 / (1u64 << 40) as f64;

/// Added to the bits of a double, carries exactly if it is too near to the midpoint between two floats, which clears the bits
/// of [`NEAR_MIDDLE`]: rounding cuts off the last 29 bits, and 2⁻⁴⁰ of the number is at most 2¹³ in units of the last. The
/// margin is twice that.
#[cfg(target_arch = "x86_64")]
const MIDDLE: i64 = (1 << 14) - (1 << 28);

/// Bits that are zero near a midpoint, after [`MIDDLE`] is added.
#[cfg(target_arch = "x86_64")]
const NEAR_MIDDLE: i64 = (1 << 29) - (1 << 15);

/// Arithmetic of one instruction set on `N` numbers at once. A value of the type proves that the machine has it.
///
/// Comparisons return a mask: bit k is set if the comparison holds in lane k.
pub trait Lanewise<const N: usize>: Copy {
    /// `N` numbers in single precision.
    type Lanes: Copy;
    /// `N` numbers in double precision.
    type Doubles: Copy;

    /// Broadcasts one number to all lanes.
    fn splat(self, x: f32) -> Self::Lanes;
    /// Loads a row.
    fn load(self, row: &[f32; N]) -> Self::Lanes;
    /// Stores a row.
    fn store(self, a: Self::Lanes) -> [f32; N];
    /// a + b.
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a − b.
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a · b.
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a / b.
    fn div(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// a · b + c, rounded once or twice: for values whose error is bounded either way, and that decide no bit of an answer.
    fn mul_add(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// a · b − c, rounded once or twice.
    fn mul_sub(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// c − a · b, rounded once or twice.
    fn sub_mul(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes;
    /// |a|.
    fn abs(self, a: Self::Lanes) -> Self::Lanes;
    /// Maximum; b if one is NaN.
    fn greater(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Maximum of the absolute values; either if one is NaN.
    #[inline(always)]
    fn larger(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
        self.greater(self.abs(a), self.abs(b))
    }
    /// Minimum; b if one is NaN.
    fn smaller(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Later of two distances along a ray, neither NaN; either if both have a negative sign or are zero. Compares bits where
    /// the machine compares words faster.
    #[inline(always)]
    fn later(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
        self.greater(a, b)
    }
    /// Sooner of two distances along a ray, neither NaN; either if both have a negative sign or are zero.
    #[inline(always)]
    fn sooner(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
        self.smaller(a, b)
    }
    /// Latest of the distances along a ray in all lanes, none NaN; any if all have a negative sign, either of two zeros.
    #[inline(always)]
    fn latest(self, a: Self::Lanes) -> f32 {
        self.greatest(a)
    }
    /// a ≤ b for distances, neither NaN, where a has no negative sign; also false where b is −0.
    #[inline(always)]
    fn in_order(self, a: Self::Lanes, b: Self::Lanes) -> u32 {
        self.at_most(a, b)
    }
    /// a < b; false if one is NaN.
    fn less(self, a: Self::Lanes, b: Self::Lanes) -> u32;
    /// a ≤ b; false if one is NaN.
    fn at_most(self, a: Self::Lanes, b: Self::Lanes) -> u32;
    /// `a` in the lanes of `mask`, else `b`.
    fn choose(self, mask: u32, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Mask of the lanes with a negative sign, that of zero and NaN included.
    fn signs(self, a: Self::Lanes) -> u32;
    /// Absolute values of `a` with the signs of `b`.
    fn with_sign(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// Minimum of all lanes, none NaN; either of two zeros.
    fn least(self, a: Self::Lanes) -> f32;
    /// Maximum of all lanes, none NaN; either of two zeros.
    fn greatest(self, a: Self::Lanes) -> f32;
    /// [`Self::least`] of each of four vectors.
    #[inline(always)]
    fn least_of_each(self, [a, b, c, d]: [Self::Lanes; 4]) -> [f32; 4] {
        [self.least(a), self.least(b), self.least(c), self.least(d)]
    }
    /// Stores a word in the lanes of `mask`; the others stay.
    fn put_word(self, mask: u32, word: u32, to: &mut [u32; N]);
    /// Mask of the places where `word` stands.
    fn find_word(self, word: u32, among: &[u32; N]) -> u32;
    /// Broadcasts one number to all lanes.
    fn splat_f64(self, x: f64) -> Self::Doubles;
    /// Converts to double precision.
    fn widen(self, a: Self::Lanes) -> Self::Doubles;
    /// Rounds to single precision.
    fn narrow(self, a: Self::Doubles) -> Self::Lanes;
    /// Stores a row in double precision.
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
    /// Maximum; b if one is NaN.
    fn greater_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Minimum; b if one is NaN.
    fn smaller_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
    /// Whether all numbers within a relative distance of [`ROUNDED`] of the finite `a`, which is in the normal range of
    /// single precision, round to the same single; may also be false where they do.
    #[inline(always)]
    fn rounds_surely(self, a: Self::Doubles) -> u32 {
        let room = self.mul_f64(self.abs_f64(a), self.splat_f64(ROUNDED));
        let (low, high) = (self.narrow(self.sub_f64(a, room)), self.narrow(self.add_f64(a, room)));
        self.at_most(low, high) & self.at_most(high, low)
    }
    /// a < b; false if one is NaN.
    fn less_f64(self, a: Self::Doubles, b: Self::Doubles) -> u32;
    /// `a` in the lanes of `mask`, else `b`.
    fn choose_f64(self, mask: u32, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles;
}

/// One instruction set: eight lanes with the operations for nodes and blocks, and wider lanes.
pub trait Simd: Lanewise<LANES> {
    /// Sixteen lanes of the same machine.
    type Wide: Lanewise<WIDE>;
    /// Thirty-two lanes of the same machine.
    type Broad: Lanewise<BROAD>;
    /// Whether thirty-two lanes fit into the registers: elsewhere values spill to memory, and sixteen lanes are faster
    /// (measured).
    const BROAD_FITS: bool;

    /// Returns the token for sixteen lanes.
    fn wide(self) -> Self::Wide;
    /// Returns the token for thirty-two lanes.
    fn broad(self) -> Self::Broad;
    /// Mask of the words whose highest bit is set.
    fn high_bits(self, words: &[u32; LANES]) -> u32;
    /// Loads the row of an axis.
    fn along(self, rows: &[Row; 3], axis: Axis) -> Self::Lanes;
    /// Loads one of six rows.
    fn pick(self, rows: &[Row; 6], pick: Pick) -> Self::Lanes;
    /// Transposes rows of four: lane k of the i-th result is number i of the k-th row.
    fn columns(self, rows: [&[f32; 4]; LANES]) -> [Self::Lanes; 4];
    /// Transposes back to rows of four.
    fn rows(self, columns: [Self::Lanes; 4]) -> [[f32; 4]; LANES];
    /// Stores the lanes in another order: place k gets the lane, 0 to 7, in the `k`th four bits of `order`.
    fn arrange(self, a: Self::Lanes, order: Order, to: &mut Row);
    /// Stores eight words in another order, like [`Self::arrange`].
    fn arrange_words(self, words: &[u32; LANES], order: Order, to: &mut [u32; LANES]);
    /// Looks up eight numbers in a table by the lowest three bits of each place.
    fn among(self, table: &Row, places: &[u32; LANES]) -> Self::Lanes;
    /// Prefetches the first four cache lines of one of two elements, without a branch; indices out of range do no harm.
    fn prefetch_either<T, U>(self, first: bool, a: (&[T], usize), b: (&[U], usize));
    /// Prefetches a whole slice.
    fn prefetch<T>(self, all: &[T]);
}

/// Index of one of six rows, as a byte offset: computed once and used often, without a bounds check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pick(u32);

impl Pick {
    /// Row `i` of 0 to 5.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "less than 6 rows")]
    pub const fn new(i: usize) -> Self {
        Self((i % 6 * size_of::<Row>()) as u32)
    }

    /// The other row of its pair: 0 and 1, 2 and 3, 4 and 5.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a row is small")]
    pub const fn other(self) -> Self {
        Self(self.0 ^ size_of::<Row>() as u32)
    }
}

/// Index of one of three axes, as the byte offset of its row: computed once and used often, without a bounds check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis(u32);

impl Axis {
    /// Axis `i` of 0 to 2.
    #[inline(always)]
    pub const fn new(i: usize) -> Self {
        Self((i % 3 * size_of::<Row>()) as u32)
    }
}

/// Permutation of lanes, four bits each, the first in the lowest.
pub type Order = u32;

/// Code that is compiled once per instruction set.
///
/// `run` and everything it calls with a token must be `#[inline(always)]`. Lanes must not pass through closures or `map`:
/// code that is not inlined is compiled without the instructions, and lanes go through memory.
pub trait Kernel {
    /// Result of the kernel.
    type Output;

    /// Runs on the given instruction set.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Stack variable aligned to a cache line, which aligns the whole frame of its function.
///
/// Without it a frame begins at any multiple of sixteen bytes, and spilled vectors may lie across two cache lines. Where such
/// a line boundary is also a page boundary, rays one by one are 20 to 40 % slower, and the start of the stack differs from
/// one run of a program to the next.
#[cfg(target_arch = "x86_64")]
#[repr(align(64))]
struct LineOnStack(#[expect(dead_code, reason = "it is there to be somewhere")] u8);

#[cfg(target_arch = "x86_64")]
impl LineOnStack {
    /// Aligns the caller's frame. The variable must be mutable and observed to be on the stack at all.
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

/// Result of [`Level::best`], once it has been asked for or chosen.
static CHOSEN: OnceLock<Level> = OnceLock::new();

/// Error: a name that is no level of this machine, with the levels that exist.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("no instruction set of this machine is named {0:?}; there are: {names}", names = names(.1))]
pub struct UnknownLevel(String, Vec<Level>);

/// Names of the levels as typed.
fn names(levels: &[Level]) -> String {
    levels.iter().map(|level| level.word()).collect::<Vec<_>>().join(", ")
}

impl FromStr for Level {
    type Err = UnknownLevel;

    /// Parses the name or [`Level::word`] of one of [`Level::all`].
    fn from_str(text: &str) -> Result<Self, UnknownLevel> {
        let all = Self::all();
        let named = |level: &&Self| [level.name(), level.word()].iter().any(|name| name.eq_ignore_ascii_case(text));
        all.iter().find(named).copied().ok_or_else(|| UnknownLevel(text.into(), all.clone()))
    }
}

/// Runs a kernel's portable form in a function of its own: without optimisation kernels have frames of a megabyte, and a
/// frame with two of them is too large for the stacks of threads.
#[inline(never)]
pub(crate) fn portably<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Portable)
}

impl Level {
    /// The level that every machine has.
    pub const PORTABLE: Self = Self(Set::Portable);

    /// All levels of this machine, the fastest last.
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

    /// Fastest level of this machine, unless another was chosen ([`Self::choose`]).
    #[inline]
    pub fn best() -> Self {
        *CHOSEN.get_or_init(|| *Self::all().last().unwrap_or(&Self::PORTABLE))
    }

    /// Makes this the result of [`Self::best`] for the whole process: to be called before anything is loaded or built.
    /// Answers are the same on every level, times are not. To compare levels within a process, use
    /// [`Wide::at_level`](crate::accel::Wide::at_level).
    ///
    /// # Errors
    ///
    /// The level already in use, if it is another one.
    pub fn choose(self) -> Result<(), Self> {
        let chosen = *CHOSEN.get_or_init(|| self);
        if chosen == self { Ok(()) } else { Err(chosen) }
    }

    /// Name in reports.
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

    /// Name on the command line: lower case, without a hyphen.
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

    /// Runs a kernel for which the code size of the widest lanes does not pay: with AVX2 instead of AVX-512.
    #[inline]
    pub fn run_narrow<K: Kernel>(self, kernel: K) -> K::Output {
        if self == Self::PORTABLE { portably(kernel) } else { self.run_vectors(kernel) }
    }

    /// Runs a kernel that is compiled for AVX2 or NEON only: compiling the scalar form takes many times as long, too long for
    /// kernels that only tests run.
    ///
    /// # Panics
    ///
    /// If the machine has no such vectors.
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
