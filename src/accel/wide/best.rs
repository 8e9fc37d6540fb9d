//! Best hit of a ray so far, known by an interval: most hits can be ordered by intervals alone.
//!
//! Exact distances are expensive. Where the intervals of two hits are disjoint, the nearer hit is known without them, and
//! only the final hit needs its exact distance; where they overlap, or touch an end of the ray's range, the exact test
//! decides.

use super::node::{Child, Tree};
use super::prepared::PreparedRay;
use super::slabs::BoxMargins;
use crate::accel::probe::Outcome;
use crate::accel::query::Goal;
use crate::accel::query_batch::QueryBatch;
use crate::accel::{NO_PRIM, Shapes};
use crate::math::shear::RaySpace;
use crate::math::sight::{BlockTest, Sight};
use crate::math::simd::{LANES, Row, Simd};
use crate::math::triangle::{self, Triangle};
use crate::math::triangles::{Corners8, corners_of};

/// A ray's query state and its best hit so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seeker {
    /// Index of the ray in its batch.
    pub number: usize,
    /// Distance up to which boxes are entered.
    pub limit: f32,
    t_min: f32,
    exclude: u32,
    best: Best,
}

/// A hit known by an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    /// Bounds of the exact distance. Without a hit: infinite, and the end of the ray's range.
    pub low: f32,
    pub high: f32,
    pub place: TriangleSlot,
}

/// Hits of a ray in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockHits {
    /// Bounds of the distances, valid for certain hits.
    low: Row,
    high: Row,
    /// Bit masks of the lanes hit for certain, and of these and the lanes that may be hit.
    hit: u32,
    pub open: u32,
}

impl BlockHits {
    pub(super) const NOTHING: Self = Self { low: [0.0; LANES], high: [0.0; LANES], hit: 0, open: 0 };
}

/// Bit mask of the first `count` lanes.
#[inline(always)]
fn lanes(count: u32) -> u32 {
    (1 << count) - 1
}

/// A triangle in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleSlot {
    pub block: u32,
    pub lane: u32,
    /// [`NO_PRIM`] if there is no triangle.
    pub prim: u32,
}

impl TriangleSlot {
    const NONE: Self = Self { block: 0, lane: 0, prim: NO_PRIM };

    /// Block and lane packed in a word; there are fewer than 2²⁷ blocks.
    #[inline(always)]
    pub(super) fn packed(self) -> u32 {
        self.block << 3 | self.lane
    }

    /// Unpacks the slot of triangle `prim`.
    #[inline(always)]
    pub(super) fn unpacked(packed: u32, prim: u32) -> Self {
        Self { block: packed >> 3, lane: packed % LANES as u32, prim }
    }

    /// Corners of the block of a packed slot, and the lane.
    #[inline(always)]
    pub(super) fn rows<'a>(tree: &Tree<'a>, packed: u32) -> (&'a Corners8, usize) {
        (&tree.blocks[(packed >> 3) as usize].corners, packed as usize % LANES)
    }

    /// Corners of the triangle in a packed slot.
    #[inline(always)]
    pub(super) fn corners(tree: &Tree, packed: u32) -> Triangle {
        let (rows, lane) = Self::rows(tree, packed);
        corners_of(rows, lane)
    }
}

impl Seeker {
    /// Creates the state of a prepared ray with index `number` in its batch, whose hits count from `t_min` on.
    #[inline(always)]
    pub(super) fn new(ray: &PreparedRay, t_min: f32, number: usize, exclude: u32) -> Self {
        Self {
            number,
            limit: ray.slabs.limit,
            t_min,
            exclude,
            best: Best { low: f32::INFINITY, high: ray.t_max, place: TriangleSlot::NONE },
        }
    }

    /// Slot of the final hit.
    #[inline(always)]
    pub(super) fn found(&self) -> TriangleSlot {
        self.best.place
    }

    /// Tests the triangles of a block leaf as seen by the ray, and returns whether the query is answered.
    #[inline(always)]
    pub(super) fn test<B: BoxMargins, S: Simd, W: QueryBatch>(
        &mut self,
        s: S,
        sight: &Sight,
        tree: &Tree,
        shapes: &Shapes,
        batch: &W,
        leaf: u32,
    ) -> bool {
        let (index, count) = Child::block(leaf);
        let Some(block) = tree.blocks.get(index as usize) else { return true };
        let test = sight.test(s, &block.corners);
        if (test.verdicts.hit | test.verdicts.unsure) & lanes(count) == 0 {
            return false;
        }
        let met = self.met(s, sight, &test, count);
        met.open != 0 && self.take::<B, _>(tree, shapes, batch, index, &met)
    }

