//! Smooth normals for meshes without normals, on request: scans and printed solids consist of flat faces, but are meant to
//! look round.
//!
//! The normal of a corner is the sum of the normals of the faces around its vertex that lean against its own face by at
//! most a given angle, each weighted by the face's angle there (G. Thürmer and C. A. Wüthrich, "Computing Vertex Normals from
//! Polygonal Facets", 1998). Vertices at the same position count as one, across all meshes that stand together, so
//! that neither a format that repeats them nor a change of material makes a seam.

use super::limits::{Budget, OverBudget};
use crate::math::ear_clip::newell;
use crate::math::{DVec3, Vec3};
use crate::scene::{Mesh, Reflection, Scene};
use std::collections::HashMap;
use std::mem::size_of;

/// Number of faces at one position beyond which they stay flat there: every face is compared with every other.
const MOST_AROUND: usize = 512;

/// Gives all meshes without normals smooth ones, except at edges where faces lean by more than `most`, in radians. Unlit
/// meshes need none.
///
/// # Errors
/// When memory would exceed `budget`.
pub(super) fn smooth(scene: &mut Scene, most: f64, budget: &mut Budget) -> Result<(), OverBudget> {
    let materials = &scene.materials;
    let is_unlit =
        |mesh: &Mesh| materials.get(mesh.material as usize).is_some_and(|m| matches!(m.reflection, Reflection::Unlit));
    let flat = |mesh: &Mesh| mesh.normals.is_empty() && mesh.corners() > 0 && !is_unlit(mesh);
    let corners: usize = scene.meshes.iter().filter(|&mesh| flat(mesh)).map(Mesh::corners).sum();
    // Per corner: the corner, its entry in a table and the vertex it may become.
    let vertex = 2 * size_of::<Vec3>() + 4 * size_of::<Vec3>() + size_of::<Corner>() + size_of::<([u32; 3], u32)>();
    budget.take(corners as u64, vertex as u64)?;
    let groups = standing_together(scene, flat);
    for group in groups {
        let normals = normals(&group, &scene.meshes, libm::cos(most));
        let mut rest = normals.as_slice();
        for mesh in group {
            let mesh = &mut scene.meshes[mesh];
            let (own, others) = rest.split_at(mesh.corners());
            rest = others;
            give(mesh, own);
        }
    }
    Ok(())
}

/// Groups the indices of the `wanted` meshes by equal placements of their instances.
fn standing_together(scene: &Scene, wanted: impl Fn(&Mesh) -> bool) -> Vec<Vec<usize>> {
    let mut places: Vec<Vec<[u64; 12]>> = vec![Vec::new(); scene.meshes.len()];
    for instance in &scene.instances {
        if let Some(places) = places.get_mut(instance.mesh as usize) {
            places.push(instance.world_from_object.to_cols_array().map(f64::to_bits));
        }
    }
    let mut numbers: HashMap<Vec<[u64; 12]>, usize> = HashMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (mesh, mut places) in places.into_iter().enumerate().filter(|&(mesh, _)| wanted(&scene.meshes[mesh])) {
        places.sort_unstable();
        let number = *numbers.entry(places).or_insert(groups.len());
        if number == groups.len() {
            groups.push(Vec::new());
        }
        groups[number].push(mesh);
    }
    groups
}

