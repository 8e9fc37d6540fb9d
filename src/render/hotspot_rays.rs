//! Rays from rough surfaces to the hotspot of a panorama.
//!
//! Few of the rays that a rough surface spreads would hit the sun, and each of these would be far too bright. So each spread ray
//! is paired with one to the hotspot, weighted by the light that facets reflect from there to the viewer, and the spread ray sees
//! the rest of the sky (P. Shirley, C. Wang, K. Zimmerman, "Monte Carlo Techniques for Direct Lighting Calculations", 1996).
//! Transmitting facets refract as in B. Walter, S. R. Marschner, H. Li, K. E. Torrance, "Microfacet Models for Refraction through
//! Rough Surfaces" (2007).

use super::branch::{PathVertex, Rough, ShadingPoint};
use super::context::Context;
use super::draws::Purpose;
use super::media::{Crossing, Media};
use super::observer::Observer;
use super::optics::reflect;
use super::shade::{Lobe, ShadingFrame, above};
use super::wave::RayClass;
use super::whitted::Tracer;
use crate::accel::Accel;
use crate::math::Vec3;

/// Which of the rays that a surface spreads have had the hotspot sampled separately.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct HotspotSampled {
    pub mirrored: bool,
    pub through: bool,
}

impl HotspotSampled {
    /// Selects rays that go on in empty space, unless they see something other than the sky there. Rays between the walls of
    /// glass are refracted again before they leave it.
    fn of<G: ShadingPoint>(context: &Context, point: &PathVertex<G>, crossing: &Crossing, lobe: &Lobe) -> Self {
        let sees_background = point.path.straight && crossing.n_i == crossing.n_t && !context.shows_environment;
        match context.sky.hotspot() {
            // A lobe narrower than the sun shows all of it or nothing, and needs no help.
            Some(area) if lobe.solid_angle() > area => Self {
                mirrored: point.path.media == Media::OUTSIDE,
                through: crossing.beyond == Media::OUTSIDE && !sees_background,
            },
            _ => Self::default(),
        }
    }
}

impl<A: Accel, P: Observer> Tracer<'_, A, P> {
    /// Pairs each ray that a surface spreads with one to the hotspot; returns for which kinds of rays that was done.
    pub(super) fn sample_hotspot<G: ShadingPoint>(
        &mut self,
        point: &PathVertex<G>,
        crossing: &Crossing,
        rough: &Rough,
    ) -> HotspotSampled {
        let context = self.context;
        let sampled = HotspotSampled::of(context, point, crossing, &rough.lobe);
        // Under dispersion each band has facets of its own.
        if sampled == HotspotSampled::default() || self.splits(point) {
            return HotspotSampled::default();
        }
        let spread = self.draws(point, Purpose::Hotspot).spread(rough.rays);
        let (seen, part) = (point.surface.seen(), 1.0 / rough.rays as f32);
        for k in 0..rough.rays {
            let Some((dir, radiance)) = context.sky.to_hotspot(spread.point(k)) else { continue };
            let mirrors = seen.normal.dot(dir) > 0.0;
            if !(if mirrors { sampled.mirrored } else { sampled.through }) {
                continue;
            }
            let shown = if mirrors {
                mirrored(point, crossing, &rough.lobe, dir)
            } else {
                let_through(point, crossing, &rough.lobe, dir)
            };
            let light = point.path.weight * shown * radiance * part;
            if light.is_finite() && context.sky.is_worth_a_ray(light, context.cutoff_of(point.path.part * part)) {
                let media = if mirrors { point.path.media } else { crossing.beyond };
                let media = context.absorption.is_some().then_some(media);
                // The shading normal and the face may disagree on the side.
                let (class, side) = if mirrors {
                    (RayClass::Reflected, seen.geometric)
                } else {
                    (RayClass::Refracted, -seen.geometric)
                };
                let (ray, left) = point.start(class, above(dir, side));
                self.hotspots.push_unbent(ray, left, light, media);
            }
        }
        sampled
    }
}

/// Share of light from `dir` that the facets of a lobe reflect to the view, 1/sr.
fn mirrored<G: ShadingPoint>(point: &PathVertex<G>, crossing: &Crossing, lobe: &Lobe, dir: Vec3) -> Vec3 {
    let ShadingFrame { normal, view, .. } = point.surface.seen();
    from_both_sides(normal, dir, |dir| {
        let Some((facet, density)) = lobe.facet_to(view, dir) else { return Vec3::ZERO };
        point.bsdf.bounce_weights(view.dot(facet), crossing).mirrored(lobe.sent(view, dir)) * density
    })
}

