//! Surface points shaded side by side, as columns (structure of arrays).
//!
//! Where a material has no lobes beyond its microfacets, reflection and mirror rays depend on a few numbers, and the same
//! formulas hold for all points. They are written once, for one point, in `surface`, `patch`, `shade`, `glint` and
//! `accel::refine`; here loops over columns call them, which the compiler vectorises. So a point shaded here gives the same bits
//! as one shaded by itself, on every instruction set. On area lights each point draws samples of its own (`area_lights`). Sheen
//! and clear coat lie over the columns' result (`overlays`). Rays that go on from glass and clear coat, other lobes of a
//! material, and light of panoramas and by rays to the environment are computed point by point, from the columns (`lobes`,
//! `batch_point`).
//!
//! Cases that columns cannot handle are left to the tracer: hits near the edge of a face, those whose distance needs more than
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

/// A mesh with the placement of its instance.
#[derive(Clone, Copy)]
pub(crate) struct PlacedMesh<'a> {
    pub mesh: &'a Mesh,
    pub placement: &'a Placement,
}
