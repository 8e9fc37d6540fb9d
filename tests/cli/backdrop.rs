//! The default background of models.

use super::program::{CUBE, Folder, picture};
use meshray::image::statistics::{as_is, look};

/// A triangle in a glTF file, with this material.
fn triangle(material: &str) -> String {
    // Nine little-endian floats: (-1, -1, 0), (1, -1, 0), (0, 1, 0).
    let bytes = "AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "extensionsUsed":["KHR_materials_unlit"],"materials":[{material}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{bytes}"}}]}}"#
    )
}

const LIT: &str = r#"{"pbrMetallicRoughness":{"metallicFactor":0}}"#;
/// The default material: white metal, fully rough.
const METAL: &str = "{}";
const UNLIT: &str = r#"{"extensions":{"KHR_materials_unlit":{}}}"#;
const GLOWING: &str = r#"{"emissiveFactor":[1,1,1],"pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1]}}"#;

/// The top row of a picture, which the model does not reach.
fn top(folder: &Folder, arguments: &[&str]) -> Vec<[f32; 4]> {
    folder.render(&[arguments, &["-o", "out.png"]].concat()).ends(0);
    picture(&folder.path("out.png")).beauty[..32].to_vec()
}

#[test]
fn lit_unlit_and_glowing_models_stand_before_the_same_backdrop() {
    let files = [("lit.gltf", LIT), ("unlit.gltf", UNLIT), ("glowing.gltf", GLOWING)];
    let folder = files.into_iter().fold(Folder::new(), |folder, (name, m)| folder.file(name, triangle(m)));
    let lit = top(&folder, &["lit.gltf", "--view", "iso"]);
    assert!(lit.iter().all(|p| (0.02..0.4).contains(&p[0]) && p[3] == 1.0), "neither black nor white: {lit:?}");
    for name in ["unlit.gltf", "glowing.gltf"] {
        assert_eq!(top(&folder, &[name, "--view", "iso"]), lit, "{name}");
    }
}

#[test]
fn an_unlit_obj_stands_before_the_same_backdrop_as_a_lit_one() {
    let with = |name: &str| format!("mtllib all.mtl\nusemtl {name}\n{CUBE}");
    let folder = Folder::new()
        .file("all.mtl", "newmtl lit\nKd 1 1 1\nillum 1\nnewmtl unlit\nKd 1 1 1\nillum 0\n")
        .file("lit.obj", with("lit"))
        .file("unlit.obj", with("unlit"));
    let lit = top(&folder, &["lit.obj", "--mtl", "literal"]);
    assert_eq!(top(&folder, &["unlit.obj", "--mtl", "literal"]), lit);
}

#[test]
fn metal_is_neither_dark_nor_blown_out_and_stands_out_from_the_backdrop() {
    let folder = Folder::new().file("metal.gltf", triangle(METAL));
    for view in ["front", "iso"] {
        let render = |background: &[&str]| {
            folder.render(&[&["metal.gltf", "--view", view, "-o", "out.png"], background].concat()).ends(0);
            picture(&folder.path("out.png"))
        };
        let alone = look(&render(&["--background", "transparent"]), &as_is());
        assert!((0.2..0.7).contains(&alone.mean_luminance) && alone.clipped < 0.01, "{view}: {alone:?}");
        let whole = render(&[]);
        let (metal, behind) = (whole.beauty[12 * 32 + 16][0], whole.beauty[0][0]);
        assert!(metal > 3.0 * behind, "{view}: {metal} before {behind}");
    }
}

#[test]
fn a_jpeg_cannot_be_transparent_and_says_so() {
    let folder = Folder::with_cube();
    let words = |name| ["cube.obj", "-o", name, "--background", "transparent"];
    folder.render(&words("a.jpg")).ends(0).says(&["a.jpg: JPEG has no transparency", "PNG"]);
    assert!(!folder.render(&words("a.png")).ends(0).stderr.contains("transparency"));
}
