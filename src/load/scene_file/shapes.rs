//! `[[meshes]]`, `[[spheres]]`, `[[cones]]`, `[[cylinders]]`, `[[planes]]` and the transform keys.

use super::reader::{Faults, Table, direction, each, not_negative, number, numbers, positive, string, vec};
use crate::load::place::{LeftOut, bounds, is_usable, leave_out_collapsed, place_around};
use crate::load::{Facts, Warnings};
use crate::math::ear_clip::EarClipper;
use crate::math::frame::snapped_center;
use crate::math::{DAffine3, DMat3, DQuat, DVec3};
use crate::scene::{Cone, Instance, Mesh, Plane, Scene, Sphere};
use std::collections::HashMap;
use std::path::Path;
use toml::de::DeValue;

/// Counts of shapes that could not be drawn, each with the byte offset of the first.
#[derive(Default)]
pub(super) struct UndrawnShapes {
    /// Shapes and faces with a coordinate or size that counts as infinite.
    far: (u64, usize),
    /// Triangles that collapsed by rounding.
    collapsed: (u64, usize),
}

impl UndrawnShapes {
    /// Reports the counts in the facts and as warnings.
    pub(super) fn tell(self, faults: &Faults, file: &Path, facts: &mut Facts, warnings: &mut Warnings) {
        for (why, (count, at)) in [(&LeftOut::TOO_FAR, self.far), (&LeftOut::COLLAPSED, self.collapsed)] {
            why.tell(count, file, faults.place(at), &mut facts.dropped, warnings);
        }
    }

    /// Whether positions and sizes of a shape are usable; counts the shape if not.
    fn is_drawn(&mut self, places: &[DVec3], at: usize) -> bool {
        let drawn = places.iter().copied().all(is_usable);
        if !drawn {
            count(&mut self.far, at);
        }
        drawn
    }
}

fn count((number, first): &mut (u64, usize), at: usize) {
    if *number == 0 {
        *first = at;
    }
    *number += 1;
}

/// An inline mesh before its coordinates are rounded.
pub(super) struct Inline {
    mesh: Mesh,
    positions: Vec<DVec3>,
    world_from_object: DAffine3,
    /// Byte offset of its table.
    at: usize,
}

/// Reads one inline mesh.
pub(super) fn mesh(table: Table, material: u32, lost: &mut UndrawnShapes) -> Option<Inline> {
    let at = table.span.start;
    let name = table.get("name", string).unwrap_or_default();
    let positions = table.need("positions", each(vec));
    let faces = table.need("faces", each(each(index)));
    let world_from_object = transform(&table);
    if let (Some(positions), Some(faces)) = (&positions, &faces) {
        check_faces(&table, positions.len(), faces);
    }
    table.finish();
    let (positions, faces) = (positions?, faces?);

    let mut mesh = Mesh { name, material, ..Mesh::default() };
    let mut clipper = EarClipper::default();
    for (face, corners) in faces.iter().enumerate() {
        // `None` when a corner is out of range, a fault that is noted elsewhere.
        let points: Option<Vec<DVec3>> = corners.iter().map(|&c| positions.get(c as usize).copied()).collect();
        let points = points.unwrap_or_default();
        if !lost.is_drawn(&points, at) {
            continue;
        }
        let mut cut = Vec::new();
        clipper.cut(&points, &mut cut);
        #[expect(clippy::cast_possible_truncation, reason = "a scene file is far smaller than 2^32 faces")]
        mesh.face_of_triangle.extend(cut.iter().map(|_| face as u32));
        mesh.triangles.extend(cut.iter().map(|triangle| triangle.map(|i| corners[i as usize])));
    }
    let positions = used(&mut mesh, positions);
    Some(Inline { mesh, positions, world_from_object, at })
}

/// Positions that triangles use, in the order of the file; renumbers the corners of the triangles.
fn used(mesh: &mut Mesh, positions: Vec<DVec3>) -> Vec<DVec3> {
    let mut is_used = vec![false; positions.len()];
    mesh.triangles.iter().flatten().for_each(|&corner| is_used[corner as usize] = true);
    if is_used.iter().all(|&used| used) {
        return positions;
    }
    let mut next = 0;
    let numbers: Vec<u32> = is_used.iter().map(|&used| (next, next += u32::from(used)).0).collect();
    mesh.triangles.iter_mut().flatten().for_each(|corner| *corner = numbers[*corner as usize]);
    positions.into_iter().zip(is_used).filter(|(_, used)| *used).map(|(position, _)| position).collect()
}

