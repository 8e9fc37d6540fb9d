//! Primitives compressed by Draco. The streams were written by Google's encoder, version 1.5, from the plain box.

use super::boxes::{Plain, survives, textured, triangles};
use super::*;
use crate::load::gltf::draco_codec::{Output, WantedAttribute, decode};
use gltf::json::accessor::ComponentType;

const NAME: &str = "KHR_draco_mesh_compression";

/// An edgebreaker traversal, all attributes quantised.
const WALK: &str = "RFJBQ08CAgEBAAAACAwECwAAA19LFQEBEP8CNUFVBIqspEZVBIqspEZVBIqspEYFAAAAAwEA/wAAAQEAAgEAAQICBAEKAQEEAgQACQEBAAkDAA0C\
    AQMJAgELAgEBCQMADAMBAQEBAgMBKgEIAQ4HgM533eimSgAAAAD/AAAAAQEBAQMEqSoBBK0GrQoTdKDsSXsS2s39oPhoe/zdh/artQAAAAADAAAA\
    AQEBAAMDASABIAMAUEOVAhGoAAAAAAD/DwAAAAAAvwAAAL8AAAC/AACAPwwFAQEBAgMBLK0KVQkKgNjWhaDjq1DMgAwAAABAA4D7ZAAAAAD/AwAA\
    AAAAAAAAAAAAAIA/CgYDAQEBAQFAAQD/AAAAfwAAAP8CoUEI";

/// The same at the strongest compression, with metadata.
const SMALL: &str = "RFJBQ08CAgEBAIAAARFxdWFudGl6YXRpb25fYml0cwQMAAAAAAAIDAQLAAADX0sVAQEQ/wI1QVUEiqykRlUEiqykRlUEiqykRgUAAAADAQD/AAEB\
    AQACAQABAgIEAQoBAQQCBAAJAQEACQMADQIBAwkCAQsCAQEJAwAMAwEBAQEEAwEqAQgBDgeAznfd6KZKAAAAAP8AAAABAQEBBQSpKgEErQatChN0\
    oOxJexLazf2g+Gh7/N2H9qu1AAAAAAMAAAABAQEAAwMBMAEQAwAolpUCEAAAAAAA/w8AAAAAAL8AAAC/AAAAvwAAgD8MBQEBAQQDASytClUJCoDY\
    1oWg46tQzIAMAAAAQAOA+2QAAAAA/wMAAAAAAAAAAAAAAACAPwoGAwEBAwEBQAEA/wAAAH8AAAD/AqFBCA==";

/// The order of triangles and vertices kept, normals and texture coordinates not quantised.
const ROW: &str = "RFJBQ08CAgEAAAAMGAEAAgEAAwIEBQYEBgcICgkICwoMDQ4MDg8QEhEQExIUFRYUFhcBBQICBAEKAwkCAQsBCQMADAQCBAAJAAkDAA0BAAABAgAB\
    AQEBA6ksrQqtCBGSjeF/HM4kRo1IPbS9xP9ngAAAAAD/AAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAA\
    AACAPwAAgD8AAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAIA/AACAPwAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAgD8AAAAA\
    AAAAAAAAgD8AAAAAAACAPwAAgD8AAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAIA/AACAPwAAAAAAAIA/AACAvwAAAAAAAAAAAACAvwAAAAAAAAAA\
    AACAvwAAAAAAAAAAAACAvwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgL8AAAAA\
    AAAAAAAAgL8AAAAAAAAAAAAAgL8AAAAAAAAAAAAAgL8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAA\
    AAAAAAAAAAAAAIC/AAAAAAAAAAAAAIC/AAAAAAAAAAAAAIC/AAAAAAAAAAAAAIC/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/\
    AAAAAAAAAAAAAIA/AAEBAQEEASwDrRBVAxBCZNo8DNEzYaCu4e8cS5GAAAAAAAMAAAAAAQEBAQMdJ1UNkQsP2VFw4/C6Q9lWflwjCUeAAAAAAP8P\
    AAAAAAC/AAAAvwAAAL8AAIA/DA==";

