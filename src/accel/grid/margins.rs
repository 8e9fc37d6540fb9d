//! Tests that each margin of building and walking is needed: with the derived margins every answer equals brute force, and
//! without any one of them some answers do not.

use super::lattice::CellMargins;
use super::{GridOctree, GridParams};
use crate::accel::tests::scenes::{mesh, moved, ray, soup};
use crate::accel::tests::{far_rays, wrong};
use crate::accel::{Accel as _, Hit, Probe, Ray, Shapes};
use crate::math::Vec3;
use crate::math::random::Random;

const DERIVED: CellMargins = CellMargins::DERIVED;

/// Eight cells on each axis, no octrees.
pub(in crate::accel) const EIGHT: GridParams = GridParams {
    density: 64.0,
    max_resolution: 8,
    max_depth: 0,
    step_cost: 1.0,
    leaf_size: None,
    ..GridParams::DEFAULT
};

fn wrong_with(margins: CellMargins, params: &GridParams, shapes: &Shapes, rays: &[Ray]) -> usize {
    wrong(&<GridOctree>::build_within(shapes, params, margins), shapes, rays)
}

/// Asserts that the derived margins lose nothing and the shrunk ones do.
fn assert_needed(name: &str, shrunk: CellMargins, params: &GridParams, shapes: &Shapes, rays: &[Ray]) {
    assert_eq!(wrong_with(DERIVED, params, shapes, rays), 0, "{name} as derived");
    assert!(wrong_with(shrunk, params, shapes, rays) > 0, "{name}: nothing goes wrong with {shrunk:?}");
}

/// Width of the cells of [`EIGHT`] over content of size 1.
///
/// The width and the grid's start at −1/256, and so the planes between cells, are exact in `f32`, while the scale is not.
pub(in crate::accel) const WIDTH: f32 = 129.0 / 1024.0;

/// Position of the plane before cell `k` of [`EIGHT`] over the unit cube.
pub(in crate::accel) fn plane(k: usize) -> f32 {
    k as f32 * WIDTH - 1.0 / 256.0
}

/// Faces in the planes between the cells of [`EIGHT`], and rays along the diagonals of these planes through cell corners.
pub(in crate::accel) fn faces_between_cells() -> (Shapes, Vec<Ray>) {
    let mut r = Random::new(13);
    let corner = |r: &mut Random| Vec3::from_array([0, 1, 2].map(|_| plane(1 + r.below(7))));
    let mut vertices =
        vec![Vec3::ZERO, Vec3::X * 0.01, Vec3::Y * 0.01, Vec3::ONE, Vec3::ONE - 0.01, Vec3::new(1.0, 0.99, 1.0)];
    let mut triangles = vec![[0, 1, 2], [3, 4, 5]];
    for i in 0..60 {
        let (at, base) = (corner(&mut r), vertices.len() as u32);
        let sign = |bit: usize| if i >> bit & 1 == 0 { WIDTH } else { -WIDTH };
        let [u, v] = [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)]
            .map(|(a, b)| [a * sign(0), b * sign(1)])[i % 3];
        vertices.extend([at, at + u, at + v]);
        triangles.push([base, base + 1, base + 2]);
    }
    let mut rays = Vec::new();
    for _ in 0..600 {
        let at = corner(&mut r);
        let dir = Vec3::from_array([0, 1, 2].map(|_| [-1.0f32, 0.0, 1.0, 1.0, -1.0][r.below(5)]));
        if dir != Vec3::ZERO {
            rays.extend([ray(at, dir), ray(at - dir * (3.0 * WIDTH), dir)]);
        }
    }
    (mesh(vertices, triangles), rays)
}

/// G12 (padding).
#[test]
fn without_padding_rays_through_corners_of_cells_miss_what_lies_in_their_faces() {
    let (shapes, rays) = faces_between_cells();
    for pad in [0.0, -0.02] {
        assert_needed("pad", CellMargins { pad, ..DERIVED }, &EIGHT, &shapes, &rays);
    }
}

#[test]
fn a_zero_in_a_direction_that_stays_zero_loses_what_lies_in_the_planes_of_cells() {
    let (shapes, rays) = faces_between_cells();
    assert_needed("no slope", CellMargins { no_slope: 0.0, ..DERIVED }, &EIGHT, &shapes, &rays);
}

