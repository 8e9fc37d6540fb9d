//! Whole files, made in memory, one feature each.

mod animation;
#[cfg(any(feature = "draco", feature = "meshopt"))]
mod boxes;
#[cfg(feature = "draco")]
mod draco;
mod large;
mod materials;
mod memory;
#[cfg(feature = "meshopt")]
mod meshopt;
mod morphs;
mod mutated;
mod spared;
mod variants;

use crate::load::{Limits, LoadError, LoadOptions, Loaded, load_bytes};
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::scene::{AlphaMode, Falloff, Filter, LightKind, Mipmaps, Pixels, Projection, Surface, Wrap};
use base64::Engine as _;
use serde_json::{Value, json};
use std::path::Path;

/// A file under construction: JSON, and one buffer that grows with every accessor.
struct Builder {
    root: Value,
    bytes: Vec<u8>,
}

impl Builder {
    /// A file with one node that shows mesh 0.
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

    /// A file whose mesh 0 is this primitive.
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

/// Codes of warnings, bounds of positions aside, which these files leave out.
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
fn every_index_type_and_no_indices_give_the_same_triangle() {
    for (data, component) in
        [(vec![0u8, 1, 2], 5121), (vec![0, 0, 1, 0, 2, 0], 5123), (vec![0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0], 5125)]
    {
        let mut file = Builder::new();
        let positions = file.triangle();
        let indices = file.accessor(&data, component, "SCALAR", 3, false);
        file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        assert_eq!(file.load().scene.meshes[0].triangles, [[0, 1, 2]]);
    }
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    assert_eq!(file.load().scene.meshes[0].triangles, [[0, 1, 2]]);
}

#[test]
fn indices_that_point_outside_are_refused_with_their_numbers() {
    let mut file = Builder::new();
    let (positions, indices) = (file.triangle(), file.shorts(&[0, 1, 3]));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let message = file.fault();
    assert_eq!(message, "a.gltf:meshes[0].primitives[0].indices: index 3 at position 2, but only 3 vertices exist");
    let mut file = Builder::new();
    let (positions, indices) = (file.triangle(), file.shorts(&[0, 1, 0xffff]));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    assert!(file.fault().contains("asks for a restart"));
}

#[test]
fn interleaved_attributes_are_read_by_their_stride() {
    let mut file = Builder::new();
    let vertex = |p: [f32; 3]| [p[0], p[1], p[2], 0.0, 0.0, 1.0];
    let data: Vec<u8> =
        [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]].into_iter().flat_map(vertex).flat_map(f32::to_le_bytes).collect();
    let view = file.view(&data, &[("byteStride", json!(24))]);
    for offset in [0, 12] {
        let accessor =
            json!({"bufferView": view, "byteOffset": offset, "componentType": 5126, "type": "VEC3", "count": 3});
        file.push("accessors", accessor);
    }
    file.primitive(json!({"attributes": {"POSITION": 0, "NORMAL": 1}}));
    let loaded = file.load();
    assert_eq!(loaded.scene.meshes[0].positions[2], Vec3::Y);
    assert_eq!(loaded.scene.meshes[0].normals, [Vec3::Z; 3]);
}

#[test]
fn sparse_accessors_change_their_base_or_zeros() {
    for base in [true, false] {
        let mut file = Builder::new();
        let positions = file.triangle();
        let indices = file.view(&[1, 0, 2, 0], &[]);
        let values: Vec<u8> = [5f32, 0., 0., 0., 7., 0.].into_iter().flat_map(f32::to_le_bytes).collect();
        let values = file.view(&values, &[]);
        let accessor = &mut file.root["accessors"][positions];
        accessor["sparse"] = json!({"count": 2, "indices": {"bufferView": indices, "componentType": 5123},
            "values": {"bufferView": values}});
        if !base {
            accessor.as_object_mut().unwrap().remove("bufferView");
        }
        file.primitive(json!({"attributes": {"POSITION": positions}}));
        assert_eq!(file.load().scene.meshes[0].positions, [Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 7.0]);
        file.root["accessors"][positions]["sparse"]["count"] = json!(3);
        assert!(file.fault().contains("do not fit its view"));
    }
}

