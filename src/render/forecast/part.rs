//! A sample of a picture: small squares of its pixels, spread evenly.

use crate::accel::RayCounts;
use crate::image::{Developer, Picture};
use crate::math::Vec3;
use crate::render::by_class::ByClass;
use crate::render::certainty::output;
use crate::render::context::Context;
use crate::render::observer::Observer;
use crate::render::sampling::{ErrorSpace, Sampling};
use crate::render::tile::{Alone, TILE, Tile, TilePixels, render_some};
use crate::render::{Job, Progress, Settings};
use crate::scene::Background;
use std::collections::BTreeSet;
use std::time::Duration;

/// Columns and rows of a square.
pub(in crate::render) const SIDE: u32 = 8;

/// One square in so many is rendered.
const ONE_IN: usize = 100;

/// Minimum number of squares: estimates from them are correct within about a tenth.
const LEAST: usize = 128;

/// Squares for a picture of this size: all of them where it is small.
pub(in crate::render) fn squares(width: u32, height: u32) -> Vec<Tile> {
    let (columns, rows) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
    let all = columns as usize * rows as usize;
    let wanted = (all / ONE_IN).max(LEAST);
    let square = |(column, row): (u32, u32)| {
        let (x0, y0) = (column * SIDE, row * SIDE);
        Tile { x0, y0, x1: (x0 + SIDE).min(width), y1: (y0 + SIDE).min(height) }
    };
    let mut chosen = BTreeSet::new();
    if wanted * 2 >= all {
        chosen.extend((0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))));
    }
    let mut next = 0;
    while chosen.len() < wanted.min(all) {
        chosen.insert(spread(next, columns, rows));
        next += 1;
    }
    chosen.into_iter().map(square).collect()
}

/// The `k`th cell of a low-discrepancy sequence (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of a number of cells")]
fn spread(k: u32, columns: u32, rows: u32) -> (u32, u32) {
    let at = |step: f64, cells: u32| {
        let part = (0.5 + f64::from(k) * step).fract();
        ((part * f64::from(cells)) as u32).min(cells.saturating_sub(1))
    };
    (at(0.754_877_666_246_692_8, columns), at(0.569_840_290_998_053_2, rows))
}

/// Renderings of the squares of a picture, in order.
pub(in crate::render) struct Part<P> {
    pub squares: Vec<TilePixels>,
    /// Processor time of each.
    pub spent: Vec<Duration>,
    /// Counts of each.
    pub counts: Vec<ByClass<P>>,
}

impl<P: Observer> Part<P> {
    /// Renders the squares in a context that was made for these settings except their seed; `None` when cancelled.
    pub(in crate::render) fn render(
        job: &Job,
        context: &Context,
        settings: &Settings,
        squares: &[Tile],
        progress: &dyn Progress,
    ) -> Option<Self> {
        let context = context.resampled(settings);
        let (mut finished, complete) = render_some(&context, job.accel, job.view, settings, &Quiet(progress), squares);
        // Threads finish squares in any order; sums over them need a fixed one.
        finished.sort_by_key(|Alone { pixels, .. }| (pixels.tile.x0, pixels.tile.y0));
        let mut part = Self { squares: Vec::new(), spent: Vec::new(), counts: Vec::new() };
        for Alone { pixels, spent, counts } in finished {
            part.squares.push(pixels);
            part.spent.push(spent);
            part.counts.push(counts);
        }
        complete.then_some(part)
    }

    fn pixels(&self) -> usize {
        self.squares.iter().map(|square| square.beauty.len()).sum()
    }

    /// Number of eye rays that a square would take as a part of whole tiles. A square has more surrounding pixels, for its size,
    /// than a tile, and a tile does not trace the first rays through these.
    pub(in crate::render) fn rays_in_tiles(&self, square: usize) -> f64 {
        let square = &self.squares[square];
        let around = square.rays_around as f64 * (1.0 - f64::from(SIDE) / f64::from(TILE));
        (square.rays - square.rays_beyond) as f64 - around
    }

