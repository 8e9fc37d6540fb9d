//! No culling: every ray against every shape. The specification of every other structure.

use super::query::{Culling, Goal, Query};
use super::{Probe, Shapes, StructureStats};

/// Tests everything.
#[derive(Clone, Copy, Debug)]
pub struct Unculled<'a> {
    shapes: &'a Shapes,
}

impl<'a> Unculled<'a> {
    /// Nothing to build.
    pub fn new(shapes: &'a Shapes) -> Self {
        Self { shapes }
    }

    /// All zero but the references: every prim is listed once.
    pub fn summary(&self) -> StructureStats {
        StructureStats::listing(self.shapes.bounded())
    }

    /// Nothing is built that could lose a hit.
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
