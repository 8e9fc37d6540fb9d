//! Hierarchies of boxes inside crowded cells.
//!
//! Each is a tree over the prims that one cell lists, with boxes clipped to the cell: the parts of a prim outside are found
//! in their own cells. A ray stays inside the padded cell while it is led through it, and the clipping keeps the whole
//! padding.

use rayon::prelude::*;

use super::GridOctree;
use super::lattice::Cube;
use super::mailbox::Mailbox;
use crate::accel::bvh::tree::{Below, Tree};
use crate::accel::wide::split::Item;
use crate::accel::{Shapes, StructureStats};
use crate::math::aabb::Aabb;

/// Marks a cell without a tree.
const NOTHING: u32 = u32::MAX;

/// The trees of all crowded cells.
#[derive(Clone, Debug, Default)]
pub(super) struct Trees {
    /// Root of each cell's tree, or [`NOTHING`]; empty when no cell has a tree.
    roots: Vec<u32>,
    pub tree: Tree,
}

impl Trees {
    /// Root of a cell's tree, if it has one.
    #[inline]
    pub(super) fn root(&self, cell: u32) -> Option<u32> {
        self.roots.get(cell as usize).copied().filter(|&root| root != NOTHING)
    }

    /// Whether no cell has a tree.
    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.roots.is_empty()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.roots) + self.tree.bytes()
    }

    /// Counts the nodes of a cell's tree in place of the cell.
    pub(super) fn count(&self, cell: u32, stats: &mut StructureStats) {
        let Some(root) = self.root(cell) else { return };
        stats.n_v -= 1;
        self.tree.each(root, 1, &mut |_, depth, below| match below {
            Below::Children(_) => stats.n_in += 1,
            Below::Leaf(_) => {
                stats.n_v += 1;
                stats.depth = stats.depth.max(depth);
            }
        });
    }
}

/// Box of the part of a prim inside a cell.
fn clipped(shapes: &Shapes, prim: u32, cell: &Aabb) -> Aabb {
    let bounds = shapes.bounds(prim);
    let inside = bounds.intersection(*cell);
    // Box and cell may touch only by the rounding of the cell.
    if inside.is_empty() { bounds } else { inside }
}

impl<M: Mailbox> GridOctree<'_, M> {
    /// Adds a hierarchy, with leaves of at most `leaf_size` prims, to each cell that lists more.
    #[must_use]
    pub fn with_trees(mut self, leaf_size: u32) -> Self {
        let leaf_size = leaf_size as usize;
        let mut crowded = Vec::new();
        self.each_cell(&mut |cube, cell| {
            if self.cells.list(cell).len() > leaf_size {
                crowded.push((cube, cell));
            }
        });
        let build = |&(cube, cell): &(Cube, u32)| {
            let bounds = self.lattice.padded_bounds(cube);
            let item = |&prim: &u32| Item::new(clipped(self.shapes, prim, &bounds), prim);
            let mut items: Vec<Item> = self.cells.list(cell).iter().map(item).collect();
            let mut tree = Tree::default();
            tree.add(&mut items, leaf_size);
            (cell, tree)
        };
        let built: Vec<(u32, Tree)> = crowded.par_iter().map(build).collect();
        let mut trees = Trees { roots: vec![NOTHING; self.cells.len()], tree: Tree::default() };
        for (cell, tree) in built {
            trees.roots[cell as usize] = trees.tree.append(tree);
        }
        self.trees = trees;
        self
    }
}

impl<M> GridOctree<'_, M> {
    /// Describes a fault of a cell's tree, if any: its leaves must hold the prims that the cell lists, and every box must
    /// contain everything below it inside the cell.
    pub(super) fn tree_fault(&self, cube: Cube, cell: u32) -> Option<String> {
        let root = self.trees.root(cell)?;
        let bounds = self.lattice.padded_bounds(cube);
        let tree = &self.trees.tree;
        let mut held = Vec::<u32>::new();
        let fault = tree.fault(root, |prims| {
            held.extend(prims);
            prims.iter().fold(Aabb::EMPTY, |b, &p| b.union(clipped(self.shapes, p, &bounds)))
        });
        if let Some((node, content)) = fault {
            return Some(format!("node {node} of cell {cell} does not hold {content:?} below it"));
        }
        held.sort_unstable();
        (held != self.cells.list(cell)).then(|| format!("the hierarchy of cell {cell} holds {held:?}"))
    }
}
