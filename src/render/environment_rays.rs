//! How much of its surroundings a point sees: rays to where light comes from, and what is left where they are stopped.
//!
//! Without such rays the surroundings light every point as if nothing stood in their way, which a formula tells exactly.
//! With them that light is weakened by what the rays find. The share that comes through is as right on average as the formula
//! is: each half of a
//! point's rays corrects what the other half makes of the formula (a control variate whose factor comes from independent
//! rays), so that points in the open and points shut in show no noise at all. After E. Heitz, S. Hill, M. McGuire,
//! "Combining Analytic Direct Illumination and Stochastic Shadows" (2018), without the bias of its ratio.
//!
//! Rays are drawn from the cosine around the normal, from the lobe of a rough mirror and from the light of a panorama,
//! weighted by the balance heuristic (E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997).

use super::branch::ShadingPoint;
use super::context::Context;
use super::draws::Draws;
use super::media::{Media, MediaTable};
use super::observer::Observer;
use super::optics::reflect;
use super::ray_caster::RayCaster;
use super::shade::{Bsdf, above};
use super::shadow::{Bound, ShadowQueue};
use super::sky::Sky;
use crate::accel::{Accel, Ray};
use crate::math::Vec3;
use std::f32::consts::PI;

/// Ways to draw a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum DirectionSampler {
    /// By the cosine from the normal.
    Cosine,
    /// By the facets of a rough mirror of this α.
    Lobe(f32),
    /// By the light of the sky.
    Light,
    /// By the cosine from the back of the normal, from where light is scattered through.
    Behind,
}

/// Points that wait for their rays. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct EnvironmentRays {
    points: Vec<Point>,
    /// What each ray brings if nothing is in the way: of each point first one half, then the other.
    shares: Vec<Vec3>,
    arrived: Vec<Vec3>,
    shadows: ShadowQueue,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    sample: u32,
    /// What it shows if nothing is in the way.
    open: Vec3,
}

/// A point of a surface that looks around.
pub(crate) struct EnvironmentPoint<'a, G> {
    pub surface: &'a G,
    pub bsdf: &'a Bsdf,
    /// The ray that found it.
    pub ray: &'a Ray,
    /// Numbers for the directions of its rays.
    pub draws: Draws,
    /// What its sample shows of it, of light of 1.
    pub weight: Vec3,
    /// What it shows of its surroundings if nothing is in the way, not weighted.
    pub open: Vec3,
    /// What it is inside of, where that absorbs light.
    pub media: Option<Media>,
}

