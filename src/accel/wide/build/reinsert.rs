//! Moves subtrees to where they enlarge fewer boxes.
//!
//! After J. Bittner, M. Hapala, V. Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013: a knot
//! is taken out with its parent, and put back beside the knot that adds the least area above it, found by branch and bound.
//! Those that promise most are tried first, some at a time, for as long as enough of them move: a mesh that is one even
//! surface costs hardly more than looking, and large faces before small ones, which cuts between middles handle badly, are
//! put where they do the least harm. One after the other, so that the result does not depend on threads.

use super::knots::{Knot, index};
use crate::accel::wide::split::Bounds;
use crate::math::aabb::Aabb;
use bytemuck::Zeroable;
use rayon::prelude::*;

/// Knots that are tried before it is asked whether that paid.
const BATCH: usize = 256;

/// Knots that one thread takes at a time.
const CHUNK: usize = 1 << 14;

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
    links: Vec<Link>,
    /// Places still to be looked at: what is added above them, and the knot.
    open: Vec<(f32, u32)>,
    /// Knots on the way up from one.
    way: Vec<u32>,
}

/// What of a knot changes.
#[derive(Clone, Copy, Zeroable)]
struct Link {
    bounds: Bounds,
    parent: u32,
    /// Both [`ROOT`] of a leaf.
    sides: [u32; 2],
}

/// The root, which is never moved.
const ROOT: u32 = 0;

/// Improves a tree; how many knots are on the longest way down, if anything was moved.
pub(super) fn improve(knots: Vec<Knot>) -> (Vec<Knot>, Option<usize>) {
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
    if !any {
        return (links.knots, None);
    }
    let (knots, depth) = links.in_order();
    (knots, Some(depth))
}

/// The knots that may be tried, by falling promise.
///
/// Cuts leave small knots alone with large ones, in boxes much larger than they are, and what is saved by taking a knot out
/// is that box.
fn promising(knots: &[Knot]) -> Vec<(f32, u32)> {
    // All but the root.
    let count = knots.len().saturating_sub(1);
    let most = (count / SHARE).min(MOST) + BATCH.min(count / 4 + FEW);
    let better = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let best = |mut some: Vec<(f32, u32)>| {
        if most < some.len() {
            some.select_nth_unstable_by(most, better);
            some.truncate(most);
        }
        some
    };
    let of_chunk = |(number, chunk): (usize, &[Knot])| {
        let mut some = Vec::with_capacity(2 * chunk.len());
        for (i, above) in (index(number * CHUNK)..).zip(chunk).filter(|(_, knot)| !knot.is_leaf()) {
            for side in [i + 1, i + above.at] {
                some.push((above.area() - knots[side as usize].area() * RETURNS, side));
            }
        }
        best(some)
    };
    let both = |mut some: Vec<(f32, u32)>, more: Vec<(f32, u32)>| {
        some.extend(more);
        best(some)
    };
    let mut all = knots.par_chunks(CHUNK).enumerate().map(of_chunk).reduce(Vec::new, both);
    all.sort_unstable_by(better);
    all
}

/// Links a knot, the first of these, which is number `first` and stands below `parent`, and all below it.
fn link(knots: &[Knot], first: u32, parent: u32, links: &mut [Link]) {
    links[0].parent = parent;
    if knots.len() <= CHUNK {
        for (i, knot) in knots.iter().enumerate() {
            links[i].bounds = knot.bounds().into();
            if !knot.is_leaf() {
                let (here, both) = (first + index(i), [i + 1, i + knot.at as usize]);
                links[i].sides = both.map(|side| first + index(side));
                both.iter().for_each(|&side| links[side].parent = here);
            }
        }
        return;
    }
    let root = &knots[0];
    let second = root.at as usize;
    (links[0].bounds, links[0].sides) = (root.bounds().into(), [first + 1, first + root.at]);
    let (first_links, second_links) = links.split_at_mut(second);
    rayon::join(
        || link(&knots[1..second], first + 1, first, &mut first_links[1..]),
        || link(&knots[second..], first + root.at, first, second_links),
    );
}

impl Links {
    fn new(knots: Vec<Knot>) -> Self {
        let mut links = bytemuck::zeroed_vec(knots.len());
        link(&knots, ROOT, ROOT, &mut links);
        Self { knots, links, open: Vec::new(), way: Vec::new() }
    }

    #[inline(always)]
    fn bounds(&self, knot: u32) -> Bounds {
        self.links[knot as usize].bounds
    }

    #[inline(always)]
    fn parent(&self, knot: u32) -> u32 {
        self.links[knot as usize].parent
    }

    #[inline(always)]
    fn sides(&self, knot: u32) -> [u32; 2] {
        self.links[knot as usize].sides
    }

