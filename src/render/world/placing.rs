//! Chooses which objects are instanced and where they stand, then builds the world.

use super::solid::{Solid, solids};
use super::{Placement, World, index};
use crate::accel::instances::placed;
use crate::accel::{Cone, Shapes, SpherePrim};
use crate::math::frame::{center_of_most, spread};
use crate::math::{DAffine3, DVec3, Vec3};
use crate::render::instancing::{InstancePlan, Instancing};
use crate::scene::corners::{Hull, take_in};
use crate::scene::{Instance, Mesh, Scene};
use rayon::prelude::*;

/// Lower bound of the bytes for a triangle stored by itself, with the fast structure that takes least memory during its build;
/// measured on four million.
const PLACED: u64 = 120;

/// A scene whose instancing is planned, before anything is stored.
pub struct Placing<'a> {
    scene: &'a Scene,
    bounds: (DVec3, DVec3),
    center: DVec3,
    /// Opaque triangles of each mesh.
    solids: Vec<Solid>,
    instancing: InstancePlan,
}

impl<'a> Placing<'a> {
    /// Finds the centre, and plans which objects are instanced and where they stand.
    pub fn new(scene: &'a Scene, how: Instancing) -> Self {
        let bounds = bounds(scene);
        let center = center_of_most(bounds.0, bounds.1, sample(scene).into_iter());
        let solids = solids(scene);
        let instancing = InstancePlan::of(scene, how, |mesh| solids[mesh] == Solid::All, |m| centered(m, center));
        Self { scene, bounds, center, solids, instancing }
    }

    /// Lower bound of the bytes of the world and a structure over it for the triangles of instances stored by themselves.
    pub fn bytes(&self) -> u64 {
        let each = self.scene.instances.iter().zip(&self.instancing.places).filter(|(_, place)| place.is_none());
        placed_bytes(self.scene, each.map(|(instance, _)| instance))
    }

    /// Stores all shapes at their places, rounded once.
    pub fn world(self) -> World {
        let Self { scene, bounds, center, solids, instancing: InstancePlan { mut instanced, places } } = self;
        let mut shapes = Shapes::default();
        let alone = || scene.instances.iter().zip(&places).filter(|(_, place)| place.is_none());
        let all = |size: fn(&Mesh) -> usize| alone().map(|(i, _)| size(&scene.meshes[i.mesh as usize])).sum();
        shapes.vertices.reserve_exact(all(|mesh| mesh.positions.len()));
        shapes.triangles.reserve_exact(all(|mesh| mesh.triangles.len()));
        shapes.polygons.reserve_exact(all(|mesh| mesh.polygons.len()));
        shapes.polygon_corners.reserve_exact(all(|mesh| mesh.polygon_corners.len()));
        let (mut first_triangle, mut first_polygon) = (Vec::new(), Vec::new());

        // Triangles and polygons, instance by instance, so that prim ids follow the file's order.
        for (instance, place) in scene.instances.iter().zip(places) {
            let mesh = &scene.meshes[instance.mesh as usize];
            first_triangle.push(index(shapes.triangles.len()) + instanced.shown());
            first_polygon.push(index(shapes.polygons.len()));
            if let Some((object, place)) = place {
                instanced.put(object, index(shapes.triangles.len()) + instanced.shown(), place);
                continue;
            }
            let base = index(shapes.vertices.len());
            shapes.face_runs.push([index(shapes.triangles.len()), index(shapes.polygons.len())]);
            let to_frame = centered(&instance.world_from_object, center);
            let place = |p: &Vec3| placed(&to_frame, *p);
            shapes.vertices.par_extend(mesh.positions.par_iter().with_min_len(PARALLEL_RUN).map(place));
            let triangles = mesh.triangles.par_iter().with_min_len(PARALLEL_RUN);
            shapes.triangles.par_extend(triangles.map(|t| t.map(|i| i + base)));
            let corners = index(shapes.polygon_corners.len());
            shapes.polygons.extend(mesh.polygons.iter().map(|p| (p.first + corners, p.len)));
            shapes.polygon_corners.extend(mesh.polygon_corners.iter().map(|i| i + base));
        }
        first_triangle.push(index(shapes.triangles.len()) + instanced.shown());
        first_polygon.push(index(shapes.polygons.len()));

        put_solids(scene, center, &mut shapes);

        let placements = scene.instances.iter().map(|i| Placement::new(i.world_from_object.matrix3)).collect();
        let is_open =
            |material: u32| scene.materials.get(material as usize).is_some_and(|material| !material.is_opaque());
        let spheres = scene.spheres.iter().map(|sphere| sphere.material);
        let cones = scene.cones.iter().map(|cone| cone.material);
        let others = spheres.chain(cones).chain(scene.planes.iter().map(|plane| plane.material));
        let mut meshes = scene.instances.iter().map(|instance| &solids[instance.mesh as usize]);
        let opaque = meshes.all(|solid| *solid == Solid::All) && !others.into_iter().any(is_open);
        let mut world = World { center, bounds, shapes, instanced, first_triangle, first_polygon, placements, opaque };
        world.shapes.opaque = world.opaque_bits(scene, &solids);
        world
    }
}

