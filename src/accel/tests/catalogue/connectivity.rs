//! No ray slips between prims that share an edge or a corner, and no gap is closed.

use std::f32::consts::TAU;

use super::super::scenes::{mesh, moved, ray, star};
use super::*;
use crate::math::random::Random;
use crate::math::triangle;

/// C1 (shared edge).
#[test]
fn every_point_of_the_diagonal_of_a_square_is_hit_and_lies_in_its_plane() {
    let corners = [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)];
    let shapes = mesh(corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
    let origin = Vec3::new(0.0, 0.0, 10.0);
    let mut rays: Vec<Ray> = (-5120..=5120)
        .step_by(count(8, 1))
        .map(|i| i as f32 / 1024.0)
        .map(|x| towards(origin, Vec3::new(x, x, 0.0)))
        .collect();
    // Direction from a bug report about a ray that slipped through.
    rays.push(ray(origin, Vec3::new(0.304_584_47, 0.304_584_47, -0.902_472_5)));
    let ulp_of_ten = f64::from(10f32.next_up()) - 10.0;
    with_every_kind(&shapes, |kind, accel| {
        for (ray, hit) in rays.iter().zip(closest(accel, &rays)) {
            assert!(hit.is_some(), "{kind}: {ray:?}");
            let z = 10.0 + f64::from(hit.t) * f64::from(ray.dir.z);
            assert!(z.abs() <= 2.0 * ulp_of_ten, "{kind}: z = {z} of {ray:?}");
        }
    });
}

/// C2 (vertex fan).
#[test]
fn the_middle_of_a_fan_is_hit_from_every_direction_above_it() {
    let mut r = Random::new(21);
    for n in 3..=64u32 {
        let ring = (0..n).map(|i| TAU * i as f32 / n as f32).map(|a| Vec3::new(a.cos(), a.sin(), 0.0));
        let tip = Vec3::new(0.1, -0.05, 0.2);
        let shapes =
            mesh(std::iter::once(tip).chain(ring).collect(), (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect());
        let from = |r: &mut Random| (r.cube() * Vec3::new(1.0, 1.0, 0.5) + Vec3::Z * 2.0) * 3.0;
        let rays: Vec<Ray> = (0..count(60, 16_000)).map(|_| towards(from(&mut r), tip)).collect();
        with_every_kind(&shapes, |kind, accel| {
            let missed = closest(accel, &rays).iter().filter(|h| !h.is_some()).count();
            assert_eq!(missed, 0, "{kind}, {n} triangles");
        });
    }
}

/// Rays from inside a star towards its corners, edge midpoints, random points of edges and random points.
fn outwards(shapes: &Shapes, center: Vec3, n: usize) -> Vec<Ray> {
    let mut r = Random::new(22);
    let mut rays = Vec::new();
    for _ in 0..n {
        let origin = center + r.direction() * (0.89 * r.unit());
        let [a, b, _] = shapes.triangle(r.below(shapes.triangles.len()) as u32);
        let s = r.unit();
        rays.extend([a, (a + b) * 0.5, a + (b - a) * s].map(|target| towards(origin, target)));
        rays.push(ray(origin, r.direction()));
    }
    rays
}

/// Asserts that every ray hits; slow structures get only some of the rays.
fn assert_nothing_escapes(what: &str, shapes: &Shapes, rays: &[Ray]) {
    with_every_kind(shapes, |kind, accel| {
        let rays = if kind.is_slow() { &rays[..rays.len().min(count(100, 10_000))] } else { rays };
        let escaped = closest(accel, rays).iter().filter(|h| !h.is_some()).count();
        assert_eq!(escaped, 0, "{what}, {kind}: of {}", rays.len());
    });
}

fn closed_star() -> Shapes {
    if is_long() { star(400, 200) } else { star(60, 30) }
}

/// C3 (closed star mesh).
#[test]
fn nothing_escapes_from_a_closed_mesh() {
    let shapes = closed_star();
    assert_nothing_escapes("star", &shapes, &outwards(&shapes, Vec3::ZERO, count(1500, 2_000_000)));
}

/// C4 (offsets). The mesh is rounded at its offset position, and stays closed.
#[test]
fn nothing_escapes_from_a_closed_mesh_far_from_the_origin() {
    for offset in [1e3, 1e5] {
        let center = Vec3::new(1.0, 0.7, 1.3) * offset;
        let shapes = moved(closed_star(), 1.0, center);
        assert_nothing_escapes(&format!("{offset}"), &shapes, &outwards(&shapes, center, count(700, 2_000_000)));
    }
}

/// C5 (parity).
#[test]
fn a_ray_enters_and_leaves_a_closed_mesh_in_turn() {
    let shapes = if is_long() { star(400, 200) } else { star(40, 20) };
    let mut r = Random::new(23);
    let rays: Vec<Ray> = (0..count(150, 20_000)).map(|_| towards(r.direction() * 3.0, r.cube())).collect();
    with_every_kind(&shapes, |kind, accel| {
        if kind.is_slow() && (kind != AccelKind::None || is_long()) {
            return;
        }
        let mut crossed = 0;
        for &ray in &rays {
            let hits = every_hit(accel, ray);
            assert_eq!(hits.len() % 2, 0, "{kind}: {ray:?} {hits:?}");
            // The outward sides of the star's triangles are their front sides.
            let entering = |h: &Hit| triangle::normal(&shapes.triangle(h.prim)).dot(ray.dir) < 0.0;
            let in_turn = hits.iter().enumerate().all(|(i, h)| entering(h) == (i % 2 == 0));
            let tie = hits.windows(2).any(|h| h[0].t == h[1].t);
            assert!(in_turn || tie, "{kind}: {ray:?} {hits:?}");
            crossed += hits.len();
        }
        assert!(crossed > rays.len(), "{kind}: {crossed}");
    });
}

/// C6 (T-junction). A corner that misses the edge by rounding leaves a gap, which is open exactly as far as it extends.
#[test]
fn a_t_junction_is_as_open_as_exact_arithmetic_says() {
    let (a, b) = (Vec3::new(-0.913, 0.137, 0.731), Vec3::new(1.171, -0.319, -0.577));
    let (top, bottom) = (Vec3::new(0.1, 2.0, 0.3), Vec3::new(0.2, -2.0, -0.1));
    let middle = a + (b - a) * 0.37;
    let shapes = mesh(vec![a, b, top, bottom, middle], vec![[0, 1, 2], [0, 3, 4], [4, 3, 1]]);
    let mut r = Random::new(24);
    let rays: Vec<Ray> = (0..count(3000, 300_000))
        .map(|_| towards(r.cube() + Vec3::Z * 3.0, a + (b - a) * (0.02 + 0.96 * r.unit())))
        .collect();
    let hits = assert_exact("T-junction", &shapes, &rays, 0.501);
    assert!(hits < rays.len() && hits > rays.len() / 2, "{hits} of {}: the gap is not seen", rays.len());
}

/// C7 (open edge).
#[test]
fn the_border_of_an_open_strip_is_hit_exactly_where_it_is() {
    // A strip with half a twist.
    let n = 48u32;
    let point = |i: u32, side: f32| {
        let turn = TAU * i as f32 / n as f32;
        let arm = 1.0 + side * 0.4 * (turn / 2.0).cos();
        Vec3::new(arm * turn.cos(), arm * turn.sin(), side * 0.4 * (turn / 2.0).sin())
    };
    let vertices: Vec<Vec3> = (0..n).flat_map(|i| [point(i, -1.0), point(i, 1.0)]).collect();
    let at = |i: u32, side: u32| if i < n { 2 * i + side } else { 1 - side };
    let triangles =
        (0..n).flat_map(|i| [[at(i, 0), at(i, 1), at(i + 1, 1)], [at(i, 0), at(i + 1, 1), at(i + 1, 0)]]).collect();
    let shapes = mesh(vertices.clone(), triangles);
    let mut r = Random::new(25);
    let mut rays = Vec::new();
    for _ in 0..count(700, 100_000) {
        let (i, side, origin) = (r.below(n as usize) as u32, r.below(2) as u32, r.direction() * 3.0);
        let [p, q] = [at(i, side), at(i + 1, side)].map(|v| vertices[v as usize]);
        rays.extend([p, (p + q) * 0.5, p + (q - p) * r.unit()].map(|target| towards(origin, target)));
    }
    let hits = assert_exact("strip", &shapes, &rays, 0.501);
    assert!(hits < rays.len() * 9 / 10 && hits > rays.len() / 4, "{hits} of {}", rays.len());
}

/// C8 (coordinates rounded to integers).
#[test]
fn rays_along_the_axes_through_corners_of_an_integer_mesh_miss_nothing() {
    let mut shapes = star(if is_long() { 200 } else { 24 }, if is_long() { 100 } else { 12 });
    shapes.vertices.iter_mut().for_each(|v| *v = (*v * 32.0).round());
    let mut rays = Vec::new();
    for v in &shapes.vertices {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            rays.extend([axis, -axis].map(|dir| ray(*v - dir * 100.0, dir)));
        }
    }
    let hits = assert_exact("integers", &shapes, &rays, 0.501);
    // All but the rays that only touch an outline whose triangles are seen edge-on.
    assert!(hits > rays.len() * 9 / 10, "{hits} of {}", rays.len());
}

