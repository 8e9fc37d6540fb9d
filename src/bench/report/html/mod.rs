//! Report as one HTML page: no script, self-contained, readable on phones, in dark mode and on paper.

mod difference;
mod growth;
mod heat;
mod lines;
mod plot;
pub(crate) mod svg;
mod sweep;

use super::table::Table;
use super::{Model, Rays, Report, WORDS, auto, tables};
use crate::accel::AccelKind;
use crate::bench::row::Row;
use crate::number::{grouped, seconds, short};

/// Style sheet of the page. The class colours are M. Okabe and K. Ito's, distinguishable with any kind of colour vision; each
/// class also has its own shape.
const STYLE: &str = include_str!("style.css");

/// HTML page with this title in the common style.
pub fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <title>{title}</title><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n{body}</body></html>\n"
    )
}

/// Paragraph of one sentence.
pub fn paragraph(sentence: &str) -> String {
    format!("<p>{}.</p>\n", escaped(sentence))
}

/// Writes the page of a report.
pub fn write(report: &Report) -> String {
    let mut out =
        "<p>The rays of one picture of a model, sent through every structure: are the hits the same, and what \
                   do they cost?</p>\n"
            .to_owned();
    if !report.complete {
        out += "<p class=\"bad\">Not finished: more is to come, or the command was ended.</p>\n";
    }
    out += &growth::section(report);
    for model in &report.models {
        out += &match report.family {
            None => section(report, model),
            Some(_) => folded(model, &section(report, model)),
        };
    }
    page("meshray bench", &(out + &notes(report)))
}

/// Section of one of many models, collapsed.
fn folded(model: &Model, section: &str) -> String {
    format!(
        "<details><summary>{}: {} prims</summary>\n{section}</details>\n",
        escaped(&model.name),
        grouped(model.prims as u64)
    )
}

fn section(report: &Report, model: &Model) -> String {
    let verdict = if model.differing() == 0 { "good" } else { "bad" };
    let mut out = format!(
        "<section><h2>{}</h2>\n<p>{}; rays of {}: {}.</p>\n<p class=\"{verdict}\">{}</p>\n",
        escaped(&model.name),
        model.size(),
        escaped(&model.picture()),
        rays_line(model),
        escaped(&model.verdict()),
    );
    if let Some(sweep) = &report.plan.sweep {
        return out + &sweep::figures(report, model, sweep) + "</section>\n";
    }
    out += &glance(report, model);
    out += &model.pruning.iter().map(|p| format!("<p>{}.</p>\n", escaped(&p.sentence()))).collect::<String>();
    out += &figure(
        "Tests a ray",
        "Ray/prim tests (n_it) of an average ray, by what sent it. Further left is better; each step is ten times.",
        &plot::tests(model),
    );
    if report.is_timed() && !model.rows.is_empty() {
        let caption = format!(
            "Time of an average ray against the time to build. Down and to the left is better.{}",
            far_off(model)
        );
        out += &figure("Speed against build", &caption, &plot::times(model));
    }
    out += &heat::figure(report, model);
    out += &difference::figure(report, model);
    out += &table(&tables::structures(report, model));
    for (i, rays) in model.rays.iter().enumerate() {
        out += &table(&tables::class(report, model, i, rays));
    }
    out + "</section>\n"
}

fn rays_line(model: &Model) -> String {
    let of = |r: &Rays| match r.asked == r.kept as u64 {
        true => format!("{} {}", grouped(r.kept as u64), r.class.name()),
        false => format!("{} {} (an even sample of {})", grouped(r.kept as u64), r.class.name(), grouped(r.asked)),
    };
    model.rays.iter().map(of).collect::<Vec<_>>().join(", ")
}

/// Names the structures too slow for the scale of the plot, with their times.
fn far_off(model: &Model) -> String {
    let slow = model.rows.iter().filter(|r| r.sampled);
    let told: Vec<String> = slow.map(|r| format!("{} ({} a ray)", r.kind, seconds(model.seconds_per_ray(r)))).collect();
    if told.is_empty() { String::new() } else { format!(" Far above: {}.", told.join(", ")) }
}

/// Summary in one paragraph.
fn glance(report: &Report, model: &Model) -> String {
    let rated: Vec<&Row> = model.rows.iter().filter(|r| !r.sampled).collect();
    let tests = |row: &Row| {
        let sum: u64 = row.classes.iter().map(|c| c.counts.n_it).sum();
        sum as f64 / row.rays().max(1) as f64
    };
    let mut said = Vec::new();
    let by_speed = |a: &&&Row, b: &&&Row| model.seconds_per_ray(a).total_cmp(&model.seconds_per_ray(b));
    if let Some(best) = rated.iter().min_by(by_speed).filter(|_| report.is_timed()) {
        let rate = short(1e-6 / model.seconds_per_ray(best));
        let mut text = format!("Fastest on these rays: <b>{}</b>, {rate} million rays a second", best.kind);
        if let Some(none) = model.rows.iter().find(|r| r.kind == AccelKind::None && r.kind != best.kind) {
            let times = model.seconds_per_ray(none) / model.seconds_per_ray(best);
            text += &format!(", {} times as fast as testing everything", short(times));
        }
        said.push(text);
    }
    if let Some(least) = rated.iter().min_by(|a, b| tests(a).total_cmp(&tests(b))) {
        let culled = 100.0 * (1.0 - tests(least) / model.prims.max(1) as f64);
        said.push(format!(
            "Fewest ray/prim tests: <b>{}</b>, {} of {} prims for an average ray ({culled:.2} % culled)",
            least.kind,
            short(tests(least)),
            grouped(model.prims as u64)
        ));
    }
    said.extend(auto::sentences(report, model).iter().map(|text| escaped(text)));
    said.iter().map(|text| format!("<p>{text}.</p>\n")).collect()
}

fn figure(title: &str, caption: &str, svg: &str) -> String {
    format!("<figure><h3>{title}</h3><figcaption>{caption}</figcaption>{svg}</figure>\n")
}

/// HTML table with its title.
pub fn table(shown: &Table) -> String {
    let head: String = shown.columns.iter().map(|title| format!("<th scope=\"col\">{}</th>", escaped(title))).collect();
    let line = |cells: &Vec<String>| {
        let mut cells = cells.iter().map(|cell| escaped(cell));
        let first = cells.next().unwrap_or_default();
        let rest: String = cells.map(|c| format!("<td>{c}</td>")).collect();
        format!("<tr><th scope=\"row\">{first}</th>{rest}</tr>\n")
    };
    let body: String = shown.rows.iter().map(line).collect();
    let title = escaped(&shown.title);
    format!(
        "<h3>{title}</h3><div class=\"wide\"><table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table></div>\n"
    )
}

fn notes(report: &Report) -> String {
    let words: String = WORDS.iter().map(|(word, what)| format!("<dt>{word}</dt><dd>{what}</dd>")).collect();
    format!(
        "<section><h2>How to read it</h2><dl>{words}<dt>*</dt><dd>tests so much that it got an even sample of the rays; \
         ± is half the 95 % interval</dd></dl>\n<p>{}.</p>\n<p>{}.</p></section>\n",
        escaped(&report.method()),
        escaped(&report.machine.line())
    )
}

/// Escapes text for HTML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
