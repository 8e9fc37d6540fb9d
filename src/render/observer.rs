//! Observers of the renderer's queries: counting needs only the calls of the walk itself, recording keeps the rays.

use crate::accel::{Hit, NoProbe, Probe, Ray, RayCounts};

/// Kinds of queries for a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Question {
    /// The first hit of the ray.
    Closest,
    /// Whether anything on the ray stops light where it is hit. [`Filters`](super::Filters) decide about prims that are not
    /// opaque.
    Occluded,
    /// The first hit of the ray behind another hit.
    Next,
}

impl Question {
    /// All questions.
    pub const ALL: [Self; 3] = [Self::Closest, Self::Occluded, Self::Next];
}

/// A probe that also sees whole slices of rays before their queries. By default the calls do nothing and compile to nothing.
pub(crate) trait Observer: Probe {
    /// Most rays per query: enough for packets, few enough for brute force over a large scene to stop within a second. 1 where
    /// the calls of the walk must be attributed to single rays.
    const SLICE: usize = 256;

    /// Whether rays may skip known gaps unobserved: true where queries are neither counted nor recorded.
    const FILTERS_ALPHA: bool = false;

    /// Called before a query of these rays; for [`Question::Next`], `after` has the hit behind which each goes on.
    fn asked(&mut self, _question: Question, _rays: &[Ray], _after: &[Hit]) {}
    /// Called after the query of these rays, with their hits if it was for hits.
    fn answered(&mut self, _hits: &[Hit]) {}
    /// Called when a batch of `_samples` samples of other pixels begins; sample indices start from 0 again.
    fn batch(&mut self, _samples: usize) {}
}

impl Observer for NoProbe {
    const FILTERS_ALPHA: bool = true;
}

impl Observer for RayCounts {}

/// A ray, and the hit behind which it goes on ([`Hit::MISS`] for other questions).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// The ray.
    pub ray: Ray,
    /// The last hit that the ray has passed.
    pub after: Hit,
    batch: u32,
}

/// An evenly spaced sample of the rays of one class.
#[derive(Clone, Debug, Default)]
pub struct Tape {
    tracks: [Track; 3],
    batch: u32,
}

/// The rays of one question.
#[derive(Clone, Debug, Default)]
struct Track {
    rays: Vec<Asked>,
    /// Number of rays that were asked.
    total: u64,
    /// One ray in 2^`shift` is kept.
    shift: u32,
}

impl Tape {
    /// Most rays that are kept for a question. Beyond it every second one is dropped, so that the rest is always an evenly spaced
    /// sample, at least half as large.
    pub const LIMIT: usize = 1 << 20;

    /// Returns the rays that were kept, in the order of their queries.
    pub fn rays(&self, question: Question) -> &[Asked] {
        &self.tracks[question as usize].rays
    }

    /// Returns the number of rays that were asked.
    pub fn total(&self, question: Question) -> u64 {
        self.tracks[question as usize].total
    }

    /// Replaces sample indices by pixels; `batches` has the pixel of each sample of each batch.
    pub(super) fn name_pixels(&mut self, batches: &[Vec<u32>]) {
        for asked in self.tracks.iter_mut().flat_map(|t| &mut t.rays) {
            let batch = batches.get((asked.batch as usize).saturating_sub(1));
            let pixel = batch.and_then(|b| b.get(asked.ray.sample as usize));
            asked.ray.sample = pixel.copied().unwrap_or_default();
        }
    }
}

impl Probe for Tape {
    const SILENT: bool = true;
}

impl Observer for Tape {
    fn asked(&mut self, question: Question, rays: &[Ray], after: &[Hit]) {
        let batch = self.batch;
        let after = after.iter().copied().chain(std::iter::repeat(Hit::MISS));
        let track = &mut self.tracks[question as usize];
        rays.iter().zip(after).for_each(|(ray, after)| track.push(Asked { ray: *ray, after, batch }, Self::LIMIT));
    }

    fn batch(&mut self, _samples: usize) {
        self.batch += 1;
    }
}

impl Track {
    fn push(&mut self, asked: Asked, limit: usize) {
        let wanted = self.total & ((1 << self.shift) - 1) == 0;
        self.total += 1;
        if !wanted {
            return;
        }
        self.rays.push(asked);
        if self.rays.len() > limit {
            let mut place = 0;
            self.rays.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.shift += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;
    use crate::math::Vec3;

    #[test]
    fn a_full_track_keeps_an_even_sample_from_beginning_to_end() {
        let ray = |sample| Ray { origin: Vec3::ZERO, t_min: 0.0, dir: Vec3::Z, t_max: 1.0, exclude: NO_PRIM, sample };
        let mut track = Track::default();
        (0..1000).for_each(|i| track.push(Asked { ray: ray(i), after: Hit::MISS, batch: 0 }, 100));
        assert_eq!(track.total, 1000);
        let kept: Vec<u32> = track.rays.iter().map(|a| a.ray.sample).collect();
        assert!(kept.len() > 50 && kept.len() <= 100, "{}", kept.len());
        let stride = kept[1];
        assert!(kept.iter().zip(0..).all(|(&k, i)| k == i * stride) && 1000 - kept[kept.len() - 1] <= stride);
    }
}
