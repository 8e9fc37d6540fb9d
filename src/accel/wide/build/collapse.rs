//! Collapse of a binary tree into 8-wide nodes.
//!
//! The build nodes that become nodes are chosen for the least total cost: for every build node, a plan has the cost of
//! representing its subtree by one child of a node, by two, and so on; a node takes the cheapest eight. After H. Ylitie, T.
//! Karras, S. Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017. The cost of a node is
//! the probability that a ray enters it: for a ray from afar the area of its box, for a ray that starts or ends on a shape
//! the share of all shapes below it.

use std::ops::Range;

use bytemuck::Zeroable;
use rayon::prelude::*;

use super::build_nodes::BuildNode;
use super::slots::slots;
use crate::accel::wide::node::{Arrays, Child, Node, index};
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;

/// Fewest build nodes for which work runs in parallel.
const PARALLEL: usize = 512;

/// A subtree of at most this fraction of all build nodes is a piece. The same for every number of threads, and so is the
/// order of nodes.
const PIECES: usize = 64;

/// Number of rays that start or end on a shape, per ray from afar.
const NEAR: f32 = 0.15;

/// Cheapest representations of a build node and its subtree.
#[derive(Clone, Copy, Zeroable)]
struct Plan {
    /// Cost of all nodes below, as areas, when at most one, two, … seven children represent the subtree.
    costs: [f32; LANES - 1],
    /// Number of build nodes in the subtree; 0 for a leaf.
    build_nodes: u32,
    /// Number of children for the first side out of two, three, … seven, and out of the eight of a node of its own; 0: one
    /// child fewer costs no more.
    shares: [u8; LANES - 1],
}

impl Plan {
    const LEAF: Self = Self { costs: [0.0; LANES - 1], build_nodes: 0, shares: [0; LANES - 1] };

    /// Plan of a build node over two sides; `near` is the cost that each build node below adds to a node.
    fn of(build_node: &BuildNode, near: f32, [first, second]: [&Self; 2]) -> Self {
        let cheapest = |children: usize| {
            let cost = |share: usize| first.costs[share - 1] + second.costs[children - share - 1];
            (2..children)
                .fold((cost(1), 1), |best, share| if cost(share) < best.0 { (cost(share), share) } else { best })
        };
        let mut plan = Self::LEAF;
        let (below, share) = cheapest(LANES);
        plan.build_nodes = 1 + first.build_nodes.max(1) + second.build_nodes.max(1);
        plan.costs[0] = build_node.area() + plan.build_nodes as f32 * near + below;
        plan.shares[LANES - 2] = share as u8;
        for children in 2..LANES {
            let (cost, share) = cheapest(children);
            let fewer = plan.costs[children - 2];
            if cost < fewer {
                plan.shares[children - 2] = share as u8;
            }
            plan.costs[children - 1] = cost.min(fewer);
        }
        plan
    }
}

/// Computes the plans of a build node, the first of the slice, and its subtree.
fn plan(build_nodes: &[BuildNode], near: f32, plans: &mut [Plan]) {
    let Some(root) = build_nodes.first().filter(|_| build_nodes.len() > PARALLEL) else {
        for (at, build_node) in build_nodes.iter().enumerate().rev() {
            // Leaves are written, too: a page that is first read takes two faults, the second of which stops all threads.
            let is_leaf = build_node.is_leaf();
            plans[at] = if is_leaf {
                Plan::LEAF
            } else {
                Plan::of(build_node, near, [&plans[at + 1], &plans[at + build_node.at as usize]])
            };
        }
        return;
    };
    let second = root.at as usize;
    let (first_plans, second_plans) = plans.split_at_mut(second);
    let (first, below) = (&build_nodes[1..second], &mut first_plans[1..]);
    rayon::join(|| plan(first, near, below), || plan(&build_nodes[second..], near, second_plans));
    plans[0] = Plan::of(root, near, [&plans[1], &plans[second]]);
}

