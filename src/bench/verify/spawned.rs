//! Rays that start on a surface, as shadow rays do: do they hit what they start on, or slip through what is there?
//!
//! Judged in rational numbers from the exact place of the hit, and where the start keeps away from an edge from the place
//! of the face that it keeps to: beside a corner where faces both rise and fall away these two do not see the same, and
//! what either sees is right. The rounded start itself may lie a little beside both.

use dashu::rational::RBig;
use rayon::prelude::*;

use crate::accel::any::AnyScratch;
use crate::accel::refine::Refined;
use crate::accel::{Accel, AnyAccel, Hit, NoProbe, Ray, Shapes};
use crate::bench::oracle::{Oracle, meets_from, place};
use crate::math::Vec3;
use crate::math::random::Random;
use crate::math::rational::{Exact3, foot, point};

/// A start's own error this many times over is beside it: what is hit within it may be the surface itself.
const BESIDE: f32 = 16.0;

/// Rays that are one thread's work at a time.
const SLICE: usize = 256;

/// Counts over spawned rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spawned {
    /// Rays.
    pub rays: usize,
    /// Rays stopped beside their start by a face that shares a corner with the one they start on, though nothing there
    /// is in their way, seen from any exact place.
    pub self_hits: usize,
    /// Rays that are free though, seen from each exact place, a face that shares a corner with the one they start on is
    /// in their way beside it.
    pub slips: usize,
    /// Rays that were answered as free though exact arithmetic finds something in their way.
    pub leaks: usize,
    /// Rays answered as blocked though exact arithmetic finds nothing in their way.
    pub false_shadows: usize,
}

impl Spawned {
    fn join(self, o: Self) -> Self {
        Self {
            rays: self.rays + o.rays,
            self_hits: self.self_hits + o.self_hits,
            slips: self.slips + o.slips,
            leaks: self.leaks + o.leaks,
            false_shadows: self.false_shadows + o.false_shadows,
        }
    }
}

