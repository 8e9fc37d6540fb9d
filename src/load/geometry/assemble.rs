//! Faces -> meshes: one for each run of faces that share object, group and material.

use super::color::linear;
use super::pairs::Pairs;
use super::smoothing_groups::{Smooth, smooth};
use super::soup::{Corner, NONE, Soup};
use super::{Face, Geometry};
use crate::load::Polygons;
use crate::load::place::Placed;
use crate::math::ear_clip::{EarClipper, Outcome, newell};
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::scene::{Mesh, Polygon};
use rayon::prelude::*;
use std::borrow::Cow;

/// Number of faces per parallel task.
const FACES: usize = 1 << 12;

/// Meshes of a file, and statistics of its faces.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembled {
    /// Mesh without a material, and its index into [`Geometry::runs`], for each run that has anything to draw.
    pub meshes: Vec<(u32, Mesh)>,
    /// Number of faces drawn.
    pub faces: u64,
    /// Faces with a corner that is not finite: count, and the line of the first.
    pub not_finite: (u64, u32),
    /// Faces with fewer than three different corners: likewise.
    pub collapsed: (u64, u32),
    /// Faces that have fewer than three different corners only after rounding.
    pub rounded: (u64, u32),
    /// Faces whose boundary intersects itself.
    pub crossing: (u64, u32),
    /// Faces flipped to agree with their normals.
    pub turned: (u64, u32),
}

/// Builds the meshes. `flatness`: largest distance of a corner from the plane of a face that is kept whole.
pub(super) fn assemble(
    geometry: &Geometry,
    soup: &Soup,
    placed: &Placed,
    polygons: Polygons,
    flatness: f64,
) -> Assembled {
    let mut out = Assembled::default();
    let faces = keep(geometry, soup, &placed.positions, &mut out);
    let smooth = smooth(soup, &placed.positions, &faces);
    let flatness = (polygons == Polygons::Whole).then_some(flatness);
    let mut builder = Builder {
        soup,
        smooth: &smooth,
        positions: &placed.positions,
        flatness,
        vertices: Pairs::new(soup.positions.len()),
        clipper: EarClipper::default(),
        ring: Vec::new(),
        indices: Vec::new(),
        cut: Vec::new(),
        mesh: Mesh::default(),
    };
    for (run, faces) in by_run(&faces, geometry.runs.len()) {
        let mesh = builder.build(&faces, name(geometry, run), &mut out);
        if !mesh.triangles.is_empty() || !mesh.polygons.is_empty() {
            out.meshes.push((run, mesh));
        }
    }
    out
}

/// Whether all triangles can be drawn unchanged, on exactly these positions.
pub(super) fn stay_as_they_are(triangles: &[[u32; 3]], positions: &[Vec3]) -> bool {
    let is_wide = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| positions[i as usize]);
        a != b && b != c && c != a
    };
    // Positions that nothing uses are not finite.
    positions.par_iter().with_min_len(FACES).all(|p| p.is_finite())
        && triangles.par_iter().with_min_len(FACES).all(is_wide)
}

/// Mesh of [`Geometry::triangles`] that can be drawn unchanged.
pub(super) fn as_they_are(geometry: &mut Geometry, soup: &Soup, placed: &Placed) -> Assembled {
    let triangles = std::mem::take(&mut geometry.triangles);
    let faces = triangles.len() as u64;
    let (name, positions) = (name(geometry, 0), placed.positions.clone());
    let colors = colors(soup, (0..positions.len()).into_par_iter());
    let mesh = Mesh { name, positions, triangles, colors, ..Mesh::default() };
    Assembled { meshes: vec![(0, mesh)], faces, ..Assembled::default() }
}

