//! The first picture of the README: a gold knot, a glass ball, a glazed vase and a copper ball on polished stone.

use crate::glb::Glb;
use crate::picture::{clouds, jpeg, mix, normal_map, png, repeating, smooth};
use crate::shape::{HALF_TURN, Outline, Shape, ball, disc, knot};
use libm::{cos, sin};
use serde_json::json;
use std::f64::consts::TAU;

pub(crate) fn model() -> Vec<u8> {
    let mut glb = Glb::default();
    let nodes = [stone(&mut glb), gold_knot(&mut glb), vase(&mut glb)];
    let nodes: Vec<usize> = nodes.into_iter().chain(balls(&mut glb)).collect();
    glb.finish(&nodes)
}

/// The plinth: dark polished stone with pale veins.
fn stone(glb: &mut Glb) -> usize {
    let bytes = jpeg(512, 512, |u, v| {
        let drift = clouds(u, v, 4.0, 5);
        let vein = 1.0 - (sin(TAU * (2.0 * u + v) + 9.0 * drift)).abs();
        let fine = 1.0 - (sin(TAU * (u - 3.0 * v) + 14.0 * clouds(u, v, 8.0, 4))).abs();
        let body = mix([0.14, 0.17, 0.21], [0.27, 0.30, 0.35], 0.5 + 1.6 * drift);
        let pale = smooth(0.80, 1.0, vein) * 0.75 + smooth(0.90, 1.0, fine) * 0.35;
        mix(body, [0.86, 0.84, 0.80], pale)
    });
    let texture = glb.texture("image/jpeg", &bytes, repeating());
    let material = glb.material(json!({
        "name": "stone",
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": texture }, "metallicFactor": 0, "roughnessFactor": 0.12
        }
    }));
    let geometry = glb.geometry(&disc(1.55, 0.16, 0.035, 96).mapped_from_above(2.4));
    let mesh = glb.mesh("plinth", &geometry, material);
    glb.place("plinth", mesh, [0.0, -0.16, 0.0])
}

fn gold_knot(glb: &mut Glb) -> usize {
    let gold = glb.material(json!({
        "name": "gold",
        "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.72, 0.30, 1.0], "metallicFactor": 1, "roughnessFactor": 0.1 }
    }));
    let geometry = glb.geometry(&knot(2.0, 3.0, 0.62, 0.135, 24, 180).plain());
    let mesh = glb.mesh("knot", &geometry, gold);
    glb.node(json!({
        "name": "knot", "mesh": mesh, "translation": [-0.16, 0.0, -0.42],
        "rotation": [0.0, sin(0.12), 0.0, cos(0.12)]
    }))
}

/// A vase with a painted band and a finely fluted foot.
fn vase(glb: &mut Glb) -> usize {
    let paint = png(256, 512, |u, v| {
        let (glaze, cream, ink) = ([0.07, 0.42, 0.45], [0.93, 0.88, 0.76], [0.10, 0.15, 0.32]);
        let wave = 0.012 * sin(TAU * 12.0 * u);
        let band = smooth(0.405, 0.41, v + wave) * smooth(0.645, 0.64, v - wave);
        // Petals in a ring.
        let (ring_u, ring_v) = (u * 9.0 - (u * 9.0).floor() - 0.5, (v - 0.525) * 13.0);
        let around = libm::atan2(ring_v, ring_u * 2.2);
        let reach = 0.62 + 0.26 * cos(6.0 * around);
        let distance = (ring_u * ring_u * 4.84 + ring_v * ring_v).sqrt();
        let petals = smooth(reach + 0.02, reach - 0.02, distance) * smooth(0.18, 0.22, distance);
        let heart = smooth(0.12, 0.09, distance);
        let lines = smooth(0.006, 0.003, (v - 0.385).abs()) + smooth(0.006, 0.003, (v - 0.665).abs());
        let ground = mix(mix(glaze, cream, band), cream, lines);
        mix(mix(ground, ink, petals * band), [0.78, 0.25, 0.14], heart * band)
    });
    let flutes = normal_map(256, 0.006, |u, v| smooth(0.70, 0.74, v) * (0.5 + 0.5 * cos(TAU * 32.0 * u)));
    let paint = glb.texture("image/png", &paint, repeating());
    let flutes = glb.texture("image/png", &flutes, repeating());
    let glaze = glb.material(json!({
        "name": "glaze",
        "normalTexture": { "index": flutes },
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": paint }, "metallicFactor": 0, "roughnessFactor": 0.2
        }
    }));
    // Up the outside, over the lip, down the inside.
    let body = [
        (0.20, 0.0),
        (0.25, 0.06),
        (0.40, 0.34),
        (0.43, 0.58),
        (0.33, 0.86),
        (0.165, 1.06),
        (0.15, 1.20),
        (0.205, 1.32),
    ];
    let inside = [(0.165, 1.32), (0.115, 1.20), (0.13, 1.04), (0.28, 0.84), (0.0, 0.5)];
    let shape: Shape = Outline::default()
        .line((0.0, 0.0), (0.20, 0.0))
        .curve(&body, 6)
        .arc((0.185, 1.32), 0.02, 0.0, HALF_TURN, 4)
        .curve(&inside, 3)
        .lathe(48);
    let geometry = glb.geometry(&shape);
    let mesh = glb.mesh("vase", &geometry, glaze);
    glb.place("vase", mesh, [0.98, 0.0, -0.32])
}

/// A glass ball in front, a copper ball, and a small one of white porcelain.
fn balls(glb: &mut Glb) -> Vec<usize> {
    let round = glb.geometry(&ball(1.0, 56).plain());
    let glass = glb.material(json!({
        "name": "glass",
        "pbrMetallicRoughness": { "baseColorFactor": [0.96, 0.99, 0.98, 1.0], "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_ior": { "ior": 1.5 },
            "KHR_materials_volume": { "thicknessFactor": 0.6 }
        }
    }));
    let copper = glb.material(json!({
        "name": "copper",
        "pbrMetallicRoughness": { "baseColorFactor": [0.93, 0.50, 0.38, 1.0], "metallicFactor": 1, "roughnessFactor": 0.38 }
    }));
    let porcelain = glb.material(json!({
        "name": "porcelain",
        "pbrMetallicRoughness": { "baseColorFactor": [0.88, 0.87, 0.84, 1.0], "metallicFactor": 0, "roughnessFactor": 0.08 }
    }));
    let stand = [
        ("glass ball", glass, 0.34, (-0.72, 0.46)),
        ("copper ball", copper, 0.25, (0.42, 0.62)),
        ("porcelain ball", porcelain, 0.16, (-0.08, 1.0)),
    ];
    stand
        .into_iter()
        .map(|(name, material, radius, (x, z))| {
            let mesh = glb.mesh(name, &round, material);
            glb.node(
                json!({ "name": name, "mesh": mesh, "translation": [x, radius, z], "scale": [radius, radius, radius] }),
            )
        })
        .collect()
}
