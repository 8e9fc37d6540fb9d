//! `--profile`: the time spent on each part of a picture.

use super::program::Folder;
use serde_json::Value;

#[test]
fn a_profile_tells_every_stage_and_leaves_the_picture_as_it_is() {
    let folder = Folder::with_cube();
    folder.render(&["cube.obj", "-o", "plain.png"]).ends(0);
    let run = folder.render(&["cube.obj", "-o", "profiled.png", "--profile"]).ends(0);
    run.says(&["start", "read", "parse", "place", "build", "primary", "shadow", "shade", "encode", "write", "all"]);
    assert!(folder.read("plain.png") == folder.read("profiled.png"));
}

#[test]
fn programs_read_the_profile_in_the_statistics() {
    let folder = Folder::with_cube();
    let run = folder.render(&["cube.obj", "-q", "--stats", "json", "--profile"]).ends(0);
    assert_eq!(run.stderr, "", "quiet is quiet");
    let stats: Value = serde_json::from_str(run.text()).unwrap();
    let stages = stats["profile"]["stages"].as_array().unwrap();
    let stage = |name: &str| stages.iter().find(|s| s["stage"] == name).unwrap();
    assert_eq!(stage("primary")["rays"], 32 * 24);
    assert_eq!((&stage("primary")["part_of"], &stage("tiles")["part_of"]), (&"tiles".into(), &Value::Null));
    assert!(stage("tiles")["wall"].as_f64() > Some(0.0));
    let stats: Value = serde_json::from_str(folder.render(&["cube.obj", "--stats", "json"]).ends(0).text()).unwrap();
    assert_eq!(stats["profile"], Value::Null);
}

#[test]
fn further_views_do_not_tell_the_loading_again() {
    let folder = Folder::with_cube();
    let views = ["cube.obj", "--view", "front", "--view", "top", "--profile"];
    let run = folder.render(&views).ends(0);
    let lines = |word: &str| run.stderr.lines().filter(|line| line.split_whitespace().next() == Some(word)).count();
    assert_eq!([lines("read"), lines("build"), lines("encode"), lines("start")], [1, 2, 2, 1], "{}", run.stderr);
}
