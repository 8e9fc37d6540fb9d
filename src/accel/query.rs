//! What is common to the queries of every structure: the ray's set-up, the unbounded planes, the order of hits.
//!
//! A structure only decides which prims a ray is tested against ([`Culling`]); tests, order and counting happen here, so
//! that no two structures can differ in them.

use super::{Accel, Hit, NO_PRIM, Probe, Ray, Shapes};
use crate::math::shear::RaySpace;
use crate::math::simd::LANES;
use crate::math::triangle;
use crate::math::triangles::Verdicts;

/// A structure: it names the prims that a ray may hit.
pub trait Culling: Sync {
    /// What a walk writes to.
    type Scratch: Send;

    /// The shapes it culls.
    fn shapes(&self) -> &Shapes;

    /// A fresh scratch value.
    fn new_scratch(&self) -> Self::Scratch;

    /// Calls [`Query::test`] at least for every bounded prim that the ray hits within [`Query::reach`].
    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, scratch: &mut Self::Scratch, probe: &mut P);
}

/// What a query looks for.
pub trait Goal {
    /// Whether a hit with `prim` would matter at all.
    fn wants(&self, _shapes: &Shapes, _prim: u32) -> bool {
        true
    }

    /// A hit within the ray's range was found.
    fn offer(&mut self, t: f32, prim: u32);

    /// Hits beyond this distance do not matter any more.
    fn reach(&self) -> f32;
}

/// One ray under way.
#[derive(Clone, Debug)]
pub struct Query<'a, G> {
    /// The ray in sheared space.
    pub ray: RaySpace,
    /// Hits count from here.
    pub t_min: f32,
    t_max: f32,
    exclude: u32,
    shapes: &'a Shapes,
    goal: G,
}

impl<'a, G: Goal> Query<'a, G> {
    /// `None` for a ray that cannot hit: zero direction, not finite, or an empty range.
    fn new(shapes: &'a Shapes, ray: &Ray, goal: G) -> Option<Self> {
        // A distance that overflows is no hit, and `<=` is false for NaN.
        let t_max = ray.t_max.min(f32::MAX);
        let space = RaySpace::new(ray.origin, ray.dir)?;
        let usable = ray.t_min <= t_max && !ray.t_max.is_nan();
        usable.then_some(Self { ray: space, t_min: ray.t_min, t_max, exclude: ray.exclude, shapes, goal })
    }

    /// Hits beyond this distance do not matter; shrinks as hits are found.
    #[inline]
    pub fn reach(&self) -> f32 {
        self.t_max.min(self.goal.reach())
    }

    /// Tests one prim and tells whether the query is answered.
    #[inline]
    pub fn test<P: Probe>(&mut self, prim: u32, probe: &mut P) -> bool {
        if prim == self.exclude || !self.goal.wants(self.shapes, prim) {
            return false;
        }
        probe.prim_test();
        for t in self.shapes.distances(prim, &self.ray, self.t_min >= 0.0) {
            if t >= self.t_min && t <= self.t_max {
                self.goal.offer(t, prim);
            }
        }
        self.reach() < self.t_min
    }

    /// Takes the verdicts of a block's first `count` lanes, decides those that are open, and tells whether the query is
    /// answered. The same hits as [`Self::test`] for each of them.
    #[inline(always)]
    pub fn test_block<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
    ) -> bool {
        probe.prim_tests(count);
        let mut open = (verdicts.hit | verdicts.unsure) & ((1 << count) - 1);
        while open != 0 {
            let lane = open.trailing_zeros() as usize % LANES;
            open &= open - 1;
            let certain = verdicts.hit >> lane & 1 == 1;
            if self.take(prims[lane], certain) {
                return true;
            }
        }
        false
    }

    /// Offers the hit with a triangle that is hit for certain, or may be.
    #[inline(never)]
    fn take(&mut self, prim: u32, certain: bool) -> bool {
        if prim == self.exclude || !self.goal.wants(self.shapes, prim) {
            return false;
        }
        let corners = self.shapes.triangle(prim);
        if certain || triangle::is_hit_near_edge(&self.ray, &corners) {
            let t = triangle::distance(&self.ray, &corners);
            if t >= self.t_min && t <= self.t_max {
                self.goal.offer(t, prim);
            }
        }
        self.reach() < self.t_min
    }

    /// What is asked about.
    pub fn shapes(&self) -> &'a Shapes {
        self.shapes
    }
}

