//! Narrow highlights of lights, which few rays hit.

use super::round::ball;
use super::*;
use crate::scene::MetalRough;

/// A smooth metal ball of this radius in a picture of one pixel of side 1, off its middle, under one light.
fn mirror_ball(radius: f64, at: DVec3, place: impl FnOnce(&mut Stage, f64, DVec3, Material)) -> Stage {
    let mut s = looking_down(3.0);
    let metal = MetalRough { metallic: 1.0, roughness: 0.0, ..MetalRough::default() };
    let material = Material { base_color: Vec3::ONE, reflection: Reflection::MetalRough(metal), ..Material::plain() };
    place(&mut s, radius, at, material);
    let kind = LightKind::Directional { direction: DVec3::new(-0.4, -0.5, -1.0).normalize() };
    s.scene.lights.push(Light { name: String::new(), intensity: Vec3::ONE, kind, shadows: false, size: 0.0 });
    s.settings.depth = Some(0);
    s
}

fn exact(s: &mut Stage, radius: f64, at: DVec3, material: Material) {
    s.sphere(at, radius, material);
}

fn meshed(s: &mut Stage, radius: f64, at: DVec3, material: Material) {
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(radius), crate::math::DQuat::IDENTITY, at);
    s.mesh(ball(64, 32), place, material);
}

#[test]
fn a_light_in_a_ball_smaller_than_a_pixel_is_as_bright_as_the_ball_makes_it_and_met_by_few_rays() {
    // A mirror ball reflects light uniformly in all directions: its intensity is irradiance · radius² / 4.
    let offsets = [(0.0, 0.0), (0.07, 0.03), (-0.05, 0.09), (0.02, -0.11)];
    for (name, place) in [("exact", exact as fn(&mut Stage, f64, DVec3, Material)), ("meshed", meshed)] {
        for radius in [0.3, 0.38] {
            let expected = radius * radius / 4.0;
            for (x, y) in offsets {
                let mut s = mirror_ball(radius, DVec3::new(x, y, 0.0), place);
                s.settings.samples = 64;
                let seen = f64::from(s.color().x);
                assert!(
                    (seen / expected - 1.0).abs() < 0.25,
                    "{name}, radius {radius} at {x}, {y}: {seen} of {expected}"
                );
            }
        }
    }
}

#[test]
fn a_light_in_a_large_ball_is_no_wider_than_it_was() {
    // Where hundreds of pixels cross the ball, the highlight is widened by less than a roughness of 0.1.
    let mut s = mirror_ball(200.0, DVec3::new(0.0, 0.0, -200.0), exact);
    let kind = LightKind::Directional { direction: DVec3::NEG_Z };
    s.scene.lights[0].kind = kind;
    s.settings.samples = 64;
    let narrow = s.color().x;
    let Reflection::MetalRough(metal) = &mut s.scene.materials[0].reflection else { panic!("it is metal") };
    metal.roughness = 0.1;
    assert!(narrow > 5.0 * s.color().x, "{narrow}, {}", s.color().x);
}
