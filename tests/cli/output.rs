//! Output paths, picture types, and which files may be replaced.

use super::program::{CUBE, Folder, Run, picture, textured_cube};

#[test]
fn the_extension_chooses_the_type() {
    let magics: [(&str, &[u8]); 5] = [
        ("a.png", b"\x89PNG"),
        ("a.exr", &[0x76, 0x2f, 0x31, 0x01]),
        ("a.jpg", &[0xff, 0xd8, 0xff]),
        ("a.jpeg", &[0xff, 0xd8, 0xff]),
        ("a.webp", b"RIFF"),
    ];
    let folder = Folder::with_cube();
    for (name, magic) in magics {
        folder.render(&["cube.obj", "-o", name]).ends(0);
        assert!(folder.read(name).starts_with(magic), "{name}");
    }
}

#[test]
fn a_default_name_replaces_only_a_picture_that_meshray_wrote() {
    let folder = Folder::with_cube().file("cube.png", "precious");
    folder.render(&["cube.obj"]).ends(1).says(&["cube.png", "-o"]);
    assert_eq!(folder.read("cube.png"), b"precious");

    folder.render(&["cube.obj", "-o", "cube.png"]).ends(0);
    assert!(folder.read("cube.png").starts_with(b"\x89PNG"));
    folder.render(&["cube.obj", "--exposure", "-1"]).ends(0);
    assert_eq!(folder.names(), ["cube.obj", "cube.png"]);
}

#[test]
fn a_name_that_is_made_up_replaces_only_a_picture_that_meshray_wrote() {
    let names = ["out/cube.png", "s-tests.png", "s.partial.png"];
    let folder = names.iter().fold(Folder::with_cube(), |folder, name| folder.file(name, "precious"));
    folder.render(&["cube.obj", "-o", "out"]).ends(1).says(&["out/cube.png", "no picture that meshray wrote", "-o"]);
    folder.render(&["cube.obj", "-o", "out/"]).ends(1);
    folder.render(&["cube.obj", "-o", "s.png", "--heatmap", "tests"]).ends(1).says(&["s-tests.png", "-o"]);
    folder.render(&["cube.obj", "-o", "s.png", "--keep-partial"]).ends(1).says(&["s.partial.png", "-o"]);
    assert!(!folder.has("s.png") && names.iter().all(|name| folder.read(name) == b"precious"));
    folder.render(&["cube.obj", "-o", "t.png", "--heatmap", "tests", "--keep-partial"]).ends(0);
    folder.render(&["cube.obj", "-o", "t.png", "--heatmap", "tests"]).ends(0);
}

#[cfg(unix)]
#[test]
fn a_picture_goes_into_a_pipe_by_its_name() {
    let folder = Folder::with_cube();
    let pipe = folder.path("cube.png");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn(move || std::fs::read(pipe).unwrap());
    folder.render(&["cube.obj", "-o", "cube.png"]).ends(0);
    folder.render(&["cube.obj", "-o", "file.png"]).ends(0);
    let read = reader.join().unwrap();
    assert!(read.starts_with(b"\x89PNG") && read == folder.read("file.png"));
}

#[cfg(unix)]
#[test]
fn a_link_does_not_lead_a_picture_over_the_model_or_its_textures() {
    use std::os::unix::fs::symlink;
    let folder = textured_cube();
    for target in ["cube.obj", "cube.mtl", "cube.jpg"] {
        let before = folder.read(target);
        symlink(folder.path(target), folder.path("link.png")).unwrap();
        folder.render(&["cube.obj", "-o", "link.png"]).ends(1).says(&["link.png", "-o"]);
        assert!(folder.read(target) == before, "{target}");
        std::fs::remove_file(folder.path("link.png")).unwrap();
    }
    // Through a link to anything else, the picture is written to the link's target.
    symlink(folder.path("real.png"), folder.path("link.png")).unwrap();
    let folder = folder.file("real.png", "old");
    folder.render(&["cube.obj", "-o", "link.png"]).ends(0);
    assert!(folder.read("real.png").starts_with(b"\x89PNG"));
}

