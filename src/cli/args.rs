//! What was typed: syntax only. What it means together is decided in [`super::job`].

use super::bench::BenchArgs;
use super::diff::DiffArgs;
use super::inspect::InspectArgs;
use super::parse;
use super::sampling::SamplingArgs;
use super::trace::TraceArgs;
use super::verify::VerifyArgs;
use crate::accel::{AccelChoice, Assign, IntersectorKind, MailboxKind};
use crate::bench::study::Plan as Study;
use crate::generate::Family;
use crate::image::ToneMap;
use crate::render::{Cost, Instancing};
use crate::scene::framing::NamedView;
use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Render downloaded meshes (glTF 2.0, OBJ, PLY, STL) into pictures, on any CPU.
#[derive(Debug, Parser)]
#[command(
    name = "meshray",
    version,
    long_version = super::version::LONG.as_str(),
    max_term_width = 100,
    subcommand_required = true,
    arg_required_else_help = true,
    after_help = "`meshray MODEL` is short for `meshray render MODEL`.\n\
                  Exit codes: 0 done, 1 could not do it, 2 bad command line, 3 bad input, 130 interrupted."
)]
pub(super) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render models into pictures
    #[command(after_help = RENDER_EXAMPLES)]
    Render(Box<RenderArgs>),
    /// Say what a file holds: sizes, faults, materials, cameras, lights, extensions
    Inspect(InspectArgs),
    /// Judge how far a mesh's hits can be trusted: rays aimed at what is hard, against exact arithmetic
    Verify(VerifyArgs),
    /// Compare structures on a model: the same rays through each, whether the hits are the same, what they cost
    Bench(Box<BenchArgs>),
    /// Say why a mesh costs what it costs: what is taken away in turn, and what that saves
    Explain(Box<ExplainArgs>),
    /// Measure what each knob buys: time against error of every setting on a model, and which to use
    Study(Box<StudyArgs>),
    /// Tell one ray of a picture in order: what it visits, tests and hits, and all rays that come of it
    Trace(Box<TraceArgs>),
    /// Compare two pictures: RMSE, PSNR, FLIP, the worst pixel, a heat map
    Diff(Box<DiffArgs>),
    /// Write a scene of any size: tetra, gears, balls, tree, mountain, stadium, instances
    Generate(GenerateArgs),
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page (roff)
    Man,
}

const RENDER_EXAMPLES: &str = "\
Examples:
  meshray render ship.glb                            writes ship.png
  meshray render *.obj -o 'thumbs/{stem}.png' --size 256x256
  meshray render ship.glb --view front --view iso -o '{stem}-{view}.exr' --layers
  meshray render ship.glb --time 1.5                 a moment of its first animation
  meshray render ship.glb --turntable 36 -o 'turn/{frame:04}.png'
  meshray render ship.glb --heatmap tests            writes ship.png and ship-tests.png
  curl -s https://example.org/ship.glb | meshray render - -o - > ship.png
  meshray render --again ship.png                    renders that picture again";

/// What `meshray render` was given.
#[derive(Debug, Clone, Args)]
pub(super) struct RenderArgs {
    /// Models (.glb, .gltf, .obj, .ply, .stl, .nff) or scene files (.toml); `-` reads standard input
    #[arg(value_name = "INPUT", required_unless_present = "again")]
    pub inputs: Vec<PathBuf>,

