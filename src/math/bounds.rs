//! Every small constant of the numeric code, with its derivation; and the offset of secondary rays, which uses a hit's error.
//!
//! Notation: u is the unit roundoff, fl(x) = x (1 + δ) with |δ| ≤ u. γ(n) = n u / (1 − n u) bounds the relative error of
//! n such factors (N. Higham, *Accuracy and Stability of Numerical Algorithms*, 2002, lemma 3.1).

use super::Vec3;
use super::simd::Lanewise;

/// Unit roundoff of `f32`: 2⁻²⁴.
pub const U32: f32 = f32::EPSILON / 2.0;

/// Unit roundoff of `f64`: 2⁻⁵³.
pub const U64: f64 = f64::EPSILON / 2.0;

/// Bound of the relative error of `n` roundings in `f32`.
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * U32;
    nu / (1.0 - nu)
}

/// Covers second-order terms and the rounding of the bound itself wherever a first-order bound is scaled by it: those add
/// fewer than 20 roundings, 20 u < 2⁻¹⁰. Not a bound of its own: it completes the proofs of the bounds it is part of.
const SLACK: f32 = 1.0 + 1.0 / 1024.0;

/// Margins of the triangle test's filter for an edge value of sheared ray space, computed in `f32`.
#[derive(Clone, Copy, Debug)]
pub struct EdgeMargins {
    /// Unit roundoff on which the bound is based.
    pub rounding: f32,
    /// Exceeds every absolute error caused by underflow.
    pub underflow: f32,
    /// Error bound from which on an edge value may have overflowed.
    pub overflow: f32,
}

impl EdgeMargins {
    /// Margins of the library, derived as follows.
    ///
    /// D ≥ |a − o| of the corners in the maximum norm, M ≥ their sheared |x'|, |y'|. With s = d_x/d_z, |s| ≤ 1: fl(a − o)
    /// errs by u D, fl(s) by u, their product by u, the subtraction by u M. So a sheared corner is displaced by at most
    /// e = 4 u D + u M, and fl(fl(Cx·By) − fl(Cy·Bx)) by 4 e M + 2 e² + 4 u M². With d = u (2 D + M) that is less than
    /// 8 d (M + d).
    ///
    /// *Underflow.* Each product that underflows errs by at most 2⁻¹⁵⁰; one of the shear moves a corner by as much, which
    /// counts M-fold. Those of the edge value and of the bound's own terms sum to 2⁻¹⁵⁰ (8 M + 12) at most: below 2⁻¹⁴⁵ for
    /// M ≤ 1, and below the slack of the M² term for larger M. The smallest normal number is more, and quick to add.
    ///
    /// *Overflow.* While the bound is below 2¹⁰⁰, M² is below 2¹²², and no product has overflowed.
    pub const DERIVED: Self =
        Self { rounding: U32 * SLACK, underflow: f32::MIN_POSITIVE, overflow: (1u128 << 100) as f32 };

    /// Margins for triangles whose distances are wanted, too: sums of certain edge values are so far above the smallest
    /// numbers that their products with heights, 2⁻¹⁴⁹ off when they underflow, do not matter. They are then off by 2⁻⁷⁹ of
    /// the sum.
    pub const WITH_DISTANCES: Self = Self { underflow: 1.0 / (1u128 << 70) as f32, ..Self::DERIVED };

    /// Bound of the error of an edge value; `reach` is D, `spread` M.
    #[inline(always)]
    pub fn error(&self, reach: f32, spread: f32) -> f32 {
        let displaced = 8.0 * self.rounding * (reach + reach + spread);
        displaced * (spread + 0.125 * displaced) + self.underflow
    }

