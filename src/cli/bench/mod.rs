//! `meshray bench`: compares structures on the rays of a real picture, in tables and report files.

mod args;
mod gate;
mod scene;
mod spd;

use super::exit::Exit;
use super::job::{self, UsageError};
use super::message::{Messages, Severity};
use super::writable::{self, Sources};
use super::{interrupt, panics};
use crate::accel::{AccelKind, AccelParams};
use crate::bench::compare::{Plan, compare};
use crate::bench::machine::Machine;
use crate::bench::rays::{self, RaySet};
use crate::bench::report::{Format, Model, Rays, Report, text};
use crate::bench::row::Row;
use crate::bench::sweep::Sweep;
use crate::huge_pages;
use crate::load::{Diagnostic, Loaded};
use crate::render::Filters;
use crate::render::texture::TextureStore;
pub(super) use args::BenchArgs;
use gate::Gate;
use scene::{Prepared, Subject};
use std::path::PathBuf;
use std::time::Duration;

/// Validated arguments of a run.
struct Bench<'a> {
    args: &'a BenchArgs,
    files: Vec<(PathBuf, Format)>,
    /// All inputs, the baseline, and the files used by the models loaded so far.
    sources: Sources,
    messages: Messages,
}

/// Compares structures on each model; the exit code is the worst of all models.
pub(super) fn run(args: &BenchArgs) -> Exit {
    let messages = Messages::new(args.messages.into(), args.quiet);
    // Most of the run traces rays, in many passes.
    huge_pages::allow(Duration::MAX);
    let (plan, files) = match (plan(args), files(args)) {
        (Ok(plan), Ok(files)) => (plan, files),
        (Err(wrong), _) | (_, Err(wrong)) => return messages.wrong(wrong),
    };
    let sources = Sources::of(args.inputs.iter().chain(&args.baseline));
    if let Err(fault) = writable::check_reports(&args.report, &sources) {
        return messages.fail(&fault, Exit::Failed);
    }
    let bench = Bench { args, files, sources, messages };
    if let Some(folder) = &args.spd {
        return bench.published(folder);
    }
    let gate = match args.baseline.as_ref().map(|path| Gate::read(path, &args.fail_if, &bench.messages)).transpose() {
        Ok(gate) => gate,
        Err(exit) => return exit,
    };
    for kind in args.accel.iter().filter(|kind| !plan.kinds.contains(kind)) {
        bench.messages.info("structure-left-out", format!("{kind} is left out: it has no such parameter"));
    }
    let mut report = Report {
        machine: Machine::here(),
        plan,
        models: Vec::new(),
        family: args.generate,
        heatmap_max: args.heatmap_max,
        compare: <[AccelKind; 2]>::try_from(&args.compare[..]).ok(),
        complete: false,
    };
    let mut worst = Exit::Done;
    for subject in subjects(args) {
        let name = subject.to_string();
        worst = worst.max(panics::guard(&name, &bench.messages, || bench.model(&subject, &mut report)));
        if interrupt::raised() {
            return Exit::Interrupted;
        }
    }
    if report.models.is_empty() {
        if worst == Exit::Done {
            bench.messages.error(
                "nothing-measured",
                "every size was left out",
                "raise --slow-tests, or name a structure that is not slow",
            );
            return Exit::Failed;
        }
        return worst;
    }
    report.complete = true;
    if report.family.is_some() {
        worst = worst.max(bench.print(&format!("{}\n", text::write_growth(&report))));
    }
    worst = worst.max(bench.print(&text::write_notes(&report)));
    worst = worst.max(bench.write(&report));
    worst.max(gate.map_or(Exit::Done, |gate| gate.judge(&report, &bench.messages)))
}

/// Models to measure, in order.
fn subjects(args: &BenchArgs) -> Vec<Subject> {
    match args.generate {
        Some(family) => args.sizes.0.iter().map(|&size| Subject::Generated(family, size)).collect(),
        None => args.inputs.iter().cloned().map(Subject::File).collect(),
    }
}

