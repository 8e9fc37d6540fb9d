//! Checks the JSON against the glTF 2.0 schema: types, required properties, ranges, lists, and every index.
//!
//! The rules are data ([`super::schema_tables`]), and the check walks rules and JSON in parallel. JSON that passes can be
//! converted to typed structs, and all its indices are in range. Consistency between properties is not checked here.

use super::codes::Code;
use super::report::Report;
use super::schema_tables::{EXTENSION_WORDS, EXTENSIONS, ROOT};
use super::tree::{Tree, Value};
use crate::load::paths::shorten;
use std::collections::HashSet;
use std::fmt::Write as _;

/// Rules for one type of JSON object.
pub(super) struct Object {
    pub(super) name: &'static str,
    pub(super) properties: &'static [Property],
}

/// Rule for one property of an object.
pub(super) struct Property {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    pub(super) required: bool,
}

/// Finite numbers from `min` to `max`; `open` excludes the lower end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) open: bool,
}

impl Range {
    pub(super) fn holds(self, number: f64) -> bool {
        (if self.open { number > self.min } else { number >= self.min }) && number <= self.max && number.is_finite()
    }

    /// Nearest number in the range; above an excluded lower end, by the smallest normal `f32`.
    pub(super) fn nearest(self, number: f64) -> f64 {
        let least = if self.open { self.min + f64::from(f32::MIN_POSITIVE) } else { self.min };
        number.max(least).min(self.max)
    }
}

/// The allowed numbers, in words.
impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { min, max, open } = self;
        match (min.is_finite(), max.is_finite()) {
            (_, false) if *open => write!(f, "above {min}"),
            (_, false) => write!(f, "at least {min}"),
            (false, _) => write!(f, "at most {max}"),
            _ => write!(f, "{min} to {max}"),
        }
    }
}

