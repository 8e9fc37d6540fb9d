//! Morph targets: their weighted sums, and warnings about unusable ones.

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
    // 0.4 of each: their sideways parts cancel out.
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

/// A triangle with this colour and these texture coordinates at all corners, which morph targets change.
fn painted(color: [f32; 4], uv: [f32; 2], targets: impl FnOnce(&mut Builder) -> Value, weights: &[f32]) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    let colors = file.floats("VEC4", &[color; 3].concat());
    let uvs = [(); 2].map(|()| file.floats("VEC2", &[uv; 3].concat()));
    let targets = targets(&mut file);
    let attributes = json!({"POSITION": positions, "COLOR_0": colors, "TEXCOORD_0": uvs[0], "TEXCOORD_1": uvs[1]});
    let primitive = json!({"attributes": attributes, "targets": targets, "material": 0});
    file.set("images", json!([{"uri": picture()}])).set("textures", json!([{"source": 0}]));
    file.set("materials", json!([{"emissiveTexture": {"index": 0, "texCoord": 1}}]));
    file.set("meshes", json!([{"primitives": [primitive], "weights": weights}])).load()
}

#[test]
fn targets_change_colours_and_texture_coordinates_as_far_as_they_have_weight() {
    let targets = |file: &mut Builder| {
        let colors = file.floats("VEC3", &[[-1.0, 0.0, 1.0]; 3].concat());
        let uvs = file.floats("VEC2", &[[0.5, -2.0]; 3].concat());
        let bytes: Vec<u8> = [[-127_i8, 127, 0, -127]; 3].concat().into_iter().map(i8::cast_unsigned).collect();
        let signed = file.accessor(&bytes, 5120, "VEC4", 3, true);
        json!([{"COLOR_0": colors}, {"TEXCOORD_1": uvs}, {"COLOR_0": signed}])
    };
    let shown = |weights: &[f32]| {
        let loaded = painted([1.0, 0.0, 0.0, 0.8], [0.25, 0.5], targets, weights);
        assert_eq!(codes(&loaded), [""; 0]);
        let mesh = &loaded.scene.meshes[0];
        assert!(mesh.colors.iter().all(|color| *color == mesh.colors[0]) && mesh.uvs[0].is_empty());
        (mesh.colors[0].to_array(), mesh.uvs[1][2].to_array())
    };
    assert_eq!(shown(&[0.0; 3]), ([1.0, 0.0, 0.0, 0.8], [0.25, 0.5]));
    assert_eq!(shown(&[0.5, 1.0, 0.0]), ([0.5, 0.0, 0.5, 0.8], [0.75, -1.5]));
    assert_eq!(shown(&[0.0, -0.5, 0.5]), ([0.5, 0.5, 0.0, 0.8 - 0.5], [0.0, 1.5]));
    assert_eq!(shown(&[2.0, 0.0, 0.5]), ([0.0, 0.5, 1.0, 0.8 - 0.5], [0.25, 0.5]), "colours end at 0 and 1");
}

#[test]
fn what_a_target_changes_of_attributes_that_are_not_there_is_told_and_left_out() {
    let loaded = morphing(
        |file| {
            let colors = file.floats("VEC3", &[1.0; 9]);
            let uvs = file.floats("VEC3", &[1.0; 9]);
            json!([{"COLOR_0": colors, "TEXCOORD_0": uvs}])
        },
        &[1.0],
    );
    let [format, missing] = ["attributes-accessor-invalid-format", "morph-target-no-base-accessor"];
    assert_eq!(codes(&loaded), [missing, missing, format].map(|code| format!("gltf-mesh-primitive-{code}")));
    assert!(loaded.scene.meshes[0].colors.is_empty());
}
