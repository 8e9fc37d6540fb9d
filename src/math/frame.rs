//! Centre relative to which coordinates are rounded to `f32`.

use super::DVec3;

/// Centre of the box `lo..hi`, snapped to multiples of a power of two near 1/16 of the longest side.
///
/// Snapping makes the subtraction exact for most coordinates, and gives a model moved by a multiple of that power the same
/// rounded coordinates as the unmoved model. Off the true centre by at most 1/16 of the longest side on each axis. Zero for
/// an empty or non-finite box.
pub fn snapped_center(lo: DVec3, hi: DVec3) -> DVec3 {
    let extent = (hi - lo).max_element();
    let middle = lo * 0.5 + hi * 0.5;
    if !(extent.is_finite() && middle.is_finite()) || extent < 0.0 {
        return DVec3::ZERO;
    }
    if extent == 0.0 {
        return middle;
    }
    let step = libm::exp2(libm::floor(libm::log2(extent)) - 3.0);
    // A step below the numbers' own spacing would change nothing but could overflow.
    if step == 0.0 || step < middle.abs().max_element() * f64::EPSILON {
        middle
    } else {
        (middle / step).round() * step
    }
}

/// Largest number of points sampled to find where most of a model lies.
const SAMPLE: usize = 1 << 10;

/// Largest ratio of a box to the extent of half of its points for which the box is centred on its own middle: rounding to
/// `f32` then moves points by at most 2⁻¹⁷ of that extent.
const FAR: f64 = 256.0;

/// Centre for points in the box `lo..hi`: [`snapped_center`] of the box, or of the extent of half of the points if others are
/// so far away that rounding would show in these. `points` are a sample of them ([`spread`]).
pub fn center_of_most(lo: DVec3, hi: DVec3, points: impl Iterator<Item = DVec3>) -> DVec3 {
    let extent = |lo: DVec3, hi: DVec3| (hi - lo).max_element();
    match half_of(points) {
        Some((low, high)) if extent(lo, hi) > FAR * extent(low, high) => snapped_center(low, high),
        _ => snapped_center(lo, hi),
    }
}

/// Extent, from corner to corner, of the middle half of the finite points on each axis; `None` if there are none.
pub fn half_of(points: impl Iterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    let mut sample: Vec<DVec3> = points.filter(|p| p.is_finite()).collect();
    let (quarter, last) = (sample.len() / 4, sample.len().checked_sub(1)?);
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        sample.sort_unstable_by(|a, b| a[axis].total_cmp(&b[axis]));
        (low[axis], high[axis]) = (sample[quarter][axis], sample[last - quarter][axis]);
    }
    Some((low, high))
}

/// Indices of a sample of `count` points, spread evenly.
pub fn spread(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(stride(count))
}

/// Step between sampled points out of `count`.
pub fn stride(count: usize) -> usize {
    count.div_ceil(SAMPLE).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_points_far_away_do_not_move_the_center_of_the_others() {
        let near = |i: usize| DVec3::new(5e5 + i as f64 * 0.01, 4e6 - i as f64 * 0.02, 0.0);
        let points = |strays: usize| (0..100 + strays).map(move |i| if i < strays { DVec3::ZERO } else { near(i) });
        let center = |strays: usize| center_of_most(DVec3::ZERO, DVec3::new(5e5 + 2.0, 4e6, 0.0), points(strays));
        for strays in [0, 1, 20] {
            assert!((center(strays) - near(50)).length() < 4.0, "{strays}: {}", center(strays));
        }
        // If a third of the points lies there, it is a part of the model.
        assert!((center(60) - near(50)).length() > 1e6);
        assert_eq!(center_of_most(-DVec3::ONE, DVec3::ONE, std::iter::empty()), DVec3::ZERO);
        let all: Vec<usize> = spread(5000).collect();
        assert!(all.len() == 1000 && all[999] == 4995 && spread(3).eq(0..3) && spread(0).count() == 0);
    }

    #[test]
    fn a_box_moved_by_a_large_power_of_two_moves_its_center_by_exactly_that() {
        let (lo, hi) = (DVec3::new(-0.0947, 0.0330, -0.0619), DVec3::new(0.0610, 0.1873, 0.0588));
        let shift = DVec3::splat(1048576.0);
        assert_eq!(snapped_center(lo + shift, hi + shift), snapped_center(lo, hi) + shift);
    }

    #[test]
    fn degenerate_boxes_have_a_finite_center() {
        assert_eq!(snapped_center(DVec3::splat(3.0), DVec3::splat(3.0)), DVec3::splat(3.0));
        assert_eq!(snapped_center(DVec3::INFINITY, DVec3::NEG_INFINITY), DVec3::ZERO);
        assert_eq!(snapped_center(DVec3::splat(f64::NAN), DVec3::ONE), DVec3::ZERO);
    }
}
