//! One pot, many times: a mesh of two thousand triangles, instanced as often as needed.

use super::paint;
use super::pot::pot;
use crate::math::random::Random;
use crate::math::{DAffine3, DQuat, DVec3, Vec3};
use crate::scene::{Instance, Scene, UpAxis};

/// Scene of pots of 2,000 triangles, fewer where `wanted` is small, on a square lattice.
pub(super) fn scene(wanted: usize) -> Scene {
    let mesh = pot((wanted / 4).clamp(100, 2000)).mesh("pot", 0);
    let count = (wanted as f64 / mesh.triangles.len() as f64).round().max(1.0) as usize;
    let side = (1..).find(|n| n * n >= count).unwrap_or(1);
    let mut random = Random::new(5);
    let instance = |i: usize| {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        let turn = DQuat::from_rotation_z(f64::from(random.unit()) * std::f64::consts::TAU);
        let size = DVec3::splat(0.7 + 0.5 * f64::from(random.unit()));
        let at = DVec3::new(x, y, 0.0) * 1.2 + DVec3::new(random.unit().into(), random.unit().into(), 0.0) * 0.2;
        Instance {
            name: format!("pot {i}"),
            mesh: 0,
            world_from_object: DAffine3::from_scale_rotation_translation(size, turn, at),
        }
    };
    let instances = (0..count).map(instance).collect();
    let materials = vec![paint("glaze", Vec3::new(0.55, 0.15, 0.12), 0.0, 0.3)];
    Scene { meshes: vec![mesh], instances, materials, up: UpAxis::Z, ..Scene::default() }
}
