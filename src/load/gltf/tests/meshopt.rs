//! Buffer views compressed by meshoptimizer.

use super::boxes::{Plain, survives, textured, triangles};
use super::*;
use crate::load::gltf::meshopt_codec::{Filter, Mode, Shape, decode};
use ::meshopt::{EncodeExpMode, encode_filter_color, encode_filter_exp, encode_filter_oct, encode_filter_quat};

/// A compressed view: the stream, its mode and filter, bytes per element, number of elements.
struct Packed {
    stream: Vec<u8>,
    mode: &'static str,
    filter: &'static str,
    stride: usize,
    count: usize,
}

fn vertices<T>(elements: &[T], filter: &'static str, version: i32) -> Packed {
    let stream = ::meshopt::encode_vertex_buffer_level(elements, 2, Some(version)).unwrap();
    Packed { stream, mode: "ATTRIBUTES", filter, stride: size_of::<T>(), count: elements.len() }
}

impl Packed {
    /// Adds the view, and an accessor for all of it.
    fn add(&self, file: &mut Builder, name: &str, accessor: Value) -> usize {
        let raw = file.view(&self.stream, &[]);
        let offset = file.root["bufferViews"][raw]["byteOffset"].clone();
        let properties = json!({"buffer": 0, "byteOffset": offset, "byteLength": self.stream.len(), "mode": self.mode,
            "filter": self.filter, "byteStride": self.stride, "count": self.count});
        let length = self.stride * self.count;
        let mut view = json!({"buffer": 1, "byteLength": length, "extensions": {name: properties}});
        if self.mode == "ATTRIBUTES" {
            view["byteStride"] = json!(self.stride);
        }
        file.root["bufferViews"][raw] = view;
        let mut all = json!({"bufferView": raw, "count": self.count});
        accessor.as_object().unwrap().iter().for_each(|(key, value)| all[key] = value.clone());
        file.push("accessors", all)
    }
}

/// The box in compressed views; `version` is that of the vertex streams.
fn file(name: &str, version: i32, filtered: bool) -> Builder {
    let plain = Plain::new();
    let mut file = Builder::new();
    let wide: Vec<u32> = plain.indices.iter().map(|&i| i.into()).collect();
    let stream = ::meshopt::encode_index_buffer(&wide, 24).unwrap();
    let indices = Packed { stream, mode: "TRIANGLES", filter: "NONE", stride: 2, count: 36 };
    let indices = indices.add(&mut file, name, json!({"componentType": 5123, "type": "SCALAR"}));
    let floats = |kind: &str| json!({"componentType": 5126, "type": kind});
    let normals: Vec<[f32; 4]> = plain.normals.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
    let colors: Vec<[f32; 4]> = plain.colors.iter().map(|c| c.map(|v| f32::from(v) / 255.0)).collect();
    let positions = if filtered {
        vertices(&encode_filter_exp(&plain.positions, 15, EncodeExpMode::SharedVector), "EXPONENTIAL", version)
    } else {
        vertices(&plain.positions, "NONE", version)
    };
    let positions = positions.add(&mut file, name, floats("VEC3"));
    let normals = if filtered {
        let octahedral = vertices(&encode_filter_oct::<i8>(&normals, 8), "OCTAHEDRAL", version);
        octahedral.add(&mut file, name, json!({"componentType": 5120, "type": "VEC3", "normalized": true}))
    } else {
        vertices(&plain.normals, "NONE", version).add(&mut file, name, floats("VEC3"))
    };
    let uvs = vertices(&plain.uvs, "NONE", version).add(&mut file, name, floats("VEC2"));
    let colors = if filtered && name.starts_with("KHR") {
        vertices(&encode_filter_color::<u8>(&colors, 8), "COLOR", version)
    } else {
        vertices(&plain.colors, "NONE", version)
    };
    let colors = colors.add(&mut file, name, json!({"componentType": 5121, "type": "VEC4", "normalized": true}));
    let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors});
    file.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
    let used = json!([name, "KHR_mesh_quantization"]);
    file.set("extensionsUsed", used.clone()).set("extensionsRequired", used);
    textured(&mut file);
    file
}

/// The file with a second buffer as the fallback of the compressed data.
fn with_stand_in(file: &Builder, stand_in: &Value) -> Vec<u8> {
    let mut root: Value = serde_json::from_slice(&file.gltf()).unwrap();
    let buffers = root["buffers"].as_array_mut().unwrap();
    buffers.push(stand_in.clone());
    root.to_string().into_bytes()
}

fn empty(name: &str) -> Value {
    json!({"byteLength": 4096, "extensions": {name: {"fallback": true}}})
}

