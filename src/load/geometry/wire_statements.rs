//! Points and lines -> input of `load::wires`: one part for each run of geometry that shares object, group and material.

use super::assemble::{Key, colors, fill_vertices, name};
use super::pairs::Pairs;
use super::soup::{Corner, NONE, Soup};
use super::{Geometry, WireStatement};
use crate::load::place::Placed;
use crate::load::wires::Wires;
use crate::math::{DVec3, Vec3};
use crate::scene::Mesh;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Points and lines of each of [`Geometry::runs`] that has any, with the index of the run.
pub(super) fn assemble(geometry: &Geometry, soup: &Soup, placed: &Placed) -> Vec<(u32, Wires)> {
    if geometry.is_cloud && !soup.positions.is_empty() {
        return vec![(0, cloud(geometry, soup, placed))];
    }
    let mut of_run: BTreeMap<u32, Vec<(WireStatement, &[Corner])>> = BTreeMap::new();
    let mut rest = soup.wire_corners.as_slice();
    for wire in &geometry.wire_statements {
        let (corners, after) = rest.split_at(wire.arity as usize);
        rest = after;
        of_run.entry(wire.run).or_default().push((*wire, corners));
    }
    if of_run.is_empty() {
        return Vec::new();
    }
    let mut vertices = Pairs::new(soup.positions.len());
    let mut build = |(run, wire_statements): (u32, Vec<(WireStatement, &[Corner])>)| {
        vertices.clear();
        let mut wires = wires(&wire_statements, soup, placed, &mut vertices);
        wires.mesh.name = name(geometry, run);
        (run, wires)
    };
    of_run.into_iter().map(&mut build).collect()
}

/// Makes all vertices points.
fn cloud(geometry: &Geometry, soup: &Soup, placed: &Placed) -> Wires {
    let positions = placed.positions.clone();
    let normals = if soup.normals.len() == positions.len() { normals(soup.normals.clone()) } else { Vec::new() };
    let colors = colors(soup, (0..positions.len()).into_par_iter());
    #[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 vertices")]
    let ends = (0..positions.len() as u32).map(|i| [i; 2]).collect();
    Wires { mesh: Mesh { name: name(geometry, 0), positions, normals, colors, ..Mesh::default() }, ends }
}

/// Normals of points, where most have one; the others, left out by some scanners, get the mean. Empty otherwise.
fn normals(mut normals: Vec<Vec3>) -> Vec<Vec3> {
    let said = || normals.iter().filter(|normal| **normal != Vec3::ZERO);
    let count = said().count();
    if 2 * count <= normals.len() {
        return Vec::new();
    }
    if count < normals.len() {
        let mean = said().map(|normal| normal.as_dvec3()).sum::<DVec3>().try_normalize().unwrap_or(DVec3::Y).as_vec3();
        normals.iter_mut().filter(|normal| **normal == Vec3::ZERO).for_each(|normal| *normal = mean);
    }
    normals
}

fn wires(
    wire_statements: &[(WireStatement, &[Corner])],
    soup: &Soup,
    placed: &Placed,
    vertices: &mut Pairs<Key>,
) -> Wires {
    let mut ends = Vec::new();
    let mut numbers = Vec::new();
    for (wire, corners) in wire_statements {
        numbers.clear();
        numbers.extend(corners.iter().map(|c| vertices.number(c.position, (c.uv, c.normal))));
        if wire.joined {
            ends.extend(numbers.windows(2).map(|pair| [pair[0], pair[1]]));
        } else {
            ends.extend(numbers.iter().map(|&number| [number; 2]));
        }
    }
    let mut mesh = Mesh::default();
    fill_vertices(&mut mesh, vertices, soup, &placed.positions);
    // Lit only where every end has a normal.
    if vertices.iter().all(|(_, (_, normal))| normal != NONE) {
        let normal = |(_, (_, normal)): (u32, Key)| soup.normals.get(normal as usize).copied().unwrap_or(Vec3::Z);
        mesh.normals = vertices.iter().map(normal).collect();
    }
    Wires { mesh, ends }
}
