//! Rays of a packet by axis: their common bounds, and tests against boxes.

use std::marker::PhantomData;

use super::interval_ray::IntervalRay;
use super::node::{Block, Node, Tree};
use super::padded::Padding;
use super::prepared::Columns;
use super::slabs::{BoxMargins, backwards};
use crate::accel::{NO_PRIM, Ray};
use crate::math::Vec3;
use crate::math::meetings::RowBounds;
use crate::math::shear::main_axis;
use crate::math::simd::{LANES, Lanewise, Row, Simd};

/// Bit mask of all rays of a packet of `N`.
pub(super) const fn all<const N: usize>() -> u32 {
    u32::MAX >> (u32::BITS as usize - N)
}

/// Rays of a packet, by axis, prepared for padded slabs (`padded`). Rows are aligned to whole cache lines: accesses across
/// two lines take twice as long.
#[repr(C, align(64))]
pub(super) struct PacketRays<B, const N: usize> {
    pub origin: [[f32; N]; 3],
    pub dir: [[f32; N]; 3],
    inverse: [[f32; N]; 3],
    /// Summands for entry planes, and for exit planes.
    first: [[f32; N]; 3],
    last: [[f32; N]; 3],
    /// Smallest t of a hit, inclusive.
    pub t_min: [f32; N],
    /// Distances from which boxes are entered; not negative.
    from: [f32; N],
    pub exclude: [u32; N],
    /// Bounds of all rays.
    interval: IntervalRay,
    /// Bit k is set if the rays run backwards along axis k.
    pub octant: usize,
    /// Axis of the largest component of every direction.
    pub z: usize,
    /// Common origin of the rays, if they share one.
    pub common: Option<Vec3>,
    /// Bounds of all origins.
    low: Vec3,
    high: Vec3,
    margins: PhantomData<B>,
}

impl<B: BoxMargins, const N: usize> PacketRays<B, N> {
    pub(super) fn empty() -> Self {
        let none = [0.0; N];
        Self {
            origin: [none; 3],
            dir: [none; 3],
            inverse: [none; 3],
            first: [none; 3],
            last: [none; 3],
            t_min: none,
            from: none,
            exclude: [NO_PRIM; N],
            interval: IntervalRay::default(),
            octant: 0,
            z: 0,
            common: None,
            low: Vec3::ZERO,
            high: Vec3::ZERO,
            margins: PhantomData,
        }
    }

    /// Loads the rays, and returns the ends of their ranges.
    #[inline(always)]
    pub(super) fn spread<S: Simd, T: Lanewise<N>>(&mut self, s: S, lanes: T, rays: &[Ray; N]) -> [f32; N] {
        (self.z, self.octant, self.common) = (main_axis(rays[0].dir), octant_of(rays[0].dir), None);
        let mut t_max = [0.0; N];
        for (k, eight) in rays.as_chunks::<LANES>().0.iter().enumerate() {
            let columns = Columns::of(s, eight);
            for axis in 0..3 {
                self.origin[axis].as_chunks_mut().0[k] = s.store(columns.origin[axis]);
                self.dir[axis].as_chunks_mut().0[k] = s.store(columns.dir[axis]);
            }
            self.t_min.as_chunks_mut().0[k] = s.store(columns.t_min);
            t_max.as_chunks_mut().0[k] = s.store(columns.t_max);
        }
        for (exclude, ray) in self.exclude.iter_mut().zip(rays) {
            *exclude = ray.exclude;
        }
        // An overflowing distance is no hit; a NaN stays NaN.
        lanes.store(lanes.smaller(lanes.splat(f32::MAX), lanes.load(&t_max)))
    }

    /// Gives all rays from now on this origin and unbounded ranges.
    pub(super) fn start_at(&mut self, origin: Vec3) {
        self.origin = [[origin.x; N], [origin.y; N], [origin.z; N]];
        (self.t_min, self.exclude, self.common) = ([0.0; N], [NO_PRIM; N], Some(origin));
    }

