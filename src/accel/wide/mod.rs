//! The fast structures: a tree of nodes with eight children, whose leaves are blocks of eight triangles.
//!
//! Two ways of cutting the scene share one memory layout (`node`), one walk (`walk`) and one proof (`check`):
//!
//! - `fast-octree` ([`Splitting::Octree`]): the uniform grid refined by octrees, kept as boxes. The scene's cube is cut at
//!   dyadic planes, those of grid and octree cells, each time at the coarsest plane that separates what is left; every
//!   part keeps the tight box of its prims instead of the cell, so that empty space is never visited.
//! - `fast-bvh` ([`Splitting::SurfaceArea`]): a hierarchy of boxes by the surface area heuristic in bins.
//!
//! In both, binary cuts are fused by area into nodes of eight (I. Wald, C. Benthin, S. Boulos, *Getting Rid of Packets*,
//! 2008). Each prim is listed once, so there is no mailbox: there would be nothing for it to save.

mod build;
mod check;
mod listed;
#[cfg(test)]
mod margins;
mod node;
pub(super) mod split;
mod walk;

pub use listed::Listed;
pub use split::Splitting;

use std::marker::PhantomData;

use self::node::Tree;
use self::walk::{BoxMargins, Derived, Stack, Walk};
use super::query::{Culling, Goal, Query};
use super::{Probe, Shapes};
use crate::math::simd::Level;

/// A tree of eight-wide nodes over shapes.
#[derive(Clone, Debug)]
pub struct Wide<'a> {
    shapes: &'a Shapes,
    splitting: Splitting,
    tree: Tree,
    level: Level,
}

impl<'a> Wide<'a> {
    /// Builds it over the bounded prims; the same for every number of threads.
    pub fn build(shapes: &'a Shapes, splitting: Splitting) -> Self {
        Self { shapes, splitting, tree: build::build(shapes, splitting), level: Level::best() }
    }

    /// Walks with another instruction set than the best one; the answers are the same.
    #[must_use]
    pub fn at_level(self, level: Level) -> Self {
        Self { level, ..self }
    }

    /// Walks by given margins.
    #[inline]
    fn walk_within<B: BoxMargins, G: Goal, P: Probe>(&self, query: &mut Query<G>, stack: &mut Stack, probe: &mut P) {
        self.level.run(Walk { tree: &self.tree, query, stack, probe, margins: PhantomData::<B> });
    }

    /// How the scene was cut.
    pub fn splitting(&self) -> Splitting {
        self.splitting
    }
}

impl Culling for Wide<'_> {
    type Scratch = Stack;

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) -> Stack {
        Stack::default()
    }

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, stack: &mut Stack, probe: &mut P) {
        self.walk_within::<Derived, _, _>(query, stack, probe);
    }
}
