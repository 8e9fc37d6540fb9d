//! Forecast of a picture's cost and error from a part of it.

pub(super) mod part;
pub(super) mod target;

use super::context::Context;
use super::fireflies::{self, Closely};
use super::sampling::Sampling;
use super::{Job, Progress, Settings};
use crate::accel::{NoProbe, RayCounts};
use crate::stopwatch::Stopwatch;
use part::{Measure, Part, Quiet, squared_errors, squares};

/// An estimate with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Ratio of the sum of such values to that of their weights, times `scale`; with a single value the error is unknown. (W. G.
    /// Cochran, *Sampling Techniques*, 1977, §6.4: the error of a ratio.)
    pub(super) fn of_ratio(weighted: &[(f64, f64)], scale: f64) -> Self {
        /// Half-width in standard errors.
        const REACH: f64 = 1.96;
        let n = weighted.len() as f64;
        let (values, weights) = weighted.iter().fold((0.0, 0.0), |(vs, ws), (v, w)| (vs + v, ws + w));
        let ratio = if weights > 0.0 { values / weights } else { 0.0 };
        let variance = weighted.iter().map(|(v, w)| (v - ratio * w) * (v - ratio * w)).sum::<f64>() / (n - 1.0);
        let half = if weighted.len() < 2 { f64::INFINITY } else { REACH * (variance / n).sqrt() / (weights / n) };
        Self { value: ratio * scale, low: (ratio - half).max(0.0) * scale, high: (ratio + half) * scale }
    }

    /// Applies an increasing function `f` to all three numbers.
    pub(super) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self { value: f(self.value), low: f(self.low), high: f(self.high) }
    }

    /// Whether a value lies in the interval.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Forecast cost of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Number of pixels rendered for the forecast.
    pub looked_at: u64,
    /// Number of pixels of the picture.
    pub pixels: u64,
    /// Processor time for its rays and their shading, seconds.
    pub cpu: Interval,
    /// Number of eye rays.
    pub rays: Interval,
    /// Number of ray/prim tests of all rays.
    pub tests: Interval,
    /// Root mean square error in the units in which sampling measures errors; `None` where every rendering is the same, so that
    /// differences say nothing.
    pub rmse: Option<Interval>,
}

/// Forecasts the rendering of a job from about a hundredth of its pixels, at least some thousands: rendered twice, with different
/// random numbers. `None` when cancelled.
pub fn forecast(job: &Job, progress: &dyn Progress) -> Option<Forecast> {
    let mut context = Context::new(job.scene, job.world, job.textures, job.settings);
    let watch = Stopwatch::of_all_threads();
    let (looked, _) = fireflies::look::<NoProbe>(job, &mut context, Closely::Hint, &Quiet(progress));
    let spent = watch.read().cpu.as_secs_f64();
    // For a target error the settings are planned first; the rendering will plan them again.
    let (settings, work, before) = match job.settings.sampling {
        Sampling::Stochastic(how) if how.target.is_some() => {
            let plan = target::plan::<NoProbe>(job, &context, &how, &Quiet(progress))?;
            (plan.settings(job.settings, 0), plan.work, (plan.rays as f64, plan.spent))
        }
        _ => (job.settings.clone(), 1.0, (0.0, 0.0)),
    };
    let times = Closely::Hint.part() as f64;
    // The share of this work inside the picture is part of the squares' cost.
    let beside = looked.beside as f64 / looked.all.max(1) as f64;
    let before = (before.0 + looked.beside as f64 * times, before.1 + spent * beside * times);
    let squares = squares(settings.width, settings.height);
    let timed = Part::<NoProbe>::render(job, &context, &settings, &squares, progress)?;
    let other = Settings { seed: target::seed(settings.seed, 1), ..settings.clone() };
    let counted = Part::<RayCounts>::render(job, &context, &other, &squares, progress)?;
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let looked_at: u64 = timed.squares.iter().map(|square| square.beauty.len() as u64).sum();
    // A smaller square at the edge is weighted by its pixels.
    let per_pixel = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        timed.squares.iter().enumerate().map(|(i, square)| (value(i), square.beauty.len() as f64)).collect()
    };
    let whole = pixels as f64 * work;
    let rays = Interval::of_ratio(&per_pixel(&|i| timed.rays_in_tiles(i)), whole).map(|rays| rays + before.0);
    let tests = Interval::of_ratio(&per_pixel(&|i| counted.tests_in_tiles(i)), whole);
    let squared = squared_errors(&Measure::of(job), &timed, &counted);
    let is_random = matches!(settings.sampling, Sampling::Stochastic(_));
    Some(Forecast {
        looked_at,
        pixels,
        cpu: Interval::of_ratio(&per_pixel(&|i| timed.seconds_in_tiles(i)), whole).map(|cpu| cpu + before.1),
        rays,
        tests: tests.map(|tests| tests + before.0 * counted.tests_per_ray()),
        rmse: is_random.then(|| Interval::of_ratio(&squared, 1.0 / work).map(f64::sqrt)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_as_wide_as_the_values_lie_apart() {
        let each = |values: &[f64]| values.iter().map(|&v| (v, 1.0)).collect::<Vec<_>>();
        let even = Interval::of_ratio(&each(&[2.0; 10]), 3.0);
        assert_eq!((even.value, even.low, even.high), (6.0, 6.0, 6.0));
        let wide = Interval::of_ratio(&each(&[1.0, 3.0]), 1.0);
        assert!((wide.high - wide.value - 1.96).abs() < 1e-12 && wide.low > 0.0 && wide.contains(2.5));
        assert_eq!(Interval::of_ratio(&each(&[0.0, 8.0]), 1.0).low, 0.0);
        let one = Interval::of_ratio(&each(&[4.0]), 2.0);
        assert_eq!((one.value, one.low, one.high), (8.0, 0.0, f64::INFINITY), "of one value");
        let of_parts = Interval::of_ratio(&[(8.0, 4.0), (2.0, 1.0), (4.0, 2.0)], 1.0);
        assert_eq!((of_parts.value, of_parts.low, of_parts.high), (2.0, 2.0, 2.0), "as much of each for its size");
    }
}
