//! Which files a model may name, and which were read.
//!
//! A glTF or MTL names other files, and whoever wrote it is not trusted: files are read only below a root folder, after
//! symbolic links are resolved, and never from a network. Everything read is listed and hashed, so that a picture can
//! say exactly what it was made from.

use super::limits::{Budget, OverBudget};
use super::{Diagnostic, Limits, LoadOptions, Source, whole};
use crate::stopwatch::{Spent, Stopwatch};
use percent_encoding::percent_decode_str;
use std::cell::Cell;
use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use xxhash_rust::xxh3::xxh3_128;

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRead {
    /// As it was named, from the folder of the model as that was.
    pub path: PathBuf,
    /// xxh3-128 of its bytes.
    pub hash: u128,
}

impl AsRef<Path> for FileRead {
    fn as_ref(&self) -> &Path {
        &self.path
    }
}

/// Reads the files that a model names.
#[derive(Clone, Debug)]
pub struct Resolver {
    /// Folder that relative names start from; canonical.
    base: PathBuf,
    /// The same as it was named.
    named: PathBuf,
    /// Nothing outside this folder is read; canonical.
    root: PathBuf,
    /// Those of a file.
    limits: Limits,
    /// Each with what it counts for in the hash of all.
    read: Vec<(FileRead, u128)>,
    /// Canonical path -> index into `read`.
    known: HashMap<PathBuf, usize>,
    /// What lies in the folders that were looked through for a name in another case: names by their small letters.
    listed: HashMap<PathBuf, HashMap<String, String>>,
    reading: Spent,
    /// Whether anything was looked for where it was not.
    gaps: Cell<bool>,
}

/// A file that was read.
#[derive(Debug)]
pub struct Found {
    /// Path relative to the model's folder, or absolute.
    pub path: PathBuf,
    /// What it holds.
    pub bytes: Vec<u8>,
    /// Whether it lies elsewhere than its name says.
    pub guessed: bool,
}

impl Found {
    /// A note that the file lies elsewhere than `name` says, about `place` in `file`.
    pub fn note(&self, name: &str, file: &Path, place: &str) -> Option<Diagnostic> {
        self.guessed.then(|| Diagnostic::new("file-elsewhere", file, place, taken_from(name, &self.path)))
    }
}

/// Why a named file was not read.
#[derive(Debug, thiserror::Error)]
pub enum FileFault {
    /// It lies outside the root.
    #[error("'{name}' lies outside {within}, where nothing is read")]
    Outside {
        /// As written in the model.
        name: String,
        /// What it lies outside of, in words.
        within: String,
        /// The `--root` that would allow it.
        root: PathBuf,
    },
    /// There is no such file.
    #[error("'{0}' is not there")]
    Missing(String),
    /// It is a folder, a device or the like.
    #[error("'{0}' is not a plain file")]
    NotAFile(String),
    /// It is larger than [`super::Limits::file`].
    #[error("'{name}' has {bytes} bytes where {limit} are allowed")]
    TooLarge {
        /// As written in the model.
        name: String,
        /// Its size.
        bytes: u64,
        /// The limit.
        limit: u64,
        /// What lets it in, if anything does.
        remedy: &'static str,
    },
    /// The name is a URI of another machine or an unknown scheme.
    #[error("'{0}' is not a relative file name, and nothing is fetched from elsewhere")]
    Scheme(String),
    /// The name cannot be a URI or file name.
    #[error("'{0}' is not a valid URI")]
    BadUri(String),
    /// The system refused.
    #[error("'{name}': {source}")]
    Io {
        /// As written in the model.
        name: String,
        /// What the system said.
        source: io::Error,
    },
}

impl FileFault {
    /// The code of a file that is not there.
    pub const MISSING: &str = "file-missing";

    /// This fault as a message about `place` in `file`.
    pub fn diagnose(&self, file: &Path, place: &str) -> Diagnostic {
        let (code, remedy) = match self {
            Self::Outside { root, .. } => ("file-outside-root", format!("allow it with --root '{}'", root.display())),
            Self::Missing(name) if name.contains(['/', '\\']) => {
                (Self::MISSING, "put it there, as seen from the model's folder".into())
            }
            Self::Missing(_) => (Self::MISSING, "put it beside the model".into()),
            Self::NotAFile(_) => ("file-not-plain", String::new()),
            Self::TooLarge { remedy, .. } => ("file-too-large", (*remedy).into()),
            Self::Scheme(uri) if is_on_a_drive(uri) => ("uri-scheme", "name it by a relative path".into()),
            Self::Scheme(_) => ("uri-scheme", "download it and name it by a relative path".into()),
            Self::BadUri(_) => ("uri-invalid", String::new()),
            Self::Io { .. } => ("file-unreadable", String::new()),
        };
        Diagnostic::new(code, file, place, self.to_string()).remedy(remedy)
    }
}

