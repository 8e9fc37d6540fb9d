//! However the rays of a wave are traced, on whatever instruction set: the answers are those of brute force.

use super::flight::FARTHEST_FIRST;
use super::{MANY, RayOrder, Splitting, Wide};
use crate::accel::tests::scenes;
use crate::accel::{Accel, Hit, NoProbe, Ray, Shapes, Unculled};
use crate::math::Vec3;
use crate::math::simd::Level;

const WAYS: [RayOrder; 4] = [RayOrder::OneByOne, RayOrder::InFlight, RayOrder::Packets, RayOrder::Adaptive];

/// First hits, the hits behind them, and what is blocked.
fn answers<A: Accel>(accel: &A, rays: &[Ray]) -> String {
    let mut scratch = accel.scratch();
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest(rays, &mut hits, &mut scratch, &mut NoProbe);
    let mut behind = vec![Hit::MISS; rays.len()];
    accel.next(rays, &hits, &mut behind, &mut scratch, &mut NoProbe);
    let mut blocked = vec![false; rays.len()];
    accel.occluded(rays, &mut blocked, &mut scratch, &mut NoProbe);
    let bits = |hits: &[Hit]| hits.iter().map(Hit::bits).collect::<Vec<_>>();
    format!("{:?} {:?} {blocked:?}", bits(&hits), bits(&behind))
}

/// For some rays sixteen side by side that start with them, every other time each from a place of its own: most bundles
/// run alike, some straddle an octant.
fn bundles(rays: &[Ray]) -> Vec<Ray> {
    let bundle = |(i, ray): (usize, &Ray)| {
        let (ray, width) = (*ray, ray.dir.length() * 0.03);
        let side =
            move |k: usize| Vec3::new(0.3, -0.2, 0.1) * (k % 4) as f32 + Vec3::new(0.0, 0.1, 0.2) * (k / 4) as f32;
        let apart = width * (i % 2) as f32;
        (0..16).map(move |k| Ray { origin: ray.origin - side(k) * apart, dir: ray.dir + side(k) * width, ..ray })
    };
    rays.iter().step_by(5).enumerate().flat_map(bundle).filter(|r| r.dir != Vec3::ZERO).collect()
}

fn assert_all_ways_agree(name: &str, shapes: &Shapes, rays: &[Ray]) {
    let expected = answers(&Unculled::new(shapes), rays);
    for level in Level::all() {
        for way in WAYS {
            let wide = Wide::build(shapes, Splitting::SurfaceArea).at_level(level).with_rays(way);
            assert!(answers(&wide, rays) == expected, "{name}: {way:?} on {}", level.name());
        }
    }
}

#[test]
fn rays_in_flight_and_in_packets_hit_what_brute_force_hits() {
    for (name, shapes) in scenes::all() {
        assert_all_ways_agree(name, &shapes, &scenes::rays(&shapes, 6));
    }
}

#[test]
fn rays_that_run_alike_hit_what_brute_force_hits() {
    for (name, shapes) in scenes::all() {
        let rays = bundles(&scenes::rays(&shapes, 6));
        assert_all_ways_agree(name, &shapes, &rays);
    }
}

#[test]
fn a_wave_may_be_of_any_length() {
    let shapes = scenes::soup(60, 0.4);
    let rays = bundles(&scenes::rays(&shapes, 2));
    for count in [0, 1, 15, 16, 17, 40] {
        assert_all_ways_agree("soup", &shapes, &rays[..count]);
    }
}

#[test]
fn a_wave_goes_in_packets_where_rays_run_alike_and_in_flight_where_not_and_there_are_many() {
    let shapes = scenes::soup(60, 0.4);
    let of = |rays: &[Ray]| {
        let mut hits = vec![Hit::MISS; rays.len()];
        RayOrder::of(&crate::accel::wave::ForFirst { rays, hits: &mut hits, test: crate::accel::intersector::Exact })
    };
    let mixed = scenes::rays(&shapes, 40);
    assert_eq!((of(&mixed[..MANY]), of(&mixed[..MANY - 1])), (RayOrder::InFlight, RayOrder::OneByOne));
    let toward = |k: usize| Ray { dir: Vec3::new(1.0, 2.0 + k as f32 * 0.01, 3.0), ..mixed[0] };
    assert_eq!(of(&(0..64).map(toward).collect::<Vec<_>>()), RayOrder::Packets);
    assert_eq!(of(&mixed[..9]), RayOrder::OneByOne);
}

#[test]
fn orders_list_the_lanes_of_a_mask_the_farthest_first() {
    for (octant, orders) in FARTHEST_FIRST.iter().enumerate() {
        for (mask, order) in orders.iter().enumerate() {
            let lanes: Vec<usize> = (0..mask.count_ones()).map(|k| (order >> (8 * k)) as usize & 255).collect();
            assert_eq!(lanes.iter().fold(0, |m, lane| m | 1 << lane), mask);
            assert!(lanes.windows(2).all(|w| w[0] ^ octant > w[1] ^ octant), "{octant} {mask} {lanes:?}");
        }
    }
}
