//! Axis-aligned boxes and the slab test.
//!
//! After T. Kay, J. Kajiya, *Ray Tracing Complex Scenes*, 1986. Which plane of a slab comes first follows from the sign
//! *bit* of the direction, so that −0 agrees with its reciprocal −∞; a ray in the plane of a face gives 0 · ∞ = NaN, which
//! constrains nothing: the ray counts as inside that slab.

use super::bounds::SLAB;
use super::{DVec3, Vec3};

/// A closed box; empty where `lo > hi`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub lo: Vec3,
    /// Largest corner.
    pub hi: Vec3,
}

impl Aabb {
    /// Nothing.
    pub const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| b.union(Self { lo: p, hi: p }))
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Whether it holds no point.
    pub fn is_empty(&self) -> bool {
        !self.lo.cmple(self.hi).all()
    }

    /// The part of t_min..=t_max inside the box, widened by the rounding of its own arithmetic so that it holds every
    /// point of the box on the ray. `inv_dir` is 1/dir in `f64`, where the reciprocal of no `f32` overflows but zero's.
    pub fn span(&self, origin: Vec3, inv_dir: DVec3, t_min: f32, t_max: f32) -> Option<(f64, f64)> {
        let (mut near, mut far) = (f64::from(t_min), f64::from(t_max));
        for k in 0..3 {
            let backwards = inv_dir[k].is_sign_negative();
            let (first, last) = if backwards { (self.hi[k], self.lo[k]) } else { (self.lo[k], self.hi[k]) };
            let enter = (f64::from(first) - f64::from(origin[k])) * inv_dir[k];
            let leave = (f64::from(last) - f64::from(origin[k])) * inv_dir[k];
            // `max` and `min` drop a NaN operand.
            near = near.max((enter * (1.0 - SLAB)).min(enter * (1.0 + SLAB)));
            far = far.min((leave * (1.0 - SLAB)).max(leave * (1.0 + SLAB)));
        }
        (near <= far).then_some((near, far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Aabb = Aabb { lo: Vec3::ZERO, hi: Vec3::ONE };

    fn hits(o: Vec3, d: Vec3) -> bool {
        UNIT.span(o, d.as_dvec3().recip(), 0.0, f32::INFINITY).is_some()
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

    #[test]
    fn an_empty_box_is_never_hit() {
        assert!(Aabb::EMPTY.is_empty());
        assert!(Aabb::EMPTY.span(Vec3::ZERO, DVec3::ONE, 0.0, f32::INFINITY).is_none());
    }
}
