//! Local colour and shadows.

use super::*;
use crate::scene::{AlphaMode, Environment, MetalRough};

/// Point of a unit sphere seen by pixel (x, y) of a `size` × `size` picture two units high.
fn on_unit_sphere(x: u32, y: u32, size: u32) -> Vec3 {
    let place = |i: u32| (i as f32 + 0.5) / size as f32 * 2.0 - 1.0;
    let (x, y) = (place(x), -place(y));
    Vec3::new(x, y, (1.0 - x * x - y * y).sqrt())
}

#[test]
fn a_phong_sphere_has_the_values_of_the_formula() {
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::Z * 5.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(2.0));
    s.settings.width = 9;
    s.settings.height = 9;
    let p = Phong { ambient: Vec3::splat(0.5), specular: Vec3::splat(0.25), shininess: 5.0, ..phong() };
    s.sphere(DVec3::ZERO, 1.0, material(Vec3::new(0.8, 0.4, 0.2), p)).lamp(DVec3::new(3.0, 4.0, 12.0), 0.9);
    s.scene.ambient = Vec3::splat(0.2);
    let picture = s.render().picture;
    for (x, y) in [(4, 4), (6, 2), (2, 5), (1, 4)] {
        let normal = on_unit_sphere(x, y, 9);
        let to_light = (Vec3::new(3.0, 4.0, 12.0) - normal).normalize();
        let cosine = normal.dot(to_light).max(0.0);
        let mirrored = 2.0 * normal.dot(to_light) * normal - to_light;
        let highlight = if cosine > 0.0 { mirrored.z.max(0.0).powi(5) } else { 0.0 };
        let expected = Vec3::splat(0.1) + 0.9 * (Vec3::new(0.8, 0.4, 0.2) * cosine + Vec3::splat(0.25 * highlight));
        assert_near(Vec3::from_slice(&picture.beauty[(y * 9 + x) as usize]), expected, 1e-5);
    }
}

#[test]
fn a_sphere_that_is_behind_or_beside_is_not_seen() {
    let mut s = looking_down(5.0);
    s.sphere(DVec3::Z * 8.0, 1.0, unlit(Vec3::ONE)).sphere(DVec3::X * 3.0, 1.0, unlit(Vec3::ONE));
    assert_eq!(s.render().picture.beauty[0], [0.0; 4]);
}

#[test]
fn the_nearest_hit_wins() {
    let mut s = looking_down(5.0);
    s.square(0.0, 1.0, unlit(Vec3::X)).square(1.0, 1.0, unlit(Vec3::Y)).square(-1.0, 1.0, unlit(Vec3::Z));
    assert_eq!(s.color(), Vec3::Y);
}

#[test]
fn an_opaque_thing_blocks_the_light() {
    let mut s = looking_down(5.0);
    s.square(0.0, 9.0, material(Vec3::ONE, phong())).lamp(DVec3::new(4.0, 0.0, 3.0), 1.0);
    assert_near(s.color(), Vec3::splat(0.6), 1e-6);
    s.sphere(DVec3::new(2.0, 0.0, 1.5), 0.5, unlit(Vec3::ONE));
    assert_eq!(s.color(), Vec3::ZERO);
    s.scene.lights[0].shadows = false;
    assert_near(s.color(), Vec3::splat(0.6), 1e-6);
}

#[test]
fn nothing_beyond_a_lamp_blocks_it() {
    let mut s = looking_down(5.0);
    s.square(0.0, 9.0, material(Vec3::ONE, phong())).lamp(DVec3::new(4.0, 0.0, 3.0), 1.0);
    s.sphere(DVec3::new(8.0, 0.0, 6.0), 1.0, unlit(Vec3::ONE));
    assert_near(s.color(), Vec3::splat(0.6), 1e-6);
}

#[test]
fn two_colored_filters_multiply() {
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::new(0.0, 3.0, 5.0), DVec3::ZERO, DVec3::Y, Lens::orthographic(0.1));
    let filter = |t: Vec3| material(Vec3::ZERO, Phong { transmission: t, ..phong() });
    s.square(0.0, 9.0, material(Vec3::ONE, phong())).lamp(DVec3::new(4.0, 0.0, 3.0), 1.0);
    s.sphere(DVec3::new(2.0, 0.0, 1.5), 0.5, filter(Vec3::new(0.5, 1.0, 0.2)));
    s.square(1.0, 2.0, filter(Vec3::new(0.5, 0.5, 0.0)));
    // The square must not hide the middle of the wall from the eye.
    s.scene.meshes[1].positions.iter_mut().for_each(|p| p.y = p.y.clamp(-0.5, 0.5));
    assert_near(s.color(), 0.6 * Vec3::new(0.125, 0.5, 0.0), 1e-6);
}

#[test]
fn absent_texels_throw_no_shadow_and_blended_ones_a_faint_one() {
    let mut s = looking_down(5.0);
    s.square(0.0, 9.0, material(Vec3::ONE, phong())).lamp(DVec3::new(4.0, 0.0, 3.0), 1.0);
    s.sphere(DVec3::new(2.0, 0.0, 1.5), 0.5, Material { opacity: 0.25, ..unlit(Vec3::ONE) });
    for (alpha_mode, light) in [
        (AlphaMode::Opaque, 0.0),
        (AlphaMode::Mask { cutoff: 0.2 }, 0.0),
        (AlphaMode::Mask { cutoff: 0.3 }, 1.0),
        (AlphaMode::Blend, 0.75 * 0.75),
    ] {
        s.scene.materials[1].alpha_mode = alpha_mode;
        assert_near(s.color(), Vec3::splat(0.6 * light), 1e-6);
    }
}

