//! Alpha, straight transmission, and the surfaces behind.

use super::*;
use crate::accel::AccelChoice;
use crate::math::Vec2;
use crate::math::random::Random;
use crate::render::{Instancing, Sampling, Stochastic, coverage};
use crate::scene::{
    AlphaMode, Background, Bitmap, Environment, Filter, Instance, Pixels, Sampler, Texture, TextureRef, UvTransform,
};

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

/// A sheet covered to three eighths, in stripes, by the alpha or by an opacity map.
fn striped(alpha_mode: AlphaMode, by_map: bool, repeats: f32) -> Stage {
    let mut s = looking_down(9.0);
    let texels = (0..256 * 256).map(|i| if i % 8 < 3 { [255; 4] } else { [0, 0, 0, if by_map { 255 } else { 0 }] });
    let pixels = Pixels::Rgba8(texels.collect());
    s.scene.bitmaps.push(Bitmap { name: String::new(), width: 256, height: 256, pixels });
    s.scene.textures.push(Texture { bitmap: 0, sampler: Sampler::default() });
    let map = Some(TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() });
    let (base_color_map, opacity_map) = if by_map { (None, map) } else { (map, None) };
    let uvs = vec![square(0.0, repeats).positions.iter().map(|p| p.truncate()).collect()];
    let sheet = Material { alpha_mode, base_color_map, opacity_map, ..unlit(Vec3::ONE) };
    s.mesh(Mesh { uvs, ..square(0.0, 1.0) }, DAffine3::IDENTITY, sheet);
    s.settings = Settings { width: 8, height: 8, samples: 256, ..s.settings };
    s
}

#[test]
fn of_what_is_cut_out_as_much_is_there_from_afar_as_from_near() {
    let mask = |cutoff: f32| AlphaMode::Mask { cutoff };
    for (alpha_mode, by_map) in [(mask(0.5), false), (mask(0.9), true), (mask(0.1), false), (AlphaMode::Blend, false)] {
        // Pixels cover two stripes and more, up to hundreds, out of phase with them.
        for repeats in [0.27, 2.3, 37.7] {
            let beauty = striped(alpha_mode, by_map, repeats).render().picture.beauty;
            let alphas = beauty.iter().map(|pixel| pixel[3]);
            let least = alphas.clone().fold(1.0, f32::min);
            let mean = alphas.sum::<f32>() / 64.0;
            // Between stripes alpha is interpolated: the cutoff moves each edge by up to half a texel.
            let more = match alpha_mode {
                AlphaMode::Mask { cutoff } => (1.0 - 2.0 * cutoff) / 8.0,
                _ => 0.0,
            };
            let what = format!("{alpha_mode:?} {by_map} {repeats}: {mean}, {least} at least");
            assert!((mean - 0.375 - more).abs() < 0.02 && least > 0.15, "{what}");
        }
    }
}

#[test]
fn a_face_with_the_corners_of_one_that_is_not_there_is_seen() {
    let absent = Material { opacity: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..unlit(Vec3::X) };
    let one_sided = Material { double_sided: false, ..unlit(Vec3::Y) };
    for (over, color) in [(absent, Vec3::Z), (blended(Vec3::X, 0.5), Vec3::new(0.5, 0.0, 0.5)), (one_sided, Vec3::Z)] {
        let mut s = looking_down(9.0);
        s.square(0.0, 1.0, over).square(0.0, 1.0, unlit(Vec3::Z));
        // The back of the one-sided face is seen.
        if !s.scene.materials[0].double_sided {
            s.scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        assert_eq!((s.color(), s.alpha()), (color, 1.0));
    }
}

/// A square with a hole all over it, and in the same place, of the same mesh, one without: its texel decides, not its position.
#[test]
fn behind_a_hole_a_face_of_the_same_surface_in_the_same_place_is_seen() {
    let mut s = looking_down(9.0);
    s.scene.bitmaps.push(Bitmap {
        name: String::new(),
        width: 2,
        height: 1,
        pixels: Pixels::Rgba8(vec![[255, 0, 0, 0], [0, 255, 0, 255]].into()),
    });
    s.scene.textures.push(Texture {
        bitmap: 0,
        sampler: Sampler { magnify: Filter::Nearest, minify: Filter::Nearest, ..Sampler::default() },
    });
    let map = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() };
    let mut mesh = square(0.0, 1.0);
    let corners = mesh.positions.len() as u32;
    mesh.positions.extend_from_within(..);
    mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|corner| corner + corners)));
    // The first face reads the absent texel, the second the other.
    mesh.uvs = vec![(0..2 * corners).map(|i| Vec2::new(if i < corners { 0.25 } else { 0.75 }, 0.5)).collect()];
    let leaf = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_map: Some(map),
        double_sided: true,
        ..unlit(Vec3::ONE)
    };
    s.mesh(mesh, DAffine3::IDENTITY, leaf).square(-1.0, 1.0, unlit(Vec3::Z));
    assert_eq!((s.color(), s.alpha()), (Vec3::Y, 1.0));
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
    // The square's edge runs through the middle of the third pixel, between its left and right samples.
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

