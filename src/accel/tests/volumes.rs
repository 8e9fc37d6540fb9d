//! Tests of the bounding volumes of objects by counts.

use super::*;
use crate::accel::probe::Extent;
use crate::accel::volumes::{BoundingSphere, Volume, Volumes};
use crate::math::aabb::Aabb;

fn counts<A: Accel>(accel: &A, rays: &[Ray]) -> RayCounts {
    let mut counts = RayCounts::default();
    accel.closest(rays, &mut vec![Hit::MISS; rays.len()], &mut accel.scratch(), &mut counts);
    counts
}

/// Rays of a camera of 128 × 128 pixels that looks past the origin; `width` is the picture's width at distance 1.
fn picture(width: f32) -> Vec<Ray> {
    let at = |i: usize| (i as f32 + 0.5) / 128.0 - 0.5;
    let pixel = |i: usize| Vec3::new(width * at(i % 128) + 0.0123, width * at(i / 128) - 0.0217, -1.0);
    (0..128 * 128).map(|i| scenes::ray(Vec3::Z * 6.0, pixel(i))).collect()
}

/// A lecture's worked example: 128 × 128 rays, one object of 46 polygons, an eighth of the rays enter its volume: 753,664
/// tests without the volume, 16,384 and 94,208 with it.
#[test]
fn a_sphere_around_46_polygons_that_an_eighth_of_the_rays_enter_saves_six_tests_of_seven() {
    let shapes = crate::bench::star::star(23, 2);
    assert_eq!((shapes.len(), shapes.objects().len()), (46, 1));
    let spheres = Volumes::<BoundingSphere>::build(&shapes);

    // The wider the picture, the fewer rays enter, one at a time, because the camera looks past the middle.
    let entered = |width| counts(&spheres, &picture(width)).n_ets;
    let (mut narrow, mut wide) = (0.5, 4.0);
    let mut width = 1.0;
    while entered(width) != 2048 {
        if entered(width) > 2048 {
            narrow = width
        } else {
            wide = width
        }
        assert!(wide - narrow > 1e-6, "no camera found");
        width = (narrow + wide) * 0.5;
    }

    let rays = picture(width);
    let without = counts(&Unculled::new(&shapes), &rays);
    let with = counts(&spheres, &rays);
    assert_eq!((without.queries, without.n_it, without.n_bit), (16_384, 753_664, 0));
    assert_eq!((with.queries, with.n_bit, with.n_it), (16_384, 16_384, 94_208));
    assert_eq!(with.n_bit + with.n_it, 110_592);
    assert_eq!(with.found, without.found);
}

/// A polygon that is not quite flat may be hit anywhere in its box.
#[test]
fn a_sphere_around_a_polygon_holds_its_box() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.01], [0.0, 1.0, 0.0]].map(Vec3::from).to_vec();
    let shapes = Shapes { vertices, polygons: vec![(0, 4)], polygon_corners: vec![0, 1, 2, 3], ..Shapes::default() };
    let Aabb { lo, hi } = shapes.bounds(0);
    let Extent::Ball { center, radius } = <BoundingSphere as Volume>::around(&shapes, 0..1).extent() else { panic!() };
    for corner in [lo, hi, Vec3::new(lo.x, lo.y, hi.z), Vec3::new(hi.x, lo.y, hi.z)] {
        assert!((corner.as_dvec3() - center).length() <= radius, "{corner}");
    }
}

/// Four separate clusters: three runs of faces and a single triangle.
fn clusters() -> Shapes {
    let mut shapes = scenes::soup(91, 0.3);
    for (i, v) in shapes.vertices.iter_mut().enumerate() {
        *v += Vec3::X * (8.0 * (i / 90) as f32);
    }
    Shapes { face_runs: vec![[0, 0], [30, 0], [60, 0], [90, 0]], ..shapes }
}

fn only_entered_objects_are_tested<V: Volume>(shapes: &Shapes) {
    let volumes = Volumes::<V>::build(shapes);
    assert_eq!(volumes.summary().n_v, 4);
    assert!(volumes.check().is_ok());
    let across = scenes::ray(Vec3::new(8.0, 0.0, 9.0), Vec3::NEG_Z);
    let one = counts(&volumes, &[across]);
    assert_eq!((one.n_bit, one.n_ets, one.n_it), (4, 1, 30));
    let beside = Ray { t_max: 3.0, ..across };
    assert_eq!(counts(&volumes, &[beside]).n_it, 0, "it ends before the volume");
    let rays = rays(shapes, 40);
    assert_eq!(wrong(&volumes, shapes, &rays), 0);
}

#[test]
fn only_objects_whose_volume_is_entered_are_tested() {
    only_entered_objects_are_tested::<BoundingSphere>(&clusters());
    only_entered_objects_are_tested::<Aabb>(&clusters());
}

/// Corners on the sphere itself, with rays exactly through them: rounding must not make a ray miss the sphere.
#[test]
fn a_ray_that_touches_a_volume_enters_it() {
    let mut r = Random::new(51);
    for _ in 0..40 {
        let scale = libm::exp2f(40.0 * r.unit() - 20.0);
        let corners: Vec<Vec3> = (0..3).map(|_| r.cube() * scale).collect();
        let shapes = scenes::mesh(corners, vec![[0, 1, 2]]);
        let rays = far_rays(&shapes, 40, 1.0..1e6);
        assert_eq!(wrong(&Volumes::<BoundingSphere>::build(&shapes), &shapes, &rays), 0);
        assert_eq!(wrong(&Volumes::<Aabb>::build(&shapes), &shapes, &rays), 0);
    }
}
