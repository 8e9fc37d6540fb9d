//! Gate on counts: they do not depend on the machine, so a count beyond its limit is a change of the program.
//!
//! Compares two reports of schema `meshray-bench/1` model by model, structure by structure, class by class. Models are matched by
//! file name, since reports are compared wherever the models lie; several models of one name are matched by the path as typed, or
//! else by content hash. Both reports must cover the same model and the same rays; otherwise their counts are not comparable.

use serde_json::Value;
use std::str::FromStr;

/// Quantities that a limit can name: counts of each class, then sizes of a structure.
const NAMES: [&str; 12] =
    ["n_it", "n_ts", "n_ets", "n_eets", "n_bit", "n_mb", "n_xf", "bytes", "n_in", "n_v", "n_ev", "n_oiv"];

/// Limit on the change of a count, such as `n_it>+1%` or `n_mb<-5%`.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    name: String,
    /// Whether an increase breaks the limit; otherwise a decrease does.
    above: bool,
    /// Allowed change, in percent of the baseline's value.
    percent: f64,
}

/// Splits a limit such as `n_it>+1%` into the quantity, whether an increase breaks it, and the bound.
pub(crate) fn sides(text: &str) -> Option<(&str, bool, &str)> {
    let (name, rest) = text.split_at(text.find(['<', '>'])?);
    Some((name.trim(), rest.starts_with('>'), rest[1..].trim()))
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("{text:?}: write a count and its change, such as 'n_it>+1%'; counts: {}", NAMES.join(", "));
        let (name, above, bound) = sides(text).ok_or_else(wrong)?;
        let percent = bound.strip_suffix('%').and_then(|p| p.trim().parse::<f64>().ok());
        let percent = percent.filter(|p| p.is_finite()).ok_or_else(wrong)?;
        let name = NAMES.into_iter().find(|n| *n == name).ok_or_else(wrong)?;
        Ok(Self { name: name.to_owned(), above, percent })
    }
}

impl Limit {
    fn is_broken(&self, before: f64, now: f64) -> bool {
        let bound = before * (1.0 + self.percent / 100.0);
        // The values are quotients of sums: a difference in the last digit is rounding, no change.
        let grain = 1e-9 * before.abs().max(now.abs());
        if self.above { now > bound + grain } else { now < bound - grain }
    }
}

/// Describes the difference of two values, key by key where both are objects.
fn unlike(before: &Value, now: &Value) -> String {
    let told = |before: &Value, now: &Value| format!("{before} before, {now} now");
    let (Value::Object(all), Value::Object(_)) = (before, now) else { return told(before, now) };
    let differing = all.iter().filter(|(name, value)| now[name.as_str()] != **value);
    let each: Vec<_> =
        differing.map(|(name, value)| format!("{name}: {}", unlike(value, &now[name.as_str()]))).collect();
    if each.is_empty() { told(before, now) } else { each.join("; ") }
}

