//! Many rays in flight: while one waits for memory or for a comparison, others go on.
//!
//! Every ray has a slot with a stack of its own. A step of a ray that is at a node has no branch that depends on what it
//! meets: children are put on the stack in the order of their slots as the ray's octant sees them, and the top is taken
//! off. Rays that are at leaves wait until there are enough of them. What one ray is asked does not depend on the others,
//! and answers are ordered by (t, prim): they are those of the rays one after another.

use std::marker::PhantomData;

use super::node::{Child, Node, Tree};
use super::slabs::{BoxMargins, Slabs};
use super::walk::{Entry, ask_by_itself, has_direction, test_leaf};
use crate::accel::query::{Goal, Query};
use crate::accel::wave::{Wave, begin, end};
use crate::accel::{Hit, NoProbe, Shapes};
use crate::math::simd::{Kernel, LANES, Order, Simd};
use crate::math::triangles::{RayLanes, reach};

/// Rays in flight.
const SLOTS: usize = 20;

/// Rays at leaves that are worth a turn.
const LEAVES: usize = SLOTS / 2;

/// The stacks of all slots: distances and children apart, so that eight are written at once.
#[derive(Clone, Debug, Default)]
pub(super) struct Levels {
    near: Vec<f32>,
    child: Vec<u32>,
    /// Entries of a slot.
    stride: usize,
}

impl Levels {
    /// For stacks of up to `most` entries.
    pub(super) fn new(most: usize) -> Self {
        // One below for the end, and eight above that are written and not used.
        Self { near: Vec::new(), child: Vec::new(), stride: most + 1 + LANES }
    }

    fn prepare(&mut self) {
        self.near.resize(self.stride * SLOTS, f32::NEG_INFINITY);
        self.child.resize(self.stride * SLOTS, Child::END);
        for bottom in (0..self.stride * SLOTS).step_by(self.stride) {
            (self.near[bottom], self.child[bottom]) = (f32::NEG_INFINITY, Child::END);
        }
    }
}

/// By octant and mask of lanes: the lanes in the mask, the farthest first as that octant sees them.
pub(super) static FARTHEST_FIRST: [[Order; 256]; LANES] = farthest_first();

const fn farthest_first() -> [[Order; 256]; LANES] {
    let mut table = [[0; 256]; LANES];
    let mut octant = 0;
    while octant < LANES {
        let mut mask = 0;
        while mask < 256 {
            let (mut order, mut place, mut rank) = (0, 0, LANES);
            while rank > 0 {
                rank -= 1;
                let lane = rank ^ octant;
                if mask >> lane & 1 == 1 {
                    order |= (lane as Order) << (8 * place);
                    place += 1;
                }
            }
            table[octant][mask] = order;
            mask += 1;
        }
        octant += 1;
    }
    table
}

/// A ray in flight.
struct Slot<'a, G: Goal, B> {
    query: Query<'a, G>,
    slabs: Slabs<B>,
    /// Its number in the wave.
    ray: usize,
    octant: usize,
    reach: f32,
    limit: f32,
    /// Where its stack begins, with an entry that is never taken off.
    bottom: usize,
    /// Above the top of its stack.
    top: usize,
    /// Where it is.
    child: u32,
}

/// A wave of rays.
pub(super) struct InFlight<'w, W, B> {
    pub tree: &'w Tree,
    pub shapes: &'w Shapes,
    pub wave: &'w mut W,
    pub stack: &'w mut Levels,
    /// For rays that go by themselves.
    pub entries: &'w mut [Entry],
    pub margins: PhantomData<B>,
}

/// Numbers of slots.
struct List {
    slots: [u8; SLOTS + 1],
    len: usize,
}

impl List {
    const EMPTY: Self = Self { slots: [0; SLOTS + 1], len: 0 };

    /// Adds a slot, or writes it where the next one goes and does not count it.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 256 slots")]
    fn push_if(&mut self, slot: usize, holds: bool) {
        self.slots[self.len] = slot as u8;
        self.len += usize::from(holds);
    }
}

impl<W: Wave, B: BoxMargins> Kernel for InFlight<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        self.stack.prepare();
        let (mut nodes, mut leaves, mut next) = (List::EMPTY, List::EMPTY, 0);
        let mut slots: Vec<Slot<W::Goal, B>> = Vec::with_capacity(SLOTS);
        for number in 0..SLOTS.min(self.wave.rays().len()) {
            slots.push(self.vacant(number));
            if self.start(s, &mut next, &mut slots[number]) {
                slots[number].join(number, &mut nodes, &mut leaves);
            }
        }
        while nodes.len + leaves.len > 0 {
            self.step(s, &mut slots, &mut nodes, &mut leaves);
            if leaves.len >= LEAVES || nodes.len == 0 {
                self.test(s, &mut slots, &mut nodes, &mut leaves, &mut next);
            }
        }
    }
}

