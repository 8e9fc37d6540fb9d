//! Metals from mirror to matt: a steel knot and balls of gold, copper and steel in rows of growing roughness.

use crate::glb::Glb;
use crate::shape::{ball, disc, knot};
use serde_json::json;

pub(crate) fn model() -> Vec<u8> {
    let mut glb = Glb::default();
    let metal = |glb: &mut Glb, name: &str, color: [f64; 3], roughness: f64| {
        glb.material(json!({
            "name": format!("{name} {roughness}"),
            "pbrMetallicRoughness": {
                "baseColorFactor": [color[0], color[1], color[2], 1.0], "metallicFactor": 1, "roughnessFactor": roughness
            }
        }))
    };
    let metals = [("gold", [1.0, 0.72, 0.30]), ("copper", [0.93, 0.50, 0.38]), ("steel", [0.62, 0.61, 0.60])];

    let round = glb.geometry(&ball(0.2, 48).plain());
    let mut nodes = Vec::new();
    for (row, (name, color)) in metals.into_iter().enumerate() {
        for (column, roughness) in [0.0, 0.15, 0.3, 0.5, 0.75].into_iter().enumerate() {
            let material = metal(&mut glb, name, color, roughness);
            let mesh = glb.mesh(&format!("{name} {roughness}"), &round, material);
            let place = [column as f64 * 0.48 - 0.96, 0.2, 0.9 - 0.45 * row as f64];
            nodes.push(glb.place(name, mesh, place));
        }
    }

    let mirror = metal(&mut glb, "polished steel", [0.75, 0.75, 0.76], 0.05);
    let geometry = glb.geometry(&knot(2.0, 5.0, 0.5, 0.11, 20, 200).plain());
    let mesh = glb.mesh("knot", &geometry, mirror);
    nodes.push(glb.place("knot", mesh, [0.0, 0.0, -0.75]));

    let slate = glb.material(json!({
        "name": "slate",
        "pbrMetallicRoughness": { "baseColorFactor": [0.12, 0.13, 0.15, 1.0], "metallicFactor": 0, "roughnessFactor": 0.5 }
    }));
    let geometry = glb.geometry(&disc(1.6, 0.12, 0.03, 96).plain());
    let mesh = glb.mesh("plinth", &geometry, slate);
    nodes.push(glb.place("plinth", mesh, [0.0, -0.12, 0.0]));
    glb.finish(&nodes)
}
