//! Arguments of `meshray render`.

use super::super::parse;
use super::super::sampling::SamplingArgs;
use super::level::SimdArgs;
use super::model::LoadArgs;
use super::structure::AccelArgs;
use super::words::{FileType, MessageFormat, StatsFormat};
use crate::accel::{AccelChoice, IntersectorKind};
use crate::image::ToneMap;
use crate::render::{Cost, Instancing, Settings};
use crate::scene::Background;
use crate::scene::framing::NamedView;
use clap::{ArgAction, Args};
use std::path::PathBuf;

/// What `meshray render` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct RenderArgs {
    /// Models (.glb, .gltf, .vrm, .obj, .ply, .stl, .nff), folders and .zip archives of them, or scene files (.toml); `-`
    /// reads standard input
    ///
    /// An archive is read without unpacking. One with a single model stands for it, and gives the picture its name; one with
    /// several models is a folder, in which a model is named as ships.zip/tug/tug.gltf. In a folder an archive is skipped if
    /// it was unpacked there, beside a folder or a model of its name.
    #[arg(value_name = "INPUT", required_unless_present = "again")]
    pub inputs: Vec<PathBuf>,
    /// The folders among them.
    #[arg(skip)]
    pub folders: Vec<PathBuf>,

    /// Where to write: a file (png, exr, jpg, webp by its extension), a folder, `-`, or a template with {dir} {sub} {stem}
    /// {ext} {view} {frame:04}
    ///
    /// Default: STEM.png in the current folder. Models found below an input folder get the same subfolders for their
    /// pictures: {sub} is the path from the input folder to the model's own (without the extension of an archive). A folder
    /// given here is created, and so are those of a template with fields other than {dir}, if the folder they start from
    /// exists. A name typed here replaces any file; names that meshray makes up (STEM.png, in a folder given here, of heat
    /// maps, or of a template that writes beside a model) replace only pictures that meshray wrote.
    #[arg(short, long, value_name = "PATH", help_heading = "Output", allow_hyphen_values = true)]
    pub output: Option<String>,
    /// Columns and rows of the picture; one number is a square [default: 1024x768]
    #[arg(long, value_name = "WxH", value_parser = parse::size, help_heading = "Output")]
    pub size: Option<(u32, u32)>,
    /// File type when the name does not say, as with `-o -`
    #[arg(long, value_name = "TYPE", value_enum, help_heading = "Output", hide_short_help = true)]
    pub format: Option<FileType>,
    /// Bits a channel of a PNG
    #[arg(long, value_name = "8|16", value_parser = parse::bits, help_heading = "Output", hide_short_help = true)]
    pub bits: Option<u8>,
    /// Store EXR colours as 16-bit floats (default)
    #[arg(long, help_heading = "Output", hide_short_help = true, conflicts_with = "float")]
    pub half: bool,
    /// Store EXR colours as 32-bit floats
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub float: bool,
    /// Add layers to an EXR: albedo, N, P, Z, prim and instance ids; with names, also the cost of each pixel by ray class,
    /// such as `tests.shadow`: ray/prim tests, nodes and cells visited (steps), tests saved by the mailbox, ms
    ///
    /// Counts are exact and the same in every run; milliseconds are noisy (the least of three passes, pixel by pixel). They
    /// are taken after the picture is done, so that its own time is that of an ordinary run.
    #[arg(long, value_name = "tests,steps,mailbox,ms", num_args = 0..=1, require_equals = true,
          default_missing_value = "", value_parser = parse::costs, help_heading = "Output", hide_short_help = true)]
    pub layers: Option<parse::CostList>,
    /// Write a heat map beside the picture, such as ship-tests.png: the cost of each pixel, with a scale
    #[arg(long, value_name = "tests|steps|mailbox|ms", value_parser = parse::named::<Cost>(), value_delimiter = ',',
          help_heading = "Output", hide_short_help = true)]
    pub heatmap: Vec<Cost>,
    /// Value of the brightest colour of the heat map [default: the most of any pixel]
    #[arg(long, value_name = "N", value_parser = parse::above_zero, requires = "heatmap", help_heading = "Output",
          hide_short_help = true)]
    pub heatmap_max: Option<f64>,
    /// How linear light becomes display colour; not for EXR, which stays linear [default: neutral, or none where all is
    /// unlit]
    #[arg(long, value_name = "NAME", value_parser = parse::named::<ToneMap>(), help_heading = "Output",
          hide_short_help = true)]
    pub tone_map: Option<ToneMap>,
    /// Brighter (+) or darker (-) by this many stops; does not change walls shown behind lamps in lux and candela, nor EXR,
    /// which keeps light as it is
    #[arg(long, value_name = "STOPS", value_parser = parse::exposure, help_heading = "Output", allow_hyphen_values = true)]
    pub exposure: Option<f32>,
    /// Put all inputs into one scene and one picture
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub merge: bool,
    /// Skip pictures that are up to date: made with --update by this build, with the same flags, from the same files
    ///
    /// Hashes stored in the picture decide, not times. Pictures of standard input and of hundreds of files are always made
    /// again.
    #[arg(long, help_heading = "Output", hide_short_help = true,
          conflicts_with_all = ["again", "stats", "heatmap", "profile"])]
    pub update: bool,
    /// On Ctrl-C keep the finished tiles as NAME.partial.png; not with `-o -`, which has no name
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub keep_partial: bool,
    /// Repeat a picture with the settings it carries; refuses when the input has changed
    #[arg(long, value_name = "PICTURE", help_heading = "Output", hide_short_help = true, conflicts_with_all = [
        "size", "format", "bits", "half", "float", "layers", "tone_map", "exposure", "merge", "view", "camera", "eye",
        "at", "up_vector", "fov", "ortho", "up", "background", "env", "env_rotate", "env_rays", "gloss_rays",
        "light_rays", "sun_size", "aa", "quality", "samples", "pixel_error", "target_error", "confidence", "min_samples", "max_samples",
        "filter", "error_space", "aa_split", "aa_threshold", "aa_depth", "aa_min_depth", "aperture", "focus", "depth", "cutoff", "seed", "scene", "variant", "animation", "time", "frame", "fps",
        "frames", "turntable",
        "polygons", "smooth", "line_width", "mtl", "allow_empty", "accel", "intersector",
        "grid_density", "grid_resolution", "max_depth", "step_cost", "leaf_size", "grid_cells", "max_references", "assign",
        "mailbox",
    ])]
    pub again: Option<PathBuf>,

    /// Side of the model; repeat for several pictures
    #[arg(long, value_name = "NAME", value_parser = parse::named::<NamedView>(), action = ArgAction::Append,
          value_delimiter = ',', help_heading = "Camera")]
    pub view: Vec<NamedView>,
    /// A camera of the file, by name or number from 0; repeat for several pictures
    #[arg(long, value_name = "NAME", action = ArgAction::Append, help_heading = "Camera")]
    pub camera: Vec<String>,
    /// Camera position
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vec3, help_heading = "Camera", hide_short_help = true, allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// Point the camera looks at [default: middle of the model]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vec3, help_heading = "Camera", hide_short_help = true, allow_hyphen_values = true)]
    pub at: Option<[f64; 3]>,
    /// Direction that is up in the picture [default: the up axis]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::direction, help_heading = "Camera", hide_short_help = true, allow_hyphen_values = true)]
    pub up_vector: Option<[f64; 3]>,
    /// Vertical field of view, degrees
    #[arg(long, value_name = "DEGREES", value_parser = parse::fov, help_heading = "Camera", hide_short_help = true)]
    pub fov: Option<f64>,
    /// Orthographic camera that sees HEIGHT units [default: what the model needs]
    #[arg(long, value_name = "HEIGHT", num_args = 0..=1, default_missing_value = "auto", value_parser = parse::ortho,
          require_equals = true, conflicts_with = "fov", help_heading = "Camera", hide_short_help = true)]
    pub ortho: Option<parse::Ortho>,

    /// #rrggbb, a colour name, r,g,b (linear, 0 to 1), `transparent`, or `env`: what reflections see (of the studio, its
    /// walls)
    #[arg(long, value_name = "COLOR", value_parser = parse::background, help_heading = "Light and background",
          allow_hyphen_values = true)]
    pub background: Option<Background>,
    /// Surroundings that light the scene: an equirectangular picture (.hdr, .exr, or an ordinary one), or studio, white,
    /// black
    ///
    /// Black gives no light, but mirrors and glass see the --background in it where that is a colour (dark grey if none is
    /// given). A model without lamps keeps its default lamps in the studio; any other surroundings replace them. Lamps of the
    /// file keep shining. The middle of a picture lies along +X, a quarter to the right of it +Z, its upper edge overhead.
    #[arg(long, value_name = "FILE|NAME", value_parser = parse::env, help_heading = "Light and background")]
    pub env: Option<parse::Env>,
    /// Turn the picture given to --env about the up axis
    #[arg(long, value_name = "DEGREES", value_parser = parse::degrees, requires = "env", allow_hyphen_values = true,
          help_heading = "Light and background", hide_short_help = true)]
    pub env_rotate: Option<f64>,
    /// Angular diameter of directional lights and of the default key light, for soft shadows; the sun's is 0.53 [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = parse::sun, help_heading = "Light and background",
          hide_short_help = true)]
    pub sun_size: Option<f64>,
    /// Shadow rays to each area light [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Light and background", hide_short_help = true)]
    pub light_rays: Option<u32>,
    /// Rays from each point to the surroundings, to find what hides them; with --env white: ambient occlusion. If any, at
    /// least 2 by each way of drawing them that the scene needs: by the cosine, for rough mirrors, for a panorama, through
    /// translucent surfaces [default: 16 for pictures, else 0: nothing hides the surroundings]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Light and background", hide_short_help = true)]
    pub env_rays: Option<u32>,

    /// How pixels are sampled.
    #[command(flatten)]
    pub sampling: SamplingArgs,
    /// Bounces after the primary ray [default: what the scene needs]
    #[arg(long, value_name = "N", value_parser = parse::depth(), help_heading = "Quality")]
    pub depth: Option<u32>,
    /// Weight below which a branch of the ray tree ends [default: 0.001953125]
    #[arg(long, value_name = "WEIGHT", value_parser = parse::cutoff, help_heading = "Quality", hide_short_help = true)]
    pub cutoff: Option<f32>,
    /// Rays that a rough surface spreads over what it mirrors, and over what it transmits; 0: it sees its surroundings
    /// blurred by a formula, and no other objects [default: 4 for frosted glass, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Quality",
          hide_short_help = true)]
    pub gloss_rays: Option<u32>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Quality", hide_short_help = true)]
    pub seed: u64,

    /// How models are loaded.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Several frames, from A up to but not including B (`A..=B`: including B), with one camera that keeps all of them in the
    /// picture; with --frame N, only that one of them
    ///
    /// Pictures go to STEM.0000.png and so on, or to a template with {frame:04}.
    #[arg(long, value_name = "A..B", value_parser = parse::frames, allow_hyphen_values = true, help_heading = "Animation",
          hide_short_help = true, conflicts_with_all = ["time", "turntable"])]
    pub frames: Option<parse::Frames>,
    /// N pictures around the up axis, starting with the view or camera; with I/N, only number I of them, from 0
    ///
    /// Pictures go to STEM.0000.png and so on, or to a template with {frame:04}. The default lamps move with the camera; the
    /// studio that mirrors see does not.
    #[arg(long, value_name = "N", value_parser = parse::turns, help_heading = "Camera", hide_short_help = true)]
    pub turntable: Option<parse::Turns>,
    /// Draw the background when the file holds nothing to draw
    #[arg(long, help_heading = "Loading", hide_short_help = true)]
    pub allow_empty: bool,
    /// Treat warnings as errors: no picture, exit code 3
    #[arg(long, help_heading = "Loading", hide_short_help = true)]
    pub strict: bool,

    /// Structure that finds what rays hit; the picture is the same with each. `auto` counts the cost of some rays in
    /// `fast-octree` and `fast-bvh` and takes the better one
    #[arg(long, value_name = "NAME", value_parser = parse::named::<AccelChoice>(), default_value = AccelChoice::AUTO,
          help_heading = "Structure", hide_short_help = true)]
    pub accel: AccelChoice,
    /// Ray/triangle test; all but `exact` are there for comparison
    #[arg(long, value_name = "NAME", value_parser = parse::named::<IntersectorKind>(),
          default_value = IntersectorKind::Exact.name(), help_heading = "Structure", hide_short_help = true)]
    pub intersector: IntersectorKind,
    /// Parameters of the structure
    #[command(flatten)]
    pub params: AccelArgs,
    /// How meshes that are shown several times are stored; the picture is the same. `auto` stores them once where that saves
    /// much memory, `keep` wherever it can, `flatten` never
    #[arg(long, value_name = "HOW", value_parser = parse::named::<Instancing>(),
          default_value = Instancing::Auto.name(), help_heading = "Structure", hide_short_help = true)]
    pub instances: Instancing,
    /// Do the work of every feature, even of those that the scene lacks (`inspect` lists them); the picture is the same
    #[arg(long, help_heading = "Run", hide_short_help = true)]
    pub no_prune: bool,

    /// Threads to use; 0: all
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024), help_heading = "Run")]
    pub threads: u16,
    /// What the kernels may use.
    #[command(flatten)]
    pub simd: SimdArgs,
    /// Print times and counts: a timed run, then a counted one
    #[arg(long, value_name = "FORMAT", value_enum, help_heading = "Run")]
    pub stats: Option<StatsFormat>,
    /// Render no picture: forecast time, rays, tests and error, each with an interval, and memory, from about a hundredth of
    /// the pixels
    #[arg(long, help_heading = "Run", hide_short_help = true, conflicts_with_all = [
        "again", "heatmap", "profile", "keep_partial"])]
    pub dry_run: bool,
    /// Print where the time went: reading, parsing, building, each class of rays, shading, writing; wall and CPU
    #[arg(long, help_heading = "Run", hide_short_help = true)]
    pub profile: bool,
    /// Write the statistics, or the forecast of --dry-run, to a file instead of standard output; without any the file is left
    /// alone
    #[arg(long, value_name = "PATH", help_heading = "Run", hide_short_help = true)]
    pub stats_file: Option<PathBuf>,
    /// Format of the messages on standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t, help_heading = "Run", hide_short_help = true)]
    pub messages: MessageFormat,
    /// Only warnings and errors
    #[arg(short, long, help_heading = "Run")]
    pub quiet: bool,
}
