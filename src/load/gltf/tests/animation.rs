//! Animations at a moment: the affected properties, each interpolation, and the cost of broken ones.

use super::*;
use crate::load::{AnimationFacts, Moment};

const SHORT: u32 = 5122;
const BYTE: u32 = 5120;

/// A channel on node 0, with the accessors of its keys.
struct Keys<'a> {
    path: &'a str,
    interpolation: &'a str,
    input: usize,
    output: usize,
}

fn animate(file: &mut Builder, keys: &[Keys]) {
    let channel = |(k, keys): (usize, &Keys)| json!({"sampler": k, "target": {"node": 0, "path": keys.path}});
    let sampler =
        |keys: &Keys| json!({"input": keys.input, "output": keys.output, "interpolation": keys.interpolation});
    let channels: Vec<Value> = keys.iter().enumerate().map(channel).collect();
    let samplers: Vec<Value> = keys.iter().map(sampler).collect();
    file.set("animations", json!([{"name": "Wave", "channels": channels, "samplers": samplers}]));
}

/// A triangle whose node is animated by one channel with these times and values.
fn moving(path: &str, interpolation: &str, times: &[f32], kind: &str, values: &[f32]) -> Builder {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let (input, output) = (file.floats("SCALAR", times), file.floats(kind, values));
    animate(&mut file, &[Keys { path, interpolation, input, output }]);
    file
}

fn options(animation: Option<&str>, time: f64) -> LoadOptions {
    LoadOptions { moment: Some(Moment { animation: animation.map(Into::into), time }), ..LoadOptions::default() }
}

fn at(file: &Builder, time: f64) -> Loaded {
    load_bytes(Path::new("a.gltf"), file.gltf(), &options(None, time)).unwrap()
}

/// World position of a point of node 0.
fn point(loaded: &Loaded, p: DVec3) -> DVec3 {
    loaded.scene.instances[0].world_from_object.transform_point3(p)
}

fn assert_close(found: DVec3, expected: [f64; 3]) {
    assert!((found - DVec3::from(expected)).length() < 1e-6, "{found} where {expected:?} should be");
}

/// All warnings as text, except those about missing bounds of positions.
fn told(loaded: &Loaded) -> Vec<String> {
    let all = loaded.warnings.iter().filter(|w| w.code != "gltf-mesh-primitive-position-accessor-without-bounds");
    all.map(ToString::to_string).collect()
}

#[test]
fn a_translation_goes_by_its_interpolation_and_stays_at_the_ends() {
    let values = [0., 0., 0., 4., 0., 0., 4., 8., 0.];
    let linear = moving("translation", "LINEAR", &[1., 2., 4.], "VEC3", &values);
    for (time, x, y) in [(0.0, 0.0, 0.0), (1.25, 1.0, 0.0), (2.0, 4.0, 0.0), (3.0, 4.0, 4.0), (4.0, 4.0, 8.0)] {
        assert_close(point(&at(&linear, time), DVec3::ZERO), [x, y, 0.0]);
        assert_eq!(told(&at(&linear, time)), [""; 0]);
    }
    let step = moving("translation", "STEP", &[1., 2., 4.], "VEC3", &values);
    assert_close(point(&at(&step, 1.999), DVec3::ZERO), [0.0, 0.0, 0.0]);
    assert_close(point(&at(&step, 2.0), DVec3::ZERO), [4.0, 0.0, 0.0]);
    let still = load(&linear.gltf());
    assert_eq!((point(&still, DVec3::ZERO), still.facts.shown), (DVec3::ZERO, None));
}

#[test]
fn a_time_past_the_end_is_told_with_the_length_unless_rounding_put_it_there() {
    let file = moving("translation", "LINEAR", &[0., 41. / 24.], "VEC3", &[0., 0., 0., 1., 0., 0.]);
    assert_eq!(told(&at(&file, 41.0 / 24.0)), [""; 0]);
    let late = at(&file, 2.0);
    assert_close(point(&late, DVec3::ZERO), [1.0, 0.0, 0.0]);
    let text = "a.gltf:animations[0]: 2 s is past the end of animation 'Wave', which is 1.7083333730697632 s long; \
                drawn as at its end";
    assert_eq!(told(&late), [text]);
}

#[test]
fn a_spline_has_tangents_around_each_value() {
    // Keys 2 s apart, each as in-tangent, value, out-tangent; the middle is half of both values plus a quarter of the difference
    // of the inner tangents.
    let values = [[9., 9., 9.], [1., 0., 0.], [4., 2., 0.], [-2., 0., 0.], [3., 0., 0.], [9., 9., 9.]].concat();
    let file = moving("translation", "CUBICSPLINE", &[0., 2.], "VEC3", &values);
    assert_close(point(&at(&file, 1.0), DVec3::ZERO), [0.5 + 1.5 + 0.25 * 6.0, 0.25 * 2.0, 0.0]);
    assert_close(point(&at(&file, 0.0), DVec3::ZERO), [1.0, 0.0, 0.0]);
}

