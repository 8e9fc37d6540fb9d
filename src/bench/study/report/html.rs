//! Study as an HTML page: recommendations, the front, the worst pixels, every row.

use crate::bench::machine::Machine;
use crate::bench::report::html::svg::{Scale, WIDTH, open, plain, rule, unit, words};
use crate::bench::report::html::{escaped, page, paragraph};
use crate::bench::study::knob::Knob;
use crate::bench::study::measure::Row;
use crate::bench::study::{Study, png};
use crate::number::{seconds, short};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// Writes the page.
pub fn write(study: &Study) -> String {
    let (width, height) = study.size;
    let mut out =
        "<p>One view of a model, rendered with each setting and compared with a reference: what does a knob cost, \
                   and what does it buy?</p>\n"
            .to_owned();
    if !study.complete {
        out += "<p class=\"bad\">Not finished: more is to come, or the command was ended.</p>\n";
    }
    out += &format!("<section><h2>{}</h2>\n", escaped(&study.name));
    out += &paragraph(&format!(
        "{width}×{height} pixels, {}; the reference is the mean of {} samples a pixel in double precision, and is itself {:.5} \
         off (standard error). Errors are those of the displayed picture, codes 0 to 1; times are of the processor, all threads \
         together, the median of {} renderings with different random numbers",
        study.view,
        study.reference.samples,
        study.reference.error,
        study.plan.renderings()
    ));
    out += &advice(study);
    out += &format!(
        "<figure><h3>Error against time</h3><figcaption>Down and to the left is better. The line joins what nothing else beats in \
         both.</figcaption>{}</figure>\n",
        plot(study)
    );
    out += &crops(study);
    out += &table(study);
    out += &knobs(study);
    out += "</section>\n";
    out += &paragraph(&Machine::here().line());
    page("meshray study", &out)
}

fn advice(study: &Study) -> String {
    let mut out = "<h3>What to use</h3>\n<dl>".to_owned();
    for advice in study.advice() {
        let flags = advice.row.map_or("nothing that was tried", |i| study.rows[i].setting.flags.as_str());
        // Writing to a string does not fail, here and below.
        let _ = write!(out, "<dt>{}</dt><dd><b>{}</b>: {}.</dd>", advice.purpose, escaped(flags), escaped(&advice.why));
    }
    out + "</dl>\n"
}

/// CSS class, name and SVG path of the mark of a knob; more than a few groups could not be told apart.
fn mark(knob: Knob) -> (&'static str, &'static str, &'static str) {
    match knob {
        Knob::Quality => {
            ("diffuse", "--quality", "M0-6L1.8-1.9L6-1.9L2.8 1L4 5.4L0 2.8L-4 5.4L-2.8 1L-6-1.9L-1.8-1.9z")
        }
        Knob::Uniform => ("primary", "uniform", "M-4-4h8v8h-8z"),
        Knob::Adaptive => ("shadow", "adaptive", "M0-5L5 4.5H-5z"),
        Knob::Stochastic => ("reflected", "stochastic", "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0-9 0z"),
        _ => ("refracted", "other knobs", "M0-5L5 0L0 5L-5 0z"),
    }
}

fn plot(study: &Study) -> String {
    const LEFT: f64 = 62.0;
    const TOP: f64 = 34.0;
    const BOTTOM: f64 = 300.0;
    let rows: Vec<&Row> = study.rows.iter().collect();
    let x = Scale::fitting(rows.iter().map(|r| r.cpu.median()), LEFT, WIDTH - 12.0);
    let y = Scale::fitting(rows.iter().map(|r| r.error.rmse), BOTTOM, TOP);
    let mut svg = open(BOTTOM + 42.0, "Error against time, by setting");
    for tick in x.ticks() {
        rule(&mut svg, [x.at(tick), TOP], [x.at(tick), BOTTOM], "");
        words(&mut svg, x.at(tick), BOTTOM + 15.0, "middle", "soft", &unit(tick));
    }
    for tick in y.ticks() {
        rule(&mut svg, [LEFT, y.at(tick)], [WIDTH - 12.0, y.at(tick)], "");
        words(&mut svg, LEFT - 5.0, y.at(tick) + 4.0, "end", "soft", plain(&format!("{tick:.5}")));
    }
    words(
        &mut svg,
        (LEFT + WIDTH) * 0.5,
        BOTTOM + 34.0,
        "middle",
        "soft",
        "processor time; up: root mean square error",
    );
    legend(&mut svg);
    let at = |row: &Row| (x.at(row.cpu.median()), y.at(row.error.rmse));
    let front: Vec<String> =
        study.front().into_iter().map(|i| at(&study.rows[i])).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let _ = write!(svg, "<polyline class=\"k-fast-bvh\" points=\"{}\"/>", front.join(" "));
    for row in &rows {
        let (class, _, shape) = mark(row.setting.knob);
        let (px, py) = at(row);
        let _ = write!(
            svg,
            "<path class=\"{class}\" transform=\"translate({px:.1} {py:.1})\" d=\"{shape}\"><title>{}: {}, RMSE {}</title></path>",
            escaped(&row.setting.flags),
            seconds(row.cpu.median()),
            escaped(&row.error.formatted(4))
        );
    }
    svg + "</svg>"
}

