//! Surfaces with further lobes besides that of their facets.

use super::check_all;
use super::pictures::checkered_floor;
use crate::common::stage::{Stage, metal_rough};
use meshray::image::Output;
use meshray::math::Vec3;
use meshray::scene::{Coat, Iridescence, MetalRough, Sheen};

#[test]
fn golden_coat_iridescence_sheen_and_coloured_glass() {
    let mut stage = Stage::new([0.0, 0.9, 6.5], [0.0, 0.0, 0.0]);
    stage.studio();
    checkered_floor(&mut stage, -0.7);
    let coat = |roughness| {
        let maps = (None, None, None);
        Coat {
            strength: 1.0,
            strength_map: maps.0,
            roughness,
            roughness_map: maps.1,
            normal_map: maps.2,
            normal_scale: 1.0,
        }
    };
    let iridescence =
        Iridescence { strength: 1.0, strength_map: None, ior: 1.4, thickness: [100.0, 380.0], thickness_map: None };
    let sheen = Sheen { color: Vec3::new(0.9, 0.5, 0.9), color_map: None, roughness: 0.5, roughness_map: None };
    let matt = MetalRough { metallic: 0.0, roughness: 0.8, ..MetalRough::default() };
    let absorption = MetalRough::absorption_of(Vec3::new(0.2, 0.6, 0.9), 1.0);
    let glass = MetalRough { roughness: 0.0, transmission: 1.0, thick: true, absorption, ..matt.clone() };
    let surfaces = [
        ([0.7, 0.02, 0.02], MetalRough { coat: Some(Box::new(coat(0.0))), ..matt.clone() }),
        ([0.7, 0.02, 0.02], MetalRough { coat: Some(Box::new(coat(0.5))), ..matt.clone() }),
        (
            [0.9, 0.9, 0.9],
            MetalRough { metallic: 1.0, roughness: 0.3, iridescence: Some(Box::new(iridescence)), ..matt.clone() },
        ),
        ([0.1, 0.05, 0.2], MetalRough { sheen: Some(Box::new(sheen)), ..matt }),
        ([1.0, 1.0, 1.0], glass),
    ];
    for (i, (color, surface)) in (0u8..).zip(surfaces) {
        let material = stage.material(metal_rough(color, surface));
        stage.sphere([f64::from(i) * 1.3 - 2.6, 0.0, 0.0], 0.6, material);
    }
    stage.sun([-0.3, -1.0, -0.6], 2.0);
    check_all(&[("lobes", &stage.render(), &Output::default())]);
}
