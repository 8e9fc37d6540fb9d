//! `meshray render`: one batch after the other, continuing after failures; loads a scene, then renders all its pictures.

use super::exit::Exit;
use super::job::{Batch, RenderJob, Shot};
use super::message::{Messages, Severity};
use super::meter::Metered;
use super::outputs::{self, Target};
use super::picture::Effective;
use super::profile::Profile;
use super::progress::Progress;
use super::sequence::{Step, Survey};
use super::shot::{self, Stage, Task};
use super::stats::{self, PictureStats};
use super::writable::{self, Sources};
use super::{again, empty_picture, interrupt, parallel_inputs, read, surroundings, up_to_date};
use crate::huge_pages;
use crate::image::destination;
use crate::load::{Diagnostic, LoadError, LoadOptions, Loaded};
use crate::number::so_many;
use crate::render::{Moved, Sampling, World};
use crate::scene::Scene;
use crate::scene::framing::{Bounds, robust_bounds_within};
use crate::threads;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Runs the whole job; the exit code is that of its worst picture.
pub(super) fn run(job: &RenderJob, messages: &Messages) -> Exit {
    let pool = match threads::pool(job.threads) {
        Ok(pool) => pool,
        Err(e) => {
            messages.error("threads", format!("cannot start {} threads: {e}", job.threads), "ask for fewer");
            return Exit::Failed;
        }
    };
    huge_pages::allow(for_large_pages(job));
    let sources = Sources::of(job.batches.iter().flat_map(|b| &b.inputs));
    let mut run_state = RunState::new(sources);
    // A repeated picture may be replaced by its repetition, but by nothing else.
    let spared = |path| Sources::of(&job.again).spared_by(path, "--stats-file");
    if let Some(path) = job.stats_file() {
        let growth = outputs::grows_with(&job.batches, path).filter(|growth| !growth.is_dir());
        let checked = writable::check_in(path, "--stats-file", growth, &run_state.sources);
        if let Err(fault) = checked.and_then(|()| spared(path)) {
            return messages.fail(&fault, Exit::Failed);
        }
    }
    let parallel_inputs::RunOutcome { worst, failed } = parallel_inputs::run(job, &pool, messages, &mut run_state);
    if interrupt::raised() {
        return Exit::Interrupted;
    }
    if job.batches.len() > 1 {
        let (pictures, scenes) = (run_state.pictures.len() as u64, job.batches.len());
        let failed = if failed == 0 { String::new() } else { format!(", {failed} of them failed") };
        let pictures = so_many(pictures, "picture");
        let fresh = if job.update { format!(", {} up to date", run_state.up_to_date) } else { String::new() };
        let warnings = so_many(u64::from(messages.warnings()), "warning");
        messages.info("batch", format!("{pictures} of {scenes} inputs{fresh}{failed}, {warnings}"));
    }
    match &job.batches[..] {
        [only] if run_state.up_to_date == 1 && only.shots.len() == 1 => {
            let picture = only.shots[0].target.path().unwrap_or(Path::new("-"));
            messages.say(Severity::Info, &Diagnostic::new("up-to-date", picture, "", "is up to date"));
        }
        [_] if run_state.up_to_date > 0 => {
            messages.info("up-to-date", format!("{} are up to date", so_many(run_state.up_to_date, "picture")));
        }
        _ => {}
    }
    worst.max(report(job, &run_state, messages))
}

/// State of a run: what has been read and rendered so far.
pub(super) struct RunState {
    /// Whether a frame of the current sequence shows something.
    pub shown: bool,
    /// Missing folders that have been reported.
    pub missing: HashSet<PathBuf>,
    /// Files and views whose empty pictures have been reported.
    pub warned_empty: HashSet<(PathBuf, String)>,
    /// All inputs, and the files used by those loaded so far.
    pub sources: Sources,
    /// Number of pictures skipped as up to date.
    pub up_to_date: u64,
    /// Statistics of each picture.
    pub pictures: Vec<PictureStats>,
    /// Forecast of each picture, if forecasts go to a file.
    pub foretold: Vec<String>,
}

