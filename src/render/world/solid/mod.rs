//! Triangles of see-through materials that are opaque all the same: no texel read on them is transparent, and no vertex colour
//! is.
//!
//! Many programs mark a whole material as blended or cut out where little of it is: one leaf in an atlas, or nothing at all.
//! Triangles known to be opaque need no test at every hit.

mod blocks;

use crate::accel::BitSet;
use crate::math::Vec4;
use crate::render::patch::coordinates_at;
use crate::scene::{AlphaMode, Material, Mesh, Scene, TextureRef, Wrap};
pub(in crate::render) use blocks::code;
use blocks::{Blocks, Extremes, FARTHEST};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// Opaque faces of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Solid {
    /// All.
    All,
    /// The triangles whose bit is set.
    Some(BitSet),
    /// None.
    None,
}

/// Opaque faces of each mesh of a scene; where textures are missing, none counts as opaque.
pub(super) fn solids(scene: &Scene) -> Vec<Solid> {
    let mut known = BlockTables { scene, extremes: HashMap::new(), blocks: HashMap::new() };
    let mut layers: Vec<Option<Option<Vec<Layer>>>> = scene.materials.iter().map(|_| None).collect();
    let of = |mesh: &Mesh| {
        let number = mesh.material as usize;
        let material = &scene.materials[number];
        if material.is_opaque() {
            return Solid::All;
        }
        let layers = layers[number].get_or_insert_with(|| known.layers(material));
        layers.as_ref().map_or(Solid::None, |layers| solid(mesh, layers))
    };
    scene.meshes.iter().map(of).collect()
}

/// A map, with its blocks whose values let no light through.
struct Layer {
    map: TextureRef,
    wrap: [Wrap; 2],
    blocks: Arc<Blocks>,
}

/// Cache of block tables of bitmaps: materials often share them.
struct BlockTables<'a> {
    scene: &'a Scene,
    /// By bitmap and channel.
    extremes: HashMap<(u32, usize), Option<Extremes>>,
    /// By bitmap, channel, and the bits of the range that counts as solid.
    blocks: HashMap<(u32, usize, [u32; 2]), Option<Arc<Blocks>>>,
}

impl BlockTables<'_> {
    /// Maps of a material whose faces are opaque where all these maps are solid and vertex colours are too; `None` where no face
    /// is opaque, or where that is unknown.
    fn layers(&mut self, material: &Material) -> Option<Vec<Layer>> {
        let least = least(material)?;
        let mut maps = Vec::new();
        if material.alpha_mode != AlphaMode::Opaque {
            maps.extend([(&material.base_color_map, ALPHA, [least, 1.0]), (&material.opacity_map, RED, [1.0; 2])]);
        }
        if material.reflection.transmits() {
            // Glass is opaque where its transmission map is 0.
            let map = &material.metal_rough()?.transmission_map;
            map.as_ref()?;
            maps.push((map, RED, [0.0; 2]));
        }
        maps.into_iter().filter_map(|(map, channel, range)| Some(self.layer(map.as_ref()?, channel, range))).collect()
    }

    fn layer(&mut self, map: &TextureRef, channel: usize, range: [f32; 2]) -> Option<Layer> {
        let texture = self.scene.textures.get(map.texture as usize)?;
        let bitmap = self.scene.bitmaps.get(texture.bitmap as usize)?;
        let extremes = self.extremes.entry((texture.bitmap, channel)).or_insert_with(|| Extremes::of(bitmap, channel));
        let blocks = self.blocks.entry((texture.bitmap, channel, range.map(f32::to_bits)));
        let blocks = blocks.or_insert_with(|| Some(Arc::new(extremes.as_ref()?.blocks(range))));
        Some(Layer {
            map: *map,
            wrap: [texture.sampler.wrap_u, texture.sampler.wrap_v],
            blocks: Arc::clone(blocks.as_ref()?),
        })
    }
}

const RED: usize = 0;
const ALPHA: usize = 3;

