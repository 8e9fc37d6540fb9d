//! What is common to the queries of every structure: the ray's set-up, the unbounded planes, the order of hits.
//!
//! A structure only decides which prims a ray is tested against ([`Culling`]); tests, order and counting happen here, so
//! that no two structures can differ in them.

use super::intersector::{Exact, Intersector};
use super::probe::{Outcome, Test};
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

/// What a query looks for, and with which test.
pub trait Goal {
    /// The test of triangles.
    type Test: Intersector;

    /// Whether a hit with `prim` would matter at all.
    fn wants(&self, _shapes: &Shapes, _prim: u32) -> bool {
        true
    }

    /// A hit within the ray's range was found; what that means.
    fn offer(&mut self, t: f32, prim: u32) -> Outcome;

    /// Hits beyond this distance do not matter any more.
    fn reach(&self) -> f32;

    /// The test itself.
    fn test(&self) -> Self::Test;
}

/// One ray under way.
#[derive(Clone, Debug)]
pub struct Query<'a, G: Goal> {
    /// The ray in sheared space.
    pub ray: RaySpace,
    /// Hits count from here.
    pub t_min: f32,
    t_max: f32,
    exclude: u32,
    shapes: &'a Shapes,
    prepared: <G::Test as Intersector>::Prepared,
    goal: G,
}

impl<'a, G: Goal> Query<'a, G> {
    /// `None` for a ray that cannot hit: zero direction, not finite, or an empty range.
    fn new(shapes: &'a Shapes, ray: &Ray, goal: G) -> Option<Self> {
        // A distance that overflows is no hit, and `<=` is false for NaN.
        let t_max = ray.t_max.min(f32::MAX);
        let space = RaySpace::new(ray.origin, ray.dir)?;
        let usable = ray.t_min <= t_max && !ray.t_max.is_nan();
        let prepared = goal.test().prepare(&space);
        usable.then_some(Self { ray: space, t_min: ray.t_min, t_max, exclude: ray.exclude, shapes, prepared, goal })
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
        match self.shapes.triangles.get(prim as usize) {
            Some(&corners) => match G::Test::distance(&self.prepared, &self.ray, &self.shapes.corners(corners)) {
                Some(t) => {
                    let outcome = self.offer(t, prim);
                    probe.tested(|| Test { prim, t, outcome });
                }
                None => probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::Miss }),
            },
            None => {
                let [a, b] = self.shapes.other_distances(prim, &self.ray, self.t_min >= 0.0);
                let outcomes = [self.offer(a, prim), self.offer(b, prim)];
                probe.tested(|| {
                    let (t, outcome) = if outcomes[1] > outcomes[0] { (b, outcomes[1]) } else { (a, outcomes[0]) };
                    Test { prim, t, outcome }
                });
            }
        }
        self.reach() < self.t_min
    }

    /// Hands on a hit within the range; a NaN is none.
    #[inline]
    fn offer(&mut self, t: f32, prim: u32) -> Outcome {
        if t >= self.t_min && t <= self.t_max {
            self.goal.offer(t, prim)
        } else if t.is_nan() {
            Outcome::Miss
        } else {
            Outcome::OutOfRange
        }
    }

    /// Takes the verdicts of a block's first `count` lanes, decides those that are open, and tells whether the query is
    /// answered. The same hits as [`Self::test`] for each of them, if the test is exact.
    #[inline(always)]
    pub fn test_block<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
    ) -> bool {
        probe.prim_tests(count);
        let all = (1 << count) - 1;
        let mut open = (verdicts.hit | verdicts.unsure) & all;
        probe.lanes_tested(prims, all & !open, Outcome::Miss);
        while open != 0 {
            let lane = open.trailing_zeros() as usize % LANES;
            open &= open - 1;
            let certain = verdicts.hit >> lane & 1 == 1;
            if self.take(prims[lane], certain, probe) {
                probe.lanes_tested(prims, open, Outcome::LeftOut);
                return true;
            }
        }
        false
    }

    /// Offers the hit with a triangle that is hit for certain, or may be.
    #[inline(never)]
    fn take<P: Probe>(&mut self, prim: u32, certain: bool, probe: &mut P) -> bool {
        if prim == self.exclude || !self.goal.wants(self.shapes, prim) {
            probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::LeftOut });
            return false;
        }
        let corners = self.shapes.triangle(prim);
        if certain || triangle::is_hit_near_edge(&self.ray, &corners) {
            let t = triangle::distance(&self.ray, &corners);
            let outcome = self.offer(t, prim);
            probe.tested(|| Test { prim, t, outcome });
        } else {
            probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::Miss });
        }
        self.reach() < self.t_min
    }

    /// What is asked about.
    pub fn shapes(&self) -> &'a Shapes {
        self.shapes
    }
}

/// The first hit.
struct Closest<I> {
    best: (f32, u32),
    test: I,
}

impl<I: Intersector> Goal for Closest<I> {
    type Test = I;

    #[inline]
    fn offer(&mut self, t: f32, prim: u32) -> Outcome {
        if (t, prim) < self.best {
            self.best = (t, prim);
            return Outcome::Hit;
        }
        Outcome::Farther
    }
    #[inline]
    fn reach(&self) -> f32 {
        self.best.0
    }
    #[inline]
    fn test(&self) -> I {
        self.test
    }
}

