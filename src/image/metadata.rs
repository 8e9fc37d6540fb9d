//! Metadata of a picture: how it was made, as key/value texts under stable names, written into every format and read back.
//!
//! | format | where |
//! |---|---|
//! | PNG | one iTXt chunk for each entry, before the pixels |
//! | EXR | one string attribute for each entry |
//! | JPEG, WebP | EXIF `ImageDescription`: one JSON object of all entries |
//!
//! All of them also carry the program's name in the format's own field for it (`Software`, `software`).
//! Files are not trusted: only the head of a file is parsed, and no text longer than [`MAX_TEXT`] is taken.

use super::{FileKind, ImageError, exif, exr, png};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Longest text taken from a file, in bytes.
pub const MAX_TEXT: usize = 1 << 20;

/// Longest key, in bytes: the limit of PNG.
const LONGEST_KEY: usize = 79;

/// Prefix of every key; other entries of a file are ignored.
pub const PREFIX: &str = "meshray:";

/// Key/value texts of a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata {
    entries: BTreeMap<String, String>,
}

impl Metadata {
    /// Version of the program that wrote the picture; its presence marks a picture of meshray.
    pub const VERSION: &'static str = "meshray:version";
    /// Every setting that decides the pixels, as a JSON object: what `--again` repeats.
    pub const SETTINGS: &'static str = "meshray:settings";
    /// Names of the input files as given, as a JSON array.
    pub const INPUT: &'static str = "meshray:input";
    /// Hash of the bytes of every file read, in hexadecimal.
    pub const INPUT_HASH: &'static str = "meshray:input-hash";
    /// What the picture was made of, as a JSON object: hashes of the request and of each file, in hexadecimal. `--update`
    /// compares them to find out whether the picture is up to date.
    pub const MADE_OF: &'static str = "meshray:made-of";
    /// Counts of a counted run, as a JSON object.
    pub const COUNTS: &'static str = "meshray:counts";

    /// Metadata with this program's version and nothing else. ([`Metadata::default`] is empty and writes nothing.)
    pub fn new() -> Self {
        Self::default().with(Self::VERSION, env!("CARGO_PKG_VERSION"))
    }

    /// Adds or replaces an entry. `key` begins with [`PREFIX`] and is at most 79 characters of printable ASCII; any other key is
    /// ignored.
    #[must_use]
    pub fn with(mut self, key: &'static str, value: impl Into<String>) -> Self {
        self.insert(key, &value.into());
        self
    }

    /// Value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.entries.get(key).map(String::as_str)
    }

    /// Every entry, by key.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.entries.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Name and version of the program that wrote the picture.
    pub(super) fn software(&self) -> String {
        format!("meshray {}", self.get(Self::VERSION).unwrap_or(env!("CARGO_PKG_VERSION")))
    }

    /// Inserts an entry if its key is one of meshray. Zero bytes in the value are replaced, as no format can hold them.
    pub(super) fn insert(&mut self, key: &str, value: &str) {
        let is_printable = key.bytes().all(|byte| byte.is_ascii_graphic() || byte == b' ');
        if key.starts_with(PREFIX) && key.len() <= LONGEST_KEY && is_printable {
            self.entries.insert(key.to_owned(), value.replace('\0', "\u{fffd}"));
        }
    }

    pub(super) fn to_json(&self) -> String {
        serde_json::to_string(&self.entries).unwrap_or_default()
    }

    pub(super) fn from_json(json: &str) -> Option<Self> {
        let entries: BTreeMap<String, String> = serde_json::from_str(json).ok()?;
        let mut metadata = Self::default();
        entries.iter().for_each(|(key, value)| metadata.insert(key, value));
        Some(metadata)
    }
}

/// Reads the metadata of a picture file; `None` when it is not a picture, or has no metadata of meshray.
pub fn read_metadata(path: &Path) -> Result<Option<Metadata>, ImageError> {
    let read = |source| ImageError::Read { path: path.to_owned(), source };
    let mut file = BufReader::new(File::open(path).map_err(read)?);
    let mut magic = Vec::new();
    file.by_ref().take(12).read_to_end(&mut magic).map_err(read)?;
    file.seek(SeekFrom::Start(0)).map_err(read)?;
    read_from(&magic, file)
}

/// Reads the metadata of a picture whose first bytes are `magic`.
fn read_from(magic: &[u8], file: impl BufRead + Seek) -> Result<Option<Metadata>, ImageError> {
    let Some(kind) = kind_of(magic) else { return Ok(None) };
    let found = match kind {
        FileKind::Png => png::read_metadata(file)?,
        FileKind::Exr => exr::read_metadata(file)?,
        FileKind::Jpeg => exif::find_in_jpeg(file).and_then(|tiff| exif::read(&tiff)).unwrap_or_default(),
        FileKind::Webp => exif::find_in_webp(file).and_then(|tiff| exif::read(&tiff)).unwrap_or_default(),
    };
    Ok((!found.is_empty()).then_some(found))
}

