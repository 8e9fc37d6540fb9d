//! What the pixels beside a pixel tell about it.
//!
//! Most of a picture is so even that few samples of a pixel do. That these are enough is told by those of the eight pixels
//! beside it: all must agree. What is thinner than a pixel, a wire or the stroke of a letter, shows in some of the pixels that
//! it crosses and not in others; so wherever a pixel that was looked at closer turns out to be uneven, all near it are
//! looked at as closely, and those near them if they are uneven, too ([`Around::reopen`]).

use super::pixel::Pixel;
use crate::render::certainty::{Certainty, Even, GROUPS, Range, Seen, Shown};
use crate::render::tile::{End, Tile};

/// How many columns and rows from a pixel others are looked at as closely: from one on an edge, and from one with something
/// thin, of which the next pixels may well show nothing.
const REACH: [u32; 2] = [1, 4];

/// The number of no pixel.
const NONE: u32 = u32::MAX;

/// What the samples of a tile and of the pixels around it show.
pub(super) struct Around {
    /// All of these pixels.
    pub tile: Tile,
    /// What single samples show, row by row, with a place on every side where there is nothing.
    pub shown: Shown,
    /// Numbers of pixels that have more of them, or none yet, likewise.
    numbers: Vec<u32>,
    /// What those pixels show, by number.
    seen: Vec<Seen>,
}

impl Around {
    /// Nothing yet.
    pub(super) fn new(tile: Tile) -> Self {
        let places = (tile.x1 - tile.x0 + 2) as usize * (tile.y1 - tile.y0 + 2) as usize;
        Self { tile, shown: Shown::nothing(places), numbers: vec![NONE; places], seen: Vec::new() }
    }

    /// Places in a row.
    pub(super) fn columns(&self) -> usize {
        (self.tile.x1 - self.tile.x0 + 2) as usize
    }

    /// The place of a pixel.
    pub(super) fn at(&self, (x, y): (u32, u32)) -> usize {
        (y - self.tile.y0 + 1) as usize * self.columns() + (x - self.tile.x0 + 1) as usize
    }

    /// Which of these pixels that have one sample are done, and how certain they are then: those that look as all beside them.
    pub(super) fn even(&self, judge: &Certainty, tile: Tile) -> Even {
        let row = |y: u32| {
            let start = self.at((tile.x0, y));
            start..start + (tile.x1 - tile.x0) as usize
        };
        judge.compare(&self.shown, self.columns(), (tile.y0..tile.y1).map(row))
    }

    /// Knows a pixel by its number, all smaller ones of which are known.
    pub(super) fn know(&mut self, pixel: (u32, u32), number: usize) {
        let at = self.at(pixel);
        self.numbers[at] = u32::try_from(number).unwrap_or(NONE);
        self.seen.push(self.shown.at(at));
    }

    /// What is seen at a place and beside it.
    fn near(&self, at: usize) -> impl Iterator<Item = Seen> + Clone {
        let rows = [at - self.columns(), at, at + self.columns()];
        let places = rows.into_iter().flat_map(|middle| middle - 1..middle + 2);
        places.map(|at| self.seen.get(self.numbers[at] as usize).copied().unwrap_or_else(|| self.shown.at(at)))
    }

    /// What the samples at a pixel and beside it lie between.
    pub(super) fn range(&self, pixel: (u32, u32)) -> Range {
        self.near(self.at(pixel)).fold(Range::NOTHING, |all, seen| all.with(seen.range))
    }

    /// Looks at the samples of these pixels, of which each has as many, up to as many as there are groups.
    pub(super) fn see(&mut self, judge: &Certainty, pixels: &[Pixel], some: &[usize]) {
        let mut each = some.iter();
        judge.see_each(some.iter().map(|&i| pixels[i].taken()), |seen| {
            each.next().into_iter().for_each(|&i| self.seen[i] = *seen);
        });
    }

    /// How much the samples of the pixels beside one vary, of which each has its own variance: the fifth of eight in their
    /// order, the middle of three and of five. A single sample that looks as all beside it does not.
    pub(super) fn variance(&self, pixels: &[Pixel], pixel: (u32, u32)) -> f32 {
        let middle = self.at(pixel);
        let (mut variances, mut known) = ([0.0_f32; 8], 0);
        for row in [middle - self.columns(), middle, middle + self.columns()] {
            for at in (row - 1..row + 2).filter(|&at| at != middle) {
                let number = self.numbers[at] as usize;
                variances[known] = match pixels.get(number) {
                    Some(beside) => beside.variance().unwrap_or_else(|| self.variance_seen(beside, number)),
                    None if self.shown.is_known(at) => 0.0,
                    None => continue,
                };
                known += 1;
            }
        }
        let variances = &mut variances[..known];
        variances.sort_unstable_by(f32::total_cmp);
        variances.get(known.saturating_sub(1) * 4 / 7).copied().unwrap_or(0.0)
    }

