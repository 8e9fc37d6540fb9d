//! Corners -> triangles and lines, and removal of what cannot be drawn from meshes.

use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::Mesh;
use bytemuck::allocation::try_cast_vec;
use gltf::json::mesh::Mode;

/// Triangles of a primitive, with corners in the order of glTF 2.0 §3.7.2.1.
///
/// `None` for points and lines. Left-over corners are dropped.
pub(super) fn triangles(mode: Mode, mut corners: Vec<u32>) -> Option<Vec<[u32; 3]>> {
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    match mode {
        Mode::Triangles => {
            corners.truncate(corners.len() / 3 * 3);
            // Reuses the memory where the capacity is a multiple of three.
            return Some(try_cast_vec(corners).unwrap_or_else(|(_, corners)| corners.as_chunks().0.to_vec()));
        }
        Mode::TriangleStrip => {
            let strip = corners.windows(3).enumerate();
            triangles.extend(strip.map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] }));
        }
        Mode::TriangleFan => {
            let Some((&first, rest)) = corners.split_first() else { return Some(triangles) };
            triangles.extend(rest.windows(2).map(|t| [t[0], t[1], first]));
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return None,
    }
    Some(triangles)
}

/// Ends of the lines of a primitive, in the order of glTF 2.0 §3.7.2.1; a point has the same vertex twice.
///
/// Empty for triangles. A left-over corner is dropped.
pub(super) fn lines(mode: Mode, corners: &[u32]) -> Vec<[u32; 2]> {
    let steps = corners.windows(2).map(|l| [l[0], l[1]]);
    match mode {
        Mode::Points => corners.iter().map(|&corner| [corner; 2]).collect(),
        Mode::Lines => corners.chunks_exact(2).map(|l| [l[0], l[1]]).collect(),
        Mode::LineStrip => steps.collect(),
        Mode::LineLoop => {
            let back = corners.last().zip(corners.first()).map(|(&last, &first)| [last, first]);
            steps.chain(back.filter(|_| corners.len() > 1)).collect()
        }
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => Vec::new(),
    }
}

/// Renumbers corners by the vertices in use and returns these, ascending; `None`: all `vertices` are in use.
///
/// Time and memory depend on the number of corners, however large the pool of vertices is. Every corner has to be below
/// `vertices`.
pub(super) fn gather(corners: &mut [u32], vertices: u64) -> Option<Vec<u32>> {
    /// Up to this many vertices per corner, a table of all vertices is faster than sorting the corners.
    const DENSE: u64 = 2;
    if vertices <= DENSE.saturating_mul(corners.len() as u64) {
        // Lossless, as `vertices` is bounded by the length of a list.
        let mut places = vec![u32::MAX; vertices as usize];
        corners.iter().for_each(|&corner| places[corner as usize] = 0);
        let used: Vec<u32> = (0..).zip(&places).filter(|(_, place)| **place == 0).map(|(vertex, _)| vertex).collect();
        if used.len() == places.len() {
            return None;
        }
        (0..).zip(&used).for_each(|(place, &vertex)| places[vertex as usize] = place);
        corners.iter_mut().for_each(|corner| *corner = places[*corner as usize]);
        return Some(used);
    }
    let mut used = corners.to_vec();
    used.sort_unstable();
    used.dedup();
    // Always found, as the list was made from the corners.
    let place = |corner: u32| used.partition_point(|&vertex| vertex < corner) as u32;
    corners.iter_mut().for_each(|corner| *corner = place(*corner));
    Some(used)
}

/// Numbers of faces left out of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Dropped {
    /// Faces with a corner whose position is not finite.
    pub(super) not_finite: u64,
    /// Faces with two corners in one position.
    pub(super) degenerate: u64,
}

