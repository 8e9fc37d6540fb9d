//! Input without area, NaN and infinite numbers, extreme sizes, and polygons of every shape.

use super::super::scenes::{all, broken_rays, copies, mesh, mix, moved, ray, rays, soup};
use super::*;
use crate::math::ear_clip::EarClipper;
use crate::math::random::Random;

/// D1 (no area).
#[test]
fn triangles_without_area_are_never_hit() {
    let mut r = Random::new(31);
    let mut vertices = Vec::new();
    for i in 0..60 {
        let (a, d) = ((r.cube() * 64.0).round(), (r.cube() * 8.0).round());
        // Three corners on a line, two equal, or all equal.
        vertices.extend([[a, a + d, a + d * 3.0], [a, a, a + d], [a, a, a]][i % 3]);
    }
    let shapes = mesh(vertices.clone(), (0..60).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let mut rays: Vec<Ray> = vertices.iter().map(|&v| towards((r.cube() * 100.0).round(), v)).collect();
    rays.extend((0..60).map(|i| ray(vertices[3 * i], vertices[3 * i + 2] - vertices[3 * i] + Vec3::X)));
    assert_eq!(assert_exact("no area", &shapes, &rays, 0.0), 0);
    assert_all_agree("no area", &shapes, &rays);
}

/// D2 (copies), D3 (very many copies).
#[test]
fn of_copies_of_a_triangle_the_lowest_is_hit_and_all_follow() {
    let target = Vec3::new(0.4, 0.3, 0.07);
    let rays = [towards(Vec3::new(0.1, 0.2, 2.0), target), towards(Vec3::new(3.0, 1.0, -2.0), target)];
    let shapes = copies(count(200, 1000));
    with_every_kind(&shapes, |kind, accel| {
        for ray in rays {
            let hits = every_hit(accel, ray);
            assert!(hits.len() == shapes.len() && hits.iter().all(|h| h.t == hits[0].t), "{kind}: {}", hits.len());
            assert!(hits.iter().zip(0..).all(|(h, prim)| h.prim == prim), "{kind}");
        }
    });
    let shapes = copies(count(20_000, 10_000_000));
    with_every_kind(&shapes, |kind, accel| {
        for hit in closest(accel, &rays) {
            assert_eq!(hit.prim, 0, "{kind}");
        }
        let stats = accel.summary();
        assert!(stats.n_oiv <= 14 * shapes.len() as u64, "{kind}: {stats:?}");
    });
}

/// D4 (overlapping coplanar faces).
#[test]
fn of_overlapping_faces_in_one_plane_the_lowest_is_hit() {
    // Integer points of the plane x + y + z = 0.
    let mut r = Random::new(32);
    let point = |r: &mut Random| {
        let p = (r.cube() * 20.0).round();
        Vec3::new(p.x, p.y, -p.x - p.y)
    };
    let n = 40;
    let vertices: Vec<Vec3> = (0..3 * n).map(|_| point(&mut r)).collect();
    let shapes = mesh(vertices, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let rays: Vec<Ray> = (0..count(300, 30_000)).map(|_| towards(r.cube() * 10.0 + 40.0, point(&mut r))).collect();
    let oracle = Oracle::new(&shapes);
    let mut shared = 0;
    with_every_kind(&shapes, |kind, accel| {
        for (ray, hit) in rays.iter().zip(closest(accel, &rays)) {
            let mut met = (0..n).filter(|&prim| oracle.meets(ray, prim).is_some());
            assert_eq!(hit.is_some().then_some(hit.prim), met.next(), "{kind}: {ray:?}");
            shared += met.count();
        }
    });
    assert!(shared > rays.len(), "{shared}");
}

/// D5 (not numbers), D6 (no direction), D7 (empty range).
#[test]
fn rays_that_cannot_hit_miss_with_every_structure() {
    for shapes in [mix(), soup(50, 0.5)] {
        let rays = broken_rays();
        with_every_kind(&shapes, |kind, accel| {
            for (ray, answer) in rays.iter().zip(answers(accel, &rays)) {
                assert_eq!((answer[3], answer[4], answer[8]), (NO_PRIM, 0, NO_PRIM), "{kind}: {ray:?}");
            }
        });
    }
}

/// D8 (empty, a point, a line, a plane).
#[test]
fn scenes_without_volume_make_sound_structures() {
    let names = ["empty", "one triangle", "a point", "flat", "a line"];
    for (name, shapes) in all().into_iter().filter(|(name, _)| names.contains(name)) {
        assert_all_agree(name, &shapes, &rays(&shapes, 10));
    }
}

/// D9 (denormal coordinates), D10 (huge coordinates).
#[test]
fn the_smallest_and_largest_coordinates_are_hit_as_in_exact_arithmetic() {
    for scale in [1e-44, 1e-40, 1e-38, 1e-30, 1e30, 1e37] {
        let shapes = moved(soup(30, 0.8), scale, Vec3::ZERO);
        let rays = rays(&shapes, count(3, 100));
        let of_size_one: Vec<Ray> =
            rays.iter().map(|r| Ray { t_min: 0.0, t_max: f32::INFINITY, exclude: NO_PRIM, ..*r }).collect();
        let hits = assert_exact(&format!("{scale}"), &shapes, &of_size_one, 0.501);
        assert!(hits > of_size_one.len() / 20, "{scale}: {hits} of {}", of_size_one.len());
        assert_all_agree(&format!("{scale}"), &shapes, &rays);
    }
}

/// Whether a point is inside a polygon by the even–odd rule, in integers; no corner may have the point's y.
fn inside(outline: &[(i64, i64)], (x, y): (i64, i64)) -> bool {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let right_of_point = |&(&(ax, ay), &(bx, by)): &(&(i64, i64), &(i64, i64))| {
        (ay > y) != (by > y) && ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) * (by - ay).signum() > 0
    };
    edges.filter(right_of_point).count() % 2 == 1
}

/// D11 (polygons): concave, self-intersecting, with a hole by a bridge, with repeated corners, and with a spike.
#[test]
fn polygons_of_every_shape_are_hit_where_the_even_odd_rule_says() {
    let outlines: [&[(i64, i64)]; 5] = [
        &[(0, 0), (8, -8), (0, 8), (-8, -8)],
        &[(0, 10), (6, -8), (-10, 3), (10, 3), (-6, -8)],
        &[(-8, -8), (8, -8), (8, 8), (-8, 8), (-8, -8), (-4, -4), (-4, 4), (4, 4), (4, -4), (-4, -4)],
        &[(-8, -8), (-8, -8), (8, -8), (8, 8), (8, 8), (8, 8), (-8, 8)],
        &[(-8, -8), (8, -8), (8, 0), (14, 0), (8, 0), (8, 8), (-8, 8)],
    ];
    for outline in outlines {
        let vertices: Vec<Vec3> = outline.iter().map(|&(x, y)| Vec3::new(x as f32, y as f32, 0.5)).collect();
        let n = vertices.len() as u32;
        let shapes = Shapes {
            vertices,
            polygons: vec![(0, n)],
            polygon_corners: (0..n).collect(),
            opaque: BitSet::filled(1, true),
            ..Shapes::default()
        };
        with_every_kind(&shapes, |kind, accel| {
            for (x, y) in (-15..15).flat_map(|x| (-15..15).map(move |y| (x, y))) {
                // In half units, so that rays pass between corners.
                let doubled: Vec<_> = outline.iter().map(|&(x, y)| (2 * x, 2 * y)).collect();
                let at = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 7.5);
                // A ray exactly through an edge belongs to one of its sides.
                let on_edge = doubled.iter().zip(doubled.iter().cycle().skip(1)).any(|(&(ax, ay), &(bx, by))| {
                    let (px, py) = (2 * x + 1, 2 * y + 1);
                    (bx - ax) * (py - ay) == (px - ax) * (by - ay)
                });
                let hit = closest(accel, &[ray(at, Vec3::NEG_Z)])[0];
                let expected = inside(&doubled, (2 * x + 1, 2 * y + 1));
                assert!(on_edge || hit.is_some() == expected, "{kind}: {outline:?} at {at}");
                assert!(!hit.is_some() || hit.t == 7.0, "{kind}: {hit:?}");
            }
        });
    }
}

