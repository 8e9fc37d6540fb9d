//! Normals of smoothing groups, for faces without normals.
//!
//! The normal of a corner is the sum of the normals of the faces that meet there in the same group, each weighted by
//! its angle (G. Thürmer and C. A. Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998), so that it does
//! not depend on how faces are cut.
//!
//! A face in no group is flat, and so is every face of a file that has neither normals nor groups, such as most scans:
//! the OBJ specification says so and most viewers do so.

use super::Face;
use super::pairs::Pairs;
use super::soup::{NONE, Soup};
use crate::load::smooth_normals::angle;
use crate::math::ear_clip::newell;
use crate::math::{DVec3, Vec3};

/// Normals of smoothing groups, and the one that each corner uses.
#[derive(Clone, Debug, Default)]
pub(super) struct Smooth {
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Per corner of [`Soup::corners`]: index into `normals`, or [`NONE`]. Empty when no corner uses any.
    pub of_corner: Vec<u32>,
}

/// Computes the normals of corners without one.
pub(super) fn smooth(soup: &Soup, positions: &[Vec3], faces: &[Face]) -> Smooth {
    let needs = |f: &Face| f.smoothing > 0 && soup.corners[f.corners()].iter().any(|c| c.normal == NONE);
    if !faces.iter().any(needs) {
        return Smooth::default();
    }

    // Sum up by (position, group).
    let mut sums: Vec<DVec3> = Vec::new();
    let mut pairs = Pairs::new(positions.len());
    let mut of_corner = vec![NONE; soup.corners.len()];
    let mut ring: Vec<DVec3> = Vec::new();
    for face in faces.iter().filter(|f| f.smoothing > 0) {
        let range = face.corners();
        ring.clear();
        ring.extend(soup.corners[range.clone()].iter().map(|c| positions[c.position as usize].as_dvec3()));
        let normal = newell(&ring).normalize_or_zero();
        for (i, at) in range.enumerate() {
            let pair = pairs.number(soup.corners[at].position, face.smoothing);
            sums.resize(pairs.len(), DVec3::ZERO);
            sums[pair as usize] += normal * angle(&ring, i);
            of_corner[at] = pair;
        }
    }

    // A corner keeps the sum only where it has no normal of its own and the sum is not zero.
    let normals: Vec<Vec3> = sums.iter().map(|s| s.normalize_or_zero().as_vec3()).collect();
    for (corner, use_) in soup.corners.iter().zip(&mut of_corner) {
        if corner.normal != NONE || (*use_ != NONE && normals[*use_ as usize] == Vec3::ZERO) {
            *use_ = NONE;
        }
    }
    Smooth { normals, of_corner }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_at_a_corner_is_that_of_its_sides() {
        let ring = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert!((angle(&ring, 0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((angle(&ring, 2) - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
        assert_eq!(angle(&[DVec3::ZERO; 3], 0), 0.0);
    }
}
