//! Arguments of `meshray trace`.

use super::super::args::{AccelArgs, EyeArgs, ModelArgs};
use super::super::parse;
use crate::accel::AccelChoice;
use clap::Args;
use std::path::PathBuf;

/// What `meshray trace` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct TraceArgs {
    /// The model that the ray goes through.
    #[command(flatten)]
    pub model: ModelArgs,

    /// Column and row of the pixel, from 0 at the top left
    #[arg(long, value_name = "X,Y", value_parser = parse::pixel, allow_hyphen_values = true, help_heading = "Ray")]
    pub pixel: (u32, u32),
    /// Samples per pixel; a single one goes through its centre
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536), default_value_t = 1,
          help_heading = "Ray")]
    pub samples: u32,
    /// Sample to follow, from 0
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Ray")]
    pub sample: u32,
    /// Bounces after the primary ray [default: what the scene needs]
    #[arg(long, value_name = "N", value_parser = parse::depth(), help_heading = "Ray")]
    pub depth: Option<u32>,
    /// Weight below which a branch of the ray tree ends [default: 0.001953125]
    #[arg(long, value_name = "WEIGHT", value_parser = parse::cutoff, help_heading = "Ray")]
    pub cutoff: Option<f32>,

    /// Columns and rows of the picture; one number is a square [default: 1024x768]
    #[arg(long, value_name = "WxH", value_parser = parse::size, help_heading = "Camera")]
    pub size: Option<(u32, u32)>,
    /// From where it is seen.
    #[command(flatten)]
    pub eye: EyeArgs,
    /// Direction that is up in the picture [default: the up axis]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::direction, help_heading = "Camera", allow_hyphen_values = true, requires = "eye")]
    pub up_vector: Option<[f64; 3]>,
    /// Vertical field of view, degrees
    #[arg(long, value_name = "DEGREES", value_parser = parse::fov, help_heading = "Camera")]
    pub fov: Option<f64>,
    /// Orthographic camera that sees HEIGHT units [default: what the model needs]
    #[arg(long, value_name = "HEIGHT", num_args = 0..=1, default_missing_value = "auto", value_parser = parse::ortho,
          require_equals = true, conflicts_with = "fov", help_heading = "Camera")]
    pub ortho: Option<parse::Ortho>,

    /// Structure that traces the ray; all find the same hits
    #[arg(long, value_name = "NAME", value_parser = parse::named::<AccelChoice>(), default_value = AccelChoice::AUTO,
          help_heading = "Structure")]
    pub accel: AccelChoice,
    /// Parameters of the structure
    #[command(flatten)]
    pub params: AccelArgs,

    /// List the steps of every ray, not of the eye's alone
    #[arg(long, help_heading = "Output")]
    pub all_steps: bool,
    /// Print JSON (schema `meshray-trace/1`)
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Draw the ray, too, and every node and cell that it visits: a PNG of the scene cut open along it
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Only warnings and errors on standard error
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,
}
