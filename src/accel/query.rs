//! Common part of the queries of all structures: ray set-up, unbounded planes, order of hits.
//!
//! A structure only selects the prims that a ray is tested against ([`Culling`]); tests, order and counting happen here, so
//! that no two structures can differ in them.

use super::intersector::{Exact, Intersector};
use super::probe::{Outcome, Test};
use super::query_batch::{ClosestBatch, NextBatch, OccludedBatch, QueryBatch, begin, end};
use super::{Accel, Hit, HitQueries, IntersectFilter, NO_PRIM, OccludedFilter, Probe, Ray, Shapes};
use crate::math::shear::RaySpace;
use crate::math::simd::LANES;
use crate::math::triangle::{self, Meeting, Triangle};
use crate::math::triangles::{Corners8, Verdicts, corners_of};

/// A culling structure: selects the prims that a ray may hit.
pub trait Culling: Sync {
    /// Scratch memory of a walk.
    type Scratch: Send;

    /// Shapes that the structure culls.
    fn shapes(&self) -> &Shapes;

    /// Creates a scratch value.
    fn new_scratch(&self) -> Self::Scratch;

    /// Calls [`Query::test`] at least for every bounded prim that the ray hits within [`Query::reach`].
    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, scratch: &mut Self::Scratch, probe: &mut P);

    /// Answers a batch, one ray after another unless a structure overrides it.
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

/// Kind of a query, with its ray/triangle test.
pub trait Goal {
    /// The ray/triangle test.
    type Test: Intersector;

    /// Whether [`Self::Test`] is the exact test.
    const EXACT: bool = <Self::Test as Intersector>::EXACT;

    /// Whether any hit answers the query.
    const ANY: bool = false;

    /// Whether hits with non-opaque prims can count at all.
    #[inline(always)]
    fn wants_transparent(&self) -> bool {
        true
    }

    /// Whether a hit with `prim` within the ray's range counts.
    #[inline(always)]
    fn counts_hit(&self, _opaque: bool, _prim: u32) -> bool {
        true
    }

    /// Filter of first hits, if any, and the index of the ray in its batch.
    #[inline(always)]
    fn filter(&self) -> Option<(&dyn IntersectFilter, usize)> {
        None
    }

    /// Whether a hit would replace the best one so far.
    fn is_nearer(&self, t: f32, prim: u32) -> bool;

    /// Takes a hit that counts, within the ray's range, and returns the outcome.
    fn offer(&mut self, t: f32, prim: u32) -> Outcome;

    /// Distance beyond which hits no longer count.
    fn reach(&self) -> f32;

    /// Distance and prim of the best hit so far; `None` if there is none or the query does not ask for hits.
    fn best(&self) -> Option<(f32, u32)>;

    /// Returns the test.
    fn test(&self) -> Self::Test;
}

/// Query of one ray in progress.
#[derive(Clone, Debug)]
pub struct Query<'a, G: Goal> {
    /// The ray in sheared space.
    pub ray: RaySpace,
    /// Smallest t of a hit.
    pub t_min: f32,
    t_max: f32,
    exclude: u32,
    shapes: &'a Shapes,
    prepared: <G::Test as Intersector>::Prepared,
    pub(super) goal: G,
    /// Opacity of the tested prims, where they are not among the shapes.
    pub(super) opaque: Option<bool>,
    /// The last triangle that was offered and taken, if it came from a block.
    winner: Option<Winner>,
}

/// Data of the winning triangle for the final answer, so that it is not looked up again.
#[derive(Clone, Copy, Debug)]
struct Winner {
    prim: u32,
    corners: Triangle,
    meeting: Meeting,
}

impl<'a, G: Goal> Query<'a, G> {
    /// Creates the query of a ray whose hits count from `t_min` on; also returns whether it can hit anything, which is false
    /// for a zero direction, numbers that are not finite, or an empty range.
    #[inline(always)]
    pub(super) fn new(shapes: &'a Shapes, ray: &Ray, t_min: f32, goal: G) -> (Self, bool) {
        // An overflowing distance is no hit, and `<=` is false for NaN.
        let t_max = if ray.t_max < f32::MAX { ray.t_max } else { f32::MAX };
        let (space, usable) = RaySpace::checked(ray.origin, ray.dir);
        let prepared = goal.test().prepare(&space);
        let usable = usable && t_min <= t_max && !ray.t_max.is_nan();
        (
            Self { ray: space, t_min, t_max, exclude: ray.exclude, shapes, prepared, goal, opaque: None, winner: None },
            usable,
        )
    }

    /// Distance beyond which hits no longer count; shrinks as hits are found.
    #[inline]
    pub fn reach(&self) -> f32 {
        self.t_max.min(self.goal.reach())
    }

    /// Whether a prim is tested at all: false for the prim that the ray excludes, and for prims whose hits cannot count.
    #[inline]
    pub fn asks_for(&self, prim: u32) -> bool {
        prim != self.exclude && (self.goal.wants_transparent() || self.is_opaque(prim))
    }

    /// Tests every bounded prim, until the query is answered.
    #[inline(never)]
    pub fn test_all<P: Probe>(&mut self, probe: &mut P) {
        for prim in 0..self.shapes.bounded() {
            if self.test(prim, probe) {
                return;
            }
        }
    }

    /// Tests one prim and returns whether the query is answered.
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

    /// Passes a hit on to the goal if it is within the range; NaN is not.
    #[inline]
    fn offer(&mut self, t: f32, prim: u32) -> Outcome {
        if t >= self.t_min && t <= self.t_max {
            if G::ANY && !self.goal.counts_hit(self.is_opaque(prim), prim) || !G::ANY && self.passes(t, prim) {
                return Outcome::LetThrough;
            }
            self.goal.offer(t, prim)
        } else if t.is_nan() {
            Outcome::Miss
        } else {
            Outcome::OutOfRange
        }
    }

