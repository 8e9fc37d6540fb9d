//! `meshray render`: load, build, render, write; one batch after the other, going on where one fails.

use super::exit::Exit;
use super::job::{Batch, RenderJob, Shot, Target};
use super::message::{Messages, Severity};
use super::picture::{self, Effective};
use super::profile::Profile;
use super::progress::Progress;
use super::sequence::{self, Step, Survey};
use super::stats::{self, PictureStats, Times};
use super::summary::Summary;
use super::writable::{self, Sources};
use super::{accident, again, cost_layers, dry_run, interrupt, meter, output_name, read, surroundings};
use crate::accel::AnyAccel;
use crate::accel::auto::Reason;
use crate::image::{FileKind, was_written_by_meshray};
use crate::load::{Diagnostic, LoadOptions, Loaded};
use crate::render::texture::TextureStore;
use crate::render::{Costs, Instancing, Job, Rendered, Settings, View, World, render_costs};
use crate::scene::Scene;
use crate::scene::framing::{Bounds, robust_bounds_within};
use crate::threads;
use std::collections::HashSet;
use std::path::Path;
use std::time::Instant;

/// Does the whole job and tells how it ended: as its worst picture.
pub(super) fn run(job: &RenderJob, messages: &Messages) -> Exit {
    let pool = match threads::pool(job.threads) {
        Ok(pool) => pool,
        Err(e) => {
            messages.error("threads", format!("cannot start {} threads: {e}", job.threads), "ask for fewer");
            return Exit::Failed;
        }
    };
    let mut so_far = SoFar { sources: Sources::of(job.batches.iter().flat_map(|b| &b.inputs)), pictures: Vec::new() };
    if let Some(path) = job.stats_file()
        && let Err(fault) = writable::check(path, "--stats-file", &so_far.sources)
    {
        messages.say(Severity::Error, &fault);
        return Exit::Failed;
    }
    let mut worst = Exit::Done;
    for batch in &job.batches {
        let name = batch.inputs[0].display().to_string();
        let work = || pool.install(|| render_batch(job, batch, messages, &mut so_far));
        let exit = accident::guard(&name, messages, work);
        worst = worst.max(exit);
        if interrupt::raised() {
            return Exit::Interrupted;
        }
    }
    if job.batches.len() > 1 {
        let (pictures, scenes) = (so_far.pictures.len(), job.batches.len());
        messages.info("batch", format!("{pictures} pictures of {scenes} inputs, {} warnings", messages.warnings()));
    }
    worst.max(report(job, &so_far, messages))
}

/// What a run has read and made so far.
struct SoFar {
    /// All inputs, and the files that those loaded so far use.
    sources: Sources,
    pictures: Vec<PictureStats>,
}

/// Prints or writes the statistics, but never over what a model was read from.
fn report(job: &RenderJob, so_far: &SoFar, messages: &Messages) -> Exit {
    match job.stats_file().map_or(Ok(()), |path| so_far.sources.spared_by(path, "--stats-file")) {
        Ok(()) => stats::report(job, &so_far.pictures, messages),
        // It was said when that model was loaded.
        Err(_) => Exit::Failed,
    }
}

