//! Importance sampling of a panorama by its brightness.
//!
//! A texel is drawn by its light times its solid angle, row first (M. Pharr, W. Jakob, G. Humphreys, "Physically Based
//! Rendering", 3rd edition, 2016, section 14.2.4), and a direction uniformly within it.

use super::panorama::Level;
use crate::math::Vec3;
use std::f32::consts::PI;

/// Columns of the finest level that is sampled.
pub(super) const COLUMNS: u32 = 1024;

/// Average number of entries that one entry of the guide table covers.
const GUIDED: usize = 4;

/// Share of the draws that are uniform, so that dark parts are drawn too.
pub(super) const EVEN: f64 = 0.1;

/// Distribution of directions over a panorama.
#[derive(Clone, Debug)]
pub(super) struct EnvironmentDistribution {
    level: Level,
    /// Distribution over rows, by the light of each.
    rows: Sums,
    /// Distribution over the texels of each row, given the row.
    columns: Vec<Sums>,
    /// Cosines from the zenith of the upper edge of each row, and of the lower edge of the last.
    edges: Vec<f32>,
    /// Probability density of each texel, 1/sr.
    densities: Vec<f32>,
}

/// Cumulative sums of weights.
#[derive(Clone, Debug)]
struct Sums {
    up_to: Vec<f32>,
    /// Guide table: the first entry that numbers of each equal part of 0 … 1 may fall on, for a power of two of parts, and the
    /// last entry at the end.
    first: Vec<u32>,
}

impl EnvironmentDistribution {
    /// Builds the distribution of a level's light, with an `even` share of uniform draws.
    #[expect(clippy::cast_possible_truncation, reason = "chances")]
    pub(super) fn new(level: Level, even: f64) -> Self {
        let (width, height) = (level.width as usize, level.height as usize);
        let light = |row: u32| (0..level.width).map(move |x| (x, row));
        let lights: Vec<f64> = (0..level.height)
            .flat_map(light)
            .map(|(x, row)| f64::from(level.texel(x, row).element_sum()) * f64::from(level.area(row)))
            .collect();
        let total: f64 = lights.iter().sum();
        let even = if total > 0.0 { even } else { 1.0 };
        let (mut rows, mut columns) = (Vec::with_capacity(height), Vec::with_capacity(height));
        let mut densities = Vec::with_capacity(width * height);
        let mut rows_sum = 0.0;
        for row in 0..height {
            let area = f64::from(level.area(row as u32));
            let chances = lights[row * width..][..width].iter().map(|light| {
                let bright = if total > 0.0 { light / total } else { 0.0 };
                bright * (1.0 - even) + even * area / (4.0 * std::f64::consts::PI)
            });
            let chances: Vec<f64> = chances.collect();
            let sum: f64 = chances.iter().sum();
            let mut up_to = 0.0;
            let part = |distribution: &f64| {
                up_to += if sum > 0.0 { distribution / sum } else { 0.0 };
                up_to as f32
            };
            columns.push(Sums::new(chances.iter().map(part).collect()));
            densities.extend(chances.iter().map(|distribution| (distribution / area) as f32));
            rows_sum += sum;
            rows.push(rows_sum as f32);
        }
        let edge = |row: u32| libm::cosf(PI * row as f32 / level.height as f32);
        let edges = (0..=level.height).map(edge).collect();
        Self { level, rows: Sums::new(rows), columns, edges, densities }
    }

    /// Radiance of the texel that contains a direction of the panorama's frame, and the density of drawing that direction, 1/sr.
    /// No filtering: mixed with its neighbours, a sun would shine where it is hardly ever drawn.
    pub(super) fn look(&self, dir: Vec3) -> (Vec3, f32) {
        let (column, row) = self.level.nearest(dir);
        let density = self.densities[row as usize * self.level.width as usize + column as usize];
        (self.level.texel(column, row), density)
    }

    /// Direction drawn with two numbers from 0 … 1, in the panorama's frame.
    pub(super) fn draw(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (row, down) = self.rows.pick(u);
        let (column, right) = self.columns[row].pick(v);
        // Uniform in area: in the cosine from the zenith, not in the angle.
        let cosine = self.edges[row] + (self.edges[row + 1] - self.edges[row]) * down;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(((column as f32 + right) / self.level.width as f32 - 0.5) * 2.0 * PI);
        Vec3::new(sine * cos, cosine, sine * sin)
    }
}

impl Sums {
    /// Builds the guide of at least one cumulative sum.
    #[expect(clippy::cast_possible_truncation, reason = "no side of a panorama has more texels")]
    fn new(up_to: Vec<f32>) -> Self {
        let last = up_to.len() - 1;
        let parts = (up_to.len() / GUIDED).next_power_of_two();
        let mut at = 0;
        let first = |guide: usize| {
            let number = guide as f32 / parts as f32 * up_to[last];
            while at < last && up_to[at] <= number {
                at += 1;
            }
            at as u32
        };
        let first = (0..=parts).map(first).collect();
        Self { up_to, first }
    }

    /// Index of the entry that a number from 0 … 1 falls on, and the position in it, 0 … 1.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "one of the parts")]
    fn pick(&self, number: f32) -> (usize, f32) {
        let (sums, last) = (&self.up_to, self.up_to.len() - 1);
        let parts = self.first.len() - 1;
        let part = ((number * parts as f32) as usize).min(parts - 1);
        let within = self.first[part] as usize..self.first[part + 1] as usize;
        let number = number * sums[last];
        let i = within.start + sums[within].partition_point(|sum| *sum <= number);
        let before = if i == 0 { 0.0 } else { sums[i - 1] };
        let width = sums[i] - before;
        (i, if width > 0.0 { ((number - before) / width).clamp(0.0, 1.0) } else { 0.5 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn numbers_fall_on_what_all_sums_say_and_ends_on_ends() {
        let mut random = Random::new(6);
        for (count, bright) in [(1, 1.0), (2, 0.0), (7, 300.0), (300, 1.0), (1024, 1e6)] {
            let mut sum = 0.0;
            let mut distribution = |i: usize| if i == count / 3 { bright } else { (random.unit() - 0.2).max(0.0) };
            let up_to: Vec<f32> = (0..count)
                .map(|i| {
                    sum += distribution(i);
                    sum
                })
                .collect();
            let sums = Sums::new(up_to.clone());
            let numbers = (0..=1000_u16).map(|k| f32::from(k) / 1000.0);
            let edges = (0..=1024_u16).flat_map(|k| {
                let at = f32::from(k) / 1024.0;
                [at.next_down().max(0.0), at, at.next_up().min(1.0)]
            });
            for number in numbers.chain(edges).chain((0..1000).map(|_| random.unit())) {
                let (i, part) = sums.pick(number);
                let among_all = up_to.partition_point(|sum| *sum <= number * up_to[count - 1]).min(count - 1);
                assert_eq!(i, among_all, "{number} of {count}");
                assert!((0.0..=1.0).contains(&part));
            }
        }
    }
}
