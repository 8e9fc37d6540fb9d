//! Writes a file atomically: nobody ever finds half of one under its name.

use std::fs::{self, Permissions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes `bytes` to a temporary file in the same folder and renames it to `path`. A failure leaves nothing behind.
///
/// A replaced file keeps its permissions, a new one gets the usual ones; a symbolic link stays, and its target
/// is replaced or created. Devices and pipes are written directly; a file that the process has open already
/// (`/dev/stdout`, `/dev/fd/3`) is continued where it was left.
///
/// # Errors
/// I/O errors, with the remedy where the folder is missing, `path` is a folder, or the file is read-only.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if let Some(number) = descriptor(path) {
        return write_on(number, path, bytes);
    }
    let target = destination(path);
    let old = match fs::metadata(&target) {
        Ok(old) if old.is_dir() => return Err(fault(ErrorKind::IsADirectory, "is a folder; name a file in it")),
        Ok(old) if !old.is_file() => return fs::write(&target, bytes),
        Ok(old) if old.permissions().readonly() => {
            return Err(fault(ErrorKind::PermissionDenied, "exists and is read-only; name another file"));
        }
        Ok(old) => Some(old.permissions()),
        Err(e) if e.kind() == ErrorKind::NotFound => None,
        Err(e) => return Err(e),
    };
    let folder = folder_of(&target);
    if !folder.is_dir() {
        let text = format!("folder {} does not exist; create it first", folder.display());
        return Err(io::Error::new(ErrorKind::NotFound, text));
    }
    write_and_rename(&target, &folder, old, bytes)
}

/// Whether [`write_atomic`] can create its file in the folder of `path`: tries one and removes it at once. True where `path`
/// is written directly, without such a file.
pub fn folder_takes(path: &Path) -> bool {
    let target = destination(path);
    let is_written_straight = descriptor(path).is_some() || fs::metadata(&target).is_ok_and(|old| !old.is_file());
    // Permissions do not suffice: some file systems accept no files from anybody. Where possible the trial file has no name.
    is_written_straight || tempfile::tempfile_in(folder_of(&target)).is_ok()
}

fn write_and_rename(target: &Path, folder: &Path, old: Option<Permissions>, bytes: &[u8]) -> io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".meshray-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The default mode of new files, less the umask. Temporary files would be private.
        builder.permissions(Permissions::from_mode(0o666));
    }
    // The error's own message would name the temporary file.
    let unmade =
        |e: io::Error| fault(e.kind(), &format!("no file can be made in folder {}: {}", folder.display(), e.kind()));
    let mut file = builder.tempfile_in(folder).map_err(unmade)?;
    file.as_file_mut().write_all(bytes)?;
    if let Some(permissions) = old {
        file.as_file().set_permissions(permissions)?;
    }
    file.persist(target).map_err(|e| e.error)?;
    Ok(())
}

/// Largest number of symbolic links to follow; a cycle of them leads nowhere.
const LINKS: usize = 40;

/// File descriptor that a path names, where it leads to one under which the process has a file open.
fn descriptor(path: &Path) -> Option<u32> {
    let mut target = path.to_owned();
    for _ in 0..LINKS {
        let number = target.file_name().and_then(|name| name.to_str()?.parse().ok());
        let next = fs::read_link(&target).ok();
        // Most paths are neither a number nor a link, and need no further system call.
        if number.is_none() && next.is_none() {
            return None;
        }
        let folder = fs::canonicalize(folder_of(&target)).ok()?;
        if folder == fs::canonicalize("/proc/self/fd").ok()? {
            return number;
        }
        target = folder.join(next?);
    }
    None
}

/// Appends to an open file.
fn write_on(number: u32, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let all = |out: &mut dyn Write| out.write_all(bytes).and_then(|()| out.flush());
    match number {
        1 => all(&mut io::stdout().lock()),
        2 => all(&mut io::stderr().lock()),
        _ => all(&mut fs::OpenOptions::new().append(true).open(path)?),
    }
}

/// Resolves symbolic links, also where the target does not exist yet; a path to a file that the process has open already
/// is returned unchanged.
pub fn destination(path: &Path) -> PathBuf {
    if descriptor(path).is_some() {
        return path.to_owned();
    }
    let mut target = path.to_owned();
    for _ in 0..LINKS {
        if let Ok(whole) = fs::canonicalize(&target) {
            return whole;
        }
        let Ok(next) = fs::read_link(&target) else { break };
        target = folder_of(&target).join(next);
    }
    target
}

/// Folder of a path; the current one for a bare file name.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

