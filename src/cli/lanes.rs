//! Many small scenes: several at a time, each on one thread.
//!
//! Much of what a small picture takes is no work for many threads: reading, parsing, encoding, writing, and all that waits
//! for a disk. Where there are many of them, threads that have one each are all at work until the last. Pictures are the
//! same bytes, and messages come as if one input had followed the other.

use super::accident;
use super::exit::Exit;
use super::interrupt;
use super::job::{Batch, RenderJob, Shot};
use super::message::Messages;
use super::progress::Progress;
use super::render::{self, SoFar};
use crate::threads;
use rayon::ThreadPool;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Inputs for each lane at least: the last ones leave lanes idle.
const MANY: usize = 4;

/// Bytes of a small input at most. What is larger takes many threads well, and memory.
const SMALL: u64 = 8 << 20;

/// How a run over inputs ended: as its worst, and how many failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ended {
    pub worst: Exit,
    pub failed: usize,
}

impl Ended {
    const WELL: Self = Self { worst: Exit::Done, failed: 0 };

    fn and(&mut self, exit: Exit) {
        self.worst = self.worst.max(exit);
        self.failed += usize::from(exit != Exit::Done);
    }
}

/// Renders all inputs, or as many as there are until a signal comes: those that are small side by side, where that pays, then the
/// others one by one.
pub(super) fn run(job: &RenderJob, pool: &ThreadPool, messages: &Messages, so_far: &mut SoFar) -> Ended {
    let lanes = if may_go_side_by_side(job) { pool.current_num_threads() } else { 1 };
    let all = || job.batches.iter();
    let (small, large): (Vec<&Batch>, Vec<&Batch>) = all().partition(|batch| lanes > 1 && is_small(batch));
    let pays = small.len() >= MANY * lanes;
    let mut ended = if pays { side_by_side(job, &small, lanes, messages, so_far) } else { Ended::WELL };
    for batch in if pays { large } else { all().collect() } {
        if interrupt::raised() {
            break;
        }
        let shots = render::writable_shots(job, batch, messages, so_far);
        ended.and(guarded(job, batch, shots, pool, messages, so_far));
    }
    ended
}

/// Not where memory has a bound of its own, which is that of one scene, nor where times are wanted, what is done by a signal, or
/// single threads.
fn may_go_side_by_side(job: &RenderJob) -> bool {
    let plain = !job.bounded && !job.profile && job.stats.is_none() && !job.dry_run && !job.keep_partial;
    plain && job.again.is_none()
}

fn is_small(batch: &Batch) -> bool {
    let length = |input: &std::path::PathBuf| input.metadata().map_or(0, |file| file.len());
    batch.inputs.iter().map(length).sum::<u64>() <= SMALL
}

/// Pictures of a scene that may be written, and how what was found out about the others ends.
type Writable<'a> = (Vec<&'a Shot>, Exit);

/// Renders the pictures of a scene; an accident ends these alone.
fn guarded(
    job: &RenderJob,
    batch: &Batch,
    (shots, worst): Writable,
    pool: &ThreadPool,
    messages: &Messages,
    so_far: &mut SoFar,
) -> Exit {
    let name = batch.inputs[0].display().to_string();
    let work = || pool.install(|| render::render_batch(job, batch, &shots, messages, so_far));
    worst.max(accident::guard(&name, messages, work))
}

fn side_by_side(job: &RenderJob, batches: &[&Batch], lanes: usize, messages: &Messages, so_far: &mut SoFar) -> Ended {
    let progress = Progress::new(&format!("{} inputs", batches.len()), messages, job.quiet, false);
    progress.begin("rendering");
    let waiting = batches.iter().map(|_| None).collect();
    let state = State { next: 0, finished: 0, told: 0, waiting, so_far, ended: Ended::WELL };
    let queue = Queue { job, batches, messages, progress, state: Mutex::new(state) };
    std::thread::scope(|scope| {
        let started: Vec<_> = (0..lanes).map(|_| scope.spawn(|| queue.work())).collect();
        // A lane that could not start leaves its work to the others, and the first says why.
        let faults: Vec<String> = started.into_iter().filter_map(|lane| lane.join().unwrap_or(None)).collect();
        if faults.len() == lanes {
            messages.error("threads", format!("cannot start a thread: {}", faults[0]), "ask for fewer");
            queue.state().ended.and(Exit::Failed);
        }
    });
    queue.tell_the_rest();
    queue.state().ended
}

/// The inputs that wait for a lane.
struct Queue<'a, 's> {
    job: &'a RenderJob,
    batches: &'a [&'a Batch],
    messages: &'a Messages,
    progress: Progress<'a>,
    state: Mutex<State<'s>>,
}

struct State<'s> {
    /// The input that the next free lane takes.
    next: usize,
    finished: usize,
    /// Of so many from the first on all was told.
    told: usize,
    /// What came of others, until those before them are told.
    waiting: Vec<Option<Finished>>,
    so_far: &'s mut SoFar,
    ended: Ended,
}

/// What came of an input.
struct Finished {
    messages: Messages,
    so_far: SoFar,
    exit: Exit,
}

impl<'a, 's> Queue<'a, 's> {
    fn state(&self) -> MutexGuard<'_, State<'s>> {
        // What a lane changes it changes as a whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a lane does; why it could not start.
    fn work(&self) -> Option<String> {
        let pool = match threads::pool(1) {
            Ok(pool) => pool,
            Err(error) => return Some(error.to_string()),
        };
        while !interrupt::raised() {
            let Some((number, messages, shots, mut so_far)) = self.take() else { break };
            let exit = guarded(self.job, self.batches[number], shots, &pool, &messages, &mut so_far);
            self.put(number, Finished { messages, so_far, exit });
        }
        None
    }

    /// The next input, with messages of its own. Whether its pictures may be written is asked in the order of inputs.
    fn take(&self) -> Option<(usize, Messages, Writable<'a>, SoFar)> {
        let mut state = self.state();
        let number = state.next;
        let batch = *self.batches.get(number)?;
        state.next += 1;
        let messages = self.messages.apart();
        let shots = render::writable_shots(self.job, batch, &messages, state.so_far);
        let own = state.so_far.of_one();
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

    fn tell(&self, state: &mut State, Finished { messages, so_far, exit }: Finished) {
        self.messages.tell(&messages);
        state.so_far.add(so_far);
        state.ended.and(exit);
    }

    /// Tells what was finished behind inputs that a signal has kept from being so.
    fn tell_the_rest(&self) {
        let mut state = self.state();
        let rest: Vec<Finished> = state.waiting.iter_mut().filter_map(Option::take).collect();
        rest.into_iter().for_each(|finished| self.tell(&mut state, finished));
        self.progress.finish();
    }
}
