//! Coordinates in `f64` -> a centre in `f64` and coordinates around it in `f32`.

use crate::math::frame::snapped_center;
use crate::math::{DVec3, Vec3};
use rayon::prelude::*;

/// Rounded positions, relative to `center`.
#[derive(Clone, Debug, Default)]
pub(super) struct Placed {
    pub center: DVec3,
    /// Not finite where the file's are not, or are too large.
    pub positions: Vec<Vec3>,
    /// Largest distance between a position and its rounded one.
    pub max_rounding: f64,
}

/// Larger coordinates count as infinite, so that sums and products of a few of them stay within `f32`'s range.
const LARGEST: f64 = 1e18;

/// Positions that one thread looks at at a time.
const POSITIONS: usize = 1 << 13;

/// Subtracts the centre of all finite positions in `f64`, then rounds.
pub(super) fn place(positions: &[DVec3]) -> Placed {
    let usable = |p: &&DVec3| p.is_finite() && p.abs().max_element() <= LARGEST;
    let nothing = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let around = |part: &[DVec3]| part.iter().filter(usable).fold(nothing(), |(lo, hi), &p| (lo.min(p), hi.max(p)));
    let both = |(lo, hi): (DVec3, DVec3), (low, high): (DVec3, DVec3)| (lo.min(low), hi.max(high));
    let (lo, hi) = positions.par_chunks(POSITIONS).map(around).reduce(nothing, both);
    let center = snapped_center(lo, hi);
    let mut rounded = vec![Vec3::NAN; positions.len()];
    let round = |(to, from): (&mut [Vec3], &[DVec3])| {
        let mut max_rounding = 0.0f64;
        for (to, p) in to.iter_mut().zip(from).filter(|(_, p)| usable(p)) {
            let exact = *p - center;
            *to = exact.as_vec3();
            max_rounding = max_rounding.max(to.as_dvec3().distance(exact));
        }
        max_rounding
    };
    let parts = rounded.par_chunks_mut(POSITIONS).zip(positions.par_chunks(POSITIONS));
    let max_rounding = parts.map(round).reduce(|| 0.0, f64::max);
    Placed { center, positions: rounded, max_rounding }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_measured_and_relative_to_the_center() {
        let far = [DVec3::new(1e7, 0.0, 0.0), DVec3::new(1e7 + 0.1, 1.0, 0.0)];
        let placed = place(&far);
        assert!((placed.center.x - 1e7).abs() < 1.0);
        assert!(placed.max_rounding > 0.0 && placed.max_rounding < 1e-8, "{}", placed.max_rounding);
    }

    #[test]
    fn positions_out_of_range_do_not_move_the_center() {
        let placed = place(&[DVec3::ZERO, DVec3::ONE, DVec3::splat(1e300), DVec3::NAN]);
        assert!(placed.center.abs().max_element() <= 1.0);
        assert!(placed.positions[2].is_nan() && placed.positions[3].is_nan());
    }
}
