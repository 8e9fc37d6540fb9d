//! The scene as the structures see it: every instance's shapes in one centred `f32` frame, and the way back from a prim
//! to what it came from.

use crate::accel::{BitSet, Shapes, SpherePrim};
use crate::math::frame::snapped_center;
use crate::math::{DAffine3, DVec3};
use crate::scene::Scene;

/// A [`Scene`] flattened for tracing. World position = `center` + position in [`Shapes`].
#[derive(Clone, Debug)]
pub struct World {
    /// What was subtracted from every world position, in `f64`, before rounding.
    pub center: DVec3,
    /// Box of everything but planes, world space; `lo > hi` when there is nothing.
    pub bounds: (DVec3, DVec3),
    /// Every shape, centred.
    pub shapes: Shapes,
    /// First prim of each instance's triangles, and one past the last.
    first_triangle: Vec<u32>,
    /// First polygon (counted from 0) of each instance, and one past the last.
    first_polygon: Vec<u32>,
}

/// What a prim came from; indices into the arrays of [`Scene`].
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
    /// Index into `scene.planes`.
    Plane(u32),
}

impl World {
    /// Places every shape of the scene in the world, finds the centre and rounds once.
    pub fn new(scene: &Scene) -> Self {
        let bounds = bounds(scene);
        let center = snapped_center(bounds.0, bounds.1);
        let mut shapes = Shapes::default();
        let (mut first_triangle, mut first_polygon) = (Vec::new(), Vec::new());

        // Triangles and polygons, instance by instance, so that prim ids follow the file's order.
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let base = index(shapes.vertices.len());
            let to_frame = centered(&instance.world_from_object, center);
            shapes.vertices.extend(mesh.positions.iter().map(|p| to_frame.transform_point3(p.as_dvec3()).as_vec3()));
            first_triangle.push(index(shapes.triangles.len()));
            shapes.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + base)));
            first_polygon.push(index(shapes.polygons.len()));
            let corners = index(shapes.polygon_corners.len());
            shapes.polygons.extend(mesh.polygons.iter().map(|p| (p.first + corners, p.len)));
            shapes.polygon_corners.extend(mesh.polygon_corners.iter().map(|i| i + base));
        }
        first_triangle.push(index(shapes.triangles.len()));
        first_polygon.push(index(shapes.polygons.len()));

        #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
        {
            let sphere = |s: &crate::scene::Sphere| SpherePrim {
                center: (s.center - center).as_vec3(),
                radius: s.radius as f32,
            };
            shapes.spheres = scene.spheres.iter().map(sphere).collect();
            let plane = |p: &crate::scene::Plane| (p.normal.as_vec3(), (p.offset - p.normal.dot(center)) as f32);
            shapes.planes = scene.planes.iter().map(plane).collect();
        }

        let mut world = Self { center, bounds, shapes, first_triangle, first_polygon };
        world.shapes.opaque = world.opaque_bits(scene);
        world
    }

    /// What prim `prim` came from.
    pub fn source(&self, prim: u32) -> PrimSource {
        let (triangles, polygons) = (index(self.shapes.triangles.len()), index(self.shapes.polygons.len()));
        let spheres = index(self.shapes.spheres.len());
        let owner = |first: &[u32], i: u32| index(first.partition_point(|&f| f <= i) - 1);
        if prim < triangles {
            let instance = owner(&self.first_triangle, prim);
            PrimSource::Triangle { instance, triangle: prim - self.first_triangle[instance as usize] }
        } else if prim < triangles + polygons {
            let instance = owner(&self.first_polygon, prim - triangles);
            PrimSource::Polygon { instance, polygon: prim - triangles - self.first_polygon[instance as usize] }
        } else if prim < triangles + polygons + spheres {
            PrimSource::Sphere(prim - triangles - polygons)
        } else {
            PrimSource::Plane(prim - triangles - polygons - spheres)
        }
    }

    /// The material of prim `prim`, an index into `scene.materials`.
    pub fn material(&self, scene: &Scene, prim: u32) -> u32 {
        match self.source(prim) {
            PrimSource::Triangle { instance, .. } | PrimSource::Polygon { instance, .. } => {
                scene.meshes[scene.instances[instance as usize].mesh as usize].material
            }
            PrimSource::Sphere(i) => scene.spheres[i as usize].material,
            PrimSource::Plane(i) => scene.planes[i as usize].material,
        }
    }

    fn opaque_bits(&self, scene: &Scene) -> BitSet {
        let opaque: Vec<bool> = scene.materials.iter().map(crate::scene::Material::is_opaque).collect();
        let mut bits = BitSet::filled(self.shapes.len(), true);
        if opaque.iter().all(|&o| o) {
            return bits;
        }
        for prim in 0..index(self.shapes.len()) {
            bits.set(prim, opaque[self.material(scene, prim) as usize]);
        }
        bits
    }
}

/// `world_from_object` followed by the move to the centred frame, composed in `f64`.
fn centered(world_from_object: &DAffine3, center: DVec3) -> DAffine3 {
    DAffine3 { matrix3: world_from_object.matrix3, translation: world_from_object.translation - center }
}

/// Box of all instances' vertices that a face uses, and of the spheres.
fn bounds(scene: &Scene) -> (DVec3, DVec3) {
    let mut lo = DVec3::INFINITY;
    let mut hi = DVec3::NEG_INFINITY;
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let corners = mesh.triangles.iter().flatten().chain(&mesh.polygon_corners);
        for &i in corners {
            let p = instance.world_from_object.transform_point3(mesh.positions[i as usize].as_dvec3());
            (lo, hi) = (lo.min(p), hi.max(p));
        }
    }
    for s in &scene.spheres {
        (lo, hi) = (lo.min(s.center - s.radius), hi.max(s.center + s.radius));
    }
    (lo, hi)
}

#[expect(clippy::cast_possible_truncation, reason = "loading refuses scenes with 2^32 - 1 prims or vertices")]
fn index(i: usize) -> u32 {
    i as u32
}
