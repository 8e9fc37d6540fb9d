//! Data named by corners.

use crate::load::Limits;
use crate::load::geometry::{NONE, Soup, color};
use crate::load::limits::Budget;
use crate::load::obj::statements;
use crate::math::{DVec2, DVec3, Vec3};
use std::path::Path;

fn of(text: &str) -> Soup {
    statements::read(text.as_bytes(), Path::new("m.obj"), &mut Budget::new(&Limits::default())).unwrap().geometry.soup
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn corners_without_a_coordinate_or_normal_get_none() {
    let soup = of(&format!("{TRIANGLE}vt 0.25 0.5\nvn 0 0 2\nf 1 2/1 3//1\nf 1/1/1 2 3"));
    let uvs: Vec<_> = soup.corners.iter().map(|c| c.uv != NONE).collect();
    let normals: Vec<_> = soup.corners.iter().map(|c| c.normal != NONE).collect();
    assert_eq!(uvs, [false, true, false, true, false, false]);
    assert_eq!(normals, [false, false, true, true, false, false]);
    assert_eq!(soup.uvs[soup.corners[1].uv as usize], DVec2::new(0.25, 0.5));
    assert_eq!(soup.normals[soup.corners[2].normal as usize], Vec3::Z);
}

#[test]
fn coordinates_that_no_face_uses_are_no_coordinates() {
    let soup = of(&format!("{TRIANGLE}vt 0 0\nvn 0 0 1\nf 1 2 3"));
    assert!(soup.corners.iter().all(|c| c.uv == NONE && c.normal == NONE));
}

#[test]
fn normals_of_no_length_or_with_gaps_are_no_normals() {
    let soup = of(&format!("{TRIANGLE}vn 0 0 0\nvn 1 0\nvn nan 0 1\nf 1//1 2//2 3//3"));
    assert!(soup.corners.iter().all(|c| c.normal == NONE));
}

#[test]
fn coordinates_that_are_not_finite_are_no_coordinates() {
    let soup = of(&format!("{TRIANGLE}vt 0 inf\nvt 1 1\nf 1/1 2/2 3/1"));
    assert_eq!(soup.corners.iter().map(|c| c.uv).collect::<Vec<_>>(), [NONE, 1, NONE]);
}

#[test]
fn vertices_that_no_face_uses_have_no_place() {
    let mut soup = of("v 9 9 9 1 1 0\nv 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 1 0\nf 4 2 3");
    color::settle(&mut soup.colors);
    assert!(soup.positions[0].is_nan());
    assert_eq!(soup.positions[1..], [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(soup.colors, [[1.0, 1.0, 0.0], [1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
}

#[test]
fn a_file_without_faces_is_empty() {
    assert!(of("").corners.is_empty());
    assert!(of(TRIANGLE).corners.is_empty());
}

/// Corners as (position, coordinate, normal), read by the crate `tobj`.
fn read_by_tobj(text: &str) -> Vec<([f64; 3], [f64; 2], [f64; 3])> {
    let options = tobj::LoadOptions { triangulate: false, single_index: false, ..Default::default() };
    let none = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let mesh = tobj::load_obj_buf(&mut text.as_bytes(), &options, none).unwrap().0.remove(0).mesh;
    let of = |list: &[f64], at: u32, i: usize| list[at as usize * 3 + i];
    let corner = |i: usize| {
        let (v, vt, vn) = (mesh.indices[i], mesh.texcoord_indices[i] as usize, mesh.normal_indices[i]);
        let uv = [mesh.texcoords[2 * vt], mesh.texcoords[2 * vt + 1]];
        ([0, 1, 2].map(|k| of(&mesh.positions, v, k)), uv, [0, 1, 2].map(|k| of(&mesh.normals, vn, k)))
    };
    (0..mesh.indices.len()).map(corner).collect()
}

#[test]
fn another_reader_reads_the_same_corners() {
    let mut text = String::new();
    let mut x = 0.3_f64;
    let mut next = || {
        x = (x * 1.618_033_988 + 0.271_828_182).fract();
        x
    };
    for i in 0..400 {
        let digits = i % 17;
        text += &format!("v {:.digits$} {:e} {}\n", next() - 0.5, next() * 1e-3, next() * 1e5);
        text += &format!("vt {:.digits$} {}\nvn {:.4} {:.5} {:.6}\n", next(), next(), next(), next(), 0.1 + next());
    }
    for i in 1..=396 {
        text += &format!("f {i}/{}/{i} {}/{i}/{} -{i}/-{i}/-1", 401 - i, i + 4, i + 1);
        text += if i % 3 == 0 { " 1/1/1\n" } else { "\n" };
    }
    let (ours, theirs) = (of(&text), read_by_tobj(&text));
    assert_eq!(ours.corners.len(), theirs.len());
    for (corner, (place, uv, normal)) in ours.corners.iter().zip(theirs) {
        assert_eq!(ours.positions[corner.position as usize].to_array(), place);
        assert_eq!(ours.uvs[corner.uv as usize].to_array(), uv);
        assert_eq!(ours.normals[corner.normal as usize], DVec3::from(normal).normalize_or_zero().as_vec3());
    }
}
