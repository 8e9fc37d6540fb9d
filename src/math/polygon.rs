//! Ray against a whole planar n-gon, also concave or self-intersecting (even–odd rule).
//!
//! # Boundary
//! The crossing test of E. Haines, *Point in Polygon Strategies*, Graphics Gems IV, 1994, with exact signs in sheared ray
//! space: the ray is the origin there, and the edges that cross the positive x' axis are counted. A corner on the axis counts
//! as above it and a crossing at the origin does not count, so that in a mesh of polygons every ray belongs to exactly one of
//! those that share an edge or corner. Which one follows from the ray alone: the side x' > 0, and y' ≥ 0 at a corner, where
//! x', y' are the two axes after the direction's largest. So an edge or corner of a single polygon may or may not be hit,
//! unlike a triangle's, which always is; a repeated corner, a spike (a–b–a) and an edge traversed twice change nothing.
//!
//! # Distance
//! The distance is that of the plane through the first corner with Newell's normal, exact and rounded once, like a
//! triangle's. A polygon whose areas cancel (an even bow-tie) has no normal and is hit only if its plane is parallel to two
//! axes.

use dashu::rational::RBig;

use super::bounds::{POSITION_T, U64};
use super::quotient::Bounded;
use super::rational::{cross, dot, minus, point, sign};
use super::shear::RaySpace;
use super::{DVec3, Vec3, Vec3Swizzles};

/// A polygon as a run of corner indices into an array of vertices.
#[derive(Clone, Copy, Debug)]
pub struct Polygon<'a> {
    /// All vertices.
    pub vertices: &'a [Vec3],
    /// Corners in order; at least 3.
    pub corners: &'a [u32],
}

impl<'a> Polygon<'a> {
    /// Positions of the corners.
    pub fn points(self) -> impl Iterator<Item = Vec3> + Clone + use<'a> {
        self.corners.iter().map(move |&i| self.vertices[i as usize])
    }

    /// Edges as pairs of points, the closing one first.
    fn edges(self) -> impl Iterator<Item = (Vec3, Vec3)> + use<'a> {
        let n = self.corners.len();
        self.points().cycle().skip(n - 1).zip(self.points())
    }

    /// Smallest box around the corners.
    pub fn bounds(self) -> (Vec3, Vec3) {
        self.points().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
    }

    /// Twice the area vector (M. Newell), in `f64`; towards the side from which the corners are counter-clockwise.
    pub fn newell(self) -> DVec3 {
        let Some(base) = self.points().next().map(Vec3::as_dvec3) else { return DVec3::ZERO };
        self.edges().map(|(p, q)| (p.as_dvec3() - base).cross(q.as_dvec3() - base)).sum()
    }

    /// Unit normal; zero for a polygon without area.
    pub fn normal(self) -> Vec3 {
        self.newell().normalize_or_zero().as_vec3()
    }
}

/// Distance at which the line through the ray meets the polygon; exact, rounded once.
///
/// Defined as N·(p₀ − o) / N·d, with the first corner p₀ and Newell's normal N of the `f32` corners, clamped to the polygon's
/// box: where the corners are off the plane by rounding, a grazing ray could otherwise hit far beyond them.
pub fn intersect(ray: &RaySpace, polygon: Polygon) -> Option<f32> {
    if !is_inside(ray, polygon) {
        return None;
    }
    let near = quotient(ray, polygon).and_then(Bounded::nearest);
    near.or_else(|| exact_distance(ray, polygon).map(|t| never_zero_behind(&t)))
}

/// Distance of [`intersect`] to a polygon that is hit, with a relative error of [`POSITION_T`].
pub fn distance_f64(ray: &RaySpace, polygon: Polygon) -> Option<f64> {
    match quotient(ray, polygon) {
        Some(t) if t.is_within(POSITION_T) => Some(t.value),
        _ => exact_distance(ray, polygon).map(|t| t.to_f64().value()),
    }
}

/// Whether the line through the ray passes inside the polygon: exact, half-open.
fn is_inside(ray: &RaySpace, polygon: Polygon) -> bool {
    let mut inside = false;
    for (p, q) in polygon.edges() {
        let (p_above, q_above) = (ray.height_sign(p) >= 0, ray.height_sign(q) >= 0);
        if p_above != q_above {
            // The edge crosses the axis at (x'ₚ y'_q − y'ₚ x'_q) / (y'_q − y'ₚ).
            let upwards = if q_above { 1 } else { -1 };
            inside ^= ray.edge_sign(p, q) * upwards > 0;
        }
    }
    inside
}

