//! Pictures have the same bits whichever way they are computed.

use super::*;
use crate::math::Vec2;
use crate::math::random::Random;
use crate::render::context::Gloss;
use crate::render::shading_batch::MaterialConstants;
use crate::render::texture::TextureStore;
use crate::render::{Sampling, Stochastic};
use crate::scene::{
    AlphaMode, Anisotropy, Bitmap, Coat, DiffuseTransmission, Environment, Iridescence, MetalRough, Panorama, Pixels,
    Sampler, Sheen, Texture, TextureRef, UvTransform, Wrap,
};
use std::sync::Arc;

/// Some of everything except textures: mirrors, glass, blending.
pub(super) fn busy() -> Stage {
    let mut s = stage(View::look_at(DVec3::new(1.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.8)));
    s.settings = Settings { width: 70, height: 50, samples: 3, cutoff: 1.0 / 512.0, layers: true, ..s.settings };
    let pbr = |m: MetalRough| Material { reflection: Reflection::MetalRough(m), ..Material::plain() };
    s.square(-2.0, 3.0, Material::plain());
    s.mesh(
        square(0.0, 1.5),
        DAffine3::from_rotation_x(-1.2) * DAffine3::from_translation(DVec3::Z * -1.0),
        pbr(MetalRough { roughness: 0.2, ..MetalRough::default() }),
    );
    let glass = Phong { transmission: Vec3::new(0.9, 0.8, 0.7), mirror: Vec3::ONE, ior: 1.5, fresnel: true, ..phong() };
    s.sphere(DVec3::new(-0.8, 0.3, 0.4), 0.6, material(Vec3::splat(0.1), glass));
    s.sphere(DVec3::new(0.8, 0.3, 0.2), 0.5, material(Vec3::X, Phong { mirror: Vec3::splat(0.5), ..phong() }));
    s.square(1.0, 0.7, Material { opacity: 0.3, alpha_mode: AlphaMode::Blend, ..Material::plain() });
    s.lamp(DVec3::new(3.0, 4.0, 5.0), 0.7).lamp(DVec3::new(-4.0, 3.0, 2.0), 0.4);
    s.scene.environment = Environment::Studio;
    s
}

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    let s = busy();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| s.render())
    };
    let one = with(1);
    assert!(one.complete && one.picture.beauty.iter().flatten().all(|v| v.is_finite()));
    for threads in [2, 7] {
        let many = with(threads);
        assert!(many.picture == one.picture, "{threads} threads differ from one");
        assert_eq!(many.counts, one.counts);
    }
}

#[test]
fn every_structure_gives_the_same_bits() {
    let s = busy();
    let truth = s.render_by(AccelKind::None);
    for kind in AccelKind::ALL {
        let by = s.render_by(kind);
        assert!(by.picture == truth.picture, "{kind} differs from brute force");
        let queries = |r: &Rendered| {
            [r.counts.primary, r.counts.shadow, r.counts.reflected, r.counts.refracted].map(|c| (c.queries, c.found))
        };
        assert_eq!(queries(&by), queries(&truth));
    }
}

#[test]
fn counting_changes_no_bit() {
    let s = busy();
    let (timed, counted) =
        s.with_job(AccelKind::None, |job| (crate::render::render(job, &()), render_counted(job, &())));
    assert!(timed.picture == counted.picture);
    assert_eq!(timed.counts, Default::default());
    assert_eq!(counted.counts.primary.queries, 70 * 50 * 3);
}

