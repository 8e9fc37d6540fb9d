//! Record of one eye ray: the nodes and prims that its walk visits and tests, its hit, and the same for all its descendants.
//!
//! Rays of a picture travel in waves without links to their parents. But the origin of a ray that starts on a surface follows bit
//! for bit from the ray that hit the surface, so the tree is reconstructed from the rays themselves.

use super::by_class::ByClass;
use super::observer::{Observer, Question};
use super::tile::trace_sample;
use super::{CLASS_NAMES, Context, Job};
use crate::accel::probe::{Outcome, Test, Visit};
use crate::accel::refine::Refined;
use crate::accel::{Hit, Probe, Ray, RayCounts};
use crate::math::Vec3;
use crate::math::simd::LANES;

/// One step of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The walk entered a node or cell.
    Visit(Visit),
    /// The walk tested a prim.
    Test(Test),
    /// The mailbox skipped this prim.
    Skipped(u32),
    /// The walk tested this number of volumes.
    Volumes(usize),
    /// The walk transformed this number of points into the ray's axes.
    Transforms(usize),
}

/// Kind of a ray, by what sent it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Sent by the eye.
    Primary,
    /// Sent by a point towards a light.
    Shadow,
    /// Reflected by a surface.
    Reflected,
    /// Refracted by glass, or passed through a surface.
    Refracted,
}

impl Class {
    const ALL: [Self; 4] = [Self::Primary, Self::Shadow, Self::Reflected, Self::Refracted];

    /// Name as printed.
    pub const fn name(self) -> &'static str {
        CLASS_NAMES[self as usize]
    }
}

/// One query of one ray, with all the steps of its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Query {
    /// Class of the ray.
    pub class: Class,
    /// Question of the query.
    pub question: Question,
    /// The ray, in the centred frame.
    pub ray: Ray,
    /// The hit behind which the search went on; [`Hit::MISS`] for other questions.
    pub after: Hit,
    /// Steps of the walk, in order.
    pub events: Vec<Event>,
    /// Counts over all steps.
    pub counts: RayCounts,
    /// The hit; for an occluded shadow ray only its `prim` counts, that of the first occluder found.
    pub hit: Hit,
    /// Indices of the ray's children in [`RayTree::queries`].
    pub children: Vec<usize>,
    /// Light that a shadow ray is sent to, an index into the scene's lights.
    pub light: Option<usize>,
    /// Whether a shadow ray leads only to the origin of another one, which starts above its surface.
    pub riser: bool,
}

/// All queries for one sample of a pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayTree {
    /// Queries, that of the eye ray first. A parent comes before its children.
    pub queries: Vec<Query>,
    /// Linear colour of the sample, without the background.
    pub radiance: Vec3,
    /// Share of the background that shows through.
    pub through: Vec3,
    /// The maximum depth used.
    pub depth: u32,
}

/// Traces one sample (counted from 0) of the pixel in column x and row y, with [`super::Settings::samples`] samples in each;
/// `None` if there is no such pixel or sample.
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

/// All queries, class by class in the order in which they were asked.
fn gather(told: ByClass<Listener>) -> Vec<Query> {
    let ByClass { primary, shadow, reflected, refracted } = told;
    let listeners = Class::ALL.into_iter().zip([primary, shadow, reflected, refracted]);
    listeners.flat_map(|(class, l)| l.queries.into_iter().map(move |q| Query { class, ..q })).collect()
}

/// Index of the parent of query `i`; `None` for the eye ray's.
fn parent(job: &Job, queries: &[Query], i: usize) -> Option<usize> {
    let query = &queries[i];
    let same_ray = |q: &Query| q.ray == query.ray;
    match query.question {
        // Continues behind a hit; the class may have changed on the way.
        Question::Next => queries.iter().position(|q| same_ray(q) && q.hit.bits() == query.after.bits()),
        // Shadow rays walk through transmitting surfaces once nothing is found to stop them.
        Question::Closest if query.class == Class::Shadow => {
            queries.iter().position(|q| same_ray(q) && q.question == Question::Occluded)
        }
        _ if query.class == Class::Primary => None,
        _ => {
            let surfaces = || {
                let could = |(k, q): &(usize, &Query)| *k != i && q.class != Class::Shadow && q.hit.is_some();
                queries.iter().enumerate().filter(could).map(|(k, q)| (k, job.world.refine(&q.ray, &q.hit)))
            };
            // A ray through a flat surface starts before it.
            let before = |s: &Refined, ray: &Ray| query.class == Class::Refracted && s.origin(-ray.dir) == ray.origin;
            let starts = |s: &Refined, ray: &Ray| s.origin(ray.dir) == ray.origin || before(s, ray);
            let left_by = |ray: &Ray| surfaces().find(|(_, s)| starts(s, ray)).map(|(k, _)| k);
            // Some shadow rays start above their surface, at the end of another ray.
            let riser = || queries.iter().find(|q| raised(std::slice::from_ref(query), q).is_some());
            let off = |surface: &Refined| (surface.start - query.ray.origin).length_squared();
            let nearest = || surfaces().min_by(|(_, a), (_, b)| off(a).total_cmp(&off(b))).map(|(k, _)| k);
            // A shadow ray has no children, so whatever parent it is given, no cycle arises.
            let otherwise = || if query.class == Class::Shadow { nearest() } else { None };
            left_by(&query.ray).or_else(|| left_by(&riser()?.ray)).or_else(otherwise)
        }
    }
}

/// Returns the shadow ray that starts above its surface, where `riser` ends.
fn raised(queries: &[Query], riser: &Query) -> Option<Ray> {
    let Ray { origin, dir, t_max, .. } = riser.ray;
    let asks = |q: &Query| q.class == Class::Shadow && q.question == Question::Occluded;
    let rises = asks(riser) && t_max == 1.0;
    queries.iter().find(|q| rises && asks(q) && q.ray.origin == origin + dir && q.ray != riser.ray).map(|q| q.ray)
}

/// Order of the queries in which each comes after its parent, with all descendants of one before the next.
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

/// Light that a shadow ray is sent to.
fn light(context: &Context, ray: &Ray) -> Option<usize> {
    let towards = |light: &super::shade::LocalLight| {
        let incident = light.incident(ray.origin)?;
        Some(incident.position.map_or(incident.to_light, |position| position - ray.origin) == ray.dir)
    };
    context.lights.iter().position(|light| light.shadows && towards(light) == Some(true))
}

/// Records the walks of the rays of one class.
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

/// Returns the hit that blocked a shadow ray: the test that succeeded.
fn blocker(events: &[Event]) -> Option<Hit> {
    events.iter().find_map(|event| match event {
        Event::Test(Test { prim, t, outcome }) if *outcome == Outcome::Hit => {
            Some(Hit { t: *t, u: 0.0, v: 0.0, prim: *prim })
        }
        _ => None,
    })
}
