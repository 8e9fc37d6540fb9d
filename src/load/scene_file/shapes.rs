//! `[[meshes]]`, `[[spheres]]`, `[[cones]]`, `[[cylinders]]`, `[[planes]]` and the transform keys.

use super::reader::{Table, direction, each, not_negative, number, numbers, positive, string, vec};
use crate::math::ear_clip::EarClipper;
use crate::math::{DAffine3, DMat3, DQuat, DVec3};
use crate::scene::{Cone, Instance, Mesh, Plane, Sphere};
use toml::de::DeValue;

/// Reads one inline mesh; the instance's `mesh` index is left 0 for the caller.
pub(super) fn mesh(table: Table, material: u32) -> Option<(Mesh, Instance)> {
    let name = table.get("name", string).unwrap_or_default();
    let positions = table.need("positions", each(vec));
    let faces = table.need("faces", each(each(index)));
    let world_from_object = transform(&table);
    if let (Some(positions), Some(faces)) = (&positions, &faces) {
        check_faces(&table, positions.len(), faces);
    }
    table.finish();
    let (positions, faces) = (positions?, faces?);

    let mut mesh = Mesh { name: name.clone(), material, ..Mesh::default() };
    for (face, corners) in faces.iter().enumerate() {
        let cut = cut(&positions, corners);
        #[expect(clippy::cast_possible_truncation, reason = "a scene file is far smaller than 2^32 faces")]
        mesh.face_of_triangle.extend(cut.iter().map(|_| face as u32));
        mesh.triangles.extend(cut);
    }
    mesh.positions = positions.iter().map(|p| p.as_vec3()).collect();
    Some((mesh, Instance { name, mesh: 0, world_from_object }))
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
            table.note(&at, format!("face {i} has corner {corner}, but only {positions} positions exist"), "");
        }
    }
}

/// Triangles of a face; none when a corner is out of range (that fault is noted elsewhere).
fn cut(positions: &[DVec3], corners: &[u32]) -> Vec<[u32; 3]> {
    let points: Option<Vec<DVec3>> = corners.iter().map(|&c| positions.get(c as usize).copied()).collect();
    let mut triangles = Vec::new();
    EarClipper::default().cut(&points.unwrap_or_default(), &mut triangles);
    triangles.iter().map(|triangle| triangle.map(|i| corners[i as usize])).collect()
}

/// Reads one sphere.
pub(super) fn sphere(table: Table, material: u32) -> Option<Sphere> {
    let name = table.get("name", string).unwrap_or_default();
    let center = table.need("center", vec);
    let radius = table.need("radius", positive);
    table.finish();
    Some(Sphere { name, center: center?, radius: radius?, material })
}

/// Reads one cone.
pub(super) fn cone(table: Table, material: u32) -> Option<Cone> {
    let name = table.get("name", string).unwrap_or_default();
    let (base, apex) = ends(&table, "base", "apex");
    let base_radius = table.need("base_radius", not_negative);
    let apex_radius = table.get("apex_radius", not_negative).unwrap_or(0.0);
    if base_radius == Some(0.0) && apex_radius == 0.0 {
        let at = table.place_of("base_radius");
        table.note(&at, "both radii are 0, which leaves a line", "make one larger");
    }
    table.finish();
    Some(Cone { name, base: base?, base_radius: base_radius?, apex: apex?, apex_radius, material })
}

/// Reads one cylinder: a cone with equal radii.
pub(super) fn cylinder(table: Table, material: u32) -> Option<Cone> {
    let name = table.get("name", string).unwrap_or_default();
    let (base, top) = ends(&table, "base", "top");
    let radius = table.need("radius", positive);
    table.finish();
    Some(Cone { name, base: base?, base_radius: radius?, apex: top?, apex_radius: radius?, material })
}

/// The two ends of an axis; they must differ.
fn ends(table: &Table, first: &'static str, second: &'static str) -> (Option<DVec3>, Option<DVec3>) {
    let (a, b) = (table.need(first, vec), table.need(second, vec));
    if a.is_some() && a == b {
        let at = table.place_of(second);
        table.note(&at, format!("`{first}` and `{second}` are the same point"), "move one of them");
    }
    (a, b)
}

/// Reads one plane.
pub(super) fn plane(table: Table, material: u32) -> Option<Plane> {
    let name = table.get("name", string).unwrap_or_default();
    let normal = table.need("normal", direction);
    let point = table.get("point", vec).unwrap_or(DVec3::ZERO);
    table.finish();
    normal.map(|normal| Plane { name, normal, offset: normal.dot(point), material })
}

/// `matrix`, or `scale`, then `rotate`, then `translate`.
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

/// A turn about a unit axis, through our own sine so that every system places objects alike.
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