/// Untextured surfaces of every model, seen from both sides, under every kind of light.
fn plain() -> Stage {
    let mut s = stage(View::look_at(DVec3::new(1.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.8)));
    s.settings = Settings { width: 61, height: 47, samples: 3, depth: Some(1), layers: true, ..s.settings };
    let pbr = |m: MetalRough| Material { reflection: Reflection::MetalRough(m), ..Material::plain() };
    let turned = |x: f64, at: DVec3| DAffine3::from_translation(at) * DAffine3::from_rotation_x(x);
    let round = |half: f32| {
        let lean = |x: f32, y: f32| Vec3::new(x, y, 2.0).normalize();
        let normals = vec![lean(-1.0, -1.0), lean(1.0, -1.0), lean(1.0, 1.0), lean(-1.0, 1.0)];
        Mesh { normals, ..square(0.0, half) }
    };
    s.square(-2.0, 3.0, Material { emission: Vec3::splat(0.01), ..Material::plain() });
    s.mesh(
        round(0.7),
        turned(-1.2, DVec3::new(-1.5, 0.0, 0.0)),
        pbr(MetalRough { roughness: 0.4, ..MetalRough::default() }),
    );
    s.mesh(
        round(0.7),
        turned(2.5, DVec3::new(-1.5, 1.2, 0.0)),
        pbr(MetalRough { metallic: 0.3, thick: true, ..MetalRough::default() }),
    );
    let mirror = pbr(MetalRough { roughness: 0.04, metallic: 0.6, ..MetalRough::default() });
    s.mesh(round(0.5), turned(0.3, DVec3::new(1.2, 1.4, -0.5)), mirror);
    s.mesh(
        round(0.5),
        turned(-0.9, DVec3::new(-0.3, -1.2, 0.9)),
        pbr(MetalRough { roughness: 0.15, ..MetalRough::default() }),
    );
    let polished = Phong { mirror: Vec3::new(0.3, 0.2, 0.1), fresnel: true, ..phong() };
    s.mesh(round(0.4), turned(0.2, DVec3::new(-2.0, -1.0, 0.5)), material(Vec3::new(0.3, 0.3, 0.5), polished));
    let shiny = Phong { specular: Vec3::splat(0.4), shininess: 9.0, ambient: Vec3::splat(0.2), ..phong() };
    let mirrored = turned(-0.5, DVec3::new(1.0, 0.2, 0.3)) * DAffine3::from_scale(DVec3::new(-1.0, 1.5, 1.0));
    s.mesh(round(0.6), mirrored, material(Vec3::new(0.2, 0.5, 0.7), shiny));
    s.mesh(square(0.0, 0.4), turned(0.7, DVec3::new(0.0, -0.8, 1.0)), material(Vec3::X, phong()));
    s.mesh(square(0.0, 0.3), turned(0.1, DVec3::new(0.2, 1.4, 0.0)), unlit(Vec3::new(0.1, 0.9, 0.3)));
    s.mesh(square(0.5, 0.3), DAffine3::from_rotation_y(3.0), Material { double_sided: false, ..Material::plain() });
    s.lamp(DVec3::new(3.0, 4.0, 5.0), 0.7);
    let light =
        |kind, shadows| Light { name: String::new(), intensity: Vec3::new(0.5, 0.6, 0.7), kind, shadows, size: 0.0 };
    s.scene.lights.push(light(LightKind::Directional { direction: DVec3::new(1.0, -1.0, -0.5) }, false));
    let (position, direction) = (DVec3::new(-2.0, 3.0, 3.0), DVec3::new(1.0, -1.5, -1.5));
    let falloff = Falloff::InverseSquare { range: 20.0 };
    s.scene.lights.push(light(LightKind::Spot { position, direction, inner: 0.2, outer: 0.6, falloff }, true));
    s
}

/// Renders with points shaded side by side where possible, and asserts that shading one by one gives the same bits.
#[track_caller]
fn same_one_by_one(s: &mut Stage, what: &str) -> Rendered {
    let together = s.render();
    s.settings.one_by_one = true;
    let alone = s.render();
    s.settings.one_by_one = false;
    assert_eq!(together.counts, alone.counts, "{what}");
    let differ = together.picture.beauty.iter().zip(&alone.picture.beauty).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "pixels, {what}");
    assert!(together.picture == alone.picture, "layers, {what}");
    together
}

