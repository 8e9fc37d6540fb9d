//! Detects the kind of a file: by its content, then by its extension.
//!
//! Kinds that cannot be read are named in the error, so that the user knows what to do.

use super::stl::{self, Encoding};
use super::text::without_mark;
use super::{Diagnostic, Source};
use std::path::Path;

/// Kinds of file that can be loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Gltf,
    Nff,
    Obj,
    Ply,
    SceneFile,
    Stl(Encoding),
}

/// Magic bytes of kinds that cannot be read, and their names.
const FOREIGN: &[(&[u8], &str)] = &[
    (b"Kaydara FBX Binary", "an FBX file"),
    (b"; FBX", "an FBX file"),
    (b"BLENDER", "a Blender file"),
    (b"PXR-USDC", "a USD file"),
    (b"#usda", "a USD file"),
    (b"#VRML", "a VRML file"),
    (b"#X3D", "an X3D file"),
    (b"OFF\n", "an OFF file"),
    (b"xof ", "a DirectX file"),
    (b"DRACO", "a bare Draco mesh"),
    (b"# vtk", "a VTK file"),
    (ZIP, "a zip archive"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"Rar!", "a RAR archive"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"%PDF", "a PDF document"),
    (b"\x7fELF", "a program"),
    (b"b3dm", "a 3D Tiles file"),
    (b"version https://git-lfs", LFS_POINTER),
];

const LFS_POINTER: &str = "a Git LFS pointer, not the file itself";
const EMPTY: &str = "empty";

/// Magic bytes of a zip archive.
pub(super) const ZIP: &[u8; 4] = b"PK\x03\x04";

/// Extensions of model kinds that are zip archives.
const ZIPPED: [&str; 2] = ["usdz", "3mf"];

/// Extensions of kinds without reliable magic bytes.
const FOREIGN_EXTENSIONS: &[(&str, &str)] = &[
    ("fbx", "an FBX file"),
    ("dae", "a COLLADA file"),
    ("3ds", "a 3D Studio file"),
    ("max", "a 3ds Max file"),
    ("c4d", "a Cinema 4D file"),
    ("usd", "a USD file"),
    ("usdz", "a USD file"),
    ("abc", "an Alembic file"),
    ("step", "a STEP file"),
    ("stp", "a STEP file"),
    ("iges", "an IGES file"),
    ("3mf", "a 3MF file"),
    ("off", "an OFF file"),
    ("lwo", "a LightWave file"),
    ("mtl", "a material library, not a model"),
    ("bin", "a binary buffer, not a model"),
];

/// Whether a zip archive is a model of another kind, by its extension.
pub(super) fn is_zipped_kind(path: &Path) -> bool {
    path.extension().is_some_and(|extension| ZIPPED.iter().any(|zipped| extension.eq_ignore_ascii_case(zipped)))
}

/// Detects the kind of `source`; the error names a kind that cannot be read.
pub(super) fn detect(source: &Source) -> Result<Format, Diagnostic> {
    let bytes = without_mark(&source.bytes);
    let text = bytes.trim_ascii_start();
    let extension = source.path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();

    if bytes.starts_with(b"glTF") {
        return Ok(Format::Gltf);
    }
    if text.starts_with(b"ply\n") || text.starts_with(b"ply\r") {
        return Ok(Format::Ply);
    }
    if stl::is_exact(&source.bytes) {
        return Ok(Format::Stl(Encoding::Binary));
    }
    if is_stl_text(text) {
        return Ok(Format::Stl(Encoding::Text));
    }
    if let Some(kind) = by_beginning(bytes) {
        // Some kinds are zip archives of a certain content.
        let inner = FOREIGN_EXTENSIONS.iter().find(|(ending, _)| *ending == extension && ZIPPED.contains(ending));
        return Err(foreign(source, inner.filter(|_| bytes.starts_with(ZIP)).map_or(kind, |(_, kind)| kind)));
    }
    if let Some(kind) = marked_up(text) {
        return Err(foreign(source, kind));
    }
    match extension.as_str() {
        "gltf" | "glb" => return Ok(Format::Gltf),
        "nff" => return Ok(Format::Nff),
        "obj" => return Ok(Format::Obj),
        "ply" => return Ok(Format::Ply),
        "stl" => {
            return match damaged_stl(text) {
                Encoding::Binary if is_plain(text) => Err(foreign(source, "a text that is no STL")),
                encoding => Ok(Format::Stl(encoding)),
            };
        }
        "toml" => return Ok(Format::SceneFile),
        _ => {}
    }
    if text.starts_with(b"{") {
        return Ok(Format::Gltf);
    }
    if let Some((_, kind)) = FOREIGN_EXTENSIONS.iter().find(|(e, _)| *e == extension) {
        return Err(foreign(source, kind));
    }
    by_lines(text).ok_or_else(|| foreign(source, if bytes.is_empty() { EMPTY } else { "of an unknown kind" }))
}

