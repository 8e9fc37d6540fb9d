//! Morph targets: what their sums give, and what is told of those that cannot be used.

use super::*;

/// A triangle whose normals are +z, with these targets and weights.
fn morphing(targets: impl FnOnce(&mut Builder) -> Value, weights: &[f32]) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    let normals = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    let targets = targets(&mut file);
    let primitive = json!({"attributes": {"POSITION": positions, "NORMAL": normals}, "targets": targets});
    file.set("meshes", json!([{"primitives": [primitive], "weights": weights}]));
    file.load()
}

#[test]
fn normals_of_several_targets_are_added_up_before_they_are_made_unit() {
    // 0.4 of each: what they take to the sides cancels out.
    let sides = |file: &mut Builder, order: [f32; 2]| {
        let target = |x: f32| [x, 0., -1., x, 0., -1., x, 0., -1.];
        Value::from_iter(order.map(|x| json!({"NORMAL": file.floats("VEC3", &target(x))})))
    };
    for order in [[-1.0, 1.0], [1.0, -1.0]] {
        let loaded = morphing(|file| sides(file, order), &[0.4, 0.4]);
        assert!(loaded.scene.meshes[0].normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6), "{:?}", loaded.scene.meshes);
        assert_eq!(codes(&loaded), [""; 0]);
    }
}

#[test]
fn of_a_target_that_changes_what_the_primitive_has_not_only_that_is_left_out() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let up = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    let targets = json!([{"POSITION": up, "NORMAL": up}]);
    let primitive = json!({"attributes": {"POSITION": positions}, "targets": targets});
    let loaded = file.set("meshes", json!([{"primitives": [primitive], "weights": [1]}])).load();
    assert_eq!(loaded.scene.meshes[0].positions[0].z, 1.0);
    assert_eq!(codes(&loaded), ["gltf-mesh-primitive-morph-target-no-base-accessor"]);
    let told = loaded.warnings.iter().map(ToString::to_string).find(|told| told.contains("NORMAL")).unwrap();
    assert!(told.ends_with("; that attribute of the target is left out"), "{told}");
}

#[test]
fn targets_that_move_texture_coordinates_in_vain_are_told_where_they_have_a_weight() {
    let told = |weights: &[f32], node: Option<&[f32]>| {
        let mut file = Builder::new();
        let (positions, uvs) = (file.triangle(), file.floats("VEC2", &[0.5; 6]));
        let attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
        let primitive = json!({"attributes": attributes, "targets": [{"POSITION": positions}, {"TEXCOORD_0": uvs}]});
        file.set("meshes", json!([{"primitives": [primitive], "weights": weights}]));
        if let Some(weights) = node {
            file.root["nodes"][0]["weights"] = json!(weights);
        }
        let warnings = file.load().warnings;
        warnings.iter().filter(|w| w.code == "gltf-morph-unsupported").map(ToString::to_string).collect::<Vec<_>>()
    };
    let text =
        "a.gltf:meshes[0].primitives[0].targets[1].TEXCOORD_0: morphing of TEXCOORD_0 is not drawn; it stays as it is";
    assert_eq!(told(&[0., 0.5], None), [text]);
    assert_eq!(told(&[0., 0.], Some(&[0., 1.])), [text]);
    assert_eq!(told(&[1., 0.], None), [""; 0]);
}
