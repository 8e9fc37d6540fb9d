//! glTF 2.0, core and the extensions that matter to a still picture, from `.gltf` or GLB.
//!
//! A file passes four gates. `container` finds the JSON and the binary chunk; `version` and `extensions` report early what
//! cannot be drawn at all; `schema` checks every value and index, so that the typed document of the `gltf` crate can be built;
//! `attributes`, `usage`, `graph` and `links` check the consistency between parts. Only then is data read (`accessor`, `mesh`,
//! `images`), with bounds checks of its own. The consequence of each fault is a table ([`codes`]).
//!
//! Compressed geometry is decoded before anything reads it: views by `meshopt`, so that they read like other views, and
//! primitives by `draco`, so that their accessors read like others. Both libraries sit behind features of the same names;
//! without them, files that need them are refused with a message that names the feature.
//!
//! Points and lines are read like triangles and get a width at the end ([`super::wires`]).
//!
//! Nodes, morph weights and skins are drawn in their rest pose, or at a moment of an animation ([`Moment`](super::Moment)).

mod accessor;
mod animation;
mod attributes;
mod bounds;
mod buffers;
mod cameras_lights;
pub mod codes;
mod container;
mod document;
mod draco;
mod draco_codec;
#[cfg(feature = "draco")]
mod draco_points;
mod draco_stream;
#[cfg(feature = "draco")]
mod draco_survey;
mod extensions;
mod faces;
mod gloss;
mod graph;
mod images;
mod links;
mod material;
mod mend;
mod mesh;
mod meshopt;
mod meshopt_codec;
mod morphs;
mod named;
mod palette;
mod report;
mod scene;
mod schema;
mod schema_tables;
mod skin;
mod sparse;
#[cfg(test)]
mod tests;
mod textures;
mod tree;
mod usage;
mod variants;
mod version;
mod weight;

use super::choice;
use super::limits::Budget;
use super::paths::Resolver;
use super::wires::{self, Wires};
use super::{Diagnostic, Facts, LoadError, LoadOptions, Loaded, Source};
use crate::math::DAffine3;
use crate::scene::{Environment, Instance, Scene};
use accessor::Reader;
use animation::Pose;
use buffers::Buffers;
use container::Container;
use document::Document;
use gltf::json::Root;
use gltf::json::mesh as source;
use graph::Graph;
use images::Images;
use mesh::Read;
use palette::Palette;
use rayon::prelude::*;
use report::Report;
use scene::{Placed, Played};
use skin::Skin;
use sparse::Replacements;
use std::borrow::Cow;
use weight::Weight;

/// Loads a glTF 2.0 file; all memory is charged to `budget`.
///
/// # Errors
/// Faults that the table in [`codes`] refuses, all those of one stage at once.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let mut report = Report::new(&source.path);
    let loaded = Loading { source, options, report: &mut report }.run(budget)?;
    let warnings = report.warnings.into_vec();
    Ok(Loaded { warnings, ..loaded })
}

/// Index of a mesh, and its placement by a skin.
type Part = (u32, Option<DAffine3>);

struct Loading<'a> {
    source: &'a Source,
    options: &'a LoadOptions,
    report: &'a mut Report,
}

