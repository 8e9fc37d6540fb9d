//! Reinsertion: moves subtrees to places where they enlarge fewer boxes.
//!
//! After J. Bittner, M. Hapala, V. Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013: a build
//! node is removed with its parent, and reinserted beside the build node where it adds the least area to the tree, found by
//! branch and bound. The most promising are tried first, in batches, for as long as enough of them move: an evenly
//! tessellated mesh costs hardly more than the search, and large faces before small ones, which splits between middles handle
//! badly, are put where they do the least harm. The moves are sequential, so that the result does not depend on threads.

use super::build_nodes::{BuildNode, index};
use crate::accel::wide::split::Bounds;
use crate::math::aabb::Aabb;
use bytemuck::Zeroable;
use rayon::prelude::*;

/// Build nodes tried before their success is judged.
const BATCH: usize = 256;

/// Build nodes per task.
const CHUNK: usize = 1 << 14;

/// A batch succeeds if one build node in this many moved.
const WORTH: usize = 12;

/// Limits of the number of build nodes tried: one in `SHARE`, at most `MOST`; plus a batch, or in a small tree a quarter of
/// all and `FEW`.
const SHARE: usize = 32;
const MOST: usize = 4096;
const FEW: usize = 16;

/// Fraction of its own area that is subtracted from the possible gain of removing a build node. All of it returns wherever
/// the build node is inserted; but boxes further up may shrink, too.
const RETURNS: f32 = 0.75;

/// Binary tree with parent links.
struct Links {
    build_nodes: Vec<BuildNode>,
    links: Vec<Link>,
    /// Search queue: the area added above a candidate, and the candidate build node.
    open: Vec<(f32, u32)>,
    /// Build nodes on the path from a build node to the root.
    way: Vec<u32>,
}

/// Mutable part of a build node.
#[derive(Clone, Copy, Zeroable)]
struct Link {
    bounds: Bounds,
    parent: u32,
    /// The two children; both are [`ROOT`] for a leaf.
    sides: [u32; 2],
}

/// Index of the root, which is never moved.
const ROOT: u32 = 0;

/// Improves a tree; also returns the number of build nodes on the longest path if anything was moved.
pub(super) fn improve(build_nodes: Vec<BuildNode>) -> (Vec<BuildNode>, Option<usize>) {
    let order = promising(&build_nodes);
    let mut links = Links::new(build_nodes);
    let mut any = false;
    for batch in order.chunks(BATCH) {
        let moved = batch.iter().filter(|(_, build_node)| links.reinsert(*build_node)).count();
        any |= moved > 0;
        if moved * WORTH < batch.len() {
            break;
        }
    }
    if !any {
        return (links.build_nodes, None);
    }
    let (build_nodes, depth) = links.in_order();
    (build_nodes, Some(depth))
}

/// Candidates for reinsertion, most promising first.
///
/// Splits leave small build nodes alone with large ones, in boxes much larger than they are, and removing a build node saves
/// that box.
fn promising(build_nodes: &[BuildNode]) -> Vec<(f32, u32)> {
    // All except the root.
    let count = build_nodes.len().saturating_sub(1);
    let most = (count / SHARE).min(MOST) + BATCH.min(count / 4 + FEW);
    let better = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let best = |mut some: Vec<(f32, u32)>| {
        if most < some.len() {
            some.select_nth_unstable_by(most, better);
            some.truncate(most);
        }
        some
    };
    let of_chunk = |(number, chunk): (usize, &[BuildNode])| {
        let mut some = Vec::with_capacity(2 * chunk.len());
        for (i, above) in (index(number * CHUNK)..).zip(chunk).filter(|(_, build_node)| !build_node.is_leaf()) {
            for side in [i + 1, i + above.at] {
                some.push((above.area() - build_nodes[side as usize].area() * RETURNS, side));
            }
        }
        best(some)
    };
    let both = |mut some: Vec<(f32, u32)>, more: Vec<(f32, u32)>| {
        some.extend(more);
        best(some)
    };
    let mut all = build_nodes.par_chunks(CHUNK).enumerate().map(of_chunk).reduce(Vec::new, both);
    all.sort_unstable_by(better);
    all
}

