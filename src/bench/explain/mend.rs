//! Repairs scenes as far as the cost of rays is concerned.

use crate::math::DVec3;
use crate::scene::{Instance, Mesh, Scene};
use std::collections::HashSet;

/// Corners of a triangle in world space.
pub(super) type Corners = [DVec3; 3];

/// Triangles of all instances, in world space.
pub(super) fn triangles(scene: &Scene) -> impl Iterator<Item = Corners> {
    scene.instances.iter().flat_map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        mesh.triangles.iter().map(|triangle| corners(mesh, instance, triangle))
    })
}

fn corners(mesh: &Mesh, instance: &Instance, triangle: &[u32; 3]) -> Corners {
    triangle.map(|i| instance.world_from_object.transform_point3(mesh.positions[i as usize].as_dvec3()))
}

/// Length of the longest edge of a triangle.
pub(super) fn length([a, b, c]: &Corners) -> f64 {
    (*b - *a).length().max((*c - *b).length()).max((*a - *c).length())
}

/// Height of a triangle over its longest edge, divided by that edge: 0.87 at most, near 0 for slivers.
pub(super) fn slimness(corners: &Corners) -> f64 {
    let [a, b, c] = *corners;
    (b - a).cross(c - a).length() / length(corners).powi(2).max(f64::MIN_POSITIVE)
}

/// Copies the scene with every triangle for which `limit` returns a length cut until no edge is longer. Triangles are judged per
/// instance, in world space. Once `most` pieces are made, the rest stays whole.
pub(super) fn cut(scene: &Scene, limit: impl Fn(&Corners) -> Option<f64>, most: usize) -> Scene {
    let mut mended = scene.clone();
    let mut made = 0;
    for (i, instance) in scene.instances.iter().enumerate() {
        if made >= most {
            break;
        }
        let mesh = &scene.meshes[instance.mesh as usize];
        let (mut own, mut pieces) = (mesh.clone(), Vec::new());
        own.triangles.retain(|triangle| {
            let placed = corners(mesh, instance, triangle);
            let limit = limit(&placed);
            pieces.extend(limit.map(|limit| (*triangle, placed, limit)));
            limit.is_none()
        });
        if pieces.is_empty() {
            continue;
        }
        for (triangle, placed, limit) in pieces {
            let before = own.triangles.len();
            halve(triangle, placed, if made < most { limit } else { f64::INFINITY }, &mut own);
            made += own.triangles.len() - before;
        }
        own.face_of_triangle.clear();
        // Other instances of the mesh may have another scale.
        mended.instances[i].mesh = u32::try_from(mended.meshes.len()).unwrap_or(u32::MAX);
        mended.meshes.push(own);
    }
    mended
}

/// Halves a triangle at its longest edge until no edge is longer than `limit`, and appends the pieces to the mesh.
fn halve(triangle: [u32; 3], placed: Corners, limit: f64, mesh: &mut Mesh) {
    let edges = [0, 1, 2].map(|k| (placed[(k + 1) % 3] - placed[k]).length());
    let k = (0..3).max_by(|&a, &b| edges[a].total_cmp(&edges[b])).unwrap_or(0);
    if edges[k] <= limit || !edges[k].is_finite() {
        mesh.triangles.push(triangle);
        return;
    }
    let turned = |j: usize| (k + j) % 3;
    let [a, b, c] = [0, 1, 2].map(|j| triangle[turned(j)]);
    let [place_a, place_b, place_c] = [0, 1, 2].map(|j| placed[turned(j)]);
    let (middle, place) = (halfway(mesh, a, b), (place_a + place_b) * 0.5);
    halve([a, middle, c], [place_a, place, place_c], limit, mesh);
    halve([middle, b, c], [place, place_b, place_c], limit, mesh);
}

/// Appends a vertex halfway between two, with interpolated attributes, and returns its index.
fn halfway(mesh: &mut Mesh, a: u32, b: u32) -> u32 {
    let number = u32::try_from(mesh.positions.len()).unwrap_or(u32::MAX);
    let (a, b) = (a as usize, b as usize);
    mesh.positions.push((mesh.positions[a] + mesh.positions[b]) * 0.5);
    if let (Some(&first), Some(&second)) = (mesh.normals.get(a), mesh.normals.get(b)) {
        mesh.normals.push((first + second).try_normalize().unwrap_or(first));
    }
    if let (Some(&first), Some(&second)) = (mesh.tangents.get(a), mesh.tangents.get(b)) {
        let direction = (first + second).truncate().try_normalize().unwrap_or(first.truncate());
        mesh.tangents.push(direction.extend(first.w));
    }
    if let (Some(&first), Some(&second)) = (mesh.colors.get(a), mesh.colors.get(b)) {
        mesh.colors.push((first + second) * 0.5);
    }
    for set in &mut mesh.uvs {
        if let (Some(&first), Some(&second)) = (set.get(a), set.get(b)) {
            set.push((first + second) * 0.5);
        }
    }
    number
}

/// Copies the scene without duplicate triangles, and returns how many were dropped. Duplicates are opaque, have the same three
/// corners and equal materials, and face the same side or are double-sided.
pub(super) fn without_copies(scene: &Scene) -> (Scene, usize) {
    let like: Vec<_> =
        scene.materials.iter().map(|one| scene.materials.iter().position(|other| other == one)).collect();
    let mut mended = scene.clone();
    let mut seen = HashSet::new();
    let mut dropped = 0;
    let mut meshes = Vec::new();
    for instance in &mut mended.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        let material = scene.materials.get(mesh.material as usize);
        let (is_opaque, both_sides) = material.map_or((true, false), |m| (m.is_opaque(), m.double_sided));
        let (number, mirrored) =
            (like.get(mesh.material as usize), instance.world_from_object.matrix3.determinant() < 0.0);
        let mut own = mesh.clone();
        own.face_of_triangle.clear();
        own.triangles.retain(|triangle| {
            let mut key = corners(mesh, instance, triangle).map(|p| (p + 0.0).to_array().map(f64::to_bits));
            // Rotate the least corner to the front: the order of the other two then gives the facing side.
            let least = (0..3).min_by_key(|&k| key[k]).unwrap_or(0);
            key.rotate_left(least);
            let front = !both_sides && (key[1] < key[2]) != mirrored;
            key[1..].sort_unstable();
            let first = !is_opaque || seen.insert((key, front, number));
            dropped += usize::from(!first);
            first
        });
        instance.mesh = u32::try_from(meshes.len()).unwrap_or(u32::MAX);
        meshes.push(own);
    }
    mended.meshes = meshes;
    (mended, dropped)
}
