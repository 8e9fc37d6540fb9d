//! Supported extensions, and messages about all others.

use super::codes::Code;
use super::report::Report;
use super::tree::Value;
use crate::load::paths::shorten;
use crate::load::{Diagnostic, ExtensionFacts};
use std::collections::HashSet;
use std::path::Path;

/// Supported completely, as far as a still picture is concerned.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Not supported, but without effect on a picture.
const HARMLESS: &[&str] = &[
    "AGI_articulations",
    "AGI_stk_metadata",
    "CESIUM_RTC",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "FB_geometry_metadata",
    "FB_ngon_encoding",
    "GODOT_single_root",
    "GOOGLE_backgrounds",
    "GRIFFEL_bim_data",
    "HUBS_components",
    "KHR_audio_emitter",
    "KHR_collision_shapes",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_rigid_bodies",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MOZ_hubs_components",
    "MSFT_audio_emitter",
    "MSFT_collision_primitives",
    "MSFT_lod",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
    "MSFT_physics",
    "OMI_audio_emitter",
    "OMI_audio_ogg_vorbis",
    "OMI_collider",
    "OMI_link",
    "OMI_personality",
    "OMI_physics_body",
    "OMI_physics_gravity",
    "OMI_physics_joint",
    "OMI_physics_shape",
    "OMI_seat",
    "OMI_spawn_point",
    "OMI_vehicle_body",
    "OMI_vehicle_hover_thruster",
    "OMI_vehicle_thruster",
    "OMI_vehicle_wheel",
    "VRM",
    "VRMC_node_constraint",
    "VRMC_springBone",
    "VRMC_springBone_extended_collider",
    "VRMC_vrm",
    "VRMC_vrm_animation",
];

/// Returns whether this build includes what an extension needs.
fn is_built(name: &str) -> bool {
    match name {
        "KHR_draco_mesh_compression" => cfg!(feature = "draco"),
        "KHR_texture_basisu" => cfg!(feature = "basisu"),
        _ if name.ends_with("_meshopt_compression") => cfg!(feature = "meshopt"),
        _ => true,
    }
}

/// Remedy for an extension that is required and not supported.
fn remedy(name: &str) -> &'static str {
    match name {
        "KHR_draco_mesh_compression" => "build meshray with the feature 'draco', or export it without Draco",
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "build meshray with the feature 'meshopt', or export it without meshopt compression"
        }
        "KHR_texture_basisu" => "build meshray with the feature 'basisu', or export it with PNG or JPEG textures",
        "KHR_techniques_webgl" => "export it with metallic-roughness materials",
        _ if name.starts_with("KHR_materials_") => {
            "export it without, or take it out of extensionsRequired to draw it without"
        }
        _ => "export it without",
    }
}

/// Most names in one message; the rest is only counted.
const LISTED: usize = 20;

/// The extensions that a file declares.
pub(super) struct Lists {
    used: Vec<String>,
    required: Vec<String>,
}

impl Lists {
    /// Reads the lists from unchecked JSON.
    pub(super) fn of(root: &Value) -> Self {
        let list = |name: &str| {
            let words = root.get(name).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
            words.map(str::to_owned).collect::<Vec<_>>()
        };
        Self { used: list("extensionsUsed"), required: list("extensionsRequired") }
    }

    /// Returns the facts about each extension, without duplicates.
    pub(super) fn facts(&self) -> Vec<ExtensionFacts> {
        let required: HashSet<&String> = self.required.iter().collect();
        let mut seen = HashSet::new();
        let each_once = self.used.iter().chain(&self.required).filter(|name| seen.insert(*name));
        let is_supported = |name: &str| SUPPORTED.contains(&name) && is_built(name);
        let facts = |name: &String| ExtensionFacts {
            name: name.clone(),
            required: required.contains(name),
            supported: is_supported(name),
        };
        each_once.map(facts).collect()
    }

