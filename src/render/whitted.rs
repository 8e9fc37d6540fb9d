//! Whitted's ray tracer: a tree of reflected, refracted and shadow rays behind every point of the picture, grown wave by wave
//! instead of by recursion.
//!
//! T. Whitted, "An Improved Illumination Model for Shaded Display" (1980). A branch ends where its ray leaves the scene (it sees
//! the background or the environment), where its throughput falls below the cutoff, or at the maximum depth; a branch that is cut
//! adds black, and the test precedes the setup of a secondary ray. Depth counts bounces after the eye ray. Passing straight
//! through a surface that is absent, blended or seen from its invisible back is not a bounce.

use super::Progress;
use super::alpha_voids::Cones;
use super::branch::{PathVertex, ShadingPoint};
use super::by_class::ByClass;
use super::context::{Context, ENVIRONMENT_RAYS_LIMIT, FOLLOWERS, SHADOW_LIMIT};
use super::draws::{Draws, Purpose, Stream};
use super::environment_rays::{EnvironmentPoint, EnvironmentRays};
use super::glint;
use super::layers::FirstSurface;
use super::media::{Crossing, MediaTable, Medium};
use super::no_prune::look_up_in_vain;
use super::observer::Observer;
use super::primary_rays::{PrimaryQuery, PrimaryRays};
use super::ray_caster::RayCaster;
use super::roulette::Roulette;
use super::shade::{Bsdf, Incident, LocalLight, Reader};
use super::shade_hits::ShadingBuffers;
use super::shadow::ShadowQueue;
use super::sobol::mix;
use super::surface::{HitPrim, Surface};
use super::wave::{Path, Queue, RayClass, Wave};
use crate::accel::{Accel, Hit, HitQueries, IntersectFilter, Ray};
use crate::math::{DVec3, Vec3};
use bytemuck::{Pod, Zeroable};
use std::hint::black_box;

/// Cone spread, radians, above which a path counts as spread by rough surfaces.
pub(super) const SPREAD: f32 = 0.1;
/// Most rays traced together; bounds the memory of a worker.
const WAVE_LIMIT: usize = 1 << 13;
/// Branch number of a ray that goes on behind a surface.
const ON: u32 = u32::MAX >> 2;

/// Light gathered by a sample of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Sample {
    pub radiance: Vec3,
    /// Share of the background that shows through.
    pub through: Vec3,
}

/// One worker: its buffers are reused from tile to tile.
pub(crate) struct Tracer<'a, A: Accel, P> {
    pub(super) context: &'a Context<'a>,
    caster: RayCaster<'a, A>,
    pub primary_rays: PrimaryRays,
    /// New rays, by class.
    pub(super) starting: [Queue; 3],
    /// Rays that continue behind a hit, by class.
    pub(super) continuing: [Queue; 3],
    wave: Wave,
    /// Media that rays are inside of.
    pub(super) media: MediaTable,
    pub(super) buffers: ShadingBuffers,
    pub(super) shadows: ShadowQueue,
    /// Rays to the hotspot of the sky.
    pub(super) hotspots: ShadowQueue,
    environment_rays: EnvironmentRays,
    pub samples: Vec<Sample>,
    /// Position of each sample among those of its pixel; empty where random choices depend on rays alone.
    pub streams: Vec<Stream>,
    /// Russian roulette for branches.
    pub roulette: Roulette,
    /// Whether random choices spread the rays of each sample; empty where they never do.
    pub by_chance: Vec<bool>,
    /// The first surface of each sample; empty unless layers are wanted.
    pub firsts: Vec<FirstSurface>,
    pub counts: ByClass<P>,
}

/// A ray and its hit.
pub(super) struct Arrival<'a> {
    pub ray: &'a Ray,
    pub hit: &'a Hit,
    /// Whether the ray has crossed another surface at the same place just before.
    pub touches: bool,
}

