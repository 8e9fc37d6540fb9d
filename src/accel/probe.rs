//! Counting as a type parameter: timed runs carry [`NoProbe`], counted runs [`RayCounts`].
//!
//! Names are V. Havran's, from the statistics to Haines' Standard Procedural Databases (1999).

use crate::math::aabb::Aabb;
use crate::math::simd::LANES;
use crate::math::{DVec3, Vec3};
use std::ops::AddAssign;

/// Observer of a walk.
///
/// Costly details come as closures, which only probes that record them call.
pub trait Probe: Default + Send {
    /// Whether the probe records nothing, so that rays may be traced in any way that gives the same answers.
    const SILENT: bool = false;

    /// Whether the probe sees enough rays for exact walks to be compiled for every instruction set.
    const OF_PICTURES: bool = Self::SILENT;

    /// Records a query of one ray.
    fn query(&mut self) {}
    /// Records a step into a node or cell (n_ts).
    fn step(&mut self) {}
    /// Records the node or cell visited, once per step; probes that record nothing never call the closure.
    #[inline(always)]
    fn visit(&mut self, _visit: impl FnOnce() -> Visit) {}
    /// Records a visit to a leaf cell (n_ets), `empty` if nothing is listed in it (n_eets).
    fn cell(&mut self, _empty: bool) {}
    /// Records one ray/prim test (n_it).
    fn prim_test(&mut self) {}
    /// Records `count` ray/prim tests.
    fn prim_tests(&mut self, _count: u32) {}
    /// Records the outcome of a test.
    #[inline(always)]
    fn tested(&mut self, _test: impl FnOnce() -> Test) {}
    /// Records the outcome of tests of a block of prims: the same for each lane with its bit in `lanes`.
    #[inline(always)]
    fn lanes_tested(&mut self, _prims: &[u32; LANES], _lanes: u32, _outcome: Outcome) {}
    /// Records a test of this prim that the mailbox saved (n_mb).
    fn repeat_skipped(&mut self, _prim: u32) {}
    /// Records `count` ray/volume tests (n_bit).
    fn volume_tests(&mut self, _count: usize) {}
    /// Records `count` transformed corners or other points, into the ray's axes or to an object's place (n_xf).
    fn transforms(&mut self, _count: usize) {}
    /// Records that the query found a hit.
    fn found(&mut self) {}
}

/// Visit of a walk to a node or cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// The node or cell.
    pub place: NodeId,
    /// Extent in the frame of the shapes.
    pub extent: Extent,
    /// Number of prims listed in it; `None` for an inner node.
    pub listed: Option<u32>,
}

/// Identity of a node or cell in its structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeId {
    /// A cell of a grid, by column, row and layer.
    Cell([u32; 3]),
    /// An octree node in a cell: its least corner and log2 of its side, in units of the finest possible cell.
    OctreeNode([u32; 3], u32),
    /// An octree leaf, identified likewise.
    Octant([u32; 3], u32),
    /// An inner node of a hierarchy.
    Node(u32),
    /// A leaf of a hierarchy.
    Leaf(u32),
    /// A leaf that is a block of triangles, tested at once.
    Block(u32),
    /// A leaf of other prims.
    Run(u32),
    /// A node of the hierarchy over the places of instanced objects.
    Places(u32),
    /// A node of the tree of an instanced object: the first prim of the placed object, and the node.
    PlacedNode(u32, u32),
    /// A block of triangles of an instanced object, identified likewise.
    PlacedBlock(u32, u32),
    /// The bounding volume of an object.
    Object(u32),
}

/// Extent of a node or cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// A box.
    Box(Aabb),
    /// A sphere.
    Ball {
        /// Centre of the sphere.
        center: DVec3,
        /// Radius of the sphere.
        radius: f64,
    },
}

impl Extent {
    /// Smallest box around the extent.
    #[expect(clippy::cast_possible_truncation, reason = "a box to be looked at")]
    pub fn bounds(&self) -> Aabb {
        match *self {
            Self::Box(bounds) => bounds,
            Self::Ball { center, radius } => {
                let (center, radius) = (center.as_vec3(), Vec3::splat(radius as f32));
                Aabb { lo: center - radius, hi: center + radius }
            }
        }
    }
}

/// Result of a ray/prim test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// The prim tested.
    pub prim: u32,
    /// Distance of the hit; NaN if the ray misses or the distance was not computed.
    pub t: f32,
    /// Outcome of the test.
    pub outcome: Outcome,
}