#[test]
fn rotation_and_scale_of_two_channels_meet_in_one_node() {
    let mut file = moving("scale", "LINEAR", &[0., 1.], "VEC3", &[1., 1., 1., 3., 1., 1.]);
    let half = 0.5f32.sqrt();
    let (input, output) =
        (file.floats("SCALAR", &[0., 1.]), file.floats("VEC4", &[0., 0., 0., 1., 0., 0., half, half]));
    animate(
        &mut file,
        &[
            Keys { path: "scale", interpolation: "LINEAR", input: 1, output: 2 },
            Keys { path: "rotation", interpolation: "LINEAR", input, output },
        ],
    );
    file.root["nodes"][0]["translation"] = json!([0, 0, 5]);
    // Half way: twice as long and rotated by 45°.
    assert_close(point(&at(&file, 0.5), DVec3::X), [2f64.sqrt(), 2f64.sqrt(), 5.0]);
    assert_close(point(&at(&file, 1.0), DVec3::X), [0.0, 3.0, 5.0]);
}

#[test]
fn rotations_may_be_normalised_integers() {
    let shorts: Vec<u8> = [0i16, 0, 0, 32767, 0, 0, 32767, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let bytes: Vec<u8> = [0i8, 0, 0, 127, 0, 0, 127, 0].iter().map(|v| v.to_le_bytes()[0]).collect();
    for (data, component) in [(shorts, SHORT), (bytes, BYTE)] {
        let mut file = moving("rotation", "LINEAR", &[0., 1.], "VEC4", &[0.; 8]);
        let output = file.accessor(&data, component, "VEC4", 2, true);
        animate(&mut file, &[Keys { path: "rotation", interpolation: "LINEAR", input: 1, output }]);
        assert_close(point(&at(&file, 0.5), DVec3::X), [0.0, 1.0, 0.0]);
        file.root["accessors"][output]["normalized"] = json!(false);
        let loaded = at(&file, 0.5);
        assert_close(point(&loaded, DVec3::X), [1.0, 0.0, 0.0]);
        assert_eq!(codes(&loaded), ["gltf-animation-sampler-output-accessor-invalid-format"]);
    }
}

/// A triangle with two morph targets, whose weights at rest are 0.
fn morphing(values: &[f32]) -> Builder {
    let mut file = Builder::new();
    let positions = file.triangle();
    let up = file.floats("VEC3", &[0., 0., 1., 0., 0., 0., 0., 0., 0.]);
    let right = file.floats("VEC3", &[1., 0., 0., 0., 0., 0., 0., 0., 0.]);
    file.primitive(json!({"attributes": {"POSITION": positions}, "targets": [{"POSITION": up}, {"POSITION": right}]}));
    let (input, output) = (file.floats("SCALAR", &[0., 1.]), file.floats("SCALAR", values));
    animate(&mut file, &[Keys { path: "weights", interpolation: "LINEAR", input, output }]);
    file
}

#[test]
fn weights_of_morph_targets_are_animated_together() {
    let file = morphing(&[0., 0., 1., 0.5]);
    let corner = |loaded: &Loaded| point(loaded, loaded.scene.meshes[0].positions[0].as_dvec3());
    assert_close(corner(&at(&file, 0.5)), [0.25, 0.0, 0.5]);
    assert_close(corner(&at(&file, 1.0)), [0.5, 0.0, 1.0]);
    assert_close(corner(&load(&file.gltf())), [0.0, 0.0, 0.0]);
    let loaded = at(&morphing(&[0., 1., 1.]), 0.5);
    assert_eq!(codes(&loaded), ["gltf-animation-sampler-output-accessor-invalid-count"]);
}

#[test]
fn joints_that_move_take_their_skin_along() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let joints = file.accessor(&[0; 12], 5121, "VEC4", 3, false);
    let weights = file.floats("VEC4", &[[1., 0., 0., 0.]; 3].concat());
    file.primitive(json!({"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}}));
    file.set("nodes", json!([{}, {"mesh": 0, "skin": 0}]));
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    file.set("skins", json!([{"joints": [0]}]));
    let (input, output) = (file.floats("SCALAR", &[0., 1.]), file.floats("VEC3", &[0., 0., 0., 0., 2., 0.]));
    animate(&mut file, &[Keys { path: "translation", interpolation: "LINEAR", input, output }]);
    let loaded = at(&file, 0.5);
    assert_close(point(&loaded, loaded.scene.meshes[0].positions[1].as_dvec3()), [1.0, 1.0, 0.0]);
}

#[test]
fn cameras_and_lamps_go_with_their_nodes() {
    let mut file = moving("translation", "LINEAR", &[0., 1.], "VEC3", &[0., 0., 0., 0., 4., 0.]);
    file.set("cameras", json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]));
    file.set("extensionsUsed", json!(["KHR_lights_punctual"]));
    file.set("extensions", json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}}));
    file.set(
        "nodes",
        json!([{"mesh": 0, "children": [1]}, {"translation": [1, 0, 0], "camera": 0,
        "extensions": {"KHR_lights_punctual": {"light": 0}}}]),
    );
    let scene = at(&file, 0.5).scene;
    assert_close(scene.cameras[0].world_from_camera.translation, [1.0, 2.0, 0.0]);
    let LightKind::Point { position, .. } = scene.lights[0].kind else { panic!("{:?}", scene.lights) };
    assert_close(position, [1.0, 2.0, 0.0]);
}

