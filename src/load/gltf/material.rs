//! Materials: metallic-roughness with its extensions, specular-glossiness, and unlit.

use super::mesh::Needs;
use super::textures::Textures;
use crate::math::Vec3;
use crate::scene::{
    AlphaMode, Anisotropy, Coat, DiffuseTransmission, Iridescence, Material, MetalRough, Reflection, Sheen, TexCoords,
    TextureRef,
};
use gltf::json;
use gltf::json::material as source;
use gltf::json::validation::Checked;
use serde_json::Value;

/// A closed volume that refracts light and may absorb it.
const VOLUME: &str = "KHR_materials_volume";

/// Alternative surface model; metallic-roughness beside it is the fallback for programs without it.
const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// Converts a material and registers its maps in `textures`.
pub(super) fn convert(source: &json::Material, textures: &mut Textures) -> Material {
    let is_unlit = source.extensions.as_ref().is_some_and(|e| e.unlit.is_some());
    let extensions = source.extensions.as_ref().filter(|_| !is_unlit);
    let extension = extensions.and_then(|e| e.others.get(SPECULAR_GLOSSINESS));
    let mut material = Material {
        name: source.name.clone().unwrap_or_default(),
        alpha_mode: alpha_mode(source),
        double_sided: source.double_sided,
        ..Material::default()
    };
    if extension.is_none() {
        base(source, &mut material, textures);
    }
    if is_unlit {
        material.reflection = Reflection::Unlit;
        return material;
    }
    lit(source, &mut material, textures);
    material.reflection = Reflection::MetalRough(match extension {
        Some(extension) => from_specular_glossiness(extension, &mut material, textures),
        None => metal_rough(source, textures),
    });
    material
}

/// Vertex attributes that a material's maps need.
pub(super) fn needs(material: &Material) -> Needs {
    let m = material.metal_rough();
    let of_coat = m.and_then(|m| m.coat.as_ref()?.normal_map.as_ref());
    let anisotropy = m.and_then(|m| m.anisotropy.as_ref());
    // Anisotropy follows untransformed coordinates: the transform of a map moves only its texels.
    let along = |map: &TextureRef| match anisotropy {
        Some(_) => TexCoords { set: map.uv_set, ..TexCoords::default() },
        None => map.coordinates(),
    };
    // Anisotropy without a map follows the tangents of the first set.
    let of_anisotropy = anisotropy.map(|anisotropy| anisotropy.map.as_ref().map(along).unwrap_or_default());
    let tangents = material.normal_map.as_ref().or(of_coat).map(along).or(of_anisotropy);
    let mut uv_sets: Vec<u32> =
        material.textures().map(|map| map.uv_set).chain(tangents.map(|along| along.set)).collect();
    uv_sets.sort_unstable();
    uv_sets.dedup();
    Needs { uv_sets, tangents }
}

/// Clamps `value` to `low..=high`; `otherwise` for NaN.
fn within(value: f32, low: f32, high: f32, otherwise: f32) -> f32 {
    if value.is_nan() { otherwise } else { value.clamp(low, high) }
}

fn alpha_mode(source: &json::Material) -> AlphaMode {
    match source.alpha_mode {
        Checked::Valid(source::AlphaMode::Mask) => {
            AlphaMode::Mask { cutoff: source.alpha_cutoff.map_or(0.5, |c| within(c.0, 0.0, f32::MAX, 0.5)) }
        }
        Checked::Valid(source::AlphaMode::Blend) => AlphaMode::Blend,
        Checked::Valid(source::AlphaMode::Opaque) | Checked::Invalid => AlphaMode::Opaque,
    }
}

/// Converts base colour and opacity.
fn base(source: &json::Material, material: &mut Material, textures: &mut Textures) {
    let pbr = &source.pbr_metallic_roughness;
    let [r, g, b, a] = pbr.base_color_factor.0.map(|c| within(c, 0.0, 1.0, 1.0));
    (material.base_color, material.opacity) = (Vec3::new(r, g, b), a);
    material.base_color_map = textures.info(pbr.base_color_texture.as_ref());
}

/// Converts emission, normal and occlusion.
fn lit(source: &json::Material, material: &mut Material, textures: &mut Textures) {
    let strength = source.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |s| within(s.emissive_strength.0, 0.0, f32::MAX, 1.0));
    material.emission = Vec3::from(source.emissive_factor.0.map(|c| within(c, 0.0, 1.0, 0.0) * strength));
    material.emission_map = textures.info(source.emissive_texture.as_ref());
    if let Some(normal) = &source.normal_texture {
        material.normal_map = textures.of(
            normal.index,
            normal.tex_coord,
            transform(normal.extensions.as_ref().map(|e| &e.others)).as_ref(),
        );
        material.normal_scale = if normal.scale.is_finite() { normal.scale } else { 1.0 };
    }
    if let Some(occlusion) = &source.occlusion_texture {
        let others = occlusion.extensions.as_ref().map(|e| &e.others);
        material.occlusion_map = textures.of(occlusion.index, occlusion.tex_coord, transform(others).as_ref());
        material.occlusion_strength = within(occlusion.strength.0, 0.0, 1.0, 1.0);
    }
}

