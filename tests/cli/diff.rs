//! `meshray diff`: figures, limits, difference pictures.

use super::program::Folder;
use meshray::image::{FileKind, Layers, Metadata, Output, Picture, ToneMap, encode, read_picture};
use serde_json::Value;

fn picture(odd: f32) -> Picture {
    let mut beauty = vec![[0.25, 0.25, 0.25, 1.0]; 40 * 30];
    beauty[12 * 40 + 7] = [odd, 0.25, 0.25, 1.0];
    let layers = Layers { depth: vec![odd; 40 * 30], ..Layers::default() };
    Picture { layers: Some(layers), ..Picture::of(40, 30, beauty) }
}

fn bytes(picture: &Picture, kind: FileKind) -> Vec<u8> {
    let output = Output { tone_map: ToneMap::None, ..Output::default() };
    encode(picture, kind, &output, &Metadata::default()).unwrap()
}

fn folder() -> Folder {
    Folder::new()
        .file("a.png", bytes(&picture(0.25), FileKind::Png))
        .file("b.png", bytes(&picture(1.0), FileKind::Png))
        .file("a.exr", bytes(&picture(0.25), FileKind::Exr))
        .file("b.exr", bytes(&picture(8.0), FileKind::Exr))
        .file("a.webp", bytes(&picture(0.25), FileKind::Webp))
        .file("a.jpg", bytes(&picture(0.25), FileKind::Jpeg))
}

fn figures(folder: &Folder, words: &[&str]) -> Value {
    let run = folder.run(&[&["diff", "--json"], words].concat()).ends(0);
    serde_json::from_str(run.text()).unwrap()
}

#[test]
fn equal_pictures_differ_by_nothing_whatever_their_type() {
    let folder = folder();
    for other in ["a.png", "a.webp"] {
        let found = figures(&folder, &["a.png", other, "--fail-if", "rmse>0,max>0,flip>0,pixels>0"]);
        assert_eq!((&found["rmse"], &found["flip"]["max"], &found["psnr"]), (&0.0.into(), &0.0.into(), &Value::Null));
    }
    let lossy = figures(&folder, &["a.png", "a.jpg"]);
    assert!(lossy["max"].as_f64().unwrap() < 0.02, "{lossy}");
}

#[test]
fn the_worst_pixel_is_named_with_both_of_its_values() {
    let folder = folder();
    let found = figures(&folder, &["a.png", "b.png"]);
    assert_eq!((&found["schema"], &found["space"]), (&"meshray-diff/1".into(), &"display".into()));
    assert_eq!((&found["worst"]["x"], &found["worst"]["y"]), (&7.into(), &12.into()));
    let max = found["max"].as_f64().unwrap();
    // A quarter of the light is the code 137 of 255.
    assert!((max - (1.0 - 137.0 / 255.0)).abs() < 1e-6 && found["pixels_over"] == 1, "{found}");
    assert!((found["rmse"].as_f64().unwrap() - max / 3600_f64.sqrt()).abs() < 1e-9);
    let run = folder.run(&["diff", "a.png", "b.png"]).ends(0);
    for words in ["40×30 pixels, display colour", "at (7, 12)", "FLIP", "1 of 1 200 differ"] {
        assert!(run.text().contains(words), "{words}\n{}", run.text());
    }
}

#[test]
fn a_pixel_that_is_no_number_is_infinitely_wrong_also_as_it_is_displayed() {
    let folder = folder().file("n.exr", bytes(&picture(f32::NAN), FileKind::Exr));
    for space in ["linear", "display"] {
        let run = folder.run(&["diff", "--json", "a.exr", "n.exr", "--space", space, "--fail-if", "max>1e9"]).ends(1);
        let found: Value = serde_json::from_str(run.text()).unwrap();
        assert_eq!(
            (&found["max"], &found["pixels_over"], &found["flip"]["max"]),
            (&Value::Null, &1.into(), &1.0.into())
        );
        let same = figures(&folder, &["n.exr", "n.exr", "--space", space]);
        assert_eq!((&same["max"], &same["flip"]["max"]), (&0.0.into(), &0.0.into()));
    }
    folder.run(&["diff", "a.png", "n.exr", "--fail-if", "max>1e9"]).ends(1);
}

#[test]
fn two_exr_files_are_compared_in_linear_light_with_their_layers() {
    let folder = folder();
    let found = figures(&folder, &["a.exr", "b.exr"]);
    assert_eq!((&found["space"], &found["max"]), (&"linear".into(), &7.75.into()));
    assert!(found["flip"]["exposures"]["count"].as_u64().unwrap() >= 2, "{found}");
    assert_eq!((&found["layers"][0]["name"], &found["layers"][0]["rmse"]), (&"Z".into(), &7.75.into()));
    let shown = figures(&folder, &["a.exr", "b.exr", "--space", "display", "--exposure", "-3"]);
    assert!((shown["worst"]["actual"][0].as_f64().unwrap() - 1.0).abs() < 1e-6, "{shown}");
    let mixed = figures(&folder, &["a.exr", "a.png"]);
    assert!(mixed["space"] == "display" && mixed["max"].as_f64().unwrap() < 0.003, "{mixed}");
}