/// Four squares of the plane around the origin, with a seam of texture coordinates towards −x and one of normals towards +x,
/// which both end in the middle.
const SEAMS: &str = "RFJBQ08CAgEBAAAACQgCCAIAA3/aB/8BEeADAD2B4APgOYEDAAEAAQEA/wAAAQMJAgEAAAEBCQMAAQABAAkDAAICAAAAPwAAAD8AAAAAAAAAPwAAAAAAAAAA\
    AAAAPwAAAAAAAIA/AAAAPwAAgD8AAAAAAACAPwAAgD8AAAA/AACAPwAAQEAAAAA/AAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAA\
    gD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD9DH5M+AAAAABo0dT8BAQEA\
    DwOtKi9VFQMqYkz///9vZvz/AECZAQD8/wAAAAAAAAAA/z8AAAAAgL8AAIC/zczMvQAAAEAO";

/// A grid of quads with seams in its colours, at the encoder's strongest compression (level 10).
const SLOW: &str = "RFJBQ08CAgEBAAAAQGIBYgcAHF/7VKtPVav6VFWrqk9V1VNV1aeqqlpVVX2qqgr/AREEBKhanIcCAAEA/wABAQICAwEAAQEACQMAAQIEAQEBBXs5MaEBHQH/\
    z60DiQM1AqUClgEYl+HK16sn/GS3HxWGtDF/0Z4znH+f/9MyY/nDVx65sPkh/1SItj0wjV4vYwFsSs/P6BUEE/wQcJ4ZVf5d6Q6M3nRoEzL29atfIlFL5uV9\
    lWB9Ja79mbUC4WBxOF66gKKJK03LZeP5Ex0lzvDYQxZsrC4ezNQ465BORfcQvNZPVyNE/ZmMTKi1+Staj2oq4GipgYgCboACAQEgAAAAAAAAALQAAAAEAQEA\
    DwMBOAEFJwECAQEIAJxuir7vv4jb9rYtXyXJJNlXlCQA8CuICKgApAAAgggAAAAAAAAAAAAAAAAAAAAAGf8Cs0FIywkaLxcaE1UleoIAAAAAAAD/PwAAAACA\
    vwAAgL+amZm+AAAAQA4=";

/// Ids of the attributes in these streams, with the accessors that a file needs for them.
const ATTRIBUTES: &[(&str, u32, u32, &str, bool)] = &[
    ("POSITION", 13, 5126, "VEC3", false),
    ("NORMAL", 12, 5126, "VEC3", false),
    ("TEXCOORD_0", 11, 5126, "VEC2", false),
    ("COLOR_0", 10, 5121, "VEC4", true),
];

fn stream(text: &str) -> Vec<u8> {
    base64::engine::general_purpose::STANDARD.decode(text).unwrap()
}

/// A box whose data is only in a stream.
fn file(stream: &[u8]) -> Builder {
    let mut file = Builder::new();
    let view = file.view(stream, &[]);
    let indices = file.push("accessors", json!({"componentType": 5123, "type": "SCALAR", "count": 36}));
    let (mut attributes, mut listed) = (json!({}), json!({}));
    for (name, id, component, kind, normalized) in ATTRIBUTES {
        let accessor = json!({"componentType": component, "type": kind, "count": 24, "normalized": normalized});
        attributes[*name] = json!(file.push("accessors", accessor));
        listed[*name] = json!(id);
    }
    let extensions = json!({NAME: {"bufferView": view, "attributes": listed}});
    file.primitive(json!({"attributes": attributes, "indices": indices, "material": 0, "extensions": extensions}));
    file.set("extensionsUsed", json!([NAME])).set("extensionsRequired", json!([NAME]));
    textured(&mut file);
    file
}

#[test]
fn a_compressed_box_is_the_same_as_the_plain_one() {
    let plain = triangles(&Plain::new().file().load());
    for text in [WALK, SMALL, ROW] {
        let loaded = file(&stream(text)).load();
        assert_eq!(codes(&loaded), Vec::<&str>::new(), "{:?}", loaded.warnings);
        assert_eq!(triangles(&loaded), plain);
    }
}

