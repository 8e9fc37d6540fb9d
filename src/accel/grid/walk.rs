//! Traversal of the cells by a ray.
//!
//! The top grid is traversed by the 3D-DDA of J. Amanatides, A. Woo, *A Fast Voxel Traversal Algorithm for Ray Tracing*,
//! 1987, with one change: the distance to the next plane is computed from the plane's integer each time and never
//! accumulated, so that errors do not grow along the ray. Inside a refined cell the octants are visited in ray order without
//! a stack: the next finest cell is known as an integer, and its octant is found from the top cell down.
//!
//! # Why no hit is lost
//! Exit distances split the ray into intervals; the cell visited in an interval contains the ray there up to the error of
//! computing positions in `f64`, which is less than an eighth of [`CELL_PAD`](crate::math::bounds::CELL_PAD) for origins
//! within [`RAY_CELLS`](crate::math::bounds::RAY_CELLS). Prims are listed in every cell that they overlap within the padding,
//! so a hit with exact distance t is tested at the latest in the cell of t's interval. The walk ends behind a cell once no
//! later hit can precede the best one, that is once the best hit lies before the exit by
//! [`WALK_MARGIN`](crate::math::bounds::WALK_MARGIN). A hit found beyond the exit is kept but is not final.

use super::lattice::{Cube, Lattice};
use super::mailbox::Mailbox;
use super::{EMPTY, GridOctree, GridScratch, NODE};
use crate::accel::Probe;
use crate::accel::probe::{Extent, NodeId, Visit};
use crate::accel::query::{Goal, Query};
use crate::accel::slabs::BoxRay;

/// A ray in units of finest cells, with t unchanged.
struct Track {
    origin: [f64; 3],
    dir: [f64; 3],
    inv_dir: [f64; 3],
    /// Whether the ray runs towards larger coordinates, per axis.
    forwards: [bool; 3],
    /// The ray for the box tests of hierarchies in cells, if there are any.
    boxes: Option<BoxRay>,
}

impl Track {
    /// Creates the track of a query's ray; `None` if its origin is too far away to resolve the ray's cells.
    fn new<G: Goal>(lattice: &Lattice, query: &Query<G>, boxes: bool) -> Option<Self> {
        let origin = lattice.place(query.ray.origin);
        let along = query.ray.dir.as_dvec3() * lattice.scale;
        let dir = along.map(|d| if d == 0.0 { lattice.margins.no_slope } else { d });
        (origin.abs().max_element() < lattice.margins.ray_cells).then(|| Self {
            origin: origin.to_array(),
            dir: dir.to_array(),
            inv_dir: dir.recip().to_array(),
            forwards: dir.to_array().map(|d| d > 0.0),
            boxes: boxes.then(|| BoxRay::new(query)),
        })
    }

    /// Distance to a plane between cells.
    #[inline]
    fn meets(&self, axis: usize, plane: u32) -> f64 {
        (f64::from(plane) - self.origin[axis]) * self.inv_dir[axis]
    }

    /// Coordinate at distance t, as a finest cell in `lo..=hi`.
    #[inline]
    fn cell_at(&self, axis: usize, t: f64, lo: u32, hi: u32) -> u32 {
        let x = self.origin[axis] + self.dir[axis] * t;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, NaN is 0")]
        (x as u32).clamp(lo, hi)
    }

    /// Part of `from..=to` inside the grid's box.
    fn span(&self, fine: [u32; 3], from: f64, to: f64) -> Option<(f64, f64)> {
        let (mut near, mut far) = (from, to);
        for (k, end) in fine.into_iter().enumerate() {
            let (a, b) = (self.meets(k, 0), self.meets(k, end));
            let (first, last) = if self.forwards[k] { (a, b) } else { (b, a) };
            near = near.max(first);
            far = far.min(last);
        }
        (near <= far).then_some((near, far))
    }
}

