//! Map from the frame of the shapes to an integer lattice of finest cells.
//!
//! Building and walking use the finest cell an octree can reach as their unit: integers for cells, `f64` for points. A top
//! cell is 2^levels finest cells wide, the cell of an octree node half as wide as its parent's.

use super::params::{Assign, GridParams, MOST_CELLS};
use crate::accel::shapes::{Prim, Shapes};
use crate::math::aabb::Aabb;
use crate::math::bounds::{
    BOX_UNDERFLOW, CELL_PAD, GRID_ROOM, NEAR_CELL_PAD, NEAR_GRID_ROOM, NEAR_RAY_CELLS, NO_SLOPE, RAY_CELLS, WALK_MARGIN,
};
use crate::math::{DVec3, Vec3, Vec3Swizzles as _, triangle};

/// Largest number of finest cells along an axis, R in the derivation of [`CELL_PAD`].
const MAX_FINE: u32 = 1 << 16;

/// Average number of references per prim in the top grid, at most, roughly.
const TOP_REFERENCES: f64 = 6.0;

/// Safety margins of building and walking; lengths in finest cells.
#[derive(Clone, Copy, Debug)]
pub struct CellMargins {
    /// Padding of a cell: prims this far outside are still listed in it.
    pub pad: f64,
    /// Margin by which the grid exceeds its content on each side, relative to the extent.
    pub room: f64,
    /// How far behind the best hit cells are still visited, relative to its distance.
    pub lag: f64,
    /// Absolute addition to `lag`, for distances so small that an ulp is no fraction of them.
    pub underflow: f64,
    /// Largest distance from the grid's corner at which a ray may start that is led through cells.
    pub ray_cells: f64,
    /// Replacement for a zero component of the direction.
    pub no_slope: f64,
    /// Whether the walk through octants may leave a cell only through the face it meets first.
    pub guarded: bool,
}

impl CellMargins {
    /// Distance before and behind `t` over which cells are visited for hits at `t`.
    #[inline]
    pub fn behind(&self, t: f64) -> f64 {
        t.abs() * self.lag + self.underflow
    }

    /// Margins derived in `math::bounds`.
    pub const DERIVED: Self = Self {
        pad: CELL_PAD,
        room: GRID_ROOM,
        lag: WALK_MARGIN,
        underflow: BOX_UNDERFLOW as f64,
        ray_cells: RAY_CELLS,
        no_slope: NO_SLOPE,
        guarded: true,
    };

    /// Margins for rays that start nearer: cells and grid hardly exceed their content.
    pub const NEAR: Self =
        Self { pad: NEAR_CELL_PAD, room: NEAR_GRID_ROOM, ray_cells: NEAR_RAY_CELLS, ..Self::DERIVED };
}

/// Box, resolution and depth of a grid.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Corner of the first cell.
    pub lo: DVec3,
    /// Finest cells per unit of length on each axis.
    pub scale: DVec3,
    /// Top cells on each axis.
    pub dims: [u32; 3],
    /// Largest number of octree levels below a top cell.
    pub levels: u32,
    /// Rule that assigns prims to cells.
    pub assign: Assign,
    /// [`GridParams::thickness`].
    pub thickness: f64,
    /// Safety margins.
    pub margins: CellMargins,
}

impl Lattice {
    /// Creates a lattice with cells as near to cubes as possible, `density` of them per bounded prim.
    ///
    /// J. Cleary, G. Wyvill, *Analysis of an Algorithm for Fast Ray Tracing Using Uniform Space Subdivision*, 1988.
    pub fn new(shapes: &Shapes, params: &GridParams, margins: CellMargins) -> Self {
        let prims = shapes.bounded();
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let join = |(lo, hi): (DVec3, DVec3), prim| {
            let (l, h) = thick_box(shapes, prim, params.thickness);
            (lo.min(l), hi.max(h))
        };
        let (lo, hi) = if prims == 0 { (DVec3::ZERO, DVec3::ONE) } else { (0..prims).fold(nothing, join) };

        // A flat or line-like scene gets a thin box, a single point a small one: no side is zero.
        let longest = (hi - lo).max_element();
        let longest = if longest > 0.0 { longest } else { lo.abs().max_element().max(f64::from(f32::MIN_POSITIVE)) };
        let extent = (hi - lo).max(DVec3::splat(longest / 1024.0));

        let dims = params.dims.unwrap_or_else(|| dims(shapes, params, extent));
        let most = dims.into_iter().fold(1, u32::max);
        let levels = params.max_depth.min((MAX_FINE / most).ilog2());

        let room = extent * margins.room;
        let fine = DVec3::from_array(dims.map(|n| f64::from(n << levels)));
        let lo = (lo + hi) / 2.0 - extent / 2.0 - room;
        Self {
            lo,
            scale: fine / (extent + room * 2.0),
            dims,
            levels,
            assign: params.assign,
            thickness: params.thickness,
            margins,
        }
    }

    /// Number of finest cells on each axis.
    pub fn fine_dims(&self) -> [u32; 3] {
        self.dims.map(|n| n << self.levels)
    }

    /// Converts a point to units of finest cells.
    pub fn place(&self, p: Vec3) -> DVec3 {
        self.place_f64(p.as_dvec3())
    }

    /// [`Self::place`] for a point in `f64`.
    pub fn place_f64(&self, p: DVec3) -> DVec3 {
        (p - self.lo) * self.scale
    }

