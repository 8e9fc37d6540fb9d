//! Oracle of the tests: the same queries answered in rational numbers, without any rounding.

use dashu::base::{Abs, SquareRoot, UnsignedAbs};
use dashu::integer::IBig;
use dashu::rational::RBig;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::bounds::ROUND_ROOM;
use super::polygon::{self, Polygon};
use super::random::Random;
use super::rational::{self, cross, dot, exact, minus, point, sign};
use super::shear::RaySpace;
use super::triangle::{self, Triangle};
use super::{Vec3, plane, quotient, sphere};

/// Distance at which the line hits the triangle, for `f32` input.
fn hit(origin: Vec3, dir: Vec3, triangle: &Triangle) -> Option<RBig> {
    rational::hit(&point(origin), &point(dir), triangle)
}

/// Whether `t` is a float nearest to `exact_t`.
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

/// Square root of x ≥ 0 with a relative error of 2⁻⁴⁰⁰; exact for the square of a rational number.
pub(super) fn root(x: &RBig) -> RBig {
    let square = (x.numerator() * IBig::from(x.denominator().clone())) << 800;
    RBig::from_parts(IBig::from(square.unsigned_abs().sqrt()), x.denominator().clone() << 400)
}

/// Error of `t` against `exact_t`, in ulp (`f32`).
pub(super) fn ulps(t: f32, exact_t: &RBig) -> f64 {
    let size = exact_t.to_f32().value().abs();
    let ulp = f64::from(size.next_up()) - f64::from(size);
    ((exact(t) - exact_t).abs() / RBig::try_from(ulp).unwrap_or_default()).to_f64().value()
}

/// Distances at which the line hits a sphere, smaller first.
fn sphere_hits(o: Vec3, d: Vec3, center: Vec3, radius: f32) -> Option<[RBig; 2]> {
    let (d, f, r) = (point(d), minus(&point(center), &point(o)), exact(radius));
    let (a, b, c) = (dot(&d, &d), dot(&d, &f), dot(&f, &f) - &r * &r);
    let discriminant = &b * &b - &a * &c;
    (discriminant >= RBig::ZERO).then(|| {
        let root = root(&discriminant);
        [(&b - &root) / &a, (&b + &root) / &a]
    })
}

/// Whether the line passes inside the outline, by the crossing rule of `math::polygon` in sheared rational coordinates.
fn passes_inside(ray: &RaySpace, corners: &[Vec3]) -> bool {
    let (o, d) = (point(ray.origin), point(ray.dir));
    let sheared: Vec<[RBig; 2]> = corners
        .iter()
        .map(|&p| {
            let p = minus(&point(p), &o);
            [ray.x, ray.y].map(|k| &p[k] - &d[k] * &p[ray.z] / &d[ray.z])
        })
        .collect();
    let mut inside = false;
    for (i, q) in sheared.iter().enumerate() {
        let p = &sheared[(i + corners.len() - 1) % corners.len()];
        if (p[1] >= RBig::ZERO) != (q[1] >= RBig::ZERO) {
            let crossing = &p[0] - &p[1] * (&q[0] - &p[0]) / (&q[1] - &p[1]);
            inside ^= crossing > RBig::ZERO;
        }
    }
    inside
}

