//! Every trace mode on every instruction set gives the answers of brute force.

use super::entry_point::GROUP;
use super::flight::{DEPTH, FARTHEST_FIRST};
use super::{ASKED, MANY, Splitting, TraceMode, Wide};
use crate::accel::tests::Sieve;
use crate::accel::tests::scenes::{self, ray};
use crate::accel::{Accel, Hit, HitQueries, IntersectFilter, NoProbe, Pencil, Ray, Shapes, Unculled};
use crate::math::Vec3;
use crate::math::random::Random;
use crate::math::simd::{Level, WIDE};

const MODES: [TraceMode; 4] = [TraceMode::OneByOne, TraceMode::InFlight, TraceMode::Packets, TraceMode::Adaptive];

/// First hits, the hits behind them, occlusion, and occlusion with a filter that lets light through some of the other prims.
fn answers<A: Accel>(accel: &A, rays: &[Ray]) -> String {
    let mut scratch = accel.scratch();
    let hits = first_hits(accel, rays);
    let mut behind = vec![Hit::MISS; rays.len()];
    accel.next(rays, &hits, &mut behind, &mut scratch, &mut NoProbe);
    let mut occluded = vec![false; rays.len()];
    accel.occluded(rays, &mut occluded, &mut scratch, &mut NoProbe);
    let mut stopped = vec![false; rays.len()];
    accel.occluded_filtered(rays, Some(&Sieve), &mut stopped, &mut scratch, &mut NoProbe);
    let bits = |hits: &[Hit]| hits.iter().map(Hit::bits).collect::<Vec<_>>();
    format!("{:?} {:?} {occluded:?} {stopped:?}", bits(&hits), bits(&behind))
}