#[test]
fn a_sparse_index_past_the_end_is_refused() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let indices = file.view(&[9, 0, 0, 0], &[]);
    let values = file.view(&[0; 12], &[]);
    file.root["accessors"][positions]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}});
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    assert!(file.fault().contains("accessors[0].sparse.indices: index 9 at position 0, but only 3 elements exist"));
}

#[test]
fn huge_counts_are_refused_before_memory_is_taken() {
    let mut file = Builder::new();
    file.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 1u64 << 60}));
    file.primitive(json!({"attributes": {"POSITION": 0}}));
    assert!(file.fault().contains("too large"), "{}", file.fault());

    let mut file = Builder::new();
    let positions = file.triangle();
    file.root["accessors"][positions]["count"] = json!(u64::MAX);
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    assert!(file.fault().contains("do not fit its view"));

    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let options = LoadOptions { limits: Limits { memory: 10, ..Limits::default() }, ..LoadOptions::default() };
    assert!(load_bytes(Path::new("a.gltf"), file.gltf(), &options).is_err());
}

#[test]
fn primitives_that_share_a_pool_of_vertices_take_only_their_own() {
    const POOL: usize = 50_000;
    let mut file = Builder::new();
    let values: Vec<f32> = (0..POOL).flat_map(|i| [i as f32, (i % 2) as f32, (i % 3) as f32]).collect();
    let positions = file.floats("VEC3", &values);
    let normals = file.floats("VEC3", &[0., 0., 1.].repeat(POOL));
    let corners = |i: usize| [i * 7 + 5, i * 7 + 1, 3 * i + 20_000];
    let primitives: Vec<Value> = (0..400)
        .map(|i| {
            let indices = file.shorts(&corners(i).map(|c| c as u16));
            json!({"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices})
        })
        .collect();
    file.set("meshes", json!([{ "primitives": primitives }]));
    // Whole pools would take 400 · 50 000 · 32 bytes.
    let options = LoadOptions { limits: Limits { memory: 64 << 20, ..Limits::default() }, ..LoadOptions::default() };
    let scene = load_bytes(Path::new("a.glb"), file.glb(), &options).unwrap().scene;
    assert_eq!(scene.meshes.len(), 400);
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let x: Vec<f32> = mesh.triangles[0].iter().map(|&v| mesh.positions[v as usize].x).collect();
        assert_eq!(x, corners(i).map(|c| c as f32), "{i}");
        assert_eq!((mesh.positions.len(), mesh.normals.len()), (3, 3));
        assert!(mesh.positions.capacity() < 100, "{i}");
    }
}

#[test]
fn replaced_elements_are_found_among_the_vertices_in_use() {
    let mut file = Builder::new();
    let positions = file.floats("VEC3", &[0.0; 60]);
    let indices = file.view(&[3, 7, 15, 19], &[]);
    let values: Vec<u8> =
        [1., 0., 0., 9., 9., 9., 0., 1., 0., 8., 8., 8.].into_iter().flat_map(f32::to_le_bytes).collect();
    let values = file.view(&values, &[]);
    file.root["accessors"][positions]["sparse"] = json!({"count": 4,
        "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    let corners = file.shorts(&[4, 3, 15]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": corners}));
    let mesh = &file.load().scene.meshes[0];
    assert_eq!(mesh.triangles[0].map(|v| mesh.positions[v as usize]), [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

#[test]
fn sparse_indices_that_do_not_increase_are_told_and_the_last_value_counts() {
    for (elements, at, before) in [([1, 2, 1], 2, 2), ([2, 1, 1], 1, 2), ([0, 1, 1], 2, 1)] {
        let mut file = Builder::new();
        let positions = file.triangle();
        let indices = file.view(&elements, &[]);
        let values: Vec<u8> = elements
            .iter()
            .zip(1u8..)
            .flat_map(|(_, i)| [f32::from(i), 0., 0.])
            .collect::<Vec<_>>()
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect();
        let values = file.view(&values, &[]);
        file.root["accessors"][positions]["sparse"] = json!({"count": 3,
            "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
        file.primitive(json!({"attributes": {"POSITION": positions}}));
        let loaded = file.load();
        assert_eq!(codes(&loaded), ["gltf-accessor-sparse-indices-non-increasing"]);
        let text = loaded.warnings.iter().map(ToString::to_string).find(|w| w.contains("sparse")).unwrap();
        let told = format!("a.gltf:accessors[0].sparse.indices: index 1 at position {at} follows {before}");
        assert!(text.starts_with(&told), "{text}");
        assert_eq!(loaded.scene.meshes[0].positions[1], Vec3::X * 3.0);
    }
}

#[test]
fn quantised_attributes_are_read_as_the_extension_says() {
    let mut file = Builder::new();
    let shorts: Vec<u8> =
        [0u16, 0, 0, 0, 1000, 0, 0, 0, 0, 1000, 0, 0].into_iter().flat_map(u16::to_le_bytes).collect();
    let view = file.view(&shorts, &[("byteStride", json!(8))]);
    let positions =
        file.push("accessors", json!({"bufferView": view, "componentType": 5123, "type": "VEC3", "count": 3}));
    let bytes = [0u8, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0];
    let view = file.view(&bytes, &[("byteStride", json!(4))]);
    let normals = file.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5120, "type": "VEC3", "count": 3, "normalized": true}),
    );
    file.set("extensionsUsed", json!(["KHR_mesh_quantization"]));
    file.set("extensionsRequired", json!(["KHR_mesh_quantization"]));
    file.primitive(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    let loaded = file.load();
    assert_eq!(loaded.scene.meshes[0].positions[1], Vec3::X * 1000.0);
    assert_eq!(loaded.scene.meshes[0].normals[0], Vec3::Z);
    assert!(codes(&loaded).is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn vertex_colours_come_in_three_types_with_or_without_alpha() {
    for (data, component, kind) in [
        (vec![255u8, 0, 51, 0, 255, 0, 51, 0, 255, 0, 51, 0], 5121, "VEC3"),
        (vec![255, 0, 51, 255, 255, 0, 51, 255, 255, 0, 51, 255], 5121, "VEC4"),
        ([65535u16, 0, 13107, 65535].repeat(3).iter().flat_map(|v| v.to_le_bytes()).collect(), 5123, "VEC4"),
        ([1f32, 0., 0.2, 1.].repeat(3).iter().flat_map(|v| v.to_le_bytes()).collect(), 5126, "VEC4"),
    ] {
        let mut file = Builder::new();
        let positions = file.triangle();
        let stride = if kind == "VEC3" { json!(4) } else { json!(data.len() / 3) };
        let view = file.view(&data, &[("byteStride", stride)]);
        let colors = file.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": kind, "count": 3, "normalized": component != 5126}),
        );
        file.primitive(json!({"attributes": {"POSITION": positions, "COLOR_0": colors}}));
        assert_eq!(file.load().scene.meshes[0].colors, [Vec4::new(1.0, 0.0, 0.2, 1.0); 3], "{component} {kind}");
    }
}

#[test]
fn strips_and_fans_become_triangles_and_points_and_lines_get_a_width() {
    let square = [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
    for (mode, triangles) in [(5, vec![[0, 1, 2], [1, 3, 2]]), (6, vec![[1, 2, 0], [2, 3, 0]])] {
        let mut file = Builder::new();
        let positions = file.floats("VEC3", &square);
        file.primitive(json!({"attributes": {"POSITION": positions}, "mode": mode}));
        assert_eq!(file.load().scene.meshes[0].triangles, triangles);
    }
    for (mode, points, lines) in [(0, 4, 0), (1, 0, 2), (2, 0, 4), (3, 0, 3)] {
        let mut file = Builder::new();
        let positions = file.floats("VEC3", &square);
        file.primitive(json!({"attributes": {"POSITION": positions}, "mode": mode}));
        let loaded = file.load();
        let width = 2f64.sqrt() / 256.0;
        let wires = loaded.facts.wires;
        assert_eq!((wires.points, wires.lines, loaded.facts.faces), (points, lines, 0), "mode {mode}");
        assert!((wires.point_width.max(wires.line_width) - width).abs() < 1e-9, "{wires:?}");
        assert_eq!(loaded.scene.meshes[0].triangles.len() as u64, 8 * (points + lines));
        assert!(codes(&loaded).is_empty(), "{:?}", loaded.warnings);
    }
}

#[test]
fn lines_without_an_end_or_a_place_are_left_out_like_faces() {
    let mut file = Builder::new();
    let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., f32::INFINITY, 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "mode": 3}));
    let loaded = file.load();
    assert_eq!((loaded.facts.wires.lines, loaded.scene.meshes[0].triangles.len()), (2, 8));
    assert!(codes(&loaded).contains(&"line-not-finite"), "{:?}", loaded.warnings);
    let mut file = Builder::new();
    let positions = file.floats("VEC3", &square_corner());
    let indices = file.shorts(&[0, 7]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 1}));
    let message = file.fault();
    assert!(message.contains("index 7 at position 1, but only 3 vertices exist"), "{message}");
}