/// N·(p₀ − o) / N·d with Newell's normal, clamped to the box of the corners.
fn polygon_hit(o: Vec3, d: Vec3, corners: &[Vec3]) -> Option<RBig> {
    let (o, d, first) = (point(o), point(d), point(corners[0]));
    let mut normal = [RBig::ZERO, RBig::ZERO, RBig::ZERO];
    for (i, &q) in corners.iter().enumerate() {
        let (p, q) = (point(corners[(i + corners.len() - 1) % corners.len()]), point(q));
        // Newell's original sum, of trapezoids.
        for (n, (i, j)) in normal.iter_mut().zip([(1, 2), (2, 0), (0, 1)]) {
            *n += (&p[i] - &q[i]) * (&p[j] + &q[j]);
        }
    }
    let slope = dot(&normal, &d);
    let mut range: Option<(RBig, RBig)> = None;
    for k in (0..3).filter(|&k| !d[k].is_zero()) {
        let mut ts: Vec<RBig> = corners.iter().map(|&p| (&point(p)[k] - &o[k]) / &d[k]).collect();
        ts.sort();
        let (enter, leave) = (ts[0].clone(), ts[ts.len() - 1].clone());
        if enter == leave {
            return Some(enter);
        }
        range = Some(match range {
            None => (enter, leave),
            Some((a, b)) => (a.max(enter), b.min(leave)),
        });
    }
    let (enter, leave) = range?;
    (!slope.is_zero()).then(|| (dot(&normal, &minus(&first, &o)) / slope).max(enter).min(leave))
}

/// Outlines of 3 to 8 corners, most of them concave or self-intersecting, in one plane or nearly; and rays at their corners,
/// edges and random points.
fn outlined() -> impl Strategy<Value = (Vec3, Vec3, Vec<Vec3>)> {
    let small = || (-3i32..4).prop_map(|x| x as f32);
    let whole = || [small(), small(), small()].prop_map(Vec3::from_array);
    let corners = prop::collection::vec((small(), small()), 3..9);
    let origin = prop_oneof![whole(), vector(), vector().prop_map(|o| o * 1e5)];
    (whole(), whole(), whole(), corners, origin, vector(), 0..5usize, 0.0f32..1.0).prop_map(
        |(c, u, v, outline, o, d, kind, s)| {
            let scale = if kind == 4 { 0.1 } else { 1.0 };
            let corners: Vec<Vec3> = outline.iter().map(|&(x, y)| c + (u * x + v * y) * scale).collect();
            let target = match kind {
                0 => corners[0],
                1 => corners[0] + (corners[1] - corners[0]) * s,
                2 => (corners[0] + corners[1] + corners[2]) / 3.0,
                3 => o + d,
                _ => corners[1] + (corners[2] - corners[0]) * s,
            };
            (o, target - o, corners)
        },
    )
}

/// Numbers of many sizes, biased towards collisions: small integers, their neighbours, and any exponent.
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

/// Rays from random origins, aimed at corners and edges.
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

