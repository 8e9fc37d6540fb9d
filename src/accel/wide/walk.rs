//! The way of one ray down the tree, nearer children first.
//!
//! # Why no hit is lost
//! A prim lies in the boxes above it, exactly: they are made of its own `f32` coordinates. The distances to a box's planes
//! err by [`SLAB_F32`] at most, relative, and [`BOX_UNDERFLOW`], so a box is entered whenever the exact ray meets it within
//! its range, widened by [`BOX_MARGIN`]. Only where that holds are boxes asked at all: a direction whose reciprocal is not a normal number
//! constrains nothing on its axis, and with coordinates beyond [`BOX_COORDINATES`] every prim is tested.

use std::marker::PhantomData;

use super::node::{Child, Node, Tree};
use crate::accel::query::{Goal, Query};
use crate::accel::{Intersector, Probe};
use crate::math::Vec3;
use crate::math::bounds::{BOX_COORDINATES, BOX_MARGIN, BOX_UNDERFLOW, SLAB_F32};
use crate::math::simd::{Kernel, LANES, Simd};
use crate::math::triangles::RayLanes;

/// What a walk allows for.
pub(in crate::accel) trait BoxMargins {
    /// Relative error of a distance to a plane.
    const SLAB: f32 = SLAB_F32;
    /// How far beyond the ray's range boxes are entered, relative.
    const RANGE: f32 = BOX_MARGIN;
    /// What underflow adds to either.
    const UNDERFLOW: f32 = BOX_UNDERFLOW;
    /// Largest coordinate with which boxes are asked.
    const COORDINATES: f32 = BOX_COORDINATES;
}

/// The margins that `math::bounds` derives.
pub(in crate::accel) struct Derived;

impl BoxMargins for Derived {}

/// A child still to be visited, and the distance at which the ray enters its box.
#[derive(Clone, Copy, Debug)]
struct Entry {
    near: f32,
    child: u32,
}

/// Children still to be visited, the nearest last.
#[derive(Clone, Debug, Default)]
pub struct Stack(Vec<Entry>);

/// One query under way.
pub(super) struct Walk<'w, 'q, G: Goal, P, B> {
    pub tree: &'w Tree,
    pub query: &'w mut Query<'q, G>,
    pub stack: &'w mut Stack,
    pub probe: &'w mut P,
    pub margins: PhantomData<B>,
}

/// A ray ready to be tested against boxes.
struct Slabs<S: Simd, B> {
    origin: [S::Lanes; 3],
    inverse: [S::Lanes; 3],
    /// Which plane of each axis comes first: 1 where the ray runs backwards.
    first: [usize; 3],
    from: f32,
    margins: PhantomData<B>,
}

impl<G: Goal, P: Probe, B: BoxMargins> Kernel for Walk<'_, '_, G, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, query, stack: Stack(stack), probe, .. } = self;
        if tree.nodes.is_empty() {
            return;
        }
        let far_out = query.ray.origin.abs().max_element().max(tree.extent);
        if far_out > B::COORDINATES {
            return test_all(query, probe);
        }
        let slabs = Slabs::<S, B>::new(s, query.ray.origin, query.ray.dir, query.t_min);
        let lanes = RayLanes::new(s, &query.ray);
        let mut limit = widened::<B>(query.reach());
        let mut child = 0;
        stack.clear();
        loop {
            probe.visit(|| tree.visit(child, query.shapes()));
            match Child::unpack(child) {
                Child::Node(node) => {
                    probe.step();
                    probe.volume_tests(LANES);
                    let node = &tree.nodes[node as usize];
                    if let Some(nearest) = slabs.enter(s, node, limit, stack) {
                        child = nearest;
                        continue;
                    }
                }
                Child::Block(block, count) => {
                    probe.step();
                    probe.cell(false);
                    let block = &tree.blocks[block as usize];
                    let answered = if G::Test::EXACT {
                        let verdicts = lanes.verdicts(s, &block.corners);
                        query.test_block(&block.prims, count, verdicts, probe)
                    } else {
                        block.prims[..count as usize].iter().any(|&prim| query.test(prim, probe))
                    };
                    if answered {
                        return;
                    }
                    limit = widened::<B>(query.reach());
                }
                Child::Run(run) => {
                    probe.step();
                    probe.cell(false);
                    for &prim in tree.run(run) {
                        if query.test(prim, probe) {
                            return;
                        }
                    }
                    limit = widened::<B>(query.reach());
                }
            }
            loop {
                let Some(entry) = stack.pop() else { return };
                if entry.near <= limit {
                    child = entry.child;
                    break;
                }
            }
        }
    }
}

