//! Families of scenes of any size, to measure how cost grows with the number of triangles.
//!
//! After the Standard Procedural Databases (E. Haines, *A Proposal for Standard Graphics Environments*, 1987), as
//! triangles: every family takes the wanted number of triangles and comes as near to it as its rule allows. All are formulas
//! with fixed random streams: the same on every machine.

mod balls;
mod gears;
mod instances;
mod mountain;
mod pot;
mod solid;
mod stadium;
mod tetra;
mod tree;

use crate::math::{DAffine3, Vec3};
use crate::named::names;
use crate::scene::{Instance, Material, Mesh, MetalRough, Reflection, Scene, UpAxis};

/// Largest number of triangles of a scene.
pub const MAX_TRIANGLES: usize = 10_000_000;

/// A family of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Tetrahedra within a tetrahedron: even in space, much of it empty.
    Tetra,
    /// Toothed wheels side by side and in layers: long thin faces.
    Gears,
    /// Balls on balls on balls, on a floor: many sizes at once.
    Balls,
    /// Branches on branches over one huge floor.
    Tree,
    /// A rough height field with four glass balls above it.
    Mountain,
    /// A small pot in a huge bowl: all detail in one place.
    Stadium,
    /// One pot, many times.
    Instances,
}

names!(
    Family, "family",
    Tetra => "tetra",
    Gears => "gears",
    Balls => "balls",
    Tree => "tree",
    Mountain => "mountain",
    Stadium => "stadium",
    Instances => "instances",
);

impl Family {
    /// Builds the scene of about `triangles` triangles, clamped to 1 to [`MAX_TRIANGLES`], z upwards.
    pub fn scene(self, triangles: usize) -> Scene {
        let wanted = triangles.clamp(1, MAX_TRIANGLES);
        match self {
            Self::Tetra => tetra::scene(wanted),
            Self::Gears => gears::scene(wanted),
            Self::Balls => balls::scene(wanted),
            Self::Tree => tree::scene(wanted),
            Self::Mountain => mountain::scene(wanted),
            Self::Stadium => stadium::scene(wanted),
            Self::Instances => instances::scene(wanted),
        }
    }
}

/// Number of triangles in a scene, each instance counted.
pub fn triangles(scene: &Scene) -> usize {
    scene.instances.iter().map(|i| scene.meshes[i.mesh as usize].triangles.len()).sum()
}

/// Material of one matt or glossy colour.
fn paint(name: &str, base_color: Vec3, metallic: f32, roughness: f32) -> Material {
    let reflection = Reflection::MetalRough(MetalRough { metallic, roughness, ..MetalRough::default() });
    Material { name: name.into(), base_color, double_sided: true, reflection, ..Material::default() }
}

/// Scene with one untransformed instance of each mesh.
fn standing(meshes: Vec<Mesh>, materials: Vec<Material>) -> Scene {
    #[expect(clippy::cast_possible_truncation, reason = "a handful of meshes")]
    let instance = |(i, mesh): (usize, &Mesh)| Instance {
        name: mesh.name.clone(),
        mesh: i as u32,
        world_from_object: DAffine3::IDENTITY,
    };
    let instances = meshes.iter().enumerate().map(instance).collect();
    Scene { meshes, instances, materials, up: UpAxis::Z, ..Scene::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_comes_near_the_size_that_is_wanted() {
        for family in Family::ALL {
            for wanted in [1000, 5000, 20_000, 100_000] {
                let scene = family.scene(wanted);
                let ratio = triangles(&scene) as f64 / wanted as f64;
                // Families of powers come as near as the ratio of two successive powers allows.
                assert!((0.45..2.2).contains(&ratio), "{family} {wanted}: {}", triangles(&scene));
                let finite = scene.meshes.iter().flat_map(|m| &m.positions).all(|p| p.is_finite());
                let sound = scene.meshes.iter().all(|m| {
                    m.triangles.iter().flatten().all(|&i| (i as usize) < m.positions.len())
                        && (m.material as usize) < scene.materials.len()
                });
                assert!(finite && sound, "{family} {wanted}");
            }
        }
    }

    #[test]
    fn the_smallest_scene_of_every_family_has_something_to_see() {
        for family in Family::ALL {
            assert!(triangles(&family.scene(1)) > 0, "{family}");
        }
    }
}
