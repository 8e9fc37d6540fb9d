//! Rays and prims on the borders of cells. Tests that each margin is needed (G12) are beside the structures: `grid/margins`,
//! `wide/margins`.

use super::super::scenes::{all, huge_and_tiny, lattice, mesh, mix, moved, ray, rays, soup, star};
use super::*;
use crate::accel::grid::margins::{EIGHT, WIDTH, faces_between_cells, plane};
use crate::math::random::Random;

/// Asserts brute force's answers for every structure and for the grid of eight cells per axis, whose planes are known.
fn assert_grids_agree(what: &str, shapes: &Shapes, rays: &[Ray]) {
    assert_all_agree(what, shapes, rays);
    let grid: GridOctree = GridOctree::build(shapes, &EIGHT);
    assert_same(what, rays, &answers(&grid, rays), &answers(&Unculled::new(shapes), rays));
}

/// Every direction with components −1, 0 and 1, with either sign of each zero.
fn directions() -> Vec<Vec3> {
    let steps = [-1.0f32, -0.0, 0.0, 1.0];
    let all = (0..64).map(|i| Vec3::new(steps[i & 3], steps[i >> 2 & 3], steps[i >> 4]));
    all.filter(|d| *d != Vec3::ZERO).collect()
}

/// G1 (rays in planes, along edges and through corners of cells).
#[test]
fn rays_in_planes_along_edges_and_through_corners_of_cells_lose_nothing() {
    let (shapes, rays) = faces_between_cells();
    assert_grids_agree("faces between cells", &shapes, &rays);
    let shapes = lattice(60);
    let mut r = Random::new(41);
    let corner = |r: &mut Random| (r.cube() * 5.0).round();
    let rays: Vec<Ray> =
        directions().into_iter().flat_map(|d| [ray(corner(&mut r), d), ray(corner(&mut r) - d * 16.0, d)]).collect();
    assert_grids_agree("lattice", &shapes, &rays);
}

/// G2 (signed zeros, faces of the scene's box).
#[test]
fn rays_from_and_beside_the_faces_of_the_box_in_all_directions_lose_nothing() {
    let shapes = lattice(12);
    let (lo, hi) =
        shapes.vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let places = |k: usize| {
        [
            lo[k].next_down(),
            lo[k],
            lo[k].next_up(),
            lo[k] * 0.5 + hi[k] * 0.5,
            hi[k].next_down(),
            hi[k],
            hi[k].next_up(),
        ]
    };
    let mut rays = Vec::new();
    for i in 0..343 {
        let origin = Vec3::new(places(0)[i % 7], places(1)[i / 7 % 7], places(2)[i / 49]);
        rays.extend(directions().into_iter().map(|dir| ray(origin, dir)));
    }
    let rays: Vec<Ray> = rays.into_iter().step_by(count(11, 1)).collect();
    assert_grids_agree("box", &shapes, &rays);
}

/// G3 (rays nearly parallel to planes).
#[test]
fn rays_nearly_parallel_to_planes_lose_nothing_and_end() {
    let mut r = Random::new(42);
    let shapes = soup(150, 0.5);
    let small = [1e-38, -1e-45, 1e-18, -1e-18, 1e-38];
    let rays: Vec<Ray> = (0..count(120, 20_000))
        .map(|i| {
            let mut dir = [Vec3::X, Vec3::NEG_Y, Vec3::Z][i % 3];
            dir[(i + 1) % 3] = small[r.below(5)];
            dir[(i + 2) % 3] = [small[r.below(5)], r.unit()][i % 2];
            ray(r.cube() * 1.5, dir)
        })
        .collect();
    assert_grids_agree("nearly parallel", &shapes, &rays);
    let grid: GridOctree = GridOctree::build(&shapes, &EIGHT);
    for ray in rays {
        let mut counts = RayCounts::default();
        grid.closest(&[ray], &mut [Hit::MISS], &mut grid.scratch(), &mut counts);
        assert!(counts.n_ets <= 3 * 8 - 2, "{ray:?}: {} cells", counts.n_ets);
    }
}

