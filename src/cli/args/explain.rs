//! Arguments of `meshray explain`.

use super::super::parse;
use super::{AccelArgs, EyeArgs, ModelArgs};
use crate::accel::AccelChoice;
use clap::Args;

/// What `meshray explain` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct ExplainArgs {
    /// The model whose cost is explained.
    #[command(flatten)]
    pub model: ModelArgs,

    /// Columns and rows of the pictures that are counted
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "160x120", help_heading = "Picture")]
    pub size: (u32, u32),
    /// Bounces after the primary ray [default: what the scene needs]
    #[arg(long, value_name = "N", value_parser = parse::depth(), help_heading = "Picture")]
    pub depth: Option<u32>,
    /// From where it is seen.
    #[command(flatten)]
    pub eye: EyeArgs,

    /// Structure whose tests and steps are counted
    #[arg(long, value_name = "NAME", value_parser = parse::named::<AccelChoice>(), default_value = AccelChoice::AUTO,
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
