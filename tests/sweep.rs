//! Every third-party model and broken file, in one process: each loads, renders small, has sane values, has the same bits whether
//! points are shaded one by one or side by side, and matches its stored picture.
//!
//! Runs only when `MESHRAY_SHARED` names the folder that holds `models/`; prints the numbers of files, of warnings and of
//! refusals.

use crate::common::{bits, stills};
use crate::golden::sheet::Sheet;
use meshray::accel::AccelKind;
use meshray::image::Picture;
use meshray::load::{LoadError, LoadOptions, Loaded, load};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

const SIZE: u32 = 64;

/// Longest time for a file to load and render.
const TIME_LIMIT: Duration = Duration::from_secs(60);

/// Number of triangles above which the textbook structure takes too long.
const MANY: usize = 1 << 20;

/// Least fraction of the pixels that a framed model with faces covers.
const MIN_COVERAGE: f64 = 0.05;

/// Models that cover less for a good reason, and that reason.
const THIN: &[(&str, &str)] = &[
    ("assimp/number_formats.obj", "its corners lie on one line"),
    ("assimp/regr_3429812.obj", "a strip 8 times as long as wide, seen askew"),
    ("tinyobjloader/issue-319-002.obj", "three faces of a building, far apart"),
    ("tinyobjloader/leading-decimal-dot-issue-201.obj", "a triangle 70 times as long as wide"),
    ("tinyobjloader/leading-zero-in-exponent-notation-issue-210.obj", "a triangle 70 times as long as wide"),
];

/// Outcome of one file.
enum Outcome {
    /// A picture, with the warnings.
    Drawn { picture: Box<Picture>, warnings: Vec<String>, faces: u64 },
    /// Nothing to draw, and reported as such.
    Empty,
    /// Refused with this message.
    Refused(String),
    /// A panic, a NaN or infinite value, or no answer in time: always our own fault.
    Broken(String),
}

#[test]
fn shared_models_are_drawn() {
    let Some(folder) = shared_models() else { return };
    let mut files = find(&folder);
    files.retain(|f| !f.starts_with(folder.join("invalid")));
    let (mut drawn, mut warned, mut empty, mut refused) = (0, 0, 0, 0);
    let (mut failures, mut sheet) = (Vec::new(), Sheet::default());
    for file in &files {
        let name = file.strip_prefix(&folder).unwrap_or(file).display().to_string();
        let start = Instant::now();
        match try_file(file) {
            Outcome::Drawn { picture, warnings, faces } => {
                drawn += 1;
                sheet.add(&name, &picture);
                let coverage = coverage(&picture);
                warned += usize::from(!warnings.is_empty());
                println!("{name}: {:.0} % covered, {:.0?}", coverage * 100.0, start.elapsed());
                warnings.iter().for_each(|w| println!("    {w}"));
                if faces > 0 && coverage < MIN_COVERAGE && !THIN.iter().any(|(thin, _why)| name.ends_with(thin)) {
                    failures.push(format!("{name}: covers {:.1} % of the pixels", coverage * 100.0));
                }
            }
            Outcome::Empty => {
                empty += 1;
                println!("{name}: nothing to draw");
            }
            Outcome::Refused(message) => {
                refused += 1;
                println!("{message}");
                let known = ["KHR_materials_", "KHR_techniques_webgl", "KHR_texture_basisu", "FAKE_"];
                if !message.contains("is required to draw this file")
                    || !known.iter().any(|name| message.contains(name))
                {
                    failures.push(format!("{name}: refused: {message}"));
                }
            }
            Outcome::Broken(how) => failures.push(format!("{name}: {how}")),
        }
    }
    println!("{} models: {drawn} drawn, {warned} of them warned, {empty} empty, {refused} refused", files.len());
    failures.extend(sheet.faults());
    assert!(drawn > 0, "no models under {}", folder.display());
    assert!(failures.is_empty(), "{} models fail:\n{}", failures.len(), failures.join("\n"));
}

/// Models that exist in compressed form as well.
const PAIRS: &[(&str, &str)] = &[
    ("Box/glTF/Box.gltf", "Box/glTF-Draco/Box.gltf"),
    ("CesiumMan/glTF-Binary/CesiumMan.glb", "CesiumMan/glTF-Draco/CesiumMan.gltf"),
    ("Duck/glTF/Duck.gltf", "Duck/glTF-Draco/Duck.gltf"),
    ("MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf", "MorphPrimitivesTest/glTF-Draco/MorphPrimitivesTest.gltf"),
    ("RiggedSimple/glTF/RiggedSimple.gltf", "RiggedSimple/glTF-Draco/RiggedSimple.gltf"),
];

