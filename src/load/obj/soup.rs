//! Statements -> arrays, read by `tobj`.
//!
//! `tobj` parses the numbers, assembles faces and leaves out vertices that no face uses. It is given a text in which
//! nothing can go wrong: one object, absolute indices, a stand-in for every coordinate or normal that a corner does not
//! name (left to itself, `tobj` repeats the one before), no materials, no lines, no comments.

use super::statements::Statements;
use crate::load::limits::Budget;
use crate::load::{Diagnostic, LoadError};
use crate::math::{DVec2, DVec3, Vec3};
use std::path::Path;

/// An index that stands for "none".
pub(super) const NONE: u32 = u32::MAX;

/// A corner of a face: indices into the arrays of [`Soup`]; the last two may be [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

/// The vertices that faces use, and the corners of all faces one after another.
#[derive(Clone, Debug, Default)]
pub(super) struct Soup {
    pub positions: Vec<DVec3>,
    /// v points up, as in the file.
    pub uvs: Vec<DVec2>,
    /// Of any length, but finite.
    pub normals: Vec<Vec3>,
    /// Per position, as written; empty when the file has none.
    pub colors: Vec<[f32; 3]>,
    pub corners: Vec<Corner>,
}

/// Reads the numbers of `statements`.
///
/// # Errors
/// When the memory this takes is over the budget.
pub(super) fn read(statements: &mut Statements, file: &Path, budget: &mut Budget) -> Result<Soup, LoadError> {
    // Whether any corner names a coordinate, or a normal.
    let used = [1, 2].map(|kind| statements.corners.iter().any(|c| c[kind] != 0));
    reserve(statements, budget)
        .map_err(|over| Diagnostic::new("over-memory", file, "", over).remedy("raise --max-memory"))?;
    let text = write(statements, used);
    let mesh = parse(&text, file)?;
    drop(text);

    let uvs: Vec<DVec2> = mesh.texcoords.as_chunks::<2>().0.iter().map(|&uv| uv.into()).collect();
    let normal = |n: &[f64; 3]| DVec3::from(*n).normalize_or_zero().as_vec3();
    let normals: Vec<Vec3> = mesh.normals.as_chunks::<3>().0.iter().map(normal).collect();
    let uv_of = |i: &u32| used[0] && uvs.get(*i as usize).is_some_and(|uv| uv.is_finite());
    let normal_of = |i: &u32| used[1] && normals.get(*i as usize).is_some_and(|&n| n != Vec3::ZERO);
    let corner = |(i, &position): (usize, &u32)| Corner {
        position,
        uv: mesh.texcoord_indices.get(i).copied().filter(uv_of).unwrap_or(NONE),
        normal: mesh.normal_indices.get(i).copied().filter(normal_of).unwrap_or(NONE),
    };
    let corners: Vec<Corner> = mesh.indices.iter().enumerate().map(corner).collect();
    let positions: Vec<DVec3> = mesh.positions.as_chunks::<3>().0.iter().map(|&p| p.into()).collect();
    let colors = colors(statements, &corners, positions.len());
    Ok(Soup { positions, uvs, normals, colors, corners })
}

/// Asks for what `tobj` and the arrays made from its answer take.
fn reserve(statements: &Statements, budget: &mut Budget) -> Result<(), String> {
    /// Bytes of a face in `tobj`: four corners of three indices and a tag.
    const FACE: u64 = 104;
    /// Text, `tobj`'s corner, its three indices, ours, and those of the mesh made in the end.
    const CORNER: u64 = 24 + 24 + 12 + 12 + 12;
    /// Text, `tobj`'s two copies and hash, ours, and the mesh's.
    const VERTEX: u64 = 40 + 48 + 16 + 24 + 24;
    let vertices = statements.counts.iter().map(|&c| u64::from(c)).sum();
    let parts = [(statements.faces.len() as u64, FACE), (statements.corners.len() as u64, CORNER), (vertices, VERTEX)];
    parts.into_iter().try_for_each(|(count, size)| budget.take(count, size)).map_err(|over| over.to_string())
}

/// The text that `tobj` reads; takes the numbers and keeps the rest.
fn write(statements: &mut Statements, used: [bool; 2]) -> Vec<u8> {
    let mut text = std::mem::take(&mut statements.numbers);
    // The stand-ins come last, under the next free number.
    let stand_in = statements.counts.map(|count| count + 1);
    text.extend_from_slice(b"vt nan nan\nvn nan nan nan\n");
    let mut corners = statements.corners.iter();
    for face in &statements.faces {
        text.push(b'f');
        for corner in corners.by_ref().take(face.arity as usize) {
            text.push(b' ');
            push_number(&mut text, corner[0]);
            for kind in [1, 2] {
                if used[kind - 1] {
                    text.push(b'/');
                    push_number(&mut text, if corner[kind] == 0 { stand_in[kind] } else { corner[kind] });
                } else if kind == 1 && used[1] {
                    text.push(b'/');
                }
            }
        }
        text.push(b'\n');
    }
    text
}

fn push_number(text: &mut Vec<u8>, mut number: u32) {
    let mut digits = [b'0'; 10];
    let mut at = digits.len();
    loop {
        at -= 1;
        digits[at] += (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[at..]);
}

fn parse(text: &[u8], file: &Path) -> Result<tobj::Mesh, LoadError> {
    let options = tobj::LoadOptions { triangulate: false, single_index: false, ..Default::default() };
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let fault = |e: tobj::LoadError| Diagnostic::new("obj-unreadable", file, "", format!("cannot be read: {e}"));
    let (models, _) = tobj::load_obj_buf(&mut &text[..], &options, no_materials).map_err(fault)?;
    Ok(models.into_iter().next().map(|model| model.mesh).unwrap_or_default())
}

/// Colours in the order of the positions that `tobj` kept.
fn colors(statements: &Statements, corners: &[Corner], positions: usize) -> Vec<[f32; 3]> {
    if statements.colors.is_empty() {
        return Vec::new();
    }
    let mut out = vec![[1.0; 3]; positions];
    for (corner, written) in corners.iter().zip(&statements.corners) {
        if let Some(&color) = statements.colors.get(written[0] as usize - 1) {
            out[corner.position as usize] = color;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Limits;

    fn of(text: &str) -> Soup {
        let file = Path::new("m.obj");
        let mut statements = super::super::statements::read(text.as_bytes(), file).unwrap();
        read(&mut statements, file, &mut Budget::new(&Limits::default())).unwrap()
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
    fn colors_follow_their_vertices_when_others_are_left_out() {
        let soup = of("v 9 9 9 1 1 0\nv 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 1 0\nf 4 2 3");
        assert_eq!(soup.positions, [DVec3::Y, DVec3::ZERO, DVec3::X]);
        assert_eq!(soup.colors, [[0.0, 1.0, 0.0], [1.0; 3], [1.0, 0.0, 0.0]]);
    }

    #[test]
    fn a_file_without_faces_is_empty() {
        assert!(of("").corners.is_empty());
        assert!(of(TRIANGLE).corners.is_empty());
    }

    #[test]
    fn memory_over_the_budget_is_refused_before_it_is_taken() {
        let file = Path::new("m.obj");
        let mut statements = super::super::statements::read(format!("{TRIANGLE}f 1 2 3").as_bytes(), file).unwrap();
        let mut budget = Budget::new(&Limits { memory: 500, ..Limits::default() });
        assert!(read(&mut statements, file, &mut budget).unwrap_err().to_string().contains("--max-memory"));
    }
}