#[test]
fn a_blended_surface_without_holes_has_the_bits_of_an_opaque_one() {
    let mut s = super::bits::busy();
    s.scene.materials.iter_mut().for_each(|m| (m.opacity, m.alpha_mode) = (1.0, AlphaMode::Opaque));
    let opaque = s.render();
    for alpha_mode in [AlphaMode::Blend, AlphaMode::Mask { cutoff: 0.5 }] {
        s.scene.materials.iter_mut().for_each(|m| m.alpha_mode = alpha_mode);
        let rendered = s.render();
        assert!(rendered.picture == opaque.picture, "{alpha_mode:?}");
        let seen = |r: &Rendered| [r.counts.primary, r.counts.reflected, r.counts.refracted];
        assert_eq!(seen(&rendered), seen(&opaque), "{alpha_mode:?}");
    }
}

/// Leaves before a wall and before a square that hides the wall from a lamp, some with holes; then more faces behind them.
fn leaves(holes: bool, behind: usize) -> Stage {
    let view = View::look_at(DVec3::new(3.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.9));
    let mut s = stage(view);
    s.settings = Settings { width: 60, height: 45, samples: 2, ..s.settings };
    s.square(-1.5, 4.0, material(Vec3::splat(0.8), phong())).lamp(DVec3::new(0.0, 1.0, 9.0), 1.0);
    s.square(-1.0, 0.4, material(Vec3::X, phong()));
    for i in 0..14 {
        let (x, y) = (f64::from(i % 4) - 1.5, f64::from(i / 4) - 1.5);
        let place = DAffine3::from_translation(DVec3::new(x, y, 0.2 * f64::from(i % 3)));
        let leaf = match i % 3 {
            0 => blended(Vec3::Y, 0.4 + 0.05 * i as f32),
            1 if holes => Material { opacity: 0.05, alpha_mode: AlphaMode::Mask { cutoff: 0.1 }, ..unlit(Vec3::Z) },
            1 => blended(Vec3::Z, 0.05),
            _ => material(Vec3::ZERO, Phong { transmission: Vec3::new(0.5, 0.7, 0.2), ..phong() }),
        };
        s.mesh(square(0.0, 0.6), place, leaf);
    }
    let place = DAffine3::from_translation(DVec3::Z * -1e3);
    for _ in 0..behind {
        s.mesh(square(0.0, 0.01), place, material(Vec3::X, phong()));
    }
    s
}

#[test]
fn shadows_of_opaque_things_among_leaves_do_not_depend_on_how_many_of_either_there_are() {
    for holes in [false, true] {
        let (few, many) = (leaves(holes, 0), leaves(holes, 40));
        let (few, many) = (few.render(), many.render());
        let differ = few.picture.beauty.iter().zip(&many.picture.beauty).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "pixels");
        assert_eq!(few.counts.shadow.queries, many.counts.shadow.queries);
    }
}

