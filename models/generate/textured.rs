//! Every map of the metallic-roughness model, wrap modes, mask and blend, on a crate, a tile, a leaf and a pane.

use crate::glb::Glb;
use crate::picture::{clouds, jpeg, mix, normal_map, png, png_with_alpha, repeating, smooth};
use crate::shape::{block, panel};
use libm::{cos, sin};
use meshray::math::DVec3;
use serde_json::json;
use std::f64::consts::TAU;

pub(crate) fn model() -> Vec<u8> {
    let mut glb = Glb::default();
    let nodes = [floor(&mut glb), wooden_crate(&mut glb), leaf(&mut glb), pane(&mut glb)];
    glb.finish(&nodes)
}

/// A tile whose picture of one quarter is completed by mirrored repeats, moved and scaled by KHR_texture_transform.
fn floor(glb: &mut Glb) -> usize {
    let bytes = png(128, 128, |u, v| {
        let distance = (u * u + v * v).sqrt();
        let rings = smooth(0.70, 0.71, distance) * smooth(0.81, 0.80, distance) + smooth(0.33, 0.32, distance);
        mix([0.85, 0.82, 0.76], [0.22, 0.30, 0.42], rings)
    });
    let mirrored = json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": 33648, "wrapT": 33648 });
    let texture = glb.texture("image/png", &bytes, mirrored);
    glb.declare("KHR_texture_transform");
    let material = glb.material(json!({
        "name": "tile",
        "pbrMetallicRoughness": {
            "baseColorTexture": {
                "index": texture,
                "extensions": { "KHR_texture_transform": { "offset": [1.0, 1.0], "scale": [8.0, 8.0] } }
            },
            "metallicFactor": 0, "roughnessFactor": 0.3
        }
    }));
    let geometry = glb.geometry(&block(DVec3::new(1.6, 0.05, 1.3)).mapped_from_above(2.6));
    let mesh = glb.mesh("tile", &geometry, material);
    glb.place("tile", mesh, [0.0, -0.05, 0.0])
}

/// Where the boards and iron corners of the crate are: (distance from the rim, whether a gap between boards).
fn boards(u: f64, v: f64) -> (f64, f64) {
    let rim = u.min(v).min(1.0 - u).min(1.0 - v);
    let board = (v * 5.0 - (v * 5.0).floor() - 0.5).abs();
    let gap = smooth(0.46, 0.49, board) * smooth(0.12, 0.13, rim);
    (rim, gap)
}

/// Whether there is iron: the four corners.
fn iron(u: f64, v: f64) -> f64 {
    let corner = u.min(1.0 - u) + v.min(1.0 - v);
    smooth(0.235, 0.23, corner)
}

fn wooden_crate(glb: &mut Glb) -> usize {
    let color = jpeg(256, 256, |u, v| {
        let (rim, gap) = boards(u, v);
        let along = if rim < 0.125 && u.min(1.0 - u) < v.min(1.0 - v) { (v, u) } else { (u, v) };
        let grain =
            0.5 + 0.5 * sin(60.0 * (along.1 + 0.05 * clouds(along.0, along.1, 3.0, 4)) + 8.0 * clouds(u, v, 5.0, 3));
        let wood = mix([0.44, 0.29, 0.16], [0.68, 0.49, 0.30], grain);
        let frame = smooth(0.128, 0.120, rim);
        let wood = mix(wood, mix([0.35, 0.22, 0.12], [0.5, 0.34, 0.2], grain), frame);
        let rust = 0.5 + 2.0 * clouds(u, v, 9.0, 4);
        mix(mix(wood, [0.06, 0.04, 0.02], gap), mix([0.55, 0.55, 0.57], [0.45, 0.30, 0.22], rust), iron(u, v))
    });
    // Occlusion in red, roughness in green, metal in blue: one picture for two slots.
    let orm = png(128, 128, |u, v| {
        let (rim, gap) = boards(u, v);
        let occlusion = 1.0 - 0.7 * gap - 0.4 * smooth(0.14, 0.125, rim) * smooth(0.115, 0.125, rim);
        [occlusion, 0.75 - 0.45 * iron(u, v), iron(u, v)]
    });
    let bumps = normal_map(256, 0.012, |u, v| {
        let (rim, gap) = boards(u, v);
        smooth(0.13, 0.12, rim) * 0.8 - gap + iron(u, v) * 0.4 + 0.06 * cos(TAU * 40.0 * v)
    });
    let [color, orm, bumps] = [("image/jpeg", color), ("image/png", orm), ("image/png", bumps)]
        .map(|(kind, bytes)| glb.texture(kind, &bytes, repeating()));
    let material = glb.material(json!({
        "name": "crate",
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": color }, "metallicRoughnessTexture": { "index": orm }
        },
        "normalTexture": { "index": bumps, "scale": 1.0 },
        "occlusionTexture": { "index": orm, "strength": 0.9 }
    }));
    let geometry = glb.geometry(&block(DVec3::splat(0.5)));
    let mesh = glb.mesh("crate", &geometry, material);
    glb.node(json!({
        "name": "crate", "mesh": mesh, "translation": [-0.45, 0.5, -0.3],
        "rotation": [0.0, sin(0.18), 0.0, cos(0.18)]
    }))
}

