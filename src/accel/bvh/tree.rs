//! Nodes as one flat array, from the root down, and the traversal of a ray.

use super::super::query::{Goal, Query};
use super::super::slabs::{BoxRay, limit};
use super::super::wide::split::{Bounds, Cut, Item, around, cut_by_area};
use crate::accel::Probe;
use crate::accel::probe::{Extent, NodeId, Visit};
use crate::math::aabb::Aabb;

/// Fewest prims for which splitting runs in parallel.
const PARALLEL: usize = 4096;

/// A node: its box and its content.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Contains everything below the node.
    pub bounds: Aabb,
    /// Leaf: index of its first prim. Inner node: index of its second child; the first child follows the node itself.
    at: u32,
    /// Number of prims of a leaf, at least 1; 0 marks an inner node.
    count: u32,
}

/// Content of a node.
#[derive(Clone, Copy, Debug)]
pub enum Below<'a> {
    /// The prims of a leaf.
    Leaf(&'a [u32]),
    /// The two children of an inner node.
    Children([u32; 2]),
}

/// One tree, or several of them in a row.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    prims: Vec<u32>,
    /// Whether the "prims" of the tree are places of instanced objects.
    of_places: bool,
}

/// Stack of nodes still to be visited, with the distances at which the ray enters them, the nearest last.
#[derive(Clone, Debug, Default)]
pub struct Stack(Vec<(f64, u32)>);

impl Tree {
    /// Creates an empty tree over places of instanced objects.
    pub(in crate::accel) fn of_places() -> Self {
        Self { of_places: true, ..Self::default() }
    }

    /// Adds a tree over at least one item and returns its root. The result does not depend on the number of threads.
    pub(in crate::accel) fn add(&mut self, items: &mut [Item], leaf_size: usize) -> u32 {
        let root = index(self.nodes.len());
        self.grow(items, around(items), leaf_size.max(1));
        root
    }

    fn grow(&mut self, items: &mut [Item], bounds: Bounds, leaf_size: usize) {
        let aabb = bounds.aabb();
        let node = self.nodes.len();
        if items.len() <= leaf_size {
            let first = index(self.prims.len());
            self.prims.extend(items.iter().map(Item::prim));
            self.prims[first as usize..].sort_unstable();
            self.nodes.push(Node { bounds: aabb, at: first, count: index(items.len()) });
            return;
        }
        self.nodes.push(Node { bounds: aabb, at: 0, count: 0 });
        let large = items.len() > PARALLEL;
        let Cut { at, bounds: [first, second], .. } = cut_by_area(items, 1, None);
        let (left, right) = items.split_at_mut(at);
        if large {
            let build = |items: &mut [Item], bounds| {
                let mut tree = Self::default();
                tree.grow(items, bounds, leaf_size);
                tree
            };
            let (left, right) = rayon::join(|| build(left, first), || build(right, second));
            self.append(left);
            self.nodes[node].at = index(self.nodes.len());
            self.append(right);
        } else {
            self.grow(left, first, leaf_size);
            self.nodes[node].at = index(self.nodes.len());
            self.grow(right, second, leaf_size);
        }
    }

    /// Appends all nodes of another tree and returns by how much their indices moved.
    pub(in crate::accel) fn append(&mut self, part: Self) -> u32 {
        let (nodes, prims) = (index(self.nodes.len()), index(self.prims.len()));
        let moved = |n: Node| Node { at: n.at + if n.count == 0 { nodes } else { prims }, ..n };
        self.nodes.extend(part.nodes.into_iter().map(moved));
        self.prims.extend(part.prims);
        nodes
    }

    /// Box of a node.
    pub fn bounds(&self, node: u32) -> &Aabb {
        &self.nodes[node as usize].bounds
    }

    /// Content of a node.
    #[inline]
    pub fn below(&self, node: u32) -> Below<'_> {
        let Node { at, count, .. } = self.nodes[node as usize];
        match count {
            0 => Below::Children([node + 1, at]),
            _ => Below::Leaf(&self.prims[at as usize..(at + count) as usize]),
        }
    }

    fn visit(&self, node: u32) -> Visit {
        let (place, listed) = match self.below(node) {
            _ if self.of_places => (NodeId::Places(node), None),
            Below::Leaf(prims) => (NodeId::Leaf(node), Some(index(prims.len()))),
            Below::Children(_) => (NodeId::Node(node), None),
        };
        Visit { place, extent: Extent::Box(*self.bounds(node)), listed }
    }

    /// Size of the arrays, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.prims)
    }

    /// Calls `found` with each node of the subtree below `node`, itself included, and its depth, which is
    /// `depth` for `node`.
    pub fn each<'t>(&'t self, node: u32, depth: u32, found: &mut impl FnMut(u32, u32, Below<'t>)) {
        let below = self.below(node);
        found(node, depth, below);
        if let Below::Children(children) = below {
            children.into_iter().for_each(|child| self.each(child, depth + 1, found));
        }
    }

    /// Finds a node below `root` whose box does not contain everything below it, and the box it should have; `leaf` returns
    /// the box of a leaf's prims and is called once per leaf.
    pub fn fault(&self, root: u32, mut leaf: impl FnMut(&[u32]) -> Aabb) -> Option<(u32, Aabb)> {
        let mut fault = None;
        self.each(root, 0, &mut |node, _, below| {
            let content = match below {
                Below::Children(children) => children.into_iter().fold(Aabb::EMPTY, |b, c| b.union(*self.bounds(c))),
                Below::Leaf(prims) => leaf(prims),
            };
            if self.bounds(node).union(content) != *self.bounds(node) {
                fault = Some((node, content));
            }
        });
        fault
    }

    /// Traverses the tree from `root`, nearer children first, and calls `visit` to test the prims of each leaf the ray
    /// enters; returns whether `visit` answered the query.
    #[inline]
    pub fn walk<G: Goal, P: Probe>(
        &self,
        root: u32,
        ray: &BoxRay,
        query: &mut Query<G>,
        Stack(stack): &mut Stack,
        probe: &mut P,
        mut visit: impl FnMut(&[u32], &mut Query<G>, &mut P) -> bool,
    ) -> bool {
        let mut end = limit(query);
        stack.clear();
        probe.volume_tests(1);
        stack.extend(ray.enters(self.bounds(root), end).map(|near| (near, root)));
        while let Some((near, node)) = stack.pop() {
            if near > end {
                continue;
            }
            probe.step();
            probe.visit(|| self.visit(node));
            match self.below(node) {
                Below::Leaf(prims) => {
                    probe.cell(false);
                    if visit(prims, query, probe) {
                        return true;
                    }
                    end = limit(query);
                }
                Below::Children([first, second]) => {
                    probe.volume_tests(2);
                    let near = |child| ray.enters(self.bounds(child), end).map(|near| (near, child));
                    match (near(first), near(second)) {
                        (Some(a), Some(b)) => stack.extend(if a.0 <= b.0 { [b, a] } else { [a, b] }),
                        (a, b) => stack.extend(a.or(b)),
                    }
                }
            }
        }
        false
    }
}

#[expect(clippy::cast_possible_truncation, reason = "nodes and references are fewer than 2³²")]
fn index(i: usize) -> u32 {
    i as u32
}
