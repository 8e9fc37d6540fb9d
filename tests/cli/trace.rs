//! `meshray trace`: the ray tree of a sample.

use super::program::{Folder, picture, textured_cube};
use serde_json::Value;

fn trace(folder: &Folder, arguments: &[&str]) -> Value {
    let run =
        folder.run(&[&["trace", "cube.obj", "--size", "32x24", "--pixel", "16,12", "--json"], arguments].concat());
    let run = run.ends(0);
    serde_json::from_str(run.text()).unwrap()
}

#[test]
fn a_ray_is_told_with_its_steps_its_hit_and_the_rays_behind_it() {
    let folder = Folder::with_cube();
    let told = trace(&folder, &["--accel", "bvh"]);
    assert_eq!((&told["schema"], &told["accel"]), (&"meshray-trace/1".into(), &"bvh".into()));
    let ray = &told["ray"];
    let steps = ray["steps"].as_array().unwrap();
    let tests = steps.iter().filter(|s| s.get("test").is_some()).count();
    assert_eq!(ray["counts"]["n_it"].as_u64(), Some(tests as u64));
    assert!(ray["hit"]["prim"].as_u64() < Some(12), "{ray}");
    let position: Vec<f64> = ray["hit"]["position"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
    assert!(position.iter().any(|x| (x.abs() - 1.0).abs() < 1e-6), "on a face of the cube: {position:?}");
    let child = &ray["rays"][0];
    assert_eq!((child["class"].as_str(), child["question"].as_str()), (Some("shadow"), Some("occluded")));
    assert!(child.get("steps").is_none() && child["counts"]["n_bit"].as_u64() > Some(0), "{child}");
    let all = trace(&folder, &["--accel", "bvh", "--all-steps"]);
    assert!(all["ray"]["rays"][0]["steps"].as_array().is_some_and(|steps| !steps.is_empty()));
}

#[test]
fn how_far_the_eye_is_behind_where_its_ray_starts_is_told() {
    let folder = Folder::with_cube();
    let of = |eye: &str| trace(&folder, &["--accel", "bvh", "--at", "0,0,0", "--fov", "0.5", "--eye", eye]);
    let near = of("0,0,9");
    assert_eq!(near["ray"]["skipped"], 0.0);
    let far = of("0,0,900");
    let z = |ray: &Value, t: f64| ray["origin"][2].as_f64().unwrap() + t * ray["direction"][2].as_f64().unwrap();
    let [skipped, t] = [&far["ray"]["skipped"], &far["ray"]["hit"]["t"]].map(|number| number.as_f64().unwrap());
    assert!(skipped > 800.0 && (z(&far["ray"], -skipped) - 900.0).abs() < 1e-3 && t < 50.0, "{skipped} {t}");
    assert!((z(&far["ray"], t) - 1.0).abs() < 1e-3, "the front of the cube");
    let words = ["trace", "cube.obj", "--size", "32x24", "--pixel", "16,12", "--at", "0,0,0", "--eye", "0,0,900"];
    let text = folder.run(&words).ends(0);
    assert!(text.text().contains("where t is 0: the eye is 8"), "{}", text.text());
}

#[test]
fn every_structure_tells_the_same_hit_its_own_way() {
    let folder = Folder::with_cube();
    let names =
        ["none", "transform", "spheres", "boxes", "bvh", "grid", "grid-octree", "grid-bvh", "octree", "fast-octree"];
    let truth = trace(&folder, &["--accel", "fast-bvh"])["ray"]["hit"].clone();
    for name in names {
        assert_eq!(trace(&folder, &["--accel", name])["ray"]["hit"], truth, "{name}");
    }
    let kinds = |accel: &str| {
        let told = trace(&folder, &["--accel", accel]);
        let steps = told["ray"]["steps"].as_array().unwrap().clone();
        steps.iter().filter_map(|s| s["visit"].as_str().map(str::to_owned)).next()
    };
    assert_eq!(["spheres", "grid", "bvh"].map(kinds), ["object", "cell", "node"].map(|k| Some(k.to_owned())));
}

#[test]
fn the_text_says_what_happened_in_words() {
    let folder = Folder::with_cube();
    let arguments = ["trace", "cube.obj", "--size", "32x24", "--pixel", "16,12", "--accel", "grid"];
    let run = folder.run(&arguments).ends(0);
    for word in ["eye ray from", "cell ", "hit ", "= hits prim", "shadow ray to light", "n_it"] {
        assert!(run.text().contains(word), "no `{word}` in\n{}", run.text());
    }
    let run = folder.run(&[&arguments[..], &["--pixel", "0,0"]].concat());
    assert_eq!(run.code, Some(2), "one pixel at a time");
    let corner = folder.run(&["trace", "cube.obj", "--size", "32x24", "--pixel", "0,0"]).ends(0);
    assert!(corner.text().contains("= hits nothing"));
}

#[test]
fn a_pixel_outside_the_picture_is_a_wrong_command_line() {
    let folder = Folder::with_cube();
    let at = |pixel: &str| folder.run(&["trace", "cube.obj", "--size", "32x24", "--pixel", pixel]);
    at("32,0").ends(2).says(&["32×24"]);
    at("5").ends(2);
    folder.run(&["trace", "cube.obj", "--pixel", "0,0", "--sample", "1"]).ends(2).says(&["--samples"]);
    folder.run(&["trace", "missing.obj", "--pixel", "0,0"]).ends(1).says(&["missing.obj"]);
}

#[test]
fn the_picture_of_a_ray_is_a_png_that_replaces_no_input() {
    let folder = Folder::with_cube();
    let arguments = ["trace", "cube.obj", "--size", "32x24", "--pixel", "16,12", "--accel", "octree"];
    folder.run(&[&arguments[..], &["-o", "ray.png"]].concat()).ends(0).says(&["ray.png"]);
    let drawn = picture(&folder.path("ray.png"));
    assert!(drawn.width > drawn.height && drawn.height > 600);
    // The ray is white.
    let white = drawn.beauty.iter().filter(|p| p[..3] == [1.0; 3]).count();
    assert!(white > 100, "{white} white pixels");
    folder.run(&[&arguments[..], &["-o", "ray.exr"]].concat()).ends(2);
    folder.run(&["trace", "cube.obj", "--pixel", "0,0", "-o", "cube.obj"]).ends(2);
    assert!(folder.read("cube.obj").starts_with(b"v "));
}

#[test]
fn the_drawing_replaces_neither_the_model_nor_a_file_it_uses() {
    let folder = textured_cube();
    std::fs::rename(folder.path("cube.jpg"), folder.path("skin.png")).unwrap();
    let folder = folder.file("cube.mtl", "newmtl a\nmap_Kd skin.png\n");
    let before = folder.read("skin.png");
    let words = ["trace", "cube.obj", "--size", "32x24", "--pixel", "16,12", "-o"];
    folder.run(&[&words[..], &["skin.png"]].concat()).ends(1).says(&["skin.png", "-o"]);
    assert!(folder.read("skin.png") == before);
    folder.run(&[&words[..], &["nowhere/ray.png"]].concat()).ends(1).says(&["folder"]);
}