impl RunState {
    /// Initial state.
    fn new(sources: Sources) -> Self {
        Self {
            shown: false,
            missing: HashSet::new(),
            warned_empty: HashSet::new(),
            sources,
            up_to_date: 0,
            pictures: Vec::new(),
            foretold: Vec::new(),
        }
    }

    /// State of one input that is rendered in parallel with others.
    pub(super) fn of_one(&self) -> Self {
        Self::new(self.sources.clone())
    }

    /// Merges the state of an input that was rendered in parallel with others.
    pub(super) fn add(&mut self, one: Self) {
        self.up_to_date += one.up_to_date;
        self.pictures.extend(one.pictures);
        self.foretold.extend(one.foretold);
        self.warned_empty.extend(one.warned_empty);
    }
}

/// Time that costly huge pages may take: about a hundredth of the estimated time of the pictures.
fn for_large_pages(job: &RenderJob) -> Duration {
    /// Nanoseconds per sample; a sample itself takes some hundreds.
    const OF_SAMPLE: u64 = 3;
    /// Estimated samples per pixel with stochastic sampling; most pixels need fewer.
    const SAMPLES: u32 = 8;
    let Ok(Effective { settings, .. }) = Effective::new(&job.look, &Scene::default()) else {
        return Duration::MAX;
    };
    let samples = match settings.sampling {
        Sampling::Stochastic(how) => how.min_samples.max(SAMPLES),
        Sampling::Adaptive(_) | Sampling::Uniform => settings.samples,
    };
    let pictures = job.batches.iter().map(|batch| batch.shots.len() as u64).sum::<u64>();
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    Duration::from_nanos([pictures, u64::from(samples), OF_SAMPLE].into_iter().fold(pixels, u64::saturating_mul))
}

/// Prints or writes the statistics, if any, but never over a file that a model was read from.
fn report(job: &RenderJob, run_state: &RunState, messages: &Messages) -> Exit {
    let text = if job.dry_run { run_state.foretold.concat() } else { stats::text(job, &run_state.pictures) };
    if text.is_empty() {
        return Exit::Done;
    }
    match job.stats_file().map_or(Ok(()), |path| run_state.sources.spared_by(path, "--stats-file")) {
        Ok(()) => stats::report(job, &text, messages),
        // The conflict was reported when that model was loaded.
        Err(_) => Exit::Failed,
    }
}

/// Pictures of a scene whose targets may be written, and the exit caused by the others.
pub(super) fn writable_shots<'a>(
    job: &RenderJob,
    batch: &'a Batch,
    messages: &Messages,
    run_state: &mut RunState,
) -> (Vec<&'a Shot>, Exit) {
    let mut worst = Exit::Done;
    let mut shots = Vec::new();
    for shot in &batch.shots {
        // A forecast writes no picture, so standard output may be a terminal.
        let goes = |target: &Target| !job.dry_run || target.path().is_some();
        let mut targets = outputs::of(shot, job.beside()).into_iter().filter(goes);
        let growth = shot.growth.as_deref();
        match targets.try_for_each(|target| writable::check_target(&target, growth, &run_state.sources)) {
            Ok(()) => shots.push(shot),
            Err(fault) => {
                // A missing folder is reported for only one of its pictures.
                let goal = destination(&fault.file);
                let folder = goal.parent().filter(|_| fault.code == writable::NO_FOLDER);
                if folder.is_none_or(|folder| run_state.missing.insert(folder.to_path_buf())) {
                    messages.say(Severity::Error, &fault);
                }
                worst = Exit::Failed;
            }
        }
    }
    (shots, worst)
}