#[test]
fn a_picture_does_not_replace_an_input_whose_turn_comes_later() {
    let folder = Folder::with_cube().file("1.png", CUBE);
    folder.render(&["cube.obj", "1.png", "-o", "{frame}.png"]).ends(1).says(&["1.png", "-o"]);
    assert_eq!(folder.read("1.png"), CUBE.as_bytes());
    assert!(folder.read("2.png").starts_with(b"\x89PNG"), "the other picture is drawn");
}

#[test]
fn statistics_replace_neither_the_model_nor_its_files_nor_a_picture() {
    let folder = textured_cube().file("other.obj", CUBE);
    let stats = |name| folder.render(&["other.obj", "cube.obj", "--stats", "json", "--stats-file", name]);
    for target in ["cube.obj", "cube.mtl", "cube.jpg"] {
        let before = folder.read(target);
        stats(target).ends(1).says(&[target, "--stats-file"]);
        assert!(folder.read(target) == before, "{target}");
    }
    stats("other.png").ends(2).says(&["other.png", "--stats-file"]);
    std::fs::remove_file(folder.path("other.png")).unwrap();
    stats("nowhere/stats.json").ends(1).says(&["nowhere/stats.json", "folder"]);
    assert!(!folder.has("other.png"), "told before any work");
    stats("stats.json").ends(0);
}

#[test]
fn earlier_statistics_stay_when_no_picture_was_made_and_a_forecast_goes_to_their_file() {
    let folder = Folder::with_cube().file("s.json", "earlier");
    folder.render(&["gone.obj", "--stats", "json", "--stats-file", "s.json"]).ends(1);
    assert_eq!(folder.read("s.json"), b"earlier");
    for format in ["text", "json"] {
        let words = ["cube.obj", "--dry-run", "--stats", format];
        let shown = folder.render(&words).ends(0);
        assert!(!shown.text().ends_with("\n\n") && shown.text().contains("rays"), "{}", shown.text());
        let run = folder.render(&[&words[..], &["--stats-file", "s.json"]].concat()).ends(0);
        assert!(run.stdout.is_empty() && String::from_utf8(folder.read("s.json")).unwrap().contains("rays"));
    }
    assert_eq!(folder.names(), ["cube.obj", "s.json"]);
}

#[test]
fn two_inputs_with_one_name_are_an_error_before_any_work() {
    let folder = Folder::new().file("a/cube.obj", CUBE).file("b/cube.obj", CUBE);
    folder.render(&["a/cube.obj", "b/cube.obj"]).ends(2).says(&["cube.png", "a/cube.obj", "b/cube.obj"]);
    folder.render(&["a/cube.obj", "b/cube.obj", "-o", "one.png"]).ends(2);
    folder.render(&["a/cube.obj", "a/cube.obj"]).ends(2).says(&["a/cube.obj is asked for twice"]);
    assert_eq!(folder.names(), ["a", "b"]);
    folder.render(&["a/cube.obj", "b/cube.obj", "-o", "{dir}/{stem}.png"]).ends(0);
    assert!(folder.has("a/cube.png") && folder.has("b/cube.png"));
}

#[test]
fn a_missing_folder_is_told_and_nothing_is_left() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "nowhere/cube.png"]).ends(1).says(&["nowhere"]);
    assert_eq!(folder.names(), ["cube.obj"]);
}

#[test]
fn a_missing_folder_of_many_pictures_is_told_once_and_what_failed_is_counted() {
    let folder = Folder::with_cube().file("other.obj", CUBE);
    let run = folder.render(&["cube.obj", "other.obj", "--turntable", "3", "-o", "nowhere/at/all/"]).ends(1);
    assert_eq!(run.errors().len(), 1, "{:?}", run.errors());
    let run = run.says(&["its folder is not there", "0 pictures of 2 inputs, 2 of them failed, 0 warnings"]);
    assert!(run.errors()[0].contains("nowhere"));
    folder.render(&["cube.obj", "gone.obj"]).ends(1).says(&["1 picture of 2 inputs, 1 of them failed"]);
    folder.render(&["cube.obj", "other.obj"]).ends(0).says(&["2 pictures of 2 inputs, 0 warnings"]);
}

