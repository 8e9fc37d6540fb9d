//! Our own models with random but reproducible errors: loading always ends in a valid scene or in a message, and stays within
//! its memory.

use super::*;
use crate::load::Moment;
use crate::math::random::Random;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

/// Broken copies of each model, per kind of error.
const CASES: u64 = 30;

const MEMORY: u64 = 1 << 28;

fn models() -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|e| e == "glb")).collect();
    paths.sort();
    assert!(paths.len() >= 5);
    paths.into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
}

/// Loads every broken copy of every model.
fn try_all(name: &str, mutate: impl Fn(&[u8], &mut Random) -> Vec<u8>) {
    let (mut loaded, mut refused) = (0, 0);
    for (path, bytes) in models() {
        for case in 0..CASES {
            let mut random = Random::new(case);
            let broken = mutate(&bytes, &mut random);
            let result = catch_unwind(AssertUnwindSafe(|| try_one(&path, broken)));
            match result.unwrap_or_else(|_| panic!("{name}, case {case} of {}", path.display())) {
                true => loaded += 1,
                false => refused += 1,
            }
        }
    }
    assert!(refused > 0, "{name}: {loaded} loaded, {refused} refused");
}

/// Loads a file; returns whether it was accepted.
fn try_one(path: &Path, bytes: Vec<u8>) -> bool {
    let limits = Limits { memory: MEMORY, ..Limits::default() };
    // Animations are read only when one is played.
    let moment = Some(Moment { animation: None, time: 0.7 });
    let options = LoadOptions { limits, moment, ..LoadOptions::default() };
    let loaded = match load_bytes(path, bytes, &options) {
        Ok(loaded) => loaded,
        Err(error) => {
            let message = error.to_string();
            assert!(!message.is_empty() && message.lines().count() <= 21, "{message}");
            return false;
        }
    };
    assert!(loaded.warnings.len() <= 100, "{:?}", loaded.warnings);
    let scene = &loaded.scene;
    let mut vertices = 0;
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        vertices += count as u64;
        let fits = |length: usize| length == 0 || length == count;
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < count));
        assert!(fits(mesh.normals.len()) && fits(mesh.tangents.len()) && fits(mesh.colors.len()));
        assert!(mesh.uvs.iter().all(|uvs| fits(uvs.len())));
        assert!((mesh.material as usize) < scene.materials.len());
    }
    assert!(vertices * 16 <= MEMORY);
    assert!(scene.instances.iter().all(|i| (i.mesh as usize) < scene.meshes.len() && i.world_from_object.is_finite()));
    assert!(scene.textures.iter().all(|t| (t.bitmap as usize) < scene.bitmaps.len()));
    true
}

/// The JSON of a GLB, and the bytes after it.
fn parts(glb: &[u8]) -> (&[u8], &[u8]) {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    glb[20..].split_at(length)
}

#[test]
fn files_with_wrong_bytes_end_in_a_scene_or_a_message() {
    try_all("bytes", |bytes, random| {
        let mut bytes = bytes.to_vec();
        // Most of a file is vertices; half of the errors go to headers and JSON.
        let ends = [bytes.len(), 20 + parts(&bytes).0.len()];
        for _ in 0..=random.below(4) {
            let end = ends[random.below(2)];
            let at = random.below(end);
            bytes[at] = if random.below(2) == 0 { bytes[at] ^ 1 << random.below(8) } else { random.bits() as u8 };
        }
        bytes
    });
}

#[test]
fn files_that_are_cut_off_end_in_a_scene_or_a_message() {
    try_all("cut", |bytes, random| {
        let mut bytes = bytes[..random.below(bytes.len())].to_vec();
        // Half of them with a matching length in the header.
        if random.below(2) == 0 && bytes.len() >= 12 {
            let length = bytes.len() as u32;
            bytes[8..12].copy_from_slice(&length.to_le_bytes());
        }
        bytes
    });
}

#[test]
fn files_with_wrong_values_end_in_a_scene_or_a_message() {
    try_all("values", |bytes, random| {
        let (json, rest) = parts(bytes);
        let mut root: Value = serde_json::from_slice(json).unwrap();
        for _ in 0..=random.below(3) {
            let copy = root.clone();
            change(&mut root, &copy, random);
        }
        let mut json = root.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let words = [2, (20 + json.len() + rest.len()) as u32, json.len() as u32, u32::from_le_bytes(*b"JSON")];
        let words: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        [b"glTF", &words[..], &json, rest].concat()
    });
}

/// Changes one value at random: an element or member of a list or object somewhere.
fn change(value: &mut Value, whole: &Value, random: &mut Random) {
    let count = match value {
        Value::Array(list) => list.len(),
        Value::Object(map) => map.len(),
        _ => 0,
    };
    if count == 0 || random.below(5) == 0 {
        *value = wrong(value, whole, random);
        return;
    }
    let at = random.below(count);
    match value {
        Value::Array(list) if random.below(10) == 0 => drop(list.remove(at)),
        Value::Array(list) => change(&mut list[at], whole, random),
        Value::Object(map) => {
            let name = map.keys().nth(at).unwrap().clone();
            if random.below(10) == 0 {
                map.remove(&name);
            } else {
                change(&mut map[&name], whole, random);
            }
        }
        _ => {}
    }
}

/// A value of a wrong type or size.
fn wrong(value: &Value, whole: &Value, random: &mut Random) -> Value {
    let numbers = [0.0f64, -1.0, 1.0, 0.5, 255.0, 65_536.0, 4_294_967_296.0, 9.0e15, 1e38, 1e308, -1e308, 5123.0];
    match random.below(8) {
        0 => Value::Null,
        1 => json!(""),
        2 => json!([]),
        3 => json!({}),
        4 => json!([value.clone(), value.clone(), value.clone()]),
        5 => json!({ "extensions": value.clone() }),
        6 => whole.get("nodes").cloned().unwrap_or_default(),
        _ => {
            let number = numbers[random.below(numbers.len())];
            if number.fract() == 0.0 && number.abs() < 1e18 { json!(number as i64) } else { json!(number) }
        }
    }
}
