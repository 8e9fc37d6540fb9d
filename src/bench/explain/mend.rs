//! Scenes with their faults mended, as far as the cost of rays is concerned.

use crate::math::{DVec3, Vec3};
use crate::scene::{Instance, Mesh, Scene};
use std::collections::HashSet;

/// The corners of a triangle in the world.
pub(super) type Corners = [DVec3; 3];

/// Every triangle of every instance.
pub(super) fn triangles(scene: &Scene) -> impl Iterator<Item = Corners> {
    scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        mesh.triangles.iter().map(|triangle| corners(mesh, instance, triangle))
    })
}

fn corners(mesh: &Mesh, instance: &Instance, triangle: &[u32; 3]) -> Corners {
    triangle.map(|i| instance.world_from_object.transform_point3(mesh.positions[i as usize].as_dvec3()))
}

/// The longest edge of a triangle.
pub(super) fn length([a, b, c]: &Corners) -> f64 {
    (*b - *a).length().max((*c - *b).length()).max((*a - *c).length())
}

/// Its height over that edge, as a part of it: 0.87 at most, near 0 for slivers.
pub(super) fn slimness(corners: &Corners) -> f64 {
    let [a, b, c] = *corners;
    (b - a).cross(c - a).length() / length(corners).powi(2).max(f64::MIN_POSITIVE)
}

/// The scene in which every triangle for which `limit` gives a length is cut until no edge is longer: of each instance those
/// that are so large where it stands. The pieces are flat, whatever the normals were. At most `most` pieces are made.
pub(super) fn cut(scene: &Scene, limit: impl Fn(&Corners) -> Option<f64>, most: usize) -> Scene {
    let mut mended = scene.clone();
    let mut made = 0;
    for (i, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mut kept = Vec::new();
        let mut pieces = Mesh { material: mesh.material, name: mesh.name.clone(), ..Mesh::default() };
        for triangle in &mesh.triangles {
            let placed = corners(mesh, instance, triangle);
            match limit(&placed).filter(|_| made < most) {
                Some(limit) => {
                    let local = triangle.map(|i| mesh.positions[i as usize]);
                    made += halve(local, placed, limit, &mut pieces);
                }
                None => kept.push(*triangle),
            }
        }
        if pieces.triangles.is_empty() {
            continue;
        }
        // Others of its mesh may be of another size.
        let rest = Mesh { triangles: kept, face_of_triangle: Vec::new(), ..mesh.clone() };
        let number = u32::try_from(mended.meshes.len()).unwrap_or(u32::MAX);
        mended.meshes.extend([rest, pieces]);
        mended.instances[i].mesh = number;
        mended.instances.push(Instance { mesh: number + 1, ..instance.clone() });
    }
    mended
}

/// Halves a triangle at its longest edge until no edge is longer than `limit`; the pieces made.
fn halve(local: [Vec3; 3], placed: Corners, limit: f64, pieces: &mut Mesh) -> usize {
    let edges = [0, 1, 2].map(|k| (placed[(k + 1) % 3] - placed[k]).length());
    let k = (0..3).max_by(|&a, &b| edges[a].total_cmp(&edges[b])).unwrap_or(0);
    if edges[k] <= limit || !edges[k].is_finite() {
        let base = u32::try_from(pieces.positions.len()).unwrap_or(u32::MAX);
        pieces.positions.extend(local);
        pieces.triangles.push([base, base + 1, base + 2]);
        return 1;
    }
    let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
    let (middle, world_middle) = ((local[a] + local[b]) * 0.5, (placed[a] + placed[b]) * 0.5);
    let first = halve([local[a], middle, local[c]], [placed[a], world_middle, placed[c]], limit, pieces);
    first + halve([middle, local[b], local[c]], [world_middle, placed[b], placed[c]], limit, pieces)
}

/// The scene without triangles that stand on the same three points as one before them, and how many they were.
pub(super) fn without_copies(scene: &Scene) -> (Scene, usize) {
    let mut mended = scene.clone();
    let mut seen = HashSet::new();
    let mut dropped = 0;
    let mut meshes = Vec::new();
    for instance in &mut mended.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mut own = mesh.clone();
        own.face_of_triangle.clear();
        own.triangles.retain(|triangle| {
            let mut key = corners(mesh, instance, triangle).map(|p| (p + 0.0).to_array().map(f64::to_bits));
            key.sort_unstable();
            let first = seen.insert(key);
            dropped += usize::from(!first);
            first
        });
        instance.mesh = u32::try_from(meshes.len()).unwrap_or(u32::MAX);
        meshes.push(own);
    }
    mended.meshes = meshes;
    (mended, dropped)
}
