//! Tests that every structure must pass.

mod catalogue;
mod cones;
mod hierarchy;
mod mailbox;
pub(crate) mod scenes;
mod starts;
mod transform;
mod volumes;
mod watertight;

use super::wide::ALIKE;
use super::*;
use crate::math::random::Random;
use crate::math::shear::RaySpace;
use crate::math::simd::Level;
use scenes::{all, broken_rays, rays};

const PARAMS: [GridParams; 5] = [
    GridParams::DEFAULT,
    GridParams { density: 4.0, max_resolution: 64, max_depth: 0, step_cost: 2.0, ..GridParams::DEFAULT },
    GridParams { density: 0.01, max_resolution: 1, max_depth: 7, step_cost: 0.5, ..GridParams::DEFAULT },
    GridParams { density: 0.3, max_resolution: 4, max_depth: 10, step_cost: 1.0, ..GridParams::DEFAULT },
    GridParams { dims: Some([1, 2, 1]), max_depth: 5, leaf_size: Some(1), assign: Assign::Box, ..GridParams::DEFAULT },
];

/// Filter by which a prim that is not opaque blocks every third ray, depending on the prim's number.
pub(crate) struct Sieve;

impl OccludedFilter for Sieve {
    fn stops(&self, ray: usize, prim: u32) -> bool {
        (ray + prim as usize * 7).is_multiple_of(3)
    }
}

/// Answers of all queries as bits: first hit, occlusion by opaque prims, the hit after the first, and occlusion through
/// [`Sieve`].
pub(crate) fn answers<A: Accel>(accel: &A, rays: &[Ray]) -> Vec<[u32; 10]> {
    let mut scratch = accel.scratch();
    let mut first = vec![Hit::MISS; rays.len()];
    let mut occluded = vec![false; rays.len()];
    let mut stopped = vec![false; rays.len()];
    let mut second = first.clone();
    accel.occluded_filtered(rays, Some(&Sieve), &mut stopped, &mut scratch, &mut NoProbe);
    accel.closest(rays, &mut first, &mut scratch, &mut NoProbe);
    accel.occluded(rays, &mut occluded, &mut scratch, &mut NoProbe);
    accel.next(rays, &first, &mut second, &mut scratch, &mut NoProbe);
    let row = |(((a, b), c), d): (((&Hit, &bool), &Hit), &bool)| {
        let ([t, u, v, p], [t2, u2, v2, p2]) = (a.bits(), c.bits());
        [t, u, v, p, u32::from(*b), t2, u2, v2, p2, u32::from(*d)]
    };
    first.iter().zip(&occluded).zip(&second).zip(&stopped).map(row).collect()
}

/// Number of rays whose answers differ from brute force.
pub(crate) fn wrong<A: Accel>(accel: &A, shapes: &Shapes, rays: &[Ray]) -> usize {
    let expected = answers(&Unculled::new(shapes), rays);
    answers(accel, rays).iter().zip(&expected).filter(|(got, expected)| got != expected).count()
}

/// `n` rays towards corners of a mesh, from a distance of `times` its size, log-uniformly distributed.
pub(crate) fn far_rays(shapes: &Shapes, n: usize, times: std::ops::Range<f32>) -> Vec<Ray> {
    let mut r = Random::new(12);
    let size = shapes.vertices.iter().fold(0.0, |m: f32, v| m.max(v.abs().max_element()));
    let (near, far) = (libm::log2f(times.start), libm::log2f(times.end));
    (0..n)
        .map(|_| {
            let target = shapes.vertices[r.below(shapes.vertices.len())];
            let origin = r.direction() * (libm::exp2f(near + (far - near) * r.unit()) * size);
            scenes::ray(origin, target - origin)
        })
        .collect()
}

fn assert_same(what: &str, rays: &[Ray], got: &[[u32; 10]], expected: &[[u32; 10]]) {
    for ((ray, got), expected) in rays.iter().zip(got).zip(expected) {
        assert_eq!(got, expected, "{what}, {ray:?}");
    }
}

