use super::*;
use crate::math::oracle::{root, ulps};
use crate::math::rational::{along, cross, dot, exact, minus, point};
use dashu::base::Abs;
use dashu::integer::IBig;
use dashu::rational::RBig;
use proptest::prelude::*;

/// Distances at which the line meets the mantle, in rational numbers; `None` for a line in the mantle.
fn oracle(o: Vec3, d: Vec3, cone: &Cone) -> Option<Vec<RBig>> {
    let (o, d) = (point(o), point(d));
    let (base, apex) = (point(cone.base), point(cone.apex));
    let (r0, r1) = (exact(cone.base_radius), exact(cone.apex_radius));
    let (w, p) = (minus(&apex, &base), minus(&o, &base));
    let h2 = dot(&w, &w);
    // h² |p × w|² = (r₀ h² + (r₁ − r₀) p·w)².
    let (u, v) = (cross(&p, &w), cross(&d, &w));
    let (e, f) = (&r0 * &h2 + (&r1 - &r0) * dot(&p, &w), (&r1 - &r0) * dot(&d, &w));
    let a = &h2 * dot(&v, &v) - &f * &f;
    let b = &h2 * dot(&u, &v) - &e * &f;
    let c = &h2 * dot(&u, &u) - &e * &e;
    let discriminant = &b * &b - &a * &c;
    let candidates = match (a.is_zero(), b.is_zero(), c.is_zero()) {
        (true, true, true) => return None,
        (true, true, false) => vec![],
        (true, false, _) => vec![-c / (b * RBig::from(2))],
        _ if discriminant < RBig::ZERO => vec![],
        _ => {
            let root = root(&discriminant);
            vec![(-&b - &root) / &a, (-&b + &root) / &a]
        }
    };
    let on_mantle = |t: &RBig| {
        let s = dot(&along(&p, &d, t), &w);
        let room = &h2 / RBig::from(IBig::ONE << 300);
        s >= -&room && s <= h2.clone() + &room
    };
    Some(candidates.into_iter().filter(on_mantle).collect())
}

/// Asserts that all hits of the line are those of rational arithmetic, and returns the largest error in ulp.
fn assert_exact(o: Vec3, d: Vec3, cone: &Cone) -> f64 {
    let Some(ray) = RaySpace::new(o, d) else { return 0.0 };
    let got: Vec<f32> = intersect(&ray, cone, false).into_iter().filter(|t| !t.is_nan()).collect();
    let Some(mut want) = oracle(o, d, cone) else {
        assert!(got.is_empty(), "a line in the mantle hits at {got:?}: {o} {d} {cone:?}");
        return 0.0;
    };
    want.sort();
    let shown: Vec<f64> = want.iter().map(|t| t.to_f64().value()).collect();
    assert_eq!(got.len(), want.len(), "{got:?} for {shown:?}: {o} {d} {cone:?}");
    let mut worst = 0.0f64;
    for (&got, want) in got.iter().zip(&want) {
        let off = match (want.is_zero(), got.is_infinite()) {
            (true, _) => f64::from(got.abs()),
            (_, true) if want.clone().abs() > exact(f32::MAX) => 0.0,
            _ => ulps(got, want),
        };
        assert!(off <= 2.5, "{off} ulp: {got:e} for {shown:?}: {o} {d} {cone:?}");
        worst = worst.max(off);
    }
    let ahead = intersect(&ray, cone, true);
    for t in got.into_iter().filter(|t| *t >= 0.0) {
        assert!(ahead.contains(&t), "{t} ahead is missing: {ahead:?}");
    }
    worst
}

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (-4i32..5).prop_map(|x| x as f32),
        1 => (1i32..5).prop_map(|x| (x as f32).next_up()),
        3 => -2.0f32..2.0,
        1 => (-1.0f32..1.0, -30i32..20).prop_map(|(m, e)| m * 2f32.powi(e)),
    ]
}

fn vector() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

fn radius() -> impl Strategy<Value = f32> {
    prop_oneof![2 => Just(0.0f32), 3 => (1i32..5).prop_map(|x| x as f32), 3 => 0.0f32..2.0, 1 => 0.0f32..1e-3]
}

