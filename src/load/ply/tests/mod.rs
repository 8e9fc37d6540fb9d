//! Whole files, built in memory.

use super::*;
use crate::load::{Limits, Polygons};
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::AlphaMode;

pub(super) mod painted;

pub(super) fn of(bytes: &[u8], options: &LoadOptions) -> Result<Loaded, String> {
    let source = Source::new("a.ply".into(), bytes.to_vec());
    load(&source, options, &mut Budget::new(&options.limits)).map_err(|e| e.to_string())
}

fn plain(bytes: &[u8]) -> Loaded {
    of(bytes, &LoadOptions::default()).unwrap()
}

fn fault(bytes: &[u8]) -> String {
    of(bytes, &LoadOptions::default()).unwrap_err()
}

/// A value, which every encoding writes in its own way.
enum Value {
    Byte(u8),
    Int(i32),
    Float(f32),
    Double(f64),
}

/// File with this header behind the line `format`.
fn encoded(format: &str, header: &str, values: &[Value]) -> Vec<u8> {
    let mut out = format!("ply\nformat {format} 1.0\n{header}\nend_header\n").into_bytes();
    for value in values {
        match (format, value) {
            ("ascii", Value::Byte(x)) => out.extend(format!("{x} ").bytes()),
            ("ascii", Value::Int(x)) => out.extend(format!("{x}\n").bytes()),
            ("ascii", Value::Float(x)) => out.extend(format!("{x} ").bytes()),
            ("ascii", Value::Double(x)) => out.extend(format!("{x} ").bytes()),
            ("binary_little_endian", Value::Int(x)) => out.extend(x.to_le_bytes()),
            ("binary_little_endian", Value::Float(x)) => out.extend(x.to_le_bytes()),
            ("binary_little_endian", Value::Double(x)) => out.extend(x.to_le_bytes()),
            (_, Value::Byte(x)) => out.push(*x),
            (_, Value::Int(x)) => out.extend(x.to_be_bytes()),
            (_, Value::Float(x)) => out.extend(x.to_be_bytes()),
            (_, Value::Double(x)) => out.extend(x.to_be_bytes()),
        }
    }
    out
}

pub(super) const FORMATS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// A square of four vertices with every property that is read, some that are not, and a triangle beside it.
pub(super) fn square(format: &str) -> Vec<u8> {
    let header = "comment made by hand\nelement vertex 5\nproperty float x\nproperty float y\nproperty double z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\nproperty int scanner\n\
        element camera 1\nproperty list uchar float view\n\
        element face 2\nproperty uchar quality\nproperty list uchar int vertex_indices\nproperty list uchar float wedge";
    let mut values = Vec::new();
    for (i, (x, y)) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (2.0, 0.5)].into_iter().enumerate() {
        values.extend([x, y].map(Value::Float));
        values.push(Value::Double(0.25));
        values.extend([0.0, 0.0, 2.0, x / 2.0, y].map(Value::Float));
        values.extend([255, 0, 51 * i as u8, 255].map(Value::Byte));
        values.push(Value::Int(-7));
    }
    values.extend([Value::Byte(2), Value::Float(1.0), Value::Float(2.0)]);
    values.extend([Value::Byte(9), Value::Byte(4)].into_iter().chain([0, 1, 2, 3].map(Value::Int)));
    values.extend([Value::Byte(1), Value::Float(0.5)]);
    values.extend([Value::Byte(9), Value::Byte(3)].into_iter().chain([1, 4, 2].map(Value::Int)));
    values.push(Value::Byte(0));
    encoded(format, header, &values)
}

#[test]
fn every_encoding_gives_the_same_scene() {
    let text = plain(&square("ascii"));
    let mesh = &text.scene.meshes[0];
    assert_eq!((text.facts.faces, mesh.triangles.len(), mesh.positions.len()), (2, 3, 5));
    assert_eq!(mesh.normals, [Vec3::Z; 5]);
    assert_eq!(mesh.uvs[0][2], Vec2::new(0.5, 0.0), "v points up in the file and down here");
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(text.facts.generator, "");
    assert!(text.warnings.is_empty(), "{:?}", text.warnings);
    let names = ["PLY (ascii)", "PLY (binary, little-endian)", "PLY (binary, big-endian)"];
    for (format, name) in FORMATS.into_iter().zip(names) {
        let loaded = plain(&square(format));
        assert_eq!(loaded.facts.format, name);
        assert_eq!(format!("{:?}", loaded.scene), format!("{:?}", text.scene), "{format}");
    }
}

