//! Axis-aligned boxes and the slab test.
//!
//! After T. Kay, J. Kajiya, *Ray Tracing Complex Scenes*, 1986. Which plane of a slab comes first follows from the sign
//! *bit* of the direction, so that −0 agrees with its reciprocal −∞; a ray in the plane of a face gives 0 · ∞ = NaN, which
//! constrains nothing: the ray counts as inside that slab.

use super::bounds::SLAB;
use super::{DVec3, Vec3};

/// A closed axis-aligned box; empty where `lo > hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub lo: Vec3,
    /// Largest corner.
    pub hi: Vec3,
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// Smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| b.union(Self { lo: p, hi: p }))
    }

    /// Smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Intersection of both; empty where they are disjoint.
    pub fn intersection(self, other: Self) -> Self {
        Self { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    /// The box enlarged by `by` on every side.
    pub fn padded(self, by: f32) -> Self {
        Self { lo: self.lo - by, hi: self.hi + by }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !self.lo.cmple(self.hi).all()
    }

    /// Part of t_min..=t_max inside the box, widened by the rounding of its own arithmetic so that it contains every point of
    /// the box on the ray. `inv_dir` is 1/dir in `f64`, where only the reciprocal of zero overflows for an `f32`.
    #[inline]
    pub fn span(&self, origin: Vec3, inv_dir: DVec3, t_min: f64, t_max: f64) -> Option<(f64, f64)> {
        self.span_within(origin, inv_dir, t_min, t_max, SLAB)
    }

    /// [`Self::span`] for a given relative error of a distance.
    #[inline]
    fn span_within(&self, origin: Vec3, inv_dir: DVec3, t_min: f64, t_max: f64, slab: f64) -> Option<(f64, f64)> {
        let (mut near, mut far) = (t_min, t_max);
        for k in 0..3 {
            let backwards = inv_dir[k].is_sign_negative();
            let (first, last) = if backwards { (self.hi[k], self.lo[k]) } else { (self.lo[k], self.hi[k]) };
            let enter = (f64::from(first) - f64::from(origin[k])) * inv_dir[k];
            let leave = (f64::from(last) - f64::from(origin[k])) * inv_dir[k];
            // `max` and `min` ignore a NaN operand.
            near = near.max((enter * (1.0 - slab)).min(enter * (1.0 + slab)));
            far = far.min((leave * (1.0 - slab)).max(leave * (1.0 + slab)));
        }
        (near <= far).then_some((near, far))
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    const UNIT: Aabb = Aabb { lo: Vec3::ZERO, hi: Vec3::ONE };

    fn hits(o: Vec3, d: Vec3) -> bool {
        UNIT.span(o, d.as_dvec3().recip(), 0.0, f64::INFINITY).is_some()
    }

    #[test]
    fn a_negative_zero_in_the_direction_changes_nothing() {
        for zero in [0.0, -0.0] {
            assert!(hits(Vec3::new(0.5, 0.5, -1.0), Vec3::new(zero, zero, 1.0)));
            assert!(!hits(Vec3::new(0.5, 1.5, -1.0), Vec3::new(zero, zero, 1.0)));
            assert!(!hits(Vec3::new(0.5, 0.5, -1.0), Vec3::new(zero, zero, -1.0)));
        }
    }

    #[test]
    fn a_ray_in_a_face_or_edge_counts_as_inside() {
        for zero in [0.0, -0.0] {
            for x in [0.0, 1.0] {
                for y in [0.0, 0.5, 1.0] {
                    let d = Vec3::new(zero, zero, 1.0);
                    assert!(hits(Vec3::new(x, y, -1.0), d), "x = {x}, y = {y}, zero = {zero}");
                    assert!(!hits(Vec3::new(x.next_up() + x * 1e-6, 2.0, -1.0), d));
                }
            }
        }
    }

    #[test]
    fn a_denormal_direction_still_finds_the_box() {
        assert!(hits(Vec3::new(-1e-40, 0.5, 0.5), Vec3::new(f32::from_bits(1), 0.0, 0.0)));
        assert!(!hits(Vec3::new(2.0, 0.5, 0.5), Vec3::new(f32::from_bits(1), 0.0, 0.0)));
    }

    /// Number of rays exactly through a corner of a box that the test reports as missing it.
    fn lost(slab: f64) -> usize {
        let mut random = Random::new(9);
        // Multiples of 2⁻¹²: their differences are exact, and so is the vector from an origin to a corner.
        let mut point = || (random.cube() * 4096.0).round() / 4096.0;
        let misses_a_corner = |_: &usize| {
            let (lo, size, origin) = (point(), point().abs(), point() * 4.0);
            let bounds = Aabb { lo, hi: lo + size };
            let corner = Vec3::new(bounds.hi.x, bounds.lo.y, bounds.hi.z);
            let inv_dir = (corner - origin).as_dvec3().recip();
            bounds.span_within(origin, inv_dir, 0.0, f64::INFINITY, slab).is_none()
        };
        (0..2000).filter(misses_a_corner).count()
    }

    #[test]
    fn a_ray_through_a_corner_meets_the_box_and_would_not_without_the_margin() {
        assert_eq!(lost(SLAB), 0);
        assert!(lost(0.0) > 0);
    }

    #[test]
    fn an_empty_box_is_never_hit() {
        assert!(Aabb::EMPTY.is_empty());
        assert!(Aabb::EMPTY.span(Vec3::ZERO, DVec3::ONE, 0.0, f64::INFINITY).is_none());
    }
}
