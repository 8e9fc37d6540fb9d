//! Cost of one structure: counts and times, class by class.

use super::clock::Spread;
use super::sweep::Setting;
use crate::accel::{AccelKind, Count, RayCounts, StructureStats};

/// Results of one structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Structure.
    pub kind: AccelKind,
    /// Value of the swept parameter.
    pub setting: Option<Setting>,
    /// Build time in seconds.
    pub build: Spread,
    /// Composition of the structure.
    pub made_of: StructureStats,
    /// Results per class of rays.
    pub classes: Vec<ClassRow>,
    /// Whether the structure got only a sample of the rays.
    pub sampled: bool,
    /// Ray/prim tests of the picture's rays per pixel, row by row; empty where rays were left out.
    pub tests_by_pixel: Vec<u32>,
}

impl Row {
    /// Number of rays whose answer differed from the reference, in all passes.
    pub fn differing(&self) -> u64 {
        self.classes.iter().map(|c| c.differing).sum()
    }

    /// Number of rays that were compared.
    pub fn rays(&self) -> u64 {
        self.classes.iter().map(|c| c.counts.queries).sum()
    }

    /// Seconds per ray of a mixture of classes, taking `pick` of each class's passes; NaN before the first pass.
    pub fn seconds_per_ray(&self, mixture: &[u64], pick: fn(&Spread) -> f64) -> f64 {
        let all: u64 = mixture.iter().sum();
        let sum: f64 = self.classes.iter().zip(mixture).map(|(c, &n)| pick(&c.seconds) * n as f64).sum();
        sum / all as f64
    }

    /// Name of the structure, with its value of the swept parameter.
    pub fn name(&self) -> String {
        self.setting.map_or_else(|| self.kind.to_string(), |setting| format!("{} with {setting}", self.kind))
    }
}

/// Results of one structure for one class of rays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassRow {
    /// Rays of the class that the picture asked.
    pub asked: u64,
    /// Sums of counts over the rays sent.
    pub counts: RayCounts,
    /// Sums of squared counts, in the order of [`Count::ALL`].
    squares: [f64; Count::ALL.len()],
    /// Seconds per ray.
    pub seconds: Spread,
    /// Number of rays whose answer differed from the reference.
    pub differing: u64,
    /// Repetitions per timed pass, so that the resolution of the clock does not matter.
    pub(super) repeats: u32,
}

/// Half-width, in standard errors, of the 95 % interval of a mean whose error is estimated with `freedom` degrees of freedom (E.
/// A. Cornish, R. A. Fisher, *Moments and Cumulants in the Specification of Distributions*, 1937): accurate to two thousandths
/// for ten or more.
fn student(freedom: f64) -> f64 {
    const NORMAL: f64 = 1.959_963_985;
    let [z, z3, z5] = [1, 3, 5].map(|power| NORMAL.powi(power));
    z + (z3 + z) / (4.0 * freedom) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * freedom * freedom)
}

impl ClassRow {
    /// Empty results of a class of which the picture asked this many rays.
    pub(super) fn of(asked: u64) -> Self {
        Self { asked, ..Self::default() }
    }

    /// Mean of a count per ray; 0 without rays.
    pub fn per_ray(&self, count: Count) -> f64 {
        count.of(&self.counts) as f64 / self.counts.queries.max(1) as f64
    }

    /// Whether the rays are a sample of more.
    pub fn is_sampled(&self) -> bool {
        self.counts.queries < self.asked
    }

    /// Half-width of the 95 % interval of [`Self::per_ray`] over all rays, estimated from the sample; 0 if nothing was left out.
    /// Sampling without replacement shrinks the error by the share of rays taken.
    pub fn interval(&self, count: Count) -> f64 {
        if !self.is_sampled() {
            return 0.0;
        }
        let (n, mean) = (self.counts.queries as f64, self.per_ray(count));
        let variance = (self.squares[count as usize] / n - mean * mean).max(0.0) * n / (n - 1.0);
        let left_out = 1.0 - n / self.asked as f64;
        if n < 2.0 { f64::INFINITY } else { student(n - 1.0) * (variance / n * left_out).sqrt() }
    }

    /// Hits required per ray: the tests that no structure can save.
    pub fn n_min(&self) -> f64 {
        self.counts.found as f64 / self.counts.queries.max(1) as f64
    }

    /// Share of all tests, `prims` per ray, that was not done.
    pub fn culled(&self, prims: usize) -> f64 {
        if prims == 0 { 0.0 } else { 1.0 - self.per_ray(Count::It) / prims as f64 }
    }

    /// Millions of rays per second, by the median, the longest and the shortest of the times.
    pub fn rates(&self) -> [f64; 3] {
        [self.seconds.median(), self.seconds.max(), self.seconds.min()].map(|seconds| 1e-6 / seconds)
    }

    /// Adds the counts of one ray.
    pub(super) fn add(&mut self, counts: &RayCounts) {
        self.counts += *counts;
        for (square, count) in self.squares.iter_mut().zip(Count::ALL) {
            let value = count.of(counts) as f64;
            *square += value * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_of_few_rays_are_wider() {
        for (freedom, quantile) in [(10.0, 2.2281), (15.0, 2.1314), (30.0, 2.0423), (1e6, 1.96)] {
            assert!((student(freedom) / quantile - 1.0).abs() < 2e-3, "{freedom}");
        }
    }
}
