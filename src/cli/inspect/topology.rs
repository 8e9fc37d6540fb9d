//! Connectivity of faces, where equal positions count as one corner: open, non-manifold and duplicate parts.

use crate::accel::Shapes;
use crate::math::Vec3;
use crate::render::{PrimSource, World};
use crate::scene::Scene;

/// Counts over all faces of a scene, in world space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Topology {
    /// Distinct positions used by faces.
    pub corners: u64,
    /// Distinct edges.
    pub edges: u64,
    /// Edges of a single face.
    pub open: u64,
    /// Edges of three or more faces.
    pub non_manifold: u64,
    /// Faces with the same corners as an earlier face.
    pub duplicates: u64,
    /// Faces with two corners at one position.
    pub degenerate: u64,
    /// Whether kept instances are counted separately, although some may touch others.
    pub by_object: bool,
}

impl Topology {
    /// Counts what is stored, each kept object times its instances: for scenes that would exceed memory with instances flattened.
    pub(super) fn by_object(scene: &Scene, world: &World) -> Self {
        let mut times = vec![0; world.instanced.objects().len()];
        let placed = world.instanced.placed().iter().filter(|placed| !is_wire(scene, world, placed.first));
        placed.for_each(|placed| times[placed.object as usize] += 1);
        let objects = world.instanced.objects().iter().zip(times).filter(|(_, times)| *times > 0);
        let objects = objects.map(|(object, times)| Self::of_faces(object.shapes(), |_| true).times(times));
        let all = objects.fold(Self::of(scene, world), Self::plus);
        Self { by_object: true, ..all }
    }

    /// Counts the faces of shapes that are not of kept instances; points and lines have none.
    pub(super) fn of(scene: &Scene, world: &World) -> Self {
        if !scene.meshes.iter().any(|mesh| mesh.is_wire) {
            return Self::of_faces(&world.shapes, |_| true);
        }
        Self::of_faces(&world.shapes, |stored| !is_wire(scene, world, world.instanced.number(stored)))
    }

    fn times(self, n: u64) -> Self {
        Self {
            corners: self.corners * n,
            edges: self.edges * n,
            open: self.open * n,
            non_manifold: self.non_manifold * n,
            duplicates: self.duplicates * n,
            degenerate: self.degenerate * n,
            ..self
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            corners: self.corners + other.corners,
            edges: self.edges + other.edges,
            open: self.open + other.open,
            non_manifold: self.non_manifold + other.non_manifold,
            duplicates: self.duplicates + other.duplicates,
            degenerate: self.degenerate + other.degenerate,
            ..self
        }
    }

    /// Counts the triangles and polygons of `shapes`; of triangles only those whose index is `wanted`.
    fn of_faces(shapes: &Shapes, wanted: impl Fn(u32) -> bool) -> Self {
        let corner = weld(&shapes.vertices);
        let triangles = (0..).zip(&shapes.triangles).filter(|(prim, _)| wanted(*prim)).map(|(_, t)| t.to_vec());
        let polygons = shapes.polygons.iter().map(|&(first, len)| {
            let (first, len) = (first as usize, len as usize);
            shapes.polygon_corners.get(first..first + len).unwrap_or_default().to_vec()
        });
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(shapes.triangles.len() * 3);
        let mut faces: Vec<Vec<u32>> = Vec::with_capacity(shapes.triangles.len());
        let mut used = vec![false; shapes.vertices.len()];
        let mut topology = Self::default();

        for face in triangles.chain(polygons) {
            let face: Vec<u32> = face.iter().map(|&v| corner[v as usize]).collect();
            face.iter().for_each(|&c| used[c as usize] = true);
            let next = face.iter().cycle().skip(1);
            let sides: Vec<(u32, u32)> = face.iter().zip(next).map(|(&a, &b)| (a.min(b), a.max(b))).collect();
            if sides.iter().any(|(a, b)| a == b) {
                topology.degenerate += 1;
                continue;
            }
            edges.extend(sides);
            let mut sorted = face;
            sorted.sort_unstable();
            faces.push(sorted);
        }
        edges.sort_unstable();
        for run in edges.chunk_by(|a, b| a == b) {
            topology.edges += 1;
            topology.open += u64::from(run.len() == 1);
            topology.non_manifold += u64::from(run.len() > 2);
        }
        faces.sort_unstable();
        topology.duplicates = faces.chunk_by(|a, b| a == b).map(|run| run.len() as u64 - 1).sum();
        topology.corners = used.iter().filter(|&&u| u).count() as u64;
        topology
    }
}

/// Whether a prim is part of a point or line, for which the file has no faces.
fn is_wire(scene: &Scene, world: &World, prim: u32) -> bool {
    match world.source(prim) {
        PrimSource::Triangle { instance, .. } => scene.meshes[scene.instances[instance as usize].mesh as usize].is_wire,
        _ => false,
    }
}

/// Index of the first vertex at the same position, for each vertex; −0 and 0 are equal.
fn weld(vertices: &[Vec3]) -> Vec<u32> {
    let key = |v: u32| (vertices[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    #[expect(clippy::cast_possible_truncation, reason = "loading refuses scenes with 2^32 vertices")]
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));
    let mut first = vec![0; vertices.len()];
    for run in order.chunk_by(|&a, &b| key(a) == key(b)) {
        run.iter().for_each(|&v| first[v as usize] = run[0]);
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Shapes {
        let vertices = vertices.iter().map(|&v| v.into()).collect();
        Shapes { vertices, triangles: triangles.to_vec(), ..Shapes::default() }
    }

    const TETRA: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn a_tetrahedron_is_closed() {
        let found = Topology::of_faces(&shapes(&TETRA, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), |_| true);
        assert_eq!(found, Topology { corners: 4, edges: 6, ..Topology::default() });
    }

    #[test]
    fn faces_that_share_no_vertex_hang_together_where_positions_are_equal() {
        let mut vertices = TETRA.to_vec();
        vertices.extend([[-0.0, 0.0, 0.0], [1.0, -0.0, 0.0], [0.0, 0.0, 1.0]]);
        let found = Topology::of_faces(&shapes(&vertices, &[[0, 2, 1], [4, 5, 6]]), |_| true);
        assert_eq!((found.corners, found.edges, found.open), (4, 5, 4));
    }

    #[test]
    fn a_third_face_on_an_edge_and_a_repeated_face_are_found() {
        let found = Topology::of_faces(&shapes(&TETRA, &[[0, 1, 2], [0, 1, 3], [1, 0, 2], [2, 2, 3]]), |_| true);
        assert_eq!((found.non_manifold, found.duplicates, found.degenerate), (1, 1, 1));
    }
}
