//! Watertight ray/triangle test with exact verdicts.
//!
//! In sheared ray space (see [`shear`](super::shear)) a triangle is hit if its three edge values are all ≥ 0 or all ≤ 0 (an
//! edge or corner belongs to every triangle it bounds) and not all zero. The sign of an edge value is taken from `f32` if it
//! exceeds its proven error, else from `f64`, else from exact sums. For a ray in the triangle's plane and a triangle without
//! area, the edge values are all zero or have two signs: they are never hit, and no NaN arises.

use super::bounds::{EXACT_QUOTIENT, EdgeMargins, PLANE_TERMS_F64, POSITION_T};
use super::expansion::{Expansion, cross, difference, dot, dot_f32};
use super::quotient::{Bounded, approximate, rounded};
use super::shear::RaySpace;
use super::{DVec3, Vec3};

/// Triangle by its three corners.
pub type Triangle = [Vec3; 3];

/// Distance at which the line through the ray hits the triangle, exact and rounded once; negative behind the origin. `None`
/// for a miss, exactly.
#[inline]
pub fn intersect(ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
    is_hit(ray, triangle).then(|| distance(ray, triangle))
}

/// Whether the line through the ray hits the triangle: the exact verdict.
#[inline]
pub fn is_hit(ray: &RaySpace, triangle: &Triangle) -> bool {
    match ray.z {
        0 => is_hit_along::<0>(ray, triangle),
        1 => is_hit_along::<1>(ray, triangle),
        _ => is_hit_along::<2>(ray, triangle),
    }
}

/// [`is_hit`] for a ray whose largest component is along axis `Z`: coordinates are then selected without indexing.
#[inline]
fn is_hit_along<const Z: usize>(ray: &RaySpace, triangle: &Triangle) -> bool {
    let [a, b, c] = [triangle[0] - ray.origin, triangle[1] - ray.origin, triangle[2] - ray.origin];
    let shear = |p: Vec3| {
        let (x, y, z) = match Z {
            0 => (p.y, p.z, p.x),
            1 => (p.z, p.x, p.y),
            _ => (p.x, p.y, p.z),
        };
        (x - ray.shear.0 * z, y - ray.shear.1 * z)
    };
    let ((ax, ay), (bx, by), (cx, cy)) = (shear(a), shear(b), shear(c));
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;

    let reach = largest3(largest(a), largest(b), largest(c));
    let spread = largest3(greater(ax.abs(), ay.abs()), greater(bx.abs(), by.abs()), greater(cx.abs(), cy.abs()));
    let error = EdgeMargins::DERIVED.error(reach, spread);
    let (low, high) = (smaller(u, smaller(v, w)), greater(u, greater(v, w)));

    // Overflow makes the bound too large or NaN, and the comparisons false.
    if error < EdgeMargins::DERIVED.overflow {
        if low < -error && high > error {
            return false;
        }
        if low > error || high < -error {
            return true;
        }
    }
    is_hit_near_edge(ray, triangle)
}

/// [`is_hit`] for triangles that `f32` cannot decide.
#[cold]
#[inline(never)]
pub fn is_hit_near_edge(ray: &RaySpace, &[a, b, c]: &Triangle) -> bool {
    // The signs of coinciding edges in opposite directions never agree.
    if a == b || b == c || c == a {
        return false;
    }
    let first = ray.edge_sign(b, c);
    let second = ray.edge_sign(c, a);
    if first * second < 0 {
        return false;
    }
    let third = ray.edge_sign(a, b);
    let agree = first * third >= 0 && second * third >= 0;
    agree && (first, second, third) != (0, 0, 0)
}

/// Intersection of a ray with the plane of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Exact t = n·(a − o) / n·d with n = (b − a) × (c − a), rounded once.
    pub t: f32,
    /// t with a relative error of [`POSITION_T`], or NaN if [`distance_f64`] is needed.
    pub t_f64: f64,
    /// The normal n.
    pub normal: DVec3,
}

