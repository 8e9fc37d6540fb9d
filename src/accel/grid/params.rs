//! Resolution and depth of the grid and its octrees.

use crate::named::names;

/// Parameters of [`GridOctree`](super::GridOctree); the default suits meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridParams {
    /// Cells of the top grid per prim, more than 0 and at most 64. (J. Cleary, G. Wyvill, 1988: the resolution follows
    /// from density × number of prims, cells as near to cubes as possible.)
    pub density: f64,
    /// Largest number of cells along one axis of the top grid, 1 to 1024.
    pub max_resolution: u32,
    /// Largest number of octree levels below a top cell, 0 to 10; 0: a plain uniform grid.
    pub max_depth: u32,
    /// Cost of visiting a cell, in prim tests, 0.1 to 100: a cell is split when that is expected to pay.
    pub step_cost: f64,
    /// Replaces the step cost: every cell that lists more prims is split, as deep as `max_depth` and `references` allow.
    pub leaf_size: Option<u32>,
    /// Cells of the top grid on each axis, 1 to 1024 and at most [`MOST_CELLS`] in all, whatever the density; `None`: derived
    /// from density and resolution.
    pub dims: Option<[u32; 3]>,
    /// Largest number of references per prim in the cells of all octrees together, 1 to 1000.
    pub references: f64,
    /// Rule that assigns prims to cells.
    pub assign: Assign,
    /// Distance by which the boxes of faces extend beyond them along their normals, in the shapes' units, 0 to 10⁶. For
    /// [`Assign::Box`]: published programs had such boxes.
    pub thickness: f64,
}

/// Rule that assigns prims to cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Assign {
    /// A prim is listed where its surface overlaps the cell.
    #[default]
    Surface,
    /// A prim is listed where its box overlaps the cell: faster to build, but with more references. Programs of the 1980s and
    /// 1990s did so, and their published figures count it.
    Box,
}

names!(Assign, "way of assigning", Surface => "surface", Box => "box");

impl Default for GridParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Largest number of cells in a top grid: the lists of so many take a gigabyte and a half.
pub const MOST_CELLS: f64 = (1_u32 << 27) as f64;

/// A parameter out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}, must be {range}")]
pub struct ParamError {
    name: &'static str,
    value: f64,
    range: &'static str,
}

impl GridParams {
    /// Parameters that suit most meshes.
    pub const DEFAULT: Self = Self {
        density: 0.25,
        max_resolution: 256,
        max_depth: 8,
        step_cost: 4.0,
        leaf_size: None,
        dims: None,
        references: 12.0,
        assign: Assign::Surface,
        thickness: 0.0,
    };

    /// A grid without octrees, which must be finer.
    pub const UNIFORM: Self = Self { density: 4.0, max_depth: 0, ..Self::DEFAULT };

    /// One cell that becomes an octree.
    pub const OCTREE: Self = Self { max_resolution: 1, max_depth: 10, ..Self::DEFAULT };

    /// Checks that every parameter is within its range.
    pub fn validate(&self) -> Result<(), ParamError> {
        let density = self.density;
        check("grid density", density, density > 0.0 && density <= 64.0, "more than 0 and at most 64")?;
        let resolution = self.max_resolution;
        check("grid resolution", f64::from(resolution), (1..=1024).contains(&resolution), "1 to 1024")?;
        check("octree depth", f64::from(self.max_depth), self.max_depth <= 10, "0 to 10")?;
        let cost = self.step_cost;
        check("step cost", cost, (0.1..=100.0).contains(&cost), "0.1 to 100")?;
        check("references of a shape", self.references, (1.0..=1000.0).contains(&self.references), "1 to 1000")?;
        check("thickness of faces", self.thickness, (0.0..=1e6).contains(&self.thickness), "0 to 1e6")?;
        let mut axes = self.dims.into_iter().flatten();
        axes.try_for_each(|n| check("number of cells on an axis", f64::from(n), (1..=1024).contains(&n), "1 to 1024"))?;
        let cells: f64 = self.dims.unwrap_or([1; 3]).map(f64::from).into_iter().product();
        check("number of cells", cells, cells <= MOST_CELLS, "at most 134217728 (512 on each axis)")
    }
}

/// Returns an error that names the parameter, unless `ok`.
pub(in crate::accel) fn check(name: &'static str, value: f64, ok: bool, range: &'static str) -> Result<(), ParamError> {
    ok.then_some(()).ok_or(ParamError { name, value, range })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_each_bound_is_enforced() {
        let default = GridParams::default();
        assert_eq!(default.validate(), Ok(()));
        for bad in [
            GridParams { density: 0.0, ..default },
            GridParams { density: f64::NAN, ..default },
            GridParams { max_resolution: 0, ..default },
            GridParams { max_depth: 11, ..default },
            GridParams { step_cost: 0.0, ..default },
            GridParams { references: 0.5, ..default },
            GridParams { dims: Some([4, 0, 4]), ..default },
            GridParams { dims: Some([1024, 512, 512]), ..default },
            GridParams { thickness: -1.0, ..default },
        ] {
            assert!(bad.validate().is_err(), "{bad:?}");
        }
        let message = GridParams { max_depth: 11, ..default }.validate().map_err(|e| e.to_string());
        assert_eq!(message, Err("octree depth is 11, must be 0 to 10".into()));
    }
}
