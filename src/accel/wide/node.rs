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

/// Eight children: their boxes and what they are.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Planes of the children: lower and upper x, lower and upper y, lower and upper z.
    pub planes: [Row; 6],
    /// Packed [`Child`]ren.
    pub children: [u32; LANES],
    /// Nothing, so that each begins where a cache line does.
    room: [u32; LANES],
}

impl Node {
    /// No child.
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

    /// The box of a child; empty where there is none.
    pub(super) fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| [0, 1, 2].map(|k: usize| self.planes[2 * k + side][slot]).into();
        Aabb { lo: corner(0), hi: corner(1) }
    }
}

/// What a slot of a node leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Child {
    /// Index into [`Tree::nodes`].
    Node(u32),
    /// Index into [`Tree::blocks`], and how many of its lanes hold a triangle.
    Block(u32, u32),
    /// Index into [`Tree::runs`].
    Run(u32),
}

impl Child {
    /// A block without triangles: where an empty slot leads.
    pub(super) const NOTHING: u32 = Self::LEAF;
    /// No child, packed: the end of a stack. The last run there could be, which no tree has.
    pub(super) const END: u32 = u32::MAX;
    /// The entry point of packets, packed: the last node there could be, which no tree has.
    pub(super) const ENTRY_POINT: u32 = Self::LEAF - 1;
    const LEAF: u32 = 1 << 31;
    const COUNT: u32 = 27;
    /// The most blocks, and the most runs, of a tree: [`Self::END`] would be one more.
    pub(super) const MOST: usize = (1 << Self::COUNT) - 1;
    /// A count that no block has marks a run.
    const RUN: u32 = 15;

    pub(super) fn pack(self) -> u32 {
        match self {
            Self::Node(i) => i,
            Self::Block(i, count) => Self::LEAF | count << Self::COUNT | i,
            Self::Run(i) => Self::LEAF | Self::RUN << Self::COUNT | i,
        }
    }

    /// Whether a packed child is no node.
    #[inline(always)]
    pub(super) fn is_leaf(word: u32) -> bool {
        word & Self::LEAF != 0
    }

    /// The index of the node or of the block that a packed child leads to, and 0 for the other; without branches.
    #[inline(always)]
    pub(super) fn either(word: u32) -> (usize, usize) {
        let leaf = (word >> 31).wrapping_neg();
        ((word & !leaf) as usize, (word & leaf & ((1 << Self::COUNT) - 1)) as usize)
    }

    /// The index of the block that a packed child leads to, if it leads to one, and how many of its lanes hold a triangle;
    /// of [`Self::END`] an index that no block has.
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

    /// A packed child after so many nodes were put before those of its tree.
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
    /// The triangle in each lane; [`NO_PRIM`] behind the last.
    pub prims: [u32; LANES],
}

impl Block {
    pub(super) const EMPTY: Self = Self { corners: NO_CORNERS, prims: [NO_PRIM; LANES] };
}

/// A cache line.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([u32; 16]);

/// Cache lines of a node.
const OF_NODE: usize = size_of::<Node>() / size_of::<Line>();

/// Cache lines of a block.
const OF_BLOCK: usize = size_of::<Block>() / size_of::<Line>();

/// Everything in arrays.
#[derive(Clone, Debug)]
pub(super) struct Arrays {
    /// The lines of all nodes, then those of all blocks: in one piece, so that they share large pages.
    lines: Paged<Line>,
    nodes: usize,
    /// Other prims than triangles: (first, number) in [`Self::prims`].
    runs: Vec<(u32, u32)>,
    prims: Vec<u32>,
    /// Around everything.
    bounds: Aabb,
    /// Largest coordinate of a box, in size.
    extent: f32,
    /// Nodes on the longest way down.
    depth: u32,
}

/// [`Arrays`] as they are walked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tree<'a> {
    /// The first is the root; there is none when there are no bounded prims.
    pub nodes: &'a [Node],
    pub blocks: &'a [Block],
    pub runs: &'a [(u32, u32)],
    pub prims: &'a [u32],
    pub bounds: Aabb,
    pub extent: f32,
    pub depth: u32,
}

impl Arrays {
    /// The nodes of these pieces, one behind the other, of which the first is the root, in these bounds, and room for so many
    /// blocks. Children are numbered within their piece, and those of the first piece in the whole; `depth` nodes are on the
    /// longest way down.
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

    /// With runs of these prims.
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
    /// How long a stack may become: every node on the way leaves up to seven children behind.
    pub(super) fn most_behind(&self) -> usize {
        (LANES - 1) * self.depth as usize + LANES
    }

    /// Bytes of the arrays.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.nodes) + size_of_val(self.blocks) + size_of_val(self.runs) + size_of_val(self.prims)
    }

    /// What is said of a child that is visited.
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

    /// The prims of a run.
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
