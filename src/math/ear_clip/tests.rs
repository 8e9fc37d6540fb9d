//! Hand-made and random polygons.

use super::*;
use proptest::prelude::*;
use std::collections::HashMap;

fn plane(points: &[(i32, i32)]) -> Vec<DVec3> {
    points.iter().map(|&(x, y)| DVec3::new(f64::from(x), f64::from(y), 0.0)).collect()
}

fn cut(points: &[DVec3]) -> (Vec<[u32; 3]>, Outcome) {
    let mut out = Vec::new();
    let outcome = EarClipper::default().cut(points, &mut out);
    (out, outcome)
}

fn area2(points: &[DVec3], t: [u32; 3]) -> f64 {
    let [a, b, c] = t.map(|i| points[i as usize]);
    (b - a).cross(c - a).z
}

/// Asserts an exact result, for small integers: all areas positive, their sum the polygon's, n − 2 triangles, every side of
/// the polygon a side of exactly one triangle, every other side shared by two.
fn assert_exact(points: &[DVec3]) {
    let (triangles, outcome) = cut(points);
    assert_eq!(outcome, Outcome::Exact, "{points:?}");
    assert_eq!(triangles.len(), points.len() - 2);
    assert!(triangles.iter().all(|&t| area2(points, t) > 0.0), "{triangles:?}");
    assert_eq!(triangles.iter().map(|&t| area2(points, t)).sum::<f64>(), newell(points).z);
    let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
    for [a, b, c] in triangles {
        [(a, b), (b, c), (c, a)].iter().for_each(|&s| *sides.entry(s).or_default() += 1);
    }
    let n = points.len() as u32;
    for (&(a, b), &count) in &sides {
        let boundary = (a + 1) % n == b;
        assert_eq!(count, 1);
        assert_eq!(sides.contains_key(&(b, a)), !boundary, "side {a}-{b} of {points:?}");
    }
}

#[test]
fn a_concave_arrow_is_cut_inside_its_notch() {
    assert_exact(&plane(&[(0, 0), (4, 0), (1, 1), (0, 4)]));
    assert_exact(&plane(&[(0, 4), (0, 0), (4, 0), (1, 1)]));
    assert_exact(&plane(&[(0, 0), (5, 0), (5, 5), (4, 1), (3, 5), (2, 1), (1, 5)]));
}

