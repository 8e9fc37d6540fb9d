//! Binned split of least expected cost by surface area.

use super::item::{Bounds, Item, around_middles};
use super::{Cut, halves};
use crate::math::{Mat4, Vec4};
use rayon::prelude::*;

/// Number of bins per axis.
const BINS: usize = 16;

/// Up to this many items, half the bins suffice.
const FEW: usize = 16;

/// Above this many items, only one in `STRIDE` is binned: the splits are as good, and less memory is read.
const MANY: usize = 1 << 11;
const STRIDE: usize = 4;

/// Above this many items, several threads partition halves of them, and bin `CHUNK` at a time. The same for every number of
/// threads, and so is the order of items.
const SHARED: usize = 1 << 16;
const CHUNK: usize = STRIDE << 12;

/// Adding this to a small number leaves its nearest integer in the lowest bits.
const TO_INTEGER: f32 = (1 << 23) as f32;

/// Weight of the tests of whole leaves in the cost of a set, relative to those of its prims: a leaf is tested at once, full
/// or not.
const WHOLE_LEAVES: f32 = 0.5;

/// Boxes and counts of the items in each of `N` bins, on the three axes.
#[derive(Clone, Copy)]
struct Bins<const N: usize> {
    bounds: [[Bounds; 3]; N],
    counts: [[i32; 4]; N],
}

/// Origin of the bins, and their number per unit of length.
#[derive(Clone, Copy)]
struct Ruler {
    lo: Vec4,
    scale: Vec4,
}

/// Split of a set between two bins.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SplitPlane {
    axis: usize,
    /// First bin of the second part.
    bin: usize,
    /// Cost of both parts.
    cost: f32,
}

impl Ruler {
    fn over(middles: &Bounds, bins: usize) -> Self {
        // Slightly fewer than all bins, so that the last middle falls into the last one.
        let per_unit = |extent: f32| match extent {
            e if e > 0.0 && e.is_finite() => bins as f32 * (1.0 - 1.0 / 1024.0) / e,
            _ => 0.0,
        };
        let extent = middles.hi - middles.lo;
        let scale = Vec4::new(per_unit(extent.x), per_unit(extent.y), per_unit(extent.z), 0.0);
        Self { lo: middles.lo, scale }
    }

    /// Axis on which the middles are farthest apart.
    fn longest_axis(&self) -> usize {
        let scale = self.scale.to_array().map(|scale| if scale > 0.0 { scale } else { f32::INFINITY });
        (1..3).fold(0, |longest, axis| if scale[axis] < scale[longest] { axis } else { longest })
    }

    /// Bins of an item on the three axes, plus [`TO_INTEGER`].
    #[inline(always)]
    fn place(&self, item: &Item) -> Vec4 {
        let place = (item.middle() - self.lo) * self.scale - Vec4::splat(0.5);
        place.max(Vec4::ZERO) + Vec4::splat(TO_INTEGER)
    }
}

impl<const N: usize> Bins<N> {
    const EMPTY: Self = Self { bounds: [[Bounds::EMPTY; 3]; N], counts: [[0; 4]; N] };

    /// Bins a sample of many items.
    fn of_many(items: &[Item], ruler: &Ruler) -> Self {
        let some = |items: &[Item]| {
            let mut bins = Self::EMPTY;
            bins.add(items.iter().step_by(STRIDE), ruler);
            bins
        };
        if items.len() <= SHARED {
            return some(items);
        }
        items.par_chunks(CHUNK).map(some).reduce(|| Self::EMPTY, Self::join)
    }

    fn join(mut self, other: Self) -> Self {
        for (all, bounds) in self.bounds.as_flattened_mut().iter_mut().zip(other.bounds.as_flattened()) {
            *all = all.join(*bounds);
        }
        for (all, count) in self.counts.as_flattened_mut().iter_mut().zip(other.counts.as_flattened()) {
            *all += count;
        }
        self
    }

