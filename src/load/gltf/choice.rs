//! What the user wishes for by name or number: a scene, a variant of materials, an animation.

use crate::load::Diagnostic;
use std::path::Path;

/// A list of the file that something is chosen from.
pub(super) struct Kind {
    /// One of them.
    word: &'static str,
    /// The list in the JSON.
    list: &'static str,
    /// Code of the message when there is no such thing.
    code: &'static str,
}

/// Scenes.
pub(super) const SCENE: Kind = Kind { word: "scene", list: "scenes", code: "gltf-no-such-scene" };
/// Variants of materials.
pub(super) const VARIANT: Kind =
    Kind { word: "variant", list: "extensions.KHR_materials_variants.variants", code: "gltf-no-such-variant" };
/// Animations.
pub(super) const ANIMATION: Kind = Kind { word: "animation", list: "animations", code: "gltf-no-such-animation" };

/// Names in one message before the rest is only counted.
const LISTED: usize = 20;

/// The number of what is called `wish`, or has that number; otherwise a message that lists what there is.
pub(super) fn choose(kind: &Kind, names: &[Option<&str>], wish: &str, file: &Path) -> Result<usize, Diagnostic> {
    let by_name = names.iter().position(|name| *name == Some(wish));
    let by_number = wish.parse().ok().filter(|&i: &usize| i < names.len());
    by_name.or(by_number).ok_or_else(|| {
        let shown = |(i, name): (usize, &Option<&str>)| match name {
            None | Some("") => i.to_string(),
            Some(name) => format!("{i} '{name}'"),
        };
        let list: Vec<String> = names.iter().enumerate().take(LISTED).map(shown).collect();
        let text = format!("there is no {} '{wish}'", kind.word);
        let remedy = match names.len().saturating_sub(LISTED) {
            _ if list.is_empty() => "the file has none".into(),
            0 => format!("it has {}", list.join(", ")),
            more => format!("it has {} and {more} more", list.join(", ")),
        };
        Diagnostic::new(kind.code, file, kind.list, text).remedy(remedy)
    })
}
