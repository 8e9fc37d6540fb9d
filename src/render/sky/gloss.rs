//! Glossy reflections of a panorama without a ray: lookups along the directions in which microfacets mirror the view.

use super::lookups::{LOOKUPS, Lookups, Row};
use super::panorama::Pyramid;
use crate::math::Vec3;
use crate::math::simd::{Kernel, Level, Simd};
use crate::render::optics::reflect;
use crate::render::shade::{Lobe, pattern};
use crate::render::sobol::mix;
use std::f32::consts::PI;
use std::sync::LazyLock;

/// Filter width of a lookup, over the square root of its share of the sphere: as wide as lookups are apart.
const HILL: f32 = 0.75;

/// Pattern that the microfacets are drawn with.
static PATTERN: LazyLock<[Row; 3]> = LazyLock::new(|| pattern(0.0));

/// Slopes along two axes of microfacets that stand for equal shares of a GGX distribution of width 1.
static SLOPES: LazyLock<[Row; 2]> = LazyLock::new(|| {
    /// Inverse of the golden ratio: turns that never coincide.
    const GOLDEN: f32 = 0.618_034;
    let part = |k: usize| (k as f32 + 0.5) / LOOKUPS as f32;
    let slope = |k: usize, axis: f32| axis * (part(k) / (1.0 - part(k))).sqrt();
    let turn = |k: usize| libm::sincosf(2.0 * PI * (k as f32 * GOLDEN).fract());
    [std::array::from_fn(|k| slope(k, turn(k).1)), std::array::from_fn(|k| slope(k, turn(k).0))]
});

/// Rotation and shift of the pattern at a point of a surface.
#[derive(Clone, Copy)]
struct Turn {
    /// Cosine and sine of the turn.
    around: [f32; 2],
    /// Shift, as a fraction of a share.
    shift: f32,
}

impl Turn {
    /// Hashes the turn from all bits of a lobe and its `view`: the error of so few lookups at a small sun then is noise, which
    /// more samples lessen and which pixels can estimate, and no pattern on the surface.
    fn of(lobe: &Lobe, view: Vec3) -> Self {
        let bits = [lobe.facet(view, [0.5; 2]), view].into_iter().flat_map(|v| v.to_array().map(f32::to_bits));
        let seed = bits.fold(0, mix);
        #[expect(clippy::cast_precision_loss, reason = "24 bits are exact")]
        let unit = |salt: u32| (mix(seed, salt) >> 8) as f32 / (1 << 24) as f32;
        let (sin, cos) = libm::sincosf(2.0 * PI * unit(0));
        Self { around: [cos, sin], shift: unit(1) - 0.5 }
    }
}

/// Looks up the directions in which microfacets of `lobe` mirror `view`.
struct LookUpLobe<'a, F> {
    sky: &'a Pyramid,
    lobe: &'a Lobe,
    view: Vec3,
    turn: Turn,
    to_map: F,
}

impl<F: Fn(Vec3) -> Vec3> Kernel for LookUpLobe<'_, F> {
    type Output = Option<Vec3>;

    // The lanes are plain arrays: the token `S` only tells which instructions the compiler may use.
    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Option<Vec3> {
        let Self { sky, lobe, view, turn: Turn { around: [c, s], shift }, to_map } = self;
        let (lobe, [at, cos, sin]) = (*lobe, &*PATTERN);
        // Mirrored directions, in the panorama's frame, by axis.
        let mut dirs = [[0.0; LOOKUPS]; 3];
        let mut to = Lookups::NONE;
        for k in 0..LOOKUPS {
            let turned = [c * cos[k] - s * sin[k], s * cos[k] + c * sin[k]];
            let facet = lobe.facet_turned(view, at[k] + shift / LOOKUPS as f32, turned);
            let dir = reflect(-view, facet);
            let area = 1.0 / (LOOKUPS as f32 * lobe.density(view, facet));
            to.weight[k] = lobe.sent(view, dir);
            to.angle[k] = HILL * area.min(4.0 * PI).sqrt();
            let dir = to_map(dir);
            (dirs[0][k], dirs[1][k], dirs[2][k]) = (dir.x, dir.y, dir.z);
        }
        to.look_along(&dirs);
        to.mean(&sky.soft)
    }
}

