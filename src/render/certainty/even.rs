//! Compares single samples with their neighbours, side by side: most of a picture needs no second sample.

use super::{Certainty, PixelSummary, Range};
use crate::math::Vec4;
use crate::math::simd::{Kernel, Simd};
use std::ops::Range as Run;

/// Expected range of nine normal variates, in standard deviations (L. H. C. Tippett, "On the Extreme Individuals and the Range of
/// Samples Taken from a Normal Population", 1925).
const RANGE: f32 = 2.970;

/// Written values of single samples, as columns.
pub(in crate::render) struct Shown {
    /// RGB and alpha; NaN where there is no sample.
    pub(super) colors: [Vec<f32>; 4],
    /// Greatest channel of light, after exposure.
    pub(super) brightest: Vec<f32>,
}

impl Shown {
    /// `count` places without a sample.
    pub(in crate::render) fn nothing(count: usize) -> Self {
        Self { colors: std::array::from_fn(|_| vec![f32::NAN; count]), brightest: vec![0.0; count] }
    }

    /// Empty columns with capacity for `count` places.
    pub(super) fn with_capacity(count: usize) -> Self {
        Self { colors: std::array::from_fn(|_| Vec::with_capacity(count)), brightest: Vec::with_capacity(count) }
    }

    /// One value of each place, NaN where there is no sample.
    pub(in crate::render) fn known(&self) -> &[f32] {
        &self.colors[0]
    }

    /// What the sample at a place shows.
    pub(in crate::render) fn at(&self, i: usize) -> PixelSummary {
        let color = Vec4::from_array(std::array::from_fn(|c| self.colors[c][i]));
        if color.is_nan() {
            return PixelSummary::NOTHING;
        }
        PixelSummary { color, range: Range { least: color, most: color, brightest: self.brightest[i] }, error: 0.0 }
    }

    /// All columns.
    pub(in crate::render) fn columns(&self) -> [&[f32]; 5] {
        let [r, g, b, alpha] = &self.colors;
        [r, g, b, alpha, &self.brightest]
    }

    /// All columns, mutable.
    pub(in crate::render) fn columns_mut(&mut self) -> [&mut [f32]; 5] {
        let [r, g, b, alpha] = &mut self.colors;
        [r, g, b, alpha, &mut self.brightest]
    }
}

/// Which single samples look like all of their eight neighbours; only for places that were compared.
pub(in crate::render) struct Even {
    is_uneven: Vec<u32>,
    /// Standard error of each pixel, the root of the mean over its channels, from the range of nine samples: its own and its
    /// neighbours', which lie farther apart than the pixel is wide.
    errors: Vec<f32>,
}

impl Even {
    /// Marks the sample at this place as uneven, however it looks.
    pub(in crate::render) fn doubt(&mut self, i: usize) {
        self.is_uneven[i] = 1;
    }

    /// Whether the sample at a place looks like all its neighbours.
    pub(in crate::render) fn is_even(&self, i: usize) -> bool {
        self.is_uneven[i] == 0
    }

    /// Whether all pixels at these places are even.
    pub(in crate::render) fn are_even(&self, places: Run<usize>) -> bool {
        self.is_uneven[places].iter().fold(0, |any, uneven| any | uneven) == 0
    }

    /// Standard errors of `count` pixels from `start` on.
    pub(in crate::render) fn errors(&self, start: usize, count: usize) -> &[f32] {
        &self.errors[start..start + count]
    }
}

impl Certainty<'_> {
    /// Compares single samples at consecutive places with their neighbours. Places lie row by row, with `columns` in each; there
    /// must be at least one more row on either side, and one more place.
    pub(in crate::render) fn compare(&self, shown: &Shown, columns: usize, places: Run<usize>) -> Even {
        let count = shown.brightest.len();
        let mut even = Even { is_uneven: vec![0; count], errors: vec![0.0; count] };
        self.level.run(Compare { judge: self, shown, columns, places, even: &mut even });
        even
    }
}

struct Compare<'a, 'j> {
    judge: &'a Certainty<'j>,
    shown: &'a Shown,
    columns: usize,
    places: Run<usize>,
    even: &'a mut Even,
}

