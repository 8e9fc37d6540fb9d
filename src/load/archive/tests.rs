//! Models in archives, whole and damaged.

#![cfg(test)]

use super::*;
use crate::load::{LoadError, LoadOptions, Loaded, load, load_bytes};
use flate2::Compression;
use flate2::write::DeflateEncoder;
use rawzip::ZipArchiveWriter;
use std::fs;
use std::io::Write;

/// Builds a zip archive of named files; those whose names end in `.bin` are stored uncompressed.
fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut archive = ZipArchiveWriter::new(&mut bytes);
    for (name, content) in files {
        let is_stored = name.ends_with(".bin");
        let method = if is_stored { CompressionMethod::STORE } else { CompressionMethod::DEFLATE };
        let (mut entry, config) = archive.new_file(name).compression_method(method).start().unwrap();
        let descriptor = if is_stored {
            let mut writer = config.wrap(&mut entry);
            writer.write_all(content).unwrap();
            writer.finish().unwrap().1
        } else {
            let mut writer = config.wrap(DeflateEncoder::new(&mut entry, Compression::default()));
            writer.write_all(content).unwrap();
            let (encoder, descriptor) = writer.finish().unwrap();
            encoder.finish().unwrap();
            descriptor
        };
        entry.finish(descriptor).unwrap();
    }
    archive.finish().unwrap();
    bytes
}

const OBJ: &str = "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
const MTL: &[u8] = b"newmtl red\nKd 0.8 0.1 0.1\n";

fn of_bytes(files: &[(&str, &[u8])]) -> Result<Loaded, LoadError> {
    load_bytes(Path::new("a.zip"), zip(files), &LoadOptions::default())
}

/// Code and message of the first fault.
fn fault(loaded: Result<Loaded, LoadError>) -> (&'static str, String) {
    match loaded {
        Err(LoadError::Input(faults)) => (faults[0].code, faults[0].to_string()),
        other => panic!("{other:?}"),
    }
}

fn names(loaded: &Loaded) -> Vec<&str> {
    loaded.facts.files.iter().map(|file| file.path.to_str().unwrap()).collect()
}

#[test]
fn the_only_model_of_an_archive_is_loaded_with_what_it_names() {
    let files = [
        ("readme.txt", &b"by me"[..]),
        ("__MACOSX/house/._house.obj", b"no model"),
        ("house/.hidden.obj", b"no model"),
        ("house/house.obj", OBJ.as_bytes()),
        ("house/paint.mtl", MTL),
    ];
    let loaded = of_bytes(&files).unwrap();
    assert_eq!((loaded.scene.prims(), loaded.warnings.len()), (1, 0), "{:?}", loaded.warnings);
    assert_eq!(names(&loaded), ["a.zip/house/house.obj", "a.zip/house/paint.mtl"]);
    // The hash is that of the unpacked files.
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("house.obj"), OBJ).unwrap();
    fs::write(dir.path().join("paint.mtl"), MTL).unwrap();
    let unpacked = load(&dir.path().join("house.obj"), &LoadOptions::default()).unwrap();
    assert_eq!(loaded.facts.hash, unpacked.facts.hash);
}

#[test]
fn of_several_models_one_has_to_be_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("pack.ZIP");
    let many = ["a/one.obj", "a/two.obj", "b/one.stl", "c.ply", "d.glb"];
    let files = many.map(|name| (name, OBJ.as_bytes()));
    fs::write(&path, zip(&files)).unwrap();
    let read = |name: &str| load(&path.join(name), &LoadOptions::default());
    let (code, text) = fault(load(&path, &LoadOptions::default()));
    assert_eq!(code, "archive-several");
    assert!(text.contains("5 models are in this archive: 'a/one.obj', 'a/two.obj', 'b/one.stl', 'c.ply', …"), "{text}");
    let loaded = read("a/two.obj").unwrap();
    assert_eq!(names(&loaded), [path.join("a/two.obj").to_str().unwrap()]);
    assert_eq!(loaded.warnings[0].code, "file-missing", "its library of materials");
    assert!(loaded.warnings[0].remedy.contains("unpack it"), "{}", loaded.warnings[0]);
    let (code, text) = fault(read("a/tow.obj"));
    assert!(code == "file-missing" && text.contains("pack.ZIP/a/two.obj'?"), "{code}: {text}");
    let (code, text) = fault(read("zebra"));
    assert!(code == "file-missing" && text.contains("it has 5 models, the first is"), "{code}: {text}");
    assert_eq!(fault(read("a")).0, "file-not-plain");
    assert!(matches!(load(&dir.path().join("gone.zip/a.obj"), &LoadOptions::default()), Err(LoadError::Read { .. })));
}

