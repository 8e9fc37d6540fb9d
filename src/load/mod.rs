//! Files -> [`Scene`] + warnings. The kind of a file is found by content, then by extension.
//!
//! Files a user gives are not trusted: other files they name are read only below [`LoadOptions::root`], sizes are
//! checked before memory is allocated, and broken input ends in a [`LoadError`] or in a warning, never in a panic.

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

/// Options of loading.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Folder below which alone files are read; `None`: the folder of the model. Files that a model in an archive names are
    /// read from that archive alone.
    pub root: Option<PathBuf>,
    /// Limits of memory and sizes.
    pub limits: Limits,
    /// Treatment of OBJ, PLY and NFF faces with more than three corners.
    pub polygons: Polygons,
    /// Interpretation of MTL text.
    pub mtl: MtlMode,
    /// Scene of a glTF file to load: an index, or a name; `None`: the default scene. Refused where the file has none.
    pub scene: Option<String>,
    /// Variant of materials of a glTF file (KHR_materials_variants): a name, or a number from 0; `None`: the
    /// materials that primitives name themselves. Refused where the file has none.
    pub variant: Option<String>,
    /// Overrides the up axis.
    pub up: Option<UpAxis>,
    /// Moment of an animation of a glTF file to show; `None`: the rest pose.
    pub moment: Option<Moment>,
    /// For one of several models that are shown together: number of animations of the models before it. Numbers of animations
    /// count on from there, and one that this model lacks may belong to another: it stays at rest then.
    pub animations_before: Option<usize>,
    /// Generates smooth normals for meshes without normals, except at edges where faces lean by more than this angle, in
    /// radians; `None`: their faces are flat.
    pub smooth: Option<f64>,
    /// Widths of points and lines, world units; `None`: 1/256 of what is drawn, or less where there are very many.
    pub wire_widths: Option<[f64; 2]>,
    /// Leaves pictures out: for callers that need the geometry of a glTF file alone.
    pub without_pictures: bool,
}

/// A moment of an animation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// Animation: an index, or a name; `None`: the first.
    pub animation: Option<String>,
    /// Seconds from the start of the animation; finite. Clamped to its first and last key.
    pub time: f64,
}

/// Treatment of OBJ, PLY and NFF faces with more than three corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polygons {
    /// Cut into triangles by exact ear clipping.
    #[default]
    Cut,
    /// Planar faces of up to [`Polygons::MOST_CORNERS`] corners stay whole.
    Whole,
}

impl Polygons {
    /// Most corners of a face that stays whole: every ray test of the face visits all of them.
    pub const MOST_CORNERS: usize = 256;

    /// Whether a face of that many corners is kept whole if it is planar.
    pub(crate) fn keeps(self, corners: usize) -> bool {
        self == Self::Whole && (4..=Self::MOST_CORNERS).contains(&corners)
    }
}

/// Interpretation of MTL text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MtlMode {
    /// What exporters mean: carelessly written defaults are replaced, each with a counted warning.
    #[default]
    Guess,
    /// The text as written.
    Literal,
}

/// Result of loading a file.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Warnings about contents that are not drawn as the file specifies.
    pub warnings: Vec<Diagnostic>,
    /// Facts for reports.
    pub facts: Facts,
}

/// Facts about the file besides the scene.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// `glTF 2.0 (binary)`, `Wavefront OBJ`, `NFF`, `PLY (ascii)`, `STL (binary)`, `meshray scene`.
    pub format: String,
    /// Program that wrote the file; empty if the file does not say.
    pub generator: String,
    /// Faces of the file that became triangles or polygons.
    pub faces: u64,
    /// Faces dropped, by reason: (reason, count).
    pub dropped: Vec<(String, u64)>,
    /// Points and lines of the file.
    pub wires: WireFacts,
    /// Animations in the file.
    pub animations: Vec<AnimationFacts>,
    /// Index of the animation that is shown, and its time in seconds from its start; `None`: the rest pose. Of several models,
    /// the first that is not at rest counts.
    pub shown: Option<(usize, f64)>,
    /// Whether that animation changes materials or node visibility: other moments may show pictures that this one does not.
    pub changes_materials: bool,
    /// glTF extensions that the file names, each once.
    pub extensions: Vec<ExtensionFacts>,
    /// Names of the scenes in the file; the loaded one is `scene_index`.
    pub scenes: Vec<String>,
    /// Index of the loaded scene.
    pub scene_index: usize,
    /// Names of the variants of materials in the file.
    pub variants: Vec<String>,
    /// Index of the loaded variant, if one was chosen.
    pub variant: Option<usize>,
    /// Reason for the up axis, where it was guessed.
    pub up_reason: Option<String>,
    /// Largest displacement of a vertex by rounding to `f32` while loading, world units; placing in the world rounds once more
    /// ([`World::rounding`](crate::render::World::rounding)).
    pub max_rounding: f64,
    /// Every file read: the model first, then buffers, images, MTLs. For the input hash and `inspect`.
    pub files: Vec<FileRead>,
    /// xxh3-128 of the xxh3-128 hashes of all files in `files`, in that order (see [`paths::Resolver::finish`]). Of the
    /// files of a model that a scene file shows, the first counts with the hash of the model, the others with 0.
    pub hash: u128,
    /// Whether a file was missing at a path where it was looked up, even if it was found elsewhere later.
    pub gaps: bool,
    /// Bytes of memory of the loaded scene, with room for the mip levels of its pictures; loading itself takes more for a
    /// while.
    pub kept: u64,
    /// Time spent on reading the bytes of all files, by the thread that read them.
    pub reading: Spent,
    /// Time spent on decoding pictures: wall-clock time from the first to the last, processor time of all threads.
    pub decoding: Spent,
}

