//! Messages on stderr, and their forms.

use super::program::{BROKEN_GLB, Folder, cube_with_a_bad_face};
use serde_json::Value;

#[test]
fn json_messages_are_one_object_a_line_with_stable_fields() {
    let folder = Folder::new().file("broken.glb", BROKEN_GLB).file("cube.obj", cube_with_a_bad_face());
    let run = folder.render(&["--messages", "json", "broken.glb", "cube.obj"]).ends(3);
    let messages: Vec<Value> = run.stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for message in &messages {
        for field in ["code", "file", "place", "text", "remedy"] {
            assert!(message[field].is_string(), "{field} of {message}");
        }
        assert!(!message["code"].as_str().unwrap().is_empty(), "{message}");
    }
    let of = |file: &str, severity: &str| {
        messages
            .iter()
            .any(|m| m["file"] == file && m["severity"] == severity && !m["text"].as_str().unwrap().is_empty())
    };
    assert!(of("broken.glb", "error") && of("cube.obj", "warning"), "{}", run.stderr);
}

#[test]
fn faults_of_a_file_name_it_apart_in_json_and_first_in_text() {
    let folder = Folder::with_cube().file("ball.toml", "[[spheres]]\ncenter=[0,0,0]\nradius=1\n");
    for (line, exit, code, file) in [
        ("generate tetra --size 10 -o none/tetra.glb", 1, "output-folder", "none/tetra.glb"),
        ("generate tetra -o tetra.stl", 2, "usage", "tetra.stl"),
        ("bench cube.obj --baseline none.json --fail-if n_it>+1%", 1, "baseline-unreadable", "none.json"),
        ("bench --spd .", 3, "nothing-to-measure", "."),
        ("verify ball.toml", 3, "nothing-to-verify", "ball.toml"),
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let run = folder.run(&[&words[..], &["--messages", "json"]].concat()).ends(exit);
        let last: Value = serde_json::from_str(run.stderr.lines().last().unwrap()).unwrap();
        assert_eq!((&last["code"], &last["file"]), (&code.into(), &file.into()), "{line}");
        let text = last["text"].as_str().unwrap();
        folder.run(&words).ends(exit).says(&[&format!("error: {file}: {text}")]);
    }
}

#[test]
fn quiet_says_nothing_when_all_is_well() {
    let run = Folder::with_cube().render(&["--quiet", "cube.obj"]).ends(0);
    assert_eq!(run.stderr, "");
}

#[test]
fn quiet_still_tells_warnings() {
    let folder = Folder::new().file("cube.obj", cube_with_a_bad_face());
    folder.render(&["--quiet", "cube.obj"]).ends(0).says(&["warning: cube.obj"]);
}

#[test]
fn no_bar_and_no_colour_reach_a_pipe() {
    for colour in ["0", "1"] {
        let folder = Folder::with_cube();
        let mut program = folder.program(&["render", "--size", "32x24", "cube.obj"]);
        let run = super::program::Run::of(program.env("CLICOLOR_FORCE", colour)).ends(0);
        assert!(!run.stderr.contains(['\r', '\u{1b}']), "{:?}", run.stderr);
    }
}

// Windows does not allow such a file name.
#[cfg(unix)]
#[test]
fn a_file_name_cannot_write_to_the_terminal() {
    let name = "bad\u{1b}[31m\nname.obj";
    let folder = Folder::new().file(name, "f 1 2 3\n");
    let run = folder.render(&[name]).ends(3);
    assert!(!run.stderr.contains('\u{1b}') && run.errors().len() == 1, "{:?}", run.stderr);
}

#[test]
fn words_that_are_not_understood_are_told_in_the_form_that_is_asked_for() {
    let folder = Folder::with_cube();
    for (words, part) in [
        (&["render", "cube.obj", "--sampels", "4", "--messages", "json"][..], "--sampels"),
        (&["render", "cube.obj", "--messages=json", "--size", "0x0"], "0x0"),
        (&["render", "--messages=json"], "INPUT"),
        (&["diff", "a.png", "--messages", "json"], "ACTUAL"),
    ] {
        let run = folder.run(words).ends(2);
        let message: Value = serde_json::from_str(run.stderr.trim_end()).unwrap();
        assert_eq!((&message["severity"], &message["code"]), (&"error".into(), &"usage".into()));
        let text = message["text"].as_str().unwrap();
        assert!(text.contains(part) && !text.contains("Usage:"), "{text}");
    }
    let run = folder.run(&["render", "cube.obj", "--sampels", "4", "--messages", "json"]);
    run.says(&[r#""remedy":"a similar argument exists: '--samples'""#]);
    folder.run(&["render", "cube.obj", "--sampels", "4"]).ends(2).says(&["error: unexpected argument"]);
    assert!(folder.run(&["render", "--help", "--messages", "json"]).ends(0).text().contains("Usage:"));
}

#[test]
fn pictures_that_show_next_to_nothing_are_written_with_a_warning() {
    let away = ["cube.obj", "--eye", "0,0,9", "--at", "0,0,99", "-o", "away.png"];
    Folder::with_cube()
        .render(&away)
        .ends(0)
        .says(&["warning: cube.obj: given eye: none of 4096 rays", "aim the eye with --at"]);
    // Whatever structure traces the rays, and in dry runs.
    for more in [["--accel", "none"], ["--dry-run", "-q"]] {
        let run = Folder::with_cube().render(&[&away[..], &more, &["--strict"]].concat()).ends(3);
        assert_eq!(run.says(&["none of 4096 rays", "--strict"]).text(), "");
    }
    // Neither half of the model can count as stray.
    let apart = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 100000 0 0\nv 100001 0 0\nv 100000 1 0\nf 1 2 3\nf 4 5 6\n";
    let folder = Folder::new().file("apart.obj", apart);
    folder
        .render(&["apart.obj"])
        .ends(0)
        .says(&["warning: apart.obj: default view: none of 4096 rays", "far from each other"]);
    // The face stands in the middle, on the border between two pixel columns.
    let (x, y) = ([0.0, 0.3, 0.3, 0.0], [0.0, 0.0, 99.0, 99.0]);
    let thin: String = (0..4).map(|i| format!("v {} {} 0\n", x[i], y[i])).collect();
    let run = Folder::new().file("thin.obj", thin + "f 1 2 3 4\n").render(&["thin.obj", "--view", "front"]).ends(0);
    assert!(!run.stderr.contains("warning"), "{}", run.stderr);
    let far = ["cube.obj", "--ortho=1e6", "--view", "front"];
    Folder::with_cube()
        .render(&far)
        .ends(0)
        .says(&["warning: cube.obj: front view: none of 4096 rays", "the height of --ortho"]);
    Folder::with_cube().render(&[&far[..], &["--strict"]].concat()).ends(3).says(&["none of 4096 rays", "--strict"]);
    let usual = Folder::with_cube().render(&["cube.obj"]).ends(0);
    assert!(!usual.stderr.contains("warning"), "{}", usual.stderr);
    for (ortho, lines) in [("--ortho", 0), ("--ortho=1e6", 1)] {
        let run = Folder::with_cube().render(&["cube.obj", "--turntable", "3", "--quiet", ortho]).ends(0);
        assert_eq!(run.stderr.lines().count(), lines, "{}", run.stderr);
    }
}
