//! Materials that are the same all over a mesh and send no rays on.

use crate::render::shade::{Matter, Model};
use crate::render::texture::TextureStore;
use crate::scene::Material;

/// What is known of a material for all points.
pub(crate) struct Uniform {
    pub matter: Matter,
    /// Whether backs of faces are passed.
    pub one_sided: bool,
}

impl Uniform {
    /// `None` for materials with maps, a grain, film, sheen or lacquer, those that let light through or scatter it through,
    /// those that mirror it where rays bounce, and those in which lights are seen small.
    pub(crate) fn of(material: &Material, store: &TextureStore, bounces: bool) -> Option<Self> {
        if material.textures().next().is_some()
            || !material.is_opaque()
            || material.metal_rough().is_some_and(|m| m.has_lobes() || m.translucence.is_some())
        {
            return None;
        }
        let matter = Matter::without_maps(material, store);
        let mirrors = match &matter.model {
            Model::Unlit(_) => false,
            Model::Phong(m) => m.mirrors(),
            Model::MetalRough(m) => m.mirrors(),
        };
        // How far a highlight must be widened differs from point to point.
        (!(matter.has_narrow_highlight() || bounces && mirrors))
            .then_some(Self { matter, one_sided: !material.double_sided })
    }
}