#[test]
fn points_shaded_side_by_side_have_the_bits_of_points_shaded_one_by_one() {
    for environment in [Environment::Black, Environment::Constant(Vec3::splat(0.2)), Environment::Studio] {
        let mut s = plain();
        s.scene.environment = environment;
        let together = same_one_by_one(&mut s, &format!("{environment:?}"));
        let seen = together.picture.beauty.iter().filter(|c| c[0] > 0.0).count();
        assert!(seen > 1500, "{seen}");
    }
}

/// A stage with every kind of map that batches can read, tangents, and vertex colours on some meshes.
fn painted() -> Stage {
    let mut s = plain();
    let mut random = Random::new(8);
    for side in [3, 16, 40] {
        let texels = (0..side * side).map(|_| [(); 4].map(|()| (random.unit() * 255.0) as u8)).collect();
        let bitmap = Bitmap { name: String::new(), width: side, height: side, pixels: Pixels::Rgba8(texels) };
        let sampler = Sampler { wrap_u: if side == 16 { Wrap::Mirror } else { Wrap::Repeat }, ..Sampler::default() };
        s.scene.textures.push(Texture { bitmap: s.scene.bitmaps.len() as u32, sampler });
        s.scene.bitmaps.push(bitmap);
    }
    let transform = UvTransform { scale: Vec2::splat(3.0), rotation: 0.4, ..UvTransform::default() };
    let map = |texture| Some(TextureRef { texture, uv_set: 0, transform });
    let moved = UvTransform { offset: Vec2::new(0.3, -2.1), ..transform };
    for (i, material) in s.scene.materials.iter_mut().enumerate() {
        // Some materials use two coordinate sets, some three.
        let other = |texture| {
            let transform = if i == 5 { moved } else { UvTransform::default() };
            map(texture).map(|map| if i % 3 == 0 { map } else { TextureRef { uv_set: 1, transform, ..map } })
        };
        material.base_color_map = map(0);
        material.occlusion_map = if i == 5 { map(1).map(|map| TextureRef { uv_set: 1, ..map }) } else { other(1) };
        (material.emission, material.emission_map) = (Vec3::new(0.1, 0.2, 0.1), other(2));
        material.normal_map = map(1).filter(|_| i % 2 == 0);
        material.alpha_mode = match i {
            2 | 4 => AlphaMode::Mask { cutoff: 0.4 },
            1 | 6 => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        (material.bump_map, material.bump_scale) = (map(2).filter(|_| i % 3 == 0), 0.1);
        match &mut material.reflection {
            Reflection::MetalRough(m) => (m.metal_rough_map, m.roughness) = (map(1), 1.0),
            Reflection::Phong(p) => {
                (p.ambient_map, p.specular_map) = (map(1), map(2));
                (p.shininess, p.shininess_map) = (20.0, map(0));
            }
            Reflection::Unlit => {}
        }
    }
    for (i, mesh) in s.scene.meshes.iter_mut().enumerate() {
        let (first, second) = mesh.positions.iter().map(|p| (p.truncate(), Vec2::new(p.y, p.x * 2.0 + p.z))).unzip();
        mesh.uvs = if i == 6 { vec![first] } else { vec![first, second] };
        if i % 4 < 3 {
            let tangent =
                |p: &Vec3| (Vec3::new(0.9, -0.4, 0.1 * p.x).normalize()).extend(if i % 4 == 0 { 1.0 } else { -1.0 });
            mesh.tangents = mesh.positions.iter().map(tangent).collect();
        }
        if i % 4 == 1 {
            mesh.colors = mesh.positions.iter().map(|_| random.cube().abs().extend(1.0)).collect();
        }
    }
    s
}

#[test]
fn mapped_points_shaded_side_by_side_have_the_bits_of_points_shaded_one_by_one() {
    // Where no ray bounces even mirrors are seen by lookups.
    for (depth, environment) in [(1, Environment::Studio), (0, Environment::Studio), (1, Environment::Black)] {
        let mut s = painted();
        let store = TextureStore::new(&s.scene);
        let beside = |m: &Material| {
            MaterialConstants::of(0, m, &store, depth > 0, Gloss::new(None)).is_some_and(|constants| constants.mapped)
        };
        assert!(s.scene.materials.iter().all(beside), "nothing would be compared");
        (s.settings.depth, s.scene.environment) = (Some(depth), environment);
        same_one_by_one(&mut s, &format!("depth {depth}, {environment:?}"));
    }
}

/// `s` with partly covered and absent surfaces, by map, vertex colour or material, some seen from behind.
fn holed(mut s: Stage) -> Stage {
    let mut random = Random::new(3);
    for (i, material) in s.scene.materials.iter_mut().enumerate() {
        (material.opacity, material.alpha_mode) = match i % 4 {
            0 => (0.3 + 0.05 * i as f32, AlphaMode::Blend),
            1 => (0.7, AlphaMode::Mask { cutoff: if i % 8 == 1 { 0.8 } else { 0.3 } }),
            _ => (1.0, AlphaMode::Blend),
        };
        material.double_sided = i % 3 != 0;
    }
    for mesh in s.scene.meshes.iter_mut().step_by(3) {
        mesh.colors = mesh.positions.iter().map(|_| random.cube().abs().extend(random.unit())).collect();
        mesh.triangles.iter_mut().step_by(2).for_each(|t| t.swap(1, 2));
    }
    s
}

#[test]
fn points_that_are_there_in_part_have_the_same_bits_side_by_side() {
    for (environment, textures, depth) in
        [(Environment::Studio, 0, 1), (Environment::Studio, 3, 2), (Environment::Black, 3, 6)]
    {
        let stage = if textures > 0 { painted() } else { plain() };
        let stage = if depth > 1 { lobed(stage, textures) } else { stage };
        let mut s = holed(if depth > 2 { glazed(stage, 3) } else { stage });
        (s.settings.depth, s.scene.environment) = (Some(depth), environment);
        let together = same_one_by_one(&mut s, &format!("{environment:?}, {textures} textures, depth {depth}"));
        assert!(together.counts.refracted.queries > 1000, "{:?}", together.counts.refracted);
    }
}

/// `s` with glass: clear and coloured, smooth and rough, thin and thick, with absorbing objects inside, and maps.
fn glazed(mut s: Stage, textures: usize) -> Stage {
    s.settings = Settings { depth: Some(6), samples: 2, ..s.settings };
    let pane = |half: f32, thick: f32| {
        let (front, back) = (square(thick, half), square(0.0, half));
        let mut mesh = front.clone();
        mesh.positions.extend(&back.positions);
        mesh.triangles.extend(back.triangles.iter().map(|&[a, b, c]| [a + 4, c + 4, b + 4]));
        let lean = |p: &Vec3| Vec3::new(p.x * 0.3, p.y * 0.4, if p.z > 0.0 { 1.0 } else { -1.0 }).normalize();
        mesh.normals = mesh.positions.iter().map(lean).collect();
        mesh.uvs = vec![mesh.positions.iter().map(|p| p.truncate()).collect()];
        mesh
    };
    let glass =
        MetalRough { transmission: 1.0, thick: true, roughness: 0.0, metallic: 0.0, ior: 1.5, ..MetalRough::default() };
    let absorption = Vec3::new(0.3, 0.1, 0.5);
    let panes = [
        (0.5, glass.clone()),
        (0.2, MetalRough { dispersion: 1.0, ..glass.clone() }),
        (0.6, MetalRough { transmission: 0.7, absorption, roughness: 0.02, ..glass.clone() }),
        (0.3, MetalRough { roughness: 0.3, absorption, ..glass.clone() }),
        (0.4, MetalRough { thick: false, roughness: 0.1, ..glass.clone() }),
        (0.3, MetalRough { thick: false, transmission: 0.5, metallic: 0.4, ..glass.clone() }),
        (0.3, MetalRough { ior: 1.0, absorption, ..glass }),
    ];
    for (i, (half, m)) in panes.into_iter().enumerate() {
        let at = DVec3::new(-1.8 + 0.6 * i as f64, 0.9 - 0.5 * (i % 4) as f64, 1.6);
        let placed = DAffine3::from_translation(at) * DAffine3::from_rotation_y(0.3 * i as f64 - 0.7);
        let mut mapped = m;
        let map = |texture: usize| {
            (textures > 0).then(|| TextureRef { texture: texture as u32, uv_set: 0, transform: UvTransform::default() })
        };
        (mapped.transmission_map, mapped.thickness_map) =
            (map(i % 3).filter(|_| i % 2 == 0), map(2).filter(|_| i % 3 == 0));
        let base_color_map = map(1).filter(|_| i != 1);
        let double_sided = i % 2 == 0;
        // Some glass with all other features.
        let rich = textures > 0 && i % 2 == 1;
        mapped.metal_rough_map = map(0).filter(|_| rich && i != 3);
        let (normal_map, occlusion_map, emission_map) = (map(2).filter(|_| rich), map(1).filter(|_| rich), map(0));
        let emission = if rich { Vec3::new(0.1, 0.0, 0.2) } else { Vec3::ZERO };
        let alpha_mode = match i {
            3 if rich => AlphaMode::Mask { cutoff: 0.4 },
            5 if rich => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        let placed = if i == 2 { placed * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) } else { placed };
        let reflection = Reflection::MetalRough(mapped);
        let material = Material {
            reflection,
            base_color: Vec3::new(0.9, 0.95, 0.8),
            base_color_map,
            normal_map,
            occlusion_map,
            emission,
            emission_map,
            alpha_mode,
            double_sided,
            ..Material::plain()
        };
        let mut mesh = pane(half, 0.4);
        if rich {
            mesh.tangents = vec![Vec3::X.extend(1.0); mesh.positions.len()];
        }
        if textures > 0 && i == 4 {
            mesh.colors = mesh.positions.iter().map(|p| (p.abs() * 0.5 + 0.5).extend(1.0)).collect();
        }
        s.mesh(mesh, placed, material);
        // An object in the middle of it.
        s.mesh(square(0.2, 0.4 * half), placed, Material::plain());
    }
    s
}

#[test]
fn glass_shaded_side_by_side_has_the_bits_of_glass_shaded_one_by_one() {
    let cases = [(Environment::Studio, 0), (Environment::Black, 3), (Environment::Studio, 3)];
    for (k, (environment, textures)) in cases.into_iter().enumerate() {
        let mut s = glazed(if textures > 0 { painted() } else { plain() }, textures);
        let store = TextureStore::new(&s.scene);
        let beside = |m: &&Material| {
            MaterialConstants::of(0, m, &store, true, Gloss::new(None))
                .is_some_and(|constants| constants.glass.is_some())
        };
        // Materials that scatter light inside are shaded one by one.
        let expected = if textures > 0 { 4 } else { 6 };
        assert_eq!(s.scene.materials.iter().filter(beside).count(), expected, "nothing would be compared");
        s.scene.environment = environment;
        if k == 2 {
            // From inside of a pane.
            s.view = View::look_at(DVec3::new(-1.8, 0.9, 1.8), DVec3::ZERO, DVec3::Y, Lens::perspective(1.2));
        }
        let together = same_one_by_one(&mut s, &format!("{environment:?}, {textures} textures"));
        assert!(together.counts.refracted.queries > 2000, "{:?}", together.counts.refracted);
    }
}

/// A lobe map of the `i`th material, out of `textures` textures: every other one has coordinates other than the colour maps'.
fn lobe_map(textures: u32, i: usize, texture: u32) -> Option<TextureRef> {
    let turned = UvTransform { scale: Vec2::new(2.0, -1.5), rotation: 0.7, ..UvTransform::default() };
    let transform = if i.is_multiple_of(2) { UvTransform::default() } else { turned };
    (textures > 0).then(|| TextureRef { texture: texture % textures, uv_set: (i % 2) as u32, transform })
}

/// The metallic-rough materials of a stage.
fn metal_roughs(s: &mut Stage) -> impl Iterator<Item = &mut MetalRough> {
    s.scene.materials.iter_mut().filter_map(|material| match &mut material.reflection {
        Reflection::MetalRough(m) => Some(m),
        Reflection::Phong(_) | Reflection::Unlit => None,
    })
}

/// `s` with further lobes on metallic-rough materials, one or several each; their maps and those of reflectance use `textures`
/// textures.
fn lobed(mut s: Stage, textures: u32) -> Stage {
    let map = |i, texture| lobe_map(textures, i, texture);
    let matters = metal_roughs(&mut s);
    let mut panes = 0;
    for (i, m) in matters.enumerate() {
        let has = |lobe: usize| i == lobe || i == lobe + 1 || i >= 5;
        m.coat = has(0).then(|| {
            let (strength_map, roughness_map) = (map(i, 0), map(i, 1).filter(|_| i > 0));
            let roughness = if i == 0 { 0.04 } else { 0.5 };
            let normal_map = map(i, 2).filter(|_| i != 1);
            Box::new(Coat { strength: 0.8, strength_map, roughness, roughness_map, normal_map, normal_scale: 0.6 })
        });
        m.sheen = has(1).then(|| {
            let (color, color_map) = (Vec3::new(0.5, 0.9, 0.2), map(i, 1));
            Box::new(Sheen { color, color_map, roughness: 0.4, roughness_map: map(i, 1).filter(|_| i > 1) })
        });
        m.iridescence = has(2).then(|| {
            let (strength_map, thickness_map) = (map(i, 2), map(i, 0));
            Box::new(Iridescence { strength: 0.9, strength_map, ior: 1.4, thickness: [120.0, 480.0], thickness_map })
        });
        m.anisotropy =
            has(3).then(|| Box::new(Anisotropy { strength: 0.7, rotation: 0.3, map: map(i, 0).filter(|_| i != 3) }));
        m.diffuse_transmission = (m.transmission == 0.0 && i % 2 == 0).then(|| {
            let (color, color_map) = (Vec3::new(0.9, 0.6, 0.3), map(i, 1));
            Box::new(DiffuseTransmission { share: 0.7, share_map: map(i, 2).filter(|_| i > 0), color, color_map })
        });
        let pane = m.thick && m.transmission > 0.0;
        (m.specular, m.specular_map) = (0.7, map(i, 1).filter(|_| pane || i % 3 == 0));
        m.specular_color_map = map(i, 2).filter(|_| pane || i % 3 == 1);
        // On every other pane, backs reflect as these maps say, too.
        panes += usize::from(pane);
        m.ior = if pane && panes % 2 == 0 { 0.0 } else { m.ior };
    }
    s
}

#[test]
fn lobes_shaded_side_by_side_have_the_bits_of_lobes_shaded_one_by_one() {
    let cases = [
        (Environment::Studio, 0, 1, None),
        (Environment::Studio, 3, 1, None),
        (Environment::Black, 3, 1, None),
        (Environment::Constant(Vec3::splat(0.2)), 3, 0, None),
        (Environment::Studio, 3, 5, Some(2)),
    ];
    for (environment, textures, depth, env_rays) in cases {
        let stage = if textures > 0 { painted() } else { plain() };
        // Rough glass blurs the surfaces seen through it.
        let mut s = lobed(if depth > 1 { glazed(stage, 3) } else { stage }, textures);
        for light in &mut s.scene.lights {
            light.size = if depth > 1 { 0.2 } else { 0.0 };
        }
        (s.settings.depth, s.settings.env_rays, s.scene.environment) = (Some(depth), env_rays, environment);
        let store = TextureStore::new(&s.scene);
        let beside = |m: &&Material| {
            MaterialConstants::of(0, m, &store, true, Gloss::new(None))
                .is_some_and(|constants| constants.lobes.is_some())
        };
        assert!(s.scene.materials.iter().filter(beside).count() >= 5, "nothing would be compared");
        same_one_by_one(&mut s, &format!("{textures} textures, depth {depth}"));
    }
}

/// `s` with sheen and clear coat alone on metallic-rough materials, one or both, smooth and rough, with maps of `textures`
/// textures.
fn overlaid(mut s: Stage, textures: u32) -> Stage {
    let map = |i, texture| lobe_map(textures, i, texture);
    let matters = metal_roughs(&mut s);
    for (i, m) in matters.enumerate() {
        (m.specular_map, m.specular_color_map) = (None, None);
        m.coat = (i % 3 != 0).then(|| {
            let (strength_map, normal_map) = (map(i, 0), map(i, 2).filter(|_| i % 2 == 0));
            let (roughness, roughness_map) = ([0.04, 0.3, 0.7][i % 3], map(i, 1).filter(|_| i % 4 != 1));
            Box::new(Coat { strength: 0.8, strength_map, roughness, roughness_map, normal_map, normal_scale: 0.6 })
        });
        m.sheen = (i % 3 != 1).then(|| {
            let (color_map, roughness_map) = (map(i, 1), map(i, 2));
            Box::new(Sheen { color: Vec3::new(0.5, 0.9, 0.0), color_map, roughness: 0.7, roughness_map })
        });
    }
    s
}

#[test]
fn sheen_and_coat_over_points_side_by_side_have_the_bits_of_those_over_points_one_by_one() {
    let cases = [
        (Environment::Studio, 0, 1, None),
        (Environment::Studio, 3, 1, None),
        (Environment::Black, 3, 1, None),
        (Environment::Constant(Vec3::splat(0.2)), 3, 0, None),
        (Environment::Studio, 3, 3, None),
        (Environment::Studio, 3, 3, Some(2)),
        (Environment::Panorama, 3, 2, Some(0)),
    ];
    for (k, (environment, textures, depth, env_rays)) in cases.into_iter().enumerate() {
        let stage = if textures > 0 { painted() } else { plain() };
        // Rough glass blurs the surfaces seen through it.
        let mut s = overlaid(if depth > 1 { glazed(stage, 3) } else { stage }, textures);
        // In some cases also by rays.
        s.settings.gloss_rays = (k % 2 == 1).then_some(2);
        let texels = (0..32 * 16).map(|i| [0.1 * (i % 9) as f32, 0.5, if i == 99 { 40.0 } else { 0.2 }]).collect();
        s.scene.panorama = Some(Panorama { width: 32, height: 16, texels: Arc::new(texels), ..Panorama::default() });
        for light in &mut s.scene.lights {
            light.size = if depth > 1 { 0.2 } else { 0.0 };
        }
        s.scene.ambient = Vec3::new(0.1, 0.0, 0.05);
        (s.settings.depth, s.settings.env_rays, s.scene.environment) = (Some(depth), env_rays, environment);
        let store = TextureStore::new(&s.scene);
        let are_overlays = |m: &&Material| {
            let constants = MaterialConstants::of(0, m, &store, true, Gloss::new(None));
            constants.and_then(|constants| constants.lobes).is_some_and(|lobes| lobes.are_overlays)
        };
        assert!(s.scene.materials.iter().filter(are_overlays).count() >= 4, "nothing would be compared");
        same_one_by_one(&mut s, &format!("{textures} textures, depth {depth}"));
    }
}

#[test]
fn rough_surfaces_that_spread_rays_have_the_same_bits_side_by_side() {
    for (textures, depth) in [(0, 2), (3, 1), (3, 3)] {
        let mut s = if textures > 0 { lobed(painted(), textures) } else { plain() };
        s.settings = Settings { gloss_rays: Some(2), depth: Some(depth), samples: 2, ..s.settings };
        s.scene.environment = Environment::Studio;
        let store = TextureStore::new(&s.scene);
        let beside = |m: &&Material| {
            MaterialConstants::of(0, m, &store, true, Gloss::new(Some(2))).is_some_and(|constants| constants.spreads)
        };
        assert!(s.scene.materials.iter().filter(beside).count() >= 5, "nothing would be compared");
        let together = same_one_by_one(&mut s, &format!("{textures} textures, depth {depth}"));
        assert!(together.counts.reflected.queries > 2000, "{:?}", together.counts.reflected);
    }
}

#[test]
fn where_more_rays_wait_than_are_traced_together_points_side_by_side_have_the_same_bits() {
    let mut s = glazed(plain(), 0);
    for material in &mut s.scene.materials {
        if let Reflection::MetalRough(m) = &mut material.reflection {
            m.dispersion = if m.thick { 4.0 } else { 0.0 };
        }
    }
    s.scene.environment = Environment::Studio;
    s.settings = Settings { width: 240, height: 180, samples: 8, depth: Some(6), cutoff: 1.0 / 512.0, ..s.settings };
    let together = s.render_by(AccelKind::DEFAULT);
    s.settings.one_by_one = true;
    let alone = s.render_by(AccelKind::DEFAULT);
    assert!(together.counts.refracted.queries > 500_000, "{:?}", together.counts.refracted);
    assert_eq!(together.counts, alone.counts);
    let differ = together.picture.beauty.iter().zip(&alone.picture.beauty).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "pixels");
    assert!(together.picture.layers == alone.picture.layers, "layers");
}

