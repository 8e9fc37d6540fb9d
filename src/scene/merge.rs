//! Merging one scene into another.

use super::{Light, LightKind, Scene, UpAxis};
use crate::math::{DAffine3, DMat3, DVec3};
use std::mem::take;

/// Offsets of the meshes and materials of a part among those of the whole scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    meshes: u32,
    materials: u32,
}

impl Scene {
    /// Adds all of `part`, placed by `world_from_part`; a part whose up axis differs is turned upright first.
    ///
    /// Ambient light, environment, background and hints remain those of this scene. Indices of `part` are shifted; those of this
    /// scene stay valid. Radii of spheres and cones scale by the cube root of the determinant.
    pub fn append(&mut self, mut part: Self, world_from_part: &DAffine3) -> Stored {
        let stored = self.store(&mut part);
        self.place(part, stored, world_from_part);
        stored
    }

    /// The placed contents of this scene, as taken by [`Self::place`]: little data, compared to the meshes and pictures.
    pub fn places(&self) -> Self {
        Self {
            up: self.up,
            instances: self.instances.clone(),
            spheres: self.spheres.clone(),
            cones: self.cones.clone(),
            planes: self.planes.clone(),
            lights: self.lights.clone(),
            cameras: self.cameras.clone(),
            photometric: self.photometric,
            ..Self::default()
        }
    }

    /// Takes from `part` what does not depend on its placement.
    fn store(&mut self, part: &mut Self) -> Stored {
        let [meshes, materials, textures, bitmaps] =
            [self.meshes.len(), self.materials.len(), self.textures.len(), self.bitmaps.len()].map(count);
        self.bitmaps.append(&mut part.bitmaps);
        self.textures.extend(take(&mut part.textures).into_iter().map(|mut t| {
            t.bitmap += bitmaps;
            t
        }));
        self.materials.extend(take(&mut part.materials).into_iter().map(|mut m| {
            m.textures_mut().into_iter().flatten().for_each(|t| t.texture += textures);
            m
        }));
        self.meshes.extend(take(&mut part.meshes).into_iter().map(|mut m| {
            m.material += materials;
            m
        }));
        Stored { meshes, materials }
    }

    /// Places the [`Self::places`] of a part, whose meshes and materials this scene has stored; may be called any number of
    /// times.
    pub fn place(&mut self, part: Self, Stored { meshes, materials }: Stored, world_from_part: &DAffine3) {
        let place = *world_from_part * part.up.turned_to(self.up);
        self.instances.extend(part.instances.into_iter().map(|mut i| {
            i.mesh += meshes;
            i.world_from_object = place * i.world_from_object;
            i
        }));
        let scale = libm::cbrt(DMat3::determinant(&place.matrix3).abs());
        self.spheres.extend(part.spheres.into_iter().map(|mut s| {
            s.center = place.transform_point3(s.center);
            s.radius *= scale;
            s.material += materials;
            s
        }));
        self.cones.extend(part.cones.into_iter().map(|mut c| {
            (c.base, c.apex) = (place.transform_point3(c.base), place.transform_point3(c.apex));
            (c.base_radius, c.apex_radius) = (c.base_radius * scale, c.apex_radius * scale);
            c.material += materials;
            c
        }));
        self.planes.extend(part.planes.into_iter().map(|mut p| {
            let point = place.transform_point3(p.normal * p.offset);
            p.normal = (place.matrix3.inverse().transpose() * p.normal).normalize_or(DVec3::Y);
            p.offset = p.normal.dot(point);
            p.material += materials;
            p
        }));
        self.photometric |= part.photometric;
        self.lights.extend(part.lights.into_iter().map(|l| moved(l, &place)));
        self.cameras.extend(part.cameras.into_iter().map(|camera| camera.placed(&place)));
    }
}

fn moved(mut light: Light, place: &DAffine3) -> Light {
    let turned = |d: DVec3| place.transform_vector3(d).normalize_or(d);
    match &mut light.kind {
        LightKind::Point { position, .. } => *position = place.transform_point3(*position),
        LightKind::Directional { direction } => *direction = turned(*direction),
        LightKind::Spot { position, direction, .. } => {
            *position = place.transform_point3(*position);
            *direction = turned(*direction);
        }
        LightKind::Rectangle { position, sides, .. } => {
            *position = place.transform_point3(*position);
            *sides = sides.map(|side| place.transform_vector3(side));
        }
    }
    if !matches!(light.kind, LightKind::Directional { .. }) {
        light.size *= libm::cbrt(place.matrix3.determinant().abs());
    }
    light
}

impl UpAxis {
    /// Quarter turn around x that takes this up axis to `to`.
    pub fn turned_to(self, to: Self) -> DAffine3 {
        let matrix = match (self, to) {
            (Self::Z, Self::Y) => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
            (Self::Y, Self::Z) => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
            (Self::Y, Self::Y) | (Self::Z, Self::Z) => DMat3::IDENTITY,
        };
        DAffine3::from_mat3(matrix)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "memory for 2^32 parts of a kind is not granted")]
fn count(n: usize) -> u32 {
    n as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, Mesh, Plane, Sphere, TextureRef};

    fn part() -> Scene {
        Scene {
            meshes: vec![Mesh::default()],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY }],
            materials: vec![Material {
                base_color_map: Some(TextureRef {
                    texture: 0,
                    uv_set: 0,
                    transform: crate::scene::UvTransform::default(),
                }),
                ..Material::default()
            }],
            textures: vec![crate::scene::Texture { bitmap: 0, sampler: crate::scene::Sampler::default() }],
            bitmaps: vec![crate::scene::Bitmap::default()],
            spheres: vec![Sphere { name: String::new(), center: DVec3::Z, radius: 1.0, material: 0 }],
            planes: vec![Plane { name: String::new(), normal: DVec3::Z, offset: 2.0, material: 0 }],
            ..Scene::default()
        }
    }

    #[test]
    fn indices_of_the_part_follow_those_of_the_whole() {
        let mut whole = part();
        whole.append(part(), &DAffine3::IDENTITY);
        assert_eq!((whole.instances[1].mesh, whole.meshes[1].material, whole.spheres[1].material), (1, 1, 1));
        assert_eq!(whole.textures[1].bitmap, 1);
        assert_eq!(whole.materials[1].base_color_map.as_ref().unwrap().texture, 1);
        assert_eq!(whole.materials[0].base_color_map.as_ref().unwrap().texture, 0);
    }

    #[test]
    fn a_part_that_stands_on_z_is_turned_to_stand_on_y() {
        let mut whole = Scene::default();
        let z_up = Scene { up: UpAxis::Z, ..part() };
        whole.append(z_up, &DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), Default::default(), DVec3::X));
        assert_eq!(whole.spheres[0].center, DVec3::new(1.0, 2.0, 0.0));
        assert!((whole.spheres[0].radius - 2.0).abs() < 1e-12);
        assert!(whole.planes[0].normal.abs_diff_eq(DVec3::Y, 1e-12));
        assert!((whole.planes[0].offset - 4.0).abs() < 1e-12);
    }
}
