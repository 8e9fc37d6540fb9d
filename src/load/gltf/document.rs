//! JSON text -> typed document of the `gltf` crate, after the schema check.
//!
//! The crate's own validation is not used: it refuses legal files and panics on some broken ones. Its structs are plain data;
//! this loader avoids every access that could panic (`Checked::unwrap`, indexing).

use super::animation::{self, Animation, Originals};
use super::codes::Code;
use super::morphs::Morphs;
use super::report::Report;
use super::schema;
use super::tree::{Map, Value};
use super::weight::{DEEPEST, Weight};
use crate::load::diagnostic::CUT_OFF;
use gltf::json::{Camera, Root};
use serde::Deserialize;
use serde_json::Number;
use std::borrow::Cow;

/// A document whose types and indices are valid.
pub(super) struct Document {
    pub(super) root: Root,
    /// Bytes charged to the memory budget for the document.
    pub(super) bytes: u64,
    pub(super) animations: Vec<Animation>,
    /// Entries that animation pointers change, as JSON.
    pub(super) originals: Originals,
    pub(super) morphs: Morphs,
}

/// Refuses JSON that is nested deeper than the parser supports.
pub(super) fn check_depth(weight: &Weight, report: &mut Report) {
    if weight.depth > DEEPEST {
        let text = format!("the JSON cannot be read: it is nested {} deep where {DEEPEST} are allowed", weight.depth);
        report.refuse_with(Code::InvalidJson, "", text, "export it with less in each other");
    }
}

/// Decodes JSON text. Some exporters write names in the encoding of their system: invalid UTF-8 is replaced.
pub(super) fn text<'a>(json: &'a [u8], report: &mut Report) -> Cow<'a, str> {
    if let Err(e) = std::str::from_utf8(json) {
        let text = format!("the JSON is not UTF-8 at byte {}", e.valid_up_to());
        report.warn_with(Code::InvalidJson, "", text, "what cannot be read is replaced");
    }
    String::from_utf8_lossy(json)
}

/// Parses JSON; `None` when that is impossible, with the reason in `report`.
pub(super) fn parse<'a>(text: &'a str, report: &mut Report) -> Option<Value<'a>> {
    // GLB pads its JSON with spaces; some exporters use zeros.
    match serde_json::from_str(text.trim_end_matches('\0')) {
        Ok(value) => Some(value),
        Err(e) => {
            let (place, why) = (format!("{}:{}", e.line(), e.column()), e.to_string());
            let why = why.rsplit_once(" at line ").map_or(why.as_str(), |(why, _)| why);
            let remedy = if e.is_eof() { CUT_OFF } else { Code::InvalidJson.remedy() };
            report.refuse_with(Code::InvalidJson, place, format!("the JSON cannot be read: {why}"), remedy);
            None
        }
    }
}

/// Converts checked JSON to the typed document, for which `bytes` were charged; images and cameras that broke the schema become
/// empty ones.
pub(super) fn typed(mut value: Value, bytes: u64, report: &mut Report) -> Option<Document> {
    let animations = animation::all(&value);
    simplify(&mut value);
    let map = value.as_object_mut()?;
    map.remove("animations");
    change_each(map, "scenes", |scene| scene.insert_missing("nodes", || Value::Array(Vec::new())));
    change_each(map, "meshes", |mesh| change_each(mesh, "primitives", known_attributes));
    if let Some(lights) = map.get_mut("extensions").and_then(|e| e.get_mut("KHR_lights_punctual")) {
        lights
            .as_object_mut()
            .into_iter()
            .for_each(|lights| change_each(lights, "lights", |light| light.remove("extensions")));
    }
    let views = map.get("bufferViews").and_then(Value::as_array).map_or(0, Vec::len);
    let images = map.get_mut("images").and_then(Value::as_array_mut).into_iter().flatten();
    images.filter(|image| !is_image(image, views)).for_each(|image| *image = Value::Object(Map::default()));
    change_each(map, "cameras", planes);
    let cameras = map.get_mut("cameras").and_then(Value::as_array_mut).into_iter().flatten();
    let is_camera = |camera: &Value| Camera::deserialize(camera.clone()).is_ok();
    cameras.filter(|camera| !is_camera(camera)).for_each(|camera| *camera = blank("perspective"));
    let (originals, morphs) = (Originals::of(&value, &animations), Morphs::of(&value));
    match Root::deserialize(value) {
        Ok(root) => Some(Document { root, bytes, animations, originals, morphs }),
        Err(e) => {
            report.refuse(Code::TypeMismatch, "", format!("the JSON is not glTF 2.0: {e}"));
            None
        }
    }
}

