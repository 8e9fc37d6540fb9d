//! Sizes of a built tree, and the proof that it can lose no hit.

use super::Wide;
use super::node::Child;
use crate::accel::StructureStats;
use crate::accel::stats::listed_once;
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;

impl Wide<'_> {
    /// Counts the sizes by visiting every node. Cells are leaves.
    pub fn summary(&self) -> StructureStats {
        let mut stats = StructureStats {
            n_in: self.tree().nodes.len() as u64,
            bytes: self.tree().bytes() as u64,
            ..StructureStats::default()
        };
        if !self.tree().nodes.is_empty() {
            self.each_leaf(0, 0, &mut |depth, _, prims| {
                stats.n_v += 1;
                stats.n_oiv += prims.len() as u64;
                stats.depth = stats.depth.max(depth);
            });
        }
        stats
    }

    /// Visits everything: each bounded prim is in exactly one leaf, the box of every slot contains all prims below it, blocks
    /// hold the corners of their triangles, and the tree has its stated depth, which sizes the stacks.
    pub fn check(&self) -> Result<StructureStats, String> {
        let mut leaves = vec![0u32; self.shapes.bounded() as usize];
        let mut failure = None;
        if !self.tree().nodes.is_empty() {
            self.holds(0, &mut leaves, &mut failure);
        }
        failure.map_or_else(|| listed_once(&leaves, "leaves"), Err)?;
        let (summary, depth) = (self.summary(), self.tree().depth);
        let nodes = if self.tree().nodes.is_empty() { 0 } else { 1 + summary.depth };
        if nodes == depth {
            Ok(summary)
        } else {
            Err(format!("{nodes} nodes are on the longest way down, not {depth}"))
        }
    }

    /// Exact box of all prims below a node; counts the leaves of each prim.
    fn holds(&self, node: u32, leaves: &mut [u32], failure: &mut Option<String>) -> Aabb {
        let mut all = Aabb::EMPTY;
        for slot in 0..LANES {
            let (child, bounds) = (self.child(node, slot), self.tree().nodes[node as usize].bounds(slot));
            let content = match child {
                Child::Node(below) => self.holds(below, leaves, failure),
                leaf => self.prims(leaf).iter().fold(Aabb::EMPTY, |b, &p| {
                    leaves[p as usize] += 1;
                    b.union(self.shapes.bounds(p))
                }),
            };
            if bounds.union(content) != bounds {
                *failure = Some(format!("slot {slot} of node {node} is {bounds:?}, below it is {content:?}"));
            }
            if let Some(message) = self.block_differs(child) {
                *failure = Some(message);
            }
            all = all.union(content);
        }
        all
    }

    fn block_differs(&self, child: Child) -> Option<String> {
        let Child::Block(i, count) = child else { return None };
        let block = self.tree().blocks.get(i as usize)?;
        (0..count as usize).find_map(|lane| {
            let prim = block.prims[lane];
            let stored: Vec<_> = block.corners.iter().map(|c| [c[0][lane], c[1][lane], c[2][lane]]).collect();
            let given = self.shapes.triangles[prim as usize].map(|v| self.shapes.vertices[v as usize].to_array());
            (stored != given).then(|| format!("lane {lane} of block {i} is {stored:?}, prim {prim} is {given:?}"))
        })
    }

    fn child(&self, node: u32, slot: usize) -> Child {
        Child::unpack(self.tree().nodes[node as usize].children[slot])
    }

    /// Prims of a leaf.
    fn prims(&self, leaf: Child) -> &[u32] {
        match leaf {
            Child::Node(_) | Child::Block(_, 0) => &[],
            Child::Block(i, count) => &self.tree().blocks[i as usize].prims[..count as usize],
            Child::Run(i) => self.tree().run(i),
        }
    }

    /// Calls `found` with every leaf: its depth below the root, its box and its prims.
    fn each_leaf(&self, node: u32, depth: u32, found: &mut impl FnMut(u32, Aabb, &[u32])) {
        for slot in 0..LANES {
            match self.child(node, slot) {
                Child::Node(below) => self.each_leaf(below, depth + 1, found),
                Child::Block(_, 0) => {}
                leaf => found(depth, self.tree().nodes[node as usize].bounds(slot), self.prims(leaf)),
            }
        }
    }
}
