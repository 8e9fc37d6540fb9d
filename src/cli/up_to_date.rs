//! `--update`: finds the pictures that rendering would only reproduce.
//!
//! A picture rendered with `--update` stores a hash of its request and of the program, and the hash of each file that was read.
//! It is up to date if all of these are unchanged, whatever the modification times. (Other pictures do not store their request:
//! there are several ways to request the same.)

use super::archives;
use super::job::{Batch, RenderJob, Shot};
use crate::image::{Metadata, read_metadata};
use crate::load::Loaded;
use crate::load::archive;
use crate::load::paths::FileRead;
use serde_json::{Map, Value};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// Bytes of a file read at a time.
const CHUNK: usize = 1 << 16;

/// Maximum length of the stored text: a JPEG cannot hold many times as much.
const MOST: usize = 1 << 15;

/// Text stored in a picture about what it was made of: under `asked` the hash of the request, under `files` that of each file,
/// and whether there were `gaps`, files that were looked for but missing; `None` for standard input, for a path that is not
/// UTF-8, and with hundreds of files.
pub(super) fn made_of(job: &RenderJob, batch: &Batch, shot: &Shot, loaded: &Loaded) -> Option<String> {
    if batch.inputs.iter().any(|input| input == Path::new("-")) {
        return None;
    }
    let file = |FileRead { path, hash }: &FileRead| Some((path.to_str()?.to_owned(), Value::from(hex(*hash))));
    let files: Map<String, Value> = loaded.facts.files.iter().map(file).collect::<Option<_>>()?;
    let (asked, gaps) = (settings_hash(job, batch, shot), loaded.facts.gaps);
    let text = serde_json::json!({ "asked": asked, "files": files, "gaps": gaps }).to_string();
    (text.len() <= MOST).then_some(text)
}

/// Files that the existing picture was made of, if it is up to date as far as is known before loading the model. Pictures with
/// gaps are not, since the missing files may exist by now.
pub(super) fn up_to_date(job: &RenderJob, batch: &Batch, shot: &Shot) -> Option<Vec<PathBuf>> {
    let Value::Object(made_of) = serde_json::from_str(&carried(shot)?).ok()? else { return None };
    let Value::Object(files) = made_of.get("files")? else { return None };
    let is_same = |(path, hash): (&String, &Value)| {
        hash_of_file(Path::new(path)).is_ok_and(|found| hash.as_str() == Some(hex(found).as_str()))
    };
    let same = made_of.get("asked").and_then(Value::as_str) == Some(settings_hash(job, batch, shot).as_str())
        && made_of.get("gaps").and_then(Value::as_bool) == Some(false)
        && !files.is_empty()
        && files.iter().all(is_same)
        && batch.inputs.iter().all(|input| is_still_meant(input, files));
    same.then(|| files.keys().map(PathBuf::from).collect())
}

/// Whether an archive would still be read for the same model.
fn is_still_meant(input: &Path, files: &Map<String, Value>) -> bool {
    let archive = if input.is_file() { archive::opened(input) } else { Ok(None) };
    match archive {
        Ok(None) => true,
        Ok(Some(archive)) => match &archive.models(Path::new(""))[..] {
            [only] => input.join(only.name).to_str().is_some_and(|path| files.contains_key(path)),
            _ => false,
        },
        Err(_) => false,
    }
}

/// Whether the existing picture was made of what is loaded now.
pub(super) fn is_as_loaded(job: &RenderJob, batch: &Batch, shot: &Shot, loaded: &Loaded) -> bool {
    let made_of = made_of(job, batch, shot, loaded);
    made_of.is_some() && made_of == carried(shot)
}

/// Text on what the existing picture was made of.
fn carried(shot: &Shot) -> Option<String> {
    let picture = shot.target.path().filter(|path| path.is_file())?;
    let metadata = read_metadata(picture).ok().flatten()?;
    metadata.get(Metadata::MADE_OF).map(str::to_owned)
}

/// Hash of everything that determines a picture except the contents of files: equal for equal command lines of the same program.
fn settings_hash(job: &RenderJob, batch: &Batch, shot: &Shot) -> String {
    let how = (&job.load, &job.look, &job.sequence, job.accel, job.intersector, &job.params, job.instances);
    let which = (&batch.inputs, &shot.choice, &shot.step, shot.kind, job.allow_empty, job.strict);
    hex(xxh3_128(format!("{}\n{how:?}\n{which:?}", *PROGRAM).as_bytes()))
}

/// Identity of the program: the hash of its file, since builds of one version may draw differently; its version if it cannot be
/// read.
static PROGRAM: LazyLock<String> = LazyLock::new(|| {
    let hash = std::env::current_exe().and_then(|program| hash_of_file(&program));
    hash.map_or_else(|_| super::version::SHORT.to_owned(), hex)
});

fn hash_of_file(path: &Path) -> io::Result<u128> {
    let Ok(metadata) = path.metadata() else { return archives::read(path).map(|bytes| xxh3_128(&bytes)) };
    // Opening anything but a plain file could block forever.
    if !metadata.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let (mut file, mut hash, mut chunk) = (File::open(path)?, Xxh3::new(), vec![0; CHUNK]);
    loop {
        match file.read(&mut chunk)? {
            0 => return Ok(hash.digest128()),
            read => hash.update(&chunk[..read]),
        }
    }
}

fn hex(hash: u128) -> String {
    format!("{hash:032x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_the_hash_that_loading_gives_them() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("large.bin");
        for length in [0, 1, CHUNK - 1, CHUNK, 3 * CHUNK + 17] {
            let bytes: Vec<u8> = (0..length).map(|i| (i * i) as u8).collect();
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(hash_of_file(&path).unwrap(), xxh3_128(&bytes));
        }
        assert!(hash_of_file(dir.path()).is_err(), "a folder");
    }
}
