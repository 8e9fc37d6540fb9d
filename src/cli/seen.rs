//! One model from one side: what commands start from that judge a single view.

use super::args::{EyeArgs, ModelArgs};
use super::camera::{self, Choice};
use super::exit::Exit;
use super::message::Messages;
use super::{picture, read};
use crate::load::{Diagnostic, Loaded};
use crate::render::{Settings, View, World};
use crate::scene::RenderHints;
use crate::scene::default_light;
use crate::scene::framing::robust_bounds;

/// A model that was loaded and lit, and the eye that sees it.
pub(super) struct Seen {
    pub loaded: Loaded,
    /// Its scene, placed for tracing; holds something to hit.
    pub world: World,
    pub view: View,
    /// What view that is, in words.
    pub phrase: String,
}

/// The settings of a picture of that many columns and rows: as typed, as the scene's file says, or as usual.
pub(super) fn settings((width, height): (u32, u32), depth: Option<u32>, hints: &RenderHints) -> Settings {
    let usual = Settings::default();
    Settings { width, height, depth: depth.or(hints.depth), cutoff: hints.cutoff.unwrap_or(usual.cutoff), ..usual }
}

/// Loads a model for a picture of that many columns and rows; what is wrong with it is said.
pub(super) fn model(
    args: &ModelArgs,
    eye: &EyeArgs,
    (width, height): (u32, u32),
    messages: &Messages,
) -> Result<Seen, Exit> {
    let file = args.input.as_path();
    let fail = |fault: Diagnostic| messages.fail(&fault, Exit::Input);
    let mut loaded = read::model(args, messages)?;
    let world = World::new(&loaded.scene);
    if world.shapes.is_empty() {
        return Err(fail(Diagnostic::new("nothing-to-draw", file, "", "nothing to hit: it holds no faces")));
    }
    let bounds = robust_bounds(&loaded.scene);
    let aspect = f64::from(width) / f64::from(height);
    let (camera, phrase) =
        camera::camera(&Choice::of(eye, None), None, &loaded.scene, &bounds, aspect, file).map_err(fail)?;
    default_light::add_if_missing(&mut loaded.scene, &camera);
    loaded.scene.background = Some(picture::background(None, &loaded.scene));
    Ok(Seen { loaded, world, view: View::from_camera(&camera), phrase })
}
