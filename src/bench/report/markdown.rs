//! Markdown report.

use super::{Model, Report, WORDS, auto, growth, sweep, tables};

/// Writes the whole report.
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

/// Replaces control characters: names of files and cameras are not trusted not to contain terminal escapes.
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
    *out += &tables::structures(report, model).markdown();
    for (i, rays) in model.rays.iter().enumerate() {
        *out += &format!("\n{}", tables::class(report, model, i, rays).markdown());
    }
}