#[test]
fn a_compressed_box_is_the_same_as_the_plain_one() {
    let plain = triangles(&Plain::new().file().load());
    for (name, version) in [("EXT_meshopt_compression", 0), ("KHR_meshopt_compression", 1)] {
        for filtered in [false, true] {
            for stand_in in [empty(name), json!({"byteLength": 4096})] {
                let loaded = load(&with_stand_in(&file(name, version, filtered), &stand_in));
                assert_eq!(codes(&loaded), Vec::<&str>::new(), "{:?}", loaded.warnings);
                assert_eq!(triangles(&loaded), plain, "{name}, filtered: {filtered}");
            }
        }
    }
}

#[test]
fn filters_give_back_what_was_encoded() {
    let close = |bytes: &[u8], scale: f32, expected: &[[f32; 4]], tolerance: f32| {
        let found = bytes.as_chunks::<2>().0.iter().map(|b| f32::from(i16::from_le_bytes(*b)) / scale);
        let far = found.zip(expected.as_flattened()).find(|(a, b)| (a - **b).abs() > tolerance);
        assert_eq!(far, None);
    };
    let shape = |filter, stride| Shape { mode: Mode::Attributes, filter, stride, count: 2 };
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The largest component is decoded as positive.
    let turns = [[0.0, half, 0.0, half], [0.5, -0.1, 0.7, 0.5]];
    let quaternions = vertices(&encode_filter_quat(&turns, 16), "", 0);
    close(&decode(&quaternions.stream, &shape(Filter::Quaternion, 8)).unwrap(), 32767.0, &turns, 1e-3);
    let directions = [[0.6, 0.0, 0.8, 1.0], [0.0, -1.0, 0.0, -1.0]];
    let octahedral = vertices(&encode_filter_oct::<i16>(&directions, 16), "", 1);
    close(&decode(&octahedral.stream, &shape(Filter::Octahedral, 8)).unwrap(), 32767.0, &directions, 1e-3);
    // Below one half, a component reads the same as a signed and an unsigned integer.
    let colors = [[0.25, 0.45, 0.125, 0.4], [0.1, 0.0, 0.4, 0.3]];
    let luma = vertices(&encode_filter_color::<u16>(&colors, 16), "", 1);
    close(&decode(&luma.stream, &shape(Filter::Color, 8)).unwrap(), 65535.0, &colors, 1e-3);
}

#[test]
fn indices_in_any_order_come_back() {
    let indices = [7u32, 3, 3, 90_000, 2, 1, 0];
    let stream = ::meshopt::encode_index_sequence(&indices, 90_001).unwrap();
    let shape = Shape { mode: Mode::Indices, filter: Filter::None, stride: 4, count: 7 };
    let bytes: Vec<u8> = indices.into_iter().flat_map(u32::to_le_bytes).collect();
    assert_eq!(decode(&stream, &shape).unwrap(), bytes);
}

#[test]
fn vertices_of_every_size_come_back() {
    let bytes: Vec<u8> = (0..252u32 * 8).map(|i| (i * i % 251) as u8).collect();
    for words in [1, 3, 8, 63, 64] {
        let count = bytes.len() / (words * 4);
        let raw = &bytes[..count * words * 4];
        // The encoder sees the type of a vertex: words of 4 bytes and arrays of them encode differently.
        let stream = match words {
            1 => ::meshopt::encode_vertex_buffer(raw.as_chunks::<4>().0),
            3 => ::meshopt::encode_vertex_buffer(raw.as_chunks::<12>().0),
            8 => ::meshopt::encode_vertex_buffer(raw.as_chunks::<32>().0),
            63 => ::meshopt::encode_vertex_buffer(raw.as_chunks::<252>().0),
            _ => ::meshopt::encode_vertex_buffer(raw.as_chunks::<256>().0),
        };
        let shape =
            Shape { mode: Mode::Attributes, filter: Filter::None, stride: words as u64 * 4, count: count as u64 };
        assert_eq!(decode(&stream.unwrap(), &shape).unwrap(), raw, "{words} words");
    }
}

#[test]
fn wrong_properties_are_one_line_with_the_numbers() {
    let name = "EXT_meshopt_compression";
    let with = |view: usize, key: &str, value: Value| {
        let mut file = file(name, 0, true);
        file.root["bufferViews"][view]["extensions"][name][key] = value;
        let told = fault(&with_stand_in(&file, &empty(name)));
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(told.ends_with("; get the file again, or export it without meshopt compression"), "{told}");
        told.split("; get").next().unwrap().to_owned()
    };
    let place = |view: usize, part: &str| format!("a.gltf:bufferViews[{view}].extensions.{name}{part}");
    let told = with(1, "count", json!(25));
    assert_eq!(told, format!("{}: 25 elements of 12 bytes are 300 bytes, but the view has 288", place(1, ".count")));
    let told = with(1, "byteStride", json!(10));
    assert_eq!(told, format!("{}: 10 where a multiple of 4 up to 256 is allowed", place(1, ".byteStride")));
    let told = with(0, "byteStride", json!(3));
    assert_eq!(told, format!("{}: 3 where 2 or 4 is allowed", place(0, ".byteStride")));
    let told = with(0, "count", json!(35));
    assert_eq!(told, format!("{}: 35 indices do not make whole triangles", place(0, ".count")));
    let told = with(1, "filter", json!("QUATERNION"));
    assert_eq!(told, format!("{}: not possible in this mode for elements of 12 bytes", place(1, ".filter")));
    assert!(with(1, "mode", json!("LINES")).ends_with("an unknown mode"));
    assert!(with(1, "filter", json!("SEPIA")).ends_with("an unknown filter"));
    assert!(with(1, "byteLength", json!(1_000_000)).contains("1000000 bytes from byte"));
    assert!(with(1, "buffer", json!(1)).ends_with("buffer 1 has no bytes"));
    assert!(with(1, "count", json!(1u64 << 60)).contains("elements of 12 bytes"));
    assert!(with(2, "byteLength", json!(5)).ends_with("it is damaged"));
}