/// Links a build node, the first of the slice, with index `first` and parent `parent`, and its subtree.
fn link(build_nodes: &[BuildNode], first: u32, parent: u32, links: &mut [Link]) {
    links[0].parent = parent;
    if build_nodes.len() <= CHUNK {
        for (i, build_node) in build_nodes.iter().enumerate() {
            links[i].bounds = build_node.bounds().into();
            if !build_node.is_leaf() {
                let (here, both) = (first + index(i), [i + 1, i + build_node.at as usize]);
                links[i].sides = both.map(|side| first + index(side));
                both.iter().for_each(|&side| links[side].parent = here);
            }
        }
        return;
    }
    let root = &build_nodes[0];
    let second = root.at as usize;
    (links[0].bounds, links[0].sides) = (root.bounds().into(), [first + 1, first + root.at]);
    let (first_links, second_links) = links.split_at_mut(second);
    rayon::join(
        || link(&build_nodes[1..second], first + 1, first, &mut first_links[1..]),
        || link(&build_nodes[second..], first + root.at, first, second_links),
    );
}

impl Links {
    fn new(build_nodes: Vec<BuildNode>) -> Self {
        let mut links = bytemuck::zeroed_vec(build_nodes.len());
        link(&build_nodes, ROOT, ROOT, &mut links);
        Self { build_nodes, links, open: Vec::new(), way: Vec::new() }
    }

    #[inline(always)]
    fn bounds(&self, build_node: u32) -> Bounds {
        self.links[build_node as usize].bounds
    }

    #[inline(always)]
    fn parent(&self, build_node: u32) -> u32 {
        self.links[build_node as usize].parent
    }

    #[inline(always)]
    fn sides(&self, build_node: u32) -> [u32; 2] {
        self.links[build_node as usize].sides
    }

    /// Reinserts a build node and returns whether it moved.
    fn reinsert(&mut self, build_node: u32) -> bool {
        let parent = self.parent(build_node);
        if parent == ROOT {
            return false;
        }
        let [a, b] = self.sides(parent);
        let sibling = if a == build_node { b } else { a };
        self.replace(parent, sibling);
        self.fit(self.parent(parent));
        let beside = self.best_place(self.bounds(build_node), sibling);
        self.replace(beside, parent);
        self.links[parent as usize].sides = [beside, build_node];
        self.links[beside as usize].parent = parent;
        // A box that happens to equal the old one may contain other build nodes now.
        self.fit(parent);
        self.fit(self.parent(parent));
        beside != sibling
    }

    /// Replaces `build_node` by `by` in its parent.
    fn replace(&mut self, build_node: u32, by: u32) {
        let above = self.parent(build_node);
        let sides = &mut self.links[above as usize].sides;
        sides[usize::from(sides[1] == build_node)] = by;
        self.links[by as usize].parent = above;
    }

    /// Refits the boxes from a build node up to the first that already fits.
    fn fit(&mut self, mut build_node: u32) {
        loop {
            let [a, b] = self.sides(build_node).map(|side| self.bounds(side));
            let (fitting, there) = (a.join(b), &mut self.links[build_node as usize].bounds);
            let fits = fitting.lo.cmpeq(there.lo).all() & fitting.hi.cmpeq(there.hi).all();
            *there = fitting;
            if fits || build_node == ROOT {
                return;
            }
            build_node = self.parent(build_node);
        }
    }

    /// Build node beside which a box adds the least area to the tree: `known`, or a cheaper one.
    fn best_place(&mut self, bounds: Bounds, known: u32) -> u32 {
        let alone = bounds.area();
        let (mut least, mut best) = (self.added_beside(bounds, known), known);
        self.open.clear();
        self.open.push((0.0, ROOT));
        while let Some((added, build_node)) = self.open.pop() {
            if added + alone >= least {
                continue;
            }
            let here = self.bounds(build_node);
            let total = added + here.join(bounds).area();
            if total < least && build_node != ROOT {
                (least, best) = (total, build_node);
            }
            let added = (total - here.area()).max(0.0);
            let sides = self.sides(build_node);
            if added + alone < least && sides != [ROOT; 2] {
                self.open.extend(sides.map(|side| (added, side)));
            }
        }
        best
    }

    /// Area that a box beside a build node adds to the tree, including that of their new parent.
    fn added_beside(&mut self, bounds: Bounds, build_node: u32) -> f32 {
        self.way.clear();
        let mut above = build_node;
        while above != ROOT {
            above = self.parent(above);
            self.way.push(above);
        }
        // From the root down, in the order of the search.
        let grown = |added: f32, &above: &u32| {
            let here = self.bounds(above);
            (added + here.join(bounds).area() - here.area()).max(0.0)
        };
        self.way.iter().rev().fold(0.0, grown) + self.bounds(build_node).join(bounds).area()
    }

