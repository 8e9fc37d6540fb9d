//! Eight lanes in one 256-bit register of x86-64.
//!
//! Invariant of every `unsafe` here: the method has an [`Avx2`] token, tokens come only from [`Avx2::detect`], and that
//! returns one only on processors with the instructions.

#![expect(unsafe_code, reason = "instructions of one processor family, guarded by a token; see the module's invariant")]

use std::arch::x86_64::*;

use super::pair::Pair;
use super::{Axis, Kernel, LANES, Lanewise, LineOnStack, MIDDLE, NEAR_MIDDLE, Order, Pick, Row, Simd};

/// Proof that the processor has AVX2 and the fused and bit instructions that came with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Avx2(());

impl Avx2 {
    /// Returns a token if the processor has the features that [`Self::run`] compiles for.
    pub(super) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn compiled<K: Kernel>(token: Avx2, kernel: K) -> K::Output {
            LineOnStack::align();
            kernel.run(token)
        }
        // SAFETY: the token proves the features.
        unsafe { compiled(self, kernel) }
    }
}

impl Avx2 {
    #[inline(always)]
    fn masks_less(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the token proves the features; so below.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)).cast_unsigned() }
    }

    #[inline(always)]
    fn masks_in_order(self, a: __m256, b: __m256) -> u32 {
        self.masks_at_most(a, b)
    }

    #[inline(always)]
    fn masks_at_most(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)).cast_unsigned() }
    }

    #[inline(always)]
    fn masks_choose(self, mask: u32, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_blendv_ps(b, a, _mm256_castsi256_ps(lanes_in(mask))) }
    }
}

