//! Which files are found, and which are refused.

use super::*;
use std::fs;

/// A folder `model/` with a file, and a secret beside it.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("model")).unwrap();
    fs::write(dir.path().join("model/a b.bin"), b"inside").unwrap();
    fs::write(dir.path().join("model/100%.bin"), b"percent").unwrap();
    fs::write(dir.path().join("model/❤.bin"), b"heart").unwrap();
    fs::write(dir.path().join("secret.bin"), b"outside").unwrap();
    dir
}

fn resolver(dir: &Path, options: &LoadOptions) -> Resolver {
    Resolver::new(&Source::new(dir.join("model/m.gltf"), b"m".to_vec()), options)
}

#[test]
fn escaped_unescaped_and_unicode_names_are_found() {
    let dir = folder();
    let mut r = resolver(dir.path(), &LoadOptions::default());
    for uri in ["a%20b.bin", "a b.bin", "./a b.bin", "../model/a%20b.bin"] {
        assert_eq!(r.read_uri(uri).unwrap().bytes, b"inside", "{uri}");
    }
    assert_eq!(r.read_uri("100%25.bin").unwrap().bytes, b"percent");
    assert_eq!(r.read_uri("100%.bin").unwrap().bytes, b"percent");
    assert_eq!(r.read_uri("%E2%9D%A4.bin").unwrap().bytes, b"heart");
    assert_eq!(r.finish().0.len(), 4, "the model and three files, each once");
}

#[test]
fn slashes_of_another_system_lead_to_files_and_not_out_of_the_root() {
    let dir = folder();
    fs::create_dir(dir.path().join("model/textures")).unwrap();
    fs::write(dir.path().join("model/textures/red.png"), b"red").unwrap();
    let mut r = resolver(dir.path(), &LoadOptions::default());
    for uri in ["textures\\red.png", ".\\textures\\red.png", "textures%5Cred.png"] {
        assert_eq!(r.read_uri(uri).unwrap().bytes, b"red", "{uri}");
    }
    assert!(matches!(r.read_uri("..\\secret.bin"), Err(FileFault::Outside { .. })));
    assert_eq!(r.read_uri("textures\\no.png").unwrap_err().to_string(), "'textures\\no.png' is not there");
    // A message stays readable, whatever the file says.
    assert!(r.read_uri(&"x".repeat(100_000)).unwrap_err().to_string().len() < 200);
}

#[test]
fn files_outside_the_root_are_refused_with_the_root_that_would_work() {
    let dir = folder();
    let secret = dir.path().join("secret.bin").to_string_lossy().into_owned();
    // With a drive letter it would be a URI with a scheme.
    let absolute = Some(secret.as_str()).filter(|_| !cfg!(windows));
    for name in ["../secret.bin", "..%2Fsecret.bin", "../no-such-file"].into_iter().chain(absolute) {
        let fault = resolver(dir.path(), &LoadOptions::default()).read_uri(name).unwrap_err();
        let FileFault::Outside { root: Some(root), within, .. } = fault else { panic!("{name}: {fault}") };
        assert_eq!(within, "the model's folder");
        let mut wider = resolver(dir.path(), &LoadOptions { root: Some(root), ..LoadOptions::default() });
        assert!(!matches!(wider.read_uri(name), Err(FileFault::Outside { .. })), "{name}");
    }
}

#[test]
fn of_standard_input_no_root_lets_names_out_and_none_is_advised() {
    let dir = folder();
    let options = LoadOptions { root: Some(dir.path().join("model")), ..LoadOptions::default() };
    let mut resolver = Resolver::new(&Source::new("-".into(), b"m".to_vec()), &options);
    let fault = resolver.read_uri("../secret.bin").unwrap_err();
    assert!(matches!(fault, FileFault::Outside { root: None, .. }), "{fault}");
    assert!(fault.diagnose(Path::new("-"), "").remedy.contains("instead of standard input"));
}

