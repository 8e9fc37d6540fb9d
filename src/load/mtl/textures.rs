//! Maps of materials -> textures of the scene.

use super::options::{Channel, Map};
use super::parse::{Mtl, Slot};
use super::pictures::{Alpha, Pictures, TexelSource};
use crate::load::finder::{Finder, FoundPath, unquote};
use crate::load::limits::{Budget, Limits, OverBudget};
use crate::load::paths::{FileFault, taken_from};
use crate::load::texture::{Encoded, Unusable, decode_all};
use crate::load::{Diagnostic, MtlMode, Warnings};
use crate::math::Vec2;
use crate::scene::{
    AlphaMode, Bitmap, Material, MetalRough, Reflection, Sampler, Texture, TextureRef, UvTransform, Wrap,
};
use crate::stopwatch::Spent;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Height from black to white in a bump map, in sides of the picture, where `-bm` is 1 or not given.
///
/// The MTL specification gives no unit. A whole side would turn every map into cliffs; 1/64 is the relief of rough plaster on a
/// square metre.
const BUMP_HEIGHT: f64 = 1.0 / 64.0;

/// All pictures that materials use, and the textures made from them.
#[derive(Debug, Default)]
pub(super) struct Textures {
    /// (Library, name as written) -> index of the picture, or `None` if it could not be read.
    known: HashMap<(usize, String), Option<usize>>,
    /// Canonical path of a file -> index of its picture, or `None` if it could not be read: one file may have many names.
    files: HashMap<PathBuf, Option<usize>>,
    pictures: Pictures,
    textures: Vec<Texture>,
    /// Time spent decoding.
    pub(super) decoding: Spent,
}

/// Pictures to decode, with their canonical paths.
#[derive(Default)]
struct Queue {
    images: Vec<Encoded<'static>>,
    files: Vec<PathBuf>,
}

/// A library with materials in use.
pub(super) struct Library<'a> {
    /// Index of the library.
    pub number: usize,
    /// Path of the library, for messages.
    pub file: &'a Path,
    /// Folder of the library, relative to the model's.
    pub folder: &'a Path,
}

/// Cuts a trailing comment off a file name; callers try the full name first, as a file name may contain ` #`.
fn without_remark(name: &str) -> Option<&str> {
    let starts = |pair: &[u8]| pair[0].is_ascii_whitespace() && pair[1] == b'#';
    let name = name.get(..name.as_bytes().windows(2).position(starts)?)?.trim_end();
    (!name.is_empty()).then_some(name)
}

/// Suffixes of a name that begins with what looks like options of another program, `-colorspace sRGB a.png`: without the first
/// word, without two, and so on.
fn without_options(name: &str) -> impl Iterator<Item = &str> {
    /// Most words that are left out.
    const MOST: usize = 4;
    let begin = |at: usize| name.as_bytes()[at].is_ascii_whitespace();
    let spaces = (0..name.len()).filter(move |&at| name.starts_with('-') && begin(at));
    spaces.map(|at| name[at..].trim_start()).filter(|rest| !rest.is_empty()).take(MOST)
}

/// Returns whether maps of a slot are drawn. Ambient light uses the diffuse map, except under [`MtlMode::Literal`].
fn is_drawn(slot: Slot, mode: MtlMode) -> bool {
    slot != Slot::Ambient || mode == MtlMode::Literal
}

