//! Loads inputs, from files or standard input, into one scene.

use super::args::{LoadArgs, ModelArgs};
use super::exit::Exit;
use super::message::{Messages, Severity};
use super::moment;
use crate::load::{Diagnostic, Limits, LoadError, LoadOptions, Loaded, check_moment, check_prims, load, load_bytes};
use crate::math::DAffine3;
use crate::render::{Instancing, Placing, World};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::slice;
use xxhash_rust::xxh3::xxh3_128;

/// Loads all inputs and appends them to the first one's scene, within the memory limit for all together.
pub(super) fn scene(inputs: &[PathBuf], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let (first, others) = match inputs {
        [] => return Ok(Loaded::default()),
        [only] => return one(only, options),
        [first, others @ ..] => (first, others),
    };
    let mut whole = one(first, &LoadOptions { animations_before: Some(0), ..options.clone() })?;
    let mut hashes = whole.facts.hash.to_le_bytes().to_vec();
    for input in others {
        let (limits, animations_before) =
            (remaining_limits(&options.limits, &whole), Some(whole.facts.animations.len()));
        let part = one(input, &LoadOptions { limits, animations_before, ..options.clone() })?;
        hashes.extend(part.facts.hash.to_le_bytes());
        append(&mut whole, part);
    }
    whole.facts.hash = xxh3_128(&hashes);
    check_prims(&whole.scene, first)?;
    check_moment(&mut whole, first, options)?;
    Ok(whole)
}

/// Limits that remain beside a loaded model.
pub(super) fn remaining_limits(limits: &Limits, loaded: &Loaded) -> Limits {
    limits_beside(limits, loaded.facts.kept)
}

/// Limits that remain beside `bytes` bytes.
pub(super) fn limits_beside(limits: &Limits, bytes: u64) -> Limits {
    let memory = limits.memory.saturating_sub(bytes);
    Limits { memory, file: limits.file.min(memory), ..*limits }
}

/// Loads one model and reports its warnings; a failure is reported too. Refuses a scene too large to flatten.
pub(super) fn model(args: &ModelArgs, messages: &Messages) -> Result<Loaded, Exit> {
    let ModelArgs { input, load, .. } = args;
    let loaded = model_as_stored(input, load, messages)?;
    check_flattened(&loaded, load.limits().memory, input).map_err(|fault| messages.fail(&fault, Exit::Failed))?;
    Ok(loaded)
}

/// Loads a model for a command that does not need flattened instances.
pub(super) fn model_as_stored(input: &PathBuf, args: &LoadArgs, messages: &Messages) -> Result<Loaded, Exit> {
    let moment = moment::moment(&args.moment).map_err(|wrong| messages.wrong(wrong))?;
    let options = LoadOptions { moment, ..args.options() };
    let loaded = scene(slice::from_ref(input), &options).map_err(|error| messages.load_error(&error))?;
    loaded.warnings.iter().for_each(|w| messages.say(Severity::Warning, w));
    Ok(loaded)
}

/// Refuses a scene whose flattened instances take more memory than allowed: a small file can name millions of them.
pub(super) fn check_flattened(loaded: &Loaded, limit: u64, file: &Path) -> Result<(), Diagnostic> {
    let bytes = World::flattened_bytes(&loaded.scene);
    check_stored(loaded, bytes, limit, file, "raise --max-memory")
}

/// Refuses a scene whose stored instances take more bytes than allowed.
pub(super) fn check_stored(
    loaded: &Loaded,
    bytes: u64,
    limit: u64,
    file: &Path,
    remedy: &str,
) -> Result<(), Diagnostic> {
    if bytes <= limit {
        return Ok(());
    }
    let count = loaded.scene.instances.len();
    let text = format!(
        "its {count} instances, as far as each is stored by itself, take {bytes} bytes or more where {limit} are allowed"
    );
    Err(Diagnostic::new("instances-too-large", file, "", text).remedy(remedy))
}

/// Stores a scene in the `wanted` way, or in the `other` way if its flattened instances would exceed the memory limit.
pub(super) fn placed(
    loaded: &Loaded,
    wanted: Instancing,
    other: Instancing,
    limit: u64,
    file: &Path,
    remedy: &str,
) -> Result<World, Diagnostic> {
    let as_wanted = Placing::new(&loaded.scene, wanted);
    if as_wanted.bytes() <= limit {
        return Ok(as_wanted.world());
    }
    let otherwise = Placing::new(&loaded.scene, other);
    check_stored(loaded, otherwise.bytes(), limit, file, remedy)?;
    Ok(otherwise.world())
}

