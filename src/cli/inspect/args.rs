//! Arguments of `meshray inspect`.

use super::super::args::ModelArgs;
use clap::Args;

/// What `meshray inspect` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct InspectArgs {
    /// What to look into.
    #[command(flatten)]
    pub model: ModelArgs,
    /// Print JSON (schema `meshray-inspect/1`)
    #[arg(long)]
    pub json: bool,
    /// Exit with code 3 when there are warnings
    #[arg(long)]
    pub strict: bool,
}
