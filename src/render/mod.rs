//! Rays -> linear pixels: waves per tile, Whitted shading, lights and shadows, optics, pixel sampling.
//!
//! [`render`] cuts the picture into tiles (`tile`); one thread traces the ray trees of a tile in waves (`whitted`, `wave`): eye
//! rays, then the shadow rays of their hits (`shadow`), then reflected and refracted rays, generation by generation. A hit
//! becomes a `surface` once, its material is evaluated in `shade`, and [`optics`] gives the directions in which light goes on.
//! Points of opaque surfaces need no more than closed formulas, which are computed for many points side by side (`shade_hits`,
//! `shading_batch`).
//!
//! The pixels are the same bits for every structure and every number of threads: structures return equal hits, sums run in a
//! fixed order within a tile, and transcendental functions are the crate's own.

mod adaptive;
mod ahead;
mod alpha_voids;
mod branch;
mod by_class;
mod certainty;
mod context;
mod costs;
mod coverage;
mod draws;
mod environment_rays;
mod fireflies;
mod forecast;
mod frame;
mod glint;
mod hotspot_rays;
mod instancing;
mod layers;
mod lobe_frame;
mod media;
pub mod no_prune;
pub(crate) mod observer;
pub mod optics;
mod patch;
mod primary_rays;
mod profile;
mod ray_caster;
pub mod ray_tree;
mod roulette;
mod sample_offsets;
mod sampling;
mod seam;
mod shade;
mod shade_hits;
mod shading_batch;
mod shadow;
mod sky;
mod sobol;
mod stochastic;
pub mod studio;
mod surface;
mod tail;
#[cfg(test)]
mod tests;
pub mod texture;
mod tile;
pub mod view;
mod wave;
mod whitted;
pub mod world;

#[cfg(feature = "cli")]
pub(crate) use adaptive::pixels_at_a_time as adaptive_pixels_at_a_time;
pub use by_class::ByClass;
pub use costs::{Cost, Costs, render_costs};
pub use coverage::{Coverage, coverage};
pub use forecast::{Forecast, Interval, forecast};
pub use instancing::Instancing;
pub use observer::{Asked, Question, Tape};
pub use primary_rays::ThinLens;
pub use profile::{Profile, render_profiled};
pub use sampling::{Adaptive, ErrorSpace, Filter, Quality, Sampled, Sampling, Split, Stochastic, Targeted};
pub use shadow::filters::{FilterScratch, Filters};
pub use surface::given_normal;
pub use texture::TextureStore;
pub use view::{Lens, View};
pub use world::{Moved, Placing, PrimSource, World};

use crate::accel::{AnyAccel, NoProbe, RayCounts};
use crate::image::Picture;
use crate::scene::Scene;
use context::Context;
use fireflies::Closely;
use observer::Observer;

/// Names of the ray classes as they are typed and printed, in the order of counts.
pub const CLASS_NAMES: [&str; 4] = ["primary", "shadow", "reflected", "refracted"];

/// What to render and how well.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Samples a pixel in uniform sampling: a square number lies on a regular grid, any other on a rank-1 lattice. Tasks that
    /// need a fixed number (costs of pixels, recorded rays, single samples) use it in every other kind of sampling, too.
    pub samples: u32,
    /// How many rays each pixel gets, and where.
    pub sampling: Sampling,
    /// The lens, if it has an aperture.
    pub lens: Option<ThinLens>,
    /// Bounces after the eye ray; `None`: chosen from the scene.
    pub depth: Option<u32>,
    /// Branches end whose weight (largest channel) falls below this value.
    pub cutoff: f32,
    /// Seed of all random streams.
    pub seed: u64,
    /// Rays from each point to its surroundings, rounded up to an even number, to find their occlusion; 0: unoccluded. `None`: 16
    /// where the surroundings are a panorama, else 0.
    pub env_rays: Option<u32>,
    /// Shadow rays to each area light from the first hit; a quarter of them from points seen in mirrors.
    pub light_rays: u32,
    /// Rays that the first rough surface on a line of sight spreads over its reflection, and over its transmission; 0: rough
    /// surfaces see only their surroundings, blurred by a closed formula. `None`: 4 for surfaces that transmit light, else 0.
    pub gloss_rays: Option<u32>,
    /// Brightness factor of the built-in studio's walls as the background of the picture; the light from them stays as it is.
    pub walls: f32,
    /// Whether [`crate::image::Layers`] are wanted.
    pub layers: bool,
    /// For measurements: shade points one by one instead of in batches. Same bits, slower.
    pub one_by_one: bool,
    /// For measurements: also run the code paths that the scene does not need, without effect (see [`no_prune`]). The world and
    /// the textures of the [`Job`] must be made likewise.
    pub no_prune: bool,
}

