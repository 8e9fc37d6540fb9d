//! Renders one picture of a loaded scene: camera, lights, exposure, pixels, file.

use super::exit::Exit;
use super::job::{Batch, RenderJob, Shot};
use super::message::{Messages, Severity};
use super::meter::{self, Metered};
use super::outputs;
use super::picture::{self, Effective, PictureData};
use super::profile::Profile;
use super::progress::Progress;
use super::render::RunState;
use super::sequence::{self, Survey};
use super::stats::{self, Counted, PictureStats, Times};
use super::summary::Summary;
use super::{again, cost_layers, dry_run, empty_picture, interrupt, read, surroundings};
use crate::accel::AnyAccel;
use crate::accel::auto::Reason;
use crate::image::{ExrSamples, FileKind, LARGEST_HALF, Picture, beyond_half};
use crate::load::{Diagnostic, Loaded};
use crate::render::texture::TextureStore;
use crate::render::{Costs, Job, Rendered, Settings, View, World, render_costs};
use crate::scene::default_light::DefaultLight;
use crate::scene::framing::Bounds;
use crate::scene::{Background, Camera, Scene};
use std::path::Path;
use std::time::Instant;

/// A batch to render, with the sinks of its messages and progress.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub job: &'a RenderJob,
    pub batch: &'a Batch,
    pub messages: &'a Messages,
    pub progress: &'a Progress<'a>,
}

impl Task<'_> {
    /// First input, after which the batch is named.
    pub(super) fn file(&self) -> &Path {
        &self.batch.inputs[0]
    }

    /// Reports a fault.
    pub(super) fn fail(&self, fault: &Diagnostic, exit: Exit) -> Exit {
        self.messages.fail(fault, exit)
    }
}

/// Scene to be rendered, with the structure that all its pictures share.
pub(super) struct Stage<'a> {
    pub loaded: &'a mut Loaded,
    pub world: &'a World,
    pub bounds: &'a Bounds,
    /// Seconds of loading that no picture has reported yet.
    pub load_seconds: &'a mut f64,
    pub profile: &'a mut Profile,
    pub survey: Option<&'a Survey>,
    pub built: Option<(AnyAccel<'a>, Option<Reason>)>,
    pub metered: &'a mut Metered,
}

impl Stage<'_> {
    fn camera(&self, task: &Task, shot: &Shot, effective: &Effective) -> Result<(Camera, String), Exit> {
        let (scene, aspect) = (&self.loaded.scene, effective.aspect());
        let found = sequence::camera(task.job, shot, self.survey, scene, self.bounds, aspect, task.file());
        found.map_err(|fault| task.fail(&fault, Exit::Input))
    }

    /// Meters a view through the camera of this picture, unless its exposure is known or not needed. Returns whether the exposure
    /// is settled: false if nothing is lit.
    pub(super) fn meter(&mut self, task: &Task, shot: &Shot) -> Result<bool, Exit> {
        let effective = effective(task, &self.loaded.scene)?;
        if !is_metered(&effective, shot, &self.loaded.scene) || self.metered.get(&shot.choice).is_some() {
            return Ok(true);
        }
        let (camera, _) = self.camera(task, shot, &effective)?;
        let view = View::from_camera(&camera);
        let Self { loaded, world, built, metered, profile, .. } = self;
        task.progress.stage("metering");
        let stops = metered.get_or_find(&shot.choice, || {
            let (accel, _) = &*built.get_or_insert_with(|| structure(task, shot, world, &effective.settings));
            surroundings::lit(&task.job.look, loaded, &camera, |loaded, _| {
                let (scene, textures) = (&loaded.scene, textures(task.job, &loaded.scene));
                let settings = &effective.settings;
                meter::exposure(&Job { scene, world, accel, textures: &textures, view: &view, settings })
            })
        });
        profile.done("meter");
        Ok(stops.is_some())
    }
}

/// Builds the structure over a scene, and returns the reason for its choice; for all pictures of this one's moment.
fn structure<'w>(task: &Task, shot: &Shot, world: &'w World, settings: &Settings) -> (AnyAccel<'w>, Option<Reason>) {
    let pictures = task.batch.shots.iter().filter(|other| other.step.moment == shot.step.moment).count();
    let eye_rays = settings.fewest_eye_rays().saturating_mul(pictures as u64);
    let (accel, reason) = world.structure_for(eye_rays, task.job.accel, &task.job.params);
    (accel.tested_by(task.job.intersector), reason)
}

fn textures<'s>(job: &RenderJob, scene: &'s Scene) -> TextureStore<'s> {
    let textures = TextureStore::new(scene);
    if job.no_prune { textures.without_pruning() } else { textures }
}