/// Intersects the line through the ray with a triangle that is hit.
#[inline]
pub fn meet(ray: &RaySpace, triangle: &Triangle) -> Meeting {
    let (numerator, denominator, normal) = plane_terms(ray, triangle, PLANE_TERMS_F64);
    match numerator.over(denominator) {
        Some(t) if t.is_within(POSITION_T) => {
            let rounded = t.nearest().unwrap_or_else(|| exact_distance(ray, triangle));
            Meeting { t: rounded, t_f64: t.value, normal }
        }
        _ => Meeting { t: distance(ray, triangle), t_f64: f64::NAN, normal },
    }
}

/// Exact t = n·(a − o) / n·d with n = (b − a) × (c − a), correctly rounded. The triangle must be hit.
pub fn distance(ray: &RaySpace, triangle: &Triangle) -> f32 {
    distance_along(ray.origin, ray.dir, triangle)
}

/// [`distance`] for a ray without a prepared [`RaySpace`]; its direction must not be zero.
#[inline]
pub fn distance_along(origin: Vec3, dir: Vec3, triangle: &Triangle) -> f32 {
    let (numerator, denominator) = Flat::of(in_f64(triangle)).terms(origin, dir, PLANE_TERMS_F64);
    let fast = numerator.over(denominator).and_then(Bounded::nearest);
    fast.unwrap_or_else(|| exact_distance(&RaySpace::checked(origin, dir).0, triangle))
}

#[cold]
#[inline(never)]
fn exact_distance(ray: &RaySpace, triangle: &Triangle) -> f32 {
    // The ray starts at a corner.
    if triangle.contains(&ray.origin) {
        return 0.0;
    }
    let (numerator, denominator) = exact_plane_terms(ray, triangle);
    rounded::<192, 384>(&numerator, &denominator)
}

/// Distance of [`intersect`] to a triangle that is hit, with a relative error of [`POSITION_T`].
pub fn distance_f64(ray: &RaySpace, triangle: &Triangle) -> f64 {
    const { assert!(EXACT_QUOTIENT < POSITION_T) };
    distance_within(ray, triangle, POSITION_T)
}

/// Distance to a triangle that is hit, with a relative error of `enough`, which is more than [`EXACT_QUOTIENT`].
fn distance_within(ray: &RaySpace, triangle: &Triangle, enough: f64) -> f64 {
    match plane_quotient(ray, triangle, PLANE_TERMS_F64) {
        Some(t) if t.is_within(enough) => t.value,
        _ => {
            let (numerator, denominator) = exact_plane_terms(ray, triangle);
            approximate(&numerator, &denominator)
        }
    }
}

/// t in `f64` with a bound of its error, if there is one; `terms` is the relative error of both terms.
#[inline]
fn plane_quotient(ray: &RaySpace, triangle: &Triangle, terms: f64) -> Option<Bounded> {
    let (numerator, denominator, _) = plane_terms(ray, triangle, terms);
    numerator.over(denominator)
}

/// Plane of a triangle, shared by all rays: a, n = (b − a) × (c − a), and |b − a| × |c − a| with sums for differences.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flat {
    /// Corner a.
    pub corner: DVec3,
    /// Normal n, not normalised.
    pub normal: DVec3,
    /// Bound of the rounding of n, up to a factor.
    pub sizes: DVec3,
}

impl Flat {
    /// Computes the plane of a triangle.
    #[inline(always)]
    pub fn of([a, b, c]: [DVec3; 3]) -> Self {
        let (e1, e2) = (b - a, c - a);
        Self { corner: a, normal: e1.cross(e2), sizes: magnitude_cross(e1.abs(), e2.abs()) }
    }

    /// Unit normal, as in [`normal`](fn@normal).
    #[inline]
    pub fn unit(&self) -> Vec3 {
        self.normal.normalize_or_zero().as_vec3()
    }