/// Renders the given pictures of one scene, except those up to date.
pub(super) fn render_batch(
    job: &RenderJob,
    batch: &Batch,
    shots: &[&Shot],
    messages: &Messages,
    run_state: &mut RunState,
) -> Exit {
    let mut old = shots.to_vec();
    if job.update {
        old.retain(|shot| match up_to_date::up_to_date(job, batch, shot) {
            None => true,
            Some(files) => {
                // Other pictures must not replace the files of skipped ones, either.
                run_state.sources.add(files);
                run_state.up_to_date += 1;
                false
            }
        });
    }
    if old.is_empty() {
        return Exit::Done;
    }
    // Only the file name: the bar needs the room that its folders would take.
    let name = batch.inputs[0].file_name().unwrap_or(batch.inputs[0].as_os_str()).to_string_lossy();
    let progress = Progress::new(&name, messages, job.quiet || messages.are_kept(), job.keep_partial);
    let task = Task { job, batch, messages, progress: &progress };
    render_shots(&task, &old, run_state).unwrap_or_else(|exit| exit)
}

/// Renders the pictures of one scene; an error is the exit when not all of them could be tried.
fn render_shots(task: &Task, shots: &[&Shot], run_state: &mut RunState) -> Result<Exit, Exit> {
    let Task { job, batch, messages, progress } = *task;
    let mut profile = if run_state.pictures.is_empty() { Profile::of_process() } else { Profile::new() };
    let aspect = |scene: &Scene| Effective::new(&job.look, scene).map_or(1.0, |effective| effective.aspect());
    let survey = Survey::of(job, batch, aspect, messages, progress)?;
    survey.iter().for_each(|_| profile.done("frame"));
    run_state.shown = false;
    let up_to_date = run_state.up_to_date;
    let mut earlier = beginning(task, shots, survey.as_ref(), &mut profile)?;
    let (mut worst, mut left) = (Exit::Done, shots);
    while let Some(first) = left.first() {
        // Pictures of the same moment share one scene.
        let same = left.iter().take_while(|shot| shot.step.moment == first.step.moment).count();
        let (now, later) = left.split_at(same);
        left = later;
        let mut ready =
            prepare(task, &first.step, survey.as_ref(), earlier.take(), profile).map_err(|exit| worst.max(exit))?;
        run_state.sources.add(&ready.loaded.facts.files);
        if let Some(path) = job.stats_file() {
            let spared = run_state.sources.spared_by(path, "--stats-file");
            spared.map_err(|fault| worst.max(task.fail(&fault, Exit::Failed)))?;
        }
        let mut stage = ready.stage(survey.as_ref());
        for shot in now {
            if job.update && up_to_date::is_as_loaded(job, batch, shot, stage.loaded) {
                run_state.up_to_date += 1;
                continue;
            }
            worst = worst.max(shot::render(task, shot, &mut stage, run_state).unwrap_or_else(|exit| exit));
            if interrupt::raised() {
                return Err(Exit::Interrupted);
            }
        }
        drop(stage);
        (earlier, profile) = (Some(ready), Profile::new());
    }
    let all = shots.len() == batch.shots.len() && run_state.up_to_date == up_to_date;
    if survey.is_some() && all && !run_state.shown && !job.dry_run && worst == Exit::Done {
        messages.say(Severity::Warning, &empty_picture::sequence(shots.len(), task.file()));
        if job.strict {
            let text = "--strict, and there is a warning; the pictures were written before it was known";
            return Ok(task.fail(&Diagnostic::new("strict", task.file(), "", text), Exit::Input));
        }
    }
    Ok(worst)
}

