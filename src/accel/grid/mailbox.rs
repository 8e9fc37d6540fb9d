//! Mailboxes: a ray's memory of tested prims, so that a prim listed in several cells is tested once.
//!
//! After J. Amanatides, A. Woo, 1987, and B. Arnaldi, T. Priol, K. Bouatouch, 1987; the memory belongs to the worker, not to
//! the prim, so that threads do not interfere.

use crate::accel::NO_PRIM;
use crate::named::names;

/// Choice of the [`Mailbox`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MailboxKind {
    /// No mailbox.
    None,
    /// One stamp per prim, [`Stamps`].
    #[default]
    Exact,
    /// A small hash table, [`Hashed`].
    Hashed,
}

names!(MailboxKind, "mailbox", None => "none", Exact => "exact", Hashed => "hashed");

/// Remembers which prims the current ray has met.
///
/// Answering "first visit" too often only wastes a test. Answering "seen" for a prim that this ray has not met loses a
/// hit, and no kind may do it.
pub trait Mailbox: Send {
    /// Creates a mailbox for prims `0..prims`. Only [`AnyMailbox`] looks at `kind`.
    fn new(kind: MailboxKind, prims: u32) -> Self;
    /// Forgets all prims, for the next ray.
    fn next_ray(&mut self);
    /// Whether the current ray meets `prim` for the first time, as far as the mailbox remembers.
    fn first_visit(&mut self, prim: u32) -> bool;
}

/// Exact: one stamp per prim, current if it equals the ray's number.
#[derive(Clone, Debug)]
pub struct Stamps {
    stamp: Vec<u32>,
    ray: u32,
}

impl Mailbox for Stamps {
    fn new(_: MailboxKind, prims: u32) -> Self {
        Self { stamp: vec![0; prims as usize], ray: 0 }
    }

    #[inline]
    fn next_ray(&mut self) {
        // After 2³² − 1 rays an old stamp would look current: start over.
        self.ray = self.ray.checked_add(1).unwrap_or_else(|| {
            self.stamp.fill(0);
            1
        });
    }

    #[inline]
    fn first_visit(&mut self, prim: u32) -> bool {
        std::mem::replace(&mut self.stamp[prim as usize], self.ray) != self.ray
    }
}

/// Number of slots of [`Hashed`].
const PLACES: usize = 64;

/// A few slots, indexed by the prim's number modulo their count; a later prim replaces an earlier one. Forgets prims, but
/// takes no memory per prim. (I. Wald, *Realtime Ray Tracing and Interactive Global Illumination*, 2004; C. Benthin,
/// *Realtime Ray Tracing on Current CPU Architectures*, 2006.)
#[derive(Clone, Debug)]
pub struct Hashed {
    last: [u32; PLACES],
}

impl Mailbox for Hashed {
    fn new(_: MailboxKind, _prims: u32) -> Self {
        Self { last: [NO_PRIM; PLACES] }
    }

    #[inline]
    fn next_ray(&mut self) {
        self.last = [NO_PRIM; PLACES];
    }

    #[inline]
    fn first_visit(&mut self, prim: u32) -> bool {
        std::mem::replace(&mut self.last[prim as usize % PLACES], prim) != prim
    }
}

/// Mailbox of any kind, dispatched at every visit.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one for each worker")]
pub enum AnyMailbox {
    /// No memory: every visit counts as the first.
    None,
    /// One stamp per prim.
    Exact(Stamps),
    /// A small hash table.
    Hashed(Hashed),
}

impl Mailbox for AnyMailbox {
    fn new(kind: MailboxKind, prims: u32) -> Self {
        match kind {
            MailboxKind::None => Self::None,
            MailboxKind::Exact => Self::Exact(Stamps::new(kind, prims)),
            MailboxKind::Hashed => Self::Hashed(Hashed::new(kind, prims)),
        }
    }

    #[inline]
    fn next_ray(&mut self) {
        match self {
            Self::None => {}
            Self::Exact(stamps) => stamps.next_ray(),
            Self::Hashed(hashed) => hashed.next_ray(),
        }
    }

    #[inline]
    fn first_visit(&mut self, prim: u32) -> bool {
        match self {
            Self::None => true,
            Self::Exact(stamps) => stamps.first_visit(prim),
            Self::Hashed(hashed) => hashed.first_visit(prim),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hashed_mailbox_forgets_a_prim_when_another_takes_its_place_and_everything_with_the_ray() {
        let mut hashed = Hashed::new(MailboxKind::Hashed, 1000);
        hashed.next_ray();
        assert!(hashed.first_visit(3) && hashed.first_visit(4));
        assert!(!hashed.first_visit(3) && !hashed.first_visit(4));
        assert!(hashed.first_visit(3 + 64) && hashed.first_visit(3), "one pushes out the other");
        assert!(!hashed.first_visit(4));
        hashed.next_ray();
        assert!(hashed.first_visit(4));
    }

    #[test]
    fn a_prim_is_new_once_to_every_ray() {
        let mut stamps = Stamps::new(MailboxKind::Exact, 3);
        for _ in 0..3 {
            stamps.next_ray();
            assert!(stamps.first_visit(2) && stamps.first_visit(0));
            assert!(!stamps.first_visit(2) && !stamps.first_visit(0));
        }
    }

    #[test]
    fn an_old_stamp_does_not_come_back_when_the_numbers_wrap() {
        let mut stamps = Stamps::new(MailboxKind::Exact, 2);
        stamps.next_ray();
        assert!(stamps.first_visit(0));
        stamps.ray = u32::MAX;
        stamps.next_ray();
        assert!(stamps.first_visit(0), "stamped by the ray that had this number before");
        assert!(!stamps.first_visit(0));
    }
}
