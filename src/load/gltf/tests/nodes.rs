//! Placement by nodes: scenes, skins, copies, visibility.

use super::*;
use crate::scene::Instance;

#[test]
fn nodes_place_meshes_cameras_and_lights() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set(
        "nodes",
        json!([
            {"children": [1, 2, 3], "translation": [10, 0, 0], "scale": [2, 2, 2]},
            {"mesh": 0, "name": "mirrored", "scale": [-1, 1, 1]},
            {"camera": 0, "name": "front", "translation": [0, 0, 3]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [-0.6, 0, 0, 0.8]},
        ]),
    );
    file.set("cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 2}}]));
    file.set("extensionsUsed", json!(["KHR_lights_punctual"]));
    file.set(
        "extensions",
        json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "color": [1, 0.5, 0], "intensity": 4, "range": 9, "spot": {"outerConeAngle": 0.3}}]}}),
    );
    let scene = file.load().scene;
    let instance = &scene.instances[0];
    assert_eq!(instance.name, "mirrored");
    assert_eq!(instance.world_from_object.transform_point3(DVec3::X), DVec3::new(8.0, 0.0, 0.0));
    assert_eq!(scene.cameras[0].name, "front");
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { y_fov: 0.5, aspect: Some(2.0) });
    assert_eq!(scene.cameras[0].world_from_camera.translation, DVec3::new(10.0, 0.0, 6.0));
    assert_eq!(scene.cameras[0].world_from_camera.matrix3.determinant(), 1.0);
    assert_eq!(scene.lights[0].intensity, Vec3::new(4.0, 2.0, 0.0));
    let LightKind::Spot { direction, inner, outer, falloff, .. } = scene.lights[0].kind else { panic!() };
    let expected = DVec3::new(0.0, -0.96, -0.28);
    assert!((direction - expected).length() < 1e-12, "a light shines along its −z");
    assert!(inner == 0.0 && (outer - 0.3).abs() < 1e-6);
    assert_eq!(falloff, Falloff::InverseSquare { range: 9.0 });
}

#[test]
fn a_scene_is_chosen_by_index_or_name_and_without_scenes_all_roots_show() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("nodes", json!([{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}]));
    file.set("scenes", json!([{"nodes": [0]}, {"nodes": [1], "name": "second"}]));
    let shown = |wish: Option<&str>| {
        let options = LoadOptions { scene: wish.map(Into::into), ..LoadOptions::default() };
        let loaded = load_bytes(Path::new("a.gltf"), file.gltf(), &options);
        loaded.map(|l| (l.scene.instances[0].name.clone(), l.facts.scene_index)).map_err(|e| e.to_string())
    };
    assert_eq!(shown(None), Ok(("a".into(), 0)));
    assert_eq!(shown(Some("1")), Ok(("b".into(), 1)));
    assert_eq!(shown(Some("second")), Ok(("b".into(), 1)));
    assert_eq!(
        shown(Some("third")),
        Err("a.gltf:scenes: there is no scene 'third'; it has number 0, 1 'second'".to_string())
    );
    file.set("scenes", json!([{"nodes": [0], "name": "same"}, {"nodes": [1], "name": "same"}]));
    let shown = |wish: &str| {
        let options = LoadOptions { scene: Some(wish.into()), ..LoadOptions::default() };
        let loaded = load_bytes(Path::new("a.gltf"), file.gltf(), &options);
        loaded.map(|l| l.facts.scene_index).map_err(|e| e.to_string())
    };
    let text = "a.gltf:scenes: 2 scenes are called 'same'; name one by its number: 0, 1";
    assert_eq!((shown("same"), shown("1")), (Err(text.into()), Ok(1)));
    let mut file = file;
    file.root.as_object_mut().unwrap().remove("scenes");
    file.root.as_object_mut().unwrap().remove("scene");
    assert_eq!(file.load().scene.instances.len(), 2);
}

#[test]
fn morph_weights_of_the_node_come_before_those_of_the_mesh() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let target = file.floats("VEC3", &[0., 0., 2., 0., 0., 2., 0., 0., 2.]);
    file.set(
        "meshes",
        json!([{
        "primitives": [{"attributes": {"POSITION": positions}, "targets": [{"POSITION": target}]}], "weights": [0.5]}]),
    );
    file.set("nodes", json!([{"mesh": 0}, {"mesh": 0, "weights": [1]}, {"mesh": 0}]));
    file.set("scenes", json!([{"nodes": [0, 1, 2]}]));
    let scene = file.load().scene;
    assert_eq!(scene.meshes.len(), 2, "equal shapes are read once");
    let height = |i: usize| scene.meshes[scene.instances[i].mesh as usize].positions[0].z;
    assert_eq!([height(0), height(1), height(2)], [1.0, 2.0, 1.0]);
}

