//! The box of the model without its strays: parts so few, so small and so far away that nobody meant them to be seen.

use crate::math::{DVec3, Vec3};
use crate::scene::{Instance, Mesh, Scene};
use rayon::prelude::*;

/// What there is to see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least corner of the box of the model; world space, finite.
    pub lo: DVec3,
    /// Greatest corner.
    pub hi: DVec3,
    /// Faces, spheres and cones left out as strays.
    pub strays: u64,
    /// Box of everything, strays too; equal to `lo`, `hi` when there are none.
    pub whole: (DVec3, DVec3),
}

/// Strays together own at most this share of the area …
const STRAY_AREA: f64 = 0.01;
/// … and at most this share of the faces …
const STRAY_COUNT: f64 = 0.1;
/// … and lie beyond an empty gap of at least this share of the model's size.
const GAP: f64 = 0.5;

/// Slices a box is cut into along each axis to look for gaps.
const SLICES: usize = 256;

/// Facing is told apart from not facing by this much: closed bodies, whose faces cancel, face no way.
pub(super) const AWAY: f64 = -0.1;

impl Bounds {
    /// The middle of the box.
    pub fn center(&self) -> DVec3 {
        self.lo * 0.5 + self.hi * 0.5
    }

    /// The box of both.
    pub fn union(&self, other: &Self) -> Self {
        let whole = (self.whole.0.min(other.whole.0), self.whole.1.max(other.whole.1));
        let strays = self.strays.max(other.strays);
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi), strays, whole }
    }

    /// Half the diagonal, greater than 0.
    pub fn radius(&self) -> f64 {
        let radius = (self.hi - self.lo).length() * 0.5;
        if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
    }

    /// Whether a point of the model lies in the box.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.lo).all() && p.cmple(self.hi).all()
    }
}

/// Finds the box of the model.
///
/// Space is cut into slices along each axis. Where an empty gap at least half as long as the model parts off an end
/// with hardly any faces and area, that end is stray; the search goes on in what is left until nothing more comes off.
/// Whatever is connected to the model, however thin, is part of it. A scene with nothing bounded gets the unit box
/// around the origin.
pub fn robust_bounds(scene: &Scene) -> Bounds {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let found = visit_corners(scene, |p| (lo, hi) = (lo.min(p), hi.max(p)));
    found.and_then(|()| of_faces(scene, (lo, hi))).unwrap_or_else(|| by_parts(scene))
}

/// The same where the box of all corners is known, such as [`World::bounds`](crate::render::World::bounds).
pub fn robust_bounds_within(scene: &Scene, whole: (DVec3, DVec3)) -> Bounds {
    of_faces(scene, whole).unwrap_or_else(|| by_parts(scene))
}

/// The same of a model of faces all of whose corners are in the box `whole`; `None` for any other.
fn of_faces(scene: &Scene, whole: (DVec3, DVec3)) -> Option<Bounds> {
    let (lo, hi) = whole;
    if !(scene.spheres.is_empty() && scene.cones.is_empty() && lo.is_finite() && hi.is_finite()) {
        return None;
    }
    let bounds = Bounds { lo, hi, strays: 0, whole };
    if has_no_gap(scene, &bounds)? {
        return Some(bounds);
    }
    let slices = Slices::of(scene, &bounds);
    (slices.parts() == faces(scene)).then(|| without_strays(scene, bounds, slices))
}

/// The same for any scene.
fn by_parts(scene: &Scene) -> Bounds {
    let Some(whole) = hull(scene, |_| true) else {
        let unit = (DVec3::splat(-0.5), DVec3::splat(0.5));
        return Bounds { lo: unit.0, hi: unit.1, strays: 0, whole: unit };
    };
    let bounds = Bounds { lo: whole.0, hi: whole.1, strays: 0, whole };
    without_strays(scene, bounds, Slices::of(scene, &bounds))
}

