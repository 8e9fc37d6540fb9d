//! Faces at the points of a batch, as columns that are written for many points at once.

use std::ops::Range;

use super::columns::{LANES, POINTS};
use crate::accel::refine::TrianglePlane;
use crate::math::inset::Rim;
use crate::math::triangle::Flat;
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::render::patch::{Gradients, differ};

/// A value of every point, with room for writes past the last.
type Roomy<T> = [T; POINTS + LANES];

/// Face data of every point: [`FaceNumbers`] as columns.
#[repr(C, align(64))]
pub(super) struct Faces {
    wide: [Roomy<f64>; WIDE_NUMBERS],
    outward: [Roomy<f32>; 3],
    normals: [Roomy<f32>; NORMAL_NUMBERS],
    /// 1 where the vertex normals differ.
    curved: Roomy<u32>,
    prims: Roomy<u32>,
    skins: [Roomy<f32>; SKIN_NUMBERS],
    extras: [Roomy<f32>; EXTRA_NUMBERS],
}

const WIDE_NUMBERS: usize = 12;
const NORMAL_NUMBERS: usize = 9;
const SKIN_NUMBERS: usize = 24;
const EXTRA_NUMBERS: usize = 18;

/// Data shared by all points of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FaceNumbers {
    /// Corner, normal and sizes of its plane, and its squared heights.
    wide: [f64; WIDE_NUMBERS],
    /// Unit normal of its front.
    outward: [f32; 3],
    /// Vertex normals.
    normals: [f32; NORMAL_NUMBERS],
    curved: u32,
    prim: u32,
}

/// Further data of a face, for maps: gradients of the barycentric coordinates, and texture coordinates and tangents of its
/// corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Skin {
    numbers: [f32; SKIN_NUMBERS],
    /// Second texture coordinates and vertex colours, which few have.
    extras: Option<[f32; EXTRA_NUMBERS]>,
}

impl Skin {
    /// Texture coordinates have been transformed, except for the offset.
    pub(super) fn new(gradients: &Gradients, [a, b, c]: [Vec2; 3], tangents: [Vec4; 3]) -> Self {
        let Gradients { second: p, third: q } = gradients;
        let mut numbers = [0.0; SKIN_NUMBERS];
        numbers[..12].copy_from_slice(&[p.x, p.y, p.z, q.x, q.y, q.z, a.x, a.y, b.x, b.y, c.x, c.y]);
        numbers[12..].copy_from_slice(tangents.map(|t| t.to_array()).as_flattened());
        Self { numbers, extras: None }
    }

    /// This skin with second texture coordinates and vertex colours.
    pub(super) fn with(self, uvs: [Vec2; 3], colors: [Vec4; 3]) -> Self {
        let mut extras = [0.0; EXTRA_NUMBERS];
        extras[..6].copy_from_slice(uvs.map(|uv| uv.to_array()).as_flattened());
        extras[6..].copy_from_slice(colors.map(|color| color.to_array()).as_flattened());
        Self { extras: Some(extras), ..self }
    }
}

impl FaceNumbers {
    /// Data of prim `prim`, with the unit normal of its front and its vertex normals, if it has any.
    pub(super) fn new(prim: u32, plane: &TrianglePlane, outward: Vec3, normals: Option<[Vec3; 3]>) -> Self {
        let TrianglePlane { flat: Flat { corner: c, normal: n, sizes: s }, rim: Rim { heights2: [e, f, g] } } = *plane;
        let [p, q, r] = normals.unwrap_or_default();
        Self {
            wide: [c.x, c.y, c.z, n.x, n.y, n.z, s.x, s.y, s.z, e, f, g],
            outward: outward.to_array(),
            normals: [p.x, p.y, p.z, q.x, q.y, q.z, r.x, r.y, r.z],
            curved: u32::from(normals.is_some_and(differ)),
            prim,
        }
    }
}

impl Faces {
    /// No faces.
    pub(super) const EMPTY: Self = Self {
        wide: [[0.0; POINTS + LANES]; WIDE_NUMBERS],
        outward: [[0.0; POINTS + LANES]; 3],
        normals: [[0.0; POINTS + LANES]; NORMAL_NUMBERS],
        curved: [0; POINTS + LANES],
        prims: [0; POINTS + LANES],
        skins: [[0.0; POINTS + LANES]; SKIN_NUMBERS],
        extras: [[0.0; POINTS + LANES]; EXTRA_NUMBERS],
    };

    /// Sets the face of these points, except its vertex normals. Up to seven points behind them may be overwritten, too, and must
    /// be set later.
    #[inline(always)]
    pub(super) fn set(&mut self, points: &Range<usize>, face: &FaceNumbers) {
        set(&mut self.wide, points, &face.wide);
        set(&mut self.outward, points, &face.outward);
        set(std::array::from_mut(&mut self.prims), points, &[face.prim]);
    }

