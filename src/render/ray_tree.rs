//! One eye ray told in order: what its walk visits and tests, what it hits, and the same for every ray that comes of it.
//!
//! Rays of a picture travel in waves that know no parents. A ray that starts on a surface starts at a point that follows
//! bit for bit from the ray that found it, so that the tree is put together again from the rays themselves.

use super::by_class::ByClass;
use super::observer::{Observer, Question};
use super::tile::trace_sample;
use super::{CLASS_NAMES, Context, Job};
use crate::accel::probe::{Outcome, Test, Visit};
use crate::accel::refine::Refined;
use crate::accel::{Hit, Probe, Ray, RayCounts};
use crate::math::Vec3;
use crate::math::simd::LANES;

/// Something that a walk did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// It entered a node or cell.
    Visit(Visit),
    /// It tested a prim.
    Test(Test),
    /// The mailbox knew this prim.
    Skipped(u32),
    /// It tested so many volumes.
    Volumes(usize),
    /// It transformed so many points into the ray's axes.
    Transforms(usize),
}

/// What sent a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// The eye.
    Primary,
    /// A point that looks for a light.
    Shadow,
    /// A mirror.
    Reflected,
    /// Glass, or whatever else lets light through.
    Refracted,
}

impl Class {
    const ALL: [Self; 4] = [Self::Primary, Self::Shadow, Self::Reflected, Self::Refracted];

    /// As printed.
    pub const fn name(self) -> &'static str {
        CLASS_NAMES[self as usize]
    }
}

/// One question about one ray, with everything that was done to answer it.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// What sent the ray.
    pub class: Class,
    /// What was asked.
    pub question: Question,
    /// In the centred frame.
    pub ray: Ray,
    /// The hit behind which the search went on; [`Hit::MISS`] for other questions.
    pub after: Hit,
    /// In order.
    pub events: Vec<Event>,
    /// The counts of all queries together.
    pub counts: RayCounts,
    /// The hit; of a shadow ray that was blocked only the first `prim` found in its way.
    pub hit: Hit,
    /// Places of the rays that came of it in [`RayTree::queries`].
    pub children: Vec<usize>,
    /// The light that a shadow ray looks for, an index into the scene's lights.
    pub light: Option<usize>,
    /// Of a shadow ray: whether it leads only up to where one begins that starts above its surface.
    pub riser: bool,
}

/// Everything that was asked for one sample of a pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayTree {
    /// The eye ray first. A parent comes before its children.
    pub queries: Vec<Query>,
    /// Linear colour of the sample, without the background.
    pub radiance: Vec3,
    /// Share of the background that shows through.
    pub through: Vec3,
    /// The maximum depth used.
    pub depth: u32,
}

/// Traces one sample (counted from 0) of the pixel in column x and row y, of [`super::Settings::samples`] in each; `None`:
/// there is no such pixel or sample.
pub fn tell(job: &Job, pixel: (u32, u32), sample: u32) -> Option<RayTree> {
    let settings = &job.settings.fixed();
    let context = Context::new(job.scene, job.world, job.textures, settings);
    let (seen, told) = trace_sample::<_, Listener>(&context, job.accel, job.view, settings, pixel, sample)?;
    let mut queries = gather(told);
    let parents: Vec<Option<usize>> = (0..queries.len()).map(|i| parent(job, &queries, i)).collect();
    let order = from_the_root(&parents);
    let place = |old: usize| order.iter().position(|&o| o == old);
    let mut sorted: Vec<Query> = order.iter().map(|&old| queries[old].clone()).collect();
    for (old, parent) in parents.iter().enumerate() {
        if let (Some(child), Some(parent)) = (place(old), parent.and_then(place)) {
            sorted[parent].children.push(child);
        }
    }
    sorted.iter_mut().for_each(|query| query.children.sort_unstable());
    for i in 0..sorted.len() {
        if sorted[i].class == Class::Shadow {
            let raised = raised(&sorted, &sorted[i]);
            sorted[i].riser = raised.is_some();
            sorted[i].light = light(&context, &raised.unwrap_or(sorted[i].ray));
        }
    }
    queries.clear();
    Some(RayTree { queries: sorted, radiance: seen.radiance, through: seen.through, depth: context.depth })
}

