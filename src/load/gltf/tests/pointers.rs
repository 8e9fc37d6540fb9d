//! KHR_animation_pointer: targets that pointers may change, their interpolation, and invalid pointers.

use super::*;
use crate::load::Moment;

/// A triangle of a material with maps, with a camera and a light, and channels for pointers.
struct Pointing {
    file: Builder,
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Pointing {
    fn new() -> Self {
        let mut file = Builder::new();
        let positions = file.triangle();
        let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
        let up = file.floats("VEC3", &[0., 0., 1., 0., 0., 0., 0., 0., 0.]);
        let right = file.floats("VEC3", &[1., 0., 0., 0., 0., 0., 0., 0., 0.]);
        let attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
        file.primitive(
            json!({"attributes": attributes, "material": 0, "targets": [{"POSITION": up}, {"POSITION": right}]}),
        );
        file.set("images", json!([{"uri": picture()}]));
        file.set("textures", json!([{"source": 0}]));
        let extensions = [
            "KHR_animation_pointer",
            "KHR_lights_punctual",
            "KHR_texture_transform",
            "KHR_materials_clearcoat",
            "KHR_materials_emissive_strength",
            "KHR_node_visibility",
        ];
        file.set("extensionsUsed", json!(extensions));
        file.set(
            "materials",
            json!([{
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {}}}},
                "emissiveFactor": [1, 1, 1],
                "extensions": {"KHR_materials_emissive_strength": {},
                    "KHR_materials_clearcoat": {"clearcoatTexture": {"index": 0}}},
            }]),
        );
        file.set("cameras", json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]));
        file.set("extensions", json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}}));
        file.set(
            "nodes",
            json!([{"mesh": 0}, {"camera": 0, "children": [2]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}, "KHR_node_visibility": {}}}]),
        );
        file.set("scenes", json!([{"nodes": [0, 1]}]));
        Self { file, channels: Vec::new(), samplers: Vec::new() }
    }

    /// Adds a channel with keys at 0 s and 1 s.
    fn aim(&mut self, pointer: &str, kind: &str, values: &[f32]) -> &mut Self {
        let output = self.file.floats(kind, values);
        self.aim_at(pointer, output, "LINEAR")
    }

    fn aim_at(&mut self, pointer: &str, output: usize, interpolation: &str) -> &mut Self {
        let input = self.file.floats("SCALAR", &[0., 1.]);
        let extension = json!({"KHR_animation_pointer": {"pointer": pointer}});
        self.channels
            .push(json!({"sampler": self.samplers.len(), "target": {"path": "pointer", "extensions": extension}}));
        self.samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
        self
    }

    fn at(&mut self, time: f64) -> Loaded {
        self.file.set("animations", json!([{"channels": self.channels, "samplers": self.samplers}]));
        let options = LoadOptions { moment: Some(Moment { animation: None, time }), ..LoadOptions::default() };
        load_bytes(Path::new("a.gltf"), self.file.gltf(), &options).unwrap()
    }
}

