//! The golden pictures: each test sets a stage for one feature.

use super::{check, check_all, plain};
use crate::common::stage::{Stage, metal_rough, phong, unlit};
use meshray::image::{Output, Picture, ToneMap};
use meshray::load::{LoadOptions, load_bytes};
use meshray::math::{DAffine3, DQuat, DVec3, Vec2, Vec3, Vec4};
use meshray::render::view::Lens;
use meshray::render::{Adaptive, Sampling, Stochastic, ThinLens, View};
use meshray::scene::mesh::Polygon;
use meshray::scene::{
    AlphaMode, Background, Falloff, Filter, LightKind, Material, Mesh, MetalRough, Mipmaps, Phong, Sampler, TextureRef,
    Wrap,
};
use std::path::Path;

const WHITE: [f32; 3] = [1.0; 3];
const RED: [f32; 3] = [0.8, 0.1, 0.05];
const BLUE: [f32; 3] = [0.05, 0.15, 0.8];
const GREY: [f32; 3] = [0.5; 3];

/// A stage seen from the front and slightly above; a sphere of radius 1 fills most of the height.
fn front() -> Stage {
    Stage::new([0.0, 0.6, 3.6], [0.0, 0.0, 0.0])
}

/// A stage seen straight from the front by parallel rays: flat objects stay undistorted, x and y reach ±1.33 and ±1.
fn flat() -> Stage {
    let mut stage = Stage::new([0.0, 0.0, 5.0], [0.0; 3]);
    stage.view = View::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, Lens::orthographic(2.0));
    stage
}

/// Adds a floor of black and white squares, one unit each, large enough for every view here.
pub(super) fn checkered_floor(stage: &mut Stage, height: f32) {
    let squares = stage.texture(2, Sampler { magnify: Filter::Nearest, ..Sampler::default() }, |x, y| {
        if (x + y) % 2 == 0 { [235, 235, 235, 255] } else { [40, 40, 40, 255] }
    });
    let material = stage.material(Material { base_color_map: Some(squares), ..phong(WHITE, Phong::default()) });
    let at = |x: f32, z: f32| [x, height, z];
    stage.quad([at(-40.0, 40.0), at(40.0, 40.0), at(40.0, -40.0), at(-40.0, -40.0)], 40.0, material);
}

fn textured(map: TextureRef) -> Material {
    Material { base_color_map: Some(map), ..unlit(WHITE) }
}

#[test]
fn golden_edges_are_smooth_and_transparent_outside() {
    let mut stage = flat();
    let material = stage.material(unlit(RED));
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let positions = vec![corner(-1.1, -0.8), corner(1.2, -0.3), corner(0.1, 0.9)];
    stage.mesh(Mesh { material, positions, triangles: vec![[0, 1, 2]], ..Mesh::default() });
    check("edges", &stage.render());
}

#[test]
fn golden_phong_shows_ambient_diffuse_and_gloss() {
    let mut stage = front();
    stage.scene.ambient = Vec3::splat(0.2);
    let gloss = Phong { ambient: Vec3::from(RED), specular: Vec3::splat(0.6), shininess: 30.0, ..Phong::default() };
    let material = stage.material(phong(RED, gloss));
    stage.sphere([0.0; 3], 1.0, material);
    stage.sun([-1.0, -1.0, -1.0], 0.9);
    check("phong", &stage.render());
}

#[test]
fn golden_shadows_are_sharp_and_add_up() {
    let mut stage = front();
    let (floor, ball) = (stage.matt(GREY), stage.matt(RED));
    stage.floor(-1.0, floor);
    stage.sphere([0.0, -0.3, 0.0], 0.7, ball);
    stage.lamp([3.0, 3.0, 2.0], [0.6, 0.5, 0.4]);
    stage.lamp([-3.0, 4.0, 1.0], [0.3, 0.4, 0.6]);
    check("shadows", &stage.render());
}

#[test]
fn golden_mirrors_see_each_other_down_to_the_depth() {
    let mut stage = front();
    stage.settings.depth = Some(3);
    checkered_floor(&mut stage, -1.0);
    let mirror = Phong { mirror: Vec3::splat(0.8), ..Phong::default() };
    let material = stage.material(phong([0.05; 3], mirror));
    stage.sphere([-0.85, -0.2, 0.0], 0.8, material);
    stage.sphere([0.85, -0.2, 0.0], 0.8, material);
    stage.sun([-0.3, -1.0, -0.4], 0.9);
    stage.scene.background = Some(Background::Color(Vec3::new(0.3, 0.5, 0.8)));
    check("mirrors", &stage.render());
}