/// Rounds the coordinates of inline meshes and adds them to the scene; returns the largest displacement, world units.
///
/// Meshes with the same placement share a centre, so that touching ones are recognized as standing together.
pub(super) fn place(inline: Vec<Inline>, scene: &mut Scene, lost: &mut UndrawnShapes) -> f64 {
    let key = |place: &DAffine3| place.to_cols_array().map(f64::to_bits);
    let mut boxes: HashMap<[u64; 12], (DVec3, DVec3)> = HashMap::new();
    for part in &inline {
        let (lo, hi) = bounds(&part.positions);
        let all = boxes.entry(key(&part.world_from_object)).or_insert((lo, hi));
        *all = (all.0.min(lo), all.1.max(hi));
    }
    let mut max_rounding = 0.0f64;
    for Inline { mut mesh, positions, world_from_object, at } in inline {
        let center = boxes.get(&key(&world_from_object)).map_or(DVec3::ZERO, |&(lo, hi)| snapped_center(lo, hi));
        let placed = place_around(&positions, center);
        max_rounding = max_rounding.max(placed.max_rounding * stretch(&world_from_object));
        mesh.positions = placed.positions;
        let collapsed = leave_out_collapsed(&mut mesh);
        if collapsed > 0 {
            count(&mut lost.collapsed, at);
            lost.collapsed.0 += collapsed - 1;
        }
        let world_from_object = world_from_object * DAffine3::from_translation(center);
        #[expect(clippy::cast_possible_truncation, reason = "a scene file is far smaller than 2^32 lines")]
        let number = scene.meshes.len() as u32;
        scene.instances.push(Instance { name: mesh.name.clone(), mesh: number, world_from_object });
        scene.meshes.push(mesh);
    }
    max_rounding
}

/// Largest factor by which a transform stretches a line: the largest singular value of its matrix A, the root of the largest
/// eigenvalue of AᵀA (O. K. Smith, "Eigenvalues of a symmetric 3 × 3 matrix", 1961).
pub(super) fn stretch(transform: &DAffine3) -> f64 {
    let squared = transform.matrix3.transpose() * transform.matrix3;
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = squared;
    let mean = (x.x + y.y + z.z) / 3.0;
    let off = squared - DMat3::from_diagonal(DVec3::splat(mean));
    let [x, y, z] = [off.x_axis, off.y_axis, off.z_axis];
    let spread = ((x.length_squared() + y.length_squared() + z.length_squared()) / 6.0).sqrt();
    if spread == 0.0 {
        return mean.sqrt();
    }
    let half_determinant = (off * (1.0 / spread)).determinant() / 2.0;
    (mean + 2.0 * spread * libm::cos(libm::acos(half_determinant.clamp(-1.0, 1.0)) / 3.0)).sqrt()
}

fn index(value: &DeValue) -> Result<u32, String> {
    let n = number(value)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
    if n.fract() == 0.0 && (0.0..4e9).contains(&n) { Ok(n as u32) } else { Err(format!("is {n}, which is no index")) }
}

fn check_faces(table: &Table, positions: usize, faces: &[Vec<u32>]) {
    let at = table.place_of("faces");
    for (i, face) in faces.iter().enumerate() {
        if face.len() < 3 {
            table.note(&at, format!("face {i} has {} corners", face.len()), "give it 3 or more");
        }
        if let Some(corner) = face.iter().find(|c| **c as usize >= positions) {
            table.note(
                &at,
                format!("face {i} has corner {corner}, but only {positions} positions exist"),
                "count from 0",
            );
        }
    }
}

/// Reads one sphere.
pub(super) fn sphere(table: Table, material: u32, lost: &mut UndrawnShapes) -> Option<Sphere> {
    let at = table.span.start;
    let name = table.get("name", string).unwrap_or_default();
    let center = table.need("center", vec);
    let radius = table.need("radius", positive);
    table.finish();
    let (center, radius) = (center?, radius?);
    lost.is_drawn(&[center, DVec3::splat(radius)], at).then_some(Sphere { name, center, radius, material })
}

/// Reads one cone.
pub(super) fn cone(table: Table, material: u32, lost: &mut UndrawnShapes) -> Option<Cone> {
    let at = table.span.start;
    let name = table.get("name", string).unwrap_or_default();
    let (base, apex) = ends(&table, "base", "apex");
    let base_radius = table.need("base_radius", not_negative);
    let apex_radius = table.get("apex_radius", not_negative).unwrap_or(0.0);
    if base_radius == Some(0.0) && apex_radius == 0.0 {
        let at = table.place_of("base_radius");
        table.note(&at, "both radii are 0, which leaves a line", "make one larger");
    }
    table.finish();
    drawn(Cone { name, base: base?, base_radius: base_radius?, apex: apex?, apex_radius, material }, at, lost)
}

/// Reads one cylinder: a cone with equal radii.
pub(super) fn cylinder(table: Table, material: u32, lost: &mut UndrawnShapes) -> Option<Cone> {
    let at = table.span.start;
    let name = table.get("name", string).unwrap_or_default();
    let (base, top) = ends(&table, "base", "top");
    let radius = table.need("radius", positive);
    table.finish();
    drawn(Cone { name, base: base?, base_radius: radius?, apex: top?, apex_radius: radius?, material }, at, lost)
}

fn drawn(cone: Cone, at: usize, lost: &mut UndrawnShapes) -> Option<Cone> {
    let radii = DVec3::new(cone.base_radius, cone.apex_radius, 0.0);
    lost.is_drawn(&[cone.base, cone.apex, radii], at).then_some(cone)
}

