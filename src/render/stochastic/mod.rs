//! Stochastic sampling of a tile: its pixels advance together in rounds, and only those that are not yet certain enter the next.
//!
//! A pixel is judged by its own samples, and in the first rounds also by those of its neighbours ([`neighborhood`]): a pixel that
//! happens to miss a detail that its neighbours see goes on with them. Pixels around the tile are therefore sampled in these
//! rounds, too. Where pixels start with one sample, tiles share these ([`shared`]); all further samples this tile traces for
//! itself, and counts: which they are depends on the whole tile, and no tile may wait for another to finish.

mod first_samples;
mod neighborhood;
mod pixel;
mod sample_batch;
mod shared;
mod variances;

use super::Settings;
use super::ahead::{Ahead, OfPixel};
use super::certainty::{Certainty, GROUPS, SURE, output};
use super::context::Context;
use super::fireflies::Fireflies;
use super::frame::Frame;
use super::layers::LayerPixel;
use super::observer::Observer;
use super::roulette::Roulette;
use super::sampling::Stochastic;
use super::tile::{Convergence, PixelFacts, TOGETHER, Tile, TilePixels, put_row};
use super::whitted::Tracer;
use crate::accel::Accel;
use crate::image::Output;
use first_samples::FirstSamples;
use neighborhood::Neighborhood;
use pixel::Pixel;
pub(in crate::render) use sample_batch::{SampleBatch, SampleRequest};
pub(super) use shared::render_all;
use std::ops::Range;

/// Number of samples from which variances are used: one in each group.
const FIRST_VARIANCE: u32 = GROUPS as u32;

/// Renders one tile by itself; `None` when cancelled.
pub(super) fn render<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    tile: Tile,
) -> Option<TilePixels> {
    let output = output(how.space, frame.background);
    let sampler = Sampler::new(frame, how, output.as_ref(), tracer.context);
    if !sampler.starts_with_one() {
        return sampler.finish(tracer, tile, &[]);
    }
    let outermost = sampler.grown(tile, sampler.reach());
    let first = sampler.trace_first(tracer, std::iter::once(tile).chain(outermost.without(tile)))?;
    let mut done = sampler.finish(tracer, tile, &[&first])?;
    let beyond = if sampler.ahead.is_some() { 0 } else { outermost.pixels() - tile.pixels() };
    done.rays_beyond += beyond as u64;
    done.rays += beyond as u64;
    Some(done)
}

/// Sampler of all tiles of a picture.
struct Sampler<'a> {
    frame: &'a Frame<'a>,
    how: &'a Stochastic,
    judge: Certainty<'a>,
    fireflies: Option<&'a Fireflies>,
    /// Number of first samples of each pixel that are traced before the picture.
    first_samples: u32,
    /// The samples traced ahead, if they were kept; a mere forecast of the picture's cost does not keep them.
    ahead: Option<&'a Ahead>,
    /// Number of samples of a pixel after each round.
    rounds: Vec<u32>,
}

/// A tile in progress.
struct TileState {
    tile: Tile,
    /// What the samples of the tile and its surroundings show.
    around: Neighborhood,
    /// Pixels that have more than one sample, or get more.
    pixels: Vec<Pixel>,
    /// Indices of the pixels that go on.
    active: Vec<usize>,
    /// Buffers.
    batch: SampleBatch,
    errors: Vec<f32>,
}

impl<'a> Sampler<'a> {
    fn new(frame: &'a Frame, how: &'a Stochastic, output: Option<&'a Output>, context: &'a Context) -> Self {
        let judge = Certainty::of(frame, how, output, context.scene.background);
        let fireflies = context.fireflies.as_deref();
        let ahead = context.ahead.as_deref();
        let rounds = rounds(how, frame.settings, context.first_samples).collect();
        Self { frame, how, judge, fireflies, first_samples: context.first_samples, ahead, rounds }
    }

    /// Whether all pixels get a single sample at first.
    fn starts_with_one(&self) -> bool {
        self.rounds[0] == 1
    }

    /// Number of rings of pixels around a tile that are sampled: one for each round that compares neighbours and is followed by
    /// another round.
    fn reach(&self) -> usize {
        neighbor_rounds(&self.rounds).min(self.rounds.len() - 1)
    }

    /// A tile grown by so many rings of pixels.
    fn grown(&self, tile: Tile, rings: usize) -> Tile {
        let Settings { width, height, .. } = *self.frame.settings;
        (0..rings).fold(tile, |tile, _| tile.grown(width, height))
    }

    fn pixel(&self, at: (u32, u32)) -> Pixel {
        Pixel::new(self.frame.settings.seed, at, self.frame.settings.layers)
    }

