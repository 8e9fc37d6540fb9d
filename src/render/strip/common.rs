//! What all points of a material have in common.

use crate::render::shade::{Matter, Model};
use crate::render::texture::TextureStore;
use crate::scene::{Material, MetalRough};

/// What is known of a material for all points of it.
pub(crate) struct Common {
    /// As it is where its maps are white.
    pub matter: Matter,
    /// Whether backs of faces are passed.
    pub one_sided: bool,
    /// Whether maps change it from point to point.
    pub mapped: bool,
    /// Whether rays bounce off it where it mirrors.
    bounces: bool,
}

impl Common {
    /// `None` for materials with a grain, film, sheen or lacquer, for those that let light through or scatter it through, for
    /// those that mirror it everywhere where rays bounce, and for those in which lights are seen small everywhere.
    pub(crate) fn of(material: &Material, store: &TextureStore, bounces: bool) -> Option<Self> {
        let metal_rough = material.metal_rough();
        if !material.is_opaque()
            || metal_rough.is_some_and(|m| m.has_lobes() || m.translucence.is_some() || has_other_maps(m))
        {
            return None;
        }
        let common = Self {
            matter: Matter::without_maps(material, store),
            one_sided: !material.double_sided,
            mapped: material.textures().next().is_some(),
            bounces,
        };
        // A map can only make it smoother than it is where that is white.
        common.can_be_beside(&common.matter).then_some(common)
    }

    /// Whether a point with this of the material can be shaded beside others.
    #[inline]
    pub(super) fn can_be_beside(&self, matter: &Matter) -> bool {
        let mirrors = match &matter.model {
            Model::Unlit(_) => false,
            Model::Phong(m) => m.mirrors(),
            Model::MetalRough(m) => m.mirrors(),
        };
        // How far a highlight must be widened differs from point to point.
        !(matter.has_narrow_highlight() || self.bounces && mirrors)
    }
}

/// Whether it has maps of more than its colour, roughness and metalness.
fn has_other_maps(m: &MetalRough) -> bool {
    m.maps().count() > usize::from(m.metal_rough_map.is_some())
}
