//! Reflected rays: weights, depth, counts.

use super::*;
use crate::math::Vec2;
use crate::scene::{Background, Bitmap, Environment, Pixels, Sampler, Texture, TextureRef, UvTransform};

fn mirror(weight: f32) -> Material {
    material(Vec3::ZERO, Phong { mirror: Vec3::splat(weight), ..phong() })
}

/// An eye between two mirrors that face each other.
fn corridor() -> Stage {
    let mut s = looking_down(0.5);
    s.square(0.0, 4.0, mirror(0.5)).square(2.0, 4.0, mirror(0.5));
    s.scene.materials.iter_mut().for_each(|m| m.emission = Vec3::ONE);
    s
}

#[test]
fn a_mirror_shows_exactly_its_weight_of_the_surroundings() {
    let mut s = looking_down(5.0);
    s.square(0.0, 1.0, mirror(0.25));
    s.scene.environment = Environment::Constant(Vec3::new(1.0, 0.5, 2.0));
    assert_eq!(s.color(), Vec3::new(0.25, 0.125, 0.5));
}

#[test]
fn a_map_of_the_specular_color_is_one_of_the_mirror_too() {
    let map = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() };
    let mut s = looking_down(5.0);
    let painted = Phong { mirror: Vec3::splat(0.5), specular_map: Some(map), ..phong() };
    s.square(0.0, 1.0, material(Vec3::ZERO, painted));
    s.scene.meshes[0].uvs = vec![vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]];
    let pixels = Pixels::Rgba8([[255, 255, 0, 255]; 4].into_iter().collect());
    s.scene.bitmaps.push(Bitmap { name: String::new(), width: 2, height: 2, pixels });
    s.scene.textures.push(Texture { bitmap: 0, sampler: Sampler::default() });
    s.scene.environment = Environment::Constant(Vec3::ONE);
    assert_eq!(s.color(), Vec3::new(0.5, 0.5, 0.0));
}

#[test]
fn a_mirror_in_a_scene_without_environment_shows_the_background_color() {
    let mut s = looking_down(5.0);
    s.square(0.0, 1.0, mirror(0.5));
    s.scene.background = Some(Background::Color(Vec3::new(1.0, 0.5, 0.0)));
    assert_eq!(s.color(), Vec3::new(0.5, 0.25, 0.0));
}

#[test]
fn facing_mirrors_are_followed_exactly_as_deep_as_asked() {
    for depth in [0, 1, 2, 5, 40] {
        let mut s = corridor();
        s.settings = Settings { depth: Some(depth), width: 3, height: 2, ..s.settings };
        let rendered = s.render();
        // 1 + 1/2 + 1/4 + …: one emitting wall for each bounce and the first.
        let expected = 2.0 - 0.5f32.powi(depth as i32);
        assert_near(Vec3::from_slice(&rendered.picture.beauty[0]), Vec3::splat(expected), 1e-6);
        let counts = rendered.counts;
        let queries = [counts.primary, counts.reflected, counts.refracted, counts.shadow].map(|c| c.queries);
        assert_eq!(queries, [6, 6 * u64::from(depth), 0, 0]);
        assert_eq!(rendered.depth, depth);
    }
}

#[test]
fn a_branch_that_is_too_light_ends_in_black_and_sends_no_ray() {
    let mut s = corridor();
    s.settings = Settings { depth: Some(40), cutoff: 0.25, ..s.settings };
    let rendered = s.render();
    // Weights 1, 1/2 and 1/4 are followed, 1/8 is not.
    assert_eq!(rendered.picture.beauty[0], [1.75, 1.75, 1.75, 1.0]);
    assert_eq!(rendered.counts.reflected.queries, 2);
}

#[test]
fn a_branch_cut_by_depth_is_black_while_a_miss_sees_the_surroundings() {
    let mut s = looking_down(5.0);
    s.square(0.0, 1.0, mirror(1.0));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s.settings.depth = Some(0);
    assert_eq!(s.color(), Vec3::ZERO);
    s.settings.depth = Some(1);
    assert_eq!(s.color(), Vec3::ONE);
}

