//! How much of a picture shows something, as rays spread over it tell.

use super::Job;
use super::eyes::{Ball, Eye, Place};
use super::wave::Media;
use crate::accel::{Accel, Hit, NoProbe, Ray};

/// Columns and rows of these rays.
const SIDE: u32 = 64;

/// What became of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// So many were sent.
    pub rays: usize,
    /// And so many hit something, be it transparent.
    pub hits: usize,
}

/// Sends 64 columns and rows of rays through a picture, at even distances. They are not among those that are counted.
pub fn coverage(job: &Job) -> Coverage {
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
    let along = |i: u32, pixels: u32| (f64::from(i) + 0.5) * f64::from(pixels) / f64::from(SIDE);
    let places = (0..SIDE * SIDE).map(|i| Place::new(along(i % SIDE, width), along(i / SIDE, height)));
    let rays: Vec<Ray> = places.map(|place| eye.ray_with_path(place).0).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest(&rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
    Coverage { rays: rays.len(), hits: hits.iter().filter(|hit| hit.is_some()).count() }
}
