//! Times measured in several passes, and their spread.

use crate::stopwatch::{Spent, Stopwatch};
use std::time::Instant;

/// Values of one quantity from several passes; seconds unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spread(Vec<f64>);

impl Spread {
    /// Adds the value of a pass.
    pub fn push(&mut self, value: f64) {
        let place = self.0.partition_point(|&v| v < value);
        self.0.insert(place, value);
    }

    /// Number of passes.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there were no passes.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Median (with an even number of values, the mean of the middle two); NaN when nothing was measured.
    pub fn median(&self) -> f64 {
        match self.0.len() {
            0 => f64::NAN,
            n => 0.5 * (self.0[(n - 1) / 2] + self.0[n / 2]),
        }
    }

    /// Least value; NaN when nothing was measured.
    pub fn min(&self) -> f64 {
        self.0.first().copied().unwrap_or(f64::NAN)
    }

    /// Largest value; NaN when nothing was measured.
    pub fn max(&self) -> f64 {
        self.0.last().copied().unwrap_or(f64::NAN)
    }

    /// Applies `f` to each value.
    #[must_use]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        let mut mapped = Self::default();
        self.0.iter().for_each(|&v| mapped.push(f(v)));
        mapped
    }
}

/// Runs `work` and returns its result and the seconds it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

/// Runs `work` and returns its result and the seconds of this thread: CPU time where the system reports it (Unix), so that other
/// programs hardly matter; else wall-clock time.
pub fn processor_seconds<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let watch = Stopwatch::of_this_thread();
    let result = work();
    let Spent { wall, cpu } = watch.read();
    (result, if cpu.is_zero() { wall } else { cpu }.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_of_the_processor_leaves_out_what_a_thread_sleeps() {
        let (result, spent) = processor_seconds(|| (0..100_000u64).fold(0, |a, b| std::hint::black_box(a ^ b)));
        assert!(result == (0..100_000u64).fold(0, |a, b| a ^ b) && spent > 0.0);
        if cfg!(unix) {
            let ((), asleep) = processor_seconds(|| std::thread::sleep(std::time::Duration::from_millis(50)));
            assert!(asleep < 0.05, "{asleep}");
        }
    }

    #[test]
    fn the_middle_of_the_passes_is_their_median() {
        let mut spread = Spread::default();
        assert!(spread.median().is_nan());
        [5.0, 1.0, 9.0].into_iter().for_each(|v| spread.push(v));
        assert_eq!([spread.min(), spread.median(), spread.max()], [1.0, 5.0, 9.0]);
        spread.push(6.0);
        assert_eq!(spread.median(), 5.5);
        assert_eq!([spread.map(|v| -v).min(), spread.map(|v| -v).median()], [-9.0, -5.5]);
    }
}
