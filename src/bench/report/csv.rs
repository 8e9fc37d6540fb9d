//! CSV report: one line per model, structure and ray class; values that were not measured are empty.
//!
//! For a family of models in growing sizes, columns `e_…` are the exponents of that structure and class over all sizes, repeated
//! for every size. For a parameter sweep, `value` is that of the structure.

use super::cost::Cost;
use super::growth::Curve;
use super::{Model, Rays, Report};
use crate::accel::Count;
use crate::bench::row::{ClassRow, Row};

const COLUMNS: &str = "file,prims,structure,class,rays,asked,sampled,differing,t_b,t_b_min,t_b_max,bytes,n_in,n_v,n_ev,\
                       n_oiv,break_even,mrays,mrays_min,mrays_max,n_it,n_ts,n_ets,n_eets,n_bit,n_mb,n_xf,n_min,culled,\
                       threads,passes,seed,version,compiler,flags,cpu,e_n_it,e_n_ts,e_t_tr,e_bytes,e_t_b,\
                       parameter,value,is_default,objects";

/// Writes the whole table; `t_b` in seconds, `mrays` in millions of rays per second.
pub fn write(report: &Report) -> String {
    let mut text = format!("{COLUMNS}\n");
    for model in &report.models {
        for row in &model.rows {
            for (rays, class) in model.rays.iter().zip(&row.classes) {
                text += &line(report, model, row, rays, class);
            }
        }
    }
    text
}

fn line(report: &Report, model: &Model, row: &Row, rays: &Rays, class: &ClassRow) -> String {
    let (s, m, p) = (row.made_of, &report.machine, &report.plan);
    let mut cells = vec![quoted(&model.name), model.prims.to_string(), row.kind.to_string(), rays.class.name().into()];
    cells.extend([class.counts.queries, rays.asked].map(|n| n.to_string()));
    cells.extend([row.sampled.to_string(), class.differing.to_string()]);
    cells.extend([row.build.median(), row.build.min(), row.build.max()].map(number));
    cells.extend([s.bytes, s.n_in, s.n_v, s.n_ev, s.n_oiv].map(|n| n.to_string()));
    cells.push(model.break_even(row).map_or(String::new(), number));
    cells.extend(class.rates().map(number));
    cells.extend(Count::ALL.map(|c| number(class.per_ray(c))));
    cells.extend([class.n_min(), class.culled(model.prims)].map(number));
    cells.extend([p.threads.to_string(), p.passes.to_string(), p.seed.to_string()]);
    cells.extend([m.version, m.compiler, m.flags, &m.cpu].map(quoted));
    let exponent = |cost: Cost| {
        let class = cost.is_by_class().then_some(rays.class);
        let fit = report.family.and_then(|_| Curve::of(&report.models, row.kind, cost, class).fit);
        fit.map_or(String::new(), |f| number(f.exponent))
    };
    cells.extend(Cost::ALL.map(exponent));
    let setting = row.setting;
    cells.push(setting.map_or("", |s| s.parameter.name()).into());
    cells.push(setting.and_then(|s| s.value).map_or(String::new(), number));
    cells.push(setting.map_or(String::new(), |s| s.is_default.to_string()));
    cells.push(model.objects.to_string());
    cells.join(",") + "\n"
}

fn number(x: f64) -> String {
    if x.is_finite() { x.to_string() } else { String::new() }
}

/// Quotes a field as in RFC 4180.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
