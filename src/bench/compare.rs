//! Sends the same rays through every structure and compares hits and costs.
//!
//! Counts and times come from separate passes: a timed pass carries no counters. The passes of all structures are
//! interleaved, so that a temporary disturbance of the machine affects all of them.

use super::clock::{Spread, timed};
use super::rays::{Batch, Class, RaySet};
use super::replay::{Answer, answers, counted, seconds};
use super::row::{ClassRow, Row};
use super::sweep::{Setting, Sweep};
use crate::accel::{Accel, AccelChoice, AccelKind, AccelParams, AnyAccel};
use crate::render::{Filters, World};
use crate::threads;

/// Settings of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Structures to compare, each once.
    pub kinds: Vec<AccelKind>,
    /// Parameters of the structures.
    pub params: AccelParams,
    /// Parameter to sweep over several values; `kinds` are then the structures that it changes.
    pub sweep: Option<Sweep>,
    /// Number of timed passes; 0 only counts.
    pub passes: usize,
    /// Threads that build and trace; at least 1.
    pub threads: usize,
    /// Maximum number of rays per class.
    pub rays: usize,
    /// Ray/prim tests per class that a slow structure may take in a pass; its number of rays follows from that.
    pub slow_tests: u64,
    /// Seed of the diffuse rays and of the sampling.
    pub seed: u64,
}

impl Plan {
    /// Default of [`Self::passes`]: takes about half a minute for a mesh of a hundred thousand triangles.
    pub const PASSES: usize = 5;
    /// Default of [`Self::rays`].
    pub const RAYS: usize = 200_000;
    /// Default of [`Self::slow_tests`].
    pub const SLOW_TESTS: u64 = 20_000_000;

    /// Minimum number of rays per class for a slow structure.
    pub const FEWEST: usize = 16;

    /// Number of rays per class for a slow structure.
    fn affordable(&self, prims: usize) -> usize {
        self.within_slow_tests(prims).max(Self::FEWEST)
    }

    /// Whether a structure stays within [`Self::slow_tests`] with `prims` prims and [`Self::FEWEST`] rays.
    pub fn can_bear(&self, kind: AccelKind, prims: usize) -> bool {
        !kind.is_slow() || self.within_slow_tests(prims) >= Self::FEWEST
    }

    /// Structures to build, in the order of the rows.
    fn candidates(&self) -> Vec<Candidate> {
        let of = |&kind: &AccelKind| match &self.sweep {
            None => vec![Candidate { kind, params: self.params, setting: None }],
            Some(sweep) => {
                let settings = sweep.settings(kind, &self.params).into_iter();
                settings.map(|(setting, params)| Candidate { kind, params, setting: Some(setting) }).collect()
            }
        };
        self.kinds.iter().flat_map(of).collect()
    }

    fn within_slow_tests(&self, prims: usize) -> usize {
        usize::try_from(self.slow_tests / (prims as u64).max(1)).unwrap_or(usize::MAX)
    }
}

/// A structure to build.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    kind: AccelKind,
    params: AccelParams,
    setting: Option<Setting>,
}

/// Rays of one class for one structure, and the expected answers.
pub(super) struct Task {
    pub(super) set: RaySet,
    expected: Vec<Vec<Answer>>,
}

/// Minimum duration of a timed pass, in seconds.
const SHORTEST: f64 = 4e-3;

/// Callback of a comparison: receives the rows so far and the current step, returns whether to go on.
pub type GoOn<'a> = dyn FnMut(&[Row], &str) -> bool + 'a;

/// Compares structures; `filters` are those of the picture. `go_on` is called at every step with the rows so far; returns `None`
/// when it stops the comparison, or when no threads can be started.
///
/// The reference is the first structure that is not slow, or else the first of all; the others must agree with it. If the world
/// keeps instances, every structure must support them ([`AccelKind::keeps_instances`]).
pub fn compare(
    world: &World,
    filters: Option<&Filters>,
    sets: &[RaySet],
    pixels: usize,
    plan: &Plan,
    go_on: &mut GoOn,
) -> Option<Vec<Row>> {
    let pool = threads::pool(plan.threads).ok()?;
    let build = |c: &Candidate| pool.install(|| timed(|| world.structure(AccelChoice::Kind(c.kind), &c.params).0));
    let candidates = plan.candidates();
    let (whole, sampled) = tasks(world.len(), filters, sets, plan, &candidates, |candidate| build(candidate).0);

    // Build and count each structure once, so that a row exists as soon as possible; then time all in turn.
    let mut rows: Vec<Row> = Vec::new();
    let mut structures = Vec::new();
    for candidate in &candidates {
        let &Candidate { kind, setting, .. } = candidate;
        let value = setting.map_or(String::new(), |setting| format!(", {setting}"));
        if !go_on(&rows, &format!("{kind}{value}: building and counting")) {
            return None;
        }
        let (accel, seconds) = build(candidate);
        let tasks = if kind.is_slow() { &sampled } else { &whole };
        let mut row = Row {
            kind,
            setting,
            build: Spread::default(),
            made_of: accel.summary(),
            classes: Vec::new(),
            sampled: tasks.iter().zip(sets).any(|(t, s)| t.set.len() < s.len()),
            tests_by_pixel: Vec::new(),
        };
        let pixels = if row.sampled || tasks.iter().any(|t| t.set.asked > t.set.len() as u64) { 0 } else { pixels };
        row.tests_by_pixel = vec![0; pixels];
        row.classes = tasks.iter().map(|task| count(&accel, filters, task, &mut row.tests_by_pixel)).collect();
        if plan.passes > 0 {
            row.build.push(seconds);
            time(&accel, filters, tasks, plan.threads, &mut row.classes);
        }
        rows.push(row);
        structures.push(accel);
    }
    for pass in 1..plan.passes {
        for ((row, accel), candidate) in rows.iter_mut().zip(&structures).zip(&candidates) {
            row.build.push(build(candidate).1);
            let tasks = if row.kind.is_slow() { &sampled } else { &whole };
            time(accel, filters, tasks, plan.threads, &mut row.classes);
        }
        if !go_on(&rows, &format!("pass {} of {}", pass + 1, plan.passes)) {
            return None;
        }
    }
    Some(rows)
}

