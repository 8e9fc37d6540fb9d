//! A picture's metadata suffice to repeat it.

use super::program::{CUBE, Folder, picture, textured_cube};

#[test]
fn a_picture_is_repeated_byte_for_byte() {
    for (extension, display) in [("png", &["--exposure", "0.5", "--tone-map", "aces"][..]), ("exr", &[])] {
        let folder = Folder::with_cube();
        let (first, second) = (format!("first.{extension}"), format!("second.{extension}"));
        // Settings of the structure show in nothing but the metadata.
        let settings = "--view iso --seed 7 --background #204060 --accel grid-octree \
                        --grid-density 0.5 --grid-resolution 9 --max-depth 3 --leaf-size 4 --grid-cells 4x5x6 \
                        --max-references 20 --assign box --mailbox hashed";
        let settings: Vec<&str> = settings.split_whitespace().collect();
        folder.render(&[&["cube.obj", "-o", &first], settings.as_slice(), display].concat()).ends(0);
        folder.run(&["render", "--again", &first, "-o", &second]).ends(0);
        assert!(folder.read(&first) == folder.read(&second), "{extension}");
    }
}

#[test]
fn how_a_mesh_was_made_smooth_and_how_wide_its_lines_are_is_repeated() {
    let folder = Folder::new().file("cube.obj", format!("{CUBE}v 2 2 2\nl 1 9\n"));
    let words = ["cube.obj", "--smooth=100", "--line-width", "0.3", "-o", "first.png"];
    folder.render(&words).ends(0);
    folder.render(&["cube.obj", "-o", "plain.png"]).ends(0);
    folder.run(&["render", "--again", "first.png", "-o", "second.png"]).ends(0);
    assert!(folder.read("first.png") == folder.read("second.png"));
    let [first, plain] = ["first.png", "plain.png"].map(|name| picture(&folder.path(name)));
    assert!(first != plain, "they show");
    folder.run(&["render", "--again", "first.png", "--smooth", "-o", "third.png"]).ends(2);
}

#[test]
fn a_picture_is_repeated_as_the_type_that_its_new_name_says() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "a.png", "--bits", "16"]).ends(0);
    folder.run(&["render", "--again", "a.png", "-o", "b.jpg"]).ends(0);
    assert!(folder.read("b.jpg").starts_with(&[0xff, 0xd8, 0xff]));
    folder.render(&["cube.obj", "-o", "c.exr", "--float", "--layers"]).ends(0);
    folder.run(&["render", "--again", "c.exr", "-o", "d.png"]).ends(0);
    assert!(folder.read("d.png").starts_with(b"\x89PNG"));
}

#[test]
fn a_picture_that_was_moved_with_its_model_is_repeated() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj"]).ends(0);
    let (model, picture) = (folder.read("cube.obj"), folder.read("cube.png"));
    for name in ["cube.obj", "cube.png"] {
        std::fs::remove_file(folder.path(name)).unwrap();
    }
    std::fs::create_dir(folder.path("moved")).unwrap();
    let folder = folder.file("moved/a.png", picture).file("moved/cube.obj", &model);
    folder.run(&["render", "--again", "moved/a.png", "-o", "b.png"]).ends(0);
    let [first, second] = ["moved/a.png", "b.png"].map(|name| super::program::picture(&folder.path(name)));
    assert!(first == second);
    let folder = folder.file("moved/cube.obj", [&model, "v 9 9 9\nf 1 2 9\n".as_bytes()].concat());
    folder.run(&["render", "--again", "moved/a.png", "-o", "b.png"]).ends(3).says(&["has changed"]);
}

#[test]
fn another_input_under_the_same_name_is_refused() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj"]).ends(0);
    let before = folder.read("cube.png");
    let folder = folder.file("cube.obj", CUBE.replace("v 1 1 1\n", "v 1 1 2\n"));
    folder.run(&["render", "--again", "cube.png", "-o", "again.png"]).ends(3).says(&["cube.obj", "hash"]);
    assert!(!folder.has("again.png") && folder.read("cube.png") == before);
}

