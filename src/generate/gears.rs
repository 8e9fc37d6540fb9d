//! Toothed wheels that mesh with their neighbours, in layers.

use super::solid::{Solid, turned};
use super::{paint, standing};
use crate::math::{DAffine3, DQuat, DVec3, Vec3};
use crate::scene::Scene;

/// Triangles of a wheel per tooth.
const PER_TOOTH: usize = 32;

/// Scene of wheels of 24 teeth, fewer where `wanted` is small.
pub(super) fn scene(wanted: usize) -> Scene {
    let teeth = (wanted / PER_TOOTH).clamp(3, 24) / 2 * 2;
    let teeth = teeth.max(4);
    let of_wheel = teeth * PER_TOOTH;
    let count = ((wanted + of_wheel / 2) / of_wheel).max(1);
    let wheel = wheel(teeth);
    let (mut even, mut odd) = (Solid::default(), Solid::default());
    let side = (1..).find(|n| n * n * n >= count).unwrap_or(1);
    for i in 0..count {
        let (x, y, z) = (i % side, i / side % side, i / (side * side));
        let second = (x + y) % 2 == 1;
        // Teeth of one fit into gaps of the other, whose outline runs the opposite way: turn by a quarter of a tooth and gap.
        let turn = if second { std::f64::consts::FRAC_PI_2 / teeth as f64 } else { 0.0 };
        let at = DVec3::new(x as f64 * 2.0, y as f64 * 2.0, z as f64 * 0.7);
        let solid = if second { &mut odd } else { &mut even };
        solid.place(&wheel, &DAffine3::from_rotation_translation(DQuat::from_rotation_z(turn), at));
    }
    let materials =
        vec![paint("brass", Vec3::new(0.85, 0.65, 0.3), 1.0, 0.3), paint("steel", Vec3::splat(0.7), 1.0, 0.25)];
    let meshes = [(even, "brass wheels", 0), (odd, "steel wheels", 1)];
    let meshes = meshes.into_iter().filter(|(solid, ..)| solid.len() > 0);
    standing(meshes.map(|(solid, name, material)| solid.mesh(name, material)).collect(), materials)
}

/// A wheel around z whose teeth reach from radius 0.9 to 1.08, with a hole of radius 0.4.
fn wheel(teeth: usize) -> Solid {
    let mut solid = Solid::default();
    // Four points per tooth, on the outline and around the hole, below and above.
    let outline = |i: usize| if i % 4 < 2 { 0.9 } else { 1.08 };
    let n = 4 * teeth;
    let ring = |solid: &mut Solid, radius: &dyn Fn(usize) -> f64, z: f64| -> Vec<u32> {
        let point = |i: usize| {
            let (sin, cos) = turned(i as f64 / n as f64);
            DVec3::new(cos * radius(i), sin * radius(i), z)
        };
        (0..n).map(|i| solid.point(point(i))).collect()
    };
    let (low, high) = (ring(&mut solid, &outline, -0.2), ring(&mut solid, &outline, 0.2));
    let (hole_low, hole_high) = (ring(&mut solid, &|_| 0.4, -0.2), ring(&mut solid, &|_| 0.4, 0.2));
    for i in 0..n {
        let j = (i + 1) % n;
        solid.quad(low[i], low[j], high[j], high[i]);
        solid.quad(hole_low[j], hole_low[i], hole_high[i], hole_high[j]);
        solid.quad(high[i], high[j], hole_high[j], hole_high[i]);
        solid.quad(low[j], low[i], hole_low[i], hole_low[j]);
    }
    solid
}
