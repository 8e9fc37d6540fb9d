//! What `auto` would choose for a model, and whether that was right on its rays.

use super::number::grouped;
use super::{Model, Report};
use crate::accel::auto::nodes;
use crate::accel::{AccelKind, RayCounts};
use crate::bench::row::Row;

/// How the choice fared against the other fast structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// What was chosen.
    pub chosen: AccelKind,
    /// What else could have been.
    pub other: AccelKind,
    /// How much more the other costs, as a share of the chosen one's cost; below 0 the choice lost.
    pub won: f64,
    /// Whether that is the time of a ray, or what `auto` counts.
    pub is_time: bool,
    /// Whether the passes of the two do not overlap.
    pub is_clear: bool,
}

impl Outcome {
    /// Of the choice for a model; `None` where one of the two was not measured.
    pub fn of(report: &Report, model: &Model) -> Option<Self> {
        let chosen = model.auto?.kind;
        let other = match chosen {
            AccelKind::FastOctree => AccelKind::FastBvh,
            _ => AccelKind::FastOctree,
        };
        let row = |kind| model.rows.iter().find(|r| r.kind == kind && r.setting.is_none());
        let (ours, theirs) = (row(chosen)?, row(other)?);
        let is_time = report.is_timed();
        let cost = |row: &Row| if is_time { model.seconds_per_ray(row) } else { counted(row) };
        let [[low, high], [other_low, other_high]] = [ours, theirs].map(|row| model.seconds_range(row));
        let is_clear = !is_time || high < other_low || other_high < low;
        Some(Self { chosen, other, won: cost(theirs) / cost(ours) - 1.0, is_time, is_clear })
    }

    /// Whether the choice was the better one, and by how much.
    pub fn sentence(&self) -> String {
        let Self { chosen, other, won, is_time, is_clear } = *self;
        let (costs, less) = match is_time {
            true => ("took", "time"),
            false => ("cost", "nodes by the same count"),
        };
        let but = if is_clear { "" } else { ", which is within the spread of the passes" };
        // A difference of nothing is no loss.
        if won > -5e-4 {
            let more = 100.0 * won.max(0.0);
            return format!("On these rays that was right: {other} {costs} {more:.1} % more {less}{but}");
        }
        let saved = -100.0 * won;
        format!("On these rays that was wrong: {other} {costs} {saved:.1} % less {less} than {chosen}{but}")
    }
}

/// What `auto` counts, for an average ray of the picture.
fn counted(row: &Row) -> f64 {
    let mut sum = RayCounts::default();
    row.classes.iter().for_each(|class| sum += class.counts);
    nodes(&sum)
}

/// What `auto` would choose, why, and how that fared; empty where it was not asked.
pub fn sentences(report: &Report, model: &Model) -> Vec<String> {
    let Some(reason) = model.auto else { return Vec::new() };
    let outcome = match Outcome::of(report, model) {
        Some(outcome) => outcome.sentence(),
        None => "Whether that is right was not measured: it takes both fast-octree and fast-bvh".into(),
    };
    vec![format!("auto would choose {reason}"), outcome]
}

/// The choices over growing sizes, in one sentence.
pub fn over_sizes(report: &Report) -> Option<String> {
    let told = |model: &Model| {
        let (kind, prims) = (model.auto?.kind, grouped(model.prims as u64));
        let fared = Outcome::of(report, model).map_or(String::new(), |o| {
            let verb = if o.won > -5e-4 { "won" } else { "lost" };
            format!(" ({verb} {:.1} %{})", 100.0 * o.won.abs(), if o.is_clear { "" } else { ", within the spread" })
        });
        Some(format!("{kind} at {prims} prims{fared}"))
    };
    let told: Vec<String> = report.models.iter().filter_map(told).collect();
    (!told.is_empty()).then(|| format!("auto would choose {}", told.join(", ")))
}
