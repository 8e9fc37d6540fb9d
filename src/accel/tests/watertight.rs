//! Closed meshes let no ray out.

use super::scenes::{ray, star};
use crate::accel::*;
use crate::math::Vec3;
use crate::math::random::Random;

/// Rays from inside towards corners, edge midpoints and edge points of a closed mesh.
fn aimed(shapes: &Shapes, n: usize) -> Vec<Ray> {
    let mut r = Random::new(6);
    let mut rays = Vec::new();
    for _ in 0..n {
        let origin = r.cube() * 0.5;
        let [a, b, _] = shapes.triangles[r.below(shapes.triangles.len())].map(|i| shapes.vertices[i as usize]);
        let s = r.unit();
        for target in [a, (a + b) * 0.5, a + (b - a) * s] {
            rays.push(ray(origin, target - origin));
        }
    }
    rays
}

fn assert_nothing_escapes(shapes: &Shapes, rays: &[Ray]) {
    let found = |accel: &dyn Fn(&mut [Hit])| {
        let mut hits = vec![Hit::MISS; rays.len()];
        accel(&mut hits);
        hits
    };
    let grid: GridOctree = GridOctree::build(shapes, &GridParams::default());
    let trees = [Splitting::Octree, Splitting::SurfaceArea].map(|s| Wide::build(shapes, s));
    let answers = [
        found(&|hits| grid.closest(rays, hits, &mut grid.scratch(), &mut NoProbe)),
        found(&|hits| trees[0].closest(rays, hits, &mut trees[0].scratch(), &mut NoProbe)),
        found(&|hits| trees[1].closest(rays, hits, &mut trees[1].scratch(), &mut NoProbe)),
    ];
    for (structure, hits) in answers.iter().enumerate() {
        let escaped: Vec<_> = rays.iter().zip(hits).filter(|(_, h)| !h.is_some()).collect();
        assert!(
            escaped.is_empty(),
            "{} of {} through structure {structure}: {:?}",
            escaped.len(),
            rays.len(),
            escaped[0]
        );
    }
}

#[test]
fn no_ray_aimed_at_corners_and_edges_escapes_from_a_closed_mesh() {
    let shapes = star(100, 50);
    let rays = aimed(&shapes, 10_000);
    assert_nothing_escapes(&shapes, &rays);
}

#[test]
fn no_ray_through_a_corner_or_edge_of_a_lattice_escapes() {
    // A closed box of unit squares; every ray passes exactly through lattice points.
    let mut shapes = Shapes::default();
    for axis in 0..3 {
        for (side, u, v) in (0..2).flat_map(|s| (0..4).flat_map(move |u| (0..4).map(move |v| (s, u, v)))) {
            let corner = |du: u32, dv: u32| {
                let mut p = Vec3::ZERO;
                p[axis] = side as f32 * 4.0;
                p[(axis + 1) % 3] = (u + du) as f32;
                p[(axis + 2) % 3] = (v + dv) as f32;
                p - 2.0
            };
            let base = shapes.vertices.len() as u32;
            shapes.vertices.extend([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
            shapes.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        }
    }
    let mut rays = Vec::new();
    for x in -2..=2 {
        for (y, z) in (-2..=2).flat_map(|y| (-2..=2).map(move |z| (y, z))) {
            let target = Vec3::new(x as f32, y as f32, z as f32);
            for origin in [Vec3::ZERO, Vec3::ONE, Vec3::new(0.5, -1.0, 0.25)] {
                rays.push(ray(origin, target - origin));
            }
        }
    }
    rays.retain(|r| r.dir != Vec3::ZERO);
    assert_nothing_escapes(&shapes, &rays);
}

#[test]
fn only_the_test_that_is_not_watertight_loses_rays_at_corners() {
    let shapes = star(100, 50);
    let rays = aimed(&shapes, 10_000);
    let missed = |test| {
        let accel = AnyAccel::build(AccelKind::DEFAULT, &shapes, &AccelParams::DEFAULT).tested_by(test);
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.closest(&rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
        hits.iter().filter(|h| !h.is_some()).count()
    };
    let missed = IntersectorKind::ALL.map(missed);
    assert_eq!(missed[..3], [0, 0, 0], "exact, watertight, watertight-double");
    assert!(missed[3] > 10 && missed[4] > 10, "{missed:?}: the comparison would show nothing");
}