#[test]
fn what_a_model_names_is_looked_for_in_its_archive_and_nowhere_else() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("paint.mtl"), MTL).unwrap();
    // Through a parent folder, in another case, with backslashes, and in a folder of another machine.
    for (library, found) in [
        ("../lib/paint.mtl", true),
        ("..\\LIB\\Paint.MTL", true),
        ("C:\\work\\lib\\paint.mtl", false),
        ("../../paint.mtl", false),
        ("../a.zip/lib/paint.mtl", false),
    ] {
        let obj = OBJ.replace("paint.mtl", library);
        fs::write(at("a.zip"), zip(&[("source\\a.obj", obj.as_bytes()), ("lib/paint.mtl", MTL)])).unwrap();
        let loaded = load(&at("a.zip"), &LoadOptions::default()).unwrap();
        assert_eq!(names(&loaded).len() == 2, found, "{library}: {:?}", loaded.warnings);
    }
    let loaded = of_bytes(&[("a.obj", OBJ.replace("paint.mtl", "../paint.mtl").as_bytes())]).unwrap();
    assert_eq!(loaded.warnings[0].code, "file-outside-root");
    assert!(loaded.warnings[0].remedy.starts_with("unpack it"), "{}", loaded.warnings[0]);
}

#[test]
fn scene_files_show_models_in_archives() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let files: [(&str, &[u8]); 3] =
        [("m/house.obj", OBJ.as_bytes()), ("m/paint.mtl", MTL), ("scene.toml", b"[[models]]\nfile = 'm/house.obj'\n")];
    fs::write(at("house.zip"), zip(&files)).unwrap();
    for (name, read) in [("house.zip", 3), ("house.zip/m/house.obj", 3), ("house.zip/gone.obj", 0), ("../house.zip", 0)]
    {
        fs::write(at("scene.toml"), format!("[[models]]\nfile = '{name}'\n")).unwrap();
        let loaded = load(&at("scene.toml"), &LoadOptions::default());
        assert_eq!(loaded.as_ref().map_or(0, |loaded| loaded.facts.files.len()), read, "{name}: {loaded:?}");
        let folder = dir.path();
        loaded.iter().for_each(|loaded| assert_eq!(loaded.facts.files[1].path, folder.join("house.zip/m/house.obj")));
    }
    let inside = load(&at("house.zip/scene.toml"), &LoadOptions::default()).unwrap();
    assert_eq!(names(&inside)[1..].len(), 2, "beside its model");
}

#[test]
fn files_on_disk_may_lie_in_archives_below_the_root_if_they_are_named_so() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("in")).unwrap();
    fs::write(at("lib.zip"), zip(&[("mtl/secret.mtl", MTL)])).unwrap();
    fs::write(at("in/lib.zip"), zip(&[("mtl/paint.mtl", MTL)])).unwrap();
    fs::write(at("in/cut.zip"), &zip(&[("paint.mtl", MTL)])[..40]).unwrap();
    for (library, code) in [
        ("lib.zip/mtl/paint.mtl", None),
        ("lib.zip/MTL/Paint.MTL", Some("mtl-file-elsewhere")),
        ("lib.zip/gone.mtl", Some("file-missing")),
        ("cut.zip/paint.mtl", Some("archive-unreadable")),
        ("../lib.zip/mtl/secret.mtl", Some("file-outside-root")),
    ] {
        fs::write(at("in/a.obj"), OBJ.replace("paint.mtl", library)).unwrap();
        let loaded = load(&at("in/a.obj"), &LoadOptions::default()).unwrap();
        assert_eq!(loaded.warnings.first().map(|told| told.code), code, "{library}: {:?}", loaded.warnings);
    }
}

#[test]
fn a_remark_behind_an_archive_may_look_like_the_end_of_one() {
    let mut bytes = zip(&[("a.obj", OBJ.as_bytes())]);
    let remark = b"PK\x05\x06 was here, long ago and far away";
    let at = bytes.len() - 2;
    bytes[at..].copy_from_slice(&(remark.len() as u16).to_le_bytes());
    bytes.extend(remark);
    let loaded = load_bytes(Path::new("a.zip"), bytes, &LoadOptions::default()).unwrap();
    assert_eq!(loaded.scene.prims(), 1);
}

