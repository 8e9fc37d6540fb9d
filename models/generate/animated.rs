//! An orrery that runs for four seconds: turning arms (linear and step), a moon on a spline, and a sun that breathes by a
//! morph target. A still shows the pose at rest.

use crate::glb::{Channel, Glb};
use crate::shape::{Outline, ball, disc, tube};
use libm::{cos, sin};
use meshray::math::DVec3;
use serde_json::json;
use std::f64::consts::TAU;

pub(crate) fn model() -> Vec<u8> {
    let mut glb = Glb::default();
    let mut matt = |name: &str, color: [f64; 3], metallic: f64, roughness: f64| {
        glb.material(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [color[0], color[1], color[2], 1.0],
                "metallicFactor": metallic, "roughnessFactor": roughness
            }
        }))
    };
    let brass = matt("brass", [0.90, 0.70, 0.36], 1.0, 0.25);
    let sun = matt("sun", [0.98, 0.62, 0.12], 0.0, 0.4);
    let sea = matt("sea", [0.10, 0.32, 0.62], 0.0, 0.25);
    let rock = matt("rock", [0.55, 0.52, 0.48], 0.0, 0.8);

    // The stand.
    let stand = Outline::default()
        .line((0.0, 0.0), (0.5, 0.0))
        .curve(&[(0.5, 0.0), (0.5, 0.06), (0.16, 0.12), (0.05, 0.25), (0.04, 0.6), (0.04, 0.95)], 6)
        .lathe(48)
        .plain();
    let stand = mesh(&mut glb, "stand", &stand, brass);
    let stand = glb.place("stand", stand, [0.0, 0.0, 0.0]);

    // The sun breathes: its vertices move out in eight rays.
    let ball_of_fire = ball(0.3, 40).plain();
    let rays: Vec<[f32; 3]> = ball_of_fire
        .normals
        .iter()
        .map(|n| {
            let around = libm::atan2(f64::from(n[2]), f64::from(n[0]));
            let out = 0.06 * (1.0 + cos(8.0 * around)) * (1.0 - f64::from(n[1] * n[1]));
            n.map(|c| c * out as f32)
        })
        .collect();
    let mut geometry = glb.geometry(&ball_of_fire);
    glb.morph(&mut geometry, &rays);
    let sun = glb.mesh("sun", &geometry, sun);
    let sun = glb.place("sun", sun, [0.0, 1.15, 0.0]);

    // Two arms; the outer one carries the planet and its moon.
    let round = ball(1.0, 40).plain();
    let ring = tube(|t| DVec3::new(0.24 * sin(TAU * t), 0.0, 0.24 * cos(TAU * t)), 0.015, 10, 48).plain();
    let arm = |glb: &mut Glb, length: f64| {
        let rod = Outline::default()
            .line((0.0, 0.0), (0.02, 0.0))
            .line((0.02, 0.0), (0.02, length))
            .line((0.02, length), (0.0, length))
            .lathe(12)
            .plain();
        let rod = mesh(glb, "rod", &rod, brass);
        // From upright to lying along +x.
        let quarter = (0.5f64).sqrt();
        glb.node(json!({ "name": "rod", "mesh": rod, "rotation": [0.0, 0.0, -quarter, quarter] }))
    };
    let planet = mesh(&mut glb, "planet", &round, sea);
    let planet = glb.node(
        json!({ "name": "planet", "mesh": planet, "translation": [1.1, 0.17, 0.0], "scale": [0.17, 0.17, 0.17] }),
    );
    let ring = mesh(&mut glb, "ring", &ring, brass);
    let ring = glb.place("ring", ring, [1.1, 0.17, 0.0]);
    let moon = mesh(&mut glb, "moon", &round, rock);
    let moon =
        glb.node(json!({ "name": "moon", "mesh": moon, "translation": [1.1, 0.46, 0.0], "scale": [0.06, 0.06, 0.06] }));
    let outer = arm(&mut glb, 1.1);
    let outer = glb
        .node(json!({ "name": "outer arm", "translation": [0.0, 0.62, 0.0], "children": [outer, planet, ring, moon] }));
    let small = mesh(&mut glb, "small planet", &round, rock);
    let small = glb.node(
        json!({ "name": "small planet", "mesh": small, "translation": [0.0, 0.1, 0.0], "scale": [0.1, 0.1, 0.1] }),
    );
    let tip = glb.node(json!({ "name": "tip", "translation": [0.62, 0.0, 0.0], "children": [small] }));
    let inner = arm(&mut glb, 0.62);
    let away = [0.0, sin(1.1), 0.0, cos(1.1)];
    let inner = glb.node(
        json!({ "name": "inner arm", "translation": [0.0, 0.45, 0.0], "rotation": away, "children": [inner, tip] }),
    );
    let base = mesh(&mut glb, "base", &disc(0.62, 0.06, 0.02, 64).plain(), rock);
    let base = glb.place("base", base, [0.0, -0.06, 0.0]);

    let turn = |quarters: f64| [0.0, sin(TAU * quarters / 8.0) as f32, 0.0, cos(TAU * quarters / 8.0) as f32];
    let around: Vec<f32> = (0..5).flat_map(|i| turn(f64::from(i))).collect();
    let steps: Vec<f32> = (0..9).flat_map(|i| turn(1.4 + f64::from(i))).collect();
    let eighths: Vec<f32> = (0..9).map(|i| i as f32 * 0.5).collect();
    // In-tangent, place, out-tangent for each of the spline's three keys.
    let hop = [
        [0.0, 0.0, 0.0],
        [1.1, 0.46, 0.0],
        [0.0, 0.0, 0.4],
        [0.0, 0.0, -0.4],
        [1.1, 0.60, 0.0],
        [0.0, 0.0, -0.4],
        [0.0, 0.0, 0.4],
        [1.1, 0.46, 0.0],
        [0.0, 0.0, 0.0],
    ]
    .concat();
    let quarters = [0.0, 1.0, 2.0, 3.0, 4.0];
    let channel =
        |node, path, interpolation, times, values, kind| Channel { node, path, interpolation, times, values, kind };
    glb.animation(
        "run",
        &[
            channel(outer, "rotation", "LINEAR", &quarters, &around, "VEC4"),
            channel(inner, "rotation", "STEP", &eighths, &steps, "VEC4"),
            channel(moon, "translation", "CUBICSPLINE", &[0.0, 2.0, 4.0], &hop, "VEC3"),
            channel(sun, "weights", "LINEAR", &quarters, &[0.0, 1.0, 0.0, 1.0, 0.0], "SCALAR"),
        ],
    );
    glb.finish(&[base, stand, sun, outer, inner])
}

fn mesh(glb: &mut Glb, name: &str, shape: &crate::shape::Shape, material: usize) -> usize {
    let geometry = glb.geometry(shape);
    glb.mesh(name, &geometry, material)
}
