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
