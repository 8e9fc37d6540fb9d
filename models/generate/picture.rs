//! Textures as formulas, encoded as PNG or JPEG.

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, RgbImage, RgbaImage};
use libm::{floor, sin};

/// Repeats in both directions, smooth between texels, mipmapped.
pub(crate) fn repeating() -> serde_json::Value {
    serde_json::json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 })
}

/// An RGB picture as PNG; `color` takes 0…1 in both directions and gives sRGB or data 0…1.
pub(crate) fn png(width: u32, height: u32, color: impl Fn(f64, f64) -> [f64; 3]) -> Vec<u8> {
    let picture =
        RgbImage::from_fn(width, height, |x, y| image::Rgb(color(middle(x, width), middle(y, height)).map(byte)));
    encode(picture.as_raw(), width, height, ExtendedColorType::Rgb8)
}

/// An RGBA picture as PNG.
pub(crate) fn png_with_alpha(width: u32, height: u32, color: impl Fn(f64, f64) -> [f64; 4]) -> Vec<u8> {
    let picture =
        RgbaImage::from_fn(width, height, |x, y| image::Rgba(color(middle(x, width), middle(y, height)).map(byte)));
    encode(picture.as_raw(), width, height, ExtendedColorType::Rgba8)
}

/// An RGB picture as JPEG, for what is too rich for a small PNG.
pub(crate) fn jpeg(width: u32, height: u32, color: impl Fn(f64, f64) -> [f64; 3]) -> Vec<u8> {
    let picture =
        RgbImage::from_fn(width, height, |x, y| image::Rgb(color(middle(x, width), middle(y, height)).map(byte)));
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, 82);
    let done = encoder.write_image(picture.as_raw(), width, height, ExtendedColorType::Rgb8);
    assert!(done.is_ok(), "a picture in memory can be encoded");
    bytes
}

/// A tangent-space normal map of a height field over the unit square, `depth` units high, both sides repeating.
pub(crate) fn normal_map(size: u32, depth: f64, height: impl Fn(f64, f64) -> f64) -> Vec<u8> {
    let step = 0.5 / f64::from(size);
    png(size, size, |u, v| {
        // v points down in the picture, the bitangent up.
        let slope_u = (height(u + step, v) - height(u - step, v)) / (2.0 * step) * depth;
        let slope_v = (height(u, v - step) - height(u, v + step)) / (2.0 * step) * depth;
        let length = (slope_u * slope_u + slope_v * slope_v + 1.0).sqrt();
        [-slope_u / length, -slope_v / length, 1.0 / length].map(|c| 0.5 * c + 0.5)
    })
}

/// Smooth noise around 0 that repeats after `period` cells (K. Perlin's, 1985, with a cosine hash for gradients).
pub(crate) fn noise(x: f64, y: f64, period: f64) -> f64 {
    let (cell_x, cell_y) = (floor(x), floor(y));
    let (fx, fy) = (x - cell_x, y - cell_y);
    let corner = |i: f64, j: f64| {
        let wrap = |c: f64| c - period * floor(c / period);
        let (cx, cy) = (wrap(cell_x + i), wrap(cell_y + j));
        let seed = sin(cx * 127.1 + cy * 311.7) * 43_758.545;
        let angle = std::f64::consts::TAU * (seed - floor(seed));
        libm::cos(angle) * (fx - i) + sin(angle) * (fy - j)
    };
    let ease = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let (tx, ty) = (ease(fx), ease(fy));
    mix(mix(corner(0.0, 0.0), corner(1.0, 0.0), tx), mix(corner(0.0, 1.0), corner(1.0, 1.0), tx), ty)
}

/// Octaves of [`noise`] over the unit square, repeating, starting at `cells` a side.
pub(crate) fn clouds(u: f64, v: f64, cells: f64, octaves: u32) -> f64 {
    let (mut sum, mut share, mut cells) = (0.0, 0.5, cells);
    for _ in 0..octaves {
        sum += noise(u * cells, v * cells, cells) * share;
        (share, cells) = (share * 0.5, cells * 2.0);
    }
    sum
}

/// Between two colours.
pub(crate) fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t.clamp(0.0, 1.0))
}

/// 0 below `from`, 1 above `to`, smooth between.
pub(crate) fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn middle(i: u32, size: u32) -> f64 {
    (f64::from(i) + 0.5) / f64::from(size)
}

fn byte(c: f64) -> u8 {
    (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn encode(texels: &[u8], width: u32, height: u32, kind: ExtendedColorType) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
    let done = encoder.write_image(texels, width, height, kind);
    assert!(done.is_ok(), "a picture in memory can be encoded");
    bytes
}
