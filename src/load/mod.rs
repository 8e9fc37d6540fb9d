//! Files -> [`Scene`] + warnings. The kind of file is found by content, then by extension.
//!
//! Files a user gives are not trusted: other files they name are read only below [`LoadOptions::root`], sizes are
//! checked before memory is taken, and whatever is broken ends in a [`LoadError`] or in a warning, never in a panic.

pub mod archive;
pub(crate) mod choice;
mod detect;
pub mod diagnostic;
mod finder;
mod geometry;
pub mod gltf;
mod ktx;
pub mod limits;
mod mtl;
pub mod nff;
mod number;
pub mod obj;
pub mod panorama;
pub mod paths;
mod place;
pub mod ply;
pub mod scene_file;
mod smooth_normals;
pub mod stl;
pub mod suggest;
pub mod tangents;
mod text;
pub mod texture;
mod whole;
pub mod wires;

pub use detect::is_called_a_model;
pub use diagnostic::{Diagnostic, LoadError, Warnings};
pub use limits::Limits;
pub use wires::WireFacts;

use archive::Archive;
use limits::{Budget, OverBudget};
use paths::FileRead;

use crate::scene::{Bitmap, Scene, UpAxis};
use crate::stopwatch::{Spent, Stopwatch};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How to load.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Files are read only below this folder; `None`: the folder of the model. What a model in an archive names is read from
    /// that archive alone.
    pub root: Option<PathBuf>,
    /// Bounds on memory and sizes.
    pub limits: Limits,
    /// What becomes of OBJ, PLY and NFF faces with more than three corners.
    pub polygons: Polygons,
    /// How MTL text is understood.
    pub mtl: MtlMode,
    /// Which scene of a glTF file: an index, or a name; `None`: the default scene. Refused where the file has none.
    pub scene: Option<String>,
    /// Which variant of materials of a glTF file (KHR_materials_variants): a name, or a number from 0; `None`: the
    /// materials that primitives name themselves. Refused where the file has none.
    pub variant: Option<String>,
    /// Overrides the up axis.
    pub up: Option<UpAxis>,
    /// Which moment of an animation of a glTF file is shown; `None`: the rest pose.
    pub moment: Option<Moment>,
    /// For one of several models that are shown together: how many animations those before it have. Numbers of animations
    /// count on from there, and one that it lacks may be another's: it is at rest then.
    pub animations_before: Option<usize>,
    /// Gives meshes without normals smooth ones, but for edges at which faces lean by more than so many radians; `None`:
    /// their faces are flat.
    pub smooth: Option<f64>,
    /// How wide points and lines are, world units; `None`: 1/256 of what is drawn, or less where there are very many.
    pub wire_widths: Option<[f64; 2]>,
    /// Leaves pictures out: for whoever needs the geometry of a glTF file alone.
    pub without_pictures: bool,
}

/// A moment of an animation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// Which animation: an index, or a name; `None`: the first.
    pub animation: Option<String>,
    /// Seconds from its start; finite. Before the first and after the last key those count.
    pub time: f64,
}

/// What becomes of OBJ, PLY and NFF faces with more than three corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polygons {
    /// Cut into triangles by exact ear clipping.
    #[default]
    Cut,
    /// Planar ones of up to [`Polygons::MOST_CORNERS`] stay whole.
    Whole,
}

impl Polygons {
    /// Corners of a face that may stay whole: every test of it looks at all of them.
    pub const MOST_CORNERS: usize = 256;

