//! Report as text for a terminal.

use super::{Model, Report, WORDS, auto, growth, sweep, tables};
use std::fmt::{Result, Write};

/// Writes one model: structures, classes of rays, and whether the hits agree.
pub fn write(report: &Report, model: &Model) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_model(&mut text, report, model);
    text
}

fn write_model(out: &mut String, report: &Report, model: &Model) -> Result {
    write!(out, "{}", head(model))?;
    writeln!(out)?;
    if report.plan.sweep.is_some() {
        sweep::tables(report, model).iter().try_for_each(|table| writeln!(out, "{}", table.text()))?;
        sweep::sentences(report, model).iter().try_for_each(|text| write!(out, "{}", wrapped(&format!("{text}."))))?;
        return writeln!(out, "\n{}", model.verdict());
    }
    write!(out, "{}", tables::structures(report, model).text())?;
    for (i, rays) in model.rays.iter().enumerate() {
        write!(out, "\n{}", tables::class(report, model, i, rays).text())?;
    }
    writeln!(out, "\n{}", model.verdict())?;
    auto::sentences(report, model).iter().try_for_each(|text| write!(out, "{}", wrapped(&format!("{text}."))))?;
    let pruning = model.pruning.iter().map(|p| wrapped(&format!("{}.", p.sentence())));
    pruning.into_iter().try_for_each(|text| write!(out, "{text}"))
}

fn head(model: &Model) -> String {
    wrapped(&format!("{}: {}; rays of {}", model.name, model.size(), model.picture()))
}

/// Writes a summary of one model in two lines, where the tables cover all models.
pub fn write_short(model: &Model) -> String {
    format!("{}  {}\n", head(model), model.verdict())
}

/// Writes the growth of cost over all models.
pub fn write_growth(report: &Report) -> String {
    let tables: String = growth::tables(report).iter().map(|table| format!("\n{}", table.text())).collect();
    let said: String = growth::sentences(report).iter().map(|text| wrapped(&format!("{text}."))).collect();
    format!("{tables}\n{said}\n{}", wrapped(&format!("{}.", growth::METHOD)))
}

/// Wraps text at 120 columns, except for longer words; all lines but the first are indented.
fn wrapped(text: &str) -> String {
    let (mut out, mut column) = (String::new(), 0);
    for word in text.split(' ') {
        let width = word.chars().count();
        if column > 0 && column + 1 + width > 120 {
            out += "\n ";
            column = 1;
        }
        if column > 0 {
            out.push(' ');
            column += 1;
        }
        out += word;
        column += width;
    }
    out + "\n"
}

/// Writes the notes common to all models.
pub fn write_notes(report: &Report) -> String {
    let words: String = WORDS.iter().map(|(word, what)| format!("{word:<11} {what}\n")).collect();
    format!("{words}{}\n{}\n", report.method(), report.machine.line())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_sentences_become_lines() {
        let text = wrapped(&"twelve words ".repeat(25));
        assert!(text.lines().count() == 3 && text.lines().all(|l| l.len() <= 120), "{text}");
        assert!(text.lines().skip(1).all(|l| l.starts_with("  ") && !l.starts_with("   ")), "{text}");
        assert_eq!(wrapped("short"), "short\n");
    }
}
