//! Stochastic sampling of a tile: its pixels advance together in rounds, and only those that are not certain yet go into
//! the next.
//!
//! What decides about a pixel are its own samples, and in the first round those of the pixels beside it: a pixel that
//! happens to see nothing of what its neighbours see goes on with them. Pixels around the tile are therefore sampled in that
//! round too, by this tile for itself, since no tile may wait for another; that their rays are traced again is counted.

use super::certainty::{self, Certainty, GROUPS, Seen, output};
use super::draws::Stream;
use super::eyes::Place;
use super::frame::{Frame, Sum, pixel_key};
use super::layers::LayerSum;
use super::observer::Observer;
use super::sampling::Stochastic;
use super::sobol;
use super::tile::{End, PixelFacts, TOGETHER, Tile, TilePixels};
use super::whitted::Tracer;
use crate::accel::Accel;
use crate::scene::Background;
use std::ops::Range;

/// Samples at which variances are first relied on: one in each group.
const FIRST_LOOK: u32 = GROUPS as u32;

/// A pixel on its way.
struct Pixel {
    x: u32,
    y: u32,
    /// For all of its numbers.
    key: u32,
    /// Where its samples lie.
    places: sobol::Points<2>,
    /// Samples in the order of the sequence, the same number in each.
    groups: [Sum; GROUPS],
    layers: LayerSum,
    facts: PixelFacts,
    /// Between the samples of the first round of it and of the pixels beside it.
    contrast: f32,
    /// The brightest light among these.
    brightest: f32,
}

/// Renders one tile; `None` when cancelled.
pub(super) fn render<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    tile: Tile,
) -> Option<TilePixels> {
    let output = output(how.space, frame.background);
    let transparent = matches!(tracer.context.scene.background, None | Some(Background::Transparent));
    let judge = Certainty::new(output.as_ref(), frame.background, transparent, how.error, frame.standard_errors);
    let rounds: Vec<u32> = rounds(how).collect();
    // After a single round nothing is decided, and nobody asks what lies around.
    let wide = if rounds.len() > 1 { tile.grown(frame.settings.width, frame.settings.height) } else { tile };
    let places = tile.places().chain(wide.places().filter(|&at| !tile.contains(at)));
    let mut pixels: Vec<Pixel> = places.map(|at| Pixel::new(frame.settings.seed, at)).collect();
    let mut active: Vec<usize> = (0..pixels.len()).collect();
    let (mut from, mut errors) = (0, Vec::new());
    for to in rounds {
        trace(frame, how, tracer, &mut pixels, &active, from..to)?;
        if from == 0 {
            look_around(&judge, wide, &mut pixels, to < FIRST_LOOK);
            active.truncate(tile.pixels());
        }
        if to >= FIRST_LOOK {
            look(&judge, &mut pixels, &active, &mut errors);
        }
        active.retain(|&i| pixels[i].facts.end == End::Ceiling);
        from = to;
    }
    let rays = |pixels: &[Pixel]| pixels.iter().map(|pixel| u64::from(pixel.facts.count)).sum::<u64>();
    let rays_around = rays(&pixels[tile.pixels()..]);
    pixels.truncate(tile.pixels());
    let rays = rays(&pixels) + rays_around;
    let view = frame.view;
    Some(TilePixels {
        tile,
        beauty: pixels.iter().map(|pixel| pixel.sum().resolve(frame.background)).collect(),
        layers: match frame.settings.layers {
            true => pixels.iter().map(|pixel| pixel.layers.pixel(view.eye, view.forward)).collect(),
            false => Vec::new(),
        },
        facts: pixels.iter().map(|pixel| pixel.facts).collect(),
        rays,
        rays_around,
    })
}

/// Samples of a pixel after each round: the fewest, then twice as many from round to round, powers of two throughout, as
/// these many points of the sequence lie most evenly.
fn rounds(how: &Stochastic) -> impl Iterator<Item = u32> {
    let most = 1 << how.max_samples.max(1).ilog2();
    let fewest = how.min_samples.max(1).checked_next_power_of_two().unwrap_or(most).min(most);
    std::iter::successors(Some(fewest), move |&last| (last < most).then_some(2 * last))
}

