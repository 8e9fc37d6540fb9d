//! Lights with an extent at the points of a strip: of each light every point draws as many of its places as its ray is worth,
//! and all points look at their first ones together, then at their second ones.

use super::columns::{Column, Columns, POINTS, Strip};
use crate::render::draws::Spread;

/// What each point draws of one light.
pub(super) struct Drawn {
    spreads: [Spread; POINTS],
    /// How many places of it; 0 where the point is not shaded here.
    counts: [u32; POINTS],
    /// What part of the light one of them stands for.
    parts: Column,
    /// Where shadow rays end, if that is anywhere.
    pub ends: Columns,
}

impl Default for Drawn {
    fn default() -> Self {
        let zeros = [0.0; POINTS];
        Self { spreads: [Spread::Moved([0.0; 2]); POINTS], counts: [0; POINTS], parts: zeros, ends: [zeros; 3] }
    }
}

impl Drawn {
    /// Whether point `i` draws a `k`th place.
    #[inline(always)]
    pub(super) fn has(&self, i: usize, k: u32) -> bool {
        k < self.counts[i]
    }

    #[inline(always)]
    pub(super) fn part(&self, i: usize) -> f32 {
        self.parts[i]
    }

    /// Numbers of the `k`th place of each point.
    #[inline(always)]
    pub(super) fn places(&self, k: u32, points: usize) -> [Column; 2] {
        let (mut keys, mut firsts) = ([0; POINTS], [0; POINTS]);
        let (mut x, mut y) = ([0.0; POINTS], [0.0; POINTS]);
        let mut is_sequence = false;
        for (i, spread) in self.spreads.iter().enumerate().take(points).filter(|(i, _)| self.counts[*i] > 0) {
            match *spread {
                Spread::Part { key, first } => (keys[i], firsts[i], is_sequence) = (key, first, true),
                Spread::Moved(shift) => [x[i], y[i]] = shift,
            }
        }
        // All points of a picture draw in one way. It is known outside the loop, which then is a formula.
        if is_sequence {
            for i in 0..points.min(POINTS) {
                [x[i], y[i]] = Spread::Part { key: keys[i], first: firsts[i] }.point(k);
            }
        } else {
            for i in 0..points.min(POINTS) {
                [x[i], y[i]] = Spread::Moved([x[i], y[i]]).point(k);
            }
        }
        [x, y]
    }
}

impl Strip {
    /// Has points, told by number, draw so many places of a light each from their numbers, and the others none; the most of any.
    pub(crate) fn draw(&mut self, points: impl Iterator<Item = (usize, Spread, u32)>) -> u32 {
        let drawn = &mut self.drawn;
        drawn.counts = [0; POINTS];
        let mut most = 0;
        for (i, spread, count) in points {
            (drawn.spreads[i], drawn.counts[i], drawn.parts[i]) = (spread, count, 1.0 / count.max(1) as f32);
            most = most.max(count);
        }
        most
    }

    /// The numbers of the `k`th place that point `i` draws.
    pub(crate) fn drawn(&self, i: usize, k: u32) -> [f32; 2] {
        self.drawn.spreads[i].point(k)
    }
}
