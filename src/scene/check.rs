//! Validation of scenes made by hand, before they are placed and rendered.

use super::corners::{ObjectBox, placed_box};
use super::{Instance, Mesh, Pixels, Scene};
use crate::math::aabb::Aabb;
use crate::math::{DVec3, Vec3};

/// A fault of a scene, and its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {text}")]
pub struct SceneFault {
    /// Path of the faulty part from the scene, such as `meshes[2].triangles[7]`.
    pub place: String,
    /// Description of the fault, with the numbers.
    pub text: String,
}

impl Scene {
    /// Checks that every index is in range, arrays that belong together are equally long, and every shape is finite and within
    /// [`Self::LARGEST`]. Scenes from [`load`] are sound; one built by hand should be checked before it is placed, because
    /// [`World`], structures and renderer rely on it.
    ///
    /// # Errors
    ///
    /// Returns the first fault.
    ///
    /// [`load`]: mod@crate::load
    /// [`World`]: crate::render::World
    pub fn check(&self) -> Result<(), SceneFault> {
        let materials = self.materials.len();
        for (i, mesh) in self.meshes.iter().enumerate() {
            mesh.check(&format!("meshes[{i}]"), materials)?;
        }
        let boxes: Vec<ObjectBox> = self.meshes.iter().map(Mesh::around).collect();
        for (i, instance) in self.instances.iter().enumerate() {
            points(|| format!("instances[{i}].mesh"), instance.mesh, self.meshes.len(), "meshes")?;
            let (to_world, place) = (instance.world_from_object, || format!("instances[{i}].world_from_object"));
            holds(to_world.is_finite(), place, || "it is not finite".into())?;
            let corners = placed_box(boxes[instance.mesh as usize], instance);
            corners.into_iter().try_for_each(|corner| is_within(place, corner))?;
        }
        for (i, sphere) in self.spheres.iter().enumerate() {
            points(|| format!("spheres[{i}].material"), sphere.material, materials, "materials")?;
            let (radius, place) = (sphere.radius, || format!("spheres[{i}].radius"));
            holds(radius > 0.0 && radius.is_finite(), place, || format!("{radius} is none"))?;
            is_near(place, radius)?;
            is_within(|| format!("spheres[{i}].center"), sphere.center)?;
        }
        for (i, cone) in self.cones.iter().enumerate() {
            points(|| format!("cones[{i}].material"), cone.material, materials, "materials")?;
            let (radii, place) = ([cone.base_radius, cone.apex_radius], || format!("cones[{i}]"));
            let are_radii = radii.iter().all(|&radius| radius >= 0.0 && radius.is_finite()) && radii != [0.0; 2];
            holds(are_radii, place, || format!("{radii:?} are no radii"))?;
            is_near(place, radii[0].max(radii[1]))?;
            is_within(|| format!("cones[{i}].base"), cone.base)?;
            is_within(|| format!("cones[{i}].apex"), cone.apex)?;
            holds(cone.base != cone.apex, place, || format!("both ends are at {}", cone.base))?;
        }
        for (i, plane) in self.planes.iter().enumerate() {
            points(|| format!("planes[{i}].material"), plane.material, materials, "materials")?;
            let (length, place) = (plane.normal.length(), || format!("planes[{i}].normal"));
            holds((length - 1.0).abs() < 1e-6, place, || format!("its length is {length}, not 1"))?;
            let (offset, place) = (plane.offset, || format!("planes[{i}].offset"));
            holds(offset.is_finite(), place, || format!("{offset} is not finite"))?;
            is_near(place, offset)?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            for map in material.textures() {
                points(|| format!("materials[{i}]"), map.texture, self.textures.len(), "textures")?;
            }
        }
        for (i, texture) in self.textures.iter().enumerate() {
            points(|| format!("textures[{i}].bitmap"), texture.bitmap, self.bitmaps.len(), "bitmaps")?;
        }
        for (i, bitmap) in self.bitmaps.iter().enumerate() {
            // A partial pixel at the end counts.
            let found = match &bitmap.pixels {
                Pixels::Rgb8(bytes) => bytes.len().div_ceil(3),
                _ => bitmap.texels(),
            };
            covers(|| format!("bitmaps[{i}].pixels"), found, (bitmap.width, bitmap.height))?;
        }
        if let Some(panorama) = &self.panorama {
            covers(|| "panorama.texels".into(), panorama.texels.len(), (panorama.width, panorama.height))?;
        }
        self.hints.camera.map_or(Ok(()), |i| points(|| "hints.camera".into(), i, self.cameras.len(), "cameras"))?;
        let text = || format!("{} prims are shown, of which {} can be told apart", self.prims(), Self::MOST_PRIMS);
        holds(self.prims() <= Self::MOST_PRIMS, || "instances".into(), text)
    }

