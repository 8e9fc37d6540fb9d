//! Eye rays: the first wave of every batch of pixels, set up many at a time.

use super::media::Media;
use super::view::{Lens, PrimaryRay, View};
use super::wave::Path;
use super::world::World;
use crate::accel::{Hit, NO_PRIM, Pencil, Ray};
use crate::math::simd::{Kernel, LANES, Level, Simd};
use crate::math::{DVec3, Vec3};
use crate::scene::Scene;

/// Rays that are set up at a time.
const RUN: usize = 64;

/// Eye rays, and their hits.
#[derive(Debug, Default)]
pub(crate) struct PrimaryRays {
    /// Number of rays; the rest of the buffers is left over from earlier batches.
    count: usize,
    rays: Vec<Ray>,
    pub hits: Vec<Hit>,
    /// Directions of the rays, by axis.
    dirs: [Vec<f32>; 3],
    cone_width: Vec<f32>,
    cone_spread: Vec<f32>,
    /// Whether all rays start at the eye itself.
    is_pencil: bool,
    /// Media that all rays start inside of.
    pub media: Media,
}

/// A query for the first hits of rays.
pub(crate) struct PrimaryQuery<'e> {
    pub rays: &'e [Ray],
    /// The rays as a pencil, if all have the same origin.
    pub pencil: Option<Pencil<'e>>,
    /// Widths and spreads of the rays' cones.
    pub cones: [&'e [f32]; 2],
    /// Room for the hit of each ray.
    pub hits: &'e mut [Hit],
}

/// A thin lens with an aperture: what is out of focus is blurred.
///
/// R. L. Cook, T. Porter, L. Carpenter, "Distributed Ray Tracing" (1984). Uniform sampling uses a different point of the lens for
/// each sample, and other points in each pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Radius of the aperture, world units.
    pub radius: f64,
    /// Distance of the focal plane along the view axis, world units; above 0.
    pub focus: f64,
}

/// A point of the picture, in pixels from its upper left corner, seen through a point of the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraSample {
    pub x: f64,
    pub y: f64,
    /// Point of the lens, in the unit square that is mapped to its disc.
    pub lens: [f64; 2],
}

impl CameraSample {
    /// The point of the picture, seen through the centre of the lens.
    pub(crate) fn new(x: f64, y: f64) -> Self {
        Self { x, y, lens: [0.5; 2] }
    }
}

/// Origin and aim of eye rays.
#[derive(Clone, Copy)]
pub(crate) struct Eye<'a> {
    pub view: &'a View,
    pub width: u32,
    pub height: u32,
    /// Centre of the scene, which is subtracted from world positions.
    pub center: DVec3,
    /// Footprint width of one sample relative to a pixel.
    pub sample_width: f32,
    /// Ball around everything visible; rays may start just before it.
    pub scene: Ball,
    /// `None`: a pinhole, everything is sharp.
    pub lens: Option<ThinLens>,
}

/// An eye farther from the scene than this many of its diagonals starts its rays just before the scene.
const FAR: f64 = 4.0;

/// A ball around everything bounded, world space; infinite where eye rays must not be shortened.
#[derive(Clone, Copy)]
pub(crate) struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

/// An eye ray in the centred frame.
struct CenteredRay {
    origin: Vec3,
    dir: Vec3,
    /// Width of the sample's cone at the origin, and its spread.
    cone_width: f32,
    cone_spread: f32,
}

