//! Building the cells: lists of the top grid by counting sort, crowded cells split into octrees.
//!
//! Work is divided into runs of fixed size whose results are joined in order, so that the structure does not depend on the
//! number of threads.

use rayon::prelude::*;

use super::lattice::Lattice;
use super::octree::{Cells, Refiner};
use super::overlap::{Overlap, padded_box};
use super::{EMPTY, GridParams};
use crate::accel::Shapes;

/// Number of prims or cells in one run of work.
const RUN: usize = 4096;

/// Builds the top grid's entries and everything below them.
pub(super) fn build(shapes: &Shapes, lattice: &Lattice, params: &GridParams) -> (Vec<u32>, Cells) {
    let lists = top_lists(shapes, lattice);
    let runs: Vec<usize> = (0..lattice.top_len()).step_by(RUN).collect();
    let parts: Vec<(Vec<u32>, Cells)> = runs
        .into_par_iter()
        .map(|start| {
            let mut refiner = Refiner::new(shapes, lattice, params, lists.prims.len());
            let end = (start + RUN).min(lattice.top_len());
            let entries = (start..end).map(|i| refiner.cell(lattice.top_cube(lattice.top_cell(i)), lists.of(i)));
            (entries.collect(), refiner.into_cells())
        })
        .collect();

    let mut top = Vec::with_capacity(lattice.top_len());
    let mut cells = Cells::new();
    for (entries, part) in parts {
        let moved = cells.append(part);
        top.extend(entries.into_iter().map(|e| moved.entry(e)));
    }
    debug_assert!(top.len() == lattice.top_len() && cells.list(EMPTY).is_empty());
    (top, cells)
}

/// Prims of each top cell, ascending, as prefix sums into one array.
struct Lists {
    first: Vec<u32>,
    prims: Vec<u32>,
}

impl Lists {
    fn of(&self, cell: usize) -> &[u32] {
        &self.prims[self.first[cell] as usize..self.first[cell + 1] as usize]
    }
}

/// Counting sort of all (cell, prim) pairs by cell. (A. Lagae, P. Dutré, *Compact, Fast and Robust Grids for Ray
/// Tracing*, 2008.)
fn top_lists(shapes: &Shapes, lattice: &Lattice) -> Lists {
    let prims: Vec<u32> = (0..shapes.bounded()).collect();
    let pairs: Vec<Vec<(u32, u32)>> = prims
        .par_chunks(RUN)
        .map(|run| {
            let mut pairs = Vec::with_capacity(run.len() * 2);
            for &prim in run {
                top_cells(shapes, prim, lattice, |cell| pairs.push((cell, prim)));
            }
            pairs
        })
        .collect();

    // Counts are stored one place to the left, so that the scatter leaves each of them at the start of its list.
    let mut first = vec![0u32; lattice.top_len() + 2];
    for &(cell, _) in pairs.iter().flatten() {
        first[cell as usize + 2] += 1;
    }
    for i in 2..first.len() {
        first[i] += first[i - 1];
    }
    let mut sorted = vec![0; first.last().copied().unwrap_or(0) as usize];
    for &(cell, prim) in pairs.iter().flatten() {
        let slot = &mut first[cell as usize + 1];
        sorted[*slot as usize] = prim;
        *slot += 1;
    }
    Lists { first, prims: sorted }
}

/// Calls `found` with the index of each top cell that the prim overlaps.
fn top_cells(shapes: &Shapes, prim: u32, lattice: &Lattice, mut found: impl FnMut(u32)) {
    #[expect(clippy::cast_possible_truncation, reason = "at most 1024³ = 2³⁰ cells")]
    let mut found = |cell| found(lattice.top_index(cell) as u32);
    let (lo, hi) = padded_box(shapes, prim, lattice);
    let (from, to) = lattice.top_range(lo, hi);
    if from == to {
        return found(from);
    }
    let overlap = Overlap::new(shapes, prim, lattice);
    for z in from[2]..=to[2] {
        for y in from[1]..=to[1] {
            for x in from[0]..=to[0] {
                if overlap.test(lattice.top_cube([x, y, z])) {
                    found([x, y, z]);
                }
            }
        }
    }
}
