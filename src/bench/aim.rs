//! Kinds of rays that stress the watertightness of a mesh.

use crate::accel::{Ray, Shapes};
use crate::math::Vec3;
use crate::math::random::Random;
use crate::math::triangle;

/// Target of the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// A corner of a triangle.
    Corners,
    /// The middle of an edge.
    EdgeMiddles,
    /// Any point of an edge.
    Edges,
    /// Direction within the plane of a triangle, through it.
    InPlane,
    /// Across a triangle, at an angle of 10⁻¹ to 10⁻⁷ to its plane.
    Grazing,
    /// Any point in the bounding box of the mesh.
    Random,
}

impl Aim {
    /// All kinds, in the order of reports.
    pub const ALL: [Self; 6] =
        [Self::Corners, Self::EdgeMiddles, Self::Edges, Self::InPlane, Self::Grazing, Self::Random];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Corners => "corners",
            Self::EdgeMiddles => "edge middles",
            Self::Edges => "edges",
            Self::InPlane => "in plane",
            Self::Grazing => "grazing",
            Self::Random => "random",
        }
    }
}

/// Generator of rays for one set of triangles, in the frame of its vertices.
#[derive(Clone, Debug)]
pub struct Aimer<'a> {
    shapes: &'a Shapes,
    middle: Vec3,
    /// Half the diagonal of the mesh's bounding box.
    reach: f32,
    random: Random,
}

impl<'a> Aimer<'a> {
    /// Generator for a mesh; `None` if it has no triangles.
    pub fn new(shapes: &'a Shapes, seed: u64) -> Option<Self> {
        if shapes.triangles.is_empty() {
            return None;
        }
        let corners = shapes.triangles.iter().flatten().map(|&i| shapes.vertices[i as usize]);
        let (lo, hi) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        // Squares of very large or very small lengths overflow or vanish in `f32`.
        #[expect(clippy::cast_possible_truncation, reason = "no longer than a few times the mesh")]
        let reach = (hi * 0.5 - lo * 0.5).as_dvec3().length() as f32;
        Some(Self { shapes, middle: lo * 0.5 + hi * 0.5, reach, random: Random::new(seed) })
    }

    /// The same generator with another random sequence.
    #[must_use]
    pub fn reseeded(&self, seed: u64) -> Self {
        Self { random: Random::new(seed), ..*self }
    }

    /// Generates `count` rays.
    pub fn rays(&mut self, aim: Aim, count: usize) -> Vec<Ray> {
        (0..count).map(|i| self.ray(aim, i)).collect()
    }

    fn ray(&mut self, aim: Aim, i: usize) -> Ray {
        let t = self.shapes.triangle(u32::try_from(self.random.below(self.shapes.triangles.len())).unwrap_or(0));
        let [a, b, c] = t;
        let (r, s) = (self.random.unit(), self.random.unit());
        let at = |target: Vec3, origin: Vec3| Ray::new(origin, target - origin);
        match aim {
            Aim::Corners => at(a, self.start(i)),
            Aim::EdgeMiddles => at((a + b) * 0.5, self.start(i)),
            Aim::Edges => at(a + (b - a) * r, self.start(i)),
            Aim::InPlane => {
                let dir = (b - a) * (r - 0.5) + (c - a) * (s - 0.5);
                Ray::new(triangle::within(&t, r, s) - dir * self.strides(dir), dir)
            }
            Aim::Grazing => {
                let tilt = libm::powf(10.0, -1.0 - 6.0 * self.random.unit());
                let along = ((b - a) * (r - 0.5) + (c - a) * (s - 0.5)).normalize_or(Vec3::X);
                let dir = along + triangle::normal(&t) * tilt;
                Ray::new(triangle::within(&t, s, r) - dir * self.reach, dir)
            }
            Aim::Random => at(self.middle + self.random.cube() * self.reach, self.start(i)),
        }
    }

    /// Random origin, alternately inside and outside the mesh's bounding box.
    fn start(&mut self, i: usize) -> Vec3 {
        let distance = if i.is_multiple_of(2) { 0.5 } else { 2.5 };
        self.middle + self.random.direction() * (distance * self.reach)
    }

    /// Half the diagonal of the mesh in lengths of `dir`; 1 if `dir` has no length.
    fn strides(&self, dir: Vec3) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "an estimate")]
        let strides = (f64::from(self.reach) / dir.as_dvec3().length()) as f32;
        if strides.is_finite() { strides } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::bench::oracle::Oracle;

    #[test]
    fn rays_at_the_smallest_and_largest_meshes_hit_them() {
        for scale in [1e-30, 1e24] {
            let shapes = scenes::moved(scenes::star(24, 16), scale, Vec3::ZERO);
            let oracle = Oracle::new(&shapes);
            let mut aimer = Aimer::new(&shapes, 1).unwrap();
            for aim in [Aim::Corners, Aim::InPlane, Aim::Random] {
                let rays = aimer.rays(aim, 60);
                let hits = rays.iter().filter(|r| oracle.nearest(r).is_some()).count();
                assert!(hits > 30, "{scale}, {}: {hits} hits", aim.name());
            }
        }
    }

    #[test]
    fn rays_of_every_kind_are_finite_and_most_pass_near_the_mesh() {
        let shapes = scenes::star(24, 16);
        let oracle = Oracle::new(&shapes);
        let mut aimer = Aimer::new(&shapes, 1).unwrap();
        for aim in Aim::ALL {
            let rays = aimer.rays(aim, 200);
            assert!(rays.iter().all(|r| r.origin.is_finite() && r.dir.is_finite() && r.dir != Vec3::ZERO));
            let hits = rays.iter().filter(|r| oracle.nearest(r).is_some()).count();
            assert!(hits > 100, "{}: {hits} hits", aim.name());
        }
    }

    #[test]
    fn nothing_can_be_aimed_at_without_triangles() {
        assert!(Aimer::new(&Shapes::default(), 1).is_none());
    }
}