    fn add<'i>(&mut self, items: impl Iterator<Item = &'i Item>, ruler: &Ruler) {
        for item in items {
            let [x, y, z, _] = ruler.place(item).to_array();
            let count = item.count().cast_signed();
            for (k, place) in [x, y, z].into_iter().enumerate() {
                let bin = place.to_bits() as usize % N;
                let bounds = &mut self.bounds[bin][k];
                *bounds = bounds.join(item.bounds());
                self.counts[bin][k] += count;
            }
        }
    }

    /// Split of least cost; `None` if every split leaves a part empty. The cost of an empty part is NaN, and never less.
    fn cheapest(&self, leaf: u32) -> Option<SplitPlane> {
        let mut after = [Vec4::ZERO; N];
        let mut part = Sides::EMPTY;
        for i in (1..N).rev() {
            part.add(&self.bounds[i], &self.counts[i]);
            after[i] = part.costs(leaf);
        }
        let (mut least, mut at) = ([f32::INFINITY; 4], [0u8; 4]);
        part = Sides::EMPTY;
        let before = self.bounds.iter().zip(&self.counts);
        for (i, ((bounds, counts), after)) in (1..).zip(before.zip(&after[1..])) {
            part.add(bounds, counts);
            let costs = (part.costs(leaf) + *after).to_array();
            for ((least, at), cost) in least.iter_mut().zip(&mut at).zip(costs) {
                (*least, *at) = if cost < *least { (cost, i) } else { (*least, *at) };
            }
        }
        let axes = (0..3).filter(|&k| at[k] > 0);
        // The first of equal ones.
        let axis = axes.reduce(|a, b| if least[b] < least[a] { b } else { a })?;
        Some(SplitPlane { axis, bin: usize::from(at[axis]), cost: least[axis] })
    }

    /// Area of the box around all items, computed at the split.
    fn area(&self, axis: usize, bin: usize) -> f32 {
        let [first, second] = self.parts(axis, bin);
        first.join(second).area()
    }

    fn parts(&self, axis: usize, bin: usize) -> [Bounds; 2] {
        let (first, second) = self.bounds.split_at(bin);
        [first, second].map(|bins| bins.iter().fold(Bounds::EMPTY, |b, bin| b.join(bin[axis])))
    }
}

/// Items on one side of a position, on each axis.
struct Sides {
    bounds: [Bounds; 3],
    counts: [i32; 4],
}

impl Sides {
    const EMPTY: Self = Self { bounds: [Bounds::EMPTY; 3], counts: [0; 4] };

    #[inline(always)]
    fn add(&mut self, bounds: &[Bounds; 3], counts: &[i32; 4]) {
        self.bounds.iter_mut().zip(bounds).for_each(|(all, bounds)| *all = all.join(*bounds));
        self.counts.iter_mut().zip(counts).for_each(|(all, count)| *all += count);
    }

    /// Cost of the items: [`Bounds::area`] times [`weight`], with the three axes in lanes.
    #[inline(always)]
    fn costs(&self, leaf: u32) -> Vec4 {
        let [a, b, c] = self.bounds.map(|b| b.hi - b.lo);
        let Mat4 { x_axis: x, y_axis: y, z_axis: z, .. } = Mat4::from_cols(a, b, c, Vec4::ZERO).transpose();
        (x * y + z * (x + y)) * Vec4::from_array(self.counts.map(|count| weight(count, leaf.cast_signed())))
    }
}

/// Cost of a set of `count` prims where leaves hold up to `leaf`, a power of two.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "a cost")]
pub(in crate::accel) fn weight(count: i32, leaf: i32) -> f32 {
    let whole_leaves = count.wrapping_add(leaf - 1) & !(leaf - 1);
    count as f32 + WHOLE_LEAVES * whole_leaves as f32
}

/// Splits at least two items between bins of their middles, on the axis and at the position of least cost, where leaves hold
/// up to `leaf` prims, a power of two; neither part is empty. `middles` is the box around their middles, if known.
pub(in crate::accel) fn cut_by_area(items: &mut [Item], leaf: u32, middles: Option<Bounds>) -> Cut {
    if items.len() <= FEW { cut_in::<{ BINS / 2 }>(items, leaf, middles) } else { cut_in::<BINS>(items, leaf, middles) }
}

/// Splits items between two of `N` bins.
fn cut_in<const N: usize>(items: &mut [Item], leaf: u32, middles: Option<Bounds>) -> Cut {
    let many = items.len() > MANY;
    let ruler = Ruler::over(&middles.unwrap_or_else(|| around_middles(items)), N);
    let mut bins = Bins::<N>::EMPTY;
    if many {
        bins = Bins::of_many(items, &ruler);
    } else {
        bins.add(items.iter(), &ruler);
    }
    let (axis, bin) = match bins.cheapest(leaf) {
        None => return halves(items),
        // The box of all items has no area, because the prims are on a line or so small that it underflows: all splits cost
        // the same.
        Some(SplitPlane { axis, bin, cost: 0.0 }) if bins.area(axis, bin) == 0.0 => (ruler.longest_axis(), N / 2),
        Some(SplitPlane { axis, bin, .. }) => (axis, bin),
    };
    #[expect(clippy::cast_precision_loss, reason = "a few bins")]
    let second = Vec4::splat(TO_INTEGER + bin as f32);
    let is_first = |item: &Item| ruler.place(item).cmplt(second).bitmask() >> axis & 1 == 1;
    let cut = if many {
        shared_partition(items, &is_first)
    } else {
        let prims = bins.counts[..bin].iter().map(|counts| counts[axis]).sum::<i32>().cast_unsigned() as usize;
        Cut { at: partition(items, is_first), prims, bounds: bins.parts(axis, bin), middles: None }
    };
    // A part can be empty only where differences of positions, or their fractions of a bin, overflow.
    if cut.at == 0 || cut.at == items.len() { halves(items) } else { cut }
}