fn first_hits<A: Accel>(accel: &A, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest(rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
    hits
}

/// For some of the rays, sixteen side by side that start with them, for every other one from separate origins: most packets
/// run alike, some straddle an octant.
fn packets(rays: &[Ray]) -> Vec<Ray> {
    side_by_side(rays, 16)
}

/// For each ray, a packet of `count` rays.
fn side_by_side(rays: &[Ray], count: usize) -> Vec<Ray> {
    let packet = |(i, ray): (usize, &Ray)| {
        let (ray, width) = (*ray, ray.dir.length() * 0.03);
        let side =
            move |k: usize| Vec3::new(0.3, -0.2, 0.1) * (k % 4) as f32 + Vec3::new(0.0, 0.1, 0.2) * (k / 4) as f32;
        let apart = width * (i % 2) as f32;
        (0..count).map(move |k| Ray { origin: ray.origin - side(k) * apart, dir: ray.dir + side(k) * width, ..ray })
    };
    rays.iter().step_by(5).enumerate().flat_map(packet).filter(|r| r.dir != Vec3::ZERO).collect()
}

fn assert_all_modes_agree(name: &str, shapes: &Shapes, rays: &[Ray]) {
    let expected = answers(&Unculled::new(shapes), rays);
    for level in Level::all() {
        for way in MODES {
            let wide = Wide::build(shapes, Splitting::SurfaceArea).at_level(level).with_rays(way);
            assert!(answers(&wide, rays) == expected, "{name}: {way:?} on {}", level.name());
        }
    }
}

#[test]
fn rays_in_flight_and_in_packets_hit_what_brute_force_hits() {
    for (name, shapes) in scenes::all() {
        assert_all_modes_agree(name, &shapes, &scenes::rays(&shapes, 6));
    }
}

#[test]
fn rays_that_run_alike_hit_what_brute_force_hits() {
    for (name, shapes) in scenes::all() {
        for count in [16, 32, 80] {
            let rays = side_by_side(&scenes::rays(&shapes, 6), count);
            assert_all_modes_agree(name, &shapes, &rays);
        }
    }
}

/// In packets of sixteen or thirty-two rays that run alike, some rays, perhaps the first, run backwards or along another
/// axis, have no range, or have an origin for which boxes cannot be tested.
#[test]
fn rays_among_others_that_run_otherwise_hit_what_brute_force_hits() {
    let mut r = Random::new(72);
    for (name, shapes) in scenes::all() {
        for count in [16, 32] {
            let alike = side_by_side(&scenes::rays(&shapes, 4), count);
            let mut rays: Vec<Ray> = Vec::new();
            for (i, packet) in alike.chunks(count).enumerate() {
                let apart = [1, 2, 7, 8, 9, 15][i % 6] * count / 16;
                let mut packet = packet.to_vec();
                for _ in 0..apart {
                    let (k, ray) = (r.below(packet.len()), packet[0]);
                    packet[k] = match r.below(5) {
                        0 => Ray { dir: -ray.dir, ..ray },
                        1 => Ray { dir: Vec3::new(ray.dir.y, ray.dir.z, ray.dir.x), ..ray },
                        2 => Ray { t_min: 2.0, t_max: 1.0, ..ray },
                        3 => Ray { t_max: f32::NAN, ..ray },
                        _ => Ray { origin: ray.origin * 1e30, ..ray },
                    };
                }
                rays.extend(packet);
            }
            assert_all_modes_agree(name, &shapes, &rays);
        }
    }
}

#[test]
fn the_rays_of_a_pencil_hit_what_they_hit_one_by_one() {
    let mut random = Random::new(77);
    for (name, shapes) in scenes::all() {
        let seen = scenes::rays(&shapes, 3);
        for (k, from) in seen.iter().step_by(29).enumerate() {
            let (sharp, along) = ([0.02, 0.3, 3.0][k % 3], k % 4 == 0);
            let turned = |_| {
                let dir = from.dir + random.cube() * (sharp * from.dir.length());
                // Some run along an axis, with zero components.
                ray(
                    from.origin,
                    if along { dir * Vec3::new(1.0, 0.0, if k % 8 == 0 { 0.0 } else { 1.0 }) } else { dir },
                )
            };
            let rays: Vec<Ray> = (0..[75, 64, 17][k % 3]).map(turned).filter(|ray| ray.dir != Vec3::ZERO).collect();
            assert_a_pencil_hits(name, &shapes, &rays, &MODES);
        }
    }
}

/// Asserts that rays of a pencil hit what brute force hits, in every trace mode.
fn assert_a_pencil_hits(name: &str, shapes: &Shapes, rays: &[Ray], ways: &[TraceMode]) {
    let Some(Ray { origin, .. }) = rays.first().copied() else { return };
    let dirs = [0, 1, 2].map(|k| rays.iter().map(|ray| ray.dir[k]).collect::<Vec<f32>>());
    let pencil = Pencil { origin, dirs: dirs.each_ref().map(Vec::as_slice) };
    let expected: Vec<_> = first_hits(&Unculled::new(shapes), rays).iter().map(Hit::bits).collect();
    for (level, &way) in Level::all().into_iter().flat_map(|level| ways.iter().map(move |way| (level, way))) {
        for splitting in [Splitting::SurfaceArea, Splitting::Octree] {
            let wide = Wide::build(shapes, splitting).at_level(level).with_rays(way);
            let mut hits = vec![Hit::MISS; rays.len()];
            let queries = HitQueries { pencil: Some(&pencil), ..HitQueries::along(rays) };
            wide.first_hits(&queries, &mut hits, &mut wide.scratch(), &mut NoProbe);
            let hits: Vec<_> = hits.iter().map(Hit::bits).collect();
            assert!(hits == expected, "{name}: {way:?} on {}", level.name());
        }
    }
}

/// Groups of packets enter the tree together: from outside and from within, wide and narrow, some with a ray that diverges,
/// runs along an axis, or cannot be tested against boxes; some past everything.
#[test]
fn crowds_of_a_pencil_hit_what_brute_force_hits() {
    let mut random = Random::new(78);
    for (name, shapes) in scenes::all() {
        for (k, from) in scenes::rays(&shapes, 2).iter().step_by(37).enumerate() {
            let width = [0.01, 0.1, 0.4][k % 3] * from.dir.length();
            let back = [0.0, 0.0, 5.0][k / 3 % 3];
            let start = ray(from.origin - from.dir * back, from.dir * if k % 7 == 6 { -1.0 } else { 1.0 });
            let mut rays: Vec<Ray> = (0..2 * GROUP + 70)
                .map(|i| Ray { dir: start.dir + random.cube() * (width * if i < GROUP { 1.0 } else { 0.3 }), ..start })
                .map(|ray| if ray.dir == Vec3::ZERO { start } else { ray })
                .collect();
            let odd = [GROUP + 3, 2 * GROUP - 1, 40];
            for at in odd.into_iter().take(k % 4) {
                let dir = rays[at].dir;
                rays[at].dir = match k % 6 {
                    0 => -dir,
                    1 => Vec3::new(dir.x, 0.0, dir.z + 1.0),
                    2 => Vec3::new(f32::NAN, dir.y, dir.z),
                    3 => dir * 1e30,
                    4 => Vec3::new(f32::INFINITY, dir.y, dir.z),
                    _ => dir * 1e-30,
                };
            }
            assert_a_pencil_hits(name, &shapes, &rays, &[TraceMode::Packets]);
        }
    }
}

/// Filter that rejects most hits with prims that are not opaque.
struct Lattice<'s>(&'s Shapes);