/// Name of a kind that is not plain text; `None` where the bytes may be lines of words and numbers.
pub(super) fn other_than_text(bytes: &[u8]) -> Option<&'static str> {
    let bytes = without_mark(bytes);
    by_beginning(bytes).or_else(|| marked_up(bytes.trim_ascii_start()))
}

fn by_beginning(bytes: &[u8]) -> Option<&'static str> {
    FOREIGN.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, kind)| *kind)
}

fn marked_up(text: &[u8]) -> Option<&'static str> {
    text.starts_with(b"<").then(|| if has(text, b"<COLLADA") { "a COLLADA file" } else { "an XML or HTML file" })
}

/// Extensions of models, from the most to the least complete: with materials and buffers in one file, with materials,
/// without.
pub(super) const MODELS: [&str; 7] = ["glb", "gltf", "vrm", "obj", "ply", "stl", "nff"];

/// Whether a file has the extension of a model: `.glb`, `.gltf`, `.vrm` (avatars in GLB), `.obj`, `.ply`, `.stl` or
/// `.nff`, in either case.
pub fn is_called_a_model(path: &Path) -> bool {
    MODELS.iter().any(|known| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(known)))
}

fn foreign(source: &Source, kind: &str) -> Diagnostic {
    let remedy = match kind {
        EMPTY => "get it again",
        LFS_POINTER => "fetch it with `git lfs pull`",
        archive if archive.ends_with("archive") => "unpack it first",
        _ => "meshray reads .glb, .gltf, .vrm, .obj, .ply, .stl, .nff and .toml scenes",
    };
    Diagnostic::new("unsupported-format", &source.path, "", format!("this is {kind}")).remedy(remedy)
}

/// Whether a text is STL: `solid` and any name, then `facet` on one of the next lines, or the end of the file.
fn is_stl_text(text: &[u8]) -> bool {
    let first_is = |line: &[u8], words: &[&[u8]]| {
        let first = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        words.iter().any(|word| first.eq_ignore_ascii_case(word))
    };
    let mut lines = text.split(|&b| b == b'\n' || b == b'\r').map(<[u8]>::trim_ascii).filter(|line| !line.is_empty());
    lines.next().is_some_and(|line| first_is(line, &[b"solid"]))
        && lines.next().is_some_and(|line| first_is(line, &[b"facet", b"endsolid"]))
}

/// Encoding that a damaged STL file was meant to have: its length does not match, and it does not begin as text should.
fn damaged_stl(text: &[u8]) -> Encoding {
    let start = &text[..text.len().min(512)];
    let begins = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Comments may stand before it.
    let is_text = (begins || has(&start.to_ascii_lowercase(), b"facet normal")) && !start.contains(&0);
    if is_text { Encoding::Text } else { Encoding::Binary }
}

/// Whether the start of a file that is longer than the header of a binary STL is text.
fn is_plain(text: &[u8]) -> bool {
    let start = &text[..text.len().min(512)];
    start.len() > 84
        && std::str::from_utf8(start).is_ok_and(|start| !start.contains(|c: char| c.is_control() && !c.is_whitespace()))
}

fn has(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).take(4096).any(|w| w == part)
}

