//! Seams between faces of a mesh: a ray through a shared edge or corner hits every face there, but crosses one surface.

use crate::accel::shapes::Prim;
use crate::accel::{Hit, Ray};
use crate::math::Vec3;
use crate::math::polygon::Polygon;
use crate::math::triangle::Triangle;

/// Whether `hit` is the same crossing of the same surface as `before`, the hit in front of it on the same ray.
///
/// Two faces that turn the same side to a ray and share an edge, which they traverse in opposite directions, lie on different
/// sides of that edge as seen from the ray, so it can hit both only on the edge itself. Other faces that share a corner must also
/// be hit at the same distance: leaves of a book traverse its spine in the same direction, and one lies over the next. A surface
/// has a single material: a face glued to another, or painted on it, shares corners with it but is crossed separately. Where one
/// of the two faces is seen from behind, the surface is crossed twice, in and out again.
///
/// `face` returns the prim of an index, and its material.
pub(crate) fn is_same_crossing<'a>(face: impl Fn(u32) -> (Prim<'a>, u32), ray: &Ray, before: &Hit, hit: &Hit) -> bool {
    /// Relative difference of two distances to one corner: a few roundings.
    const ROUNDING: f32 = 32.0 * f32::EPSILON;
    if !before.is_some() || before.prim == hit.prim {
        return false;
    }
    let ((a, material), (b, other)) = (face(before.prim), face(hit.prim));
    if material != other {
        return false;
    }
    let (Some(a), Some(b)) = (Corners::of(a), Corners::of(b)) else { return false };
    let touch = || a.positions().any(|p| b.positions().any(|q| p == q));
    let meet = a.continues(&b) || (hit.t - before.t <= hit.t.abs() * ROUNDING && touch());
    meet && a.faces(ray) == b.faces(ray)
}

/// Whether a ray that starts before the surface of `before`, which it crosses, hits the same surface once more within the error
/// of its start: everything of the same material that turns the same side to the ray there is one surface, however small its
/// faces are, and however many coincide.
pub(crate) fn is_same_surface<'a>(face: impl Fn(u32) -> (Prim<'a>, u32), ray: &Ray, before: &Hit, hit: &Hit) -> bool {
    if !before.is_some() {
        return false;
    }
    let ((a, material), (b, other)) = (face(before.prim), face(hit.prim));
    let (Some(a), Some(b)) = (Corners::of(a), Corners::of(b)) else { return false };
    material == other && a.faces(ray) == b.faces(ray)
}

/// The corners of a face.
enum Corners<'a> {
    Triangle(Triangle),
    Polygon(Polygon<'a>),
}

impl<'a> Corners<'a> {
    /// Returns `None` for shapes without corners.
    fn of(prim: Prim<'a>) -> Option<Self> {
        match prim {
            Prim::Triangle(corners) => Some(Self::Triangle(corners)),
            Prim::Polygon(polygon) => Some(Self::Polygon(polygon)),
            _ => None,
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::Triangle(corners) => corners.len(),
            Self::Polygon(polygon) => polygon.corners.len(),
        }
    }

    fn position(&self, i: usize) -> Vec3 {
        match self {
            Self::Triangle(corners) => corners[i],
            Self::Polygon(polygon) => polygon.vertices[polygon.corners[i] as usize],
        }
    }

    fn positions(&self) -> impl Iterator<Item = Vec3> {
        (0..self.len()).map(|i| self.position(i))
    }

    /// Edges of the face, from corner to corner in turn.
    fn edges(&self) -> impl Iterator<Item = [Vec3; 2]> {
        let len = self.len();
        (0..len).map(move |i| [self.position(i), self.position((i + 1) % len)])
    }

    /// Whether the other face lies beyond an edge of this one: both have that edge, in opposite directions.
    fn continues(&self, other: &Self) -> bool {
        self.edges().any(|[p, q]| other.edges().any(|[a, b]| [b, a] == [p, q]))
    }

