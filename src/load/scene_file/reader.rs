//! Reads tables of a scene file key by key: every fault is noted with its line and column, unknown keys with the
//! nearest known one, and reading continues so that all faults are reported at once; of very many, the first ones.
//!
//! Knows TOML, not scenes.

use crate::load::paths::FileFault;
use crate::load::suggest::{list, nearest};
use crate::load::{Diagnostic, LoadError};
use crate::math::{DVec3, Vec3};
use std::cell::{Cell, OnceCell, RefCell};
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Byte range in the file.
pub(super) type Span = Range<usize>;

/// Largest number of faults that are listed; the others are only counted.
const SHOWN: usize = 20;

/// The text of the file and its faults.
pub(super) struct Faults {
    file: PathBuf,
    text: String,
    /// Start of each line; computed on first use.
    lines: OnceCell<Vec<usize>>,
    /// Faults to list, each with its byte offset, and a few more.
    list: RefCell<Vec<(usize, Diagnostic)>>,
    /// Number of faults that are not in the list.
    hidden: Cell<u32>,
}

impl Faults {
    pub(super) fn new(file: PathBuf, text: String) -> Self {
        let (lines, list, hidden) = (OnceCell::new(), RefCell::default(), Cell::new(0));
        Self { file, text, lines, list, hidden }
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// `line:column` of a byte, both from 1, columns in characters.
    pub(super) fn place(&self, at: usize) -> String {
        let ends = || self.text.bytes().zip(1..).filter(|(byte, _)| *byte == b'\n').map(|(_, after)| after);
        let lines = self.lines.get_or_init(|| std::iter::once(0).chain(ends()).collect());
        let at = if self.text.is_char_boundary(at) { at } else { self.text.len() };
        let line = lines.partition_point(|&start| start <= at);
        let start = line.checked_sub(1).and_then(|line| lines.get(line)).copied().unwrap_or_default();
        format!("{line}:{}", self.text[start..at].chars().count() + 1)
    }

    pub(super) fn note(&self, code: &'static str, at: &Span, text: impl Into<String>, remedy: impl Into<String>) {
        let fault = Diagnostic::new(code, &self.file, "", text).remedy(remedy);
        let mut list = self.list.borrow_mut();
        list.push((at.start, fault));
        if list.len() >= 2 * SHOWN {
            self.shorten(&mut list);
        }
    }

    /// Notes that the file named at this byte cannot be read.
    pub(super) fn note_file(&self, at: usize, fault: &FileFault) {
        let Diagnostic { code, text, mut remedy, .. } = fault.diagnose(&self.file, "");
        // The diagnostic is worded for models; adapt it.
        let text = text.replace("outside the model's folder", "outside the scene file's folder");
        if fault.is_missing() {
            remedy = remedy.replace("the model", "the scene file");
        }
        self.note(code, &(at..at), text, remedy);
    }

    /// Whether a fault at this byte would be listed; if not, no suggestion needs to be searched.
    pub(super) fn lists(&self, at: usize) -> bool {
        self.list.borrow().iter().filter(|(start, _)| *start <= at).count() < SHOWN
    }

    /// Counts a fault that would not be listed.
    pub(super) fn count(&self) {
        self.hidden.set(self.hidden.get().saturating_add(1));
    }

    /// Drops all but the first faults, in the order of the file.
    fn shorten(&self, list: &mut Vec<(usize, Diagnostic)>) {
        list.sort_by_key(|(start, _)| *start);
        for _ in list.drain(SHOWN.min(list.len())..) {
            self.count();
        }
    }

    /// Returns an error when there are faults.
    pub(super) fn check(&self) -> Result<(), LoadError> {
        if self.list.borrow().is_empty() { Ok(()) } else { Err(self.all()) }
    }

    /// All faults, at least one, in the order of the file.
    pub(super) fn all(&self) -> LoadError {
        let mut list = self.list.take();
        self.shorten(&mut list);
        let place = |(at, fault): (usize, Diagnostic)| Diagnostic { place: self.place(at), ..fault };
        let mut faults: Vec<Diagnostic> = list.into_iter().map(place).collect();
        let hidden = self.hidden.take();
        if hidden > 0 {
            faults.push(Diagnostic::new("scene-more-faults", &self.file, "", format!("{hidden} more faults")));
        }
        LoadError::Input(faults)
    }
}

/// One table; [`Table::finish`] reports the keys that were never read.
pub(super) struct Table<'a> {
    pub(super) faults: &'a Faults,
    /// Name of the described object, for messages: `light`, `material`.
    what: &'static str,
    /// Position of the table.
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

    /// Whether the key exists, whatever its value.
    pub(super) fn has(&self, key: &'static str) -> bool {
        self.find(key).is_some()
    }