/// Removes faces that cannot be drawn, and vertices that are then unused.
///
/// `joined`: repeated indices join strips and are no fault.
pub(super) fn clean(mesh: &mut Mesh, joined: bool) -> Dropped {
    let mut dropped = Dropped::default();
    let places = |triangle: &[u32; 3]| triangle.map(|v| mesh.positions.get(v as usize).copied().unwrap_or(Vec3::NAN));
    let is_finite = |[a, b, c]: [Vec3; 3]| a.is_finite() && b.is_finite() && c.is_finite();
    let has_three = |[a, b, c]: [Vec3; 3]| a != b && b != c && c != a;
    // In most meshes all faces can be drawn.
    let are_finite = mesh.positions.iter().fold(true, |all, p| all & p.is_finite());
    let is_there = |triangle: &[u32; 3]| triangle.iter().all(|&v| (v as usize) < mesh.positions.len());
    if !are_finite || !mesh.triangles.iter().all(|triangle| is_there(triangle) && has_three(places(triangle))) {
        let (mut kept, mut faces) = (Vec::new(), Vec::new());
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            let (places, [a, b, c]) = (places(triangle), *triangle);
            if !is_finite(places) {
                dropped.not_finite += 1;
            } else if !has_three(places) {
                let joint = joined && (a == b || b == c || c == a);
                dropped.degenerate += u64::from(!joint);
            } else {
                kept.push(*triangle);
                faces.push(face as u32);
            }
        }
        (mesh.triangles, mesh.face_of_triangle) = (kept, faces);
    }
    compact(mesh);
    dropped
}

/// Removes vertices that no triangle uses.
fn compact(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&vertex| used[vertex as usize] = true);
    if used.iter().all(|&used| used) {
        return;
    }
    let mut next = 0;
    let place: Vec<u32> = used.iter().map(|&used| (next, next += u32::from(used)).0).collect();
    for vertex in mesh.triangles.iter_mut().flatten() {
        *vertex = place[*vertex as usize];
    }
    fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
        let mut used = used.iter();
        values.retain(|_| used.next().copied().unwrap_or(false));
    }
    keep(&mut mesh.positions, &used);
    keep(&mut mesh.normals, &used);
    keep(&mut mesh.tangents, &used);
    keep(&mut mesh.colors, &used);
    mesh.uvs.iter_mut().for_each(|uvs| keep(uvs, &used));
}

/// Faults found in directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct OddDirections {
    /// Some vectors were not of unit length.
    pub(super) length: bool,
    /// Some vectors had no direction.
    pub(super) none: bool,
    /// Some signs were neither 1 nor −1.
    pub(super) sign: bool,
}

/// Tolerance of unit length: 8-bit normalised normals and tangents deviate by less.
const UNIT: f32 = 0.02;

/// Normalises normals; those without a direction become the area-weighted mean of the adjacent face normals.
pub(super) fn repair_normals(mesh: &mut Mesh) -> OddDirections {
    let mut odd = OddDirections::default();
    for normal in &mut mesh.normals {
        let length = normal.length();
        odd.length |= (length - 1.0).abs() > UNIT;
        *normal = normal.try_normalize().unwrap_or_else(|| {
            odd.none = true;
            Vec3::ZERO
        });
    }
    if odd.none {
        let mut sums = vec![Vec3::ZERO; mesh.normals.len()];
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            let area = (b - a).cross(c - a);
            t.iter().for_each(|&v| sums[v as usize] += area);
        }
        let missing = mesh.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == Vec3::ZERO);
        missing.for_each(|(normal, sum)| *normal = sum.normalize_or(Vec3::Z));
    }
    odd
}

/// Normalises tangents and sets their signs to 1 or −1; `none` means that they should be regenerated.
pub(super) fn repair_tangents(tangents: &mut [Vec4]) -> OddDirections {
    let mut odd = OddDirections::default();
    for tangent in tangents {
        let direction = tangent.truncate();
        odd.length |= (direction.length() - 1.0).abs() > UNIT;
        odd.sign |= tangent.w.abs() != 1.0;
        odd.none |= direction.try_normalize().is_none();
        *tangent = direction.normalize_or(Vec3::X).extend(if tangent.w < 0.0 { -1.0 } else { 1.0 });
    }
    odd
}

