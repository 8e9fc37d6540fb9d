//! A small pot in the middle of a huge bowl: half of all triangles in a two-hundredth of the width.

use super::pot::pot;
use super::solid::Solid;
use super::{paint, standing};
use crate::math::{DAffine3, DQuat, DVec3, Vec3};
use crate::scene::Scene;

/// Scene of a bowl of radius 100 and a pot half a unit wide, each with half of the triangles.
pub(super) fn scene(wanted: usize) -> Scene {
    let half = (wanted / 2).max(1);
    let mut detail = Solid::default();
    let small = DAffine3::from_scale_rotation_translation(DVec3::splat(0.5), DQuat::IDENTITY, DVec3::ZERO);
    detail.place(&pot(half), &small);
    let columns = ((half as f64).sqrt() as usize).max(3);
    // A flat floor, then tiers that rise more and more steeply.
    let bowl = Solid::lathe((columns / 2).max(2), columns, |s| {
        let rise = (s - 0.4).max(0.0) / 0.6;
        (100.0 * s, 40.0 * rise * rise)
    });
    let materials =
        vec![paint("stone", Vec3::splat(0.55), 0.0, 0.9), paint("glaze", Vec3::new(0.1, 0.3, 0.6), 0.0, 0.15)];
    standing(vec![bowl.mesh("bowl", 0), detail.mesh("pot", 1)], materials)
}
