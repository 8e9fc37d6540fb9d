//! `--instances`: instanced meshes look the same as flattened ones, and are reported.

use super::program::Folder;
use crate::common::bits;
use serde_json::Value;

fn with_pots() -> Folder {
    let folder = Folder::new();
    folder.run(&["generate", "instances", "--size", "2e4", "-o", "pots.glb", "-q"]).ends(0);
    folder
}

#[test]
fn kept_and_flattened_instances_make_the_same_picture_of_fewer_triangles() {
    let folder = with_pots();
    let run = |how: &str, accel: &str, output: &str| -> Value {
        let how = ["--instances", how, "--accel", accel, "--stats", "json", "-o", output];
        let run = folder.render(&[&["pots.glb", "--layers", "--float"], &how[..]].concat()).ends(0);
        serde_json::from_str(run.text()).unwrap()
    };
    let flat = run("flatten", "fast-octree", "flat.exr");
    let number = |stats: &Value, key: &str| stats["scene"][key].as_u64().unwrap();
    assert_eq!((number(&flat, "kept_instances"), number(&flat, "stored_triangles")), (0, number(&flat, "triangles")));
    let picture = |name: &str| bits(&super::program::picture(&folder.path(name)));
    for accel in ["auto", "fast-octree", "fast-bvh"] {
        let kept = run("keep", accel, "kept.exr");
        let (instances, stored) = (number(&kept, "kept_instances"), number(&kept, "stored_triangles"));
        assert!(instances > 9 && number(&kept, "triangles") == instances * stored, "{kept}");
        assert!(4 * number(&kept, "bytes") < number(&flat, "bytes"), "{kept} {flat}");
        for count in ["rays", "hits"] {
            assert_eq!(kept["counts"]["all"][count], flat["counts"]["all"][count], "{accel}");
        }
        assert!(picture("kept.exr") == picture("flat.exr"), "{accel}");
    }
}

#[test]
fn what_cannot_keep_instances_says_what_can() {
    let folder = with_pots();
    let keep = |more: [&str; 2]| folder.render(&[&["pots.glb", "--instances", "keep"], &more[..]].concat()).ends(2);
    keep(["--accel", "grid"]).says(&["grid stores each instance by itself", "fast-octree, fast-bvh or auto"]);
    keep(["--intersector", "watertight"]).says(&["exact test alone", "--intersector watertight"]);
    folder.render(&["pots.glb", "--accel", "grid", "-o", "grid.png"]).ends(0);
}

#[test]
fn what_is_kept_is_told() {
    let folder = with_pots();
    let told = |how: &str| {
        let line = ["pots.glb", "--instances", how, "--stats", "text", "-o", "a.png"];
        folder.render(&line).ends(0).text().to_owned()
    };
    assert!(told("keep").contains("11 instances kept"), "{}", told("keep"));
    assert!(!told("auto").contains("instances kept"), "so few are stored one by one");
}

#[test]
fn more_than_fits_is_refused_before_it_is_flattened() {
    let folder = with_pots();
    let limit = ["--max-memory", "2M"];
    let flat = [&["pots.glb", "--instances", "flatten"], &limit[..]].concat();
    folder.render(&flat).ends(1).says(&["11 instances", "2097152", "--instances auto", "--max-memory"]);
    // So few instances are flattened by default only where that fits.
    for how in ["keep", "auto"] {
        folder.render(&[&["pots.glb", "--instances", how], &limit[..]].concat()).ends(0);
    }
    folder.run(&[&["inspect", "pots.glb"], &limit[..]].concat()).ends(0);
    for command in ["explain", "study"] {
        folder.run(&[&[command, "pots.glb"], &limit[..]].concat()).ends(1).says(&["--max-memory"]);
    }
}

#[test]
fn what_is_too_large_to_be_flattened_is_traced_and_measured_as_it_is_kept() {
    let folder = with_pots();
    let trace = |more: &[&str]| {
        let line = ["trace", "pots.glb", "--size", "64x48", "--pixel", "32,24", "--json"];
        folder.run(&[&line, more].concat())
    };
    let told = |more: &[&str]| -> Value { serde_json::from_str(trace(more).ends(0).text()).unwrap() };
    let (flat, kept) = (told(&[]), told(&["--max-memory", "2M"]));
    assert_eq!((&flat["prims"], &flat["ray"]["hit"]), (&kept["prims"], &kept["ray"]["hit"]));
    assert!(flat["ray"]["hit"]["prim"].is_u64(), "{flat}");
    let visits = |told: &Value| -> Vec<Value> {
        let steps = told["ray"]["steps"].as_array().unwrap();
        steps.iter().filter(|step| step.get("visit").is_some()).cloned().collect()
    };
    let named = |told: &Value, name: &str| visits(told).iter().any(|visit| visit["visit"] == name);
    for name in ["places", "placed node", "placed block"] {
        assert!(named(&kept, name) && !named(&flat, name), "{name}: {kept}");
    }
    // The hit lies in a box that the walk reports to have visited.
    let t = kept["ray"]["hit"]["t"].as_f64().unwrap();
    let around = |visit: &Value| visit["t"][0].as_f64() <= Some(t) && Some(t) <= visit["t"][1].as_f64();
    assert!(visits(&kept).iter().any(|visit| visit["visit"] == "placed block" && around(visit)), "{kept}");
    trace(&["--max-memory", "2M", "--accel", "grid"]).ends(1).says(&["11 instances", "fast structure"]);

    let line = ["bench", "pots.glb", "--size", "32x24", "--passes", "0", "--max-memory", "2M", "--report", "a.json"];
    folder.run(&line).ends(0).says(&["kept once", "left out: ", "grid-octree"]);
    let report: Value = serde_json::from_slice(&std::fs::read(folder.path("a.json")).unwrap()).unwrap();
    let model = &report["models"][0];
    assert_eq!(
        (&model["prims"], &model["objects"], &model["kept_instances"]),
        (&kept["prims"], &11.into(), &11.into())
    );
    let rows = model["structures"].as_array().unwrap();
    let names: Vec<&Value> = rows.iter().map(|row| &row["accel"]).collect();
    assert_eq!(names, ["fast-octree", "fast-bvh"]);
    assert!(model["left_out"].as_array().is_some_and(|left_out| left_out.contains(&"bvh".into())), "{model}");
    let flat = ["bench", "pots.glb", "--size", "32x24", "--passes", "0", "--accel", "fast-octree,fast-bvh"];
    let gate = ["--baseline", "a.json", "--fail-if", "n_it>+1%"];
    folder.run(&[&flat[..], &gate].concat()).ends(1).says(&["11 instances kept, not with 0"]);
    folder
        .run(&[&line[..], &["--accel", "grid,bvh"]].concat())
        .ends(1)
        .says(&["grid, bvh", "fast-octree and fast-bvh"]);
}

#[test]
fn of_what_is_too_large_to_be_flattened_each_mesh_is_judged_in_one_place() {
    let folder = with_pots();
    let judged = |more: &[&str]| folder.run(&[&["verify", "pots.glb", "--rays", "3"], more].concat()).ends(0);
    let figures = |more: &[&str]| -> (u64, u64) {
        let report: Value = serde_json::from_str(judged(&[&["--json"], more].concat()).text()).unwrap();
        (report["triangles"].as_u64().unwrap(), report["unjudged_instances"].as_u64().unwrap())
    };
    let ((all, none), (one, others)) = (figures(&[]), figures(&["--max-memory", "2M"]));
    assert_eq!((none, others, all), (0, 10, 11 * one));
    assert!(judged(&["--max-memory", "2M"]).text().contains("10 more places are too large"));
}