/// Sheets before a wall, between it and lamps, with a hole wherever a texel is clear; some coincide, each with holes of its own.
fn sheets(alpha_mode: AlphaMode, magnify: Filter) -> Stage {
    let mut random = Random::new(31);
    let view = View::look_at(DVec3::new(3.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.9));
    let mut s = stage(view);
    s.settings = Settings { width: 60, height: 45, samples: 2, ..s.settings };
    s.square(-1.5, 4.0, material(Vec3::splat(0.8), phong()));
    for x in 0..3 {
        s.lamp(DVec3::new(f64::from(x), 1.0, 9.0), 1.0);
    }
    let texel = |_| [90, 120, 60, if random.unit() < 0.7 { 0 } else { 255 }];
    let pixels = Pixels::Rgba8((0..8 * 8).map(texel).collect());
    s.scene.bitmaps.push(Bitmap { name: String::new(), width: 8, height: 8, pixels });
    s.scene.textures.push(Texture { bitmap: 0, sampler: Sampler { magnify, ..Sampler::default() } });
    let map = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() };
    let leaf = Material { alpha_mode, base_color_map: Some(map), ..material(Vec3::ONE, phong()) };
    for i in 0..24 {
        let (x, y) = (f64::from(i % 4) - 1.5, f64::from(i / 4 % 3) - 1.0);
        let place = DAffine3::from_translation(DVec3::new(0.5 * x, 0.5 * y, 0.2 * f64::from(i % 3)));
        let mut mesh = square(0.0, 0.8);
        let shift = Vec2::splat(0.37 * i as f32);
        mesh.uvs = vec![mesh.positions.iter().map(|p| p.truncate() + shift).collect()];
        if i % 5 == 0 {
            // The same corners again.
            mesh.positions.extend_from_within(..);
            mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|i| i + 4)));
            let more: Vec<Vec2> = mesh.uvs[0].iter().map(|uv| *uv + Vec2::new(0.3, 0.1)).collect();
            mesh.uvs[0].extend(more);
        }
        s.mesh(mesh, place, leaf.clone());
    }
    // Some have a second instance.
    for i in (1..24).step_by(4) {
        let (once, by) = (s.scene.instances[i].clone(), DAffine3::from_translation(DVec3::new(0.1, 0.0, 0.07)));
        let world_from_object = once.world_from_object * DAffine3::from_rotation_z(0.4) * by;
        s.scene.instances.push(Instance { world_from_object, ..once });
    }
    s
}

#[test]
fn light_through_holes_is_what_is_left_when_every_surface_is_asked() {
    for alpha_mode in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Blend] {
        for magnify in [Filter::Nearest, Filter::Linear] {
            let s = sheets(alpha_mode, magnify);
            let asked = without_pruning(&s);
            for instances in [Instancing::Flatten, Instancing::Keep] {
                let world = World::placing(&s.scene, instances);
                assert!(world.instanced.is_empty() == (instances == Instancing::Flatten));
                let rendered = render_in(&s, &world);
                assert!(rendered.picture == asked.picture, "{alpha_mode:?}, {magnify:?}, {instances:?}");
                // One query answers a ray.
                let [one, many] = [&rendered, &asked].map(|r| r.counts.shadow.queries);
                assert!(many > 2 * one, "{one} and {many}");
            }
        }
    }
}

#[test]
fn light_through_more_than_is_noted_at_once_is_what_is_left_all_the_same() {
    let mut s = looking_down(9.0);
    s.square(0.0, 1.0, material(Vec3::ONE, phong())).lamp(DVec3::new(0.1, 0.0, 8.0), 1.0);
    s.settings = Settings { depth: Some(0), samples: 400, ..s.settings };
    s.view = View::look_at(DVec3::new(3.0, 0.0, 0.5), DVec3::ZERO, DVec3::Y, Lens::orthographic(0.01));
    let mut layers = square(1.0, 0.6);
    for i in 1..1000_u32 {
        let layer = square(1.0 + 1e-3 * i as f32, 0.6);
        layers.positions.extend(layer.positions);
        layers.triangles.extend(layer.triangles.iter().map(|t| t.map(|corner| corner + 4 * i)));
    }
    s.mesh(layers, DAffine3::IDENTITY, blended(Vec3::ZERO, 1e-3));
    let (rendered, asked) = (s.render(), without_pruning(&s));
    assert!(rendered.picture == asked.picture);
    assert!(rendered.picture.beauty[0][0] > 0.1, "{:?}", rendered.picture.beauty);
    let [one, many] = [&rendered, &asked].map(|r| r.counts.shadow.queries);
    assert!(one > 100_000 && one < many, "{one} and {many}: some walk, not all");
}

/// Renders with every surface tested for transparency.
fn without_pruning(s: &Stage) -> Rendered {
    let world = World::new(&s.scene).without_pruning();
    let accel = AnyAccel::build(AccelKind::DEFAULT, &world.shapes, &AccelParams::DEFAULT);
    let textures = TextureStore::new(&s.scene).without_pruning();
    let settings = &Settings { no_prune: true, ..s.settings.clone() };
    let (scene, view) = (&s.scene, &s.view);
    render_counted(&Job { scene, world: &world, accel: &accel, textures: &textures, view, settings }, &())
}

