//! Every small constant of the numeric code, with where it comes from; and the one rule that uses the hit's error.
//!
//! Notation: u is the unit roundoff, fl(x) = x (1 + δ) with |δ| ≤ u. γ(n) = n u / (1 − n u) bounds the relative error of
//! n such factors (N. Higham, *Accuracy and Stability of Numerical Algorithms*, 2002, lemma 3.1).

use super::Vec3;
use super::simd::Simd;

/// Unit roundoff of `f32`: 2⁻²⁴.
pub const U32: f32 = f32::EPSILON / 2.0;

/// Unit roundoff of `f64`: 2⁻⁵³.
pub const U64: f64 = f64::EPSILON / 2.0;

/// Bound of the relative error of `n` roundings in `f32`.
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * U32;
    nu / (1.0 - nu)
}

/// Covers second-order terms and the rounding of the bound itself wherever a first-order bound is scaled by it: those
/// add fewer than 20 roundings, 20 u < 2⁻¹⁰.
const SLACK: f32 = 1.0 + 1.0 / 1024.0;

/// Larger than every absolute error that underflow adds to an `f32` edge value, 2⁻¹²⁰.
///
/// Each product that underflows errs by at most 2⁻¹⁵⁰, and a shear product that does is multiplied by the spread M. For
/// M ≤ 2²⁷ that stays below 2⁻¹²⁰; for larger M it is below the slack of the 4 u M² term.
const EDGE_UNDERFLOW: f32 = f32::MIN_POSITIVE * 64.0;

/// From here up an `f32` edge value may have overflowed: its products are below 2¹²⁸ while [`edge_error_f32`] stays
/// below this, since M² ≥ 2¹²⁷ makes the bound at least 4 u M² ≥ 2¹⁰⁵.
pub const EDGE_OVERFLOW: f32 = (1u128 << 100) as f32;

/// How far an edge value in sheared ray space, computed in `f32`, may be from its exact value.
///
/// `reach` D ≥ |a − o| of the corners in the maximum norm, `spread` M ≥ their sheared |x'|, |y'|.
/// With s = d_x/d_z, |s| ≤ 1: fl(a − o) errs by u D, fl(s) by u, their product by u, the subtraction by u M. So a sheared
/// corner is displaced by at most e = 4 u D + u M, and fl(fl(Cx·By) − fl(Cy·Bx)) by 4 e M + 2 e² + 4 u M².
#[inline]
pub fn edge_error_f32(reach: f32, spread: f32) -> f32 {
    let e = 4.0 * U32 * reach + U32 * spread;
    (4.0 * e * spread + 2.0 * e * e + 4.0 * U32 * spread * spread) * SLACK + EDGE_UNDERFLOW
}

/// [`edge_error_f32`] in eight lanes.
#[inline(always)]
pub fn edge_error_lanes<S: Simd>(s: S, reach: S::Lanes, spread: S::Lanes) -> S::Lanes {
    let e = s.add(s.mul(s.splat(4.0 * U32), reach), s.mul(s.splat(U32), spread));
    let four = s.splat(4.0);
    let first = s.mul(s.mul(four, e), spread);
    let second = s.mul(s.mul(s.splat(2.0), e), e);
    let third = s.mul(s.mul(s.splat(4.0 * U32), spread), spread);
    s.add(s.mul(s.add(s.add(first, second), third), s.splat(SLACK)), s.splat(EDGE_UNDERFLOW))
}

/// As [`edge_error_f32`] for the same computation in `f64`, where nothing made of `f32` inputs over- or underflows.
#[inline]
pub fn edge_error_f64(reach: f64, spread: f64) -> f64 {
    let e = 4.0 * U64 * reach + U64 * spread;
    (4.0 * e * spread + 2.0 * e * e + 4.0 * U64 * spread * spread) * SLACK as f64
}

/// Relative to the sum of the absolute values of its terms, how far n·a (n = e₁ × e₂; e₁, e₂, a rounded differences)
/// is from exact in `f64`: 2 differences, product, subtraction, difference, product and 2 sums, 8 roundings.
pub const PLANE_TERMS_F64: f64 = 8.0 * U64 * (SLACK as f64);

/// Relative error of approximating an exact sum by the sum of its terms' leading part, and of a quotient of two such.
/// An approximation errs by less than 2 u (Shewchuk 1997), a quotient of two by 4 u + u; doubled.
pub const EXACT_QUOTIENT: f64 = 10.0 * U64;

/// A computed t of a planar prim is good enough to place the hit when its relative error is below this: it moves the
/// hit by 2⁻¹⁶ of the rounding of its position to `f32`.
pub const POSITION_T: f64 = 1.0 / (1u64 << 40) as f64;

