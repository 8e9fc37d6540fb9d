//! Tangents for normal maps where a file has none: MikkTSpace, as glTF requires and baking tools use.
//!
//! M. S. Mikkelsen, *Simulation of Wrinkled Surfaces Revisited*, 2008.

use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::{Mesh, Scene, TexCoords, UvTransform};
use bevy_mikktspace::{Geometry, Ops, TangentSpace};
use std::borrow::Cow;
use std::collections::HashMap;

/// Bytes that generating takes per corner: working data, and the vertex of its own that the corner may become.
pub const OF_CORNER: u64 = 256;

/// Generates tangents of `mesh` along texture coordinates, and records in the mesh which.
///
/// Vertices whose corners need different tangents are split; a mesh without normals gets flat ones, one vertex per corner.
/// Leaves the mesh unchanged when it lacks these coordinates, or has polygons instead of triangles.
pub fn generate(mesh: &mut Mesh, along: TexCoords) {
    let set = along.set as usize;
    let known = mesh.uvs.get(set).is_some_and(|uvs| uvs.len() == mesh.positions.len());
    if !known || mesh.triangles.is_empty() || !mesh.polygons.is_empty() {
        return;
    }
    if mesh.normals.is_empty() {
        flatten(mesh);
    }
    let (along, uvs) = transformed(along, &mesh.uvs[set]);
    let uvs = &*uvs;
    let (calm, crowded) = sort_out(mesh, uvs);
    let mut corners = vec![[Vec4::X; 3]; mesh.triangles.len()];
    let mut view = View { mesh, uvs, faces: &calm, corners: &mut corners };
    // The error type has no values.
    let _ = bevy_mikktspace::generate_tangents(&mut view);
    for face in crowded {
        corners[face as usize] = [of_face(mesh.triangles[face as usize], mesh, uvs); 3];
    }
    split(mesh, &corners);
    mesh.tangents_along = Some(along);
}

/// Texture coordinates after their transform, and the coordinates that tangents then follow: those of the file where the
/// transform is degenerate.
fn transformed(along: TexCoords, uvs: &[Vec2]) -> (TexCoords, Cow<'_, [Vec2]>) {
    let [x_axis, y_axis] = along.transform.axes();
    let area = x_axis.perp_dot(y_axis);
    if along.transform.keeps_directions() || area == 0.0 || !area.is_finite() {
        return (TexCoords { transform: UvTransform::default(), ..along }, uvs.into());
    }
    (along, uvs.iter().map(|uv| x_axis * uv.x + y_axis * uv.y).collect())
}

/// Generates the tangents of meshes that were postponed until normals are smooth: those with recorded coordinates and none.
pub fn generate_left(scene: &mut Scene) {
    for mesh in scene.meshes.iter_mut().filter(|mesh| mesh.tangents.is_empty()) {
        if let Some(along) = mesh.tangents_along.take() {
            generate(mesh, along);
        }
    }
}

/// Faces for the generator, and faces around a vertex where too many meet for it.
///
/// The generator visits the faces around a vertex by recursion and compares each with every other. It merges vertices
/// with equal position, normal and coordinates.
fn sort_out(mesh: &Mesh, uvs: &[Vec2]) -> (Vec<u32>, Vec<u32>) {
    /// Far more faces than meet at the tip of a finely turned cone.
    const CROWD: u32 = 1000;
    let all = 0..mesh.triangles.len() as u32;
    if mesh.triangles.len() as u64 <= u64::from(CROWD) {
        return (all.collect(), Vec::new());
    }
    let mut faces_of = vec![0; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|&vertex| faces_of[vertex as usize] += 1);
    let seen = |vertex: usize| {
        let ([x, y, z], [nx, ny, nz]) = (mesh.positions[vertex].to_array(), mesh.normals[vertex].to_array());
        // +0 and −0 are equal.
        [x, y, z, nx, ny, nz, uvs[vertex].x, uvs[vertex].y].map(|value| (value + 0.0).to_bits())
    };
    let mut faces_at: HashMap<[u32; 8], u32> = HashMap::with_capacity(mesh.positions.len());
    for (vertex, faces) in faces_of.iter().enumerate() {
        *faces_at.entry(seen(vertex)).or_default() += faces;
    }
    if faces_at.values().all(|&faces| faces <= CROWD) {
        return (all.collect(), Vec::new());
    }
    let is_calm = |vertex: &u32| faces_at[&seen(*vertex as usize)] <= CROWD;
    all.partition(|&face| mesh.triangles[face as usize].iter().all(is_calm))
}