// Only where file names are case-sensitive.
#[cfg(target_os = "linux")]
#[test]
fn files_and_folders_are_found_in_another_case_below_the_root_alone() {
    let dir = folder();
    fs::create_dir_all(dir.path().join("model/Tex/Red")).unwrap();
    for name in ["a.PNG", "A.png", "b.png"] {
        fs::write(dir.path().join("model/Tex/Red").join(name), name).unwrap();
    }
    let mut r = resolver(dir.path(), &LoadOptions::default());
    let mut read = |uri: &str| -> Result<(String, String, bool), String> {
        let found = r.read_uri(uri).map_err(|e| e.to_string())?;
        Ok((found.path.to_string_lossy().into_owned(), String::from_utf8(found.bytes).unwrap(), found.guessed))
    };
    let at = |path: &str, bytes: &str, guessed| Ok((path.to_owned(), bytes.to_owned(), guessed));
    assert_eq!(read("Tex/Red/b.png"), at("Tex/Red/b.png", "b.png", false));
    for uri in ["TEX/RED/B.PNG", "tex\\red\\b.png", "./tex/Red/b%2EPNG", "TEX/../tex/red/b.png"] {
        let Ok((path, bytes, true)) = read(uri) else { panic!("{uri}") };
        assert!(path.ends_with("Tex/Red/b.png") && bytes == "b.png", "{uri}: {path}");
    }
    assert_eq!(read("tex/red/a.png"), at("Tex/Red/A.png", "A.png", true));
    assert_eq!(read("TEX/RED/C.PNG"), Err("'TEX/RED/C.PNG' is not there".into()));
    assert_eq!(
        read("../MODEL/a b.bin"),
        Err("'../MODEL/a b.bin' lies outside the model's folder, where nothing is read".into())
    );
    assert_eq!(read("TEX"), Err("'TEX' is not there".into()));
    assert!(read("../SECRET.bin").is_err() && read("Tex/../../SECRET.bin").is_err());
}

#[test]
fn what_is_to_be_done_helps() {
    let dir = folder();
    let told = |root: Option<PathBuf>, name: &str| {
        let mut r = resolver(dir.path(), &LoadOptions { root, ..LoadOptions::default() });
        r.read_uri(name).unwrap_err().diagnose(Path::new("a.gltf"), "").to_string()
    };
    assert!(told(None, "no.png").ends_with("put it beside the model"));
    assert!(told(None, "textures/no.png").ends_with("put it there, as seen from the model's folder"));
    assert!(told(None, "C:\\tex\\no.png").ends_with("elsewhere; name it by a relative path"));
    let wider = dir.path().canonicalize().unwrap();
    let outside = told(Some(wider.clone()), "../../no.png");
    assert!(outside.contains(&format!("lies outside '{}', where", wider.display())), "{outside}");
}

#[test]
fn nothing_is_read_that_is_not_left_of_the_budget() {
    let dir = folder();
    let mut r = resolver(dir.path(), &LoadOptions::default());
    let mut budget = Budget::new(&Limits { memory: 10, ..Limits::default() });
    assert_eq!(r.read_uri_within("a b.bin", &mut budget).unwrap().unwrap().bytes.len(), 6);
    let over = r.read_uri_within("a b.bin", &mut budget).unwrap().unwrap_err();
    assert_eq!((over.asked, over.left, budget.left()), (6, 4, 4));
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_does_not_lead_out() {
    let dir = folder();
    std::os::unix::fs::symlink(dir.path().join("secret.bin"), dir.path().join("model/link.bin")).unwrap();
    let fault = resolver(dir.path(), &LoadOptions::default()).read_uri("link.bin").unwrap_err();
    assert!(matches!(fault, FileFault::Outside { .. }), "{fault}");
}

#[cfg(unix)]
#[test]
fn a_pipe_is_refused_and_not_waited_for() {
    let dir = folder();
    let pipe = dir.path().join("model/pipe.bin");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let (done, answer) = std::sync::mpsc::channel();
    let mut resolver = resolver(dir.path(), &LoadOptions::default());
    std::thread::spawn(move || done.send(resolver.read_uri("pipe.bin")));
    let read = answer.recv_timeout(std::time::Duration::from_secs(20)).expect("still waiting");
    assert!(matches!(read, Err(FileFault::NotAFile(_))));
}

#[test]
fn networks_folders_and_large_files_are_refused() {
    let dir = folder();
    let mut options = LoadOptions::default();
    options.limits.file = 3;
    let mut r = resolver(dir.path(), &options);
    assert!(matches!(r.read_uri("https://example.org/a.bin"), Err(FileFault::Scheme(_))));
    assert!(matches!(r.read_uri("//example.org/a.bin"), Err(FileFault::Scheme(_))));
    assert!(matches!(r.read_uri("."), Err(FileFault::NotAFile(_))));
    assert!(matches!(r.read_uri(""), Err(FileFault::BadUri(_))));
    assert!(matches!(r.read_uri(":"), Err(FileFault::BadUri(_))));
    assert!(matches!(r.read_uri("%FF"), Err(FileFault::BadUri(_))));
    assert!(matches!(r.read_uri("a b.bin"), Err(FileFault::TooLarge { bytes: 6, limit: 3, .. })));
    assert!(matches!(r.read_uri("none.bin"), Err(FileFault::Missing(_))));
}

#[test]
fn the_hash_changes_with_any_file_read() {
    let dir = folder();
    let hash = || {
        let mut r = resolver(dir.path(), &LoadOptions::default());
        r.read_uri("a b.bin").unwrap();
        r.finish().1
    };
    let before = hash();
    assert_eq!(before, hash());
    fs::write(dir.path().join("model/a b.bin"), b"changed").unwrap();
    assert_ne!(before, hash());
}
