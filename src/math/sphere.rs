//! Ray against sphere, in `f64` and in the form that does not cancel.
//!
//! After E. Haines, J. Günther, T. Akenine-Möller, *Precision Improvements for Ray/Sphere Intersection*, Ray Tracing
//! Gems, 2019, chapter 7: the discriminant is r² − |f − (f·d) d|², from the point of the line nearest to the centre,
//! instead of the difference B² − C of two large squares; and the smaller root comes from the larger one.
//!
//! # Error
//! With the unit u of `f64`, f the way to the centre and r the radius, f − (f·d) d errs by 8 u |f|, so the discriminant
//! by e = 20 u r |f|, its root by the lesser of e/√disc and √e, and the rest by a few u |f|. Where t |d| ≥ r/4 this
//! is below 2⁻²² t even at a tangent: t is within 8 ulp of `f32`. Nearer to the origin the error is absolute:
//! 2⁻²³ r at a tangent, 2⁻³⁷ r where the line passes the centre at less than 0.9999995 r. The verdict errs only where
//! the line passes the rim at less than e.

use super::quotient::round;
use super::shear::RaySpace;
use super::{DVec3, Vec3};

/// The distances at which the line through the ray enters and leaves the sphere, smaller first, rounded once from `f64`.
///
/// With `ahead`, spheres that lie wholly behind the origin are rejected before any root: both distances would be
/// negative. From inside the first distance is negative: the far one counts.
pub fn intersect(ray: &RaySpace, center: Vec3, radius: f32, ahead: bool) -> Option<[f32; 2]> {
    roots(ray, center, radius, ahead).map(|[near, far]| [round(near), round(far)])
}

/// As [`intersect`], not rounded.
pub fn roots(ray: &RaySpace, center: Vec3, radius: f32, ahead: bool) -> Option<[f64; 2]> {
    let (d, r) = (ray.dir.as_dvec3(), f64::from(radius));
    let to_center = center.as_dvec3() - ray.origin.as_dvec3();
    let length2 = d.length_squared();
    let b = to_center.dot(d);
    let c = to_center.length_squared() - r * r;
    if ahead && c > 0.0 && b < 0.0 {
        return None;
    }

    let nearest = to_center - d * (b / length2);
    let discriminant = r * r - nearest.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let root = (length2 * discriminant).sqrt();
    let q = if b < 0.0 { b - root } else { b + root };
    if q == 0.0 {
        return Some([0.0, 0.0]);
    }
    let (first, second) = (c / q, q / length2);
    Some(if first <= second { [first, second] } else { [second, first] })
}

/// The point of the sphere nearest to `p`, relative to the centre; and the unit normal there, outwards.
pub fn project(p: DVec3, center: Vec3, radius: f32) -> (DVec3, DVec3) {
    let normal = (p - center.as_dvec3()).normalize_or(DVec3::Z);
    (normal * f64::from(radius), normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along_x(x: f32) -> Option<RaySpace> {
        RaySpace::new(Vec3::new(x, 0.0, 0.0), Vec3::X)
    }

    #[test]
    fn a_sphere_is_entered_and_left_where_it_should() {
        let hit = |x| along_x(x).and_then(|r| intersect(&r, Vec3::new(5.0, 0.0, 0.0), 2.0, true));
        assert_eq!(hit(0.0), Some([3.0, 7.0]));
        assert_eq!(hit(5.0), Some([-2.0, 2.0]), "from the centre only the far side lies ahead");
        assert_eq!(hit(3.0), Some([0.0, 4.0]), "from the surface");
        assert_eq!(hit(8.0), None, "behind");
    }

    #[test]
    fn a_tangent_touches_in_one_point() {
        let ray = RaySpace::new(Vec3::new(0.0, 2.0, 0.0), Vec3::X);
        assert_eq!(ray.and_then(|r| intersect(&r, Vec3::new(5.0, 0.0, 0.0), 2.0, true)), Some([5.0, 5.0]));
        let above = RaySpace::new(Vec3::new(0.0, 2.0f32.next_up(), 0.0), Vec3::X);
        assert_eq!(above.and_then(|r| intersect(&r, Vec3::new(5.0, 0.0, 0.0), 2.0, true)), None);
    }

    #[test]
    fn a_small_far_sphere_keeps_its_shape() {
        // B² − C would have lost all digits of the radius: 1e-3² against 1e5² is 1e-16.
        let ray = RaySpace::new(Vec3::new(0.0, 0.0006, 0.0), Vec3::X);
        let hit = ray.and_then(|r| roots(&r, Vec3::new(1e5, 0.0, 0.0), 1e-3, true));
        let depth = hit.map(|[near, far]| far - near).unwrap_or_default();
        let y = f64::from(0.0006f32);
        let r = f64::from(1e-3f32);
        assert!((depth - 2.0 * (r * r - y * y).sqrt()).abs() < 1e-10, "{depth}");
    }
}
