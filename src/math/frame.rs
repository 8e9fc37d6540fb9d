//! The centre that coordinates are taken relative to before they are rounded to `f32`.

use super::DVec3;

/// The centre of the box `lo..hi`, snapped to multiples of a power of two near 1/16 of the longest side.
///
/// Snapping makes the subtraction exact for most coordinates, and gives a model moved by a multiple of that power the
/// same rounded coordinates as the model in its place. Off the true centre by at most 1/16 of the longest side on each
/// axis. Zero for an empty or non-finite box.
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
    // A step too small for the numbers' own spacing would change nothing but could overflow.
    if step < middle.abs().max_element() * f64::EPSILON { middle } else { (middle / step).round() * step }
}

#[cfg(test)]
mod tests {
    use super::*;

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
