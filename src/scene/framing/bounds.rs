//! Bounding box of the model without strays: parts so few, so small and so far away that nobody meant them to be seen.

use super::crowd::Crowd;
use super::parts::{Granularity, Part, faces, gather, hull, solids};
use super::slices::{Covered, Slices};
use crate::math::DVec3;
use crate::scene::corners::{Hull, Outline, object_boxes, placed_box, take_in};
use crate::scene::{Instance, Mesh, Scene};

/// Bounds of the visible model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least corner of the model's box; world space, finite.
    pub lo: DVec3,
    /// Greatest corner.
    pub hi: DVec3,
    /// Faces, spheres and cones left out as strays.
    pub strays: u64,
    /// Box of everything, strays included; equal to `lo`, `hi` if there are none.
    pub whole: (DVec3, DVec3),
}

impl Bounds {
    /// Centre of the box.
    pub fn center(&self) -> DVec3 {
        self.lo * 0.5 + self.hi * 0.5
    }

    /// The union of both boxes.
    pub fn union(&self, other: &Self) -> Self {
        let whole = (self.whole.0.min(other.whole.0), self.whole.1.max(other.whole.1));
        let strays = self.strays.max(other.strays);
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi), strays, whole }
    }

    /// Half the diagonal of the box; always greater than 0.
    pub fn radius(&self) -> f64 {
        let radius = (self.hi - self.lo).length() * 0.5;
        if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
    }

    /// Whether the box contains a point.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.lo).all() && p.cmple(self.hi).all()
    }
}

/// Finds the box of the model.
///
/// Space is cut into slices along each axis. Where an empty gap at least half as long as the model separates an end with hardly
/// any faces and area, that end is stray; the search goes on in the rest until nothing more comes off. Whatever is connected to
/// the model, however thin, is part of it. A scene without anything bounded gets the unit box around the origin.
pub fn robust_bounds(scene: &Scene) -> Bounds {
    let mut corners = Hull::EMPTY;
    take_in(scene, &mut corners);
    let found = if corners.finite { of_faces(scene, (corners.lo, corners.hi)) } else { None };
    found.unwrap_or_else(|| by_parts(scene))
}

/// Finds the box of the model if the box of all corners is known, such as [`World::bounds`](crate::render::World::bounds).
pub fn robust_bounds_within(scene: &Scene, whole: (DVec3, DVec3)) -> Bounds {
    of_faces(scene, whole).unwrap_or_else(|| by_parts(scene))
}

/// Box of a model made of faces whose corners all lie in the box `whole`; `None` for any other model.
fn of_faces(scene: &Scene, whole: (DVec3, DVec3)) -> Option<Bounds> {
    let (lo, hi) = whole;
    if !(scene.spheres.is_empty() && scene.cones.is_empty() && lo.is_finite() && hi.is_finite()) {
        return None;
    }
    let bounds = Bounds { lo, hi, strays: 0, whole };
    if is_whole(scene, &bounds)? {
        return Some(bounds);
    }
    let crowd = Crowd::of(scene);
    let slices = Slices::of(scene, &crowd, &bounds);
    (slices.parts() == faces(scene)).then(|| without_strays(scene, &crowd, bounds, slices))
}

/// Box of the model of any scene, found part by part.
fn by_parts(scene: &Scene) -> Bounds {
    let Some(whole) = hull(scene, Granularity::Faces, |_| true) else {
        let unit = (DVec3::splat(-0.5), DVec3::splat(0.5));
        return Bounds { lo: unit.0, hi: unit.1, strays: 0, whole: unit };
    };
    let bounds = Bounds { lo: whole.0, hi: whole.1, strays: 0, whole };
    let crowd = Crowd::of(scene);
    let slices = Slices::of(scene, &crowd, &bounds);
    without_strays(scene, &crowd, bounds, slices)
}

