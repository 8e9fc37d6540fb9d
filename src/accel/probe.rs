//! Counting is a type: timed runs carry [`NoProbe`], counted runs [`RayCounts`].
//!
//! Names are V. Havran's, from the statistics to Haines' Standard Procedural Databases (1999).

use crate::math::aabb::Aabb;
use crate::math::simd::LANES;
use crate::math::{DVec3, Vec3};
use std::ops::AddAssign;

/// What a walk tells about itself while it runs.
///
/// Costly details come as closures, which only probes that record them call.
pub trait Probe: Default + Send {
    /// Whether it hears nothing, so that rays may be asked in any way that gives the same answers.
    const SILENT: bool = false;

    /// Whether it counts so many rays that exact walks are compiled for every instruction set, or hears of few.
    const OF_PICTURES: bool = Self::SILENT;

    /// One ray was asked of the scene.
    fn query(&mut self) {}
    /// A node or cell was entered (n_ts).
    fn step(&mut self) {}
    /// The node or cell that is visited, once for each step; probes that record nothing never call the closure.
    #[inline(always)]
    fn visit(&mut self, _visit: impl FnOnce() -> Visit) {}
    /// A leaf cell was visited (n_ets), `empty` if nothing is listed in it (n_eets).
    fn cell(&mut self, _empty: bool) {}
    /// One ray/prim test (n_it).
    fn prim_test(&mut self) {}
    /// So many ray/prim tests at once.
    fn prim_tests(&mut self, _count: u32) {}
    /// What came of a test.
    #[inline(always)]
    fn tested(&mut self, _test: impl FnOnce() -> Test) {}
    /// What came of tests of a block of prims: the same for each that has its bit in `lanes`.
    #[inline(always)]
    fn lanes_tested(&mut self, _prims: &[u32; LANES], _lanes: u32, _outcome: Outcome) {}
    /// A test of this prim that the mailbox saved (n_mb).
    fn repeat_skipped(&mut self, _prim: u32) {}
    /// So many ray/volume tests at once (n_bit).
    fn volume_tests(&mut self, _count: usize) {}
    /// So many corners and other points were transformed, into the ray's axes or to where an object stands (n_xf).
    fn transforms(&mut self, _count: usize) {}
    /// The query found a hit.
    fn found(&mut self) {}
}

/// A node or cell that a walk visits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// Which one.
    pub place: NodeId,
    /// The room it takes, in the frame of the shapes.
    pub extent: Extent,
    /// Prims listed in it; `None` where it leads to other nodes.
    pub listed: Option<u32>,
}

/// A node or cell by its place in its structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeId {
    /// A cell of a grid, by column, row and layer.
    Cell([u32; 3]),
    /// A node of an octree in a cell: its least corner and the logarithm of its side, in the finest cells there can be.
    OctreeNode([u32; 3], u32),
    /// A leaf of an octree, likewise.
    Octant([u32; 3], u32),
    /// A node of a hierarchy.
    Node(u32),
    /// A leaf of a hierarchy.
    Leaf(u32),
    /// A leaf that is a block of triangles, tested at once.
    Block(u32),
    /// A leaf of other prims.
    Run(u32),
    /// A node of the hierarchy over the places where instanced objects stand.
    Places(u32),
    /// A node of the tree of an instanced object: the first prim of the object where it stands, and the node.
    PlacedNode(u32, u32),
    /// A block of triangles of an instanced object, likewise.
    PlacedBlock(u32, u32),
    /// The volume around an object.
    Object(u32),
}

/// The room of a node or cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// A box.
    Box(Aabb),
    /// A sphere.
    Ball {
        /// Its centre.
        center: DVec3,
        /// Its radius.
        radius: f64,
    },
}

impl Extent {
    /// The smallest box around it.
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

/// A ray/prim test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// Which prim.
    pub prim: u32,
    /// Where the ray meets it; NaN where it does not, or where that was not computed.
    pub t: f32,
    /// What came of it.
    pub outcome: Outcome,
}

/// What comes of a ray/prim test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// The ray passes by.
    Miss,
    /// It was in a block of prims but does not count: the ray starts on it, it is not opaque and only opaque
    /// ones are looked for, or the answer is known already.
    LeftOut,
    /// It is hit, but not within the range that is asked about.
    OutOfRange,
    /// It is hit where it lets light through, or may do so in part, and what stops light is looked for.
    LetThrough,
    /// It is hit, but a hit before it is known.
    Farther,
    /// It is hit, before everything known so far.
    Hit,
}

impl Outcome {
    /// As printed.
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

/// Timed runs: every call is an empty inline function.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    const SILENT: bool = true;
}

/// Sums over the rays of one class; divide by `queries` for Havran's per-ray figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays asked.
    pub queries: u64,
    /// Rays that hit something.
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
    /// Points transformed into the axes of a ray, or to where an object stands.
    pub n_xf: u64,
}

impl RayCounts {
    /// What is counted of rays, with the names of all tables and in their order.
    pub fn named(&self) -> [(&'static str, u64); Count::ALL.len()] {
        Count::ALL.map(|count| (count.name(), count.of(self)))
    }
}

/// A count of [`RayCounts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// Ray/prim tests.
    It,
    /// Nodes and cells visited.
    Ts,
    /// Leaf cells visited.
    Ets,
    /// Empty ones among them.
    Eets,
    /// Ray/volume tests.
    Bit,
    /// Tests saved by the mailbox.
    Mb,
    /// Points transformed into the ray's axes, or corners of an instanced object to where it stands.
    Xf,
}

impl Count {
    /// Every count, in the order of reports.
    pub const ALL: [Self; 7] = [Self::It, Self::Ts, Self::Ets, Self::Eets, Self::Bit, Self::Mb, Self::Xf];

    /// V. Havran's name, or ours in his manner.
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

    /// Its value.
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