/// Parses KHR_texture_transform in slots where the typed document keeps it untyped.
fn transform(others: Option<&serde_json::Map<String, Value>>) -> Option<json::extensions::texture::TextureTransform> {
    let value = others?.get("KHR_texture_transform")?;
    serde_json::from_value(value.clone()).ok()
}

fn metal_rough(source: &json::Material, textures: &mut Textures) -> MetalRough {
    let pbr = &source.pbr_metallic_roughness;
    let mut surface = MetalRough {
        metallic: within(pbr.metallic_factor.0, 0.0, 1.0, 1.0),
        roughness: within(pbr.roughness_factor.0, 0.0, 1.0, 1.0),
        metal_rough_map: textures.info(pbr.metallic_roughness_texture.as_ref()),
        ..MetalRough::default()
    };
    let Some(extensions) = &source.extensions else { return surface };
    if let Some(specular) = &extensions.specular {
        surface.specular = within(specular.specular_factor.0, 0.0, 1.0, 1.0);
        surface.specular_map = textures.info(specular.specular_texture.as_ref());
        surface.specular_color = Vec3::from(specular.specular_color_factor.0.map(|c| within(c, 0.0, f32::MAX, 1.0)));
        surface.specular_color_map = textures.info(specular.specular_color_texture.as_ref());
    }
    if let Some(ior) = &extensions.ior {
        // Below 1 only 0 has a meaning, as a special case.
        surface.ior = if ior.ior.0 == 0.0 { 0.0 } else { within(ior.ior.0, 1.0, f32::MAX, 1.5) };
    }
    if let Some(transmission) = &extensions.transmission {
        surface.transmission = within(transmission.transmission_factor.0, 0.0, 1.0, 0.0);
        surface.transmission_map = textures.info(transmission.transmission_texture.as_ref());
    }
    let number = |extension: &str, name: &str| {
        let value = extensions.others.get(extension)?.get(name)?.as_f64()?;
        Some(value as f32)
    };
    surface.thickness = number(VOLUME, "thicknessFactor").map_or(0.0, |t| within(t, 0.0, f32::MAX, 0.0));
    surface.thick = surface.thickness > 0.0;
    if let Some(distance) = number(VOLUME, "attenuationDistance").filter(|_| surface.thick) {
        let color = extensions.others.get(VOLUME).map(|volume| color_of(volume, "attenuationColor", 1.0));
        surface.absorption = MetalRough::absorption_of(color.unwrap_or(Vec3::ONE), distance);
    }
    surface.dispersion =
        number("KHR_materials_dispersion", "dispersion").map_or(0.0, |d| within(d, 0.0, f32::MAX, 0.0));
    if surface.absorption != Vec3::ZERO && surface.roughness > 0.0 {
        surface.thickness_map = textures.info(info_of(extensions.others.get(VOLUME), "thicknessTexture").as_ref());
    }
    let other = |name: &str| extensions.others.get(name);
    let through = other("KHR_materials_diffuse_transmission");
    surface.diffuse_transmission = through.and_then(|through| diffuse_transmission(through, textures)).map(Box::new);
    surface.anisotropy =
        other("KHR_materials_anisotropy").and_then(|anisotropy| self::anisotropy(anisotropy, textures)).map(Box::new);
    surface.iridescence = other("KHR_materials_iridescence")
        .and_then(|iridescence| self::iridescence(iridescence, textures))
        .map(Box::new);
    surface.sheen = other("KHR_materials_sheen").and_then(|sheen| self::sheen(sheen, textures)).map(Box::new);
    surface.coat = other("KHR_materials_clearcoat").and_then(|coat| self::coat(coat, textures)).map(Box::new);
    surface
}

/// A number of an extension, clamped to a range.
fn number_of(extension: &Value, name: &str, default: f32, (low, high): (f32, f32)) -> f32 {
    extension.get(name).and_then(Value::as_f64).map_or(default, |x| within(x as f32, low, high, default))
}

/// A colour of an extension, clamped to 0 … 1; missing components are `default`.
fn color_of(extension: &Value, name: &str, default: f32) -> Vec3 {
    let color = extension.get(name);
    let part = |k: usize| color.and_then(|color| color.get(k)?.as_f64());
    Vec3::from([0, 1, 2].map(|k| part(k).map_or(default, |c| within(c as f32, 0.0, 1.0, default))))
}

/// Converts KHR_materials_anisotropy; `None` where its strength is zero.
fn anisotropy(extension: &Value, textures: &mut Textures) -> Option<Anisotropy> {
    let strength = number_of(extension, "anisotropyStrength", 0.0, (0.0, 1.0));
    (strength > 0.0).then(|| Anisotropy {
        strength,
        rotation: number_of(extension, "anisotropyRotation", 0.0, (f32::MIN, f32::MAX)),
        map: map_of(extension, "anisotropyTexture", textures),
    })
}

