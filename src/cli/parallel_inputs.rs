//! Renders many small scenes in parallel, each on one thread.
//!
//! Much of the time of a small picture is not parallel: reading, parsing, encoding, writing, and waiting for disks. With many
//! small pictures, one thread for each keeps all threads busy until the last. Pictures have the same bytes as otherwise, and
//! messages keep the order of these inputs; larger inputs come after them.

use super::exit::Exit;
use super::interrupt;
use super::job::{Batch, RenderJob, Shot};
use super::message::Messages;
use super::outputs::Target;
use super::panics;
use super::progress::Progress;
use super::render::{self, RunState};
use crate::image::was_written_by_meshray;
use crate::load::archive;
use crate::load::is_called_a_model;
use crate::render::Settings;
use crate::threads;
use rayon::ThreadPool;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Minimum number of inputs per lane: the last ones leave lanes idle.
const MANY: usize = 4;

/// Maximum size of a small input in bytes. Larger ones scale well to many threads, and need memory.
const SMALL: u64 = 8 << 20;

/// Maximum number of pixels of a small picture.
const PIXELS: u64 = 1 << 20;

/// Maximum number of files and folders to look at beside a model.
const LOOKED_AT: usize = 100_000;

/// Outcome of a run: the worst exit of all inputs, and the number of failed ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RunOutcome {
    pub worst: Exit,
    pub failed: usize,
}

impl RunOutcome {
    const WELL: Self = Self { worst: Exit::Done, failed: 0 };

    fn and(&mut self, exit: Exit) {
        self.worst = self.worst.max(exit);
        self.failed += usize::from(exit != Exit::Done);
    }
}

/// Renders all inputs until a signal comes: small ones in parallel if that pays, then the others one by one.
pub(super) fn run(job: &RenderJob, pool: &ThreadPool, messages: &Messages, run_state: &mut RunState) -> RunOutcome {
    let lanes = if may_go_side_by_side(job) { pool.current_num_threads() } else { 1 };
    let (mut small, mut others) = (Vec::new(), Vec::new());
    let mut sizes = Sizes { has_size: job.look.size.is_some(), beside: HashMap::new() };
    for batch in &job.batches {
        if lanes > 1 && sizes.are_small(batch) && spares_others(batch) { &mut small } else { &mut others }.push(batch);
    }
    let mut ended = RunOutcome::WELL;
    if small.len() >= MANY * lanes {
        ended = side_by_side(job, &small, lanes, pool, messages, run_state);
    } else {
        others = job.batches.iter().collect();
    }
    for batch in others {
        if interrupt::raised() {
            break;
        }
        let shots = render::writable_shots(job, batch, messages, run_state);
        ended.and(guarded(job, batch, shots, pool, messages, run_state));
    }
    ended
}

/// Whether the job allows inputs in parallel: not with a memory limit, which applies to one scene, nor if times are requested,
/// interrupted pictures are kept, or pictures are large.
fn may_go_side_by_side(job: &RenderJob) -> bool {
    let usual = Settings::default();
    let (width, height) = job.look.size.unwrap_or((usual.width, usual.height));
    let times = job.profile || job.stats.is_some() || !job.heatmaps.is_empty() || !job.look.costs.is_empty();
    let small = u64::from(width) * u64::from(height) <= PIXELS;
    small && !(job.bounded || times || job.dry_run || job.keep_partial || job.again.is_some())
}

/// Estimates the sizes of inputs.
struct Sizes {
    /// Whether the picture size was typed; NFF files bring their own, which is known only after reading.
    has_size: bool,
    /// Bytes beside models, per model, for each folder.
    beside: HashMap<PathBuf, Option<u64>>,
}

