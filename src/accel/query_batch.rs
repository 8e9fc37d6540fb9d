//! Batches of rays with the same query: the three kinds of query, and the destinations of their answers.
//!
//! A structure may trace the rays of a batch in any order and in any number at once.

use std::ops::Range;

use super::query::{Closest, Goal, Next, Occluded, Query};
use super::{Hit, IntersectFilter, Intersector, NO_PRIM, OccludedFilter, Probe, Ray, Shapes};
use crate::math::Vec3;
use crate::math::simd::{LANES, Row};

/// Unbounded rays from a common origin that exclude no prim.
#[derive(Clone, Copy, Debug)]
pub struct Pencil<'w> {
    /// Common origin.
    pub origin: Vec3,
    /// Directions, by axis.
    pub dirs: [&'w [f32]; 3],
}

impl Pencil<'_> {
    /// Directions of the eight rays from `start` on.
    #[inline(always)]
    pub(super) fn eight(&self, start: usize) -> [Row; 3] {
        let [x, y, z] = self.dirs;
        let mut eight = [[0.0; LANES]; 3];
        eight[0].copy_from_slice(&x[start..start + LANES]);
        eight[1].copy_from_slice(&y[start..start + LANES]);
        eight[2].copy_from_slice(&z[start..start + LANES]);
        eight
    }

    /// Ray `i` of the pencil, with sample 0.
    #[inline(always)]
    pub(super) fn ray(&self, i: usize) -> Ray {
        let [x, y, z] = self.dirs;
        Ray::new(self.origin, Vec3::new(x[i], y[i], z[i]))
    }

    /// Sub-range of the rays; empty if the pencil has fewer.
    #[must_use]
    pub fn part(&self, rays: Range<usize>) -> Self {
        Self { dirs: self.dirs.map(|row| row.get(rays.clone()).unwrap_or(&[])), ..*self }
    }
}

/// Rays with the same query, and the destinations of their answers.
pub trait QueryBatch {
    /// Kind of the query.
    type Goal: Goal;

    /// Rays of the batch; each gets one answer.
    fn rays(&self) -> &[Ray];

    /// Ray `i`, read from its fastest source.
    #[inline(always)]
    fn ray(&self, i: usize) -> Ray {
        self.rays()[i]
    }

    /// Prim that ray `i` excludes.
    #[inline(always)]
    fn exclude(&self, i: usize) -> u32 {
        self.rays()[i].exclude
    }

    /// Smallest t of a hit of ray `i`.
    #[inline(always)]
    fn t_min(&self, i: usize) -> f32 {
        self.ray(i).t_min
    }

    /// Replaces the rays' own `t_min`, for consecutive rays from `start` on, by [`Self::t_min`].
    #[inline(always)]
    fn adapt_t_min(&self, _start: usize, _t_min: &mut [f32]) {}

    /// The rays as a pencil, if they share one origin.
    #[inline(always)]
    fn pencil(&self) -> Option<Pencil<'_>> {
        None
    }

    /// Filter that rejects hits, if any.
    #[inline(always)]
    fn filter(&self) -> Option<&dyn IntersectFilter> {
        None
    }

    /// Goal of ray `i`.
    fn goal(&self, i: usize) -> Self::Goal;

    /// Takes the answer of ray `i`: a hit or miss that is already exact to the last bit.
    fn take(&mut self, i: usize, hit: Hit);

    /// [`Self::take`] for consecutive rays from `start` on.
    #[inline(always)]
    fn take_all(&mut self, start: usize, hits: &[Hit]) {
        (start..).zip(hits).for_each(|(i, hit)| self.take(i, *hit));
    }

    /// Takes the answer from a finished query and returns whether there was a hit.
    fn answer(&mut self, i: usize, query: &Query<Self::Goal>) -> bool;
}

pub(super) struct ClosestBatch<'w, I> {
    pub rays: &'w [Ray],
    pub pencil: Option<Pencil<'w>>,
    pub filter: Option<&'w dyn IntersectFilter>,
    pub hits: &'w mut [Hit],
    pub test: I,
}