/// Scene at the moment of an animation that determines the exposure of all its pictures, with its views metered: the first moment
/// that shows something lit, among all frames, even those not rendered. `None` if nothing is metered.
fn beginning(
    task: &Task,
    shots: &[&Shot],
    survey: Option<&Survey>,
    profile: &mut Profile,
) -> Result<Option<Ready>, Exit> {
    let mut earlier = None;
    if !survey.is_some_and(|survey| survey.photometric) || task.job.look.exposure.is_some() {
        return Ok(earlier);
    }
    for step in task.job.frames() {
        let mut ready = prepare(task, &step, survey, earlier.take(), profile.take())?;
        let mut stage = ready.stage(survey);
        let mut lit = true;
        for shot in shots {
            lit &= stage.meter(task, &Shot { step: step.clone(), ..(*shot).clone() })?;
        }
        drop(stage);
        *profile = ready.profile.take();
        earlier = Some(ready);
        if lit {
            break;
        }
        if interrupt::raised() {
            return Err(Exit::Interrupted);
        }
    }
    Ok(earlier)
}

/// A loaded scene, ready to be rendered.
struct Ready {
    loaded: Loaded,
    world: World,
    bounds: Bounds,
    load_seconds: f64,
    /// Stages that no picture has reported yet.
    profile: Profile,
    metered: Metered,
    /// Warnings that have been reported.
    told: HashSet<Kind>,
}

impl Ready {
    /// Stage without a structure. Frames of a sequence are seen in the bounds of all frames.
    fn stage<'a>(&'a mut self, survey: Option<&'a Survey>) -> Stage<'a> {
        let Self { loaded, world, bounds, load_seconds, profile, metered, .. } = self;
        let bounds = survey.map_or(&*bounds, |survey| &survey.bounds);
        Stage { loaded, world, bounds, load_seconds, profile, survey, built: None, metered }
    }
}