/// Returns a line for each count of `now` that broke a limit since `baseline`; an error where the reports are not comparable.
pub fn failures(baseline: &Value, now: &Value, limits: &[Limit]) -> Result<Vec<String>, String> {
    if baseline["schema"] != now["schema"] {
        return Err(format!("its schema is {}, not {}", baseline["schema"], now["schema"]));
    }
    if baseline["complete"] == false {
        return Err("it is not complete: the run that wrote it was cut off".into());
    }
    let [before, seed] = [baseline, now].map(|report| &report["settings"]["seed"]);
    if before != seed {
        return Err(format!("its rays are those of seed {before}, not {seed}"));
    }
    if baseline["sweep"] != now["sweep"] {
        let [before, now] = [baseline, now].map(|report| &report["sweep"]["parameter"]);
        return Err(format!("it sweeps another parameter, or other values of it ({before} before, {now} now)"));
    }
    let (all, mut found, mut lines) = (items(&baseline["models"]), Vec::new(), Vec::new());
    if let Some(limit) =
        limits.iter().find(|limit| !all.is_empty() && !all.iter().any(|model| counts(model, &limit.name)))
    {
        return Err(format!("it has no {}: an earlier meshray wrote it", limit.name));
    }
    for model in items(&now["models"]) {
        let at = earlier(all, &found, model)?;
        found.push(at);
        let (before, name) = (&all[at], called(all, &all[at]));
        let alike = [
            ("hash", "a different file"),
            ("prims", "another number of prims"),
            ("objects", "another number of objects"),
            ("picture", "a different picture"),
            ("rays", "different numbers of rays"),
        ];
        for (key, what) in alike {
            let [before, now] = [before, model].map(|model| &model[key]);
            if !is_same(before, now) {
                return Err(format!("{name}: the baseline was made from {what} ({})", unlike(before, now)));
            }
        }
        // Reports without the key are of models without kept instances.
        let kept = |model: &Value| model["kept_instances"].as_u64().unwrap_or(0);
        if kept(before) != kept(model) {
            let [before, now] = [kept(before), kept(model)];
            return Err(format!("{name}: the baseline was made with {before} instances kept, not with {now}"));
        }
        for row in items(&before["structures"]) {
            let current = items(&model["structures"]).iter().find(|current| is_one_structure(row, current));
            let place = format!("{name}, {}", structure(row));
            if let Some(sampled) = current.and_then(|current| sampled_otherwise(row, current)) {
                let [before, now] = [baseline, now].map(|report| &report["settings"]["slow_tests"]);
                return Err(format!("{place}: {sampled} (tests of slow structures: {before} before, {now} now)"));
            }
            match current {
                Some(current) => compare(&place, row, current, limits, &mut lines),
                None => lines.push(format!("{place}: in the baseline, but not measured now")),
            }
        }
        let known = |row: &&Value| items(&before["structures"]).iter().any(|earlier| is_one_structure(earlier, row));
        let new = items(&model["structures"]).iter().filter(|row| !known(row));
        let new: Vec<String> = new.map(structure).collect();
        if !new.is_empty() {
            return Err(format!("{name}: the baseline has no rows for {}", new.join(", ")));
        }
    }
    let missing = all.iter().enumerate().filter(|(at, _)| !found.contains(at));
    lines.extend(missing.map(|(_, model)| format!("{}: in the baseline, but not measured now", called(all, model))));
    if !lines.is_empty() {
        lines.extend(asked_otherwise(baseline, now));
    }
    Ok(lines)
}

/// Settings that the structures depend on.
const STRUCTURES: [&str; 9] = [
    "grid_density",
    "grid_resolution",
    "max_depth",
    "step_cost",
    "leaf_size",
    "grid_cells",
    "max_references",
    "assign",
    "mailbox",
];

/// Lists the structure settings that differ from the baseline's, which explains changed counts; a setting that an earlier report
/// lacks is skipped.
fn asked_otherwise(baseline: &Value, now: &Value) -> Option<String> {
    let said = |name: &'static str| Some((name, baseline["settings"].get(name)?, &now["settings"][name]));
    let other = STRUCTURES.into_iter().filter_map(said).filter(|(_, before, now)| before != now);
    let other: Vec<String> = other.map(|(name, before, now)| format!("{name} {before} before, {now} now")).collect();
    (!other.is_empty()).then(|| format!("structures were asked for in another way: {}", other.join("; ")))
}

/// Whether two rows are of the same structure and the same value of the swept parameter.
fn is_one_structure(before: &Value, now: &Value) -> bool {
    before["accel"] == now["accel"] && before["setting"]["value"] == now["setting"]["value"]
}

/// Name of a row's structure, with its value of the swept parameter.
fn structure(row: &Value) -> String {
    let name = row["accel"].as_str().unwrap_or_default();
    if row["setting"].is_object() { format!("{name} with {}", row["setting"]["value"]) } else { name.to_owned() }
}

/// Whether two values are equal; of two objects, only keys of the earlier one are compared.
fn is_same(before: &Value, now: &Value) -> bool {
    match before.as_object() {
        Some(before) => before.iter().all(|(key, value)| now[key] == *value),
        None => before == now,
    }
}