impl IntersectFilter for Lattice<'_> {
    fn rejects(&self, ray: usize, prim: u32) -> bool {
        assert!(!self.0.opaque.get_or_set(prim), "nobody asks of what is opaque");
        !(ray + prim as usize * 5).is_multiple_of(4)
    }
}

/// Asserts that rays pass only hits that the filter rejects before the hit they report; returns the number of hits passed.
fn passed(shapes: &Shapes, wide: &Wide, rays: &[Ray], after: Option<&[Hit]>, what: &str) -> usize {
    let (brute, filter) = (Unculled::new(shapes), Lattice(shapes));
    let (mut hits, mut count) = (vec![Hit::MISS; rays.len()], 0);
    let queries = HitQueries { rays, pencil: None, after, filter: Some(&filter) };
    wide.first_hits(&queries, &mut hits, &mut wide.scratch(), &mut NoProbe);
    for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
        let (mut before, mut met) = (after.map_or(Hit::BEFORE_ALL, |after| after[i]), [Hit::MISS]);
        loop {
            brute.next(&[*ray], &[before], &mut met, &mut brute.scratch(), &mut NoProbe);
            if met[0].bits() == hit.bits() {
                break;
            }
            let rejects = met[0].is_some() && !shapes.opaque.get_or_set(met[0].prim) && filter.rejects(i, met[0].prim);
            assert!(rejects, "{what}: ray {i} hits {hit:?} and passes {:?}", met[0]);
            (before, count) = (met[0], count + 1);
        }
    }
    count
}

#[test]
fn rays_that_pass_gaps_hit_what_lies_behind_them() {
    let mut all = [0; MODES.len()];
    for (name, shapes) in scenes::all() {
        let alone = scenes::rays(&shapes, 4);
        let beside = side_by_side(&alone, 32);
        for level in Level::all() {
            for (way, all) in MODES.into_iter().zip(&mut all) {
                let wide = Wide::build(&shapes, Splitting::SurfaceArea).at_level(level).with_rays(way);
                let what = format!("{name}: {way:?} on {}", level.name());
                for rays in [&alone, &beside] {
                    *all += passed(&shapes, &wide, rays, None, &what);
                    let first = first_hits(&wide, rays);
                    *all += passed(&shapes, &wide, rays, Some(&first), &what);
                }
            }
        }
    }
    assert!(all.iter().all(|&count| count > 100), "{all:?}");
}

#[test]
fn a_wave_may_be_of_any_length() {
    let shapes = scenes::soup(60, 0.4);
    let rays = side_by_side(&scenes::rays(&shapes, 2), 48);
    for count in [0, 1, 15, 16, 17, 31, 32, 33, 48, 49, 150] {
        assert_all_modes_agree("soup", &shapes, &rays[..count]);
    }
}

