//! Command-line arguments: syntax only. Their joint meaning is decided in [`super::job`].

mod explain;
mod eye;
mod generate;
mod level;
mod model;
mod render;
mod structure;
mod study;
mod words;

pub(super) use explain::ExplainArgs;
pub(super) use eye::EyeArgs;
pub(super) use generate::GenerateArgs;
pub(super) use level::SimdArgs;
pub(super) use model::{LoadArgs, ModelArgs, MomentArgs};
pub(super) use render::RenderArgs;
pub(super) use structure::AccelArgs;
pub(super) use study::StudyArgs;
pub(super) use words::{FileType, MessageFormat, SpaceArg, StatsFormat};

use super::bench::BenchArgs;
use super::diff::DiffArgs;
use super::inspect::InspectArgs;
use super::trace::TraceArgs;
use super::verify::VerifyArgs;
use crate::math::simd::Level;
use clap::{Parser, Subcommand};

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
    /// List what a file holds: sizes, faults, materials, cameras, lights, extensions
    Inspect(InspectArgs),
    /// Judge how far a mesh's hits can be trusted: rays aimed at hard cases, against exact arithmetic
    Verify(VerifyArgs),
    /// Compare structures on a model: the same rays through each, whether the hits are equal, what they cost
    Bench(Box<BenchArgs>),
    /// Find out why a mesh costs what it costs: removes likely causes in turn and counts the saving
    Explain(Box<ExplainArgs>),
    /// Measure what each setting buys on a model: time against error, and which to use
    Study(Box<StudyArgs>),
    /// Follow one ray of a picture: what it visits, tests and hits, and all rays that it spawns
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

impl Command {
    /// Instruction set to which the kernels are restricted.
    pub(super) fn simd(&self) -> Option<Level> {
        match self {
            Self::Render(args) => args.simd.simd,
            Self::Verify(args) => args.simd.simd,
            Self::Bench(args) => args.simd.simd,
            Self::Study(args) => args.simd.simd,
            _ => None,
        }
    }
}

const RENDER_EXAMPLES: &str = "\
Examples:
  meshray render ship.glb                            writes ship.png
  meshray render *.obj -o \"thumbs/{stem}.png\" --size 256x256
  meshray render ship.glb --view front --view iso -o \"{stem}-{view}.exr\" --layers
  meshray render ship.glb --time 1.5                 a moment of its first animation
  meshray render ship.glb --turntable 36 -o \"turn/{frame:04}.png\"
  meshray render ship.glb --heatmap tests            writes ship.png and ship-tests.png
  curl -s https://example.org/ship.glb | meshray render - -o - > ship.png
  meshray render --again ship.png                    renders that picture again";
