//! What a document takes in memory, found out before the memory is taken.
//!
//! A value of JSON may be one digit and a comma in the file, and takes a hundred bytes as a parsed value; a node or a
//! material takes up to a thousand as a typed struct, even an empty one.

use super::tree::Value;
use gltf::json::{self, accessor, buffer, mesh, scene, texture};
use std::borrow::Cow;

/// Deepest nesting that the parser reads.
pub(super) const DEEPEST: usize = 127;

/// What a JSON text holds, counted without parsing it. Text that is no JSON gives some counts as well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Weight {
    lists: u64,
    objects: u64,
    /// Values at most: what stands between commas, and what each list or object holds.
    values: u64,
    /// Values with a name.
    members: u64,
    /// Bytes in strings: those with escapes are copied.
    text: u64,
    /// Containers within containers.
    pub(super) depth: usize,
}

impl Weight {
    /// Counts the parts of a JSON text.
    pub(super) fn of(json: &[u8]) -> Self {
        let mut weight = Self { values: 1, ..Self::default() };
        let (mut depth, mut quoted, mut escaped) = (0usize, false, false);
        for &byte in json {
            if quoted {
                weight.text += 1;
                quoted = escaped || byte != b'"';
                escaped = !escaped && byte == b'\\';
                continue;
            }
            match byte {
                b'"' => quoted = true,
                b',' => weight.values += 1,
                b':' => weight.members += 1,
                b'{' | b'[' => {
                    depth += 1;
                    weight.depth = weight.depth.max(depth);
                    weight.values += 1;
                    *if byte == b'[' { &mut weight.lists } else { &mut weight.objects } += 1;
                }
                b'}' | b']' => depth = depth.saturating_sub(1),
                _ => {}
            }
        }
        weight
    }

    /// Bytes that the parsed values take at most.
    ///
    /// Lists grow by doubling and start with four places, and so do objects, whose members have names beside their values.
    pub(super) fn bytes(&self) -> u64 {
        const VALUE: u64 = size_of::<Value>() as u64;
        const NAME: u64 = size_of::<Cow<str>>() as u64;
        let parts = [
            (2 * self.values + 4 * self.lists, VALUE),
            (2 * self.members, NAME),
            (4 * self.objects, VALUE + NAME),
            (self.text, 1),
        ];
        parts.into_iter().map(|(count, size)| count.saturating_mul(size)).fold(0, u64::saturating_add)
    }
}

/// Bytes that the typed document takes, and what is noted of each of its parts.
pub(super) fn typed(root: &Value) -> u64 {
    /// Parents, places and numbers of nodes; ways to accessors; reports of primitives.
    const NOTES: usize = 512;
    /// The tree that the attributes of a primitive are kept in.
    const ATTRIBUTES: usize = 1024;
    let list = |value: &Value, name: &str| value.get(name).and_then(Value::as_array).map_or(0, Vec::len);
    let sizes = [
        ("accessors", size_of::<json::Accessor>()),
        ("buffers", size_of::<json::Buffer>()),
        ("bufferViews", size_of::<buffer::View>()),
        ("cameras", size_of::<json::Camera>()),
        ("images", size_of::<json::Image>()),
        ("materials", size_of::<json::Material>()),
        ("meshes", size_of::<json::Mesh>()),
        ("nodes", size_of::<scene::Node>()),
        ("samplers", size_of::<texture::Sampler>()),
        ("scenes", size_of::<json::Scene>()),
        ("skins", size_of::<json::Skin>()),
        ("textures", size_of::<json::Texture>()),
    ];
    let lists = sizes.into_iter().map(|(name, size)| (list(root, name), size + NOTES));
    let meshes = root.get("meshes").and_then(Value::as_array).into_iter().flatten();
    let primitives = meshes.map(|mesh| list(mesh, "primitives")).sum();
    let sparse = size_of::<accessor::sparse::Sparse>();
    let all = lists.chain([(primitives, size_of::<mesh::Primitive>() + ATTRIBUTES + NOTES + sparse)]);
    all.map(|(count, size)| count as u64 * size as u64).fold(0, u64::saturating_add)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes that a value takes besides its own place, by what can be known of it.
    fn held(value: &Value) -> usize {
        match value {
            Value::Array(list) => list.capacity() * size_of::<Value>() + list.iter().map(held).sum::<usize>(),
            Value::Object(map) => {
                map.iter().map(|(_, value)| size_of::<Value>() + size_of::<Cow<str>>() + held(value)).sum()
            }
            Value::String(Cow::Owned(text)) => text.capacity(),
            _ => 0,
        }
    }

    #[test]
    fn whatever_is_written_in_few_bytes_is_charged_for_what_it_takes() {
        let many = |one: &str| format!("[{}]", vec![one; 1000].join(","));
        let names: Vec<String> = (0..1000).map(|i| format!("\"{i}\":0")).collect();
        let texts = ["0", "[]", "{}", "[0]", "{\"\":0}", "[[[0]]]", "\"\"", "\"\\\"\\\\\"", "[0,0,0,0,0]"].map(many);
        let more = [format!("{{{}}}", names.join(",")), format!("\"\\n{}\"", "a".repeat(5000)), "1".into()];
        for text in texts.into_iter().chain(more) {
            let value: Value = serde_json::from_str(&text).unwrap();
            let (charged, held) = (Weight::of(text.as_bytes()).bytes(), held(&value) + size_of::<Value>());
            assert!(charged >= held as u64, "{}: {charged} for {held}", &text[..text.len().min(40)]);
            assert!(charged <= 20 * held as u64, "{}: {charged} for {held}", &text[..text.len().min(40)]);
        }
    }

    #[test]
    fn brackets_and_commas_in_strings_do_not_count() {
        let weight = Weight::of(br#"{"a[[[,,": "]\"[,\\", "b": [1, [2]]}"#);
        assert_eq!(weight, Weight { lists: 2, objects: 1, values: 6, members: 2, text: 17, depth: 3 });
        assert_eq!(Weight::of(b"]]]}}[").depth, 1);
        assert_eq!(Weight::of(b"\"[[[").depth, 0);
    }

    #[test]
    fn the_parser_reads_as_deep_as_is_said() {
        let nested = |depth: usize| "[".repeat(depth) + &"]".repeat(depth);
        assert!(serde_json::from_str::<Value>(&nested(DEEPEST)).is_ok());
        assert!(serde_json::from_str::<Value>(&nested(DEEPEST + 1)).is_err());
        assert_eq!(Weight::of(nested(300).as_bytes()).depth, 300);
    }
}
