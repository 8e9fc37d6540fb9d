//! Moves subtrees to where they enlarge fewer boxes.
//!
//! After J. Bittner, M. Hapala, V. Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013: a knot
//! is taken out with its parent, and put back beside the knot that adds the least area above it, found by branch and bound.
//! Those that promise most are tried first, some at a time, for as long as enough of them move: a mesh that is one even
//! surface costs hardly more than looking, and large faces before small ones, which cuts between middles handle badly, are
//! put where they do the least harm. One after the other, so that the result does not depend on threads.

use super::grow::{Knot, index};
use crate::accel::wide::split::Bounds;
use crate::math::aabb::Aabb;

/// Knots that are tried before it is asked whether that paid.
const BATCH: usize = 256;

/// It paid if one in so many moved.
const WORTH: usize = 12;

/// Of so many knots one is tried at most, and no more than so many; and a batch, or the fourth part of a small tree and a
/// few.
const SHARE: usize = 32;
const MOST: usize = 4096;
const FEW: usize = 16;

/// The part of its own area that counts against what taking a knot out can save. All of it comes back wherever the knot
/// goes; but boxes further up may shrink, too.
const RETURNS: f32 = 0.75;

/// A binary tree with links.
struct Links {
    knots: Vec<Knot>,
    /// Their boxes, which change.
    boxes: Vec<Bounds>,
    parents: Vec<u32>,
    sides: Vec<[u32; 2]>,
    /// Places still to be looked at: what is added above them, and the knot.
    open: Vec<(f32, u32)>,
    /// Knots on the way up from one.
    way: Vec<u32>,
}

/// The root, which is never moved.
const ROOT: u32 = 0;

/// Improves a tree; whether anything was moved.
pub(super) fn improve(knots: Vec<Knot>) -> (Vec<Knot>, bool) {
    let order = promising(&knots);
    let mut links = Links::new(knots);
    let mut any = false;
    for batch in order.chunks(BATCH) {
        let moved = batch.iter().filter(|(_, knot)| links.reinsert(*knot)).count();
        any |= moved > 0;
        if moved * WORTH < batch.len() {
            break;
        }
    }
    (if any { links.in_order() } else { links.knots }, any)
}

/// The knots that may be tried, by falling promise.
///
/// Cuts leave small knots alone with large ones, in boxes much larger than they are, and what is saved by taking a knot out
/// is that box.
fn promising(knots: &[Knot]) -> Vec<(f32, u32)> {
    let mut all = Vec::with_capacity(knots.len());
    for (i, above) in (0..).zip(knots).filter(|(_, knot)| !knot.is_leaf()) {
        for side in [i + 1, i + above.at] {
            all.push((above.area() - knots[side as usize].area() * RETURNS, side));
        }
    }
    let most = (all.len() / SHARE).min(MOST) + BATCH.min(all.len() / 4 + FEW);
    let better = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if most < all.len() {
        all.select_nth_unstable_by(most, better);
        all.truncate(most);
    }
    all.sort_unstable_by(better);
    all
}

impl Links {
    fn new(knots: Vec<Knot>) -> Self {
        let (mut parents, mut sides) = (vec![ROOT; knots.len()], vec![[ROOT; 2]; knots.len()]);
        for (i, knot) in (0..).zip(&knots).filter(|(_, knot)| !knot.is_leaf()) {
            let both = [i + 1, i + knot.at];
            sides[i as usize] = both;
            both.iter().for_each(|&side| parents[side as usize] = i);
        }
        let boxes = knots.iter().map(|knot| knot.bounds().into()).collect();
        Self { knots, boxes, parents, sides, open: Vec::new(), way: Vec::new() }
    }

