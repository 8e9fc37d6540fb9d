//! A picture as exact as it was asked to be, and hardly more.
//!
//! What error a picture has after sampling to a given error of a pixel depends on the scene. So a part of it is sampled
//! to several, each twice with different random numbers, until the error of the picture is as it should be ([`plan`]). Then
//! the whole picture is rendered twice; the difference of both tells the error of their mean, whatever was right or wrong
//! about the forecast, and as that is planned to be too large, a third rendering, seldom a fourth, makes it what was asked.
//! What hardly any ray of either meets is in neither, and nothing here knows of it.

use super::part::{Measure, Part, squared_errors, squares};
use crate::image::Picture;
use crate::render::by_class::ByClass;
use crate::render::context::Context;
use crate::render::forecast::Interval;
use crate::render::observer::Observer;
use crate::render::sampling::{Sampled, Sampling, Stochastic, Targeted};
use crate::render::tile::{RenderedTiles, add_channels, render_tiles};
use crate::render::{ClassCounts, Job, Progress, Rendered, Settings};
use crate::stopwatch::Stopwatch;

/// The first two renderings are planned to leave this part more than what is asked. A forecast from a part of the picture may
/// be a third off, where few pixels have most of the error; what is too exact already cannot be taken back, and what is not
/// exact enough is mended by further renderings, when the error is known.
const OVER: f64 = 1.3;

/// Renderings beyond the first two, at most; the first of them is near enough, or the second.
const MENDS: u64 = 4;

/// An error is what was asked when it is at most this part more.
const CLOSE: f64 = 1.02;

/// How a target is reached.
pub(in crate::render) struct Plan<P> {
    how: Stochastic,
    /// Fewest samples of a pixel as they were asked for.
    asked: u32,
    /// Error of the whole picture that one rendering of it leaves, as foretold.
    rmse: f64,
    /// By how much that grows with the error of a pixel: the exponent.
    slope: f64,
    /// How many times the work of one rendering all together take: that many times less is the square of their error.
    pub work: f64,
    /// Eye rays spent on finding this out.
    pub rays: u64,
    /// Seconds of processor time spent on that.
    pub spent: f64,
    /// Seconds of processor time of one rendering, as foretold.
    cpu: f64,
    counts: Vec<ByClass<P>>,
}

impl<P: Observer> Plan<P> {
    /// Nothing is known yet.
    fn new(how: &Stochastic) -> Self {
        Self {
            how: Stochastic { target: None, ..*how },
            asked: how.min_samples,
            rmse: 0.0,
            slope: 1.0,
            work: 1.0,
            rays: 0,
            spent: 0.0,
            cpu: 0.0,
            counts: Vec::new(),
        }
    }

    /// Takes in what two renderings of parts of a picture cost; the samples that a pixel of one has on average.
    fn take(&mut self, parts: Vec<Part<P>>, settings: &Settings) -> f64 {
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        self.cpu = parts.iter().map(|part| part.seconds_per_pixel() * pixels * 0.5).sum();
        let samples = parts.iter().map(|part| part.samples_per_pixel() * 0.5).sum();
        for part in parts {
            self.rays += part.rays();
            self.spent += part.seconds();
            self.counts.extend(part.counts);
        }
        samples
    }

    /// Learns from two errors of a pixel, and those of the whole picture that they left, how these hang together.
    fn learn(&mut self, (error, rmse): (f64, f64), (next_error, next_rmse): (f64, f64)) {
        if next_error != error && rmse > 0.0 && next_rmse > 0.0 {
            // Noise of the estimate must not turn the search round.
            self.slope = (libm::log(next_rmse / rmse) / libm::log(next_error / error)).clamp(0.3, 1.5);
        }
    }

    /// Error of another rendering that, mixed with one of error `have`, makes one of error `target`; both weighed by the
    /// inverse of their squares.
    fn missing(&self, have: f64, target: f64) -> f64 {
        /// What is worth rendering: more than so many times as bad adds nothing.
        const WORST: f64 = 3.0;
        let square = 1.0 / (1.0 / (target * target) - 1.0 / (have * have));
        if square > 0.0 { square.sqrt().min(WORST * have) } else { WORST * have }
    }

    /// Aims at another error of a rendering than the last one's.
    fn aim(&mut self, last: f64, next: f64) {
        /// From so many times the error on fewer samples are enough for the pixels that get fewest, but not fewer than half of
        /// what was asked for: all renderings together give them more.
        const COARSER: f64 = 1.2;
        if next > COARSER * last {
            self.how.min_samples = (self.how.min_samples / 2).max(self.asked / 2).max(1);
        }
        let gain = libm::pow(next / last, 1.0 / self.slope);
        self.how.error = single((f64::from(self.how.error) * gain).clamp(*RANGE.start(), *RANGE.end()));
    }