    /// Whether a face of so many corners is kept whole if it is planar.
    pub(crate) fn keeps(self, corners: usize) -> bool {
        self == Self::Whole && (4..=Self::MOST_CORNERS).contains(&corners)
    }
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
    /// `glTF 2.0 (binary)`, `Wavefront OBJ`, `NFF`, `PLY (ascii)`, `STL (binary)`, `meshray scene`.
    pub format: String,
    /// Program that wrote the file, if it says.
    pub generator: String,
    /// Faces of the file that became triangles or polygons.
    pub faces: u64,
    /// Faces dropped, by reason: (reason, count).
    pub dropped: Vec<(String, u64)>,
    /// Points and lines of the file.
    pub wires: WireFacts,
    /// Animations in the file.
    pub animations: Vec<AnimationFacts>,
    /// Which of them is shown, and when, seconds from its start; `None`: the rest pose. Of several models the first that
    /// is not at rest counts.
    pub shown: Option<(usize, f64)>,
    /// Whether that changes materials, or which nodes are visible: other moments may show pictures that this one does not.
    pub changes_materials: bool,
    /// glTF extensions that the file names, each once.
    pub extensions: Vec<ExtensionFacts>,
    /// Names of the scenes in the file; the loaded one is `scene_index`.
    pub scenes: Vec<String>,
    /// Which scene was loaded.
    pub scene_index: usize,
    /// Names of the variants of materials in the file.
    pub variants: Vec<String>,
    /// Which of them was loaded, if one was asked for.
    pub variant: Option<usize>,
    /// Why the up axis was chosen, when it was a guess.
    pub up_reason: Option<String>,
    /// Largest displacement of a vertex by rounding to `f32` while loading, world units; placing moves it once more
    /// ([`World::rounding`](crate::render::World::rounding)).
    pub max_rounding: f64,
    /// Every file read: the model first, then buffers, images, MTLs. For the input hash and `inspect`.
    pub files: Vec<FileRead>,
    /// xxh3-128 of the xxh3-128 hashes of all files in `files`, in that order (see [`paths::Resolver::finish`]); of the
    /// files of a model that a scene file shows the first counts with the hash of the model, and the others with 0.
    pub hash: u128,
    /// Whether a file was looked for where it was not: in vain, or before it was found elsewhere.
    pub gaps: bool,
    /// Bytes of memory that the scene takes once it is loaded, with room for smaller copies of its pictures; loading itself takes
    /// more for a while.
    pub kept: u64,
    /// Time that reading the bytes of all files took, of the thread that did it.
    pub reading: Spent,
    /// Time that decoding pictures took: from the first to the last, and of all threads together.
    pub decoding: Spent,
}

impl Facts {
    /// Adds the animations of one more model of several.
    pub(crate) fn add_animations(&mut self, more: &Self) {
        let before = self.animations.len();
        self.shown = self.shown.or(more.shown.map(|(number, time)| (before + number, time)));
        self.changes_materials |= more.changes_materials;
        self.animations.extend_from_slice(&more.animations);
    }
}

/// An animation of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnimationFacts {
    /// Its name; empty if it has none.
    pub name: String,
    /// When its last key is, seconds from its start.
    pub seconds: f64,
    /// How many properties of nodes it changes.
    pub channels: usize,
}

/// An extension of glTF that a file names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExtensionFacts {
    /// Its name, such as `KHR_materials_volume`.
    pub name: String,
    /// Whether the file says that it cannot be shown without.
    pub required: bool,
    /// Whether it is drawn as it says.
    pub supported: bool,
}

/// A file in memory, with the name it was read from.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Where it came from; a name without a folder such as `-` for standard input.
    pub path: PathBuf,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The archive that it lies in, if it does.
    pub within: Option<Arc<Archive>>,
    /// How it was chosen from that, where that has to be told.
    pub note: Option<Diagnostic>,
}

impl Source {
    /// One that lies in no archive.
    pub fn new(path: PathBuf, bytes: Vec<u8>) -> Self {
        Self { path, bytes, within: None, note: None }
    }

    /// Whether it came from standard input.
    pub fn is_stdin(&self) -> bool {
        self.path == Path::new("-")
    }
}

/// Loads a model or scene file, or the only model of a zip archive. One of several in an archive is named as in a folder:
/// `ships.zip/tug/tug.gltf`.
///
/// # Errors
/// [`LoadError::Read`] when the file itself cannot be read, [`LoadError::Input`] when what it holds cannot be drawn.
/// A file that is right but holds nothing to draw is `Ok` with an empty scene.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let watch = Stopwatch::of_this_thread();
    let source = read_source(path, &options.limits)?;
    let reading = watch.read();
    let mut loaded = load_source(&source, options)?;
    loaded.facts.reading += reading;
    check_wishes(&loaded, path, options)?;
    check_moment(&mut loaded, path, options)?;
    Ok(loaded)
}