/// The first hit.
struct Closest {
    best: (f32, u32),
}

impl Goal for Closest {
    #[inline]
    fn offer(&mut self, t: f32, prim: u32) {
        if (t, prim) < self.best {
            self.best = (t, prim);
        }
    }
    #[inline]
    fn reach(&self) -> f32 {
        self.best.0
    }
}

/// Whether anything opaque is hit.
struct Occluded {
    found: bool,
}

impl Goal for Occluded {
    #[inline]
    fn wants(&self, shapes: &Shapes, prim: u32) -> bool {
        shapes.opaque.get(prim)
    }
    #[inline]
    fn offer(&mut self, _t: f32, _prim: u32) {
        self.found = true;
    }
    #[inline]
    fn reach(&self) -> f32 {
        if self.found { f32::NEG_INFINITY } else { f32::INFINITY }
    }
}

/// The first hit after another.
struct Next {
    after: (f32, u32),
    closest: Closest,
}

impl Goal for Next {
    #[inline]
    fn offer(&mut self, t: f32, prim: u32) {
        if (t, prim) > self.after {
            self.closest.offer(t, prim);
        }
    }
    #[inline]
    fn reach(&self) -> f32 {
        self.closest.reach()
    }
}

const NOTHING: Closest = Closest { best: (f32::INFINITY, NO_PRIM) };

impl<C: Culling> Accel for C {
    type Scratch = C::Scratch;

    fn scratch(&self) -> Self::Scratch {
        self.new_scratch()
    }

    fn closest<P: Probe>(&self, rays: &[Ray], hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = answer(self, ray, NOTHING, scratch, probe).map_or(Hit::MISS, |q| finish(&q, q.goal.best));
            count_found(hit.is_some(), probe);
        }
    }

    fn occluded<P: Probe>(&self, rays: &[Ray], blocked: &mut [bool], scratch: &mut Self::Scratch, probe: &mut P) {
        for (ray, blocked) in rays.iter().zip(blocked) {
            *blocked = answer(self, ray, Occluded { found: false }, scratch, probe).is_some_and(|q| q.goal.found);
            count_found(*blocked, probe);
        }
    }

    fn next<P: Probe>(
        &self,
        rays: &[Ray],
        after: &[Hit],
        hits: &mut [Hit],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    ) {
        for ((ray, after), hit) in rays.iter().zip(after).zip(hits) {
            let rest = Ray { t_min: ray.t_min.max(after.t), ..*ray };
            let goal = Next { after: (after.t, after.prim), closest: NOTHING };
            *hit = answer(self, &rest, goal, scratch, probe).map_or(Hit::MISS, |q| finish(&q, q.goal.closest.best));
            count_found(hit.is_some(), probe);
        }
    }
}

/// Planes first, then what the structure names. `None`: the ray cannot hit.
fn answer<'a, C: Culling, G: Goal, P: Probe>(
    structure: &'a C,
    ray: &Ray,
    goal: G,
    scratch: &mut C::Scratch,
    probe: &mut P,
) -> Option<Query<'a, G>> {
    probe.query();
    let shapes = structure.shapes();
    let mut query = Query::new(shapes, ray, goal)?;
    let bounded = shapes.bounded();
    #[expect(clippy::cast_possible_truncation, reason = "prim ids are u32")]
    let answered = (0..shapes.planes.len() as u32).any(|plane| query.test(bounded + plane, probe));
    if !answered && bounded > 0 {
        structure.walk(&mut query, scratch, probe);
    }
    Some(query)
}

/// Adds the barycentric weights, which only the winner needs.
fn finish<G: Goal>(query: &Query<G>, (t, prim): (f32, u32)) -> Hit {
    if prim == NO_PRIM {
        return Hit::MISS;
    }
    let (u, v) = query.shapes.barycentrics(prim, &query.ray);
    Hit { t, u, v, prim }
}

fn count_found<P: Probe>(found: bool, probe: &mut P) {
    if found {
        probe.found();
    }
}