    /// Whether the ray hits the front of the face: the sign of its projected area along the ray, summed over a fan.
    fn faces(&self, ray: &Ray) -> bool {
        let at = |i: usize| (self.position(i) - ray.origin).as_dvec3();
        let area = |i: usize| (at(i - 1) - at(0)).cross(at(i) - at(0)).dot(ray.dir.as_dvec3());
        (2..self.len()).map(area).sum::<f64>() < 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{NO_PRIM, Shapes};

    fn ray() -> Ray {
        Ray { origin: Vec3::Z, t_min: 0.0, dir: Vec3::NEG_Z, t_max: 9.0, exclude: NO_PRIM, sample: 0 }
    }

    fn at(prim: u32, t: f32) -> Hit {
        Hit { t, u: 0.0, v: 0.0, prim }
    }

    /// Returns a square of two triangles, one triangle that touches its corner, one far below, and others along its diagonal.
    fn shapes() -> Shapes {
        let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        Shapes {
            vertices: vec![
                v(-1.0, -1.0, 0.0),
                v(1.0, -1.0, 0.0),
                v(1.0, 1.0, 0.0),
                v(-1.0, 1.0, 0.0),
                // The corner (1, 1) again, as in meshes with seams.
                v(1.0, 1.0, 0.0),
                v(2.0, 1.0, 0.0),
                v(1.0, 2.0, 0.0),
                v(-1.0, -1.0, -1.0),
                v(1.0, -1.0, -1.0),
                v(1.0, 1.0, -1.0),
                // Below the corner (1, −1).
                v(1.0, -1.0, -0.5),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9], [0, 3, 2], [0, 10, 2], [0, 1, 2]],
            ..Shapes::default()
        }
    }

    #[test]
    fn both_faces_at_a_shared_edge_are_one_crossing() {
        let shapes = shapes();
        assert!(is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(1, 1.0)));
    }

    #[test]
    fn faces_that_share_a_corner_are_one_crossing_at_that_corner_only() {
        let shapes = shapes();
        assert!(is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(2, 1.0)));
        assert!(!is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(2, 1.1)));
    }

    #[test]
    fn a_face_behind_another_is_a_crossing_of_its_own() {
        let shapes = shapes();
        assert!(!is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(3, 2.0)));
    }

    #[test]
    fn a_fold_is_crossed_in_and_out() {
        let shapes = shapes();
        assert!(!is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(4, 1.0)));
    }

    #[test]
    fn leaves_of_a_book_are_crossed_one_by_one_but_at_the_spine() {
        let shapes = shapes();
        let crossed = |t| is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(5, t));
        assert!(!crossed(1.25) && crossed(1.0));
    }

    #[test]
    fn a_copy_of_a_face_is_the_same_crossing_unless_it_is_of_another_material() {
        let shapes = shapes();
        let painted = |prim| (shapes.prim(prim), u32::from(prim == 6));
        assert!(!is_same_crossing(painted, &ray(), &at(0, 1.0), &at(6, 1.0)));
        assert!(
            !is_same_crossing(|prim| (shapes.prim(prim), prim), &ray(), &at(0, 1.0), &at(1, 1.0)),
            "across an edge"
        );
        assert!(is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(6, 1.0)));
    }

    #[test]
    fn a_ray_that_starts_before_a_surface_crosses_all_of_it_at_once() {
        let shapes = shapes();
        let is_same =
            |prim: u32| is_same_surface(|prim| (shapes.prim(prim), prim / 3), &ray(), &at(0, 1.0), &at(prim, 1.0));
        assert!(is_same(1) && is_same(2), "beside it, and farther away");
        assert!(!is_same(3), "of another material");
        let turned = is_same_surface(|prim| (shapes.prim(prim), 0), &ray(), &at(0, 1.0), &at(4, 1.0));
        assert!(!turned, "seen from the other side");
    }

    #[test]
    fn the_first_hit_is_never_a_repetition() {
        let shapes = shapes();
        assert!(!is_same_crossing(|prim| (shapes.prim(prim), 0), &ray(), &Hit::MISS, &at(0, 1.0)));
    }
}
