//! Eight lanes in two 128-bit registers of ARMv8.
//!
//! Invariant of every `unsafe` here: every processor of the family has the instructions, and the compiler knows.

#![expect(unsafe_code, reason = "instructions that every processor of the family has; see the module's invariant")]

use std::arch::aarch64::*;

use super::pair::Pair;
use super::{Axis, Kernel, LANES, Lanewise, Order, Pick, Row, Simd};

/// Token of instructions that every processor of the family has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Neon;

impl Neon {
    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}

type Floats = [float32x4_t; 2];
type Doubles = [float64x2_t; 4];

#[inline(always)]
fn load(numbers: &[f32; 4]) -> float32x4_t {
    // SAFETY: reads the four numbers, with no demand on alignment.
    unsafe { vld1q_f32(numbers.as_ptr()) }
}

#[inline(always)]
fn store(a: float32x4_t, to: &mut [f32; 4]) {
    // SAFETY: writes the four numbers, with no demand on alignment.
    unsafe { vst1q_f32(to.as_mut_ptr(), a) };
}

#[inline(always)]
fn load_words(words: &[u32; 4]) -> uint32x4_t {
    // SAFETY: reads the four words, with no demand on alignment.
    unsafe { vld1q_u32(words.as_ptr()) }
}

#[inline(always)]
fn store_words(a: uint32x4_t, to: &mut [u32; 4]) {
    // SAFETY: writes the four words, with no demand on alignment.
    unsafe { vst1q_u32(to.as_mut_ptr(), a) };
}

#[inline(always)]
fn load_bytes(bytes: &[u8; 16]) -> uint8x16_t {
    // SAFETY: reads the sixteen bytes.
    unsafe { vld1q_u8(bytes.as_ptr()) }
}

#[inline(always)]
fn store_pair(a: float64x2_t, to: &mut [f64; 2]) {
    // SAFETY: writes both numbers, with no demand on alignment.
    unsafe { vst1q_f64(to.as_mut_ptr(), a) };
}

/// Bit mask of the lanes, out of four, whose bits are all set.
#[inline(always)]
fn mask(holds: uint32x4_t) -> u32 {
    // SAFETY: every processor of the family has the instructions.
    unsafe { vaddvq_u32(vandq_u32(holds, load_words(&[1, 2, 4, 8]))) }
}

/// Expands a mask of four to lanes of all ones or zeros.
#[inline(always)]
fn lanes_in(mask: u32) -> uint32x4_t {
    // SAFETY: every processor of the family has the instructions.
    unsafe { vtstq_u32(vdupq_n_u32(mask), load_words(&[1, 2, 4, 8])) }
}

/// Expands a mask of two to lanes of all ones or zeros.
#[inline(always)]
fn pair_in(mask: u32) -> uint64x2_t {
    // SAFETY: every processor of the family has the instructions.
    unsafe {
        let all = |holds: u32| u64::from(holds & 1).wrapping_neg();
        vcombine_u64(vcreate_u64(all(mask)), vcreate_u64(all(mask >> 1)))
    }
}

/// Transposes four rows of four; its own inverse.
#[inline(always)]
fn turned([a, b, c, d]: [float32x4_t; 4]) -> [float32x4_t; 4] {
    // SAFETY: every processor of the family has the instructions.
    unsafe {
        let (ab, ab_odd) = (vtrn1q_f32(a, b), vtrn2q_f32(a, b));
        let (cd, cd_odd) = (vtrn1q_f32(c, d), vtrn2q_f32(c, d));
        [
            vcombine_f32(vget_low_f32(ab), vget_low_f32(cd)),
            vcombine_f32(vget_low_f32(ab_odd), vget_low_f32(cd_odd)),
            vcombine_f32(vget_high_f32(ab), vget_high_f32(cd)),
            vcombine_f32(vget_high_f32(ab_odd), vget_high_f32(cd_odd)),
        ]
    }
}

