//! Exact distances and barycentric coordinates of known hits, eight rays at a time.

use super::best::TriangleSlot;
use super::node::Tree;
use crate::accel::query::Goal;
use crate::accel::query_batch::QueryBatch;
use crate::accel::{Hit, NO_PRIM};
use crate::math::meetings::Pairs;
use crate::math::shear::RaySpace;
use crate::math::simd::{LANES, Simd};
use crate::math::triangle;
use crate::math::triangles::corners_of;

/// Rays whose hits wait for their exact distances.
pub(super) struct PendingHits {
    pairs: Pairs,
    /// Indices of the rays in the batch, and the prims they hit.
    rays: [usize; LANES],
    prims: [u32; LANES],
    count: usize,
}

impl Default for PendingHits {
    fn default() -> Self {
        Self { pairs: Pairs::EMPTY, rays: [0; LANES], prims: [0; LANES], count: 0 }
    }
}

impl PendingHits {
    /// Answers a ray, at once or together with others.
    #[inline(always)]
    pub(super) fn answer<S: Simd, W: QueryBatch>(
        &mut self,
        s: S,
        tree: &Tree,
        batch: &mut W,
        i: usize,
        place: TriangleSlot,
    ) {
        if place.prim == NO_PRIM {
            return batch.take(i, Hit::MISS);
        }
        if W::Goal::ANY {
            return batch.take(i, Hit { prim: place.prim, t: 0.0, u: 0.0, v: 0.0 });
        }
        let (ray, block) = (batch.ray(i), &tree.blocks[place.block as usize]);
        let (at, lane) = (self.count % LANES, place.lane as usize % LANES);
        for k in 0..3 {
            self.pairs.origin[k][at] = ray.origin[k];
            self.pairs.dir[k][at] = ray.dir[k];
            for (rows, from) in self.pairs.corners.iter_mut().zip(&block.corners) {
                rows[k][at] = from[k][lane];
            }
        }
        (self.rays[at], self.prims[at]) = (i, place.prim);
        self.count += 1;
        if self.count == LANES {
            self.finish(s, batch);
        }
    }

    /// Answers the waiting rays.
    #[inline(always)]
    pub(super) fn finish<S: Simd, W: QueryBatch>(&mut self, s: S, batch: &mut W) {
        let count = std::mem::replace(&mut self.count, 0);
        if count == 0 {
            return;
        }
        let met = self.pairs.meet(s);
        for lane in 0..count.min(LANES) {
            let (i, prim) = (self.rays[lane], self.prims[lane]);
            let hit = if met.sure >> lane & 1 == 1 {
                Hit { t: met.t[lane], u: met.weights[0][lane], v: met.weights[1][lane], prim }
            } else {
                self.exactly(batch, lane)
            };
            batch.take(i, hit);
        }
    }

    /// Hit of one ray, computed in scalar arithmetic.
    #[cold]
    #[inline(never)]
    fn exactly<W: QueryBatch>(&self, batch: &W, lane: usize) -> Hit {
        let (ray, corners) = (batch.ray(self.rays[lane]), corners_of(&self.pairs.corners, lane));
        let (t, u, v) = triangle::place(&RaySpace::checked(ray.origin, ray.dir).0, &corners);
        Hit { t, u, v, prim: self.prims[lane] }
    }
}
