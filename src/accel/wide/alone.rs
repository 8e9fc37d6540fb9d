//! Rays one after another through a tree of blocks alone, as fast as one ray goes.

use std::marker::PhantomData;

use super::best::Seeker;
use super::node::{Child, Node, Tree};
use super::ready::{Ready, ReadyRay};
use super::settle::Settle;
use super::slabs::BoxMargins;
use super::walk::{Entry, ask_by_itself};
use crate::accel::Shapes;
use crate::accel::wave::Wave;
use crate::math::simd::{Kernel, LANES, Simd};

/// A wave of rays.
pub(super) struct Alone<'w, W, B> {
    pub tree: &'w Tree,
    pub shapes: &'w Shapes,
    pub wave: &'w mut W,
    pub stack: &'w mut [Entry],
    pub margins: PhantomData<B>,
}

impl<W: Wave, B: BoxMargins> Kernel for Alone<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, wave, stack, .. } = self;
        let mut lone = Lone::default();
        for start in (0..wave.rays().len()).step_by(LANES) {
            lone.trace::<B, _, _>(s, tree, shapes, wave, start, stack);
        }
        lone.finish(s, wave);
    }
}

/// Rays that go alone, eight made ready and eight answered together.
#[derive(Default)]
pub(super) struct Lone {
    ready: Ready,
    settle: Settle,
}

impl Lone {
    /// Traces eight rays of a wave from `start` on, or as many as there are.
    #[inline(always)]
    pub(super) fn trace<B: BoxMargins, S: Simd, W: Wave>(
        &mut self,
        s: S,
        tree: &Tree,
        shapes: &Shapes,
        wave: &mut W,
        start: usize,
        stack: &mut [Entry],
    ) {
        self.ready.take::<B, _, _>(s, tree, wave, start);
        for i in start..wave.rays().len().min(start + LANES) {
            let lane = i - start;
            if self.ready.allowed >> lane & 1 == 0 {
                ask_by_itself::<B, _>(tree, shapes, wave, i, stack);
                continue;
            }
            let ray = &self.ready.rays[lane % LANES];
            let mut seeker = Seeker::<B>::new(ray, i, wave.rays()[i].exclude);
            descend(s, tree, shapes, wave, ray, &mut seeker, stack);
            self.settle.answer(s, tree, wave, i, seeker.found());
        }
    }

    /// Answers those that wait for it.
    #[inline(always)]
    pub(super) fn finish<S: Simd, W: Wave>(&mut self, s: S, wave: &mut W) {
        self.settle.finish(s, wave);
    }
}

/// From the root to every leaf that the ray may hit, the nearest first.
#[inline(always)]
fn descend<S: Simd, W: Wave, B: BoxMargins>(
    s: S,
    tree: &Tree,
    shapes: &Shapes,
    wave: &W,
    ray: &ReadyRay,
    seeker: &mut Seeker<B>,
    stack: &mut [Entry],
) {
    let slabs = ray.slabs.spread(s);
    let (mut node, mut top) = (&tree.nodes[0], 0);
    loop {
        let (near, met) = slabs.meets(s, node, seeker.limit);
        let mut child =
            if met != 0 { nearest(s, node, near, met, stack, &mut top) } else { pop(stack, &mut top, seeker.limit) };
        while Child::is_leaf(child) {
            if seeker.test(s, &ray.sight, tree, shapes, wave, child) {
                return;
            }
            child = pop(stack, &mut top, seeker.limit);
        }
        node = &tree.nodes[child as usize];
    }
}

/// The next child that may hold a hit up to `limit`, or [`Child::END`].
#[inline(always)]
fn pop(stack: &[Entry], top: &mut usize, limit: f32) -> u32 {
    while *top > 0 {
        *top -= 1;
        let entry = stack[*top];
        if entry.near <= limit {
            return entry.child;
        }
    }
    Child::END
}

/// Puts the children that are met, one at least, on the stack, but for the nearest, which is returned.
#[inline(always)]
fn nearest<S: Simd>(s: S, node: &Node, near: S::Lanes, mut met: u32, stack: &mut [Entry], top: &mut usize) -> u32 {
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
        // Insertion: the farther ones lie deeper.
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