/// Whether a model of a report has values of this count.
fn counts(model: &Value, key: &str) -> bool {
    items(&model["structures"]).iter().any(|row| {
        let mut classes = row["classes"].as_object().into_iter().flatten();
        row[key].is_number() || classes.any(|(_, counts)| counts["per_ray"][key].is_number())
    })
}

/// Index of the baseline's model that matches `model`, preferring those not yet in `found`; an error where there is none or the
/// match is ambiguous.
fn earlier(all: &[Value], found: &[usize], model: &Value) -> Result<usize, String> {
    let name = file_name(&model["file"]);
    let same = |key: &'static str| move |at: &&usize| all[**at][key] == model[key];
    let named: Vec<usize> = (0..all.len()).filter(|&at| file_name(&all[at]["file"]) == name).collect();
    let left: Vec<usize> = named.iter().copied().filter(|at| !found.contains(at)).collect();
    let known = || {
        let by = |key| left.iter().find(same(key)).or_else(|| named.iter().find(same(key)));
        by("file").or_else(|| by("hash"))
    };
    match named[..] {
        [] => Err(format!("it has no model {name}")),
        [only] => Ok(only),
        _ => known().copied().ok_or_else(|| {
            let files: Vec<&str> = named.iter().map(|&at| path(&all[at]["file"])).collect();
            let file = path(&model["file"]);
            format!("it has several models called {name} ({}), and none of them is {file}", files.join(", "))
        }),
    }
}

/// Name of a baseline's model in messages: its file name, or its path where several models share the file name.
fn called<'a>(all: &'a [Value], model: &'a Value) -> &'a str {
    let name = file_name(&model["file"]);
    let several = all.iter().filter(|other| file_name(&other["file"]) == name).count() > 1;
    if several { path(&model["file"]) } else { name }
}

fn compare(place: &str, before: &Value, now: &Value, limits: &[Limit], lines: &mut Vec<String>) {
    for limit in limits {
        let key = limit.name.as_str();
        let mut judge = |place: &str, before: &Value, now: &Value| {
            let (Some(before), Some(now)) = (before.as_f64(), now.as_f64()) else { return };
            if limit.is_broken(before, now) {
                let change = 100.0 * (now / before - 1.0);
                let bound = format!("{}{:+}%", if limit.above { '>' } else { '<' }, limit.percent);
                lines.push(format!("{place}: {key} {now:.6}, was {before:.6}: {change:+.2}% is {bound}"));
            }
        };
        judge(place, &before[key], &now[key]);
        for (class, counts) in before["classes"].as_object().into_iter().flatten() {
            let place = format!("{place}, {class}");
            judge(&place, &counts["per_ray"][key], &now["classes"][class]["per_ray"][key]);
        }
    }
}

/// Describes the first class of which another number of rays was traced: slow structures get a sample.
fn sampled_otherwise(before: &Value, now: &Value) -> Option<String> {
    let classes = before["classes"].as_object().into_iter().flatten();
    let numbers = classes.map(|(class, counts)| (class, &counts["rays"], &now["classes"][class]["rays"]));
    let (class, before, now) = numbers.into_iter().find(|(_, before, now)| now.is_number() && before != now)?;
    Some(format!("the baseline was made with {before} rays of class {class}, not with {now}"))
}

fn items(list: &Value) -> &[Value] {
    list.as_array().map_or(&[], Vec::as_slice)
}

fn path(file: &Value) -> &str {
    file.as_str().unwrap_or_default()
}

