//! Kinds of cost of a structure, each as one number.

use super::{Model, Report};
use crate::accel::Count;
use crate::bench::rays::Class;
use crate::bench::row::Row;
use crate::number::{bytes, seconds, short};

/// Measure of cost: lower is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Ray/prim tests per ray.
    Tests,
    /// Nodes and cells visited per ray.
    Visits,
    /// Seconds per ray.
    Time,
    /// Size of the structure in bytes.
    Memory,
    /// Build time in seconds.
    Build,
}

impl Cost {
    /// All costs, in the order of reports.
    pub const ALL: [Self; 5] = [Self::Tests, Self::Visits, Self::Time, Self::Memory, Self::Build];

    /// Name in columns and keys of reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tests => "n_it",
            Self::Visits => "n_ts",
            Self::Time => "t_tr",
            Self::Memory => "bytes",
            Self::Build => "t_b",
        }
    }

    /// Title in words.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Tests => "Ray/prim tests a ray (n_it)",
            Self::Visits => "Nodes and cells visited a ray (n_ts)",
            Self::Time => "Time of a ray (t_tr)",
            Self::Memory => "Memory",
            Self::Build => "Time to build (t_b)",
        }
    }

    /// Formats a value with its unit.
    pub fn shown(self, value: f64) -> String {
        match self {
            _ if !value.is_finite() => "-".into(),
            Self::Tests | Self::Visits => short(value),
            Self::Time | Self::Build => seconds(value),
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was whole and positive")]
            Self::Memory => bytes(value as u64),
        }
    }

    /// Whether the cost needs a timed pass.
    pub fn is_time(self) -> bool {
        matches!(self, Self::Time | Self::Build)
    }

    /// Whether the cost differs by ray class.
    pub fn is_by_class(self) -> bool {
        matches!(self, Self::Tests | Self::Visits | Self::Time)
    }

    /// Cost of one structure, for an average ray of one class or of all classes as recorded; NaN where not measured.
    pub fn of(self, model: &Model, row: &Row, class: Option<Class>) -> f64 {
        let place = class.map(|class| model.rays.iter().position(|r| r.class == class));
        let count = |count: Count| match place {
            None => model.per_ray(row, count),
            Some(place) => place.and_then(|i| row.classes.get(i)).map_or(f64::NAN, |c| c.per_ray(count)),
        };
        match self {
            Self::Tests => count(Count::It),
            Self::Visits => count(Count::Ts),
            Self::Memory => row.made_of.bytes as f64,
            // A structure that builds nothing has no measurable build time.
            Self::Build if row.made_of.bytes == 0 => f64::NAN,
            Self::Build => row.build.median(),
            Self::Time => match place {
                None => model.seconds_per_ray(row),
                Some(place) => place.and_then(|i| row.classes.get(i)).map_or(f64::NAN, |c| c.seconds.median()),
            },
        }
    }
}

/// Costs that the report contains.
pub fn costs(report: &Report) -> impl Iterator<Item = Cost> {
    let is_timed = report.is_timed();
    Cost::ALL.into_iter().filter(move |c| is_timed || !c.is_time())
}