#[test]
fn a_corner_of_three_mirrors_sends_light_back_where_it_came_from() {
    // Only the lamp-like wall behind the eye is bright; a ray into the corner must find it after three bounces.
    let view = View::look_at(DVec3::new(3.0, 2.0, 4.0), DVec3::new(0.6, 0.35, 0.7), DVec3::Y, Lens::orthographic(0.01));
    let mut s = stage(view);
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        s.plane(axis, 0.0, mirror(1.0));
    }
    s.sphere(DVec3::new(3.0, 2.0, 4.0), 0.7, unlit(Vec3::ONE));
    s.view.eye = DVec3::new(3.0, 2.0, 4.0) + s.view.forward * 0.8;
    s.settings.depth = Some(2);
    assert_eq!(s.color(), Vec3::ZERO);
    s.settings.depth = Some(3);
    assert_eq!(s.color(), Vec3::ONE);
}

#[test]
fn a_scene_without_mirrors_sends_no_secondary_rays() {
    let mut s = looking_down(5.0);
    s.square(0.0, 1.0, material(Vec3::ONE, phong()));
    let rendered = s.render();
    assert_eq!((rendered.depth, rendered.counts.reflected.queries, rendered.counts.refracted.queries), (0, 0, 0));
}

#[test]
fn rays_leave_a_mirror_that_stands_far_from_the_origin() {
    let far = DVec3::new(1e7, -3e6, 2e6);
    let mut s = stage(View::look_at(far + DVec3::Z * 5.0, far, DVec3::Y, Lens::orthographic(1.0)));
    s.mesh(square(0.0, 1.0), DAffine3::from_translation(far), mirror(0.5));
    s.sphere(far + DVec3::Z * 0.001, 0.0005, unlit(Vec3::X));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s.settings = Settings { width: 9, height: 9, ..s.settings };
    let picture = s.render().picture;
    assert_eq!(picture.beauty[40], [1.0, 0.0, 0.0, 1.0], "the bead in the middle");
    assert_eq!(picture.beauty[0], [0.5, 0.5, 0.5, 1.0], "the mirror does not see itself");
}

/// S6 (drift): between two mirrors a ray advances by the same step at each of fifty bounces.
#[test]
fn fifty_bounces_between_mirrors_do_not_drift() {
    use crate::math::Vec4;
    let (bounces, rise) = (50u16, 0.4f64);
    let view =
        View::look_at(DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.0, 0.0, 0.5 + rise), DVec3::Y, Lens::orthographic(1e-6));
    let mut s = stage(view);
    s.square(0.0, 400.0, mirror(1.0)).square(1.0, 400.0, mirror(1.0));
    // A wall across the path, coloured by its height: bounces lie 1/rise apart, the first after half of that.
    let wall = (f64::from(bounces) + 0.3) / rise;
    let corner = |y: f32, z: f32| (Vec3::new(wall as f32, y, z), Vec4::new(z, z, z, 1.0));
    let (positions, colors) =
        [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)].map(|(y, z)| corner(y, z)).into_iter().unzip();
    let mesh = Mesh { positions, colors, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    s.mesh(mesh, DAffine3::IDENTITY, material(Vec3::ONE, phong()));
    s.scene.materials[2] = Material { reflection: Reflection::Unlit, ..s.scene.materials[2].clone() };
    s.settings.depth = Some(60);
    // Unfolded, the path is straight: its height is folded into 0..1.
    let height = (0.5 + rise * f64::from(wall as f32)) % 2.0;
    let expected = if height > 1.0 { 2.0 - height } else { height };
    let found = f64::from(s.color().x);
    assert_eq!(s.render().counts.reflected.queries, u64::from(bounces));
    // 8 ulp of the largest coordinate on the path, for each bounce, and the rounding of the direction over the whole path.
    let ulp = f64::from(f32::EPSILON) * wall;
    assert!((found - expected).abs() < 8.0 * 50.0 * ulp, "{found} for {expected}");
}