#[test]
fn the_unseen_back_of_a_face_blocks_light() {
    let mut s = looking_down(5.0);
    s.square(0.0, 9.0, material(Vec3::ONE, phong())).lamp(DVec3::new(4.0, 0.0, -3.0), 1.0);
    s.view = View::look_at(DVec3::Z * -5.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(1.0));
    // Faces +z, so that its back is turned to the lamp and to the eye.
    s.square(-1.0, 3.0, Material { double_sided: false, ..unlit(Vec3::ONE) });
    assert_eq!(s.color(), Vec3::ZERO);
    assert_eq!(s.alpha(), 1.0, "the wall behind is seen");
}

#[test]
fn white_in_a_furnace_is_as_bright_as_the_furnace() {
    for (metallic, roughness) in
        [(0.0, 0.05), (0.0, 0.2), (0.0, 0.6), (0.0, 1.0), (1.0, 0.0), (1.0, 0.15), (1.0, 0.5), (1.0, 1.0)]
    {
        let mut s = looking_down(5.0);
        let model = MetalRough { metallic, roughness, ..MetalRough::default() };
        let reflection = Reflection::MetalRough(model);
        s.sphere(DVec3::new(0.3, 0.2, 0.0), 1.0, Material { reflection, ..Material::plain() });
        s.scene.materials[0].base_color = Vec3::ONE;
        s.scene.environment = Environment::Constant(Vec3::new(1.0, 2.0, 0.5));
        assert_near(s.color(), Vec3::new(1.0, 2.0, 0.5), 2e-3);
    }
    let mut s = looking_down(5.0);
    s.sphere(DVec3::ZERO, 1.0, material(Vec3::ONE, phong()));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    assert_near(s.color(), Vec3::ONE, 1e-6);
}

#[test]
fn both_models_show_one_color_alike_under_every_light() {
    let matt = MetalRough { metallic: 0.0, roughness: 1.0, specular: 0.0, ..MetalRough::default() };
    let lights = [
        LightKind::Directional { direction: DVec3::new(0.6, 0.0, -0.8) },
        LightKind::Point { position: DVec3::new(2.0, 1.0, 3.0), falloff: Falloff::None },
        LightKind::Point { position: DVec3::Z * 2.0, falloff: Falloff::InverseSquare { range: 9.0 } },
    ];
    for kind in lights {
        let mut s = looking_down(1.0);
        s.square(0.0, 1.0, material(Vec3::new(0.8, 0.4, 0.2), phong())).lamp(DVec3::ZERO, 3.0);
        s.scene.lights[0].kind = kind;
        let phong = s.color();
        s.scene.materials[0].reflection = Reflection::MetalRough(matt.clone());
        assert_near(s.color(), phong, 1e-5);
        assert!(phong.x > 0.1);
    }
}

#[test]
fn lux_and_candela_follow_the_brdf() {
    let mut s = looking_down(1.0);
    let reflection = Reflection::MetalRough(MetalRough { specular: 0.0, metallic: 0.0, ..MetalRough::default() });
    s.square(0.0, 1.0, Material { reflection, ..Material::plain() }).lamp(DVec3::ZERO, 5.0);
    s.scene.lights[0].kind = LightKind::Directional { direction: DVec3::new(0.6, 0.0, -0.8) };
    assert_near(s.color(), Vec3::splat(5.0 * 0.6 / std::f32::consts::PI * 0.8), 1e-5);
    let falloff = Falloff::InverseSquare { range: f64::INFINITY };
    s.scene.lights[0].kind = LightKind::Point { position: DVec3::Z * 2.0, falloff };
    assert_near(s.color(), Vec3::splat(5.0 / 4.0 * 0.6 / std::f32::consts::PI), 1e-5);
}

#[test]
fn broken_normals_never_reach_the_picture() {
    for normal in [Vec3::ZERO, Vec3::NAN, Vec3::splat(f32::INFINITY), Vec3::NEG_Z, Vec3::X] {
        let mut s = looking_down(5.0);
        s.square(0.0, 1.0, Material::plain()).lamp(DVec3::new(1.0, 2.0, 3.0), 1.0);
        s.scene.meshes[0].normals = vec![normal; 4];
        s.scene.environment = Environment::Studio;
        let color = s.color();
        assert!(color.is_finite() && color.min_element() > 0.05, "{normal}: {color}");
    }
}

#[test]
fn a_face_seen_from_behind_is_lit_from_there() {
    let mut s = looking_down(-5.0);
    s.square(0.0, 9.0, material(Vec3::ONE, phong())).lamp(DVec3::new(4.0, 0.0, -3.0), 1.0);
    s.scene.meshes[0].normals = vec![Vec3::Z; 4];
    assert_near(s.color(), Vec3::splat(0.6), 1e-6);
}
