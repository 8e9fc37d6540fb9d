//! Shading of the hits of a wave: sorted by instance and shaded side by side where possible, one by one elsewhere.
//!
//! Several rays of a wave that belong to one sample are shaded in order of their ranks, so that contributions to a sample are
//! added in the order of its rays, whatever other rays are in the wave.

use super::branch::PathVertex;
use super::context::Context;
use super::draws::{Draws, Purpose};
use super::media::Media;
use super::observer::Observer;
use super::primary_rays::PrimaryRays;
use super::seam::{is_same_crossing, is_same_surface};
use super::shade::{Bsdf, LocalLight};
use super::shading_batch::{
    BatchPoint, HitsByInstance, MaterialConstants, POINTS, PassThrough, PlacedMesh, ShadingBatch,
};
use super::shadow::curve::ShadowRays;
use super::sobol::mix;
use super::surface::{HitPrim, Surface};
use super::wave::{Path, RayClass, Wave};
use super::whitted::{Arrival, Tracer};
use crate::accel::{Accel, Hit, Ray};
use crate::math::Vec3;
use crate::math::simd::LANES;

/// Fewer points than this leave most of a register empty, and are shaded one by one.
const FEW: usize = 3;

/// Rays that were traced together.
#[derive(Clone, Copy)]
pub(crate) enum TracedRays<'a> {
    /// Eye rays: the `i`th is that of sample `i`.
    PrimaryRays(&'a PrimaryRays),
    /// Other rays, of one class.
    Wave(RayClass, &'a Wave),
}

impl<'a> TracedRays<'a> {
    pub(crate) fn rays(self) -> &'a [Ray] {
        match self {
            Self::PrimaryRays(primary_rays) => primary_rays.rays(),
            Self::Wave(_, wave) => &wave.rays,
        }
    }

    pub(crate) fn hits(self) -> &'a [Hit] {
        match self {
            Self::PrimaryRays(primary_rays) => &primary_rays.hits,
            Self::Wave(_, wave) => &wave.hits,
        }
    }

    /// Path of the `i`th ray behind its hit, if that is a hole.
    fn path_through(self, i: usize) -> Path {
        match self {
            Self::PrimaryRays(primary_rays) => primary_rays.path(i),
            Self::Wave(_, wave) => Path { crossed: wave.crossed(i), ..wave.paths[i] },
        }
    }

    /// Path of the `i`th ray.
    pub(crate) fn path(self, i: usize) -> Path {
        match self {
            Self::PrimaryRays(primary_rays) => primary_rays.path(i),
            Self::Wave(_, wave) => wave.paths[i],
        }
    }

    /// Whether rays may have a throughput other than 1.
    pub(crate) fn has_weights(self) -> bool {
        match self {
            Self::PrimaryRays(primary_rays) => primary_rays.are_immersed(),
            Self::Wave(..) => true,
        }
    }

    /// Whether the `i`th ray has crossed another surface at the place of its hit just before.
    fn touches(self, i: usize) -> bool {
        match self {
            Self::PrimaryRays(_) => false,
            Self::Wave(_, wave) => wave.touches(i),
        }
    }

    fn class(self) -> RayClass {
        match self {
            Self::PrimaryRays(_) => RayClass::Primary,
            Self::Wave(class, _) => class,
        }
    }
}

/// Buffers of one worker.
#[derive(Default)]
pub(super) struct ShadingBuffers {
    /// Both are large: there is always one of each, taken out while in use.
    by_instance: Option<HitsByInstance>,
    batch: Option<Box<ShadingBatch>>,
    /// Rays that hit nothing and see the surroundings.
    missed: Vec<u32>,
    ranks: Ranks,
    /// Points of a batch, their random numbers for area lights, and how many points of each light they draw.
    draws: Vec<(usize, Draws, u32)>,
}

/// Rays of a wave by rank: the number of earlier rays of the same sample.
#[derive(Default)]
struct Ranks {
    /// Number of rays ranked so far, by sample; all zero between calls.
    ranked: Vec<u32>,
    /// Rank of each ray.
    of_ray: Vec<u32>,
    /// The rays sorted by rank, and within a rank by index in the wave.
    rays: Vec<u32>,
    /// End of each rank in `rays`.
    ends: Vec<usize>,
}

