//! Wires turned and stretched as their place says -> meshes of solids with the world's axes.

use super::solid::{Solid, octahedron, prism, roof, square, tetrahedron};
use super::{Widths, Wires};
use crate::math::frame::{center_of_most, spread};
use crate::math::{DMat3, DVec3, Vec3, Vec4};
use crate::scene::Mesh;

/// Solids, around where they stand.
pub(super) struct Baked {
    pub meshes: Vec<Mesh>,
    pub center: DVec3,
    /// Points and lines that have no finite place.
    pub dropped: u64,
}

/// Points and lines of one mesh, so that its corners can be counted.
const RUN: usize = 1 << 24;

/// Bytes that the solids of `wires` take, at most.
pub(super) fn cost(wires: &Wires, widths: &Widths) -> u64 {
    let [points, lines] = wires.count();
    let mesh = &wires.mesh;
    let of = |there: bool, bytes: usize| if there { bytes } else { 0 };
    let corner = size_of::<Vec3>()
        + of(!mesh.normals.is_empty(), size_of::<Vec3>())
        + of(!mesh.tangents.is_empty(), size_of::<Vec4>())
        + of(!mesh.colors.is_empty(), size_of::<Vec4>())
        + mesh.uvs.iter().map(|uvs| of(!uvs.is_empty(), 8)).sum::<usize>();
    let bytes = |corners: usize, triangles: usize| (corners * corner + triangles * (12 + 4)) as u64;
    let point = match (wires.is_lit(), widths.crowd) {
        (true, _) => bytes(4, 2),
        (false, true) => bytes(4, 4),
        (false, false) => bytes(6, 8),
    };
    points.saturating_mul(point).saturating_add(lines.saturating_mul(bytes(6, 8)))
}

/// Makes the solids.
pub(super) fn bake(wires: &Wires, linear: DMat3, widths: &Widths) -> Baked {
    let place = |vertex: u32| wires.mesh.positions.get(vertex as usize).map_or(DVec3::NAN, |p| linear * p.as_dvec3());
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in wires.ends.iter().flatten().map(|&vertex| place(vertex)).filter(|p| p.is_finite()) {
        (lo, hi) = (lo.min(point), hi.max(point));
    }
    let center = center_of_most(lo, hi, spread(wires.ends.len()).map(|i| place(wires.ends[i][0])));
    let mut out = Baked { meshes: Vec::new(), center, dropped: 0 };
    for (run, ends) in wires.ends.chunks(RUN).enumerate() {
        let mut baker = Baker { from: &wires.mesh, turn: Turn::new(linear), mesh: named(&wires.mesh), dropped: 0 };
        for (at, &[first, second]) in ends.iter().enumerate() {
            let (a, b) = (place(first) - center, place(second) - center);
            let up = baker.up(first, second);
            // Numbers of wires are below 2^32, as those of their vertices are.
            #[expect(clippy::cast_possible_truncation, reason = "memory for 2^32 lines is not granted")]
            let number = (run * RUN + at) as u32;
            let width = if first == second { widths.point } else { widths.line };
            let vertices = [first, first, first, second, second, second];
            match up {
                Some(up) if a != b => baker.push(&roof([a, b], up, width), vertices, number),
                None if a != b => baker.push(&prism([a, b], width), vertices, number),
                // A point, or a line without length.
                Some(up) => baker.push(&square(a, up, width), [first; 4], number),
                None if widths.crowd => baker.push(&tetrahedron(a, width), [first; 4], number),
                None => baker.push(&octahedron(a, width), [first; 6], number),
            }
        }
        out.dropped += baker.dropped;
        if !baker.mesh.triangles.is_empty() {
            out.meshes.push(baker.mesh);
        }
    }
    out
}

fn named(from: &Mesh) -> Mesh {
    Mesh { name: from.name.clone(), uvs: vec![Vec::new(); from.uvs.len()], ..Mesh::default() }
}

/// What a place does to directions.
struct Turn {
    linear: DMat3,
    /// For normals.
    normal: DMat3,
    /// −1 where it mirrors.
    sign: f64,
}

impl Turn {
    fn new(linear: DMat3) -> Self {
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        // The inverse transpose up to its length, which also exists where there is no inverse.
        let normal = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        Self { linear, normal, sign }
    }

    fn normal(&self, normal: Vec3) -> DVec3 {
        let own = normal.as_dvec3();
        (self.normal * own).try_normalize().or_else(|| own.try_normalize()).unwrap_or(DVec3::Y)
    }

    fn tangent(&self, tangent: Vec4) -> Vec4 {
        let along = (self.linear * tangent.truncate().as_dvec3()).try_normalize().unwrap_or(DVec3::X);
        along.as_vec3().extend(if self.sign < 0.0 { -tangent.w } else { tangent.w })
    }
}

struct Baker<'a> {
    from: &'a Mesh,
    turn: Turn,
    mesh: Mesh,
    dropped: u64,
}

impl Baker<'_> {
    /// The mean direction that the normals of both ends have in the world; `None` without normals.
    fn up(&self, first: u32, second: u32) -> Option<DVec3> {
        let normal = |vertex: u32| self.from.normals.get(vertex as usize).map(|&n| self.turn.normal(n));
        let (a, b) = (normal(first)?, normal(second)?);
        Some((a + b).try_normalize().unwrap_or(a))
    }

    /// Adds a solid whose corners have what `vertices` have; counts it where single precision leaves it no extent.
    fn push<const N: usize>(&mut self, solid: &Solid<N>, vertices: [u32; N], number: u32) {
        let corners = solid.corners.map(|corner| corner.as_vec3());
        let apart = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            a != b && b != c && c != a
        };
        if !corners.iter().all(|c| c.is_finite()) || !solid.triangles.iter().all(apart) {
            self.dropped += 1;
            return;
        }
        #[expect(clippy::cast_possible_truncation, reason = "runs are short enough")]
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(corners);
        self.mesh.triangles.extend(solid.triangles.iter().map(|t| t.map(|i| first + i)));
        self.mesh.face_of_triangle.extend(solid.triangles.iter().map(|_| number));
        for vertex in vertices.map(|vertex| vertex as usize) {
            let turn = &self.turn;
            self.mesh.normals.extend(self.from.normals.get(vertex).map(|&n| turn.normal(n).as_vec3()));
            self.mesh.tangents.extend(self.from.tangents.get(vertex).map(|&t| turn.tangent(t)));
            self.mesh.colors.extend(self.from.colors.get(vertex));
            for (to, from) in self.mesh.uvs.iter_mut().zip(&self.from.uvs) {
                to.extend(from.get(vertex));
            }
        }
    }
}
