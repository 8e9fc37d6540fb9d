//! What is common to the queries of every structure: the ray's set-up, the unbounded planes, the order of hits.
//!
//! A structure only decides which prims a ray is tested against ([`Culling`]); tests, order and counting happen here, so
//! that no two structures can differ in them.

use super::intersector::{Exact, Intersector};
use super::probe::{Outcome, Test};
use super::query_batch::{ClosestBatch, NextBatch, OccludedBatch, QueryBatch, begin, end};
use super::{Accel, Hit, HitQueries, IntersectFilter, NO_PRIM, OccludedFilter, Probe, Ray, Shapes};
use crate::math::shear::RaySpace;
use crate::math::simd::LANES;
use crate::math::triangle::{self, Meeting, Triangle};
use crate::math::triangles::{Corners8, Verdicts, corners_of};

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

    /// Answers a batch, one ray after another unless a structure knows better.
    fn trace<W: QueryBatch, P: Probe>(&self, batch: &mut W, scratch: &mut Self::Scratch, probe: &mut P) {
        for i in 0..batch.rays().len() {
            let (mut query, usable) = begin(self.shapes(), batch, i, probe);
            if usable && !query.test_planes(probe) && self.shapes().bounded() > 0 {
                self.walk(&mut query, scratch, probe);
            }
            end(batch, i, &query, probe);
        }
    }
}

/// What a query looks for, and with which test.
pub trait Goal {
    /// The test of triangles.
    type Test: Intersector;

    /// Whether that is the exact one.
    const EXACT: bool = <Self::Test as Intersector>::EXACT;

    /// Whether any hit is the answer.
    const ANY: bool = false;

    /// Whether hits with prims that are not opaque may matter at all.
    #[inline(always)]
    fn wants_open(&self) -> bool {
        true
    }

    /// Whether `prim`, which is hit within the ray's range, matters there.
    #[inline(always)]
    fn minds(&self, _opaque: bool, _prim: u32) -> bool {
        true
    }

    /// The filter of first hits, if there is one, and the ray's number in its batch.
    #[inline(always)]
    fn filter(&self) -> Option<(&dyn IntersectFilter, usize)> {
        None
    }

    /// Whether a hit would be the answer so far.
    fn is_nearer(&self, t: f32, prim: u32) -> bool;

    /// A hit within the ray's range was found that matters; what that means.
    fn offer(&mut self, t: f32, prim: u32) -> Outcome;

    /// Hits beyond this distance do not matter any more.
    fn reach(&self) -> f32;

    /// The hit that is the answer so far, by distance and prim, where hits are asked for.
    fn best(&self) -> Option<(f32, u32)>;

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
    pub(super) goal: G,
    /// Whether what is tested stops light wherever it is met, where it is not among the shapes.
    pub(super) opaque: Option<bool>,
    /// The triangle that was offered last and taken, where it came from a block.
    winner: Option<Winner>,
}

/// What the answer needs of a triangle, so that it is not looked up again.
#[derive(Clone, Copy, Debug)]
struct Winner {
    prim: u32,
    corners: Triangle,
    meeting: Meeting,
}

impl<'a, G: Goal> Query<'a, G> {
    /// A ray whose hits count from `t_min` on, and whether it can hit anything: not with a direction of zero, numbers that
    /// are not finite, or an empty range.
    #[inline(always)]
    pub(super) fn new(shapes: &'a Shapes, ray: &Ray, t_min: f32, goal: G) -> (Self, bool) {
        // A distance that overflows is no hit, and `<=` is false for NaN.
        let t_max = if ray.t_max < f32::MAX { ray.t_max } else { f32::MAX };
        let (space, usable) = RaySpace::checked(ray.origin, ray.dir);
        let prepared = goal.test().prepare(&space);
        let usable = usable && t_min <= t_max && !ray.t_max.is_nan();
        (
            Self { ray: space, t_min, t_max, exclude: ray.exclude, shapes, prepared, goal, opaque: None, winner: None },
            usable,
        )
    }

    /// Hits beyond this distance do not matter; shrinks as hits are found.
    #[inline]
    pub fn reach(&self) -> f32 {
        self.t_max.min(self.goal.reach())
    }

