//! JSON as a tree of values whose strings borrow from the text of the file, unless they contain escapes.
//!
//! Large documents repeat the same names: here they are neither copied nor hashed.

use serde::de::value::{BorrowedStrDeserializer, MapDeserializer, SeqDeserializer, StringDeserializer};
use serde::de::{Deserialize, Deserializer, Error as _, IntoDeserializer, MapAccess, SeqAccess, Unexpected, Visitor};
use serde_json::{Error, Number};
use std::borrow::Cow;
use std::fmt;

/// A JSON value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value<'a> {
    Null,
    Bool(bool),
    Number(Number),
    String(Cow<'a, str>),
    Array(Vec<Value<'a>>),
    Object(Map<'a>),
}

/// Members of an object with unique names: few in the order of the file, many sorted by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Map<'a>(Vec<(Cow<'a, str>, Value<'a>)>);

/// Common interface of the trees of this module and of the `serde_json` crate, which typed documents contain.
pub(super) trait Tree: Sized {
    fn get(&self, name: &str) -> Option<&Self>;
    fn as_array(&self) -> Option<&Vec<Self>>;
    fn as_u64(&self) -> Option<u64>;
    fn as_f64(&self) -> Option<f64>;
}

impl<'a> Value<'a> {
    /// Member of an object.
    pub(super) fn get(&self, name: &str) -> Option<&Self> {
        self.as_object()?.get(name)
    }

    pub(super) fn get_mut(&mut self, name: &str) -> Option<&mut Self> {
        self.as_object_mut()?.get_mut(name)
    }

    /// Element of a list.
    pub(super) fn element(&self, index: usize) -> Option<&Self> {
        self.as_array()?.get(index)
    }

    pub(super) fn element_mut(&mut self, index: usize) -> Option<&mut Self> {
        self.as_array_mut()?.get_mut(index)
    }

    /// Value at a path: names and indices without escapes, each after a slash.
    pub(super) fn pointer(&self, path: &str) -> Option<&Self> {
        path.split('/').skip(1).try_fold(self, |value, step| match value {
            Self::Array(list) => list.get(step.parse::<usize>().ok()?),
            _ => value.get(step),
        })
    }

    pub(super) fn as_bool(&self) -> Option<bool> {
        if let Self::Bool(value) = self { Some(*value) } else { None }
    }

    pub(super) fn as_u64(&self) -> Option<u64> {
        if let Self::Number(number) = self { number.as_u64() } else { None }
    }

    pub(super) fn as_f64(&self) -> Option<f64> {
        if let Self::Number(number) = self { number.as_f64() } else { None }
    }

    pub(super) fn as_str(&self) -> Option<&str> {
        if let Self::String(text) = self { Some(text) } else { None }
    }

    pub(super) fn as_array(&self) -> Option<&Vec<Self>> {
        if let Self::Array(list) = self { Some(list) } else { None }
    }

    pub(super) fn as_array_mut(&mut self) -> Option<&mut Vec<Self>> {
        if let Self::Array(list) = self { Some(list) } else { None }
    }

    pub(super) fn as_object(&self) -> Option<&Map<'a>> {
        if let Self::Object(map) = self { Some(map) } else { None }
    }

    pub(super) fn as_object_mut(&mut self) -> Option<&mut Map<'a>> {
        if let Self::Object(map) = self { Some(map) } else { None }
    }

    pub(super) fn is_object(&self) -> bool {
        matches!(self, Self::Object(_))
    }

    /// Returns an owned copy.
    pub(super) fn owned(&self) -> serde_json::Value {
        match self {
            Self::Null => serde_json::Value::Null,
            Self::Bool(value) => (*value).into(),
            Self::Number(number) => number.clone().into(),
            Self::String(text) => text.as_ref().into(),
            Self::Array(list) => list.iter().map(Self::owned).collect(),
            Self::Object(map) => map.iter().map(|(name, value)| (name, value.owned())).collect(),
        }
    }
}

