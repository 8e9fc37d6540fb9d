//! The sun of a panorama in rough mirrors and behind frosted glass, and other small lights that spread rays seldom hit.

use super::*;
use crate::render::sampling::{Sampling, Stochastic};
use crate::render::{ThinLens, render};
use crate::scene::{Background, Environment, MetalRough, Panorama};
use std::f32::consts::PI;
use std::sync::Arc;

/// A sky of .1 with a square sun, `texels` of 512 × 256 wide, straight up (along +z); also its radiance and solid angle, sr.
fn sun(texels: usize) -> (Panorama, f32, f32) {
    const RADIANCE: f32 = 3000.0;
    let mut all = vec![[0.1; 3]; 512 * 256];
    for (row, column) in (0..texels).flat_map(|y| (0..texels).map(move |x| (y, x))) {
        // +Z is a quarter to the right of the middle.
        all[(128 - texels / 2 + row) * 512 + 384 - texels / 2 + column] = [RADIANCE; 3];
    }
    let side = texels as f32 * PI / 256.0;
    let texels = Arc::new(all);
    (Panorama { name: String::new(), width: 512, height: 256, texels, ..Panorama::default() }, RADIANCE, side * side)
}

/// One pixel before such a sky, whose eye looks along ±z.
fn under(sky: Panorama, from: f64) -> Stage {
    let mut s = looking_down(from);
    s.view = View::look_at(DVec3::Z * from, DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
    s.scene.environment = Environment::Panorama;
    s.scene.background = Some(Background::Environment);
    s.scene.panorama = Some(sky);
    (s.settings.samples, s.settings.gloss_rays) = (4, Some(1));
    s
}

fn rough(model: MetalRough) -> Material {
    let reflection = Reflection::MetalRough(model);
    Material { base_color: Vec3::ONE, double_sided: true, reflection, ..Material::default() }
}

fn frosted(roughness: f32) -> Material {
    rough(MetalRough { metallic: 0.0, transmission: 1.0, roughness, ..MetalRough::default() })
}

/// Density of rays in the mirror direction, for a lobe viewed along its normal, 1/sr.
fn density(roughness: f32) -> f32 {
    1.0 / (4.0 * PI * roughness.powi(4))
}

#[test]
fn four_rays_see_the_sun_in_a_rough_mirror_as_bright_as_all_of_its_facets_do() {
    // Rougher ones also reflect light of several facets, which a formula adds.
    for roughness in [0.2, 0.3, 0.5] {
        let (sky, radiance, area) = sun(2);
        let mut s = under(sky, 0.5);
        s.plane(DVec3::Z, 0.0, rough(MetalRough { metallic: 1.0, roughness, ..MetalRough::default() }));
        let (color, expected) = (s.color().x, radiance * area * density(roughness));
        assert!((color - 0.1) / expected > 0.97 && (color - 0.1) / expected < 1.06, "{roughness}: {color}, {expected}");
    }
}

#[test]
fn what_facets_would_send_to_the_wrong_side_is_sent_to_the_right_one_in_sight_of_the_sun_too() {
    // Suns slightly smaller than the limit of a hotspot, and slightly larger, which only spread rays see.
    let light = |texels: usize, rays: u32, material: Material, from: DVec3| {
        let (sky, radiance, area) = sun(texels);
        let mut s = under(sky, 1.0);
        s.view = View::look_at(from, DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
        (s.settings.samples, s.settings.gloss_rays) = (1024, Some(rays));
        s.square(0.0, 9.0, material);
        (s.color().x - 0.1) / (radiance * area)
    };
    let metal = || rough(MetalRough { metallic: 1.0, roughness: 1.0, ..MetalRough::default() });
    for (material, side) in [(metal(), 1.0), (frosted(1.0), -1.0)] {
        let from = DVec3::new(3.0, 0.0, side);
        let (hotspot, spread) = (light(11, 1, material.clone(), from), light(12, 64, material, from));
        assert!((hotspot / spread - 1.0).abs() < 0.06, "{side}: {hotspot}, {spread}");
    }
}

#[test]
fn backs_that_nobody_sees_hide_no_sun_from_a_rough_mirror() {
    let seen = |faces_up: Option<bool>| {
        let (sky, ..) = sun(8);
        let mut s = under(sky, 0.5);
        s.plane(DVec3::Z, 0.0, rough(MetalRough { metallic: 1.0, roughness: 0.5, ..MetalRough::default() }));
        (s.settings.samples, s.settings.gloss_rays) = (4096, Some(16));
        if let Some(faces_up) = faces_up {
            let turned = DAffine3::from_rotation_x(if faces_up { 0.0 } else { std::f64::consts::PI });
            let black = Material { base_color: Vec3::ZERO, ..Material::default() };
            s.mesh(square(if faces_up { 2.0 } else { -2.0 }, 9.0), turned, black);
        }
        s.color().x
    };
    let (open, behind) = (seen(None), seen(Some(true)));
    assert!((behind / open - 1.0).abs() < 0.1, "{behind} of {open}");
    assert!(seen(Some(false)) < 0.2 * open);
}

/// Transmittance of a frosted pane, viewed face on.
fn let_through(roughness: f32) -> f32 {
    let mut s = looking_down(-0.5);
    s.square(0.0, 9.0, frosted(roughness)).plane(DVec3::Z, 5.0, unlit(Vec3::ONE));
    (s.settings.samples, s.settings.gloss_rays) = (64, Some(4));
    s.color().x
}

#[test]
fn four_rays_see_the_sun_through_a_frosted_pane_as_bright_as_all_of_its_facets_do() {
    for roughness in [0.3, 0.5, 0.8] {
        let (sky, radiance, area) = sun(2);
        let mut s = under(sky, -0.5);
        s.square(0.0, 9.0, frosted(roughness));
        let (color, expected) = (s.color().x, let_through(roughness) * radiance * area * density(roughness));
        assert!((color - 0.1) / expected > 0.96 && (color - 0.1) / expected < 1.04, "{roughness}: {color}, {expected}");
        // A disc between both.
        s.sphere(DVec3::Z * 3.0, 0.2, unlit(Vec3::ZERO));
        assert!(s.color().x < 0.11, "{roughness}: {} in its shadow", s.color());
    }
}

#[test]
fn what_covers_in_part_halves_a_sun_and_glass_shows_it_to_the_rays_that_are_spread() {
    let shown = |add: &dyn Fn(&mut Stage)| {
        let (sky, ..) = sun(10);
        let mut s = under(sky, -0.5);
        s.square(0.0, 9.0, frosted(0.5));
        (s.settings.samples, s.settings.gloss_rays) = (1024, Some(16));
        add(&mut s);
        s.color().x - 0.1
    };
    let open = shown(&|_| ());
    let half = Material { alpha_mode: crate::scene::AlphaMode::Blend, opacity: 0.5, ..unlit(Vec3::ZERO) };
    let veiled = shown(&|s| {
        s.square(1.0, 9.0, half.clone());
    });
    assert!((veiled / open - 0.5).abs() < 0.02, "{veiled} of {open}");
    // A slab with parallel faces does not turn rays; both faces reflect a part.
    let slab = rough(MetalRough {
        metallic: 0.0,
        transmission: 1.0,
        roughness: 0.0,
        thick: true,
        thickness: 1.0,
        ..MetalRough::default()
    });
    let bent = shown(&|s| {
        let (mut both, far) = (square(1.0, 9.0), square(1.5, 9.0));
        both.positions.extend(far.positions);
        // The near face is turned to the eye.
        both.triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
        s.mesh(both, DAffine3::IDENTITY, slab.clone());
    });
    assert!(bent / open > 0.8 && bent / open < 1.0, "{bent} of {open}");
    let clear = rough(MetalRough { metallic: 0.0, transmission: 1.0, roughness: 0.0, ..MetalRough::default() });
    let thin = shown(&|s| {
        s.square(1.0, 9.0, clear.clone());
    });
    assert!(thin / open > 0.8 && thin / open < 1.0, "{thin} of {open}");
}

#[test]
fn what_touches_a_frosted_pane_from_behind_hides_the_sun() {
    let (sky, ..) = sun(2);
    let mut s = under(sky, -0.5);
    s.square(0.0, 9.0, frosted(0.5)).square(0.0, 9.0, unlit(Vec3::ZERO));
    assert!(s.color().x < 0.1, "{}", s.color());
}

#[test]
fn the_sun_of_a_dim_sky_is_as_much_brighter_than_the_rest_as_that_of_a_bright_one() {
    let of = |scale: f32| {
        let (mut sky, ..) = sun(2);
        sky.texels = Arc::new(sky.texels.iter().map(|texel| texel.map(|light| light * scale)).collect());
        let mut s = under(sky, -0.5);
        s.settings.cutoff = 1.0 / 512.0;
        s.square(0.0, 9.0, frosted(0.5));
        s.color().x / scale
    };
    let (bright, dim) = (of(1.0), of(1.0 / 1_048_576.0));
    assert!((dim / bright - 1.0).abs() < 1e-5, "{dim} for {bright}");
}

/// A frosted pane with a glass object behind it that does not turn rays.
fn before_glass(thing: MetalRough, opacity: f32) -> Stage {
    let (sky, ..) = sun(10);
    let mut s = under(sky, -0.5);
    s.view = View::look_at(DVec3::Z * -3.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(2.0));
    s.square(0.0, 9.0, frosted(0.5));
    let glass = rough(thing);
    let alpha_mode = if opacity < 1.0 { crate::scene::AlphaMode::Blend } else { glass.alpha_mode };
    s.sphere(DVec3::Z * 2.0, 1.0, Material { opacity, alpha_mode, ..glass });
    (s.settings.width, s.settings.height, s.settings.samples, s.settings.gloss_rays) = (12, 12, 256, Some(1));
    s
}

#[test]
fn a_sun_behind_glass_is_seen_alike_by_points_one_by_one_and_side_by_side() {
    let air = MetalRough {
        transmission: 1.0,
        thick: true,
        thickness: 1.0,
        ior: 1.0,
        roughness: 0.0,
        metallic: 0.0,
        ..MetalRough::default()
    };
    let frost = MetalRough { transmission: 1.0, roughness: 0.4, metallic: 0.0, ..MetalRough::default() };
    for (thing, opacity) in [(air, 1.0), (frost, 0.3)] {
        let mut s = before_glass(thing, opacity);
        let beside = s.render().picture.beauty;
        s.settings.one_by_one = true;
        assert!(s.render().picture.beauty == beside, "{opacity}");
        if opacity == 1.0 {
            s.scene.spheres.clear();
            let mean = |pixels: &[[f32; 4]]| pixels.iter().map(|pixel| pixel[0]).sum::<f32>() / pixels.len() as f32;
            let (through, open) = (mean(&beside), mean(&s.render().picture.beauty));
            assert!((through / open - 1.0).abs() < 0.1, "{through} of {open}");
        }
    }
}

/// Mean of a picture with default stochastic sampling, and of one with `samples` in every pixel.
fn means(s: &mut Stage, samples: u32) -> [f64; 2] {
    let mean = |s: &Stage| {
        let picture = s.with_job(AccelKind::DEFAULT, |job| render(job, &())).picture;
        picture.beauty.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / picture.beauty.len() as f64
    };
    s.settings.sampling = Sampling::Stochastic(Stochastic::default());
    let stochastic = mean(s);
    (s.settings.sampling, s.settings.samples) = (Sampling::Uniform, samples);
    [stochastic, mean(s)]
}

#[test]
fn a_lamp_that_one_ray_of_hundreds_meets_behind_frosted_glass_is_not_missed() {
    let mut s = looking_down(3.0);
    s.view = View::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(2.0));
    s.square(0.0, 2.0, frosted(0.5));
    s.sphere(DVec3::new(0.2, 0.1, -1.0), 0.03, unlit(Vec3::splat(300.0)));
    (s.settings.width, s.settings.height, s.settings.cutoff) = (40, 40, 1.0 / 512.0);
    let [stochastic, many] = means(&mut s, 256);
    assert!((stochastic / many - 1.0).abs() < 0.2, "{stochastic}, {many}");
}

#[test]
fn a_lamp_far_out_of_focus_is_not_missed() {
    let mut s = looking_down(3.0);
    s.view = View::look_at(DVec3::Z * 3.0, DVec3::ZERO, DVec3::Y, Lens::perspective(0.6));
    s.square(-3.0, 9.0, unlit(Vec3::splat(0.1)));
    s.sphere(DVec3::new(0.1, 0.05, 1.0), 0.01, unlit(Vec3::splat(100.0)));
    s.settings.lens = Some(ThinLens { radius: 0.15, focus: 6.0 });
    (s.settings.width, s.settings.height) = (96, 96);
    let [stochastic, many] = means(&mut s, 128);
    assert!(many > 0.11 && (stochastic / many - 1.0).abs() < 0.1, "{stochastic}, {many}");
}