/// Traces these samples of all active pixels, in batches.
fn trace<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    pixels: &mut [Pixel],
    active: &[usize],
    samples: Range<u32>,
) -> Option<()> {
    if samples.start as usize >= GROUPS {
        active.iter().for_each(|&pixel| pixels[pixel].join_groups());
    }
    let in_group = (samples.end as usize).div_ceil(GROUPS);
    let mut places = Places::default();
    for some in active.chunks((TOGETHER / samples.len().max(1)).max(1)) {
        for start in samples.clone().step_by(TOGETHER) {
            let samples = start..samples.end.min(start + TOGETHER as u32);
            trace_batch(frame, how, tracer, (pixels, some), (samples, in_group), &mut places)?;
        }
    }
    Some(())
}

/// Where samples lie in their pixels; buffers.
#[derive(Default)]
struct Places {
    many: sobol::Many,
    squares: Vec<[f64; 2]>,
}

/// Traces the same samples of `some` pixels, of which so many go into each group, all together.
fn trace_batch<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    (pixels, some): (&mut [Pixel], &[usize]),
    (samples, in_group): (Range<u32>, usize),
    places: &mut Places,
) -> Option<()> {
    let each = samples.len();
    tracer.reset(some.len() * each, frame.settings.layers);
    let eye = frame.eye(tracer.center());
    let all = &*pixels;
    some.iter().for_each(|&pixel| tracer.streams.extend(samples.clone().map(|i| all[pixel].stream(i))));
    if frame.settings.lens.is_some() {
        let places = some.iter().flat_map(|&pixel| samples.clone().map(move |i| all[pixel].place_and_lens(how, i)));
        tracer.eyes.send(&eye, places);
    } else {
        let Places { many, squares } = places;
        squares.clear();
        many.find(some.iter().flat_map(|&pixel| samples.clone().map(move |i| (all[pixel].places, i))), squares);
        how.filter.place_each(squares.as_flattened_mut());
        let places = some.iter().zip(squares.chunks(each)).flat_map(|(&pixel, squares)| {
            let pixel = &all[pixel];
            squares.iter().map(move |&place| pixel.place(place, [0.5; 2]))
        });
        tracer.eyes.send(&eye, places);
    }
    if !tracer.trace() {
        return None;
    }
    for (k, &pixel) in some.iter().enumerate() {
        let (pixel, of_pixel) = (&mut pixels[pixel], k * each..(k + 1) * each);
        for (i, sample) in samples.clone().zip(&tracer.samples[of_pixel.clone()]) {
            pixel.groups[i as usize / in_group].add(sample);
        }
        pixel.facts.count += samples.end - samples.start;
        tracer.facts.get(of_pixel).into_iter().flatten().for_each(|facts| pixel.layers.add(facts));
    }
    Some(())
}

/// Finds the contrast around each pixel after a first round, and if that `may_end` with it those that are done: their samples
/// and those of the pixels beside them agree each among themselves, and both are of the same colours.
fn look_around(judge: &Certainty, tile: Tile, pixels: &mut [Pixel], may_end: bool) {
    let (width, height) = (tile.x1 - tile.x0, tile.y1 - tile.y0);
    let index = |x: u32, y: u32| ((y - tile.y0) * width + x - tile.x0) as usize;
    let mut seen = vec![Seen::NOTHING; (width * height) as usize];
    let mut agree = vec![false; seen.len()];
    let mut each = pixels.iter();
    judge.see_each(pixels.iter().map(Pixel::taken), |of_pixel| {
        let at = each.next().map_or(0, |pixel| index(pixel.x, pixel.y));
        (seen[at], agree[at]) = (*of_pixel, judge.agree(&of_pixel.range));
    });
    for pixel in pixels.iter_mut() {
        let (x, y) = (pixel.x, pixel.y);
        let own = &seen[index(x, y)];
        pixel.facts.error = own.error;
        let columns = x.saturating_sub(1).max(tile.x0)..(x + 2).min(tile.x1);
        let rows = y.saturating_sub(1).max(tile.y0)..(y + 2).min(tile.y1);
        let around = rows.map(|y| index(columns.start, y)..index(columns.end - 1, y) + 1);
        // Nearly all are calm, so that all are asked without asking whether one was not.
        let is_calm = |calm: bool, at: usize| calm & agree[at] & !judge.differ(own.color, seen[at].color);
        if may_end && around.clone().flatten().fold(true, is_calm) {
            pixel.facts.end = End::Met;
        } else {
            let around = around.flatten().fold(certainty::Range::NOTHING, |all, at| all.with(seen[at].range));
            (pixel.contrast, pixel.brightest) = (judge.contrast(&around), around.brightest);
        }
    }
}

