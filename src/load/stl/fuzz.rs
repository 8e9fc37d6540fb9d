//! Arbitrary files: the loader returns a sound scene or an error, whatever the input.

use super::tests::{binary, of, text};
use crate::load::LoadOptions;
use crate::load::geometry::invariants::assert_sound;
use proptest::prelude::*;

proptest! {
    #[test]
    fn a_file_with_wrong_bytes_ends_in_a_sound_scene_or_an_error(
        is_text in any::<bool>(),
        wrong in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = if is_text { text().into_bytes() } else { binary("fuzz") };
        for (at, byte) in wrong {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(loaded) = of(&bytes, &LoadOptions::default()) {
            assert_sound(&loaded);
        }
    }

    #[test]
    fn any_words_end_in_a_sound_scene_or_an_error(
        words in prop::collection::vec(prop::sample::select(&[
            "solid", "facet", "normal", "outer", "loop", "vertex", "endloop", "endfacet", "endsolid", "0", "1", "-2.5",
            "nan", "1e300", "\n",
        ][..]), 0..80),
    ) {
        if let Ok(loaded) = of(format!("solid {}", words.join(" ")).as_bytes(), &LoadOptions::default()) {
            assert_sound(&loaded);
        }
    }
}