    /// Whether a prim is tested at all: not one that the ray excludes, or a hit of which would not matter.
    #[inline]
    pub fn asks_for(&self, prim: u32) -> bool {
        prim != self.exclude && (self.goal.wants_open() || self.is_opaque(prim))
    }

    /// Tests every prim that has bounds, until the query is answered.
    #[inline(never)]
    pub fn test_all<P: Probe>(&mut self, probe: &mut P) {
        for prim in 0..self.shapes.bounded() {
            if self.test(prim, probe) {
                return;
            }
        }
    }

    /// Tests one prim and tells whether the query is answered.
    #[inline]
    pub fn test<P: Probe>(&mut self, prim: u32, probe: &mut P) -> bool {
        if !self.asks_for(prim) {
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
            if G::ANY && !self.goal.minds(self.is_opaque(prim), prim) || !G::ANY && self.passes(t, prim) {
                return Outcome::LetThrough;
            }
            self.goal.offer(t, prim)
        } else if t.is_nan() {
            Outcome::Miss
        } else {
            Outcome::OutOfRange
        }
    }

    /// Whether the filter rejects a hit that would be the answer.
    #[inline]
    fn passes(&self, t: f32, prim: u32) -> bool {
        let Some((filter, ray)) = self.goal.filter() else { return false };
        !self.is_opaque(prim) && self.goal.is_nearer(t, prim) && filter.rejects(ray, prim)
    }

    /// Whether a prim stops light wherever it is met.
    #[inline]
    fn is_opaque(&self, prim: u32) -> bool {
        self.opaque.unwrap_or_else(|| self.shapes.opaque.get_or_set(prim))
    }

    /// Takes the verdicts of a block's first `count` lanes, decides those that are open, and tells whether the query is
    /// answered. The same hits as [`Self::test`] for each of them, if the test is exact.
    #[inline(always)]
    pub fn test_block<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        corners: &Corners8,
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
    ) -> bool {
        self.decide_open(prims, count, verdicts, probe, |query, lane, certain, probe| {
            query.take(prims[lane], &corners_of(corners, lane), certain, probe)
        })
    }

    /// [`Self::test_block`] for triangles of which the caller knows that they are wanted; they need not be among the shapes.
    #[inline(always)]
    pub(super) fn test_wanted_block<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        corners: &Corners8,
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
    ) -> bool {
        self.decide_open(prims, count, verdicts, probe, |query, lane, certain, probe| {
            let prim = prims[lane];
            if prim == query.exclude {
                probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::LeftOut });
                return false;
            }
            query.take_wanted(prim, &corners_of(corners, lane), certain, probe)
        })
    }

    /// Has `take` decide each lane that is not missed for certain, told whether it is hit for certain, until the query is
    /// answered.
    #[inline(always)]
    fn decide_open<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
        take: impl Fn(&mut Self, usize, bool, &mut P) -> bool,
    ) -> bool {
        probe.prim_tests(count);
        let all = (1 << count) - 1;
        let mut open = (verdicts.hit | verdicts.unsure) & all;
        probe.lanes_tested(prims, all & !open, Outcome::Miss);
        while open != 0 {
            let lane = open.trailing_zeros() as usize % LANES;
            open &= open - 1;
            if take(self, lane, verdicts.hit >> lane & 1 == 1, probe) {
                probe.lanes_tested(prims, open, Outcome::LeftOut);
                return true;
            }
        }
        false
    }

    /// Offers the hit with a triangle that is hit for certain, or may be.
    #[inline(never)]
    pub fn take<P: Probe>(&mut self, prim: u32, corners: &Triangle, certain: bool, probe: &mut P) -> bool {
        if !self.asks_for(prim) {
            probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::LeftOut });
            return false;
        }
        self.take_wanted(prim, corners, certain, probe)
    }

    #[inline(always)]
    fn take_wanted<P: Probe>(&mut self, prim: u32, corners: &Triangle, certain: bool, probe: &mut P) -> bool {
        if certain || triangle::is_hit(&self.ray, corners) {
            let meeting = triangle::meet(&self.ray, corners);
            let t = meeting.t;
            let outcome = self.offer(t, prim);
            if outcome == Outcome::Hit {
                self.winner = Some(Winner { prim, corners: *corners, meeting });
            }
            probe.tested(|| Test { prim, t, outcome });
        } else {
            probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::Miss });
        }
        self.reach() < self.t_min
    }

    /// Tests the unbounded planes, which no structure holds, and tells whether the query is answered.
    #[inline(always)]
    pub fn test_planes<P: Probe>(&mut self, probe: &mut P) -> bool {
        !self.shapes.planes.is_empty() && self.test_each_plane(probe)
    }

    #[inline(never)]
    fn test_each_plane<P: Probe>(&mut self, probe: &mut P) -> bool {
        let first = self.shapes.bounded();
        #[expect(clippy::cast_possible_truncation, reason = "prim ids are u32")]
        let count = self.shapes.planes.len() as u32;
        (first..first + count).any(|plane| self.test(plane, probe))
    }

    /// The hit that is the answer so far, with its barycentric weights, which only the winner needs.
    #[inline]
    pub(super) fn hit(&self) -> Hit {
        let Some((t, prim)) = self.goal.best() else { return Hit::MISS };
        let (u, v) = match &self.winner {
            Some(Winner { prim: from, corners, meeting }) if *from == prim && !meeting.t_f64.is_nan() => {
                triangle::barycentrics_at(&self.ray, corners, meeting.t_f64, meeting.normal)
            }
            _ => self.shapes.barycentrics(prim, &self.ray),
        };
        Hit { t, u, v, prim }
    }

    /// The answer, where it is a hit with a triangle of a block, which need not be among the shapes.
    pub(super) fn hit_by_winner(&self) -> Option<Hit> {
        let (t, prim) = self.goal.best()?;
        let Winner { corners, meeting, .. } = self.winner.as_ref().filter(|winner| winner.prim == prim)?;
        let (u, v) = match meeting.t_f64.is_nan() {
            true => triangle::barycentrics(&self.ray, corners),
            false => triangle::barycentrics_at(&self.ray, corners, meeting.t_f64, meeting.normal),
        };
        Some(Hit { t, u, v, prim })
    }

    /// What is asked about.
    pub fn shapes(&self) -> &'a Shapes {
        self.shapes
    }
}

