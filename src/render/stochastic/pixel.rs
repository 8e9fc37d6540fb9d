//! A pixel that is sampled until its mean is certain.

use super::sample_batch::SampleRequest;
use crate::render::certainty::{Certainty, GROUPS, Range};
use crate::render::fireflies::Fireflies;
use crate::render::frame::{Sum, pixel_key};
use crate::render::layers::{FirstSurface, LayerSum};
use crate::render::tile::{Convergence, PixelFacts};
use crate::render::whitted::Sample;

/// A pixel in progress.
pub(super) struct Pixel {
    /// Column and row.
    pub at: (u32, u32),
    /// Key of its random sequence.
    key: u32,
    /// Sums of samples in the order of the sequence, the same number in each group.
    pub groups: [Sum; GROUPS],
    /// Sums of the layers, if these are wanted.
    pub layers: Option<Box<LayerSum>>,
    pub facts: PixelFacts,
    /// Variance of one sample, estimated from the groups once each has one.
    variance: Option<f32>,
    /// Contrast between its first samples and those of its neighbours.
    contrast: f32,
    /// Brightest light among these samples.
    brightest: f32,
    /// Brightness of the fireflies that its rays may hit; 0: none.
    pub firefly: f32,
    /// Amount by which the pixel is too dark for lack of further fireflies.
    pub missed: f32,
}

impl Pixel {
    pub(super) fn new(seed: u64, at: (u32, u32), layers: bool) -> Self {
        Self {
            at,
            key: pixel_key(seed, at),
            groups: Default::default(),
            layers: layers.then(Box::default),
            facts: PixelFacts { count: 0, spare: 0, error: 0.0, convergence: Convergence::Open },
            variance: None,
            contrast: 0.0,
            brightest: 0.0,
            firefly: 0.0,
            missed: 0.0,
        }
    }

    /// Adds its next samples, `in_group` of which go into each group.
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

    /// Prepares for fireflies that were found near the pixel, if rays of some of these samples were spread at random.
    pub(super) fn expect_fireflies(&mut self, fireflies: Option<&Fireflies>, by_chance: &[bool]) {
        if let Some(fireflies) = fireflies.filter(|_| by_chance.contains(&true)) {
            (self.firefly, self.missed) = (fireflies.at(self.at), fireflies.missed_at(self.at));
        }
    }

    /// Marks the pixel as certain enough, with this standard error.
    pub(super) fn converge(&mut self, error: f32) {
        (self.facts.error, self.facts.convergence) = (error, Convergence::Converged);
    }

    /// Whether the pixel was done with exactly this number of samples.
    pub(super) fn is_done_with(&self, samples: u32) -> bool {
        self.facts.convergence == Convergence::Converged && self.facts.count == samples
    }

    /// Stores the contrast and the brightest light in `range`, that of its first samples and its neighbours', extended by the
    /// fireflies that it may hit.
    pub(super) fn set_contrast(&mut self, judge: &Certainty, range: &Range) {
        let range = if self.firefly > 0.0 { range.with(judge.range_of(self.firefly)) } else { *range };
        (self.contrast, self.brightest) = (judge.contrast(&range), range.brightest);
    }

    /// The sample of this index.
    pub(super) fn request(&self, index: u32) -> SampleRequest {
        SampleRequest { pixel: self.at, key: self.key, index }
    }

    /// Merges groups in pairs, so that each holds as many samples as the next ones will.
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

    /// Groups that have samples.
    pub(super) fn taken(&self) -> &[Sum] {
        &self.groups[..GROUPS.min(self.facts.count as usize)]
    }

    /// Stores the standard error estimated from its own samples; returns the variance of one of these.
    pub(super) fn learn(&mut self, error: f32) -> f32 {
        let variance = self.variance_of(error);
        self.set_variance(variance);
        *self.variance.insert(variance)
    }

    /// Variance of one sample, given the standard error of the mean.
    pub(super) fn variance_of(&self, error: f32) -> f32 {
        // For infinite light it would be NaN.
        (error * error * self.samples()).max(0.0)
    }

    /// Variance of one sample; `None` as long as there are too few.
    pub(super) fn variance(&self) -> Option<f32> {
        self.variance
    }

    /// Sets the error to that of samples with this variance.
    pub(super) fn set_variance(&mut self, variance: f32) {
        self.facts.error = (variance / self.samples()).sqrt();
    }

    /// Marks the pixel as done if its standard error is small enough.
    pub(super) fn judge(&mut self, judge: &Certainty) {
        let used = self.used(judge);
        if used <= 1.0 {
            self.facts.convergence = Convergence::Converged;
            self.facts.spare = judge.spare(used, self.facts.count);
        }
    }

    /// Fraction of the allowed error that the pixel uses.
    pub(super) fn used(&self, judge: &Certainty) -> f32 {
        let contrast = self.contrast * judge.beyond_white(&self.groups, self.brightest);
        judge.used(self.facts.error, contrast, self.facts.count)
    }

    #[expect(clippy::cast_precision_loss, reason = "far less than 2^24 samples")]
    fn samples(&self) -> f32 {
        self.facts.count as f32
    }
}
