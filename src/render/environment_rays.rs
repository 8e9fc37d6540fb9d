//! Occlusion of the surroundings of a point: rays towards their light, and the share of it that arrives.
//!
//! Without such rays the surroundings light every point unoccluded, which has an exact closed form. With them that light is
//! weakened by what the rays hit. The result is as unbiased as the closed form: each half of a point's rays corrects the closed
//! form by a factor that the other half estimates (a control variate whose factor comes from independent rays), so that fully
//! open and fully enclosed points show no noise at all. After E. Heitz, S. Hill, M. McGuire, "Combining Analytic Direct
//! Illumination and Stochastic Shadows" (2018), without the bias of its ratio.
//!
//! Directions are drawn from the cosine around the normal, from the lobe of a glossy surface and from the light of a panorama,
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

/// Strategies that draw a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum DirectionSampler {
    /// Cosine-weighted around the normal.
    Cosine,
    /// The GGX lobe of this α around the mirror direction.
    Lobe(f32),
    /// The light of the sky.
    Light,
    /// Cosine-weighted around the back of the normal, for translucent surfaces.
    Behind,
}

/// Points whose environment rays are queued. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct EnvironmentRays {
    points: Vec<Point>,
    /// Light that each ray brings if unoccluded: the two halves of each point's rays, one after the other.
    shares: Vec<Vec3>,
    arrived: Vec<Vec3>,
    shadows: ShadowQueue,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    sample: u32,
    /// Light that the sample receives from the point if nothing is occluded.
    open: Vec3,
}

/// A surface point that sends environment rays.
pub(crate) struct EnvironmentPoint<'a, G> {
    pub surface: &'a G,
    pub bsdf: &'a Bsdf,
    /// The ray that hit the point.
    pub ray: &'a Ray,
    /// Random numbers for the directions of the point's rays.
    pub draws: Draws,
    /// Throughput of the path up to the point.
    pub weight: Vec3,
    /// Light reflected from the unoccluded surroundings, not weighted by the throughput.
    pub open: Vec3,
    /// Media that the point is inside of, where these absorb light.
    pub media: Option<Media>,
}

impl EnvironmentRays {
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.shares.clear();
        self.shadows.clear();
    }

    /// Number of queued rays.
    pub(crate) fn len(&self) -> usize {
        self.shares.len()
    }

    /// Queues `context.env_rays` rays, each half from random numbers of its own.
    pub(crate) fn push<G: ShadingPoint>(&mut self, context: &Context, point: &EnvironmentPoint<G>) {
        let seen = point.surface.seen();
        let lobe = point.bsdf.gloss().map(|roughness| DirectionSampler::Lobe(roughness * roughness));
        let light = context.sky.is_map().then_some(DirectionSampler::Light);
        let behind = point.bsdf.is_translucent().then_some(DirectionSampler::Behind);
        // With few rays the first strategies get them; no other strategy finds what lies behind.
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
                // The shading normal and the face may disagree on the side.
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

    /// Traces all rays and passes the light of each point to `arrive` as (sample, light), always in the same order.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        context: &Context,
        media: &mut MediaTable,
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

/// Estimates the visible part of `open` from the light that each half of the rays sent, and the light that came through.
fn let_through(open: Vec3, sent: [Vec3; 2], come: [Vec3; 2]) -> Vec3 {
    let share = |i: usize| {
        let part = |come: f32, sent: f32| if sent > 0.0 { come / sent } else { 1.0 };
        Vec3::new(part(come[i].x, sent[i].x), part(come[i].y, sent[i].y), part(come[i].z, sent[i].z))
    };
    let corrected = |own: usize, other: usize| come[own] + share(other) * (open * 0.5 - sent[own]);
    corrected(0, 1) + corrected(1, 0)
}

/// Frame of the normal, and the view direction.
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

    /// Probability density of `dir`, 1/sr; `light` is the density of drawing it by the light of the sky.
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
        // Light with density 2x over 0 … 1, hidden beyond 0.6: 0.6² = 0.36 of it arrives.
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
