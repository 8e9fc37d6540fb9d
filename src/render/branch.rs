//! Secondary rays of a shaded point: mirrored, refracted, split by wavelength, spread by roughness.

use super::context::Context;
use super::draws::{Purpose, SampleSet};
use super::glint::{self, MIRROR};
use super::hotspot_rays::HotspotSampled;
use super::media::{Crossing, MediaTable, Medium};
use super::observer::Observer;
use super::optics::{dispersed_index, reflect, refract};
use super::shade::{BounceWeights, Bsdf, Lobe, ShadingFrame, above, has_inside};
use super::wave::{Path, RayClass};
use super::whitted::Tracer;
use crate::accel::{Accel, Hit, NO_PRIM, Ray};
use crate::math::Vec3;
use crate::scene::Material;

/// What secondary rays need to know of the surface they start on.
pub(super) trait ShadingPoint {
    /// Index of the surface's material, and the material.
    fn material(&self) -> (u32, &Material);

    /// Normals and view direction at the point.
    fn seen(&self) -> ShadingFrame;

    /// Whether the front of the face was hit.
    fn is_front(&self) -> bool;

    /// Variation of the normal (before normal maps) across the ray's cone: the squares of the angles, summed over both axes.
    fn bend(&self, context: &Context) -> f32;

    /// Returns an unbounded ray from the point along `dir`, which has unit length.
    fn ray(&self, dir: Vec3, sample: u32) -> Ray;

    /// Returns the origin of rays towards `dir`, and where it would be if nothing were rounded.
    fn set_off(&self, dir: Vec3) -> [Vec3; 2];

    /// Prim that rays from the point cannot hit again; [`NO_PRIM`] on round shapes, which they may hit again.
    fn excluded(&self) -> u32;

    /// Returns a ray to the other side along `dir`, and the distance within which its hits still belong to this surface.
    ///
    /// The ray starts on this side: what touches the surface from behind, as a table touches a glass standing on it, may lie
    /// closer than the error of the hit point, and a ray that starts beyond that error would miss it. Only on round shapes, which
    /// the ray would hit again, does it start on the other side.
    fn ray_through(&self, dir: Vec3, sample: u32) -> (Ray, f32) {
        let exclude = self.excluded();
        if exclude == NO_PRIM {
            return (self.ray(dir, sample), 0.0);
        }
        let ([origin, start], normal) = (self.set_off(-dir), self.seen().geometric);
        // The distance to behind the surface is that to before it; twice both for safety.
        let room = 4.0 * (normal.dot(start - origin) / normal.dot(dir)).abs();
        (Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude, sample }, room)
    }
}

/// A shaded point and the ray that hit it.
pub(super) struct PathVertex<'a, G> {
    pub ray: &'a Ray,
    pub hit: &'a Hit,
    /// The path up to this point; its weight is that of the surface.
    pub path: Path,
    /// Width of the ray's cone at the point.
    pub width: f32,
    pub surface: &'a G,
    pub bsdf: &'a Bsdf,
    /// Whether the ray has crossed another surface at the same place just before.
    pub touches: bool,
}

impl<G: ShadingPoint> PathVertex<'_, G> {
    /// Returns the refractive indices on both sides for light of `band`.
    pub(super) fn crossing(&self, context: &Context, table: &mut MediaTable, band: Option<u8>) -> Crossing {
        let media = self.path.media;
        let Some((ior, dispersion)) = self.bsdf.refraction() else { return table.pass(media) };
        let band = band.and_then(|i| context.bands.get(usize::from(i)));
        let ior = match band {
            #[expect(clippy::cast_possible_truncation, reason = "indices are given in f32")]
            Some(b) if dispersion > 0.0 => {
                dispersed_index(f64::from(ior), f64::from(dispersion), f64::from(b.wavelength)) as f32
            }
            _ => ior,
        };
        table.cross(media, Medium { material: self.surface.material().0, ior }, self.surface.is_front())
    }

    pub(super) fn bounce_weights(&self, crossing: &Crossing) -> BounceWeights {
        self.bsdf.bounce_weights(self.cosine(), crossing)
    }

    /// Returns a ray that starts at the point, and the hit behind which it starts: see [`Queue`](super::wave::Queue).
    pub(super) fn start(&self, class: RayClass, dir: Vec3) -> (Ray, Hit) {
        // A ray that starts before this surface would also hit again the touching surface that it has just crossed.
        if class != RayClass::Refracted || self.touches {
            return (self.surface.ray(dir, self.ray.sample), Hit::MISS);
        }
        let (ray, room) = self.surface.ray_through(dir, self.ray.sample);
        (ray, Hit { t: room, ..*self.hit })
    }

    /// Cosine between the shading normal and the view direction.
    fn cosine(&self) -> f32 {
        let ShadingFrame { normal, view, .. } = self.surface.seen();
        normal.dot(view)
    }

    /// Returns the path of a ray that starts at the point; its direction turns by `factor` times the angle by which the normal
    /// turns.
    fn bounced(&self, context: &Context, weight: Vec3, factor: f32) -> Path {
        let depth = self.path.depth + 1;
        let cone_spread = glint::behind(self.surface.bend(context), self.path.cone_spread, factor);
        Path {
            weight,
            depth,
            straight: false,
            skips_hotspot: false,
            since: 0.0,
            cone_width: self.width,
            cone_spread,
            ..self.path
        }
    }
}