    /// Sets the vertex normals, in the same way.
    #[inline(always)]
    pub(super) fn set_normals(&mut self, points: &Range<usize>, face: &FaceNumbers) {
        set(&mut self.normals, points, &face.normals);
        set(std::array::from_mut(&mut self.curved), points, &[face.curved]);
    }

    /// Sets the skin, in the same way.
    #[inline(always)]
    pub(super) fn set_skin(&mut self, points: &Range<usize>, skin: &Skin) {
        set(&mut self.skins, points, &skin.numbers);
        if let Some(extras) = &skin.extras {
            set(&mut self.extras, points, extras);
        }
    }

    /// Gradients of the barycentric coordinates.
    #[inline(always)]
    pub(super) fn gradients(&self, i: usize) -> Gradients {
        let s = |k: usize| self.skins[k][i];
        Gradients { second: Vec3::new(s(0), s(1), s(2)), third: Vec3::new(s(3), s(4), s(5)) }
    }

    /// Texture coordinates of the corners.
    #[inline(always)]
    pub(super) fn uvs(&self, i: usize) -> [Vec2; 3] {
        let s = |k: usize| self.skins[k][i];
        [Vec2::new(s(6), s(7)), Vec2::new(s(8), s(9)), Vec2::new(s(10), s(11))]
    }

    /// Second texture coordinates of the corners.
    #[inline(always)]
    pub(super) fn other_uvs(&self, i: usize) -> [Vec2; 3] {
        let s = |k: usize| self.extras[k][i];
        [Vec2::new(s(0), s(1)), Vec2::new(s(2), s(3)), Vec2::new(s(4), s(5))]
    }

    /// Vertex colours.
    #[inline(always)]
    pub(super) fn colors(&self, i: usize) -> [Vec4; 3] {
        [four(&self.extras, 6, i), four(&self.extras, 10, i), four(&self.extras, 14, i)]
    }

    /// Tangents of the corners.
    #[inline(always)]
    pub(super) fn tangents(&self, i: usize) -> [Vec4; 3] {
        [four(&self.skins, 12, i), four(&self.skins, 16, i), four(&self.skins, 20, i)]
    }

    /// Plane and rim of the triangle.
    #[inline(always)]
    pub(super) fn plane(&self, i: usize) -> TrianglePlane {
        let w = |k: usize| self.wide[k][i];
        let three = |k: usize| DVec3::new(w(k), w(k + 1), w(k + 2));
        let rim = Rim { heights2: [w(9), w(10), w(11)] };
        TrianglePlane { flat: Flat { corner: three(0), normal: three(3), sizes: three(6) }, rim }
    }

    /// Unit normal of the front.
    #[inline(always)]
    pub(super) fn outward(&self, i: usize) -> Vec3 {
        Vec3::new(self.outward[0][i], self.outward[1][i], self.outward[2][i])
    }

    /// Vertex normals.
    #[inline(always)]
    pub(super) fn normals(&self, i: usize) -> [Vec3; 3] {
        let n = |k: usize| self.normals[k][i];
        [Vec3::new(n(0), n(1), n(2)), Vec3::new(n(3), n(4), n(5)), Vec3::new(n(6), n(7), n(8))]
    }

    /// 1 where these differ.
    #[inline(always)]
    pub(super) fn curved(&self, i: usize) -> u32 {
        self.curved[i]
    }

    /// Prim of each point.
    #[inline(always)]
    pub(super) fn prims(&self) -> &[u32] {
        &self.prims[..POINTS]
    }

    /// All data of a point.
    #[cfg(test)]
    pub(super) fn at(&self, i: usize) -> FaceNumbers {
        FaceNumbers {
            wide: self.wide.map(|c| c[i]),
            outward: self.outward.map(|c| c[i]),
            normals: self.normals.map(|c| c[i]),
            curved: self.curved[i],
            prim: self.prims[i],
        }
    }
}

/// Four columns from the `k`th on at a point. Its callers use no maps over arrays: these are not always inlined, which keeps
/// loops over points from being vectorised.
#[inline(always)]
fn four(columns: &[Roomy<f32>], k: usize, i: usize) -> Vec4 {
    Vec4::new(columns[k][i], columns[k + 1][i], columns[k + 2][i], columns[k + 3][i])
}

/// Sets the values of these points, and of up to seven behind them.
#[inline(always)]
fn set<T: Copy, const N: usize>(columns: &mut [Roomy<T>; N], points: &Range<usize>, numbers: &[T; N]) {
    let first = points.start % POINTS;
    if points.len() == 1 {
        columns.iter_mut().zip(numbers).for_each(|(column, &number)| column[first] = number);
        return;
    }
    // From the second write on they fill whole cache lines.
    let mut at = first;
    while at < points.end.min(POINTS) {
        for (column, &number) in columns.iter_mut().zip(numbers) {
            column[at..at + LANES].copy_from_slice(&[number; LANES]);
        }
        at = (at + 1).next_multiple_of(LANES);
    }
}