/// C9 (coincident faces).
#[test]
fn two_boxes_that_share_a_face_are_hit_there_twice_in_order_of_their_prims() {
    let mut shapes = Shapes::default();
    for x in [-1.0f32, 0.0] {
        let base = shapes.vertices.len() as u32;
        shapes.vertices.extend((0..8).map(|i| Vec3::new(x + (i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)));
        let quads = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
        for [a, b, c, d] in quads.map(|q| q.map(|i: u32| base + i)) {
            shapes.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let shapes = mesh(shapes.vertices, shapes.triangles);
    let mut r = Random::new(26);
    for _ in 0..count(60, 5000) {
        let through = Vec3::new(0.0, 0.1 + 0.3 * r.unit(), 0.5 + 0.4 * r.unit());
        let dir = Vec3::new(1.0, 0.25 * (r.unit() - 0.5), 0.25 * (r.unit() - 0.5));
        let ray = ray(through - dir * 4.0, dir);
        with_every_kind(&shapes, |kind, accel| {
            let hits = every_hit(accel, ray);
            let shared: Vec<&Hit> =
                hits.iter().filter(|h| shapes.triangle(h.prim).iter().all(|p| p.x == 0.0)).collect();
            let [first, second] = shared[..] else { panic!("{kind}: {ray:?} {hits:?}") };
            assert!(first.t == second.t && first.prim < second.prim, "{kind}: {first:?} {second:?}");
            assert_eq!(hits.len(), 4, "{kind}: {hits:?}");
        });
    }
}
