//! Instanced objects are hit as if they were flattened: brute force on the flattened scene is the specification.

use super::{InstancedObjects, Object, ObjectTransform, PrimLocation, TwoLevel, placed};
use crate::accel::tests::scenes::{self, ray};
use crate::accel::{Accel, BitSet, Hit, NO_PRIM, NoProbe, Ray, RayCounts, Shapes, Splitting, Unculled};
use crate::math::random::Random;
use crate::math::simd::{Kernel, LANES, Level, Simd};
use crate::math::triangles::{Corners8, corners_of, set_corners};
use crate::math::{DAffine3, DMat3, DQuat, DVec3, Vec3};

/// A scene in both forms: instanced and flattened.
struct Both {
    stored: Shapes,
    instanced: InstancedObjects,
    flat: Shapes,
}

impl Both {
    /// Places objects in this order, with all of `others` between the first and the second.
    fn new(objects: Vec<Object>, places: &[(usize, DAffine3)], others: &Shapes) -> Self {
        let mut instanced = InstancedObjects::default();
        let (mut flat, mut stored) = (Shapes::default(), Shapes::default());
        let mut opaque = Vec::new();
        let ids: Vec<u32> = objects.iter().map(|o| instanced.add(o.clone())).collect();
        for (i, (object, matrix)) in places.iter().enumerate() {
            if i == 1 {
                opaque.extend((0..others.triangles.len() as u32).map(|p| others.opaque.get(p)));
                append(&mut flat, &others.vertices, &others.triangles);
                append(&mut stored, &others.vertices, &others.triangles);
            }
            let own = &objects[*object];
            let first = flat.triangles.len() as u32;
            let corners: Vec<Vec3> = own.shapes().vertices.iter().map(|&v| placed(matrix, v)).collect();
            append(&mut flat, &corners, &own.shapes().triangles);
            match ObjectTransform::new(*matrix, own.shapes()) {
                Some(place) => instanced.put(ids[*object], first, place),
                None => append(&mut stored, &corners, &own.shapes().triangles),
            }
            opaque.extend(vec![own.opaque; own.shapes().triangles.len()]);
        }
        let triangles = others.triangles.len() as u32;
        opaque.extend((triangles..others.len() as u32).map(|p| others.opaque.get(p)));
        for shapes in [&mut flat, &mut stored] {
            (shapes.spheres, shapes.planes) = (others.spheres.clone(), others.planes.clone());
            shapes.cones.clone_from(&others.cones);
        }
        let bits = |shapes: &Shapes, number: &dyn Fn(u32) -> u32| {
            let mut bits = BitSet::filled(shapes.len(), true);
            (0..shapes.len() as u32).for_each(|p| bits.set(p, opaque[number(p) as usize]));
            bits
        };
        flat.opaque = bits(&flat, &|p| p);
        stored.opaque = bits(&stored, &|p| instanced.number(p));
        Self { stored, instanced, flat }
    }

    fn level(&self, splitting: Splitting) -> TwoLevel<'_> {
        TwoLevel::build(&self.stored, &self.instanced, splitting)
    }
}

fn append(shapes: &mut Shapes, vertices: &[Vec3], triangles: &[[u32; 3]]) {
    let base = shapes.vertices.len() as u32;
    shapes.vertices.extend(vertices);
    shapes.triangles.extend(triangles.iter().map(|t| t.map(|i| i + base)));
}

fn object(shapes: &Shapes, opaque: bool) -> Object {
    Object::new(&shapes.vertices, &shapes.triangles, opaque)
}

/// Three objects, one of which is not opaque.
fn objects() -> Vec<Object> {
    vec![object(&scenes::star(12, 8), true), object(&scenes::soup(40, 0.8), false), object(&scenes::lattice(30), true)]
}