/// All queries, class by class in the order they were asked.
fn gather(told: ByClass<Listener>) -> Vec<Query> {
    let ByClass { primary, shadow, reflected, refracted } = told;
    let listeners = Class::ALL.into_iter().zip([primary, shadow, reflected, refracted]);
    listeners.flat_map(|(class, l)| l.queries.into_iter().map(move |q| Query { class, ..q })).collect()
}

/// The query that query `i` came of; `None` for the eye's.
fn parent(job: &Job, queries: &[Query], i: usize) -> Option<usize> {
    let query = &queries[i];
    let same_ray = |q: &Query| q.ray == query.ray;
    match query.question {
        // Behind a hit; the class may have changed on the way.
        Question::Next => queries.iter().position(|q| same_ray(q) && q.hit.bits() == query.after.bits()),
        // What lets light through is walked through where nothing stops it.
        Question::Closest if query.class == Class::Shadow => {
            queries.iter().position(|q| same_ray(q) && q.question == Question::Occluded)
        }
        _ if query.class == Class::Primary => None,
        _ => {
            let surfaces = || {
                let could = |(k, q): &(usize, &Query)| *k != i && q.class != Class::Shadow && q.hit.is_some();
                queries.iter().enumerate().filter(could).map(|(k, q)| (k, job.world.refine(&q.ray, &q.hit)))
            };
            // What goes through a flat surface starts before it.
            let before = |s: &Refined, ray: &Ray| query.class == Class::Refracted && s.origin(-ray.dir) == ray.origin;
            let starts = |s: &Refined, ray: &Ray| s.origin(ray.dir) == ray.origin || before(s, ray);
            let left_by = |ray: &Ray| surfaces().find(|(_, s)| starts(s, ray)).map(|(k, _)| k);
            // Some start above their surface, where another ray leads.
            let riser = || queries.iter().find(|q| raised(std::slice::from_ref(query), q).is_some());
            let off = |surface: &Refined| (surface.start - query.ray.origin).length_squared();
            let nearest = || surfaces().min_by(|(_, a), (_, b)| off(a).total_cmp(&off(b))).map(|(k, _)| k);
            // Nothing comes of a shadow ray, so that whatever it is given to makes no circle.
            let otherwise = || if query.class == Class::Shadow { nearest() } else { None };
            left_by(&query.ray).or_else(|| left_by(&riser()?.ray)).or_else(otherwise)
        }
    }
}

/// The one of these rays that starts above its surface, where this one leads up to.
fn raised(queries: &[Query], riser: &Query) -> Option<Ray> {
    let Ray { origin, dir, t_max, .. } = riser.ray;
    let asks = |q: &Query| q.class == Class::Shadow && q.question == Question::Occluded;
    let rises = asks(riser) && t_max == 1.0;
    queries.iter().find(|q| rises && asks(q) && q.ray.origin == origin + dir && q.ray != riser.ray).map(|q| q.ray)
}

/// The queries in an order in which each comes behind its parent, the descendants of one before the next.
fn from_the_root(parents: &[Option<usize>]) -> Vec<usize> {
    let children = |of: Option<usize>| (0..parents.len()).rev().filter(move |&i| parents[i] == of);
    let mut waiting: Vec<usize> = children(None).collect();
    let mut order = Vec::new();
    while let Some(next) = waiting.pop() {
        order.push(next);
        waiting.extend(children(Some(next)));
    }
    order
}