/// Faces that can be drawn; not copied where all can, which is usual.
fn keep<'s>(geometry: &'s Geometry, soup: &Soup, positions: &[Vec3], out: &mut Assembled) -> Cow<'s, [Face]> {
    let corners = |face: &Face| soup.corners.get(face.corners()).unwrap_or_default();
    let place = |c: &Corner| positions[c.position as usize];
    let is_finite = |face: &Face| corners(face).iter().all(|c| place(c).is_finite());
    let is_wide = |face: &Face| has_three_places(corners(face).iter().map(place));
    let faces = &geometry.faces;
    if faces.par_iter().with_min_len(FACES).all(|face| is_finite(face) && is_wide(face)) {
        return Cow::Borrowed(faces);
    }
    let can_be_drawn = |face: &&Face| {
        let (is_finite, is_wide) = (is_finite(face), is_wide(face));
        if !is_finite {
            count(&mut out.not_finite, face);
        } else if !is_wide && has_three_places(corners(face).iter().map(|c| soup.positions[c.position as usize])) {
            count(&mut out.rounded, face);
        } else if !is_wide {
            count(&mut out.collapsed, face);
        }
        is_finite && is_wide
    };
    Cow::Owned(faces.iter().filter(can_be_drawn).copied().collect())
}

fn has_three_places<P: Copy + PartialEq>(mut places: impl Iterator<Item = P>) -> bool {
    let Some(a) = places.next() else { return false };
    let Some(b) = places.find(|&p| p != a) else { return false };
    places.any(|p| p != a && p != b)
}

fn count((number, line): &mut (u64, u32), face: &Face) {
    if *number == 0 {
        *line = face.line;
    }
    *number += 1;
}

/// Groups faces by run, in the file's order within each.
fn by_run(faces: &[Face], runs: usize) -> Vec<(u32, Cow<'_, [Face]>)> {
    if runs == 1 {
        return vec![(0, Cow::Borrowed(faces))];
    }
    let mut sizes = vec![0usize; runs];
    faces.iter().for_each(|face| sizes[face.run as usize] += 1);
    let mut lists: Vec<Vec<Face>> = sizes.into_iter().map(Vec::with_capacity).collect();
    faces.iter().for_each(|face| lists[face.run as usize].push(*face));
    (0..).zip(lists.into_iter().map(Cow::Owned)).collect()
}

/// `object/group`, or the one of them that is set.
pub(super) fn name(geometry: &Geometry, run: u32) -> String {
    let run = geometry.runs[run as usize];
    let name = |id: u32| geometry.names[id as usize].as_str();
    match (name(run.object), name(run.group)) {
        (object, "") => object.into(),
        ("", group) => group.into(),
        (object, group) if object == group => object.into(),
        (object, group) => format!("{object}/{group}"),
    }
}

/// Attributes that distinguish vertices of one position: texture coordinate and normal, each an index or [`NONE`].
pub(super) type Key = (u32, u32);

struct Builder<'a> {
    soup: &'a Soup,
    smooth: &'a Smooth,
    positions: &'a [Vec3],
    /// Set when planar polygons stay whole.
    flatness: Option<f64>,
    vertices: Pairs<Key>,
    clipper: EarClipper,
    /// Corners of the current face: positions, vertices of the mesh, and the triangles it is cut into.
    ring: Vec<DVec3>,
    indices: Vec<u32>,
    cut: Vec<[u32; 3]>,
    mesh: Mesh,
}

