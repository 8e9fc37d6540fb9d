//! `meshray bench`: how cost grows with size, and with a parameter.

use super::program::{CUBE, Folder};
use meshray::math::simd::Level;
use serde_json::Value;

const QUICK: [&str; 7] = ["bench", "--size", "16x12", "--passes", "0", "-q", "--accel"];

#[test]
fn growth_is_measured_on_generated_scenes_and_reported_by_size() {
    let folder = Folder::new();
    let words = ["none,bvh", "--generate", "tetra", "--sizes", "50..800:3", "--report", "r.json", "--report", "r.html"];
    let run = folder.run(&[&QUICK[..], &words].concat()).ends(0);
    assert!(
        run.text().contains("exponent") && run.text().contains("tetra-50: 64 prims in one object"),
        "{}",
        run.text()
    );
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    let prims: Vec<u64> = report["models"].as_array().unwrap().iter().map(|m| m["prims"].as_u64().unwrap()).collect();
    assert_eq!((prims, &report["complete"]), (vec![64, 256, 1024], &true.into()));
    let none = &report["growth"]["structures"][0];
    assert_eq!(none["accel"], "none");
    let exponent = none["classes"]["primary"]["n_it"]["exponent"].as_f64().unwrap();
    assert!((exponent - 1.0).abs() < 1e-9, "every eye ray is tested against everything: {exponent}");
    assert!(String::from_utf8(folder.read("r.html")).unwrap().contains("Growth: tetra"));
}

#[test]
fn a_report_says_which_instruction_set_was_chosen() {
    let folder = Folder::with_cube();
    for level in Level::all() {
        let words = ["fast-octree", "--simd", level.word(), "--report", "r.json", "cube.obj"];
        folder.run(&[&QUICK[..], &words].concat()).ends(0);
        let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
        assert_eq!(report["machine"]["simd"], level.name());
    }
}

#[test]
fn a_size_that_is_no_new_scene_and_a_structure_that_is_too_slow_are_left_out_and_said() {
    let folder = Folder::new();
    let words = ["bench", "--size", "8x6", "--passes", "0", "--accel", "none,bvh", "--generate", "tetra", "--sizes"];
    let run = folder.run(&[&words[..], &["60,64,1000", "--slow-tests", "2000"]].concat()).ends(0);
    assert!(run.text().contains("none is left out from 1 024 prims on"), "{}", run.text());
    run.says(&["tetra-64: left out: the nearest scene of its family is tetra-60"]);
}

#[test]
fn where_every_size_is_too_large_nothing_is_measured_and_that_is_no_success() {
    let folder = Folder::new();
    let words = ["none", "--generate", "tetra", "--sizes", "1000,4000", "--slow-tests", "2000", "--report", "r.json"];
    let run = folder.run(&[&QUICK[..], &words].concat()).ends(1);
    run.says(&["1024 prims are too many", "every size was left out", "--slow-tests"]);
    assert!(folder.names().is_empty(), "{:?}", folder.names());
}

#[test]
fn a_model_that_is_missing_does_not_make_the_report_of_the_others_incomplete() {
    let folder = Folder::with_cube();
    folder.run(&[&QUICK[..], &["bvh", "cube.obj", "none.obj", "--report", "r.json"]].concat()).ends(1);
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    assert_eq!((&report["complete"], report["models"].as_array().unwrap().len()), (&true.into(), 1));
}

#[test]
fn sizes_that_make_no_sense_are_bad_command_lines() {
    let folder = Folder::with_cube();
    folder.run(&["bench", "--generate", "tetra", "--sizes", "1e6..1e3"]).ends(2).says(&["1..100"]);
    folder.run(&["bench", "--generate", "tetra", "--sizes", "1e3..1e8"]).ends(2).says(&["1e7"]);
    folder.run(&["bench", "cube.obj", "--sizes", "1e3"]).ends(2).says(&["--sizes"]);
    folder.run(&["bench", "cube.obj", "--generate", "tetra"]).ends(2);
    folder.run(&["bench", "--generate", "tetra", "--scene", "0"]).ends(2).says(&["--scene"]);
    folder.run(&["bench"]).ends(2);
    folder.run(&["bench", "-", "-"]).ends(2).says(&["only once"]);
}

#[test]
fn what_cannot_be_is_told_before_anything_is_measured() {
    let folder = Folder::with_cube().file("other.json", "{\"schema\": \"meshray-spd/1\"}");
    let words = ["bench", "cube.obj", "--baseline", "other.json", "--fail-if", "n_it>+1%"];
    let run = folder.run(&words).ends(3).says(&["its schema is \"meshray-spd/1\""]);
    assert_eq!(run.text(), "");
    folder.run(&["bench", "cube.obj", "--report", "a.json", "--report", "./a.json"]).ends(1).says(&["named twice"]);
    for command in ["bench", "explain", "study"] {
        folder.run(&[command, "cube.obj", "--size", "65535x65535"]).ends(1).says(&["65535×65535 picture needs"]);
    }
    folder.run(&["verify", "cube.obj", "--rays", "1e15"]).ends(1).says(&["rays of each kind need"]);
}

