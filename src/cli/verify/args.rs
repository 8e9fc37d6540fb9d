//! Arguments of `meshray verify`.

use super::super::args::{ModelArgs, SimdArgs};
use super::super::parse;
use crate::bench::verify::Plan;
use clap::Args;
use std::path::PathBuf;

/// What `meshray verify` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct VerifyArgs {
    /// What to judge.
    #[command(flatten)]
    pub model: ModelArgs,
    /// Rays of each kind for each position and scale of the mesh
    #[arg(long, value_name = "N", default_value_t = Plan::DEFAULT.rays, value_parser = parse::positive)]
    pub rays: usize,
    /// Seed of the rays
    #[arg(long, value_name = "N", default_value_t = Plan::DEFAULT.seed)]
    pub seed: u64,
    /// What the kernels may use.
    #[command(flatten)]
    pub simd: SimdArgs,
    /// Print JSON (schema `meshray-verify/1`)
    #[arg(long)]
    pub json: bool,
    /// Write an HTML page that plots the tests' speed against their wrong answers
    #[arg(long, value_name = "FILE.html")]
    pub plot: Option<PathBuf>,
    /// Only warnings and errors on standard error
    #[arg(short, long)]
    pub quiet: bool,
}