/// Loads a model or scene from memory. Files it names are looked up beside `name`, which need not be there; for `-` in
/// [`LoadOptions::root`]. A name without a folder stands for one in the current folder: where nothing is to be read but these
/// bytes, the root is an empty folder and the name `-`. A zip archive holds all files of its model, and no others are read.
pub fn load_bytes(name: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut loaded = load_source(&in_memory(name, bytes, &options.limits)?, options)?;
    check_wishes(&loaded, name, options)?;
    check_moment(&mut loaded, name, options)?;
    Ok(loaded)
}

/// Refuses a scene or a variant that is asked for where a file has no such things.
fn check_wishes(loaded: &Loaded, file: &Path, options: &LoadOptions) -> Result<(), LoadError> {
    let refuse = |code, word: &str, wish: &Option<String>, names: &[String]| match wish {
        Some(name) if names.is_empty() => {
            let fault = Diagnostic::new(code, file, "", format!("there is no {word} '{name}'"));
            Err(LoadError::from(fault.remedy("the file has none")))
        }
        _ => Ok(()),
    };
    refuse("scene-none", "scene", &options.scene, &loaded.facts.scenes)?;
    refuse("variant-none", "variant", &options.variant, &loaded.facts.variants)
}

/// A moment of what has no animations: refused when one is named, else a warning; and an animation that none of several
/// models has. Parts of a whole are looked at together.
pub(crate) fn check_moment(loaded: &mut Loaded, file: &Path, options: &LoadOptions) -> Result<(), LoadError> {
    let Some(moment) = options.moment.as_ref().filter(|_| options.animations_before.is_none()) else { return Ok(()) };
    if !loaded.facts.animations.is_empty() {
        return Ok(choice::check_animation(&loaded.facts, moment, file)?);
    }
    if let Some(name) = &moment.animation {
        let fault = Diagnostic::new("animation-none", file, "", format!("there is no animation '{name}'"));
        return Err(fault.remedy("the file has none").into());
    }
    let warning = Diagnostic::new("animation-none", file, "", "the file has no animation");
    loaded.warnings.push(warning.remedy("drawn at rest, whatever the time"));
    Ok(())
}

fn load_source(source: &Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    if let Some(root) = options.root.as_ref().filter(|root| !root.is_dir()) {
        let fault = Diagnostic::new("root-missing", root.as_path(), "", "there is no such folder");
        return Err(fault.remedy("name one that is there with --root").into());
    }
    let mut budget = Budget::new(&options.limits);
    let mut loaded = load_within(source, options, &mut budget)?;
    loaded.facts.kept = kept(&loaded.scene);
    check_prims(&loaded.scene, &source.path)?;
    Ok(loaded)
}

/// Bytes that a scene takes once it is loaded.
fn kept(scene: &Scene) -> u64 {
    let pixels = |bitmap: &Bitmap| u64::from(bitmap.width) * u64::from(bitmap.height);
    let copies: u64 = scene.bitmaps.iter().map(|bitmap| texture::smaller_copies(pixels(bitmap))).sum();
    let around = scene.panorama.as_ref().map_or(0, |panorama| panorama.texels.len() as u64 * panorama::PER_PIXEL);
    scene.bytes() + copies + around
}

/// Refuses a scene that shows more prims than there are numbers for: a small file can show a large mesh in many places.
pub(crate) fn check_prims(scene: &Scene, file: &Path) -> Result<(), LoadError> {
    let (shown, most) = (scene.prims(), Scene::MOST_PRIMS);
    if shown <= most {
        return Ok(());
    }
    let instances = scene.instances.len();
    let text =
        format!("its {instances} instances show {shown} triangles and other prims where {most} can be told apart");
    Err(Diagnostic::new("too-many-prims", file, "", text)
        .remedy("show fewer of them, or meshes with fewer faces")
        .into())
}