    /// Refuses required extensions that are not supported; one warning names the optional ones that change the look.
    pub(super) fn check(&self, file: &Path, report: &mut Report) {
        let mut ignored = Vec::new();
        for ExtensionFacts { name, required, supported } in self.facts() {
            if supported || HARMLESS.contains(&name.as_str()) {
                continue;
            }
            let name = shorten(&name);
            if required {
                let text = format!("{name} is required to draw this file and not supported");
                let fault = Diagnostic::new("gltf-extension-required", file, "extensionsRequired", text);
                report.fault(fault.remedy(remedy(&name)));
            } else if !has_stand_in(&name) {
                ignored.push(name);
            }
        }
        if !ignored.is_empty() {
            let more = ignored.len().saturating_sub(LISTED);
            ignored.truncate(LISTED);
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            let text = format!("drawn without {}{rest}", ignored.join(", "));
            report.warnings.push(Diagnostic::new("gltf-extensions-ignored", file, "extensionsUsed", text));
        }
        self.check_lists(report);
    }

    fn check_lists(&self, report: &mut Report) {
        let used: HashSet<&String> = self.used.iter().collect();
        for (i, name) in self.required.iter().enumerate().filter(|(_, name)| !used.contains(name)) {
            let text = format!("{} is required but not in extensionsUsed", shorten(name));
            report.add(Code::UnusedExtensionRequired, format!("extensionsRequired[{i}]"), text);
        }
        const QUANTIZATION: &str = "KHR_mesh_quantization";
        let used = self.used.iter().position(|name| name == QUANTIZATION);
        if let Some(i) = used.filter(|_| !self.required.iter().any(|name| name == QUANTIZATION)) {
            let text = format!("{QUANTIZATION} is used but not required");
            report.add(Code::NonRequiredExtension, format!("extensionsUsed[{i}]"), text);
        }
    }
}

/// Returns whether an extension has a fallback in the file; the readers of these report a missing fallback themselves.
fn has_stand_in(name: &str) -> bool {
    name == "MSFT_texture_dds" || !is_built(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn messages(root: serde_json::Value) -> (Vec<String>, Vec<String>) {
        let mut report = Report::new(Path::new("a.gltf"));
        Lists::of(&root.into()).check(Path::new("a.gltf"), &mut report);
        let warnings = report.warnings.clone().into_vec().iter().map(ToString::to_string).collect();
        match report.check() {
            Err(crate::load::LoadError::Input(faults)) => (faults.iter().map(ToString::to_string).collect(), warnings),
            _ => (Vec::new(), warnings),
        }
    }

    #[test]
    fn what_is_required_and_unknown_is_one_line_with_a_remedy() {
        let both = json!(["KHR_materials_subsurface", "KHR_materials_ior"]);
        let (faults, warnings) = messages(json!({"extensionsUsed": both, "extensionsRequired": both}));
        assert_eq!(faults.len(), 1);
        assert!(
            faults[0].starts_with("a.gltf:extensionsRequired: KHR_materials_subsurface is required"),
            "{}",
            faults[0]
        );
        assert!(faults[0].contains("; export it without, or take it out"));
        assert!(warnings.is_empty());
    }

    #[test]
    fn what_is_only_used_is_one_warning_and_nothing_when_harmless() {
        let used =
            json!(["KHR_materials_subsurface", "KHR_xmp", "KHR_materials_volume_scatter", "KHR_texture_transform"]);
        let (faults, warnings) = messages(json!({ "extensionsUsed": used }));
        assert!(faults.is_empty());
        assert_eq!(
            warnings,
            ["a.gltf:extensionsUsed: drawn without KHR_materials_subsurface, KHR_materials_volume_scatter"]
        );
    }

    #[test]
    fn a_hundred_thousand_names_are_told_in_a_few_lines() {
        let names: Vec<String> = (0..100_000).map(|i| format!("MANY_{i}")).collect();
        let (_, warnings) = messages(json!({ "extensionsUsed": names }));
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].ends_with("MANY_19 and 99980 more"), "{}", warnings[0]);
        let (faults, warnings) = messages(json!({ "extensionsRequired": names }));
        assert_eq!((faults.len(), warnings.len()), (21, 1));
        assert!(faults[20].ends_with("99980 more faults"), "{}", faults[20]);
        assert!(warnings[0].contains("MANY_0 is required but not in extensionsUsed (×100000)"), "{}", warnings[0]);
    }
}
