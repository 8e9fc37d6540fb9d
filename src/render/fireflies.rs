//! Fireflies: samples far brighter than their neighbours, because a randomly spread ray hit something small and bright.
//!
//! A lamp behind frosted glass, or far out of focus, is hit by one sample in hundreds. Pixels whose first samples all miss it
//! agree, look certain, and are too dark by all that it adds. So before the picture, one sample of some pixels is traced, or in a
//! small picture several of every pixel, and then more of the pixels that show something bright. Where some of these are
//! fireflies, a pixel nearby whose own samples are spread by random choices is certain only once it has met one too, or so many
//! of its samples have not that it hardly matters. Where every pixel takes part, the samples are the first ones of the picture
//! ([`Ahead`]).

use super::ahead::Ahead;
use super::by_class::ByClass;
use super::certainty::{Certainty, output};
use super::context::Context;
use super::forecast::part::Quiet;
use super::frame::{Frame, pixel_key};
use super::observer::Observer;
use super::roulette::Roulette;
use super::sampling::{Sampling, Stochastic};
use super::stochastic::{SampleBatch, SampleRequest};
use super::tile::{TILE, TOGETHER, Tile, TracedTiles, each_tile, tiles};
use super::whitted::{Sample, Tracer};
use super::{Job, Progress, Settings};
use crate::accel::Accel;
use std::sync::{Arc, Mutex, PoisonError};

/// In a picture of more than [`SMALL`] pixels, the search takes one pixel from each square of this many columns and rows.
const STEP: u32 = 2;
/// A forecast of the rendering takes one in this many columns and rows of those.
const HINT: u32 = 4;
const SMALL: u64 = 1 << 16;
/// Most samples that the search takes of each pixel of a smaller picture: as many as make up to [`SMALL`] in all.
const MOST: u32 = 16;

/// Additional samples of a pixel that shows something bright.
const AGAIN: u32 = 16;
/// A bright sample is a firefly if at most this many of [`AGAIN`] others are nearly as bright: a pixel that shows it more often
/// finds out by itself.
const SELDOM: usize = 2;

/// A light at least this fraction as bright counts as nearly as bright.
const NEARLY: f32 = 0.25;

/// Width and height of a cell, pixels.
const CELL: u32 = TILE;
/// Distance in cells up to which fireflies are looked for: what one sample in thousands hits is then hardly missed.
const REACH: usize = 2;
/// Fewest pixels with fireflies from which their density is estimated in a cell, in 3 × 3 cells, and in 5 × 5 cells.
const FEWEST: [u32; REACH + 1] = [4, 2, 1];

/// Sums over those samples of some cells that were spread by random choices.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    samples: u32,
    /// Sum of their light, each clamped to white.
    light: f64,
    /// Number of fireflies, the sum of their light, and the number of pixels that showed any.
    fireflies: u32,
    bright: f64,
    pixels: u32,
}

impl Told {
    fn with(self, other: &Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            light: self.light + other.light,
            fireflies: self.fireflies + other.fireflies,
            bright: self.bright + other.bright,
            pixels: self.pixels + other.pixels,
        }
    }

    /// Mean over the samples of a sum over them.
    #[expect(clippy::cast_possible_truncation, reason = "as exact as light is")]
    fn mean(&self, sum: f64) -> f32 {
        (sum / f64::from(self.samples.max(1))) as f32
    }
}

/// Where fireflies were found.
#[derive(Debug)]
pub(super) struct Fireflies {
    /// Number of cells in a row.
    columns: usize,
    cells: Vec<Cell>,
}

/// Fireflies in and around a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    /// Mean brightness of the fireflies, after exposure; 0 where there are none that matter.
    brightness: f32,
    /// Amount by which pixels are too dark, as they are written, without the fireflies that do not matter.
    missed: f32,
}

/// A sample that the search traced.
#[derive(Clone, Copy, Debug)]
struct Asked {
    /// Greatest channel of the sample, after exposure.
    light: f32,
    /// Whether random choices spread its rays.
    by_chance: bool,
}

impl Asked {
    const NOTHING: Self = Self { light: 0.0, by_chance: false };
}

