//! Filters: what rejects hits on prims that are not opaque, such as alpha-masked faces, while rays are on their way.

use super::{Hit, Pencil, Ray};

/// Decides whether a prim that is not opaque stops light where a ray meets it, as the filter of an occlusion query.
pub trait OccludedFilter {
    /// Whether prim `prim` stops all light where ray number `ray` of those that were asked meets it, within its range. A
    /// function of both alone: it may be asked more than once, in any order.
    fn stops(&self, ray: usize, prim: u32) -> bool;
}

/// Rejects hits on prims that are not opaque, as the filter of a query for first hits.
pub trait IntersectFilter {
    /// Whether ray number `ray` of the batch certainly passes prim `prim` where it meets it, if it does. `false` when unsure:
    /// a structure may report any hit all the same, and the caller filters again. It may be asked more than once, in any order.
    fn rejects(&self, ray: usize, prim: u32) -> bool;

    /// [`Self::rejects`] for the rays of a mask whose lowest bit stands for ray `first`; a mask of those that pass.
    fn rejects_of(&self, first: usize, rays: u32, prim: u32) -> u32 {
        those(rays, |ray| self.rejects(first + ray, prim))
    }
}

/// The rays of a mask of which something is true.
pub(super) fn those(rays: u32, is_true: impl Fn(usize) -> bool) -> u32 {
    let (mut those, mut left) = (0, rays);
    while left != 0 {
        let ray = left.trailing_zeros();
        left &= left - 1;
        those |= u32::from(is_true(ray as usize)) << ray;
    }
    those
}

/// A batch of rays, each asked for its first hit.
#[derive(Clone, Copy)]
pub struct HitQueries<'w> {
    /// The rays.
    pub rays: &'w [Ray],
    /// The rays as a pencil, if all start at one place: packets read them there.
    pub pencil: Option<&'w Pencil<'w>>,
    /// For rays that go on behind a hit: that hit of each.
    pub after: Option<&'w [Hit]>,
    /// Rejects hits that rays may pass.
    pub filter: Option<&'w dyn IntersectFilter>,
}

impl<'w> HitQueries<'w> {
    /// Rays from their start on that pass nothing.
    pub fn along(rays: &'w [Ray]) -> Self {
        Self { rays, pencil: None, after: None, filter: None }
    }
}