/// A leaf cut out of a card by its alpha, seen from both sides.
fn leaf(glb: &mut Glb) -> usize {
    let bytes = png_with_alpha(128, 128, |u, v| {
        let (x, y) = (2.0 * u - 1.0, 1.0 - v);
        let half = 0.62 * sin((y * 3.2).min(3.1)).max(0.0) * (1.0 + 0.12 * sin(40.0 * y));
        let inside = smooth(half + 0.015, half - 0.015, x.abs()).max(smooth(0.03, 0.02, x.abs()));
        let vein = smooth(0.10, 0.02, (sin(22.0 * (y - 0.45 * x.abs()))).abs()) + smooth(0.035, 0.02, x.abs());
        let [r, g, b] = mix([0.20, 0.46, 0.13], [0.66, 0.76, 0.36], vein);
        [r, g, b, inside]
    });
    let clamped = json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 });
    let texture = glb.texture("image/png", &bytes, clamped);
    let material = glb.material(json!({
        "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": texture }, "metallicFactor": 0, "roughnessFactor": 0.6
        }
    }));
    let geometry = glb.geometry(&panel(0.5, 0.5));
    let mesh = glb.mesh("leaf", &geometry, material);
    glb.node(json!({
        "name": "leaf", "mesh": mesh, "translation": [0.75, 0.5, -0.25],
        "rotation": [0.0, sin(-0.2), 0.0, cos(-0.2)]
    }))
}

/// A coloured pane, half clear, with a glowing frame.
fn pane(glb: &mut Glb) -> usize {
    let frame = |u: f64, v: f64| smooth(0.06, 0.05, u.min(v).min(1.0 - u).min(1.0 - v));
    let color = png_with_alpha(128, 128, |u, v| {
        let quarter = if (u < 0.5) == (v < 0.5) { [0.90, 0.35, 0.20] } else { [0.20, 0.45, 0.90] };
        let [r, g, b] = mix(quarter, [0.1, 0.1, 0.1], frame(u, v));
        [r, g, b, 0.45 + 0.55 * frame(u, v)]
    });
    let glow = png(64, 64, |u, v| mix([0.0; 3], [1.0, 0.75, 0.35], frame(u, v)));
    let color = glb.texture("image/png", &color, repeating());
    let glow = glb.texture("image/png", &glow, repeating());
    let material = glb.material(json!({
        "name": "pane", "alphaMode": "BLEND", "doubleSided": true,
        "emissiveFactor": [1.0, 1.0, 1.0], "emissiveTexture": { "index": glow },
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": color }, "metallicFactor": 0, "roughnessFactor": 0.1
        }
    }));
    let geometry = glb.geometry(&panel(0.42, 0.42));
    let mesh = glb.mesh("pane", &geometry, material);
    glb.place("pane", mesh, [0.35, 0.42, 0.65])
}