#[test]
fn whole_numbers_and_the_order_of_vertices_are_kept() {
    let plain = Plain::new();
    let wanted = |id, component, width| WantedAttribute { id, name: String::new(), component, width, most: 24 };
    let all = [wanted(9, ComponentType::U8, 4), wanted(10, ComponentType::U8, 4), wanted(9, ComponentType::U16, 4)];
    let output = decode(&stream(ROW), &all).unwrap();
    assert_eq!(output.attributes[0], plain.joints.as_flattened());
    assert_eq!(output.attributes[1], plain.colors.as_flattened());
    let wide: Vec<u8> = plain.joints.as_flattened().iter().flat_map(|&j| u16::from(j).to_le_bytes()).collect();
    assert_eq!(output.attributes[2], wide);
    let indices: Vec<u32> = plain.indices.iter().map(|&i| i.into()).collect();
    assert_eq!((output.indices, output.vertices), (indices, 24));
}

#[test]
fn morph_targets_beside_a_stream_move_its_vertices() {
    let mut file = file(&stream(ROW));
    let offsets = file.floats("VEC3", [1.0, 0.0, 0.0].repeat(24).as_slice());
    file.root["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": offsets }]);
    file.root["meshes"][0]["weights"] = json!([0.5]);
    let loaded = file.load();
    let lowest = loaded.scene.meshes[0].positions.iter().map(|p| p.x).fold(f32::INFINITY, f32::min);
    assert!(lowest.abs() < 1e-3, "{lowest}");
}

#[test]
fn two_primitives_may_show_one_stream() {
    let mut file = file(&stream(WALK));
    let primitive = file.root["meshes"][0]["primitives"][0].clone();
    file.set("meshes", json!([{"primitives": [primitive.clone(), primitive]}]));
    assert_eq!(file.load().facts.faces, 24);
}

#[test]
fn an_accessor_of_two_streams_is_one_line() {
    let mut file = file(&stream(WALK));
    let other = file.view(&stream(ROW), &[]);
    let first = file.root["meshes"][0]["primitives"][0].clone();
    let mut second = first.clone();
    second["extensions"][NAME]["bufferView"] = json!(other);
    file.set("meshes", json!([{"primitives": [first, second]}]));
    let told = file.fault();
    assert!(told.contains("primitives[1]") && told.contains("two different parts of Draco streams"), "{told}");
    assert_eq!(told.lines().count(), 1);
}

#[test]
fn a_stream_that_disagrees_with_its_accessors_is_one_line_with_the_numbers() {
    let place = format!("a.gltf:meshes[0].primitives[0].extensions.{NAME}");
    let remedy = "; get the file again, or export it without Draco compression";
    let with = |change: &dyn Fn(&mut Builder)| {
        let mut file = file(&stream(WALK));
        change(&mut file);
        file.fault()
    };
    let told = with(&|file| {
        let primitive = &mut file.root["meshes"][0]["primitives"][0];
        primitive["extensions"][NAME]["attributes"]["NORMAL"] = json!(99);
    });
    assert_eq!(told, format!("{place}: the stream has no attribute 99{remedy}"));
    let told = with(&|file| file.root["accessors"][1]["type"] = json!("VEC2"));
    assert!(told.contains("POSITION"), "{told}");
    let told = with(&|file| file.root["accessors"][3]["type"] = json!("VEC3"));
    assert!(told.contains("TEXCOORD_0: 2 components in the stream, 3 in the accessor"), "{told}");
    let told = with(&|file| file.root["meshes"][0]["primitives"][0]["mode"] = json!(1));
    assert!(told.contains("only triangles can be decoded"), "{told}");
}

