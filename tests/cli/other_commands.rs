//! `inspect`, statistics, help, version, completions, manual page.

use super::program::{BROKEN_GLB, Folder};
use serde_json::Value;

#[test]
fn inspect_tells_what_a_file_holds() {
    let folder = Folder::with_cube();
    let run = folder.run(&["inspect", "cube.obj"]).ends(0);
    assert!(run.text().contains("12"), "a cube has 12 triangles:\n{}", run.text());
    let run = folder.run(&["inspect", "--json", "cube.obj"]).ends(0);
    let report: Value = serde_json::from_str(run.text()).unwrap();
    assert!(report["schema"].as_str().unwrap().starts_with("meshray-inspect/"), "{report}");
    assert_eq!(folder.names(), ["cube.obj"]);
}

#[test]
fn inspect_refuses_what_cannot_be_read() {
    let folder = Folder::new().file("broken.glb", BROKEN_GLB);
    folder.run(&["inspect", "broken.glb"]).ends(3).says(&["broken.glb"]);
    folder.run(&["inspect", "missing.glb"]).ends(1).says(&["missing.glb"]);
}

#[test]
fn statistics_are_json_with_a_schema_and_exact_counts() {
    let folder = Folder::with_cube();
    let counts = |threads: &str| {
        let run = folder.render(&["cube.obj", "--stats", "json", "--threads", threads]).ends(0);
        let stats: Value = serde_json::from_str(run.text()).unwrap();
        assert!(stats["schema"].as_str().unwrap().starts_with("meshray-stats/"), "{stats}");
        stats["counts"].clone()
    };
    let one = counts("1");
    assert!(one.is_object(), "{one}");
    assert_eq!(one, counts("3"), "counts do not depend on threads");
}

#[test]
fn statistics_say_which_structure_was_used_why_and_with_what() {
    let folder = Folder::with_cube();
    let stats = |how: &[&str]| -> Value {
        let run = folder.render(&[&["cube.obj", "--stats", "json"], how].concat()).ends(0);
        serde_json::from_str(run.text()).unwrap()
    };
    let auto = stats(&[]);
    let used = auto["accel"].as_str().unwrap();
    assert!(["fast-octree", "fast-bvh"].contains(&used) && auto["auto"]["why"].as_str().unwrap().starts_with(used));
    let grid = stats(&["--accel", "grid", "--mailbox", "none", "--grid-density", "2"]);
    assert!(grid["auto"].is_null());
    let parameters = [&grid["parameters"]["grid_density"], &grid["parameters"]["mailbox"]];
    assert_eq!(parameters, [&Value::from(2.0), &Value::from("none")]);
    assert_eq!(grid["counts"]["all"]["tests_saved"], 0);
    let turned = stats(&["--accel", "transform"]);
    assert!(turned["counts"]["all"]["transforms"].as_u64() > turned["counts"]["all"]["tests"].as_u64());
}

#[test]
fn the_short_help_has_at_most_15_flags_and_the_long_one_all() {
    let folder = Folder::new();
    let flags = |help: &str| help.lines().filter(|line| line.trim_start().starts_with('-')).count();
    let short = folder.run(&["render", "-h"]).ends(0);
    assert!((5..=15).contains(&flags(short.text())), "{}", short.text());
    let long = folder.run(&["render", "--help"]).ends(0);
    for flag in ["--eye", "--tone-map", "--accel", "--messages", "--again", "--max-memory", "--layers", "--seed"] {
        assert!(long.text().contains(flag), "{flag}");
    }
}

#[test]
fn version_completions_and_manual_go_to_standard_output() {
    let folder = Folder::new();
    assert!(folder.run(&["--version"]).ends(0).text().contains(env!("CARGO_PKG_VERSION")));
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(folder.run(&["completions", shell]).ends(0).text().contains("tone-map"), "{shell}");
    }
    let manual = folder.run(&["man"]).ends(0);
    let pages = manual.text().lines().filter_map(|line| line.strip_prefix("meshray\\-")?.strip_suffix("(1)"));
    for page in pages.clone() {
        assert!(manual.text().contains(&format!(".TH meshray-{page} 1")), "{page}");
    }
    assert!(manual.text().contains(".TH meshray 1") && pages.count() >= 11);
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_printed_is_an_error_that_says_so() {
    let folder = Folder::new();
    for words in [&["man"][..], &["completions", "bash"], &["--help"], &["render", "--help"], &["--version"]] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_meshray"));
        let ended = program.args(words).current_dir(folder.path("")).stdout(full).output().unwrap();
        let said = String::from_utf8(ended.stderr).unwrap();
        assert!(ended.status.code() == Some(1) && said.starts_with("error: standard output: "), "{words:?}: {said}");
    }
}

#[test]
fn verify_judges_a_mesh_and_trusts_the_exact_test() {
    let folder = Folder::with_cube();
    let run = folder.run(&["verify", "cube.obj", "--rays", "40", "--json"]);
    let report: Value = serde_json::from_str(run.ends(0).text()).unwrap();
    assert_eq!((&report["schema"], &report["trusted"]), (&"meshray-verify/1".into(), &true.into()));
    assert_eq!((&report["triangles"], report["variations"].as_array().unwrap().len()), (&12.into(), 11));

    let text = folder.run(&["verify", "cube.obj", "--rays", "40", "--quiet"]).ends(0);
    assert!(text.text().contains("Choose ") && text.errors().is_empty());
}

#[test]
fn verify_needs_triangles() {
    let folder = Folder::new().file("ball.toml", "[[spheres]]\ncenter=[0,0,0]\nradius=1\n");
    folder.run(&["verify", "ball.toml"]).ends(3).says(&["ball.toml", "no triangles"]);
    folder.run(&["verify", "ball.toml", "--rays", "0"]).ends(2).says(&["from 1"]);
}

