//! Cost of each pixel of a picture: counts and times by ray class.
//!
//! Counting and timing are passes of their own, so that the picture itself is rendered without either.

use super::by_class::ByClass;
use super::observer::{Observer, Question};
use super::profile::Clock;
use super::tile::{Together, cost_tiles};
use super::{CLASS_NAMES, Context, Job, Progress};
use crate::accel::{Hit, Probe, Ray};
use crate::image::{Channel, Values};
use crate::named::names;
use std::time::Duration;

/// What is measured at each pixel, as a sum over its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Cost {
    /// Ray/prim tests (n_it).
    Tests,
    /// Nodes and cells visited (n_ts).
    Steps,
    /// Tests that the mailbox saved (n_mb).
    Mailbox,
    /// Milliseconds. Unlike the counts they are noisy: they differ from run to run.
    Ms,
}

names!(Cost, "cost", Tests => "tests", Steps => "steps", Mailbox => "mailbox", Ms => "ms");

/// Channel of a pixel's time outside the structure, beside those of the ray classes.
const SHADING: &str = "shading";

/// Number of timed passes: the fastest counts, so that a disturbance of a pixel in one of them does not show.
const TIMED: usize = 3;

/// Costs of the pixels of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Costs {
    /// For each cost that was asked for, one channel per ray class, such as `tests.shadow`; `ms` has `ms.shading` too.
    channels: Vec<Channel>,
}

impl Costs {
    /// Channels of a cost; none when it was not asked for.
    pub fn channels(&self, cost: Cost) -> impl Iterator<Item = &Channel> {
        let of = move |c: &&Channel| c.name.split_once('.').is_some_and(|(what, _)| what == cost.name());
        self.channels.iter().filter(of)
    }

    /// Sum of a cost over all classes, for each pixel.
    pub fn total(&self, cost: Cost) -> Vec<f64> {
        let mut total = Vec::new();
        for channel in self.channels(cost) {
            total.resize(channel.values.len(), 0.0);
            total.iter_mut().zip(channel.values.iter()).for_each(|(sum, value)| *sum += value);
        }
        total
    }

    fn push<const N: usize, T: Copy>(
        &mut self,
        cost: Cost,
        parts: [&str; N],
        pixels: &[[T; N]],
        values: fn(Vec<T>) -> Values,
    ) {
        for (i, part) in parts.into_iter().enumerate() {
            let name = format!("{cost}.{part}");
            self.channels.push(Channel { name, values: values(pixels.iter().map(|p| p[i]).collect()) });
        }
    }
}

/// Traces the picture again, with [`super::Settings::samples`] samples in each pixel: once for all counts, three times for the
/// times. The counts are exact and do not depend on the number of threads. `None` when cancelled.
///
/// Times are wall-clock times, pixel after pixel on each thread, the least of three passes: the walk of a ray counts for its
/// class, everything else is `ms.shading`.
pub fn render_costs(job: &Job, wanted: &[Cost], progress: &dyn Progress) -> Option<Costs> {
    let mut costs = Costs::default();
    let (counting, timing) = (wanted.iter().any(|&c| c != Cost::Ms), wanted.contains(&Cost::Ms));
    let first = usize::from(counting);
    let passes = first + if timing { TIMED } else { 0 };
    if counting {
        let progress = Pass { all: progress, number: 0, passes };
        let counts: Vec<[PixelCounts; 4]> =
            pass(job, &progress, Together::Wave, |classes: &mut ByClass<SampleCounts>, samples| {
                let [a, b, c, d] = classes.each_mut().map(|class| class.by_pixel(samples));
                a.into_iter().zip(b).zip(c).zip(d).map(|(((a, b), c), d)| [a, b, c, d]).collect()
            })?;
        for (i, cost) in [Cost::Tests, Cost::Steps, Cost::Mailbox].into_iter().enumerate() {
            if wanted.contains(&cost) {
                let pixels: Vec<[u32; 4]> = counts.iter().map(|p| p.map(|class| class[i])).collect();
                costs.push(cost, CLASS_NAMES, &pixels, Values::U32);
            }
        }
    }
    if timing {
        let [a, b, c, d] = CLASS_NAMES;
        let times = times(job, |number| Pass { all: progress, number: first + number, passes })?;
        costs.push(Cost::Ms, [a, b, c, d, SHADING], &times, Values::F32);
    }
    Some(costs)
}