/// Stores a scene as for rendering it: instances are kept also where nothing else fits, unless flattening is requested.
pub(super) fn as_drawn(loaded: &Loaded, how: Instancing, limit: u64, file: &Path) -> Result<World, Diagnostic> {
    let (other, remedy) = match how {
        Instancing::Flatten => (
            Instancing::Flatten,
            "leave it to a fast structure to keep them once (render: --instances auto), or raise --max-memory",
        ),
        Instancing::Keep | Instancing::Auto => (Instancing::Keep, "raise --max-memory"),
    };
    placed(loaded, how, other, limit, file, remedy)
}

/// Fault of a model with warnings that is not rendered because of `--strict`.
pub(super) fn not_strict(count: usize, file: &Path) -> Diagnostic {
    let kinds = if count == 1 { "is a warning".into() } else { format!("are {count} kinds of warnings") };
    Diagnostic::new("strict", file, "", format!("not rendered: --strict, and there {kinds}"))
        .remedy("mend what they tell of, or leave out --strict")
}

/// Gives a frame that was loaded without pictures those of an earlier one, with the materials that show them. Returns false if
/// the materials differ, a sign that the file has changed in between.
pub(super) fn take_pictures(frame: &mut Loaded, earlier: Loaded) -> bool {
    let names =
        |loaded: &Loaded| loaded.scene.materials.iter().map(|material| material.name.clone()).collect::<Vec<_>>();
    if names(frame) != names(&earlier) {
        return false;
    }
    let (to, from) = (&mut frame.scene, earlier.scene);
    (to.materials, to.textures, to.bitmaps) = (from.materials, from.textures, from.bitmaps);
    (to.environment, to.panorama) = (from.environment, from.panorama);
    let facts = earlier.facts;
    (frame.facts.files, frame.facts.hash, frame.facts.gaps) = (facts.files, facts.hash, facts.gaps);
    true
}

fn append(whole: &mut Loaded, part: Loaded) {
    whole.scene.append(part.scene, &DAffine3::IDENTITY);
    whole.warnings.extend(part.warnings);
    let (facts, more) = (&mut whole.facts, part.facts);
    facts.add_animations(&more);
    facts.faces += more.faces;
    facts.dropped.extend(more.dropped);
    facts.wires.append(&more.wires);
    facts.extensions.extend(more.extensions);
    facts.max_rounding = facts.max_rounding.max(more.max_rounding);
    facts.files.extend(more.files);
    facts.gaps |= more.gaps;
    facts.kept += more.kept;
    facts.reading += more.reading;
    facts.decoding += more.decoding;
}

fn one(input: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    if input != Path::new("-") {
        return load(input, options);
    }
    let limit = options.limits.file;
    let mut bytes = Vec::new();
    let read = std::io::stdin().lock().take(limit.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|source| LoadError::Read {
        what: Box::new(Diagnostic::new("file-unreadable", "-", "", "standard input cannot be read")),
        source,
    })?;
    if bytes.len() as u64 > limit {
        let text = format!("more than the {limit} bytes that are allowed");
        return Err(Diagnostic::new("file-too-large", "-", "", text).remedy("raise --max-memory").into());
    }
    load_bytes(input, bytes, options)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    /// OBJ text of triangles: parsing it takes far more memory than the resulting mesh.
    fn model() -> String {
        let mut text = String::new();
        for i in 0..20_000 {
            let _ = writeln!(text, "v {i}.000000000000 0.000000000000 {}.000000000000", i % 7);
        }
        for i in 1..19_998 {
            let _ = writeln!(text, "f {i} {} {}", i + 1, i + 2);
        }
        text
    }

    #[test]
    fn models_that_are_merged_take_what_they_keep_and_not_what_loading_took_for_a_while() {
        let folder = tempfile::tempdir().unwrap();
        let inputs: Vec<PathBuf> = ["a.obj", "b.obj", "c.obj", "d.obj"].map(|name| folder.path().join(name)).into();
        inputs.iter().for_each(|input| std::fs::write(input, model()).unwrap());
        let within = |inputs: &[PathBuf], memory| {
            let limits = Limits { memory, file: memory, ..Limits::default() };
            scene(inputs, &LoadOptions { limits, ..LoadOptions::default() })
        };
        // Least memory, to 4 KiB, that one of them needs.
        let (mut less, mut enough) = (0, 1 << 30);
        while enough - less > 4096 {
            let middle = (less + enough) / 2;
            if within(&inputs[..1], middle).is_ok() { enough = middle } else { less = middle }
        }
        let kept = within(&inputs[..1], enough).unwrap().facts.kept;
        assert!(enough > 2 * kept, "{enough} for {kept}");
        let all = within(&inputs, enough + 3 * kept).unwrap();
        assert_eq!((all.facts.kept, all.scene.meshes.len()), (4 * kept, 4));
        assert!(within(&inputs, enough + 2 * kept - 8192).is_err());
    }
}
