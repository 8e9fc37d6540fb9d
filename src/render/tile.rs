//! The picture in tiles: each is one unit of work for one thread, and threads take the next tile when they are done.
//!
//! Nothing that a tile computes depends on the thread or on when other tiles are computed, so that every number of threads gives
//! the same bits. Where tiles exchange what they have found, in [`adaptive`] and [`stochastic`], the choice of what is traced
//! together does not depend on the thread that traces it.

use super::by_class::ByClass;
use super::context::Context;
use super::frame::{Frame, resolve_each, veil_each};
use super::layers::{self, FirstSurface, LayerPixel};
use super::observer::Observer;
use super::sample_offsets::sample_offsets;
use super::sampling::{Sampled, Sampling};
use super::view::View;
use super::whitted::{Sample, Tracer};
use super::{Progress, Settings, adaptive, stochastic};
use crate::accel::Accel;
use crate::image::{Channel, Layers, Picture, Values};
use crate::stopwatch::{Spent, Stopwatch};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Columns and rows of a tile.
pub(super) const TILE: u32 = 32;

/// Columns and rows of a block of pixels, whose rays are adjacent in their batch.
pub(super) const BLOCK: u32 = 4;

/// Most samples traced together: few enough that they and their rays stay in a core's own cache.
pub(super) const TOGETHER: usize = 1 << 11;

/// A part of the picture: pixels `x0..x1` of rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

/// Result of a tile, in the order of its places.
pub(super) struct TilePixels {
    pub tile: Tile,
    pub beauty: Vec<[f32; 4]>,
    /// Background seen through coloured glass, where the frame has any.
    pub veil: Vec<[f32; 4]>,
    pub layers: Vec<LayerPixel>,
    /// Empty where every pixel has the same number of samples.
    pub facts: Vec<PixelFacts>,
    /// Number of primary rays.
    pub rays: u64,
    /// Of these, the ones through pixels around the tile.
    pub rays_around: u64,
    /// Of these, first samples of border pixels that are charged to this tile only because it is rendered without its neighbours.
    pub rays_beyond: u64,
}

/// Result of the sampling of a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelFacts {
    /// Number of eye rays.
    pub count: u32,
    /// Eye rays that were not needed, as far as the pixel's estimates show.
    pub spare: u32,
    /// Standard error, if it was estimated.
    pub error: f32,
    pub convergence: Convergence,
}

impl PixelFacts {
    /// Adds to the error by how much the mean is too dark, as it is written, for want of a sample that has met some light.
    pub(super) fn miss(&mut self, missed: f32) {
        if missed > 0.0 {
            self.error = (self.error * self.error + missed * missed).sqrt();
        }
    }
}

/// Outcome of the estimate of whether a pixel needs more samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Convergence {
    /// No estimate was made.
    Unknown,
    /// The mean is certain.
    Converged,
    /// The mean is not certain: the pixel goes on, or had the most samples allowed.
    Open,
}

/// Renders a tile with the sampling that was chosen; `None` when cancelled.
fn render_tile<A: Accel, P: Observer>(frame: &Frame, tracer: &mut Tracer<A, P>, tile: Tile) -> Option<TilePixels> {
    match &frame.settings.sampling {
        Sampling::Uniform => frame.render(tracer, tile),
        Sampling::Adaptive(how) => adaptive::render(frame, how, tracer, tile),
        Sampling::Stochastic(how) => stochastic::render(frame, how, tracer, tile),
    }
}

/// A tile that was rendered by itself.
pub(super) struct Alone<P> {
    pub pixels: TilePixels,
    /// Processor time spent; wall-clock time if no processor time was measured.
    pub spent: Duration,
    pub counts: ByClass<P>,
}

