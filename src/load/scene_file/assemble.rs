//! Parsed scene file and the files that it names -> the scene.

use super::reader::Faults;
use super::{FORMAT, Model, Parsed, Surrounding, shapes};
use crate::load::kept;
use crate::load::limits::{Budget, Limits};
use crate::load::panorama::{self, LoadedPanorama};
use crate::load::paths::{FileFault, Resolver, shorten};
use crate::load::{Diagnostic, Facts, LoadError, LoadOptions, Loaded, Source, Warnings, detect};
use crate::scene::merge::Stored;
use crate::scene::{Panorama, Scene, UpAxis};
use crate::stopwatch::Stopwatch;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Reads the models and assembles the scene.
pub(super) fn assemble(
    parsed: Parsed,
    faults: &Faults,
    source: &Source,
    options: &LoadOptions,
    budget: &mut Budget,
) -> Result<Loaded, LoadError> {
    let Parsed { scene, models, panorama, lost, max_rounding } = parsed;
    let faces = scene.meshes.iter().map(|mesh| mesh.faces() as u64).sum();
    let mut warnings = Warnings::default();
    let mut facts = Facts { format: FORMAT.into(), max_rounding, faces, ..Facts::default() };
    lost.tell(faults, &source.path, &mut facts, &mut warnings);
    let resolver = Resolver::new(source, options);
    check_files(&models, panorama.as_ref(), faults, &resolver)?;
    let known = HashMap::new();
    let mut assembly = Assembly { faults, source, options, budget, resolver, scene, facts, warnings, known };
    if let Some(surrounding) = panorama {
        assembly.set_environment(surrounding)?;
    }
    for model in &models {
        assembly.add(model)?;
    }
    let Assembly { resolver, scene, mut facts, warnings, .. } = assembly;
    facts.reading += resolver.reading();
    (facts.files, facts.hash, facts.gaps) = resolver.finish();
    Ok(Loaded { scene, warnings: warnings.into_vec(), facts })
}

/// Locates all named files before any is read, so that all missing ones are reported at once.
fn check_files(
    models: &[Model],
    panorama: Option<&Surrounding>,
    faults: &Faults,
    resolver: &Resolver,
) -> Result<(), LoadError> {
    let of_models = models.iter().map(|model| (&model.file, model.at));
    for (file, at) in of_models.chain(panorama.map(|picture| (&picture.file, picture.at))) {
        let elsewhere = file.contains("://").then(|| FileFault::Scheme(shorten(file)));
        if let Some(fault) = elsewhere.or_else(|| resolver.locate(Path::new(file)).err()) {
            faults.note_file(at, &fault);
        }
    }
    faults.check()
}

/// A scene that models are added to.
struct Assembly<'a> {
    faults: &'a Faults,
    source: &'a Source,
    options: &'a LoadOptions,
    budget: &'a mut Budget,
    resolver: Resolver,
    scene: Scene,
    facts: Facts,
    warnings: Warnings,
    /// Models by file, up axis and material: one that occurs again is read and stored once.
    known: HashMap<(String, Option<UpAxis>, Option<u32>), ReadModel>,
}

/// A model that was read, for further placements.
struct ReadModel {
    places: Scene,
    stored: Stored,
    facts: Facts,
}

