//! Assignment of prims to cells: exact overlap of a prim's surface with a padded cube, in `f64`.
//!
//! For triangles after M. Schwarz, H.-P. Seidel, *Fast Parallel Surface and Solid Voxelization on GPUs*, 2010: the box of the
//! triangle, its plane, and its three edges in each of the three projections. The answer equals that of the separating axes
//! of T. Akenine-Möller, 2001, but all that depends on the triangle alone is computed once.
//!
//! Every comparison errs towards overlap, by the padding of [`CellMargins`](super::lattice::CellMargins). Rounding here is
//! far below that: points and edge values err by at most 2⁻⁴⁸ R cells; only a plane's normal may err more, and has its own
//! slack.

use super::lattice::{Cube, Lattice, thick_box};
use super::params::Assign;
use crate::accel::shapes::{Prim, Shapes, SpherePrim};
use crate::math::DVec3;
use crate::math::bounds::U64;
use crate::math::cone::{Cone, Profile};
use crate::math::polygon::Polygon;

/// A prim prepared for overlap tests with cubes.
#[derive(Clone, Debug)]
pub struct Overlap {
    pad: f64,
    /// Lower corner of the prim's padded box, in finest cells.
    pub lo: DVec3,
    /// Upper corner of the box.
    pub hi: DVec3,
    surface: Surface,
}

#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "nearly all are triangles")]
enum Surface {
    Triangle {
        plane: Slab,
        edges: [Edge; 9],
    },
    Polygon {
        plane: Slab,
    },
    Sphere {
        center: DVec3,
        radius: f64,
        cell: DVec3,
    },
    Cone {
        base: DVec3,
        profile: Profile,
        cell: DVec3,
    },
    /// Any other surface: its box decides.
    Unknown,
}

impl Overlap {
    /// Prepares bounded prim `prim`.
    pub fn new(shapes: &Shapes, prim: u32, lattice: &Lattice) -> Self {
        let pad = lattice.margins.pad;
        let (lo, hi) = padded_box(shapes, prim, lattice);
        let surface = match shapes.prim(prim) {
            _ if lattice.assign == Assign::Box => Surface::Unknown,
            Prim::Triangle(corners) => triangle(corners.map(|p| lattice.place(p)), lattice),
            Prim::Polygon(p) => polygon(p, lattice),
            Prim::Sphere(s) => sphere(s, lattice),
            Prim::Cone(c) => cone(c, lattice),
            Prim::Plane(..) => Surface::Unknown,
        };
        Self { pad, lo, hi, surface }
    }

    /// Whether the prim's surface overlaps the padded cube.
    pub fn test(&self, cube: Cube) -> bool {
        let lo = DVec3::new(f64::from(cube.lo[0]), f64::from(cube.lo[1]), f64::from(cube.lo[2]));
        let side = cube.side();
        let hi = lo + side;
        // A prim whose box is inside the cube overlaps it: most are, and need no further test.
        let inside = lo.cmple(self.lo).all() && self.hi.cmple(hi).all();
        let apart = !(self.lo.cmple(hi).all() && lo.cmple(self.hi).all());
        inside || (!apart && self.surface_meets(lo - self.pad, side + 2.0 * self.pad))
    }

    fn surface_meets(&self, lo: DVec3, side: f64) -> bool {
        match &self.surface {
            Surface::Unknown => true,
            Surface::Triangle { plane, edges } => plane.meets(lo, side) && edges.iter().all(|e| e.meets(lo, side)),
            Surface::Polygon { plane } => plane.meets(lo, side),
            Surface::Sphere { center, radius, cell } => {
                // In units of length, because cells need not be cubes.
                let (lo, hi) = (lo * *cell - *center, (lo + side) * *cell - *center);
                let nearest = lo.max(-hi).max(DVec3::ZERO).length();
                let farthest = lo.abs().max(hi.abs()).length();
                nearest <= *radius && *radius <= farthest
            }
            Surface::Cone { base, profile, cell } => {
                // Bounding sphere of the cube, in units of length: no corner is farther from the centre. Its slack of 2⁻²⁰ of
                // the radius is far above the rounding of the distance, u of the cone's size, because a finest cell is at
                // least 2⁻²⁰ of that.
                let half = *cell * (side * 0.5);
                let middle = lo * *cell + half - *base;
                let s = middle.dot(profile.axis);
                let across = (middle - profile.axis * s).length();
                let apart = profile.distance(s, across) > half.length() * (1.0 + 1.0 / f64::from(1u32 << 20));
                !apart
            }
        }
    }
}