/// Smallest alpha of the base colour map, 0 … 1, with which a material is opaque; `None` if none suffices.
pub(in crate::render) fn least(material: &Material) -> Option<f32> {
    /// Bound of the rounding of the mean of four texels, relative.
    const ROUNDING: f32 = 1e-5;
    let opacity = material.opacity;
    let least = match material.alpha_mode {
        AlphaMode::Opaque => 0.0,
        AlphaMode::Mask { cutoff } if opacity >= cutoff => (cutoff / opacity * (1.0 + ROUNDING)).clamp(0.0, 1.0),
        AlphaMode::Blend if opacity >= 1.0 => 1.0,
        AlphaMode::Mask { .. } | AlphaMode::Blend => return None,
    };
    // An opacity of 0 that passes the cutoff passes it with any alpha.
    Some(if least.is_nan() { 0.0 } else { least })
}

fn solid(mesh: &Mesh, layers: &[Layer]) -> Solid {
    let everywhere = layers.iter().all(|layer| layer.blocks.are_solid());
    if everywhere && mesh.colors.is_empty() && mesh.polygons.is_empty() {
        return Solid::All;
    }
    let colors = |corners: &[u32; 3]| {
        let color = |i: u32| mesh.colors.get(i as usize).copied().unwrap_or(Vec4::ONE);
        corners.iter().all(|&i| color(i).w == 1.0)
    };
    let is_solid = |corners: &[u32; 3]| colors(corners) && layers.iter().all(|layer| layer.is_solid_on(mesh, *corners));
    let all: Vec<bool> = mesh.triangles.par_iter().with_min_len(TRIANGLES).map(is_solid).collect();
    if mesh.polygons.is_empty() && all.iter().all(|&solid| solid) {
        return Solid::All;
    }
    if !all.contains(&true) {
        return Solid::None;
    }
    let mut bits = BitSet::filled(all.len(), false);
    (0..).zip(&all).filter(|(_, solid)| **solid).for_each(|(i, _)| bits.set(i, true));
    Solid::Some(bits)
}

/// Triangles that are worth a thread of their own.
const TRIANGLES: usize = 1 << 12;

