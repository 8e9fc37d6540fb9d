//! Whole files, built in memory, one feature each.

mod animation;
#[cfg(any(feature = "draco", feature = "meshopt"))]
mod boxes;
#[cfg(feature = "draco")]
mod draco;
mod geometry;
mod large;
mod materials;
mod memory;
#[cfg(feature = "meshopt")]
mod meshopt;
mod morphs;
mod mutated;
mod nodes;
mod pointers;
mod refused;
mod spared;
mod variants;

use crate::load::{Limits, LoadError, LoadOptions, Loaded, load_bytes};
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::scene::{AlphaMode, Falloff, Filter, LightKind, Mipmaps, Pixels, Projection, Reflection, Wrap};
use base64::Engine as _;
use serde_json::{Value, json};
use std::path::Path;

/// A file under construction: JSON, and one buffer that grows with every accessor.
struct Builder {
    root: Value,
    bytes: Vec<u8>,
}

impl Builder {
    /// A file with one node, which has mesh 0.
    fn new() -> Self {
        let root = json!({
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}], "scene": 0,
            "nodes": [{"mesh": 0}],
            "accessors": [], "bufferViews": [],
        });
        Self { root, bytes: Vec::new() }
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.root[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, data: &[u8], more: &[(&str, Value)]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": data.len()});
        more.iter().for_each(|(name, value)| view[*name] = value.clone());
        self.bytes.extend(data);
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, data: &[u8], component: u32, kind: &str, count: usize, normalized: bool) -> usize {
        let view = self.view(data, &[]);
        let accessor = json!({"bufferView": view, "componentType": component, "type": kind, "count": count, "normalized": normalized});
        self.push("accessors", accessor)
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&data, 5126, kind, values.len() / width, false)
    }

    fn shorts(&mut self, values: &[u16]) -> usize {
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&data, 5123, "SCALAR", values.len(), false)
    }

    /// The unit triangle in the xy plane, as positions.
    fn triangle(&mut self) -> usize {
        self.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.])
    }

    /// Sets mesh 0 to this primitive alone.
    fn primitive(&mut self, primitive: Value) -> &mut Self {
        self.root["meshes"] = json!([{"primitives": [primitive]}]);
        self
    }

    fn set(&mut self, name: &str, value: Value) -> &mut Self {
        self.root[name] = value;
        self
    }

    fn gltf(&self) -> Vec<u8> {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let mut root = self.root.clone();
        if !self.bytes.is_empty() {
            let uri = format!("data:application/octet-stream;base64,{data}");
            root["buffers"] = json!([{"byteLength": self.bytes.len(), "uri": uri}]);
        }
        root.as_object_mut().unwrap().retain(|_, v| v.as_array().is_none_or(|list| !list.is_empty()));
        root.to_string().into_bytes()
    }

    fn glb(&self) -> Vec<u8> {
        let mut root = self.root.clone();
        root["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        let mut json = root.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bytes.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let total = 12 + 8 + json.len() + 8 + bin.len();
        let words = |words: &[u32]| words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
        let json_head = words(&[json.len() as u32, u32::from_le_bytes(*b"JSON")]);
        let bin_head = words(&[bin.len() as u32, u32::from_le_bytes(*b"BIN\0")]);
        [b"glTF".to_vec(), words(&[2, total as u32]), json_head, json, bin_head, bin].concat()
    }

    fn load(&self) -> Loaded {
        load(&self.gltf())
    }

    fn fault(&self) -> String {
        fault(&self.gltf())
    }
}

fn load(bytes: &[u8]) -> Loaded {
    load_bytes(Path::new("a.gltf"), bytes.to_vec(), &LoadOptions::default()).unwrap()
}

fn fault(bytes: &[u8]) -> String {
    match load_bytes(Path::new("a.gltf"), bytes.to_vec(), &LoadOptions::default()) {
        Err(LoadError::Input(faults)) => faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"),
        other => panic!("{other:?}"),
    }
}

/// Codes of the warnings, except those about missing bounds of positions.
fn codes(loaded: &Loaded) -> Vec<&'static str> {
    let all = loaded.warnings.iter().map(|w| w.code);
    all.filter(|c| *c != "gltf-mesh-primitive-position-accessor-without-bounds").collect()
}