/// Allowed values of a property.
pub(super) enum Kind {
    Any,
    Bool,
    Text,
    Number(Range),
    /// An integer in a closed range.
    Integer {
        min: u64,
        max: u64,
    },
    /// An index into a list of the root (`"KHR_lights_punctual"`: into its list of lights).
    Index(&'static str),
    /// An index into a nearby list, which is checked separately.
    AnyIndex,
    OneOf(&'static [u64]),
    Word(&'static [&'static str]),
    List {
        of: &'static Kind,
        min: usize,
        max: usize,
        unique: bool,
    },
    Object(&'static Object),
    /// An object with arbitrary property names.
    Map(&'static Kind),
}

/// Rules for an extension: the objects that may carry it, and its properties.
pub(super) struct Extension {
    pub(super) name: &'static str,
    /// Names of [`Object`]s that may carry it.
    pub(super) on: &'static [&'static str],
    pub(super) object: &'static Object,
}

/// Elements of the list of this name; empty if there is none.
pub(super) fn list<'a>(value: &'a Value<'a>, name: &str) -> &'a [Value<'a>] {
    value.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// Returns whether there are rules for an extension.
pub(super) fn is_known_extension(name: &str) -> bool {
    EXTENSIONS.iter().any(|extension| extension.name == name)
}

/// Checks the whole document.
pub(super) fn check(root: &Value, report: &mut Report) {
    let used = strings(root.get("extensionsUsed"));
    let mut walk = Walk { root, used, path: String::new(), report };
    walk.object(root, &ROOT);
    channels(root, report);
}

/// Checks that animation channels refer to existing samplers of their animation.
fn channels(root: &Value, report: &mut Report) {
    for (i, animation) in list(root, "animations").iter().enumerate() {
        let samplers = list(animation, "samplers").len() as u64;
        for (k, channel) in list(animation, "channels").iter().enumerate() {
            if let Some(sampler) = channel.get("sampler").and_then(whole).filter(|&s| s >= samplers) {
                let text = format!("index {sampler}, but {} there", counted(samplers, "samplers"));
                report.add(Code::UnresolvedReference, format!("animations[{i}].channels[{k}].sampler"), text);
            }
        }
    }
}

fn strings<'a>(list: Option<&'a Value<'a>>) -> HashSet<&'a str> {
    list.and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect()
}

struct Walk<'a> {
    root: &'a Value<'a>,
    used: HashSet<&'a str>,
    /// JSON path of the current value.
    path: String,
    report: &'a mut Report,
}

impl<'a> Walk<'a> {
    fn fault(&mut self, code: Code, text: impl Into<String>) {
        self.report.add(code, self.path.as_str(), text);
    }

    /// Visits a value one property or element deeper.
    fn at(&mut self, step: impl std::fmt::Display, visit: impl FnOnce(&mut Self)) {
        let length = self.path.len();
        // Writing to a string cannot fail.
        let _ = write!(self.path, "{step}");
        visit(self);
        self.path.truncate(length);
    }

    fn member(&mut self, name: &str, visit: impl FnOnce(&mut Self)) {
        let dot = if self.path.is_empty() { "" } else { "." };
        self.at(format_args!("{dot}{}", shorten(name)), visit);
    }

    fn object(&mut self, value: &'a Value<'a>, rules: &'static Object) {
        let Some(map) = value.as_object() else { return self.wrong_type(value, "an object") };
        for property in rules.properties {
            match map.get(property.name) {
                Some(value) => self.member(property.name, |walk| walk.value(value, &property.kind)),
                None if property.required => {
                    self.fault(Code::UndefinedProperty, format!("'{}' is missing", property.name));
                }
                None => {}
            }
        }
        if let Some(extensions) = map.get("extensions") {
            self.member("extensions", |walk| walk.extensions(extensions, rules.name));
        }
    }

    fn extensions(&mut self, value: &'a Value<'a>, on: &str) {
        let Some(map) = value.as_object() else { return self.wrong_type(value, "an object") };
        for (name, value) in map.iter() {
            self.member(name, |walk| walk.extension(name, value, on));
        }
    }

    fn extension(&mut self, name: &str, value: &'a Value<'a>, on: &str) {
        if !value.is_object() {
            return self.wrong_type(value, "an object");
        }
        if !self.used.contains(name) {
            self.fault(Code::UndeclaredExtension, format!("'{}' is not in extensionsUsed", shorten(name)));
        }
        let mut known = EXTENSIONS.iter().filter(|e| e.name == name).peekable();
        if known.peek().is_none() {
            return;
        }
        match known.find(|e| e.on.contains(&on)) {
            Some(extension) => self.object(value, extension.object),
            None => self.fault(Code::UnexpectedExtensionObject, format!("{name} has no meaning on {on}")),
        }
    }

    fn value(&mut self, value: &'a Value<'a>, kind: &'static Kind) {
        match kind {
            Kind::Any => {}
            Kind::Bool => self.expect(value.as_bool().is_some(), value, "true or false"),
            Kind::Text => self.expect(value.as_str().is_some(), value, "a text"),
            Kind::Number(range) => self.number(value, *range),
            Kind::Integer { min, max } => self.integer(value, *min, *max),
            Kind::Index(list) => self.index(value, list),
            Kind::AnyIndex => self.expect(whole(value).is_some(), value, "an index"),
            Kind::OneOf(allowed) => self.one_of(value, allowed),
            Kind::Word(allowed) => self.word(value, allowed),
            Kind::List { of, min, max, unique } => self.list(value, of, *min..=*max, *unique),
            Kind::Object(rules) => self.object(value, rules),
            Kind::Map(kind) => self.map(value, kind),
        }
    }

    fn expect(&mut self, right: bool, value: &Value, what: &str) {
        if !right {
            self.wrong_type(value, what);
        }
    }

    fn wrong_type(&mut self, value: &Value, what: &str) {
        self.fault(Code::TypeMismatch, format!("{} where {what} should be", shorten_value(value)));
    }

    fn number(&mut self, value: &Value, range: Range) {
        let Some(number) = value.as_f64() else { return self.wrong_type(value, "a number") };
        if !range.holds(number) {
            let text = format!("{number} where {range} is allowed");
            if self.path.contains(".rotation[") {
                self.report.warn_with(Code::ValueNotInRange, self.path.as_str(), text, "the rotation is made unit");
            } else {
                self.fault(Code::ValueNotInRange, text);
            }
        }
    }

    fn integer(&mut self, value: &Value, min: u64, max: u64) {
        match (whole(value), value.as_f64()) {
            (Some(number), _) if (min..=max).contains(&number) => {}
            (Some(number), _) => {
                let bounds = if max == u64::MAX { format!("at least {min}") } else { format!("{min} to {max}") };
                self.fault(Code::ValueNotInRange, format!("{number} where {bounds} is allowed"));
            }
            // No allowed value is near a negative size.
            (None, Some(number)) if number < 0.0 && number.fract() == 0.0 => {
                self.report.refuse(Code::ValueNotInRange, self.path.as_str(), format!("{number} is negative"));
            }
            (None, _) => self.wrong_type(value, "a whole number"),
        }
    }

    fn index(&mut self, value: &Value, list: &str) {
        let Some(index) = whole(value) else {
            return self.fault(Code::InvalidIndex, format!("{} where an index should be", shorten_value(value)));
        };
        let target = match list {
            "KHR_lights_punctual" => self.root.pointer("/extensions/KHR_lights_punctual/lights"),
            "KHR_materials_variants" => self.root.pointer("/extensions/KHR_materials_variants/variants"),
            list => self.root.get(list),
        };
        let count = target.and_then(Value::as_array).map_or(0, Vec::len) as u64;
        if index >= count {
            self.fault(Code::UnresolvedReference, format!("index {index}, but {} there", counted(count, list)));
        }
    }

    fn one_of(&mut self, value: &Value, allowed: &[u64]) {
        match whole(value) {
            None => self.wrong_type(value, "a whole number"),
            Some(number) if allowed.contains(&number) => {}
            Some(number) => self.fault(Code::ValueNotInList, format!("{number} where one of {allowed:?} should be")),
        }
    }

    fn word(&mut self, value: &Value, allowed: &[&str]) {
        match value.as_str() {
            None => self.wrong_type(value, "a text"),
            Some(word) if allowed.contains(&word) => {}
            Some(word) if EXTENSION_WORDS.iter().any(|(w, e)| *w == word && self.used.contains(e)) => {}
            Some(word) => {
                self.fault(
                    Code::ValueNotInList,
                    format!("'{}' where one of {} should be", shorten(word), allowed.join(", ")),
                );
            }
        }
    }

    fn list(&mut self, value: &'a Value<'a>, of: &'static Kind, length: std::ops::RangeInclusive<usize>, unique: bool) {
        let Some(list) = value.as_array() else { return self.wrong_type(value, "a list") };
        if list.is_empty() && *length.start() > 0 {
            return self.fault(Code::EmptyEntity, "an empty list");
        }
        if !length.contains(&list.len()) {
            let (least, most) = (length.start(), length.end());
            let right =
                if least == most { format!("{least} should be") } else { format!("{least} to {most} are allowed") };
            let text = format!("{} elements where {right}", list.len());
            self.fault(Code::ArrayLengthNotInList, text);
        }
        let mut seen = HashSet::new();
        for (i, element) in list.iter().enumerate() {
            self.at(format_args!("[{i}]"), |walk| {
                walk.value(element, of);
                if unique && !seen.insert(key(element)) {
                    walk.fault(Code::DuplicateElements, format!("{} again", shorten_value(element)));
                }
            });
        }
    }

    fn map(&mut self, value: &'a Value<'a>, kind: &'static Kind) {
        let Some(map) = value.as_object() else { return self.wrong_type(value, "an object") };
        if map.is_empty() {
            self.fault(Code::EmptyEntity, "an empty object");
        }
        for (name, value) in map.iter() {
            self.member(name, |walk| walk.value(value, kind));
        }
    }
}

/// `only 1 mesh is`, `only 3 buffers are`: the number of elements in a list, for messages.
fn counted(count: u64, list: &str) -> String {
    let things = match list {
        "KHR_lights_punctual" => "lights",
        "KHR_materials_variants" => "variants",
        list => list,
    };
    let one = if things == "meshes" { "mesh" } else { things.strip_suffix('s').unwrap_or(things) };
    if count == 1 { format!("only 1 {one} is") } else { format!("only {count} {things} are") }
}

/// Key by which two elements of a list are equal.
fn key(value: &Value) -> String {
    whole(value).map_or_else(|| value.to_string(), |n| n.to_string())
}

/// A non-negative integer, in any notation (`1`, `1.0`, `10e-1`).
pub(super) fn whole(value: &impl Tree) -> Option<u64> {
    /// Above 2⁵³ a double does not represent all integers.
    const LARGEST: f64 = 9_007_199_254_740_992.0;
    let exact = |f: f64| (f.fract() == 0.0 && (0.0..=LARGEST).contains(&f)).then_some(f as u64);
    value.as_u64().or_else(|| value.as_f64().and_then(exact))
}

/// An index into a list of the document.
pub(super) fn position(value: &impl Tree) -> Option<usize> {
    usize::try_from(whole(value)?).ok()
}

/// Shortens a value for a message.
fn shorten_value(value: &Value) -> String {
    match value {
        Value::Object(_) => "an object".into(),
        Value::Array(_) => "a list".into(),
        Value::String(text) => format!("'{}'", shorten(text)),
        other => other.to_string(),
    }
}
