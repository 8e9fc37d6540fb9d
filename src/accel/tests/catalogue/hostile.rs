//! Hostile scenes and rays: coordinates of all exponents, lattice points and their neighbours, rays aimed at all of them.
//!
//! Every structure gives the answers of brute force bit for bit, and the first hit is that of exact arithmetic.

use super::super::scenes::mesh;
use super::*;
use crate::math::random::Random;

/// Distribution of the coordinates of a scene.
#[derive(Clone, Copy, Debug)]
enum Coordinates {
    /// Every exponent from 2⁻¹⁰⁰ to 2¹⁰⁰, equally likely.
    AllExponents,
    /// Small integers and their neighbouring floats.
    Lattice,
    /// All near one place, whose magnitude differs from their distances.
    Crowded,
}

impl Coordinates {
    const ALL: [Self; 3] = [Self::AllExponents, Self::Lattice, Self::Crowded];

    fn draw(self, r: &mut Random) -> f32 {
        let signed = r.unit() * 2.0 - 1.0;
        match self {
            Self::AllExponents => signed * 2.0f32.powi(r.below(201) as i32 - 100),
            Self::Lattice => {
                let x = (signed * 4.0).round();
                [x, x, x, x.next_up(), x.next_down(), -x][r.below(6)]
            }
            Self::Crowded => [1000.0, 1000.0 + signed * 0.01, 1000.0 + signed * 1e-4, 1000.0 + signed][r.below(4)],
        }
    }

    fn point(self, r: &mut Random) -> Vec3 {
        Vec3::new(self.draw(r), self.draw(r), self.draw(r))
    }
}

/// Triangles with such corners, some of them shared.
fn scene(coordinates: Coordinates, r: &mut Random) -> Shapes {
    let n = 1 + r.below(40) as u32;
    let corners = 3 + r.below(60);
    let vertices: Vec<Vec3> = (0..corners).map(|_| coordinates.point(r)).collect();
    let triangles = (0..n).map(|_| [0; 3].map(|_: u32| r.below(corners) as u32)).collect();
    mesh(vertices, triangles)
}

/// Rays from random points, aimed at corners, edges, faces and random points.
fn aimed(coordinates: Coordinates, shapes: &Shapes, n: usize, r: &mut Random) -> Vec<Ray> {
    let mut rays = Vec::new();
    for i in 0..n {
        let [a, b, c] = shapes.triangle(r.below(shapes.triangles.len()) as u32);
        let s = r.unit();
        let target = [a, (a + b) * 0.5, a + (b - a) * s, (a + b + c) / 3.0, coordinates.point(r)][i % 5];
        let origin =
            if r.below(4) == 0 { shapes.vertices[r.below(shapes.vertices.len())] } else { coordinates.point(r) };
        let ray = towards(origin, target);
        rays.push(match r.below(6) {
            0 => Ray { t_min: 1.0, ..ray },
            1 => Ray { t_max: 1.0, ..ray },
            2 => Ray { exclude: r.below(shapes.len()) as u32, ..ray },
            _ => ray,
        });
    }
    rays
}

#[test]
fn hostile_scenes_and_rays_are_answered_as_by_brute_force_and_exact_arithmetic() {
    for coordinates in Coordinates::ALL {
        let mut hits = 0;
        for seed in 0..count(25, 5000) as u64 {
            let mut r = Random::new(600 + seed);
            let shapes = scene(coordinates, &mut r);
            let rays = aimed(coordinates, &shapes, 40, &mut r);
            let what = format!("{coordinates:?}, seed {seed}");
            // Ranges apply to rounded distances, and the oracle knows only one of several copies.
            let whole: Vec<Ray> = rays.iter().map(|r| ray(r.origin, r.dir)).collect();
            hits += assert_exact(&what, &shapes, &whole, 0.501);
            assert_all_agree(&what, &shapes, &rays);
        }
        assert!(hits > 100, "{coordinates:?}: {hits}");
    }
}