impl Eye<'_> {
    /// Ray and path of a camera sample inside of `media`, as sample 0.
    pub(crate) fn ray_with_path(&self, place: CameraSample, media: Media) -> (Ray, Path) {
        let CenteredRay { origin, dir, cone_width, cone_spread } = self.ray(place);
        (ray(origin, dir, 0), Path::from_eye(cone_width, cone_spread, media))
    }

    /// Ray of a camera sample in the centred frame, started just before the scene when the eye is far away.
    fn ray(&self, place: CameraSample) -> CenteredRay {
        let eye = self.view.primary(place.x, place.y, self.width, self.height);
        self.start(match self.lens {
            Some(lens) => self.through(lens, eye, on_disc(place.lens)),
            None => eye,
        })
    }

    /// Whether all rays start at the eye itself.
    fn sees_from_one_place(&self) -> bool {
        let perspective = matches!(self.view.lens, Lens::Perspective { .. });
        perspective && self.lens.is_none() && !self.scene.seen_from(self.view.eye).far
    }

    /// The ray from a point of the lens, in its unit disc, to where `ray` meets the focal plane.
    #[inline(always)]
    fn through(&self, lens: ThinLens, ray: PrimaryRay, [x, y]: [f64; 2]) -> PrimaryRay {
        let view = self.view;
        let (x, y) = (x * lens.radius, y * lens.radius);
        let sharp = ray.dir * (lens.focus / ray.dir.dot(view.forward));
        let aside = view.right * x + view.up * y;
        PrimaryRay { origin: ray.origin + aside, dir: (sharp - aside).normalize(), ..ray }
    }

    #[inline(always)]
    fn start(&self, eye: PrimaryRay) -> CenteredRay {
        self.skip(eye, self.scene.seen_from(eye.origin).distance_before(eye.dir))
    }

    /// Starts a ray at `distance` along it.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "widths are estimates")]
    fn skip(&self, eye: PrimaryRay, distance: f64) -> CenteredRay {
        CenteredRay {
            origin: (eye.origin - self.center + eye.dir * distance).as_vec3(),
            dir: eye.dir.as_vec3(),
            cone_width: (eye.cone_width + eye.cone_spread * distance as f32) * self.sample_width,
            cone_spread: eye.cone_spread * self.sample_width,
        }
    }
}

/// Maps the unit square to the unit disc: areas keep their ratios, and neighbours stay together.
///
/// P. Shirley, K. Chiu, "A Low Distortion Map Between Disk and Square" (1997).
fn on_disc([u, v]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let quarter = std::f64::consts::FRAC_PI_4;
    let (radius, angle) = if x.abs() > y.abs() {
        (x, quarter * (y / x))
    } else if y != 0.0 {
        (y, 2.0 * quarter - quarter * (x / y))
    } else {
        return [0.0; 2];
    };
    let (sin, cos) = libm::sincos(angle);
    [radius * cos, radius * sin]
}

fn ray(origin: Vec3, dir: Vec3, sample: u32) -> Ray {
    Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample }
}

/// A ball as seen from a point.
#[derive(Clone, Copy)]
struct SeenBall {
    to_center: DVec3,
    radius: f64,
    /// Whether the ball is so far away that rays need not start at the point.
    far: bool,
}

impl Ball {
    /// Ball around everything bounded; unbounded planes may lie anywhere before it, so with them nothing can be skipped.
    pub(super) fn around(scene: &Scene, world: &World) -> Self {
        let (lo, hi) = world.bounds;
        let radius = 0.5 * (hi - lo).length();
        let usable = scene.planes.is_empty() && radius.is_finite();
        Self { center: lo * 0.5 + hi * 0.5, radius: if usable { radius } else { f64::INFINITY } }
    }

    #[inline(always)]
    fn seen_from(&self, origin: DVec3) -> SeenBall {
        let (to_center, radius) = (self.center - origin, self.radius);
        SeenBall { to_center, radius, far: to_center.length() > 2.0 * radius * FAR + radius }
    }
}

impl SeenBall {
    /// Distance that a ray can skip because all of it lies before the ball.
    #[inline(always)]
    fn distance_before(&self, dir: DVec3) -> f64 {
        // Twice the radius leaves room for the rounding of the origin.
        let skipped = self.to_center.dot(dir) - 2.0 * self.radius;
        if self.far & (skipped > 0.0) & (skipped < f64::INFINITY) { skipped } else { 0.0 }
    }
}

impl PrimaryRays {
    pub(crate) fn clear(&mut self) {
        (self.count, self.is_pencil) = (0, true);
    }

    /// Returns all rays.
    pub(crate) fn rays(&self) -> &[Ray] {
        &self.rays[..self.count]
    }

    /// Adds the rays of these camera samples; the `i`th ray is that of sample `i`.
    pub(crate) fn send(&mut self, eye: &Eye, places: impl Iterator<Item = CameraSample>) {
        let mut run = Run::default();
        places.for_each(|CameraSample { x, y, lens }| {
            let at = run.count % RUN;
            (run.x[at], run.y[at]) = (x, y);
            if eye.lens.is_some() {
                run.lens[at] = lens;
            }
            run.count += 1;
            if run.count == RUN {
                self.take(eye, &mut run);
            }
        });
        self.take(eye, &mut run);
    }