#[test]
fn bench_compares_structures_and_writes_reports() {
    let folder = Folder::with_cube();
    let words = ["bench", "cube.obj", "--size", "16x12", "--passes", "1", "--accel", "none,fast-bvh", "-q"];
    let run = folder.run(&[&words[..], &["--report", "r.json", "--report", "r.csv"]].concat()).ends(0);
    assert!(run.text().contains("hits identical, bit for bit, in all 2 structures") && run.errors().is_empty());
    let report: Value = serde_json::from_slice(&folder.read("r.json")).unwrap();
    assert_eq!((&report["schema"], &report["complete"]), (&"meshray-bench/1".into(), &true.into()));
    assert_eq!(report["models"][0]["structures"][1]["accel"], "fast-bvh");
    assert_eq!(folder.read("r.csv").iter().filter(|b| **b == b'\n').count(), 1 + 2 * 3);
}

#[test]
fn bench_fails_when_a_count_grew() {
    let folder = Folder::with_cube();
    let words = ["bench", "cube.obj", "--size", "16x12", "--passes", "0", "--accel", "bvh", "-q"];
    folder.run(&[&words[..], &["--report", "before.json"]].concat()).ends(0);
    let gate = ["--baseline", "before.json", "--fail-if", "n_it>+1%,bytes>+0%"];
    folder.run(&[&words[..], &gate[..]].concat()).ends(0);
    let worse = [&words[..], &gate[..], &["--leaf-size", "100"]].concat();
    folder.run(&worse).ends(1).says(&["cube.obj, bvh, primary: n_it", "is >+1%"]);
    folder.run(&[&words[..6], &gate[..], &["-q", "--view", "back"]].concat()).ends(1).says(&["a different picture"]);
    folder.run(&["bench", "cube.obj", "--baseline", "gone.json", "--fail-if", "n_it>+1%"]).ends(1).says(&["gone.json"]);
    folder.run(&["bench", "cube.obj", "--baseline", "gone.json", "--fail-if", "it>1"]).ends(2).says(&["n_it>+1%"]);
}

#[test]
fn bench_says_what_it_cannot_do() {
    let folder = Folder::with_cube();
    folder.run(&["bench", "cube.obj", "--report", "r.txt"]).ends(2).says(&["r.txt", ".json"]);
    folder.run(&["bench", "cube.obj", "--accel", "none,none"]).ends(2).says(&["none twice"]);
    folder.run(&["bench", "gone.obj"]).ends(1).says(&["gone.obj"]);
}

#[test]
fn reports_for_which_there_is_no_room_are_told_before_any_work() {
    let folder = Folder::with_cube();
    for words in [["bench", "--report"], ["study", "--report"], ["verify", "--plot"]] {
        let [command, flag] = words;
        let run = folder.run(&[command, "cube.obj", flag, "nowhere/x.html"]).ends(1);
        assert!(run.stdout.is_empty() && run.stderr.lines().count() == 1, "{command}: {}", run.stderr);
        run.says(&["nowhere/x.html", "folder", flag]);
    }
}

#[test]
fn options_that_would_change_nothing_are_bad_command_lines_that_say_what_they_are_for() {
    let folder = Folder::with_cube();
    let refused = |words: &[&str], says: &[&str]| {
        folder.run(words).ends(2).says(says);
    };
    refused(&["render", "cube.obj", "--grid-density", "2"], &["--grid-density", "fast-octree", "--accel", "grid-bvh"]);
    refused(&["explain", "cube.obj", "--mailbox", "none", "--accel", "bvh"], &["--mailbox", "of bvh"]);
    refused(&["bench", "cube.obj", "--step-cost", "3", "--accel", "grid,bvh"], &["--step-cost", "of grid, bvh"]);
    refused(&["bench", "cube.obj", "--heatmap-max", "9", "--report", "r.json"], &["--heatmap-max", ".html"]);
    refused(&["verify", "cube.obj", "--plot", "page.txt"], &["page.txt", ".html"]);
    refused(&["render", "cube.obj", "--dry-run", "--profile"], &["--profile"]);
    assert_eq!(folder.names(), ["cube.obj"]);
}

#[test]
fn what_a_dry_run_foretells_goes_to_a_file_without_further_words() {
    let folder = Folder::with_cube();
    let run = folder.run(&["cube.obj", "--size", "64x48", "--dry-run", "--stats-file", "foretold.txt"]).ends(0);
    assert!(run.text().is_empty() && String::from_utf8(folder.read("foretold.txt")).unwrap().contains("rays"));
    folder.run(&["cube.obj", "--stats-file", "counts.txt"]).ends(2).says(&["--stats"]);
}

#[test]
fn objects_too_far_apart_for_single_precision_are_told_and_rounding_is_measured() {
    let triangle = "[[meshes]]\npositions=[[0,0,0],[1,0,0],[0,1,0]]\nfaces=[[0,1,2]]\n";
    let far = |x: &str| format!("{triangle}translate=[{x},0,0]\n");
    let folder = Folder::new().file("far.toml", [far("1e8"), far("-1e8")].concat()).file("near.toml", far("0.3"));
    folder.render(&["far.toml", "-o", "far.png"]).ends(0).says(&["rounding moves it by up to", "far from each other"]);
    assert!(!folder.render(&["near.toml", "-o", "near.png"]).ends(0).stderr.contains("rounding"));
    let rounding = |name: &str| -> f64 {
        let run = folder.run(&["inspect", "--json", name]).ends(0);
        serde_json::from_str::<Value>(run.text()).unwrap()["max_rounding"].as_f64().unwrap()
    };
    assert!(rounding("far.toml") >= 0.5 && rounding("near.toml") < 1e-6);
}
