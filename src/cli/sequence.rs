//! Sequences of pictures: frames of an animation, and turntables around a model.
//!
//! All pictures of a sequence share one camera, which covers all frames, or the model from all around.

use super::args::RenderArgs;
use super::camera::{self, Choice, Shown};
use super::exit::Exit;
use super::job::{Batch, RenderJob, Shot, UsageError};
use super::message::{Messages, Severity};
use super::parse::{Frames, Turns};
use super::progress::Progress;
use super::{interrupt, moment, read};
use crate::load::{Diagnostic, LoadOptions, Loaded, Moment, WireFacts, scene_file};
use crate::render::World;
use crate::scene::framing::{Bounds, Fit, frame, frame_around, robust_bounds, turned};
use crate::scene::{Camera, Scene};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// A sequence of pictures of one scene.
#[derive(Clone, Debug)]
pub(super) enum Sequence {
    /// Moments of an animation.
    Frames {
        /// Frame numbers.
        frames: Frames,
        /// Frames per second.
        fps: f64,
        /// Animation, by name or index; `None`: the first.
        animation: Option<String>,
    },
    /// Views from all around the model.
    Turntable(Turns),
}

/// Position of a picture in a sequence.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Step {
    /// Number in the sequence; `None` for a single picture.
    pub number: Option<u32>,
    /// Moment of an animation; `None`: the rest pose.
    pub moment: Option<Moment>,
}

/// Requested sequence.
pub(super) fn of(args: &RenderArgs) -> Result<Option<Sequence>, UsageError> {
    let Some(frames) = args.frames else { return Ok(args.turntable.map(Sequence::Turntable)) };
    if let Some(frame) = args.load.moment.frame.filter(|frame| !(frames.first..frames.end).contains(frame)) {
        return Err(UsageError(format!("--frame {frame} is none of --frames {frames}")));
    }
    let is_stream = |input: &&PathBuf| {
        *input == Path::new("-") || std::fs::metadata(input).is_ok_and(|file| !file.is_file() && !file.is_dir())
    };
    if let Some(input) = args.inputs.iter().find(is_stream) {
        let name = if input == Path::new("-") { "standard input (`-`)".into() } else { input.display().to_string() };
        return Err(UsageError(format!("--frames reads the model for each frame, and {name} can be read only once")));
    }
    let animation = args.load.moment.animation.clone();
    Ok(Some(Sequence::Frames { frames, fps: moment::fps(&args.load.moment), animation }))
}

/// Steps of the pictures of each view, in order.
pub(super) fn steps(args: &RenderArgs, sequence: Option<&Sequence>) -> Result<Vec<Step>, UsageError> {
    Ok(match sequence {
        Some(whole @ Sequence::Frames { frames, .. }) => {
            let wanted = args.load.moment.frame.map_or(frames.first..frames.end, |only| only..only + 1);
            wanted.map(|frame| Step { number: Some(frame), moment: whole.moment(frame) }).collect()
        }
        Some(Sequence::Turntable(turns)) => {
            let moment = moment::moment(&args.load.moment)?;
            let wanted = turns.only.map_or(0..turns.count, |only| only..only + 1);
            wanted.map(|turn| Step { number: Some(turn), moment: moment.clone() }).collect()
        }
        None => vec![Step { number: None, moment: moment::moment(&args.load.moment)? }],
    })
}

impl Turns {
    /// Angle of a turntable picture, in radians.
    pub(super) fn angle(self, number: u32) -> f64 {
        TAU * f64::from(number) / f64::from(self.count)
    }
}

impl Sequence {
    /// Moment of a frame; `None` for a turntable, whose pictures share one moment.
    fn moment(&self, frame: u32) -> Option<Moment> {
        match self {
            Self::Frames { fps, animation, .. } => {
                Some(Moment { animation: animation.clone(), time: f64::from(frame) / fps })
            }
            Self::Turntable(_) => None,
        }
    }
}