    /// Loads rays of a pencil by their directions, from `start` on; returns whether there are enough.
    #[inline(always)]
    pub(super) fn turn(&mut self, dirs: [&[f32]; 3], start: usize) -> bool {
        let row = |k: usize| dirs[k].get(start..).and_then(<[f32]>::first_chunk);
        let (Some(x), Some(y), Some(z)) = (row(0), row(1), row(2)) else { return false };
        self.dir = [*x, *y, *z];
        let first = Vec3::new(x[0], y[0], z[0]);
        (self.z, self.octant) = (main_axis(first), octant_of(first));
        true
    }

    /// Computes slabs and ranges, and returns a mask of the rays that run like the first one: with the same octant and main
    /// axis, with numbers for which the bounds of padded boxes hold, and with a range that is not empty
    /// and does not begin behind the origin.
    #[inline(always)]
    pub(super) fn prepare<T: Lanewise<N>>(&mut self, s: T, tree: &Tree, t_max: &[f32; N]) -> u32 {
        let (t_min, t_max, zero) = (s.load(&self.t_min), s.load(t_max), s.splat(0.0));
        let o = [s.load(&self.origin[0]), s.load(&self.origin[1]), s.load(&self.origin[2])];
        let d = [s.load(&self.dir[0]), s.load(&self.dir[1]), s.load(&self.dir[2])];
        let Padding { inverse, first, last, allowed } = Padding::of::<B, _, N>(s, tree.extent, o, d);
        let [x, y, z] = [s.abs(d[0]), s.abs(d[1]), s.abs(d[2])];
        let mut alike = allowed & s.at_most(t_min, t_max) & s.at_most(zero, t_min);
        alike &= match self.z {
            0 => s.at_most(y, x) & s.at_most(z, x),
            1 => !(s.at_most(y, x) & s.at_most(z, x)) & s.at_most(z, y),
            _ => !(s.at_most(y, x) & s.at_most(z, x)) & s.less(y, z),
        };
        for k in 0..3 {
            alike &= if self.octant >> k & 1 == 1 { s.signs(d[k]) } else { !s.signs(d[k]) };
            self.inverse[k] = s.store(inverse[k]);
            self.first[k] = s.store(first[k]);
            self.last[k] = s.store(last[k]);
        }
        self.from = s.store(s.greater(B::started_lanes(s, t_min), zero));
        alike & all::<N>()
    }

    /// Replaces each ray that diverges by one that runs alike, so that it does not affect the bounds.
    #[inline(always)]
    pub(super) fn fill<T: Lanewise<N>>(&mut self, s: T, alike: u32, t_max: &mut [f32; N]) {
        let lane = alike.trailing_zeros() as usize % N;
        let rows = [&mut self.origin, &mut self.dir, &mut self.inverse, &mut self.first, &mut self.last];
        for row in rows.into_iter().flatten().chain([&mut self.t_min, &mut self.from, t_max]) {
            *row = s.store(s.choose(alike, s.load(row), s.splat(row[lane])));
        }
    }

    /// Bit mask of the rays that meet a box up to their limits; `first` and `last` are its entry and exit planes by axis.
    #[inline(always)]
    pub(super) fn meet<T: Lanewise<N>>(&self, s: T, first: [f32; 3], last: [f32; 3], limit: T::Lanes) -> u32 {
        let (mut near, mut far) = (s.load(&self.from), limit);
        for k in 0..3 {
            let inverse = s.load(&self.inverse[k]);
            near = s.later(s.mul_add(s.splat(first[k]), inverse, s.load(&self.first[k])), near);
            far = s.sooner(s.mul_add(s.splat(last[k]), inverse, s.load(&self.last[k])), far);
        }
        s.in_order(near, far)
    }

    /// Reciprocal of the largest component of each direction.
    #[inline(always)]
    pub(super) fn per_length(&self) -> &[f32; N] {
        &self.inverse[self.z % 3]
    }

