//! `meshray explain`: what a mesh costs, and why.

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
