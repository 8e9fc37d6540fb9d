//! A panorama and its mip levels, looked up at any blur.

use super::diffuse;
use crate::math::Vec3;
use crate::math::formula::{atan2, floor_of_one, log2};
use crate::scene::Panorama;
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

/// Mip levels of a panorama, each half as large as the one before.
#[derive(Clone, Debug)]
pub(super) struct Pyramid {
    pub levels: Vec<Level>,
    /// The same sizes, each but the first a tent-filtered mean of the one before: a small sun keeps its position in all of them.
    pub soft: Vec<Level>,
    diffuse: Level,
}

/// One mip level.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub width: u32,
    pub height: u32,
    texels: Arc<Vec<[f32; 3]>>,
}

impl Pyramid {
    /// Builds the levels of a panorama that has texels.
    pub(super) fn new(panorama: &Panorama) -> Self {
        let Panorama { width, height, texels, .. } = panorama;
        let levels = Level { width: *width, height: *height, texels: Arc::clone(texels) }.halves();
        let mut soft = vec![levels[0].clone()];
        for (i, to) in levels[1..].iter().enumerate() {
            soft.push(soft[i].softened((to.width, to.height)));
        }
        let mut pyramid =
            Self { levels, soft, diffuse: Level { width: 1, height: 1, texels: Arc::new(vec![[0.0; 3]]) } };
        pyramid.diffuse = diffuse::table(&pyramid);
        pyramid
    }

    /// Whether it was made of the texels of this panorama.
    pub(super) fn is_of(&self, panorama: &Panorama) -> bool {
        let Level { width, height, texels } = &self.levels[0];
        (*width, *height) == (panorama.width, panorama.height) && Arc::ptr_eq(texels, &panorama.texels)
    }

    /// Builds the levels for [`Self::radiance`] alone.
    pub(super) fn sharp(level: Level) -> Self {
        let nothing = Level { width: 1, height: 1, texels: Arc::new(vec![[0.0; 3]]) };
        Self { levels: level.halves(), soft: Vec::new(), diffuse: nothing }
    }

    /// Angle across a texel of the finest level, radians.
    pub(super) fn finest(&self) -> f32 {
        self.levels[0].angle()
    }

    /// Finest level with at most `columns` columns.
    pub(super) fn at_most(&self, columns: u32) -> &Level {
        let last = self.levels.len() - 1;
        &self.levels[self.levels.iter().position(|level| level.width <= columns).unwrap_or(last)]
    }

    /// Mean radiance in a cone `angle` radians across.
    pub(super) fn radiance(&self, dir: Vec3, angle: f32) -> Vec3 {
        let ((fine, part), at) = (self.level(angle), coordinates(dir));
        let sharp = self.copy(fine).at(at);
        if part == 0.0 { sharp } else { sharp.lerp(self.copy(fine + 1).at(at), part) }
    }

    /// Index of the mip level whose texels are as wide as a cone of this angle or the next finer, and the interpolation weight of
    /// the level after it.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the levels there are")]
    pub(super) fn level(&self, angle: f32) -> (usize, f32) {
        let finest = self.finest();
        let level = if angle > finest { log2(angle / finest) } else { 0.0 };
        let level = level.clamp(0.0, (self.levels.len() - 1) as f32);
        (level as usize, level - (level as usize) as f32)
    }

    /// Mip level by index, clamped to the last.
    pub(super) fn copy(&self, number: usize) -> &Level {
        &self.levels[number.min(self.levels.len() - 1)]
    }

    /// Cosine-weighted mean radiance around a normal.
    pub(super) fn diffuse(&self, normal: Vec3) -> Vec3 {
        self.diffuse.at(coordinates(normal))
    }
}