#[test]
fn a_layer_that_differs_or_that_one_file_has_alone_is_told_and_can_be_limited() {
    let deeper = Picture { beauty: picture(0.25).beauty, ..picture(8.0) };
    let bare = Picture { layers: None, ..picture(0.25) };
    let folder = folder().file("deep.exr", bytes(&deeper, FileKind::Exr)).file("bare.exr", bytes(&bare, FileKind::Exr));
    folder.run(&["diff", "a.exr", "a.exr", "--fail-if", "layer-max>0"]).ends(0);
    folder.run(&["diff", "a.exr", "deep.exr", "--fail-if", "rmse>0"]).ends(0);
    folder.run(&["diff", "a.exr", "deep.exr", "--fail-if", "layer-max>7"]).ends(1).says(&["layer-max is 7.75"]);
    for pair in [["a.exr", "bare.exr"], ["bare.exr", "a.exr"]] {
        assert_eq!(figures(&folder, &pair)["layers_of_one"], serde_json::json!(["Z"]));
        folder
            .run(&[&["diff"], &pair[..], &["--fail-if", "layer-max>1e9"]].concat())
            .ends(1)
            .says(&["layer-max is infinite"]);
    }
}

#[test]
fn a_broken_limit_ends_with_1_and_says_which() {
    let folder = folder();
    folder.run(&["diff", "a.png", "b.png", "--fail-if", "rmse>0.1,psnr<20"]).ends(0);
    let run = folder.run(&["diff", "a.png", "b.png", "--fail-if", "rmse>0.1", "--fail-if", "max>0.2"]).ends(1);
    run.says(&["max is 0.46", "max>0.2"]);
    folder.run(&["diff", "a.png", "b.png", "--fail-if", "ssim>1"]).ends(2).says(&["relative-rmse"]);
    folder.run(&["diff", "a.png", "b.png", "--fail-if", "layer-max>0"]).ends(2).says(&["two EXR files"]);
    folder.run(&["diff", "a.png", "b.png", "--exposure", "2"]).ends(2).says(&["--space display"]);
}

#[test]
fn maps_are_drawn_and_kept_only_where_they_are_asked_for() {
    let folder = folder();
    let words = ["diff", "a.png", "b.png", "-o", "map.png", "--show", "channel", "--side-by-side", "both.png"];
    folder.run(&words).ends(0);
    let map = read_picture(&folder.path("map.png")).unwrap();
    assert!(map.width >= 40 && map.height > 30);
    let [quiet, loud] = [0, 12 * map.width as usize + 7].map(|i| map.beauty[i]);
    assert!(loud[0] > 0.9 && quiet[0] < 0.1, "{quiet:?} {loud:?}");
    assert_eq!(read_picture(&folder.path("both.png")).unwrap().width, 120);
}

#[test]
fn what_cannot_be_compared_is_told() {
    let folder = folder()
        .file("small.png", bytes(&Picture::of(1, 1, vec![[0.0; 4]]), FileKind::Png))
        .file("text.png", b"no picture");
    folder.run(&["diff", "a.png", "small.png"]).ends(3).says(&["small.png", "1×1", "40×30"]);
    folder.run(&["diff", "a.png", "text.png"]).ends(3).says(&["text.png", "neither"]);
    folder.run(&["diff", "a.png", "missing.png"]).ends(1).says(&["missing.png"]);
}

#[test]
fn what_is_drawn_replaces_neither_picture_and_each_drawing_is_a_file_of_its_own() {
    let folder = folder();
    let (a, b) = (folder.read("a.png"), folder.read("b.png"));
    folder.run(&["diff", "a.png", "b.png", "-o", "b.png"]).ends(1).says(&["b.png", "-o"]);
    folder.run(&["diff", "a.png", "b.png", "--side-by-side", "./a.png"]).ends(1).says(&["a.png", "--side-by-side"]);
    folder.run(&["diff", "a.png", "b.png", "-o", "c.png", "--side-by-side", "./c.png"]).ends(2);
    for flag in ["-o", "--side-by-side"] {
        folder.run(&["diff", "a.png", "b.png", flag, "c.jpg"]).ends(2).says(&["c.jpg", flag, "PNG"]);
    }
    assert!(!folder.has("c.jpg"));
    assert!(folder.read("a.png") == a && folder.read("b.png") == b && !folder.has("c.png"));
}

#[test]
fn a_pixel_that_is_no_number_breaks_limits_and_is_not_called_equal() {
    let grey = Picture::of(4, 4, vec![[0.5, 0.5, 0.5, 1.0]; 16]);
    let mut odd = grey.clone();
    odd.beauty[5] = [f32::NAN, 0.5, 0.5, 1.0];
    let folder = Folder::new().file("a.exr", bytes(&grey, FileKind::Exr)).file("b.exr", bytes(&odd, FileKind::Exr));
    let run = folder.run(&["diff", "a.exr", "b.exr", "--fail-if", "flip>0.05"]).ends(1);
    let line = |name: &str| run.text().lines().find(|l| l.trim_start().starts_with(name)).unwrap().to_owned();
    assert!(line("PSNR").ends_with("-infinite") && line("bias").contains("not defined"), "{}", run.text());
    assert!(line("FLIP").contains("1.00000 max at (1, 1)"), "{}", run.text());
    folder.run(&["diff", "b.exr", "b.exr", "--fail-if", "flip>0,max>0"]).ends(0);
}
