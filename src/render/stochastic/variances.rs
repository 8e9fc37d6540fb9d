//! Variance of the samples of pixels, by place.

/// Variance of one sample of each pixel; NaN where it is unknown.
pub(super) struct Variances {
    columns: usize,
    each: Vec<f32>,
}

impl Variances {
    /// Empty, for rows of this many places.
    pub(super) fn nothing(columns: usize) -> Self {
        Self { columns, each: Vec::new() }
    }

    /// Starts with single samples, whose variance is 0; `samples` has a number for each place, NaN where there is none.
    pub(super) fn begin(&mut self, samples: &[f32]) {
        self.each.clear();
        self.each.extend(samples.iter().map(|sample| if sample.is_nan() { f32::NAN } else { 0.0 }));
    }

    /// Sets the variance of a place.
    pub(super) fn learn(&mut self, at: usize, variance: f32) {
        self.each[at] = variance;
    }

    /// The larger of `own` and the variance of the neighbours of a place: the fifth of eight in ascending order, the middle of
    /// three and of five.
    pub(super) fn no_less_than(&self, own: f32, at: usize) -> f32 {
        let row = |middle: usize| [self.each[middle - 1], self.each[middle], self.each[middle + 1]];
        let [a, b, c] = row(at - self.columns);
        let [d, _, e] = row(at);
        let [f, g, h] = row(at + self.columns);
        let beside = [a, b, c, d, e, f, g, h];
        let known = beside.iter().filter(|variance| !variance.is_nan()).count();
        // Number of neighbours that are no less than the chosen one, including it.
        let upper = known - known.saturating_sub(1) * 4 / 7;
        let more = beside.iter().filter(|&&variance| variance > own).count();
        if more < upper || known == 0 {
            return own;
        }
        descending(beside.map(|variance| if variance > own { variance } else { 0.0 }))[upper - 1]
    }
}

/// Sorts eight numbers in descending order without branches (K. E. Batcher, "Sorting Networks and Their Applications", 1968).
fn descending(mut numbers: [f32; 8]) -> [f32; 8] {
    // Unrolled by hand: in a loop over pairs the numbers would stay in memory.
    order::<0, 1>(&mut numbers);
    order::<2, 3>(&mut numbers);
    order::<4, 5>(&mut numbers);
    order::<6, 7>(&mut numbers);
    order::<0, 2>(&mut numbers);
    order::<1, 3>(&mut numbers);
    order::<4, 6>(&mut numbers);
    order::<5, 7>(&mut numbers);
    order::<1, 2>(&mut numbers);
    order::<5, 6>(&mut numbers);
    order::<0, 4>(&mut numbers);
    order::<1, 5>(&mut numbers);
    order::<2, 6>(&mut numbers);
    order::<3, 7>(&mut numbers);
    order::<2, 4>(&mut numbers);
    order::<3, 5>(&mut numbers);
    order::<1, 2>(&mut numbers);
    order::<3, 4>(&mut numbers);
    order::<5, 6>(&mut numbers);
    numbers
}

/// Moves the larger of two numbers to the first place.
#[inline(always)]
fn order<const I: usize, const J: usize>(numbers: &mut [f32; 8]) {
    let (a, b) = (numbers[I], numbers[J]);
    (numbers[I], numbers[J]) = if a > b { (a, b) } else { (b, a) };
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result for the middle of nine places.
    fn no_less_than(own: f32, beside: [f32; 8]) -> f32 {
        let mut variances = Variances::nothing(3);
        variances.begin(&[f32::NAN; 9]);
        for (at, variance) in [0, 1, 2, 3, 5, 6, 7, 8].into_iter().zip(beside) {
            variances.learn(at, variance);
        }
        variances.no_less_than(own, 4)
    }

    #[test]
    fn the_fifth_of_eight_counts_where_it_is_more_than_a_pixels_own() {
        let beside = [3.0, 8.0, 1.0, 7.0, 4.0, 6.0, 5.0, 2.0];
        for (own, expected) in [(0.0, 5.0), (4.9, 5.0), (5.0, 5.0), (5.1, 5.1), (9.0, 9.0)] {
            assert_eq!(no_less_than(own, beside), expected, "{own}");
        }
    }

    #[test]
    fn at_the_border_of_a_picture_it_is_the_middle_of_those_there_are() {
        let nan = f32::NAN;
        assert_eq!(no_less_than(0.0, [nan, nan, nan, 3.0, 1.0, nan, 2.0, nan]), 2.0);
        assert_eq!(no_less_than(0.0, [nan, nan, nan, 3.0, 1.0, 5.0, 2.0, 4.0]), 3.0);
        assert_eq!(no_less_than(0.0, [nan, nan, nan, 3.0, 1.0, nan, nan, nan]), 1.0);
        assert_eq!(no_less_than(0.0, [nan, nan, nan, 3.0, nan, nan, nan, nan]), 3.0);
        assert_eq!(no_less_than(2.0, [nan; 8]), 2.0);
    }

    /// A network that sorts all zeros and ones sorts everything (D. E. Knuth, *The Art of Computer Programming*, 5.3.4).
    #[test]
    fn all_zeros_and_ones_are_put_in_order() {
        for bits in 0..256_u32 {
            let numbers = std::array::from_fn(|i| f32::from(u8::from(bits >> i & 1 == 1)));
            let ones = bits.count_ones() as usize;
            let expected = std::array::from_fn(|i| f32::from(u8::from(i < ones)));
            assert_eq!(descending(numbers), expected, "{bits:b}");
        }
    }

    #[test]
    fn it_is_what_putting_all_of_them_in_order_finds() {
        let mut random = crate::math::random::Random::new(5);
        for _ in 0..2000 {
            let mut draw = || match random.below(5) {
                0 => f32::NAN,
                n => (n - 1) as f32 * 0.25 * random.below(3) as f32,
            };
            let beside: [f32; 8] = std::array::from_fn(|_| draw());
            let own = draw().max(0.0);
            let mut known: Vec<f32> = beside.into_iter().filter(|variance| !variance.is_nan()).collect();
            known.sort_unstable_by(f32::total_cmp);
            let middle = known.get(known.len().saturating_sub(1) * 4 / 7).copied().unwrap_or(0.0);
            assert_eq!(no_less_than(own, beside), own.max(middle), "{beside:?}, {own}");
        }
    }
}
