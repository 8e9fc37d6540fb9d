//! Adaptive sampling: five rays in a square, and smaller squares in the quadrants where they matter.
//!
//! A pixel is ¼ of the sum over its corners X of (X + E)/2, E being its middle. A quadrant that is worth it ([`judge`]) becomes a
//! square of its own, whose corners are X, E and the middles of two edges: at most three new rays, and fewer where a neighbour
//! has traced a middle. Points lie on a lattice that all pixels share, and a ray depends on nothing but its point.
//!
//! A sample on the border of two squares is shared by both, and may show the other that it has missed a detail; refinement may
//! therefore run along a whole row of pixels, one after the other. So tiles work in rounds: all tiles judge their samples, then
//! all trace the points they want next, each point by the one tile that owns it, and then pass border samples to their
//! neighbours. To bound memory, this is done for one band of tiles at a time; the samples on its lower border are handed to the
//! next band.

mod judge;
mod lattice;
mod plot;

use super::Progress;
use super::by_class::ByClass;
use super::context::Context;
use super::frame::Frame;
use super::observer::Observer;
use super::sampling::Adaptive;
use super::tile::{Tile, TilePixels};
use super::whitted::Tracer;
use crate::accel::Accel;
use judge::Judge;
use lattice::{Found, Point, Step};
use plot::Plot;
use rayon::prelude::*;
use std::sync::Mutex;

/// Minimum number of tiles in a band (the last may have fewer): enough for many threads.
const BAND: usize = 64;

/// Number of pixels in a band of a picture of this width: those whose samples are all kept at the same time.
#[cfg(feature = "cli")]
pub(crate) fn pixels_at_a_time(width: u32) -> u64 {
    use super::tile::TILE;
    let columns = u64::from(width.div_ceil(TILE)).max(1);
    u64::from(width) * (BAND as u64).div_ceil(columns) * u64::from(TILE)
}

/// Renders one tile by itself, borders included; `None` when cancelled.
pub(super) fn render<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Adaptive,
    tracer: &mut Tracer<A, P>,
    tile: Tile,
) -> Option<TilePixels> {
    let judge = Judge::new(frame, how);
    let mut plot = Plot::new(tile, how);
    loop {
        let wanted = std::mem::take(&mut plot.lattice.wanted);
        if wanted.is_empty() {
            return Some(plot.gather(frame));
        }
        plot.trace(frame, tracer, &wanted)?;
        plot.look(&judge);
    }
}

/// Renders all tiles, given row by row, and passes each finished one to `keep`; returns the counts of all threads, and whether
/// the picture is complete.
pub(super) fn render_all<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Adaptive,
    context: &Context,
    accel: &A,
    progress: &dyn Progress,
    tiles: &[Tile],
    keep: &(impl Fn(TilePixels) + Sync),
) -> (Vec<ByClass<P>>, bool) {
    let judge = Judge::new(frame, how);
    let tracer = |_| Mutex::new(Tracer::<_, P>::new(context, accel, progress));
    let tracers: Vec<_> = (0..rayon::current_num_threads()).map(tracer).collect();
    let crew = ThreadTracers { frame, tracers };
    let columns = tiles.iter().take_while(|tile| tile.y0 == tiles[0].y0).count().max(1);
    let (mut finished, mut above) = (0, Vec::new());
    for tiles_of_band in tiles.chunks(columns * BAND.div_ceil(columns)) {
        let mut band = Band::new(tiles_of_band, columns, how, &above, frame.settings.layers);
        if crew.finish(&mut band, &judge).is_none() {
            break;
        }
        above = band.lower_border();
        band.plots.par_iter().for_each(|plot| keep(plot.gather(frame)));
        finished += tiles_of_band.len();
        progress.tiles(finished, tiles.len());
    }
    let complete = finished == tiles.len();
    let counts = crew.tracers.into_iter().filter_map(|tracer| tracer.into_inner().ok()).map(|tracer| tracer.counts);
    (counts.collect(), complete)
}

/// A tracer for each thread.
struct ThreadTracers<'a, A: Accel, P> {
    frame: &'a Frame<'a>,
    tracers: Vec<Mutex<Tracer<'a, A, P>>>,
}

