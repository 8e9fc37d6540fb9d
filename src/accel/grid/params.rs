//! How fine the grid and its octrees are.

/// Parameters of [`GridOctree`](super::GridOctree), all settled; the default suits meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridParams {
    /// Cells of the top grid per prim, more than 0 and at most 64. (J. Cleary, G. Wyvill, 1988: the resolution follows
    /// from density × number of prims, cells as near to cubes as possible.)
    pub density: f64,
    /// Most cells along one axis of the top grid, 1 to 1024.
    pub max_resolution: u32,
    /// Most levels of an octree below a top cell, 0 to 10; 0: a plain uniform grid.
    pub max_depth: u32,
    /// Cost of visiting a cell in prim tests, 0.1 to 100: a cell is split when that is expected to pay.
    pub step_cost: f64,
    /// Instead of the step cost: every cell that lists more prims is split, as deep as `max_depth` allows and as long as
    /// the references of all cells stay a small multiple of the prims.
    pub leaf_size: Option<u32>,
}

impl Default for GridParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A parameter out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}, must be {range}")]
pub struct ParamError {
    name: &'static str,
    value: f64,
    range: &'static str,
}

impl GridParams {
    /// What suits most meshes.
    pub const DEFAULT: Self =
        Self { density: 0.25, max_resolution: 256, max_depth: 8, step_cost: 4.0, leaf_size: None };

    /// A grid without octrees, which has to be finer.
    pub const UNIFORM: Self = Self { density: 4.0, max_depth: 0, ..Self::DEFAULT };

    /// One cell that becomes an octree.
    pub const OCTREE: Self = Self { max_resolution: 1, max_depth: 10, ..Self::DEFAULT };

    /// Whether every parameter is within its range.
    pub fn validate(&self) -> Result<(), ParamError> {
        let density = self.density;
        check("grid density", density, density > 0.0 && density <= 64.0, "more than 0 and at most 64")?;
        let resolution = self.max_resolution;
        check("grid resolution", f64::from(resolution), (1..=1024).contains(&resolution), "1 to 1024")?;
        check("octree depth", f64::from(self.max_depth), self.max_depth <= 10, "0 to 10")?;
        let cost = self.step_cost;
        check("step cost", cost, (0.1..=100.0).contains(&cost), "0.1 to 100")
    }
}

/// An error that names the parameter, unless it is all right.
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
        ] {
            assert!(bad.validate().is_err(), "{bad:?}");
        }
        let message = GridParams { max_depth: 11, ..default }.validate().map_err(|e| e.to_string());
        assert_eq!(message, Err("octree depth is 11, must be 0 to 10".into()));
    }
}
