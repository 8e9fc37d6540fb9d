//! How much of a picture shows something, as rays spread over it tell.

use super::eyes::{Ball, Eye, Place};
use super::wave::Media;
use super::{Job, sobol};
use crate::accel::{Accel, Hit, NoProbe, Ray};
use rayon::prelude::*;
use std::ops::Range;

/// Rays that are sent first.
const FIRST: u32 = 1 << 10;

/// Where no more than one of so many of them hits, there are as many as pixels.
const RARE: usize = 100;

/// But no fewer and no more than these.
const LEAST: u32 = 1 << 12;
const MOST: u32 = 1 << 20;

/// Rays that are sent together.
const TOGETHER: u32 = 1 << 12;

/// What became of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// So many were sent.
    pub rays: usize,
    /// And so many hit something, be it transparent.
    pub hits: usize,
}

/// Sends rays through a picture, evenly spread but in no rows: models are framed in the middle, and thin ones would stand
/// between two of them. They are not among the rays that are counted.
pub fn coverage(job: &Job) -> Coverage {
    let pixels = job.settings.width.saturating_mul(job.settings.height);
    let all = pixels.clamp(LEAST, MOST);
    let first = hits(job, 0..FIRST);
    if first * RARE > FIRST as usize {
        return Coverage { rays: FIRST as usize, hits: first };
    }
    let starts: Vec<u32> = (FIRST..all).step_by(TOGETHER as usize).collect();
    let others = starts.into_par_iter().map(|start| hits(job, start..all.min(start + TOGETHER)));
    Coverage { rays: all as usize, hits: first + others.sum::<usize>() }
}

/// How many of these rays hit something.
fn hits(job: &Job, numbers: Range<u32>) -> usize {
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
        inside: Media::default(),
    };
    let place = |i: u32| {
        let [x, y] = sobol::point(i, 0);
        Place::new(x * f64::from(width), y * f64::from(height))
    };
    let rays: Vec<Ray> = numbers.map(|i| eye.ray_with_path(place(i)).0).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest(&rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
    hits.iter().filter(|hit| hit.is_some()).count()
}