#[test]
fn a_wave_goes_in_packets_where_rays_run_alike_and_in_flight_where_not_and_there_are_many() {
    let shapes = scenes::soup(60, 0.4);
    let of = |rays: &[Ray]| {
        let mut hits = vec![Hit::MISS; rays.len()];
        TraceMode::of(&crate::accel::query_batch::ClosestBatch {
            rays,
            pencil: None,
            filter: None,
            hits: &mut hits,
            test: crate::accel::intersector::Exact,
        })
    };
    let mixed = scenes::rays(&shapes, 40);
    assert_eq!((of(&mixed[..MANY]), of(&mixed[..MANY - 1])), (TraceMode::InFlight, TraceMode::OneByOne));
    let toward = |k: usize| Ray { dir: Vec3::new(1.0, 2.0 + k as f32 * 0.01, 3.0), ..mixed[0] };
    assert_eq!(of(&(0..64).map(toward).collect::<Vec<_>>()), TraceMode::Packets);
    assert_eq!(of(&mixed[..9]), TraceMode::OneByOne);
    // Of long batches a sample of packets is examined, not only the first ones.
    let long = |rays: &dyn Fn(usize) -> Ray| (0..WIDE * ASKED * 3).map(rays).collect::<Vec<_>>();
    let turning = |k: usize| mixed[k % mixed.len()];
    let half = |first: bool| move |k: usize| if (k < WIDE * ASKED) == first { toward(k % 64) } else { turning(k) };
    assert_eq!((of(&long(&toward)), of(&long(&turning))), (TraceMode::Packets, TraceMode::InFlight));
    assert_eq!((of(&long(&half(true))), of(&long(&half(false)))), (TraceMode::InFlight, TraceMode::Packets));
}

#[test]
fn orders_list_the_lanes_of_a_mask_the_farthest_first() {
    for (octant, orders) in FARTHEST_FIRST.iter().enumerate() {
        for (mask, order) in orders.iter().enumerate() {
            let lanes: Vec<usize> = (0..mask.count_ones()).map(|k| (order >> (4 * k)) as usize & 15).collect();
            assert_eq!(lanes.iter().fold(0, |m, lane| m | 1 << lane), mask);
            assert!(lanes.windows(2).all(|w| w[0] ^ octant > w[1] ^ octant), "{octant} {mask} {lanes:?}");
        }
    }
}

/// Rays exactly along axes, or nearly, or along the diagonals of two axes, some from `far` away, whose other coordinates are
/// those of corners: in the planes of boxes, along their edges and through their corners.
fn along_axes(shapes: &Shapes, n: usize, far: f32) -> Vec<Ray> {
    let mut r = Random::new(71);
    let slight = [0.0, -0.0, 1e-12, -1e-12, 1e-20, -1e-26, 1e-30, -1e-30, 1e-9, -1e-9, 1.0, -1.0];
    let mut aim = |i: usize| {
        let mut corner = || shapes.vertices[r.below(shapes.vertices.len())];
        let (mut origin, target) = (Vec3::new(corner().x, corner().y, corner().z), corner());
        let (axis, length) = (i % 3, [1.0, -1.0, 0.1, -30.0][r.below(4)]);
        let mut dir = Vec3::from_array(std::array::from_fn(|_| slight[r.below(slight.len())] * length));
        dir[axis] = length;
        origin[(axis + 1) % 3] = target[(axis + 1) % 3];
        origin[axis] -= [0.0, far * 0.1, far][r.below(3)] * length.signum();
        ray(origin, dir)
    };
    (0..n).map(&mut aim).collect()
}

#[test]
fn rays_along_axes_within_the_planes_of_boxes_hit_what_brute_force_hits() {
    let far = scenes::moved(scenes::lattice(120), 1.0, Vec3::new(300.0, -70.0, 1e5));
    let small = scenes::moved(scenes::lattice(120), 1.0 / 4096.0, Vec3::ZERO);
    let scenes = [
        ("lattice", scenes::lattice(120), 20.0),
        ("lattice far away", far, 20.0),
        ("small lattice", small, 0.01),
        ("soup", scenes::soup(200, 0.4), 5.0),
        ("star", scenes::star(12, 8), 5.0),
    ];
    for (name, shapes, far) in scenes {
        let rays = along_axes(&shapes, 240, far);
        assert_all_modes_agree(name, &shapes, &rays);
        assert_all_modes_agree(name, &shapes, &packets(&rays[..60]));
    }
}