/// D12 (non-planar quads).
#[test]
fn a_warped_quad_is_hit_on_one_of_the_triangles_beside_its_shorter_diagonal() {
    let mut r = Random::new(33);
    // Displaced so little that the quads stay convex: a concave one has only one cut.
    for _ in 0..count(40, 4000) {
        let at = |x: f32, y: f32, r: &mut Random| Vec3::new(x, y, 0.0) + r.cube() * 0.2;
        let quad = [at(0.0, 0.0, &mut r), at(1.0, 0.0, &mut r), at(1.0, 1.0, &mut r), at(0.0, 1.0, &mut r)];
        let mut cut = Vec::new();
        EarClipper::default().cut(&quad.map(Vec3::as_dvec3), &mut cut);
        let shapes = mesh(quad.to_vec(), cut);
        let diagonal = |i: usize, j: usize| (quad[i].as_dvec3() - quad[j].as_dvec3()).length_squared();
        let (i, j) = if diagonal(0, 2) <= diagonal(1, 3) { (0, 2) } else { (1, 3) };
        assert!(shapes.triangles.iter().all(|t| t.contains(&i) && t.contains(&j)), "{quad:?} {:?}", shapes.triangles);
        let aim: Vec<Ray> = (0..20)
            .map(|_| towards(r.cube() + Vec3::Z * 4.0, Vec3::new(0.2 + 0.6 * r.unit(), 0.2 + 0.6 * r.unit(), 0.0)))
            .collect();
        assert!(assert_exact("quad", &shapes, &aim, 0.501) > 10);
    }
}