impl Builder<'_> {
    fn build(&mut self, faces: &[Face], name: String, out: &mut Assembled) -> Mesh {
        self.mesh = Mesh { name, ..Mesh::default() };
        self.vertices.clear();
        let has_normals = !(self.soup.normals.is_empty() && self.smooth.of_corner.is_empty());
        let is_shaded = |face: &Face| face.corners().any(|at| self.normal_number(at) != NONE);
        let shaded = has_normals && faces.iter().any(is_shaded);
        for face in faces {
            self.face(face, shaded, out);
        }
        self.fill(faces, shaded);
        // Triangle i is face i: the table is redundant.
        if self.mesh.face_of_triangle.iter().zip(0..).all(|(&face, i)| face == i) {
            self.mesh.face_of_triangle.clear();
        }
        std::mem::take(&mut self.mesh)
    }

    /// Index of a corner's normal: the file's come first, then those of smoothing groups.
    fn normal_number(&self, at: usize) -> u32 {
        match (self.soup.corners[at].normal, self.smooth.of_corner.get(at)) {
            (NONE, Some(&smooth)) if smooth != NONE => self.first_smooth() + smooth,
            (normal, _) => normal,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "numbers of normals were checked to fit when read")]
    fn first_smooth(&self) -> u32 {
        self.soup.normals.len() as u32
    }

    #[expect(clippy::cast_possible_truncation, reason = "numbers of normals were checked to fit when read")]
    fn first_flat(&self) -> u32 {
        self.first_smooth() + self.smooth.normals.len() as u32
    }

    fn face(&mut self, face: &Face, shaded: bool, out: &mut Assembled) {
        self.ring.clear();
        self.indices.clear();
        // Positions of a triangle are needed only to compare it with its normals.
        let needs_places = face.arity > 3 || !self.soup.normals.is_empty();
        for at in face.corners() {
            let Corner { position, uv, .. } = self.soup.corners[at];
            let normal = match self.normal_number(at) {
                // A flat face among shaded ones carries its own normal.
                NONE if shaded => self.first_flat() + face.number,
                normal => normal,
            };
            if needs_places {
                self.ring.push(self.positions[position as usize].as_dvec3());
            }
            self.indices.push(self.vertices.number(position, (uv, normal)));
        }
        if self.turn_to_normals(face) {
            count(&mut out.turned, face);
        }
        if self.flatness.is_some_and(|flatness| Polygons::Whole.keeps(self.ring.len()) && is_flat(&self.ring, flatness))
        {
            self.keep_whole(face.number);
            out.faces += 1;
            return;
        }

        if let [a, b, c] = self.indices[..] {
            // Nothing to cut, and faces with equal corners were dropped.
            self.mesh.triangles.push([a, b, c]);
            self.mesh.face_of_triangle.push(face.number);
            out.faces += 1;
            return;
        }
        self.cut.clear();
        if self.clipper.cut(&self.ring, &mut self.cut) == Outcome::Crossing {
            count(&mut out.crossing, face);
        }
        if self.cut.is_empty() {
            return count(&mut out.collapsed, face);
        }
        let vertex = |i: u32| self.indices[i as usize];
        self.mesh.triangles.extend(self.cut.iter().map(|t| t.map(vertex)));
        self.mesh.face_of_triangle.extend(self.cut.iter().map(|_| face.number));
        out.faces += 1;
    }

    /// Reverses the face when the normals of the file point to its back.
    ///
    /// The front decides on which side of glass a ray is; where winding and normals disagree,
    /// the author of the file has looked at the normals.
    fn turn_to_normals(&mut self, face: &Face) -> bool {
        if self.soup.normals.is_empty() {
            return false;
        }
        let given = |at: usize| match self.soup.corners[at].normal {
            NONE => DVec3::ZERO,
            normal => self.soup.normals[normal as usize].as_dvec3(),
        };
        let sum: DVec3 = face.corners().map(given).sum();
        let wrong = sum != DVec3::ZERO && newell(&self.ring).dot(sum) < 0.0;
        if wrong {
            self.ring.reverse();
            self.indices.reverse();
        }
        wrong
    }

    #[expect(clippy::cast_possible_truncation, reason = "corners were checked to fit when read")]
    fn keep_whole(&mut self, face: u32) {
        let first = self.mesh.polygon_corners.len() as u32;
        let before = |i: usize| self.ring[(i + self.ring.len() - 1) % self.ring.len()];
        let distinct = (0..self.ring.len()).filter(|&i| self.ring[i] != before(i));
        self.mesh.polygon_corners.extend(distinct.map(|i| self.indices[i]));
        let len = self.mesh.polygon_corners.len() as u32 - first;
        self.mesh.polygons.push(Polygon { first, len, face });
    }

    /// Fills the vertex arrays of the mesh.
    fn fill(&mut self, faces: &[Face], shaded: bool) {
        fill_vertices(&mut self.mesh, &self.vertices, self.soup, self.positions);
        if shaded {
            self.fill_normals(faces);
        }
    }

    fn fill_normals(&mut self, faces: &[Face]) {
        let (first_smooth, first_flat) = (self.first_smooth(), self.first_flat());
        let mut normals: Vec<Vec3> = Vec::with_capacity(self.vertices.len());
        for (_, (_, number)) in self.vertices.iter() {
            normals.push(if number < first_smooth {
                self.soup.normals[number as usize]
            } else if number < first_flat {
                self.smooth.normals[(number - first_smooth) as usize]
            } else {
                self.flat_normal(faces, number - first_flat)
            });
        }
        self.mesh.normals = normals;
    }

    /// Normal of a face of this mesh; +z for a face without area, which is never seen.
    fn flat_normal(&self, faces: &[Face], number: u32) -> Vec3 {
        let Ok(i) = faces.binary_search_by_key(&number, |f| f.number) else { return Vec3::Z };
        let place = |c: &Corner| self.positions[c.position as usize].as_dvec3();
        let ring: Vec<DVec3> = self.soup.corners[faces[i].corners()].iter().map(place).collect();
        newell(&ring).try_normalize().unwrap_or(DVec3::Z).as_vec3()
    }
}

