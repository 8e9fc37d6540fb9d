//! Wires under the linear part of a transform -> meshes of solids with the world's axes.

use super::solid::{Solid, octahedron, prism, roof, square, tetrahedron};
use super::{Widths, Wires};
use crate::load::place::bounds_of;
use crate::math::frame::{center_of_most, spread};
use crate::math::{DMat3, DVec3, Vec3, Vec4};
use crate::scene::Mesh;
use rayon::prelude::*;

/// Solids, relative to a centre.
pub(super) struct Baked {
    pub meshes: Vec<Mesh>,
    pub center: DVec3,
    /// Number of points and lines without a finite position.
    pub dropped: u64,
}

/// Number of wires per mesh, so that its corners can be indexed.
const RUN: usize = 1 << 24;

/// Upper bounds of the bytes of the solids of `wires`: in meshes, and temporarily while they are made.
pub(super) fn cost(wires: &Wires, widths: &Widths) -> [u64; 2] {
    let [points, lines] = wires.count();
    let mesh = &wires.mesh;
    let of = |there: bool, bytes: usize| if there { bytes } else { 0 };
    let corner = size_of::<Vec3>()
        + of(!mesh.normals.is_empty(), size_of::<Vec3>())
        + of(!mesh.tangents.is_empty(), size_of::<Vec4>())
        + of(!mesh.colors.is_empty(), size_of::<Vec4>())
        + mesh.uvs.iter().map(|uvs| of(!uvs.is_empty(), 8)).sum::<usize>();
    let bytes = |shape: Shape| (shape.corners * corner + shape.triangles * (12 + 4)) as u64;
    let (point, line) = (bytes(Shape::of_point(wires.is_lit(), widths)), bytes(Shape::OF_LINE));
    let held = (points + lines).min(BATCH as u64) * point.max(line);
    [points.saturating_mul(point).saturating_add(lines.saturating_mul(line)), held]
}

/// Size of a solid.
#[derive(Clone, Copy)]
struct Shape {
    corners: usize,
    triangles: usize,
}

impl Shape {
    const OF_LINE: Self = Self { corners: 6, triangles: 8 };

    fn of_point(is_lit: bool, widths: &Widths) -> Self {
        let (corners, triangles) = match (is_lit, widths.crowd) {
            (true, _) => (4, 2),
            (false, true) => (4, 4),
            (false, false) => (6, 8),
        };
        Self { corners, triangles }
    }
}

/// Makes the solids.
pub(super) fn bake(wires: &Wires, linear: DMat3, widths: &Widths) -> Baked {
    let place = |vertex: u32| wires.mesh.positions.get(vertex as usize).map_or(DVec3::NAN, |p| linear * p.as_dvec3());
    let (lo, hi) = bounds_of(wires.ends.as_flattened().par_iter().map(|&vertex| place(vertex)));
    let center = center_of_most(lo, hi, spread(wires.ends.len()).map(|i| place(wires.ends[i][0])));
    let of = Baking { wires, widths, turn: Turn::new(linear), center };
    let mut out = Baked { meshes: Vec::new(), center, dropped: 0 };
    for (run, ends) in wires.ends.chunks(RUN).enumerate() {
        let mut whole = of.room(ends);
        for (batch, ends) in ends.chunks(BATCH).enumerate() {
            // Less than 2^32, like the indices of their vertices.
            #[expect(clippy::cast_possible_truncation, reason = "memory for 2^32 lines is not granted")]
            let part = |(i, ends)| of.solids(ends, (run * RUN + batch * BATCH + i * PART) as u32);
            let parts: Vec<(Mesh, u64)> = ends.par_chunks(PART).enumerate().map(part).collect();
            for (part, dropped) in parts {
                append(&mut whole, part);
                out.dropped += dropped;
            }
        }
        if !whole.triangles.is_empty() {
            out.meshes.push(whole);
        }
    }
    out
}

/// Number of wires per parallel task, and per batch whose solids are held besides their mesh.
const PART: usize = 1 << 12;
const BATCH: usize = 1 << 15;

/// Appends a mesh, offsetting its vertex indices.
#[expect(clippy::cast_possible_truncation, reason = "runs are short enough")]
fn append(whole: &mut Mesh, part: Mesh) {
    let first = whole.positions.len() as u32;
    whole.positions.extend(part.positions);
    whole.triangles.extend(part.triangles.into_iter().map(|t| t.map(|i| first + i)));
    whole.face_of_triangle.extend(part.face_of_triangle);
    whole.normals.extend(part.normals);
    whole.tangents.extend(part.tangents);
    whole.colors.extend(part.colors);
    for (to, from) in whole.uvs.iter_mut().zip(part.uvs) {
        to.extend(from);
    }
}