/// Clamps colours to 0…1; returns whether any was outside.
pub(super) fn clamp_colors(colors: &mut [Vec4]) -> bool {
    let mut outside = false;
    for color in colors {
        let inside = color.to_array().map(|c| if c.is_nan() { 1.0 } else { c.clamp(0.0, 1.0) });
        outside |= inside != color.to_array();
        *color = Vec4::from(inside);
    }
    outside
}

/// Replaces texture coordinates that are not finite by zero; returns whether there were any.
pub(super) fn finite_uvs(uvs: &mut [Vec2]) -> bool {
    let mut odd = false;
    for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        odd = true;
        *uv = Vec2::ZERO;
    }
    odd
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_every_second_face_and_fans_share_their_first_corner() {
        let of = |mode| triangles(mode, vec![10, 11, 12, 13, 14]);
        assert_eq!(of(Mode::Triangles), Some(vec![[10, 11, 12]]));
        assert_eq!(of(Mode::TriangleStrip), Some(vec![[10, 11, 12], [11, 13, 12], [12, 13, 14]]));
        assert_eq!(of(Mode::TriangleFan), Some(vec![[11, 12, 10], [12, 13, 10], [13, 14, 10]]));
        assert_eq!(triangles(Mode::TriangleFan, Vec::new()), Some(vec![]));
        assert_eq!(of(Mode::LineStrip), None);
        for room in 6..10 {
            let mut corners = Vec::with_capacity(room);
            corners.extend([0, 1, 2, 2, 1, 3]);
            assert_eq!(triangles(Mode::Triangles, corners), Some(vec![[0, 1, 2], [2, 1, 3]]), "room for {room}");
        }
    }

    #[test]
    fn strips_go_on_loops_come_back_and_points_have_one_end() {
        let corners = [10, 11, 12];
        assert_eq!(lines(Mode::Points, &corners), [[10, 10], [11, 11], [12, 12]]);
        assert_eq!(lines(Mode::Lines, &corners), [[10, 11]]);
        assert_eq!(lines(Mode::LineStrip, &corners), [[10, 11], [11, 12]]);
        assert_eq!(lines(Mode::LineLoop, &corners), [[10, 11], [11, 12], [12, 10]]);
        assert_eq!(lines(Mode::Triangles, &corners), [[0; 2]; 0]);
        for short in [&[][..], &[10]] {
            assert!([Mode::Lines, Mode::LineStrip, Mode::LineLoop].iter().all(|&mode| lines(mode, short).is_empty()));
        }
    }

    #[test]
    fn vertices_in_use_are_gathered_alike_from_small_and_large_pools() {
        for vertices in [10, u64::from(u32::MAX)] {
            let mut corners = [9, 2, 5, 5, 2, 9];
            assert_eq!(gather(&mut corners, vertices), Some(vec![2, 5, 9]), "{vertices}");
            assert_eq!(corners, [2, 0, 1, 1, 0, 2], "{vertices}");
        }
        let mut corners = [2, 0, 1];
        assert_eq!(gather(&mut corners, 3), None);
        assert_eq!(corners, [2, 0, 1]);
        assert_eq!(gather(&mut [], 3), Some(vec![]));
    }

    #[test]
    fn faces_without_area_or_place_go_and_take_their_vertices_along() {
        let mut mesh = Mesh {
            positions: vec![Vec3::NAN, Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X],
            normals: vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::Z, Vec3::Z],
            triangles: vec![[0, 1, 2], [1, 2, 4], [1, 2, 3], [1, 1, 2]],
            ..Mesh::default()
        };
        assert_eq!(clean(&mut mesh, true), Dropped { not_finite: 1, degenerate: 1 });
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.face_of_triangle, [2]);
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
    }

    #[test]
    fn normals_become_unit_and_missing_ones_come_from_the_faces() {
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::new(0.0, 2.0, 0.0), Vec3::ZERO, Vec3::NAN],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let odd = repair_normals(&mut mesh);
        assert!(odd.length && odd.none);
        assert_eq!(mesh.normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
    }
}
