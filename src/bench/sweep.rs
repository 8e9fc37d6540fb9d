//! Sweep of one structure parameter over several values: where is the minimum of the cost, and is the default there?

use super::range::{Spacing, values};
use crate::accel::{AccelKind, AccelParams};
use std::fmt;
use std::str::FromStr;

/// Numeric parameter of the structures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Cells of the top grid per prim.
    GridDensity,
    /// Maximum number of cells of the top grid per axis.
    GridResolution,
    /// Maximum number of levels of an octree.
    MaxDepth,
    /// Cost of visiting a cell, in tests.
    StepCost,
    /// Maximum number of prims of a leaf.
    LeafSize,
}

impl Parameter {
    /// All parameters.
    pub const ALL: [Self; 5] =
        [Self::GridDensity, Self::GridResolution, Self::MaxDepth, Self::StepCost, Self::LeafSize];

    /// Flag of the parameter, without the dashes.
    pub const fn name(self) -> &'static str {
        match self {
            Self::GridDensity => "grid-density",
            Self::GridResolution => "grid-resolution",
            Self::MaxDepth => "max-depth",
            Self::StepCost => "step-cost",
            Self::LeafSize => "leaf-size",
        }
    }

    /// Whether the values are whole numbers.
    pub const fn is_whole(self) -> bool {
        matches!(self, Self::GridResolution | Self::MaxDepth | Self::LeafSize)
    }

    /// Whether the parameter is a logarithm itself, so that its values are spaced evenly: each level halves the cells.
    pub const fn is_even(self) -> bool {
        matches!(self, Self::MaxDepth)
    }

    /// Whether the parameter affects a structure of this kind, given the other parameters.
    pub fn changes(self, kind: AccelKind, params: &AccelParams) -> bool {
        let has_it = match self {
            Self::GridDensity | Self::GridResolution => kind.has_grid(),
            Self::MaxDepth | Self::StepCost => kind.has_octrees(),
            Self::LeafSize => kind.has_leaves(),
        };
        has_it && self.overruled_by(params).is_none()
    }

    /// Flag (without dashes) among `params` that fixes what this parameter would decide.
    pub const fn overruled_by(self, params: &AccelParams) -> Option<&'static str> {
        match self {
            Self::GridDensity | Self::GridResolution if params.grid_cells.is_some() => Some("grid-cells"),
            Self::StepCost if params.leaf_size.is_some() => Some("leaf-size"),
            _ => None,
        }
    }

    /// Default value for a kind of structure; `None` where another parameter decides instead.
    pub fn default_of(self, kind: AccelKind, params: &AccelParams) -> Option<f64> {
        let grid = params.grid(kind);
        match self {
            Self::GridDensity => Some(grid.density),
            Self::GridResolution => Some(f64::from(grid.max_resolution)),
            Self::MaxDepth => Some(f64::from(grid.max_depth)),
            Self::StepCost => Some(grid.step_cost),
            Self::LeafSize => {
                matches!(kind, AccelKind::Bvh | AccelKind::GridBvh).then(|| f64::from(params.tree_leaf_size()))
            }
        }
    }

    /// Whether `params` sets the parameter explicitly.
    pub fn is_set(self, params: &AccelParams) -> bool {
        match self {
            Self::GridDensity => params.density.is_some(),
            Self::GridResolution => params.max_resolution.is_some(),
            Self::MaxDepth => params.max_depth.is_some(),
            Self::StepCost => params.step_cost.is_some(),
            Self::LeafSize => params.leaf_size.is_some(),
        }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates; validation refuses it then"
    )]
    fn set(self, value: f64, params: &AccelParams) -> AccelParams {
        let whole = Some(value as u32);
        let mut set = *params;
        match self {
            Self::GridDensity => set.density = Some(value),
            Self::GridResolution => set.max_resolution = whole,
            Self::MaxDepth => set.max_depth = whole,
            Self::StepCost => set.step_cost = Some(value),
            Self::LeafSize => set.leaf_size = whole,
        }
        set
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A parameter and the values it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// Parameter.
    pub parameter: Parameter,
    /// Values, ascending, each once.
    pub values: Vec<f64>,
}

