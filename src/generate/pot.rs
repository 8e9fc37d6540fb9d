//! A pot with spout and handle: detail in all directions, as one mesh of any fineness.

use super::solid::Solid;
use crate::math::{DAffine3, DVec3};

/// Finest pot of at most `wanted` triangles, but never coarser than 100; about 1 wide, its foot on z = 0.
pub(super) fn pot(wanted: usize) -> Solid {
    let columns = (5..).take_while(|&c| triangles(c) <= wanted.max(triangles(5))).last().unwrap_or(5);
    let mut pot = Solid::lathe(columns, columns, body);
    let spout = |s: f64| DVec3::new(0.32 + 0.3 * s, 0.0, 0.2 + 0.26 * s * s);
    let handle = |s: f64| {
        let (sin, cos) = super::solid::turned(0.25 + 0.5 * s);
        DVec3::new(-0.3 + 0.25 * cos, 0.0, 0.3 + 0.15 * sin)
    };
    let parts = [
        Solid::tube(columns / 2, columns / 2, DVec3::Y, spout, |s| 0.09 - 0.045 * s),
        Solid::tube(columns, around_handle(columns), DVec3::Y, handle, |_| 0.035),
    ];
    parts.iter().for_each(|part| pot.place(part, &DAffine3::IDENTITY));
    pot
}

fn triangles(columns: usize) -> usize {
    2 * columns * columns - 2 * columns + 2 * (columns / 2) * (columns / 2) + 2 * columns * around_handle(columns)
}

/// Columns around the handle. A single one would give faces without area.
fn around_handle(columns: usize) -> usize {
    (columns / 3).max(2)
}

/// Profile of belly, shoulder, lid and knob, from the foot up.
fn body(s: f64) -> (f64, f64) {
    if s == 0.0 || s == 1.0 {
        return (0.0, if s == 0.0 { 0.0 } else { 0.66 });
    }
    let belly = 0.42 * libm::pow(libm::sin(std::f64::consts::PI * libm::pow(s, 0.75)), 0.6);
    let knob = 0.06 * libm::exp(-((s - 0.97) / 0.03) * ((s - 0.97) / 0.03));
    (belly.max(0.02) * (1.0 - 0.35 * s) + knob, 0.66 * s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_the_coarsest_pot_have_three_corners() {
        let pot = pot(1);
        for corners in &pot.triangles {
            let [a, b, c] = corners.map(|i| pot.points[i as usize]);
            assert!(a != b && b != c && c != a, "{corners:?}");
        }
    }

    #[test]
    fn a_pot_is_as_fine_as_is_wanted() {
        for wanted in [100, 1000, 20_000] {
            let len = pot(wanted).len();
            assert!(len <= wanted.max(100) && len * 2 > wanted, "{len} of {wanted}");
        }
    }
}
