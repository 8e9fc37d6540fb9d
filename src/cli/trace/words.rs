//! Describes hits in terms of the file's objects, materials and lights.

use crate::accel::probe::Extent;
use crate::accel::{Hit, Ray};
use crate::load::Loaded;
use crate::math::{DVec3, Vec3};
use crate::render::ray_tree::Query;
use crate::render::{PrimSource, World};
use crate::scene::Scene;

/// Surface point that a ray hit.
pub(super) struct HitSurface<'a> {
    /// Name of the object in the file, or its index.
    pub object: String,
    /// Index of the material.
    pub material_number: u32,
    /// Name of the material; empty if the file gives none.
    pub material: &'a str,
    /// Position in world space.
    pub position: DVec3,
    /// Unit geometric normal in world space.
    pub normal: Vec3,
    /// Barycentric coordinates for a triangle's second and third corner.
    pub weights: [f32; 2],
}

/// Surface point of a query's hit; `None` for a miss.
pub(super) fn hit_surface<'a>(loaded: &'a Loaded, world: &World, query: &Query) -> Option<HitSurface<'a>> {
    let scene = &loaded.scene;
    query.hit.is_some().then(|| {
        let refined = world.refine(&query.ray, &query.hit);
        let material_number = world.material(scene, query.hit.prim);
        let material = scene.materials.get(material_number as usize);
        HitSurface {
            object: object(scene, world, query.hit.prim),
            material_number,
            material: material.map_or("", |m| m.name.as_str()),
            position: world.center + refined.position.as_dvec3(),
            normal: refined.normal,
            weights: [refined.u, refined.v],
        }
    })
}

/// Object that a prim belongs to, by name or index.
pub(super) fn object(scene: &Scene, world: &World, prim: u32) -> String {
    let (kind, number, name) = match world.source(prim) {
        PrimSource::Triangle { instance, .. } | PrimSource::Polygon { instance, .. } => {
            ("object", instance, scene.instances.get(instance as usize).map(|i| &i.name))
        }
        PrimSource::Sphere(i) => ("sphere", i, scene.spheres.get(i as usize).map(|s| &s.name)),
        PrimSource::Cone(i) => ("cone", i, scene.cones.get(i as usize).map(|c| &c.name)),
        PrimSource::Plane(i) => ("plane", i, scene.planes.get(i as usize).map(|p| &p.name)),
    };
    match name.filter(|name| !name.is_empty()) {
        Some(name) => format!("{kind} '{name}'"),
        None => format!("{kind} {number}"),
    }
}

/// Light that a shadow ray aims at, by name or index.
pub(super) fn light(scene: &Scene, index: Option<usize>) -> String {
    let named = index.and_then(|i| scene.lights.get(i).map(|light| (i, light.name.as_str())));
    match named {
        Some((i, "")) => format!("light {i}"),
        Some((_, name)) => format!("light '{name}'"),
        None => "a light".into(),
    }
}

/// Converts a point from the shapes' frame to world space.
pub(super) fn in_world(world: &World, point: Vec3) -> DVec3 {
    world.center + point.as_dvec3()
}

/// Interval of a ray inside a node or cell, as distances; `None` if the ray only touches the padding.
pub(super) fn inside(extent: &Extent, ray: &Ray) -> Option<(f64, f64)> {
    let (origin, dir, from) = (ray.origin.as_dvec3(), ray.dir.as_dvec3(), f64::from(ray.t_min));
    match *extent {
        Extent::Box(bounds) => bounds.span(ray.origin, dir.recip(), from, f64::INFINITY),
        Extent::Ball { center, radius } => {
            let middle = (center - origin).dot(dir) / dir.length_squared();
            let off = (origin + dir * middle - center).length_squared();
            let half = ((radius * radius - off) / dir.length_squared()).sqrt();
            (middle + half >= from).then_some((from.max(middle - half), middle + half))
        }
    }
}

/// Whether the query continued the search behind a hit.
pub(super) fn continues(after: &Hit) -> bool {
    after.is_some()
}