/// What is left of all parts, which the slices of their box have.
fn without_strays(scene: &Scene, mut bounds: Bounds, mut slices: Slices) -> Bounds {
    // Each round zooms in by up to SLICES; the range of f64 needs far fewer than this many.
    for _ in 0..128 {
        if slices.has_no_gap() {
            break;
        }
        let Some(core) = slices.core() else { break };
        let kept = |part: &Part| bounds.contains(part.center) && slices.lies_in(&core, part.center);
        let Some((lo, hi)) = hull(scene, kept) else { break };
        if (lo, hi) == (bounds.lo, bounds.hi) {
            break;
        }
        (bounds.lo, bounds.hi) = (lo, hi);
        slices = Slices::of(scene, &bounds);
    }
    if (bounds.lo, bounds.hi) == bounds.whole {
        return bounds;
    }
    let outside = |part: &Part| !bounds.contains(part.lo) || !bounds.contains(part.hi);
    bounds.strays = gather(scene, || 0, |n, part| *n += u64::from(outside(part)), |n, more| *n += more);
    bounds
}

/// Faces that are looked at between two questions whether all slices have been reached.
const FACES_AT_A_TIME: usize = 1024;

/// How often faces from all over a mesh are looked at before all of them are.
const LOOKS: usize = 16;

/// Whether triangles reach into every slice, so that nothing can come off: true of most models, and of large ones mostly
/// found by a look at some of their faces, from all over them. `None` where a corner is nowhere, if it was looked at.
fn has_no_gap(scene: &Scene, bounds: &Bounds) -> Option<bool> {
    let mut slices = Slices::new(bounds);
    for instance in &scene.instances {
        let Some(mesh) = scene.meshes.get(instance.mesh as usize) else { continue };
        let corner = |i: u32| {
            let p = mesh.positions.get(i as usize)?;
            Some(instance.world_from_object.transform_point3(p.as_dvec3())).filter(|p| p.is_finite())
        };
        // Neighbours in the file are neighbours in space: some from all over it reach far sooner than the first ones.
        let stride = mesh.triangles.len() / FACES_AT_A_TIME + 1;
        for first in 0..stride.min(LOOKS) {
            for triangle in mesh.triangles.iter().skip(first).step_by(stride) {
                let [a, b, c] = triangle.map(corner);
                let (a, b, c) = (a?, b?, c?);
                slices.reach(a.min(b).min(c), a.max(b).max(c));
            }
            if slices.has_no_gap() {
                return Some(true);
            }
        }
        if stride > LOOKS {
            slices.cover(instance, mesh)?;
            if slices.has_no_gap() {
                return Some(true);
            }
        }
    }
    Some(false)
}

/// Triangles there are, polygons counted as their fans.
fn faces(scene: &Scene) -> u64 {
    let of_mesh = |mesh: &Mesh| {
        let fans = mesh.polygons.iter().map(|polygon| u64::from(polygon.len.saturating_sub(2)));
        mesh.triangles.len() as u64 + fans.sum::<u64>()
    };
    scene.instances.iter().filter_map(|instance| scene.meshes.get(instance.mesh as usize)).map(of_mesh).sum()
}

/// The mean direction of all faces weighted by area: length 1 for a card, 0 for a closed body.
pub(super) fn facing(scene: &Scene) -> DVec3 {
    let add = |(sum, area): &mut (DVec3, f64), part: &Part| {
        *sum += part.normal;
        *area += part.normal.length();
    };
    let join = |all: &mut (DVec3, f64), more: (DVec3, f64)| *all = (all.0 + more.0, all.1 + more.1);
    let (sum, area) = gather(scene, Default::default, add, join);
    if area > 0.0 { sum / area } else { DVec3::ZERO }
}

/// A face, sphere or cone.
struct Part {
    lo: DVec3,
    hi: DVec3,
    center: DVec3,
    /// As long as the area.
    normal: DVec3,
    area: f64,
}

/// Box of the parts that `keep` wants; `None` when there are none.
fn hull(scene: &Scene, keep: impl Fn(&Part) -> bool + Sync) -> Option<(DVec3, DVec3)> {
    let nothing = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let join = |all: &mut (DVec3, DVec3), more: (DVec3, DVec3)| *all = (all.0.min(more.0), all.1.max(more.1));
    let add = |all: &mut (DVec3, DVec3), part: &Part| {
        if keep(part) {
            join(all, (part.lo, part.hi));
        }
    };
    let (lo, hi) = gather(scene, nothing, add, join);
    lo.cmple(hi).all().then_some((lo, hi))
}

