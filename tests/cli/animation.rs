//! Animations on the command line: single moments, frames that share a camera, turntables.

use super::program::{Folder, Run, picture};
use base64::Engine as _;
use serde_json::Value;

/// A triangle that moves right by four times its width in a second, `Slide`, and an animation without effect, `Stay`.
fn sliding() -> String {
    let corners = [-1.0f32, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0];
    let keys = [0.0f32, 1.0, 0.0, 0.0, 0.0, 8.0, 0.0, 0.0];
    let bytes: Vec<u8> = corners.iter().chain(&keys).flat_map(|x| x.to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}},{{}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "animations":[
            {{"name":"Slide","channels":[{{"sampler":0,"target":{{"node":0,"path":"translation"}}}}],
             "samplers":[{{"input":1,"output":2}}]}},
            {{"name":"Stay","channels":[{{"sampler":0,"target":{{"node":1,"path":"translation"}}}}],
             "samplers":[{{"input":1,"output":2}}]}}],
        "accessors":[
            {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}},
            {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
            {{"bufferView":0,"byteOffset":44,"componentType":5126,"count":2,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":68}}],
        "buffers":[{{"byteLength":68,"uri":"data:application/octet-stream;base64,{data}"}}]}}"#
    )
}

fn folder() -> Folder {
    Folder::with_cube().file("a.gltf", sliding())
}

/// An eye that sees the triangle slide through the picture.
const WIDE: [&str; 5] = ["--eye", "4,0,20", "--at", "4,0,0", "-q"];

fn wide(folder: &Folder, arguments: &[&str]) -> Run {
    folder.render(&[arguments, &WIDE].concat())
}

/// Mean column of the pixels brighter than the backdrop.
fn middle(folder: &Folder, name: &str) -> f64 {
    let beauty = picture(&folder.path(name)).beauty;
    let columns = beauty.iter().enumerate().filter(|(_, p)| p[0] > 0.25).map(|(i, _)| (i % 32) as f64);
    let columns: Vec<f64> = columns.collect();
    assert!(!columns.is_empty(), "{name} shows nothing");
    columns.iter().sum::<f64>() / columns.len() as f64
}

#[test]
fn a_time_moves_the_model_and_the_rest_pose_stays_without() {
    let folder = folder();
    let at = |arguments: &[&str]| {
        wide(&folder, &[&["a.gltf", "-o", "out.png"], arguments].concat()).ends(0);
        middle(&folder, "out.png")
    };
    let (rest, half, end) = (at(&[]), at(&["--time", "0.5"]), at(&["--time", "1s"]));
    assert!(half > rest + 4.0 && end > half + 4.0, "{rest} {half} {end}");
    assert_eq!(at(&["--time", "500ms"]), half);
    assert_eq!(at(&["--frame", "12"]), half);
    assert_eq!(at(&["--frame", "15", "--fps", "30"]), half);
    assert_eq!(at(&["--animation", "Slide", "--time", "0.5"]), half);
    assert_eq!(at(&["--animation", "1", "--time", "0.5"]), rest);
    assert_eq!(at(&["--animation", "Slide"]), rest);
}

#[test]
fn a_time_past_the_end_is_a_warning_with_the_length() {
    let folder = folder();
    wide(&folder, &["a.gltf", "--time", "3"]).ends(0).says(&["3 s is past the end of animation 'Slide'", "1 s long"]);
    wide(&folder, &["a.gltf", "--time", "3", "--strict"]).ends(3);
    let frames = ["a.gltf", "--frames", "0..4", "--fps", "2", "--strict"];
    wide(&folder, &frames).ends(3).says(&["past the end", "--strict"]);
    assert!(
        folder.names().iter().all(|name| !name.ends_with("0000.png")),
        "no picture before the frame that has a warning"
    );
    wide(&folder, &[&frames[..], &["--frame", "2"]].concat()).ends(0);
    let words = ["a.gltf", "--time", "3", "--stats", "json", "--cutoff", "0.6"];
    let run = folder.render(&words).ends(0).says(&["animation 'Slide' at 1.000 s"]);
    let stats: Value = serde_json::from_str(run.text()).unwrap();
    assert_eq!((&stats["animation"]["time"], &stats["cutoff"]), (&1.0.into(), &0.6.into()));
}

