//! A writer for binary glTF 2.0, as far as the models need it.

use crate::shape::Shape;
use serde_json::{Value, json};

/// A model under construction. Methods return the index of what they add.
#[derive(Default)]
pub(crate) struct Glb {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    nodes: Vec<Value>,
    animations: Vec<Value>,
    extensions: Vec<String>,
}

/// The accessors of a shape, so that several meshes can share them.
#[derive(Clone)]
pub(crate) struct Geometry {
    attributes: Value,
    indices: usize,
    targets: Vec<Value>,
}

/// What one animation channel does to a node.
pub(crate) struct Channel<'a> {
    pub(crate) node: usize,
    pub(crate) path: &'a str,
    pub(crate) interpolation: &'a str,
    /// Seconds, ascending.
    pub(crate) times: &'a [f32],
    /// The values of all keys, one after the other.
    pub(crate) values: &'a [f32],
    /// Accessor type of a value.
    pub(crate) kind: &'a str,
}

const FLOAT: u32 = 5126;
const U16: u32 = 5123;

impl Glb {
    /// Adds a glTF material object; the extensions it uses are declared.
    pub(crate) fn material(&mut self, material: Value) -> usize {
        for name in material["extensions"].as_object().into_iter().flat_map(|map| map.keys()) {
            self.declare(name);
        }
        push(&mut self.materials, material)
    }

    /// Adds a texture from encoded PNG or JPEG bytes and a glTF sampler object.
    pub(crate) fn texture(&mut self, mime_type: &str, bytes: &[u8], sampler: Value) -> usize {
        let view = self.view(bytes, None);
        let source = push(&mut self.images, json!({ "bufferView": view, "mimeType": mime_type }));
        let sampler = push(&mut self.samplers, sampler);
        push(&mut self.textures, json!({ "source": source, "sampler": sampler }))
    }

    /// Stores a shape.
    pub(crate) fn geometry(&mut self, shape: &Shape) -> Geometry {
        let mut attributes = json!({
            "POSITION": self.bounded("VEC3", &shape.positions),
            "NORMAL": self.floats("VEC3", &shape.normals, Some(34962)),
        });
        if !shape.uvs.is_empty() {
            attributes["TEXCOORD_0"] = self.floats("VEC2", &shape.uvs, Some(34962)).into();
        }
        let bytes: Vec<u8> = shape.indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
        let view = self.view(&bytes, Some(34963));
        let count = shape.indices.len();
        let accessor = json!({ "bufferView": view, "componentType": U16, "count": count, "type": "SCALAR" });
        Geometry { attributes, indices: push(&mut self.accessors, accessor), targets: Vec::new() }
    }

    /// Adds a morph target: where each vertex of `geometry` moves.
    pub(crate) fn morph(&mut self, geometry: &mut Geometry, moves: &[[f32; 3]]) {
        let target = json!({ "POSITION": self.bounded("VEC3", moves) });
        geometry.targets.push(target);
    }

    /// Adds a mesh of one primitive.
    pub(crate) fn mesh(&mut self, name: &str, geometry: &Geometry, material: usize) -> usize {
        let mut primitive =
            json!({ "attributes": geometry.attributes, "indices": geometry.indices, "material": material });
        let mut mesh = json!({ "name": name });
        if !geometry.targets.is_empty() {
            primitive["targets"] = geometry.targets.clone().into();
            mesh["weights"] = vec![0.0; geometry.targets.len()].into();
        }
        mesh["primitives"] = json!([primitive]);
        push(&mut self.meshes, mesh)
    }

    /// Adds a glTF node object.
    pub(crate) fn node(&mut self, node: Value) -> usize {
        push(&mut self.nodes, node)
    }

    /// Stores `mesh` in a node of its own, moved by `translation`.
    pub(crate) fn place(&mut self, name: &str, mesh: usize, translation: [f64; 3]) -> usize {
        self.node(json!({ "name": name, "mesh": mesh, "translation": translation }))
    }

    /// Adds an animation.
    pub(crate) fn animation(&mut self, name: &str, channels: &[Channel]) {
        let (mut samplers, mut targets) = (Vec::new(), Vec::new());
        for channel in channels {
            let times: Vec<_> = channel.times.iter().map(|&t| [t]).collect();
            let values: Vec<_> = channel.values.iter().map(|&v| [v]).collect();
            let (input, output) = (self.bounded("SCALAR", &times), self.floats(channel.kind, &values, None));
            let sampler = push(
                &mut samplers,
                json!({ "input": input, "output": output, "interpolation": channel.interpolation }),
            );
            targets.push(json!({ "sampler": sampler, "target": { "node": channel.node, "path": channel.path } }));
        }
        self.animations.push(json!({ "name": name, "samplers": samplers, "channels": targets }));
    }

    /// The file, with `roots` as its scene.
    pub(crate) fn finish(self, roots: &[usize]) -> Vec<u8> {
        let mut file = json!({
            "asset": { "version": "2.0", "generator": "meshray generate-models" },
            "scene": 0,
            "scenes": [{ "nodes": roots }],
            "buffers": [{ "byteLength": self.bin.len() }],
        });
        let lists = [
            ("nodes", self.nodes),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("textures", self.textures),
            ("images", self.images),
            ("samplers", self.samplers),
            ("animations", self.animations),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
            ("extensionsUsed", self.extensions.into_iter().map(Value::from).collect()),
        ];
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            file[name] = list.into();
        }
        container(file.to_string().into_bytes(), self.bin)
    }

    /// Names an extension that is used.
    pub(crate) fn declare(&mut self, extension: &str) {
        if !self.extensions.iter().any(|name| name == extension) {
            self.extensions.push(extension.into());
        }
    }

    /// Stores floats with the bounds that positions and times must have.
    fn bounded<const N: usize>(&mut self, kind: &str, values: &[[f32; N]]) -> usize {
        let accessor = self.floats(kind, values, None);
        let fold = |start: f32, f: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N).map(|c| values.iter().fold(start, |all, v| f(all, v[c]))).collect()
        };
        self.accessors[accessor]["min"] = fold(f32::INFINITY, f32::min).into();
        self.accessors[accessor]["max"] = fold(f32::NEG_INFINITY, f32::max).into();
        accessor
    }

    fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]], target: Option<u32>) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, target);
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let count = values.len() * N / width;
        push(&mut self.accessors, json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": kind }))
    }

    /// Appends bytes to the buffer.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bin.extend_from_slice(bytes);
        pad(&mut self.bin, 0);
        push(&mut self.views, view)
    }
}

/// The two chunks of a GLB.
fn container(mut text: Vec<u8>, mut bin: Vec<u8>) -> Vec<u8> {
    pad(&mut text, b' ');
    pad(&mut bin, 0);
    let total = 12 + 8 + text.len() + 8 + bin.len();
    let mut file = Vec::with_capacity(total);
    file.extend(b"glTF");
    file.extend(2u32.to_le_bytes());
    file.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", bin)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

fn pad(bytes: &mut Vec<u8>, with: u8) {
    while !bytes.len().is_multiple_of(4) {
        bytes.push(with);
    }
}

fn push(list: &mut Vec<Value>, value: Value) -> usize {
    list.push(value);
    list.len() - 1
}
