//! Points and lines -> thin solids, since rays meet only what has an extent.
//!
//! Formats give points and lines no width; programs that draw them in pixels choose one. Here they have a width in the
//! world, so that they stand in perspective, hide and are hidden, and are hit like every other triangle: 1/256 of the
//! diagonal of the box around everything in the file (but for a few points far away), or less where there are so many that
//! they would run together (`Widths`). A point becomes an octahedron, or a tetrahedron where it is one of a crowd; a
//! line a prism of three sides, half a width longer at each end, so that joints are closed.
//!
//! Where vertices have no normals nothing says how light meets a line: such ones are drawn without light, in their base
//! colour plus emission, as the glTF 2.0 specification recommends (§3.9.6). Where they have, they are lit by these: points
//! are squares then, lines low roofs, whose faces look where the normals do. They are never of glass: they have no inside,
//! and light that goes through thousands of them has no end. Whatever their places do (scale, shear, mirror), widths are
//! those of the world: solids are made there, once for all places that differ by a shift alone.

mod bake;
mod solid;
#[cfg(test)]
mod tests;

use super::limits::{Budget, OverBudget};
use super::place::bounds_of;
use super::{Diagnostic, Facts};
use crate::math::frame::{half_of, stride};
use crate::math::{DAffine3, DMat3, DVec3, Vec3};
use crate::scene::{Instance, Material, Mesh, Reflection, Scene};
use bake::Baked;
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;

/// Points and lines that share a material, before they have a width.
#[derive(Clone, Debug, Default)]
pub(super) struct Wires {
    /// Their vertices and material; no faces.
    pub mesh: Mesh,
    /// The vertices at both ends of each line; the same one twice for a point.
    pub ends: Vec<[u32; 2]>,
}

impl Wires {
    /// How many points and how many lines.
    fn count(&self) -> [u64; 2] {
        let points = self.ends.iter().filter(|[a, b]| a == b).count() as u64;
        [points, self.ends.len() as u64 - points]
    }

    fn is_lit(&self) -> bool {
        !self.mesh.normals.is_empty()
    }
}

/// Points and lines of a file, and how they are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WireFacts {
    /// Points.
    pub points: u64,
    /// Lines; those of a strip one by one.
    pub lines: u64,
    /// Width of the points, world units; 0 without points.
    pub point_width: f64,
    /// Width of the lines, world units; 0 without lines.
    pub line_width: f64,
}

impl WireFacts {
    /// Width of the narrower ones, world units; `None` where there are neither.
    pub fn narrowest(&self) -> Option<f64> {
        [self.point_width, self.line_width].into_iter().filter(|&width| width > 0.0).reduce(f64::min)
    }

    /// Adds those of another file; the larger width is told.
    pub fn append(&mut self, more: &Self) {
        self.points += more.points;
        self.lines += more.lines;
        self.point_width = self.point_width.max(more.point_width);
        self.line_width = self.line_width.max(more.line_width);
    }
}

/// Parts of the diagonal that points and lines are wide at most.
const PARTS: f64 = 256.0;

/// So many points, or lines, are a crowd: they get as few triangles as a solid can have.
const CROWD: u64 = 1 << 16;

/// How wide points and lines are, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Widths {
    point: f64,
    line: f64,
    /// Whether there is a crowd of points.
    crowd: bool,
}

impl Widths {
    /// For so many points and lines in a box with this diagonal.
    ///
    /// N points spread over a surface as large as the box are about diagonal / √N apart: wider ones would run together.
    /// Lines are kept to a quarter of that, so that a mesh of wires shows what lies behind. `asked` goes before all that.
    #[expect(clippy::cast_precision_loss, reason = "counts of what is in memory")]
    fn new([points, lines]: [u64; 2], diagonal: f64, asked: Option<[f64; 2]>) -> Self {
        // A single place has no size: any will do, since the camera is framed on what is drawn.
        let diagonal = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { PARTS };
        let point = diagonal / (points as f64).sqrt().max(PARTS);
        let line = diagonal / (4.0 * (lines as f64).sqrt()).max(PARTS);
        let [point, line] = asked.unwrap_or([point, line]);
        Self { point, line, crowd: points >= CROWD }
    }
}

