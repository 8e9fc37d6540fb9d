//! Anisotropic surfaces, brushed metal above all: light is spread farther along the grain than across it
//! (KHR_materials_anisotropy).
//!
//! B. Burley, "Physically Based Shading at Disney" (2012) for the distribution of facets, E. Heitz, "Understanding the
//! Masking-Shadowing Function" (2014) for their masking.

use super::highlight::{NARROWEST_HIGHLIGHT, least_square};
use super::metal_rough::above;
use super::{Lobe, Reader, ShadingFrame, Sky};
use crate::math::formula::atan2;
use crate::math::simd::{Kernel, Level, Simd};
use crate::math::{Vec2, Vec3};
use crate::render::lobe_frame::LobeFrame;
use crate::render::optics::reflect;
use crate::render::studio;
use crate::scene::{Anisotropy, UpAxis};
use std::f32::consts::PI;

/// Number of environment lookups along the grain.
const LOOKUPS: usize = 32;

/// Anisotropic lobe at one point.
#[derive(Clone, Debug)]
pub(crate) struct AnisotropicLobe {
    /// Unit vectors along and across the grain, on the surface.
    along: Vec3,
    across: Vec3,
    /// Widths α of the facet distribution along and across.
    alpha: [f32; 2],
    /// Lower bound of their squares in highlights of lights.
    least_square: f32,
}

impl AnisotropicLobe {
    /// Lobe of a surface with this roughness across the grain; `None` where it has no grain.
    pub(super) fn new(anisotropy: &Anisotropy, roughness: f32, on: &LobeFrame, reader: &Reader) -> Option<Self> {
        // The middle value of a map is no direction; without a map the grain runs along the tangent.
        let texel = match &anisotropy.map {
            Some(map) => reader.linear(Some(map)).truncate() * Vec3::new(2.0, 2.0, 1.0) - Vec3::new(1.0, 1.0, 0.0),
            None => Vec3::new(1.0, 0.0, 1.0),
        };
        let strength = (anisotropy.strength * texel.z).clamp(0.0, 1.0);
        let (sin, cos) = libm::sincosf(anisotropy.rotation);
        let direction = Vec2::new(cos, sin).rotate(texel.truncate()).try_normalize()?;
        if strength == 0.0 {
            return None;
        }
        let [tangent, bitangent] = on.tangents(anisotropy.map.as_ref());
        let along = tangent * direction.x + bitangent * direction.y;
        Some(Self::in_frame(along, on.normal.cross(along), strength, roughness))
    }

    fn in_frame(along: Vec3, across: Vec3, strength: f32, roughness: f32) -> Self {
        let r = roughness.max(NARROWEST_HIGHLIGHT);
        let narrow = r * r;
        Self { along, across, alpha: [narrow + (1.0 - narrow) * strength * strength, narrow], least_square: 0.0 }
    }

    /// Perceptual roughness along the grain.
    pub(super) fn roughness(&self) -> f32 {
        self.alpha[0].sqrt()
    }

    /// Facets of the lobe.
    pub(super) fn lobe(&self, normal: Vec3) -> Lobe {
        Lobe::new([self.along, self.across], normal, self.alpha)
    }

    /// Widens the highlights of lights to this α².
    pub(super) fn widen_highlight(&mut self, to: f32) {
        self.least_square = least_square(self.alpha[1].sqrt(), to);
    }

