//! Ray queries: shapes in, hits out; nothing here knows of materials, files, threads or printing.
//!
//! # The hit contract
//! Hits are ordered by (t, prim). Every structure gives, for every ray, the same hits bit for bit as
//! [`none`](none::Unculled), which tests everything: the verdict of each shape's test is exact for the `f32` ray and
//! vertices (`math::triangle`), t is a pure function of (ray, prim), and culling is conservative by the margins that
//! `math::bounds` derives.
//!
//! This holds for rays and shapes within ±1e27: distances to spheres and cones farther away overflow on the way, in one
//! structure sooner than in another.
//!
//! Rays come in batches: slices of rays in, slices of answers out. Behind the interface a structure may trace them one by
//! one, with many in flight, or as packets, with the same bits in the answer.

pub mod any;
pub mod auto;
pub mod bvh;
mod filter;
pub mod grid;
pub mod instances;
pub mod intersector;
pub mod none;
pub mod params;
pub mod probe;
pub mod query;
pub mod query_batch;
pub mod refine;
pub mod shapes;
pub mod slabs;
pub mod stats;
#[cfg(test)]
pub(crate) mod tests;
pub mod transform;
pub mod volumes;
pub mod wide;

pub use any::{AccelKind, AnyAccel};
pub use auto::AccelChoice;
pub use bvh::Bvh;
pub use filter::{HitQueries, IntersectFilter, OccludedFilter};
pub use grid::mailbox::MailboxKind;
pub use grid::{Assign, GridOctree, GridParams};
pub use instances::{InstancedObjects, TwoLevel};
pub use intersector::{Intersector, IntersectorKind};
pub use none::Unculled;
pub use params::AccelParams;
pub use probe::{Count, NoProbe, Probe, RayCounts};
pub use query::Tested;
pub use query_batch::Pencil;
pub use refine::Refined;
pub use shapes::{BitSet, Object, Shapes, SpherePrim};
pub use stats::StructureStats;
pub use transform::Transformed;
pub use volumes::Volumes;
pub use wide::{Listed, Splitting, TraceMode, Wide};

use bytemuck::{Pod, Zeroable};

use crate::math::Vec3;
pub use crate::math::cone::Cone;

/// Prim id of "nothing": the prim of a miss, and the `exclude` of a ray that excludes nothing.
pub const NO_PRIM: u32 = u32::MAX;

/// A ray in the centred frame of its [`Shapes`]: [`World::ray`](crate::render::World::ray) makes one from a point in the
/// world. `dir` need not be of unit length; t is measured in lengths of `dir`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Origin.
    pub origin: Vec3,
    /// Smallest t of a hit, inclusive.
    pub t_min: f32,
    /// Direction, any finite length but zero.
    pub dir: Vec3,
    /// Largest t of a hit, inclusive; may be infinite.
    pub t_max: f32,
    /// Prim that cannot be hit: the planar one on which the ray starts; or [`NO_PRIM`].
    pub exclude: u32,
    /// The sample that owns the ray; ignored by every structure.
    pub sample: u32,
}

impl Ray {
    /// Creates an unbounded ray from `t_min` 0 that excludes no prim.
    pub const fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 }
    }

    /// Origin and `t_min`, then direction and `t_max`: two rows of four numbers, each of which is loaded at once.
    #[inline(always)]
    pub(crate) fn in_fours(&self) -> [&[f32; 4]; 2] {
        let [from, to] = &bytemuck::cast_ref::<Self, RayWords>(self).numbers;
        [from, to]
    }

    /// Makes a ray from two rows of four numbers.
    #[inline(always)]
    pub(crate) fn from_fours(numbers: [[f32; 4]; 2], exclude: u32, sample: u32) -> Self {
        bytemuck::cast(RayWords { numbers, others: [exclude, sample] })
    }
}

/// Layout of a [`Ray`] in words.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct RayWords {
    numbers: [[f32; 4]; 2],
    others: [u32; 2],
}