    /// Where to write: a file (png, exr, jpg, webp by its ending), a folder, `-`, or a template with {dir} {stem}
    /// {view} {frame:04}
    ///
    /// Without it the picture goes to STEM.png in the current folder. Names that are made up, in a folder given here and
    /// of heat maps too, replace only a picture that meshray wrote; a name given here replaces whatever is there.
    #[arg(short, long, value_name = "PATH", help_heading = "Output", allow_hyphen_values = true)]
    pub output: Option<String>,
    /// Columns and rows of the picture [default: 1024x768]
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
    #[arg(long, value_name = "tests|steps|mailbox|ms", value_parser = parse::cost(), value_delimiter = ',',
          help_heading = "Output", hide_short_help = true)]
    pub heatmap: Vec<Cost>,
    /// What the brightest colour of the heat map stands for [default: the most of any pixel]
    #[arg(long, value_name = "N", value_parser = parse::above_zero, requires = "heatmap", help_heading = "Output",
          hide_short_help = true)]
    pub heatmap_max: Option<f64>,
    /// How linear light becomes display colour; EXR stays linear [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = parse::tone_map(), help_heading = "Output", hide_short_help = true)]
    pub tone_map: Option<ToneMap>,
    /// Brighter (+) or darker (-) by this many stops (not EXR)
    #[arg(long, value_name = "STOPS", value_parser = parse::exposure, help_heading = "Output", allow_hyphen_values = true)]
    pub exposure: Option<f32>,
    /// Put all inputs into one scene and one picture
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub merge: bool,
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
    #[arg(long, value_name = "NAME", value_parser = parse::view(), action = ArgAction::Append, value_delimiter = ',',
          help_heading = "Camera")]
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
    /// Axis that points up in the file [default: what the file says, or a guess]
    #[arg(long, value_name = "AXIS", value_enum, help_heading = "Camera")]
    pub up: Option<Axis>,

    /// #rrggbb, a colour name, r,g,b (linear, 0 to 1), `transparent`, or `env`: what reflections see
    #[arg(long, value_name = "COLOR", value_parser = parse::background, help_heading = "Light and background")]
    pub background: Option<parse::Back>,
    /// What surrounds the scene and lights it: an equirectangular picture (.hdr, .exr), or studio, white, black
    ///
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
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536),
          help_heading = "Light and background", hide_short_help = true)]
    pub light_rays: Option<u32>,
    /// Rays that each point sends to what surrounds the scene, to find what hides it; with --env white: ambient
    /// occlusion. If any, at least 2, and 4 where something is translucent [default: 16 for pictures, else 0: nothing
    /// hides it]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=65_536),
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
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=65_536), help_heading = "Quality",
          hide_short_help = true)]
    pub gloss_rays: Option<u32>,
    /// Seed of every random choice
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Quality", hide_short_help = true)]
    pub seed: u64,

    /// Which scene of a glTF file, by name or number from 0
    #[arg(long, value_name = "NAME", help_heading = "Loading", hide_short_help = true)]
    pub scene: Option<String>,
    /// Which materials of a glTF file that offers variants, by name or number from 0 (`inspect` lists them)
    #[arg(long, value_name = "NAME", help_heading = "Loading", hide_short_help = true)]
    pub variant: Option<String>,
    /// Which moment of an animation.
    #[command(flatten)]
    pub moment: MomentArgs,
    /// Several frames, from A to before B (`A..=B`: with B), seen by one camera that has all of them in the picture; with
    /// --frame N, only that one of them
    ///
    /// Pictures go to STEM.0000.png and so on, or to a template with {frame:04}.
    #[arg(long, value_name = "A..B", value_parser = parse::frames, help_heading = "Animation", hide_short_help = true,
          conflicts_with_all = ["time", "turntable"])]
    pub frames: Option<parse::Frames>,
    /// N pictures from all around, about the up axis, the view or camera being the first; with I/N, only number I of
    /// them, from 0
    ///
    /// Pictures go to STEM.0000.png and so on, or to a template with {frame:04}. The lamps of a model without its own go
    /// with the camera, the studio around it stays; --background gives all pictures the same.
    #[arg(long, value_name = "N", value_parser = parse::turns, help_heading = "Camera", hide_short_help = true)]
    pub turntable: Option<parse::Turns>,
    /// What becomes of OBJ and PLY faces with more than three corners
    #[arg(long, value_name = "HOW", value_enum, default_value_t, help_heading = "Loading", hide_short_help = true)]
    pub polygons: PolygonsArg,
    /// Give meshes without normals smooth ones, but for edges at which faces lean by more than so many degrees, 30 when
    /// none are given
    #[arg(long, value_name = "DEGREES", value_parser = parse::lean, num_args = 0..=1, require_equals = true,
          default_missing_value = "30", help_heading = "Loading",
          hide_short_help = true)]
    pub smooth: Option<f64>,
    /// How wide points and lines are, units of the model [default: 1/256 of its diagonal, less where there are very many]
    #[arg(long, value_name = "WIDTH", value_parser = parse::above_zero, help_heading = "Loading",
          hide_short_help = true)]
    pub line_width: Option<f64>,
    /// Understand MTL files as exporters mean them, or to the letter
    #[arg(long, value_name = "HOW", value_enum, default_value_t, help_heading = "Loading", hide_short_help = true)]
    pub mtl: MtlArg,
    /// Read other files only below this folder [default: the model's folder]
    #[arg(long, value_name = "DIR", help_heading = "Loading", hide_short_help = true)]
    pub root: Option<PathBuf>,
    /// Refuse inputs that need more memory than this, such as 2G or 500M
    #[arg(long, value_name = "SIZE", value_parser = parse::bytes, help_heading = "Loading", hide_short_help = true)]
    pub max_memory: Option<u64>,
    /// Draw the background when the file holds nothing to draw
    #[arg(long, help_heading = "Loading", hide_short_help = true)]
    pub allow_empty: bool,
    /// Treat warnings as errors: no picture, exit code 3
    #[arg(long, help_heading = "Loading", hide_short_help = true)]
    pub strict: bool,

    /// Structure that finds what rays hit; the picture is the same with each. `auto` counts what some rays cost in
    /// `fast-octree` and `fast-bvh` and takes the better one
    #[arg(long, value_name = "NAME", value_parser = parse::accel_choice(), default_value = AccelChoice::AUTO,
          help_heading = "Structure", hide_short_help = true)]
    pub accel: AccelChoice,
    /// Test of rays against triangles; all but `exact` are there to be compared with it
    #[arg(long, value_name = "NAME", value_parser = parse::intersector(), default_value = IntersectorKind::Exact.name(),
          help_heading = "Structure", hide_short_help = true)]
    pub intersector: IntersectorKind,
    /// Parameters of the structure
    #[command(flatten)]
    pub params: AccelArgs,
    /// What becomes of meshes that are shown several times; the picture is the same. `auto` stores them once where that
    /// saves much memory, `keep` wherever it can, `flatten` never
    #[arg(long, value_name = "HOW", value_parser = parse::instancing(), default_value = Instancing::Auto.name(),
          help_heading = "Structure", hide_short_help = true)]
    pub instances: Instancing,
    /// Do the work of every feature, of those too that the scene lacks (`inspect` lists them); the picture is the same
    #[arg(long, help_heading = "Run", hide_short_help = true)]
    pub no_prune: bool,

    /// Threads to use; 0: all
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024), help_heading = "Run")]
    pub threads: u16,
    /// Print times and counts: a timed run, then a counted one
    #[arg(long, value_name = "FORMAT", value_enum, help_heading = "Run")]
    pub stats: Option<StatsFormat>,
    /// Render no picture: say what time, rays, tests and memory it would take and what error it would have, each with an
    /// interval, from about a hundredth of its pixels
    #[arg(long, help_heading = "Run", hide_short_help = true, conflicts_with_all = ["again", "heatmap"])]
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