/// Microfacets of a rough surface at one point, and the rays that it spreads.
pub(super) struct Rough {
    pub lobe: Lobe,
    pub rays: u32,
    spread: SampleSet,
    /// Whether its mirrored rays, and its transmitted rays, skip the hotspot because that is sampled directly.
    hotspot_sampled: HotspotSampled,
}

impl<A: Accel, P: Observer> Tracer<'_, A, P> {
    /// Queues the secondary rays of a point that carry enough weight.
    pub(super) fn reflect_and_refract<G: ShadingPoint>(&mut self, point: &PathVertex<G>, crossing: &Crossing) {
        // Between equal indices a volume is clear, however rough its surface.
        let bends = crossing.n_i != crossing.n_t || !has_inside(point.surface.material().1);
        if let Some(lobe) = point.bsdf.lobe(point.surface.seen().normal).filter(|_| bends) {
            return self.spread(point, crossing, lobe);
        }
        let bounce_weights = point.bounce_weights(crossing);
        let weight = point.path.weight * bounce_weights.refracted;
        if !self.splits(point) || !self.context.is_alive(weight, point.path.part) {
            self.reflect(point, bounce_weights.reflected);
            return self.send_refracted(point, weight, crossing, point.path.band);
        }
        // White light splits: from here on each band of the spectrum has its own index, and its own reflected share.
        let cosine = point.cosine();
        let reflected = self.split_bounce_weights(point, cosine).reflected;
        self.reflect(point, reflected);
        for (i, band) in (0u8..).zip(&self.context.bands) {
            let crossing = point.crossing(self.context, &mut self.media, Some(i));
            let weight = point.path.weight * point.bsdf.bounce_weights(cosine, &crossing).refracted * band.color;
            self.send_refracted(point, weight, &crossing, Some(i));
        }
    }

    /// Returns the bounce weights of light of all wavelengths: the sum over the bands, each with its own index.
    fn split_bounce_weights<G: ShadingPoint>(&mut self, point: &PathVertex<G>, cosine: f32) -> BounceWeights {
        let mut all = BounceWeights::default();
        for (i, band) in (0u8..).zip(&self.context.bands) {
            let crossing = point.crossing(self.context, &mut self.media, Some(i));
            let bounce_weights = point.bsdf.bounce_weights(cosine, &crossing);
            all.reflected += bounce_weights.reflected * band.color;
            all.glass += bounce_weights.glass * band.color;
            all.refracted += bounce_weights.refracted * band.color;
        }
        all
    }

    /// Whether white light that enters here splits into bands.
    pub(super) fn splits<G>(&self, point: &PathVertex<G>) -> bool {
        let disperses = point.bsdf.refraction().is_some_and(|(_, dispersion)| dispersion > 0.0);
        disperses && point.bsdf.lets_light_in() && point.path.band.is_none()
    }

    /// Spreads rays over the reflection and transmission lobes of a rough surface: several at the first hit of a path, one at
    /// later hits.
    fn spread<G: ShadingPoint>(&mut self, point: &PathVertex<G>, crossing: &Crossing, lobe: Lobe) {
        let rays = if point.path.depth == 0 { self.context.gloss.rays } else { 1 };
        self.by_chance.get_mut(point.ray.sample as usize).into_iter().for_each(|by_chance| *by_chance = true);
        // Reflection and transmission use the same facets, so that no energy is lost between them.
        let splits = self.splits(point);
        #[expect(clippy::cast_possible_truncation, reason = "a handful")]
        let points = if splits { rays.max(self.context.bands.len() as u32) } else { rays };
        let spread = self.draws(point, Purpose::Facets).spread(points);
        let mut rough = Rough { lobe, rays, spread, hotspot_sampled: HotspotSampled::default() };
        rough.hotspot_sampled = self.sample_hotspot(point, crossing, &rough);
        self.send_coat(point);
        for k in 0..rays {
            self.send_off_facet(point, crossing, &rough, k);
        }
        if !splits {
            (0..rays).for_each(|k| self.send_through_facet(point, crossing, &rough, k, point.path.band, Vec3::ONE));
            return;
        }
        rough.rays = 1;
        for (k, band) in (0u8..).zip(&self.context.bands) {
            let crossing = point.crossing(self.context, &mut self.media, Some(k));
            self.send_through_facet(point, &crossing, &rough, u32::from(k), Some(k), band.color);
        }
    }

    /// Queues the `k`th ray, reflected off its facet.
    fn send_off_facet<G: ShadingPoint>(&mut self, point: &PathVertex<G>, crossing: &Crossing, rough: &Rough, k: u32) {
        let ShadingFrame { normal, geometric, view, .. } = point.surface.seen();
        let facet = rough.lobe.facet(view, rough.spread.point(k));
        let cosine = view.dot(facet);
        let bounce_weights = if self.splits(point) {
            self.split_bounce_weights(point, cosine)
        } else {
            point.bsdf.bounce_weights(cosine, crossing)
        };
        let mirrored = reflect(-view, facet);
        let share = bounce_weights.mirrored(rough.lobe.sent(view, mirrored));
        let to = above(mirrored, normal);
        if share != Vec3::ZERO && normal.dot(to) > 0.0 {
            let weight = point.path.weight * share * (1.0 / rough.rays as f32);
            self.send_spread(point, above(to, geometric), RayClass::Reflected, MIRROR, rough, |path| Path {
                weight,
                skips_hotspot: rough.hotspot_sampled.mirrored,
                ..path.turned(RayClass::Reflected, k + 1)
            });
        }
    }

    /// Queues the `k`th ray, transmitted through its facet.
    fn send_through_facet<G: ShadingPoint>(
        &mut self,
        point: &PathVertex<G>,
        crossing: &Crossing,
        rough: &Rough,
        k: u32,
        band: Option<u8>,
        color: Vec3,
    ) {
        let ShadingFrame { normal, geometric, view, .. } = point.surface.seen();
        let facet = rough.lobe.facet(view, rough.spread.point(k));
        let share = point.bsdf.bounce_weights(view.dot(facet), crossing).refracted;
        if !self.context.is_alive(point.path.weight * share * color, point.path.part) {
            return;
        }
        let (n_i, n_t) = (f64::from(crossing.n_i), f64::from(crossing.n_t));
        let bent = if crossing.n_i == crossing.n_t {
            // Thin: the two walls together spread light as a mirror does, on the other side.
            let mirrored = reflect(-view, facet);
            Some(mirrored - normal * (2.0 * normal.dot(mirrored)))
        } else {
            refract(-view, facet, n_i, n_t)
        };
        let Some(to) = bent.map(|to| above(to, -normal)) else { return };
        let weight = point.path.weight * share * color * (1.0 / rough.rays as f32);
        let media = crossing.beyond;
        let straight = point.path.straight && crossing.n_i == crossing.n_t;
        let turns = crossing.turns();
        self.send_spread(point, above(to, -geometric), RayClass::Refracted, turns, rough, |path| Path {
            weight,
            band,
            media,
            straight,
            skips_hotspot: rough.hotspot_sampled.through,
            ..path.turned(RayClass::Refracted, k + 1)
        });
    }

    fn send_spread<G: ShadingPoint>(
        &mut self,
        point: &PathVertex<G>,
        dir: Vec3,
        class: RayClass,
        turns: f32,
        rough: &Rough,
        finish: impl FnOnce(Path) -> Path,
    ) {
        let path = finish(point.bounced(self.context, Vec3::ZERO, turns));
        let part = path.part * (1.0 / rough.rays as f32);
        if !self.context.is_alive(path.weight, part) {
            return;
        }
        let mut path = Path { part, ..path };
        if !self.goes_on(point, &mut path) {
            return;
        }
        let angle = rough.lobe.angle(rough.rays) * self.context.gloss.width;
        let (cone_spread, scattered) = (path.cone_spread + angle, path.scattered + angle);
        let (ray, after) = point.start(class, dir);
        self.starting[class as usize].push(ray, Path { cone_spread, scattered, ..path }, after);
    }

    /// Queues the ray that the clear coat reflects.
    fn send_coat<G: ShadingPoint>(&mut self, point: &PathVertex<G>) {
        if let Some((coat, share)) = point.bsdf.coat_reflection() {
            self.send_reflected(point, coat, point.path.weight * share, point.path.band);
        }
    }

    /// Queues the rays reflected by the surface and by its clear coat: one ray where both have the same normal.
    fn reflect<G: ShadingPoint>(&mut self, point: &PathVertex<G>, reflected: Vec3) {
        let (weight, normal, band) = (point.path.weight, point.surface.seen().normal, point.path.band);
        match point.bsdf.coat_reflection() {
            Some((coat, share)) if coat == normal => {
                self.send_reflected(point, normal, weight * (reflected + share), band);
            }
            _ => {
                self.send_reflected(point, normal, weight * reflected, band);
                self.send_coat(point);
            }
        }
    }

    /// Whether a new branch survives Russian roulette, which adjusts its weight.
    fn goes_on<G>(&self, point: &PathVertex<G>, path: &mut Path) -> bool {
        self.roulette.spin(&self.streams, point.ray.sample, path)
    }

    fn send_reflected<G: ShadingPoint>(&mut self, point: &PathVertex<G>, normal: Vec3, weight: Vec3, band: Option<u8>) {
        if !self.context.is_alive(weight, point.path.part) {
            return;
        }
        let mut path = Path { band, ..point.bounced(self.context, weight, MIRROR).turned(RayClass::Reflected, 0) };
        if !self.goes_on(point, &mut path) {
            return;
        }
        let ShadingFrame { geometric, view, .. } = point.surface.seen();
        let dir = above(reflect(-view, normal), geometric);
        let ray = point.surface.ray(dir, point.ray.sample);
        self.starting[RayClass::Reflected as usize].push(ray, path, Hit::MISS);
    }

    fn send_refracted<G: ShadingPoint>(
        &mut self,
        point: &PathVertex<G>,
        weight: Vec3,
        crossing: &Crossing,
        band: Option<u8>,
    ) {
        if !self.context.is_alive(weight, point.path.part) {
            return;
        }
        let turn = band.map_or(0, |band| u32::from(band) + 1);
        // Equal indices do not bend the ray: the same ray goes on behind this hit.
        if crossing.n_i == crossing.n_t {
            let path = point.path.turned(RayClass::Refracted, turn);
            let mut path = Path { weight, band, depth: point.path.depth + 1, media: crossing.beyond, ..path };
            if !self.goes_on(point, &mut path) {
                return;
            }
            return self.continuing[RayClass::Refracted as usize].push_behind(*point.ray, path, *point.hit);
        }
        let ShadingFrame { normal, geometric, view, .. } = point.surface.seen();
        let (n_i, n_t) = (f64::from(crossing.n_i), f64::from(crossing.n_t));
        let Some(bent) = refract(-view, normal, n_i, n_t) else {
            // Total internal reflection, missed by rounding in the bounce weights.
            return self.send_reflected(point, normal, weight, band);
        };
        let dir = above(bent, -geometric);
        let path = point.bounced(self.context, weight, crossing.turns()).turned(RayClass::Refracted, turn);
        let mut path = Path { band, media: crossing.beyond, ..path };
        if !self.goes_on(point, &mut path) {
            return;
        }
        let (ray, after) = point.start(RayClass::Refracted, dir);
        self.starting[RayClass::Refracted as usize].push(ray, path, after);
    }
}
