//! Finds the files that models name: material libraries, pictures, buffers.
//!
//! Names come from other machines: with backslashes, with folders that were not shipped, in another case, and several
//! on one line although names may hold spaces. A file found elsewhere than its name says costs a warning; every file is
//! read through the [`Resolver`], so nothing outside the root is.

use crate::load::paths::{FileFault, Found, Resolver};
use std::path::{Component, Path, PathBuf};

/// Finds and reads files by inexact names.
pub(super) struct Finder<'a> {
    pub resolver: &'a mut Resolver,
    /// Number of names of the model that were not found anywhere.
    pub missed: &'a mut usize,
}

/// Number of misses after which further names are looked up only as written, as every guess searches several
/// folders.
const MISSES: usize = 256;

/// Location of a file.
#[derive(Debug)]
pub(super) struct FoundPath {
    /// Path relative to the model's folder, or absolute.
    pub path: PathBuf,
    /// Canonical path, the same for all names of a file.
    pub canonical: PathBuf,
    /// Whether the file lies elsewhere than its name says.
    pub guessed: bool,
}

impl Finder<'_> {
    /// Finds and reads `name`.
    pub(super) fn read(&mut self, name: &str, folders: &[&Path]) -> Result<Found, FileFault> {
        let FoundPath { path, guessed, .. } = self.find(name, folders)?;
        Ok(Found { bytes: self.resolver.read_file(&path)?, path, guessed })
    }

    /// Finds `name` in `folders` (relative to the model's): first as written, then in any case, then without its first
    /// folders, as written and in any case, then in folders that pictures are shipped in, last as a picture of another kind.
    /// The fault is that of the name as written.
    pub(super) fn find(&mut self, name: &str, folders: &[&Path]) -> Result<FoundPath, FileFault> {
        let slashed = name.replace('\\', "/");
        let mut fault = None;
        for folder in folders {
            for name in [name, &slashed] {
                let path = folder.join(name);
                match self.resolver.locate(&path) {
                    Ok(canonical) => return Ok(FoundPath { path, canonical, guessed: false }),
                    Err(e) => fault = fault.or(Some(e)),
                }
            }
        }
        self.elsewhere(&slashed, folders).ok_or_else(|| match fault {
            // The name as written, without the folder that was searched.
            Some(fault) if !fault.is_missing() => fault,
            _ => self.resolver.missing(Path::new(name)),
        })
    }

    fn elsewhere(&mut self, name: &str, folders: &[&Path]) -> Option<FoundPath> {
        if *self.missed >= MISSES {
            return None;
        }
        let place = self.guess(name, folders);
        *self.missed += usize::from(place.is_none());
        place
    }

    fn guess(&mut self, name: &str, folders: &[&Path]) -> Option<FoundPath> {
        let last = Path::new(name).file_name()?;
        let shortened = without_first_folders(name);
        let resolver = &mut *self.resolver;
        let in_folders = |name: &Path| folders.iter().map(|folder| folder.join(name)).collect::<Vec<_>>();
        let in_any_case = in_folders(Path::new(name)).iter().find_map(|path| resolver.in_any_case(path));
        let as_written =
            || shortened.iter().flat_map(|name| in_folders(name)).find(|path| resolver.locate(path).is_ok());
        let path = in_any_case.or_else(as_written).or_else(|| {
            let names = shortened.iter().cloned().chain(moved_or_converted(Path::new(last)));
            names.flat_map(|name| in_folders(&name)).find_map(|path| resolver.in_any_case(&path))
        })?;
        let canonical = self.resolver.locate(&path).ok()?;
        Some(FoundPath { path, canonical, guessed: true })
    }

    /// Reads the libraries of one `mtllib` statement: one name with spaces, or several names.
    pub(super) fn libraries(&mut self, names: &str) -> Vec<Result<Found, FileFault>> {
        let here = [Path::new("")];
        let unescaped = names.replace("\\ ", " ");
        if let Ok(found) = self.as_written(unquote(&unescaped)) {
            return vec![Ok(found)];
        }
        // Take as many words as make the name of a file, or as few as end like one.
        let words: Vec<String> = words(names);
        let mut out = Vec::new();
        let mut start = 0;
        while start < words.len() {
            if *self.missed >= MISSES {
                out.push(Err(self.resolver.missing(Path::new(&words[start..].join(" ")))));
                break;
            }
            let name = |end: usize| words[start..end].join(" ");
            let longest = (start + 1..=words.len()).rev().take(WORDS);
            let found = longest.map(|end| (end, self.as_written(&name(end)))).find(|(_, file)| file.is_ok());
            let end = match found {
                Some((end, file)) => {
                    out.push(file);
                    end
                }
                None => {
                    let ends_like_one = |&end: &usize| words[end - 1].to_lowercase().ends_with(".mtl");
                    let end = (start + 1..=words.len()).find(ends_like_one).unwrap_or(words.len());
                    out.push(self.read(&name(end), &here));
                    end
                }
            };
            start = end;
        }
        out
    }

    fn as_written(&mut self, name: &str) -> Result<Found, FileFault> {
        let path = PathBuf::from(name.replace('\\', "/"));
        Ok(Found { bytes: self.resolver.read_file(&path)?, path, guessed: false })
    }
}