impl Loading<'_> {
    fn run(&mut self, budget: &mut Budget) -> Result<Loaded, LoadError> {
        let file = &self.source.path;
        let container = container::split(&self.source.bytes, self.report);
        let container = self.passed(container)?;
        let json = document::text(container.json, self.report);
        if let Cow::Owned(text) = &json {
            self.take(budget, text.len() as u64, "the JSON, once it is UTF-8,")?;
        }
        let weight = Weight::of(json.as_bytes());
        document::check_depth(&weight, self.report);
        self.report.check()?;
        self.take(budget, weight.bytes(), "the JSON, once it is parsed,")?;
        let value = document::parse(&json, self.report);
        let mut value = self.passed(value)?;
        mend::take_out_blanks(&mut value, self.report);
        mend::lengthen_buffer(&mut value, container.bin, self.report);
        let right_version = version::check(&value, self.report).then_some(());
        self.passed(right_version)?;
        let extensions = extensions::Lists::of(&value);
        extensions.check(file, self.report);
        self.report.check()?;
        mend::check(&mut value, self.report);
        self.report.check()?;
        let bytes = weight::typed(&value);
        self.take(budget, bytes, "the document")?;
        let variants = variants::names(&value);
        let variant = self.variant(&variants)?;
        attributes::check(&value, variant, self.report);
        usage::check(&value, self.report);
        let mut graph = Graph::new(&value, self.report);
        let document = document::typed(value, bytes, self.report);
        let document = self.passed(document)?;
        links::check(&document.root, self.report);
        self.report.check()?;

        let mut facts = facts(&document, container.binary);
        facts.extensions = extensions.facts();
        (facts.variants, facts.variant) = (variants, variant);
        let scene = self.build(&document, &mut graph, &container, budget, &mut facts)?;
        Ok(Loaded { scene, facts, warnings: Vec::new() })
    }

    /// Returns the value, unless the report refuses the file or there is none.
    fn passed<T>(&mut self, value: Option<T>) -> Result<T, LoadError> {
        self.report.check()?;
        value
            .ok_or_else(|| Diagnostic::new("gltf-unreadable", &self.source.path, "", "this is no glTF 2.0 file").into())
    }

    fn build(
        &mut self,
        document: &Document,
        graph: &mut Graph,
        container: &Container,
        budget: &mut Budget,
        facts: &mut Facts,
    ) -> Result<Scene, LoadError> {
        let (root, file, bin) = (&document.root, self.source.path.as_path(), container.bin);
        if container.binary && bin.is_none() {
            self.check_chunk(root);
        }
        let mut resolver = Resolver::new(self.source, self.options);
        let buffers = Buffers::load(root, bin, file, &mut resolver, budget, self.report);
        let replacements = Replacements::load(root, &buffers, budget, self.report);
        let replacements = replacements.map_err(|over| self.too_large("what sparse accessors replace", over))?;
        let decoded = draco::Decoded::load(root, &buffers, file, budget, self.report);
        self.report.check()?;
        let reader = Reader { root, buffers: &buffers, replacements: &replacements, decoded: &decoded };
        facts.scene_index = scene::choose(root, self.options.scene.as_deref(), file)?;
        facts.variant.iter().for_each(|&variant| variants::check(root, variant, self.report));
        self.check_budget(reader, *budget)?;
        bounds::check(reader, self.report);
        facts.animations = animation::facts(&document.animations, reader);
        let pose = self.pose(reader, graph, document, budget, facts)?;
        graph.place(&pose.moved);
        let posed = self.posed(document, &pose, budget)?;
        let root = posed.as_ref().unwrap_or(root);
        let reader = Reader { root, ..reader };
        let played = Played { moving: self.options.moment.is_some(), switches: pose.switches, weights: &pose.weights };
        let placed = scene::walk(reader, graph, facts.scene_index, played, budget, self.report);
        let placed = placed.map_err(|over| self.too_large("what the nodes show", over))?;
        let skins = skin::load(reader, graph, &placed.posed, self.report);
        skin::check_scene(root, graph, facts.scene_index, &placed.draws, self.report);
        let palette = Palette::new(root, &document.morphs, &placed, facts.variant, self.options.smooth.is_some());
        for texture in &palette.textures.without_image {
            let text = "the texture names no image that is read, and is not drawn";
            self.report.warnings.push(Diagnostic::new("texture-no-image", file, format!("textures[{texture}]"), text));
        }

        let drawn = palette.textures.pictures.clone();
        let read = if self.options.without_pictures { &[][..] } else { &drawn };
        let images = Images::load(root, &buffers, read, file, &mut resolver, budget, self.report);
        self.charge(reader, &placed, &skins, &palette, budget)?;
        let mut pictures = Report::new(file);
        let (reads, (bitmaps, decoding)) = rayon::join(
            || read_meshes(reader, &placed, &skins, &palette, file),
            || images.decode(root, read, file, &self.options.limits, budget, &mut pictures),
        );
        // glTF cannot describe surroundings: its lights are added to whatever the viewer puts around the model.
        let environment = Environment::Studio;
        let photometric = !placed.lights.is_empty();
        let (cameras, lights) = (placed.cameras, placed.lights);
        let mut scene = Scene { cameras, lights, photometric, environment, ..Scene::default() };
        let (wires, places) = self.assemble(&mut scene, root, &placed.draws, reads, facts)?;
        self.report.merge(pictures);
        scene.materials = palette.materials;
        (scene.textures, scene.bitmaps) =
            textures::keep_decoded(&mut scene.materials, palette.textures.list, &drawn, bitmaps);
        let lost = wires::draw(&wires, &places, &mut scene, budget, facts, file, self.options.wire_widths)
            .map_err(|over| self.too_large("what points and lines become", over))?;
        lost.into_iter().for_each(|warning| self.report.warnings.push(warning));
        scene.up = self.options.up.unwrap_or_default();
        // VRM 0.x, whose avatars face backwards; from 1.0 on the extension has another name and they face as in glTF.
        scene.faces_back = root.extensions_used.iter().any(|name| name == "VRM");
        (facts.reading, facts.decoding) = (resolver.reading(), decoding);
        (facts.files, facts.hash, facts.gaps) = resolver.finish();
        Ok(scene)
    }

    /// Evaluates the requested moment; nothing changes in a file without animations.
    fn pose(
        &mut self,
        reader: Reader,
        graph: &Graph,
        document: &Document,
        budget: &mut Budget,
        facts: &mut Facts,
    ) -> Result<Pose, LoadError> {
        let (file, animations) = (self.source.path.as_path(), &document.animations);
        let Some(moment) = self.options.moment.as_ref().filter(|_| !animations.is_empty()) else {
            return Ok(Pose::default());
        };
        let names: Vec<&str> =
            animations.iter().map(|animation| animation.name.as_deref().unwrap_or_default()).collect();
        let number = match (&moment.animation, self.options.animations_before) {
            (Some(wish), None) => choice::choose(&choice::ANIMATION, &names, wish, file)?,
            (Some(wish), Some(before)) => {
                choice::check_name(&choice::ANIMATION, &names, wish, before, file)?;
                match choice::find(&names, wish, before) {
                    Some(number) => number,
                    None => return Ok(Pose::default()),
                }
            }
            (None, _) => 0,
        };
        let Some(animation) = animations.get(number) else { return Ok(Pose::default()) };
        let pose = animation::play(reader, graph, number, animation, moment.time, budget, self.report)
            .map_err(|over| self.too_large("an animation", over))?;
        facts.shown = Some((number, moment.time));
        facts.changes_materials = animation.changes_materials();
        // Times are stored as `f32`: a moment that rounds to the last time is not past it.
        #[expect(clippy::cast_possible_truncation, reason = "compared as stored")]
        let past = |end: f64| (moment.time as f32) > end as f32;
        if let Some(end) = facts.animations.get(number).map(|animation| animation.seconds).filter(|&end| past(end)) {
            let called = animation.called(number);
            let text = format!("{} s is past the end of animation {called}, which is {end} s long", moment.time);
            let warning = Diagnostic::new("animation-over", file, format!("animations[{number}]"), text);
            self.report.warnings.push(warning.remedy("drawn as at its end"));
        }
        Ok(pose)
    }

    /// Returns the document at that moment; `None` if it is unchanged.
    fn posed(&self, document: &Document, pose: &Pose, budget: &mut Budget) -> Result<Option<Root>, LoadError> {
        if !pose.changes_document() {
            return Ok(None);
        }
        self.take(budget, document.bytes, "the document at that moment")?;
        Ok(Some(pose.posed(&document.root, &document.originals)))
    }

    /// Index of the requested material variant.
    fn variant(&self, names: &[String]) -> Result<Option<usize>, LoadError> {
        let Some(wish) = &self.options.variant else { return Ok(None) };
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Ok(Some(choice::choose(&choice::VARIANT, &names, wish, &self.source.path)?))
    }

    /// Checks that a GLB has the binary chunk, if its first buffer has no uri and is used.
    fn check_chunk(&mut self, root: &Root) {
        let nowhere = root.buffers.first().is_some_and(|buffer| buffer.uri.is_none() && !meshopt::is_stand_in(buffer));
        if nowhere && root.buffer_views.iter().any(|view| view.buffer.value() == 0) {
            self.report.add(codes::Code::BufferMissingGlbData, "buffers[0]", "the file has no binary chunk for it");
        }
    }

    /// Refuses a file with accessors that exceed the memory limit, before any is read.
    fn check_budget(&self, reader: Reader, mut budget: Budget) -> Result<(), LoadError> {
        // Accessors of zeros need no bytes in the file, so only the budget bounds them.
        let accessors = reader.root.accessors.iter().enumerate().filter(|(_, a)| a.buffer_view.is_none());
        let zeros = accessors.filter(|(i, _)| reader.decoded.count(*i).is_none()).map(|(_, a)| a.count.0);
        let largest = zeros.max().unwrap_or(0);
        self.take(&mut budget, largest.saturating_mul(64), "an accessor")
    }

    /// Charges the memory of all primitives.
    fn charge(
        &self,
        reader: Reader,
        placed: &Placed,
        skins: &[Option<Skin>],
        palette: &Palette,
        budget: &mut Budget,
    ) -> Result<(), LoadError> {
        let meshes = placed.posed.iter().filter_map(|posed| Some((posed, reader.root.meshes.get(posed.mesh)?)));
        let primitives = meshes.flat_map(|(v, mesh)| mesh.primitives.iter().enumerate().map(move |p| (v, mesh, p)));
        let costs = primitives.map(|(v, mesh, (k, p))| mesh::cost(reader, &palette.job(v, mesh, k, p, skins)));
        self.take(budget, costs.fold(0, u64::saturating_add), "what the meshes hold")
    }

    /// Charges `bytes` for `what`, or refuses the file.
    fn take(&self, budget: &mut Budget, bytes: u64, what: &str) -> Result<(), LoadError> {
        budget.take(bytes, 1).map_err(|over| self.too_large(what, over))
    }

    fn too_large(&self, what: &str, over: super::limits::OverBudget) -> LoadError {
        let text = format!("{what} is too large: {over}");
        Diagnostic::over_memory(&self.source.path, "", text).into()
    }

    /// Adds what was read to the scene; returns points and lines with their instances.
    fn assemble(
        &mut self,
        scene: &mut Scene,
        root: &Root,
        draws: &[scene::Draw],
        reads: Vec<Vec<(Option<Read>, Report)>>,
        facts: &mut Facts,
    ) -> Result<(Vec<Wires>, Vec<Instance>), LoadError> {
        let mut dropped = faces::Dropped::default();
        // For each posed mesh, its primitives with their placement by a skin: first triangles, then points and lines.
        let mut parts: Vec<[Vec<Part>; 2]> = Vec::new();
        let mut wires: Vec<Wires> = Vec::new();
        for primitives in reads {
            let mut part = [Vec::new(), Vec::new()];
            for (read, report) in primitives {
                self.report.merge(report);
                let Some(read) = read else { continue };
                let center = read.center.map(DAffine3::from_translation);
                dropped.not_finite += read.dropped.not_finite;
                dropped.degenerate += read.dropped.degenerate;
                if !read.mesh.triangles.is_empty() {
                    facts.faces += read.mesh.triangles.len() as u64;
                    part[0].push((scene.meshes.len() as u32, center));
                    scene.meshes.push(read.mesh);
                } else if !read.lines.is_empty() {
                    part[1].push((wires.len() as u32, center));
                    wires.push(Wires { mesh: read.mesh, ends: read.lines });
                }
            }
            parts.push(part);
        }
        self.report.check()?;
        let mut places = Vec::new();
        for draw in draws {
            let name = root.nodes.get(draw.node).and_then(|node| node.name.as_ref());
            let place = |&(mesh, posed): &Part| Instance {
                name: name.cloned().unwrap_or_default(),
                mesh,
                world_from_object: posed.unwrap_or(draw.world),
            };
            if let Some([meshes, lines]) = parts.get(draw.posed) {
                scene.instances.extend(meshes.iter().map(place));
                places.extend(lines.iter().map(place));
            }
        }
        self.tell_dropped(dropped, facts);
        Ok((wires, places))
    }

    fn tell_dropped(&mut self, dropped: faces::Dropped, facts: &mut Facts) {
        let reasons = [
            ("a corner that is not finite", "face-not-finite", dropped.not_finite),
            ("two corners in one place", "face-degenerate", dropped.degenerate),
        ];
        let file = &self.source.path;
        for (reason, code, count) in reasons.into_iter().filter(|r| r.2 > 0) {
            facts.dropped.push((reason.into(), count));
            let mut warning = Diagnostic::new(code, file, "", format!("a face with {reason} is left out"));
            warning.count = u32::try_from(count).unwrap_or(u32::MAX);
            self.report.warnings.push(warning);
        }
    }
}

