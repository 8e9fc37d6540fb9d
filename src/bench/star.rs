//! Closed mesh with faces of all shapes: no ray that starts inside may leave it.

use crate::accel::{BitSet, Shapes};
use crate::math::Vec3;
use crate::math::random::Random;

/// Closed star-shaped mesh around the origin, with random radius in 1 to 1.2 and 2 · `columns` · (`rows` − 1) opaque triangles
/// between circles of latitude; needs at least 3 columns and 2 rows.
pub fn star(columns: u32, rows: u32) -> Shapes {
    let mut random = Random::new(2);
    let mut vertices = vec![Vec3::Y, Vec3::NEG_Y];
    for row in 1..rows {
        let polar = std::f32::consts::PI * row as f32 / rows as f32;
        for column in 0..columns {
            let turn = std::f32::consts::TAU * column as f32 / columns as f32;
            let (sin, cos) = (libm::sinf(polar), libm::cosf(polar));
            let d = Vec3::new(sin * libm::cosf(turn), cos, sin * libm::sinf(turn));
            vertices.push(d * (1.0 + 0.2 * random.unit()));
        }
    }
    let at = |row: u32, column: u32| match row {
        0 => 0,
        _ if row == rows => 1,
        _ => 2 + (row - 1) * columns + column % columns,
    };
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            if row > 0 {
                triangles.push([a, b, c]);
            }
            if row + 1 < rows {
                triangles.push([b, d, c]);
            }
        }
    }
    let opaque = BitSet::filled(triangles.len(), true);
    Shapes { vertices, triangles, opaque, ..Shapes::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_edge_of_the_star_has_a_face_on_either_side() {
        let star = star(12, 7);
        assert_eq!(star.triangles.len(), 2 * 12 * 6);
        let edges = star.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let edges: HashSet<_> = edges.collect();
        assert_eq!(edges.len(), 3 * star.triangles.len());
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
    }
}
