//! Camera arguments of commands that draw one picture.

use super::super::parse;
use crate::scene::framing::NamedView;
use clap::Args;

/// From where the one picture of a command is seen.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct EyeArgs {
    /// Side of the model
    #[arg(long, value_name = "NAME", value_parser = parse::named::<NamedView>(), help_heading = "Camera",
          conflicts_with_all = ["camera", "eye"])]
    pub view: Option<NamedView>,
    /// A camera of the file, by name or number from 0
    #[arg(long, value_name = "NAME", help_heading = "Camera", conflicts_with = "eye")]
    pub camera: Option<String>,
    /// Camera position
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vec3, help_heading = "Camera", allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// Point the camera looks at [default: middle of the model]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vec3, help_heading = "Camera", allow_hyphen_values = true, requires = "eye")]
    pub at: Option<[f64; 3]>,
}
