//! Traversal of the tree by a single ray, nearer children first.

use std::marker::PhantomData;

use super::block_cache::BlockCache;
use super::flight::Slots;
use super::node::{Child, Node, Tree};
use super::packet::StackEntry;
use super::slabs::{BoxMargins, Slabs};
use crate::accel::query::{Goal, Query};
use crate::accel::query_batch::{QueryBatch, begin, end};
use crate::accel::{Hit, Intersector, NoProbe, Probe, Shapes};
use crate::math::Vec3;
use crate::math::simd::{Kernel, LANES, Portable, Simd};
use crate::math::triangles::{RayLanes, reach};

/// A child still to be visited, with the distance at which the ray enters its box.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    pub near: f32,
    pub child: u32,
}

/// Stack of children still to be visited, the nearest last, with room for the depth of its tree.
#[derive(Clone, Debug, Default)]
pub struct Stack {
    /// Entries of one ray.
    pub(super) entries: Vec<Entry>,
    /// Entries of a packet.
    pub(super) branches: Vec<StackEntry>,
    pub(super) cache: BlockCache,
    /// Slots of the rays in flight.
    pub(super) slots: Slots,
}

impl Stack {
    /// Largest number of children of one ray that fit.
    pub(in crate::accel) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Creates a stack for walks down `tree`.
    pub(super) fn new(tree: &Tree) -> Self {
        let most = tree.most_behind();
        Self { entries: vec![Entry::default(); most], branches: vec![StackEntry::default(); most], ..Self::default() }
    }
}

/// Kernel that traces rays one after another.
pub(super) struct OneByOne<'w, W, P, B> {
    pub tree: &'w Tree<'w>,
    pub shapes: &'w Shapes,
    pub batch: &'w mut W,
    pub stack: &'w mut Stack,
    pub probe: &'w mut P,
    pub margins: PhantomData<B>,
}

impl<W: QueryBatch, P: Probe, B: BoxMargins> Kernel for OneByOne<'_, W, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, batch, stack: Stack { entries: stack, .. }, probe, .. } = self;
        let Some(root) = tree.nodes.first().filter(|_| shapes.planes.is_empty()) else {
            for i in 0..batch.rays().len() {
                trace_one::<B, _, _, _>(s, tree, shapes, batch, i, stack, probe);
            }
            return;
        };
        for i in 0..batch.rays().len() {
            let ray = &batch.rays()[i];
            if !(B::allow(tree, ray.origin) && has_direction(ray.dir)) {
                trace_one::<B, _, _, _>(s, tree, shapes, batch, i, stack, probe);
                continue;
            }
            // Many rays meet no box at all, and need no more than this.
            let slabs = Slabs::<B>::new(ray.origin, ray.dir, batch.t_min(i));
            let met = slabs.meets(s, root, B::widened(ray.t_max));
            if P::SILENT && met.1 == 0 {
                batch.take(i, Hit::MISS);
                continue;
            }
            let (mut query, usable) = begin(shapes, batch, i, probe);
            if usable {
                descend(s, tree, &slabs, met, &mut query, stack, probe);
            }
            end(batch, i, &query, probe);
        }
    }
}

/// Whether the direction is finite and not zero.
#[inline(always)]
fn has_direction(dir: Vec3) -> bool {
    let (x, y, z) = (dir.x.abs(), dir.y.abs(), dir.z.abs());
    (x <= f32::MAX) & (y <= f32::MAX) & (z <= f32::MAX) & ((x > 0.0) | (y > 0.0) | (z > 0.0))
}

/// Traces a ray that cannot be tested against padded boxes. Such rays are rare: code for one instruction set suffices.
#[cold]
#[inline(never)]
pub(super) fn trace_alone<B: BoxMargins, W: QueryBatch>(
    tree: &Tree,
    shapes: &Shapes,
    batch: &mut W,
    i: usize,
    stack: &mut [Entry],
) {
    trace_one::<B, _, _, _>(Portable, tree, shapes, batch, i, stack, &mut NoProbe);
}

/// Traces a single ray through prims of any kind.
#[inline(always)]
fn trace_one<B: BoxMargins, S: Simd, W: QueryBatch, P: Probe>(
    s: S,
    tree: &Tree,
    shapes: &Shapes,
    batch: &mut W,
    i: usize,
    stack: &mut [Entry],
    probe: &mut P,
) {
    let (mut query, usable) = begin(shapes, batch, i, probe);
    if usable && !query.test_planes(probe) {
        walk::<B, _, _, _>(s, tree, &mut query, stack, probe);
    }
    end(batch, i, &query, probe);
}

/// Kernel that walks one query down the tree.
pub(super) struct Walk<'w, 'q, G: Goal, P, B> {
    pub tree: &'w Tree<'w>,
    pub query: &'w mut Query<'q, G>,
    pub stack: &'w mut Stack,
    pub probe: &'w mut P,
    pub margins: PhantomData<B>,
}