/// Moves the items for which `first` holds to the front, and returns their number. Free of branches, which would be
/// unpredictable.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut at = 0;
    for i in 0..items.len() {
        let is_first = first(&items[i]);
        items.swap(at, i);
        at += usize::from(is_first);
    }
    at
}

/// Partitions items by several threads, and computes the boxes of both parts.
fn shared_partition(items: &mut [Item], first: &(impl Fn(&Item) -> bool + Sync)) -> Cut {
    if items.len() <= SHARED {
        return measured_partition(items, first);
    }
    let (front, back) = items.split_at_mut(items.len() / 2);
    let (a, b) = rayon::join(|| shared_partition(front, first), || shared_partition(back, first));
    // Swaps the misplaced items at the ends of the halves.
    let count = (front.len() - a.at).min(b.at);
    let seconds = front[a.at..][..count].par_chunks_mut(CHUNK);
    seconds.zip(back[b.at - count..b.at].par_chunks_mut(CHUNK)).for_each(|(a, b)| a.swap_with_slice(b));
    let both = |[a, b]: [Bounds; 2], [c, d]: [Bounds; 2]| [a.join(c), b.join(d)];
    let middles = a.middles.zip(b.middles).map(|(a, b)| both(a, b));
    Cut { at: a.at + b.at, prims: a.prims + b.prims, bounds: both(a.bounds, b.bounds), middles }
}

