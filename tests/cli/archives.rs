//! Zip archives of models, as downloaded.

use super::program::{CUBE, Folder, textured_cube};
use rawzip::{CompressionMethod, ZipArchiveWriter};
use std::io::Write;

/// A zip archive of files by name, stored uncompressed.
fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut archive = ZipArchiveWriter::new(&mut bytes);
    for (name, content) in files {
        let (mut entry, config) = archive.new_file(name).compression_method(CompressionMethod::STORE).start().unwrap();
        let mut writer = config.wrap(&mut entry);
        writer.write_all(content).unwrap();
        let (_, descriptor) = writer.finish().unwrap();
        entry.finish(descriptor).unwrap();
    }
    archive.finish().unwrap();
    bytes
}

/// A textured cube in an archive, in the folder that a well-known site gives every model, and two models in another archive.
fn downloads() -> Folder {
    let cube = textured_cube();
    let names = cube.names();
    let bytes: Vec<Vec<u8>> = names.iter().map(|name| cube.read(name)).collect();
    let files: Vec<(String, &[u8])> =
        names.iter().zip(&bytes).map(|(name, bytes)| (format!("source/{name}"), &bytes[..])).collect();
    let files: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (&name[..], *bytes)).collect();
    let several = zip(&[("a/one.obj", CUBE.as_bytes()), ("b/two.obj", CUBE.as_bytes()), ("readme.txt", b"")]);
    Folder::new().file("all/cube.zip", zip(&files)).file("all/pack.zip", several)
}

#[test]
fn the_model_of_an_archive_is_drawn_as_it_is_unpacked_and_under_the_name_of_the_archive() {
    let (folder, unpacked) = (downloads(), textured_cube());
    folder.render(&["all/cube.zip"]).ends(0);
    assert_eq!(folder.names(), ["all", "cube.png"]);
    let model = unpacked.names().into_iter().find(|name| name.ends_with(".obj")).unwrap();
    unpacked.render(&[&model, "-o", "unpacked.png"]).ends(0);
    let pixels = |folder: &Folder, name: &str| super::program::picture(&folder.path(name)).beauty;
    assert_eq!(pixels(&folder, "cube.png"), pixels(&unpacked, "unpacked.png"));
    folder.run(&["render", "--again", "cube.png", "-o", "again.png"]).ends(0);
    assert!(folder.read("cube.png") == folder.read("again.png"));
    folder.run(&["inspect", "all/cube.zip"]).ends(0);
}

#[test]
fn an_archive_with_several_models_is_a_folder_of_them() {
    let folder = downloads();
    folder.render(&["all", "-o", "thumbs/", "--update"]).ends(0).says(&["3 pictures of 3 inputs, 0 up to date"]);
    for name in ["thumbs/cube.png", "thumbs/pack/a/one.png", "thumbs/pack/b/two.png"] {
        assert!(folder.has(name), "{name}");
    }
    folder.render(&["all", "-o", "thumbs/", "--update"]).ends(0).says(&["0 pictures of 3 inputs, 3 up to date"]);
    // One model of the archive changes: the others stay up to date.
    let changed = CUBE.replacen("1", "1.25", 1);
    std::fs::write(
        folder.path("all/pack.zip"),
        zip(&[("a/one.obj", CUBE.as_bytes()), ("b/two.obj", changed.as_bytes())]),
    )
    .unwrap();
    folder.render(&["all", "-o", "thumbs/", "--update"]).ends(0).says(&["1 picture of 3 inputs, 2 up to date"]);
    folder
        .render(&["all/pack.zip/b/two.obj", "all/pack.zip", "-o", "{sub}/{stem}.jpg"])
        .ends(0)
        .says(&["2 pictures of 2 inputs"]);
    assert!(folder.has("pack/a/one.jpg") && folder.has("pack/b/two.jpg"));
    // The archive with a trailing slash, and a folder inside it.
    folder.render(&["all/pack.zip/"]).ends(0).says(&["2 pictures of 2 inputs"]);
    assert!(folder.has("pack/a/one.png") && folder.has("pack/b/two.png"));
    folder.render(&["all/pack.zip/b", "-o", "{dir}.png"]).ends(1).says(&["what should be its folder is a file"]);
    folder.render(&["all/pack.zip/b"]).ends(0);
    assert!(folder.has("two.png"));
    folder.run(&["inspect", "all/pack.zip"]).ends(3).says(&["2 models", "'a/one.obj'", "name one"]);
}

