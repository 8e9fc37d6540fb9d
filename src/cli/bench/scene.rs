//! A model made ready for the one rendering whose rays are recorded.

use super::super::args::BenchArgs;
use super::super::camera::{self, Choice};
use super::super::exit::Exit;
use super::super::message::{Messages, Severity};
use super::super::read;
use crate::accel::{AccelKind, AccelParams, AnyAccel};
use crate::load::{Diagnostic, Loaded};
use crate::render::texture::TextureStore;
use crate::render::{Job, Settings, View, World};
use crate::scene::default_light;
use crate::scene::framing::robust_bounds;
use std::path::PathBuf;

/// Everything the rendering needs but the structure.
pub(super) struct Prepared {
    pub loaded: Loaded,
    pub world: World,
    pub settings: Settings,
    pub view_phrase: String,
    view: View,
}

impl Prepared {
    /// Loads and frames; what is wrong is said.
    pub(super) fn new(input: &PathBuf, args: &BenchArgs, messages: &Messages) -> Result<Self, Exit> {
        let mut loaded = read::one_model(input, &args.load, messages)?;
        let world = World::new(&loaded.scene);
        if world.shapes.is_empty() {
            let fault = Diagnostic::new("nothing-to-draw", input, "", "nothing to hit: it holds no faces");
            messages.say(Severity::Error, &fault);
            return Err(Exit::Input);
        }
        let (width, height) = args.size;
        let bounds = robust_bounds(&loaded.scene);
        let aspect = f64::from(width) / f64::from(height);
        let found = camera::camera(&choice(args), None, &loaded.scene, &bounds, aspect, input);
        let (camera, view_phrase) = found.map_err(|fault| {
            messages.say(Severity::Error, &fault);
            Exit::Input
        })?;
        default_light::add_if_missing(&mut loaded.scene, &camera);
        let settings = Settings {
            width,
            height,
            samples: args.samples,
            depth: args.depth.or(loaded.scene.hints.depth),
            seed: args.seed,
            ..Settings::default()
        };
        let view = View::from_camera(&camera);
        Ok(Self { loaded, world, settings, view_phrase, view })
    }

    /// Lets `work` have it as a job. Which structure it has does not matter: all find the same hits.
    pub(super) fn with_job<T>(&self, work: impl FnOnce(&Job) -> T) -> T {
        let accel = AnyAccel::build(AccelKind::DEFAULT, &self.world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&self.loaded.scene);
        work(&Job {
            scene: &self.loaded.scene,
            world: &self.world,
            accel: &accel,
            textures: &textures,
            view: &self.view,
            settings: &self.settings,
        })
    }
}

fn choice(args: &BenchArgs) -> Choice {
    if let Some(eye) = args.eye {
        return Choice::Free { eye: eye.into(), at: args.at.map(Into::into), up: None };
    }
    let camera = args.camera.clone().map(Choice::Camera);
    args.view.map(Choice::Named).or(camera).unwrap_or(Choice::Default)
}
