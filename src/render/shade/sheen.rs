//! Sheen of cloth: fibres that stick out of a surface (KHR_materials_sheen).
//!
//! A. C. Estevez, C. Kulla, "Production Friendly Microfacet Sheen BRDF" (2017), with the visibility of D. Neubelt and M.
//! Pettineo, "Crafting a Next-Gen Material Pipeline for The Order: 1886" (2013). The light that the fibres reflect is subtracted
//! from the layers below.

use super::{Reader, ShadingFrame, Sky};
use crate::math::Vec3;
use crate::math::formula::{power, sin_cos_of_turns};
use crate::math::simd::{Kernel, Level, Simd};
use crate::scene::Sheen;
use std::f32::consts::PI;
use std::sync::OnceLock;

/// Number of entries of [`ALBEDO`] by roughness and by N·V.
const ENTRIES: usize = 33;

/// Directional albedo of the white lobe: rows by roughness 0 … 1, columns by the square root of N·V 0 … 1, as it changes most
/// where N·V is small. Each row is computed on first use.
static ALBEDO: [OnceLock<[f32; ENTRIES]>; ENTRIES] = [const { OnceLock::new() }; ENTRIES];

/// Lower bound of the roughness of the lobe.
const LEAST_ROUGHNESS: f32 = 0.07;

/// Lower bound of the roughness of environment lookups: the lobe is wide even where it is weak.
const WIDE: f32 = 0.5;

/// Sheen at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SheenLobe {
    pub color: Vec3,
    pub roughness: f32,
    /// Directional albedo of the fibres for this view, before colour.
    pub albedo: f32,
}

impl SheenLobe {
    /// No fibres.
    pub(crate) const NONE: Self = Self { color: Vec3::ZERO, roughness: 1.0, albedo: 0.0 };

    /// `None` where there are none; `n_v` is the cosine of the view.
    pub(super) fn new(sheen: &Sheen, n_v: f32, reader: &Reader) -> Option<Self> {
        let color = (sheen.color * reader.srgb(sheen.color_map.as_ref())).clamp(Vec3::ZERO, Vec3::ONE);
        let roughness = (sheen.roughness * reader.alpha(sheen.roughness_map.as_ref())).clamp(0.0, 1.0);
        (color != Vec3::ZERO).then(|| Self { color, roughness, albedo: albedo(roughness, n_v) })
    }

    /// Share of the light from below that passes through.
    #[inline(always)]
    pub(crate) fn clear(&self) -> f32 {
        1.0 - self.color.max_element() * self.albedo
    }

    /// BRDF × N·L; unit vectors, away from the surface.
    #[inline(always)]
    pub(crate) fn lit(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        let (n_l, n_v) = (normal.dot(to_light), normal.dot(view));
        if n_l <= 0.0 || n_v <= 0.0 {
            return Vec3::ZERO;
        }
        let half = (view + to_light).normalize_or(normal);
        self.color * (lobe(alpha(self.roughness), normal.cross(half).length(), n_l, n_v) * n_l)
    }

    /// Light of the environment that it reflects.
    pub(super) fn ambient(&self, seen: &ShadingFrame, sky: &Sky, ambient: Vec3) -> Vec3 {
        self.around(sky.blurred(seen.mirrored(), Self::blur(self.roughness)) + ambient)
    }

    /// Roughness of a mirror with the same blur as fibres of this roughness.
    #[inline(always)]
    pub(crate) fn blur(roughness: f32) -> f32 {
        roughness.max(WIDE)
    }

    /// Reflection of this mean radiance around the mirrored view.
    #[inline(always)]
    pub(crate) fn around(&self, light: Vec3) -> Vec3 {
        self.color * self.albedo * light
    }
}

/// Parameter α of the lobe.
#[inline(always)]
fn alpha(roughness: f32) -> f32 {
    let r = roughness.max(LEAST_ROUGHNESS);
    r * r
}

/// Distribution × visibility; `sine` is that of the angle between half vector and normal.
#[inline(always)]
fn lobe(alpha: f32, sine: f32, n_l: f32, n_v: f32) -> f32 {
    let exponent = 1.0 / alpha;
    let distribution = (2.0 + exponent) * power(sine, exponent) / (2.0 * PI);
    distribution / (4.0 * (n_l + n_v - n_l * n_v))
}

/// Kernel for ∫ BRDF N·L over the hemisphere by midpoints, at most 1, for [`ENTRIES`] N·V from 0 to 1.
struct Integral {
    alpha: f32,
}

/// Rows and columns of directions over one half of the hemisphere; the other is its mirror image.
const ROWS: usize = 40;
const COLUMNS: usize = 24;