#[test]
fn points_that_look_around_by_rays_have_the_same_bits_side_by_side() {
    let mut random = Random::new(12);
    let texels = Arc::new((0..32 * 16).map(|_| [(); 3].map(|()| random.unit() * 2.0)).collect::<Vec<_>>());
    let panorama =
        Panorama { name: String::new(), width: 32, height: 16, texels, rotation: 0.3, ..Panorama::default() };
    for (environment, rays) in
        [(Environment::Panorama, None), (Environment::Panorama, Some(0)), (Environment::Studio, Some(4))]
    {
        let mut s = glazed(painted(), 3);
        (s.scene.environment, s.scene.panorama, s.settings.env_rays) = (environment, Some(panorama.clone()), rays);
        same_one_by_one(&mut s, &format!("{environment:?}, {rays:?} rays"));
    }
}

#[test]
fn wide_lights_light_points_side_by_side_as_they_light_them_one_by_one() {
    let sequence = Sampling::Stochastic(Stochastic { min_samples: 4, max_samples: 4, ..Stochastic::default() });
    // Three samples of each light, and one of each seen in mirrors; so many that rays wait for each other more than once.
    for (sampling, light_rays, mut s) in [(Sampling::Uniform, 9), (sequence, 12), (Sampling::Uniform, 90)]
        .into_iter()
        .flat_map(|(sampling, rays)| [plain(), painted(), glazed(painted(), 3)].map(|stage| (sampling, rays, stage)))
    {
        s.scene.lights.iter_mut().for_each(|light| light.size = 0.2);
        let sides = [DVec3::X * 0.8, DVec3::Z * -0.8];
        let kind = LightKind::Rectangle { position: DVec3::new(0.5, 3.5, 1.0), sides, falloff: Falloff::None };
        let intensity = Vec3::new(0.4, 0.3, 0.2);
        s.scene.lights.push(Light { name: String::new(), intensity, kind, shadows: true, size: 0.0 });
        // Its light needs no shadow rays.
        s.lamp(DVec3::new(-2.0, 3.0, 2.0), 0.2);
        s.scene.lights.last_mut().into_iter().for_each(|light| light.shadows = false);
        (s.settings.sampling, s.settings.light_rays) = (sampling, light_rays);
        let together = same_one_by_one(&mut s, &format!("{sampling:?}, {light_rays} rays"));
        assert!(2 * together.counts.shadow.queries > 3 * together.counts.primary.queries, "{:?}", together.counts);
    }
}
