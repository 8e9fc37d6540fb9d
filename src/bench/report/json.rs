//! JSON report of schema `meshray-bench/1`: one object.
//!
//! | key | what |
//! |---|---|
//! | `schema`, `version`, `complete` | `meshray-bench/1`; version of meshray; false while the command has not ended |
//! | `machine` | `cpu`, `cores`, `system`, `simd`, `compiler`, `flags` |
//! | `settings` | `threads`, `passes`, `seed`, `rays` (maximum per class), `slow_tests` (maximum per class in a slow structure), and the requested parameters of structures: `grid_density`, `grid_resolution`, `max_depth`, `step_cost`, `leaf_size`, `grid_cells`, `max_references` (each null for the default of the kind), `assign`, `mailbox` |
//! | `models` | one object per model |
//! | `sweep` | null, or the swept `parameter` and its `values` |
//! | `growth` | null, or the growth of cost if the models are a family in growing sizes |
//!
//! A model has `file`, `hash` (xxh3-128 of everything read), `prims` (N), `objects` (as bounded by `spheres` and `boxes`), `auto`
//! (null, or its choice: `kind`, `why`, and `won_time` and `won_nodes`: the extra cost of the other fast structure in time and
//! nodes, as a share of the chosen one's cost), `picture` (`width`, `height`, `samples`, `depth`, `view`, `camera`: world-space
//! `eye`, unit `forward` and `up`, `half_height` of the view, at distance 1 or, if `parallel`, at any distance), `rays` (by
//! class: `asked`, `kept`), `compared` (rays that more than one structure got), `identical` (whether all their hits were; null if
//! nothing was compared), `reference`, and `structures`.
//!
//! A structure has `accel`, `sampled`, `differing` (rays), `t_b` (seconds: `median`, `min`, `max`, `passes`, or null without
//! times), `t_tr` (seconds per ray, or null), V. Havran's `n_in`, `n_v`, `n_ev`, `n_oiv`, `bytes`, `break_even` (rays, or null),
//! and `classes`. A class has exact sums (`rays`, `hits`, `tests`, `steps`, `cells`, `empty_cells`, `volume_tests`,
//! `tests_saved`, `transforms`), `per_ray` (`n_it`, `n_ts`, `n_ets`, `n_eets`, `n_bit`, `n_mb`, `n_xf`, `n_min`), `interval`
//! (half the 95 % interval of each but `n_min`, or null if all rays were sent), `culled`, `differing`, `t_tr` (seconds per ray,
//! as `t_b`) and `mrays` (1 / `t_tr`). A model also has `kept_instances`, whose triangles are stored once; `left_out`, names of
//! structures not measured because they are too slow for the model or cannot keep instances; and `pruning`: null, or CPU seconds
//! of rendering the picture as `usual` and with `everything` on (each as `t_b`), `saved` (a share) and `same` (whether the pixels
//! were).
//!
//! For a parameter sweep, a structure's `setting` has its `value` (null: another parameter decides) and `is_default`, and the
//! model has `best`: for each `accel` the best `value`, `by` (`t_tr`, or `n_it+n_ts` without times), and `saved` (share of the
//! default's cost).
//!
//! `growth` has `family` and `structures`; for each `accel`, `all` (rays of all classes as recorded) and `classes`, with `n_it`,
//! `n_ts`, `t_tr` of each, and in `all` also `bytes` and `t_b`: null, or the power law fitted over the number of prims,
//! `exponent`, `error` (its standard error, or null for two sizes), `r2` (or null), `factor` (cost of one prim), `points`
//! (`[prims, cost]`). Keys are only ever added.

use super::auto::Outcome;
use super::cost::{Cost, costs};
use super::growth::{Curve, kinds};
use super::{Model, Report, sweep};
use crate::accel::{AccelKind, Count};
use crate::bench::clock::Spread;
use crate::bench::rays::Class;
use crate::bench::row::{ClassRow, Row};
use crate::number::hash;
use crate::render::View;
use crate::render::view::Lens;
use serde_json::{Map, Value, json};

/// Name of the schema.
pub const SCHEMA: &str = "meshray-bench/1";

/// Writes the report as indented JSON.
pub fn write(report: &Report) -> String {
    let (m, p) = (&report.machine, &report.plan);
    let value = json!({
        "schema": SCHEMA, "version": m.version, "complete": report.complete,
        "machine": {
            "cpu": m.cpu, "cores": m.cores, "system": m.system, "simd": m.simd, "compiler": m.compiler, "flags": m.flags,
        },
        "settings": {
            "threads": p.threads, "passes": p.passes, "seed": p.seed, "rays": p.rays, "slow_tests": p.slow_tests,
            "grid_density": p.params.density, "grid_resolution": p.params.max_resolution,
            "max_depth": p.params.max_depth, "step_cost": p.params.step_cost, "leaf_size": p.params.leaf_size,
            "grid_cells": p.params.grid_cells, "max_references": p.params.max_references,
            "assign": p.params.assign.name(), "mailbox": p.params.mailbox.name(),
        },
        "models": report.models.iter().map(|m| model(report, m)).collect::<Vec<_>>(),
        "sweep": report.plan.sweep.as_ref().map(|s| json!({ "parameter": s.parameter.name(), "values": s.values })),
        "growth": growth(report),
    });
    format!("{value:#}\n")
}

