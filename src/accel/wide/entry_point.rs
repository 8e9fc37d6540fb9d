//! Entry points: nodes at which whole groups of a pencil's rays enter the tree.
//!
//! Consecutive packets meet the same boxes near the root. These boxes are tested once against all rays of a group of packets,
//! and the remaining children form one extra node, at which each packet starts (after A. Reshetov, A. Soupikov and J. Hurley,
//! *Multi-Level Ray Tracing Algorithm*, 2005).

use super::flight::FARTHEST_FIRST;
use super::interval_ray::IntervalRay;
use super::node::{Child, Node, Tree};
use super::packet_rays::all;
use super::slabs::BoxMargins;
use crate::accel::query_batch::Pencil;
use crate::math::Vec3;
use crate::math::bounds::{BOX_RANGE, PARALLEL};
use crate::math::simd::{LANES, Lanewise, Simd, WIDE};

/// Number of rays in a group: eight broad packets.
pub(super) const GROUP: usize = 256;

/// Entry point of one group of rays.
pub(super) struct EntryPoint {
    /// Children that any of the rays may meet, the nearest in the slot that their octant visits first.
    pub node: Node,
    /// End of the group: index of the ray after its last one.
    end: usize,
    pub state: State,
}

/// State of a group's entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// No entry point: the rays start at the root.
    Unknown,
    /// The rays start at the entry point.
    Open,
    /// No ray of the group meets a box.
    Closed,
}

/// A child, by its node and slot.
#[derive(Clone, Copy, Default)]
struct Spot {
    node: u32,
    slot: usize,
}

/// Bounds of the directions of a group.
struct Directions {
    octant: usize,
    /// Smallest and largest reciprocals.
    inverse: [Vec3; 2],
}

impl EntryPoint {
    pub(super) fn new() -> Self {
        Self { node: Node::EMPTY, end: 0, state: State::Unknown }
    }

    /// Whether the ray `start` begins a new group.
    #[inline(always)]
    pub(super) fn is_passed(&self, start: usize) -> bool {
        start >= self.end
    }

    /// Packed child at which `count` rays from `start` on enter.
    #[inline(always)]
    pub(super) fn of(&self, start: usize, count: usize) -> u32 {
        if self.state == State::Unknown || start + count > self.end { 0 } else { Child::ENTRY_POINT }
    }

    /// Finds the entry point of the group that begins at `start`, if there are enough rays.
    #[inline(always)]
    pub(super) fn find<B: BoxMargins, S: Simd>(&mut self, s: S, tree: &Tree, pencil: &Pencil, start: usize) {
        (self.end, self.state) = (start + GROUP, State::Unknown);
        let whole = tree.extent + pencil.origin.abs().element_sum();
        if !(1.0 / BOX_RANGE..=BOX_RANGE).contains(&whole) {
            return;
        }
        let Some(Directions { octant, inverse }) = Directions::of(s.wide(), pencil, start) else { return };
        let interval = IntervalRay::new::<B>(tree, octant, inverse, [pencil.origin; 2], 0.0);
        self.state = self.open(s, tree, &interval, octant);
    }

    /// Opens nodes as long as there is room for their children.
    #[inline(always)]
    fn open<S: Simd>(&mut self, s: S, tree: &Tree, interval: &IntervalRay, octant: usize) -> State {
        let mut spots = [Spot::default(); LANES];
        let mut count = put(&mut spots, 0, 0, octant, met(s, tree, interval, octant, 0));
        let mut opened = true;
        while opened {
            opened = false;
            let before = spots;
            let (behind, mut kept) = (count, 0);
            for (i, &spot) in before[..behind].iter().enumerate() {
                let child = tree.nodes[spot.node as usize].children[spot.slot % LANES];
                let room = LANES + 1 + i - behind - kept;
                if !Child::is_leaf(child) {
                    let met = met(s, tree, interval, octant, child);
                    if met.count_ones() as usize <= room {
                        kept = put(&mut spots, kept, child, octant, met);
                        opened = true;
                        continue;
                    }
                }
                spots[kept % LANES] = spot;
                kept += 1;
            }
            count = kept;
        }
        if count == 0 {
            return State::Closed;
        }
        self.node = Node::EMPTY;
        for (rank, spot) in spots[..count].iter().enumerate() {
            let (to, from) = ((rank ^ octant) % LANES, spot.slot % LANES);
            let node = &tree.nodes[spot.node as usize];
            for (row, planes) in self.node.planes.iter_mut().zip(&node.planes) {
                row[to] = planes[from];
            }
            self.node.children[to] = node.children[from];
        }
        State::Open
    }
}