/// Coordinates of a direction in a panorama: 0 … 1 around the horizon, and 0 … 1 from the zenith down.
#[inline(always)]
pub(super) fn coordinates(dir: Vec3) -> (f32, f32) {
    let around = atan2(dir.z, dir.x) / (2.0 * PI) + 0.5;
    let down = atan2((dir.x * dir.x + dir.z * dir.z).sqrt(), dir.y) / PI;
    (around, down)
}

impl Level {
    /// A level of this size without texels, for its geometry.
    pub(super) fn without_texels((width, height): (u32, u32)) -> Self {
        Self { width, height, texels: Arc::default() }
    }

    /// This level with other texels, row by row.
    pub(super) fn made_of(self, texels: Vec<[f32; 3]>) -> Self {
        Self { texels: Arc::new(texels), ..self }
    }

    /// This level and all smaller ones, each half as large as the one before.
    fn halves(self) -> Vec<Self> {
        std::iter::successors(Some(self), Self::halved).collect()
    }

    /// Radiance and solid angle of each texel, row by row.
    pub(super) fn each(&self) -> impl Iterator<Item = (Vec3, f32)> + '_ {
        let row = move |row: u32| (0..self.width).map(move |column| (self.texel(column, row), self.area(row)));
        (0..self.height).flat_map(row)
    }

    /// This level with each texel mapped.
    pub(super) fn with(&self, texel: impl Fn(Vec3) -> Vec3) -> Self {
        let texels = self.texels.iter().map(|&light| texel(light.into()).to_array()).collect();
        Self { texels: Arc::new(texels), ..*self }
    }

    /// Height of a texel as an angle, radians.
    pub(super) fn angle(&self) -> f32 {
        PI / self.height as f32
    }

    /// Solid angle of a texel in this row, sr.
    pub(super) fn area(&self, row: u32) -> f32 {
        self.area_between(f64::from(row), f64::from(row + 1))
    }

    /// Solid angle of a strip as wide as a texel, between two rows (fractional).
    fn area_between(&self, from: f64, to: f64) -> f32 {
        let edge = |row: f64| libm::cos(std::f64::consts::PI * row / f64::from(self.height));
        #[expect(clippy::cast_possible_truncation, reason = "an area of the unit sphere")]
        let ring = (edge(from) - edge(to)) as f32;
        ring * 2.0 * PI / self.width as f32
    }

    /// All texels, row by row.
    #[inline(always)]
    pub(super) fn texels(&self) -> &[[f32; 3]] {
        &self.texels
    }

    pub(super) fn texel(&self, column: u32, row: u32) -> Vec3 {
        let i = row as usize * self.width as usize + column as usize;
        self.texels.get(i).map_or(Vec3::ZERO, |&texel| Vec3::from(texel))
    }

    /// Column and row of the texel that contains a direction.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the texels there are")]
    pub(super) fn nearest(&self, dir: Vec3) -> (u32, u32) {
        let (x, y) = coordinates(dir);
        let (x, y) = (x * self.width as f32, y * self.height as f32);
        ((x as u32).min(self.width - 1), (y as u32).min(self.height - 1))
    }

    /// Unit direction at these coordinates, in texels.
    pub(super) fn direction(&self, x: f32, y: f32) -> Vec3 {
        let (sin, cos) = libm::sincosf((x / self.width as f32 - 0.5) * 2.0 * PI);
        let (sin_down, cos_down) = libm::sincosf(y / self.height as f32 * PI);
        Vec3::new(sin_down * cos, cos_down, sin_down * sin)
    }

    /// Row and direction of the middle of each texel.
    #[cfg(test)]
    pub(super) fn middles(&self) -> impl Iterator<Item = (u32, Vec3)> + '_ {
        let row = move |y: u32| (0..self.width).map(move |x| (y, self.direction(x as f32 + 0.5, y as f32 + 0.5)));
        (0..self.height).flat_map(row)
    }

    /// Bilinear interpolation at a place, both coordinates 0 … 1.
    pub(super) fn at(&self, (x, y): (f32, f32)) -> Vec3 {
        let (width, height) = (self.width.cast_signed(), self.height.cast_signed());
        let (x, y) = (x * self.width as f32 - 0.5, y * self.height as f32 - 0.5);
        let (left, top) = (floor_of_one(x), floor_of_one(y));
        #[expect(clippy::cast_possible_truncation, reason = "a column and a row, or one before")]
        let (column, row) = (left as i32, top as i32);
        // At most one turn beyond.
        let around = |column: i32| if column >= width { column - width } else { column };
        let near = around(if column < 0 { column + width } else { column });
        let mixed = |row: i32| {
            // Beyond a pole lies the same row, half a turn away.
            let (row, turn) = match row {
                ..0 => (0, width / 2),
                row if row >= height => (height - 1, width / 2),
                row => (row, 0),
            };
            let texel = |column: i32| self.texel(around(column + turn).cast_unsigned(), row.cast_unsigned());
            texel(near).lerp(texel(around(near + 1)), x - left)
        };
        mixed(row).lerp(mixed(row + 1), y - top)
    }

    /// Downscales with a tent filter, weighted by solid angle: light goes to the texels that it would be interpolated from, so
    /// that its centroid stays in place.
    fn softened(&self, (width, height): (u32, u32)) -> Self {
        let taps = |i: u32, from: u32, to: u32| {
            let step = from as f32 / to as f32;
            let middle = (i as f32 + 0.5) * step - 0.5;
            // Taps at both ends may have no weight.
            #[expect(clippy::cast_possible_truncation, reason = "texels of a side")]
            let within = (middle - step).ceil() as i32..=(middle + step).floor() as i32;
            let share = move |k: i32| (1.0 - (k as f32 - middle).abs() / step).max(0.0);
            within.map(move |k| (k, share(k))).filter(|(_, share)| *share > 0.0).collect::<Vec<_>>()
        };
        let around = |k: i32| k.rem_euclid(self.width.cast_signed()).cast_unsigned();
        let columns: Vec<_> = (0..width).map(|x| taps(x, self.width, width)).collect();
        let row = |y: u32| {
            // Beyond a pole lies the same row, half a turn away.
            let over = |k: i32| match k {
                k if k < 0 => ((-1 - k).cast_unsigned().min(self.height - 1), self.width / 2),
                k => match (self.height - 1).checked_sub(k.cast_unsigned()) {
                    Some(_) => (k.cast_unsigned(), 0),
                    None => ((2 * self.height - 1).saturating_sub(k.cast_unsigned()), self.width / 2),
                },
            };
            let rows: Vec<_> = taps(y, self.height, height).into_iter().map(|(k, share)| (over(k), share)).collect();
            let rows: Vec<_> = rows.into_iter().map(|(place, share)| (place, share * self.area(place.0))).collect();
            let texel = |columns: &Vec<(i32, f32)>| {
                let (mut sum, mut total) = (Vec3::ZERO, 0.0);
                for &((row, turn), weight) in &rows {
                    for &(column, share) in columns {
                        sum += self.texel((around(column) + turn) % self.width, row) * (weight * share);
                        total += weight * share;
                    }
                }
                (sum / total).to_array()
            };
            columns.iter().map(texel).collect::<Vec<_>>()
        };
        let texels = (0..height).into_par_iter().flat_map_iter(row).collect();
        Self { width, height, texels: Arc::new(texels) }
    }

    /// Half as large, each texel the mean of those it covers by solid angle; `None` for a single texel.
    fn halved(&self) -> Option<Self> {
        if self.width <= 1 && self.height <= 1 {
            return None;
        }
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let columns: Vec<_> = (0..width).map(|x| covered(x, self.width, width).collect::<Vec<_>>()).collect();
        let row = |y: u32| {
            let area = |(row, from, to): (u32, f64, f64)| (row, self.area_between(from, to));
            let rows: Vec<(u32, f32)> = covered(y, self.height, height).map(area).collect();
            let texel = move |columns: &Vec<(u32, f64, f64)>| {
                let (mut sum, mut areas) = (Vec3::ZERO, 0.0);
                for &(row, area) in &rows {
                    for &(column, from, to) in columns {
                        #[expect(clippy::cast_possible_truncation, reason = "a share")]
                        let area = area * (to - from) as f32;
                        sum += self.texel(column, row) * area;
                        areas += area;
                    }
                }
                (sum / areas).to_array()
            };
            columns.iter().map(texel).collect::<Vec<_>>()
        };
        let texels = (0..height).into_par_iter().flat_map_iter(row).collect();
        Some(Self { width, height, texels: Arc::new(texels) })
    }
}

