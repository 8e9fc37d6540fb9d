//! A model seen by one camera: start of the commands that judge a single view.

use super::args::{EyeArgs, ModelArgs};
use super::camera::{self, Choice, LensChoice};
use super::exit::Exit;
use super::message::Messages;
use super::{picture, read};
use crate::load::{Diagnostic, Loaded};
use crate::render::{Settings, View, World};
use crate::scene::default_light;
use crate::scene::framing::robust_bounds;
use crate::scene::{RenderHints, Scene};
use std::path::Path;

/// A loaded model with lights, and its camera.
pub(super) struct ViewedModel {
    pub loaded: Loaded,
    /// Scene prepared for tracing; it has something to hit.
    pub world: World,
    pub view: View,
    /// Description of the view.
    pub phrase: String,
}

/// Settings of a picture of this size: as typed, or as in the scene file, or the defaults.
pub(super) fn settings((width, height): (u32, u32), depth: Option<u32>, hints: &RenderHints) -> Settings {
    let usual = Settings::default();
    Settings { width, height, depth: depth.or(hints.depth), cutoff: hints.cutoff.unwrap_or(usual.cutoff), ..usual }
}

/// Fault of a model without anything that a ray could hit.
pub(super) fn nothing_to_hit(file: &Path) -> Diagnostic {
    let fault = Diagnostic::new("nothing-to-draw", file, "", "there is nothing in it that a ray could hit");
    fault.remedy("inspect tells what it holds")
}

/// Camera for a picture of this size, and a phrase that describes the view. A scene without lamps gets the default ones, which
/// depend on the camera.
pub(super) fn eye(
    scene: &mut Scene,
    choice: &Choice,
    lens: Option<LensChoice>,
    (width, height): (u32, u32),
    file: &Path,
) -> Result<(View, String), Diagnostic> {
    let aspect = f64::from(width) / f64::from(height);
    let (camera, phrase) = camera::camera(choice, lens, scene, &robust_bounds(scene), aspect, file)?;
    default_light::add_if_missing(scene, &camera);
    Ok((View::from_camera(&camera), phrase))
}

/// Loads a model for a picture of this size; its faults are reported.
pub(super) fn model(
    args: &ModelArgs,
    eye: &EyeArgs,
    size: (u32, u32),
    messages: &Messages,
) -> Result<ViewedModel, Exit> {
    let file = args.input.as_path();
    let fail = |fault: Diagnostic| messages.fail(&fault, Exit::Input);
    let choice = Choice::of(eye, None).map_err(|wrong| messages.wrong(wrong))?;
    if let Some(fault) = picture::too_large_to_judge(size, args.load.limits().memory) {
        return Err(messages.fail(&fault, Exit::Failed));
    }
    let mut loaded = read::model(args, messages)?;
    let world = World::new(&loaded.scene);
    if world.shapes.is_empty() {
        return Err(fail(nothing_to_hit(file)));
    }
    let (view, phrase) = self::eye(&mut loaded.scene, &choice, None, size, file).map_err(fail)?;
    loaded.scene.background = Some(picture::background(None, &loaded.scene));
    Ok(ViewedModel { loaded, world, view, phrase })
}
