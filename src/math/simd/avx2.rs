//! Eight lanes in one 256-bit register of x86-64.
//!
//! Invariant of every `unsafe` here: the method has an [`Avx2`] token, tokens come from [`Avx2::detect`] alone, and that
//! gives one only on processors with the instructions.

#![expect(unsafe_code, reason = "instructions of one processor family, guarded by a token; see the module's invariant")]

use std::arch::x86_64::*;

use super::{Kernel, LANES, Order, Pick, Row, Simd};

/// Proof that the processor has AVX2 and the bit instructions that came with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Avx2(());

impl Avx2 {
    /// A token if the processor has what [`Self::run`] compiles for.
    pub(super) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        fn compiled<K: Kernel>(token: Avx2, kernel: K) -> K::Output {
            kernel.run(token)
        }
        // SAFETY: the token proves the features.
        unsafe { compiled(self, kernel) }
    }
}

impl Simd for Avx2 {
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
    fn pick(self, rows: &[Row; 6], Pick(i): Pick) -> __m256 {
        // SAFETY: as above; a pick is less than 6 by how it is made, so the row is one of these.
        unsafe { _mm256_loadu_ps(rows.as_ptr().add(i).cast()) }
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
    fn smaller(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_min_ps(a, b) }
    }

    #[inline(always)]
    fn less(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)).cast_unsigned() }
    }

    #[inline(always)]
    fn at_most(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)).cast_unsigned() }
    }

    #[inline(always)]
    fn transpose(self, rows: &[Row; LANES]) -> [__m256; LANES] {
        let row = |i: usize| self.load(&rows[i]);
        let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
        let (r4, r5, r6, r7) = (row(4), row(5), row(6), row(7));
        // SAFETY: as above.
        unsafe {
            // Pairs of two rows, then of four, then both halves.
            let (a0, a1) = (_mm256_unpacklo_ps(r0, r1), _mm256_unpackhi_ps(r0, r1));
            let (a2, a3) = (_mm256_unpacklo_ps(r2, r3), _mm256_unpackhi_ps(r2, r3));
            let (a4, a5) = (_mm256_unpacklo_ps(r4, r5), _mm256_unpackhi_ps(r4, r5));
            let (a6, a7) = (_mm256_unpacklo_ps(r6, r7), _mm256_unpackhi_ps(r6, r7));
            let (b0, b1) = (_mm256_shuffle_ps::<0x44>(a0, a2), _mm256_shuffle_ps::<0xee>(a0, a2));
            let (b2, b3) = (_mm256_shuffle_ps::<0x44>(a1, a3), _mm256_shuffle_ps::<0xee>(a1, a3));
            let (b4, b5) = (_mm256_shuffle_ps::<0x44>(a4, a6), _mm256_shuffle_ps::<0xee>(a4, a6));
            let (b6, b7) = (_mm256_shuffle_ps::<0x44>(a5, a7), _mm256_shuffle_ps::<0xee>(a5, a7));
            [
                _mm256_permute2f128_ps::<0x20>(b0, b4),
                _mm256_permute2f128_ps::<0x20>(b1, b5),
                _mm256_permute2f128_ps::<0x20>(b2, b6),
                _mm256_permute2f128_ps::<0x20>(b3, b7),
                _mm256_permute2f128_ps::<0x31>(b0, b4),
                _mm256_permute2f128_ps::<0x31>(b1, b5),
                _mm256_permute2f128_ps::<0x31>(b2, b6),
                _mm256_permute2f128_ps::<0x31>(b3, b7),
            ]
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
    fn load_f64(self, row: &[f64; LANES]) -> [__m256d; 2] {
        // SAFETY: as above; reads the eight numbers of the row, with no demand on alignment.
        unsafe { [_mm256_loadu_pd(row.as_ptr()), _mm256_loadu_pd(row.as_ptr().add(4))] }
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
    fn prefetch<T>(self, at: &T) {
        let first: *const i8 = std::ptr::from_ref(at).cast();
        for line in (0..size_of::<T>()).step_by(64) {
            // SAFETY: as above; nothing is read, and the address lies within `at`.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(line)) };
        }
    }
}

/// Each byte as a word.
#[inline(always)]
fn lanes_of(order: Order) -> __m256i {
    // SAFETY: only called where a token proves the features.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(order.cast_signed())) }
}
