//! Faults in parts that a picture can do without: declared bounds, cameras, properties of materials and lights.

use super::*;

/// A triangle whose positions declare these bounds.
fn bounded(min: Value, max: Value) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.root["accessors"][positions]["min"] = min;
    file.root["accessors"][positions]["max"] = max;
    file.primitive(json!({"attributes": {"POSITION": positions}})).load()
}

#[test]
fn bounds_of_a_wrong_length_or_kind_are_told_and_nothing_hangs_on_them() {
    let right = json!([1, 1, 0]);
    for (min, code) in [
        (json!([0, 0]), "gltf-array-length-not-in-list"),
        (json!([0, 0, 0, 0]), "gltf-array-length-not-in-list"),
        (json!(["x", 0, 0]), "gltf-type-mismatch"),
        (json!(null), "gltf-blank"),
    ] {
        let loaded = bounded(min.clone(), right.clone());
        assert_eq!((codes(&loaded), loaded.facts.faces), (vec![code], 1), "{min}");
    }
    let told = bounded(json!([0, 0]), right).warnings[0].to_string();
    let expected = "a.gltf:accessors[0].min: 2 numbers for elements of 3; bounds are computed from the data";
    assert_eq!(told, expected);
    // A component without a number does not shift the others.
    assert_eq!(codes(&bounded(json!([0, 0, 0]), json!([null, 1, 0]))), ["gltf-type-mismatch"]);
}

/// A triangle, and a node with this camera.
fn seen_by(camera: Value) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("nodes", json!([{"mesh": 0, "children": [1]}, {"camera": 0}]));
    file.set("cameras", json!([camera])).load()
}

#[test]
fn a_camera_without_the_planes_that_rays_do_not_need_is_kept() {
    for camera in [
        json!({"type": "perspective", "perspective": {"yfov": 0.8}}),
        json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1}}),
    ] {
        let loaded = seen_by(camera);
        assert_eq!(loaded.scene.cameras.len(), 1);
        let told = || loaded.warnings.iter().filter(|w| w.place.starts_with("cameras"));
        assert!(told().count() > 0 && told().all(|w| w.text.ends_with("is missing")), "{:?}", loaded.warnings);
    }
}

#[test]
fn a_camera_that_cannot_be_read_is_left_out_of_a_model_that_can_be_drawn() {
    let told = |camera: Value| {
        let loaded = seen_by(camera);
        assert_eq!((loaded.facts.faces, loaded.scene.cameras.len()), (1, 0));
        let told = loaded.warnings.iter().filter(|w| w.place.starts_with("cameras"));
        told.map(ToString::to_string).collect::<Vec<_>>()
    };
    let missing = "a.gltf:cameras[0]: 'perspective' is missing; the camera is left out";
    assert_eq!(told(json!({"type": "perspective"})), [missing]);
    for camera in [
        json!({"type": "perspective", "perspective": {"znear": 0.1}}),
        json!({"type": "perspective", "perspective": {"yfov": "wide", "znear": 0.1}}),
        json!({"perspective": {"yfov": 1, "znear": 0.1}}),
        json!(7),
    ] {
        assert!(!told(camera.clone()).is_empty(), "{camera}");
    }
}

#[test]
fn of_two_projections_that_of_the_camera_s_type_counts() {
    let orthographic = json!({"xmag": 3, "ymag": 2, "znear": 0.1, "zfar": 3});
    let perspective = json!({"yfov": 1, "znear": 0.1});
    let loaded = seen_by(json!({"type": "orthographic", "perspective": perspective, "orthographic": orthographic}));
    assert_eq!(codes(&loaded), ["gltf-one-of-mismatch"]);
    assert_eq!(loaded.scene.cameras[0].projection, Projection::Orthographic { x_mag: 3.0, y_mag: 2.0 });
}

/// A triangle with this material, which may use one texture.
fn made_of(material: Value) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
    file.set("images", json!([{"uri": picture()}])).set("textures", json!([{"source": 0}]));
    file.set("materials", json!([material])).load()
}