    /// Whether the filter rejects a hit that would become the best one.
    #[inline]
    fn passes(&self, t: f32, prim: u32) -> bool {
        let Some((filter, ray)) = self.goal.filter() else { return false };
        !self.is_opaque(prim) && self.goal.is_nearer(t, prim) && filter.rejects(ray, prim)
    }

    /// Whether a prim is opaque.
    #[inline]
    fn is_opaque(&self, prim: u32) -> bool {
        self.opaque.unwrap_or_else(|| self.shapes.opaque.get_or_set(prim))
    }

    /// Takes the verdicts on a block's first `count` lanes, decides the uncertain ones, and returns whether the query is
    /// answered. Finds the same hits as [`Self::test`] for each lane, if the test is exact.
    #[inline(always)]
    pub fn test_block<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        corners: &Corners8,
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
    ) -> bool {
        self.decide_uncertain(prims, count, verdicts, probe, |query, lane, certain, probe| {
            query.take(prims[lane], &corners_of(corners, lane), certain, probe)
        })
    }

    /// [`Self::test_block`] for triangles that are known to count; they need not be among the shapes.
    #[inline(always)]
    pub(super) fn test_wanted_block<P: Probe>(
        &mut self,
        prims: &[u32; LANES],
        corners: &Corners8,
        count: u32,
        verdicts: Verdicts,
        probe: &mut P,
    ) -> bool {
        self.decide_uncertain(prims, count, verdicts, probe, |query, lane, certain, probe| {
            let prim = prims[lane];
            if prim == query.exclude {
                probe.tested(|| Test { prim, t: f32::NAN, outcome: Outcome::LeftOut });
                return false;
            }
            query.take_wanted(prim, &corners_of(corners, lane), certain, probe)
        })
    }

    /// Calls `take` for each lane that is not a certain miss, with a flag for certain hits, until the query is answered.
    #[inline(always)]
    fn decide_uncertain<P: Probe>(
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

    /// Offers a hit with a triangle, after deciding it unless it is `certain`; returns whether the query is answered.
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

    /// Tests the unbounded planes, which no structure contains, and returns whether the query is answered.
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

    /// Best hit so far, with its barycentric coordinates, which only the winner needs.
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

    /// Best hit so far, if it is with a triangle of a block, which need not be among the shapes.
    pub(super) fn hit_by_winner(&self) -> Option<Hit> {
        let (t, prim) = self.goal.best()?;
        let Winner { corners, meeting, .. } = self.winner.as_ref().filter(|winner| winner.prim == prim)?;
        let (u, v) = match meeting.t_f64.is_nan() {
            true => triangle::barycentrics(&self.ray, corners),
            false => triangle::barycentrics_at(&self.ray, corners, meeting.t_f64, meeting.normal),
        };
        Some(Hit { t, u, v, prim })
    }

    /// Shapes of the query.
    pub fn shapes(&self) -> &'a Shapes {
        self.shapes
    }
}

/// Query for the first hit.
pub struct Closest<'w, I> {
    best: (f32, u32),
    /// Filter of hits, if any; `ray` is the index of the ray in its batch.
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

/// Query for occlusion: by any opaque prim, or by another one where the filter says that it blocks the ray.
pub struct Occluded<'w, I> {
    pub(super) found: bool,
    /// Filter of occlusion queries, if any; `ray` is the index of the ray in its batch.
    filter: Option<&'w dyn OccludedFilter>,
    ray: usize,
    test: I,
}

impl<I: Intersector> Goal for Occluded<'_, I> {
    type Test = I;
    const ANY: bool = true;

    #[inline]
    fn wants_transparent(&self) -> bool {
        self.filter.is_some()
    }
    #[inline(always)]
    fn counts_hit(&self, opaque: bool, prim: u32) -> bool {
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

/// Query for the first hit after a given one.
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

    /// Goal of finding the first hit that precedes a known one.
    pub(super) fn before(known: &Hit, test: I) -> Self {
        Self { best: (known.t, known.prim), filter: None, ray: 0, test }
    }

    /// Goal of ray `ray` of its batch, whose hits `filter` may reject.
    #[inline(always)]
    pub(super) fn passing(self, filter: Option<&'w dyn IntersectFilter>, ray: usize) -> Self {
        Self { filter, ray, ..self }
    }
}

impl<'w, I> Occluded<'w, I> {
    /// Goal of ray `ray` of its batch, with nothing found yet.
    #[inline(always)]
    pub(super) fn by(filter: Option<&'w dyn OccludedFilter>, ray: usize, test: I) -> Self {
        Self { found: false, filter, ray, test }
    }
}

impl<'w, I> Next<'w, I> {
    /// Goal of finding the first hit after `after`.
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

/// A structure whose triangles are tested by `I` instead of the exact test.
#[derive(Clone, Copy, Debug)]
pub struct Tested<'a, I, C> {
    structure: &'a C,
    test: I,
}

impl<'a, I: Intersector, C: Culling> Tested<'a, I, C> {
    /// Combines `structure` with another test.
    pub fn new(structure: &'a C, test: I) -> Self {
        Self { structure, test }
    }
}

impl<I: Intersector, C: Culling> Accel for Tested<'_, I, C> {
    type Scratch = C::Scratch;

    fn scratch(&self) -> Self::Scratch {
        self.structure.new_scratch()
    }

    // Pencils and filters work with the exact test only.
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