/// Loads what is in memory already; whatever that takes comes out of one budget.
fn load_within(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let too_large = |what: &str, over: OverBudget| {
        LoadError::from(Diagnostic::over_memory(&source.path, "", format!("{what} too large: {over}")))
    };
    let held = source.within.as_ref().map_or(0, |archive| archive.held());
    budget.take(held.saturating_add(source.bytes.len() as u64), 1).map_err(|over| too_large("the file is", over))?;
    let format = detect::detect(source)?;
    let mut loaded = match format {
        detect::Format::Gltf => gltf::load(source, options, budget),
        detect::Format::Nff => nff::load(source, options, budget),
        detect::Format::Obj => obj::load(source, options, budget),
        detect::Format::Ply => ply::load(source, options, budget),
        detect::Format::SceneFile => scene_file::load(source, options, budget),
        detect::Format::Stl(encoding) => stl::load(source, encoding, options, budget),
    }?;
    loaded.warnings.extend(source.note.clone());
    if let Some(angle) = options.smooth {
        smooth_normals::smooth(&mut loaded.scene, angle, budget)
            .map_err(|over| too_large("smooth normals are", over))?;
        tangents::generate_left(&mut loaded.scene);
    }
    // Others have no transforms.
    if matches!(format, detect::Format::Gltf | detect::Format::SceneFile) {
        place::leave_out_far(&mut loaded, &source.path);
    }
    Ok(loaded)
}

/// What is in memory: a model or scene file, or an archive with a model.
fn in_memory(name: &Path, bytes: Vec<u8>, limits: &Limits) -> Result<Source, LoadError> {
    if !archive::is_archive(name, &bytes) {
        return Ok(Source::new(name.into(), bytes));
    }
    let archive = Archive::from_bytes(name, bytes).map_err(|error| archive::unreadable(error, name))?;
    archive::only_model(Arc::new(archive), limits)
}

/// Reads the model file itself, which may lie anywhere, or the only model of an archive.
fn read_source(path: &Path, limits: &Limits) -> Result<Source, LoadError> {
    // What is no plain file, such as a pipe, is opened but once.
    let archive = if path.is_file() { archive::opened(path) } else { Ok(None) };
    if let Some(archive) = archive.map_err(|error| archive::unreadable(error, path))? {
        return archive::only_model(archive, limits);
    }
    match read_file(path, limits)? {
        Source { path, bytes, within: None, .. } => in_memory(&path, bytes, limits),
        source => Ok(source),
    }
}

/// Reads a file that may lie anywhere, in an archive, too, whatever it is.
fn read_file(path: &Path, limits: &Limits) -> Result<Source, LoadError> {
    let fault = |error| archive::unreadable(error, path);
    let too_large = |bytes| LoadError::from(too_large(path, bytes, limits));
    let file = match std::fs::File::open(path) {
        Ok(file) => file,
        Err(error) => {
            let (archive, name) = archive::in_archive(path).map_err(fault)?.ok_or_else(|| fault(error))?;
            return archive::named_model(archive, name, limits);
        }
    };
    let meta = file.metadata().map_err(fault)?;
    if meta.is_dir() {
        return Err(Diagnostic::new("file-not-plain", path, "", "is a folder").remedy("name a file in it").into());
    }
    if meta.len() > limits.file {
        return Err(too_large(meta.len()));
    }
    let bytes = whole::read(file, meta.len(), limits.file).map_err(fault)?;
    if bytes.len() as u64 > limits.file {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(Source::new(path.into(), bytes))
}

/// What is told of a model file that is larger than is allowed.
fn too_large(path: &Path, bytes: u64, limits: &Limits) -> Diagnostic {
    let text = format!("{bytes} bytes where {} are allowed", limits.file);
    Diagnostic::new("file-too-large", path, "", text).remedy(limits.remedy_for_file())
}