    /// The bound in lanes, for shears that are products with a reciprocal and err by 2 u, and for triangles whose corners are
    /// at most `height`, Z, from the origin along the ray's main axis. A sheared corner is then displaced by 5 u D + u M, and
    /// d = u (5/2 D + M). As every shear is at most 1 in size, D ≤ Z + M, and with r for the rounding 8 r (5/2 Z + 7/2 M) (M
    /// + r (5/2 Z + 7/2 M)) ≤ M (28 r M + 20 r Z) + 100 r² Z² + 196 r² M².
    #[inline(always)]
    pub fn error_by_height<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        height: S::Lanes,
        spread: S::Lanes,
    ) -> S::Lanes {
        let r = self.rounding;
        let product = s.mul(height, s.splat(20.0 * r));
        let slope = s.mul_add(spread, s.splat(28.0 * r + 196.0 * r * r), product);
        // 100 = 20² / 4.
        let constant = s.mul_add(s.mul(product, s.splat(0.25)), product, s.splat(self.underflow));
        s.mul_add(slope, spread, constant)
    }

    /// [`Self::error`] in lanes; `reach` is D in every lane.
    #[inline(always)]
    pub fn error_lanes<S: Lanewise<N>, const N: usize>(&self, s: S, reach: S::Lanes, spread: S::Lanes) -> S::Lanes {
        let displaced = s.mul(s.splat(8.0 * self.rounding), s.add(s.add(reach, reach), spread));
        let product = s.mul(displaced, s.add(spread, s.mul(s.splat(0.125), displaced)));
        s.add(product, s.splat(self.underflow))
    }
}

/// Displacement of the mean of three heights when its weights err, relative to the terms in `math::triangles`.
pub const WEIGHTS: f32 = 3.0 * SLACK;

/// Error of a mean of heights, relative to the largest possible height; see `math::triangles`.
pub const HEIGHTS: f32 = 16.0 * U32;

/// Error of an edge value of `math::fan`, relative to D G: D ≥ |a − o| of the corners, G ≥ the edges, in the maximum norm.
///
/// A component of corner × edge is two products of at most D G, of which each factor errs by u, each product and their
/// difference by u: 8 u D G. The value is one such component and two times a shear of at most 1, which errs by 2 u: 3 · 8 u
/// D G + 2 · 2 u · 2 D G. Two products, and sums of at most 4 and 6 D G: 14 u D G. Together 46 u D G.
///
/// Six times the volume between origin and triangle is such a component times a corner, three times: 3 · 8 u D² G, 6 u D² G
/// for the corner's rounding, and 16 u D² G for three products and two sums: 46 u D² G, too.
pub const FAN_EDGE: f32 = 46.0 * U32 * SLACK;

/// Unit roundoff on which the bound of an edge value in `f64` is based.
pub const EDGE_ROUNDING_F64: f64 = U64 * SLACK as f64;

/// [`EdgeMargins::error`] for the same computation in `f64`, where nothing made of `f32` inputs over- or underflows.
#[inline]
pub fn edge_error_f64(reach: f64, spread: f64, rounding: f64) -> f64 {
    let displaced = 8.0 * rounding * (2.0 * reach + spread);
    displaced * (spread + 0.125 * displaced)
}

/// Error of the sheared height y' of a corner, computed in `f64`, relative to D: displaced as in [`EdgeMargins::DERIVED`] by
/// 4 u D + u M with M ≤ 2 D, and 1 u for second-order terms.
pub const HEIGHT_F64: f64 = 7.0 * U64;

/// Error of n·a (n = e₁ × e₂; e₁, e₂, a rounded differences) in `f64`, relative to the sum of the absolute values of its
/// terms: 2 differences, product, subtraction, difference, product and 2 sums, 8 roundings.
pub const PLANE_TERMS_F64: f64 = 8.0 * U64 * (SLACK as f64);

/// Relative error of approximating an exact sum by its terms' leading part, and of a quotient of two such sums. An
/// approximation errs by less than 2 u (Shewchuk 1997), a quotient of two by 4 u + u; doubled.
pub const EXACT_QUOTIENT: f64 = 10.0 * U64;

/// Largest relative error with which a computed t of a planar prim may place the hit: it moves the hit by 2⁻¹⁶ of the
/// rounding of its position to `f32`.
pub const POSITION_T: f64 = 1.0 / (1u64 << 40) as f64;

/// Distance from the mantle of a point projected onto a cone, on each axis, relative to the length of its axis plus its
/// radius there: the unit axis errs by 4 u, and the direction away from it by as much in addition, which leaves the point on
/// the mantle of a cone turned by 8 u; position, radius and sum add 6 u.
pub const CONE_PROJECTION: f64 = 16.0 * U64;