impl Settings {
    /// Greatest number of columns, and of rows.
    pub const MOST_SIDE: u32 = 65_535;
    /// Greatest number of samples a pixel in uniform sampling, and of rays to lights, to surroundings and over rough surfaces.
    pub const MOST_RAYS: u32 = 65_536;

    /// Checks that sizes and numbers of rays are within the ranges of the command line. Whether there is memory for the picture
    /// is another matter: a pixel takes tens of bytes, in adaptive sampling some hundred.
    ///
    /// # Errors
    ///
    /// The first number out of its range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let within = |name, value: u32, least: u32, most: u32| {
            (least..=most).contains(&value).then_some(()).ok_or(SettingsError { name, value, least, most })
        };
        within("width", self.width, 1, Self::MOST_SIDE)?;
        within("height", self.height, 1, Self::MOST_SIDE)?;
        within("samples", self.samples, 1, Self::MOST_RAYS)?;
        within("light_rays", self.light_rays, 0, Self::MOST_RAYS)?;
        within("env_rays", self.env_rays.unwrap_or(0), 0, Self::MOST_RAYS)?;
        within("gloss_rays", self.gloss_rays.unwrap_or(0), 0, Self::MOST_RAYS)
    }

    /// Fewest eye rays of a rendering.
    pub fn fewest_eye_rays(&self) -> u64 {
        let samples = match self.sampling {
            Sampling::Uniform => self.samples.max(1),
            Sampling::Adaptive(_) => 1,
            Sampling::Stochastic(how) => how.powers().0,
        };
        u64::from(self.width) * u64::from(self.height) * u64::from(samples)
    }

    /// These settings with the same number of samples in each pixel.
    fn fixed(&self) -> Self {
        Self { sampling: Sampling::Uniform, ..self.clone() }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1024,
            height: 768,
            samples: 4,
            sampling: Sampling::Uniform,
            lens: None,
            depth: None,
            cutoff: 1.0 / 512.0,
            seed: 0,
            env_rays: None,
            light_rays: 16,
            gloss_rays: None,
            walls: 1.0,
            layers: false,
            one_by_one: false,
            no_prune: false,
        }
    }
}

/// A number of [`Settings`] that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} is {value}: it must be {least} to {most}")]
pub struct SettingsError {
    name: &'static str,
    value: u32,
    least: u32,
    most: u32,
}

/// Ray counts of a counted run.
pub type ClassCounts = ByClass<RayCounts>;

/// A scene, ready to be rendered, and the settings.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The scene as loaded.
    pub scene: &'a Scene,
    /// The scene, placed for tracing.
    pub world: &'a World,
    /// Structure built over the world ([`World::structure`]).
    pub accel: &'a AnyAccel<'a>,
    /// The scene's textures.
    pub textures: &'a TextureStore<'a>,
    /// Eye, direction and lens.
    pub view: &'a View,
    /// Size and quality.
    pub settings: &'a Settings,
}