/// One scene and its pictures.
fn render_batch(job: &RenderJob, batch: &Batch, messages: &Messages, so_far: &mut SoFar) -> Exit {
    let mut worst = Exit::Done;
    let mut shots = Vec::new();
    for shot in &batch.shots {
        let maps = job.heatmaps.iter().filter_map(|&cost| cost_layers::target(&shot.target, cost));
        let targets = std::iter::once(shot.target.clone()).chain(maps);
        match targets.into_iter().try_for_each(|target| check_target(&target, &so_far.sources)) {
            Ok(()) => shots.push(shot),
            Err(fault) => {
                messages.say(Severity::Error, &fault);
                worst = Exit::Failed;
            }
        }
    }
    if shots.is_empty() {
        return worst;
    }
    // The bar needs the room that folders would take.
    let name = batch.inputs[0].file_name().unwrap_or(batch.inputs[0].as_os_str()).to_string_lossy();
    let progress = Progress::new(&name, messages, job.quiet, job.keep_partial);
    let mut profile = if so_far.pictures.is_empty() { Profile::of_process() } else { Profile::new() };
    let aspect = |scene: &Scene| Effective::new(&job.look, &scene.hints).map_or(1.0, |effective| effective.aspect());
    let survey = match Survey::of(job, batch, aspect, messages, &progress) {
        Ok(survey) => survey,
        Err(exit) => return worst.max(exit),
    };
    survey.iter().for_each(|_| profile.done("frame"));
    let (mut profile, mut earlier, mut left) = (Some(profile), None, shots.as_slice());
    while let Some(first) = left.first() {
        // Pictures of one moment have one scene.
        let same = left.iter().take_while(|shot| shot.step.moment == first.step.moment).count();
        let (now, later) = left.split_at(same);
        left = later;
        let profile = profile.take().unwrap_or_else(Profile::new);
        let mut ready = match prepare(job, batch, &first.step, earlier.take(), messages, &progress, profile) {
            Ok(ready) => ready,
            Err(exit) => return worst.max(exit),
        };
        so_far.sources.add(&ready.loaded.facts.files);
        if let Some(path) = job.stats_file()
            && let Err(fault) = so_far.sources.spared_by(path, "--stats-file")
        {
            messages.say(Severity::Error, &fault);
            return worst.max(Exit::Failed);
        }
        let mut stage = ready.stage(survey.as_ref());
        for shot in now {
            worst = worst.max(render_shot(job, batch, shot, &mut stage, messages, &progress, so_far));
            if interrupt::raised() {
                return Exit::Interrupted;
            }
        }
        drop(stage);
        earlier = Some(ready);
    }
    worst
}

/// Whether a picture may go there. Asked before any work is done for it.
fn check_target(target: &Target, sources: &Sources) -> Result<(), Diagnostic> {
    let Some(path) = target.path() else {
        use std::io::IsTerminal;
        let text = "standard output is a terminal, which shows no pictures";
        let fault = Diagnostic::new("output-terminal", "", "", text).remedy("redirect it, or name a file with -o");
        return if std::io::stdout().is_terminal() { Err(fault) } else { Ok(()) };
    };
    writable::check(path, "-o", sources)?;
    if matches!(target, Target::Default(_)) && path.exists() && !was_written_by_meshray(path) {
        let fault = Diagnostic::new("output-not-ours", path, "", "exists and is no picture that meshray wrote");
        return Err(fault.remedy("name the output with -o"));
    }
    Ok(())
}

