//! A cell of the octree: its eight parts, and their order as a binary tree.
//!
//! A cell is split by its three middle planes at once, in one pass over its items. The parts are then the leaves of a small
//! binary tree: of the three planes the cheapest by surface area splits first. Parts that fit into a leaf are not split.

use crate::accel::wide::split::area::weight;
use crate::accel::wide::split::item::around_middles;
use crate::accel::wide::split::{Bounds, Item};
use crate::math::Vec4;
use crate::math::aabb::Aabb;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Items per task where several threads share a cell. The same for every number of threads, and so is the tree.
const CHUNK: usize = 1 << 12;

/// Levels of the octree, limited so that the index of a cell is exact in `f32`.
const LEVELS: u32 = 23;

/// Lattice of the finest octree cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Smallest item middle, doubled.
    lo: Vec4,
    scale: Vec4,
}

/// Parts of a cell: part i lies beyond the plane of axis k if bit k of i is set.
pub(super) struct Cell {
    planes: Vec4,
    bounds: [Bounds; 8],
    counts: [Count; 8],
    leaf: u32,
    /// For each set of parts, the subset that is split off first; 0: the set is not split.
    first: [u8; 256],
    /// Index of the first item of each part.
    starts: [u32; 8],
    /// Counts of each [`CHUNK`] per part; empty if one thread does all.
    chunks: Vec<[Count; 8]>,
}

/// Number of items, and of prims in them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Count {
    pub items: u32,
    pub prims: u32,
}

impl AddAssign for Count {
    fn add_assign(&mut self, other: Self) {
        self.items += other.items;
        self.prims += other.prims;
    }
}

/// Boxes of the parts, and their counts.
type Parts = ([Bounds; 8], [Count; 8]);

/// Sets of the parts before the plane of each axis.
const BEFORE: [u8; 3] = [0b0101_0101, 0b0011_0011, 0b0000_1111];

impl Lattice {
    pub(super) fn over(bounds: &Aabb) -> Self {
        let lo = bounds.lo + bounds.lo;
        let side = (bounds.hi + bounds.hi - lo).max_element();
        // Slightly fewer than all cells, so that the last middle falls into the last one.
        let cells = (1u32 << LEVELS) as f32 * (1.0 - f32::EPSILON);
        let scale = if side > 0.0 && side.is_finite() { cells / side } else { 0.0 };
        Self { lo: lo.extend(0.0), scale: Vec4::splat(scale) }
    }

    /// Position of a doubled middle, in finest cells.
    #[inline(always)]
    fn place(&self, middle: Vec4) -> Vec4 {
        (middle - self.lo) * self.scale
    }

    /// Smallest cell around the items, with its parts; `None` if all items are in one finest cell.
    pub(super) fn cell(&self, items: &[Item], leaf: u32) -> Option<Cell> {
        let shared = items.len() > 2 * CHUNK;
        let middles = if shared {
            items.par_chunks(CHUNK).map(around_middles).reduce(|| Bounds::EMPTY, Bounds::join)
        } else {
            around_middles(items)
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, NaN is 0")]
        let number = |middle: Vec4| self.place(middle).to_array().map(|x| x as u32);
        let (lo, hi) = (number(middles.lo), number(middles.hi));
        // Highest bit in which the outermost cells differ on any axis: set beyond a middle plane and clear before it.
        let differ = [0, 1, 2].map(|k: usize| lo[k] ^ hi[k]);
        let bit = (differ[0] | differ[1] | differ[2]).checked_ilog2()?;
        #[expect(clippy::cast_precision_loss, reason = "at most 23 bits")]
        let plane = |k: usize| if differ[k] >> bit == 1 { (hi[k] >> bit << bit) as f32 } else { f32::INFINITY };
        let planes = Vec4::new(plane(0), plane(1), plane(2), f32::INFINITY);

        let (mut bounds, mut counts, mut chunks) = ([Bounds::EMPTY; 8], [Count::default(); 8], Vec::new());
        if shared {
            let parts: Vec<Parts> = items.par_chunks(CHUNK).map(|items| self.parts(items, planes)).collect();
            for (of_chunk, count) in parts {
                for i in 0..8 {
                    bounds[i] = bounds[i].join(of_chunk[i]);
                    counts[i] += count[i];
                }
                chunks.push(count);
            }
        } else {
            (bounds, counts) = self.parts(items, planes);
        }
        let mut cell = Cell { planes, bounds, counts, leaf, first: [0; 256], starts: [0; 8], chunks };
        cell.order(Cell::ALL, &mut 0);
        Some(cell)
    }

    fn parts(&self, items: &[Item], planes: Vec4) -> Parts {
        let (mut bounds, mut counts) = ([Bounds::EMPTY; 8], [Count::default(); 8]);
        for item in items {
            let part = part(self.place(item.middle()), planes);
            bounds[part] = bounds[part].join(item.bounds());
            counts[part] += Count { items: 1, prims: item.count() };
        }
        (bounds, counts)
    }
}

#[inline(always)]
fn part(place: Vec4, planes: Vec4) -> usize {
    place.cmpge(planes).bitmask() as usize & 7
}

impl Cell {
    /// Set of all parts.
    pub(super) const ALL: u8 = u8::MAX;

