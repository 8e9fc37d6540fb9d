//! Whole folders of models, and pictures that are up to date.

use super::program::{CUBE, Folder, Run, cube_with_a_bad_face, textured_cube};
use meshray::image::{FileKind, Metadata, Output, Picture, encode};
use std::path::MAIN_SEPARATOR;

/// Three models in three folders, among files that are no models.
fn collection() -> Folder {
    let names = ["all/a.obj", "all/deep/a.obj", "all/deep/er/b.OBJ"];
    let folder = names.into_iter().fold(Folder::new(), |folder, name| folder.file(name, CUBE));
    folder.file("all/readme.txt", "").file("all/deep/Cargo.toml", "").file("all/.hidden/c.obj", CUBE)
}

#[test]
fn all_models_in_a_folder_are_rendered_into_folders_like_theirs() {
    let folder = collection().file("thumbs/kept.txt", "");
    folder.render(&["all", "-o", "thumbs/"]).ends(0).says(&["3 pictures of 3 inputs"]);
    assert_eq!(folder.names(), ["all", "thumbs"]);
    for name in ["thumbs/a.png", "thumbs/deep/a.png", "thumbs/deep/er/b.png"] {
        assert!(folder.has(name), "{name}");
    }
    folder.render(&["all/deep"]).ends(0);
    assert!(folder.has("a.png") && folder.has("er/b.png"));
    folder.render(&["all", "-o", "{sub}/{stem}-{view}.jpg", "--view", "front,top"]).ends(0);
    assert!(folder.has("a-top.jpg") && folder.has("deep/er/b-front.jpg"));
}

#[test]
fn the_folder_that_is_named_is_made_where_the_one_around_it_is_there() {
    let folder = collection().file("file", "");
    folder.render(&["all", "-o", "new/"]).ends(0).says(&["3 pictures of 3 inputs"]);
    assert!(folder.has("new/a.png") && folder.has("new/deep/er/b.png"));
    folder.render(&["all/deep/a.obj", "all/deep/er/b.OBJ", "-o", "shots/{view}/{stem}.jpg", "--view", "iso"]).ends(0);
    assert!(folder.has("shots/iso/a.jpg") && folder.has("shots/iso/b.jpg"));
    folder.render(&["all/a.obj", "-o", "{dir}/beside/{stem}.png"]).ends(0);
    assert!(folder.has("all/beside/a.png"));
    for elsewhere in ["gone/deeper/", "gone/deeper/{stem}.png", "gone/a.png"] {
        folder.render(&["all/a.obj", "-o", elsewhere]).ends(1).says(&["its folder is not there"]);
    }
    for elsewhere in ["file/", "file/{stem}.png"] {
        folder.render(&["all/a.obj", "-o", elsewhere]).ends(1).says(&["what should be its folder is a file"]);
    }
    assert!(!folder.has("gone"));
    folder.render(&["file", "-o", "never/"]).ends(3);
    folder.render(&["all/a.obj", "-o", "never/", "--dry-run"]).ends(0);
    assert!(!folder.has("never"), "nothing is made where there is no picture");
}

#[test]
fn statistics_go_into_the_folder_that_is_made_for_pictures_and_into_no_other() {
    let folder = collection();
    let stats = |file: &'static str| ["all", "-o", "new/", "--stats", "json", "--stats-file", file];
    folder.render(&stats("gone/stats.json")).ends(1).says(&["its folder is not there", "--stats-file"]);
    folder.render(&stats("new/deep/stats.json")).ends(1).says(&["its folder is not there", "--stats-file"]);
    assert!(!folder.has("new"), "nothing is done before");
    for elsewhere in ["gone/../new/stats.json", "new/.."] {
        folder.render(&stats(elsewhere)).ends(1).says(&["--stats-file"]);
    }
    assert!(!folder.has("new"), "nothing is done before");
    folder.render(&stats("./new/stats.json")).ends(0);
    assert!(folder.has("new/a.png") && folder.has("new/stats.json"));
    let whole = folder.path("whole/stats.json").display().to_string();
    folder.render(&["all", "-o", "whole/", "--stats", "json", "--stats-file", &whole]).ends(0);
    assert!(folder.has("whole/stats.json"), "however the folder is named");
    folder.render(&["all", "-o", "plan/", "--dry-run", "--stats-file", "plan/plan.txt"]).ends(0);
    assert!(folder.has("plan/plan.txt"), "no picture has made it");
}