#[test]
fn a_ray_is_stopped_by_whatever_it_hits_that_is_opaque_or_has_no_hole_there() {
    let mut told_apart = 0;
    for (name, shapes) in all() {
        let rays = rays(&shapes, 5);
        let accel = Unculled::new(&shapes);
        let stops = |(i, ray): (usize, &Ray)| {
            let (mut stops, mut hit) = ([false; 2], [Hit::BEFORE_ALL]);
            loop {
                let after = hit;
                accel.next(&[*ray], &after, &mut hit, &mut (), &mut NoProbe);
                if !hit[0].is_some() {
                    return stops;
                }
                let opaque = shapes.opaque.get_or_set(hit[0].prim);
                stops = [stops[0] || opaque, stops[1] || opaque || Sieve.stops(i, hit[0].prim)];
            }
        };
        let stops: Vec<[bool; 2]> = rays.iter().enumerate().map(stops).collect();
        let got: Vec<[bool; 2]> = answers(&accel, &rays).iter().map(|a| [a[4] == 1, a[9] == 1]).collect();
        assert_eq!(got, stops, "{name}");
        told_apart += stops.iter().filter(|[opaque, all]| opaque != all).count();
    }
    assert!(told_apart > 40, "{told_apart}");
}

#[test]
fn every_kind_of_structure_agrees_with_brute_force_bit_for_bit() {
    for (name, shapes) in all() {
        let rays = rays(&shapes, 30);
        let expected = answers(&Unculled::new(&shapes), &rays);
        for kind in AccelKind::ALL {
            let accel = AnyAccel::build(kind, &shapes, &AccelParams::DEFAULT);
            assert!(accel.check().is_ok(), "{name}, {kind}: {:?}", accel.check());
            let rays = if kind.is_slow() { &rays[..rays.len() / 4] } else { &rays };
            assert_same(&format!("{name}, {kind}"), rays, &answers(&accel, rays), &expected);
        }
    }
}

#[test]
fn every_grid_agrees_with_brute_force_bit_for_bit() {
    for (name, shapes) in all() {
        let rays = rays(&shapes, 40);
        let expected = answers(&Unculled::new(&shapes), &rays);
        for params in &PARAMS {
            let grid = <GridOctree>::build(&shapes, params);
            assert!(grid.check().is_ok(), "{name}: {:?}", grid.check());
            let plain = grid.clone().with_mailbox(MailboxKind::None);
            for got in [answers(&grid, &rays), answers(&plain, &rays)] {
                assert_same(&format!("{name}, {params:?}"), &rays, &got, &expected);
            }
        }
    }
}

#[test]
fn every_wide_tree_agrees_with_brute_force_bit_for_bit_on_every_instruction_set() {
    for (name, shapes) in all() {
        let rays = rays(&shapes, 100);
        let expected = answers(&Unculled::new(&shapes), &rays);
        // Split like large scenes, with octree planes all the way down, and like small ones.
        let trees = [(Splitting::Octree, ALIKE), (Splitting::Octree, 1), (Splitting::SurfaceArea, 1)];
        for (splitting, times) in trees {
            let tree = Wide::build_sample(&shapes, splitting, times);
            assert!(tree.check().is_ok(), "{name}: {:?}", tree.check());
            for level in Level::all() {
                let got = answers(&tree.clone().at_level(level), &rays);
                assert_same(&format!("{name}, {splitting:?} × {times}, {}", level.name()), &rays, &got, &expected);
            }
        }
    }
}

#[test]
fn counts_of_a_wide_tree_do_not_depend_on_the_instruction_set() {
    let shapes = scenes::soup(700, 0.4);
    let rays = rays(&shapes, 100);
    let count = |level| {
        let tree = Wide::build(&shapes, Splitting::Octree).at_level(level);
        let mut counts = RayCounts::default();
        tree.closest(&rays, &mut vec![Hit::MISS; rays.len()], &mut tree.scratch(), &mut counts);
        counts
    };
    let expected = count(Level::PORTABLE);
    assert!(expected.n_it > 1000 && expected.n_bit == 8 * (expected.n_ts - expected.n_ets), "{expected:?}");
    Level::all().into_iter().for_each(|level| assert_eq!(count(level), expected, "{}", level.name()));
}

