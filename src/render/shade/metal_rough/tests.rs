use super::*;
use crate::render::media::{Media, MediaTable, Medium};

fn bsdf() -> MetalRoughBsdf {
    MetalRoughBsdf {
        base: Vec3::new(0.8, 0.4, 0.2),
        metal_f0: Vec3::new(0.8, 0.4, 0.2),
        filmed: false,
        metallic: 0.0,
        roughness: 0.5,
        roughness_along: 0.0,
        sent_back: 1.0,
        by_rays: false,
        f0: Vec3::splat(0.04),
        f90: 1.0,
        transmission: 0.0,
        share: 0.0,
        through: Vec3::ZERO,
        occlusion: 1.0,
        ior: 1.5,
        thick: false,
        inside: Vec3::ONE,
        dispersion: 0.0,
        least_square: 0.0,
    }
}

fn at(degrees: f32) -> Vec3 {
    let (sin, cos) = libm::sincosf(degrees.to_radians());
    Vec3::new(sin, 0.0, cos)
}

/// ∫ BRDF N·L over the hemisphere by midpoints.
fn reflected_in_all(m: &MetalRoughBsdf, view: Vec3) -> Vec3 {
    let (rows, columns) = (400u16, 200u16);
    let mut sum = Vec3::ZERO;
    for i in 0..rows {
        for j in 0..columns {
            let theta = (f32::from(i) + 0.5) / f32::from(rows) * PI / 2.0;
            let phi = (f32::from(j) + 0.5) / f32::from(columns) * 2.0 * PI;
            let (st, ct) = libm::sincosf(theta);
            let (sp, cp) = libm::sincosf(phi);
            sum += m.lit(Vec3::Z, view, Vec3::new(st * cp, st * sp, ct)) * st;
        }
    }
    sum * (PI / 2.0 / f32::from(rows)) * (2.0 * PI / f32::from(columns))
}

#[test]
fn the_tabulated_albedo_is_that_of_the_lobe() {
    for (roughness, degrees) in [(0.3, 0.0), (0.5, 45.0), (0.5, 80.0), (0.8, 60.0), (1.0, 20.0)] {
        let white = MetalRoughBsdf { f0: Vec3::ONE, base: Vec3::ZERO, roughness, ..bsdf() };
        let black = MetalRoughBsdf { f0: Vec3::ZERO, ..white };
        let (sum, bias) = (reflected_in_all(&white, at(degrees)).x, reflected_in_all(&black, at(degrees)).x);
        let known = albedo(roughness, at(degrees).z);
        assert!((known.0 - (sum - bias)).abs() < 0.05, "{roughness} at {degrees}: {}, {known:?}", sum - bias);
        assert!((known.1 - bias).abs() < 0.05, "{roughness} at {degrees}: {bias}, {known:?}");
    }
}

#[test]
fn no_more_light_leaves_than_arrives() {
    // At more grazing angles the model itself reflects slightly too much.
    for roughness in [0.2, 0.5, 1.0] {
        for degrees in [0.0, 30.0, 50.0] {
            let white = MetalRoughBsdf { base: Vec3::ONE, roughness, ..bsdf() };
            let all = reflected_in_all(&white, at(degrees)).max_element();
            assert!(all < 1.01, "{roughness} at {degrees}: {all}");
        }
    }
}

#[test]
fn a_matt_dielectric_is_lambertian_but_for_its_sheen() {
    let dull = MetalRoughBsdf { f0: Vec3::ZERO, f90: 0.0, ..bsdf() };
    assert!((dull.lit(Vec3::Z, at(-20.0), at(60.0)) - dull.base * 0.5 / PI).length() < 1e-6);
}

#[test]
fn a_translucent_surface_shares_its_light_between_both_sides() {
    let through = Vec3::new(0.2, 0.9, 0.1);
    let leaf = MetalRoughBsdf { f0: Vec3::ZERO, f90: 0.0, share: 0.25, through, ..bsdf() };
    let (front, back) = (leaf.lit(Vec3::Z, at(-20.0), at(60.0)), leaf.lit_through(Vec3::Z, at(-20.0), at(120.0)));
    assert!((front - leaf.base * (0.75 * 0.5 / PI)).length() < 1e-6);
    assert!((back - through * (0.25 * 0.5 / PI)).length() < 1e-6);
    assert_eq!(leaf.lit_through(Vec3::Z, at(-20.0), at(60.0)), Vec3::ZERO, "that is the front");
    let metal = MetalRoughBsdf { metallic: 1.0, ..leaf };
    assert_eq!(metal.lit_through(Vec3::Z, at(-20.0), at(120.0)), Vec3::ZERO);
    let glossy = MetalRoughBsdf { f0: Vec3::splat(0.04), f90: 1.0, ..leaf };
    let (there, back) = (glossy.lit_through(Vec3::Z, at(25.0), at(130.0)) / 50f32.to_radians().cos(), {
        glossy.lit_through(Vec3::NEG_Z, at(130.0), at(25.0)) / 25f32.to_radians().cos()
    });
    assert!((there - back).length() < 1e-5, "seen and lit can change places: {there} {back}");
}

