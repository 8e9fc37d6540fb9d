//! Rays that start on a surface, as shadow rays do: do they hit the surface itself, or slip through their surroundings?
//!
//! A ray origin in `f32` does not lie exactly on the surface. It is judged in rational arithmetic: it must lie on the side of its
//! face to which the ray leaves, and no adjacent face may stand between it and its reference point on its own face. That is the
//! hit point or, where the origin is kept away from an edge, the point that replaces it.

use dashu::rational::RBig;
use rayon::prelude::*;

use crate::accel::any::AnyScratch;
use crate::accel::refine::Refined;
use crate::accel::{Accel, AnyAccel, Hit, NoProbe, Ray, Shapes};
use crate::bench::oracle::{Oracle, place};
use crate::math::Vec3;
use crate::math::bounds::EDGE_FOLD;
use crate::math::random::Random;
use crate::math::rational::{Exact3, cross, dot, foot, hit, minus, point, sign};
use crate::math::triangle::{self, Triangle};

/// Radius of the search for adjacent faces, in multiples of the start's own error.
const BESIDE: f32 = 16.0;

/// Rays per parallel task.
const SLICE: usize = 256;

/// Counts over rays spawned on surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spawned {
    /// Number of rays.
    pub rays: usize,
    /// Occluded rays that start on the wrong side of their own face or of one that shares a corner with it.
    pub self_hits: usize,
    /// Unoccluded rays that start on the wrong side of such a face.
    pub slips: usize,
    /// Rays answered as unoccluded although exact arithmetic finds an occluder.
    pub leaks: usize,
    /// Rays answered as occluded although exact arithmetic finds no occluder.
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

/// Spawns one ray from each hit, in a random direction, and traces it through the default structure.
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
        // One random stream per slice, so that results do not depend on the number of threads.
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
    let mut occluded = [false];
    accel.occluded(&[away], &mut occluded, scratch, &mut NoProbe);
    let start = Start::new(shapes, ray, hit.prim, &refined, &away)?;
    let astray = usize::from(start.is_astray(shapes, oracle));
    let mut counts = Spawned { rays: 1, ..Spawned::default() };
    match (oracle.nearest(&away).is_some(), occluded[0]) {
        (true, false) => counts.leaks = 1,
        (false, true) => counts.false_shadows = 1,
        (true, true) => counts.self_hits = astray,
        (false, false) => counts.slips = astray,
    }
    Some(counts)
}

/// Origin of a spawned ray, and the point of its face that it stands for.
struct Start {
    /// The face, and its index.
    face: Triangle,
    prim: u32,
    /// Normal of the face, not normalised.
    up: Exact3,
    /// Exact reference point on the face, and a box in `f32` around it in which adjacent faces are searched.
    place: Exact3,
    middle: Vec3,
    reach: f32,
    /// Vectors to the origin from a corner of the face, and from the reference point.
    above: Exact3,
    way: Exact3,
    dir: Exact3,
}

impl Start {
    fn new(shapes: &Shapes, ray: &Ray, prim: u32, refined: &Refined, away: &Ray) -> Option<Self> {
        let face = shapes.triangle(prim);
        let hit = place(ray, &face)?;
        let place = if refined.start == refined.position { hit } else { foot(&point(refined.start), &face)? };
        let ([a, b, c], origin) = (face.map(point), point(away.origin));
        Some(Self {
            face,
            prim,
            up: cross(&minus(&b, &a), &minus(&c, &a)),
            middle: refined.start,
            reach: refined.error.max_element() * BESIDE,
            above: minus(&origin, &a),
            way: minus(&origin, &place),
            place,
            dir: point(away.dir),
        })
    }

    /// Whether the origin lies on the wrong side of its own face or of an adjacent one.
    fn is_astray(&self, shapes: &Shapes, oracle: &Oracle) -> bool {
        let [side, height] = [&self.dir, &self.above].map(|v| sign(&dot(&self.up, v)));
        let others = || oracle.near(self.middle, self.reach).filter(|&prim| prim != self.prim);
        side * height != side * side || others().any(|prim| self.is_behind(&shapes.triangle(prim)))
    }

    /// Whether a face that shares a corner with its own stands between the origin and its reference point. Faces folded onto its
    /// own at an angle below [`EDGE_FOLD`] do not count, nor those that do not touch it: they may be closer than any origin can
    /// resolve.
    fn is_behind(&self, other: &Triangle) -> bool {
        let between = |t: RBig| t > RBig::ZERO && t <= RBig::ONE;
        self.face.iter().any(|p| other.contains(p))
            && hit(&self.place, &self.way, other).is_some_and(between)
            && !self.is_folded(other)
    }

    /// Whether a face is folded onto that of the origin, above or below it.
    fn is_folded(&self, other: &Triangle) -> bool {
        let [normal, leaning] = [&self.face, other].map(|t| triangle::normal(t).as_dvec3());
        let narrow = normal.cross(leaning).length() < EDGE_FOLD * normal.dot(leaning).abs();
        narrow && hit(&self.place, &self.up, other).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::accel::{AccelKind, AccelParams, BitSet};
    use crate::bench::aim::{Aim, Aimer};

    /// Counts for rays from hits of every aim on a mesh.
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

    /// Closed box with right angles and corners at (±1, ±1, ±1).
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

    /// Leaves of a book, `apart` from each other at the outer edge, at distance 1 from the spine.
    fn book(apart: f32) -> Shapes {
        const LEAVES: u32 = 6;
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let corner = |i: u32| match i {
            0 => Vec3::new(0.3, 0.7, -1.0),
            1 => Vec3::new(0.3, 0.7, 1.0),
            _ => Vec3::new(1.3, 0.7 + apart * (i / 2) as f32, if i.is_multiple_of(2) { -1.0 } else { 1.0 }),
        };
        let leaf = |k: u32| [[0, 2 * k, 2 * k + 1], [0, 2 * k + 1, 1]];
        scenes::mesh((0..2 * LEAVES + 2).map(corner).collect(), (1..=LEAVES).flat_map(leaf).collect())
    }

    #[test]
    fn nor_from_between_the_leaves_of_a_book_unless_no_start_can_tell_them_apart() {
        for apart in [1.0, 0.06, 0.04, 1e-3, 1e-5] {
            let counts = counts(book(apart));
            assert!(counts.rays > 1000, "{counts:?}");
            assert_eq!(Spawned { rays: 0, ..counts }, Spawned::default(), "{apart} apart");
        }
    }

    /// Pipe along z: at its rims the concave inside meets the ends, whose edges are convex.
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
            // Inside, outside, bottom, top.
            let walls = [[0, 2], [3, 1], [1, 0], [2, 3]];
            walls.map(|[i, j]| quad([at(k, i), at(k, j), at(next, j), at(next, i)])).concat()
        };
        scenes::mesh((0..4 * SIDES).map(corner).collect(), (0..SIDES).flat_map(segment).collect())
    }

    #[test]
    fn nor_from_the_rims_of_a_pipe() {
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