/// Parameters of baking.
struct Baking<'a> {
    wires: &'a Wires,
    widths: &'a Widths,
    turn: Turn,
    center: DVec3,
}

impl Baking<'_> {
    /// Empty mesh with capacity for the solids of `ends`.
    fn room(&self, ends: &[[u32; 2]]) -> Mesh {
        let from = &self.wires.mesh;
        let points = ends.iter().filter(|[a, b]| a == b).count();
        let lines = ends.len() - points;
        let of_point = Shape::of_point(self.wires.is_lit(), self.widths);
        let corners = points * of_point.corners + lines * Shape::OF_LINE.corners;
        let triangles = points * of_point.triangles + lines * Shape::OF_LINE.triangles;
        let room = |there: bool| if there { corners } else { 0 };
        let uvs = from.uvs.iter().map(|uvs| Vec::with_capacity(room(!uvs.is_empty())));
        Mesh {
            positions: Vec::with_capacity(corners),
            triangles: Vec::with_capacity(triangles),
            face_of_triangle: Vec::with_capacity(triangles),
            normals: Vec::with_capacity(room(!from.normals.is_empty())),
            tangents: Vec::with_capacity(room(!from.tangents.is_empty())),
            colors: Vec::with_capacity(room(!from.colors.is_empty())),
            uvs: uvs.collect(),
            ..named(from)
        }
    }

    /// Solids of `ends`, the first of which has the index `number`; and the number of wires without one.
    fn solids(&self, ends: &[[u32; 2]], number: u32) -> (Mesh, u64) {
        let Self { wires, widths, turn, center } = self;
        let place = |vertex: u32| match wires.mesh.positions.get(vertex as usize) {
            Some(p) => turn.linear * p.as_dvec3() - center,
            None => DVec3::NAN,
        };
        let mut baker = Baker { from: &wires.mesh, turn, mesh: self.room(ends), dropped: 0 };
        for (number, &[first, second]) in (number..).zip(ends) {
            let (a, b) = (place(first), place(second));
            let up = baker.up(first, second);
            let width = if first == second { widths.point } else { widths.line };
            let vertices = [first, first, first, second, second, second];
            match up {
                Some(up) if a != b => baker.push(&roof([a, b], up, width), vertices, number),
                None if a != b => baker.push(&prism([a, b], width), vertices, number),
                // A point, or a line of length 0.
                Some(up) => baker.push(&square(a, up, width), [first; 4], number),
                None if widths.crowd => baker.push(&tetrahedron(a, width), [first; 4], number),
                None => baker.push(&octahedron(a, width), [first; 6], number),
            }
        }
        (baker.mesh, baker.dropped)
    }
}

fn named(from: &Mesh) -> Mesh {
    Mesh { name: from.name.clone(), uvs: vec![Vec::new(); from.uvs.len()], ..Mesh::default() }
}

/// Effect of a transform on directions.
struct Turn {
    linear: DMat3,
    /// Matrix for normals.
    normal: DMat3,
    /// −1 for mirroring transforms, else 1.
    sign: f64,
}

impl Turn {
    fn new(linear: DMat3) -> Self {
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        // The inverse transpose up to its scale, which exists even for singular matrices.
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
    turn: &'a Turn,
    mesh: Mesh,
    dropped: u64,
}

impl Baker<'_> {
    /// Mean direction of the normals of both ends, in world space; `None` without normals.
    fn up(&self, first: u32, second: u32) -> Option<DVec3> {
        let normal = |vertex: u32| self.from.normals.get(vertex as usize).map(|&n| self.turn.normal(n));
        let (a, b) = (normal(first)?, normal(second)?);
        Some((a + b).try_normalize().unwrap_or(a))
    }

    /// Adds a solid whose corners take the attributes of `vertices`; counts it as dropped where rounding to `f32` collapses it.
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
            let turn = self.turn;
            self.mesh.normals.extend(self.from.normals.get(vertex).map(|&n| turn.normal(n).as_vec3()));
            self.mesh.tangents.extend(self.from.tangents.get(vertex).map(|&t| turn.tangent(t)));
            self.mesh.colors.extend(self.from.colors.get(vertex));
            for (to, from) in self.mesh.uvs.iter_mut().zip(&self.from.uvs) {
                to.extend(from.get(vertex));
            }
        }
    }
}
