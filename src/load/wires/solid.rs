//! The smallest solids that stand for a point or a line.
//!
//! They are as wide as the ball or round rod they stand for, averaged over all views: the mean shadow of a convex solid
//! has a quarter of its surface, and that of a convex rod is its perimeter over π wide (A. Cauchy, "Mémoire sur la
//! rectification des courbes et la quadrature des surfaces courbes", 1832).
//!
//! Solids with a normal are lit by it, so their faces should point along the normal, or nearly so: a point
//! becomes a flat piece of the surface that it was sampled from (H. Pfister et al., "Surfels: Surface Elements as Rendering
//! Primitives", 2000), a line a low roof over it.

use crate::math::DVec3;
use std::f64::consts::{FRAC_PI_3, PI};

/// Corners, and triangles that run counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub(super) struct Solid<const CORNERS: usize> {
    pub corners: [DVec3; CORNERS],
    pub triangles: &'static [[u32; 3]],
}

/// Octahedron for a point without a normal: surface 4√3 r², so that √3 r² = π w²/4.
pub(super) fn octahedron(at: DVec3, width: f64) -> Solid<6> {
    const TRIANGLES: [[u32; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let r = width * (PI / (4.0 * 3f64.sqrt())).sqrt();
    let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    Solid { corners: axes.map(|axis| at + axis * r), triangles: &TRIANGLES }
}

/// Tetrahedron for one of many points without a normal: surface 8/√3 r², so that 2/√3 r² = π w²/4.
pub(super) fn tetrahedron(at: DVec3, width: f64) -> Solid<4> {
    const TRIANGLES: [[u32; 3]; 4] = [[1, 2, 3], [0, 2, 1], [0, 3, 2], [0, 1, 3]];
    let r = width * (PI * 3f64.sqrt() / 8.0).sqrt();
    // Every second corner of a cube.
    let corners = [[-1.0, -1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]];
    let corners = corners.map(|corner| at + DVec3::from(corner) * (r / 3f64.sqrt()));
    Solid { corners, triangles: &TRIANGLES }
}

/// Square of a disc's area that faces along the unit vector `up`, for a point with that normal.
pub(super) fn square(at: DVec3, up: DVec3, width: f64) -> Solid<4> {
    let half = width * PI.sqrt() / 4.0;
    let (x, y) = up.any_orthonormal_pair();
    let corners = [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(i, j)| at + x * i + y * j);
    Solid { corners, triangles: &[[0, 1, 2], [0, 2, 3]] }
}

/// Prism with an equilateral cross-section from `a` to `b`, which differ. Perimeter 3√3 r, so that 3√3 r/π = w.
pub(super) fn prism([a, b]: [DVec3; 2], width: f64) -> Solid<6> {
    let r = width * PI / 27f64.sqrt();
    let frame = Frame::new([a, b], (b - a).any_orthonormal_vector());
    let corner = |turn: f64| {
        let (sin, cos) = libm::sincos(turn);
        frame.up * (cos * r) + frame.side * (sin * r)
    };
    frame.tube([a, b], [corner(0.0), corner(2.0 * FRAC_PI_3), corner(4.0 * FRAC_PI_3)], width)
}

/// Prism with its ridge towards `up`, and two faces that slope by 30 degrees to both sides of it. They and the floor
/// of half width h have a perimeter of 2h + 4h/√3, which over π is w.
pub(super) fn roof([a, b]: [DVec3; 2], up: DVec3, width: f64) -> Solid<6> {
    let half = width * PI / (2.0 + 4.0 / 3f64.sqrt());
    let rise = half / 3f64.sqrt();
    let frame = Frame::new([a, b], up);
    let floor = |side: f64| frame.side * (side * half) - frame.up * (0.5 * rise);
    frame.tube([a, b], [frame.up * (0.5 * rise), floor(1.0), floor(-1.0)], width)
}

/// Unit vectors along a line and across it, right-handed.
struct Frame {
    along: DVec3,
    up: DVec3,
    side: DVec3,
}

impl Frame {
    /// Frame with `up` as near to the given vector as possible.
    fn new([a, b]: [DVec3; 2], up: DVec3) -> Self {
        let along = (b - a).normalize_or(DVec3::X);
        let up = (up - along * along.dot(up)).try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
        Self { along, up, side: along.cross(up) }
    }

    /// Prism around a line, half a width longer at both ends; `ring` is its cross-section, from up to the side. Corners 0, 1, 2
    /// are around `a`, the others around `b`.
    fn tube(&self, [a, b]: [DVec3; 2], [p, q, r]: [DVec3; 3], width: f64) -> Solid<6> {
        const TRIANGLES: [[u32; 3]; 8] =
            [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
        let reach = self.along * (0.5 * width);
        let (a, b) = (a - reach, b + reach);
        Solid { corners: [a + p, a + q, a + r, b + p, b + q, b + r], triangles: &TRIANGLES }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Whether every edge is traversed once in each direction.
    fn is_closed(triangles: &[[u32; 3]]) -> bool {
        let mut walks: HashMap<(u32, u32), i32> = HashMap::new();
        for [a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *walks.entry((*from, *to)).or_default() += 1;
            }
        }
        walks.iter().all(|(&(a, b), &n)| n == 1 && walks.get(&(b, a)) == Some(&1))
    }

    /// Volume, positive when all faces point outwards, and surface area.
    fn measure<const N: usize>(solid: &Solid<N>) -> (f64, f64) {
        let faces = solid.triangles.iter().map(|t| t.map(|i| solid.corners[i as usize]));
        faces.fold((0.0, 0.0), |(volume, surface), [a, b, c]| {
            (volume + a.dot(b.cross(c)) / 6.0, surface + (b - a).cross(c - a).length() / 2.0)
        })
    }

    /// Outward unit normal of a face.
    fn outward<const N: usize>(solid: &Solid<N>, face: usize) -> DVec3 {
        let [a, b, c] = solid.triangles[face].map(|i| solid.corners[i as usize]);
        (b - a).cross(c - a).normalize()
    }

    #[test]
    fn solids_are_closed_and_look_outwards() {
        let (at, up) = (DVec3::new(3.0, -2.0, 5.0), DVec3::new(1.0, 2.0, -2.0) / 3.0);
        let (octahedron, tetrahedron) = (octahedron(at, 0.5), tetrahedron(at, 0.5));
        let ends = [at, at + DVec3::new(0.0, 4.0, 3.0)];
        let (prism, roof) = (prism(ends, 0.5), roof(ends, up, 0.5));
        assert!(is_closed(octahedron.triangles) && is_closed(tetrahedron.triangles) && is_closed(prism.triangles));
        let volumes = [measure(&octahedron).0, measure(&tetrahedron).0, measure(&prism).0, measure(&roof).0];
        assert!(volumes.iter().all(|v| *v > 0.01), "{volumes:?}");
    }

    #[test]
    fn solids_are_as_wide_as_the_ball_or_rod_they_stand_for() {
        let shadow_of_ball = PI * 0.25 * 0.09;
        for surface in [measure(&octahedron(DVec3::ONE, 0.3)).1, measure(&tetrahedron(DVec3::ONE, 0.3)).1] {
            assert!((surface / 4.0 - shadow_of_ball).abs() < 1e-12, "{surface}");
        }
        let ends = [DVec3::ZERO, DVec3::X * 7.0];
        for rod in [prism(ends, 0.3), roof(ends, DVec3::Z, 0.3)] {
            let corners = rod.corners;
            let perimeter: f64 = (0..3).map(|i| corners[i].distance(corners[(i + 1) % 3])).sum();
            assert!((perimeter / PI - 0.3).abs() < 1e-12, "{perimeter}");
            assert!((corners[0].x + 0.15).abs() < 1e-12 && (corners[5].x - 7.15).abs() < 1e-12, "{corners:?}");
        }
        assert!((measure(&square(DVec3::ONE, DVec3::X, 0.3)).1 - shadow_of_ball).abs() < 1e-12, "seen face on");
    }

    #[test]
    fn what_has_a_normal_looks_where_it_points() {
        let up = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        let square = square(DVec3::X, up, 0.1);
        assert!((outward(&square, 0) - up).length() < 1e-9 && (outward(&square, 1) - up).length() < 1e-9);
        // For a line that leans against the normal, the part of the normal across it counts.
        let roof = roof([DVec3::ZERO, DVec3::X], DVec3::new(0.6, 0.8, 0.0), 0.1);
        for face in [2, 3, 6, 7] {
            let cosine = outward(&roof, face).dot(DVec3::Y);
            assert!((cosine - 30f64.to_radians().cos()).abs() < 1e-9, "face {face}: {cosine}");
        }
        assert!((outward(&roof, 4) - DVec3::NEG_Y).length() < 1e-9);
    }
}
