//! Plots of one model: the cost of each structure.

use super::super::Model;
use super::svg::{Scale, WIDTH, open, rule, spread_out, unit, words};
use crate::accel::Count;
use crate::bench::rays::Class;
use crate::bench::row::Row;
use crate::number::{grouped, seconds, short};
use std::fmt::Write;

/// Plot of ray/prim tests per ray: one row per structure, one mark per class.
pub(super) fn tests(model: &Model) -> String {
    const LEFT: f64 = 92.0;
    const ROW: f64 = 40.0;
    const TOP: f64 = 44.0;
    let bottom = TOP + ROW * model.rows.len() as f64;
    let values = model.rows.iter().flat_map(|r| r.classes.iter().map(|c| c.per_ray(Count::It)));
    let scale = Scale::around(values.chain([model.prims as f64]), LEFT + 10.0, WIDTH - 30.0);
    let mut svg = open(bottom + 38.0, "Ray/prim tests a ray by structure and class of rays");

    legend(&mut svg, model);
    for tick in scale.ticks() {
        let x = scale.at(tick);
        rule(&mut svg, [x, TOP], [x, bottom], "");
        let label = if tick < 1.0 { format!("{tick}") } else { grouped(tick as u64) };
        words(&mut svg, x, bottom + 15.0, "middle", "soft", &label);
    }
    let all = scale.at(model.prims as f64);
    rule(&mut svg, [all, TOP - 4.0], [all, bottom], "n");
    words(&mut svg, all.min(WIDTH - 2.0), bottom + 32.0, "end", "soft", "dashed: N, every prim tested");
    for (row, y) in model.rows.iter().zip(0..).map(|(row, i)| (row, TOP + ROW * f64::from(i))) {
        rule(&mut svg, [LEFT, y + ROW], [WIDTH - 8.0, y + ROW], "");
        words(&mut svg, LEFT - 4.0, y + ROW * 0.5 + 4.0, "end", "", &super::tables::name(row));
        let lanes = row.classes.len().max(1) as f64;
        for (i, (class, rays)) in row.classes.iter().zip(&model.rays).enumerate() {
            let value = class.per_ray(Count::It);
            let lane = y + ROW * (0.14 + 0.72 * (i as f64 + 0.5) / lanes);
            mark(&mut svg, rays.class, scale.at(value), lane, &format!("{}: {}", rays.class.name(), short(value)));
        }
    }
    svg + "</svg>"
}

/// Scatter plot with one point per structure: build time against time per ray, in seconds.
pub(super) fn times(model: &Model) -> String {
    const LEFT: f64 = 62.0;
    const RIGHT: f64 = 330.0;
    const TOP: f64 = 12.0;
    const BOTTOM: f64 = 270.0;
    let mut rows: Vec<&Row> = model.rows.iter().filter(|r| !r.sampled).collect();
    let x = Scale::fitting(rows.iter().map(|r| r.build.median()), LEFT, RIGHT);
    let y = Scale::fitting(rows.iter().map(|r| model.seconds_per_ray(r)), BOTTOM, TOP);
    let mut svg = open(BOTTOM + 42.0, "Seconds for a ray against seconds to build, by structure");
    for tick in x.ticks() {
        rule(&mut svg, [x.at(tick), TOP], [x.at(tick), BOTTOM], "");
        words(&mut svg, x.at(tick), BOTTOM + 15.0, "middle", "soft", &unit(tick));
    }
    for tick in y.ticks() {
        rule(&mut svg, [LEFT, y.at(tick)], [RIGHT, y.at(tick)], "");
        words(&mut svg, LEFT - 5.0, y.at(tick) + 4.0, "end", "soft", &unit(tick));
    }
    words(&mut svg, (LEFT + RIGHT) * 0.5, BOTTOM + 34.0, "middle", "soft", "time to build; up: time of a ray");

    // Names stand in a separate column, in the order of the points, so that none overlap.
    rows.sort_by(|a, b| model.seconds_per_ray(b).total_cmp(&model.seconds_per_ray(a)));
    let places: Vec<f64> = rows.iter().map(|r| y.at(model.seconds_per_ray(r))).collect();
    for (row, (place, label)) in rows.iter().zip(places.iter().zip(spread_out(&places, 15.0, BOTTOM))) {
        let px = x.at(row.build.median());
        rule(&mut svg, [px, *place], [RIGHT + 8.0, label], "");
        let told = format!(
            "{}: {} a ray, built in {}",
            row.kind,
            seconds(model.seconds_per_ray(row)),
            seconds(row.build.median())
        );
        let _ = write!(
            svg,
            "<circle class=\"dot\" cx=\"{px:.1}\" cy=\"{place:.1}\" r=\"4.5\"><title>{told}</title></circle>"
        );
        words(&mut svg, RIGHT + 11.0, label + 4.0, "start", "", &super::tables::name(row));
    }
    svg + "</svg>"
}

/// Legend of the marks, in two lines.
fn legend(svg: &mut String, model: &Model) {
    for (i, rays) in model.rays.iter().enumerate() {
        let (x, y) = (100.0 + 112.0 * (i % 3) as f64, 12.0 + 18.0 * (i / 3) as f64);
        mark(svg, rays.class, x, y, rays.class.name());
        words(svg, x + 9.0, y + 4.0, "start", "", rays.class.name());
    }
}

/// Draws a mark in the class's colour and shape.
fn mark(svg: &mut String, class: Class, x: f64, y: f64, title: &str) {
    let shape = match class {
        Class::Primary => "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0-9 0z",
        Class::Shadow => "M-4-4h8v8h-8z",
        Class::Reflected => "M0-5.5L5.5 0L0 5.5L-5.5 0z",
        Class::Refracted => "M0-5L5 4.5H-5z",
        Class::Diffuse => "M0 5L5-4.5H-5z",
    };
    let name = class.name();
    let _ = write!(
        svg,
        "<path class=\"{name}\" transform=\"translate({x:.1} {y:.1})\" d=\"{shape}\"><title>{title}</title></path>"
    );
}
