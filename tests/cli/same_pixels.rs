//! Structure and number of threads do not show in the pixels.

use super::program::{Folder, picture};
use crate::common::root;
use meshray::image::Picture;
use std::path::PathBuf;

/// Every model and scene file in `models/` that can be rendered by itself, sorted by name.
fn models() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join("models")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if ["obj", "glb", "gltf", "toml"].contains(&extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Pixels and layers as bits, so that zeros of both signs and NaN are told apart.
fn bits(picture: &Picture) -> Vec<u32> {
    let layers = picture.layers.as_ref().expect("the picture has layers");
    let colors = picture.beauty.iter().flatten();
    let triples = layers.albedo.iter().chain(&layers.normal).chain(&layers.position).flatten();
    let floats = colors.chain(triples).chain(&layers.depth).map(|c| c.to_bits());
    floats.chain(layers.prim.iter().copied()).chain(layers.instance.iter().copied()).collect()
}

#[test]
fn every_model_gives_the_same_bits_with_every_structure_and_any_threads() {
    let folder = Folder::with_cube();
    let mut inputs = models();
    assert!(!inputs.is_empty() || !root().join("models").exists(), "models/ holds no models");
    inputs.push(folder.path("cube.obj"));
    for input in inputs {
        let input = input.to_str().unwrap();
        let mut first = None;
        for accel in ["none", "grid-octree"] {
            for threads in ["1", "2", "7"] {
                let size = ["render", "--size", "40x30", "--samples", "4", "--float", "--layers", "-o", "out.exr"];
                let run = folder.run(&[&size, ["--accel", accel, "--threads", threads, input].as_slice()].concat());
                run.ends(0);
                let these = bits(&picture(&folder.path("out.exr")));
                let those = first.get_or_insert_with(|| these.clone());
                assert!(*those == these, "{input}: {accel} with {threads} threads differs from none with 1");
            }
        }
    }
}

#[test]
fn a_file_is_the_same_bytes_each_time() {
    let folder = Folder::with_cube();
    for name in ["a.png", "a.exr"] {
        folder.render(&["cube.obj", "-o", name]).ends(0);
        let first = folder.read(name);
        folder.render(&["cube.obj", "-o", name]).ends(0);
        assert!(first == folder.read(name), "{name}");
    }
}