/// Faces that one thread takes at a time: the same for every number of threads, so that sums are, too.
const CHUNK: usize = 1 << 15;

/// Adds up every face, sphere and cone with finite corners, from `nothing`; `join` adds what others have added up.
fn gather<T: Send>(
    scene: &Scene,
    nothing: impl Fn() -> T + Sync,
    add: impl Fn(&mut T, &Part) + Sync,
    join: impl Fn(&mut T, T),
) -> T {
    let mut all = nothing();
    for instance in &scene.instances {
        let Some(mesh) = scene.meshes.get(instance.mesh as usize) else { continue };
        // Faces share their corners.
        let world = |p: &Vec3| instance.world_from_object.transform_point3(p.as_dvec3());
        let places: Vec<DVec3> = mesh.positions.par_iter().with_min_len(CHUNK).map(world).collect();
        let faces = Faces { instance, mesh, places: &places };
        let of = |triangles: &[[u32; 3]]| {
            let mut sum = nothing();
            faces.visit(triangles, |part| add(&mut sum, part));
            sum
        };
        match mesh.triangles.len() {
            ..=CHUNK => faces.visit(&mesh.triangles, |part| add(&mut all, part)),
            _ => {
                let sums: Vec<T> = mesh.triangles.par_chunks(CHUNK).map(of).collect();
                sums.into_iter().for_each(|sum| join(&mut all, sum));
            }
        }
        faces.visit_polygons(|part| add(&mut all, part));
    }
    visit_solids(scene, |part| add(&mut all, part));
    all
}

/// The faces of an instance.
struct Faces<'a> {
    instance: &'a Instance,
    mesh: &'a Mesh,
    /// World space.
    places: &'a [DVec3],
}

impl Faces<'_> {
    fn corner(&self, i: u32) -> DVec3 {
        self.places.get(i as usize).copied().unwrap_or(self.instance.world_from_object.translation)
    }

    fn visit(&self, triangles: &[[u32; 3]], mut f: impl FnMut(&Part)) {
        for triangle in triangles {
            Part::face(triangle.map(|i| self.corner(i))).iter().for_each(&mut f);
        }
    }

    /// A polygon counts as the fan of triangles around its first corner.
    fn visit_polygons(&self, mut f: impl FnMut(&Part)) {
        for polygon in &self.mesh.polygons {
            let run = polygon.first as usize..(polygon.first + polygon.len) as usize;
            let corners = self.mesh.polygon_corners.get(run).unwrap_or_default();
            for pair in corners.windows(2).skip(1) {
                Part::face([corners[0], pair[0], pair[1]].map(|i| self.corner(i))).iter().for_each(&mut f);
            }
        }
    }
}