/// Tangent of a single face, which the generator would start from.
fn of_face(triangle: [u32; 3], mesh: &Mesh, uvs: &[Vec2]) -> Vec4 {
    let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
    // Green of a normal map points up, v points down.
    let [u, v, w] = triangle.map(|vertex| Vec2::new(1.0, -1.0) * uvs[vertex as usize]);
    let (along, across) = (v - u, w - u);
    let area = along.perp_dot(across);
    let direction = ((b - a) * across.y - (c - a) * along.y) * area.signum();
    direction.try_normalize().unwrap_or(Vec3::X).extend(if area < 0.0 { -1.0 } else { 1.0 })
}

/// The mesh as the generator sees it.
struct View<'a> {
    mesh: &'a Mesh,
    uvs: &'a [Vec2],
    /// Faces for the generator.
    faces: &'a [u32],
    corners: &'a mut [[Vec4; 3]],
}

/// Functions with equal results on every machine.
struct LibmOps;

impl Ops for LibmOps {
    fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }

    fn acos(x: f32) -> f32 {
        libm::acosf(x)
    }
}

impl View<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[self.faces[face] as usize][corner] as usize
    }
}

impl Geometry<LibmOps> for View<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // Green of a normal map points up, v points down.
        let uv = self.uvs[self.vertex(face, corner)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        let Some(tangent) = tangent else { return };
        let tangent = Vec4::from(tangent.tangent_encoded());
        // Where coordinates do not vary there is no direction; any tangent will do.
        if tangent.is_finite() && tangent.truncate().length_squared() > 0.0 {
            self.corners[self.faces[face] as usize][corner] = tangent;
        }
    }
}

/// Gives every triangle its own vertices and flat normals.
fn flatten(mesh: &mut Mesh) {
    fn take<T: Copy>(values: &[T], triangles: &[[u32; 3]]) -> Vec<T> {
        triangles.iter().flatten().filter_map(|&v| values.get(v as usize)).copied().collect()
    }
    mesh.positions = take(&mesh.positions, &mesh.triangles);
    mesh.colors = take(&mesh.colors, &mesh.triangles);
    mesh.uvs = mesh.uvs.iter().map(|uvs| take(uvs, &mesh.triangles)).collect();
    for (i, triangle) in mesh.triangles.iter_mut().enumerate() {
        let first = 3 * i as u32;
        *triangle = [first, first + 1, first + 2];
    }
    let flat = |p: &[Vec3]| [snapped((p[1] - p[0]).cross(p[2] - p[0]).normalize_or(Vec3::Z)); 3];
    mesh.normals = mesh.positions.chunks_exact(3).flat_map(flat).collect();
}

/// A normal on a lattice: those of faces in one plane differ by rounding, and MikkTSpace averages tangents only of equal ones.
fn snapped(normal: Vec3) -> Vec3 {
    const STEPS: f32 = (1 << 21) as f32;
    (normal * STEPS).round() / STEPS
}

/// Converts tangents of corners to tangents of vertices, splitting vertices where they differ.
fn split(mesh: &mut Mesh, corners: &[[Vec4; 3]]) {
    mesh.tangents = vec![Vec4::ZERO; mesh.positions.len()];
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    for (i, tangents) in corners.iter().enumerate() {
        for (corner, tangent) in tangents.iter().enumerate() {
            let vertex = mesh.triangles[i][corner];
            let slot = &mut mesh.tangents[vertex as usize];
            if *slot == Vec4::ZERO {
                *slot = *tangent;
            }
            if *slot != *tangent {
                let key = (vertex, tangent.to_array().map(f32::to_bits));
                let copy = *copies.entry(key).or_insert_with(|| copy_vertex(mesh, vertex as usize, *tangent));
                mesh.triangles[i][corner] = copy;
            }
        }
    }
}

