//! Test for comparison: T. Möller, B. Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*, 1997, as published.
//!
//! Not watertight: the two triangles at an edge evaluate it with different arithmetic, and both may reject a ray. The
//! determinant test of the paper depends on scale; here only an exactly zero determinant is rejected. No structure uses this
//! test by default.

use super::triangle::Triangle;
use super::{DVec3, Vec3};

macro_rules! published_form {
    ($name:ident, $real:ty, $vector:ty, $doc:literal) => {
        #[doc = $doc]
        pub fn $name(origin: $vector, dir: $vector, [a, b, c]: [$vector; 3]) -> Option<($real, $real, $real)> {
            let (e1, e2) = (b - a, c - a);
            let p = dir.cross(e2);
            let determinant = e1.dot(p);
            if determinant == 0.0 {
                return None;
            }
            let inverse = 1.0 / determinant;
            let s = origin - a;
            let u = s.dot(p) * inverse;
            let q = s.cross(e1);
            let v = dir.dot(q) * inverse;
            let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            inside.then(|| (e2.dot(q) * inverse, u, v))
        }
    };
}

published_form!(single, f32, Vec3, "In `f32`: distance and the weights of the second and third corner.");
published_form!(double_of, f64, DVec3, "In `f64`: distance and the weights of the second and third corner.");

/// [`double_of`] for a ray and triangle in `f32`.
pub fn double(origin: Vec3, dir: Vec3, triangle: &Triangle) -> Option<(f64, f64, f64)> {
    double_of(origin.as_dvec3(), dir.as_dvec3(), triangle.map(|p| p.as_dvec3()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_hit_from_both_sides_at_the_right_weights() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (o, d, expected) in [
            (Vec3::new(0.25, 0.5, 2.0), Vec3::NEG_Z, Some((2.0, 0.25, 0.5))),
            (Vec3::new(0.25, 0.5, -2.0), Vec3::Z, Some((2.0, 0.25, 0.5))),
            (Vec3::new(0.75, 0.5, 2.0), Vec3::NEG_Z, None),
            // Parallel to the plane.
            (Vec3::new(0.25, 0.0, 2.0), Vec3::X, None),
        ] {
            assert_eq!(single(o, d, t), expected);
            assert_eq!(double(o, d, &t), expected.map(|(t, u, v)| (f64::from(t), f64::from(u), f64::from(v))));
        }
    }
}