#[test]
fn a_sweep_names_the_best_value_of_each_structure_that_has_the_parameter() {
    let folder = Folder::with_cube();
    let words = ["grid,bvh", "cube.obj", "--sweep", "grid-density=1,4,8", "--report", "r.json"];
    let run = folder.run(&[&QUICK[..], &words].concat()).ends(0);
    assert!(run.text().contains("hits identical, bit for bit, in all 3 structures"), "{}", run.text());
    assert!(run.text().contains("grid: ") && !run.text().contains("bvh"), "{}", run.text());
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    let rows = report["models"][0]["structures"].as_array().unwrap();
    let values: Vec<f64> = rows.iter().map(|r| r["setting"]["value"].as_f64().unwrap()).collect();
    assert_eq!((values, &report["models"][0]["identical"]), (vec![1.0, 4.0, 8.0], &true.into()));
}

#[test]
fn a_sweep_that_changes_nothing_is_a_bad_command_line() {
    let folder = Folder::with_cube();
    let wrong = |words: &[&str], says: &[&str]| {
        folder.run(&[&["bench", "cube.obj"], words].concat()).ends(2).says(says);
    };
    wrong(&["--sweep", "grid-density=1,4", "--accel", "bvh,octree"], &["changes none", "grid-octree"]);
    wrong(&["--sweep", "grid-density=1,4", "--grid-density", "2"], &["same parameter"]);
    wrong(&["--sweep", "step-cost=1,4", "--leaf-size", "2"], &["beside --leaf-size"]);
    wrong(&["--sweep", "density=1,4"], &["grid-density"]);
}

#[test]
fn the_structures_of_the_difference_image_are_two_that_are_measured() {
    let folder = Folder::with_cube();
    let words = ["none,bvh", "cube.obj", "--compare", "bvh,none", "--report", "r.html"];
    folder.run(&[&QUICK[..], &words].concat()).ends(0);
    assert!(String::from_utf8(folder.read("r.html")).unwrap().contains("bvh minus none"));
    for wrong in ["bvh", "bvh,bvh", "bvh,grid"] {
        let words = ["bench", "cube.obj", "--accel", "none,bvh", "--compare", wrong];
        folder.run(&words).ends(2).says(&["--compare"]);
    }
}

#[test]
fn a_report_says_what_auto_would_choose_and_how_many_objects_there_are() {
    let folder = Folder::with_cube();
    let words = ["fast-octree,fast-bvh", "cube.obj", "--report", "r.json"];
    let run = folder.run(&[&QUICK[..], &words].concat()).ends(0);
    assert!(run.text().contains("12 prims in one object: spheres and boxes"), "{}", run.text());
    assert!(run.text().contains("auto would choose fast-octree: "), "{}", run.text());
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    let model = &report["models"][0];
    assert_eq!((&model["objects"], &model["auto"]["kind"]), (&1.into(), &"fast-octree".into()));
    assert_eq!(model["auto"]["won_nodes"], 0.0, "both are one leaf");
}

#[test]
fn a_baseline_is_not_replaced_by_the_report_that_is_compared_with_it() {
    let folder = Folder::with_cube();
    folder.run(&[&QUICK[..], &["bvh", "cube.obj", "--report", "r.json"]].concat()).ends(0);
    let before = folder.read("r.json");
    let words = ["bvh", "cube.obj", "--baseline", "r.json", "--fail-if", "n_it>+1%", "--report", "./r.json"];
    folder.run(&[&QUICK[..], &words].concat()).ends(1).says(&["r.json", "--report"]);
    assert!(folder.read("r.json") == before);
}

#[test]
fn models_of_one_name_are_compared_with_their_own_report_and_one_that_is_missing_is_told() {
    let folder = Folder::new().file("a/cube.obj", CUBE).file("b/cube.obj", format!("{CUBE}f 1 2 7 8\n"));
    folder.run(&[&QUICK[..], &["bvh", "a/cube.obj", "b/cube.obj", "--report", "r.json"]].concat()).ends(0);
    let gate = ["--baseline", "r.json", "--fail-if", "n_it>+0%,n_it<-0%"];
    folder.run(&[&QUICK[..], &["bvh", "a/cube.obj", "b/cube.obj"], &gate].concat()).ends(0);
    folder
        .run(&[&QUICK[..], &["bvh", "b/cube.obj"], &gate].concat())
        .ends(1)
        .says(&["a/cube.obj: in the baseline, but not measured now"]);
}

#[test]
fn a_report_or_a_plot_replaces_no_file_of_the_model() {
    let bytes: Vec<u8> = [0., 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
    let model = |buffer: &str| {
        let accessor = r#"{"bufferView":0,"componentType":5126,"type":"VEC3","count":3,"min":[0,0,0],"max":[1,1,0]}"#;
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"accessors":[{accessor}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{buffer}"}}]}}"#
        )
    };
    let folder = Folder::new()
        .file("json.gltf", model("geo.json"))
        .file("html.gltf", model("geo.html"))
        .file("geo.json", &bytes)
        .file("geo.html", &bytes);
    for words in [
        &["bench", "json.gltf", "--passes", "0", "-q", "--report", "geo.json"][..],
        &["study", "json.gltf", "-q", "--report", "geo.json"],
        &["verify", "html.gltf", "--rays", "2", "-q", "--plot", "geo.html"],
    ] {
        let [flag, name] = words[words.len() - 2..] else { panic!("{words:?}") };
        folder.run(words).ends(1).says(&[name, "would replace a file that is read", flag]);
        assert!(folder.read(name) == bytes, "{words:?}");
    }
}
