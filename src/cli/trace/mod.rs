//! `meshray trace`: reports one primary ray step by step, with all its descendants; as text, as JSON, and as a picture.
//!
//! # Schema `meshray-trace/1`
//! One JSON object: `version`, `file`, `hash`, `view`, `width`, `height`, `pixel` (column and row from 0), `sample` (from 0) of
//! `samples`, `depth`, `accel`, `prims` (N), `radiance` (linear colour of the sample) and `through` (share of the background
//! behind it), and `ray`, the root of the ray tree:
//!
//! | key | what |
//! |---|---|
//! | `class`, `question` | `primary`, `shadow`, `reflected`, `refracted`; `closest`, `occluded` (is its light blocked), `next` (next hit behind `after`) |
//! | `origin`, `direction`, `t_min`, `t_max` | the ray, in world space; `t_max` is `null` where it has no end |
//! | `skipped` | of the primary ray: distance of the camera before `origin`, where t is 0; positive for a distant camera, whose rays start just before the scene |
//! | `light`, `riser`, `after` | light of a shadow ray; whether it only leads up to the start of another one, above a surface that stands for a round one; `t` and `prim` of the hit behind which the search continued |
//! | `counts` | `n_it`, `n_ts`, `n_ets`, `n_eets`, `n_bit`, `n_mb`, `n_xf` of this query |
//! | `hit` | `t`, `u`, `v`, `prim`, `object`, `material`, `position`, `normal` (geometric); `null` for a miss; of `occluded` the first blocking prim found |
//! | `steps` | in order (of the primary ray; of all with `--all-steps`): `visit` with `at`, `shape`, `box`, `t` (entry and exit) and `prims`; `test` with `outcome` and `t`; `mailbox` (a prim not tested again); `volumes`, `transforms` (counts) |
//! | `rays` | children of the ray |
//!
//! Keys are only ever added.

mod args;
mod json;
mod picture;
mod text;
mod words;

use super::camera::{Choice, LensChoice};
use super::exit::Exit;
use super::job::{self, Look, UsageError};
use super::message::{Messages, Severity};
use super::picture::{Effective, background};
use super::sampling::SamplingArgs;
use super::writable::{self, Sources};
use super::{interrupt, panics, read, viewed};
use crate::accel::{AccelKind, AccelParams};
use crate::image::{FileKind, Metadata};
use crate::load::{Diagnostic, Loaded};
use crate::render::ray_tree::{RayTree, tell};
use crate::render::texture::TextureStore;
use crate::render::{Instancing, Job, Settings, View, World};
pub(super) use args::TraceArgs;
use std::path::Path;

/// Everything to report.
struct TraceReport<'a> {
    name: &'a str,
    loaded: &'a Loaded,
    world: &'a World,
    accel: AccelKind,
    settings: &'a Settings,
    eye: &'a View,
    /// Description of the view.
    view: &'a str,
    pixel: (u32, u32),
    sample: u32,
    ray_tree: &'a RayTree,
    /// Whether to list steps of every ray.
    all_steps: bool,
}

/// Loads the model, traces the ray and prints its report.
pub(super) fn run(args: &TraceArgs) -> Exit {
    let messages = Messages::new(args.model.messages.into(), args.quiet);
    let checked = check(args).and_then(|look| Ok((look, job::params(&args.params, args.accel.kinds())?)));
    match checked {
        Ok((look, params)) => {
            let name = args.model.input.display().to_string();
            panics::guard(&name, &messages, || trace(args, &look, &params, &name, &messages).unwrap_or_else(|e| e))
        }
        Err(wrong) => messages.wrong(wrong),
    }
}

/// Settings of the picture that the ray belongs to.
fn check(args: &TraceArgs) -> Result<Look, UsageError> {
    if let Some(path) = &args.output
        && FileKind::from_path(path).ok() != Some(FileKind::Png)
    {
        return Err(UsageError("-o writes a PNG; end its name in .png".into()));
    }
    Ok(Look {
        size: args.size,
        sampling: SamplingArgs { samples: Some(args.samples), ..SamplingArgs::default() },
        depth: args.depth,
        cutoff: args.cutoff,
        lens: LensChoice::new(args.fov, args.ortho),
        ..Look::default()
    })
}

