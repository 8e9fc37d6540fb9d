//! Points of surfaces, shaded side by side: one number of all points, then the next.
//!
//! Where a material has no more lobes than that of its facets, what a point shows, and what it mirrors, depends on a few
//! numbers, and the same formulas are computed for all points. They are written once, for one point, in `surface`, `patch`,
//! `shade`, `glint` and `accel::refine`; here loops over columns of numbers call them, which the compiler turns into lanes.
//! So a point shaded here gives the same bits as one shaded by itself, on every instruction set. Of lights with an extent
//! each point draws places of its own (`area_lights`). Sheen and clear coat lie over what the columns know (`overlays`).
//! Rays that go on from glass and clear coat, what other lobes of a material show, and what is seen of panoramas and by
//! rays to the surroundings, are found point by point, from the numbers in the columns (`lobes`, `batch_point`).
//!
//! What a column cannot do is left to the tracer: hits near the edge of a face, those whose distance needs more than
//! `f64`, points whose mesh gives no tangent, and glass from which no ray goes on.

mod area_lights;
mod batch_point;
mod columns;
mod cones;
mod constants;
mod environment;
mod faces;
mod formulas;
mod hits_by_instance;
mod lit;
mod lobes;
mod material_maps;
mod overlays;
mod painted;
mod pass_through;

use super::world::Placement;
use crate::scene::Mesh;

pub(crate) use batch_point::BatchPoint;
pub(crate) use columns::{POINTS, ShadingBatch};
pub(crate) use constants::MaterialConstants;
pub(crate) use hits_by_instance::HitsByInstance;
pub(crate) use pass_through::PassThrough;

/// A mesh, and where an instance has placed it.
#[derive(Clone, Copy)]
pub(crate) struct PlacedMesh<'a> {
    pub mesh: &'a Mesh,
    pub placement: &'a Placement,
}
