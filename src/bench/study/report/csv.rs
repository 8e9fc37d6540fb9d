//! Study as CSV: one line per setting.

use crate::bench::study::Study;

const COLUMNS: &str = "file,flags,knob,cpu,cpu_min,cpu_max,wall,wall_min,wall_max,samples,rmse,noise,bias,max,worst_x,worst_y,flip,\
                       is_on_front,reference_error,width,height,threads,passes,seed,version";

/// Writes the whole table; times in seconds, errors in display codes 0..=1.
pub fn write(study: &Study) -> String {
    let front = study.front();
    let mut text = format!("{COLUMNS}\n");
    for (i, row) in study.rows.iter().enumerate() {
        let mut cells = vec![quoted(&study.name), quoted(&row.setting.flags), row.setting.knob.name().to_owned()];
        for spread in [&row.cpu, &row.wall] {
            cells.extend([spread.median(), spread.min(), spread.max()].map(|s| s.to_string()));
        }
        let error = row.error;
        cells.extend([row.samples, error.rmse, error.noise, error.bias, error.max].map(|x| x.to_string()));
        cells.extend([error.worst.0, error.worst.1].map(|n| n.to_string()));
        cells.extend([error.flip.to_string(), front.contains(&i).to_string(), study.reference.error.to_string()]);
        cells.extend([study.size.0, study.size.1].map(|n| n.to_string()));
        cells.extend([study.threads.to_string(), study.plan.renderings().to_string(), study.plan.seed.to_string()]);
        cells.push(quoted(env!("CARGO_PKG_VERSION")));
        text += &(cells.join(",") + "\n");
    }
    text
}

/// Quotes a field as in RFC 4180.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
