//! Loads a subject and prepares the rendering whose rays are recorded.

use super::super::camera::Choice;
use super::super::exit::Exit;
use super::super::message::Messages;
use super::super::{picture, read, viewed};
use super::args::BenchArgs;
use crate::accel::{AccelChoice, AccelKind, AccelParams};
use crate::bench::pruning::Pruning;
use crate::generate::Family;
use crate::load::{Diagnostic, Loaded};
use crate::render::texture::TextureStore;
use crate::render::{Instancing, Job, Settings, View, World};
use crate::scene::Scene;
use std::fmt;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// A file, or a family of generated scenes and the number of triangles requested.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Subject {
    File(PathBuf),
    Generated(Family, usize),
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Generated(family, size) => write!(f, "{family}-{size}"),
        }
    }
}

impl Subject {
    /// Path to name in messages.
    fn path(&self) -> &Path {
        match self {
            Self::File(path) => path,
            Self::Generated(family, _) => Path::new(family.name()),
        }
    }

    /// Loads the scene; faults are reported.
    fn load(&self, args: &BenchArgs, messages: &Messages) -> Result<Loaded, Exit> {
        match self {
            Self::File(path) => read::model_as_stored(path, &args.load, messages),
            Self::Generated(family, size) => {
                let mut loaded = Loaded { scene: family.scene(*size), ..Loaded::default() };
                loaded.facts.hash = hash(&loaded.scene);
                Ok(loaded)
            }
        }
    }
}

impl Subject {
    /// Prepares the scene for tracing: a file with its instances flattened if memory permits, so that all structures can store
    /// it. Sizes of a family are all stored alike, and their largest is known to fit.
    fn world(&self, loaded: &Loaded, limit: u64) -> Result<World, Diagnostic> {
        match self {
            Self::File(path) => {
                read::placed(loaded, Instancing::Flatten, Instancing::Keep, limit, path, "raise --max-memory")
            }
            Self::Generated(..) => Ok(World::new(&loaded.scene)),
        }
    }
}

/// Hash of a scene's meshes and placements; two sizes of a family with one hash are the same scene.
fn hash(scene: &Scene) -> u128 {
    let mut hash = Xxh3::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let numbers = instance.world_from_object.to_cols_array();
        numbers.iter().for_each(|n| hash.update(&n.to_le_bytes()));
        mesh.positions.iter().for_each(|p| p.to_array().iter().for_each(|n| hash.update(&n.to_le_bytes())));
        mesh.triangles.iter().flatten().for_each(|i| hash.update(&i.to_le_bytes()));
    }
    hash.digest128()
}

/// Everything that the rendering needs except the structure.
pub(super) struct Prepared {
    pub loaded: Loaded,
    pub world: World,
    pub settings: Settings,
    pub view_phrase: String,
    pub view: View,
}

impl Prepared {
    /// Loads and frames the subject; faults are reported.
    pub(super) fn new(subject: &Subject, args: &BenchArgs, messages: &Messages) -> Result<Self, Exit> {
        let choice = Choice::of(&args.eye, None).map_err(|wrong| messages.wrong(wrong))?;
        if let Some(fault) = picture::too_large_to_judge(args.size, args.load.limits().memory) {
            return Err(messages.fail(&fault, Exit::Failed));
        }
        let mut loaded = subject.load(args, messages)?;
        let input = subject.path();
        let world =
            subject.world(&loaded, args.load.limits().memory).map_err(|fault| messages.fail(&fault, Exit::Failed))?;
        if world.is_empty() {
            return Err(messages.fail(&viewed::nothing_to_hit(input), Exit::Input));
        }
        let found = viewed::eye(&mut loaded.scene, &choice, None, args.size, input);
        let (view, view_phrase) = found.map_err(|fault| messages.fail(&fault, Exit::Input))?;
        let usual = viewed::settings(args.size, args.depth, &loaded.scene.hints);
        let settings = Settings { samples: args.samples, seed: args.seed, ..usual };
        Ok(Self { loaded, world, settings, view_phrase, view })
    }

    /// Calls `work` with the rendering as a job. The choice of structure does not matter: all find the same hits.
    pub(super) fn with_job<T>(&self, work: impl FnOnce(&Job) -> T) -> T {
        self.job_in(&self.world, &TextureStore::new(&self.loaded.scene), &self.settings, work)
    }

    /// Measures the saving of pruning; `None` when no thread can be started.
    pub(super) fn pruning(&self, passes: usize) -> Option<Pruning> {
        let world = self.world.clone().without_pruning();
        let textures = TextureStore::new(&self.loaded.scene).without_pruning();
        let settings = Settings { no_prune: true, ..self.settings.clone() };
        self.job_in(&world, &textures, &settings, |everything| {
            self.with_job(|usual| Pruning::measure(usual, everything, passes))
        })
    }

    fn job_in<T>(
        &self,
        world: &World,
        textures: &TextureStore,
        settings: &Settings,
        work: impl FnOnce(&Job) -> T,
    ) -> T {
        let (accel, _) = world.structure(AccelChoice::Kind(AccelKind::DEFAULT), &AccelParams::DEFAULT);
        let scene = &self.loaded.scene;
        work(&Job { scene, world, accel: &accel, textures, view: &self.view, settings })
    }
}