impl<'a> Map<'a> {
    /// Count from which members are sorted: looking up every name of a large unsorted object would take quadratic time.
    const MANY: usize = 17;

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn get(&self, name: &str) -> Option<&Value<'a>> {
        self.find(name).ok().map(|at| &self.0[at].1)
    }

    pub(super) fn get_mut(&mut self, name: &str) -> Option<&mut Value<'a>> {
        self.find(name).ok().map(|at| &mut self.0[at].1)
    }

    pub(super) fn contains_key(&self, name: &str) -> bool {
        self.find(name).is_ok()
    }

    /// Inserts a value, replacing that of the same name.
    pub(super) fn insert(&mut self, name: impl Into<Cow<'a, str>>, value: Value<'a>) {
        let name = name.into();
        match self.find(&name) {
            Ok(at) => self.0[at].1 = value,
            Err(at) => self.0.insert(at, (name, value)),
        }
        if self.0.len() == Self::MANY {
            self.sort();
        }
    }

    /// Inserts a value unless the name exists.
    pub(super) fn insert_missing(&mut self, name: &'static str, value: impl FnOnce() -> Value<'a>) {
        if !self.contains_key(name) {
            self.insert(name, value());
        }
    }

    pub(super) fn remove(&mut self, name: &str) {
        if let Ok(at) = self.find(name) {
            self.0.remove(at);
        }
    }

    pub(super) fn retain(&mut self, keep: impl Fn(&str, &Value<'a>) -> bool) {
        self.0.retain(|(name, value)| keep(name, value));
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&str, &Value<'a>)> + use<'_, 'a> {
        self.0.iter().map(|(name, value)| (name.as_ref(), value))
    }

    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = (&str, &mut Value<'a>)> + use<'_, 'a> {
        self.0.iter_mut().map(|(name, value)| (&**name, value))
    }

    /// Index of a name, or else the index to insert it at.
    fn find(&self, name: &str) -> Result<usize, usize> {
        if self.0.len() >= Self::MANY {
            return self.0.binary_search_by(|(member, _)| member.as_ref().cmp(name));
        }
        self.0.iter().position(|(member, _)| member == name).ok_or(self.0.len())
    }

    /// Sorts the members; of several with one name the last is kept.
    fn sort(&mut self) {
        self.0.sort_by(|(a, _), (b, _)| a.cmp(b));
        self.0.dedup_by(|later, kept| {
            let is_again = later.0 == kept.0;
            if is_again {
                std::mem::swap(later, kept);
            }
            is_again
        });
    }
}

impl<'a> FromIterator<(&'a str, Value<'a>)> for Map<'a> {
    fn from_iter<I: IntoIterator<Item = (&'a str, Value<'a>)>>(members: I) -> Self {
        let mut map = Self::default();
        members.into_iter().for_each(|(name, value)| map.insert(name, value));
        map
    }
}

impl From<u64> for Value<'_> {
    fn from(number: u64) -> Self {
        Self::Number(number.into())
    }
}

/// Numbers that are not finite become null, as JSON has none.
impl From<f64> for Value<'_> {
    fn from(number: f64) -> Self {
        Number::from_f64(number).map_or(Self::Null, Self::Number)
    }
}

#[cfg(test)]
impl From<serde_json::Value> for Value<'static> {
    fn from(value: serde_json::Value) -> Self {
        use serde_json::Value as Other;
        match value {
            Other::Null => Self::Null,
            Other::Bool(value) => Self::Bool(value),
            Other::Number(number) => Self::Number(number),
            Other::String(text) => Self::String(text.into()),
            Other::Array(list) => Self::Array(list.into_iter().map(Self::from).collect()),
            Other::Object(map) => {
                let mut members = Map::default();
                map.into_iter().for_each(|(name, value)| members.insert(name, value.into()));
                Self::Object(members)
            }
        }
    }
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.owned().fmt(f)
    }
}

macro_rules! tree {
    ($($tree:ty),*) => {$(
        impl Tree for $tree {
            fn get(&self, name: &str) -> Option<&Self> {
                Self::get(self, name)
            }

            fn as_array(&self) -> Option<&Vec<Self>> {
                Self::as_array(self)
            }

            fn as_u64(&self) -> Option<u64> {
                Self::as_u64(self)
            }

            fn as_f64(&self) -> Option<f64> {
                Self::as_f64(self)
            }
        }
    )*};
}

tree!(Value<'_>, serde_json::Value);

/// Builds values from the output of a parser.
struct Builder;

impl<'de> Deserialize<'de> for Value<'de> {
    fn deserialize<D: Deserializer<'de>>(parser: D) -> Result<Self, D::Error> {
        parser.deserialize_any(Builder)
    }
}

