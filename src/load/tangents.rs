//! Tangents for normal maps where a file has none: MikkTSpace, as glTF asks for and baking tools use.
//!
//! M. S. Mikkelsen, *Simulation of Wrinkled Surfaces Revisited*, 2008.

use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::Mesh;
use bevy_mikktspace::{Geometry, Ops, TangentSpace};
use std::collections::HashMap;

/// Gives `mesh` tangents that follow texture coordinate set `uv_set`.
///
/// Vertices whose corners need different tangents are split; a mesh without normals gets flat ones, vertex by vertex.
/// Leaves the mesh as it is when it has no such coordinates, or polygons instead of triangles.
pub fn generate(mesh: &mut Mesh, uv_set: u32) {
    let set = uv_set as usize;
    let known = mesh.uvs.get(set).is_some_and(|uvs| uvs.len() == mesh.positions.len());
    if !known || mesh.triangles.is_empty() || !mesh.polygons.is_empty() {
        return;
    }
    if mesh.normals.is_empty() {
        flatten(mesh);
    }
    let mut corners = vec![[Vec4::X; 3]; mesh.triangles.len()];
    let mut view = View { mesh, uvs: &mesh.uvs[set], corners: &mut corners };
    // The error type has no values.
    let _ = bevy_mikktspace::generate_tangents(&mut view);
    split(mesh, &corners);
}

/// What the generator sees.
struct View<'a> {
    mesh: &'a Mesh,
    uvs: &'a [Vec2],
    corners: &'a mut [[Vec4; 3]],
}

/// The same results on every machine.
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
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry<LibmOps> for View<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
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
        // Green of a normal map points up, where v points down.
        let uv = self.uvs[self.vertex(face, corner)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        let Some(tangent) = tangent else { return };
        let tangent = Vec4::from(tangent.tangent_encoded());
        // Where coordinates do not vary there is no direction; any one will do.
        if tangent.is_finite() && tangent.truncate().length_squared() > 0.0 {
            self.corners[face][corner] = tangent;
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
    let flat = |p: &[Vec3]| [(p[1] - p[0]).cross(p[2] - p[0]).normalize_or(Vec3::Z); 3];
    mesh.normals = mesh.positions.chunks_exact(3).flat_map(flat).collect();
}

/// Turns tangents of corners into tangents of vertices.
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
        generate(&mut mesh, 0);
        assert_eq!(mesh.positions.len(), 4, "nothing needs splitting");
        for tangent in &mesh.tangents {
            assert_eq!(*tangent, Vec4::new(1.0, 0.0, 0.0, 1.0));
            assert_eq!(Vec3::Z.cross(tangent.truncate()) * tangent.w, Vec3::Y);
        }
    }

    #[test]
    fn mirrored_coordinates_split_the_seam() {
        let mut mesh = Mesh { normals: vec![Vec3::Z; 4], ..square() };
        // The second triangle runs u the other way.
        mesh.uvs[0][3] = Vec2::new(2.0, 0.0);
        generate(&mut mesh, 0);
        assert_eq!(mesh.positions.len(), 6);
        let signs = mesh.triangles.iter().map(|t| t.map(|v| mesh.tangents[v as usize].w));
        assert_eq!(signs.collect::<Vec<_>>(), [[1.0; 3], [-1.0; 3]]);
    }

    #[test]
    fn a_mesh_without_normals_becomes_flat_and_one_without_coordinates_stays() {
        let mut mesh = square();
        generate(&mut mesh, 0);
        assert_eq!(mesh.normals, [Vec3::Z; 6]);
        assert_eq!(mesh.tangents.len(), 6);
        let mut bare = Mesh { uvs: Vec::new(), ..square() };
        generate(&mut bare, 0);
        assert!(bare.tangents.is_empty());
    }
}