impl<'a, A: Accel, P: Observer> Tracer<'a, A, P> {
    pub(crate) fn new(context: &'a Context<'a>, accel: &'a A, progress: &'a dyn Progress) -> Self {
        Self {
            context,
            caster: RayCaster::new(accel, progress),
            primary_rays: PrimaryRays::default(),
            starting: Default::default(),
            continuing: Default::default(),
            wave: Wave::default(),
            media: MediaTable::default(),
            buffers: ShadingBuffers::default(),
            shadows: ShadowQueue::default(),
            hotspots: ShadowQueue::default(),
            environment_rays: EnvironmentRays::default(),
            samples: Vec::new(),
            streams: Vec::new(),
            roulette: Roulette::default(),
            by_chance: Vec::new(),
            firsts: Vec::new(),
            counts: ByClass::default(),
        }
    }

    /// Centre of the scene, which is subtracted from world positions.
    pub(crate) fn center(&self) -> DVec3 {
        self.context.world.center
    }

    /// Prepares for `samples` samples, whose eye rays are then added to [`Self::primary_rays`] and start inside of `media`.
    pub(crate) fn reset(&mut self, samples: usize, layers: bool, media: &[Medium]) {
        self.counts.each_mut().into_iter().for_each(|probe| probe.batch(samples));
        self.starting.iter_mut().chain(&mut self.continuing).for_each(Queue::clear);
        self.shadows.clear();
        self.hotspots.clear();
        self.environment_rays.clear();
        self.primary_rays.clear();
        self.primary_rays.media = self.media.reset(media);
        self.streams.clear();
        self.roulette = Roulette::default();
        self.by_chance.clear();
        self.by_chance.resize(if self.context.meets_by_chance { samples } else { 0 }, false);
        self.samples.clear();
        self.samples.resize(samples, Sample::default());
        self.firsts.clear();
        self.firsts.resize(if layers { samples } else { 0 }, FirstSurface::NONE);
    }

    /// Adds an eye ray outside of [`Self::primary_rays`].
    pub(crate) fn start(&mut self, ray: Ray, path: Path) {
        self.starting[RayClass::Primary as usize].push(ray, path, Hit::MISS);
    }

    /// Traces all ray trees to their leaves; returns false if the user cancelled.
    pub(crate) fn trace(&mut self) -> bool {
        self.trace_primary_rays();
        self.trace_waves();
        !self.caster.cancelled
    }

    /// Traces the secondary rays of primary rays once so many are queued that memory would fill.
    pub(super) fn trace_followers(&mut self) {
        if self.starting.iter().chain(&self.continuing).map(Queue::len).sum::<usize>() >= FOLLOWERS {
            self.trace_shadows();
            self.trace_waves();
        }
    }

    /// Traces all queued rays, and the rays that follow from them.
    fn trace_waves(&mut self) {
        while let Some(class) = self.next_wave() {
            if self.caster.cancelled {
                return;
            }
            let wave = std::mem::take(&mut self.wave);
            self.shade_wave(class, &wave);
            self.wave = wave;
            self.trace_shadows();
        }
    }

    /// Traces all primary rays and shades their hits.
    fn trace_primary_rays(&mut self) {
        let mut primary_rays = std::mem::take(&mut self.primary_rays);
        {
            let PrimaryQuery { rays, pencil, cones, hits } = primary_rays.ask();
            let (class, samples) = (RayClass::Primary, self.samples.len());
            let alpha_filter = self.context.alpha_filter::<P>(class, samples, rays, Cones::PrimaryRays(cones));
            let filter = alpha_filter.as_ref().map(|filter| filter as &dyn IntersectFilter);
            let queries = HitQueries { rays, pencil: pencil.as_ref(), after: None, filter };
            self.caster.first_hits(&queries, hits, self.counts.of(RayClass::Primary));
        }
        if !self.caster.cancelled {
            self.shade_primary_rays(&primary_rays);
            self.trace_shadows();
        }
        self.primary_rays = primary_rays;
    }