    /// That of a pixel whose samples were only looked at together with those beside it.
    #[expect(clippy::cast_precision_loss, reason = "a handful of samples")]
    fn variance_seen(&self, pixel: &Pixel, number: usize) -> f32 {
        let error = self.seen[number].error;
        error * error * pixel.facts.count as f32
    }

    /// The pixels of `tile` beside some that seemed certain with so many samples or fewer, and are not, now that more is known
    /// of these.
    pub(super) fn late(
        &self,
        judge: &Certainty,
        pixels: &mut [Pixel],
        (some, samples): (&[usize], u32),
        tile: Tile,
    ) -> Vec<usize> {
        let mut late = Vec::new();
        for &pixel in some {
            let (x, y) = pixels[pixel].at;
            for y in y.saturating_sub(1).max(tile.y0)..(y + 2).min(tile.y1) {
                for x in x.saturating_sub(1).max(tile.x0)..(x + 2).min(tile.x1) {
                    let number = self.numbers[self.at((x, y))] as usize;
                    let Some(stopped) = pixels.get(number) else { continue };
                    let (end, count) = (stopped.facts.end, stopped.facts.count);
                    if end != End::Met || count > samples || stopped.variance().is_none() {
                        continue;
                    }
                    let beside = self.variance(pixels, (x, y));
                    let stopped = &mut pixels[number];
                    stopped.compare(beside);
                    if stopped.used(judge) > 1.0 {
                        (stopped.facts.end, stopped.facts.spare) = (End::Ceiling, 0);
                        late.push(number);
                    }
                }
            }
        }
        late
    }

    /// Opens the pixels of `tile` that were done with so many samples and lie near uneven ones of these: those of one, which
    /// have no numbers yet, and those of more, which have; their numbers.
    pub(super) fn reopen(
        &mut self,
        judge: &Certainty,
        pixels: &mut Vec<Pixel>,
        (some, samples): (&[usize], u32),
        tile: Tile,
        open: impl Fn((u32, u32)) -> Pixel,
    ) -> Vec<usize> {
        let mut opened = Vec::new();
        for &pixel in some {
            let own = self.seen[pixel].range;
            if judge.agree(&own) {
                continue;
            }
            let (x, y) = pixels[pixel].at;
            let reach = REACH[usize::from(judge.is_thin(&own, self.near(self.at((x, y)))))];
            for y in y.saturating_sub(reach).max(tile.y0)..(y + reach + 1).min(tile.y1) {
                for x in x.saturating_sub(reach).max(tile.x0)..(x + reach + 1).min(tile.x1) {
                    let mut number = self.numbers[self.at((x, y))] as usize;
                    match pixels.get_mut(number) {
                        Some(pixel) if pixel.is_done_with(samples) => pixel.facts.end = End::Ceiling,
                        Some(_) => continue,
                        None => {
                            number = pixels.len();
                            self.know((x, y), number);
                            pixels.push(open((x, y)));
                        }
                    }
                    opened.push(number);
                }
            }
        }
        opened
    }