#[test]
fn corners_on_straight_sides_stay_corners() {
    assert_exact(&plane(&[(0, 0), (1, 0), (2, 0), (3, 0), (0, 3)]));
    assert_exact(&plane(&[(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]));
    assert_exact(&plane(&[(0, 0), (1, 0), (2, 0), (2, 2)]));
}

#[test]
fn a_comb_of_many_teeth_is_cut_in_little_time() {
    let teeth = 150_000;
    let mut points = vec![(0, -1), (2 * teeth, -1)];
    points.extend((0..2 * teeth).rev().map(|x| (x, if x % 2 == 0 { 10 } else { 0 })));
    let start = std::time::Instant::now();
    assert_exact(&plane(&points));
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn a_hole_joined_by_a_bridge_stays_open() {
    let square = [(0, 0), (6, 0), (6, 6), (0, 6), (0, 0), (2, 2), (2, 4), (4, 4), (4, 2), (2, 2)];
    assert_exact(&plane(&square));
    // The bridge may touch the hole's ring anywhere, and two holes may share the position of one corner.
    let two = [
        (0, 0),
        (9, 0),
        (9, 9),
        (0, 9),
        (0, 0),
        (1, 5),
        (1, 6),
        (2, 6),
        (2, 5),
        (1, 5),
        (0, 0),
        (5, 1),
        (5, 2),
        (6, 2),
        (6, 1),
        (5, 1),
    ];
    assert_exact(&plane(&two));
}

#[test]
fn a_polygon_that_touches_itself_in_corners_is_cut_lobe_by_lobe() {
    let chain = |lobes: i32| {
        let there = (0..lobes).flat_map(|i| [(4 * i, 0), (4 * i + 2, -2)]);
        let back = (0..lobes).rev().flat_map(|i| [(4 * i + 4, 0), (4 * i + 2, 2)]);
        plane(&there.chain(back).collect::<Vec<_>>())
    };
    let bow = plane(&[(-4, -4), (0, 0), (4, -4), (4, 4), (0, 0), (-4, 4)]);
    for (mut points, area) in [(bow, 32.0), (chain(2), 16.0), (chain(50), 400.0)] {
        for _ in 0..points.len() {
            let (triangles, outcome) = cut(&points);
            assert_ne!(outcome, Outcome::Crossing, "{points:?}");
            let areas: Vec<f64> = triangles.iter().map(|&t| 0.5 * area2(&points, t)).collect();
            assert!(areas.iter().all(|&a| a >= 0.0) && areas.iter().sum::<f64>() == area, "{points:?}: {areas:?}");
            points.rotate_left(1);
        }
    }
}

#[test]
fn loops_that_turn_the_other_way_are_no_lobes() {
    let eight = plane(&[(-4, -4), (0, 0), (4, 4), (4, -4), (0, 0), (-4, 4)]);
    assert_eq!(cut(&eight).1, Outcome::Crossing);
}

#[test]
fn spikes_and_repeated_corners_are_cut_off() {
    let (triangles, outcome) = cut(&plane(&[(0, 0), (4, 0), (9, 0), (4, 0), (4, 4), (0, 4)]));
    assert_ne!(outcome, Outcome::Crossing);
    let points = plane(&[(0, 0), (4, 0), (9, 0), (4, 0), (4, 4), (0, 4)]);
    assert_eq!(triangles.iter().map(|&t| area2(&points, t)).sum::<f64>(), 32.0);

    let repeated = plane(&[(0, 0), (0, 0), (4, 0), (4, 4), (4, 4), (0, 4), (0, 0)]);
    let (triangles, outcome) = cut(&repeated);
    assert_eq!((triangles.len(), outcome), (2, Outcome::Exact));
}

#[test]
fn a_polygon_without_area_keeps_its_distinct_corners_and_is_told() {
    let (triangles, outcome) = cut(&plane(&[(0, 0), (1, 0), (2, 0), (3, 0)]));
    assert_eq!(outcome, Outcome::Degenerate);
    for corner in 0..4 {
        assert!(triangles.iter().flatten().any(|&c| c == corner), "{triangles:?}");
    }
    assert_eq!(cut(&plane(&[(1, 1), (1, 1), (1, 1), (1, 1)])).0, [[0u32; 3]; 0]);
    assert_eq!(cut(&plane(&[(0, 0), (1, 1), (0, 0), (1, 1)])).0, [[0u32; 3]; 0]);
    assert_eq!(cut(&[]).0, [[0u32; 3]; 0]);
}

#[test]
fn a_polygon_that_crosses_itself_still_ends_and_is_told() {
    assert_eq!(cut(&plane(&[(0, 0), (4, 4), (4, 0), (0, 4)])).1, Outcome::Crossing);
    let knot: Vec<_> = (0..2000).map(|i| (i * 7919 % 1009, i * 104_729 % 997)).collect();
    let (triangles, outcome) = cut(&plane(&knot));
    assert_eq!(outcome, Outcome::Crossing);
    assert!(triangles.len() > 1000);
}

#[test]
fn a_warped_quad_is_cut_along_the_shorter_diagonal_and_a_tie_at_its_first_corner() {
    let warped = |z: f64| [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, z), DVec3::Y];
    assert_eq!(cut(&warped(0.5)).0, [[0, 1, 3], [1, 2, 3]]);
    assert_eq!(cut(&warped(0.0)).0, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_warped_quad_that_crosses_itself_along_an_axis_is_cut_as_its_normal_sees_it() {
    let points = [(2.0, 3.0, 0.0), (6.0, 5.0, 3.0), (4.0, 0.0, 0.0), (5.0, 2.0, 4.0)].map(DVec3::from);
    let ring = distinct_neighbours(&points);
    let along_axis = |p: DVec3| project(p, newell(&points));
    let outcome = EarClipper::default().cut_seen(&points, &ring, along_axis, &mut Vec::new());
    assert_eq!(outcome, Outcome::Crossing);
    assert_ne!(cut(&points).1, Outcome::Crossing);
}

#[test]
fn a_polygon_seen_along_any_axis_from_either_side_keeps_its_winding() {
    let flat = plane(&[(0, 0), (4, 0), (1, 1), (0, 4)]);
    let turns: [fn(DVec3) -> DVec3; 3] = [|p| p, |p| DVec3::new(p.z, p.x, p.y), |p| DVec3::new(p.y, p.z, p.x)];
    for turn in turns {
        let mut points: Vec<_> = flat.iter().map(|&p| turn(p)).collect();
        for _ in 0..2 {
            let normal = newell(&points);
            let (triangles, outcome) = cut(&points);
            assert_eq!(outcome, Outcome::Exact);
            for t in triangles {
                let [a, b, c] = t.map(|i| points[i as usize]);
                assert!((b - a).cross(c - a).dot(normal) > 0.0);
            }
            points.reverse();
        }
    }
}

#[test]
fn a_comb_of_ten_thousand_teeth_is_cut_in_a_moment() {
    let teeth = (0..10_000).flat_map(|i| [(i * 2, if i % 3 == 0 { 1000 } else { 900 }), (i * 2 + 1, 1)]);
    let mut points: Vec<_> = [(20_000, 0), (-1, 0)].into_iter().collect();
    points.extend(teeth);
    points.reverse();
    assert_exact(&plane(&points));
}

#[test]
fn a_polygon_that_goes_round_a_triangle_very_often_is_cut_in_little_time() {
    let points: Vec<_> = (0..300_000).map(|i| [(0, 0), (1, 0), (1, 1)][i % 3]).collect();
    let mut triangles = Vec::new();
    EarClipper::default().cut(&plane(&points), &mut triangles);
    assert_eq!(triangles.len(), 100_000);
}

proptest! {
    /// Corners sorted around the origin make a polygon that does not cross itself; straight runs are frequent on such a
    /// coarse lattice.
    #[test]
    fn polygons_around_a_point_are_cut_exactly(corners in prop::collection::vec((-6i32..7, -6i32..7), 3..40)) {
        let mut by_angle: Vec<(i32, i32)> = corners.into_iter().filter(|&c| c != (0, 0)).collect();
        by_angle.sort_by(|a, b| f64::from(a.1).atan2(f64::from(a.0)).total_cmp(&f64::from(b.1).atan2(f64::from(b.0))));
        by_angle.dedup_by(|a, b| a.0 * b.1 == a.1 * b.0 && a.0 * b.0 + a.1 * b.1 > 0);
        // The origin must lie inside: neighbours less than half a turn apart.
        let n = by_angle.len();
        let turns_left = |i: usize| {
            let (a, b) = (by_angle[i], by_angle[(i + 1) % n]);
            a.0 * b.1 - a.1 * b.0 > 0
        };
        prop_assume!(n >= 4 && (0..n).all(turns_left));
        assert_exact(&plane(&by_angle));
    }

    #[test]
    fn any_ring_of_points_ends_without_a_triangle_of_equal_corners(
        corners in prop::collection::vec((-3i32..4, -3i32..4, -1i32..2), 0..30)
    ) {
        let points: Vec<_> = corners.iter().map(|&(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z))).collect();
        let (triangles, _) = cut(&points);
        prop_assert!(triangles.len() <= points.len().saturating_sub(2));
    }
}
