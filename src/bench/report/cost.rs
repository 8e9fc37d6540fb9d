//! What a structure costs, as one number of one kind.

use super::{Model, Report};
use crate::accel::Count;
use crate::bench::rays::Class;
use crate::bench::row::Row;
use crate::number::{bytes, seconds, short};

/// Something that is better low.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Ray/prim tests a ray.
    Tests,
    /// Nodes and cells visited a ray.
    Visits,
    /// Seconds of a ray.
    Time,
    /// Bytes of the structure.
    Memory,
    /// Seconds to build.
    Build,
}

impl Cost {
    /// Every cost, in the order of reports.
    pub const ALL: [Self; 5] = [Self::Tests, Self::Visits, Self::Time, Self::Memory, Self::Build];

    /// As the columns and keys of reports have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tests => "n_it",
            Self::Visits => "n_ts",
            Self::Time => "t_tr",
            Self::Memory => "bytes",
            Self::Build => "t_b",
        }
    }

    /// In words.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Tests => "Ray/prim tests a ray (n_it)",
            Self::Visits => "Nodes and cells visited a ray (n_ts)",
            Self::Time => "Time of a ray (t_tr)",
            Self::Memory => "Memory",
            Self::Build => "Time to build (t_b)",
        }
    }

    /// A value with its unit.
    pub fn shown(self, value: f64) -> String {
        match self {
            _ if !value.is_finite() => "-".into(),
            Self::Tests | Self::Visits => short(value),
            Self::Time | Self::Build => seconds(value),
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was whole and positive")]
            Self::Memory => bytes(value as u64),
        }
    }

    /// Whether it needs a timed pass.
    pub fn is_time(self) -> bool {
        matches!(self, Self::Time | Self::Build)
    }

    /// Whether each class of rays has its own.
    pub fn is_by_class(self) -> bool {
        matches!(self, Self::Tests | Self::Visits | Self::Time)
    }

    /// Of one structure, for an average ray of one class or of all as they were recorded; NaN where nothing was measured.
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
            // What builds nothing takes no time that a clock could tell.
            Self::Build if row.made_of.bytes == 0 => f64::NAN,
            Self::Build => row.build.median(),
            Self::Time => match place {
                None => model.seconds_per_ray(row),
                Some(place) => place.and_then(|i| row.classes.get(i)).map_or(f64::NAN, |c| c.seconds.median()),
            },
        }
    }
}

/// Costs that the report knows.
pub fn costs(report: &Report) -> impl Iterator<Item = Cost> {
    let is_timed = report.is_timed();
    Cost::ALL.into_iter().filter(move |c| is_timed || !c.is_time())
}