/// The first hit.
pub struct Closest<'w, I> {
    best: (f32, u32),
    /// The filter of hits, if there is one, and the ray's number in its batch.
    filter: Option<&'w dyn IntersectFilter>,
    ray: usize,
    test: I,
}

impl<I: Intersector> Goal for Closest<'_, I> {
    type Test = I;

    #[inline(always)]
    fn filter(&self) -> Option<(&dyn IntersectFilter, usize)> {
        Some((self.filter?, self.ray))
    }
    #[inline]
    fn is_nearer(&self, t: f32, prim: u32) -> bool {
        (t, prim) < self.best
    }
    #[inline]
    fn offer(&mut self, t: f32, prim: u32) -> Outcome {
        if self.is_nearer(t, prim) {
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
    fn best(&self) -> Option<(f32, u32)> {
        (self.best.1 != NO_PRIM).then_some(self.best)
    }
    #[inline]
    fn test(&self) -> I {
        self.test
    }
}

/// Whether anything is hit that stops light: what is opaque, and what others say does so where it is hit.
pub struct Occluded<'w, I> {
    pub(super) found: bool,
    /// The filter of occlusion queries, if there is one, and the ray's number in its batch.
    filter: Option<&'w dyn OccludedFilter>,
    ray: usize,
    test: I,
}

impl<I: Intersector> Goal for Occluded<'_, I> {
    type Test = I;
    const ANY: bool = true;

    #[inline]
    fn wants_open(&self) -> bool {
        self.filter.is_some()
    }
    #[inline(always)]
    fn minds(&self, opaque: bool, prim: u32) -> bool {
        opaque || self.filter.is_some_and(|filter| filter.stops(self.ray, prim))
    }
    #[inline]
    fn is_nearer(&self, _t: f32, _prim: u32) -> bool {
        !self.found
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
    fn best(&self) -> Option<(f32, u32)> {
        None
    }
    #[inline]
    fn test(&self) -> I {
        self.test
    }
}