/// Nodes of a tree, in pieces made by threads. The first node is the root.
#[derive(Default)]
pub(super) struct Nodes {
    /// The nodes above all subtrees, whose children have their final indices, then the subtrees, whose children have indices
    /// within their own piece.
    pieces: Vec<Vec<Node>>,
    /// Number of nodes on the longest path.
    depth: u32,
}

impl Nodes {
    /// Collapses a binary tree whose leaves are packed children.
    pub(super) fn over(build_nodes: &[BuildNode]) -> Self {
        let mut plans = bytemuck::zeroed_vec(build_nodes.len());
        let near = build_nodes.first().map_or(0.0, BuildNode::area) * NEAR / build_nodes.len() as f32;
        plan(build_nodes, near, &mut plans);
        let collapse = Collapse { build_nodes, plans: &plans };

        let (mut top, mut subtrees) = (Vec::new(), Vec::new());
        let largest = PARALLEL.max(build_nodes.len() / PIECES);
        collapse.top(0..build_nodes.len(), 0, largest, &mut top, &mut subtrees);
        let built = subtrees.par_iter().map(|subtree: &Subtree| {
            let mut nodes = Vec::new();
            let depth = collapse.node(subtree.build_nodes.clone(), &mut nodes);
            (nodes, subtree.above + depth)
        });
        let built: Vec<(Vec<Node>, u32)> = built.collect();
        let mut start = top.len();
        for (subtree, (nodes, _)) in subtrees.iter().zip(&built) {
            let Subtree { parent, slot, .. } = *subtree;
            top[parent].children[slot] = Child::Node(index(start)).pack();
            start += nodes.len();
        }
        let depth = built.iter().map(|(_, depth)| *depth).max().unwrap_or(1);
        let pieces = [top].into_iter().chain(built.into_iter().map(|(nodes, _)| nodes)).collect();
        Self { pieces, depth }
    }

    /// Arrays of a tree with these nodes and bounds, and room for `blocks` blocks.
    pub(super) fn into_arrays(self, blocks: usize, bounds: Aabb) -> Arrays {
        Arrays::new(&self.pieces, self.depth, blocks, bounds)
    }
}

/// A subtree that is built as a piece of its own.
struct Subtree {
    build_nodes: Range<usize>,
    /// Index of its parent among the top nodes, and its slot there.
    parent: usize,
    slot: usize,
    /// Number of nodes above it.
    above: u32,
}

struct Collapse<'k> {
    build_nodes: &'k [BuildNode],
    plans: &'k [Plan],
}

/// Build nodes that are the children of one node, each with its subtree.
#[derive(Default)]
struct Children {
    below: [Range<usize>; LANES],
    len: usize,
}

impl Children {
    fn iter(&self) -> impl Iterator<Item = &Range<usize>> {
        self.below[..self.len].iter()
    }
}