/// An object with only its type.
fn blank(kind: &'static str) -> Value<'static> {
    Value::Object([("type", Value::String(kind.into()))].into_iter().collect())
}

/// Returns whether an image entry has the right types and refers to an existing view.
fn is_image(value: &Value, views: usize) -> bool {
    let text = |name| value.get(name).is_none_or(|text| text.as_str().is_some());
    let view = |v: &Value| schema::whole(v).is_some_and(|index| index < views as u64);
    value.is_object() && text("uri") && text("mimeType") && text("name") && value.get("bufferView").is_none_or(view)
}

/// Inserts missing clipping planes, which the typed camera requires and ray tracing ignores; they are reported elsewhere.
fn planes(camera: &mut Map) {
    let mut need = |lens: &str, planes: &[(&'static str, f32)]| {
        if let Some(lens) = camera.get_mut(lens).and_then(Value::as_object_mut) {
            for &(plane, at) in planes {
                lens.insert_missing(plane, || f64::from(at).into());
            }
        }
    };
    need("perspective", &[("znear", f32::MIN_POSITIVE)]);
    need("orthographic", &[("znear", 0.0), ("zfar", f32::MAX)]);
}

/// Applies `change` to each object in a list.
fn change_each<'a>(map: &mut Map<'a>, list: &str, change: impl FnMut(&mut Map<'a>)) {
    let elements = map.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten();
    elements.filter_map(Value::as_object_mut).for_each(change);
}

/// Removes `extras`, which the typed structs cannot hold inside extensions, and turns integral floats such as `1.0` into
/// integers.
fn simplify(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.remove("extras");
            map.iter_mut().for_each(|(_, value)| simplify(value));
        }
        Value::Array(list) => list.iter_mut().for_each(simplify),
        Value::Number(number) if number.is_f64() => {
            if let Some(whole) = schema::whole(value) {
                *value = Value::Number(Number::from(whole));
            }
        }
        _ => {}
    }
}

/// Removes attributes with unknown names; `TEXCOORD_01` would be read as `TEXCOORD_1`.
fn known_attributes(primitive: &mut Map) {
    let clean = |attributes: &mut Map| attributes.retain(|name, _| is_semantic(name));
    primitive.get_mut("attributes").and_then(Value::as_object_mut).into_iter().for_each(clean);
    let targets = primitive.get_mut("targets").and_then(Value::as_array_mut).into_iter().flatten();
    targets.filter_map(Value::as_object_mut).for_each(clean);
}

/// Returns whether glTF defines an attribute of this name.
pub(super) fn is_semantic(name: &str) -> bool {
    let set = |rest: &str| rest == "0" || (!rest.starts_with('0') && rest.parse::<u16>().is_ok());
    let sets = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];
    ["POSITION", "NORMAL", "TANGENT"].contains(&name)
        || sets.iter().any(|prefix| name.strip_prefix(prefix).is_some_and(set))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn whole_numbers_may_be_written_as_floats_and_extras_anywhere() {
        let json = r#"{"asset": {"version": "2.0"}, "scene": 0.0, "scenes": [{"nodes": [1e0]}], "nodes": [{}, {"extras": 3}],
            "materials": [{"extensions": {"KHR_materials_ior": {"ior": 2, "extras": {"a": 1}}}}]}"#;
        let mut report = Report::new(Path::new("a.gltf"));
        let value = parse(json, &mut report).unwrap();
        schema::check(&value, &mut report);
        let document = typed(value, 0, &mut report).unwrap();
        report.check().unwrap();
        assert_eq!(document.root.scenes[0].nodes[0].value(), 1);
    }

    #[test]
    fn only_defined_attribute_names_are_kept() {
        for good in ["POSITION", "TEXCOORD_0", "TEXCOORD_12", "JOINTS_1"] {
            assert!(is_semantic(good), "{good}");
        }
        for bad in ["position", "TEXCOORD", "TEXCOORD_", "TEXCOORD_00", "TEXCOORD_01", "TEXCOORD_-1", "_CUSTOM"] {
            assert!(!is_semantic(bad), "{bad}");
        }
    }
}