/// Identity of a warning apart from its numbers: code, file, place and words.
type Kind = (&'static str, PathBuf, String, String);

fn kind_of(warning: &Diagnostic) -> Kind {
    let words = warning.text.chars().filter(|c| !c.is_ascii_digit()).collect();
    (warning.code, warning.file.clone(), warning.place.clone(), words)
}

/// Loads the inputs of a picture in the memory left by the `--env` panorama; if that is too little, without the panorama.
fn load(job: &RenderJob, batch: &Batch, options: LoadOptions) -> Result<Loaded, LoadError> {
    let (env, limits) = (&job.look.env_read, options.limits);
    let kept = env.kept();
    match read::scene(&batch.inputs, &LoadOptions { limits: read::limits_beside(&limits, kept), ..options.clone() }) {
        Err(error) if kept > 0 && Exit::from(&error) == Exit::Failed => {
            env.forget();
            read::scene(&batch.inputs, &options)
        }
        loaded => loaded,
    }
}

/// Loads a scene for a picture, and refuses what cannot or must not be drawn. A frame of a sequence may be empty.
fn prepare(
    task: &Task,
    step: &Step,
    survey: Option<&Survey>,
    earlier: Option<Ready>,
    mut profile: Profile,
) -> Result<Ready, Exit> {
    let Task { job, batch, messages, progress } = *task;
    let start = Instant::now();
    progress.stage("loading");
    let options = survey.map_or_else(|| job.load_for(step), |survey| survey.load_for(job, step));
    // Image data is taken from an earlier frame, unless materials change over time.
    let has_pictures = earlier.as_ref().is_some_and(|earlier| !earlier.loaded.facts.changes_materials);
    let options = LoadOptions { without_pictures: has_pictures, ..options };
    let mut loaded = load(job, batch, options).map_err(|error| messages.load_error(&error))?;
    let (mut told, mut metered, mut load_seconds) = (HashSet::new(), Metered::default(), 0.0);
    let is_later = earlier.is_some();
    let mut with_pictures = None;
    if let Some(earlier) = earlier {
        (told, metered, load_seconds) = (earlier.told, earlier.metered, earlier.load_seconds);
        with_pictures = has_pictures.then_some(earlier.loaded);
    }
    if let Some(earlier) = with_pictures {
        if !read::take_pictures(&mut loaded, earlier) {
            let fault = Diagnostic::new("input-changed", &batch.inputs[0], "", "was changed while it was rendered");
            return Err(task.fail(&fault.remedy("render it again"), Exit::Failed));
        }
    } else {
        surroundings::place(&job.look, &job.load.limits, &mut loaded).map_err(|error| messages.load_error(&error))?;
    }
    profile.loaded(loaded.facts.reading, loaded.facts.decoding);
    // Faults of one frame mostly recur in others, with other numbers.
    let mut warn = |warnings: &[Diagnostic]| {
        for warning in warnings {
            if told.insert(kind_of(warning)) || !is_later {
                messages.say(Severity::Warning, warning);
            }
        }
        match warnings.len() {
            count if job.strict && count > 0 => Err(task.fail(&read::not_strict(count, task.file()), Exit::Input)),
            _ => Ok(()),
        }
    };
    warn(&loaded.warnings)?;
    if let Some(expected) = &job.expected_hash {
        again::check_hash(expected, &loaded, &batch.inputs, &job.look)
            .map_err(|fault| task.fail(&fault, Exit::Input))?;
    }
    let world = read::as_drawn(&loaded, job.instances, job.load.limits.memory, &batch.inputs[0])
        .map_err(|fault| task.fail(&fault, Exit::Failed))?;
    let world = if job.no_prune { world.without_pruning() } else { world };
    if world.is_empty() && !job.allow_empty && survey.is_none() {
        return Err(task.fail(&nothing_to_draw(&loaded, &batch.inputs[0]), Exit::Input));
    }
    warn(coarse(&loaded, &world, &batch.inputs[0]).as_slice())?;
    profile.done("place");
    let bounds = robust_bounds_within(&loaded.scene, world.bounds);
    profile.done("frame");
    load_seconds += start.elapsed().as_secs_f64();
    Ok(Ready { loaded, world, bounds, load_seconds, profile, metered, told })
}

/// Warning about an object too far from the middle of the scene to be drawn accurately.
fn coarse(loaded: &Loaded, world: &World, file: &Path) -> Option<Diagnostic> {
    /// Tolerated error of an object's corners, relative to its size.
    const MOST: f64 = 0.01;
    let (which, part) = world.coarsest(&loaded.scene, MOST)?;
    let scene = &loaded.scene;
    let (kind, number, name) = match which {
        Moved::Instance(i) => ("object", i, &scene.instances[i].name),
        Moved::Sphere(i) => ("sphere", i, &scene.spheres[i].name),
        Moved::Cone(i) => ("cone", i, &scene.cones[i].name),
    };
    let name = if name.is_empty() { format!("{kind} {number}") } else { format!("'{name}'") };
    let text = format!(
        "{name} stands so far from the middle of the scene that rounding moves it by up to {part:.3} of its size"
    );
    Some(Diagnostic::new("rounding", file, "", text).remedy("render parts that are far from each other by themselves"))
}

fn nothing_to_draw(loaded: &Loaded, file: &Path) -> Diagnostic {
    let held = match loaded.facts.dropped.iter().map(|(_, n)| n).sum::<u64>() {
        0 if !loaded.warnings.is_empty() => "nothing to draw: warnings say what of it is left out".to_owned(),
        0 => "nothing to draw: it holds no faces, lines or points, or only such as are hidden or scaled to nothing"
            .to_owned(),
        n => format!("nothing to draw: all of its {n} faces, lines, points and shapes had to be dropped"),
    };
    let draw_nothing = "--allow-empty draws the background";
    let remedy = match loaded.facts.scenes.len() {
        0 | 1 => draw_nothing.to_owned(),
        scenes => format!(
            "it has {scenes} scenes, of which this is number {}: choose another with --scene; {draw_nothing}",
            loaded.facts.scene_index
        ),
    };
    Diagnostic::new("nothing-to-draw", file, "", held).remedy(remedy)
}