#[test]
fn streams_are_drawn_whole_whatever_numbers_their_accessors_declare() {
    let plain = triangles(&Plain::new().file().load());
    for text in [WALK, ROW] {
        for (indices, vertices) in [(33, 24), (39, 24), (36, 7), (36, 23), (36, 30), (1, 1)] {
            let mut file = file(&stream(text));
            let attributes = ATTRIBUTES.len();
            let accessors = file.root["accessors"].as_array_mut().unwrap();
            accessors[0]["count"] = json!(indices);
            accessors[1..=attributes].iter_mut().for_each(|accessor| accessor["count"] = json!(vertices));
            let loaded = file.load();
            assert_eq!(triangles(&loaded), plain, "{indices} and {vertices}");
            let told: Vec<&str> = loaded.warnings.iter().map(|w| w.code).collect();
            assert!(told.contains(&"gltf-draco-count"), "{told:?}");
            let said = format!("24 vertices and 36 indices, but the accessors declare {vertices} and {indices}");
            assert!(loaded.warnings.iter().any(|w| w.text.contains(&said)), "{:?}", loaded.warnings);
        }
    }
    // A single wrong accessor, and a morph target with as many values as declared.
    let mut unequal = file(&stream(WALK));
    unequal.root["accessors"][2]["count"] = json!(23);
    let loaded = unequal.load();
    assert_eq!((triangles(&loaded), codes(&loaded)), (plain.clone(), vec!["gltf-draco-count"]));
    let mut morphed = file(&stream(WALK));
    let offsets = morphed.floats("VEC3", [1.0, 0.0, 0.0].repeat(23).as_slice());
    morphed.root["accessors"].as_array_mut().unwrap()[1..=ATTRIBUTES.len()]
        .iter_mut()
        .for_each(|a| a["count"] = json!(23));
    morphed.root["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": offsets }]);
    morphed.root["meshes"][0]["weights"] = json!([0.5]);
    let loaded = morphed.load();
    assert_eq!(triangles(&loaded), plain);
    let told = loaded.warnings.iter().find(|w| w.code.ends_with("morph-target-invalid-attribute-count")).unwrap();
    assert_eq!(told.text, "23 elements for 24 vertices");
    // The index type of the accessor does not limit decoded indices.
    let mut file = file(&stream(WALK));
    file.root["accessors"][0]["componentType"] = json!(5121);
    assert_eq!(triangles(&file.load()), plain);
}

#[test]
fn what_the_decoder_does_not_know_is_one_line() {
    let told = |at: usize, byte: u8| {
        let mut stream = stream(WALK);
        stream[at] = byte;
        let told = file(&stream).fault();
        assert_eq!(told.lines().count(), 1, "{told}");
        told
    };
    assert!(told(0, b'X').contains("its bytes are no Draco stream"));
    assert!(told(6, 1).contains("the stream has version 2.1, and only 2.2 can be decoded"));
    assert!(told(7, 0).contains("a point cloud"));
    assert!(told(8, 7).contains("an unknown method, 7"));
}

#[test]
fn what_cannot_be_decoded_yet_tells_which_level_of_compression_can() {
    let colors = WantedAttribute { id: 0, name: String::new(), component: ComponentType::U8, width: 3, most: 290 };
    let told = decode(&stream(SLOW), &[colors]).err().unwrap();
    assert!(told.contains("at levels 9 and 10 but not at 8"), "{told}");
}

#[test]
fn absurd_numbers_take_no_memory() {
    // Number of triangles, after that of the vertices at byte 12.
    let mut many = stream(WALK);
    many.splice(13..14, [0xff, 0xff, 0xff, 0xff, 0x07]);
    assert!(file(&many).fault().contains("more than can be decoded"));
    let mut billions = file(&many);
    billions.root["accessors"][0]["count"] = json!(3u64 * 0x7fff_ffff);
    assert_eq!(billions.fault().lines().count(), 1);
}

#[test]
fn uncompressed_data_stands_in_for_a_damaged_stream_unless_the_extension_is_required() {
    let plain = Plain::new();
    let mut file = plain.file();
    let view = file.view(b"DRACO but not really", &[]);
    let listed = json!({"POSITION": 13, "NORMAL": 12, "TEXCOORD_0": 11, "COLOR_0": 10});
    file.root["meshes"][0]["primitives"][0]["extensions"] = json!({NAME: {"bufferView": view, "attributes": listed}});
    file.set("extensionsUsed", json!([NAME]));
    let loaded = file.load();
    assert_eq!(codes(&loaded), ["gltf-draco"]);
    assert!(loaded.warnings.iter().any(|w| w.remedy == "the uncompressed data in the file is drawn"));
    assert_eq!(triangles(&loaded), triangles(&plain.file().load()));
    file.set("extensionsRequired", json!([NAME]));
    assert!(file.fault().contains("get the file again"));
}