    /// [`distance_f64`] to a triangle that is hit, or `None` if the bound of its error is not good enough.
    #[inline(always)]
    pub fn distance(&self, origin: Vec3, dir: Vec3) -> Option<f64> {
        let (numerator, denominator) = self.terms(origin, dir, PLANE_TERMS_F64);
        match numerator.over(denominator) {
            Some(t) if t.is_within(POSITION_T) => Some(t.value),
            _ => None,
        }
    }

    /// n·(a − o) and n·d.
    #[inline(always)]
    fn terms(&self, origin: Vec3, dir: Vec3, terms: f64) -> (Bounded, Bounded) {
        let term = |v: DVec3| Bounded { value: self.normal.dot(v), error: self.sizes.dot(v.abs()) * terms };
        (term(self.corner - origin.as_dvec3()), term(dir.as_dvec3()))
    }
}

/// n·(a − o), n·d and n.
#[inline]
fn plane_terms(ray: &RaySpace, triangle: &Triangle, terms: f64) -> (Bounded, Bounded, DVec3) {
    let flat = Flat::of(in_f64(triangle));
    let (numerator, denominator) = flat.terms(ray.origin, ray.dir, terms);
    (numerator, denominator, flat.normal)
}

/// |p| × |q| with sums for differences: bounds the rounding of the cross product.
#[inline(always)]
pub(super) fn magnitude_cross(p: DVec3, q: DVec3) -> DVec3 {
    DVec3::new(p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x)
}

#[cold]
#[inline(never)]
fn exact_plane_terms(ray: &RaySpace, &[a, b, c]: &Triangle) -> (Expansion<192>, Expansion<96>) {
    let (a, b, c) = (a.to_array(), b.to_array(), c.to_array());
    let normal = cross(&difference(b, a), &difference(c, a));
    (dot(&normal, &difference(a, ray.origin.to_array())), dot_f32(&normal, ray.dir.to_array()))
}

/// Barycentric weights of the second and third corner at the ray's hit with a triangle, each in 0..=1.
pub fn barycentrics(ray: &RaySpace, triangle: &Triangle) -> (f32, f32) {
    let [a, b, c] = in_f64(triangle);
    barycentrics_at(ray, triangle, distance_f64(ray, triangle), (b - a).cross(c - a))
}

/// Distance of [`meet`], and the barycentric weights of the second and third corner.
pub fn place(ray: &RaySpace, triangle: &Triangle) -> (f32, f32, f32) {
    let Meeting { t, t_f64, normal } = meet(ray, triangle);
    let (u, v) =
        if t_f64.is_nan() { barycentrics(ray, triangle) } else { barycentrics_at(ray, triangle, t_f64, normal) };
    (t, u, v)
}

/// Barycentric weights of the second and third corner at the distance and with the normal of [`meet`], or at that of
/// [`distance_f64`] with the normal (b − a) × (c − a).
///
/// Areas in the plane of the triangle, projected along the axis in which they are largest, so that a grazing ray is no worse
/// than another.
#[inline]
pub fn barycentrics_at(ray: &RaySpace, &[a, b, c]: &Triangle, t: f64, normal: DVec3) -> (f32, f32) {
    let [i, j] = flat_axes(normal);
    let flat = |p: DVec3| (p[i], p[j]);
    let a = a.as_dvec3();
    let ((px, py), (bx, by), (cx, cy)) =
        (flat(ray.origin.as_dvec3() + ray.dir.as_dvec3() * t - a), flat(b.as_dvec3() - a), flat(c.as_dvec3() - a));
    let scale = 1.0 / (bx * cy - by * cx);
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
    let clamp = |x: f64| if x > 0.0 { (if x < 1.0 { x } else { 1.0 }) as f32 } else { 0.0 };
    let (u, v) = (clamp((px * cy - py * cx) * scale), clamp((bx * py - by * px) * scale));
    if u + v > 1.0 { (u, 1.0 - u) } else { (u, v) }
}