/// Parameters of the structures; what is left out follows from the kind of structure.
#[derive(Debug, Clone, Args)]
pub(super) struct AccelArgs {
    /// Cells of the grid per shape [default: 0.25 where crowded cells are refined, 4 for `grid`]
    #[arg(long, value_name = "RATIO", help_heading = "Structure", hide_short_help = true)]
    pub grid_density: Option<f64>,
    /// Most cells of the grid along an axis [default: 256]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub grid_resolution: Option<u32>,
    /// Most octree levels below a cell of the grid [default: 8; 10 for `octree`]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub max_depth: Option<u32>,
    /// Cost of visiting a cell, counted in tests; cells are split when that should pay [default: 4]
    #[arg(long, value_name = "COST", help_heading = "Structure", hide_short_help = true)]
    pub step_cost: Option<f64>,
    /// Most shapes in a leaf [default: 2 for `bvh` and `grid-bvh`; octrees go by --step-cost]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub leaf_size: Option<u32>,
    /// Cells of the grid on each axis, such as 46x46x3, whatever the density
    #[arg(long, value_name = "XxYxZ", value_parser = parse::cells, help_heading = "Structure", hide_short_help = true)]
    pub grid_cells: Option<[u32; 3]>,
    /// Most references per shape in the cells of octrees [default: 12]
    #[arg(long, value_name = "N", help_heading = "Structure", hide_short_help = true)]
    pub max_references: Option<f64>,
    /// What puts a shape into a cell: its surface or its box (grids and octrees)
    #[arg(long, value_name = "WHAT", value_parser = parse::assign(), default_value = Assign::Surface.name(),
          help_heading = "Structure", hide_short_help = true)]
    pub assign: Assign,
    /// What a ray remembers of the shapes it met, so that they are tested once (grids and octrees)
    #[arg(long, value_name = "KIND", value_parser = parse::mailbox(), default_value = MailboxKind::Exact.name(),
          help_heading = "Structure", hide_short_help = true)]
    pub mailbox: MailboxKind,
}

