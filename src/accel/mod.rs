//! What does this ray hit? Shapes in, hits out; nothing here knows of materials, files, threads or printing.
//!
//! # The hit contract
//! Hits are ordered by (t, prim). Every structure gives, for every ray, the same hits bit for bit as
//! [`none`](none::Unculled), which tests everything: the verdict of each shape's test is exact for the `f32` ray and
//! vertices (`math::triangle`), t is a pure function of (ray, prim), and culling is conservative by the margins that
//! `math::bounds` derives.
//!
//! That holds for rays and shapes within ±1e27: distances to spheres and cones that are farther away overflow on the way, in one
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

/// The prim id of "nothing": the answer of a ray that misses, and the `exclude` of a ray that excludes nothing.
pub const NO_PRIM: u32 = u32::MAX;

/// One ray, in the centred frame of its [`Shapes`]: [`World::ray`](crate::render::World::ray) makes one of a place in the
/// world. `dir` need not be of unit length; t counts in its lengths.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Start.
    pub origin: Vec3,
    /// Hits count from here, inclusive.
    pub t_min: f32,
    /// Direction, any finite length but zero.
    pub dir: Vec3,
    /// Hits count up to here, inclusive; may be infinite.
    pub t_max: f32,
    /// A prim that cannot be hit: the planar one the ray starts on; or [`NO_PRIM`].
    pub exclude: u32,
    /// The sample that owns the ray; no structure looks at it.
    pub sample: u32,
}

impl Ray {
    /// From a place of the shapes' frame on without end, past nothing.
    pub const fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 }
    }

    /// Origin and `t_min`, direction and `t_max`: four numbers in a row each, which lanes read at once.
    #[inline(always)]
    pub(crate) fn in_fours(&self) -> [&[f32; 4]; 2] {
        let [from, to] = &bytemuck::cast_ref::<Self, RayWords>(self).numbers;
        [from, to]
    }

    /// A ray from two rows of four numbers.
    #[inline(always)]
    pub(crate) fn from_fours(numbers: [[f32; 4]; 2], exclude: u32, sample: u32) -> Self {
        bytemuck::cast(RayWords { numbers, others: [exclude, sample] })
    }
}

/// A [`Ray`] by its words.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct RayWords {
    numbers: [[f32; 4]; 2],
    others: [u32; 2],
}

/// Where a ray meets a shape. Geometry only: the caller looks up what it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Hit {
    /// Distance in lengths of the ray's direction; infinite for a miss.
    pub t: f32,
    /// Barycentric weight of the triangle's second corner; 0 for other shapes.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner; 0 for other shapes.
    pub v: f32,
    /// What was hit, an index over all shapes (see [`Shapes`]), or [`NO_PRIM`]. What of a scene that is says
    /// [`World::source`](crate::render::World::source).
    pub prim: u32,
}

impl Hit {
    /// Before every hit: what [`Accel::next`] begins with.
    pub const BEFORE_ALL: Self = Self { t: f32::NEG_INFINITY, u: 0.0, v: 0.0, prim: 0 };

    /// No hit.
    pub const MISS: Self = Self { t: f32::INFINITY, u: 0.0, v: 0.0, prim: NO_PRIM };

    /// t, u, v, and the bits of prim: four numbers in a row, which lanes read at once.
    #[inline(always)]
    pub(crate) fn as_four(&self) -> &[f32; 4] {
        bytemuck::cast_ref(self)
    }

    /// Hits from rows of four numbers.
    #[inline(always)]
    pub(crate) fn from_fours<const N: usize>(fours: [[f32; 4]; N]) -> [Self; N] {
        fours.map(bytemuck::cast)
    }

    /// t, u, v and prim as bits: equal only where every bit of two hits is.
    pub fn bits(&self) -> [u32; 4] {
        [self.t.to_bits(), self.u.to_bits(), self.v.to_bits(), self.prim]
    }

    /// Whether anything was hit.
    pub fn is_some(&self) -> bool {
        self.prim != NO_PRIM
    }

    /// Whether this hit comes before `other`: smaller t, or the lower prim at equal t.
    pub fn before(&self, other: &Self) -> bool {
        self.t < other.t || (self.t == other.t && self.prim < other.prim)
    }
}

/// One way of answering what rays hit. Built once, then only read.
///
/// Calls answer on the thread that asks: for several threads, cut the rays into parts and give each thread a scratch value.
///
/// # Panics
///
/// Slices of one call have equal lengths, and a scratch value comes from the structure that is asked; else a call may panic.
pub trait Accel: Sync {
    /// What a query writes to (stack, mailbox): one per worker, reused for every batch.
    type Scratch: Send;

    /// A fresh scratch value.
    fn scratch(&self) -> Self::Scratch;

    /// The first hit of each ray in `t_min..=t_max`, or the first there that comes after another in the order (t, prim), but for
    /// hits that their filter rejects: some of these may be passed, or none. [`Hit::MISS`] where there is none.
    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P);

    /// Whether anything *opaque* lies in `t_min..=t_max` of each ray: prims with a bit in [`Shapes::opaque`]. In a
    /// scene, faces of masked, blended and transmissive materials are opaque only where their maps let nothing through;
    /// whether anything at all lies there says [`Self::closest`].
    fn occluded<P: Probe>(&self, rays: &[Ray], occluded: &mut [bool], scratch: &mut Self::Scratch, probe: &mut P) {
        self.occluded_filtered(rays, None, occluded, scratch, probe);
    }

    /// [`Self::occluded`], and whether any other prim is in the way that stops light where a ray meets it, as `filter` decides.
    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut Self::Scratch,
        probe: &mut P,
    );

    /// The first hit of each ray in `t_min..=t_max`; [`Hit::MISS`] where there is none.
    fn closest<P: Probe>(&self, rays: &[Ray], hits: &mut [Hit], scratch: &mut Self::Scratch, probe: &mut P) {
        self.first_hits(&HitQueries::along(rays), hits, scratch, probe);
    }

    /// The first hit of each ray in `t_min..=t_max` that comes after `after` in the order (t, prim). All hits are found one
    /// after the other from [`Hit::BEFORE_ALL`] on, until one is [`Hit::MISS`].
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