    /// Position of a key's value, or else of the table.
    pub(super) fn place_of(&self, key: &'static str) -> Span {
        self.find(key).map_or(self.span.clone(), Spanned::span)
    }

    /// Value of a key; `None` when it is absent or wrong (the fault is noted).
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

    /// As [`Table::get`], for a key that must exist.
    pub(super) fn need<T>(&self, key: &'static str, read: impl FnOnce(&DeValue<'a>) -> Result<T, String>) -> Option<T> {
        if !self.has(key) {
            self.note(&self.span, format!("this {} has no `{key}`", self.what), "add it");
            return None;
        }
        self.get(key, read)
    }

    /// Tables of an array of tables.
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

    /// Table under a key.
    pub(super) fn table(&self, key: &'static str, what: &'static str) -> Option<Table<'a>> {
        let value = self.find(key)?;
        let Some(map) = value.get_ref().as_table() else {
            self.note(&value.span(), format!("`{key}` is a table"), format!("begin it with [{key}]"));
            return None;
        };
        Some(Table::new(self.faults, what, value.span(), map))
    }

    /// All entries, each a table with a user-defined name, in the order of the file.
    pub(super) fn named(&self, what: &'static str) -> Vec<(String, Table<'a>)> {
        let mut entries: Vec<_> = self.map.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let mut tables = Vec::new();
        for (key, value) in entries {
            match value.get_ref().as_table() {
                Some(map) => tables.push((key.get_ref().to_string(), Table::new(self.faults, what, key.span(), map))),
                None => {
                    let name = key.get_ref();
                    self.note(
                        &key.span(),
                        format!("`{name}` is not a {what} table"),
                        format!("begin it with [{what}s.{name}]"),
                    );
                }
            }
        }
        tables
    }

    /// Notes a fault that involves several keys.
    pub(super) fn note(&self, at: &Span, text: impl Into<String>, remedy: impl Into<String>) {
        self.faults.note("scene-value", at, text, remedy);
    }

    /// Notes every key that was never read.
    pub(super) fn finish(self) {
        let asked = self.asked.into_inner();
        for key in self.map.keys().filter(|key| !asked.contains(&key.get_ref().as_ref())) {
            if !self.faults.lists(key.span().start) {
                self.faults.count();
                continue;
            }
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
    match parsed {
        Some(n) if f64::is_finite(n) => Ok(n),
        other => Err(format!("is {}, but must be a finite number", other.unwrap_or(f64::INFINITY))),
    }
}

/// Reads a number in `low..=high`.
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

/// Reads a finite number above 0.
pub(super) fn positive(value: &DeValue) -> Result<f64, String> {
    let n = number(value)?;
    if n > 0.0 { Ok(n) } else { Err(format!("is {n}, but must be above 0")) }
}

/// Reads a finite number, 0 or above.
pub(super) fn not_negative(value: &DeValue) -> Result<f64, String> {
    let n = number(value)?;
    if n >= 0.0 { Ok(n) } else { Err(format!("is {n}, but must not be below 0")) }
}

/// Reads an integer in a range.
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

/// Reads one of several words; the error names the nearest.
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

/// Reads every item of an array.
pub(super) fn each<T>(read: impl Fn(&DeValue) -> Result<T, String>) -> impl Fn(&DeValue) -> Result<Vec<T>, String> {
    move |value| {
        let read_item = |(i, item): (usize, &DeValue)| read(item).map_err(|wrong| format!("item {i} {wrong}"));
        items(value, "a list")?.into_iter().enumerate().map(read_item).collect()
    }
}

/// Reads exactly `N` numbers.
pub(super) fn numbers<const N: usize>(value: &DeValue) -> Result<[f64; N], String> {
    let list = items(value, &format!("a list of {N} numbers"))?;
    let list: Vec<f64> = list.into_iter().map(number).collect::<Result<_, _>>()?;
    let count = list.len();
    list.try_into().map_err(|_| format!("must have {N} numbers, not {count}"))
}

pub(super) fn vec(value: &DeValue) -> Result<DVec3, String> {
    numbers::<3>(value).map(DVec3::from)
}

/// Reads a vector and normalizes it.
pub(super) fn direction(value: &DeValue) -> Result<DVec3, String> {
    vec(value)?.try_normalize().ok_or_else(|| "must have a length".into())
}

/// Reads a linear colour from `[r, g, b]`, a grey, `"#rrggbb"` or a name.
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

/// Reads an index of refraction: a number, or the name of a substance.
pub(super) fn ior(value: &DeValue) -> Result<f64, String> {
    use crate::scene::ior::{TABLE, by_name};
    let Some(name) = value.as_str() else { return within(1.0, 100.0)(value) };
    by_name(name).ok_or_else(|| {
        let known = list(TABLE.iter().map(|(known, _)| *known));
        format!("is `{name}`, which is no known substance; write a number, or one of {known}")
    })
}
