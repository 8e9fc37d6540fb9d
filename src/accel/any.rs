//! Choice of the structure and the ray/triangle test at run time: enums for the user, static dispatch for the rays.

use std::any::Any;

use super::intersector::{IntersectorKind, Looked, MollerTrumbore, MollerTrumboreDouble, Watertight, WatertightDouble};
use super::query::{Culling, Tested};
use super::volumes::{BoundingSphere, Volumes};
use super::{
    Accel, AccelParams, Bvh, GridOctree, Hit, HitQueries, InstancedObjects, NoProbe, OccludedFilter, Probe, Ray,
    Shapes, Splitting, StructureStats, Transformed, TwoLevel, Unculled, Wide,
};
use crate::math::aabb::Aabb;
use crate::named::names;

/// Culling structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AccelKind {
    /// No culling: every ray is tested against every shape.
    None,
    /// Shapes transformed into each ray's frame and sorted by depth.
    Transform,
    /// A bounding sphere around each object.
    Spheres,
    /// A bounding box around each object.
    Boxes,
    /// A binary bounding volume hierarchy.
    Bvh,
    /// A uniform grid with a mailbox.
    Grid,
    /// A uniform grid with octrees in its crowded cells, with a mailbox.
    GridOctree,
    /// A uniform grid with a hierarchy of boxes in each crowded cell, with a mailbox.
    GridBvh,
    /// One cell refined by an octree, with a mailbox.
    Octree,
    /// An 8-wide hierarchy of boxes, split by octree planes; small cells are split by surface area.
    FastOctree,
    /// An 8-wide hierarchy of boxes, split by surface area.
    FastBvh,
}

names!(
    AccelKind, "structure",
    None => "none",
    Transform => "transform",
    Spheres => "spheres",
    Boxes => "boxes",
    Bvh => "bvh",
    Grid => "grid",
    GridOctree => "grid-octree",
    GridBvh => "grid-bvh",
    Octree => "octree",
    FastOctree => "fast-octree",
    FastBvh => "fast-bvh",
);

impl Default for AccelKind {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl AccelKind {
    /// Default of the fast structures. The command line's own default is [`AccelChoice::Auto`](super::AccelChoice::Auto),
    /// which looks at the shapes.
    pub const DEFAULT: Self = Self::FastOctree;

    /// Whether the structure has a grid whose resolution can be chosen.
    pub const fn has_grid(self) -> bool {
        matches!(self, Self::Grid | Self::GridOctree | Self::GridBvh)
    }

    /// Whether the structure has octrees.
    pub const fn has_octrees(self) -> bool {
        matches!(self, Self::GridOctree | Self::Octree)
    }

    /// Whether the structure has leaves whose size can be chosen.
    pub const fn has_leaves(self) -> bool {
        matches!(self, Self::Bvh | Self::GridBvh | Self::GridOctree | Self::Octree)
    }

    /// Whether the structure has cells that list shapes, so that a ray may meet a shape in several cells.
    pub const fn has_cells(self) -> bool {
        matches!(self, Self::Grid | Self::GridOctree | Self::GridBvh | Self::Octree)
    }

    /// Whether the structure can hold instanced objects, stored once and placed several times.
    pub fn keeps_instances(self) -> bool {
        matches!(self, Self::FastOctree | Self::FastBvh)
    }

    /// Whether a ray may be tested against a large part of the prims. Measurements over many rays give such a structure only
    /// a sample of them.
    pub fn is_slow(self) -> bool {
        matches!(self, Self::None | Self::Transform | Self::Spheres | Self::Boxes)
    }
}

/// A built structure of any kind, with the ray/triangle test that its queries use.
///
/// The choice is dispatched once per slice of rays; all code behind it is compiled for that choice.
#[derive(Clone, Debug)]
pub struct AnyAccel<'a> {
    kind: AccelKind,
    structure: Structure<'a>,
    test: IntersectorKind,
}

