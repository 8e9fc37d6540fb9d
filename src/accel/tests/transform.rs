//! Tests of the transformed scene by counts.

use super::*;

fn count(shapes: &Shapes, ray: Ray) -> (Hit, RayCounts) {
    let (mut hit, mut counts) = ([Hit::MISS], RayCounts::default());
    let accel = Transformed::new(shapes);
    accel.closest(&[ray], &mut hit, &mut accel.scratch(), &mut counts);
    (hit[0], counts)
}

#[test]
fn every_corner_is_transformed_once_for_each_ray_and_other_prims_by_their_points() {
    let shapes = scenes::mix();
    let points = shapes.vertices.len() + shapes.spheres.len() + 2 * shapes.cones.len();
    let (_, counts) = count(&shapes, scenes::ray(Vec3::splat(3.0), Vec3::NEG_ONE));
    assert_eq!(counts.n_xf, points as u64);
}

#[test]
fn only_what_straddles_the_ray_is_tested_nearest_first_and_not_beyond_the_hit() {
    let at = |x: f32, z: f32| [Vec3::new(x, 0.0, z), Vec3::new(x + 1.0, 0.0, z), Vec3::new(x, 1.0, z)];
    // The farther face has the lower prim number; others lie beside the ray, or straddle it and are missed.
    let faces = [at(0.0, -5.0), at(0.0, -2.0), at(3.0, -1.0), at(-2.0, -1.0), at(-0.6, -1.0)];
    let shapes = scenes::mesh(faces.concat(), (0..5).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let (hit, counts) = count(&shapes, scenes::ray(Vec3::new(0.2, 0.7, 0.0), Vec3::NEG_Z));
    assert_eq!((hit.prim, hit.t, counts.n_it), (1, 2.0, 2));
    let (hit, counts) = count(&shapes, scenes::ray(Vec3::new(0.2, 0.7, -9.0), Vec3::Z));
    assert_eq!((hit.prim, hit.t, counts.n_it), (0, 4.0, 1));
}

#[test]
fn most_prims_are_culled_and_all_corners_are_paid_for() {
    let shapes = scenes::star(60, 30);
    for ray in rays(&shapes, 4).into_iter().filter(|r| r.dir != Vec3::ZERO && r.t_min <= r.t_max) {
        let (_, counts) = count(&shapes, ray);
        assert!(counts.n_it < 200, "{} tests of {} prims, {ray:?}", counts.n_it, shapes.len());
        assert_eq!(counts.n_xf, shapes.vertices.len() as u64);
    }
}
