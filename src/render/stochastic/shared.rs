//! Renders all tiles of a picture, which share the first samples of their pixels.
//!
//! A tile needs the first samples of some pixels around it, too. These are traced by zones, since of its neighbours a tile needs
//! no more than their borders: each zone belongs to the first tile that needs it, so that each is traced once, and all samples of
//! a tile soon after each other, while the geometry they hit is in the cache. All zones of a tile are traced together, whoever
//! does it: the sum of a sample may depend on those traced with it, where more rays wait than fit into a wave. The samples are
//! kept until all tiles that need any of them are finished.

use super::first_samples::FirstSamples;
use super::{Sampler, Stochastic};
use crate::accel::Accel;
use crate::render::Progress;
use crate::render::by_class::ByClass;
use crate::render::certainty::output;
use crate::render::context::Context;
use crate::render::frame::Frame;
use crate::render::observer::Observer;
use crate::render::tile::{Tile, TilePixels, TracedTiles, each_tile};
use crate::render::whitted::Tracer;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Renders all tiles, given row by row, and passes each finished one to `keep`; returns the counts of all threads, and whether
/// the picture is complete.
pub(in crate::render) fn render_all<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    context: &Context,
    accel: &A,
    progress: &dyn Progress,
    tiles: &[Tile],
    keep: &(impl Fn(TilePixels) + Sync),
) -> (Vec<ByClass<P>>, bool) {
    let output = output(how.space, frame.background);
    let sampler = Sampler::new(frame, how, output.as_ref(), context);
    let numbers: Vec<usize> = (0..tiles.len()).collect();
    let TracedTiles { counts, complete, .. } = if sampler.starts_with_one() {
        let shared = Shared::new(tiles, |tile| sampler.grown(tile, sampler.reach()));
        each_tile(context, accel, &numbers, progress, |tracer, &i| shared.finish(&sampler, tracer, i).map(keep))
    } else {
        each_tile(context, accel, tiles, progress, |tracer, &tile| sampler.finish(tracer, tile, &[]).map(keep))
    };
    (counts, complete)
}

/// First samples that some tile still needs.
struct Shared<'t> {
    tiles: &'t [Tile],
    /// Zones that belong to each tile.
    zones: Vec<Vec<Tile>>,
    /// For each tile, the indices of the tiles that own a zone it needs.
    needs: Vec<Vec<usize>>,
    states: Mutex<Vec<State>>,
    /// Signalled when samples are done or have failed.
    changed: Condvar,
}

/// State of the first samples of all zones that belong to a tile.
struct State {
    step: Step,
    first: Option<Arc<FirstSamples>>,
    /// Number of tiles that still need them.
    needing: usize,
}

/// Progress of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Not needed yet.
    Untouched,
    /// A thread is tracing them.
    Promised,
    /// Traced, or failed.
    Done,
}

impl<'t> Shared<'t> {
    /// Assigns the zones of tiles, given row by row; each tile needs the area that `grown` returns.
    fn new(tiles: &'t [Tile], grown: impl Fn(Tile) -> Tile) -> Self {
        let columns = tiles.iter().take_while(|tile| tile.y0 == tiles[0].y0).count().max(1);
        let grown: Vec<Tile> = tiles.iter().map(|&tile| grown(tile)).collect();
        let needing = |i: usize, part: Tile| -> Vec<usize> {
            beside(i, columns, tiles.len()).filter(|&tile| grown[tile].meets(part)).collect()
        };
        let mut zones = vec![Vec::new(); tiles.len()];
        let mut needs = vec![Vec::new(); tiles.len()];
        for (i, tile) in tiles.iter().enumerate() {
            for zone in tile.zones() {
                let needing = needing(i, zone);
                let Some(&owner) = needing.first() else { continue };
                zones[owner].push(zone);
                needing.iter().for_each(|&tile| needs[tile].push(owner));
            }
        }
        let mut states: Vec<_> =
            tiles.iter().map(|_| State { step: Step::Untouched, first: None, needing: 0 }).collect();
        for owners in &mut needs {
            owners.sort_unstable();
            owners.dedup();
            owners.iter().for_each(|&owner| states[owner].needing += 1);
        }
        Self { tiles, zones, needs, states: Mutex::new(states), changed: Condvar::new() }
    }