    /// Processor time that a square would take as a part of whole tiles.
    pub(in crate::render) fn seconds_in_tiles(&self, square: usize) -> f64 {
        self.spent[square].as_secs_f64() * self.kept_in_tiles(square)
    }

    /// Fraction of a square's rays that it would take as a part of whole tiles.
    fn kept_in_tiles(&self, square: usize) -> f64 {
        self.rays_in_tiles(square) / self.squares[square].rays.max(1) as f64
    }

    /// Processor time of all squares.
    pub(in crate::render) fn seconds(&self) -> f64 {
        self.spent.iter().map(Duration::as_secs_f64).sum()
    }

    /// Mean processor time of a pixel as a part of whole tiles.
    pub(in crate::render) fn seconds_per_pixel(&self) -> f64 {
        let seconds: f64 = (0..self.squares.len()).map(|i| self.seconds_in_tiles(i)).sum();
        seconds / self.pixels().max(1) as f64
    }

    /// Mean number of samples of a pixel.
    #[expect(clippy::cast_precision_loss, reason = "counts of rays")]
    pub(in crate::render) fn samples_per_pixel(&self) -> f64 {
        let samples =
            self.squares.iter().flat_map(|square| &square.facts).map(|facts| u64::from(facts.count)).sum::<u64>();
        samples as f64 / self.pixels().max(1) as f64
    }

    /// Number of eye rays.
    pub(in crate::render) fn rays(&self) -> u64 {
        self.squares.iter().map(|square| square.rays).sum()
    }
}

impl Part<RayCounts> {
    /// Number of ray/prim tests of a square.
    fn tests(&self, square: usize) -> u64 {
        let ByClass { primary, shadow, reflected, refracted } = &self.counts[square];
        [primary, shadow, reflected, refracted].map(|counts| counts.n_it).into_iter().sum()
    }

    /// Number of tests that a square would take as a part of whole tiles.
    pub(in crate::render) fn tests_in_tiles(&self, square: usize) -> f64 {
        self.tests(square) as f64 * self.kept_in_tiles(square)
    }

    /// Mean number of tests of an eye ray and all rays it causes.
    pub(in crate::render) fn tests_per_ray(&self) -> f64 {
        let tests: u64 = (0..self.squares.len()).map(|i| self.tests(i)).sum();
        tests as f64 / self.rays().max(1) as f64
    }
}

/// Squared error of one of two renderings that differ by noise only, for each square: the sum over its pixels, and their number.
pub(in crate::render) fn squared_errors<P, Q>(measure: &Measure, a: &Part<P>, b: &Part<Q>) -> Vec<(f64, f64)> {
    let of_square = |(a, b): (&TilePixels, &TilePixels)| {
        let pixels = a.beauty.len() as f64;
        (0.5 * measure.mean_square(a.into(), b.into()) * pixels, pixels)
    };
    a.squares.iter().zip(&b.squares).map(of_square).collect()
}

/// Measure of the errors of a picture.
pub(in crate::render) struct Measure {
    output: Option<crate::image::Output>,
    background: Option<Vec3>,
    /// 3, or 4 with coverage where the picture has no background.
    channels: usize,
}

impl Measure {
    /// Measure of a job: that of its stochastic sampling, else of the displayed picture.
    pub(in crate::render) fn of(job: &Job) -> Self {
        let space = match job.settings.sampling {
            Sampling::Stochastic(how) => how.space,
            _ => ErrorSpace::default(),
        };
        let background = job.scene.background.and_then(Background::color);
        let transparent = matches!(job.scene.background, None | Some(Background::Transparent));
        Self { output: output(space, background), background, channels: if transparent { 4 } else { 3 } }
    }

