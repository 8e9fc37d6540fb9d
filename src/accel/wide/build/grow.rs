//! Top-down construction of the binary tree.

use super::build_nodes::{BuildNode, TreeBuilder, index};
use super::cell::{Cell, Count, Lattice};
use crate::accel::wide::split::{Bounds, Cut, Item, Splitting, cut_by_area};
use std::ops::RangeInclusive;

/// Fewest items for which work runs in parallel.
const PARALLEL: usize = 1024;

/// Number of tasks per thread.
const PARTS: usize = 16;

/// Small cells are split by area instead of their planes, which fills leaves better: cells of at most 1/`SMALL_PART` of all
/// items and at most the upper limit, but always those up to the lower limit.
const SMALL_CELL: RangeInclusive<usize> = 1024..=8192;
const SMALL_PART: usize = 4;

/// Up to this many prims are split by area alone, whatever the splitting.
pub(in crate::accel) const ALIKE: usize = *SMALL_CELL.start();

/// A leaf whose box exceeds this fraction of the root's area is hit by many rays. It is split if its halves together
/// have less than `WORTH_CUTTING` of its area, or less than `FLAT` of its volume: rays that start near a floor start in a box
/// that is less flat.
const LARGE_LEAF: f32 = 1.0 / 2048.0;
const WORTH_CUTTING: f32 = 0.8;
const FLAT: f32 = 0.1;

/// Items of a subtree, and memory for its result.
pub(super) struct Work<'w> {
    pub items: &'w mut [Item],
    /// Equally large scratch memory, if the splitting needs it.
    pub spare: &'w mut [Item],
    /// Prims of the leaves, in order.
    pub prims: &'w mut [u32],
    /// Number of prims before these.
    pub first: u32,
}

/// Parameters of the construction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grower {
    lattice: Lattice,
    /// Cells of up to this many items are split by area.
    small_cell: usize,
    /// Largest number of prims in a leaf.
    leaf: u32,
    /// Area of the root's box.
    area: f32,
    /// The two sides of a build node over more items are built in parallel.
    parallel: usize,
}

impl<'w> Work<'w> {
    /// Splits into the items before `at`, with `prims` prims, and the rest.
    fn split_at(self, at: usize, prims: usize) -> [Self; 2] {
        let (a, b) = self.items.split_at_mut(at);
        let (spare_a, spare_b) = self.spare.split_at_mut(at.min(self.spare.len()));
        let (prims_a, prims_b) = self.prims.split_at_mut(prims);
        let second = self.first + index(prims);
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
    /// Prepares a tree over `items` items within these bounds, with leaves of up to `leaf` prims, a power of two. The items
    /// represent `times` as many, and cells are split as for those.
    pub(super) fn new(splitting: Splitting, items: usize, times: usize, bounds: &Bounds, leaf: u32) -> Self {
        let small_cell = match splitting {
            Splitting::Octree => {
                (items.saturating_mul(times) / SMALL_PART).clamp(*SMALL_CELL.start(), *SMALL_CELL.end()) / times.max(1)
            }
            Splitting::SurfaceArea => usize::MAX,
        };
        let parallel = match rayon::current_num_threads() {
            1 => usize::MAX,
            threads => PARALLEL.max(items / (PARTS * threads)),
        };
        Self { lattice: Lattice::over(&bounds.aabb()), small_cell, leaf, area: bounds.area(), parallel }
    }

    /// Adds the tree over some items, at least one, to `builder`; the same for every number of threads. `middles` is the box
    /// around their doubled middles, if known.
    pub(super) fn grow(&self, work: Work, bounds: Bounds, middles: Option<Bounds>, builder: &mut TreeBuilder) {
        let count = work.prims.len();
        if count <= self.leaf as usize {
            if let Some(cut) = self.cut_large_leaf(work.items, &bounds) {
                return self.fork(work, &cut, bounds, builder);
            }
            for (place, prim) in work.prims.iter_mut().zip(work.items.iter().flat_map(Item::prims)) {
                *place = prim;
            }
            work.prims.sort_unstable();
            return builder.add(BuildNode::leaf(bounds.aabb(), work.first, index(count)));
        }
        if work.items.len() > self.small_cell
            && let Some(cell) = self.lattice.cell(work.items, self.leaf)
        {
            cell.sort(&self.lattice, work.items, work.spare);
            return self.grow_cell(&cell, Cell::ALL, work.swapped(), bounds, builder);
        }
        let cut = cut_by_area(work.items, self.leaf, middles);
        self.fork(work, &cut, bounds, builder);
    }

    /// Split of a set of prims that would fit into a leaf, if it is better than the leaf.
    fn cut_large_leaf(&self, items: &mut [Item], bounds: &Bounds) -> Option<Cut> {
        let area = bounds.area();
        if items.len() < 2 || area <= self.area * LARGE_LEAF {
            return None;
        }
        let cut = cut_by_area(items, 1, None);
        let [a, b] = &cut.bounds;
        let worth = a.area() + b.area() < area * WORTH_CUTTING || a.volume() + b.volume() < bounds.volume() * FLAT;
        Some(cut).filter(|_| worth)
    }

    /// Adds the build node of a split, and its subtree.
    fn fork(&self, work: Work, cut: &Cut, bounds: Bounds, builder: &mut TreeBuilder) {
        let (count, [first, second]) = (work.items.len(), cut.bounds);
        let middles = |part: usize| cut.middles.map(|both| both[part]);
        let (first_middles, second_middles) = (middles(0), middles(1));
        let [a, b] = work.split_at(cut.at, cut.prims);
        self.join(
            count,
            bounds,
            builder,
            |g| self.grow(a, first, first_middles, g),
            |g| self.grow(b, second, second_middles, g),
        );
    }

    /// Builds the subtree of some parts of a cell.
    fn grow_cell(&self, cell: &Cell, parts: u8, work: Work, bounds: Bounds, builder: &mut TreeBuilder) {
        let Some(first) = cell.cut(parts) else { return self.grow(work, bounds, None, builder) };
        let second = parts & !first;
        let count = work.items.len();
        let Count { items, prims } = cell.count(first);
        let [a, b] = work.split_at(items as usize, prims as usize);
        let grow_a = |g: &mut TreeBuilder| self.grow_cell(cell, first, a, cell.bounds(first), g);
        let grow_b = |g: &mut TreeBuilder| self.grow_cell(cell, second, b, cell.bounds(second), g);
        self.join(count, bounds, builder, grow_a, grow_b);
    }

    /// Adds a build node over `count` items and its two sides, in parallel where that pays.
    fn join(
        &self,
        count: usize,
        bounds: Bounds,
        builder: &mut TreeBuilder,
        first: impl FnOnce(&mut TreeBuilder) + Send,
        second: impl FnOnce(&mut TreeBuilder) + Send,
    ) {
        if count > self.parallel {
            return builder.fork_shared(bounds.aabb(), first, second);
        }
        // Mostly more than needed, but untouched memory costs nothing, while enlarging a full array stops all threads.
        // Subtrees below have fewer items, and are not shared either.
        builder.begin(count);
        builder.fork(bounds.aabb(), first, second);
    }
}

#[cfg(test)]
mod tests {
    use super::super::build_nodes::tests::leaves;
    use super::*;
    use crate::math::Vec3;
    use crate::math::aabb::Aabb;