impl<'de> Visitor<'de> for Builder {
    type Value = Value<'de>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value of JSON")
    }

    fn visit_unit<E>(self) -> Result<Value<'de>, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value<'de>, E> {
        Ok(Value::Bool(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value<'de>, E> {
        Ok(Value::Number(value.into()))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value<'de>, E> {
        Ok(Value::Number(value.into()))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value<'de>, E> {
        Ok(Number::from_f64(value).map_or(Value::Null, Value::Number))
    }

    fn visit_borrowed_str<E>(self, text: &'de str) -> Result<Value<'de>, E> {
        Ok(Value::String(text.into()))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value<'de>, E> {
        Ok(Value::String(text.to_owned().into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Value<'de>, A::Error> {
        let mut list = Vec::new();
        while let Some(element) = elements.next_element()? {
            list.push(element);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Value<'de>, A::Error> {
        let mut map = Map::default();
        while let Some((Name(name), value)) = members.next_entry()? {
            if map.0.len() < Map::MANY {
                map.insert(name, value);
            } else {
                map.0.push((name, value));
            }
        }
        if map.0.len() > Map::MANY {
            map.sort();
        }
        Ok(Value::Object(map))
    }
}

/// Name of a member.
struct Name<'a>(Cow<'a, str>);

impl<'de> Deserialize<'de> for Name<'de> {
    fn deserialize<D: Deserializer<'de>>(parser: D) -> Result<Self, D::Error> {
        match parser.deserialize_str(Builder)? {
            Value::String(name) => Ok(Self(name)),
            other => Err(D::Error::custom(format_args!("{other} where a name should be"))),
        }
    }
}

/// Lets typed documents be deserialised from values.
impl<'de> Deserializer<'de> for Value<'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self {
            Self::Null => visitor.visit_unit(),
            Self::Bool(value) => visitor.visit_bool(value),
            Self::Number(number) => number.deserialize_any(visitor),
            Self::String(Cow::Borrowed(text)) => visitor.visit_borrowed_str(text),
            Self::String(Cow::Owned(text)) => visitor.visit_string(text),
            Self::Array(list) => {
                let mut elements = SeqDeserializer::new(list.into_iter());
                let value = visitor.visit_seq(&mut elements)?;
                elements.end().map(|()| value)
            }
            Self::Object(map) => {
                let mut members = MapDeserializer::new(map.0.into_iter().map(|(name, value)| (Name(name), value)));
                let value = visitor.visit_map(&mut members)?;
                members.end().map(|()| value)
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        if self == Self::Null { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    /// Enums are names only: no enum of the documents carries data.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self {
            Self::String(text) => visitor.visit_enum(text.into_deserializer()),
            _ => Err(Error::invalid_type(Unexpected::Other("a value without a name"), &"the name of a variant")),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

impl<'de> IntoDeserializer<'de, Error> for Value<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> IntoDeserializer<'de, Error> for Name<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Name<'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Cow::Borrowed(name) => BorrowedStrDeserializer::new(name).deserialize_any(visitor),
            Cow::Owned(name) => StringDeserializer::new(name).deserialize_any(visitor),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn parsed(text: &str) -> Value<'_> {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_tree_says_what_another_parser_reads() {
        let texts = [
            r#"{"a": [1, -2, 3.5, 1e300, 18446744073709551615, true, null, "t", {}], "b\n": {"c": "\u00e9\\"}}"#,
            "[]",
            "-0.0",
            r#""plain""#,
            r#"{"": {"": [[[]]]}}"#,
        ];
        for text in texts {
            let other: serde_json::Value = serde_json::from_str(text).unwrap();
            assert_eq!(parsed(text).owned(), other, "{text}");
            assert_eq!(parsed(text), Value::from(other), "{text}");
        }
    }

    #[test]
    fn texts_are_borrowed_where_nothing_is_escaped() {
        let value = parsed(r#"{"plain": "as it is", "with\tescape": "a\nb"}"#);
        let Value::Object(Map(members)) = &value else { panic!("{value}") };
        let is_borrowed = |text: &Cow<str>| matches!(text, Cow::Borrowed(_));
        let texts: Vec<(bool, bool)> = members
            .iter()
            .map(|(name, value)| (is_borrowed(name), matches!(value, Value::String(text) if is_borrowed(text))))
            .collect();
        assert_eq!(texts, [(true, true), (false, false)]);
    }

    #[test]
    fn of_members_with_one_name_the_last_counts_however_many_there_are() {
        for more in [0, Map::MANY - 3, Map::MANY - 2, Map::MANY - 1, Map::MANY, 1000] {
            let others: String = (0..more).map(|i| format!(", \"{i}\": {i}")).collect();
            let value = parsed(&format!("{{\"z\": 1, \"a\": 2{others}, \"z\": 3}}")).owned();
            let mut expected = json!({"z": 3, "a": 2});
            (0..more).for_each(|i| expected[i.to_string()] = json!(i));
            assert_eq!(value, expected, "{more}");
        }
    }

    #[test]
    fn members_are_found_put_in_and_taken_out_whether_few_or_many() {
        let mut map = Map::default();
        for i in (0..40u64).rev() {
            map.insert(i.to_string(), i.into());
            map.insert((i / 2 + 20).to_string(), (i + 100).into());
        }
        assert_eq!(map.iter().count(), 40);
        assert_eq!(map.get("7").and_then(Value::as_u64), Some(7));
        assert_eq!(map.get("39").and_then(Value::as_u64), Some(138));
        map.insert_missing("7", || 0.into());
        map.retain(|name, _| name.len() < 2);
        map.remove("5");
        map.insert_missing("5", || 55.into());
        let left: Vec<u64> = map.iter().filter_map(|(_, value)| value.as_u64()).collect();
        assert_eq!(left, [0, 1, 2, 3, 4, 6, 7, 8, 9, 55]);
    }

    #[test]
    fn looking_for_every_name_of_a_large_object_takes_no_squared_time() {
        let names: Vec<String> = (0..200_000).map(|i| format!("NAME_{i:06}")).collect();
        let text = names.iter().map(|name| format!("\"{name}\":0")).collect::<Vec<_>>().join(",");
        let text = format!("{{{text}}}");
        let value = parsed(&text);
        assert!(names.iter().all(|name| value.get(name).is_some()));
    }

    #[test]
    fn paths_lead_through_objects_and_lists() {
        let value = parsed(r#"{"nodes": [{"mesh": 1}, {"mesh": 2}]}"#);
        assert_eq!(value.pointer("/nodes/1/mesh").and_then(Value::as_u64), Some(2));
        for lost in ["/nodes/2", "/nodes/mesh", "/nodes/0/mesh/0", "/other"] {
            assert!(value.pointer(lost).is_none(), "{lost}");
        }
    }

    #[test]
    fn typed_values_are_what_another_tree_makes_them() {
        #[derive(Debug, PartialEq, serde::Deserialize)]
        struct Wrapped(u8);

        #[derive(Debug, PartialEq, serde::Deserialize)]
        #[serde(rename_all = "lowercase")]
        enum Kind {
            Spot,
        }

        #[derive(Debug, PartialEq, serde::Deserialize)]
        struct Typed {
            name: Option<String>,
            wrapped: Vec<Wrapped>,
            kind: Kind,
            scale: [f32; 2],
            #[serde(flatten)]
            others: serde_json::Map<String, serde_json::Value>,
        }

        let read = |text: &str| (Typed::deserialize(parsed(text)), serde_json::from_str::<Typed>(text));
        let (ours, theirs) =
            read(r#"{"name": null, "wrapped": [1, 2], "kind": "spot", "scale": [1, 0.5], "more": {"a": [1]}}"#);
        assert_eq!(ours.unwrap(), theirs.unwrap());
        for wrong in [
            r#"{"wrapped": [300], "kind": "spot", "scale": [1, 1]}"#,
            r#"{"wrapped": [], "kind": "sun", "scale": [1, 1]}"#,
            r#"{"wrapped": [], "kind": 1, "scale": [1, 1]}"#,
            r#"{"wrapped": [], "kind": "spot", "scale": [1, 1, 1]}"#,
            r#"{"wrapped": {}, "kind": "spot", "scale": [1, 1]}"#,
            r#"{"kind": "spot", "scale": [1, 1]}"#,
        ] {
            let (ours, theirs) = read(wrong);
            assert!(ours.is_err() && theirs.is_err(), "{wrong}");
        }
    }
}