/// Number of values of a range that does not name one.
const VALUES: usize = 6;

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Parameter::ALL.map(Parameter::name).join(", ");
        let (name, range) = text.split_once('=').ok_or_else(|| {
            format!("{text:?}: write a parameter and its values, such as grid-density=0.5..16; parameters: {}", names())
        })?;
        let parameter = Parameter::ALL.into_iter().find(|p| p.name() == name.trim());
        let parameter =
            parameter.ok_or_else(|| format!("no parameter {name:?} can be swept; there are: {}", names()))?;
        let spacing = if parameter.is_even() { Spacing::Even(VALUES) } else { Spacing::Ratio(VALUES) };
        let values = values(range, spacing, parameter.is_whole())?;
        let sweep = Self { parameter, values };
        let wrong = sweep.values.iter().find_map(|&v| parameter.set(v, &AccelParams::DEFAULT).validate().err());
        wrong.map_or(Ok(sweep), |wrong| Err(wrong.to_string()))
    }
}

/// Value of the swept parameter in one structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Parameter.
    pub parameter: Parameter,
    /// Value; `None` where another parameter decides instead.
    pub value: Option<f64>,
    /// Whether the value is the structure's default.
    pub is_default: bool,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value {
            Some(value) => write!(f, "{} {value}", self.parameter),
            None => write!(f, "no {}", self.parameter),
        }
    }
}

impl Sweep {
    /// Settings of a structure of this kind: each value, and the default, which may lie outside the values.
    pub fn settings(&self, kind: AccelKind, params: &AccelParams) -> Vec<(Setting, AccelParams)> {
        let (parameter, default) = (self.parameter, self.parameter.default_of(kind, params));
        let mut values: Vec<Option<f64>> = self.values.iter().copied().map(Some).collect();
        if !values.contains(&default) {
            values.push(default);
        }
        values.sort_by(|a, b| a.unwrap_or(f64::INFINITY).total_cmp(&b.unwrap_or(f64::INFINITY)));
        let of = |value: Option<f64>| {
            let params = value.map_or(*params, |value| parameter.set(value, params));
            (Setting { parameter, value, is_default: value == default }, params)
        };
        values.into_iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Vec<f64> {
        text.parse::<Sweep>().unwrap().values
    }

    #[test]
    fn ranges_have_six_values_by_ratio_and_depths_by_difference() {
        assert_eq!(of("grid-density=0.5..16"), [0.5, 1.0, 2.0, 4.0, 8.0, 16.0]);
        assert_eq!(of("max-depth=0..10"), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(of("leaf-size=1..4"), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(of("step-cost=1,8,2"), [1.0, 2.0, 8.0]);
        assert_eq!(of("grid-resolution=16..64:3"), [16.0, 32.0, 64.0]);
    }

    #[test]
    fn what_cannot_be_swept_is_refused_with_what_can() {
        for (wrong, says) in [
            ("density=1..2", "grid-density"),
            ("grid-density", "grid-density=0.5..16"),
            ("grid-density=2..1", "below the last"),
            ("grid-density=1..100", "at most 64"),
            ("leaf-size=0..4", "start at 0"),
            ("leaf-size=0,4", "1 to 1000"),
            ("max-depth=5..11", "0 to 10"),
        ] {
            let error = wrong.parse::<Sweep>().unwrap_err();
            assert!(error.contains(says), "{wrong}: {error}");
        }
    }

    #[test]
    fn the_default_is_one_of_the_values_or_is_added_to_them() {
        let sweep: Sweep = "grid-density=1,4".parse().unwrap();
        let values = |kind| -> Vec<_> {
            let settings = sweep.settings(kind, &AccelParams::DEFAULT);
            settings.iter().map(|(s, p)| (s.value, s.is_default, p.density)).collect()
        };
        assert_eq!(values(AccelKind::Grid), [(Some(1.0), false, Some(1.0)), (Some(4.0), true, Some(4.0))]);
        assert_eq!(values(AccelKind::GridOctree)[0], (Some(0.25), true, Some(0.25)));
        // Octrees have no leaf size by default.
        let sweep: Sweep = "leaf-size=8".parse().unwrap();
        let settings = sweep.settings(AccelKind::Octree, &AccelParams::DEFAULT);
        assert_eq!((settings[1].0.value, settings[1].0.is_default, settings[1].1), (None, true, AccelParams::DEFAULT));
    }

    #[test]
    fn a_parameter_changes_exactly_the_structures_it_says() {
        use crate::accel::AnyAccel;
        use crate::bench::star::star;
        let shapes = star(40, 20);
        for parameter in Parameter::ALL {
            for kind in AccelKind::ALL {
                let made = |value: f64| {
                    let params = parameter.set(value, &AccelParams::DEFAULT);
                    AnyAccel::build(kind, &shapes, &params).summary()
                };
                let is_other = made(1.0) != made(7.0);
                assert_eq!(is_other, parameter.changes(kind, &AccelParams::DEFAULT), "{parameter} of {kind}");
            }
        }
    }
}
