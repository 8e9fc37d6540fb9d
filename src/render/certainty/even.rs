//! Single samples that look as those beside them do, side by side: most of a picture needs no second one.

use super::{Certainty, Range, Seen};
use crate::math::Vec4;
use crate::math::simd::{Kernel, Simd};
use std::ops::Range as Run;

/// Pixels of a row that are compared together at most: those of a tile and a few around it …
const PART: usize = 46;

/// … with one more on each side.
const WIDE: usize = PART + 2;

/// What nine numbers lie between is so many times their standard deviation (L. H. C. Tippett, "On the Extreme Individuals and
/// the Range of Samples Taken from a Normal Population", 1925).
const RANGE: f32 = 2.970;

/// What single samples are written as: each number in a column of its own.
pub(in crate::render) struct Shown {
    /// RGB and alpha; not a number where nothing is known.
    pub(super) colors: [Vec<f32>; 4],
    /// The greatest channel of light, after exposure.
    pub(super) brightest: Vec<f32>,
}

impl Shown {
    /// Nothing, so many times.
    pub(in crate::render) fn nothing(count: usize) -> Self {
        Self { colors: std::array::from_fn(|_| vec![f32::NAN; count]), brightest: vec![0.0; count] }
    }

    /// Room for so many.
    pub(super) fn with_capacity(count: usize) -> Self {
        Self { colors: std::array::from_fn(|_| Vec::with_capacity(count)), brightest: Vec::with_capacity(count) }
    }

    /// Whether anything is known of a place.
    pub(in crate::render) fn is_known(&self, i: usize) -> bool {
        !self.colors[0][i].is_nan()
    }

    /// What is shown at a place.
    pub(in crate::render) fn at(&self, i: usize) -> Seen {
        let color = Vec4::from_array(std::array::from_fn(|c| self.colors[c][i]));
        if color.is_nan() {
            return Seen::NOTHING;
        }
        Seen { color, range: Range { least: color, most: color, brightest: self.brightest[i] }, error: 0.0 }
    }

    /// Each of the columns.
    pub(in crate::render) fn columns(&self) -> [&[f32]; 5] {
        let [r, g, b, alpha] = &self.colors;
        [r, g, b, alpha, &self.brightest]
    }

    /// The same, to be changed.
    pub(in crate::render) fn columns_mut(&mut self) -> [&mut [f32]; 5] {
        let [r, g, b, alpha] = &mut self.colors;
        [r, g, b, alpha, &mut self.brightest]
    }
}

/// Which of single samples look as all of the eight beside them do; of places that were compared.
pub(in crate::render) struct Even {
    is_uneven: Vec<u32>,
    /// Standard error of the pixel, the root of the mean over its channels, from the range of nine samples: of it and of the
    /// pixels beside it, which lie farther apart than it is wide.
    errors: Vec<f32>,
}

impl Even {
    /// Whether the sample at a place looks as all beside it do.
    pub(in crate::render) fn is_even(&self, i: usize) -> bool {
        self.is_uneven[i] == 0
    }

    /// Standard error of the pixel at a place.
    pub(in crate::render) fn error(&self, i: usize) -> f32 {
        self.errors[i]
    }
}

impl Certainty<'_> {
    /// Compares single samples with those beside them. They lie row by row, each with so many `columns`; `runs` are places in
    /// rows, around which there is at least one more place on every side.
    pub(in crate::render) fn compare(
        &self,
        shown: &Shown,
        columns: usize,
        runs: impl Iterator<Item = Run<usize>>,
    ) -> Even {
        let count = shown.brightest.len();
        let mut even = Even { is_uneven: vec![0; count], errors: vec![0.0; count] };
        self.level.run(Compare { judge: self, shown, columns, runs, even: &mut even });
        even
    }
}

struct Compare<'a, 'j, R> {
    judge: &'a Certainty<'j>,
    shown: &'a Shown,
    columns: usize,
    runs: R,
    even: &'a mut Even,
}

impl<R: Iterator<Item = Run<usize>>> Kernel for Compare<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { judge, shown, columns, runs, even } = self;
        for run in runs {
            let mut start = run.start;
            while start < run.end {
                let count = PART.min(run.end - start);
                let (differs, errors) = judge.beside(shown, columns, start);
                even.is_uneven[start..start + count].copy_from_slice(&differs[..count]);
                even.errors[start..start + count].copy_from_slice(&errors[..count]);
                start += count;
            }
        }
    }
}

impl Certainty<'_> {
    /// Of places from one on: whether any beside it looks different, and the standard error of its pixel.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "a handful of channels")]
    fn beside(&self, shown: &Shown, columns: usize, start: usize) -> ([u32; WIDE], [f32; WIDE]) {
        let (limit, channels) = (Self::steep(1) * self.error, self.channels());
        let (mut differs, mut errors) = ([0; WIDE], [0.0; WIDE]);
        // Alpha is the same everywhere where it is not written.
        for column in &shown.colors[..channels] {
            let [above, own, below] = [start - columns, start, start + columns].map(|at| some(column, at - 1));
            // Of three above each other, and then of three such: room for two more behind.
            let (mut low, mut high) = ([f32::INFINITY; WIDE + 2], [f32::NEG_INFINITY; WIDE + 2]);
            for i in 0..WIDE {
                low[i] = least(least(least(f32::INFINITY, above[i]), own[i]), below[i]);
                high[i] = most(most(most(f32::NEG_INFINITY, above[i]), own[i]), below[i]);
            }
            for i in 0..WIDE {
                let own = if i + 1 < WIDE { own[i + 1] } else { 0.0 };
                let least = least(least(low[i], low[i + 1]), low[i + 2]);
                let most = most(most(high[i], high[i + 1]), high[i + 2]);
                differs[i] |= u32::from(most - own > limit) | u32::from(own - least > limit);
                errors[i] += (most - least) * (most - least);
            }
        }
        for error in &mut errors {
            *error = (*error / channels as f32).sqrt() / RANGE;
        }
        (differs, errors)
    }
}

/// The lesser of two numbers; a second one that is none changes nothing.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The greater one.
#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Numbers from a place on, as far as there are.
#[inline(always)]
fn some(column: &[f32], start: usize) -> [f32; WIDE] {
    match column[start..].first_chunk() {
        Some(whole) => *whole,
        None => {
            let mut part = [f32::NAN; WIDE];
            part[..column.len() - start].copy_from_slice(&column[start..]);
            part
        }
    }
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

    /// Samples of which those in the left columns of 41 look alike.
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
                    Certainty { level, ..Certainty::new(None, (background, false), transparent, error, factor(0.95)) };
                let (shown, pixels) = judge.see_samples(&samples);
                let groups: Vec<[Sum; 1]> = samples.iter().map(|sample| [Sum::of(sample)]).collect();
                let resolved: Vec<_> = samples.iter().map(|sample| Sum::of(sample).resolve(background).0).collect();
                assert_eq!(pixels.beauty, resolved);
                let mut seen = Vec::new();
                judge.see_each(groups.iter().map(|group| &group[..]), |one| seen.push(*one));
                let even =
                    judge.compare(&shown, columns, (1..rows - 1).map(|row| row * columns + 1..(row + 1) * columns - 1));
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
                    assert_eq!(even.error(at), judge.contrast(&range) / RANGE, "{at}");
                    (evens, all) = (evens + usize::from(even.is_even(at)), all + 1);
                }
                assert!(evens > all / 10 && evens < all * 9 / 10, "{evens} of {all}");
            }
        }
    }
}
