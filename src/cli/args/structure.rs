//! Arguments for the parameters of structures.

use super::super::parse;
use crate::accel::{AccelKind, Assign, MailboxKind};
use clap::Args;

/// Parameters of the structures; what is left out follows from the kind of structure.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct AccelArgs {
    /// Cells of the grid per shape, or fewer where shapes would lie in more than about six cells each [default: 0.25 where
    /// crowded cells are refined, 4 for `grid`]
    #[arg(long, value_name = "RATIO", help_heading = "Structure", hide_short_help = true)]
    pub grid_density: Option<f64>,
    /// Most cells of the grid along an axis [default: 256]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub grid_resolution: Option<u32>,
    /// Most octree levels below a cell of the grid [default: 8; 10 for `octree`]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub max_depth: Option<u32>,
    /// Cost of visiting a cell, in units of a ray/prim test; cells are split where that should pay [default: 4]
    #[arg(long, value_name = "COST", help_heading = "Structure", hide_short_help = true)]
    pub step_cost: Option<f64>,
    /// Most shapes in a leaf [default: 2 for `bvh` and `grid-bvh`; octrees go by --step-cost]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub leaf_size: Option<u32>,
    /// Cells of the grid on each axis, such as 46x46x3, whatever the density
    #[arg(long, value_name = "XxYxZ", value_parser = parse::cells, help_heading = "Structure", hide_short_help = true)]
    pub grid_cells: Option<[u32; 3]>,
    /// Most references per shape in the cells of octrees [default: 12]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub max_references: Option<f64>,
    /// What assigns a shape to a cell: its surface or its box (grids and octrees)
    #[arg(long, value_name = "WHAT", value_parser = parse::named::<Assign>(), default_value = Assign::Surface.name(),
          help_heading = "Structure", hide_short_help = true)]
    pub assign: Assign,
    /// Which tested shapes a ray remembers, so that each is tested once (grids and octrees)
    #[arg(long, value_name = "KIND", value_parser = parse::named::<MailboxKind>(),
          default_value = MailboxKind::Exact.name(), help_heading = "Structure", hide_short_help = true)]
    pub mailbox: MailboxKind,
}

/// An option, and whether it affects a kind of structure.
type Use = (&'static str, fn(AccelKind) -> bool);

impl AccelArgs {
    /// Checks that each option typed affects one of these structures; the error names one that does not, and its structures.
    pub(in crate::cli) fn check_use(&self, kinds: &[AccelKind]) -> Result<(), String> {
        let idle = self.typed().find(|(_, has)| !kinds.iter().any(|kind| has(*kind)));
        let Some((option, has)) = idle else { return Ok(()) };
        let names = |kinds: Vec<AccelKind>| kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
        let users = names(AccelKind::ALL.into_iter().filter(|kind| has(*kind)).collect());
        let these = names(kinds.to_vec());
        Err(format!("{option} changes nothing of {these}; it is for {users}: choose one of these with --accel"))
    }

    /// Options that were typed; one typed with its default value cannot be distinguished from an absent one.
    fn typed(&self) -> impl Iterator<Item = Use> {
        let options: [(bool, Use); 9] = [
            (self.grid_density.is_some(), ("--grid-density", AccelKind::has_grid)),
            (self.grid_resolution.is_some(), ("--grid-resolution", AccelKind::has_grid)),
            (self.grid_cells.is_some(), ("--grid-cells", AccelKind::has_grid)),
            (self.max_depth.is_some(), ("--max-depth", AccelKind::has_octrees)),
            (self.step_cost.is_some(), ("--step-cost", AccelKind::has_octrees)),
            (self.max_references.is_some(), ("--max-references", AccelKind::has_octrees)),
            (self.leaf_size.is_some(), ("--leaf-size", AccelKind::has_leaves)),
            (self.assign != Assign::Surface, ("--assign", AccelKind::has_cells)),
            (self.mailbox != MailboxKind::Exact, ("--mailbox", AccelKind::has_cells)),
        ];
        options.into_iter().filter(|(typed, _)| *typed).map(|(_, of)| of)
    }
}
