//! Splitting a set of prims in two.

pub(in crate::accel) mod area;
pub(in crate::accel) mod item;

pub(in crate::accel) use area::cut_by_area;
pub(in crate::accel) use item::{Bounds, Item, around};

/// Choice of the split planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Splitting {
    /// Planes of the cells of a uniform grid refined by octrees; small cells are split by surface area.
    Octree,
    /// Least expected cost by surface area (J. MacDonald, K. Booth, *Heuristics for Ray Tracing Using Space Subdivision*,
    /// 1990), in bins (I. Wald, *On Fast Construction of SAH-based Bounding Volume Hierarchies*, 2007).
    SurfaceArea,
}

/// A split: items before `at` have the first box, the others the second.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Cut {
    pub at: usize,
    /// Number of prims in the first part.
    pub prims: usize,
    pub bounds: [Bounds; 2],
    /// Boxes around the doubled middles of both parts, if they were free to compute.
    pub middles: Option<[Bounds; 2]>,
}

/// Splits inseparable items in two halves, in the order of the prims.
fn halves(items: &mut [Item]) -> Cut {
    items.sort_unstable_by_key(Item::prim);
    let at = items.len() / 2;
    let (first, second) = items.split_at(at);
    Cut { at, prims: item::count(first), bounds: [first, second].map(around), middles: None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::math::aabb::Aabb;

    fn items(at: &[f32]) -> Vec<Item> {
        let bounds = |x: f32| Aabb { lo: Vec3::new(x, 0.0, 0.0), hi: Vec3::new(x + 0.1, 1.0, 1.0) };
        (0..).zip(at).map(|(prim, &x)| Item::new(bounds(x), prim)).collect()
    }

    fn prims(items: &[Item]) -> Vec<u32> {
        let mut prims: Vec<u32> = items.iter().map(Item::prim).collect();
        prims.sort_unstable();
        prims
    }

    #[test]
    fn two_clusters_are_cut_apart() {
        let mut items = items(&[0.0, 7.0, 0.2, 7.3, 0.1]);
        let cut = cut_by_area(&mut items, 1, None);
        assert_eq!((prims(&items[..cut.at]), prims(&items[cut.at..])), (vec![0, 2, 4], vec![1, 3]));
        let [first, second] = cut.bounds.map(|b| b.aabb());
        assert_eq!((first.lo.x, first.hi.x, second.lo.x, second.hi.x), (0.0, 0.2 + 0.1, 7.0, 7.3 + 0.1));
    }

    #[test]
    fn leaves_are_filled_rather_than_halves_made_equal() {
        let mut items = items(&std::array::from_fn::<f32, 20, _>(|i| i as f32));
        assert_eq!(cut_by_area(&mut items.clone(), 1, None).at, 10);
        // Of parts of 8 and 12, the larger needs no more leaves than half the items do.
        assert!([8, 12].contains(&cut_by_area(&mut items, 8, None).at));
    }

    #[test]
    fn copies_are_halved() {
        let mut items = items(&[1.0; 9]);
        let cut = cut_by_area(&mut items, 1, None);
        assert_eq!((cut.at, prims(&items[..cut.at])), (4, vec![0, 1, 2, 3]));
    }

    #[test]
    fn boxes_beyond_all_numbers_are_cut_all_the_same() {
        let huge = Aabb { lo: Vec3::splat(-f32::MAX), hi: Vec3::splat(f32::MAX) };
        let mut items: Vec<Item> = (0..10).map(|prim| Item::new(huge, prim)).collect();
        let at = cut_by_area(&mut items, 1, None).at;
        assert!(at > 0 && at < 10);
    }
}
