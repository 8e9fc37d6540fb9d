//! Rays that start on a surface, as shadow rays do: do they hit what they start on, or slip through what is there?
//!
//! Judged from the exact place of the hit, in rational numbers: the rounded start may lie a little beside it.

use dashu::rational::RBig;
use rayon::prelude::*;

use crate::accel::any::AnyScratch;
use crate::accel::{Accel, AnyAccel, Hit, NoProbe, Ray, Shapes};
use crate::bench::oracle::{Oracle, meets_from, place};
use crate::math::bounds::offset_origin;
use crate::math::random::Random;
use crate::math::triangle;

/// A start's own error this many times over is "near": what is hit within it may be the surface itself.
const NEAR: f32 = 16.0;

/// Rays that are one thread's work at a time.
const SLICE: usize = 256;

/// Counts over spawned rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spawned {
    /// Rays.
    pub rays: usize,
    /// Rays stopped beside their start by a face that they leave, though it is not in their way, seen from the exact
    /// place of the hit.
    pub self_hits: usize,
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
    let away = Ray {
        origin: offset_origin(refined.position, refined.error, refined.normal, dir),
        t_min: 0.0,
        dir,
        t_max: f32::INFINITY,
        exclude: hit.prim,
        sample: 0,
    };
    let mut blocked = [false];
    accel.occluded(&[away], &mut blocked, scratch, &mut NoProbe);
    let truth = oracle.nearest(&away);
    let mut counts = Spawned { rays: 1, ..Spawned::default() };
    match (&truth, blocked[0]) {
        (Some(_), false) => counts.leaks = 1,
        (None, true) => counts.false_shadows = 1,
        (Some(first), true) => {
            // The exact start sees twice as far as the rounded one, which may lie behind or before it.
            let near = refined.error.max_element() * NEAR;
            let beside = first.t < f64::from(near);
            let in_the_way = || {
                let start = place(ray, &shapes.triangle(hit.prim))?;
                let end = RBig::try_from(2.0 * near).ok()?;
                Some(meets_from(&start, dir, &shapes.triangle(first.prim), &end))
            };
            // Beside an edge the ray may leave one face and run into the other: then the stop is right.
            let leaves = dir.dot(refined.normal) * dir.dot(triangle::normal(&shapes.triangle(first.prim))) > 0.0;
            counts.self_hits = usize::from(beside && leaves && in_the_way() == Some(false));
        }
        (None, false) => {}
    }
    Some(counts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::accel::{AccelKind, BitSet, GridParams};
    use crate::bench::aim::{Aim, Aimer};

    /// All counts for rays from hits of these aims on a closed mesh.
    fn counts(aims: &[Aim]) -> Spawned {
        let mut shapes = scenes::star(40, 20);
        shapes.opaque = BitSet::filled(shapes.len(), true);
        let structures = [AnyAccel::build(AccelKind::DEFAULT, &shapes, &GridParams::DEFAULT)];
        let mut aimer = Aimer::new(&shapes, 1).unwrap();
        let sets: Vec<_> = aims.iter().map(|&aim| aimer.rays(aim, 400)).collect();
        spawned(&shapes, &structures, &Oracle::new(&shapes), &sets, 1)
    }

    #[test]
    fn no_ray_from_within_a_face_of_a_closed_mesh_hits_what_it_starts_on() {
        let counts = counts(&[Aim::Random]);
        assert!(counts.rays > 100, "{counts:?}");
        assert_eq!((counts.self_hits, counts.leaks, counts.false_shadows), (0, 0, 0), "{counts:?}");
    }

    #[test]
    fn no_ray_from_anywhere_on_a_closed_mesh_leaks_or_is_stopped_by_nothing() {
        let counts = counts(&Aim::ALL);
        assert!(counts.rays > 1000, "{counts:?}");
        assert_eq!((counts.leaks, counts.false_shadows), (0, 0), "{counts:?}");
    }
}
