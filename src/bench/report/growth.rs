//! Growth of each structure's cost with the number of prims, over the models of a report.

use super::auto::over_sizes;
use super::cost::{Cost, costs};
use super::table::Table;
use super::{Model, Report};
use crate::accel::AccelKind;
use crate::bench::fit::Fit;
use crate::bench::rays::Class;
use crate::bench::row::Row;
use crate::number::{grouped, seconds, short};

/// One cost of one structure over all models.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Structure.
    pub kind: AccelKind,
    /// Number of prims and cost, in the order of the models; models without a value are left out.
    pub points: Vec<(f64, f64)>,
    /// Fitted power law; `None` with fewer than two different sizes.
    pub fit: Option<Fit>,
}

impl Curve {
    /// Curve over the models that have a row of this kind.
    pub fn of(models: &[Model], kind: AccelKind, cost: Cost, class: Option<Class>) -> Self {
        let point = |model: &Model| {
            let row = model.rows.iter().find(|r| r.kind == kind)?;
            let value = cost.of(model, row, class);
            value.is_finite().then_some((model.prims as f64, value))
        };
        let points: Vec<(f64, f64)> = models.iter().filter_map(point).collect();
        Self { kind, fit: Fit::of(&points), points }
    }

    /// Exponent and standard error: `0.33 ±0.02`; `-` without a fit.
    pub fn exponent(&self) -> String {
        match self.fit {
            None => "-".into(),
            Some(fit) if fit.error.is_nan() => self.short_exponent(),
            Some(fit) => format!("{} ±{:.2}", self.short_exponent(), fit.error),
        }
    }

    /// Exponent alone: `0.33`; empty without a fit.
    pub fn short_exponent(&self) -> String {
        // Avoid a negative zero.
        let shown = |x: f64| format!("{:.2}", if x.abs() < 0.005 { 0.0 } else { x });
        self.fit.map_or(String::new(), |fit| shown(fit.exponent))
    }
}

/// Structures with at least one row, in the order of the plan.
pub fn kinds(report: &Report) -> Vec<AccelKind> {
    let has = |kind: &AccelKind| report.models.iter().any(|m| m.rows.iter().any(|r| r.kind == *kind));
    report.plan.kinds.iter().copied().filter(has).collect()
}

/// Maximum number of sizes shown in a table.
const COLUMNS: usize = 6;

/// One table per cost: structures as rows, sizes as columns, then the exponent and the factor for ten times the prims. Of many
/// sizes only some are shown. The last table has the choices of `auto`.
pub fn tables(report: &Report) -> Vec<Table> {
    let models = &report.models;
    let shown: Vec<&Model> = match models.len() {
        n if n <= COLUMNS => models.iter().collect(),
        n => (0..COLUMNS).map(|i| &models[i * (n - 1) / (COLUMNS - 1)]).collect(),
    };
    let table = |cost: Cost| {
        let mut columns = vec!["structure".to_owned()];
        columns.extend(shown.iter().map(|m| grouped(m.prims as u64)));
        columns.extend(["exponent", "N × 10"].map(String::from));
        let line = |kind: AccelKind| {
            let curve = Curve::of(models, kind, cost, None);
            let at = |model: &&Model| {
                let row = model.rows.iter().find(|r| r.kind == kind);
                let star = |row: &Row| if row.sampled && cost.is_by_class() { "*" } else { "" };
                row.map_or("-".into(), |row| cost.shown(cost.of(model, row, None)) + star(row))
            };
            let mut cells = vec![kind.to_string()];
            cells.extend(shown.iter().map(at));
            cells.extend([
                curve.exponent(),
                curve.fit.map_or("-".into(), |f| format!("× {}", short(f.for_ten_times()))),
            ]);
            cells
        };
        Table { title: cost.title().into(), columns, rows: kinds(report).into_iter().map(line).collect() }
    };
    costs(report).map(table).chain(over_sizes(report)).collect()
}

/// Summary in a few sentences.
pub fn sentences(report: &Report) -> Vec<String> {
    let (Some(first), Some(last)) = (report.models.first(), report.models.last()) else { return Vec::new() };
    let mut said = Vec::new();
    let whole = kinds(report).into_iter().filter(|k| last.rows.iter().any(|r| r.kind == *k && !r.sampled));
    let whole: Vec<AccelKind> = whole.collect();
    let at_last =
        |kind: &AccelKind, cost: Cost| Curve::of(&report.models, *kind, cost, None).points.last().map(|p| p.1);
    let least = |cost: Cost| {
        let value = |k: &AccelKind| at_last(k, cost).unwrap_or(f64::INFINITY);
        whole.iter().copied().min_by(|a, b| value(a).total_cmp(&value(b)))
    };
    let factor = |kind, cost| Curve::of(&report.models, kind, cost, None).fit.map(|f| short(f.for_ten_times()));
    let n = grouped(last.prims as u64);
    if let Some(best) = least(Cost::Time).filter(|_| report.is_timed()) {
        let time = at_last(&best, Cost::Time).unwrap_or(f64::NAN);
        let growth =
            factor(best, Cost::Time).map_or(String::new(), |f| format!("; ten times the prims multiply it by {f}"));
        said.push(format!("Fastest at {n} prims: {best}, {} a ray{growth}", seconds(time)));
    }
    if let Some(best) = least(Cost::Tests) {
        let tests = at_last(&best, Cost::Tests).unwrap_or(f64::NAN);
        let growth =
            factor(best, Cost::Tests).map_or(String::new(), |f| format!("; ten times the prims multiply them by {f}"));
        said.push(format!("Fewest tests at {n} prims: {best}, {} a ray{growth}", short(tests)));
    }
    for kind in &report.plan.kinds {
        if let Some(model) = report.models.iter().find(|m| m.left_out.contains(kind)) {
            let from = grouped(model.prims as u64);
            let tests = grouped(report.plan.slow_tests);
            said.push(format!(
                "{kind} is left out from {from} prims on: not even {} rays of a class within {tests} tests (--slow-tests)",
                crate::bench::compare::Plan::FEWEST
            ));
        }
    }
    if first.prims == last.prims {
        said.push("One size only: no growth to tell".into());
    }
    said
}

/// Explains the exponents and the star.
pub const METHOD: &str = "exponent e of cost ~ N^e, N prims: least squares of the logarithms over all sizes, ± standard \
                          error; rays of all classes as they were recorded; N × 10: the cost of \
                          ten times the prims; * an even sample of the rays";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponent_is_shown_with_its_error_and_never_as_minus_nothing() {
        let curve = |points: &[(f64, f64)]| Curve { kind: AccelKind::Bvh, fit: Fit::of(points), points: points.into() };
        assert_eq!(curve(&[(10.0, 1.0), (100.0, 10.0)]).exponent(), "1.00");
        assert_eq!(curve(&[(10.0, 3.0), (100.0, 3.0), (1e3, 2.9999)]).exponent(), "0.00 ±0.00");
        assert_eq!(curve(&[(10.0, 3.0)]).exponent(), "-");
    }
}
