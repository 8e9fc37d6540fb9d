//! The program as seen by its users: a folder with files, a command line, an exit code, two streams.

use assert_cmd::Command;
use meshray::image::{FileKind, Metadata, Output, Picture, encode};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// A cube of six squares around the origin.
pub const CUBE: &str = "\
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// The same cube with one more face, which has no area and is dropped with a warning.
pub fn cube_with_a_bad_face() -> String {
    format!("{CUBE}f 1 1 2\n")
}

/// Points and lines with a non-finite position.
pub const NOTHING_TO_DRAW: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\np 4\nl 1 4\n";

/// A GLB whose header gives a greater length than the file has.
pub const BROKEN_GLB: &[u8] = b"glTF\x02\0\0\0\xff\xff\0\0\x10\0\0\0JSON{\"asset\":";

/// A temporary folder that is removed with this value.
pub struct Folder(TempDir);

/// A folder with a cube whose material has a texture, `cube.jpg`.
pub fn textured_cube() -> Folder {
    let white = Picture::of(2, 2, vec![[1.0; 4]; 4]);
    let texture = encode(&white, FileKind::Jpeg, &Output::default(), &Metadata::default()).unwrap();
    Folder::new()
        .file("cube.obj", format!("mtllib cube.mtl\nusemtl a\n{CUBE}"))
        .file("cube.mtl", "newmtl a\nmap_Kd cube.jpg\n")
        .file("cube.jpg", texture)
}

/// Result of a run.
pub struct Run {
    /// Exit code; `None` when a signal ended the run.
    pub code: Option<i32>,
    pub stdout: Vec<u8>,
    pub stderr: String,
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with the cube in it.
    pub fn with_cube() -> Self {
        Self::new().file("cube.obj", CUBE)
    }

    /// Adds a file, and its parent folders.
    pub fn file(self, name: &str, content: impl AsRef<[u8]>) -> Self {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
        self
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        let path = self.path(name);
        std::fs::read(&path).unwrap_or_else(|e| panic!("{name}: {e}; there are {:?}", self.names()))
    }

    pub fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// Names of all entries of the folder itself, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Returns the program, ready to run in this folder.
    pub fn program(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_meshray"));
        command.current_dir(self.0.path()).args(arguments).timeout(Duration::from_secs(300));
        command
    }

    /// Runs the program with these arguments.
    pub fn run(&self, arguments: &[&str]) -> Run {
        Run::of(&mut self.program(arguments))
    }

    /// Renders 32×24 pixels, one sample each, with further arguments.
    pub fn render(&self, arguments: &[&str]) -> Run {
        self.run(&[&["render", "--size", "32x24", "--samples", "1"], arguments].concat())
    }
}

impl Run {
    pub fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        let stderr = String::from_utf8(output.stderr).expect("messages are UTF-8");
        Self { code: output.status.code(), stdout: output.stdout, stderr }
    }

    /// Fails the test unless the run ended with this code; a panic of the program always fails.
    #[track_caller]
    pub fn ends(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "exit code, with this on stderr:\n{}", self.stderr);
        let panics = ["panicked at", "an error in meshray itself"];
        assert!(!panics.iter().any(|word| self.stderr.contains(word)), "{}", self.stderr);
        self
    }

    /// Fails the test unless stderr mentions all of these.
    #[track_caller]
    pub fn says(self, words: &[&str]) -> Self {
        for word in words {
            assert!(self.stderr.contains(word), "no `{word}` in stderr:\n{}", self.stderr);
        }
        self
    }

    /// Lines of stderr that begin with `error:`.
    pub fn errors(&self) -> Vec<&str> {
        self.stderr.lines().filter(|line| line.starts_with("error:")).collect()
    }

    /// stdout as text.
    #[track_caller]
    pub fn text(&self) -> &str {
        std::str::from_utf8(&self.stdout).expect("text on stdout is UTF-8")
    }
}

/// Reads a PNG or EXR file back.
#[track_caller]
pub fn picture(path: &Path) -> meshray::image::Picture {
    meshray::image::read_picture(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
