//! Exit codes, and the files left behind by each ending.

use super::program::{BROKEN_GLB, Folder, NOTHING_TO_DRAW, cube_with_a_bad_face};

#[test]
fn a_model_becomes_a_picture_of_its_name_and_nothing_else_happens() {
    let folder = Folder::with_cube();
    let run = folder.render(&["cube.obj"]).ends(0);
    assert!(run.stdout.is_empty());
    assert_eq!(folder.names(), ["cube.obj", "cube.png"]);
    let picture = super::program::picture(&folder.path("cube.png"));
    assert_eq!((picture.width, picture.height), (32, 24));
    let dark = picture.beauty.iter().filter(|p| p[0] < 0.9).count();
    assert!(dark > 40, "the cube must show: {dark} pixels differ from the background");
}

#[test]
fn the_word_render_may_be_left_out() {
    let folder = Folder::with_cube();
    folder.run(&["cube.obj", "--size", "32x24", "--samples", "1"]).ends(0);
    assert!(folder.has("cube.png"));
}

#[test]
fn several_files_give_one_picture_each() {
    let folder = Folder::with_cube().file("sub/other.obj", super::program::CUBE);
    folder.render(&["cube.obj", "sub/other.obj"]).ends(0);
    assert!(folder.has("cube.png") && folder.has("other.png"), "{:?}", folder.names());
}

#[test]
fn merged_files_give_one_picture() {
    let folder = Folder::with_cube().file("other.obj", super::program::CUBE);
    folder.render(&["--merge", "cube.obj", "other.obj", "-o", "both.png"]).ends(0);
    assert_eq!(folder.names(), ["both.png", "cube.obj", "other.obj"]);
}

#[test]
fn a_missing_file_ends_in_1_as_a_retry_may_help() {
    let folder = Folder::new();
    let run = folder.render(&["ship.glb"]).ends(1).says(&["ship.glb"]);
    assert_eq!(run.errors().len(), 1, "{}", run.stderr);
    assert!(folder.names().is_empty());
}

#[test]
fn a_broken_file_ends_in_3_with_its_name_and_no_picture() {
    let folder = Folder::new().file("ship.glb", BROKEN_GLB);
    folder.render(&["ship.glb"]).ends(3).says(&["error: ship.glb"]);
    assert_eq!(folder.names(), ["ship.glb"]);
}

#[test]
fn a_file_of_another_kind_ends_in_3() {
    for (name, content) in
        [("ship.stl", b"solid x\nendsolid x\n".as_slice()), ("ship.glb", b""), ("ship.gltf", b"\0\xff")]
    {
        let folder = Folder::new().file(name, content);
        folder.render(&[name]).ends(3).says(&[name]);
        assert_eq!(folder.names(), [name]);
    }
}

#[test]
fn a_batch_goes_on_after_a_bad_file_and_ends_as_badly_as_its_worst() {
    let folder = Folder::with_cube().file("broken.glb", BROKEN_GLB);
    folder.render(&["broken.glb", "cube.obj"]).ends(3).says(&["broken.glb"]);
    assert!(folder.has("cube.png") && !folder.has("broken.png"), "{:?}", folder.names());
}

#[test]
fn points_and_lines_that_stand_nowhere_are_nothing_to_draw() {
    let folder = Folder::new().file("dots.obj", NOTHING_TO_DRAW);
    let run =
        folder.render(&["dots.obj"]).ends(3).says(&["all of its 2 faces, lines, points and shapes", "--allow-empty"]);
    assert_eq!(run.errors().len(), 1, "{}", run.stderr);
    assert_eq!(folder.names(), ["dots.obj"]);
}

#[test]
fn every_command_about_rays_ends_alike_where_there_is_nothing_to_hit() {
    let folder = Folder::new().file("dots.obj", NOTHING_TO_DRAW);
    for command in
        [&["trace", "--pixel", "0,0"][..], &["bench", "--passes", "0"], &["explain"], &["study"], &["verify"]]
    {
        folder.run(&[command, &["dots.obj"]].concat()).ends(3).says(&["error: dots.obj: "]);
    }
}

#[test]
fn an_empty_scene_is_drawn_when_that_is_allowed() {
    let folder = Folder::new().file("dots.obj", NOTHING_TO_DRAW);
    folder.render(&["--allow-empty", "--background", "#ff0000", "dots.obj"]).ends(0);
    let picture = super::program::picture(&folder.path("dots.png"));
    assert!(picture.beauty.iter().all(|p| *p == [1.0, 0.0, 0.0, 1.0]));
}