impl Kernel for Compare<'_, '_> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "a handful of channels")]
    fn run<S: Simd>(self, _: S) {
        let Self { judge, shown, columns, places, even } = self;
        let (limit, channels) = (Certainty::steep(1) * judge.error, judge.channels());
        let (uneven, errors) = (&mut even.is_uneven[places.clone()], &mut even.errors[places.clone()]);
        // Where alpha is not written, it is not compared.
        for column in &shown.colors[..channels] {
            let rows = [places.start - columns, places.start, places.start + columns];
            differ(rows.map(|at| &column[at - 1..=at + places.len()]), limit, &mut *uneven, &mut *errors);
        }
        for error in errors {
            *error = (*error / channels as f32).sqrt() / RANGE;
        }
    }
}

/// Marks consecutive places where one of the nine values at and around them is farther than the limit from the middle one, and
/// adds the square of their range to `errors`; `rows` begin one place before and end one behind.
#[inline(always)]
fn differ([above, own, below]: [&[f32]; 3], limit: f32, uneven: &mut [u32], errors: &mut [f32]) {
    let count = own.len().saturating_sub(2).min(uneven.len()).min(errors.len());
    // Equal, known lengths, so that the loop has no bounds checks.
    let [above, own, below] = [above, own, below].map(|row| &row[..count + 2]);
    let (uneven, errors) = (&mut uneven[..count], &mut errors[..count]);
    for i in 0..count {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for row in [above, own, below] {
            for number in [row[i], row[i + 1], row[i + 2]] {
                (low, high) = (least(low, number), most(high, number));
            }
        }
        uneven[i] |= u32::from(high - own[i + 1] > limit) | u32::from(own[i + 1] - low > limit);
        errors[i] += (high - low) * (high - low);
    }
}

/// Minimum of two numbers; a NaN as the second is ignored.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// Maximum of two numbers, likewise.
#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::math::random::Random;
    use crate::math::simd::Level;
    use crate::render::certainty::factor;
    use crate::render::frame::Sum;
    use crate::render::whitted::Sample;

    /// Samples that look alike in the left columns of 41.
    fn samples(count: usize) -> Vec<Sample> {
        let mut random = Random::new(5);
        let steps = (0..count).map(|_| (random.unit() * 5.0).floor()).collect::<Vec<_>>();
        let smooth = |i: usize| if i % 41 < 20 { 0.2 + 0.001 * steps[i] } else { 0.1 * steps[i] };
        (0..count).map(|i| Sample { radiance: Vec3::new(smooth(i), 0.1, 0.3), through: Vec3::splat(0.25) }).collect()
    }

    #[test]
    fn single_samples_are_seen_and_compared_as_groups_of_one_are() {
        let (columns, rows) = (41, 9);
        let samples = samples(columns * rows);
        for (background, transparent) in [(None, true), (Some(Vec3::new(0.1, 0.5, 0.9)), false)] {
            for (error, level) in
                [0.02, 0.08].iter().flat_map(|&error| Level::all().into_iter().map(move |l| (error, l)))
            {
                let judge =
                    Certainty { level, ..Certainty::new(None, background, false, transparent, error, factor(0.95)) };
                let (shown, pixels) = judge.see_samples(&samples);
                let groups: Vec<[Sum; 1]> = samples.iter().map(|sample| [Sum::of(sample)]).collect();
                let resolved: Vec<_> = samples.iter().map(|sample| Sum::of(sample).resolve(background).0).collect();
                assert_eq!(pixels.beauty, resolved);
                let mut seen = Vec::new();
                judge.see_each(groups.iter().map(|group| &group[..]), |one| seen.push(*one));
                let inner = columns + 1..(rows - 1) * columns - 1;
                let even = judge.compare(&shown, columns, inner);
                let (mut evens, mut all) = (0, 0);
                for at in (1..rows - 1).flat_map(|row| row * columns + 1..(row + 1) * columns - 1) {
                    assert_eq!(
                        (shown.at(at).color, shown.at(at).range.brightest),
                        (seen[at].color, seen[at].range.brightest)
                    );
                    let near = || {
                        [at - columns, at, at + columns].into_iter().flat_map(|row| row - 1..row + 2).map(|i| &seen[i])
                    };
                    assert_eq!(
                        even.is_even(at),
                        near().all(|other| !judge.differ(seen[at].color, other.color, 1)),
                        "{at}"
                    );
                    let range = near().fold(Range::NOTHING, |all, seen| all.with(seen.range));
                    assert_eq!(even.errors(at, 1), [judge.contrast(&range) / RANGE], "{at}");
                    (evens, all) = (evens + usize::from(even.is_even(at)), all + 1);
                }
                assert!(evens > all / 10 && evens < all * 9 / 10, "{evens} of {all}");
            }
        }
    }
}
