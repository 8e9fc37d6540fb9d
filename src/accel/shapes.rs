//! The shapes a structure culls: flat arrays in one centred `f32` frame.
//!
//! Prim ids run over all kinds: first the triangles, then the polygons, then the spheres, then the planes.

use crate::math::Vec3;

/// Everything that can be hit.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// Corners of triangles and polygons, relative to the scene's centre. Finite.
    pub vertices: Vec<Vec3>,
    /// Prims `0..triangles.len()`: indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Planar n-gons: runs (first, length) of `polygon_corners`.
    pub polygons: Vec<(u32, u32)>,
    /// Indices into `vertices`.
    pub polygon_corners: Vec<u32>,
    /// Spheres.
    pub spheres: Vec<SpherePrim>,
    /// Unbounded planes (unit normal n, offset d: n·p = d); tested before every structure.
    pub planes: Vec<(Vec3, f32)>,
    /// One bit per prim: a hit always stops light.
    pub opaque: BitSet,
}

/// A sphere in the centred frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpherePrim {
    /// Centre.
    pub center: Vec3,
    /// Radius, greater than 0.
    pub radius: f32,
}

/// One bit per prim.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BitSet {
    words: Vec<u64>,
}

impl BitSet {
    /// `len` bits, all equal to `value`.
    pub fn filled(len: usize, value: bool) -> Self {
        Self { words: vec![if value { u64::MAX } else { 0 }; len.div_ceil(64)] }
    }

    /// Bit `i`.
    pub fn get(&self, i: u32) -> bool {
        self.words[i as usize / 64] >> (i % 64) & 1 == 1
    }

    /// Sets bit `i`.
    pub fn set(&mut self, i: u32, value: bool) {
        let mask = 1u64 << (i % 64);
        let word = &mut self.words[i as usize / 64];
        *word = if value { *word | mask } else { *word & !mask };
    }
}

impl Shapes {
    /// Number of prims of all kinds.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.polygons.len() + self.spheres.len() + self.planes.len()
    }

    /// Whether there is nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
