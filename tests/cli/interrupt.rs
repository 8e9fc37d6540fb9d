//! Ctrl-C: the program ends within a second, and leaves no half picture.
#![cfg(unix)]

use super::program::Folder;
use serde_json::Value;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

fn start(folder: &Folder, arguments: &[&str]) -> Child {
    let mut program = Command::new(env!("CARGO_BIN_EXE_meshray"));
    program.args(arguments).current_dir(folder.path("")).stderr(Stdio::piped()).spawn().unwrap()
}

fn signal(child: &Child) {
    // Not Ctrl-C's SIGINT: a shell that runs the tests in the background may have made it ignored.
    send(child, "-TERM");
}

fn send(child: &Child, signal: &str) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn a_signal_that_whoever_started_it_wants_ignored_ends_nothing() {
    let folder = Folder::with_cube();
    for signal in ["HUP", "INT"] {
        let line = format!("trap '' {signal}; exec \"$@\"");
        let words = [&["-c", &line, "sh", env!("CARGO_BIN_EXE_meshray")], &LONG[..]].concat();
        let mut child =
            Command::new("sh").args(words).current_dir(folder.path("")).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        send(&child, &format!("-{signal}"));
        std::thread::sleep(Duration::from_millis(500));
        assert!(child.try_wait().unwrap().is_none(), "{signal} ended it");
        send(&child, "-TERM");
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
    }
}

/// A rendering that takes minutes.
const LONG: [&str; 6] = ["render", "cube.obj", "--size", "4000x4000", "--samples", "256"];

/// Starts a long run, interrupts it after a while, and returns its exit status and how long it took to end.
fn interrupted_after(folder: &Folder, arguments: &[&str], seconds: f64) -> (ExitStatus, Duration) {
    let mut child = start(folder, arguments);
    std::thread::sleep(Duration::from_secs_f64(seconds));
    assert!(child.try_wait().unwrap().is_none(), "it ended before it could be interrupted");
    let start = Instant::now();
    signal(&child);
    (child.wait().unwrap(), start.elapsed())
}

fn interrupted(folder: &Folder, arguments: &[&str]) -> (ExitStatus, Duration) {
    interrupted_after(folder, &[&LONG, arguments].concat(), 1.5)
}

/// The promise is one second; a machine that is busy with other tests gets a few.
const PATIENCE: Duration = Duration::from_secs(5);

#[test]
fn an_interrupted_render_leaves_nothing() {
    let folder = Folder::with_cube();
    let (status, time) = interrupted(&folder, &[]);
    assert_eq!(status.code(), Some(130));
    assert!(time < PATIENCE, "{time:?}");
    assert_eq!(folder.names(), ["cube.obj"]);
}

#[test]
fn what_is_done_is_kept_when_asked_for() {
    let folder = Folder::with_cube();
    let (status, time) = interrupted(&folder, &["--keep-partial"]);
    assert_eq!(status.code(), Some(130));
    assert!(time < PATIENCE, "{time:?}");
    assert_eq!(folder.names(), ["cube.obj", "cube.partial.png"]);
}

#[test]
fn a_picture_is_kept_whose_costs_are_being_counted() {
    let folder = Folder::with_cube();
    // Rays of the picture are traced in waves, those for timing one by one, three times.
    let words =
        ["render", "cube.obj", "--size", "1500x1500", "--quality", "draft", "--heatmap", "ms", "--keep-partial"];
    let (status, time) = interrupted_after(&folder, &words, 5.0);
    assert_eq!(status.code(), Some(130));
    assert!(time < PATIENCE, "{time:?}");
    assert_eq!(folder.names(), ["cube.obj", "cube.partial.png"]);
}

#[test]
fn a_file_that_is_being_written_when_the_signal_comes_is_finished() {
    // Sometimes the file is finished before the signal.
    for _ in 0..5 {
        let folder = Folder::new();
        let mut child = start(&folder, &["generate", "tetra", "--size", "4e6", "-o", "tetra.glb"]);
        let begun = Instant::now();
        while folder.names().is_empty() && child.try_wait().unwrap().is_none() {
            assert!(begun.elapsed() < PATIENCE, "no file yet");
            std::thread::yield_now();
        }
        if child.try_wait().unwrap().is_none() {
            signal(&child);
        }
        let code = child.wait().unwrap().code();
        assert!(matches!(code, Some(0 | 130)), "{code:?}");
        assert_eq!(folder.names(), ["tetra.glb"]);
    }
}

#[test]
fn the_end_is_told_in_the_form_that_is_asked_for() {
    let folder = Folder::with_cube();
    let said = |words: &[&str]| {
        let child = start(&folder, &[&LONG, words].concat());
        std::thread::sleep(Duration::from_millis(1500));
        signal(&child);
        String::from_utf8(child.wait_with_output().unwrap().stderr).unwrap()
    };
    let json = said(&["--messages", "json", "-q"]);
    let message: Value = serde_json::from_str(json.trim_end()).unwrap();
    assert_eq!((&message["severity"], &message["code"]), (&"error".into(), &"interrupted".into()), "{json}");
    assert_eq!(said(&["-q"]), "meshray: interrupted\n");
}

#[test]
fn what_waits_behind_a_slow_input_is_told() {
    let folder = (1..8).fold(Folder::with_cube(), |folder, i| folder.file(&format!("d{i}.obj"), "f 1 2 3\n"));
    let words = ["render", "./", "--size", "1000x1000", "--samples", "4096", "--aa", "uniform", "--threads", "2"];
    let child = start(&folder, &words);
    std::thread::sleep(Duration::from_millis(1500));
    signal(&child);
    let end = child.wait_with_output().unwrap();
    let said = String::from_utf8(end.stderr).unwrap();
    assert_eq!(end.status.code(), Some(130), "{said}");
    let lines: Vec<&str> = said.lines().collect();
    let told = (1..8).all(|i| lines[i - 1].starts_with(&format!("error: ./d{i}.obj")));
    assert!(told && lines[7].contains("interrupted"), "{said}");
}