fn plan(args: &BenchArgs) -> Result<Plan, UsageError> {
    job::check_stdin(&args.inputs)?;
    let mut kinds: Vec<AccelKind> = Vec::new();
    for kind in &args.accel {
        if kinds.contains(kind) {
            return Err(UsageError(format!("--accel names {kind} twice")));
        }
        kinds.push(*kind);
    }
    if kinds.is_empty() {
        kinds = AccelKind::ALL.to_vec();
    }
    if let [a, b] = args.compare[..] {
        if a == b || !kinds.contains(&a) || !kinds.contains(&b) {
            return Err(UsageError(format!(
                "--compare {a},{b}: name two different structures that are measured (--accel)"
            )));
        }
    } else if !args.compare.is_empty() {
        return Err(UsageError("--compare takes two structures, such as grid,fast-bvh".into()));
    }
    let params = job::params(&args.params, &kinds)?;
    if let Some(sweep) = &args.sweep {
        kinds = swept(sweep, kinds, &params)?;
    }
    Ok(Plan {
        kinds,
        params,
        sweep: args.sweep.clone(),
        passes: args.passes,
        threads: usize::from(args.threads),
        rays: args.rays,
        slow_tests: args.slow_tests,
        seed: args.seed,
    })
}

/// Those of `kinds` that are affected by the sweep.
fn swept(sweep: &Sweep, kinds: Vec<AccelKind>, params: &AccelParams) -> Result<Vec<AccelKind>, UsageError> {
    let parameter = sweep.parameter;
    if parameter.is_set(params) {
        return Err(UsageError(format!(
            "--sweep {parameter} and --{parameter} set the same parameter; use one of them"
        )));
    }
    if let Some(flag) = parameter.overruled_by(params) {
        return Err(UsageError(format!("--sweep {parameter} changes nothing beside --{flag}; leave one of them out")));
    }
    let is_changed = |kind: &AccelKind| parameter.changes(*kind, params);
    let kinds: Vec<AccelKind> = kinds.into_iter().filter(is_changed).collect();
    if kinds.is_empty() {
        let others: Vec<&str> = AccelKind::ALL.iter().filter(|kind| is_changed(kind)).map(|kind| kind.name()).collect();
        let others = others.join(", ");
        return Err(UsageError(format!("--sweep {parameter} changes none of these structures; it changes {others}")));
    }
    Ok(kinds)
}

fn files(args: &BenchArgs) -> Result<Vec<(PathBuf, Format)>, UsageError> {
    let typed = |path: &PathBuf| Ok((path.clone(), Format::from_path(path).map_err(UsageError)?));
    let files: Vec<(PathBuf, Format)> = args.report.iter().map(typed).collect::<Result<_, UsageError>>()?;
    let of_pages = [("--compare", !args.compare.is_empty()), ("--heatmap-max", args.heatmap_max.is_some())];
    if let Some((flag, _)) = of_pages.iter().find(|(_, typed)| *typed)
        && files.iter().all(|(_, format)| *format != Format::Html)
    {
        return Err(UsageError(format!("{flag} is for the heat maps of an HTML report: add --report PATH.html")));
    }
    Ok(files)
}

/// Report of a model before any row is measured: its facts, its rays, and the depth of the ray tree.
fn head(prepared: &Prepared, name: &str, plan: &Plan, sets: &[RaySet], depth: u32) -> Model {
    let Prepared { world, settings, .. } = prepared;
    Model {
        name: name.to_owned(),
        hash: prepared.loaded.facts.hash,
        prims: world.len(),
        objects: world.objects(),
        kept: world.instanced.placed().len(),
        auto: plan.sweep.is_none().then(|| world.judged()),
        width: settings.width,
        height: settings.height,
        samples: settings.samples,
        depth,
        view: prepared.view_phrase.clone(),
        camera: prepared.view,
        rays: sets.iter().map(Rays::of).collect(),
        rows: Vec::new(),
        left_out: Vec::new(),
        pruning: None,
    }
}