/// Permutes eight words.
#[inline(always)]
fn arranged(low: uint8x16_t, high: uint8x16_t, order: Order) -> [uint8x16_t; 2] {
    // SAFETY: every processor of the family has the instructions.
    unsafe {
        let lanes = vcombine_u8(vcreate_u8(in_bytes(order)), vcreate_u8(in_bytes(order)));
        let bytes = |places: [u8; 16]| {
            let lane = vqtbl1q_u8(lanes, load_bytes(&places));
            let byte = load_bytes(&[0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]);
            vqtbl2q_u8(uint8x16x2_t(low, high), vaddq_u8(vshlq_n_u8::<2>(lane), byte))
        };
        [
            bytes([0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3]),
            bytes([4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7]),
        ]
    }
}

impl Lanewise<LANES> for Neon {
    type Lanes = Floats;
    type Doubles = Doubles;

    #[inline(always)]
    fn splat(self, x: f32) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vdupq_n_f32(x); 2] }
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Floats {
        let halves = row.as_chunks().0;
        [load(&halves[0]), load(&halves[1])]
    }

    #[inline(always)]
    fn store(self, a: Floats) -> Row {
        let mut row = [0.0; LANES];
        let halves = row.as_chunks_mut().0;
        store(a[0], &mut halves[0]);
        store(a[1], &mut halves[1]);
        row
    }

    #[inline(always)]
    fn add(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vaddq_f32(a[0], b[0]), vaddq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn sub(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vsubq_f32(a[0], b[0]), vsubq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vmulq_f32(a[0], b[0]), vmulq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn div(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vdivq_f32(a[0], b[0]), vdivq_f32(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul_add(self, a: Floats, b: Floats, c: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vfmaq_f32(c[0], a[0], b[0]), vfmaq_f32(c[1], a[1], b[1])] }
    }

    #[inline(always)]
    fn mul_sub(self, a: Floats, b: Floats, c: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vfmaq_f32(vnegq_f32(c[0]), a[0], b[0]), vfmaq_f32(vnegq_f32(c[1]), a[1], b[1])] }
    }

    #[inline(always)]
    fn sub_mul(self, a: Floats, b: Floats, c: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vfmsq_f32(c[0], a[0], b[0]), vfmsq_f32(c[1], a[1], b[1])] }
    }

    #[inline(always)]
    fn abs(self, a: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vabsq_f32(a[0]), vabsq_f32(a[1])] }
    }

    #[inline(always)]
    fn greater(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let of = |a, b| vbslq_f32(vcgtq_f32(a, b), a, b);
            [of(a[0], b[0]), of(a[1], b[1])]
        }
    }

    #[inline(always)]
    fn smaller(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let of = |a, b| vbslq_f32(vcltq_f32(a, b), a, b);
            [of(a[0], b[0]), of(a[1], b[1])]
        }
    }

    #[inline(always)]
    fn less(self, a: Floats, b: Floats) -> u32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe { mask(vcltq_f32(a[0], b[0])) | mask(vcltq_f32(a[1], b[1])) << 4 }
    }

    #[inline(always)]
    fn at_most(self, a: Floats, b: Floats) -> u32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe { mask(vcleq_f32(a[0], b[0])) | mask(vcleq_f32(a[1], b[1])) << 4 }
    }

    #[inline(always)]
    fn choose(self, mask: u32, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vbslq_f32(lanes_in(mask), a[0], b[0]), vbslq_f32(lanes_in(mask >> 4), a[1], b[1])] }
    }

    #[inline(always)]
    fn signs(self, a: Floats) -> u32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let negative = |a| mask(vreinterpretq_u32_s32(vshrq_n_s32::<31>(vreinterpretq_s32_f32(a))));
            negative(a[0]) | negative(a[1]) << 4
        }
    }

    #[inline(always)]
    fn with_sign(self, a: Floats, b: Floats) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let sign = vdupq_n_u32(1 << 31);
            [vbslq_f32(sign, b[0], a[0]), vbslq_f32(sign, b[1], a[1])]
        }
    }

    #[inline(always)]
    fn least(self, a: Floats) -> f32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe { vminvq_f32(vminq_f32(a[0], a[1])) }
    }

    #[inline(always)]
    fn greatest(self, a: Floats) -> f32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe { vmaxvq_f32(vmaxq_f32(a[0], a[1])) }
    }

    #[inline(always)]
    fn put_word(self, mask: u32, word: u32, to: &mut [u32; LANES]) {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let (halves, word) = (to.as_chunks_mut().0, vdupq_n_u32(word));
            let (low, high) = (load_words(&halves[0]), load_words(&halves[1]));
            store_words(vbslq_u32(lanes_in(mask), word, low), &mut halves[0]);
            store_words(vbslq_u32(lanes_in(mask >> 4), word, high), &mut halves[1]);
        }
    }

    #[inline(always)]
    fn find_word(self, word: u32, among: &[u32; LANES]) -> u32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let (halves, word) = (among.as_chunks().0, vdupq_n_u32(word));
            mask(vceqq_u32(load_words(&halves[0]), word)) | mask(vceqq_u32(load_words(&halves[1]), word)) << 4
        }
    }

    #[inline(always)]
    fn splat_f64(self, x: f64) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vdupq_n_f64(x); 4] }
    }

    #[inline(always)]
    fn widen(self, a: Floats) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            [
                vcvt_f64_f32(vget_low_f32(a[0])),
                vcvt_high_f64_f32(a[0]),
                vcvt_f64_f32(vget_low_f32(a[1])),
                vcvt_high_f64_f32(a[1]),
            ]
        }
    }

    #[inline(always)]
    fn narrow(self, a: Doubles) -> Floats {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vcvt_high_f32_f64(vcvt_f32_f64(a[0]), a[1]), vcvt_high_f32_f64(vcvt_f32_f64(a[2]), a[3])] }
    }

    #[inline(always)]
    fn store_f64(self, a: Doubles) -> [f64; LANES] {
        let mut row = [0.0; LANES];
        let pairs = row.as_chunks_mut().0;
        store_pair(a[0], &mut pairs[0]);
        store_pair(a[1], &mut pairs[1]);
        store_pair(a[2], &mut pairs[2]);
        store_pair(a[3], &mut pairs[3]);
        row
    }

    #[inline(always)]
    fn add_f64(self, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vaddq_f64(a[0], b[0]), vaddq_f64(a[1], b[1]), vaddq_f64(a[2], b[2]), vaddq_f64(a[3], b[3])] }
    }

    #[inline(always)]
    fn sub_f64(self, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vsubq_f64(a[0], b[0]), vsubq_f64(a[1], b[1]), vsubq_f64(a[2], b[2]), vsubq_f64(a[3], b[3])] }
    }

    #[inline(always)]
    fn mul_f64(self, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vmulq_f64(a[0], b[0]), vmulq_f64(a[1], b[1]), vmulq_f64(a[2], b[2]), vmulq_f64(a[3], b[3])] }
    }

    #[inline(always)]
    fn div_f64(self, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vdivq_f64(a[0], b[0]), vdivq_f64(a[1], b[1]), vdivq_f64(a[2], b[2]), vdivq_f64(a[3], b[3])] }
    }

    #[inline(always)]
    fn abs_f64(self, a: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe { [vabsq_f64(a[0]), vabsq_f64(a[1]), vabsq_f64(a[2]), vabsq_f64(a[3])] }
    }

    #[inline(always)]
    fn greater_f64(self, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let of = |a, b| vbslq_f64(vcgtq_f64(a, b), a, b);
            [of(a[0], b[0]), of(a[1], b[1]), of(a[2], b[2]), of(a[3], b[3])]
        }
    }

    #[inline(always)]
    fn smaller_f64(self, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let of = |a, b| vbslq_f64(vcltq_f64(a, b), a, b);
            [of(a[0], b[0]), of(a[1], b[1]), of(a[2], b[2]), of(a[3], b[3])]
        }
    }

    #[inline(always)]
    fn less_f64(self, a: Doubles, b: Doubles) -> u32 {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let both = |a, b| {
                let holds = vcltq_f64(a, b);
                vcombine_u32(vmovn_u64(holds), vmovn_u64(holds))
            };
            let two = |a, b| mask(both(a, b)) & 3;
            two(a[0], b[0]) | two(a[1], b[1]) << 2 | two(a[2], b[2]) << 4 | two(a[3], b[3]) << 6
        }
    }

    #[inline(always)]
    fn choose_f64(self, mask: u32, a: Doubles, b: Doubles) -> Doubles {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            [
                vbslq_f64(pair_in(mask), a[0], b[0]),
                vbslq_f64(pair_in(mask >> 2), a[1], b[1]),
                vbslq_f64(pair_in(mask >> 4), a[2], b[2]),
                vbslq_f64(pair_in(mask >> 6), a[3], b[3]),
            ]
        }
    }
}

