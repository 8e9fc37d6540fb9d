//! A pixel that is sampled until its mean is certain.

use crate::render::certainty::{Certainty, GROUPS, Range};
use crate::render::draws::Stream;
use crate::render::eyes::Place;
use crate::render::frame::{Sum, pixel_key};
use crate::render::layers::LayerSum;
use crate::render::sampling::Stochastic;
use crate::render::sobol;
use crate::render::tile::{End, PixelFacts};

/// A pixel on its way.
pub(super) struct Pixel {
    pub x: u32,
    pub y: u32,
    /// For all of its numbers.
    key: u32,
    /// Where its samples lie.
    pub places: sobol::Points<2>,
    /// Samples in the order of the sequence, the same number in each.
    pub groups: [Sum; GROUPS],
    /// If they are wanted.
    pub layers: Option<Box<LayerSum>>,
    pub facts: PixelFacts,
    /// Between its first samples and those of the pixels beside it.
    contrast: f32,
    /// The brightest light among these.
    brightest: f32,
}

impl Pixel {
    pub(super) fn new(seed: u64, (x, y): (u32, u32), layers: bool) -> Self {
        let facts = PixelFacts { count: 0, spare: 0, error: 0.0, end: End::Ceiling };
        let key = pixel_key(seed, (x, y));
        Self {
            x,
            y,
            key,
            places: sobol::Points::of(key),
            groups: Default::default(),
            layers: layers.then(Box::default),
            facts,
            contrast: 0.0,
            brightest: 0.0,
        }
    }

    /// It is certain enough, with this standard error.
    pub(super) fn done(&mut self, error: f32) {
        (self.facts.error, self.facts.end) = (error, End::Met);
    }

    /// Remembers what its first samples and those of the pixels beside it lie between.
    pub(super) fn surround(&mut self, judge: &Certainty, range: &Range) {
        (self.contrast, self.brightest) = (judge.contrast(range), range.brightest);
    }

    /// The `i`th sample's numbers.
    pub(super) fn stream(&self, i: u32) -> Stream {
        Stream { key: self.key, index: i }
    }

    /// Where the `i`th sample goes through the picture and the lens. Its first two numbers are those without a lens.
    pub(super) fn place_and_lens(&self, how: &Stochastic, i: u32) -> Place {
        let [x, y, u, v] = sobol::point(i, self.key);
        self.place([x, y].map(|number| how.filter.place(number)), [u, v])
    }

    /// The place so far from the pixel's upper left corner, seen through a point of the lens.
    pub(super) fn place(&self, [x, y]: [f64; 2], lens: [f64; 2]) -> Place {
        Place { x: f64::from(self.x) + x, y: f64::from(self.y) + y, lens }
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

    /// Finds out how certain the mean is, whose standard error is known.
    pub(super) fn look(&mut self, judge: &Certainty) {
        let contrast = self.contrast * judge.beyond_white(&self.groups, self.brightest);
        let used = judge.used(self.facts.error, contrast, self.facts.count);
        if used <= 1.0 {
            self.facts.end = End::Met;
            self.facts.spare = judge.spare(used, self.facts.count);
        }
    }
}
