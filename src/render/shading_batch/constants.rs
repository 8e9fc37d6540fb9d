//! Data shared by all points of a material.

use super::material_maps::MaterialMaps;
use crate::render::context::Gloss;
use crate::render::shade::{Bsdf, Model, has_inside};
use crate::render::texture::TextureStore;
use crate::scene::{Material, MetalRough};

/// Data of a material that is the same at all its points.
pub(crate) struct MaterialConstants {
    /// Index of the material.
    pub material: u32,
    /// The material where all maps are white.
    pub bsdf: Bsdf,
    /// Whether rays pass backs of faces.
    pub one_sided: bool,
    /// Coverage without maps and vertex colours.
    pub coverage: f32,
    /// Whether it has maps.
    pub mapped: bool,
    /// These maps and the vertex colours, where they can be read side by side.
    pub material_maps: Option<MaterialMaps>,
    /// Whether footprints and curvature are needed: it may mirror, where rays bounce, or have narrow highlights, or lobes that
    /// may.
    pub needs_cones: bool,
    /// Data of a transmitting material, whose refracted rays are followed.
    pub glass: Option<Glass>,
    /// Further lobes, or maps read point by point.
    pub lobes: Option<Lobes>,
    /// Whether reflection and transmission are seen by rays alone, and rays may go on.
    pub spreads: bool,
}

/// Data of a material with lobes beyond its microfacets, or maps of its reflectance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobes {
    /// Whether the mesh around a point is needed, …
    pub reads_mesh: bool,
    /// … or is needed if maps of lobes cannot be read side by side.
    pub reads_maps: bool,
    /// Whether it has maps of its reflectance.
    pub reads_reflectance: bool,
    /// Whether the lobes are sheen and clear coat alone, which do not change the layers below.
    pub are_overlays: bool,
}

/// Data of a transmitting material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glass {
    /// Whether backs of faces are seen from inside.
    pub has_inside: bool,
    /// Whether the surface itself shows no light from inside, only what its secondary rays find.
    pub is_dark_inside: bool,
}

impl MaterialConstants {
    /// `None` for a transmitting material, unless it is metallic-rough and rays pass through it without being scattered inside.
    pub(crate) fn of(
        number: u32,
        material: &Material,
        store: &TextureStore,
        bounces: bool,
        gloss: Gloss,
    ) -> Option<Self> {
        let metal_rough = material.metal_rough();
        let mut bsdf = Bsdf::without_maps(material, store);
        let glass = material.reflection.transmits();
        let lobes = metal_rough.and_then(Lobes::of);
        let spreads = bounces && gloss.spreads(material);
        if glass {
            metal_rough.filter(|m| spreads && !scatters_inside(m) && m.diffuse_transmission.is_none())?;
        }
        if spreads {
            bsdf.spread_by_rays();
        }
        let mirrors = match &bsdf.model {
            Model::Unlit(_) => false,
            Model::Phong(m) => m.mirrors(),
            Model::MetalRough(m) => m.mirrors(),
        };
        // A map can make it smoother.
        let smooth = metal_rough.is_some_and(|m| m.metal_rough_map.is_some());
        Some(Self {
            material: number,
            needs_cones: glass || lobes.is_some() || smooth || bsdf.has_narrow_highlight() || bounces && mirrors,
            one_sided: !material.double_sided && !glass,
            coverage: material.alpha_mode.covers(material.opacity),
            mapped: material.textures().next().is_some(),
            material_maps: MaterialMaps::of(material, store),
            glass: glass.then(|| Glass::of(material, &bsdf)),
            lobes,
            spreads: spreads && metal_rough.is_some(),
            bsdf,
        })
    }

    /// Whether its secondary rays are computed point by point.
    pub(crate) fn sends_by_points(&self) -> bool {
        self.glass.is_some() || self.lobes.is_some() || self.spreads
    }

    /// Whether its BSDF is computed point by point.
    pub(crate) fn is_completed(&self) -> bool {
        self.lobes.is_some_and(|lobes| !lobes.are_overlays)
    }

    /// Whether backs of faces are seen from inside.
    pub(crate) fn has_inside(&self) -> bool {
        self.glass.is_some_and(|glass| glass.has_inside)
    }
}

impl Lobes {
    /// `None` for materials without any.
    fn of(m: &MetalRough) -> Option<Self> {
        let reads_maps = other_maps(m) > 0;
        let reads_mesh = m.anisotropy.is_some() || m.coat.as_ref().is_some_and(|coat| coat.normal_map.is_some());
        let reads_reflectance = reads_reflectance(m);
        let changes_core =
            m.anisotropy.is_some() || m.iridescence.is_some() || m.diffuse_transmission.is_some() || reads_reflectance;
        (m.has_lobes() || m.diffuse_transmission.is_some() || reads_maps).then_some(Self {
            reads_mesh,
            reads_maps,
            reads_reflectance,
            are_overlays: !changes_core && m.transmission <= 0.0,
        })
    }
}

impl Glass {
    fn of(material: &Material, bsdf: &Bsdf) -> Self {
        let has_inside = has_inside(material);
        let changes = |m: &MetalRough| m.transmission_map.is_some() || m.metal_rough_map.is_some();
        let changes = material.metal_rough().is_some_and(changes);
        Self { has_inside, is_dark_inside: has_inside && !changes && bsdf.is_dark_inside() }
    }
}

/// Whether transmitted light may be scattered from inside: its share is computed point by point.
fn scatters_inside(m: &MetalRough) -> bool {
    m.thick && (m.transmission < 1.0 || m.transmission_map.is_some())
}

/// Whether it has maps of its reflectance.
pub(super) fn reads_reflectance(m: &MetalRough) -> bool {
    m.specular_map.is_some() || m.specular_color_map.is_some()
}

/// Number of its maps other than those of colour, roughness, metalness and transmission: of its reflectance, and of lobes.
/// Thickness matters only where it is looked up, and does not count.
pub(super) fn other_maps(m: &MetalRough) -> usize {
    let known = [&m.metal_rough_map, &m.transmission_map, &m.thickness_map];
    m.maps().count() - known.into_iter().flatten().count()
}
