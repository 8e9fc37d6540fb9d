//! Binary glTF 2.0: positions and triangles of each mesh once, a node for each instance, metallic-roughness materials.

use serde_json::{Map, Value, json};

use crate::math::{DAffine3, Vec3};
use crate::scene::{Instance, Material, Mesh, Reflection, Scene, UpAxis};

/// Component types and buffer targets of glTF.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// Error: the scene does not fit into the format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0} bytes are more than a .glb can hold (4294967295); write .obj, or ask for less")]
pub struct TooLarge(usize);

/// Bytes of a .glb: triangles, instances, colours, and smooth glass; textures, lights, cameras, and
/// shapes other than triangles are left out.
///
/// # Errors
/// [`TooLarge`].
pub fn bytes(scene: &Scene) -> Result<Vec<u8>, TooLarge> {
    let (mut bin, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let meshes: Vec<Value> = scene.meshes.iter().map(|m| mesh(m, &mut bin, &mut views, &mut accessors)).collect();
    let mut nodes: Vec<Value> = scene.instances.iter().map(node).collect();
    let children: Vec<usize> = (0..nodes.len()).collect();
    nodes.push(json!({ "name": "upright", "matrix": columns(&scene.up.turned_to(UpAxis::Y)), "children": children }));
    let mut root = json!({
        "asset": { "version": "2.0", "generator": concat!("meshray ", env!("CARGO_PKG_VERSION")) },
        "scene": 0, "scenes": [{ "nodes": [nodes.len() - 1] }], "nodes": nodes, "meshes": meshes,
        "materials": scene.materials.iter().map(material).collect::<Vec<_>>(),
        "buffers": [{ "byteLength": bin.len() }], "bufferViews": views, "accessors": accessors,
    });
    if scene.materials.iter().any(is_glass) {
        root["extensionsUsed"] = json!(["KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_volume"]);
    }
    container(root.to_string().into_bytes(), bin)
}

fn mesh(mesh: &Mesh, bin: &mut Vec<u8>, views: &mut Vec<Value>, accessors: &mut Vec<Value>) -> Value {
    let mut add = |bytes: &mut dyn Iterator<Item = [u8; 4]>, target: u32, mut accessor: Value| {
        let offset = bin.len();
        bin.extend(bytes.flatten());
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bin.len() - offset, "target": target }));
        accessor["bufferView"] = json!(views.len() - 1);
        accessors.push(accessor);
        accessors.len() - 1
    };
    let (lo, hi) = mesh.positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let positions = add(
        &mut mesh.positions.iter().flat_map(|p| p.to_array()).map(f32::to_le_bytes),
        VERTICES,
        json!({
            "componentType": FLOAT, "count": mesh.positions.len(), "type": "VEC3",
            "min": lo.to_array(), "max": hi.to_array(),
        }),
    );
    let indices = add(
        &mut mesh.triangles.iter().flatten().map(|i| i.to_le_bytes()),
        INDICES,
        json!({ "componentType": UNSIGNED_INT, "count": mesh.triangles.len() * 3, "type": "SCALAR" }),
    );
    json!({
        "name": mesh.name,
        "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices, "material": mesh.material }],
    })
}

fn node(instance: &Instance) -> Value {
    let mut node = json!({ "name": instance.name, "mesh": instance.mesh });
    if instance.world_from_object != DAffine3::IDENTITY {
        node["matrix"] = json!(columns(&instance.world_from_object));
    }
    node
}

fn columns(a: &DAffine3) -> Vec<f64> {
    let columns = [a.matrix3.x_axis, a.matrix3.y_axis, a.matrix3.z_axis, a.translation];
    let last = [0.0, 0.0, 0.0, 1.0];
    columns.iter().zip(last).flat_map(|(c, w)| [c.x, c.y, c.z, w]).collect()
}

fn is_glass(material: &Material) -> bool {
    matches!(&material.reflection, Reflection::MetalRough(s) if s.transmission > 0.0)
}

fn material(material: &Material) -> Value {
    let color = material.base_color;
    let mut value = json!({
        "name": material.name, "doubleSided": material.double_sided,
        "pbrMetallicRoughness": { "baseColorFactor": [color.x, color.y, color.z, 1.0] },
    });
    if let Reflection::MetalRough(surface) = &material.reflection {
        value["pbrMetallicRoughness"]["metallicFactor"] = json!(surface.metallic);
        value["pbrMetallicRoughness"]["roughnessFactor"] = json!(surface.roughness);
        if is_glass(material) {
            let mut extensions = Map::new();
            extensions
                .insert("KHR_materials_transmission".into(), json!({ "transmissionFactor": surface.transmission }));
            extensions.insert("KHR_materials_ior".into(), json!({ "ior": surface.ior }));
            let thickness = if surface.thick { 1.0 } else { 0.0 };
            extensions.insert("KHR_materials_volume".into(), json!({ "thicknessFactor": thickness }));
            value["extensions"] = Value::Object(extensions);
        }
    }
    value
}

/// Assembles the header, the JSON chunk and the binary chunk, each padded to four bytes.
fn container(mut json: Vec<u8>, mut bin: Vec<u8>) -> Result<Vec<u8>, TooLarge> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + bin.len();
    let word = |n: usize| u32::try_from(n).map(u32::to_le_bytes).map_err(|_| TooLarge(total));
    let mut out = Vec::with_capacity(total);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(word(total)?);
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", bin)] {
        out.extend(word(chunk.len())?);
        out.extend(kind);
        out.extend(chunk);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{Family, triangles};
    use crate::load::{LoadOptions, load_bytes};

    #[test]
    fn instances_and_glass_are_read_back() {
        for family in Family::ALL {
            let scene = family.scene(600);
            let loaded = load_bytes("a.glb".as_ref(), bytes(&scene).unwrap(), &LoadOptions::default()).unwrap();
            assert_eq!(triangles(&loaded.scene), triangles(&scene), "{family}");
            assert_eq!(loaded.scene.instances.len(), scene.instances.len(), "{family}");
            assert_eq!(loaded.scene.materials.iter().any(is_glass), family == Family::Mountain);
            let read = loaded.scene.instances.last().unwrap().world_from_object;
            let was = scene.up.turned_to(UpAxis::Y) * scene.instances.last().unwrap().world_from_object;
            assert!(read.abs_diff_eq(was, 1e-6), "{family}: {read:?} {was:?}");
        }
    }
}