    /// The settings of one of its renderings.
    pub(in crate::render) fn settings(&self, settings: &Settings, number: u64) -> Settings {
        Settings { sampling: Sampling::Stochastic(self.how), seed: seed(settings.seed, number), ..settings.clone() }
    }
}

/// The seed of the `number`th rendering of a picture; the first has the picture's own.
pub(in crate::render) fn seed(seed: u64, number: u64) -> u64 {
    seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// Finds the error of a pixel that leaves the error of the picture that is asked for. `None` when cancelled.
pub(in crate::render) fn plan<P: Observer>(
    job: &Job,
    context: &Context,
    how: &Stochastic,
    progress: &dyn Progress,
) -> Option<Plan<P>> {
    const TRIES: usize = 6;
    let target = f64::from(how.target.unwrap_or(how.error));
    let wanted = OVER * std::f64::consts::SQRT_2 * target;
    let (squares, measure) = (squares(job.settings.width, job.settings.height), Measure::of(job));
    let mut plan = Plan::new(how);
    let (mut error, mut before, mut most) = (3.0 * wanted, None, f64::INFINITY);
    for left in (0..TRIES).rev() {
        error = error.clamp(*RANGE.start(), *RANGE.end());
        plan.how.error = single(error);
        let mut parts = Vec::new();
        for number in 0..2 {
            parts.push(Part::<P>::render(job, context, &plan.settings(job.settings, number), &squares, progress)?);
        }
        let squared = squared_errors(&measure, &parts[0], &parts[1]);
        let of_all = Interval::of_ratio(&squared, 1.0).map(f64::sqrt);
        // A single square has all pixels of a small picture, or nothing tells how far off it is.
        (plan.rmse, most) = (of_all.value, if of_all.high.is_finite() { of_all.high } else { of_all.value });
        let fewest = how.min_samples.max(fewest(plan.take(parts, job.settings))).min(how.max_samples.max(1));
        if let Some(before) = before.replace((error, plan.rmse)) {
            plan.learn(before, (error, plan.rmse));
        }
        let off = plan.rmse / wanted;
        let is_at_end = off < 1.0 && error >= *RANGE.end() || off > 1.0 && error <= *RANGE.start();
        // The last try is what is rendered.
        if (0.94..1.06).contains(&off) && fewest == plan.how.min_samples || is_at_end || left == 0 {
            break;
        }
        plan.how.min_samples = fewest;
        error *= libm::pow(1.0 / off.clamp(0.05, 20.0), 1.0 / plan.slope);
    }
    // Where the fewest samples surely do already, there is no use in doing it twice; where they nearly do, twice is enough.
    plan.work = if most <= target {
        1.0
    } else if plan.rmse <= CLOSE * std::f64::consts::SQRT_2 * target {
        2.0
    } else {
        2.0 * OVER * OVER
    };
    Some(plan)
}

/// Errors of a pixel that make sense.
const RANGE: std::ops::RangeInclusive<f64> = 1e-5..=0.5;

/// What pixels should start with, a power of two, when they get so many samples on average: those that see nothing in their
/// first ones stop, and where many samples are wanted that is an error which more renderings do not lessen.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "far less than 2^32 samples, and not negative"
)]
fn fewest(samples: f64) -> u32 {
    /// Part of the samples that all pixels get.
    const SURE: f64 = 0.25;
    const MOST: u32 = 64;
    1 << ((SURE * samples) as u32).clamp(1, MOST).ilog2()
}

/// Renders until the error of the picture is what was asked; the picture is the mean of several renderings.
pub(in crate::render) fn render<P: Observer>(
    job: &Job,
    context: &Context,
    how: &Stochastic,
    progress: &dyn Progress,
) -> Option<(Rendered, Vec<ByClass<P>>)> {
    let target = f64::from(how.target.unwrap_or(how.error));
    let mut plan = plan::<P>(job, context, how, &super::part::Quiet(progress))?;
    let mut counts = std::mem::take(&mut plan.counts);
    let watch = Stopwatch::of_all_threads();
    let foretold = plan.rmse / plan.work.sqrt();
    let mut one = |settings: &Settings| {
        let context = context.resampled(settings);
        progress.begins();
        let RenderedTiles { picture, sampled, counts: more, complete } =
            render_tiles::<_, P>(&context, job.accel, job.view, settings, progress);
        counts.extend(more);
        Rendered { picture, counts: ClassCounts::default(), sampled, depth: context.depth, complete }
    };
    let mut whole = one(&plan.settings(job.settings, 0));
    let mut estimated = None;
    if plan.work > 1.0 && whole.complete {
        let measure = Measure::of(job);
        let other = one(&plan.settings(job.settings, 1));
        whole.complete = other.complete;
        let both = measure.mean_square((&whole.picture).into(), (&other.picture).into());
        // Half of the difference is what each is off their mean.
        let mut estimate = 0.5 * both.sqrt();
        mix(&mut whole, &other, 0.5);
        let mut last = (0.5 * both).sqrt();
        for number in 2..2 + MENDS {
            if !whole.complete || estimate <= CLOSE * target {
                break;
            }
            plan.aim(last, plan.missing(estimate, target));
            let other = one(&plan.settings(job.settings, number));
            whole.complete = other.complete;
            let both = measure.mean_square((&whole.picture).into(), (&other.picture).into());
            let own = (both - estimate * estimate).max(0.0);
            let part = estimate * estimate / (estimate * estimate + own);
            estimate = (estimate * estimate * (1.0 - part).powi(2) + own * part.powi(2)).sqrt();
            mix(&mut whole, &other, single(part));
            last = own.sqrt().max(f64::MIN_POSITIVE);
        }
        estimated = Some(estimate);
    }
    whole.sampled.rays += plan.rays;
    whole.sampled.targeted = Some(Targeted {
        target: single(target),
        foretold,
        estimate: estimated,
        foretold_cpu: plan.cpu * plan.work,
        cpu: watch.read().cpu.as_secs_f64(),
    });
    if let Some(layers) = &mut whole.picture.layers {
        layers.channels.retain(|channel| !channel.name.starts_with("sampling."));
        add_channels(&whole.sampled, layers);
    }
    Some((whole, counts))
}

