//! One of several named things in a file, chosen by name or number.

use crate::load::Diagnostic;
use std::path::Path;

/// Names in one message before the rest is only counted.
const LISTED: usize = 20;

/// The position of what is asked for in `names`: a name counts first, then a number from 0.
///
/// # Errors
/// One line that names what there is to choose from: `kind` is the word for it, `place` the list in the file.
pub(super) fn choose(
    (kind, code, place): (&str, &'static str, &str),
    names: &[String],
    wish: &str,
    file: &Path,
) -> Result<usize, Diagnostic> {
    let by_name = names.iter().position(|name| name == wish && !name.is_empty());
    let by_number = wish.parse().ok().filter(|&i: &usize| i < names.len());
    by_name.or(by_number).ok_or_else(|| {
        let shown = |(i, name): (usize, &String)| if name.is_empty() { i.to_string() } else { format!("{i} '{name}'") };
        let list: Vec<String> = names.iter().enumerate().take(LISTED).map(shown).collect();
        let remedy = match names.len().saturating_sub(LISTED) {
            _ if list.is_empty() => "the file has none".into(),
            0 => format!("it has {}", list.join(", ")),
            more => format!("it has {} and {more} more", list.join(", ")),
        };
        Diagnostic::new(code, file, place, format!("there is no {kind} '{wish}'")).remedy(remedy)
    })
}