impl<A: Accel, P: Observer> ThreadTracers<'_, A, P> {
    /// Renders a band until no quadrant in it is worth splitting; `None` when cancelled.
    fn finish(&self, band: &mut Band, judge: &Judge) -> Option<()> {
        loop {
            let wanted = band.share();
            if wanted.iter().all(Vec::is_empty) {
                return Some(());
            }
            let work = |(plot, points): (&mut Plot, &Vec<Point>)| {
                let tracer = &self.tracers[rayon::current_thread_index().unwrap_or(0) % self.tracers.len()];
                // A thread that panicked leaves its counts behind; the tile it did not finish counts as incomplete.
                let mut tracer = tracer.lock().ok()?;
                plot.trace(self.frame, &mut tracer, points)
            };
            let each = band.plots.par_iter_mut().zip(&wanted).with_max_len(1);
            each.map(work).collect::<Option<Vec<()>>>()?;
            band.tell(&wanted, self.frame.settings.layers);
            band.plots.par_iter_mut().with_max_len(1).for_each(|plot| plot.look(judge));
        }
    }
}

/// Rows of tiles that work in rounds.
struct Band {
    plots: Vec<Plot>,
    /// Tiles in a row.
    columns: usize,
    /// Steps in a tile's side.
    side: u32,
    /// Rows of the lattice where the band begins and ends, in steps.
    rows: (u32, u32),
}

impl Band {
    fn new(tiles: &[Tile], columns: usize, how: &Adaptive, above: &[Found], layers: bool) -> Self {
        let mut plots: Vec<Plot> = tiles.par_iter().map(|&tile| Plot::new(tile, how)).collect();
        let pixel = plots[0].lattice.pixel;
        let (first, last) = (tiles[0], tiles[tiles.len() - 1]);
        for found in above {
            let along = |plot: &&mut Plot| (plot.tile.x0 * pixel..=plot.tile.x1 * pixel).contains(&found.at.0);
            plots[..columns].iter_mut().filter(along).for_each(|plot| plot.take_border_point(found, layers));
        }
        // Only the last row may be lower; the first only where it is the only one.
        let side = (first.x1 - first.x0).max(first.y1 - first.y0) * pixel;
        Self { plots, columns, side, rows: (first.y0 * pixel, last.y1 * pixel) }
    }

    /// Plots that have a point inside or on their border; the owner comes last.
    fn plots_at(&self, (x, y): Step) -> impl Iterator<Item = usize> + use<> {
        let (side, columns, top) = (self.side, self.columns, self.rows.0);
        let around = move |at: u32, plots: usize| {
            let own = (at / side) as usize;
            let before = own - usize::from(at.is_multiple_of(side) && own > 0);
            before.min(plots - 1)..own.min(plots - 1) + 1
        };
        let rows = around(y - top, self.plots.len() / columns);
        rows.flat_map(move |row| around(x, columns).map(move |column| row * columns + column))
    }

    /// Points for each plot to trace: those wanted by any plot, by owner, that have no sample yet.
    fn share(&mut self) -> Vec<Vec<Point>> {
        for i in 0..self.plots.len() {
            for point in std::mem::take(&mut self.plots[i].lattice.wanted) {
                let owner = self.plots_at(point.at).last().unwrap_or(i);
                if owner == i {
                    self.plots[i].lattice.wanted.push(point);
                } else {
                    self.plots[owner].lattice.point(point.at);
                }
            }
        }
        let unknown = |plot: &mut Plot| {
            let mut wanted = std::mem::take(&mut plot.lattice.wanted);
            wanted.retain(|point| plot.lattice.sample(point.number).is_none());
            wanted
        };
        self.plots.iter_mut().map(unknown).collect()
    }

    /// Passes the samples on the border of each plot to its neighbours.
    fn tell(&mut self, traced: &[Vec<Point>], layers: bool) {
        for (from, points) in traced.iter().enumerate() {
            let pixel = self.plots[from].lattice.pixel;
            let tile = self.plots[from].tile;
            let inside = |at: u32, start: u32, end: u32| start * pixel < at && at < end * pixel;
            for &Point { at, .. } in points {
                if inside(at.0, tile.x0, tile.x1) && inside(at.1, tile.y0, tile.y1) {
                    continue;
                }
                let Some(found) = self.plots[from].lattice.found(at) else { continue };
                for to in self.plots_at(at).filter(|&to| to != from) {
                    self.plots[to].take_border_point(&found, layers);
                }
            }
        }
    }

    /// Samples on the border to the next band.
    fn lower_border(&self) -> Vec<Found> {
        let last = &self.plots[self.plots.len() - self.columns..];
        last.iter().flat_map(|plot| plot.lattice.row(self.rows.1)).collect()
    }
}