#[test]
fn an_unknown_animation_ends_as_an_unknown_scene_does() {
    let folder = folder();
    folder.render(&["a.gltf", "--scene", "Run"]).ends(3).says(&["there is no scene 'Run'"]);
    for command in ["render", "inspect", "verify"] {
        let run = folder.run(&[command, "a.gltf", "--animation", "Run"]).ends(3);
        run.says(&["there is no animation 'Run'; it has 0 'Slide', 1 'Stay'"]);
    }
    folder.render(&["cube.obj", "--animation", "Run"]).ends(3).says(&["cube.obj", "the file has none"]);
    folder.render(&["cube.obj", "--time", "1"]).ends(0).says(&["cube.obj: the file has no animation"]);
    folder.render(&["cube.obj", "--frames", "0..3"]).ends(3).says(&["cube.obj: the file has no animation"]);
    for wrong in [&["--time", "-1"][..], &["--time", "1", "--frame", "2"], &["--fps", "0", "--frame", "1"]] {
        folder.render(&[&["a.gltf"], wrong].concat()).ends(2);
    }
    folder.run(&["inspect", "a.gltf", "--fps", "30"]).ends(2).says(&["--frame"]);
}

#[test]
fn inspect_lists_animations_with_their_lengths_and_shows_a_moment() {
    let folder = folder();
    let run = folder.run(&["inspect", "a.gltf"]).ends(0);
    assert!(run.text().contains("'Slide' (1.000 s, 1 channel), 'Stay' (1.000 s, 1 channel)"), "{}", run.text());
    let report = |arguments: &[&str]| {
        let run = folder.run(&[&["inspect", "a.gltf", "--json"], arguments].concat()).ends(0);
        serde_json::from_str::<Value>(run.text()).unwrap()
    };
    let report = (report(&[]), report(&["--time", "1"]));
    assert_eq!(report.0["animations"][0]["name"], "Slide");
    assert_eq!(report.0["animations"][1]["seconds"], 1.0);
    assert_eq!((&report.0["bounds"]["hi"][0], &report.1["bounds"]["hi"][0]), (&Value::from(1.0), &Value::from(9.0)));
}

#[test]
fn frames_share_a_camera_that_sees_them_all() {
    let folder = folder();
    folder.render(&["a.gltf", "--frames", "0..=4", "--fps", "4", "-q"]).ends(0);
    let names: Vec<String> = (0..5).map(|i| format!("a.{i:04}.png")).collect();
    assert!(folder.names().starts_with(&names) && !folder.has("a.0005.png"), "{:?}", folder.names());
    let places: Vec<f64> = names.iter().map(|name| middle(&folder, name)).collect();
    assert!(places.windows(2).all(|pair| pair[1] > pair[0] + 3.0), "{places:?}");
    // The shared camera centres the whole movement.
    assert!((places[0] + places[4] - 31.0).abs() < 1.5, "{places:?}");
}

#[test]
fn one_frame_of_a_sequence_can_be_rendered_again() {
    let folder = folder();
    folder.render(&["a.gltf", "--frames", "1..4", "--fps", "4", "-q", "-o", "{frame}.png"]).ends(0);
    folder.render(&["a.gltf", "--frames", "1..4", "--frame", "2", "--fps", "4", "-q", "-o", "one.png"]).ends(0);
    folder.run(&["render", "--again", "2.png", "-o", "again.png", "-q"]).ends(0);
    assert!(folder.read("one.png") == folder.read("2.png") && folder.read("again.png") == folder.read("2.png"));
    folder
        .render(&["a.gltf", "--frames", "1..4", "--frame", "4"])
        .ends(2)
        .says(&["--frame 4 is none of --frames 1..4"]);
}

