//! Polygons and patches -> one mesh for each material and kind.

use super::index;
use crate::load::Polygons;
use crate::load::limits::{Budget, OverBudget};
use crate::load::place::{is_usable, leave_out_collapsed, place};
use crate::math::ear_clip::{EarClipper, newell};
use crate::math::{DAffine3, DVec3, Vec3};
use crate::scene::{Instance, Mesh, Polygon, Scene};
use std::collections::HashMap;
use std::mem::size_of;

/// Half a unit of the sixth digit, which is what generators print: corners this far off a plane, relative to the
/// largest coordinate of the polygon, still count as coplanar.
const FLAT: f64 = 1e-6;

/// Bytes that a corner takes until it is part of a mesh: as a vertex, twice in `f64` and in the mesh with its normal, in a
/// table that is never less than half full once it has grown, and as the corner of a triangle.
const CORNER: u64 = 2 * 24 + 3 * 12 + 2 * 64 + 2 * 16;

/// Bytes of an empty mesh.
const PART: u64 = 2 * (size_of::<Part>() + size_of::<Mesh>() + size_of::<Instance>()) as u64;

/// All faces of the file.
pub(super) struct Faces {
    polygons: Polygons,
    parts: Vec<Part>,
    /// Index of each part, by material and whether it has normals.
    known: HashMap<(u32, bool), usize>,
    clipper: EarClipper,
    /// Faces without area, which were not added.
    pub flat: u64,
    /// Faces with a corner too far away, which were not added.
    pub far: u64,
}

/// Result of [`Faces::finish`].
pub(super) struct Finished {
    /// Number of faces drawn.
    pub count: u64,
    /// Number of triangles that collapsed by rounding.
    pub collapsed: u64,
    /// The largest displacement by rounding to `f32`.
    pub max_rounding: f64,
}

/// A mesh under construction, positions in `f64`.
#[derive(Default)]
struct Part {
    mesh: Mesh,
    positions: Vec<DVec3>,
    /// Vertex numbers by the bits of position and normal.
    numbers: HashMap<[u64; 6], u32>,
    faces: u32,
}

impl Faces {
    pub(super) fn new(polygons: Polygons) -> Self {
        let (parts, known) = (Vec::new(), HashMap::new());
        Self { polygons, parts, known, clipper: EarClipper::default(), flat: 0, far: 0 }
    }

    /// Adds one face; `normals` is empty or has one for each corner.
    ///
    /// # Errors
    /// When memory would exceed `budget`.
    pub(super) fn add(
        &mut self,
        material: u32,
        points: &[DVec3],
        normals: &[DVec3],
        budget: &mut Budget,
    ) -> Result<(), OverBudget> {
        if !points.iter().copied().all(is_usable) {
            self.far += 1;
            return Ok(());
        }
        let area = newell(points);
        if area == DVec3::ZERO {
            self.flat += 1;
            return Ok(());
        }
        budget.take(points.len() as u64, CORNER)?;
        let key = (material, !normals.is_empty());
        let part = match self.known.get(&key) {
            Some(&part) => part,
            None => {
                budget.take(1, PART)?;
                self.parts.push(Part { mesh: Mesh { material, ..Mesh::default() }, ..Part::default() });
                self.known.insert(key, self.parts.len() - 1);
                self.parts.len() - 1
            }
        };
        let part = &mut self.parts[part];
        let own = area.normalize_or(DVec3::Z);
        let corners: Vec<u32> = points
            .iter()
            .enumerate()
            .map(|(i, &p)| part.vertex(p, normals.get(i).map(|n| n.try_normalize().unwrap_or(own))))
            .collect();

        let face = part.faces;
        part.faces += 1;
        if self.polygons.keeps(corners.len()) && normals.is_empty() && is_flat(points, own) {
            let first = index(part.mesh.polygon_corners.len());
            part.mesh.polygons.push(Polygon { first, len: index(corners.len()), face });
            part.mesh.polygon_corners.extend(corners);
            return Ok(());
        }
        let mut cut = Vec::new();
        self.clipper.cut(points, &mut cut);
        part.mesh.face_of_triangle.extend(cut.iter().map(|_| face));
        part.mesh.triangles.extend(cut.iter().map(|t| t.map(|i| corners[i as usize])));
        Ok(())
    }

    /// Moves the meshes to the scene, each relative to its own centre.
    pub(super) fn finish(self, scene: &mut Scene) -> Finished {
        let mut out = Finished { count: 0, collapsed: 0, max_rounding: 0.0 };
        for Part { mut mesh, positions, .. } in self.parts {
            let placed = place(&positions);
            mesh.positions = placed.positions;
            out.max_rounding = out.max_rounding.max(placed.max_rounding);
            out.collapsed += leave_out_collapsed(&mut mesh);
            out.count += mesh.faces() as u64;
            let world_from_object = DAffine3::from_translation(placed.center);
            scene.instances.push(Instance { name: String::new(), mesh: index(scene.meshes.len()), world_from_object });
            scene.meshes.push(mesh);
        }
        out
    }
}

impl Part {
    /// Number of a vertex; equal ones share it, so that faces are connected.
    fn vertex(&mut self, p: DVec3, normal: Option<DVec3>) -> u32 {
        let n = normal.unwrap_or_default();
        // Adding 0 maps −0 to +0.
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
