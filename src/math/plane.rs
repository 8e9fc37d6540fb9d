//! Ray against unbounded plane: t = (offset − n·o) / n·d, exact and rounded once.

use super::Vec3;
use super::bounds::{EXACT_QUOTIENT, POSITION_T, U64};
use super::expansion::Expansion;
use super::quotient::{Bounded, approximate, rounded};
use super::shear::RaySpace;

/// Distance at which the line through the ray meets the plane n·p = offset; `None` if it is parallel to the plane.
pub fn intersect(ray: &RaySpace, normal: Vec3, offset: f32) -> Option<f32> {
    if let Some(t) = quotient(ray, normal, offset).and_then(Bounded::nearest) {
        return Some(t);
    }
    let (numerator, denominator) = exact_terms(ray, normal, offset);
    (denominator.sign() != 0).then(|| rounded::<8, 200>(&numerator, &denominator))
}

/// Distance of [`intersect`] to a plane that is hit, with a relative error of [`POSITION_T`].
pub fn distance_f64(ray: &RaySpace, normal: Vec3, offset: f32) -> f64 {
    const { assert!(EXACT_QUOTIENT < POSITION_T) };
    match quotient(ray, normal, offset) {
        Some(t) if t.is_within(POSITION_T) => t.value,
        _ => {
            let (numerator, denominator) = exact_terms(ray, normal, offset);
            approximate(&numerator, &denominator)
        }
    }
}

/// Computes the quotient in `f64`. Products of two `f32` are exact; the sums add 3 and 2 roundings.
fn quotient(ray: &RaySpace, normal: Vec3, offset: f32) -> Option<Bounded> {
    let (n, o, d) = (normal.as_dvec3(), ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let numerator = f64::from(offset) - n.dot(o);
    let size = f64::from(offset).abs() + n.abs().dot(o.abs());
    let denominator = Bounded { value: n.dot(d), error: 3.0 * U64 * n.abs().dot(d.abs()) };
    Bounded { value: numerator, error: 4.0 * U64 * size }.over(denominator)
}

#[cold]
fn exact_terms(ray: &RaySpace, normal: Vec3, offset: f32) -> (Expansion<8>, Expansion<96>) {
    let (mut numerator, mut denominator) = (Expansion::<8>::ZERO, Expansion::<96>::ZERO);
    numerator.add(f64::from(offset));
    for k in 0..3 {
        numerator.add(-f64::from(normal[k]) * f64::from(ray.origin[k]));
        denominator.add(f64::from(normal[k]) * f64::from(ray.dir[k]));
    }
    (numerator, denominator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_hit_from_both_sides_and_not_along() {
        let hit = |d| RaySpace::new(Vec3::new(1.0, 3.0, 2.0), d).and_then(|r| intersect(&r, Vec3::Y, -1.0));
        assert_eq!(hit(Vec3::NEG_Y), Some(4.0));
        assert_eq!(hit(Vec3::Y), Some(-4.0));
        assert_eq!(hit(Vec3::X), None);
        assert_eq!(hit(Vec3::new(1.0, -0.0, 0.0)), None);
    }

    #[test]
    fn a_plane_through_the_origin_of_the_ray_is_hit_at_zero() {
        let ray = RaySpace::new(Vec3::splat(0.1), Vec3::new(0.3, -0.2, 0.7));
        assert_eq!(ray.and_then(|r| intersect(&r, Vec3::X, 0.1)), Some(0.0));
    }
}
