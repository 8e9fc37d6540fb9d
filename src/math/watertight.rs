//! Test for comparison: S. Woop, C. Benthin, I. Wald, *Watertight Ray/Triangle Intersection*, 2013, as published.
//!
//! Edge values in sheared ray space; in `f32` an edge value of exactly zero is recomputed in `f64`, where the products are
//! exact. A shared corner has the same sheared position in all its triangles, so that no ray slips between them; but those
//! positions are rounded, so that a verdict near an edge can be that of a slightly displaced triangle, and t comes from the
//! rounded edge values. The default test ([`triangle`](super::triangle)) has neither error.

use std::ops::{Add, Div, Mul, Sub};

use super::Vec3;
use super::shear::RaySpace;
use super::triangle::Triangle;

/// Either `f32` or `f64`.
pub trait Real:
    Copy + PartialOrd + From<f32> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
}

impl Real for f32 {}
impl Real for f64 {}

/// Shear of a ray, shared by all its tests.
#[derive(Clone, Copy, Debug)]
pub struct Shear<T> {
    x: T,
    y: T,
    z: T,
}

impl<T: Real> Shear<T> {
    /// Computes the shear of a ray.
    pub fn new(ray: &RaySpace) -> Self {
        let [x, y, z] = [ray.x, ray.y, ray.z].map(|k| T::from(ray.dir[k]));
        Self { x: x / z, y: y / z, z: T::from(1.0) / z }
    }

    /// Sheared x and y of a corner, and its distance along the ray.
    fn place(&self, ray: &RaySpace, p: Vec3) -> [T; 3] {
        let [x, y, z] = [ray.x, ray.y, ray.z].map(|k| T::from(p[k]) - T::from(ray.origin[k]));
        [x - self.x * z, y - self.y * z, self.z * z]
    }

    /// Distance at which the line through the ray hits the triangle.
    #[inline]
    pub fn intersect(&self, ray: &RaySpace, triangle: &Triangle, edges: impl Fn([[T; 3]; 3]) -> [T; 3]) -> Option<T> {
        let zero = T::from(0.0);
        let corners = triangle.map(|p| self.place(ray, p));
        let [u, v, w] = edges(corners);
        let below = u < zero || v < zero || w < zero;
        let above = u > zero || v > zero || w > zero;
        let area = u + v + w;
        if below && above || area == zero {
            return None;
        }
        let [a, b, c] = corners.map(|p| p[2]);
        Some((u * a + v * b + w * c) / area)
    }
}

/// Edge values opposite each corner.
pub fn edges<T: Real>([a, b, c]: [[T; 3]; 3]) -> [T; 3] {
    [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]]
}

/// [`edges`]; if one is zero, all are recomputed from exact products.
pub fn edges_checked(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let fast = edges(corners);
    if fast.contains(&0.0) {
        #[expect(clippy::cast_possible_truncation, reason = "the sign survives, but for underflow")]
        return edges(corners.map(|c| c.map(f64::from))).map(|e| e as f32);
    }
    fast
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    fn both(origin: Vec3, dir: Vec3, t: &Triangle) -> [Option<f64>; 2] {
        let Some(ray) = RaySpace::new(origin, dir) else { return [None; 2] };
        let single = Shear::<f32>::new(&ray).intersect(&ray, t, edges_checked);
        [single.map(f64::from), Shear::<f64>::new(&ray).intersect(&ray, t, edges)]
    }

    #[test]
    fn a_triangle_is_hit_from_both_sides_at_the_right_distance() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(both(Vec3::new(0.25, 0.5, 2.0), Vec3::NEG_Z, &t), [Some(2.0); 2]);
        assert_eq!(both(Vec3::new(0.25, 0.5, -2.0), Vec3::Z * 0.5, &t), [Some(4.0); 2]);
        assert_eq!(both(Vec3::new(0.75, 0.5, 2.0), Vec3::NEG_Z, &t), [None; 2]);
        assert_eq!(both(Vec3::new(0.25, 0.0, 2.0), Vec3::X, &t), [None; 2], "in the plane's direction");
    }

    #[test]
    fn a_ray_at_an_edge_or_corner_hits_at_least_one_of_the_triangles_there() {
        let (t, s) = ([Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::X, Vec3::ONE.with_z(0.0), Vec3::Y]);
        for i in 0..=100 {
            let target = Vec3::X.lerp(Vec3::Y, i as f32 / 100.0);
            let origin = Vec3::new(0.4, 0.3, 4.0);
            let (one, other) = (both(origin, target - origin, &t), both(origin, target - origin, &s));
            // The end points of the edge also border on nothing.
            let inside = (1..100).contains(&i);
            assert!(!inside || (0..2).all(|k| one[k].is_some() || other[k].is_some()), "{target}");
        }
    }

    /// G12 (fused edges).
    #[test]
    fn fused_edge_values_have_wrong_signs_and_let_rays_through() {
        fn fused([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
            let edge = |p: [f32; 3], q: [f32; 3]| libm::fmaf(p[0], q[1], -(p[1] * q[0]));
            [edge(c, b), edge(a, c), edge(b, a)]
        }
        let escaped = |edges: fn([[f32; 3]; 3]) -> [f32; 3]| {
            let mut random = Random::new(11);
            let mut escaped = 0;
            for _ in 0..4000 {
                let (a, b, origin) =
                    (random.cube() * 0.1, random.cube() * 0.1 + Vec3::X, random.cube() + Vec3::Z * 4.0);
                let (c, d) = (Vec3::new(0.5, 1.0, random.unit()), Vec3::new(0.5, -1.0, random.unit()));
                // Through the edge shared by both triangles, up to rounding.
                let target = a + (b - a) * (0.25 + 0.5 * random.unit());
                let Some(ray) = RaySpace::new(origin, target - origin) else { continue };
                let shear = Shear::<f32>::new(&ray);
                escaped +=
                    usize::from([[a, b, c], [b, a, d]].iter().all(|t| shear.intersect(&ray, t, edges).is_none()));
            }
            escaped
        };
        assert_eq!(escaped(edges_checked), 0);
        assert!(escaped(fused) > 0, "fused edge values are as good");
    }
}
