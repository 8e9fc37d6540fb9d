//! Rays on which structures are compared: those of a real picture, and one diffuse bounce from its primary hits.

use crate::accel::{Accel, Hit, NO_PRIM, NoProbe, Ray};
use crate::math::Vec3;
use crate::math::random::Random;
use crate::render::{Asked, CLASS_NAMES, Job, Question, Tape, World, render_recorded};
use std::f32::consts::TAU;

/// Source of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// Camera ray.
    Primary,
    /// Ray from a surface point to a light.
    Shadow,
    /// Mirror reflection.
    Reflected,
    /// Refraction in glass, or transmission through another surface.
    Refracted,
    /// Bounce off a matt surface, with cosine-weighted directions. The renderer sends no such rays; a path tracer would.
    Diffuse,
}

impl Class {
    /// All classes, in the order of reports.
    pub const ALL: [Self; 5] = [Self::Primary, Self::Shadow, Self::Reflected, Self::Refracted, Self::Diffuse];

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            class => CLASS_NAMES[class as usize],
        }
    }
}

/// Rays with the same question.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// Question asked of the structure.
    pub question: Question,
    /// Rays of the batch.
    pub rays: Vec<Ray>,
    /// Hits behind which the search continues, one per ray, for [`Question::Next`]; else empty.
    pub after: Vec<Hit>,
}

impl Batch {
    fn new(question: Question, asked: &[Asked]) -> Self {
        let after = if question == Question::Next { asked.iter().map(|a| a.after).collect() } else { Vec::new() };
        Self { question, rays: asked.iter().map(|a| a.ray).collect(), after }
    }

    /// Batch of the rays at the given indices.
    pub fn pick(&self, places: &[usize]) -> Self {
        let after = if self.after.is_empty() { Vec::new() } else { places.iter().map(|&i| self.after[i]).collect() };
        Self { question: self.question, rays: places.iter().map(|&i| self.rays[i]).collect(), after }
    }
}

/// Rays of one class.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySet {
    /// Class of the rays.
    pub class: Class,
    /// Number of rays that the picture asked.
    pub asked: u64,
    /// Kept rays: all, or an even sample.
    pub batches: Vec<Batch>,
}

impl RaySet {
    /// Number of kept rays.
    pub fn len(&self) -> usize {
        self.batches.iter().map(|b| b.rays.len()).sum()
    }

    /// Whether no ray was kept.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Samples at most `limit` rays evenly from all batches; also returns the indices of the kept rays in each batch.
    pub fn sample(&self, limit: usize, seed: u64) -> (Self, Vec<Vec<usize>>) {
        let (all, mut seen, mut kept) = (self.len().max(1), 0, 0);
        let limit = limit.min(all);
        let mut share = |batch: &Batch| {
            seen += batch.rays.len();
            // Total kept up to this batch: its share of the limit, rounded down.
            let count = seen * limit / all - kept;
            kept += count;
            even_places(batch.rays.len(), count, seed)
        };
        let places: Vec<Vec<usize>> = self.batches.iter().map(&mut share).collect();
        let batches = self.batches.iter().zip(&places).map(|(b, p)| b.pick(p)).collect();
        (Self { class: self.class, asked: self.asked, batches }, places)
    }
}

/// Draws `count` of `len` indices, one from each of `count` equal parts, which avoids aliasing with patterns of the picture.
fn even_places(len: usize, count: usize, seed: u64) -> Vec<usize> {
    if count >= len {
        return (0..len).collect();
    }
    let mut random = Random::new(seed ^ len as u64);
    let part = |i: usize| i * len / count;
    (0..count).map(|i| part(i) + random.below(part(i + 1) - part(i))).collect()
}

/// Renders once and records at most `limit` rays per class, leaving out classes without rays. Also returns the depth that was
/// used; `None` when the rendering failed.
pub fn record(job: &Job, limit: usize, seed: u64) -> Option<(Vec<RaySet>, u32)> {
    let (rendered, recording) = render_recorded(job, &())?;
    let eye = recording.primary.rays(Question::Closest);
    let diffuse = diffuse(job, eye, seed);
    // The tape may have kept only some of the primary rays.
    let bounces = diffuse.rays.len() as u64 * recording.primary.total(Question::Closest) / (eye.len() as u64).max(1);
    let mut sets = vec![
        set(Class::Primary, &recording.primary, seed),
        set(Class::Shadow, &recording.shadow, seed),
        set(Class::Reflected, &recording.reflected, seed),
        set(Class::Refracted, &recording.refracted, seed),
        RaySet { class: Class::Diffuse, asked: bounces, batches: vec![diffuse] },
    ];
    sets.retain(|set| !set.is_empty());
    for set in sets.iter_mut().filter(|set| set.len() > limit) {
        *set = set.sample(limit, seed).0;
    }
    Some((sets, rendered.depth))
}