#[derive(Clone, Debug)]
enum Structure<'a> {
    None(Unculled<'a>),
    Transform(Transformed<'a>),
    Spheres(Volumes<'a, BoundingSphere>),
    Boxes(Volumes<'a, Aabb>),
    Bvh(Bvh<'a>),
    Grid(GridOctree<'a>),
    Wide(Wide<'a>),
    TwoLevel(TwoLevel<'a>),
}

/// Evaluates an expression for whichever structure the enum holds.
macro_rules! whichever {
    ($structure:expr, $a:ident => $value:expr) => {
        match $structure {
            Structure::None($a) => $value,
            Structure::Transform($a) => $value,
            Structure::Spheres($a) => $value,
            Structure::Boxes($a) => $value,
            Structure::Bvh($a) => $value,
            Structure::Grid($a) => $value,
            Structure::Wide($a) => $value,
            Structure::TwoLevel($a) => $value,
        }
    };
}

/// Scratch memory of walks through [`AnyAccel`].
#[derive(Debug)]
pub struct AnyScratch(Box<dyn Any + Send>);

/// A query that any structure can answer.
trait Question {
    /// Whether the probe records nothing of the walk.
    const SILENT: bool;

    fn ask<A: Accel>(self, accel: &A, scratch: &mut A::Scratch);
}

impl<'a> AnyAccel<'a> {
    /// Builds a structure over `shapes`, with the exact test. A [`World`](crate::render::World) may hold more than its
    /// shapes: [`World::structure`](crate::render::World::structure) builds over everything.
    ///
    /// # Panics
    ///
    /// May panic with parameters that [`AccelParams::validate`] refuses, or where a vertex is infinite.
    pub fn build(kind: AccelKind, shapes: &'a Shapes, params: &AccelParams) -> Self {
        let structure = match kind {
            AccelKind::None => Structure::None(Unculled::new(shapes)),
            AccelKind::Transform => Structure::Transform(Transformed::new(shapes)),
            AccelKind::Spheres => Structure::Spheres(Volumes::build(shapes)),
            AccelKind::Boxes => Structure::Boxes(Volumes::build(shapes)),
            AccelKind::Bvh => Structure::Bvh(Bvh::build(shapes, params.tree_leaf_size())),
            AccelKind::Grid | AccelKind::GridOctree | AccelKind::Octree => {
                Structure::Grid(GridOctree::build(shapes, &params.grid(kind)).with_mailbox(params.mailbox))
            }
            AccelKind::GridBvh => {
                let grid = GridOctree::build(shapes, &params.grid(kind)).with_mailbox(params.mailbox);
                Structure::Grid(grid.with_trees(params.tree_leaf_size()))
            }
            AccelKind::FastOctree => Structure::Wide(Wide::build(shapes, Splitting::Octree)),
            AccelKind::FastBvh => Structure::Wide(Wide::build(shapes, Splitting::SurfaceArea)),
        };
        Self { kind, structure, test: IntersectorKind::Exact }
    }

    /// Builds a structure over `shapes` and the `instanced` objects, if any. Kinds that cannot hold instances
    /// ([`AccelKind::keeps_instances`]) give way to the default. Uses the exact test, which is the only one allowed where
    /// anything is instanced.
    pub fn build_with(
        kind: AccelKind,
        shapes: &'a Shapes,
        instanced: &'a InstancedObjects,
        params: &AccelParams,
    ) -> Self {
        if instanced.is_empty() {
            return Self::build(kind, shapes, params);
        }
        let (kind, splitting) = match kind {
            AccelKind::FastBvh => (kind, Splitting::SurfaceArea),
            _ => (AccelKind::FastOctree, Splitting::Octree),
        };
        let structure = Structure::TwoLevel(TwoLevel::build(shapes, instanced, splitting));
        Self { kind, structure, test: IntersectorKind::Exact }
    }

    /// Returns this structure with another ray/triangle test.
    #[must_use]
    pub fn tested_by(self, test: IntersectorKind) -> Self {
        Self { test, ..self }
    }

    /// Shapes that the structure culls.
    pub fn shapes(&self) -> &Shapes {
        whichever!(&self.structure, a => a.shapes())
    }

    /// Kind of the structure.
    pub fn kind(&self) -> AccelKind {
        self.kind
    }

    /// Sizes of the structure.
    pub fn summary(&self) -> StructureStats {
        whichever!(&self.structure, a => a.summary())
    }

    /// Visits everything and proves that no hit can be lost; the error names the prim and the cell that disagree, and how.
    pub fn check(&self) -> Result<StructureStats, String> {
        whichever!(&self.structure, a => a.check())
    }

    fn ask<Q: Question>(&self, question: Q, scratch: &mut AnyScratch) {
        match &self.structure {
            // Timed (silent) walks have code of their own for every test.
            Structure::Wide(a) if Q::SILENT => with_scratch(a, scratch, |scratch| match self.test {
                IntersectorKind::Exact => question.ask(a, scratch),
                IntersectorKind::Watertight => question.ask(&Tested::new(a, Watertight), scratch),
                IntersectorKind::WatertightDouble => question.ask(&Tested::new(a, WatertightDouble), scratch),
                IntersectorKind::MollerTrumbore => question.ask(&Tested::new(a, MollerTrumbore), scratch),
                IntersectorKind::MollerTrumboreDouble => question.ask(&Tested::new(a, MollerTrumboreDouble), scratch),
            }),
            Structure::Wide(a) => run_by_kind(a, self.test, question, scratch),
            Structure::TwoLevel(a) => with_scratch(a, scratch, |scratch| question.ask(a, scratch)),
            Structure::None(a) => run_by_kind(a, self.test, question, scratch),
            Structure::Transform(a) => run_by_kind(a, self.test, question, scratch),
            Structure::Spheres(a) => run_by_kind(a, self.test, question, scratch),
            Structure::Boxes(a) => run_by_kind(a, self.test, question, scratch),
            Structure::Bvh(a) => run_by_kind(a, self.test, question, scratch),
            Structure::Grid(a) => run_by_kind(a, self.test, question, scratch),
        }
    }
}

/// Runs a query with the test looked up at each use, unless it is the exact one.
fn run_by_kind<C: Culling<Scratch: 'static>>(
    accel: &C,
    test: IntersectorKind,
    question: impl Question,
    scratch: &mut AnyScratch,
) {
    with_scratch(accel, scratch, |scratch| match test {
        IntersectorKind::Exact => question.ask(accel, scratch),
        test => question.ask(&Tested::new(accel, Looked(test)), scratch),
    });
}

/// Calls `f` with `scratch` if it belongs to this structure, else with a fresh one.
fn with_scratch<A: Accel<Scratch: 'static>>(accel: &A, scratch: &mut AnyScratch, f: impl FnOnce(&mut A::Scratch)) {
    match scratch.0.downcast_mut() {
        Some(scratch) => f(scratch),
        None => f(&mut accel.scratch()),
    }
}

impl Accel for AnyAccel<'_> {
    type Scratch = AnyScratch;

    #[expect(clippy::unit_arg, reason = "the scratch of some is the unit")]
    fn scratch(&self) -> AnyScratch {
        AnyScratch(whichever!(&self.structure, a => Box::new(a.scratch())))
    }

    // All silent probes share the code compiled for `NoProbe`.

    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut AnyScratch, probe: &mut P) {
        let after = queries.after.map_or(hits.len(), <[Hit]>::len);
        assert_eq!([after, hits.len()], [queries.rays.len(); 2], "a hit before and after for each ray");
        if P::SILENT {
            self.ask(FirstHitsQuestion { queries, hits, probe: &mut NoProbe }, scratch);
        } else {
            self.ask(FirstHitsQuestion { queries, hits, probe }, scratch);
        }
    }

    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut AnyScratch,
        probe: &mut P,
    ) {
        assert_eq!(rays.len(), occluded.len(), "a verdict for each ray");
        if P::SILENT {
            self.ask(OccludedQuestion { rays, filter, occluded, probe: &mut NoProbe }, scratch);
        } else {
            self.ask(OccludedQuestion { rays, filter, occluded, probe }, scratch);
        }
    }
}

struct FirstHitsQuestion<'q, P> {
    queries: &'q HitQueries<'q>,
    hits: &'q mut [Hit],
    probe: &'q mut P,
}

impl<P: Probe> Question for FirstHitsQuestion<'_, P> {
    const SILENT: bool = P::SILENT;

    fn ask<A: Accel>(self, accel: &A, scratch: &mut A::Scratch) {
        accel.first_hits(self.queries, self.hits, scratch, self.probe);
    }
}

struct OccludedQuestion<'q, P> {
    rays: &'q [Ray],
    filter: Option<&'q dyn OccludedFilter>,
    occluded: &'q mut [bool],
    probe: &'q mut P,
}

impl<P: Probe> Question for OccludedQuestion<'_, P> {
    const SILENT: bool = P::SILENT;

    fn ask<A: Accel>(self, accel: &A, scratch: &mut A::Scratch) {
        accel.occluded_filtered(self.rays, self.filter, self.occluded, scratch, self.probe);
    }
}
