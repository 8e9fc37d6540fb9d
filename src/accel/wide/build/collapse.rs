//! From a binary tree to nodes of eight.
//!
//! Which build nodes become nodes is chosen so that they cost the least: for every build node it is known what it costs to
//! stand for everything below it by one child of a node, by two, and so on; a node takes what eight cost least. After H.
//! Ylitie, T. Karras, S. Laine, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, 2017. What a
//! node costs is the chance that a ray enters it: of one that comes from afar the area of its box, of one that starts or
//! ends at a shape the part of all shapes that are below it.

use std::ops::Range;

use bytemuck::Zeroable;
use rayon::prelude::*;

use super::build_nodes::BuildNode;
use super::slots::slots;
use crate::accel::wide::node::{Arrays, Child, Node, index};
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;

/// Build nodes that are worth a thread's while.
const PARALLEL: usize = 512;

/// A subtree of at most this part of all build nodes is a piece. The same for every number of threads: so is the order of nodes.
const PIECES: usize = 64;

/// How many rays start or end at a shape where one comes from afar.
const NEAR: f32 = 0.15;

/// The best ways of standing for a build node and all below it.
#[derive(Clone, Copy, Zeroable)]
struct Plan {
    /// By one child at most, two, … seven: what all nodes below cost, as areas.
    costs: [f32; LANES - 1],
    /// Build nodes below a build node, and itself; 0 of a leaf.
    build_nodes: u32,
    /// How many of two children, three, … eight, of a node of its own, stand for the first side; 0: one fewer will do.
    shares: [u8; LANES - 1],
}

impl Plan {
    const LEAF: Self = Self { costs: [0.0; LANES - 1], build_nodes: 0, shares: [0; LANES - 1] };

    /// Of a build node over two sides; `near` is what a build node below a node adds to what that costs.
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

/// Plans for a build node, the first, and all below it.
fn plan(build_nodes: &[BuildNode], near: f32, plans: &mut [Plan]) {
    let Some(root) = build_nodes.first().filter(|_| build_nodes.len() > PARALLEL) else {
        for (at, build_node) in build_nodes.iter().enumerate().rev() {
            // Leaves are written, too: a page that is read first takes two faults, the second of which stops all threads.
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

/// The nodes of a tree, in pieces that threads made. The first is the root.
#[derive(Default)]
pub(super) struct Nodes {
    /// The nodes above all subtrees, which have their places in the whole as children, then subtrees, of which each has its
    /// own nodes as children.
    pieces: Vec<Vec<Node>>,
    /// Nodes on the longest way down.
    depth: u32,
}

impl Nodes {
    /// The nodes over a binary tree whose leaves are packed children.
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

    /// The arrays of a tree of these nodes, with its bounds and room for so many blocks.
    pub(super) fn into_arrays(self, blocks: usize, bounds: Aabb) -> Arrays {
        Arrays::new(&self.pieces, self.depth, blocks, bounds)
    }
}

/// A part of a tree that is built as a piece of its own.
struct Subtree {
    build_nodes: Range<usize>,
    /// The node among those at the top, and its slot, which lead there.
    parent: usize,
    slot: usize,
    /// Nodes above it.
    above: u32,
}

struct Collapse<'k> {
    build_nodes: &'k [BuildNode],
    plans: &'k [Plan],
}

/// Build nodes that are children of one node: each with all below it.
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
    /// Adds the node of a build node, the first of these, below so many nodes, and those below it that stand for more than
    /// `largest` build nodes; lists the others.
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

    /// Adds the node of a build node, the first of these, and all below; how many nodes are on the longest way down.
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

    /// Adds a node whose children are chosen, but for those that will be nodes; these and their slots, and its own place.
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

    /// The build nodes that stand for a build node, the first of these, and all below, as so many children.
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

    /// The children of each node: how many there are, and how many of them are nodes.
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
        // Nine leaves: two must share a node, and those of the smallest box do.
        let comb = (0..7).fold(fork(leaf(8, 0.0, 0.1), leaf(9, 0.1, 0.2)), |tree, i| fork(tree, small(i)));
        assert_eq!(shape(&comb), [(8, 1), (2, 0)]);
        let (mut tree, pair) = (comb, fork(leaf(10, 0.3, 0.31), leaf(11, 0.31, 0.32)));
        tree = fork(tree, pair);
        assert!(shape(&tree).len() <= 3);
    }
}
