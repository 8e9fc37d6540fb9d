//! Alpha, straight transmission, and what lies behind.

use super::*;
use crate::render::coverage;
use crate::scene::{AlphaMode, Background, Environment};

fn blended(color: Vec3, opacity: f32) -> Material {
    Material { opacity, alpha_mode: AlphaMode::Blend, ..unlit(color) }
}

#[test]
fn three_half_transparent_spheres_multiply() {
    let mut s = looking_down(9.0);
    let half = material(Vec3::ZERO, Phong { transmission: Vec3::splat(0.5), ..phong() });
    for spheres in 1..=3 {
        s.sphere(DVec3::Z * f64::from(spheres), 0.4, half.clone());
        let rendered = s.render();
        // Each is entered and left.
        let through = 0.25f32.powi(spheres);
        assert_eq!(rendered.picture.beauty[0], [0.0, 0.0, 0.0, 1.0 - through]);
        assert_eq!(rendered.counts.refracted.queries, 2 * spheres as u64);
    }
}

#[test]
fn straight_transmission_is_a_bounce_and_alpha_is_none() {
    let mut s = looking_down(9.0);
    s.settings.depth = Some(1);
    let half = material(Vec3::ZERO, Phong { transmission: Vec3::splat(0.5), ..phong() });
    s.square(1.0, 1.0, half.clone()).square(2.0, 1.0, half);
    assert_eq!(s.alpha(), 1.0, "the second pane cuts the branch");
    s.scene.materials.iter_mut().for_each(|m| *m = blended(Vec3::ZERO, 0.5));
    assert_eq!(s.alpha(), 0.75);
}

#[test]
fn blended_surfaces_composite_over_each_other() {
    let mut s = looking_down(9.0);
    s.square(2.0, 1.0, blended(Vec3::X, 0.5)).square(1.0, 1.0, blended(Vec3::Y, 0.5)).square(0.0, 1.0, unlit(Vec3::Z));
    assert_eq!(s.render().picture.beauty[0], [0.5, 0.25, 0.25, 1.0]);
}

#[test]
fn absent_texels_and_unseen_backs_are_passed_without_a_trace() {
    let mut s = looking_down(9.0);
    let absent = Material { opacity: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..unlit(Vec3::X) };
    s.square(2.0, 1.0, absent).square(0.0, 1.0, unlit(Vec3::Z));
    s.square(1.0, 1.0, Material { double_sided: false, ..unlit(Vec3::Y) });
    assert_eq!(s.color(), Vec3::Y, "the front of a one-sided face is seen");
    s.scene.meshes[2].triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert_eq!(s.color(), Vec3::Z, "its back is not");
    assert_eq!(s.alpha(), 1.0);
}

