//! What rays that were traced together have hit: sorted by instance and shaded side by side where that can be, one by one
//! elsewhere.
//!
//! Where several rays of a wave belong to one sample, they go by rank: so what a sample gathers is added in the order of its
//! rays, whichever others are beside them.

use super::branch::Point;
use super::context::Context;
use super::curve::Feelers;
use super::draws::{Draws, Purpose};
use super::eyes::Eyes;
use super::observer::Observer;
use super::seam::{is_same_crossing, is_same_surface};
use super::shade::{LocalLight, Matter};
use super::sobol::mix;
use super::strip::{Common, POINTS, Passed, Sorted, Strip, StripPoint};
use super::surface::{Surface, Target};
use super::wave::{Path, RayClass, Wave};
use super::whitted::Tracer;
use crate::accel::{Accel, Hit, Ray};
use crate::math::Vec3;
use crate::math::simd::LANES;

/// Fewer points than these leave most of a register empty, and are shaded one by one.
const FEW: usize = 3;

/// Rays that were traced together.
#[derive(Clone, Copy)]
pub(crate) enum Traced<'a> {
    /// From eyes: the `i`th is that of sample `i`.
    Eyes(&'a Eyes),
    /// Others of one class.
    Wave(RayClass, &'a Wave),
}

impl<'a> Traced<'a> {
    pub(crate) fn rays(self) -> &'a [Ray] {
        match self {
            Self::Eyes(eyes) => eyes.rays(),
            Self::Wave(_, wave) => &wave.rays,
        }
    }

    pub(crate) fn hits(self) -> &'a [Hit] {
        match self {
            Self::Eyes(eyes) => &eyes.hits,
            Self::Wave(_, wave) => &wave.hits,
        }
    }

    /// What the `i`th ray carries behind what it has hit, if that is a hole.
    fn path_through(self, i: usize) -> Path {
        match self {
            Self::Eyes(eyes) => eyes.path(i),
            Self::Wave(_, wave) => Path { crossed: wave.crossed(i), ..wave.paths[i] },
        }
    }

    /// What the `i`th ray carries.
    pub(crate) fn path(self, i: usize) -> Path {
        match self {
            Self::Eyes(eyes) => eyes.path(i),
            Self::Wave(_, wave) => wave.paths[i],
        }
    }

    /// Whether a ray may see what it meets weakened.
    pub(crate) fn has_weights(self) -> bool {
        match self {
            Self::Eyes(eyes) => eyes.are_immersed(),
            Self::Wave(..) => true,
        }
    }

    /// Whether the `i`th ray has hit something where it has crossed another surface just before.
    fn touches(self, i: usize) -> bool {
        match self {
            Self::Eyes(_) => false,
            Self::Wave(_, wave) => wave.touches(i),
        }
    }

    fn class(self) -> RayClass {
        match self {
            Self::Eyes(_) => RayClass::Primary,
            Self::Wave(class, _) => class,
        }
    }
}

/// Buffers of one worker.
#[derive(Default)]
pub(super) struct Beside {
    /// Both are large: there is always one of each, but while it is at work.
    sorted: Option<Sorted>,
    strip: Option<Box<Strip>>,
    /// Rays that met nothing and see the surroundings.
    missed: Vec<u32>,
    ranks: Ranks,
    /// Points of a strip with their numbers for wide lights, and how many places they draw.
    draws: Vec<(usize, Draws, u32)>,
}

/// The rays of a wave by rank: how many of the same sample come before.
#[derive(Default)]
struct Ranks {
    /// By sample, how many of its rays have been ranked; zeros in between.
    ranked: Vec<u32>,
    /// By ray, its rank.
    of_ray: Vec<u32>,
    /// The rays by their ranks, and in each by their places in the wave.
    rays: Vec<u32>,
    /// Where those of each rank end.
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
        // From how many there are to where they begin; where they begin grows to where they end.
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

    /// The rays of each rank.
    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.rays[start..end])
    }
}