#[test]
fn an_archive_that_was_packed_once_more_is_looked_into_and_no_deeper() {
    let inner = zip(&[("house.obj", OBJ.as_bytes()), ("paint.mtl", MTL)]);
    let outer = zip(&[("source/house.zip", &inner), ("licence.txt", b"")]);
    let loaded = load_bytes(Path::new("a.zip"), outer.clone(), &LoadOptions::default()).unwrap();
    assert_eq!(names(&loaded), ["a.zip/source/house.zip/house.obj", "a.zip/source/house.zip/paint.mtl"]);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let (code, text) = fault(of_bytes(&[("once/more.zip", &outer)]));
    assert!(code == "archive-empty" && text.contains("unpack it, and name 'source/house.zip'"), "{code}: {text}");
    let (code, text) = fault(of_bytes(&[("a.zip", &inner), ("b.zip", &inner)]));
    assert!(code == "archive-empty" && text.contains("unpack it, and name 'a.zip'"), "{code}: {text}");
    let loaded = of_bytes(&[("old.zip", &inner), ("new.obj", OBJ.as_bytes())]).unwrap();
    assert_eq!(names(&loaded), ["a.zip/new.obj"], "beside a model");
    let (code, text) = fault(of_bytes(&[("source/house.zip", &inner[..50])]));
    assert!(code == "archive-unreadable" && text.starts_with("a.zip/source/house.zip: "), "{code}: {text}");
}

#[test]
fn archives_without_models_say_what_they_hold() {
    let (code, text) = fault(of_bytes(&[]));
    assert!(code == "archive-empty" && text.contains("no file is in this archive"), "{code}: {text}");
    let (code, text) = fault(of_bytes(&[("textures/a.png", b"1"), ("robot.fbx", b"2")]));
    assert_eq!(code, "archive-empty");
    assert!(text.contains("it has 'robot.fbx', 'textures/a.png';"), "{text}");
}

#[test]
fn nothing_leads_out_of_an_archive() {
    let names =
        ["../../etc/a.obj", "/rooted/b.obj", "x/../c.obj", "x/../../d.obj", "./e.obj", "C:\\f.obj", "folder.obj\\"];
    let bytes = zip_verbatim(&names.map(|name| (name.as_bytes(), &b""[..])));
    let archive = Archive::from_bytes(Path::new("a.zip"), bytes).unwrap();
    let held: Vec<&str> = archive.models(Path::new("")).iter().map(|model| model.name).collect();
    assert_eq!(held, ["C:/f.obj", "c.obj", "e.obj", "rooted/b.obj"], "whatever the system");
    assert!(!archive.has(Path::new("../a.zip/c.obj")) && archive.names_in(Path::new("..")).next().is_none());
    assert_eq!(archive.names_in(Path::new("rooted")).collect::<Vec<_>>(), ["b.obj"]);
    assert!(archive.has_folder(Path::new("")) && !archive.has_folder(Path::new("root")));
}