/// Renders each of these tiles by itself; the results are in any order. Also returns whether all were finished.
pub(super) fn render_some<A: Accel, P: Observer>(
    context: &Context,
    accel: &A,
    view: &View,
    settings: &Settings,
    progress: &dyn Progress,
    tiles: &[Tile],
) -> (Vec<Alone<P>>, bool) {
    let frame = Frame::new(context, accel, view, settings);
    let work = |tracer: &mut Tracer<A, P>, &tile: &Tile| {
        let watch = Stopwatch::of_this_thread();
        let pixels = render_tile(&frame, tracer, tile)?;
        let Spent { cpu, wall } = watch.read();
        let spent = if cpu.is_zero() { wall } else { cpu };
        Some(Alone { pixels, spent, counts: std::mem::take(&mut tracer.counts) })
    };
    let TracedTiles { finished, complete, .. } = each_tile(context, accel, tiles, progress, work);
    (finished, complete)
}

/// A picture, rendered from its tiles.
pub(crate) struct RenderedTiles<P> {
    pub picture: Picture,
    pub sampled: Sampled,
    /// Counts of each thread.
    pub counts: Vec<ByClass<P>>,
    /// Whether every tile was finished, that is, the user did not cancel.
    pub complete: bool,
}

/// Renders all tiles.
pub(crate) fn render_tiles<A: Accel, P: Observer>(
    context: &Context,
    accel: &A,
    view: &View,
    settings: &Settings,
    progress: &dyn Progress,
) -> RenderedTiles<P> {
    let frame = Frame::new(context, accel, view, settings);
    let whole = Mutex::new(Whole::new(settings, frame.has_veil));
    let keep = |pixels: TilePixels| whole.lock().unwrap_or_else(PoisonError::into_inner).keep(&pixels);
    let tiles = tiles(settings.width, settings.height);
    let (counts, complete) = match &settings.sampling {
        Sampling::Uniform => {
            let work = |tracer: &mut Tracer<A, P>, &tile: &Tile| frame.render(tracer, tile).map(keep);
            let TracedTiles { counts, complete, .. } = each_tile(context, accel, &tiles, progress, work);
            (counts, complete)
        }
        Sampling::Adaptive(how) => adaptive::render_all(&frame, how, context, accel, progress, &tiles, &keep),
        Sampling::Stochastic(how) => stochastic::render_all(&frame, how, context, accel, progress, &tiles, &keep),
    };
    let Whole { mut picture, sampled } = whole.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(layers) = &mut picture.layers {
        add_channels(&sampled, layers);
    }
    RenderedTiles { picture, sampled, counts, complete }
}

/// The picture as far as it is finished, and the sampling of its pixels; unfinished ones have no rays.
struct Whole {
    picture: Picture,
    sampled: Sampled,
}

impl Whole {
    /// A picture without a finished pixel.
    fn new(settings: &Settings, has_veil: bool) -> Self {
        let pixels = settings.width as usize * settings.height as usize;
        let mut sampled = Sampled { pixels: pixels as u64, ..Sampled::default() };
        if settings.sampling != Sampling::Uniform {
            sampled.counts = vec![0; pixels];
        }
        if matches!(settings.sampling, Sampling::Stochastic(_)) {
            sampled.errors = vec![0.0; pixels];
        }
        let veil = vec![[0.0; 4]; if has_veil { pixels } else { 0 }];
        Self { picture: Picture { veil, ..empty_picture(settings) }, sampled }
    }

    fn keep(&mut self, pixels: &TilePixels) {
        let Self { picture, sampled } = self;
        let (width, mut from) = (picture.width as usize, 0);
        sampled.count(pixels);
        for block in pixels.tile.blocks() {
            let count = (block.x1 - block.x0) as usize;
            for y in block.y0..block.y1 {
                let start = y as usize * width + block.x0 as usize;
                let (to, own) = (start..start + count, from..from + count);
                put_row(&mut picture.beauty[to.clone()], &pixels.beauty[own.clone()], |&color| color);
                if let Some(veil) = picture.veil.get_mut(to.clone()) {
                    put_row(veil, &pixels.veil[own.clone()], |&veil| veil);
                }
                if let Some(facts) = pixels.facts.get(own.clone()) {
                    put_row(&mut sampled.counts[to.clone()], facts, |facts| facts.count);
                    sampled.errors.get_mut(to).into_iter().for_each(|to| put_row(to, facts, |facts| facts.error));
                }
                if let Some(layers) = &mut picture.layers {
                    (start..).zip(&pixels.layers[own]).for_each(|(i, pixel)| pixel.store(layers, i));
                }
                from += count;
            }
        }
    }
}