/// Effective settings of the pictures of a scene.
fn effective(task: &Task, scene: &Scene) -> Result<Effective, Exit> {
    match Effective::new(&task.job.look, scene) {
        Ok(effective) => Ok(effective.without_pruning(task.job.no_prune)),
        Err(text) => Err(task.fail(&Diagnostic::new("scene-value", task.file(), "", text), Exit::Input)),
    }
}

/// Whether the exposure of a picture is metered.
fn is_metered(effective: &Effective, shot: &Shot, scene: &Scene) -> bool {
    effective.metered && shot.kind != FileKind::Exr && meter::is_due(scene)
}

/// Additional data gathered for each picture.
fn picture_data(job: &RenderJob) -> PictureData {
    PictureData { costs: cost_layers::wanted(job).len(), counted: job.stats.is_some() }
}

/// Checks that a picture fits into the allowed memory and into its file type, and may still be written.
fn check(task: &Task, shot: &Shot, effective: &Effective, run_state: &RunState) -> Result<(), Exit> {
    let Task { job, .. } = *task;
    let mut targets = outputs::of(shot, job.beside()).into_iter();
    targets
        .try_for_each(|target| run_state.sources.spared_by_target(&target))
        .map_err(|fault| task.fail(&fault, Exit::Failed))?;
    if let Some(fault) = picture::too_large(effective, shot.kind, picture_data(job), job.load.limits.memory) {
        return Err(task.fail(&fault, Exit::Failed));
    }
    let Settings { width, height, .. } = effective.settings;
    shot.kind.fits(width, height).map_err(|error| {
        task.fail(&Diagnostic::new("picture-too-large", task.file(), "", error.to_string()), Exit::Failed)
    })
}

/// Renders and writes a picture, or forecasts it. An error is an exit, too, and has been reported.
pub(super) fn render(task: &Task, shot: &Shot, stage: &mut Stage, run_state: &mut RunState) -> Result<Exit, Exit> {
    let Task { job, progress, .. } = *task;
    let mut effective = effective(task, &stage.loaded.scene)?;
    check(task, shot, &effective, run_state)?;

    // Camera first, then its lights: each view has its own.
    let (camera, phrase) = stage.camera(task, shot, &effective)?;
    let view = View::from_camera(&camera);
    let middle = (stage.bounds.lo + stage.bounds.hi) * 0.5;
    let lens = job.look.sampling.lens(&view, middle, task.file());
    effective.settings.lens = lens.map_err(|fault| task.fail(&fault, Exit::Input))?;
    stage.profile.done("frame");

    let mut times = Times { load: std::mem::take(stage.load_seconds), ..Times::default() };
    progress.stage("building");
    let start = Instant::now();
    stage.built.get_or_insert_with(|| structure(task, shot, stage.world, &effective.settings));
    times.build = start.elapsed().as_secs_f64();
    stage.profile.done("build");
    let first = job.first_step(&shot.step);
    if first != shot.step && first.moment == shot.step.moment {
        stage.meter(task, &Shot { step: first, ..shot.clone() })?;
    }

    let Stage { loaded, world, bounds, profile, survey, built, metered, .. } = stage;
    let is_frame = survey.is_some();
    let (accel, reason) = &*built.get_or_insert_with(|| structure(task, shot, world, &effective.settings));
    Ok(surroundings::lit(&job.look, loaded, &camera, |loaded, light| {
        let (scene, textures) = (&loaded.scene, textures(job, &loaded.scene));
        let work = Job { scene, world, accel, textures: &textures, view: &view, settings: &effective.settings };
        if is_metered(&effective, shot, scene) {
            progress.stage("metering");
            let stops = metered.get_or_find(&shot.choice, || meter::exposure(&work));
            effective.output.exposure = stops.unwrap_or_default();
            profile.done("meter");
        }
        times.meter = metered.take_seconds();
        effective.written_as(&job.look, scene, shot.kind);
        if let Some(narrowest) = loaded.facts.wires.narrowest() {
            effective.of_wires(&job.look, narrowest, 2.0 * bounds.radius());
        }
        let work = Job { settings: &effective.settings, scene, world, accel, textures: &textures, view: &view };
        let (effective, reason, phrase) = (&effective, *reason, phrase.as_str());
        let prepared = Prepared { task, shot, effective, loaded, bounds, work, reason, phrase, light, is_frame };
        if prepared.warn(run_state) && job.strict {
            return prepared.refuse_warned();
        }
        if job.dry_run { prepared.foretell(run_state) } else { prepared.draw(times, profile, run_state) }
    }))
}

