//! Interval rays: bounds of the distances at which any of many rays meets a plane.

use super::node::Tree;
use super::padded::FIRST;
use super::slabs::BoxMargins;
use crate::math::Vec3;
use crate::math::bounds::PARALLEL;
use crate::math::simd::{LANES, Pick, Row, Simd};

/// Linear bounds of the distances at which any of the rays meets a plane perpendicular to an axis: lower bounds for entry
/// planes, upper bounds for exit planes; valid where these are not negative (S. Boulos, I. Wald, P. Shirley, *Geometric and
/// Arithmetic Culling Methods for Entire Ray Packets*, 2006).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct IntervalRay {
    /// By axis: factor of the plane, and summand.
    first: [[f32; 2]; 3],
    last: [[f32; 2]; 3],
    from: f32,
}

impl IntervalRay {
    /// Bounds of rays with one octant whose origins and reciprocal directions ([`Padding`](super::padded::Padding)) lie
    /// between the given ones, with hits from `from` on.
    #[inline(always)]
    pub(super) fn new<B: BoxMargins>(
        tree: &Tree,
        octant: usize,
        [least, greatest]: [Vec3; 2],
        [low, high]: [Vec3; 2],
        from: f32,
    ) -> Self {
        let mut interval = Self { from, ..Self::default() };
        let farthest = low.abs().max(high.abs());
        let drift = PARALLEL * (tree.extent + farthest.element_sum());
        for k in 0..3 {
            let pad = B::PAD * (tree.extent + farthest[k]) + drift;
            // The fastest ray from the foremost origin meets planes first, the slowest from the rearmost last.
            let (fast, slow, front, rear) = if octant >> k & 1 == 1 {
                (greatest[k], least[k], low[k], high[k])
            } else {
                (least[k], greatest[k], high[k], low[k])
            };
            interval.first[k] = [fast, -front * fast - pad * fast.abs()];
            interval.last[k] = [slow, -rear * slow + pad * slow.abs()];
        }
        interval
    }

    /// Smallest absolute reciprocal along an axis.
    #[inline(always)]
    pub(super) fn fastest(&self, axis: usize) -> f32 {
        self.first[axis % 3][0].abs()
    }

    /// Least entry distances of eight boxes, and the mask of those that any ray may meet up to `limit`; `first` and `last`
    /// are the entry and exit planes by axis.
    #[inline(always)]
    pub(super) fn between<S: Simd>(
        &self,
        s: S,
        first: [S::Lanes; 3],
        last: [S::Lanes; 3],
        limit: f32,
    ) -> (S::Lanes, u32) {
        let (mut near, mut far) = (s.splat(self.from), s.splat(limit));
        for k in 0..3 {
            let ([a, b], [c, d]) = (self.first[k], self.last[k]);
            near = s.later(s.mul_add(first[k], s.splat(a), s.splat(b)), near);
            far = s.sooner(s.mul_add(last[k], s.splat(c), s.splat(d)), far);
        }
        (near, s.in_order(near, far))
    }

    /// [`Self::between`] for rays with one octant; planes in the order of a node's.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, s: S, planes: &[Row; 6], octant: usize, limit: f32) -> (S::Lanes, u32) {
        let [x, y, z] = FIRST[octant % LANES];
        let pick = |p: Pick| s.pick(planes, p);
        self.between(s, [pick(x), pick(y), pick(z)], [pick(x.other()), pick(y.other()), pick(z.other())], limit)
    }
}