#[test]
fn archives_of_one_layout_do_not_meet_in_their_pictures() {
    let pack = || zip(&[("models/rock.obj", CUBE.as_bytes()), ("models/tree.obj", CUBE.as_bytes())]);
    let folder = Folder::new().file("a.zip", pack()).file("b.zip", pack());
    folder.render(&["a.zip", "b.zip", "-o", "thumbs/"]).ends(0).says(&["4 pictures of 4 inputs"]);
    assert!(folder.has("thumbs/a/models/rock.png") && folder.has("thumbs/b/models/rock.png"));
    // The pictures record the source of their models, even when both have moved together since.
    std::fs::create_dir(folder.path("moved")).unwrap();
    std::fs::rename(folder.path("b.zip"), folder.path("moved/b.zip")).unwrap();
    std::fs::rename(folder.path("thumbs/b/models/rock.png"), folder.path("moved/rock.png")).unwrap();
    folder.run(&["render", "--again", "moved/rock.png", "-o", "again.png"]).ends(0);
    assert!(folder.has("again.png"));
}

#[test]
fn what_an_archive_has_in_several_formats_is_drawn_once_and_one_that_is_unpacked_beside_it_not_at_all() {
    let both = zip(&[
        ("chair.obj", CUBE.as_bytes()),
        (
            "chair.stl",
            b"solid
endsolid
",
        ),
        ("chair.fbx", b""),
    ]);
    let folder = Folder::new().file("all/chair.zip", &both).file("all/table.zip", &both).file("all/table.obj", CUBE);
    folder.render(&["all", "-o", "thumbs/"]).ends(0).says(&[
        "2 pictures of 2 inputs",
        "table.zip: left out, as 'table' is beside it",
        "'chair.obj' is drawn, and not 'chair.stl' beside it",
    ]);
    folder.render(&["all/table.zip", "--strict"]).ends(3).says(&["chair.stl", "--strict"]);
    folder.render(&["all/table.zip/chair.obj", "--strict"]).ends(0);
    let more = zip(&[("a.obj", CUBE.as_bytes()), ("a.ply", b""), ("b.obj", CUBE.as_bytes())]);
    let folder = folder.file("more.zip", more);
    folder
        .render(&["more.zip", "--strict"])
        .ends(3)
        .says(&["'a.obj' is drawn, and not 'a.ply'", "not rendered: --strict"]);
    folder.render(&["more.zip"]).ends(0).says(&["2 pictures of 2 inputs, 1 warning"]);
}

#[test]
fn an_archive_that_was_packed_once_more_is_drawn_under_the_name_of_the_outer_one() {
    let inner = zip(&[("chair.obj", CUBE.as_bytes())]);
    let folder = Folder::new().file("all/download.zip", zip(&[("source/chair.zip", &inner), ("read.me", b"")]));
    folder.render(&["all", "-o", "thumbs/", "--update"]).ends(0);
    assert!(folder.has("thumbs/download.png"));
    folder.render(&["all", "-o", "thumbs/", "--update"]).ends(0).says(&["download.png: is up to date"]);
    folder.run(&["inspect", "all/download.zip"]).ends(0);
}

#[test]
fn an_archive_beside_a_folder_of_its_name_without_models_is_drawn() {
    let folder =
        Folder::new().file("all/chair.zip", zip(&[("chair.obj", CUBE.as_bytes())])).file("all/chair/a.png", "");
    folder.render(&["all", "-o", "thumbs/"]).ends(0);
    assert!(folder.has("thumbs/chair.png"));
    folder.render(&["all/chair.zip/"]).ends(0);
    assert!(folder.has("chair.png"));
}