#[test]
fn shared_compressed_models_are_those_that_were_compressed() {
    let Some(folder) = shared_models() else { return };
    for (plain, compressed) in PAIRS {
        let outline = |name: &str| {
            let loaded = load(&folder.join(name), &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
            (loaded.facts.faces, bounds(&loaded))
        };
        let (plain, compressed) = (outline(plain), outline(compressed));
        assert_eq!(plain.0, compressed.0);
        // Positions of 11 bits and more.
        let size = plain.1.iter().map(|(lo, hi)| hi - lo).fold(0.0, f64::max);
        for (a, b) in plain.1.iter().zip(compressed.1) {
            let near = (a.0 - b.0).abs().max((a.1 - b.1).abs()) < size / 2048.0;
            assert!(near, "{compressed:?} where {plain:?} should be");
        }
    }
}

/// Least and greatest coordinate on each axis.
fn bounds(loaded: &Loaded) -> [(f64, f64); 3] {
    let mut bounds = [(f64::INFINITY, f64::NEG_INFINITY); 3];
    for instance in &loaded.scene.instances {
        for position in &loaded.scene.meshes[instance.mesh as usize].positions {
            let point = instance.world_from_object.transform_point3(position.as_dvec3()).to_array();
            for ((lo, hi), value) in bounds.iter_mut().zip(point) {
                (*lo, *hi) = (lo.min(value), hi.max(value));
            }
        }
    }
    bounds
}

#[test]
fn shared_broken_files_end_in_a_message() {
    let Some(folder) = shared_models() else { return };
    let files = find(&folder.join("invalid"));
    let (mut drawn, mut empty, mut refused) = (0, 0, 0);
    let mut failures = Vec::new();
    for file in &files {
        match try_file(file) {
            Outcome::Drawn { .. } => drawn += 1,
            Outcome::Empty => empty += 1,
            Outcome::Refused(message) if message.trim().is_empty() => {
                failures.push(format!("{}: mute", file.display()))
            }
            Outcome::Refused(_) => refused += 1,
            Outcome::Broken(how) => failures.push(format!("{}: {how}", file.display())),
        }
    }
    println!("{} broken files: {refused} refused, {drawn} drawn all the same, {empty} empty", files.len());
    assert!(refused > files.len() / 5, "there are some, and many are refused");
    assert!(failures.is_empty(), "{} files fail:\n{}", failures.len(), failures.join("\n"));
}

fn shared_models() -> Option<PathBuf> {
    let shared = std::env::var_os("MESHRAY_SHARED").map(PathBuf::from);
    if shared.is_none() {
        println!("MESHRAY_SHARED is not set: 0 shared models");
    }
    shared.map(|shared| shared.join("models"))
}

/// All model files below `folder`, sorted.
fn find(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
            if path.is_dir() {
                folders.push(path);
            } else if ["gltf", "glb", "obj", "ply", "stl"].contains(&extension.as_str()) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Loads and renders one file on a thread of its own, so that a hang is an outcome, too.
fn try_file(path: &Path) -> Outcome {
    let (sender, receiver) = mpsc::channel();
    let file = path.to_owned();
    std::thread::spawn(move || {
        let outcome = catch_unwind(AssertUnwindSafe(|| draw(&file)));
        // Once the time limit has passed, the receiver is gone.
        let _ = sender.send(outcome.unwrap_or_else(|_| Outcome::Broken("panic".into())));
    });
    receiver.recv_timeout(TIME_LIMIT).unwrap_or_else(|_| Outcome::Broken(format!("no answer in {TIME_LIMIT:?}")))
}

fn draw(path: &Path) -> Outcome {
    let loaded = match load(path, &LoadOptions::default()) {
        Ok(loaded) => loaded,
        Err(LoadError::Read { what, source }) => return Outcome::Refused(format!("{what}: {source}")),
        Err(LoadError::Input(faults)) => return Outcome::Refused(faults[0].to_string()),
    };
    if let Err(what) = check(&loaded) {
        return Outcome::Broken(format!("wrong {what}"));
    }
    let triangles: usize = loaded.scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let kind = if triangles > MANY { AccelKind::DEFAULT } else { AccelKind::GridOctree };
    let Some([picture, one_by_one]) = stills(loaded.scene, kind, (SIZE, SIZE), [false, true]) else {
        return Outcome::Empty;
    };
    let differ = bits(&picture).into_iter().zip(bits(&one_by_one)).filter(|(a, b)| a != b).count();
    if differ > 0 {
        return Outcome::Broken(format!("{differ} numbers are others where points are shaded one by one"));
    }
    if picture.beauty.iter().flatten().any(|v| !v.is_finite()) {
        return Outcome::Broken("a pixel is not a number".into());
    }
    let warnings = loaded.warnings.iter().map(ToString::to_string).collect();
    Outcome::Drawn { picture: Box::new(picture), warnings, faces: loaded.facts.faces }
}

/// Fraction of the pixels that show a surface, however transparent.
fn coverage(picture: &Picture) -> f64 {
    let seen = picture.layers.iter().flat_map(|layers| &layers.prim).filter(|&&prim| prim != u32::MAX).count();
    seen as f64 / picture.beauty.len() as f64
}

/// Checks that a scene is consistent, positions and transforms are finite, and normals and tangents unit vectors.
fn check(loaded: &Loaded) -> Result<(), String> {
    let scene = &loaded.scene;
    scene.check().map_err(|fault| fault.to_string())?;
    let ensure = |right: bool, what: &str| if right { Ok(()) } else { Err(what.to_owned()) };
    for mesh in &scene.meshes {
        ensure(mesh.positions.iter().all(|p| p.is_finite()), "position")?;
        ensure(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4), "normal")?;
        ensure(mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-4), "tangent")?;
    }
    ensure(scene.instances.iter().all(|i| i.world_from_object.is_finite()), "place")
}
