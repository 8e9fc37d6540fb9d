//! Generated rays: from the eye, off the surface, to the light.
//!
//! Computed in double precision, and rounded to `f32` once. All are in the order of blocks of 4×4 pixels, sixteen rays each.

use std::f64::consts::PI;

use meshray::accel::{Hit, NO_PRIM, Ray, Shapes};
use meshray::math::{DVec3, Vec3};

use crate::mesh::Camera;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 768;

/// Columns and rows of a block.
const BLOCK: u32 = 4;

/// Kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// From the eye through every pixel: first hit.
    Primary,
    /// One from each hit of those, cosine-weighted around the normal: first hit.
    Diffuse,
    /// One from each hit to the light: any hit.
    Shadow,
}

impl Kind {
    pub(crate) const ALL: [Self; 3] = [Self::Primary, Self::Diffuse, Self::Shadow];

    /// Letter as typed and printed.
    pub(crate) fn letter(self) -> char {
        match self {
            Self::Primary => 'P',
            Self::Diffuse => 'D',
            Self::Shadow => 'S',
        }
    }
}

fn ray(origin: DVec3, dir: DVec3, t_max: f64) -> Ray {
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
    let t_max = t_max as f32;
    Ray { origin: origin.as_vec3(), t_min: 0.0, dir: dir.as_vec3(), t_max, exclude: NO_PRIM, sample: 0 }
}

/// Rays from the eye through every pixel.
pub(crate) fn primary(camera: &Camera) -> Vec<Ray> {
    let tan = (camera.fov * PI / 360.0).tan();
    let (width, height) = (f64::from(WIDTH), f64::from(HEIGHT));
    let forward = (camera.target - camera.eye).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    let through = |x: u32, y: u32| {
        let sx = (2.0 * ((f64::from(x) + 0.5) / width) - 1.0) * tan * (width / height);
        let sy = (1.0 - 2.0 * ((f64::from(y) + 0.5) / height)) * tan;
        ray(camera.eye, (forward + sx * right + sy * up).normalize(), f64::INFINITY)
    };
    let blocks = (0..HEIGHT).step_by(4).flat_map(|y| (0..WIDTH).step_by(4).map(move |x| (x, y)));
    let pixels = blocks.flat_map(|(x, y)| (y..y + BLOCK).flat_map(move |y| (x..x + BLOCK).map(move |x| (x, y))));
    pixels.map(|(x, y)| through(x, y)).collect()
}

/// Secondary rays of the first hits: the diffuse rays and the shadow rays.
pub(crate) fn secondary(shapes: &Shapes, camera: &Camera, primary: &[Ray], hits: &[Hit]) -> [Vec<Ray>; 2] {
    let (mut diffuse, mut shadow) = (Vec::new(), Vec::new());
    for (i, (ray, hit)) in (0..).zip(primary.iter().zip(hits)).filter(|(_, (_, hit))| hit.is_some()) {
        let (start, normal) = leaving(shapes, ray, hit);
        diffuse.push(self::ray(start, bounce(normal, i), f64::INFINITY));
        let to_light = camera.light - start.as_vec3().as_dvec3();
        let far = to_light.length();
        shadow.push(self::ray(start, to_light / far, far * 0.999));
    }
    [diffuse, shadow]
}

/// A point just off the surface, and the normal on the side of the ray.
fn leaving(shapes: &Shapes, ray: &Ray, hit: &Hit) -> (DVec3, DVec3) {
    let [a, b, c] = shapes.triangle(hit.prim).map(Vec3::as_dvec3);
    let (e1, e2) = (b - a, c - a);
    let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let determinant = e1.dot(dir.cross(e2));
    let t = e2.dot((origin - a).cross(e1)) / determinant;
    let normal = e1.cross(e2).normalize();
    let normal = if normal.dot(dir) > 0.0 { -normal } else { normal };
    (origin + t * dir + 1e-4 * t * normal, normal)
}

/// The `i`th direction around a normal, cosine-weighted.
///
/// Axes after T. Duff et al., *Building an Orthonormal Basis, Revisited*, 2017.
fn bounce(n: DVec3, i: u64) -> DVec3 {
    let mut random = Pcg::new(i, 54);
    let mut unit = || f64::from(random.next() >> 8) / f64::from(1 << 24);
    let (u1, u2) = (unit(), unit());
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let t1 = DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let t2 = DVec3::new(b, sign + n.y * n.y * a, -n.y);
    let (angle, radius) = (2.0 * PI * u2, u1.sqrt());
    t1 * (radius * angle.cos()) + t2 * (radius * angle.sin()) + n * (1.0 - u1).max(0.0).sqrt()
}

/// M. O'Neill, *PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms*, 2014: PCG-XSH-RR.
struct Pcg {
    state: u64,
    increment: u64,
}

impl Pcg {
    fn new(state: u64, sequence: u64) -> Self {
        let mut random = Self { state: 0, increment: sequence << 1 | 1 };
        random.next();
        random.state = random.state.wrapping_add(state);
        random.next();
        random
    }

    #[expect(clippy::cast_possible_truncation, reason = "the high bits are the output")]
    fn next(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let mixed = ((old >> 18 ^ old) >> 27) as u32;
        mixed.rotate_right((old >> 59) as u32)
    }
}