/// Builds an archive of uncompressed files whose names are written verbatim.
fn zip_verbatim(files: &[(&[u8], &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut archive = ZipArchiveWriter::new(&mut bytes);
    for (name, content) in files {
        let path = rawzip::path::EntryPath::verbatim(*name);
        let (mut entry, config) = archive.new_file(path).compression_method(CompressionMethod::STORE).start().unwrap();
        let mut writer = config.wrap(&mut entry);
        writer.write_all(content).unwrap();
        let (_, descriptor) = writer.finish().unwrap();
        entry.finish(descriptor).unwrap();
    }
    archive.finish().unwrap();
    bytes
}

#[test]
fn a_spoiled_file_is_told_and_none_is_unpacked_to_more_than_it_says() {
    let long = vec![b'x'; 100_000];
    let whole = zip(&[("a.bin", b"stored as it is"), ("long.txt", &long)]);
    let read =
        |bytes: Vec<u8>, name: &str| Archive::from_bytes(Path::new("a.zip"), bytes)?.read(Path::new(name), 1 << 20);
    assert_eq!(read(whole.clone(), "a.bin").unwrap(), b"stored as it is");
    assert_eq!(read(whole.clone(), "long.txt").unwrap(), long);
    let archive = Archive::from_bytes(Path::new("a.zip"), whole.clone()).unwrap();
    assert_eq!(archive.read(Path::new("long.txt"), 99_999).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    assert_eq!(archive.share(), 100_015);
    let models =
        zip(&[("a.obj", &long), ("b.obj", &long), ("__MACOSX/._a.obj", b"x"), (".b.obj", b"x"), ("b.stl", b"")]);
    assert_eq!(Archive::from_bytes(Path::new("a.zip"), models).unwrap().share(), 100_001, "two models");
    // Change a byte of the stored data.
    let at = whole.windows(6).position(|w| w == b"stored").unwrap();
    let mut spoiled = whole.clone();
    spoiled[at] = b'S';
    let error = read(spoiled, "a.bin").unwrap_err();
    assert!(
        matches!(ArchiveFault::of(&error), Some(ArchiveFault::Spoiled(why)) if why.contains("checksum")),
        "{error}"
    );
    // Change the length in the directory from 100 000 to 5.
    let at = whole.windows(4).rposition(|w| w == 100_000_u32.to_le_bytes()).unwrap();
    let mut lying = whole.clone();
    lying[at..at + 4].copy_from_slice(&5_u32.to_le_bytes());
    let error = read(lying, "long.txt").unwrap_err();
    assert!(matches!(ArchiveFault::of(&error), Some(ArchiveFault::Spoiled(_))), "{error}");
    // Flags and method of the first entry in the directory.
    let at = whole.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
    for (offset, value, expected) in [
        (8, 1, "it is encrypted"),
        (10, 9, "it is packed by DEFLATE64, which is not known here"),
        (10, 77, "it is packed by method 77, which is not known here"),
    ] {
        let mut other = whole.clone();
        other[at + offset] = value;
        assert_eq!(ArchiveFault::of(&read(other, "a.bin").unwrap_err()).unwrap().to_string(), expected);
    }
}

#[test]
fn a_cut_or_garbled_archive_never_panics() {
    let whole = zip(&[("a.obj", OBJ.as_bytes()), ("paint.mtl", MTL)]);
    for end in 0..whole.len() {
        let loaded = load_bytes(Path::new("a.zip"), whole[..end].to_vec(), &LoadOptions::default());
        assert!(loaded.is_err(), "{end} of {} bytes", whole.len());
    }
    for at in 4..whole.len() {
        for value in [0, 0xff, whole[at] ^ 1] {
            let mut garbled = whole.clone();
            garbled[at] = value;
            drop(load_bytes(Path::new("a.zip"), garbled, &LoadOptions::default()));
        }
    }
}

#[test]
fn names_in_the_letters_of_old_programs_find_each_other() {
    let obj = OBJ.replace("paint.mtl", "Grün.mtl");
    let files: [(&[u8], &[u8]); 3] =
        [(b"H\x84user/a.obj", obj.as_bytes()), (b"H\x84user/Gr\x81n.mtl", MTL), (b"H\x84user/Gr\x82n.mtl", b"")];
    let loaded = load_bytes(Path::new("a.zip"), zip_verbatim(&files), &LoadOptions::default()).unwrap();
    assert_eq!(names(&loaded), ["a.zip/Häuser/a.obj", "a.zip/Häuser/Grün.mtl"]);
}

#[test]
fn of_one_model_in_several_formats_the_one_with_materials_is_drawn_and_the_others_are_told() {
    let files =
        [("a/house.stl", &b""[..]), ("a/House.glb", b""), ("a/house.obj", OBJ.as_bytes()), ("a/house.ply", b"")];
    let archive = Archive::from_bytes(Path::new("a.zip"), zip(&files)).unwrap();
    let offered = archive.models(Path::new(""));
    assert_eq!(offered.iter().map(|model| model.name).collect::<Vec<_>>(), ["a/House.glb", "a/house.obj"]);
    assert_eq!(offered[1].others, ["a/house.ply", "a/house.stl"]);
    assert_eq!(archive.models(Path::new("a"))[1].name, "house.obj", "from that folder");
    let loaded = of_bytes(&[files[0], files[2], files[3]]).unwrap();
    assert_eq!(names(&loaded).len(), 1);
    let told: Vec<_> = loaded.warnings.iter().map(|warning| warning.code).collect();
    assert!(told.contains(&"archive-formats"), "{told:?}");
}