#[test]
fn a_frame_alone_has_the_pixels_of_the_sequence_where_the_camera_is_fixed() {
    let folder = folder();
    wide(&folder, &["a.gltf", "--frames", "0..3", "--fps", "4", "-o", "{frame}.png"]).ends(0);
    wide(&folder, &["a.gltf", "--frame", "2", "--fps", "4", "-o", "alone.png"]).ends(0);
    assert!(picture(&folder.path("2.png")).beauty == picture(&folder.path("alone.png")).beauty);
}

#[test]
fn a_warning_of_every_frame_is_said_once() {
    let folder = folder();
    let run = wide(&folder, &["a.gltf", "--frames", "0..5", "--fps", "1"]).ends(0);
    assert_eq!(run.stderr.matches("past the end").count(), 1, "{}", run.stderr);
}

#[test]
fn a_turntable_shows_a_model_from_all_around() {
    let folder = folder();
    folder.render(&["cube.obj", "--turntable", "4", "--background", "transparent", "-q"]).ends(0);
    let name = |i: u32| format!("cube.{i:04}.png");
    assert!((0..4).all(|i| folder.has(&name(i))), "{:?}", folder.names());
    // A cube has the same outline from four sides.
    let outline = |i: u32| picture(&folder.path(&name(i))).beauty.iter().filter(|p| p[3] > 0.0).count();
    assert!((0..4).all(|i| outline(i).abs_diff(outline(0)) < 5), "{:?}", (0..4).map(outline).collect::<Vec<_>>());
    assert!(folder.read(&name(0)) != folder.read(&name(1)));
    folder.run(&["render", "--again", &name(3), "-o", "again.png", "-q"]).ends(0);
    assert!(folder.read("again.png") == folder.read(&name(3)));
    let run = folder.render(&["a.gltf", "--turntable", "1/8", "--time", "0.5", "-o", "turned.png"]).ends(0);
    run.says(&["45.0° around", "animation 'Slide' at 0.500 s"]);
}

#[test]
fn of_several_models_each_that_has_the_animation_shows_it_and_the_others_rest() {
    let (run, still) = (sliding().replace("Slide", "Run"), "v 30 0 0\nv 31 0 0\nv 30 1 0\nf 1 2 3\n");
    let folder = folder().file("b.gltf", run).file("plate.obj", still);
    let folder = folder.file("both.toml", "[[models]]\nfile = \"a.gltf\"\n[[models]]\nfile = \"b.gltf\"\n");
    let shown = |words: &[&str]| {
        let run = folder.run(&[&["inspect", "--json"], words].concat()).ends(0);
        serde_json::from_str::<Value>(run.text()).unwrap()["bounds"]["hi"][0].as_f64().unwrap()
    };
    assert_eq!(shown(&["both.toml"]), 1.0);
    // Both models have a `Stay`; only the second has `Run`, which is animation 2.
    for (name, right) in [("Stay", 1.0), ("Run", 9.0), ("2", 9.0), ("Slide", 9.0), ("0", 9.0)] {
        assert_eq!(shown(&["both.toml", "--animation", name, "--time", "1"]), right, "{name}");
    }
    let unknown = folder.run(&["inspect", "both.toml", "--animation", "Fly"]).ends(3);
    unknown.says(&["both.toml", "there is no animation 'Fly'; it has 0 'Slide', 1 'Stay', 2 'Run', 3 'Stay'"]);
    let stats = |words: &[&str]| {
        let run = folder.render(&[words, &["--stats", "json", "-o", "{frame}.png"]].concat()).ends(0);
        serde_json::from_str::<Value>(run.text().lines().next().unwrap()).unwrap()["animation"].clone()
    };
    assert_eq!(stats(&["both.toml", "--animation", "Run", "--time", "0.5"])["number"], 2);
    // A model without animations may come first.
    let merged = ["plate.obj", "b.gltf", "--merge", "-q"];
    assert_eq!(stats(&[&merged[..], &["--frames", "0..2", "--fps", "4"]].concat())["time"], 0.0);
    assert_eq!(stats(&[&merged[..], &["--time", "0.5"]].concat())["time"], 0.5);
}