impl Resolver {
    /// A resolver for what `source` names; `source` itself is the first file read.
    ///
    /// Relative names start from the folder of `source`; where `source` has none (standard input), from the root, or
    /// else from the current folder.
    pub fn new(source: &Source, options: &LoadOptions) -> Self {
        let current = || PathBuf::from(".");
        let folder = source.path.parent().filter(|p| !p.as_os_str().is_empty());
        let base = match folder {
            Some(folder) => folder.to_path_buf(),
            None if source.is_stdin() => options.root.clone().unwrap_or_else(current),
            None => current(),
        };
        let named = if folder.is_none() && base == current() { PathBuf::new() } else { base.clone() };
        let base = base.canonicalize().unwrap_or(base);
        let root = options.root.clone().unwrap_or_else(|| base.clone());
        let root = root.canonicalize().unwrap_or(root);
        let mut resolver = Self {
            base,
            named,
            root,
            limits: options.limits,
            read: Vec::new(),
            known: HashMap::new(),
            listed: HashMap::new(),
            reading: Spent::default(),
            gaps: Cell::new(false),
        };
        let canonical = source.path.canonicalize().unwrap_or_else(|_| source.path.clone());
        resolver.note(canonical, source.path.clone(), &source.bytes);
        resolver
    }

    /// Reads a file that a URI reference (RFC 3986) names: percent escapes are decoded, schemes refused.
    ///
    /// `data:` URIs are not for this.
    pub fn read_uri(&mut self, uri: &str) -> Result<Found, FileFault> {
        let name = file_name_of_uri(uri)?;
        let (path, guessed) = self.find(&name, uri)?;
        Ok(Found { bytes: self.read_file(&path)?, path, guessed })
    }

    /// The same, if the file's bytes are left of the budget, from which they are taken before it is read.
    pub fn read_uri_within(&mut self, uri: &str, budget: &mut Budget) -> Result<Result<Found, OverBudget>, FileFault> {
        let name = file_name_of_uri(uri)?;
        let (path, guessed) = self.find(&name, uri)?;
        Ok(self.read_file_within(&path, budget)?.map(|bytes| Found { bytes, path, guessed }))
    }

    /// Where a file is that a URI names, and whether that is a guess.
    fn find(&mut self, name: &str, uri: &str) -> Result<(PathBuf, bool), FileFault> {
        let slashed = name.replace('\\', "/");
        // Exporters write names with a literal '%' unescaped, or with another system's slashes, often enough.
        for path in [name, uri, &slashed].map(PathBuf::from) {
            match self.locate(&path) {
                Ok(_) => return Ok((path, false)),
                Err(FileFault::Missing(_)) => {}
                Err(fault) => return Err(fault),
            }
        }
        let in_any_case = self.in_any_case(Path::new(&slashed));
        in_any_case.map(|path| (path, true)).ok_or_else(|| FileFault::Missing(shown(Path::new(name))))
    }

    /// The path of an existing plain file below the root that differs from `name` only in the case of letters, be it of
    /// the file or of folders; of several, the first by name.
    pub fn in_any_case(&mut self, name: &Path) -> Option<PathBuf> {
        let mut path = PathBuf::new();
        for part in name.components() {
            match part {
                Component::CurDir => {}
                Component::Normal(part) if !self.base.join(&path).join(part).exists() => {
                    let part = part.to_str()?.to_ascii_lowercase();
                    let listed = self.listed(&path)?.get(&part)?;
                    path.push(listed);
                }
                part => path.push(part),
            }
        }
        self.locate(&path).is_ok().then_some(path)
    }