#[test]
fn a_wide_tree_culls_nearly_everything_and_lists_each_prim_once() {
    let shapes = scenes::star(100, 50);
    let rays = rays(&shapes, 20);
    for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
        let tree = Wide::build(&shapes, splitting);
        let mut counts = RayCounts::default();
        tree.closest(&rays, &mut vec![Hit::MISS; rays.len()], &mut tree.scratch(), &mut counts);
        assert!(counts.n_it * 50 < counts.queries * shapes.len() as u64, "{splitting:?}: {counts:?}");
        let stats = tree.summary();
        assert_eq!(stats.n_oiv, u64::from(shapes.bounded()));
        assert!(stats.n_v < stats.n_oiv / 4 && stats.depth < 12 && stats.n_ev == 0, "{splitting:?}: {stats:?}");
    }
}

#[test]
fn scenes_are_hit_at_all() {
    for (name, shapes) in all() {
        let rays = rays(&shapes, 40);
        let hits = answers(&Unculled::new(&shapes), &rays).iter().filter(|a| a[3] != NO_PRIM).count();
        let solid = !["empty", "a point", "a line"].contains(&name);
        assert_eq!(hits > rays.len() / 10, solid, "{name}: {hits} of {}", rays.len());
    }
}

#[test]
fn rays_that_are_not_numbers_or_go_nowhere_miss() {
    let shapes = scenes::mix();
    let rays = broken_rays();
    let grid: GridOctree = GridOctree::build(&shapes, &GridParams::default());
    let tree = Wide::build(&shapes, Splitting::Octree);
    let all = [answers(&grid, &rays), answers(&tree, &rays), answers(&Unculled::new(&shapes), &rays)];
    for answer in all.into_iter().flatten() {
        assert_eq!((answer[3], answer[4], answer[8], answer[9]), (NO_PRIM, 0, NO_PRIM, 0));
    }
}

#[test]
fn among_copies_of_a_triangle_the_lowest_is_hit_and_the_next_follow_in_order() {
    let shapes = scenes::copies(100);
    let grid: GridOctree = GridOctree::build(&shapes, &GridParams::default());
    let ray = [scenes::ray(Vec3::new(0.4, 0.3, 1.0), Vec3::NEG_Z)];
    let (mut scratch, mut hit) = (grid.scratch(), [Hit::MISS]);
    grid.closest(&ray, &mut hit, &mut scratch, &mut NoProbe);
    for prim in 0..100 {
        assert_eq!(hit[0].prim, prim);
        let after = hit;
        grid.next(&ray, &after, &mut hit, &mut scratch, &mut NoProbe);
    }
    assert_eq!(hit[0], Hit::MISS);
}

#[test]
fn prims_beyond_the_end_of_the_bits_are_opaque() {
    for len in [0, 1, 63, 64, 65] {
        for value in [false, true] {
            let bits = BitSet::filled(len, value);
            assert!((0..len).all(|i| bits.get_or_set(i as u32) == value), "{len}");
            assert!((len..len + 130).all(|i| bits.get_or_set(i as u32)), "{len}");
        }
    }
}

#[test]
fn shapes_without_a_word_on_it_are_opaque() {
    let shapes = scenes::soup(300, 0.4);
    let silent = Shapes { opaque: BitSet::default(), ..shapes.clone() };
    let opaque = Shapes { opaque: BitSet::filled(shapes.len(), true), ..shapes };
    let rays = rays(&opaque, 20);
    for kind in AccelKind::ALL {
        let occluded = |shapes| {
            let (accel, mut occluded) = (AnyAccel::build(kind, shapes, &AccelParams::DEFAULT), vec![false; rays.len()]);
            accel.occluded(&rays, &mut occluded, &mut accel.scratch(), &mut NoProbe);
            occluded
        };
        let found = occluded(&silent);
        assert!(found == occluded(&opaque) && found.iter().any(|&b| b), "{kind}");
    }
}