/// A square in the plane between two cells of [`EIGHT`], with corner triangles that give the grid its size.
fn square_between_cells() -> Shapes {
    let (lo, hi, x) = (plane(2), plane(5), plane(4));
    let ends =
        [Vec3::ZERO, Vec3::X * 0.01, Vec3::Y * 0.01, Vec3::ONE, Vec3::ONE - Vec3::Z * 0.01, Vec3::ONE - Vec3::Y * 0.01];
    let square = [(lo, lo), (hi, lo), (hi, hi), (lo, hi)].map(|(y, z)| Vec3::new(x, y, z));
    mesh([ends.as_slice(), &square].concat(), vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [6, 8, 9]])
}

/// G4 (a face in a plane between cells), G5 (a hit exactly at the exit of a cell).
#[test]
fn a_face_between_cells_is_hit_from_both_sides_and_by_ranges_that_end_on_it() {
    let shapes = square_between_cells();
    let mut rays = Vec::new();
    for (i, j) in (0..=24).flat_map(|i| (0..=24).map(move |j| (i, j))) {
        let target = Vec3::new(plane(4), plane(2) + i as f32 * (WIDTH / 8.0), plane(2) + j as f32 * (WIDTH / 8.0));
        for dir in [Vec3::X, Vec3::NEG_X, Vec3::new(1.0, -0.5, 0.0), Vec3::new(-0.25, 0.5, 1.0)] {
            let through = ray(target - dir * 2.0, dir);
            rays.extend([
                through,
                Ray { t_max: 2.0, ..through },
                Ray { t_min: 2.0, ..through },
                Ray { t_min: 2.0, t_max: 2.0, ..through },
            ]);
        }
    }
    for hit in closest(&Unculled::new(&shapes), &rays) {
        assert_eq!((hit.t, hit.prim > 1), (2.0, true));
    }
    assert_grids_agree("square", &shapes, &rays);
}

/// G6 (a prim that overlaps only the padding of a cell).
#[test]
fn a_face_just_beside_a_plane_between_cells_is_listed_on_both_sides() {
    let mut shapes = square_between_cells();
    let listed = |shapes: &Shapes| <GridOctree>::build(shapes, &EIGHT).summary().n_oiv;
    let both = listed(&shapes);
    let shift =
        |shapes: &mut Shapes, by: f32| shapes.vertices[6..].iter_mut().for_each(|v| v.x = plane(4) + by * WIDTH);
    shift(&mut shapes, 1.0 / 1024.0);
    assert_eq!(listed(&shapes), both, "within the padding");
    let mut r = Random::new(43);
    let rays: Vec<Ray> =
        (0..count(300, 10_000)).map(|_| towards(r.cube() * 2.0, Vec3::new(plane(4), r.unit(), r.unit()))).collect();
    assert_grids_agree("beside", &shapes, &rays);
    shift(&mut shapes, 1.0 / 256.0);
    assert!(listed(&shapes) < both, "beyond the padding");
}

/// G7 (a hit in a later cell is not taken early).
#[test]
fn a_huge_face_through_all_cells_does_not_hide_what_lies_before_it() {
    let shapes = huge_and_tiny();
    let mut r = Random::new(44);
    let mut rays = rays(&shapes, 10);
    let tiny = |r: &mut Random| shapes.vertices[r.below(900)];
    rays.extend((0..count(400, 40_000)).map(|_| towards(r.direction() * 3.0, tiny(&mut r))));
    assert_grids_agree("huge and tiny", &shapes, &rays);
    let hits = closest(&Unculled::new(&shapes), &rays);
    let of_huge = hits.iter().filter(|h| h.prim == 300).count();
    assert!(of_huge > 50 && hits.iter().filter(|h| h.prim < 300).count() > 50, "{of_huge} of {}", hits.len());
}

/// A small star in a large hall.
fn teapot_in_a_stadium(ratio: f32) -> Shapes {
    let mut shapes = moved(star(20, 12), ratio, Vec3::new(0.3, -0.9, 0.4));
    let base = shapes.vertices.len() as u32;
    shapes.vertices.extend((0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0));
    for [a, b, c, d] in [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]] {
        shapes.triangles.extend([[a, b, c], [a, c, d]].map(|t: [u32; 3]| t.map(|i| base + i)));
    }
    mesh(shapes.vertices, shapes.triangles)
}

