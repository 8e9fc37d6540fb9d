//! Slices of space along each axis: how much of a model lies in each, which are empty, and which ends come off.

use super::bounds::Bounds;
use super::crowd::Crowd;
use super::parts::{CHUNK, Granularity, Part, gather};
use crate::math::{DVec3, Vec3};
use crate::scene::{Instance, Mesh, Scene};
use rayon::prelude::*;

/// Strays together have at most this fraction of the area.
const STRAY_AREA: f64 = 0.01;
/// Strays together have at most this fraction of the faces.
const STRAY_COUNT: f64 = 0.1;
/// Strays lie beyond an empty gap of at least this fraction of the model's size.
const GAP: f64 = 0.5;

/// Number of slices of a box along each axis, in which gaps are looked for.
const SLICES: usize = 256;

/// Rounds in which the triangles of a mesh are recorded, each a sample from all over it: the first mostly leaves no gap.
const ROUNDS: usize = 8;
/// Number of triangles up to which all are recorded in one round, because testing for gaps would take longer.
const FEW: usize = 1 << 10;

/// Contents of each slice along each axis.
pub(super) struct Slices {
    lo: DVec3,
    width: DVec3,
    /// Slices per unit of length; 0 where the box is flat.
    per_unit: DVec3,
    pub(super) reached: Reached,
    /// Area and faces of the parts centred in each slice of each axis.
    area: [[f64; SLICES]; 3],
    count: [[u64; SLICES]; 3],
}

impl Slices {
    /// Cuts the box of `bounds` into slices, without contents yet.
    pub(super) fn new(bounds: &Bounds) -> Self {
        let width = (bounds.hi - bounds.lo) / SLICES as f64;
        Self {
            lo: bounds.lo,
            width,
            per_unit: DVec3::select(width.cmpgt(DVec3::ZERO), width.recip(), DVec3::ZERO),
            reached: Reached::default(),
            area: [[0.0; SLICES]; 3],
            count: [[0; SLICES]; 3],
        }
    }

    /// Sorts the parts whose centre is inside the box into its slices.
    pub(super) fn of(scene: &Scene, crowd: &Crowd, bounds: &Bounds) -> Self {
        let add = |slices: &mut Self, part: &Part| {
            if bounds.contains(part.center) {
                slices.reach(part.lo, part.hi);
                slices.weigh(part);
            }
        };
        gather(scene, Granularity::Crowd(crowd, bounds), || Self::new(bounds), add, Self::join)
    }

    /// Adds the contents of other slices of the same box.
    fn join(&mut self, other: Self) {
        self.reached.join(&other.reached);
        for axis in 0..3 {
            for i in 0..SLICES {
                self.area[axis][i] += other.area[axis][i];
                self.count[axis][i] += other.count[axis][i];
            }
        }
    }

    /// Records the range of slices that a part with this box reaches.
    #[inline]
    pub(super) fn reach(&mut self, lo: DVec3, hi: DVec3) {
        for axis in 0..3 {
            self.reached.note(axis, self.slice(axis, lo[axis]), self.slice(axis, hi[axis]), 1);
        }
    }

    /// Records the reach of every triangle of a mesh, or of a sample from all over it if that leaves no gap; `None` if a corner
    /// of one is missing or not finite.
    ///
    /// `cells` is a buffer for the slices of the vertices.
    pub(super) fn cover(&mut self, instance: &Instance, mesh: &Mesh, cells: &mut Vec<VertexCell>) -> Option<()> {
        let cell = |p: &Vec3| {
            let p = instance.world_from_object.transform_point3(p.as_dvec3());
            #[expect(clippy::cast_possible_truncation, reason = "there are 256 slices")]
            let cell = || [0, 1, 2].map(|axis| self.slice(axis, p[axis]) as u8);
            p.is_finite().then(cell)
        };
        if mesh.positions.len() <= CHUNK {
            cells.clear();
            cells.extend(mesh.positions.iter().map(cell));
        } else {
            mesh.positions.par_iter().with_min_len(CHUNK).map(cell).collect_into_vec(cells);
        }
        if mesh.triangles.len() <= FEW {
            return self.reached.note_all(mesh.triangles.iter(), cells);
        }
        for round in 0..ROUNDS {
            let of = |triangles: &[[u32; 3]]| {
                let mut reached = Reached::default();
                let some = triangles.iter().skip(round).step_by(ROUNDS);
                reached.note_all(some, cells).map(|()| reached)
            };
            let parts: Vec<Reached> = mesh.triangles.par_chunks(CHUNK).map(of).collect::<Option<_>>()?;
            parts.iter().for_each(|part| self.reached.join(part));
            if self.has_no_gap() {
                break;
            }
        }
        Some(())
    }