/// Angle at corner i of a polygon, radians; 0 where it is undefined.
pub(super) fn angle(ring: &[DVec3], i: usize) -> f64 {
    let n = ring.len();
    let (a, b) = (ring[(i + n - 1) % n] - ring[i], ring[(i + 1) % n] - ring[i]);
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// A corner of a face, as the other faces at its position see it.
struct Corner {
    /// Unit normal of the face; zero for a face without area.
    normal: DVec3,
    /// Angle of the face at the corner, radians.
    angle: f64,
    /// Index of the corner's position.
    place: u32,
}

/// Normals of all corners of these meshes in turn; zero where there is none.
fn normals(group: &[usize], meshes: &[Mesh], least_cosine: f64) -> Vec<Vec3> {
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let (mut corners, mut ring) = (Vec::new(), Vec::new());
    for mesh in group.iter().map(|&i| &meshes[i]) {
        mesh.each_face(|face| {
            ring.clear();
            ring.extend(face.iter().map(|&vertex| mesh.positions[vertex as usize].as_dvec3()));
            let normal = newell(&ring).normalize_or_zero();
            for (i, &vertex) in face.iter().enumerate() {
                // +0 and −0 are one position.
                let key = mesh.positions[vertex as usize].to_array().map(|c| (c + 0.0).to_bits());
                #[expect(clippy::cast_possible_truncation, reason = "loading refuses 2^32 corners")]
                let new = numbers.len() as u32;
                corners.push(Corner { normal, angle: angle(&ring, i), place: *numbers.entry(key).or_insert(new) });
            }
        });
    }

    // Bucket the corners by position.
    let mut ends = vec![0_u32; numbers.len() + 1];
    corners.iter().for_each(|corner| ends[corner.place as usize + 1] += 1);
    (1..ends.len()).for_each(|i| ends[i] += ends[i - 1]);
    let mut next = ends.clone();
    let mut at_place = vec![0_u32; corners.len()];
    for (i, corner) in (0..).zip(&corners) {
        let slot = &mut next[corner.place as usize];
        at_place[*slot as usize] = i;
        *slot += 1;
    }

    let smooth = |corner: &Corner| {
        let [from, to] = [0, 1].map(|k| ends[corner.place as usize + k] as usize);
        if to - from > MOST_AROUND {
            return corner.normal.as_vec3();
        }
        let around = at_place[from..to].iter().map(|&i| &corners[i as usize]);
        // With some slack, so that coplanar faces are always joined.
        let meets = around.filter(|other| other.normal.dot(corner.normal) >= least_cosine - 1e-9);
        meets.map(|other| other.normal * other.angle).sum::<DVec3>().normalize_or(corner.normal).as_vec3()
    };
    corners.iter().map(smooth).collect()
}

/// Sets the normals of a mesh from those of its corners: a vertex is copied for each different normal.
fn give(mesh: &mut Mesh, normals: &[Vec3]) {
    let mut numbers: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    let (mut from, mut given) = (Vec::new(), Vec::new());
    let mut wanted = normals.iter();
    let corners = mesh.triangles.iter_mut().flatten().chain(&mut mesh.polygon_corners);
    for (vertex, &normal) in corners.zip(&mut wanted) {
        #[expect(clippy::cast_possible_truncation, reason = "loading refuses 2^32 corners")]
        let new = from.len() as u32;
        let number = *numbers.entry((*vertex, normal.to_array().map(f32::to_bits))).or_insert(new);
        if number == new {
            from.push(*vertex as usize);
            given.push(normal);
        }
        *vertex = number;
    }
    fn pick<T: Copy>(values: &mut Vec<T>, from: &[usize]) {
        if !values.is_empty() {
            *values = from.iter().map(|&i| values[i]).collect();
        }
    }
    pick(&mut mesh.positions, &from);
    pick(&mut mesh.tangents, &from);
    pick(&mut mesh.colors, &from);
    mesh.uvs.iter_mut().for_each(|set| pick(set, &from));
    mesh.normals = given;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::{LoadOptions, Loaded, load_bytes};
    use crate::scene::TexCoords;
    use std::path::Path;

    fn load(text: &str, degrees: f64) -> Loaded {
        let options = LoadOptions { smooth: Some(degrees.to_radians()), ..LoadOptions::default() };
        load_bytes(Path::new("a.obj"), text.as_bytes().to_vec(), &options).unwrap()
    }

    /// Two squares that share an edge along x and lean by 60° against each other; the second in a mesh of its own.
    const ROOF: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 -.5 -.8660254\nv 0 -.5 -.8660254\n\
        f 1 2 3 4\no other\nf 6 5 2 1\n";

    #[test]
    fn faces_that_lean_less_than_the_angle_share_their_normals_across_meshes() {
        let loaded = load(ROOF, 61.0);
        let mean = Vec3::new(0.0, -0.5, 0.866_025_4);
        for mesh in &loaded.scene.meshes {
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            for (at, normal) in mesh.positions.iter().zip(&mesh.normals) {
                let world = at.as_dvec3() + loaded.scene.instances[0].world_from_object.translation;
                if world.y.abs() < 1e-6 {
                    assert!((*normal - mean).length() < 1e-6, "{normal} at {world}");
                }
            }
        }
        let flat = load(ROOF, 59.0);
        assert!(flat.scene.meshes[0].normals.iter().all(|n| (*n - Vec3::Z).length() < 1e-6));
    }

    #[test]
    fn what_has_a_normal_map_is_smooth_too_and_has_tangents_along_its_smooth_normals() {
        let folder = tempfile::tempdir().unwrap();
        let roof = ROOF.replace("f 1 2 3 4", "f 1/1 2/2 3/3 4/4").replace("f 6 5 2 1", "f 6/1 5/2 2/3 1/4");
        let text = format!("mtllib m.mtl\nusemtl a\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n{roof}");
        std::fs::write(folder.path().join("m.mtl"), "newmtl a\nKd 1 1 1\nnorm n.png\n").unwrap();
        ::image::RgbImage::from_pixel(2, 2, ::image::Rgb([128, 128, 255])).save(folder.path().join("n.png")).unwrap();
        let file = folder.path().join("a.obj");
        let load = |smooth: Option<f64>| {
            load_bytes(&file, text.as_bytes().to_vec(), &LoadOptions { smooth, ..LoadOptions::default() }).unwrap()
        };
        let plain = self::load(ROOF, 61.0);
        for (smooth, plain) in load(Some(61_f64.to_radians())).scene.meshes.iter().zip(&plain.scene.meshes) {
            assert!(
                smooth.tangents.len() == smooth.positions.len() && smooth.tangents_along == Some(TexCoords::default())
            );
            let along = |t: &crate::math::Vec4, n: &Vec3| t.truncate().dot(*n).abs() < 1e-5;
            assert!(smooth.tangents.iter().zip(&smooth.normals).all(|(t, n)| along(t, n)));
            let has = |normal: &Vec3| plain.normals.iter().any(|n| (*n - *normal).length() < 1e-6);
            assert!(smooth.normals.iter().all(has), "{:?} {:?}", smooth.normals, plain.normals);
        }
        assert!(load(None).scene.meshes.iter().all(|mesh| !mesh.tangents.is_empty()));
    }

    #[test]
    fn a_cube_keeps_its_edges_and_a_vertex_for_each_side() {
        let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
            f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
        let mesh = &load(cube, 30.0).scene.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 12));
        let round = &load(cube, 95.0).scene.meshes[0];
        assert_eq!(round.positions.len(), 8);
        let corner = 1.0 / 3.0_f32.sqrt();
        assert!(round.normals.iter().all(|n| (n.abs() - Vec3::splat(corner)).length() < 1e-6), "{:?}", round.normals);
    }

    #[test]
    fn normals_of_the_file_stay_and_flat_faces_stay_flat_without_being_asked() {
        let with = format!("vn 1 0 0\n{}", ROOF.replace("f 1 2 3 4", "f 1//1 2//1 3//1 4//1"));
        let loaded = load(&with, 61.0);
        assert!(loaded.scene.meshes.iter().any(|m| m.normals.iter().all(|n| *n == Vec3::X)));
        let plain = load_bytes(Path::new("a.obj"), ROOF.as_bytes().to_vec(), &LoadOptions::default()).unwrap();
        assert!(plain.scene.meshes.iter().all(|m| m.normals.is_empty()));
    }

    #[test]
    fn a_vertex_of_too_many_faces_stays_flat_there_and_takes_no_time() {
        use std::fmt::Write;
        let n = 20_000;
        let mut text = String::from("v 0 0 1\n");
        for i in 0..n {
            let (sin, cos) = libm::sincos(f64::from(i) / f64::from(n) * std::f64::consts::TAU);
            writeln!(text, "v {sin} {cos} 0").unwrap();
        }
        (0..n).for_each(|i| writeln!(text, "f 1 {} {}", (i + 1) % n + 2, i + 2).unwrap());
        let mesh = &load(&text, 180.0).scene.meshes[0];
        assert_eq!(mesh.triangles.len(), n as usize);
        assert!(mesh.normals.iter().all(|n| n.is_normalized()));
    }

    #[test]
    fn it_asks_for_memory_first() {
        let mut scene =
            load_bytes(Path::new("a.obj"), ROOF.as_bytes().to_vec(), &LoadOptions::default()).unwrap().scene;
        let limits = crate::load::Limits { memory: 500, ..Default::default() };
        let over = smooth(&mut scene, 1.0, &mut Budget::new(&limits));
        assert!(over.unwrap_err().to_string().contains("of 500 are left"));
        assert!(scene.meshes.iter().all(|mesh| mesh.normals.is_empty()), "nothing has been touched");
    }
}
