//! Rays that leave a cone: those that start on the mantle do not hit it again there.

use super::*;
use crate::math::bounds::offset_origin;
use crate::math::random::Random;

/// Rays aimed at a cone, and the cone as shapes of its own.
fn aimed(cone: Cone, n: usize, r: &mut Random) -> (Shapes, Vec<Ray>) {
    let shapes = Shapes { cones: vec![cone], opaque: BitSet::filled(1, true), ..Shapes::default() };
    let size = cone.apex.distance(cone.base) + cone.base_radius;
    let out = (cone.apex - cone.base).any_orthonormal_pair();
    let rays = (0..n).map(|_| {
        let turn = r.cube();
        let across = (out.0 * turn.x + out.1 * turn.y).normalize_or(out.0);
        let s = r.unit();
        let on = cone.base.lerp(cone.apex, s) + across * (cone.base_radius + (cone.apex_radius - cone.base_radius) * s);
        let origin = on + r.cube() * size;
        scenes::ray(origin, on - origin)
    });
    let rays = rays.collect();
    (shapes, rays)
}

fn some_cones() -> Vec<Cone> {
    let mut r = Random::new(7);
    let mut cones = Vec::new();
    for i in 0..60 {
        let base_radius = r.unit() + 1e-3;
        let apex_radius = [base_radius, 0.0, 0.3 * base_radius][i % 3];
        cones.push(Cone { base: r.cube(), base_radius, apex: r.cube() * 3.0, apex_radius });
    }
    // Wide cones whose mantle passes near the origin of the frame: the numbers rounded in between are larger than the position.
    for i in 0..20 {
        let side = r.cube().normalize_or(Vec3::X);
        let (along, across) = side.any_orthonormal_pair();
        let base_radius = 1e5;
        let base = across * 1e5 - along * 7e4;
        cones.push(Cone { base, base_radius, apex: base + along * 1.6e5, apex_radius: [1e5, 9e4][i % 2] });
    }
    cones
}

#[test]
fn rays_that_leave_a_cone_do_not_meet_it_where_they_start() {
    let mut r = Random::new(8);
    let mut checked = 0;
    for cone in some_cones() {
        let (shapes, rays) = aimed(cone, 60, &mut r);
        let mut hits = vec![Hit::MISS; rays.len()];
        Unculled::new(&shapes).closest(&rays, &mut hits, &mut Unculled::new(&shapes).scratch(), &mut NoProbe);
        for (ray, hit) in rays.iter().zip(&hits).filter(|(_, hit)| hit.is_some()) {
            let refined = shapes.refine(ray, hit);
            assert!(refined.normal.is_normalized(), "{cone:?} {ray:?}");
            for _ in 0..4 {
                let dir = r.cube();
                let slope = dir.dot(refined.normal);
                let origin = offset_origin(refined.start, refined.error, refined.normal, dir);
                let Some(space) = RaySpace::new(origin, dir) else { continue };
                let ahead = shapes.other_distances(0, &space, true).into_iter().filter(|t| *t >= 0.0).count();
                // The solid is convex: a ray outwards hits nothing, a ray inwards at most the other side.
                let most = if slope > 1e-3 { 0 } else { 1 };
                assert!(ahead <= most || slope.abs() < 1e-3, "{ahead} hits from {origin} to {dir} off {cone:?}");
                checked += usize::from(slope.abs() > 1e-3);
            }
        }
    }
    assert!(checked > 10_000, "{checked}");
}

#[test]
fn a_refined_hit_lies_on_the_mantle_within_its_error() {
    let mut r = Random::new(9);
    for cone in some_cones() {
        let (shapes, rays) = aimed(cone, 40, &mut r);
        let mut hits = vec![Hit::MISS; rays.len()];
        Unculled::new(&shapes).closest(&rays, &mut hits, &mut Unculled::new(&shapes).scratch(), &mut NoProbe);
        for (ray, hit) in rays.iter().zip(&hits).filter(|(_, hit)| hit.is_some()) {
            let refined = shapes.refine(ray, hit);
            let (arm, ..) = cone.project(refined.position.as_dvec3());
            let off = (cone.base.as_dvec3() + arm - refined.position.as_dvec3()).length();
            assert!(off <= refined.error.as_dvec3().length(), "{off} of {} on {cone:?}", refined.error);
            // And near the point of the ray at the hit's distance, up to the rounding of that distance.
            let on_ray = ray.origin + ray.dir * hit.t;
            let room = (ray.origin.abs() + on_ray.abs()).max_element() * 1e-5;
            assert!((on_ray - refined.position).length() < room, "{on_ray} {} {cone:?}", refined.position);
        }
    }
}

#[test]
fn what_projecting_rounds_is_part_of_the_error() {
    // A large tilted cylinder that passes exactly through the origin: there the position's own rounding is next to nothing,
    // and only the intermediate rounding errors remain.
    let at = |x: f32, z: f32| Vec3::new(x, 0.0, z) * 16384.0;
    let cone = Cone { base: at(-7.0, -1.0), base_radius: 81920.0, apex: at(-1.0, 7.0), apex_radius: 81920.0 };
    let shapes = Shapes { cones: vec![cone], opaque: BitSet::filled(1, true), ..Shapes::default() };
    let mut r = Random::new(10);
    let rays: Vec<Ray> = (0..200).map(|_| (r.cube(), r.cube() * 1e-6)).map(|(o, to)| scenes::ray(o, to - o)).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    Unculled::new(&shapes).closest(&rays, &mut hits, &mut Unculled::new(&shapes).scratch(), &mut NoProbe);
    for (ray, hit) in rays.iter().zip(&hits) {
        let refined = shapes.refine(ray, hit);
        let p = refined.position.as_dvec3();
        assert!(p.length() < 1e-4, "{p}");
        // Distance from the axis minus the radius, where outwards is (4, 0, −3) / 5.
        let out = (4.0 * p.x - 3.0 * p.z) / 5.0;
        let off = (out + p.y * p.y / (2.0 * 81920.0)).abs();
        assert!(off <= refined.error.as_dvec3().length(), "{off:e} of {}", refined.error);
    }
}
