//! Changes by morph targets for which the typed document has no fields: colours and texture coordinates.

use super::schema::{list, position};
use super::tree::{Map, Value};
use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::Semantic;
use std::collections::HashMap;

/// These changes, by the indices of mesh and primitive.
#[derive(Debug, Default)]
pub(super) struct Morphs(HashMap<[usize; 2], Vec<Change>>);

/// Change of an attribute by a morph target.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// Index of the morph target.
    pub(super) target: usize,
    pub(super) attribute: Semantic,
    pub(super) accessor: Index<Accessor>,
}

impl Morphs {
    /// Collects the changes of a document whose indices are valid.
    pub(super) fn of(root: &Value) -> Self {
        let mut morphs = Self::default();
        for (i, mesh) in list(root, "meshes").iter().enumerate() {
            for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
                let targets = list(primitive, "targets").iter().enumerate();
                let changes: Vec<Change> = targets.flat_map(|(at, target)| changes(at, target)).collect();
                if !changes.is_empty() {
                    morphs.0.insert([i, k], changes);
                }
            }
        }
        morphs
    }

    /// Changes of a primitive, ordered by target.
    pub(super) fn of_primitive(&self, mesh: usize, primitive: usize) -> &[Change] {
        self.0.get(&[mesh, primitive]).map_or(&[], Vec::as_slice)
    }
}

fn changes(number: usize, target: &Value) -> impl Iterator<Item = Change> {
    target.as_object().into_iter().flat_map(Map::iter).filter_map(move |(name, accessor)| {
        let accessor = Index::new(u32::try_from(position(accessor)?).ok()?);
        Some(Change { target: number, attribute: attribute(name)?, accessor })
    })
}

/// Parses an attribute; colour sets after the first are not drawn, changed or not.
fn attribute(name: &str) -> Option<Semantic> {
    match name.strip_prefix("TEXCOORD_") {
        Some(set) => set.parse().ok().map(Semantic::TexCoords),
        None => (name == "COLOR_0").then_some(Semantic::Colors(0)),
    }
}
