//! Closed meshes let nothing out.

use super::scenes::{Random, ray, star};
use crate::accel::*;
use crate::math::Vec3;

/// Rays from inside towards corners, edge midpoints and edge points of a closed mesh.
fn aimed(shapes: &Shapes, n: usize) -> Vec<Ray> {
    let mut r = Random(6);
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

#[test]
fn no_ray_aimed_at_corners_and_edges_escapes_from_a_closed_mesh() {
    let shapes = star(100, 50);
    let rays = aimed(&shapes, 10_000);
    let grid: GridOctree = GridOctree::build(&shapes, &GridParams::default());
    let mut hits = vec![Hit::MISS; rays.len()];
    grid.closest(&rays, &mut hits, &mut grid.scratch(), &mut NoProbe);
    assert_eq!(hits.iter().filter(|h| !h.is_some()).count(), 0, "of {} rays", rays.len());
}

#[test]
fn no_ray_through_a_corner_or_edge_of_a_lattice_escapes() {
    // A closed box of unit squares; every ray runs exactly through lattice points.
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
    let grid: GridOctree = GridOctree::build(&shapes, &GridParams::default());
    let mut hits = vec![Hit::MISS; rays.len()];
    grid.closest(&rays, &mut hits, &mut grid.scratch(), &mut NoProbe);
    for (ray, hit) in rays.iter().zip(&hits) {
        assert!(hit.is_some(), "{ray:?}");
    }
}
