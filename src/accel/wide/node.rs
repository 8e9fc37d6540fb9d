//! Nodes, blocks and runs as flat arrays.

use crate::accel::probe::{Extent, NodeId, Visit};
use crate::accel::{NO_PRIM, Shapes};
use crate::huge_pages::Paged;
use crate::math::aabb::Aabb;
use crate::math::simd::{LANES, Row};
use crate::math::triangles::{Corners8, NO_CORNERS};
use crate::parts::cut;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// An inner node: the boxes of its eight children, and what they are.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Planes of the children's boxes: lower and upper x, lower and upper y, lower and upper z.
    pub planes: [Row; 6],
    /// Packed [`Child`]ren.
    pub children: [u32; LANES],
    /// Padding, so that every node begins on a cache line.
    room: [u32; LANES],
}

impl Node {
    /// Node without children.
    pub(super) const EMPTY: Self = Self {
        planes: {
            let (lower, upper) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
            [lower, upper, lower, upper, lower, upper]
        },
        children: [Child::NOTHING; LANES],
        room: [0; LANES],
    };

    pub(super) fn set(&mut self, slot: usize, bounds: &Aabb, child: Child) {
        for k in 0..3 {
            self.planes[2 * k][slot] = bounds.lo[k];
            self.planes[2 * k + 1][slot] = bounds.hi[k];
        }
        self.children[slot] = child.pack();
    }

    /// Box of a child; empty if there is none.
    pub(super) fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| [0, 1, 2].map(|k: usize| self.planes[2 * k + side][slot]).into();
        Aabb { lo: corner(0), hi: corner(1) }
    }
}

/// Content of a slot of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Child {
    /// An inner node: index into [`Tree::nodes`].
    Node(u32),
    /// A block: index into [`Tree::blocks`], and the number of its lanes that hold a triangle.
    Block(u32, u32),
    /// A run of other prims: index into [`Tree::runs`].
    Run(u32),
}

impl Child {
    /// Packed content of an empty slot: a block without triangles.
    pub(super) const NOTHING: u32 = Self::LEAF;
    /// Packed end of a stack: the last possible run, which no tree has.
    pub(super) const END: u32 = u32::MAX;
    /// Packed entry point of packets: the last possible node, which no tree has.
    pub(super) const ENTRY_POINT: u32 = Self::LEAF - 1;
    const LEAF: u32 = 1 << 31;
    const COUNT: u32 = 27;
    /// Largest number of blocks, and of runs, of a tree: one more would collide with [`Self::END`].
    pub(super) const MOST: usize = (1 << Self::COUNT) - 1;
    /// Marks a run: a count that no block has.
    const RUN: u32 = 15;

    pub(super) fn pack(self) -> u32 {
        match self {
            Self::Node(i) => i,
            Self::Block(i, count) => Self::LEAF | count << Self::COUNT | i,
            Self::Run(i) => Self::LEAF | Self::RUN << Self::COUNT | i,
        }
    }

    /// Whether a packed child is a leaf.
    #[inline(always)]
    pub(super) fn is_leaf(word: u32) -> bool {
        word & Self::LEAF != 0
    }

    /// Index of the node and index of the block of a packed child, 0 for the one that it is not; without branches.
    #[inline(always)]
    pub(super) fn either(word: u32) -> (usize, usize) {
        let leaf = (word >> 31).wrapping_neg();
        ((word & !leaf) as usize, (word & leaf & ((1 << Self::COUNT) - 1)) as usize)
    }

    /// Index of the block of a packed child, if it is a block, and the number of its lanes that hold a triangle; for
    /// [`Self::END`] an index that no block has.
    #[inline(always)]
    pub(super) fn block(word: u32) -> (u32, u32) {
        (word & ((1 << Self::COUNT) - 1), word >> Self::COUNT & 15)
    }

    #[inline(always)]
    pub(super) fn unpack(word: u32) -> Self {
        let (count, index) = (word >> Self::COUNT & 15, word & ((1 << Self::COUNT) - 1));
        match (word & Self::LEAF, count) {
            (0, _) => Self::Node(word),
            (_, Self::RUN) => Self::Run(index),
            _ => Self::Block(index, count),
        }
    }

    /// Packed child with its index moved by the `nodes` nodes put before those of its tree.
    fn behind(word: u32, nodes: u32) -> u32 {
        match Self::unpack(word) {
            Self::Node(i) => Self::Node(i + nodes).pack(),
            _ => word,
        }
    }
}

/// Up to eight triangles side by side.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Block {
    pub corners: Corners8,
    /// The triangle in each lane; [`NO_PRIM`] in the unused last lanes.
    pub prims: [u32; LANES],
}

impl Block {
    pub(super) const EMPTY: Self = Self { corners: NO_CORNERS, prims: [NO_PRIM; LANES] };
}

/// One cache line.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([u32; 16]);

/// Number of cache lines of a node.
const OF_NODE: usize = size_of::<Node>() / size_of::<Line>();

/// Number of cache lines of a block.
const OF_BLOCK: usize = size_of::<Block>() / size_of::<Line>();