    /// Range of top cells that overlap a box given in finest cells: first and last on each axis.
    pub fn top_range(&self, lo: DVec3, hi: DVec3) -> ([u32; 3], [u32; 3]) {
        let side = f64::from(1u32 << self.levels);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "`as` saturates; clamped to the grid"
        )]
        let cell = |x: f64, axis: usize| ((x / side) as u32).min(self.dims[axis] - 1);
        ([0, 1, 2].map(|k| cell(lo[k], k)), [0, 1, 2].map(|k| cell(hi[k], k)))
    }

    /// Cube of finest cells that a top cell covers.
    pub fn top_cube(&self, cell: [u32; 3]) -> Cube {
        Cube { lo: cell.map(|c| c << self.levels), level: self.levels }
    }

    /// Padded box of a cube in the frame of the shapes, rounded outwards.
    ///
    /// Rounding in `f64` moves the box by 3 u of its coordinates. The padding is more than 2⁻⁴⁹ of them, of which the walk
    /// needs a small part ([`CELL_PAD`]): different `f32` coordinates differ by at least 2⁻²⁴, which is at most 2¹⁶ cells.
    pub fn padded_bounds(&self, cube: Cube) -> Aabb {
        let lo = DVec3::from_array(cube.lo.map(f64::from));
        let place = |p: DVec3| (self.lo + p / self.scale).as_vec3();
        let (lo, hi) = (place(lo - self.margins.pad), place(lo + cube.side() + self.margins.pad));
        Aabb { lo: lo.map(f32::next_down), hi: hi.map(f32::next_up) }
    }

    /// Box of a cube in the frame of the shapes, rounded to nearest.
    pub fn bounds(&self, cube: Cube) -> Aabb {
        let lo = DVec3::from_array(cube.lo.map(f64::from));
        let place = |p: DVec3| (self.lo + p / self.scale).as_vec3();
        Aabb { lo: place(lo), hi: place(lo + cube.side()) }
    }

    /// Index of a top cell.
    pub fn top_index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// Coordinates of the top cell with a given index.
    pub fn top_cell(&self, index: usize) -> [u32; 3] {
        let (nx, ny) = (self.dims[0] as usize, self.dims[1] as usize);
        #[expect(clippy::cast_possible_truncation, reason = "remainders and quotients below the dims")]
        [index % nx, index / nx % ny, index / nx / ny].map(|i| i as u32)
    }

    /// Number of top cells.
    pub fn top_len(&self) -> usize {
        self.dims.iter().map(|&n| n as usize).product()
    }
}

/// Box of bounded prim `prim`, with a face thickened along its normal.
pub fn thick_box(shapes: &Shapes, prim: u32, thickness: f64) -> (DVec3, DVec3) {
    let bounds = shapes.bounds(prim);
    let (lo, hi) = (bounds.lo.as_dvec3(), bounds.hi.as_dvec3());
    if thickness == 0.0 {
        return (lo, hi);
    }
    let normal = match shapes.prim(prim) {
        Prim::Triangle(corners) => triangle::normal(&corners),
        Prim::Polygon(p) => p.normal(),
        _ => Vec3::ZERO,
    };
    let more = normal.abs().as_dvec3() * thickness;
    (lo - more, hi + more)
}

/// Number of cells on each axis for the wanted density.
fn dims(shapes: &Shapes, params: &GridParams, extent: DVec3) -> [u32; 3] {
    let longest = extent.max_element();
    let sizes = Sizes::of(shapes);
    let cube_root =
        libm::cbrt(params.density * f64::from(shapes.bounded()) / (extent / longest).element_product()) / longest;
    let resolution = |factor: f64| {
        let most = f64::from(params.max_resolution);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 1..=1024 before")]
        (extent * cube_root * factor).to_array().map(|n| n.round().clamp(1.0, most) as u32)
    };
    // Large overlapping prims are listed in many cells each: the cells are enlarged until the lists fit.
    let most_references = f64::from(shapes.bounded()) * TOP_REFERENCES;
    let mut factor = 1.0;
    let mut dims = resolution(factor);
    let cells = |dims: [u32; 3]| dims.map(f64::from).into_iter().product::<f64>();
    while dims != [1; 3] && (sizes.references(dims, extent) > most_references || cells(dims) > MOST_CELLS) {
        factor *= 0.75;
        dims = resolution(factor);
    }
    dims
}

/// Sums over the boxes of all prims, from which the references at any resolution follow directly.
#[derive(Default)]
struct Sizes {
    prims: f64,
    /// Sum of the side lengths.
    sides: DVec3,
    /// Sum of the areas of the faces perpendicular to each axis.
    faces: DVec3,
}

impl Sizes {
    fn of(shapes: &Shapes) -> Self {
        (0..shapes.bounded()).fold(Self::default(), |sum, prim| {
            let b = shapes.bounds(prim);
            let e = b.hi.as_dvec3() - b.lo.as_dvec3();
            Self { prims: sum.prims + 1.0, sides: sum.sides + e, faces: sum.faces + e.yzx() * e.zxy() }
        })
    }

    /// Estimated number of references. A surface of a × b × c cells overlaps about 1 + (a + b + c) + (a b + b c + c a)/2 of
    /// them.
    fn references(&self, dims: [u32; 3], extent: DVec3) -> f64 {
        let per_length = DVec3::from_array(dims.map(f64::from)) / extent;
        let faces = self.faces.dot(per_length.yzx() * per_length.zxy());
        self.prims + self.sides.dot(per_length) + 0.5 * faces
    }
}

/// Cube of finest cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cube {
    /// Smallest corner.
    pub lo: [u32; 3],
    /// log2 of the side length.
    pub level: u32,
}

impl Cube {
    /// Returns octant `octant` (bit k set: the upper half on axis k).
    pub fn octant(self, octant: u32) -> Self {
        let level = self.level - 1;
        Self { lo: [0, 1, 2].map(|k| self.lo[k] + ((octant >> k & 1) << level)), level }
    }

    /// Side length, in finest cells.
    pub fn side(self) -> f64 {
        f64::from(1u32 << self.level)
    }
}