/// Reads every primitive of every posed mesh, in parallel; the results keep the order of the file.
fn read_meshes(
    reader: Reader,
    placed: &Placed,
    skins: &[Option<Skin>],
    palette: &Palette,
    file: &std::path::Path,
) -> Vec<Vec<(Option<Read>, Report)>> {
    let root = reader.root;
    let read_one = |posed: &scene::PosedMesh, k: usize, primitive: &source::Primitive, mesh: &source::Mesh| {
        let mut report = Report::new(file);
        let job = palette.job(posed, mesh, k, primitive, skins);
        let mut read = mesh::read(reader, &job, &mut report).filter(|_| posed.drawn);
        if let (Some(read), Some(material)) = (&mut read, palette.material(posed, primitive)) {
            read.mesh.material = material;
        }
        (read, report)
    };
    let posed = placed.posed.par_iter();
    posed
        .map(|posed| {
            let Some(mesh) = root.meshes.get(posed.mesh) else { return Vec::new() };
            let primitives = mesh.primitives.par_iter().enumerate();
            primitives.map(|(k, primitive)| read_one(posed, k, primitive, mesh)).collect()
        })
        .collect()
}

fn facts(document: &Document, binary: bool) -> Facts {
    let root = &document.root;
    let version = &root.asset.version;
    Facts {
        format: format!("glTF {version}{}", if binary { " (binary)" } else { "" }),
        generator: root.asset.generator.clone().unwrap_or_default(),
        scenes: scene::names(root),
        ..Facts::default()
    }
}