/// Stores spheres, cones and planes relative to the centre.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn put_solids(scene: &Scene, center: DVec3, shapes: &mut Shapes) {
    let sphere =
        |s: &crate::scene::Sphere| SpherePrim { center: (s.center - center).as_vec3(), radius: s.radius as f32 };
    shapes.spheres = scene.spheres.iter().map(sphere).collect();
    let cone = |c: &crate::scene::Cone| Cone {
        base: (c.base - center).as_vec3(),
        base_radius: c.base_radius as f32,
        apex: (c.apex - center).as_vec3(),
        apex_radius: c.apex_radius as f32,
    };
    shapes.cones = scene.cones.iter().map(cone).collect();
    let plane = |p: &crate::scene::Plane| (p.normal.as_vec3(), (p.offset - p.normal.dot(center)) as f32);
    shapes.planes = scene.planes.iter().map(plane).collect();
}

/// Lower bound of the bytes of these instances' triangles, each stored by itself, with a structure over them.
pub(super) fn placed_bytes<'a>(scene: &Scene, instances: impl Iterator<Item = &'a Instance>) -> u64 {
    let of = |mesh: u32| scene.meshes.get(mesh as usize).map_or(0, |mesh| mesh.triangles.len() as u64);
    instances.map(|instance| of(instance.mesh)).fold(0, u64::saturating_add).saturating_mul(PLACED)
}

/// `world_from_object` followed by the translation to the centred frame, composed in `f64`.
pub(super) fn centered(world_from_object: &DAffine3, center: DVec3) -> DAffine3 {
    DAffine3 { matrix3: world_from_object.matrix3, translation: world_from_object.translation - center }
}

/// Vertices that are worth a thread of their own.
pub(super) const PARALLEL_RUN: usize = 1 << 14;

/// Evenly spread samples of the corners of all faces and the positions of spheres and cones.
fn sample(scene: &Scene) -> Vec<DVec3> {
    let corners = |i: &Instance| {
        let mesh = &scene.meshes[i.mesh as usize];
        3 * mesh.triangles.len() + mesh.polygon_corners.len()
    };
    let faces: usize = scene.instances.iter().map(corners).sum();
    let mut wanted = spread(faces + scene.spheres.len() + scene.cones.len()).peekable();
    let (mut points, mut first) = (Vec::new(), 0);
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let end = first + corners(instance);
        while let Some(at) = wanted.next_if(|at| *at < end) {
            let corner = at - first;
            let vertex = match mesh.triangles.as_flattened().get(corner) {
                Some(vertex) => vertex,
                None => &mesh.polygon_corners[corner - 3 * mesh.triangles.len()],
            };
            let place = mesh.positions[*vertex as usize].as_dvec3();
            points.push(instance.world_from_object.transform_point3(place));
        }
        first = end;
    }
    let rest = scene.spheres.iter().map(|sphere| sphere.center).chain(scene.cones.iter().map(|cone| cone.base));
    let rest: Vec<DVec3> = rest.collect();
    points.extend(wanted.map(|at| rest[at - faces]));
    points
}

/// Box of all vertices that a face of an instance uses, and of the spheres and cones.
fn bounds(scene: &Scene) -> (DVec3, DVec3) {
    let mut faces = Hull::EMPTY;
    take_in(scene, &mut faces);
    let spheres = scene.spheres.iter().map(|s| (s.center - s.radius, s.center + s.radius));
    let cones = scene.cones.iter().map(crate::scene::Cone::bounds);
    spheres.chain(cones).fold((faces.lo, faces.hi), |(lo, hi), more| (lo.min(more.0), hi.max(more.1)))
}
