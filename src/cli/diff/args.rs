//! Arguments of `meshray diff`.

use super::super::args::{MessageFormat, SpaceArg};
use super::super::parse;
use super::limit::Limit;
use crate::image::ToneMap;
use crate::image::diff::flip::PIXELS_PER_DEGREE;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// What `meshray diff` was given.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct DiffArgs {
    /// Expected picture: a png, exr, jpg or webp
    #[arg(value_name = "EXPECTED")]
    pub expected: PathBuf,
    /// Picture to compare with it, of the same size
    #[arg(value_name = "ACTUAL")]
    pub actual: PathBuf,

    /// Which values are compared [default: linear for two EXR files, else display]
    #[arg(long, value_name = "SPACE", value_enum, help_heading = "Comparison")]
    pub space: Option<SpaceArg>,
    /// How the linear light of EXR files becomes display colour, where that is compared [default: none]
    #[arg(long, value_name = "NAME", value_parser = parse::named::<ToneMap>(), help_heading = "Comparison")]
    pub tone_map: Option<ToneMap>,
    /// Stops by which EXR files are brightened (+) or darkened (-) where display colour is compared
    #[arg(long, value_name = "STOPS", value_parser = parse::exposure, allow_hyphen_values = true, help_heading = "Comparison")]
    pub exposure: Option<f32>,
    /// Count pixels with a channel that differs by more than this
    #[arg(long, value_name = "VALUE", value_parser = parse::not_negative, default_value_t = 0.0, help_heading = "Comparison")]
    pub threshold: f64,
    /// Pixels per degree of the visual field, for FLIP; the default is a 3840-column screen, 0.7 m wide, seen from 0.7 m
    #[arg(long, value_name = "N", value_parser = parse::pixels_per_degree, default_value_t = (PIXELS_PER_DEGREE * 100.0).round() / 100.0,
          help_heading = "Comparison")]
    pub pixels_per_degree: f64,
    /// Exit with code 1 when a figure is beyond a limit, such as 'rmse>0.01,flip>0.05,psnr<40'; 'bias<-0.01,bias>0.01': when
    /// it is darker or brighter than that; 'layer-max>0': when a layer of two EXR files differs, or only one of them has it
    #[arg(long, value_name = "LIMIT", value_delimiter = ',', help_heading = "Comparison")]
    pub fail_if: Vec<Limit>,

    /// Write a heat map of the difference at each pixel, a PNG
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// What the heat map shows
    #[arg(long, value_name = "WHAT", value_enum, default_value_t, requires = "output", help_heading = "Output")]
    pub show: Show,
    /// Value of the brightest colour of the heat map [default: the most of any pixel]
    #[arg(long, value_name = "VALUE", value_parser = parse::above_zero, requires = "output", help_heading = "Output")]
    pub heatmap_max: Option<f64>,
    /// Write expected, difference × 8 and actual side by side, a PNG
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub side_by_side: Option<PathBuf>,
    /// Print JSON (schema `meshray-diff/1`)
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Format of the messages on standard error
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t, help_heading = "Output")]
    pub messages: MessageFormat,
}

/// `--show`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Show {
    /// FLIP, how different it looks, 0 to 1
    #[default]
    Flip,
    /// The largest difference of a channel
    Channel,
}
