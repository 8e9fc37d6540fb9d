//! The comparator: T. Möller, B. Trumbore, *Fast, Minimum Storage Ray/Triangle Intersection*, 1997, in `f32` as published.
//!
//! Not watertight: the two triangles at an edge decide about it with different arithmetic, and both may refuse a ray. Its
//! determinant test depends on scale; here only an exactly zero determinant is refused. No structure uses it by default.

use super::Vec3;
use super::triangle::Triangle;

/// Distance and the weights of the second and third corner.
pub fn intersect(origin: Vec3, dir: Vec3, &[a, b, c]: &Triangle) -> Option<(f32, f32, f32)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_hit_from_both_sides_at_the_right_weights() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(intersect(Vec3::new(0.25, 0.5, 2.0), Vec3::NEG_Z, &t), Some((2.0, 0.25, 0.5)));
        assert_eq!(intersect(Vec3::new(0.25, 0.5, -2.0), Vec3::Z, &t), Some((2.0, 0.25, 0.5)));
        assert_eq!(intersect(Vec3::new(0.75, 0.5, 2.0), Vec3::NEG_Z, &t), None);
        assert_eq!(intersect(Vec3::new(0.25, 0.0, 2.0), Vec3::X, &t), None, "in the plane's direction");
    }
}
