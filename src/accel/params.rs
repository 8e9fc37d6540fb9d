//! Parameters a user may set for a structure; those left open follow from its kind.

use super::grid::mailbox::MailboxKind;
use super::grid::params::{Assign, GridParams, ParamError, check};
use super::{AccelKind, bvh};

/// Parameters of all structures; each kind reads its own. `None`: the default of the kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelParams {
    /// Cells of the top grid per prim, more than 0 and at most 64. For kinds with a grid.
    pub density: Option<f64>,
    /// Largest number of cells along one axis of the top grid, 1 to 1024. For kinds with a grid.
    pub max_resolution: Option<u32>,
    /// Largest number of octree levels below a top cell, 0 to 10. For `grid-octree` and `octree`.
    pub max_depth: Option<u32>,
    /// Cost of visiting a cell, in prim tests, 0.1 to 100: a cell is split when that is expected to pay. For `grid-octree`
    /// and `octree`.
    pub step_cost: Option<f64>,
    /// Largest number of prims in a leaf, 1 to 1000. For `bvh` and `grid-bvh`; for `grid-octree` and `octree` it replaces the
    /// step cost: every cell that lists more is split, as deep as allowed.
    pub leaf_size: Option<u32>,
    /// Cells of the top grid on each axis, 1 to 1024, whatever the density. For kinds with a grid.
    pub grid_cells: Option<[u32; 3]>,
    /// Largest number of references per prim in the cells of octrees, 1 to 1000. For `grid-octree` and `octree`.
    pub max_references: Option<f64>,
    /// Rule that assigns prims to cells, for grids and octrees.
    pub assign: Assign,
    /// Distance by which boxes of faces extend beyond them along their normals, with [`Assign::Box`]; in the shapes' units, 0
    /// to 10⁶.
    pub thickness: f64,
    /// Kind of mailbox, for grids and octrees.
    pub mailbox: MailboxKind,
}

impl AccelParams {
    /// Every parameter at the default of the kind.
    pub const DEFAULT: Self = Self {
        density: None,
        max_resolution: None,
        max_depth: None,
        step_cost: None,
        leaf_size: None,
        grid_cells: None,
        max_references: None,
        assign: Assign::Surface,
        thickness: 0.0,
        mailbox: MailboxKind::Exact,
    };

    /// Checks that every parameter is within its range.
    pub fn validate(&self) -> Result<(), ParamError> {
        let leaf_size = self.leaf_size.unwrap_or(1);
        check("leaf size", f64::from(leaf_size), (1..=1000).contains(&leaf_size), "1 to 1000")?;
        self.grid(AccelKind::GridOctree).validate()
    }

    /// Grid parameters of a kind that has a grid.
    pub fn grid(&self, kind: AccelKind) -> GridParams {
        let default = match kind {
            AccelKind::Grid => GridParams::UNIFORM,
            AccelKind::Octree => GridParams::OCTREE,
            _ => GridParams::DEFAULT,
        };
        GridParams {
            density: self.density.unwrap_or(default.density),
            max_resolution: match kind {
                AccelKind::Octree => 1,
                _ => self.max_resolution.unwrap_or(default.max_resolution),
            },
            max_depth: match kind {
                AccelKind::Grid | AccelKind::GridBvh => 0,
                _ => self.max_depth.unwrap_or(default.max_depth),
            },
            step_cost: self.step_cost.unwrap_or(default.step_cost),
            leaf_size: self.leaf_size,
            dims: self.grid_cells.filter(|_| kind != AccelKind::Octree),
            references: self.max_references.unwrap_or(default.references),
            assign: self.assign,
            thickness: self.thickness,
        }
    }

    /// Leaf size of `bvh` and `grid-bvh`, in prims.
    pub fn tree_leaf_size(&self) -> u32 {
        self.leaf_size.unwrap_or(bvh::LEAF_SIZE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_open_follows_from_the_kind_and_what_is_asked_for_does_not() {
        let of = |kind| AccelParams::DEFAULT.grid(kind);
        assert_eq!((of(AccelKind::Grid).max_depth, of(AccelKind::Octree).max_resolution), (0, 1));
        assert_eq!(of(AccelKind::GridOctree), GridParams::DEFAULT);
        let asked = AccelParams { density: Some(3.0), max_depth: Some(5), leaf_size: Some(1), ..AccelParams::DEFAULT };
        let grid = asked.grid(AccelKind::Grid);
        assert_eq!((grid.density, grid.max_depth, grid.leaf_size), (3.0, 0, Some(1)));
        assert_eq!(asked.grid(AccelKind::Octree).max_depth, 5);
    }

    #[test]
    fn a_parameter_out_of_its_range_is_named() {
        assert_eq!(AccelParams::DEFAULT.validate(), Ok(()));
        let wrong = |params: AccelParams| params.validate().map_err(|e| e.to_string());
        let leaf = AccelParams { leaf_size: Some(0), ..AccelParams::DEFAULT };
        assert_eq!(wrong(leaf), Err("leaf size is 0, must be 1 to 1000".into()));
        let depth = AccelParams { max_depth: Some(11), ..AccelParams::DEFAULT };
        assert_eq!(wrong(depth), Err("octree depth is 11, must be 0 to 10".into()));
    }
}