/// Puts points and lines into the scene as solids; `places` are instances whose `mesh` counts `wires`.
///
/// Meshes are in place before: the width goes by the box around all of it. Points and lines with an end that is not finite,
/// or so far away that rounding leaves nothing of their width, are left out and counted in `facts`; a warning is returned
/// of them, and one of glass. `widths` of points and lines are those that were asked for.
///
/// # Errors
/// When the solids would take more than is left of `budget`.
pub(super) fn draw(
    wires: &[Wires],
    places: &[Instance],
    scene: &mut Scene,
    budget: &mut Budget,
    facts: &mut Facts,
    file: &Path,
    widths: Option<[f64; 2]>,
) -> Result<Vec<Diagnostic>, OverBudget> {
    if wires.is_empty() {
        return Ok(Vec::new());
    }
    let counts: Vec<[u64; 2]> = wires.iter().map(Wires::count).collect();
    let placed = places.iter().filter_map(|place| counts.get(place.mesh as usize));
    let count = placed.fold([0, 0], |[p, l], [q, m]| [p + q, l + m]);
    let widths = Widths::new(count, diagonal(wires, places, scene), widths);
    let mut drawing = Drawing { scene, budget, widths, materials: HashMap::new(), dropped: 0, of_glass: 0 };
    // Of all, in their order: the same materials at every moment of an animation, whatever it hides.
    wires.iter().for_each(|of| _ = drawing.material(of));
    let mut known: HashMap<(u32, [u64; 9]), Vec<Part>> = HashMap::new();
    for place in places {
        let Some(of) = wires.get(place.mesh as usize) else { continue };
        let linear = place.world_from_object.matrix3;
        let key = (place.mesh, linear.to_cols_array().map(f64::to_bits));
        let parts = match known.get(&key) {
            Some(parts) => parts,
            None => {
                let parts = drawing.bake(of, linear)?;
                known.entry(key).or_insert(parts)
            }
        };
        drawing.place(place, parts);
    }

    let (dropped, of_glass) = (drawing.dropped, drawing.of_glass);
    let [points, lines] = counts.iter().fold([0, 0], |[p, l], [q, m]| [p + q, l + m]);
    let or_none = |count: u64, width: f64| if count > 0 { width } else { 0.0 };
    let (point_width, line_width) = (or_none(points, widths.point), or_none(lines, widths.line));
    facts.wires = WireFacts { points, lines, point_width, line_width };
    if dropped > 0 {
        facts.dropped.push((NOT_FINITE.into(), dropped));
    }
    Ok(told(file, dropped, of_glass))
}

/// Why points and lines are left out.
const NOT_FINITE: &str = "a point or line with an end that is not finite or too far away to have a width";

/// Warnings of so many points and lines that are left out, and so many materials that are not drawn as they are.
fn told(file: &Path, dropped: u64, of_glass: u64) -> Vec<Diagnostic> {
    let kinds = [
        ("line-not-finite", format!("{NOT_FINITE} is left out"), dropped),
        ("line-of-glass", "a material that light passes is drawn solid on points and lines".into(), of_glass),
    ];
    let met = kinds.into_iter().filter(|(.., count)| *count > 0);
    met.map(|(code, text, count)| {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        Diagnostic { count, ..Diagnostic::new(code, file, "", text) }
    })
    .collect()
}

/// The number of a mesh of solids, and its place around that of the wires.
type Part = (u32, DVec3);

/// What solids are put into.
struct Drawing<'a> {
    scene: &'a mut Scene,
    budget: &'a mut Budget,
    widths: Widths,
    /// The material that wires show, by that of the file and whether they are lit.
    materials: HashMap<(u32, bool), u32>,
    dropped: u64,
    /// Materials that are drawn solid.
    of_glass: u64,
}

