//! Choice of the scene, and the objects that its nodes place.

use super::accessor::{Pick, Reader, Unreadable};
use super::cameras_lights;
use super::choice;
use super::codes::Code;
use super::graph::Graph;
use super::report::Report;
use super::schema::whole;
use crate::load::Diagnostic;
use crate::load::limits::{Budget, OverBudget};
use crate::math::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use crate::scene::{Camera, Instance, Light};
use gltf::json::{Index, Root, accessor::Accessor, mesh::Mesh, scene::Node};
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::path::Path;

/// A mesh in one shape: with these morph weights, posed by this skin.
#[derive(Clone, Debug)]
pub(super) struct PosedMesh {
    pub(super) mesh: usize,
    /// Morph weights of a node or an animation; `None`: those of the mesh.
    pub(super) weights: Option<Vec<f32>>,
    pub(super) skin: Option<usize>,
    /// Whether the scene shows the mesh; otherwise it is only checked.
    pub(super) drawn: bool,
}

/// An instance of a posed mesh.
pub(super) struct Draw {
    /// The node that has the mesh.
    pub(super) node: usize,
    pub(super) posed: usize,
    pub(super) world: DAffine3,
}

/// All objects that the nodes of a scene place.
#[derive(Default)]
pub(super) struct Placed {
    pub(super) posed: Vec<PosedMesh>,
    pub(super) draws: Vec<Draw>,
    pub(super) cameras: Vec<Camera>,
    pub(super) lights: Vec<Light>,
}

/// Returns the names of all scenes.
pub(super) fn names(root: &Root) -> Vec<String> {
    root.scenes.iter().map(|scene| scene.name.clone().unwrap_or_default()).collect()
}

/// Index of the scene requested by name or number; without a request, of the default one, or else the first.
pub(super) fn choose(root: &Root, wish: Option<&str>, file: &Path) -> Result<usize, Diagnostic> {
    let Some(wish) = wish else { return Ok(root.scene.map_or(0, |scene| scene.value())) };
    let names: Vec<&str> = root.scenes.iter().map(|scene| scene.name.as_deref().unwrap_or_default()).collect();
    choice::choose(&choice::SCENE, &names, wish, file)
}

/// The animation being played, as far as it matters to the walk.
#[derive(Clone, Copy)]
pub(super) struct Played<'a> {
    /// Whether a moment of an animation is drawn.
    pub(super) moving: bool,
    /// Whether that animation switches nodes on and off.
    pub(super) switches: bool,
    /// Morph weights by the animation, by node index.
    pub(super) weights: &'a HashMap<usize, Vec<f32>>,
}

/// Walks the nodes of a scene; in a file without scenes, all nodes.
///
/// # Errors
/// If the scene would exceed the rest of `budget`.
pub(super) fn walk(
    reader: Reader,
    graph: &Graph,
    scene: usize,
    played: Played,
    budget: &mut Budget,
    report: &mut Report,
) -> Result<Placed, OverBudget> {
    let root = reader.root;
    let tops: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => graph.roots().collect(),
    };
    // Nodes, and whether all their ancestors are visible.
    let mut stack: Vec<(usize, bool)> = tops.into_iter().rev().map(|node| (node, true)).collect();
    let mut seen = vec![false; root.nodes.len()];
    let mut walk = Walk { reader, played, placed: Placed::default(), known: HashMap::new(), budget, report };
    while let Some((i, is_shown)) = stack.pop() {
        let Some(node) = root.nodes.get(i) else { continue };
        if std::mem::replace(&mut seen[i], true) {
            continue;
        }
        let is_shown = is_shown && is_visible(node);
        stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), is_shown)));
        let world = graph.world.get(i).copied().unwrap_or_default();
        // Hidden nodes keep their cameras (KHR_node_visibility).
        let camera = cameras_lights::camera(root, node, world, walk.report);
        walk.placed.cameras.extend(camera);
        walk.light(node, world, is_shown);
        if is_shown {
            walk.mesh(i, node, world)?;
        }
    }
    let mut placed = walk.placed;
    unused(root, &mut placed);
    Ok(placed)
}

/// Identity of a posed mesh: mesh, skin, and the bits of weights that differ from those of the mesh.
type Kind = (usize, Option<usize>, Option<Vec<u32>>);