/// Fills the positions, texture coordinates and colours of a mesh's vertices.
pub(super) fn fill_vertices(mesh: &mut Mesh, vertices: &Pairs<Key>, soup: &Soup, positions: &[Vec3]) {
    mesh.positions = vertices.iter().map(|(p, _)| positions[p as usize]).collect();
    if vertices.iter().any(|(_, (uv, _))| uv != NONE) {
        // v points up in OBJ and down in our scenes.
        let uv = |(_, (uv, _)): (u32, Key)| match soup.uvs.get(uv as usize) {
            Some(uv) => crate::math::DVec2::new(uv.x, 1.0 - uv.y).as_vec2(),
            None => Vec2::ZERO,
        };
        mesh.uvs = vec![vertices.iter().map(uv).collect()];
    }
    let positions: Vec<u32> = vertices.iter().map(|(p, _)| p).collect();
    mesh.colors = colors(soup, positions.par_iter().map(|&p| p as usize));
}

/// Colours of the vertices at these positions; empty where all are white and opaque.
pub(super) fn colors(soup: &Soup, positions: impl IndexedParallelIterator<Item = usize> + Clone) -> Vec<Vec4> {
    let positions = positions.with_min_len(FACES);
    let is_colored = positions.clone().any(|p| soup.colors.get(p).is_some_and(|&c| c != [1.0; 3]));
    if !is_colored && soup.alphas.is_empty() {
        return Vec::new();
    }
    let light = |p: usize| if is_colored { linear(soup.colors[p]) } else { Vec4::ONE };
    let color = |p: usize| light(p).truncate().extend(soup.alphas.get(p).copied().unwrap_or(1.0));
    positions.map(color).collect()
}

/// Whether all corners lie within `flatness` of the plane through their mean.
fn is_flat(ring: &[DVec3], flatness: f64) -> bool {
    let Some(normal) = newell(ring).try_normalize() else { return false };
    #[expect(clippy::cast_precision_loss, reason = "corners of one face")]
    let mean = ring.iter().sum::<DVec3>() / ring.len() as f64;
    ring.iter().all(|&p| (p - mean).dot(normal).abs() <= flatness)
}

/// Largest distance of the corners of a planar face from its plane: half a unit of the file's last digit, or four units of
/// rounding of the largest coordinate, whichever is larger.
///
/// Digits so coarse that half a unit would bend a face visibly (over 2⁻¹² of the model's size) were not rounded but
/// typed: such coordinates are exact.
pub(super) fn flatness(positions: &[Vec3], places: i32) -> f64 {
    let finite = positions.iter().filter(|p| p.is_finite());
    let largest = f64::from(finite.fold(0.0f32, |m, p| m.max(p.abs().max_element())));
    let digit = 0.5 * libm::exp10(-f64::from(places));
    let rounding = 4.0 * f64::from(f32::EPSILON) / 2.0 * largest;
    if digit <= 2.0 * largest / 4096.0 { digit.max(rounding) } else { rounding }
}