impl Drawing<'_> {
    /// Makes the solids of wires that are turned and stretched by `linear`: meshes, and where they stand.
    fn bake(&mut self, wires: &Wires, linear: DMat3) -> Result<Vec<Part>, OverBudget> {
        let [kept, held] = bake::cost(wires, &self.widths);
        self.budget.take(kept, 1)?;
        self.budget.clone().take(held, 1)?;
        let material = self.material(wires);
        let Baked { meshes, center, dropped } = bake::bake(wires, linear, &self.widths);
        self.dropped += dropped;
        let mut parts = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            // Checked by the budget: each mesh takes hundreds of bytes.
            #[expect(clippy::cast_possible_truncation, reason = "scenes have fewer than 2^32 meshes")]
            parts.push((self.scene.meshes.len() as u32, center));
            self.scene.meshes.push(Mesh { material, is_wire: true, ..mesh });
        }
        Ok(parts)
    }

    fn place(&mut self, place: &Instance, parts: &[Part]) {
        for &(mesh, center) in parts {
            let world_from_object = DAffine3::from_translation(place.world_from_object.translation + center);
            self.scene.instances.push(Instance { name: place.name.clone(), mesh, world_from_object });
        }
    }

    /// What the wires show of their material: both sides where they are flat, no light where they have no normals, never
    /// glass.
    fn material(&mut self, wires: &Wires) -> u32 {
        let (from, is_lit) = (wires.mesh.material, wires.is_lit());
        if let Some(&known) = self.materials.get(&(from, is_lit)) {
            return known;
        }
        let Some(material) = self.scene.materials.get(from as usize) else { return from };
        let is_glass = material.reflection.transmits();
        if is_lit && material.double_sided && !is_glass {
            return from;
        }
        let material = if is_lit { lit(material) } else { unlit(material) };
        self.of_glass += u64::from(is_lit && is_glass);
        #[expect(clippy::cast_possible_truncation, reason = "there are fewer materials than meshes")]
        let index = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        self.materials.insert((from, is_lit), index);
        index
    }
}

/// A material as wires with normals show it.
fn lit(material: &Material) -> Material {
    let reflection = material.reflection.clone().without_transmission();
    Material { double_sided: true, reflection, ..material.clone() }
}

/// A material as wires without normals show it.
fn unlit(material: &Material) -> Material {
    Material {
        double_sided: false,
        normal_map: None,
        bump_map: None,
        occlusion_map: None,
        reflection: Reflection::Unlit,
        ..material.clone()
    }
}

/// How many times as large as the room of half of the points a box may be whose diagonal tells how wide they are: spread
/// evenly over it, they make it twice as large.
const STRAY: f64 = 16.0;

/// Diagonal of the box around all meshes and wires where they stand, or twice that of the room of half of their points where
/// others are far away, as returns of a scanner from nowhere are; not positive where there is nothing.
fn diagonal(wires: &[Wires], places: &[Instance], scene: &Scene) -> f64 {
    let of_wires = || places.iter().filter_map(|place| Some((place, &wires.get(place.mesh as usize)?.mesh)));
    let of_meshes = || scene.instances.iter().filter_map(|place| Some((place, scene.meshes.get(place.mesh as usize)?)));
    let place_of = |place: &Instance, p: &Vec3| place.world_from_object.transform_point3(p.as_dvec3());
    let boxes = of_wires()
        .chain(of_meshes())
        .map(|(place, mesh)| bounds_of(mesh.positions.par_iter().map(|p| place_of(place, p))));
    let (lo, hi) = boxes.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let whole = if lo.cmple(hi).all() { (hi - lo).length() } else { 0.0 };
    let count: usize = of_wires().chain(of_meshes()).map(|(_, mesh)| mesh.positions.len()).sum();
    let points = of_wires().chain(of_meshes()).flat_map(|(place, mesh)| mesh.positions.iter().map(move |p| (place, p)));
    let some = points.step_by(stride(count)).map(|(place, p)| place_of(place, p));
    let half = half_of(some).map_or(whole, |(low, high)| (high - low).length());
    if half > 0.0 && whole > STRAY * half { 2.0 * half } else { whole }
}