#[test]
fn triangles_alone_are_the_same_in_every_encoding_and_among_other_faces() {
    // Enough rows for several threads, each with a property that is not read.
    let header = |faces: u32| {
        format!(
            "element vertex 9000\nproperty float x\nproperty double y\nproperty float z\nproperty uchar quality\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\n\
             element face {faces}\nproperty uchar kind\nproperty list uchar int vertex_index"
        )
    };
    let vertex = |i: i32| {
        let [x, z] = [i % 91, i % 17].map(|x| Value::Float(x as f32 * 0.5));
        let [r, g, b] = [i % 256, i % 7, i % 91].map(|light| Value::Byte(light as u8));
        [x, Value::Double(f64::from(i / 91) * 0.25), z, Value::Byte(7), r, g, b]
    };
    let triangle = |i: i32| {
        let [a, b, c] = [i, (i * 7 + 1) % 9000, (i * 13 + 2) % 9000].map(Value::Int);
        [Value::Byte(1), Value::Byte(3), a, b, c]
    };
    let values = |quad: bool| {
        let mut values: Vec<Value> = (0..9000).flat_map(vertex).chain((0..8999).flat_map(triangle)).collect();
        if quad {
            values.extend([Value::Byte(1), Value::Byte(4)]);
            values.extend([0, 1, 92, 91].map(Value::Int));
        }
        values
    };
    let of = |format: &str, quad| plain(&encoded(format, &header(8999 + u32::from(quad)), &values(quad)));
    let [text, little, big] = FORMATS.map(|format| of(format, false));
    assert_eq!(text.facts.faces + text.facts.dropped.iter().map(|dropped| dropped.1).sum::<u64>(), 8999);
    let expected = format!("{:?}", text.scene);
    assert!(format!("{:?}", little.scene) == expected && format!("{:?}", big.scene) == expected);
    let (alone, mixed) = (&little.scene.meshes[0], &of(FORMATS[1], true).scene.meshes[0]);
    let places = |mesh: &crate::scene::Mesh| -> Vec<_> {
        mesh.triangles.iter().map(|t| t.map(|i| (mesh.positions[i as usize], mesh.colors[i as usize]))).collect()
    };
    assert!(places(mixed).starts_with(&places(alone)) && mixed.triangles.len() == alone.triangles.len() + 2);
}

#[test]
fn every_kind_of_number_is_read_in_either_byte_order() {
    let bytes: [(&str, &[u8]); 8] = [
        ("char", &[0xfe]),
        ("uint8", &[3]),
        ("short", &[0xff, 0xfe]),
        ("ushort", &[0x80, 0]),
        ("int32", &[0xff, 0xff, 0xff, 0xfd]),
        ("uint", &[0x80, 0, 0, 0]),
        ("float32", &[0x3f, 0, 0, 0]),
        ("double", &[0x3f, 0xd0, 0, 0, 0, 0, 0, 0]),
    ];
    let expected = [-2.0, 3.0, -2.0, 32768.0, -3.0, 2_147_483_648.0, 0.5, 0.25];
    for ((kind, big), expected) in bytes.into_iter().zip(expected) {
        for format in &FORMATS[1..] {
            let mut file = format!(
                "ply\nformat {format} 1.0\nelement vertex 3\nproperty {kind} x\nproperty uchar y\nproperty uchar z\n\
                 element face 1\nproperty list uchar uchar vertex_index\nend_header\n"
            )
            .into_bytes();
            for yz in [[0, 0], [1, 0], [0, 1]] {
                let little = big.iter().rev().copied();
                file.extend::<Vec<u8>>(if *format == FORMATS[2] { big.to_vec() } else { little.collect() });
                file.extend(yz);
            }
            file.extend([3, 0, 1, 2]);
            let loaded = plain(&file);
            let at = loaded.scene.instances[0].world_from_object.translation;
            let x = (loaded.scene.meshes[0].positions[0].as_dvec3() + at).x;
            assert_eq!(x, expected, "{kind} {format}");
        }
    }
}

const TRIANGLE: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n";

