//! Rays in flight: the path state of a ray besides its geometry, and the queues that turn ray trees into waves.
//!
//! There is no recursion and no allocation per ray: shading pushes children into queues, and each queue is drained in
//! slices of rays of one class. The queues are buffers of one worker, reused from tile to tile.

use super::media::Media;
use super::sobol::mix;
use crate::accel::{Hit, Ray};
use crate::math::Vec3;

/// Kind of a ray; counts are kept apart by class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RayClass {
    /// Eye ray.
    Primary,
    /// Ray reflected by a surface.
    Reflected,
    /// Ray refracted by a surface, or passed straight through it.
    Refracted,
}

impl RayClass {
    /// All classes, in the order in which queues are drained.
    pub(crate) const ALL: [Self; 3] = [Self::Primary, Self::Reflected, Self::Refracted];
}

/// State of a ray besides its geometry; the sample it belongs to is in [`Ray::sample`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    /// Throughput: the product of the weights from the eye to here.
    pub weight: Vec3,
    /// 1/N if this is one of N rays over which a branch was spread: whether the branch is worth tracing is decided by the weight
    /// of all of them together.
    pub part: f32,
    /// Bounces since the eye.
    pub depth: u32,
    /// Whether the ray still runs along the line of sight, so that the background behind shows through.
    pub straight: bool,
    /// Whether the hotspot of the sky was sampled where this ray was spread, so that the ray must not count it again.
    pub skips_hotspot: bool,
    /// Last surface that the ray crossed, unless it was a hole, for a ray that goes on behind a hit; [`Hit::MISS`]: none.
    pub crossed: Hit,
    /// Band of the spectrum that the ray carries, once dispersion has split it.
    pub band: Option<u8>,
    /// Media that the ray is inside of.
    pub media: Media,
    /// Ray parameter t up to which absorption has been applied to the weight.
    pub since: f32,
    /// Width of the ray's cone at its start: its footprint.
    pub cone_width: f32,
    /// Growth of that width per unit of length.
    pub cone_spread: f32,
    /// The part of that growth, radians, that is due to rough surfaces.
    pub scattered: f32,
    /// Hash of the turns through the ray tree that led here: the same in all samples for the same turns.
    pub branch: u32,
}

impl Path {
    /// The path of an eye ray inside of `media`.
    pub(crate) fn from_eye(cone_width: f32, cone_spread: f32, media: Media) -> Self {
        Self {
            weight: Vec3::ONE,
            part: 1.0,
            depth: 0,
            straight: true,
            skips_hotspot: false,
            crossed: Hit::MISS,
            band: None,
            media,
            since: 0.0,
            cone_width,
            cone_spread,
            scattered: 0.0,
            branch: 0,
        }
    }

    /// The path behind the back of a one-sided face, which is invisible but blocks rays to the hotspot.
    pub(crate) fn behind_back(self) -> Self {
        Self { skips_hotspot: false, ..self }
    }

    /// The path after a turn; no other ray from this point has the same class and number.
    pub(crate) fn turned(self, class: RayClass, number: u32) -> Self {
        Self { branch: mix(self.branch, (number << 2) | class as u32), ..self }
    }
}

/// Rays of one class that are waiting to be traced.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    rays: Vec<Ray>,
    paths: Vec<Path>,
    /// For a continuing ray, the last hit: the search resumes behind it. For a new ray, the hit it left, with `t` the distance
    /// within which it may hit the same surface again; [`Hit::MISS`] if it may not.
    after: Vec<Hit>,
    /// Number of rays at the front that are sorted by sample.
    in_order: usize,
    /// Samples and positions of the rays to be sorted: a buffer.
    order: Vec<(u32, u32)>,
}

impl Queue {
    pub(crate) fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// Number of queued rays.
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Paths of the queued rays.
    pub(crate) fn paths_mut(&mut self) -> &mut [Path] {
        &mut self.paths
    }

    /// Adds a ray that goes on behind `after`, or starts at it.
    pub(crate) fn push(&mut self, ray: Ray, path: Path, after: Hit) {
        self.rays.push(ray);
        self.paths.push(path);
        self.after.push(after);
    }

    /// Adds a ray that goes on behind a hit that was not a hole. (Behind a hole, the surface crossed last stays the same.)
    pub(crate) fn push_behind(&mut self, ray: Ray, path: Path, hit: Hit) {
        self.push(ray, Path { crossed: hit, ..path }, hit);
    }

    /// Moves the last rays, at most `limit`, into `wave`.
    ///
    /// Taking from the end bounds the memory that trees with many branches need: a slice is traced down to its leaves before the
    /// rays in front of it. More than `sort_above` rays are sorted by sample first, so that the cut between waves does not depend
    /// on the order in which points were shaded.
    pub(crate) fn take(&mut self, wave: &mut Wave, (limit, sort_above): (usize, usize)) {
        wave.clear();
        if self.rays.len() > sort_above {
            self.put_in_order(wave);
        }
        let start = self.rays.len().saturating_sub(limit);
        self.in_order = self.in_order.min(start);
        wave.rays.extend(self.rays.drain(start..));
        wave.paths.extend(self.paths.drain(start..));
        wave.after.extend(self.after.drain(start..));
        wave.hits.resize(wave.rays.len(), Hit::MISS);
    }