struct Walk<'a, 'b> {
    reader: Reader<'a>,
    played: Played<'b>,
    placed: Placed,
    /// Index of each posed mesh in the list.
    known: HashMap<Kind, usize>,
    budget: &'b mut Budget,
    report: &'b mut Report,
}

impl Walk<'_, '_> {
    /// Places the light of a node. A light that an animation switches off is kept but dark, so that the model has lights of its
    /// own at all moments or at none.
    fn light(&mut self, node: &Node, world: DAffine3, is_shown: bool) {
        if !is_shown && !self.played.switches {
            return;
        }
        let mut light = cameras_lights::light(self.reader.root, node, world, self.report);
        if let Some(light) = light.as_mut().filter(|_| !is_shown) {
            light.intensity = Vec3::ZERO;
        }
        self.placed.lights.extend(light);
    }

    /// Places the instances of a node's mesh.
    fn mesh(&mut self, i: usize, node: &Node, world: DAffine3) -> Result<(), OverBudget> {
        let Some(mesh) = node.mesh.and_then(|mesh| self.reader.root.meshes.get(mesh.value())) else { return Ok(()) };
        let mut places = self.copies(i, node)?;
        places.iter_mut().for_each(|place| *place = world * *place);
        places.retain(|place| node.skin.is_some() || !is_scaled_away(place));
        // While an animation plays, hidden meshes are read as well, so that all moments read the same data.
        if places.is_empty() && !self.played.moving {
            return Ok(());
        }
        let Some(posed) = self.posed(i, node, mesh) else { return Ok(()) };
        let name = node.name.as_ref().map_or(0, String::len);
        let instances = mesh.primitives.len().saturating_mul(size_of::<Instance>() + name);
        self.budget.take(places.len() as u64, (size_of::<Draw>().saturating_add(instances)) as u64)?;
        for world in places {
            if world.is_finite() {
                self.placed.draws.push(Draw { node: i, posed, world });
            } else {
                let text = "a node without a finite place is left out";
                self.report.warn(Code::AccessorInvalidFloat, format!("nodes[{i}]"), text);
            }
        }
        Ok(())
    }

    /// Transforms of the copies of a node's mesh, in node space.
    fn copies(&mut self, i: usize, node: &Node) -> Result<Vec<DAffine3>, OverBudget> {
        let Some(attributes) = instancing(node) else { return Ok(vec![DAffine3::IDENTITY]) };
        let copies = Copies::of(attributes);
        self.budget.take(copies.bytes(self.reader), 1)?;
        self.compare(i, &copies);
        Ok(copies.read(self.reader).unwrap_or_else(|why| self.without_copies(i, why)))
    }

    /// Warns if the attributes of the copies differ in count.
    fn compare(&mut self, i: usize, copies: &Copies) {
        let counts: Vec<(&str, u64)> = copies.counts(self.reader).collect();
        let all = counts.iter().map(|&(_, count)| count);
        let (Some(least), Some(most)) = (all.clone().min(), all.max()) else { return };
        if least == most {
            return;
        }
        let list: Vec<String> = counts.iter().map(|(name, count)| format!("{name} has {count}")).collect();
        let text = format!("attributes of copies differ in number: {}", list.join(", "));
        let place = format!("nodes[{i}].extensions.EXT_mesh_gpu_instancing.attributes");
        self.report.warn_with(Code::MeshPrimitiveUnequalAccessorCount, place, text, "copies without one are left out");
    }

    /// Transforms to use when those of the copies cannot be read.
    fn without_copies(&mut self, i: usize, why: Unreadable) -> Vec<DAffine3> {
        match why {
            Unreadable::Unknown => return vec![DAffine3::IDENTITY],
            Unreadable::Buffer(why) => self.report.fault(why),
            Unreadable::Nowhere(why) => self.report.warnings.push(why),
            Unreadable::Data(code, text) => self.report.add(code, format!("nodes[{i}]"), text),
        }
        Vec::new()
    }