/// Folders that pictures are shipped in.
const FOLDERS: [&str; 5] = ["textures", "texture", "maps", "images", "tex"];

/// Kinds of pictures that others are converted to before they are shipped, and the kinds that are converted.
const KINDS: [&str; 4] = ["png", "jpg", "jpeg", "webp"];
const CONVERTED: [&str; 9] = ["tif", "tiff", "tga", "bmp", "gif", "psd", "dds", "exr", "hdr"];

/// Paths that a picture may have been moved or converted to.
fn moved_or_converted(name: &Path) -> Vec<PathBuf> {
    let extension = name.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    if !KINDS.iter().chain(&CONVERTED).any(|kind| extension.eq_ignore_ascii_case(kind)) {
        return Vec::new();
    }
    let names = std::iter::once(name.to_path_buf()).chain(KINDS.iter().map(|kind| name.with_extension(kind)));
    let in_folders = |name: PathBuf| [""].iter().chain(&FOLDERS).map(move |folder| Path::new(folder).join(&name));
    names.flat_map(in_folders).collect()
}

/// Tails of a path, the longest first, of at most four components: for `C:/Users/me/house/maps/a.png` these are
/// `me/house/maps/a.png`, `house/maps/a.png`, `maps/a.png` and `a.png`.
fn without_first_folders(name: &str) -> Vec<PathBuf> {
    /// Most components of a tail; each tail costs file lookups.
    const MOST: usize = 4;
    let parts: Vec<Component> = Path::new(name).components().collect();
    let shorter = (1..parts.len()).map(|first| &parts[first..]).filter(|parts| parts.len() <= MOST);
    let is_plain = |parts: &&[Component]| parts.iter().all(|part| matches!(part, Component::Normal(_)));
    let mut all: Vec<PathBuf> = shorter.filter(is_plain).map(PathBuf::from_iter).collect();
    // A name without folders is its own tail.
    if let [Component::Normal(last)] = parts[..] {
        all.push(last.into());
    }
    all
}

/// Most words of one `mtllib` statement that are tried as one name; bounds the time.
const WORDS: usize = 32;

/// Splits at white space; a backslash keeps the space after it, quotes keep the spaces between them.
fn words(names: &str) -> Vec<String> {
    let mut out = vec![String::new()];
    let mut quoted = false;
    let mut chars = names.chars().peekable();
    while let Some(c) = chars.next() {
        let word = out.last_mut();
        match (c, word) {
            ('"', _) => quoted = !quoted,
            ('\\', Some(word)) if chars.peek() == Some(&' ') => word.extend(chars.next()),
            (c, Some(word)) if quoted || !c.is_whitespace() => word.push(c),
            _ => out.push(String::new()),
        }
    }
    out.retain(|word| !word.is_empty());
    out
}

