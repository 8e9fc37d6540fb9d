//! The scene as acceleration structures see it: all shapes in one centred `f32` frame, except for instanced objects, which are
//! stored once and placed several times; and the mapping from a prim back to its source.
//!
//! Prim ids are those of the flattened scene, whether or not anything is instanced.

mod placing;
mod rounding;
mod solid;

pub use rounding::Moved;

pub use placing::Placing;

use super::instancing::{self, Instancing};
use crate::accel::auto::{self, Reason};
use crate::accel::instances::PrimLocation;
use crate::accel::refine::Refined;
use crate::accel::shapes::Prim;
use crate::accel::{AccelChoice, AccelParams, AnyAccel, BitSet, Hit, InstancedObjects, Ray, Shapes};
use crate::math::triangle::Triangle;
use crate::math::{DMat3, DVec3, Vec3};
use crate::scene::mesh::normal_from_object;
use crate::scene::{Material, Scene};
use solid::Solid;
pub(super) use solid::{code, least as least_solid};
use std::ops::Range;

/// A [`Scene`] placed for tracing. World position = `center` + position in [`Shapes`].
#[derive(Clone, Debug)]
pub struct World {
    /// Subtracted from every world position, in `f64`, before rounding.
    pub center: DVec3,
    /// Box of all shapes but planes, in world space; `lo > hi` when there are none.
    pub bounds: (DVec3, DVec3),
    /// Shapes that are not instanced, centred; all shapes where nothing is instanced, as with [`World::new`]. For a structure
    /// over everything, see [`Self::structure`].
    pub shapes: Shapes,
    /// Objects that are stored once and placed several times.
    pub instanced: InstancedObjects,
    /// First prim of each instance's triangles, and one past the last.
    first_triangle: Vec<u32>,
    /// First polygon (counted from 0) of each instance, and one past the last.
    first_polygon: Vec<u32>,
    placements: Vec<Placement>,
    /// Whether all prims are opaque, even where each is tested for transparency.
    opaque: bool,
}

/// How an instance transforms directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// Takes tangents to world space; lengths change.
    pub world_from_object: DMat3,
    /// Takes normals to world space; lengths change.
    pub normal_from_object: DMat3,
    /// Whether the instance is mirrored: its faces keep the corner order of the file, so their winding is reversed.
    pub mirrored: bool,
}

impl Placement {
    pub(super) fn new(m: DMat3) -> Self {
        Self { world_from_object: m, normal_from_object: normal_from_object(&m), mirrored: m.determinant() < 0.0 }
    }
}

/// Source of a prim; indices into the arrays of [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrimSource {
    /// A triangle of an instance's mesh.
    Triangle {
        /// Index into `scene.instances`.
        instance: u32,
        /// Index into the mesh's `triangles`.
        triangle: u32,
    },
    /// A whole n-gon of an instance's mesh.
    Polygon {
        /// Index into `scene.instances`.
        instance: u32,
        /// Index into the mesh's `polygons`.
        polygon: u32,
    },
    /// Index into `scene.spheres`.
    Sphere(u32),
    /// Index into `scene.cones`.
    Cone(u32),
    /// Index into `scene.planes`.
    Plane(u32),
}

impl World {
    /// Places every shape of the scene in the world, each instance by itself, finds the centre and rounds once.
    ///
    /// # Panics
    ///
    /// Where [`Scene::check`] finds a fault; loaded scenes have none.
    pub fn new(scene: &Scene) -> Self {
        Self::placing(scene, Instancing::Flatten)
    }

    /// Lower bound of the bytes that [`World::new`] and a structure over it take for the triangles of all instances, each stored
    /// by itself, however few of them the scene stores.
    pub fn flattened_bytes(scene: &Scene) -> u64 {
        placing::placed_bytes(scene, scene.instances.iter())
    }

    /// Places every shape, and meshes with several instances according to `how`: rays hit the same prims at the same distances.
    pub fn placing(scene: &Scene, how: Instancing) -> Self {
        Placing::new(scene, how).world()
    }

    /// Builds a structure over everything; returns the reason too where there was a choice. Where anything is instanced, kinds
    /// that do not support it fall back to `fast-octree`, as [`AnyAccel::kind`] reports: to compare structures, instance nothing
    /// ([`World::new`]).
    ///
    /// # Panics
    ///
    /// May panic with parameters that [`AccelParams::validate`] rejects, and scenes that [`Scene::check`] rejects.
    pub fn structure(&self, choice: AccelChoice, params: &AccelParams) -> (AnyAccel<'_>, Option<Reason>) {
        self.structure_for(u64::MAX, choice, params)
    }

