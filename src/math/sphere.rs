//! Ray against sphere, in the form that does not cancel, with running bounds of its errors; where `f64` cannot decide, the
//! same formula runs in double-length numbers.
//!
//! After E. Haines, J. Günther, T. Akenine-Möller, *Precision Improvements for Ray/Sphere Intersection*, Ray Tracing
//! Gems, 2019, chapter 7: the discriminant is r² − |f − (f·d) d|², from the point of the line nearest to the centre,
//! instead of the difference B² − C of two large squares; and the smaller root comes from the larger one.
//!
//! - A distance is within 2½ ulp (`f32`) of the exact one. Near the origin, below [`ROUND_ROOM`](super::bounds::ROUND_ROOM)
//!   of the radius, the error is absolute, and distances that cannot be told from 0 are 0: a ray that starts on the sphere
//!   hits it at 0.
//! - The verdict is exact unless the line passes the rim within 2⁻⁹⁰ of the distance from which the ray comes; there it
//!   counts as a hit.

use super::quotient::round;
use super::real::{Double, Real, Real3};
use super::shear::RaySpace;
use super::{DVec3, Vec3};

/// Largest relative error of an accepted distance from `f64`: at most 2 ulp of an `f32`.
const GOOD: f64 = 2.0 * super::bounds::U32 as f64;

/// Distances at which the line through the ray enters and leaves the sphere, smaller first, rounded once.
///
/// With `ahead`, spheres wholly behind the origin are rejected before any root: both distances would be negative. From
/// inside, the first distance is negative and the second one counts.
pub fn intersect(ray: &RaySpace, center: Vec3, radius: f32, ahead: bool) -> Option<[f32; 2]> {
    roots(ray, center, radius, ahead).map(|[near, far]| [round(near), round(far)])
}

/// [`intersect`], not rounded.
pub fn roots(ray: &RaySpace, center: Vec3, radius: f32, ahead: bool) -> Option<[f64; 2]> {
    let first = match solve::<f64>(ray, center, radius, ahead) {
        Found::Nothing => return None,
        Found::Roots(first) if first.iter().all(Root::is_good) => return Some(in_order(first.map(Root::decided))),
        Found::Roots(first) => Some(first),
        Found::Unsure => None,
    };
    // Each root is decided separately.
    let Found::Roots(second) = with_care(ray, center, radius) else { return None };
    let better = |i: usize| first.map(|first| first[i]).filter(Root::is_good).unwrap_or(second[i]);
    Some(in_order([better(0), better(1)].map(Root::decided)))
}

#[cold]
fn with_care(ray: &RaySpace, center: Vec3, radius: f32) -> Found {
    solve::<Double>(ray, center, radius, false)
}

fn in_order([a, b]: [f64; 2]) -> [f64; 2] {
    if a <= b { [a, b] } else { [b, a] }
}

/// A distance with a bound of its error.
#[derive(Clone, Copy, Debug)]
struct Root {
    t: f64,
    error: f64,
}

impl Root {
    fn is_good(&self) -> bool {
        self.error <= GOOD * self.t.abs()
    }

    /// Final distance: 0 if it cannot be told from 0.
    fn decided(self) -> f64 {
        if self.t.abs() <= self.error { 0.0 } else { self.t }
    }
}

/// Result for a line and a sphere.
enum Found {
    Nothing,
    Roots([Root; 2]),
    /// The line may be a tangent.
    Unsure,
}

/// Roots with running bounds of their errors. A bound counts roundings of [`Real::UNIT`] to first order and rounds the counts
/// up by half or more, which covers the rest and the rounding of the bounds. In double-length numbers nothing stays unsure: a
/// line that may touch the sphere touches it.
fn solve<R: Real>(ray: &RaySpace, center: Vec3, radius: f32, ahead: bool) -> Found {
    let (unit, last) = (R::UNIT, R::UNIT < f64::UNIT);
    let (d, r) = (Real3::<R>::of(ray.dir.as_dvec3()), R::of(f64::from(radius)));
    let f = Real3::<R>::difference(center, ray.origin);
    let (length2, f2, r2) = (d.dot(d), f.dot(f), r * r);
    let (b, c) = (f.dot(d), f2 - r2);
    let (speed, reach) = (length2.value().sqrt(), f2.value().sqrt());
    let error_b = 8.0 * unit * reach * speed;
    let error_c = 8.0 * unit * (f2.value() + r2.value());
    if ahead && c.value() > error_c && b.value() < -error_b {
        return Found::Nothing;
    }

    // From the line's point nearest to the centre, to the centre: the quotient errs by 8 u |f|/|d|, the rest by a few u |f|.
    let nearest = f.minus(d.times(b / length2));
    let past2 = nearest.dot(nearest);
    let discriminant = r2 - past2;
    let (past, error_past) = (past2.value().sqrt(), 32.0 * unit * reach);
    let error = (2.0 * past + error_past) * error_past + 8.0 * unit * (past2.value() + r2.value());
    if discriminant.value() < -error {
        return Found::Nothing;
    }
    if discriminant.value() <= 2.0 * error && !last {
        return Found::Unsure;
    }
    let half = if discriminant.value() > 0.0 { (length2 * discriminant).sqrt() } else { R::of(0.0) };
    let over = discriminant.value().max(0.0).sqrt();
    let error_half = speed * (error / over).min(error.sqrt()) + 8.0 * unit * half.value();

    let q = if b.value() < 0.0 { b - half } else { b + half };
    let error_q = error_b + error_half + 2.0 * unit * q.value().abs();
    let far = (q / length2).value();
    let far = Root { t: far, error: error_q / length2.value() + 16.0 * unit * far.abs() };
    // The line touches the sphere at the ray's origin, or nearly so.
    let size = q.value().abs();
    if size <= 2.0 * error_q {
        return Found::Roots([far; 2]);
    }
    let near = (c / q).value();
    let error = (error_c + near.abs() * error_q) / (size - error_q) + 4.0 * unit * near.abs();
    Found::Roots([Root { t: near, error }, far])
}

/// Point of the sphere nearest to `p`, relative to the centre; and the outward unit normal there.
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
    fn a_sphere_that_is_met_beside_the_start_is_met_there() {
        // c = |f|² − r² is 5·10⁻²⁵, of which nothing remains in numbers of 53 digits.
        let ray = RaySpace::new(Vec3::new(-1e-24, 0.0, 0.0), Vec3::X);
        let hit = ray.and_then(|r| intersect(&r, Vec3::new(0.25, 0.0, 0.0), 0.25, true));
        assert_eq!(hit, Some([1e-24, 0.5]));
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
