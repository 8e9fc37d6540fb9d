//! Optional lobes besides the metallic-roughness model: clear coat, thin film, sheen, anisotropy, diffuse transmission.

use super::TextureRef;
use crate::math::Vec3;

/// A clear dielectric layer of index 1.5 over a surface (KHR_materials_clearcoat).
#[derive(Clone, Debug, PartialEq)]
pub struct Coat {
    /// 0: no clear coat … 1: full coverage.
    pub strength: f32,
    /// Linear map, red channel × `strength`.
    pub strength_map: Option<TextureRef>,
    /// Perceptual roughness, 0 … 1.
    pub roughness: f32,
    /// Linear map, green channel × `roughness`.
    pub roughness_map: Option<TextureRef>,
    /// Tangent-space normal map of the clear coat, linear; without one the coat is smooth, whatever the surface under it.
    pub normal_map: Option<TextureRef>,
    /// Multiplies x and y of the normal map.
    pub normal_scale: f32,
}

impl Coat {
    /// All slots that can hold a map.
    pub fn maps(&self) -> [&Option<TextureRef>; 3] {
        [&self.strength_map, &self.roughness_map, &self.normal_map]
    }

    /// All slots that can hold a map, mutable.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 3] {
        [&mut self.strength_map, &mut self.roughness_map, &mut self.normal_map]
    }
}

/// A grain along which light is spread wider than across it (KHR_materials_anisotropy).
#[derive(Clone, Debug, PartialEq)]
pub struct Anisotropy {
    /// 0: isotropic … 1: fully rough along the grain.
    pub strength: f32,
    /// Rotation of the grain from the tangent towards the bitangent, radians.
    pub rotation: f32,
    /// Linear map: red and green for −1 … 1 along tangent and bitangent, before the rotation; blue × `strength`.
    pub map: Option<TextureRef>,
}

/// A film so thin that light reflected by its two sides interferes (KHR_materials_iridescence).
#[derive(Clone, Debug, PartialEq)]
pub struct Iridescence {
    /// 0: no film … 1: full coverage.
    pub strength: f32,
    /// Linear map, red channel × `strength`.
    pub strength_map: Option<TextureRef>,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Thickness in nanometres at map values 0 and 1; the second without a map.
    pub thickness: [f32; 2],
    /// Linear map, green channel: interpolates between the two thicknesses.
    pub thickness_map: Option<TextureRef>,
}

impl Iridescence {
    /// All slots that can hold a map.
    pub fn maps(&self) -> [&Option<TextureRef>; 2] {
        [&self.strength_map, &self.thickness_map]
    }

    /// All slots that can hold a map, mutable.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 2] {
        [&mut self.strength_map, &mut self.thickness_map]
    }
}

/// Fibres on a surface that scatter light back at grazing angles (KHR_materials_sheen).
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
    /// All slots that can hold a map.
    pub fn maps(&self) -> [&Option<TextureRef>; 2] {
        [&self.color_map, &self.roughness_map]
    }

    /// All slots that can hold a map, mutable.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 2] {
        [&mut self.color_map, &mut self.roughness_map]
    }
}

/// Diffuse transmission to the other side, as by leaves, paper and wax (KHR_materials_diffuse_transmission).
///
/// The surface counts as thin: light leaves where it entered, whatever KHR_materials_volume says of the inside.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// 0: all scattered light is reflected … 1: all of it is transmitted.
    pub share: f32,
    /// Linear map, alpha channel × `share`.
    pub share_map: Option<TextureRef>,
    /// Colour of the transmitted light, linear, 0 … 1; the reflected light has the base colour.
    pub color: Vec3,
    /// sRGB map × `color`.
    pub color_map: Option<TextureRef>,
}

impl DiffuseTransmission {
    /// All slots that can hold a map.
    pub fn maps(&self) -> [&Option<TextureRef>; 2] {
        [&self.share_map, &self.color_map]
    }

    /// All slots that can hold a map, mutable.
    pub fn maps_mut(&mut self) -> [&mut Option<TextureRef>; 2] {
        [&mut self.share_map, &mut self.color_map]
    }
}