/// Intersection of a ray with a shape. Geometry only: the caller looks up the material.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Hit {
    /// Distance in lengths of the ray's direction; infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second corner; 0 for other shapes.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner; 0 for other shapes.
    pub v: f32,
    /// Index of the prim over all shapes (see [`Shapes`]), or [`NO_PRIM`]. [`World::source`](crate::render::World::source)
    /// maps it to the scene.
    pub prim: u32,
}

impl Hit {
    /// Precedes every hit: the start for [`Accel::next`].
    pub const BEFORE_ALL: Self = Self { t: f32::NEG_INFINITY, u: 0.0, v: 0.0, prim: 0 };

    /// No hit.
    pub const MISS: Self = Self { t: f32::INFINITY, u: 0.0, v: 0.0, prim: NO_PRIM };

    /// t, u, v, and the bits of prim: one row of four numbers, which is loaded at once.
    #[inline(always)]
    pub(crate) fn as_four(&self) -> &[f32; 4] {
        bytemuck::cast_ref(self)
    }

    /// Makes hits from rows of four numbers.
    #[inline(always)]
    pub(crate) fn from_fours<const N: usize>(fours: [[f32; 4]; N]) -> [Self; N] {
        fours.map(bytemuck::cast)
    }

    /// t, u, v and prim as bits: equal only if two hits are equal in every bit.
    pub fn bits(&self) -> [u32; 4] {
        [self.t.to_bits(), self.u.to_bits(), self.v.to_bits(), self.prim]
    }

    /// Whether anything was hit.
    pub fn is_some(&self) -> bool {
        self.prim != NO_PRIM
    }

    /// Whether this hit precedes `other`: smaller t, or the lower prim at equal t.
    pub fn before(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && self.prim < other.prim)
    }
}

/// A structure that answers ray queries. Built once, then read-only.
///
/// Calls run on the calling thread: for several threads, divide the rays and give each thread its own scratch value.
///
/// # Panics
///
/// A call may panic unless its slices have equal lengths and the scratch value comes from the same structure.
pub trait Accel: Sync {
    /// Scratch memory of a query (stack, mailbox): one per worker, reused for every batch.
    type Scratch: Send;

    /// Creates a scratch value.
    fn scratch(&self) -> Self::Scratch;

    /// Finds the first hit of each ray in `t_min..=t_max`, or the first there that comes after another in the order (t,
    /// prim), or [`Hit::MISS`]. Hits that the queries' filter rejects may or may not be skipped.
    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P);

    /// Finds whether anything *opaque* is hit in `t_min..=t_max` of each ray: prims with a bit in [`Shapes::opaque`]. In a
    /// scene, faces of masked, blended and transmissive materials are opaque only where their maps let nothing through;
    /// [`Self::closest`] finds hits with any prim.
    fn occluded<P: Probe>(&self, rays: &[Ray], occluded: &mut [bool], scratch: &mut Self::Scratch, probe: &mut P) {
        self.occluded_filtered(rays, None, occluded, scratch, probe);
    }

    /// [`Self::occluded`] that also counts other prims, wherever `filter` decides that they block the ray.
    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    );

    /// Finds the first hit of each ray in `t_min..=t_max`; [`Hit::MISS`] if there is none.
    fn closest<P: Probe>(&self, rays: &[Ray], hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        self.first_hits(&HitQueries::along(rays), hits, scratch, probe);
    }

    /// Finds the first hit of each ray in `t_min..=t_max` that comes after `after` in the order (t, prim). Repeated from
    /// [`Hit::BEFORE_ALL`] until [`Hit::MISS`], it enumerates all hits.
    fn next<P: Probe>(
        &self,
        rays: &[Ray],
        after: &[Hit],
        hits: &mut [Hit],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    ) {
        self.first_hits(&HitQueries { after: Some(after), ..HitQueries::along(rays) }, hits, scratch, probe);
    }
}
