//! Sizes of a built hierarchy, and the proof that it can lose no hit.

use super::Bvh;
use super::tree::Below;
use crate::accel::StructureStats;
use crate::accel::stats::listed_once;
use crate::math::aabb::Aabb;

impl Bvh<'_> {
    /// Counts the sizes by visiting every node. Cells are leaves.
    pub fn summary(&self) -> StructureStats {
        let mut stats = StructureStats { bytes: self.tree.bytes() as u64, ..StructureStats::default() };
        if self.shapes.bounded() > 0 {
            self.tree.each(0, 0, &mut |_, depth, below| match below {
                Below::Children(_) => stats.n_in += 1,
                Below::Leaf(prims) => {
                    stats.n_v += 1;
                    stats.n_oiv += prims.len() as u64;
                    stats.depth = stats.depth.max(depth);
                }
            });
        }
        stats
    }

    /// Visits everything: each bounded prim is in exactly one leaf, and the box of every node contains all that is below it.
    pub fn check(&self) -> Result<StructureStats, String> {
        let mut leaves = vec![0u32; self.shapes.bounded() as usize];
        let leaf = |prims: &[u32]| {
            prims.iter().fold(Aabb::EMPTY, |b, &prim| {
                leaves[prim as usize] += 1;
                b.union(self.shapes.bounds(prim))
            })
        };
        if self.shapes.bounded() > 0
            && let Some((node, content)) = self.tree.fault(0, leaf)
        {
            return Err(format!("node {node} is {:?}, below it is {content:?}", self.tree.bounds(node)));
        }
        listed_once(&leaves, "leaves").map(|()| self.summary())
    }
}
