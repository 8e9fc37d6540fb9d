//! Vertices and faces: indices, attributes of every kind, sparse accessors.

use super::*;

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
    let told = "a.gltf:meshes[0].primitives[0].indices: index 3 at position 2, but only 3 vertices exist";
    assert_eq!(message, format!("{told}; it is damaged; export it again"));
    let mut file = Builder::new();
    let (positions, indices) = (file.triangle(), file.shorts(&[0, 1, 0xffff]));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    assert!(file.fault().contains("asks for a restart"));
}

#[test]
fn the_index_of_a_restart_is_a_vertex_where_there_is_one() {
    let mut file = Builder::new();
    let corners = (0..256).flat_map(|i| [i as f32, if i % 2 == 0 { 0.0 } else { 1.0 }, 0.0]).collect::<Vec<_>>();
    let positions = file.floats("VEC3", &corners);
    let view = file.view(&[253, 254, 255], &[]);
    let indices =
        file.push("accessors", json!({"bufferView": view, "componentType": 5121, "type": "SCALAR", "count": 3}));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let loaded = file.load();
    assert_eq!(loaded.scene.meshes[0].positions[2], Vec3::new(255.0, 1.0, 0.0));
    let told = loaded.warnings.iter().find(|w| w.code == "gltf-accessor-index-primitive-restart").unwrap();
    assert!(told.text.contains("here it is a vertex"), "{told}");
}

#[test]
fn attributes_with_too_few_or_too_many_values_are_left_out() {
    for count in [2, 4] {
        let mut file = Builder::new();
        let positions = file.triangle();
        let normals = file.floats("VEC3", [0.0, 0.0, 1.0].repeat(count).as_slice());
        let uvs = file.floats("VEC2", [0.5, 0.5].repeat(count).as_slice());
        file.primitive(json!({"attributes": {"NORMAL": normals, "POSITION": positions, "TEXCOORD_0": uvs, "_D": uvs}}));
        let loaded = file.load();
        assert_eq!(loaded.scene.meshes[0].triangles, [[0, 1, 2]]);
        assert!(loaded.scene.meshes[0].normals.is_empty() && loaded.scene.meshes[0].uvs.iter().all(Vec::is_empty));
        let code = "gltf-mesh-primitive-unequal-accessor-count";
        let told: Vec<String> = loaded.warnings.iter().filter(|w| w.code == code).map(ToString::to_string).collect();
        let said = format!("NORMAL: {count} elements for 3 vertices; the attribute is left out");
        assert!(told.iter().any(|line| line.contains(&said)), "{told:?}");
    }
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
    // Reading whole pools would take 400 · 50 000 · 32 bytes.
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
fn floats_that_are_called_normalized_are_read_as_they_are_and_told() {
    let mut file = Builder::new();
    let data: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let positions = file.accessor(&data, 5126, "VEC3", 3, true);
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let loaded = file.load();
    assert_eq!(loaded.scene.meshes[0].positions, [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 3.0]);
    assert!(codes(&loaded).contains(&"gltf-accessor-normalized-invalid"), "{:?}", codes(&loaded));
}