/// Tasks of structures that get all rays, and of slow ones.
fn tasks<'s>(
    prims: usize,
    filters: Option<&Filters>,
    sets: &[RaySet],
    plan: &Plan,
    candidates: &[Candidate],
    build: impl Fn(&Candidate) -> AnyAccel<'s>,
) -> (Vec<Task>, Vec<Task>) {
    let slow = |set: &RaySet| set.sample(plan.affordable(prims), plan.seed).0;
    let Some(first) = candidates.iter().find(|c| !c.kind.is_slow()).or(candidates.first()) else {
        return Default::default();
    };
    let reference = build(first);
    let task = |set: RaySet| Task::new(&reference, filters, set);
    let sampled = sets.iter().map(|set| task(slow(set))).collect();
    let whole = if first.kind.is_slow() { Vec::new() } else { sets.iter().map(|set| task(set.clone())).collect() };
    (whole, sampled)
}

impl Task {
    pub(super) fn new<A: Accel>(reference: &A, filters: Option<&Filters>, set: RaySet) -> Self {
        let expected = set.batches.iter().map(|b| answers(reference, filters, b)).collect();
        Self { set, expected }
    }
}

/// Counts one task, and checks the answers of both the counted and the plain walk against the expected ones.
pub(super) fn count<A: Accel>(
    accel: &A,
    filters: Option<&Filters>,
    task: &Task,
    tests_by_pixel: &mut [u32],
) -> ClassRow {
    let mut row = ClassRow::of(task.set.asked);
    let mut total = 0.0;
    let in_picture = task.set.class != Class::Diffuse;
    for (batch, expected) in task.set.batches.iter().zip(&task.expected) {
        let answered = counted(accel, filters, batch, |ray, counts| {
            row.add(counts);
            if let Some(tests) = tests_by_pixel.get_mut(ray.sample as usize).filter(|_| in_picture) {
                *tests = tests.saturating_add(u32::try_from(counts.n_it).unwrap_or(u32::MAX));
            }
        });
        let (plain, seconds) = timed(|| answers(accel, filters, batch));
        row.differing += differing(&answered, &plain, expected);
        total += seconds;
    }
    row.repeats = repeats(total);
    row
}

/// Number of repetitions of a pass that takes `seconds`, so that the resolution of the clock does not matter.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
fn repeats(seconds: f64) -> u32 {
    (SHORTEST / seconds.max(1e-6)).ceil().clamp(1.0, 1000.0) as u32
}

fn differing(counted: &[Answer], plain: &[Answer], expected: &[Answer]) -> u64 {
    let triples = counted.iter().zip(plain).zip(expected);
    triples.filter(|((counted, plain), expected)| counted != expected || plain != expected).count() as u64
}

/// Runs one timed pass over all classes.
fn time<A: Accel>(accel: &A, filters: Option<&Filters>, tasks: &[Task], threads: usize, rows: &mut [ClassRow]) {
    for (task, row) in tasks.iter().zip(rows) {
        let pass = |batch: &Batch| seconds(accel, filters, batch, row.repeats, threads);
        let sum: f64 = task.set.batches.iter().map(pass).sum();
        row.seconds.push(sum / f64::from(row.repeats) / task.set.len().max(1) as f64);
    }
}

/// Number of rays after which building a structure has paid off: build time over the time saved per ray against testing every
/// prim. `None` if no time is saved.
pub fn break_even(build: f64, per_ray: f64, none_per_ray: f64) -> Option<f64> {
    let saved = none_per_ray - per_ray;
    (saved > 0.0 && build.is_finite()).then(|| build / saved)
}
