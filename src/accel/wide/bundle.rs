//! Sixteen rays by axis: what bounds them all, and which of them meet a box.

use std::marker::PhantomData;

use super::node::{Node, Tree};
use super::slabs::{BoxMargins, backwards};
use crate::accel::{NO_PRIM, Ray};
use crate::math::shear::main_axis;
use crate::math::simd::{LANES, Lanewise, Pick, Row, Simd, WIDE};
use crate::math::triangles::{RowBounds, reach};
use crate::math::{DVec3, Vec3};

/// Rays of a packet.
pub(super) const RAYS: usize = WIDE;

/// Every ray of a packet.
pub(super) const ALL: u32 = (1 << RAYS) - 1;

/// A number of each ray.
pub(super) type Numbers = [f32; RAYS];

/// The rays, by axis.
pub(super) struct Bundle<B> {
    pub origin: [Numbers; 3],
    pub dir: [Numbers; 3],
    pub inverse: [Numbers; 3],
    /// Where hits count, inclusive.
    pub t_min: Numbers,
    /// Where boxes matter.
    pub from: Numbers,
    pub limit: Numbers,
    pub exclude: [u32; RAYS],
    /// The origins between which the others lie, by axis: the one first met by a box's first plane, and the other.
    pub origins: [[f32; 2]; 3],
    /// Least and greatest reciprocal.
    pub inverses: [[f32; 2]; 3],
    pub first: [Pick; 3],
    pub last: [Pick; 3],
    pub octant: usize,
    /// Axis of the largest component of every direction.
    pub z: usize,
    pub least_from: f32,
    pub reach: f32,
    /// The origin, where all rays have the same.
    pub common: Option<Vec3>,
    pub bounds: RowBounds,
    margins: PhantomData<B>,
}

/// Puts eight numbers to the first or the last of sixteen.
#[inline(always)]
fn put_half(to: &mut Numbers, half: usize, row: Row) {
    to.as_chunks_mut().0[half % 2] = row;
}

impl<B: BoxMargins> Bundle<B> {
    pub(super) fn empty() -> Self {
        let none = [0.0; RAYS];
        Self {
            origin: [none; 3],
            dir: [none; 3],
            inverse: [none; 3],
            t_min: none,
            from: none,
            limit: none,
            exclude: [NO_PRIM; RAYS],
            origins: [[0.0; 2]; 3],
            inverses: [[0.0; 2]; 3],
            first: [Pick::new(0); 3],
            last: [Pick::new(0); 3],
            octant: 0,
            z: 0,
            least_from: 0.0,
            reach: 0.0,
            common: None,
            bounds: RowBounds::NONE,
            margins: PhantomData,
        }
    }

    /// Takes sixteen rays; how far each of them looks.
    #[inline(always)]
    pub(super) fn spread<S: Simd>(&mut self, s: S, rays: &[Ray; RAYS]) -> Numbers {
        (self.z, self.octant) = (main_axis(rays[0].dir), octant_of(rays[0].dir));
        let mut t_max = [0.0; RAYS];
        for half in 0..2 {
            let (mut from, mut to) = ([[0.0; 4]; LANES], [[0.0; 4]; LANES]);
            for lane in 0..LANES {
                let ray = &rays[LANES * half + lane];
                let (o, d) = (ray.origin, ray.dir);
                from[lane] = [o.x, o.y, o.z, ray.t_min];
                to[lane] = [d.x, d.y, d.z, ray.t_max];
                self.exclude[LANES * half + lane] = ray.exclude;
            }
            let ([ox, oy, oz, least], [dx, dy, dz, most]) = (s.columns(&from), s.columns(&to));
            put_half(&mut self.origin[0], half, s.store(ox));
            put_half(&mut self.origin[1], half, s.store(oy));
            put_half(&mut self.origin[2], half, s.store(oz));
            put_half(&mut self.dir[0], half, s.store(dx));
            put_half(&mut self.dir[1], half, s.store(dy));
            put_half(&mut self.dir[2], half, s.store(dz));
            put_half(&mut self.t_min, half, s.store(least));
            // A distance that overflows is no hit.
            put_half(&mut t_max, half, s.store(s.smaller(most, s.splat(f32::MAX))));
        }
        t_max
    }

