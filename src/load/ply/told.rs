//! Warnings about contents of a PLY file that are not drawn.

use super::header::{Element, Header};
use super::meaning::{Meanings, WantedProperties, are_colored, are_splats, list_of};
use crate::load::Diagnostic;
use crate::load::paths::shorten;
use std::path::Path;

/// Warnings about contents that would change the look and are not read.
pub(super) fn passed_over(header: &Header, file: &Path) -> Vec<Diagnostic> {
    let warning = |code, text: String, remedy: &str| Diagnostic::new(code, file, "", text).remedy(remedy);
    let mut told = Vec::new();
    let wanted = WantedProperties::of(header);
    for (name, code) in [("face", "ply-face-colors"), ("edge", "ply-edge-colors")] {
        let mut some = header.elements.iter().filter(|element| element.name == name && element.count > 0);
        if !wanted.colors && some.any(are_colored) {
            let text = format!("colours of {name}s are not drawn: the vertices have some, too");
            told.push(warning(code, text, "keep one of both"));
        }
    }
    let has_places = |element: &Element| element.properties.iter().any(|p| p.name == "texcoord" && p.length.is_some());
    let mut faces = header.elements.iter().filter(|element| element.name == "face" && element.count > 0);
    if !wanted.pictures && faces.any(has_places) {
        let text = "texture coordinates of faces (texcoord) say nothing: no picture is named (comment TextureFile)";
        told.push(warning("ply-no-picture", text.into(), "name it, or export it as glTF"));
    }
    if header.elements.iter().any(|element| element.name == "vertex" && are_splats(element)) {
        let text = "Gaussian splats are drawn as points of their colours, opaque and of one size".into();
        told.push(warning("ply-splats", text, "--line-width sets the size"));
    }
    let is_read = |element: &Element| match element.name.as_str() {
        "face" | "tristrips" => list_of(element).is_some(),
        name => name == "vertex",
    };
    for element in header.elements.iter().filter(|element| element.count > 0 && !is_read(element)) {
        // Lists of vertex indices under other names.
        let mut lists = element.properties.iter().filter(|property| property.length.is_some());
        let Some(list) = lists.find(|list| list.kind.is_whole()) else { continue };
        let (name, list) = (shorten(&element.name), shorten(&list.name));
        let text = format!("element `{name}` ({}) with a list `{list}` is not read", element.count);
        let remedy = "faces are those of an element `face` with a list `vertex_indices`";
        told.push(warning("ply-unread-element", text, remedy));
    }
    let vertices = header.elements.iter().find(|element| element.name == "vertex" && element.count > 0);
    for [first, again] in vertices.map(|element| Meanings::of(element).twice).unwrap_or_default() {
        let text = match first == again {
            true => format!("'{again}' of a vertex is there twice, and the second is not read"),
            false => format!("'{again}' of a vertex says what '{first}' has said, and is not read"),
        };
        told.push(warning("ply-property-twice", text, "keep one of them"));
    }
    told
}
