//! Sixteen lanes in one 512-bit register of x86-64, and eight in half of one.
//!
//! Invariant of every `unsafe` here: the method has an [`Avx512`] token, tokens come only from [`Avx512::detect`], and that
//! returns one only on processors with the instructions.

#![expect(unsafe_code, reason = "instructions of one processor family, guarded by a token; see the module's invariant")]

use std::arch::x86_64::*;

use super::avx2::{Avx2, eight_lanes, lanes_in, lanes_of};
use super::pair::Pair;
use super::{Axis, Kernel, LANES, Lanewise, LineOnStack, MIDDLE, NEAR_MIDDLE, Order, Pick, Row, Simd, WIDE};

/// Proof that the processor has AVX-512 F, VL, DQ and BW, and all of [`Avx2`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Avx512(Avx2);

/// Proof of AVX-512, for sixteen lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sixteen(Avx512);

impl Avx512 {
    /// Returns a token if the processor has the features that [`Self::run`] compiles for.
    pub(super) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        Avx2::detect().filter(|_| has).map(Self)
    }

    /// Proof of AVX2 alone.
    #[inline]
    pub(super) fn narrow(self) -> Avx2 {
        self.0
    }

    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn compiled<K: Kernel>(token: Avx512, kernel: K) -> K::Output {
            LineOnStack::align();
            kernel.run(token)
        }
        // SAFETY: the token proves the features.
        unsafe { compiled(self, kernel) }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a mask of eight lanes")]
impl Avx512 {
    #[inline(always)]
    fn masks_less(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: the token proves the features; so below.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b)) }
    }

    #[inline(always)]
    fn masks_in_order(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm256_cmp_epi32_mask::<_MM_CMPINT_LE>(_mm256_castps_si256(a), _mm256_castps_si256(b))) }
    }

    #[inline(always)]
    fn masks_at_most(self, a: __m256, b: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b)) }
    }

    #[inline(always)]
    fn masks_choose(self, mask: u32, a: __m256, b: __m256) -> __m256 {
        // SAFETY: as above.
        unsafe { _mm256_mask_blend_ps(mask as u8, b, a) }
    }
}

eight_lanes!(Avx512, Sixteen, Sixteen, larger, true);

#[inline(always)]
fn larger(_: Avx512, a: __m256, b: __m256) -> __m256 {
    // SAFETY: the token proves the features. The greater size, without a sign.
    unsafe { _mm256_range_ps::<0b1011>(a, b) }
}

/// Splits sixteen numbers into halves.
#[inline(always)]
fn halves(a: __m512) -> (__m256, __m256) {
    // SAFETY: only called where a token proves the features.
    unsafe { (_mm512_castps512_ps256(a), _mm512_extractf32x8_ps::<1>(a)) }
}

#[expect(clippy::cast_possible_truncation, reason = "a mask of sixteen lanes, or the half of one")]
impl Lanewise<WIDE> for Sixteen {
    type Lanes = __m512;
    type Doubles = [__m512d; 2];

    #[inline(always)]
    fn splat(self, x: f32) -> __m512 {
        // SAFETY: the token proves the features; so below.
        unsafe { _mm512_set1_ps(x) }
    }

    #[inline(always)]
    fn load(self, row: &[f32; WIDE]) -> __m512 {
        // SAFETY: as above; reads the sixteen numbers of the row, with no demand on alignment.
        unsafe { _mm512_loadu_ps(row.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, a: __m512) -> [f32; WIDE] {
        let mut row = [0.0; WIDE];
        // SAFETY: as above; writes the sixteen numbers of the row, with no demand on alignment.
        unsafe { _mm512_storeu_ps(row.as_mut_ptr(), a) };
        row
    }

    #[inline(always)]
    fn add(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_mul_ps(a, b) }
    }

    #[inline(always)]
    fn div(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_div_ps(a, b) }
    }

    #[inline(always)]
    fn mul_add(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn mul_sub(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_fmsub_ps(a, b, c) }
    }

