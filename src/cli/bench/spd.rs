//! `meshray bench --spd FOLDER`: our counts beside those published in 1999.

use super::super::args::BenchArgs;
use super::super::exit::Exit;
use super::super::message::{Messages, Severity};
use super::super::{interrupt, job, print};
use crate::bench::machine::Machine;
use crate::bench::report::Format;
use crate::bench::spd::measure::{Measured, Plan, measure};
use crate::bench::spd::published::{SCENES, Scene};
use crate::bench::spd::report::{Report, tables};
use crate::bench::spd::rules::PIXELS;
use crate::image::write_atomic;
use crate::load::{LoadError, LoadOptions, Loaded, Polygons, load};
use std::path::{Path, PathBuf};

/// Measures every scene that is there.
pub(super) fn run(folder: &Path, args: &BenchArgs, files: &[(PathBuf, Format)], messages: &Messages) -> Exit {
    let here: Vec<(&Scene, PathBuf)> = SCENES
        .iter()
        .map(|scene| (scene, folder.join(format!("{}.nff", scene.name))))
        .filter(|(_, path)| path.is_file())
        .collect();
    if here.is_empty() {
        let names = SCENES.map(|s| format!("{}.nff", s.name)).join(", ");
        messages.error("nothing-to-measure", format!("{}: holds none of {names}", folder.display()), "");
        return Exit::Input;
    }
    let plan = Plan { tests: args.slow_tests, seed: args.seed, pixels: PIXELS };
    let mut report = Report { machine: Machine::here(), tests: plan.tests, seed: plan.seed, scenes: Vec::new() };
    let mut worst = Exit::Done;
    for (scene, path) in here {
        match measured(scene, &path, args, plan, messages) {
            Ok(measured) => {
                let shown: Vec<String> = tables(&measured).iter().map(|t| t.text() + "\n").collect();
                report.scenes.push(measured);
                worst = worst.max(say(&shown.concat(), messages)).max(write(&report, files, messages));
            }
            Err(Exit::Interrupted) => return Exit::Interrupted,
            Err(exit) => worst = worst.max(exit),
        }
    }
    let verdicts: String = report.verdicts().iter().map(|v| format!("{v}\n")).collect();
    worst = worst.max(say(&format!("{verdicts}\n{}", report.notes()), messages));
    if report.is_right() {
        return worst;
    }
    messages.error("hits-differ", "structures disagree, or not as many eye rays hit as published", "");
    worst.max(Exit::Failed)
}

fn measured(
    scene: &'static Scene,
    path: &Path,
    args: &BenchArgs,
    plan: Plan,
    messages: &Messages,
) -> Result<Measured, Exit> {
    let Loaded { scene: loaded, facts, .. } = read(path, args).map_err(|error| {
        messages.load_error(&error);
        super::super::read::exit_of(&error)
    })?;
    let mut go_on = |_: &Measured, what: &str| {
        messages.info("progress", format!("{}: {what}", scene.name));
        !interrupt::raised()
    };
    measure(scene, &loaded, facts.hash, plan, &mut go_on).ok_or_else(|| {
        if interrupt::raised() {
            return Exit::Interrupted;
        }
        let fault = crate::load::Diagnostic::new("no-camera", path, "", "the file has no `v`, so there is no picture");
        messages.say(Severity::Error, &fault);
        Exit::Input
    })
}

/// Polygons stay whole: each is one object of the published counts.
fn read(path: &Path, args: &BenchArgs) -> Result<Loaded, LoadError> {
    let limits = job::limits(args.load.max_memory);
    load(path, &LoadOptions { polygons: Polygons::Whole, limits, ..LoadOptions::default() })
}

fn write(report: &Report, files: &[(PathBuf, Format)], messages: &Messages) -> Exit {
    let mut exit = Exit::Done;
    for (path, format) in files {
        if let Err(e) = write_atomic(path, report.write(*format).as_bytes(), false) {
            messages.error("output-unwritable", format!("{}: {e}", path.display()), "");
            exit = Exit::Failed;
        }
    }
    exit
}

fn say(text: &str, messages: &Messages) -> Exit {
    match print(text) {
        Ok(()) => Exit::Done,
        Err(e) => {
            messages.error("output-unwritable", format!("standard output: {e}"), "");
            Exit::Failed
        }
    }
}
