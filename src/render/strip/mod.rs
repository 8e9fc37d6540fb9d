//! Points of surfaces, shaded side by side: one number of all points, then the next.
//!
//! Where a material has no more lobes than that of its facets, what a point shows, and what it mirrors, depends on a
//! few numbers, and the same formulas are computed for all points. They are written once, for one point, in `surface`,
//! `patch`, `shade`, `glint` and `accel::refine`; here loops over columns of numbers call them, which the compiler
//! turns into lanes. So a point shaded here gives the same bits as one shaded by itself, on every instruction set. Of
//! lights with an extent each point draws places of its own (`wide`). Sheen and lacquer lie over what the columns know
//! (`overlays`). Rays that go on from glass and lacquer, what other lobes of a material show, and what is seen of panoramas and
//! by rays to the surroundings, are found point by point, from the numbers in the columns (`lobes`, `ground`).
//!
//! What a column cannot do is left to the tracer: hits near the edge of a face, those whose distance needs more than
//! `f64`, points whose mesh gives no tangent, and glass from which no ray goes on.

mod around;
mod columns;
mod common;
mod cones;
mod faces;
mod ground;
mod lit;
mod lobes;
mod overlays;
mod painted;
mod sheet;
mod sorted;
mod through;
mod wide;

pub(crate) use columns::{POINTS, Strip};
pub(crate) use common::Common;
pub(crate) use ground::StripPoint;
pub(crate) use sorted::Sorted;
pub(crate) use through::Passed;
