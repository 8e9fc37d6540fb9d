//! Area lights at the points of a batch: for each light every point draws as many samples as its ray is worth; all points
//! evaluate their first samples together, then their second ones.

use super::columns::{Column, Columns, POINTS, ShadingBatch};
use crate::render::draws::SampleSet;

/// Samples that each point draws on one light.
pub(super) struct Drawn {
    /// Whether points draw [`SampleSet::Part`] (from `keys` and `firsts`) or [`SampleSet::Moved`] (from `shifts`): the same for
    /// all points of a picture.
    is_sequence: bool,
    keys: [u32; POINTS],
    firsts: [u32; POINTS],
    shifts: [Column; 2],
    /// Number of samples of each point; 0 where the point is not shaded here.
    counts: [u32; POINTS],
    /// Fraction of the light that one sample stands for.
    parts: Column,
    /// Ends of the shadow rays, unless the light is at infinity.
    pub ends: Columns,
}

impl Default for Drawn {
    fn default() -> Self {
        let (none, zeros) = ([0; POINTS], [0.0; POINTS]);
        let (is_sequence, shifts, ends) = (false, [zeros; 2], [zeros; 3]);
        Self { is_sequence, keys: none, firsts: none, shifts, counts: none, parts: zeros, ends }
    }
}

impl Drawn {
    /// Whether point `i` draws a `k`th sample.
    #[inline(always)]
    pub(super) fn has(&self, i: usize, k: u32) -> bool {
        k < self.counts[i]
    }

    #[inline(always)]
    pub(super) fn part(&self, i: usize) -> f32 {
        self.parts[i]
    }

    /// Random numbers of the `k`th sample of each point.
    #[inline(always)]
    pub(super) fn places(&self, k: u32, points: usize) -> [Column; 2] {
        let (mut x, mut y) = ([0.0; POINTS], [0.0; POINTS]);
        // The kind is matched outside the loop, which is then branch-free.
        if self.is_sequence {
            (0..points.min(POINTS)).for_each(|i| [x[i], y[i]] = self.part_of_sequence(i).point(k));
        } else {
            (0..points.min(POINTS)).for_each(|i| [x[i], y[i]] = self.moved(i).point(k));
        }
        [x, y]
    }

    #[inline(always)]
    fn part_of_sequence(&self, i: usize) -> SampleSet {
        SampleSet::Part { key: self.keys[i], first: self.firsts[i] }
    }

    #[inline(always)]
    fn moved(&self, i: usize) -> SampleSet {
        SampleSet::Moved([self.shifts[0][i], self.shifts[1][i]])
    }
}

impl ShadingBatch {
    /// Sets the sample set and the number of samples of these points, given by index, and 0 for all others; returns the largest
    /// number.
    pub(crate) fn draw(&mut self, points: impl Iterator<Item = (usize, SampleSet, u32)>) -> u32 {
        let drawn = &mut self.drawn;
        drawn.counts = [0; POINTS];
        let mut most = 0;
        for (i, spread, count) in points {
            match spread {
                SampleSet::Part { key, first } => {
                    (drawn.keys[i], drawn.firsts[i], drawn.is_sequence) = (key, first, true)
                }
                SampleSet::Moved([x, y]) => {
                    (drawn.shifts[0][i], drawn.shifts[1][i], drawn.is_sequence) = (x, y, false);
                }
            }
            (drawn.counts[i], drawn.parts[i]) = (count, 1.0 / count.max(1) as f32);
            most = most.max(count);
        }
        most
    }

    /// Random numbers of the `k`th sample of point `i`.
    pub(crate) fn drawn(&self, i: usize, k: u32) -> [f32; 2] {
        let drawn = &self.drawn;
        if drawn.is_sequence { drawn.part_of_sequence(i).point(k) } else { drawn.moved(i).point(k) }
    }
}