    /// Finds reciprocals and ranges from directions, `t_min` and `t_max`, and whether the rays run alike: to the same
    /// octant, no component zero, the same one the largest.
    #[inline(always)]
    pub(super) fn prepare<S: Simd>(&mut self, s: S, t_max: &Numbers) -> bool {
        self.limit = Self::widened(s, t_max);
        let s = s.wide();
        let (t_min, t_max) = (s.load(&self.t_min), s.load(t_max));
        let o = [s.load(&self.origin[0]), s.load(&self.origin[1]), s.load(&self.origin[2])];
        let d = [s.load(&self.dir[0]), s.load(&self.dir[1]), s.load(&self.dir[2])];
        // Sums of sizes keep a NaN. Where they are small enough, so is each of them.
        let size = s.add(s.add(s.abs(o[0]), s.abs(o[1])), s.abs(o[2]));
        let mut alike = s.at_most(t_min, t_max) & s.at_most(size, s.splat(B::COORDINATES));
        let zero = s.splat(0.0);
        let mut inverses = zero;
        for (k, &along) in d.iter().enumerate() {
            // Neither holds for a zero or a NaN.
            alike &= if self.octant >> k & 1 == 1 { s.less(along, zero) } else { s.less(zero, along) };
            let inverse = s.div(s.splat(1.0), along);
            inverses = s.add(inverses, s.abs(inverse));
            self.inverse[k] = s.store(inverse);
        }
        let [x, y, z] = [s.abs(d[0]), s.abs(d[1]), s.abs(d[2])];
        // Then no reciprocal is below the normal numbers.
        let largest = s.splat(0.5 / f32::MIN_POSITIVE);
        alike &= s.at_most(inverses, s.splat(f32::MAX)) & s.at_most(s.add(s.add(x, y), z), largest);
        alike &= match self.z {
            0 => s.at_most(y, x) & s.at_most(z, x),
            1 => !(s.at_most(y, x) & s.at_most(z, x)) & s.at_most(z, y),
            _ => !(s.at_most(y, x) & s.at_most(z, x)) & s.less(y, z),
        };
        let (range, underflow) = (s.splat(B::RANGE), s.splat(B::UNDERFLOW));
        let from = s.sub(s.sub(t_min, s.mul(s.abs(t_min), range)), underflow);
        // Not so for a ray that goes on behind nothing: a NaN would hide where the others start.
        alike &= s.at_most(s.abs(from), s.splat(f32::MAX));
        self.from = s.store(from);
        alike & ALL == ALL
    }

    /// The distance up to which boxes must be entered for hits up to each of these.
    #[inline(always)]
    pub(super) fn widened<S: Simd>(s: S, t: &Numbers) -> Numbers {
        let s = s.wide();
        let t = s.load(t);
        s.store(s.add(s.add(t, s.mul(s.abs(t), s.splat(B::RANGE))), s.splat(B::UNDERFLOW)))
    }

