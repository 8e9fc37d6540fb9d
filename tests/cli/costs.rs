//! Costs of each pixel: layers of an EXR, and heat maps.

use super::program::{Folder, picture};
use meshray::image::{Channel, Picture};
use serde_json::Value;

fn channels(picture: &Picture) -> &[Channel] {
    &picture.layers.as_ref().expect("there are layers").channels
}

#[test]
fn counts_lie_beside_the_other_layers_and_add_up_to_the_statistics() {
    let folder = Folder::with_cube();
    let run =
        folder.render(&["cube.obj", "-o", "a.exr", "--layers", "tests,steps", "--float", "--stats", "json"]).ends(0);
    assert!(run.errors().is_empty(), "{}", run.stderr);
    let stats: Value = serde_json::from_str(run.text()).unwrap();
    folder.render(&["cube.obj", "-o", "b.exr", "--float", "--layers"]).ends(0);
    let (with, without) = (picture(&folder.path("a.exr")), picture(&folder.path("b.exr")));
    assert_eq!((with.beauty == without.beauty, channels(&without).len()), (true, 0));
    assert!(with.layers.as_ref().unwrap().depth == without.layers.as_ref().unwrap().depth);

    let mut names: Vec<_> = channels(&with).iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    let expected = ["primary", "reflected", "refracted", "shadow"];
    assert_eq!(names, ["steps", "tests"].map(|what| expected.map(|class| format!("{what}.{class}"))).concat());
    for channel in channels(&with) {
        let (what, class) = channel.name.split_once('.').unwrap();
        let sum: f64 = channel.values.iter().sum();
        assert_eq!(stats["counts"][class][what].as_f64(), Some(sum), "{}", channel.name);
    }
}

#[test]
fn layers_of_costs_take_a_file_behind_them_for_a_file() {
    let folder = Folder::with_cube();
    folder.render(&["-o", "a.exr", "--layers", "cube.obj"]).ends(0);
    assert_eq!(channels(&picture(&folder.path("a.exr"))).len(), 0);
    std::fs::create_dir(folder.path("tests")).unwrap();
    folder.render(&["cube.obj", "-o", "a.exr", "--layers", "tests"]).ends(0);
    assert_eq!(channels(&picture(&folder.path("a.exr"))).len(), 4, "a folder of that name is no model");
    folder.render(&["cube.obj", "-o", "a.exr", "--layers", "test"]).ends(2).says(&["tests, steps, mailbox, ms"]);
    folder.render(&["cube.obj", "-o", "a.png", "--layers", "tests"]).ends(2).says(&["EXR"]);
}

#[test]
fn a_picture_with_counts_can_be_made_again() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "a.exr", "--layers", "tests,mailbox", "--accel", "grid-octree"]).ends(0);
    folder.run(&["render", "--again", "a.exr", "-o", "b.exr"]).ends(0);
    assert!(folder.read("a.exr") == folder.read("b.exr"));
}

#[test]
fn heat_maps_lie_beside_the_picture_and_leave_it_as_it_is() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj"]).ends(0);
    let plain = folder.read("cube.png");
    folder
        .render(&["cube.obj", "--heatmap", "tests,ms"])
        .ends(0)
        .says(&["cube-tests.png: ray/prim tests per pixel of 1 ray,"]);
    assert!(folder.read("cube.png") == plain);
    assert_eq!(folder.names(), ["cube-ms.png", "cube-tests.png", "cube.obj", "cube.png"]);
    let map = picture(&folder.path("cube-tests.png"));
    assert!(map.width >= 32 && map.height > 24 + 20, "{} × {}", map.width, map.height);
    // The background costs less than the cube.
    let light = |x: usize, y: usize| map.beauty[y * map.width as usize + x][..3].iter().sum::<f32>();
    assert!(light(0, 0) < light(16, 12));

    let first = folder.read("cube-tests.png");
    folder.render(&["cube.obj", "--heatmap", "tests", "--heatmap-max", "1e6"]).ends(0);
    assert!(folder.read("cube-tests.png") != first, "another scale");
    folder.render(&["cube.obj", "-o", "x.exr", "--heatmap", "steps"]).ends(0);
    assert!(folder.has("x.exr") && folder.has("x-steps.png"));
}

#[test]
fn a_heat_map_replaces_nothing_that_is_not_ours() {
    let folder = Folder::with_cube().file("cube-tests.png", "precious");
    folder.render(&["cube.obj", "--heatmap", "tests"]).says(&["cube-tests.png", "-o"]);
    assert_eq!(folder.read("cube-tests.png"), b"precious");
    folder.render(&["cube.obj", "--heatmap", "tests", "-o", "-"]).ends(2).says(&["standard output"]);
    folder.render(&["cube.obj", "--heatmap-max", "5"]).ends(2);
}
