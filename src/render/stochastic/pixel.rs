//! A pixel that is sampled until its mean is certain.

use super::places::Wanted;
use crate::render::certainty::{Certainty, GROUPS, Range};
use crate::render::fireflies::Fireflies;
use crate::render::frame::{Sum, pixel_key};
use crate::render::layers::{FirstSurface, LayerSum};
use crate::render::tile::{End, PixelFacts};
use crate::render::whitted::Sample;

/// A pixel on its way.
pub(super) struct Pixel {
    /// Column and row.
    pub at: (u32, u32),
    /// For all of its numbers.
    key: u32,
    /// Samples in the order of the sequence, the same number in each.
    pub groups: [Sum; GROUPS],
    /// If they are wanted.
    pub layers: Option<Box<LayerSum>>,
    pub facts: PixelFacts,
    /// Of one of its samples, as its groups tell it once each has one.
    variance: Option<f32>,
    /// Between its first samples and those of the pixels beside it.
    contrast: f32,
    /// The brightest light among these.
    brightest: f32,
    /// How bright the fireflies are that it may meet; 0: none.
    pub firefly: f32,
    /// How much too dark it is by others that it may meet.
    pub missed: f32,
}

impl Pixel {
    pub(super) fn new(seed: u64, at: (u32, u32), layers: bool) -> Self {
        Self {
            at,
            key: pixel_key(seed, at),
            groups: Default::default(),
            layers: layers.then(Box::default),
            facts: PixelFacts { count: 0, spare: 0, error: 0.0, end: End::Open },
            variance: None,
            contrast: 0.0,
            brightest: 0.0,
            firefly: 0.0,
            missed: 0.0,
        }
    }

    /// Takes its first samples, or those that come next, of which so many go into each group.
    pub(super) fn take(&mut self, samples: &[Sample], firsts: &[FirstSurface], in_group: usize) {
        let start = self.facts.count as usize;
        for (i, sample) in (start..).zip(samples) {
            self.groups[i / in_group].add(sample);
        }
        #[expect(clippy::cast_possible_truncation, reason = "far less than 2^32 samples")]
        let count = samples.len() as u32;
        self.facts.count += count;
        if let Some(layers) = &mut self.layers {
            firsts.iter().for_each(|first| layers.add(first));
        }
    }

    /// Expects fireflies that were met near it, if rays of some of these samples were spread by chance.
    pub(super) fn expect(&mut self, fireflies: Option<&Fireflies>, by_chance: &[bool]) {
        if let Some(fireflies) = fireflies.filter(|_| by_chance.contains(&true)) {
            (self.firefly, self.missed) = (fireflies.at(self.at), fireflies.missed_at(self.at));
        }
    }

    /// It is certain enough, with this standard error.
    pub(super) fn done(&mut self, error: f32) {
        (self.facts.error, self.facts.end) = (error, End::Met);
    }

    /// Whether so many samples were enough.
    pub(super) fn is_done_with(&self, samples: u32) -> bool {
        self.facts.end == End::Met && self.facts.count == samples
    }

    /// Remembers what its first samples and those of the pixels beside it lie between, and what it may meet by chance.
    pub(super) fn surround(&mut self, judge: &Certainty, range: &Range) {
        let range = if self.firefly > 0.0 { range.with(judge.range_of(self.firefly)) } else { *range };
        (self.contrast, self.brightest) = (judge.contrast(&range), range.brightest);
    }

    /// The `index`th of its samples.
    pub(super) fn wanted(&self, index: u32) -> Wanted {
        Wanted { pixel: self.at, key: self.key, index }
    }

    /// Makes groups that hold as many samples as those that come next will.
    pub(super) fn join_groups(&mut self) {
        let joined = |k: usize| match self.groups.get(2 * k..2 * k + 2) {
            Some([a, b]) => a.plus(*b, 1.0),
            _ => Sum::default(),
        };
        self.groups = std::array::from_fn(joined);
    }

    pub(super) fn sum(&self) -> Sum {
        self.groups.iter().fold(Sum::default(), |sum, group| sum.plus(*group, 1.0))
    }

    /// The groups that have samples.
    pub(super) fn taken(&self) -> &[Sum] {
        &self.groups[..GROUPS.min(self.facts.count as usize)]
    }

    /// Learns the standard error of its mean from its own samples; the variance of one of these.
    pub(super) fn learn(&mut self, error: f32) -> f32 {
        let variance = self.variance_of(error);
        self.take_to_vary(variance);
        *self.variance.insert(variance)
    }

    /// The variance of one of its samples whose mean has this standard error.
    pub(super) fn variance_of(&self, error: f32) -> f32 {
        // Of light without end it is no number.
        (error * error * self.samples()).max(0.0)
    }

    /// The variance of one of its samples; `None` as long as there are too few.
    pub(super) fn variance(&self) -> Option<f32> {
        self.variance
    }

    /// Takes its samples to vary so much.
    pub(super) fn take_to_vary(&mut self, variance: f32) {
        self.facts.error = (variance / self.samples()).sqrt();
    }

    /// Finds out how certain the mean is, whose standard error is known.
    pub(super) fn look(&mut self, judge: &Certainty) {
        let used = self.used(judge);
        if used <= 1.0 {
            self.facts.end = End::Met;
            self.facts.spare = judge.spare(used, self.facts.count);
        }
    }

    /// The part of the error that is allowed which it uses.
    pub(super) fn used(&self, judge: &Certainty) -> f32 {
        let contrast = self.contrast * judge.beyond_white(&self.groups, self.brightest);
        judge.used(self.facts.error, contrast, self.facts.count)
    }

    #[expect(clippy::cast_precision_loss, reason = "far less than 2^24 samples")]
    fn samples(&self) -> f32 {
        self.facts.count as f32
    }
}