fn pixels(width: u32, height: u32) -> u64 {
    u64::from(width) * u64::from(height)
}

/// Number of samples that the search takes of each of its pixels, a power of two.
fn samples(width: u32, height: u32) -> u32 {
    let samples = SMALL / pixels(width, height).max(1);
    u32::try_from(samples).map_or(MOST, |samples| 1 << samples.clamp(1, MOST).ilog2())
}

/// A pixel, and one of its samples.
type Answer = ((u32, u32), Asked);

/// How densely the search covers a picture.
#[derive(Clone, Copy, Debug)]
pub(super) enum Closely {
    /// As before a rendering.
    All,
    /// As for a forecast of a rendering: one pixel in sixteen of those.
    Hint,
}

impl Closely {
    /// Returns the step in columns and rows between the pixels that are searched.
    fn step(self, width: u32, height: u32) -> u32 {
        let step = if pixels(width, height) > SMALL { STEP } else { 1 };
        match self {
            Self::All => step,
            Self::Hint => step * HINT,
        }
    }

    /// Returns how many times as many rays the search before a rendering takes.
    pub(super) fn part(self) -> u64 {
        match self {
            Self::All => 1,
            Self::Hint => u64::from(HINT * HINT),
        }
    }
}

/// Number of eye rays that the search took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rays {
    pub all: u64,
    /// Eye rays that are not part of the picture.
    pub beside: u64,
}

/// Returns the number of first samples of every pixel that the search takes from the picture itself; `None` in large pictures,
/// and where the aim is an error of the whole picture, of which several are rendered.
fn of_picture(settings: &Settings, how: &Stochastic) -> Option<u32> {
    let (width, height) = (settings.width, settings.height);
    let are = how.target.is_none() && Closely::All.step(width, height) == 1;
    are.then(|| samples(width, height).min(how.powers().1))
}

/// Looks for fireflies where pixels are sampled until they are certain and rays may be spread by random choices, and stores them
/// in the context. Returns the number of eye rays that it took, and the counts of all threads.
pub(super) fn look<P: Observer>(
    job: &Job,
    context: &mut Context,
    closely: Closely,
    progress: &dyn Progress,
) -> (Rays, Vec<ByClass<P>>) {
    let Job { accel, view, settings, .. } = *job;
    let Sampling::Stochastic(how) = &settings.sampling else { return (Rays::default(), Vec::new()) };
    if !context.meets_by_chance {
        return (Rays::default(), Vec::new());
    }
    let (width, height) = (settings.width, settings.height);
    let step = closely.step(width, height);
    let of_picture = of_picture(settings, how);
    let samples = of_picture.unwrap_or_else(|| samples(width, height));
    let ahead =
        of_picture.filter(|_| matches!(closely, Closely::All)).map(|_| Mutex::new(Ahead::new(settings, samples)));
    let question = Question { frame: &Frame::new(context, accel, view, settings), how, step, samples };
    let grid = Grid::new(width.div_ceil(step) as usize, height.div_ceil(step) as usize);
    let asked = Mutex::new(vec![grid; samples as usize]);
    let work = |tracer: &mut Tracer<_, P>, &tile: &Tile| {
        let answers = question.ask(tracer, tile, ahead.as_ref())?;
        let mut asked = asked.lock().unwrap_or_else(PoisonError::into_inner);
        asked.iter_mut().zip(&answers).for_each(|(grid, answers)| grid.put(answers, step));
        Some(answers.iter().map(Vec::len).sum::<usize>() as u64)
    };
    let TracedTiles { finished, mut counts, complete } =
        each_tile(context, accel, &tiles(width, height), &Quiet(progress), work);
    let all = finished.into_iter().sum();
    let mut rays = Rays { all, beside: all };
    // After cancelling, the picture is not wanted either.
    if !complete {
        return (rays, counts);
    }
    let asked = asked.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut bright: Vec<Bright> = asked.iter().flat_map(|grid| grid.bright(step)).collect();
    bright.sort_by_key(|bright| bright.pixel);
    let pixels: Vec<&[Bright]> = bright.chunk_by(|one, next| one.pixel == next.pixel).collect();
    let some: Vec<&[&[Bright]]> = pixels.chunks(TOGETHER / AGAIN as usize).collect();
    let work = |tracer: &mut Tracer<_, P>, some: &&[&[Bright]]| question.ask_again(tracer, &asked, some);
    let TracedTiles { finished: answers, counts: more, complete } =
        each_tile(context, accel, &some, &Quiet(progress), work);
    counts.extend(more);
    if complete {
        let again = pixels.len() as u64 * u64::from(AGAIN);
        rays = Rays { all: all + again, beside: again + if of_picture.is_some() { 0 } else { all } };
        let (rare, told) = (answers.into_iter().flatten().collect(), in_cells(&asked, (CELL / step) as usize));
        let output = output(how.space, question.frame.background);
        let judge = Certainty::of(question.frame, how, output.as_ref(), context.scene.background);
        let missing = |light, more| judge.grey(light + more) - judge.grey(light);
        let fireflies = Arc::new(Fireflies::among(rare, &told, missing, missed_at_most(how)));
        context.fireflies = Some(fireflies);
        context.first_samples = of_picture.unwrap_or(0);
        context.ahead = ahead.map(|ahead| Arc::new(ahead.into_inner().unwrap_or_else(PoisonError::into_inner)));
    }
    (rays, counts)
}