fn trace(args: &TraceArgs, look: &Look, params: &AccelParams, name: &str, messages: &Messages) -> Result<Exit, Exit> {
    let file = args.model.input.as_path();
    let fail = |exit: Exit| move |fault: Diagnostic| messages.fail(&fault, exit);
    if let Some(path) = &args.output {
        writable::check(path, "-o", &Sources::of([file])).map_err(fail(Exit::Failed))?;
    }
    let mut loaded = read::model_as_stored(&args.model.input, &args.model.load, messages)?;
    if let Some(path) = &args.output {
        Sources::of(&loaded.facts.files).spared_by(path, "-o").map_err(fail(Exit::Failed))?;
    }
    let how = if job::keeps_instances(args.accel) { Instancing::Auto } else { Instancing::Flatten };
    let limit = args.model.load.limits().memory;
    let world = read::as_drawn(&loaded, how, limit, file).map_err(fail(Exit::Failed))?;
    if world.is_empty() {
        return Err(fail(Exit::Input)(viewed::nothing_to_hit(file)));
    }
    let wrong = |text: String| Diagnostic::new("scene-value", file, "", text);
    let effective = Effective::new(look, &loaded.scene).map_err(wrong).map_err(fail(Exit::Input))?;
    let settings = &effective.settings;
    inside(args, settings).map_err(|wrong| messages.wrong(wrong))?;

    // Camera, lights, and ray.
    let choice = Choice::of(&args.eye, args.up_vector).map_err(|wrong| messages.wrong(wrong))?;
    let size = (settings.width, settings.height);
    let (view, view_phrase) =
        viewed::eye(&mut loaded.scene, &choice, look.lens, size, file).map_err(fail(Exit::Input))?;
    loaded.scene.background = Some(background(look.background, &loaded.scene));
    let (accel, _) = world.structure_for(settings.fewest_eye_rays(), args.accel, params);
    let textures = TextureStore::new(&loaded.scene);
    let job = Job { scene: &loaded.scene, world: &world, accel: &accel, textures: &textures, view: &view, settings };
    let ray_tree = tell(&job, args.pixel, args.sample).ok_or_else(|| {
        let text = format!("the picture has no pixel {:?} or no sample {} of it", args.pixel, args.sample);
        messages.wrong(UsageError(text))
    })?;
    let told = TraceReport {
        name,
        loaded: &loaded,
        world: &world,
        accel: accel.kind(),
        settings,
        eye: &view,
        view: &view_phrase,
        pixel: args.pixel,
        sample: args.sample,
        ray_tree: &ray_tree,
        all_steps: args.all_steps,
    };

    let text = if args.json { json::write(&told) } else { text::write(&told) };
    messages.print(&text)?;
    match &args.output {
        Some(path) => draw(path, &told, &job, messages).map_err(fail(Exit::Failed)),
        None => Ok(Exit::Done),
    }
}

/// Checks that the picture has the pixel and the sample.
fn inside(args: &TraceArgs, settings: &Settings) -> Result<(), UsageError> {
    let ((x, y), (width, height)) = (args.pixel, (settings.width, settings.height));
    if x >= width || y >= height {
        return Err(UsageError(format!(
            "pixel {x},{y} is outside the picture of {width}×{height}; columns and rows count from 0 at the top left"
        )));
    }
    if args.sample >= args.samples {
        let (sample, samples) = (args.sample, args.samples);
        return Err(UsageError(format!("--sample {sample} is not one of {samples}, counted from 0; raise --samples")));
    }
    Ok(())
}

fn draw(path: &Path, told: &TraceReport, job: &Job, messages: &Messages) -> Result<Exit, Diagnostic> {
    let fault = |text: String| Diagnostic::new("output-unwritable", path, "", text);
    let canvas = picture::draw(told, job);
    let bytes = canvas.png(&Metadata::new()).map_err(|e| fault(e.to_string()))?;
    interrupt::write_atomic(path, &bytes).map_err(|e| fault(e.to_string()))?;
    let text = "the scene cut open along the ray, seen from the side, with what was visited";
    messages.say(Severity::Info, &Diagnostic::new("picture", path, "", text));
    Ok(Exit::Done)
}

impl TraceReport<'_> {
    /// Title that identifies the ray.
    fn title(&self) -> String {
        let Settings { width, height, samples, .. } = self.settings;
        format!(
            "{}: sample {} of {samples} of pixel {},{} of {width}×{height}, {}; {} over {} prims",
            self.name,
            self.sample,
            self.pixel.0,
            self.pixel.1,
            self.view,
            self.accel,
            crate::number::grouped(self.world.len() as u64)
        )
    }

    /// Distance of the camera behind the ray's origin: distant cameras start their rays just before the scene. 0 if not skipped.
    fn skipped(&self) -> f64 {
        let Some(ray) = self.ray_tree.queries.first().map(|query| query.ray) else { return 0.0 };
        let View { eye, forward, .. } = self.eye;
        // Measured along the view direction: orthographic rays, and those through a lens, start beside the camera position.
        let distance =
            (words::in_world(self.world, ray.origin) - *eye).dot(*forward) / ray.dir.as_dvec3().dot(*forward);
        // Ignore the rounding error of the origin.
        if distance > 1e-5 * eye.distance(self.world.center) { distance } else { 0.0 }
    }

    fn color(&self) -> String {
        let [r, g, b] = self.ray_tree.radiance.to_array();
        let through = self.ray_tree.through.element_sum() / 3.0;
        let behind = if through > 0.0 { format!(" and {through} of the background") } else { String::new() };
        format!("{r} {g} {b}{behind}")
    }
}