    /// Records `faces` faces that reach somewhere between these outermost points.
    pub(super) fn cover_between(&mut self, outermost: &[DVec3], faces: u64) {
        for axis in 0..3 {
            let (first, last) = self.slices_between(axis, outermost);
            self.reached.note(axis, first, last, faces);
        }
    }

    /// Whether no slice is empty, so that nothing can come off; along axes where the box is flat, nothing can either.
    pub(super) fn has_no_gap(&self) -> bool {
        let covered = self.reached.covered();
        self.wide_axes().all(|axis| covered[axis].iter().all(|&covered| covered))
    }

    /// Whether too many faces lie before the first empty slice, from either end of every axis, for any to come off.
    pub(super) fn holds_together(&self) -> bool {
        self.wide_axes().all(|axis| self.reached.least_before_a_gap(axis) > STRAY_COUNT)
    }

    /// Axes along which the box is not flat.
    fn wide_axes(&self) -> impl Iterator<Item = usize> {
        (0..3).filter(|&axis| self.per_unit[axis] != 0.0)
    }

    /// Whether all slices between these outermost points are among those `covered`.
    pub(super) fn lies_throughout(&self, covered: &Covered, outermost: &[DVec3]) -> bool {
        (0..3).all(|axis| {
            let (first, last) = self.slices_between(axis, outermost);
            covered[axis][first..=last].iter().all(|&covered| covered)
        })
    }

    /// First and last slice between these outermost points.
    fn slices_between(&self, axis: usize, outermost: &[DVec3]) -> (usize, usize) {
        let places = || outermost.iter().map(|p| self.slice(axis, p[axis]));
        (places().min().unwrap_or(0), places().max().unwrap_or(0))
    }

    /// Adds a part to the slices of its centre.
    fn weigh(&mut self, part: &Part) {
        for axis in 0..3 {
            let middle = self.slice(axis, part.center[axis]);
            self.area[axis][middle] += part.area;
            self.count[axis][middle] += part.faces;
        }
    }