impl Collapse<'_> {
    /// Adds the node of a build node, the first of the range, at depth `above`, and the nodes below it that represent more
    /// than `largest` build nodes; lists the remaining subtrees.
    fn top(
        &self,
        build_nodes: Range<usize>,
        above: u32,
        largest: usize,
        nodes: &mut Vec<Node>,
        subtrees: &mut Vec<Subtree>,
    ) {
        let (children, slots, parent) = self.open(build_nodes, nodes);
        for (below, slot) in children.iter().zip(slots) {
            if self.build_nodes[below.start].is_leaf() {
                continue;
            }
            if below.len() > largest {
                nodes[parent].children[slot] = Child::Node(index(nodes.len())).pack();
                self.top(below.clone(), above + 1, largest, nodes, subtrees);
            } else {
                subtrees.push(Subtree { build_nodes: below.clone(), parent, slot, above: above + 1 });
            }
        }
    }

    /// Adds the node of a build node, the first of the range, and its subtree; returns the number of nodes on the longest
    /// path.
    fn node(&self, build_nodes: Range<usize>, nodes: &mut Vec<Node>) -> u32 {
        let (children, slots, at) = self.open(build_nodes, nodes);
        let mut deepest = 0;
        for (below, slot) in children.iter().zip(slots) {
            if !self.build_nodes[below.start].is_leaf() {
                nodes[at].children[slot] = Child::Node(index(nodes.len())).pack();
                deepest = deepest.max(self.node(below.clone(), nodes));
            }
        }
        1 + deepest
    }

    /// Adds a node with its chosen children, except those that become nodes; returns the children, their slots, and the
    /// node's index.
    fn open(&self, build_nodes: Range<usize>, nodes: &mut Vec<Node>) -> (Children, [usize; LANES], usize) {
        let mut children = Children::default();
        self.expand(build_nodes, LANES, &mut children);
        let mut bounds = [Aabb::EMPTY; LANES];
        for (bounds, child) in bounds.iter_mut().zip(children.iter()) {
            *bounds = self.build_nodes[child.start].bounds();
        }
        let slots = slots(&bounds[..children.len]);
        let mut node = Node::EMPTY;
        for ((child, bounds), slot) in children.iter().zip(&bounds).zip(slots) {
            let build_node = &self.build_nodes[child.start];
            let leaf = if build_node.is_leaf() { Child::unpack(build_node.at) } else { Child::unpack(Child::NOTHING) };
            node.set(slot, bounds, leaf);
        }
        nodes.push(node);
        (children, slots, nodes.len() - 1)
    }

    /// Lists the build nodes that represent a build node, the first of the range, and its subtree by at most `most` children.
    fn expand(&self, build_nodes: Range<usize>, mut most: usize, found: &mut Children) {
        let (at, build_node) = (build_nodes.start, &self.build_nodes[build_nodes.start]);
        let shares = &self.plans[at].shares;
        while (2..LANES).contains(&most) && shares[most - 2] == 0 {
            most -= 1;
        }
        if most < 2 || build_node.is_leaf() {
            found.below[found.len] = build_nodes;
            found.len += 1;
            return;
        }
        let (share, second) = (shares[most - 2] as usize, at + build_node.at as usize);
        self.expand(at + 1..second, share, found);
        self.expand(second..build_nodes.end, most - share, found);
    }
}

#[cfg(test)]
mod tests {
    use super::super::build_nodes::tests::{fork, leaf};
    use super::*;

    /// Number of children of each node, and how many of them are nodes.
    fn shape(build_nodes: &[BuildNode]) -> Vec<(usize, usize)> {
        let mut packed = build_nodes.to_vec();
        packed.iter_mut().filter(|k| k.is_leaf()).for_each(|k| k.at = Child::Block(k.at, 1).pack());
        let children = |node: &Node| node.children.map(Child::unpack).into_iter().filter(|c| *c != Child::Block(0, 0));
        let is_node = |c: &Child| matches!(c, Child::Node(_));
        let nodes = Nodes::over(&packed).pieces.concat();
        nodes.iter().map(|n| (children(n).count(), children(n).filter(is_node).count())).collect()
    }

    fn small(i: u32) -> Vec<BuildNode> {
        leaf(i, i as f32, i as f32 + 0.5)
    }

    #[test]
    fn a_node_takes_up_to_eight_leaves_however_deep_they_are() {
        assert_eq!(shape(&small(1)), [(1, 0)]);
        let comb = (2..8).fold(fork(small(0), small(1)), |tree, i| fork(tree, small(i)));
        assert_eq!(shape(&comb), [(8, 0)]);
    }

    #[test]
    fn the_smallest_boxes_become_nodes_of_their_own() {
        // Nine leaves: two must share a node, and the pair with the smallest box does.
        let comb = (0..7).fold(fork(leaf(8, 0.0, 0.1), leaf(9, 0.1, 0.2)), |tree, i| fork(tree, small(i)));
        assert_eq!(shape(&comb), [(8, 1), (2, 0)]);
        let (mut tree, pair) = (comb, fork(leaf(10, 0.3, 0.31), leaf(11, 0.31, 0.32)));
        tree = fork(tree, pair);
        assert!(shape(&tree).len() <= 3);
    }
}
