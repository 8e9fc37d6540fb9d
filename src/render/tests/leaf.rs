//! Diffuse transmission through thin surfaces.

use super::*;
use crate::scene::{DiffuseTransmission, Environment, MetalRough};

const BASE: Vec3 = Vec3::new(0.8, 0.4, 0.2);
const THROUGH: Vec3 = Vec3::new(0.1, 0.9, 0.3);
/// Share of the scattered light that passes through.
const SHARE: f32 = 0.25;

/// A surface without Fresnel reflection, so that all light is scattered.
fn leaf(share: f32) -> Material {
    let diffuse_transmission = (share > 0.0)
        .then(|| Box::new(DiffuseTransmission { share, share_map: None, color: THROUGH, color_map: None }));
    let dull = MetalRough { metallic: 0.0, specular: 0.0, diffuse_transmission, ..MetalRough::default() };
    Material { base_color: BASE, double_sided: true, reflection: Reflection::MetalRough(dull), ..Material::default() }
}

/// A leaf at z = 0, seen from above, in constant light of radiance 1 from everywhere.
fn in_the_open(share: f32) -> Stage {
    let mut s = looking_down(0.5);
    s.square(0.0, 1.0, leaf(share));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s
}

#[test]
fn a_lamp_behind_a_leaf_shines_through_in_its_colour() {
    let lit = |share: f32, height: f64| {
        let mut s = looking_down(0.5);
        s.square(0.0, 1.0, leaf(share)).lamp(DVec3::new(0.0, 0.0, height), 1.0);
        s.color()
    };
    let opaque = lit(0.0, 5.0);
    assert!(opaque.min_element() > 0.0 && lit(0.0, -5.0) == Vec3::ZERO);
    assert_near(lit(SHARE, 5.0), opaque * (1.0 - SHARE), 1e-6);
    // The opaque leaf is lit in its base colour; divided by that, it gives the light itself.
    assert_near(lit(SHARE, -5.0), opaque / BASE * THROUGH * SHARE, 1e-6);
}

#[test]
fn what_stands_behind_a_leaf_throws_its_shadow_on_it() {
    let mut s = looking_down(0.5);
    s.square(0.0, 1.0, leaf(SHARE)).lamp(DVec3::NEG_Z * 5.0, 1.0);
    assert!(s.color().min_element() > 0.0);
    s.square(-1.0, 0.5, unlit(Vec3::ZERO));
    assert_eq!(s.color(), Vec3::ZERO);
}

#[test]
fn an_even_light_is_seen_from_both_sides_with_and_without_rays() {
    let expected = BASE * (1.0 - SHARE) + THROUGH * SHARE;
    let mut s = in_the_open(SHARE);
    assert_near(s.color(), expected, 1e-5);
    s.settings.env_rays = Some(8);
    assert_near(s.color(), expected, 1e-5);
    s.scene.ambient = Vec3::ONE;
    assert_near(s.color(), expected * 2.0, 2e-5);
}

#[test]
fn rays_find_what_covers_the_back() {
    let mut s = in_the_open(SHARE);
    s.square(-1e-3, 100.0, unlit(Vec3::ZERO));
    for rays in [1, 2, 6, 32] {
        (s.settings.samples, s.settings.env_rays) = (256, Some(rays));
        assert_near(s.color(), BASE * (1.0 - SHARE), 0.01);
    }
}