    /// Renders a tile, from the first samples of it and of its surroundings where pixels start with one; `None` when cancelled.
    fn finish<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        tile: Tile,
        first: &[&FirstSamples],
    ) -> Option<TilePixels> {
        let (mut state, mut done) = self.begin(tile, first);
        // Number of samples that each pixel has already: that of the first round, or none.
        let taken = u32::from(self.starts_with_one());
        let mut from = taken;
        for (round, &to) in self.rounds.iter().enumerate().skip(usize::from(taken == 1)) {
            if state.active.is_empty() {
                break;
            }
            self.trace(tracer, &mut state.batch, &mut state.pixels, &state.active, from..to)?;
            if round < neighbor_rounds(&self.rounds) {
                self.judge_neighbors(tracer, &mut state, first, round, from..to)?;
            }
            if to >= FIRST_VARIANCE {
                self.judge_certainty(tracer, &mut state, to)?;
            }
            state.active.retain(|&i| state.pixels[i].facts.convergence == Convergence::Open);
            from = to;
        }
        for pixel in state.pixels.iter_mut().filter(|pixel| pixel.variance().is_some()) {
            state.around.compare(pixel);
            if pixel.facts.convergence == Convergence::Converged {
                pixel.judge(&self.judge);
            }
        }
        self.put(&state.pixels, taken, &mut done);
        Some(done)
    }

    /// State of a tile at the start, and its pixels as far as they are done then.
    fn begin(&self, tile: Tile, first: &[&FirstSamples]) -> (TileState, TilePixels) {
        let reach = self.reach();
        let mut around = Neighborhood::new(self.grown(tile, reach), first);
        let (mut pixels, mut done) = (Vec::with_capacity(around.tile.pixels()), self.empty_tile(tile));
        if self.starts_with_one() {
            let known = self.grown(tile, reach.saturating_sub(1));
            self.take_first(first, &mut around, known, &mut pixels, &mut done);
        } else {
            around.tile.places().for_each(|at| {
                around.register(at, pixels.len());
                pixels.push(self.pixel(at));
            });
        }
        let active = (0..pixels.len()).collect();
        (TileState { tile, around, pixels, active, batch: SampleBatch::default(), errors: Vec::new() }, done)
    }

    /// Compares the pixels that go on with their neighbours, after a round of these samples: finished pixels near uneven ones are
    /// reopened, and those that their neighbours confirm are done.
    fn judge_neighbors<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        state: &mut TileState,
        first: &[&FirstSamples],
        round: usize,
        samples: Range<u32>,
    ) -> Option<()> {
        let TileState { tile, around, pixels, active, batch, .. } = state;
        let (judge, reach) = (&self.judge, self.reach());
        let known = self.grown(*tile, reach.saturating_sub(1));
        around.see(judge, pixels, active);
        let mut added = if samples.start > 0 { active.clone() } else { Vec::new() };
        while !added.is_empty() {
            let open = |at| self.open_pixel(first, at);
            added = around.reopen_near_uneven(judge, pixels, &added, samples.start, known, open);
            self.trace(tracer, batch, pixels, &added, samples.clone())?;
            around.see(judge, pixels, &added);
            active.extend(&added);
        }
        // Neighbours of the outermost pixels are unknown.
        let known = self.grown(*tile, reach.saturating_sub(round + 1));
        active.retain(|&i| known.contains(pixels[i].at));
        around.judge(judge, pixels, active);
        Some(())
    }

    /// Estimates the errors of the active pixels, with so many samples; neighbours that seemed certain with fewer, and no longer
    /// are, get as many.
    fn judge_certainty<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        state: &mut TileState,
        samples: u32,
    ) -> Option<()> {
        let TileState { tile, around, pixels, active, batch, errors } = state;
        around.estimate_errors(&self.judge, pixels, active, errors);
        let mut added = active.clone();
        while !added.is_empty() {
            added = around.reopen_uncertain(&self.judge, pixels, &added, samples, *tile);
            // Those that already have as many samples are still active.
            active.extend(added.iter().filter(|&&i| pixels[i].facts.count < samples));
            self.catch_up(tracer, batch, pixels, &added, samples)?;
            around.estimate_errors(&self.judge, pixels, &added, errors);
        }
        Some(())
    }

    /// A tile with empty pixels.
    fn empty_tile(&self, tile: Tile) -> TilePixels {
        let frame = self.frame;
        let (pixels, layers) = (tile.pixels(), if frame.settings.layers { tile.pixels() } else { 0 });
        TilePixels {
            beauty: vec![[0.0; 4]; pixels],
            veil: vec![[0.0; 4]; if frame.has_veil { pixels } else { 0 }],
            facts: vec![PixelFacts { count: 0, spare: 0, error: 0.0, convergence: Convergence::Open }; pixels],
            layers: vec![LayerPixel::new(&[], frame.view.eye, frame.view.forward); layers],
            ..TilePixels::empty(tile)
        }
    }

    /// Takes the first sample of every pixel, and of those around the tile that are `known`; opens the pixels that need more.
    fn take_first(
        &self,
        first: &[&FirstSamples],
        around: &mut Neighborhood,
        known: Tile,
        pixels: &mut Vec<Pixel>,
        done: &mut TilePixels,
    ) {
        let mut even = around.even(&self.judge, known);
        if let Some(fireflies) = self.fireflies {
            let mut doubt = |at| {
                if fireflies.at(at) > 0.0 {
                    even.doubt(around.at(at))
                }
            };
            first.iter().for_each(|first| first.each_by_chance(known, &mut doubt));
        }
        // Block by block, as rays of nearby pixels are coherent.
        for block in known.blocks() {
            for y in block.y0..block.y1 {
                let start = around.at((block.x0, y));
                if even.are_even(start..start + (block.x1 - block.x0) as usize) {
                    continue;
                }
                for (x, at) in (block.x0..block.x1).zip(start..) {
                    if !even.is_even(at) {
                        around.register((x, y), pixels.len());
                        pixels.push(self.open_pixel(first, (x, y)));
                    }
                }
            }
        }
        let (tile, mut from) = (done.tile, 0);
        for block in tile.blocks() {
            let columns = (block.x1 - block.x0) as usize;
            for y in block.y0..block.y1 {
                let errors = even.errors(around.at((block.x0, y)), columns);
                let met = |&error: &f32| PixelFacts { count: 1, spare: 0, error, convergence: Convergence::Converged };
                put_row(&mut done.facts[from..from + columns], errors, met);
                from += columns;
            }
        }
        if let Some(fireflies) = self.fireflies {
            let mut miss = |at| done.facts[tile.number(at)].miss(fireflies.missed_at(at));
            first.iter().for_each(|first| first.each_by_chance(tile, &mut miss));
        }
        first.iter().for_each(|first| first.put(self.frame, done));
        done.rays = tile.pixels() as u64;
    }

    /// Opens a pixel with its first sample.
    fn open_pixel(&self, first: &[&FirstSamples], at: (u32, u32)) -> Pixel {
        let mut pixel = self.pixel(at);
        first.iter().for_each(|first| first.give(&mut pixel, self.fireflies));
        pixel
    }

    /// Stores pixels in the tile; the first `counted` samples of each are counted already.
    fn put(&self, pixels: &[Pixel], counted: u32, done: &mut TilePixels) {
        let (frame, tile) = (self.frame, done.tile);
        for pixel in pixels {
            if !tile.contains(pixel.at) {
                let count = pixel.facts.count;
                let first = counted.max(self.known(0..count));
                let around = u64::from(count - first);
                // Samples that are kept ahead need not be traced for pixels of other tiles.
                let beyond = if self.ahead.is_some() { 0 } else { u64::from(first - counted) };
                done.rays_around += around;
                done.rays_beyond += beyond;
                done.rays += around + beyond;
                continue;
            }
            done.rays += u64::from(pixel.facts.count - counted);
            let i = tile.number(pixel.at);
            let (color, veil) = pixel.sum().resolve(frame.background);
            (done.beauty[i], done.facts[i]) = (color, pixel.facts);
            done.facts[i].miss(pixel.missed);
            done.veil.get_mut(i).into_iter().for_each(|to| *to = veil);
            if let Some(layers) = &pixel.layers {
                done.layers[i] = layers.pixel(frame.view.eye, frame.view.forward);
            }
        }
    }

    /// Number of these samples that are traced before the picture: the first of them.
    fn known(&self, samples: Range<u32>) -> u32 {
        self.first_samples.clamp(samples.start, samples.end) - samples.start
    }

    /// Traces the samples that these pixels lack, up to `samples`, round by round.
    fn catch_up<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        batch: &mut SampleBatch,
        pixels: &mut [Pixel],
        late: &[usize],
        samples: u32,
    ) -> Option<()> {
        for (&from, &to) in self.rounds.iter().zip(&self.rounds[1..]).filter(|(_, to)| **to <= samples) {
            let now: Vec<usize> = late.iter().copied().filter(|&i| pixels[i].facts.count == from).collect();
            self.trace(tracer, batch, pixels, &now, from..to)?;
        }
        Some(())
    }

    /// Gives active pixels those of these samples that were traced before the picture; returns the rest.
    fn give_known(&self, pixels: &mut [Pixel], active: &[usize], samples: Range<u32>, in_group: usize) -> Range<u32> {
        let Some(ahead) = self.ahead else { return samples };
        let known = samples.start..samples.start + self.known(samples.clone());
        for &pixel in active.iter().filter(|_| !known.is_empty()) {
            let pixel = &mut pixels[pixel];
            let OfPixel { samples, by_chance, firsts } = ahead.of(pixel.at, known.clone());
            pixel.expect_fireflies(self.fireflies, by_chance);
            pixel.take(samples, firsts, in_group);
        }
        known.end..samples.end
    }

    /// Traces these samples of all active pixels, in batches.
    fn trace<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        batch: &mut SampleBatch,
        pixels: &mut [Pixel],
        active: &[usize],
        samples: Range<u32>,
    ) -> Option<()> {
        if samples.start as usize >= GROUPS {
            active.iter().for_each(|&pixel| pixels[pixel].join_groups());
        }
        let first = samples.start;
        let in_group = (samples.end as usize).div_ceil(GROUPS);
        let samples = self.give_known(pixels, active, samples, in_group);
        if samples.is_empty() {
            return Some(());
        }
        for some in active.chunks((TOGETHER / samples.len().max(1)).max(1)) {
            for start in samples.clone().step_by(TOGETHER) {
                let samples = start..samples.end.min(start + TOGETHER as u32);
                let each = samples.len();
                let wanted = some.iter().flat_map(|&pixel| {
                    let pixel = &pixels[pixel];
                    samples.clone().map(|i| pixel.request(i))
                });
                batch.trace(self.frame, self.how, tracer, Roulette::after(first, self.how), wanted)?;
                for (k, &pixel) in some.iter().enumerate() {
                    let of_pixel = k * each..(k + 1) * each;
                    let firsts = tracer.firsts.get(of_pixel.clone()).unwrap_or_default();
                    let by_chance = tracer.by_chance.get(of_pixel.clone()).unwrap_or_default();
                    pixels[pixel].expect_fireflies(self.fireflies, by_chance);
                    pixels[pixel].take(&tracer.samples[of_pixel], firsts, in_group);
                }
            }
        }
        Some(())
    }
}