/// Bit mask of the children of a node that any ray of an interval ray may meet.
#[inline(always)]
fn met<S: Simd>(s: S, tree: &Tree, interval: &IntervalRay, octant: usize, node: u32) -> usize {
    interval.meets(s, &tree.nodes[node as usize].planes, octant, f32::INFINITY).1 as usize % 256
}

/// Appends the children in the mask `met` to `spots`, the nearest first, and returns the new count.
#[inline(always)]
fn put(spots: &mut [Spot; LANES], mut count: usize, node: u32, octant: usize, met: usize) -> usize {
    let order = FARTHEST_FIRST[octant % LANES][met];
    let found = met.count_ones() as usize;
    for k in (0..found).rev() {
        spots[count % LANES] = Spot { node, slot: (order >> (4 * k) & 7) as usize };
        count += 1;
    }
    count
}

impl Directions {
    /// Bounds of a group of a pencil; `None` unless its rays share an octant and the bounds of padded boxes hold for their
    /// numbers.
    #[inline(always)]
    fn of<T: Lanewise<WIDE>>(s: T, pencil: &Pencil, start: usize) -> Option<Self> {
        let [x, y, z] = pencil.dirs.map(|row| row.get(start..start + GROUP));
        let rows = [x?, y?, z?].map(|row| row.as_chunks::<WIDE>().0);
        let [infinite, zero] = [s.splat(f32::INFINITY), s.splat(0.0)];
        let (mut least, mut greatest, mut sum) = ([infinite; 3], [s.sub(zero, infinite); 3], zero);
        for (x, (y, z)) in rows[0].iter().zip(rows[1].iter().zip(rows[2])) {
            let d = [s.load(x), s.load(y), s.load(z)];
            for k in 0..3 {
                (least[k], greatest[k]) = (s.smaller(d[k], least[k]), s.greater(d[k], greatest[k]));
            }
            sum = s.add(sum, s.add(s.add(d[0], d[1]), d[2]));
        }
        // A sum keeps a NaN.
        if s.at_most(s.abs(sum), s.splat(f32::MAX)) & all::<WIDE>() != all::<WIDE>() {
            return None;
        }
        let [x, y, z, _] = s.least_of_each([least[0], least[1], least[2], zero]);
        let low = Vec3::new(x, y, z);
        let negative = [s.sub(zero, greatest[0]), s.sub(zero, greatest[1]), s.sub(zero, greatest[2]), zero];
        let [x, y, z, _] = s.least_of_each(negative);
        let high = -Vec3::new(x, y, z);
        let (forwards, backwards) = (low.cmpgt(Vec3::ZERO), high.cmplt(Vec3::ZERO));
        let (least, greatest) = (Vec3::select(forwards, low, -high), Vec3::select(forwards, high, -low));
        let range = 1.0 / BOX_RANGE..=BOX_RANGE;
        let fit = (forwards | backwards).all();
        if !fit || !range.contains(&least.element_sum()) || !range.contains(&greatest.element_sum()) {
            return None;
        }
        // Smaller components are raised to this fraction of the largest, as in `Padding`.
        let slow = least.max(Vec3::splat(least.max_element() * PARALLEL));
        let fast = greatest.max(Vec3::splat(greatest.max_element() * PARALLEL));
        let (from, to) = (1.0 / fast, 1.0 / slow);
        let inverse = [Vec3::select(forwards, from, -to), Vec3::select(forwards, to, -from)];
        Some(Self { octant: backwards.bitmask() as usize, inverse })
    }
}