    /// Adds the rays of points given by column and row, seen through the centre of the lens.
    pub(crate) fn send_columns(&mut self, eye: &Eye, x: &[f64], y: &[f64]) {
        let mut run = Run::default();
        for (x, y) in x.chunks(RUN).zip(y.chunks(RUN)) {
            run.count = x.len().min(y.len());
            run.x[..run.count].copy_from_slice(&x[..run.count]);
            run.y[..run.count].copy_from_slice(&y[..run.count]);
            self.take(eye, &mut run);
        }
    }

    /// Adds the rays of samples at the same offsets in each of these pixels, seen through the centre of the lens; numbered as by
    /// [`Self::send`].
    pub(crate) fn send_each(&mut self, eye: &Eye, pixels: &[(u32, u32)], offsets: &[(f64, f64)]) {
        let mut run = Run::default();
        for (x, y) in pixels.iter().map(|&(x, y)| (f64::from(x), f64::from(y))) {
            let mut rest = offsets;
            while !rest.is_empty() {
                let (now, later) = rest.split_at(rest.len().min(RUN - run.count));
                let places = run.x.iter_mut().zip(&mut run.y).skip(run.count);
                for ((to_x, to_y), (dx, dy)) in places.zip(now) {
                    (*to_x, *to_y) = (x + dx, y + dy);
                }
                run.count += now.len();
                rest = later;
                if run.count == RUN {
                    self.take(eye, &mut run);
                }
            }
        }
        self.take(eye, &mut run);
    }

    fn take(&mut self, eye: &Eye, run: &mut Run) {
        let start = self.count;
        self.make_room(start + RUN);
        self.count += run.count.min(RUN);
        self.is_pencil &= eye.sees_from_one_place();
        let [x, y, z] = &mut self.dirs;
        let columns = [x, y, z, &mut self.cone_width, &mut self.cone_spread].map(|column| from(column, start));
        let (Some(rays), [Some(x), Some(y), Some(z), Some(width), Some(spread)]) =
            (from(&mut self.rays, start), columns)
        else {
            run.count = 0;
            return;
        };
        #[expect(clippy::cast_possible_truncation, reason = "a wave has few samples")]
        let sample = start as u32;
        Level::best().run(Aim { eye, run, rays, columns: [x, y, z, width, spread], sample });
        run.count = 0;
    }

    /// Grows the buffers to `count` rays if they are shorter. They never shrink, and old contents are overwritten, not cleared.
    fn make_room(&mut self, count: usize) {
        if self.rays.len() < count {
            let count = count.next_power_of_two();
            self.rays.resize(count, ray(Vec3::ZERO, Vec3::ZERO, 0));
            for numbers in self.dirs.iter_mut().chain([&mut self.cone_width, &mut self.cone_spread]) {
                numbers.resize(count, 0.0);
            }
        }
    }

    /// Returns the query for the first hits of all rays.
    pub(crate) fn ask(&mut self) -> PrimaryQuery<'_> {
        let Self { count, rays, hits, dirs, cone_width, cone_spread, is_pencil, .. } = self;
        let rays = &rays[..*count];
        // The query overwrites every hit.
        hits.resize(*count, Hit::MISS);
        let first = rays.first().filter(|_| *is_pencil);
        let pencil = first.map(|ray| Pencil { origin: ray.origin, dirs: dirs.each_ref().map(|row| &row[..*count]) });
        PrimaryQuery { rays, pencil, cones: [&cone_width[..*count], &cone_spread[..*count]], hits }
    }

    /// Directions by axis, and cone spreads, radians.
    pub(crate) fn columns(&self) -> ([&[f32]; 3], &[f32]) {
        (self.dirs.each_ref().map(|row| &row[..self.count]), &self.cone_spread[..self.count])
    }

    /// Whether the rays start inside of a medium.
    pub(crate) fn are_immersed(&self) -> bool {
        self.media != Media::OUTSIDE
    }

    /// Path of the `i`th ray.
    pub(crate) fn path(&self, i: usize) -> Path {
        Path::from_eye(self.cone_width[i], self.cone_spread[i], self.media)
    }
}

