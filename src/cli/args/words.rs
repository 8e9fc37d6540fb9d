//! Keywords that name kinds of files, messages and colour spaces.

use crate::image::diff::Space;
use clap::ValueEnum;

/// Types of picture files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum FileType {
    /// PNG, 8 or 16 bits
    Png,
    /// OpenEXR, linear
    Exr,
    /// JPEG
    Jpg,
    /// WebP, lossless
    Webp,
}

/// `--stats`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum StatsFormat {
    /// For people
    Text,
    /// For programs (schema `meshray-stats/1`)
    Json,
}

/// `--messages`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum MessageFormat {
    /// For people
    #[default]
    Text,
    /// One JSON object per line
    Json,
}

/// `--space` and `--error-space`: what errors are counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum SpaceArg {
    /// sRGB codes, 0 to 1
    Display,
    /// Linear light
    Linear,
}

impl From<SpaceArg> for Space {
    fn from(space: SpaceArg) -> Self {
        match space {
            SpaceArg::Display => Self::Display,
            SpaceArg::Linear => Self::Linear,
        }
    }
}