impl RenderJob {
    /// First step of a picture's sequence; a single picture is its own.
    pub(super) fn first_step(&self, step: &Step) -> Step {
        match &self.sequence {
            Some(Sequence::Frames { .. }) => self.frames().next().unwrap_or_else(|| step.clone()),
            Some(Sequence::Turntable(_)) => Step { number: Some(0), ..step.clone() },
            None => step.clone(),
        }
    }

    /// All frames of an animation, including those not rendered.
    pub(super) fn frames(&self) -> impl Iterator<Item = Step> {
        let sequence = self.sequence.as_ref();
        let frames = sequence.and_then(|sequence| match sequence {
            Sequence::Frames { frames, .. } => Some(frames.first..frames.end),
            Sequence::Turntable(_) => None,
        });
        let moment = move |frame| sequence.and_then(|sequence| sequence.moment(frame));
        frames.into_iter().flatten().map(move |frame| Step { number: Some(frame), moment: moment(frame) })
    }

    /// Load options for a picture.
    pub(super) fn load_for(&self, step: &Step) -> LoadOptions {
        LoadOptions { moment: step.moment.clone(), ..self.load.clone() }
    }
}

/// Camera of one picture, and a phrase that describes it. `survey` is that of all frames, if there are several.
pub(super) fn camera(
    job: &RenderJob,
    shot: &Shot,
    survey: Option<&Survey>,
    scene: &Scene,
    bounds: &Bounds,
    aspect: f64,
    file: &Path,
) -> Result<(Camera, String), Diagnostic> {
    let turns = match &job.sequence {
        Some(Sequence::Turntable(turns)) => Some(*turns),
        _ => None,
    };
    let framing = || camera::framing(&shot.choice, job.look.lens, scene, bounds);
    let framed = match (survey, turns) {
        (Some(survey), _) => survey.camera(&shot.choice).cloned(),
        (None, Some(_)) => framing().map(|(direction, lens)| frame_around(scene, bounds, direction, lens, aspect)),
        (None, None) => framing().map(|(direction, lens)| frame(scene, bounds, direction, lens, aspect)),
    };
    let shown = Shown { choice: &shot.choice, lens: job.look.lens, aspect, file };
    let (camera, phrase) = shown.camera(scene, bounds, framed)?;
    let Some((turns, number)) = turns.zip(shot.step.number).filter(|(_, number)| *number > 0) else {
        return Ok((camera, phrase));
    };
    let pivot = match &shot.choice {
        Choice::Free { at: Some(at), .. } => *at,
        _ => bounds.center(),
    };
    let angle = turns.angle(number);
    let phrase = format!("{phrase}, {:.1}° around", angle.to_degrees());
    Ok((turned(&camera, scene.up, pivot, angle), phrase))
}

/// Reports the warnings of a scene and fails if there are any.
fn refuse_warnings(loaded: &Loaded, file: &Path, messages: &Messages) -> Result<(), Exit> {
    if loaded.warnings.is_empty() {
        return Ok(());
    }
    loaded.warnings.iter().for_each(|warning| messages.say(Severity::Warning, warning));
    Err(messages.fail(&read::not_strict(loaded.warnings.len(), file), Exit::Input))
}

/// Widths of points and lines in each frame.
#[derive(Default)]
struct Widths {
    points: Vec<f64>,
    lines: Vec<f64>,
}

impl Widths {
    fn add(&mut self, wires: &WireFacts) {
        self.points.push(wires.point_width);
        self.lines.push(wires.line_width);
    }

    /// Median widths: neither a frame with everything in one place nor one with a distant outlier decides.
    fn usual(mut self) -> Option<[f64; 2]> {
        let median = |all: &mut Vec<f64>| {
            all.retain(|&width| width > 0.0);
            all.sort_by(f64::total_cmp);
            all.get(all.len().saturating_sub(1) / 2).copied()
        };
        let (points, lines) = (median(&mut self.points), median(&mut self.lines));
        let any = points.or(lines)?;
        Some([points.unwrap_or(any), lines.unwrap_or(any)])
    }
}

