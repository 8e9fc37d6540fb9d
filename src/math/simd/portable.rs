//! Scalar form, which the other levels must equal bit for bit.

use super::pair::Pair;
use super::{Axis, LANES, Lanewise, Order, Pick, Row, Simd};

/// Token of the scalar form, which needs no features of the processor.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

#[inline(always)]
fn each(a: Row, b: Row, f: impl Fn(f32, f32) -> f32) -> Row {
    std::array::from_fn(|k| f(a[k], b[k]))
}

#[inline(always)]
fn each_f64(a: [f64; LANES], b: [f64; LANES], f: impl Fn(f64, f64) -> f64) -> [f64; LANES] {
    std::array::from_fn(|k| f(a[k], b[k]))
}

#[inline(always)]
fn mask(a: Row, b: Row, holds: impl Fn(f32, f32) -> bool) -> u32 {
    (0..LANES).fold(0, |mask, k| mask | u32::from(holds(a[k], b[k])) << k)
}

#[inline(always)]
fn put<T: Copy>(mask: u32, a: &[T; LANES], to: &mut [T; LANES]) {
    for k in 0..LANES {
        if mask >> k & 1 == 1 {
            to[k] = a[k];
        }
    }
}

impl Lanewise<LANES> for Portable {
    type Lanes = Row;
    type Doubles = [f64; LANES];

    #[inline(always)]
    fn splat(self, x: f32) -> Row {
        [x; LANES]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Row {
        *row
    }

    #[inline(always)]
    fn store(self, a: Row) -> Row {
        a
    }

    #[inline(always)]
    fn add(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| a / b)
    }

    #[inline(always)]
    fn mul_add(self, a: Row, b: Row, c: Row) -> Row {
        self.add(self.mul(a, b), c)
    }

    #[inline(always)]
    fn mul_sub(self, a: Row, b: Row, c: Row) -> Row {
        self.sub(self.mul(a, b), c)
    }

    #[inline(always)]
    fn sub_mul(self, a: Row, b: Row, c: Row) -> Row {
        self.sub(c, self.mul(a, b))
    }

    #[inline(always)]
    fn abs(self, a: Row) -> Row {
        a.map(f32::abs)
    }

    #[inline(always)]
    fn greater(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn smaller(self, a: Row, b: Row) -> Row {
        each(a, b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn less(self, a: Row, b: Row) -> u32 {
        mask(a, b, |a, b| a < b)
    }

    #[inline(always)]
    fn at_most(self, a: Row, b: Row) -> u32 {
        mask(a, b, |a, b| a <= b)
    }

    #[inline(always)]
    fn choose(self, mask: u32, a: Row, mut b: Row) -> Row {
        put(mask, &a, &mut b);
        b
    }

    #[inline(always)]
    fn signs(self, a: Row) -> u32 {
        mask(a, a, |a, _| a.is_sign_negative())
    }

    #[inline(always)]
    fn with_sign(self, a: Row, b: Row) -> Row {
        each(a, b, f32::copysign)
    }

    #[inline(always)]
    fn least(self, a: Row) -> f32 {
        a.iter().fold(a[0], |x, &y| if y < x { y } else { x })
    }

    #[inline(always)]
    fn greatest(self, a: Row) -> f32 {
        a.iter().fold(a[0], |x, &y| if y > x { y } else { x })
    }

    #[inline(always)]
    fn put_word(self, mask: u32, word: u32, to: &mut [u32; LANES]) {
        put(mask, &[word; LANES], to);
    }

    #[inline(always)]
    fn find_word(self, word: u32, among: &[u32; LANES]) -> u32 {
        (0..LANES).fold(0, |mask, k| mask | u32::from(among[k] == word) << k)
    }

    #[inline(always)]
    fn splat_f64(self, x: f64) -> [f64; LANES] {
        [x; LANES]
    }

    #[inline(always)]
    fn widen(self, a: Row) -> [f64; LANES] {
        a.map(f64::from)
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
    fn narrow(self, a: [f64; LANES]) -> Row {
        a.map(|x| x as f32)
    }

    #[inline(always)]
    fn store_f64(self, a: [f64; LANES]) -> [f64; LANES] {
        a
    }

    #[inline(always)]
    fn add_f64(self, a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each_f64(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub_f64(self, a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each_f64(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul_f64(self, a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each_f64(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn div_f64(self, a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each_f64(a, b, |a, b| a / b)
    }

    #[inline(always)]
    fn greater_f64(self, a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each_f64(a, b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn smaller_f64(self, a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each_f64(a, b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn abs_f64(self, a: [f64; LANES]) -> [f64; LANES] {
        a.map(f64::abs)
    }

    #[inline(always)]
    fn less_f64(self, a: [f64; LANES], b: [f64; LANES]) -> u32 {
        (0..LANES).fold(0, |mask, k| mask | u32::from(a[k] < b[k]) << k)
    }

    #[inline(always)]
    fn choose_f64(self, mask: u32, a: [f64; LANES], mut b: [f64; LANES]) -> [f64; LANES] {
        put(mask, &a, &mut b);
        b
    }
}

impl Simd for Portable {
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
    fn along(self, rows: &[Row; 3], Axis(i): Axis) -> Row {
        rows[i as usize / size_of::<Row>()]
    }

    #[inline(always)]
    fn pick(self, rows: &[Row; 6], Pick(i): Pick) -> Row {
        rows[i as usize / size_of::<Row>()]
    }

    #[inline(always)]
    fn columns(self, rows: [&[f32; 4]; LANES]) -> [Row; 4] {
        std::array::from_fn(|i| std::array::from_fn(|k| rows[k][i]))
    }

    #[inline(always)]
    fn rows(self, columns: [Row; 4]) -> [[f32; 4]; LANES] {
        std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]))
    }

    #[inline(always)]
    fn arrange(self, a: Row, order: Order, to: &mut Row) {
        *to = std::array::from_fn(|k| a[(order >> (4 * k)) as usize % LANES]);
    }

    #[inline(always)]
    fn arrange_words(self, words: &[u32; LANES], order: Order, to: &mut [u32; LANES]) {
        *to = std::array::from_fn(|k| words[(order >> (4 * k)) as usize % LANES]);
    }

    #[inline(always)]
    fn among(self, table: &Row, places: &[u32; LANES]) -> Row {
        std::array::from_fn(|k| table[places[k] as usize % LANES])
    }

    #[inline(always)]
    fn prefetch_either<T, U>(self, _: bool, _: (&[T], usize), _: (&[U], usize)) {}

    #[inline(always)]
    fn prefetch<T>(self, _: &[T]) {}
}