impl Pyramid {
    /// Mean radiance in the lobe of a rough mirror that sends the view along `dir`, viewed along its own normal.
    ///
    /// Directions are drawn from the GGX distribution, each looked up with a blur that matches the local sample density (J.
    /// Křivánek, M. Colbert, "Real-time Shading with Filtered Importance Sampling", 2008).
    pub(super) fn blurred(&self, dir: Vec3, roughness: f32) -> Vec3 {
        let alpha = roughness * roughness;
        // A lobe narrower than a texel is not blurred.
        if 2.0 * alpha < self.finest() {
            return self.radiance(dir, 0.0);
        }
        let mean = Level::best().run(LookAround { sky: self, dir, alpha });
        mean.unwrap_or_else(|| self.radiance(dir, PI))
    }

    /// Mean radiance that microfacets of `lobe` mirror to `view`, masking and shadowing included; `to_map` turns directions into
    /// the panorama's frame. `None` where the lobe is narrower than a texel, or no facet mirrors anything.
    ///
    /// Facets are drawn by their visible area, and each direction is looked up with a blur that matches the local sample density
    /// (J. Křivánek, M. Colbert, "Real-time Shading with Filtered Importance Sampling", 2008). A table of lobes around the
    /// mirrored direction, as in games, has another shape: on rough surfaces it shows a small sun with an error of a quarter.
    pub(super) fn mirrored(&self, lobe: &Lobe, view: Vec3, to_map: impl Fn(Vec3) -> Vec3) -> Option<Vec3> {
        if lobe.angle(1) < self.finest() {
            return None;
        }
        Level::best().run(LookUpLobe { sky: self, lobe, view, turn: Turn::of(lobe, view), to_map })
    }
}

/// Looks up directions around `dir`, as widely as facets of width `alpha` spread the view along their normal.
struct LookAround<'a> {
    sky: &'a Pyramid,
    dir: Vec3,
    alpha: f32,
}

impl Kernel for LookAround<'_> {
    type Output = Option<Vec3>;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Option<Vec3> {
        let Self { sky, dir, alpha } = self;
        let [along, across] = &*SLOPES;
        let (tangent, bitangent) = dir.any_orthonormal_pair();
        let mut dirs = [[0.0; LOOKUPS]; 3];
        let mut to = Lookups::NONE;
        for k in 0..LOOKUPS {
            let (x, y) = (along[k] * alpha, across[k] * alpha);
            let cosine = 1.0 / (1.0 + x * x + y * y).sqrt();
            let half = (dir + tangent * x + bitangent * y) * cosine;
            let light = half * (2.0 * cosine) - dir;
            to.weight[k] = light.dot(dir).max(0.0);
            // Each lookup stands for an equal share of the lobe: the thinner the distribution, the larger its part of the sphere.
            let f = cosine * cosine * (alpha * alpha - 1.0) + 1.0;
            let density = alpha * alpha / (PI * f * f) / 4.0;
            to.angle[k] = (1.0 / (LOOKUPS as f32 * density)).sqrt();
            (dirs[0][k], dirs[1][k], dirs[2][k]) = (light.x, light.y, light.z);
        }
        to.look_along(&dirs);
        to.mean(&sky.levels)
    }
}

#[cfg(test)]
mod tests {
    use super::super::panorama::Level;
    use super::{Lobe, Pyramid, Vec3, reflect};
    use crate::scene::Panorama;
    use std::sync::Arc;

    const SIZE: (u32, u32) = (256, 128);

    fn pyramid(texel: impl Fn(Vec3) -> [f32; 3]) -> Pyramid {
        let grid = Level::without_texels(SIZE);
        let texels = grid.middles().map(|(_, dir)| texel(dir)).collect();
        let (width, height) = SIZE;
        Pyramid::new(&Panorama { name: String::new(), width, height, texels: Arc::new(texels), ..Panorama::default() })
    }

    /// A gradient and a sun, 3° wide, that gives as much light as all the rest.
    fn sunny() -> Pyramid {
        let sun = Vec3::new(0.55, 0.62, 0.45).normalize();
        pyramid(|dir| {
            let off = sun.cross(dir).length().atan2(sun.dot(dir)).to_degrees() / 1.5;
            let shine = 700.0 * (-0.5 * off * off).exp();
            [0.3 + 0.2 * dir.y + shine, 0.3, 0.5 - 0.2 * dir.y]
        })
    }