/// Two lines side by side in different colours: one is visible at first, the other from 1 second on.
fn flashing() -> String {
    let numbers = [0.0f32, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
    let bytes: Vec<u8> = numbers.iter().chain(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]).flat_map(|x| x.to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let material = |color: &str| format!(r#"{{"pbrMetallicRoughness":{{"baseColorFactor":[{color},1]}}}}"#);
    let mesh = |m: u32| format!(r#"{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":1,"material":{m}}}]}}"#);
    let channel = |n: u32| format!(r#"{{"sampler":{n},"target":{{"node":{n},"path":"scale"}}}}"#);
    let sampler = |n: u32| format!(r#"{{"input":1,"output":{},"interpolation":"STEP"}}"#, 2 + n);
    let keys =
        |at: u32| format!(r#"{{"bufferView":0,"byteOffset":{at},"componentType":5126,"count":2,"type":"VEC3"}}"#);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
        "nodes":[{{"mesh":0,"translation":[-1,0,0]}},{{"mesh":1,"translation":[1,0,0]}}],"meshes":[{},{}],
        "materials":[{},{}],"animations":[{{"channels":[{},{}],"samplers":[{},{}]}}],
        "accessors":[
            {{"bufferView":0,"componentType":5126,"count":2,"type":"VEC3","min":[0,-1,0],"max":[0,1,0]}},
            {{"bufferView":0,"byteOffset":24,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
            {},{}],
        "bufferViews":[{{"buffer":0,"byteLength":{}}}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{data}"}}]}}"#,
        mesh(0),
        mesh(1),
        material("1,0,0"),
        material("0,0,1"),
        channel(0),
        channel(1),
        sampler(0),
        sampler(1),
        keys(32),
        keys(56),
        bytes.len(),
        bytes.len()
    )
}

#[test]
fn lines_that_come_and_go_keep_their_colours_and_their_width() {
    let folder = Folder::new().file("a.gltf", flashing());
    folder.render(&["a.gltf", "--frames", "0..4", "--fps", "1", "-q", "-o", "{frame}.png"]).ends(0);
    let lit = |name: &str, channel: usize| {
        let beauty = picture(&folder.path(name)).beauty;
        let own = |p: &&[f32; 4]| p[channel] > 2.0 * p[2 - channel] && p[channel] > 0.05;
        beauty.iter().filter(own).count()
    };
    let counts = |name: &str| (lit(name, 0), lit(name, 2));
    let (red, blue) = (counts("0.png"), counts("1.png"));
    assert!(red.0 > 0 && red.1 == 0 && blue.0 == 0 && blue.1 > 0, "{red:?} {blue:?}");
    let moving = sliding().replace(r#""primitives":[{"#, r#""primitives":[{"mode":2,"#);
    let folder = Folder::new().file(
        "a.gltf",
        moving
            .replace(r#""scenes":[{"nodes":[0]}]"#, r#""scenes":[{"nodes":[0,1]}]"#)
            .replace(r#"{"mesh":0},{}"#, r#"{"mesh":0},{"mesh":0}"#),
    );
    wide(&folder, &["a.gltf", "--frames", "0..=4", "--fps", "4", "-o", "{frame}.png"]).ends(0);
    // The stationary line keeps its width while the other vanishes: the left half does not change.
    let rest = |name: &str| {
        let beauty = picture(&folder.path(name)).beauty;
        (0..beauty.len()).filter(|i| i % 32 < 10).map(|i| beauty[i]).collect::<Vec<_>>()
    };
    assert!(rest("3.png") == rest("4.png"));
}

#[test]
fn a_sequence_that_shows_nothing_says_so() {
    let folder = folder();
    let away = ["a.gltf", "--frames", "0..3", "--fps", "4", "--eye", "0,0,5", "--at", "0,0,9", "-q"];
    let run = folder.render(&away).ends(0).says(&["none of the 3 pictures of this sequence shows anything"]);
    assert_eq!(run.stderr.matches("shows anything").count(), 1, "{}", run.stderr);
    folder.render(&[&away[..], &["--strict"]].concat()).ends(3);
    let shown = wide(&folder, &["a.gltf", "--frames", "0..3", "--fps", "4"]).ends(0);
    assert!(!shown.stderr.contains("anything"), "{}", shown.stderr);
}

/// The sliding triangle, lit by a lamp in front of it: it slides away from the lamp, and is dark from behind.
fn with_lamp() -> Folder {
    let lamp = r#""nodes":[{"mesh":0},{"translation":[0,0,2],"extensions":{"KHR_lights_punctual":{"light":0}}}],
        "extensionsUsed":["KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3000}]}}"#;
    let lit = sliding().replace(r#""nodes":[0]"#, r#""nodes":[0,1]"#).replace(r#""nodes":[{"mesh":0},{}]"#, lamp);
    Folder::new().file("a.gltf", lit)
}

#[test]
fn a_picture_is_exposed_as_its_sequence_begins_and_a_view_as_if_it_were_alone() {
    let folder = with_lamp();
    let render = |words: &[&str]| folder.render(&[&["a.gltf", "--view", "front"], words].concat()).ends(0);
    for (all, one, same) in [
        (&["--turntable", "4"][..], &["--turntable", "2/4"][..], "2.png"),
        (&["--frames", "0..4", "--fps", "4"], &["--frames", "0..4", "--fps", "4", "--frame", "3"], "3.png"),
    ] {
        render(&[all, &["-o", "{frame}.png"]].concat());
        render(&[one, &["-o", "one.png"]].concat()).says(&["(metered)"]);
        assert!(folder.read("one.png") == folder.read(same), "{one:?}");
    }
    folder.render(&["a.gltf", "--view", "front,back", "-o", "{view}.png"]).ends(0);
    folder.render(&["a.gltf", "--view", "back", "-o", "alone.png"]).ends(0);
    assert!(folder.read("back.png") == folder.read("alone.png"));
}

#[test]
fn a_sequence_that_begins_in_the_dark_is_exposed_by_what_is_lit_first() {
    // The triangle comes from far outside the view.
    let folder = with_lamp();
    let words =
        ["a.gltf", "--frames", "0..=4", "--fps", "4", "--eye", "8,0,4", "--at", "8,0,0", "--background", "black"];
    let words = [&words[..], &["-o", "{frame}.png"]].concat();
    folder.render(&words).ends(0).says(&["(metered)"]);
    let first = picture(&folder.path("0.png")).beauty;
    assert!(first.iter().all(|p| p == &first[0]), "the first frame shows nothing");
    let last = folder.read("4.png");
    folder.render(&[&words[..], &["--frame", "4"]].concat()).ends(0).says(&["(metered)"]);
    assert!(folder.read("4.png") == last);
}

#[test]
fn the_time_that_metering_takes_is_told_once() {
    let folder = with_lamp();
    let metered = |words: &[&str]| -> Vec<f64> {
        let run =
            folder.render(&[&["a.gltf", "--view", "front", "--stats", "json", "-o", "{frame}.png"], words].concat());
        let run = run.ends(0).says(&[", meter "]);
        let seconds = |line: &str| serde_json::from_str::<Value>(line).unwrap()["seconds"]["meter"].as_f64().unwrap();
        run.text().lines().map(seconds).collect()
    };
    // The beginning of a sequence is metered even if its picture is not among those rendered.
    for words in [&["--turntable", "2/4"][..], &["--frames", "0..4", "--fps", "4", "--frame", "3"], &[]] {
        assert!(metered(words)[0] > 0.0, "{words:?}");
    }
    let sequence = metered(&["--frames", "0..2", "--fps", "4"]);
    assert!(sequence[0] > 0.0 && sequence[1] == 0.0, "{sequence:?}");
    let run = folder.render(&["a.gltf", "--exposure", "1", "--stats", "json"]).ends(0);
    assert!(!run.stderr.contains("meter") && run.text().contains(r#""meter":0.0"#), "{} {}", run.stderr, run.text());
}

#[test]
fn frames_in_which_a_scale_of_zero_hides_everything_show_what_is_behind() {
    let hiding = sliding().replace("\"path\":\"translation\"", "\"path\":\"scale\"");
    let folder = Folder::new().file("a.gltf", hiding);
    // Scales 0 0 0 at the start and 8 0 0 at the end: a line, which is just as invisible, but not an empty scene.
    folder.render(&["a.gltf", "--frames", "0..2", "--fps", "1", "-q", "-o", "{frame}.png"]).ends(0);
    assert!(folder.has("0.png") && folder.has("1.png"), "{:?}", folder.names());
    folder.render(&["a.gltf", "--frame", "0", "--fps", "1"]).ends(3).says(&["nothing to draw"]);
}

/// A triangle that fades from red to black within a second, behind a textured one that appears at its end.
fn changing() -> String {
    let corners = [-4.0f32, -1.0, 0.0, 12.0, -1.0, 0.0, 4.0, 8.0, 0.0];
    let keys = [0.0f32, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let mut bytes: Vec<u8> = corners.iter().chain(&keys).flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0, 1, 0, 0]);
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let channel = |sampler: u32, pointer: &str| {
        let extension = format!(r#"{{"KHR_animation_pointer":{{"pointer":"{pointer}"}}}}"#);
        format!(r#"{{"sampler":{sampler},"target":{{"path":"pointer","extensions":{extension}}}}}"#)
    };
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
        "extensionsUsed":["KHR_animation_pointer","KHR_materials_unlit","KHR_node_visibility"],
        "nodes":[{{"mesh":0}},{{"mesh":1,"translation":[0,0,1],"extensions":{{"KHR_node_visibility":{{}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}},
            {{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":3}},"material":1}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{}},"extensions":{{"KHR_materials_unlit":{{}}}}}},
            {{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}},"extensions":{{"KHR_materials_unlit":{{}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"uri":"green.png"}}],
        "animations":[{{"channels":[{},{}],
            "samplers":[{{"input":1,"output":2}},{{"input":1,"output":4,"interpolation":"STEP"}}]}}],
        "accessors":[
            {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-4,-1,0],"max":[12,8,0]}},
            {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
            {{"bufferView":0,"byteOffset":44,"componentType":5126,"count":2,"type":"VEC4"}},
            {{"bufferView":0,"byteOffset":76,"componentType":5126,"count":3,"type":"VEC2"}},
            {{"bufferView":0,"byteOffset":100,"componentType":5121,"count":2,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{}}}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{data}"}}]}}"#,
        channel(0, "/materials/0/pbrMetallicRoughness/baseColorFactor"),
        channel(1, "/nodes/1/extensions/KHR_node_visibility/visible"),
        bytes.len(),
        bytes.len()
    )
}

#[test]
fn a_sequence_has_the_materials_and_maps_of_each_moment() {
    let mut green = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb([0, 255, 0])).write_to(&mut green, image::ImageFormat::Png).unwrap();
    let folder = Folder::new().file("a.gltf", changing()).file("green.png", green.into_inner());
    wide(&folder, &["a.gltf", "--frames", "0..=2", "--fps", "2", "-o", "{frame}.exr"]).ends(0);
    let seen = |name: &str| {
        let beauty = picture(&folder.path(name)).beauty;
        [0, 1].map(|channel| beauty[beauty.len() / 2 + 16][channel])
    };
    let found = ["0.exr", "1.exr", "2.exr"].map(seen);
    assert_eq!(found, [[1.0, 0.0], [0.5, 0.0], [0.0, 1.0]]);
    for frame in ["0", "1", "2"] {
        wide(&folder, &["a.gltf", "--frame", frame, "--fps", "2", "-o", "alone.exr"]).ends(0);
        assert!(picture(&folder.path("alone.exr")).beauty == picture(&folder.path(&format!("{frame}.exr"))).beauty);
        folder.run(&["render", "--again", &format!("{frame}.exr"), "-o", "again.exr", "-q"]).ends(0);
    }
}
