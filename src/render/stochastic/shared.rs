//! All tiles of a picture, which share the first samples of their pixels.
//!
//! A tile needs these of some pixels around it, too. Whoever needs them first traces them, and they are kept until all tiles
//! that need them are finished: so each is traced once, and all samples of a tile soon after each other, while what they meet
//! is near in memory. They are handed over by zones, since of tiles beside it a tile needs no more than their borders.

use super::first::First;
use super::{Sampler, Stochastic};
use crate::accel::Accel;
use crate::render::Progress;
use crate::render::certainty::output;
use crate::render::context::Context;
use crate::render::frame::Frame;
use crate::render::observer::Observer;
use crate::render::tile::{Tile, TilePixels, each_tile};
use crate::render::whitted::{ByClass, Tracer};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Zones of a tile.
const ZONES: usize = 9;

/// Renders all tiles, given row by row, and has each kept that is finished; the counts of all threads, and whether nothing was
/// cut short.
pub(in crate::render) fn render_all<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    (context, accel): (&Context, &A),
    progress: &dyn Progress,
    tiles: &[Tile],
    keep: &(impl Fn(TilePixels) + Sync),
) -> (Vec<ByClass<P>>, bool) {
    let output = output(how.space, frame.background);
    let sampler = Sampler::new(frame, how, output.as_ref(), context.scene.background);
    let shared = Shared::new(tiles, tiles.iter().map(|&tile| sampler.grown(tile, sampler.reach())).collect());
    let work = |tracer: &mut Tracer<A, P>, &i: &usize| {
        if !sampler.starts_with_one() {
            return sampler.finish(tracer, tiles[i], &[]).map(keep);
        }
        let needed = shared.needed(i);
        let mut promise = shared.promise(&needed);
        promise.first = sampler.first(tracer, promise.zones.iter().map(|&zone| shared.zone(zone)))?;
        drop(promise);
        let first = shared.wait_for(&needed)?;
        let first: Vec<&First> = first.iter().map(|first| &**first).collect();
        keep(sampler.finish(tracer, tiles[i], &first)?);
        shared.forget(&needed);
        Some(())
    };
    let (_, counts, complete) = each_tile(context, accel, &(0..tiles.len()).collect::<Vec<_>>(), progress, work);
    (counts, complete)
}

/// First samples that some tile still needs, by zones.
struct Shared<'t> {
    tiles: &'t [Tile],
    /// What each needs.
    grown: Vec<Tile>,
    /// Tiles in a row.
    columns: usize,
    states: Mutex<Vec<State>>,
    /// Some of them are there, or will never be.
    changed: Condvar,
}

/// What is known of the first samples of a zone.
enum State {
    /// Nobody has needed them yet.
    Untouched,
    /// Somebody traces them.
    Promised,
    /// They are there, and so many tiles still need them.
    There(Arc<First>, usize),
    /// Nobody will trace them: the user has given up.
    Never,
    /// Nobody needs them any more.
    Forgotten,
}

impl<'t> Shared<'t> {
    fn new(tiles: &'t [Tile], grown: Vec<Tile>) -> Self {
        let columns = tiles.iter().take_while(|tile| tile.y0 == tiles[0].y0).count().max(1);
        let states = (0..tiles.len() * ZONES).map(|_| State::Untouched).collect();
        Self { tiles, grown, columns, states: Mutex::new(states), changed: Condvar::new() }
    }

    fn zone(&self, zone: usize) -> Tile {
        self.tiles[zone / ZONES].zone(zone % ZONES)
    }

    /// A tile and those beside it. What a tile needs reaches no farther: only the last ones of a row or a column are small.
    fn beside(&self, tile: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = (self.columns, self.tiles.len().div_ceil(self.columns));
        let (row, column) = (tile / columns, tile % columns);
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        near(row, rows).flat_map(move |row| near(column, columns).map(move |column| row * columns + column))
    }

    /// The zones that a tile needs.
    fn needed(&self, tile: usize) -> Vec<usize> {
        let zones = self.beside(tile).flat_map(|tile| tile * ZONES..(tile + 1) * ZONES);
        zones.filter(|&zone| self.grown[tile].meets(self.zone(zone))).collect()
    }