impl Simd for Neon {
    type Wide = Pair<Self>;
    type Broad = Pair<Pair<Self>>;
    const BROAD_FITS: bool = false;

    #[inline(always)]
    fn wide(self) -> Pair<Self> {
        Pair(self)
    }

    #[inline(always)]
    fn broad(self) -> Pair<Pair<Self>> {
        Pair(Pair(self))
    }

    #[inline(always)]
    fn high_bits(self, words: &[u32; LANES]) -> u32 {
        (0..LANES).fold(0, |mask, k| mask | words[k] >> 31 << k)
    }

    #[inline(always)]
    fn along(self, rows: &[Row; 3], Axis(i): Axis) -> Floats {
        self.load(&rows[i as usize / size_of::<Row>()])
    }

    #[inline(always)]
    fn pick(self, rows: &[Row; 6], Pick(i): Pick) -> Floats {
        self.load(&rows[i as usize / size_of::<Row>()])
    }

    #[inline(always)]
    fn columns(self, rows: [&[f32; 4]; LANES]) -> [Floats; 4] {
        let low = turned([load(rows[0]), load(rows[1]), load(rows[2]), load(rows[3])]);
        let high = turned([load(rows[4]), load(rows[5]), load(rows[6]), load(rows[7])]);
        [[low[0], high[0]], [low[1], high[1]], [low[2], high[2]], [low[3], high[3]]]
    }