    /// Sorts all rays by sample; rays of one sample keep their order. `spare` is empty before and after.
    fn put_in_order(&mut self, spare: &mut Wave) {
        let Self { rays, paths, after, in_order, order } = self;
        let (before, added) = rays.split_at(*in_order);
        let Some(least) = added.iter().map(|ray| ray.sample).min() else { return };
        let start = before.partition_point(|ray| ray.sample <= least);
        *in_order = rays.len();
        if rays[start..].is_sorted_by_key(|ray| ray.sample) {
            return;
        }
        order.clear();
        order.extend((0..).zip(&rays[start..]).map(|(i, ray)| (ray.sample, i)));
        order.sort();
        reorder(&mut rays[start..], order, &mut spare.rays);
        reorder(&mut paths[start..], order, &mut spare.paths);
        reorder(&mut after[start..], order, &mut spare.after);
    }

    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.paths.clear();
        self.after.clear();
        self.in_order = 0;
    }
}

/// Permutes items by `order`, which gives the source position of each.
fn reorder<T: Copy>(items: &mut [T], order: &[(u32, u32)], spare: &mut Vec<T>) {
    spare.extend(order.iter().map(|&(_, from)| items[from as usize]));
    items.copy_from_slice(spare);
    spare.clear();
}

/// Rays of one class that are traced together, and their hits.
#[derive(Debug, Default)]
pub(crate) struct Wave {
    /// Whether the rays are new, as opposed to continuing behind a hit.
    pub starts: bool,
    pub rays: Vec<Ray>,
    pub paths: Vec<Path>,
    pub after: Vec<Hit>,
    pub hits: Vec<Hit>,
}

impl Wave {
    /// Whether the `i`th hit coincides, within rounding error, with the surface that the ray crossed just before: the one at its
    /// start, or the one behind which it goes on.
    pub(crate) fn touches(&self, i: usize) -> bool {
        /// Bound on the relative error of positions where a ray does not graze the surface.
        const NEAR: f32 = 1.0 / (1 << 16) as f32;
        let (ray, hit) = (&self.rays[i], &self.hits[i]);
        let before = if self.starts { &self.after[i] } else { &self.paths[i].crossed };
        if !before.is_some() {
            return false;
        }
        if self.starts {
            return hit.t <= before.t;
        }
        hit.t - before.t <= NEAR * (hit.t + ray.origin.abs().max_element())
    }

    /// Last surface that the `i`th ray has crossed, if its hit is a hole.
    pub(crate) fn crossed(&self, i: usize) -> Hit {
        match self.starts {
            // A surface met at the start counts as met in the same place.
            true if self.touches(i) => Hit { t: self.hits[i].t, ..self.after[i] },
            true => Hit::MISS,
            false => self.paths[i].crossed,
        }
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.paths.clear();
        self.after.clear();
        self.hits.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;
    use crate::math::random::Random;

    fn ray(sample: u32) -> Ray {
        Ray { origin: Vec3::ZERO, t_min: 0.0, dir: Vec3::Z, t_max: 1.0, exclude: NO_PRIM, sample }
    }

    #[test]
    fn a_queue_gives_its_last_rays_first_and_keeps_the_rest() {
        let (mut queue, mut wave) = (Queue::default(), Wave::default());
        let path = Path::from_eye(0.0, 0.0, Media::OUTSIDE);
        (0..5).for_each(|sample| queue.push(ray(sample), path, Hit::MISS));
        queue.take(&mut wave, (3, 3));
        assert_eq!(wave.rays.iter().map(|r| r.sample).collect::<Vec<_>>(), [2, 3, 4]);
        assert_eq!(wave.hits.len(), 3);
        queue.take(&mut wave, (3, 3));
        assert_eq!(wave.rays.iter().map(|r| r.sample).collect::<Vec<_>>(), [0, 1]);
        assert!(queue.is_empty());
    }

    #[test]
    fn what_is_taken_of_many_rays_does_not_depend_on_the_order_in_which_samples_sent_theirs() {
        let mut random = Random::new(8);
        let (mut queues, mut waves) = ([(); 2].map(|()| Queue::default()), [(); 2].map(|()| Wave::default()));
        let mut sent = [0_u32; 90];
        for round in 0..40 {
            // Samples that send a few rays each: once in order, once in another order.
            let samples: Vec<u32> = (0..90).filter(|_| random.below(3) == 0).collect();
            let mut other = samples.clone();
            other.sort_by_key(|sample| sample.wrapping_mul(2_654_435_761).rotate_left(round));
            for (queue, samples) in queues.iter_mut().zip([&samples, &other]) {
                let mut sent = sent;
                for &sample in samples {
                    for _ in 0..1 + sample % 3 {
                        let ray = Ray { t_min: sent[sample as usize] as f32, ..ray(sample) };
                        queue.push(ray, Path { depth: sample, ..Path::from_eye(0.0, 0.0, Media::OUTSIDE) }, Hit::MISS);
                        sent[sample as usize] += 1;
                    }
                }
            }
            samples.iter().for_each(|&sample| sent[sample as usize] += 1 + sample % 3);
            for (queue, wave) in queues.iter_mut().zip(&mut waves) {
                queue.take(wave, (40, 30));
                assert!(wave.rays.iter().zip(&wave.paths).all(|(ray, path)| ray.sample == path.depth));
            }
            let numbers = |wave: &Wave| {
                let mut rays: Vec<_> = wave.rays.iter().map(|ray| (ray.sample, ray.t_min as u32)).collect();
                // Few rays are taken unsorted: samples in any order, but the rays of one sample in theirs.
                rays.sort_by_key(|ray| ray.0);
                rays
            };
            assert_eq!(numbers(&waves[0]), numbers(&waves[1]), "round {round}");
            assert!(numbers(&waves[0]).is_sorted(), "round {round}");
        }
    }
}