/// Source texels, of `from` in a row, that texel `i` of `to` covers, each with the ends of the covered interval.
#[expect(clippy::cast_possible_truncation, reason = "texels of a side")]
fn covered(i: u32, from: u32, to: u32) -> impl Iterator<Item = (u32, f64, f64)> {
    let edge = move |i: u32| u64::from(i) * u64::from(from);
    let place = move |edge: u64| edge as f64 / f64::from(to);
    let (first, last) = (edge(i) / u64::from(to), edge(i + 1).div_ceil(u64::from(to)));
    (first as u32..last as u32).map(move |k| {
        let (begins, ends) = (place(edge(i)).max(f64::from(k)), place(edge(i + 1)).min(f64::from(k + 1)));
        (k, begins, ends)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pyramid(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> Pyramid {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        Pyramid::new(&Panorama { name: String::new(), width, height, texels: Arc::new(texels), ..Panorama::default() })
    }

    fn probes() -> impl Iterator<Item = Vec3> {
        let grid = Level { width: 12, height: 6, texels: Arc::default() };
        grid.middles().map(|(_, dir)| dir).collect::<Vec<_>>().into_iter().chain([Vec3::Y, Vec3::NEG_Y])
    }

    #[test]
    fn an_even_sky_is_even_at_every_blur_and_size() {
        let sizes = [(1, 1), (2, 1), (1, 8), (3, 2), (6, 3), (7, 3), (96, 48), (100, 51), (300, 150), (1000, 500)];
        for (width, height) in sizes {
            let sky = pyramid(width, height, |_, _| [2.0, 1.0, 0.5]);
            for dir in probes() {
                let sharp = [sky.radiance(dir, 0.3), sky.blurred(dir, 0.4), sky.blurred(dir, 1.0), sky.diffuse(dir)];
                for seen in sharp {
                    assert!((seen - Vec3::new(2.0, 1.0, 0.5)).length() < 1e-4, "{width}×{height} {dir}: {seen}");
                }
            }
        }
    }

    #[test]
    fn smaller_copies_of_any_size_have_the_light_of_their_places() {
        let light =
            |dir: Vec3| Vec3::new(1.0 + 0.6 * dir.x, 1.0 + 0.6 * dir.y, 1.0 + 0.4 * dir.z + 0.3 * dir.x * dir.y);
        // Mean over a texel, from places in it weighted by area.
        let mean = |level: &Level, column: u32, row: u32| {
            const PARTS: u8 = 12;
            let part = |k: u8| (f32::from(k) + 0.5) / f32::from(PARTS);
            let places = (0..PARTS).flat_map(|j| (0..PARTS).map(move |i| (i, j)));
            let (sum, areas) = places.fold((Vec3::ZERO, 0.0), |(sum, areas), (i, j)| {
                let dir = level.direction(column as f32 + part(i), row as f32 + part(j));
                let area = dir.x.hypot(dir.z);
                (sum + light(dir) * area, areas + area)
            });
            sum / areas
        };
        for (width, height) in [(1024, 512), (1000, 500), (1022, 511), (300, 150), (960, 480)] {
            let grid = Level { width, height, texels: Arc::default() };
            let sky = pyramid(width, height, |x, y| light(grid.direction(x as f32 + 0.5, y as f32 + 0.5)).to_array());
            for level in sky.levels.iter().filter(|level| (6..=64).contains(&level.height)) {
                for (column, row) in (0..level.height).map(|row| (row * 5 % level.width, row)) {
                    let off = (level.texel(column, row) - mean(level, column, row)).abs().max_element();
                    assert!(off < 0.01, "{width}×{height} at {}×{}: {off}", level.width, level.height);
                }
            }
        }
    }

    #[test]
    fn coordinates_and_directions_are_each_others_inverse() {
        let grid = Level { width: 64, height: 32, texels: Arc::default() };
        for (_, dir) in grid.middles() {
            let (x, y) = coordinates(dir);
            assert!((grid.direction(x * 64.0, y * 32.0) - dir).length() < 1e-5, "{dir}");
        }
    }

    #[test]
    fn the_texels_of_a_level_cover_the_sphere() {
        let grid = Level { width: 50, height: 31, texels: Arc::default() };
        let total: f32 = (0..31).map(|row| grid.area(row) * 50.0).sum();
        assert!((total - 4.0 * PI).abs() < 1e-4);
    }

    #[test]
    fn a_sun_lights_by_its_area_and_the_cosine_to_it() {
        // One bright texel of 256 × 128, 1.4° wide: low, near the zenith, and never in the middle of any larger cell.
        for (column, row) in [(128, 63), (37, 58), (201, 6), (90, 120)] {
            let sky = pyramid(256, 128, |x, y| if (x, y) == (column, row) { [1000.0; 3] } else { [0.0; 3] });
            let sun = sky.levels[0].direction(column as f32 + 0.5, row as f32 + 0.5);
            let irradiance = 1000.0 * sky.levels[0].area(row) / PI;
            let beside = sun.any_orthonormal_vector();
            let turned = [0.0f32, 30.0, 60.0, 85.0, 120.0].map(|degrees| {
                let (sin, cos) = libm::sincosf(degrees.to_radians());
                sun * cos + beside * sin
            });
            for normal in turned.into_iter().chain([Vec3::Y, Vec3::NEG_Y, Vec3::X]) {
                let (shown, expected) = (sky.diffuse(normal).x, irradiance * sun.dot(normal).max(0.0));
                assert!((shown - expected).abs() < 0.015 * irradiance, "{column} {row} {normal}: {shown} {expected}");
            }
        }
    }

    #[test]
    fn a_rough_lobe_is_near_its_integral() {
        let sky = pyramid(256, 128, |x, y| {
            let bright = (100..140).contains(&x) && (30..60).contains(&y);
            if bright { [8.0, 4.0, 2.0] } else { [0.2 + 0.001 * x as f32, 0.1, 0.3] }
        });
        let grid = Level { width: 256, height: 128, texels: Arc::default() };
        for roughness in [0.25f32, 0.5, 0.8] {
            let alpha2 = f64::from(roughness).powi(4);
            let (mut worst, mut all, mut count) = (0.0f64, 0.0, 0.0);
            for mirror in probes() {
                let (mut sum, mut weights) = (0.0, 0.0);
                for (row, dir) in grid.middles() {
                    let cosine = f64::from(dir.dot(mirror)).max(0.0);
                    let f = 0.5 * (1.0 + cosine) * (alpha2 - 1.0) + 1.0;
                    let weight = alpha2 / (f * f) * cosine * f64::from(grid.area(row));
                    sum += weight * f64::from(sky.levels[0].at(coordinates(dir)).x);
                    weights += weight;
                }
                let error = (f64::from(sky.blurred(mirror, roughness).x) * weights / sum - 1.0).abs();
                worst = worst.max(error);
                all += error;
                count += 1.0;
            }
            assert!(worst < 0.4 && all / count < 0.1, "{roughness}: {worst} at worst, {} on average", all / count);
        }
    }
}