    /// Hits of the ray in a leaf, whose index must be below the number of blocks.
    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, s: S, sight: &Sight, tree: &Tree, leaf: u32) -> BlockHits {
        let (index, count) = Child::block(leaf);
        self.met(s, sight, &sight.test(s, &tree.blocks[index as usize].corners), count)
    }

    #[inline(always)]
    fn met<S: Simd>(&self, s: S, sight: &Sight, test: &BlockTest<S>, count: u32) -> BlockHits {
        let [low, high] = test.distances(s, sight);
        let in_time = s.at_most(low, s.splat(self.best.high)) & s.at_most(s.splat(self.t_min), high);
        let (hit, unsure) = (test.verdicts.hit & in_time & lanes(count), test.verdicts.unsure & lanes(count));
        BlockHits { low: s.store(low), high: s.store(high), hit, open: hit | unsure }
    }

    /// Takes the hits of a block, and returns whether the query is answered.
    #[inline(always)]
    pub(super) fn take<B: BoxMargins, W: QueryBatch>(
        &mut self,
        tree: &Tree,
        shapes: &Shapes,
        batch: &W,
        index: u32,
        met: &BlockHits,
    ) -> bool {
        let (prims, mut open) = (&tree.blocks[index as usize].prims, met.open);
        while open != 0 {
            let lane = open.trailing_zeros();
            open &= open - 1;
            let at = lane as usize % LANES;
            let place = TriangleSlot { block: index, lane, prim: prims[at] };
            let certain = met.hit >> lane & 1 == 1;
            if self.offer(tree, shapes, batch, place, certain.then_some((met.low[at], met.high[at]))) {
                return true;
            }
        }
        self.limit = B::widened(self.best.high);
        false
    }

    /// Takes a triangle that is hit within the given distances, or may be hit, and returns whether that answers the query.
    #[inline(always)]
    fn offer<W: QueryBatch>(
        &mut self,
        tree: &Tree,
        shapes: &Shapes,
        batch: &W,
        place: TriangleSlot,
        between: Option<(f32, f32)>,
    ) -> bool {
        if place.prim == self.exclude {
            return false;
        }
        match between {
            Some((low, high)) if low > self.best.high || high < self.t_min => false,
            Some((low, high)) if (low > self.t_min) & (high < self.best.low) & (high <= self.best.high) => {
                if W::Goal::ANY && !batch.goal(self.number).counts_hit(shapes.opaque.get_or_set(place.prim), place.prim)
                {
                    return false;
                }
                if !W::Goal::ANY && batch.filter().is_some() && passes(shapes, batch, self.number, place.prim) {
                    return false;
                }
                self.best = Best { low, high, place };
                W::Goal::ANY
            }
            _ => match decide(tree, shapes, batch, self.number, self.best, place, between.is_some()) {
                Some(t) => {
                    self.best = Best { low: t, high: t, place };
                    W::Goal::ANY
                }
                None => false,
            },
        }
    }
}

/// Whether the filter lets the ray pass through a prim that it hits.
#[cold]
#[inline(never)]
fn passes<W: QueryBatch>(shapes: &Shapes, batch: &W, i: usize, prim: u32) -> bool {
    !shapes.opaque.get_or_set(prim) && batch.filter().is_some_and(|filter| filter.rejects(i, prim))
}

/// Decides by the exact test whether a triangle is hit before the best hit so far, which was found by intervals; `certain`:
/// the ray's line is known to hit it. Returns the distance, or negative infinity if any hit is the answer.
#[cold]
#[inline(never)]
pub(super) fn decide<W: QueryBatch>(
    tree: &Tree,
    shapes: &Shapes,
    batch: &W,
    i: usize,
    best: Best,
    place: TriangleSlot,
    certain: bool,
) -> Option<f32> {
    let (ray, corners) = (batch.ray(i), TriangleSlot::corners(tree, place.packed()));
    if !certain && !triangle::is_hit(&RaySpace::checked(ray.origin, ray.dir).0, &corners) {
        return None;
    }
    let t = triangle::distance_along(ray.origin, ray.dir, &corners);
    let (mut goal, within) = (batch.goal(i), batch.t_min(i)..=ray.t_max.min(f32::MAX));
    let counts_hit =
        |goal: &W::Goal| !W::Goal::ANY || goal.counts_hit(shapes.opaque.get_or_set(place.prim), place.prim);
    if !within.contains(&t) || !counts_hit(&goal) || goal.offer(t, place.prim) != Outcome::Hit {
        return None;
    }
    if W::Goal::ANY {
        return Some(f32::NEG_INFINITY);
    }
    // Rounding is monotonic, so the rounded exact distance of the best hit lies between its bounds, too.
    let before = if t < best.low {
        true
    } else if t > best.high {
        false
    } else {
        let known = triangle::distance_along(ray.origin, ray.dir, &TriangleSlot::corners(tree, best.place.packed()));
        (t, place.prim) < (known, best.place.prim)
    };
    before.then_some(t)
}