/// Relative enlargement of spheres and cones where boxes cull them: 2⁻⁴⁰ of their size.
///
/// Near the start of a ray, where a distance is no more than that, its error is absolute: at a tangent it is the root of the
/// discriminant's error in numbers of 106 digits, 2⁻⁴⁷ of the size for rays from within 2⁸ of it; elsewhere it is relative.
/// The same holds for how far the line may pass outside the rim and count as a hit.
pub const ROUND_ROOM: f32 = 1.0 / (1u64 << 40) as f32;

/// Lag of the walk through cells, relative to t: a prim not seen yet has an exact t beyond the exit of the cell, and its
/// rounded t may be half an ulp (u) lower. Doubled twice for spheres and cones, whose t is not correctly rounded.
pub const WALK_MARGIN: f64 = 4.0 * U32 as f64;

/// Rays whose origin is farther than this many finest cells from the grid's corner are answered without culling.
pub const RAY_CELLS: f64 = (1u64 << 38) as f64;

/// Padding of a cell, in finest cells, when prims are assigned to it: 2⁻⁹.
///
/// The walk places a ray in `f64`. Let O be the distance of its origin and R that of the cell from the grid's corner: the
/// origin is placed with 2 roundings, 2 u O; a plane is met after 4 more on their difference, 4 u (O + R); a coordinate at a
/// distance has an error of 4 u O + 5 u R. So the exact ray is within 6 u O + 5 u R of the cell in which the walk takes it to
/// be. O is below [`RAY_CELLS`], R at most 2¹⁶, and deciding which cells a prim touches errs by 2⁻⁴⁸ R: together less than 7
/// u [`RAY_CELLS`]. The rest of 64 is for the tests of prims that are not exact.
pub const CELL_PAD: f64 = 64.0 * U64 * RAY_CELLS;

/// Margin by which the grid exceeds its content on each side, relative to its extent: 2⁻⁸. Even with one cell on an axis it
/// is more than [`CELL_PAD`], so that a ray that meets the content passes through the grid despite rounding.
pub const GRID_ROOM: f64 = 1.0 / 256.0;

/// [`RAY_CELLS`] where cells and grid must hardly exceed their content: 2³⁰.
pub const NEAR_RAY_CELLS: f64 = (1u64 << 30) as f64;

/// [`CELL_PAD`] for rays from within [`NEAR_RAY_CELLS`], by the same derivation: 2⁻¹⁷. Still far above the error of deciding
/// which cells a prim touches, 2⁻⁴⁸ R with R at most 2¹⁶.
pub const NEAR_CELL_PAD: f64 = 64.0 * U64 * NEAR_RAY_CELLS;

/// [`GRID_ROOM`] for these: 2⁻¹⁶, more than [`NEAR_CELL_PAD`] of one cell.
pub const NEAR_GRID_ROOM: f64 = 1.0 / 65536.0;

/// Replacement for a zero component of the direction in a walk through cells, in finest cells: no plane is met along such an
/// axis, because 10¹²⁰ times any distance is beyond every t, and no NaN arises. Smaller numbers do not occur: 2⁻¹⁴⁹ of an
/// `f32` times at least 2⁻¹²⁹ cells per unit.
pub const NO_SLOPE: f64 = 1e-120;

/// Widening of a slab distance so that a box is never missed: 3 roundings at either end.
/// (T. Ize, *Robust BVH Ray Traversal*, 2013.)
pub const SLAB: f64 = 2.0 * 3.0 * U64 / (1.0 - 3.0 * U64);

/// Relative error of a distance to a box's plane in `f32`, fl(fl(plane − origin) · fl(1/d)): 3 roundings. The entry of a ray
/// that meets the box then exceeds its exit by less than twice the error of either, in size; doubled again for the rounding
/// of the comparison itself.
pub const SLAB_F32: f32 = 4.0 * gamma(3);

/// Distance beyond the end of a ray's range up to which a box of `f32` planes must still be entered, relative: its entry errs
/// by 3 u, and t as in [`WALK_MARGIN`].
pub const BOX_MARGIN: f32 = SLAB_F32 + WALK_MARGIN as f32;

