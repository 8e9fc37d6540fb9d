//! Comparison of a pixel with its neighbours.
//!
//! Most of a picture is so even that a pixel needs few samples. Whether these suffice is judged by those of its eight neighbours:
//! all must agree. A detail thinner than a pixel, a wire or the stroke of a letter, shows in some of the pixels that it crosses
//! and not in others; so wherever a pixel that got more samples turns out to be uneven, all pixels near it get as many, and those
//! near them if they are uneven, too ([`Neighborhood::reopen_near_uneven`]).

use super::first_samples::FirstSamples;
use super::pixel::Pixel;
use super::variances::Variances;
use crate::render::certainty::{Certainty, Even, GROUPS, PixelSummary, Range, Shown};
use crate::render::tile::{Convergence, PixelFacts, Tile};

/// Distance in columns and rows within which pixels are reopened: around a pixel on an edge, and around one with a thin detail,
/// which the next pixels may well miss.
const REACH: [u32; 2] = [1, 4];

/// Index that marks "no pixel".
const NONE: u32 = u32::MAX;

/// What the samples of a tile and of the pixels around it show.
pub(super) struct Neighborhood {
    /// All of these pixels.
    pub tile: Tile,
    /// What single samples show, row by row, with an empty place on every side.
    pub shown: Shown,
    /// Indices of the pixels that have more samples, or none yet, at the same places.
    numbers: Vec<u32>,
    /// What those pixels show, by index.
    seen: Vec<PixelSummary>,
    /// Variance of the samples, by place; 0 for a single sample that looks like all its neighbours.
    variances: Variances,
}

impl Neighborhood {
    /// Collects what these first samples show of the pixels of a tile.
    pub(super) fn new(tile: Tile, first: &[&FirstSamples]) -> Self {
        let columns = (tile.x1 - tile.x0 + 2) as usize;
        let places = columns * (tile.y1 - tile.y0 + 2) as usize;
        let (shown, variances) = (Shown::nothing(places), Variances::nothing(columns));
        let mut around = Self { tile, shown, numbers: vec![NONE; places], seen: Vec::new(), variances };
        first.iter().for_each(|first| first.show(&mut around));
        around.variances.begin(around.shown.known());
        around
    }

    /// Number of places in a row.
    pub(super) fn columns(&self) -> usize {
        (self.tile.x1 - self.tile.x0 + 2) as usize
    }

    /// Place of a pixel.
    pub(super) fn at(&self, (x, y): (u32, u32)) -> usize {
        (y - self.tile.y0 + 1) as usize * self.columns() + (x - self.tile.x0 + 1) as usize
    }

    /// Which of the tile's pixels with one sample look like all their neighbours, and are done; with their errors.
    pub(super) fn even(&self, judge: &Certainty, tile: Tile) -> Even {
        // The places between the rows are included, which is faster than row by row.
        let (first, last) = (self.at((tile.x0, tile.y0)), self.at((tile.x1 - 1, tile.y1 - 1)));
        judge.compare(&self.shown, self.columns(), first..last + 1)
    }

    /// Registers a pixel under an index; all smaller indices are taken.
    pub(super) fn register(&mut self, pixel: (u32, u32), number: usize) {
        let at = self.at(pixel);
        self.numbers[at] = u32::try_from(number).unwrap_or(NONE);
        self.seen.push(self.shown.at(at));
        self.variances.learn(at, 0.0);
    }

    /// What is seen at a place and its neighbours.
    fn near(&self, at: usize) -> impl Iterator<Item = PixelSummary> + Clone {
        let rows = [at - self.columns(), at, at + self.columns()];
        let places = rows.into_iter().flat_map(|middle| middle - 1..middle + 2);
        places.map(|at| self.seen.get(self.numbers[at] as usize).copied().unwrap_or_else(|| self.shown.at(at)))
    }

    /// Range of the samples of a pixel and its neighbours.
    pub(super) fn range(&self, pixel: (u32, u32)) -> Range {
        self.near(self.at(pixel)).fold(Range::NOTHING, |all, seen| all.with(seen.range))
    }

    /// Evaluates the samples of these pixels: the same number for each, up to one in every group.
    pub(super) fn see(&mut self, judge: &Certainty, pixels: &[Pixel], some: &[usize]) {
        let mut each = some.iter();
        judge.see_each(some.iter().map(|&i| pixels[i].taken()), |seen| {
            each.next().into_iter().for_each(|&i| self.seen[i] = *seen);
        });
        for &i in some {
            self.variances.learn(self.at(pixels[i].at), pixels[i].variance_of(self.seen[i].error));
        }
    }