#[test]
fn values_may_be_replaced_by_sparse_ones() {
    let mut file = moving("translation", "LINEAR", &[0., 1., 2.], "VEC3", &[0.; 9]);
    let index = file.view(&2u16.to_le_bytes(), &[]);
    let value: Vec<u8> = [6f32, 0., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    let value = file.view(&value, &[]);
    file.root["accessors"][2]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": index, "componentType": 5123}, "values": {"bufferView": value}});
    for (time, x) in [(0.5, 0.0), (1.5, 3.0), (2.0, 6.0)] {
        assert_close(point(&at(&file, time), DVec3::ZERO), [x, 0.0, 0.0]);
    }
}

#[test]
fn a_broken_channel_is_left_out_and_said_and_the_others_go_on() {
    let nan = f32::NAN;
    let good = [0., 0., 0., 2., 0., 0.];
    let cases: [(&[f32], &str, &[f32], &str); 5] = [
        (&[1., 0.], "VEC3", &good, "time 1 (0 s) is before time 0 (1 s); channels with these times are left out"),
        (&[0., nan], "VEC3", &good, "time 1 is NaN; channels with these times are left out"),
        (&[0., 1.], "VEC3", &[0., 0., 0., nan, 0., 0.], "a value of key 1 is NaN; the channel is left out"),
        (&[0., 1., 2.], "VEC3", &good, "2 elements where 3 keys take 1 each; the channel is left out"),
        (&[0., 1.], "VEC4", &[0.; 8], "values must be three floats; the channel is left out"),
    ];
    for (times, kind, values, text) in cases {
        let mut file = moving("translation", "LINEAR", times, kind, values);
        let (input, output) = (file.floats("SCALAR", &[0., 1.]), file.floats("VEC3", &[1., 1., 1., 3., 3., 3.]));
        animate(
            &mut file,
            &[
                Keys { path: "translation", interpolation: "LINEAR", input: 1, output: 2 },
                Keys { path: "scale", interpolation: "LINEAR", input, output },
            ],
        );
        let loaded = at(&file, 0.5);
        assert_close(point(&loaded, DVec3::ONE), [2.0, 2.0, 2.0]);
        let lines = told(&loaded);
        assert!(lines.len() == 1 && lines[0].ends_with(text), "{lines:?}, not {text}");
        assert_eq!(told(&load(&file.gltf())), [""; 0], "a still reads no keys");
    }
}

#[test]
fn of_two_keys_at_one_time_the_later_counts() {
    let values = [0., 0., 0., 1., 0., 0., 5., 0., 0., 7., 0., 0.];
    let file = moving("translation", "LINEAR", &[0., 1., 1., 2.], "VEC3", &values);
    for (time, x) in [(0.5, 0.5), (1.0, 5.0), (1.5, 6.0)] {
        let loaded = at(&file, time);
        assert_close(point(&loaded, DVec3::ZERO), [x, 0.0, 0.0]);
        assert_eq!(codes(&loaded), ["gltf-accessor-animation-input-non-increasing"]);
    }
}

#[test]
fn what_cannot_be_aimed_at_is_said() {
    let linear = || moving("translation", "LINEAR", &[0., 1.], "VEC3", &[0., 0., 0., 2., 0., 0.]);
    let mut matrix = linear();
    matrix.root["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 0, 0, 1]);
    let loaded = at(&matrix, 1.0);
    assert_close(point(&loaded, DVec3::ZERO), [7.0, 0.0, 0.0]);
    assert_eq!(codes(&loaded), ["gltf-animation-channel-target-node-matrix"]);

    let weights = moving("weights", "LINEAR", &[0., 1.], "SCALAR", &[0., 1.]);
    assert_eq!(codes(&at(&weights, 1.0)), ["gltf-animation-channel-target-node-weights-no-morphs"]);

    let mut twice = linear();
    let keys = || Keys { path: "translation", interpolation: "LINEAR", input: 1, output: 2 };
    animate(&mut twice, &[keys(), keys()]);
    let loaded = at(&twice, 0.5);
    assert_close(point(&loaded, DVec3::ZERO), [1.0, 0.0, 0.0]);
    assert_eq!(codes(&loaded), ["gltf-animation-duplicate-targets"]);
}

#[test]
fn an_animation_is_found_by_name_or_number_and_others_are_listed() {
    let mut file = moving("translation", "LINEAR", &[0., 1.], "VEC3", &[0., 0., 0., 2., 0., 0.]);
    let named = |name: &str| load_bytes(Path::new("a.gltf"), file.gltf(), &options(Some(name), 1.0));
    assert_close(point(&named("Wave").unwrap(), DVec3::ZERO), [2.0, 0.0, 0.0]);
    assert_eq!(named("0").unwrap().facts.shown, Some((0, 1.0)));
    let fault = named("Run").unwrap_err().to_string();
    assert_eq!(fault, "a.gltf:animations: there is no animation 'Run'; it has 0 'Wave'");
    let loaded = load(&file.gltf());
    assert_eq!(loaded.facts.animations, [AnimationFacts { name: "Wave".into(), seconds: 1.0, channels: 1 }]);

    file.root.as_object_mut().unwrap().remove("animations");
    let none = |name: Option<&str>| load_bytes(Path::new("a.gltf"), file.gltf(), &options(name, 1.0));
    let fault = none(Some("Run")).unwrap_err().to_string();
    assert_eq!(fault, "a.gltf: there is no animation 'Run'; the file has none");
    assert_eq!(codes(&none(None).unwrap()), ["animation-none"]);
}

#[test]
fn times_that_need_more_memory_than_there_is_refuse_the_file() {
    let mut file = moving("translation", "STEP", &[0., 1.], "VEC3", &[0., 0., 0., 2., 0., 0.]);
    // Zeros need no bytes in the file.
    file.root["accessors"][1] = json!({"componentType": 5126, "type": "SCALAR", "count": 3_000_000_000u32});
    let limits = Limits { memory: 1 << 28, ..Limits::default() };
    let options = LoadOptions { limits, ..options(None, 0.0) };
    let fault = load_bytes(Path::new("a.gltf"), file.gltf(), &options).unwrap_err().to_string();
    assert!(fault.contains("too large") && fault.contains("--max-memory"), "{fault}");
}

#[test]
fn lengths_of_animations_whose_times_lie_over_each_other_are_found_in_little_time() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    let times: Vec<f32> = (0..1_000_000).map(|i| i as f32).collect();
    let (first, values) = (file.floats("SCALAR", &times), file.floats("VEC3", &[0.; 3]));
    let view = file.root["accessors"][first]["bufferView"].clone();
    let samplers: Vec<Value> = (0..4000)
        .map(|i| {
            let accessor = json!({"bufferView": view, "componentType": 5126, "type": "SCALAR", "count": 1_000_000 - i});
            json!({"input": file.push("accessors", accessor), "output": values})
        })
        .collect();
    let channel = |k: usize| json!({"sampler": k, "target": {"node": 0, "path": "translation"}});
    let channels: Vec<Value> = (0..samplers.len()).map(channel).collect();
    file.set(
        "animations",
        json!([{"channels": channels, "samplers": samplers}, {"channels": [channel(0)], "samplers": [samplers[3999]]}]),
    );
    let start = std::time::Instant::now();
    let lengths: Vec<f64> = file.load().facts.animations.iter().map(|animation| animation.seconds).collect();
    assert_eq!(lengths, [999_999.0, 996_000.0]);
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}

#[test]
fn materials_are_the_same_at_every_moment_whatever_a_scale_of_zero_hides() {
    let mut file = moving("scale", "STEP", &[0.0, 1.0], "VEC3", &[1., 1., 1., 0., 0., 0.]);
    let positions = file.triangle();
    let primitive = |material| json!([{"attributes": {"POSITION": positions}, "material": material}]);
    file.set("meshes", json!([{"primitives": primitive(0)}, {"primitives": primitive(1)}]));
    file.set("materials", json!([{"name": "red"}, {"name": "green"}]));
    file.set("nodes", json!([{"mesh": 0}, {"mesh": 1}]));
    file.set("scenes", json!([{"nodes": [0, 1]}]));
    let shown = |time: f64| {
        let scene = at(&file, time).scene;
        let names: Vec<String> = scene.materials.iter().map(|material| material.name.clone()).collect();
        (names, scene.instances.len())
    };
    let names = vec!["red".to_owned(), "green".into()];
    assert_eq!((shown(0.0), shown(1.0)), ((names.clone(), 2), (names, 1)));
}