fn square_corner() -> [f32; 9] {
    [0., 0., 0., 1., 0., 0., 0., 1., 0.]
}

#[test]
fn faces_that_cannot_be_drawn_are_dropped_and_counted() {
    let mut file = Builder::new();
    let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., f32::NAN, 0., 0., 1., 0., 0.]);
    let indices = file.shorts(&[0, 1, 3, 0, 1, 4, 0, 1, 2]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let loaded = file.load();
    assert_eq!(loaded.scene.meshes[0].face_of_triangle, [2]);
    assert_eq!(loaded.scene.meshes[0].positions.len(), 3);
    assert_eq!(loaded.facts.dropped.iter().map(|d| d.1).collect::<Vec<_>>(), [1, 1]);
    assert_eq!(codes(&loaded), ["gltf-accessor-invalid-float", "face-not-finite", "face-degenerate"]);
}

#[test]
fn nodes_place_meshes_cameras_and_lights() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set(
        "nodes",
        json!([
            {"children": [1, 2, 3], "translation": [10, 0, 0], "scale": [2, 2, 2]},
            {"mesh": 0, "name": "mirrored", "scale": [-1, 1, 1]},
            {"camera": 0, "name": "front", "translation": [0, 0, 3]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [-0.6, 0, 0, 0.8]},
        ]),
    );
    file.set("cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}}]));
    file.set("extensionsUsed", json!(["KHR_lights_punctual"]));
    file.set(
        "extensions",
        json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "color": [1, 0.5, 0], "intensity": 4, "range": 9, "spot": {"outerConeAngle": 0.3}}]}}),
    );
    let scene = file.load().scene;
    let instance = &scene.instances[0];
    assert_eq!(instance.name, "mirrored");
    assert_eq!(instance.world_from_object.transform_point3(DVec3::X), DVec3::new(8.0, 0.0, 0.0));
    assert_eq!(scene.cameras[0].name, "front");
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { y_fov: 0.5, aspect: Some(2.0) });
    assert_eq!(scene.cameras[0].world_from_camera.translation, DVec3::new(10.0, 0.0, 6.0));
    assert_eq!(scene.cameras[0].world_from_camera.matrix3.determinant(), 1.0);
    assert_eq!(scene.lights[0].intensity, Vec3::new(4.0, 2.0, 0.0));
    let LightKind::Spot { direction, inner, outer, falloff, .. } = scene.lights[0].kind else { panic!() };
    let expected = DVec3::new(0.0, -0.96, -0.28);
    assert!((direction - expected).length() < 1e-12, "a light shines along its −z");
    assert!(inner == 0.0 && (outer - 0.3).abs() < 1e-6);
    assert_eq!(falloff, Falloff::InverseSquare { range: 9.0 });
}