/// Tells OBJ, NFF and scene files apart by the first line that can belong to only one of them.
fn by_lines(text: &[u8]) -> Option<Format> {
    const OBJ: [&[u8]; 9] = [b"v", b"vt", b"vn", b"f", b"o", b"g", b"usemtl", b"mtllib", b"s"];
    for line in text.split(|&b| b == b'\n' || b == b'\r').take(1000) {
        let line = line.trim_ascii();
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        // An NFF begins with its view, which is a line of its own, or its background.
        let words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).count();
        let is_nff = matches!((word, words), (b"v", 1) | (b"b", 4)) || line.starts_with(b"v from");
        let is_obj = OBJ.contains(&word) && !line.contains(&b'=');
        match line.first() {
            None | Some(b'#') => {}
            Some(b'[') => return Some(Format::SceneFile),
            Some(_) if is_nff => return Some(Format::Nff),
            Some(_) if is_obj => return Some(Format::Obj),
            Some(_) if line.contains(&b'=') => return Some(Format::SceneFile),
            Some(_) => return None,
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, bytes: &[u8]) -> Result<Format, String> {
        detect(&Source::new(name.into(), bytes.to_vec())).map_err(|d| d.to_string())
    }

    #[test]
    fn what_is_no_model_says_what_helps() {
        for (name, bytes, remedy) in [
            ("a.dat", &b""[..], "; get it again"),
            ("a.glb", b"version https://git-lfs.github.com/spec/v1\n", "; fetch it with `git lfs pull`"),
            ("a.glb", ZIP, "; unpack it first"),
            ("a.xyz", b"1 2 3\n", "and .toml scenes"),
        ] {
            let said = of(name, bytes).unwrap_err();
            assert!(said.ends_with(remedy), "{said}");
        }
    }

    #[test]
    fn a_text_that_is_called_stl_is_no_binary_one() {
        let users = "root:x:0:0:root:/root:/bin/sh\n".repeat(20);
        assert!(of("a.stl", users.as_bytes()).unwrap_err().starts_with("a.stl: this is a text that is no STL"));
        // Truncated within its header, a binary STL may look like text.
        assert_eq!(of("a.stl", &users.as_bytes()[..80]), Ok(Format::Stl(Encoding::Binary)));
    }

    #[test]
    fn content_comes_before_the_extension() {
        assert_eq!(of("a.obj", b"glTF\x02\0\0\0"), Ok(Format::Gltf));
        assert_eq!(of("-", b"\xef\xbb\xbf { \"asset\": {} }"), Ok(Format::Gltf));
        assert_eq!(of("-", b"# a cube\r\nmtllib c.mtl\r\nv 0 0 0"), Ok(Format::Obj));
        assert_eq!(of("-", b"# balls\nb 0.1 0.2 0.3\nv\nfrom 1 2 3"), Ok(Format::Nff));
        assert_eq!(of("-", b"v\nfrom 1 2 3\n"), Ok(Format::Nff));
        assert_eq!(of("-", b"# a scene\n[camera]\n"), Ok(Format::SceneFile));
        assert_eq!(of("-", b"background = 'white'\n"), Ok(Format::SceneFile));
        assert!(of("a.obj", b"PK\x03\x04...").unwrap_err().contains("a zip archive; unpack it first"));
        assert!(of("a.3mf", b"PK\x03\x04...").unwrap_err().contains("a 3MF file; meshray reads"));
        assert!(of("a.gltf", b"version https://git-lfs.github.com/spec/v1").unwrap_err().contains("Git LFS"));
    }

    #[test]
    fn ply_and_stl_are_known_by_content_and_by_name() {
        assert_eq!(of("-", b"ply\r\nformat ascii 1.0\r\n"), Ok(Format::Ply));
        assert_eq!(of("a.ply", b""), Ok(Format::Ply));
        let (text, binary) = (Ok(Format::Stl(Encoding::Text)), Ok(Format::Stl(Encoding::Binary)));
        assert_eq!(of("-", b"solid a b\n\n facet normal 0 0 1"), text);
        assert_eq!(of("a.stl", b"SOLID\nwhat?"), text);
        assert!(of("-", b"solid rock is heavy\nand so on").is_err());
        // A header that begins like text does not make a file text whose length matches its count.
        let mut named = b"solid facet".to_vec();
        named.resize(84 + 50, 0);
        named[80] = 1;
        assert_eq!(of("-", &named), binary);
        assert_eq!(of("a.obj", &[0; 84]), binary);
        assert_eq!(of("a.stl", &[7; 100]), binary);
        named.truncate(100);
        assert_eq!(of("a.stl", &named), binary);
    }

    #[test]
    fn the_extension_decides_where_content_cannot() {
        assert_eq!(of("a.obj", b""), Ok(Format::Obj));
        assert_eq!(of("a.nff", b"s 0 0 0 1"), Ok(Format::Nff));
        assert_eq!(of("a.GLB", b""), Ok(Format::Gltf));
        assert_eq!(of("a.toml", b"# nothing yet"), Ok(Format::SceneFile));
        assert!(of("a.fbx", b"").unwrap_err().starts_with("a.fbx: this is an FBX file; meshray reads"));
        assert!(of("a", b"").unwrap_err().contains("this is empty"));
        assert!(of("a", b"hello").unwrap_err().contains("unknown kind"));
    }
}
