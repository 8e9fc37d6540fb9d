//! The first sample of every pixel, and what it shows: in columns, since most pixels need no more.

use super::Sampler;
use super::around::Around;
use super::places::{Places, Wanted};
use crate::accel::Accel;
use crate::render::certainty::Shown;
use crate::render::frame::pixel_keys;
use crate::render::layers::Facts;
use crate::render::observer::Observer;
use crate::render::tile::{TOGETHER, Tile};
use crate::render::whitted::{Sample, Tracer};

/// One sample of every pixel of a part of the picture.
pub(super) struct First {
    pub tile: Tile,
    /// In the order of the tile's places.
    pub samples: Vec<Sample>,
    /// The same of what layers are made of; empty unless they are wanted.
    pub facts: Vec<Facts>,
    /// Row by row.
    shown: Shown,
}

impl Sampler<'_> {
    /// Traces the first sample of every pixel of these tiles, all together; `None` when cancelled.
    pub(super) fn first<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        tiles: impl Iterator<Item = Tile> + Clone,
    ) -> Option<Vec<First>> {
        let (mut pixels, mut keys) = (Vec::new(), Vec::new());
        tiles.clone().for_each(|tile| tile.places().for_each(|at| pixels.push(at)));
        pixel_keys(self.frame.settings.seed, &pixels, &mut keys);
        let (mut samples, mut facts) = (Vec::with_capacity(pixels.len()), Vec::new());
        let mut places = Places::default();
        for (pixels, keys) in pixels.chunks(TOGETHER).zip(keys.chunks(TOGETHER)) {
            let wanted = pixels.iter().zip(keys).map(|(&pixel, &key)| Wanted { pixel, key, index: 0 });
            places.trace(self.frame, self.how, tracer, (wanted, pixels.len()))?;
            samples.extend_from_slice(&tracer.samples);
            facts.extend_from_slice(&tracer.facts);
        }
        let (mut samples, mut facts) = (samples.into_iter(), facts.into_iter());
        let each = tiles.map(|tile| {
            let samples: Vec<Sample> = samples.by_ref().take(tile.pixels()).collect();
            let mut in_places = Shown::default();
            self.judge.see_samples(&samples, &mut in_places);
            let mut shown = Shown::nothing(tile.pixels());
            let mut from = 0;
            for ((x, y), count) in tile.runs() {
                let to = ((y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0) as usize;
                shown.copy(to..to + count, &in_places, from);
                from += count;
            }
            First { tile, samples, facts: facts.by_ref().take(tile.pixels()).collect(), shown }
        });
        Some(each.collect())
    }
}

impl First {
    /// Copies what it shows of what lies around a tile.
    pub(super) fn show(&self, around: &mut Around) {
        let (own, to) = (self.tile, around.tile);
        let columns = own.x0.max(to.x0)..own.x1.min(to.x1);
        for y in own.y0.max(to.y0)..own.y1.min(to.y1) {
            let start = around.at((columns.start, y));
            let from = (y - own.y0) * (own.x1 - own.x0) + columns.start - own.x0;
            around.shown.copy(start..start + columns.len(), &self.shown, from as usize);
        }
    }
}
