//! Materials of the drawn primitives, and the task of reading each primitive.

use super::material;
use super::mesh::{Job, Needs};
use super::morphs::Morphs;
use super::scene::{Placed, PosedMesh};
use super::skin::Skin;
use super::textures::Textures;
use super::variants;
use crate::scene::Material;
use gltf::json::Root;
use gltf::json::mesh as source;

/// Materials in use, and their mapping from the file's indices.
pub(super) struct Palette<'a> {
    /// Index of the requested material variant.
    variant: Option<usize>,
    /// Whether missing normals will be smoothed.
    smooths: bool,
    pub(super) materials: Vec<Material>,
    needs: Vec<Needs>,
    /// Index into `materials` for each material of the file; the last entry is the default material.
    index: Vec<Option<u32>>,
    pub(super) textures: Textures<'a>,
    morphs: &'a Morphs,
}

impl<'a> Palette<'a> {
    /// Converts the materials of the drawn primitives.
    pub(super) fn new(
        root: &'a Root,
        morphs: &'a Morphs,
        placed: &Placed,
        variant: Option<usize>,
        smooths: bool,
    ) -> Self {
        let default = root.materials.len();
        let mut palette = Self {
            variant,
            smooths,
            materials: Vec::new(),
            needs: Vec::new(),
            index: vec![None; default + 1],
            textures: Textures::new(root),
            morphs,
        };
        let drawn = placed.posed.iter().filter(|posed| posed.drawn).filter_map(|posed| root.meshes.get(posed.mesh));
        for primitive in drawn.flat_map(|mesh| &mesh.primitives) {
            let i = variants::material(primitive, variant).unwrap_or(default);
            if palette.index.get(i).is_none_or(Option::is_some) {
                continue;
            }
            let material = match root.materials.get(i) {
                Some(source) => material::convert(source, &mut palette.textures),
                None => Material { name: "default".into(), ..Material::default() },
            };
            palette.index[i] = u32::try_from(palette.materials.len()).ok();
            palette.needs.push(material::needs(&material));
            palette.materials.push(material);
        }
        palette
    }

    /// Material of a primitive; `None` when it is not drawn.
    pub(super) fn material(&self, posed: &PosedMesh, primitive: &source::Primitive) -> Option<u32> {
        // The default material is the last entry.
        let i = variants::material(primitive, self.variant).unwrap_or(self.index.len().checked_sub(1)?);
        self.index.get(i).copied().flatten().filter(|_| posed.drawn)
    }

    /// Task of reading a primitive, the `k`th of its mesh.
    pub(super) fn job<'j>(
        &'j self,
        posed: &'j PosedMesh,
        mesh: &'j source::Mesh,
        k: usize,
        primitive: &'j source::Primitive,
        skins: &'j [Option<Skin>],
    ) -> Job<'j> {
        let needs = self.material(posed, primitive).and_then(|material| self.needs.get(material as usize));
        Job {
            primitive,
            place: format!("meshes[{}].primitives[{k}]", posed.mesh),
            name: mesh.name.as_deref().unwrap_or_default(),
            weights: posed.weights.as_deref().or(mesh.weights.as_deref()).unwrap_or_default(),
            changes: self.morphs.of_primitive(posed.mesh, k),
            skin: posed.skin.and_then(|s| skins.get(s)).and_then(Option::as_ref),
            needs: needs.cloned().unwrap_or_default(),
            drawn: posed.drawn,
            smooths: self.smooths,
        }
    }
}