#[test]
fn folders_are_made_only_in_one_that_is_there_and_for_pictures_that_are() {
    let folder = collection().file("all/deep/broken/c.glb", "glTF").file("thumbs/er", "a file");
    folder.render(&["all/deep", "-o", "thumbs/"]).ends(3).says(&["1 picture of 3 inputs, 2 of them failed", "er"]);
    assert!(folder.has("thumbs/a.png") && !folder.has("thumbs/broken"));
    folder.render(&["all/deep", "-o", "other-{sub}/{stem}.png", "--dry-run"]);
    assert!(!folder.has("other-er"), "nothing is made where pictures are only foretold");
    folder.render(&["all/deep/er", "all/deep/a.obj", "-o", "thumbs/{sub}/../../{stem}.png"]).ends(0);
    folder.render(&["all/deep", "-o", "thumbs/{sub}/../../gone/{stem}.png"]).ends(1).says(&["its folder is not there"]);
    assert!(!folder.has("gone"));
}

#[test]
fn pictures_of_one_name_and_folders_without_a_model_are_told() {
    let folder = collection().file("none/readme.txt", "");
    let in_all = |name: &str| format!("all{MAIN_SEPARATOR}{name}");
    folder.render(&["all", "-o", "{stem}.png"]).ends(2).says(&[&in_all("a.obj"), &in_all("deep"), "{sub}"]);
    folder.render(&["none"]).ends(3).says(&["none", "no model", ".glb"]);
    assert_eq!(folder.names(), ["all", "none"]);
    folder.render(&["none", "all/deep/er"]).ends(3).says(&["no model"]);
    assert!(folder.has("b.png"), "the others are rendered");
    folder.render(&["all", "all/deep", "--merge", "-o", "./"]).ends(0);
    assert!(folder.has("a.png"));
}

#[test]
fn pictures_that_are_up_to_date_are_left_alone() {
    let folder = collection().file("thumbs/kept.txt", "");
    let words = ["all", "-o", "thumbs/", "--update"];
    let update = |more: &[&str]| folder.render(&[&words[..], more].concat()).ends(0);
    update(&[]).says(&["3 pictures of 3 inputs, 0 up to date"]);
    let before = folder.read("thumbs/a.png");
    std::fs::write(folder.path("thumbs/a.png"), before.iter().chain(b"appended").copied().collect::<Vec<u8>>())
        .unwrap();
    update(&[]).says(&["0 pictures of 3 inputs, 3 up to date"]);
    assert!(folder.read("thumbs/a.png").ends_with(b"appended"), "it was not written");

    // Pictures are remade when the options, the model file or the picture itself changes.
    update(&["--depth", "3"]).says(&["3 pictures of 3 inputs, 0 up to date"]);
    update(&["--depth", "3", "--threads", "1"]).says(&["0 pictures of 3 inputs, 3 up to date"]);
    std::fs::write(folder.path("all/deep/a.obj"), CUBE.replacen("1", "1.25", 1)).unwrap();
    std::fs::remove_file(folder.path("thumbs/a.png")).unwrap();
    update(&["--depth", "3"]).says(&["2 pictures of 3 inputs, 1 up to date"]);
    std::fs::write(folder.path("thumbs/a.png"), folder.read("thumbs/deep/a.png")).unwrap();
    update(&["--depth", "3"]).says(&["1 picture of 3 inputs, 2 up to date"]);
    folder.render(&[&words[..], &["--stats", "json"]].concat()).ends(2);
    // A repetition is identical, byte for byte, and counts as up to date.
    let made = folder.read("thumbs/deep/a.png");
    folder.run(&["render", "--again", "thumbs/deep/a.png", "-o", "thumbs/deep/a.png"]).ends(0);
    assert!(folder.read("thumbs/deep/a.png") == made);
    update(&["--depth", "3"]).says(&["0 pictures of 3 inputs, 3 up to date"]);
}

