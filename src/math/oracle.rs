//! The tests' judge: the same questions answered in rational numbers, without any rounding.

use dashu::base::Abs;
use dashu::integer::IBig;
use dashu::rational::RBig;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::rational::{self, cross, dot, exact, minus, point, sign};
use super::shear::RaySpace;
use super::triangle::{self, Triangle};
use super::{Vec3, plane, quotient};

/// Where the line meets the triangle, from numbers in `f32`.
fn hit(origin: Vec3, dir: Vec3, triangle: &Triangle) -> Option<RBig> {
    rational::hit(&point(origin), &point(dir), triangle)
}

/// Whether `t` is a float nearest to `exact`.
fn is_nearest(t: f32, exact_t: &RBig) -> bool {
    if t.is_infinite() {
        let overflow = RBig::from(IBig::from(2).pow(128) - IBig::from(2).pow(103));
        return exact_t.clone().abs() >= overflow;
    }
    let distance = |x: f32| (exact(x) - exact_t).abs();
    let no_nearer = |x: f32| x.is_infinite() || distance(t) <= distance(x);
    // Negative distances never round to zero.
    let zero = sign(exact_t) < 0 && t == -f32::from_bits(1);
    (no_nearer(t.next_up()) || zero) && no_nearer(t.next_down())
}

/// Numbers of many sizes, biased to collisions: small integers, their neighbours, and any exponent.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (-4i32..5).prop_map(|x| x as f32),
        2 => (-4i32..5).prop_map(|x| (x as f32).next_up()),
        2 => -1.0f32..1.0,
        1 => (-1.0f32..1.0, -100i32..100).prop_map(|(m, e)| m * 2f32.powi(e)),
        1 => (-1.0f32..1.0).prop_map(|m| m * 1e-38 * 1e-4),
        1 => (-1.0f32..1.0).prop_map(|m| m * 1e37),
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

/// Rays aimed at corners and edges, from anywhere.
fn aimed() -> impl Strategy<Value = (Vec3, Vec3, Triangle)> {
    (vector(), [vector(), vector(), vector()], 0..5usize, 0.0f32..1.0, vector()).prop_map(|(o, t, kind, s, d)| {
        let target = match kind {
            0 => t[0],
            1 => (t[0] + t[1]) * 0.5,
            2 => t[0] + (t[1] - t[0]) * s,
            3 => (t[0] + t[1] + t[2]) / 3.0,
            _ => o + d,
        };
        (o, target - o, t)
    })
}

/// The same cases in every run; with `MESHRAY_LONG=1` a hundred times as many.
fn config() -> ProptestConfig {
    let cases = if std::env::var("MESHRAY_LONG").is_ok_and(|v| v == "1") { 300_000 } else { 3000 };
    let rng_seed = RngSeed::Fixed(3);
    ProptestConfig { cases, rng_seed, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn verdict_and_distance_are_those_of_rational_numbers((o, d, t) in aimed()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        let expected = hit(o, d, &t);
        let got = triangle::intersect(&ray, &t);
        prop_assert_eq!(got.is_some(), expected.is_some());
        if let (Some(got), Some(expected)) = (got, expected) {
            prop_assert!(is_nearest(got, &expected), "{} for {}", got, expected.to_f64().value());
        }
    }

    #[test]
    fn turning_the_corners_changes_no_bit((o, d, [a, b, c]) in aimed()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        let bits = [[a, b, c], [b, c, a], [c, a, b], [c, b, a]]
            .map(|t| triangle::intersect(&ray, &t).map(f32::to_bits));
        prop_assert!(bits.iter().all(|b| *b == bits[0]), "{:?}", bits);
    }

    #[test]
    fn the_distance_to_a_plane_is_that_of_rational_numbers(o in vector(), d in vector(), n in vector(), w in coordinate()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        let slope = dot(&point(n), &point(d));
        let got = plane::intersect(&ray, n, w);
        prop_assert_eq!(got.is_some(), !slope.is_zero());
        if let Some(got) = got {
            prop_assert!(is_nearest(got, &((exact(w) - dot(&point(n), &point(o))) / slope)), "{}", got);
        }
    }

    #[test]
    fn weights_add_up_to_the_point_of_the_hit((o, d, t) in aimed()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        if triangle::intersect(&ray, &t).is_some() {
            let (u, v) = triangle::barycentrics(&ray, &t);
            prop_assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + f32::EPSILON, "{} {}", u, v);
        }
    }

    #[test]
    fn edge_and_height_signs_are_exact(o in vector(), d in vector(), p in vector(), q in vector()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        let (a, b) = (minus(&point(p), &point(o)), minus(&point(q), &point(o)));
        let forwards = if d[ray.z] > 0.0 { 1 } else { -1 };
        prop_assert_eq!(ray.edge_sign(p, q), sign(&dot(&point(d), &cross(&a, &b))) * forwards);
        let d = point(d);
        let height = &a[ray.y] * &d[ray.z] - &a[ray.z] * &d[ray.y];
        prop_assert_eq!(ray.height_sign(p), sign(&height) * forwards);
    }
}

#[test]
fn a_negative_distance_never_becomes_zero() {
    assert!(quotient::round(-1e-300) < 0.0);
    assert_eq!(quotient::round(1e-300).to_bits(), 0);
}

#[test]
fn a_ray_in_the_plane_of_a_triangle_and_a_triangle_without_area_are_no_hits() {
    let triangles = [
        [Vec3::ZERO, Vec3::X, Vec3::Y],
        [Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
        [Vec3::ONE, Vec3::ONE, Vec3::ONE],
        [Vec3::ZERO, Vec3::ZERO, Vec3::Y],
    ];
    for t in triangles {
        let rays = [(Vec3::NEG_X, Vec3::X), (Vec3::new(-1.0, 0.25, 0.0), Vec3::X), (Vec3::NEG_ONE, Vec3::ONE)];
        for (o, d) in rays {
            let got = RaySpace::new(o, d).and_then(|r| triangle::intersect(&r, &t));
            let expected = hit(o, d, &t);
            assert_eq!(got.is_some(), expected.is_some(), "{o} {d} {t:?}");
        }
    }
    let flat = RaySpace::new(Vec3::NEG_X, Vec3::X).and_then(|r| triangle::intersect(&r, &triangles[0]));
    assert_eq!(flat, None);
}

#[test]
fn doubling_the_direction_halves_the_distance_exactly() {
    let t = [Vec3::new(0.1, 0.2, 3.7), Vec3::new(1.3, -0.2, 2.9), Vec3::new(0.4, 1.7, 3.3)];
    let (o, d) = (Vec3::new(0.3, 0.4, -1.0), Vec3::new(0.05, 0.03, 0.9));
    let hit = |d| RaySpace::new(o, d).and_then(|r| triangle::intersect(&r, &t)).unwrap_or(f32::NAN);
    assert_eq!(hit(d * 2.0) * 2.0, hit(d));
    assert!(hit(d) > 3.0);
}
