//! `meshray bench --spd FOLDER`: compares our counts with those published in 1999.

use super::super::exit::Exit;
use super::super::interrupt;
use super::super::message::Severity;
use super::Bench;
use crate::bench::machine::Machine;
use crate::bench::spd::measure::{Measured, Plan, measure};
use crate::bench::spd::published::{SCENES, Scene};
use crate::bench::spd::report::{Report, tables};
use crate::bench::spd::rules::PIXELS;
use crate::load::{Diagnostic, LoadOptions, Loaded, Polygons, load};
use std::path::{Path, PathBuf};

impl Bench<'_> {
    /// Measures every scene found in the folder.
    pub(super) fn published(&self, folder: &Path) -> Exit {
        let file = |scene: &Scene| folder.join(format!("{}.nff", scene.name));
        let here: Vec<(&Scene, PathBuf)> =
            SCENES.iter().map(|scene| (scene, file(scene))).filter(|(_, path)| path.is_file()).collect();
        if here.is_empty() {
            let names = SCENES.map(|s| format!("{}.nff", s.name)).join(", ");
            let fault = Diagnostic::new("nothing-to-measure", folder, "", format!("holds none of {names}"));
            return self.messages.fail(&fault, Exit::Input);
        }
        let plan = Plan { tests: self.args.slow_tests, seed: self.args.seed, pixels: PIXELS };
        let mut report = Report { machine: Machine::here(), tests: plan.tests, seed: plan.seed, scenes: Vec::new() };
        let mut worst = Exit::Done;
        for (scene, path) in here {
            match self.measured(scene, &path, plan) {
                Ok(measured) => {
                    let shown: Vec<String> = tables(&measured).iter().map(|t| t.text() + "\n").collect();
                    report.scenes.push(measured);
                    worst = worst.max(self.print(&shown.concat())).max(self.write_as(|format| report.write(format)));
                }
                Err(Exit::Interrupted) => return Exit::Interrupted,
                Err(exit) => worst = worst.max(exit),
            }
        }
        let verdicts: String = report.verdicts().iter().map(|v| format!("{v}\n")).collect();
        worst = worst.max(self.print(&format!("{verdicts}\n{}", report.notes())));
        if report.is_right() {
            return worst;
        }
        self.messages.error("hits-differ", "structures disagree, or not as many eye rays hit as published", "");
        worst.max(Exit::Failed)
    }

    fn measured(&self, scene: &'static Scene, path: &Path, plan: Plan) -> Result<Measured, Exit> {
        // Polygons stay whole: each is one object of the published counts.
        let limits = self.args.load.limits();
        let options = LoadOptions { polygons: Polygons::Whole, limits, ..LoadOptions::default() };
        let loaded = load(path, &options).map_err(|error| self.messages.load_error(&error))?;
        let Loaded { scene: loaded, facts, warnings } = loaded;
        warnings.iter().for_each(|warning| self.messages.say(Severity::Warning, warning));
        let mut go_on = |_: &Measured, what: &str| {
            self.messages.info("progress", format!("{}: {what}", scene.name));
            !interrupt::raised()
        };
        measure(scene, &loaded, facts.hash, plan, &mut go_on).ok_or_else(|| {
            if interrupt::raised() {
                return Exit::Interrupted;
            }
            let fault = Diagnostic::new("no-camera", path, "", "the file has no `v`, so there is no picture")
                .remedy("give it a view");
            self.messages.fail(&fault, Exit::Input)
        })
    }
}
