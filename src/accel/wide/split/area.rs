//! The cut of least expected cost by surface area, in bins.

use rayon::prelude::*;

use super::item::{Bounds, Item, around_middles};
use super::{Cut, halves};
use crate::math::Vec4;

/// Bins of each axis.
const BINS: usize = 16;

/// Items that several threads put into bins, and how many one of them takes.
const PARALLEL: usize = 1 << 16;
const CHUNK: usize = 1 << 14;

/// Adding it to a small number leaves its nearest integer in the lowest bits.
const TO_INTEGER: f32 = (1 << 23) as f32;

/// What part of the cost of a set a leaf's tests are, against those of its prims: a leaf is tested at once, full or not.
const WHOLE_LEAVES: f32 = 0.5;

/// Boxes and numbers of what falls into each bin.
#[derive(Clone, Copy)]
struct Bins {
    bounds: [[Bounds; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

/// Where bins begin, and how many there are for a unit of length.
#[derive(Clone, Copy)]
struct Ruler {
    lo: Vec4,
    scale: Vec4,
}

impl Ruler {
    fn over(middles: &Bounds) -> Self {
        // A little less than all bins, so that the last middle is in the last one.
        let per_unit = |extent: f32| match extent {
            e if e > 0.0 && e.is_finite() => BINS as f32 * (1.0 - 1.0 / 1024.0) / e,
            _ => 0.0,
        };
        let extent = middles.hi - middles.lo;
        let scale = Vec4::new(per_unit(extent.x), per_unit(extent.y), per_unit(extent.z), 0.0);
        Self { lo: middles.lo, scale }
    }

    /// The bins of an item on the three axes, plus [`TO_INTEGER`].
    #[inline(always)]
    fn place(&self, item: &Item) -> Vec4 {
        let place = (item.middle() - self.lo) * self.scale - Vec4::splat(0.5);
        place.max(Vec4::ZERO) + Vec4::splat(TO_INTEGER)
    }
}

impl Bins {
    const EMPTY: Self = Self { bounds: [[Bounds::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };

    fn of(items: &[Item], ruler: &Ruler) -> Self {
        let mut all = Self::EMPTY;
        for item in items {
            let [x, y, z, _] = ruler.place(item).to_array();
            for (k, place) in [x, y, z].into_iter().enumerate() {
                let bin = place.to_bits() as usize % BINS;
                let bounds = &mut all.bounds[k][bin];
                *bounds = bounds.join(item.bounds());
                all.counts[k][bin] += 1;
            }
        }
        all
    }

    fn join(mut self, other: &Self) -> Self {
        for k in 0..3 {
            for i in 0..BINS {
                self.bounds[k][i] = self.bounds[k][i].join(other.bounds[k][i]);
                self.counts[k][i] += other.counts[k][i];
            }
        }
        self
    }

    /// The axis and the first bin of the second part.
    fn cheapest(&self, leaf: u32) -> Option<(usize, usize)> {
        let mut best = (f32::INFINITY, None);
        for k in 0..3 {
            let (bounds, counts) = (&self.bounds[k], &self.counts[k]);
            let mut after = [f32::INFINITY; BINS];
            let (mut all, mut count) = (Bounds::EMPTY, 0);
            for i in (1..BINS).rev() {
                all = all.join(bounds[i]);
                count += counts[i];
                if count > 0 {
                    after[i] = all.area() * weight(count, leaf);
                }
            }
            (all, count) = (Bounds::EMPTY, 0);
            for i in 1..BINS {
                all = all.join(bounds[i - 1]);
                count += counts[i - 1];
                let cost = all.area() * weight(count, leaf) + after[i];
                if count > 0 && cost < best.0 {
                    best = (cost, Some((k, i)));
                }
            }
        }
        best.1
    }

    fn parts(&self, axis: usize, place: usize) -> [Bounds; 2] {
        let (first, second) = self.bounds[axis].split_at(place);
        [first, second].map(|bins| bins.iter().fold(Bounds::EMPTY, |b, bin| b.join(*bin)))
    }
}

/// What a set of so many costs where leaves hold up to `leaf`, a power of two.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "a cost")]
pub(in crate::accel) fn weight(count: u32, leaf: u32) -> f32 {
    let whole_leaves = count.wrapping_add(leaf - 1) & !(leaf - 1);
    count as f32 + WHOLE_LEAVES * whole_leaves as f32
}

/// Cuts at least two items between bins of their middles, on the axis and at the place of least cost, where leaves hold up
/// to `leaf` of them, a power of two; both parts are not empty.
pub(in crate::accel) fn cut_by_area(items: &mut [Item], leaf: u32) -> Cut {
    let (ruler, bins) = if items.len() > PARALLEL {
        let chunks = items.par_chunks(CHUNK);
        let ruler = Ruler::over(&chunks.clone().map(around_middles).reduce(|| Bounds::EMPTY, Bounds::join));
        (ruler, chunks.map(|items| Bins::of(items, &ruler)).reduce(|| Bins::EMPTY, |a, b| a.join(&b)))
    } else {
        let ruler = Ruler::over(&around_middles(items));
        (ruler, Bins::of(items, &ruler))
    };
    let Some((axis, place)) = bins.cheapest(leaf) else { return halves(items) };
    #[expect(clippy::cast_precision_loss, reason = "a few bins")]
    let second = Vec4::splat(TO_INTEGER + place as f32);
    let at = partition(items, |item| ruler.place(item).cmplt(second).bitmask() >> axis & 1 == 1);
    if at == 0 || at == items.len() {
        // Only where boxes are so large that differences of places overflow.
        return halves(items);
    }
    Cut { at, bounds: bins.parts(axis, place) }
}

/// Moves the items for which `first` holds to the front; how many there are. Nothing depends on a branch, which could not
/// be foreseen.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut at = 0;
    for i in 0..items.len() {
        let is_first = first(&items[i]);
        items.swap(at, i);
        at += usize::from(is_first);
    }
    at
}
