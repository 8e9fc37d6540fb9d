//! Keeps the starts of secondary rays away from the edges of their faces.
//!
//! A start in `f32` is off the exact hit by some roundings, and near an edge it could lie beyond the neighbouring face:
//! inside the solid, where a ray that should be free is blocked at once, or outside a closed room, where a ray that should be
//! blocked is free. A start that is moved inwards on its own face by a few roundings lies on the right side of every face
//! that meets it at an edge or corner, unless the angle between them is below that of [`EDGE_ROOM`].

use super::DVec3;
use super::bounds::EDGE_ROOM;
use super::triangle::{Triangle, in_f64};

/// Displacement along the triangle of a hit with weights `u`, `v` of the second and third corner, so that its distance from
/// each edge is at least [`EDGE_ROOM`] times `error`, the uncertainty of its position, or as large as a narrow triangle
/// allows. Zero unless the hit is near an edge.
#[inline]
pub fn inset(triangle: &Triangle, (u, v): (f32, f32), error: f32) -> DVec3 {
    let [a, b, c] = in_f64(triangle);
    let rim = Rim::of([a, b, c], (b - a).cross(c - a));
    if !rim.is_near((u, v), error) {
        return DVec3::ZERO;
    }
    let weights = [1.0 - f64::from(u) - f64::from(v), f64::from(u), f64::from(v)];
    let room = f64::from(error) * EDGE_ROOM;
    moved_inwards([a, b, c], weights, rim.heights2.map(|height2| room / height2.sqrt()), room)
}

/// Data for the distances of a triangle's points from its edges.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rim {
    /// Squared heights of each corner over the opposite edge; infinite for a triangle without area.
    pub heights2: [f64; 3],
}

impl Rim {
    /// Computes the heights of a triangle whose normal is (b − a) × (c − a).
    #[inline(always)]
    pub fn of([a, b, c]: [DVec3; 3], normal: DVec3) -> Self {
        // Square of twice the area.
        let area2 = normal.length_squared();
        let over = |edge: DVec3| if area2 == 0.0 { f64::INFINITY } else { area2 / edge.length_squared() };
        Self { heights2: [over(c - b), over(a - c), over(b - a)] }
    }

    /// Whether [`inset`] moves a hit with weights `u`, `v` and position error `error` inwards.
    #[inline(always)]
    pub fn is_near(&self, (u, v): (f32, f32), error: f32) -> bool {
        let (u, v) = (f64::from(u), f64::from(v));
        let weights = [1.0 - u - v, u, v];
        let room = f64::from(error) * EDGE_ROOM;
        // The weight of a corner times its height over the opposite edge is the distance from that edge. (Zero times an
        // infinite height is NaN, and not near.)
        let is_near = |k: usize| weights[k] * weights[k] * self.heights2[k] < room * room;
        is_near(0) | is_near(1) | is_near(2)
    }
}

/// Displacement from the point with weights `w` to one where each weight is at least that in `least`.
#[cold]
fn moved_inwards([a, b, c]: [DVec3; 3], w: [f64; 3], least: [f64; 3], room: f64) -> DVec3 {
    /// Limit of `least` for a triangle too narrow for the room: larger weights would leave no point.
    const WIDE: f64 = 0.25;
    /// Limit of the displacement, in units of the room: at a sharp corner there is room only far from it.
    const FAR: f64 = 16.0;
    let raised: [f64; 3] = std::array::from_fn(|k| w[k].max(least[k].min(WIDE)));
    let largest = (0..3).fold(0, |best, k| if raised[k] > raised[best] { k } else { best });
    let mut change: [f64; 3] = std::array::from_fn(|k| raised[k] - w[k]);
    // The other two weights are at most one half and their raised values, so this one stays the largest.
    change[largest] -= raised.iter().sum::<f64>() - 1.0;
    let way = (b - a) * change[1] + (c - a) * change[2];
    let length = way.length();
    if length > FAR * room { way * (FAR * room / length) } else { way }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use crate::math::random::Random;

    fn distances(triangle: &Triangle, p: DVec3) -> [f64; 3] {
        let [a, b, c] = triangle.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize();
        [(b, c), (c, a), (a, b)].map(|(from, to)| normal.cross(to - from).normalize().dot(p - from))
    }

    #[test]
    fn a_start_near_an_edge_or_corner_moves_inwards_and_stays_in_its_plane() {
        let mut random = Random::new(5);
        let mut moved = 0;
        for i in 0..3000 {
            let triangle: Triangle = std::array::from_fn(|_| random.cube());
            let error = 1e-7f32;
            // On an edge, near one, at a corner.
            let (u, v) = match i % 3 {
                0 => (random.unit(), 0.0),
                1 => (random.unit() * 1e-6, random.unit() * 1e-6),
                _ => (1.0, 0.0),
            };
            let way = inset(&triangle, (u, v), error);
            let [a, b, c] = triangle.map(Vec3::as_dvec3);
            let p = a + (b - a) * f64::from(u) + (c - a) * f64::from(v) + way;
            let room = f64::from(error) * EDGE_ROOM;
            let normal = (b - a).cross(c - a).normalize();
            assert!(normal.dot(way).abs() < 1e-15);
            assert!(way.length() <= 16.01 * room);
            if way.length() < 15.9 * room {
                let nearest = distances(&triangle, p).into_iter().fold(f64::INFINITY, f64::min);
                assert!(nearest > 0.999 * room, "{triangle:?} {u} {v}: {nearest}");
                moved += 1;
            }
        }
        assert!(moved > 2900, "{moved}");
    }

    #[test]
    fn a_start_within_its_face_does_not_move() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert_eq!(inset(&triangle, (0.3, 0.3), 1e-7), DVec3::ZERO);
    }

    #[test]
    fn a_narrow_triangle_gives_the_room_it_has() {
        let strip = [Vec3::ZERO, Vec3::new(4e-6, 0.0, 0.0), Vec3::new(0.0, 4e-6, 0.0)];
        let p = inset(&strip, (0.5, 0.5), 1e-7);
        let weight = 1.0 - (p.x + p.y + 4e-6) / 4e-6;
        assert!((weight - 0.25).abs() < 1e-6, "{p} {weight}");
        assert_eq!(inset(&[Vec3::ONE; 3], (0.5, 0.25), 1e-7), DVec3::ZERO);
        let needle = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1e-9, 0.0)];
        assert!(inset(&needle, (0.0, 0.0), 1e-7).length() < 1e-7 * EDGE_ROOM * 16.01);
    }
}
