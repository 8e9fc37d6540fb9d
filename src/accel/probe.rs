//! Counting is a type: timed runs carry [`NoProbe`], counted runs [`RayCounts`].
//!
//! Names are V. Havran's, from the statistics to Haines' Standard Procedural Databases (1999).

use std::ops::AddAssign;

/// What a walk tells about itself while it runs.
pub trait Probe: Default + Send {
    /// One ray was asked of the scene.
    fn query(&mut self) {}
    /// A node or cell was entered (n_ts).
    fn step(&mut self) {}
    /// A leaf cell was visited (n_ets), `empty` if nothing is listed in it (n_eets).
    fn cell(&mut self, _empty: bool) {}
    /// One ray/prim test (n_it).
    fn prim_test(&mut self) {}
    /// So many ray/prim tests at once.
    fn prim_tests(&mut self, _count: u32) {}
    /// A test the mailbox saved (n_mb).
    fn repeat_skipped(&mut self) {}
    /// So many ray/volume tests at once (n_bit).
    fn volume_tests(&mut self, _count: usize) {}
    /// So many corners and other points were transformed into the ray's axes (n_xf).
    fn transforms(&mut self, _count: usize) {}
    /// The query found a hit.
    fn found(&mut self) {}
}

/// Timed runs: every call is an empty inline function.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {}

/// Sums over the rays of one class; divide by `queries` for Havran's per-ray figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays asked.
    pub queries: u64,
    /// Rays that hit something.
    pub found: u64,
    /// Nodes and cells visited.
    pub n_ts: u64,
    /// Leaf cells visited.
    pub n_ets: u64,
    /// Empty leaf cells visited.
    pub n_eets: u64,
    /// Ray/prim tests.
    pub n_it: u64,
    /// Tests saved by the mailbox.
    pub n_mb: u64,
    /// Ray/volume tests.
    pub n_bit: u64,
    /// Points transformed into the axes of a ray.
    pub n_xf: u64,
}

impl Probe for RayCounts {
    fn query(&mut self) {
        self.queries += 1;
    }
    fn step(&mut self) {
        self.n_ts += 1;
    }
    fn cell(&mut self, empty: bool) {
        self.n_ets += 1;
        self.n_eets += u64::from(empty);
    }
    fn prim_test(&mut self) {
        self.n_it += 1;
    }
    fn prim_tests(&mut self, count: u32) {
        self.n_it += u64::from(count);
    }
    fn repeat_skipped(&mut self) {
        self.n_mb += 1;
    }
    fn volume_tests(&mut self, count: usize) {
        self.n_bit += count as u64;
    }
    fn transforms(&mut self, count: usize) {
        self.n_xf += count as u64;
    }
    fn found(&mut self) {
        self.found += 1;
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.queries += o.queries;
        self.found += o.found;
        self.n_ts += o.n_ts;
        self.n_ets += o.n_ets;
        self.n_eets += o.n_eets;
        self.n_it += o.n_it;
        self.n_mb += o.n_mb;
        self.n_bit += o.n_bit;
        self.n_xf += o.n_xf;
    }
}
