//! Tests of the binary hierarchy by counts.

use super::*;

fn count(shapes: &Shapes, leaf_size: u32, rays: &[Ray]) -> RayCounts {
    let bvh = Bvh::build(shapes, leaf_size);
    let mut counts = RayCounts::default();
    bvh.closest(rays, &mut vec![Hit::MISS; rays.len()], &mut bvh.scratch(), &mut counts);
    counts
}

#[test]
fn the_nearer_child_is_visited_first_whichever_way_the_ray_runs() {
    let at = |z: f32| [Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1.0, z)];
    let vertices = [0.0, 1.0, 2.0, 3.0].map(at).concat();
    let shapes = scenes::mesh(vertices, (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    for ray in [scenes::ray(Vec3::new(0.2, 0.2, -1.0), Vec3::Z), scenes::ray(Vec3::new(0.2, 0.2, 4.0), Vec3::NEG_Z)] {
        let counts = count(&shapes, 1, &[ray]);
        // The root's box, then two boxes at each of two levels; the other boxes begin beyond the hit.
        assert_eq!((counts.n_it, counts.n_bit, counts.n_ts, counts.n_ets), (1, 5, 3, 1));
    }
}

#[test]
fn leaves_hold_as_many_prims_as_they_may_and_small_ones_save_tests() {
    let shapes = scenes::star(60, 30);
    let rays = rays(&shapes, 40);
    let [small, large] = [1, 16].map(|leaf_size| count(&shapes, leaf_size, &rays));
    assert!(small.n_it * 2 < large.n_it && small.n_bit > large.n_bit, "{small:?} {large:?}");
    let prims = u64::from(shapes.bounded());
    let stats = Bvh::build(&shapes, 1).summary();
    assert_eq!((stats.n_v, stats.n_oiv, stats.n_in), (prims, prims, prims - 1));
    let stats = Bvh::build(&shapes, 16).summary();
    assert!(stats.n_v >= prims / 16 && stats.n_v < prims / 4 && stats.depth < 16, "{stats:?}");
}

#[test]
fn nearly_everything_is_culled() {
    let shapes = scenes::star(100, 50);
    let rays = rays(&shapes, 20);
    let counts = count(&shapes, crate::accel::bvh::LEAF_SIZE, &rays);
    assert!(counts.n_it * 200 < counts.queries * shapes.len() as u64, "{counts:?}");
}