/// Finds out how certain the means of these pixels are.
fn look(judge: &Certainty, pixels: &mut [Pixel], active: &[usize], errors: &mut Vec<f32>) {
    errors.clear();
    judge.each_standard_error(active.iter().map(|&i| &pixels[i].groups[..]), |error| errors.push(error));
    for (&i, &error) in active.iter().zip(&*errors) {
        pixels[i].facts.error = error;
        pixels[i].look(judge);
    }
}

impl Pixel {
    fn new(seed: u64, (x, y): (u32, u32)) -> Self {
        let facts = PixelFacts { count: 0, spare: 0, error: 0.0, end: End::Ceiling };
        let key = pixel_key(seed, (x, y));
        Self {
            x,
            y,
            key,
            places: sobol::Points::of(key),
            groups: Default::default(),
            layers: LayerSum::default(),
            facts,
            contrast: 0.0,
            brightest: 0.0,
        }
    }

    /// The `i`th sample's numbers.
    fn stream(&self, i: u32) -> Stream {
        Stream { key: self.key, index: i }
    }

    /// Where the `i`th sample goes through the picture and the lens. Its first two numbers are those without a lens.
    fn place_and_lens(&self, how: &Stochastic, i: u32) -> Place {
        let [x, y, u, v] = sobol::point(i, self.key);
        self.place([x, y].map(|number| how.filter.place(number)), [u, v])
    }

    /// The place so far from the pixel's upper left corner, seen through a point of the lens.
    fn place(&self, [x, y]: [f64; 2], lens: [f64; 2]) -> Place {
        Place { x: f64::from(self.x) + x, y: f64::from(self.y) + y, lens }
    }

    /// Makes groups that hold as many samples as those that come next will.
    fn join_groups(&mut self) {
        let joined = |k: usize| match self.groups.get(2 * k..2 * k + 2) {
            Some([a, b]) => a.plus(*b, 1.0),
            _ => Sum::default(),
        };
        self.groups = std::array::from_fn(joined);
    }

    fn sum(&self) -> Sum {
        self.groups.iter().fold(Sum::default(), |sum, group| sum.plus(*group, 1.0))
    }

    /// The groups that have samples.
    fn taken(&self) -> &[Sum] {
        &self.groups[..GROUPS.min(self.facts.count as usize)]
    }

    /// Finds out how certain the mean is, whose standard error is known.
    fn look(&mut self, judge: &Certainty) {
        let contrast = self.contrast * judge.beyond_white(&self.groups, self.brightest);
        let used = judge.used(self.facts.error, contrast, self.facts.count);
        if used <= 1.0 {
            self.facts.end = End::Met;
            self.facts.spare = judge.spare(used, self.facts.count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_double_and_end_at_the_most() {
        let rounds = |min_samples, max_samples| {
            super::rounds(&Stochastic { min_samples, max_samples, ..Stochastic::default() }).collect::<Vec<_>>()
        };
        assert_eq!(rounds(4, 256), [4, 8, 16, 32, 64, 128, 256]);
        assert_eq!(rounds(4, 100), [4, 8, 16, 32, 64]);
        assert_eq!(rounds(30, 256), [32, 64, 128, 256]);
        assert_eq!(rounds(4, 4), [4]);
        assert_eq!(rounds(4, 3), [2]);
        assert_eq!(rounds(64, 16), [16]);
    }
}
