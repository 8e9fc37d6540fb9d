//! What only some surfaces have besides the metallic-roughness model: clear coat, a thin film, sheen, a grain, light that is
//! scattered through them.

use super::TextureRef;
use crate::math::Vec3;

/// A clear dielectric layer of index 1.5 over a surface (KHR_materials_clearcoat).
#[derive(Clone, Debug, PartialEq)]
pub struct Coat {
    /// 0: no clear coat … 1: it covers everything.
    pub strength: f32,
    /// Linear map, red channel × `strength`.
    pub strength_map: Option<TextureRef>,
    /// Perceptual roughness, 0 … 1.
    pub roughness: f32,
    /// Linear map, green channel × `roughness`.
    pub roughness_map: Option<TextureRef>,
    /// Tangent-space normal map of the clear coat, linear; without one it is smooth, whatever the surface under it is.
    pub normal_map: Option<TextureRef>,
    /// Multiplies x and y of the normal map.
    pub normal_scale: f32,
}

impl Coat {
    /// Its maps.
    pub fn maps(&self) -> [&Option<TextureRef>; 3] {
        [&self.strength_map, &self.roughness_map, &self.normal_map]
    }

    /// Every slot that can hold a map.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 3] {
        [&mut self.strength_map, &mut self.roughness_map, &mut self.normal_map]
    }
}

/// A grain along which light is spread farther than across it (KHR_materials_anisotropy).
#[derive(Clone, Debug, PartialEq)]
pub struct Anisotropy {
    /// 0: none … 1: along the grain the surface is as rough as can be.
    pub strength: f32,
    /// Turns the grain from the tangent towards the bitangent, radians.
    pub rotation: f32,
    /// Linear map: red and green for −1 … 1 along tangent and bitangent, before the turn; blue × `strength`.
    pub map: Option<TextureRef>,
}

/// A film so thin that light reflected off both its sides interferes (KHR_materials_iridescence).
#[derive(Clone, Debug, PartialEq)]
pub struct Iridescence {
    /// 0: no film … 1: it covers everything.
    pub strength: f32,
    /// Linear map, red channel × `strength`.
    pub strength_map: Option<TextureRef>,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Thickness in nanometres where the map is 0 and where it is 1; without a map the second.
    pub thickness: [f32; 2],
    /// Linear map, green channel: between both.
    pub thickness_map: Option<TextureRef>,
}

impl Iridescence {
    /// Its maps.
    pub fn maps(&self) -> [&Option<TextureRef>; 2] {
        [&self.strength_map, &self.thickness_map]
    }

    /// Every slot that can hold a map.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 2] {
        [&mut self.strength_map, &mut self.thickness_map]
    }
}

/// Fibres that stand off a surface and scatter light back where it grazes them (KHR_materials_sheen).
#[derive(Clone, Debug, PartialEq)]
pub struct Sheen {
    /// Colour and strength, linear, 0 … 1.
    pub color: Vec3,
    /// sRGB map × `color`.
    pub color_map: Option<TextureRef>,
    /// Perceptual roughness, 0 … 1.
    pub roughness: f32,
    /// Linear map, alpha channel × `roughness`.
    pub roughness_map: Option<TextureRef>,
}

impl Sheen {
    /// Its maps.
    pub fn maps(&self) -> [&Option<TextureRef>; 2] {
        [&self.color_map, &self.roughness_map]
    }

    /// Every slot that can hold a map.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 2] {
        [&mut self.color_map, &mut self.roughness_map]
    }
}

/// Light that is scattered through to the other side, as by leaves, paper and wax (KHR_materials_diffuse_transmission).
///
/// The surface counts as thin: light comes out where it went in, whatever KHR_materials_volume says of its inside.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// 0: all light that is scattered comes back … 1: all of it goes through.
    pub share: f32,
    /// Linear map, alpha channel × `share`.
    pub share_map: Option<TextureRef>,
    /// Colour of the light that goes through, linear, 0 … 1; that which comes back has the base colour.
    pub color: Vec3,
    /// sRGB map × `color`.
    pub color_map: Option<TextureRef>,
}

impl DiffuseTransmission {
    /// Its maps.
    pub fn maps(&self) -> [&Option<TextureRef>; 2] {
        [&self.share_map, &self.color_map]
    }

    /// Every slot that can hold a map.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 2] {
        [&mut self.share_map, &mut self.color_map]
    }
}