    /// [`Self::highlight`], widened.
    pub(super) fn widened(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> f32 {
        let alpha = self.alpha.map(|a| (a * a).max(self.least_square).sqrt());
        Self { alpha, ..self.clone() }.highlight(normal, view, to_light)
    }

    /// Distribution × visibility for a light without extent, before Fresnel; all unit vectors, on the front.
    pub(super) fn highlight(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> f32 {
        self.lobe(normal).highlight(view, to_light)
    }

    /// Mean radiance of the environment mirrored by facets that lean along the grain, each blurred by the roughness across.
    pub(super) fn mirrored(&self, seen: &ShadingFrame, sky: &Sky) -> Vec3 {
        let level = Level::best();
        let mut leans = Leans::default();
        level.run(Lean { anisotropy: self, seen, to: &mut leans });
        if let Some(up) = sky.studio() {
            level.run(LookUp { leans: &mut leans, up });
        }
        let Leans { dirs: [x, y, z], blur, share, studio } = &leans;
        let (mut sum, mut shares) = (Vec3::ZERO, 0.0);
        for k in (0..LOOKUPS).filter(|&k| share[k] > 0.0) {
            let light = match sky.studio() {
                Some(_) => Vec3::splat(studio[k]),
                None => sky.blurred(Vec3::new(x[k], y[k], z[k]), blur[k]),
            };
            sum += light * share[k];
            shares += share[k];
        }
        if shares > 0.0 { sum / shares } else { sky.blurred(seen.mirrored(), self.roughness()) }
    }
}

/// One value of every lookup.
type Row = [f32; LOOKUPS];

/// Lookups by facets that lean along a grain.
#[derive(Default)]
struct Leans {
    /// Mirrored directions, by axis.
    dirs: [Row; 3],
    /// Roughness of a mirror with the same blur.
    blur: Row,
    /// Weight; 0 for facets that are not visible.
    share: Row,
    /// Radiance in that direction, in the studio.
    studio: Row,
}

/// Kernel that places facets for equal shares of a grain's distribution.
struct Lean<'a> {
    anisotropy: &'a AnisotropicLobe,
    seen: &'a ShadingFrame,
    to: &'a mut Leans,
}

impl Kernel for Lean<'_> {
    type Output = ();

    // The lanes are plain arrays: the token `S` only tells which instructions the compiler may use.
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { anisotropy, seen, to } = self;
        let (along, seen, [wide, narrow]) = (anisotropy.along, *seen, anisotropy.alpha);
        let spread = (wide * wide - narrow * narrow).max(0.0).sqrt();
        // Slopes that cut the distribution along one axis, α² / 2 (α² + s²)^³⁄₂, into equal parts.
        let slope = |part: f32| spread * part / (1.0 - part * part).max(f32::MIN_POSITIVE).sqrt();
        let part = |k: usize| (2 * k + 1) as f32 / LOOKUPS as f32 - 1.0;
        let mut edges = [-PI / 2.0; LOOKUPS + 1];
        for k in 0..LOOKUPS {
            edges[k + 1] = atan2(slope(part(k) + 1.0 / LOOKUPS as f32), 1.0);
        }
        for k in 0..LOOKUPS {
            // Wide enough that neighbours meet: a lookup reaches as far as its part of the slopes.
            to.blur[k] = narrow.max(edges[k + 1] - edges[k]).sqrt();
            let half = (seen.normal + along * slope(part(k))).normalize_or(seen.normal);
            to.share[k] = half.dot(seen.view).max(0.0);
            let dir = above(reflect(-seen.view, half), seen.geometric);
            (to.dirs[0][k], to.dirs[1][k], to.dirs[2][k]) = (dir.x, dir.y, dir.z);
        }
    }
}

/// Kernel that looks all of them up in the studio.
struct LookUp<'a> {
    leans: &'a mut Leans,
    up: UpAxis,
}

impl Kernel for LookUp<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        // The axis is matched outside the loop, which is then branch-free.
        match self.up {
            UpAxis::Y => self.leans.look_up(UpAxis::Y),
            UpAxis::Z => self.leans.look_up(UpAxis::Z),
        }
    }
}

