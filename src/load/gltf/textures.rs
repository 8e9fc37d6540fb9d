//! Texture slots of materials -> textures of the scene, without duplicates.

use super::images::image_of;
use crate::math::Vec2;
use crate::scene::{Bitmap, Filter, Material, Mipmaps, Reflection, Sampler, Texture, TextureRef, UvTransform, Wrap};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::texture::{self, MagFilter, MinFilter, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use std::collections::{BTreeSet, HashMap};
use std::hash::Hash;

/// Collects the textures of materials.
pub(super) struct Textures<'a> {
    root: &'a Root,
    /// Textures of the scene; `bitmap` is an index into `pictures`.
    pub(super) list: Vec<Texture>,
    /// Sources of the bitmaps, in their order.
    pub(super) pictures: Vec<Picture>,
    /// Requested textures of the file that have no image.
    pub(super) without_image: BTreeSet<usize>,
    /// Index of each texture and picture in its list.
    known_textures: HashMap<Texture, u32>,
    known_pictures: HashMap<Picture, u32>,
}

/// Source of a bitmap: an image of the file, whose alpha channel may be glossiness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Picture {
    pub(super) image: usize,
    /// For a roughness map made from an alpha channel of glossiness: the bits of the glossiness factor.
    gloss: Option<u32>,
}

impl Picture {
    /// Glossiness factor, if the bitmap is a roughness map.
    pub(super) fn gloss(self) -> Option<f32> {
        self.gloss.map(f32::from_bits)
    }
}

impl<'a> Textures<'a> {
    pub(super) fn new(root: &'a Root) -> Self {
        let (known_textures, known_pictures) = (HashMap::new(), HashMap::new());
        let (list, pictures, without_image) = (Vec::new(), Vec::new(), BTreeSet::new());
        Self { root, list, pictures, without_image, known_textures, known_pictures }
    }

    /// Texture of a slot; `None` when it has no image.
    pub(super) fn of(
        &mut self,
        index: Index<texture::Texture>,
        uv_set: u32,
        transform: Option<&TextureTransform>,
    ) -> Option<TextureRef> {
        self.shown(index, uv_set, transform, None)
    }

    fn shown(
        &mut self,
        index: Index<texture::Texture>,
        uv_set: u32,
        transform: Option<&TextureTransform>,
        gloss: Option<u32>,
    ) -> Option<TextureRef> {
        let Some(image) = image_of(self.root, index) else {
            self.without_image.insert(index.value());
            return None;
        };
        let picture = Picture { image, gloss };
        let sampler = self.root.textures.get(index.value())?.sampler;
        let sampler = sampler.and_then(|s| self.root.samplers.get(s.value())).map(sampler_of).unwrap_or_default();
        let bitmap = number_of(picture, &mut self.pictures, &mut self.known_pictures);
        let texture = number_of(Texture { bitmap, sampler }, &mut self.list, &mut self.known_textures);
        let uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(uv_set);
        Some(TextureRef { texture, uv_set, transform: transform.map(transform_of).unwrap_or_default() })
    }

    /// Texture of a plain slot.
    pub(super) fn info(&mut self, info: Option<&texture::Info>) -> Option<TextureRef> {
        self.info_shown(info?, None)
    }

    /// Roughness map from a plain slot, whose alpha channel times the factor `gloss` is the glossiness.
    pub(super) fn roughness(&mut self, info: Option<&texture::Info>, gloss: f32) -> Option<TextureRef> {
        self.info_shown(info?, Some(gloss.to_bits()))
    }

    fn info_shown(&mut self, info: &texture::Info, gloss: Option<u32>) -> Option<TextureRef> {
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.shown(info.index, info.tex_coord, transform, gloss)
    }
}

/// Index of a value in a list, to which new values are appended.
fn number_of<T: Clone + Eq + Hash>(value: T, list: &mut Vec<T>, known: &mut HashMap<T, u32>) -> u32 {
    *known.entry(value).or_insert_with_key(|value| {
        list.push(value.clone());
        // A file with more entries would exceed every size limit.
        u32::try_from(list.len() - 1).unwrap_or(u32::MAX)
    })
}

/// Converts KHR_texture_transform; numbers that are not finite count as the identity.
pub(super) fn transform_of(transform: &TextureTransform) -> UvTransform {
    let finite = |v: Vec2, otherwise: Vec2| if v.is_finite() { v } else { otherwise };
    UvTransform {
        offset: finite(Vec2::from(transform.offset.0), Vec2::ZERO),
        rotation: if transform.rotation.0.is_finite() { transform.rotation.0 } else { 0.0 },
        scale: finite(Vec2::from(transform.scale.0), Vec2::ONE),
    }
}