#[test]
fn a_picture_is_not_up_to_date_where_an_archive_stands_for_another_model_by_now() {
    let pack = |files: &[(&str, &[u8])]| zip(files);
    let stl = b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let folder = Folder::new().file("chair.zip", pack(&[("chair.stl", stl)]));
    let update = || folder.render(&["chair.zip", "--update"]).ends(0);
    update();
    update().says(&["is up to date"]);
    std::fs::write(folder.path("chair.zip"), pack(&[("chair.stl", stl), ("chair.obj", CUBE.as_bytes())])).unwrap();
    update().says(&["chair.png: 32×24"]);
    update().says(&["is up to date"]);
    // A scene file that shows the archive notices, too.
    std::fs::write(folder.path("scene.toml"), "[[models]]\nfile = 'chair.zip'\n").unwrap();
    let update = || folder.render(&["scene.toml", "--update"]).ends(0);
    update();
    update().says(&["is up to date"]);
    std::fs::write(
        folder.path("chair.zip"),
        pack(&[
            ("chair.stl", stl),
            ("chair.obj", CUBE.as_bytes()),
            ("chair.gltf", b"{\"asset\": {\"version\": \"2.0\"}}"),
        ]),
    )
    .unwrap();
    folder.render(&["scene.toml", "--update", "--allow-empty"]).ends(0).says(&["scene.png: 32×24"]);
}

#[test]
fn pictures_beside_an_archive_that_others_made_are_not_replaced() {
    let folder = downloads().file("all/one.png", "mine");
    folder
        .render(&["all/pack.zip", "-o", "all/{stem}.png"])
        .ends(1)
        .says(&["one.png", "no picture that meshray wrote"]);
    assert_eq!(folder.read("all/one.png"), b"mine");
}

#[test]
fn an_archive_that_is_damaged_is_told_and_keeps_nobody_up() {
    let folder =
        downloads().file("all/cut.zip", &b"PK\x03\x04\0\0"[..]).file("all/pictures.zip", zip(&[("a.png", b"")]));
    folder.render(&["all", "-o", "thumbs/"]).ends(3).says(&[
        "cut.zip",
        "damaged",
        "get the archive again",
        "3 pictures of 3 inputs",
    ]);
    folder.render(&["all/pictures.zip"]).ends(3).says(&["no model is in this archive", "'a.png'"]);
    folder.render(&["all/cut.zip"]).ends(3).says(&["damaged"]);
    let folder = downloads().file("all/page.zip", "<html>not found</html>");
    folder.render(&["all", "-o", "thumbs/"]).ends(3).says(&["page.zip: this is no zip archive"]);
}

#[test]
fn no_output_replaces_an_archive_that_is_read() {
    let folder = downloads();
    std::fs::rename(folder.path("all/pack.zip"), folder.path("pack.json")).unwrap();
    let before = folder.read("pack.json");
    folder
        .run(&["bench", "pack.json/a/one.obj", "--report", "pack.json"])
        .ends(1)
        .says(&["pack.json", "would replace a file that is read"]);
    assert!(folder.read("pack.json") == before);
}

/// A link counts as the file that it leads to.
#[cfg(unix)]
#[test]
fn no_output_replaces_what_a_scene_file_names_by_a_link() {
    let folder = downloads().file("real/cube.json", CUBE);
    std::fs::rename(folder.path("all/cube.zip"), folder.path("real/alone.json")).unwrap();
    std::fs::rename(folder.path("all/pack.zip"), folder.path("real/pack.json")).unwrap();
    for (file, below) in [("cube.json", ""), ("alone.json", ""), ("pack.json", "/a/one.obj")] {
        let (link, file) = (format!("link-{file}"), format!("real/{file}"));
        std::os::unix::fs::symlink(&file, folder.path(&link)).unwrap();
        std::fs::write(folder.path("scene.toml"), format!("[[models]]\nfile = '{link}{below}'\n")).unwrap();
        let before = folder.read(&file);
        folder
            .run(&["bench", "scene.toml", "--report", &file])
            .ends(1)
            .says(&[&file, "would replace a file that is read"]);
        assert!(folder.read(&file) == before, "{file}");
    }
}
