//! Asking a structure what rays hit, in slices, so that a user who gives up need not wait for a whole wave.

use super::Progress;
use super::filters::Through;
use super::observer::{Observer, Question};
use crate::accel::{Accel, Gaps, Hit, Holes, Looking, Ray};

/// A structure, one worker's scratch for it, and whoever may end the work.
pub(crate) struct Asking<'a, A: Accel> {
    accel: &'a A,
    scratch: A::Scratch,
    progress: &'a dyn Progress,
    /// Set once the user has given up; answers after that mean nothing.
    pub cancelled: bool,
}

impl<'a, A: Accel> Asking<'a, A> {
    pub(crate) fn new(accel: &'a A, progress: &'a dyn Progress) -> Self {
        Self { accel, scratch: accel.scratch(), progress, cancelled: false }
    }

    /// The first hit of each ray.
    pub(crate) fn closest<P: Observer>(&mut self, rays: &[Ray], hits: &mut [Hit], probe: &mut P) {
        self.look(&Looking::along(rays), hits, probe);
    }

    /// The same, or the first behind another; they may pass gaps that are known.
    pub(crate) fn look<P: Observer>(&mut self, looking: &Looking, hits: &mut [Hit], probe: &mut P) {
        let question = if looking.after.is_some() { Question::Next } else { Question::Closest };
        for (k, hits) in hits.chunks_mut(P::SLICE).enumerate() {
            if self.gives_up() {
                return;
            }
            let start = k * P::SLICE;
            let part = start..start + hits.len();
            let (rays, after) = (&looking.rays[part.clone()], looking.after.map(|after| &after[part.clone()]));
            let pencil = looking.pencil.map(|pencil| pencil.part(part));
            let since = looking.gaps.map(|gaps| Since { gaps, start });
            let gaps = since.as_ref().map(|since| since as &dyn Gaps);
            probe.asked(question, rays, after.unwrap_or_default());
            let looking = Looking { rays, pencil: pencil.as_ref(), after, gaps };
            self.accel.look(&looking, hits, &mut self.scratch, probe);
            probe.answered(hits);
        }
    }

    /// The first hit of each ray behind `after`.
    pub(crate) fn next<P: Observer>(&mut self, rays: &[Ray], after: &[Hit], hits: &mut [Hit], probe: &mut P) {
        self.look(&Looking { after: Some(after), ..Looking::along(rays) }, hits, probe);
    }

    /// Whether anything opaque is hit by each ray.
    pub(crate) fn occluded<P: Observer>(&mut self, rays: &[Ray], blocked: &mut [bool], probe: &mut P) {
        self.blocked(rays, None, blocked, probe);
    }

    /// The same, and whether anything else is hit where it stops light.
    pub(crate) fn stopped<P: Observer>(&mut self, through: &Through, blocked: &mut [bool], probe: &mut P) {
        self.blocked(through.rays, Some(through), blocked, probe);
    }

    fn blocked<P: Observer>(&mut self, rays: &[Ray], through: Option<&Through>, blocked: &mut [bool], probe: &mut P) {
        let slices = rays.chunks(P::SLICE).zip(blocked.chunks_mut(P::SLICE));
        for (start, (rays, blocked)) in (0..).step_by(P::SLICE).zip(slices) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Occluded, rays, &[]);
            let part = through.map(|through| through.part(start..start + rays.len()));
            let holes = part.as_ref().map(|part| part as &dyn Holes);
            self.accel.blocked(rays, holes, blocked, &mut self.scratch, probe);
            probe.answered(&[]);
        }
    }

    fn gives_up(&mut self) -> bool {
        self.cancelled |= self.progress.cancelled();
        self.cancelled
    }
}

/// What is known of rays from one on.
struct Since<'a> {
    gaps: &'a dyn Gaps,
    start: usize,
}

impl Gaps for Since<'_> {
    fn is_gap(&self, ray: usize, prim: u32) -> bool {
        self.gaps.is_gap(self.start + ray, prim)
    }

    fn gaps(&self, first: usize, rays: u32, prim: u32) -> u32 {
        self.gaps.gaps(self.start + first, rays, prim)
    }
}
