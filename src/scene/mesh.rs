//! Geometry: indexed triangles (and whole n-gons), spheres, cones, planes, and their placement.

use super::TexCoords;
use crate::math::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};
use std::mem::size_of;

/// One run of faces that share a material: a glTF primitive, or an OBJ `o`/`g`/`usemtl` run.
///
/// Vertex arrays are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file, or an empty string.
    pub name: String,
    /// Index into [`super::Scene::materials`].
    pub material: u32,
    /// Vertices, object space.
    pub positions: Vec<Vec3>,
    /// Unit shading normals; empty: faces are shaded flat.
    pub normals: Vec<Vec3>,
    /// Unit tangents with handedness in `w`; empty unless a normal map needs them.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates that the tangents were generated from; `None`: the file gave the tangents, and they serve all maps.
    pub tangents_along: Option<TexCoords>,
    /// Vertex colours, linear RGBA, multiplied into the base colour; empty: white.
    pub colors: Vec<Vec4>,
    /// Texture coordinate sets (`TEXCOORD_0`, `TEXCOORD_1`, …), v pointing down as in glTF.
    pub uvs: Vec<Vec<Vec2>>,
    /// Corners of each triangle, indices into the vertex arrays, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Face of the file that each triangle was cut from; empty: triangle i is face i.
    pub face_of_triangle: Vec<u32>,
    /// Planar n-gons kept whole (`--polygons whole`).
    pub polygons: Vec<Polygon>,
    /// Corners of all polygons, indices into the vertex arrays.
    pub polygon_corners: Vec<u32>,
    /// Whether the mesh consists of solids made from the points and lines of a file.
    pub is_wire: bool,
}

impl Mesh {
    /// Number of corners of all faces.
    pub fn corners(&self) -> usize {
        3 * self.triangles.len() + self.polygon_corners.len()
    }

    /// Size of the arrays, bytes.
    pub fn bytes(&self) -> u64 {
        let vertices = (self.positions.len() + self.normals.len()) * size_of::<Vec3>()
            + (self.tangents.len() + self.colors.len()) * size_of::<Vec4>()
            + self.uvs.iter().map(|set| set.len() * size_of::<Vec2>()).sum::<usize>();
        let faces = self.triangles.len() * size_of::<[u32; 3]>()
            + (self.face_of_triangle.len() + self.polygon_corners.len()) * size_of::<u32>()
            + self.polygons.len() * size_of::<Polygon>();
        (vertices + faces) as u64
    }

    /// Number of faces in the file that the triangles and polygons stand for; triangles of one face are adjacent.
    pub fn faces(&self) -> usize {
        let cut = if self.face_of_triangle.is_empty() {
            self.triangles.len()
        } else {
            self.face_of_triangle.chunk_by(|a, b| a == b).count()
        };
        cut + self.polygons.len()
    }

    /// Calls `look` with the corners of each face: triangles first, then polygons as they lie in
    /// [`Self::polygon_corners`].
    pub fn each_face(&self, mut look: impl FnMut(&[u32])) {
        self.triangles.iter().for_each(|face| look(face));
        for polygon in &self.polygons {
            look(&self.polygon_corners[polygon.first as usize..][..polygon.len as usize]);
        }
    }
}

/// A planar n-gon: a run of [`Mesh::polygon_corners`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Polygon {
    /// First corner.
    pub first: u32,
    /// Number of corners, at least 3.
    pub len: u32,
    /// Index of the face in the file.
    pub face: u32,
}

/// A mesh placed in the world.
///
/// A mirrored instance (negative determinant) shows the same front faces as an unmirrored one, as glTF demands. Its triangles
/// keep the mesh's corner order in world space as well, so that their winding is reversed there: whoever decides which side is
/// the front has to invert the result for a mirrored instance, as the renderer does. Normals are transformed by the inverse
/// transpose of the matrix, tangents by the matrix itself, and the sign of a tangent's `w` flips with the mirror. Loaders do none
/// of this to meshes; only where the joints of a skin mirror, which no instance can express, does the posed mesh come with its
/// corners already exchanged.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name of the node or object.
    pub name: String,
    /// Index into [`super::Scene::meshes`].
    pub mesh: u32,
    /// From object space to world space, composed in `f64`.
    pub world_from_object: DAffine3,
}

/// Matrix that transforms normals of faces as `m` transforms the faces; lengths scale as the areas do. Under a mirroring `m` they
/// still point to the same side of the faces. The inverse transpose up to a factor, which exists for any matrix.
pub(crate) fn normal_from_object(m: &DMat3) -> DMat3 {
    let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}

/// A sphere in world space.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Name in the scene file, or an empty string.
    pub name: String,
    /// Centre, world space.
    pub center: DVec3,
    /// Radius, greater than 0.
    pub radius: f64,
    /// Index into [`super::Scene::materials`].
    pub material: u32,
}

/// The lateral surface of a truncated cone in world space, open at both ends; a cylinder if the radii are equal.
#[derive(Clone, Debug)]
pub struct Cone {
    /// Name in the scene file, or an empty string.
    pub name: String,
    /// Centre of one end, world space.
    pub base: DVec3,
    /// Radius at `base`; 0 or more, and not 0 at both ends.
    pub base_radius: f64,
    /// Centre of the other end; differs from `base`.
    pub apex: DVec3,
    /// Radius at `apex`.
    pub apex_radius: f64,
    /// Index into [`super::Scene::materials`].
    pub material: u32,
}

impl Cone {
    /// Least and greatest corner of the bounding box: a circle of radius r across the unit axis a reaches r √(1 − aₖ²).
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let axis = (self.apex - self.base).normalize_or_zero();
        let reach = (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt);
        let (base, apex) = (reach * self.base_radius, reach * self.apex_radius);
        ((self.base - base).min(self.apex - apex), (self.base + base).max(self.apex + apex))
    }
}

/// An unbounded plane: all points p with `normal · p == offset`.
#[derive(Clone, Debug)]
pub struct Plane {
    /// Name in the scene file, or an empty string.
    pub name: String,
    /// Unit normal, world space; points to the front side.
    pub normal: DVec3,
    /// Distance of the plane from the world's origin along `normal`.
    pub offset: f64,
    /// Index into [`super::Scene::materials`].
    pub material: u32,
}
