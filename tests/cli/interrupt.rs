//! Ctrl-C: over within a second, and no half picture.
#![cfg(unix)]

use super::program::Folder;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Starts a render that takes minutes, interrupts it while it draws, and tells how and how fast it ended.
fn interrupted(folder: &Folder, arguments: &[&str]) -> (ExitStatus, Duration) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_meshray"))
        .args(["render", "cube.obj", "--size", "4000x4000", "--samples", "256"])
        .args(arguments)
        .current_dir(folder.path(""))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    assert!(child.try_wait().unwrap().is_none(), "the render ended before it could be interrupted");
    let start = Instant::now();
    let signal = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(signal.success());
    (child.wait().unwrap(), start.elapsed())
}

/// A second is promised; a machine that is busy with other tests gets a few.
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
