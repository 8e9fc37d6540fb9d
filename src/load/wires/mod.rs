//! Points and lines -> thin solids, since rays hit only what has an extent.
//!
//! Formats give points and lines no width; programs that draw them in pixels choose one. Here they have a width in world
//! units, so that they appear in perspective, occlude and are occluded, and are hit like every other triangle: 1/256 of the
//! diagonal of the bounds of everything in the file (except a few stray points), or less where there are so many that
//! they would merge (`Widths`). A point becomes an octahedron, or a tetrahedron where there are very many; a
//! line a prism with three sides, half a width longer at each end, so that joints are closed.
//!
//! Wires whose vertices have no normals have no defined shading: they are drawn without light, in their base
//! colour plus emission, as the glTF 2.0 specification recommends (§3.9.6). With normals they are lit by these: points
//! are squares then, lines low roofs, whose faces point along the normals. They are never of glass: they have no inside,
//! and light through thousands of them would never end. Whatever the transform of an instance (scale, shear, mirror), widths
//! are in world units: solids are made in world space, once for all instances that differ by a translation alone.

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
    /// Vertices and material; no faces.
    pub mesh: Mesh,
    /// Vertices at both ends of each line; the same one twice for a point.
    pub ends: Vec<[u32; 2]>,
}

impl Wires {
    /// Number of points and number of lines.
    fn count(&self) -> [u64; 2] {
        let points = self.ends.iter().filter(|[a, b]| a == b).count() as u64;
        [points, self.ends.len() as u64 - points]
    }

    fn is_lit(&self) -> bool {
        !self.mesh.normals.is_empty()
    }
}

/// Statistics of the points and lines of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WireFacts {
    /// Number of points.
    pub points: u64,
    /// Number of lines; each segment of a strip counts.
    pub lines: u64,
    /// Width of the points, world units; 0 without points.
    pub point_width: f64,
    /// Width of the lines, world units; 0 without lines.
    pub line_width: f64,
}

impl WireFacts {
    /// Smaller of the two widths, world units; `None` where there are neither points nor lines.
    pub fn narrowest(&self) -> Option<f64> {
        [self.point_width, self.line_width].into_iter().filter(|&width| width > 0.0).reduce(f64::min)
    }

    /// Adds the facts of another file; keeps the larger widths.
    pub fn append(&mut self, more: &Self) {
        self.points += more.points;
        self.lines += more.lines;
        self.point_width = self.point_width.max(more.point_width);
        self.line_width = self.line_width.max(more.line_width);
    }
}

/// Ratio of the diagonal to the largest width.
const PARTS: f64 = 256.0;

/// Number of points, or lines, from which on they get as few triangles as a solid can have.
const CROWD: u64 = 1 << 16;

/// Widths of points and lines, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Widths {
    point: f64,
    line: f64,
    /// Whether there are at least [`CROWD`] points.
    crowd: bool,
}

impl Widths {
    /// Widths for these numbers of points and lines in a box with this diagonal.
    ///
    /// N points spread over a surface as large as the box are about diagonal / √N apart: wider ones would merge.
    /// Lines get a quarter of that, so that a wire mesh shows what lies behind. `asked` overrides all that.
    #[expect(clippy::cast_precision_loss, reason = "counts of what is in memory")]
    fn new([points, lines]: [u64; 2], diagonal: f64, asked: Option<[f64; 2]>) -> Self {
        // A single point has no extent: any width will do, since the camera is framed on the scene.
        let diagonal = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { PARTS };
        let point = diagonal / (points as f64).sqrt().max(PARTS);
        let line = diagonal / (4.0 * (lines as f64).sqrt()).max(PARTS);
        let [point, line] = asked.unwrap_or([point, line]);
        Self { point, line, crowd: points >= CROWD }
    }
}

/// Adds points and lines to the scene as solids; `places` are instances whose `mesh` is an index into `wires`.
///
/// Meshes must be in the scene before: the width depends on the bounds of everything. Points and lines with an end that is not
/// finite, or so far away that rounding leaves nothing of their width, are left out and counted in `facts`; returns warnings
/// about them, and about glass. `widths` of points and lines are those of the user.
///
/// # Errors
/// When the solids would exceed `budget`.
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
    // For all wires, in their order: the same materials at every moment of an animation, whatever it hides.
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

/// Reason why points and lines are left out.
const NOT_FINITE: &str = "a point or line with an end that is not finite or too far away to have a width";

/// Warnings about the numbers of wires left out, and of glass materials that are drawn solid.
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

/// Index of a mesh of solids, and its position relative to the centre of the wires' mesh.
type Part = (u32, DVec3);

/// State of [`draw`].
struct Drawing<'a> {
    scene: &'a mut Scene,
    budget: &'a mut Budget,
    widths: Widths,
    /// Material of the wires, by the file's material and whether they are lit.
    materials: HashMap<(u32, bool), u32>,
    dropped: u64,
    /// Number of glass materials that are drawn solid.
    of_glass: u64,
}

impl Drawing<'_> {
    /// Makes the solids of wires transformed by `linear`: meshes, and their positions.
    fn bake(&mut self, wires: &Wires, linear: DMat3) -> Result<Vec<Part>, OverBudget> {
        let [kept, held] = bake::cost(wires, &self.widths);
        self.budget.take(kept, 1)?;
        self.budget.clone().take(held, 1)?;
        let material = self.material(wires);
        let Baked { meshes, center, dropped } = bake::bake(wires, linear, &self.widths);
        self.dropped += dropped;
        let mut parts = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            // Guaranteed by the budget: each mesh takes hundreds of bytes.
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

    /// Material as the wires show it: double-sided where they are flat, unlit where they have no normals, never
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

/// Material for wires with normals.
fn lit(material: &Material) -> Material {
    let reflection = material.reflection.clone().without_transmission();
    Material { double_sided: true, reflection, ..material.clone() }
}

/// Material for wires without normals.
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

/// Largest ratio of the diagonal of all points' bounds to that of the inner half's bounds at which the former sets the width.
/// Points spread evenly over the bounds have a ratio of two.
const STRAY: f64 = 16.0;

/// Diagonal of the bounds of all meshes and wires in the world, or twice that of the inner half of their points where
/// others are far away, such as a scanner's stray returns; not positive where there is nothing.
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
