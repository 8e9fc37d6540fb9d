//! Arguments of `meshray study`.

use super::super::parse;
use super::{EyeArgs, ModelArgs, SimdArgs};
use crate::accel::AccelChoice;
use crate::bench::study::Plan as Study;
use crate::image::ToneMap;
use clap::{ArgAction, Args};
use std::path::PathBuf;

/// What `meshray study` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct StudyArgs {
    /// The model whose pictures are compared.
    #[command(flatten)]
    pub model: ModelArgs,

    /// Columns and rows of the pictures
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "256x192", help_heading = "Picture")]
    pub size: (u32, u32),
    /// From where it is seen.
    #[command(flatten)]
    pub eye: EyeArgs,
    /// How linear light becomes display colour [default: neutral, or none where all is unlit]
    #[arg(long, value_name = "NAME", value_parser = parse::named::<ToneMap>(), help_heading = "Picture")]
    pub tone_map: Option<ToneMap>,
    /// Brighter (+) or darker (-) by this many stops
    #[arg(long, value_name = "STOPS", value_parser = parse::exposure, allow_hyphen_values = true, help_heading = "Picture")]
    pub exposure: Option<f32>,

    /// Renderings of each setting, with different random numbers: what differs between them is noise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=64), default_value_t = Study::DEFAULT.passes,
          help_heading = "Run")]
    pub passes: u32,
    /// Samples per pixel of the reference
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(64..=1 << 20),
          default_value_t = Study::DEFAULT.reference_samples, help_heading = "Run")]
    pub reference_samples: u32,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Run")]
    pub seed: u64,
    /// Structure that traces the rays; with the exact test all find the same hits
    #[arg(long, value_name = "NAME", value_parser = parse::named::<AccelChoice>(), default_value = AccelChoice::AUTO,
          help_heading = "Run")]
    pub accel: AccelChoice,
    /// Threads that render [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Run")]
    pub threads: Option<u16>,
    /// What the kernels may use.
    #[command(flatten)]
    pub simd: SimdArgs,
    /// Also write a report, after each setting; its extension says the format: json, csv, html
    #[arg(long, value_name = "PATH", action = ArgAction::Append, help_heading = "Run")]
    pub report: Vec<PathBuf>,
    /// Only the table, warnings and errors
    #[arg(short, long, help_heading = "Run")]
    pub quiet: bool,
}