    /// Renders a tile by index; `None` when cancelled.
    fn finish<A: Accel, P: Observer>(
        &self,
        sampler: &Sampler,
        tracer: &mut Tracer<A, P>,
        tile: usize,
    ) -> Option<TilePixels> {
        // Other threads have mostly traced what belongs to tiles before this one.
        for &owner in &self.needs[tile] {
            if let Some(mut promise) = self.promise(owner) {
                promise.first = Some(sampler.trace_first(tracer, self.zones[owner].iter().copied())?);
            }
        }
        let first = self.wait_for(tile)?;
        let first: Vec<&FirstSamples> = first.iter().map(|first| &**first).collect();
        let done = sampler.finish(tracer, self.tiles[tile], &first)?;
        self.forget(tile);
        Some(done)
    }

    fn states(&self) -> MutexGuard<'_, Vec<State>> {
        // No code that can panic runs while states change.
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Claims the zones of a tile for the caller to trace; `None` if another thread has.
    fn promise(&self, owner: usize) -> Option<Promise<'_, 't>> {
        let step = &mut self.states()[owner].step;
        (*step == Step::Untouched).then(|| {
            *step = Step::Promised;
            Promise { shared: self, owner, first: None }
        })
    }

    /// Waits for the first samples that a tile needs; `None` when some failed. All must be promised, and no thread may wait while
    /// it holds a promise.
    fn wait_for(&self, tile: usize) -> Option<Vec<Arc<FirstSamples>>> {
        let (mut states, needs) = (self.states(), &self.needs[tile]);
        while needs.iter().any(|&owner| states[owner].step != Step::Done) {
            states = self.changed.wait(states).unwrap_or_else(PoisonError::into_inner);
        }
        needs.iter().map(|&owner| states[owner].first.clone()).collect()
    }

    /// Releases the samples that a finished tile needed.
    fn forget(&self, tile: usize) {
        let mut states = self.states();
        for &owner in &self.needs[tile] {
            let state = &mut states[owner];
            state.needing -= 1;
            if state.needing == 0 {
                state.first = None;
            }
        }
    }
}

/// Indices of a tile and its neighbours in a grid of `columns`. The area a tile needs reaches no farther: only the last tiles of
/// a row or column are small.
fn beside(tile: usize, columns: usize, tiles: usize) -> impl Iterator<Item = usize> {
    let (row, column) = (tile / columns, tile % columns);
    let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    near(row, tiles.div_ceil(columns))
        .flat_map(move |row| near(column, columns).map(move |column| row * columns + column))
}

/// Delivers first samples when dropped, even after a failure.
struct Promise<'a, 't> {
    shared: &'a Shared<'t>,
    owner: usize,
    /// Samples of all zones; `None` after a failure.
    first: Option<FirstSamples>,
}

