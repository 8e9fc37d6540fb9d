//! A rough height field with four glass balls above it.

use super::solid::Solid;
use super::{paint, standing};
use crate::math::random::Random;
use crate::math::{DAffine3, DVec3, Vec3};
use crate::scene::{Material, MetalRough, Reflection, Scene};

/// Scene of 2 · n² triangles and four balls.
pub(super) fn scene(wanted: usize) -> Scene {
    let level = match wanted {
        0..10_000 => 2,
        10_000..100_000 => 3,
        _ => 4,
    };
    let ball = Solid::sphere(0.18, level);
    let mut balls = Solid::default();
    for (x, y) in [(-0.45, -0.45), (0.45, -0.45), (-0.45, 0.45), (0.45, 0.45)] {
        balls.place(&ball, &DAffine3::from_translation(DVec3::new(x, y, 0.75)));
    }
    let n = (((wanted.saturating_sub(balls.len()).max(2)) as f64 / 2.0).sqrt().round() as usize).max(1);
    let mut ground = Solid::default();
    for row in 0..=n {
        for column in 0..=n {
            let (x, y) = (column as f64 / n as f64, row as f64 / n as f64);
            ground.point(DVec3::new(2.0 * x - 1.0, 2.0 * y - 1.0, height(x, y, n)));
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "at most ten million points")]
    let at = |row: usize, column: usize| (row * (n + 1) + column) as u32;
    for row in 0..n {
        for column in 0..n {
            ground.quad(at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column));
        }
    }
    let glass =
        MetalRough { metallic: 0.0, roughness: 0.0, transmission: 1.0, thick: true, ior: 1.5, ..MetalRough::default() };
    let glass = Material {
        name: "glass".into(),
        base_color: Vec3::ONE,
        reflection: Reflection::MetalRough(glass),
        ..Material::default()
    };
    let materials = vec![paint("rock", Vec3::new(0.45, 0.4, 0.35), 0.0, 0.95), glass];
    standing(vec![ground.mesh("mountain", 0), balls.mesh("balls", 1)], materials)
}

/// Height from value noise on lattices, each twice as fine and half as high as the one before, down to the grid's own.
/// (K. Perlin, *An Image Synthesizer*, 1985, with values for gradients.)
fn height(x: f64, y: f64, n: usize) -> f64 {
    let (mut sum, mut scale, mut cells) = (0.0, 0.45, 2u32);
    while cells as usize <= n.max(2) {
        let (u, v) = (x * f64::from(cells), y * f64::from(cells));
        let (i, j) = (u.floor(), v.floor());
        let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
        let (s, t) = (smooth(u - i), smooth(v - j));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to the number of cells")]
        let at = |di: u64, dj: u64| lattice(i as u64 + di, j as u64 + dj, cells);
        let (low, high) = (at(0, 0) * (1.0 - s) + at(1, 0) * s, at(0, 1) * (1.0 - s) + at(1, 1) * s);
        sum += scale * (low * (1.0 - t) + high * t);
        (scale, cells) = (scale * 0.5, cells * 2);
    }
    sum
}

/// Random value of a lattice point, −0.5 to 0.5.
fn lattice(i: u64, j: u64, cells: u32) -> f64 {
    f64::from(Random::new(u64::from(cells) << 40 ^ i << 20 ^ j).unit()) - 0.5
}
