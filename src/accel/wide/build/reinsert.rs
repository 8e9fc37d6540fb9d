//! Moves subtrees to where they enlarge fewer boxes.
//!
//! After J. Bittner, M. Hapala, V. Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013: a knot
//! is taken out with its parent, and put back beside the knot that adds the least area above it, found by branch and bound.
//! The largest boxes are tried first, some at a time, for as long as enough of them move: a mesh that is one even surface
//! costs hardly more than looking, and large faces before small ones, which cuts between middles handle badly, are put
//! where they do the least harm. One after the other, so that the result does not depend on threads.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::grow::{Knot, index};
use crate::math::aabb::Aabb;

/// Knots that are tried before it is asked whether that paid.
const BATCH: usize = 256;

/// It paid if one in so many moved.
const WORTH: usize = 12;

/// Of so many knots one is tried at most, and a batch.
const SHARE: usize = 16;

/// A binary tree with links.
struct Links {
    knots: Vec<Knot>,
    parents: Vec<u32>,
    sides: Vec<[u32; 2]>,
    /// Places still to be looked at: what is added above them, as ordered bits, and the knot.
    open: BinaryHeap<Reverse<(u32, u32)>>,
}

/// The root, which is never moved.
const ROOT: u32 = 0;

/// Improves a tree.
pub(super) fn improve(knots: Vec<Knot>) -> Vec<Knot> {
    let mut order: Vec<(f32, u32)> = knots.iter().map(Knot::area).zip(0..).skip(1).collect();
    let most = order.len() / SHARE + BATCH;
    let mut links = Links::new(knots);
    let (mut rest, mut tried, mut any) = (order.as_mut_slice(), 0, false);
    while !rest.is_empty() && tried < most {
        let batch = take_largest(&mut rest);
        let moved = batch.iter().filter(|(_, knot)| links.reinsert(*knot)).count();
        tried += batch.len();
        any |= moved > 0;
        if moved * WORTH < batch.len() {
            break;
        }
    }
    if any { links.in_order() } else { links.knots }
}

/// The knots of largest area, in order; they are taken away from the front.
fn take_largest<'o>(rest: &mut &'o mut [(f32, u32)]) -> &'o [(f32, u32)] {
    let larger = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let all = std::mem::take(rest);
    if all.len() > BATCH {
        all.select_nth_unstable_by(BATCH - 1, larger);
    }
    let (batch, others) = all.split_at_mut(BATCH.min(all.len()));
    batch.sort_unstable_by(larger);
    *rest = others;
    batch
}

fn area(b: &Aabb) -> f32 {
    let d = b.hi - b.lo;
    d.x * d.y + d.y * d.z + d.z * d.x
}

impl Links {
    fn new(knots: Vec<Knot>) -> Self {
        let (mut parents, mut sides) = (vec![ROOT; knots.len()], vec![[ROOT; 2]; knots.len()]);
        for (i, knot) in (0..).zip(&knots).filter(|(_, knot)| !knot.is_leaf()) {
            let both = [i + 1, i + knot.at];
            sides[i as usize] = both;
            both.iter().for_each(|&side| parents[side as usize] = i);
        }
        Self { knots, parents, sides, open: BinaryHeap::new() }
    }

    fn bounds(&self, knot: u32) -> Aabb {
        self.knots[knot as usize].bounds()
    }

    /// Whether a knot was moved elsewhere.
    fn reinsert(&mut self, knot: u32) -> bool {
        let parent = self.parents[knot as usize];
        if parent == ROOT {
            return false;
        }
        let [a, b] = self.sides[parent as usize];
        let sibling = if a == knot { b } else { a };
        self.replace(parent, sibling);
        self.fit(self.parents[parent as usize]);
        let beside = self.best_place(&self.bounds(knot).clone()).unwrap_or(sibling);
        self.replace(beside, parent);
        self.sides[parent as usize] = [beside, knot];
        self.parents[beside as usize] = parent;
        // A box that happens to be the old one is above others now.
        self.fit(parent);
        self.fit(self.parents[parent as usize]);
        beside != sibling
    }

    /// Puts `by` where `knot` is.
    fn replace(&mut self, knot: u32, by: u32) {
        let above = self.parents[knot as usize];
        let sides = &mut self.sides[above as usize];
        sides[usize::from(sides[1] == knot)] = by;
        self.parents[by as usize] = above;
    }

    /// Makes the boxes fit from a knot up to where they do already.
    fn fit(&mut self, mut knot: u32) {
        loop {
            let [a, b] = self.sides[knot as usize].map(|side| self.bounds(side));
            let (fitting, there) = (a.union(b), &mut self.knots[knot as usize]);
            let fits = fitting == there.bounds();
            (there.lo, there.hi) = (fitting.lo, fitting.hi);
            if fits || knot == ROOT {
                return;
            }
            knot = self.parents[knot as usize];
        }
    }

    /// The knot beside which a box adds the least area to the tree.
    fn best_place(&mut self, bounds: &Aabb) -> Option<u32> {
        let alone = area(bounds);
        let (mut least, mut best) = (f32::INFINITY, None);
        self.open.clear();
        self.open.push(Reverse((0, ROOT)));
        while let Some(Reverse((added, knot))) = self.open.pop() {
            let added = f32::from_bits(added);
            if added + alone >= least {
                break;
            }
            let here = self.bounds(knot);
            let total = added + area(&here.union(*bounds));
            if total < least && knot != ROOT {
                (least, best) = (total, Some(knot));
            }
            let added = (total - area(&here)).max(0.0);
            if added + alone < least && !self.knots[knot as usize].is_leaf() {
                self.open.extend(self.sides[knot as usize].map(|side| Reverse((added.to_bits(), side))));
            }
        }
        best
    }

    /// The knots in order again, each followed by its first side.
    fn in_order(&self) -> Vec<Knot> {
        let mut knots = Vec::with_capacity(self.knots.len());
        // What is still to come, and the knot whose second side it is.
        let mut stack = vec![(ROOT, None)];
        while let Some((knot, above)) = stack.pop() {
            let at = knots.len();
            if let Some(above) = above {
                let above: &mut Knot = &mut knots[above];
                above.at = index(at) - above.at;
            }
            let mut copy = self.knots[knot as usize];
            if !copy.is_leaf() {
                let [first, second] = self.sides[knot as usize];
                // Until the second side is there, where the knot itself is.
                copy.at = index(at);
                stack.extend([(second, Some(at)), (first, None)]);
            }
            knots.push(copy);
        }
        knots
    }
}