/// From where the one picture of a command is seen.
#[derive(Debug, Clone, Args)]
pub(super) struct EyeArgs {
    /// Side of the model
    #[arg(long, value_name = "NAME", value_parser = parse::view(), help_heading = "Camera", conflicts_with_all = ["camera", "eye"])]
    pub view: Option<NamedView>,
    /// A camera of the file, by name or number from 0
    #[arg(long, value_name = "NAME", help_heading = "Camera", conflicts_with = "eye")]
    pub camera: Option<String>,
    /// Camera position
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vec3, help_heading = "Camera", allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// Point the camera looks at [default: middle of the model]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vec3, help_heading = "Camera", allow_hyphen_values = true, requires = "eye")]
    pub at: Option<[f64; 3]>,
}

/// What `meshray explain` was given.
#[derive(Debug, Clone, Args)]
pub(super) struct ExplainArgs {
    /// The model whose cost is explained.
    #[command(flatten)]
    pub model: ModelArgs,

    /// Columns and rows of the pictures that are counted
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "160x120", help_heading = "Picture")]
    pub size: (u32, u32),
    /// Bounces after the eye ray [default: what the scene needs]
    #[arg(long, value_name = "N", value_parser = parse::depth(), help_heading = "Picture")]
    pub depth: Option<u32>,
    /// From where it is seen.
    #[command(flatten)]
    pub eye: EyeArgs,

    /// Structure whose tests and steps are counted
    #[arg(long, value_name = "NAME", value_parser = parse::accel_choice(), default_value = AccelChoice::AUTO,
          help_heading = "Structure")]
    pub accel: AccelChoice,
    /// Parameters of the structure
    #[command(flatten)]
    pub params: AccelArgs,

    /// Print JSON (schema `meshray-explain/1`)
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Only warnings and errors on standard error
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,
}

/// What `meshray study` was given.
#[derive(Debug, Clone, Args)]
pub(super) struct StudyArgs {
    /// The model whose pictures are compared.
    #[command(flatten)]
    pub model: ModelArgs,

    /// Columns and rows of the pictures
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "256x192", help_heading = "Picture")]
    pub size: (u32, u32),
    /// From where it is seen.
    #[command(flatten)]
    pub eye: EyeArgs,
    /// How linear light becomes display colour [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = parse::tone_map(), help_heading = "Picture")]
    pub tone_map: Option<ToneMap>,
    /// Brighter (+) or darker (-) by this many stops
    #[arg(long, value_name = "STOPS", value_parser = parse::exposure, allow_hyphen_values = true, help_heading = "Picture")]
    pub exposure: Option<f32>,

    /// Renderings of each setting, with different random numbers: what differs between them is noise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=64), default_value_t = Study::DEFAULT.passes,
          help_heading = "Run")]
    pub passes: u32,
    /// Samples a pixel of the reference
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(64..=1 << 20),
          default_value_t = Study::DEFAULT.reference_samples, help_heading = "Run")]
    pub reference_samples: u32,
    /// Other numbers give other renderings
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Run")]
    pub seed: u64,
    /// Structure that the rays go through; all find the same hits
    #[arg(long, value_name = "NAME", value_parser = parse::accel_choice(), default_value = AccelChoice::AUTO, help_heading = "Run")]
    pub accel: AccelChoice,
    /// Threads that render [default: all]
    #[arg(long, value_name = "N", value_parser = parse::positive, help_heading = "Run")]
    pub threads: Option<usize>,
    /// Write a report too, after each setting; what kind the ending says: json, csv, html
    #[arg(long, value_name = "PATH", action = ArgAction::Append, help_heading = "Run")]
    pub report: Vec<PathBuf>,
    /// Only the table, warnings and errors
    #[arg(short, long, help_heading = "Run")]
    pub quiet: bool,
}

/// What `meshray generate` was given.
#[derive(Debug, Clone, Args)]
pub(super) struct GenerateArgs {
    /// Which kind of scene
    #[arg(value_name = "NAME", value_parser = parse::family())]
    pub family: Family,
    /// About how many triangles, up to 1e7
    #[arg(long, value_name = "N", default_value = "1e5", value_parser = parse::triangles)]
    pub size: usize,
    /// Where to write: a .glb (with materials and instances) or an .obj (triangles alone) [default: NAME-N.glb]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Only warnings and errors on standard error
    #[arg(short, long)]
    pub quiet: bool,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub messages: MessageFormat,
}