#[test]
fn a_skinned_mesh_stands_where_its_joints_put_it() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]);
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let mut moved = identity;
    moved[12] = -1.0;
    let inverse = file.floats("MAT4", &[identity, moved].concat());
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set(
        "nodes",
        json!([{"mesh": 0, "skin": 0, "translation": [99, 99, 99]}, {"children": [2]}, {"translation": [1, 0, 5]}]),
    );
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    file.set("skins", json!([{"joints": [1, 2], "inverseBindMatrices": inverse}]));
    let scene = file.load().scene;
    let place =
        |i: usize| scene.instances[0].world_from_object.transform_point3(scene.meshes[0].positions[i].as_dvec3());
    assert_eq!([place(0), place(1), place(2)], [DVec3::ZERO, DVec3::new(1.0, 0.0, 5.0), DVec3::Y]);
}

#[test]
fn a_mirrored_node_leaves_its_mesh_alone_and_mirroring_joints_turn_theirs() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set("nodes", json!([{"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 0, "skin": 0}, {"scale": [-1, 1, 1]}]));
    file.set("skins", json!([{"joints": [2]}]));
    file.set("scenes", json!([{"nodes": [0, 1, 2]}]));
    let scene = file.load().scene;
    let determinant = |i: usize| scene.instances[i].world_from_object.matrix3.determinant();
    assert_eq!((determinant(0), determinant(1)), (-1.0, 1.0));
    assert_eq!((&scene.meshes[0].triangles[..], &scene.meshes[1].triangles[..]), (&[[0, 1, 2]][..], &[[0, 2, 1]][..]));
}

#[test]
fn what_primitives_of_a_skin_share_is_at_one_place() {
    // A narrow and a wide triangle with two common corners, rotated by a joint.
    let mut file = Builder::new();
    let shared = [0.1, 0.0, 0.0, 0.3, 0.7, 0.0];
    let narrow = file.floats("VEC3", &[&shared[..], &[0.2, 0.4, 0.05]].concat());
    let wide = file.floats("VEC3", &[&shared[..], &[9.0, 0.3, 0.7]].concat());
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    let primitive =
        |positions| json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}});
    file.set("meshes", json!([{"primitives": [primitive(narrow), primitive(wide)]}]));
    let turned = json!({"rotation": [0.36, 0.48, 0, 0.8], "translation": [0.7, 0.1, 0.3]});
    file.set("nodes", json!([{"mesh": 0, "skin": 0}, turned]));
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    file.set("skins", json!([{"joints": [1]}]));
    let scene = file.load().scene;
    let place = |i: usize, corner: usize| {
        let Instance { mesh, world_from_object, .. } = &scene.instances[i];
        world_from_object.transform_point3(scene.meshes[*mesh as usize].positions[corner].as_dvec3())
    };
    assert_eq!([place(0, 0), place(0, 1)], [place(1, 0), place(1, 1)]);
    assert!(scene.instances.len() == 2 && place(0, 2).distance(place(1, 2)) > 5.0);
}

#[test]
fn declared_bounds_do_not_coarsen_the_positions_of_a_skin() {
    let corners = [[1111_u16, 2222, 3333], [40_000, 2222, 3333], [1111, 50_000, 3333]];
    for (normalized, most) in [(true, [40_000.0, 50_000.0, 3333.0]), (false, [1e9; 3])] {
        let mut file = Builder::new();
        let shorts: Vec<u8> = corners.iter().flat_map(|&[x, y, z]| [x, y, z, 0]).flat_map(u16::to_le_bytes).collect();
        let floats: Vec<f32> = corners.iter().flatten().map(|&c| f32::from(c) / 65535.0).collect();
        let positions = if normalized {
            let view = file.view(&shorts, &[("byteStride", json!(8))]);
            let accessor = json!({"bufferView": view, "componentType": 5123, "type": "VEC3", "count": 3});
            file.push("accessors", accessor)
        } else {
            file.floats("VEC3", &floats)
        };
        let accessor = &mut file.root["accessors"][positions];
        (accessor["normalized"], accessor["min"], accessor["max"]) = (json!(normalized), json!([0, 0, 0]), json!(most));
        let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
        let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
        file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
        file.set("nodes", json!([{"mesh": 0, "skin": 0}, {}]));
        file.set("scenes", json!([{"nodes": [0, 1]}]));
        file.set("skins", json!([{"joints": [1]}]));
        file.set("extensionsUsed", json!(["KHR_mesh_quantization"]));
        file.set("extensionsRequired", json!(["KHR_mesh_quantization"]));
        let scene = file.load().scene;
        for (position, corner) in scene.meshes[0].positions.iter().zip(floats.chunks(3)) {
            let place = scene.instances[0].world_from_object.transform_point3(position.as_dvec3());
            assert!(place.distance(Vec3::from_slice(corner).as_dvec3()) < 1e-7, "{normalized}: {place} {corner:?}");
        }
    }
}