#[test]
fn golden_a_glass_ball_turns_the_world_upside_down() {
    let mut stage = front();
    checkered_floor(&mut stage, -1.0);
    let glass = Phong { transmission: Vec3::splat(0.9), ior: 1.52, fresnel: true, ..Phong::default() };
    let material = stage.material(phong([0.0; 3], glass));
    stage.sphere([0.0, 0.1, 0.0], 0.9, material);
    stage.sun([-0.3, -1.0, -0.4], 0.9);
    stage.scene.background = Some(Background::Color(Vec3::new(0.3, 0.5, 0.8)));
    check("glass-ball", &stage.render());
}

#[test]
fn golden_light_is_totally_reflected_inside_a_block() {
    let mut stage = Stage::new([0.0, 0.9, 3.2], [0.0, -0.2, 0.0]);
    checkered_floor(&mut stage, -1.0);
    let glass = Phong { transmission: Vec3::ONE, ior: 1.5, fresnel: true, ..Phong::default() };
    let material = stage.material(phong([0.0; 3], glass));
    stage.mesh(block(Vec3::new(-0.8, -0.7, -0.8), Vec3::new(0.8, 0.5, 0.4), material));
    stage.sun([-0.3, -1.0, -0.4], 0.9);
    stage.scene.background = Some(Background::Color(Vec3::new(0.3, 0.5, 0.8)));
    check("total-reflection", &stage.render());
}