/// Partitions items by one thread, and computes the boxes of both parts.
fn measured_partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> Cut {
    let (mut at, mut prims, mut bounds, mut middles) = (0, 0, [Bounds::EMPTY; 2], [Bounds::EMPTY; 2]);
    for i in 0..items.len() {
        let item = items[i];
        let is_first = first(&item);
        let part = usize::from(!is_first);
        bounds[part] = bounds[part].join(item.bounds());
        middles[part] = middles[part].with(item.middle());
        items.swap(at, i);
        at += usize::from(is_first);
        prims += usize::from(is_first) * item.count() as usize;
    }
    Cut { at, prims, bounds, middles: Some(middles) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::math::aabb::Aabb;
    use crate::math::random::Random;

    /// Cheapest split by its definition: axis by axis, bin by bin, with the boxes of both parts computed anew.
    fn defined<const N: usize>(bins: &Bins<N>, leaf: u32) -> Option<SplitPlane> {
        let mut best: Option<SplitPlane> = None;
        for axis in 0..3 {
            for bin in 1..N {
                let counts = [0..bin, bin..N].map(|part| bins.counts[part].iter().map(|c| c[axis]).sum::<i32>());
                let [a, b] = bins.parts(axis, bin);
                let cost =
                    a.area() * weight(counts[0], leaf.cast_signed()) + b.area() * weight(counts[1], leaf.cast_signed());
                if cost < best.map_or(f32::INFINITY, |best| best.cost) {
                    best = Some(SplitPlane { axis, bin, cost });
                }
            }
        }
        best
    }

    fn assert_cheapest_is_as_defined<const N: usize>(items: &[Item], leaf: u32) {
        let mut bins = Bins::<N>::EMPTY;
        bins.add(items.iter(), &Ruler::over(&around_middles(items), N));
        assert_eq!(bins.cheapest(leaf), defined(&bins, leaf), "{} items, leaves of {leaf}", items.len());
    }

    #[test]
    fn prims_are_counted_in_each_part_however_many_an_item_has() {
        let mut random = Random::new(4);
        for count in [2, 9, 40, 2 * MANY as u32] {
            for shape in [Vec3::ONE, Vec3::ZERO] {
                let corners: Vec<Vec3> = (0..3 * count).map(|_| random.cube() * shape).collect();
                let faces = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                let shapes = crate::accel::tests::scenes::mesh(corners, faces);
                let mut items = vec![Item::of(&shapes, 0); count as usize];
                let len = Item::in_pairs(&shapes, 0, &shapes.triangles, &mut items);
                items.truncate(len);
                let cut = cut_by_area(&mut items, 8, None);
                let prims = items[..cut.at].iter().flat_map(Item::prims).count();
                assert_eq!(cut.prims, prims, "{count} {shape}");
                assert!(items.iter().flat_map(Item::prims).count() == count as usize);
            }
        }
    }

    #[test]
    fn sets_without_area_are_cut_in_the_middle() {
        let mut random = Random::new(3);
        for (shape, size) in [(Vec3::new(0.0, 1.0, 0.0), 0.0), (Vec3::new(1e-25, 3e-25, 2e-25), 1e-27)] {
            for count in [10, 300, 3 * MANY as u32] {
                let mut item = |prim| {
                    let at = random.cube() * shape;
                    Item::new(Aabb { lo: at, hi: at + Vec3::splat(size) }, prim)
                };
                let mut items: Vec<Item> = (0..count).map(&mut item).collect();
                let cut = cut_by_area(&mut items, 8, None);
                let part = cut.at as f32 / count as f32;
                assert!((0.2..0.8).contains(&part), "{count}: {part}");
                let y = |item: &Item| item.bounds().lo.y;
                let (first, second) = items.split_at(cut.at);
                let most = first.iter().map(y).fold(f32::MIN, f32::max);
                assert!(second.iter().all(|item| y(item) > most - shape.y / 1000.0), "{count}");
            }
        }
    }

    #[test]
    fn two_lines_are_cut_apart_wherever_they_end() {
        let mut random = Random::new(5);
        for count in [10, 300] {
            let mut item = |prim: u32| {
                let at = Vec3::new(random.unit() * 9.0, (prim % 2) as f32, 0.0);
                Item::new(Aabb { lo: at, hi: at }, prim)
            };
            let mut items: Vec<Item> = (0..count).map(&mut item).collect();
            let cut = cut_by_area(&mut items, 8, None);
            assert!(cut.at as u32 == count / 2 && items[..cut.at].iter().all(|item| item.bounds().lo.y == 0.0));
        }
    }

    #[test]
    fn many_items_are_cut_by_several_threads_as_by_one() {
        let mut random = Random::new(7);
        let mut item = |prim| {
            let at = random.cube() * Vec3::new(4.0, 1.0, 1.0);
            Item::new(Aabb { lo: at, hi: at + random.unit() * 0.1 }, prim)
        };
        let items: Vec<Item> = (0..5 * SHARED as u32 / 2 + 3).map(&mut item).collect();
        let ruler = Ruler::over(&around_middles(&items), BINS);
        let mut alone = Bins::<BINS>::EMPTY;
        alone.add(items.iter().step_by(STRIDE), &ruler);
        let shared = Bins::<BINS>::of_many(&items, &ruler);
        assert_eq!((shared.counts, shared.cheapest(8)), (alone.counts, alone.cheapest(8)));
        let prims = |items: &[Item]| {
            let mut prims: Vec<u32> = items.iter().map(Item::prim).collect();
            prims.sort_unstable();
            prims
        };
        // From hardly any items in the first part to nearly all.
        for place in [-3.9, -1.0, 0.0, 2.0, 3.99] {
            let is_first = |item: &Item| item.bounds().lo.x < place;
            let (mut one, mut several) = (items.clone(), items.clone());
            let (a, b) = (measured_partition(&mut one, is_first), shared_partition(&mut several, &is_first));
            assert_eq!((a.at, a.prims), (b.at, b.prims));
            assert_eq!((prims(&one[..a.at]), prims(&one[a.at..])), (prims(&several[..b.at]), prims(&several[b.at..])));
            let boxes = |cut: Cut| [cut.bounds, cut.middles.unwrap()].map(|both| both.map(|b| b.aabb()));
            assert_eq!(boxes(a), boxes(b));
        }
    }

    #[test]
    fn the_sweep_over_three_axes_finds_the_cut_that_is_cheapest_by_definition() {
        let mut random = Random::new(9);
        for count in [2, 3, 9, 16, 40, 300] {
            for shape in [Vec3::ONE, Vec3::new(1.0, 0.0, 5.0), Vec3::ZERO] {
                let mut item = |prim| {
                    let (at, size) = (random.cube() * shape, random.unit() * 0.3);
                    Item::new(Aabb { lo: at, hi: at + size }, prim)
                };
                let items: Vec<Item> = (0..count).map(&mut item).collect();
                for leaf in [1, 8] {
                    assert_cheapest_is_as_defined::<{ BINS / 2 }>(&items, leaf);
                    assert_cheapest_is_as_defined::<BINS>(&items, leaf);
                }
            }
        }
    }
}
