//! Building blocks: surfaces of triangles, counter-clockwise seen from outside.

use crate::math::{DAffine3, DVec3, Vec3};
use crate::scene::Mesh;

/// A mesh under construction, in `f64` until it is handed over.
#[derive(Clone, Debug, Default)]
pub(super) struct Solid {
    pub(super) points: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Solid {
    /// Number of triangles.
    pub(super) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Adds a point and returns its index.
    pub(super) fn point(&mut self, p: DVec3) -> u32 {
        self.points.push(p);
        index(self.points.len() - 1)
    }

    pub(super) fn triangle(&mut self, a: u32, b: u32, c: u32) {
        self.triangles.push([a, b, c]);
    }

    /// Adds two triangles; the corners run around the quad.
    pub(super) fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Adds a transformed copy of another solid.
    pub(super) fn place(&mut self, other: &Self, at: &DAffine3) {
        let first = index(self.points.len());
        self.points.extend(other.points.iter().map(|p| at.transform_point3(*p)));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
    }

    /// Returns the finished mesh, its coordinates rounded to `f32`.
    pub(super) fn mesh(self, name: &str, material: u32) -> Mesh {
        let positions = self.points.into_iter().map(|p| -> Vec3 { p.as_vec3() }).collect();
        Mesh { name: name.into(), material, positions, triangles: self.triangles, ..Mesh::default() }
    }

    /// Builds a net of points, `rows` × `columns`, closed around the columns; each row runs counter-clockwise seen from the
    /// next. `at` gives the point of a row (0..=1) and turn (0..1); a row whose radius is zero becomes one point.
    fn net(rows: usize, columns: usize, at: impl Fn(f64, f64) -> DVec3, pole: impl Fn(usize) -> bool) -> Self {
        let mut solid = Self::default();
        let mut before: Vec<u32> = Vec::new();
        for row in 0..=rows {
            let s = row as f64 / rows as f64;
            let now: Vec<u32> = if pole(row) {
                vec![solid.point(at(s, 0.0)); columns]
            } else {
                (0..columns).map(|c| solid.point(at(s, c as f64 / columns as f64))).collect()
            };
            for column in 0..before.len() {
                let next = (column + 1) % columns;
                let corners = [before[column], before[next], now[next], now[column]];
                match (pole(row - 1), pole(row)) {
                    (false, false) => solid.quad(corners[0], corners[1], corners[2], corners[3]),
                    (true, _) => solid.triangle(corners[0], corners[2], corners[3]),
                    (_, true) => solid.triangle(corners[0], corners[1], corners[2]),
                }
            }
            before = now;
        }
        solid
    }

    /// Builds the surface of revolution of a profile of (radius, height), from the bottom up, around the z axis. Profiles may
    /// start and end on the axis; 2 · `rows` · `columns` triangles less one row's worth for each end that does.
    pub(super) fn lathe(rows: usize, columns: usize, profile: impl Fn(f64) -> (f64, f64)) -> Self {
        let at = |s: f64, turn: f64| {
            let (r, z) = profile(s);
            let (sin, cos) = turned(turn);
            DVec3::new(r * cos, r * sin, z)
        };
        let pole = |row: usize| profile(row as f64 / rows as f64).0 == 0.0;
        Self::net(rows, columns, at, pole)
    }

    /// Builds a sphere around the origin, (8 · 4^`level`) triangles: an octahedron whose faces are recursively cut into four.
    pub(super) fn sphere(radius: f64, level: u32) -> Self {
        let mut solid = Self::default();
        for [x, y, z] in (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 0 { 1.0 } else { -1.0 })) {
            let corners = [DVec3::X * x, DVec3::Y * y, DVec3::Z * z];
            let [a, b, c] = if x * y * z > 0.0 { corners } else { [corners[1], corners[0], corners[2]] };
            solid.facet([a, b, c], 1 << level, radius);
        }
        solid
    }

    /// Adds a face of the unit octahedron, cut into `n`² triangles and projected onto the sphere.
    fn facet(&mut self, [a, b, c]: [DVec3; 3], n: u32, radius: f64) {
        let first = index(self.points.len());
        for row in 0..=n {
            for column in 0..=row {
                let (v, w) = (f64::from(row - column) / f64::from(n), f64::from(column) / f64::from(n));
                self.point((a * (1.0 - v - w) + b * v + c * w).normalize() * radius);
            }
        }
        let at = |row: u32, column: u32| first + row * (row + 1) / 2 + column;
        for row in 0..n {
            for column in 0..=row {
                self.triangle(at(row, column), at(row + 1, column), at(row + 1, column + 1));
                if column < row {
                    self.triangle(at(row, column), at(row + 1, column + 1), at(row, column + 1));
                }
            }
        }
    }

    /// Builds a tube along `path` (0..=1) of radius `radius`, open at both ends: 2 · `rows` · `columns` triangles. The path must
    /// not run along `side`.
    pub(super) fn tube(
        rows: usize,
        columns: usize,
        side: DVec3,
        path: impl Fn(f64) -> DVec3,
        radius: impl Fn(f64) -> f64,
    ) -> Self {
        let at = |s: f64, turn: f64| {
            let step = 1e-4;
            let along = (path((s + step).min(1.0)) - path((s - step).max(0.0))).normalize();
            let across = along.cross(side).normalize();
            let (sin, cos) = turned(turn);
            path(s) + (across * cos + along.cross(across) * sin) * radius(s)
        };
        Self::net(rows, columns, at, |_| false)
    }
}

/// Sine and cosine of an angle in turns.
pub(super) fn turned(turns: f64) -> (f64, f64) {
    let angle = turns * std::f64::consts::TAU;
    (libm::sin(angle), libm::cos(angle))
}

#[expect(clippy::cast_possible_truncation, reason = "sizes are limited to 10 million triangles")]
fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume enclosed by closed surfaces; positive when they face outwards.
    fn volume(solid: &Solid) -> f64 {
        let p = |i: u32| solid.points[i as usize];
        solid.triangles.iter().map(|&[a, b, c]| p(a).dot(p(b).cross(p(c)))).sum::<f64>() / 6.0
    }

    #[test]
    fn a_sphere_has_its_volume_and_faces_outwards() {
        let sphere = Solid::sphere(2.0, 5);
        assert_eq!(sphere.len(), 8 * 1024);
        let full = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        assert!((volume(&sphere) / full - 1.0).abs() < 3e-3, "{}", volume(&sphere));
    }

    #[test]
    fn a_lathe_closes_at_the_axis_and_faces_outwards() {
        let cone = Solid::lathe(8, 64, |s| {
            if s == 1.0 {
                (0.0, 1.0)
            } else if s == 0.0 {
                (0.0, 0.0)
            } else {
                (1.0 - s, s)
            }
        });
        assert_eq!(cone.len(), 2 * 8 * 64 - 2 * 64);
        assert!(volume(&cone) > 0.0);
    }

    #[test]
    fn a_tube_faces_outwards() {
        let tube = Solid::tube(4, 32, DVec3::X, |s| DVec3::Z * s, |_| 0.5);
        // The open end at z = 0 contributes nothing, the one at z = 1 lacks π r²/3.
        let expected = std::f64::consts::PI * 0.25 * 2.0 / 3.0;
        assert!((volume(&tube) / expected - 1.0).abs() < 0.02, "{}", volume(&tube));
    }
}