impl EnvironmentRays {
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.shares.clear();
        self.shadows.clear();
    }

    /// Rays that wait.
    pub(crate) fn len(&self) -> usize {
        self.shares.len()
    }

    /// Sends `context.env_rays` rays, half of them each from numbers of its own.
    pub(crate) fn push<G: ShadingPoint>(&mut self, context: &Context, point: &EnvironmentPoint<G>) {
        let seen = point.surface.seen();
        let lobe = point.bsdf.gloss().map(|roughness| DirectionSampler::Lobe(roughness * roughness));
        let light = context.sky.is_map().then_some(DirectionSampler::Light);
        let behind = point.bsdf.is_translucent().then_some(DirectionSampler::Behind);
        // The first ones get a ray where there are few; what lies behind is found in no other way.
        let samplers = [Some(DirectionSampler::Cosine), behind, lobe, light];
        let count = 1 + u32::from(lobe.is_some()) + u32::from(light.is_some()) + u32::from(behind.is_some());
        let half = context.env_rays.div_ceil(2);
        let view = View::new(seen.normal, seen.view);
        let mut draws = point.draws.clone();
        for _ in 0..2 {
            let spread = draws.spread(half);
            for k in 0..half {
                let sampler = samplers.iter().flatten().nth((k % count) as usize).unwrap_or(&DirectionSampler::Cosine);
                let dir = sampler.draw(spread.point(k), &context.sky, &view);
                // Normals and the face itself may not agree on the side.
                let side =
                    if behind.is_some() && dir.dot(seen.normal) <= 0.0 { -seen.geometric } else { seen.geometric };
                let (radiance, drawn) = context.sky.drawn(dir);
                let density = |(i, sampler): (u32, &DirectionSampler)| {
                    let rays = half / count + u32::from(i < half % count);
                    rays as f32 * sampler.density(dir, drawn, &view)
                };
                let density: f32 = (0..).zip(samplers.iter().flatten()).map(density).sum();
                let shown = point.bsdf.lit_around(&seen, dir, radiance, context.scene.ambient);
                let share = shown * point.weight / (2.0 * density);
                let share = if share.is_finite() { share } else { Vec3::ZERO };
                if share.max_element() > 0.0 {
                    let ray = point.surface.ray(above(dir, side), point.ray.sample);
                    #[expect(clippy::cast_possible_truncation, reason = "few shares wait, see ENVIRONMENT_RAYS_LIMIT")]
                    let light = Bound { radiance: share, tag: self.shares.len() as u32 };
                    self.shadows.push_bound(ray, light, point.media);
                }
                self.shares.push(share);
            }
        }
        self.points.push(Point { sample: point.ray.sample, open: point.open * point.weight });
    }

    /// Traces all rays and hands what points show to `arrive`, as (sample, light) in an order that is always the same.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        (context, media): (&Context, &mut MediaTable),
        caster: &mut RayCaster<A>,
        probe: &mut P,
        mut arrive: impl FnMut(u32, Vec3),
    ) {
        if self.points.is_empty() {
            return;
        }
        self.arrived.clear();
        self.arrived.resize(self.shares.len(), Vec3::ZERO);
        let arrived = &mut self.arrived;
        self.shadows.trace(context, media, caster, probe, |tag, light| arrived[tag as usize] += light);
        let half = context.env_rays.div_ceil(2) as usize;
        let halves = self.shares.chunks_exact(2 * half).zip(self.arrived.chunks_exact(2 * half));
        for (point, (sent, come)) in self.points.iter().zip(halves) {
            let sums = |of: &[Vec3]| [of[..half].iter().sum::<Vec3>(), of[half..].iter().sum::<Vec3>()];
            arrive(point.sample, let_through(point.open, sums(sent), sums(come)));
        }
        self.clear();
    }
}

/// What is left of `open` when rays were sent with these sums of light, for each half, and these came through.
fn let_through(open: Vec3, sent: [Vec3; 2], come: [Vec3; 2]) -> Vec3 {
    let share = |i: usize| {
        let part = |come: f32, sent: f32| if sent > 0.0 { come / sent } else { 1.0 };
        Vec3::new(part(come[i].x, sent[i].x), part(come[i].y, sent[i].y), part(come[i].z, sent[i].z))
    };
    let corrected = |own: usize, other: usize| come[own] + share(other) * (open * 0.5 - sent[own]);
    corrected(0, 1) + corrected(1, 0)
}

/// The frame that directions are drawn in.
struct View {
    normal: Vec3,
    tangent: Vec3,
    bitangent: Vec3,
    view: Vec3,
}

impl View {
    fn new(normal: Vec3, view: Vec3) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        Self { normal, tangent, bitangent, view }
    }
}

impl DirectionSampler {
    fn draw(self, at: [f32; 2], sky: &Sky, view: &View) -> Vec3 {
        let around = |cosine: f32| {
            let (sin, cos) = libm::sincosf(2.0 * PI * at[1]);
            let ring = (1.0 - cosine * cosine).max(0.0).sqrt();
            view.normal * cosine + (view.tangent * cos + view.bitangent * sin) * ring
        };
        match self {
            Self::Cosine => around((1.0 - at[0]).sqrt()),
            Self::Lobe(alpha) => {
                let slope_squared = alpha * alpha * at[0] / (1.0 - at[0]);
                reflect(-view.view, around(1.0 / (1.0 + slope_squared).sqrt()))
            }
            Self::Light => sky.draw(at).unwrap_or(view.normal),
            Self::Behind => -around((1.0 - at[0]).sqrt()),
        }
    }