/// Memory of a tree.
#[derive(Clone, Debug)]
pub(super) struct Arrays {
    /// Cache lines of all nodes, then of all blocks: in one allocation, so that they share huge pages.
    lines: Paged<Line>,
    nodes: usize,
    /// Runs of prims other than triangles: (first, count) in [`Self::prims`].
    runs: Vec<(u32, u32)>,
    prims: Vec<u32>,
    /// Box around all prims.
    bounds: Aabb,
    /// Largest absolute coordinate of a box.
    extent: f32,
    /// Number of nodes on the longest path.
    depth: u32,
}

/// View of [`Arrays`] for traversal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tree<'a> {
    /// Inner nodes, root first; empty without bounded prims.
    pub nodes: &'a [Node],
    pub blocks: &'a [Block],
    pub runs: &'a [(u32, u32)],
    pub prims: &'a [u32],
    pub bounds: Aabb,
    pub extent: f32,
    pub depth: u32,
}

impl Arrays {
    /// Joins the nodes of these pieces, of which the first node is the root, and reserves room for `blocks` blocks. Children
    /// have indices within their piece, but final ones in the first piece; `depth` nodes are on the longest path.
    pub(super) fn new(pieces: &[Vec<Node>], depth: u32, blocks: usize, bounds: Aabb) -> Self {
        let nodes = pieces.iter().map(Vec::len).sum();
        let mut lines = Paged::zeroed(OF_NODE * nodes + OF_BLOCK * blocks);
        let places = cut(bytemuck::cast_slice_mut(&mut lines[..OF_NODE * nodes]), pieces.iter().map(Vec::len));
        let starts = pieces.iter().scan(0, |next, piece| Some(std::mem::replace(next, *next + index(piece.len()))));
        let starts: Vec<u32> = starts.collect();
        places.into_par_iter().zip(pieces).zip(starts).for_each(|((places, piece), start)| {
            for (node, place) in piece.iter().zip(places) {
                *place = Node { children: node.children.map(|child| Child::behind(child, start)), ..*node };
            }
        });
        let extent = bounds.lo.abs().max(bounds.hi.abs()).max_element();
        Self { lines, nodes, runs: Vec::new(), prims: Vec::new(), bounds, extent, depth }
    }

    /// Adds runs over these prims.
    pub(super) fn with_runs(self, runs: Vec<(u32, u32)>, prims: Vec<u32>) -> Self {
        Self { runs, prims, ..self }
    }

    pub(super) fn blocks_mut(&mut self) -> &mut [Block] {
        bytemuck::cast_slice_mut(&mut self.lines[OF_NODE * self.nodes..])
    }

    pub(super) fn tree(&self) -> Tree<'_> {
        let Self { lines, nodes, runs, prims, bounds, extent, depth } = self;
        let (nodes, blocks) = lines.split_at(OF_NODE * nodes);
        let (nodes, blocks) = (bytemuck::cast_slice(nodes), bytemuck::cast_slice(blocks));
        Tree { nodes, blocks, runs, prims, bounds: *bounds, extent: *extent, depth: *depth }
    }
}

impl<'a> Tree<'a> {
    /// Largest size of a stack: every node on the path leaves up to seven children behind.
    pub(super) fn most_behind(&self) -> usize {
        (LANES - 1) * self.depth as usize + LANES
    }

    /// Size of the arrays, in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.nodes) + size_of_val(self.blocks) + size_of_val(self.runs) + size_of_val(self.prims)
    }

    /// Record of a visit to a child.
    pub(super) fn visit(&self, child: u32, shapes: &Shapes) -> Visit {
        let around = |prims: &[u32]| {
            let bounds = prims.iter().fold(Aabb::EMPTY, |b, &p| b.union(shapes.bounds(p)));
            (bounds, Some(index(prims.len())))
        };
        let (place, (bounds, listed)) = match Child::unpack(child) {
            Child::Node(i) => {
                let node = &self.nodes[i as usize];
                (NodeId::Node(i), ((0..LANES).fold(Aabb::EMPTY, |b, slot| b.union(node.bounds(slot))), None))
            }
            Child::Block(i, count) => (NodeId::Block(i), around(&self.blocks[i as usize].prims[..count as usize])),
            Child::Run(i) => (NodeId::Run(i), around(self.run(i))),
        };
        Visit { place, extent: Extent::Box(bounds), listed }
    }

    /// Prims of a run.
    #[inline]
    pub(super) fn run(&self, run: u32) -> &'a [u32] {
        let (first, len) = self.runs[run as usize];
        &self.prims[first as usize..(first + len) as usize]
    }
}

#[expect(clippy::cast_possible_truncation, reason = "fewer than the prims, which u32 counts")]
pub(super) fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_are_packed_and_unpacked() {
        for child in [Child::Node(0), Child::Node(7_000_000), Child::Block(3, 8), Child::Block(9, 1), Child::Run(5)] {
            assert_eq!(Child::unpack(child.pack()), child);
        }
        assert_eq!(Child::unpack(Child::NOTHING), Child::Block(0, 0));
    }

    #[test]
    fn nodes_and_blocks_fill_cache_lines() {
        assert_eq!((size_of::<Node>(), size_of::<Block>()), (256, 320));
    }
}