/// Progress of one of several passes over the picture, reported as a part of all of them.
struct Pass<'a> {
    all: &'a dyn Progress,
    /// Index of the pass, from 0.
    number: usize,
    passes: usize,
}

impl Progress for Pass<'_> {
    fn tiles(&self, done: usize, total: usize) {
        self.all.tiles(self.number * total + done, self.passes * total);
    }

    fn cancelled(&self) -> bool {
        self.all.cancelled()
    }
}

/// Times of each pixel by class, and of its shading, from the pass that took least time for the pixel.
fn times<'p>(job: &Job, progress: impl Fn(usize) -> Pass<'p>) -> Option<Vec<[f32; 5]>> {
    let timed = |number| {
        let pixel = |classes: &mut ByClass<Clock>, _: usize| vec![milliseconds(classes)];
        pass(job, &progress(number), Together::Pixel, pixel)
    };
    let mut least = timed(0)?;
    for number in 1..TIMED {
        let sum = |times: &[f32; 5]| times.iter().sum::<f32>();
        let shorter = |(least, times): (&mut [f32; 5], [f32; 5])| {
            if sum(&times) < sum(least) {
                *least = times;
            }
        };
        least.iter_mut().zip(timed(number)?).for_each(shorter);
    }
    Some(least)
}

fn pass<P: Observer, T: Copy + Default + Send>(
    job: &Job,
    progress: &dyn Progress,
    together: Together,
    cost: impl Fn(&mut ByClass<P>, usize) -> Vec<T> + Sync,
) -> Option<Vec<T>> {
    let settings = job.settings.fixed();
    let context = Context::new(job.scene, job.world, job.textures, &settings);
    cost_tiles(&context, job.accel, job.view, &settings, progress, together, cost)
}

/// Tests, steps, tests saved by the mailbox.
type PixelCounts = [u32; 3];

/// Counts of each sample's rays.
#[derive(Debug, Default)]
struct SampleCounts {
    counts: Vec<PixelCounts>,
    /// Sample whose ray is being traced.
    current: usize,
}

impl SampleCounts {
    fn add(&mut self, what: usize, count: u32) {
        if let Some(counts) = self.counts.get_mut(self.current) {
            counts[what] = counts[what].saturating_add(count);
        }
    }

    /// Sums the counts of each pixel, which has `samples` consecutive samples.
    fn by_pixel(&self, samples: usize) -> Vec<PixelCounts> {
        let sum = |a: PixelCounts, b: &PixelCounts| [0, 1, 2].map(|i| a[i].saturating_add(b[i]));
        self.counts.chunks(samples).map(|pixel| pixel.iter().fold([0; 3], sum)).collect()
    }
}

impl Probe for SampleCounts {
    fn prim_test(&mut self) {
        self.add(0, 1);
    }
    fn prim_tests(&mut self, count: u32) {
        self.add(0, count);
    }
    fn step(&mut self) {
        self.add(1, 1);
    }
    fn repeat_skipped(&mut self, _prim: u32) {
        self.add(2, 1);
    }
}

impl Observer for SampleCounts {
    const SLICE: usize = 1;

    fn asked(&mut self, _question: Question, rays: &[Ray], _after: &[Hit]) {
        self.current = rays.first().map_or(0, |ray| ray.sample as usize);
    }

    fn batch(&mut self, samples: usize) {
        self.counts.clear();
        self.counts.resize(samples, [0; 3]);
    }
}

/// Milliseconds of each class, and of everything else.
#[expect(clippy::cast_possible_truncation, reason = "no clock is as exact as f32")]
fn milliseconds(classes: &mut ByClass<Clock>) -> [f32; 5] {
    let all = classes.primary.began.map_or(Duration::ZERO, |began| began.elapsed());
    let [a, b, c, d] = classes.each_mut().map(|class| class.walking);
    [a, b, c, d, all.saturating_sub(a + b + c + d)].map(|time| (time.as_secs_f64() * 1e3) as f32)
}
