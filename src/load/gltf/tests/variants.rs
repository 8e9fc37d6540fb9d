//! KHR_materials_variants: the material of each primitive in each variant.

use super::*;

/// Two primitives: the first has a material for every variant, the second for none.
fn shoe() -> Builder {
    let mut file = Builder::new();
    let positions = file.triangle();
    let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    let attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
    let mappings = json!([{"material": 1, "variants": [0, 2]}, {"material": 2.0, "variants": [1.0]}]);
    file.set(
        "meshes",
        json!([{"primitives": [
        {"attributes": attributes, "material": 0, "extensions": {"KHR_materials_variants": {"mappings": mappings}}},
        {"attributes": attributes, "material": 0}]}]),
    );
    file.set("images", json!([{"uri": picture()}]));
    file.set("textures", json!([{"source": 0}]));
    file.set(
        "materials",
        json!([{"name": "own"}, {"name": "beach"},
        {"name": "street", "normalTexture": {"index": 0},
         "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]),
    );
    file.set("extensionsUsed", json!(["KHR_materials_variants"]));
    let names = json!([{"name": "Beach"}, {"name": "Street"}, {"name": "1"}]);
    file.set("extensions", json!({"KHR_materials_variants": {"variants": names}}));
    file
}

fn with(file: &Builder, variant: &str) -> Result<Loaded, String> {
    let options = LoadOptions { variant: Some(variant.into()), ..LoadOptions::default() };
    load_bytes(Path::new("a.gltf"), file.gltf(), &options).map_err(|e| e.to_string())
}

/// Names of the primitives' materials.
fn shown(loaded: &Loaded) -> Vec<&str> {
    let scene = &loaded.scene;
    scene.meshes.iter().map(|mesh| scene.materials[mesh.material as usize].name.as_str()).collect()
}

#[test]
fn a_variant_is_chosen_by_name_or_number_and_what_it_does_not_map_stays() {
    let file = shoe();
    let plain = file.load();
    assert_eq!((shown(&plain), plain.facts.variant), (vec!["own", "own"], None));
    assert_eq!(plain.facts.variants, ["Beach", "Street", "1"]);
    let [extension] = &plain.facts.extensions[..] else { panic!("{:?}", plain.facts.extensions) };
    assert_eq!(extension.name, "KHR_materials_variants");
    assert!(!extension.required && extension.supported);
    assert!(codes(&plain).is_empty(), "{:?}", plain.warnings);

    for (wish, materials, number) in
        [("Beach", ["beach", "own"], 0), ("Street", ["street", "own"], 1), ("0", ["beach", "own"], 0)]
    {
        let loaded = with(&file, wish).unwrap();
        assert_eq!((shown(&loaded), loaded.facts.variant), (materials.to_vec(), Some(number)), "{wish}");
        assert!(codes(&loaded).is_empty(), "{:?}", loaded.warnings);
    }
    // Names take precedence over numbers.
    assert_eq!(with(&file, "1").unwrap().facts.variant, Some(2));
}

#[test]
fn images_and_vertex_data_follow_the_variant() {
    let file = shoe();
    let plain = file.load();
    assert!(plain.scene.bitmaps.is_empty() && plain.scene.meshes.iter().all(|mesh| mesh.uvs.is_empty()));
    let street = with(&file, "Street").unwrap().scene;
    assert_eq!((street.bitmaps.len(), street.materials.len()), (1, 2));
    assert!(!street.meshes[0].uvs.is_empty() && street.meshes[1].uvs.is_empty());
    assert!(!street.meshes[0].tangents.is_empty() && street.meshes[1].tangents.is_empty());
}

#[test]
fn what_a_material_lacks_is_told_of_the_variant_that_is_shown() {
    let mut file = shoe();
    file.root["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    let lacks = "gltf-mesh-primitive-too-few-texcoords";
    assert!(!codes(&file.load()).contains(&lacks) && !codes(&with(&file, "Beach").unwrap()).contains(&lacks));
    assert!(codes(&with(&file, "Street").unwrap()).contains(&lacks));
}

#[test]
fn a_wrong_variant_is_one_line_that_lists_what_there_is() {
    let place = "a.gltf:extensions.KHR_materials_variants.variants: there is no variant";
    let file = shoe();
    for wish in ["Lagoon", "3", "-1", ""] {
        let expected = format!("{place} '{wish}'; it has 0 'Beach', 1 'Street', 2 '1'");
        assert_eq!(with(&file, wish).unwrap_err(), expected);
    }
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    assert_eq!(with(&file, "0").unwrap_err(), format!("{place} '0'; the file has none"));
}

#[test]
fn of_two_mappings_for_a_variant_the_first_counts_with_a_warning() {
    let mut file = shoe();
    let mappings = &mut file.root["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"];
    mappings.as_array_mut().unwrap().push(json!({"material": 0, "variants": [1]}));
    assert!(codes(&file.load()).is_empty() && codes(&with(&file, "Beach").unwrap()).is_empty());
    let loaded = with(&file, "Street").unwrap();
    assert_eq!(shown(&loaded), ["street", "own"]);
    let warning = loaded.warnings.iter().find(|w| codes(&loaded).contains(&w.code)).unwrap().to_string();
    let place = "a.gltf:meshes[0].primitives[0].extensions.KHR_materials_variants.mappings[2]";
    assert!(warning.starts_with(&format!("{place}: variant 1 has a material in mapping 1")), "{warning}");
}

#[test]
fn a_mapping_to_what_is_not_there_refuses_the_file() {
    for (mapping, part) in [
        (json!({"material": 7, "variants": [0]}), "material: index 7, but only 3 materials are there"),
        (json!({"material": 0, "variants": [9]}), "variants[0]: index 9, but only 3"),
        (json!({"material": 0}), "'variants' is missing"),
    ] {
        let mut file = shoe();
        file.root["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = json!([mapping]);
        let fault = file.fault();
        assert!(fault.starts_with("a.gltf:meshes[0].primitives[0].extensions.KHR_materials_variants.mappings[0]"));
        assert!(fault.contains(part), "{fault}");
    }
}
