//! `--instances`: what is stored once looks the same, and says so.

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
    folder.render(&[&["pots.glb", "--instances", "keep"], &limit[..]].concat()).ends(0);
    for command in ["verify", "trace", "inspect"] {
        let pixel: &[&str] = if command == "trace" { &["--pixel", "0,0"] } else { &[] };
        folder.run(&[&[command, "pots.glb"], pixel, &limit].concat()).ends(1).says(&["--max-memory"]);
    }
}
