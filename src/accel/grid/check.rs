//! Sizes of a built grid, and the proof that it can lose no hit.

use super::lattice::Cube;
use super::overlap::Overlap;
use super::{EMPTY, GridOctree, NODE};
use crate::accel::StructureStats;

impl<M> GridOctree<'_, M> {
    /// Counts the sizes by visiting every cell.
    pub fn summary(&self) -> StructureStats {
        let mut stats = StructureStats {
            n_in: 1 + self.cells.nodes.len() as u64,
            bytes: (self.cells.bytes() + self.trees.bytes() + size_of_val(&*self.top)) as u64,
            ..StructureStats::default()
        };
        self.each_cell(&mut |cube, cell| {
            stats.n_v += 1;
            stats.n_ev += u64::from(cell == EMPTY);
            stats.n_oiv += self.cells.list(cell).len() as u64;
            stats.depth = stats.depth.max(self.lattice.levels - cube.level);
            self.trees.count(cell, &mut stats);
        });
        stats
    }

    /// Visits everything: lists ascend and contain existing prims only, each prim is listed in exactly the padded cells that
    /// it overlaps, and the hierarchies hold the prims that their cells list.
    pub fn check(&self) -> Result<StructureStats, String> {
        let stats = self.summary();
        let prims = self.shapes.bounded();
        for cell in 0..self.cells.len() {
            #[expect(clippy::cast_possible_truncation, reason = "cells are numbered by u32")]
            let list = self.cells.list(cell as u32);
            if let Some(pair) = list.windows(2).find(|p| p[0] >= p[1]) {
                return Err(format!("cell {cell} lists prim {} before {}", pair[0], pair[1]));
            }
            if let Some(&last) = list.last().filter(|&&p| p >= prims) {
                return Err(format!("cell {cell} lists prim {last} of {prims}"));
            }
        }

        let overlaps: Vec<Overlap> = (0..prims).map(|p| Overlap::new(self.shapes, p, &self.lattice)).collect();
        let mut belong = 0;
        let mut failure = None;
        self.each_cell(&mut |cube, cell| {
            if let Some(fault) = self.tree_fault(cube, cell) {
                failure = Some(fault);
            }
            for (&prim, listed) in self.cells.list(cell).iter().zip(1..) {
                belong += u64::from(overlaps[prim as usize].test(cube));
                if failure.is_none() && !overlaps[prim as usize].test(cube) {
                    failure =
                        Some(format!("cell {cell} at {cube:?} lists prim {prim} (no. {listed}) that is elsewhere"));
                }
            }
        });
        // For every prim, from the top down: each cell it overlaps must list it.
        let mut touched = 0;
        for (prim, overlap) in (0..prims).zip(&overlaps) {
            self.each_cell_of(overlap, &mut |cube, cell| {
                touched += 1;
                if failure.is_none() && self.cells.list(cell).binary_search(&prim).is_err() {
                    failure = Some(format!("prim {prim} touches cell {cell} at {cube:?}, which does not list it"));
                }
            });
        }
        match failure {
            Some(message) => Err(message),
            None if touched != belong => Err(format!("{touched} cells are touched, {belong} references found")),
            None => Ok(stats),
        }
    }

    /// Calls `found` with every leaf cell and its cube.
    pub(super) fn each_cell(&self, found: &mut impl FnMut(Cube, u32)) {
        for (i, &entry) in self.top.iter().enumerate() {
            self.below(self.lattice.top_cube(self.lattice.top_cell(i)), entry, &|_| true, found);
        }
    }

    /// Calls `found` with every leaf cell that the prim overlaps.
    fn each_cell_of(&self, overlap: &Overlap, found: &mut impl FnMut(Cube, u32)) {
        let (from, to) = self.lattice.top_range(overlap.lo, overlap.hi);
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    let cube = self.lattice.top_cube([x, y, z]);
                    if overlap.test(cube) {
                        let entry = self.top[self.lattice.top_index([x, y, z])];
                        self.below(cube, entry, &|c| overlap.test(c), found);
                    }
                }
            }
        }
    }

    fn below(&self, cube: Cube, entry: u32, enter: &impl Fn(Cube) -> bool, found: &mut impl FnMut(Cube, u32)) {
        if entry & NODE == 0 {
            found(cube, entry);
            return;
        }
        for (octant, &child) in (0..8).zip(&self.cells.nodes[(entry & !NODE) as usize]) {
            if enter(cube.octant(octant)) {
                self.below(cube.octant(octant), child, enter, found);
            }
        }
    }
}