/// Elements of one run, from `start` on; `None` if there are fewer.
fn from<T>(buffer: &mut [T], start: usize) -> Option<&mut [T; RUN]> {
    buffer.get_mut(start..)?.first_chunk_mut()
}

/// Camera samples by index, and the rays found for them; compilers vectorise this as long as it lies in one structure.
struct Run {
    count: usize,
    x: [f64; RUN],
    y: [f64; RUN],
    lens: [[f64; 2]; RUN],
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
            lens: [[0.0; 2]; RUN],
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
    /// Destination of the rays.
    rays: &'a mut [Ray; RUN],
    /// Destination of directions by axis, cone widths and cone spreads.
    columns: [&'a mut [f32; RUN]; 5],
    /// Sample of the first ray.
    sample: u32,
}

impl Kernel for Aim<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { eye, run, rays, columns, sample } = self;
        let view = *eye.view;
        let eye = Eye { view: &view, ..*eye };
        // Decisions common to all rays are taken outside the loop, which then is branch-free.
        match (view.lens, eye.lens) {
            (Lens::Perspective { .. }, None) => {
                let ball = eye.scene.seen_from(view.eye);
                if ball.far {
                    run.each(&eye, |ray, _| eye.skip(ray, ball.distance_before(ray.dir)));
                } else {
                    run.each(&eye, |ray, _| eye.skip(ray, 0.0));
                }
            }
            (_, None) => run.each(&eye, |ray, _| eye.start(ray)),
            (_, Some(lens)) => {
                // Mapped in a loop of its own, which has branches: the rest vectorises.
                run.lens[..run.count.min(RUN)].iter_mut().for_each(|at| *at = on_disc(*at));
                run.each(&eye, |ray, at| eye.start(eye.through(lens, ray, at)));
            }
        }
        run.write_rays(s, rays, columns, sample);
    }
}

impl Run {
    /// Computes every ray from the one through the centre of the lens, and the point of the lens.
    #[inline(always)]
    fn each(&mut self, eye: &Eye, start: impl Fn(PrimaryRay, [f64; 2]) -> CenteredRay) {
        for i in 0..self.count.next_multiple_of(LANES).min(RUN) {
            let ray = eye.view.primary(self.x[i], self.y[i], eye.width, eye.height);
            let CenteredRay { origin, dir, cone_width, cone_spread } = start(ray, self.lens[i]);
            (self.origin[0][i], self.origin[1][i], self.origin[2][i]) = (origin.x, origin.y, origin.z);
            (self.dir[0][i], self.dir[1][i], self.dir[2][i]) = (dir.x, dir.y, dir.z);
            (self.cone_width[i], self.cone_spread[i]) = (cone_width, cone_spread);
        }
    }

