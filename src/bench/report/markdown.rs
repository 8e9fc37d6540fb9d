//! Tables for a document.

use super::{Model, Rays, Report, WORDS, auto, growth, sweep, text};
use crate::accel::Count;
use crate::number::{bytes, grouped, seconds, short, whole};

/// The whole report.
pub fn write(report: &Report) -> String {
    let mut out = String::from("# meshray bench\n");
    if let Some(family) = report.family {
        out += &format!("\n## {family}: growth\n\n");
        growth::sentences(report).iter().for_each(|text| out += &format!("{text}.\n"));
        growth::tables(report).iter().for_each(|table| out += &format!("\n{}", table.markdown()));
        out += &format!("\n{}.\n", growth::METHOD);
    }
    report.models.iter().for_each(|model| write_model(&mut out, report, model));
    let words: Vec<String> = WORDS.iter().map(|(word, what)| format!("`{word}` {what}")).collect();
    out += &format!("\n{}.\n\n{}. {}.\n", words.join("; "), report.method(), report.machine.line());
    if !report.complete {
        out += "\n**Not finished.**\n";
    }
    out
}

/// Names of files and cameras are not trusted: what steers a terminal is left out.
fn printable(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

fn write_model(out: &mut String, report: &Report, model: &Model) {
    *out += &format!("\n## {}\n\n", printable(&model.name));
    *out += &format!("{}; rays of {}. **{}.**\n\n", model.size(), printable(&model.picture()), model.verdict());
    auto::sentences(report, model).iter().for_each(|text| *out += &format!("{text}.\n"));
    if model.auto.is_some() {
        out.push('\n');
    }
    if report.plan.sweep.is_some() {
        sweep::sentences(report, model).iter().for_each(|text| *out += &format!("{text}.\n"));
        sweep::tables(report, model).iter().for_each(|table| *out += &format!("\n{}", table.markdown()));
        return;
    }
    if let Some(pruning) = &model.pruning {
        *out += &format!("{}.\n\n", pruning.sentence());
    }
    let mut titles = vec!["structure", "memory", "n_in", "n_v", "n_ev", "n_oiv"];
    if report.is_timed() {
        titles.extend(["t_b", "min..max", "Mrays/s", "break-even"]);
    }
    head(out, &titles);
    for row in &model.rows {
        let s = row.made_of;
        let mut cells = vec![row.kind.to_string(), bytes(s.bytes)];
        cells.extend([s.n_in, s.n_v, s.n_ev, s.n_oiv].map(grouped));
        if report.is_timed() {
            let paid = model.break_even(row).map_or("-".into(), whole);
            cells.push(seconds(row.build.median()));
            cells.push(format!("{}..{}", seconds(row.build.min()), seconds(row.build.max())));
            cells.extend([short(1e-6 / model.seconds_per_ray(row)), paid]);
        }
        line(out, &cells);
    }
    model.rays.iter().enumerate().for_each(|(i, rays)| write_class(out, report, model, i, rays));
}

fn write_class(out: &mut String, report: &Report, model: &Model, i: usize, rays: &Rays) {
    *out += &format!("\n### {}: {} rays\n\n", rays.class.name(), grouped(rays.kept as u64));
    let mut titles = vec!["structure"];
    if report.is_timed() {
        titles.extend(["Mrays/s", "min..max"]);
    }
    titles.extend(Count::ALL.map(Count::name));
    titles.extend(["n_min", "culled"]);
    head(out, &titles);
    for row in &model.rows {
        let Some(class) = row.classes.get(i) else { continue };
        let sampled = row.sampled && class.is_sampled();
        let sample = format!("{} (sample: {} rays)", row.kind, grouped(class.counts.queries));
        let mut cells = vec![if sampled { sample } else { row.kind.to_string() }];
        if report.is_timed() {
            let rate = class.rate();
            cells.extend([short(rate.median()), format!("{}..{}", short(rate.min()), short(rate.max()))]);
        }
        let shown = |c: Count| match sampled {
            true => format!("{} ±{}", short(class.per_ray(c)), short(class.interval(c))),
            false => short(class.per_ray(c)),
        };
        cells.extend(Count::ALL.map(shown));
        cells.extend([format!("{:.3}", class.n_min()), text::culled(class, model.prims)]);
        line(out, &cells);
    }
}

fn head(out: &mut String, titles: &[&str]) {
    *out += &format!("| {} |\n|---|{}\n", titles.join(" | "), "--:|".repeat(titles.len().saturating_sub(1)));
}

fn line(out: &mut String, cells: &[String]) {
    *out += &format!("| {} |\n", cells.join(" | "));
}
