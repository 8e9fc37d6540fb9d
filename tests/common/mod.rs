//! Helpers for several subjects: the repository and its models, pictures of scenes.

#![allow(dead_code, reason = "which of it is used depends on the features that are built")]

pub mod stage;

use meshray::accel::{AccelKind, AccelParams, AnyAccel};
use meshray::image::Picture;
use meshray::render::texture::TextureStore;
use meshray::render::{Job, Settings, View, World, render};
use meshray::scene::{Background, Scene, default_light, framing};
use std::path::{Path, PathBuf};

/// Root folder of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All model and scene files in `models/` that can be rendered by themselves, sorted by name.
pub fn models() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join("models")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if ["obj", "glb", "gltf", "ply", "stl", "toml"].contains(&extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "models/ holds no models");
    found
}

/// Renders a loaded scene with a user's defaults: framed and lit, on a transparent background, one sample a pixel, with layers.
/// `None`: the scene holds nothing to draw.
pub fn still(scene: Scene, kind: AccelKind, width: u32, height: u32) -> Option<Picture> {
    let [picture] = stills(scene, kind, (width, height), [false])?;
    Some(picture)
}

/// Renders the same picture several times, each time with points shaded one by one or not.
pub fn stills<const N: usize>(
    mut scene: Scene,
    kind: AccelKind,
    (width, height): (u32, u32),
    one_by_one: [bool; N],
) -> Option<[Picture; N]> {
    let bounds = framing::robust_bounds(&scene);
    let camera = framing::default_camera(&scene, &bounds, f64::from(width) / f64::from(height));
    default_light::add_if_missing(&mut scene, &camera);
    scene.background = Some(Background::Transparent);
    let world = World::new(&scene);
    if world.shapes.is_empty() {
        return None;
    }
    let accel = AnyAccel::build(kind, &world.shapes, &AccelParams::DEFAULT);
    let textures = TextureStore::new(&scene);
    let view = View::from_camera(&camera);
    let picture = |one_by_one| {
        let settings = Settings { width, height, samples: 1, layers: true, one_by_one, ..Settings::default() };
        let job =
            Job { scene: &scene, world: &world, accel: &accel, textures: &textures, view: &view, settings: &settings };
        render(&job, &()).picture
    };
    Some(one_by_one.map(picture))
}

/// Pixels and layers as bits, so that zeros of both signs and NaN are distinguished.
pub fn bits(picture: &Picture) -> Vec<u32> {
    let layers = picture.layers.as_ref().expect("the picture has layers");
    let colors = picture.beauty.iter().flatten();
    let triples = layers.albedo.iter().chain(&layers.normal).chain(&layers.position).flatten();
    let floats = colors.chain(triples).chain(&layers.depth).map(|c| c.to_bits());
    floats.chain(layers.prim.iter().copied()).chain(layers.instance.iter().copied()).collect()
}