fn fault(kind: ErrorKind, text: &str) -> io::Error {
    io::Error::new(kind, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_made_and_replaced_and_nothing_else_is_left() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        for bytes in [b"one".as_slice(), b"two, longer", b""] {
            write_atomic(&path, bytes).unwrap();
            assert_eq!(fs::read(&path).unwrap(), bytes);
        }
        assert_eq!(names(dir.path()), ["a.png"]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let fault = write_atomic(&dir.path().join("out/a.png"), b"x").unwrap_err();
        assert_eq!(fault.kind(), ErrorKind::NotFound);
        assert!(fault.to_string().contains("out does not exist"), "{fault}");
    }

    #[test]
    fn a_folder_is_not_replaced_and_a_failed_rename_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        fs::create_dir(&path).unwrap();
        assert!(write_atomic(&path, b"x").unwrap_err().to_string().contains("is a folder"));
        assert!(write_and_rename(&path, dir.path(), None, b"x").is_err());
        assert_eq!(names(dir.path()), ["a.png"]);
    }

    #[test]
    fn a_bare_name_lies_in_the_current_folder() {
        assert_eq!(folder_of(Path::new("a.png")), Path::new("."));
        assert_eq!(folder_of(Path::new("b/a.png")), Path::new("b"));
    }

    #[cfg(unix)]
    mod unix {
        use super::*;
        use std::os::unix::fs::{PermissionsExt, symlink};

        fn mode(path: &Path) -> u32 {
            fs::metadata(path).unwrap().permissions().mode() & 0o777
        }

        #[test]
        fn permissions_are_the_usual_ones_or_those_of_the_replaced_file() {
            let dir = tempfile::tempdir().unwrap();
            let (usual, ours) = (dir.path().join("usual"), dir.path().join("ours"));
            fs::write(&usual, "x").unwrap();
            write_atomic(&ours, b"x").unwrap();
            assert_eq!(mode(&ours), mode(&usual));
            fs::set_permissions(&ours, Permissions::from_mode(0o640)).unwrap();
            write_atomic(&ours, b"y").unwrap();
            assert_eq!(mode(&ours), 0o640);
        }

        #[test]
        fn a_read_only_file_stays() {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("a.png");
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, Permissions::from_mode(0o444)).unwrap();
            assert!(write_atomic(&path, b"new").unwrap_err().to_string().contains("read-only"));
            assert_eq!(fs::read(&path).unwrap(), b"old");
        }

        #[test]
        fn a_folder_that_takes_no_files_is_known_before() {
            let dir = tempfile::tempdir().unwrap();
            let picture = dir.path().join("a.png");
            assert!(folder_takes(&picture) && folder_takes(Path::new("/dev/null")));
            fs::set_permissions(dir.path(), Permissions::from_mode(0o555)).unwrap();
            // Some users may write there all the same.
            let takes = write_atomic(&picture, b"x").map_err(|e| e.to_string());
            assert_eq!(folder_takes(&picture), takes.is_ok());
            assert_eq!(names(dir.path()).len(), usize::from(takes.is_ok()), "nothing is left of asking");
            assert!(takes.is_ok() || takes.is_err_and(|text| text.ends_with("permission denied")));
            fs::set_permissions(dir.path(), Permissions::from_mode(0o755)).unwrap();
        }

        #[cfg(target_os = "linux")]
        #[test]
        fn a_file_system_that_takes_no_files_from_anybody_is_known_before() {
            assert!(!folder_takes(Path::new("/proc/a.png")));
        }

        #[test]
        fn a_link_stays_a_link() {
            let dir = tempfile::tempdir().unwrap();
            let (real, link) = (dir.path().join("real.png"), dir.path().join("link.png"));
            fs::write(&real, "old").unwrap();
            symlink(&real, &link).unwrap();
            write_atomic(&link, b"new").unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(&real).unwrap(), b"new");
        }

        #[test]
        fn a_link_to_a_file_that_is_not_there_yet_stays_and_leads_there() {
            let dir = tempfile::tempdir().unwrap();
            let at = |name: &str| dir.path().join(name);
            fs::create_dir(at("deep")).unwrap();
            symlink("deep/link.png", at("first.png")).unwrap();
            symlink("../real.png", at("deep/link.png")).unwrap();
            write_atomic(&at("first.png"), b"new").unwrap();
            assert!(
                ["first.png", "deep/link.png"].iter().all(|name| fs::symlink_metadata(at(name)).unwrap().is_symlink())
            );
            assert_eq!(fs::read(at("real.png")).unwrap(), b"new");
            symlink("circle.png", at("circle.png")).unwrap();
            assert!(write_atomic(&at("circle.png"), b"new").is_err());
        }

        #[test]
        fn what_is_open_already_is_written_on_where_it_was_left() {
            use std::io::{Read, Seek};
            use std::os::fd::AsRawFd;
            let mut file = tempfile::tempfile().unwrap();
            file.write_all(b"head ").unwrap();
            let named = PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()));
            if !named.exists() {
                return;
            }
            write_atomic(&named, b"one ").unwrap();
            write_atomic(Path::new(&format!("/dev/fd/{}", file.as_raw_fd())), b"two").unwrap();
            let mut text = String::new();
            file.rewind().unwrap();
            file.read_to_string(&mut text).unwrap();
            assert_eq!(text, "head one two");
            let (mut reader, writer) = io::pipe().unwrap();
            write_atomic(Path::new(&format!("/proc/self/fd/{}", writer.as_raw_fd())), b"three").unwrap();
            drop(writer);
            text.clear();
            reader.read_to_string(&mut text).unwrap();
            assert_eq!(text, "three");
        }

        #[test]
        fn a_device_is_written_straight() {
            write_atomic(Path::new("/dev/null"), b"x").unwrap();
            assert!(!fs::metadata("/dev/null").unwrap().is_file());
        }
    }
}
