//! All tiles of a picture, which share the first samples of their pixels.
//!
//! Every tile is worked on twice: its first samples are traced, and later it is finished, from these and from those of the
//! tiles around it. First samples are some tiles ahead, so that hardly any thread ever waits for another, and are forgotten when
//! all tiles around are finished.

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
    if !sampler.starts_with_one() {
        let work = |tracer: &mut Tracer<A, P>, &tile: &Tile| sampler.finish(tracer, tile, &[]).map(keep);
        let (_, counts, complete) = each_tile(context, accel, tiles, progress, work);
        return (counts, complete);
    }
    let shared = Shared::new(tiles);
    let work = |tracer: &mut Tracer<A, P>, step: &Step| match *step {
        Step::First(i) => {
            let mut promise = Promise { shared: &shared, tile: i, first: None };
            promise.first = sampler.first(tracer, std::iter::once(tiles[i]))?.pop();
            promise.first.is_some().then_some(())
        }
        Step::Finish(i) => {
            let first = shared.around(i)?;
            let first: Vec<&First> = first.iter().map(|first| &**first).collect();
            keep(sampler.finish(tracer, tiles[i], &first)?);
            shared.forget(i);
            Some(())
        }
    };
    let (_, counts, complete) = each_tile(context, accel, &shared.steps(rayon::current_num_threads()), progress, work);
    (counts, complete)
}

/// A part of the work on a tile, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Trace first samples.
    First(usize),
    /// Do all the rest.
    Finish(usize),
}

/// First samples that some tile still needs.
struct Shared {
    /// Of how many tiles.
    tiles: usize,
    /// Tiles in a row.
    columns: usize,
    first: Mutex<Vec<State>>,
    /// Some of them are there, or will never be.
    changed: Condvar,
}

/// What is known of the first samples of a tile.
enum State {
    Awaited,
    /// They are there, and so many tiles still need them.
    There(Arc<First>, usize),
    /// Nobody traces them: the user has given up.
    Never,
    /// Nobody needs them any more.
    Forgotten,
}

impl Shared {
    fn new(tiles: &[Tile]) -> Self {
        let columns = tiles.iter().take_while(|tile| tile.y0 == tiles[0].y0).count().max(1);
        let states = tiles.iter().map(|_| State::Awaited).collect();
        Self { tiles: tiles.len(), columns, first: Mutex::new(states), changed: Condvar::new() }
    }

    /// All steps, so that first samples are so many tiles ahead of what is needed next. Of what a tile needs, everything comes
    /// before it is finished: whoever waits for it waits for a thread that is working on it.
    fn steps(&self, ahead: usize) -> Vec<Step> {
        let lead = self.columns + 1 + ahead;
        let both = |step: usize| {
            let first = (step < self.tiles).then_some(Step::First(step));
            let finish = step.checked_sub(lead).map(Step::Finish);
            first.into_iter().chain(finish)
        };
        (0..self.tiles + lead).flat_map(both).collect()
    }

    /// A tile and those beside it; what is looked at around a tile reaches no farther, as only the last tiles of a row or a
    /// column are small.
    fn beside(&self, tile: usize) -> impl Iterator<Item = usize> + Clone + use<> {
        let (columns, rows) = (self.columns, self.tiles.div_ceil(self.columns));
        let (row, column) = (tile / columns, tile % columns);
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        near(row, rows).flat_map(move |row| near(column, columns).map(move |column| row * columns + column))
    }

    fn states(&self) -> MutexGuard<'_, Vec<State>> {
        // A thread that failed has told so, and every state is set at once.
        self.first.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The first samples of a tile and of those beside it, when all are there; `None` when some will never be.
    fn around(&self, tile: usize) -> Option<Vec<Arc<First>>> {
        let mut states = self.states();
        loop {
            let mut found = Vec::new();
            let mut waits = false;
            for i in self.beside(tile) {
                match &states[i] {
                    State::There(first, _) => found.push(Arc::clone(first)),
                    State::Awaited => waits = true,
                    State::Never | State::Forgotten => return None,
                }
            }
            if !waits {
                return Some(found);
            }
            states = self.changed.wait(states).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A tile is finished.
    fn forget(&self, tile: usize) {
        let mut states = self.states();
        for i in self.beside(tile) {
            if let State::There(_, needed) = &mut states[i] {
                *needed -= 1;
                if *needed == 0 {
                    states[i] = State::Forgotten;
                }
            }
        }
    }
}

/// Tells in the end, however that comes, whether the first samples of a tile are there.
struct Promise<'a> {
    shared: &'a Shared,
    tile: usize,
    first: Option<First>,
}

impl Drop for Promise<'_> {
    fn drop(&mut self) {
        let needed = self.shared.beside(self.tile).count();
        let first = self.first.take();
        let state = first.map_or(State::Never, |first| State::There(Arc::new(first), needed));
        self.shared.states()[self.tile] = state;
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_finished_after_the_first_samples_of_all_around_it() {
        for (columns, rows) in [(1, 1), (1, 7), (8, 8), (50, 3), (3, 90)] {
            let tile = |i: u32| Tile { x0: i % columns, y0: i / columns, x1: i % columns + 1, y1: i / columns + 1 };
            let tiles: Vec<Tile> = (0..columns * rows).map(tile).collect();
            let shared = Shared::new(&tiles);
            let steps = shared.steps(rows as usize);
            assert_eq!(steps.len(), 2 * tiles.len());
            let when = |step| steps.iter().position(|&other| other == step).expect("every step");
            for i in 0..tiles.len() {
                assert!(shared.beside(i).all(|other| when(Step::First(other)) < when(Step::Finish(i))));
                assert!(shared.beside(i).any(|other| other == i) && shared.beside(i).all(|other| other < tiles.len()));
            }
        }
    }
}