/// Bound of what underflow adds to a distance to a box's plane and to the margins above: a few times 2⁻¹⁵⁰, each. The
/// smallest normal number is more, and quick to add.
pub const BOX_UNDERFLOW: f32 = f32::MIN_POSITIVE;

/// Largest coordinate of scenes and rays that are culled by boxes in `f32`: up to here differences do not overflow.
pub const BOX_COORDINATES: f32 = f32::MAX / 4.0;

/// Padding of boxes where a distance to a plane is plane · (1/d) + (∓ pad − o/d), relative to the sum of the largest
/// coordinate of a box, E, and of the origin's, |o|.
///
/// The reciprocal, its products with plane, origin and pad, and two sums are rounded once each: u (2 |plane − o| + 2 |o| +
/// |plane| + 3 pad) over |d|, less than 5 u (E + |o|). Directions that are nearly parallel to the plane need more
/// ([`PARALLEL`]).
pub const BOX_PAD: f32 = 8.0 * U32;

/// Smallest component of a direction, relative to the largest one; smaller components are raised to it. Within the boxes a
/// ray goes no farther than E + |o| along its largest component, so along such an axis it moves by less than this fraction of
/// E and all of |o|, which is added to the pad.
pub const PARALLEL: f32 = 1.0 / (1u32 << 30) as f32;

/// Largest size of E + |o| and of a direction (sums of the sizes of components), and the reciprocal of the smallest, for
/// which these bounds hold: reciprocals are then below 2⁶⁸ and their products below 2¹⁰⁵, edge values and heights below 2¹¹⁶,
/// and the pad over a direction's component is above 2⁻¹⁰³ by what [`PARALLEL`] adds to it alone.
pub const BOX_RANGE: f32 = (1u64 << 36) as f32;

/// [`BOX_PAD`] for a ray transformed into the frame of an object: its origin and direction are rounded there, which adds u
/// |o| and, as far as the boxes reach, u (E + |o|).
pub const PLACED_PAD: f32 = BOX_PAD + 2.0 * U32;

/// Further padding on every axis, relative to E + |o|: for [`PARALLEL`], and for the error of the transform in `f64`. With C
/// ≤ [`PLACED_CONDITION`], a difference, three products and two sums err by less than 5 · 2⁻⁵³ C |o| in the origin, the same
/// without the difference in the direction: 2⁻³⁴ (E + |o|) together.
pub const PLACED_DRIFT: f32 = 2.0 * PARALLEL;

/// Largest condition number of a matrix by which rays are transformed, in the maximum norm: how much more some directions are
/// stretched than others.
pub const PLACED_CONDITION: f64 = (1u64 << 16) as f64;

/// Largest factor by which a placed object may be enlarged or reduced, so that ordinary rays stay within [`BOX_RANGE`].
pub const PLACED_SCALE: f64 = (1u64 << 24) as f64;

/// Largest displacement of corners by rounding, relative to the object's size: beyond it, boxes would cull little.
pub const PLACED_ROOM: f32 = 1.0 / 1024.0;

/// Largest difference between two ways, both in `f32`, to compute the texture coordinates of a hit on a face: from the
/// barycentric weights of the hit, and from the face's plane n·x = c and the gradients of the coordinates along it. Relative
/// to P G ℓ + Q: P = |o| + |t d| + |c|, G the largest growth of a coordinate per length, ℓ = |d|/|n·d|, and Q the sizes of
/// the coordinates at corners and hit, of what is added to them, and of G times the corners.
///
/// *Plane.* n·o errs by 4 u √3 |o| with the rounding of n, the difference to c by 9 u |o| + 2 u |c|, and n·d by 4 u ℓ
/// relative to itself: along the ray the hit is off by less than ℓ u (9 |o| + 2 |c| + 6 |t d|), and by 2 u (|o| + |t d|) when
/// it is computed from t. Gradients, their three products and three sums add 7 u G (2 |o| + |t d|), and the coordinates at
/// the origin, Q of size, 2 u Q: together less than 25 u P G ℓ + 2 u Q.
///
/// *Weights.* Two are correctly rounded, the third errs by 2 u; three products and three sums: 8 u Q. A length of texels adds
/// u Q. The rest of 64 is for the rounding of these sizes themselves.
pub const FACE_COORDINATE: f32 = 64.0 * U32;

