//! Glass: a goblet with walls of its own, a solid ball, a bubble, a tinted block and a thin pane, on a checkered tile.

use crate::glb::Glb;
use crate::picture::png;
use crate::shape::{Outline, ball, block, panel};
use libm::{cos, sin};
use meshray::math::DVec3;
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;

pub(crate) fn model() -> Vec<u8> {
    let mut glb = Glb::default();
    let nodes = [tile(&mut glb), goblet(&mut glb), solid_ball(&mut glb), tinted_block(&mut glb), pane(&mut glb)];
    glb.finish(&nodes)
}

/// A material that lets light through; `thickness` 0 makes it thin.
fn glass(name: &str, color: [f64; 3], ior: f64, thickness: f64) -> Value {
    let mut material = json!({
        "name": name,
        "doubleSided": thickness == 0.0,
        "pbrMetallicRoughness": {
            "baseColorFactor": [color[0], color[1], color[2], 1.0], "metallicFactor": 0, "roughnessFactor": 0
        },
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_ior": { "ior": ior } }
    });
    if thickness > 0.0 {
        material["extensions"]["KHR_materials_volume"] = json!({ "thicknessFactor": thickness });
    }
    material
}

fn tile(glb: &mut Glb) -> usize {
    let bytes = png(64, 64, |u, v| {
        let dark = ((u * 8.0) as u32 + (v * 8.0) as u32).is_multiple_of(2);
        if dark { [0.30, 0.33, 0.38] } else { [0.90, 0.88, 0.83] }
    });
    let sharp = json!({ "magFilter": 9728, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 });
    let texture = glb.texture("image/png", &bytes, sharp);
    let material = glb.material(json!({
        "name": "tile",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": texture }, "metallicFactor": 0, "roughnessFactor": 0.6 }
    }));
    let geometry = glb.geometry(&block(DVec3::new(1.6, 0.05, 1.2)).mapped_from_above(1.2));
    let mesh = glb.mesh("tile", &geometry, material);
    glb.place("tile", mesh, [0.0, -0.05, 0.0])
}

/// Up the outside from the foot, over the lip, down the inside of the bowl.
fn goblet(glb: &mut Glb) -> usize {
    let outside = [
        (0.30, 0.015),
        (0.18, 0.05),
        (0.05, 0.10),
        (0.04, 0.30),
        (0.05, 0.46),
        (0.20, 0.58),
        (0.32, 0.78),
        (0.33, 1.0),
        (0.27, 1.22),
    ];
    let inside = [(0.25, 1.22), (0.31, 1.0), (0.30, 0.78), (0.18, 0.605), (0.0, 0.54)];
    let shape = Outline::default()
        .line((0.0, 0.0), (0.30, 0.0))
        .arc((0.30, 0.0075), 0.0075, -FRAC_PI_2, FRAC_PI_2, 3)
        .curve(&outside, 6)
        .arc((0.26, 1.22), 0.01, 0.0, crate::shape::HALF_TURN, 4)
        .curve(&inside, 6)
        .lathe(56)
        .plain();
    let material = glb.material(glass("crown glass", [1.0, 1.0, 1.0], 1.52, 0.02));
    let geometry = glb.geometry(&shape);
    let mesh = glb.mesh("goblet", &geometry, material);
    glb.place("goblet", mesh, [-0.75, 0.0, -0.2])
}

/// A solid ball with a bubble of air: a smaller ball turned inside out.
fn solid_ball(glb: &mut Glb) -> usize {
    let mut bubble = ball(0.14, 32);
    for normal in &mut bubble.normals {
        *normal = normal.map(|c| -c);
    }
    for triangle in bubble.indices.chunks_exact_mut(3) {
        triangle.swap(1, 2);
    }
    let material = glb.material(glass("clear glass", [0.97, 1.0, 0.99], 1.5, 0.8));
    let geometry = glb.geometry(&ball(0.4, 56).with(bubble).plain());
    let mesh = glb.mesh("ball", &geometry, material);
    glb.place("ball", mesh, [0.05, 0.4, 0.25])
}

fn tinted_block(glb: &mut Glb) -> usize {
    let material = glb.material(glass("blue glass", [0.45, 0.70, 0.95], 1.66, 0.4));
    let geometry = glb.geometry(&block(DVec3::new(0.2, 0.35, 0.2)).plain());
    let mesh = glb.mesh("block", &geometry, material);
    let turn = 0.3;
    glb.node(json!({
        "name": "block", "mesh": mesh, "translation": [0.85, 0.35, -0.25], "rotation": [0.0, sin(turn), 0.0, cos(turn)]
    }))
}

fn pane(glb: &mut Glb) -> usize {
    let material = glb.material(glass("amber pane", [1.0, 0.72, 0.30], 1.5, 0.0));
    let geometry = glb.geometry(&panel(0.3, 0.25).plain());
    let mesh = glb.mesh("pane", &geometry, material);
    glb.place("pane", mesh, [0.85, 0.25, 0.65])
}
