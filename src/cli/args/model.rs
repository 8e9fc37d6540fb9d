//! Arguments for a model and how it is loaded.

use super::super::parse;
use super::MessageFormat;
use crate::load::{Limits, LoadOptions, MtlMode, Polygons};
use crate::scene::UpAxis;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// One model and how to load it.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct ModelArgs {
    /// A model or scene file, or a zip archive with a model; `-` reads standard input
    #[arg(value_name = "FILE")]
    pub input: PathBuf,
    /// How.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Format of the messages on standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub messages: MessageFormat,
}

/// How to load a model.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct LoadArgs {
    /// Axis that points up in the file [default: what the file says, or a guess]
    #[arg(long, value_name = "AXIS", value_enum, help_heading = "Loading")]
    pub up: Option<Axis>,
    /// Scene of a glTF file, by name or number from 0
    #[arg(long, value_name = "NAME", help_heading = "Loading", hide_short_help = true)]
    pub scene: Option<String>,
    /// Material variant of a glTF file that offers some, by name or number from 0 (`inspect` lists them)
    #[arg(long, value_name = "NAME", help_heading = "Loading", hide_short_help = true)]
    pub variant: Option<String>,
    /// Which moment of an animation.
    #[command(flatten)]
    pub moment: MomentArgs,
    /// How to treat OBJ, PLY and NFF faces with more than three corners
    #[arg(long, value_name = "HOW", value_enum, default_value_t, help_heading = "Loading", hide_short_help = true)]
    pub polygons: PolygonsArg,
    /// Give meshes without normals smooth ones, except at edges where normals of faces differ by more than so many degrees,
    /// 30 unless given
    #[arg(long, value_name = "DEGREES", value_parser = parse::lean, num_args = 0..=1, require_equals = true,
          default_missing_value = "30", help_heading = "Loading", hide_short_help = true)]
    pub smooth: Option<f64>,
    /// Width of points and lines, in units of the model [default: 1/256 of its diagonal, less where there are very many]
    #[arg(long, value_name = "WIDTH", value_parser = parse::above_zero, help_heading = "Loading",
          hide_short_help = true)]
    pub line_width: Option<f64>,
    /// Read MTL files as exporters mean them, or to the letter
    #[arg(long, value_name = "HOW", value_enum, default_value_t, help_heading = "Loading", hide_short_help = true)]
    pub mtl: MtlArg,
    /// Read other files only below this folder [default: the model's folder; for an archive always the archive]
    #[arg(long, value_name = "DIR", help_heading = "Loading", hide_short_help = true)]
    pub root: Option<PathBuf>,
    /// Refuse inputs that take more memory than this to load, such as 2G or 500M; structures built from them come on top
    #[arg(long, value_name = "SIZE", value_parser = parse::bytes, help_heading = "Loading", hide_short_help = true)]
    pub max_memory: Option<u64>,
}

impl LoadArgs {
    /// Options of the loaders, except for the moment, which differs within a sequence.
    pub(in crate::cli) fn options(&self) -> LoadOptions {
        LoadOptions {
            root: self.root.clone(),
            limits: self.limits(),
            polygons: self.polygons.into(),
            mtl: self.mtl.into(),
            smooth: self.smooth,
            wire_widths: self.line_width.map(|width| [width; 2]),
            scene: self.scene.clone(),
            variant: self.variant.clone(),
            up: self.up.map(Into::into),
            moment: None,
            animations_before: None,
            without_pictures: false,
        }
    }

    /// Default limits, none of them above `--max-memory`.
    pub(in crate::cli) fn limits(&self) -> Limits {
        let usual = Limits::default();
        let Some(memory) = self.max_memory else { return usual };
        Limits { memory, file: usual.file.min(memory), image_pixels: usual.image_pixels.min(memory / 4) }
    }
}

/// Which moment of an animation is shown; without any of it, the rest pose.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct MomentArgs {
    /// Animation of a glTF file, by name or number from 0 [default: the first, where a time is given]
    #[arg(long, value_name = "NAME", help_heading = "Animation", hide_short_help = true)]
    pub animation: Option<String>,
    /// Pose at this time of the animation, such as 1.5, 1.5s or 250ms; past its end, the last one
    #[arg(long, value_name = "TIME", value_parser = parse::time, help_heading = "Animation", hide_short_help = true,
          conflicts_with = "frame")]
    pub time: Option<f64>,
    /// Pose by frame number from 0, at N / FPS seconds. The camera is framed on that pose; to fix it for a sequence use
    /// --eye, --camera or --frames
    #[arg(long, value_name = "N", help_heading = "Animation", hide_short_help = true)]
    pub frame: Option<u32>,
    /// Frames per second [default: 24]
    #[arg(long, value_name = "FPS", value_parser = parse::above_zero, help_heading = "Animation", hide_short_help = true)]
    pub fps: Option<f64>,
}

/// An up axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Axis {
    /// +Y, as glTF and most OBJ exporters
    Y,
    /// +Z, as CAD programs, printers and scanners
    Z,
}

/// `--polygons`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum PolygonsArg {
    /// Cut into triangles
    #[default]
    Cut,
    /// Keep planar ones of up to 256 corners whole
    Whole,
}

/// `--mtl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum MtlArg {
    /// Replace values that exporters write carelessly, with a warning each
    #[default]
    Guess,
    /// Take the text at its word
    Literal,
}

impl From<Axis> for UpAxis {
    fn from(typed: Axis) -> Self {
        match typed {
            Axis::Y => Self::Y,
            Axis::Z => Self::Z,
        }
    }
}

impl From<PolygonsArg> for Polygons {
    fn from(typed: PolygonsArg) -> Self {
        match typed {
            PolygonsArg::Cut => Self::Cut,
            PolygonsArg::Whole => Self::Whole,
        }
    }
}

impl From<MtlArg> for MtlMode {
    fn from(typed: MtlArg) -> Self {
        match typed {
            MtlArg::Guess => Self::Guess,
            MtlArg::Literal => Self::Literal,
        }
    }
}