impl Sizes {
    /// Whether everything a scene is read from is small. Self-contained files count by themselves; others also count their share
    /// of all files beside them and in the folders there, since they may name any of them.
    fn are_small(&mut self, batch: &Batch) -> bool {
        let mut length = |input: &PathBuf| {
            let kind = input.extension()?.to_str()?.to_ascii_lowercase();
            // A file in an archive counts its share of it; a missing file fails quickly.
            let Ok(file) = input.metadata() else {
                return Some(archive::in_archive(input).ok().flatten().map_or(0, |(archive, _)| archive.share()));
            };
            let own = file.is_file().then_some(file.len())?;
            match kind.as_str() {
                "glb" | "ply" | "stl" => Some(own),
                "zip" => archive::opened(input).ok().flatten().map(|archive| archive.share()),
                "nff" => self.has_size.then_some(own),
                "gltf" | "obj" => {
                    let folder = input.parent()?;
                    Some(own + (*self.beside.entry(folder.to_path_buf()).or_insert_with(|| companion_bytes(folder)))?)
                }
                _ => None,
            }
        };
        batch.inputs.iter().map(&mut length).sum::<Option<u64>>().is_some_and(|bytes| bytes <= SMALL)
    }
}

/// Bytes per model of other files in a folder and its direct subfolders; `None` with more than [`LOOKED_AT`] entries.
fn companion_bytes(folder: &Path) -> Option<u64> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (mut bytes, mut models, mut looked_at, mut left) = (0, 0, 0, vec![(folder.to_path_buf(), true)]);
    while let Some((folder, is_own)) = left.pop() {
        for entry in folder.read_dir().ok()? {
            let entry = entry.ok()?;
            looked_at += 1;
            if looked_at > LOOKED_AT {
                return None;
            }
            let (path, metadata) = (entry.path(), entry.metadata().ok()?);
            if metadata.is_dir() && is_own {
                left.push((path, false));
            } else if is_called_a_model(&path) {
                models += u64::from(is_own);
            } else if metadata.is_file() {
                bytes += metadata.len();
            }
        }
    }
    Some(bytes / models.max(1))
}

/// Whether the pictures of a scene replace no files but pictures written by meshray: files that other inputs read are not known
/// before those are loaded. Default names never replace others.
fn spares_others(batch: &Batch) -> bool {
    batch.shots.iter().all(|shot| match &shot.target {
        Target::Named(path) => !path.exists() || was_written_by_meshray(path),
        Target::Default(_) | Target::Stdout => true,
    })
}

/// Shots of a scene that may be written, and the worst exit of the others.
type Writable<'a> = (Vec<&'a Shot>, Exit);

/// Renders the pictures of a scene; a panic ends only these.
fn guarded(
    job: &RenderJob,
    batch: &Batch,
    (shots, worst): Writable,
    pool: &ThreadPool,
    messages: &Messages,
    run_state: &mut RunState,
) -> Exit {
    let name = batch.inputs[0].display().to_string();
    let work = || pool.install(|| render::render_batch(job, batch, &shots, messages, run_state));
    worst.max(panics::guard(&name, messages, work))
}

fn side_by_side(
    job: &RenderJob,
    batches: &[&Batch],
    lanes: usize,
    pool: &ThreadPool,
    messages: &Messages,
    run_state: &mut RunState,
) -> RunOutcome {
    let progress = Progress::new(&format!("{} inputs", batches.len()), messages, job.quiet, false);
    progress.begin("rendering");
    let waiting = batches.iter().map(|_| None).collect();
    let state = State { next: 0, finished: 0, told: 0, waiting, run_state, ended: RunOutcome::WELL };
    let queue = Queue { job, batches, messages, progress, state: Mutex::new(state) };
    std::thread::scope(|scope| {
        for _ in 0..lanes {
            let lane = || threads::pool(1).map_or((), |pool| queue.work(&pool));
            // If the system starts no more threads, there are fewer lanes.
            if std::thread::Builder::new().spawn_scoped(scope, lane).is_err() {
                break;
            }
        }
    });
    // If it starts none, this thread does all the work.
    queue.work(pool);
    queue.end()
}

/// Inputs waiting for a lane.
struct Queue<'a, 's> {
    job: &'a RenderJob,
    batches: &'a [&'a Batch],
    messages: &'a Messages,
    progress: Progress<'a>,
    state: Mutex<State<'s>>,
}