/// Returns by how much all pixels of some cells may be too dark, as they are written.
fn missed_at_most(how: &Stochastic) -> f32 {
    /// Fraction of the error allowed for a single pixel.
    const OF_PIXEL: f32 = 0.25;
    /// Fraction of the error allowed for the whole picture, if that is the aim.
    const OF_ALL: f32 = 0.5;
    how.target.map_or(OF_PIXEL * how.error, |all| OF_ALL * all)
}

/// A pixel with a sample that may be a firefly, and the brightness of that sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bright {
    pixel: (u32, u32),
    light: f32,
}

/// How the search samples pixels.
struct Question<'a> {
    frame: &'a Frame<'a>,
    how: &'a Stochastic,
    step: u32,
    /// Number of samples of each pixel.
    samples: u32,
}

impl Question<'_> {
    /// Brightness of a sample, after exposure.
    fn light(&self, sample: &Sample) -> f32 {
        let light = sample.radiance.max_element() * self.how.space.gain();
        if light.is_finite() { light } else { 0.0 }
    }

    /// Samples one pixel of each square of `step` columns and rows of a tile; returns the first samples of all pixels, then their
    /// second ones, and so on. Samples of the picture itself are kept in `ahead`. `None` when cancelled.
    fn ask<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        tile: Tile,
        ahead: Option<&Mutex<Ahead>>,
    ) -> Option<Vec<Vec<Answer>>> {
        let is_asked = |(x, y): &(u32, u32)| x % self.step == 0 && y % self.step == 0;
        let (columns, rows): (Vec<u32>, Vec<u32>) = tile.places().filter(is_asked).unzip();
        let mut batch = SampleBatch::default();
        let each = (0..self.samples).map(|index| {
            batch.trace_each(self.frame, self.how, tracer, index, &columns, &rows)?;
            if let Some(ahead) = ahead {
                let mut ahead = ahead.lock().unwrap_or_else(PoisonError::into_inner);
                ahead.keep(index, (&columns, &rows), tracer);
            }
            let samples = tracer.samples.iter().zip(&tracer.by_chance);
            let asked = samples.map(|(sample, &by_chance)| Asked { light: self.light(sample), by_chance });
            Some(columns.iter().copied().zip(rows.iter().copied()).zip(asked).collect())
        });
        each.collect()
    }

    /// Takes more samples of some pixels, given with those samples from `asked` that may be fireflies; returns the ones that are
    /// rare among all samples of their pixel. `None` when cancelled.
    fn ask_again<A: Accel, P: Observer>(
        &self,
        tracer: &mut Tracer<A, P>,
        asked: &[Grid],
        some: &[&[Bright]],
    ) -> Option<Vec<Bright>> {
        let seed = self.frame.settings.seed;
        let wanted = some.iter().flat_map(|bright| {
            let pixel = bright[0].pixel;
            (self.samples..self.samples + AGAIN).map(move |index| SampleRequest {
                pixel,
                key: pixel_key(seed, pixel),
                index,
            })
        });
        SampleBatch::default().trace(self.frame, self.how, tracer, Roulette::default(), wanted)?;
        let each = some.iter().zip(tracer.samples.chunks(AGAIN as usize));
        let rare = each.flat_map(|(bright, again)| {
            let (x, y) = bright[0].pixel;
            let before = asked.iter().map(|grid| grid.at((x / self.step) as usize, (y / self.step) as usize).light);
            let lights: Vec<f32> = before.chain(again.iter().map(|sample| self.light(sample))).collect();
            bright.iter().copied().filter(move |bright| is_rare(bright.light, &lights))
        });
        Some(rare.collect())
    }
}