#[test]
fn a_scene_is_chosen_by_index_or_name_and_without_scenes_all_roots_show() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("nodes", json!([{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}]));
    file.set("scenes", json!([{"nodes": [0]}, {"nodes": [1], "name": "second"}]));
    let shown = |wish: Option<&str>| {
        let options = LoadOptions { scene: wish.map(Into::into), ..LoadOptions::default() };
        let loaded = load_bytes(Path::new("a.gltf"), file.gltf(), &options);
        loaded.map(|l| (l.scene.instances[0].name.clone(), l.facts.scene_index)).map_err(|e| e.to_string())
    };
    assert_eq!(shown(None), Ok(("a".into(), 0)));
    assert_eq!(shown(Some("1")), Ok(("b".into(), 1)));
    assert_eq!(shown(Some("second")), Ok(("b".into(), 1)));
    assert_eq!(shown(Some("third")), Err("a.gltf:scenes: there is no scene 'third'; it has 0, 1 'second'".to_string()));
    let mut file = file;
    file.root.as_object_mut().unwrap().remove("scenes");
    file.root.as_object_mut().unwrap().remove("scene");
    assert_eq!(file.load().scene.instances.len(), 2);
}

#[test]
fn morph_weights_of_the_node_come_before_those_of_the_mesh() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let target = file.floats("VEC3", &[0., 0., 2., 0., 0., 2., 0., 0., 2.]);
    file.set(
        "meshes",
        json!([{
        "primitives": [{"attributes": {"POSITION": positions}, "targets": [{"POSITION": target}]}], "weights": [0.5]}]),
    );
    file.set("nodes", json!([{"mesh": 0}, {"mesh": 0, "weights": [1]}, {"mesh": 0}]));
    file.set("scenes", json!([{"nodes": [0, 1, 2]}]));
    let scene = file.load().scene;
    assert_eq!(scene.meshes.len(), 2, "equal shapes are read once");
    let height = |i: usize| scene.meshes[scene.instances[i].mesh as usize].positions[0].z;
    assert_eq!([height(0), height(1), height(2)], [1.0, 2.0, 1.0]);
}