/// Ray set of a class; every question keeps the same fraction, namely that of the question of which the tape kept the least.
fn set(class: Class, tape: &Tape, seed: u64) -> RaySet {
    let parts = Question::ALL.map(|q| (tape.rays(q).len() as u64, tape.total(q)));
    let (kept, of) = parts.into_iter().filter(|part| part.1 > 0).fold((1, 1), |least, part| {
        if u128::from(part.0) * u128::from(least.1) < u128::from(least.0) * u128::from(part.1) { part } else { least }
    });
    let share = |total: u64| (u128::from(total) * u128::from(kept) / u128::from(of)) as usize;
    let batch = |question| {
        let all = Batch::new(question, tape.rays(question));
        let count = share(tape.total(question));
        if count < all.rays.len() { all.pick(&even_places(all.rays.len(), count, seed)) } else { all }
    };
    let batches = Question::ALL.into_iter().map(batch).filter(|b| !b.rays.is_empty()).collect();
    RaySet { class, asked: Question::ALL.into_iter().map(|q| tape.total(q)).sum(), batches }
}

/// One diffuse ray from each hit of a primary ray, on the side that was seen.
fn diffuse(job: &Job, eye: &[Asked], seed: u64) -> Batch {
    let eye: Vec<Ray> = eye.iter().map(|a| a.ray).collect();
    let mut hits = vec![Hit::MISS; eye.len()];
    job.accel.closest(&eye, &mut hits, &mut job.accel.scratch(), &mut NoProbe);
    let mut random = Random::new(seed);
    let found = eye.iter().zip(&hits).filter(|(_, hit)| hit.is_some());
    let rays = found.filter_map(|(ray, hit)| bounce(job.world, ray, hit, &mut random)).collect();
    Batch { question: Question::Closest, rays, after: Vec::new() }
}

/// Cosine-weighted ray from a hit; `None` where the face has no normal.
fn bounce(world: &World, ray: &Ray, hit: &Hit, random: &mut Random) -> Option<Ray> {
    let refined = world.refine(ray, hit);
    let normal = if refined.normal.dot(ray.dir) > 0.0 { -refined.normal } else { refined.normal };
    if normal == Vec3::ZERO {
        return None;
    }
    // Sample the unit disc and lift the point onto the hemisphere above it (Malley's method).
    let (square, turn) = (random.unit(), TAU * random.unit());
    let radius = square.sqrt();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let aside = tangent * (radius * libm::cosf(turn)) + bitangent * (radius * libm::sinf(turn));
    let dir = aside + normal * (1.0 - square).max(f32::EPSILON).sqrt();
    let exclude = if world.is_flat(hit.prim) { hit.prim } else { NO_PRIM };
    Some(Ray { origin: refined.origin(dir), t_min: 0.0, dir, t_max: f32::INFINITY, exclude, sample: ray.sample })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::observer::Observer;

    #[test]
    fn a_sample_is_as_large_as_it_may_be_and_no_larger() {
        let batch = |(question, n)| {
            let after = if question == Question::Next { vec![Hit::MISS; n] } else { Vec::new() };
            Batch { question, rays: vec![Ray::new(Vec3::ZERO, Vec3::X); n], after }
        };
        let batches = Question::ALL.into_iter().zip([700, 40, 3]).map(batch).collect();
        let set = RaySet { class: Class::Primary, asked: 743, batches };
        for limit in [1, 2, 10, 100, 742, 743, 5000] {
            let (sample, places) = set.sample(limit, 3);
            assert_eq!(sample.len(), limit.min(743));
            assert!(places.iter().zip(&sample.batches).all(|(places, batch)| places.len() == batch.rays.len()));
        }
    }

    #[test]
    fn of_every_question_of_a_class_the_same_part_is_kept() {
        let mut tape = Tape::default();
        let rays = vec![Ray::new(Vec3::ZERO, Vec3::X); 1 << 12];
        let times = 3 * Tape::LIMIT / rays.len();
        (0..times).for_each(|_| tape.asked(Question::Occluded, &rays, &[]));
        (0..32).for_each(|_| tape.asked(Question::Closest, &rays, &[]));
        let set = set(Class::Shadow, &tape, 5);
        let total = (3 * Tape::LIMIT + 32 * rays.len()) as u64;
        assert_eq!((set.asked, set.batches.len()), (total, 2));
        let [closest, occluded] = [0, 1].map(|i| set.batches[i].rays.len() as f64);
        let part = occluded / (3 * Tape::LIMIT) as f64;
        assert!((0.16..0.34).contains(&part) && (closest / (32 << 12) as f64 / part - 1.0).abs() < 1e-3, "{part}");
    }

    #[test]
    fn an_even_sample_has_one_place_from_each_part() {
        let places = even_places(1000, 30, 7);
        assert_eq!(places.len(), 30);
        assert!(places.iter().enumerate().all(|(i, &p)| (i * 1000 / 30..(i + 1) * 1000 / 30).contains(&p)));
        assert_eq!(even_places(3, 9, 7), [0, 1, 2]);
    }
}