/// One ray from each hit, towards a random side, through the default structure.
pub(super) fn spawned(
    shapes: &Shapes,
    structures: &[AnyAccel],
    oracle: &Oracle,
    sets: &[Vec<Ray>],
    seed: u64,
) -> Spawned {
    let Some(accel) = structures.iter().find(|a| a.kind() == crate::accel::AccelKind::DEFAULT) else {
        return Spawned::default();
    };
    let slice = |(number, rays): (usize, &[&Ray])| {
        // One stream for each slice, so that threads do not show.
        let mut random = Random::new(seed ^ (number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut scratch = accel.scratch();
        let each = rays.iter().filter_map(|ray| spawn(shapes, accel, oracle, ray, &mut random, &mut scratch));
        each.fold(Spawned::default(), Spawned::join)
    };
    let rays: Vec<&Ray> = sets.iter().flatten().collect();
    rays.par_chunks(SLICE).enumerate().map(slice).reduce(Spawned::default, Spawned::join)
}

fn spawn(
    shapes: &Shapes,
    accel: &AnyAccel,
    oracle: &Oracle,
    ray: &Ray,
    random: &mut Random,
    scratch: &mut AnyScratch,
) -> Option<Spawned> {
    let mut hit = [Hit::MISS];
    accel.closest(&[*ray], &mut hit, scratch, &mut NoProbe);
    let hit = hit.first().filter(|h| h.is_some())?;
    let refined = shapes.refine(ray, hit);
    let dir = random.direction();
    let away = Ray { origin: refined.origin(dir), t_min: 0.0, dir, t_max: f32::INFINITY, exclude: hit.prim, sample: 0 };
    let mut blocked = [false];
    accel.occluded(&[away], &mut blocked, scratch, &mut NoProbe);
    let beside = Beside::new(shapes, ray, hit.prim, &refined, dir)?;
    let mut counts = Spawned { rays: 1, ..Spawned::default() };
    match (oracle.nearest(&away), blocked[0]) {
        (Some(_), false) => counts.leaks = 1,
        (None, true) => counts.false_shadows = 1,
        (Some(first), true) => {
            let near = first.t < f64::from(beside.reach) && joined(shapes, first.prim, hit.prim);
            counts.self_hits = usize::from(near && beside.is_free(shapes, oracle));
        }
        (None, false) => counts.slips = usize::from(beside.is_blocked(shapes, oracle)),
    }
    Some(counts)
}

/// Whether two triangles have a corner in common. Others may stand closer to each other than any start can tell.
fn joined(shapes: &Shapes, a: u32, b: u32) -> bool {
    let (a, b) = (shapes.triangle(a), shapes.triangle(b));
    a.iter().any(|p| b.contains(p))
}

/// The first steps of a ray from the exact places of a hit.
struct Beside {
    /// The face it starts on.
    source: u32,
    /// Where the face was hit, and where on it the start was moved to, if it was.
    places: Vec<Exact3>,
    /// The first of them, rounded.
    middle: Vec3,
    dir: Vec3,
    /// As far as what is beside the start may be from it.
    reach: f32,
    end: RBig,
}

impl Beside {
    /// `dir` is of unit length.
    fn new(shapes: &Shapes, ray: &Ray, source: u32, refined: &Refined, dir: Vec3) -> Option<Self> {
        let face = shapes.triangle(source);
        let mut places = vec![place(ray, &face)?];
        if refined.start != refined.position {
            places.push(foot(&point(refined.start), &face)?);
        }
        let reach = refined.error.max_element() * BESIDE + 2.0 * refined.start.distance(refined.position);
        Some(Self { source, places, middle: refined.position, dir, reach, end: RBig::try_from(2.0 * reach).ok()? })
    }

    /// Whether nothing is in the way, from each place. What a place touches may be in the way or not.
    fn is_free(&self, shapes: &Shapes, oracle: &Oracle) -> bool {
        let meets = |place, prim| self.meets(place, shapes, prim).is_some();
        self.places.iter().all(|place| !self.others(oracle).any(|prim| meets(place, prim)))
    }

    /// Whether a face that has a corner in common with that of the start is in the way, from each place.
    fn is_blocked(&self, shapes: &Shapes, oracle: &Oracle) -> bool {
        let blocks = |place, prim| {
            joined(shapes, prim, self.source) && self.meets(place, shapes, prim).is_some_and(|t| !t.is_zero())
        };
        self.places.iter().all(|place| self.others(oracle).any(|prim| blocks(place, prim)))
    }

    /// The faces that are near, but for that of the start.
    fn others(&self, oracle: &Oracle) -> impl Iterator<Item = u32> {
        let source = self.source;
        oracle.near(self.middle, self.reach).filter(move |&prim| prim != source)
    }

    /// Where the ray from a place meets a face.
    fn meets(&self, place: &Exact3, shapes: &Shapes, prim: u32) -> Option<RBig> {
        meets_from(place, self.dir, &shapes.triangle(prim), &self.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::accel::{AccelKind, AccelParams, BitSet};
    use crate::bench::aim::{Aim, Aimer};

    /// All counts for rays from hits of every aim on a closed mesh.
    fn counts(shapes: Shapes) -> Spawned {
        counts_of(shapes, 400)
    }

    fn counts_of(mut shapes: Shapes, rays: usize) -> Spawned {
        shapes.opaque = BitSet::filled(shapes.len(), true);
        let structures = [AnyAccel::build(AccelKind::DEFAULT, &shapes, &AccelParams::DEFAULT)];
        let mut aimer = Aimer::new(&shapes, 1).unwrap();
        let sets: Vec<_> = Aim::ALL.iter().map(|&aim| aimer.rays(aim, rays)).collect();
        spawned(&shapes, &structures, &Oracle::new(&shapes), &sets, 1)
    }

    #[test]
    fn no_ray_from_anywhere_on_a_closed_mesh_hits_what_it_starts_on_or_slips_past_what_is_beside_it() {
        let shapes = scenes::star(40, 20);
        let counts = counts(shapes);
        assert!(counts.rays > 1000, "{counts:?}");
        assert_eq!(Spawned { rays: 0, ..counts }, Spawned::default());
    }

    /// A closed box with right angles, corners at (±1, ±1, ±1).
    fn room() -> Shapes {
        let corner = |i: u32| Vec3::from([0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 }));
        let side = |a: u32, b: u32, c: u32, d: u32| [[a, b, c], [a, c, d]];
        let sides = [
            side(0, 2, 3, 1),
            side(4, 5, 7, 6),
            side(0, 1, 5, 4),
            side(2, 6, 7, 3),
            side(0, 4, 6, 2),
            side(1, 3, 7, 5),
        ];
        scenes::mesh((0..8).map(corner).collect(), sides.concat())
    }

    /// A pipe along z: at its rims the inside, where faces rise from each other, meets the ends, where they fall away.
    fn pipe() -> Shapes {
        const SIDES: u32 = 32;
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let corner = |i: u32| {
            let angle = std::f32::consts::TAU * (i / 4) as f32 / SIDES as f32;
            let radius = if i & 1 == 0 { 7.0 } else { 13.0 };
            Vec3::new(radius * angle.cos(), radius * angle.sin(), if i & 2 == 0 { -4.0 } else { 4.0 })
        };
        let quad = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
        let segment = |k: u32| {
            let next = (k + 1) % SIDES;
            let at = |k: u32, i: u32| 4 * k + i;
            // Inside, outside, below, above.
            let walls = [[0, 2], [3, 1], [1, 0], [2, 3]];
            walls.map(|[i, j]| quad([at(k, i), at(k, j), at(next, j), at(next, i)])).concat()
        };
        scenes::mesh((0..4 * SIDES).map(corner).collect(), (0..SIDES).flat_map(segment).collect())
    }

    #[test]
    fn a_start_that_keeps_away_from_a_corner_sees_what_its_own_place_sees() {
        let counts = counts_of(pipe(), 4000);
        assert!(counts.rays > 10_000, "{counts:?}");
        assert_eq!(Spawned { rays: 0, ..counts }, Spawned::default());
    }

    #[test]
    fn no_ray_from_the_edges_of_a_box_does_either() {
        let counts = counts(room());
        assert!(counts.rays > 1000, "{counts:?}");
        assert_eq!(Spawned { rays: 0, ..counts }, Spawned::default());
    }
}