/// Name without the quotes around it.
pub(super) fn unquote(name: &str) -> &str {
    name.strip_prefix('"').and_then(|n| n.strip_suffix('"')).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::{LoadOptions, Source};
    use std::fs;

    fn with_files<T>(files: &[&str], run: impl FnOnce(&mut Finder) -> T) -> T {
        let dir = tempfile::tempdir().unwrap();
        for file in files {
            let path = dir.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, file.as_bytes()).unwrap();
        }
        let source = Source::new(dir.path().join("m.obj"), Vec::new());
        let mut resolver = Resolver::new(&source, &LoadOptions::default());
        run(&mut Finder { resolver: &mut resolver, missed: &mut 0 })
    }

    fn libraries(files: &[&str], names: &str) -> Vec<String> {
        let shown = |found: Result<Found, FileFault>| match found {
            Ok(found) => String::from_utf8(found.bytes).unwrap(),
            Err(fault) => fault.to_string(),
        };
        with_files(files, |finder| finder.libraries(names).into_iter().map(shown).collect())
    }

    #[test]
    fn a_thousand_names_of_nothing_are_not_looked_for_one_by_one() {
        with_files(&["a.mtl"], |finder| {
            let names: Vec<String> = (0..1000).map(|i| format!("{i}.mtl")).collect();
            let found = finder.libraries(&names.join(" "));
            assert!(found.len() == MISSES + 1 && found.iter().all(Result::is_err), "{}", found.len());
            assert!(finder.libraries("a.mtl")[0].is_ok());
            if cfg!(target_os = "linux") {
                assert!(finder.find("A.mtl", &[Path::new("")]).is_err());
            }
        });
    }

    #[test]
    fn one_statement_may_name_several_libraries_with_or_without_spaces() {
        let files = ["a.mtl", "b c.mtl", "d/e.mtl"];
        assert_eq!(libraries(&files, "a.mtl"), ["a.mtl"]);
        assert_eq!(libraries(&files, "b c.mtl"), ["b c.mtl"]);
        assert_eq!(libraries(&files, "a.mtl b c.mtl d/e.mtl"), ["a.mtl", "b c.mtl", "d/e.mtl"]);
        assert_eq!(libraries(&files, "\"b c.mtl\" a.mtl"), ["b c.mtl", "a.mtl"]);
        assert_eq!(libraries(&files, "b\\ c.mtl"), ["b c.mtl"]);
        assert_eq!(libraries(&files, "d\\e.mtl"), ["d/e.mtl"]);
        assert_eq!(libraries(&files, "no such.mtl a.mtl"), ["'no such.mtl' is not there", "a.mtl"]);
        assert_eq!(libraries(&files, "lost"), ["'lost' is not there"]);
        assert!(libraries(&files, "").is_empty());
        let many = libraries(&files, &"word ".repeat(20_000));
        assert!(many.iter().all(|told| told.len() < 200), "{}", many[0].len());
    }

    // Only where file names are case-sensitive.
    #[cfg(target_os = "linux")]
    #[test]
    fn files_are_found_by_their_last_name_and_in_another_case() {
        let read = |name: &str| {
            with_files(&["maps/Wood.PNG", "here.png"], |finder| {
                let found = finder.read(name, &[Path::new("maps"), Path::new("")]);
                found.map(|f| (f.path.to_string_lossy().into_owned(), f.guessed)).map_err(|e| e.to_string())
            })
        };
        assert_eq!(read("Wood.PNG"), Ok(("maps/Wood.PNG".into(), false)));
        assert_eq!(read("wood.png"), Ok(("maps/Wood.PNG".into(), true)));
        assert_eq!(read("C:\\Users\\me\\wood.png"), Ok(("maps/Wood.PNG".into(), true)));
        assert_eq!(read("..\\maps\\Wood.PNG"), Ok(("maps/../maps/Wood.PNG".into(), false)));
        assert_eq!(read("/else/where/here.png"), Ok(("here.png".into(), true)));
        assert_eq!(read("MAPS\\wood.png"), Ok(("maps/Wood.PNG".into(), true)));
        assert_eq!(read("tex\\none.png"), Err("'tex\\none.png' is not there".into()));
        assert!(read("/etc/hostname").unwrap_err().contains("outside"));
    }

    #[test]
    fn pictures_are_found_in_the_folders_that_they_were_shipped_in() {
        let read = |name: &str| {
            with_files(&["textures/wood.png", "house/maps/door.jpg"], |finder| {
                let found = finder.read(name, &[Path::new("")]);
                found.map(|f| (f.path.to_string_lossy().into_owned(), f.guessed)).map_err(|e| e.to_string())
            })
        };
        for name in [
            "C:\\Users\\me\\Desktop\\house\\textures\\wood.png",
            "..\\textures\\wood.png",
            "/Users/me/textures/wood.png",
            "\\textures\\wood.png",
            "/textures/wood.png",
            "wood.png",
            "wood.tif",
            "/else/where/Wood.TGA",
        ] {
            assert_eq!(read(name), Ok(("textures/wood.png".into(), true)), "{name}");
        }
        assert_eq!(read("D:/jobs/house/maps/door.jpg"), Ok(("house/maps/door.jpg".into(), true)));
        assert_eq!(read("House/maps/door.jpg"), Ok(("house/maps/door.jpg".into(), true)));
        assert_eq!(read("wood.mtl"), Err("'wood.mtl' is not there".into()));
        assert_eq!(read("other.png"), Err("'other.png' is not there".into()));
    }
}
