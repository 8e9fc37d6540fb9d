//! A query's ray against boxes, one at a time and in `f64`: what the textbook structures ask.
//!
//! # Why no hit is lost
//! Prims lie within their bounds, so the exact ray is inside a prim's box at the exact distance of the hit.
//! [`Aabb::span`] allows for its own rounding. The distance that the test gives is rounded to `f32`, and a sphere's or
//! cone's is not that of exact arithmetic: the range of the ray is widened by [`WALK_MARGIN`] and, where numbers are so
//! small that an ulp is no fraction of them, [`BOX_UNDERFLOW`].

use super::query::{Goal, Query};
use crate::math::aabb::Aabb;
use crate::math::bounds::{BOX_UNDERFLOW, WALK_MARGIN};
use crate::math::{DVec3, Vec3};

/// A ray ready to be compared with boxes.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    origin: Vec3,
    inv_dir: DVec3,
    from: f64,
}

impl BoxRay {
    /// The ray of a query.
    #[inline]
    pub fn new<G: Goal>(query: &Query<G>) -> Self {
        Self { origin: query.ray.origin, inv_dir: query.ray.dir.as_dvec3().recip(), from: start(query) }
    }

    /// The distance at which the ray enters the box, if it does before `limit`.
    #[inline]
    pub fn enters(&self, bounds: &Aabb, limit: f64) -> Option<f64> {
        bounds.span(self.origin, self.inv_dir, self.from, limit).map(|(near, _)| near)
    }
}

/// The distance from which on volumes must be entered for hits within the query's range.
#[inline]
pub fn start<G: Goal>(query: &Query<G>) -> f64 {
    let from = f64::from(query.t_min);
    from - widening(from)
}

/// The distance up to which volumes must be entered for hits within the query's reach.
#[inline]
pub fn limit<G: Goal>(query: &Query<G>) -> f64 {
    let reach = f64::from(query.reach());
    reach + widening(reach)
}

fn widening(t: f64) -> f64 {
    t.abs() * WALK_MARGIN + f64::from(BOX_UNDERFLOW)
}