/// Spheres, cones, planes and triangles beside instanced objects.
fn others() -> Shapes {
    let mix = scenes::mix();
    let shapes = Shapes { polygons: Vec::new(), polygon_corners: Vec::new(), ..mix };
    let mut opaque = BitSet::filled(shapes.len(), true);
    (0..shapes.len() as u32).step_by(3).for_each(|p| opaque.set(p, false));
    Shapes { opaque, ..shapes }
}

/// Random transform: rotated, stretched, mirrored or sheared, around `at`, of about the given size.
fn standing(r: &mut Random, i: usize, size: f64, at: DVec3) -> DAffine3 {
    let mut unit = || f64::from(r.unit());
    let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 7.0 * unit(), 7.0 * unit(), 7.0 * unit()));
    let stretch = DVec3::new(0.2 + unit(), 0.2 + unit(), 0.2 + unit());
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(unit() * 2.0, 1.0, 0.0), DVec3::new(-unit(), unit(), 1.0));
    let matrix3 = match i % 5 {
        0 => DMat3::from_diagonal(DVec3::splat(1.0)),
        1 => turn,
        2 => turn * DMat3::from_diagonal(stretch),
        3 => turn * DMat3::from_diagonal(stretch * DVec3::new(1.0, -1.0, 1.0)),
        _ => turn * shear,
    };
    let somewhere = DVec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5) * 4.0;
    DAffine3 { matrix3: matrix3 * size, translation: (somewhere * size) + at }
}

/// `n` places, the objects taking turns.
fn about(n: usize, size: f64, at: DVec3) -> Vec<(usize, DAffine3)> {
    let mut r = Random::new(21);
    (0..n).map(|i| (i % 3, standing(&mut r, i / 3, size, at))).collect()
}

/// The first hits, the hits behind them, occlusion, and occlusion with a filter that lets light through some of the other
/// prims.
fn answers<A: Accel>(accel: &A, rays: &[Ray]) -> Vec<[u32; 10]> {
    crate::accel::tests::answers(accel, rays)
}

#[track_caller]
fn assert_hits_of_the_flattened_scene(name: &str, both: &Both, rays: &[Ray]) {
    let expected = answers(&Unculled::new(&both.flat), rays);
    for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
        let level = both.level(splitting);
        assert!(level.check().is_ok(), "{name}: {:?}", level.check());
        for ((ray, got), expected) in rays.iter().zip(&answers(&level, rays)).zip(&expected) {
            assert_eq!(got, expected, "{name}, {splitting:?}, {ray:?}");
        }
        let mut counts = RayCounts::default();
        let mut hits = vec![Hit::MISS; rays.len()];
        level.closest(rays, &mut hits, &mut level.scratch(), &mut counts);
        let same = hits.iter().zip(&expected).all(|(hit, expected)| hit.bits() == expected[..4]);
        let found = hits.iter().filter(|hit| hit.is_some()).count() as u64;
        assert!(same && (counts.queries, counts.found) == (rays.len() as u64, found), "{name}: {counts:?}");
    }
}

#[test]
fn objects_that_are_turned_stretched_mirrored_and_sheared_are_hit_as_if_flattened() {
    let both = Both::new(objects(), &about(30, 0.4, DVec3::ZERO), &others());
    assert_eq!(both.instanced.placed().len(), 30);
    assert_hits_of_the_flattened_scene("about", &both, &scenes::rays(&both.flat, 60));
}

#[test]
fn objects_without_anything_beside_them_are_hit_as_if_flattened() {
    let both = Both::new(objects(), &about(9, 1.0, DVec3::ZERO), &Shapes::default());
    assert!(both.stored.is_empty());
    assert_hits_of_the_flattened_scene("alone", &both, &scenes::rays(&both.flat, 40));
}