/// Whether few of all samples of a pixel, `light` among them, are nearly as bright as `light`.
fn is_rare(light: f32, all: &[f32]) -> bool {
    let (again, others) = (all.iter().filter(|other| **other >= NEARLY * light).count() - 1, all.len() - 1);
    again * AGAIN as usize <= SELDOM * others
}

/// The samples of one index of all pixels that are searched, row by row.
#[derive(Clone)]
struct Grid {
    columns: usize,
    rows: usize,
    each: Vec<Asked>,
}

impl Grid {
    fn new(columns: usize, rows: usize) -> Self {
        Self { columns, rows, each: vec![Asked::NOTHING; columns * rows] }
    }

    fn put(&mut self, answers: &[Answer], step: u32) {
        for &((x, y), asked) in answers {
            self.each[(y / step) as usize * self.columns + (x / step) as usize] = asked;
        }
    }

    fn at(&self, x: usize, y: usize) -> Asked {
        self.each[y * self.columns + x]
    }

    /// Returns the pixels whose samples may be fireflies.
    fn bright(&self, step: u32) -> Vec<Bright> {
        let places = (0..self.rows).flat_map(|y| (0..self.columns).map(move |x| (x, y)));
        let bright = places.filter(|&(x, y)| self.is_bright(x, y)).map(|(x, y)| {
            #[expect(clippy::cast_possible_truncation, reason = "columns and rows of a picture")]
            let pixel = (x as u32 * step, y as u32 * step);
            Bright { pixel, light: self.at(x, y).light }
        });
        bright.collect()
    }

    /// Whether a sample is brighter than white, and far brighter than all but a few of its neighbours.
    fn is_bright(&self, x: usize, y: usize) -> bool {
        /// Most samples nearly as bright among the nine: where there are more, the source is so wide that several pixels see it.
        const FEW: usize = 3;
        let Asked { light, by_chance } = self.at(x, y);
        let rows = y.saturating_sub(1)..(y + 2).min(self.rows);
        let near = rows.flat_map(|y| {
            let columns = x.saturating_sub(1)..(x + 2).min(self.columns);
            &self.each[y * self.columns..][columns]
        });
        // The sample itself is among its neighbours.
        by_chance && light > 1.0 && near.filter(|other| other.light >= NEARLY * light).count() <= FEW
    }
}

/// Sums the randomly spread samples over cells of `side` columns and rows of samples; returns the cells, and their number in a
/// row.
fn in_cells(asked: &[Grid], side: usize) -> (Vec<Told>, usize) {
    let cells = |of: usize| of.div_ceil(side);
    let (columns, rows) = asked.first().map_or((0, 0), |grid| (cells(grid.columns), cells(grid.rows)));
    let mut told = vec![Told::default(); columns * rows];
    for grid in asked {
        for (y, x) in (0..grid.rows).flat_map(|y| (0..grid.columns).map(move |x| (y, x))) {
            let Asked { light, by_chance } = grid.at(x, y);
            if by_chance {
                let cell = &mut told[y / side * columns + x / side];
                cell.samples += 1;
                cell.light += f64::from(light.clamp(0.0, 1.0));
            }
        }
    }
    (told, columns)
}

