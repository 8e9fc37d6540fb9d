//! Rough surfaces with spread rays for reflection and transmission.

use super::*;
use crate::accel::AccelKind;
use crate::render::context::Context;
use crate::render::sampling::{Sampling, Stochastic};
use crate::scene::{Environment, MetalRough};

fn rough(model: MetalRough) -> Material {
    Material {
        base_color: Vec3::ONE,
        reflection: Reflection::MetalRough(model),
        double_sided: true,
        ..Material::default()
    }
}

fn metal(roughness: f32) -> Material {
    rough(MetalRough { metallic: 1.0, roughness, ..MetalRough::default() })
}

/// A floor of white metal at z = 0, viewed straight down from below a glowing ball of radius 1 whose centre is at height 2.
fn under_a_ball(roughness: f32) -> Stage {
    let mut s = looking_down(0.5);
    s.view = View::look_at(DVec3::Z * 0.5, DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
    s.plane(DVec3::Z, 0.0, metal(roughness)).sphere(DVec3::Z * 2.0, 1.0, unlit(Vec3::new(4.0, 2.0, 1.0)));
    (s.settings.samples, s.settings.gloss_rays) = (256, Some(16));
    s
}

#[test]
fn a_rough_mirror_shows_what_the_lobe_sees() {
    for roughness in [0.1f32, 0.3, 0.5] {
        // Facets within 15° of the normal mirror the view into the ball, which reaches 30° out from straight above.
        let tan_squared = libm::tanf(15f32.to_radians()).powi(2);
        let seen = tan_squared / (tan_squared + roughness.powi(4));
        let color = under_a_ball(roughness).color();
        assert!((color.x / (4.0 * seen) - 1.0).abs() < 0.03, "{roughness}: {color} for {}", 4.0 * seen);
        assert!((color.x / color.z - 4.0).abs() < 1e-3);
    }
}

#[test]
fn without_such_rays_a_rough_mirror_sees_the_surroundings_alone() {
    let mut s = under_a_ball(0.5);
    s.settings.gloss_rays = None;
    assert_eq!(s.color(), Vec3::ZERO);
}

#[test]
fn white_in_a_furnace_is_as_bright_as_the_furnace() {
    for (metallic, roughness) in [(0.0, 0.3), (0.0, 0.7), (1.0, 0.0), (1.0, 0.2), (1.0, 0.6), (1.0, 1.0)] {
        let mut s = looking_down(5.0);
        s.sphere(DVec3::new(0.3, 0.2, 0.0), 1.0, rough(MetalRough { metallic, roughness, ..MetalRough::default() }));
        s.scene.environment = Environment::Constant(Vec3::new(1.0, 2.0, 0.5));
        (s.settings.samples, s.settings.gloss_rays) = (64, Some(16));
        let color = s.color() / Vec3::new(1.0, 2.0, 0.5);
        assert!((color - Vec3::ONE).abs().max_element() < 0.02, "{metallic} {roughness}: {color}");
    }
}

#[test]
fn many_rays_show_what_few_show_though_each_weighs_next_to_nothing() {
    let of = |rays, metallic| {
        let mut s = looking_down(5.0);
        let model = MetalRough { metallic, roughness: 0.4, ..MetalRough::default() };
        s.sphere(DVec3::new(0.3, 0.2, 0.0), 1.0, Material { base_color: Vec3::splat(metallic), ..rough(model) });
        s.scene.environment = Environment::Constant(Vec3::ONE);
        s.settings = Settings { samples: 4, gloss_rays: Some(rays), cutoff: 1.0 / 512.0, ..s.settings };
        s.color().x
    };
    for metallic in [0.0, 1.0] {
        let few = of(16, metallic);
        for rays in [128, 2048] {
            let many = of(rays, metallic);
            assert!((many / few - 1.0).abs() < 0.06, "{metallic} {rays}: {many} for {few}");
        }
    }
}

#[test]
fn frosted_glass_in_a_furnace_loses_next_to_nothing() {
    for (thick, roughness) in [(false, 0.3), (true, 0.2), (true, 0.5)] {
        let mut s = looking_down(5.0);
        let glass =
            MetalRough { metallic: 0.0, roughness, transmission: 1.0, thick, thickness: 1.0, ..MetalRough::default() };
        s.sphere(DVec3::new(0.3, 0.2, 0.0), 1.0, rough(glass));
        s.scene.environment = Environment::Constant(Vec3::ONE);
        s.scene.background = Some(crate::scene::Background::Environment);
        (s.settings.samples, s.settings.gloss_rays) = (256, Some(4));
        let color = s.color();
        assert!(color.x <= 1.01 && color.x > 0.96, "{thick} {roughness}: {color}");
    }
}

#[test]
fn what_is_part_glass_and_part_metal_gives_off_no_more_than_it_gets() {
    for (metallic, transmission) in [(1.0, 1.0), (0.5, 1.0), (0.5, 0.5), (0.0, 0.5), (1.0, 0.3)] {
        for (roughness, thick, ior) in [
            (0.5, false, 1.5),
            (1.0, false, 1.5),
            (0.2, true, 1.5),
            (0.5, true, 2.4),
            (1.0, true, 1.5),
            (1.0, true, 3.0),
        ] {
            let mut s = looking_down(5.0);
            let thickness = f32::from(thick);
            let model =
                MetalRough { metallic, roughness, transmission, thick, thickness, ior, ..MetalRough::default() };
            s.sphere(DVec3::new(0.3, 0.2, 0.0), 1.0, rough(model));
            s.scene.environment = Environment::Constant(Vec3::ONE);
            s.scene.background = Some(crate::scene::Background::Environment);
            (s.settings.samples, s.settings.gloss_rays) = (256, Some(4));
            let color = s.color().x;
            assert!((0.75..1.02).contains(&color), "{metallic} {transmission} {roughness} {thick} {ior}: {color}");
        }
    }
}

#[test]
fn a_metal_is_the_same_whether_or_not_the_file_says_that_its_dielectric_part_is_glass() {
    let of = |transmission| {
        let mut s = under_a_ball(0.5);
        let model = MetalRough { metallic: 1.0, roughness: 0.5, transmission, ..MetalRough::default() };
        s.scene.materials[0] = rough(model);
        s.color()
    };
    assert_near(of(1.0), of(0.0), 1e-6);
}

#[test]
fn a_spread_ray_stands_for_the_less_of_its_lobe_the_more_samples_a_pixel_may_have() {
    let width = |sampling, samples| {
        let s = under_a_ball(0.5);
        let settings = Settings { sampling, samples, ..s.settings.clone() };
        Context::new(&s.scene, &World::new(&s.scene), &TextureStore::new(&s.scene), &settings).gloss.width
    };
    assert_eq!([1, 4, 64].map(|samples| width(Sampling::Uniform, samples)), [1.0, 0.5, 0.125]);
    let most = Stochastic { max_samples: 256, ..Stochastic::default() };
    assert_eq!(width(Sampling::Stochastic(most), 1), 0.0625);
}

#[test]
fn what_lets_no_light_in_does_not_disperse_it() {
    for (metallic, transmission) in [(1.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
        let of = |dispersion, no_prune| {
            let model = MetalRough {
                metallic,
                transmission,
                dispersion,
                roughness: 0.4,
                thick: true,
                thickness: 1.0,
                ..MetalRough::default()
            };
            let mut s = looking_down(5.0);
            s.square(0.0, 9.0, rough(model));
            s.scene.environment = Environment::Constant(Vec3::ONE);
            (s.settings.samples, s.settings.gloss_rays, s.settings.no_prune) = (16, Some(4), no_prune);
            s.color()
        };
        assert_near(of(5.0, false), of(0.0, false), 1e-6);
        assert_near(of(5.0, true), of(5.0, false), 1e-6);
        assert!(of(5.0, false).x > 0.9);
    }
}

/// Radiance of a square of this glass in a white furnace.
fn in_a_furnace(glass: MetalRough, from: f64, rays: Option<u32>) -> f32 {
    let mut s = looking_down(from);
    s.square(0.0, 9.0, rough(glass));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s.scene.background = Some(crate::scene::Background::Environment);
    (s.settings.samples, s.settings.gloss_rays) = (64, rays);
    s.color().x
}

#[test]
fn a_frosted_pane_looks_alike_from_both_sides_with_rays_and_without() {
    for roughness in [0.3, 0.6, 1.0] {
        for rays in [Some(0), Some(4), None] {
            let pane = || MetalRough { metallic: 0.0, roughness, transmission: 1.0, ..MetalRough::default() };
            let (front, back) = (in_a_furnace(pane(), 5.0, rays), in_a_furnace(pane(), -5.0, rays));
            assert!((front - back).abs() < 0.01 && front > 0.96, "{roughness} {rays:?}: {front} {back}");
        }
    }
}

#[test]
fn a_volume_that_bends_nothing_is_clear_however_rough_it_is() {
    for rays in [Some(0), Some(8)] {
        let air = MetalRough {
            metallic: 0.0,
            roughness: 0.9,
            transmission: 1.0,
            thick: true,
            thickness: 1.0,
            ior: 1.0,
            ..MetalRough::default()
        };
        let mut s = looking_down(5.0);
        s.sphere(DVec3::ZERO, 1.0, rough(air)).plane(DVec3::Z, -2.0, unlit(Vec3::new(0.25, 0.5, 0.75)));
        s.settings.gloss_rays = rays;
        assert_near(s.color(), Vec3::new(0.25, 0.5, 0.75), 1e-4);
    }
}

#[test]
fn frosted_glass_blurs_what_is_behind_it_the_more_the_farther_it_is() {
    // A thin frosted pane over a floor that is white for x < 0 and black beyond.
    let shown = |distance: f64, x: f64| {
        let mut s = looking_down(1.0);
        let eye = DVec3::new(x, 0.0, 1.0);
        s.view = View::look_at(eye, eye - DVec3::Z, DVec3::Y, Lens::orthographic(0.001));
        let glass = MetalRough { metallic: 0.0, roughness: 0.3, transmission: 1.0, ..MetalRough::default() };
        s.square(0.0, 9.0, rough(glass));
        let half = DAffine3::from_translation(DVec3::new(-40.0, 0.0, -distance));
        s.mesh(square(0.0, 40.0), half, unlit(Vec3::ONE));
        (s.settings.samples, s.settings.gloss_rays) = (256, Some(8));
        s.color().x
    };
    assert!((shown(1.0, 0.0) - 0.48).abs() < 0.04, "{}", shown(1.0, 0.0));
    assert!(shown(0.1, 0.1) < 0.06, "{}", shown(0.1, 0.1));
    assert!(shown(2.0, 0.1) > 0.25, "{}", shown(2.0, 0.1));
}

#[test]
fn every_structure_gives_the_same_bits() {
    let mut s = under_a_ball(0.4);
    (s.settings.width, s.settings.height, s.settings.samples, s.settings.gloss_rays) = (16, 16, 1, Some(3));
    s.view = View::look_at(DVec3::new(0.0, -6.0, 4.0), DVec3::Z, DVec3::Z, Lens::orthographic(4.0));
    s.scene.environment = Environment::Studio;
    let first = s.render().picture.beauty;
    for kind in AccelKind::ALL {
        assert!(s.render_by(kind).picture.beauty == first, "{kind:?}");
    }
}