#[test]
fn objects_far_away_tiny_and_huge_are_hit_as_if_flattened() {
    for (name, size, at) in [
        ("far away", 1.0, DVec3::new(300.0, -700.0, 50.0)),
        ("very far away", 1.0, DVec3::new(1e3, 0.0, -9e3)),
        ("farther than is instanced", 1.0, DVec3::new(4e6, 0.0, -9e6)),
        ("tiny", 1e-4, DVec3::ZERO),
        ("tinier than is instanced", 1e-9, DVec3::ZERO),
        ("huge", 1e5, DVec3::ZERO),
        ("larger than is instanced", 1e12, DVec3::ZERO),
    ] {
        let both = Both::new(objects(), &about(12, size, at), &Shapes::default());
        assert_eq!(both.instanced.is_empty(), name.ends_with("is instanced"), "{name}");
        assert_hits_of_the_flattened_scene(name, &both, &scenes::rays(&both.flat, 30));
    }
}

#[test]
fn singular_and_extreme_placements_are_flattened() {
    let star = scenes::star(12, 8);
    let at = |diagonal: DVec3| ObjectTransform::new(DAffine3::from_scale(diagonal), &star);
    assert!(at(DVec3::new(1.0, -2.0, 3.0)).is_some());
    for diagonal in [
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(1.0, 1e-6, 1.0),
        DVec3::new(f64::NAN, 1.0, 1.0),
        DVec3::new(f64::INFINITY, 1.0, 1.0),
        DVec3::splat(1e-9),
        DVec3::splat(1e9),
    ] {
        assert!(at(diagonal).is_none(), "{diagonal}");
    }
    assert!(
        ObjectTransform::new(DAffine3::from_translation(DVec3::splat(1e5)), &star).is_none(),
        "rounding moves corners"
    );
    let places =
        [(0, DAffine3::IDENTITY), (1, DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0))), (0, DAffine3::IDENTITY)];
    let both = Both::new(objects(), &places, &others());
    assert_eq!(both.instanced.placed().len(), 2);
    assert_hits_of_the_flattened_scene("one is flat", &both, &scenes::rays(&both.flat, 30));
}

/// Objects that touch: rays through shared edges and corners, and copies at one place.
#[test]
fn rays_through_edges_that_objects_share_hit_the_lowest_prim_of_all() {
    let moves = [DVec3::ZERO, DVec3::X, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0), DVec3::ZERO];
    let places: Vec<_> = moves.iter().map(|&by| (2, DAffine3::from_translation(by))).collect();
    let both = Both::new(objects(), &places, &scenes::lattice(40));
    assert_hits_of_the_flattened_scene("touching", &both, &scenes::rays(&both.flat, 60));
}

#[test]
fn a_ray_does_not_hit_the_prim_that_it_starts_on() {
    let both = Both::new(objects(), &about(12, 0.7, DVec3::ZERO), &others());
    let mut r = Random::new(3);
    let from = |_| {
        let prim = r.below(both.flat.triangles.len()) as u32;
        let [a, b, c] = both.flat.triangle(prim);
        Ray { exclude: prim, ..ray((a + b + c) / 3.0, r.cube()) }
    };
    let rays: Vec<Ray> = (0..600).map(from).collect();
    assert_hits_of_the_flattened_scene("leaving", &both, &rays);
}

#[test]
fn all_hits_along_a_ray_are_found_one_after_the_other() {
    let places: Vec<_> = about(12, 0.7, DVec3::ZERO).into_iter().flat_map(|place| [place; 2]).collect();
    let both = Both::new(objects(), &places, &others());
    let (level, flat) = (both.level(Splitting::Octree), Unculled::new(&both.flat));
    let mut most = 0;
    for ray in scenes::rays(&both.flat, 6) {
        let (mut got, mut expected) = ([Hit::MISS], [Hit::MISS]);
        level.closest(&[ray], &mut got, &mut level.scratch(), &mut NoProbe);
        flat.closest(&[ray], &mut expected, &mut (), &mut NoProbe);
        let mut count = 0;
        while expected[0].is_some() {
            assert_eq!(got[0].bits(), expected[0].bits(), "hit {count} of {ray:?}");
            let (a, b) = (got, expected);
            level.next(&[ray], &a, &mut got, &mut level.scratch(), &mut NoProbe);
            flat.next(&[ray], &b, &mut expected, &mut (), &mut NoProbe);
            count += 1;
        }
        assert!(!got[0].is_some(), "{ray:?}");
        most = most.max(count);
    }
    assert!(most > 20, "{most}");
}