    /// Subset of a set that is split off first; `None` if the set is not split.
    pub(super) fn cut(&self, set: u8) -> Option<u8> {
        Some(self.first[set as usize]).filter(|&first| first != 0)
    }

    /// Number of items and prims in a set of parts.
    pub(super) fn count(&self, set: u8) -> Count {
        let mut count = Count::default();
        members(set).for_each(|i| count += self.counts[i]);
        count
    }

    /// Box around a set of parts.
    pub(super) fn bounds(&self, set: u8) -> Bounds {
        members(set).fold(Bounds::EMPTY, |b, i| b.join(self.bounds[i]))
    }

    /// Chooses the splits of a set of parts, and the index of the first item of each part.
    fn order(&mut self, set: u8, start: &mut u32) {
        if let Some(first) = self.cheapest(set) {
            self.first[set as usize] = first;
            self.order(first, start);
            self.order(set & !first, start);
        } else {
            for i in members(set) {
                self.starts[i] = *start;
                *start += self.counts[i].items;
            }
        }
    }

    fn cheapest(&self, set: u8) -> Option<u8> {
        if self.count(set).prims <= self.leaf {
            return None;
        }
        let mut best = (f32::INFINITY, None);
        for before in BEFORE {
            let sides = [set & before, set & !before];
            let counts = sides.map(|side| self.count(side).prims);
            if counts[0] == 0 || counts[1] == 0 {
                continue;
            }
            let cost = |side: usize| {
                self.bounds(sides[side]).area() * weight(counts[side].cast_signed(), self.leaf.cast_signed())
            };
            let cost = cost(0) + cost(1);
            if best.1.is_none() || cost < best.0 {
                best = (cost, Some(sides[0]));
            }
        }
        best.1
    }

    /// Sorts items by part.
    pub(super) fn sort(&self, lattice: &Lattice, items: &[Item], sorted: &mut [Item]) {
        let part = |item: &Item| part(lattice.place(item.middle()), self.planes);
        if self.chunks.is_empty() {
            let mut next = self.starts;
            for item in items {
                let place = &mut next[part(item)];
                sorted[*place as usize] = *item;
                *place += 1;
            }
            return;
        }
        let put = |(items, places): (&[Item], [&mut [Item]; 8])| {
            let mut next = [0; 8];
            for item in items {
                let part = part(item);
                places[part][next[part]] = *item;
                next[part] += 1;
            }
        };
        items.par_chunks(CHUNK).zip(self.places(sorted)).for_each(put);
    }

    /// Destination of each chunk's items, per part.
    fn places<'s>(&self, mut sorted: &'s mut [Item]) -> Vec<[&'s mut [Item]; 8]> {
        let mut places: Vec<[&mut [Item]; 8]> = self.chunks.iter().map(|_| Default::default()).collect();
        let mut parts = [0, 1, 2, 3, 4, 5, 6, 7];
        parts.sort_by_key(|&part| self.starts[part]);
        for part in parts {
            for (places, counts) in places.iter_mut().zip(&self.chunks) {
                (places[part], sorted) = sorted.split_at_mut(counts[part].items as usize);
            }
        }
        places
    }
}