    /// Computes the bounds of all rays.
    #[inline(always)]
    pub(super) fn bound<T: Lanewise<N>>(&mut self, s: T, tree: &Tree) {
        match self.common {
            Some(origin) => (self.low, self.high) = (origin, origin),
            None => self.bound_origins(s),
        }
        let zero = s.splat(0.0);
        let inverse = [s.load(&self.inverse[0]), s.load(&self.inverse[1]), s.load(&self.inverse[2])];
        let [x, y, z, from] = s.least_of_each([inverse[0], inverse[1], inverse[2], s.load(&self.from)]);
        let least = [x, y, z];
        let [x, y, z, _] =
            s.least_of_each([s.sub(zero, inverse[0]), s.sub(zero, inverse[1]), s.sub(zero, inverse[2]), zero]);
        let greatest = [-x, -y, -z];
        let origins = [self.low, self.high];
        self.interval = IntervalRay::new::<B>(tree, self.octant, [least.into(), greatest.into()], origins, from);
    }

    /// Computes the bounds of all origins.
    #[inline(always)]
    fn bound_origins<T: Lanewise<N>>(&mut self, s: T) {
        let first = Vec3::new(self.origin[0][0], self.origin[1][0], self.origin[2][0]);
        let o = [s.load(&self.origin[0]), s.load(&self.origin[1]), s.load(&self.origin[2])];
        let mut alike = all::<N>();
        for k in 0..3 {
            alike &= s.at_most(o[k], s.splat(first[k])) & s.at_most(s.splat(first[k]), o[k]);
        }
        self.common = (alike == all::<N>()).then_some(first);
        (self.low, self.high) = (first, first);
        if self.common.is_none() {
            let zero = s.splat(0.0);
            let [x, y, z, _] = s.least_of_each([o[0], o[1], o[2], zero]);
            self.low = Vec3::new(x, y, z);
            let [x, y, z, _] = s.least_of_each([s.sub(zero, o[0]), s.sub(zero, o[1]), s.sub(zero, o[2]), zero]);
            self.high = Vec3::new(-x, -y, -z);
        }
    }

    /// Bounds of origins and directions, for exact distances.
    #[inline(always)]
    pub(super) fn row_bounds(&self) -> RowBounds {
        // A reciprocal is rounded once.
        let slowest = self.interval.fastest(self.z);
        RowBounds {
            low: self.low.as_dvec3(),
            high: self.high.as_dvec3(),
            from: self.common.map(Vec3::as_dvec3),
            dir: (1.0 + f64::from(f32::EPSILON)) / f64::from(slowest),
        }
    }

    /// Least entry distances of eight boxes, and the mask of those that any ray may meet up to `limit`; planes in the order
    /// of a node's.
    #[inline(always)]
    pub(super) fn meets_any<S: Simd>(&self, s: S, planes: &[Row; 6], limit: f32) -> (S::Lanes, u32) {
        self.interval.meets(s, planes, self.octant, limit)
    }

    /// Bit mask of the triangles of a block whose own boxes any ray may meet.
    #[inline(always)]
    pub(super) fn meets_any_triangle<S: Simd>(&self, s: S, block: &Block, limit: f32) -> u32 {
        let [a, b, c] = &block.corners;
        let zero = s.splat(0.0);
        let (mut first, mut last) = ([zero; 3], [zero; 3]);
        for k in 0..3 {
            let (a, b, c) = (s.load(&a[k]), s.load(&b[k]), s.load(&c[k]));
            let (low, high) = (s.smaller(a, s.smaller(b, c)), s.greater(a, s.greater(b, c)));
            (first[k], last[k]) = if self.octant >> k & 1 == 1 { (high, low) } else { (low, high) };
        }
        self.interval.between(s, first, last, limit).1
    }

    /// Bit mask of the rays that meet the box of a child up to their limits.
    #[inline(always)]
    pub(super) fn meet_child<T: Lanewise<N>>(&self, s: T, node: &Node, slot: usize, limit: T::Lanes) -> u32 {
        let back = |k: usize| self.octant >> k & 1;
        let plane = |k: usize, side: usize| node.planes[(2 * k + side) % 6][slot % LANES];
        let first = [plane(0, back(0)), plane(1, back(1)), plane(2, back(2))];
        let last = [plane(0, 1 - back(0)), plane(1, 1 - back(1)), plane(2, 1 - back(2))];
        self.meet(s, first, last, limit)
    }
}

#[inline(always)]
fn octant_of(dir: Vec3) -> usize {
    backwards(dir.x) | backwards(dir.y) << 1 | backwards(dir.z) << 2
}
