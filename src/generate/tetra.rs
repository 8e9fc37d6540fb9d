//! Sierpiński's tetrahedron: four copies of half the size, recursively.

use super::solid::Solid;
use super::{paint, standing};
use crate::math::{DVec3, Vec3};
use crate::scene::Scene;

/// Scene of 4 · 4^n triangles.
pub(super) fn scene(wanted: usize) -> Scene {
    let mut level = 0;
    // The nearer of two powers in ratio: between n and 4 n the limit is 2 n.
    while 4usize.pow(level + 1) * 2 < wanted {
        level += 1;
    }
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(DVec3::from);
    let mut solid = Solid::default();
    divide(&mut solid, corners, level);
    standing(vec![solid.mesh("tetrahedra", 0)], vec![paint("clay", Vec3::new(0.75, 0.35, 0.2), 0.0, 0.6)])
}

fn divide(solid: &mut Solid, corners: [DVec3; 4], level: u32) {
    if level > 0 {
        for corner in corners {
            divide(solid, corners.map(|p| (p + corner) * 0.5), level - 1);
        }
        return;
    }
    let [a, b, c, d] = corners.map(|p| solid.point(p));
    for [i, j, k] in [[a, b, c], [a, d, b], [a, c, d], [b, d, c]] {
        solid.triangle(i, j, k);
    }
}
