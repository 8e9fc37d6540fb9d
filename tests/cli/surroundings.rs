//! Lighting of a model besides its own lamps.

use super::program::{Folder, picture};
use image::{Rgb, Rgb32FImage};
use std::path::Path;

/// A panorama that is bright above and dark below.
fn sky(path: &Path) {
    let texel = |_, y| if y < 4 { Rgb([2.0, 2.0, 4.0]) } else { Rgb([0.25, 0.125, 0.0]) };
    Rgb32FImage::from_fn(16, 8, texel).save(path).expect("the folder is ours");
}

fn with_sky() -> Folder {
    let folder = Folder::with_cube();
    sky(&folder.path("sky.exr"));
    sky(&folder.path("sky.hdr"));
    folder
}

/// Mean colour of a picture.
fn mean(folder: &Folder, name: &str) -> [f32; 3] {
    let picture = picture(&folder.path(name));
    let all = picture.beauty.iter().fold([0.0; 3], |sum, p| [0, 1, 2].map(|i| sum[i] + p[i]));
    all.map(|c| c / picture.beauty.len() as f32)
}

#[test]
fn a_panorama_lights_the_model_and_is_seen_behind_it() {
    let folder = with_sky();
    for file in ["sky.exr", "sky.hdr"] {
        folder.render(&["cube.obj", "--env", file, "--view", "front", "-o", "out.exr"]).ends(0).says(&["light of"]);
        let [r, _, b] = mean(&folder, "out.exr");
        assert!(b > 1.2 * r && b > 0.5, "{file}: {r} {b}");
    }
    folder.render(&["cube.obj", "--env", "sky.exr", "--background", "black", "-o", "out.exr"]).ends(0);
    assert_eq!(picture(&folder.path("out.exr")).beauty[0][..3], [0.0; 3]);
}

#[test]
fn a_picture_under_a_panorama_is_repeated_byte_for_byte() {
    let folder = with_sky();
    let flags = "--env sky.hdr --env-rotate -90 --env-rays 6 --gloss-rays 2 --sun-size 0.5 --light-rays 3";
    let flags: Vec<&str> = flags.split(' ').collect();
    folder.render(&[&["cube.obj", "-o", "first.png"], flags.as_slice()].concat()).ends(0);
    folder.run(&["render", "--again", "first.png", "-o", "second.png"]).ends(0);
    assert!(folder.read("first.png") == folder.read("second.png"));
    Rgb32FImage::from_pixel(2, 1, Rgb([1.0; 3])).save(folder.path("sky.hdr")).expect("the folder is ours");
    folder.run(&["render", "--again", "first.png", "-o", "third.png"]).ends(3).says(&["hash"]);
}

#[test]
fn the_studio_is_what_there_is_without_a_word_and_white_darkens_corners_only_with_rays() {
    let folder = with_sky();
    folder.render(&["cube.obj", "-o", "plain.png"]).ends(0);
    folder.render(&["cube.obj", "-o", "studio.png", "--env", "studio"]).ends(0);
    assert_eq!(picture(&folder.path("plain.png")).beauty, picture(&folder.path("studio.png")).beauty);
    folder.render(&["cube.obj", "-o", "white.png", "--env", "white"]).ends(0);
    folder.render(&["cube.obj", "-o", "black.png", "--env", "black"]).ends(0);
    assert!(mean(&folder, "white.png")[0] > 2.0 * mean(&folder, "black.png")[0]);
}

#[test]
fn black_surroundings_take_the_place_of_default_lights_and_leave_lamps_of_the_file_alone() {
    let lamp = "[[lights]]\nkind = \"directional\"\ndirection = [0, 0, -1]\n";
    let ball = "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n";
    let folder = Folder::with_cube().file("lit.toml", format!("{lamp}{ball}")).file("bare.toml", ball);
    let brightest = |model: &str, flags: &[&str]| {
        let words = [&[model, "--background", "black", "--view", "front", "-o", "out.exr"], flags].concat();
        folder.render(&words).ends(0);
        picture(&folder.path("out.exr")).beauty.iter().map(|p| p[0]).fold(0.0, f32::max)
    };
    for model in ["cube.obj", "bare.toml"] {
        assert_eq!(brightest(model, &["--env", "black"]), 0.0, "{model}");
        // A scene that asks for nothing is lit, although it has no surroundings.
        assert!(brightest(model, &[]) > 0.1, "{model}");
    }
    let lit = brightest("lit.toml", &[]);
    assert!(lit > 0.1 && brightest("lit.toml", &["--env", "black"]) == lit);
}

#[test]
fn what_cannot_surround_a_scene_is_said_in_one_line() {
    let folder = with_sky().file("broken.exr", b"\x76\x2f\x31\x01 and no more".as_slice());
    folder.run(&["render", "cube.obj", "--env", "missing.hdr"]).ends(1).says(&["missing.hdr"]);
    folder.run(&["render", "cube.obj", "--env", "broken.exr"]).ends(3).says(&["broken.exr", "cannot be decoded"]);
    folder.run(&["render", "cube.obj", "--env", "cube.obj"]).ends(3).says(&["cube.obj", "no picture"]);
    folder.run(&["render", "cube.obj", "--env", "white", "--env-rotate", "5"]).ends(2).says(&["--env-rotate"]);
    folder.run(&["render", "cube.obj", "--sun-size=-1"]).ends(2).says(&["0 to 180"]);
    assert!(!folder.has("cube.png"));
}
