//! KHR_materials_variants: the materials of the requested variant.
//!
//! A primitive keeps its own material if no variant is requested, or if the variant does not map it.

use super::codes::Code;
use super::report::Report;
use super::schema::position;
use super::tree::{Tree, Value};
use gltf::json::Root;
use gltf::json::mesh::Primitive;

const NAME: &str = "KHR_materials_variants";

/// Returns the names of all variants of a document that has passed the schema check.
pub(super) fn names(root: &Value) -> Vec<String> {
    let list = root.pointer("/extensions/KHR_materials_variants/variants").and_then(Value::as_array);
    let name = |variant: &Value| variant.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
    list.into_iter().flatten().map(name).collect()
}

/// Index of a primitive's material in a variant; `None`: the default material.
pub(super) fn material(primitive: &Primitive, variant: Option<usize>) -> Option<usize> {
    let mapped = variant.and_then(|variant| mapped(extension(primitive), variant).next());
    mapped.map(|(_, material)| material).or(primitive.material.map(|material| material.value()))
}

/// Like [`material`], for a primitive in JSON.
pub(super) fn material_in(primitive: &Value, variant: Option<usize>) -> Option<usize> {
    let extension = primitive.get("extensions").and_then(|e| e.get(NAME));
    let mapped = variant.and_then(|variant| mapped(extension, variant).next());
    mapped.map(|(_, material)| material).or_else(|| primitive.get("material").and_then(position))
}

fn extension(primitive: &Primitive) -> Option<&serde_json::Value> {
    primitive.extensions.as_ref()?.others.get(NAME)
}

/// Warns of primitives with two mappings for the variant.
pub(super) fn check(root: &Root, variant: usize, report: &mut Report) {
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let mut mappings = mapped(extension(primitive), variant).map(|(mapping, _)| mapping);
            if let (Some(first), Some(again)) = (mappings.next(), mappings.next()) {
                let place = format!("meshes[{i}].primitives[{k}].extensions.{NAME}.mappings[{again}]");
                let text = format!("variant {variant} has a material in mapping {first}, and that one is taken");
                report.warn(Code::VariantsNonUnique, place, text);
            }
        }
    }
}

/// Mappings of a primitive that contain a variant: index and material of each.
fn mapped<T: Tree>(extension: Option<&T>, variant: usize) -> impl Iterator<Item = (usize, usize)> {
    let mappings = extension.and_then(|e| e.get("mappings")).and_then(T::as_array).into_iter().flatten();
    mappings.enumerate().filter_map(move |(i, mapping)| {
        let variants = mapping.get("variants")?.as_array()?;
        let speaks = variants.iter().any(|v| position(v) == Some(variant));
        Some((i, mapping.get("material").and_then(position)?)).filter(|_| speaks)
    })
}