    /// Takes the next wave and finds its hits. Continuing rays come before new rays, which are a deeper generation.
    fn next_wave(&mut self) -> Option<RayClass> {
        let class = self.take_wave()?;
        let wave = &mut self.wave;
        let mut hits = std::mem::take(&mut wave.hits);
        let alpha_filter = self.context.alpha_filter::<P>(class, self.samples.len(), &wave.rays, (&*wave).into());
        let filter = alpha_filter.as_ref().map(|filter| filter as &dyn IntersectFilter);
        let after = (!wave.starts).then_some(wave.after.as_slice());
        let queries = HitQueries { rays: &wave.rays, pencil: None, after, filter };
        self.caster.first_hits(&queries, &mut hits, self.counts.of(class));
        wave.hits = hits;
        Some(class)
    }

    fn take_wave(&mut self) -> Option<RayClass> {
        if self.media.is_large() {
            let queues = self.starting.iter_mut().chain(&mut self.continuing);
            self.media.retain(queues.flat_map(Queue::paths_mut).map(|path| &mut path.media));
        }
        let wave = &mut self.wave;
        let limits = (WAVE_LIMIT, WAVE_LIMIT.min(self.context.points_at_a_time));
        for (starts, queues) in [(false, &mut self.continuing), (true, &mut self.starting)] {
            if let Some(class) = RayClass::ALL.into_iter().find(|&class| !queues[class as usize].is_empty()) {
                queues[class as usize].take(wave, limits);
                wave.starts = starts;
                return Some(class);
            }
        }
        None
    }

    fn trace_shadows(&mut self) {
        let samples = &mut self.samples;
        let mut arrive = |sample: u32, light: Vec3| samples[sample as usize].radiance += light;
        if self.shadows.len() > 0 {
            self.shadows.trace(self.context, &mut self.media, &mut self.caster, &mut self.counts.shadow, &mut arrive);
        }
        if self.hotspots.len() > 0 {
            self.hotspots.trace(self.context, &mut self.media, &mut self.caster, &mut self.counts.shadow, &mut arrive);
        }
        self.environment_rays.trace(self.context, &mut self.media, &mut self.caster, &mut self.counts.shadow, arrive);
    }

    /// Traces shadow rays once many are queued. Between two calls each sample is shaded at one point at most, so that the order
    /// in which points are shaded does not change the order of sums.
    pub(super) fn relieve(&mut self) {
        if self.shadows.len() >= SHADOW_LIMIT
            || self.hotspots.len() >= SHADOW_LIMIT
            || self.environment_rays.len() >= ENVIRONMENT_RAYS_LIMIT
        {
            self.trace_shadows();
        }
    }

    /// Ends a ray that hit nothing: along the line of sight the background shows through, otherwise the environment is seen.
    pub(super) fn leave(&mut self, ray: &Ray, path: &Path) {
        let sample = &mut self.samples[ray.sample as usize];
        if path.straight && !self.context.shows_environment {
            sample.through += path.weight;
            return;
        }
        let (dir, sky) = (ray.dir.try_normalize().unwrap_or(Vec3::Z), &self.context.sky);
        let seen = match path.straight {
            _ if path.skips_hotspot => sky.without_hotspot(dir, path.cone_spread),
            true => sky.behind(dir, path.cone_spread),
            false => sky.radiance(dir, path.cone_spread),
        };
        sample.radiance += path.weight * seen;
    }