    /// Which rays meet a box; by axis, its plane that comes first and the one that comes last.
    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, s: S, first: [f32; 3], last: [f32; 3]) -> u32 {
        let s = s.wide();
        let (mut near, mut far) = (s.load(&self.from), s.load(&self.limit));
        for k in 0..3 {
            let (origin, inverse) = (s.load(&self.origin[k]), s.load(&self.inverse[k]));
            near = s.greater(s.mul(s.sub(s.splat(first[k]), origin), inverse), near);
            far = s.smaller(s.mul(s.sub(s.splat(last[k]), origin), inverse), far);
        }
        let slack = s.add(s.mul(s.abs(far), s.splat(B::SLAB)), s.splat(B::UNDERFLOW));
        s.at_most(near, s.add(far, slack))
    }

    /// Finds what bounds all rays.
    #[inline(always)]
    pub(super) fn bound<S: Simd>(&mut self, s: S, tree: &Tree) {
        let s = s.wide();
        let back = |k: usize| self.octant >> k & 1;
        (self.first, self.last) = (
            [Pick::new(back(0)), Pick::new(2 + back(1)), Pick::new(4 + back(2))],
            [Pick::new(1 - back(0)), Pick::new(3 - back(1)), Pick::new(5 - back(2))],
        );
        let (o, first) =
            ([0, 1, 2].map(|k| self.origin[k]), Vec3::new(self.origin[0][0], self.origin[1][0], self.origin[2][0]));
        let is = |k: usize| s.at_most(s.load(&o[k]), s.splat(first[k])) & s.at_most(s.splat(first[k]), s.load(&o[k]));
        self.common = (is(0) & is(1) & is(2) & ALL == ALL).then_some(first);
        let (mut low, mut high) = (first, first);
        if self.common.is_none() {
            for k in 0..3 {
                let origin = s.load(&self.origin[k]);
                (low[k], high[k]) = (s.least(origin), s.greatest(origin));
            }
        }
        self.reach = reach(low, &tree.bounds);
        if self.common.is_none() {
            // Each coordinate is farthest from one of both.
            self.reach = self.reach.max(reach(high, &tree.bounds));
        }
        let mut steepest = DVec3::ZERO;
        for k in 0..3 {
            let inverse = s.load(&self.inverse[k]);
            let (least, greatest) = (s.least(inverse), s.greatest(inverse));
            self.inverses[k] = [least, greatest];
            (self.origins[k], steepest[k]) = if back(k) == 1 {
                ([low[k], high[k]], f64::from(-greatest))
            } else {
                ([high[k], low[k]], f64::from(least))
            };
        }
        // A reciprocal is rounded once, and so is this.
        let dir = DVec3::splat(1.0 + f64::from(f32::EPSILON)) / steepest;
        self.bounds =
            RowBounds { low: low.as_dvec3(), high: high.as_dvec3(), from: self.common.map(Vec3::as_dvec3), dir };
        self.least_from = s.least(s.load(&self.from));
    }

    /// The distance beyond which no ray looks for hits.
    #[inline(always)]
    pub(super) fn farthest<S: Simd>(&self, s: S) -> f32 {
        s.wide().greatest(s.wide().load(&self.limit))
    }

    /// Which of eight boxes any ray may meet up to `limit`, and the least distances of that.
    #[inline(always)]
    pub(super) fn meets_any<S: Simd>(
        &self,
        s: S,
        first: [S::Lanes; 3],
        last: [S::Lanes; 3],
        limit: f32,
    ) -> (S::Lanes, u32) {
        let (mut near, mut far) = (s.splat(self.least_from), s.splat(limit));
        for k in 0..3 {
            let (low, high) = (s.splat(self.inverses[k][0]), s.splat(self.inverses[k][1]));
            let first = s.sub(first[k], s.splat(self.origins[k][0]));
            let last = s.sub(last[k], s.splat(self.origins[k][1]));
            near = s.greater(s.smaller(s.mul(first, low), s.mul(first, high)), near);
            far = s.smaller(s.greater(s.mul(last, low), s.mul(last, high)), far);
        }
        let slack = s.add(s.mul(s.abs(far), s.splat(B::SLAB)), s.splat(B::UNDERFLOW));
        (near, s.at_most(near, s.add(far, slack)))
    }

    /// Which rays meet the box of a child.
    #[inline(always)]
    pub(super) fn meet_child<S: Simd>(&self, s: S, node: &Node, slot: usize) -> u32 {
        let back = |k: usize| self.octant >> k & 1;
        let plane = |k: usize, side: usize| node.planes[(2 * k + side) % 6][slot % LANES];
        let first = [plane(0, back(0)), plane(1, back(1)), plane(2, back(2))];
        let last = [plane(0, 1 - back(0)), plane(1, 1 - back(1)), plane(2, 1 - back(2))];
        self.meet(s, first, last)
    }
}

#[inline(always)]
fn octant_of(dir: Vec3) -> usize {
    backwards(dir.x) | backwards(dir.y) << 1 | backwards(dir.z) << 2
}
