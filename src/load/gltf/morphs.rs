//! What morph targets change that the structs of the document have no place for: colours and texture coordinates.

use super::schema::{list, position};
use super::tree::{Map, Value};
use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::Semantic;
use std::collections::HashMap;

/// Such changes, by the numbers of mesh and primitive.
#[derive(Debug, Default)]
pub(super) struct Morphs(HashMap<[usize; 2], Vec<Change>>);

/// What is added to an attribute.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// The number of the target.
    pub(super) target: usize,
    pub(super) attribute: Semantic,
    pub(super) accessor: Index<Accessor>,
}

impl Morphs {
    /// Those of a document whose indices are right.
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

    /// Those of a primitive of a mesh, target by target.
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

/// Colours beyond the first are not shown, changed or not.
fn attribute(name: &str) -> Option<Semantic> {
    match name.strip_prefix("TEXCOORD_") {
        Some(set) => set.parse().ok().map(Semantic::TexCoords),
        None => (name == "COLOR_0").then_some(Semantic::Colors(0)),
    }
}