/// Rays with directions from the smallest to the largest numbers, and from far away.
#[test]
fn rays_of_any_length_from_anywhere_hit_what_they_hit_of_the_flattened_scene() {
    let both = Both::new(objects(), &about(9, 0.7, DVec3::ZERO), &Shapes::default());
    let scaled = |(i, ray): (usize, &Ray)| Ray { dir: ray.dir * [1e-30, 1e-12, 1e6, 1e14, 1e30][i % 5], ..*ray };
    let rays: Vec<Ray> = scenes::rays(&both.flat, 20).iter().enumerate().map(scaled).collect();
    assert_hits_of_the_flattened_scene("of any length", &both, &rays);
    let rays = crate::accel::tests::far_rays(&both.flat, 300, 1e1..1e7);
    assert_hits_of_the_flattened_scene("from far away", &both, &rays);
    assert_hits_of_the_flattened_scene("broken", &both, &scenes::broken_rays());
}

#[test]
fn prims_have_the_numbers_of_the_flattened_scene() {
    let both = Both::new(objects(), &about(12, 0.7, DVec3::ZERO), &others());
    let mut stored = 0;
    for prim in 0..both.flat.triangles.len() as u32 {
        let corners = match both.instanced.find(prim) {
            PrimLocation::Stored(number) => {
                assert_eq!((number, both.instanced.number(number)), (stored, prim));
                stored += 1;
                both.stored.triangle(number)
            }
            PrimLocation::Placed(placed, triangle) => both.instanced.triangle(placed, triangle),
        };
        assert_eq!(corners, both.flat.triangle(prim));
    }
    assert_eq!(stored as usize, both.stored.triangles.len());
    assert!(matches!(both.instanced.find(NO_PRIM), PrimLocation::Stored(NO_PRIM)));
    assert_eq!(both.instanced.number(NO_PRIM), NO_PRIM);
}

struct Placing<'a>(&'a ObjectTransform, &'a Corners8);

impl Kernel for Placing<'_> {
    type Output = Corners8;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Corners8 {
        self.0.block(s, self.1)
    }
}

#[test]
fn eight_triangles_at_once_are_placed_as_flattening_places_them() {
    let soup = scenes::soup(64, 0.8);
    for (_, matrix) in about(15, 0.37, DVec3::new(0.1, -3.3, 40.0)) {
        let Some(place) = ObjectTransform::new(matrix, &soup) else { panic!("{matrix} is nothing extreme") };
        for first in (0..64).step_by(LANES) {
            let mut corners = [[[0.0; LANES]; 3]; 3];
            (0..LANES).for_each(|lane| set_corners(&mut corners, lane, &soup.triangle((first + lane) as u32)));
            for level in Level::all() {
                let there = level.run(Placing(&place, &corners));
                for lane in 0..LANES {
                    let expected = soup.triangle((first + lane) as u32).map(|corner| placed(&matrix, corner));
                    assert_eq!(corners_of(&there, lane), expected, "{}", level.name());
                }
            }
        }
    }
}

#[test]
fn memory_grows_with_what_is_stored_not_with_what_is_shown() {
    let bytes = |n: usize| {
        let places: Vec<_> = about(n, 0.4, DVec3::ZERO).iter().map(|(_, place)| (0, *place)).collect();
        let both = Both::new(vec![object(&scenes::star(60, 30), true)], &places, &Shapes::default());
        let bytes = both.level(Splitting::Octree).summary().bytes + both.instanced.bytes() as u64;
        (bytes, both.instanced.stored(), both.instanced.shown())
    };
    let ((few, stored, _), (many, same, shown)) = (bytes(12), bytes(1200));
    assert_eq!((stored, shown as usize), (same, stored * 1200));
    assert!(many < 3 * few, "{few} bytes for 12, {many} for 1,200");
}