impl Leans {
    #[inline(always)]
    fn look_up(&mut self, up: UpAxis) {
        let Self { dirs: [x, y, z], blur, studio: to, .. } = self;
        for k in 0..LOOKUPS {
            let dir = studio::from_world(up, Vec3::new(x[k], y[k], z[k]));
            to[k] = studio::blurred(dir, blur[k]).x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::highlight::{highlight, squared_width};
    use super::*;
    use crate::scene::{Environment, Scene};

    fn at(degrees: f32, turn: f32) -> Vec3 {
        let ((sin, cos), (st, ct)) = (libm::sincosf(degrees.to_radians()), libm::sincosf(turn.to_radians()));
        Vec3::new(sin * ct, sin * st, cos)
    }

    fn anisotropy(strength: f32, roughness: f32) -> AnisotropicLobe {
        AnisotropicLobe::in_frame(Vec3::X, Vec3::Y, strength, roughness)
    }

    /// ∫ f(h) over the hemisphere by midpoints.
    fn over_hemisphere(f: impl Fn(Vec3) -> f64) -> f64 {
        let (rows, columns) = (1000u16, 200u16);
        let step = (90.0 / f32::from(rows), 360.0 / f32::from(columns));
        let mut sum = 0.0;
        for i in 0..rows {
            let polar = (f32::from(i) + 0.5) * step.0;
            let ring = f64::from(libm::sinf(polar.to_radians()));
            sum += (0..columns).map(|j| f(at(polar, (f32::from(j) + 0.5) * step.1)) * ring).sum::<f64>();
        }
        sum * f64::from(step.0.to_radians()) * f64::from(step.1.to_radians())
    }

    #[test]
    fn facets_cover_the_surface_once() {
        for (strength, roughness) in [(0.0, 0.4), (0.5, 0.3), (1.0, 0.5), (0.7, 0.8)] {
            let anisotropy = anisotropy(strength, roughness);
            let covered = over_hemisphere(|h| f64::from(anisotropy.lobe(Vec3::Z).facets(h) * h.z));
            assert!((covered - 1.0).abs() < 0.01, "{strength} {roughness}: {covered}");
        }
    }

    #[test]
    fn without_strength_it_is_the_lobe_of_surfaces_without_a_grain() {
        let (view, light) = (at(30.0, 10.0), at(50.0, 130.0));
        let (own, expected) = (
            anisotropy(0.0, 0.4).highlight(Vec3::Z, view, light),
            highlight(Vec3::Z, (view + light).normalize(), [light.z, view.z], squared_width(0.4)),
        );
        assert!((own / expected - 1.0).abs() < 1e-4, "{own} {expected}");
    }

    #[test]
    fn highlights_are_long_along_the_grain() {
        let anisotropy = anisotropy(0.8, 0.2);
        let along = anisotropy.highlight(Vec3::Z, Vec3::Z, at(50.0, 0.0));
        let across = anisotropy.highlight(Vec3::Z, Vec3::Z, at(50.0, 90.0));
        assert!(along > 20.0 * across, "{along} {across}");
    }

    #[test]
    fn seen_and_lit_can_change_places() {
        let (anisotropy, a, b) = (anisotropy(0.6, 0.3), at(25.0, 20.0), at(65.0, 250.0));
        let (there, back) = (anisotropy.highlight(Vec3::Z, a, b), anisotropy.highlight(Vec3::Z, b, a));
        assert!((there / back - 1.0).abs() < 1e-4);
    }

    #[test]
    fn an_even_sky_stays_even_and_the_studio_is_near_the_mean_over_the_lobe() {
        let seen = |view| ShadingFrame { normal: Vec3::Z, geometric: Vec3::Z, view, outside: true };
        let sky = |environment| Sky::new(&Scene { environment, ..Scene::default() });
        let (even, studio) = (sky(Environment::Constant(Vec3::ONE)), sky(Environment::Studio));
        for (strength, roughness) in [(0.5, 0.2), (0.9, 0.3), (1.0, 0.6)] {
            for view in [at(0.0, 0.0), at(45.0, 30.0), at(45.0, 90.0)] {
                let anisotropy = anisotropy(strength, roughness);
                assert!((anisotropy.mirrored(&seen(view), &even) - Vec3::ONE).length() < 1e-5);
                let lobe = |light: Vec3| f64::from(anisotropy.highlight(Vec3::Z, view, light) * light.z);
                let whole = over_hemisphere(lobe);
                let mean = over_hemisphere(|light| lobe(light) * f64::from(studio.radiance(light, 0.0).x)) / whole;
                let shown = f64::from(anisotropy.mirrored(&seen(view), &studio).x);
                assert!((shown / mean - 1.0).abs() < 0.35, "{strength} {roughness} {view}: {shown} for {mean}");
            }
        }
    }
}
