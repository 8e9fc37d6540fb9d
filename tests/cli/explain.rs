//! `meshray explain`: the costs of a mesh, and their causes.

use super::program::{CUBE, Folder};
use serde_json::Value;

#[test]
fn a_cube_on_seven_cubes_is_told_to_be_eight() {
    let again = CUBE.lines().filter(|line| line.starts_with('f')).map(|line| format!("{line}\n")).collect::<String>();
    let folder = Folder::new().file("eight.obj", format!("{CUBE}{}", again.repeat(7)));
    let run = folder.run(&["explain", "eight.obj", "--size", "32x24", "--accel", "fast-bvh", "--json"]).ends(0);
    let told: Value = serde_json::from_str(run.text()).unwrap();
    assert_eq!(told["schema"], "meshray-explain/1");
    let first = &told["causes"][0];
    assert_eq!(first["cause"], "duplicate shells", "{told:#}");
    assert!(first["evidence"].as_str().unwrap().starts_with("84 triangles"));
    let (usual, without) = (&told["usual"]["all"]["cost"], &first["without"]["all"]["cost"]);
    let saved = 1.0 - without.as_f64().unwrap() / usual.as_f64().unwrap();
    assert!((first["saving"].as_f64().unwrap() - saved).abs() < 1e-12 && saved > 0.0);

    let run = folder.run(&["explain", "eight.obj", "--size", "32x24", "--accel", "fast-bvh"]).ends(0);
    assert!(run.text().contains("1. duplicate shells") && run.text().contains("remedy: remove duplicate faces"));
    assert_eq!(folder.names(), ["eight.obj"]);
}

#[test]
fn what_cannot_be_explained_is_refused() {
    let folder = Folder::with_cube();
    folder.run(&["explain", "missing.obj"]).ends(1).says(&["missing.obj"]);
    folder.run(&["explain", "cube.obj", "--accel", "gird"]).ends(2);
    folder.run(&["explain", "cube.obj", "--camera", "9"]).ends(3).says(&["no camera"]);
}

#[test]
fn the_cutoff_of_a_scene_file_counts_wherever_its_picture_is_judged() {
    let mirror = |z: f64| {
        format!(
            "[[meshes]]\nmaterial = 'mirror'\npositions = [[-9, -9, {z}], [9, -9, {z}], [0, 9, {z}]]\nfaces = [[0, 1, 2]]\n"
        )
    };
    let scene = format!(
        "[render]\ncutoff = 0.6\ndepth = 5\n[[cameras]]\neye = [0, 0, 4]\nat = [1, 0, 0]\n\
         [materials.mirror]\ndiffuse = 0.05\nmirror = 0.85\n{}{}",
        mirror(-5.0),
        mirror(5.0)
    );
    let folder = Folder::new().file("facing.toml", scene);
    let words = ["facing.toml", "--size", "16x12"];
    let json = |text: &[u8]| serde_json::from_slice::<Value>(text).unwrap();
    let rendered = |more: &[&str]| {
        let run = folder.run(&[&["render"], &words[..], &["--aa", "off", "--stats", "json"], more].concat());
        json(&run.stdout)["counts"]["reflected"]["rays"].as_u64().unwrap()
    };
    let expected = rendered(&[]);
    assert!((1..rendered(&["--cutoff", "0"])).contains(&expected));
    let told = json(&folder.run(&[&["explain"], &words[..], &["--json"]].concat()).stdout);
    assert_eq!(told["usual"]["reflected"]["rays"], expected);
    folder
        .run(&[&["bench"], &words[..], &["--accel", "bvh", "--passes", "0", "--report", "r.json", "-q"]].concat())
        .ends(0);
    assert_eq!(json(&folder.read("r.json"))["models"][0]["rays"]["reflected"]["asked"], expected);
}