/// Whether a file is a picture that meshray wrote: only such files may be replaced by a default output name.
pub fn was_written_by_meshray(path: &Path) -> bool {
    // Opening a pipe would wait for its writer.
    path.is_file() && matches!(read_metadata(path), Ok(Some(metadata)) if metadata.get(Metadata::VERSION).is_some())
}

/// Picture type by a file's magic bytes.
pub(super) fn kind_of(magic: &[u8]) -> Option<FileKind> {
    if magic.starts_with(b"\x89PNG\r\n\x1a\n") {
        Some(FileKind::Png)
    } else if magic.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        Some(FileKind::Exr)
    } else if magic.starts_with(&[0xff, 0xd8, 0xff]) {
        Some(FileKind::Jpeg)
    } else if magic.starts_with(b"RIFF") && magic.get(8..12) == Some(b"WEBP") {
        Some(FileKind::Webp)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Output, Picture, encode};

    fn sample() -> Metadata {
        Metadata::new()
            .with(Metadata::SETTINGS, r#"{"size":[3,2],"name":"häuser\n"}"#)
            .with(Metadata::INPUT_HASH, "00ff")
            .with(Metadata::COUNTS, "x".repeat(5000))
    }

    fn picture() -> Picture {
        let beauty = (0..6).map(|i| [i as f32 * 0.1, 0.5, 0.25, 0.5 + i as f32 * 0.1]).collect();
        Picture::of(3, 2, beauty)
    }

    fn write(dir: &tempfile::TempDir, name: &str, bytes: &[u8]) -> std::path::PathBuf {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    #[test]
    fn every_format_gives_back_what_was_written() {
        let dir = tempfile::tempdir().unwrap();
        for kind in FileKind::ALL {
            let bytes = encode(&picture(), kind, &Output::default(), &sample()).unwrap();
            let path = write(&dir, "picture", &bytes);
            assert_eq!(read_metadata(&path).unwrap(), Some(sample()), "{kind}");
            assert!(was_written_by_meshray(&path), "{kind}");
        }
    }

    #[test]
    fn what_is_no_key_of_ours_is_no_entry() {
        let long: &'static str = Box::leak(format!("{PREFIX}{}", "k".repeat(LONGEST_KEY)).into_boxed_str());
        for key in ["author", "meshray:ä", "meshray:\n", long] {
            assert!(Metadata::default().with(key, "x").is_empty(), "{key}");
        }
        let longest: &'static str = &long[..LONGEST_KEY];
        let metadata = Metadata::default().with(longest, "x");
        for kind in FileKind::ALL {
            assert!(encode(&picture(), kind, &Output::default(), &metadata).is_ok(), "{kind}");
        }
    }

    #[test]
    fn a_picture_of_another_program_is_told_apart() {
        let dir = tempfile::tempdir().unwrap();
        for kind in FileKind::ALL {
            let bytes = encode(&picture(), kind, &Output::default(), &Metadata::default()).unwrap();
            let path = write(&dir, "picture", &bytes);
            assert_eq!(read_metadata(&path).unwrap(), None, "{kind}");
            assert!(!was_written_by_meshray(&path), "{kind}");
        }
        let text = write(&dir, "text.png", b"no picture at all");
        assert_eq!(read_metadata(&text).unwrap(), None);
        let empty = write(&dir, "empty.png", b"");
        assert!(!was_written_by_meshray(&empty));
        assert!(!was_written_by_meshray(&dir.path().join("missing.png")));
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_no_picture_and_is_not_opened() {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("pipe.png");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        // Opening it would wait for ever.
        assert!(!was_written_by_meshray(&pipe));
    }

    /// Truncates the file at every length and corrupts every byte of its head: any result but a panic is right.
    #[test]
    fn broken_files_end_in_an_answer() {
        let try_to_read = |bytes: &[u8]| drop(read_from(bytes, std::io::Cursor::new(bytes)));
        let metadata = Metadata::new().with(Metadata::SETTINGS, "{}");
        for kind in FileKind::ALL {
            let bytes = encode(&picture(), kind, &Output::default(), &metadata).unwrap();
            for cut in 0..bytes.len().min(900) {
                try_to_read(&bytes[..cut]);
                for spoiled in [0, 0x7f, 0xff] {
                    let mut copy = bytes.clone();
                    copy[cut] = spoiled;
                    try_to_read(&copy);
                }
            }
        }
    }

    #[test]
    fn a_zero_byte_in_a_value_is_replaced() {
        assert_eq!(Metadata::default().with(Metadata::INPUT, "a\0b").get(Metadata::INPUT), Some("a\u{fffd}b"));
    }
}
