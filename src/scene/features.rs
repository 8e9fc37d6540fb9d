//! Features that a scene needs, so that the renderer does no work for others.
//!
//! Only visible things count: materials that no face, sphere, cone or plane uses add no features. The renderer skips the work of
//! absent features; `inspect` lists both present and absent ones.

use super::{AlphaMode, Environment, LightKind, Material, Mesh, Phong, Reflection, Scene};
use crate::math::Vec3;
use std::collections::BTreeSet;
use std::fmt;

/// A feature that a scene may need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Feature {
    /// Triangles.
    Triangles,
    /// Whole n-gons.
    Polygons,
    /// Spheres.
    Spheres,
    /// Cones and cylinders.
    Cones,
    /// Unbounded planes.
    Planes,
    /// Meshes placed more than once.
    Instances,
    /// Interpolated normals.
    SmoothNormals,
    /// Vertex colours other than white.
    VertexColors,
    /// Any texture.
    Textures,
    /// Tangent-space normal maps.
    NormalMaps,
    /// Height maps.
    BumpMaps,
    /// Ambient occlusion maps.
    OcclusionMaps,
    /// Alpha-tested surfaces.
    Mask,
    /// Surfaces composited over what lies behind.
    Blend,
    /// The glTF metallic-roughness model.
    MetalRough,
    /// The Phong model.
    Phong,
    /// Unlit surfaces.
    Unlit,
    /// Emissive surfaces.
    Emission,
    /// Reflected rays: smooth metals, smooth dielectrics, Phong mirrors.
    Mirrors,
    /// Transmitted rays that go straight on.
    ThinTransmission,
    /// Transmitted rays that are refracted.
    Refraction,
    /// Volumes that absorb light.
    Absorption,
    /// Clear coat over a surface.
    Coat,
    /// Anisotropic surfaces, rougher along a grain than across it.
    Anisotropy,
    /// Thin films, whose colours change with the angle.
    Iridescence,
    /// Sheen of cloth.
    Sheen,
    /// Surfaces that transmit light diffusely.
    DiffuseTransmission,
    /// An index of refraction that depends on the wavelength.
    Dispersion,
    /// Point lights.
    PointLights,
    /// Directional lights.
    DirectionalLights,
    /// Spot lights.
    SpotLights,
    /// Rectangular lights.
    AreaLights,
    /// Lights that cast shadows.
    Shadows,
    /// Lights with an extent, which cast soft shadows.
    SoftShadows,
    /// An environment map.
    Panorama,
}

/// The features of one scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Features {
    present: BTreeSet<Feature>,
}

/// Perceptual roughness below which the renderer follows reflected rays, not only the blurred environment.
pub const SMOOTH: f32 = 0.2;

impl Feature {
    /// All features, in the order of reports.
    pub const ALL: [Self; 35] = [
        Self::Triangles,
        Self::Polygons,
        Self::Spheres,
        Self::Cones,
        Self::Planes,
        Self::Instances,
        Self::SmoothNormals,
        Self::VertexColors,
        Self::Textures,
        Self::NormalMaps,
        Self::BumpMaps,
        Self::OcclusionMaps,
        Self::Mask,
        Self::Blend,
        Self::MetalRough,
        Self::Phong,
        Self::Unlit,
        Self::Emission,
        Self::Mirrors,
        Self::ThinTransmission,
        Self::Refraction,
        Self::Absorption,
        Self::Coat,
        Self::Anisotropy,
        Self::Iridescence,
        Self::Sheen,
        Self::DiffuseTransmission,
        Self::Dispersion,
        Self::PointLights,
        Self::DirectionalLights,
        Self::SpotLights,
        Self::AreaLights,
        Self::Shadows,
        Self::SoftShadows,
        Self::Panorama,
    ];