/// Removes strays until nothing more comes off; `slices` hold all parts in `bounds`.
fn without_strays(scene: &Scene, crowd: &Crowd, mut bounds: Bounds, mut slices: Slices) -> Bounds {
    // Each round zooms in by up to SLICES; the range of f64 needs far fewer than this many.
    for _ in 0..128 {
        if slices.has_no_gap() {
            break;
        }
        let Some(core) = slices.core() else { break };
        let kept = |part: &Part| bounds.contains(part.center) && slices.lies_in(&core, part.center);
        let Some((lo, hi)) = hull(scene, Granularity::Crowd(crowd, &bounds), kept) else { break };
        // Boxes of crowd instances may be too large.
        let (lo, hi) = (lo.max(bounds.lo), hi.min(bounds.hi));
        if (lo, hi) == (bounds.lo, bounds.hi) {
            break;
        }
        (bounds.lo, bounds.hi) = (lo, hi);
        slices = Slices::of(scene, crowd, &bounds);
    }
    if (bounds.lo, bounds.hi) == bounds.whole {
        return bounds;
    }
    // Boxes of crowd instances may reach beyond their contents.
    let outside = |part: &Part| match part.faces {
        1 => !bounds.contains(part.lo) || !bounds.contains(part.hi),
        _ => !bounds.contains(part.center),
    };
    let granularity = Granularity::Crowd(crowd, &bounds);
    let add = |n: &mut u64, part: &Part| *n += if outside(part) { part.faces } else { 0 };
    bounds.strays = gather(scene, granularity, || 0, add, |n, more| *n += more);
    if !crowd.is_empty() {
        (bounds.lo, bounds.hi) = tight(scene, bounds);
    }
    bounds
}

/// Tightens `bounds`, which crowd instances have made a little too large, to its contents.
fn tight(scene: &Scene, bounds: Bounds) -> (DVec3, DVec3) {
    let mut inside = Inside { hull: Hull::EMPTY, bounds };
    take_in(scene, &mut inside);
    for part in solids(scene) {
        inside.add(part.lo);
        inside.add(part.hi);
    }
    let Hull { lo, hi, .. } = inside.hull;
    if lo.cmple(hi).all() { (lo, hi) } else { (bounds.lo, bounds.hi) }
}

/// Bounding box of all corners inside another box.
#[derive(Clone)]
struct Inside {
    hull: Hull,
    bounds: Bounds,
}

impl Outline for Inside {
    fn add(&mut self, p: DVec3) {
        if self.bounds.contains(p) {
            self.hull.add(p);
        }
    }

    fn join(&mut self, other: &Self) {
        self.hull.join(&other.hull);
    }

    fn holds(&self, p: DVec3) -> bool {
        self.hull.holds(p)
    }
}

/// Triangles of a mesh between two tests for whether all slices have been reached.
const FACES_AT_A_TIME: usize = 1024;

/// Before all faces of a mesh, a sample from all over it is examined, one sample for this many faces …
const FACES_A_LOOK: usize = 16 * FACES_AT_A_TIME;
/// … and at most this many samples: per face they cost three times as much as examining all faces.
const LOOKS: usize = 16;

/// Whether it is certain that nothing comes off a model of triangles: because they reach into every slice, which holds for most
/// models and is often found from a sample of faces, or because too many lie before the first gap. `None` if a corner that was
/// examined is missing or not finite.
fn is_whole(scene: &Scene, bounds: &Bounds) -> Option<bool> {
    let mut sample = Slices::new(bounds);
    let looks = placed(scene).map(|(_, mesh)| looks_at(mesh)).max().unwrap_or(0);
    for look in 0..looks {
        if has_no_gap_at_a_look(scene, look, &mut sample)? {
            return Some(true);
        }
    }
    let mut all = Slices::new(bounds);
    cover_all(scene, &mut all, sample.reached.covered())?;
    // Polygons are not among the triangles.
    let counted = scene.meshes.iter().all(|mesh| mesh.polygons.is_empty());
    Some(all.has_no_gap() || counted && all.holds_together())
}

/// Records the slices reached by the triangles of all instances, or of enough of them to leave no gap; `covered` are slices
/// already known to be reached. Returns the number of instances examined face by face: for others in a row with one of these the
/// box suffices. `None` where a corner is missing or not finite.
fn cover_all(scene: &Scene, all: &mut Slices, mut covered: Covered) -> Option<usize> {
    let (mut looked_at, mut cells) = (0, Vec::new());
    let is_crowd = scene.instances.len() > scene.meshes.len();
    let boxes = if is_crowd { object_boxes(scene) } else { vec![None; scene.meshes.len()] };
    for (instance, mesh) in placed(scene) {
        let place = boxes[instance.mesh as usize].filter(|_| has_many(mesh)).map(|b| placed_box(b, instance));
        match place.filter(|place| all.lies_throughout(&covered, place)) {
            Some(place) => all.cover_between(&place, mesh.triangles.len() as u64),
            None => {
                all.cover(instance, mesh, &mut cells)?;
                looked_at += 1;
                if has_many(mesh) {
                    all.reached.add_covered(&mut covered);
                }
            }
        }
        if has_many(mesh) && all.has_no_gap() {
            break;
        }
    }
    Some(looked_at)
}

/// Whether a mesh has so many faces that shortcuts pay.
fn has_many(mesh: &Mesh) -> bool {
    mesh.triangles.len() > FACES_AT_A_TIME
}

