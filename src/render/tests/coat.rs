//! Clear coat and anisotropy over surfaces with normal maps.

use super::*;
use crate::accel::{Accel, Hit, NO_PRIM, NoProbe, Ray};
use crate::math::Vec2;
use crate::render::surface::{HitPrim, Surface};
use crate::scene::{Bitmap, Coat, Filter, MetalRough, Pixels, Sampler, Texture, TextureRef, UvTransform, Wrap};

/// The whole of the first texture.
fn map() -> TextureRef {
    TextureRef { texture: 0, uv_set: 0, transform: UvTransform { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE } }
}

/// A square that shows nothing but smooth clear coat, seen face on under a light that shines along `direction`; its base has a
/// normal map of these two texels, if given.
fn coated(normals: Option<[[u8; 3]; 2]>, direction: DVec3) -> Stage {
    let mut s = looking_down(3.0);
    let coat = Coat {
        strength: 1.0,
        strength_map: None,
        roughness: 0.1,
        roughness_map: None,
        normal_map: None,
        normal_scale: 1.0,
    };
    let black = MetalRough {
        metallic: 0.0,
        roughness: 1.0,
        specular: 0.0,
        coat: Some(Box::new(coat)),
        ..MetalRough::default()
    };
    let material = Material {
        base_color: Vec3::ZERO,
        reflection: Reflection::MetalRough(black),
        normal_map: normals.map(|_| map()),
        ..Material::plain()
    };
    let uvs = vec![vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO]];
    s.mesh(Mesh { uvs, ..square(0.0, 4.0) }, DAffine3::IDENTITY, material);
    if let Some(normals) = normals {
        let pixels = Pixels::Rgb8(normals.concat().into());
        s.scene.bitmaps.push(Bitmap { name: String::new(), width: 2, height: 1, pixels });
        let sampler = Sampler { magnify: Filter::Nearest, wrap_u: Wrap::Repeat, ..Sampler::default() };
        s.scene.textures.push(Texture { bitmap: 0, sampler });
    }
    let kind = LightKind::Directional { direction };
    s.scene.lights.push(Light { name: String::new(), intensity: Vec3::ONE, kind, shadows: false, size: 0.0 });
    s.settings.depth = Some(0);
    s
}

/// Normals that lean 60° to either side.
const LEANING: [[u8; 3]; 2] = [[238, 128, 191], [17, 128, 191]];

#[test]
fn a_highlight_of_coat_is_as_wide_whatever_the_surface_under_it_is() {
    let plain = coated(None, DVec3::NEG_Z).color();
    assert!(plain.x > 1.0, "{plain}");
    assert_near(coated(Some(LEANING), DVec3::NEG_Z).color(), plain, 1e-5 * plain.x);
}

#[test]
fn coat_shines_where_the_surface_under_it_turns_away_from_the_light() {
    let steep = DVec3::new(0.7, 0.0, -0.7);
    let seen = |normals| {
        let mut s = coated(normals, steep);
        s.view = View::look_at(DVec3::new(3.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, Lens::orthographic(1.0));
        s.color()
    };
    let plain = seen(None);
    assert!(plain.x > 0.1, "{plain}");
    for normals in [LEANING, [LEANING[1], LEANING[0]]] {
        assert_near(seen(Some(normals)), plain, 1e-5);
    }
}

#[test]
fn the_back_of_a_face_has_the_coat_and_the_grain_of_its_front() {
    let s = coated(Some([[230, 170, 200]; 2]), DVec3::NEG_Z);
    let from = |side: f32| {
        s.with_job(AccelKind::None, |job| {
            let dir = Vec3::new(0.1, 0.2, -side);
            let origin = Vec3::new(0.2, 0.3, 0.0) - dir;
            let ray = Ray { origin, t_min: 0.0, dir, t_max: 9.0, exclude: NO_PRIM, sample: 0 };
            let mut hit = [Hit::MISS];
            job.accel.closest(&[ray], &mut hit, &mut job.accel.scratch(), &mut NoProbe);
            let mut surface =
                Surface::new(job.world, HitPrim::new(job.scene, job.world, hit[0].prim), &ray, &hit[0], 0.0);
            surface.shade_smoothly(job.textures);
            let on = surface.lobe_frame();
            (on.coat_normal(Some(&map()), 1.0, job.textures), on.tangents(None))
        })
    };
    let ((front, ahead), (back, behind)) = (from(1.0), from(-1.0));
    assert!(front.x > 0.3 && front.y.abs() > 0.1, "{front}");
    assert_near(back, -front, 1e-6);
    ahead.into_iter().zip(behind).for_each(|(a, b)| assert_near(a, b, 1e-5));
}
