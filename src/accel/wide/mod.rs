//! The fast structures: a tree of 8-wide nodes, whose leaves are blocks of eight triangles.
//!
//! Two ways of splitting the scene share one memory layout (`node`), one proof (`check`) and three ways of tracing a batch:
//!
//! - `fast-octree` ([`Splitting::Octree`]): the uniform grid refined by octrees, kept as boxes. The scene's cube is cut at
//!   dyadic planes, those of grid and octree cells, and small cells by surface area; every part keeps the tight box of its
//!   prims instead of the cell, so that empty space is never visited.
//! - `fast-bvh` ([`Splitting::SurfaceArea`]): a hierarchy of boxes by the surface area heuristic in bins.
//!
//! In both, the binary tree is improved and collapsed into 8-wide nodes (`build`). Each prim is listed once, so there is no
//! mailbox: there would be nothing for it to save.
//!
//! Rays are traced one by one (`single`), many in flight (`flight`) or in packets of sixteen and more (`packet`; packets of a
//! pencil share entry points, `entry_point`, and prepared blocks, `block_cache`) through trees of triangles alone; with other
//! prims, and in counted runs, they go one by one through any tree (`walk`). Hits are ordered by (t, prim) and every test
//! gives an exact verdict, so that neither the order of visits nor the other rays can change an answer. Counts are those of
//! one ray at a time.
//!
//! An instanced object has a tree in its own frame, through which rays go one by one (`placed`).

mod best;
mod build;
mod check;
mod entry_point;
mod flight;
mod interval_ray;
mod listed;
mod packet_rays;
mod single;
// The kernels of `margins` are only compiled for vectors.
mod block_cache;
#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod margins;
mod node;
mod packet;
mod padded;
mod pending_hits;
mod placed;
mod prepared;
mod slabs;
pub(super) mod split;
#[cfg(test)]
mod tests;
mod walk;

pub(super) use build::ALIKE;
pub use listed::Listed;
pub use split::Splitting;

use std::marker::PhantomData;

use self::flight::{DEPTH, Flight, InFlight};
use self::node::{Arrays, Tree};
use self::packet::InPackets;
use self::single::TraceSingle;
use self::slabs::{BoxMargins, Derived};
pub(super) use self::walk::Stack;
use self::walk::{OneByOne, Walk};
use super::query::{Culling, Goal, Query};
use super::query_batch::QueryBatch;
use super::{NoProbe, Probe, Shapes};
use crate::math::simd::{Kernel, Level, WIDE, portably};

/// How the rays of a batch are traced. All modes give the same answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceMode {
    /// In packets where most rays run alike; else in flight, or one by one if there are few.
    Adaptive,
    /// One ray after another.
    OneByOne,
    /// Many rays at a time, each on its own path.
    InFlight,
    /// Packets of sixteen or thirty-two rays that run alike, the others one by one.
    Packets,
}

/// Largest tree, in bytes, that is served mostly from the caches: without prefetching the next nodes, rays in flight are 5 to
/// 12 % faster with trees of half a megabyte to four, and 7 % slower with one of fourteen (measured).
const NEAR: usize = 1 << 23;

/// Largest number of packets of a batch that are examined for coherence: examining all 256 of a batch of 4096 rays took some
/// percent of the time of rays that hit soon (measured).
const ASKED: usize = 32;

/// Fewest rays that are worth tracing in flight.
const MANY: usize = 2 * WIDE;

impl TraceMode {
    /// Mode for a batch, chosen by the share of packets whose rays have one octant, judged by three rays of each packet of a
    /// sample.
    fn of<W: QueryBatch>(batch: &W) -> Self {
        let octant = |i: usize| {
            let dir = batch.ray(i).dir;
            [dir.x, dir.y, dir.z].map(f32::is_sign_negative)
        };
        let packets = batch.rays().len() / WIDE;
        let asked = (0..packets).step_by(packets.div_ceil(ASKED).max(1)).map(|p| p * WIDE);
        let total = asked.len();
        let alike = asked.filter(|&i| octant(i) == octant(i + WIDE / 2) && octant(i) == octant(i + WIDE - 1)).count();
        match packets {
            0 => Self::OneByOne,
            _ if 2 * alike > total => Self::Packets,
            _ if batch.rays().len() >= MANY => Self::InFlight,
            _ => Self::OneByOne,
        }
    }
}

/// A tree of 8-wide nodes over shapes.
#[derive(Clone, Debug)]
pub struct Wide<'a> {
    shapes: &'a Shapes,
    splitting: Splitting,
    arrays: Arrays,
    level: Level,
    rays: TraceMode,
}

impl<'a> Wide<'a> {
    /// Builds the tree over the bounded prims; the same for every number of threads.
    pub fn build(shapes: &'a Shapes, splitting: Splitting) -> Self {
        Self::build_sample(shapes, splitting, 1)
    }

