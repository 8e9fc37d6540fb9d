//! Files with a hundred thousand of everything, on which quadratic algorithms would never end.

use super::*;

const MANY: usize = 100_000;

/// A list of `MANY` JSON values.
fn all(one: impl Fn(usize) -> Value) -> Value {
    (0..MANY).map(one).collect()
}

#[test]
fn meshes_materials_and_shapes_of_nodes_are_each_found_again() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.set("materials", all(|_| json!({})));
    let primitive = |i: usize| json!({"attributes": {"POSITION": positions}, "material": i});
    file.set("meshes", all(|i| json!({"primitives": [primitive(i)], "weights": [0]})));
    // Every second node has the shape of the one before, with explicit weights.
    let weights = |i: usize| json!({"mesh": i - i % 2, "weights": [0]});
    file.set("nodes", all(|i| if i % 2 == 0 { json!({"mesh": i}) } else { weights(i) }));
    file.set("scenes", json!([{"nodes": all(|i| json!(i))}]));
    let loaded = file.load();
    assert_eq!((loaded.scene.meshes.len(), loaded.scene.materials.len()), (MANY / 2, MANY / 2));
    let meshes: Vec<u32> = loaded.scene.instances.iter().map(|instance| instance.mesh).collect();
    assert!((0..MANY as u32).map(|i| i / 2).eq(meshes));
    assert_eq!(codes(&loaded), ["gltf-mesh-invalid-weights-count", "gltf-node-weights-invalid"]);
}

#[test]
fn one_mesh_in_many_nodes_is_not_looked_at_each_time() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let primitives = all(|_| json!({"attributes": {"POSITION": positions, "JOINTS_0": joints}}));
    file.set("meshes", json!([{"primitives": primitives, "weights": all(|_| json!(0))}]));
    file.set("nodes", all(|i| if i == 0 { json!({"mesh": 0}) } else { json!({"mesh": 0, "skin": 0}) }));
    file.set("skins", json!([{"joints": [0]}]));
    let loaded = file.load();
    assert_eq!(loaded.scene.instances.len(), MANY);
}

#[test]
fn skins_of_a_deep_hierarchy_find_their_common_root() {
    let mut file = Builder::new();
    file.set("nodes", all(|i| if i == 0 { json!({}) } else { json!({"children": [i - 1]}) }));
    file.set("scenes", json!([{"nodes": [MANY - 1]}]));
    file.set("skins", all(|i| json!({"joints": [0, i], "skeleton": MANY / 2})));
    let loaded = file.load();
    let told: Vec<_> = loaded.warnings.iter().map(|w| (w.code, w.place.as_str(), w.count as usize)).collect();
    // Skin 0 lists its joint twice; from the middle on, the skeleton is below a joint.
    let above = format!("skins[{}].skeleton", MANY / 2 + 1);
    assert_eq!(
        told,
        [
            ("gltf-duplicate-elements", "skins[0].joints[1]", 1),
            ("gltf-skin-skeleton-invalid", above.as_str(), MANY / 2 - 1)
        ]
    );
}

#[test]
fn one_warning_for_each_kind_names_the_first_place_and_the_number() {
    let mut file = Builder::new();
    file.set("nodes", all(|i| json!({"rotation": [0, 0, 0, 1.0 / (i + 2) as f64], "extensions": {"UNKNOWN": {}}})));
    file.set("extensionsUsed", all(|i| json!(format!("MANY_{i}"))));
    let lines: Vec<String> = file.load().warnings.iter().map(ToString::to_string).collect();
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert!(
        lines[1].contains("nodes[0].extensions.UNKNOWN: 'UNKNOWN' is not in extensionsUsed (×100000)"),
        "{lines:?}"
    );
    assert!(lines[2].contains("nodes[0].rotation: the rotation has length 0.500000, not 1 (×100000)"), "{lines:?}");
}

#[test]
fn pairs_of_nodes_in_loops_are_all_refused_at_once() {
    let mut file = Builder::new();
    file.set("nodes", all(|i| json!({"children": [i ^ 1]})));
    file.set("scenes", json!([{}]));
    let told = "a.gltf:nodes[0]: the node is its own ancestor (×50000); take it out of the children of what it holds";
    assert_eq!(file.fault(), told);
}

#[test]
fn copies_of_a_large_mesh_are_refused_before_memory_is_taken() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let places = file.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 100_000_000}));
    let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing"]));
    file.set("nodes", json!([{"mesh": 0, "extensions": copies}]));
    assert!(file.fault().contains("too large"), "{}", file.fault());

    let mut file = Builder::new();
    let positions = file.triangle();
    file.set("meshes", json!([{"primitives": all(|_| json!({"attributes": {"POSITION": positions}}))}]));
    file.set("nodes", all(|_| json!({"mesh": 0})));
    file.set("scenes", json!([{"nodes": all(|i| json!(i))}]));
    assert!(file.fault().contains("too large"), "{}", file.fault());
}

#[test]
fn a_mesh_in_more_places_than_its_triangles_have_numbers_for_is_refused() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let indices = file.shorts(&[0, 1, 2].repeat(MANY));
    file.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing"]));
    let mut copies = |count: usize| {
        let places = file.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": count}));
        let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
        file.set("nodes", json!([{"mesh": 0, "extensions": copies}]));
        load_bytes(Path::new("a.gltf"), file.gltf(), &LoadOptions::default())
    };
    let most = u32::MAX as usize / MANY;
    assert_eq!(copies(most).expect("there are numbers for so many").scene.prims(), (most * MANY) as u64);
    let Err(LoadError::Input(faults)) = copies(most + 1) else { panic!("there are no numbers for so many") };
    assert_eq!(
        faults.iter().map(ToString::to_string).collect::<Vec<_>>(),
        ["a.gltf: its 42950 instances show 4295000000 triangles and other prims where 4294967294 can be told apart; \
             show fewer of them, or meshes with fewer faces"]
    );
}

#[test]
fn bounds_of_accessors_that_lie_over_each_other_are_compared_for_some_of_them() {
    let mut file = Builder::new();
    file.floats("VEC3", &[0.0; 9000]);
    let accessor = json!({"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3000, "min": [1, 0, 0]});
    file.set("accessors", all(|_| accessor.clone()));
    file.set("nodes", json!([]));
    file.set("scenes", json!([]));
    file.root.as_object_mut().unwrap().remove("scene");
    let loaded = file.load();
    let compared: u32 = loaded.warnings.iter().map(|warning| warning.count).sum();
    // Twice the buffer and 2²⁸ bytes, out of 3.6·10⁹.
    assert_eq!(compared, ((1 << 28) + 2 * 36_000) / 36_000);
}
