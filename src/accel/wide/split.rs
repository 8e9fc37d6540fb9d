//! Where a set of prims is cut in two.

use crate::math::Vec3;
use crate::math::aabb::Aabb;

/// Who decides where to cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Splitting {
    /// Planes of the cells of a uniform grid refined by octrees.
    Octree,
    /// Least expected cost by surface area (J. MacDonald, K. Booth, *Heuristics for Ray Tracing Using Space Subdivision*,
    /// 1990), in bins (I. Wald, *On Fast Construction of SAH-based Bounding Volume Hierarchies*, 2007).
    SurfaceArea,
}

/// A prim on its way into the tree.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Item {
    pub bounds: Aabb,
    pub prim: u32,
    /// Finest octree cell of the box's middle.
    pub cell: [u32; 3],
}

/// A cut: items before `at` have the first box, the others the second.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Cut {
    pub at: usize,
    pub bounds: [Aabb; 2],
}

/// Levels of the octree: cells are numbered by so many bits on each axis.
pub(super) const LEVELS: u32 = 30;

/// Bins of each axis.
const BINS: usize = 16;

/// The middle of a box, doubled.
#[inline]
fn middle(b: &Aabb) -> Vec3 {
    b.lo + b.hi
}

/// What a box costs: half its surface.
#[inline]
pub(super) fn area(b: &Aabb) -> f32 {
    let d = (b.hi - b.lo).max(Vec3::ZERO);
    d.x * d.y + d.y * d.z + d.z * d.x
}

impl Splitting {
    /// Cuts at least two items in two, both parts not empty, and puts them in order.
    pub(in crate::accel) fn cut(self, items: &mut [Item]) -> Cut {
        let found = match self {
            Self::Octree => cut_at_dyadic_plane(items),
            Self::SurfaceArea => cut_by_area(items),
        };
        found.unwrap_or_else(|| halves(items))
    }
}

/// Items that nothing separates: half each, in the order of the prims.
fn halves(items: &mut [Item]) -> Cut {
    items.sort_unstable_by_key(|i| i.prim);
    let at = items.len() / 2;
    Cut { at, bounds: [around(&items[..at]), around(&items[at..])] }
}

pub(super) fn around(items: &[Item]) -> Aabb {
    items.iter().fold(Aabb::EMPTY, |b, i| b.union(i.bounds))
}

/// On each axis the coarsest plane of octree cells that separates the middles; of these three the one of least cost.
fn cut_at_dyadic_plane(items: &mut [Item]) -> Option<Cut> {
    let [first, ..] = items else { return None };
    let (mut lo, mut hi) = (first.cell, first.cell);
    for item in items.iter() {
        for k in 0..3 {
            lo[k] = lo[k].min(item.cell[k]);
            hi[k] = hi[k].max(item.cell[k]);
        }
    }
    // The highest bit in which the outermost cells differ: set beyond the plane and clear before it.
    let bits: [u32; 3] = std::array::from_fn(|k| (lo[k] ^ hi[k]).checked_ilog2().map_or(0, |bit| 1 << bit));

    let mut sides = [[Aabb::EMPTY; 2]; 3];
    let mut beyond = [0usize; 3];
    for item in items.iter() {
        for k in 0..3 {
            let side = usize::from(item.cell[k] & bits[k] != 0);
            sides[k][side] = sides[k][side].union(item.bounds);
            beyond[k] += side;
        }
    }
    let cost = |k: usize| area(&sides[k][0]) * count(items.len() - beyond[k]) + area(&sides[k][1]) * count(beyond[k]);
    let axis = (0..3).filter(|&k| bits[k] != 0).min_by(|&a, &b| cost(a).total_cmp(&cost(b)))?;
    let at = partition(items, |i| i.cell[axis] & bits[axis] == 0);
    Some(Cut { at, bounds: sides[axis] })
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, count: 0 };

    fn join(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    fn cost(&self) -> f32 {
        area(&self.bounds) * count(self.count)
    }
}