    #[inline(always)]
    fn rows(self, [a, b, c, d]: [Floats; 4]) -> [[f32; 4]; LANES] {
        let mut rows = [[0.0; 4]; LANES];
        let (low, high) = (turned([a[0], b[0], c[0], d[0]]), turned([a[1], b[1], c[1], d[1]]));
        for k in 0..4 {
            store(low[k], &mut rows[k]);
            store(high[k], &mut rows[4 + k]);
        }
        rows
    }

    #[inline(always)]
    fn arrange(self, a: Floats, order: Order, to: &mut Row) {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let [low, high] = arranged(vreinterpretq_u8_f32(a[0]), vreinterpretq_u8_f32(a[1]), order);
            let halves = to.as_chunks_mut().0;
            store(vreinterpretq_f32_u8(low), &mut halves[0]);
            store(vreinterpretq_f32_u8(high), &mut halves[1]);
        }
    }

    #[inline(always)]
    fn arrange_words(self, words: &[u32; LANES], order: Order, to: &mut [u32; LANES]) {
        // SAFETY: every processor of the family has the instructions.
        unsafe {
            let words = words.as_chunks().0;
            let (low, high) =
                (vreinterpretq_u8_u32(load_words(&words[0])), vreinterpretq_u8_u32(load_words(&words[1])));
            let [low, high] = arranged(low, high, order);
            let halves = to.as_chunks_mut().0;
            store_words(vreinterpretq_u32_u8(low), &mut halves[0]);
            store_words(vreinterpretq_u32_u8(high), &mut halves[1]);
        }
    }

    #[inline(always)]
    fn among(self, table: &Row, places: &[u32; LANES]) -> Floats {
        let mut found = [0.0; LANES];
        for (found, place) in found.iter_mut().zip(places) {
            *found = table[*place as usize % LANES];
        }
        self.load(&found)
    }

    #[inline(always)]
    fn prefetch_either<T, U>(self, _: bool, _: (&[T], usize), _: (&[U], usize)) {}

    #[inline(always)]
    fn prefetch<T>(self, _: &[T]) {}
}

/// Expands each four bits to a byte.
#[inline(always)]
fn in_bytes(order: Order) -> u64 {
    let halves = (u64::from(order) | u64::from(order) << 16) & 0x0000_ffff_0000_ffff;
    let bytes = (halves | halves << 8) & 0x00ff_00ff_00ff_00ff;
    (bytes | bytes << 4) & 0x0f0f_0f0f_0f0f_0f0f
}
