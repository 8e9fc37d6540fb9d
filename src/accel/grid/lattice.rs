//! Where the cells lie: the map from the shapes' frame to a lattice of finest cells.
//!
//! All of building and walking happens in units of the finest cell an octree can reach, as integers where cells are
//! meant and as `f64` where points are. A top cell is 2^levels finest cells wide, the cell of an octree node half of its
//! parent's.

use super::params::{Assign, GridParams, MOST_CELLS};
use crate::accel::shapes::{Prim, Shapes};
use crate::math::aabb::Aabb;
use crate::math::bounds::{
    BOX_UNDERFLOW, CELL_PAD, GRID_ROOM, NEAR_CELL_PAD, NEAR_GRID_ROOM, NEAR_RAY_CELLS, NO_SLOPE, RAY_CELLS, WALK_MARGIN,
};
use crate::math::{DVec3, Vec3, Vec3Swizzles as _, triangle};

/// Most finest cells along an axis, R in the derivation of [`CELL_PAD`].
const MAX_FINE: u32 = 1 << 16;

/// References a prim may have in the top grid on average, roughly.
const TOP_REFERENCES: f64 = 6.0;

/// What building and walking allow for; lengths in finest cells.
#[derive(Clone, Copy, Debug)]
pub struct CellMargins {
    /// How far beyond a cell prims are still listed in it.
    pub pad: f64,
    /// How much larger than its content the grid is on each side, relative to its extent.
    pub room: f64,
    /// How far behind the best hit cells are still visited, relative to its distance.
    pub lag: f64,
    /// How much farther, where an ulp is no fraction of its distance.
    pub underflow: f64,
    /// How far from the grid's corner a ray may start that is led through cells.
    pub ray_cells: f64,
    /// What a zero in a direction is replaced by.
    pub no_slope: f64,
    /// Whether the walk through octants is kept from leaving a cell but through the face it meets first.
    pub guarded: bool,
}

impl CellMargins {
    /// How far before and behind a distance cells are visited for hits there.
    #[inline]
    pub fn behind(&self, t: f64) -> f64 {
        t.abs() * self.lag + self.underflow
    }

    /// Those that `math::bounds` derives.
    pub const DERIVED: Self = Self {
        pad: CELL_PAD,
        room: GRID_ROOM,
        lag: WALK_MARGIN,
        underflow: BOX_UNDERFLOW as f64,
        ray_cells: RAY_CELLS,
        no_slope: NO_SLOPE,
        guarded: true,
    };

    /// Margins for rays that start nearer: cells and grid are hardly larger than their content.
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
    /// Levels an octree below a top cell may have.
    pub levels: u32,
    /// What decides that a prim is listed in a cell.
    pub assign: Assign,
    /// [`GridParams::thickness`].
    pub thickness: f64,
    /// What is allowed for.
    pub margins: CellMargins,
}

impl Lattice {
    /// Cells as near to cubes as possible, `density` of them for each of the bounded prims.
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

        // A flat or line-like scene gets a thin box, one that is a point a small one: no side is zero.
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

    /// Finest cells on each axis.
    pub fn fine_dims(&self) -> [u32; 3] {
        self.dims.map(|n| n << self.levels)
    }

    /// A point in units of finest cells.
    pub fn place(&self, p: Vec3) -> DVec3 {
        self.place_f64(p.as_dvec3())
    }

    /// [`Self::place`] of a point that is no vertex.
    pub fn place_f64(&self, p: DVec3) -> DVec3 {
        (p - self.lo) * self.scale
    }

    /// The top cells that meet a box in finest cells: first and last on each axis.
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

    /// A top cell as a cube of finest cells.
    pub fn top_cube(&self, cell: [u32; 3]) -> Cube {
        Cube { lo: cell.map(|c| c << self.levels), level: self.levels }
    }

    /// The box of a cube and its padding in the frame of the shapes, rounded outwards.
    ///
    /// Rounding in `f64` moves it by 3 u of its coordinates. The padding is more than 2⁻⁴⁹ of them, of which the walk needs
    /// a small part ([`CELL_PAD`]): `f32` coordinates that differ do so by 2⁻²⁴ at least, and that is 2¹⁶ cells at most.
    pub fn padded_bounds(&self, cube: Cube) -> Aabb {
        let lo = DVec3::from_array(cube.lo.map(f64::from));
        let place = |p: DVec3| (self.lo + p / self.scale).as_vec3();
        let (lo, hi) = (place(lo - self.margins.pad), place(lo + cube.side() + self.margins.pad));
        Aabb { lo: lo.map(f32::next_down), hi: hi.map(f32::next_up) }
    }

    /// The box of a cube in the frame of the shapes, rounded.
    pub fn bounds(&self, cube: Cube) -> Aabb {
        let lo = DVec3::from_array(cube.lo.map(f64::from));
        let place = |p: DVec3| (self.lo + p / self.scale).as_vec3();
        Aabb { lo: place(lo), hi: place(lo + cube.side()) }
    }

    /// Index of a top cell.
    pub fn top_index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// Top cell of an index.
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

/// Box of bounded prim `prim`, its face thickened along its normal.
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

/// Cells on each axis for the density that is asked for.
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
    // Large overlapping prims are listed in many cells each: then the cells must be larger.
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

/// Sums over the boxes of all prims, from which the references of any resolution follow at once.
#[derive(Default)]
struct Sizes {
    prims: f64,
    /// Sum of the sides.
    sides: DVec3,
    /// Sum of the areas of the faces across each axis.
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

    /// A surface of a × b × c cells meets about 1 + (a + b + c) + (a b + b c + c a)/2 of them.
    fn references(&self, dims: [u32; 3], extent: DVec3) -> f64 {
        let per_length = DVec3::from_array(dims.map(f64::from)) / extent;
        let faces = self.faces.dot(per_length.yzx() * per_length.zxy());
        self.prims + self.sides.dot(per_length) + 0.5 * faces
    }
}

/// A cube of finest cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cube {
    /// Smallest corner.
    pub lo: [u32; 3],
    /// log2 of the side.
    pub level: u32,
}

impl Cube {
    /// The eighth `octant` (bit k set: the upper half on axis k).
    pub fn octant(self, octant: u32) -> Self {
        let level = self.level - 1;
        Self { lo: [0, 1, 2].map(|k| self.lo[k] + ((octant >> k & 1) << level)), level }
    }

    /// Side in finest cells.
    pub fn side(self) -> f64 {
        f64::from(1u32 << self.level)
    }
}
