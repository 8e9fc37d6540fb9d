//! Arguments of `meshray bench`.

use super::super::args::{AccelArgs, EyeArgs, LoadArgs, MessageFormat, SimdArgs};
use super::super::parse;
use crate::accel::AccelKind;
use crate::bench::baseline::Limit;
use crate::bench::compare::Plan;
use crate::bench::sweep::Sweep;
use crate::generate::Family;
use clap::{ArgAction, Args};
use std::path::PathBuf;

/// Flags on how files are loaded; they do not apply to generated scenes.
const OF_FILES: [&str; 13] = [
    "up",
    "scene",
    "variant",
    "animation",
    "time",
    "frame",
    "fps",
    "polygons",
    "smooth",
    "line_width",
    "mtl",
    "root",
    "max_memory",
];

/// Flags of rays, structures and passes; published figures prescribe them.
const OF_RUNS: [&str; 23] = [
    "sizes",
    "accel",
    "grid_density",
    "grid_resolution",
    "max_depth",
    "step_cost",
    "leaf_size",
    "grid_cells",
    "max_references",
    "assign",
    "mailbox",
    "size",
    "samples",
    "depth",
    "view",
    "camera",
    "eye",
    "at",
    "rays",
    "passes",
    "threads",
    "heatmap_max",
    "compare",
];

/// What `meshray bench` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct BenchArgs {
    /// Models or scene files, one after the other
    #[arg(value_name = "FILE", required_unless_present_any = ["generate", "spd"])]
    pub inputs: Vec<PathBuf>,
    /// How to load them.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Format of the messages on standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub messages: MessageFormat,

    /// Measure how cost grows, on scenes of this family made in memory in the --sizes given
    #[arg(long, value_name = "NAME", value_parser = parse::named::<Family>(), conflicts_with = "inputs", conflicts_with_all = OF_FILES,
          help_heading = "Growth")]
    pub generate: Option<Family>,
    /// Triangles of the scenes, each made as near as its family can: a list 1e3,1e4; a range by powers of ten 1e3..1e6
    /// (including its end: 1e3..5e4 is 1e3, 1e4, 5e4); or a number of sizes at equal ratios, 1e3..1e6:7
    #[arg(long, value_name = "SIZES", value_parser = parse::sizes, default_value = "1e3..1e5", conflicts_with = "inputs",
          help_heading = "Growth")]
    pub sizes: parse::Sizes,

    /// Measure the structures with several values of this parameter, and with its default: a list grid-density=1,4; six
    /// values of a range grid-density=0.5..16 (by equal ratios; max-depth=0..10 by equal differences); or another number of
    /// them, grid-density=0.5..16:9. Parameters: grid-density, grid-resolution, max-depth, step-cost, leaf-size
    #[arg(long, value_name = "NAME=VALUES", conflicts_with_all = ["generate", "baseline"], help_heading = "Structure")]
    pub sweep: Option<Sweep>,
    /// Count on the NFF files of this folder what was published of the Standard Procedural Databases in 1999, and print both
    /// side by side: rays, grids, octrees. Goes with --slow-tests (of a structure), --seed and --report
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["inputs", "generate", "sweep", "baseline"],
          conflicts_with_all = OF_FILES.iter().filter(|flag| **flag != "max_memory"), conflicts_with_all = OF_RUNS,
          help_heading = "Published figures")]
    pub spd: Option<PathBuf>,

    /// Structures to compare, such as `grid-octree,fast-bvh` [default: all]
    #[arg(long, value_name = "NAMES", value_parser = parse::named::<AccelKind>(), value_delimiter = ',',
          help_heading = "Structure")]
    pub accel: Vec<AccelKind>,
    /// Parameters of the structures
    #[command(flatten)]
    pub params: AccelArgs,

    /// Columns and rows of the picture whose rays are recorded
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "256x192", help_heading = "Rays")]
    pub size: (u32, u32),
    /// Rays per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536), default_value_t = 1,
          help_heading = "Rays")]
    pub samples: u32,
    /// Bounces after the primary ray [default: what the scene needs]
    #[arg(long, value_name = "N", value_parser = parse::depth(), help_heading = "Rays")]
    pub depth: Option<u32>,
    /// From where it is seen.
    #[command(flatten)]
    pub eye: EyeArgs,
    /// Most rays of each class, up to 524288; from more an even sample is taken
    #[arg(long, value_name = "N", default_value_t = Plan::RAYS, value_parser = parse::rays, help_heading = "Rays")]
    pub rays: usize,
    /// Seed of the diffuse rays and of the samples
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Rays")]
    pub seed: u64,

    /// Timed passes; 0: counts only, which are the same on every machine
    #[arg(long, value_name = "N", default_value_t = Plan::PASSES, help_heading = "Run")]
    pub passes: usize,
    /// Threads that build and trace
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Run")]
    pub threads: u16,
    /// What the kernels may use.
    #[command(flatten)]
    pub simd: SimdArgs,
    /// Most ray/prim tests of each class that a slow structure may take in a pass; it gets as few rays as that allows, but at
    /// least 16
    #[arg(long, value_name = "N", default_value_t = Plan::SLOW_TESTS, help_heading = "Run")]
    pub slow_tests: u64,
    /// Also write a report, after each structure; its extension says the format: json, csv, md, html
    #[arg(long, value_name = "PATH", action = ArgAction::Append, help_heading = "Run")]
    pub report: Vec<PathBuf>,
    /// Tests of the brightest colour of an HTML report's heat maps [default: the most of any pixel]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Run")]
    pub heatmap_max: Option<u32>,
    /// Two structures whose difference of tests in each pixel an HTML report shows, such as grid,fast-bvh [default: the fast
    /// ones, or the first two]
    #[arg(long, value_name = "A,B", value_parser = parse::named::<AccelKind>(), value_delimiter = ',',
          conflicts_with = "sweep", help_heading = "Run")]
    pub compare: Vec<AccelKind>,
    /// An earlier JSON report of the same models and rays
    #[arg(long, value_name = "FILE", help_heading = "Run", requires = "fail_if")]
    pub baseline: Option<PathBuf>,
    /// Exit with code 1 when a count has changed since the baseline by more than this, such as 'n_it>+1%'
    #[arg(long, value_name = "LIMIT", value_delimiter = ',', help_heading = "Run", requires = "baseline")]
    pub fail_if: Vec<Limit>,
    /// Only the tables, warnings and errors
    #[arg(short, long, help_heading = "Run")]
    pub quiet: bool,
}

