//! Files -> [`Scene`] + warnings. The kind of file is found by content, then by extension.
//!
//! Files a user gives are not trusted: other files they name are read only below [`LoadOptions::root`], sizes are
//! checked before memory is taken, and whatever is broken ends in a [`LoadError`] or in a warning, never in a panic.

pub mod diagnostic;
pub mod gltf;
pub mod limits;
pub mod obj;
pub mod paths;
pub mod scene_file;
pub mod texture;

pub use diagnostic::{Diagnostic, LoadError, Warnings};
pub use limits::Limits;

use crate::scene::{Scene, UpAxis};
use std::path::{Path, PathBuf};

/// How to load.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Files are read only below this folder; `None`: the folder of the model.
    pub root: Option<PathBuf>,
    /// Bounds on memory and sizes.
    pub limits: Limits,
    /// What becomes of OBJ faces with more than three corners.
    pub polygons: Polygons,
    /// How MTL text is understood.
    pub mtl: MtlMode,
    /// Which scene of a glTF file: an index, or a name; `None`: the default scene.
    pub scene: Option<String>,
    /// Overrides the up axis.
    pub up: Option<UpAxis>,
}

/// What becomes of OBJ faces with more than three corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polygons {
    /// Cut into triangles by exact ear clipping.
    #[default]
    Cut,
    /// Planar ones stay whole.
    Whole,
}

/// How MTL text is understood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MtlMode {
    /// What exporters mean: carelessly written defaults are replaced, each with a counted warning.
    #[default]
    Guess,
    /// What the text says.
    Literal,
}

/// What a file gave.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What could not be drawn as the file says.
    pub warnings: Vec<Diagnostic>,
    /// Facts for reports.
    pub facts: Facts,
}

/// What loading found out besides the scene.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// `glTF 2.0 (binary)`, `Wavefront OBJ`, `meshray scene`.
    pub format: String,
    /// Program that wrote the file, if it says.
    pub generator: String,
    /// Faces of the file that became triangles or polygons.
    pub faces: u64,
    /// Faces dropped, by reason: (reason, count).
    pub dropped: Vec<(String, u64)>,
    /// Points and lines skipped.
    pub points_and_lines: u64,
    /// glTF extensions used: (name, required by the file, supported by us).
    pub extensions: Vec<(String, bool, bool)>,
    /// Names of the scenes in the file; the loaded one is `scene_index`.
    pub scenes: Vec<String>,
    /// Which scene was loaded.
    pub scene_index: usize,
    /// Why the up axis was chosen, when it was a guess.
    pub up_reason: Option<String>,
    /// Largest displacement of a vertex by rounding to `f32`, world units.
    pub max_rounding: f64,
    /// Every file read: the model first, then buffers, images, MTLs. For the input hash and `inspect`.
    pub files: Vec<PathBuf>,
    /// xxh3-128 of the bytes of all files in `files`, in that order.
    pub hash: u128,
}

/// Loads a model or scene file.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let _ = (path, options);
    Err(Diagnostic::new("unsupported-format", path, "", "no loader yet").into())
}