/// Receives the progress of a rendering, and may cancel it. Called from all threads.
pub trait Progress: Sync {
    /// `done` of `total` tiles are finished.
    fn tiles(&self, done: usize, total: usize);
    /// Whether to stop; called every few hundred rays.
    fn cancelled(&self) -> bool;
    /// Finding out how many samples are needed takes time: called again and again meanwhile.
    fn plans(&self) {}
    /// The rendering of all tiles begins; called more than once where several renderings make the picture.
    fn begins(&self) {}
}

/// Progress that is ignored and never cancels.
impl Progress for () {
    fn tiles(&self, _done: usize, _total: usize) {}
    fn cancelled(&self) -> bool {
        false
    }
}

/// Result of a [`Job`].
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture; tiles that were not finished are transparent black.
    pub picture: Picture,
    /// Ray counts; zero unless counted.
    pub counts: ClassCounts,
    /// Numbers of rays of the pixels, and their errors.
    pub sampled: Sampled,
    /// The maximum depth used.
    pub depth: u32,
    /// False when rendering was cancelled before the end.
    pub complete: bool,
}

/// Renders on all threads of the current rayon pool.
///
/// # Panics
///
/// Where the parts of the job belong to different scenes, the scene is not sound ([`Scene::check`]), or there is no memory for
/// a picture of that size and so many rays ([`Settings::validate`]). A picture without pixels is none.
pub fn render(job: &Job, progress: &dyn Progress) -> Rendered {
    render_with::<NoProbe>(job, progress, || {}).0
}

/// Renders and counts; slower, but the same pixels.
pub fn render_counted(job: &Job, progress: &dyn Progress) -> Rendered {
    let (mut rendered, counts) = render_with::<RayCounts>(job, progress, || {});
    for mut more in counts {
        let each = rendered.counts.each_mut().into_iter().zip(more.each_mut());
        each.for_each(|(sum, more)| *sum += *more);
    }
    rendered
}

/// Renders on one thread with [`Settings::samples`] samples in each pixel, and keeps the rays: at most [`Tape::LIMIT`] of each
/// class for each question. `None` when a thread cannot be started or the rendering was cancelled.
pub fn render_recorded(job: &Job, progress: &dyn Progress) -> Option<(Rendered, Recording)> {
    let job = &Job { settings: &job.settings.fixed(), ..*job };
    // One thread takes the tiles in order, so that the rays come in the same order in every run.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
    let (rendered, mut tapes) = alone.install(|| render_with::<Tape>(job, progress, || {}));
    let mut recording = tapes.pop().filter(|_| rendered.complete)?;
    let batches = tile::batches(job.settings);
    recording.each_mut().into_iter().for_each(|tape| tape.name_pixels(&batches));
    Some((rendered, recording))
}

/// Rays of a rendering; the `sample` of each is its pixel, counted row by row.
pub type Recording = ByClass<Tape>;

/// Renders; calls `prepared` between the work done once per picture and the tiles.
fn render_with<P: Observer>(
    job: &Job,
    progress: &dyn Progress,
    prepared: impl FnOnce(),
) -> (Rendered, Vec<ByClass<P>>) {
    let settings = job.settings;
    let mut context = Context::new(job.scene, job.world, job.textures, settings);
    prepared();
    let (rays, more) = fireflies::look(job, &mut context, Closely::All, progress);
    let (mut rendered, mut counts) = match &settings.sampling {
        Sampling::Stochastic(how) if how.target.is_some() => forecast::target::render(job, &context, how, progress),
        _ => None,
    }
    .unwrap_or_else(|| {
        let tile::RenderedTiles { picture, sampled, counts, complete } =
            tile::render_tiles(&context, job.accel, job.view, settings, progress);
        (Rendered { picture, counts: ClassCounts::default(), sampled, depth: context.depth, complete }, counts)
    });
    rendered.sampled.looked = rays.beside;
    rendered.sampled.rays += rays.beside;
    counts.extend(more);
    (rendered, counts)
}
