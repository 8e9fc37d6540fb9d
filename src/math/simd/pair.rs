//! Twice as many lanes, as two halves.

use super::{BROAD, LANES, Lanewise, WIDE};

/// Token for two halves of equally many lanes.
#[derive(Clone, Copy, Debug)]
pub struct Pair<S>(pub(super) S);

#[inline(always)]
fn halves<T, const HALF: usize>(row: &[T]) -> (&[T; HALF], &[T; HALF]) {
    let halves = row.as_chunks().0;
    (&halves[0], &halves[1])
}

#[inline(always)]
fn halves_mut<T, const HALF: usize>(row: &mut [T]) -> (&mut [T; HALF], &mut [T; HALF]) {
    let (low, high) = row.split_at_mut(HALF);
    (&mut low.as_chunks_mut().0[0], &mut high.as_chunks_mut().0[0])
}

#[inline(always)]
fn joined<T: Copy + Default, const HALF: usize, const BOTH: usize>(low: [T; HALF], high: [T; HALF]) -> [T; BOTH] {
    let mut row = [T::default(); BOTH];
    row[..HALF].copy_from_slice(&low);
    row[HALF..].copy_from_slice(&high);
    row
}

macro_rules! pair {
    ($half:expr, $both:expr) => {
        impl<S: Lanewise<{ $half }>> Lanewise<{ $both }> for Pair<S> {
            type Lanes = [S::Lanes; 2];
            type Doubles = [S::Doubles; 2];

            #[inline(always)]
            fn splat(self, x: f32) -> Self::Lanes {
                [self.0.splat(x); 2]
            }

            #[inline(always)]
            fn load(self, row: &[f32; $both]) -> Self::Lanes {
                let (low, high) = halves(row);
                [self.0.load(low), self.0.load(high)]
            }

            #[inline(always)]
            fn store(self, [low, high]: Self::Lanes) -> [f32; $both] {
                joined(self.0.store(low), self.0.store(high))
            }

            #[inline(always)]
            fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.add(a[0], b[0]), self.0.add(a[1], b[1])]
            }

            #[inline(always)]
            fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.sub(a[0], b[0]), self.0.sub(a[1], b[1])]
            }

            #[inline(always)]
            fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.mul(a[0], b[0]), self.0.mul(a[1], b[1])]
            }

            #[inline(always)]
            fn div(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.div(a[0], b[0]), self.0.div(a[1], b[1])]
            }

            #[inline(always)]
            fn mul_add(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes {
                [self.0.mul_add(a[0], b[0], c[0]), self.0.mul_add(a[1], b[1], c[1])]
            }

            #[inline(always)]
            fn mul_sub(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes {
                [self.0.mul_sub(a[0], b[0], c[0]), self.0.mul_sub(a[1], b[1], c[1])]
            }

            #[inline(always)]
            fn sub_mul(self, a: Self::Lanes, b: Self::Lanes, c: Self::Lanes) -> Self::Lanes {
                [self.0.sub_mul(a[0], b[0], c[0]), self.0.sub_mul(a[1], b[1], c[1])]
            }

            #[inline(always)]
            fn greater(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.greater(a[0], b[0]), self.0.greater(a[1], b[1])]
            }

            #[inline(always)]
            fn larger(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.larger(a[0], b[0]), self.0.larger(a[1], b[1])]
            }

            #[inline(always)]
            fn smaller(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.smaller(a[0], b[0]), self.0.smaller(a[1], b[1])]
            }

            #[inline(always)]
            fn later(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.later(a[0], b[0]), self.0.later(a[1], b[1])]
            }

            #[inline(always)]
            fn sooner(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.sooner(a[0], b[0]), self.0.sooner(a[1], b[1])]
            }

            #[inline(always)]
            fn latest(self, [low, high]: Self::Lanes) -> f32 {
                self.0.latest(self.0.later(low, high))
            }

            #[inline(always)]
            fn in_order(self, a: Self::Lanes, b: Self::Lanes) -> u32 {
                self.0.in_order(a[0], b[0]) | self.0.in_order(a[1], b[1]) << $half
            }

            #[inline(always)]
            fn abs(self, [low, high]: Self::Lanes) -> Self::Lanes {
                [self.0.abs(low), self.0.abs(high)]
            }

            #[inline(always)]
            fn less(self, a: Self::Lanes, b: Self::Lanes) -> u32 {
                self.0.less(a[0], b[0]) | self.0.less(a[1], b[1]) << $half
            }

            #[inline(always)]
            fn at_most(self, a: Self::Lanes, b: Self::Lanes) -> u32 {
                self.0.at_most(a[0], b[0]) | self.0.at_most(a[1], b[1]) << $half
            }

            #[inline(always)]
            fn choose(self, mask: u32, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.choose(mask, a[0], b[0]), self.0.choose(mask >> $half, a[1], b[1])]
            }

            #[inline(always)]
            fn signs(self, a: Self::Lanes) -> u32 {
                self.0.signs(a[0]) | self.0.signs(a[1]) << $half
            }

            #[inline(always)]
            fn with_sign(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes {
                [self.0.with_sign(a[0], b[0]), self.0.with_sign(a[1], b[1])]
            }

            #[inline(always)]
            fn least(self, [low, high]: Self::Lanes) -> f32 {
                self.0.least(self.0.smaller(low, high))
            }

            #[inline(always)]
            fn least_of_each(self, [a, b, c, d]: [Self::Lanes; 4]) -> [f32; 4] {
                let s = self.0;
                s.least_of_each([
                    s.smaller(a[0], a[1]),
                    s.smaller(b[0], b[1]),
                    s.smaller(c[0], c[1]),
                    s.smaller(d[0], d[1]),
                ])
            }

            #[inline(always)]
            fn greatest(self, [low, high]: Self::Lanes) -> f32 {
                self.0.greatest(self.0.greater(low, high))
            }

            #[inline(always)]
            fn put_word(self, mask: u32, word: u32, to: &mut [u32; $both]) {
                let (low, high) = halves_mut(to);
                self.0.put_word(mask, word, low);
                self.0.put_word(mask >> $half, word, high);
            }

            #[inline(always)]
            fn find_word(self, word: u32, among: &[u32; $both]) -> u32 {
                let (low, high) = halves(among);
                self.0.find_word(word, low) | self.0.find_word(word, high) << $half
            }

            #[inline(always)]
            fn splat_f64(self, x: f64) -> Self::Doubles {
                [self.0.splat_f64(x); 2]
            }

            #[inline(always)]
            fn widen(self, [low, high]: Self::Lanes) -> Self::Doubles {
                [self.0.widen(low), self.0.widen(high)]
            }

            #[inline(always)]
            fn narrow(self, [low, high]: Self::Doubles) -> Self::Lanes {
                [self.0.narrow(low), self.0.narrow(high)]
            }

            #[inline(always)]
            fn store_f64(self, [low, high]: Self::Doubles) -> [f64; $both] {
                joined(self.0.store_f64(low), self.0.store_f64(high))
            }

            #[inline(always)]
            fn add_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.add_f64(a[0], b[0]), self.0.add_f64(a[1], b[1])]
            }

            #[inline(always)]
            fn sub_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.sub_f64(a[0], b[0]), self.0.sub_f64(a[1], b[1])]
            }

            #[inline(always)]
            fn mul_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.mul_f64(a[0], b[0]), self.0.mul_f64(a[1], b[1])]
            }

            #[inline(always)]
            fn div_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.div_f64(a[0], b[0]), self.0.div_f64(a[1], b[1])]
            }

            #[inline(always)]
            fn greater_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.greater_f64(a[0], b[0]), self.0.greater_f64(a[1], b[1])]
            }

            #[inline(always)]
            fn smaller_f64(self, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.smaller_f64(a[0], b[0]), self.0.smaller_f64(a[1], b[1])]
            }

            #[inline(always)]
            fn abs_f64(self, [low, high]: Self::Doubles) -> Self::Doubles {
                [self.0.abs_f64(low), self.0.abs_f64(high)]
            }

            #[inline(always)]
            fn rounds_surely(self, a: Self::Doubles) -> u32 {
                self.0.rounds_surely(a[0]) | self.0.rounds_surely(a[1]) << $half
            }

            #[inline(always)]
            fn less_f64(self, a: Self::Doubles, b: Self::Doubles) -> u32 {
                self.0.less_f64(a[0], b[0]) | self.0.less_f64(a[1], b[1]) << $half
            }

            #[inline(always)]
            fn choose_f64(self, mask: u32, a: Self::Doubles, b: Self::Doubles) -> Self::Doubles {
                [self.0.choose_f64(mask, a[0], b[0]), self.0.choose_f64(mask >> $half, a[1], b[1])]
            }
        }
    };
}

pair!(LANES, WIDE);
pair!(WIDE, BROAD);