#[test]
fn memory_for_decoding_is_charged() {
    let bytes = file(&stream(WALK)).gltf();
    let with = |memory| LoadOptions { limits: Limits { memory, ..Limits::default() }, ..LoadOptions::default() };
    let refused = (0..200).find_map(|k| {
        let error = load_bytes(Path::new("a.gltf"), bytes.clone(), &with(40_000 + k * 1000)).err()?;
        Some(error.to_string()).filter(|text| text.contains("the decoded primitive is too large"))
    });
    assert!(refused.is_some_and(|text| text.ends_with("; raise --max-memory")));
}

#[test]
fn a_stream_that_is_cut_off_is_one_line() {
    for text in [WALK, SMALL, ROW] {
        let stream = stream(text);
        for length in 0..stream.len() {
            // The last bytes may be redundant.
            let lives = length > 0 && survives(&file(&stream[..length]).gltf(), &format!("{length} bytes"));
            assert!(!lives || length + 5 > stream.len(), "{length} of {} bytes", stream.len());
        }
    }
}

#[test]
fn a_flipped_bit_in_a_stream_never_panics() {
    let mut refused = 0;
    for (text, step) in [(WALK, 1), (SMALL, 7), (ROW, 7)] {
        let stream = stream(text);
        for bit in (0..stream.len() * 8).step_by(step) {
            let mut stream = stream.clone();
            stream[bit / 8] ^= 1 << (bit % 8);
            refused += u32::from(!survives(&file(&stream).gltf(), &format!("bit {bit}")));
        }
    }
    assert!(refused > 1000, "{refused}");
}

#[test]
fn vertices_are_numbered_as_by_the_encoder_of_the_format() {
    // Corner, axis and side of each vertex, in the order of Google's decoder.
    const VERTICES: &str =
        "110 300 022 302 210 122 222 212 202 120 310 002 102 312 220 010 020 000 322 200 112 012 100 320";
    const INDICES: [u16; 36] = [
        2, 5, 6, 3, 11, 8, 8, 11, 12, 14, 9, 16, 10, 4, 15, 4, 0, 15, 17, 1, 19, 2, 6, 18, 20, 7, 21, 7, 13, 21, 14,
        16, 23, 19, 22, 17,
    ];
    let joints = WantedAttribute { id: 9, name: String::new(), component: ComponentType::U8, width: 4, most: 24 };
    let colors = WantedAttribute { id: 10, ..joints.clone() };
    let Output { attributes, indices, .. } = decode(&stream(WALK), &[joints.clone(), colors, joints]).unwrap();
    let vertices = attributes[0].as_chunks::<4>().0.iter().map(|[a, b, c, _]| format!("{a}{b}{c}"));
    assert_eq!(vertices.collect::<Vec<_>>().join(" "), VERTICES);
    assert_eq!(indices, INDICES.map(u32::from));
}

/// A seam that ends at a vertex does not split it, nor do two seams of different attributes.
#[test]
fn seams_that_end_at_one_vertex_leave_it_whole() {
    // As decoded by Google's decoder.
    const PLACES: [[f32; 2]; 11] = [
        [-1.0, -1.0],
        [0.0, 0.0],
        [-1.0, 0.0],
        [-1.0, 0.0],
        [-1.0, 1.0],
        [0.0, 1.0],
        [1.0, 1.0],
        [1.0, 0.0],
        [1.0, 0.0],
        [1.0, -1.0],
        [0.0, -1.0],
    ];
    const INDICES: [u16; 24] = [0, 1, 3, 4, 2, 5, 2, 1, 5, 5, 1, 6, 6, 1, 8, 9, 7, 10, 7, 1, 10, 1, 0, 10];
    let positions = WantedAttribute { id: 2, name: String::new(), component: ComponentType::F32, width: 3, most: 11 };
    let Output { attributes, indices, .. } = decode(&stream(SEAMS), &[positions]).unwrap();
    let floats: Vec<f32> = attributes[0].as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    assert!(floats.as_chunks::<3>().0.iter().map(|&[x, y, _]| [x.round(), y.round()]).eq(PLACES));
    assert_eq!(indices, INDICES.map(u32::from));
}
