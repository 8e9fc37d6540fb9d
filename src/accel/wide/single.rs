//! Rays one after another through a tree of blocks alone, tuned for the speed of a single ray.

use std::marker::PhantomData;

use super::best::Seeker;
use super::node::{Child, Node, Tree};
use super::pending_hits::PendingHits;
use super::prepared::{PreparedRay, PreparedRays};
use super::slabs::BoxMargins;
use super::walk::{Entry, trace_alone};
use crate::accel::Shapes;
use crate::accel::query::Goal;
use crate::accel::query_batch::QueryBatch;
use crate::math::simd::{Kernel, LANES, Simd};

/// A batch of rays to be traced one by one.
pub(super) struct TraceSingle<'w, W, B> {
    pub tree: &'w Tree<'w>,
    pub shapes: &'w Shapes,
    pub batch: &'w mut W,
    pub stack: &'w mut [Entry],
    pub margins: PhantomData<B>,
}

impl<W: QueryBatch, B: BoxMargins> Kernel for TraceSingle<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, batch, stack, .. } = self;
        let mut single = SingleRays::default();
        for start in (0..batch.rays().len()).step_by(LANES) {
            single.trace::<B, _, _>(s, tree, shapes, batch, (start, u32::MAX), stack);
        }
        single.finish(s, batch);
    }
}

/// Rays traced alone, but prepared and answered eight at a time.
#[derive(Default)]
pub(super) struct SingleRays {
    ready: PreparedRays,
    pending: PendingHits,
}

impl SingleRays {
    /// Traces the rays of a mask among the eight rays of a batch from `start` on, or as many as there are.
    #[inline(always)]
    pub(super) fn trace<B: BoxMargins, S: Simd, W: QueryBatch>(
        &mut self,
        s: S,
        tree: &Tree,
        shapes: &Shapes,
        batch: &mut W,
        (start, which): (usize, u32),
        stack: &mut [Entry],
    ) {
        self.ready.take::<B, _, _>(s, tree, batch, start);
        for i in start..batch.rays().len().min(start + LANES) {
            let lane = i - start;
            if which >> lane & 1 == 0 {
                continue;
            }
            if self.ready.allowed >> lane & 1 == 0 {
                trace_alone::<B, _>(tree, shapes, batch, i, stack);
                continue;
            }
            let ray = &self.ready.rays[lane % LANES];
            let mut seeker = Seeker::new(ray, self.ready.t_min[lane % LANES], i, self.ready.exclude[lane % LANES]);
            if W::Goal::ANY {
                descend_any::<B, _, _>(s, tree, shapes, batch, ray, &mut seeker, stack);
            } else {
                descend::<B, _, _>(s, tree, shapes, batch, ray, &mut seeker, stack);
            }
            self.pending.answer(s, tree, batch, i, seeker.found());
        }
    }

    /// Answers the waiting rays.
    #[inline(always)]
    pub(super) fn finish<S: Simd, W: QueryBatch>(&mut self, s: S, batch: &mut W) {
        self.pending.finish(s, batch);
    }
}

/// Traverses from the root to every leaf that the ray may hit, the nearest first.
#[inline(always)]
fn descend<B: BoxMargins, S: Simd, W: QueryBatch>(
    s: S,
    tree: &Tree,
    shapes: &Shapes,
    batch: &W,
    ray: &PreparedRay,
    seeker: &mut Seeker,
    stack: &mut [Entry],
) {
    let slabs = ray.slabs.spread(s);
    let (mut child, mut top) = (0, 0);
    loop {
        // A separate loop keeps its state in registers.
        while !Child::is_leaf(child) {
            let node = &tree.nodes[child as usize];
            let (near, met) = slabs.meets(s, node, seeker.limit);
            child = if met != 0 {
                nearest(s, node, near, met, stack, &mut top)
            } else {
                pop(stack, &mut top, seeker.limit).unwrap_or(Child::END)
            };
        }
        if seeker.test::<B, _, _>(s, &ray.sight, tree, shapes, batch, child) {
            return;
        }
        child = pop(stack, &mut top, seeker.limit).unwrap_or(Child::END);
    }
}

/// Traverses with a ray that any hit answers: its limit never changes, so children need no distances, and sorting them takes
/// longer than it saves.
#[inline(always)]
fn descend_any<B: BoxMargins, S: Simd, W: QueryBatch>(
    s: S,
    tree: &Tree,
    shapes: &Shapes,
    batch: &W,
    ray: &PreparedRay,
    seeker: &mut Seeker,
    stack: &mut [Entry],
) {
    let (slabs, limit) = (ray.slabs.spread(s), seeker.limit);
    stack[0] = Entry { near: 0.0, child: Child::END };
    let (mut child, mut top) = (0, 1);
    loop {
        while !Child::is_leaf(child) {
            let node = &tree.nodes[child as usize];
            let (_, mut met) = slabs.meets(s, node, limit);
            if met == 0 {
                top -= 1;
                child = stack[top].child;
                continue;
            }
            let mut lane = met.trailing_zeros() as usize % LANES;
            met &= met - 1;
            while met != 0 {
                stack[top] = Entry { near: 0.0, child: node.children[lane] };
                top += 1;
                lane = met.trailing_zeros() as usize % LANES;
                met &= met - 1;
            }
            child = node.children[lane];
        }
        if seeker.test::<B, _, _>(s, &ray.sight, tree, shapes, batch, child) {
            return;
        }
        top -= 1;
        child = stack[top].child;
    }
}

/// [`walk::pop`](super::walk::pop) with distances that are not negative, so that their bits have the same order, and words
/// compare faster than floats.
#[inline(always)]
fn pop(stack: &[Entry], top: &mut usize, limit: f32) -> Option<u32> {
    while *top > 0 {
        *top -= 1;
        let entry = stack[*top];
        if entry.near.to_bits() <= limit.to_bits() {
            return Some(entry.child);
        }
    }
    None
}

/// [`walk::nearest`](super::walk::nearest), by the bits of distances.
#[inline(always)]
fn nearest<S: Simd>(s: S, node: &Node, near: S::Lanes, mut met: u32, stack: &mut [Entry], top: &mut usize) -> u32 {
    let lane = met.trailing_zeros() as usize % LANES;
    met &= met - 1;
    if met == 0 {
        return node.children[lane];
    }
    let near = s.store(near).map(f32::to_bits);
    let mut nearest = (near[lane], node.children[lane]);
    let bottom = *top;
    while met != 0 {
        let lane = met.trailing_zeros() as usize % LANES;
        let next = (near[lane], node.children[lane]);
        met &= met - 1;
        let farther = if next.0 < nearest.0 { std::mem::replace(&mut nearest, next) } else { next };
        // Insertion sort: farther entries lie deeper.
        let mut at = *top;
        while at > bottom && stack[at - 1].near.to_bits() < farther.0 {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = Entry { near: f32::from_bits(farther.0), child: farther.1 };
        *top += 1;
    }
    nearest.1
}
