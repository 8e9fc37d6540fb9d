//! Rendering with every code path on: work that a scene does not need is done all the same, and its results are discarded.
//!
//! The picture stays the same, bit for bit; the difference in time is what pruning saves. Done in vain are:
//!
//! - for each shadow ray: no prim counts as opaque, so that none ends the ray, and each prim that it hits is queried for its
//!   transmittance ([`World::without_pruning`](super::World::without_pruning));
//! - at each point: the lookup of every map that its material lacks, in a built-in map
//!   ([`TextureStore::without_pruning`](super::texture::TextureStore::without_pruning)), with normal and bump mapping;
//! - at each point: the absorption on the way to it, by materials that absorb nothing;
//! - at each point where rays end: the weights of reflection and refraction, and their spectrum.
//!
//! Points are shaded one by one, because the batches have no such code.
//!
//! Anisotropy, iridescence, sheen, clear coat and diffuse transmission are left out: a material without them has no work to do
//! for them.

use super::surface::Surface;
use super::texture::{ColorSpace, STAND_IN, TextureStore};
use crate::math::Vec2;
use crate::scene::{Bitmap, Material, Pixels, Reflection, TextureRef, UvTransform};
use std::hint::black_box;
use std::sync::LazyLock;

/// A material with a bump map, for materials that lack one.
static BUMPED: LazyLock<Material> = LazyLock::new(|| Material { bump_map: Some(stand_in()), ..Material::default() });

/// A uniformly grey map, as large as maps of small files are.
pub(super) static GREY: LazyLock<Bitmap> = LazyLock::new(|| Bitmap {
    name: String::new(),
    width: 256,
    height: 256,
    pixels: Pixels::Rgba8(vec![[128, 128, 255, 255]; 256 * 256].into()),
});

const fn stand_in() -> TextureRef {
    TextureRef {
        texture: STAND_IN,
        uv_set: 0,
        transform: UvTransform { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE },
    }
}

/// Looks up every map that the material at a point lacks, and perturbs the normal by the normal and bump maps.
#[cold]
pub(super) fn look_up_in_vain(surface: &Surface, store: &TextureStore) {
    let (Some(patch), material) = (&surface.patch, surface.target.material) else {
        return;
    };
    let m = material;
    let mut maps = vec![&m.base_color_map, &m.opacity_map, &m.emission_map, &m.occlusion_map];
    match &m.reflection {
        Reflection::Unlit => {}
        Reflection::Phong(p) => maps.extend([&p.ambient_map, &p.specular_map, &p.shininess_map]),
        Reflection::MetalRough(p) => {
            let optical = [&p.transmission_map, &p.thickness_map];
            maps.extend([&p.metal_rough_map, &p.specular_map, &p.specular_color_map].into_iter().chain(optical));
        }
    }
    for _ in maps.iter().filter(|map| map.is_none()) {
        black_box(patch.texel(&stand_in(), ColorSpace::Srgb, store));
    }
    if m.normal_map.is_none() {
        black_box(patch.normal_mapped(surface.geometric, &stand_in(), 1.0, store));
    }
    if m.bump_map.is_none() {
        black_box(patch.bumped(surface.geometric, &BUMPED, store));
    }
}
