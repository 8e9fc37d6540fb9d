//! A tree: every branch ends in a knot from which thinner ones grow, over one huge floor.

use std::collections::VecDeque;

use super::solid::Solid;
use super::{paint, standing};
use crate::math::random::Random;
use crate::math::{DAffine3, DQuat, DVec3, Vec3};
use crate::scene::Scene;

struct Branch {
    from: DVec3,
    along: DVec3,
    radius: f64,
}

/// Scene of 48 triangles a branch, and the floor.
pub(super) fn scene(wanted: usize) -> Scene {
    let branches = ((wanted.saturating_sub(2) + 24) / 48).max(1);
    let knot = Solid::sphere(1.0, 1);
    let mut random = Random::new(11);
    let mut solid = Solid::default();
    let mut waiting = VecDeque::from([Branch { from: DVec3::ZERO, along: DVec3::Z * 2.0, radius: 0.2 }]);
    // The thickest first, so that any number of branches makes a complete tree.
    for _ in 0..branches {
        let Some(Branch { from, along, radius }) = waiting.pop_front() else { break };
        let (side, end) = (along.any_orthonormal_vector(), from + along);
        solid.place(&Solid::tube(1, 8, side, |s| from + along * s, |s| radius * (1.0 - 0.35 * s)), &DAffine3::IDENTITY);
        let thin = radius * 0.65;
        solid.place(&knot, &DAffine3::from_scale_rotation_translation(DVec3::splat(thin), DQuat::IDENTITY, end));
        let (sin, cos) = super::solid::turned(f64::from(random.unit()));
        let across = side.normalize() * cos + along.normalize().cross(side.normalize()) * sin;
        for lean in [0.75, -0.6] {
            let dir = (along.normalize() + across * lean + DVec3::Z * 0.1).normalize();
            waiting.push_back(Branch { from: end, along: dir * along.length() * 0.74, radius: thin });
        }
    }
    let mut floor = Solid::default();
    let corners =
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| floor.point(DVec3::new(x, y, 0.0) * 50.0));
    floor.quad(corners[0], corners[1], corners[2], corners[3]);
    let materials =
        vec![paint("bark", Vec3::new(0.35, 0.22, 0.12), 0.0, 0.9), paint("ground", Vec3::new(0.3, 0.4, 0.2), 0.0, 1.0)];
    standing(vec![solid.mesh("branches", 0), floor.mesh("ground", 1)], materials)
}
