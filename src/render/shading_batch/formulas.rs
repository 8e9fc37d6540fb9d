//! Formulas of direct light: BRDF × N·L at each point of a batch.
//!
//! They are types rather than closures: their methods are inlined into the loops over points in every build, and only then
//! are these loops vectorised.

use super::columns::{Column, POINTS};
use super::painted::Painted;
use crate::math::Vec3;
use crate::render::shade::{MetalRoughBsdf, PhongBsdf};

/// The BSDF at each point of a batch.
pub(super) trait PointBsdf {
    type Bsdf;

    fn at(&self, i: usize) -> Self::Bsdf;
}

/// One BSDF at all points.
pub(super) struct Uniform<B>(pub B);

/// The BSDF of a material, with the inputs that maps and vertices give each point.
pub(super) struct Mapped<'a, B> {
    pub painted: &'a Painted,
    pub unmapped: B,
}

impl<B: Copy> PointBsdf for Uniform<B> {
    type Bsdf = B;

    #[inline(always)]
    fn at(&self, _: usize) -> B {
        self.0
    }
}

impl PointBsdf for Mapped<'_, PhongBsdf> {
    type Bsdf = PhongBsdf;

    #[inline(always)]
    fn at(&self, i: usize) -> PhongBsdf {
        self.painted.phong(i, &self.unmapped)
    }
}

impl PointBsdf for Mapped<'_, MetalRoughBsdf> {
    type Bsdf = MetalRoughBsdf;

    #[inline(always)]
    fn at(&self, i: usize) -> MetalRoughBsdf {
        self.painted.metal_rough(i, &self.unmapped)
    }
}

/// A reflection model, evaluated at each point.
pub(super) trait Formula {
    /// BRDF × N·L at point `i`; unit vectors.
    fn reflected(&self, i: usize, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3;
}

/// Phong's diffuse term alone.
pub(super) struct Diffuse(pub PhongBsdf);

impl Formula for Diffuse {
    #[inline(always)]
    fn reflected(&self, _: usize, normal: Vec3, _: Vec3, to_light: Vec3) -> Vec3 {
        self.0.lit_with(normal, to_light, 0.0)
    }
}

/// Phong's diffuse term and highlight.
pub(super) struct Phong<'a, P> {
    pub bsdfs: &'a P,
    /// Brightness of the highlight at each point.
    pub highlights: &'a Column,
}

impl<P: PointBsdf<Bsdf = PhongBsdf>> Formula for Phong<'_, P> {
    #[inline(always)]
    fn reflected(&self, i: usize, normal: Vec3, _: Vec3, to_light: Vec3) -> Vec3 {
        self.bsdfs.at(i).lit_with(normal, to_light, self.highlights[i])
    }
}

/// Metallic-roughness.
pub(super) struct MetalRough<P>(pub P);

impl<P: PointBsdf<Bsdf = MetalRoughBsdf>> Formula for MetalRough<P> {
    #[inline(always)]
    fn reflected(&self, i: usize, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        self.0.at(i).lit(normal, view, to_light)
    }
}

/// Metallic-roughness whose highlights are widened to what a pixel's footprint sees of them.
pub(super) struct WidenedMetalRough<'a, P> {
    pub bsdfs: P,
    /// Least α² at each point.
    pub least_square: &'a Column,
}

impl<P: PointBsdf<Bsdf = MetalRoughBsdf>> Formula for WidenedMetalRough<'_, P> {
    #[inline(always)]
    fn reflected(&self, i: usize, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        self.bsdfs.at(i).at_least(self.least_square[i]).lit(normal, view, to_light)
    }
}

/// [`WidenedMetalRough`] of a body that lets light through: seen from inside it has no highlights.
pub(super) struct SidedMetalRough<'a, P> {
    pub widened: WidenedMetalRough<'a, P>,
    /// 1 where the front of a face is seen.
    pub front: &'a [u32; POINTS],
}

impl<P: PointBsdf<Bsdf = MetalRoughBsdf>> Formula for SidedMetalRough<'_, P> {
    #[inline(always)]
    fn reflected(&self, i: usize, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        let WidenedMetalRough { bsdfs, least_square } = &self.widened;
        bsdfs.at(i).at_least(least_square[i]).lit_on_side(normal, view, to_light, self.front[i] == 1)
    }
}
