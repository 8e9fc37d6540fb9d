//! The faces at the points of a strip: their numbers in columns, written for many points at once.

use std::ops::Range;

use super::columns::{LANES, POINTS};
use crate::accel::refine::Facet;
use crate::math::inset::Rim;
use crate::math::triangle::Flat;
use crate::math::{DVec3, Vec3};
use crate::render::patch::differ;

/// A number of every point, and room for what is written behind the last.
type Roomy<T> = [T; POINTS + LANES];

/// What is known of the face at every point: [`FaceNumbers`] in columns.
pub(super) struct Faces {
    wide: [Roomy<f64>; WIDE_NUMBERS],
    narrow: [Roomy<f32>; NARROW_NUMBERS],
    /// 1 where the normals of the corners differ.
    curved: Roomy<u32>,
    prims: Roomy<u32>,
}

const WIDE_NUMBERS: usize = 13;
const NARROW_NUMBERS: usize = 12;

/// What points of a face share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FaceNumbers {
    /// Corner, normal and sizes of its plane; the square of twice its area, and those of its edges.
    wide: [f64; WIDE_NUMBERS],
    /// The unit normal of its front, and those of its corners.
    narrow: [f32; NARROW_NUMBERS],
    curved: u32,
    prim: u32,
}

impl FaceNumbers {
    /// Of prim `prim`, with the unit normal on its front and the normals of its corners, if it has any.
    pub(super) fn new(prim: u32, facet: &Facet, outward: Vec3, normals: Option<[Vec3; 3]>) -> Self {
        let Facet { flat: Flat { corner: c, normal: n, sizes: s }, rim: Rim { area2, edges2: [e, f, g] } } = *facet;
        let [p, q, r] = normals.unwrap_or_default();
        Self {
            wide: [c.x, c.y, c.z, n.x, n.y, n.z, s.x, s.y, s.z, area2, e, f, g],
            narrow: [outward.x, outward.y, outward.z, p.x, p.y, p.z, q.x, q.y, q.z, r.x, r.y, r.z],
            curved: u32::from(normals.is_some_and(differ)),
            prim,
        }
    }
}

impl Faces {
    /// No faces.
    pub(super) const EMPTY: Self = Self {
        wide: [[0.0; POINTS + LANES]; WIDE_NUMBERS],
        narrow: [[0.0; POINTS + LANES]; NARROW_NUMBERS],
        curved: [0; POINTS + LANES],
        prims: [0; POINTS + LANES],
    };

    /// Sets the face of these points. What follows up to seven behind them is written, too, and must be set later.
    #[inline(always)]
    pub(super) fn set(&mut self, points: Range<usize>, face: &FaceNumbers) {
        for at in points.step_by(LANES) {
            self.set_eight(at, face);
        }
    }

    /// Sets the face of eight points from `at` on.
    #[inline(always)]
    fn set_eight(&mut self, at: usize, face: &FaceNumbers) {
        let at = at % POINTS;
        for (column, number) in self.wide.iter_mut().zip(face.wide) {
            column[at..at + LANES].copy_from_slice(&[number; LANES]);
        }
        for (column, number) in self.narrow.iter_mut().zip(face.narrow) {
            column[at..at + LANES].copy_from_slice(&[number; LANES]);
        }
        self.curved[at..at + LANES].copy_from_slice(&[face.curved; LANES]);
        self.prims[at..at + LANES].copy_from_slice(&[face.prim; LANES]);
    }

    /// The plane and the rim.
    #[inline(always)]
    pub(super) fn facet(&self, i: usize) -> Facet {
        let w = |k: usize| self.wide[k][i];
        let three = |k: usize| DVec3::new(w(k), w(k + 1), w(k + 2));
        let rim = Rim { area2: w(9), edges2: [w(10), w(11), w(12)] };
        Facet { flat: Flat { corner: three(0), normal: three(3), sizes: three(6) }, rim }
    }

    /// The unit normal of the front.
    #[inline(always)]
    pub(super) fn outward(&self, i: usize) -> Vec3 {
        self.three(0, i)
    }

    /// Those of the corners.
    #[inline(always)]
    pub(super) fn normals(&self, i: usize) -> [Vec3; 3] {
        [self.three(3, i), self.three(6, i), self.three(9, i)]
    }

    /// By point, 1 where those differ.
    #[inline(always)]
    pub(super) fn curved(&self) -> &[u32] {
        &self.curved[..POINTS]
    }

    /// By point, the number of the face among all prims.
    #[inline(always)]
    pub(super) fn prims(&self) -> &[u32] {
        &self.prims[..POINTS]
    }

    /// All of a point.
    #[cfg(test)]
    pub(super) fn at(&self, i: usize) -> FaceNumbers {
        let (wide, narrow) = (self.wide.map(|c| c[i]), self.narrow.map(|c| c[i]));
        FaceNumbers { wide, narrow, curved: self.curved[i], prim: self.prims[i] }
    }

    #[inline(always)]
    fn three(&self, k: usize, i: usize) -> Vec3 {
        Vec3::new(self.narrow[k][i], self.narrow[k + 1][i], self.narrow[k + 2][i])
    }
}
