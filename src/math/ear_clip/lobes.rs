//! Lobes of a polygon that touches itself in corners: the corners between two visits of a point form a ring of their own.

use robust::Coord;
use std::collections::HashMap;

/// Splits a ring of corners where it returns to a point, if both the loop since the first visit and all the rest have
/// positive area, counter-clockwise like the whole. A loop around a hole does not, and stays in its ring.
pub(super) fn lobes(flat: &[Coord<f64>], ring: &[u32]) -> Vec<Vec<u32>> {
    let Some(first) = ring.first().map(|&i| flat[i as usize]) else { return Vec::new() };
    // Relative to one corner, so that distant coordinates do not cancel.
    let at = |i: u32| (flat[i as usize].x - first.x, flat[i as usize].y - first.y);
    let cross = |i: u32, j: u32| {
        let ((ax, ay), (bx, by)) = (at(i), at(j));
        ax * by - ay * bx
    };
    let place = |i: u32| [flat[i as usize].x, flat[i as usize].y].map(|x| (x + 0.0).to_bits());
    let last = ring.last().map_or(0.0, |&last| cross(last, ring[0]));
    let mut left = last + ring.windows(2).map(|w| cross(w[0], w[1])).sum::<f64>();

    // The current path, and twice the area that it has swept up to each corner.
    let (mut way, mut swept): (Vec<u32>, Vec<f64>) = (Vec::new(), Vec::new());
    let (mut visited, mut rings) = (HashMap::new(), Vec::new());
    for &corner in ring {
        let mut here = swept.last().zip(way.last()).map_or(0.0, |(swept, &before)| swept + cross(before, corner));
        let earlier = visited.get(&place(corner)).copied();
        let on_the_way = |&at: &usize| way.get(at).is_some_and(|&i| place(i) == place(corner));
        if let Some(at) = earlier.filter(on_the_way) {
            let area = here - swept[at];
            if area > 0.0 && left - area > 0.0 && way.len() - at >= 3 {
                left -= area;
                here = swept[at];
                rings.push(way.split_off(at));
                swept.truncate(at);
            }
        }
        visited.insert(place(corner), way.len());
        way.push(corner);
        swept.push(here);
    }
    rings.push(way);
    rings.retain(|ring| ring.len() >= 3);
    rings
}