/// Rays that only touch a grid exactly as large as its content miss it.
#[test]
fn without_room_around_the_content_rays_through_its_corners_miss_it() {
    let mut r = Random::new(14);
    let size = Vec3::new(1.0, 717.0 / 1024.0, 301.0 / 1024.0);
    let corner = |i: u32| Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 0 { 0.0 } else { size[k] }));
    let inwards = |i: u32| corner(i) + (size * 0.5 - corner(i)) * 0.125;
    let vertices = (0..8).flat_map(|i| [corner(i), inwards(i), inwards(i) + Vec3::X * 0.03125]).collect();
    let shapes = mesh(vertices, (0..8).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    // Multiples of 1/1024, so that the ray passes exactly through the corner.
    let mut aim = |i: u32| {
        let origin = (r.cube() * 8192.0).round() / 1024.0;
        ray(origin, corner(i % 8) - origin)
    };
    let rays: Vec<Ray> = (0..2000).map(&mut aim).collect();
    assert_needed("room", CellMargins { room: 0.0, ..DERIVED }, &GridParams::DEFAULT, &shapes, &rays);
}

/// From so far away that one ulp of t spans many cells, hits in several of them are equally near.
#[test]
fn a_walk_that_stops_at_the_best_hit_or_before_it_misses_others_as_near() {
    let shapes = soup(700, 0.4);
    let far = far_rays(&shapes, 400, 1e4..1e7);
    assert_needed("lag", CellMargins { lag: 0.0, ..DERIVED }, &GridParams::DEFAULT, &shapes, &far);
    let near = far_rays(&shapes, 400, 10.0..1000.0);
    assert_needed("0.1 % early", CellMargins { lag: -0.001, ..DERIVED }, &GridParams::DEFAULT, &shapes, &near);
}

/// Distances so small that an ulp is no fraction of them.
#[test]
fn a_walk_through_the_smallest_numbers_misses_hits_that_are_as_near() {
    let shapes = moved(soup(700, 0.4), 1e-20, Vec3::ZERO);
    let mut r = Random::new(17);
    let mut aim = || {
        let origin = r.direction() * 3e-20;
        // Directions so long that the whole scene lies within a few of the smallest distances.
        ray(origin, (r.cube() * 1e-20 - origin) * 1e30 * [1e13, 1e14][r.below(2)])
    };
    let rays: Vec<Ray> = (0..8000).map(|_| aim()).collect();
    assert_needed("underflow", CellMargins { underflow: 0.0, ..DERIVED }, &GridParams::DEFAULT, &shapes, &rays);
}

/// From 2^60 lengths away not even `f64` resolves the cells that a ray passes.
#[test]
fn rays_from_very_far_away_are_not_led_through_cells() {
    let shapes = soup(700, 0.4);
    let mut rays = Vec::new();
    for i in 0..26 {
        let dir = Vec3::from_array([i, i / 3, i / 9].map(|k| (k % 3) as f32 - 1.0));
        if dir != Vec3::ZERO {
            rays.extend([40, 50, 60, 100].map(|exponent| ray(dir * -(2.0f32.powi(exponent)), dir)));
        }
    }
    assert_needed(
        "ray cells",
        CellMargins { ray_cells: f64::INFINITY, ..DERIVED },
        &GridParams::DEFAULT,
        &shapes,
        &rays,
    );
}

/// Probe that panics after 5000 steps.
#[derive(Default)]
struct Patience(u32);

impl Probe for Patience {
    fn step(&mut self) {
        self.0 += 1;
        assert!(self.0 < 5000, "the walk does not end");
    }
}

/// Walks the rays through an octree of eight finest cells on each axis.
fn walk_octants(guarded: bool) {
    let (shapes, rays) = faces_between_cells();
    let params = GridParams { max_resolution: 1, max_depth: 3, step_cost: 0.1, ..EIGHT };
    let grid = <GridOctree>::build_within(&shapes, &params, CellMargins { guarded, ..DERIVED });
    for ray in rays {
        grid.closest(&[ray], &mut [Hit::MISS], &mut grid.scratch(), &mut Patience::default());
    }
}

/// G12 (progress).
#[test]
#[should_panic(expected = "the walk does not end")]
fn a_walk_that_may_leave_a_cell_anywhere_does_not_end() {
    walk_octants(false);
}

#[test]
fn a_walk_that_leaves_each_cell_through_the_face_it_meets_first_ends() {
    walk_octants(true);
}