#[test]
fn a_changed_file_that_the_model_names_and_a_changed_panorama_are_not_taken_for_the_model() {
    let folder = textured_cube();
    let sky = folder.read("cube.jpg");
    let folder = folder.file("sky.jpg", &sky);
    folder.render(&["cube.obj", "-o", "plain.png"]).ends(0);
    folder.render(&["cube.obj", "--env", "sky.jpg", "-o", "sky.png"]).ends(0);
    let folder = folder.file("cube.mtl", "newmtl a\n");
    let again = |name: &str| folder.run(&["render", "--again", name, "-o", "again.png"]).ends(3);
    let run = again("plain.png").says(&["cube.obj: the model, or a file that it names, has changed"]);
    assert!(!run.stderr.contains("panorama"), "{}", run.stderr);
    again("sky.png").says(&["the model, a file that it names, or the panorama sky.jpg has changed"]);
    assert!(!folder.has("again.png"));
}

#[test]
fn a_picture_without_settings_cannot_be_repeated() {
    let folder = Folder::with_cube().file("foreign.png", b"\x89PNG\r\n\x1a\n".as_slice());
    for name in ["foreign.png", "cube.obj"] {
        folder.run(&["render", "--again", name]).ends(3).says(&[name]);
    }
    folder.run(&["render", "--again", "missing.png"]).ends(1).says(&["missing.png"]);
}

#[test]
fn a_picture_that_is_repeated_is_replaced_by_nothing_but_its_repetition() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "kept.png", "-q"]).ends(0);
    let kept = folder.read("kept.png");
    let again = |more: &[&str]| folder.run(&[&["render", "--again", "kept.png", "-q"], more].concat());
    again(&["-o", "new.png", "--stats", "json", "--stats-file", "kept.png"])
        .ends(1)
        .says(&["kept.png", "--stats-file"]);
    assert!(folder.read("kept.png") == kept && !folder.has("new.png"));
    again(&["-o", "kept.png"]).ends(0);
    assert!(folder.read("kept.png") == kept);
}

#[test]
fn a_picture_of_a_very_bright_scene_is_repeated_too() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "a.png", "--exposure", "-45.6", "-q"]).ends(0);
    folder.run(&["render", "--again", "a.png", "-o", "b.png", "-q"]).ends(0);
    assert!(folder.read("a.png") == folder.read("b.png"));
    folder.render(&["cube.obj", "--exposure", "101"]).ends(2).says(&["100"]);
}

#[test]
fn a_panorama_is_found_beside_the_picture_too() {
    let sky =
        [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".as_slice(), &[90, 60, 30, 130, 30, 60, 90, 129]].concat();
    let folder = Folder::with_cube().file("evening.hdr", sky);
    folder.render(&["cube.obj", "--env", "evening.hdr", "-o", "a.png", "-q"]).ends(0);
    let kept = picture(&folder.path("a.png")).beauty;
    std::fs::create_dir(folder.path("moved")).unwrap();
    for name in ["a.png", "cube.obj", "evening.hdr"] {
        std::fs::rename(folder.path(name), folder.path("moved").join(name)).unwrap();
    }
    folder.run(&["render", "--again", "moved/a.png", "-o", "b.png", "-q"]).ends(0);
    assert!(picture(&folder.path("b.png")).beauty == kept);
}

#[test]
fn a_picture_that_is_repeated_without_a_name_is_called_as_it_was_and_replaces_no_other() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj"]).ends(0);
    folder.render(&["cube.obj", "--view", "front,iso"]).ends(0);
    let (usual, front) = (folder.read("cube.png"), folder.read("cube-front.png"));
    folder.run(&["render", "--again", "cube-front.png"]).ends(0);
    assert!(folder.read("cube.png") == usual && folder.read("cube-front.png") == front);
}
