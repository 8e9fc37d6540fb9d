//! Arbitrary files: the loader returns a sound scene or an error, whatever the input.

use super::tests::painted::roof;
use super::tests::{FORMATS, of, square};
use crate::load::geometry::invariants::assert_sound;
use crate::load::{LoadOptions, Polygons};
use proptest::prelude::*;

/// Words of headers, and values that break them.
const WORDS: [&str; 30] = [
    "comment",
    "element",
    "property",
    "list",
    "vertex",
    "face",
    "tristrips",
    "vertex_indices",
    "x",
    "y",
    "z",
    "nx",
    "red",
    "alpha",
    "uchar",
    "int",
    "float",
    "double",
    "TextureFile",
    "texcoord",
    "texnumber",
    "edge",
    "0",
    "1",
    "3",
    "18446744073709551615",
    "-1",
    "\n",
    "\n",
    "\n",
];

fn check(bytes: &[u8]) {
    for polygons in [Polygons::Cut, Polygons::Whole] {
        if let Ok(loaded) = of(bytes, &LoadOptions { polygons, ..LoadOptions::default() }) {
            assert_sound(&loaded);
        }
    }
}

proptest! {
    #[test]
    fn a_file_with_wrong_bytes_ends_in_a_sound_scene_or_an_error(
        format in prop::sample::select(&FORMATS[..]),
        is_painted in any::<bool>(),
        wrong in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = if is_painted { roof(format) } else { square(format) };
        for (at, byte) in wrong {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        check(&bytes);
    }

    #[test]
    fn any_header_ends_in_a_sound_scene_or_an_error(
        format in prop::sample::select(&FORMATS[..]),
        words in prop::collection::vec(prop::sample::select(&WORDS[..]), 0..60),
        body in prop::collection::vec(any::<u8>(), 0..80),
    ) {
        let mut bytes = format!("ply\nformat {format} 1.0\n{}\nend_header\n", words.join(" ")).into_bytes();
        bytes.extend(&body);
        check(&bytes);
    }

    #[test]
    fn any_values_end_in_a_sound_scene_or_an_error(
        format in prop::sample::select(&FORMATS[..]),
        vertices in 0u32..6,
        faces in 0u32..4,
        body in prop::collection::vec(prop::sample::select(&b"0123456789 -.\n\x00\x01\x02\x03"[..]), 0..160),
    ) {
        let mut bytes = format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty char x\nproperty char y\nproperty char z\n\
             property uchar nx\nproperty char ny\nproperty char nz\n\
             element face {faces}\nproperty list uchar uchar vertex_indices\nend_header\n"
        )
        .into_bytes();
        bytes.extend(&body);
        check(&bytes);
    }
}