fn text(body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{TRIANGLE}{body}").into_bytes()
}

#[test]
fn words_may_stand_on_any_lines_and_lines_end_anyhow() {
    let expected = format!("{:?}", plain(&text("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).scene);
    let windows = String::from_utf8(text("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).unwrap().replace('\n', "\r\n");
    let old_mac = windows.replace("\r\n", "\r");
    let first_alone = windows.replacen("\r\n", "\r", 1).replace("\r\n", "\n").replacen('\r', "\r\n", 1);
    for file in [text("0 0 0 1 0 0\n\n0 1\n0 3 0 1 2"), windows.into(), old_mac.into(), first_alone.into()] {
        let loaded = plain(&file);
        assert_eq!(format!("{:?}", loaded.scene), expected);
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    }
    // A comment in an unknown encoding is still a comment.
    let mut file = b"ply\nformat ascii 1.0\ncomment caf\xe9\n".to_vec();
    file.extend(text("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").split_off("ply\nformat ascii 1.0\n".len()));
    assert_eq!(format!("{:?}", plain(&file).scene), expected);
}

#[test]
fn polygons_are_cut_or_kept_whole_as_those_of_obj() {
    let options = LoadOptions { polygons: Polygons::Whole, ..LoadOptions::default() };
    let whole = of(&square("ascii"), &options).unwrap();
    assert_eq!((whole.scene.meshes[0].polygons.len(), whole.scene.meshes[0].triangles.len()), (1, 1));
}

#[test]
fn strips_turn_at_every_triangle_and_start_anew_at_minus_one() {
    let file = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n9 0 1 2 3 3 -1 1 4 3\n";
    let loaded = plain(file.as_bytes());
    assert_eq!(loaded.scene.meshes[0].triangles, [[0, 1, 2], [2, 1, 3], [1, 4, 3]]);
    let up = loaded.scene.meshes[0].triangles.iter().all(|t| {
        let [a, b, c] = t.map(|i| loaded.scene.meshes[0].positions[i as usize]);
        (b - a).cross(c - a).z > 0.0
    });
    assert!(up, "every triangle is seen from the same side");
}

#[test]
fn opacity_of_vertices_is_drawn_and_an_empty_channel_is_not() {
    let file = |alphas: [f32; 3]| {
        let vertex = |a: f32, at: &str| format!("{at} 1 1 1 {a}\n");
        let [a, b, c] = alphas;
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property float red\nproperty float green\nproperty float blue\nproperty float alpha\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n{}{}{}3 0 1 2\n",
            vertex(a, "0 0 0"),
            vertex(b, "1 0 0"),
            vertex(c, "0 1 0")
        )
    };
    let see_through = plain(file([1.0, 0.5, 0.0]).as_bytes()).scene;
    assert_eq!(see_through.meshes[0].colors.iter().map(|c| c.w).collect::<Vec<_>>(), [1.0, 0.5, 0.0]);
    assert_eq!(see_through.materials[0].alpha_mode, AlphaMode::Blend);
    for alphas in [[1.0; 3], [0.0; 3]] {
        let Loaded { scene, warnings, .. } = plain(file(alphas).as_bytes());
        assert!(scene.meshes[0].colors.is_empty(), "white and opaque");
        let told: &[&str] = if alphas[0] == 0.0 { &["color-clear"] } else { &[] };
        assert_eq!(warnings.iter().map(|w| w.code).collect::<Vec<_>>(), told);
        assert_eq!(scene.materials[0].alpha_mode, AlphaMode::Opaque);
    }
}

#[test]
fn gaussian_splats_are_points_of_their_colours() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let splats = format!(
        "ply\nformat ascii 1.0\nelement vertex 2\n{xyz}property float nx\nproperty float ny\nproperty float nz\n\
         property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\nend_header\n\
         0 0 0 0 0 0 9 -9 -9 -3\n1 0 0 0 0 0 0 0 0 2\n"
    );
    let loaded = plain(splats.as_bytes());
    assert_eq!(loaded.warnings.iter().map(|w| w.code).collect::<Vec<_>>(), ["ply-splats"]);
    let colors = &loaded.scene.meshes[0].colors;
    let grey = crate::scene::color::from_srgb([0.5; 3]).extend(1.0);
    assert!(
        colors[0] == Vec4::new(1.0, 0.0, 0.0, 1.0) && colors.iter().any(|c| (*c - grey).length() < 1e-6),
        "{colors:?}"
    );
}

#[test]
fn what_cannot_be_drawn_is_counted() {
    let file = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element edge 2\nproperty int vertex1\nproperty int vertex2\n\
        element face 4\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\nnan 1 0\n0 1\n1 2\n2 0 1\n3 0 1 2\n3 0 0 1\n0\n";
    let loaded = plain(file.as_bytes());
    assert_eq!((loaded.facts.faces, loaded.facts.wires.lines), (0, 2));
    let mut codes: Vec<_> = loaded.warnings.iter().map(|w| (w.code, w.count)).collect();
    codes.sort_unstable();
    let expected = [("face-degenerate", 1), ("face-few-corners", 2), ("face-not-finite", 1), ("line-not-finite", 1)];
    assert_eq!(codes, expected);
    let dropped: u64 = loaded.facts.dropped.iter().map(|d| d.1).sum();
    assert_eq!(dropped, 5);
    assert_eq!(loaded.scene.meshes[0].triangles.len(), 8, "one edge has both its ends");

    let start = "ply\nformat ascii 1.0\nelement vertex 0\nproperty int x\nproperty int y\nproperty int z\n";
    let nothing = plain(format!("{start}end_header\n").as_bytes());
    assert!(nothing.scene.meshes.is_empty());
    assert_eq!(nothing.warnings[0].to_string(), "a.ply: 0 vertices and no face: there is nothing to draw");
}

#[test]
fn vertices_that_nothing_joins_are_points_lit_by_their_normals() {
    let header = |normals: &str| {
        let axes = "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
        format!("ply\nformat ascii 1.0\nelement vertex 2\n{axes}{normals}end_header\n")
    };
    let cloud = plain(format!("{}0 0 0 255 0 0\n3 4 0 0 255 0\n", header("")).as_bytes());
    let (mesh, wires) = (&cloud.scene.meshes[0], cloud.facts.wires);
    assert_eq!((wires.points, wires.lines, wires.point_width, mesh.triangles.len()), (2, 0, 5.0 / 256.0, 16));
    assert_eq!((mesh.colors[0].to_array(), mesh.colors[6].to_array()), ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]));
    assert!(mesh.normals.is_empty() && cloud.warnings.is_empty(), "{:?}", cloud.warnings);
    let normals = "property float nx\nproperty float ny\nproperty float nz\n";
    let cloud = plain(format!("{}0 0 0 255 0 0 0 0 2\n3 4 0 0 255 0 1 0 0\n", header(normals)).as_bytes());
    let mesh = &cloud.scene.meshes[0];
    assert_eq!((mesh.triangles.len(), mesh.normals[0], mesh.normals[4]), (4, Vec3::Z, Vec3::X));
    // The vertex without a normal takes the mean of the others; where most have none, none is used.
    let lit = |normals_of: [&str; 3]| {
        let header = header(normals).replace("vertex 2", "vertex 3");
        let vertex = |(i, normal): (usize, &str)| format!("{i} 0 0 255 0 0 {normal}\n");
        let rows: String = normals_of.into_iter().enumerate().map(vertex).collect();
        plain(format!("{header}{rows}").as_bytes()).scene.meshes[0].normals.clone()
    };
    assert!((lit(["1 0 0", "0 0 0", "0 0 3"])[4] - Vec3::new(0.5, 0.0, 0.5).normalize()).length() < 1e-6);
    assert!(lit(["1 0 0", "0 0 0", "nan 0 0"]).is_empty());
}

#[test]
fn faults_name_the_line_or_the_byte() {
    let header = |line: &str| format!("ply\nformat ascii 1.0\n{line}\nend_header\n").into_bytes();
    let expected: [(Vec<u8>, &str); 14] = [
        (b"ply\n".to_vec(), "a.ply:1: the file ends inside the header, before `end_header`"),
        (b"plywood\n".to_vec(), "a.ply:1: the file does not begin with a line `ply`"),
        (b"ply\nend_header\n".to_vec(), "a.ply:2: the header has no line `format`"),
        (b"ply\nformat utf8 1.0\nend_header\n".to_vec(), "a.ply:2: `utf8` is no format of PLY"),
        (header("element vertex many"), "a.ply:3: `many` is no number of elements `vertex`"),
        (header("property float x"), "a.ply:3: a property before the first element"),
        (header("element vertex 1\nproperty half x"), "a.ply:4: `half` is no type of PLY"),
        (header("element face 1\nproperty list float int vertex_index"), "a.ply:4: the length of a list"),
        (header("elephant"), "a.ply:3: `elephant` is no line of a PLY header"),
        (
            header("element vertex 1\nproperty float x"),
            "a.ply:6: the header claims 1 × `vertex` of at least 1 bytes, but 0",
        ),
        (header("element vertex 0\nproperty float x"), "a.ply:6: vertices have no x, y and z"),
        (text("0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"), "a.ply:11: `zero` is no number, in `y` of vertex 1"),
        (text("0 0 0\n1 0 0\n0 1 0\n3 0 1\n"), "a.ply:14: the file ends before `vertex_indices` of face 0"),
        (text("0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "a.ply:13: corner 2 of face 0 is vertex 3, but only 3 vertices exist"),
    ];
    for (file, message) in expected {
        let fault = fault(&file);
        assert!(fault.starts_with(message) && fault.lines().count() == 1, "{fault}\n{message}");
    }
    let mut binary = square(FORMATS[1]);
    let length = binary.len();
    binary.truncate(length - 1);
    let cut = fault(&binary);
    assert!(cut.starts_with(&format!("a.ply:byte {}: the file ends before `wedge` of face 1", length - 1)), "{cut}");
}

#[test]
fn counts_in_a_header_take_no_memory() {
    let claims = |line: &str| format!("ply\nformat binary_little_endian 1.0\nelement {line}\nend_header\nabcd");
    // No bytes per row, however many rows: nothing to read.
    assert!(of(claims("thing 18446744073709551615").as_bytes(), &LoadOptions::default()).is_ok());
    for line in [
        "vertex 18446744073709551615\nproperty float x\nproperty float y\nproperty float z",
        "vertex 4000000000\nproperty double x\nproperty double y\nproperty double z",
        "face 1\nproperty list uint int vertex_indices",
        "thing 18446744073709551615\nproperty list uchar int what",
    ] {
        assert!(fault(claims(line).as_bytes()).starts_with("a.ply:byte"), "{line}");
    }
    let small = LoadOptions { limits: Limits { memory: 500, ..Limits::default() }, ..LoadOptions::default() };
    let over = of(&square("ascii"), &small).unwrap_err();
    assert_eq!(over, "a.ply: 960 bytes are needed where 500 of 500 are left; raise --max-memory");
}

#[test]
fn lists_and_headers_take_no_memory_that_was_not_granted() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\n\
        property uchar z\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n";
    let bytes = [header.as_bytes(), &[0, 0, 0, 1, 0, 0, 0, 1, 0], &100_000_u32.to_le_bytes(), &[1; 100_000]].concat();
    let small = LoadOptions { limits: Limits { memory: 1_000_000, ..Limits::default() }, ..LoadOptions::default() };
    // The file, three vertices, and for the list the memory of a face with that many corners.
    let over = of(&bytes, &small).unwrap_err();
    assert!(over.starts_with("a.ply: 4000056 bytes are needed"), "{over}");
    assert!(of(&bytes, &LoadOptions::default()).is_ok());
    let cut = fault(&bytes[..bytes.len() - 1]);
    assert!(cut.contains("the file ends before `vertex_indices` of face 0"), "{cut}");
    let many = format!("ply\nformat ascii 1.0\n{}end_header\n", "element a 0\n".repeat(5000));
    assert!(fault(many.as_bytes()).contains("more than 4096 elements, properties and pictures"));
}

/// A triangle as text, with `comment` before the faces in the header, and further values of its vertices and its face.
fn triangle(vertex: &str, comment: &str, face: &str, of_vertex: [&str; 3], of_face: &str) -> Loaded {
    let [a, b, c] = of_vertex;
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{vertex}{comment}\
         element face 1\nproperty list uchar int vertex_indices\n{face}end_header\n\
         0 0 0 {a}\n1 0 0 {b}\n0 1 0 {c}\n3 0 1 2 {of_face}\n"
    );
    plain(text.as_bytes())
}

#[test]
fn what_follows_the_elements_is_told_and_a_mark_before_them_is_none() {
    let warnings = |file: &[u8]| plain(file).warnings.iter().map(ToString::to_string).collect::<Vec<_>>();
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(warnings(&text(&format!("{body} \n\r\n"))), [""; 0]);
    let more = warnings(&text(&format!("{body}3 2 1 0\n")));
    assert_eq!(more, ["a.ply:13: 7 bytes follow what the header counts; they are not read"]);
    let mut marked = b"\xef\xbb\xbf".to_vec();
    marked.extend(text(body));
    assert_eq!(plain(&marked).facts.faces, 1);
    let vertex = "element vertex 1\nproperty float x\nproperty float y\nproperty float z";
    let mut binary =
        encoded("binary_little_endian", vertex, &[Value::Float(1.0), Value::Float(2.0), Value::Float(3.0)]);
    assert!(!warnings(&binary).iter().any(|w| w.contains("follow")));
    let end = binary.len();
    binary.push(b'\n');
    assert!(!warnings(&binary).iter().any(|w| w.contains("follow")));
    binary[end] = 0;
    let told = format!("a.ply:byte {end}: 1 bytes follow what the header counts; they are not read");
    assert!(warnings(&binary).contains(&told), "{:?}", warnings(&binary));
}

#[test]
fn what_would_change_the_look_and_is_not_read_is_told() {
    let told = |loaded: Loaded| loaded.warnings.iter().map(ToString::to_string).collect::<Vec<_>>();
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let faces = triangle(colors, "", colors, ["0 255 0"; 3], "255 0 0");
    assert_eq!(told(faces), ["a.ply: colours of faces are not drawn: the vertices have some, too; keep one of both"]);
}

#[test]
fn float_colours_above_one_are_bytes() {
    let colors = "property float red\nproperty float green\nproperty float blue\n";
    let loaded = triangle(colors, "", "", ["255 0 0", "0 255 0", "0 0 0"], "");
    assert_eq!(loaded.scene.meshes[0].colors[..2], [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0)]);
    assert_eq!(loaded.warnings[0].code, "color-bytes");
    let wide = colors.replace("float", "ushort");
    let loaded = triangle(&wide, "", "", ["255 0 0", "0 51 0", "0 0 0"], "");
    let [first, second, _] = loaded.scene.meshes[0].colors[..] else { panic!("three corners") };
    assert!((first - Vec4::new(1.0, 0.0, 0.0, 1.0)).abs().max_element() < 1e-6, "{first}");
    assert!(second.y > 0.02 && loaded.warnings[0].code == "color-bytes", "{second}");
    let with_alpha = format!("{wide}property ushort alpha\n");
    for (alpha, opacity) in [("255", 1.0), ("32768", 0.5), ("65535", 1.0)] {
        let rows = ["255 0 0", "0 51 0", "0 0 0"].map(|light| format!("{light} {alpha}"));
        let loaded = triangle(&with_alpha, "", "", [&*rows[0], &*rows[1], &*rows[2]], "");
        assert!((loaded.scene.meshes[0].colors[0].w - opacity).abs() < 1e-4, "{alpha}");
    }
    let loaded = triangle(&wide, "", "", ["65535 0 0", "0 255 0", "0 0 0"], "");
    assert!(loaded.scene.meshes[0].colors[1].y < 0.001 && loaded.warnings.is_empty());
    let beyond = triangle(colors, "", "", ["1.5 0 0", "0 -1 0", "0 0 nan"], "");
    assert_eq!((beyond.warnings[0].code, beyond.scene.meshes[0].colors[2]), ("color-range", Vec4::ONE));
}