impl Kernel for Integral {
    type Output = [f32; ENTRIES];

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> [f32; ENTRIES] {
        let mut around = [[0.0; COLUMNS]; 2];
        let [x, y] = &mut around;
        for (j, (x, y)) in x.iter_mut().zip(y).enumerate() {
            (*y, *x) = sin_cos_of_turns((j as f32 + 0.5) / COLUMNS as f32 / 2.0);
        }
        std::array::from_fn(|entry| {
            let n_v = (part(entry) * part(entry)).max(1e-3);
            let view = Vec3::new((1.0 - n_v * n_v).sqrt(), 0.0, n_v);
            let mut sums = [0.0; COLUMNS];
            for i in 0..ROWS {
                let (sin, cos) = sin_cos_of_turns((i as f32 + 0.5) / ROWS as f32 / 4.0);
                for j in 0..COLUMNS {
                    let half = Vec3::new(sin * around[0][j], sin * around[1][j], cos) + view;
                    let sine = (half.truncate().length_squared() / half.length_squared()).sqrt();
                    sums[j] += lobe(self.alpha, sine, cos, n_v) * cos * sin;
                }
            }
            let sum: f32 = sums.iter().sum();
            (sum * (PI / 2.0 / ROWS as f32) * (2.0 * PI / COLUMNS as f32)).min(1.0)
        })
    }
}

/// Roughness, or square root of N·V, of an entry of [`ALBEDO`].
#[inline(always)]
fn part(entry: usize) -> f32 {
    entry as f32 / (ENTRIES - 1) as f32
}

/// [`ALBEDO`], interpolated between its entries.
fn albedo(roughness: f32, n_v: f32) -> f32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "lies among the entries")]
    let place = |x: f32| {
        let x = x.clamp(0.0, 1.0) * (ENTRIES - 1) as f32;
        let i = (x as usize).min(ENTRIES - 2);
        (i, x - i as f32)
    };
    let ((i, a), (j, b)) = (place(roughness), place(n_v.max(0.0).sqrt()));
    let [lower, upper] = [i, i + 1].map(|i| {
        let row = row(i);
        row[j] + (row[j + 1] - row[j]) * b
    });
    lower + (upper - lower) * a
}

/// A row of [`ALBEDO`].
fn row(i: usize) -> &'static [f32; ENTRIES] {
    ALBEDO[i].get_or_init(|| Level::best().run(Integral { alpha: alpha(part(i)) }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(roughness: f32, n_v: f32) -> SheenLobe {
        SheenLobe { color: Vec3::ONE, roughness, albedo: albedo(roughness, n_v) }
    }

    #[test]
    fn no_more_is_sent_back_than_arrives_and_rough_fibres_send_back_most_where_they_are_grazed() {
        for row in (0..ENTRIES).map(row) {
            assert!(row.iter().all(|a| (0.0..=1.0).contains(a)), "{row:?}");
        }
        for roughness in [0.3, 0.6, 1.0] {
            assert!(albedo(roughness, 0.1) > 2.0 * albedo(roughness, 1.0), "{roughness}");
        }
        assert!(albedo(1.0, 1.0) > albedo(0.4, 1.0));
    }

    #[test]
    fn the_table_is_near_the_integral_also_of_thin_fibres_that_are_grazed() {
        for (roughness, n_v) in
            [(0.1, 0.1), (0.2, 0.1), (0.11, 0.09), (0.05, 0.3), (0.3, 0.03), (0.6, 0.5), (0.97, 0.8)]
        {
            let view = Vec3::new((1.0_f32 - n_v * n_v).sqrt(), 0.0, n_v);
            let (rows, columns, mut sum) = (512, 256, 0.0);
            for i in 0..rows {
                let (sin, cos) = libm::sincosf((i as f32 + 0.5) / rows as f32 * PI / 2.0);
                for j in 0..columns {
                    let (y, x) = libm::sincosf((j as f32 + 0.5) / columns as f32 * PI);
                    let sine = (Vec3::new(sin * x, sin * y, cos) + view).normalize().truncate().length();
                    sum += f64::from(lobe(alpha(roughness), sine, cos, n_v) * cos * sin);
                }
            }
            let exact = (sum as f32 * PI * PI / (rows * columns) as f32).min(1.0);
            let found = albedo(roughness, n_v);
            assert!((found - exact).abs() < 0.045, "{roughness} {n_v}: {found} instead of {exact}");
        }
    }

    #[test]
    fn light_and_eye_can_change_places() {
        let at = |degrees: f32| {
            let (sin, cos) = libm::sincosf(degrees.to_radians());
            Vec3::new(sin, 0.0, cos)
        };
        let cloth = white(0.5, 0.7);
        let (a, b) = (at(20.0), at(-70.0));
        let there = cloth.lit(Vec3::Z, a, b).x / b.z;
        let back = cloth.lit(Vec3::Z, b, a).x / a.z;
        assert!((there - back).abs() < 1e-5 && there > 0.0);
        assert_eq!(cloth.lit(Vec3::Z, a, at(100.0)), Vec3::ZERO, "behind the surface");
    }

    #[test]
    fn what_fibres_send_back_is_taken_off_what_is_below() {
        let cloth = SheenLobe { color: Vec3::new(0.5, 0.0, 0.0), ..white(0.8, 0.2) };
        assert!((cloth.clear() + 0.5 * cloth.albedo - 1.0).abs() < 1e-6);
        assert!(cloth.clear() < 1.0);
    }
}