    /// Number of faces of parts whose centre is in the box.
    pub(super) fn parts(&self) -> u64 {
        self.count[0].iter().sum()
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the slices there are")]
    #[inline]
    fn slice(&self, axis: usize, x: f64) -> usize {
        // Converts to 32 bits, for which processors have an instruction.
        ((x - self.lo[axis]) * self.per_unit[axis]).clamp(0.0, (SLICES - 1) as f64) as u32 as usize
    }

    /// First and last slice kept along each axis when the stray ends are cut off; `None` if nothing comes off.
    ///
    /// Slices, not coordinates: with a stray at 1e20, the model's own box would collapse to its centre.
    pub(super) fn core(&self) -> Option<[(usize, usize); 3]> {
        let size = (0..3).map(|axis| self.size(axis)).fold(0.0, f64::max);
        let covered = self.reached.covered();
        let kept = [0, 1, 2].map(|axis| {
            let last = SLICES - 1 - self.cut(axis, size, &covered[axis], |i| SLICES - 1 - i);
            (self.cut(axis, size, &covered[axis], |i| i), last)
        });
        (kept != [(0, SLICES - 1); 3]).then_some(kept)
    }

    pub(super) fn lies_in(&self, core: &[(usize, usize); 3], p: DVec3) -> bool {
        (0..3).all(|axis| (core[axis].0..=core[axis].1).contains(&self.slice(axis, p[axis])))
    }

    /// Length along `axis` of the middle 98 % of the area, rounded up to slices.
    fn size(&self, axis: usize) -> f64 {
        let total: f64 = self.area[axis].iter().sum();
        let reach = |from_end: fn(usize) -> usize| {
            let mut sum = 0.0;
            (0..SLICES).map(from_end).find(|&i| {
                sum += self.area[axis][i];
                sum > total * STRAY_AREA
            })
        };
        match (reach(|i| i), reach(|i| SLICES - 1 - i)) {
            (Some(first), Some(last)) if last >= first => self.width[axis] * (last + 1 - first) as f64,
            _ => self.width[axis] * SLICES as f64,
        }
    }

    /// Number of slices that come off one end of `axis`; `from_end` maps indices counted from that end.
    fn cut(&self, axis: usize, size: f64, covered: &[bool; SLICES], from_end: impl Fn(usize) -> usize) -> usize {
        let total_area: f64 = self.area[axis].iter().sum();
        let total_count: u64 = self.count[axis].iter().sum();
        let (mut area, mut count, mut gap, mut cut) = (0.0, 0, 0usize, 0);
        for i in 0..SLICES {
            let slice = from_end(i);
            if covered[slice] {
                if gap as f64 * self.width[axis] >= GAP * size && gap > 0 {
                    cut = i;
                }
                gap = 0;
            } else {
                gap += 1;
            }
            area += self.area[axis][slice];
            count += self.count[axis][slice];
            if area > STRAY_AREA * total_area || count as f64 > STRAY_COUNT * total_count as f64 {
                break;
            }
        }
        cut
    }
}

/// Slice of a vertex along each axis; `None` if it is not finite.
pub(super) type VertexCell = Option<[u8; 3]>;

/// Whether any part reaches into each slice of each axis.
pub(super) type Covered = [[bool; SLICES]; 3];

/// Slices reached by parts, stored as the number of parts that begin and end in each: recorded without a branch.
#[derive(Clone, Copy)]
pub(super) struct Reached {
    begin: [[u64; SLICES]; 3],
    end: [[u64; SLICES]; 3],
}

impl Default for Reached {
    fn default() -> Self {
        Self { begin: [[0; SLICES]; 3], end: [[0; SLICES]; 3] }
    }
}

impl Reached {
    /// Records that `parts` parts reach from slice `first` to slice `last` of an axis.
    #[inline]
    fn note(&mut self, axis: usize, first: usize, last: usize, parts: u64) {
        // Swapped ends reach as far.
        self.begin[axis][first.min(last)] += parts;
        self.end[axis][first.max(last)] += parts;
    }

    /// Records triangles whose vertices are in these cells; `None` if one is missing or not finite.
    fn note_all<'t>(&mut self, triangles: impl Iterator<Item = &'t [u32; 3]>, cells: &[VertexCell]) -> Option<()> {
        for triangle in triangles {
            let [a, b, c] = triangle.map(|i| cells.get(i as usize).copied().flatten());
            let (a, b, c) = (a?, b?, c?);
            for axis in 0..3 {
                let (first, last) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
                self.note(axis, usize::from(first), usize::from(last), 1);
            }
        }
        Some(())
    }

    /// Adds the reach recorded elsewhere.
    fn join(&mut self, other: &Self) {
        for (mine, other) in [(&mut self.begin, &other.begin), (&mut self.end, &other.end)] {
            let pairs = mine.as_flattened_mut().iter_mut().zip(other.as_flattened());
            pairs.for_each(|(more, other)| *more += other);
        }
    }

    /// Which slices some part reaches into.
    pub(super) fn covered(&self) -> Covered {
        [0, 1, 2].map(|axis| {
            let mut open = 0;
            std::array::from_fn(|i| {
                open += self.begin[axis][i];
                let covered = open > 0;
                open -= self.end[axis][i];
                covered
            })
        })
    }

    /// Adds the slices that some part reaches into to `covered`.
    pub(super) fn add_covered(&self, covered: &mut Covered) {
        let pairs = covered.as_flattened_mut().iter_mut().zip(self.covered().into_iter().flatten());
        pairs.for_each(|(covered, more)| *covered |= more);
    }

    /// Fraction of all parts that lies before the first empty slice of an axis, or behind the last one if that is less; 1 if no
    /// slice is empty.
    fn least_before_a_gap(&self, axis: usize) -> f64 {
        let covered = &self.covered()[axis];
        let (Some(first), Some(last)) = (covered.iter().position(|c| !c), covered.iter().rposition(|c| !c)) else {
            return 1.0;
        };
        let (before, behind) = (&self.begin[axis][..first], &self.end[axis][last..]);
        let all: u64 = self.begin[axis].iter().sum();
        before.iter().sum::<u64>().min(behind.iter().sum()) as f64 / all as f64
    }
}