fn cone() -> impl Strategy<Value = Cone> {
    let any = (vector(), vector(), radius(), radius(), 0..3u32);
    any.prop_map(|(base, apex, base_radius, other, kind)| {
        let apex_radius = if kind == 0 { base_radius } else { other };
        Cone { base, base_radius, apex, apex_radius }
    })
    .prop_filter("both ends differ", |c| c.base != c.apex && c.base_radius.max(c.apex_radius) > 0.0)
}

/// Rays that graze, run along, start on or pass through difficult places, from near and far.
fn aimed() -> impl Strategy<Value = (Vec3, Vec3, Cone)> {
    (cone(), vector(), vector(), 0.0f32..1.0, 0.0f32..6.3, 0..8u32, 0..4u32).prop_map(
        |(c, o, d, s, turn, kind, back)| {
            let axis = c.apex - c.base;
            let (x, y) = axis.normalize_or(Vec3::Z).any_orthonormal_pair();
            let out = x * turn.cos() + y * turn.sin();
            let (rim, other) = (c.base + out * c.base_radius, c.apex + out * c.apex_radius);
            let on = rim + (other - rim) * s;
            let (from, to) = match kind {
                0 => (o, on),
                1 => (o, rim),
                2 => (o, c.apex),
                // From the mantle; along it; along the axis; a tangent across; inside.
                3 => (on, on + d),
                4 => (rim + (rim - other) * 2.0, other),
                5 => (o, o + axis),
                6 => (on + axis.cross(out) * 3.0, on),
                _ => (c.base + axis * s, on),
            };
            let dir = to - from;
            (from - dir * [0.0, 0.0, 1.0, 1e5][back as usize], dir, c)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2500, ..ProptestConfig::default() })]

    #[test]
    fn hits_and_distances_are_those_of_rational_numbers((o, d, c) in aimed()) {
        assert_exact(o, d, &c);
    }

    #[test]
    fn scaling_by_powers_of_two_changes_no_bit((o, d, c) in aimed(), k in -20i32..20) {
        let by = 2f32.powi(k);
        let scaled = Cone {
            base: c.base * by, apex: c.apex * by, base_radius: c.base_radius * by, apex_radius: c.apex_radius * by,
        };
        let bits = |o, d, c| RaySpace::new(o, d).map(|r| intersect(&r, &c, false).map(|t| t + 0.0));
        let (a, b) = (bits(o, d, c), bits(o * by, d * by, scaled));
        prop_assert_eq!(a.map(|t| t.map(f32::to_bits)), b.map(|t| t.map(f32::to_bits)));
    }

    #[test]
    fn hits_lie_in_the_bounds((o, d, c) in aimed()) {
        let Some(ray) = RaySpace::new(o, d) else { return Ok(()) };
        let b = c.bounds();
        for t in distances(&ray, &c, false).into_iter().filter(|t| t.is_finite() && t.abs() < 1e3) {
            let p = o.as_dvec3() + d.as_dvec3() * t;
            let room = (o.as_dvec3().abs() + d.as_dvec3().abs() * t.abs()) * 1e-7;
            prop_assert!(p.cmpge(b.lo.as_dvec3() - room).all() && p.cmple(b.hi.as_dvec3() + room).all(), "{} {:?}", p, b);
        }
    }
}

const NONE: [f32; 0] = [];
const TUBE: Cone = Cone { base: Vec3::ZERO, base_radius: 2.0, apex: Vec3::new(0.0, 0.0, 8.0), apex_radius: 2.0 };
const TIP: Cone = Cone { base: Vec3::ZERO, base_radius: 2.0, apex: Vec3::new(0.0, 0.0, 4.0), apex_radius: 0.0 };

fn hits(o: [f32; 3], d: [f32; 3], cone: &Cone) -> Vec<f32> {
    assert_exact(o.into(), d.into(), cone);
    let ray = RaySpace::new(o.into(), d.into());
    ray.map_or(vec![], |r| intersect(&r, cone, false).into_iter().filter(|t| !t.is_nan()).collect())
}

#[test]
fn a_tube_is_entered_and_left_where_it_should() {
    assert_eq!(hits([-5.0, 0.0, 1.0], [1.0, 0.0, 0.0], &TUBE), [3.0, 7.0]);
    assert_eq!(hits([0.0, 0.0, 1.0], [0.5, 0.0, 0.0], &TUBE), [-4.0, 4.0], "from the axis");
    assert_eq!(hits([2.0, 0.0, 1.0], [1.0, 0.0, 0.0], &TUBE), [-4.0, 0.0], "from the mantle");
}