/// Distance of a secondary ray's start from the edges of its face, in units of the error of its position.
///
/// [`offset_origin`] leaves the face by at most 3 errors. A face that rises from the edge at an angle α is at that distance
/// from the edge higher than the start if tan α > 3/64 ([`EDGE_FOLD`]): from 2.7° on. The displacement is 4·10⁻⁶ of the
/// position.
pub const EDGE_ROOM: f64 = 64.0;

/// Tangent of the smallest angle at which a face may rise over another from a shared edge, so that starts on the other face
/// lie below it.
pub const EDGE_FOLD: f64 = 3.0 / EDGE_ROOM;

/// Start of a secondary ray: outside the box `position ± error` on the side of the surface that `dir` leaves to.
///
/// `normal` is the unit geometric normal, either side. The position moves along it by Σ|nₖ| errorₖ, the support of the
/// error box, and each moved coordinate is rounded one float outwards (M. Pharr, W. Jakob, G. Humphreys, *Physically
/// Based Rendering*, 2023, 6.8.6). The slack covers the rounding of the normal and of the sum: 8 u < 2⁻¹⁰.
#[inline(always)]
pub fn offset_origin(position: Vec3, error: Vec3, normal: Vec3, dir: Vec3) -> Vec3 {
    let distance = normal.abs().dot(error) * SLACK;
    let side = if normal.dot(dir) < 0.0 { -distance } else { distance };
    let offset = normal * side;
    Vec3::new(moved(position.x, offset.x), moved(position.y, offset.y), moved(position.z, offset.z))
}

/// x + way, one float farther in that direction; x itself if `way` is zero.
///
/// Floats of one sign are ordered by their bits, so that the next one in a direction is found without branching.
#[inline(always)]
fn moved(x: f32, way: f32) -> f32 {
    const SIGN: u32 = 1 << 31;
    let sum = x + way;
    let apart = (sum.to_bits() ^ way.to_bits()) >> 31;
    let further = sum.to_bits().wrapping_add(1).wrapping_sub(apart << 1);
    let from_zero = way.to_bits() & SIGN | 1;
    let next = f32::from_bits(if sum == 0.0 { from_zero } else { further });
    let next = if sum.is_finite() { next } else { sum };
    if way.abs() > 0.0 { next } else { x }
}

/// Next float above a non-negative one; infinity above the largest, and for NaN.
#[inline(always)]
pub(crate) fn above(x: f32) -> f32 {
    f32::from_bits(x.to_bits().min(f32::MAX.to_bits()) + 1)
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
    fn what_is_moved_ends_at_the_float_next_to_the_sum() {
        let tiny = f32::from_bits(1);
        let numbers = [0.0, -0.0, tiny, -tiny, 1e-30, -1e-30, 1.0, -1.0, 0.75, -3.5, f32::MAX, f32::MIN];
        for (x, way) in numbers.into_iter().flat_map(|x| numbers.map(|way| (x, way))) {
            let sum = x + way;
            let expected = match way {
                _ if sum.is_infinite() => sum,
                way if way > 0.0 => sum.next_up(),
                way if way < 0.0 => sum.next_down(),
                _ => x,
            };
            assert_eq!(moved(x, way).to_bits(), expected.to_bits(), "{x} {way}");
        }
        for x in numbers.map(f32::abs).into_iter().chain([f32::INFINITY]) {
            assert_eq!(above(x), x.next_up());
        }
        assert_eq!([f32::NAN, -f32::NAN].map(above), [f32::INFINITY; 2]);
    }

    #[test]
    fn without_error_an_origin_still_leaves_no_coordinate_behind() {
        let p = Vec3::new(5.0, 0.0, 0.0);
        assert_eq!(offset_origin(p, Vec3::ZERO, Vec3::X, Vec3::X), p);
    }
}