/// Outcome of a ray/prim test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// The ray misses the prim.
    Miss,
    /// The prim is in a tested block but does not count: the ray starts on it, it is not opaque in a query for opaque prims
    /// only, or the query is already answered.
    LeftOut,
    /// The prim is hit, but outside the query's range.
    OutOfRange,
    /// The prim is hit where it lets light through, or may do so in part, and the hit does not count for the query.
    LetThrough,
    /// The prim is hit, but an earlier hit is known.
    Farther,
    /// The prim is hit, before all known hits.
    Hit,
}

impl Outcome {
    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Miss => "miss",
            Self::LeftOut => "left out",
            Self::OutOfRange => "out of range",
            Self::LetThrough => "lets light through",
            Self::Farther => "farther",
            Self::Hit => "hit",
        }
    }
}

/// Probe of timed runs: every call is an empty inline function.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    const SILENT: bool = true;
}

/// Counts summed over the rays of one class; divide by `queries` for Havran's per-ray figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Queries, one per ray.
    pub queries: u64,
    /// Queries that found a hit.
    pub found: u64,
    /// Nodes and cells visited.
    pub n_ts: u64,
    /// Leaf cells visited.
    pub n_ets: u64,
    /// Empty leaf cells visited.
    pub n_eets: u64,
    /// Ray/prim tests.
    pub n_it: u64,
    /// Tests saved by the mailbox.
    pub n_mb: u64,
    /// Ray/volume tests.
    pub n_bit: u64,
    /// Points transformed into the axes of a ray, or to an object's place.
    pub n_xf: u64,
}

impl RayCounts {
    /// All counts with their names, in the order of reports.
    pub fn named(&self) -> [(&'static str, u64); Count::ALL.len()] {
        Count::ALL.map(|count| (count.name(), count.of(self)))
    }
}

/// Name of a count in [`RayCounts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// Ray/prim tests.
    It,
    /// Nodes and cells visited.
    Ts,
    /// Leaf cells visited.
    Ets,
    /// Empty leaf cells visited.
    Eets,
    /// Ray/volume tests.
    Bit,
    /// Tests saved by the mailbox.
    Mb,
    /// Points transformed into the ray's axes, or corners of instanced objects to their places.
    Xf,
}

impl Count {
    /// Every count, in the order of reports.
    pub const ALL: [Self; 7] = [Self::It, Self::Ts, Self::Ets, Self::Eets, Self::Bit, Self::Mb, Self::Xf];

    /// V. Havran's name, or ours in his style.
    pub const fn name(self) -> &'static str {
        match self {
            Self::It => "n_it",
            Self::Ts => "n_ts",
            Self::Ets => "n_ets",
            Self::Eets => "n_eets",
            Self::Bit => "n_bit",
            Self::Mb => "n_mb",
            Self::Xf => "n_xf",
        }
    }

    /// Value of this count.
    pub const fn of(self, counts: &RayCounts) -> u64 {
        match self {
            Self::It => counts.n_it,
            Self::Ts => counts.n_ts,
            Self::Ets => counts.n_ets,
            Self::Eets => counts.n_eets,
            Self::Bit => counts.n_bit,
            Self::Mb => counts.n_mb,
            Self::Xf => counts.n_xf,
        }
    }
}

impl Probe for RayCounts {
    const OF_PICTURES: bool = true;

    fn query(&mut self) {
        self.queries += 1;
    }
    fn step(&mut self) {
        self.n_ts += 1;
    }
    fn cell(&mut self, empty: bool) {
        self.n_ets += 1;
        self.n_eets += u64::from(empty);
    }
    fn prim_test(&mut self) {
        self.n_it += 1;
    }
    fn prim_tests(&mut self, count: u32) {
        self.n_it += u64::from(count);
    }
    fn repeat_skipped(&mut self, _prim: u32) {
        self.n_mb += 1;
    }
    fn volume_tests(&mut self, count: usize) {
        self.n_bit += count as u64;
    }
    fn transforms(&mut self, count: usize) {
        self.n_xf += count as u64;
    }
    fn found(&mut self) {
        self.found += 1;
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.queries += o.queries;
        self.found += o.found;
        self.n_ts += o.n_ts;
        self.n_ets += o.n_ets;
        self.n_eets += o.n_eets;
        self.n_it += o.n_it;
        self.n_mb += o.n_mb;
        self.n_bit += o.n_bit;
        self.n_xf += o.n_xf;
    }
}