fn members(set: u8) -> impl Iterator<Item = usize> {
    (0..8).filter(move |i| set >> i & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    const SIDE: Aabb = Aabb { lo: Vec3::ZERO, hi: Vec3::splat(8.0) };

    fn items(at: &[Vec3]) -> Vec<Item> {
        let bounds = |p: Vec3| Aabb { lo: p - 0.01, hi: p + 0.01 };
        (0..).zip(at).map(|(prim, &p)| Item::new(bounds(p), prim)).collect()
    }

    fn sorted(cell: &Cell, lattice: &Lattice, items: &[Item]) -> Vec<u32> {
        let mut sorted = items.to_vec();
        cell.sort(lattice, items, &mut sorted);
        sorted.iter().map(Item::prim).collect()
    }

    #[test]
    fn a_cell_is_cut_at_its_middle_and_not_elsewhere() {
        // 3.9 and 4.1 lie on different sides of the plane at 4, 4.1 and 5.9 on the same side.
        let items = items(&[5.9, 3.9, 4.1].map(|x| Vec3::new(x, 0.5, 0.5)));
        let lattice = Lattice::over(&SIDE);
        let cell = lattice.cell(&items, 1).unwrap();
        let first = cell.cut(Cell::ALL).unwrap();
        assert_eq!((cell.count(first).prims, cell.count(!first).prims), (1, 2));
        assert_eq!((cell.cut(first), cell.cut(!first)), (None, None));
        assert_eq!(sorted(&cell, &lattice, &items), [1, 0, 2]);
        assert_eq!(cell.bounds(!first).aabb().lo.x, 4.1 - 0.01);
    }

    #[test]
    fn eight_corners_are_cut_apart_at_once_and_stay_together_where_they_fit_into_a_leaf() {
        let corner = |i: usize| Vec3::from([0, 1, 2].map(|k: usize| if i >> k & 1 == 1 { 7.0 } else { 1.0 }));
        let items = items(&[6, 1, 4, 0, 7, 2, 5, 3].map(corner));
        let lattice = Lattice::over(&SIDE);
        let cell = lattice.cell(&items, 1).unwrap();
        let (mut open, mut leaves) = (vec![Cell::ALL], Vec::new());
        while let Some(set) = open.pop() {
            match cell.cut(set) {
                Some(first) => open.extend([set & !first, first]),
                None => leaves.push(cell.count(set).prims),
            }
        }
        assert_eq!(leaves, [1; 8]);
        let mut prims = sorted(&cell, &lattice, &items);
        prims.sort_unstable();
        assert_eq!(prims, [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(lattice.cell(&items, 8).unwrap().cut(Cell::ALL), None);
    }

    #[test]
    fn many_items_are_put_in_order_by_several_threads_as_by_one() {
        let mut random = crate::math::random::Random::new(3);
        let at: Vec<Vec3> = (0..5 * CHUNK + 77).map(|_| (random.cube() + 1.0) * 4.0).collect();
        let (items, lattice) = (items(&at), Lattice::over(&SIDE));
        let cell = lattice.cell(&items, 8).unwrap();
        assert_eq!(cell.chunks.len(), 6);
        let (bounds, counts) = lattice.parts(&items, cell.planes);
        assert_eq!(cell.counts, counts);
        assert_eq!(cell.bounds.map(|b| b.aabb()), bounds.map(|b| b.aabb()));
        let alone = Cell { chunks: Vec::new(), bounds, counts, ..lattice.cell(&items, 8).unwrap() };
        assert_eq!(sorted(&cell, &lattice, &items), sorted(&alone, &lattice, &items));
    }

    #[test]
    fn what_no_plane_separates_is_no_cell() {
        assert!(Lattice::over(&SIDE).cell(&items(&[Vec3::ONE; 20]), 1).is_none());
        let point = Aabb { lo: Vec3::ONE, hi: Vec3::ONE };
        assert!(Lattice::over(&point).cell(&items(&[Vec3::ONE, Vec3::ZERO]), 1).is_none());
    }
}