impl Drop for Promise<'_, '_> {
    fn drop(&mut self) {
        let first = self.first.take().map(Arc::new);
        let state = &mut self.shared.states()[self.owner];
        (state.step, state.first) = (Step::Done, first);
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{AccelKind, AccelParams, AnyAccel, RayCounts};
    use crate::math::DVec3;
    use crate::render::sampling::Sampling;
    use crate::render::texture::TextureStore;
    use crate::render::tile::tiles;
    use crate::render::view::{Lens, View};
    use crate::render::{Settings, World};
    use crate::scene::{Environment, Material, MetalRough, Reflection, Scene, Sphere};
    use std::time::Duration;

    #[test]
    fn a_tile_needs_zones_that_cover_what_is_around_it_and_each_zone_belongs_to_one() {
        for (width, height) in [(1, 1), (33, 34), (96, 65), (250, 3)] {
            let (tiles, grown) = (tiles(width, height), |tile: Tile| tile.grown(width, height).grown(width, height));
            let shared = Shared::new(&tiles, grown);
            for (i, &tile) in tiles.iter().enumerate() {
                let zones = || shared.needs[i].iter().flat_map(|&owner| &shared.zones[owner]);
                assert!(
                    grown(tile).places().all(|at| zones().any(|zone| zone.contains(at))),
                    "{i} of {width}×{height}"
                );
                assert!(
                    shared.needs[i].iter().all(|&owner| owner <= i),
                    "tiles before this one, which are taken before"
                );
            }
            let mut traced: Vec<_> = shared.zones.iter().flatten().flat_map(|zone| zone.places()).collect();
            let count = traced.len();
            traced.sort_unstable();
            traced.dedup();
            assert_eq!((traced.len(), count), ((width * height) as usize, (width * height) as usize));
        }
    }

    #[test]
    fn whoever_waits_for_a_promise_that_is_not_kept_hears_of_it() {
        // Leaked, as they outlive the test with the waiting thread.
        let tiles: &'static [Tile] = tiles(70, 40).leak();
        let shared: &'static Shared = Box::leak(Box::new(Shared::new(tiles, |tile| tile.grown(70, 40))));
        let promises: Vec<_> = shared.needs[4].iter().filter_map(|&owner| shared.promise(owner)).collect();
        assert!(promises.len() > 1 && shared.promise(promises[0].owner).is_none(), "promised once");
        let (tell, heard) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let _ = tell.send(false);
            let _ = tell.send(shared.wait_for(4).is_none());
        });
        assert_eq!(heard.recv(), Ok(false), "it begins to wait");
        std::thread::sleep(Duration::from_millis(20));
        drop(promises);
        assert_eq!(heard.recv_timeout(Duration::from_secs(60)), Ok(true));
    }

    /// A glass ball with dispersion that fills the picture: each eye ray splits into more rays than fit one wave, and where waves
    /// are cut decides about the last bits of sums.
    fn prism() -> Scene {
        let glass = MetalRough {
            transmission: 1.0,
            thick: true,
            roughness: 0.0,
            metallic: 0.0,
            dispersion: 4.0,
            ..MetalRough::default()
        };
        let material = Material { reflection: Reflection::MetalRough(glass), ..Material::plain() };
        let sphere = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.5, material: 0 };
        Scene { materials: vec![material], spheres: vec![sphere], environment: Environment::Studio, ..Scene::default() }
    }

    #[test]
    fn the_order_in_which_threads_take_tiles_changes_no_bit() {
        let (scene, (width, height)) = (prism(), (130, 70));
        let how = Stochastic { error: 0.25, max_samples: 4, ..Stochastic::default() };
        let settings =
            Settings { width, height, depth: Some(4), sampling: Sampling::Stochastic(how), ..Settings::default() };
        let world = World::new(&scene);
        let accel = AnyAccel::build(AccelKind::None, &world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&scene);
        let context = Context::new(&scene, &world, &textures, &settings);
        let view = View::look_at(DVec3::new(0.3, 0.2, 4.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.3));
        let frame = Frame::new(&context, &accel, &view, &settings);
        let output = output(how.space, frame.background);
        let sampler = Sampler::new(&frame, &how, output.as_ref(), &context);
        let tiles = tiles(width, height);
        let in_order = |order: &mut dyn Iterator<Item = usize>| {
            let shared = Shared::new(&tiles, |tile| sampler.grown(tile, sampler.reach()));
            let mut tracer = Tracer::<_, RayCounts>::new(&context, &accel, &());
            let mut done: Vec<_> = order.filter_map(|i| shared.finish(&sampler, &mut tracer, i)).collect();
            done.sort_by_key(|done| (done.tile.y0, done.tile.x0));
            (done.into_iter().flat_map(|done| done.beauty).collect::<Vec<_>>(), tracer.counts)
        };
        let (forward, counts) = in_order(&mut (0..tiles.len()));
        let refracted = counts.refracted.queries / counts.primary.queries;
        assert!(forward.len() == 130 * 70 && refracted > 12, "{refracted} rays behind each");
        let (backward, _) = in_order(&mut (0..tiles.len()).rev());
        let differ = forward.iter().zip(&backward).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "pixels");
    }
}