    /// What lies in a folder below the root: names by their small letters.
    fn listed(&mut self, folder: &Path) -> Option<&HashMap<String, String>> {
        /// Files of one folder that are looked at; bounds the time.
        const LISTED: usize = 10_000;
        let folder = self.base.join(folder).canonicalize().ok().filter(|folder| folder.starts_with(&self.root))?;
        let list = |folder: &PathBuf| {
            let entries = fs::read_dir(folder).into_iter().flatten().take(LISTED).flatten();
            let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
            // Of names that are the same in small letters, the first is the last to be put in.
            names.sort_unstable_by(|a, b| b.cmp(a));
            names.into_iter().map(|name| (name.to_ascii_lowercase(), name)).collect()
        };
        Some(self.listed.entry(folder).or_insert_with_key(list))
    }

    /// Reads a file named by a path, relative to the model or absolute.
    pub fn read_file(&mut self, name: &Path) -> Result<Vec<u8>, FileFault> {
        let shown = || shown(name);
        let io = |source| FileFault::Io { name: shown(), source };
        let path = self.locate(name)?;
        let watch = Stopwatch::of_this_thread();
        let file = fs::File::open(&path).map_err(io)?;
        let meta = file.metadata().map_err(io)?;
        if !meta.is_file() {
            return Err(FileFault::NotAFile(shown()));
        }
        let (limit, remedy) = (self.limits.file, self.limits.remedy_for_file());
        let too_large = |bytes| FileFault::TooLarge { name: shown(), bytes, limit, remedy };
        if meta.len() > limit {
            return Err(too_large(meta.len()));
        }
        // What other threads would do meanwhile is not in this one's time.
        let bytes = whole::read_in_turn(file, meta.len(), limit).map_err(io)?;
        if bytes.len() as u64 > limit {
            return Err(too_large(bytes.len() as u64));
        }
        self.reading += watch.read();
        self.note(path, self.as_named(name), &bytes);
        Ok(bytes)
    }

    /// The same, if its bytes are left of the budget, from which they are taken before it is read.
    pub fn read_file_within(
        &mut self,
        name: &Path,
        budget: &mut Budget,
    ) -> Result<Result<Vec<u8>, OverBudget>, FileFault> {
        let said = self.length(&self.locate(name)?);
        if said <= self.limits.file
            && let Err(over) = budget.take(said, 1)
        {
            return Ok(Err(over));
        }
        let bytes = self.read_file(name)?;
        // It may have grown meanwhile, or the system does not say how long it is.
        Ok(budget.take((bytes.len() as u64).saturating_sub(said), 1).map(|()| bytes))
    }

    /// A file as it is named, from the folder of the model as that was.
    pub fn as_named(&self, name: &Path) -> PathBuf {
        self.named.join(name)
    }

    /// Time that reading named files has taken.
    pub fn reading(&self) -> Spent {
        self.reading
    }

    /// Nothing outside this folder is read; canonical.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The canonical path of an existing plain file below the root: opening anything else, such as a pipe, could wait
    /// for ever.
    pub fn locate(&self, name: &Path) -> Result<PathBuf, FileFault> {
        let shown = shown(name);
        if name.as_os_str().is_empty() || name.as_os_str().as_encoded_bytes().contains(&0) {
            return Err(FileFault::BadUri(shown));
        }
        let outside = |path: &Path| FileFault::Outside {
            name: shown.clone(),
            within: match self.root == self.base {
                true => "the model's folder".into(),
                false => format!("'{}'", self.root.display()),
            },
            root: common_folder(&self.root, path),
        };
        let wanted = self.base.join(name);
        match wanted.canonicalize() {
            Ok(path) if path.starts_with(&self.root) => match fs::metadata(&path) {
                Ok(meta) if meta.is_file() => Ok(path),
                Ok(_) => Err(FileFault::NotAFile(shown)),
                Err(source) => Err(FileFault::Io { name: shown, source }),
            },
            Ok(path) => Err(outside(&path)),
            // Whether a file outside the root exists is nobody's business.
            Err(_) if !lexical(&wanted).starts_with(&self.root) => Err(outside(&lexical(&wanted))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                self.gaps.set(true);
                Err(FileFault::Missing(shown))
            }
            Err(source) => Err(FileFault::Io { name: shown, source }),
        }
    }

    /// Bytes of a file that [`Self::locate`] has found; 0 where the system does not say.
    pub fn length(&self, canonical: &Path) -> u64 {
        fs::metadata(canonical).map_or(0, |meta| meta.len())
    }

