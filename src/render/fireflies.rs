//! Fireflies: samples far brighter than those beside them, since a ray that was spread by chance met something small.
//!
//! A lamp behind frosted glass, or far out of focus, is met by one sample of hundreds. Pixels whose first samples all miss it
//! agree and look certain, and are darker than they should be by all that it adds. So one sample of a part of the pixels is
//! traced before the picture. Where some of these are fireflies, pixels near them whose own samples are spread by chance are
//! not certain before they have met one, too, or so many of their samples have not that it matters little.

use super::by_class::ByClass;
use super::context::Context;
use super::frame::Frame;
use super::observer::Observer;
use super::part::Quiet;
use super::sampling::{ErrorSpace, Sampling, Stochastic};
use super::stochastic::Places;
use super::tile::{TILE, Tile, each_tile, tiles};
use super::whitted::Tracer;
use super::{Job, Progress};
use crate::accel::Accel;
use std::sync::Arc;

/// Of a picture with more pixels than [`SMALL`] one in so many columns of one in so many rows is asked.
const STEP: u32 = 2;
const SMALL: u64 = 1 << 16;

/// Fireflies are looked for so many tiles away: what one of thousands of samples meets is then hardly overlooked.
const REACH: usize = 2;

/// Where fireflies were met.
#[derive(Debug)]
pub(super) struct Fireflies {
    /// Tiles in a row.
    columns: usize,
    /// How bright those in and around each tile are on average, after exposure; 0 where there are none.
    brightness: Vec<f32>,
}

/// A sample of a pixel that was asked.
#[derive(Clone, Copy, Debug)]
struct Asked {
    /// Its greatest channel, after exposure.
    light: f32,
    /// Whether its rays were spread by chance.
    by_chance: bool,
}

impl Asked {
    const NOTHING: Self = Self { light: 0.0, by_chance: false };
}

/// Looks for them where pixels are sampled until they are certain and rays may be spread by chance, and tells the context; eye
/// rays that it took, and the counts of all threads.
pub(super) fn look<P: Observer>(job: &Job, context: &mut Context, progress: &dyn Progress) -> (u64, Vec<ByClass<P>>) {
    let Job { accel, view, settings, .. } = *job;
    let Sampling::Stochastic(how) = &settings.sampling else { return (0, Vec::new()) };
    if !context.meets_by_chance {
        return (0, Vec::new());
    }
    let (width, height) = (settings.width, settings.height);
    let frame = Frame::new(context, accel, view, settings);
    let gain = match how.space {
        ErrorSpace::Linear => 1.0,
        ErrorSpace::Display { exposure, .. } => libm::exp2f(exposure),
    };
    let step = if u64::from(width) * u64::from(height) > SMALL { STEP } else { 1 };
    let work = |tracer: &mut Tracer<_, P>, &tile: &Tile| ask(&frame, how, tracer, (tile, step), gain);
    let (answers, counts, complete) = each_tile(context, accel, &tiles(width, height), &Quiet(progress), work);
    let rays = answers.iter().map(Vec::len).sum::<usize>() as u64;
    // Who has cancelled wants no more of the picture, either.
    if complete {
        let (columns, rows) = (width.div_ceil(step) as usize, height.div_ceil(step) as usize);
        let asked = Grid::of(columns, rows, answers.into_iter().flatten());
        context.fireflies = Some(Arc::new(Fireflies::among(&asked, (TILE / step) as usize)));
    }
    (rays, counts)
}

/// Asks one pixel of each square of `step` columns and rows of a tile; the column and row of each in all that are asked. `None`
/// when cancelled.
fn ask<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    (tile, step): (Tile, u32),
    gain: f32,
) -> Option<Vec<((u32, u32), Asked)>> {
    let (columns, rows): (Vec<u32>, Vec<u32>) = tile.places().filter(|(x, y)| x % step == 0 && y % step == 0).unzip();
    Places::default().trace_first(frame, how, tracer, (&columns, &rows))?;
    let places = columns.iter().zip(&rows).map(|(x, y)| (x / step, y / step));
    let asked = tracer.samples.iter().zip(&tracer.by_chance).map(|(sample, &by_chance)| {
        let light = sample.radiance.max_element() * gain;
        Asked { light: if light.is_finite() { light } else { 0.0 }, by_chance }
    });
    Some(places.zip(asked).collect())
}

/// All samples, row by row.
struct Grid {
    columns: usize,
    rows: usize,
    each: Vec<Asked>,
}

impl Grid {
    fn of(columns: usize, rows: usize, asked: impl Iterator<Item = ((u32, u32), Asked)>) -> Self {
        let mut each = vec![Asked::NOTHING; columns * rows];
        asked.for_each(|((x, y), asked)| each[y as usize * columns + x as usize] = asked);
        Self { columns, rows, each }
    }

