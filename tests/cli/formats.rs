//! Every file format through every command that loads one, and the choice of a variant.

use super::program::{CUBE, Folder, picture};
use serde_json::{Value, json};

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

/// An STL file of two triangles, 50 bytes each.
fn stl() -> Vec<u8> {
    let mut out = b"solid? no: binary".to_vec();
    out.resize(80, 0);
    out.extend(2u32.to_le_bytes());
    for corners in [[0., 0., 0., 1., 0., 0., 1., 1., 0.], [0., 0., 0., 1., 1., 0., 0., 1., 0.]] {
        out.extend([0; 12]);
        out.extend(corners.iter().flat_map(|x: &f32| x.to_le_bytes()));
        out.extend([0; 2]);
    }
    out
}

#[test]
fn ply_and_stl_go_through_every_command() {
    let scene = "[[models]]\nfile = 'a.ply'\n[[models]]\nfile = 'a.stl'\n";
    let folder = Folder::new().file("a.ply", PLY).file("a.stl", stl()).file("both.toml", scene);
    for (name, format, faces) in [("a.ply", "PLY (ascii)", 1), ("a.stl", "STL (binary)", 2)] {
        let report: Value = serde_json::from_str(folder.run(&["inspect", "--json", name]).ends(0).text()).unwrap();
        assert_eq!((&report["format"], &report["faces"]), (&json!(format), &json!(faces)));
        assert_eq!((&report["triangles"], &report["topology"]["open"]), (&json!(2), &json!(4)), "{name} is connected");
        folder.run(&["bench", name, "--size", "8x6", "--passes", "0", "-q"]).ends(0);
        folder.run(&["verify", name, "--rays", "2", "-q"]).ends(0);
    }
    folder.render(&["a.ply", "a.stl", "--merge", "-o", "merged.png", "--up", "y"]).ends(0);
    folder.render(&["both.toml"]).ends(0);
    assert!(folder.has("merged.png") && folder.has("both.png"));
}

#[test]
fn damaged_ply_and_stl_are_one_line_and_exit_code_3() {
    let folder = Folder::new().file("a.ply", &PLY[..PLY.len() - 4]).file("a.stl", &stl()[..100]);
    folder.render(&["a.ply"]).ends(3).says(&["a.ply:", "vertex_indices"]);
    folder.render(&["a.stl"]).ends(3).says(&["a.stl:byte 84:", "2 triangles"]);
}

#[test]
fn a_variant_is_chosen_kept_with_the_picture_and_listed() {
    let bytes: Vec<u8> = [0., 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
    let mappings = json!([{"material": 1, "variants": [1]}]);
    let gltf = json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "extensionsUsed": ["KHR_materials_variants"],
        "extensions": {"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0,
            "extensions": {"KHR_materials_variants": {"mappings": mappings}}}]}],
        "materials": [{"emissiveFactor": [1, 1, 1]}, {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3,
            "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": "a.bin"}],
    });
    let folder = Folder::new().file("a.gltf", gltf.to_string()).file("a.bin", bytes);
    folder.render(&["a.gltf", "-o", "day.png"]).ends(0);
    folder.render(&["a.gltf", "--variant", "night", "-o", "night.png"]).ends(0);
    assert_ne!(picture(&folder.path("day.png")).beauty, picture(&folder.path("night.png")).beauty);

    folder.run(&["render", "--again", "night.png", "-o", "again.png"]).ends(0);
    assert_eq!(picture(&folder.path("again.png")).beauty, picture(&folder.path("night.png")).beauty);
    folder.run(&["render", "--again", "night.png", "--variant", "day"]).ends(2);
    folder.render(&["a.gltf", "a.gltf", "--merge", "--variant", "day"]).ends(2).says(&["--variant"]);
    folder.render(&["a.gltf", "--variant", "dusk"]).ends(3).says(&["no variant 'dusk'", "0 'day', 1 'night'"]);

    let report: Value =
        serde_json::from_str(folder.run(&["inspect", "a.gltf", "--variant", "1", "--json"]).ends(0).text()).unwrap();
    assert_eq!((&report["variants"], &report["variant"]), (&json!(["day", "night"]), &json!(1)));
    assert!(folder.run(&["inspect", "a.gltf", "--variant", "1"]).text().contains("0 'day', 1 'night' (this one)"));
}

#[test]
fn points_and_lines_are_drawn_as_thick_as_inspect_says() {
    let text = "mtllib a.mtl\nv -4 0 0\nv 4 0 0\nv 0 -3 0\nv 0 3 0\nusemtl red\nl 1 2\nusemtl blue\np 3 4\n";
    let materials = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n";
    let folder = Folder::new().file("cross.obj", text).file("a.mtl", materials);
    let words = ["render", "cross.obj", "--view", "front", "--size", "129x129", "--aa", "uniform", "--samples", "36"];
    folder.run(&[&words[..], &["--background", "transparent", "--tone-map", "none"]].concat()).ends(0);
    let shown = picture(&folder.path("cross.png"));
    // Lines are 1/256 of ten units wide, and the picture shows less than 20 units.
    let [r, g, b, alpha] = shown.beauty[64 * 129 + 64];
    assert!(alpha > 0.05 && (r / alpha) > 0.99 && g == 0.0 && b == 0.0, "{:?}", shown.beauty[64 * 129 + 64]);
    let blue = shown.beauty.iter().filter(|p| p[2] > 0.0 && p[0] == 0.0).count();
    let clear = shown.beauty.iter().filter(|p| p[3] == 0.0).count();
    assert!((2..=8).contains(&blue) && clear > 129 * 124, "{blue} pixels show points, {clear} nothing");

    let report: Value = serde_json::from_str(folder.run(&["inspect", "cross.obj", "--json"]).ends(0).text()).unwrap();
    let width = json!(10.0 / 256.0);
    assert_eq!(report["wires"], json!({ "points": 2, "lines": 1, "point_width": width, "line_width": width }));
    let text = folder.run(&["inspect", "cross.obj"]);
    assert!(
        text.text().contains("2 drawn 0.0391 wide") && text.text().contains("1 drawn 0.0391 wide"),
        "{}",
        text.text()
    );
}

#[test]
fn scenes_and_variants_are_refused_where_a_file_has_none() {
    let folder = Folder::new().file("a.stl", stl()).file("cube.obj", CUBE);
    for (file, flag) in [("a.stl", "--scene"), ("cube.obj", "--scene"), ("cube.obj", "--variant")] {
        folder.render(&[file, flag, "Winter"]).ends(3).says(&[file, "'Winter'", "the file has none"]);
        folder.run(&["inspect", file, flag, "0"]).ends(3).says(&["the file has none"]);
    }
    assert_eq!(folder.names(), ["a.stl", "cube.obj"]);
}