impl<A: Accel, P: Observer> Tracer<'_, A, P> {
    /// Adds what eye rays see.
    pub(super) fn shade_eyes(&mut self, eyes: &Eyes) {
        let at_a_time = self.context.points_at_a_time;
        for (start, hits) in (0..).step_by(at_a_time).zip(eyes.hits.chunks(at_a_time)) {
            self.shade_some_eyes(eyes, (start, hits));
            self.relieve();
            self.follow_eyes();
        }
    }

    /// The same of hits that follow each other.
    fn shade_some_eyes(&mut self, eyes: &Eyes, (first, hits): (u32, &[Hit])) {
        let context = self.context;
        let mut sorted = self.sort();
        for (start, eight) in (first..).step_by(LANES).zip(hits.chunks(LANES)) {
            // Neighbours mostly hit the same.
            let first = eight[0].prim;
            let alike = eight.iter().all(|hit| hit.prim == first);
            if !(alike && eight[0].is_some() && sorted.take(context, (start, eight.len()), first)) {
                (start..).zip(eight).for_each(|(i, hit)| self.shade_eye(eyes, &mut sorted, i, hit));
            }
        }
        self.see_surroundings(Traced::Eyes(eyes));
        self.shade_sorted(Traced::Eyes(eyes), sorted);
    }

    fn shade_eye(&mut self, eyes: &Eyes, sorted: &mut Sorted, i: u32, hit: &Hit) {
        if hit.is_some() {
            if !sorted.take(self.context, (i, 1), hit.prim) {
                self.shade_one(Traced::Eyes(eyes), i as usize);
            }
        } else if self.context.shows_environment {
            self.beside.missed.push(i);
        } else {
            self.samples[i as usize].through += Vec3::ONE;
        }
    }

    /// Adds what the rays of a wave see.
    pub(super) fn shade_wave(&mut self, class: RayClass, wave: &Wave) {
        let mut ranks = std::mem::take(&mut self.beside.ranks);
        ranks.rank(&wave.rays);
        for rays in ranks.iter().flat_map(|rays| rays.chunks(self.context.points_at_a_time)) {
            self.shade_some((class, wave), rays);
            self.relieve();
        }
        self.beside.ranks = ranks;
    }

    /// The same of these of its rays, which belong to different samples.
    fn shade_some(&mut self, (class, wave): (RayClass, &Wave), rays: &[u32]) {
        let context = self.context;
        let traced = Traced::Wave(class, wave);
        let mut sorted = self.sort();
        for &index in rays {
            let i = index as usize;
            let (ray, path, hit) = (&wave.rays[i], &wave.paths[i], &wave.hits[i]);
            if !hit.is_some() {
                if path.straight || path.calm { self.leave(ray, path) } else { self.beside.missed.push(index) }
            } else if self.is_crossed(wave, i) {
                self.continuing[class as usize].push_behind(*ray, *path, *hit);
            } else if rays.len() < FEW
                || self.sees_glare_again(path, hit)
                || !sorted.take(context, (index, 1), hit.prim)
            {
                self.shade_one(traced, i);
            }
        }
        self.see_surroundings(traced);
        self.shade_sorted(traced, sorted);
    }

    /// Whether the `i`th ray has crossed already what it has hit.
    fn is_crossed(&self, wave: &Wave, i: usize) -> bool {
        let (ray, hit) = (&wave.rays[i], &wave.hits[i]);
        let face = |prim| self.context.face(prim);
        match wave.starts {
            true => wave.touches(i) && is_same_surface(face, ray, &wave.after[i], hit),
            false => is_same_crossing(face, ray, &wave.paths[i].crossed, hit),
        }
    }

    /// Whether what lies behind a hit is seen by a path with glare that was seen without.
    fn sees_glare_again(&self, path: &Path, hit: &Hit) -> bool {
        path.calm && self.context.turns(&self.context.scene.materials[self.context.face(hit.prim).1 as usize])
    }

    /// Shades what the `i`th ray has hit.
    fn shade_one(&mut self, traced: Traced, i: usize) {
        let (ray, hit) = (&traced.rays()[i], &traced.hits()[i]);
        self.shade(traced.class(), (ray, hit, traced.touches(i)), &traced.path_through(i));
    }

    fn sort(&mut self) -> Sorted {
        let mut sorted = self.beside.sorted.take().unwrap_or_default();
        sorted.clear(self.context.scene.instances.len());
        sorted
    }

    /// Adds what rays that met nothing see.
    fn see_surroundings(&mut self, traced: Traced) {
        let mut missed = std::mem::take(&mut self.beside.missed);
        match traced {
            Traced::Eyes(eyes) => {
                let samples = &mut self.samples;
                let tell = |i: u32, radiance: Vec3| samples[i as usize].radiance += radiance;
                self.context.sky.each_behind(&missed, eyes.columns(), tell);
            }
            Traced::Wave(_, wave) => {
                let rays = missed.iter().map(|&i| (i, wave.rays[i as usize].dir, wave.paths[i as usize].cone_spread));
                self.context.sky.each_radiance(rays, |i, radiance| {
                    let (ray, path) = (&wave.rays[i as usize], &wave.paths[i as usize]);
                    self.samples[ray.sample as usize].radiance += path.weight * radiance;
                });
            }
        }
        missed.clear();
        self.beside.missed = missed;
    }

    /// Shades the points that were taken, and gives the buffers back.
    fn shade_sorted(&mut self, traced: Traced, sorted: Sorted) {
        let mut strip = self.beside.strip.take().unwrap_or_default();
        for k in 0..sorted.instances() {
            let (instance, hits) = sorted.of(k);
            for hits in hits.chunks(POINTS) {
                if hits.len() < FEW {
                    hits.iter().for_each(|&(ray, _)| self.shade_one(traced, ray as usize));
                } else {
                    self.shade_strip(traced, &sorted, (instance, hits), &mut strip);
                }
            }
        }
        self.beside.strip = Some(strip);
        self.beside.sorted = Some(sorted);
    }

    /// Shades points of one instance side by side, as [`Self::shade`] does one by one.
    fn shade_strip(
        &mut self,
        traced: Traced,
        sorted: &Sorted,
        (instance, hits): (u32, &[(u32, u32)]),
        strip: &mut Strip,
    ) {
        let context = self.context;
        let mesh = &context.scene.meshes[context.scene.instances[instance as usize].mesh as usize];
        let Some(common) = &context.common[mesh.material as usize] else { return };
        let (smooth, reads) = (!mesh.normals.is_empty(), common.mapped || !mesh.colors.is_empty());
        let (matter, shiny, placement) = (&common.matter, common.shiny, context.world.placement(instance));
        strip.take(hits, sorted, (traced, &context.absorption), smooth);
        strip.find(smooth.then_some(placement));
        if reads || shiny || context.looks_around_by_points() {
            strip.widen(traced);
        }
        if reads {
            strip.read(context, traced, (mesh, placement), common);
        }
        if !common.is_completed() {
            strip.blur(traced, matter);
        }
        if shiny {
            strip.bend(context, common, smooth.then_some(placement));
        }
        if common.spreads {
            strip.retain(|ray| traced.path(ray).depth < context.depth);
        }
        for index in strip.left_out() {
            self.shade_one(traced, index as usize);
        }
        strip.thin_out((common, reads), |at, passed| self.pass(traced, at, passed));
        if strip.is_empty() {
            return;
        }
        self.note_strip(traced, (instance, matter), strip);
        strip.complete(context, traced, (mesh, placement), common);
        strip.overlay(context, traced, (mesh, placement), common);
        if !common.glass.is_some_and(|glass| glass.is_dark_inside && strip.sees_backs_alone()) {
            self.show(traced, common, strip);
        }
        if common.sends_by_points() {
            self.each_point(traced, common, strip, |tracer, point| {
                if point.path.depth < context.depth {
                    tracer.reflect_and_refract(point, &point.crossing(context, point.path.band));
                }
            });
        } else if shiny && context.depth > 0 {
            let (roulette, streams) = (self.roulette, &self.streams);
            let goes_on = |sample, path: &mut _| roulette.spin(streams, sample, path);
            strip.mirror(context, matter, traced, (goes_on, &mut self.starting[RayClass::Reflected as usize]));
        }
    }

    /// Sends the ray at this place of what was traced on behind what it has hit.
    fn pass(&mut self, traced: Traced, at: usize, passed: Passed) {
        let (context, class) = (self.context, traced.class());
        let (ray, hit, path) = (&traced.rays()[at], &traced.hits()[at], traced.path(at));
        let lessened = |path| match context.absorption.is_some() {
            true => context.absorption.lessened(ray, &path, hit),
            false => path,
        };
        match passed {
            Passed::Back => self.continuing[class as usize].push_behind(*ray, lessened(path).behind_back(), *hit),
            Passed::Covered(covered) if covered <= 0.0 => {
                self.continuing[class as usize].push(*ray, traced.path_through(at), *hit);
            }
            Passed::Covered(covered) => self.go_on(ray, &lessened(path), hit, covered),
        }
    }

    /// Remembers the points of an instance, whose material is `even` but for maps, that are the first surfaces of their samples.
    fn note_strip(&mut self, traced: Traced, (instance, even): (u32, &Matter), strip: &Strip) {
        if self.firsts.is_empty() {
            return;
        }
        for (at, sample, found) in strip.firsts(instance, even, self.context.world.center) {
            let first = &mut self.firsts[sample as usize];
            if !first.is_some() && traced.path(at).straight {
                *first = found;
            }
        }
    }

    /// Adds what the points show of their surroundings and of each light, or sends the rays that find whether it arrives.
    fn show(&mut self, traced: Traced, common: &Common, strip: &mut Strip) {
        let (context, matter) = (self.context, &common.matter);
        let has_inside = common.has_inside();
        if context.looks_around_by_points() || common.is_completed() {
            self.each_point(traced, common, strip, |tracer, point| tracer.look_around(point));
        } else if !context.is_dark || matter.shines() {
            strip.look_around((matter, has_inside), &context.sky, context.scene.ambient);
            strip.shown().for_each(|(sample, everywhere)| self.add(sample, everywhere));
        }
        let absorbs = context.absorption.is_some();
        let within = absorbs && strip.certain().any(|i| traced.path(strip.arrival(i).0).media.innermost().is_some());
        let what = (matter, common.shiny, has_inside);
        let mut draws = std::mem::take(&mut self.beside.draws);
        draws.clear();
        for (number, light) in (0..).zip(&context.lights) {
            if !light.is_wide() {
                strip.shine(what, light, None);
                self.choose(traced, (light, number), strip);
                self.ask_for(traced, light, strip, (within, None));
                continue;
            }
            if draws.is_empty() {
                draws.extend(strip.certain().map(|i| self.draws_for_lights(traced, strip, i)));
            }
            for place in 0..strip.draw(draws.iter_mut().map(|(i, draws, rays)| (*i, draws.spread(*rays), *rays))) {
                strip.shine(what, light, Some(place));
                self.choose(traced, (light, mix(number, place + 1)), strip);
                self.ask_for(traced, light, strip, (within, Some(place)));
            }
        }
        self.beside.draws = draws;
    }

    /// Leaves out points to which a light brings little, by chance.
    fn choose(&self, traced: Traced, (light, number): (&LocalLight, u32), strip: &mut Strip) {
        if !(light.shadows && self.chooses_shadow_rays()) {
            return;
        }
        strip.choose(|at, sample, radiance| {
            let path = traced.path(at);
            self.roulette.sends(&self.streams, (sample, path.branch, path.part), number, radiance)
        });
    }

    /// Point `i` with its numbers for wide lights, and how many places it draws of each.
    fn draws_for_lights(&self, traced: Traced, strip: &Strip, i: usize) -> (usize, Draws, u32) {
        let (context, (at, ..)) = (self.context, strip.arrival(i));
        let (ray, hit, path) = (&traced.rays()[at], &traced.hits()[at], traced.path(at));
        let draws = Draws::at(context.seed, &self.streams, path.branch, ray, hit, Purpose::Lights);
        (i, draws, context.light_rays_at(path.depth))
    }

    /// Adds what points show of a light, of the `place`th that they have drawn of it, or sends rays that find whether it
    /// arrives, `within` what is around the points.
    fn ask_for(&mut self, traced: Traced, light: &LocalLight, strip: &Strip, (within, place): (bool, Option<u32>)) {
        let context = self.context;
        let absorbs = context.absorption.is_some();
        if !light.shadows {
            return strip.shone().for_each(|(sample, radiance)| self.add(sample, radiance));
        }
        if within {
            strip.send_within(&mut self.shadows, traced);
        } else {
            strip.send(&mut self.shadows, absorbs);
        }
        for (i, radiance) in strip.grazed() {
            let at = strip.arrival(i).0;
            let (ray, hit) = (&traced.rays()[at], &traced.hits()[at]);
            let drawn = place.map(|place| strip.drawn(i, place));
            if let Some(feelers) = feelers(context, (light, drawn), ray, hit) {
                let media = absorbs.then(|| traced.path(at).media);
                self.shadows.push_feelers(&feelers, radiance, media);
            }
        }
    }

    /// Does what must be done point by point.
    fn each_point(
        &mut self,
        traced: Traced,
        common: &Common,
        strip: &Strip,
        mut act: impl FnMut(&mut Self, &Point<StripPoint>),
    ) {
        let context = self.context;
        let material = (common.material, &context.scene.materials[common.material as usize]);
        let has_inside = common.has_inside();
        for i in strip.certain() {
            let (at, weight, width) = strip.arrival(i);
            let (ray, hit, path) = (&traced.rays()[at], &traced.hits()[at], traced.path(at));
            let since = if context.absorption.is_some() { hit.t } else { path.since };
            let ground = strip.ground(i, material, has_inside);
            let bare;
            let matter = match strip.whole(i) {
                Some(whole) => whole,
                None => {
                    bare = ground.covered(&common.matter);
                    &bare
                }
            };
            let path = Path { weight, since, ..path };
            let touches = traced.touches(at);
            act(self, &Point { ray, hit, path, width, surface: &ground, matter, touches });
        }
    }
}

/// What finds out whether a light shines on the round surface at `hit`, one place of it if that was drawn.
fn feelers(
    context: &Context,
    (light, drawn): (&LocalLight, Option<[f32; 2]>),
    ray: &Ray,
    hit: &Hit,
) -> Option<Feelers> {
    let target = Target::new(context.scene, context.world, hit.prim);
    let surface = Surface::new(context.world, target, ray, hit, 0.0);
    let incident = match drawn {
        Some(drawn) => light.incident_from(surface.position, drawn)?,
        None => light.incident(surface.position)?,
    };
    surface.feelers(&incident, ray.sample)
}
