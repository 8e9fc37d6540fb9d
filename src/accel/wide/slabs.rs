//! Slab test of a ray against the eight boxes of a node.
//!
//! # Why no hit is lost
//! A prim lies in the boxes above it, exactly: they are made of its own `f32` coordinates. The distances to a box's planes
//! err by at most [`SLAB_F32`], relative, and [`BOX_UNDERFLOW`], so a box is entered whenever the exact ray meets it within
//! its range, widened by [`BOX_MARGIN`]. Boxes are tested only where that holds: a direction component whose reciprocal is
//! not a normal number constrains nothing on its axis, and with coordinates beyond [`BOX_COORDINATES`] every prim is tested.

use std::marker::PhantomData;

use super::node::{Node, Tree};
use crate::math::Vec3;
use crate::math::bounds::{BOX_COORDINATES, BOX_MARGIN, BOX_PAD, BOX_UNDERFLOW, SLAB_F32};
use crate::math::simd::{Lanewise, Pick, Simd};

/// Safety margins of a walk.
pub(in crate::accel) trait BoxMargins {
    /// Relative error of a distance to a plane.
    const SLAB: f32 = SLAB_F32;
    /// Relative amount by which the ray's range is widened for boxes.
    const RANGE: f32 = BOX_MARGIN;
    /// Absolute addition to both for underflow.
    const UNDERFLOW: f32 = BOX_UNDERFLOW;
    /// Relative padding of boxes in [`PaddedSlabs`](super::padded::PaddedSlabs).
    const PAD: f32 = BOX_PAD;
    /// Largest coordinate with which boxes are tested.
    const COORDINATES: f32 = BOX_COORDINATES;
    /// Whether walks are compiled for every instruction set, or for vectors alone
    /// ([`Level::run_vectors`](crate::math::simd::Level::run_vectors)).
    const EVERY_LEVEL: bool = false;

    /// Whether boxes can be tested against a ray from this origin; not if it is not finite.
    #[inline(always)]
    fn allow(tree: &Tree, origin: Vec3) -> bool {
        let inside = |x: f32| x.abs() <= Self::COORDINATES;
        inside(origin.x) & inside(origin.y) & inside(origin.z) & (tree.extent <= Self::COORDINATES)
    }

    /// Distance up to which boxes must be entered for hits up to `reach`.
    #[inline(always)]
    fn widened(reach: f32) -> f32 {
        reach + reach.abs() * Self::RANGE + Self::UNDERFLOW
    }

    /// Distance from which boxes must be entered for hits from `t_min` on.
    #[inline(always)]
    fn started(t_min: f32) -> f32 {
        t_min - t_min.abs() * Self::RANGE - Self::UNDERFLOW
    }

    /// [`Self::widened`] in lanes.
    #[inline(always)]
    fn widened_lanes<S: Lanewise<N>, const N: usize>(s: S, reach: S::Lanes) -> S::Lanes {
        s.add(s.add(reach, s.mul(s.abs(reach), s.splat(Self::RANGE))), s.splat(Self::UNDERFLOW))
    }

    /// [`Self::started`] in lanes.
    #[inline(always)]
    fn started_lanes<S: Lanewise<N>, const N: usize>(s: S, t_min: S::Lanes) -> S::Lanes {
        s.sub(s.sub(t_min, s.mul(s.abs(t_min), s.splat(Self::RANGE))), s.splat(Self::UNDERFLOW))
    }
}

/// Margins derived in `math::bounds`.
pub(in crate::accel) struct Derived;

impl BoxMargins for Derived {
    const EVERY_LEVEL: bool = true;
}

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs<B> {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// Rows of the entry planes on each axis, and of the exit planes.
    first: [Pick; 3],
    last: [Pick; 3],
    from: f32,
    margins: PhantomData<B>,
}

impl<B: BoxMargins> Slabs<B> {
    #[inline(always)]
    pub(super) fn new(origin: Vec3, dir: Vec3, t_min: f32) -> Self {
        let (x, y, z) = (backwards(dir.x), backwards(dir.y), backwards(dir.z));
        Self {
            origin: [origin.x, origin.y, origin.z],
            inverse: [reciprocal(dir.x), reciprocal(dir.y), reciprocal(dir.z)],
            first: [Pick::new(x), Pick::new(2 + y), Pick::new(4 + z)],
            last: [Pick::new(1 - x), Pick::new(3 - y), Pick::new(5 - z)],
            from: B::started(t_min),
            margins: PhantomData,
        }
    }

    /// Entry distances of the ray into the boxes of a node, and the mask of those it meets up to `limit`.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, s: S, node: &Node, limit: f32) -> (S::Lanes, u32) {
        let (mut near, mut far) = (s.splat(self.from), s.splat(limit));
        for k in 0..3 {
            let (origin, inverse) = (s.splat(self.origin[k]), s.splat(self.inverse[k]));
            // If the first operand is NaN, the second is kept.
            near = s.greater(s.mul(s.sub(s.pick(&node.planes, self.first[k]), origin), inverse), near);
            far = s.smaller(s.mul(s.sub(s.pick(&node.planes, self.last[k]), origin), inverse), far);
        }
        let slack = s.add(s.mul(s.abs(far), s.splat(B::SLAB)), s.splat(B::UNDERFLOW));
        (near, s.at_most(near, s.add(far, slack)))
    }
}

/// 1 / d where it constrains anything, else NaN, which drops out of every comparison.
#[inline(always)]
fn reciprocal(d: f32) -> f32 {
    let inverse = 1.0 / d;
    if inverse.is_normal() || d == 0.0 { inverse } else { f32::NAN }
}

/// 1 if the ray runs backwards, so that the upper plane is the entry plane.
#[inline(always)]
pub(super) fn backwards(d: f32) -> usize {
    usize::from(d.is_sign_negative())
}