    /// 1/sr; `light` is that of drawing by the light of the sky.
    fn density(self, dir: Vec3, light: f32, view: &View) -> f32 {
        match self {
            Self::Cosine => view.normal.dot(dir).max(0.0) / PI,
            Self::Lobe(alpha) => {
                let half = (view.view + dir).normalize_or(view.normal);
                let (cosine, toward) = (half.dot(view.normal), half.dot(view.view));
                if cosine <= 0.0 || toward <= 0.0 {
                    return 0.0;
                }
                let f = cosine * cosine * (alpha * alpha - 1.0) + 1.0;
                alpha * alpha / (PI * f * f) * cosine / (4.0 * toward)
            }
            Self::Light => light,
            Self::Behind => (-view.normal.dot(dir)).max(0.0) / PI,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::scene::{Environment, Scene};

    #[test]
    fn in_the_open_all_comes_through_and_shut_in_nothing_does() {
        let (open, sent) = (Vec3::new(1.0, 2.0, 3.0), [Vec3::new(0.7, 0.9, 1.4), Vec3::new(0.3, 1.2, 1.5)]);
        assert!((let_through(open, sent, sent) - open).length() < 1e-6);
        assert_eq!(let_through(open, sent, [Vec3::ZERO; 2]), Vec3::ZERO);
        assert_eq!(let_through(open, [Vec3::ZERO; 2], [Vec3::ZERO; 2]), open);
    }

    #[test]
    fn what_comes_through_is_right_on_average_however_few_rays_there_are() {
        // Of light spread by x over 0 … 1 (∫ 2x = 1) the part beyond 0.6 is hidden: 1 − 0.6² = 0.64 of it.
        let mut random = Random::new(7);
        let mut half = || {
            let x = [random.unit(), random.unit()];
            let sent = x.map(|x| 0.5 * x);
            let come: f32 = x.iter().zip(sent).map(|(x, sent)| if *x < 0.6 { sent } else { 0.0 }).sum();
            (Vec3::splat(sent.iter().sum()), Vec3::splat(come))
        };
        let n = 200_000;
        let mut sum = 0.0;
        for _ in 0..n {
            let (a, b) = (half(), half());
            sum += f64::from(let_through(Vec3::ONE, [a.0, b.0], [a.1, b.1]).x);
        }
        assert!((sum / f64::from(n) - 0.36).abs() < 0.003, "{}", sum / f64::from(n));
    }

    #[test]
    fn drawn_directions_have_the_density_they_are_said_to_have() {
        let sky = Sky::new(&Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() });
        let normal = Vec3::new(0.3, -0.5, 0.8).normalize();
        let view = View::new(normal, Vec3::new(0.1, -0.2, 1.0).normalize());
        // ∫ (N·L)² over the hemisphere is 2π/3.
        for (sampler, side) in [
            (DirectionSampler::Cosine, 1.0),
            (DirectionSampler::Lobe(0.5), 1.0),
            (DirectionSampler::Lobe(0.9), 1.0),
            (DirectionSampler::Behind, -1.0),
        ] {
            let n = 40_000u16;
            let mut sum = 0.0;
            for k in 0..n {
                let at = [(f32::from(k) + 0.5) / f32::from(n), (f32::from(k) * 0.618_034).fract()];
                let dir = sampler.draw(at, &sky, &view);
                let density = sampler.density(dir, 0.0, &view);
                if density > 0.0 {
                    sum += f64::from((side * normal.dot(dir)).max(0.0).powi(2) / density);
                }
            }
            let mean = sum / f64::from(n) / (2.0 / 3.0 * std::f64::consts::PI);
            assert!((mean - 1.0).abs() < 0.03, "{sampler:?}: {mean}");
        }
    }
}