/// Whether anything opaque is hit.
struct Occluded<I> {
    found: bool,
    test: I,
}

impl<I: Intersector> Goal for Occluded<I> {
    type Test = I;

    #[inline]
    fn wants(&self, shapes: &Shapes, prim: u32) -> bool {
        shapes.opaque.get(prim)
    }
    #[inline]
    fn offer(&mut self, _t: f32, _prim: u32) -> Outcome {
        self.found = true;
        Outcome::Hit
    }
    #[inline]
    fn reach(&self) -> f32 {
        if self.found { f32::NEG_INFINITY } else { f32::INFINITY }
    }
    #[inline]
    fn test(&self) -> I {
        self.test
    }
}

/// The first hit after another.
struct Next<I> {
    after: (f32, u32),
    closest: Closest<I>,
}

impl<I: Intersector> Goal for Next<I> {
    type Test = I;

    #[inline]
    fn offer(&mut self, t: f32, prim: u32) -> Outcome {
        if (t, prim) > self.after { self.closest.offer(t, prim) } else { Outcome::OutOfRange }
    }
    #[inline]
    fn reach(&self) -> f32 {
        self.closest.reach()
    }
    #[inline]
    fn test(&self) -> I {
        self.closest.test
    }
}

impl<I> Closest<I> {
    fn nothing(test: I) -> Self {
        Self { best: (f32::INFINITY, NO_PRIM), test }
    }
}

impl<C: Culling> Accel for C {
    type Scratch = C::Scratch;

    fn scratch(&self) -> Self::Scratch {
        self.new_scratch()
    }

    fn closest<P: Probe>(&self, rays: &[Ray], hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        closest(Exact, self, rays, hits, scratch, probe);
    }

    fn occluded<P: Probe>(&self, rays: &[Ray], blocked: &mut [bool], scratch: &mut Self::Scratch, probe: &mut P) {
        occluded(Exact, self, rays, blocked, scratch, probe);
    }

    fn next<P: Probe>(
        &self,
        rays: &[Ray],
        after: &[Hit],
        hits: &mut [Hit],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    ) {
        next(Exact, self, rays, after, hits, scratch, probe);
    }
}

/// A structure whose triangles are tested by `I` instead of exactly.
#[derive(Clone, Copy, Debug)]
pub struct Tested<'a, I, C> {
    structure: &'a C,
    test: I,
}

impl<'a, I: Intersector, C: Culling> Tested<'a, I, C> {
    /// The same structure with another test.
    pub fn new(structure: &'a C, test: I) -> Self {
        Self { structure, test }
    }
}

impl<I: Intersector, C: Culling> Accel for Tested<'_, I, C> {
    type Scratch = C::Scratch;

    fn scratch(&self) -> Self::Scratch {
        self.structure.new_scratch()
    }

    fn closest<P: Probe>(&self, rays: &[Ray], hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        closest(self.test, self.structure, rays, hits, scratch, probe);
    }

    fn occluded<P: Probe>(&self, rays: &[Ray], blocked: &mut [bool], scratch: &mut Self::Scratch, probe: &mut P) {
        occluded(self.test, self.structure, rays, blocked, scratch, probe);
    }

    fn next<P: Probe>(
        &self,
        rays: &[Ray],
        after: &[Hit],
        hits: &mut [Hit],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    ) {
        next(self.test, self.structure, rays, after, hits, scratch, probe);
    }
}

fn closest<I: Intersector, C: Culling, P: Probe>(
    test: I,
    structure: &C,
    rays: &[Ray],
    hits: &mut [Hit],
    scratch: &mut C::Scratch,
    probe: &mut P,
) {
    for (ray, hit) in rays.iter().zip(hits) {
        let query = answer(structure, ray, Closest::nothing(test), scratch, probe);
        *hit = query.map_or(Hit::MISS, |q| finish(&q, q.goal.best));
        count_found(hit.is_some(), probe);
    }
}

fn occluded<I: Intersector, C: Culling, P: Probe>(
    test: I,
    structure: &C,
    rays: &[Ray],
    blocked: &mut [bool],
    scratch: &mut C::Scratch,
    probe: &mut P,
) {
    for (ray, blocked) in rays.iter().zip(blocked) {
        let goal = Occluded { found: false, test };
        *blocked = answer(structure, ray, goal, scratch, probe).is_some_and(|q| q.goal.found);
        count_found(*blocked, probe);
    }
}

fn next<I: Intersector, C: Culling, P: Probe>(
    test: I,
    structure: &C,
    rays: &[Ray],
    after: &[Hit],
    hits: &mut [Hit],
    scratch: &mut C::Scratch,
    probe: &mut P,
) {
    for ((ray, after), hit) in rays.iter().zip(after).zip(hits) {
        let rest = Ray { t_min: ray.t_min.max(after.t), ..*ray };
        let goal = Next { after: (after.t, after.prim), closest: Closest::nothing(test) };
        let query = answer(structure, &rest, goal, scratch, probe);
        *hit = query.map_or(Hit::MISS, |q| finish(&q, q.goal.closest.best));
        count_found(hit.is_some(), probe);
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
