//! Materials: how surfaces reflect, transmit and emit light. Factors are linear; maps multiply them.

use super::{Anisotropy, Coat, DiffuseTransmission, Iridescence, Sheen};
use crate::math::{Vec2, Vec3};

/// A material. `base_color`, alpha, emission and the normal are common to every [`Reflection`] model.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file, or an empty string.
    pub name: String,
    /// Base (glTF) or diffuse (`Kd`) colour, linear.
    pub base_color: Vec3,
    /// Opacity factor, 0 clear … 1 solid; its effect depends on `alpha_mode`.
    pub opacity: f32,
    /// sRGB map multiplied into `base_color`; its alpha multiplies `opacity`.
    pub base_color_map: Option<TextureRef>,
    /// Extra opacity map (`map_d`), the red channel, linear.
    pub opacity_map: Option<TextureRef>,
    /// Effect of the opacity.
    pub alpha_mode: AlphaMode,
    /// Whether the back of a face is drawn; it is shaded with the normal reversed.
    pub double_sided: bool,
    /// Emitted radiance, linear, strength included.
    pub emission: Vec3,
    /// sRGB map multiplied into `emission`.
    pub emission_map: Option<TextureRef>,
    /// Tangent-space normal map, linear.
    pub normal_map: Option<TextureRef>,
    /// Multiplies x and y of the normal map.
    pub normal_scale: f32,
    /// Height map (`bump`), red channel, linear.
    pub bump_map: Option<TextureRef>,
    /// Height of the bump map's white, in texture units (`-bm`).
    pub bump_scale: f32,
    /// Ambient occlusion map, red channel, linear; darkens ambient and environment light only.
    pub occlusion_map: Option<TextureRef>,
    /// 0: occlusion map ignored … 1: fully applied.
    pub occlusion_strength: f32,
    /// The reflection model.
    pub reflection: Reflection,
}

/// The reflection model of a [`Material`].
#[derive(Clone, Debug, PartialEq)]
pub enum Reflection {
    /// glTF 2.0 metallic-roughness (its Appendix B), with specular, ior and transmission extensions.
    MetalRough(MetalRough),
    /// Phong as in MTL and the founding texts.
    Phong(Phong),
    /// KHR_materials_unlit: the base colour, unlit.
    Unlit,
}

/// Parameters of the glTF metallic-roughness model.
#[derive(Clone, Debug, PartialEq)]
pub struct MetalRough {
    /// 0 dielectric … 1 metal; the default in glTF is 1.
    pub metallic: f32,
    /// Perceptual roughness, 0 … 1.
    pub roughness: f32,
    /// Linear map: green × roughness, blue × metallic.
    pub metal_rough_map: Option<TextureRef>,
    /// KHR_materials_specular: strength of the dielectric reflection.
    pub specular: f32,
    /// Linear map, alpha channel × `specular`.
    pub specular_map: Option<TextureRef>,
    /// Colour of the dielectric reflection at normal incidence, linear, may exceed 1.
    pub specular_color: Vec3,
    /// sRGB map × `specular_color`.
    pub specular_color_map: Option<TextureRef>,
    /// Index of refraction, at least 1, or 0 for the extension's "no Fresnel" special case.
    pub ior: f32,
    /// KHR_materials_transmission: 0 opaque … 1 all light that is not reflected passes.
    pub transmission: f32,
    /// Linear map, red channel × `transmission`.
    pub transmission_map: Option<TextureRef>,
    /// Whether the surface bounds a closed volume, in which light is refracted; without KHR_materials_volume glTF glass is thin:
    /// rays pass straight through.
    pub thick: bool,
    /// KHR_materials_volume: absorption coefficient of the inside of a thick material, 1 / unit of length; 0: clear. A length d
    /// transmits exp(−`absorption` d) of the light (A. Beer, 1852).
    pub absorption: Vec3,
    /// KHR_materials_volume: thickness where the inside is not traced, that is, where the surroundings are looked up through
    /// rough glass.
    pub thickness: f32,
    /// Linear map, green channel × `thickness`.
    pub thickness_map: Option<TextureRef>,
    /// Dispersion of `ior`: 20 / Abbe number, as KHR_materials_dispersion; 0: none.
    pub dispersion: f32,
    /// Diffuse transmission.
    pub diffuse_transmission: Option<Box<DiffuseTransmission>>,
    /// Anisotropy: a grain along which the surface is rougher.
    pub anisotropy: Option<Box<Anisotropy>>,
    /// Thin film on the surface.
    pub iridescence: Option<Box<Iridescence>>,
    /// Sheen of fibres on the surface.
    pub sheen: Option<Box<Sheen>>,
    /// Clear coat over all other layers.
    pub coat: Option<Box<Coat>>,
}

