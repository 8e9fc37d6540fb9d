//! `[materials.NAME]`.

use super::reader::{Table, boolean, color, ior, within, within32, word};
use crate::math::Vec3;
use crate::scene::{AlphaMode, Material, MetalRough, Phong, Reflection};

#[derive(Clone, Copy, PartialEq)]
enum Model {
    Phong,
    Pbr,
    Unlit,
}

/// Keys of the model `pbr` alone: meeting one without `model` means that `model` was forgotten.
const PBR_KEYS: [&str; 4] = ["base_color", "metallic", "roughness", "thick"];

/// Reads one material.
pub(super) fn material(name: &str, table: Table) -> Material {
    let model = table
        .get("model", word(&[("phong", Model::Phong), ("pbr", Model::Pbr), ("unlit", Model::Unlit)]))
        .unwrap_or(Model::Phong);
    if model == Model::Phong && !table.has("model") {
        hint_at_model(&table);
    }
    let (base_color, reflection) = match model {
        Model::Phong => phong(&table),
        Model::Pbr => metal_rough(&table),
        Model::Unlit => (table.get("color", color).unwrap_or(Vec3::ONE), Reflection::Unlit),
    };
    let opacity = table.get("opacity", within32(0.0, 1.0)).unwrap_or(1.0);
    let emission = if model == Model::Unlit { None } else { table.get("emission", color) };
    let material = Material {
        name: name.into(),
        base_color,
        opacity,
        alpha_mode: if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
        double_sided: table.get("double_sided", boolean).unwrap_or(true),
        emission: emission.unwrap_or(Vec3::ZERO),
        reflection,
        ..Material::default()
    };
    table.finish();
    material
}

fn hint_at_model(table: &Table) {
    if let Some(key) = PBR_KEYS.iter().find(|key| table.has(key)) {
        let at = table.place_of(key);
        table.note(&at, format!("`{key}` belongs to another model than phong"), "add model = \"pbr\"");
    }
}

#[expect(clippy::cast_possible_truncation, reason = "materials are f32")]
fn index(table: &Table, default: f32) -> f32 {
    table.get("ior", ior).map_or(default, |n| n as f32)
}

fn dispersion(table: &Table) -> f32 {
    table.get("dispersion", within32(0.0, 20.0)).unwrap_or(0.0)
}

#[expect(clippy::cast_possible_truncation, reason = "materials are f32")]
fn phong(table: &Table) -> (Vec3, Reflection) {
    let diffuse = table.get("diffuse", color).unwrap_or(Vec3::splat(0.6));
    let weight = |key| table.get(key, color).unwrap_or(Vec3::ZERO);
    let phong = Phong {
        ambient: table.get("ambient", color).unwrap_or(diffuse),
        specular: weight("specular"),
        shininess: table.get("shininess", within(0.0, 1e6)).map_or(1.0, |n| n as f32),
        mirror: weight("mirror"),
        transmission: weight("transmission"),
        ior: index(table, 1.0),
        fresnel: table.get("fresnel", boolean).unwrap_or(false),
        dispersion: dispersion(table),
        ..Phong::default()
    };
    (diffuse, Reflection::Phong(phong))
}

fn metal_rough(table: &Table) -> (Vec3, Reflection) {
    let part = |key, default| table.get(key, within32(0.0, 1.0)).unwrap_or(default);
    let surface = MetalRough {
        metallic: part("metallic", 0.0),
        roughness: part("roughness", 0.5),
        transmission: part("transmission", 0.0),
        ior: index(table, 1.5),
        thick: table.get("thick", boolean).unwrap_or(true),
        absorption: MetalRough::absorption_of(
            table.get("attenuation_color", color).unwrap_or(Vec3::ONE),
            table.get("attenuation_distance", within(0.0, 1e30)).map_or(f32::INFINITY, |d| d as f32),
        ),
        dispersion: dispersion(table),
        ..MetalRough::default()
    };
    (table.get("base_color", color).unwrap_or(Vec3::ONE), Reflection::MetalRough(surface))
}
