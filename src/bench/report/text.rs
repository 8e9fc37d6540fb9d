//! Tables for a terminal.

use super::{Model, Rays, Report, WORDS, auto, growth, sweep};
use crate::accel::Count;
use crate::bench::clock::Spread;
use crate::bench::row::{ClassRow, Row};
use crate::number::{bytes, grouped, seconds, short, whole};
use std::fmt::{Result, Write};

/// One model: its structures, then each class of rays, then whether hits agree.
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
    write_structures(out, report, model)?;
    for (i, rays) in model.rays.iter().enumerate() {
        writeln!(out)?;
        write_class(out, report, model, i, rays)?;
    }
    writeln!(out, "\n{}", model.verdict())?;
    auto::sentences(report, model).iter().try_for_each(|text| write!(out, "{}", wrapped(&format!("{text}."))))?;
    let pruning = model.pruning.iter().map(|p| wrapped(&format!("{}.", p.sentence())));
    pruning.into_iter().try_for_each(|text| write!(out, "{text}"))
}

fn head(model: &Model) -> String {
    wrapped(&format!("{}: {}; rays of {}", model.name, model.size(), model.picture()))
}

/// One model in two lines, where the tables are of all.
pub fn write_short(model: &Model) -> String {
    format!("{}  {}\n", head(model), model.verdict())
}

/// How cost grows over all models.
pub fn write_growth(report: &Report) -> String {
    let tables: String = growth::tables(report).iter().map(|table| format!("\n{}", table.text())).collect();
    let said: String = growth::sentences(report).iter().map(|text| wrapped(&format!("{text}."))).collect();
    format!("{tables}\n{said}\n{}", wrapped(&format!("{}.", growth::METHOD)))
}

/// Lines of at most 120 columns, but for longer words; all but the first are indented.
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

/// What holds for all models.
pub fn write_notes(report: &Report) -> String {
    let words: String = WORDS.iter().map(|(word, what)| format!("{word:<11} {what}\n")).collect();
    format!("{words}{}\n{}\n", report.method(), report.machine.line())
}

fn write_structures(out: &mut String, report: &Report, model: &Model) -> Result {
    write!(out, "{:<14}", "structure")?;
    for title in ["memory", "n_in", "n_v", "n_ev", "n_oiv"] {
        write!(out, "{title:>11}")?;
    }
    if report.is_timed() {
        write!(out, "{:>11}{:>20}{:>9}{:>12}", "t_b", "min..max", "Mrays/s", "break-even")?;
    }
    writeln!(out)?;
    for row in &model.rows {
        let s = row.made_of;
        write!(out, "{:<14}{:>11}", name(row), bytes(s.bytes))?;
        for n in [s.n_in, s.n_v, s.n_ev, s.n_oiv] {
            write!(out, "{:>11}", grouped(n))?;
        }
        if report.is_timed() {
            let rate = short(1e-6 / model.seconds_per_ray(row));
            let paid = model.break_even(row).map_or("-".into(), whole);
            let range = format!("{}..{}", seconds(row.build.min()), seconds(row.build.max()));
            write!(out, "{:>11}{range:>20}{rate:>9}{paid:>12}", seconds(row.build.median()))?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write_class(out: &mut String, report: &Report, model: &Model, i: usize, rays: &Rays) -> Result {
    let kept = if rays.asked == rays.kept as u64 {
        String::new()
    } else {
        format!(", an even sample of {}", grouped(rays.asked))
    };
    let whole = model.rows.iter().find(|r| !r.sampled).and_then(|r| r.classes.get(i));
    let required = whole.map_or(String::new(), |c| format!(", n_min {:.3}", c.n_min()));
    writeln!(out, "{}: {} rays{kept}{required}", rays.class.name(), grouped(rays.kept as u64))?;
    write!(out, "{:<14}", "structure")?;
    if report.is_timed() {
        write!(out, "{:>9}{:>16}", "Mrays/s", "min..max")?;
    }
    Count::ALL.iter().try_for_each(|c| write!(out, "{:>10}", c.name()))?;
    writeln!(out, "{:>10}", "culled")?;
    for row in &model.rows {
        let Some(class) = row.classes.get(i) else { continue };
        write!(out, "{:<14}", name(row))?;
        if report.is_timed() {
            let rate = class.rate();
            write!(out, "{:>9}{:>16}", short(rate.median()), range(&rate))?;
        }
        Count::ALL.iter().try_for_each(|&c| write!(out, "{:>10}", short(class.per_ray(c))))?;
        writeln!(out, "{:>10}", culled(class, model.prims))?;
        if row.sampled && class.is_sampled() {
            write!(out, "  {:<12}", format!("{} rays", grouped(class.counts.queries)))?;
            if report.is_timed() {
                write!(out, "{:25}", "")?;
            }
            Count::ALL.iter().try_for_each(|&c| write!(out, "{:>10}", format!("±{}", short(class.interval(c)))))?;
            writeln!(out, "    (95 %)")?;
        }
    }
    Ok(())
}

fn name(row: &Row) -> String {
    format!("{}{}", row.kind, if row.sampled { "*" } else { "" })
}

fn range(spread: &Spread) -> String {
    format!("{}..{}", short(spread.min()), short(spread.max()))
}

/// In per cent, with as many digits as tell it from 100.
pub(super) fn culled(class: &ClassRow, prims: usize) -> String {
    match class.culled(prims) * 100.0 {
        p if p > 99.0 && p < 100.0 => format!("{:.4}%", p.min(99.9999)),
        p => format!("{p:.1}%"),
    }
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