/// Implements eight lanes for a token that proves AVX2.
macro_rules! eight_lanes {
    ($token:ty, $wide:ty, $widened:expr, $larger:expr, $broad_fits:expr) => {
        impl Lanewise<LANES> for $token {
            type Lanes = __m256;
            type Doubles = [__m256d; 2];

            #[inline(always)]
            fn splat(self, x: f32) -> __m256 {
                // SAFETY: the token proves the features; so below.
                unsafe { _mm256_set1_ps(x) }
            }

            #[inline(always)]
            fn load(self, row: &Row) -> __m256 {
                // SAFETY: as above; reads the eight numbers of the row, with no demand on alignment.
                unsafe { _mm256_loadu_ps(row.as_ptr()) }
            }

            #[inline(always)]
            fn store(self, a: __m256) -> Row {
                let mut row = [0.0; LANES];
                // SAFETY: as above; writes the eight numbers of the row, with no demand on alignment.
                unsafe { _mm256_storeu_ps(row.as_mut_ptr(), a) };
                row
            }

            #[inline(always)]
            fn add(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: the token proves the features; so below.
                unsafe { _mm256_add_ps(a, b) }
            }

            #[inline(always)]
            fn sub(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_sub_ps(a, b) }
            }

            #[inline(always)]
            fn mul(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_mul_ps(a, b) }
            }

            #[inline(always)]
            fn div(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_div_ps(a, b) }
            }

            #[inline(always)]
            fn mul_add(self, a: __m256, b: __m256, c: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_fmadd_ps(a, b, c) }
            }

            #[inline(always)]
            fn mul_sub(self, a: __m256, b: __m256, c: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_fmsub_ps(a, b, c) }
            }

            #[inline(always)]
            fn sub_mul(self, a: __m256, b: __m256, c: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_fnmadd_ps(a, b, c) }
            }

            #[inline(always)]
            fn abs(self, a: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
            }

            #[inline(always)]
            fn greater(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above. The instruction gives b where one is NaN, and for two zeros.
                unsafe { _mm256_max_ps(a, b) }
            }

            #[inline(always)]
            fn larger(self, a: __m256, b: __m256) -> __m256 {
                $larger(self, a, b)
            }

            #[inline(always)]
            fn smaller(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_min_ps(a, b) }
            }

            #[inline(always)]
            fn later(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_castsi256_ps(_mm256_max_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b))) }
            }

            #[inline(always)]
            fn sooner(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_castsi256_ps(_mm256_min_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b))) }
            }

            #[inline(always)]
            fn latest(self, a: __m256) -> f32 {
                // SAFETY: as above.
                unsafe {
                    let a = _mm256_castps_si256(a);
                    let a = _mm_max_epi32(_mm256_castsi256_si128(a), _mm256_extracti128_si256::<1>(a));
                    let a = _mm_max_epi32(a, _mm_shuffle_epi32::<0b01_00_11_10>(a));
                    let a = _mm_max_epi32(a, _mm_shuffle_epi32::<0b10_11_00_01>(a));
                    _mm_cvtss_f32(_mm_castsi128_ps(a))
                }
            }

            #[inline(always)]
            fn in_order(self, a: __m256, b: __m256) -> u32 {
                self.masks_in_order(a, b)
            }

            #[inline(always)]
            fn less(self, a: __m256, b: __m256) -> u32 {
                self.masks_less(a, b)
            }

            #[inline(always)]
            fn at_most(self, a: __m256, b: __m256) -> u32 {
                self.masks_at_most(a, b)
            }

            #[inline(always)]
            fn choose(self, mask: u32, a: __m256, b: __m256) -> __m256 {
                self.masks_choose(mask, a, b)
            }

            #[inline(always)]
            fn signs(self, a: __m256) -> u32 {
                // SAFETY: as above.
                unsafe { _mm256_movemask_ps(a).cast_unsigned() }
            }

            #[inline(always)]
            fn with_sign(self, a: __m256, b: __m256) -> __m256 {
                // SAFETY: as above.
                unsafe {
                    let sign = _mm256_set1_ps(-0.0);
                    _mm256_or_ps(_mm256_andnot_ps(sign, a), _mm256_and_ps(sign, b))
                }
            }

            #[inline(always)]
            fn least(self, a: __m256) -> f32 {
                // SAFETY: as above.
                unsafe {
                    let a = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
                    let a = _mm_min_ps(a, _mm_movehl_ps(a, a));
                    _mm_cvtss_f32(_mm_min_ss(a, _mm_movehdup_ps(a)))
                }
            }

            #[inline(always)]
            fn least_of_each(self, [a, b, c, d]: [__m256; 4]) -> [f32; 4] {
                // SAFETY: as above; writes the four numbers of the row, with no demand on alignment.
                unsafe {
                    let ab = _mm256_min_ps(_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
                    let cd = _mm256_min_ps(_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
                    // By half: a, b, a, b and c, d, c, d to a, b, c, d.
                    let all = _mm256_min_ps(
                        _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
                        _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
                    );
                    let least = _mm_min_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps::<1>(all));
                    let mut row = [0.0; 4];
                    _mm_storeu_ps(row.as_mut_ptr(), least);
                    row
                }
            }

            #[inline(always)]
            fn greatest(self, a: __m256) -> f32 {
                // SAFETY: as above.
                unsafe {
                    let a = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
                    let a = _mm_max_ps(a, _mm_movehl_ps(a, a));
                    _mm_cvtss_f32(_mm_max_ss(a, _mm_movehdup_ps(a)))
                }
            }

            #[inline(always)]
            fn put_word(self, mask: u32, word: u32, to: &mut [u32; LANES]) {
                // SAFETY: as above; reads and writes eight words, with no demand on alignment.
                unsafe {
                    let old = _mm256_loadu_si256(to.as_ptr().cast());
                    let mixed = _mm256_blendv_epi8(old, _mm256_set1_epi32(word.cast_signed()), lanes_in(mask));
                    _mm256_storeu_si256(to.as_mut_ptr().cast(), mixed);
                }
            }

            #[inline(always)]
            fn find_word(self, word: u32, among: &[u32; LANES]) -> u32 {
                // SAFETY: as above; reads eight words, with no demand on alignment.
                unsafe {
                    let among = _mm256_loadu_si256(among.as_ptr().cast());
                    let same = _mm256_cmpeq_epi32(among, _mm256_set1_epi32(word.cast_signed()));
                    _mm256_movemask_ps(_mm256_castsi256_ps(same)).cast_unsigned()
                }
            }

            #[inline(always)]
            fn splat_f64(self, x: f64) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_set1_pd(x); 2] }
            }

            #[inline(always)]
            fn widen(self, a: __m256) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_cvtps_pd(_mm256_castps256_ps128(a)), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a))] }
            }

            #[inline(always)]
            fn narrow(self, a: [__m256d; 2]) -> __m256 {
                // SAFETY: as above.
                unsafe { _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])) }
            }

            #[inline(always)]
            fn store_f64(self, a: [__m256d; 2]) -> [f64; LANES] {
                let mut row = [0.0; LANES];
                // SAFETY: as above; writes the eight numbers of the row, with no demand on alignment.
                unsafe {
                    _mm256_storeu_pd(row.as_mut_ptr(), a[0]);
                    _mm256_storeu_pd(row.as_mut_ptr().add(4), a[1]);
                }
                row
            }

            #[inline(always)]
            fn add_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])] }
            }

            #[inline(always)]
            fn sub_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])] }
            }

            #[inline(always)]
            fn mul_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])] }
            }

            #[inline(always)]
            fn div_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])] }
            }

            #[inline(always)]
            fn greater_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_max_pd(a[0], b[0]), _mm256_max_pd(a[1], b[1])] }
            }

            #[inline(always)]
            fn smaller_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_min_pd(a[0], b[0]), _mm256_min_pd(a[1], b[1])] }
            }

            #[inline(always)]
            fn abs_f64(self, a: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe { [_mm256_andnot_pd(_mm256_set1_pd(-0.0), a[0]), _mm256_andnot_pd(_mm256_set1_pd(-0.0), a[1])] }
            }

            #[inline(always)]
            fn rounds_surely(self, a: [__m256d; 2]) -> u32 {
                // SAFETY: as above.
                let (low, high) = unsafe {
                    let (middle, near) = (_mm256_set1_epi64x(MIDDLE), _mm256_set1_epi64x(NEAR_MIDDLE));
                    let low = _mm256_and_si256(_mm256_add_epi64(_mm256_castpd_si256(a[0]), middle), near);
                    let high = _mm256_and_si256(_mm256_add_epi64(_mm256_castpd_si256(a[1]), middle), near);
                    let zero = _mm256_setzero_si256();
                    (
                        _mm256_movemask_pd(_mm256_castsi256_pd(_mm256_cmpeq_epi64(low, zero))),
                        _mm256_movemask_pd(_mm256_castsi256_pd(_mm256_cmpeq_epi64(high, zero))),
                    )
                };
                !(low | high << 4).cast_unsigned() & 255
            }

            #[inline(always)]
            fn less_f64(self, a: [__m256d; 2], b: [__m256d; 2]) -> u32 {
                // SAFETY: as above.
                let (low, high) = unsafe {
                    (
                        _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a[0], b[0])),
                        _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a[1], b[1])),
                    )
                };
                (low | high << 4).cast_unsigned()
            }

            #[inline(always)]
            fn choose_f64(self, mask: u32, a: [__m256d; 2], b: [__m256d; 2]) -> [__m256d; 2] {
                // SAFETY: as above.
                unsafe {
                    let lanes = lanes_in(mask);
                    let low = _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm256_castsi256_si128(lanes)));
                    let high = _mm256_castsi256_pd(_mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(lanes)));
                    [_mm256_blendv_pd(b[0], a[0], low), _mm256_blendv_pd(b[1], a[1], high)]
                }
            }
        }

        impl Simd for $token {
            type Wide = $wide;
            type Broad = Pair<$wide>;
            const BROAD_FITS: bool = $broad_fits;

            #[inline(always)]
            fn wide(self) -> $wide {
                $widened(self)
            }

            #[inline(always)]
            fn broad(self) -> Pair<$wide> {
                Pair($widened(self))
            }

            #[inline(always)]
            fn high_bits(self, words: &[u32; LANES]) -> u32 {
                // SAFETY: as above; reads eight words, with no demand on alignment.
                unsafe {
                    let words = _mm256_loadu_si256(words.as_ptr().cast());
                    _mm256_movemask_ps(_mm256_castsi256_ps(words)).cast_unsigned()
                }
            }

            #[inline(always)]
            fn along(self, rows: &[Row; 3], Axis(i): Axis) -> __m256 {
                // SAFETY: as above; an axis is less than 3 by how it is made, so the row is one of these.
                unsafe { _mm256_loadu_ps(rows.as_ptr().byte_add(i as usize).cast()) }
            }

            #[inline(always)]
            fn pick(self, rows: &[Row; 6], Pick(i): Pick) -> __m256 {
                // SAFETY: as above; a pick is less than 6 by how it is made, so the row is one of these.
                unsafe { _mm256_loadu_ps(rows.as_ptr().byte_add(i as usize).cast()) }
            }

            #[inline(always)]
            fn columns(self, rows: [&[f32; 4]; LANES]) -> [__m256; 4] {
                let [r0, r1, r2, r3, r4, r5, r6, r7] = rows;
                // SAFETY: as above; reads the four numbers of each row, with no demand on alignment.
                unsafe {
                    let both = |low: &[f32; 4], high: &[f32; 4]| {
                        _mm256_set_m128(_mm_loadu_ps(high.as_ptr()), _mm_loadu_ps(low.as_ptr()))
                    };
                    let (a, b, c, d) = (both(r0, r4), both(r1, r5), both(r2, r6), both(r3, r7));
                    let (ab, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
                    let (cd, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
                    [
                        _mm256_shuffle_ps::<0x44>(ab, cd),
                        _mm256_shuffle_ps::<0xee>(ab, cd),
                        _mm256_shuffle_ps::<0x44>(ab_high, cd_high),
                        _mm256_shuffle_ps::<0xee>(ab_high, cd_high),
                    ]
                }
            }

            #[inline(always)]
            fn rows(self, [a, b, c, d]: [__m256; 4]) -> [[f32; 4]; LANES] {
                let mut rows = [[0.0; 4]; LANES];
                // SAFETY: as above; writes the four numbers of each row, with no demand on alignment.
                unsafe {
                    let (ab, ab_high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
                    let (cd, cd_high) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
                    let r0 = _mm256_shuffle_ps::<0x44>(ab, cd);
                    let r1 = _mm256_shuffle_ps::<0xee>(ab, cd);
                    let r2 = _mm256_shuffle_ps::<0x44>(ab_high, cd_high);
                    let r3 = _mm256_shuffle_ps::<0xee>(ab_high, cd_high);
                    _mm_storeu_ps(rows[0].as_mut_ptr(), _mm256_castps256_ps128(r0));
                    _mm_storeu_ps(rows[1].as_mut_ptr(), _mm256_castps256_ps128(r1));
                    _mm_storeu_ps(rows[2].as_mut_ptr(), _mm256_castps256_ps128(r2));
                    _mm_storeu_ps(rows[3].as_mut_ptr(), _mm256_castps256_ps128(r3));
                    _mm_storeu_ps(rows[4].as_mut_ptr(), _mm256_extractf128_ps::<1>(r0));
                    _mm_storeu_ps(rows[5].as_mut_ptr(), _mm256_extractf128_ps::<1>(r1));
                    _mm_storeu_ps(rows[6].as_mut_ptr(), _mm256_extractf128_ps::<1>(r2));
                    _mm_storeu_ps(rows[7].as_mut_ptr(), _mm256_extractf128_ps::<1>(r3));
                }
                rows
            }

            #[inline(always)]
            fn arrange(self, a: __m256, order: Order, to: &mut Row) {
                // SAFETY: as above; writes the eight numbers of the row, with no demand on alignment.
                unsafe { _mm256_storeu_ps(to.as_mut_ptr(), _mm256_permutevar8x32_ps(a, lanes_of(order))) };
            }

            #[inline(always)]
            fn arrange_words(self, words: &[u32; LANES], order: Order, to: &mut [u32; LANES]) {
                // SAFETY: as above; reads and writes eight words, with no demand on alignment.
                unsafe {
                    let words = _mm256_loadu_si256(words.as_ptr().cast());
                    _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(words, lanes_of(order)));
                }
            }

            #[inline(always)]
            fn among(self, table: &Row, places: &[u32; LANES]) -> __m256 {
                // SAFETY: as above; reads eight numbers and eight words, with no demand on alignment.
                unsafe {
                    let places = _mm256_loadu_si256(places.as_ptr().cast());
                    _mm256_permutevar8x32_ps(_mm256_loadu_ps(table.as_ptr()), places)
                }
            }

            #[inline(always)]
            fn prefetch_either<T, U>(self, first: bool, a: (&[T], usize), b: (&[U], usize)) {
                let (a, b): (*const i8, *const i8) =
                    (a.0.as_ptr().wrapping_add(a.1).cast(), b.0.as_ptr().wrapping_add(b.1).cast());
                let at = if first { a } else { b };
                for line in (0..256).step_by(64) {
                    // SAFETY: as above; nothing is read, so that it does not matter where the address lies.
                    unsafe { _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(line)) };
                }
            }

            #[inline(always)]
            fn prefetch<T>(self, all: &[T]) {
                let at: *const i8 = all.as_ptr().cast();
                for line in (0..size_of_val(all)).step_by(64) {
                    // SAFETY: as above; nothing is read.
                    unsafe { _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(line)) };
                }
            }
        }
    };
}

pub(super) use eight_lanes;

eight_lanes!(Avx2, Pair<Avx2>, Pair, larger, false);

#[inline(always)]
fn larger(s: Avx2, a: __m256, b: __m256) -> __m256 {
    s.greater(s.abs(a), s.abs(b))
}

/// Expands a mask to lanes of all ones or zeros.
#[inline(always)]
pub(super) fn lanes_in(mask: u32) -> __m256i {
    // SAFETY: only called where a token proves the features.
    unsafe {
        let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(mask.cast_signed()), bits), bits)
    }
}

/// Expands each four bits to a word, of which the lowest three bits count.
#[inline(always)]
pub(super) fn lanes_of(order: Order) -> __m256i {
    // SAFETY: only called where a token proves the features.
    unsafe {
        let places = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
        _mm256_srlv_epi32(_mm256_set1_epi32(order.cast_signed()), places)
    }
}