#[test]
fn a_skin_whose_joints_are_not_in_the_scene_is_drawn_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[1., 0., 0., 0.].repeat(3));
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set("nodes", json!([{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [1, 0, 5]}]));
    file.set("skins", json!([{"joints": [2]}]));
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    assert!(codes(&file.load()).is_empty());
    file.set("scenes", json!([{"nodes": [0]}, {"nodes": [0, 1]}]));
    let loaded = file.load();
    assert_eq!(codes(&loaded), ["gltf-node-skin-no-scene"]);
    assert_eq!(loaded.scene.instances[0].world_from_object.translation.z, 5.0);
}

#[test]
fn instances_of_the_gpu_and_hidden_nodes_are_understood() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let places = file.floats("VEC3", &[1., 0., 0., 2., 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing", "KHR_node_visibility"]));
    file.set(
        "nodes",
        json!([
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}},
            {"children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}},
            {"mesh": 0},
        ]),
    );
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    let scene = file.load().scene;
    let places: Vec<f64> = scene.instances.iter().map(|i| i.world_from_object.translation.x).collect();
    assert_eq!(places, [1.0, 2.0]);
}

#[test]
fn nodes_and_copies_scaled_to_nothing_are_hidden_as_invisible_ones_are() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let sizes = file.floats("VEC3", &[0., 0., 0., 1., 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "material": 0}));
    file.set("materials", json!([{"name": "hidden"}]));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing", "KHR_node_visibility"]));
    let scaled = json!({"children": [1], "scale": [0, 0, -0.0], "translation": [1e6, 0, 0]});
    let child = json!({"mesh": 0, "translation": [0, 5, 0]});
    let copies = json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": sizes}}}});
    file.set("nodes", json!([scaled, child, copies]));
    file.set("scenes", json!([{"nodes": [0, 2]}]));
    let loaded = file.load();
    let places: Vec<_> = loaded.scene.instances.iter().map(|i| i.world_from_object.matrix3.x_axis).collect();
    assert_eq!((places, loaded.facts.faces), (vec![DVec3::X], 1), "a flat one is there");

    let mut hidden = |nodes: Value| {
        file.set("nodes", nodes).set("scenes", json!([{"nodes": [0]}]));
        let Loaded { scene, facts, warnings } = file.load();
        let counts = [scene.meshes.len(), scene.instances.len(), scene.materials.len()];
        (counts, facts.faces, warnings.iter().map(ToString::to_string).collect::<Vec<_>>())
    };
    let invisible = json!({"children": [1], "extensions": {"KHR_node_visibility": {"visible": false}}});
    let nothing = hidden(json!([scaled, child]));
    assert_eq!(nothing, hidden(json!([invisible, child])));
    assert_eq!((nothing.0, nothing.1), ([0; 3], 0));
}

#[test]
fn copies_without_one_of_their_attributes_are_left_out_with_a_warning() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let places = file.floats("VEC3", &[1., 0., 0., 2., 0., 0., 3., 0., 0.]);
    let sizes = file.floats("VEC3", &[1., 1., 1., 2., 2., 2.]);
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("extensionsUsed", json!(["EXT_mesh_gpu_instancing"]));
    let attributes = json!({"TRANSLATION": places, "SCALE": sizes});
    file.set("nodes", json!([{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}]));
    file.set("scenes", json!([{"nodes": [0]}]));
    let loaded = file.load();
    assert_eq!(loaded.scene.instances.len(), 2);
    let place = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes";
    let warning = loaded.warnings.iter().find(|warning| warning.place == place).unwrap().to_string();
    assert!(warning.contains("TRANSLATION has 3, SCALE has 2; copies without one are left out"), "{warning}");
}

#[test]
fn avatars_face_back_before_vrm_1_and_as_others_do_from_then_on() {
    let faces_back = |extension: &str| {
        let mut file = Builder::new();
        let positions = file.triangle();
        file.primitive(json!({"attributes": {"POSITION": positions}}));
        file.set("extensionsUsed", json!([extension]));
        let loaded = file.load();
        assert!(loaded.warnings.iter().all(|w| !w.text.contains(extension)), "{:?}", loaded.warnings);
        loaded.scene.faces_back
    };
    assert_eq!(["VRM", "VRMC_vrm", "KHR_materials_unlit"].map(faces_back), [true, false, false]);
}