/// Between bins of the middles, on the axis and at the place of least cost.
fn cut_by_area(items: &mut [Item]) -> Option<Cut> {
    let middles = items.iter().fold(Aabb::EMPTY, |b, i| {
        let m = middle(&i.bounds);
        Aabb { lo: b.lo.min(m), hi: b.hi.max(m) }
    });
    let extent = middles.hi - middles.lo;
    #[expect(clippy::cast_precision_loss, reason = "a few bins")]
    let scale = extent.map(|e| if e > 0.0 && e.is_finite() { BINS as f32 / e } else { 0.0 });
    let bin_of = |item: &Item, k: usize| bin(middle(&item.bounds)[k], middles.lo[k], scale[k]);

    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items.iter() {
        for (k, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[bin_of(item, k)];
            *bin = bin.join(Bin { bounds: item.bounds, count: 1 });
        }
    }
    let mut best: Option<(f32, usize, usize, [Aabb; 2])> = None;
    for (axis, bins) in bins.iter().enumerate() {
        // Everything from bin i on, then the sweep from the left.
        let mut after = [Bin::EMPTY; BINS + 1];
        for i in (0..BINS).rev() {
            after[i] = after[i + 1].join(bins[i]);
        }
        let mut before = Bin::EMPTY;
        for i in 1..BINS {
            before = before.join(bins[i - 1]);
            if before.count == 0 || after[i].count == 0 {
                continue;
            }
            let cost = before.cost() + after[i].cost();
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, i, [before.bounds, after[i].bounds]));
            }
        }
    }
    let (_, axis, place, bounds) = best?;
    let at = partition(items, |i| bin_of(i, axis) < place);
    Some(Cut { at, bounds })
}

#[inline]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, NaN is 0")]
fn bin(x: f32, lo: f32, scale: f32) -> usize {
    (((x - lo) * scale) as usize).min(BINS - 1)
}

/// Moves the items for which `first` holds to the front; how many there are.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut at = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(at, i);
            at += 1;
        }
    }
    at
}

#[expect(clippy::cast_precision_loss, reason = "a cost")]
fn count(n: usize) -> f32 {
    n as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(at: &[f32]) -> Vec<Item> {
        let item = |(prim, &x): (u32, &f32)| Item {
            bounds: Aabb { lo: Vec3::new(x, 0.0, 0.0), hi: Vec3::new(x + 0.1, 1.0, 1.0) },
            prim,
            cell: [(x * 1024.0) as u32, 5, 5],
        };
        (0..).zip(at).map(item).collect()
    }

    fn prims(items: &[Item]) -> Vec<u32> {
        let mut prims: Vec<u32> = items.iter().map(|i| i.prim).collect();
        prims.sort_unstable();
        prims
    }

    #[test]
    fn two_clusters_are_cut_apart() {
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let mut items = items(&[0.0, 7.0, 0.2, 7.3, 0.1]);
            let cut = splitting.cut(&mut items);
            assert_eq!(
                (prims(&items[..cut.at]), prims(&items[cut.at..])),
                (vec![0, 2, 4], vec![1, 3]),
                "{splitting:?}"
            );
            assert_eq!(cut.bounds[1].lo.x, 7.0);
        }
    }

    #[test]
    fn the_octree_cuts_at_planes_of_its_cells_and_not_elsewhere() {
        // 3.9 and 4.1 lie on either side of the plane at 4, 4.1 and 5.9 on the same.
        let mut items = items(&[5.9, 3.9, 4.1]);
        let cut = Splitting::Octree.cut(&mut items);
        assert_eq!(prims(&items[..cut.at]), [1]);
    }

    #[test]
    fn copies_are_halved() {
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let mut items = items(&[1.0; 9]);
            let cut = splitting.cut(&mut items);
            assert_eq!((cut.at, prims(&items[..cut.at])), (4, vec![0, 1, 2, 3]));
        }
    }
}