fn sampler_of(sampler: &texture::Sampler) -> Sampler {
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    };
    let magnify = match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Linear,
    };
    let (minify, mipmaps) = match sampler.min_filter {
        Some(Checked::Valid(filter)) => match filter {
            MinFilter::Nearest => (Filter::Nearest, Mipmaps::None),
            MinFilter::Linear => (Filter::Linear, Mipmaps::None),
            MinFilter::NearestMipmapNearest => (Filter::Nearest, Mipmaps::Nearest),
            MinFilter::LinearMipmapNearest => (Filter::Linear, Mipmaps::Nearest),
            MinFilter::NearestMipmapLinear => (Filter::Nearest, Mipmaps::Linear),
            MinFilter::LinearMipmapLinear => (Filter::Linear, Mipmaps::Linear),
        },
        _ => (Filter::Linear, Mipmaps::Linear),
    };
    Sampler { wrap_u: wrap(sampler.wrap_s), wrap_v: wrap(sampler.wrap_t), magnify, minify, mipmaps }
}

/// Drops textures whose image could not be decoded, and renumbers the others in the materials.
pub(super) fn keep_decoded(
    materials: &mut [Material],
    textures: Vec<Texture>,
    pictures: &[Picture],
    bitmaps: Vec<Option<Bitmap>>,
) -> (Vec<Texture>, Vec<Bitmap>) {
    for material in materials.iter_mut() {
        without_lost_gloss(material, &textures, pictures, &bitmaps);
    }
    let mut next = 0;
    let number = |there: bool, next: &mut u32| there.then(|| (*next, *next += 1).0);
    let new_bitmap: Vec<_> = bitmaps.iter().map(|b| number(b.is_some(), &mut next)).collect();
    let bitmap_of = |t: &Texture| new_bitmap.get(t.bitmap as usize).copied().flatten();
    next = 0;
    let new_texture: Vec<_> = textures.iter().map(|t| number(bitmap_of(t).is_some(), &mut next)).collect();
    for map in materials.iter_mut().flat_map(Material::textures_mut) {
        *map =
            map.take().and_then(|r| Some(TextureRef { texture: new_texture.get(r.texture as usize).copied()??, ..r }));
    }
    let kept = textures.iter().filter_map(|t| Some(Texture { bitmap: bitmap_of(t)?, ..t.clone() })).collect();
    (kept, bitmaps.into_iter().flatten().collect())
}

/// Replaces the roughness of a material whose glossiness map is lost by that of the glossiness factor alone.
fn without_lost_gloss(material: &mut Material, textures: &[Texture], pictures: &[Picture], bitmaps: &[Option<Bitmap>]) {
    let Reflection::MetalRough(surface) = &mut material.reflection else { return };
    let map = surface.metal_rough_map.as_ref();
    let bitmap = map.and_then(|map| Some(textures.get(map.texture as usize)?.bitmap as usize));
    let lost =
        bitmap.filter(|&at| bitmaps.get(at).is_none_or(Option::is_none)).and_then(|at| pictures.get(at)?.gloss());
    if let Some(gloss) = lost {
        surface.roughness = 1.0 - gloss;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_whose_image_is_lost_are_left_out_and_the_others_renumbered() {
        let reference = |texture| Some(TextureRef { texture, uv_set: 0, transform: UvTransform::default() });
        let mut materials = [Material {
            base_color_map: reference(0),
            normal_map: reference(1),
            emission_map: reference(2),
            ..Material::default()
        }];
        let texture = |bitmap, wrap_u| Texture { bitmap, sampler: Sampler { wrap_u, ..Sampler::default() } };
        let textures = vec![texture(0, Wrap::Repeat), texture(1, Wrap::Repeat), texture(1, Wrap::Clamp)];
        let (textures, bitmaps) = keep_decoded(&mut materials, textures, &[], vec![None, Some(Bitmap::default())]);
        assert_eq!((textures.len(), bitmaps.len()), (2, 1));
        assert!(textures.iter().all(|t| t.bitmap == 0));
        assert!(materials[0].base_color_map.is_none());
        assert_eq!(materials[0].normal_map.as_ref().unwrap().texture, 0);
        assert_eq!(materials[0].emission_map.as_ref().unwrap().texture, 1);
    }

    #[test]
    fn a_hundred_thousand_textures_are_each_found_again() {
        const MANY: u32 = 100_000;
        let all = |one: &dyn Fn(u32) -> serde_json::Value| (0..MANY).map(one).collect::<Vec<_>>();
        let root = serde_json::from_value(serde_json::json!({
            "asset": {"version": "2.0"},
            "images": all(&|_| serde_json::json!({})),
            "textures": all(&|i| serde_json::json!({"source": i})),
        }));
        let root = root.unwrap();
        let mut textures = Textures::new(&root);
        for i in (0..MANY).chain((0..MANY).rev()) {
            let found = textures.of(Index::new(i), 0, None).unwrap();
            assert_eq!(found.texture, i);
        }
        assert_eq!((textures.list.len(), textures.pictures.len()), (MANY as usize, MANY as usize));
    }
}