/// Reads the two ends of an axis, which must differ.
fn ends(table: &Table, first: &'static str, second: &'static str) -> (Option<DVec3>, Option<DVec3>) {
    let (a, b) = (table.need(first, vec), table.need(second, vec));
    if a.is_some() && a == b {
        let at = table.place_of(second);
        table.note(&at, format!("`{first}` and `{second}` are the same point"), "move one of them");
    }
    (a, b)
}

/// Reads one plane.
pub(super) fn plane(table: Table, material: u32, lost: &mut UndrawnShapes) -> Option<Plane> {
    let at = table.span.start;
    let name = table.get("name", string).unwrap_or_default();
    let normal = table.need("normal", direction);
    let point = table.get("point", vec).unwrap_or(DVec3::ZERO);
    table.finish();
    let normal = normal?;
    lost.is_drawn(&[point], at).then(|| Plane { name, normal, offset: normal.dot(point), material })
}

/// Reads `matrix`, or `scale`, then `rotate`, then `translate`.
pub(super) fn transform(table: &Table) -> DAffine3 {
    let steps = ["scale", "rotate", "translate"].map(|key| table.has(key));
    if let Some(matrix) = table.get("matrix", matrix) {
        if steps.contains(&true) {
            let at = table.place_of("matrix");
            table.note(&at, "`matrix` stands for `scale`, `rotate` and `translate`, not beside them", "remove one");
        }
        return matrix;
    }
    let scale = table.get("scale", scale).unwrap_or(DVec3::ONE);
    let rotate = table.get("rotate", rotation).unwrap_or(DQuat::IDENTITY);
    let translate = table.get("translate", vec).unwrap_or(DVec3::ZERO);
    DAffine3::from_scale_rotation_translation(scale, rotate, translate)
}

fn scale(value: &DeValue) -> Result<DVec3, String> {
    let scale = if value.is_array() { vec(value)? } else { DVec3::splat(number(value)?) };
    if scale.cmpeq(DVec3::ZERO).any() { Err("must not be 0".into()) } else { Ok(scale) }
}

fn rotation(value: &DeValue) -> Result<DQuat, String> {
    let Some(table) = value.as_table() else {
        let [x, y, z] = numbers::<3>(value)?.map(f64::to_radians);
        // About x first: the rightmost factor acts first.
        return Ok(turn(DVec3::Z, z) * turn(DVec3::Y, y) * turn(DVec3::X, x));
    };
    let part = |key: &str| table.iter().find(|(k, _)| k.get_ref() == key).map(|(_, v)| v.get_ref());
    match (part("axis"), part("angle"), table.len()) {
        (Some(axis), Some(angle), 2) => Ok(turn(direction(axis)?, number(angle)?.to_radians())),
        _ => Err("must be [x, y, z] in degrees or { axis = [x, y, z], angle = degrees }".into()),
    }
}

/// Rotation about a unit axis, with `libm`'s sine so that every system places objects alike.
fn turn(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = libm::sincos(angle * 0.5);
    DQuat::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
}

fn matrix(value: &DeValue) -> Result<DAffine3, String> {
    let rows: Vec<[f64; 4]> = each(numbers::<4>)(value)?;
    let [x, y, z, w] = rows[..] else { return Err(format!("must have 4 rows, not {}", rows.len())) };
    if w != [0.0, 0.0, 0.0, 1.0] {
        return Err("must have the last row [0, 0, 0, 1]".into());
    }
    let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
    let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
    if matrix3.determinant() == 0.0 {
        return Err("must be invertible".into());
    }
    Ok(DAffine3 { matrix3, translation: column(3) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn a_sheared_place_stretches_by_more_than_its_axes_are_long() {
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
        let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
        assert!((stretch(&DAffine3::from_mat3(sheared)) - golden).abs() < 1e-14);
        for (diagonal, most) in [([1.0; 3], 1.0), ([0.0; 3], 0.0), ([-3.0, 2.0, 1.0], 3.0), ([0.0, 0.0, 5.0], 5.0)] {
            let turn = DMat3::from_quat(DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(1.1));
            let turned = turn * DMat3::from_diagonal(DVec3::from_array(diagonal)) * turn.transpose();
            assert!((stretch(&DAffine3::from_mat3(turned)) - most).abs() < 1e-7, "{diagonal:?}");
        }
    }

    #[test]
    fn no_line_is_stretched_by_more_and_some_line_by_as_much() {
        let mut random = Random::new(7);
        for _ in 0..20 {
            let matrix = DMat3::from_cols_array(&std::array::from_fn(|_| f64::from(2.0 * random.unit() - 1.0)));
            let most = stretch(&DAffine3::from_mat3(matrix));
            let lengths = (0..20_000).map(|_| (matrix * random.direction().as_dvec3().normalize()).length());
            let found = lengths.fold(0.0, f64::max);
            assert!(found <= most * (1.0 + 1e-12) && found > 0.995 * most, "{found} of {most}");
        }
    }
}