impl Assembly<'_> {
    /// Reads the picture that surrounds the scene.
    fn set_environment(&mut self, Surrounding { file, at, rotation }: Surrounding) -> Result<(), LoadError> {
        let path = &self.source.path;
        let over = |over| Diagnostic::over_budget(path, over);
        // The file's bytes are freed once it is decoded, so they are taken from a copy of the budget.
        let bytes = self
            .resolver
            .read_file_within(Path::new(&file), &mut self.budget.clone())
            .map_err(|fault| LoadError::from(fault.diagnose(path, &self.faults.place(at))))?
            .map_err(over)?;
        let picture = Source::new(path.with_file_name(&file), bytes);
        let left = Limits { memory: self.budget.left(), ..self.options.limits };
        let LoadedPanorama { panorama, warnings, .. } = panorama::decode(&picture, &left)?;
        self.budget.take(panorama.texels.len() as u64, panorama::PER_PIXEL).map_err(over)?;
        warnings.into_iter().for_each(|w| self.warnings.push(w));
        self.scene.panorama = Some(Panorama { rotation, ..panorama });
        Ok(())
    }

    /// Adds a model; one that was added before is only placed again.
    fn add(&mut self, model: &Model) -> Result<(), LoadError> {
        let scene = &self.scene;
        let before = [scene.meshes.len(), scene.spheres.len(), scene.cones.len(), scene.planes.len()];
        let key = (model.file.clone(), model.up, model.material);
        let known = match self.known.remove(&key) {
            Some(known) => {
                self.take(known.places.bytes(), model)?;
                self.scene.place(known.places.clone(), known.stored, &model.world_from_model);
                known
            }
            None => self.add_first(model)?,
        };
        // Appending renumbers the materials of shapes, so the override comes afterwards.
        if let Some(material) = model.material {
            self.make_of(material, before);
        }
        self.resolver.absorb(&known.facts.files, known.facts.hash, known.facts.gaps);
        tell(&mut self.facts, &known.facts, shapes::stretch(&model.world_from_model));
        self.known.insert(key, known);
        Ok(())
    }

    /// Reads a model and adds it.
    fn add_first(&mut self, model: &Model) -> Result<ReadModel, LoadError> {
        // Temporary memory of reading is free again for the next model.
        let mut own = *self.budget;
        let Loaded { scene, warnings, facts } = self.read(model, &mut own)?;
        self.facts.add_animations(&facts);
        self.take(kept(&scene), model)?;
        warnings.into_iter().for_each(|w| self.warnings.push(w));
        self.facts.reading += facts.reading;
        self.facts.decoding += facts.decoding;
        let places = scene.places();
        let stored = self.scene.append(scene, &model.world_from_model);
        Ok(ReadModel { places, stored, facts })
    }

    /// Takes `bytes` bytes for a model.
    fn take(&mut self, bytes: u64, model: &Model) -> Result<(), Diagnostic> {
        self.budget.take(bytes, 1).map_err(|over| {
            let fault = Diagnostic::over_budget(&self.source.path, over);
            Diagnostic { place: self.faults.place(model.at), ..fault }
        })
    }

    /// Sets the material of all shapes from these indices of meshes, spheres, cones and planes on.
    fn make_of(&mut self, material: u32, [meshes, spheres, cones, planes]: [usize; 4]) {
        self.scene.meshes[meshes..].iter_mut().for_each(|mesh| mesh.material = material);
        self.scene.spheres[spheres..].iter_mut().for_each(|sphere| sphere.material = material);
        self.scene.cones[cones..].iter_mut().for_each(|cone| cone.material = material);
        self.scene.planes[planes..].iter_mut().for_each(|plane| plane.material = material);
    }

    fn read(&mut self, model: &Model, budget: &mut Budget) -> Result<Loaded, LoadError> {
        let Self { faults, source, options, resolver, .. } = self;
        let place = || faults.place(model.at);
        let path = resolver
            .locate(Path::new(&model.file))
            .map_err(|fault| LoadError::from(fault.diagnose(&source.path, &place())))?;
        let before = options.animations_before.unwrap_or(0) + self.facts.animations.len();
        let options = LoadOptions {
            root: Some(resolver.root().to_path_buf()),
            up: model.up,
            animations_before: Some(before),
            ..options.clone()
        };
        let watch = Stopwatch::of_this_thread();
        let model_source = resolver.read_model(&path)?;
        let reading = watch.read();
        // Checked before the file is loaded: one that names itself would recurse for ever.
        if matches!(detect::detect(&model_source)?, detect::Format::SceneFile) {
            let text = format!("`{}` is a scene file, and scene files do not nest", model.file);
            return Err(Diagnostic::new("scene-nested", &source.path, place(), text).remedy("name a model").into());
        }
        let mut loaded = crate::load::load_within(&model_source, &options, budget)?;
        loaded.facts.reading += reading;
        // A model inside an archive is known only once the archive is opened, so the path counts as a gap.
        loaded.facts.gaps |= model_source.path != path;
        // Files are listed by their real paths; translate them to paths as named, which stay valid in a copy of the folders.
        let named = resolver.as_named(Path::new(&model.file));
        // Files beside the target of a link do not lie beside the link.
        let beside = named.parent().filter(|_| resolver.lies_beside(&named, &path));
        loaded.facts.files.iter_mut().for_each(|file| file.path = as_named(&file.path, &path, &named, beside));
        Ok(loaded)
    }
}

/// Path, as named, of a `file` read for the model at path `model`, which was named `named`: relative to `named` if the file is
/// the model or inside it (an archive), or relative to the folder `beside` if it lies in the model's folder.
fn as_named(file: &Path, model: &Path, named: &Path, beside: Option<&Path>) -> PathBuf {
    let way = file.strip_prefix(model);
    if let Ok(way) = way {
        return if way.as_os_str().is_empty() { named.into() } else { named.join(way) };
    }
    let way = model.parent().and_then(|folder| file.strip_prefix(folder).ok());
    way.zip(beside).map_or_else(|| file.into(), |(way, beside)| beside.join(way))
}

/// Adds the facts of a placed model; `stretch` is the factor of its placement.
fn tell(facts: &mut Facts, found: &Facts, stretch: f64) {
    facts.faces += found.faces;
    facts.dropped.extend_from_slice(&found.dropped);
    facts.wires.append(&found.wires);
    facts.extensions.extend_from_slice(&found.extensions);
    // A scene file has none of its own; it takes those of its first model that has any.
    if facts.scenes.is_empty() {
        (facts.scenes, facts.scene_index) = (found.scenes.clone(), found.scene_index);
    }
    if facts.variants.is_empty() {
        (facts.variants, facts.variant) = (found.variants.clone(), found.variant);
    }
    facts.max_rounding = facts.max_rounding.max(found.max_rounding * stretch);
}