    /// Whether a knot was moved elsewhere.
    fn reinsert(&mut self, knot: u32) -> bool {
        let parent = self.parent(knot);
        if parent == ROOT {
            return false;
        }
        let [a, b] = self.sides(parent);
        let sibling = if a == knot { b } else { a };
        self.replace(parent, sibling);
        self.fit(self.parent(parent));
        let beside = self.best_place(self.bounds(knot), sibling);
        self.replace(beside, parent);
        self.links[parent as usize].sides = [beside, knot];
        self.links[beside as usize].parent = parent;
        // A box that happens to be the old one is above others now.
        self.fit(parent);
        self.fit(self.parent(parent));
        beside != sibling
    }

    /// Puts `by` where `knot` is.
    fn replace(&mut self, knot: u32, by: u32) {
        let above = self.parent(knot);
        let sides = &mut self.links[above as usize].sides;
        sides[usize::from(sides[1] == knot)] = by;
        self.links[by as usize].parent = above;
    }

    /// Makes the boxes fit from a knot up to where they do already.
    fn fit(&mut self, mut knot: u32) {
        loop {
            let [a, b] = self.sides(knot).map(|side| self.bounds(side));
            let (fitting, there) = (a.join(b), &mut self.links[knot as usize].bounds);
            let fits = fitting.lo.cmpeq(there.lo).all() & fitting.hi.cmpeq(there.hi).all();
            *there = fitting;
            if fits || knot == ROOT {
                return;
            }
            knot = self.parent(knot);
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
            let sides = self.sides(knot);
            if added + alone < least && sides != [ROOT; 2] {
                self.open.extend(sides.map(|side| (added, side)));
            }
        }
        best
    }

    /// The area that a box beside a knot adds to the tree, with that of the knot above both.
    fn added_beside(&mut self, bounds: Bounds, knot: u32) -> f32 {
        self.way.clear();
        let mut above = knot;
        while above != ROOT {
            above = self.parent(above);
            self.way.push(above);
        }
        // From the root down, as the search adds.
        let grown = |added: f32, &above: &u32| {
            let here = self.bounds(above);
            (added + here.join(bounds).area() - here.area()).max(0.0)
        };
        self.way.iter().rev().fold(0.0, grown) + self.bounds(knot).join(bounds).area()
    }

    /// The knots in order again, each followed by its first side; how many are on the longest way down.
    fn in_order(&self) -> (Vec<Knot>, usize) {
        let mut knots = Vec::with_capacity(self.knots.len());
        let mut deepest = 0;
        // What is still to come, how deep it is, and the knot whose second side it is.
        let mut stack = vec![(ROOT, 1, None)];
        while let Some((knot, depth, above)) = stack.pop() {
            deepest = deepest.max(depth);
            let at = knots.len();
            if let Some(above) = above {
                let above: &mut Knot = &mut knots[above];
                above.at = index(at) - above.at;
            }
            let mut copy = self.knots[knot as usize];
            let Aabb { lo, hi } = self.bounds(knot).aabb();
            (copy.lo, copy.hi) = (lo, hi);
            if !copy.is_leaf() {
                let [first, second] = self.sides(knot);
                // Until the second side is there, where the knot itself is.
                copy.at = index(at);
                stack.extend([(second, depth + 1, Some(at)), (first, depth + 1, None)]);
            }
            knots.push(copy);
        }
        (knots, deepest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::knots::tests::{fork, leaf, leaves};
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
        let (improved, depth) = improve(knots.clone());
        assert_eq!(depth, Some(super::super::knots::tests::depth(&improved)));
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

    /// As many leaves as asked for, cut in the middle.
    fn even(first: u32, leaves: u32) -> Vec<Knot> {
        if leaves == 1 {
            let size = (first % 7) as f32 * 0.1 + 0.1;
            return leaf(first, first as f32, first as f32 + size);
        }
        fork(even(first, leaves / 2), even(first + leaves / 2, leaves - leaves / 2))
    }

    #[test]
    fn what_is_tried_and_how_it_is_linked_does_not_depend_on_how_the_work_is_shared() {
        let knots = even(0, 2 * CHUNK as u32 + 77);
        let mut all = Vec::new();
        let mut parents = vec![ROOT; knots.len()];
        let mut sides = vec![[ROOT; 2]; knots.len()];
        for (i, above) in (0..).zip(&knots).filter(|(_, knot)| !knot.is_leaf()) {
            sides[i as usize] = [i + 1, i + above.at];
            for side in sides[i as usize] {
                parents[side as usize] = i;
                all.push((above.area() - knots[side as usize].area() * RETURNS, side));
            }
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let tried = promising(&knots);
        assert!(tried.len() == (knots.len() - 1) / SHARE + BATCH && tried == all[..tried.len()]);
        let links = Links::new(knots).links;
        assert!(links.iter().map(|link| link.parent).eq(parents));
        assert!(links.iter().map(|link| link.sides).eq(sides));
    }

    #[test]
    fn a_tree_that_cannot_be_improved_stays_as_it_is() {
        let small = |i: u32| leaf(i, i as f32, i as f32 + 0.5);
        let knots = fork(fork(small(0), small(1)), fork(small(2), small(3)));
        assert_eq!(leaves(&improve(knots).0), [0, 1, 2, 3]);
        assert_eq!(leaves(&improve(small(7)).0), [7]);
    }
}
