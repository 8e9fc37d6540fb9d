//! Occlusion of the environment, tested by rays.

use super::*;
use crate::accel::AccelKind;
use crate::scene::{Environment, MetalRough, Panorama};
use std::sync::Arc;

/// A white floor at z = 0, viewed from just above, under a ball of radius 1 whose centre is at height 2.
fn under_a_ball() -> Stage {
    let mut s = looking_down(0.5);
    s.view = View::look_at(DVec3::Z * 0.5, DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
    s.plane(DVec3::Z, 0.0, material(Vec3::ONE, phong())).sphere(DVec3::Z * 2.0, 1.0, unlit(Vec3::ZERO));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s.settings.samples = 100;
    s.settings.env_rays = Some(64);
    s
}

/// A sky of one bright spot of 2 × 2 texels of 512 × 256 straight up (along +z), and little else; and its irradiance.
fn sun() -> (Panorama, f32) {
    let mut texels = vec![[0.1, 0.1, 0.1]; 512 * 256];
    // +Z is a quarter to the right of the middle.
    for row in [127, 128] {
        for column in [383, 384] {
            texels[row * 512 + column] = [3000.0, 2000.0, 1000.0];
        }
    }
    let side = std::f32::consts::PI / 256.0;
    let irradiance = 3000.0 * 4.0 * side * side;
    (
        Panorama { name: String::new(), width: 512, height: 256, texels: Arc::new(texels), ..Panorama::default() },
        irradiance,
    )
}

#[test]
fn a_ball_hides_the_part_of_an_even_sky_that_geometry_says() {
    // The form factor of a ball seen from a face turned to it is (radius / distance)².
    assert_near(under_a_ball().color(), Vec3::splat(0.75), 0.004);
}

#[test]
fn few_rays_err_on_no_side() {
    let mut s = under_a_ball();
    (s.settings.samples, s.settings.env_rays) = (4096, Some(2));
    assert_near(s.color(), Vec3::splat(0.75), 0.012);
}

#[test]
fn without_rays_and_in_the_open_all_light_arrives() {
    let mut s = under_a_ball();
    s.settings.env_rays = None;
    assert_near(s.color(), Vec3::ONE, 1e-6);
    s.settings.env_rays = Some(8);
    s.scene.spheres.clear();
    assert_near(s.color(), Vec3::ONE, 1e-6);
}

#[test]
fn a_closed_room_is_dark() {
    let mut s = under_a_ball();
    s.sphere(DVec3::ZERO, 9.0, unlit(Vec3::ZERO));
    (s.settings.samples, s.settings.env_rays) = (1, Some(4));
    assert_eq!(s.color(), Vec3::ZERO);
}

/// A square whose normals lean so far that part of their hemisphere lies below it, beside a black ball or shut in one.
fn leaning(shut_in: bool, samples: u32, env_rays: u32) -> Stage {
    let mut s = looking_down(0.5);
    s.view = View::look_at(DVec3::Z * 0.5, DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
    let normals = vec![Vec3::new(0.9, 0.0, 0.3).normalize(); 4];
    let leaning = Mesh { normals, ..square(0.0, 1.0) };
    s.mesh(leaning, DAffine3::IDENTITY, material(Vec3::ONE, phong()));
    let (at, radius) = if shut_in { (DVec3::ZERO, 9.0) } else { (DVec3::new(2.0, 0.0, 1.0), 1.0) };
    s.sphere(at, radius, unlit(Vec3::ZERO));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    (s.settings.samples, s.settings.env_rays) = (samples, Some(env_rays));
    s
}

#[test]
fn normals_that_lean_beyond_a_face_let_no_light_in_through_it() {
    for (samples, env_rays) in [(1, 2), (64, 2), (16, 4), (4, 16)] {
        assert_eq!(leaning(true, samples, env_rays).color(), Vec3::ZERO, "{samples} × {env_rays}");
    }
    // Whatever the number of rays per sample, the mean is the same.
    let many = leaning(false, 64, 256).color();
    assert!((0.3..0.9).contains(&many.x), "{many}");
    for (samples, env_rays) in [(8192, 2), (4096, 4), (1024, 16)] {
        assert_near(leaning(false, samples, env_rays).color(), many, 0.02);
    }
}

#[test]
fn the_sun_of_a_panorama_throws_a_shadow() {
    let (panorama, irradiance) = sun();
    let sky = 0.1;
    let mut s = under_a_ball();
    (s.settings.samples, s.settings.env_rays) = (100, None);
    s.scene.environment = Environment::Panorama;
    s.scene.panorama = Some(panorama);
    assert_near(s.color(), Vec3::splat(sky * 0.75), 0.004);
    s.scene.spheres.clear();
    let lit = s.color();
    let expected = irradiance / std::f32::consts::PI + sky;
    assert!((lit.x / expected - 1.0).abs() < 0.03 && lit.y < 0.75 * lit.x, "{lit} for {expected}");
}

#[test]
fn it_throws_one_on_what_lets_some_light_in_and_by_few_rays() {
    let (panorama, irradiance) = sun();
    let floor = |rays, transmission| {
        let mut s = under_a_ball();
        (s.settings.samples, s.settings.env_rays, s.settings.gloss_rays) = (100, Some(rays), Some(0));
        s.scene.environment = Environment::Panorama;
        s.scene.panorama = Some(panorama.clone());
        let m = MetalRough { metallic: 0.0, roughness: 1.0, specular: 0.0, transmission, ..MetalRough::default() };
        s.scene.materials[0] = Material { reflection: Reflection::MetalRough(m), ..Material::plain() };
        s.color().x
    };
    assert!(irradiance / std::f32::consts::PI > 0.4, "the open floor");
    for (rays, transmission) in [(2, 0.0), (4, 0.0), (16, 0.0), (16, 0.01)] {
        let seen = floor(rays, transmission);
        assert!((seen - 0.075).abs() < 0.12, "{rays} rays, transmission {transmission}: {seen}");
    }
}

#[test]
fn rough_metal_is_darkened_where_its_lobe_is_hidden() {
    let mut s = under_a_ball();
    let reflection = Reflection::MetalRough(MetalRough { metallic: 1.0, roughness: 0.4, ..MetalRough::default() });
    s.scene.materials[0] = Material { base_color: Vec3::ONE, reflection, double_sided: true, ..Material::default() };
    let hidden = s.color().x;
    s.scene.spheres[0].center = DVec3::new(4.0, 0.0, 0.5);
    let aside = s.color().x;
    assert!(hidden < 0.35 && aside > 0.95, "{hidden} {aside}");
}

#[test]
fn clear_glass_hides_nothing_and_coloured_glass_colours() {
    for color in [Vec3::ONE, Vec3::new(1.0, 0.5, 0.0)] {
        let mut s = under_a_ball();
        s.scene.materials[1] = material(Vec3::ZERO, Phong { transmission: color, ..phong() });
        // Both walls of the ball filter the light.
        let twice = |c: f32| 0.75 + 0.25 * c * c;
        let both = Vec3::new(twice(color.x), twice(color.y), twice(color.z));
        assert_near(s.color(), both, 0.01);
    }
}

#[test]
fn every_structure_gives_the_same_bits_and_other_seeds_others() {
    let (panorama, _) = sun();
    let mut s = under_a_ball();
    (s.settings.width, s.settings.height, s.settings.samples, s.settings.env_rays) = (24, 24, 1, Some(6));
    s.view = View::look_at(DVec3::new(0.0, -6.0, 4.0), DVec3::Z, DVec3::Z, Lens::orthographic(4.0));
    s.scene.environment = Environment::Panorama;
    s.scene.panorama = Some(panorama);
    let first = s.render().picture.beauty;
    for kind in AccelKind::ALL {
        assert!(s.render_by(kind).picture.beauty == first, "{kind:?}");
    }
    s.settings.seed = 1;
    assert!(s.render().picture.beauty != first);
}