/// A picture with everything but its pixels.
struct Prepared<'a> {
    task: &'a Task<'a>,
    shot: &'a Shot,
    effective: &'a Effective,
    loaded: &'a Loaded,
    bounds: &'a Bounds,
    work: Job<'a>,
    /// Reason for the structure, if it was chosen by counts.
    reason: Option<Reason>,
    /// Description of the view.
    phrase: &'a str,
    light: DefaultLight,
    /// Whether the picture is one of several frames, some of which may show nothing.
    is_frame: bool,
}

impl Prepared<'_> {
    /// Prints the forecast of the picture, or keeps it for the statistics file.
    fn foretell(&self, run_state: &mut RunState) -> Exit {
        let Task { job, messages, progress, .. } = *self.task;
        progress.begin("looking");
        let found = crate::render::forecast(&self.work, progress);
        progress.finish();
        let Some(forecast) = found else { return Exit::Interrupted };
        let picture = picture::bytes(self.effective, self.shot.kind, picture_data(job))
            + picture::bytes_of_rays(self.work.settings, forecast.rays.value);
        let format = job.stats.as_ref().map(|stats| stats.format);
        let which = dry_run::PictureId { file: self.task.file(), view: self.phrase, target: &self.shot.target };
        let told = dry_run::formatted(which, &self.work, &forecast, picture, format);
        if job.stats_file().is_some() {
            run_state.foretold.push(told);
            return Exit::Done;
        }
        messages.print(&told).err().unwrap_or_default()
    }

    /// Renders and writes the picture, reports it, and stores its statistics.
    fn draw(&self, mut times: Times, profile: &mut Profile, run_state: &mut RunState) -> Exit {
        let Task { job, messages, progress, batch } = *self.task;
        let Self { shot, effective, loaded, work, .. } = self;
        profile.skip();
        // Until the picture is written, the first signal only stops its rays.
        let _guard = job.keep_partial.then(interrupt::Guard::new);
        let mut rendered = self.trace(&mut times, profile);
        let costs = rendered.complete.then(|| self.costs(&rendered));
        progress.finish();
        let Some((costs, counted)) = costs.flatten() else { return self.keep_partial(&rendered) };
        if let Some(layers) = &mut rendered.picture.layers {
            cost_layers::add_channels(job, &costs, layers);
        }

        let clipped = self.clipped(&rendered.picture);
        if let Some(warning) = clipped.as_ref().filter(|_| job.strict) {
            messages.say(Severity::Warning, warning);
            return self.refuse_warned();
        }

        let (depth, accel) = (rendered.depth, work.accel.kind());
        let (sampled, reason) = (&rendered.sampled, self.reason);
        let making = again::Making { job, batch, shot, effective, sampled, depth, accel, reason, loaded };
        let metadata = again::metadata(&making, counted.as_ref());
        profile.skip();
        let start = Instant::now();
        let bytes = picture::encoded(shot, &rendered.picture, effective, work.scene.background, &metadata);
        profile.done("encode");
        let written = bytes.and_then(|bytes| picture::write(shot, &bytes));
        profile.done("write");
        times.write = start.elapsed().as_secs_f64();
        match written {
            Ok(()) => {}
            Err(picture::WriteError::BrokenPipe) => return Exit::Done,
            Err(picture::WriteError::Fault(fault)) => return self.task.fail(&fault, Exit::Failed),
        }
        let summary = Summary { shot, effective, loaded, bounds: self.bounds, view: self.phrase, light: self.light };
        summary.say(&rendered, &times, messages);
        clipped.iter().for_each(|warning| messages.say(Severity::Warning, warning));
        let profile = job.profile.then(|| profile.take());
        profile.iter().for_each(|p| p.say(messages));
        run_state.pictures.push(self.stats(&making, times, counted, profile.as_ref()));
        match cost_layers::write_maps(job, shot, &effective.settings, &costs, accel, messages) {
            Ok(()) => self.judge(counted.as_ref()),
            Err(fault) => self.task.fail(&fault, Exit::Failed),
        }
    }

    /// Warns if a picture shows nothing, or not what was requested; returns whether it did.
    fn warn(&self, run_state: &mut RunState) -> bool {
        let Task { job, messages, .. } = *self.task;
        let Self { shot, work, .. } = self;
        run_state.shown = run_state.shown || self.is_frame && empty_picture::shows_something(work);
        let warned_empty = match self.is_frame {
            true => None,
            false => empty_picture::warning(work, &shot.choice, self.phrase, job.look.lens, self.task.file()),
        };
        // The warning would be the same for all pictures of a turntable.
        if let Some(warning) = &warned_empty
            && run_state.warned_empty.insert((self.task.file().to_owned(), shot.choice.name()))
        {
            messages.say(Severity::Warning, warning);
        }
        let is_lost = shot.kind == FileKind::Jpeg && work.scene.background == Some(Background::Transparent);
        if is_lost && !(job.strict && warned_empty.is_some()) {
            let text = "JPEG has no transparency: what is transparent is white";
            let warning = Diagnostic::new("jpeg-opaque", shot.target.path().unwrap_or(Path::new("-")), "", text);
            messages.say(Severity::Warning, &warning.remedy("write PNG or WebP"));
        }
        is_lost || warned_empty.is_some()
    }

    /// Reports that there is no picture, because there was a warning and warnings are errors.
    fn refuse_warned(&self) -> Exit {
        self.task.fail(&read::not_strict(1, self.task.file()), Exit::Input)
    }

    /// Warning about pixels that are brighter than the file can hold.
    fn clipped(&self, picture: &Picture) -> Option<Diagnostic> {
        let is_half = self.shot.kind == FileKind::Exr && self.effective.output.exr_samples == ExrSamples::Half;
        let count = if is_half { beyond_half(picture) } else { 0 };
        (count > 0).then(|| {
            let pixels = if count == 1 { "1 pixel is".into() } else { format!("{count} pixels are") };
            let text =
                format!("{pixels} brighter than the {} that half floats hold, and written as that", LARGEST_HALF);
            let file = self.shot.target.path().unwrap_or(Path::new("-"));
            Diagnostic::new("exr-clipped", file, "", text).remedy("--float keeps them")
        })
    }

    /// Reports an error if the counted rendering has other pixels than the timed one.
    fn judge(&self, counted: Option<&Counted>) -> Exit {
        if counted.is_none_or(|counted| counted.same) {
            return Exit::Done;
        }
        let accel = self.work.accel.kind();
        let text = format!("the counted run with {accel} gave other pixels than the timed one");
        self.task.messages.error("counts-differ", text, "please report it with the model");
        Exit::Failed
    }

    fn trace(&self, times: &mut Times, profile: &mut Profile) -> Rendered {
        let Task { job, progress, .. } = *self.task;
        progress.begin("rendering");
        let start = Instant::now();
        let rendered = if job.profile {
            let (rendered, parts) = crate::render::render_profiled(&self.work, progress);
            profile.rendered(&parts);
            rendered
        } else {
            crate::render::render(&self.work, progress)
        };
        times.render = start.elapsed().as_secs_f64();
        rendered
    }

    /// Renders the picture again to gather the costs of each pixel and the counts for statistics; `None` when the user
    /// interrupts.
    fn costs(&self, rendered: &Rendered) -> Option<(Costs, Option<Counted>)> {
        let Task { job, progress, .. } = *self.task;
        let (mut costs, wanted) = (Costs::default(), cost_layers::wanted(job));
        if !wanted.is_empty() {
            progress.begin("counting");
            costs = render_costs(&self.work, &wanted, progress)?;
        }
        if job.stats.is_none() {
            return Some((costs, None));
        }
        progress.begin("counting");
        Some((costs, Some(stats::count(&self.work, rendered, progress)?)))
    }

    fn stats(
        &self,
        making: &again::Making,
        times: Times,
        counted: Option<Counted>,
        profile: Option<&Profile>,
    ) -> PictureStats {
        let Job { world, accel, .. } = self.work;
        PictureStats::new(making, self.phrase, times, world, accel.summary(), counted, profile)
    }

    fn keep_partial(&self, rendered: &Rendered) -> Exit {
        let Task { messages, .. } = *self.task;
        let Some(target) = outputs::partial(&self.shot.target) else { return Exit::Interrupted };
        let partial = Shot { target, ..self.shot.clone() };
        // Without settings, the file cannot pass for a finished picture.
        let metadata = crate::image::Metadata::new();
        let background = self.work.scene.background;
        let bytes = picture::encoded(&partial, &rendered.picture, self.effective, background, &metadata);
        match bytes.and_then(|bytes| picture::write(&partial, &bytes)) {
            Ok(()) => {
                let path = partial.target.path().unwrap_or(Path::new("-"));
                let what = if rendered.complete { "the picture is" } else { "the tiles that were done are" };
                let fault = Diagnostic::new("interrupted", path, "", format!("interrupted; {what} kept here"));
                messages.say(Severity::Error, &fault);
            }
            Err(picture::WriteError::Fault(fault)) => messages.say(Severity::Error, &fault),
            Err(picture::WriteError::BrokenPipe) => {}
        }
        Exit::Interrupted
    }
}
