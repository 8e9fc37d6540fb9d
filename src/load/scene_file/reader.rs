//! Tables of a scene file, read key by key: every fault is noted with its line and column, unknown keys with the
//! nearest known one, and reading goes on so that all faults are told at once.
//!
//! Knows TOML, not scenes.

use crate::load::suggest::{list, nearest};
use crate::load::{Diagnostic, LoadError};
use crate::math::{DVec3, Vec3};
use std::cell::RefCell;
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Bytes of the file.
pub(super) type Span = Range<usize>;

/// The file and what is wrong with it.
pub(super) struct Faults {
    file: PathBuf,
    text: String,
    list: RefCell<Vec<Diagnostic>>,
}

impl Faults {
    pub(super) fn new(file: PathBuf, text: String) -> Self {
        Self { file, text, list: RefCell::default() }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// `line:column` of a byte, both from 1, columns in characters.
    pub(super) fn place(&self, at: usize) -> String {
        let before = self.text.get(..at).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        format!("{}:{}", before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    pub(super) fn note(&self, code: &'static str, at: &Span, text: impl Into<String>, remedy: impl Into<String>) {
        let fault = Diagnostic::new(code, &self.file, self.place(at.start), text).remedy(remedy);
        self.list.borrow_mut().push(fault);
    }

    /// All faults, in the order of the file; or nothing, when there are none.
    pub(super) fn into_result(self) -> Result<(), LoadError> {
        let mut list = self.list.into_inner();
        let line = |d: &Diagnostic| d.place.split(':').map(|n| n.parse().unwrap_or(0)).collect::<Vec<u64>>();
        list.sort_by_key(line);
        if list.is_empty() { Ok(()) } else { Err(LoadError::Input(list)) }
    }
}

/// One table; [`Table::finish`] complains about the keys nobody asked for.
pub(super) struct Table<'a> {
    faults: &'a Faults,
    /// What it describes, for messages: `light`, `material`.
    what: &'static str,
    /// Where it begins.
    pub(super) span: Span,
    map: &'a DeTable<'a>,
    asked: RefCell<Vec<&'static str>>,
}

impl<'a> Table<'a> {
    pub(super) fn new(faults: &'a Faults, what: &'static str, span: Span, map: &'a DeTable<'a>) -> Self {
        Self { faults, what, span, map, asked: RefCell::default() }
    }

    fn find(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.asked.borrow_mut().push(key);
        self.map.iter().find(|(k, _)| k.get_ref() == key).map(|(_, value)| value)
    }

    /// Whether a key is there, whatever its value.
    pub(super) fn has(&self, key: &'static str) -> bool {
        self.find(key).is_some()
    }

    /// Where a key's value stands, or else the table.
    pub(super) fn place_of(&self, key: &'static str) -> Span {
        self.find(key).map_or(self.span.clone(), Spanned::span)
    }

    /// The value of a key; `None` when it is absent or wrong (the fault is noted).
    pub(super) fn get<T>(&self, key: &'static str, read: impl FnOnce(&DeValue<'a>) -> Result<T, String>) -> Option<T> {
        let value = self.find(key)?;
        match read(value.get_ref()) {
            Ok(value) => Some(value),
            Err(wrong) => {
                self.faults.note("scene-value", &value.span(), format!("`{key}` {wrong}"), "");
                None
            }
        }
    }

    /// As [`Table::get`], and the key must be there.
    pub(super) fn need<T>(&self, key: &'static str, read: impl FnOnce(&DeValue<'a>) -> Result<T, String>) -> Option<T> {
        if !self.has(key) {
            self.note(&self.span, format!("this {} has no `{key}`", self.what), "add it");
            return None;
        }
        self.get(key, read)
    }