/// The same cases in every run; a hundred times as many with `MESHRAY_LONG=1`.
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
    fn a_whole_polygon_is_hit_where_rational_numbers_say((o, d, corners) in outlined()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        let run: Vec<u32> = (0..corners.len() as u32).collect();
        let whole = Polygon { vertices: &corners, corners: &run };
        let got = polygon::intersect(&ray, whole);
        let expected = if passes_inside(&ray, &corners) { polygon_hit(o, d, &corners) } else { None };
        prop_assert_eq!(got.is_some(), expected.is_some(), "{:?} for {:?}", got, expected);
        if let (Some(got), Some(expected)) = (got, expected) {
            prop_assert!(is_nearest(got, &expected), "{} for {}", got, expected.to_f64().value());
            let t = polygon::distance_f64(&ray, whole).unwrap_or(f64::NAN);
            let off = (RBig::try_from(t).unwrap_or_default() - &expected).abs();
            prop_assert!(off <= expected.abs() * RBig::try_from(super::bounds::POSITION_T).unwrap_or_default());
        }
    }

    #[test]
    fn a_sphere_is_hit_within_2_and_a_half_ulp_but_beside_the_origin(
        o in vector(), c in vector(), d in vector(), r in (0.0f32..1.0, -20i32..20), at in 0..3u32, turn in vector(),
    ) {
        let radius = (r.0 * 2f32.powi(r.1)).max(1e-30);
        let side = turn.cross(c - o).normalize_or(Vec3::Y);
        // At the centre, past the rim, or at random.
        let d = match at { 0 => c - o, 1 => c + side * radius - o, _ => d };
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        if !(1e-15..1e15).contains(&d.length()) || (c - o).length() > 1e15 {
            return Ok(());
        }
        let Some(got) = sphere::intersect(&ray, c, radius, false) else { return Ok(()) };
        let Some(want) = sphere_hits(o, d, c, radius) else { return Ok(()) };
        for (got, want) in got.into_iter().zip(want) {
            let far = want.to_f64().value().abs() * f64::from(d.length()) > f64::from(radius * ROUND_ROOM);
            prop_assert!(!far || got.is_infinite() || ulps(got, &want) <= 2.5, "{} for {}", got, want.to_f64().value());
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

/// Points of such a coarse grid that corners often coincide, with each other and with the ray's origin.
#[test]
fn triangles_without_area_and_rays_from_corners_are_decided_as_rational_numbers_are() {
    let mut random = Random::new(77);
    let mut at = || Vec3::from([(); 3].map(|()| random.below(3) as f32 - 1.0)) * 0.3;
    let (mut without_area, mut from_corners) = (0, 0);
    for _ in 0..20_000 {
        let (o, d, t) = (at(), at(), [at(), at(), at()]);
        let Some(ray) = RaySpace::new(o, d) else { continue };
        let (got, expected) = (triangle::intersect(&ray, &t), hit(o, d, &t));
        assert_eq!(got.is_some(), expected.is_some(), "{o} along {d} at {t:?}");
        without_area += usize::from(t[0] == t[1] || t[1] == t[2] || t[2] == t[0]);
        if let (Some(got), Some(expected)) = (got, expected) {
            assert!(is_nearest(got, &expected), "{got} for {}", expected.to_f64().value());
            // Only hits behind the origin have a negative distance, so zero is positive.
            assert!(!expected.is_zero() || got.to_bits() == 0, "{got}");
            from_corners += usize::from(t.contains(&o));
        }
        assert_eq!(ray.edge_sign(t[0], t[1]), -ray.edge_sign(t[1], t[0]));
    }
    assert!(without_area > 1000 && from_corners > 300, "{without_area} {from_corners}");
}

#[test]
fn p9_a_small_sphere_far_away_and_a_large_one_nearby_are_within_2_and_a_half_ulp() {
    let mut hits = 0;
    let mut check = |o: Vec3, d: Vec3, center: Vec3, radius: f32| {
        let got = RaySpace::new(o, d).and_then(|r| sphere::intersect(&r, center, radius, false));
        let want = sphere_hits(o, d, center, radius);
        assert_eq!(got.is_some(), want.is_some(), "{o} {d}");
        for (got, want) in got.into_iter().flatten().zip(want.into_iter().flatten()) {
            let off = ulps(got, &want);
            assert!(off <= 2.5, "{off} ulp: {got} for {}: {o} {d}", want.to_f64().value());
            hits += 1;
        }
    };
    for i in -20..=20 {
        let s = i as f32 / 20.0;
        // Radius 1e-3 at a distance of 1e5: from the centre to past the rim.
        check(Vec3::new(0.0, 1.1e-3 * s, 3e-4), Vec3::X, Vec3::new(1e5, 0.0, 0.0), 1e-3);
        check(Vec3::ZERO, Vec3::new(6e4, 8e4 + 1e-3 * s, 0.0), Vec3::new(6e4, 8e4, 0.0), 1e-3);
        // Radius 1e5 seen from 1e-2: straight down, and at ever more grazing angles.
        let down = Vec3::new(1.0 - s.abs(), 0.02 * s, -s);
        check(Vec3::ZERO, down, Vec3::new(0.0, 0.0, -1e5 - 0.01), 1e5);
        check(Vec3::Z * 0.01, down, Vec3::new(0.0, 0.0, -1e5), 1e5);
    }
    assert!(hits > 150, "{hits}");
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