    /// Name of the feature in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Triangles => "triangles",
            Self::Polygons => "polygons",
            Self::Spheres => "spheres",
            Self::Cones => "cones",
            Self::Planes => "planes",
            Self::Instances => "instances",
            Self::SmoothNormals => "smooth normals",
            Self::VertexColors => "vertex colours",
            Self::Textures => "textures",
            Self::NormalMaps => "normal maps",
            Self::BumpMaps => "bump maps",
            Self::OcclusionMaps => "occlusion maps",
            Self::Mask => "alpha mask",
            Self::Blend => "alpha blend",
            Self::MetalRough => "metallic-roughness",
            Self::Phong => "phong",
            Self::Unlit => "unlit",
            Self::Emission => "emission",
            Self::Mirrors => "mirrors",
            Self::ThinTransmission => "thin transmission",
            Self::Refraction => "refraction",
            Self::Absorption => "absorption",
            Self::Coat => "clearcoat",
            Self::Anisotropy => "anisotropy",
            Self::Iridescence => "iridescence",
            Self::Sheen => "sheen",
            Self::DiffuseTransmission => "diffuse transmission",
            Self::Dispersion => "dispersion",
            Self::PointLights => "point lights",
            Self::DirectionalLights => "directional lights",
            Self::SpotLights => "spot lights",
            Self::AreaLights => "area lights",
            Self::Shadows => "shadows",
            Self::SoftShadows => "soft shadows",
            Self::Panorama => "environment map",
        }
    }
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Features {
    /// Collects the features of a scene in one pass over its meshes and materials, without reading texels.
    pub fn of(scene: &Scene) -> Self {
        let mut features = Self::default();
        features.add_geometry(scene);
        for material in used_materials(scene).collect::<BTreeSet<u32>>() {
            if let Some(material) = scene.materials.get(material as usize) {
                features.add_material(material);
            }
        }
        features.add_lights(scene);
        features
    }

    /// Whether the scene needs `feature`.
    pub fn has(&self, feature: Feature) -> bool {
        self.present.contains(&feature)
    }

    /// Features that the scene needs, in the order of [`Feature::ALL`].
    pub fn present(&self) -> impl Iterator<Item = Feature> {
        Feature::ALL.into_iter().filter(|&feature| self.has(feature))
    }

    /// Features that the scene does not need, in the same order.
    pub fn absent(&self) -> impl Iterator<Item = Feature> {
        Feature::ALL.into_iter().filter(|&feature| !self.has(feature))
    }

    fn add_if(&mut self, there: bool, feature: Feature) {
        if there {
            self.present.insert(feature);
        }
    }

    fn add_geometry(&mut self, scene: &Scene) {
        let mut uses = vec![0u32; scene.meshes.len()];
        for instance in &scene.instances {
            if let Some(uses) = uses.get_mut(instance.mesh as usize) {
                *uses += 1;
            }
        }
        for (mesh, uses) in scene.meshes.iter().zip(uses).filter(|(mesh, uses)| *uses > 0 && has_faces(mesh)) {
            self.add_if(!mesh.triangles.is_empty(), Feature::Triangles);
            self.add_if(!mesh.polygons.is_empty(), Feature::Polygons);
            self.add_if(uses > 1, Feature::Instances);
            self.add_if(!mesh.normals.is_empty(), Feature::SmoothNormals);
            self.add_if(mesh.colors.iter().any(|c| c.to_array() != [1.0; 4]), Feature::VertexColors);
        }
        self.add_if(!scene.spheres.is_empty(), Feature::Spheres);
        self.add_if(!scene.cones.is_empty(), Feature::Cones);
        self.add_if(!scene.planes.is_empty(), Feature::Planes);
    }

    fn add_material(&mut self, m: &Material) {
        self.add_if(m.textures().next().is_some(), Feature::Textures);
        self.add_if(m.normal_map.is_some(), Feature::NormalMaps);
        self.add_if(m.bump_map.is_some(), Feature::BumpMaps);
        self.add_if(m.occlusion_map.is_some(), Feature::OcclusionMaps);
        self.add_if(matches!(m.alpha_mode, AlphaMode::Mask { .. }), Feature::Mask);
        self.add_if(m.alpha_mode == AlphaMode::Blend, Feature::Blend);
        self.add_if(m.emission.max_element() > 0.0, Feature::Emission);
        match &m.reflection {
            Reflection::Unlit => self.add_if(true, Feature::Unlit),
            Reflection::Phong(phong) => self.add_phong(phong),
            Reflection::MetalRough(pbr) => {
                self.add_if(true, Feature::MetalRough);
                self.add_if(pbr.anisotropy.is_some(), Feature::Anisotropy);
                self.add_if(pbr.iridescence.is_some(), Feature::Iridescence);
                self.add_if(pbr.sheen.is_some(), Feature::Sheen);
                self.add_if(pbr.diffuse_transmission.is_some(), Feature::DiffuseTransmission);
                if let Some(coat) = &pbr.coat {
                    self.add_if(true, Feature::Coat);
                    self.add_if(coat.roughness < SMOOTH || coat.roughness_map.is_some(), Feature::Mirrors);
                    self.add_if(coat.normal_map.is_some(), Feature::NormalMaps);
                }
                // A map can only lower the roughness, so a high factor may still hide smooth spots.
                self.add_if(pbr.roughness < SMOOTH || pbr.metal_rough_map.is_some(), Feature::Mirrors);
                if pbr.transmits() {
                    self.add_if(true, if pbr.thick { Feature::Refraction } else { Feature::ThinTransmission });
                    self.add_if(pbr.thick && pbr.dispersion > 0.0, Feature::Dispersion);
                    self.add_if(pbr.thick && pbr.absorption != Vec3::ZERO, Feature::Absorption);
                }
            }
        }
    }

    fn add_phong(&mut self, phong: &Phong) {
        self.add_if(true, Feature::Phong);
        self.add_if(phong.mirror.max_element() > 0.0, Feature::Mirrors);
        if phong.transmission.max_element() > 0.0 {
            let bends = phong.ior != 1.0;
            self.add_if(true, if bends { Feature::Refraction } else { Feature::ThinTransmission });
            self.add_if(bends && phong.dispersion > 0.0, Feature::Dispersion);
        }
    }

    fn add_lights(&mut self, scene: &Scene) {
        for light in &scene.lights {
            let kind = match light.kind {
                LightKind::Point { .. } => Feature::PointLights,
                LightKind::Directional { .. } => Feature::DirectionalLights,
                LightKind::Spot { .. } => Feature::SpotLights,
                LightKind::Rectangle { .. } => Feature::AreaLights,
            };
            self.add_if(true, kind);
            self.add_if(light.shadows, Feature::Shadows);
            self.add_if(light.shadows && light.is_wide(), Feature::SoftShadows);
        }
        self.add_if(scene.environment == Environment::Panorama, Feature::Panorama);
    }
}