impl<G: Goal, P: Probe, B: BoxMargins> Kernel for Walk<'_, '_, G, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        walk::<B, _, _, _>(s, self.tree, self.query, &mut self.stack.entries, self.probe);
    }
}

/// Traverses from the root to every leaf that the ray may hit, the nearest first.
#[inline(always)]
fn walk<B: BoxMargins, S: Simd, G: Goal, P: Probe>(
    s: S,
    tree: &Tree,
    query: &mut Query<G>,
    stack: &mut [Entry],
    probe: &mut P,
) {
    if tree.nodes.is_empty() {
        return;
    }
    if !B::allow(tree, query.ray.origin) {
        return query.test_all(probe);
    }
    let slabs = Slabs::<B>::new(query.ray.origin, query.ray.dir, query.t_min);
    let met = slabs.meets(s, &tree.nodes[0], B::widened(query.reach()));
    descend(s, tree, &slabs, met, query, stack, probe);
}

/// Traverses from the root, of whose boxes the ray meets `met`, to every leaf that the ray may hit, the nearest first.
#[inline(always)]
fn descend<B: BoxMargins, S: Simd, G: Goal, P: Probe>(
    s: S,
    tree: &Tree,
    slabs: &Slabs<B>,
    met: (S::Lanes, u32),
    query: &mut Query<G>,
    stack: &mut [Entry],
    probe: &mut P,
) {
    let lanes = RayLanes::new(s, &query.ray, reach(query.ray.origin, &tree.bounds));
    let (mut near, mut met) = met;
    let mut limit = B::widened(query.reach());
    let (mut node, mut top) = (&tree.nodes[0], 0);
    probe.visit(|| tree.visit(0, query.shapes()));
    loop {
        probe.step();
        probe.volume_tests(LANES);
        let mut child = if met != 0 {
            nearest(s, node, near, met, stack, &mut top)
        } else {
            match pop(stack, &mut top, limit) {
                Some(child) => child,
                None => return,
            }
        };
        let inner = loop {
            probe.visit(|| tree.visit(child, query.shapes()));
            let leaf = match Child::unpack(child) {
                Child::Node(inner) => break inner,
                leaf => leaf,
            };
            probe.step();
            probe.cell(false);
            if test_leaf(s, tree, leaf, &lanes, query, probe) {
                return;
            }
            limit = B::widened(query.reach());
            match pop(stack, &mut top, limit) {
                Some(next) => child = next,
                None => return,
            }
        };
        node = &tree.nodes[inner as usize];
        (near, met) = slabs.meets(s, node, limit);
    }
}

/// Pops the next child that may hold a hit up to `limit`.
#[inline(always)]
pub(super) fn pop(stack: &[Entry], top: &mut usize, limit: f32) -> Option<u32> {
    while *top > 0 {
        *top -= 1;
        let entry = stack[*top];
        if entry.near <= limit {
            return Some(entry.child);
        }
    }
    None
}

/// Tests the prims of a leaf, and returns whether the query is answered.
#[inline(always)]
fn test_leaf<S: Simd, G: Goal, P: Probe>(
    s: S,
    tree: &Tree,
    leaf: Child,
    lanes: &RayLanes<S>,
    query: &mut Query<G>,
    probe: &mut P,
) -> bool {
    match leaf {
        Child::Block(block, count) if G::Test::EXACT => {
            let block = &tree.blocks[block as usize];
            let verdicts = lanes.verdicts(s, &block.corners);
            query.test_block(&block.prims, &block.corners, count, verdicts, probe)
        }
        Child::Block(block, count) => {
            tree.blocks[block as usize].prims[..count as usize].iter().any(|&prim| query.test(prim, probe))
        }
        Child::Run(run) => tree.run(run).iter().any(|&prim| query.test(prim, probe)),
        Child::Node(_) => false,
    }
}

/// Pushes the children in `met`, of which there must be at least one, except the nearest, which is returned.
#[inline(always)]
pub(super) fn nearest<S: Simd>(
    s: S,
    node: &Node,
    near: S::Lanes,
    mut met: u32,
    stack: &mut [Entry],
    top: &mut usize,
) -> u32 {
    let lane = met.trailing_zeros() as usize % LANES;
    met &= met - 1;
    if met == 0 {
        return node.children[lane];
    }
    let near = s.store(near);
    let entry = |lane: usize| Entry { near: near[lane], child: node.children[lane] };
    let mut nearest = entry(lane);
    let bottom = *top;
    while met != 0 {
        let next = entry(met.trailing_zeros() as usize % LANES);
        met &= met - 1;
        let farther = if next.near < nearest.near { std::mem::replace(&mut nearest, next) } else { next };
        // Insertion sort: farther entries lie deeper.
        let mut at = *top;
        while at > bottom && stack[at - 1].near < farther.near {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = farther;
        *top += 1;
    }
    nearest.child
}
