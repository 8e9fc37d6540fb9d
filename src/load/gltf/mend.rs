//! Removal of invalid parts from the JSON that a picture can do without.
//!
//! First, what programs write for "not given", `null` and an index of −1, is removed. Then the schema is checked: invalid
//! properties of materials, textures, samplers and lights are removed, together with what depends on them (a reference to a
//! texture without its index), and so are invalid names. Of what determines the shape of a model, only the length of a buffer is
//! mended, if its bytes exist.

use super::codes::Code;
use super::report::Report;
use super::schema;
use super::tree::{Map, Value};

/// Optional properties that are indices.
const INDICES: [&str; 13] = [
    "bufferView",
    "camera",
    "index",
    "indices",
    "light",
    "material",
    "mesh",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
    "texCoord",
];

/// Removes values that mean "not given".
pub(super) fn take_out_blanks(root: &mut Value, report: &mut Report) {
    let nodes = root.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten();
    let blank_nodes: u64 = nodes.filter(|node| **node == Value::Null).map(|node| (*node = nothing(), 1).1).sum();
    let blanks = blanks_in(root) + blank_nodes;
    if blanks > 0 {
        let text = "null, or -1 as an index, counts as not given";
        let count = if blanks > 1 { format!(" ({blanks} times)") } else { String::new() };
        report.note("gltf-blank", "", format!("{text}{count}"), "");
    }
}

/// Removes blanks from what the format defines, and counts them; `extras` and unknown extensions, which may contain anything,
/// are skipped.
fn blanks_in(value: &mut Value) -> u64 {
    match value {
        Value::Object(map) => {
            let is_blank = |name: &str, value: &Value| {
                name != "extras" && (*value == Value::Null || is_none(value) && INDICES.contains(&name))
            };
            let blanks = map.iter().filter(|(name, value)| is_blank(name, value)).count() as u64;
            if blanks > 0 {
                map.retain(|name, value| !is_blank(name, value));
            }
            let defined = map.iter_mut().filter(|(name, _)| *name != "extras");
            let inside = defined.map(|(name, value)| match value {
                Value::Object(extensions) if name == "extensions" => {
                    let known = extensions.iter_mut().filter(|(name, _)| schema::is_known_extension(name));
                    known.map(|(_, extension)| blanks_in(extension)).sum()
                }
                value => blanks_in(value),
            });
            blanks + inside.sum::<u64>()
        }
        Value::Array(list) => list.iter_mut().map(blanks_in).sum(),
        _ => 0,
    }
}

/// Returns whether a value is −1.
fn is_none(value: &Value) -> bool {
    value.as_f64() == Some(-1.0)
}

/// Extends the declared length of a GLB's first buffer to its chunk, where it is shorter than its views need.
pub(super) fn lengthen_buffer(root: &mut Value, chunk: Option<&[u8]>, report: &mut Report) {
    let whole = |value: &Value, name: &str| value.get(name).and_then(schema::whole);
    let views = schema::list(root, "bufferViews").iter().filter(|view| whole(view, "buffer") == Some(0));
    let end =
        |view: &Value| whole(view, "byteOffset").unwrap_or(0).saturating_add(whole(view, "byteLength").unwrap_or(0));
    let needed = views.map(end).max().unwrap_or(0);
    let (Some(chunk), Some(buffer)) = (chunk, first_buffer(root)) else {
        return;
    };
    let said = buffer.get("byteLength").map_or(Some(0), schema::whole);
    let is_short = said.is_some_and(|said| said < needed) && needed <= chunk.len() as u64;
    if is_short && !buffer.contains_key("uri") {
        let text = format!("{} bytes are declared, its views need {needed}", said.unwrap_or(0));
        let remedy = "what the file has is read";
        report.warn_with(Code::BufferByteLengthMismatch, "buffers[0]", text, remedy);
        buffer.insert("byteLength", (chunk.len() as u64).into());
    }
}

fn first_buffer<'r, 'a>(root: &'r mut Value<'a>) -> Option<&'r mut Map<'a>> {
    root.get_mut("buffers")?.element_mut(0)?.as_object_mut()
}

/// An empty object.
fn nothing() -> Value<'static> {
    Value::Object(Map::default())
}

/// Checks the schema, and removes invalid values from parts that can be left out.
pub(super) fn check(root: &mut Value, report: &mut Report) {
    /// Most rounds of removal: a property, what depends on it, and what depends on that.
    const ROUNDS: usize = 4;
    report.leave_out(true);
    schema::check(root, report);
    report.leave_out(false);
    let mut places = report.take_left_out();
    for _ in 0..ROUNDS {
        if places.is_empty() || report.refuses() {
            return;
        }
        places.iter().for_each(|place| take_out(root, place));
        // Only faults caused by the removal are new.
        let mut again = Report::new(report.file());
        again.leave_out(true);
        schema::check(root, &mut again);
        places = again.take_left_out();
        report.take_faults(again);
    }
    // What is still invalid cannot be mended and is refused.
    if !places.is_empty() {
        schema::check(root, report);
    }
}

/// Removes the value at a JSON path. An element of a list at the root becomes an empty object; an element of another list takes
/// the whole list with it.
fn take_out(root: &mut Value, place: &str) {
    let Some((parent, last)) = place.rsplit_once('.') else {
        // An element of a list at the root.
        let element = step(root, place).into_iter();
        return element.for_each(|element| *element = nothing());
    };
    let parent = parent.split('.').try_fold(root, step);
    let (name, is_element) = last.split_once('[').map_or((last, false), |(name, _)| (name, true));
    let Some(map) = parent.and_then(Value::as_object_mut) else { return };
    match step_in(map, last) {
        // Except a light, which becomes a dark one.
        Some(light) if is_element && name == "lights" => *light = dark_light(),
        _ => map.remove(name),
    }
}

/// A light without intensity, with the type that is required.
fn dark_light() -> Value<'static> {
    let members = [("type", Value::String("point".into())), ("intensity", 0.into())];
    Value::Object(members.into_iter().collect())
}

/// Follows a step of a path, `name` or `name[3]`.
fn step<'r, 'a>(value: &'r mut Value<'a>, step: &str) -> Option<&'r mut Value<'a>> {
    step_in(value.as_object_mut()?, step)
}

fn step_in<'r, 'a>(map: &'r mut Map<'a>, step: &str) -> Option<&'r mut Value<'a>> {
    let (name, rest) = step.split_once('[').unwrap_or((step, ""));
    let indices = rest.split(['[', ']']).filter(|index| !index.is_empty());
    indices.map(str::parse::<usize>).try_fold(map.get_mut(name)?, |value, index| value.element_mut(index.ok()?))
}
