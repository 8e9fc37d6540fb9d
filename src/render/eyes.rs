//! Rays from the eye: the first wave of every batch of pixels, many at a time.

use super::view::View;
use super::wave::Path;
use crate::accel::{Hit, NO_PRIM, Ray};
use crate::math::simd::{Kernel, Level, Simd};
use crate::math::{DVec3, Vec3};

/// Rays that are set up at a time.
const RUN: usize = 64;

/// Eye rays, and what they hit.
#[derive(Debug, Default)]
pub(crate) struct Eyes {
    pub rays: Vec<Ray>,
    pub hits: Vec<Hit>,
    cone_width: Vec<f32>,
    cone_spread: Vec<f32>,
}

/// Where eye rays come from.
#[derive(Clone, Copy)]
pub(crate) struct Eye<'a> {
    pub view: &'a View,
    pub width: u32,
    pub height: u32,
    /// What is subtracted from world positions.
    pub center: DVec3,
    /// Sharpness of one sample relative to a pixel.
    pub sample_width: f32,
    /// Everything that can be seen, where rays may start just before it.
    pub scene: Ball,
}

/// An eye farther from the scene than this many of its diagonals starts its rays just before the scene.
const FAR: f64 = 4.0;

/// A ball around everything bounded, world space; an infinite one when eye rays must not be shortened.
#[derive(Clone, Copy)]
pub(crate) struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

/// An eye ray in the centred frame.
pub(crate) struct EyeRay {
    origin: Vec3,
    dir: Vec3,
    /// Width of a sample at the origin, and its growth.
    cone_width: f32,
    cone_spread: f32,
}

impl Eye<'_> {
    /// The ray through (x, y) of the picture, started before the scene when the eye is far away, in the centred frame.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "widths are estimates")]
    pub(crate) fn ray(&self, x: f64, y: f64) -> EyeRay {
        let eye = self.view.primary(x, y, self.width, self.height);
        let skipped = self.scene.distance_before(eye.origin, eye.dir);
        EyeRay {
            origin: (eye.origin - self.center + eye.dir * skipped).as_vec3(),
            dir: eye.dir.as_vec3(),
            cone_width: (eye.cone_width + eye.cone_spread * skipped as f32) * self.sample_width,
            cone_spread: eye.cone_spread * self.sample_width,
        }
    }
}

impl EyeRay {
    pub(crate) fn with_path(&self, sample: u32) -> (Ray, Path) {
        (ray(self.origin, self.dir, sample), Path::from_eye(self.cone_width, self.cone_spread))
    }
}

fn ray(origin: Vec3, dir: Vec3, sample: u32) -> Ray {
    Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample }
}

impl Ball {
    /// How much of a ray can be skipped because all of it lies before the ball, seen from far away.
    #[inline(always)]
    fn distance_before(&self, origin: DVec3, dir: DVec3) -> f64 {
        let to_center = self.center - origin;
        let far = to_center.length() > 2.0 * self.radius * FAR + self.radius;
        // Twice the radius leaves room for the rounding of the start.
        let skipped = to_center.dot(dir) - 2.0 * self.radius;
        if far & (skipped > 0.0) & (skipped < f64::INFINITY) { skipped } else { 0.0 }
    }
}

impl Eyes {
    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.hits.clear();
        self.cone_width.clear();
        self.cone_spread.clear();
    }

    /// Adds the rays through these points of the picture; the `i`th ray is that of sample `i`.
    pub(crate) fn send(&mut self, eye: &Eye, points: impl Iterator<Item = (f64, f64)>) {
        let mut run = Run::default();
        for (x, y) in points {
            (run.x[run.count % RUN], run.y[run.count % RUN]) = (x, y);
            run.count += 1;
            if run.count == RUN {
                self.take(eye, &mut run);
            }
        }
        self.take(eye, &mut run);
    }

    fn take(&mut self, eye: &Eye, run: &mut Run) {
        Level::best().run(Aim { eye, run });
        let count = run.count.min(RUN);
        for (i, sample) in (0..count).zip(self.rays.len()..) {
            let [ox, oy, oz] = [run.origin[0][i], run.origin[1][i], run.origin[2][i]];
            let [dx, dy, dz] = [run.dir[0][i], run.dir[1][i], run.dir[2][i]];
            #[expect(clippy::cast_possible_truncation, reason = "a wave has few samples")]
            self.rays.push(ray(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz), sample as u32));
        }
        self.cone_width.extend(&run.cone_width[..count]);
        self.cone_spread.extend(&run.cone_spread[..count]);
        run.count = 0;
    }

    /// What the `i`th ray carries.
    pub(crate) fn path(&self, i: usize) -> Path {
        Path::from_eye(self.cone_width[i], self.cone_spread[i])
    }
}

/// Rays by number and place.
struct Run {
    count: usize,
    x: [f64; RUN],
    y: [f64; RUN],
    origin: [[f32; RUN]; 3],
    dir: [[f32; RUN]; 3],
    cone_width: [f32; RUN],
    cone_spread: [f32; RUN],
}

impl Default for Run {
    fn default() -> Self {
        Self {
            count: 0,
            x: [0.0; RUN],
            y: [0.0; RUN],
            origin: [[0.0; RUN]; 3],
            dir: [[0.0; RUN]; 3],
            cone_width: [0.0; RUN],
            cone_spread: [0.0; RUN],
        }
    }
}

struct Aim<'a> {
    eye: &'a Eye<'a>,
    run: &'a mut Run,
}

impl Kernel for Aim<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { eye, run } = self;
        let view = *eye.view;
        let eye = Eye { view: &view, ..*eye };
        for i in 0..run.count.next_multiple_of(8).min(RUN) {
            let EyeRay { origin, dir, cone_width, cone_spread } = eye.ray(run.x[i], run.y[i]);
            (run.origin[0][i], run.origin[1][i], run.origin[2][i]) = (origin.x, origin.y, origin.z);
            (run.dir[0][i], run.dir[1][i], run.dir[2][i]) = (dir.x, dir.y, dir.z);
            (run.cone_width[i], run.cone_spread[i]) = (cone_width, cone_spread);
        }
    }
}
