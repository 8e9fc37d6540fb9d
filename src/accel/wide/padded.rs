//! Slab test of a ray against the eight boxes of a node, each slightly padded: one operation per plane.
//!
//! The distance to a plane is plane · (1/d) − o/d, whose error is relative to the coordinates and not to the distance:
//! [`BOX_PAD`](crate::math::bounds::BOX_PAD) allows for it. A ray meets the padded box of any prim that it hits, up to the
//! error of the hit's own distance, which `limit` allows for. Rays with numbers too large or too small ([`BOX_RANGE`]) use
//! `slabs`.
//!
//! Hits have distances of at least zero, and the exit from a box that holds a hit is later than the hit, if only by what
//! [`PARALLEL`] adds to the pad: at the start none of it is used up, and over a direction's component it is more than any
//! underflow, above 2⁻¹⁰³. So negative distances need no exact order, and distances are compared by their bits: an integer
//! maximum is faster than that of floats. A ray whose hits may lie behind its start uses `slabs`.

use bytemuck::{Pod, Zeroable};

use super::node::Node;
use super::slabs::BoxMargins;
use crate::math::bounds::{BOX_RANGE, PARALLEL};
use crate::math::simd::{LANES, Lanewise, Pick, Simd};

/// A ray prepared for tests against padded boxes.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PaddedSlabs {
    pub inverse: [f32; 3],
    /// Distance from which boxes are entered; not negative.
    pub from: f32,
    /// Summands for entry planes.
    pub first: [f32; 3],
    /// Distance up to which boxes are entered before any hit.
    pub limit: f32,
    /// Summands for exit planes.
    pub last: [f32; 3],
    /// Octant of the direction: bit k is set if the ray runs backwards along axis k.
    pub octant: u32,
}

/// Padded slabs of rays in lanes, by axis.
pub(super) struct Padding<L> {
    pub inverse: [L; 3],
    pub first: [L; 3],
    pub last: [L; 3],
    /// Bit mask of the rays for which the bounds hold.
    pub allowed: u32,
}

impl<L: Copy> Padding<L> {
    /// Computes the slabs of rays with these origins and directions, for boxes whose largest coordinate is `extent`.
    #[inline(always)]
    pub(super) fn of<B: BoxMargins, S: Lanewise<N, Lanes = L>, const N: usize>(
        s: S,
        extent: f32,
        o: [L; 3],
        d: [L; 3],
    ) -> Self {
        let (extent, zero) = (s.splat(extent), s.splat(0.0));
        let (far, size) = ([s.abs(o[0]), s.abs(o[1]), s.abs(o[2])], [s.abs(d[0]), s.abs(d[1]), s.abs(d[2])]);
        // A sum keeps a NaN.
        let whole = s.add(extent, s.add(s.add(far[0], far[1]), far[2]));
        let length = s.add(s.add(size[0], size[1]), size[2]);
        let (least, most) = (s.splat(1.0 / BOX_RANGE), s.splat(BOX_RANGE));
        let allowed =
            s.at_most(least, whole) & s.at_most(whole, most) & s.at_most(least, length) & s.at_most(length, most);
        let parallel = s.mul(s.greater(size[0], s.greater(size[1], size[2])), s.splat(PARALLEL));
        let drift = s.mul(whole, s.splat(PARALLEL));
        let (mut inverse, mut first, mut last) = ([zero; 3], [zero; 3], [zero; 3]);
        for k in 0..3 {
            inverse[k] = s.div(s.splat(1.0), s.with_sign(s.greater(size[k], parallel), d[k]));
            let pad = s.mul(s.add(s.mul(s.add(extent, far[k]), s.splat(B::PAD)), drift), s.abs(inverse[k]));
            let middle = s.mul(s.sub(zero, o[k]), inverse[k]);
            (first[k], last[k]) = (s.sub(middle, pad), s.add(middle, pad));
        }
        Self { inverse, first, last, allowed }
    }
}

/// Rows of the entry planes, by octant.
pub(super) static FIRST: [[Pick; 3]; LANES] = {
    let mut rows = [[Pick::new(0); 3]; LANES];
    let mut octant = 0;
    while octant < LANES {
        rows[octant] = [Pick::new(octant & 1), Pick::new(2 + (octant >> 1 & 1)), Pick::new(4 + (octant >> 2))];
        octant += 1;
    }
    rows
};

impl PaddedSlabs {
    /// Broadcasts the slabs to lanes, for many nodes.
    #[inline(always)]
    pub(super) fn spread<S: Simd>(&self, s: S) -> SlabLanes<S> {
        let [ix, iy, iz] = self.inverse;
        let ([fx, fy, fz], [lx, ly, lz]) = (self.first, self.last);
        SlabLanes {
            inverse: [s.splat(ix), s.splat(iy), s.splat(iz)],
            first: [s.splat(fx), s.splat(fy), s.splat(fz)],
            last: [s.splat(lx), s.splat(ly), s.splat(lz)],
            rows: FIRST[self.octant as usize % LANES],
            from: s.splat(self.from),
        }
    }

    /// Entry distances of the ray into the boxes of a node, and the mask of those it meets up to `limit`.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, s: S, node: &Node, limit: f32) -> (S::Lanes, u32) {
        self.spread(s).meets(s, node, limit)
    }
}

/// [`PaddedSlabs`] broadcast to lanes.
pub(super) struct SlabLanes<S: Simd> {
    inverse: [S::Lanes; 3],
    first: [S::Lanes; 3],
    last: [S::Lanes; 3],
    rows: [Pick; 3],
    from: S::Lanes,
}

impl<S: Simd> SlabLanes<S> {
    /// [`PaddedSlabs::meets`] for broadcast slabs.
    #[inline(always)]
    pub(super) fn meets(&self, s: S, node: &Node, limit: f32) -> (S::Lanes, u32) {
        let ([x, y, z], [ix, iy, iz]) = (self.rows, self.inverse);
        let first_x = s.mul_add(s.pick(&node.planes, x), ix, self.first[0]);
        let first_y = s.mul_add(s.pick(&node.planes, y), iy, self.first[1]);
        let first_z = s.mul_add(s.pick(&node.planes, z), iz, self.first[2]);
        let last_x = s.mul_add(s.pick(&node.planes, x.other()), ix, self.last[0]);
        let last_y = s.mul_add(s.pick(&node.planes, y.other()), iy, self.last[1]);
        let last_z = s.mul_add(s.pick(&node.planes, z.other()), iz, self.last[2]);
        // Where a plane is met at −0, the second operand stays: zero or later.
        let near = s.later(s.later(first_x, first_y), s.later(first_z, self.from));
        let far = s.sooner(s.sooner(last_x, last_y), s.sooner(last_z, s.splat(limit)));
        (near, s.in_order(near, far))
    }
}