#[cfg(test)]
mod tests {
    use super::super::super::args::Cli;
    use clap::CommandFactory;

    #[test]
    fn no_flag_that_changes_nothing_can_be_typed_beside_generate_or_spd() {
        const OF_ALL: [&str; 6] = ["messages", "seed", "simd", "slow-tests", "report", "quiet"];
        let command = Cli::command();
        let bench = command.find_subcommand("bench").unwrap();
        let of_files = |heading: &str| ["Loading", "Animation"].contains(&heading);
        for (mode, more) in [("generate", &[][..]), ("spd", &["max-memory"])] {
            let mode = bench.get_arguments().find(|a| a.get_id() == mode).unwrap();
            let refuses = |one, other| bench.get_arg_conflicts_with(one).contains(&other);
            for flag in bench.get_opts().filter(|flag| *flag != mode) {
                let (name, heading) = (flag.get_long().unwrap(), flag.get_help_heading().unwrap_or_default());
                let is_used = OF_ALL.contains(&name) || more.contains(&name);
                // Flags that belong to a baseline require one.
                let is_used = is_used || name == "fail-if" || mode.get_id() == "generate" && !of_files(heading);
                let is_refused = refuses(mode, flag) || refuses(flag, mode);
                assert!(is_refused || is_used, "--{name} beside --{}", mode.get_id());
                assert!(!(is_refused && OF_ALL.contains(&name)), "--{name} beside --{}", mode.get_id());
            }
        }
    }
}
