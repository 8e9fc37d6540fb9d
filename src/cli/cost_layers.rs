//! `--layers NAMES` and `--heatmap`: cost of each pixel, as channels of an EXR or as a separate picture.

use super::interrupt;
use super::job::{RenderJob, Shot};
use super::message::{Messages, Severity};
use super::outputs;
use crate::accel::AccelKind;
use crate::image::draw::heat::{Map, Scale};
use crate::image::{Layers, Metadata};
use crate::load::Diagnostic;
use crate::number::{short, so_many, whole};
use crate::render::{Cost, Costs, Settings};
use std::path::Path;

/// All costs that the job needs, for channels or heat maps.
pub(super) fn wanted(job: &RenderJob) -> Vec<Cost> {
    let asked = |cost: &Cost| job.look.costs.contains(cost) || job.heatmaps.contains(cost);
    Cost::ALL.into_iter().filter(asked).collect()
}

/// Adds the requested cost channels to the other layers.
pub(super) fn add_channels(job: &RenderJob, costs: &Costs, layers: &mut Layers) {
    layers.channels.extend(job.look.costs.iter().flat_map(|&cost| costs.channels(cost).cloned()));
}

/// Draws and writes the heat maps of a picture, and reports their contents.
pub(super) fn write_maps(
    job: &RenderJob,
    shot: &Shot,
    settings: &Settings,
    costs: &Costs,
    accel: AccelKind,
    messages: &Messages,
) -> Result<(), Diagnostic> {
    for &cost in &job.heatmaps {
        let Some(path) = outputs::heat_map(&shot.target, cost).and_then(|t| t.path().map(Path::to_path_buf)) else {
            continue;
        };
        let values = costs.total(cost);
        let (most, mean) = (values.iter().copied().fold(0.0, f64::max), mean(&values));
        let (what, unit, label): (_, _, fn(f64) -> String) = match cost {
            Cost::Tests => ("ray/prim tests", 1.0, whole),
            Cost::Steps => ("nodes and cells visited", 1.0, whole),
            Cost::Mailbox => ("tests saved by the mailbox", 1.0, whole),
            Cost::Ms => ("milliseconds", 1e-3, trimmed),
        };
        let scale = Scale::new(job.heatmap_max.unwrap_or(most), unit);
        // These rays are not the picture's, whose number differs between pixels.
        let rays = so_many(u64::from(settings.samples.max(1)), "ray");
        let text = format!("{what} per pixel of {rays}, {accel}: mean {}, most {}", short(mean), label(most));
        let map = Map { width: settings.width, values: &values, scale, title: &text, label };
        let fault = |text: String| Diagnostic::new("output-unwritable", &path, "", text);
        let bytes = map.draw().png(&Metadata::new()).map_err(|e| fault(e.to_string()))?;
        interrupt::write_atomic(&path, &bytes).map_err(|e| fault(e.to_string()))?;
        messages.say(Severity::Info, &Diagnostic::new("heatmap", &path, "", text));
    }
    Ok(())
}

/// Formats milliseconds without trailing zeros: 0.1, not 0.10.
fn trimmed(ms: f64) -> String {
    let text = short(ms);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
