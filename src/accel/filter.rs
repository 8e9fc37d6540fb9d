//! Filters that reject hits on prims that are not opaque, such as alpha-masked faces, during traversal.

use super::{Hit, Pencil, Ray};

/// Filter of an occlusion query: decides whether a prim that is not opaque blocks the ray at its hit.
pub trait OccludedFilter {
    /// Whether prim `prim` blocks all light at its hit by ray `ray` of the batch, within the ray's range. Must depend on both
    /// arguments alone: it may be called more than once, in any order.
    fn stops(&self, ray: usize, prim: u32) -> bool;
}

/// Filter of a query for first hits: rejects hits on prims that are not opaque.
pub trait IntersectFilter {
    /// Whether ray `ray` of the batch certainly passes through prim `prim` where it hits it, if it does. `false` when unsure:
    /// a structure may report any hit all the same, and the caller filters again. May be called more than once, in any order.
    fn rejects(&self, ray: usize, prim: u32) -> bool;

    /// [`Self::rejects`] for a mask of rays whose lowest bit stands for ray `first`; returns the mask of the rays that pass.
    fn rejects_of(&self, first: usize, rays: u32, prim: u32) -> u32 {
        those(rays, |ray| self.rejects(first + ray, prim))
    }
}

/// Mask of those rays of `rays` for which `is_true` holds.
pub(super) fn those(rays: u32, is_true: impl Fn(usize) -> bool) -> u32 {
    let (mut those, mut left) = (0, rays);
    while left != 0 {
        let ray = left.trailing_zeros();
        left &= left - 1;
        those |= u32::from(is_true(ray as usize)) << ray;
    }
    those
}

/// A batch of rays of which the first hits are wanted.
#[derive(Clone, Copy)]
pub struct HitQueries<'w> {
    /// The rays.
    pub rays: &'w [Ray],
    /// The rays as a pencil, if they share one origin: packets then read them there.
    pub pencil: Option<&'w Pencil<'w>>,
    /// For rays that go on behind a hit: that hit, one per ray.
    pub after: Option<&'w [Hit]>,
    /// Rejects hits that rays may pass.
    pub filter: Option<&'w dyn IntersectFilter>,
}

impl<'w> HitQueries<'w> {
    /// Queries for the first hits from the rays' start on, without a filter.
    pub fn along(rays: &'w [Ray]) -> Self {
        Self { rays, pencil: None, after: None, filter: None }
    }
}
