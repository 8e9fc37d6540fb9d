//! `meshray generate`: a scene of a given size, which can be rendered and read by other programs.

use super::program::Folder;

#[test]
fn a_generated_scene_can_be_inspected_and_rendered() {
    let folder = Folder::new();
    let run = folder.run(&["generate", "mountain", "--size", "3e3"]);
    assert_eq!((run.code, run.stdout.len()), (Some(0), 0), "{}", run.stderr);
    assert!(
        run.stderr.contains("mountain-3000.glb") && run.stderr.contains("triangles in 2 objects"),
        "{}",
        run.stderr
    );
    let inspected = folder.run(&["inspect", "mountain-3000.glb", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&inspected.stdout).unwrap();
    assert!(inspected.code == Some(0) && json.to_string().contains("KHR_materials_transmission"));
    assert_eq!(folder.run(&["render", "mountain-3000.glb", "--size", "16x12", "-q"]).code, Some(0));
    assert!(!folder.read("mountain-3000.png").is_empty());
}

#[test]
fn the_default_name_replaces_nothing_and_a_name_that_is_given_does() {
    let folder = Folder::new().file("tetra-100.glb", "mine");
    let run = folder.run(&["generate", "tetra", "--size", "100"]);
    assert!(run.code == Some(1) && run.stderr.contains("-o tetra-100.glb"), "{}", run.stderr);
    assert_eq!(folder.read("tetra-100.glb"), b"mine");
    assert_eq!(folder.run(&["generate", "tetra", "--size", "100", "-o", "tetra-100.glb", "-q"]).code, Some(0));
    assert!(folder.read("tetra-100.glb").starts_with(b"glTF"));
}

#[test]
fn what_cannot_be_generated_is_a_bad_command_line() {
    let folder = Folder::new();
    for line in ["generate teapot", "generate tetra --size 0", "generate tetra --size 1e9", "generate tetra -o a.stl"] {
        let run = folder.run(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(run.code, Some(2), "{line}: {}", run.stderr);
    }
    assert!(folder.names().is_empty());
}

#[test]
fn what_was_written_is_named_apart_for_programs() {
    let folder = Folder::new();
    let run = folder.run(&["generate", "tetra", "--size", "64", "-o", "a.obj", "--messages", "json"]).ends(0);
    let message: serde_json::Value = serde_json::from_str(&run.stderr).unwrap();
    assert_eq!((&message["code"], &message["file"]), (&"generated".into(), &"a.obj".into()));
    assert_eq!(message["text"], "tetra, 64 triangles in 1 object");
}