    /// Estimates the errors of the means of these pixels, which have samples in each group.
    ///
    /// The few samples that hit a light, or see it through glass, make up both a pixel's mean and its error estimate: a pixel in
    /// which hardly any did looks dark and certain. So its samples are taken to vary no less than those of its neighbours.
    pub(super) fn estimate_errors(
        &mut self,
        judge: &Certainty,
        pixels: &mut [Pixel],
        some: &[usize],
        errors: &mut Vec<f32>,
    ) {
        errors.clear();
        judge.each_standard_error(some.iter().map(|&i| &pixels[i].groups[..]), |error| errors.push(error));
        for (&i, &error) in some.iter().zip(&*errors) {
            let variance = pixels[i].learn(error);
            self.variances.learn(self.at(pixels[i].at), variance);
        }
        for &i in some {
            let pixel = &mut pixels[i];
            // A pixel that is not certain by itself is not certain with its neighbours, either.
            if pixel.used(judge) <= 1.0 {
                self.compare(pixel);
                pixel.judge(judge);
            }
        }
    }

    /// Raises the variance of a pixel's samples to that of its neighbours.
    pub(super) fn compare(&self, pixel: &mut Pixel) {
        if let Some(own) = pixel.variance() {
            pixel.set_variance(self.variances.no_less_than(own, self.at(pixel.at)));
        }
    }

    /// Neighbours in `tile` of these pixels that seemed certain with `samples` or fewer, and are not with the variances known
    /// now.
    pub(super) fn reopen_uncertain(
        &self,
        judge: &Certainty,
        pixels: &mut [Pixel],
        some: &[usize],
        samples: u32,
        tile: Tile,
    ) -> Vec<usize> {
        let (mut late, mut asked) = (Vec::new(), vec![false; pixels.len()]);
        for &pixel in some {
            let (x, y) = pixels[pixel].at;
            for y in y.saturating_sub(1).max(tile.y0)..(y + 2).min(tile.y1) {
                for x in x.saturating_sub(1).max(tile.x0)..(x + 2).min(tile.x1) {
                    let number = self.numbers[self.at((x, y))] as usize;
                    let Some(stopped) = pixels.get_mut(number) else { continue };
                    let PixelFacts { convergence, count, error, .. } = stopped.facts;
                    if std::mem::replace(&mut asked[number], true)
                        || convergence != Convergence::Converged
                        || count > samples
                    {
                        continue;
                    }
                    self.compare(stopped);
                    if stopped.facts.error > error && stopped.used(judge) > 1.0 {
                        (stopped.facts.convergence, stopped.facts.spare) = (Convergence::Open, 0);
                        late.push(number);
                    }
                }
            }
        }
        late
    }

