//! What all points of a material have in common.

use super::sheet::Sheet;
use crate::render::context::coverage;
use crate::render::shade::{Matter, Model, lets_light_in};
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
    /// Those maps, where they can be read side by side.
    pub sheet: Option<Sheet>,
    /// Whether it may mirror, where rays bounce, or show lights as narrow highlights.
    pub shiny: bool,
}

impl Common {
    /// `None` for materials with a grain, film, sheen or lacquer, for those that let light through or scatter it through, for
    /// those with maps of their reflectance, and for those that are nowhere there as a whole.
    pub(crate) fn of(material: &Material, store: &TextureStore, bounces: bool) -> Option<Self> {
        let metal_rough = material.metal_rough();
        if lets_light_in(material)
            || coverage(material, material.opacity) < 1.0
            || metal_rough.is_some_and(|m| m.has_lobes() || m.translucence.is_some() || has_other_maps(m))
        {
            return None;
        }
        let matter = Matter::without_maps(material, store);
        let mirrors = match &matter.model {
            Model::Unlit(_) => false,
            Model::Phong(m) => m.mirrors(),
            Model::MetalRough(m) => m.mirrors(),
        };
        // A map can make it smoother.
        let smooth = metal_rough.is_some_and(|m| m.metal_rough_map.is_some());
        Some(Self {
            shiny: smooth || matter.has_narrow_highlight() || bounces && mirrors,
            matter,
            one_sided: !material.double_sided,
            mapped: material.textures().next().is_some(),
            sheet: Sheet::of(material, store),
        })
    }
}

/// Whether it has maps of more than its colour, roughness and metalness.
fn has_other_maps(m: &MetalRough) -> bool {
    m.maps().count() > usize::from(m.metal_rough_map.is_some())
}