    /// Builds the tree over a sample of a scene, split as if there were `times` as many prims.
    pub(super) fn build_sample(shapes: &'a Shapes, splitting: Splitting, times: usize) -> Self {
        Self {
            shapes,
            splitting,
            arrays: build::build(shapes, splitting, times),
            level: Level::best(),
            rays: TraceMode::Adaptive,
        }
    }

    /// Selects another instruction set than the best one; the answers are the same.
    #[must_use]
    pub fn at_level(self, level: Level) -> Self {
        Self { level, ..self }
    }

    /// Selects another trace mode; the answers are the same.
    #[must_use]
    pub fn with_rays(self, rays: TraceMode) -> Self {
        Self { rays, ..self }
    }

    /// Walks with given margins.
    #[inline]
    fn walk_within<B: BoxMargins, G: Goal, P: Probe>(&self, query: &mut Query<G>, stack: &mut Stack, probe: &mut P) {
        self.run_narrow::<B, _>(Walk { tree: &self.tree(), query, stack, probe, margins: PhantomData::<B> });
    }

    /// Runs a kernel that walks with margins `B`. Unused levels are not compiled.
    #[inline]
    fn run<B: BoxMargins, K: Kernel>(&self, kernel: K) -> K::Output {
        if B::EVERY_LEVEL { self.level.run(kernel) } else { self.level.run_vectors(kernel) }
    }

    /// Runs a kernel that uses at most eight lanes.
    #[inline]
    fn run_narrow<B: BoxMargins, K: Kernel>(&self, kernel: K) -> K::Output {
        if B::EVERY_LEVEL { self.level.run_narrow(kernel) } else { self.level.run_vectors(kernel) }
    }

    #[inline]
    fn tree(&self) -> Tree<'_> {
        self.arrays.tree()
    }

    /// How the scene was split.
    pub fn splitting(&self) -> Splitting {
        self.splitting
    }
}

impl Culling for Wide<'_> {
    type Scratch = Stack;

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) -> Stack {
        Stack::new(&self.tree())
    }

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, stack: &mut Stack, probe: &mut P) {
        self.walk_within::<Derived, _, _>(query, stack, probe);
    }

    fn trace<W: QueryBatch, P: Probe>(&self, batch: &mut W, stack: &mut Stack, probe: &mut P) {
        self.trace_within::<Derived, _, _>(batch, stack, probe);
    }
}

/// Whether packets and rays in flight are allowed, like any way that gives the same answers: nothing is counted, and the test
/// is exact.
struct Together<W, P>(PhantomData<(W, P)>);

impl<W: QueryBatch, P: Probe> Together<W, P> {
    const MAY: bool = P::SILENT && W::Goal::EXACT;
    /// Whether compiling it for every instruction set pays.
    const ON_EVERY_LEVEL: bool = P::SILENT || P::OF_PICTURES && W::Goal::EXACT;
}

impl Wide<'_> {
    /// Traces a batch with given margins.
    fn trace_within<B: BoxMargins, W: QueryBatch, P: Probe>(&self, batch: &mut W, stack: &mut Stack, probe: &mut P) {
        // Where it is false, this branch is not compiled.
        if Together::<W, P>::MAY {
            return self.trace_together::<B, _>(batch, stack);
        }
        let (tree, shapes) = (&self.tree(), self.shapes);
        let kernel = OneByOne { tree, shapes, batch, stack, probe, margins: PhantomData::<B> };
        if Together::<W, P>::ON_EVERY_LEVEL { self.run_narrow::<B, _>(kernel) } else { portably(kernel) }
    }

    fn trace_together<B: BoxMargins, W: QueryBatch>(&self, batch: &mut W, stack: &mut Stack) {
        let (tree, shapes, margins) = (&self.tree(), self.shapes, PhantomData::<B>);
        if !shapes.planes.is_empty() || !tree.runs.is_empty() || tree.nodes.is_empty() {
            return self.run::<B, _>(OneByOne { tree, shapes, batch, stack, probe: &mut NoProbe, margins });
        }
        let Stack { entries, branches, slots, cache } = stack;
        let rays = if self.rays == TraceMode::Adaptive { TraceMode::of(batch) } else { self.rays };
        match rays {
            TraceMode::Packets => {
                self.run::<B, _>(InPackets { tree, shapes, batch, stack: branches, cache, entries, margins });
            }
            TraceMode::InFlight if tree.most_behind() < DEPTH => {
                let flight = Flight { tree, far: tree.bytes() > NEAR, shapes, batch, entries, margins };
                // Eight lanes are all that it uses: with AVX-512's masks it was 4 to 8 % slower on the one processor where
                // both were measured.
                self.run_narrow::<B, _>(InFlight { flight, slots });
            }
            _ => self.run::<B, _>(TraceSingle { tree, shapes, batch, stack: entries, margins }),
        }
    }
}