impl Bench<'_> {
    /// Measures one model: its rays, rows and tables.
    fn model(&self, subject: &Subject, report: &mut Report) -> Exit {
        self.measure(subject, report).unwrap_or_else(|exit| exit)
    }

    fn measure(&self, subject: &Subject, report: &mut Report) -> Result<Exit, Exit> {
        let prepared = Prepared::new(subject, self.args, &self.messages)?;
        self.spares(&prepared.loaded).map_err(|fault| self.messages.fail(&fault, Exit::Failed))?;
        let name = subject.to_string();
        let (plan, mut left_out) = self.bearable(report, &prepared).map_err(|why| {
            let text = format!("left out: {why}");
            self.messages.say(Severity::Warning, &Diagnostic::new("size-left-out", &name, "", text));
            Exit::Done
        })?;
        let plan = self.able(plan, &prepared, &name, &mut left_out)?;
        self.messages.info("progress", format!("{name}: recording rays"));
        let (sets, depth) = prepared.with_job(|job| rays::record(job, plan.rays, plan.seed)).ok_or_else(|| {
            let fault = Diagnostic::new("threads", &name, "", "the rays could not be recorded");
            self.messages.fail(&fault, Exit::Failed)
        })?;
        let head = Model { left_out, ..head(&prepared, &name, &plan, &sets, depth) };
        report.models.push(head);

        let mut worst = self.rows(report, &prepared, &plan, &name, &sets)?;
        if plan.passes > 0 && plan.sweep.is_none() && report.family.is_none() {
            self.messages.info("progress", format!("{name}: rendering with every code path on"));
            let pruning = prepared.pruning(plan.passes);
            report.models.iter_mut().last().into_iter().for_each(|model| model.pruning.clone_from(&pruning));
            worst = worst.max(self.write(report));
        }
        let model = report.models.last().ok_or(Exit::Failed)?;
        let tables = if report.family.is_some() { text::write_short(model) } else { text::write(report, model) + "\n" };
        Ok(worst.max(self.print(&tables)).max(self.verdict(model)))
    }

    /// Sends the rays through every structure. The report is written after each one, so that a crash costs only one row.
    fn rows(
        &self,
        report: &mut Report,
        prepared: &Prepared,
        plan: &Plan,
        name: &str,
        sets: &[RaySet],
    ) -> Result<Exit, Exit> {
        let mut written = Exit::Done;
        let mut done = 0;
        let mut go_on = |rows: &[Row], what: &str| {
            self.messages.info("progress", format!("{name}: {what}"));
            if rows.len() > done {
                done = rows.len();
                written = written.max(self.keep(report, rows));
            }
            !interrupt::raised()
        };
        let Prepared { world, loaded, settings, .. } = prepared;
        // A sweep would give too many maps to look at.
        let pixels = if plan.sweep.is_some() { 0 } else { settings.width as usize * settings.height as usize };
        let textures = TextureStore::new(&loaded.scene);
        let filters = Filters::of(&loaded.scene, world, &textures, settings);
        let rows = compare(world, filters.as_ref(), sets, pixels, plan, &mut go_on)
            .ok_or_else(|| if interrupt::raised() { Exit::Interrupted } else { self.no_threads(name, plan.threads) })?;
        Ok(written.max(self.keep(report, &rows)))
    }

    /// Reports hits or pixels that should be identical but differ.
    fn verdict(&self, model: &Model) -> Exit {
        let name = &model.name;
        if model.pruning.as_ref().is_some_and(|pruning| !pruning.same) {
            let text = "the picture with every code path on differs from the usual one";
            let fault = Diagnostic::new("pixels-differ", name, "", text).remedy("please report it with the file");
            return self.messages.fail(&fault, Exit::Failed);
        }
        if model.differing() == 0 {
            return Exit::Done;
        }
        let fault = Diagnostic::new("hits-differ", name, "", model.verdict());
        self.messages.fail(&fault.remedy("please report it with the file"), Exit::Failed)
    }

    /// Refuses a model if a report would replace one of its files.
    fn spares(&self, loaded: &Loaded) -> Result<(), Diagnostic> {
        self.sources.add(&loaded.facts.files);
        self.files.iter().try_for_each(|(path, _)| self.sources.spared_by(path, "--report"))
    }

    /// Plan for one model, and the structures that it leaves out. For growing sizes, slow structures are dropped once they would
    /// take too long, and a size that gives the same scene as an earlier one is refused.
    fn bearable(&self, report: &Report, prepared: &Prepared) -> Result<(Plan, Vec<AccelKind>), String> {
        let mut plan = report.plan.clone();
        if report.family.is_none() {
            return Ok((plan, Vec::new()));
        }
        let (prims, hash) = (prepared.world.len(), prepared.loaded.facts.hash);
        if let Some(same) = report.models.iter().find(|m| m.hash == hash) {
            return Err(format!("the nearest scene of its family is {}, with {prims} prims", same.name));
        }
        let (kinds, left_out) = plan.kinds.iter().partition(|&&kind| report.plan.can_bear(kind, prims));
        plan.kinds = kinds;
        if plan.kinds.is_empty() {
            return Err(format!("{prims} prims are too many for slow structures; raise --slow-tests"));
        }
        Ok((plan, left_out))
    }

    /// Restricts a plan to structures that can keep instances if the world keeps them.
    fn able(&self, plan: Plan, prepared: &Prepared, name: &str, left_out: &mut Vec<AccelKind>) -> Result<Plan, Exit> {
        if prepared.world.instanced.is_empty() {
            return Ok(plan);
        }
        let (kinds, others): (Vec<AccelKind>, Vec<AccelKind>) =
            plan.kinds.iter().partition(|kind| kind.keeps_instances());
        let named = |kinds: &[AccelKind]| kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
        if kinds.is_empty() {
            let remedy = match plan.sweep {
                None => "measure fast-octree and fast-bvh, which keep them once, or raise --max-memory",
                Some(_) => "raise --max-memory",
            };
            let text = format!("its instances are too large for {}, stored by themselves", named(&others));
            let fault = Diagnostic::new("instances-too-large", name, "", text).remedy(remedy);
            return Err(self.messages.fail(&fault, Exit::Failed));
        }
        if !others.is_empty() {
            let text = format!(
                "{name}: what stands in several places is kept once, since it is too large to be stored in each; left out: {}, \
                 which cannot",
                named(&others)
            );
            self.messages.info("instances-kept", text);
        }
        left_out.extend(others);
        Ok(Plan { kinds, ..plan })
    }

    fn keep(&self, report: &mut Report, rows: &[Row]) -> Exit {
        if let Some(model) = report.models.last_mut() {
            model.rows = rows.to_vec();
        }
        self.write(report)
    }

    fn write(&self, report: &Report) -> Exit {
        self.write_as(|format| format.write(report))
    }

    /// Writes the requested report files, except those that would replace a model's file: that was reported on loading.
    fn write_as(&self, text: impl Fn(Format) -> String) -> Exit {
        let mut exit = Exit::Done;
        for (path, format) in &self.files {
            if self.sources.spared_by(path, "--report").is_err() {
                exit = Exit::Failed;
                continue;
            }
            if let Err(e) = interrupt::write_atomic(path, text(*format).as_bytes()) {
                exit = self.messages.unwritable(path, &e);
            }
        }
        exit
    }

    fn print(&self, text: &str) -> Exit {
        self.messages.print(text).err().unwrap_or_default()
    }

    fn no_threads(&self, name: &str, threads: usize) -> Exit {
        let fault = Diagnostic::new("threads", name, "", format!("cannot start {threads} threads"));
        self.messages.fail(&fault.remedy("ask for fewer"), Exit::Failed)
    }
}