/// Distance in `f64`; `None` if it is uncertain whether the box changes it.
fn quotient(ray: &RaySpace, polygon: Polygon) -> Option<Bounded> {
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let (lo, hi) = polygon.bounds();
    let flat = (0..3).find(|&k| lo[k] == hi[k] && d[k] != 0.0);
    if let Some(k) = flat {
        // In an axis-parallel plane the box fixes the distance. One rounding of the difference, one of the quotient.
        let value = (f64::from(lo[k]) - o[k]) / d[k];
        return Some(Bounded { value, error: 4.0 * U64 * value.abs() });
    }

    // Differences and products err by 4 u, a sum of n terms by n u; then 2 more for the difference and product, 2 for
    // the sum.
    let first = polygon.points().next()?.as_dvec3();
    let terms = |p: Vec3| (p.as_dvec3() - first).abs();
    let sizes: DVec3 = polygon.edges().map(|(p, q)| twisted(terms(p), terms(q))).sum();
    let doubt = (polygon.corners.len() as f64 + 12.0) * U64;
    let (normal, to_first) = (polygon.newell(), first - o);
    let numerator = Bounded { value: normal.dot(to_first), error: doubt * sizes.dot(to_first.abs()) };
    let denominator = Bounded { value: normal.dot(d), error: doubt * sizes.dot(d.abs()) };
    let distance = numerator.over(denominator)?;

    let t = distance.value;
    let room = 4.0 * U64 + distance.error / t.abs() * 1.01;
    let inside = |k: usize| {
        let (a, b) = ((f64::from(lo[k]) - o[k]) / d[k], (f64::from(hi[k]) - o[k]) / d[k]);
        let (enter, leave) = (a.min(b), a.max(b));
        let slack = room * (t.abs() + enter.abs().max(leave.abs()));
        t - enter > slack && leave - t > slack
    };
    (0..3).all(|k| d[k] == 0.0 || inside(k)).then_some(distance)
}

/// a × b with sums in place of differences: bounds the sizes of a cross product's terms.
fn twisted(a: DVec3, b: DVec3) -> DVec3 {
    a.yzx() * b.zxy() + a.zxy() * b.yzx()
}

/// Distance in rational numbers; `None` for a line parallel to the plane.
#[cold]
fn exact_distance(ray: &RaySpace, polygon: Polygon) -> Option<RBig> {
    let (o, d) = (point(ray.origin), point(ray.dir));
    let first = point(polygon.points().next()?);
    let none = [RBig::ZERO, RBig::ZERO, RBig::ZERO];
    let normal = polygon.edges().fold(none, |[x, y, z], (p, q)| {
        let [a, b, c] = cross(&minus(&point(p), &first), &minus(&point(q), &first));
        [x + a, y + b, z + c]
    });
    let slope = dot(&normal, &d);
    if slope.is_zero() {
        return None;
    }
    let mut t = dot(&normal, &minus(&first, &o)) / slope;
    let (lo, hi) = polygon.bounds();
    let (lo, hi) = (point(lo), point(hi));
    for k in (0..3).filter(|&k| !d[k].is_zero()) {
        let (a, b) = ((&lo[k] - &o[k]) / &d[k], (&hi[k] - &o[k]) / &d[k]);
        let (enter, leave) = if a <= b { (a, b) } else { (b, a) };
        t = t.max(enter).min(leave);
    }
    Some(t)
}

/// [`round`](super::quotient::round) for a rational number.
fn never_zero_behind(t: &RBig) -> f32 {
    let rounded = t.to_f32().value();
    if sign(t) < 0 && rounded == 0.0 { -f32::from_bits(1) } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hits(outline: &[(i32, i32)], x: f32, y: f32) -> bool {
        let vertices: Vec<Vec3> = outline.iter().map(|&(x, y)| Vec3::new(x as f32, y as f32, 0.0)).collect();
        let corners: Vec<u32> = (0..outline.len() as u32).collect();
        let polygon = Polygon { vertices: &vertices, corners: &corners };
        RaySpace::new(Vec3::new(x, y, 8.0), Vec3::NEG_Z).and_then(|r| intersect(&r, polygon)) == Some(8.0)
    }

    #[test]
    fn a_concave_polygon_is_hollow_where_it_should_be() {
        let arrow = [(0, 0), (4, -4), (0, 4), (-4, -4)];
        assert!(hits(&arrow, 0.0, 2.0) && hits(&arrow, 2.5, -2.0) && hits(&arrow, -2.5, -2.0));
        assert!(!hits(&arrow, 0.0, -1.0) && !hits(&arrow, 0.0, -3.0));
    }

    #[test]
    fn a_self_intersecting_polygon_follows_the_even_odd_rule() {
        let pentagram = [(0, 100), (59, -81), (-95, 31), (95, 31), (-59, -81)];
        assert!(!hits(&pentagram, 0.0, 0.0), "the centre is wound twice");
        assert!(hits(&pentagram, 0.0, 80.0));
    }

    #[test]
    fn a_point_beside_a_corner_on_the_axis_is_outside() {
        assert!(!hits(&[(0, -4), (10, 0), (0, 4), (-2, 0)], 11.0, 0.0));
        assert!(hits(&[(0, -4), (10, 0), (0, 4), (-2, 0)], 5.0, 0.0));
    }

    #[test]
    fn squares_that_tile_the_plane_are_hit_exactly_once_everywhere() {
        for i in 0..9 {
            for j in 0..9 {
                let (x, y) = (i as f32 * 0.5 - 2.0, j as f32 * 0.5 - 2.0);
                let square = |a: i32, b: i32| hits(&[(a, b), (a + 1, b), (a + 1, b + 1), (a, b + 1)], x, y);
                let count = (-4..4).flat_map(|a| (-4..4).map(move |b| (a, b))).filter(|&(a, b)| square(a, b)).count();
                assert_eq!(count, 1, "at {x}, {y}");
            }
        }
    }
}