impl<'w, I: Intersector> QueryBatch for ClosestBatch<'w, I> {
    type Goal = Closest<'w, I>;

    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        self.rays
    }

    #[inline(always)]
    fn ray(&self, i: usize) -> Ray {
        match &self.pencil {
            Some(pencil) => pencil.ray(i),
            None => self.rays[i],
        }
    }

    #[inline(always)]
    fn exclude(&self, i: usize) -> u32 {
        if self.pencil.is_some() { NO_PRIM } else { self.rays[i].exclude }
    }

    #[inline(always)]
    fn pencil(&self) -> Option<Pencil<'_>> {
        self.pencil
    }

    #[inline(always)]
    fn filter(&self) -> Option<&dyn IntersectFilter> {
        self.filter
    }

    #[inline(always)]
    fn goal(&self, i: usize) -> Closest<'w, I> {
        Closest::nothing(self.test).passing(self.filter, i)
    }

    #[inline(always)]
    fn take(&mut self, i: usize, hit: Hit) {
        self.hits[i] = hit;
    }

    #[inline(always)]
    fn take_all(&mut self, start: usize, hits: &[Hit]) {
        self.hits[start..start + hits.len()].copy_from_slice(hits);
    }

    #[inline]
    fn answer(&mut self, i: usize, query: &Query<Closest<'w, I>>) -> bool {
        self.hits[i] = query.hit();
        self.hits[i].is_some()
    }
}

pub(super) struct OccludedBatch<'w, I> {
    pub rays: &'w [Ray],
    pub filter: Option<&'w dyn OccludedFilter>,
    pub occluded: &'w mut [bool],
    pub test: I,
}

impl<'w, I: Intersector> QueryBatch for OccludedBatch<'w, I> {
    type Goal = Occluded<'w, I>;

    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        self.rays
    }

    #[inline(always)]
    fn goal(&self, i: usize) -> Occluded<'w, I> {
        Occluded::by(self.filter, i, self.test)
    }

    #[inline(always)]
    fn take(&mut self, i: usize, hit: Hit) {
        self.occluded[i] = hit.is_some();
    }

    #[inline(always)]
    fn take_all(&mut self, start: usize, hits: &[Hit]) {
        let occluded = &mut self.occluded[start..start + hits.len()];
        occluded.iter_mut().zip(hits).for_each(|(occluded, hit)| *occluded = hit.is_some());
    }

    #[inline]
    fn answer(&mut self, i: usize, query: &Query<Occluded<'w, I>>) -> bool {
        self.occluded[i] = query.goal.found;
        self.occluded[i]
    }
}

pub(super) struct NextBatch<'w, I> {
    pub rays: &'w [Ray],
    pub after: &'w [Hit],
    pub filter: Option<&'w dyn IntersectFilter>,
    pub hits: &'w mut [Hit],
    pub test: I,
}

impl<'w, I: Intersector> QueryBatch for NextBatch<'w, I> {
    type Goal = Next<'w, I>;

    #[inline(always)]
    fn rays(&self) -> &[Ray] {
        self.rays
    }

    #[inline(always)]
    fn t_min(&self, i: usize) -> f32 {
        self.rays[i].t_min.max(self.after[i].t)
    }

    #[inline(always)]
    fn adapt_t_min(&self, start: usize, t_min: &mut [f32]) {
        for (t_min, after) in t_min.iter_mut().zip(&self.after[start..]) {
            *t_min = t_min.max(after.t);
        }
    }

    #[inline(always)]
    fn filter(&self) -> Option<&dyn IntersectFilter> {
        self.filter
    }

    #[inline(always)]
    fn goal(&self, i: usize) -> Next<'w, I> {
        Next::after(&self.after[i], Closest::nothing(self.test).passing(self.filter, i))
    }

    #[inline(always)]
    fn take(&mut self, i: usize, hit: Hit) {
        self.hits[i] = hit;
    }

    #[inline(always)]
    fn take_all(&mut self, start: usize, hits: &[Hit]) {
        self.hits[start..start + hits.len()].copy_from_slice(hits);
    }

    #[inline]
    fn answer(&mut self, i: usize, query: &Query<Next<'w, I>>) -> bool {
        self.hits[i] = query.hit();
        self.hits[i].is_some()
    }
}

/// Starts the query of ray `i`; also returns whether it can hit anything. Call [`Query::test_planes`] next.
#[inline(always)]
pub fn begin<'a, W: QueryBatch, P: Probe>(
    shapes: &'a Shapes,
    batch: &W,
    i: usize,
    probe: &mut P,
) -> (Query<'a, W::Goal>, bool) {
    probe.query();
    Query::new(shapes, &batch.rays()[i], batch.t_min(i), batch.goal(i))
}

/// Hands the answer of a finished query to the batch.
#[inline(always)]
pub fn end<W: QueryBatch, P: Probe>(batch: &mut W, i: usize, query: &Query<W::Goal>, probe: &mut P) {
    if batch.answer(i, query) {
        probe.found();
    }
}