/// Triangles that become ever smaller and nearer to the origin.
fn progression(n: u32, ratio: f32) -> Shapes {
    let corners = |i: u32| {
        let size = (1u64 << 60) as f32 * ratio.powi(i as i32);
        let lift = Vec3::new(1.0, 0.7, 0.4) + Vec3::new(0.0, 0.1, 0.2) * (i % 3) as f32;
        [Vec3::X, Vec3::Y, Vec3::Z].map(|p| (lift + p * 0.3) * size)
    };
    scenes::mesh((0..n).flat_map(corners).collect(), (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

#[test]
fn trees_too_deep_for_rays_in_flight_are_answered() {
    let shapes = progression(1770, 0.93);
    let mut rays = scenes::rays(&shapes, 12);
    rays.extend((0..40).map(|i| {
        let (start, target) = (Vec3::splat(2.0 * (1u64 << 60) as f32), shapes.vertices[90 * i]);
        ray(start, target - start)
    }));
    for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
        let most = Wide::build(&shapes, splitting).tree().most_behind();
        assert!(most >= DEPTH, "{splitting:?}: {most}");
    }
    let expected = answers(&Unculled::new(&shapes), &rays);
    for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
        for way in MODES {
            let wide = Wide::build(&shapes, splitting).with_rays(way);
            assert!(answers(&wide, &rays) == expected, "{way:?} of {splitting:?}");
        }
    }
}

/// How far a ray may drift from its plane depends on its way along its main axis, not on the other coordinates.
#[test]
fn rays_along_axes_from_far_away_hit_what_brute_force_hits() {
    let shapes = scenes::lattice(120);
    for far in [1e3, 1e5, 1e7] {
        assert_all_modes_agree("lattice", &shapes, &along_axes(&shapes, 240, far));
    }
}

/// The prims on which they start lie in boxes that they leave at once, or on whose planes they start.
#[test]
fn rays_that_start_on_what_they_hit_hit_it() {
    let mut r = Random::new(74);
    for (name, shapes) in
        [("lattice", scenes::lattice(120)), ("soup", scenes::soup(120, 0.4)), ("star", scenes::star(12, 8))]
    {
        let mut start = |i: usize| {
            let [a, b, c] = shapes.triangles[r.below(shapes.triangles.len())].map(|v| shapes.vertices[v as usize]);
            let on = [a, (a + b) * 0.5, a + (b - a) * 0.25 + (c - a) * 0.5][i % 3];
            let dir = if i.is_multiple_of(4) { Vec3::AXES[i / 4 % 3] * (0.5 - r.unit()) } else { r.cube() };
            Ray { t_min: [0.0, -0.0, -1e-30][i / 3 % 3], ..ray(on, dir) }
        };
        let rays: Vec<Ray> = (0..300).map(&mut start).filter(|r| r.dir != Vec3::ZERO).collect();
        let hits = Unculled::new(&shapes);
        let at_once = first_hits(&hits, &rays).iter().filter(|hit| hit.t == 0.0).count();
        assert!(at_once > 90, "{name}: {at_once}");
        assert_all_modes_agree(name, &shapes, &rays);
        assert_all_modes_agree(name, &shapes, &packets(&rays));
    }
}

#[test]
fn rays_without_a_range_hit_nothing() {
    let shapes = scenes::soup(60, 0.4);
    for (t_min, t_max) in [(0.0, f32::NAN), (f32::NAN, 1.0), (f32::NAN, f32::NAN), (2.0, 1.0), (0.0, f32::NEG_INFINITY)]
    {
        let rays: Vec<Ray> = scenes::rays(&shapes, 6).iter().map(|&ray| Ray { t_min, t_max, ..ray }).collect();
        assert_all_modes_agree("soup", &shapes, &rays);
    }
}