impl Part {
    /// `None` where a corner is nowhere.
    fn face([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let normal = (b - a).cross(c - a) * 0.5;
        // The mean of three equal numbers may be another.
        let center = ((a + b + c) / 3.0).clamp(lo, hi);
        let face = Self { lo, hi, center, normal, area: normal.length() };
        (lo.is_finite() && hi.is_finite()).then_some(face)
    }
}

/// Calls `f` for every sphere and cone.
fn visit_solids(scene: &Scene, mut f: impl FnMut(&Part)) {
    for sphere in &scene.spheres {
        let (lo, hi) = (sphere.center - sphere.radius, sphere.center + sphere.radius);
        let area = 4.0 * std::f64::consts::PI * sphere.radius * sphere.radius;
        f(&Part { lo, hi, center: sphere.center, normal: DVec3::ZERO, area });
    }
    for cone in &scene.cones {
        let ((lo, hi), length, dr) =
            (cone.bounds(), cone.base.distance(cone.apex), cone.base_radius - cone.apex_radius);
        let slant = (length * length + dr * dr).sqrt();
        let area = std::f64::consts::PI * (cone.base_radius + cone.apex_radius) * slant;
        f(&Part { lo, hi, center: (lo + hi) * 0.5, normal: DVec3::ZERO, area });
    }
}

/// Calls `f` for every corner of the faces, for shared ones once; `None` when a corner is nowhere, or not all are faces.
fn visit_corners(scene: &Scene, mut f: impl FnMut(DVec3)) -> Option<()> {
    if !(scene.spheres.is_empty() && scene.cones.is_empty()) {
        return None;
    }
    for instance in &scene.instances {
        let Some(mesh) = scene.meshes.get(instance.mesh as usize) else { continue };
        let mut used = vec![false; mesh.positions.len()];
        for &i in mesh.triangles.iter().flatten().chain(&mesh.polygon_corners) {
            *used.get_mut(i as usize)? = true;
        }
        for (p, _) in mesh.positions.iter().zip(used).filter(|(_, used)| *used) {
            let p = instance.world_from_object.transform_point3(p.as_dvec3());
            f(Some(p).filter(|p| p.is_finite())?);
        }
    }
    Some(())
}

/// How much of the model lies in each slice along each axis.
struct Slices {
    lo: DVec3,
    width: DVec3,
    /// Slices to a unit of length; 0 where the box is flat.
    per_unit: DVec3,
    reached: Reached,
    /// Per axis and slice: area and number of the parts with their centre there.
    area: [[f64; SLICES]; 3],
    count: [[u64; SLICES]; 3],
}

impl Slices {
    /// Cuts the box of `bounds`.
    fn new(bounds: &Bounds) -> Self {
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

    /// Sorts the parts inside the box into its slices.
    fn of(scene: &Scene, bounds: &Bounds) -> Self {
        let add = |slices: &mut Self, part: &Part| {
            if bounds.contains(part.center) {
                slices.reach(part.lo, part.hi);
                slices.weigh(part);
            }
        };
        gather(scene, || Self::new(bounds), add, Self::join)
    }

    /// Adds what other slices of the same box have.
    fn join(&mut self, other: Self) {
        self.reached.join(&other.reached);
        for axis in 0..3 {
            for i in 0..SLICES {
                self.area[axis][i] += other.area[axis][i];
                self.count[axis][i] += other.count[axis][i];
            }
        }
    }

    /// Notes that a part with this box reaches from slice to slice.
    #[inline]
    fn reach(&mut self, lo: DVec3, hi: DVec3) {
        for axis in 0..3 {
            self.reached.note(axis, self.slice(axis, lo[axis]), self.slice(axis, hi[axis]));
        }
    }

    /// Notes how far every triangle of a mesh reaches; `None` when a corner of one is nowhere.
    fn cover(&mut self, instance: &Instance, mesh: &Mesh) -> Option<()> {
        let cell = |p: &Vec3| {
            let p = instance.world_from_object.transform_point3(p.as_dvec3());
            #[expect(clippy::cast_possible_truncation, reason = "there are 256 slices")]
            let cell = || [0, 1, 2].map(|axis| self.slice(axis, p[axis]) as u8);
            p.is_finite().then(cell)
        };
        let cells: Vec<Option<[u8; 3]>> = mesh.positions.par_iter().with_min_len(CHUNK).map(cell).collect();
        let of = |triangles: &[[u32; 3]]| {
            let mut reached = Reached::default();
            for triangle in triangles {
                let [a, b, c] = triangle.map(|i| cells.get(i as usize).copied().flatten());
                let (a, b, c) = (a?, b?, c?);
                for axis in 0..3 {
                    let (first, last) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
                    reached.note(axis, usize::from(first), usize::from(last));
                }
            }
            Some(reached)
        };
        let parts: Vec<Reached> = mesh.triangles.par_chunks(CHUNK).map(of).collect::<Option<_>>()?;
        parts.iter().for_each(|part| self.reached.join(part));
        Some(())
    }

    /// Whether no slice is empty, so that nothing can come off.
    fn has_no_gap(&self) -> bool {
        self.reached.covered().as_flattened().iter().all(|&covered| covered)
    }

    /// Adds a part to the slices that its middle is in.
    fn weigh(&mut self, part: &Part) {
        for axis in 0..3 {
            let middle = self.slice(axis, part.center[axis]);
            self.area[axis][middle] += part.area;
            self.count[axis][middle] += 1;
        }
    }

    /// Parts whose middle is in the box.
    fn parts(&self) -> u64 {
        self.count[0].iter().sum()
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the slices there are")]
    #[inline]
    fn slice(&self, axis: usize, x: f64) -> usize {
        ((x - self.lo[axis]) * self.per_unit[axis]).clamp(0.0, (SLICES - 1) as f64) as usize
    }

    /// First and last slice along each axis without the ends that come off; `None` when nothing comes off.
    ///
    /// Slices, not coordinates: beside a stray at 1e20 the model's own box could not be told from its centre.
    fn core(&self) -> Option<[(usize, usize); 3]> {
        let size = (0..3).map(|axis| self.size(axis)).fold(0.0, f64::max);
        let covered = self.reached.covered();
        let kept = [0, 1, 2].map(|axis| {
            let last = SLICES - 1 - self.cut(axis, (size, &covered[axis]), |i| SLICES - 1 - i);
            (self.cut(axis, (size, &covered[axis]), |i| i), last)
        });
        (kept != [(0, SLICES - 1); 3]).then_some(kept)
    }

    fn lies_in(&self, core: &[(usize, usize); 3], p: DVec3) -> bool {
        (0..3).all(|axis| (core[axis].0..=core[axis].1).contains(&self.slice(axis, p[axis])))
    }

    /// Length along `axis` of the middle 98 % of the area, to a slice.
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

    /// How many slices come off one end of `axis`; `from_end` numbers them from there.
    fn cut(&self, axis: usize, (size, covered): (f64, &[bool; SLICES]), from_end: impl Fn(usize) -> usize) -> usize {
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

/// Which slices parts reach into, as how many more begin in each than end before it: noted without a branch.
#[derive(Clone, Copy)]
struct Reached([[i64; SLICES + 1]; 3]);

impl Default for Reached {
    fn default() -> Self {
        Self([[0; SLICES + 1]; 3])
    }
}

impl Reached {
    /// A part reaches from slice to slice of an axis.
    #[inline]
    fn note(&mut self, axis: usize, first: usize, last: usize) {
        let more = &mut self.0[axis];
        more[first] += 1;
        more[last + 1] -= 1;
    }

    /// Adds what others reach.
    fn join(&mut self, other: &Self) {
        let pairs = self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened());
        pairs.for_each(|(more, other)| *more += other);
    }

    /// Whether some part reaches into a slice.
    fn covered(&self) -> [[bool; SLICES]; 3] {
        let mut covered = [[false; SLICES]; 3];
        for (covered, more) in covered.iter_mut().zip(&self.0) {
            let mut here = 0;
            for (covered, more) in covered.iter_mut().zip(more) {
                here += more;
                *covered = here != 0;
            }
        }
        covered
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;

    /// Triangles along a spiral, `gap` of it left out at the end, on two instances.
    fn spiral(faces: usize, gap: f32) -> Scene {
        let at = |i: usize| {
            let t = i as f32 / faces as f32;
            let t = if i + 8 > faces { t + gap } else { t };
            Vec3::new(t * 3.0, libm::sinf(t * 50.0), libm::cosf(t * 41.0))
        };
        let positions = (0..faces + 2).map(at).collect();
        // No face bridges the gap.
        let bridges = |i: &u32| gap > 0.0 && (faces as u32 - 9..faces as u32 - 7).contains(i);
        let triangles = (0..faces as u32).filter(|i| !bridges(i)).map(|i| [i, i + 1, i + 2]).collect();
        let instance = |mesh: u32, x: f64| Instance {
            name: String::new(),
            mesh,
            world_from_object: DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)),
        };
        let meshes = vec![Mesh { positions, triangles, ..Mesh::default() }];
        Scene { meshes, instances: vec![instance(0, 0.0), instance(0, 0.25)], ..Scene::default() }
    }

    #[test]
    fn the_short_way_and_the_long_one_find_the_same_box() {
        for (faces, gap, short) in [(20_000, 0.0, true), (40, 0.0, true), (20_000, 30.0, false), (80_000, 30.0, false)]
        {
            let (scene, slow) = (spiral(faces, gap), by_parts(&spiral(faces, gap)));
            let whole = Bounds { lo: slow.whole.0, hi: slow.whole.1, strays: 0, whole: slow.whole };
            assert_eq!(has_no_gap(&scene, &whole), Some(short), "{faces} {gap}");
            assert!(of_faces(&scene, slow.whole).is_some(), "not by parts");
            assert_eq!(robust_bounds(&scene), slow, "{faces} {gap}");
            assert_eq!(robust_bounds_within(&scene, slow.whole), slow, "{faces} {gap}");
            assert_eq!(robust_bounds(&scene).strays > 0, gap > 0.0);
        }
    }

    #[test]
    fn all_faces_are_covered_as_one_by_one_and_corners_of_none_may_be_nowhere() {
        for (faces, gap) in [(80_000, 0.0), (80_000, 30.0)] {
            let mut scene = spiral(faces, gap);
            let bounds = by_parts(&scene);
            scene.meshes[0].positions.push(Vec3::NAN);
            let mut slices = Slices::new(&bounds);
            for instance in &scene.instances {
                slices.cover(instance, &scene.meshes[0]).expect("no face has that corner");
            }
            // Strays are outside, and reach into the outermost slices.
            let slow = Slices::of(&scene, &bounds);
            let (quick, slow) = (slices.reached.covered(), slow.reached.covered());
            let differ = quick.iter().flatten().zip(slow.iter().flatten()).filter(|(a, b)| a != b);
            assert!(differ.count() <= 6 && (gap > 0.0 || quick == slow));
        }
        let mut scene = spiral(80_000, 0.0);
        scene.meshes[0].positions[70_000].y = f32::NAN;
        let bounds = by_parts(&scene);
        assert!(Slices::new(&bounds).cover(&scene.instances[0], &scene.meshes[0]).is_none());
    }

    #[test]
    fn every_face_counts_once_whoever_counts_it() {
        for faces in [40, CHUNK, CHUNK + 1, 3 * CHUNK + 5] {
            let counted = gather(&spiral(faces, 0.0), || 0, |n, _| *n += 1, |n, more| *n += more);
            assert_eq!(counted, 2 * faces, "two instances");
        }
    }

    #[test]
    fn corners_that_are_nowhere_are_left_to_the_long_way() {
        let mut scene = spiral(20_000, 0.0);
        scene.meshes[0].positions[7].y = f32::NAN;
        let whole = by_parts(&scene).whole;
        assert!(of_faces(&scene, whole).is_none() && robust_bounds(&scene).hi.is_finite());
    }

    #[test]
    fn a_face_that_is_not_looked_at_and_has_a_corner_nowhere_is_left_to_the_long_way() {
        let mut scene = spiral(2_000, 30.0);
        // Of faces by the thousand, every second one would be looked at.
        let last = scene.meshes[0].triangles.len() - 1;
        scene.meshes[0].positions.push(Vec3::NAN);
        scene.meshes[0].triangles[last][2] = 2_002;
        let long = by_parts(&scene);
        assert_eq!(of_faces(&scene, long.whole), None);
        assert_eq!(robust_bounds_within(&scene, long.whole), long);
    }

    #[test]
    fn strays_of_a_flat_model_come_off_where_the_mean_of_three_equal_numbers_is_another() {
        let z = 0.1_f64;
        assert_ne!((z + z + z) / 3.0, z);
        let mut scene = spiral(20_000, 30.0);
        scene.meshes[0].positions.iter_mut().for_each(|p| p.z = 0.0);
        scene.instances[0].world_from_object.translation.z = z;
        scene.instances[1].world_from_object.translation.z = z;
        assert!(robust_bounds(&scene).strays > 0);
    }
}
