//! Asking a structure what rays hit, in slices, so that a user who gives up need not wait for a whole wave.

use super::Progress;
use super::observer::{Observer, Question};
use crate::accel::{Accel, Hit, Ray};

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
        for (rays, hits) in rays.chunks(P::SLICE).zip(hits.chunks_mut(P::SLICE)) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Closest, rays, &[]);
            self.accel.closest(rays, hits, &mut self.scratch, probe);
            probe.answered(hits);
        }
    }

    /// Whether anything opaque is hit by each ray.
    pub(crate) fn occluded<P: Observer>(&mut self, rays: &[Ray], blocked: &mut [bool], probe: &mut P) {
        for (rays, blocked) in rays.chunks(P::SLICE).zip(blocked.chunks_mut(P::SLICE)) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Occluded, rays, &[]);
            self.accel.occluded(rays, blocked, &mut self.scratch, probe);
            probe.answered(&[]);
        }
    }

    /// The first hit of each ray behind `after`.
    pub(crate) fn next<P: Observer>(&mut self, rays: &[Ray], after: &[Hit], hits: &mut [Hit], probe: &mut P) {
        for ((rays, after), hits) in rays.chunks(P::SLICE).zip(after.chunks(P::SLICE)).zip(hits.chunks_mut(P::SLICE)) {
            if self.gives_up() {
                return;
            }
            probe.asked(Question::Next, rays, after);
            self.accel.next(rays, after, hits, &mut self.scratch, probe);
            probe.answered(hits);
        }
    }

    fn gives_up(&mut self) -> bool {
        self.cancelled |= self.progress.cancelled();
        self.cancelled
    }
}
