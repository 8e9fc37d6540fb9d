//! No culling: every ray is tested against every shape. The specification of every other structure.

use super::query::{Culling, Goal, Query};
use super::{Probe, Shapes, StructureStats};

/// Structure that tests every prim.
#[derive(Clone, Copy, Debug)]
pub struct Unculled<'a> {
    shapes: &'a Shapes,
}

impl<'a> Unculled<'a> {
    /// Creates the structure; there is nothing to build.
    pub fn new(shapes: &'a Shapes) -> Self {
        Self { shapes }
    }

    /// Sizes: all zero but the references, because every prim is listed once.
    pub fn summary(&self) -> StructureStats {
        StructureStats::listing(self.shapes.bounded())
    }

    /// Always succeeds: nothing is built that could lose a hit.
    pub fn check(&self) -> Result<StructureStats, String> {
        Ok(self.summary())
    }
}

impl Culling for Unculled<'_> {
    type Scratch = ();

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) {}

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, (): &mut (), probe: &mut P) {
        query.test_all(probe);
    }
}
