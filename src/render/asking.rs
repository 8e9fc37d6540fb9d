//! Asking a structure what rays hit, in slices, so that a user who gives up need not wait for a whole wave.

use super::Progress;
use super::filters::Through;
use super::observer::{Observer, Question};
use crate::accel::{Accel, Gaps, Hit, Holes, Looking, Pencil, Ray};

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
        self.closest_of(rays, (None, None), hits, probe);
    }

    /// The same of rays that are those of a pencil, if there is one, and that may pass gaps, if anybody knows of any.
    pub(crate) fn closest_of<P: Observer>(
        &mut self,
        rays: &[Ray],
        (pencil, gaps): (Option<Pencil>, Option<&dyn Gaps>),
        hits: &mut [Hit],
        probe: &mut P,
    ) {
        let slices = rays.chunks(P::SLICE).zip(hits.chunks_mut(P::SLICE));
        for (start, (rays, hits)) in (0..).step_by(P::SLICE).zip(slices) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Closest, rays, &[]);
            let pencil = pencil.map(|pencil| pencil.part(start..start + rays.len()));
            match (gaps, &pencil) {
                (Some(gaps), pencil) => {
                    let gaps = &Since { gaps, start };
                    let looking = Looking { rays, pencil: pencil.as_ref(), after: None, gaps };
                    self.accel.look(&looking, hits, &mut self.scratch, probe);
                }
                (None, Some(pencil)) => self.accel.closest_from(pencil, rays, hits, &mut self.scratch, probe),
                (None, None) => self.accel.closest(rays, hits, &mut self.scratch, probe),
            }
            probe.answered(hits);
        }
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

    /// The first hit of each ray behind `after`; they may pass gaps, if anybody knows of any.
    pub(crate) fn next<P: Observer>(
        &mut self,
        rays: &[Ray],
        (after, gaps): (&[Hit], Option<&dyn Gaps>),
        hits: &mut [Hit],
        probe: &mut P,
    ) {
        let slices = rays.chunks(P::SLICE).zip(after.chunks(P::SLICE)).zip(hits.chunks_mut(P::SLICE));
        for (start, ((rays, after), hits)) in (0..).step_by(P::SLICE).zip(slices) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Next, rays, after);
            match gaps {
                Some(gaps) => {
                    let gaps = &Since { gaps, start };
                    let looking = Looking { rays, pencil: None, after: Some(after), gaps };
                    self.accel.look(&looking, hits, &mut self.scratch, probe);
                }
                None => self.accel.next(rays, after, hits, &mut self.scratch, probe),
            }
            probe.answered(hits);
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
