//! Files that exceed the memory limit or would overflow the stack: one fault, before any is used.

use super::*;

fn limited(memory: u64) -> LoadOptions {
    LoadOptions { limits: Limits { memory, ..Limits::default() }, ..LoadOptions::default() }
}

/// The only fault of a refused file.
fn refused(path: &Path, bytes: &[u8], memory: u64) -> String {
    match load_bytes(path, bytes.to_vec(), &limited(memory)) {
        Err(LoadError::Input(faults)) if faults.len() == 1 => faults[0].to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn parsed_json_is_charged_before_it_is_parsed() {
    let digits = vec!["0"; 100_000].join(",");
    let text = format!(r#"{{"asset": {{"version": "2.0"}}, "extras": [{digits}]}}"#);
    assert!(load_bytes(Path::new("a.gltf"), text.clone().into_bytes(), &limited(20 << 20)).is_ok());
    let message = refused(Path::new("a.gltf"), text.as_bytes(), 5 << 20);
    assert!(message.starts_with("a.gltf: the JSON, once it is parsed, is too large: "), "{message}");
    assert!(message.ends_with("; raise --max-memory"), "{message}");
    let message = refused(Path::new("a.gltf"), text.as_bytes(), 100_000);
    assert!(message.starts_with("a.gltf: the file is too large: "), "{message}");
}

#[test]
fn empty_objects_are_charged_for_what_they_become() {
    let objects = vec!["{}"; 100_000].join(",");
    let text = format!(r#"{{"asset": {{"version": "2.0"}}, "materials": [{objects}]}}"#);
    let message = refused(Path::new("a.gltf"), text.as_bytes(), 150 << 20);
    assert!(message.starts_with("a.gltf: the document is too large: "), "{message}");
}

#[test]
fn deep_nesting_is_one_line_wherever_it_is() {
    for (open, close) in [("[", "]"), ("{\"a\":", "}")] {
        for (depth, closed) in [(130, true), (1_000_000, true), (1_000_000, false)] {
            let close = if closed { close.repeat(depth) } else { String::new() };
            let text = format!(r#"{{"asset": {{"version": "2.0"}}, "extras": {}0{close}}}"#, open.repeat(depth));
            let message = refused(Path::new("a.gltf"), text.as_bytes(), 8 << 30);
            let why = format!("it is nested {} deep where 127 are allowed", depth + 1);
            let remedy = "export it with less in each other";
            assert_eq!(message, format!("a.gltf: the JSON cannot be read: {why}; {remedy}"));
        }
    }
}

#[test]
fn a_file_that_is_named_many_times_is_read_and_charged_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let mut bytes = std::mem::take(&mut file.bytes);
    bytes.resize(1 << 20, 0);
    std::fs::write(folder.path().join("b.bin"), bytes).unwrap();
    file.set("buffers", (0..100).map(|_| json!({"uri": "b.bin", "byteLength": 1 << 20})).collect());
    file.set("images", (0..100).map(|_| json!({"uri": "b.bin", "mimeType": "image/png"})).collect());
    file.root["bufferViews"][0]["buffer"] = json!(99);
    let path = folder.path().join("a.gltf");
    let loaded = load_bytes(&path, file.gltf(), &limited(4 << 20)).unwrap();
    assert_eq!(loaded.scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(loaded.facts.files.len(), 2);
    assert!(!codes(&loaded).contains(&"over-memory"), "{:?}", loaded.warnings);
    let message = refused(&path, &file.gltf(), 1 << 20);
    assert!(message.contains("buffers[0].uri: the buffer is too large: 1048576 bytes are needed"), "{message}");
}

#[test]
fn data_in_the_file_is_charged_before_it_is_decoded() {
    let mut file = Builder::new();
    let (positions, indices) = (file.floats("VEC3", &[0.0; 300_000]), file.shorts(&[0, 1, 2]));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let bytes = file.gltf();
    let message = refused(Path::new("a.gltf"), &bytes, 5 * bytes.len() as u64 / 2);
    assert!(message.contains("buffers[0].uri: the buffer is too large"), "{message}");

    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("images", json!([{"uri": format!("data:image/png;base64,{}", "A".repeat(1 << 20))}]));
    let bytes = file.gltf();
    let loaded = load_bytes(Path::new("a.gltf"), bytes.clone(), &limited(5 * bytes.len() as u64 / 2)).unwrap();
    assert_eq!(codes(&loaded), ["over-memory"]);
}

#[test]
fn sets_of_texture_coordinates_and_tangents_are_charged() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    let primitive = json!({"attributes": {"POSITION": positions, "TEXCOORD_65535": uvs}});
    file.set("meshes", json!([{"primitives": vec![primitive; 10]}]));
    assert!(load_bytes(Path::new("a.gltf"), file.gltf(), &limited(20 << 20)).is_ok());
    // An empty set takes three words.
    let less = (10 << 20) * size_of::<usize>() as u64 / 8;
    let message = refused(Path::new("a.gltf"), &file.gltf(), less);
    assert!(message.starts_with("a.gltf: what the meshes hold is too large: "), "{message}");

    let mut file = Builder::new();
    let (positions, uvs) = (file.floats("VEC3", &[0.0; 9000]), file.floats("VEC2", &[0.0; 6000]));
    file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
    file.set("images", json!([{"uri": picture()}]));
    file.set("textures", json!([{"source": 0}]));
    for (map, fits) in [("emissiveTexture", true), ("normalTexture", false)] {
        file.set("materials", json!([{map: {"index": 0}}]));
        let loaded = load_bytes(Path::new("a.gltf"), file.gltf(), &limited(800_000));
        assert_eq!(loaded.is_ok(), fits, "{loaded:?}");
    }
}

#[test]
fn morph_targets_without_weight_cost_nothing() {
    let mut file = Builder::new();
    let positions = file.floats("VEC3", &[0.0; 9000]);
    let targets = vec![json!({"POSITION": positions}); 100];
    let primitive = json!({"attributes": {"POSITION": positions}, "targets": targets});
    for (weight, fits) in [(0, true), (1, false)] {
        file.set("meshes", json!([{"primitives": [primitive], "weights": vec![weight; 100]}]));
        assert_eq!(load_bytes(Path::new("a.gltf"), file.gltf(), &limited(2_000_000)).is_ok(), fits, "{weight}");
    }
}

#[test]
fn animated_weights_are_charged_for_every_node_that_has_them() {
    const TARGETS: usize = 2_000;
    const NODES: usize = 2_000;
    let mut file = Builder::new();
    let positions = file.triangle();
    let targets: Vec<Value> = (0..TARGETS).map(|_| json!({})).collect();
    file.primitive(json!({"attributes": {"POSITION": positions}, "targets": targets}));
    file.set("nodes", (0..NODES).map(|_| json!({"mesh": 0})).collect());
    file.set("scenes", json!([{"nodes": (0..NODES).collect::<Vec<_>>()}]));
    let input = file.floats("SCALAR", &[0.0]);
    let zeros = json!({"componentType": 5126, "type": "SCALAR", "count": TARGETS});
    let output = file.push("accessors", zeros);
    let channel = |node| json!({"sampler": 0, "target": {"node": node, "path": "weights"}});
    let channels: Vec<Value> = (0..NODES).map(channel).collect();
    file.set("animations", json!([{"channels": channels, "samplers": [{"input": input, "output": output}]}]));
    let load = |moment: Option<crate::load::Moment>| {
        let options = LoadOptions { moment, ..limited(40 << 20) };
        load_bytes(Path::new("a.gltf"), file.gltf(), &options)
    };
    assert!(load(None).is_ok());
    let at_start = crate::load::Moment { animation: None, time: 0.0 };
    assert!(matches!(load(Some(at_start)), Err(LoadError::Input(faults)) if faults[0].code == "over-memory"));
}
