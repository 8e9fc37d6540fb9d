//! Cost of each structure over the values of a swept parameter, and the best value.

use super::cost::{Cost, costs};
use super::table::Table;
use super::{Model, Report};
use crate::accel::AccelKind;
use crate::bench::row::Row;
use crate::number::{seconds, short};

/// One structure at all values of the swept parameter.
#[derive(Clone, Debug)]
pub struct Curve<'a> {
    /// Structure.
    pub kind: AccelKind,
    /// Rows by ascending value; the row without a value comes last.
    pub rows: Vec<&'a Row>,
    /// Row of least cost.
    pub best: &'a Row,
    /// Row of the default value; `None` while the command is under way.
    pub default: Option<&'a Row>,
}

/// One curve per structure, in the order of the plan.
pub fn curves<'a>(report: &Report, model: &'a Model) -> Vec<Curve<'a>> {
    let curve = |&kind: &AccelKind| {
        let rows: Vec<&Row> = model.rows.iter().filter(|r| r.kind == kind && r.setting.is_some()).collect();
        let is_default = |row: &Row| row.setting.is_some_and(|s| s.is_default);
        let default = rows.iter().copied().find(|row| is_default(row));
        // Among equals, prefer the default.
        let rank = |row: &&Row| (worth(report, model, row), !is_default(row));
        let best = rows.iter().copied().min_by(|a, b| {
            let ((a, other), (b, others)) = (rank(a), rank(b));
            a.total_cmp(&b).then(other.cmp(&others))
        })?;
        // Values that give the same structure do not differ in cost, whatever the times are.
        let best = default.into_iter().chain(rows.iter().copied()).find(|row| are_same(row, best)).unwrap_or(best);
        Some(Curve { kind, rows, best, default })
    };
    report.plan.kinds.iter().filter_map(curve).collect()
}

/// Whether two rows are of the same structure: equal in size and in all counts.
fn are_same(a: &Row, b: &Row) -> bool {
    let counts = |row: &Row| row.classes.iter().map(|class| class.counts).collect::<Vec<_>>();
    a.made_of == b.made_of && counts(a) == counts(b)
}

/// Cost to minimise: time if measured, else tests plus visits.
fn worth(report: &Report, model: &Model, row: &Row) -> f64 {
    match report.is_timed() {
        true => model.seconds_per_ray(row),
        false => Cost::Tests.of(model, row, None) + Cost::Visits.of(model, row, None),
    }
}

impl Curve<'_> {
    /// Value and cost of each row that has a value.
    pub fn points(&self, model: &Model, cost: Cost) -> Vec<(f64, f64)> {
        let point = |row: &&Row| Some((row.setting?.value?, cost.of(model, row, None)));
        self.rows.iter().filter_map(point).collect()
    }

    /// Share of the default's cost that the best value saves, 0 to 1; `None` without a default.
    pub fn saved(&self, report: &Report, model: &Model) -> Option<f64> {
        let default = worth(report, model, self.default?);
        (default > 0.0).then(|| 1.0 - worth(report, model, self.best) / default)
    }

    /// Sentence with the best value and its advantage over the default.
    pub fn sentence(&self, report: &Report, model: &Model) -> String {
        let (Some(best), cost) = (self.best.setting, worth(report, model, self.best)) else { return String::new() };
        let (kind, told) = (
            self.kind,
            match report.is_timed() {
                true => format!("{} a ray", seconds(cost)),
                false => format!("{} tests and visits a ray together", short(cost)),
            },
        );
        let Some(default) = self.default.and_then(|row| row.setting) else {
            return format!("{kind}: {best} is best so far, {told}");
        };
        let mut text = match best.is_default {
            true => format!("{kind}: the default, {best}, is best: {told}"),
            false => {
                let saved = 100.0 * self.saved(report, model).unwrap_or(0.0);
                let than = default.value.map_or_else(|| default.to_string(), |value| value.to_string());
                let doubt = self.default.map_or("", |default| report.doubt(model, self.best, default));
                format!("{kind}: {best} is best, {told}, {saved:.1} % less than the default, {than}{doubt}")
            }
        };
        if let Some(end) = self.end(report, model) {
            text += &format!("; it is the {end} value measured, so the best may lie beyond");
        }
        text
    }

    /// End of the value range at which the best lies, if its neighbour is worse; `None` inside the range or at the default.
    fn end(&self, report: &Report, model: &Model) -> Option<&'static str> {
        let best = self.best.setting.filter(|s| !s.is_default)?.value?;
        let rows: Vec<&Row> =
            self.rows.iter().copied().filter(|r| r.setting.is_some_and(|s| s.value.is_some())).collect();
        let is_best = |row: &Row| row.setting.is_some_and(|s| s.value == Some(best));
        let is_worse = |row: &Row| worth(report, model, row) > worth(report, model, self.best);
        match rows[..] {
            [first, second, ..] if is_best(first) && is_worse(second) => Some("lowest"),
            [.., second, last] if is_best(last) && is_worse(second) => Some("highest"),
            _ => None,
        }
    }
}

/// One table per structure: values as rows, costs as columns.
pub fn tables(report: &Report, model: &Model) -> Vec<Table> {
    let Some(sweep) = &report.plan.sweep else { return Vec::new() };
    let columns = || std::iter::once(sweep.parameter.to_string()).chain(costs(report).map(|c| c.name().to_owned()));
    let line = |curve: &Curve, row: &Row| {
        let setting = row.setting;
        let value = setting.and_then(|s| s.value).map_or("-".into(), |value| value.to_string());
        let marks = [(std::ptr::eq(row, curve.best), " best"), (setting.is_some_and(|s| s.is_default), " default")];
        let marks: String = marks.into_iter().filter(|(is, _)| *is).map(|(_, mark)| mark).collect();
        let costs = costs(report).map(|cost| cost.shown(cost.of(model, row, None)));
        std::iter::once(value + &marks).chain(costs).collect()
    };
    let table = |curve: Curve| Table {
        title: curve.kind.to_string(),
        columns: columns().collect(),
        rows: curve.rows.iter().map(|row| line(&curve, row)).collect(),
    };
    curves(report, model).into_iter().map(table).collect()
}

/// One sentence per structure.
pub fn sentences(report: &Report, model: &Model) -> Vec<String> {
    curves(report, model).iter().map(|curve| curve.sentence(report, model)).collect()
}
