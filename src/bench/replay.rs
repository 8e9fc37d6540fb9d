//! Replays recorded rays through a structure: for answers, for counts, or for time.

use super::clock::timed;
use super::rays::Batch;
use crate::accel::{Accel, Hit, NoProbe, OccludedFilter, Probe, Ray, RayCounts};
use crate::render::{FilterScratch, Filters, Question};
use crate::threads;
use std::thread;

/// Rays per query slice, as in the renderer.
const SLICE: usize = 256;

/// Answer as bits: t, u, v and prim of a hit, or whether the ray is occluded.
pub type Answer = [u32; 4];

/// Answers all rays of a batch.
pub fn answers<A: Accel>(accel: &A, filters: Option<&Filters>, batch: &Batch) -> Vec<Answer> {
    let mut answers = Vec::with_capacity(batch.rays.len());
    let mut replayer = Replayer::new(accel, filters);
    Slice::cut(batch.question, &batch.rays, &batch.after)
        .for_each(|slice| replayer.ask(&slice, &mut NoProbe, |answer| answers.push(answer)));
    answers
}

/// Answers the rays of a batch one by one and passes the counts of each to `each`.
pub fn counted<A: Accel>(
    accel: &A,
    filters: Option<&Filters>,
    batch: &Batch,
    mut each: impl FnMut(&Ray, &RayCounts),
) -> Vec<Answer> {
    let mut answers = Vec::with_capacity(batch.rays.len());
    let mut replayer = Replayer::new(accel, filters);
    for i in 0..batch.rays.len() {
        let mut counts = RayCounts::default();
        let alone = Slice {
            question: batch.question,
            rays: &batch.rays[i..=i],
            after: batch.after.get(i..=i).unwrap_or_default(),
        };
        replayer.ask(&alone, &mut counts, |answer| answers.push(answer));
        each(&batch.rays[i], &counts);
    }
    answers
}

/// Seconds to answer all rays of a batch `times` times, by `threads` threads with equal shares: from the first start to the last
/// end.
pub fn seconds<A: Accel>(accel: &A, filters: Option<&Filters>, batch: &Batch, times: u32, threads: usize) -> f64 {
    let share = batch.rays.len().div_ceil(threads.max(1)).max(1);
    let work = |slices: Vec<Slice>| {
        let mut replayer = Replayer::new(accel, filters);
        for _ in 0..times {
            slices.iter().for_each(|slice| replayer.ask_only(slice));
        }
    };
    let shares = |i: usize| {
        let part = i * share..((i + 1) * share).min(batch.rays.len());
        Slice::cut(batch.question, &batch.rays[part.clone()], batch.after.get(part).unwrap_or_default())
    };
    if threads <= 1 {
        let slices = shares(0).collect();
        return timed(|| work(slices)).1;
    }
    let shares: Vec<Vec<Slice>> =
        (0..threads).filter(|i| i * share < batch.rays.len()).map(|i| shares(i).collect()).collect();
    let together = || thread::scope(|scope| shares.into_iter().for_each(|s| drop(scope.spawn(|| work(s)))));
    threads::anywhere(|| timed(together)).1
}

/// Rays of one query.
struct Slice<'a> {
    question: Question,
    rays: &'a [Ray],
    after: &'a [Hit],
}

impl<'a> Slice<'a> {
    fn cut(question: Question, rays: &'a [Ray], after: &'a [Hit]) -> impl Iterator<Item = Self> {
        let after = move |i: usize| after.get(i * SLICE..).map_or(after, |rest| &rest[..rest.len().min(SLICE)]);
        rays.chunks(SLICE).enumerate().map(move |(i, rays)| Self { question, rays, after: after(i) })
    }
}

/// A structure with its scratch and answer buffers.
struct Replayer<'a, A: Accel> {
    accel: &'a A,
    filters: Option<&'a Filters<'a>>,
    filter_scratch: FilterScratch,
    scratch: A::Scratch,
    hits: [Hit; SLICE],
    occluded: [bool; SLICE],
}

impl<'a, A: Accel> Replayer<'a, A> {
    fn new(accel: &'a A, filters: Option<&'a Filters<'a>>) -> Self {
        let filter_scratch = FilterScratch::default();
        Self {
            accel,
            filters,
            filter_scratch,
            scratch: accel.scratch(),
            hits: [Hit::MISS; SLICE],
            occluded: [false; SLICE],
        }
    }

    /// Answers the slice but leaves the answers in the buffers, so that nothing else is timed.
    fn ask_only(&mut self, slice: &Slice) {
        self.fill(slice, &mut NoProbe);
        std::hint::black_box((&self.hits, &self.occluded));
    }

    fn ask<P: Probe>(&mut self, slice: &Slice, probe: &mut P, mut answer: impl FnMut(Answer)) {
        self.fill(slice, probe);
        let count = slice.rays.len();
        match slice.question {
            Question::Occluded => self.occluded[..count].iter().for_each(|&b| answer([u32::from(b), 0, 0, 0])),
            _ => self.hits[..count].iter().for_each(|hit| answer(hit.bits())),
        }
    }

    fn fill<P: Probe>(&mut self, slice: &Slice, probe: &mut P) {
        let count = slice.rays.len();
        let (hits, occluded) = (&mut self.hits[..count], &mut self.occluded[..count]);
        match slice.question {
            Question::Closest => self.accel.closest(slice.rays, hits, &mut self.scratch, probe),
            Question::Occluded => {
                let filter = self.filters.map(|filters| filters.for_rays(slice.rays, &mut self.filter_scratch));
                let filter = filter.as_ref().map(|filter| filter as &dyn OccludedFilter);
                self.accel.occluded_filtered(slice.rays, filter, occluded, &mut self.scratch, probe);
            }
            Question::Next => self.accel.next(slice.rays, slice.after, hits, &mut self.scratch, probe),
        }
    }
}