/// Axes of the projection in which a face with this normal is largest, in right-handed order.
#[inline(always)]
pub fn flat_axes(normal: DVec3) -> [usize; 2] {
    let size = normal.abs();
    if size.x >= size.y && size.x >= size.z {
        [1, 2]
    } else if size.y >= size.z {
        [2, 0]
    } else {
        [0, 1]
    }
}

/// Corners in double precision.
#[inline(always)]
pub fn in_f64(&[a, b, c]: &Triangle) -> [DVec3; 3] {
    [a.as_dvec3(), b.as_dvec3(), c.as_dvec3()]
}

/// Point of the triangle; uniformly distributed if `r` and `s` are, in 0..=1.
pub fn within(&[a, b, c]: &Triangle, r: f32, s: f32) -> Vec3 {
    let (r, s) = if r + s > 1.0 { (1.0 - r, 1.0 - s) } else { (r, s) };
    a + (b - a) * r + (c - a) * s
}

/// Unit normal, towards the side from which the corners are counter-clockwise; zero for a triangle without area.
pub fn normal(triangle: &Triangle) -> Vec3 {
    Flat::of(in_f64(triangle)).unit()
}

#[inline]
fn largest(p: Vec3) -> f32 {
    greater(p.x.abs(), greater(p.y.abs(), p.z.abs()))
}

#[inline]
fn largest3(a: f32, b: f32, c: f32) -> f32 {
    greater(a, greater(b, c))
}

/// A single instruction, unlike `f32::max`; returns the second operand if one is NaN.
#[inline]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::super::rational::{hit, point};
    use super::*;

    /// Calls `check` with nearly edge-on triangles, and rays that hit them.
    fn each_grazing(mut check: impl FnMut(&RaySpace, &Triangle)) {
        let mut random = Random::new(10);
        for _ in 0..400 {
            let (a, e1, e2) = (random.cube(), random.cube(), random.cube());
            let triangle = [a, a + e1, a + e2];
            let dir = e1 * random.unit() - e2 * random.unit() + random.cube() * 1e-7;
            let origin = a + (e1 + e2) * 0.3 - dir * 2.0;
            if let Some(ray) = RaySpace::new(origin, dir).filter(|ray| is_hit(ray, &triangle)) {
                check(&ray, &triangle);
            }
        }
    }

    /// Largest relative error of distances that are accepted from `f64` if their bound is below `enough`.
    fn worst(enough: f64) -> f64 {
        let mut worst = 0.0f64;
        each_grazing(|ray, triangle| {
            let exact = hit(&point(ray.origin), &point(ray.dir), triangle).map_or(f64::NAN, |t| t.to_f64().value());
            worst = worst.max((distance_within(ray, triangle, enough) / exact - 1.0).abs());
        });
        worst
    }

    /// Number of floats that are accepted from `f64` and are not the nearest.
    fn wrongly_rounded(terms: f64) -> usize {
        let mut wrong = 0;
        each_grazing(|ray, triangle| {
            let (numerator, denominator) = exact_plane_terms(ray, triangle);
            let exact = rounded::<192, 384>(&numerator, &denominator);
            let fast = plane_quotient(ray, triangle, terms).and_then(Bounded::nearest);
            wrong += usize::from(fast.is_some_and(|t| t.to_bits() != exact.to_bits()));
        });
        wrong
    }

    #[test]
    fn a_rounded_distance_is_the_nearest_and_would_not_be_without_the_bound_of_its_terms() {
        assert_eq!(wrongly_rounded(PLANE_TERMS_F64), 0);
        assert!(wrongly_rounded(0.0) > 0);
    }

    #[test]
    fn a_distance_that_places_a_hit_is_as_good_as_it_is_said_to_be() {
        assert!(worst(POSITION_T) < POSITION_T);
        assert!(worst(f64::INFINITY) > POSITION_T, "nothing goes wrong without the limit");
    }
}