/// Converts KHR_materials_iridescence; `None` where its strength is zero.
fn iridescence(extension: &Value, textures: &mut Textures) -> Option<Iridescence> {
    let strength = number_of(extension, "iridescenceFactor", 0.0, (0.0, 1.0));
    let thickness = |name: &str, default| number_of(extension, name, default, (0.0, f32::MAX));
    let mut map = |name: &str| map_of(extension, name, textures);
    (strength > 0.0).then(|| Iridescence {
        strength,
        strength_map: map("iridescenceTexture"),
        ior: number_of(extension, "iridescenceIor", 1.3, (1.0, f32::MAX)),
        thickness: [thickness("iridescenceThicknessMinimum", 100.0), thickness("iridescenceThicknessMaximum", 400.0)],
        thickness_map: map("iridescenceThicknessTexture"),
    })
}

/// Converts KHR_materials_sheen; `None` where its colour is black.
fn sheen(extension: &Value, textures: &mut Textures) -> Option<Sheen> {
    let color = color_of(extension, "sheenColorFactor", 0.0);
    let mut map = |name: &str| map_of(extension, name, textures);
    (color != Vec3::ZERO).then(|| Sheen {
        color,
        color_map: map("sheenColorTexture"),
        roughness: number_of(extension, "sheenRoughnessFactor", 0.0, (0.0, 1.0)),
        roughness_map: map("sheenRoughnessTexture"),
    })
}

/// Converts KHR_materials_diffuse_transmission; `None` where nothing is transmitted.
fn diffuse_transmission(extension: &Value, textures: &mut Textures) -> Option<DiffuseTransmission> {
    let share = number_of(extension, "diffuseTransmissionFactor", 0.0, (0.0, 1.0));
    let mut map = |name: &str| map_of(extension, name, textures);
    (share > 0.0).then(|| DiffuseTransmission {
        share,
        share_map: map("diffuseTransmissionTexture"),
        color: color_of(extension, "diffuseTransmissionColorFactor", 1.0),
        color_map: map("diffuseTransmissionColorTexture"),
    })
}

/// Converts KHR_materials_clearcoat; `None` where its strength is zero.
fn coat(extension: &Value, textures: &mut Textures) -> Option<Coat> {
    let number = |name: &str| number_of(extension, name, 0.0, (0.0, 1.0));
    let strength = number("clearcoatFactor");
    if strength <= 0.0 {
        return None;
    }
    let scale = extension.get("clearcoatNormalTexture").and_then(|t| t.get("scale")).and_then(Value::as_f64);
    let mut map = |name: &str| map_of(extension, name, textures);
    Some(Coat {
        strength,
        strength_map: map("clearcoatTexture"),
        roughness: number("clearcoatRoughnessFactor"),
        roughness_map: map("clearcoatRoughnessTexture"),
        normal_map: map("clearcoatNormalTexture"),
        normal_scale: scale.map_or(1.0, |s| s as f32),
    })
}

/// A map of an extension, registered in `textures`.
fn map_of(extension: &Value, name: &str, textures: &mut Textures) -> Option<TextureRef> {
    textures.info(info_of(Some(extension), name).as_ref())
}

/// A map of an extension, as in the document.
fn info_of(extension: Option<&Value>, name: &str) -> Option<json::texture::Info> {
    serde_json::from_value(extension?.get(name)?.clone()).ok()
}

/// Converts KHR_materials_pbrSpecularGlossiness to a dielectric whose reflectance at normal incidence is the specular colour, by
/// the special index 0 of KHR_materials_ior. The material's other properties are a fallback and unused.
fn from_specular_glossiness(extension: &Value, material: &mut Material, textures: &mut Textures) -> MetalRough {
    let opacity = extension.get("diffuseFactor").and_then(|color| color.get(3)?.as_f64());
    let mut map = |name: &str| map_of(extension, name, textures);
    material.base_color = color_of(extension, "diffuseFactor", 1.0);
    material.opacity = opacity.map_or(1.0, |opacity| within(opacity as f32, 0.0, 1.0, 1.0));
    material.base_color_map = map("diffuseTexture");
    let specular_color_map = map("specularGlossinessTexture");
    let gloss = number_of(extension, "glossinessFactor", 1.0, (0.0, 1.0));
    let metal_rough_map = textures.roughness(info_of(Some(extension), "specularGlossinessTexture").as_ref(), gloss);
    MetalRough {
        metallic: 0.0,
        // The map contains the glossiness factor, too.
        roughness: if metal_rough_map.is_some() { 1.0 } else { 1.0 - gloss },
        metal_rough_map,
        specular_color: color_of(extension, "specularFactor", 1.0),
        specular_color_map,
        ior: 0.0,
        ..MetalRough::default()
    }
}