    fn note(&mut self, canonical: PathBuf, shown: PathBuf, bytes: &[u8]) {
        self.known.entry(canonical).or_insert_with(|| {
            let hash = xxh3_128(bytes);
            self.read.push((FileRead { path: shown, hash }, hash));
            self.read.len() - 1
        });
    }

    /// Adds the files of a model that was loaded on behalf of this one; `hash` is that of all of them.
    pub fn absorb(&mut self, files: &[FileRead], hash: u128, gaps: bool) {
        self.gaps.set(self.gaps.get() || gaps);
        let rest = files.iter().skip(1).map(|file| (file.clone(), 0));
        self.read.extend(files.first().map(|file| (file.clone(), hash)));
        self.read.extend(rest);
    }

    /// Every file read, in the order first read, and the xxh3-128 of their xxh3-128 hashes (little-endian) in that
    /// order, and whether any was looked for where it was not.
    pub fn finish(self) -> (Vec<FileRead>, u128, bool) {
        let hashes: Vec<u8> = self.read.iter().flat_map(|(_, counted)| counted.to_le_bytes()).collect();
        (self.read.into_iter().map(|(file, _)| file).collect(), xxh3_128(&hashes), self.gaps.get())
    }
}

/// The file name that a relative URI reference stands for.
fn file_name_of_uri(uri: &str) -> Result<String, FileFault> {
    let scheme = uri.split_once(':').map(|(scheme, _)| scheme);
    let is_scheme = |s: &str| {
        s.starts_with(|c: char| c.is_ascii_alphabetic())
            && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    };
    if uri.starts_with(':') {
        return Err(FileFault::BadUri(shorten(uri)));
    }
    if scheme.is_some_and(is_scheme) || uri.starts_with("//") {
        return Err(FileFault::Scheme(shorten(uri)));
    }
    percent_decode_str(uri).decode_utf8().map(|s| s.into_owned()).map_err(|_| FileFault::BadUri(shorten(uri)))
}

/// Whether a name begins with the letter of a drive, as other systems' do.
fn is_on_a_drive(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|letter| letter.is_ascii_alphabetic()) && chars.next() == Some(':')
}

/// A file name in messages: whole, unless no system has names so long.
pub(crate) fn shown(name: &Path) -> String {
    const LONGEST: usize = 255;
    let name = name.to_string_lossy();
    if name.chars().nth(LONGEST).is_some() { shorten(&name) } else { name.into_owned() }
}

/// That a file lies elsewhere than its name says.
pub(crate) fn taken_from(name: &str, path: &Path) -> String {
    format!("'{}' is taken from '{}'", shorten(name), path.display())
}

/// The beginning of a text that may be megabytes long.
pub(crate) fn shorten(text: &str) -> String {
    const KEPT: usize = 80;
    if text.chars().nth(KEPT).is_none() { text.into() } else { text.chars().take(KEPT).chain(['…']).collect() }
}

/// `path` with `.` and `..` taken out by text alone; above a root there is nothing, and `..` that lead out of a relative path
/// stay.
pub(crate) fn lexical(path: &Path) -> PathBuf {
    let mut clean = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if clean.file_name().is_some() || clean.has_root() => {
                clean.pop();
            }
            other => clean.push(other),
        }
    }
    clean
}

/// The innermost folder that holds both.
fn common_folder(folder: &Path, file: &Path) -> PathBuf {
    let both = folder.components().zip(file.parent().unwrap_or(file).components());
    both.take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        Resolver::new(&Source { path: dir.join("model/m.gltf"), bytes: b"m".to_vec() }, options)
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
        // With the letter of a drive it would be a URI of another kind.
        let absolute = Some(secret.as_str()).filter(|_| !cfg!(windows));
        for name in ["../secret.bin", "..%2Fsecret.bin", "../no-such-file"].into_iter().chain(absolute) {
            let fault = resolver(dir.path(), &LoadOptions::default()).read_uri(name).unwrap_err();
            let FileFault::Outside { root, within, .. } = fault else { panic!("{name}: {fault}") };
            assert_eq!(within, "the model's folder");
            let mut wider = resolver(dir.path(), &LoadOptions { root: Some(root), ..LoadOptions::default() });
            assert!(!matches!(wider.read_uri(name), Err(FileFault::Outside { .. })), "{name}");
        }
    }

    // Where names in another case are other files.
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
}
