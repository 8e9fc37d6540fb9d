//! Spatial search for corners that can keep others from being ears.
//!
//! A face may have tens of thousands of corners, and a long thin ear may run beside all of them.

use robust::{Coord, orient2d};

/// Corners that were not convex when the ring was linked, in a binary tree of boxes; some may be convex or cut off since.
#[derive(Debug, Default)]
pub(super) struct Blockers {
    /// Corners in the order of the leaves.
    corners: Vec<u32>,
    /// Smallest and largest coordinates of each node; the children of node k are 2k + 1 and 2k + 2.
    boxes: Vec<[Coord<f64>; 2]>,
}

impl Blockers {
    /// Largest number of corners in a leaf.
    const LEAF: usize = 8;

    /// Replaces all corners by these.
    pub(super) fn fill(&mut self, corners: impl Iterator<Item = u32>, flat: &[Coord<f64>]) {
        self.corners.clear();
        self.corners.extend(corners);
        self.boxes.clear();
        halve(&mut self.corners, 0, flat, &mut self.boxes);
    }

    /// Whether any corner that may lie in a counter-clockwise triangle `blocks` it.
    pub(super) fn any(&self, triangle: [Coord<f64>; 3], blocks: impl Fn(u32) -> bool) -> bool {
        self.any_of(&self.corners, 0, triangle, &blocks)
    }

    fn any_of(&self, corners: &[u32], k: usize, triangle: [Coord<f64>; 3], blocks: &impl Fn(u32) -> bool) -> bool {
        if corners.len() <= Self::LEAF {
            return corners.iter().any(|&corner| blocks(corner));
        }
        if self.boxes.get(k).is_some_and(|bounds| is_outside(bounds, triangle)) {
            return false;
        }
        let (first, second) = corners.split_at(corners.len() / 2);
        self.any_of(first, 2 * k + 1, triangle, blocks) || self.any_of(second, 2 * k + 2, triangle, blocks)
    }
}

/// Partitions the corners recursively in space, and stores the boxes of the inner nodes.
fn halve(corners: &mut [u32], k: usize, flat: &[Coord<f64>], boxes: &mut Vec<[Coord<f64>; 2]>) {
    if corners.len() <= Blockers::LEAF {
        return;
    }
    let at = |corner: u32| flat[corner as usize];
    let start = at(corners[0]);
    let grow = |[lo, hi]: [Coord<f64>; 2], &corner: &u32| {
        let p = at(corner);
        [Coord { x: lo.x.min(p.x), y: lo.y.min(p.y) }, Coord { x: hi.x.max(p.x), y: hi.y.max(p.y) }]
    };
    let [lo, hi] = corners.iter().fold([start; 2], grow);
    boxes.resize(boxes.len().max(k + 1), [start; 2]);
    boxes[k] = [lo, hi];
    let along_y = hi.y - lo.y > hi.x - lo.x;
    let along = |corner: u32| if along_y { at(corner).y } else { at(corner).x };
    let middle = corners.len() / 2;
    corners.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)));
    let (first, second) = corners.split_at_mut(middle);
    halve(first, 2 * k + 1, flat, boxes);
    halve(second, 2 * k + 2, flat, boxes);
}

/// Whether a box is disjoint from the box of a counter-clockwise triangle, or lies outside one of its edges.
fn is_outside([lo, hi]: &[Coord<f64>; 2], [a, b, c]: [Coord<f64>; 3]) -> bool {
    let is_beside = |lo: f64, hi: f64, [a, b, c]: [f64; 3]| hi < a.min(b).min(c) || lo > a.max(b).max(c);
    if is_beside(lo.x, hi.x, [a.x, b.x, c.x]) || is_beside(lo.y, hi.y, [a.y, b.y, c.y]) {
        return true;
    }
    let is_right_of = |from: Coord<f64>, to: Coord<f64>| {
        // Corner of the box that is farthest to the left of the edge.
        let x = if to.y > from.y { lo.x } else { hi.x };
        let y = if to.x > from.x { hi.y } else { lo.y };
        orient2d(from, to, Coord { x, y }) < 0.0
    };
    is_right_of(a, b) || is_right_of(b, c) || is_right_of(c, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn whatever_lies_in_a_triangle_is_asked() {
        let mut random = Random::new(3);
        // On a grid, so that many corners lie on edges or coincide.
        let mut place = || Coord { x: random.below(12) as f64, y: random.below(9) as f64 };
        let flat: Vec<Coord<f64>> = (0..300).map(|_| place()).collect();
        let mut blockers = Blockers::default();
        blockers.fill(0..300, &flat);
        for _ in 0..2000 {
            let [a, b, c] = [place(), place(), place()];
            if orient2d(a, b, c) <= 0.0 {
                continue;
            }
            let asked = std::cell::RefCell::new(Vec::new());
            blockers.any([a, b, c], |q| {
                asked.borrow_mut().push(q);
                false
            });
            let asked = asked.into_inner();
            let sides = [(a, b), (b, c), (c, a)];
            let inside = |q: &u32| sides.iter().all(|&(from, to)| orient2d(from, to, flat[*q as usize]) >= 0.0);
            assert!((0..300).filter(inside).all(|q| asked.contains(&q)), "{a:?} {b:?} {c:?}");
        }
    }
}