fn model(report: &Report, model: &Model) -> Value {
    let rays = model.rays.iter().map(|r| (r.class.name().to_owned(), json!({ "asked": r.asked, "kept": r.kept })));
    json!({
        "file": model.name, "hash": hash(model.hash), "prims": model.prims,
        "objects": model.objects, "kept_instances": model.kept, "auto": choice(report, model),
        "picture": {
            "width": model.width, "height": model.height, "samples": model.samples, "depth": model.depth,
            "view": model.view, "camera": camera(&model.camera),
        },
        "rays": rays.collect::<Map<_, _>>(),
        "compared": model.compared(), "identical": (model.compared() > 0).then(|| model.differing() == 0),
        "reference": model.reference().map(|k| k.name()),
        "structures": model.rows.iter().map(|row| structure(model, row)).collect::<Vec<_>>(),
        "best": report.plan.sweep.as_ref().map(|_| best(report, model)),
        "left_out": model.left_out.iter().map(|k| k.name()).collect::<Vec<_>>(),
        "pruning": model.pruning.as_ref().map(|p| json!({
            "usual": spread(&p.usual), "everything": spread(&p.everything), "saved": p.saved(), "same": p.same,
        })),
    })
}

fn camera(View { eye, right: _, up, forward, lens }: &View) -> Value {
    let (half_height, parallel) = match *lens {
        Lens::Perspective { half_height } => (half_height, false),
        Lens::Orthographic { half_height } => (half_height, true),
    };
    let [eye, forward, up] = [eye, forward, up].map(|v| v.to_array());
    json!({ "eye": eye, "forward": forward, "up": up, "half_height": half_height, "parallel": parallel })
}

fn choice(report: &Report, model: &Model) -> Value {
    let Some(reason) = model.auto else { return Value::Null };
    let outcome = Outcome::of(report, model);
    json!({
        "kind": reason.kind.name(), "why": reason.to_string(), "won_time": outcome.and_then(|o| o.time),
        "won_nodes": outcome.map(|o| o.nodes),
    })
}

fn best(report: &Report, model: &Model) -> Value {
    let by = if report.is_timed() { "t_tr" } else { "n_it+n_ts" };
    let of = |curve: &sweep::Curve| {
        let value = curve.best.setting.and_then(|s| s.value);
        json!({ "accel": curve.kind.name(), "value": value, "by": by, "saved": curve.saved(report, model) })
    };
    sweep::curves(report, model).iter().map(of).collect()
}

fn growth(report: &Report) -> Value {
    let Some(family) = report.family else { return Value::Null };
    let laws = |kind: AccelKind, class: Option<Class>| {
        let costs = costs(report).filter(|c| class.is_none() || c.is_by_class());
        costs.map(|cost| (cost.name().to_owned(), law(report, kind, cost, class))).collect::<Map<_, _>>()
    };
    let structure = |kind: AccelKind| {
        let classes =
            Class::ALL.into_iter().filter(|c| report.models.iter().any(|m| m.rays.iter().any(|r| r.class == *c)));
        let classes: Map<_, _> = classes.map(|c| (c.name().to_owned(), Value::Object(laws(kind, Some(c))))).collect();
        json!({ "accel": kind.name(), "all": laws(kind, None), "classes": classes })
    };
    json!({ "family": family.name(), "structures": kinds(report).into_iter().map(structure).collect::<Vec<_>>() })
}

fn law(report: &Report, kind: AccelKind, cost: Cost, class: Option<Class>) -> Value {
    let curve = Curve::of(&report.models, kind, cost, class);
    let Some(fit) = curve.fit else { return Value::Null };
    json!({
        "exponent": fit.exponent, "error": number(fit.error), "r2": number(fit.r2), "factor": number(fit.factor),
        "points": curve.points,
    })
}

fn structure(model: &Model, row: &Row) -> Value {
    let s = row.made_of;
    let class = |(i, c): (usize, &ClassRow)| (model.rays[i].class.name().to_owned(), class(c, model.prims));
    json!({
        "accel": row.kind.name(),
        "setting": row.setting.map(|s| json!({ "value": s.value, "is_default": s.is_default })),
        "sampled": row.sampled, "differing": row.differing(), "t_b": spread(&row.build),
        "t_tr": number(model.seconds_per_ray(row)), "n_in": s.n_in, "n_v": s.n_v, "n_ev": s.n_ev, "n_oiv": s.n_oiv,
        "bytes": s.bytes, "break_even": model.break_even(row),
        "classes": row.classes.iter().enumerate().map(class).collect::<Map<_, _>>(),
    })
}

fn class(class: &ClassRow, prims: usize) -> Value {
    let c = &class.counts;
    let mut per_ray: Map<_, _> = Count::ALL.iter().map(|&n| (n.name().to_owned(), json!(class.per_ray(n)))).collect();
    per_ray.insert("n_min".into(), json!(class.n_min()));
    let interval = Count::ALL.iter().map(|&n| (n.name().to_owned(), number(class.interval(n))));
    json!({
        "rays": c.queries, "hits": c.found, "tests": c.n_it, "steps": c.n_ts, "cells": c.n_ets,
        "empty_cells": c.n_eets, "volume_tests": c.n_bit, "tests_saved": c.n_mb, "transforms": c.n_xf, "per_ray": per_ray,
        "interval": if class.is_sampled() { Value::Object(interval.collect()) } else { Value::Null },
        "culled": class.culled(prims), "differing": class.differing,
        "t_tr": spread(&class.seconds), "mrays": rates(class),
    })
}

fn rates(class: &ClassRow) -> Value {
    if class.seconds.is_empty() {
        return Value::Null;
    }
    let [median, min, max] = class.rates().map(number);
    json!({ "median": median, "min": min, "max": max, "passes": class.seconds.len() })
}

fn spread(spread: &Spread) -> Value {
    if spread.is_empty() {
        return Value::Null;
    }
    json!({ "median": spread.median(), "min": spread.min(), "max": spread.max(), "passes": spread.len() })
}

/// Number, or null for NaN and infinity, which JSON lacks.
fn number(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}