#[test]
fn seen_and_lit_can_change_places() {
    let m = MetalRoughBsdf { metallic: 0.4, ..bsdf() };
    let (a, b) = (at(25.0), at(-65.0));
    let there = m.lit(Vec3::Z, a, b) / b.z;
    let back = m.lit(Vec3::Z, b, a) / a.z;
    assert!((there - back).length() < 1e-5);
}

#[test]
fn a_mirror_of_metal_has_the_color_of_its_base() {
    let metal = MetalRoughBsdf { metallic: 1.0, roughness: 0.0, ..bsdf() };
    let outside = MediaTable::default().cross(Media::OUTSIDE, Medium { material: 0, ior: 1.0 }, true);
    assert_eq!(metal.bounce_weights(1.0, &outside, true).reflected, metal.base);
    assert_eq!(metal.bounce_weights(1.0, &outside, true).refracted, Vec3::ZERO);
    assert_eq!(MetalRoughBsdf { roughness: 0.5, ..metal }.bounce_weights(1.0, &outside, true).reflected, Vec3::ZERO);
}

#[test]
fn clear_glass_splits_all_light_between_both_rays() {
    let glass = MetalRoughBsdf { base: Vec3::ONE, roughness: 0.0, transmission: 1.0, thick: true, ..bsdf() };
    let mut table = MediaTable::default();
    let into = table.cross(Media::OUTSIDE, Medium { material: 0, ior: 1.5 }, true);
    let out = table.cross(into.beyond, Medium { material: 0, ior: 1.5 }, false);
    for (crossing, outside) in [(into, true), (out, false)] {
        for cosine in [0.1, 0.5, 0.8, 1.0] {
            let bounce_weights = glass.bounce_weights(cosine, &crossing, outside);
            assert!((bounce_weights.reflected + bounce_weights.refracted - Vec3::ONE).length() < 1e-6);
        }
    }
    assert_eq!(glass.bounce_weights(0.1, &out, false).refracted, Vec3::ZERO, "total reflection");
}

#[test]
fn thick_glass_mirrors_in_the_colour_that_its_specular_factors_give() {
    let glass = MetalRoughBsdf { roughness: 0.0, transmission: 1.0, thick: true, ..bsdf() };
    let into = MediaTable::default().cross(Media::OUTSIDE, Medium { material: 0, ior: 1.5 }, true);
    let mirrored = |m: MetalRoughBsdf, cosine| m.bounce_weights(cosine, &into, true).reflected;
    for color in [Vec3::X, Vec3::ZERO, Vec3::new(0.5, 2.0, 1.0)] {
        let f0 = color * 0.04;
        let tinted = MetalRoughBsdf { f0, ..glass };
        assert!((mirrored(tinted, 1.0) - f0).length() < 1e-6, "{color} face on");
        assert!((mirrored(tinted, 0.0) - Vec3::ONE).length() < 1e-6, "{color} grazing");
    }
    assert!((mirrored(glass, 0.3).x - fresnel_dielectric(0.3, 1.0, 1.5) as f32).abs() < 1e-6);
    assert_eq!(mirrored(MetalRoughBsdf { f0: Vec3::ZERO, f90: 0.0, ..glass }, 0.3), Vec3::ZERO);
    let all = MetalRoughBsdf { f0: Vec3::ONE, ior: 0.0, ..glass };
    assert_eq!(
        all.bounce_weights(0.7, &MediaTable::default().pass(Media::OUTSIDE), true).reflected,
        Vec3::ONE,
        "index 0"
    );
}

#[test]
fn a_mirrored_direction_never_goes_into_the_surface() {
    let dir = above(Vec3::new(0.6, 0.0, -0.8), Vec3::Z);
    assert_eq!(dir, Vec3::new(0.6, 0.0, 0.8));
    assert_eq!(above(dir, Vec3::Z), dir);
}