    /// Greatest magnitude of a coordinate or radius, world units: sums and products of a few of them stay within the range of
    /// `f32`. Loaders leave out what is larger.
    pub const LARGEST: f64 = 1e18;

    /// Greatest number of prims: the last number of 32 bits marks "none".
    pub const MOST_PRIMS: u64 = u32::MAX as u64 - 1;

    /// Number of prims shown: triangles and polygons of every instance, spheres, cones and planes.
    pub fn prims(&self) -> u64 {
        let faces = |mesh: &Mesh| (mesh.triangles.len() + mesh.polygons.len()) as u64;
        let shown = |instance: &Instance| self.meshes.get(instance.mesh as usize).map_or(0, faces);
        let others = self.spheres.len() + self.cones.len() + self.planes.len();
        self.instances.iter().map(shown).fold(others as u64, u64::saturating_add)
    }
}

impl Mesh {
    /// Bounding box of all positions, used or not; the origin if there are none.
    pub(crate) fn around(&self) -> ObjectBox {
        let Aabb { lo, hi } = Aabb::around(self.positions.iter().copied());
        if self.positions.is_empty() { (Vec3::ZERO, Vec3::ZERO) } else { (lo, hi) }
    }

    fn check(&self, place: &str, materials: usize) -> Result<(), SceneFault> {
        points(|| format!("{place}.material"), self.material, materials, "materials")?;
        for (i, &position) in self.positions.iter().enumerate() {
            holds(position.is_finite(), || format!("{place}.positions[{i}]"), || format!("{position} is not finite"))?;
        }
        let positions = self.positions.len();
        let sets = self.uvs.iter().enumerate().map(|(k, set)| (format!("uvs[{k}]"), set.len()));
        let attributes = [
            ("normals".to_owned(), self.normals.len()),
            ("tangents".to_owned(), self.tangents.len()),
            ("colors".to_owned(), self.colors.len()),
        ];
        for (name, len) in attributes.into_iter().chain(sets) {
            holds(
                len == 0 || len == positions,
                || format!("{place}.{name}"),
                || format!("{len} of them where there are {positions} positions"),
            )?;
        }
        for (i, corner) in self.triangles.iter().enumerate().flat_map(|(i, t)| t.iter().map(move |corner| (i, *corner)))
        {
            points(|| format!("{place}.triangles[{i}]"), corner, positions, "positions")?;
        }
        let (faces, triangles) = (self.face_of_triangle.len(), self.triangles.len());
        holds(
            faces == 0 || faces == triangles,
            || format!("{place}.face_of_triangle"),
            || format!("{faces} of them where there are {triangles} triangles"),
        )?;
        for (i, &corner) in self.polygon_corners.iter().enumerate() {
            points(|| format!("{place}.polygon_corners[{i}]"), corner, positions, "positions")?;
        }
        for (i, polygon) in self.polygons.iter().enumerate() {
            let (first, len, corners) = (polygon.first as usize, polygon.len as usize, self.polygon_corners.len());
            let fits = len >= 3 && first.checked_add(len).is_some_and(|end| end <= corners);
            holds(
                fits,
                || format!("{place}.polygons[{i}]"),
                || format!("{len} corners from {first} on: at least 3 are needed, and there are {corners}"),
            )?;
        }
        Ok(())
    }
}