#[test]
fn a_skinned_mesh_stands_where_its_joints_put_it() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]);
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let mut moved = identity;
    moved[12] = -1.0;
    let inverse = file.floats("MAT4", &[identity, moved].concat());
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set(
        "nodes",
        json!([{"mesh": 0, "skin": 0, "translation": [99, 99, 99]}, {"children": [2]}, {"translation": [1, 0, 5]}]),
    );
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    file.set("skins", json!([{"joints": [1, 2], "inverseBindMatrices": inverse}]));
    let scene = file.load().scene;
    let place =
        |i: usize| scene.instances[0].world_from_object.transform_point3(scene.meshes[0].positions[i].as_dvec3());
    assert_eq!([place(0), place(1), place(2)], [DVec3::ZERO, DVec3::new(1.0, 0.0, 5.0), DVec3::Y]);
}

#[test]
fn a_mirrored_node_leaves_its_mesh_alone_and_mirroring_joints_turn_theirs() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set("nodes", json!([{"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 0, "skin": 0}, {"scale": [-1, 1, 1]}]));
    file.set("skins", json!([{"joints": [2]}]));
    file.set("scenes", json!([{"nodes": [0, 1, 2]}]));
    let scene = file.load().scene;
    let determinant = |i: usize| scene.instances[i].world_from_object.matrix3.determinant();
    assert_eq!((determinant(0), determinant(1)), (-1.0, 1.0));
    assert_eq!((&scene.meshes[0].triangles[..], &scene.meshes[1].triangles[..]), (&[[0, 1, 2]][..], &[[0, 2, 1]][..]));
}

#[test]
fn a_skin_whose_joints_are_not_in_the_scene_is_drawn_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set("nodes", json!([{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [1, 0, 5]}]));
    file.set("skins", json!([{"joints": [2]}]));
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    assert!(codes(&file.load()).is_empty());
    file.set("scenes", json!([{"nodes": [0]}, {"nodes": [0, 1]}]));
    let loaded = file.load();
    assert_eq!(codes(&loaded), ["gltf-node-skin-no-scene"]);
    assert_eq!(loaded.scene.instances[0].world_from_object.translation.z, 5.0);
}

#[test]
fn data_that_is_used_for_two_things_is_read_twice_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let indices = file.shorts(&[0, 1, 2]);
    file.root["accessors"][indices]["bufferView"] = json!(0);
    // The first three shorts of the positions are zeros and stand for one corner.
    file.root["accessors"][indices]["count"] = json!(2);
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 3}));
    assert_eq!(codes(&file.load()), ["gltf-buffer-view-target-override"]);
    file.primitive(json!({"attributes": {"POSITION": positions, "_CUSTOM": indices}, "indices": indices}));
    assert!(file.fault().contains("2 elements where other attributes have 3"));
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
fn instances_of_the_gpu_and_hidden_nodes_are_understood() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let places = file.floats("VEC3", &[1., 0., 0., 2., 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing", "KHR_node_visibility"]));
    file.set(
        "nodes",
        json!([
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}},
            {"children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}},
            {"mesh": 0},
        ]),
    );
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    let scene = file.load().scene;
    let places: Vec<f64> = scene.instances.iter().map(|i| i.world_from_object.translation.x).collect();
    assert_eq!(places, [1.0, 2.0]);
}