    #[inline(always)]
    fn sub_mul(self, a: __m512, b: __m512, c: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_fnmadd_ps(a, b, c) }
    }

    #[inline(always)]
    fn abs(self, a: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_abs_ps(a) }
    }

    #[inline(always)]
    fn greater(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above. The instruction gives b where one is NaN, and for two zeros.
        unsafe { _mm512_max_ps(a, b) }
    }

    #[inline(always)]
    fn larger(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above. The greater size, without a sign.
        unsafe { _mm512_range_ps::<0b1011>(a, b) }
    }

    #[inline(always)]
    fn smaller(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_min_ps(a, b) }
    }

    #[inline(always)]
    fn later(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_castsi512_ps(_mm512_max_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
    }

    #[inline(always)]
    fn sooner(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_castsi512_ps(_mm512_min_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
    }

    #[inline(always)]
    fn latest(self, a: __m512) -> f32 {
        let (low, high) = halves(a);
        self.0.latest(self.0.later(low, high))
    }

    #[inline(always)]
    fn in_order(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_cmp_epi32_mask::<_MM_CMPINT_LE>(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
    }

    #[inline(always)]
    fn less(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b)) }
    }

    #[inline(always)]
    fn at_most(self, a: __m512, b: __m512) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b)) }
    }

    #[inline(always)]
    fn choose(self, mask: u32, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe { _mm512_mask_blend_ps(mask as __mmask16, b, a) }
    }

    #[inline(always)]
    fn signs(self, a: __m512) -> u32 {
        // SAFETY: as above.
        unsafe { u32::from(_mm512_movepi32_mask(_mm512_castps_si512(a))) }
    }

    #[inline(always)]
    fn with_sign(self, a: __m512, b: __m512) -> __m512 {
        // SAFETY: as above.
        unsafe {
            let sign = _mm512_set1_ps(-0.0);
            _mm512_or_ps(_mm512_andnot_ps(sign, a), _mm512_and_ps(sign, b))
        }
    }

    #[inline(always)]
    fn least(self, a: __m512) -> f32 {
        // SAFETY: as above.
        unsafe { _mm512_reduce_min_ps(a) }
    }

    #[inline(always)]
    fn least_of_each(self, [a, b, c, d]: [__m512; 4]) -> [f32; 4] {
        let (a, b, c, d) = (halves(a), halves(b), halves(c), halves(d));
        // SAFETY: as above.
        let eight = unsafe {
            [_mm256_min_ps(a.0, a.1), _mm256_min_ps(b.0, b.1), _mm256_min_ps(c.0, c.1), _mm256_min_ps(d.0, d.1)]
        };
        self.0.least_of_each(eight)
    }

    #[inline(always)]
    fn greatest(self, a: __m512) -> f32 {
        // SAFETY: as above.
        unsafe { _mm512_reduce_max_ps(a) }
    }

    #[inline(always)]
    fn put_word(self, mask: u32, word: u32, to: &mut [u32; WIDE]) {
        // SAFETY: as above; reads and writes sixteen words, with no demand on alignment.
        unsafe {
            let at = to.as_mut_ptr().cast();
            let mixed = _mm512_mask_set1_epi32(_mm512_loadu_si512(at), mask as __mmask16, word.cast_signed());
            _mm512_storeu_si512(at, mixed);
        }
    }

    #[inline(always)]
    fn find_word(self, word: u32, among: &[u32; WIDE]) -> u32 {
        // SAFETY: as above; reads sixteen words, with no demand on alignment.
        unsafe {
            let among = _mm512_loadu_si512(among.as_ptr().cast());
            u32::from(_mm512_cmpeq_epi32_mask(among, _mm512_set1_epi32(word.cast_signed())))
        }
    }

    #[inline(always)]
    fn splat_f64(self, x: f64) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_set1_pd(x); 2] }
    }

    #[inline(always)]
    fn widen(self, a: __m512) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe {
            let (low, high) = halves(a);
            [_mm512_cvtps_pd(low), _mm512_cvtps_pd(high)]
        }
    }

    #[inline(always)]
    fn narrow(self, a: [__m512d; 2]) -> __m512 {
        // SAFETY: as above.
        unsafe {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(a[0]));
            _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(a[1]))
        }
    }

    #[inline(always)]
    fn store_f64(self, a: [__m512d; 2]) -> [f64; WIDE] {
        let mut row = [0.0; WIDE];
        // SAFETY: as above; writes the sixteen numbers of the row, with no demand on alignment.
        unsafe {
            _mm512_storeu_pd(row.as_mut_ptr(), a[0]);
            _mm512_storeu_pd(row.as_mut_ptr().add(8), a[1]);
        }
        row
    }

    #[inline(always)]
    fn add_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_add_pd(a[0], b[0]), _mm512_add_pd(a[1], b[1])] }
    }

    #[inline(always)]
    fn sub_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_sub_pd(a[0], b[0]), _mm512_sub_pd(a[1], b[1])] }
    }

    #[inline(always)]
    fn mul_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_mul_pd(a[0], b[0]), _mm512_mul_pd(a[1], b[1])] }
    }

    #[inline(always)]
    fn div_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_div_pd(a[0], b[0]), _mm512_div_pd(a[1], b[1])] }
    }

    #[inline(always)]
    fn greater_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_max_pd(a[0], b[0]), _mm512_max_pd(a[1], b[1])] }
    }

    #[inline(always)]
    fn smaller_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_min_pd(a[0], b[0]), _mm512_min_pd(a[1], b[1])] }
    }

    #[inline(always)]
    fn abs_f64(self, a: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe { [_mm512_abs_pd(a[0]), _mm512_abs_pd(a[1])] }
    }

    #[inline(always)]
    fn rounds_surely(self, a: [__m512d; 2]) -> u32 {
        // SAFETY: as above.
        unsafe {
            let (middle, near) = (_mm512_set1_epi64(MIDDLE), _mm512_set1_epi64(NEAR_MIDDLE));
            let low = _mm512_test_epi64_mask(_mm512_add_epi64(_mm512_castpd_si512(a[0]), middle), near);
            let high = _mm512_test_epi64_mask(_mm512_add_epi64(_mm512_castpd_si512(a[1]), middle), near);
            u32::from(low) | u32::from(high) << LANES
        }
    }

    #[inline(always)]
    fn less_f64(self, a: [__m512d; 2], b: [__m512d; 2]) -> u32 {
        // SAFETY: as above.
        unsafe {
            let (low, high) =
                (_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a[0], b[0]), _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a[1], b[1]));
            u32::from(low) | u32::from(high) << LANES
        }
    }

    #[inline(always)]
    fn choose_f64(self, mask: u32, a: [__m512d; 2], b: [__m512d; 2]) -> [__m512d; 2] {
        // SAFETY: as above.
        unsafe {
            [
                _mm512_mask_blend_pd(mask as __mmask8, b[0], a[0]),
                _mm512_mask_blend_pd((mask >> LANES) as __mmask8, b[1], a[1]),
            ]
        }
    }
}