    /// Whether a sample is far brighter than white, and than all but a few of those beside it.
    fn is_firefly(&self, x: usize, y: usize) -> bool {
        /// Less than so many beside it are no wide thing that is seen in each of some pixels.
        const FEW: usize = 3;
        /// What is this part as bright is nearly as bright.
        const NEARLY: f32 = 0.25;
        let Asked { light, by_chance } = self.each[y * self.columns + x];
        let rows = y.saturating_sub(1)..(y + 2).min(self.rows);
        let near = rows.flat_map(|y| {
            let columns = x.saturating_sub(1)..(x + 2).min(self.columns);
            &self.each[y * self.columns..][columns]
        });
        // It is one of them itself.
        by_chance && light > 1.0 && near.filter(|other| other.light >= NEARLY * light).count() <= FEW
    }
}

impl Fireflies {
    /// Those among samples of a picture of which a tile has so many columns and rows.
    #[expect(clippy::cast_precision_loss, reason = "a mean")]
    fn among(asked: &Grid, side: usize) -> Self {
        let (columns, rows) = (asked.columns.div_ceil(side), asked.rows.div_ceil(side));
        let mut of_tiles = vec![(0.0, 0_u32); columns * rows];
        for (y, x) in (0..asked.rows).flat_map(|y| (0..asked.columns).map(move |x| (y, x))) {
            if asked.is_firefly(x, y) {
                let (sum, count) = &mut of_tiles[y / side * columns + x / side];
                *sum += f64::from(asked.each[y * asked.columns + x].light);
                *count += 1;
            }
        }
        let around = |at: usize, end: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(end);
        let brightness = (0..columns * rows).map(|i| {
            let tiles =
                around(i / columns, rows).flat_map(|row| &of_tiles[row * columns..][around(i % columns, columns)]);
            let (sum, count) = tiles.fold((0.0, 0), |(sum, count), tile| (sum + tile.0, count + tile.1));
            #[expect(clippy::cast_possible_truncation, reason = "as exact as light is")]
            let mean = (sum / f64::from(count.max(1))) as f32;
            mean
        });
        Self { columns, brightness: brightness.collect() }
    }

    /// How bright those are that a pixel may meet by chance; 0: none.
    pub(super) fn at(&self, (x, y): (u32, u32)) -> f32 {
        self.brightness[(y / TILE) as usize * self.columns + (x / TILE) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 0.1 all over, and what is put where, met by chance.
    fn grid(columns: usize, rows: usize, bright: &[(usize, usize, f32)]) -> Grid {
        let mut grid = Grid { columns, rows, each: vec![Asked { light: 0.1, by_chance: true }; columns * rows] };
        bright.iter().for_each(|&(x, y, light)| grid.each[y * columns + x].light = light);
        grid
    }

    #[test]
    fn a_firefly_is_brighter_than_white_and_than_all_but_a_few_beside_it() {
        let is = |bright: &[(usize, usize, f32)]| grid(5, 5, bright).is_firefly(2, 2);
        assert!(is(&[(2, 2, 50.0)]) && is(&[(2, 2, 50.0), (1, 1, 60.0), (3, 2, 20.0)]));
        assert!(!is(&[(2, 2, 0.9)]), "no more than white");
        assert!(!is(&[(2, 2, 50.0), (1, 1, 60.0), (3, 2, 20.0), (3, 3, 13.0)]), "a wide lamp");
        let mut straight = grid(5, 5, &[(2, 2, 50.0)]);
        straight.each[12].by_chance = false;
        assert!(!straight.is_firefly(2, 2), "a pixel sees it whenever it looks");
        let corner = grid(5, 5, &[(0, 0, 50.0), (4, 4, 50.0)]);
        assert!(corner.is_firefly(0, 0) && corner.is_firefly(4, 4));
    }

    #[test]
    fn pixels_hear_of_fireflies_in_their_tile_and_two_tiles_around_it() {
        // Seven tiles by two, of which the last ones are small; samples of one column and row of two.
        let found = Fireflies::among(&grid(97, 20, &[(8, 3, 30.0), (12, 9, 50.0), (90, 3, 4.0)]), 16);
        assert_eq!(found.columns, 7);
        let heard = [0, 31, 32, 95, 96, 127, 128, 193].map(|x| found.at((x, 0)));
        assert_eq!(heard, [40.0, 40.0, 40.0, 40.0, 4.0, 4.0, 4.0, 4.0]);
        assert_eq!(found.at((0, 39)), 40.0, "the row of tiles below");
    }
}
