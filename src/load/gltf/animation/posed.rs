//! The document at a moment of an animation.

use super::pointer::Entry;
use super::{Animation, Pose, Target};
use crate::load::gltf::tree;
use gltf::json::Root;
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashMap;

/// Original JSON of the entries that pointers target.
#[derive(Clone, Debug, Default)]
pub(in crate::load::gltf) struct Originals(HashMap<Entry, Value>);

impl Originals {
    /// Copies the entries that animations change from the JSON.
    pub(in crate::load::gltf) fn of(root: &tree::Value, animations: &[Animation]) -> Self {
        let mut originals = HashMap::new();
        for channel in animations.iter().flat_map(|animation| &animation.channels).flatten() {
            // Weights are changed in the typed document, as meshes may be large.
            if let Target::Pointed(pointed) = &channel.target
                && pointed.weights().is_none()
                && let Some(part) = root.pointer(&pointed.entry.pointer())
            {
                originals.entry(pointed.entry).or_insert_with(|| part.owned());
            }
        }
        Self(originals)
    }
}

impl Pose {
    /// Returns whether the pose changes more than nodes' transforms and weights.
    pub(in crate::load::gltf) fn changes_document(&self) -> bool {
        !self.changes.is_empty() || !self.mesh_weights.is_empty()
    }

    /// Returns the document at the moment. Entries that broke the schema, which has been reported, are unchanged.
    pub(in crate::load::gltf) fn posed(&self, root: &Root, originals: &Originals) -> Root {
        let mut posed = root.clone();
        for (&mesh, weights) in &self.mesh_weights {
            posed.meshes.get_mut(mesh).into_iter().for_each(|mesh| mesh.weights = Some(weights.clone()));
        }
        let mut parts: HashMap<Entry, Value> = HashMap::new();
        for change in &self.changes {
            let entry = change.pointed.entry;
            let Some(original) = originals.0.get(&entry) else { continue };
            let part = parts.entry(entry).or_insert_with(|| original.clone());
            put(part, &change.pointed.steps, change.value.clone());
        }
        for (entry, part) in parts {
            replace(&mut posed, entry, part);
        }
        posed
    }
}

/// Inserts a value at a path; does nothing if an enclosing object is missing.
fn put(part: &mut Value, steps: &[String], value: Value) {
    let Some((last, way)) = steps.split_last() else { return };
    let enclosing = way.iter().try_fold(part, |part, step| part.get_mut(step));
    if let Some(enclosing) = enclosing.and_then(Value::as_object_mut) {
        enclosing.insert(last.clone(), value);
    }
}

/// Replaces an entry of the document.
fn replace(root: &mut Root, entry: Entry, part: Value) {
    fn set<T: for<'a> Deserialize<'a>>(slot: Option<&mut T>, part: Value) {
        if let Some((slot, part)) = slot.zip(serde_json::from_value(part).ok()) {
            *slot = part;
        }
    }
    match entry {
        Entry::Camera(i) => set(root.cameras.get_mut(i), part),
        Entry::Light(i) => {
            let lights = root.extensions.as_mut().and_then(|extensions| extensions.khr_lights_punctual.as_mut());
            set(lights.and_then(|lights| lights.lights.get_mut(i)), part);
        }
        Entry::Material(i) => set(root.materials.get_mut(i), part),
        Entry::Mesh(i) => set(root.meshes.get_mut(i), part),
        Entry::Node(i) => set(root.nodes.get_mut(i), part),
    }
}