/// Axis and value of the smallest of three distances.
#[inline]
fn first_exit(t: [f64; 3]) -> (usize, f64) {
    let axis = if t[0] < t[1] {
        if t[0] < t[2] { 0 } else { 2 }
    } else if t[1] < t[2] {
        1
    } else {
        2
    };
    (axis, t[axis])
}

impl<M: Mailbox> GridOctree<'_, M> {
    /// Distance up to which cells must be visited for hits within the query's reach.
    #[inline]
    fn limit<G: Goal>(&self, query: &Query<G>) -> f64 {
        let reach = f64::from(query.reach());
        reach + self.lattice.margins.behind(reach)
    }

    /// Visits the cells along the ray, in order.
    pub(super) fn walk_cells<G: Goal, P: Probe>(
        &self,
        query: &mut Query<G>,
        scratch: &mut GridScratch<M>,
        probe: &mut P,
    ) {
        scratch.mailbox.next_ray();
        let Some(track) = Track::new(&self.lattice, query, !self.trees.is_empty()) else {
            query.test_all(probe);
            return;
        };
        // A hit at t_min may lie half an ulp before it.
        let from = f64::from(query.t_min);
        let from = from - self.lattice.margins.behind(from);
        let Some((mut enter, _)) = track.span(self.lattice.fine_dims(), from, self.limit(query)) else {
            return;
        };

        let levels = self.lattice.levels;
        let dims = self.lattice.dims;
        let first = |k: usize| track.cell_at(k, enter, 0, (dims[k] << levels) - 1) >> levels;
        let mut cell = [first(0), first(1), first(2)];
        let exit = |k: usize, cell: u32| track.meets(k, (cell + u32::from(track.forwards[k])) << levels);
        let mut exits = [exit(0, cell[0]), exit(1, cell[1]), exit(2, cell[2])];
        let mut end = self.limit(query);
        loop {
            let (axis, leave) = first_exit(exits);
            let entry = self.top[self.lattice.top_index(cell)];
            if entry & NODE == 0 {
                probe.visit(|| self.visit_record(NodeId::Cell(cell), self.lattice.top_cube(cell), Some(entry)));
            }
            if entry == EMPTY {
                probe.step();
                probe.cell(true);
            } else {
                let answered = if entry & NODE == 0 {
                    self.visit(entry, &track, query, scratch, probe)
                } else {
                    self.walk_octants(entry, cell, enter, &track, query, scratch, probe)
                };
                if answered {
                    return;
                }
                end = self.limit(query);
            }
            if end < leave {
                return;
            }

            let (next, outside) = if track.forwards[axis] {
                (cell[axis] + 1, cell[axis] + 1 == dims[axis])
            } else {
                (cell[axis].wrapping_sub(1), cell[axis] == 0)
            };
            if outside {
                return;
            }
            cell[axis] = next;
            exits[axis] = exit(axis, next);
            enter = leave;
        }
    }

    /// Visits the cells below one top cell; returns whether the query is answered.
    #[expect(clippy::too_many_arguments, reason = "the state of the walk it is a part of")]
    fn walk_octants<G: Goal, P: Probe>(
        &self,
        root: u32,
        top: [u32; 3],
        enter: f64,
        track: &Track,
        query: &mut Query<G>,
        scratch: &mut GridScratch<M>,
        probe: &mut P,
    ) -> bool {
        let levels = self.lattice.levels;
        let first = |k: usize| {
            let lo = top[k] << levels;
            track.cell_at(k, enter, lo, lo + (1 << levels) - 1)
        };
        let mut at = [first(0), first(1), first(2)];
        let mut end = self.limit(query);
        loop {
            let (cell, level) = self.descend(root, at, probe);
            probe.visit(|| {
                let cube = Cube { lo: at.map(|c| c >> level << level), level };
                self.visit_record(NodeId::Octant(cube.lo, level), cube, Some(cell))
            });
            if cell == EMPTY {
                probe.step();
                probe.cell(true);
            } else {
                if self.visit(cell, track, query, scratch, probe) {
                    return true;
                }
                end = self.limit(query);
            }
            let side = 1u32 << level;
            let lo = [at[0] >> level << level, at[1] >> level << level, at[2] >> level << level];
            let exit = |k: usize| lo[k] + if track.forwards[k] { side } else { 0 };
            let plane = [exit(0), exit(1), exit(2)];
            let (axis, leave) =
                first_exit([track.meets(0, plane[0]), track.meets(1, plane[1]), track.meets(2, plane[2])]);
            if end < leave {
                return true;
            }

            // Never step back, so that the walk ends, nor out of the cell.
            for k in 0..3 {
                if k == axis {
                    continue;
                }
                let (first, last) = match (self.lattice.margins.guarded, track.forwards[k]) {
                    (true, true) => (at[k], lo[k] + (side - 1)),
                    (true, false) => (lo[k], at[k]),
                    (false, _) => (0, u32::MAX),
                };
                at[k] = track.cell_at(k, leave, first, last);
            }
            let Some(next) = (if track.forwards[axis] { Some(plane[axis]) } else { plane[axis].checked_sub(1) }) else {
                return false;
            };
            if next >> levels != top[axis] {
                return false;
            }
            at[axis] = next;
        }
    }

    /// Cell that contains finest cell `at`, and its level.
    #[inline]
    fn descend<P: Probe>(&self, root: u32, at: [u32; 3], probe: &mut P) -> (u32, u32) {
        let mut entry = root;
        let mut level = self.lattice.levels;
        while entry & NODE != 0 {
            probe.step();
            probe.visit(|| {
                let cube = Cube { lo: at.map(|c| c >> level << level), level };
                self.visit_record(NodeId::OctreeNode(cube.lo, level), cube, None)
            });
            level -= 1;
            let octant = (at[0] >> level & 1) | (at[1] >> level & 1) << 1 | (at[2] >> level & 1) << 2;
            entry = self.cells.nodes[(entry & !NODE) as usize][octant as usize];
        }
        (entry, level)
    }

    /// Record of a visit to a node, or to a cell with its list; a hierarchy in the cell records its own.
    fn visit_record(&self, place: NodeId, cube: Cube, cell: Option<u32>) -> Visit {
        let listed =
            cell.filter(|&cell| self.trees.root(cell).is_none()).map(|cell| self.cells.list(cell).len() as u32);
        Visit { place, extent: Extent::Box(self.lattice.bounds(cube)), listed }
    }

    /// Tests the prims of a non-empty cell; returns whether the query is answered.
    #[inline]
    fn visit<G: Goal, P: Probe>(
        &self,
        cell: u32,
        track: &Track,
        query: &mut Query<G>,
        GridScratch { mailbox, stack }: &mut GridScratch<M>,
        probe: &mut P,
    ) -> bool {
        let mut test = |prims: &[u32], query: &mut Query<G>, probe: &mut P| {
            for &prim in prims {
                if !query.asks_for(prim) {
                    continue;
                }
                if !mailbox.first_visit(prim) {
                    probe.repeat_skipped(prim);
                } else if query.test(prim, probe) {
                    return true;
                }
            }
            false
        };
        probe.step();
        if let (Some(root), Some(ray)) = (self.trees.root(cell), &track.boxes) {
            return self.trees.tree.walk(root, ray, query, stack, probe, test);
        }
        probe.cell(false);
        test(self.cells.list(cell), query, probe)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_exit_is_found_for_every_order() {
        for t in [[1.0, 2.0, 3.0], [2.0, 1.0, 3.0], [3.0, 2.0, 1.0], [2.0, 3.0, 1.0], [3.0, 1.0, 2.0], [1.0, 3.0, 2.0]]
        {
            assert_eq!(first_exit(t).1, 1.0);
        }
        assert_eq!(first_exit([f64::INFINITY, 4.0, f64::INFINITY]), (1, 4.0));
    }
}
