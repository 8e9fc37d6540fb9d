//! Choice of `auto` for a model, and whether it was right for the model's rays.

use std::iter;

use super::table::Table;
use super::{Model, Report};
use crate::accel::AccelKind;
use crate::accel::auto::{Why, nodes};
use crate::bench::row::Row;
use crate::number::grouped;

/// Comparison of the choice with the other fast structure. Shares are the other's extra cost relative to the chosen one's;
/// negative where the choice lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Chosen structure.
    pub chosen: AccelKind,
    /// The alternative.
    pub other: AccelKind,
    /// Extra time per ray; `None` without times.
    pub time: Option<f64>,
    /// Extra nodes per ray, as `auto` counts them.
    pub nodes: f64,
    /// Reason to doubt the times, to be appended to a sentence; empty without doubt.
    doubt: &'static str,
    /// Whether both structures are the same tree, whatever the times are.
    one_tree: bool,
}

impl Outcome {
    /// Outcome for a model; `None` where one of the two structures was not measured.
    pub fn of(report: &Report, model: &Model) -> Option<Self> {
        let chosen = model.auto?.kind;
        let other = match chosen {
            AccelKind::FastOctree => AccelKind::FastBvh,
            _ => AccelKind::FastOctree,
        };
        let row = |kind| model.rows.iter().find(|r| r.kind == kind && r.setting.is_none());
        let (ours, theirs) = (row(chosen)?, row(other)?);
        let share = |cost: &dyn Fn(&Row) -> f64| match (cost(theirs), cost(ours)) {
            // Rays that come near no prim cost 0 in both.
            (theirs, ours) if theirs == ours => 0.0,
            (theirs, ours) => theirs / ours - 1.0,
        };
        Some(Self {
            chosen,
            other,
            time: report.is_timed().then(|| share(&|row| model.seconds_per_ray(row))),
            nodes: share(&|row| counted(model, row)),
            doubt: report.doubt(model, ours, theirs),
            one_tree: is_one_tree(ours, theirs),
        })
    }

    /// Whether the choice was the better one, by time if measured, else by nodes; `None` where the difference is not significant.
    pub fn is_right(&self) -> Option<bool> {
        let certain = self.one_tree || self.time.is_none() || self.doubt.is_empty();
        certain.then(|| self.one_tree || is_no_loss(self.time.unwrap_or(self.nodes)))
    }

    /// Says whether the choice was the better one, and by how much.
    pub fn sentence(&self) -> String {
        let Self { other, nodes, doubt, .. } = self;
        if self.one_tree {
            return format!("On these rays that makes no difference: {other} is the same tree");
        }
        let right = match self.is_right() {
            Some(true) => "right",
            Some(false) => "wrong",
            None => "neither right nor wrong for certain",
        };
        let counted = format!("counted as auto does, {other} costs {}", more(*nodes));
        match self.time {
            Some(time) => {
                format!("On these rays that was {right}: {other} takes {} time{doubt}; {counted}", more(time))
            }
            None => format!("On these rays that was {right}: {counted}"),
        }
    }
}

/// Whether the choice did not lose; differences that round to nothing are no loss.
fn is_no_loss(share: f64) -> bool {
    share > -5e-4
}

/// Formats a share as `3.1 % more` or `3.1 % less`.
fn more(share: f64) -> String {
    let word = if is_no_loss(share) { "more" } else { "less" };
    format!("{:.1} % {word}", 100.0 * share.abs())
}

/// Node cost as `auto` counts it, for an average ray of the picture.
fn counted(model: &Model, row: &Row) -> f64 {
    model.mean(row, |class| nodes(&class.counts))
}

/// Whether two structures have the same tree, judged by all counts of its parts and of its walks.
fn is_one_tree(a: &Row, b: &Row) -> bool {
    let alike = a.classes.iter().zip(&b.classes).all(|(a, b)| a.counts == b.counts);
    a.made_of == b.made_of && a.rays() == b.rays() && alike
}

/// Sentences on what `auto` would choose, why, and how that fared; empty if `auto` was not evaluated.
pub fn sentences(report: &Report, model: &Model) -> Vec<String> {
    let Some(reason) = model.auto else { return Vec::new() };
    let outcome = match Outcome::of(report, model) {
        Some(outcome) => Some(outcome.sentence()),
        None if reason.why == Why::OneTree => None,
        None => Some("Whether that is right was not measured: it takes both fast-octree and fast-bvh".into()),
    };
    iter::once(format!("auto would choose {reason}")).chain(outcome).collect()
}

/// Choices of `auto` over growing sizes, with the extra cost of the other fast structure; `None` if `auto` was not evaluated.
pub fn over_sizes(report: &Report) -> Option<Table> {
    let line = |model: &Model| {
        let (kind, outcome) = (model.auto?.kind, Outcome::of(report, model));
        let told = |share: Option<f64>| share.map_or("-".into(), more);
        let time = outcome.and_then(|o| o.time);
        let doubt = outcome.filter(|o| o.time.is_some()).map_or("", |o| o.doubt);
        let nodes = told(outcome.map(|o| o.nodes));
        Some(vec![grouped(model.prims as u64), kind.to_string(), nodes, told(time) + doubt])
    };
    let rows: Vec<Vec<String>> = report.models.iter().filter_map(line).collect();
    let columns = ["prims", "auto would choose", "the other's nodes, as auto counts", "the other's time"];
    let title = "What auto would choose, and what the other fast structure costs".into();
    (!rows.is_empty()).then(|| Table { title, columns: columns.map(String::from).into(), rows })
}
