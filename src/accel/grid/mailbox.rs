//! What a ray remembers of the prims it met, so that a prim listed in several cells is tested once.
//!
//! After J. Amanatides, A. Woo, 1987, and B. Arnaldi, T. Priol, K. Bouatouch, 1987; the memory belongs to the worker, not
//! to the prim, so that threads do not meet.

/// Remembers which prims the current ray has met.
///
/// Answering "first visit" too often only wastes a test. Answering "seen" for a prim that this ray has not met loses a
/// hit, and no kind may do it.
pub trait Mailbox: Send {
    /// For prims `0..prims`.
    fn new(prims: u32) -> Self;
    /// Forgets everything.
    fn next_ray(&mut self);
    /// Whether the current ray meets `prim` for the first time, as far as is known.
    fn first_visit(&mut self, prim: u32) -> bool;
}

/// Remembers nothing.
#[derive(Clone, Copy, Debug)]
pub struct NoMailbox;

impl Mailbox for NoMailbox {
    fn new(_prims: u32) -> Self {
        Self
    }
    fn next_ray(&mut self) {}
    fn first_visit(&mut self, _prim: u32) -> bool {
        true
    }
}

/// Exact: one stamp per prim, current if it equals the ray's number.
#[derive(Clone, Debug)]
pub struct Stamps {
    stamp: Vec<u32>,
    ray: u32,
}

impl Mailbox for Stamps {
    fn new(prims: u32) -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prim_is_new_once_to_every_ray() {
        let mut stamps = Stamps::new(3);
        for _ in 0..3 {
            stamps.next_ray();
            assert!(stamps.first_visit(2) && stamps.first_visit(0));
            assert!(!stamps.first_visit(2) && !stamps.first_visit(0));
        }
    }

    #[test]
    fn an_old_stamp_does_not_come_back_when_the_numbers_wrap() {
        let mut stamps = Stamps::new(2);
        stamps.next_ray();
        assert!(stamps.first_visit(0));
        stamps.ray = u32::MAX;
        stamps.next_ray();
        assert!(stamps.first_visit(0), "stamped by the ray that had this number before");
        assert!(!stamps.first_visit(0));
    }
}
