//! Where faces of a mesh meet: a ray through a shared edge or corner hits every face there, but crosses one surface.

use crate::accel::{Hit, Ray, Shapes};
use crate::math::Vec3;

/// Whether `hit` is the same crossing of the same surface as `before`, the hit in front of it on the same ray.
///
/// Two faces that turn the same side to a ray and share an edge lie on different sides of that edge as the ray sees
/// them, so it can meet both only on the edge itself. Faces that share a corner only must be met at the same distance
/// as well. Where one of two faces is seen from behind the surface is crossed twice, in and out again.
pub(crate) fn is_same_crossing(shapes: &Shapes, ray: &Ray, before: &Hit, hit: &Hit) -> bool {
    /// Relative difference of two distances to one corner: some roundings.
    const ROUNDING: f32 = 32.0 * f32::EPSILON;
    if !before.is_some() || before.prim == hit.prim {
        return false;
    }
    let (Some(a), Some(b)) = (corners(shapes, before.prim), corners(shapes, hit.prim)) else { return false };
    let shared = a.iter().filter(|&&i| b.iter().any(|&j| position(shapes, i) == position(shapes, j))).count();
    let meet = shared >= 2 || (shared == 1 && hit.t - before.t <= hit.t.abs() * ROUNDING);
    meet && facing(shapes, a, ray) == facing(shapes, b, ray)
}

/// The corners of a face, indices into the vertices; `None` for shapes without corners.
fn corners(shapes: &Shapes, prim: u32) -> Option<&[u32]> {
    let prim = prim as usize;
    if let Some(triangle) = shapes.triangles.get(prim) {
        return Some(triangle);
    }
    let &(first, len) = shapes.polygons.get(prim - shapes.triangles.len())?;
    shapes.polygon_corners.get(first as usize..(first + len) as usize)
}

fn position(shapes: &Shapes, corner: u32) -> Vec3 {
    shapes.vertices[corner as usize]
}

/// Whether the ray meets the front of a face: the sign of its area as the ray sees it, summed over a fan.
fn facing(shapes: &Shapes, corners: &[u32], ray: &Ray) -> bool {
    let at = |i: usize| (position(shapes, corners[i]) - ray.origin).as_dvec3();
    let area: f64 = (2..corners.len()).map(|i| (at(i - 1) - at(0)).cross(at(i) - at(0)).dot(ray.dir.as_dvec3())).sum();
    area < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;

    fn ray() -> Ray {
        Ray { origin: Vec3::Z, t_min: 0.0, dir: Vec3::NEG_Z, t_max: 9.0, exclude: NO_PRIM, sample: 0 }
    }

    fn at(prim: u32, t: f32) -> Hit {
        Hit { t, u: 0.0, v: 0.0, prim }
    }

    /// A square of two triangles, one that touches it in a corner, one far below.
    fn shapes() -> Shapes {
        let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        Shapes {
            vertices: vec![
                v(-1.0, -1.0, 0.0),
                v(1.0, -1.0, 0.0),
                v(1.0, 1.0, 0.0),
                v(-1.0, 1.0, 0.0),
                // The corner (1, 1) again, as meshes with seams have it.
                v(1.0, 1.0, 0.0),
                v(2.0, 1.0, 0.0),
                v(1.0, 2.0, 0.0),
                v(-1.0, -1.0, -1.0),
                v(1.0, -1.0, -1.0),
                v(1.0, 1.0, -1.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9], [0, 3, 2]],
            ..Shapes::default()
        }
    }

    #[test]
    fn both_faces_at_a_shared_edge_are_one_crossing() {
        assert!(is_same_crossing(&shapes(), &ray(), &at(0, 1.0), &at(1, 1.0)));
    }

    #[test]
    fn faces_that_share_a_corner_are_one_crossing_at_that_corner_only() {
        assert!(is_same_crossing(&shapes(), &ray(), &at(0, 1.0), &at(2, 1.0)));
        assert!(!is_same_crossing(&shapes(), &ray(), &at(0, 1.0), &at(2, 1.1)));
    }

    #[test]
    fn a_face_behind_another_is_a_crossing_of_its_own() {
        assert!(!is_same_crossing(&shapes(), &ray(), &at(0, 1.0), &at(3, 2.0)));
    }

    #[test]
    fn a_fold_is_crossed_in_and_out() {
        assert!(!is_same_crossing(&shapes(), &ray(), &at(0, 1.0), &at(4, 1.0)));
    }

    #[test]
    fn the_first_hit_is_never_a_repetition() {
        assert!(!is_same_crossing(&shapes(), &ray(), &Hit::MISS, &at(0, 1.0)));
    }
}
