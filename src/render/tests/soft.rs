//! Area lights and their soft shadows.

use super::*;
use crate::accel::AccelKind;
use std::f32::consts::PI;

/// A white floor, viewed straight down at one point, under a light of this kind and size.
fn floor(kind: LightKind, size: f64) -> Stage {
    let mut s = looking_down(0.5);
    s.view = View::look_at(DVec3::Z * 0.5, DVec3::ZERO, DVec3::Y, Lens::orthographic(0.001));
    s.plane(DVec3::Z, 0.0, material(Vec3::ONE, phong()));
    s.scene.lights.push(Light { name: String::new(), intensity: Vec3::splat(PI), kind, shadows: true, size });
    (s.settings.samples, s.settings.light_rays) = (64, 64);
    s
}

const SQUARE: Falloff = Falloff::InverseSquare { range: f64::INFINITY };

fn tilted(degrees: f64) -> DVec3 {
    DVec3::new(libm::sin(degrees.to_radians()), 0.0, libm::cos(degrees.to_radians()))
}

#[test]
fn a_ball_lights_as_a_point_of_its_candela_would() {
    for (height, radius) in [(1.0, 0.05), (1.0, 0.5), (2.0, 1.9)] {
        // Straight above, a ball equals Lambert's point light whatever its size: E = I / d².
        let s = floor(LightKind::Point { position: DVec3::Z * height, falloff: SQUARE }, radius);
        let expected = 1.0 / (height * height) as f32;
        assert!((s.color().x / expected - 1.0).abs() < 0.01, "{height} {radius}: {}", s.color());
    }
    let inside = floor(LightKind::Point { position: DVec3::Z * 0.3, falloff: SQUARE }, 0.5);
    assert_eq!(inside.color(), Vec3::ZERO);
}

#[test]
fn a_disc_in_the_sky_keeps_its_lux() {
    for degrees in [0.53f64, 20.0] {
        let s = floor(LightKind::Directional { direction: -tilted(40.0) }, 0.5 * degrees.to_radians());
        let expected = libm::cosf(40f32.to_radians());
        // A wide disc is on average slightly lower than its centre.
        assert!((s.color().x / expected - 1.0).abs() < 0.012, "{degrees}: {} for {expected}", s.color());
    }
}

#[test]
fn a_rectangle_lights_by_the_cosines_at_both_ends() {
    let side = 0.1;
    let toward = tilted(30.0);
    let u = DVec3::Y;
    let v = toward.cross(u);
    // It faces the origin: its normal is −toward.
    let sides = [v * side, u * side];
    assert!(sides[0].cross(sides[1]).dot(toward) < 0.0 || sides[1].cross(sides[0]).dot(toward) < 0.0);
    let sides = if sides[0].cross(sides[1]).dot(toward) < 0.0 { sides } else { [sides[1], sides[0]] };
    let kind = LightKind::Rectangle { position: toward * 2.0, sides, falloff: SQUARE };
    let expected = libm::cosf(30f32.to_radians()) / 4.0;
    let s = floor(kind, 0.0);
    assert!((s.color().x / expected - 1.0).abs() < 0.01, "{} for {expected}", s.color());
    let away = LightKind::Rectangle { position: toward * 2.0, sides: [sides[1], sides[0]], falloff: SQUARE };
    assert_eq!(floor(away, 0.0).color(), Vec3::ZERO, "it shines to one side only");
}

#[test]
fn the_edge_of_a_shadow_is_as_soft_as_the_light_is_wide() {
    // A half plane at height 1 hides the half of a sun straight above that lies beyond x = 0.
    let sun = LightKind::Directional { direction: DVec3::NEG_Z };
    let shadowed = |x: f64, size: f64| {
        let mut s = floor(sun, size);
        let eye = DVec3::new(x, 0.0, 0.5);
        s.view = View::look_at(eye, eye - DVec3::Z, DVec3::Y, Lens::orthographic(0.001));
        let edge = DAffine3::from_translation(DVec3::new(20.0, 0.0, 1.0));
        s.mesh(square(0.0, 20.0), edge, material(Vec3::ONE, phong()));
        s.color().x
    };
    assert!((shadowed(0.0, 0.1) - 0.5).abs() < 0.02, "{}", shadowed(0.0, 0.1));
    let tan = libm::tan(0.1);
    assert!(shadowed(-1.05 * tan, 0.1) > 0.98 && shadowed(1.05 * tan, 0.1) < 1e-6);
    let half = shadowed(-0.5 * tan, 0.1);
    // Part of a disc on one side of a chord at half its radius: 1 − (π/3 − √3/4) / π.
    assert!((half - 0.8045).abs() < 0.02, "{half}");
    assert_eq!((shadowed(-0.01, 0.0), shadowed(0.01, 0.0)), (1.0, 0.0), "without an extent it is sharp");
}

#[test]
fn every_structure_gives_the_same_bits() {
    let mut s = floor(LightKind::Point { position: DVec3::new(1.0, 1.0, 4.0), falloff: SQUARE }, 0.5);
    s.sphere(DVec3::Z, 0.7, Material::plain());
    (s.settings.width, s.settings.height, s.settings.samples, s.settings.light_rays) = (16, 16, 1, 3);
    s.view = View::look_at(DVec3::new(0.0, -6.0, 4.0), DVec3::Z, DVec3::Z, Lens::orthographic(4.0));
    let first = s.render().picture.beauty;
    for kind in AccelKind::ALL {
        assert!(s.render_by(kind).picture.beauty == first, "{kind:?}");
    }
}