/// G8 (teapot in a stadium), G9 (everything in one cell).
#[test]
fn a_small_model_in_a_large_hall_is_hit_like_any_other() {
    for ratio in [1e-3, 1e-6] {
        let shapes = teapot_in_a_stadium(ratio);
        let mut r = Random::new(45);
        let (small, n) = (shapes.triangles.len() - 12, count(150, 20_000));
        let mut rays = rays(&shapes, 4);
        rays.extend((0..n).map(|_| towards(r.cube(), shapes.vertices[r.below(200)])));
        rays.extend(
            (0..n).map(|_| towards(shapes.vertices[r.below(200)] + r.cube() * ratio, shapes.vertices[r.below(200)])),
        );
        assert_grids_agree(&format!("1 : {ratio}"), &shapes, &rays);
        let seen = closest(&Unculled::new(&shapes), &rays).iter().filter(|h| (h.prim as usize) < small).count();
        assert!(seen > n / 2, "{seen} of {n}");
    }
}

/// G10 (sizes from 10⁻⁶ to 10⁶).
#[test]
fn the_longest_and_the_shortest_triangle_are_both_seen() {
    let shapes = mesh(
        vec![
            Vec3::new(-5e5, -1.0, 1.0),
            Vec3::new(5e5, -1.0, 1.0),
            Vec3::new(0.0, 1.0, 1.0),
            Vec3::new(0.3, 0.2, 0.5),
            Vec3::new(0.3 + 1e-6, 0.2, 0.5),
            Vec3::new(0.3, 0.2 + 1e-6, 0.5),
        ],
        vec![[0, 1, 2], [3, 4, 5]],
    );
    let small = (shapes.vertices[3] + shapes.vertices[4] + shapes.vertices[5]) / 3.0;
    let rays = [
        towards(small - Vec3::Z, small),
        towards(Vec3::new(3e5, -0.9, 0.0), Vec3::new(3e5, -0.9, 1.0)),
        towards(small + Vec3::Z * 0.25, small),
    ];
    assert_eq!(assert_exact("sizes", &shapes, &rays, 0.501), 3);
    let hit: Vec<u32> = closest(&Unculled::new(&shapes), &rays).iter().map(|h| h.prim).collect();
    assert_eq!(hit, [1, 0, 1]);
    assert_grids_agree("sizes", &shapes, &rays);
}

/// G11 (soups).
#[test]
fn random_soups_of_any_number_are_hit_as_by_brute_force() {
    let sizes: &[u32] = if is_long() { &[1, 2, 3, 10, 100, 1000, 10_000] } else { &[1, 2, 5, 30, 300] };
    for &n in sizes {
        let shapes = soup(n, 0.7);
        assert_grids_agree(&format!("{n}"), &shapes, &rays(&shapes, count(12, 2000)));
    }
}

/// G13 (ray origins).
#[test]
fn rays_may_start_in_a_cell_behind_the_scene_or_very_far_away() {
    let shapes = mix();
    let mut r = Random::new(46);
    let mut rays = Vec::new();
    for _ in 0..count(60, 5000) {
        let (from, d) = (shapes.vertices[r.below(shapes.vertices.len())], r.direction());
        rays.extend([
            ray(from, d),
            ray(d * 3.0, d),
            ray(d * 1e9, -d),
            ray(d * 1e9, d),
            towards(d * 1e9, from),
            towards(d * 3e12, from),
        ]);
    }
    assert_grids_agree("starts", &shapes, &rays);
}

/// G14 (invariants): each prim is listed exactly in the cells it overlaps, and lies inside every box above it.
#[test]
fn every_structure_over_every_scene_is_sound() {
    for (name, shapes) in all() {
        with_every_kind(&shapes, |kind, accel| {
            let stats = accel.check().unwrap_or_else(|e| panic!("{name}, {kind}: {e}"));
            assert_eq!(stats, accel.summary(), "{name}, {kind}");
        });
    }
}