#[test]
fn normals_that_are_no_numbers_as_c_prints_them_are_none() {
    let normals = "property float nx\nproperty float ny\nproperty float nz\n";
    let loaded = triangle(normals, "", "", ["-nan(ind) -nan(ind) 1.#QNAN", "0 0 1", "0 0 1"], "");
    assert_eq!((loaded.facts.faces, loaded.warnings.len()), (1, 0), "{:?}", loaded.warnings);
}

#[test]
fn decimal_commas_are_read_and_told() {
    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let loaded = triangle(colors, "", "", ["255 0 0", "0 255,0 0", "0 0 255"], "");
    assert_eq!((loaded.warnings.len(), loaded.warnings[0].code), (1, "ply-number"), "{:?}", loaded.warnings);
    assert!(loaded.warnings[0].text.starts_with("`255,0` is read"), "{}", loaded.warnings[0].text);
    let mesh = &loaded.scene.meshes[0];
    assert_eq!((mesh.colors[1], loaded.scene.materials[0].base_color), (Vec4::new(0.0, 1.0, 0.0, 1.0), Vec3::ONE));
}

#[test]
fn what_two_properties_say_is_what_the_first_says_and_the_other_is_told() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               property float s\nproperty float t\nproperty float u\nproperty float v\nproperty float x\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 0 .1 .2 .3 .4 9\n1 0 0 .1 .2 .3 .4 9\n0 1 0 .1 .2 .3 .4 9\n3 0 1 2\n";
    let loaded = plain(ply.as_bytes());
    assert_eq!(loaded.warnings.iter().map(|w| w.code).collect::<Vec<_>>(), ["ply-property-twice"; 3]);
    assert_eq!(loaded.warnings[0].text, "'x' of a vertex is there twice, and the second is not read");
    assert_eq!(loaded.warnings[1].text, "'u' of a vertex says what 's' has said, and is not read");
    let mesh = &loaded.scene.meshes[0];
    assert!(mesh.positions.iter().all(|p| p.x < 2.0) && mesh.uvs[0].iter().all(|uv| uv.x == 0.1), "{:?}", mesh.uvs);
}