    /// Index of the posed mesh of a node, which is added if it is new.
    fn posed(&mut self, i: usize, node: &Node, mesh: &Mesh) -> Option<usize> {
        let (index, skin) = (node.mesh?.value(), node.skin.map(|skin| skin.value()));
        let own = self.played.weights.get(&i).or(node.weights.as_ref());
        let weights = own.filter(|own| mesh.weights.as_ref() != Some(*own));
        let bits = weights.map(|weights| weights.iter().map(|w| w.to_bits()).collect());
        let posed = &mut self.placed.posed;
        Some(*self.known.entry((index, skin, bits)).or_insert_with(|| {
            posed.push(PosedMesh { mesh: index, weights: weights.cloned(), skin, drawn: true });
            posed.len() - 1
        }))
    }
}

/// Adds the meshes that no node of the scene shows, at rest.
fn unused(root: &Root, placed: &mut Placed) {
    let mut shown = vec![false; root.meshes.len()];
    for posed in &placed.posed {
        shown.get_mut(posed.mesh).into_iter().for_each(|shown| *shown = true);
    }
    let hidden = shown.iter().enumerate().filter(|(_, shown)| !**shown);
    let at_rest = |(mesh, _)| PosedMesh { mesh, weights: None, skin: None, drawn: false };
    placed.posed.extend(hidden.map(at_rest));
}

/// Returns whether KHR_node_visibility leaves a node visible. Hidden nodes hide their children, but no cameras.
fn is_visible(node: &Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("KHR_node_visibility"));
    extension.and_then(|e| e.get("visible")).and_then(Value::as_bool).unwrap_or(true)
}

/// Returns whether all scales are zero, by which glTF 2.0 (§3.5.3) lets animations hide meshes.
///
/// It does not hide skinned meshes, whose joints place them.
fn is_scaled_away(world: &DAffine3) -> bool {
    world.matrix3 == DMat3::ZERO
}

/// Returns the attributes of EXT_mesh_gpu_instancing.
fn instancing(node: &Node) -> Option<&Map<String, Value>> {
    let extension = node.extensions.as_ref()?.others.get("EXT_mesh_gpu_instancing")?;
    extension.get("attributes")?.as_object()
}

/// Accessors of EXT_mesh_gpu_instancing.
struct Copies {
    translations: Option<Index<Accessor>>,
    rotations: Option<Index<Accessor>>,
    scales: Option<Index<Accessor>>,
}

impl Copies {
    fn of(attributes: &Map<String, Value>) -> Self {
        let index =
            |name: &str| attributes.get(name).and_then(whole).and_then(|i| u32::try_from(i).ok()).map(Index::new);
        Self { translations: index("TRANSLATION"), rotations: index("ROTATION"), scales: index("SCALE") }
    }

    /// Number of elements of each accessor, with its name.
    fn counts(&self, reader: Reader) -> impl Iterator<Item = (&'static str, u64)> {
        let parts = [("TRANSLATION", self.translations), ("ROTATION", self.rotations), ("SCALE", self.scales)];
        parts.into_iter().filter_map(move |(name, index)| Some((name, reader.count(index?))))
    }

    /// Bytes of memory that reading the copies takes.
    fn bytes(&self, reader: Reader) -> u64 {
        let counts = self.counts(reader).map(|(_, count)| count).fold(0, u64::saturating_add);
        counts.saturating_mul((size_of::<[f32; 4]>() + size_of::<DAffine3>()) as u64)
    }

    /// Reads the transforms of the copies, in node space.
    fn read(&self, reader: Reader) -> Result<Vec<DAffine3>, Unreadable> {
        let translations = self.translations.map(|i| reader.floats::<3>(i, Pick::All)).transpose()?;
        let rotations = self.rotations.map(|i| reader.floats::<4>(i, Pick::All)).transpose()?;
        let scales = self.scales.map(|i| reader.floats::<3>(i, Pick::All)).transpose()?;
        let lengths =
            [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
        let count = lengths.into_iter().flatten().min().ok_or(Unreadable::Unknown)?;
        let copy = |k: usize| {
            let translation = translations.as_ref().map_or(DVec3::ZERO, |t| DVec3::from(t[k].map(f64::from)));
            let scale = scales.as_ref().map_or(DVec3::ONE, |s| DVec3::from(s[k].map(f64::from)));
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |r| DQuat::from_array(r[k].map(f64::from)));
            let rotation = if rotation.length() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
            DAffine3::from_scale_rotation_translation(scale, rotation, translation)
        };
        Ok((0..count).map(copy).collect())
    }
}