impl Textures {
    /// Reads and decodes the pictures that `materials` of one library name.
    pub(super) fn read<'m>(
        &mut self,
        library: &Library,
        materials: impl Iterator<Item = &'m Mtl>,
        mode: MtlMode,
        finder: &mut Finder,
        (limits, budget): (&Limits, &mut Budget),
        warnings: &mut Warnings,
    ) {
        let mut queue = Queue::default();
        let mut names: Vec<(PathBuf, String)> = Vec::new();
        let maps = materials.flat_map(|m| &m.maps).filter(|(slot, _)| is_drawn(*slot, mode));
        for (_, map) in maps {
            let key = (library.number, map.file.clone());
            if self.known.contains_key(&key) {
                continue;
            }
            self.known.insert(key, None);
            match self.queue(map, library, finder, budget, &mut queue) {
                Ok(found) => {
                    if found.guessed {
                        let text = format!("picture {}", taken_from(&map.file, &found.path));
                        let place = map.line.to_string();
                        warnings.push(Diagnostic::new("mtl-file-elsewhere", library.file, place, text));
                    }
                    names.push((found.canonical, map.file.clone()));
                }
                Err(warning) => warnings.push(warning),
            }
        }
        let (decoded, spent) = decode_all(&queue.images, library.file, limits, budget, warnings);
        self.decoding += spent;
        for (file, bitmap) in queue.files.into_iter().zip(decoded) {
            self.files.insert(file, bitmap.map(|bitmap| self.pictures.add(bitmap)));
        }
        for (file, name) in names {
            self.known.insert((library.number, name), self.files.get(&file).copied().flatten());
        }
    }

    /// Finds the picture of a map, and reads its file unless that was done before.
    ///
    /// # Errors
    /// A warning that the file is missing or cannot be read.
    fn queue(
        &mut self,
        map: &Map,
        library: &Library,
        finder: &mut Finder,
        budget: &mut Budget,
        queue: &mut Queue,
    ) -> Result<FoundPath, Diagnostic> {
        let place = map.line.to_string();
        let lost = |fault: FileFault| {
            let warning = fault.diagnose(library.file, &place);
            let text = format!("picture {}; the material is drawn without it", warning.text);
            Diagnostic { text, ..warning }
        };
        let folders = [library.folder, Path::new("")];
        let found = finder.find(&map.file, &folders).or_else(|fault| {
            let others = without_remark(&map.file).into_iter().chain(without_options(&map.file));
            let other = others.into_iter().find_map(|name| finder.find(unquote(name), &folders).ok());
            other.ok_or_else(|| lost(fault))
        })?;
        if self.files.contains_key(&found.canonical) {
            return Ok(found);
        }
        self.files.insert(found.canonical.clone(), None);
        let name = found.path.to_string_lossy().into_owned();
        let too_large = |over: OverBudget| Unusable::too_large(over.to_string()).warning(&name, library.file, &place);
        budget.take(finder.resolver.length(&found.canonical), 1).map_err(too_large)?;
        let bytes = finder.resolver.read_file(&found.path).map_err(lost)?;
        queue.images.push(Encoded { name, place, bytes: bytes.into() });
        queue.files.push(found.canonical.clone());
        Ok(found)
    }

    /// Index of the picture of a slot; `None` if there is none or it could not be read.
    pub(super) fn picture(&self, library: usize, mtl: &Mtl, slot: Slot) -> Option<usize> {
        self.known.get(&(library, mtl.map(slot)?.file.clone())).copied().flatten()
    }

    /// Returns the textures and bitmaps of the scene.
    pub(super) fn finish(self) -> (Vec<Texture>, Vec<Bitmap>) {
        (self.textures, self.pictures.finish())
    }

    /// Makes a texture of `take`, transformed and wrapped by the options of `map`.
    fn texture(
        &mut self,
        take: TexelSource,
        map: &Map,
        limits: &Limits,
        budget: &mut Budget,
    ) -> Result<TextureRef, Unusable> {
        let bitmap = self.pictures.take(take, limits, budget)?;
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        let wanted = Texture { bitmap, sampler: Sampler { wrap_u: wrap, wrap_v: wrap, ..Sampler::default() } };
        let known = self.textures.iter().position(|t| *t == wanted);
        let index = known.unwrap_or_else(|| {
            self.textures.push(wanted);
            self.textures.len() - 1
        });
        // v' = s (1 − v) + o with v pointing up is 1 − v' = s v + 1 − s − o with v pointing down.
        let (scale, offset) = (map.scale, map.offset);
        let transform = UvTransform {
            offset: crate::math::DVec2::new(offset.x, 1.0 - scale.y - offset.y).as_vec2(),
            rotation: 0.0,
            scale: Vec2::new(scale.as_vec2().x, scale.as_vec2().y),
        };
        #[expect(clippy::cast_possible_truncation, reason = "a handful of textures for each material")]
        let texture = index as u32;
        Ok(TextureRef { texture, uv_set: 0, transform })
    }
}