#[test]
fn the_ends_are_open_and_their_rims_belong_to_the_mantle() {
    assert_eq!(hits([1.0, 0.0, -3.0], [0.0, 0.0, 1.0], &TUBE), NONE);
    assert_eq!(hits([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0], &TUBE), [3.0, 7.0]);
    assert_eq!(hits([-5.0, 0.0, 8.0], [1.0, 0.0, 0.0], &TUBE), [3.0, 7.0]);
    assert_eq!(hits([-5.0, 0.0, 8.0f32.next_up()], [1.0, 0.0, 0.0], &TUBE), NONE);
    assert_eq!(hits([1.0, 0.0, -1.0], [1.0, 0.0, 1.0], &TUBE), [1.0], "in through the opening");
}

#[test]
fn a_tangent_touches_and_the_next_float_does_not() {
    assert_eq!(hits([-5.0, 2.0, 1.0], [1.0, 0.0, 0.0], &TUBE), [5.0, 5.0]);
    assert_eq!(hits([-5.0, 2.0f32.next_up(), 1.0], [1.0, 0.0, 0.0], &TUBE), NONE);
}

#[test]
fn a_line_in_the_mantle_does_not_hit_and_one_beside_it_may() {
    assert_eq!(hits([2.0, 0.0, -1.0], [0.0, 0.0, 1.0], &TUBE), NONE);
    assert_eq!(hits([2.0, 0.0, 0.0], [-0.5, 0.0, 1.0], &TIP), NONE);
    // Parallel to the mantle, inside: out through the other side.
    assert_eq!(hits([1.0, 0.0, 0.0], [0.5, 0.0, -1.0], &TIP), [-3.0]);
    assert_eq!(hits([1.0, 0.0, 0.0], [-0.5, 0.0, 1.0], &TIP), [3.0]);
}

#[test]
fn the_tip_is_hit_from_every_side() {
    assert_eq!(hits([-3.0, 0.0, 4.0], [1.0, 0.0, 0.0], &TIP), [3.0, 3.0]);
    assert_eq!(hits([0.0, 0.0, 9.0], [0.0, 0.0, -1.0], &TIP), [5.0, 5.0]);
    assert_eq!(hits([3.0, 0.0, 8.0], [-3.0, 0.0, -4.0], &TIP).len(), 2, "and then the inside");
    assert_eq!(hits([-3.0, 0.0, 4.0f32.next_up()], [1.0, 0.0, 0.0], &TIP), NONE, "no second nappe");
    assert_eq!(hits([-3.0, 0.0, 5.0], [1.0, 0.0, 0.0], &TIP), NONE);
}

#[test]
fn p9_thin_ones_far_away_and_wide_ones_nearby_are_within_8_ulp() {
    let thin = |apex_radius| Cone {
        base: Vec3::new(1e5, 0.0, -1.0),
        base_radius: 1e-3,
        apex: Vec3::new(1e5, 0.3, 1.0),
        apex_radius,
    };
    let wide = |apex_radius| Cone {
        base: Vec3::new(1e5, -1e5, 0.0),
        base_radius: 1e5,
        apex: Vec3::new(1e5, 1e5, 3.0),
        apex_radius,
    };
    for i in 0..200 {
        let s = i as f32 / 200.0;
        for r in [1e-3, 5e-4, 0.0] {
            let cone = thin(r);
            let target = cone.base + (cone.apex - cone.base) * s + Vec3::Z.cross(Vec3::X) * (1e-3 * (1.0 - s));
            assert!(assert_exact(Vec3::new(0.0, s, 0.0), target, &cone) < 2.5);
        }
        for r in [1e5, 5e4, 0.0] {
            // The wide cones pass at a distance of 1e-2 and less.
            let o = Vec3::new(-0.01 * s, 0.1 * s, 2.0 * s);
            let d = Vec3::new(1.0 - s, s * s, 0.3 - s);
            assert!(assert_exact(o, d, &wide(r)) < 2.5);
        }
    }
}