/// All instances with their meshes.
fn placed(scene: &Scene) -> impl Iterator<Item = (&Instance, &Mesh)> {
    scene.instances.iter().filter_map(|instance| Some((instance, scene.meshes.get(instance.mesh as usize)?)))
}

/// Number of samples of a mesh's faces that are examined first.
fn looks_at(mesh: &Mesh) -> usize {
    if has_many(mesh) { (mesh.triangles.len() / FACES_A_LOOK + 1).min(LOOKS) } else { 0 }
}

/// Records the reach of one sample of the faces of large meshes, a different one for each `look`, until no slice is empty;
/// returns whether that is so. `None` where a corner is missing or not finite.
fn has_no_gap_at_a_look(scene: &Scene, look: usize, slices: &mut Slices) -> Option<bool> {
    for (instance, mesh) in placed(scene).filter(|(_, mesh)| look < looks_at(mesh)) {
        let corner = |i: u32| {
            let p = mesh.positions.get(i as usize)?;
            Some(instance.world_from_object.transform_point3(p.as_dvec3())).filter(|p| p.is_finite())
        };
        // Neighbours in the file are neighbours in space: a sample from all over it reaches every slice far sooner than the first
        // faces.
        let stride = mesh.triangles.len() / FACES_AT_A_TIME + 1;
        for triangle in mesh.triangles.iter().skip(look).step_by(stride) {
            let [a, b, c] = triangle.map(corner);
            let (a, b, c) = (a?, b?, c?);
            slices.reach(a.min(b).min(c), a.max(b).max(c));
        }
        if slices.has_no_gap() {
            return Some(true);
        }
    }
    Some(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, Vec3};
    use crate::scene::framing::parts::CHUNK;

    /// Triangles along a spiral, with a gap of `gap` near the end, in two instances.
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
            assert_eq!(is_whole(&scene, &whole), Some(short), "{faces} {gap}");
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
                slices.cover(instance, &scene.meshes[0], &mut Vec::new()).expect("no face has that corner");
            }
            // Strays lie outside, and reach into the outermost slices.
            let slow = Slices::of(&scene, &Crowd::of(&Scene::default()), &bounds);
            let (quick, slow) = (slices.reached.covered(), slow.reached.covered());
            let differ = quick.iter().flatten().zip(slow.iter().flatten()).filter(|(a, b)| a != b);
            assert!(differ.count() <= 6 && (gap > 0.0 || quick == slow));
        }
        let mut scene = spiral(80_000, 0.0);
        scene.meshes[0].positions[70_000].y = f32::NAN;
        let bounds = by_parts(&scene);
        assert!(Slices::new(&bounds).cover(&scene.instances[0], &scene.meshes[0], &mut Vec::new()).is_none());
    }

    /// A large mesh in many places, some of them far away.
    fn crowd(far: f64) -> Scene {
        let mut scene = spiral(2_000, 0.0);
        let place = |i: u32| {
            let t = f64::from(i);
            let far = if i % 200 == 7 { far } else { 0.0 };
            let place = DVec3::new(f64::from(i * 7 % 31) * 9.0, f64::from(i * 11 % 29) * 9.0, far + t * 0.7);
            let m = DAffine3::from_translation(place) * DAffine3::from_rotation_y(t) * DAffine3::from_rotation_x(t);
            let uneven = DAffine3::from_scale(DVec3::new(1.0, if i.is_multiple_of(9) { 0.4 } else { 1.0 }, 1.0));
            Instance { name: String::new(), mesh: 0, world_from_object: m * uneven }
        };
        scene.instances = (0..400).map(place).collect();
        scene
    }

    #[test]
    fn a_crowd_has_the_bounds_and_strays_that_it_has_face_by_face() {
        for far in [0.0, 900.0, 1e9] {
            let scene = crowd(far);
            let found = robust_bounds(&scene);
            let whole = Bounds { lo: found.whole.0, hi: found.whole.1, strays: 0, whole: found.whole };
            let by_faces = Crowd::of(&Scene::default());
            let slow = without_strays(&scene, &by_faces, whole, Slices::of(&scene, &by_faces, &whole));
            assert_eq!(found, slow, "{far}");
            assert!(!Crowd::of(&scene).is_empty() && (found.strays > 0) == (far > 0.0), "{far}");
        }
    }

    #[test]
    fn what_stands_in_rows_with_gaps_between_is_asked_face_by_face_for_one_of_each_row() {
        let mut scene = spiral(40_000, 0.0);
        let place = |i: u32| {
            let place = DVec3::new(f64::from(i % 20) * 4.0, f64::from(i / 20) * 3.0, 0.0);
            Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::from_translation(place) }
        };
        scene.instances = (0..400).map(place).collect();
        let whole = hull(&scene, Granularity::Faces, |_| true).expect("there are faces");
        let bounds = Bounds { lo: whole.0, hi: whole.1, strays: 0, whole };
        let mut slices = Slices::new(&bounds);
        let nothing = slices.reached.covered();
        let looked_at = cover_all(&scene, &mut slices, nothing).expect("all are somewhere");
        assert!(!slices.has_no_gap() && (20..60).contains(&looked_at), "{looked_at} of 400");
        let mut slow = Slices::new(&bounds);
        let mut cells = Vec::new();
        scene.instances.iter().for_each(|i| slow.cover(i, &scene.meshes[0], &mut cells).expect("all are somewhere"));
        assert_eq!(slices.reached.covered(), slow.reached.covered());
        assert_eq!(slices.holds_together(), slow.holds_together());
    }

    /// Clusters of faces side by side, of any size and at any distance. Every eighth seed has meshes of many faces, each in many
    /// places close together, some of them too small to be examined face by face.
    fn clusters(seed: u64) -> Scene {
        let mut random = crate::math::random::Random::new(seed);
        let mut scene = Scene::default();
        let mut x = 0.0;
        for cluster in 0..2 + seed as u32 % 4 {
            let (faces, times) = match seed % 8 {
                0 => (1025 + random.below(2000), 5 + random.below(36)),
                _ => (1 + random.below(130) * random.below(3) / 2, 1),
            };
            let positions = (0..faces + 2).map(|_| random.cube()).collect();
            let triangles = (0..faces as u32).map(|i| [i, i + 1, i + 2]).collect();
            scene.meshes.push(Mesh { positions, triangles, ..Mesh::default() });
            let (size, y) = (f64::from(random.unit() * 4.0 - 2.0).exp2(), f64::from(random.unit()));
            for _ in 0..times {
                let part = if times > 1 { 0.1 + 0.3 * f64::from(random.unit()) } else { 1.0 };
                let m = DAffine3::from_scale(DVec3::splat(size * part));
                let at = DVec3::new(x, y, 0.0) + random.cube().as_dvec3() * (if times > 1 { size } else { 0.0 });
                let place = DAffine3::from_translation(at) * m;
                scene.instances.push(Instance { name: String::new(), mesh: cluster, world_from_object: place });
            }
            x += size * 2.0 + f64::from(random.unit() * 8.0 - 4.0).exp2();
        }
        scene
    }

    #[test]
    fn what_is_whole_at_a_look_is_whole_face_by_face() {
        let (mut gaps, mut crowds, mut strays) = (0, 0, 0);
        for seed in 0..1000 {
            let scene = clusters(seed);
            let slow = by_parts(&scene);
            let whole = Bounds { lo: slow.whole.0, hi: slow.whole.1, strays: 0, whole: slow.whole };
            let crowd = Crowd::of(&scene);
            let slices = Slices::of(&scene, &crowd, &whole);
            let is_whole = is_whole(&scene, &whole).expect("all corners are somewhere");
            assert!(!is_whole || slow == whole, "{seed}: {} came off", slow.strays);
            assert_eq!(robust_bounds(&scene), slow, "{seed}");
            let in_spite_of_gaps = is_whole && !slices.has_no_gap();
            gaps += u32::from(in_spite_of_gaps);
            crowds += u32::from(in_spite_of_gaps && !crowd.is_empty());
            strays += u32::from(slow.strays > 0);
        }
        assert!(
            gaps > 100 && crowds > 10 && strays > 25,
            "whole in spite of gaps: {gaps} ({crowds}); strays: {strays}"
        );
    }

    #[test]
    fn every_face_counts_once_whoever_counts_it() {
        for faces in [40, CHUNK, CHUNK + 1, 3 * CHUNK + 5] {
            let counted = gather(&spiral(faces, 0.0), Granularity::Faces, || 0, |n, _| *n += 1, |n, more| *n += more);
            assert_eq!(counted, 2 * faces, "two instances");
        }
    }

    #[test]
    fn corners_that_are_nowhere_are_left_to_the_long_way() {
        let mut scene = spiral(20_000, 0.0);
        scene.meshes[0].positions[0].y = f32::NAN;
        let whole = by_parts(&scene).whole;
        assert!(of_faces(&scene, whole).is_none() && robust_bounds(&scene).hi.is_finite());
    }

    #[test]
    fn a_face_that_is_not_looked_at_and_has_a_corner_nowhere_is_left_to_the_long_way() {
        let mut scene = spiral(2_000, 30.0);
        // With thousands of faces, the sample takes every second one.
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