/// Padded box of bounded prim `prim` in finest cells: lower and upper corner.
pub fn padded_box(shapes: &Shapes, prim: u32, lattice: &Lattice) -> (DVec3, DVec3) {
    let ((lo, hi), pad) = (thick_box(shapes, prim, lattice.thickness), lattice.margins.pad);
    (lattice.place_f64(lo) - pad, lattice.place_f64(hi) + pad)
}

/// Space between two parallel planes.
#[derive(Clone, Copy, Debug, Default)]
struct Slab {
    normal: DVec3,
    /// normal · p for points p on the middle plane.
    offset: f64,
    /// Largest deviation of normal · p from `offset`.
    slack: f64,
}

impl Slab {
    fn meets(&self, lo: DVec3, side: f64) -> bool {
        let from = self.normal.dot(lo) - self.offset;
        let lowest = from + self.normal.min(DVec3::ZERO).element_sum() * side;
        let highest = from + self.normal.max(DVec3::ZERO).element_sum() * side;
        lowest <= self.slack && highest >= -self.slack
    }
}

/// Half plane on the inner side of an edge, in the projection along one axis.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    normal: DVec3,
    offset: f64,
}

impl Edge {
    /// Accepts every cube.
    const NONE: Self = Self { normal: DVec3::ZERO, offset: 0.0 };

    fn meets(&self, lo: DVec3, side: f64) -> bool {
        self.normal.dot(lo) + self.normal.max(DVec3::ZERO).element_sum() * side >= self.offset
    }
}

fn triangle([a, b, c]: [DVec3; 3], lattice: &Lattice) -> Surface {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let normal = ab.cross(bc);
    // Rounding error of each component of the normal: two products of rounded differences.
    let (p, q) = (ab.abs(), bc.abs());
    let sizes = DVec3::new(p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x);
    let doubt = sizes * (8.0 * U64);
    let plane = Slab { normal, offset: normal.dot(a), slack: doubt.element_sum() * across(lattice) };

    let mut edges = [Edge::NONE; 9];
    for axis in 0..3 {
        // In an edge-on projection the inner side is unknown; the plane is the better test there anyway.
        if normal[axis].abs() <= doubt[axis] {
            continue;
        }
        let mut unit = DVec3::ZERO;
        unit[axis] = normal[axis].signum();
        for (i, (start, along)) in [(a, ab), (b, bc), (c, ca)].into_iter().enumerate() {
            let inwards = unit.cross(along);
            edges[axis * 3 + i] = Edge { normal: inwards, offset: inwards.dot(start) };
        }
    }
    Surface::Triangle { plane, edges }
}

/// Slab around Newell's plane that contains all corners, and so every hit: where a grazing hit is moved into the polygon's
/// box, the ray runs inside the slab.
fn polygon(polygon: Polygon, lattice: &Lattice) -> Surface {
    // Normals transform into lattice units by the inverse of the scale.
    let normal = (polygon.newell() / lattice.scale).normalize_or_zero();
    let first = polygon.points().next().map_or(DVec3::ZERO, |p| lattice.place(p));
    let deviation = polygon.points().map(|p| normal.dot(lattice.place(p) - first).abs()).fold(0.0, f64::max);
    let slack = deviation + across(lattice) * 64.0 * U64;
    Surface::Polygon { plane: Slab { normal, offset: normal.dot(first), slack } }
}

fn sphere(s: SpherePrim, lattice: &Lattice) -> Surface {
    let center = s.center.as_dvec3() - lattice.lo;
    Surface::Sphere { center, radius: f64::from(s.radius), cell: lattice.scale.recip() }
}

fn cone(c: &Cone, lattice: &Lattice) -> Surface {
    let base = c.base.as_dvec3() - lattice.lo;
    Surface::Cone { base, profile: Profile::new(c), cell: lattice.scale.recip() }
}

/// Number of finest cells along the grid's longest axis.
fn across(lattice: &Lattice) -> f64 {
    let [x, y, z] = lattice.fine_dims();
    f64::from(x.max(y).max(z))
}
