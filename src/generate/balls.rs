//! Balls on balls: each carries nine of a third of its size; the first stands on a floor.

use super::solid::Solid;
use super::{paint, standing};
use crate::math::{DAffine3, DQuat, DVec3, Vec3};
use crate::scene::Scene;

/// Scene of (1 + 9 + 81 + …) balls of 8 · 4^k triangles each, and a floor of two.
pub(super) fn scene(wanted: usize) -> Scene {
    let (depth, level) = shape(wanted);
    let ball = Solid::sphere(1.0, level);
    let mut solid = Solid::default();
    grow(&mut solid, &ball, DVec3::ZERO, 1.0, DVec3::Z, depth);
    let mut floor = Solid::default();
    let corners =
        [(-6.0, -6.0), (6.0, -6.0), (6.0, 6.0), (-6.0, 6.0)].map(|(x, y)| floor.point(DVec3::new(x, y, -1.0)));
    floor.quad(corners[0], corners[1], corners[2], corners[3]);
    let materials =
        vec![paint("bronze", Vec3::new(0.8, 0.5, 0.3), 1.0, 0.25), paint("floor", Vec3::splat(0.5), 0.0, 0.8)];
    standing(vec![solid.mesh("balls", 0), floor.mesh("floor", 1)], materials)
}

/// Recursion depth and subdivision level of the balls whose number of triangles is nearest to `wanted`.
fn shape(wanted: usize) -> (u32, u32) {
    let all = (0..=5).flat_map(|depth| (0..=6).map(move |level| (depth, level)));
    let far = |(depth, level): (u32, u32)| {
        let balls = (9f64.powi(depth as i32 + 1) - 1.0) / 8.0;
        let ratio = (balls * 8.0 * 4f64.powi(level as i32) / wanted as f64).ln().abs();
        // Of two equally near, the one with more balls; very coarse and very fine balls count as farther.
        ratio + if level == 0 { 0.3 } else { 0.02 * f64::from(level) }
    };
    all.min_by(|&a, &b| far(a).total_cmp(&far(b))).unwrap_or((1, 1))
}

fn grow(solid: &mut Solid, ball: &Solid, center: DVec3, radius: f64, up: DVec3, depth: u32) {
    solid.place(ball, &DAffine3::from_scale_rotation_translation(DVec3::splat(radius), DQuat::IDENTITY, center));
    if depth == 0 {
        return;
    }
    let across = up.any_orthonormal_vector();
    let side = up.cross(across);
    // Six around the equator, three above them and in between.
    let around = (0..6).map(|i| (f64::from(i) / 6.0, 0.0)).chain((0..3).map(|i| ((f64::from(i) + 0.25) / 3.0, 0.87)));
    for (turn, height) in around {
        let (sin, cos) = super::solid::turned(turn);
        let out = ((across * cos + side * sin) * (1.0f64 - height * height).sqrt() + up * height).normalize();
        grow(solid, ball, center + out * (radius * 4.0 / 3.0), radius / 3.0, out, depth - 1);
    }
}