    /// Builds a structure for pictures that start with a wave of `eye_rays`: where these are few, finding the best structure
    /// takes longer than it may save, and [`AccelChoice::Auto`] is `fast-octree`.
    ///
    /// # Panics
    ///
    /// May panic with parameters that [`AccelParams::validate`] rejects, and scenes that [`Scene::check`] rejects.
    pub fn structure_for(
        &self,
        eye_rays: u64,
        choice: AccelChoice,
        params: &AccelParams,
    ) -> (AnyAccel<'_>, Option<Reason>) {
        auto::build_with(eye_rays, choice, &self.shapes, &self.instanced, params)
    }

    /// Reason for the structure that [`AccelChoice::Auto`] picks.
    pub fn judged(&self) -> Reason {
        auto::reason(&self.shapes, &self.instanced, u64::MAX)
    }

    /// Number of prims of all kinds, those of an object once for each placement.
    pub fn len(&self) -> usize {
        self.shapes.len() + self.instanced.shown() as usize
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of triangles, counted the same way; they have the lowest prim ids.
    pub fn triangles(&self) -> u32 {
        index(self.shapes.triangles.len()) + self.instanced.shown()
    }

    /// Bytes of the shapes as stored.
    pub fn bytes(&self) -> usize {
        instancing::bytes(&self.shapes, &self.instanced)
    }

    /// Geometry of prim `prim`, in the centred frame.
    #[inline]
    pub fn prim(&self, prim: u32) -> Prim<'_> {
        self.instanced.prim(&self.shapes, prim)
    }

    /// Whether a ray that starts on prim `prim` cannot meet it again.
    pub fn is_flat(&self, prim: u32) -> bool {
        !matches!(self.prim(prim), Prim::Sphere(_) | Prim::Cone(_))
    }

    /// Number of objects with bounded prims: face objects, one for each placement, then each sphere and cone.
    pub fn objects(&self) -> usize {
        self.shapes.objects().len() + self.instanced.placed().len()
    }

    /// Corners of triangle `prim`, in the centred frame.
    #[inline]
    pub fn triangle(&self, prim: u32) -> Triangle {
        match self.instanced.find(prim) {
            PrimLocation::Stored(prim) => self.shapes.triangle(prim),
            PrimLocation::Placed(placed, triangle) => self.instanced.triangle(placed, triangle),
        }
    }

    /// First corner and length of polygon `prim` among the corners of all polygons of [`Self::shapes`].
    pub(crate) fn polygon(&self, prim: u32) -> (u32, u32) {
        self.shapes.polygons[(prim - self.triangles()) as usize]
    }

    /// Endless ray from a world position; `dir` keeps its length, which is the unit of t.
    pub fn ray(&self, origin: DVec3, dir: DVec3) -> Ray {
        Ray::new((origin - self.center).as_vec3(), dir.as_vec3())
    }

    /// World position of a point in the centred frame, such as [`Refined::position`].
    pub fn to_world(&self, place: Vec3) -> DVec3 {
        place.as_dvec3() + self.center
    }

    /// Position, error bound, normal and barycentric weights of a hit on `ray`, in the centred frame.
    ///
    /// # Panics
    ///
    /// For a miss: check [`Hit::is_some`].
    pub fn refine(&self, ray: &Ray, hit: &Hit) -> Refined {
        self.prim(hit.prim).refine(ray, hit)
    }

    /// This world with no prim marked opaque: each is tested for transparency (see [`no_prune`](super::no_prune)).
    #[must_use]
    pub fn without_pruning(mut self) -> Self {
        self.shapes.opaque = BitSet::filled(self.shapes.len(), false);
        self.instanced.open_all();
        self
    }

    /// Prims of an instance's triangles.
    pub(crate) fn triangles_of(&self, instance: u32) -> Range<u32> {
        self.first_triangle[instance as usize]..self.first_triangle[instance as usize + 1]
    }

    /// Whether prim `prim` is stored by itself, and not as part of an instanced object.
    pub(crate) fn is_stored(&self, prim: u32) -> bool {
        matches!(self.instanced.find(prim), PrimLocation::Stored(_))
    }

