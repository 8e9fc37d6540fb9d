//! Which scene of the file is drawn, and what stands where in it.

use super::accessor::{Pick, Reader, Unreadable};
use super::codes::Code;
use super::graph::Graph;
use super::placed;
use super::report::Report;
use super::schema::whole;
use crate::load::Diagnostic;
use crate::math::{DAffine3, DQuat, DVec3};
use crate::scene::{Camera, Light};
use gltf::json::{Index, Root, scene::Node};
use serde_json::{Map, Value};
use std::path::Path;

/// A mesh in one shape: morphed by these weights, posed by this skin.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variant {
    pub(super) mesh: usize,
    pub(super) weights: Vec<f32>,
    pub(super) skin: Option<usize>,
    /// Whether the scene shows it; others are only checked.
    pub(super) drawn: bool,
}

/// A variant in its place.
pub(super) struct Draw {
    pub(super) name: String,
    pub(super) variant: usize,
    pub(super) world: DAffine3,
}

/// Everything that the nodes of a scene place.
#[derive(Default)]
pub(super) struct Placed {
    pub(super) variants: Vec<Variant>,
    pub(super) draws: Vec<Draw>,
    pub(super) cameras: Vec<Camera>,
    pub(super) lights: Vec<Light>,
}

/// Names of all scenes.
pub(super) fn names(root: &Root) -> Vec<String> {
    root.scenes.iter().map(|scene| scene.name.clone().unwrap_or_default()).collect()
}

/// The scene that is asked for by index or name; without a wish, the default one, or else the first.
pub(super) fn choose(root: &Root, wish: Option<&str>, file: &Path) -> Result<usize, Diagnostic> {
    let Some(wish) = wish else { return Ok(root.scene.map_or(0, |scene| scene.value())) };
    let by_name = root.scenes.iter().position(|scene| scene.name.as_deref() == Some(wish));
    let by_index = wish.parse().ok().filter(|&i: &usize| i < root.scenes.len());
    by_name.or(by_index).ok_or_else(|| {
        let shown = |(i, name): (usize, String)| if name.is_empty() { i.to_string() } else { format!("{i} '{name}'") };
        let list: Vec<String> = names(root).into_iter().enumerate().map(shown).collect();
        let text = format!("there is no scene '{wish}'");
        let remedy = if list.is_empty() { "the file has none".into() } else { format!("it has {}", list.join(", ")) };
        Diagnostic::new("gltf-no-such-scene", file, "scenes", text).remedy(remedy)
    })
}

/// Walks the nodes of a scene; a file without scenes shows all its nodes.
pub(super) fn walk(reader: Reader, graph: &Graph, scene: usize, report: &mut Report) -> Placed {
    let root = reader.root;
    let mut stack: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => graph.roots().collect(),
    };
    stack.reverse();
    let mut seen = vec![false; root.nodes.len()];
    let mut placed = Placed::default();
    while let Some(i) = stack.pop() {
        let Some(node) = root.nodes.get(i).filter(|node| is_visible(node)) else { continue };
        if std::mem::replace(&mut seen[i], true) {
            continue;
        }
        stack.extend(node.children.iter().flatten().rev().map(|child| child.value()));
        let world = graph.world.get(i).copied().unwrap_or_default();
        placed.cameras.extend(placed::camera(root, node, world, report));
        placed.lights.extend(placed::light(root, node, world, report));
        place_mesh(reader, i, node, world, &mut placed, report);
    }
    unused(root, &mut placed);
    placed
}

fn place_mesh(reader: Reader, i: usize, node: &Node, world: DAffine3, placed: &mut Placed, report: &mut Report) {
    let Some(mesh) = node.mesh else { return };
    let defaults = || reader.root.meshes.get(mesh.value()).and_then(|mesh| mesh.weights.clone());
    let mut weights = node.weights.clone().or_else(defaults).unwrap_or_default();
    weights.iter_mut().filter(|w| !w.is_finite()).for_each(|w| *w = 0.0);
    let skin = node.skin.map(|skin| skin.value());
    let variant = Variant { mesh: mesh.value(), weights, skin, drawn: true };
    let known = placed.variants.iter().position(|v| *v == variant);
    let variant = known.unwrap_or_else(|| {
        placed.variants.push(variant);
        placed.variants.len() - 1
    });
    let name = node.name.clone().unwrap_or_default();
    let mut draw = |world: DAffine3| {
        if world.is_finite() {
            placed.draws.push(Draw { name: name.clone(), variant, world });
        } else {
            report.warn(Code::AccessorInvalidFloat, format!("nodes[{i}]"), "a node without a finite place is left out");
        }
    };
    match instancing(node) {
        None => draw(world),
        Some(attributes) => match copies(reader, attributes) {
            Ok(copies) => copies.into_iter().for_each(|local| draw(world * local)),
            Err(Unreadable::Buffer(why)) => report.fault(why),
            Err(Unreadable::Nowhere(why)) => report.warnings.push(why),
            Err(Unreadable::Data(code, text)) => report.add(code, format!("nodes[{i}]"), text),
            Err(Unreadable::Unknown) => draw(world),
        },
    }
}

/// Variants for the meshes that no node of the scene shows.
fn unused(root: &Root, placed: &mut Placed) {
    let mut shown = vec![false; root.meshes.len()];
    for variant in &placed.variants {
        shown.get_mut(variant.mesh).into_iter().for_each(|shown| *shown = true);
    }
    let hidden = shown.iter().enumerate().filter(|(_, shown)| !**shown);
    let variant = |(mesh, _)| Variant { mesh, weights: Vec::new(), skin: None, drawn: false };
    placed.variants.extend(hidden.map(variant));
}

/// KHR_node_visibility: hidden nodes hide their children.
fn is_visible(node: &Node) -> bool {
    let extension = node.extensions.as_ref().and_then(|e| e.others.get("KHR_node_visibility"));
    extension.and_then(|e| e.get("visible")).and_then(Value::as_bool).unwrap_or(true)
}

/// EXT_mesh_gpu_instancing: the attributes of copies.
fn instancing(node: &Node) -> Option<&Map<String, Value>> {
    let extension = node.extensions.as_ref()?.others.get("EXT_mesh_gpu_instancing")?;
    extension.get("attributes")?.as_object()
}

/// Where the copies stand in the space of their node.
fn copies(reader: Reader, attributes: &Map<String, Value>) -> Result<Vec<DAffine3>, Unreadable> {
    let index = |name: &str| attributes.get(name).and_then(whole).and_then(|i| u32::try_from(i).ok()).map(Index::new);
    let translations = index("TRANSLATION").map(|i| reader.floats::<3>(i, Pick::All)).transpose()?;
    let rotations = index("ROTATION").map(|i| reader.floats::<4>(i, Pick::All)).transpose()?;
    let scales = index("SCALE").map(|i| reader.floats::<3>(i, Pick::All)).transpose()?;
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