/// All warnings, joined, except those about missing bounds.
fn warning(loaded: &Loaded) -> String {
    let all = loaded.warnings.iter().filter(|w| !w.code.ends_with("without-bounds"));
    all.map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn numbers_of_materials_run_between_their_keys() {
    let mut file = Pointing::new();
    file.aim("/materials/0/pbrMetallicRoughness/baseColorFactor", "VEC4", &[0., 0., 0., 1., 1., 0.5, 0., 0.]);
    file.aim("/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", &[0., 1.]);
    file.aim("/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", "SCALAR", &[0., 8.]);
    file.aim("/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor", "SCALAR", &[0., 1.]);
    let moved = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset";
    file.aim(moved, "VEC2", &[0., 0., 1., -2.]);
    let loaded = file.at(0.5);
    let material = &loaded.scene.materials[0];
    assert_eq!((material.base_color, material.opacity), (Vec3::new(0.5, 0.25, 0.0), 0.5));
    assert_eq!(material.emission, Vec3::splat(4.0));
    assert_eq!(material.base_color_map.as_ref().unwrap().transform.offset, Vec2::new(0.5, -1.0));
    let surface = material.metal_rough().unwrap();
    assert_eq!((surface.metallic, surface.coat.as_ref().unwrap().strength), (0.5, 0.5));
    assert!(loaded.facts.changes_materials && warning(&loaded).is_empty(), "{}", warning(&loaded));
    assert!(file.at(0.0).scene.materials[0].metal_rough().unwrap().coat.is_none(), "no coat, no map of it");
    let still = load(&file.file.gltf());
    assert_eq!((still.scene.materials[0].base_color, still.facts.changes_materials), (Vec3::ONE, false));
}

#[test]
fn cameras_and_lamps_change_and_need_no_other_pictures() {
    let mut file = Pointing::new();
    file.aim("/cameras/0/perspective/yfov", "SCALAR", &[0.5, 1.5]);
    file.aim("/extensions/KHR_lights_punctual/lights/0/color", "VEC3", &[0., 0., 0., 1., 0.5, 0.]);
    file.aim("/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", &[0., 8.]);
    file.aim("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", "SCALAR", &[0.5, 1.0]);
    let loaded = file.at(0.5);
    assert_eq!(loaded.scene.cameras[0].projection, Projection::Perspective { y_fov: 1.0, aspect: None });
    let light = &loaded.scene.lights[0];
    assert_eq!(light.intensity, Vec3::new(2.0, 1.0, 0.0));
    assert!(matches!(light.kind, LightKind::Spot { outer, .. } if outer == 0.75), "{light:?}");
    assert!(!loaded.facts.changes_materials && warning(&loaded).is_empty(), "{}", warning(&loaded));
}

#[test]
fn places_of_nodes_may_be_pointed_at_like_anything_else() {
    let mut file = Pointing::new();
    file.aim("/nodes/0/translation", "VEC3", &[0., 0., 0., 2., 0., 0.]);
    let half = 0.5f32.sqrt();
    file.aim("/nodes/0/rotation", "VEC4", &[0., 0., 0., 1., 0., 0., half, half]);
    let loaded = file.at(1.0);
    let point = loaded.scene.instances[0].world_from_object.transform_point3(DVec3::X);
    assert!((point - DVec3::new(2.0, 1.0, 0.0)).length() < 1e-6, "{point}");
    assert!(!loaded.facts.changes_materials);
}

#[test]
fn integers_stand_for_themselves_unless_they_are_normalized() {
    for (normalized, middle) in [(false, 100.0), (true, 100.0 / 255.0)] {
        let mut file = Pointing::new();
        let output = file.file.accessor(&[0, 0, 0, 0, 200, 0, 0, 0], 5121, "SCALAR", 2, normalized);
        // Elements of one byte, packed.
        file.file.root["accessors"][output]["count"] = json!(2);
        let view = file.file.view(&[0, 200], &[]);
        file.file.root["accessors"][output]["bufferView"] = json!(view);
        file.aim_at("/extensions/KHR_lights_punctual/lights/0/intensity", output, "LINEAR");
        let intensity = file.at(0.5).scene.lights[0].intensity.x;
        assert!((intensity - middle).abs() < 1e-5, "{intensity}");
    }
}

/// Animates the visibility of node 1, with its camera, or of node 2, with its light: hidden before 1 s.
fn switching(node: usize, interpolation: &str, normalized: bool) -> Pointing {
    let mut file = Pointing::new();
    file.file.root["nodes"][1]["extensions"] = json!({"KHR_node_visibility": {}});
    let view = file.file.view(&[0, 1], &[]);
    let accessor =
        json!({"bufferView": view, "componentType": 5121, "type": "SCALAR", "count": 2, "normalized": normalized});
    let output = file.file.push("accessors", accessor);
    file.aim_at(&format!("/nodes/{node}/extensions/KHR_node_visibility/visible"), output, interpolation);
    file
}

#[test]
fn visibility_is_switched_in_steps_and_what_was_no_step_is_told() {
    let lit = |loaded: &Loaded| (loaded.scene.lights[0].intensity != Vec3::ZERO, loaded.facts.changes_materials);
    let mut file = switching(2, "STEP", false);
    assert_eq!([0.9, 1.0].map(|time| lit(&file.at(time))), [(false, true), (true, true)]);
    assert!(warning(&file.at(0.9)).is_empty(), "{}", warning(&file.at(0.9)));
    let mut file = switching(2, "LINEAR", false);
    assert!(!lit(&file.at(0.9)).0);
    let text =
        "animations[0].samplers[0].interpolation: there is nothing between true and false; it is switched in steps";
    assert_eq!(warning(&file.at(0.9)), format!("a.gltf:{text}"));
    let text = "values must be single unsigned bytes that are not normalized; the channel is left out";
    assert!(warning(&switching(2, "STEP", true).at(1.0)).ends_with(text));
}

#[test]
fn what_is_switched_off_shows_no_mesh_keeps_its_camera_and_its_lamp_is_dark() {
    let mut file = switching(1, "STEP", false);
    file.file.root["nodes"][1]["mesh"] = json!(0);
    for (time, meshes) in [(0.5, 1), (1.0, 2)] {
        let scene = file.at(time).scene;
        assert_eq!((scene.instances.len(), scene.cameras.len(), scene.lights.len()), (meshes, 1, 1), "{time}");
        assert_eq!(scene.lights[0].intensity == Vec3::ZERO, time < 1.0);
    }
    // At rest, and if nothing switches it on, a hidden light does not exist.
    file.file.root["nodes"][1]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    let scene = load(&file.file.gltf()).scene;
    assert_eq!((scene.instances.len(), scene.cameras.len(), scene.lights.len()), (1, 1, 0));
}

#[test]
fn that_materials_change_is_said_at_every_moment_though_some_cannot_be_played() {
    let mut file = Pointing::new();
    let output = file.file.floats("SCALAR", &[f32::NAN, 0.5]);
    file.aim_at("/materials/0/pbrMetallicRoughness/metallicFactor", output, "STEP");
    let metallic = |loaded: &Loaded| loaded.scene.materials[0].metal_rough().unwrap().metallic;
    let (broken, whole) = (file.at(0.0), file.at(1.0));
    assert_eq!((metallic(&broken), metallic(&whole)), (1.0, 0.5));
    assert!(broken.facts.changes_materials && whole.facts.changes_materials);
}

#[test]
fn what_is_odd_about_a_channel_with_a_pointer_is_told() {
    let metallic = "/materials/0/pbrMetallicRoughness/metallicFactor";
    let change = |change: &dyn Fn(&mut Pointing)| {
        let mut file = Pointing::new();
        file.aim(metallic, "SCALAR", &[0., 0.]);
        change(&mut file);
        let loaded = file.at(0.5);
        (loaded.scene.materials[0].metal_rough().unwrap().metallic, warning(&loaded))
    };
    let (metallic, told) = change(&|file| file.channels[0]["target"]["node"] = json!(0));
    let place = "a.gltf:animations[0].channels[0].target";
    assert_eq!((metallic, told), (0.0, format!("{place}.node: a node beside a pointer; the pointer counts")));
    let (metallic, told) = change(&|file| file.channels[0]["target"]["extensions"] = json!({}));
    let why = "its path is 'pointer', and there is no pointer of KHR_animation_pointer; the channel is left out";
    assert_eq!((metallic, told), (1.0, format!("{place}: {why}")));
    let (metallic, told) = change(&|file| {
        file.channels[0]["target"]["extensions"]["KHR_animation_pointer"]["pointer"] =
            json!("/materials/0/extras/shine");
    });
    assert_eq!((metallic, told.as_str()), (1.0, ""), "what extras mean is for others to know");
    let (metallic, _) = change(&|file| {
        file.file.root["extensionsUsed"].as_array_mut().unwrap().retain(|e| e != "KHR_animation_pointer")
    });
    assert_eq!(metallic, 1.0, "what is not declared is not played");
}

#[test]
fn weights_one_by_one_take_the_memory_of_all_of_them_once() {
    let mut file = Pointing::new();
    let target = file.file.root["meshes"][0]["primitives"][0]["targets"][0].clone();
    file.file.root["meshes"][0]["primitives"][0]["targets"] = json!(vec![target; 2000]);
    let output = file.file.floats("SCALAR", &[0., 1.]);
    for k in 0..2000 {
        file.aim_at(&format!("/meshes/0/weights/{k}"), output, "LINEAR");
    }
    let channel = json!({"channels": file.channels, "samplers": file.samplers});
    file.file.set("animations", json!([channel]));
    // If each channel were charged, these weights would take 48 MB.
    let limits = Limits { memory: 40 << 20, ..Limits::default() };
    let options = LoadOptions { moment: Some(Moment { animation: None, time: 0.5 }), limits, ..LoadOptions::default() };
    let loaded = load_bytes(Path::new("a.gltf"), file.file.gltf(), &options).unwrap();
    let z = loaded.scene.meshes[0].positions[0].z + loaded.scene.instances[0].world_from_object.translation.z as f32;
    assert!((z - 1000.0).abs() < 1e-2, "{z}");
}

#[test]
fn weights_are_those_of_a_node_or_of_a_mesh_all_or_one() {
    let corner = |file: &mut Pointing, time: f64| file.at(time).scene.meshes[0].positions[0];
    let cases: [(&str, &[f32], [f32; 3]); 4] = [
        ("/meshes/0/weights", &[0., 0., 1., 0.5], [0.25, 0.0, 0.5]),
        ("/nodes/0/weights", &[0., 0., 1., 0.5], [0.25, 0.0, 0.5]),
        ("/meshes/0/weights/1", &[0., 1.], [0.5, 0.0, 1.0]),
        ("/nodes/0/weights/1", &[0., 1.], [0.5, 0.0, 1.0]),
    ];
    for (pointer, values, expected) in cases {
        let mut file = Pointing::new();
        file.file.root["meshes"][0]["weights"] = json!([1, 0]);
        file.aim(pointer, "SCALAR", values);
        let found = corner(&mut file, 0.5);
        let center = file.at(0.5).scene.instances[0].world_from_object.translation.as_vec3();
        assert!((found + center - Vec3::from(expected)).length() < 1e-6, "{pointer}: {found} {center}");
        assert!(warning(&file.at(0.5)).is_empty(), "{}", warning(&file.at(0.5)));
    }
    let mut file = Pointing::new();
    let text = "node 0 has 2 morph targets; the channel is left out";
    assert!(warning(&file.aim("/nodes/0/weights/2", "SCALAR", &[0., 1.]).at(0.0)).ends_with(text));
}

#[test]
fn values_beyond_what_is_allowed_are_told_unless_a_spline_swings_there() {
    let mut file = Pointing::new();
    file.aim("/materials/0/pbrMetallicRoughness/roughnessFactor", "SCALAR", &[0.5, 1.5]);
    let loaded = file.at(1.0);
    assert_eq!(loaded.scene.materials[0].metal_rough().unwrap().roughness, 1.0);
    let text =
        "a.gltf:animations[0].samplers[0].output: 1.5 where 0 to 1 is allowed; the nearest that is allowed is taken";
    assert_eq!(warning(&loaded), text);

    let mut file = Pointing::new();
    let output = file.file.floats("SCALAR", &[0., 1., 9., 9., 1., 0.]);
    file.aim_at("/materials/0/pbrMetallicRoughness/roughnessFactor", output, "CUBICSPLINE");
    let loaded = file.at(0.25);
    assert_eq!(loaded.scene.materials[0].metal_rough().unwrap().roughness, 1.0);
    assert!(warning(&loaded).is_empty(), "{}", warning(&loaded));
}

#[test]
fn pointers_to_what_is_not_there_or_cannot_change_leave_their_channel_out() {
    let cases = [
        ("materials/0/alphaCutoff", "is none: every step starts with a slash"),
        ("/materials/7/alphaCutoff", "leads to what the file does not have"),
        ("/materials/00/alphaCutoff", "leads to nothing that can be animated"),
        ("/materials/0/doubleSided", "leads to nothing that can be animated"),
        ("/materials/0/name", "leads to nothing that can be animated"),
        ("/materials/0/emissiveFactor/0", "leads to nothing that can be animated"),
        ("/materials/0/normalTexture/scale", "leads into what the file does not have"),
        ("/materials/0/extensions/KHR_materials_ior/ior", "leads into what the file does not have"),
        ("/materials/0/extensions/KHR_lights_punctual/lights", "leads to nothing that can be animated"),
        ("/nodes/0/matrix", "leads to nothing that can be animated"),
        ("/nodes/0/mesh", "leads to nothing that can be animated"),
        ("/accessors/0/min", "leads to nothing that can be animated"),
        ("/textures/0/sampler", "leads to nothing that can be animated"),
        ("/extensions", "leads to nothing that can be animated"),
        ("/nodes/0/extensions", "leads to nothing that can be animated"),
        ("/nodes/0/weights/0/0", "leads to nothing that can be animated"),
        ("", "is none: every step starts with a slash"),
        ("/", "leads to nothing that can be animated"),
    ];
    for (pointer, why) in cases {
        let mut file = Pointing::new();
        file.aim(pointer, "SCALAR", &[0., 1.]);
        file.aim("/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", &[0., 1.]);
        let loaded = file.at(0.5);
        let place = "a.gltf:animations[0].channels[0].target";
        assert_eq!(warning(&loaded), format!("{place}: the pointer '{pointer}' {why}; the channel is left out"));
        assert_eq!(loaded.scene.materials[0].metal_rough().unwrap().metallic, 0.5);
    }
}

#[test]
fn two_channels_for_one_thing_or_a_part_of_it_are_told() {
    let metallic = "/materials/0/pbrMetallicRoughness/metallicFactor";
    let pairs = [
        (metallic, metallic, "SCALAR"),
        ("/meshes/0/weights/0", "/meshes/0/weights", "SCALAR"),
        ("/meshes/0/weights", "/meshes/0/weights/1", "SCALAR"),
        ("/nodes/0/scale", "/nodes/0/scale", "VEC3"),
    ];
    for (first, second, kind) in pairs {
        let mut file = Pointing::new();
        let values = |pointer: &str| match kind {
            "VEC3" => vec![1.0; 6],
            _ if pointer.ends_with("weights") => vec![0.0; 4],
            _ => vec![0.0; 2],
        };
        file.aim(first, kind, &values(first)).aim(second, kind, &values(second));
        let loaded = file.at(0.5);
        assert_eq!(codes(&loaded), ["gltf-animation-duplicate-targets"], "{first} {second}");
    }
    let mut both = Pointing::new();
    both.aim("/meshes/0/weights/0", "SCALAR", &[0., 1.]).aim("/meshes/0/weights/1", "SCALAR", &[0., 1.]);
    assert!(warning(&both.at(0.5)).is_empty(), "parts of one list are no double");
}
