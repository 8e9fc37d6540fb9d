//! Arguments of `meshray generate`.

use super::super::parse;
use super::MessageFormat;
use crate::generate::Family;
use clap::Args;
use std::path::PathBuf;

/// What `meshray generate` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct GenerateArgs {
    /// Which kind of scene
    #[arg(value_name = "NAME", value_parser = parse::named::<Family>())]
    pub family: Family,
    /// About how many triangles, up to 1e7; families that grow in steps take the nearest one
    #[arg(long, value_name = "N", default_value = "1e5", value_parser = parse::triangles)]
    pub size: usize,
    /// Where to write: a .glb (with materials and instances) or an .obj (triangles alone) [default: NAME-N.glb]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Only warnings and errors on standard error
    #[arg(short, long)]
    pub quiet: bool,
    /// Format of the messages on standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub messages: MessageFormat,
}