/// The distance up to which boxes must be entered for hits up to `reach`.
#[inline(always)]
fn widened<B: BoxMargins>(reach: f32) -> f32 {
    reach + reach.abs() * B::RANGE + B::UNDERFLOW
}

#[cold]
#[inline(never)]
fn test_all<G: Goal, P: Probe>(query: &mut Query<G>, probe: &mut P) {
    for prim in 0..query.shapes().bounded() {
        if query.test(prim, probe) {
            return;
        }
    }
}

impl<S: Simd, B: BoxMargins> Slabs<S, B> {
    #[inline(always)]
    fn new(s: S, origin: Vec3, dir: Vec3, t_min: f32) -> Self {
        let inverse = dir.to_array().map(|d| {
            let inverse = 1.0 / d;
            // A NaN drops out of every comparison.
            if inverse.is_normal() || d == 0.0 { inverse } else { f32::NAN }
        });
        Self {
            origin: [s.splat(origin.x), s.splat(origin.y), s.splat(origin.z)],
            inverse: [s.splat(inverse[0]), s.splat(inverse[1]), s.splat(inverse[2])],
            first: dir.to_array().map(|d| usize::from(d.is_sign_negative())),
            from: t_min - t_min.abs() * B::RANGE - B::UNDERFLOW,
            margins: PhantomData,
        }
    }

    /// The distances at which the ray enters the boxes of a node, and which of them it meets up to `limit`.
    #[inline(always)]
    fn meets(&self, s: S, node: &Node, limit: f32) -> (S::Lanes, u32) {
        let (mut near, mut far) = (s.splat(self.from), s.splat(limit));
        for k in 0..3 {
            let planes = &node.planes[k];
            let (first, last) = (&planes[self.first[k] & 1], &planes[self.first[k] & 1 ^ 1]);
            // The second operand is kept where the first is NaN.
            near = s.greater(s.mul(s.sub(s.load(first), self.origin[k]), self.inverse[k]), near);
            far = s.smaller(s.mul(s.sub(s.load(last), self.origin[k]), self.inverse[k]), far);
        }
        let slack = s.add(s.mul(s.abs(far), s.splat(B::SLAB)), s.splat(B::UNDERFLOW));
        (near, s.at_most(near, s.add(far, slack)))
    }

    /// Puts the children that the ray meets on the stack, but for the nearest, which is returned.
    #[inline(always)]
    fn enter(&self, s: S, node: &Node, limit: f32, stack: &mut Vec<Entry>) -> Option<u32> {
        let (near, mut met) = self.meets(s, node, limit);
        if met == 0 {
            return None;
        }
        let lane = met.trailing_zeros() as usize % LANES;
        met &= met - 1;
        if met == 0 {
            return Some(node.children[lane]);
        }
        let near = s.store(near);
        let entry = |lane: usize| Entry { near: near[lane], child: node.children[lane] };
        let mut nearest = entry(lane);
        let bottom = stack.len();
        while met != 0 {
            let next = entry(met.trailing_zeros() as usize % LANES);
            met &= met - 1;
            let farther = if next.near < nearest.near { std::mem::replace(&mut nearest, next) } else { next };
            // Insertion: the farther ones lie deeper.
            let mut at = stack.len();
            stack.push(farther);
            while at > bottom && stack[at - 1].near < farther.near {
                stack[at] = stack[at - 1];
                at -= 1;
            }
            stack[at] = farther;
        }
        Some(nearest.child)
    }
}
