//! Verdicts and distances of ill-conditioned input. Two cases are elsewhere: P4 (moved far away) with whole pictures in the
//! tests of the program, P9 (spheres) beside the sphere's test.

use super::super::scenes::{mesh, moved, ray, rays, seal, soup, star};
use super::*;
use crate::math::random::Random;
use crate::math::triangle;

/// P1 (slivers). Distances are those of exact arithmetic, rounded once: well within the required 4 ulp.
#[test]
fn slivers_are_hit_where_they_are_at_the_right_distance() {
    let mut r = Random::new(51);
    for exponent in 3..=8 {
        let aspect = libm::powf(10.0, exponent as f32);
        let mut vertices = Vec::new();
        for _ in 0..30 {
            let (a, along, aside) = (r.cube(), r.direction(), r.direction());
            vertices.extend([a, a + along, a + along * r.unit() + aside / aspect]);
        }
        let shapes = mesh(vertices, (0..30).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
        let aim = |r: &mut Random| {
            let [a, b, c] = shapes.triangle(r.below(30) as u32);
            let (s, t) = (r.unit(), r.unit() * 0.5);
            towards(r.direction() * 3.0, a + ((b - a) * (1.0 - t) + (c - a) * t) * s)
        };
        let rays: Vec<Ray> = (0..count(300, 100_000)).map(|_| aim(&mut r)).collect();
        let hits = assert_exact(&format!("1 : {aspect}"), &shapes, &rays, 0.501);
        assert!(hits > 0 || exponent > 6, "1 : {aspect}: {hits}");
    }
}

/// P2 (grazing).
#[test]
fn grazing_rays_hit_where_exact_arithmetic_says() {
    let shapes = star(16, 10);
    let mut r = Random::new(52);
    let mut rays = Vec::new();
    for i in 0..count(500, 100_000) {
        let t = shapes.triangle(r.below(shapes.triangles.len()) as u32);
        let along = ((t[1] - t[0]) * (r.unit() - 0.5) + (t[2] - t[0]) * (r.unit() - 0.5)).normalize_or(Vec3::X);
        let dir = along + triangle::normal(&t) * libm::powf(10.0, -1.0 - (i % 7) as f32);
        rays.push(ray((t[0] + t[1] + t[2]) / 3.0 - dir, dir));
    }
    assert!(assert_exact("grazing", &shapes, &rays, 0.501) > rays.len() / 2);
}

/// P3 (scales).
#[test]
fn parts_of_every_size_in_one_scene_are_hit_alike() {
    let mut all = Shapes::default();
    let mut targets = Vec::new();
    for exponent in -6..=6 {
        let size = libm::powf(10.0, exponent as f32);
        let part = moved(soup(20, 0.9), size, Vec3::new(3.0, -2.0, 2.5) * size);
        let base = all.vertices.len() as u32;
        targets.push((base as usize, size));
        all.vertices.extend(part.vertices);
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    let shapes = mesh(all.vertices, all.triangles);
    let mut r = Random::new(53);
    let aim = |i: usize| {
        let (base, size) = targets[i % targets.len()];
        let target = shapes.vertices[base + r.below(60)] + r.cube() * (0.05 * size);
        towards(target + r.direction() * (size * 4.0), target)
    };
    let rays: Vec<Ray> = (0..count(600, 60_000)).map(aim).collect();
    let hits = assert_exact("scales", &shapes, &rays, 0.501);
    assert!(hits > rays.len() / 8, "{hits} of {}", rays.len());
    assert_all_agree("scales", &shapes, &rays);
}

/// P5 (scaling by powers of two).
#[test]
fn a_scene_scaled_by_a_power_of_two_gives_the_same_bits() {
    let shapes = soup(200, 0.5);
    let rays = rays(&shapes, 5);
    for k in (-20..=20).step_by(count(8, 1)) {
        let scale = 2.0f32.powi(k);
        let larger = moved(shapes.clone(), scale, Vec3::ZERO);
        let scaled: Vec<Ray> =
            rays.iter().map(|r| Ray { origin: r.origin * scale, dir: r.dir * scale, ..*r }).collect();
        // A ray with a component so small that it loses bits is a different ray.
        let kept: Vec<bool> =
            rays.iter().zip(&scaled).map(|(a, b)| b.dir / scale == a.dir && b.origin / scale == a.origin).collect();
        let [expected, got] = [answers(&Unculled::new(&shapes), &rays), answers(&Unculled::new(&larger), &scaled)];
        assert!(kept.iter().filter(|k| **k).count() > rays.len() / 2);
        assert!(kept.iter().zip(expected.iter().zip(&got)).all(|(kept, (a, b))| !kept || a == b), "2^{k}");
        assert_all_agree(&format!("2^{k}"), &larger, &scaled);
    }
}

/// P6 (axes permuted and mirrored).
#[test]
fn exchanged_and_mirrored_axes_give_the_same_hits() {
    let shapes = soup(200, 0.5);
    let rays: Vec<Ray> = rays(&shapes, 6);
    let expected = closest(&Unculled::new(&shapes), &rays);
    let turns: [fn(Vec3) -> Vec3; 4] = [
        |v| Vec3::new(v.y, v.z, v.x),
        |v| Vec3::new(v.z, v.y, v.x),
        |v| v * Vec3::new(-1.0, 1.0, 1.0),
        |v| Vec3::new(-v.y, -v.x, -v.z),
    ];
    for (i, turn) in turns.into_iter().enumerate() {
        let mut turned = shapes.clone();
        turned.vertices.iter_mut().for_each(|v| *v = turn(*v));
        let rays: Vec<Ray> = rays.iter().map(|r| Ray { origin: turn(r.origin), dir: turn(r.dir), ..*r }).collect();
        with_every_kind(&turned, |kind, accel| {
            for ((ray, a), b) in rays.iter().zip(&expected).zip(closest(accel, &rays)) {
                assert_eq!((a.t.to_bits(), a.prim), (b.t.to_bits(), b.prim), "turn {i}, {kind}: {ray:?}");
            }
        });
    }
}

/// P7 (corners rotated).
#[test]
fn turned_corners_give_the_same_distance_and_turned_weights() {
    let shapes = soup(200, 0.5);
    let rays = rays(&shapes, 6);
    let mut turned = shapes.clone();
    turned.triangles.iter_mut().for_each(|t| t.rotate_left(1));
    let expected = closest(&Unculled::new(&shapes), &rays);
    with_every_kind(&turned, |kind, accel| {
        for ((ray, a), b) in rays.iter().zip(&expected).zip(closest(accel, &rays)) {
            assert_eq!((a.t.to_bits(), a.prim), (b.t.to_bits(), b.prim), "{kind}: {ray:?}");
            // Corner 1 of one triangle is corner 0 of the other: weights of b, c become those of a, b.
            let (weight_of_a, last) = (1.0 - a.u - a.v, 1.0 - b.u - b.v);
            let near = |x: f32, y: f32| (x - y).abs() <= f32::EPSILON;
            assert!(!a.is_some() || near(a.u, last) && near(a.v, b.u) && near(weight_of_a, b.v), "{kind}: {a:?} {b:?}");
        }
    });
}

/// P8 (length of the direction).
#[test]
fn a_direction_twice_as_long_halves_the_distance_exactly() {
    let shapes = soup(200, 0.5);
    let rays: Vec<Ray> = rays(&shapes, 6).into_iter().map(|r| ray(r.origin, r.dir)).collect();
    let longer: Vec<Ray> = rays.iter().map(|r| ray(r.origin, r.dir * 2.0)).collect();
    with_every_kind(&shapes, |kind, accel| {
        for ((a, b), ray) in closest(accel, &rays).iter().zip(closest(accel, &longer)).zip(&rays) {
            let tiny = a.t.abs() < f32::MIN_POSITIVE * 2.0 || !a.is_some();
            assert!(a.prim == b.prim && (tiny || a.t == b.t * 2.0), "{kind}: {a:?} {b:?} {ray:?}");
        }
    });
}

/// P10 (single and double precision).
#[test]
fn tests_in_double_precision_hit_the_same_prims_away_from_edges() {
    let shapes = star(60, 30);
    let mut r = Random::new(54);
    let rays: Vec<Ray> = (0..count(4000, 4_000_000)).map(|_| towards(r.direction() * 3.0, r.cube())).collect();
    let [exact, others @ ..] =
        [IntersectorKind::Exact, IntersectorKind::WatertightDouble, IntersectorKind::MollerTrumboreDouble].map(
            |test| closest(&AnyAccel::build(AccelKind::DEFAULT, &shapes, &AccelParams::DEFAULT).tested_by(test), &rays),
        );
    for other in others {
        for ((ray, a), b) in rays.iter().zip(&exact).zip(&other) {
            // Weights near 0 or 1: so close to an edge that double precision may err.
            let near_edge = [a.u, a.v, 1.0 - a.u - a.v].iter().any(|w| *w < 1e-9);
            assert!(near_edge || (a.prim == b.prim && (a.t - b.t).abs() <= a.t * f32::EPSILON), "{ray:?} {a:?} {b:?}");
        }
    }
}

/// Spheres and cylinders that a ray hits almost at its origin, so that c = |f|² − r² nearly cancels and only its remainder
/// gives the distance.
#[test]
fn round_shapes_that_touch_the_start_of_a_ray_are_where_every_structure_finds_them() {
    let mut r = Random::new(58);
    for exponent in [-8, -12, -17, -24, -29, -33, -40] {
        let gap = libm::powf(10.0, exponent as f32);
        let at = |y: f32, z: f32| Vec3::new(-0.9 * gap, y, z);
        let mut shapes = mesh(vec![at(-0.3, -0.2), at(0.3, -0.2), at(0.0, 0.4)], vec![[0, 1, 2]]);
        let sphere = |x: f32, y: f32| SpherePrim { center: Vec3::new(x, y, 0.0), radius: 0.25 };
        shapes.spheres = vec![sphere(0.25, 0.0), sphere(-0.25, 0.4), sphere(-0.25, -0.4)];
        let across = Vec3::new(0.25, 0.3, 0.0);
        let around =
            Cone { base: across * Vec3::new(1.0, -1.0, 1.0), base_radius: 0.25, apex: across, apex_radius: 0.25 };
        shapes.cones = vec![around];
        let shapes = seal(shapes);
        let aim = |r: &mut Random| {
            let beside = Vec3::new(0.0, r.unit() - 0.5, r.unit() - 0.5) * gap;
            ray(Vec3::NEG_X * (gap * (0.5 + r.unit())) + beside, Vec3::new(1.0, r.unit() - 0.5, r.unit() - 0.5))
        };
        let rays: Vec<Ray> = (0..count(400, 20_000)).map(|_| aim(&mut r)).collect();
        assert_all_agree(&format!("10^{exponent} apart"), &shapes, &rays);
    }
}
