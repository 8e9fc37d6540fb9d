//! Moves subtrees to where they enlarge fewer boxes.
//!
//! After J. Bittner, M. Hapala, V. Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013: a build node
//! is taken out with its parent, and put back beside the build node that adds the least area above it, found by branch and bound.
//! Those that promise most are tried first, some at a time, for as long as enough of them move: a mesh that is one even
//! surface costs hardly more than looking, and large faces before small ones, which cuts between middles handle badly, are
//! put where they do the least harm. One after the other, so that the result does not depend on threads.

use super::build_nodes::{BuildNode, index};
use crate::accel::wide::split::Bounds;
use crate::math::aabb::Aabb;
use bytemuck::Zeroable;
use rayon::prelude::*;

/// Build nodes that are tried before it is asked whether that paid.
const BATCH: usize = 256;

/// Build nodes that one thread takes at a time.
const CHUNK: usize = 1 << 14;

/// It paid if one in so many moved.
const WORTH: usize = 12;

/// Of so many build nodes one is tried at most, and no more than so many; and a batch, or the fourth part of a small tree and a
/// few.
const SHARE: usize = 32;
const MOST: usize = 4096;
const FEW: usize = 16;

/// The part of its own area that counts against what taking a build node out can save. All of it comes back wherever the
/// build node goes; but boxes further up may shrink, too.
const RETURNS: f32 = 0.75;

/// A binary tree with links.
struct Links {
    build_nodes: Vec<BuildNode>,
    links: Vec<Link>,
    /// Places still to be looked at: what is added above them, and the build node.
    open: Vec<(f32, u32)>,
    /// Build nodes on the way up from one.
    way: Vec<u32>,
}

/// What of a build node changes.
#[derive(Clone, Copy, Zeroable)]
struct Link {
    bounds: Bounds,
    parent: u32,
    /// Both [`ROOT`] of a leaf.
    sides: [u32; 2],
}

/// The root, which is never moved.
const ROOT: u32 = 0;

/// Improves a tree; how many build nodes are on the longest way down, if anything was moved.
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

/// The build nodes that may be tried, by falling promise.
///
/// Cuts leave small build nodes alone with large ones, in boxes much larger than they are, and what is saved by taking a
/// build node out is that box.
fn promising(build_nodes: &[BuildNode]) -> Vec<(f32, u32)> {
    // All but the root.
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

/// Links a build node, the first of these, which is number `first` and stands below `parent`, and all below it.
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

    /// Whether a build node was moved elsewhere.
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
        // A box that happens to be the old one is above others now.
        self.fit(parent);
        self.fit(self.parent(parent));
        beside != sibling
    }

    /// Puts `by` where `build_node` is.
    fn replace(&mut self, build_node: u32, by: u32) {
        let above = self.parent(build_node);
        let sides = &mut self.links[above as usize].sides;
        sides[usize::from(sides[1] == build_node)] = by;
        self.links[by as usize].parent = above;
    }

    /// Makes the boxes fit from a build node up to where they do already.
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

    /// The build node beside which a box adds the least area to the tree: `known`, or one where it is less.
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

    /// The area that a box beside a build node adds to the tree, with that of the build node above both.
    fn added_beside(&mut self, bounds: Bounds, build_node: u32) -> f32 {
        self.way.clear();
        let mut above = build_node;
        while above != ROOT {
            above = self.parent(above);
            self.way.push(above);
        }
        // From the root down, as the search adds.
        let grown = |added: f32, &above: &u32| {
            let here = self.bounds(above);
            (added + here.join(bounds).area() - here.area()).max(0.0)
        };
        self.way.iter().rev().fold(0.0, grown) + self.bounds(build_node).join(bounds).area()
    }

    /// The build nodes in order again, each followed by its first side; how many are on the longest way down.
    fn in_order(&self) -> (Vec<BuildNode>, usize) {
        let mut build_nodes = Vec::with_capacity(self.build_nodes.len());
        let mut deepest = 0;
        // What is still to come, how deep it is, and the build node whose second side it is.
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
                // Until the second side is there, where the build node itself is.
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

    /// The areas of all boxes but those of leaves.
    fn cost(build_nodes: &[BuildNode]) -> f32 {
        build_nodes.iter().filter(|k| !k.is_leaf()).map(BuildNode::area).sum()
    }

    #[test]
    fn a_large_box_among_small_ones_is_put_where_it_enlarges_no_other() {
        // 0 to 5 in a row, and 6 around all of them beside 0.
        let small = |i: u32| leaf(i, i as f32, i as f32 + 0.5);
        let large = leaf(6, 0.0, 5.5);
        let left = fork(fork(fork(small(0), large), small(1)), small(2));
        let build_nodes = fork(left, fork(fork(small(3), small(4)), small(5)));
        let (improved, depth) = improve(build_nodes.clone());
        assert_eq!(depth, Some(super::super::build_nodes::tests::depth(&improved)));
        assert!(cost(&improved) < 0.7 * cost(&build_nodes), "{} {}", cost(&improved), cost(&build_nodes));
        // Checks the boxes and the links as well.
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

    /// As many leaves as asked for, cut in the middle.
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