#[test]
fn nodes_and_copies_scaled_to_nothing_are_hidden_as_invisible_ones_are() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let sizes = file.floats("VEC3", &[0., 0., 0., 1., 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "material": 0}));
    file.set("materials", json!([{"name": "hidden"}]));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing", "KHR_node_visibility"]));
    let scaled = json!({"children": [1], "scale": [0, 0, -0.0], "translation": [1e6, 0, 0]});
    let child = json!({"mesh": 0, "translation": [0, 5, 0]});
    let copies = json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": sizes}}}});
    file.set("nodes", json!([scaled, child, copies]));
    file.set("scenes", json!([{"nodes": [0, 2]}]));
    let loaded = file.load();
    let places: Vec<_> = loaded.scene.instances.iter().map(|i| i.world_from_object.matrix3.x_axis).collect();
    assert_eq!((places, loaded.facts.faces), (vec![DVec3::X], 1), "a flat one is there");

    let mut hidden = |nodes: Value| {
        file.set("nodes", nodes).set("scenes", json!([{"nodes": [0]}]));
        let Loaded { scene, facts, warnings } = file.load();
        let counts = [scene.meshes.len(), scene.instances.len(), scene.materials.len()];
        (counts, facts.faces, warnings.iter().map(ToString::to_string).collect::<Vec<_>>())
    };
    let invisible = json!({"children": [1], "extensions": {"KHR_node_visibility": {"visible": false}}});
    let nothing = hidden(json!([scaled, child]));
    assert_eq!(nothing, hidden(json!([invisible, child])));
    assert_eq!((nothing.0, nothing.1), ([0; 3], 0));
}

#[test]
fn copies_without_one_of_their_attributes_are_left_out_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let places = file.floats("VEC3", &[1., 0., 0., 2., 0., 0., 3., 0., 0.]);
    let sizes = file.floats("VEC3", &[1., 1., 1., 2., 2., 2.]);
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing"]));
    let attributes = json!({"TRANSLATION": places, "SCALE": sizes});
    file.set("nodes", json!([{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}]));
    file.set("scenes", json!([{"nodes": [0]}]));
    let loaded = file.load();
    assert_eq!(loaded.scene.instances.len(), 2);
    let place = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes";
    let warning = loaded.warnings.iter().find(|warning| warning.place == place).unwrap().to_string();
    assert!(warning.contains("TRANSLATION has 3, SCALE has 2; copies without one are left out"), "{warning}");
}

#[test]
fn normals_that_are_not_unit_are_made_so_with_one_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let normals = file.floats("VEC3", &[0., 0., 3., 0., 0., 3., 0., 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    let loaded = file.load();
    assert_eq!(loaded.scene.meshes[0].normals, [Vec3::Z; 3]);
    assert_eq!(codes(&loaded), ["gltf-accessor-vector3-non-unit"]);
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
    assert!(fault(b"{\n\n!").starts_with("a.gltf:3: the JSON cannot be read"));
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