/// Checks that an index points at one of `len` parts of a kind.
fn points(place: impl Fn() -> String, index: u32, len: usize, kind: &str) -> Result<(), SceneFault> {
    holds((index as usize) < len, place, || format!("{index} where there are {len} {kind}"))
}

/// Checks that the number of texels is that of a whole picture.
fn covers(place: impl Fn() -> String, found: usize, (width, height): (u32, u32)) -> Result<(), SceneFault> {
    let expected = width as usize * height as usize;
    holds(found == expected, place, || format!("{found} texels where {width} × {height} are {expected}"))
}

/// Checks that a coordinate or size is finite and not too large.
fn is_near(place: impl Fn() -> String, size: f64) -> Result<(), SceneFault> {
    holds(size.abs() <= Scene::LARGEST, place, || format!("{size:e} is over {:e}", Scene::LARGEST))
}

/// Checks the coordinates of a point likewise.
fn is_within(place: impl Fn() -> String, point: DVec3) -> Result<(), SceneFault> {
    holds(point.is_finite(), &place, || format!("{point} is not finite"))?;
    is_near(place, point.abs().max_element())
}

fn holds(is_so: bool, place: impl Fn() -> String, text: impl Fn() -> String) -> Result<(), SceneFault> {
    if is_so { Ok(()) } else { Err(SceneFault { place: place(), text: text() }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, Vec2};
    use crate::scene::{
        Bitmap, Cone, Instance, Material, Panorama, Plane, Polygon, Sampler, Sphere, Texture, TextureRef, UvTransform,
    };

    use std::sync::Arc;

    type Spoil = fn(&mut Scene);

    /// A sound scene with one part of most kinds.
    fn sound() -> Scene {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            uvs: vec![vec![Vec2::ZERO; 3]],
            triangles: vec![[0, 1, 2]],
            polygons: vec![Polygon { first: 0, len: 3, face: 1 }],
            polygon_corners: vec![0, 1, 2],
            ..Mesh::default()
        };
        let map = TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() };
        let pixels = Pixels::Rgb8([9; 6].into_iter().collect());
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY }],
            spheres: vec![Sphere { name: String::new(), center: DVec3::X, radius: 1.0, material: 0 }],
            cones: vec![Cone {
                name: String::new(),
                base: DVec3::X,
                base_radius: 1.0,
                apex: DVec3::Y,
                apex_radius: 0.0,
                material: 0,
            }],
            planes: vec![Plane { name: String::new(), normal: DVec3::Y, offset: 0.0, material: 0 }],
            materials: vec![Material { base_color_map: Some(map), ..Material::plain() }],
            textures: vec![Texture { bitmap: 0, sampler: Sampler::default() }],
            bitmaps: vec![Bitmap { name: String::new(), width: 2, height: 1, pixels }],
            ..Scene::default()
        }
    }

    #[test]
    fn more_prims_than_can_be_told_apart_are_a_fault() {
        let mut scene = sound();
        scene.meshes[0].triangles = vec![[0, 1, 2]; (1 << 16) - 1];
        let instance = scene.instances[0].clone();
        // Each instance shows the triangles and a polygon; the sphere, the cone and the plane come on top.
        scene.instances = vec![instance; (1 << 16) - 1];
        assert_eq!(scene.prims(), (1 << 32) - (1 << 16) + 3);
        assert_eq!(scene.check(), Ok(()));
        let sphere = scene.spheres[0].clone();
        scene.spheres.resize((1 << 16) - 4, sphere.clone());
        assert_eq!((scene.prims(), scene.check()), (Scene::MOST_PRIMS, Ok(())));
        scene.spheres.push(sphere);
        let fault = scene.check().unwrap_err().to_string();
        assert_eq!(fault, "instances: 4294967295 prims are shown, of which 4294967294 can be told apart");
    }

    #[test]
    fn what_points_nowhere_or_is_too_short_is_named_with_its_place() {
        assert_eq!(sound().check(), Ok(()));
        assert_eq!(Scene::default().check(), Ok(()));
        let faults: [(Spoil, &str); 26] = [
            (|s| s.meshes[0].material = 1, "meshes[0].material: 1 where there are 1 materials"),
            (|s| s.meshes[0].triangles.push([0, 1, 3]), "meshes[0].triangles[1]: 3 where there are 3 positions"),
            (|s| s.meshes[0].normals.truncate(2), "meshes[0].normals: 2 of them where there are 3 positions"),
            (|s| s.meshes[0].uvs[0].truncate(1), "meshes[0].uvs[0]: 1 of them where there are 3 positions"),
            (|s| s.meshes[0].face_of_triangle = vec![0, 0], "meshes[0].face_of_triangle: 2 of them"),
            (|s| s.meshes[0].polygons[0].first = u32::MAX, "meshes[0].polygons[0]: 3 corners from 4294967295 on"),
            (|s| s.meshes[0].polygon_corners[1] = 9, "meshes[0].polygon_corners[1]: 9 where"),
            (|s| s.instances[0].mesh = 1, "instances[0].mesh: 1 where there are 1 meshes"),
            (|s| s.meshes[0].positions[1].y = f32::NAN, "meshes[0].positions[1]: [1, NaN, 0] is not finite"),
            (
                |s| s.instances[0].world_from_object.translation.z = f64::INFINITY,
                "instances[0].world_from_object: it is not finite",
            ),
            (|s| s.instances[0].world_from_object.matrix3 *= 2e18, "instances[0].world_from_object: 2e18 is over 1e18"),
            (|s| s.spheres[0].radius = 1e300, "spheres[0].radius: 1e300 is over 1e18"),
            (|s| s.spheres[0].radius = -1.0, "spheres[0].radius: -1 is none"),
            (|s| s.spheres[0].radius = 0.0, "spheres[0].radius: 0 is none"),
            (|s| s.spheres[0].center.y = f64::NAN, "spheres[0].center: [1, NaN, 0] is not finite"),
            (|s| s.cones[0].apex_radius = f64::NAN, "cones[0]: [1.0, NaN] are no radii"),
            (|s| s.cones[0].base_radius = 0.0, "cones[0]: [0.0, 0.0] are no radii"),
            (|s| s.cones[0].apex = DVec3::X, "cones[0]: both ends are at [1, 0, 0]"),
            (|s| s.planes[0].offset = f64::INFINITY, "planes[0].offset: inf is not finite"),
            (|s| s.planes[0].normal = DVec3::ZERO, "planes[0].normal: its length is 0, not 1"),
            (|s| s.textures.clear(), "materials[0]: 0 where there are 0 textures"),
            (|s| s.textures[0].bitmap = 2, "textures[0].bitmap: 2 where there are 1 bitmaps"),
            (|s| s.bitmaps[0].height = 2, "bitmaps[0].pixels: 2 texels where 2 × 2 are 4"),
            (|s| s.bitmaps[0].pixels = Pixels::Rgb8([9; 7].into_iter().collect()), "bitmaps[0].pixels: 3 texels where"),
            (
                |s| {
                    let texels = Arc::new(vec![[0.0; 3]]);
                    let name = String::new();
                    s.panorama = Some(Panorama { name, width: 0, height: 1, texels, ..Panorama::default() });
                },
                "panorama.texels: 1 texels where 0 × 1 are 0",
            ),
            (|s| s.hints.camera = Some(0), "hints.camera: 0 where there are 0 cameras"),
        ];
        for (spoil, expected) in faults {
            let mut scene = sound();
            spoil(&mut scene);
            let fault = scene.check().unwrap_err().to_string();
            assert!(fault.starts_with(expected), "{fault} is not {expected}");
        }
    }
}