/// What the walk through cells may lag behind, relative to t: a prim not seen yet has an exact t beyond the exit of the
/// cell, and its rounded t may be half an ulp (u) lower. Doubled twice for spheres, whose t is not correctly rounded.
pub const WALK_MARGIN: f64 = 4.0 * U32 as f64;

/// How much larger than its content, in finest cells, a cell is taken to be when prims are listed in it, beside
/// [`CELL_PAD_PER_CELL`] for each finest cell across the grid.
///
/// The walk places the ray with an error: plane and origin to cell units 2 u R, exit position 8 u R, membership 8 u R,
/// displacement of the tested corners 4 u R, together at most 22 u R < R 2⁻¹⁹ for a walk in `f32`. The constant part
/// keeps prims that lie in a cell's face out of harm for small R and covers [`RAY_CELLS`].
pub const CELL_PAD: f64 = 1.0 / 512.0;

/// See [`CELL_PAD`]: 2⁻¹⁹.
pub const CELL_PAD_PER_CELL: f64 = 1.0 / 524_288.0;

/// Rays whose origin is further than this many finest cells from the grid's corner are answered without culling: up to
/// here the position of a walk in `f64` errs by at most 8 · 2⁻⁵³ · 2³⁸ = 2⁻¹² cells, an eighth of [`CELL_PAD`].
pub const RAY_CELLS: f64 = (1u64 << 38) as f64;

/// Widening of a slab distance so that a box is never missed: 3 roundings at either end.
/// (T. Ize, *Robust BVH Ray Traversal*, 2013.)
pub const SLAB: f64 = 2.0 * 3.0 * U64 / (1.0 - 3.0 * U64);

/// What a distance to a box's plane in `f32`, fl(fl(plane − origin) · fl(1/d)), may be off, relative: 3 roundings. The
/// entry of a ray that meets the box then exceeds its exit by less than twice that of either, in size; doubled again
/// for the rounding of the comparison itself. Underflow adds less than [`f32::MIN_POSITIVE`].
pub const SLAB_F32: f32 = 4.0 * gamma(3);

/// How far beyond the end of a ray's range a box of `f32` planes must still be entered: its entry errs by 3 u, and t by
/// what [`WALK_MARGIN`] says.
pub const BOX_MARGIN: f32 = SLAB_F32 + WALK_MARGIN as f32;

/// Scenes and rays with coordinates beyond this are not culled by boxes in `f32`: up to here differences do not overflow.
pub const BOX_COORDINATES: f32 = f32::MAX / 4.0;

/// How far from the edges of its face a secondary ray starts, in units of the error of its position.
///
/// [`offset_origin`] leaves the face by at most 3 errors. A face that rises from the edge at an angle α is at that
/// distance from the edge higher than the start if tan α > 3/64: from 2.7° on. The way there is 4·10⁻⁶ of the position.
pub const EDGE_ROOM: f64 = 64.0;

/// The start of a secondary ray: outside the box `position ± error` on the side of the surface that `dir` leaves to.
///
/// `normal` is the unit geometric normal, either side. The position moves along it by Σ|nₖ| errorₖ, the support of the
/// error box, and each moved coordinate is rounded one float outwards (M. Pharr, W. Jakob, G. Humphreys, *Physically
/// Based Rendering*, 2023, 6.8.6). The slack covers the rounding of the normal and of the sum: 8 u < 2⁻¹⁰.
pub fn offset_origin(position: Vec3, error: Vec3, normal: Vec3, dir: Vec3) -> Vec3 {
    let distance = normal.abs().dot(error) * SLACK;
    let side = if normal.dot(dir) < 0.0 { -distance } else { distance };
    let offset = normal * side;
    let step = |p: f32, o: f32| match o {
        o if o > 0.0 => (p + o).next_up(),
        o if o < 0.0 => (p + o).next_down(),
        _ => p,
    };
    Vec3::new(step(position.x, offset.x), step(position.y, offset.y), step(position.z, offset.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_origin_leaves_the_error_box_on_the_side_of_the_direction() {
        let (p, e) = (Vec3::new(1.0, -2.0, 3.0), Vec3::splat(1e-6));
        let n = Vec3::new(0.6, 0.0, -0.8);
        for dir in [n, -n, n + Vec3::Y * 9.0] {
            let moved = offset_origin(p, e, n, dir).as_dvec3() - p.as_dvec3();
            let side = f64::from(n.dot(dir).signum());
            assert!(moved.dot(n.as_dvec3()) * side > 1.4e-6, "{moved} for {dir}");
            assert!(moved.length() < 4e-6);
        }
    }

    #[test]
    fn without_error_an_origin_still_leaves_no_coordinate_behind() {
        let p = Vec3::new(5.0, 0.0, 0.0);
        assert_eq!(offset_origin(p, Vec3::ZERO, Vec3::X, Vec3::X), p);
    }
}