/// A closed box, seen from outside.
fn block(lo: Vec3, hi: Vec3, material: u32) -> Mesh {
    let corner = |i: u32| {
        let pick = |bit: u32, axis: usize| if i & bit == 0 { lo[axis] } else { hi[axis] };
        Vec3::new(pick(1, 0), pick(2, 1), pick(4, 2))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { material, positions: (0..8).map(corner).collect(), triangles, ..Mesh::default() }
}

#[test]
fn golden_three_half_transparent_balls_show_through_each_other() {
    let mut stage = Stage::new([0.0, 0.4, 4.2], [0.0; 3]);
    for (color, x, y) in [([1.0, 0.1, 0.1], -0.5, -0.3), ([0.1, 1.0, 0.1], 0.5, -0.3), ([0.1, 0.1, 1.0], 0.0, 0.5)] {
        let half = Material { opacity: 0.5, alpha_mode: AlphaMode::Blend, ..phong(color, Phong::default()) };
        let material = stage.material(half);
        stage.sphere([x, y, 0.0], 0.8, material);
    }
    stage.sun([-0.2, -0.5, -1.0], 1.0);
    check("half-transparent", &stage.render());
}

#[test]
fn golden_shadows_of_clear_things_are_coloured() {
    let mut stage = Stage::new([0.0, 2.2, 3.0], [0.0, -0.7, 0.0]);
    let floor = stage.matt([0.8; 3]);
    stage.floor(-1.0, floor);
    let glass = Phong { transmission: Vec3::new(0.9, 0.3, 0.1), ior: 1.0, ..Phong::default() };
    let amber = stage.material(phong([0.0; 3], glass));
    let half = Material { opacity: 0.4, alpha_mode: AlphaMode::Blend, ..phong(BLUE, Phong::default()) };
    let veil = stage.material(half);
    let at = |x: f32, z: f32| [x, 0.0, z];
    stage.quad([at(-1.2, 0.5), at(-0.2, 0.5), at(-0.2, -0.5), at(-1.2, -0.5)], 1.0, amber);
    stage.quad([at(0.2, 0.5), at(1.2, 0.5), at(1.2, -0.5), at(0.2, -0.5)], 1.0, veil);
    stage.sun([0.1, -1.0, 0.3], 0.9);
    check("coloured-shadows", &stage.render());
}

#[test]
fn golden_metals_and_plastics_from_smooth_to_rough() {
    let mut stage = Stage::new([0.0, 0.0, 7.0], [0.0; 3]);
    stage.studio();
    for (row, metallic) in [(0.8, 1.0), (-0.8, 0.0)] {
        for step in 0..4_u8 {
            let roughness = f32::from(step) / 3.0;
            let material = stage
                .material(metal_rough([0.9, 0.6, 0.2], MetalRough { metallic, roughness, ..MetalRough::default() }));
            stage.sphere([f64::from(step) * 1.5 - 2.25, row, 0.0], 0.7, material);
        }
    }
    stage.sun([-0.5, -1.0, -1.0], 2.0);
    check_all(&[("metals-and-plastics", &stage.render(), &Output::default())]);
}

#[test]
fn golden_thin_glass_passes_light_straight_and_reflects_at_grazing_angles() {
    let mut stage = front();
    stage.studio();
    checkered_floor(&mut stage, -1.0);
    let glass = MetalRough { metallic: 0.0, roughness: 0.0, transmission: 1.0, ..MetalRough::default() };
    let material = stage.material(metal_rough([0.8, 0.95, 0.85], glass));
    stage.sphere([0.0, 0.1, 0.0], 0.9, material);
    stage.sun([-0.3, -1.0, -0.4], 2.0);
    check_all(&[("thin-glass", &stage.render(), &Output::default())]);
}

#[test]
fn golden_a_floor_to_the_horizon_does_not_shimmer() {
    let mut stage = Stage::new([0.3, 0.7, 4.0], [0.0, 0.0, -3.0]);
    stage.settings.samples = 1;
    checkered_floor(&mut stage, 0.0);
    stage.sun([0.0, -1.0, 0.0], 1.0);
    check("horizon", &stage.render());
}

#[test]
fn golden_textures_repeat_mirror_and_clamp_sharp_and_smooth() {
    let mut stage = flat();
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    for (row, magnify) in [(0.45_f32, Filter::Linear), (-0.45, Filter::Nearest)] {
        for (column, wrap) in wraps.into_iter().enumerate() {
            let sampler = Sampler { wrap_u: wrap, wrap_v: wrap, magnify, mipmaps: Mipmaps::None, ..Sampler::default() };
            let mut map = stage.texture(2, sampler, |x, y| {
                [[[220, 30, 30, 255], [30, 200, 30, 255]], [[30, 60, 220, 255], [240, 230, 60, 255]]][y as usize]
                    [x as usize]
            });
            map.transform.offset = Vec2::splat(-0.75);
            map.transform.scale = Vec2::splat(2.5);
            let material = stage.material(textured(map));
            stage.card(column as f32 * 0.86 - 0.86, row, 0.0, 0.4, material);
        }
    }
    check("wrapping", &stage.render());
}

#[test]
fn golden_a_texture_is_moved_turned_and_scaled() {
    let mut stage = flat();
    let letter = |x: u32, y: u32| {
        // An L of 8×8 texels, so that every rotation and mirroring shows.
        let ink = (1..3).contains(&x) && (1..7).contains(&y) || (1..6).contains(&x) && (5..7).contains(&y);
        if ink { [200, 30, 30, 255] } else { [230, 230, 200, 255] }
    };
    let sampler = Sampler { magnify: Filter::Nearest, ..Sampler::default() };
    for (x, turned) in [(-0.65, false), (0.65, true)] {
        let mut map = stage.texture(8, sampler, letter);
        if turned {
            map.transform.rotation = 0.5;
            map.transform.scale = Vec2::new(2.0, 1.5);
            map.transform.offset = Vec2::new(0.2, 0.1);
        }
        let material = stage.material(textured(map));
        stage.card(x, 0.0, 0.0, 0.6, material);
    }
    check("texture-transform", &stage.render());
}

#[test]
fn golden_cut_out_shapes_throw_cut_out_shadows() {
    let mut stage = Stage::new([0.0, 1.2, 3.4], [0.0, -0.2, 0.0]);
    let floor = stage.matt([0.7; 3]);
    stage.floor(-1.0, floor);
    let ring = stage.texture(64, Sampler::default(), |x, y| {
        let (dx, dy) = (f64::from(x) - 31.5, f64::from(y) - 31.5);
        let r = (dx * dx + dy * dy).sqrt();
        [230, 120, 30, if (14.0..30.0).contains(&r) { 255 } else { 0 }]
    });
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    let material =
        stage.material(Material { base_color_map: Some(ring), alpha_mode: mask, ..phong(WHITE, Phong::default()) });
    stage.card(0.0, 0.0, 0.0, 0.9, material);
    stage.sun([-0.3, -1.0, -0.9], 1.0);
    check("cut-out", &stage.render());
}

#[test]
fn golden_normal_maps_and_bump_maps_shape_the_light() {
    let mut stage = flat();
    // The same hemisphere on plain ground, once as normals and once as heights.
    let dome = |x: u32, y: u32| {
        let (dx, dy) = ((f64::from(x) - 31.5) / 24.0, (f64::from(y) - 31.5) / 24.0);
        let height = (1.0 - dx * dx - dy * dy).max(0.0).sqrt();
        if height > 0.0 { (dx, -dy, height) } else { (0.0, 0.0, 0.0) }
    };
    let code = |c: f64| (c * 127.5 + 127.5).round() as u8;
    let normals = stage.texture(64, Sampler::default(), |x, y| match dome(x, y) {
        (_, _, 0.0) => [128, 128, 255, 255],
        (nx, ny, nz) => [code(nx), code(ny), code(nz), 255],
    });
    let heights = stage.texture(64, Sampler::default(), |x, y| {
        let h = (dome(x, y).2 * 255.0).round() as u8;
        [h, h, h, 255]
    });
    let base = phong(WHITE, Phong { specular: Vec3::splat(0.3), shininess: 20.0, ..Phong::default() });
    let by_normals = stage.material(Material { normal_map: Some(normals), ..base.clone() });
    let by_heights = stage.material(Material { bump_map: Some(heights), bump_scale: 0.375, ..base });
    stage.card(-0.65, 0.0, 0.0, 0.6, by_normals);
    stage.card(0.65, 0.0, 0.0, 0.6, by_heights);
    let tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
    for mesh in &mut stage.scene.meshes {
        mesh.normals = vec![Vec3::Z; 4];
        mesh.tangents.clone_from(&tangents);
    }
    stage.sun([-1.0, -1.0, -1.0], 0.8);
    check("normal-and-bump", &stage.render());
}

#[test]
fn golden_occlusion_darkens_ambient_light_only() {
    let mut stage = flat();
    stage.studio();
    let rings = stage.texture(32, Sampler::default(), |x, y| if (x / 4 + y / 4) % 2 == 0 { [255; 4] } else { [60; 4] });
    let model = MetalRough { metallic: 0.0, roughness: 1.0, ..MetalRough::default() };
    let material = stage.material(Material { occlusion_map: Some(rings), ..metal_rough([0.8; 3], model) });
    stage.card(0.0, 0.0, 0.0, 0.9, material);
    let kind = LightKind::Spot {
        position: DVec3::new(0.0, 0.0, 2.0),
        direction: -DVec3::Z,
        inner: 0.1,
        outer: 0.3,
        falloff: Falloff::None,
    };
    stage.light([2.0; 3], kind);
    check("occlusion", &stage.render());
}

#[test]
fn golden_vertex_colours_blend_across_a_face() {
    let mut stage = flat();
    let material = stage.material(unlit(WHITE));
    stage.card(0.0, 0.0, 0.0, 0.9, material);
    let color = |r: f32, g: f32, b: f32| Vec4::new(r, g, b, 1.0);
    stage.scene.meshes[0].colors =
        vec![color(1.0, 0.0, 0.0), color(0.0, 1.0, 0.0), color(0.0, 0.0, 1.0), color(1.0, 1.0, 1.0)];
    check("vertex-colours", &stage.render());
}

/// A ball of `2 × rings²` triangles; with normals only if smooth.
fn ball(rings: u32, smooth: bool, at: Vec3, material: u32) -> Mesh {
    let point = |ring: u32, step: u32| {
        let (polar, around) = (
            ring as f32 / rings as f32 * std::f32::consts::PI,
            step as f32 / (2 * rings) as f32 * std::f32::consts::TAU,
        );
        on_sphere(polar, around)
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for ring in 0..=rings {
        positions.extend((0..=2 * rings).map(|step| point(ring, step)));
    }
    let row = 2 * rings + 1;
    for ring in 0..rings {
        for step in 0..2 * rings {
            let a = ring * row + step;
            triangles.extend([[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]);
        }
    }
    let normals = if smooth { positions.clone() } else { Vec::new() };
    let positions: Vec<Vec3> = positions.into_iter().map(|p| p * 0.6 + at).collect();
    triangles.retain(|&[a, b, c]| {
        let p = |i: u32| positions[i as usize];
        p(a) != p(b) && p(b) != p(c) && p(c) != p(a)
    });
    Mesh { material, positions, normals, triangles, ..Mesh::default() }
}

/// Point of the unit sphere at two angles.
fn on_sphere(polar: f32, around: f32) -> Vec3 {
    Vec3::new(polar.sin() * around.sin(), polar.cos(), polar.sin() * around.cos())
}

#[test]
fn golden_faces_are_flat_without_normals_and_smooth_with() {
    let mut stage = Stage::new([0.0, 0.3, 3.6], [0.0; 3]);
    let material =
        stage.material(phong(RED, Phong { specular: Vec3::splat(0.4), shininess: 20.0, ..Phong::default() }));
    stage.mesh(ball(6, false, Vec3::new(-0.7, 0.0, 0.0), material));
    stage.mesh(ball(6, true, Vec3::new(0.7, 0.0, 0.0), material));
    stage.sun([-1.0, -1.0, -1.0], 0.8);
    check("flat-and-smooth", &stage.render());
}

#[test]
fn golden_a_spot_light_ends_softly_and_weakens_with_distance() {
    let mut stage = Stage::new([0.0, 2.0, 3.0], [0.0, -0.9, 0.0]);
    let floor = stage.matt([0.8; 3]);
    stage.floor(-1.0, floor);
    let spot = |x: f64, falloff: Falloff| LightKind::Spot {
        position: DVec3::new(x, 1.0, 0.5),
        direction: DVec3::new(0.0, -1.0, -0.3).normalize(),
        inner: 0.2,
        outer: 0.4,
        falloff,
    };
    stage.light([0.9, 0.7, 0.4], spot(-0.9, Falloff::None));
    stage.light([3.0, 4.0, 5.0], spot(0.9, Falloff::InverseSquare { range: f64::INFINITY }));
    check("spot-lights", &stage.render());
}

#[test]
fn golden_glowing_things_show_but_light_nothing() {
    let mut stage = front();
    let floor = stage.matt(GREY);
    stage.floor(-1.0, floor);
    let glow = Material { emission: Vec3::new(0.9, 0.5, 0.1), ..phong([0.0; 3], Phong::default()) };
    let material = stage.material(glow);
    stage.sphere([0.0, -0.2, 0.0], 0.6, material);
    stage.sun([-0.5, -1.0, -0.5], 0.4);
    check("glow", &stage.render());
}

#[test]
fn golden_a_back_face_is_unseen_unless_double_sided() {
    let mut stage = flat();
    for (x, double_sided) in [(-0.65, false), (0.65, true)] {
        let material = stage.material(Material { double_sided, ..phong(RED, Phong::default()) });
        let at = |dx: f32, dy: f32| [x + dx * 0.5, dy * 0.7, 0.0];
        // Clockwise as seen from the eye, which therefore sees the back.
        stage.quad([at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)], 1.0, material);
    }
    stage.sun([0.3, -0.3, -1.0], 0.9);
    check("back-faces", &stage.render());
}

#[test]
fn golden_parallel_rays_keep_sizes() {
    let mut stage = flat();
    let material = stage.matt(BLUE);
    for i in 0..4_u8 {
        stage.sphere([f64::from(i) * 0.65 - 0.975, 0.0, -f64::from(i) * 3.0], 0.3, material);
    }
    stage.sun([-0.5, -1.0, -1.0], 0.9);
    check("orthographic", &stage.render());
}

#[test]
fn golden_the_studio_is_behind_when_asked_for() {
    let mut stage = Stage::new([0.0, 0.2, 3.0], [0.0; 3]);
    stage.view = View::look_at(DVec3::new(0.0, 0.2, 3.0), DVec3::ZERO, DVec3::Y, Lens::perspective(1.6));
    stage.studio();
    stage.scene.background = Some(Background::Environment);
    let chrome = MetalRough { metallic: 1.0, roughness: 0.0, ..MetalRough::default() };
    let material = stage.material(metal_rough([0.95; 3], chrome));
    stage.sphere([0.0; 3], 1.2, material);
    check_all(&[("studio", &stage.render(), &Output::default())]);
}

/// A ball and a card before a checkered floor, under an area light.
fn edges_and_soft_shadows() -> Stage {
    let mut stage = Stage::new([0.0, 1.2, 5.0], [0.0, 0.0, 0.0]);
    stage.scene.background = Some(Background::Color(Vec3::splat(0.3)));
    checkered_floor(&mut stage, -1.0);
    let (red, blue) = (stage.matt(RED), stage.matt(BLUE));
    stage.sphere([-0.8, -0.2, 0.0], 0.8, red);
    stage.card(0.9, -0.2, -0.4, 0.7, blue);
    stage.lamp([3.0, 5.0, 4.0], WHITE);
    stage.scene.lights[0].size = 0.8;
    stage
}

#[test]
fn golden_adaptive_sampling_is_smooth_at_edges() {
    let mut stage = edges_and_soft_shadows();
    stage.settings.sampling = Sampling::Adaptive(Adaptive::default());
    check("adaptive", &stage.render());
}

#[test]
fn golden_stochastic_sampling_is_smooth_at_edges_and_through_a_lens() {
    let mut stage = edges_and_soft_shadows();
    stage.settings.sampling = Sampling::Stochastic(Stochastic::default());
    let sharp = stage.render();
    stage.settings.lens = Some(ThinLens { radius: 0.15, focus: 5.0 });
    check_all(&[("stochastic", &sharp, &plain()), ("lens", &stage.render(), &plain())]);
}

#[test]
fn golden_a_prism_spreads_white_light() {
    let mut stage = Stage::new([0.0, 0.2, 4.0], [0.0, 0.0, 0.0]);
    stage.settings.samples = 36;
    stage.scene.background = Some(Background::Color(Vec3::splat(0.02)));
    let glass = Phong { transmission: Vec3::ONE, ior: 1.6, dispersion: 1.0, fresnel: true, ..Phong::default() };
    let material = stage.material(phong([0.0; 3], glass));
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    // An upright wedge, its edge on top.
    let positions = vec![
        corner(-0.9, -0.8, 0.7),
        corner(0.9, -0.8, 0.7),
        corner(0.9, -0.8, -0.7),
        corner(-0.9, -0.8, -0.7),
        corner(-0.9, 0.8, 0.0),
        corner(0.9, 0.8, 0.0),
    ];
    let triangles = vec![[0, 2, 1], [0, 3, 2], [0, 1, 5], [0, 5, 4], [2, 3, 4], [2, 4, 5], [1, 2, 5], [3, 0, 4]];
    stage.mesh(Mesh { material, positions, triangles, ..Mesh::default() });
    let bar = stage.material(unlit(WHITE));
    for y in [1.8_f32, 2.8, 3.8] {
        stage.quad([[-3.0, y, -4.0], [3.0, y, -4.0], [3.0, y + 0.35, -4.0], [-3.0, y + 0.35, -4.0]], 1.0, bar);
    }
    for y in [-1.2_f32, -2.2, -3.2] {
        stage.quad([[-3.0, y, -4.0], [3.0, y, -4.0], [3.0, y + 0.35, -4.0], [-3.0, y + 0.35, -4.0]], 1.0, bar);
    }
    check("prism", &stage.render());
}

#[test]
fn golden_a_concave_polygon_stays_whole() {
    let mut stage = flat();
    let material = stage.material(unlit(BLUE));
    // A star of ten corners, whose notches the crossing test must leave out.
    let radius = |i: u8| if i.is_multiple_of(2) { 0.95_f32 } else { 0.35 };
    let angle = |i: u8| f32::from(i) * std::f32::consts::TAU / 10.0;
    let positions: Vec<Vec3> =
        (0..10).map(|i| Vec3::new(-angle(i).sin() * radius(i), angle(i).cos() * radius(i), 0.0)).collect();
    stage.mesh(Mesh {
        material,
        positions,
        polygons: vec![Polygon { first: 0, len: 10, face: 0 }],
        polygon_corners: (0..10).collect(),
        ..Mesh::default()
    });
    check("concave-polygon", &stage.render());
}

#[test]
fn golden_tone_maps_bend_bright_light_each_in_its_way() {
    // Brightness doubles eight times from left to right; hues vary from top to bottom.
    let pixel = |i: u16| {
        let (x, y) = (i % 96, i / 96);
        let light = 0.05 * (f32::from(x) / 12.0).exp2();
        let hue = [[1.0, 1.0, 1.0], [1.0, 0.3, 0.1], [0.2, 0.9, 0.2], [0.15, 0.3, 1.0]][usize::from(y / 6)];
        [hue[0] * light, hue[1] * light, hue[2] * light, 1.0]
    };
    let picture = Picture::of(96, 24, (0..96 * 24).map(pixel).collect());
    let through = |tone_map: ToneMap| Output { tone_map, ..plain() };
    check_all(&[
        ("tone-map-none", &picture, &through(ToneMap::None)),
        ("tone-map-reinhard", &picture, &through(ToneMap::Reinhard)),
        ("tone-map-aces", &picture, &through(ToneMap::Aces)),
        ("tone-map-neutral", &picture, &through(ToneMap::Neutral)),
    ]);
}

#[test]
fn golden_points_and_lines_are_thin_solids() {
    let read = |name: &str, text: String| {
        load_bytes(Path::new(name), text.into_bytes(), &LoadOptions::default()).unwrap().scene
    };
    // A wireframe cube and its corners, coloured and unlit.
    let mut cube = String::new();
    for i in 0..8 {
        let bit = |k: i32| i >> k & 1;
        let [x, y, z] = [bit(0), bit(1), bit(2)];
        cube += &format!("v {x} {y} {z} {} {} {}\n", 0.3 + 0.7 * x as f32, 0.3 + 0.7 * y as f32, z);
        for k in (0..3).filter(|&k| bit(k) == 0) {
            cube += &format!("l {} {}\n", i + 1, i + (1 << k) + 1);
        }
    }
    // A ball of points with normals, lit from the left.
    const POINTS: u32 = 60_000;
    let axes = ["x", "y", "z", "nx", "ny", "nz"].map(|name| format!("property float {name}\n")).concat();
    let mut ball = format!("ply\nformat ascii 1.0\nelement vertex {POINTS}\n{axes}end_header\n");
    for i in 0..POINTS {
        // Evenly spread: by the golden angle around the axis, in equal steps along it.
        let z = 1.0 - (f64::from(i) + 0.5) * 2.0 / f64::from(POINTS);
        let (ring, turn) = ((1.0 - z * z).sqrt(), f64::from(i) * 2.399_963_23);
        let p = format!("{:.6} {:.6} {z:.6}", ring * turn.cos(), ring * turn.sin());
        ball += &format!("{p} {p}\n");
    }
    let mut stage = flat();
    let turned = DQuat::from_rotation_x(0.5) * DQuat::from_rotation_y(0.6);
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(0.8), turned, DVec3::new(-1.0, -0.3, 0.0));
    stage.scene.append(read("cube.obj", cube), &place);
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(0.6), DQuat::IDENTITY, DVec3::X * 0.6);
    stage.scene.append(read("ball.ply", ball), &place);
    stage.sun([1.0, -0.5, -0.5], 0.9);
    // Lines are a fifth of a pixel wide here.
    stage.settings.samples = 64;
    check("points-and-lines", &stage.render());
}

#[test]
fn golden_layers_show_normals_and_albedo() {
    let mut stage = front();
    stage.settings.layers = true;
    checkered_floor(&mut stage, -1.0);
    let material = stage.matt(RED);
    stage.sphere([0.0; 3], 0.9, material);
    stage.sun([-0.3, -1.0, -0.4], 0.9);
    let picture = stage.render();
    let layers = picture.layers.as_ref().unwrap();
    let show = |colors: Vec<[f32; 3]>| {
        Picture::of(picture.width, picture.height, colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
    };
    let normal = show(layers.normal.iter().map(|n| n.map(|c| c * 0.5 + 0.5)).collect());
    let albedo = show(layers.albedo.clone());
    check_all(&[("layer-normal", &normal, &plain()), ("layer-albedo", &albedo, &plain())]);
}