/// Assigns the maps of one material.
pub(super) struct Mapper<'a> {
    pub textures: &'a mut Textures,
    pub library: &'a Library<'a>,
    pub mtl: &'a Mtl,
    pub mode: MtlMode,
    pub limits: &'a Limits,
    pub budget: &'a mut Budget,
    pub warnings: &'a mut Warnings,
}

impl Mapper<'_> {
    pub(super) fn apply(&mut self, material: &mut Material) {
        self.opacity(material);
        material.emission_map = self.whole(Slot::Emission);
        self.relief(material);
        let packed = self.whole(Slot::OcclusionRoughMetal);
        let rough_metal = packed.or_else(|| self.rough_metal());
        let is_physical = matches!(material.reflection, Reflection::MetalRough(_));
        let occlusion = if is_physical { self.occlusion().or(packed) } else { None };
        if let Some(map) = self.mtl.map(Slot::Occlusion).filter(|_| !is_physical) {
            let text = "a map of occlusion (map_ao) is drawn on physically based materials only";
            let warning = Diagnostic::new("mtl-unsupported", self.library.file, map.line.to_string(), text);
            self.warnings.push(warning.remedy("give it a roughness (Pr)"));
        }
        self.tell_of_ambient_map();
        let ambient = if self.mode == MtlMode::Literal { self.whole(Slot::Ambient) } else { material.base_color_map };
        let base_is_black = material.base_color == crate::math::Vec3::ZERO;
        match &mut material.reflection {
            Reflection::MetalRough(m) => {
                m.metal_rough_map = rough_metal;
                self.lobes(m);
            }
            Reflection::Phong(p) => {
                p.ambient_map = if base_is_black { None } else { ambient };
                p.specular_map = self.whole(Slot::Specular);
                p.shininess_map = self.scalar(Slot::Shininess);
            }
            Reflection::Unlit => {}
        }
        material.occlusion_map = occlusion;
    }

    fn picture(&self, slot: Slot) -> Option<(&Map, usize)> {
        let map = self.mtl.map(slot).filter(|_| is_drawn(slot, self.mode))?;
        Some((map, self.textures.picture(self.library.number, self.mtl, slot)?))
    }

    /// Makes a texture of `take` by the options of `map`; `None`, with a warning, if it takes too much memory.
    fn texture(&mut self, take: TexelSource, map: &Map) -> Option<TextureRef> {
        let made = self.textures.texture(take, map, self.limits, self.budget);
        let warn = |why: Unusable| {
            let name = self.textures.pictures.name(take);
            self.warnings.push(why.warning(&name, self.library.file, &map.line.to_string()));
        };
        made.map_err(warn).ok()
    }

    fn whole(&mut self, slot: Slot) -> Option<TextureRef> {
        let (map, picture) = self.picture(slot)?;
        let map = map.clone();
        self.options(&map);
        self.texture(TexelSource::Whole(picture), &map)
    }

    /// Texture of a scalar map: the requested channel, or the luminance.
    fn scalar(&mut self, slot: Slot) -> Option<TextureRef> {
        let (map, picture) = self.picture(slot)?;
        let map = map.clone();
        self.options(&map);
        let take = self.brightness(picture, map.channel);
        self.texture(take, &map)
    }

    fn brightness(&self, picture: usize, channel: Option<Channel>) -> TexelSource {
        match channel {
            None | Some(Channel::Luminance | Channel::Red) if self.textures.pictures.is_grey(picture) => {
                TexelSource::Whole(picture)
            }
            None => TexelSource::Channel(picture, Channel::Luminance),
            Some(channel) => TexelSource::Channel(picture, channel),
        }
    }

    /// Assigns the diffuse map and the opacity, which comes from a map of its own or from the diffuse map's alpha channel.
    fn opacity(&mut self, material: &mut Material) {
        let diffuse = self.picture(Slot::Diffuse).map(|(map, picture)| (map.clone(), picture));
        let alpha = diffuse.as_ref().map_or(Alpha::Solid, |(_, picture)| self.textures.pictures.alpha(*picture));
        let (dissolve, by_diffuse) = self.dissolve(diffuse.as_ref().map(|d| d.1));
        if let Some((take, map)) = dissolve
            && let Some(texture) = self.texture(take, &map)
        {
            material.opacity_map = Some(texture);
            material.alpha_mode = AlphaMode::Blend;
        }
        let own_map = material.opacity_map.is_some();
        let guessed = self.mode == MtlMode::Guess && alpha == Alpha::Used && !own_map && !by_diffuse;
        if guessed {
            self.guess("mtl-diffuse-alpha", "the alpha channel of map_Kd is used, although there is no map_d");
        }
        if by_diffuse || guessed {
            material.alpha_mode = AlphaMode::Blend;
        }
        if let Some((map, picture)) = diffuse {
            self.options(&map);
            let solid = alpha == Alpha::Solid || by_diffuse || guessed || material.alpha_mode == AlphaMode::Opaque;
            let take = if solid { TexelSource::Whole(picture) } else { TexelSource::Opaque(picture) };
            material.base_color_map = self.texture(take, &map);
        }
    }

    /// Opacity from `map_d` or `map_Tr`; the flag says that it is the diffuse map's alpha channel instead.
    fn dissolve(&mut self, diffuse: Option<usize>) -> (Option<(TexelSource, Map)>, bool) {
        if let Some((map, picture)) = self.picture(Slot::Dissolve) {
            let map = map.clone();
            self.options(&map);
            let has_alpha = self.textures.pictures.alpha(picture) == Alpha::Used;
            let guess = map.channel.is_none() && has_alpha && self.mode == MtlMode::Guess;
            let channel = if guess { Some(Channel::Alpha) } else { map.channel };
            let is_once_more = diffuse == Some(picture) && map.channel.is_none() && !has_alpha;
            if is_once_more && self.mode == MtlMode::Guess && !self.textures.pictures.is_grey(picture) {
                self.guess("mtl-map-alpha", "map_d is map_Kd once more, which has no alpha channel: it is opaque");
                return (None, false);
            }
            if diffuse == Some(picture) && channel == Some(Channel::Alpha) {
                return (None, true);
            }
            if guess {
                self.guess("mtl-map-alpha", "map_d has an alpha channel, which is used instead of its brightness");
            }
            return (Some((self.brightness(picture, channel), map)), false);
        }
        let Some((map, picture)) = self.picture(Slot::Transparency) else { return (None, false) };
        let map = map.clone();
        (Some((TexelSource::Inverse(picture, map.channel.unwrap_or(Channel::Luminance)), map)), false)
    }

    /// Assigns the normal map and the bump map. Many programs write normal maps as bump maps; their texels give them away.
    fn relief(&mut self, material: &mut Material) {
        #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
        let strength = |map: &Map| map.bump.unwrap_or(1.0) as f32;
        if let Some((map, picture)) = self.picture(Slot::Normal) {
            let map = map.clone();
            material.normal_scale = strength(&map);
            material.normal_map = self.texture(TexelSource::Whole(picture), &map);
        }
        // Displacement is drawn as bumps: faces keep their positions, on which the proofs about hits rest.
        let displaced = self.picture(Slot::Bump).is_none();
        let slot = if displaced { Slot::Displacement } else { Slot::Bump };
        let Some((map, picture)) = self.picture(slot) else { return };
        let map = map.clone();
        self.options(&map);
        let guessing = self.mode == MtlMode::Guess;
        if displaced {
            let text = "a displacement map (disp) is drawn as a bump map, which moves no faces";
            let line = self.mtl.line.to_string();
            let warning = Diagnostic::new("mtl-displacement-as-bump", self.library.file, line, text);
            self.warnings.push(warning.remedy("displace them before export where that shows"));
        }
        if guessing && !displaced && material.normal_map.is_none() && self.textures.pictures.is_normal_map(picture) {
            self.guess("mtl-normal-as-bump", "a bump map is a normal map by its texels and used as one");
            material.normal_scale = strength(&map);
            material.normal_map = self.texture(TexelSource::Whole(picture), &map);
            return;
        }
        if guessing {
            self.guess("mtl-bump-height", "the height of a bump map has no unit; white is 1/64 of its side at -bm 1");
        }
        let take = self.brightness(picture, map.channel);
        #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
        let unit = if guessing { BUMP_HEIGHT as f32 } else { 1.0 };
        material.bump_scale = strength(&map) * unit;
        material.bump_map = self.texture(take, &map);
    }

    /// Assigns the maps of sheen, clear coat and anisotropy.
    fn lobes(&mut self, m: &mut MetalRough) {
        if let Some(sheen) = &mut m.sheen {
            let named = self.picture(Slot::Sheen).map(|(map, picture)| (map.clone(), picture));
            sheen.color_map = named.and_then(|(map, picture)| {
                let take = TexelSource::Coded(picture, map.channel.unwrap_or(Channel::Luminance));
                self.texture(take, &map)
            });
        }
        if let Some(coat) = &mut m.coat {
            coat.strength_map = self.scalar(Slot::Coat);
            coat.roughness_map = self.scalar(Slot::CoatRoughness);
        }
        if let Some(anisotropy) = &mut m.anisotropy {
            anisotropy.map = self.anisotropy();
        }
    }

    /// Texture of anisotropic strength and direction; the options of the strength's map apply to both, or else those of the
    /// direction's.
    fn anisotropy(&mut self) -> Option<TextureRef> {
        let channel = |(map, picture): (&Map, usize)| (picture, map.channel.unwrap_or(Channel::Luminance));
        let (strength, turn) = (self.picture(Slot::Anisotropy), self.picture(Slot::AnisotropyRotation));
        let map = strength.or(turn)?.0.clone();
        let most = self.mtl.anisor.filter(|turns| *turns != 0.0 || self.mode == MtlMode::Literal).unwrap_or(1.0);
        let take = TexelSource::Anisotropy(strength.map(channel), turn.map(channel), most.to_bits());
        self.texture(take, &map)
    }

    /// Texture of occlusion, from a map of its own or the blue channel of a packed map.
    fn occlusion(&mut self) -> Option<TextureRef> {
        if self.picture(Slot::Occlusion).is_some() {
            return self.scalar(Slot::Occlusion);
        }
        let (map, picture) = self.picture(Slot::RoughMetalOcclusion)?;
        let map = map.clone();
        self.texture(TexelSource::Channel(picture, Channel::Blue), &map)
    }

    /// Warns of an ambient map that differs from the diffuse one.
    fn tell_of_ambient_map(&mut self) {
        let file = |slot: Slot| self.mtl.map(slot).map(|map| &map.file);
        if self.mode == MtlMode::Guess
            && file(Slot::Ambient).is_some_and(|ambient| file(Slot::Diffuse) != Some(ambient))
        {
            self.guess("mtl-ambient", "map_Ka is not used; ambient light sees map_Kd");
        }
    }

    /// Texture of roughness and metallic; the options of the roughness map apply to both, or else those of the metallic map.
    fn rough_metal(&mut self) -> Option<TextureRef> {
        if let Some((map, picture)) = self.picture(Slot::RoughMetalOcclusion) {
            let map = map.clone();
            let take = TexelSource::RoughMetal(Some((picture, Channel::Red)), Some((picture, Channel::Green)));
            return self.texture(take, &map);
        }
        let channel = |(map, picture): (&Map, usize)| (picture, map.channel.unwrap_or(Channel::Luminance));
        let (rough, metal) = (self.picture(Slot::Roughness), self.picture(Slot::Metallic));
        let map = rough.or(metal)?.0.clone();
        let take = TexelSource::RoughMetal(rough.map(channel), metal.map(channel));
        self.texture(take, &map)
    }

    fn options(&mut self, map: &Map) {
        if let Some((base, gain)) = map.base_gain {
            let text = format!("the option '-mm {base} {gain}' of a map is ignored");
            self.warnings.push(Diagnostic::new("mtl-map-option", self.library.file, map.line.to_string(), text));
        }
    }

    fn guess(&mut self, code: &'static str, text: &str) {
        let warning = Diagnostic::new(code, self.library.file, self.mtl.line.to_string(), text);
        self.warnings.push(warning.remedy("--mtl literal follows the text"));
    }
}
