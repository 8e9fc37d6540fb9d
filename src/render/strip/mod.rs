//! Points of surfaces, shaded side by side: one number of all points, then the next.
//!
//! Where nothing lies over a material, what a point shows, and what it mirrors, depends on a few numbers, and the same
//! formulas are computed for all points; only the rays that go on from glass are found point by point. They are written once, for one point, in `surface`,
//! `patch`, `shade`, `glint` and `accel::refine`; here loops over columns of numbers call them, which the compiler turns
//! into lanes. So a point shaded here gives the same bits as one shaded by itself, on every instruction set.
//!
//! What a column cannot do is left to the tracer: hits near the edge of a face, those whose distance needs more than
//! `f64`, backs of one-sided faces, points whose mesh gives no tangent, and what is not there as a whole.

mod around;
mod columns;
mod common;
mod cones;
mod faces;
mod ground;
mod lit;
mod painted;
mod sheet;
mod sorted;

pub(crate) use columns::{POINTS, Strip};
pub(crate) use common::Common;
pub(crate) use ground::Spot;
pub(crate) use sorted::Sorted;
