//! Uniform grid whose crowded cells are refined by octrees, with a per-ray mailbox.
//!
//! A grid of nearly cubic cells covers the shapes ([`lattice`]); every cell, padded, lists the prims whose surface overlaps
//! it ([`overlap`], `build`). Where a list is so long that smaller cells are expected to pay, the cell becomes an octree
//! (`octree`) or gets a hierarchy of boxes (`trees`). A ray visits cells in order and stops behind the first hit that no
//! other can precede (`walk`); the mailbox saves repeated tests of prims listed in several cells ([`mailbox`]).

mod build;
mod check;
pub mod lattice;
pub mod mailbox;
#[cfg(test)]
pub(super) mod margins;
mod octree;
pub mod overlap;
pub mod params;
mod trees;
mod walk;

use std::marker::PhantomData;

pub use params::{Assign, GridParams};

use self::lattice::{CellMargins, Lattice};
use self::mailbox::{AnyMailbox, Mailbox, MailboxKind};
use self::octree::Cells;
use self::trees::Trees;
use super::bvh::tree::Stack;
use super::query::{Culling, Goal, Query};
use super::{Probe, Shapes};

/// Marks an entry that is an octree node; the other bits are its index.
const NODE: u32 = 1 << 31;

/// Index of the cell with an empty list.
const EMPTY: u32 = 0;

/// Uniform grid with refined cells. `M` is the kind of mailbox.
#[derive(Clone, Debug)]
pub struct GridOctree<'a, M = AnyMailbox> {
    shapes: &'a Shapes,
    lattice: Lattice,
    /// One entry per top cell: the index of a cell, or an octree's root marked [`NODE`].
    top: Vec<u32>,
    cells: Cells,
    trees: Trees,
    mailbox: MailboxKind,
    scratch: PhantomData<fn() -> M>,
}

impl<'a, M: Mailbox> GridOctree<'a, M> {
    /// Builds the grid over the bounded prims; the same for every number of threads.
    pub fn build(shapes: &'a Shapes, params: &GridParams) -> Self {
        let margins = match params.assign {
            Assign::Surface => CellMargins::DERIVED,
            // Figures that are compared with published ones must not count prims that overlap the padding alone.
            Assign::Box => CellMargins::NEAR,
        };
        Self::build_within(shapes, params, margins)
    }

    /// Sets the kind of mailbox; the default is the exact one.
    #[must_use]
    pub fn with_mailbox(self, mailbox: MailboxKind) -> Self {
        Self { mailbox, ..self }
    }

    /// [`Self::build`] with given margins.
    pub(super) fn build_within(shapes: &'a Shapes, params: &GridParams, margins: CellMargins) -> Self {
        let lattice = Lattice::new(shapes, params, margins);
        let (top, cells) = build::build(shapes, &lattice, params);
        Self {
            shapes,
            lattice,
            top,
            cells,
            trees: Trees::default(),
            mailbox: MailboxKind::default(),
            scratch: PhantomData,
        }
    }
}

/// Scratch memory of a walk through cells.
#[derive(Clone, Debug)]
pub struct GridScratch<M> {
    /// Prims that the current ray has met.
    pub mailbox: M,
    stack: Stack,
}

impl<M: Mailbox> Culling for GridOctree<'_, M> {
    type Scratch = GridScratch<M>;

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) -> GridScratch<M> {
        GridScratch { mailbox: M::new(self.mailbox, self.shapes.bounded()), stack: Stack::default() }
    }

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, scratch: &mut GridScratch<M>, probe: &mut P) {
        self.walk_cells(query, scratch, probe);
    }
}