#[test]
fn the_next_hit_before_all_is_the_first() {
    let shapes = scenes::mix();
    let mut rays = rays(&shapes, 20);
    rays.iter_mut().step_by(3).for_each(|ray| ray.t_min = 1.5);
    for kind in AccelKind::ALL {
        let accel = AnyAccel::build(kind, &shapes, &AccelParams::DEFAULT);
        let (mut first, mut next) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
        let mut scratch = accel.scratch();
        accel.closest(&rays, &mut first, &mut scratch, &mut NoProbe);
        accel.next(&rays, &vec![Hit::BEFORE_ALL; rays.len()], &mut next, &mut scratch, &mut NoProbe);
        let bits = |hits: &[Hit]| hits.iter().map(Hit::bits).collect::<Vec<_>>();
        assert!(bits(&first) == bits(&next) && first.iter().any(Hit::is_some), "{kind}");
    }
}

#[test]
#[should_panic(expected = "a hit before and after for each ray")]
fn answers_that_are_fewer_than_rays_are_a_mistake() {
    let shapes = scenes::mix();
    let accel = AnyAccel::build(AccelKind::DEFAULT, &shapes, &AccelParams::DEFAULT);
    accel.closest(&rays(&shapes, 2), &mut [Hit::MISS; 1], &mut accel.scratch(), &mut NoProbe);
}

#[test]
fn a_direction_too_small_for_boxes_finds_its_way_without_triangles() {
    let spheres = vec![SpherePrim { center: Vec3::ZERO, radius: 1.0 }];
    let shapes = Shapes { spheres, opaque: BitSet::filled(1, true), ..Shapes::default() };
    let rays =
        [scenes::ray(Vec3::new(0.0, 0.0, 2e-39), Vec3::splat(1e-39)), scenes::ray(Vec3::ONE, Vec3::splat(-1e-39))];
    let tree = Wide::build(&shapes, Splitting::Octree);
    assert!(tree.check().is_ok());
    assert_eq!(answers(&tree, &rays), answers(&Unculled::new(&shapes), &rays));
}

#[test]
fn a_sphere_is_left_behind_where_it_was_entered() {
    let mut shapes = Shapes { spheres: vec![SpherePrim { center: Vec3::ZERO, radius: 1.0 }], ..Shapes::default() };
    shapes.opaque = BitSet::filled(1, true);
    let grid: GridOctree = GridOctree::build(&shapes, &GridParams::default());
    let ray = [scenes::ray(Vec3::new(0.0, 0.0, 4.0), Vec3::NEG_Z)];
    let (mut scratch, mut first, mut second) = (grid.scratch(), [Hit::MISS], [Hit::MISS]);
    grid.closest(&ray, &mut first, &mut scratch, &mut NoProbe);
    grid.next(&ray, &first, &mut second, &mut scratch, &mut NoProbe);
    assert_eq!((first[0].t, second[0].t), (3.0, 5.0));
}

#[test]
fn a_ray_through_empty_space_counts_cells_but_no_tests() {
    let shapes = scenes::star(24, 16);
    let grid: GridOctree = GridOctree::build(&shapes, &GridParams::default());
    let mut counts = RayCounts::default();
    let short = Ray { t_max: 0.5, ..scenes::ray(Vec3::ZERO, Vec3::new(0.3, 0.2, 0.1)) };
    grid.closest(&[short], &mut [Hit::MISS], &mut grid.scratch(), &mut counts);
    assert_eq!((counts.queries, counts.found, counts.n_it, counts.n_bit), (1, 0, 0, 0));
    assert!(counts.n_ets >= 1 && counts.n_ets == counts.n_eets && counts.n_ts >= counts.n_ets);
}

#[test]
fn prims_that_cannot_be_parted_do_not_fill_the_memory() {
    let shapes = scenes::copies(3000);
    for params in &PARAMS {
        let stats = <GridOctree>::build(&shapes, params).summary();
        assert!(stats.n_oiv <= 14 * 3000, "{stats:?}");
    }
}

#[test]
fn a_structure_does_not_depend_on_the_number_of_threads() {
    let shapes = scenes::soup(9000, 0.1);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let built = |kind| format!("{:?}", AnyAccel::build(kind, &shapes, &AccelParams::DEFAULT));
        pool.map(|p| p.install(|| AccelKind::ALL.map(built).concat()))
    };
    let texts = [1, 2, 7].map(|threads| build(threads).unwrap_or_default());
    assert!(!texts[0].is_empty() && texts[0] == texts[1] && texts[0] == texts[2]);
}