fn render_in(s: &Stage, world: &World) -> Rendered {
    let accel = world.structure(AccelChoice::Auto, &AccelParams::DEFAULT).0;
    let textures = TextureStore::new(&s.scene);
    let (scene, view, settings) = (&s.scene, &s.view, &s.settings);
    render_counted(&Job { scene, world, accel: &accel, textures: &textures, view, settings }, &())
}

#[test]
fn opaque_scenes_send_the_same_rays_by_chance_when_everything_is_done() {
    let mut s = super::bits::busy();
    s.scene.materials.iter_mut().for_each(|m| (m.opacity, m.alpha_mode) = (1.0, AlphaMode::Opaque));
    s.scene.spheres.clear();
    s.scene.lights.iter_mut().for_each(|light| light.size = 0.3);
    let how = Stochastic { min_samples: 4, max_samples: 32, error: 0.03, ..Stochastic::default() };
    s.settings.sampling = Sampling::Stochastic(how);
    let world = World::new(&s.scene);
    assert!(world.is_opaque());
    assert!(without_pruning(&s).picture == s.render().picture);
}

#[test]
fn the_opacity_that_shadow_rays_read_is_that_of_a_point_that_is_seen() {
    use crate::math::Vec4;
    use crate::render::shade::{Reader, shadow_filter};
    use crate::render::surface::HitPrim;
    use crate::scene::Wrap;
    let mut random = Random::new(17);
    let mut seen = 0;
    for round in 0..40 {
        let mut s = looking_down(9.0);
        let mut code = || (random.unit() * 255.99) as u8;
        let pixels = match round % 3 {
            0 => Pixels::Rgb8((0..5 * 7 * 3).map(|_| code()).collect()),
            1 => Pixels::Rgba8((0..5 * 7).map(|_| [(); 4].map(|()| code())).collect()),
            _ => Pixels::Rgba16((0..5 * 7).map(|_| [(); 4].map(|()| u16::from(code()) * 251)).collect()),
        };
        let magnify = if round % 4 == 0 { Filter::Nearest } else { Filter::Linear };
        let sampler = Sampler { wrap_u: Wrap::Mirror, magnify, ..Sampler::default() };
        s.scene.bitmaps.push(Bitmap { name: String::new(), width: 5, height: 7, pixels });
        s.scene.textures.push(Texture { bitmap: 0, sampler });
        let transform =
            UvTransform { rotation: 0.3 * (round % 2) as f32, scale: Vec2::new(1.5, 2.0), ..UvTransform::default() };
        let map = |wanted: bool| wanted.then_some(TextureRef { texture: 0, uv_set: round % 5 / 4, transform });
        let mode = if round % 2 == 0 { AlphaMode::Blend } else { AlphaMode::Mask { cutoff: 0.4 } };
        let material = Material {
            opacity: 0.9,
            alpha_mode: mode,
            base_color_map: map(round % 7 != 0),
            opacity_map: map(round % 3 != 1),
            ..Material::plain()
        };
        let mut mesh = square(0.0, 1.0);
        mesh.uvs = vec![mesh.positions.iter().map(|p| p.truncate()).collect()];
        if round % 3 == 2 {
            mesh.colors = mesh.positions.iter().map(|p| Vec4::new(0.2, 0.3, 0.4, 0.75 + 0.25 * p.x)).collect();
        }
        s.mesh(mesh, DAffine3::IDENTITY, material);
        let (world, store) = (World::new(&s.scene), TextureStore::new(&s.scene));
        for _ in 0..50 {
            let (u, v) = (random.unit() * 0.5, random.unit() * 0.5);
            let hit = crate::accel::Hit { t: 1.0, u, v, prim: random.below(2) as u32 };
            let target = HitPrim::new(&s.scene, &world, hit.prim);
            let patch = target.patch(&world, u, v, Vec3::ZERO);
            let reader = Reader { store: &store, patch: patch.as_ref(), known: &[] };
            let opacity = target.opacity(&hit, &store).expect("a triangle");
            let filter = Vec3::splat(1.0 - target.material.alpha_mode.covers(opacity));
            assert_eq!(filter, shadow_filter(target.material, &reader), "round {round}");
            seen += usize::from(filter.x > 0.0 && filter.x < 1.0);
        }
    }
    assert!(seen > 500, "{seen}");
}