#[test]
fn a_long_needle_and_a_flat_disc_keep_their_shape() {
    let needle = Cone { base: Vec3::ZERO, base_radius: 1e-6, apex: Vec3::new(1e3, 1e3, 1.0), apex_radius: 0.0 };
    let disc = Cone { base: Vec3::ZERO, base_radius: 1e4, apex: Vec3::new(1e-4, 0.0, 1e-3), apex_radius: 1.0 };
    for i in 0..200 {
        let s = i as f32 / 200.0;
        assert_exact(Vec3::new(0.0, 3.0, 7.0), needle.apex * s - Vec3::new(0.0, 3.0, 7.0), &needle);
        assert_exact(Vec3::new(1.0, 3.0, 7.0), Vec3::new(1e4 * s, 3e3 * s, -7.0 * s), &disc);
        assert_exact(Vec3::new(-2e4, 3.0, 1e-3 * s), Vec3::X + Vec3::Z * (1e-8 * s), &disc);
    }
}

#[test]
fn the_ends_of_the_range_of_f32_do_not_overflow() {
    for by in [1e-42, 1e-37, 1e34] {
        let cone = Cone { base: TIP.base, base_radius: 2.0 * by, apex: TIP.apex * by, apex_radius: by };
        for d in [Vec3::new(1.0, 0.25, 0.125), Vec3::X * 1e37, Vec3::new(1e-42, 0.0, 3e-43)] {
            assert_exact(Vec3::new(-3.0, 0.5, 1.0) * by, d, &cone);
        }
    }
    // Ends of one cone at both ends of the range: no NaN, no panic.
    let mixed = Cone { base: Vec3::ZERO, base_radius: 1e-42, apex: Vec3::splat(1e38), apex_radius: 1e38 };
    let flat = Cone { base: Vec3::ZERO, base_radius: 1e38, apex: Vec3::Z * 1e-42, apex_radius: 0.0 };
    for cone in [mixed, flat] {
        for o in [Vec3::splat(1e-42), Vec3::NEG_Z * 1e38, Vec3::new(3.0, 1.0, 2.0)] {
            let Some(ray) = RaySpace::new(o, Vec3::new(0.3, 1e-42, 1.0)) else { continue };
            assert!(distances(&ray, &cone, false).into_iter().all(|t| !t.is_infinite()));
        }
    }
}

#[test]
fn a_cone_without_length_is_never_hit() {
    let flat = Cone { apex: TIP.base, ..TIP };
    let ray = RaySpace::new(Vec3::new(1.0, 0.0, 5.0), Vec3::NEG_Z).unwrap();
    assert!(intersect(&ray, &flat, true).into_iter().all(f32::is_nan));
    assert!(flat.bounds().lo.x <= -2.0 && flat.project(DVec3::X).2.is_finite());
}

#[test]
fn bounds_are_tight() {
    let b = Cone { base: Vec3::ZERO, base_radius: 5.0, apex: Vec3::new(0.0, 3.0, 4.0), apex_radius: 0.0 }.bounds();
    assert!((b.lo - Vec3::new(-5.0, -4.0, -3.0)).abs().max_element() < 1e-5, "{b:?}");
    assert!((b.hi - Vec3::new(5.0, 4.0, 4.0)).abs().max_element() < 1e-5, "{b:?}");
    let along = TUBE.bounds();
    assert!(along.lo.z < 0.0 && along.lo.z > -1e-40, "{along:?}");
}

#[test]
fn points_near_the_mantle_are_moved_onto_it_with_the_normal_outwards() {
    let (arm, _, normal) = TIP.project(DVec3::new(0.0, 1.1, 2.0));
    let out = DVec3::new(0.0, 2.0, 1.0).normalize();
    assert!((normal - out).length() < 1e-12, "{normal}");
    assert!((arm.y - (2.0 - arm.z / 2.0)).abs() < 1e-12 && (DVec3::new(0.0, 1.1, 2.0) - arm).length() < 0.1);
    // Beyond the rim and on the axis, the projection is still a point of the mantle.
    let (rim, ..) = TIP.project(DVec3::new(0.0, 2.1, -0.1));
    assert!(rim.z == 0.0 && (rim.y - 2.0).abs() < 1e-12, "{rim}");
    let (tip, _, normal) = TIP.project(DVec3::new(0.0, 0.0, 4.0));
    assert!((tip - DVec3::Z * 4.0).length() < 1e-12 && normal.is_normalized());
}

#[test]
fn the_distance_to_the_mantle_is_that_to_its_profile() {
    let profile = Profile::new(&TIP);
    assert_eq!((profile.distance(0.0, 3.0), profile.distance(7.0, 4.0)), (1.0, 5.0));
    assert!((profile.distance(2.0, 0.0) - 2.0 / 5f64.sqrt()).abs() < 1e-12);
}