    /// Adds the light that the surface at a hit shows without further rays, and queues the rays that gather the rest.
    pub(super) fn shade(&mut self, class: RayClass, Arrival { ray, hit, touches }: Arrival, path: &Path) {
        let context = self.context;
        let attenuated =
            context.absorption.is_some().then(|| context.absorption.attenuated(&self.media, ray, path, hit));
        let (arriving, path) = (path, attenuated.as_ref().unwrap_or(path));
        let target = HitPrim::new(context.scene, context.world, hit.prim);
        let material = target.material;
        // Rays to the hotspot end at materials that would turn them.
        let seeing = path.skips_hotspot && context.turns(material);
        let seeing = seeing.then(|| [arriving, path].map(|path| Path { skips_hotspot: false, ..*path }));
        let (arriving, path) = seeing.as_ref().map_or((arriving, path), |[arriving, path]| (arriving, path));
        let width = path.cone_width + path.cone_spread * hit.t;
        let mut surface = Surface::new(context.world, target, ray, hit, width);

        // Pass through invisible surfaces: backs of one-sided faces, absent texels, and part of blended ones.
        if !surface.front && !material.double_sided && !material.reflection.transmits() {
            return self.continuing[class as usize].push_behind(*ray, path.behind_back(), *hit);
        }
        let reader = Reader { store: context.textures, patch: surface.patch.as_ref(), known: &[] };
        let base = reader.base(material);
        let coverage = material.alpha_mode.covers(base.w);
        if coverage <= 0.0 {
            return self.continuing[class as usize].push(*ray, *arriving, *hit);
        }
        if coverage < 1.0 {
            self.go_on(ray, path, hit, coverage);
        }

        // Local colour: emission, ambient light, and each light.
        surface.shade_smoothly(context.textures);
        self.note(ray, path, &surface, base.truncate());
        let bsdf = bsdf_seen(context, &surface, base.truncate(), path);
        let point = PathVertex {
            ray,
            hit,
            width,
            surface: &surface,
            bsdf: &bsdf,
            touches,
            path: Path { weight: path.weight * coverage, ..*path },
        };
        if context.no_prune {
            look_up_in_vain(&surface, context.textures);
        }
        let crossing = point.crossing(context, &mut self.media, path.band);
        if context.no_prune || !bsdf.is_dark() {
            self.shade_environment(&point);
            self.light(&point, &crossing);
        }

        if path.depth < context.depth {
            self.reflect_and_refract(&point, &crossing);
        } else if context.no_prune {
            black_box(point.bounce_weights(&crossing));
        }
    }

    /// Adds the emission of a point and the light of its surroundings, or queues the rays that find their occlusion.
    pub(super) fn shade_environment<G: ShadingPoint>(&mut self, point: &PathVertex<G>) {
        let (context, surface, bsdf) = (self.context, point.surface, point.bsdf);
        let (weight, sample) = (point.path.weight, point.ray.sample);
        let [open, through] = bsdf.ambient(&surface.seen(), &context.sky, context.scene.ambient);
        if context.env_rays == 0 || bsdf.is_unlit() {
            return self.add(sample, weight * (bsdf.emission + open + through));
        }
        // Surroundings seen through glass lie on its other side, where these rays do not go.
        self.add(sample, weight * (bsdf.emission + through));
        if open.is_finite() && open != Vec3::ZERO {
            let media = context.absorption.is_some().then_some(point.path.media);
            let (ray, draws) = (point.ray, self.draws(point, Purpose::Surroundings));
            self.environment_rays.push(context, &EnvironmentPoint { surface, bsdf, ray, draws, weight, open, media });
        }
    }

    /// Queues the ray behind a surface that covers only a part of it.
    pub(super) fn go_on(&mut self, ray: &Ray, path: &Path, hit: &Hit, coverage: f32) {
        let weight = path.weight * (1.0 - coverage);
        if self.context.is_alive(weight, path.part) {
            let mut path = Path { weight, ..path.turned(RayClass::Refracted, ON) };
            if self.roulette.spin(&self.streams, ray.sample, &mut path) {
                self.continuing[RayClass::Refracted as usize].push_behind(*ray, path, *hit);
            }
        }
    }

    /// Random numbers of a point.
    pub(super) fn draws<G>(&self, point: &PathVertex<G>, purpose: Purpose) -> Draws {
        Draws::at(self.context.seed, &self.streams, point.path.branch, point.ray, point.hit, purpose)
    }

    /// Whether shadow rays with little light are sent by chance: where they may have to pass many surfaces that transmit light.
    /// Elsewhere they are so fast that a pixel becomes certain at less cost with all of them.
    pub(super) fn chooses_shadow_rays(&self) -> bool {
        !self.context.world.is_opaque() && self.roulette.is_at_work()
    }

