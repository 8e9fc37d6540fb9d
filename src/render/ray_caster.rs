//! Queries of a structure in slices of rays, so that a user who cancels need not wait for a whole wave.

use super::Progress;
use super::observer::{Observer, Question};
use super::shadow::filters::ShadowFilter;
use crate::accel::{Accel, Hit, HitQueries, IntersectFilter, OccludedFilter, Ray};

/// A structure, one worker's scratch space for it, and the progress through which a user may cancel.
pub(crate) struct RayCaster<'a, A: Accel> {
    accel: &'a A,
    scratch: A::Scratch,
    progress: &'a dyn Progress,
    /// Set once the user has cancelled; later answers are meaningless.
    pub cancelled: bool,
}

impl<'a, A: Accel> RayCaster<'a, A> {
    pub(crate) fn new(accel: &'a A, progress: &'a dyn Progress) -> Self {
        Self { accel, scratch: accel.scratch(), progress, cancelled: false }
    }

    /// Finds the first hit of each ray.
    pub(crate) fn closest<P: Observer>(&mut self, rays: &[Ray], hits: &mut [Hit], probe: &mut P) {
        self.first_hits(&HitQueries::along(rays), hits, probe);
    }

    /// Finds the first hit of each ray, or the first behind another hit; hits that the filter rejects may be skipped.
    pub(crate) fn first_hits<P: Observer>(&mut self, queries: &HitQueries, hits: &mut [Hit], probe: &mut P) {
        let question = if queries.after.is_some() { Question::Next } else { Question::Closest };
        for (k, hits) in hits.chunks_mut(P::SLICE).enumerate() {
            if self.gives_up() {
                return;
            }
            let start = k * P::SLICE;
            let part = start..start + hits.len();
            let (rays, after) = (&queries.rays[part.clone()], queries.after.map(|after| &after[part.clone()]));
            let pencil = queries.pencil.map(|pencil| pencil.part(part));
            let offset = queries.filter.map(|filter| OffsetFilter { filter, start });
            let filter = offset.as_ref().map(|offset| offset as &dyn IntersectFilter);
            probe.asked(question, rays, after.unwrap_or_default());
            let queries = HitQueries { rays, pencil: pencil.as_ref(), after, filter };
            self.accel.first_hits(&queries, hits, &mut self.scratch, probe);
            probe.answered(hits);
        }
    }

    /// Finds the first hit of each ray behind `after`.
    pub(crate) fn next<P: Observer>(&mut self, rays: &[Ray], after: &[Hit], hits: &mut [Hit], probe: &mut P) {
        self.first_hits(&HitQueries { after: Some(after), ..HitQueries::along(rays) }, hits, probe);
    }

    /// Finds whether each ray hits anything opaque.
    pub(crate) fn occluded<P: Observer>(&mut self, rays: &[Ray], occluded: &mut [bool], probe: &mut P) {
        self.occluded_filtered(rays, None, occluded, probe);
    }

    /// Finds whether each ray hits anything opaque, or anything else where it stops light.
    pub(crate) fn stopped<P: Observer>(&mut self, shadow_filter: &ShadowFilter, occluded: &mut [bool], probe: &mut P) {
        self.occluded_filtered(shadow_filter.rays, Some(shadow_filter), occluded, probe);
    }

    fn occluded_filtered<P: Observer>(
        &mut self,
        rays: &[Ray],
        shadow_filter: Option<&ShadowFilter>,
        occluded: &mut [bool],
        probe: &mut P,
    ) {
        let slices = rays.chunks(P::SLICE).zip(occluded.chunks_mut(P::SLICE));
        for (start, (rays, occluded)) in (0..).step_by(P::SLICE).zip(slices) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Occluded, rays, &[]);
            let part = shadow_filter.map(|shadow_filter| shadow_filter.part(start..start + rays.len()));
            let filter = part.as_ref().map(|part| part as &dyn OccludedFilter);
            self.accel.occluded_filtered(rays, filter, occluded, &mut self.scratch, probe);
            probe.answered(&[]);
        }
    }

    fn gives_up(&mut self) -> bool {
        self.cancelled |= self.progress.cancelled();
        self.cancelled
    }
}

/// A filter for the rays from `start` on.
struct OffsetFilter<'a> {
    filter: &'a dyn IntersectFilter,
    start: usize,
}

impl IntersectFilter for OffsetFilter<'_> {
    fn rejects(&self, ray: usize, prim: u32) -> bool {
        self.filter.rejects(self.start + ray, prim)
    }

    fn rejects_of(&self, first: usize, rays: u32, prim: u32) -> u32 {
        self.filter.rejects_of(self.start + first, rays, prim)
    }
}