/// Parameters of the Phong model: `I = Ia Ka + Σ I (Kd N·L + Ks cosⁿα) + mirror + transmission`.
///
/// The diffuse colour is [`Material::base_color`].
#[derive(Clone, Debug, PartialEq)]
pub struct Phong {
    /// `Ka`, linear; multiplied with the scene's ambient light.
    pub ambient: Vec3,
    /// sRGB map × `ambient`.
    pub ambient_map: Option<TextureRef>,
    /// `Ks`, linear.
    pub specular: Vec3,
    /// sRGB map × `specular`.
    pub specular_map: Option<TextureRef>,
    /// `Ns`, the exponent n.
    pub shininess: f32,
    /// Linear map, red channel × `shininess`.
    pub shininess_map: Option<TextureRef>,
    /// Weight of the reflected ray, linear; zero: no mirror.
    pub mirror: Vec3,
    /// Weight of the refracted ray (`Tf`), linear; zero: none. Without `fresnel`, limited to what `mirror` leaves.
    pub transmission: Vec3,
    /// `Ni`, index of refraction of the inside; at 1 rays pass straight through.
    pub ior: f32,
    /// Whether Fresnel reflectance balances mirror and transmission (`illum` 5, 7).
    pub fresnel: bool,
    /// Dispersion of `ior`: 20 / Abbe number, as KHR_materials_dispersion; 0: none.
    pub dispersion: f32,
}

/// Effect of a material's opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Opacity is ignored.
    #[default]
    Opaque,
    /// Solid where opacity ≥ cutoff, else absent.
    Mask {
        /// The threshold.
        cutoff: f32,
    },
    /// Composited over what lies behind.
    Blend,
}

impl AlphaMode {
    /// Coverage of a surface of this opacity, from 0 (absent) to 1.
    #[inline]
    pub fn covers(self, opacity: f32) -> f32 {
        match self {
            Self::Opaque => 1.0,
            Self::Mask { cutoff } => f32::from(u8::from(opacity >= cutoff)),
            Self::Blend => opacity.clamp(0.0, 1.0),
        }
    }
}

/// A reference to a texture, with its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`super::Scene::textures`].
    pub texture: u32,
    /// Index of the coordinate set in [`super::Mesh::uvs`].
    pub uv_set: u32,
    /// Transform applied to the coordinates before the lookup.
    pub transform: UvTransform,
}

impl TextureRef {
    /// Coordinates at which the texture is looked up.
    pub fn coordinates(&self) -> TexCoords {
        TexCoords { set: self.uv_set, transform: self.transform }
    }
}

/// A transformed set of texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TexCoords {
    /// Index of the set in [`super::Mesh::uvs`].
    pub set: u32,
    /// Transform of the coordinates.
    pub transform: UvTransform,
}

/// `uv' = offset + rotation · (scale · uv)`, as KHR_texture_transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Added last.
    pub offset: Vec2,
    /// Radians; the matrix is that in the extension's text.
    pub rotation: f32,
    /// Applied first.
    pub scale: Vec2,
}

impl UvTransform {
    /// Images of the steps (1, 0) and (0, 1).
    pub fn axes(&self) -> [Vec2; 2] {
        let (sin, cos) = if self.rotation == 0.0 { (0.0, 1.0) } else { libm::sincosf(self.rotation) };
        [Vec2::new(cos, -sin) * self.scale.x, Vec2::new(sin, cos) * self.scale.y]
    }

    /// Whether u and v keep their directions of growth.
    pub fn keeps_directions(&self) -> bool {
        self.rotation == 0.0 && self.scale.cmpgt(Vec2::ZERO).all()
    }
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
    }
}