impl Layer {
    /// Whether all texels read on a triangle are solid.
    fn is_solid_on(&self, mesh: &Mesh, corners: [u32; 3]) -> bool {
        if self.blocks.are_solid() {
            return true;
        }
        let Some((_, uvs)) = coordinates_at(mesh, corners, [0.0; 3], &self.map) else { return false };
        // Distant coordinates are rounded by more than a texel, even where an offset brings them back.
        if !uvs.iter().all(|uv| uv.abs().max_element() <= FARTHEST) {
            return false;
        }
        let [a, b, c] = uvs.map(|uv| uv + self.map.transform.offset);
        self.blocks.are_solid_between(a.min(b).min(c), a.max(b).max(c), self.wrap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::math::{Vec2, Vec3};
    use crate::render::texture::TextureStore;
    use crate::scene::{Bitmap, Filter, MetalRough, Phong, Pixels, Reflection, Sampler, Texture, UvTransform};

    /// Mostly solid, with some holes of one or of several texels.
    fn holed(random: &mut Random, [width, height]: [usize; 2]) -> Bitmap {
        let mut texels = vec![[90, 120, 40, 255]; width * height];
        for _ in 0..3 {
            let (x, y, side) = (random.below(width), random.below(height), 1 + random.below(6));
            for (x, y) in
                (0..side * side).map(|i| (x + i % side, y + i / side)).filter(|&(x, y)| x < width && y < height)
            {
                texels[y * width + x][3] = [0, 100, 254][random.below(3)];
            }
        }
        let (width, height) = (width as u32, height as u32);
        Bitmap { name: String::new(), width, height, pixels: Pixels::Rgba8(texels.into()) }
    }

    /// Random triangles whose coordinates span up to `size`.
    fn soup(random: &mut Random, count: u32, size: f32) -> Mesh {
        let corners = (0..count).flat_map(|_| {
            let (at, reach) = (random.cube() * 3.0, size * random.unit() * random.unit());
            [(); 3].map(|()| at + random.cube() * reach)
        });
        let positions: Vec<Vec3> = corners.collect();
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh { uvs: vec![positions.iter().map(|p| p.truncate()).collect()], positions, triangles, ..Mesh::default() }
    }

    /// Scene with one mesh and one material with a map.
    fn scene(bitmap: Bitmap, sampler: Sampler, mesh: Mesh, material: Material) -> Scene {
        Scene {
            bitmaps: vec![bitmap],
            textures: vec![Texture { bitmap: 0, sampler }],
            meshes: vec![mesh],
            materials: vec![material],
            ..Scene::default()
        }
    }

    fn mapped(alpha_mode: AlphaMode, transform: UvTransform) -> Material {
        let map = TextureRef { texture: 0, uv_set: 0, transform };
        Material { alpha_mode, base_color_map: Some(map), ..Material::plain() }
    }

    #[test]
    fn nothing_that_is_read_on_a_solid_triangle_lets_light_through() {
        let mut random = Random::new(5);
        let (mut solid, mut open) = (0, 0);
        let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
        for round in 0..108 {
            let sampler = Sampler {
                wrap_u: wraps[round % 3],
                wrap_v: wraps[round / 3 % 3],
                magnify: if round % 4 == 0 { Filter::Nearest } else { Filter::Linear },
                ..Sampler::default()
            };
            let transform = match round % 2 {
                0 => UvTransform::default(),
                _ => UvTransform { offset: Vec2::new(0.7, -1.3), rotation: 0.6, scale: Vec2::new(1.5, 0.4) },
            };
            let mode = if round % 5 < 3 { AlphaMode::Blend } else { AlphaMode::Mask { cutoff: 0.5 } };
            let mut material = mapped(mode, transform);
            material.opacity = if round % 5 == 4 { 0.6 } else { 1.0 };
            let bitmap = holed(&mut random, [[64, 32], [50, 70], [7, 9]][round % 3]);
            let mesh = soup(&mut random, 60, [0.1, 0.5, 3.0][round / 9 % 3]);
            let scene = scene(bitmap, sampler, mesh, material);
            let (mesh, material) = (&scene.meshes[0], &scene.materials[0]);
            let store = TextureStore::new(&scene);
            let map = material.base_color_map.expect("it has one");
            let Solid::Some(bits) = &solids(&scene)[0] else { continue };
            for (i, &corners) in (0..).zip(&mesh.triangles) {
                if !bits.get(i) {
                    open += 1;
                    continue;
                }
                solid += 1;
                for _ in 0..100 {
                    let (u, v) = (random.unit(), random.unit());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let (uv, _) = coordinates_at(mesh, corners, [1.0 - u - v, u, v], &map).expect("coordinates");
                    let opacity = material.opacity * store.channel::<3>(map.texture, uv);
                    assert_eq!(
                        material.alpha_mode.covers(opacity),
                        1.0,
                        "round {round}, triangle {i}: {opacity} at {uv}"
                    );
                }
            }
        }
        assert!(solid > 500 && open > 500, "{solid} and {open}");
    }

    #[test]
    fn what_is_called_see_through_and_has_no_holes_is_solid() {
        let mut random = Random::new(9);
        let numbers = |count: usize, of: u8| vec![of; count];
        let of = |pixels, material: Material, colors: Option<f32>| {
            let bitmap = Bitmap { name: String::new(), width: 4, height: 2, pixels };
            let mut mesh = soup(&mut random, 3, 1.0);
            if let Some(alpha) = colors {
                mesh.colors = vec![Vec4::ONE; mesh.positions.len()];
                mesh.colors[4].w = alpha;
            }
            solids(&scene(bitmap, Sampler::default(), mesh, material)).remove(0)
        };
        let mut of = of;
        let blend = || mapped(AlphaMode::Blend, UvTransform::default());
        let rgb = || Pixels::Rgb8(numbers(24, 7).into());
        assert_eq!(of(rgb(), blend(), None), Solid::All, "no alpha");
        assert_eq!(of(Pixels::Rgba8(vec![[9, 9, 9, 255]; 8].into()), blend(), None), Solid::All);
        assert_eq!(of(Pixels::Rgba16(vec![[9, 9, 9, 65535]; 8].into()), blend(), None), Solid::All);
        assert_eq!(of(Pixels::Rgba16(vec![[9, 9, 9, 65534]; 8].into()), blend(), None), Solid::None);
        assert_eq!(of(Pixels::Rgba8(vec![[9, 9, 9, 254]; 8].into()), blend(), None), Solid::None);
        assert_eq!(of(Pixels::Rgba8(Vec::new().into()), blend(), None), Solid::None, "not there yet");
        assert_eq!(of(Pixels::Rgb8(Vec::new().into()), blend(), None), Solid::None, "not there yet");
        assert_eq!(of(rgb(), blend(), Some(1.0)), Solid::All);
        let Solid::Some(bits) = of(rgb(), blend(), Some(0.9)) else { panic!("one corner is not solid") };
        assert_eq!([0, 1, 2].map(|i| bits.get(i)), [true, false, true]);
        assert_eq!(of(rgb(), Material { opacity: 0.99, ..blend() }, None), Solid::None);
        let glass = Reflection::Phong(Phong { transmission: Vec3::X, ..Phong::default() });
        assert_eq!(of(rgb(), Material { reflection: glass, ..blend() }, None), Solid::None);
        // An opacity map counts by its red, not by its alpha.
        let map_d = |red| {
            let opacity_map = blend().base_color_map;
            let pixels = Pixels::Rgba8(vec![[red, 0, 0, 0]; 8].into());
            (pixels, Material { opacity_map, base_color_map: None, ..blend() })
        };
        let cases = [(255, Solid::All), (254, Solid::None)];
        for (red, expected) in cases {
            let (pixels, material) = map_d(red);
            assert_eq!(of(pixels, material, None), expected);
        }
    }

    #[test]
    fn glass_is_solid_where_its_map_lets_nothing_through() {
        let of = |transmission: u8, alpha: u8, alpha_mode| {
            let mut glass = MetalRough { transmission: 1.0, metallic: 0.0, ..MetalRough::default() };
            let material = mapped(alpha_mode, UvTransform::default());
            glass.transmission_map = material.base_color_map;
            let material = Material { reflection: Reflection::MetalRough(glass), ..material };
            let pixels = Pixels::Rgba8(vec![[transmission, 90, 90, alpha]; 8].into());
            let bitmap = Bitmap { name: String::new(), width: 4, height: 2, pixels };
            solids(&scene(bitmap, Sampler::default(), soup(&mut Random::new(3), 4, 1.0), material)).remove(0)
        };
        assert_eq!(of(0, 0, AlphaMode::Opaque), Solid::All, "alpha says nothing");
        assert_eq!(of(1, 255, AlphaMode::Opaque), Solid::None);
        assert_eq!(of(0, 255, AlphaMode::Blend), Solid::All);
        assert_eq!(of(0, 254, AlphaMode::Blend), Solid::None);
        let even = MetalRough { transmission: 0.5, metallic: 0.0, ..MetalRough::default() };
        let material = Material { reflection: Reflection::MetalRough(even), ..Material::plain() };
        let bitmap = Bitmap { name: String::new(), width: 0, height: 0, pixels: Pixels::Rgb8(Vec::new().into()) };
        let scene = scene(bitmap, Sampler::default(), soup(&mut Random::new(3), 4, 1.0), material);
        assert_eq!(solids(&scene), [Solid::None], "without a map it is glass everywhere");
    }

    #[test]
    fn a_mask_is_solid_from_its_cutoff_on() {
        let with = |opacity, cutoff| Material { opacity, ..mapped(AlphaMode::Mask { cutoff }, UvTransform::default()) };
        assert_eq!(least(&with(1.0, 0.0)), Some(0.0));
        assert_eq!(least(&with(0.0, 0.0)), Some(0.0));
        assert_eq!(least(&with(0.5, 0.5)), Some(1.0));
        assert_eq!(least(&with(0.4, 0.5)), None);
        assert!(least(&with(0.8, 0.4)).is_some_and(|least| least > 0.5 && least < 0.501));
    }
}
