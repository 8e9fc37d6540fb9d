//! Renders a picture to a target error, and hardly better.
//!
//! The error of a picture sampled to a given error per pixel depends on the scene. So a part of it is sampled to several such
//! errors, each twice with different random numbers, until the error of the picture is as wanted ([`plan`]). Then the whole
//! picture is rendered twice; the difference of both gives the error of their mean, whatever the quality of the forecast, and as
//! that error is planned to be too large, a third rendering, seldom a fourth, reaches the target. Detail that hardly any ray of
//! either hits is missing in both, and goes unnoticed here.

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

/// Factor over the target at which the first two renderings are planned. A forecast from a part of the picture may be a third
/// off, where few pixels have most of the error; too much precision cannot be undone, and too little is made up for by further
/// renderings, once the error is known.
const OVER: f64 = 1.3;

/// Maximum number of renderings after the first two; usually the first or second of them is close enough.
const MENDS: u64 = 4;

/// Factor over the target within which an error counts as reached.
const CLOSE: f64 = 1.02;

/// Plan to reach a target.
pub(in crate::render) struct Plan<P> {
    how: Stochastic,
    /// Minimum number of samples of a pixel as requested.
    asked: u32,
    /// Forecast error of the whole picture after one rendering.
    rmse: f64,
    /// Exponent with which that grows with the error of a pixel.
    slope: f64,
    /// Cost of all renderings together, in units of one; the square of the error falls by this factor.
    pub work: f64,
    /// Number of eye rays spent on planning.
    pub rays: u64,
    /// Processor time spent on planning, seconds.
    pub spent: f64,
    /// Forecast processor time of one rendering, seconds.
    cpu: f64,
    counts: Vec<ByClass<P>>,
}

impl<P: Observer> Plan<P> {
    /// An empty plan.
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

    /// Adds the cost of two renderings of parts of a picture; returns the mean number of samples of a pixel in one.
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

    /// Updates the exponent from two errors of a pixel, and the errors of the whole picture that they gave.
    fn learn(&mut self, (error, rmse): (f64, f64), (next_error, next_rmse): (f64, f64)) {
        if next_error != error && rmse > 0.0 && next_rmse > 0.0 {
            // Noise of the estimate must not reverse the search.
            self.slope = (libm::log(next_rmse / rmse) / libm::log(next_error / error)).clamp(0.3, 1.5);
        }
    }

    /// Error of another rendering that, mixed with one of error `have`, gives error `target`; both weighted by their inverse
    /// squares.
    fn missing(&self, have: f64, target: f64) -> f64 {
        /// Limit beyond which a rendering is useless, relative to `have`.
        const WORST: f64 = 3.0;
        let square = 1.0 / (1.0 / (target * target) - 1.0 / (have * have));
        if square > 0.0 { square.sqrt().min(WORST * have) } else { WORST * have }
    }

    /// Sets the error of a pixel so that a rendering's error changes from `last` to `next`.
    fn aim(&mut self, last: f64, next: f64) {
        /// From this ratio of errors on, the minimum number of samples is halved, but not below half of what was requested: all
        /// renderings together give pixels more.
        const COARSER: f64 = 1.2;
        if next > COARSER * last {
            self.how.min_samples = (self.how.min_samples / 2).max(self.asked / 2).max(1);
        }
        let gain = libm::pow(next / last, 1.0 / self.slope);
        self.how.error = single((f64::from(self.how.error) * gain).clamp(*RANGE.start(), *RANGE.end()));
    }

    /// Settings of one of its renderings.
    pub(in crate::render) fn settings(&self, settings: &Settings, number: u64) -> Settings {
        Settings { sampling: Sampling::Stochastic(self.how), seed: seed(settings.seed, number), ..settings.clone() }
    }
}

/// Seed of the `number`th rendering of a picture; the first has the picture's own.
pub(in crate::render) fn seed(seed: u64, number: u64) -> u64 {
    seed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// Finds the error of a pixel that gives the picture its target error. `None` when cancelled.
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
        // A single square holds all pixels of a small picture, or its error is unknown.
        (plan.rmse, most) = (of_all.value, if of_all.high.is_finite() { of_all.high } else { of_all.value });
        let fewest = how.min_samples.max(fewest(plan.take(parts, job.settings))).min(how.max_samples.max(1));
        if let Some(before) = before.replace((error, plan.rmse)) {
            plan.learn(before, (error, plan.rmse));
        }
        let off = plan.rmse / wanted;
        let is_at_end = off < 1.0 && error >= *RANGE.end() || off > 1.0 && error <= *RANGE.start();
        // The last try is rendered as it is.
        if (0.94..1.06).contains(&off) && fewest == plan.how.min_samples || is_at_end || left == 0 {
            break;
        }
        plan.how.min_samples = fewest;
        error *= libm::pow(1.0 / off.clamp(0.05, 20.0), 1.0 / plan.slope);
    }
    // Where the minimum samples certainly suffice already, a second rendering is useless; where they nearly do, two suffice.
    plan.work = if most <= target {
        1.0
    } else if plan.rmse <= CLOSE * std::f64::consts::SQRT_2 * target {
        2.0
    } else {
        2.0 * OVER * OVER
    };
    Some(plan)
}

/// Range of useful errors of a pixel.
const RANGE: std::ops::RangeInclusive<f64> = 1e-5..=0.5;

/// Number of samples to start pixels with, a power of two, for this mean number of samples: pixels whose first samples miss a
/// detail stop, and where many samples are wanted that is an error which more renderings do not reduce.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "far less than 2^32 samples, and not negative"
)]
fn fewest(samples: f64) -> u32 {
    /// Fraction of the mean number of samples that all pixels get.
    const SURE: f64 = 0.25;
    const MOST: u32 = 64;
    1 << ((SURE * samples) as u32).clamp(1, MOST).ilog2()
}

/// Renders until the error of the picture reaches the target; the picture is the mean of several renderings.
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
        // Half of the difference is the error of each from their mean.
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

/// Mixes another rendering in, with weight `part`.
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

/// Weight of each pixel of another rendering, whose overall weight is `part`: larger where it has a larger share of its samples
/// than this one has of its own.
///
/// A pixel whose first samples missed a detail has stopped; where the other rendering hit it, it went on until it was certain. Of
/// two such means the latter is nearly right. And where a rendering was cut short, it has no samples.
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
