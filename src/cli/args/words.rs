//! Kinds of files and messages, by the words that name them.

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
    /// One JSON object a line
    Json,
}