#[test]
fn standard_output_carries_the_picture_and_nothing_else() {
    let folder = Folder::with_cube();
    let run = folder.render(&["cube.obj", "-o", "-"]).ends(0);
    let picture = meshray::image::decode(&run.stdout, 1000).unwrap();
    assert_eq!((picture.width, picture.height), (32, 24));
    folder.render(&["cube.obj", "-o", "file.png"]).ends(0);
    assert!(run.stdout == folder.read("file.png"), "the same bytes as in a file");
    let run = folder.render(&["cube.obj", "-o", "-", "--format", "exr"]).ends(0);
    assert!(run.stdout.starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert_eq!(folder.names(), ["cube.obj", "file.png"]);
}

#[test]
fn what_is_named_after_the_picture_is_refused_where_standard_output_has_no_name() {
    let folder = Folder::with_cube();
    for beside in ["--keep-partial", "--heatmap=tests"] {
        let run = folder.render(&["cube.obj", "-o", "-", beside]).ends(2).says(&["standard output", "-o NAME"]);
        assert!(run.stdout.is_empty(), "{beside}");
    }
}

#[test]
fn standard_input_is_read_for_a_dash() {
    let folder = Folder::with_cube();
    let arguments = ["render", "--size", "32x24", "--samples", "1", "-", "-o", "-"];
    let run = Run::of(folder.program(&arguments).write_stdin(CUBE)).ends(0);
    folder.render(&["cube.obj"]).ends(0);
    let (piped, filed) = (meshray::image::decode(&run.stdout, 1000).unwrap(), picture(&folder.path("cube.png")));
    assert_eq!(piped, filed);
}

#[test]
fn several_views_give_several_files() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "--view", "front", "--view", "top", "-o", "{stem}-{view}.png"]).ends(0);
    assert_eq!(folder.names(), ["cube-front.png", "cube-top.png", "cube.obj"]);
    folder.render(&["cube.obj", "--view", "front,top", "-o", "one.png"]).ends(2);
}

#[test]
fn a_transparent_background_is_clear_and_a_white_one_white() {
    let folder = Folder::with_cube();
    let corner = |background: &str| {
        folder.render(&["cube.obj", "--background", background, "-o", "out.png"]).ends(0);
        picture(&folder.path("out.png")).beauty[0]
    };
    assert_eq!(corner("transparent"), [0.0; 4]);
    assert_eq!(corner("white"), [1.0; 4]);
    assert_eq!(corner("#0000ff"), [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn an_exr_has_layers_when_they_are_asked_for() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "a.exr", "--background", "transparent"]).ends(0);
    assert_eq!(picture(&folder.path("a.exr")).layers, None);
    folder.render(&["cube.obj", "-o", "b.exr", "--layers", "--float", "--background", "transparent"]).ends(0);
    let with = picture(&folder.path("b.exr"));
    let layers = with.layers.unwrap();
    let middle = 12 * 32 + 16;
    assert!(layers.depth[middle].is_finite() && layers.depth[0].is_infinite());
    assert!(layers.prim[middle] < 12 && layers.prim[0] == u32::MAX);
    assert_eq!((layers.instance[middle], layers.instance[0]), (0, u32::MAX));
    let normal = layers.normal[middle];
    assert!((normal.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-4, "{normal:?}");
    let onto_the_cube = layers.position[middle].iter().fold(0.0_f32, |m, c| m.max(c.abs()));
    assert!((onto_the_cube - 1.0).abs() < 1e-4, "{:?}", layers.position[middle]);
}

#[test]
fn sixteen_bits_are_written_when_asked_for() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "--bits", "16"]).ends(0);
    // Byte 24 of a PNG is the bit depth.
    assert_eq!(folder.read("cube.png")[24], 16);
}

#[test]
fn a_size_that_the_type_cannot_hold_is_told_before_any_work() {
    let scene = "[render]\nsize = [16385, 1]\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n";
    let folder = Folder::with_cube().file("wide.toml", scene);
    let words = ["render", "cube.obj", "-o", "a.webp", "--size", "16385x8"];
    folder.run(&words).ends(2).says(&["16384", ".exr"]);
    folder.run(&[&words[..], &["--dry-run"]].concat()).ends(2).says(&["16384"]);
    folder.run(&["render", "wide.toml", "-o", "a.webp", "--samples", "1"]).ends(1).says(&["wide.toml", "16384"]);
    assert_eq!(folder.names(), ["cube.obj", "wide.toml"]);
}