    /// Build nodes in array order again, each followed by its first side; also returns the number on the longest path.
    fn in_order(&self) -> (Vec<BuildNode>, usize) {
        let mut build_nodes = Vec::with_capacity(self.build_nodes.len());
        let mut deepest = 0;
        // Remaining build nodes with their depth, and the array index of the parent if they are its second side.
        let mut stack = vec![(ROOT, 1, None)];
        while let Some((build_node, depth, above)) = stack.pop() {
            deepest = deepest.max(depth);
            let at = build_nodes.len();
            if let Some(above) = above {
                let above: &mut BuildNode = &mut build_nodes[above];
                above.at = index(at) - above.at;
            }
            let mut copy = self.build_nodes[build_node as usize];
            let Aabb { lo, hi } = self.bounds(build_node).aabb();
            (copy.lo, copy.hi) = (lo, hi);
            if !copy.is_leaf() {
                let [first, second] = self.sides(build_node);
                // Its own index, until its second side is placed.
                copy.at = index(at);
                stack.extend([(second, depth + 1, Some(at)), (first, depth + 1, None)]);
            }
            build_nodes.push(copy);
        }
        (build_nodes, deepest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::build_nodes::tests::{fork, leaf, leaves};
    use super::*;

    /// Total area of all boxes except those of leaves.
    fn cost(build_nodes: &[BuildNode]) -> f32 {
        build_nodes.iter().filter(|k| !k.is_leaf()).map(BuildNode::area).sum()
    }

    #[test]
    fn a_large_box_among_small_ones_is_put_where_it_enlarges_no_other() {
        // Leaves 0 to 5 in a row, and leaf 6 around all of them beside 0.
        let small = |i: u32| leaf(i, i as f32, i as f32 + 0.5);
        let large = leaf(6, 0.0, 5.5);
        let left = fork(fork(fork(small(0), large), small(1)), small(2));
        let build_nodes = fork(left, fork(fork(small(3), small(4)), small(5)));
        let (improved, depth) = improve(build_nodes.clone());
        assert_eq!(depth, Some(super::super::build_nodes::tests::depth(&improved)));
        assert!(cost(&improved) < 0.7 * cost(&build_nodes), "{} {}", cost(&improved), cost(&build_nodes));
        // `leaves` checks the boxes and the links as well.
        let (mut before, mut after) = (leaves(&build_nodes), leaves(&improved));
        before.sort_unstable();
        after.sort_unstable();
        assert_eq!(before, after);
    }

    #[test]
    fn what_is_small_beside_what_is_large_comes_first() {
        let (small, large) = (leaf(0, 0.0, 0.5), leaf(1, 0.0, 5.5));
        let build_nodes = fork(fork(small, large), fork(leaf(2, 6.0, 8.0), leaf(3, 8.0, 10.0)));
        let tried = promising(&build_nodes).into_iter().map(|(_, build_node)| build_nodes[build_node as usize]);
        assert_eq!(tried.filter(BuildNode::is_leaf).map(|leaf| leaf.at).next(), Some(0));
    }

    /// Tree over `leaves` leaves, split in the middle.
    fn even(first: u32, leaves: u32) -> Vec<BuildNode> {
        if leaves == 1 {
            let size = (first % 7) as f32 * 0.1 + 0.1;
            return leaf(first, first as f32, first as f32 + size);
        }
        fork(even(first, leaves / 2), even(first + leaves / 2, leaves - leaves / 2))
    }

    #[test]
    fn what_is_tried_and_how_it_is_linked_does_not_depend_on_how_the_work_is_shared() {
        let build_nodes = even(0, 2 * CHUNK as u32 + 77);
        let mut all = Vec::new();
        let mut parents = vec![ROOT; build_nodes.len()];
        let mut sides = vec![[ROOT; 2]; build_nodes.len()];
        for (i, above) in (0..).zip(&build_nodes).filter(|(_, build_node)| !build_node.is_leaf()) {
            sides[i as usize] = [i + 1, i + above.at];
            for side in sides[i as usize] {
                parents[side as usize] = i;
                all.push((above.area() - build_nodes[side as usize].area() * RETURNS, side));
            }
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let tried = promising(&build_nodes);
        assert!(tried.len() == (build_nodes.len() - 1) / SHARE + BATCH && tried == all[..tried.len()]);
        let links = Links::new(build_nodes).links;
        assert!(links.iter().map(|link| link.parent).eq(parents));
        assert!(links.iter().map(|link| link.sides).eq(sides));
    }

    #[test]
    fn a_tree_that_cannot_be_improved_stays_as_it_is() {
        let small = |i: u32| leaf(i, i as f32, i as f32 + 0.5);
        let build_nodes = fork(fork(small(0), small(1)), fork(small(2), small(3)));
        assert_eq!(leaves(&improve(build_nodes).0), [0, 1, 2, 3]);
        assert_eq!(leaves(&improve(small(7)).0), [7]);
    }
}
