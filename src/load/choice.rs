//! Choices of the user by name or index: a scene, a variant of materials, an animation, a camera.

use super::suggest::nearest;
use super::{Diagnostic, Facts, Moment};
use std::path::Path;

/// A list of the file that an item is chosen from; an empty name means that the item has none.
pub(crate) struct Kind {
    /// Word for an item of the list.
    pub(crate) word: &'static str,
    /// JSON path of the list in a glTF file.
    pub(crate) list: &'static str,
    /// Diagnostic code where no item matches.
    pub(crate) code: &'static str,
    /// Diagnostic code where several items have the name.
    pub(crate) ambiguous: &'static str,
    /// Remedy where the list is empty.
    pub(crate) empty: &'static str,
}

/// Scenes.
pub(super) const SCENE: Kind = Kind {
    word: "scene",
    list: "scenes",
    code: "gltf-no-such-scene",
    ambiguous: "gltf-which-scene",
    empty: "the file has none",
};
/// Variants of materials.
pub(super) const VARIANT: Kind = Kind {
    word: "variant",
    list: "extensions.KHR_materials_variants.variants",
    code: "gltf-no-such-variant",
    ambiguous: "gltf-which-variant",
    empty: "the file has none",
};
/// Animations.
pub(super) const ANIMATION: Kind = Kind {
    word: "animation",
    list: "animations",
    code: "gltf-no-such-animation",
    ambiguous: "gltf-which-animation",
    empty: "the file has none",
};
/// Largest number of names in one message; the others are only counted.
const LISTED: usize = 20;

/// Index of the item named `wish`, or else of that number, where numbers begin with `first`.
pub(super) fn find(names: &[&str], wish: &str, first: usize) -> Option<usize> {
    let by_number = || wish.parse::<usize>().ok()?.checked_sub(first).filter(|&i| i < names.len());
    names.iter().position(|name| is_called(name, wish)).or_else(by_number)
}

fn is_called(name: &str, wish: &str) -> bool {
    name == wish && !name.is_empty()
}

/// Refuses a chosen animation that none of several models has; `facts` holds the animations of all of them.
pub(super) fn check_animation(facts: &Facts, moment: &Moment, file: &Path) -> Result<(), Diagnostic> {
    let names: Vec<&str> = facts.animations.iter().map(|animation| animation.name.as_str()).collect();
    match &moment.animation {
        Some(wish) if facts.shown.is_none() => choose(&ANIMATION, &names, wish, file).map(|_| ()),
        _ => Ok(()),
    }
}

/// Refuses a name that several items have; numbers begin with `first`.
pub(super) fn check_name(kind: &Kind, names: &[&str], wish: &str, first: usize, file: &Path) -> Result<(), Diagnostic> {
    let called = (first..).zip(names).filter(|(_, name)| is_called(name, wish));
    let called: Vec<String> = called.map(|(i, _)| i.to_string()).collect();
    if called.len() < 2 {
        return Ok(());
    }
    let text = format!("{} {}s are called '{wish}'", called.len(), kind.word);
    let remedy = format!("name one by its number: {}", called.join(", "));
    Err(Diagnostic::new(kind.ambiguous, file, kind.list, text).remedy(remedy))
}

/// Index of the item named `wish`, or else of that number.
///
/// # Errors
/// When there is no such item, with a list of those there are; when several have the name.
pub(crate) fn choose(kind: &Kind, names: &[&str], wish: &str, file: &Path) -> Result<usize, Diagnostic> {
    check_name(kind, names, wish, 0, file)?;
    find(names, wish, 0).ok_or_else(|| {
        let text = format!("there is no {} '{wish}'", kind.word);
        Diagnostic::new(kind.code, file, kind.list, text).remedy(instead(kind, names, wish))
    })
}

/// Remedy that lists the items there are, the most similar name first.
fn instead(kind: &Kind, names: &[&str], wish: &str) -> String {
    if names.is_empty() {
        return kind.empty.into();
    }
    let shown =
        |(i, name): (usize, &&str)| if name.is_empty() { format!("number {i}") } else { format!("{i} '{name}'") };
    let list: Vec<String> = names.iter().enumerate().take(LISTED).map(shown).collect();
    let near = nearest(wish, names.iter().copied().filter(|name| !name.is_empty()));
    let near = near.map_or(String::new(), |near| format!("did you mean '{near}'? "));
    let more = match names.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("{near}it has {}{more}", list.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shares_a_name_is_told_by_numbers_that_count_the_models_before() {
        let check = |wish: &str| check_name(&ANIMATION, &["Run", "Stay", "Run"], wish, 3, Path::new("b.glb"));
        let error = check("Run").unwrap_err().to_string();
        assert_eq!(error, "b.glb:animations: 2 animations are called 'Run'; name one by its number: 3, 5");
        assert!(check("Stay").is_ok() && check("Fly").is_ok());
    }

    #[test]
    fn what_has_no_name_is_listed_by_its_number() {
        let error = choose(&ANIMATION, &["", "Run"], "5", Path::new("b.glb")).unwrap_err().to_string();
        assert_eq!(error, "b.glb:animations: there is no animation '5'; it has number 0, 1 'Run'");
    }
}
