//! Pruning: work that a scene does not need is skipped, without a trace in the pixels.

use super::program::Folder;
use crate::common::models;
use serde_json::Value;

#[test]
fn every_model_is_the_same_file_with_every_code_path_on() {
    let folder = Folder::with_cube();
    let mut inputs: Vec<String> = models().iter().map(|path| path.to_str().unwrap().to_owned()).collect();
    inputs.push("cube.obj".into());
    for input in &inputs {
        for how in [&["--depth", "0", "--view", "top"][..], &[]] {
            let run = |output: &str, more: &[&str]| {
                folder.render(&[&[input, "-o", output], how, more].concat()).ends(0);
                folder.read(output)
            };
            assert!(run("pruned.png", &[]) == run("everything.png", &["--no-prune"]), "{input} {how:?}");
        }
    }
}

#[test]
fn shadow_rays_are_asked_what_they_pass_even_where_everything_is_opaque() {
    let folder = Folder::with_cube();
    let shadow = |more: &[&str]| -> Value {
        let run = folder.render(&[&["cube.obj", "--stats", "json"], more].concat()).ends(0);
        let stats: Value = serde_json::from_str(run.text()).unwrap();
        stats["counts"]["shadow"]["rays"].clone()
    };
    let (usual, everything) = (shadow(&[]).as_u64().unwrap(), shadow(&["--no-prune"]).as_u64().unwrap());
    assert!(usual > 0 && everything >= 2 * usual, "{usual} and {everything}");
}

#[test]
fn bench_says_what_leaving_out_saves() {
    let folder = Folder::with_cube();
    let bench = ["bench", "cube.obj", "--accel", "fast-bvh", "--size", "32x24", "--report", "a.json"];
    let run = folder.run(&[&bench[..], &["--passes", "1"]].concat()).ends(0);
    let text = run.text().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("with everything on (--no-prune)") && text.contains("the pixels are the same"), "{text}");
    let pruning = |folder: &Folder| -> Value {
        let report: Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
        report["models"][0]["pruning"].clone()
    };
    let told = pruning(&folder);
    assert_eq!((&told["same"], &told["usual"]["passes"]), (&true.into(), &1.into()));
    assert!(told["usual"]["median"].as_f64() > Some(0.0) && told["everything"]["median"].as_f64() > Some(0.0));
    folder.run(&[&bench[..], &["--passes", "0"]].concat()).ends(0);
    assert_eq!(pruning(&folder), Value::Null, "counts only");
}
