//! `meshray inspect`: contents of a file, as aligned text or as JSON.
//!
//! # Schema `meshray-inspect/1`
//! One JSON object. `file`, `format`, `generator`, `hash`, `files` (all that were read); `triangles`, `polygons`, `faces`,
//! `spheres`, `cones` (cylinders too), `planes`, `meshes`, `instances`, `materials`; `bounds` (`lo`, `hi`, metres) and `framed`
//! (the same without strays) with `strays`; `units`, `up`, `up_reason`, `faces_back` (whether named views are turned because the
//! front is on the other side); `topology` (`corners`, `edges`, `open`, `non_manifold`, `duplicates`, `degenerate`; equal
//! positions count as one corner; `by_object`: not across kept instances, if storing all of them separately would exceed the
//! memory limit); `dropped` (by reason); `points_and_lines`, `wires` (`points` and `lines`, with `point_width` and `line_width`
//! as drawn, metres; 0: none); `textures` (`name`, `width`, `height`); `missing` (files that were named but not found);
//! `extensions` (`name`, `required`, `supported`); `scenes`, `scene`; `variants`, `variant` (index of the requested one, or
//! null); `animations` (`name`, `seconds`, `channels`); `cameras`, `lights` (`name`, `kind`); `ambient` (uniform light, linear);
//! `features` (needed) and `left_out`; `memory` (bytes: `scene`, `structure`); `max_rounding`; `warnings` (messages). Keys are
//! only ever added.

mod args;
mod report;
mod topology;

use super::args::ModelArgs;
use super::exit::Exit;
use super::message::Messages;
use super::{panics, read};
use crate::render::Instancing;
pub(super) use args::InspectArgs;
use report::Report;

/// Loads the file and prints its contents.
pub(super) fn run(args: &InspectArgs) -> Exit {
    let messages = Messages::new(args.model.messages.into(), false);
    panics::guard(&args.model.input.display().to_string(), &messages, || inspect(args, &messages))
}

fn inspect(args: &InspectArgs, messages: &Messages) -> Exit {
    let ModelArgs { input, load, .. } = &args.model;
    let loaded = match read::model_as_stored(input, load, messages) {
        Ok(loaded) => loaded,
        Err(exit) => return exit,
    };
    let limit = load.limits().memory;
    let world = match read::as_drawn(&loaded, Instancing::Auto, limit, input) {
        Ok(world) => world,
        Err(fault) => return messages.fail(&fault, Exit::Failed),
    };
    let report = Report::new(input, &loaded, world, limit);
    let text = if args.json { report.json() } else { report.text() };
    match messages.print(&text) {
        Err(exit) => exit,
        Ok(()) if args.strict && !loaded.warnings.is_empty() => Exit::Input,
        Ok(()) => Exit::Done,
    }
}