    /// Records the first surface of a sample for the layers.
    fn note(&mut self, ray: &Ray, path: &Path, surface: &Surface, albedo: Vec3) {
        let Some(first) = self.firsts.get_mut(ray.sample as usize) else { return };
        if path.straight && !first.is_some() {
            let HitPrim { prim, instance, .. } = surface.target;
            let at = (surface.position, surface.normal);
            *first = FirstSurface::new((prim, instance), at, albedo, self.context.world.center);
        }
    }

    pub(super) fn add(&mut self, sample: u32, radiance: Vec3) {
        if radiance.is_finite() {
            self.samples[sample as usize].radiance += radiance;
        }
    }

    /// Adds direct light, from several points of each area light.
    fn light(&mut self, point: &PathVertex<Surface>, crossing: &Crossing) {
        let (context, position) = (self.context, point.surface.position);
        let mut draws = None;
        for (number, light) in (0..).zip(&context.lights) {
            if !light.is_area() {
                if let Some(incident) = light.incident(position) {
                    self.shade_light(point, crossing, light, number, &incident, 1.0);
                }
                continue;
            }
            let rays = context.light_rays_at(point.path.depth);
            let spread = draws.get_or_insert_with(|| self.draws(point, Purpose::Lights)).spread(rays);
            for k in 0..rays {
                if let Some(incident) = light.incident_from(position, spread.point(k)) {
                    self.shade_light(point, crossing, light, mix(number, k + 1), &incident, 1.0 / rays as f32);
                }
            }
        }
    }

    /// Adds the light of one point of a light, which stands for a fraction `part` of it: at once if the light casts no shadows,
    /// otherwise through a shadow ray.
    fn shade_light(
        &mut self,
        point: &PathVertex<Surface>,
        crossing: &Crossing,
        light: &LocalLight,
        number: u32,
        incident: &Incident,
        part: f32,
    ) {
        let (surface, to_light) = (point.surface, incident.to_light);
        let above = surface.horizon.dot(to_light) > 0.0;
        let seen = if above {
            point.bsdf.lit(surface.horizon, surface.normal, surface.view, incident)
        } else {
            point.bsdf.lit_through(surface.normal, surface.view, incident, crossing)
        };
        let mut radiance = point.path.weight * seen * part;
        if !(radiance.is_finite() && radiance.max_element() > 0.0) {
            return;
        }
        if !light.shadows {
            return self.add(point.ray.sample, radiance);
        }
        let sample = point.ray.sample;
        if self.chooses_shadow_rays() && !self.roulette.sends(&self.streams, sample, &point.path, number, &mut radiance)
        {
            return;
        }
        let inside = self.context.absorption.is_some().then_some(point.path.media);
        if !above {
            return self.shadows.push(surface.shadow_ray(incident, sample), radiance, inside);
        }
        if let Some(shadow_rays) = surface.shadow_rays(incident, sample) {
            self.shadows.push_pair(&shadow_rays, radiance, inside);
        }
    }
}

/// BSDF of a surface with this base colour, as a ray of the path sees it.
fn bsdf_seen(context: &Context, surface: &Surface, base: Vec3, path: &Path) -> Bsdf {
    let material = surface.target.material;
    let mut bsdf = Bsdf::new(surface, base, context.textures);
    if path.scattered > SPREAD {
        bsdf.blur(path.scattered);
    }
    if !context.lights.is_empty() {
        let least = |map| glint::least_square(surface, map, context, path.cone_spread);
        if bsdf.has_narrow_highlight() {
            bsdf.widen_highlight(least((material.normal_map.as_ref(), material.normal_scale)));
        }
        if let Some(coat) = bsdf.coat.as_mut().filter(|coat| coat.has_narrow_highlight()) {
            let of_coat = material.metal_rough().and_then(|m| m.coat.as_ref());
            coat.widen_highlight(least(of_coat.map_or((None, 1.0), |c| (c.normal_map.as_ref(), c.normal_scale))));
        }
    }
    if path.depth < context.depth && context.gloss.spreads(material) {
        bsdf.spread_by_rays();
    }
    bsdf
}
