//! `--dry-run`: forecasts what a picture would take, without rendering it.
//!
//! # Schema `meshray-forecast/1`
//! With `--stats json`, one JSON object per picture, each on its own line: `version`, `file`, `output` (`-`: standard output),
//! `view` (in words), `width`, `height`, `looked_at` (number of pixels rendered for the forecast), `cpu_seconds`, `wall_seconds`
//! (if nothing else runs on the processors), `rays` (primary), `tests` (ray/prim) and `rmse` (of noise, the difference of two
//! renderings, in the space of `--error-space`; null where every rendering is the same), each with `value` and a 95 % confidence
//! interval `low` to `high` (`high` is null if unknown, since only one part of the picture was rendered); `memory` (bytes; null
//! where the system does not report it). Keys are only ever added.

use super::args::StatsFormat;
use super::outputs::Target;
use crate::number::{bytes, seconds, short};
use crate::render::{Forecast, Interval, Job};
use crate::stopwatch::peak_memory;
use crate::threads;
use serde_json::{Value, json};
use std::path::Path;

/// Identity of a picture: input, view and output.
#[derive(Clone, Copy)]
pub(super) struct PictureId<'a> {
    pub file: &'a Path,
    pub view: &'a str,
    pub target: &'a Target,
}

/// Formats the forecast of one picture, which itself takes `picture` bytes of memory.
pub(super) fn formatted(
    which: PictureId,
    work: &Job,
    forecast: &Forecast,
    picture: u64,
    format: Option<StatsFormat>,
) -> String {
    let told = ForecastReport { which, work, forecast, memory: peak_memory().map(|held| held + picture) };
    if format == Some(StatsFormat::Json) { told.json() } else { told.text() }
}

struct ForecastReport<'a> {
    which: PictureId<'a>,
    work: &'a Job<'a>,
    forecast: &'a Forecast,
    /// Peak memory of the whole run: the peak so far, plus the picture.
    memory: Option<u64>,
}

impl ForecastReport<'_> {
    /// Wall-clock time of all threads, if nothing else runs on the processors.
    fn wall(&self) -> Interval {
        let side_by_side = rayon::current_num_threads().min(threads::available()).max(1) as f64;
        let Interval { value, low, high } = self.forecast.cpu;
        Interval { value: value / side_by_side, low: low / side_by_side, high: high / side_by_side }
    }

    fn text(&self) -> String {
        let Forecast { looked_at, pixels, cpu, rays, tests, rmse } = *self.forecast;
        let settings = self.work.settings;
        let range = |i: Interval, unit: fn(f64) -> String| match i.high.is_finite() {
            true => format!("{} ({} to {})", unit(i.value), unit(i.low), unit(i.high)),
            false => format!("{} (of unknown spread)", unit(i.value)),
        };
        let mut lines = vec![
            ("processor time", range(cpu, seconds)),
            ("time", {
                let wall = range(self.wall(), seconds);
                format!("{wall} with {} threads, if nothing else runs", rayon::current_num_threads())
            }),
            (
                "rays from the eye",
                format!("{}, {} a pixel", range(rays, short), short(rays.value / pixels.max(1) as f64)),
            ),
            ("ray/prim tests", range(tests, short)),
        ];
        lines.push((
            "noise",
            match rmse {
                Some(rmse) => {
                    let rmse =
                        range(rmse, |e| if 0.0 < e && e < 5e-4 { format!("{e:.1e}") } else { format!("{e:.4}") });
                    format!("{rmse}; pixels that look certain too early add to the error")
                }
                None => "not known: every rendering has the same samples, so none tells how wrong they are".into(),
            },
        ));
        lines.extend(self.memory.map(|held| ("memory", bytes(held))));
        let mut text = format!(
            "{}, {}{}: {}×{}, forecast from {:.1} % of the pixels, with 95 % confidence; nothing is written\n",
            self.which.file.display(),
            self.which.view,
            self.which.target.path().map_or(String::new(), |path| format!(", as {}", path.display())),
            settings.width,
            settings.height,
            100.0 * looked_at as f64 / pixels.max(1) as f64
        );
        lines.iter().for_each(|(name, what)| text += &format!("  {name:<18}{what}\n"));
        text
    }

    fn json(&self) -> String {
        let Forecast { looked_at, cpu, rays, tests, rmse, .. } = *self.forecast;
        let interval = |i: Interval| json!({"value": i.value, "low": i.low, "high": i.high});
        let value = json!({
            "schema": "meshray-forecast/1",
            "version": super::version::SHORT,
            "file": self.which.file.to_string_lossy(),
            "output": self.which.target.path().map_or("-".into(), Path::to_string_lossy),
            "view": self.which.view,
            "width": self.work.settings.width,
            "height": self.work.settings.height,
            "looked_at": looked_at,
            "cpu_seconds": interval(cpu),
            "wall_seconds": interval(self.wall()),
            "rays": interval(rays),
            "tests": interval(tests),
            "rmse": rmse.map_or(Value::Null, interval),
            "memory": self.memory,
        });
        format!("{value}\n")
    }
}