/// Share of light from `dir` that the facets transmit to the view, 1/sr.
fn let_through<G: ShadingPoint>(point: &PathVertex<G>, crossing: &Crossing, lobe: &Lobe, dir: Vec3) -> Vec3 {
    let ShadingFrame { normal, view, .. } = point.surface.seen();
    from_both_sides(normal, dir, |dir| {
        let facet = if crossing.n_i == crossing.n_t {
            // Thin: as a mirror does, on the other side.
            lobe.facet_to(view, reflect(dir, normal))
        } else {
            lobe.facet_through(view, dir, (crossing.n_i, crossing.n_t))
        };
        let Some((facet, density)) = facet else { return Vec3::ZERO };
        point.bsdf.bounce_weights(view.dot(facet), crossing).refracted * density
    })
}

/// Sums the two kinds of facets that send light to `dir`: light that a facet would send to the wrong side of the surface is sent
/// to the right side instead ([`above`]).
fn from_both_sides(normal: Vec3, dir: Vec3, turned_to: impl Fn(Vec3) -> Vec3) -> Vec3 {
    turned_to(dir) + turned_to(reflect(dir, normal))
}

impl Lobe {
    /// The facet that reflects `dir` to the view, and the density of such directions, 1/sr.
    fn facet_to(&self, view: Vec3, dir: Vec3) -> Option<(Vec3, f32)> {
        let facet = (view + dir).try_normalize()?;
        (view.dot(facet) > 0.0 && self.is_on_front(facet)).then(|| (facet, self.density(view, facet)))
    }

    /// The facet that refracts the view to `dir` on the other side, between media of these indices, and the density of such
    /// directions, 1/sr.
    fn facet_through(&self, view: Vec3, dir: Vec3, (n_i, n_t): (f32, f32)) -> Option<(Vec3, f32)> {
        let facet = (view * n_i + dir * n_t).try_normalize()?;
        let facet = if self.is_on_front(facet) { facet } else { -facet };
        let (near, far) = (view.dot(facet), dir.dot(facet));
        if near <= 0.0 || far >= 0.0 {
            return None;
        }
        // Density of facets, not of reflected directions.
        let facets = self.density(view, facet) * 4.0 * near;
        let across = n_i * near + n_t * far;
        Some((facet, facets * n_t * n_t * -far / (across * across)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::optics::refract;
    use std::f32::consts::PI;

    /// Fraction of drawn facets that send the view to within 8° of a direction, and the fraction that their density predicts.
    fn within(
        lobe: &Lobe,
        view: Vec3,
        dir: Vec3,
        send: impl Fn(Vec3) -> Option<Vec3>,
        density: impl Fn(Vec3) -> f32,
    ) -> [f32; 2] {
        let (count, least) = (40_000_u16, libm::cosf(8.0_f32.to_radians()));
        let at = |k: u16| [(f32::from(k) + 0.5) / f32::from(count), (f32::from(k) * 0.618_034).fract()];
        let drawn = (0..count).filter_map(|k| send(lobe.facet(view, at(k)))).filter(|to| to.dot(dir) > least).count();
        let (tangent, bitangent) = dir.any_orthonormal_pair();
        let area = 2.0 * PI * (1.0 - least);
        let of_density = (0..count).map(at).map(|[u, v]| {
            let (cosine, (sin, cos)) = (1.0 - u * (1.0 - least), libm::sincosf(2.0 * PI * v));
            density(dir * cosine + (tangent * cos + bitangent * sin) * (1.0 - cosine * cosine).sqrt())
        });
        [drawn as f32 / f32::from(count), of_density.sum::<f32>() / f32::from(count) * area]
    }

    #[test]
    fn facets_send_rays_as_densely_as_they_are_said_to() {
        let axes = [Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0)];
        for (alpha, tilt) in [([0.1, 0.1], 0.0_f32), ([0.3, 0.3], 0.7), ([0.4, 0.1], 0.5), ([0.8, 0.8], 1.2)] {
            let lobe = Lobe::new(axes, Vec3::Z, alpha);
            let view = Vec3::new(libm::sinf(tilt), 0.0, libm::cosf(tilt));
            for off in [0.0, 0.3] {
                let facet = Vec3::new(off * 0.5, off, 1.0).normalize();
                let to = reflect(-view, facet);
                let mirrors = |facet: Vec3| Some(reflect(-view, facet));
                let [drawn, said] =
                    within(&lobe, view, to, mirrors, |to| lobe.facet_to(view, to).map_or(0.0, |(_, d)| d));
                assert!((drawn - said).abs() < 0.02 * said + 0.001, "{alpha:?} {tilt} {off}: {drawn} {said}");
                for (n_i, n_t) in [(1.0, 1.5), (1.5, 1.0), (1.33, 1.6)] {
                    let bend = |facet: Vec3| refract(-view, facet, f64::from(n_i), f64::from(n_t));
                    let Some(to) = bend(facet) else { continue };
                    let density = |to: Vec3| lobe.facet_through(view, to, (n_i, n_t)).map_or(0.0, |(_, d)| d);
                    let [drawn, said] = within(&lobe, view, to, bend, density);
                    assert!(
                        (drawn - said).abs() < 0.02 * said + 0.001,
                        "{alpha:?} {tilt} {off} {n_i} {n_t}: {drawn} {said}"
                    );
                }
            }
        }
    }
}