/// The first hit after another.
pub struct Next<'w, I> {
    after: (f32, u32),
    closest: Closest<'w, I>,
}

impl<I: Intersector> Goal for Next<'_, I> {
    type Test = I;

    #[inline(always)]
    fn filter(&self) -> Option<(&dyn IntersectFilter, usize)> {
        self.closest.filter()
    }
    #[inline]
    fn is_nearer(&self, t: f32, prim: u32) -> bool {
        (t, prim) > self.after && self.closest.is_nearer(t, prim)
    }
    #[inline]
    fn offer(&mut self, t: f32, prim: u32) -> Outcome {
        if (t, prim) > self.after { self.closest.offer(t, prim) } else { Outcome::OutOfRange }
    }
    #[inline]
    fn reach(&self) -> f32 {
        self.closest.reach()
    }
    #[inline]
    fn best(&self) -> Option<(f32, u32)> {
        self.closest.best()
    }
    #[inline]
    fn test(&self) -> I {
        self.closest.test
    }
}

impl<'w, I> Closest<'w, I> {
    pub(super) fn nothing(test: I) -> Self {
        Self::before(&Hit::MISS, test)
    }

    /// The first hit, if it comes before one that is known.
    pub(super) fn before(known: &Hit, test: I) -> Self {
        Self { best: (known.t, known.prim), filter: None, ray: 0, test }
    }

    /// The goal of the ray of this number in its batch, whose hits `filter` may reject.
    #[inline(always)]
    pub(super) fn passing(self, filter: Option<&'w dyn IntersectFilter>, ray: usize) -> Self {
        Self { filter, ray, ..self }
    }
}

impl<'w, I> Occluded<'w, I> {
    /// The goal of the ray of this number in its batch, of which nothing is found yet.
    #[inline(always)]
    pub(super) fn by(filter: Option<&'w dyn OccludedFilter>, ray: usize, test: I) -> Self {
        Self { found: false, filter, ray, test }
    }
}

impl<'w, I> Next<'w, I> {
    /// What a search for the first hit finds, if it comes after another.
    pub(super) fn after(after: &Hit, closest: Closest<'w, I>) -> Self {
        Self { after: (after.t, after.prim), closest }
    }
}

impl<C: Culling> Accel for C {
    type Scratch = C::Scratch;

    fn scratch(&self) -> Self::Scratch {
        self.new_scratch()
    }

    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        let HitQueries { rays, pencil, after, filter } = *queries;
        match after {
            Some(after) => self.trace(&mut NextBatch { rays, after, filter, hits, test: Exact }, scratch, probe),
            None => self.trace(
                &mut ClosestBatch { rays, pencil: pencil.copied(), filter, hits, test: Exact },
                scratch,
                probe,
            ),
        }
    }

    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    ) {
        self.trace(&mut OccludedBatch { rays, filter, occluded, test: Exact }, scratch, probe);
    }
}

/// A structure whose triangles are tested by `I` instead of exactly.
#[derive(Clone, Copy, Debug)]
pub struct Tested<'a, I, C> {
    structure: &'a C,
    test: I,
}

impl<'a, I: Intersector, C: Culling> Tested<'a, I, C> {
    /// `structure` with another test.
    pub fn new(structure: &'a C, test: I) -> Self {
        Self { structure, test }
    }
}

impl<I: Intersector, C: Culling> Accel for Tested<'_, I, C> {
    type Scratch = C::Scratch;

    fn scratch(&self) -> Self::Scratch {
        self.structure.new_scratch()
    }

    // Pencils and filters are for the exact test.
    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        let (HitQueries { rays, after, .. }, filter, test) = (*queries, None, self.test);
        match after {
            Some(after) => self.structure.trace(&mut NextBatch { rays, after, filter, hits, test }, scratch, probe),
            None => self.structure.trace(&mut ClosestBatch { rays, pencil: None, filter, hits, test }, scratch, probe),
        }
    }

    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    ) {
        self.structure.trace(&mut OccludedBatch { rays, filter, occluded, test: self.test }, scratch, probe);
    }
}