    /// Source of prim `prim`, which must be below [`Self::len`]; the result is meaningless for others.
    pub fn source(&self, prim: u32) -> PrimSource {
        let (triangles, polygons) = (self.triangles(), index(self.shapes.polygons.len()));
        let (spheres, cones) = (index(self.shapes.spheres.len()), index(self.shapes.cones.len()));
        let owner = |first: &[u32], i: u32| index(first.partition_point(|&f| f <= i) - 1);
        if prim < triangles {
            let instance = owner(&self.first_triangle, prim);
            PrimSource::Triangle { instance, triangle: prim - self.first_triangle[instance as usize] }
        } else if prim < triangles + polygons {
            let instance = owner(&self.first_polygon, prim - triangles);
            PrimSource::Polygon { instance, polygon: prim - triangles - self.first_polygon[instance as usize] }
        } else if prim < triangles + polygons + spheres {
            PrimSource::Sphere(prim - triangles - polygons)
        } else if prim < triangles + polygons + spheres + cones {
            PrimSource::Cone(prim - triangles - polygons - spheres)
        } else {
            PrimSource::Plane(prim - triangles - polygons - spheres - cones)
        }
    }

    /// Material of prim `prim`, an index into `scene.materials`.
    ///
    /// # Panics
    ///
    /// Where the scene has no such prim: the one of [`Hit::MISS`] is none.
    ///
    /// [`Hit::MISS`]: crate::accel::Hit::MISS
    pub fn material(&self, scene: &Scene, prim: u32) -> u32 {
        match self.source(prim) {
            PrimSource::Triangle { instance, .. } | PrimSource::Polygon { instance, .. } => {
                scene.meshes[scene.instances[instance as usize].mesh as usize].material
            }
            PrimSource::Sphere(i) => scene.spheres[i as usize].material,
            PrimSource::Cone(i) => scene.cones[i as usize].material,
            PrimSource::Plane(i) => scene.planes[i as usize].material,
        }
    }

    /// How instance `instance` transforms directions.
    pub(crate) fn placement(&self, instance: u32) -> &Placement {
        &self.placements[instance as usize]
    }

    /// Opacity bits of the shapes that are not instanced.
    fn opaque_bits(&self, scene: &Scene, solids: &[Solid]) -> BitSet {
        let mut bits = BitSet::filled(self.shapes.len(), true);
        if scene.materials.iter().all(Material::is_opaque) {
            return bits;
        }
        // An instance has one material, so its prims need no lookup each.
        let first_polygon = index(self.shapes.triangles.len());
        for (i, instance) in scene.instances.iter().enumerate() {
            let solid = match &solids[instance.mesh as usize] {
                Solid::All => continue,
                Solid::Some(solid) => Some(solid),
                Solid::None => None,
            };
            let polygons = self.first_polygon[i] + first_polygon..self.first_polygon[i + 1] + first_polygon;
            polygons.for_each(|prim| bits.set(prim, false));
            if let PrimLocation::Stored(first) = self.instanced.find(self.first_triangle[i]) {
                let triangles = 0..self.first_triangle[i + 1] - self.first_triangle[i];
                let open = triangles.filter(|&triangle| !solid.is_some_and(|solid| solid.get(triangle)));
                open.for_each(|triangle| bits.set(first + triangle, false));
            }
        }
        let others = first_polygon + index(self.shapes.polygons.len());
        for prim in others..index(self.shapes.len()) {
            let material = self.material(scene, self.instanced.number(prim));
            bits.set(prim, scene.materials[material as usize].is_opaque());
        }
        bits
    }

    /// Whether all prims are opaque.
    pub(crate) fn is_opaque(&self) -> bool {
        self.opaque
    }
}

