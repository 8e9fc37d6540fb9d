//! Order of the points of a mesh that was encoded by an edgebreaker traversal.
//!
//! The library numbers points as it meets them. The format prescribes another order (`AssignPointsToCorners` of the Draco
//! bitstream specification, version 2.2): vertex by vertex, around each from its left-most corner or from a seam on.
//! Uncompressed attributes and morph targets are stored in that order.

use draco_oxide_core::mesh::ds::GenericCornerTable as _;
use draco_oxide_core::types::CornerIdx;
use draco_oxide_decoder::connectivity::EdgebreakerConnectivity;

/// Marks "no corner" in the library.
pub(super) const NONE: usize = u32::MAX as usize;

/// Points that some triangle uses.
pub(super) struct Points {
    /// Points of the library, in the order of the format.
    pub(super) shown: Vec<u32>,
    /// Position in `shown` of each point of the library.
    pub(super) number: Vec<u32>,
}

impl Points {
    /// Numbers the points of `corners`; `values` maps, for each attribute, points to indices of values.
    ///
    /// `None`: the stream is damaged.
    pub(super) fn of(
        walked: &EdgebreakerConnectivity,
        seams: &[Option<u8>],
        corners: &[u32],
        values: &[Vec<u32>],
    ) -> Option<Self> {
        let seams = seams.iter().zip(values).filter_map(|(seam, values)| Some(((*seam)?, values.as_slice())));
        let mut seams: Vec<(u8, &[u32])> = seams.collect();
        seams.sort_by_key(|seam| seam.0);
        // There are at most as many points as corners.
        let last = corners.iter().max().map_or(0, |&last| last as usize);
        let number = vec![u32::MAX; Some(last + 1).filter(|&count| count <= corners.len().max(1))?];
        let mut points = Self { shown: Vec::new(), number };
        // One round about each vertex, and one for each of its seams.
        let steps = corners.len().saturating_mul(seams.len() + 1);
        let mut around = Around { walked, corners, seams, left: steps };
        for (vertex, &corner) in walked.vertex_corners.iter().enumerate().filter(|(_, c)| usize::from(**c) != NONE) {
            let first = around.first(vertex, corner)?;
            let (mut at, mut before) = (Some(first), None);
            while let Some(corner) = at {
                let point = around.point(corner)?;
                // Where a seam ends at a vertex the values do not change, but the library makes two points of it.
                let same = match before {
                    Some(before) => around.is_same(before, point)?.then_some(before),
                    None => None,
                };
                points.add(point, same)?;
                (at, before) = (around.next(corner)?.filter(|&next| next != first), Some(point));
            }
        }
        let met = |&corner: &u32| points.number.get(corner as usize).is_some_and(|&number| number != u32::MAX);
        corners.iter().all(met).then_some(points)
    }

    /// Numbers an unnumbered point, either like an earlier point with the `same` values or with the next number.
    fn add(&mut self, point: u32, same: Option<u32>) -> Option<()> {
        let known = same.and_then(|same| self.number.get(same as usize)).copied();
        let number = self.number.get_mut(point as usize)?;
        if *number != u32::MAX {
            return Some(());
        }
        *number = known.unwrap_or(self.shown.len() as u32);
        if known.is_none() {
            self.shown.push(point);
        }
        Some(())
    }
}

/// Traversal of the corners around vertices.
struct Around<'a> {
    walked: &'a EdgebreakerConnectivity,
    corners: &'a [u32],
    /// Seams by id, each with the value index of every point.
    seams: Vec<(u8, &'a [u32])>,
    /// Remaining steps; an undamaged mesh never exceeds them.
    left: usize,
}

impl Around<'_> {
    /// Corner at which the round about a vertex starts.
    fn first(&mut self, vertex: usize, corner: CornerIdx) -> Option<CornerIdx> {
        if self.walked.is_vert_hole.get(vertex).copied().unwrap_or(true) {
            return Some(corner);
        }
        for seam in 0..self.seams.len() {
            let own = self.value(seam, corner)?;
            let mut at = self.next(corner)?;
            while let Some(next) = at.filter(|&next| next != corner) {
                if self.value(seam, next)? != own {
                    return Some(next);
                }
                at = self.next(next)?;
            }
        }
        Some(corner)
    }

    /// Next corner around the same vertex; the outer `None`: the steps are used up, so the round has no end.
    fn next(&mut self, corner: CornerIdx) -> Option<Option<CornerIdx>> {
        self.left = self.left.checked_sub(1)?;
        Some(self.walked.corner_table.swing_right(corner))
    }

    fn point(&self, corner: CornerIdx) -> Option<u32> {
        self.corners.get(usize::from(corner)).copied()
    }

    fn value(&self, seam: usize, corner: CornerIdx) -> Option<u32> {
        self.seams.get(seam)?.1.get(self.point(corner)? as usize).copied()
    }

    /// Returns whether two points of a vertex have equal values.
    fn is_same(&self, one: u32, other: u32) -> Option<bool> {
        let mut same = true;
        for (_, values) in &self.seams {
            same &= values.get(one as usize)? == values.get(other as usize)?;
        }
        Some(same)
    }
}