impl Facts {
    /// Appends the animations of another of several models.
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
    /// Name; empty if it has none.
    pub name: String,
    /// Time of the last key, in seconds from the start.
    pub seconds: f64,
    /// Number of node properties that the animation changes.
    pub channels: usize,
}

/// A glTF extension that a file names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExtensionFacts {
    /// Name, such as `KHR_materials_volume`.
    pub name: String,
    /// Whether the file declares that it cannot be shown without the extension.
    pub required: bool,
    /// Whether the extension is drawn as specified.
    pub supported: bool,
}

/// A file in memory, with the name it was read from.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Path of the file; a name without a folder such as `-` for standard input.
    pub path: PathBuf,
    /// Contents of the file.
    pub bytes: Vec<u8>,
    /// The archive that the file lies in, if any.
    pub within: Option<Arc<Archive>>,
    /// Note on how the file was chosen from the archive, where the user should know.
    pub note: Option<Diagnostic>,
}

impl Source {
    /// Source that lies in no archive.
    pub fn new(path: PathBuf, bytes: Vec<u8>) -> Self {
        Self { path, bytes, within: None, note: None }
    }

    /// Whether the source is standard input.
    pub fn is_stdin(&self) -> bool {
        self.path == Path::new("-")
    }
}

/// Loads a model or scene file, or the only model of a zip archive. One of several models in an archive is named as in a
/// folder: `ships.zip/tug/tug.gltf`.
///
/// # Errors
/// [`LoadError::Read`] when the file itself cannot be read, [`LoadError::Input`] when its contents cannot be drawn.
/// A valid file that holds nothing to draw is `Ok` with an empty scene.
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

/// Loads a model or scene from memory. Files it names are looked up beside `name`, which need not exist; for `-` in
/// [`LoadOptions::root`]. A name without a folder stands for a file in the current folder: to read nothing but these
/// bytes, use an empty folder as root and the name `-`. A zip archive holds all files of its model, and no others are read.
pub fn load_bytes(name: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut loaded = load_source(&in_memory(name, bytes, &options.limits)?, options)?;
    check_wishes(&loaded, name, options)?;
    check_moment(&mut loaded, name, options)?;
    Ok(loaded)
}

/// Refuses the choice of a scene or a variant where a file has none.
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

/// Checks the chosen moment where a file has no animations: refused when one is named, else a warning. Also refuses an
/// animation that none of several models has. Parts of a whole are checked together, by the caller.
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

/// Bytes of memory of a loaded scene.
fn kept(scene: &Scene) -> u64 {
    let pixels = |bitmap: &Bitmap| u64::from(bitmap.width) * u64::from(bitmap.height);
    let copies: u64 = scene.bitmaps.iter().map(|bitmap| texture::smaller_copies(pixels(bitmap))).sum();
    let around = scene.panorama.as_ref().map_or(0, |panorama| panorama.texels.len() as u64 * panorama::PER_PIXEL);
    scene.bytes() + copies + around
}

/// Refuses a scene with more prims than indices can address: a small file can instance a large mesh many times.
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

/// Loads a source from memory; all allocations come out of one budget.
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
    // Other formats have no transforms.
    if matches!(format, detect::Format::Gltf | detect::Format::SceneFile) {
        place::leave_out_far(&mut loaded, &source.path);
    }
    Ok(loaded)
}

/// Wraps bytes in memory: a model or scene file, or an archive with a model.
fn in_memory(name: &Path, bytes: Vec<u8>, limits: &Limits) -> Result<Source, LoadError> {
    if !archive::is_archive(name, &bytes) {
        return Ok(Source::new(name.into(), bytes));
    }
    let archive = Archive::from_bytes(name, bytes).map_err(|error| archive::unreadable(error, name))?;
    archive::only_model(Arc::new(archive), limits)
}

/// Reads the model file itself, which may lie anywhere, or the only model of an archive.
fn read_source(path: &Path, limits: &Limits) -> Result<Source, LoadError> {
    // Pipes and other special files must be opened only once.
    let archive = if path.is_file() { archive::opened(path) } else { Ok(None) };
    if let Some(archive) = archive.map_err(|error| archive::unreadable(error, path))? {
        return archive::only_model(archive, limits);
    }
    match read_file(path, limits)? {
        Source { path, bytes, within: None, .. } => in_memory(&path, bytes, limits),
        source => Ok(source),
    }
}

/// Reads a file of any kind, which may lie anywhere, also in an archive.
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

/// Diagnostic for a model file that is larger than allowed.
fn too_large(path: &Path, bytes: u64, limits: &Limits) -> Diagnostic {
    let text = format!("{bytes} bytes where {} are allowed", limits.file);
    Diagnostic::new("file-too-large", path, "", text).remedy(limits.remedy_for_file())
}