/// A data URI with a PNG of one pixel.
fn picture() -> String {
    encoded(&image::DynamicImage::new_rgb8(1, 1))
}

/// A data URI with a PNG.
fn encoded(image: &image::DynamicImage) -> String {
    let mut out = std::io::Cursor::new(Vec::new());
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(out.into_inner()))
}

#[test]
fn gltf_and_glb_give_the_same_scene() {
    let mut file = Builder::new();
    let (positions, indices) = (file.triangle(), file.shorts(&[0, 1, 2]));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    for (bytes, format) in [(file.gltf(), "glTF 2.0"), (file.glb(), "glTF 2.0 (binary)")] {
        let loaded = load(&bytes);
        assert_eq!(loaded.facts.format, format);
        assert_eq!((loaded.facts.faces, codes(&loaded).len()), (1, 0));
        let mesh = &loaded.scene.meshes[0];
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert!(mesh.normals.is_empty());
        assert_eq!(loaded.scene.instances.len(), 1);
    }
}

#[test]
fn data_that_is_used_for_two_things_is_read_twice_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let indices = file.shorts(&[0, 1, 2]);
    file.root["accessors"][indices]["bufferView"] = json!(0);
    // The first two shorts of the positions are zeros, and index the same vertex.
    file.root["accessors"][indices]["count"] = json!(2);
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 3}));
    assert_eq!(codes(&file.load()), ["gltf-buffer-view-target-override"]);
    file.primitive(json!({"attributes": {"POSITION": positions, "_CUSTOM": indices}, "indices": indices}));
    let told = file.load().warnings.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert!(told.iter().any(|line| line.contains("2 elements for 3 vertices")), "{told:?}");
}

#[test]
fn a_buffer_of_another_media_type_is_read_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let text = String::from_utf8(file.gltf()).unwrap();
    let loaded = load(text.replace("data:application/octet-stream", "data:text/plain").as_bytes());
    assert_eq!(codes(&loaded), ["gltf-buffer-data-uri-mime-type-invalid"]);
    assert_eq!(loaded.scene.meshes.len(), 1);
    assert!(codes(&load(text.replace("data:application/octet-stream", "data:").as_bytes())).is_empty());
}

#[test]
fn other_versions_and_unknown_extensions_are_named() {
    assert!(fault(br#"{"asset": {"version": "1.0"}}"#).contains("glTF 1.0"));
    assert!(fault(br#"{"buffers": {"b": {}}, "techniques": {}}"#).contains("glTF 1.0"));
    assert!(fault(br#"{"asset": {"version": "3.0"}}"#).contains("only glTF 2"));
    let required = json!({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_techniques_webgl"],
        "extensionsUsed": ["KHR_techniques_webgl"]});
    assert!(fault(required.to_string().as_bytes()).contains("metallic-roughness materials"));
    assert!(fault(b"{}").contains("'asset' is missing"));
    assert!(fault(b"[]").contains("no glTF file"));
    assert!(fault(b"{\n\n!").starts_with("a.gltf:3:1: the JSON cannot be read"));
}

#[test]
fn a_buffer_that_is_missing_or_short_refuses_what_needs_it() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let text = String::from_utf8(file.gltf()).unwrap();
    let start = text.find("data:").unwrap();
    let end = start + text[start..].find('"').unwrap();
    let with = |uri: &str| format!("{}{uri}{}", &text[..start], &text[end..]).into_bytes();
    assert!(fault(&with("no-such.bin")).contains("'no-such.bin' is not there"));
    assert!(fault(&with("../../../etc/passwd")).contains("--root"));
    assert!(fault(&with("https://example.org/a.bin")).contains("nothing is fetched"));
    assert!(fault(&with("data:,short")).contains("3 elements are declared, the data ends after 0"));
}

#[test]
fn a_file_without_anything_to_draw_is_an_empty_scene() {
    let loaded = load(br#"{"asset": {"version": "2.0", "generator": "me"}}"#);
    assert!(loaded.scene.instances.is_empty() && loaded.warnings.is_empty());
    assert_eq!(loaded.facts.generator, "me");
}