    /// Finds the pixels of these that are done: their samples and those of the pixels beside them agree each among
    /// themselves, and both are of the same colours. Of the others it finds the contrast around them.
    pub(super) fn judge(&self, judge: &Certainty, pixels: &mut [Pixel], some: &[usize]) {
        for &i in some {
            let (own, pixel) = (&self.seen[i], &mut pixels[i]);
            let (near, samples) = (self.near(self.at(pixel.at)), pixel.facts.count);
            let is_calm = |seen: Seen| judge.agree(&seen.range) && !judge.differ(own.color, seen.color, samples);
            if samples < GROUPS as u32 && near.clone().all(is_calm) {
                pixel.done(own.error);
            } else {
                pixel.facts.error = own.error;
                pixel.surround(judge, &self.range(pixel.at));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::render::certainty::factor;
    use crate::render::whitted::Sample;

    const TILE: Tile = Tile { x0: 4, y0: 7, x1: 7, y1: 10 };

    /// Nine pixels that have eight samples each, those around the middle one half of the time this much lighter.
    fn nine(judge: &Certainty, step: f32) -> (Around, Vec<Pixel>) {
        let (mut around, mut pixels) = (Around::new(TILE), Vec::new());
        for at in TILE.places() {
            let step = if at == (5, 8) { 0.0 } else { step };
            let mut pixel = Pixel::new(3, at, false);
            add(&mut pixel, step);
            around.know(at, pixels.len());
            pixels.push(pixel);
        }
        learn(judge, &mut pixels);
        (around, pixels)
    }

    fn add(pixel: &mut Pixel, step: f32) {
        let light = |k: usize| Sample { radiance: Vec3::splat(step * (k % 2) as f32), through: Vec3::ZERO };
        pixel.take(&std::array::from_fn::<_, GROUPS, _>(light), &[], 1);
    }

    fn learn(judge: &Certainty, pixels: &mut [Pixel]) {
        for pixel in pixels {
            let groups = pixel.groups;
            judge.each_standard_error([&groups[..]].into_iter(), |error| pixel.learn(error));
        }
    }

    #[test]
    fn what_varies_less_than_all_around_it_is_no_more_certain_than_that() {
        let judge = Certainty::new(None, (None, false), false, 0.05, factor(0.95));
        for (step, certain) in [(0.0, true), (0.02, true), (0.5, false)] {
            let (around, mut pixels) = nine(&judge, step);
            let beside = around.variance(&pixels, (5, 8));
            pixels[4].compare(beside);
            pixels[4].look(&judge);
            assert_eq!(pixels[4].facts.end == End::Met, certain, "{step}: {}", pixels[4].facts.error);
            // Of 0 and `step`, four each.
            let expected = (step * step / 4.0 / 7.0).sqrt();
            assert!((pixels[4].facts.error - expected).abs() < 1e-6, "{step}: {}", pixels[4].facts.error);
        }
    }

    #[test]
    fn an_edge_beside_a_pixel_tells_nothing_of_it() {
        let judge = Certainty::new(None, (None, false), false, 0.05, factor(0.95));
        let (around, mut pixels) = nine(&judge, 0.5);
        for i in [0, 1, 2, 3, 6] {
            pixels[i].learn(0.0);
        }
        assert_eq!(around.variance(&pixels, (5, 8)), 0.0);
        // In a corner of a picture there are three beside it.
        assert!(around.variance(&pixels, (6, 9)) > 0.0);
    }

    /// As at the border of a tile, whose pixels alone get more samples.
    #[test]
    fn four_samples_of_the_pixels_around_a_tile_tell_how_much_they_vary() {
        let judge = Certainty::new(None, (None, false), false, 0.05, factor(0.95));
        let (mut around, mut pixels) = (Around::new(TILE), Vec::new());
        for at in TILE.places() {
            let mut pixel = Pixel::new(3, at, false);
            let light = |k: usize| Sample { radiance: Vec3::splat(0.5 * (k % 2) as f32), through: Vec3::ZERO };
            pixel.take(&[0, 1, 2, 3].map(light), &[], 1);
            around.know(at, pixels.len());
            pixels.push(pixel);
        }
        around.see(&judge, &pixels, &[0, 1, 2, 3, 4, 5, 6, 7, 8]);
        // Of 0 and ½, two each.
        let variance = around.variance(&pixels, (5, 8));
        assert!((variance - 0.25 / 3.0).abs() < 1e-6, "{variance}");
    }

    #[test]
    fn of_two_pixels_beside_one_in_a_single_row_an_edge_is_not_the_rule() {
        let judge = Certainty::new(None, (None, false), false, 0.05, factor(0.95));
        let tile = Tile { x0: 4, y0: 7, x1: 7, y1: 8 };
        let (mut around, mut pixels) = (Around::new(tile), Vec::new());
        for (at, step) in tile.places().zip([0.0, 0.0, 0.5]) {
            let mut pixel = Pixel::new(3, at, false);
            add(&mut pixel, step);
            around.know(at, pixels.len());
            pixels.push(pixel);
        }
        learn(&judge, &mut pixels);
        assert_eq!(around.variance(&pixels, (5, 7)), 0.0);
    }

    #[test]
    fn a_pixel_that_was_certain_goes_on_when_those_around_it_turn_out_not_to_be() {
        let judge = Certainty::new(None, (None, false), false, 0.05, factor(0.95));
        let (around, mut pixels) = nine(&judge, 0.0);
        pixels.iter_mut().for_each(|pixel| pixel.look(&judge));
        let some: Vec<usize> = (0..9).filter(|&i| i != 4).collect();
        assert!(around.late(&judge, &mut pixels, (&some, 16), TILE).is_empty());
        for &i in &some {
            pixels[i].join_groups();
            pixels[i].take(&[Sample { radiance: Vec3::ONE, through: Vec3::ZERO }; GROUPS], &[], 2);
            pixels[i].facts.end = End::Ceiling;
        }
        learn(&judge, &mut pixels);
        assert_eq!(around.late(&judge, &mut pixels, (&some, 16), TILE), [4]);
        assert!(pixels[4].facts.end == End::Ceiling);
    }
}
