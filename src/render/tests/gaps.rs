//! Rays pass known gaps, and pictures are the same bit by bit.

use super::*;
use crate::accel::AccelChoice;
use crate::math::random::Random;
use crate::math::{Vec2, Vec4};
use crate::render::Instancing;
use crate::render::profile::render_profiled;
use crate::scene::{
    AlphaMode, Bitmap, Environment, MetalRough, Pixels, Sampler, Texture, TextureRef, UvTransform, Wrap,
};

/// Spotted cards, thick as leaves, before a mirror and beside a lamp: some turn their backs, some are mirrored, some coincide,
/// and their maps repeat, clamp, mirror or are turned.
fn canopy(alpha_mode: AlphaMode, side: u32, branching: bool) -> Stage {
    let mut random = Random::new(41);
    let view = View::look_at(DVec3::new(0.5, 0.3, 7.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.6));
    let mut s = stage(view);
    s.settings = Settings { width: 132, height: 108, samples: 2, depth: Some(2), layers: true, ..s.settings };
    s.scene.environment = Environment::Studio;
    s.lamp(DVec3::new(4.0, 5.0, 9.0), 1.0);
    let mirror = Phong { mirror: Vec3::splat(0.6), ..phong() };
    s.square(-3.0, 3.0, material(Vec3::splat(0.3), mirror));
    if branching {
        // Several rays from one point.
        let metal = MetalRough { metallic: 1.0, roughness: 0.3, ..MetalRough::default() };
        let metal = Material { reflection: Reflection::MetalRough(metal), ..Material::plain() };
        s.mesh(square(0.0, 3.0), DAffine3::from_translation(DVec3::new(0.0, 0.0, -2.9)), metal);
        let glass = Phong { transmission: Vec3::splat(0.8), mirror: Vec3::splat(0.1), ..phong() };
        for z in [0.4, 0.7] {
            s.square(z, 0.7, material(Vec3::ZERO, glass.clone()));
        }
        s.settings.gloss_rays = Some(4);
    }
    let spots: Vec<Vec2> = (0..4).map(|_| Vec2::new(random.unit(), random.unit())).collect();
    let texel = |x: u32, y: u32| {
        let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / side as f32;
        let near = spots.iter().map(|spot| (at - *spot).length()).fold(9.0, f32::min);
        // Solid, then fading, then clear.
        [60, 140, 40, (255.0 * (1.5 - near * 16.0)).clamp(0.0, 255.0) as u8]
    };
    let texels = (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
    s.scene.bitmaps.push(Bitmap { name: String::new(), width: side, height: side, pixels: Pixels::Rgba8(texels) });
    for (wrap_u, wrap_v) in [(Wrap::Repeat, Wrap::Repeat), (Wrap::Clamp, Wrap::Mirror)] {
        s.scene.textures.push(Texture { bitmap: 0, sampler: Sampler { wrap_u, wrap_v, ..Sampler::default() } });
    }
    for i in 0..160_u32 {
        let turn = UvTransform { rotation: 0.3 * (i % 3) as f32, scale: Vec2::new(1.0, 1.3), ..UvTransform::default() };
        let transform = if i.is_multiple_of(2) { turn } else { UvTransform::default() };
        let map = TextureRef { texture: i / 2 % 2, uv_set: 0, transform };
        let leaf = Material {
            alpha_mode,
            base_color_map: Some(map),
            double_sided: !i.is_multiple_of(3),
            opacity: if i % 7 == 5 { 0.9 } else { 1.0 },
            ..material(Vec3::ONE, phong())
        };
        let mut mesh = square(0.0, 0.45);
        mesh.uvs = vec![mesh.positions.iter().map(|p| p.truncate() * [1.1, 1.9][i as usize % 2]).collect()];
        if i % 11 == 4 {
            mesh.colors = vec![Vec4::new(1.0, 0.8, 0.7, 0.6), Vec4::ONE, Vec4::new(0.3, 1.0, 1.0, 0.9), Vec4::ONE];
        }
        let at = random.cube().as_dvec3() * 1.6;
        let (a, b) = (f64::from(random.unit()) * 6.0, f64::from(random.unit()) * 6.0);
        let mirrored = DAffine3::from_scale(DVec3::new(if i % 5 == 2 { -1.0 } else { 1.0 }, 1.0, 1.0));
        let place = DAffine3::from_translation(at) * DAffine3::from_rotation_y(a) * DAffine3::from_rotation_x(b);
        s.mesh(mesh.clone(), place * mirrored, leaf);
        // Coincident cards of one material are one surface where they turn the same side to a ray.
        let (material, count) = (s.scene.materials.len() as u32 - 1, s.scene.meshes.len() as u32);
        let again = Instance { name: String::new(), mesh: count - 1, world_from_object: place * mirrored };
        match i % 9 {
            0 => s.scene.instances.push(again),
            1 => {
                mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
                s.scene.meshes.push(Mesh { material, ..mesh });
                s.scene.instances.push(Instance { mesh: count, ..again });
            }
            2 => {
                mesh.uvs[0].rotate_left(1);
                s.scene.meshes.push(Mesh { material, ..mesh });
                s.scene.instances.push(Instance { mesh: count, ..again });
            }
            _ => {}
        }
    }
    s
}

#[test]
fn pictures_have_the_same_bits_whether_or_not_rays_stop_at_what_is_not_there() {
    for alpha_mode in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Mask { cutoff: 0.05 }, AlphaMode::Blend] {
        for (side, branching, round) in [(64, false, false), (90, true, false), (64, true, true)] {
            let mut s = canopy(alpha_mode, side, branching);
            if round {
                s.sphere(DVec3::new(0.0, 0.1, 0.2), 0.3, material(Vec3::splat(0.4), phong()));
            }
            for kind in [AccelKind::FastBvh, AccelKind::Grid] {
                let what = format!("{alpha_mode:?} {side} {branching} {round} {kind}");
                let most = if branching { 1.0 } else { 0.95 };
                s.with_job(kind, |job| assert_passes(job, most, &what));
            }
        }
    }
}