/// Converts an index to `u32`. Prim ids are in range ([`Scene::MOST_PRIMS`]); vertex indices, up to three for each prim, may not
/// be.
fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or_else(|_| panic!("the scene is too large: {i} vertices and more, stored by themselves"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, Vec3};
    use crate::scene::{AlphaMode, Cone, Instance, Mesh, Plane, Polygon, Sphere};

    fn triangle(material: u32) -> Mesh {
        Mesh { material, positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() }
    }

    fn placed(mesh: u32, world_from_object: DAffine3) -> Instance {
        Instance { name: String::new(), mesh, world_from_object }
    }

    fn one_of_each_kind() -> Scene {
        let mut quad = triangle(1);
        quad.polygon_corners = vec![0, 1, 2];
        quad.polygons = vec![Polygon { first: 0, len: 3, face: 1 }];
        let far = DAffine3::from_translation(DVec3::splat(1e7));
        let sphere = Sphere { name: String::new(), center: DVec3::splat(1e7 + 8.0), radius: 1.0, material: 0 };
        let (base, apex) = (DVec3::splat(1e7 + 2.0), DVec3::splat(1e7 + 3.0));
        let tip = Cone { name: String::new(), base, base_radius: 1.0, apex, apex_radius: 0.0, material: 1 };
        Scene {
            meshes: vec![triangle(0), quad],
            instances: vec![placed(0, far), placed(1, far)],
            spheres: vec![sphere],
            cones: vec![tip],
            planes: vec![Plane { name: String::new(), normal: DVec3::Y, offset: 1e7 - 1.0, material: 1 }],
            materials: vec![
                Material::plain(),
                Material { opacity: 0.5, alpha_mode: AlphaMode::Blend, ..Material::plain() },
            ],
            ..Scene::default()
        }
    }

    #[test]
    fn prims_lead_back_to_where_they_came_from() {
        let scene = one_of_each_kind();
        let world = World::new(&scene);
        assert_eq!(world.source(0), PrimSource::Triangle { instance: 0, triangle: 0 });
        assert_eq!(world.source(1), PrimSource::Triangle { instance: 1, triangle: 0 });
        assert_eq!(world.source(2), PrimSource::Polygon { instance: 1, polygon: 0 });
        assert_eq!(world.source(3), PrimSource::Sphere(0));
        assert_eq!((world.source(4), world.source(5)), (PrimSource::Cone(0), PrimSource::Plane(0)));
        let opaque: Vec<bool> = (0..6).map(|p| world.shapes.opaque.get(p)).collect();
        assert_eq!(opaque, [true, false, false, true, false, false]);
    }

    #[test]
    fn objects_are_the_faces_of_an_instance_and_each_other_prim() {
        let world = World::new(&one_of_each_kind());
        let objects: Vec<Vec<u32>> = world.shapes.objects().iter().map(|o| o.prims().collect()).collect();
        assert_eq!(objects, [vec![0], vec![1, 2], vec![3], vec![4]], "a plane is none");
    }

    #[test]
    fn coordinates_far_from_the_origin_lose_nothing() {
        let world = World::new(&one_of_each_kind());
        let corner = |i: usize| world.center + world.shapes.vertices[i].as_dvec3();
        assert_eq!(corner(0), DVec3::splat(1e7));
        assert_eq!(corner(1), DVec3::splat(1e7) + DVec3::X);
        assert_eq!(world.bounds, (DVec3::splat(1e7), DVec3::splat(1e7 + 9.0)));
    }

    #[test]
    fn a_node_far_away_takes_nothing_from_the_precision_of_the_others() {
        let there = |shift: DVec3| placed(0, DAffine3::from_translation(shift));
        let near = (0..20).map(|i| there(DVec3::new(1e7 + 0.1 + f64::from(i), 0.3, 0.7)));
        let instances = near.chain([there(DVec3::splat(-1e9))]).collect();
        let scene =
            Scene { meshes: vec![triangle(0)], materials: vec![Material::plain()], instances, ..Scene::default() };
        let world = World::new(&scene);
        let corner = |i: usize| world.center + world.shapes.vertices[i].as_dvec3();
        assert!((corner(0) - DVec3::new(1e7 + 0.1, 0.3, 0.7)).length() < 1e-5, "{}", corner(0));
        assert!((corner(60) - DVec3::splat(-1e9)).length() < 200.0, "{}", corner(60));
    }

    #[test]
    fn normals_stay_perpendicular_to_faces_under_uneven_scale_and_mirroring() {
        for scale in [DVec3::new(1.0, 4.0, 0.5), DVec3::new(-1.0, 4.0, 0.5)] {
            let m = DMat3::from_rotation_x(0.3) * DMat3::from_diagonal(scale);
            let placement = Placement::new(m);
            let (a, b) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-2.0, 1.0, 0.5));
            let normal = placement.normal_from_object * a.cross(b);
            assert!(normal.dot(m * a).abs() < 1e-12 && normal.dot(m * b).abs() < 1e-12);
            // The outside stays the outside: a point in front of the face is in front of its image.
            assert!(normal.dot(m * a.cross(b)) > 0.0);
            assert_eq!(placement.mirrored, scale.x < 0.0);
        }
    }
}
