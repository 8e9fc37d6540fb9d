//! An evening sky: a low sun, haze around it, a few clouds, dark ground.

use glam::Vec3;
use image::Rgb;
use image::codecs::hdr::HdrEncoder;
use std::f32::consts::PI;
use std::io;

const WIDTH: u16 = 256;
const HEIGHT: u16 = 128;

/// Half the angle of the sun's disc, radians: four times the real one, so that a texel can show it.
const SUN: f32 = 0.0185;

/// The panorama as a Radiance HDR file.
pub(crate) fn evening() -> io::Result<Vec<u8>> {
    let texel = |y, x| {
        let color = mean_around(f32::from(x), f32::from(y));
        Rgb(color.to_array())
    };
    let texels: Vec<Rgb<f32>> = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| texel(y, x))).collect();
    let mut file = Vec::new();
    let encoded = HdrEncoder::new(&mut file).encode(&texels, WIDTH.into(), HEIGHT.into());
    encoded.map_err(io::Error::other)?;
    Ok(file)
}

/// Mean of a few points in a texel, so that the sun keeps its light.
fn mean_around(x: f32, y: f32) -> Vec3 {
    const PARTS: u16 = 8;
    let part = |i: u16| (f32::from(i) + 0.5) / f32::from(PARTS);
    let all = (0..PARTS).flat_map(|j| (0..PARTS).map(move |i| (i, j)));
    let sum: Vec3 = all.map(|(i, j)| light(direction(x + part(i), y + part(j)))).sum();
    sum / f32::from(PARTS * PARTS)
}

/// The direction at a place of the picture: +X in its middle, +Y up.
fn direction(x: f32, y: f32) -> Vec3 {
    let (around, down) = ((x / f32::from(WIDTH) - 0.5) * 2.0 * PI, y / f32::from(HEIGHT) * PI);
    Vec3::new(libm::sinf(down) * libm::cosf(around), libm::cosf(down), libm::sinf(down) * libm::sinf(around))
}

fn light(dir: Vec3) -> Vec3 {
    // To the right of who looks along −Z, and a little behind.
    let sun = Vec3::new(0.82, 0.42, 0.38).normalize();
    let toward = dir.dot(sun);
    if dir.y < 0.0 {
        let far = libm::expf(dir.y * 6.0);
        return Vec3::new(0.09, 0.075, 0.06).lerp(Vec3::new(0.30, 0.22, 0.16), far);
    }
    let height = libm::sqrtf(dir.y);
    let sky = Vec3::new(0.95, 0.62, 0.38).lerp(Vec3::new(0.10, 0.20, 0.48), height);
    let glow =
        Vec3::new(1.0, 0.6, 0.3) * (1.6 * libm::powf(toward.max(0.0), 24.0) + 0.5 * libm::powf(toward.max(0.0), 4.0));
    let disc = if libm::acosf(toward.min(1.0)) < SUN { Vec3::new(900.0, 640.0, 380.0) } else { Vec3::ZERO };
    let cloud = cloud(dir);
    (sky + glow).lerp(Vec3::new(0.85, 0.68, 0.60) + glow * 0.6, cloud) + disc * (1.0 - cloud)
}

/// How thick clouds are, 0 … 1: long bands above the horizon.
fn cloud(dir: Vec3) -> f32 {
    let (x, y) = (libm::atan2f(dir.z, dir.x), dir.y);
    let waves = libm::sinf(3.0 * x + 1.0) * libm::sinf(5.0 * x + 9.0 * y) + 0.6 * libm::sinf(9.0 * x - 14.0 * y + 2.0);
    let band = libm::expf(-(y - 0.38) * (y - 0.38) * 60.0);
    (band * (0.35 + 0.45 * waves)).clamp(0.0, 0.8)
}
