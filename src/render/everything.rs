//! Rendering with every code path on: what a scene does without is done all the same, and what comes of it thrown away.
//!
//! The picture stays what it is, bit for bit; what leaving things out saves is the difference in time. Done in vain are:
//!
//! - for each shadow ray: no prim counts as opaque, so that none ends the ray, and each that it meets is asked what it lets
//!   through ([`World::with_everything`](super::World::with_everything));
//! - at each point: the lookup of every map that its material lacks, in a map of the program's own
//!   ([`TextureStore::with_everything`](super::texture::TextureStore::with_everything)), with normal and bump mapping;
//! - at each point where rays end: the balance of what is reflected and refracted, and its spectrum.

use super::surface::{Footprint, Patch};
use super::texture::{ColorSpace, STAND_IN, TextureStore};
use crate::math::{Vec2, Vec3};
use crate::scene::{Bitmap, Material, Pixels, TextureRef, UvTransform};
use std::hint::black_box;
use std::sync::LazyLock;

/// A material that has the maps others lack.
static MAPPED: LazyLock<Material> =
    LazyLock::new(|| Material { normal_map: Some(stand_in()), bump_map: Some(stand_in()), ..Material::default() });

/// A map that is grey everywhere, as large as maps of small files are.
pub(super) static GREY: LazyLock<Bitmap> = LazyLock::new(|| Bitmap {
    name: String::new(),
    width: 256,
    height: 256,
    pixels: Pixels::Rgba8(vec![[128, 128, 255, 255]; 256 * 256]),
});

const fn stand_in() -> TextureRef {
    TextureRef {
        texture: STAND_IN,
        uv_set: 0,
        transform: UvTransform { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE },
    }
}

/// Reads a map that is not there.
#[cold]
pub(super) fn read_in_vain(store: &TextureStore, patch: &Patch, space: ColorSpace, footprint: &Footprint) {
    black_box(patch.texel(&stand_in(), space, store, footprint));
}

/// Turns a normal by those maps that `material` lacks.
#[cold]
pub(super) fn turn_in_vain(store: &TextureStore, patch: &Patch, normal: Vec3, material: &Material, print: &Footprint) {
    if material.normal_map.is_none() {
        black_box(patch.normal_mapped(normal, &MAPPED, store, print));
    }
    if material.bump_map.is_none() {
        black_box(patch.bumped(normal, &MAPPED, store, print));
    }
}