impl Ranks {
    fn rank(&mut self, rays: &[Ray]) {
        let Self { ranked, of_ray, rays: order, ends } = self;
        let samples = rays.iter().map(|ray| ray.sample as usize + 1).max().unwrap_or(0);
        ranked.resize(samples.max(ranked.len()), 0);
        of_ray.clear();
        ends.clear();
        for ray in rays {
            let rank = &mut ranked[ray.sample as usize];
            of_ray.push(*rank);
            if ends.len() <= *rank as usize {
                ends.push(0);
            }
            ends[*rank as usize] += 1;
            *rank += 1;
        }
        rays.iter().for_each(|ray| ranked[ray.sample as usize] = 0);
        // Turns counts into starts; each start then grows to the end.
        let mut start = 0;
        for end in ends.iter_mut() {
            (*end, start) = (start, start + *end);
        }
        order.clear();
        order.resize(rays.len(), 0);
        for (ray, &rank) in (0..).zip(&*of_ray) {
            let at = &mut ends[rank as usize];
            order[*at] = ray;
            *at += 1;
        }
    }

    /// Rays of each rank in turn.
    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.rays[start..end])
    }
}

impl<A: Accel, P: Observer> Tracer<'_, A, P> {
    /// Shades the hits of eye rays.
    pub(super) fn shade_primary_rays(&mut self, primary_rays: &PrimaryRays) {
        let at_a_time = self.context.points_at_a_time;
        for (start, hits) in (0..).step_by(at_a_time).zip(primary_rays.hits.chunks(at_a_time)) {
            self.shade_some_primary_rays(primary_rays, start, hits);
            self.relieve();
            self.trace_followers();
        }
    }

    /// Shades a run of consecutive hits of eye rays.
    fn shade_some_primary_rays(&mut self, primary_rays: &PrimaryRays, first: u32, hits: &[Hit]) {
        let context = self.context;
        let mut by_instance = self.sort();
        for (start, eight) in (first..).step_by(LANES).zip(hits.chunks(LANES)) {
            // Neighbours mostly hit the same prim.
            let first = eight[0].prim;
            let alike = eight.iter().all(|hit| hit.prim == first);
            if !(alike && eight[0].is_some() && by_instance.take(context, start, eight.len(), first)) {
                (start..)
                    .zip(eight)
                    .for_each(|(i, hit)| self.shade_primary_ray(primary_rays, &mut by_instance, i, hit));
            }
        }
        self.see_surroundings(TracedRays::PrimaryRays(primary_rays));
        self.shade_by_instance(TracedRays::PrimaryRays(primary_rays), by_instance);
    }

    fn shade_primary_ray(&mut self, primary_rays: &PrimaryRays, by_instance: &mut HitsByInstance, i: u32, hit: &Hit) {
        if hit.is_some() {
            if !by_instance.take(self.context, i, 1, hit.prim) {
                self.shade_one(TracedRays::PrimaryRays(primary_rays), i as usize);
            }
        } else if self.context.shows_environment {
            self.buffers.missed.push(i);
        } else {
            self.samples[i as usize].through += Vec3::ONE;
        }
    }

    /// Shades the hits of a wave.
    pub(super) fn shade_wave(&mut self, class: RayClass, wave: &Wave) {
        let mut ranks = std::mem::take(&mut self.buffers.ranks);
        ranks.rank(&wave.rays);
        for rays in ranks.iter().flat_map(|rays| rays.chunks(self.context.points_at_a_time)) {
            self.shade_some(class, wave, rays);
            self.relieve();
        }
        self.buffers.ranks = ranks;
    }

    /// Shades the hits of these rays of a wave, which belong to different samples.
    fn shade_some(&mut self, class: RayClass, wave: &Wave, rays: &[u32]) {
        let context = self.context;
        let traced = TracedRays::Wave(class, wave);
        let mut by_instance = self.sort();
        for &index in rays {
            let i = index as usize;
            let (ray, path, hit) = (&wave.rays[i], &wave.paths[i], &wave.hits[i]);
            if !hit.is_some() {
                if path.straight || path.skips_hotspot {
                    self.leave(ray, path)
                } else {
                    self.buffers.missed.push(index)
                }
            } else if self.is_crossed(wave, i) {
                self.continuing[class as usize].push_behind(*ray, *path, *hit);
            } else if rays.len() < FEW
                || self.sees_hotspot_again(path, hit)
                || !by_instance.take(context, index, 1, hit.prim)
            {
                self.shade_one(traced, i);
            }
        }
        self.see_surroundings(traced);
        self.shade_by_instance(traced, by_instance);
    }

    /// Whether the `i`th hit belongs to a surface that the ray has already crossed.
    fn is_crossed(&self, wave: &Wave, i: usize) -> bool {
        let (ray, hit) = (&wave.rays[i], &wave.hits[i]);
        let face = |prim| self.context.face(prim);
        match wave.starts {
            true => wave.touches(i) && is_same_surface(face, ray, &wave.after[i], hit),
            false => is_same_crossing(face, ray, &wave.paths[i].crossed, hit),
        }
    }

    /// Whether a path that skips the hotspot may see it again behind this hit.
    fn sees_hotspot_again(&self, path: &Path, hit: &Hit) -> bool {
        path.skips_hotspot && self.context.turns(&self.context.scene.materials[self.context.face(hit.prim).1 as usize])
    }

    /// Shades the hit of the `i`th ray.
    fn shade_one(&mut self, traced: TracedRays, i: usize) {
        let (ray, hit) = (&traced.rays()[i], &traced.hits()[i]);
        let arrival = Arrival { ray, hit, touches: traced.touches(i) };
        self.shade(traced.class(), arrival, &traced.path_through(i));
    }

    fn sort(&mut self) -> HitsByInstance {
        let mut by_instance = self.buffers.by_instance.take().unwrap_or_default();
        by_instance.clear(self.context.scene.instances.len());
        by_instance
    }

    /// Adds the surroundings seen by rays that hit nothing.
    fn see_surroundings(&mut self, traced: TracedRays) {
        let mut missed = std::mem::take(&mut self.buffers.missed);
        match traced {
            TracedRays::PrimaryRays(primary_rays) => {
                let samples = &mut self.samples;
                let tell = |i: u32, radiance: Vec3| samples[i as usize].radiance += radiance;
                let (dirs, angles) = primary_rays.columns();
                self.context.sky.each_behind(&missed, dirs, angles, tell);
            }
            TracedRays::Wave(_, wave) => {
                let rays = missed.iter().map(|&i| (i, wave.rays[i as usize].dir, wave.paths[i as usize].cone_spread));
                self.context.sky.each_radiance(rays, |i, radiance| {
                    let (ray, path) = (&wave.rays[i as usize], &wave.paths[i as usize]);
                    self.samples[ray.sample as usize].radiance += path.weight * radiance;
                });
            }
        }
        missed.clear();
        self.buffers.missed = missed;
    }

    /// Shades the hits that were sorted by instance, and returns the buffers.
    fn shade_by_instance(&mut self, traced: TracedRays, by_instance: HitsByInstance) {
        let mut batch = self.buffers.batch.take().unwrap_or_default();
        for k in 0..by_instance.instances() {
            let (instance, hits) = by_instance.of(k);
            for hits in hits.chunks(POINTS) {
                if hits.len() < FEW {
                    hits.iter().for_each(|&(ray, _)| self.shade_one(traced, ray as usize));
                } else {
                    self.shade_batch(traced, &by_instance, instance, hits, &mut batch);
                }
            }
        }
        self.buffers.batch = Some(batch);
        self.buffers.by_instance = Some(by_instance);
    }

    /// Shades hits of one instance side by side, as [`Self::shade`] does one by one.
    fn shade_batch(
        &mut self,
        traced: TracedRays,
        by_instance: &HitsByInstance,
        instance: u32,
        hits: &[(u32, u32)],
        batch: &mut ShadingBatch,
    ) {
        let context = self.context;
        let mesh = &context.scene.meshes[context.scene.instances[instance as usize].mesh as usize];
        let Some(constants) = &context.material_constants[mesh.material as usize] else { return };
        let (smooth, reads) = (!mesh.normals.is_empty(), constants.mapped || !mesh.colors.is_empty());
        let (bsdf, needs_cones, placement) =
            (&constants.bsdf, constants.needs_cones, context.world.placement(instance));
        batch.take(hits, by_instance, traced, &context.absorption, &self.media, smooth);
        batch.find(smooth.then_some(placement));
        if reads || needs_cones || context.environment_needs_points() {
            batch.widen(traced);
        }
        if reads {
            batch.read(context, traced, PlacedMesh { mesh, placement }, constants);
        }
        if !constants.is_completed() {
            batch.blur(traced, bsdf);
        }
        if needs_cones {
            batch.bend(context, constants, smooth.then_some(placement));
        }
        if constants.spreads {
            batch.retain(|ray| traced.path(ray).depth < context.depth);
        }
        for index in batch.left_out() {
            self.shade_one(traced, index as usize);
        }
        batch.thin_out(constants, reads, |at, passed| self.pass(traced, at, passed));
        if batch.is_empty() {
            return;
        }
        self.note_batch(traced, instance, bsdf, batch);
        batch.complete(context, traced, PlacedMesh { mesh, placement }, constants);
        batch.overlay(context, traced, PlacedMesh { mesh, placement }, constants);
        if !constants.glass.is_some_and(|glass| glass.is_dark_inside && batch.sees_backs_alone()) {
            self.show(traced, constants, batch);
        }
        if constants.sends_by_points() {
            self.each_point(traced, constants, batch, |tracer, point| {
                if point.path.depth < context.depth {
                    let crossing = point.crossing(context, &mut tracer.media, point.path.band);
                    tracer.reflect_and_refract(point, &crossing);
                }
            });
        } else if needs_cones && context.depth > 0 {
            let (roulette, streams) = (self.roulette, &self.streams);
            let goes_on = |sample, path: &mut _| roulette.spin(streams, sample, path);
            batch.mirror(context, bsdf, traced, goes_on, &mut self.starting[RayClass::Reflected as usize]);
        }
    }

    /// Continues the ray at index `at` behind its hit.
    fn pass(&mut self, traced: TracedRays, at: usize, passed: PassThrough) {
        let (context, class) = (self.context, traced.class());
        let (ray, hit, path) = (&traced.rays()[at], &traced.hits()[at], traced.path(at));
        let attenuated = |path| match context.absorption.is_some() {
            true => context.absorption.attenuated(&self.media, ray, &path, hit),
            false => path,
        };
        match passed {
            PassThrough::Back => {
                self.continuing[class as usize].push_behind(*ray, attenuated(path).behind_back(), *hit)
            }
            PassThrough::Covered(coverage) if coverage <= 0.0 => {
                self.continuing[class as usize].push(*ray, traced.path_through(at), *hit);
            }
            PassThrough::Covered(coverage) => self.go_on(ray, &attenuated(path), hit, coverage),
        }
    }

    /// Records the first surfaces of samples among points of an instance, whose material without maps is `unmapped`.
    fn note_batch(&mut self, traced: TracedRays, instance: u32, unmapped: &Bsdf, batch: &ShadingBatch) {
        if self.firsts.is_empty() {
            return;
        }
        for (at, sample, found) in batch.firsts(instance, unmapped, self.context.world.center) {
            let first = &mut self.firsts[sample as usize];
            if !first.is_some() && traced.path(at).straight {
                *first = found;
            }
        }
    }

    /// Adds the light of the surroundings and of each light, or queues the rays that find their occlusion.
    fn show(&mut self, traced: TracedRays, constants: &MaterialConstants, batch: &mut ShadingBatch) {
        let context = self.context;
        if context.environment_needs_points() || constants.is_completed() {
            self.each_point(traced, constants, batch, |tracer, point| tracer.shade_environment(point));
        } else if !context.is_dark || constants.bsdf.shines() {
            batch.shade_environment(constants, &context.sky, context.scene.ambient);
            batch.shown().for_each(|(sample, everywhere)| self.add(sample, everywhere));
        }
        let absorbs = context.absorption.is_some();
        let within = absorbs && batch.certain().any(|i| traced.path(batch.arrival(i).0).media != Media::OUTSIDE);
        let mut draws = std::mem::take(&mut self.buffers.draws);
        draws.clear();
        for (number, light) in (0..).zip(&context.lights) {
            if !light.is_area() {
                batch.shade_light(constants, light, None);
                self.choose(traced, light, number, batch);
                self.ask_for(traced, light, batch, within, None);
                continue;
            }
            if draws.is_empty() {
                draws.extend(batch.certain().map(|i| self.draws_for_lights(traced, batch, i)));
            }
            for place in 0..batch.draw(draws.iter_mut().map(|(i, draws, rays)| (*i, draws.spread(*rays), *rays))) {
                batch.shade_light(constants, light, Some(place));
                self.choose(traced, light, mix(number, place + 1), batch);
                self.ask_for(traced, light, batch, within, Some(place));
            }
        }
        self.buffers.draws = draws;
    }

    /// Drops points that a light hardly reaches, at random.
    fn choose(&self, traced: TracedRays, light: &LocalLight, number: u32, batch: &mut ShadingBatch) {
        if !(light.shadows && self.chooses_shadow_rays()) {
            return;
        }
        batch.choose(|at, sample, radiance| {
            self.roulette.sends(&self.streams, sample, &traced.path(at), number, radiance)
        });
    }

    /// Point `i`, its random numbers for area lights, and how many points of each light it draws.
    fn draws_for_lights(&self, traced: TracedRays, batch: &ShadingBatch, i: usize) -> (usize, Draws, u32) {
        let (context, (at, ..)) = (self.context, batch.arrival(i));
        let (ray, hit, path) = (&traced.rays()[at], &traced.hits()[at], traced.path(at));
        let draws = Draws::at(context.seed, &self.streams, path.branch, ray, hit, Purpose::Lights);
        (i, draws, context.light_rays_at(path.depth))
    }

    /// Adds the light that points receive from a light, from the `place`th point drawn on it, or queues shadow rays; `within`
    /// says whether any of these starts inside of a medium, where media absorb light.
    fn ask_for(
        &mut self,
        traced: TracedRays,
        light: &LocalLight,
        batch: &ShadingBatch,
        within: bool,
        place: Option<u32>,
    ) {
        let context = self.context;
        let absorbs = context.absorption.is_some();
        if !light.shadows {
            return batch.lit_samples().for_each(|(sample, radiance)| self.add(sample, radiance));
        }
        if within {
            batch.send_within(&mut self.shadows, traced);
        } else {
            batch.send(&mut self.shadows, absorbs);
        }
        for (i, radiance) in batch.grazing_points() {
            let at = batch.arrival(i).0;
            let (ray, hit) = (&traced.rays()[at], &traced.hits()[at]);
            let drawn = place.map(|place| batch.drawn(i, place));
            if let Some(shadow_rays) = shadow_rays(context, light, drawn, ray, hit) {
                let media = absorbs.then(|| traced.path(at).media);
                self.shadows.push_pair(&shadow_rays, radiance, media);
            }
        }
    }

    /// Calls `act` for every point by itself.
    fn each_point(
        &mut self,
        traced: TracedRays,
        constants: &MaterialConstants,
        batch: &ShadingBatch,
        mut act: impl FnMut(&mut Self, &PathVertex<BatchPoint>),
    ) {
        let context = self.context;
        let material = (constants.material, &context.scene.materials[constants.material as usize]);
        let has_inside = constants.has_inside();
        for i in batch.certain() {
            let (at, weight, width) = batch.arrival(i);
            let (ray, hit, path) = (&traced.rays()[at], &traced.hits()[at], traced.path(at));
            let since = if context.absorption.is_some() { hit.t } else { path.since };
            let surface = batch.point(i, material, has_inside);
            let found;
            let bsdf = match batch.point_bsdf(i) {
                Some(bsdf) => bsdf,
                None => {
                    found = surface.bsdf(&constants.bsdf);
                    &found
                }
            };
            let path = Path { weight, since, ..path };
            let touches = traced.touches(at);
            act(self, &PathVertex { ray, hit, path, width, surface: &surface, bsdf, touches });
        }
    }
}

/// Shadow rays from the round surface at `hit` to a light, or to one point of it if that was drawn.
fn shadow_rays(
    context: &Context,
    light: &LocalLight,
    drawn: Option<[f32; 2]>,
    ray: &Ray,
    hit: &Hit,
) -> Option<ShadowRays> {
    let target = HitPrim::new(context.scene, context.world, hit.prim);
    let surface = Surface::new(context.world, target, ray, hit, 0.0);
    let incident = match drawn {
        Some(drawn) => light.incident_from(surface.position, drawn)?,
        None => light.incident(surface.position)?,
    };
    surface.shadow_rays(&incident, ray.sample)
}