    /// Writes the rays as they lie in memory, four numbers at a time, and the columns.
    #[inline(always)]
    fn write_rays<S: Simd>(&self, s: S, rays: &mut [Ray; RUN], columns: [&mut [f32; RUN]; 5], mut sample: u32) {
        let mut columns = columns;
        let (zero, infinite) = (s.splat(0.0), s.splat(f32::INFINITY));
        let eights = self.count.div_ceil(LANES).min(RUN / LANES);
        for (k, rays) in rays.as_chunks_mut::<LANES>().0[..eights].iter_mut().enumerate() {
            let eight = |row: &[f32; RUN]| row.as_chunks::<LANES>().0[k];
            let [ox, oy, oz] = [eight(&self.origin[0]), eight(&self.origin[1]), eight(&self.origin[2])];
            let [dx, dy, dz] = [eight(&self.dir[0]), eight(&self.dir[1]), eight(&self.dir[2])];
            let eights = [dx, dy, dz, eight(&self.cone_width), eight(&self.cone_spread)];
            for (column, eight) in columns.iter_mut().zip(eights) {
                column.as_chunks_mut().0[k] = eight;
            }
            let from = s.rows([s.load(&ox), s.load(&oy), s.load(&oz), zero]);
            let towards = s.rows([s.load(&dx), s.load(&dy), s.load(&dz), infinite]);
            for (ray, (from, towards)) in rays.iter_mut().zip(from.into_iter().zip(towards)) {
                *ray = Ray::from_fours([from, towards], NO_PRIM, sample);
                sample += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(view: &View, lens: Option<ThinLens>) -> Eye<'_> {
        let scene = Ball { center: DVec3::ZERO, radius: f64::INFINITY };
        Eye { view, width: 40, height: 30, center: DVec3::ZERO, sample_width: 1.0, scene, lens }
    }

    #[test]
    fn rays_through_all_of_a_lens_meet_where_it_is_focused() {
        for lens in [Lens::perspective(0.8), Lens::orthographic(3.0)] {
            let view = View::look_at(DVec3::new(1.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, lens);
            let thin = ThinLens { radius: 0.3, focus: 4.0 };
            let sharp = eye(&view, None).ray(CameraSample::new(7.5, 21.0));
            let length = 4.0 / f64::from(sharp.dir.dot(view.forward.as_vec3()));
            let meeting = sharp.origin + sharp.dir * length as f32;
            let mut farthest = 0.0_f32;
            for at in [[0.0, 0.0], [0.5, 0.5], [1.0, 0.3], [0.2, 0.9]] {
                let ray = eye(&view, Some(thin)).ray(CameraSample { x: 7.5, y: 21.0, lens: at });
                let nearest = (meeting - ray.origin).dot(ray.dir);
                assert!((ray.origin + ray.dir * nearest - meeting).length() < 1e-5, "{at:?}");
                farthest = farthest.max((ray.origin - sharp.origin).length());
            }
            assert!((0.2..=0.300_01).contains(&farthest), "{farthest}");
        }
    }

    #[test]
    fn the_square_covers_the_disc_evenly() {
        let n = 200;
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
        let points = (0..n * n).map(|i| on_disc([middle(i % n), middle(i / n)]));
        let inner = points.filter(|[x, y]| x * x + y * y < 0.25).count();
        assert!((inner as f64 / f64::from(n * n) - 0.25).abs() < 0.005, "{inner}");
    }

    #[test]
    fn rays_of_equal_offsets_in_many_pixels_are_those_of_their_places() {
        let view = View::look_at(DVec3::new(1.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.8));
        let eye = eye(&view, None);
        let pixels: Vec<(u32, u32)> = (0..37).map(|i| (i, i * 3 % 29)).collect();
        for samples in [1, 3, 16, 100] {
            let offsets: Vec<(f64, f64)> = (0..samples).map(|i| (0.3 / f64::from(1 + i), 0.7)).collect();
            let at =
                |&(x, y): &(u32, u32), &(dx, dy): &(f64, f64)| CameraSample::new(f64::from(x) + dx, f64::from(y) + dy);
            let places = pixels.iter().flat_map(|pixel| offsets.iter().map(move |offset| at(pixel, offset)));
            let (mut each, mut one_by_one) = (PrimaryRays::default(), PrimaryRays::default());
            each.send_each(&eye, &pixels, &offsets);
            one_by_one.send(&eye, places);
            assert_eq!(each.rays(), one_by_one.rays());
            assert_eq!(each.rays().len(), 37 * offsets.len());
        }
    }

    #[test]
    fn rays_set_up_side_by_side_have_the_bits_of_single_ones() {
        let view = View::look_at(DVec3::new(1.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.8));
        for lens in [None, Some(ThinLens { radius: 0.3, focus: 4.0 })] {
            let eye = eye(&view, lens);
            let place = |i: u32| {
                let i = f64::from(i);
                CameraSample { x: i * 0.37, y: 30.0 - i * 0.21, lens: [(i * 0.618).fract(), (i * 0.414).fract()] }
            };
            let mut primary_rays = PrimaryRays::default();
            primary_rays.send(&eye, (0..100).map(place));
            assert_eq!(primary_rays.rays().len(), 100);
            if lens.is_none() {
                let (mut by_columns, places) = (PrimaryRays::default(), (0..100).map(place));
                let (x, y): (Vec<f64>, Vec<f64>) = places.map(|place| (place.x, place.y)).unzip();
                by_columns.send_columns(&eye, &x, &y);
                assert_eq!(by_columns.rays(), primary_rays.rays());
            }
            for (i, ray) in (0..100).zip(primary_rays.rays()) {
                assert_eq!(*ray, Ray { sample: i, ..eye.ray_with_path(place(i), Media::OUTSIDE).0 }, "{lens:?}");
            }
        }
    }
}
