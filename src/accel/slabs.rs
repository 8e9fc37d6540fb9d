//! Slab test of a query's ray against single boxes, in `f64`, for the textbook structures.
//!
//! # Why no hit is lost
//! Prims lie within their bounds, so the exact ray is inside a prim's box at the exact distance of the hit. [`Aabb::span`]
//! allows for its own rounding. The distance of a ray/prim test is rounded to `f32`, and for spheres and cones it is not that
//! of exact arithmetic: the range of the ray is therefore widened by [`WALK_MARGIN`] and, where numbers are so small that an
//! ulp is no fraction of them, by [`BOX_UNDERFLOW`].

use super::query::{Goal, Query};
use crate::math::aabb::Aabb;
use crate::math::bounds::{BOX_UNDERFLOW, WALK_MARGIN};
use crate::math::{DVec3, Vec3};

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    origin: Vec3,
    inv_dir: DVec3,
    from: f64,
}

impl BoxRay {
    /// Prepares the ray of a query.
    #[inline]
    pub fn new<G: Goal>(query: &Query<G>) -> Self {
        Self { origin: query.ray.origin, inv_dir: query.ray.dir.as_dvec3().recip(), from: start(query) }
    }

    /// Distance at which the ray enters the box, if it does so before `limit`.
    #[inline]
    pub fn enters(&self, bounds: &Aabb, limit: f64) -> Option<f64> {
        bounds.span(self.origin, self.inv_dir, self.from, limit).map(|(near, _)| near)
    }
}

/// Distance from which volumes must be entered for hits within the query's range.
#[inline]
pub fn start<G: Goal>(query: &Query<G>) -> f64 {
    let from = f64::from(query.t_min);
    from - widening(from)
}

/// Distance up to which volumes must be entered for hits within the query's reach.
#[inline]
pub fn limit<G: Goal>(query: &Query<G>) -> f64 {
    let reach = f64::from(query.reach());
    reach + widening(reach)
}

fn widening(t: f64) -> f64 {
    t.abs() * WALK_MARGIN + f64::from(BOX_UNDERFLOW)
}
