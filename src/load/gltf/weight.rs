//! Memory that a document takes, estimated before it is allocated.
//!
//! A JSON value may be one digit and a comma in the file, and takes a hundred bytes once parsed; a node or a material takes up
//! to a thousand as a typed struct, even if empty.

use super::tree::Value;
use gltf::json::{self, accessor, buffer, mesh, scene, texture};
use std::borrow::Cow;

/// Deepest nesting that the parser supports.
pub(super) const DEEPEST: usize = 127;

/// Contents of a JSON text, counted without parsing. Text that is not JSON gives some counts as well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Weight {
    lists: u64,
    objects: u64,
    /// Upper bound of the number of values: one per comma, and one in each list or object.
    values: u64,
    /// Number of values with a name.
    members: u64,
    /// Bytes in strings: those with escapes are copied.
    text: u64,
    /// Deepest nesting of lists and objects.
    pub(super) depth: usize,
}

impl Weight {
    /// Counts the contents of a JSON text.
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

    /// Upper bound of the bytes of the parsed values.
    ///
    /// Lists grow by doubling from four slots, and so do objects, whose members have a name beside the value.
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

/// Bytes of the typed document, with the data that loading keeps for each part.
pub(super) fn typed(root: &Value) -> u64 {
    /// Parents, transforms and numbers of nodes; locations of accessors; reports of primitives.
    const NOTES: usize = 512;
    /// The tree that holds the attributes of a primitive.
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

    /// Lower bound of the heap bytes of a value.
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
