//! Who hears what the renderer asks: counting needs nothing but the walk's own calls, recording keeps the rays.

use crate::accel::{Hit, NoProbe, Probe, Ray, RayCounts};

/// What is asked about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Question {
    /// Its first hit.
    Closest,
    /// Whether anything in its way stops light where it is hit. [`Filters`](super::Filters) know of what is not opaque.
    Occluded,
    /// Its first hit behind another.
    Next,
}

impl Question {
    /// Every question.
    pub const ALL: [Self; 3] = [Self::Closest, Self::Occluded, Self::Next];
}

/// A probe that hears of whole slices of rays before they are asked. Nothing by default, and nothing in the machine code
/// then.
pub(crate) trait Observer: Probe {
    /// Rays asked at once at most: enough for packets, few enough for brute force over a large scene to stop within a
    /// second. 1 where the walk's calls must be told apart by ray.
    const SLICE: usize = 256;

    /// Whether rays may pass known gaps without telling: where queries are neither counted nor recorded.
    const FILTERS_ALPHA: bool = false;

    /// These rays are asked now; `after` has the hit of each behind which it goes on, where that is the question.
    fn asked(&mut self, _question: Question, _rays: &[Ray], _after: &[Hit]) {}
    /// The rays asked last have their answers: these hits, where hits were asked for.
    fn answered(&mut self, _hits: &[Hit]) {}
    /// So many samples of other pixels begin; sample numbers start from 0 again.
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
    /// What it has passed last.
    pub after: Hit,
    batch: u32,
}

/// An even sample of the rays of one class.
#[derive(Clone, Debug, Default)]
pub struct Tape {
    tracks: [Track; 3],
    batch: u32,
}

/// Rays of one question.
#[derive(Clone, Debug, Default)]
struct Track {
    rays: Vec<Asked>,
    /// Asked in all.
    total: u64,
    /// One in 2^`shift` is kept.
    shift: u32,
}

impl Tape {
    /// Rays that are kept for a question at most. Beyond it every second one is dropped, so that what is left is always
    /// an even sample, and at least half of this.
    pub const LIMIT: usize = 1 << 20;

    /// The rays that were kept, in the order they were asked.
    pub fn rays(&self, question: Question) -> &[Asked] {
        &self.tracks[question as usize].rays
    }

    /// How many rays were asked.
    pub fn total(&self, question: Question) -> u64 {
        self.tracks[question as usize].total
    }

    /// Replaces sample numbers by pixels; `batches` has the pixels of the samples of each batch.
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
