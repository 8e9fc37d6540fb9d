//! What was typed after `meshray render`.

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
    /// Models (.glb, .gltf, .vrm, .obj, .ply, .stl, .nff), folders and .zip archives of them, or scene files (.toml); `-` reads
    /// standard input
    ///
    /// An archive is not unpacked. Its only model is drawn under the name of the archive; one with several models is a folder
    /// of them, and one of these is named as in a folder: ships.zip/tug/tug.gltf. In a folder one is left out that was
    /// unpacked there, beside a folder or a model of its name.
    #[arg(value_name = "INPUT", required_unless_present = "again")]
    pub inputs: Vec<PathBuf>,
    /// The folders among them.
    #[arg(skip)]
    pub folders: Vec<PathBuf>,

    /// Where to write: a file (png, exr, jpg, webp by its ending), a folder, `-`, or a template with {dir} {sub} {stem}
    /// {ext} {view} {frame:04}
    ///
    /// Without it the picture goes to STEM.png in the current folder. Pictures of models in the folders of a folder that was
    /// named go to folders like these: {sub} is the way from the folder that was named to the model's own, on which an
    /// archive has no extension. A folder given here
    /// is made, and so are those of a template with fields other than {dir}, where what the first lies in is there.
    /// Names that are made up, in a folder given here and of heat maps too, and those of a template beside any of the models,
    /// replace only a picture that meshray wrote; a name given here replaces whatever is there.
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
    /// Add layers to an EXR: albedo, N, P, Z, prim and instance ids; named, also what each pixel cost by ray class, such
    /// as `tests.shadow`: ray/prim tests, nodes and cells visited (steps), tests saved by the mailbox, ms
    ///
    /// Counts are exact and the same in every run; milliseconds are noisy (the least of three passes, pixel by pixel).
    /// They are taken after the picture is done, so that its own time is that of an ordinary run.
    #[arg(long, value_name = "tests,steps,mailbox,ms", num_args = 0..=1, require_equals = true,
          default_missing_value = "", value_parser = parse::costs, help_heading = "Output", hide_short_help = true)]
    pub layers: Option<parse::CostList>,
    /// Write a heat map beside the picture, such as ship-tests.png: what each pixel cost, on a scale
    #[arg(long, value_name = "tests|steps|mailbox|ms", value_parser = parse::named::<Cost>(), value_delimiter = ',',
          help_heading = "Output", hide_short_help = true)]
    pub heatmap: Vec<Cost>,
    /// What the brightest colour of the heat map stands for [default: the most of any pixel]
    #[arg(long, value_name = "N", value_parser = parse::above_zero, requires = "heatmap", help_heading = "Output",
          hide_short_help = true)]
    pub heatmap_max: Option<f64>,
    /// How linear light becomes display colour; not for EXR, which stays linear [default: neutral, or none where all is
    /// unlit]
    #[arg(long, value_name = "NAME", value_parser = parse::named::<ToneMap>(), help_heading = "Output",
          hide_short_help = true)]
    pub tone_map: Option<ToneMap>,
    /// Brighter (+) or darker (-) by this many stops, but for the walls behind lamps in lux and candela; not for EXR, which
    /// keeps light as it is
    #[arg(long, value_name = "STOPS", value_parser = parse::exposure, help_heading = "Output", allow_hyphen_values = true)]
    pub exposure: Option<f32>,
    /// Put all inputs into one scene and one picture
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub merge: bool,
    /// Leave pictures alone that are up to date: made with --update by this build, with the same flags, of the same files
    ///
    /// Which those are is told by hashes that the picture carries, not by times. Of standard input and of hundreds of files a
    /// picture is made again.
    #[arg(long, help_heading = "Output", hide_short_help = true,
          conflicts_with_all = ["again", "stats", "heatmap", "profile"])]
    pub update: bool,
    /// On Ctrl-C keep the tiles that are done as NAME.partial.png; not with `-o -`, which has no name
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
    /// Parallel rays, seeing HEIGHT units [default: what the model needs]
    #[arg(long, value_name = "HEIGHT", num_args = 0..=1, default_missing_value = "auto", value_parser = parse::ortho,
          require_equals = true, conflicts_with = "fov", help_heading = "Camera", hide_short_help = true)]
    pub ortho: Option<parse::Ortho>,

    /// #rrggbb, a colour name, r,g,b (linear, 0 to 1), `transparent`, or `env`: what reflections see, of
    /// the studio its walls
    #[arg(long, value_name = "COLOR", value_parser = parse::background, help_heading = "Light and background",
          allow_hyphen_values = true)]
    pub background: Option<Background>,
    /// What surrounds the scene and lights it: an equirectangular picture (.hdr, .exr, or one for
    /// screens), or studio, white, black
    ///
    /// Black gives no light, but mirrors and glass see the --background in it, where that is a colour (dark grey if nobody says).
    /// A model without lamps keeps its default ones in the studio, and anything else takes their place; lamps of the file
    /// keep shining. A picture's middle lies along +X, a quarter to the right of it +Z, its upper edge overhead.
    #[arg(long, value_name = "FILE|NAME", value_parser = parse::env, help_heading = "Light and background")]
    pub env: Option<parse::Env>,
    /// Turn that picture about the up axis
    #[arg(long, value_name = "DEGREES", value_parser = parse::degrees, requires = "env", allow_hyphen_values = true,
          help_heading = "Light and background", hide_short_help = true)]
    pub env_rotate: Option<f64>,
    /// How wide directional lights and the default key light look in the sky: shadows get soft edges. The sun is 0.53
    /// wide [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = parse::sun, help_heading = "Light and background",
          hide_short_help = true)]
    pub sun_size: Option<f64>,
    /// Shadow rays to each light that has an extent [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Light and background", hide_short_help = true)]
    pub light_rays: Option<u32>,
    /// Rays that each point sends to what surrounds the scene, to find what hides it; with --env white: ambient
    /// occlusion. If any, at least 2 in each way that the scene needs to draw them: by the cosine, for rough mirrors, for
    /// a panorama, through what is translucent [default: 16 for pictures, else 0: nothing hides it]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Light and background", hide_short_help = true)]
    pub env_rays: Option<u32>,

    /// How pixels are sampled.
    #[command(flatten)]
    pub sampling: SamplingArgs,
    /// Bounces after the eye ray [default: what the scene needs]
    #[arg(long, value_name = "N", value_parser = parse::depth(), help_heading = "Quality")]
    pub depth: Option<u32>,
    /// Weight below which a branch of the ray tree ends [default: 0.001953125]
    #[arg(long, value_name = "WEIGHT", value_parser = parse::cutoff, help_heading = "Quality", hide_short_help = true)]
    pub cutoff: Option<f32>,
    /// Rays that a rough surface spreads over what it mirrors, and over what it lets through; 0: it sees its
    /// surroundings blurred by a formula, and nothing that stands in them [default: 4 for frosted glass, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Quality",
          hide_short_help = true)]
    pub gloss_rays: Option<u32>,
    /// Seed of every random choice
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Quality", hide_short_help = true)]
    pub seed: u64,

    /// How models are loaded.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Several frames, from A to before B (`A..=B`: with B), seen by one camera that has all of them in the picture; with
    /// --frame N, only that one of them
    ///
    /// Pictures go to STEM.0000.png and so on, or to a template with {frame:04}.
    #[arg(long, value_name = "A..B", value_parser = parse::frames, allow_hyphen_values = true, help_heading = "Animation",
          hide_short_help = true, conflicts_with_all = ["time", "turntable"])]
    pub frames: Option<parse::Frames>,
    /// N pictures from all around, about the up axis, the view or camera being the first; with I/N, only number I of
    /// them, from 0
    ///
    /// Pictures go to STEM.0000.png and so on, or to a template with {frame:04}. The lamps of a model without its own go
    /// with the camera, the studio that mirrors see stays.
    #[arg(long, value_name = "N", value_parser = parse::turns, help_heading = "Camera", hide_short_help = true)]
    pub turntable: Option<parse::Turns>,
    /// Draw the background when the file holds nothing to draw
    #[arg(long, help_heading = "Loading", hide_short_help = true)]
    pub allow_empty: bool,
    /// Treat warnings as errors: no picture, exit code 3
    #[arg(long, help_heading = "Loading", hide_short_help = true)]
    pub strict: bool,

    /// Structure that finds what rays hit; the picture is the same with each. `auto` counts what some rays cost in
    /// `fast-octree` and `fast-bvh` and takes the better one
    #[arg(long, value_name = "NAME", value_parser = parse::named::<AccelChoice>(), default_value = AccelChoice::AUTO,
          help_heading = "Structure", hide_short_help = true)]
    pub accel: AccelChoice,
    /// Test of rays against triangles; all but `exact` are there to be compared with it
    #[arg(long, value_name = "NAME", value_parser = parse::named::<IntersectorKind>(),
          default_value = IntersectorKind::Exact.name(), help_heading = "Structure", hide_short_help = true)]
    pub intersector: IntersectorKind,
    /// Parameters of the structure
    #[command(flatten)]
    pub params: AccelArgs,
    /// What becomes of meshes that are shown several times; the picture is the same. `auto` stores them once where that
    /// saves much memory, `keep` wherever it can, `flatten` never
    #[arg(long, value_name = "HOW", value_parser = parse::named::<Instancing>(),
          default_value = Instancing::Auto.name(), help_heading = "Structure", hide_short_help = true)]
    pub instances: Instancing,
    /// Do the work of every feature, of those too that the scene lacks (`inspect` lists them); the picture is the same
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
    /// Render no picture: say what time, rays, tests and memory it would take and what error it would have, each with an
    /// interval, from about a hundredth of its pixels
    #[arg(long, help_heading = "Run", hide_short_help = true, conflicts_with_all = [
        "again", "heatmap", "profile", "keep_partial"])]
    pub dry_run: bool,
    /// Print where the time went: reading, parsing, building, each class of rays, shading, writing; wall and CPU
    #[arg(long, help_heading = "Run", hide_short_help = true)]
    pub profile: bool,
    /// Write the statistics, or what --dry-run foretells, to a file instead of standard output; it stays as it is when there
    /// are none
    #[arg(long, value_name = "PATH", help_heading = "Run", hide_short_help = true)]
    pub stats_file: Option<PathBuf>,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t, help_heading = "Run", hide_short_help = true)]
    pub messages: MessageFormat,
    /// Only warnings and errors
    #[arg(short, long, help_heading = "Run")]
    pub quiet: bool,
}