#[test]
fn what_a_picture_cannot_hold_stops_it_where_warnings_are_errors() {
    let folder = Folder::with_cube();
    let words = ["cube.obj", "--background", "transparent", "-o", "cube.jpg"];
    folder.render(&words).ends(0).says(&["JPEG has no transparency"]);
    std::fs::remove_file(folder.path("cube.jpg")).unwrap();
    folder.render(&[&words[..], &["--strict"]].concat()).ends(3).says(&["JPEG has no transparency", "--strict"]);
    assert!(!folder.has("cube.jpg"));
    let bright = "[materials.hot]\nemission = [1e6, 1e6, 1e6]\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"hot\"\n";
    let folder = folder.file("bright.toml", bright);
    folder.render(&["bright.toml", "-o", "bright.exr"]).ends(0).says(&["half floats", "--float keeps them"]);
    std::fs::remove_file(folder.path("bright.exr")).unwrap();
    folder.render(&["bright.toml", "-o", "bright.exr", "--strict"]).ends(3).says(&["half floats", "--strict"]);
    assert!(!folder.has("bright.exr"));
    folder.render(&["bright.toml", "-o", "bright.exr", "--strict", "--float"]).ends(0);
}

#[test]
fn an_eye_that_looks_at_itself_is_refused_by_every_command() {
    let folder = Folder::with_cube();
    let eye = ["--eye", "1,2,3", "--at", "1,2,3"];
    for command in [
        &["render", "cube.obj"][..],
        &["trace", "cube.obj", "--pixel", "1,1"],
        &["explain", "cube.obj"],
        &["study", "cube.obj"],
        &["bench", "cube.obj"],
    ] {
        folder.run(&[command, &eye[..]].concat()).ends(2).says(&["--eye and --at are one point"]);
    }
}

#[test]
fn a_scene_that_cannot_be_written_is_not_made() {
    let folder = Folder::new();
    folder.run(&["generate", "tetra", "--size", "1e3", "-o", "gone/a.glb"]).ends(1).says(&["its folder is not there"]);
}

#[test]
fn a_root_that_is_not_there_is_told_as_that() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "--root", "gone"]).ends(1).says(&["gone: there is no such folder", "--root"]);
}

#[test]
fn warnings_do_not_stop_a_picture_unless_strict() {
    let folder = Folder::new().file("cube.obj", cube_with_a_bad_face());
    folder.render(&["cube.obj"]).ends(0).says(&["warning: cube.obj"]);
    assert!(folder.has("cube.png"));
    let folder = Folder::new().file("cube.obj", cube_with_a_bad_face());
    folder.render(&["--strict", "cube.obj"]).ends(3).says(&["cube.obj"]);
    assert!(!folder.has("cube.png"));
}

#[test]
fn warnings_of_one_kind_in_two_files_are_both_said() {
    let mtl = |name: &str, picture: &str| format!("newmtl {name}\nKd 1 1 1\nmap_Kd {picture}\n");
    let obj =
        "mtllib a.mtl b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 3/1 2/1 1/1\n";
    let folder =
        Folder::new().file("two.obj", obj).file("a.mtl", mtl("a", "lost-a.png")).file("b.mtl", mtl("b", "lost-b.png"));
    folder.render(&["two.obj"]).ends(0).says(&["a.mtl:3", "lost-a.png", "b.mtl:3", "lost-b.png"]);
}

#[test]
fn a_wrong_command_line_ends_in_2_and_names_the_nearest_word() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "--sampels", "4"]).ends(2).says(&["--sampels", "--samples"]);
    folder.run(&["rendr", "cube.obj"]).ends(2).says(&["render"]);
    folder.render(&["cube.obj", "--accel", "grid-octre"]).ends(2).says(&["grid-octree"]);
    folder.render(&["cube.obj", "--simd", "avx3"]).ends(2).says(&["avx3", "there are: portable"]);
    for wrong in
        ["--size=0x4", "--samples=0", "--fov=400", "--view=sideways", "--tone-map=film", "--background=purplish"]
    {
        let value = wrong.split_once('=').unwrap().1;
        folder.run(&["render", "cube.obj", wrong]).ends(2).says(&[value]);
    }
    // A number below 0 is an invalid colour, not a flag.
    folder.render(&["cube.obj", "--background", "-1,0,0"]).ends(2).says(&["-1,0,0", "three numbers from 0 to 1"]);
    folder.run(&["render"]).ends(2);
    assert_eq!(folder.names(), ["cube.obj"]);
}

#[test]
fn an_unknown_picture_type_is_told_before_anything_is_loaded() {
    // The input does not exist: had it been opened first, that would be the error.
    let run = Folder::new().render(&["missing.obj", "-o", "out.tif"]).ends(2).says(&[".png", ".exr", ".webp"]);
    assert!(!run.stderr.contains("missing.obj"), "{}", run.stderr);
}