struct State<'s> {
    /// Index of the input that the next free lane takes.
    next: usize,
    /// Number of finished inputs.
    finished: usize,
    /// Number of leading inputs whose results are reported.
    told: usize,
    /// Results of finished inputs, until all inputs before them are reported.
    waiting: Vec<Option<Finished>>,
    run_state: &'s mut RunState,
    ended: RunOutcome,
}

/// Results of an input.
struct Finished {
    messages: Messages,
    run_state: RunState,
    exit: Exit,
}

impl<'a, 's> Queue<'a, 's> {
    fn state(&self) -> MutexGuard<'_, State<'s>> {
        // Every change of the state under the lock is complete, so a poisoned lock is harmless.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Works through the queue on one lane.
    fn work(&self, pool: &ThreadPool) {
        while !interrupt::raised() {
            let Some((number, messages, shots, mut run_state)) = self.take() else { break };
            let exit = guarded(self.job, self.batches[number], shots, pool, &messages, &mut run_state);
            self.put(number, Finished { messages, run_state, exit });
        }
    }

    /// Takes the next input, with its own messages. Writability of pictures is checked in the order of inputs.
    fn take(&self) -> Option<(usize, Messages, Writable<'a>, RunState)> {
        let mut state = self.state();
        let number = state.next;
        let batch = *self.batches.get(number)?;
        state.next += 1;
        let messages = self.messages.held_back();
        let shots = render::writable_shots(self.job, batch, &messages, state.run_state);
        let own = state.run_state.of_one();
        Some((number, messages, shots, own))
    }

    fn put(&self, number: usize, finished: Finished) {
        let mut state = self.state();
        state.finished += 1;
        state.waiting[number] = Some(finished);
        loop {
            let turn = state.told;
            let Some(finished) = state.waiting.get_mut(turn).and_then(Option::take) else { break };
            state.told += 1;
            self.tell(&mut state, finished);
        }
        self.progress.advance(state.finished, self.batches.len());
    }

    fn tell(&self, state: &mut State, Finished { messages, run_state, exit }: Finished) {
        self.messages.write_held(&messages);
        state.run_state.add(run_state);
        state.ended.and(exit);
    }

    /// Reports the results that follow inputs left unfinished because of a signal.
    fn end(self) -> RunOutcome {
        self.progress.finish();
        let mut state = self.state();
        for finished in state.waiting.iter_mut().filter_map(Option::take).collect::<Vec<_>>() {
            self.tell(&mut state, finished);
        }
        state.ended
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn small_is_what_a_model_may_read_and_not_its_own_file_alone() {
        let dir = tempfile::tempdir().unwrap();
        let of = |name: &str, has_size: bool| {
            let batch = Batch { inputs: vec![dir.path().join(name)], shots: Vec::new() };
            Sizes { has_size, beside: HashMap::new() }.are_small(&batch)
        };
        let small = |name: &str| of(name, true);
        let write = |name: &str, bytes: u64| {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::File::create(path).unwrap().set_len(bytes).unwrap();
        };
        write("own/a.nff", 10);
        assert_eq!((of("own/a.nff", true), of("own/a.nff", false)), (true, false), "it says how large its picture is");
        for name in ["lone/a.gltf", "pair/a.obj", "pair/b.obj", "deep/a.gltf", "own/a.glb"] {
            write(name, 10);
        }
        write("lone/a.bin", SMALL);
        write("pair/all.png", SMALL);
        write("deep/maps/a.png", SMALL - 10);
        write("deep/maps/deeper/a.png", SMALL);
        write("own/a.bin", SMALL);
        write("own/large.glb", SMALL + 1);
        write("own/a.toml", 10);
        assert!(!small("lone/a.gltf") && small("pair/a.obj") && small("deep/a.gltf") && small("own/a.glb"));
        assert!(!small("own/large.glb") && !small("own/a.toml") && !small("-") && small("gone.obj"));
    }
}