/// Asserts that uncounted rays pass some gaps, so that less than the fraction `most` of all queries is made, and the picture is
/// the same.
fn assert_passes(job: &Job, most: f64, what: &str) -> Rendered {
    let (counted, (rendered, profile)) = (render_counted(job, &()), render_profiled(job, &()));
    assert!(rendered.picture == counted.picture, "{what}");
    let counts = [counted.counts.primary, counted.counts.reflected, counted.counts.refracted];
    let all = counts.map(|c| c.queries).iter().sum::<u64>();
    let asked = profile.rays[0] + profile.rays[2] + profile.rays[3];
    assert!((asked as f64) < all as f64 * most, "{what}: {asked} of {all}");
    counted
}

#[test]
fn what_is_kept_once_for_many_places_has_the_same_gaps_in_all_of_them() {
    for alpha_mode in [AlphaMode::Mask { cutoff: 0.5 }, AlphaMode::Blend] {
        let mut s = canopy(alpha_mode, 64, false);
        let (flip, half) = (DVec3::new(-0.6, 0.5, 0.6), DVec3::splat(0.4));
        for (k, instance) in s.scene.instances.clone().into_iter().enumerate().skip(1) {
            let place = if k % 2 == 0 { flip } else { half };
            let at = DAffine3::from_translation(DVec3::new(0.1 * (k % 7) as f64 - 0.3, 0.2, 0.8));
            let world_from_object = at * DAffine3::from_scale(place) * instance.world_from_object;
            s.scene.instances.push(Instance { world_from_object, ..instance });
        }
        let pictures = [Instancing::Flatten, Instancing::Keep].map(|how| {
            let world = World::placing(&s.scene, how);
            assert_eq!(world.instanced.is_empty(), how == Instancing::Flatten);
            let (accel, _) = world.structure(AccelChoice::Kind(AccelKind::FastBvh), &AccelParams::DEFAULT);
            let (textures, Stage { scene, view, settings }) = (TextureStore::new(&s.scene), &s);
            let job = Job { scene, world: &world, accel: &accel, textures: &textures, view, settings };
            assert_passes(&job, 0.95, &format!("{alpha_mode:?} {how:?}")).picture
        });
        assert!(pictures[0] == pictures[1], "{alpha_mode:?}");
    }
}

/// A card with huge coordinates, or a sliver, seen from near: the texels read there depend on rounding.
#[test]
fn where_roundings_decide_what_is_read_nothing_is_passed_that_is_there() {
    for case in 0..3 {
        let mut s = canopy(AlphaMode::Mask { cutoff: 0.5 }, 64, false);
        s.settings.samples = 1;
        for (i, mesh) in s.scene.meshes.iter_mut().enumerate().filter(|(_, mesh)| !mesh.uvs.is_empty()) {
            let uvs = &mut mesh.uvs[0];
            match case {
                0 => uvs.iter_mut().for_each(|uv| *uv += Vec2::new(1e6, -2e5)),
                1 => uvs.iter_mut().for_each(|uv| *uv *= 3e4),
                _ => {
                    let narrow = |p: &mut Vec3| *p = Vec3::new(p.x, p.y * 1e-4 + p.x * (0.2 + i as f32 * 0.01), 0.0);
                    mesh.positions.iter_mut().for_each(narrow);
                }
            }
        }
        let offset = if case == 0 { Vec2::new(-1e6, 2e5) } else { Vec2::ZERO };
        for map in s.scene.materials.iter_mut().filter_map(|m| m.base_color_map.as_mut()) {
            map.transform = UvTransform { offset, ..UvTransform::default() };
        }
        let (counted, rendered) =
            s.with_job(AccelKind::FastBvh, |job| (render_counted(job, &()), crate::render::render(job, &())));
        assert!(rendered.picture == counted.picture, "{case}");
    }
}