impl Fireflies {
    /// Builds the map of the fireflies `each` in a picture whose cells have these sums. Fireflies matter where pixels are too
    /// dark by more than `most` without them: `missing` gives that from the mean light and the mean light that the fireflies add.
    fn among(
        mut each: Vec<Bright>,
        (told, columns): &(Vec<Told>, usize),
        missing: impl Fn(f32, f32) -> f32,
        most: f32,
    ) -> Self {
        // Threads answer in any order; the order of sums is fixed.
        each.sort_unstable_by(|one, other| (one.pixel.cmp(&other.pixel)).then(one.light.total_cmp(&other.light)));
        let (mut told, columns, rows) = (told.clone(), *columns, told.len() / (*columns).max(1));
        for of_pixel in each.chunk_by(|one, next| one.pixel == next.pixel) {
            let (x, y) = of_pixel[0].pixel;
            let cell = &mut told[(y / CELL) as usize * columns + (x / CELL) as usize];
            cell.pixels += 1;
            for Bright { light, .. } in of_pixel {
                cell.bright += f64::from(*light);
                cell.fireflies += 1;
            }
        }
        let around = |i: usize, reach: usize| {
            let near = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
            let cells = near(i / columns, rows).flat_map(|row| &told[row * columns..][near(i % columns, columns)]);
            cells.fold(Told::default(), Told::with)
        };
        let cells = (0..told.len()).map(|i| {
            // A firefly in a cell may be the only one within many cells.
            let known = (0..=REACH).map(|reach| (around(i, reach), FEWEST[reach]));
            let known = known.filter(|(told, fewest)| told.pixels >= *fewest).map(|(told, _)| told);
            let missed = known.map(|told| missing(told.mean(told.light), told.mean(told.bright))).fold(0.0, f32::max);
            if missed <= most {
                return Cell { missed, ..Cell::default() };
            }
            let Told { bright, fireflies, .. } = around(i, REACH);
            #[expect(clippy::cast_possible_truncation, reason = "as exact as light is")]
            let mean = (bright / f64::from(fireflies.max(1))) as f32;
            Cell { brightness: mean, ..Cell::default() }
        });
        Self { columns, cells: cells.collect() }
    }

    fn cell(&self, (x, y): (u32, u32)) -> &Cell {
        &self.cells[(y / CELL) as usize * self.columns + (x / CELL) as usize]
    }

    /// Brightness of the fireflies that a pixel may meet; 0: none.
    pub(super) fn at(&self, pixel: (u32, u32)) -> f32 {
        self.cell(pixel).brightness
    }