impl Default for MetalRough {
    /// glTF's defaults: fully metallic, fully rough.
    fn default() -> Self {
        Self {
            metallic: 1.0,
            roughness: 1.0,
            metal_rough_map: None,
            specular: 1.0,
            specular_map: None,
            specular_color: Vec3::ONE,
            specular_color_map: None,
            ior: 1.5,
            transmission: 0.0,
            transmission_map: None,
            thick: false,
            absorption: Vec3::ZERO,
            thickness: 0.0,
            thickness_map: None,
            dispersion: 0.0,
            diffuse_transmission: None,
            anisotropy: None,
            iridescence: None,
            sheen: None,
            coat: None,
        }
    }
}

impl MetalRough {
    /// All maps of the model that are present.
    pub fn maps(&self) -> impl Iterator<Item = &TextureRef> {
        let own = [
            &self.metal_rough_map,
            &self.specular_map,
            &self.specular_color_map,
            &self.transmission_map,
            &self.thickness_map,
        ];
        let anisotropy = self.anisotropy.iter().map(|anisotropy| &anisotropy.map);
        let iridescence = self.iridescence.iter().flat_map(|iridescence| iridescence.maps());
        let sheen = self.sheen.iter().flat_map(|sheen| sheen.maps());
        let coat = self.coat.iter().flat_map(|coat| coat.maps());
        let through = self.diffuse_transmission.iter().flat_map(|diffuse_transmission| diffuse_transmission.maps());
        own.into_iter().chain(through).chain(anisotropy).chain(iridescence).chain(sheen).chain(coat).flatten()
    }

    /// All slots that can hold a map.
    pub fn maps_mut(&mut self) -> Vec<&mut Option<TextureRef>> {
        let mut slots = vec![
            &mut self.metal_rough_map,
            &mut self.specular_map,
            &mut self.specular_color_map,
            &mut self.transmission_map,
            &mut self.thickness_map,
        ];
        slots.extend(
            self.diffuse_transmission.iter_mut().flat_map(|diffuse_transmission| diffuse_transmission.maps_mut()),
        );
        slots.extend(self.anisotropy.iter_mut().map(|anisotropy| &mut anisotropy.map));
        slots.extend(self.iridescence.iter_mut().flat_map(|iridescence| iridescence.maps_mut()));
        slots.extend(self.sheen.iter_mut().flat_map(|sheen| sheen.maps_mut()));
        slots.extend(self.coat.iter_mut().flat_map(|coat| coat.maps_mut()));
        slots
    }

    /// Value of `absorption` at which `color` remains of white light after `distance`; zero for distances that are
    /// not positive and finite.
    pub fn absorption_of(color: Vec3, distance: f32) -> Vec3 {
        if !(distance > 0.0 && distance.is_finite()) {
            return Vec3::ZERO;
        }
        // Black would take an infinite coefficient, which absorbs everything even over a length of zero.
        let absorbed = |c: f32| (-libm::logf(c.clamp(f32::MIN_POSITIVE, 1.0)) / distance).min(f32::MAX);
        Vec3::new(absorbed(color.x), absorbed(color.y), absorbed(color.z))
    }
}

impl MetalRough {
    /// Whether the surface transmits any light; metal transmits none, but a map can only lower the metallic factor.
    pub fn transmits(&self) -> bool {
        self.transmission > 0.0 && (self.metallic < 1.0 || self.metal_rough_map.is_some())
    }

    /// Whether the material has lobes besides the core model, which depend on the view at each point.
    pub fn has_lobes(&self) -> bool {
        self.anisotropy.is_some() || self.iridescence.is_some() || self.sheen.is_some() || self.coat.is_some()
    }
}

impl Default for Phong {
    fn default() -> Self {
        Self {
            ambient: Vec3::ZERO,
            ambient_map: None,
            specular: Vec3::ZERO,
            specular_map: None,
            shininess: 1.0,
            shininess_map: None,
            mirror: Vec3::ZERO,
            transmission: Vec3::ZERO,
            ior: 1.0,
            fresnel: false,
            dispersion: 0.0,
        }
    }
}