fn file_name(file: &Value) -> &str {
    let path = path(file);
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn report(n_it: f64, bytes: u64) -> Value {
        let class = json!({ "per_ray": { "n_it": n_it, "n_mb": 2.0 } });
        let row = json!({ "accel": "grid", "bytes": bytes, "classes": { "shadow": class } });
        json!({ "schema": "s", "models": [{ "file": "a/b.obj", "hash": "7", "structures": [row] }] })
    }

    fn judged(before: &Value, now: &Value, limits: &[&str]) -> Vec<String> {
        let limits: Vec<Limit> = limits.iter().map(|l| l.parse().unwrap()).collect();
        failures(before, now, &limits).unwrap()
    }

    #[test]
    fn what_grew_beyond_its_limit_is_told_and_what_did_not_is_not() {
        let before = report(10.0, 100);
        assert_eq!(judged(&before, &report(10.1, 100), &["n_it>+1%"]), [""; 0]);
        let lines = judged(&before, &report(10.2, 130), &["n_it>+1%", "bytes > +20 %", "n_mb<-5%"]);
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert_eq!(lines[0], "b.obj, grid, shadow: n_it 10.200000, was 10.000000: +2.00% is >+1%");
        assert!(lines[1].starts_with("b.obj, grid: bytes 130"));
        assert_eq!(judged(&before, &report(9.0, 100), &["n_it<-5%"]).len(), 1);
        assert_eq!(judged(&report(0.0, 1), &report(0.5, 1), &["n_it>+1%"]).len(), 1, "from nothing to something");
    }

    #[test]
    fn reports_of_different_things_are_not_compared() {
        let (before, mut now) = (report(1.0, 1), report(1.0, 1));
        now["models"][0]["hash"] = "8".into();
        assert!(failures(&before, &now, &[]).unwrap_err().contains("a different file"));
        now["models"][0]["file"] = "c.obj".into();
        assert!(failures(&before, &now, &[]).unwrap_err().contains("no model c.obj"));
        now = report(1.0, 1);
        now["models"][0]["structures"] = json!([]);
        assert_eq!(judged(&before, &now, &[]), ["b.obj, grid: in the baseline, but not measured now"]);
        now["models"] = json!([]);
        assert_eq!(judged(&before, &now, &[]), ["b.obj: in the baseline, but not measured now"]);
    }

    #[test]
    fn models_of_one_file_name_are_told_apart_by_path_or_content() {
        let both = |files: [(&str, &str, f64); 2]| {
            let mut all = report(0.0, 1);
            all["models"] = json!(files.map(|(file, hash, n_it)| {
                let mut model = report(n_it, 1)["models"][0].clone();
                (model["file"], model["hash"]) = (file.into(), hash.into());
                model
            }));
            all
        };
        let before = both([("a/b.obj", "7", 1.0), ("c/b.obj", "8", 2.0)]);
        assert_eq!(judged(&before, &before, &["n_it>+1%", "n_it<-1%"]), [""; 0]);
        let elsewhere = both([("d/b.obj", "8", 2.0), ("e/b.obj", "7", 3.0)]);
        let lines = judged(&before, &elsewhere, &["n_it>+1%", "n_it<-1%"]);
        assert!(lines.len() == 1 && lines[0].starts_with("a/b.obj, grid, shadow: n_it 3"), "{lines:?}");
        let other = both([("a/b.obj", "7", 1.0), ("d/b.obj", "9", 2.0)]);
        let error = failures(&before, &other, &[]).unwrap_err();
        assert!(error.contains("a/b.obj, c/b.obj") && error.ends_with("d/b.obj"), "{error}");
    }

    #[test]
    fn a_baseline_that_was_cut_off_or_has_other_rays_or_fewer_structures_is_none() {
        let (before, now) = (report(1.0, 1), report(1.0, 1));
        let with = |key: &str, value: Value| {
            let mut changed = before.clone();
            changed[key] = value;
            changed
        };
        let refused = |before: &Value| failures(before, &now, &[]).unwrap_err();
        assert!(refused(&with("complete", false.into())).contains("cut off"));
        assert_eq!(judged(&with("complete", true.into()), &now, &[]), [""; 0]);
        let other = refused(&with("settings", json!({ "seed": 3 })));
        assert_eq!(other, "its rays are those of seed 3, not null");
        let mut fewer = before.clone();
        fewer["models"][0]["structures"] = json!([]);
        assert_eq!(refused(&fewer), "b.obj: the baseline has no rows for grid");
        let limits = ["n_xf>+1%".parse().unwrap()];
        let error = failures(&before, &now, &limits).unwrap_err();
        assert!(error.starts_with("it has no n_xf: "), "{error}");
    }

    #[test]
    fn a_baseline_of_other_geometry_is_none_one_of_other_parameters_says_so_and_one_of_a_sweep_goes_value_by_value() {
        let (before, now) = (report(1.0, 1), report(1.0, 1));
        let mut told = before.clone();
        told["settings"] = json!({ "seed": before["settings"]["seed"], "mailbox": "none" });
        let mut exact = told.clone();
        exact["settings"]["mailbox"] = "exact".into();
        exact["models"][0]["structures"][0]["bytes"] = 2.into();
        let lines = judged(&told, &exact, &["bytes>+1%"]);
        let said = "structures were asked for in another way: mailbox \"none\" before, \"exact\" now";
        assert_eq!((lines.len(), lines[1].as_str()), (2, said));
        assert_eq!(judged(&before, &exact, &["bytes>+1%"]).len(), 1, "a report that does not say so");
        assert_eq!(judged(&told, &exact, &["n_it>+1%"]), [""; 0], "nothing to explain");

        let mut whole = before.clone();
        whole["models"][0]["prims"] = 7.into();
        let error = failures(&whole, &now, &[]).unwrap_err();
        assert!(error.contains("another number of prims (7 before"), "{error}");

        let swept = |tests: [f64; 2]| {
            let mut report = before.clone();
            let row = report["models"][0]["structures"][0].clone();
            report["sweep"] = json!({ "parameter": "grid-density", "values": [4.0, 8.0] });
            let rows = [4.0, 8.0].into_iter().zip(tests).map(|(value, tests)| {
                let mut row = row.clone();
                row["setting"] = json!({ "value": value, "is_default": value == 4.0 });
                row["classes"]["shadow"]["per_ray"]["n_it"] = tests.into();
                row
            });
            report["models"][0]["structures"] = rows.collect();
            report
        };
        assert!(failures(&swept([1.0, 2.0]), &now, &[]).unwrap_err().contains("sweeps another parameter"));
        assert_eq!(judged(&swept([1.0, 2.0]), &swept([1.0, 2.0]), &["n_it>+1%", "n_it<-1%"]), [""; 0]);
        let lines = judged(&swept([1.0, 2.0]), &swept([1.0, 3.0]), &["n_it>+1%"]);
        assert!(lines.len() == 1 && lines[0].contains("grid with 8.0, shadow: n_it 3"), "{lines:?}");
    }

    #[test]
    fn a_model_that_is_measured_twice_is_compared_twice() {
        let mut twice = report(1.0, 1);
        twice["models"] = json!([twice["models"][0], twice["models"][0]]);
        assert_eq!(judged(&twice, &twice, &["n_it>+1%"]), [""; 0]);
    }

    #[test]
    fn a_baseline_of_another_camera_is_none_and_one_that_does_not_tell_its_camera_is() {
        let with = |eye: f64| {
            let mut report = report(1.0, 1);
            report["models"][0]["picture"] = json!({ "width": 3, "camera": { "eye": [eye, 0.0, 0.0] } });
            report
        };
        let error = failures(&with(1.0), &with(2.0), &[]).unwrap_err();
        let eye = "camera: eye: [1.0,0.0,0.0] before, [2.0,0.0,0.0] now";
        assert_eq!(error, format!("b.obj: the baseline was made from a different picture ({eye})"));
        assert_eq!(judged(&with(1.0), &with(1.0), &[]), [""; 0]);
        let mut silent = with(1.0);
        silent["models"][0]["picture"] = json!({ "width": 3 });
        assert_eq!(judged(&silent, &with(1.0), &[]), [""; 0]);
    }

    #[test]
    fn a_limit_that_makes_no_sense_is_refused_with_an_example() {
        for wrong in ["n_it", "n_it>1", "hits>+1%", ">+1%", "n_it>x%"] {
            assert!(wrong.parse::<Limit>().unwrap_err().contains("'n_it>+1%'"), "{wrong}");
        }
    }
}
