//! Directions drawn where a panorama is bright.
//!
//! A texel is drawn by its light and its area on the sphere, row first (M. Pharr, W. Jakob, G. Humphreys, "Physically Based
//! Rendering", 3rd edition, 2016, section 14.2.4), and a direction evenly within it.

use super::panorama::Level;
use crate::math::Vec3;
use std::f32::consts::PI;

/// Columns of the finest level that is told apart.
pub(super) const COLUMNS: u32 = 1024;

/// Share of the draws that go anywhere, so that what is dark is drawn too.
pub(super) const EVEN: f64 = 0.1;

/// The distribution.
#[derive(Clone, Debug)]
pub(super) struct Chance {
    level: Level,
    /// Sums of the chances of rows up to each.
    rows: Vec<f32>,
    /// Within each row, sums of the chances of texels up to each.
    columns: Vec<f32>,
    /// Densities of texels, 1/sr.
    densities: Vec<f32>,
}

impl Chance {
    /// Of the light of a level, with an `even` share of draws that go anywhere.
    #[expect(clippy::cast_possible_truncation, reason = "chances")]
    pub(super) fn new(level: Level, even: f64) -> Self {
        let (width, height) = (level.width as usize, level.height as usize);
        let light = |row: u32| (0..level.width).map(move |x| (x, row));
        let lights: Vec<f64> = (0..level.height)
            .flat_map(light)
            .map(|(x, row)| f64::from(level.texel(x, row).element_sum()) * f64::from(level.area(row)))
            .collect();
        let whole: f64 = lights.iter().sum();
        let even = if whole > 0.0 { even } else { 1.0 };
        let (mut rows, mut columns) = (Vec::with_capacity(height), Vec::with_capacity(width * height));
        let mut densities = Vec::with_capacity(width * height);
        let mut rows_sum = 0.0;
        for row in 0..height {
            let area = f64::from(level.area(row as u32));
            let chances = lights[row * width..][..width].iter().map(|light| {
                let bright = if whole > 0.0 { light / whole } else { 0.0 };
                bright * (1.0 - even) + even * area / (4.0 * std::f64::consts::PI)
            });
            let chances: Vec<f64> = chances.collect();
            let sum: f64 = chances.iter().sum();
            let mut up_to = 0.0;
            for chance in &chances {
                up_to += if sum > 0.0 { chance / sum } else { 0.0 };
                columns.push(up_to as f32);
                densities.push((chance / area) as f32);
            }
            rows_sum += sum;
            rows.push(rows_sum as f32);
        }
        Self { level, rows, columns, densities }
    }

    /// Radiance of the texel that a direction in the panorama's frame lies in, and the density of drawing that direction,
    /// 1/sr. Mixed with its neighbours a sun would shine where it is hardly ever drawn.
    pub(super) fn look(&self, dir: Vec3) -> (Vec3, f32) {
        let (column, row) = self.level.nearest(dir);
        let density = self.densities[row as usize * self.level.width as usize + column as usize];
        (self.level.texel(column, row), density)
    }

    /// The direction of two numbers from 0 … 1, in the panorama's frame.
    pub(super) fn draw(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (row, down) = pick(&self.rows, u);
        let width = self.level.width as usize;
        let (column, right) = pick(&self.columns[row * width..][..width], v);
        // Evenly by area: by the cosine from the zenith, not by the angle.
        let edge = |row: usize| libm::cosf(PI * row as f32 / self.level.height as f32);
        let cosine = edge(row) + (edge(row + 1) - edge(row)) * down;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(((column as f32 + right) / width as f32 - 0.5) * 2.0 * PI);
        Vec3::new(sine * cos, cosine, sine * sin)
    }
}

/// Which part of a rising list of sums `u` falls into, and where in it, 0 … 1.
fn pick(sums: &[f32], u: f32) -> (usize, f32) {
    let last = sums.len() - 1;
    let u = u * sums[last];
    let i = sums.partition_point(|sum| *sum <= u).min(last);
    let before = if i == 0 { 0.0 } else { sums[i - 1] };
    let width = sums[i] - before;
    (i, if width > 0.0 { ((u - before) / width).clamp(0.0, 1.0) } else { 0.5 })
}