/// Bounds and cameras of all frames of an animation, determined before the first is rendered.
pub(super) struct Survey {
    /// Bounds of all frames.
    pub bounds: Bounds,
    /// Whether some frame has photometric lamps.
    pub photometric: bool,
    /// Widths of points and lines in all frames.
    pub wire_widths: Option<[f64; 2]>,
    /// Camera of each choice that is framed on the model.
    cameras: Vec<(Choice, Option<Camera>)>,
}

impl Survey {
    /// Loads the geometry of every frame. The default view direction is that of the first frame that shows anything.
    ///
    /// `None` if the pictures of this job are framed one by one, or if no frame shows anything.
    pub(super) fn of(
        job: &RenderJob,
        batch: &Batch,
        aspect: impl Fn(&Scene) -> f64,
        messages: &Messages,
        progress: &Progress,
    ) -> Result<Option<Self>, Exit> {
        let Some(sequence @ Sequence::Frames { frames, .. }) = &job.sequence else { return Ok(None) };
        progress.stage("framing");
        let mut photometric = false;
        let mut widths = Widths::default();
        let mut is_scene_file = false;
        let mut bounds: Option<Bounds> = None;
        let mut fits: Vec<(Choice, Option<Fit>)> = Vec::new();
        for frame in frames.first..frames.end {
            if interrupt::raised() {
                return Err(Exit::Interrupted);
            }
            let moment = sequence.moment(frame);
            let options = LoadOptions { moment, without_pictures: true, ..job.load.clone() };
            let loaded = read::scene(&batch.inputs, &options).map_err(|error| messages.load_error(&error))?;
            if job.strict && batch.shots.iter().any(|shot| shot.step.number == Some(frame)) {
                refuse_warnings(&loaded, &batch.inputs[0], messages)?;
            }
            if loaded.facts.animations.is_empty() {
                let fault = Diagnostic::new("animation-none", &batch.inputs[0], "", "the file has no animation");
                return Err(messages.fail(&fault.remedy("--turntable shows it from all around"), Exit::Input));
            }
            is_scene_file |= loaded.facts.format == scene_file::FORMAT;
            let scene = &loaded.scene;
            photometric |= scene.photometric;
            widths.add(&loaded.facts.wires);
            // Animations hide objects by a scale of zero.
            if World::flattened_bytes(scene) == 0 {
                continue;
            }
            let here = robust_bounds(scene);
            if bounds.is_none() {
                let first = &batch.shots[0].step;
                let choices = batch.shots.iter().take_while(|shot| shot.step == *first).map(|shot| &shot.choice);
                let fit = |choice: &Choice| {
                    let framing = camera::framing(choice, job.look.lens, scene, &here);
                    let fit = framing.map(|(direction, lens)| Fit::new(direction, here.center(), lens, aspect(scene)));
                    (choice.clone(), fit)
                };
                fits = choices.map(fit).collect();
            }
            bounds = Some(bounds.map_or(here, |so_far| so_far.union(&here)));
            fits.iter_mut().filter_map(|(_, fit)| fit.as_mut()).for_each(|fit| fit.add(scene, &here));
        }
        Ok(bounds.map(|bounds| {
            let camera = |(choice, fit): (Choice, Option<Fit>)| (choice, fit.map(|fit| fit.camera(bounds.radius())));
            // With several models, each has its own widths.
            let is_one = batch.inputs.len() == 1 && !is_scene_file;
            let wire_widths = job.load.wire_widths.or_else(|| widths.usual().filter(|_| is_one));
            Self { bounds, photometric, wire_widths, cameras: fits.into_iter().map(camera).collect() }
        }))
    }

    /// Load options for a picture.
    pub(super) fn load_for(&self, job: &RenderJob, step: &Step) -> LoadOptions {
        LoadOptions { wire_widths: self.wire_widths, ..job.load_for(step) }
    }

    /// Camera of a choice, if it is framed on the model.
    pub(super) fn camera(&self, choice: &Choice) -> Option<&Camera> {
        let found = self.cameras.iter().find(|(known, _)| known == choice);
        found.and_then(|(_, camera)| camera.as_ref())
    }
}
