//! What `auto` would choose for a model, and whether that was right on its rays.

use std::iter;

use super::table::Table;
use super::{Model, Report};
use crate::accel::AccelKind;
use crate::accel::auto::{Why, nodes};
use crate::bench::row::Row;
use crate::number::grouped;

/// How the choice fared against the other fast structure. Shares are of the chosen one's cost, by which the other's is
/// more; below 0 the choice lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// What was chosen.
    pub chosen: AccelKind,
    /// What else could have been.
    pub other: AccelKind,
    /// Share of the time of a ray; `None` without times.
    pub time: Option<f64>,
    /// Share of the nodes of a ray, as `auto` counts them.
    pub nodes: f64,
    /// What makes the times doubtful, to be added to a sentence.
    doubt: &'static str,
    /// Whether both are the same tree, whatever the clock says.
    one_tree: bool,
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
        let share = |cost: &dyn Fn(&Row) -> f64| match (cost(theirs), cost(ours)) {
            // Rays that come near nothing.
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

    /// Whether the choice was the better one, by time where there is one; `None` where that cannot be told apart.
    pub fn is_right(&self) -> Option<bool> {
        let certain = self.one_tree || self.time.is_none() || self.doubt.is_empty();
        certain.then(|| self.one_tree || is_no_loss(self.time.unwrap_or(self.nodes)))
    }

    /// Whether the choice was the better one, and by how much.
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

/// A difference of nothing is no loss.
fn is_no_loss(share: f64) -> bool {
    share > -5e-4
}

/// A share as `3.1 % more` or `3.1 % less`.
fn more(share: f64) -> String {
    let word = if is_no_loss(share) { "more" } else { "less" };
    format!("{:.1} % {word}", 100.0 * share.abs())
}

/// What `auto` counts, for an average ray of the picture.
fn counted(model: &Model, row: &Row) -> f64 {
    model.mean(row, |class| nodes(&class.counts))
}

/// Whether two structures have the same tree, by everything that is counted of it and in it.
fn is_one_tree(a: &Row, b: &Row) -> bool {
    let alike = a.classes.iter().zip(&b.classes).all(|(a, b)| a.counts == b.counts);
    a.made_of == b.made_of && a.rays() == b.rays() && alike
}

/// What `auto` would choose, why, and how that fared; empty where it was not asked.
pub fn sentences(report: &Report, model: &Model) -> Vec<String> {
    let Some(reason) = model.auto else { return Vec::new() };
    let outcome = match Outcome::of(report, model) {
        Some(outcome) => Some(outcome.sentence()),
        None if reason.why == Why::OneTree => None,
        None => Some("Whether that is right was not measured: it takes both fast-octree and fast-bvh".into()),
    };
    iter::once(format!("auto would choose {reason}")).chain(outcome).collect()
}

/// The choices over growing sizes, and what the other fast structure costs there; `None` where nothing was asked.
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
