//! Arbitrary texts: the loader returns a sound scene or an error, whatever the input.

use super::*;
use crate::load::geometry::invariants::assert_sound;
use crate::load::{Polygons, load_source, mtl};
use proptest::prelude::*;

/// Words of OBJ and MTL texts, and values that break them.
const WORDS: [&str; 44] = [
    "v", "vt", "vn", "f", "l", "p", "o", "g", "s", "usemtl", "mtllib", "#", "\\", "0", "1", "2", "3", "4", "-1", "-2",
    "5/1", "1/2/3", "2//1", "-1/-1/-1", "0.5", "1e300", "-1e-300", "nan", "1.#IND", "1,5", "3.1+e2", "off", "name",
    "\n", "\n", "\r", "\r\n", "\t", "newmtl", "Kd", "map_Kd", "d", "-s", "\u{e4}",
];

fn text() -> impl Strategy<Value = String> {
    let word = prop::sample::select(&WORDS[..]);
    prop::collection::vec(word, 0..120).prop_map(|words| words.join(" "))
}

/// Vertices on a coarse lattice and faces of any corners: concave, crossing, collapsed, with and without normals.
fn mesh() -> impl Strategy<Value = String> {
    let vertex = (-2i32..3, -2i32..3, -1i32..2);
    let corner = (1usize..8, 0usize..3, 0usize..3);
    let face = (prop::collection::vec(corner, 1..9), 0u32..3);
    (prop::collection::vec(vertex, 7..8), prop::collection::vec(face, 0..12)).prop_map(|(vertices, faces)| {
        let mut text: String = vertices.iter().map(|(x, y, z)| format!("v {x} {y} {z}\n")).collect();
        text += "vt 0 0\nvt 1 0.5\nvn 0 0 1\nvn 1 0 0\n";
        for (corners, group) in faces {
            text += &format!("s {group}\nusemtl m{group}\nf");
            let or_none = |i: usize| if i == 0 { String::new() } else { i.to_string() };
            text.extend(corners.iter().map(|&(v, vt, vn)| format!(" {v}/{}/{}", or_none(vt), or_none(vn))));
            text.push('\n');
        }
        text
    })
}

fn check(text: &str) {
    for polygons in [Polygons::Cut, Polygons::Whole] {
        let options = LoadOptions { polygons, ..LoadOptions::default() };
        let source = Source::new("fuzz.obj".into(), text.as_bytes().to_vec());
        if let Ok(loaded) = load_source(&source, &options) {
            assert_sound(&loaded);
        }
    }
}

proptest! {
    #[test]
    fn any_text_ends_in_a_sound_scene_or_an_error(text in text()) {
        check(&text);
    }

    #[test]
    fn any_mesh_ends_in_a_sound_scene(text in mesh()) {
        check(&text);
        let source = Source::new("fuzz.obj".into(), text.into_bytes());
        prop_assert!(load_source(&source, &LoadOptions::default()).is_ok());
    }

    #[test]
    fn any_bytes_end_in_a_sound_scene_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let source = Source::new("fuzz.obj".into(), bytes);
        if let Ok(loaded) = load_source(&source, &LoadOptions::default()) {
            assert_sound(&loaded);
        }
    }

    #[test]
    fn any_library_is_read(text in text(), tail in any::<Vec<u8>>()) {
        let mut bytes = format!("newmtl a\n{text}").into_bytes();
        bytes.extend(tail);
        prop_assert!(!mtl::parse_names(&bytes).is_empty());
    }
}
