//! Polygons and patches -> one mesh for each material and kind.

use super::index;
use crate::load::Polygons;
use crate::math::ear_clip::{EarClipper, newell};
use crate::math::frame::snapped_center;
use crate::math::{DAffine3, DVec3, Vec3};
use crate::scene::{Instance, Mesh, Polygon, Scene};
use std::collections::HashMap;

/// Half a unit of the sixth digit, which is what generators print: corners this far off a plane, relative to the
/// largest coordinate of the polygon, still lie in it.
const FLAT: f64 = 1e-6;

/// All faces of the file.
pub(super) struct Faces {
    polygons: Polygons,
    parts: Vec<Part>,
    /// Of a material and whether there are normals.
    known: HashMap<(u32, bool), usize>,
    clipper: EarClipper,
    /// Faces added.
    pub count: u64,
    /// Faces without area, which were not.
    pub dropped: u64,
}

/// A mesh in the making, positions in `f64`.
#[derive(Default)]
struct Part {
    mesh: Mesh,
    positions: Vec<DVec3>,
    /// Vertices by the bits of position and normal.
    numbers: HashMap<[u64; 6], u32>,
    faces: u32,
}

impl Faces {
    pub(super) fn new(polygons: Polygons) -> Self {
        let (parts, known) = (Vec::new(), HashMap::new());
        Self { polygons, parts, known, clipper: EarClipper::default(), count: 0, dropped: 0 }
    }

    /// Adds one face; `normals` is empty or has one for each corner.
    pub(super) fn add(&mut self, material: u32, points: &[DVec3], normals: &[DVec3]) {
        let area = newell(points);
        if area == DVec3::ZERO {
            self.dropped += 1;
            return;
        }
        self.count += 1;
        let key = (material, !normals.is_empty());
        let parts = &mut self.parts;
        let part = *self.known.entry(key).or_insert_with(|| {
            parts.push(Part { mesh: Mesh { material, ..Mesh::default() }, ..Part::default() });
            parts.len() - 1
        });
        let part = &mut self.parts[part];
        let own = area.normalize_or(DVec3::Z);
        let corners: Vec<u32> = points
            .iter()
            .enumerate()
            .map(|(i, &p)| part.vertex(p, normals.get(i).map(|n| n.try_normalize().unwrap_or(own))))
            .collect();

        let face = part.faces;
        part.faces += 1;
        if self.polygons == Polygons::Whole && corners.len() > 3 && normals.is_empty() && is_flat(points, own) {
            let first = index(part.mesh.polygon_corners.len());
            part.mesh.polygons.push(Polygon { first, len: index(corners.len()), face });
            part.mesh.polygon_corners.extend(corners);
            return;
        }
        let mut cut = Vec::new();
        self.clipper.cut(points, &mut cut);
        part.mesh.face_of_triangle.extend(cut.iter().map(|_| face));
        part.mesh.triangles.extend(cut.iter().map(|t| t.map(|i| corners[i as usize])));
    }

    /// Hands the meshes to the scene, each around its own centre; the largest displacement by rounding to `f32`.
    pub(super) fn finish(self, scene: &mut Scene) -> f64 {
        let mut worst = 0.0f64;
        for Part { mut mesh, positions, .. } in self.parts {
            let lo = positions.iter().fold(DVec3::INFINITY, |a, p| a.min(*p));
            let hi = positions.iter().fold(DVec3::NEG_INFINITY, |a, p| a.max(*p));
            let center = snapped_center(lo, hi);
            mesh.positions = positions.iter().map(|p| (p - center).as_vec3()).collect();
            let moved = positions.iter().zip(&mesh.positions).map(|(p, q)| (p - center).distance(q.as_dvec3()));
            worst = moved.fold(worst, f64::max);
            let world_from_object = DAffine3::from_translation(center);
            scene.instances.push(Instance { name: String::new(), mesh: index(scene.meshes.len()), world_from_object });
            scene.meshes.push(mesh);
        }
        worst
    }
}

impl Part {
    /// The number of a vertex; equal ones share it, so that faces are connected.
    fn vertex(&mut self, p: DVec3, normal: Option<DVec3>) -> u32 {
        let n = normal.unwrap_or_default();
        // Adding 0 makes one zero of two.
        let key = [p.x, p.y, p.z, n.x, n.y, n.z].map(|x| (x + 0.0).to_bits());
        let next = index(self.positions.len());
        let number = *self.numbers.entry(key).or_insert(next);
        if number == next {
            self.positions.push(p);
            self.mesh.normals.extend(normal.map(|n| -> Vec3 { n.as_vec3() }));
        }
        number
    }
}

/// Whether all corners lie in the plane through the first.
fn is_flat(points: &[DVec3], normal: DVec3) -> bool {
    let size = points.iter().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
    points.iter().all(|p| (p - points[0]).dot(normal).abs() <= FLAT * size)
}
