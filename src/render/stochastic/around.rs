//! What the pixels beside a pixel tell about it.
//!
//! Most of a picture is so even that few samples of a pixel do. That these are enough is told by those of the eight pixels
//! beside it: all must agree. What is thinner than a pixel, a wire or the stroke of a letter, shows in some of the pixels that
//! it crosses and not in others; so wherever a pixel that was looked at closer turns out to be uneven, all near it are
//! looked at as closely, and those near them if they are uneven, too ([`Around::reopen`]).

use super::pixel::Pixel;
use crate::render::certainty::{Certainty, GROUPS, Range, Seen};
use crate::render::tile::{End, Tile};

/// How many columns and rows from a pixel others are looked at as closely: from one on an edge, and from one with something
/// thin, of which the next pixels may well show nothing.
const REACH: [usize; 2] = [1, 4];

/// What the first samples of a tile and of the pixels around it show.
pub(super) struct Around {
    tile: Tile,
    /// Row by row, with a place on every side where there is nothing.
    seen: Vec<Seen>,
    /// The pixels' numbers, likewise; where there is nothing, one that no pixel has.
    numbers: Vec<usize>,
}

impl Around {
    /// Nothing yet of these pixels, which are all of `tile`.
    pub(super) fn new(tile: Tile, pixels: &[Pixel]) -> Self {
        let places = (tile.x1 - tile.x0 + 2) as usize * (tile.y1 - tile.y0 + 2) as usize;
        let mut around = Self { tile, seen: vec![Seen::NOTHING; places], numbers: vec![usize::MAX; places] };
        for (number, pixel) in pixels.iter().enumerate() {
            let at = around.at(pixel);
            around.numbers[at] = number;
        }
        around
    }

    fn columns(&self) -> usize {
        (self.tile.x1 - self.tile.x0 + 2) as usize
    }

    /// The place of a pixel.
    fn at(&self, pixel: &Pixel) -> usize {
        (pixel.y - self.tile.y0 + 1) as usize * self.columns() + (pixel.x - self.tile.x0 + 1) as usize
    }

    /// Where the three rows of three begin that have a place in their middle.
    fn rows(&self, at: usize) -> [usize; 3] {
        [at - self.columns() - 1, at - 1, at + self.columns() - 1]
    }

    /// What is seen at a place and beside it.
    #[inline(always)]
    fn near(&self, at: usize) -> impl Iterator<Item = &Seen> + Clone {
        self.rows(at).into_iter().flat_map(|start| &self.seen[start..start + 3])
    }

    /// Looks at the samples of these pixels, of which each has as many, up to as many as there are groups.
    pub(super) fn see(&mut self, judge: &Certainty, pixels: &[Pixel], some: &[usize]) {
        let mut each = some.iter();
        judge.see_each(some.iter().map(|&i| pixels[i].taken()), |seen| {
            let at = each.next().map_or(0, |&i| self.at(&pixels[i]));
            self.seen[at] = *seen;
        });
    }

    /// The numbers at all places that are at most so many columns and rows from one.
    fn numbers_within(&self, reach: usize, at: usize) -> impl Iterator<Item = &usize> {
        let (columns, middle, row) = (self.columns(), at % self.columns(), at / self.columns());
        let across = middle.saturating_sub(reach)..(middle + reach + 1).min(columns);
        let rows = self.numbers.chunks(columns).skip(row.saturating_sub(reach)).take(row.min(reach) + 1 + reach);
        rows.flat_map(move |row| &row[across.clone()])
    }

    /// The pixels that were done with `samples` samples and lie near uneven ones of these; they are not done any more.
    pub(super) fn reopen(&self, judge: &Certainty, pixels: &mut [Pixel], some: &[usize], samples: u32) -> Vec<usize> {
        let mut reopened = Vec::new();
        for &pixel in some {
            let at = self.at(&pixels[pixel]);
            if judge.agree(&self.seen[at].range) {
                continue;
            }
            let is_thin = judge.is_thin(&self.seen[at].range, self.near(at));
            let reach = REACH[usize::from(is_thin)];
            for &number in self.numbers_within(reach, at) {
                let Some(pixel) = pixels.get_mut(number) else { continue };
                if pixel.facts.end == End::Met && pixel.facts.count == samples {
                    pixel.facts.end = End::Ceiling;
                    reopened.push(number);
                }
            }
        }
        reopened
    }

    /// Finds the pixels of these that are done: their samples and those of the pixels beside them agree each among
    /// themselves, and both are of the same colours. Of the others it finds the contrast around them.
    pub(super) fn judge(&self, judge: &Certainty, pixels: &mut [Pixel], some: &[usize]) {
        for &i in some {
            let pixel = &mut pixels[i];
            let at = self.at(pixel);
            let (own, samples) = (&self.seen[at], pixel.facts.count);
            // Nearly all are calm, so that all are asked without asking whether one was not.
            let is_calm = |calm: bool, seen: &Seen| {
                calm & judge.agree(&seen.range) & !judge.differ(own.color, seen.color, samples)
            };
            let is_done = samples < GROUPS as u32 && self.near(at).fold(true, is_calm);
            let range = || self.near(at).fold(Range::NOTHING, |all, seen| all.with(seen.range));
            match (is_done, samples) {
                (true, 1) => pixel.done(judge.error_within(&range())),
                (true, _) => pixel.done(own.error),
                (false, _) => {
                    pixel.facts.error = own.error;
                    pixel.surround(judge, &range());
                }
            }
        }
    }
}
