//! Rays that are asked together: the three questions, and where their answers go.
//!
//! A structure may ask the rays of a wave in any order and in any number at once.

use super::query::{Closest, Goal, Next, Occluded, Query};
use super::{Hit, Intersector, Probe, Ray, Shapes};

/// Rays that are asked the same question, and where the answers go.
#[expect(clippy::len_without_is_empty, reason = "nobody asks")]
pub trait Wave {
    /// What they look for.
    type Goal: Goal;

    /// How many there are.
    fn len(&self) -> usize;

    /// A ray.
    fn ray(&self, i: usize) -> &Ray;

    /// From where on its hits count.
    #[inline(always)]
    fn t_min(&self, i: usize) -> f32 {
        self.ray(i).t_min
    }

    /// What it looks for.
    fn goal(&self, i: usize) -> Self::Goal;

    /// Takes the answer of a ray that meets nothing.
    fn miss(&mut self, i: usize);

    /// Takes the answer of a ray whose hit is known to the last bit, where hits are asked for.
    fn found(&mut self, i: usize, hit: Hit);

    /// Takes an answer, and tells whether there was a hit.
    fn answer(&mut self, i: usize, query: &Query<Self::Goal>) -> bool;
}

pub(super) struct ForFirst<'w, I> {
    pub rays: &'w [Ray],
    pub hits: &'w mut [Hit],
    pub test: I,
}

impl<I: Intersector> Wave for ForFirst<'_, I> {
    type Goal = Closest<I>;

    #[inline]
    fn len(&self) -> usize {
        self.rays.len().min(self.hits.len())
    }

    #[inline(always)]
    fn ray(&self, i: usize) -> &Ray {
        &self.rays[i]
    }

    #[inline(always)]
    fn goal(&self, _: usize) -> Closest<I> {
        Closest::nothing(self.test)
    }

    #[inline(always)]
    fn miss(&mut self, i: usize) {
        self.hits[i] = Hit::MISS;
    }

    #[inline(always)]
    fn found(&mut self, i: usize, hit: Hit) {
        self.hits[i] = hit;
    }

    #[inline]
    fn answer(&mut self, i: usize, query: &Query<Closest<I>>) -> bool {
        self.hits[i] = query.hit();
        self.hits[i].is_some()
    }
}

pub(super) struct ForAny<'w, I> {
    pub rays: &'w [Ray],
    pub blocked: &'w mut [bool],
    pub test: I,
}

impl<I: Intersector> Wave for ForAny<'_, I> {
    type Goal = Occluded<I>;

    #[inline]
    fn len(&self) -> usize {
        self.rays.len().min(self.blocked.len())
    }

    #[inline(always)]
    fn ray(&self, i: usize) -> &Ray {
        &self.rays[i]
    }

    #[inline(always)]
    fn goal(&self, _: usize) -> Occluded<I> {
        Occluded::nothing(self.test)
    }

    #[inline(always)]
    fn miss(&mut self, i: usize) {
        self.blocked[i] = false;
    }

    #[inline(always)]
    fn found(&mut self, i: usize, hit: Hit) {
        self.blocked[i] = hit.is_some();
    }

    #[inline]
    fn answer(&mut self, i: usize, query: &Query<Occluded<I>>) -> bool {
        self.blocked[i] = query.goal.found;
        self.blocked[i]
    }
}

pub(super) struct ForNext<'w, I> {
    pub rays: &'w [Ray],
    pub after: &'w [Hit],
    pub hits: &'w mut [Hit],
    pub test: I,
}

impl<I: Intersector> Wave for ForNext<'_, I> {
    type Goal = Next<I>;

    #[inline]
    fn len(&self) -> usize {
        self.rays.len().min(self.hits.len())
    }

    #[inline(always)]
    fn ray(&self, i: usize) -> &Ray {
        &self.rays[i]
    }

    #[inline(always)]
    fn t_min(&self, i: usize) -> f32 {
        self.rays[i].t_min.max(self.after[i].t)
    }

    #[inline(always)]
    fn goal(&self, i: usize) -> Next<I> {
        Next::nothing(&self.after[i], self.test)
    }

    #[inline(always)]
    fn miss(&mut self, i: usize) {
        self.hits[i] = Hit::MISS;
    }

    #[inline(always)]
    fn found(&mut self, i: usize, hit: Hit) {
        self.hits[i] = hit;
    }

    #[inline]
    fn answer(&mut self, i: usize, query: &Query<Next<I>>) -> bool {
        self.hits[i] = query.hit();
        self.hits[i].is_some()
    }
}

/// The query of a ray of a wave, and whether it can hit anything. [`Query::test_planes`] comes next.
#[inline(always)]
pub fn begin<'a, W: Wave, P: Probe>(
    shapes: &'a Shapes,
    wave: &W,
    i: usize,
    probe: &mut P,
) -> (Query<'a, W::Goal>, bool) {
    probe.query();
    Query::new(shapes, wave.ray(i), wave.t_min(i), wave.goal(i))
}

/// Gives the answer that was found.
#[inline(always)]
pub fn end<W: Wave, P: Probe>(wave: &mut W, i: usize, query: &Query<W::Goal>, probe: &mut P) {
    if wave.answer(i, query) {
        probe.found();
    }
}