fn legend(svg: &mut String) {
    let kinds = [Knob::Quality, Knob::Uniform, Knob::Adaptive, Knob::Stochastic, Knob::Depth];
    let mut left = 12.0;
    for (class, name, shape) in kinds.map(mark) {
        let _ = write!(svg, "<path class=\"{class}\" transform=\"translate({left:.1} 12)\" d=\"{shape}\"/>");
        words(svg, left + 9.0, 16.0, "start", "soft", name);
        left += 26.0 + 7.0 * name.chars().count() as f64;
    }
}

/// Worst pixels of the settings on the front, beside the reference.
fn crops(study: &Study) -> String {
    let mut list = String::new();
    for i in study.front() {
        let row = &study.rows[i];
        let (x, y) = row.error.worst;
        let image = |picture, alt: &str| {
            format!(
                "<img alt=\"{alt}\" style=\"width:50%;float:left\" src=\"data:image/png;base64,{}\">",
                STANDARD.encode(png(picture))
            )
        };
        let _ = writeln!(
            list,
            "<li>{}{}<span style=\"display:block;clear:both\"><b>{}</b>: off by {} at ({x}, {y})</span></li>",
            image(&row.crop.expected, "expected"),
            image(&row.crop.actual, "rendered"),
            escaped(&row.setting.flags),
            short(row.error.max)
        );
    }
    format!(
        "<figure class=\"maps\"><h3>The worst pixels</h3><figcaption>Around the pixel that is most wrong: how it should be, and as it \
         was rendered.</figcaption><ul>{list}</ul></figure>\n"
    )
}

fn table(study: &Study) -> String {
    let front = study.front();
    let mut out = "<h3>Every setting</h3>\n<div class=\"wide\"><table><thead><tr><th>setting</th><th>CPU time</th><th>min..max</th>\
                   <th>wall</th><th>samples</th><th>RMSE</th><th>noise</th><th>bias</th><th>max</th><th>FLIP</th><th>front</th></tr>\
                   </thead><tbody>\n"
        .to_owned();
    for (i, row) in study.rows.iter().enumerate() {
        let e = row.error;
        let _ = writeln!(
            out,
            "<tr><th>{}</th><td>{}</td><td>{}..{}</td><td>{}</td><td>{:.1}</td><td>{}</td><td>{:.5}</td><td>{:.5}</td><td>{:.3}</td>\
             <td>{:.4}</td><td>{}</td></tr>",
            escaped(&row.setting.flags),
            seconds(row.cpu.median()),
            seconds(row.cpu.min()),
            seconds(row.cpu.max()),
            seconds(row.wall.median()),
            row.samples,
            escaped(&e.formatted(5)),
            e.noise,
            e.bias,
            e.max,
            e.flip,
            if front.contains(&i) { "yes" } else { "" }
        );
    }
    out + "</tbody></table></div>\n"
}

/// Cost and risk of each knob that was varied.
fn knobs(study: &Study) -> String {
    let mut out = "<h3>What knobs cost, and what they risk</h3>\n<div class=\"wide\"><table class=\"text\"><thead><tr><th>knob</th>\
                   <th>turned up, it costs</th><th>turned down, it risks</th></tr></thead><tbody>\n"
        .to_owned();
    for knob in Knob::ALL.into_iter().filter(|&knob| study.rows.iter().any(|row| row.setting.knob == knob)) {
        let (costs, risks) = knob.price();
        let _ = writeln!(out, "<tr><th>{knob}</th><td>{costs}</td><td>{risks}</td></tr>");
    }
    out + "</tbody></table></div>\n"
}