impl fmt::Display for Features {
    /// `needs triangles, textures; leaves out polygons, …`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "needs {}; leaves out {}", list(self.present()), list(self.absent()))
    }
}

fn list(features: impl Iterator<Item = Feature>) -> String {
    let names: Vec<_> = features.map(Feature::name).collect();
    if names.is_empty() { "nothing".into() } else { names.join(", ") }
}

fn has_faces(mesh: &Mesh) -> bool {
    !mesh.triangles.is_empty() || !mesh.polygons.is_empty()
}

/// Whether the scene is entirely unlit: everything that can be hit shows its own colour. For most scenes the first material
/// decides.
pub fn is_unlit(scene: &Scene) -> bool {
    let mut materials = used_materials(scene).filter_map(|material| scene.materials.get(material as usize)).peekable();
    materials.peek().is_some() && materials.all(|material| matches!(material.reflection, Reflection::Unlit))
}

/// Indices of the materials of everything that can be hit, with repetitions.
fn used_materials(scene: &Scene) -> impl Iterator<Item = u32> {
    let placed = scene.instances.iter().filter_map(|instance| scene.meshes.get(instance.mesh as usize));
    let meshes = placed.filter(|mesh| has_faces(mesh)).map(|mesh| mesh.material);
    let spheres = scene.spheres.iter().map(|sphere| sphere.material);
    let cones = scene.cones.iter().map(|cone| cone.material);
    meshes.chain(spheres).chain(cones).chain(scene.planes.iter().map(|plane| plane.material))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::{Light, MetalRough, Sphere};

    fn ball(reflection: Reflection) -> Scene {
        let sphere = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 };
        let material = Material { reflection, ..Material::default() };
        Scene { spheres: vec![sphere], materials: vec![material], ..Scene::default() }
    }

    #[test]
    fn a_scene_is_unlit_where_all_that_can_be_hit_is() {
        let mut scene = ball(Reflection::Unlit);
        assert!(is_unlit(&scene) && !is_unlit(&Scene::default()));
        scene.materials.push(Material::plain());
        assert!(is_unlit(&scene), "the other is on nothing");
        scene.spheres.push(Sphere { material: 1, ..scene.spheres[0].clone() });
        assert!(!is_unlit(&scene));
    }

    #[test]
    fn a_scene_lists_what_it_needs_and_what_it_does_not() {
        let mut scene = ball(Reflection::Phong(Phong { mirror: Vec3::splat(0.5), ..Phong::default() }));
        let kind = LightKind::Directional { direction: DVec3::NEG_Y };
        scene.lights.push(Light { name: String::new(), intensity: Vec3::ONE, kind, shadows: false, size: 0.0 });
        let features = Features::of(&scene);
        let present: Vec<_> = features.present().collect();
        assert_eq!(present, [Feature::Spheres, Feature::Phong, Feature::Mirrors, Feature::DirectionalLights]);
        assert_eq!(features.absent().count() + present.len(), Feature::ALL.len());
        assert!(features.to_string().starts_with("needs spheres, phong, mirrors, directional lights; leaves out tri"));
    }

    #[test]
    fn a_material_nobody_uses_needs_nothing() {
        let mut scene = ball(Reflection::Unlit);
        let glass = Phong { transmission: Vec3::ONE, ior: 1.5, ..Phong::default() };
        scene.materials.push(Material { reflection: Reflection::Phong(glass), ..Material::default() });
        assert!(!Features::of(&scene).has(Feature::Refraction));
        scene.spheres[0].material = 1;
        assert!(Features::of(&scene).has(Feature::Refraction));
    }

    #[test]
    fn glass_refracts_only_when_it_is_thick() {
        let glass =
            |thick| MetalRough { metallic: 0.0, roughness: 0.0, transmission: 1.0, thick, ..MetalRough::default() };
        let thin = Features::of(&ball(Reflection::MetalRough(glass(false))));
        assert!(thin.has(Feature::ThinTransmission) && !thin.has(Feature::Refraction) && thin.has(Feature::Mirrors));
        let thick = Features::of(&ball(Reflection::MetalRough(glass(true))));
        assert!(!thick.has(Feature::ThinTransmission) && thick.has(Feature::Refraction));
    }

    #[test]
    fn an_empty_scene_needs_nothing() {
        assert!(Features::of(&Scene::default()).to_string().starts_with("needs nothing; leaves out triangles"));
    }
}