    /// How many tiles need a zone.
    fn needing(&self, zone: usize) -> usize {
        self.beside(zone / ZONES).filter(|&tile| self.grown[tile].meets(self.zone(zone))).count()
    }

    fn states(&self) -> MutexGuard<'_, Vec<State>> {
        // Every state is set at once, so that a thread that failed leaves none half set.
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Those of these zones that nobody traces yet: the caller will.
    fn promise(&self, needed: &[usize]) -> Promise<'_, 't> {
        let mut states = self.states();
        let is_untouched = |&zone: &usize| matches!(states[zone], State::Untouched);
        let zones: Vec<usize> = needed.iter().copied().filter(is_untouched).collect();
        zones.iter().for_each(|&zone| states[zone] = State::Promised);
        Promise { shared: self, zones, first: Vec::new() }
    }

    /// The first samples of zones, all of which are promised, when they are there; `None` when some will never be. Nobody waits
    /// who has promised any.
    fn wait_for(&self, needed: &[usize]) -> Option<Vec<Arc<First>>> {
        let mut states = self.states();
        while needed.iter().any(|&zone| matches!(states[zone], State::Promised)) {
            states = self.changed.wait(states).unwrap_or_else(PoisonError::into_inner);
        }
        let first = |&zone: &usize| match &states[zone] {
            State::There(first, _) => Some(Arc::clone(first)),
            _ => None,
        };
        needed.iter().map(first).collect()
    }

    /// A tile that has needed these is finished.
    fn forget(&self, needed: &[usize]) {
        let mut states = self.states();
        for &zone in needed {
            if let State::There(_, needing) = &mut states[zone] {
                *needing -= 1;
                if *needing == 0 {
                    states[zone] = State::Forgotten;
                }
            }
        }
    }
}

/// Hands over first samples in the end, however that comes.
struct Promise<'a, 't> {
    shared: &'a Shared<'t>,
    zones: Vec<usize>,
    /// Of all of these zones, or none.
    first: Vec<First>,
}

impl Drop for Promise<'_, '_> {
    fn drop(&mut self) {
        let shared = self.shared;
        let mut first = std::mem::take(&mut self.first).into_iter();
        let mut there = |zone| first.next().map(|first| State::There(Arc::new(first), shared.needing(zone)));
        let new: Vec<State> = self.zones.iter().map(|&zone| there(zone).unwrap_or(State::Never)).collect();
        let mut states = shared.states();
        self.zones.iter().zip(new).for_each(|(&zone, state)| states[zone] = state);
        shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tiles of a picture of this size, 32 pixels wide and high, and what they need.
    fn tiles(width: u32, height: u32) -> (Vec<Tile>, Vec<Tile>) {
        let rows = (0..height).step_by(32);
        let corners = rows.flat_map(|y0| (0..width).step_by(32).map(move |x0| (x0, y0)));
        let tile = |(x0, y0)| Tile { x0, y0, x1: width.min(x0 + 32), y1: height.min(y0 + 32) };
        let tiles: Vec<Tile> = corners.map(tile).collect();
        let grown = |tile: &Tile| tile.grown(width, height).grown(width, height);
        (tiles.clone(), tiles.iter().map(grown).collect())
    }

    #[test]
    fn a_tile_needs_zones_that_cover_what_is_around_it_and_each_zone_is_traced_by_one() {
        for (width, height) in [(1, 1), (33, 34), (96, 65), (250, 3)] {
            let (tiles, grown) = tiles(width, height);
            let shared = Shared::new(&tiles, grown.clone());
            let mut traced = Vec::new();
            for (i, grown) in grown.iter().enumerate() {
                let needed = shared.needed(i);
                assert!(needed.iter().all(|&zone| shared.needing(zone) > 0));
                let promise = shared.promise(&needed);
                traced.extend(promise.zones.iter().flat_map(|&zone| shared.zone(zone).places()));
                let covered = |at| needed.iter().any(|&zone| shared.zone(zone).contains(at));
                assert!(grown.places().all(covered), "{i} of {width}×{height}");
            }
            traced.sort_unstable();
            traced.dedup();
            assert_eq!(traced.len(), (width * height) as usize);
            assert!(shared.states().iter().all(|state| !matches!(state, State::Promised)), "nobody has kept a promise");
            assert!(shared.wait_for(&shared.needed(0)).is_none());
        }
    }
}