/// A scene that can be rendered.
struct Ready {
    loaded: Loaded,
    world: World,
    bounds: Bounds,
    load_seconds: f64,
    /// Stages that no picture has told yet.
    profile: Profile,
    /// Stops that all pictures of the scene are exposed by; `None`: not yet known.
    metered: Option<f32>,
    /// Code and place of the warnings that have been said.
    told: HashSet<(&'static str, String)>,
}

impl Ready {
    /// Nothing built yet. Frames of a sequence are seen in the bounds of all.
    fn stage<'a>(&'a mut self, survey: Option<&'a Survey>) -> Stage<'a> {
        let Self { loaded, world, bounds, load_seconds, profile, metered, .. } = self;
        let bounds = survey.map_or(&*bounds, |survey| &survey.bounds);
        Stage { loaded, world, bounds, load_seconds, profile, survey, built: None, metered }
    }
}

/// A scene that is rendered, and the structure that all its pictures share.
struct Stage<'a> {
    loaded: &'a mut Loaded,
    world: &'a World,
    bounds: &'a Bounds,
    load_seconds: &'a mut f64,
    profile: &'a mut Profile,
    survey: Option<&'a Survey>,
    built: Option<(AnyAccel<'a>, Option<Reason>)>,
    metered: &'a mut Option<f32>,
}

fn prepare(
    job: &RenderJob,
    batch: &Batch,
    step: &Step,
    earlier: Option<Ready>,
    messages: &Messages,
    progress: &Progress,
    mut profile: Profile,
) -> Result<Ready, Exit> {
    let start = Instant::now();
    progress.stage("loading");
    let options = LoadOptions { without_pictures: earlier.is_some(), ..job.load_for(step) };
    let mut loaded = read::scene(&batch.inputs, &options).map_err(|error| {
        messages.load_error(&error);
        read::exit_of(&error)
    })?;
    let (mut told, mut metered) = (HashSet::new(), None);
    if let Some(earlier) = earlier {
        (told, metered) = (earlier.told, earlier.metered);
        if !read::take_pictures(&mut loaded, earlier.loaded) {
            let fault = Diagnostic::new("input-changed", &batch.inputs[0], "", "was changed while it was rendered");
            messages.say(Severity::Error, &fault.remedy("render it again"));
            return Err(Exit::Failed);
        }
    } else {
        surroundings::place(&job.look, &job.load.limits, &mut loaded).map_err(|error| {
            messages.load_error(&error);
            read::exit_of(&error)
        })?;
    }
    profile.loaded(loaded.facts.reading, loaded.facts.decoding);
    // What is wrong with one frame is wrong with most.
    for warning in loaded.warnings.iter().filter(|w| told.insert((w.code, w.place.clone()))) {
        messages.say(Severity::Warning, warning);
    }
    if job.strict && !loaded.warnings.is_empty() {
        let count = loaded.warnings.len();
        let text = format!("not rendered: --strict, and there are {count} kinds of warnings");
        messages.say(Severity::Error, &Diagnostic::new("strict", &batch.inputs[0], "", text));
        return Err(Exit::Input);
    }
    if let Some(expected) = &job.expected_hash {
        again::check_hash(expected, &loaded, &batch.inputs[0]).map_err(|fault| {
            messages.say(Severity::Error, &fault);
            Exit::Input
        })?;
    }
    if job.instances == Instancing::Flatten {
        let remedy =
            "leave it to a fast structure to keep them once (--instances auto), or allow more with --max-memory";
        let fits = read::check_flattened(&loaded, job.load.limits.memory, &batch.inputs[0], remedy);
        fits.map_err(|fault| {
            messages.say(Severity::Error, &fault);
            Exit::Failed
        })?;
    }
    let world = World::placing(&loaded.scene, job.instances);
    let world = if job.everything { world.with_everything() } else { world };
    if world.is_empty() && !job.allow_empty {
        messages.say(Severity::Error, &nothing_to_draw(&loaded, &batch.inputs[0]));
        return Err(Exit::Input);
    }
    profile.done("place");
    let bounds = robust_bounds_within(&loaded.scene, world.bounds);
    profile.done("frame");
    Ok(Ready { loaded, world, bounds, load_seconds: start.elapsed().as_secs_f64(), profile, metered, told })
}

fn nothing_to_draw(loaded: &Loaded, file: &Path) -> Diagnostic {
    let held = match loaded.facts.dropped.iter().map(|(_, n)| n).sum::<u64>() {
        0 => "nothing to draw: it holds no faces, lines or points".to_owned(),
        n => format!("nothing to draw: all of its {n} faces, lines and points had to be dropped"),
    };
    Diagnostic::new("nothing-to-draw", file, "", held).remedy("--allow-empty draws the background")
}

fn render_shot(
    job: &RenderJob,
    batch: &Batch,
    shot: &Shot,
    stage: &mut Stage,
    messages: &Messages,
    progress: &Progress,
    so_far: &mut SoFar,
) -> Exit {
    let Stage { loaded, world, bounds, load_seconds, profile, survey, built, metered } = stage;
    let file = &batch.inputs[0];
    let fail = |fault: &Diagnostic, exit| {
        messages.say(Severity::Error, fault);
        exit
    };
    let names = cost_layers::names(shot, &job.heatmaps);
    if let Err(fault) = names.iter().try_for_each(|path| so_far.sources.spared_by(path, "-o")) {
        return fail(&fault, Exit::Failed);
    }
    let mut effective = match Effective::new(&job.look, &loaded.scene.hints) {
        Ok(effective) => effective.with_everything(job.everything),
        Err(text) => return fail(&Diagnostic::new("scene-value", file, "", text), Exit::Input),
    };
    if let Some(fault) = picture::too_large(&effective, cost_layers::wanted(job).len(), job.load.limits.memory) {
        return fail(&fault, Exit::Failed);
    }
    let Settings { width, height, .. } = effective.settings;
    if let Err(error) = shot.kind.fits(width, height) {
        return fail(&Diagnostic::new("picture-too-large", file, "", error.to_string()), Exit::Failed);
    }

    // The eye, then the light that belongs to it: each view has its own.
    let seen = (&loaded.scene, *bounds);
    let (camera, view_phrase) = match sequence::camera(job, shot, *survey, seen, effective.aspect(), file) {
        Ok(found) => found,
        Err(fault) => return fail(&fault, Exit::Input),
    };
    let (lights, environment) = (loaded.scene.lights.clone(), loaded.scene.environment);
    let background = loaded.scene.background;
    let light = surroundings::light(&job.look, &mut loaded.scene, &camera);
    loaded.scene.background = Some(picture::background(&job.look, &loaded.scene));
    let view = View::from_camera(&camera);
    match job.look.sampling.lens(&view, (bounds.lo + bounds.hi) * 0.5, file) {
        Ok(lens) => effective.settings.lens = lens,
        Err(fault) => return fail(&fault, Exit::Input),
    }
    profile.done("frame");

    let mut times = Times { load: **load_seconds, ..Times::default() };
    progress.stage("building");
    let start = Instant::now();
    let (accel, reason) = built.get_or_insert_with(|| {
        let (accel, reason) = world.structure(job.accel, &job.params);
        (accel.tested_by(job.intersector), reason)
    });
    let (accel, reason) = (&*accel, *reason);
    let textures = TextureStore::new(&loaded.scene);
    let textures = if job.everything { textures.with_everything() } else { textures };
    times.build = start.elapsed().as_secs_f64();
    profile.done("build");

    let scene = &loaded.scene;
    let work = Job { scene, world, accel, textures: &textures, view: &view, settings: &effective.settings };
    if effective.metered && shot.kind != FileKind::Exr {
        progress.stage("metering");
        let stops = *metered.get_or_insert_with(|| meter::exposure(&loaded.scene, &work, &effective).unwrap_or(0.0));
        effective.output.exposure = stops;
        profile.done("meter");
    }
    effective.written_as(&job.look, shot.kind);
    let work = Job { settings: &effective.settings, scene, world, accel, textures: &textures, view: &view };
    if job.dry_run {
        return foretell(job, file, &work, messages, progress);
    }
    let mut rendered = trace(job, &work, progress, &mut times, profile);
    let costs = rendered.complete.then(|| costs(job, &work, progress));
    progress.finish();
    let Some(costs) = costs.flatten() else {
        return keep_partial(shot, &rendered, &effective, loaded, messages);
    };
    if let Some(layers) = &mut rendered.picture.layers {
        cost_layers::add_channels(job, &costs, layers);
    }
    let counted = job.stats.is_some().then(|| stats::count(&work, &rendered, accel, messages));

    let (depth, accel_kind) = (rendered.depth, accel.kind());
    let sampled = &rendered.sampled;
    let facts =
        again::Facts { job, batch, shot, effective: &effective, sampled, depth, accel: accel_kind, reason, loaded };
    let metadata = again::metadata(&facts, counted.as_ref());
    profile.skip();
    let start = Instant::now();
    let bytes = picture::encoded(shot, &rendered.picture, &effective, loaded.scene.background, &metadata);
    profile.done("encode");
    let written = bytes.and_then(|bytes| picture::write(shot, &bytes));
    profile.done("write");
    times.write = start.elapsed().as_secs_f64();
    let profile = profile.take();
    let exit = match written {
        Ok(()) => {
            let summary = Summary { shot, effective: &effective, loaded, bounds, view: &view_phrase, light };
            summary.say(&rendered, &times, messages);
            let profile = job.profile.then_some(profile);
            profile.iter().for_each(|p| p.say(messages));
            let structure = accel.summary();
            let stats = PictureStats::new(&facts, &view_phrase, times, world, structure, counted, profile.as_ref());
            so_far.pictures.push(stats);
            match cost_layers::write_maps(job, shot, effective.settings.width, &costs, accel_kind, messages) {
                Ok(()) => Exit::Done,
                Err(fault) => fail(&fault, Exit::Failed),
            }
        }
        Err(picture::WriteError::BrokenPipe) => Exit::Done,
        Err(picture::WriteError::Fault(fault)) => fail(&fault, Exit::Failed),
    };
    // The next view starts from the scene as it was loaded; it has been loaded already, too.
    loaded.scene.lights = lights;
    loaded.scene.environment = environment;
    loaded.scene.background = background;
    **load_seconds = 0.0;
    exit
}

/// Says what a picture would take.
fn foretell(job: &RenderJob, file: &Path, work: &Job, messages: &Messages, progress: &Progress) -> Exit {
    progress.begin("looking");
    let found = crate::render::forecast(work, progress);
    progress.finish();
    match found.map(|forecast| dry_run::say(file, work, &forecast, job.stats.as_ref().map(|stats| stats.format))) {
        Some(Ok(())) => Exit::Done,
        Some(Err(e)) => {
            messages.error("output-unwritable", format!("standard output: {e}"), "");
            Exit::Failed
        }
        None => Exit::Interrupted,
    }
}

fn trace(job: &RenderJob, work: &Job, progress: &Progress, times: &mut Times, profile: &mut Profile) -> Rendered {
    progress.begin("rendering");
    let _guard = job.keep_partial.then(interrupt::Guard::new);
    let start = Instant::now();
    let rendered = if job.profile {
        let (rendered, parts) = crate::render::render_profiled(work, progress);
        profile.rendered(&parts);
        rendered
    } else {
        crate::render::render(work, progress)
    };
    times.render = start.elapsed().as_secs_f64();
    rendered
}

/// What each pixel cost, in passes behind the picture's own; `None` when the user gave up.
fn costs(job: &RenderJob, work: &Job, progress: &Progress) -> Option<Costs> {
    let wanted = cost_layers::wanted(job);
    if wanted.is_empty() {
        return Some(Costs::default());
    }
    progress.begin("counting");
    render_costs(work, &wanted, progress)
}

fn keep_partial(shot: &Shot, rendered: &Rendered, effective: &Effective, loaded: &Loaded, messages: &Messages) -> Exit {
    let Some(path) = shot.target.path() else { return Exit::Interrupted };
    let path = output_name::partial(path);
    let partial = Shot { target: Target::Named(path.clone()), ..shot.clone() };
    // Without settings in it nobody will take it for a finished picture.
    let metadata = crate::image::Metadata::new();
    let bytes = picture::encoded(&partial, &rendered.picture, effective, loaded.scene.background, &metadata);
    match bytes.and_then(|bytes| picture::write(&partial, &bytes)) {
        Ok(()) => messages.info("partial", format!("interrupted; the tiles that were done are in {}", path.display())),
        Err(picture::WriteError::Fault(fault)) => messages.say(Severity::Error, &fault),
        Err(picture::WriteError::BrokenPipe) => {}
    }
    Exit::Interrupted
}