impl Sampled {
    /// Adds the rays of a tile, and counts its pixels by their end.
    fn count(&mut self, pixels: &TilePixels) {
        self.rays += pixels.rays;
        for facts in &pixels.facts {
            self.met += u64::from(facts.convergence == Convergence::Converged);
            self.at_most += u64::from(facts.convergence == Convergence::Open);
            self.spare += u64::from(facts.spare);
        }
    }
}

/// Stores a value of each pixel of a row of a block in its place; full rows need no loop.
#[inline(always)]
pub(super) fn put_row<F, T>(to: &mut [T], from: &[F], of: impl Fn(&F) -> T) {
    const SIDE: usize = BLOCK as usize;
    if let (Ok(to), Ok(from)) = (<&mut [T; SIDE]>::try_from(&mut *to), <&[F; SIDE]>::try_from(from)) {
        *to = from.each_ref().map(of);
    } else {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = of(from));
    }
}

/// Adds what is known of the sampling of each pixel as channels of the layers.
pub(super) fn add_channels(sampled: &Sampled, layers: &mut Layers) {
    let mut add = |name: &str, values: Values| {
        if !values.is_empty() {
            layers.channels.push(Channel { name: name.into(), values });
        }
    };
    add("sampling.error", Values::F32(sampled.errors.clone()));
    add("sampling.count", Values::U32(sampled.counts.clone()));
}

/// Traces every tile, `together` pixels in a batch, and gathers what `cost` computes from the observers of each batch: one value
/// for each pixel, row by row. `None` when cancelled.
pub(crate) fn cost_tiles<A: Accel, P: Observer, T: Copy + Default + Send>(
    context: &Context,
    accel: &A,
    view: &View,
    settings: &Settings,
    progress: &dyn Progress,
    together: Together,
    cost: impl Fn(&mut ByClass<P>, usize) -> Vec<T> + Sync,
) -> Option<Vec<T>> {
    let frame = Frame::new(context, accel, view, settings);
    let samples = frame.offsets.len();
    let pixels = match together {
        Together::Wave => batch_pixels(samples),
        Together::Pixel => 1,
    };
    let work = |tracer: &mut Tracer<A, P>, &tile: &Tile| {
        let mut costs = Vec::new();
        let each = |tracer: &mut Tracer<A, P>| costs.extend(cost(&mut tracer.counts, samples));
        frame.trace(tracer, tile, pixels, each).map(|()| (tile, costs))
    };
    let tiles = tiles(settings.width, settings.height);
    let TracedTiles { finished, complete, .. } = each_tile(context, accel, &tiles, progress, work);
    let mut all = vec![T::default(); settings.width as usize * settings.height as usize];
    for (tile, costs) in finished {
        for ((x, y), cost) in tile.places().zip(costs) {
            all[y as usize * settings.width as usize + x as usize] = cost;
        }
    }
    complete.then_some(all)
}

/// Traces one sample (from 0) of one pixel; `None` if there is no such pixel or sample.
pub(crate) fn trace_sample<A: Accel, P: Observer>(
    context: &Context,
    accel: &A,
    view: &View,
    settings: &Settings,
    (x, y): (u32, u32),
    sample: u32,
) -> Option<(Sample, ByClass<P>)> {
    let frame = Frame::new(context, accel, view, settings);
    if x >= settings.width || y >= settings.height {
        return None;
    }
    let place = frame.places((x, y)).nth(sample as usize)?;
    let mut tracer = Tracer::<A, P>::new(context, accel, &());
    tracer.reset(1, false, &frame.media);
    let (ray, path) = frame.eye(tracer.center()).ray_with_path(place, tracer.primary_rays.media);
    tracer.start(ray, path);
    tracer.trace().then(|| (tracer.samples[0], tracer.counts))
}