    /// The tables of an array of tables.
    pub(super) fn tables(&self, key: &'static str, what: &'static str) -> Vec<Table<'a>> {
        let Some(value) = self.find(key) else { return Vec::new() };
        let items: Option<Vec<_>> = match value.get_ref() {
            DeValue::Array(items) => items.iter().map(|i| Some((i.span(), i.get_ref().as_table()?))).collect(),
            _ => None,
        };
        let Some(items) = items else {
            self.note(&value.span(), format!("`{key}` is a list of tables"), format!("begin each with [[{key}]]"));
            return Vec::new();
        };
        items.into_iter().map(|(span, map)| Table::new(self.faults, what, span, map)).collect()
    }

    /// A table under a key.
    pub(super) fn table(&self, key: &'static str, what: &'static str) -> Option<Table<'a>> {
        let value = self.find(key)?;
        let Some(map) = value.get_ref().as_table() else {
            self.note(&value.span(), format!("`{key}` is a table"), format!("begin it with [{key}]"));
            return None;
        };
        Some(Table::new(self.faults, what, value.span(), map))
    }

    /// All entries, each a table with a name of the user's: in the order of the file.
    pub(super) fn named(&self, what: &'static str) -> Vec<(String, Table<'a>)> {
        let mut entries: Vec<_> = self.map.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let mut tables = Vec::new();
        for (key, value) in entries {
            match value.get_ref().as_table() {
                Some(map) => tables.push((key.get_ref().to_string(), Table::new(self.faults, what, key.span(), map))),
                None => self.note(&key.span(), format!("`{}` is not a {what} table", key.get_ref()), ""),
            }
        }
        tables
    }

    /// Notes a fault that has to do with several keys.
    pub(super) fn note(&self, at: &Span, text: impl Into<String>, remedy: impl Into<String>) {
        self.faults.note("scene-value", at, text, remedy);
    }

    /// Notes every key that was never asked for.
    pub(super) fn finish(self) {
        let asked = self.asked.into_inner();
        for key in self.map.keys().filter(|key| !asked.contains(&key.get_ref().as_ref())) {
            let name = key.get_ref();
            let remedy = match nearest(name, asked.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => {
                    let mut known = asked.clone();
                    known.sort_unstable();
                    known.dedup();
                    format!("known here: {}", list(known))
                }
            };
            self.faults.note(
                "scene-unknown-key",
                &key.span(),
                format!("unknown key `{name}` in {}", self.what),
                remedy,
            );
        }
    }
}

fn expected<T>(what: &str, got: &DeValue) -> Result<T, String> {
    Err(format!("must be {what}, not {}", got.type_str()))
}

pub(super) fn number(value: &DeValue) -> Result<f64, String> {
    let parsed = match value {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
        DeValue::Float(f) => f.as_str().parse().ok(),
        _ => return expected("a number", value),
    };
    parsed.filter(|n: &f64| n.is_finite()).ok_or_else(|| "must be a finite number".into())
}

/// A number in `low..=high`.
pub(super) fn within(low: f64, high: f64) -> impl Fn(&DeValue) -> Result<f64, String> {
    move |value| {
        let n = number(value)?;
        if (low..=high).contains(&n) { Ok(n) } else { Err(format!("is {n}, but must be from {low} to {high}")) }
    }
}

/// As [`within`], rounded to `f32`.
#[expect(clippy::cast_possible_truncation, reason = "materials are f32")]
pub(super) fn within32(low: f32, high: f32) -> impl Fn(&DeValue) -> Result<f32, String> {
    move |value| within(f64::from(low), f64::from(high))(value).map(|n| n as f32)
}

/// A finite number above 0.
pub(super) fn positive(value: &DeValue) -> Result<f64, String> {
    let n = number(value)?;
    if n > 0.0 { Ok(n) } else { Err(format!("is {n}, but must be above 0")) }
}

/// A finite number, 0 or above.
pub(super) fn not_negative(value: &DeValue) -> Result<f64, String> {
    let n = number(value)?;
    if n >= 0.0 { Ok(n) } else { Err(format!("is {n}, but must not be below 0")) }
}

