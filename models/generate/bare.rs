//! Shapes without materials: a gear as STL, a football as PLY.

use libm::{atan2, cos, sin, sqrt};
use meshray::math::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A gear of 12 teeth with a round hole, as it would be printed: flat on the xy plane. Binary STL.
pub(crate) fn gear() -> Vec<u8> {
    const TEETH: u32 = 12;
    const POINTS: u32 = 4 * TEETH;
    // Foot, rise, tip, fall of a tooth, millimetres.
    let rim = |i: u32| {
        let angle = TAU * (f64::from(i) + [0.1, 0.0, -0.1, -0.2][i as usize % 4]) / f64::from(POINTS);
        DVec2::new(cos(angle), sin(angle)) * [16.0, 20.0, 20.0, 16.0][i as usize % 4]
    };
    let hole = |i: u32| {
        let angle = TAU * f64::from(i) / f64::from(POINTS);
        DVec2::new(cos(angle), sin(angle)) * 7.0
    };
    let mut triangles = Vec::new();
    let mut quad = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| triangles.extend([[a, b, c], [a, c, d]]);
    for i in 0..POINTS {
        let j = (i + 1) % POINTS;
        let [low, high] = [0.0, 8.0].map(|z| move |p: DVec2| p.extend(z));
        quad(high(hole(i)), high(rim(i)), high(rim(j)), high(hole(j)));
        quad(low(hole(j)), low(rim(j)), low(rim(i)), low(hole(i)));
        quad(low(rim(i)), low(rim(j)), high(rim(j)), high(rim(i)));
        quad(low(hole(j)), low(hole(i)), high(hole(i)), high(hole(j)));
    }
    let mut out = b"gear of 12 teeth, millimetres".to_vec();
    out.resize(80, b' ');
    out.extend((triangles.len() as u32).to_le_bytes());
    for [a, b, c] in triangles {
        let normal = (b - a).cross(c - a).normalize();
        let numbers = [normal, a, b, c].map(|p| p.as_vec3().to_array());
        out.extend(numbers.iter().flatten().flat_map(|x| x.to_le_bytes()));
        out.extend([0, 0]);
    }
    out
}

/// A football: an icosahedron whose corners are cut off, 12 pentagons and 20 hexagons, coloured by direction. PLY as text.
pub(crate) fn football() -> Vec<u8> {
    let golden = (1.0 + sqrt(5.0)) / 2.0;
    let mut tips = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        tips.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Neighbours of each tip, counter-clockwise seen from outside; edges of the icosahedron are 2 long.
    let around = |tip: usize| {
        let axis = tips[tip].normalize();
        let side = axis.any_orthonormal_vector();
        let angle = |&i: &usize| atan2(tips[i].dot(axis.cross(side)), tips[i].dot(side));
        let mut near: Vec<usize> = (0..12).filter(|&i| (tips[i].distance(tips[tip]) - 2.0).abs() < 1e-9).collect();
        near.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        near
    };
    let mut edges: Vec<(usize, usize)> = Vec::new();
    for tip in 0..12 {
        edges.extend(around(tip).into_iter().map(|near| (tip, near)));
    }
    let number = |from: usize, to: usize| edges.iter().position(|e| *e == (from, to)).unwrap_or_default();
    let mut faces: Vec<Vec<usize>> = Vec::new();
    for tip in 0..12 {
        let near = around(tip);
        faces.push(near.iter().map(|&to| number(tip, to)).collect());
        for (k, &b) in near.iter().enumerate() {
            let c = near[(k + 1) % near.len()];
            if tip < b && tip < c {
                let corners = [(tip, b), (b, tip), (b, c), (c, b), (c, tip), (tip, c)];
                faces.push(corners.map(|(from, to)| number(from, to)).to_vec());
            }
        }
    }

    let mut out = format!(
        "ply\nformat ascii 1.0\ncomment a football, coloured by direction\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        edges.len(),
        faces.len()
    );
    for &(from, to) in &edges {
        let place = (tips[from] * 2.0 + tips[to]) / 3.0;
        let [red, green, blue] = (place.normalize() * 110.0 + 135.0).to_array().map(|c| c as u8);
        out += &format!("{:.6} {:.6} {:.6} {red} {green} {blue}\n", place.x, place.y, place.z);
    }
    for face in faces {
        out += &face.len().to_string();
        out.extend(face.iter().map(|i| format!(" {i}")));
        out.push('\n');
    }
    out.into_bytes()
}