    fn grown(splitting: Splitting, at: &[Vec3]) -> (Vec<BuildNode>, Vec<u32>) {
        let item = |(prim, &p): (u32, &Vec3)| Item::new(Aabb { lo: p, hi: p + 0.25 }, prim);
        grown_over(splitting, (0..).zip(at).map(item).collect())
    }

    fn grown_over(splitting: Splitting, mut items: Vec<Item>) -> (Vec<BuildNode>, Vec<u32>) {
        let (mut spare, mut prims, mut builder) = (items.clone(), vec![0; items.len()], TreeBuilder::default());
        let bounds = crate::accel::wide::split::around(&items);
        let grower = Grower::new(splitting, items.len(), 1, &bounds, 8);
        let work = Work { items: &mut items, spare: &mut spare, prims: &mut prims, first: 0 };
        grower.grow(work, bounds, None, &mut builder);
        (builder.finish().0, prims)
    }

    #[test]
    fn every_prim_is_in_one_leaf_and_leaves_stand_in_the_order_of_their_prims() {
        let at = |i: usize| Vec3::new((i % 37) as f32, (i % 101) as f32, (i / 50) as f32);
        let places: Vec<Vec3> = (0..3000).map(at).collect();
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let (build_nodes, mut prims) = grown(splitting, &places);
            let firsts = leaves(&build_nodes);
            assert!(firsts.is_sorted() && firsts[0] == 0, "{splitting:?}");
            let counts: Vec<u32> = build_nodes.iter().filter(|k| k.is_leaf()).map(|k| k.count).collect();
            assert!(counts.iter().sum::<u32>() == 3000 && counts.iter().all(|&n| n <= 8), "{splitting:?}");
            prims.sort_unstable();
            assert!(prims.into_iter().eq(0..3000), "{splitting:?}");
        }
    }

    #[test]
    fn a_large_leaf_is_cut_where_its_parts_are_far_apart() {
        let places = [0.0, 0.5, 1.0, 90.0, 90.5].map(Vec3::splat);
        assert_eq!(leaves(&grown(Splitting::SurfaceArea, &places).0), [0, 3]);
        assert_eq!(leaves(&grown(Splitting::SurfaceArea, &[Vec3::ZERO; 5]).0), [0]);
        // A floor and a pin that stands on it: hardly less area, but the split removes nearly all of the volume.
        let boxes = [Vec3::new(9.0, 0.0, 9.0), Vec3::new(0.1, 4.0, 0.1)].map(|hi| Aabb { lo: Vec3::ZERO, hi });
        let items: Vec<Item> = (0..).zip(boxes).map(|(prim, bounds)| Item::new(bounds, prim)).collect();
        assert_eq!(leaves(&grown_over(Splitting::SurfaceArea, items).0), [0, 1]);
    }
}