    /// Opens the pixels of `tile` that were done with `samples` and lie near uneven ones among `some`: those with one sample,
    /// which get an index now, and those with more, which have one; returns their indices.
    pub(super) fn reopen_near_uneven(
        &mut self,
        judge: &Certainty,
        pixels: &mut Vec<Pixel>,
        some: &[usize],
        samples: u32,
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
                        Some(pixel) if pixel.is_done_with(samples) => pixel.facts.convergence = Convergence::Open,
                        Some(_) => continue,
                        None => {
                            number = pixels.len();
                            self.register((x, y), number);
                            pixels.push(open((x, y)));
                        }
                    }
                    opened.push(number);
                }
            }
        }
        opened
    }

    /// Finishes those of these pixels whose own and neighbouring samples agree among themselves, and have the same colours. For
    /// the others, stores the contrast around them.
    pub(super) fn judge(&self, judge: &Certainty, pixels: &mut [Pixel], some: &[usize]) {
        for &i in some {
            let (own, pixel) = (&self.seen[i], &mut pixels[i]);
            let (near, samples) = (self.near(self.at(pixel.at)), pixel.facts.count);
            let is_calm =
                |seen: PixelSummary| judge.agree(&seen.range) && !judge.differ(own.color, seen.color, samples);
            if samples < GROUPS as u32 && pixel.firefly == 0.0 && near.clone().all(is_calm) {
                pixel.converge(own.error);
            } else {
                pixel.facts.error = own.error;
                pixel.set_contrast(judge, &self.range(pixel.at));
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

    fn judge() -> Certainty<'static> {
        Certainty::new(None, None, false, false, 0.05, factor(0.95))
    }

    /// Pixels of a tile, each with `samples`, every second of which is lighter by `step`.
    fn pixels(tile: Tile, samples: usize, step: impl Fn((u32, u32)) -> f32) -> (Neighborhood, Vec<Pixel>) {
        let (mut around, mut pixels) = (Neighborhood::new(tile, &[]), Vec::new());
        for at in tile.places() {
            let mut pixel = Pixel::new(3, at, false);
            let light = |k: usize| Vec3::splat(step(at) * (k % 2) as f32);
            let each = (0..samples).map(|k| Sample { radiance: light(k), through: Vec3::ZERO });
            pixel.take(&each.collect::<Vec<_>>(), &[], 1);
            around.register(at, pixels.len());
            pixels.push(pixel);
        }
        (around, pixels)
    }

    fn estimate_errors(around: &mut Neighborhood, pixels: &mut [Pixel], some: &[usize]) {
        around.estimate_errors(&judge(), pixels, some, &mut Vec::new());
    }

    /// Standard error of eight samples, four each of 0 and `step`.
    fn error(step: f32) -> f32 {
        (step * step / 4.0 / 7.0).sqrt()
    }

    /// Error of a pixel after all have been evaluated and compared.
    fn told((around, pixels): &mut (Neighborhood, Vec<Pixel>), pixel: usize) -> f32 {
        let all: Vec<usize> = (0..pixels.len()).collect();
        estimate_errors(around, pixels, &all);
        around.compare(&mut pixels[pixel]);
        pixels[pixel].facts.error
    }

    #[test]
    fn what_varies_less_than_all_around_it_is_no_more_certain_than_that() {
        for (step, certain) in [(0.0, true), (0.02, true), (0.5, false)] {
            let mut nine = pixels(TILE, GROUPS, |at| if at == (5, 8) { 0.0 } else { step });
            let told = told(&mut nine, 4);
            assert!((told - error(step)).abs() < 1e-6, "{step}: {told}");
            assert_eq!(nine.1[4].facts.convergence == Convergence::Converged, certain, "{step}: {told}");
        }
    }

    #[test]
    fn an_edge_beside_a_pixel_tells_nothing_of_it() {
        let light = |(x, y): (u32, u32)| if x == 4 || y == 7 && x < 7 { 0.0 } else { 0.5 };
        let mut nine = pixels(TILE, GROUPS, |at| if at == (5, 8) { 0.0 } else { light(at) });
        assert_eq!(told(&mut nine, 4), 0.0);
        // In a corner of a picture a pixel has three neighbours.
        let mut nine = pixels(TILE, GROUPS, |at| if at == (6, 9) { 0.0 } else { light(at) });
        assert!((told(&mut nine, 8) - error(0.5)).abs() < 1e-6);
    }

    /// As at the border of a tile, whose pixels alone get more samples.
    #[test]
    fn four_samples_of_the_pixels_around_a_tile_tell_how_much_they_vary() {
        let (mut around, mut pixels) = pixels(TILE, 4, |_| 0.5);
        around.see(&judge(), &pixels, &[0, 1, 2, 3, 5, 6, 7, 8]);
        pixels[4].take(&[Sample { radiance: Vec3::ZERO, through: Vec3::ZERO }; 4], &[], 1);
        pixels[4].learn(0.0);
        around.compare(&mut pixels[4]);
        // Of 0 and ½, two each.
        let (told, expected) = (pixels[4].facts.error, (0.25_f32 / 3.0 / 8.0).sqrt());
        assert!((told - expected).abs() < 1e-6, "{told}");
    }

    #[test]
    fn of_two_pixels_beside_one_in_a_single_row_an_edge_is_not_the_rule() {
        let mut row = pixels(Tile { y1: 8, ..TILE }, GROUPS, |(x, _)| if x == 6 { 0.5 } else { 0.0 });
        assert_eq!(told(&mut row, 1), 0.0);
    }

    #[test]
    fn a_pixel_that_was_certain_goes_on_when_those_around_it_turn_out_not_to_be() {
        let judge = judge();
        let (mut around, mut pixels) = pixels(TILE, GROUPS, |_| 0.0);
        estimate_errors(&mut around, &mut pixels, &(0..9).collect::<Vec<_>>());
        let some: Vec<usize> = (0..9).filter(|&i| i != 4).collect();
        assert!(around.reopen_uncertain(&judge, &mut pixels, &some, 16, TILE).is_empty());
        for &i in &some {
            pixels[i].join_groups();
            pixels[i].take(&[Sample { radiance: Vec3::ONE, through: Vec3::ZERO }; GROUPS], &[], 2);
            pixels[i].facts.convergence = Convergence::Open;
        }
        estimate_errors(&mut around, &mut pixels, &some);
        assert_eq!(around.reopen_uncertain(&judge, &mut pixels, &some, 16, TILE), [4]);
        assert!(pixels[4].facts.convergence == Convergence::Open);
    }
}
