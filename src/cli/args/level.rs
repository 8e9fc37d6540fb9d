//! Argument for the instruction set of the kernels.

use super::super::parse;
use crate::math::simd::Level;
use clap::Args;

/// What the kernels may use of the machine.
#[derive(Debug, Clone, Copy, Args)]
pub(in crate::cli) struct SimdArgs {
    /// Instruction set of the kernels, if the machine has it: portable, avx2, avx512, neon; hits are the same with each
    /// [default: the fastest]
    #[arg(long, value_name = "LEVEL", value_parser = parse::level, help_heading = "Run", hide_short_help = true)]
    pub simd: Option<Level>,
}