    /// Amount by which a pixel is too dark, as it is written, without the fireflies that it may meet but does not wait for.
    pub(super) fn missed_at(&self, pixel: (u32, u32)) -> f32 {
        self.cell(pixel).missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a grid of randomly spread samples of 0.1, except for those given in `bright`.
    fn grid(columns: usize, rows: usize, bright: &[(usize, usize, f32)]) -> Grid {
        let mut grid = Grid { columns, rows, each: vec![Asked { light: 0.1, by_chance: true }; columns * rows] };
        bright.iter().for_each(|&(x, y, light)| grid.each[y * columns + x].light = light);
        grid
    }

    #[test]
    fn a_firefly_may_be_what_is_brighter_than_white_and_than_all_but_a_few_beside_it() {
        let is = |bright: &[(usize, usize, f32)]| grid(5, 5, bright).is_bright(2, 2);
        assert!(is(&[(2, 2, 50.0)]) && is(&[(2, 2, 50.0), (1, 1, 60.0), (3, 2, 20.0)]));
        assert!(!is(&[(2, 2, 0.9)]), "no more than white");
        assert!(!is(&[(2, 2, 50.0), (1, 1, 60.0), (3, 2, 20.0), (3, 3, 13.0)]), "a wide lamp");
        let mut straight = grid(5, 5, &[(2, 2, 50.0)]);
        straight.each[12].by_chance = false;
        assert!(!straight.is_bright(2, 2), "a pixel sees it whenever it looks");
        let corner = grid(5, 5, &[(0, 0, 50.0), (4, 4, 50.0)]);
        assert!(corner.is_bright(0, 0) && corner.is_bright(4, 4));
        let pixels: Vec<_> = corner.bright(2).iter().map(|bright| bright.pixel).collect();
        assert_eq!(pixels, [(0, 0), (8, 8)]);
    }

    #[test]
    fn small_pictures_are_looked_at_with_more_samples_a_pixel() {
        assert_eq!(
            [(256, 256), (1024, 768), (128, 256), (64, 64), (9, 5)].map(|(w, h)| samples(w, h)),
            [1, 1, 2, 16, 16]
        );
        assert_eq!(samples(100, 100), 4, "a power of two");
        let one = |light| Asked { light, by_chance: true };
        let layer = |light| Grid { columns: 3, rows: 1, each: vec![one(light), one(9.0), Asked::NOTHING] };
        let (told, columns) = in_cells(&[layer(0.25), layer(0.5)], 2);
        assert_eq!((columns, told.len()), (2, 2));
        assert_eq!((told[0].samples, told[0].light, told[1].samples), (4, 2.75, 0));
    }

    #[test]
    fn what_a_pixel_shows_again_and_again_is_no_firefly_however_many_of_its_samples_were_looked_at() {
        let all = |bright: usize, of: usize| (0..of).map(|k| if k < bright { 8.0 } else { 0.1 }).collect::<Vec<f32>>();
        // One sample before and sixteen after, or sixteen and sixteen: the firefly, and two of sixteen others, or three of
        // thirty-one.
        for (of, most) in [(17, 3), (32, 4)] {
            assert!(is_rare(8.0, &all(1, of)) && is_rare(30.0, &all(most, of)), "{of}");
            assert!(!is_rare(30.0, &all(most + 1, of)), "{of}");
        }
    }

    #[test]
    fn pixels_hear_of_fireflies_in_their_cell_and_two_cells_around_it() {
        let (bright, told) = (|x, y, light| Bright { pixel: (x, y), light }, Told { samples: 256, ..Told::default() });
        let each = vec![bright(180, 6, 4.0), bright(16, 6, 30.0), bright(24, 18, 50.0)];
        let found = Fireflies::among(each, &(vec![told; 14], 7), |_, more| more, 0.0);
        let heard = [0, 31, 32, 95, 96, 127, 128, 193].map(|x| found.at((x, 0)));
        assert_eq!(heard, [40.0, 40.0, 40.0, 40.0, 4.0, 4.0, 4.0, 4.0]);
        assert_eq!(found.at((0, 39)), 40.0, "the row of cells below");
        assert_eq!(found.missed_at((0, 0)), 0.0, "they are waited for");
    }

    #[test]
    fn fireflies_count_where_without_them_pixels_would_be_too_dark() {
        let told = Told { samples: 256, light: 25.6, ..Told::default() };
        let of_pixels = |fireflies: u32, apart: u32, least: f32| {
            let each = (0..fireflies).map(|i| Bright { pixel: (70 + i * apart, 7), light: 10.0 });
            let missing = |light: f32, more: f32| if (light - 0.1).abs() < 1e-6 { more } else { 0.0 };
            let found = Fireflies::among(each.collect(), &(vec![told; 5], 5), missing, least);
            [0, 32, 64].map(|x| (found.at((x, 0)), found.missed_at((x, 0))))
        };
        let of = |fireflies: u32, least: f32| of_pixels(fireflies, 1, least);
        // In a row of five cells all lie within reach of the middle one, three next to it.
        let mean = |fireflies: f32, tiles: f32| fireflies * 10.0 / (256.0 * tiles);
        assert_eq!(of(1, 0.99 * mean(1.0, 5.0)), [(10.0, 0.0); 3], "anywhere");
        let missed = mean(4.0, 3.0);
        assert_eq!(of(4, 1.01 * missed), [(0.0, missed), (0.0, missed), (10.0, 0.0)], "in their cell alone");
        let missed = mean(2.0, 3.0);
        assert_eq!(of(2, 1.01 * missed), [(0.0, missed); 3], "two tell nothing of a cell");
        let missed = [3.0, 4.0, 5.0].map(|tiles| (0.0, mean(4.0, tiles)));
        assert_eq!(of_pixels(4, 0, 1.01 * missed[0].1), missed, "nor does one pixel, however many it shows");
    }
}