    /// Mean over the lobe, summed over all texels.
    fn integral(sky: &Pyramid, lobe: &Lobe, normal: Vec3, view: Vec3) -> f32 {
        let grid = Level::without_texels(SIZE);
        let (mut sum, mut total) = (0.0, 0.0);
        for (row, to) in grid.middles().filter(|(_, to)| to.dot(normal) > 0.0) {
            let facet = (view + to).normalize();
            let weight = f64::from(lobe.density(view, facet) * lobe.sent(view, to) * grid.area(row));
            sum += weight * f64::from(sky.radiance(to, 0.0).x);
            total += weight;
        }
        (sum / total) as f32
    }

    /// Normals seen from +z, all around and up to 72° off.
    fn normals() -> impl Iterator<Item = Vec3> {
        (0..48u8).map(|k| {
            let (sin, cos) = libm::sincosf(f32::from(k) * 2.4);
            let polar = libm::sincosf((f32::from(k) * 1.5).to_radians());
            Vec3::new(polar.0 * cos, polar.0 * sin, polar.1)
        })
    }

    #[test]
    fn an_even_sky_is_even_in_every_lobe() {
        let sky = pyramid(|_| [2.0, 1.0, 0.5]);
        for (roughness, normal) in [0.2f32, 0.5, 1.0].into_iter().flat_map(|r| normals().map(move |n| (r, n))) {
            let lobe = Lobe::even(normal, roughness * roughness);
            let seen = sky.mirrored(&lobe, Vec3::Z, |dir| dir).expect("wider than a texel");
            assert!((seen - Vec3::new(2.0, 1.0, 0.5)).length() < 1e-4, "{roughness} {normal}: {seen}");
        }
        assert!(sky.mirrored(&Lobe::even(Vec3::Z, 1e-3), Vec3::Z, |dir| dir).is_none());
    }

    #[test]
    fn what_lookups_miss_of_a_small_sun_is_lessened_by_more_samples_around() {
        let sky = sunny();
        let mut worst = 0.0_f32;
        // Normals whose lobe contains the sun.
        for normal in normals().filter(|n| n.dot(Vec3::new(0.55, 0.62, 1.45).normalize()) > 0.9) {
            let samples = (0..64u8).map(|k| {
                let (sin, cos) = libm::sincosf(f32::from(k));
                let normal = (normal + Vec3::new(cos, sin, 0.0) * 1e-4).normalize();
                let lobe = Lobe::even(normal, 0.25);
                sky.mirrored(&lobe, Vec3::Z, |dir| dir).expect("wider than a texel").x / 64.0
            });
            let expected = integral(&sky, &Lobe::even(normal, 0.25), normal, Vec3::Z);
            worst = worst.max((samples.sum::<f32>() / expected - 1.0).abs());
        }
        assert!(worst > 0.0 && worst < 0.06, "{worst}");
    }

    #[test]
    fn a_small_sun_shows_in_rough_lobes_as_their_integrals_say() {
        let sky = sunny();
        let (mut found, mut good) = (Vec::new(), true);
        for (roughness, most, part) in [(0.3f32, 0.08, 0.8), (0.5, 0.12, 0.75), (0.8, 0.15, 0.6)] {
            let (mut off, mut total, mut around) = (0.0, 0.0, 0.0);
            for normal in normals() {
                let lobe = Lobe::even(normal, roughness * roughness);
                let expected = integral(&sky, &lobe, normal, Vec3::Z);
                let shown = sky.mirrored(&lobe, Vec3::Z, |dir| dir).expect("wider than a texel").x;
                let table = sky.blurred(reflect(Vec3::NEG_Z, normal), roughness).x;
                off += (shown - expected) * (shown - expected);
                around += (table - expected) * (table - expected);
                total += expected * expected;
            }
            let (off, around) = ((off / total).sqrt(), (around / total).sqrt());
            found.push((roughness, off, around));
            good &= off < most && off < part * around;
        }
        assert!(good, "roughness, error, error around the mirrored direction: {found:?}");
    }
}
