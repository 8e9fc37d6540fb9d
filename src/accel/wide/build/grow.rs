//! A binary tree, from the root down.

use super::cell::{Cell, Lattice};
use crate::accel::wide::split::{Bounds, Cut, Item, Splitting, cut_by_area};
use crate::math::Vec3;
use crate::math::aabb::Aabb;

/// Items that are worth a thread's while.
const PARALLEL: usize = 4096;

/// Cells of fewer items are not cut at their planes but by area: that fills leaves better.
const SMALL_CELL: usize = 64;

/// A leaf whose box has more than this part of the root's area is met by many rays. It is cut all the same if its parts
/// have less than that part of its own.
const LARGE_LEAF: f32 = 1.0 / 2048.0;
const WORTH_CUTTING: f32 = 0.7;

/// A node of the binary tree. They stand in an array, each followed by all that is below it, first side first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    pub lo: Vec3,
    /// Of a leaf the first of its prims; of another knot how many knots further on its second side is.
    pub at: u32,
    pub hi: Vec3,
    /// Prims of a leaf; 0: no leaf.
    pub count: u32,
}

impl Knot {
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

    /// Half the surface of its box.
    #[inline]
    pub(super) fn area(&self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// What a tree is grown over.
pub(super) struct Work<'w> {
    pub items: &'w mut [Item],
    /// As much room again, where the splitting needs it.
    pub spare: &'w mut [Item],
    /// The prims of leaves, in their order.
    pub prims: &'w mut [u32],
    /// How many prims stand before those.
    pub first: u32,
}

/// How a tree is grown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grower {
    pub splitting: Splitting,
    pub lattice: Lattice,
    /// Prims of a leaf at most.
    pub leaf: u32,
    /// Area of the root's box.
    pub area: f32,
}

impl<'w> Work<'w> {
    fn split_at(self, at: usize) -> [Self; 2] {
        let (a, b) = self.items.split_at_mut(at);
        let (spare_a, spare_b) = self.spare.split_at_mut(at.min(self.spare.len()));
        let (prims_a, prims_b) = self.prims.split_at_mut(at);
        let second = self.first + index(at);
        [
            Self { items: a, spare: spare_a, prims: prims_a, first: self.first },
            Self { items: b, spare: spare_b, prims: prims_b, first: second },
        ]
    }

    fn swapped(self) -> Self {
        Self { items: self.spare, spare: self.items, ..self }
    }
}

impl Grower {
    /// Adds the tree over some items, at least one, to `knots`; the same for every number of threads.
    pub(super) fn grow(&self, work: Work, bounds: Bounds, knots: &mut Vec<Knot>) {
        let count = work.items.len();
        if count <= self.leaf as usize {
            if let Some(cut) = self.cut_large_leaf(work.items, &bounds) {
                return self.fork(work, &cut, bounds, knots);
            }
            for (prim, item) in work.prims.iter_mut().zip(work.items.iter()) {
                *prim = item.prim();
            }
            work.prims.sort_unstable();
            return knots.push(Knot::leaf(bounds.aabb(), work.first, index(count)));
        }
        if self.splitting == Splitting::Octree
            && count > SMALL_CELL
            && let Some(cell) = self.lattice.cell(work.items, self.leaf)
        {
            cell.sort(&self.lattice, work.items, work.spare);
            return self.grow_cell(&cell, Cell::ALL, work.swapped(), bounds, knots);
        }
        let cut = cut_by_area(work.items, self.leaf);
        self.fork(work, &cut, bounds, knots);
    }

    /// The cut of what fits into a leaf, where it is better than the leaf.
    fn cut_large_leaf(&self, items: &mut [Item], bounds: &Bounds) -> Option<Cut> {
        let area = bounds.area();
        if items.len() < 2 || area <= self.area * LARGE_LEAF {
            return None;
        }
        let cut = cut_by_area(items, 1);
        Some(cut).filter(|cut| cut.bounds[0].area() + cut.bounds[1].area() < area * WORTH_CUTTING)
    }

    /// Adds the knot of a cut, and all below.
    fn fork(&self, work: Work, cut: &Cut, bounds: Bounds, knots: &mut Vec<Knot>) {
        let (count, [first, second]) = (work.items.len(), cut.bounds);
        let [a, b] = work.split_at(cut.at);
        fork(count, bounds, knots, |k| self.grow(a, first, k), |k| self.grow(b, second, k));
    }

    /// The same for some parts of a cell.
    fn grow_cell(&self, cell: &Cell, parts: u8, work: Work, bounds: Bounds, knots: &mut Vec<Knot>) {
        let Some(first) = cell.cut(parts) else { return self.grow(work, bounds, knots) };
        let second = parts & !first;
        let count = work.items.len();
        let [a, b] = work.split_at(cell.count(first) as usize);
        let grow_a = |k: &mut Vec<Knot>| self.grow_cell(cell, first, a, cell.bounds(first), k);
        let grow_b = |k: &mut Vec<Knot>| self.grow_cell(cell, second, b, cell.bounds(second), k);
        fork(count, bounds, knots, grow_a, grow_b);
    }
}

/// Adds a knot over `count` items and its two sides, which are grown in parallel where it is worth it.
fn fork(
    count: usize,
    bounds: Bounds,
    knots: &mut Vec<Knot>,
    first: impl FnOnce(&mut Vec<Knot>) + Send,
    second: impl FnOnce(&mut Vec<Knot>) + Send,
) {
    let at = knots.len();
    knots.push(Knot::fork(bounds.aabb(), 0));
    if count > PARALLEL {
        let mut beyond = Vec::new();
        rayon::join(|| first(knots), || second(&mut beyond));
        knots[at].at = index(knots.len() - at);
        knots.append(&mut beyond);
    } else {
        first(knots);
        knots[at].at = index(knots.len() - at);
        second(knots);
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "knots are fewer than twice the prims, which loading keeps below 2³²"
)]
pub(super) fn index(i: usize) -> u32 {
    i as u32
}
