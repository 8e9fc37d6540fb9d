//! A plain box with every vertex attribute that matters to rendering, to compare with compressed ones.

use super::*;

/// Vertices of the six sides, with their attributes.
pub(super) struct Plain {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) colors: Vec<[u8; 4]>,
    pub(super) joints: Vec<[u8; 4]>,
    pub(super) indices: Vec<u16>,
}

/// A triangle corner, in steps coarser than the loss of compression.
type Corner = [i32; 12];

impl Plain {
    pub(super) fn new() -> Self {
        let mut plain = Self {
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            colors: Vec::new(),
            joints: Vec::new(),
            indices: Vec::new(),
        };
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                plain.side(axis, side);
            }
        }
        plain
    }

    fn side(&mut self, axis: usize, side: f32) {
        let first = self.positions.len() as u16;
        for (k, (a, b)) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate() {
            let (mut position, mut normal) = ([0.0; 3], [0.0; 3]);
            position[axis] = side * 0.5;
            position[(axis + 1) % 3] = a * 0.5;
            position[(axis + 2) % 3] = b * 0.5;
            normal[axis] = side;
            let [r, g, b_] = position.map(|v: f32| ((v + 0.5) * 255.0) as u8);
            self.positions.push(position);
            self.normals.push(normal);
            self.uvs.push([(a + 1.0) / 2.0, (b + 1.0) / 2.0]);
            self.colors.push([r, g, b_, 255]);
            self.joints.push([k as u8, axis as u8, (side + 1.0) as u8, 0]);
        }
        let corners = if side > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
        self.indices.extend(corners.map(|corner| first + corner));
    }

    /// The file without compression.
    pub(super) fn file(&self) -> Builder {
        let mut file = Builder::new();
        let indices = file.shorts(&self.indices);
        let positions = file.floats("VEC3", self.positions.as_flattened());
        let normals = file.floats("VEC3", self.normals.as_flattened());
        let uvs = file.floats("VEC2", self.uvs.as_flattened());
        let colors = file.accessor(self.colors.as_flattened(), 5121, "VEC4", self.colors.len(), true);
        let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors});
        file.primitive(json!({"attributes": attributes, "indices": indices, "material": 0}));
        textured(&mut file);
        file
    }
}

/// Adds a material that needs texture coordinates.
pub(super) fn textured(file: &mut Builder) {
    file.set("images", json!([{ "uri": picture() }])).set("textures", json!([{ "source": 0 }]));
    file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
}

/// Triangles of the scene's only mesh, in an order that does not depend on the file's.
pub(super) fn triangles(loaded: &Loaded) -> Vec<[Corner; 3]> {
    let [mesh] = &loaded.scene.meshes[..] else { panic!("{} meshes", loaded.scene.meshes.len()) };
    let corner = |v: u32| {
        let v = v as usize;
        let (p, n, uv, c) = (mesh.positions[v], mesh.normals[v], mesh.uvs[0][v], mesh.colors[v]);
        let step = |v: f32| (v * 20.0).round() as i32;
        [p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y, c.x, c.y, c.z, c.w].map(step)
    };
    let turned = |triangle: &[u32; 3]| {
        let mut corners = triangle.map(corner);
        let first = (0..3).min_by_key(|&k| corners[k]).unwrap();
        corners.rotate_left(first);
        corners
    };
    let mut triangles: Vec<_> = mesh.triangles.iter().map(turned).collect();
    triangles.sort_unstable();
    triangles
}

/// Loads a file that may be damaged; returns whether it gives a scene, and not a few faults.
pub(super) fn survives(bytes: &[u8], what: &str) -> bool {
    let options = LoadOptions { limits: Limits { memory: 1 << 26, ..Limits::default() }, ..LoadOptions::default() };
    match load_bytes(Path::new("a.gltf"), bytes.to_vec(), &options) {
        Ok(loaded) => {
            let mesh = &loaded.scene.meshes.first();
            let sound = mesh.is_none_or(|m| m.triangles.iter().flatten().all(|&v| (v as usize) < m.positions.len()));
            assert!(sound, "{what}");
            true
        }
        Err(LoadError::Input(faults)) => {
            assert!((1..=5).contains(&faults.len()), "{what}: {faults:?}");
            false
        }
        Err(other) => panic!("{what}: {other:?}"),
    }
}
