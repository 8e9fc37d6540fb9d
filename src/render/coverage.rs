//! Fraction of a picture that shows the model, estimated by rays spread over the picture.

use super::media::Media;
use super::primary_rays::{Ball, CameraSample, Eye};
use super::shade::Reader;
use super::surface::{HitPrim, Surface};
use super::{Job, sobol};
use crate::accel::{Accel, Hit, NoProbe, Ray};
use rayon::prelude::*;
use std::ops::Range;

/// Number of rays in the first round.
const FIRST: u32 = 1 << 10;

/// Unless more than one in this many rays of the first round hits, and any sees something, one ray per pixel is sent.
const RARE: usize = 100;

/// Least and greatest number of rays then sent.
const LEAST: u32 = 1 << 12;
const MOST: u32 = 1 << 20;

/// Rays traced in one batch.
const TOGETHER: u32 = 1 << 12;

/// Most invisible layers that are looked through before the ray counts as seeing something.
const LAYERS: usize = 64;

/// Outcome of the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// Number of rays sent.
    pub rays: usize,
    /// Number of rays that hit something, even if it is transparent.
    pub hits: usize,
    /// Whether any ray sees something: not only back faces of one-sided materials and fully transparent surfaces.
    pub shown: bool,
}

/// Sends rays through a picture, evenly spread but not in rows: models are framed in the middle, and a thin one would stand
/// between two rows. These rays are not counted among those of the picture.
pub fn coverage(job: &Job) -> Coverage {
    let pixels = job.settings.width.saturating_mul(job.settings.height);
    let all = pixels.clamp(LEAST, MOST);
    let first = sent(job, 0..FIRST);
    if first.shown && first.hits * RARE > FIRST as usize {
        return first;
    }
    let starts: Vec<u32> = (FIRST..all).step_by(TOGETHER as usize).collect();
    let others = starts.into_par_iter().map(|start| sent(job, start..all.min(start + TOGETHER)));
    let both =
        |a: Coverage, b: Coverage| Coverage { rays: a.rays + b.rays, hits: a.hits + b.hits, shown: a.shown || b.shown };
    both(first, others.reduce(|| Coverage { rays: 0, hits: 0, shown: false }, both))
}

/// Sends the rays with these indices.
fn sent(job: &Job, numbers: Range<u32>) -> Coverage {
    let Job { scene, world, accel, view, settings, .. } = *job;
    let (width, height) = (settings.width, settings.height);
    let eye = Eye {
        view,
        width,
        height,
        center: world.center,
        sample_width: 1.0,
        scene: Ball::around(scene, world),
        lens: None,
    };
    let place = |i: u32| {
        let [x, y] = sobol::point(i, 0);
        CameraSample::new(x * f64::from(width), y * f64::from(height))
    };
    let rays: Vec<Ray> = numbers.clone().map(|i| eye.ray_with_path(place(i), Media::OUTSIDE).0).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut scratch = accel.scratch();
    accel.closest(&rays, &mut hits, &mut scratch, &mut NoProbe);
    let mut met = only_hits(rays, hits);
    let (count, mut layers) = (met.0.len(), 1);
    let is_shown =
        |(rays, hits): &(Vec<Ray>, Vec<Hit>)| rays.iter().zip(hits).any(|(ray, hit)| is_there(job, ray, hit));
    let mut shown = is_shown(&met);
    while !shown && !met.0.is_empty() && layers < LAYERS {
        let mut behind = vec![Hit::MISS; met.0.len()];
        accel.next(&met.0, &met.1, &mut behind, &mut scratch, &mut NoProbe);
        met = only_hits(met.0, behind);
        shown = is_shown(&met);
        layers += 1;
    }
    Coverage { rays: numbers.len(), hits: count, shown: shown || !met.0.is_empty() }
}

/// Keeps the rays that hit something, with their hits.
fn only_hits(rays: Vec<Ray>, hits: Vec<Hit>) -> (Vec<Ray>, Vec<Hit>) {
    rays.into_iter().zip(hits).filter(|(_, hit)| hit.is_some()).unzip()
}

/// Whether the ray sees the surface that it hits.
fn is_there(job: &Job, ray: &Ray, hit: &Hit) -> bool {
    let target = HitPrim::new(job.scene, job.world, hit.prim);
    let material = target.material;
    let surface = Surface::new(job.world, target, ray, hit, 0.0);
    let reader = Reader { store: job.textures, patch: surface.patch.as_ref(), known: &[] };
    (surface.front || material.double_sided || material.reflection.transmits())
        && material.alpha_mode.covers(reader.base(material).w) > 0.0
}