#[test]
fn a_face_with_the_corners_of_one_that_is_not_there_is_seen() {
    let absent = Material { opacity: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..unlit(Vec3::X) };
    let one_sided = Material { double_sided: false, ..unlit(Vec3::Y) };
    for (over, color) in [(absent, Vec3::Z), (blended(Vec3::X, 0.5), Vec3::new(0.5, 0.0, 0.5)), (one_sided, Vec3::Z)] {
        let mut s = looking_down(9.0);
        s.square(0.0, 1.0, over).square(0.0, 1.0, unlit(Vec3::Z));
        // Of the one-sided face the back is seen.
        if !s.scene.materials[0].double_sided {
            s.scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        assert_eq!((s.color(), s.alpha()), (color, 1.0));
    }
}

#[test]
fn shadows_are_those_of_all_that_lies_in_one_place() {
    let clear = blended(Vec3::ZERO, 0.0);
    let light = |over: &[Material]| {
        let mut s = looking_down(9.0);
        s.square(0.0, 1.0, material(Vec3::ONE, phong())).lamp(DVec3::new(0.1, 0.0, 8.0), 1.0);
        s.settings.depth = Some(0);
        s.view = View::look_at(DVec3::new(3.0, 0.0, 0.5), DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
        over.iter().for_each(|over| {
            s.square(1.0, 0.6, over.clone());
        });
        s.color().x
    };
    let half = || blended(Vec3::ZERO, 0.5);
    let open = light(&[]);
    assert!(open > 0.0);
    assert_eq!(light(&[half()]), 0.5 * open);
    assert_eq!(light(&[clear.clone(), half()]), 0.5 * open);
    assert_eq!(light(&[half(), clear]), 0.5 * open);
}

#[test]
fn a_picture_of_backs_and_of_nothing_opaque_shows_nothing_and_what_lies_behind_them_is_shown() {
    let absent = || Material { opacity: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..unlit(Vec3::X) };
    let one_sided = || Material { double_sided: false, ..unlit(Vec3::Y) };
    let seen = |stack: &[&Material], from: f64| {
        let mut s = looking_down(from);
        for (i, material) in stack.iter().enumerate() {
            s.square(i as f32, 9.0, (*material).clone());
        }
        s.with_job(AccelKind::DEFAULT, |job| coverage(job).shown)
    };
    for hidden in [absent(), blended(Vec3::X, 0.0)] {
        assert!(!seen(&[&hidden], 9.0) && !seen(&[&hidden; 2], 9.0));
        assert!(seen(&[&unlit(Vec3::Z), &hidden, &hidden], 9.0), "behind two that are not there");
    }
    assert!(seen(&[&one_sided()], 9.0) && !seen(&[&one_sided()], -9.0));
    assert!(seen(&[&blended(Vec3::X, 0.1)], 9.0) && seen(&[&unlit(Vec3::X)], -9.0));
}

#[test]
fn mirrored_instances_keep_their_front() {
    for scale in [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(-1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0)] {
        let one_sided = || Material { double_sided: false, ..unlit(Vec3::ONE) };
        let mut front = looking_down(5.0);
        front.mesh(square(0.0, 1.0), DAffine3::from_scale(scale), one_sided());
        let mut back = looking_down(-5.0);
        back.mesh(square(0.0, 1.0), DAffine3::from_scale(scale), one_sided());
        let expected = if scale.z > 0.0 { (1.0, 0.0) } else { (0.0, 1.0) };
        assert_eq!((front.alpha(), back.alpha()), expected, "{scale}");
    }
}

#[test]
fn coverage_of_an_edge_is_counted_in_samples() {
    // The square's edge runs through the middle of the second pixel's left samples.
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, Lens::orthographic(1.0));
    s.settings = Settings { width: 4, height: 1, samples: 4, ..s.settings };
    s.square(0.0, 0.5, unlit(Vec3::ONE));
    s.scene.meshes[0].positions = vec![
        Vec3::new(-9.0, -9.0, 0.0),
        Vec3::new(0.5, -9.0, 0.0),
        Vec3::new(0.5, 9.0, 0.0),
        Vec3::new(-9.0, 9.0, 0.0),
    ];
    let alphas = |s: &Stage| s.render().picture.beauty.iter().map(|p| p[3]).collect::<Vec<_>>();
    assert_eq!(alphas(&s), [1.0, 1.0, 0.5, 0.0]);
    // Cut off the lower right corner of that pixel's left half as well: one sample of four is left.
    s.scene.meshes[0].positions[1].x = 0.25;
    s.scene.meshes[0].positions[1].y = 0.0;
    s.scene.meshes[0].positions[2].x = 0.5;
    s.scene.meshes[0].positions[2].y = 0.5;
    assert_eq!(alphas(&s)[2], 0.25);
}

#[test]
fn the_background_is_left_out_unless_it_is_the_environment() {
    let mut s = looking_down(5.0);
    s.scene.environment = Environment::Constant(Vec3::new(0.1, 0.2, 0.3));
    assert_eq!(s.render().picture.beauty[0], [0.0; 4]);
    s.scene.background = Some(Background::Color(Vec3::ONE));
    assert_eq!(s.render().picture.beauty[0], [0.0; 4]);
    s.scene.background = Some(Background::Environment);
    assert_eq!(s.render().picture.beauty[0], [0.1, 0.2, 0.3, 1.0]);
}

#[test]
fn colored_glass_tints_a_known_background() {
    let mut s = looking_down(5.0);
    let red = Phong { transmission: Vec3::new(1.0, 0.5, 0.25), ..phong() };
    s.square(0.0, 1.0, material(Vec3::ZERO, red)).scene.background = Some(Background::Color(Vec3::splat(0.5)));
    let picture = s.render().picture;
    let (pixel, veil) = (picture.beauty[0], picture.veil[0]);
    assert_eq!([0, 1, 2].map(|c| pixel[c] + (1.0 - pixel[3]) * 0.5 + veil[c]), [0.5, 0.25, 0.125]);
}

#[test]
fn colored_glass_leaves_the_rest_of_a_background_to_a_veil_however_pixels_are_sampled() {
    use crate::render::sampling::{Adaptive, Sampling, Stochastic};
    let mut s = looking_down(9.0);
    let red = Vec3::new(1.0, 0.25, 0.5);
    s.square(0.0, 9.0, material(Vec3::ZERO, Phong { transmission: red, ior: 1.0, ..phong() }));
    (s.settings.width, s.settings.height) = (40, 5);
    let both = [Sampling::Stochastic(Stochastic::default()), Sampling::Adaptive(Adaptive::default())];
    for sampling in both.into_iter().chain([Sampling::Uniform]) {
        s.settings.sampling = sampling;
        s.scene.background = Some(Background::Color(Vec3::new(0.5, 1.0, 0.5)));
        let picture = s.render().picture;
        assert!(picture.beauty.iter().all(|&pixel| pixel == [0.0, 0.0, 0.0, 0.75]), "{:?}", s.settings.sampling);
        assert_eq!(picture.veil.len(), 200);
        assert!(picture.veil.iter().all(|&veil| veil == [0.375, 0.0, 0.125, 1.0]), "{:?}", s.settings.sampling);
        s.scene.background = None;
        assert!(s.render().picture.veil.is_empty());
    }
}
