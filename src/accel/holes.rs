//! Prims that are there in some places and not in others, as rays ask on their way.

use super::{Hit, Pencil, Ray};

/// Who knows whether a prim that is not opaque stops light where a ray meets it.
pub trait Holes {
    /// Whether prim `prim` stops all light where ray number `ray` of those that were asked meets it, within its range. A
    /// function of both alone: it may be asked more than once, in any order.
    fn stops(&self, ray: usize, prim: u32) -> bool;
}

/// Who knows where prims that are not opaque are not there, for rays that ask what they hit first.
pub trait Gaps {
    /// Whether ray number `ray` of those that were asked finds nothing for certain where it meets prim `prim`, if it does. Who
    /// is not sure says no: a structure may take any hit for one, and whoever asked goes on behind it by itself. It may be
    /// asked more than once, in any order.
    fn is_gap(&self, ray: usize, prim: u32) -> bool;

    /// The same of the rays of a mask, of which the first is ray `first`.
    fn gaps(&self, first: usize, rays: u32, prim: u32) -> u32 {
        those(rays, |ray| self.is_gap(first + ray, prim))
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

/// Rays that are asked for their first hits.
#[derive(Clone, Copy)]
pub struct Looking<'w> {
    /// The rays.
    pub rays: &'w [Ray],
    /// The same as a pencil, if they are one and start there: who traces rays from one place together reads them there.
    pub pencil: Option<&'w Pencil<'w>>,
    /// The hit of each behind which it goes on, if they do.
    pub after: Option<&'w [Hit]>,
    /// Who knows of gaps that they may pass, if anybody does.
    pub gaps: Option<&'w dyn Gaps>,
}

impl<'w> Looking<'w> {
    /// Rays from their start on that pass nothing.
    pub fn along(rays: &'w [Ray]) -> Self {
        Self { rays, pencil: None, after: None, gaps: None }
    }
}