    #[inline(always)]
    fn bounds(&self, knot: u32) -> Bounds {
        self.boxes[knot as usize]
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
        let beside = self.best_place(self.bounds(knot), sibling);
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
            let (fitting, there) = (a.join(b), &mut self.boxes[knot as usize]);
            let fits = fitting.lo.cmpeq(there.lo).all() & fitting.hi.cmpeq(there.hi).all();
            *there = fitting;
            if fits || knot == ROOT {
                return;
            }
            knot = self.parents[knot as usize];
        }
    }

    /// The knot beside which a box adds the least area to the tree: `known`, or one where it is less.
    fn best_place(&mut self, bounds: Bounds, known: u32) -> u32 {
        let alone = bounds.area();
        let (mut least, mut best) = (self.added_beside(bounds, known), known);
        self.open.clear();
        self.open.push((0.0, ROOT));
        while let Some((added, knot)) = self.open.pop() {
            if added + alone >= least {
                continue;
            }
            let here = self.bounds(knot);
            let total = added + here.join(bounds).area();
            if total < least && knot != ROOT {
                (least, best) = (total, knot);
            }
            let added = (total - here.area()).max(0.0);
            if added + alone < least && !self.knots[knot as usize].is_leaf() {
                self.open.extend(self.sides[knot as usize].map(|side| (added, side)));
            }
        }
        best
    }

    /// The area that a box beside a knot adds to the tree, with that of the knot above both.
    fn added_beside(&mut self, bounds: Bounds, knot: u32) -> f32 {
        self.way.clear();
        let mut above = knot;
        while above != ROOT {
            above = self.parents[above as usize];
            self.way.push(above);
        }
        // From the root down, as the search adds.
        let grown = |added: f32, &above: &u32| {
            let here = self.bounds(above);
            (added + here.join(bounds).area() - here.area()).max(0.0)
        };
        self.way.iter().rev().fold(0.0, grown) + self.bounds(knot).join(bounds).area()
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
            let Aabb { lo, hi } = self.boxes[knot as usize].aabb();
            (copy.lo, copy.hi) = (lo, hi);
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

#[cfg(test)]
mod tests {
    use super::super::grow::tests::{fork, leaf, leaves};
    use super::*;

    /// The areas of all boxes but those of leaves.
    fn cost(knots: &[Knot]) -> f32 {
        knots.iter().filter(|k| !k.is_leaf()).map(Knot::area).sum()
    }

    #[test]
    fn a_large_box_among_small_ones_is_put_where_it_enlarges_no_other() {
        // 0 to 5 in a row, and 6 around all of them beside 0.
        let small = |i: u32| leaf(i, i as f32, i as f32 + 0.5);
        let large = leaf(6, 0.0, 5.5);
        let left = fork(fork(fork(small(0), large), small(1)), small(2));
        let knots = fork(left, fork(fork(small(3), small(4)), small(5)));
        let (improved, moved) = improve(knots.clone());
        assert!(moved);
        assert!(cost(&improved) < 0.7 * cost(&knots), "{} {}", cost(&improved), cost(&knots));
        // Checks the boxes and the links as well.
        let (mut before, mut after) = (leaves(&knots), leaves(&improved));
        before.sort_unstable();
        after.sort_unstable();
        assert_eq!(before, after);
    }

    #[test]
    fn what_is_small_beside_what_is_large_comes_first() {
        let (small, large) = (leaf(0, 0.0, 0.5), leaf(1, 0.0, 5.5));
        let knots = fork(fork(small, large), fork(leaf(2, 6.0, 8.0), leaf(3, 8.0, 10.0)));
        let tried = promising(&knots).into_iter().map(|(_, knot)| knots[knot as usize]);
        assert_eq!(tried.filter(Knot::is_leaf).map(|leaf| leaf.at).next(), Some(0));
    }

    #[test]
    fn a_tree_that_cannot_be_improved_stays_as_it_is() {
        let small = |i: u32| leaf(i, i as f32, i as f32 + 0.5);
        let knots = fork(fork(small(0), small(1)), fork(small(2), small(3)));
        assert_eq!(leaves(&improve(knots).0), [0, 1, 2, 3]);
        assert_eq!(leaves(&improve(small(7)).0), [7]);
    }
}