/// Builds of the same version may draw differently.
#[cfg(target_os = "linux")]
#[test]
fn pictures_of_another_build_are_made_again() {
    let folder = collection();
    // Copied by another process: a file that this one had open for writing might be busy when it is run.
    let copy = |more: &str| {
        let line = format!("cp '{}' other{more}", env!("CARGO_BIN_EXE_meshray"));
        assert!(
            std::process::Command::new("sh")
                .args(["-c", &line])
                .current_dir(folder.path(""))
                .status()
                .unwrap()
                .success()
        );
    };
    let update = || {
        let words = ["render", "all", "-o", "thumbs/", "--update", "--size", "16"];
        Run::of(assert_cmd::Command::new(folder.path("other")).args(words).current_dir(folder.path(""))).ends(0)
    };
    folder
        .run(&["render", "all", "-o", "thumbs/", "--update", "--size", "16"])
        .ends(0)
        .says(&["3 pictures of 3 inputs"]);
    copy("");
    update().says(&["0 pictures of 3 inputs, 3 up to date"]);
    copy(" && printf 1 >> other");
    update().says(&["3 pictures of 3 inputs, 0 up to date"]);
}

#[test]
fn how_a_picture_was_asked_for_is_carried_only_where_it_is_wanted() {
    let folder = Folder::with_cube();
    let carried = |words: &[&str]| {
        folder.render(&[&["cube.obj", "-o", "a.png"], words].concat()).ends(0);
        let metadata = meshray::image::read_metadata(&folder.path("a.png")).unwrap().unwrap();
        metadata.get(meshray::image::Metadata::MADE_OF).map(str::to_owned)
    };
    assert_eq!(carried(&[]), None);
    let made_of = carried(&["--update"]).unwrap();
    assert!(made_of.contains(r#""cube.obj":""#), "{made_of}");
    assert_eq!(carried(&["--update", "--threads", "1"]), Some(made_of.clone()));
    assert_ne!(carried(&["--update", "--seed", "1"]), Some(made_of));
}

#[test]
fn what_a_model_reads_beside_its_own_file_counts_too() {
    let folder = textured_cube();
    let update = || folder.render(&["cube.obj", "--update"]);
    update().ends(0);
    update().ends(0).says(&["cube.png: is up to date"]);
    let names = folder.names();
    let map = names.iter().find(|name| name.ends_with(".mtl")).expect("a library");
    let library = String::from_utf8(folder.read(map)).unwrap();
    std::fs::write(folder.path(map), library.clone() + "\n# changed\n").unwrap();
    let run = update().ends(0);
    assert!(!run.stderr.contains("up to date") && run.errors().is_empty());
    // A file that was missing may exist the next time.
    std::fs::remove_file(folder.path(map)).unwrap();
    update().says(&[map]);
    update().says(&[map, "cube.png: is up to date"]);
    std::fs::write(folder.path(map), library).unwrap();
    let run = update().ends(0);
    assert!(!run.stderr.contains("up to date"), "{}", run.stderr);
    update().says(&["cube.png: is up to date"]);
}

#[test]
fn pictures_under_a_panorama_are_up_to_date_as_long_as_that_is_the_same() {
    let sky = |light: f32| {
        let picture = Picture::of(4, 2, vec![[light, 0.2, 0.1, 1.0]; 8]);
        encode(&picture, FileKind::Png, &Output::default(), &Metadata::default()).unwrap()
    };
    let folder = Folder::with_cube().file("sky.png", sky(0.5));
    let update = || folder.render(&["cube.obj", "--env", "sky.png", "--update"]).ends(0);
    assert!(!update().stderr.contains("up to date"));
    update().says(&["cube.png: is up to date"]);
    std::fs::write(folder.path("sky.png"), sky(0.9)).unwrap();
    assert!(!update().stderr.contains("up to date"));
    update().says(&["cube.png: is up to date"]);
}

#[test]
fn frames_that_are_up_to_date_are_left_alone() {
    let folder = Folder::with_cube();
    let update = |count: &str| folder.render(&["cube.obj", "--turntable", count, "--update"]).ends(0);
    update("3");
    std::fs::remove_file(folder.path("cube.0001.png")).unwrap();
    update("3").says(&["2 pictures are up to date"]);
    assert!(folder.has("cube.0001.png"));
    let run = update("4");
    assert!(!run.stderr.contains("up to date"), "every step is another: {}", run.stderr);
}

/// Many models, of which some cannot be read, some cause warnings, and some have an output that cannot be written.
fn many() -> Folder {
    let folder = (0..40).fold(Folder::new().file("out/kept.txt", ""), |folder, i| {
        let model = match i % 10 {
            3 => cube_with_a_bad_face(),
            7 => "v 0 0 0\nf 1 2 3\n".into(),
            _ => CUBE.replacen('1', &format!("1.{i:02}"), 1),
        };
        folder.file(&format!("all/{i:02}.obj"), model)
    });
    folder.file("out/05.png", "not a picture").file("out/25.png", "nor this")
}

#[test]
fn many_inputs_side_by_side_make_what_they_make_one_by_one_and_say_it_in_their_order() {
    let run = |threads: &str| {
        let folder = many();
        let run = folder.render(&["all", "-o", "out/", "--threads", threads, "--quiet"]).ends(3);
        let names = (0..40).map(|i| format!("out/{i:02}.png")).filter(|name| folder.has(name));
        let pictures: Vec<_> = names.map(|name| folder.read(&name)).collect();
        (run.stderr.clone(), pictures)
    };
    let (said, pictures) = run("1");
    assert!(said.contains("05.png: exists and is no picture") && said.contains("37.obj"), "{said}");
    assert_eq!(pictures.len(), 36, "those that were there, too");
    for threads in ["2", "5"] {
        let (other, same) = run(threads);
        assert_eq!(said, other, "{threads} threads");
        assert!(pictures == same, "{threads} threads");
    }
    let summary = "2 pictures of 40 inputs";
    let folder = many();
    folder.render(&["all", "-o", "out/", "--threads", "3", "--update"]).says(&["of 40 inputs, 0 up to date"]);
    std::fs::remove_file(folder.path("out/01.png")).unwrap();
    std::fs::remove_file(folder.path("out/31.png")).unwrap();
    folder.render(&["all", "-o", "out/", "--threads", "3", "--update"]).says(&[summary, "6 of them failed"]);
}

/// `t/b.png` is the texture of `a.obj`, and also the output path of `b.obj`.
fn with_a_texture_in_the_way() -> Folder {
    let cubes = |folder: Folder| (0..9).fold(folder, |folder, i| folder.file(&format!("m/z{i}.obj"), CUBE));
    let texture = textured_cube().read("cube.jpg");
    cubes(Folder::new())
        .file("m/a.obj", format!("mtllib a.mtl\nusemtl a\n{CUBE}"))
        .file("m/a.mtl", "newmtl a\nmap_Kd ../t/b.png\n")
        .file("t/b.png", texture)
        .file("m/b.obj", CUBE)
}

#[test]
fn no_picture_replaces_what_another_model_shows_neither_side_by_side_nor_when_that_is_up_to_date() {
    let folder = with_a_texture_in_the_way();
    let texture = folder.read("t/b.png");
    for (threads, further) in
        [("1", "--quiet"), ("2", "--quiet"), ("2", "--update"), ("2", "--update"), ("1", "--update")]
    {
        let words = ["m", "--root", ".", "-o", "t/{sub}/{stem}.png", "--threads", threads, further];
        folder.render(&words).ends(1).says(&["t/b.png: would replace a file that is read"]);
        assert!(folder.read("t/b.png") == texture, "{words:?}");
    }
    // Nor is any file beside a model replaced that meshray did not write, whether it is read or not.
    let folder = folder.file("m/b.png", "mine");
    folder.render(&["m/b.obj", "m/z1.obj", "-o", "m/{stem}.png"]).ends(1).says(&["m/b.png: exists and is no picture"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("m", folder.path("l")).unwrap();
        let words = ["m/b.obj", "m/z1.obj", "-o", "l/{stem}.png"];
        folder.render(&words).ends(1).says(&["l/b.png: exists and is no picture"]);
    }
    assert!(folder.read("m/b.png") == b"mine" && folder.has("m/z1.png"));
}

#[test]
fn a_copy_of_a_project_is_not_up_to_date_where_its_files_are_others() {
    let texture = |grey: f32| {
        let picture = meshray::image::Picture::of(2, 2, vec![[grey; 4]; 4]);
        let kind = meshray::image::FileKind::Jpeg;
        meshray::image::encode(&picture, kind, &Default::default(), &Default::default()).unwrap()
    };
    let model = format!("mtllib cube.mtl\nusemtl a\nvt 0 0\n{}", CUBE.replace("f 4 3 2 1", "f 4/1 3/1 2/1 1/1"));
    let project = |name: &str, folder: Folder| {
        let at = |file: &str| format!("{name}/{file}");
        folder
            .file(&at("cube.obj"), &model)
            .file(&at("cube.mtl"), "newmtl a\nmap_Kd cube.jpg\n")
            .file(&at("scene.toml"), "[[models]]\nfile = \"cube.obj\"\n")
    };
    let folder = project("two", project("one", Folder::new()));
    let folder = folder.file("one/cube.jpg", texture(0.1)).file("two/cube.jpg", texture(0.9));
    for (input, picture) in [("cube.obj", "cube.png"), ("scene.toml", "scene.png")] {
        let update = |name: &str| {
            let words = ["render", input, "--size", "16", "--update"];
            Run::of(folder.program(&words).current_dir(folder.path(name))).ends(0)
        };
        let [one, two] = ["one", "two"].map(|name| format!("{name}/{picture}"));
        update("one");
        std::fs::copy(folder.path(&one), folder.path(&two)).unwrap();
        assert!(update("one").stderr.contains("up to date"), "{input}");
        assert!(!update("two").stderr.contains("up to date"), "{input}");
        assert!(folder.read(&one) != folder.read(&two), "{input}");
    }
}

#[test]
fn what_would_be_found_before_what_was_found_is_noticed() {
    let folder = textured_cube();
    let update = || folder.render(&["cube.obj", "--update"]);
    std::fs::write(folder.path("cube.mtl"), "newmtl a\nmap_Kd CUBE.jpg\n").unwrap();
    update().ends(0);
    update().ends(0).says(&["cube.png: is up to date"]);
    // Only where file names are case-sensitive.
    if !folder.has("CUBE.jpg") {
        std::fs::copy(folder.path("cube.jpg"), folder.path("CUBE.jpg")).unwrap();
        assert!(!update().ends(0).stderr.contains("up to date"));
        update().ends(0).says(&["cube.png: is up to date"]);
    }
    // --strict is a different request: no warnings are allowed.
    assert!(!folder.render(&["cube.obj", "--update", "--strict"]).stderr.contains("up to date"));
}