/// How many pixels are traced together.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Together {
    /// As many as fit into a wave, as in a rendering.
    Wave,
    /// One pixel at a time.
    Pixel,
}

/// Results of the tiles, or other pieces of work, that were traced.
pub(super) struct TracedTiles<T, P> {
    pub finished: Vec<T>,
    /// Counts of each thread.
    pub counts: Vec<ByClass<P>>,
    /// Whether all pieces were finished.
    pub complete: bool,
}

/// Distributes all pieces of work, such as tiles, over the threads, which take them in order.
pub(super) fn each_tile<A: Accel, P: Observer, W: Sync, T: Send>(
    context: &Context,
    accel: &A,
    all: &[W],
    progress: &dyn Progress,
    work: impl Fn(&mut Tracer<A, P>, &W) -> Option<T> + Sync,
) -> TracedTiles<T, P> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let take = |_: rayon::BroadcastContext| {
        let mut tracer = Tracer::<A, P>::new(context, accel, progress);
        let mut finished = Vec::new();
        while let Some(one) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
            let Some(result) = work(&mut tracer, one) else { break };
            finished.push(result);
            progress.tiles(done.fetch_add(1, Ordering::Relaxed) + 1, all.len());
        }
        (finished, tracer.counts)
    };
    let (finished, counts): (Vec<_>, Vec<_>) = rayon::broadcast(take).into_iter().unzip();
    let finished: Vec<T> = finished.into_iter().flatten().collect();
    let complete = finished.len() == all.len();
    TracedTiles { finished, counts, complete }
}

/// Most pixels whose samples are traced together.
fn batch_pixels(samples: usize) -> usize {
    (TOGETHER / samples).max(1)
}

/// The pixel (row by row, from 0) of each sample of each batch, in the order in which a single thread renders them.
pub(crate) fn batches(settings: &Settings) -> Vec<Vec<u32>> {
    let samples = sample_offsets(settings.samples).len();
    let mut batches = Vec::new();
    for tile in tiles(settings.width, settings.height) {
        let places: Vec<u32> = tile.places().map(|(x, y)| y * settings.width + x).collect();
        let repeat = |run: &[u32]| run.iter().flat_map(|&pixel| std::iter::repeat_n(pixel, samples)).collect();
        batches.extend(places.chunks(batch_pixels(samples)).map(repeat));
    }
    batches
}

/// The tiles of a picture, row by row.
pub(super) fn tiles(width: u32, height: u32) -> Vec<Tile> {
    let starts = |end: u32| (0..end).step_by(TILE as usize);
    let tile = |x0: u32, y0: u32| Tile {
        x0,
        y0,
        x1: x0.saturating_add(TILE).min(width),
        y1: y0.saturating_add(TILE).min(height),
    };
    starts(height).flat_map(|y0| starts(width).map(move |x0| tile(x0, y0))).collect()
}

fn empty_picture(settings: &Settings) -> Picture {
    let pixels = settings.width as usize * settings.height as usize;
    Picture {
        width: settings.width,
        height: settings.height,
        beauty: vec![[0.0; 4]; pixels],
        layers: settings.layers.then(|| layers::empty(pixels)),
        veil: Vec::new(),
    }
}