#[cfg(target_os = "linux")]
#[test]
fn the_memory_of_a_picture_is_foretold_and_held_to_its_limit() {
    let folder = Folder::with_cube();
    let words = ["render", "cube.obj", "-o", "a.exr", "--size", "900x900", "--quality", "draft", "--layers", "--float"];
    let json = |more: &[&str]| {
        let run = folder.run(&[&words[..], &["--stats", "json"], more].concat()).ends(0);
        serde_json::from_str::<serde_json::Value>(run.text()).unwrap()
    };
    let foretold = json(&["--dry-run"])["memory"].as_f64().unwrap();
    let held = json(&["--profile"])["profile"]["peak_memory"].as_f64().unwrap();
    assert!((0.6..1.05).contains(&(held / foretold)), "{held} held, {foretold} foretold");
    let run = folder.run(&[&words[..], &["--max-memory", "150M"]].concat()).ends(1);
    run.says(&["a 900×900 picture needs", "--max-memory"]);
}

#[test]
fn a_picture_of_a_given_error_is_foretold_to_be_held_twice() {
    let folder = Folder::with_cube();
    let words = ["render", "cube.obj", "--size", "2000x2000", "--dry-run", "--max-memory", "250M"];
    folder.run(&words).ends(0);
    let run = folder.run(&[&words[..], &["--target-error", "0.01"]].concat()).ends(1);
    run.says(&["a 2000×2000 picture needs 320000000 bytes", "--max-memory"]);
}

#[test]
fn a_model_that_takes_more_memory_than_is_allowed_ends_in_1_as_more_may_help() {
    let folder = Folder::with_cube().file("long.obj", format!("{CUBE}{}", "#\n".repeat(1000)));
    for (name, limit) in [("cube.obj", "200"), ("long.obj", "1K")] {
        folder.render(&[name, "--max-memory", limit]).ends(1).says(&[name, "raise --max-memory"]);
    }
    folder.render(&["cube.obj", "--max-memory", "2K"]).ends(1).says(&["bytes are needed", "raise --max-memory"]);
}

#[test]
fn models_in_one_scene_share_the_memory_that_is_allowed() {
    let points: String = (0..5000).map(|i| format!("v {i} {} 0\n", i % 7)).collect();
    let faces: String = (1..4999).map(|i| format!("f {i} {} {}\n", i + 1, i + 2)).collect();
    let folder =
        Folder::new().file("cube.obj", format!("{CUBE}{}", "#\n".repeat(100_000))).file("mesh.obj", points + &faces);
    let render = |model: &str, times: usize| {
        let merged = ["--merge", "--dry-run", "--max-memory", "5M"];
        folder.render(&[&vec![model; times][..], &merged].concat())
    };
    // The text of each file is freed before the next one is read.
    render("cube.obj", 40).ends(0);
    render("mesh.obj", 2).ends(0);
    render("mesh.obj", 60).ends(1).says(&["mesh.obj", "--max-memory"]);
}

#[test]
fn a_file_that_a_model_names_and_that_is_too_large_ends_in_1_too() {
    let model = r#"{
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "g.bin", "byteLength": 60000}],
        "bufferViews": [{"buffer": 0, "byteLength": 60000}],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]
        }],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0
    }"#;
    let folder = Folder::new().file("g.gltf", model).file("g.bin", vec![0; 60_000]);
    folder.render(&["g.gltf", "--max-memory", "30K"]).ends(1).says(&["'g.bin' has 60000 bytes", "raise --max-memory"]);
}

#[test]
fn a_file_that_is_too_large_whatever_the_memory_ends_in_3() {
    let folder = Folder::new();
    let long = std::fs::File::create(folder.path("long.obj")).unwrap();
    // A sparse file, which takes no space on disk.
    long.set_len(5 << 30).unwrap();
    let run = folder.render(&["long.obj", "--max-memory", "64G"]).ends(3);
    run.says(&["5368709120 bytes where 4294967296 are allowed"]);
}
