//! What the user wishes for by name or number: a scene, a variant of materials, an animation.

use crate::load::{Diagnostic, Facts, Moment};
use std::path::Path;

/// A list of the file that something is chosen from.
pub(super) struct Kind {
    /// One of them.
    word: &'static str,
    /// The list in the JSON.
    list: &'static str,
    /// Code of the message when there is no such thing.
    code: &'static str,
    /// The same when there are several of one name.
    ambiguous: &'static str,
}

/// Scenes.
pub(super) const SCENE: Kind =
    Kind { word: "scene", list: "scenes", code: "gltf-no-such-scene", ambiguous: "gltf-which-scene" };
/// Variants of materials.
pub(super) const VARIANT: Kind = Kind {
    word: "variant",
    list: "extensions.KHR_materials_variants.variants",
    code: "gltf-no-such-variant",
    ambiguous: "gltf-which-variant",
};
/// Animations.
pub(super) const ANIMATION: Kind =
    Kind { word: "animation", list: "animations", code: "gltf-no-such-animation", ambiguous: "gltf-which-animation" };

/// Names in one message before the rest is only counted.
const LISTED: usize = 20;

/// The number of what is called `wish`, or has that number where numbers begin with `first`.
pub(super) fn find(names: &[Option<&str>], wish: &str, first: usize) -> Option<usize> {
    let by_number = || wish.parse::<usize>().ok()?.checked_sub(first).filter(|&i| i < names.len());
    names.iter().position(|name| *name == Some(wish)).or_else(by_number)
}

/// Refuses a wish for an animation that none of several models has, whose animations these are.
pub(in crate::load) fn check_animation(facts: &Facts, moment: &Moment, file: &Path) -> Result<(), Diagnostic> {
    let names: Vec<Option<&str>> = facts.animations.iter().map(|animation| Some(animation.name.as_str())).collect();
    match &moment.animation {
        Some(wish) if facts.shown.is_none() => choose(&ANIMATION, &names, wish, file).map(|_| ()),
        _ => Ok(()),
    }
}

/// Refuses a name that several have; numbers begin with `first`.
pub(super) fn check_name(
    kind: &Kind,
    names: &[Option<&str>],
    (wish, first): (&str, usize),
    file: &Path,
) -> Result<(), Diagnostic> {
    let called = (first..).zip(names).filter(|(_, name)| **name == Some(wish));
    let called: Vec<String> = called.map(|(i, _)| i.to_string()).collect();
    if called.len() < 2 {
        return Ok(());
    }
    let text = format!("{} {}s are called '{wish}'", called.len(), kind.word);
    let remedy = format!("name one by its number: {}", called.join(", "));
    Err(Diagnostic::new(kind.ambiguous, file, kind.list, text).remedy(remedy))
}

/// The number of what is called `wish`, or has that number; otherwise a message that lists what there is.
pub(super) fn choose(kind: &Kind, names: &[Option<&str>], wish: &str, file: &Path) -> Result<usize, Diagnostic> {
    check_name(kind, names, (wish, 0), file)?;
    find(names, wish, 0).ok_or_else(|| {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shares_a_name_is_told_by_numbers_that_count_the_models_before() {
        let check = |wish: &str| {
            check_name(&ANIMATION, &[Some("Run"), Some("Stay"), Some("Run")], (wish, 3), Path::new("b.glb"))
        };
        let error = check("Run").unwrap_err().to_string();
        assert_eq!(error, "b.glb:animations: 2 animations are called 'Run'; name one by its number: 3, 5");
        assert!(check("Stay").is_ok() && check("Fly").is_ok());
    }
}