/// A whole number in a range.
pub(super) fn whole(low: u32, high: u32) -> impl Fn(&DeValue) -> Result<u32, String> {
    move |value| {
        let DeValue::Integer(i) = value else { return expected("a whole number", value) };
        let n = i64::from_str_radix(i.as_str(), i.radix()).ok().and_then(|n| u32::try_from(n).ok());
        n.filter(|n| (low..=high).contains(n)).ok_or_else(|| format!("must be a whole number from {low} to {high}"))
    }
}

pub(super) fn boolean(value: &DeValue) -> Result<bool, String> {
    value.as_bool().map_or_else(|| expected("true or false", value), Ok)
}

pub(super) fn string(value: &DeValue) -> Result<String, String> {
    value.as_str().map_or_else(|| expected("a string", value), |s| Ok(s.to_owned()))
}

/// One of some words; the error names the nearest.
pub(super) fn word<T: Copy>(words: &[(&'static str, T)]) -> impl Fn(&DeValue) -> Result<T, String> {
    move |value| {
        let typed = string(value)?;
        if let Some((_, meaning)) = words.iter().find(|(word, _)| *word == typed) {
            return Ok(*meaning);
        }
        let known = list(words.iter().map(|(word, _)| *word));
        match nearest(&typed, words.iter().map(|(word, _)| *word)) {
            Some(near) => Err(format!("is `{typed}`, which is none of {known}; did you mean `{near}`?")),
            None => Err(format!("is `{typed}`, which is none of {known}")),
        }
    }
}

fn items<'v>(value: &'v DeValue, what: &str) -> Result<Vec<&'v DeValue<'v>>, String> {
    let Some(array) = value.as_array() else { return expected(what, value) };
    Ok(array.iter().map(Spanned::get_ref).collect())
}

/// Every item of an array.
pub(super) fn each<T>(read: impl Fn(&DeValue) -> Result<T, String>) -> impl Fn(&DeValue) -> Result<Vec<T>, String> {
    move |value| {
        let read_item = |(i, item): (usize, &DeValue)| read(item).map_err(|wrong| format!("item {i} {wrong}"));
        items(value, "a list")?.into_iter().enumerate().map(read_item).collect()
    }
}

/// Exactly `N` numbers.
pub(super) fn numbers<const N: usize>(value: &DeValue) -> Result<[f64; N], String> {
    let list = items(value, &format!("a list of {N} numbers"))?;
    let list: Vec<f64> = list.into_iter().map(number).collect::<Result<_, _>>()?;
    let count = list.len();
    list.try_into().map_err(|_| format!("must have {N} numbers, not {count}"))
}

pub(super) fn vec(value: &DeValue) -> Result<DVec3, String> {
    numbers::<3>(value).map(DVec3::from)
}

/// A vector of length 1.
pub(super) fn direction(value: &DeValue) -> Result<DVec3, String> {
    vec(value)?.try_normalize().ok_or_else(|| "must have a length".into())
}

/// A linear colour from `[r, g, b]`, a grey, `"#rrggbb"` or a name.
pub(super) fn color(value: &DeValue) -> Result<Vec3, String> {
    let rgb = match value {
        DeValue::String(text) => return crate::scene::color::parse(text).map_err(|wrong| format!("is wrong: {wrong}")),
        DeValue::Array(_) => vec(value)?,
        DeValue::Integer(_) | DeValue::Float(_) => DVec3::splat(number(value)?),
        _ => return expected("a colour", value),
    };
    if rgb.min_element() < 0.0 || rgb.max_element() > 1e9 {
        return Err("must have no part below 0 or above 1e9".into());
    }
    Ok(rgb.as_vec3())
}

/// An index of refraction: a number, or the name of a substance.
pub(super) fn ior(value: &DeValue) -> Result<f64, String> {
    use crate::scene::ior::{TABLE, by_name};
    let Some(name) = value.as_str() else { return within(1.0, 100.0)(value) };
    by_name(name).ok_or_else(|| {
        let known = list(TABLE.iter().map(|(known, _)| *known));
        format!("is `{name}`, which is no known substance; write a number, or one of {known}")
    })
}