impl Tile {
    /// Pixels of the tile, block by block and row by row in each, so that consecutive rays are coherent.
    pub(super) fn places(self) -> impl Iterator<Item = (u32, u32)> {
        self.blocks().flat_map(|Self { x0, y0, x1, y1 }| (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (x, y))))
    }

    /// Blocks of the tile, whose pixels follow each other in the order of [`Self::places`].
    pub(super) fn blocks(self) -> impl Iterator<Item = Self> {
        let starts = |from: u32, to: u32| (from..to).step_by(BLOCK as usize);
        starts(self.y0, self.y1).flat_map(move |y0| {
            let y1 = (y0 + BLOCK).min(self.y1);
            starts(self.x0, self.x1).map(move |x0| Self { x0, y0, x1: (x0 + BLOCK).min(self.x1), y1 })
        })
    }

    /// Adds the columns and rows of the tile's pixels, in the order of [`Self::places`].
    pub(super) fn list(self, (x, y): (&mut Vec<u32>, &mut Vec<u32>)) {
        for block in self.blocks() {
            // Full blocks need no loop.
            if block.pixels() == (BLOCK * BLOCK) as usize {
                x.extend_from_slice(&std::array::from_fn::<_, { (BLOCK * BLOCK) as usize }, _>(|i| {
                    block.x0 + i as u32 % BLOCK
                }));
                y.extend_from_slice(&std::array::from_fn::<_, { (BLOCK * BLOCK) as usize }, _>(|i| {
                    block.y0 + i as u32 / BLOCK
                }));
            } else {
                block.places().for_each(|(column, row)| {
                    x.push(column);
                    y.push(row);
                });
            }
        }
    }

    /// Index of a pixel of the tile in the order of [`Self::places`].
    pub(super) fn number(self, (x, y): (u32, u32)) -> usize {
        let (across, down) = ((x - self.x0) / BLOCK * BLOCK, (y - self.y0) / BLOCK * BLOCK);
        let rows = (self.y1 - self.y0 - down).min(BLOCK);
        let columns = (self.x1 - self.x0 - across).min(BLOCK);
        let before = down * (self.x1 - self.x0) + rows * across;
        (before + (y - self.y0 - down) * columns + (x - self.x0 - across)) as usize
    }

    /// Parts of the tile around an inner tile: above, below, left and right of it.
    pub(super) fn without(self, inner: Self) -> impl Iterator<Item = Self> + Clone {
        let parts = [
            Self { y1: inner.y0, ..self },
            Self { y0: inner.y1, ..self },
            Self { x1: inner.x0, ..Self { x0: self.x0, ..inner } },
            Self { x0: inner.x1, ..Self { x1: self.x1, ..inner } },
        ];
        parts.into_iter().filter(|part| part.pixels() > 0)
    }

    /// Nine parts of a full tile, row by row: the corners, a block wide and high, the sides between them and the middle. Empty
    /// parts of a smaller tile are left out.
    pub(super) fn zones(self) -> impl Iterator<Item = Self> {
        let parts = |from: u32, to: u32| {
            let cuts = [from, from + BLOCK, from + TILE - BLOCK, from + TILE].map(|cut| cut.min(to));
            (0..3).map(move |part| (cuts[part], cuts[part + 1]))
        };
        let rows = parts(self.y0, self.y1);
        let all = rows.flat_map(move |(y0, y1)| parts(self.x0, self.x1).map(move |(x0, x1)| Self { x0, y0, x1, y1 }));
        all.filter(|zone| zone.pixels() > 0)
    }

    /// Whether the tiles share a pixel.
    pub(super) fn meets(self, other: Self) -> bool {
        self.x0.max(other.x0) < self.x1.min(other.x1) && self.y0.max(other.y0) < self.y1.min(other.y1)
    }

    /// Intersection with another tile; the two must share a pixel.
    pub(super) fn within(self, other: Self) -> Self {
        Self {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        }
    }

    /// Number of pixels.
    pub(super) fn pixels(self) -> usize {
        (self.x1 - self.x0) as usize * (self.y1 - self.y0) as usize
    }

    pub(super) fn contains(self, (x, y): (u32, u32)) -> bool {
        (self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y)
    }

    /// The tile and the pixels around it, clipped to a picture of this size.
    pub(super) fn grown(self, width: u32, height: u32) -> Self {
        Self {
            x0: self.x0.saturating_sub(1),
            y0: self.y0.saturating_sub(1),
            x1: (self.x1 + 1).min(width),
            y1: (self.y1 + 1).min(height),
        }
    }
}