#[test]
fn a_line_that_has_not_the_numbers_of_its_row_is_named() {
    let header = TRIANGLE.replace("vertex 3", "vertex 5");
    let told = |vertices: &str| -> Vec<String> {
        let file = format!("ply\nformat ascii 1.0\n{header}{vertices}\n3 0 1 2\n");
        plain(file.as_bytes()).warnings.iter().filter(|w| w.code == "ply-torn-line").map(ToString::to_string).collect()
    };
    assert_eq!(told("0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1"), [""; 0]);
    let fewer = told("0 0 0\n1 0 0\n0 1\n0 0 1\n1 1 1");
    let wrong = "so that all behind it are read from wrong places; repair that line";
    assert_eq!(fewer, [format!("a.ply:12: vertex 2 has fewer numbers than the header says, {wrong}")]);
    let more = told("0 0 0\n1 0 0\n0 1 0 7\n0 0 1\n1 1 1");
    assert_eq!(more, [format!("a.ply:12: vertex 2 has more numbers than the header says, {wrong}")]);
    assert_eq!(told("0 0 0\n1 0 0\n0 1 0 0 0 1\n1 1 1"), [""; 0], "two rows in a line");
    let lost = fault(format!("ply\nformat ascii 1.0\n{header}0 0 0\n1 0 0\n0 1\n0 0 1\n1 1 1\n3 9 1 2\n").as_bytes());
    assert!(lost.starts_with("a.ply:12: vertex 2 has fewer numbers"), "{lost}");
}

#[test]
fn faces_under_names_that_are_not_known_are_told() {
    let of = |from: &str, to: &str| {
        let file = String::from_utf8(text("0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).unwrap();
        plain(file.replace(from, to).as_bytes())
    };
    assert_eq!(of("vertex_indices", "vertex_idx").facts.faces, 1);
    for (from, to) in [("element face", "element polygon"), ("vertex_indices", "corners")] {
        let loaded = of(from, to);
        let codes: Vec<_> = loaded.warnings.iter().map(|w| w.code).collect();
        assert_eq!((loaded.facts.faces, codes), (0, vec!["ply-unread-element"]), "{to}");
    }
}

#[test]
fn strips_of_numbers_without_sign_end_at_the_greatest() {
    for (kind, end) in [("uint", "4294967295"), ("ushort", "65535"), ("uchar", "255"), ("int", "-1")] {
        let header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n";
        let file = format!(
            "ply\nformat ascii 1.0\n{header}property list int {kind} vertex_indices\nend_header\n\
             0 0 0\n1 0 0\n0 1 0\n1 1 0\n7 0 1 2 {end} 1 3 2\n"
        );
        assert_eq!(plain(file.as_bytes()).facts.faces, 2, "{kind}");
    }
}
