//! A clear lacquer over a surface.

use super::TextureRef;

/// A clear dielectric layer of index 1.5 over a surface (KHR_materials_clearcoat).
#[derive(Clone, Debug)]
pub struct Coat {
    /// 0: no lacquer … 1: it covers everything.
    pub strength: f32,
    /// Linear map, red channel × `strength`.
    pub strength_map: Option<TextureRef>,
    /// Perceptual roughness, 0 … 1.
    pub roughness: f32,
    /// Linear map, green channel × `roughness`.
    pub roughness_map: Option<TextureRef>,
    /// Tangent-space normal map of the lacquer, linear; without one it is smooth, whatever the surface under it is.
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