#[test]
fn what_is_wrong_in_a_material_is_left_out_and_the_rest_of_it_drawn() {
    let red = json!([1, 0, 0, 1]);
    for (material, place) in [
        (json!({"emissiveFactor": [4, 0, 0, 1]}), "materials[0].emissiveFactor"),
        (json!({"normalTexture": {"index": 7}}), "materials[0].normalTexture.index"),
        (json!({"normalTexture": {"texCoord": 0}}), "materials[0].normalTexture"),
        (json!({"occlusionTexture": 3}), "materials[0].occlusionTexture"),
        (json!({"doubleSided": 1}), "materials[0].doubleSided"),
        (json!({"name": 5}), "materials[0].name"),
        (json!({"alphaCutoff": "half"}), "materials[0].alphaCutoff"),
    ] {
        let mut material = material;
        material["pbrMetallicRoughness"] = json!({"baseColorFactor": red, "baseColorTexture": {"index": 0}});
        let loaded = made_of(material.clone());
        let drawn = &loaded.scene.materials[loaded.scene.meshes[0].material as usize];
        assert_eq!((drawn.base_color, drawn.base_color_map.is_some()), (Vec3::X, true), "{material}");
        assert!(drawn.normal_map.is_none() && drawn.emission == Vec3::ZERO, "{material}");
        let told = loaded.warnings.iter().find(|w| w.place == place);
        assert!(told.is_some_and(|w| w.remedy == "it is left out"), "{material}: {:?}", loaded.warnings);
    }
    // A material that is not an object, and a colour of three numbers.
    let loaded = made_of(json!("red"));
    assert_eq!((loaded.facts.faces, loaded.scene.materials[0].base_color), (1, Vec3::ONE));
    let loaded = made_of(json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0], "metallicFactor": 0}}));
    assert_eq!(loaded.scene.materials[0].metal_rough().unwrap().metallic, 0.0);
}

#[test]
fn what_cannot_be_without_what_is_left_out_refuses_the_file() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("extensionsUsed", json!(["KHR_materials_variants"]));
    file.set("extensions", json!({"KHR_materials_variants": {"variants": [{"name": 5}]}}));
    assert!(file.fault().contains("'name' is missing"), "{}", file.fault());
}

#[test]
fn what_says_that_nothing_is_given_counts_as_not_given() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}, "material": -1, "indices": null, "extras": null}));
    file.root["accessors"][positions]["byteOffset"] = json!(null);
    file.set("nodes", json!([{"mesh": 0, "skin": -1, "camera": null, "matrix": null, "children": [1]}, null]));
    file.set("animations", json!(null));
    let loaded = file.load();
    assert_eq!((loaded.facts.faces, codes(&loaded)), (1, vec!["gltf-blank"]));
    let told = loaded.warnings.iter().find(|w| w.code == "gltf-blank").unwrap();
    assert_eq!(told.text, "null, or -1 as an index, counts as not given (8 times)");
    // Values of any type may be null or −1.
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.root["asset"]["extras"] = json!({"source": -1, "light": null});
    file.set("extensionsUsed", json!(["VRM"])).set("extensions", json!({"VRM": {"mesh": -1, "meta": null}}));
    assert!(codes(&file.load()).is_empty(), "{:?}", file.load().warnings);
    // Required properties are missing all the same.
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.root["accessors"][positions]["count"] = json!(null);
    assert!(file.fault().contains("'count' is missing"), "{}", file.fault());
}

#[test]
fn lights_that_cannot_be_read_are_dark_and_the_model_is_drawn() {
    let lit = |lights: Value, light: Value| {
        let mut file = Builder::new();
        let positions = file.triangle();
        file.primitive(json!({"attributes": {"POSITION": positions}}));
        file.set("extensionsUsed", json!(["KHR_lights_punctual"]));
        file.set("extensions", json!({"KHR_lights_punctual": {"lights": lights}}));
        let node = json!({"extensions": {"KHR_lights_punctual": {"light": light}}});
        file.set("nodes", json!([{"mesh": 0, "children": [1]}, node])).load()
    };
    let sun = json!({"type": "directional", "color": [1, 0, 0, 1]});
    let loaded = lit(json!([sun]), json!(0));
    assert_eq!((loaded.facts.faces, loaded.scene.lights.len()), (1, 1));
    // Spot angles have defaults.
    let loaded = lit(json!([{"type": "spot"}]), json!(0));
    assert_eq!((loaded.facts.faces, loaded.scene.lights.len()), (1, 1));
    for (lights, light) in [
        (json!([{"color": [1, 1, 1]}]), json!(0)),
        (json!([{"type": "point"}]), json!(3)),
        (json!(null), json!(0)),
        (json!("none"), json!(0)),
    ] {
        let loaded = lit(lights, light);
        assert_eq!(loaded.facts.faces, 1);
        assert!(loaded.warnings.iter().any(|w| w.remedy == "it is left out"), "{:?}", loaded.warnings);
    }
}

#[test]
fn a_buffer_that_is_said_to_be_shorter_than_its_chunk_is_read_as_far_as_its_views_need() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let said = |bytes: usize| format!("\"buffers\":[{{\"byteLength\":{bytes}}}]");
    let (glb, said, other) = (file.glb(), said(file.bytes.len()), said(9) + " ");
    let at = glb.windows(said.len()).position(|part| part == said.as_bytes()).unwrap();
    let mut changed = glb.clone();
    changed[at..at + said.len()].copy_from_slice(other.as_bytes());
    let loaded = load(&changed);
    assert_eq!((loaded.facts.faces, codes(&loaded)), (1, vec!["gltf-buffer-byte-length-mismatch"]));
    assert!(loaded.warnings[0].text.contains("9 bytes are declared, its views need 36"), "{:?}", loaded.warnings);
}

