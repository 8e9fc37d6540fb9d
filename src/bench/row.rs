//! What one structure costs: its counts and times, class by class.

use super::clock::Spread;
use super::sweep::Setting;
use crate::accel::{AccelKind, Count, RayCounts, StructureStats};

/// What was found out about one structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which one.
    pub kind: AccelKind,
    /// Its value of the parameter that is swept.
    pub setting: Option<Setting>,
    /// Seconds of building it.
    pub build: Spread,
    /// What it is made of.
    pub made_of: StructureStats,
    /// One for each class of rays.
    pub classes: Vec<ClassRow>,
    /// Whether it got a sample of the rays only.
    pub sampled: bool,
    /// Ray/prim tests of the picture's rays in each pixel, row by row; empty where rays were left out.
    pub tests_by_pixel: Vec<u32>,
}

impl Row {
    /// Rays whose answer differed from the reference, in all passes.
    pub fn differing(&self) -> u64 {
        self.classes.iter().map(|c| c.differing).sum()
    }

    /// Rays that were compared.
    pub fn rays(&self) -> u64 {
        self.classes.iter().map(|c| c.counts.queries).sum()
    }

    /// Seconds for a ray of a mixture with so many of each class, of each class's passes `pick`; NaN before the first pass.
    pub fn seconds_per_ray(&self, mixture: &[u64], pick: fn(&Spread) -> f64) -> f64 {
        let all: u64 = mixture.iter().sum();
        let sum: f64 = self.classes.iter().zip(mixture).map(|(c, &n)| pick(&c.seconds) * n as f64).sum();
        sum / all as f64
    }

    /// Its structure, and its value of the parameter that is swept.
    pub fn name(&self) -> String {
        self.setting.map_or_else(|| self.kind.to_string(), |setting| format!("{} with {setting}", self.kind))
    }
}

/// One structure and one class of rays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassRow {
    /// Rays of the class that the picture asks.
    pub asked: u64,
    /// Sums over the rays that were sent.
    pub counts: RayCounts,
    /// Sums of the squares, in the order of [`Count::ALL`].
    squares: [f64; Count::ALL.len()],
    /// Seconds for a ray.
    pub seconds: Spread,
    /// Rays whose answer differed from the reference.
    pub differing: u64,
    /// Passes over the rays for one time, so that the clock's grain does not matter.
    pub(super) repeats: u32,
}

/// Half the width, in standard errors, of the 95 % interval of a mean whose error is estimated with so many degrees of
/// freedom (E. A. Cornish, R. A. Fisher, *Moments and Cumulants in the Specification of Distributions*, 1937): from ten on
/// within two thousandths.
fn student(freedom: f64) -> f64 {
    const NORMAL: f64 = 1.959_963_985;
    let [z, z3, z5] = [1, 3, 5].map(|power| NORMAL.powi(power));
    z + (z3 + z) / (4.0 * freedom) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * freedom * freedom)
}

impl ClassRow {
    /// Nothing yet of so many rays that the picture asks.
    pub(super) fn of(asked: u64) -> Self {
        Self { asked, ..Self::default() }
    }

    /// A count for each ray; 0 without rays.
    pub fn per_ray(&self, count: Count) -> f64 {
        count.of(&self.counts) as f64 / self.counts.queries.max(1) as f64
    }

    /// Whether these rays are a sample of more.
    pub fn is_sampled(&self) -> bool {
        self.counts.queries < self.asked
    }

    /// Half the width of the 95 % interval of [`Self::per_ray`] of all rays, of which these may be a sample; 0 where they are
    /// all. Rays that are drawn only once err the less the more of all they are.
    pub fn interval(&self, count: Count) -> f64 {
        if !self.is_sampled() {
            return 0.0;
        }
        let (n, mean) = (self.counts.queries as f64, self.per_ray(count));
        let variance = (self.squares[count as usize] / n - mean * mean).max(0.0) * n / (n - 1.0);
        let left_out = 1.0 - n / self.asked as f64;
        if n < 2.0 { f64::INFINITY } else { student(n - 1.0) * (variance / n * left_out).sqrt() }
    }

    /// Hits required for each ray: the tests that no structure can save.
    pub fn n_min(&self) -> f64 {
        self.counts.found as f64 / self.counts.queries.max(1) as f64
    }

    /// Share of all tests that was not done, of `prims` for each ray.
    pub fn culled(&self, prims: usize) -> f64 {
        if prims == 0 { 0.0 } else { 1.0 - self.per_ray(Count::It) / prims as f64 }
    }

    /// Millions of rays a second: in the median of the times, in the longest and in the shortest.
    pub fn rates(&self) -> [f64; 3] {
        [self.seconds.median(), self.seconds.max(), self.seconds.min()].map(|seconds| 1e-6 / seconds)
    }

    /// Counts another ray.
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