/// One model and how to load it.
#[derive(Debug, Clone, Args)]
pub(super) struct ModelArgs {
    /// A model or scene file; `-` reads standard input
    #[arg(value_name = "FILE")]
    pub input: PathBuf,
    /// How.
    #[command(flatten)]
    pub load: LoadArgs,
}

/// How to load a model that is not rendered.
#[derive(Debug, Clone, Args)]
pub(super) struct LoadArgs {
    /// Which scene of a glTF file, by name or number from 0
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Which materials of a glTF file that offers variants, by name or number from 0 (`inspect` lists them)
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Which moment of an animation.
    #[command(flatten)]
    pub moment: MomentArgs,
    /// What becomes of OBJ and PLY faces with more than three corners
    #[arg(long, value_name = "HOW", value_enum, default_value_t)]
    pub polygons: PolygonsArg,
    /// Give meshes without normals smooth ones, but for edges at which faces lean by more than so many degrees, 30 when
    /// none are given
    #[arg(long, value_name = "DEGREES", value_parser = parse::lean, num_args = 0..=1, require_equals = true,
          default_missing_value = "30")]
    pub smooth: Option<f64>,
    /// How wide points and lines are, units of the model [default: 1/256 of its diagonal, less where there are very many]
    #[arg(long, value_name = "WIDTH", value_parser = parse::above_zero)]
    pub line_width: Option<f64>,
    /// Understand MTL files as exporters mean them, or to the letter
    #[arg(long, value_name = "HOW", value_enum, default_value_t)]
    pub mtl: MtlArg,
    /// Axis that points up in the file
    #[arg(long, value_name = "AXIS", value_enum)]
    pub up: Option<Axis>,
    /// Read other files only below this folder [default: the model's folder]
    #[arg(long, value_name = "DIR")]
    pub root: Option<PathBuf>,
    /// Refuse inputs that need more memory than this, such as 2G or 500M
    #[arg(long, value_name = "SIZE", value_parser = parse::bytes)]
    pub max_memory: Option<u64>,
    /// How messages are written to standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub messages: MessageFormat,
}

/// Which moment of an animation is shown; without any of it, the rest pose.
#[derive(Debug, Clone, Args)]
pub(super) struct MomentArgs {
    /// Animation of a glTF file, by name or number from 0 [default: the first, where a time is given]
    #[arg(long, value_name = "NAME", help_heading = "Animation", hide_short_help = true)]
    pub animation: Option<String>,
    /// Pose at this time of the animation, such as 1.5, 1.5s or 250ms; past its end, the last one
    #[arg(long, value_name = "TIME", value_parser = parse::time, help_heading = "Animation", hide_short_help = true,
          conflicts_with = "frame")]
    pub time: Option<f64>,
    /// The same by a number from 0: the pose at N / FPS seconds. The camera is framed on that pose, so that for a
    /// sequence it has to be fixed, by --eye, --camera or --frames
    #[arg(long, value_name = "N", help_heading = "Animation", hide_short_help = true)]
    pub frame: Option<u32>,
    /// Frames a second [default: 24]
    #[arg(long, value_name = "FPS", value_parser = parse::above_zero, help_heading = "Animation", hide_short_help = true)]
    pub fps: Option<f64>,
}

/// Types of picture files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FileType {
    /// PNG, 8 or 16 bits
    Png,
    /// OpenEXR, linear
    Exr,
    /// JPEG
    Jpg,
    /// WebP, lossless
    Webp,
}

/// An up axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Axis {
    /// +Y, as glTF and most OBJ exporters
    Y,
    /// +Z, as CAD programs, printers and scanners
    Z,
}

/// `--polygons`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum PolygonsArg {
    /// Cut into triangles
    #[default]
    Cut,
    /// Planar ones stay whole
    Whole,
}

/// `--mtl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum MtlArg {
    /// Replace values that exporters write carelessly, with a warning each
    #[default]
    Guess,
    /// What the text says
    Literal,
}

/// `--stats`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum StatsFormat {
    /// For people
    Text,
    /// For programs (schema `meshray-stats/1`)
    Json,
}

/// `--messages`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum MessageFormat {
    /// For people
    #[default]
    Text,
    /// One JSON object a line
    Json,
}