impl TilePixels {
    /// A tile without results.
    pub(super) fn empty(tile: Tile) -> Self {
        Self {
            tile,
            beauty: Vec::new(),
            veil: Vec::new(),
            layers: Vec::new(),
            facts: Vec::new(),
            rays: 0,
            rays_around: 0,
            rays_beyond: 0,
        }
    }
}

impl Frame<'_> {
    /// Renders a tile; `None` when cancelled.
    fn render<A: Accel, P: Observer>(&self, tracer: &mut Tracer<A, P>, tile: Tile) -> Option<TilePixels> {
        let mut done = TilePixels::empty(tile);
        let per_pixel = self.offsets.len();
        self.trace(tracer, tile, batch_pixels(per_pixel), |tracer| {
            resolve_each(&tracer.samples, per_pixel, self.background, &mut done.beauty);
            if self.has_veil {
                veil_each(&tracer.samples, per_pixel, self.background, &mut done.veil);
            }
            let layer = |f: &[FirstSurface]| LayerPixel::new(f, self.view.eye, self.view.forward);
            done.layers.extend(tracer.firsts.chunks(per_pixel).map(layer));
        })?;
        done.rays = (done.beauty.len() * per_pixel) as u64;
        Some(done)
    }

    /// Traces a tile, all samples of `pixels` pixels in a batch, and calls `each` after each batch; `None` when cancelled.
    fn trace<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        tile: Tile,
        pixels: usize,
        mut each: impl FnMut(&mut Tracer<A, P>),
    ) -> Option<()> {
        let mut places = Vec::with_capacity(tile.pixels());
        // Nested iterators are fast with internal iteration, and slow item by item.
        tile.places().for_each(|at| places.push(at));
        for places in places.chunks(pixels) {
            tracer.reset(places.len() * self.offsets.len(), self.settings.layers, &self.media);
            let eye = self.eye(tracer.center());
            if self.settings.lens.is_some() {
                tracer.primary_rays.send(&eye, places.iter().flat_map(|&at| self.places(at)));
            } else {
                tracer.primary_rays.send_each(&eye, places, &self.offsets);
            }
            if !tracer.trace() {
                return None;
            }
            each(tracer);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_blocks_and_numbers_of_a_tile_are_in_one_order() {
        for (x0, y0, x1, y1) in [(0, 0, 32, 32), (32, 64, 37, 71), (5, 3, 6, 9), (30, 30, 66, 66)] {
            let tile = Tile { x0, y0, x1, y1 };
            let places: Vec<(u32, u32)> = tile.places().collect();
            assert_eq!(places.len(), tile.pixels());
            assert!(places.iter().enumerate().all(|(i, &at)| tile.number(at) == i), "{tile:?}");
            assert!(tile.blocks().flat_map(Tile::places).eq(places.iter().copied()), "{tile:?}");
            let (mut x, mut y) = (Vec::new(), Vec::new());
            tile.list((&mut x, &mut y));
            assert!(x.into_iter().zip(y).eq(places), "{tile:?}");
        }
    }

    #[test]
    fn around_a_tile_is_every_pixel_that_is_not_in_it_and_none_twice() {
        let outer = Tile { x0: 3, y0: 5, x1: 13, y1: 12 };
        for (x0, y0, x1, y1) in [(5, 7, 11, 10), (3, 5, 9, 12), (3, 6, 13, 12), (3, 5, 13, 12)] {
            let inner = Tile { x0, y0, x1, y1 };
            let mut around: Vec<(u32, u32)> = outer.without(inner).flat_map(Tile::places).collect();
            around.sort_unstable();
            let mut expected: Vec<(u32, u32)> = outer.places().filter(|&at| !inner.contains(at)).collect();
            expected.sort_unstable();
            assert_eq!(around, expected, "{inner:?}");
        }
    }
}