    /// Mean over pixels and channels of the squared difference of two pictures.
    pub(in crate::render) fn mean_square(&self, a: Shown, b: Shown) -> f64 {
        let developer = self.output.as_ref().map(Developer::new);
        let behind = self.background.unwrap_or(Vec3::ZERO).extend(1.0).to_array();
        let written = |shown: Shown, at: usize| {
            let (pixel, veil) = (shown.beauty[at], shown.veil.get(at));
            match (&developer, veil) {
                (Some(developer), None) => developer.coded(pixel),
                (Some(developer), Some(&veil)) => developer.coded_through_glass(pixel, veil),
                (None, _) if self.background.is_some() => {
                    let [x, y, z, _] = veil.copied().unwrap_or_default();
                    let veil = [x, y, z, 0.0];
                    [0, 1, 2, 3].map(|c: usize| pixel[c] + behind[c] * (1.0 - pixel[3]) + veil[c])
                }
                (None, _) => pixel,
            }
        };
        let square = |at| {
            let (a, b) = (written(a, at), written(b, at));
            (0..self.channels).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>()
        };
        let pixels = a.beauty.len().min(b.beauty.len());
        (0..pixels).map(square).sum::<f64>() / (pixels * self.channels).max(1) as f64
    }
}

/// Shown pixels: [`Picture::beauty`], and [`Picture::veil`] where there is any.
#[derive(Clone, Copy)]
pub(in crate::render) struct Shown<'a> {
    pub beauty: &'a [[f32; 4]],
    pub veil: &'a [[f32; 4]],
}

impl<'a> From<&'a Picture> for Shown<'a> {
    fn from(picture: &'a Picture) -> Self {
        Self { beauty: &picture.beauty, veil: &picture.veil }
    }
}

impl<'a> From<&'a TilePixels> for Shown<'a> {
    fn from(pixels: &'a TilePixels) -> Self {
        Self { beauty: &pixels.beauty, veil: &pixels.veil }
    }
}

/// Forwards cancellation, and reports no more than that there is work ahead of the picture.
pub(in crate::render) struct Quiet<'a>(pub &'a dyn Progress);

impl Progress for Quiet<'_> {
    fn tiles(&self, _done: usize, _total: usize) {
        self.0.plans();
    }

    fn plans(&self) {
        self.0.plans();
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ToneMap, srgb};

    #[test]
    fn what_comes_through_glass_is_a_part_of_what_differs() {
        let background = Vec3::splat(0.5);
        let (beauty, veils) =
            (vec![[0.0, 0.0, 0.0, 0.75]; 4], [[0.25, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]].map(|veil| vec![veil; 4]));
        for space in [ErrorSpace::Display { tone_map: ToneMap::default(), exposure: 0.0 }, ErrorSpace::Linear] {
            let output = output(space, Some(background));
            let measure = Measure { output, background: Some(background), channels: 3 };
            let [a, b] = [0, 1].map(|i| Shown { beauty: &beauty, veil: &veils[i] });
            let red = |veil: f64| if measure.output.is_some() { srgb::encode(0.125 + veil) } else { 0.125 + veil };
            let expected = (red(0.25) - red(0.0)).powi(2) / 3.0;
            assert!((measure.mean_square(a, b) - expected).abs() < 1e-4 * expected, "{}", measure.output.is_some());
            assert_eq!(measure.mean_square(a, a), 0.0);
        }
    }

    #[test]
    fn squares_are_a_hundredth_of_a_large_picture_and_all_of_a_small_one() {
        let pixels = |width, height| {
            let squares = squares(width, height);
            squares.iter().map(|s| (s.x1 - s.x0) * (s.y1 - s.y0)).sum::<u32>()
        };
        assert_eq!(pixels(4000, 3000), 1875 * 64);
        assert_eq!(pixels(100, 100), 100 * 100);
        assert_eq!(pixels(1, 1), 1);
        assert_eq!(squares(800, 600).len(), 128);
    }

    #[test]
    fn squares_lie_everywhere_and_none_twice() {
        let squares = squares(1024, 768);
        let mut corners: Vec<_> = squares.iter().map(|s| (s.x0, s.y0)).collect();
        corners.dedup();
        assert_eq!(corners.len(), 128);
        for (x, y) in [(0, 0), (512, 0), (0, 384), (512, 384)] {
            let here = corners.iter().filter(|c| c.0 / 512 * 512 == x && c.1 / 384 * 384 == y).count();
            assert!((26..=38).contains(&here), "{here} at {x} {y}");
        }
    }
}