/// Number of samples of a pixel after each round: the minimum, no fewer than `known`, then at least [`SURE`], then doubled every
/// round: powers of two throughout, as runs of such length are most evenly distributed.
fn rounds(how: &Stochastic, settings: &Settings, known: u32) -> impl Iterator<Item = u32> + use<> {
    let (fewest, most) = how.powers();
    // In a single row or column a pixel has too few neighbours.
    let least = if settings.width.min(settings.height) < 2 { SURE } else { 1 };
    std::iter::successors(Some(fewest.max(least).max(known).min(most)), move |&last| {
        (last < most).then(|| (2 * last).max(SURE).min(most))
    })
}

/// Number of rounds after which neighbours are compared: the first, and then the one in which a pixel gets [`SURE`] samples.
fn neighbor_rounds(rounds: &[u32]) -> usize {
    if rounds[0] < SURE { 2 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_double_and_end_at_the_most() {
        let rounds_from = |known, min_samples, max_samples, height| {
            let settings = Settings { width: 16, height, ..Settings::default() };
            let how = Stochastic { min_samples, max_samples, ..Stochastic::default() };
            super::rounds(&how, &settings, known).collect::<Vec<_>>()
        };
        let rounds_of = |min_samples, max_samples, height| rounds_from(0, min_samples, max_samples, height);
        let rounds = |min_samples, max_samples| rounds_of(min_samples, max_samples, 9);
        assert_eq!(rounds(1, 64), [1, 4, 8, 16, 32, 64]);
        assert_eq!(rounds(2, 8), [2, 4, 8]);
        assert_eq!(rounds(1, 2), [1, 2]);
        assert_eq!(rounds_of(1, 16, 1), [4, 8, 16], "of a single row");
        assert_eq!(rounds_from(8, 1, 64, 9), [8, 16, 32, 64], "of so many that are known");
        assert_eq!(rounds_from(2, 1, 16, 1), [4, 8, 16]);
        assert_eq!(rounds_from(16, 1, 8, 9), [8]);
        assert_eq!(rounds(4, 256), [4, 8, 16, 32, 64, 128, 256]);
        assert_eq!(rounds(4, 100), [4, 8, 16, 32, 64]);
        assert_eq!(rounds(30, 256), [32, 64, 128, 256]);
        assert_eq!(rounds(4, 4), [4]);
        assert_eq!(rounds(4, 3), [2]);
        assert_eq!(rounds(64, 16), [16]);
    }
}