impl<G: Goal, B> Slot<'_, G, B> {
    /// Takes the next child off the stack that may hold a hit.
    #[inline(always)]
    fn pop(&mut self, stack: &Levels) {
        loop {
            self.top -= 1;
            if stack.near[self.top] <= self.limit {
                break;
            }
        }
        self.child = stack.child[self.top];
    }

    /// Puts the children that are met on the stack, the nearest last.
    #[inline(always)]
    fn push<S: Simd>(&mut self, s: S, stack: &mut Levels, node: &Node, near: S::Lanes, met: u32) {
        let order = FARTHEST_FIRST[self.octant % LANES][met as usize % 256];
        let (nears, children) = (stack.near[self.top..].first_chunk_mut(), stack.child[self.top..].first_chunk_mut());
        // There is room for eight above every top.
        if let (Some(nears), Some(children)) = (nears, children) {
            s.arrange(near, order, nears);
            s.arrange_words(&node.children, order, children);
            self.top += met.count_ones() as usize;
        }
    }

    /// Enters the list of those that are at nodes, or at leaves.
    #[inline(always)]
    fn join(&self, number: usize, nodes: &mut List, leaves: &mut List) {
        let leaf = Child::is_leaf(self.child);
        nodes.push_if(number, !leaf);
        leaves.push_if(number, leaf);
    }
}

impl<'w, W: Wave, B: BoxMargins> InFlight<'w, W, B> {
    /// A slot without a ray.
    fn vacant(&self, number: usize) -> Slot<'w, W::Goal, B> {
        let ray = &self.wave.rays()[0];
        let slabs = Slabs::new(ray.origin, ray.dir, 0.0);
        let (query, _) = begin(self.shapes, self.wave, 0, &mut NoProbe);
        let bottom = number * self.stack.stride;
        Slot { query, slabs, ray: 0, octant: 0, reach: 0.0, limit: 0.0, bottom, top: bottom + 1, child: Child::END }
    }

    /// Fills a slot with the next ray that meets a box of the root, if there is one; those before it that do not are
    /// answered.
    #[inline(always)]
    fn start<S: Simd>(&mut self, s: S, next: &mut usize, slot: &mut Slot<'w, W::Goal, B>) -> bool {
        let (tree, shapes) = (self.tree, self.shapes);
        while *next < self.wave.rays().len() {
            let i = *next;
            *next += 1;
            let ray = &self.wave.rays()[i];
            if !(B::allow(tree, ray.origin) && has_direction(ray.dir)) {
                ask_by_itself::<B, _, _, _>(s, tree, shapes, self.wave, i, self.entries, &mut NoProbe);
                continue;
            }
            let slabs = Slabs::<B>::new(ray.origin, ray.dir, self.wave.t_min(i));
            let (near, met) = slabs.meets(s, &tree.nodes[0], B::widened(ray.t_max));
            if met == 0 {
                self.wave.take(i, Hit::MISS);
                continue;
            }
            slot.octant = slabs.octant();
            slot.reach = reach(ray.origin, &tree.bounds);
            slot.slabs = slabs;
            slot.ray = i;
            let (query, usable) = begin(shapes, self.wave, i, &mut NoProbe);
            if !usable {
                self.wave.take(i, Hit::MISS);
                continue;
            }
            slot.limit = B::widened(query.reach());
            slot.query = query;
            slot.top = slot.bottom + 1;
            slot.push(s, self.stack, &tree.nodes[0], near, met);
            slot.pop(self.stack);
            return true;
        }
        false
    }

    /// Every ray that is at a node goes on to the next child.
    #[inline(always)]
    fn step<S: Simd>(&mut self, s: S, slots: &mut [Slot<'w, W::Goal, B>], nodes: &mut List, leaves: &mut List) {
        let turn = std::mem::replace(&mut nodes.len, 0);
        for place in 0..turn {
            let number = nodes.slots[place] as usize;
            let slot = &mut slots[number];
            let node = &self.tree.nodes[slot.child as usize];
            let (near, met) = slot.slabs.meets(s, node, slot.limit);
            slot.push(s, self.stack, node, near, met);
            slot.pop(self.stack);
            // One of both is where the ray goes, the other is the first, which is at hand.
            let (node, block) = Child::either(slot.child);
            if let (Some(node), Some(block)) = (self.tree.nodes.get(node), self.tree.blocks.get(block)) {
                s.prefetch(node);
                s.prefetch(block);
            }
            slot.join(number, nodes, leaves);
        }
    }

    /// Every ray that is at a leaf tests it and goes on; new rays take the places of those that have their answer.
    #[inline(always)]
    fn test<S: Simd>(
        &mut self,
        s: S,
        slots: &mut [Slot<'w, W::Goal, B>],
        nodes: &mut List,
        leaves: &mut List,
        next: &mut usize,
    ) {
        let turn = std::mem::replace(leaves, List::EMPTY);
        for &number in &turn.slots[..turn.len] {
            let slot = &mut slots[number as usize];
            let done = slot.child == Child::END || {
                let lanes = RayLanes::new(s, &slot.query.ray, slot.reach);
                test_leaf(s, self.tree, Child::unpack(slot.child), &lanes, &mut slot.query, &mut NoProbe)
            };
            if done {
                end(self.wave, slot.ray, &slot.query, &mut NoProbe);
                if !self.start(s, next, slot) {
                    continue;
                }
            } else {
                slot.limit = B::widened(slot.query.reach());
                slot.pop(self.stack);
            }
            slot.join(number as usize, nodes, leaves);
        }
    }
}
