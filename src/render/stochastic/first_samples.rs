//! The first sample of every pixel and what it shows, in columns, since most pixels need no more.

use super::Sampler;
use super::neighborhood::Neighborhood;
use super::pixel::Pixel;
use super::sample_batch::SampleBatch;
use crate::accel::Accel;
use crate::render::ahead::OfPixel;
use crate::render::certainty::{Pixels, Shown};
use crate::render::fireflies::Fireflies;
use crate::render::frame::Frame;
use crate::render::layers::{FirstSurface, LayerPixel};
use crate::render::observer::Observer;
use crate::render::tile::{BLOCK, TOGETHER, Tile, TilePixels};
use crate::render::whitted::{Sample, Tracer};

/// One sample of every pixel of some parts of the picture: part after part, each in the order of its places.
pub(super) struct FirstSamples {
    /// The parts, each with the index of its first pixel.
    parts: Vec<(Tile, usize)>,
    samples: Vec<Sample>,
    /// Whether rays of each sample were spread at random; empty where none can be.
    by_chance: Vec<bool>,
    /// First surfaces for the layers; empty unless layers are wanted.
    firsts: Vec<FirstSurface>,
    /// The pixels that these samples make.
    pixels: Pixels,
    shown: Shown,
}

impl Sampler<'_> {
    /// Traces the first sample of every pixel of these tiles, all together; `None` when cancelled.
    pub(super) fn trace_first<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        tiles: impl Iterator<Item = Tile> + Clone,
    ) -> Option<FirstSamples> {
        let count = tiles.clone().map(Tile::pixels).sum();
        let (mut columns, mut rows) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut parts = Vec::new();
        for tile in tiles {
            parts.push((tile, columns.len()));
            tile.list((&mut columns, &mut rows));
        }
        let (mut samples, mut by_chance, mut firsts) = (Vec::with_capacity(count), Vec::new(), Vec::new());
        let mut batch = SampleBatch::default();
        if let Some(ahead) = self.ahead {
            for at in columns.iter().copied().zip(rows.iter().copied()) {
                let OfPixel { samples: own, by_chance: spread, firsts: surfaces } = ahead.of(at, 0..1);
                samples.extend_from_slice(own);
                by_chance.extend_from_slice(spread);
                firsts.extend_from_slice(surfaces);
            }
        } else {
            for (columns, rows) in columns.chunks(TOGETHER).zip(rows.chunks(TOGETHER)) {
                batch.trace_each(self.frame, self.how, tracer, 0, columns, rows)?;
                samples.extend_from_slice(&tracer.samples);
                by_chance.extend_from_slice(&tracer.by_chance);
                firsts.extend_from_slice(&tracer.firsts);
            }
        }
        let (shown, pixels) = self.judge.see_samples(&samples);
        Some(FirstSamples { parts, samples, by_chance, firsts, pixels, shown })
    }
}

impl FirstSamples {
    /// Passes to `tell` the pixels of a tile, as far as they are among these, whose rays were spread at random.
    pub(super) fn each_by_chance(&self, tile: Tile, mut tell: impl FnMut((u32, u32))) {
        let parts = self.parts.iter().filter(|(part, _)| !self.by_chance.is_empty() && part.meets(tile));
        for &(part, start) in parts {
            let each = part.places().zip(&self.by_chance[start..]).filter(|&(at, _)| tile.contains(at));
            each.filter(|&(_, &by_chance)| by_chance).for_each(|(at, _)| tell(at));
        }
    }

    /// Gives a pixel its first sample, if the pixel is among these.
    pub(super) fn give(&self, pixel: &mut Pixel, fireflies: Option<&Fireflies>) {
        let Some(&(part, start)) = self.parts.iter().find(|(part, _)| part.contains(pixel.at)) else { return };
        let own = start + part.number(pixel.at);
        pixel.expect_fireflies(fireflies, self.by_chance.get(own..=own).unwrap_or_default());
        pixel.take(&self.samples[own..=own], self.firsts.get(own..=own).unwrap_or_default(), 1);
    }

    /// Copies what these samples show of a tile and its surroundings.
    pub(super) fn show(&self, around: &mut Neighborhood) {
        let (inner, columns) = (around.tile, around.columns());
        for &(part, mut from) in self.parts.iter().filter(|(part, _)| part.meets(inner)) {
            for block in part.blocks() {
                if block.meets(inner) {
                    let seen = block.within(inner);
                    let first = from + block.number((seen.x0, seen.y0));
                    let step = (block.x1 - block.x0) as usize;
                    let to = around.at((seen.x0, seen.y0));
                    let size = [seen.x1 - seen.x0, seen.y1 - seen.y0].map(|side| side as usize);
                    for (to_column, column) in around.shown.columns_mut().into_iter().zip(self.shown.columns()) {
                        copy((&mut to_column[to..], columns), (&column[first..], step), size);
                    }
                }
                from += block.pixels();
            }
        }
    }

    /// Stores the pixels of a tile, as they are with one sample.
    pub(super) fn put(&self, frame: &Frame, done: &mut TilePixels) {
        let tile = done.tile;
        for &(part, mut from) in self.parts.iter().filter(|(part, _)| tile.contains((part.x0, part.y0))) {
            // The blocks of a part are blocks of its tile.
            for block in part.blocks() {
                let (to, count) = (tile.number((block.x0, block.y0)), block.pixels());
                done.beauty[to..to + count].copy_from_slice(&self.pixels.beauty[from..from + count]);
                if let Some(veil) = done.veil.get_mut(to..to + count) {
                    veil.copy_from_slice(&self.pixels.veil[from..from + count]);
                }
                let firsts = self.firsts.iter().skip(from).take(count);
                for (layers, first) in done.layers.iter_mut().skip(to).zip(firsts) {
                    *layers = LayerPixel::new(std::slice::from_ref(first), frame.view.eye, frame.view.forward);
                }
                from += count;
            }
        }
    }
}

/// Copies a rectangle of a block's values between arrays with these row strides.
#[inline(always)]
fn copy((to, to_step): (&mut [f32], usize), (from, from_step): (&[f32], usize), [width, height]: [usize; 2]) {
    /// Side of a whole block, and width of one at the border of a tile's surroundings.
    const SIDE: usize = BLOCK as usize;
    const HALF: usize = SIDE / 2;
    // The usual sizes are inlined.
    match (width, from_step, height) {
        (SIDE, SIDE, SIDE) => copy_rows::<SIDE>((to, to_step), (from, SIDE), SIDE),
        (SIDE, ..) => copy_rows::<SIDE>((to, to_step), (from, from_step), height),
        (HALF, ..) => copy_rows::<HALF>((to, to_step), (from, from_step), height),
        _ => (0..height).for_each(|row| {
            to[row * to_step..][..width].copy_from_slice(&from[row * from_step..][..width]);
        }),
    }
}

/// Copies rows of a constant width.
#[inline(always)]
fn copy_rows<const WIDTH: usize>(
    (to, to_step): (&mut [f32], usize),
    (from, from_step): (&[f32], usize),
    height: usize,
) {
    for row in 0..height {
        to[row * to_step..][..WIDTH].copy_from_slice(&from[row * from_step..][..WIDTH]);
    }
}