#[test]
fn a_chunk_whose_length_is_a_little_wrong_is_read_where_all_that_is_needed_is_there() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let whole = file.glb();
    let bin = whole.len() - file.bytes.len() - 8;
    // A chunk length that includes its own header, and a file length that ends before the data does.
    let mut wide = whole.clone();
    wide[bin] += 8;
    let mut short = whole.clone();
    let total = (whole.len() as u32 - 20).to_le_bytes();
    short[8..12].copy_from_slice(&total);
    for (bytes, code) in [(wide, "gltf-glb-chunk-too-big"), (short, "gltf-glb-extra-data")] {
        let loaded = load(&bytes);
        assert!(loaded.facts.faces == 1 && codes(&loaded).contains(&code), "{:?}", codes(&loaded));
    }
    // Required data is missing.
    let cut = fault(&whole[..whole.len() - 4]);
    assert!(cut.contains("3 elements are declared, the data ends after 2"), "{cut}");
}

#[test]
fn pictures_are_looked_for_beside_the_model_whatever_machine_they_were_on() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("textures")).unwrap();
    ::image::RgbImage::new(1, 1).save(dir.path().join("textures/tex a.png")).unwrap();
    for (uri, found) in [
        ("textures/tex%20a.png", true),
        ("C:\\Users\\me\\textures\\tex a.png", true),
        ("/home/me/tex%20a.png", true),
        ("file:///C:/Users/me/tex%20a.png", true),
        ("tex%20a.png?v=12", true),
        ("tex%20a.tga", true),
        ("https://example.org/textures/tex%20a.png", false),
        ("other.png", false),
        ("../o/tex%20a.png", true),
    ] {
        let mut file = Builder::new();
        let positions = file.triangle();
        let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
        file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
        file.set("images", json!([{"uri": uri}])).set("textures", json!([{"source": 0}]));
        file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
        let source = crate::load::Source::new(dir.path().join("m.gltf"), file.gltf());
        let loaded = crate::load::load_source(&source, &LoadOptions::default()).unwrap();
        assert_eq!(loaded.scene.materials[0].base_color_map.is_some(), found, "{uri}: {:?}", loaded.warnings);
        let is_told = loaded.warnings.iter().any(|w| w.code == "file-elsewhere");
        assert_eq!(is_told, found && uri != "textures/tex%20a.png", "{uri}: {:?}", loaded.warnings);
        let is_outside = loaded.warnings.iter().any(|w| w.remedy.contains("--root"));
        assert_eq!(is_outside, uri.starts_with("../"), "{uri}: {:?}", loaded.warnings);
    }
}

#[test]
fn buffers_are_looked_for_beside_the_model_too() {
    let dir = tempfile::tempdir().unwrap();
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    std::fs::write(dir.path().join("mesh.bin"), &file.bytes).unwrap();
    let mut root: Value = serde_json::from_slice(&file.gltf()).unwrap();
    let mut load = |uri: &str| {
        root["buffers"][0]["uri"] = json!(uri);
        let source = crate::load::Source::new(dir.path().join("m.gltf"), root.to_string().into_bytes());
        crate::load::load_source(&source, &LoadOptions::default())
    };
    for uri in ["C:\\Users\\me\\mesh.bin", "/home/me/mesh.bin", "data/mesh.bin"] {
        let loaded = load(uri).unwrap();
        assert_eq!((loaded.facts.faces, codes(&loaded)), (1, vec!["file-elsewhere"]), "{uri}");
    }
    assert!(load("https://example.org/mesh.bin").is_err() && load("other.bin").is_err());
}

#[test]
fn names_in_another_coding_and_versions_with_more_or_fewer_numbers_are_read() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("nodes", json!([{"mesh": 0, "name": "?"}]));
    let mut bytes = file.gltf();
    let at = bytes.iter().position(|&byte| byte == b'?').unwrap();
    bytes[at] = 0xfc;
    let loaded = load(&bytes);
    assert_eq!((loaded.facts.faces, codes(&loaded)), (1, vec!["gltf-invalid-json"]));
    for version in ["2", "2.0.1"] {
        file.root["asset"]["version"] = json!(version);
        let loaded = file.load();
        assert_eq!((loaded.facts.faces, codes(&loaded)), (1, vec!["gltf-pattern-mismatch"]), "{version}");
    }
    file.root["asset"]["version"] = json!("two");
    assert!(file.fault().contains("'two' is not of the form 2.0"));
}