#[test]
fn absurd_counts_take_no_memory() {
    let name = "EXT_meshopt_compression";
    let mut file = file(name, 0, false);
    let view = &mut file.root["bufferViews"][1];
    view["byteLength"] = json!(12u64 << 30);
    view["extensions"][name]["count"] = json!(1u64 << 30);
    let told = fault(&with_stand_in(&file, &json!({"byteLength": 1u64 << 40})));
    assert!(told.contains("bytes cannot decode to 12884901888") && told.lines().count() == 1, "{told}");
}

#[test]
fn uncompressed_data_stands_in_for_a_damaged_stream_unless_the_extension_is_required() {
    let (name, plain) = ("KHR_meshopt_compression", Plain::new());
    let mut file = file(name, 1, false);
    let start = file.root["bufferViews"][1]["extensions"][name]["byteOffset"].as_u64().unwrap() as usize;
    file.bytes[start] = 0x11;
    let data: Vec<u8> = plain.positions.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(data);
    let mut stand_in = empty(name);
    stand_in["byteLength"] = json!(288);
    stand_in["uri"] = json!(format!("data:;base64,{data}"));
    // Only the positions have a fallback; the others are read from their streams.
    for i in [0, 2, 3, 4] {
        file.root["bufferViews"][i]["buffer"] = json!(2);
    }
    let bytes = |file: &Builder| {
        let mut root: Value = serde_json::from_slice(&with_stand_in(file, &stand_in)).unwrap();
        root["buffers"].as_array_mut().unwrap().push(empty(name));
        root.to_string().into_bytes()
    };
    assert!(fault(&bytes(&file)).contains("bufferViews[1]"));
    file.set("extensionsRequired", json!(["KHR_mesh_quantization"]));
    let loaded = load(&bytes(&file));
    assert_eq!(codes(&loaded), ["gltf-meshopt"]);
    assert!(loaded.warnings.iter().any(|w| w.remedy == "the uncompressed data in the file is drawn"));
    assert_eq!(triangles(&loaded), triangles(&plain.file().load()));
}

#[test]
fn a_flipped_byte_in_a_stream_is_one_line() {
    let name = "EXT_meshopt_compression";
    let mut file = file(name, 0, true);
    let start = file.root["bufferViews"][1]["extensions"][name]["byteOffset"].as_u64().unwrap() as usize;
    file.bytes[start] ^= 0xff;
    assert_eq!(
        fault(&with_stand_in(&file, &empty(name))),
        format!(
            "a.gltf:bufferViews[1].extensions.{name}: the stream does not decode to 24 elements of 12 bytes: it is damaged; \
             get the file again, or export it without meshopt compression"
        )
    );
}

#[test]
fn damaged_streams_end_in_a_scene_or_a_message() {
    for (name, version) in [("EXT_meshopt_compression", 0), ("KHR_meshopt_compression", 1)] {
        let whole = file(name, version, true);
        let mut refused = 0;
        for bit in (0..whole.bytes.len() * 8).step_by(3) {
            let mut file = Builder { root: whole.root.clone(), bytes: whole.bytes.clone() };
            file.bytes[bit / 8] ^= 1 << (bit % 8);
            refused += u32::from(!survives(&with_stand_in(&file, &empty(name)), &format!("bit {bit}")));
        }
        assert!(refused > 10, "{refused}");
        for view in 0..5 {
            let length = whole.root["bufferViews"][view]["extensions"][name]["byteLength"].as_u64().unwrap();
            for length in 1..length {
                let mut file = Builder { root: whole.root.clone(), bytes: whole.bytes.clone() };
                file.root["bufferViews"][view]["extensions"][name]["byteLength"] = json!(length);
                let lives = survives(&with_stand_in(&file, &empty(name)), &format!("view {view}, {length} bytes"));
                assert!(!lives, "view {view}, {length} bytes");
            }
        }
    }
}