fn copy_vertex(mesh: &mut Mesh, vertex: usize, tangent: Vec4) -> u32 {
    fn repeat<T: Copy>(values: &mut Vec<T>, i: usize) {
        if let Some(&value) = values.get(i) {
            values.push(value);
        }
    }
    let copy = mesh.positions.len() as u32;
    repeat(&mut mesh.positions, vertex);
    repeat(&mut mesh.normals, vertex);
    repeat(&mut mesh.colors, vertex);
    mesh.uvs.iter_mut().for_each(|uvs| repeat(uvs, vertex));
    mesh.tangents.push(tangent);
    copy
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in the xy plane, u to the right, v down.
    fn square() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
            uvs: vec![vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn the_tangent_points_along_u_and_the_bitangent_up_the_picture() {
        let mut mesh = Mesh { normals: vec![Vec3::Z; 4], ..square() };
        generate(&mut mesh, TexCoords::default());
        assert_eq!(mesh.positions.len(), 4, "nothing needs splitting");
        for tangent in &mesh.tangents {
            assert_eq!(*tangent, Vec4::new(1.0, 0.0, 0.0, 1.0));
            assert_eq!(Vec3::Z.cross(tangent.truncate()) * tangent.w, Vec3::Y);
        }
    }

    #[test]
    fn mirrored_coordinates_split_the_seam() {
        let mut mesh = Mesh { normals: vec![Vec3::Z; 4], ..square() };
        // The second triangle is mirrored in u.
        mesh.uvs[0][3] = Vec2::new(2.0, 0.0);
        generate(&mut mesh, TexCoords::default());
        assert_eq!(mesh.positions.len(), 6);
        let signs = mesh.triangles.iter().map(|t| t.map(|v| mesh.tangents[v as usize].w));
        assert_eq!(signs.collect::<Vec<_>>(), [[1.0; 3], [-1.0; 3]]);
    }

    #[test]
    fn faces_in_one_plane_share_tangents_at_any_scale() {
        for k in 1..60 {
            let scale = k as f32 / 26.0;
            let place = |x: f32, y: f32| Vec3::new(x, y, 0.0) * scale;
            let positions = vec![place(-1.0, -0.9), place(0.95, -1.0), place(1.0, 0.9), place(-0.9, 1.0)];
            let uvs = vec![vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::new(0.6, 0.3)]];
            let mut mesh = Mesh { positions, uvs, ..square() };
            generate(&mut mesh, TexCoords::default());
            let at = |face: usize, corner: usize| mesh.tangents[mesh.triangles[face][corner] as usize];
            assert_eq!([at(0, 0), at(0, 2)], [at(1, 0), at(1, 1)], "{scale}");
        }
    }

    #[test]
    fn a_mesh_without_normals_becomes_flat_and_one_without_coordinates_stays() {
        let mut mesh = square();
        generate(&mut mesh, TexCoords::default());
        assert_eq!(mesh.normals, [Vec3::Z; 6]);
        assert_eq!(mesh.tangents.len(), 6);
        let mut bare = Mesh { uvs: Vec::new(), ..square() };
        generate(&mut bare, TexCoords::default());
        assert!(bare.tangents.is_empty());
    }

    /// A disc of many triangles around one vertex, or around as many equal ones; u to the right, v down.
    fn disc(faces: u32, welded: bool) -> Mesh {
        let rim = (0..=faces).map(|k| f64::from(k) * std::f64::consts::TAU / f64::from(faces));
        let rim = rim.map(|angle| Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0));
        let mut positions: Vec<Vec3> = rim.collect();
        let center = positions.len() as u32;
        positions.resize(positions.len() + if welded { 1 } else { faces as usize }, Vec3::ZERO);
        let uvs = positions.iter().map(|p| Vec2::new(p.x, -p.y)).collect();
        let triangles = (0..faces).map(|k| [center + if welded { 0 } else { k }, k, k + 1]).collect();
        Mesh { normals: vec![Vec3::Z; positions.len()], positions, uvs: vec![uvs], triangles, ..Mesh::default() }
    }

    #[test]
    fn where_very_many_faces_meet_each_has_its_own_tangent() {
        for (faces, welded) in [(200, true), (50_000, true), (50_000, false)] {
            let mut mesh = disc(faces, welded);
            generate(&mut mesh, TexCoords::default());
            assert_eq!(mesh.tangents.len(), mesh.positions.len());
            let off = |t: &Vec4| (*t - Vec4::new(1.0, 0.0, 0.0, 1.0)).length();
            assert!(mesh.tangents.iter().all(|t| off(t) < 2e-2), "{faces}");
        }
    }
}
