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
    /// In the order of the tile's places, as all of this.
    pub samples: Vec<Sample>,
    /// What layers are made of; empty unless they are wanted.
    pub facts: Vec<Facts>,
    shown: Shown,
}

impl Sampler<'_> {
    /// Traces the first sample of every pixel of these tiles, all together; `None` when cancelled.
    pub(super) fn first<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        tiles: impl Iterator<Item = Tile> + Clone,
    ) -> Option<Vec<First>> {
        let count = tiles.clone().map(Tile::pixels).sum();
        let (mut pixels, mut keys) = (Vec::with_capacity(count), Vec::with_capacity(count));
        tiles.clone().for_each(|tile| tile.places().for_each(|at| pixels.push(at)));
        pixel_keys(self.frame.settings.seed, &pixels, &mut keys);
        let (mut samples, mut facts) = (Vec::with_capacity(count), Vec::new());
        let mut places = Places::default();
        for (pixels, keys) in pixels.chunks(TOGETHER).zip(keys.chunks(TOGETHER)) {
            let wanted = pixels.iter().zip(keys).map(|(&pixel, &key)| Wanted { pixel, key, index: 0 });
            places.trace(self.frame, self.how, tracer, (wanted, pixels.len()))?;
            samples.extend_from_slice(&tracer.samples);
            facts.extend_from_slice(&tracer.facts);
        }
        let mut end = 0;
        let each = tiles.map(|tile| {
            let own = end..end + tile.pixels();
            end = own.end;
            let (samples, facts) = (samples[own.clone()].to_vec(), facts.get(own).unwrap_or_default().to_vec());
            First { tile, shown: self.judge.see_samples(&samples), samples, facts }
        });
        Some(each.collect())
    }
}

impl First {
    /// Copies what it shows of what lies around a tile.
    pub(super) fn show(&self, around: &mut Around) {
        let (left, right) = (around.tile.x0, around.tile.x1);
        let mut from = 0;
        self.tile.runs().for_each(|((x, y), count)| {
            let (start, end) = (x.max(left), (x + count as u32).min(right));
            if start < end && around.tile.contains((start, y)) {
                let at = around.at((start, y));
                around.shown.copy(at..at + (end - start) as usize, &self.shown, from + (start - x) as usize);
            }
            from += count;
        });
    }
}