/// The light that a shadow ray goes to.
fn light(context: &Context, ray: &Ray) -> Option<usize> {
    let towards = |light: &super::shade::LocalLight| {
        let incident = light.incident(ray.origin)?;
        Some(incident.position.map_or(incident.to_light, |position| position - ray.origin) == ray.dir)
    };
    context.lights.iter().position(|light| light.shadows && towards(light) == Some(true))
}

/// Writes down what the rays of one class do.
#[derive(Debug, Default)]
struct Listener {
    queries: Vec<Query>,
}

impl Listener {
    fn note(&mut self, event: Event) {
        if let Some(query) = self.queries.last_mut() {
            query.events.push(event);
        }
    }

    fn count(&mut self, count: impl FnOnce(&mut RayCounts)) {
        if let Some(query) = self.queries.last_mut() {
            count(&mut query.counts);
        }
    }
}

impl Probe for Listener {
    fn query(&mut self) {
        self.count(Probe::query);
    }
    fn step(&mut self) {
        self.count(Probe::step);
    }
    fn visit(&mut self, visit: impl FnOnce() -> Visit) {
        self.note(Event::Visit(visit()));
    }
    fn cell(&mut self, empty: bool) {
        self.count(|counts| counts.cell(empty));
    }
    fn prim_test(&mut self) {
        self.count(Probe::prim_test);
    }
    fn prim_tests(&mut self, tests: u32) {
        self.count(|counts| counts.prim_tests(tests));
    }
    fn tested(&mut self, test: impl FnOnce() -> Test) {
        self.note(Event::Test(test()));
    }
    fn lanes_tested(&mut self, prims: &[u32; LANES], lanes: u32, outcome: Outcome) {
        let tested = prims.iter().enumerate().filter(|(lane, _)| lanes >> lane & 1 == 1);
        tested.for_each(|(_, &prim)| self.note(Event::Test(Test { prim, t: f32::NAN, outcome })));
    }
    fn repeat_skipped(&mut self, prim: u32) {
        self.count(|counts| counts.repeat_skipped(prim));
        self.note(Event::Skipped(prim));
    }
    fn volume_tests(&mut self, count: usize) {
        self.count(|counts| counts.volume_tests(count));
        if let Some(Event::Volumes(sum)) = self.queries.last_mut().and_then(|q| q.events.last_mut()) {
            *sum += count;
        } else {
            self.note(Event::Volumes(count));
        }
    }
    fn transforms(&mut self, count: usize) {
        self.count(|counts| counts.transforms(count));
        if let Some(Event::Transforms(sum)) = self.queries.last_mut().and_then(|q| q.events.last_mut()) {
            *sum += count;
        } else {
            self.note(Event::Transforms(count));
        }
    }
    fn found(&mut self) {
        self.count(Probe::found);
    }
}

impl Observer for Listener {
    const SLICE: usize = 1;

    fn asked(&mut self, question: Question, rays: &[Ray], after: &[Hit]) {
        let Some(&ray) = rays.first() else { return };
        self.queries.push(Query {
            class: Class::Primary,
            question,
            ray,
            after: after.first().copied().unwrap_or(Hit::MISS),
            events: Vec::new(),
            counts: RayCounts::default(),
            hit: Hit::MISS,
            children: Vec::new(),
            light: None,
            riser: false,
        });
    }

    fn answered(&mut self, hits: &[Hit]) {
        let Some(query) = self.queries.last_mut() else { return };
        query.hit = match hits.first() {
            Some(&hit) => hit,
            None => blocker(&query.events).unwrap_or(Hit::MISS),
        };
    }
}

/// What blocked a shadow ray: the test that hit.
fn blocker(events: &[Event]) -> Option<Hit> {
    events.iter().find_map(|event| match event {
        Event::Test(Test { prim, t, outcome }) if *outcome == Outcome::Hit => {
            Some(Hit { t: *t, u: 0.0, v: 0.0, prim: *prim })
        }
        _ => None,
    })
}
