//! Binary tree as an array of build nodes, and the builder that grows it.

use crate::math::Vec3;
use crate::math::aabb::Aabb;
use crate::parts::joined;
use bytemuck::Zeroable;

/// Largest size of a piece to which another is appended, in build nodes.
const PIECE: usize = 256;

/// A node of the binary tree. In the array each is followed by its whole subtree, first side first.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(super) struct BuildNode {
    pub lo: Vec3,
    /// Leaf: index of its first prim, finally its packed child. Inner build node: offset of its second side.
    pub at: u32,
    pub hi: Vec3,
    /// Number of prims of a leaf; 0 marks an inner build node.
    pub count: u32,
}

impl BuildNode {
    pub(super) fn leaf(bounds: Aabb, first: u32, count: u32) -> Self {
        Self { lo: bounds.lo, at: first, hi: bounds.hi, count }
    }

    pub(super) fn fork(bounds: Aabb, second: u32) -> Self {
        Self { lo: bounds.lo, at: second, hi: bounds.hi, count: 0 }
    }

    #[inline]
    pub(super) fn bounds(&self) -> Aabb {
        Aabb { lo: self.lo, hi: self.hi }
    }

    #[inline]
    pub(super) fn is_leaf(&self) -> bool {
        self.count > 0
    }

    /// Half the surface area of the box.
    #[inline]
    pub(super) fn area(&self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A growing tree: its build nodes in order, in pieces that are joined only when their total number is known.
#[derive(Default)]
pub(super) struct TreeBuilder {
    pieces: Vec<Vec<BuildNode>>,
    /// Last piece, to which build nodes are added.
    open: Vec<BuildNode>,
    /// Depth of the next build node: the number of build nodes above it.
    above: usize,
    /// Number of build nodes on the longest path.
    depth: usize,
}

impl TreeBuilder {
    /// Starts below `above` build nodes.
    fn below(above: usize) -> Self {
        Self { above, ..Self::default() }
    }

    fn len(&self) -> usize {
        self.pieces.iter().chain([&self.open]).map(Vec::len).sum()
    }

    /// Adds a build node over the subtrees that `first` and `second` add, both on this thread.
    pub(super) fn fork(&mut self, bounds: Aabb, first: impl FnOnce(&mut Self), second: impl FnOnce(&mut Self)) {
        let (at, pieces) = (self.open.len(), self.pieces.len());
        self.add(BuildNode::fork(bounds, 0));
        self.above += 1;
        first(self);
        self.open[at].at = index(self.open.len() - at);
        second(self);
        self.above -= 1;
        debug_assert_eq!(pieces, self.pieces.len(), "a node that was not shared went to another piece");
    }

    /// Adds a build node with two sides, each built by a thread of its own.
    pub(super) fn fork_shared(
        &mut self,
        bounds: Aabb,
        first: impl FnOnce(&mut Self) + Send,
        second: impl FnOnce(&mut Self) + Send,
    ) {
        let before = self.len();
        self.add(BuildNode::fork(bounds, 0));
        self.close();
        let last = self.pieces.len() - 1;
        let at = self.pieces[last].len() - 1;
        self.above += 1;
        let mut beyond = Self::below(self.above);
        rayon::join(|| first(self), || second(&mut beyond));
        self.above -= 1;
        self.pieces[last][at].at = index(self.len() - before);
        self.close();
        beyond.pieces.into_iter().for_each(|piece| self.put(piece));
        self.open = beyond.open;
        self.depth = self.depth.max(beyond.depth);
    }

    pub(super) fn add(&mut self, build_node: BuildNode) {
        self.depth = self.depth.max(self.above + 1);
        self.open.push(build_node);
    }

    /// Reserves memory for `build_nodes` build nodes if a piece begins here.
    pub(super) fn begin(&mut self, build_nodes: usize) {
        if self.open.capacity() == 0 {
            self.open.reserve(build_nodes);
        }
    }

    /// Closes the last piece.
    fn close(&mut self) {
        let piece = std::mem::take(&mut self.open);
        self.put(piece);
    }

    /// Appends a piece.
    fn put(&mut self, piece: Vec<BuildNode>) {
        match self.pieces.last_mut() {
            Some(last) if last.len() + piece.len() <= PIECE => last.extend(piece),
            _ => self.pieces.push(piece),
        }
    }

    /// All build nodes, and their number on the longest path.
    pub(super) fn finish(mut self) -> (Vec<BuildNode>, usize) {
        self.close();
        (joined(self.pieces), self.depth)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "they are fewer than twice the prims, and take 32 bytes each")]
pub(super) fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A leaf of one prim: a cube from `lo` to `hi` on every axis.
    pub(in super::super) fn leaf(prim: u32, lo: f32, hi: f32) -> Vec<BuildNode> {
        vec![BuildNode::leaf(Aabb { lo: Vec3::splat(lo), hi: Vec3::splat(hi) }, prim, 1)]
    }

    /// A build node over two trees.
    pub(in super::super) fn fork(first: Vec<BuildNode>, second: Vec<BuildNode>) -> Vec<BuildNode> {
        let root = BuildNode::fork(first[0].bounds().union(second[0].bounds()), index(first.len() + 1));
        [vec![root], first, second].concat()
    }

    /// First prim of each leaf; checks that every box is the smallest around its content.
    pub(in super::super) fn leaves(build_nodes: &[BuildNode]) -> Vec<u32> {
        let root = &build_nodes[0];
        if root.is_leaf() {
            assert_eq!(build_nodes.len(), 1);
            return vec![root.at];
        }
        let (first, second) = build_nodes[1..].split_at(root.at as usize - 1);
        assert_eq!(first[0].bounds().union(second[0].bounds()), root.bounds());
        [leaves(first), leaves(second)].concat()
    }

    /// Number of build nodes on the longest path.
    pub(in super::super) fn depth(build_nodes: &[BuildNode]) -> usize {
        let (mut left, mut most) = (vec![(0, 1)], 0);
        while let Some((i, depth)) = left.pop() {
            let build_node = &build_nodes[i];
            most = most.max(depth);
            if !build_node.is_leaf() {
                left.extend([(i + build_node.at as usize, depth + 1), (i + 1, depth + 1)]);
            }
        }
        most
    }

    /// Adds a tree over `leaves` leaves numbered from `first`, split at random, and shared between threads where it has more
    /// than `shared` leaves.
    fn grow(builder: &mut TreeBuilder, first: u32, leaves: u32, shared: u32, seed: u64) {
        let bounds =
            |first: u32, leaves: u32| Aabb { lo: Vec3::splat(first as f32), hi: Vec3::splat((first + leaves) as f32) };
        if leaves == 1 {
            return builder.add(BuildNode::leaf(bounds(first, 1), first, 1));
        }
        let mut random = crate::math::random::Random::new(seed ^ u64::from(first) << 32 ^ u64::from(leaves));
        // Every other split takes off a single leaf.
        let cut = if random.below(2) == 0 { 1 } else { 1 + random.below(leaves as usize - 1) as u32 };
        let sides = [(first, cut), (first + cut, leaves - cut)];
        let [a, b] = sides.map(|(first, leaves)| move |g: &mut TreeBuilder| grow(g, first, leaves, shared, seed));
        if leaves > shared {
            builder.fork_shared(bounds(first, leaves), a, b);
        } else {
            builder.begin(3);
            builder.fork(bounds(first, leaves), a, b);
        }
    }

    #[test]
    fn a_tree_that_threads_share_is_the_one_that_grows_alone() {
        for seed in 0..20 {
            for count in [1, 2, 3, 700, 5000] {
                let grown = |shared: u32| {
                    let mut builder = TreeBuilder::default();
                    grow(&mut builder, 0, count, shared, seed);
                    builder.finish()
                };
                let (alone, deepest) = grown(u32::MAX);
                assert!(leaves(&alone).into_iter().eq(0..count));
                assert_eq!(deepest, depth(&alone));
                for shared in [1, 40, 1000] {
                    let (build_nodes, depth) = grown(shared);
                    let all = |build_nodes: &[BuildNode]| {
                        build_nodes.iter().map(|k| (k.lo, k.hi, k.at, k.count)).collect::<Vec<_>>()
                    };
                    assert!(
                        depth == deepest && all(&build_nodes) == all(&alone),
                        "{seed}: {count} shared from {shared} on"
                    );
                }
            }
        }
    }
}
