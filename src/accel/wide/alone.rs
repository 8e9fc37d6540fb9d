//! Rays one after another through a tree of blocks alone, as fast as one ray goes.

use std::marker::PhantomData;

use super::best::Seeker;
use super::node::{Child, Tree};
use super::ready::{Ready, ReadyRay};
use super::settle::Settle;
use super::slabs::BoxMargins;
use super::walk::{Entry, FromZero, ask_by_itself, nearest, pop};
use crate::accel::Shapes;
use crate::accel::query::Goal;
use crate::accel::wave::Wave;
use crate::math::simd::{Kernel, LANES, Simd};

/// A wave of rays.
pub(super) struct Alone<'w, W, B> {
    pub tree: &'w Tree<'w>,
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
            lone.trace::<B, _, _>(s, tree, shapes, wave, (start, u32::MAX), stack);
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
    /// Of eight rays of a wave from `start` on, or as many as there are, traces those of a mask.
    #[inline(always)]
    pub(super) fn trace<B: BoxMargins, S: Simd, W: Wave>(
        &mut self,
        s: S,
        tree: &Tree,
        shapes: &Shapes,
        wave: &mut W,
        (start, which): (usize, u32),
        stack: &mut [Entry],
    ) {
        self.ready.take::<B, _, _>(s, tree, wave, start);
        for i in start..wave.rays().len().min(start + LANES) {
            let lane = i - start;
            if which >> lane & 1 == 0 {
                continue;
            }
            if self.ready.allowed >> lane & 1 == 0 {
                ask_by_itself::<B, _>(tree, shapes, wave, i, stack);
                continue;
            }
            let ray = &self.ready.rays[lane % LANES];
            let mut seeker = Seeker::new(ray, self.ready.t_min[lane % LANES], i, self.ready.exclude[lane % LANES]);
            if W::Goal::ANY {
                descend_any::<B, _, _>(s, tree, shapes, wave, ray, &mut seeker, stack);
            } else {
                descend::<B, _, _>(s, tree, shapes, wave, ray, &mut seeker, stack);
            }
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
fn descend<B: BoxMargins, S: Simd, W: Wave>(
    s: S,
    tree: &Tree,
    shapes: &Shapes,
    wave: &W,
    ray: &ReadyRay,
    seeker: &mut Seeker,
    stack: &mut [Entry],
) {
    let slabs = ray.slabs.spread(s);
    let (mut child, mut top) = (0, 0);
    loop {
        // A loop of its own: what it needs stays in registers.
        while !Child::is_leaf(child) {
            let node = &tree.nodes[child as usize];
            let (near, met) = slabs.meets(s, node, seeker.limit);
            child = if met != 0 {
                nearest::<FromZero, _>(s, &node.children, near, met, stack, &mut top)
            } else {
                pop::<FromZero>(stack, &mut top, seeker.limit).unwrap_or(Child::END)
            };
        }
        if seeker.test::<B, _, _>(s, &ray.sight, tree, shapes, wave, child) {
            return;
        }
        child = pop::<FromZero>(stack, &mut top, seeker.limit).unwrap_or(Child::END);
    }
}

/// The same for a ray that any hit answers: how far it looks never changes, so that children need no distances, and to put
/// them in order takes longer than it saves.
#[inline(always)]
fn descend_any<B: BoxMargins, S: Simd, W: Wave>(
    s: S,
    tree: &Tree,
    shapes: &Shapes,
    wave: &W,
    ray: &ReadyRay,
    seeker: &mut Seeker,
    stack: &mut [Entry],
) {
    let (slabs, limit) = (ray.slabs.spread(s), seeker.limit);
    stack[0] = Entry { near: 0, child: Child::END };
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
                stack[top] = Entry { near: 0, child: node.children[lane] };
                top += 1;
                lane = met.trailing_zeros() as usize % LANES;
                met &= met - 1;
            }
            child = node.children[lane];
        }
        if seeker.test::<B, _, _>(s, &ray.sight, tree, shapes, wave, child) {
            return;
        }
        top -= 1;
        child = stack[top].child;
    }
}