/// Mixes another rendering in, of which `part` is taken.
fn mix(whole: &mut Rendered, other: &Rendered, part: f32) {
    let (sampled, more): (&mut Sampled, &Sampled) = (&mut whole.sampled, &other.sampled);
    let parts = parts(&sampled.counts, &more.counts, part);
    mix_pictures(&mut whole.picture, &other.picture, &parts);
    sampled.rays += more.rays;
    sampled.met = sampled.met.max(more.met);
    sampled.at_most = sampled.at_most.min(more.at_most);
    sampled.spare += more.spare;
    sampled.counts.iter_mut().zip(&more.counts).for_each(|(count, more)| *count += more);
    for ((error, more), part) in sampled.errors.iter_mut().zip(&more.errors).zip(&parts) {
        let (a, b) = (*error * (1.0 - part), more * part);
        *error = (a * a + b * b).sqrt();
    }
}

/// What is taken of each pixel of another rendering, of which `part` is taken in all: more where it has more of its samples
/// than this one has of its own.
///
/// A pixel that saw nothing in its first samples has stopped; where the other rendering saw something it went on until it
/// knew how much. Of two such means that one is nearly right. And where a rendering was cut short it has no samples.
#[expect(clippy::cast_precision_loss, reason = "counts of rays")]
fn parts(own: &[u32], other: &[u32], part: f32) -> Vec<f32> {
    let all = |counts: &[u32]| counts.iter().map(|&n| u64::from(n)).sum::<u64>().max(1) as f32;
    let (a, b) = ((1.0 - part) / all(own), part / all(other));
    let each = own.iter().zip(other).map(|(&own, &other)| {
        let (a, b) = (a * own as f32, b * other as f32);
        if a + b > 0.0 { b / (a + b) } else { part }
    });
    each.collect()
}

fn mix_pictures(whole: &mut Picture, other: &Picture, parts: &[f32]) {
    let mix = |own: &mut [[f32; 4]], other: &[[f32; 4]]| {
        for ((own, more), part) in own.iter_mut().zip(other).zip(parts) {
            (0..4).for_each(|c| own[c] = own[c] * (1.0 - part) + more[c] * part);
        }
    };
    mix(&mut whole.beauty, &other.beauty);
    mix(&mut whole.veil, &other.veil);
}

#[expect(clippy::cast_possible_truncation, reason = "an error needs no more digits")]
fn single(x: f64) -> f32 {
    x as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_renderings_that_one_counts_for_more_in_a_pixel_which_has_more_of_its_samples_there() {
        // Of 100 samples each; the last pixel of the second was not reached before it was cut short.
        let parts = parts(&[25, 4, 64, 7, 0], &[25, 64, 4, 0, 7], 0.5);
        assert_eq!(parts[0], 0.5);
        assert!((parts[1] - 64.0 / 68.0).abs() < 1e-6 && (parts[2] - 4.0 / 68.0).abs() < 1e-6, "{parts:?}");
        assert_eq!([parts[3], parts[4]], [0.0, 1.0]);
    }

    #[test]
    fn what_is_taken_in_all_is_what_was_asked_where_samples_are_spread_alike() {
        let parts = parts(&[10, 20, 30], &[1, 2, 3], 0.25);
        assert!(parts.iter().all(|part| (part - 0.25).abs() < 1e-6), "{parts:?}");
        assert_eq!(super::parts(&[0, 0], &[0, 0], 0.25), [0.25; 2]);
    }
}