impl Default for Material {
    /// glTF's default material: white, fully metallic, fully rough, opaque, one-sided.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::ONE,
            opacity: 1.0,
            base_color_map: None,
            opacity_map: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            emission: Vec3::ZERO,
            emission_map: None,
            normal_map: None,
            normal_scale: 1.0,
            bump_map: None,
            bump_scale: 1.0,
            occlusion_map: None,
            occlusion_strength: 1.0,
            reflection: Reflection::MetalRough(MetalRough::default()),
        }
    }
}

impl Material {
    /// Material of geometry that has neither a material nor colours: light grey, matt, double-sided.
    pub fn plain() -> Self {
        Self {
            name: "plain".into(),
            base_color: Vec3::splat(0.6),
            double_sided: true,
            reflection: Reflection::MetalRough(MetalRough { metallic: 0.0, roughness: 0.7, ..MetalRough::default() }),
            ..Self::default()
        }
    }

    /// Textures that the material uses.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let common = [
            &self.base_color_map,
            &self.opacity_map,
            &self.emission_map,
            &self.normal_map,
            &self.bump_map,
            &self.occlusion_map,
        ];
        let (metal_rough, phong) = match &self.reflection {
            Reflection::MetalRough(m) => (Some(m), None),
            Reflection::Phong(p) => (None, Some([&p.ambient_map, &p.specular_map, &p.shininess_map])),
            Reflection::Unlit => (None, None),
        };
        let own = metal_rough.into_iter().flat_map(MetalRough::maps);
        common.into_iter().flatten().chain(own).chain(phong.into_iter().flatten().flatten())
    }

    /// All slots that can hold a texture.
    pub fn textures_mut(&mut self) -> Vec<&mut Option<TextureRef>> {
        let mut slots = vec![
            &mut self.base_color_map,
            &mut self.opacity_map,
            &mut self.emission_map,
            &mut self.normal_map,
            &mut self.bump_map,
            &mut self.occlusion_map,
        ];
        match &mut self.reflection {
            Reflection::MetalRough(m) => slots.extend(m.maps_mut()),
            Reflection::Phong(p) => slots.extend([&mut p.ambient_map, &mut p.specular_map, &mut p.shininess_map]),
            Reflection::Unlit => {}
        }
        slots
    }

    /// The metallic-roughness model, if the material has that.
    pub fn metal_rough(&self) -> Option<&MetalRough> {
        match &self.reflection {
            Reflection::MetalRough(m) => Some(m),
            Reflection::Phong(_) | Reflection::Unlit => None,
        }
    }

    /// Whether a hit always stops light and sight, that is, `accel` counts the prim as *opaque*.
    pub fn is_opaque(&self) -> bool {
        self.alpha_mode == AlphaMode::Opaque && !self.reflection.transmits()
    }
}

impl Reflection {
    /// Whether the surface transmits light as glass does: rays can enter it, and its back faces are visible from inside.
    pub fn transmits(&self) -> bool {
        match self {
            Self::MetalRough(m) => m.transmits(),
            Self::Phong(p) => p.transmission.max_element() > 0.0,
            Self::Unlit => false,
        }
    }

    /// This reflection without transmission: it transmits no light and has no inside.
    #[must_use]
    pub fn without_transmission(self) -> Self {
        match self {
            Self::MetalRough(m) => Self::MetalRough(MetalRough {
                transmission: 0.0,
                transmission_map: None,
                thick: false,
                absorption: Vec3::ZERO,
                thickness: 0.0,
                thickness_map: None,
                dispersion: 0.0,
                ..m
            }),
            Self::Phong(p) => Self::Phong(Phong { transmission: Vec3::ZERO, dispersion: 0.0, ..p }),
            Self::Unlit => Self::Unlit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacity_covers_as_the_alpha_mode_says() {
        assert_eq!(AlphaMode::Opaque.covers(0.2), 1.0);
        assert_eq!(AlphaMode::Mask { cutoff: 0.5 }.covers(0.5), 1.0);
        assert_eq!(AlphaMode::Mask { cutoff: 0.5 }.covers(0.49), 0.0);
        assert_eq!(AlphaMode::Blend.covers(0.2), 0.2);
    }
}
