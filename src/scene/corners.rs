//! Extents of the corners of all faces, found without placing every corner of every instance.

use super::{Instance, Mesh, Scene};
use crate::math::{DVec3, Vec3};
use rayon::prelude::*;

/// Extents of points, in whatever directions the implementation tracks.
///
/// The extents are convex: if they hold all corners of a box, they hold every point in it.
pub(crate) trait Outline: Clone + Send + Sync {
    /// Takes in a corner; world space. The coordinates of a missing or invalid corner are not finite.
    fn add(&mut self, p: DVec3);

    /// Takes in everything that another outline has taken in.
    fn join(&mut self, other: &Self);

    /// Whether a point would add nothing; `false` if it is not finite.
    fn holds(&self, p: DVec3) -> bool;
}

/// Bounding box of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hull {
    /// Least corner; greater than `hi` when there are no points.
    pub lo: DVec3,
    /// Greatest corner.
    pub hi: DVec3,
    /// Whether all points were finite; the box is that of the finite ones.
    pub finite: bool,
}

impl Hull {
    /// Box without points.
    pub(crate) const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY, finite: true };
}

impl Outline for Hull {
    fn add(&mut self, p: DVec3) {
        if p.is_finite() {
            (self.lo, self.hi) = (self.lo.min(p), self.hi.max(p));
        } else {
            self.finite = false;
        }
    }

    fn join(&mut self, other: &Self) {
        (self.lo, self.hi) = (self.lo.min(other.lo), self.hi.max(other.hi));
        self.finite &= other.finite;
    }

    /// Exact: each coordinate of a placed point is monotonic in each of the point's own coordinates, rounded or not, so that the
    /// corners of a mesh's box reach furthest.
    fn holds(&self, p: DVec3) -> bool {
        p.cmpge(self.lo).all() && p.cmple(self.hi).all()
    }
}

/// Takes in the corners of all faces, each used vertex once per instance, but skips instances whose box is held by the extents of
/// the others.
pub(crate) fn take_in(scene: &Scene, outline: &mut impl Outline) {
    let instances = || scene.instances.iter().filter(|instance| (instance.mesh as usize) < scene.meshes.len());
    let mut standing = vec![0_u32; scene.meshes.len()];
    instances().for_each(|instance| standing[instance.mesh as usize] += 1);
    let of = |(mesh, &times): (_, &u32)| (times > 0).then(|| Corners::of(mesh));
    let corners: Vec<Option<Corners>> = scene.meshes.par_iter().zip(&standing).map(of).collect();
    let placed = || instances().filter_map(|instance| Some((instance, corners[instance.mesh as usize].as_ref()?)));

    // A few corners of every instance of a crowd make extents that hold most of the others.
    let outermost = |(of, &times): (&Option<Corners>, &u32)| match of {
        Some(corners) if times > 1 => corners.outermost(),
        _ => Vec::new(),
    };
    let outermost: Vec<Vec<Vec3>> = corners.iter().zip(&standing).map(outermost).collect();
    for (instance, _) in placed().filter(|(instance, _)| standing[instance.mesh as usize] > 1) {
        let corners = outermost[instance.mesh as usize].iter();
        corners.for_each(|p| outline.add(place(instance, *p)));
    }
    for (instance, corners) in placed() {
        if !corners.are_held(instance, outline) {
            corners.add_to(instance, outline);
        }
    }
}

/// Bounding box of all corners of a mesh's faces, object space; `lo > hi` if there are none.
pub(crate) type ObjectBox = (Vec3, Vec3);

/// Returns the box of each mesh; `None` where a corner of a face is missing or not finite.
pub(crate) fn object_boxes(scene: &Scene) -> Vec<Option<ObjectBox>> {
    scene.meshes.par_iter().map(|mesh| Corners::of(mesh).bounds).collect()
}

/// Corners of a mesh's box as placed by an instance, world space.
pub(crate) fn placed_box((lo, hi): ObjectBox, instance: &Instance) -> [DVec3; 8] {
    let end = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
    std::array::from_fn(|i| place(instance, Vec3::new(end(i, 0), end(i, 1), end(i, 2))))
}

/// Vertices per parallel task.
const RUN: usize = 1 << 14;

/// The vertices of a mesh that its faces use.
struct Corners<'a> {
    mesh: &'a Mesh,
    /// Whether each vertex is used by a face.
    used: Vec<bool>,
    /// Box of the used vertices; `None` where one is missing or not finite.
    bounds: Option<ObjectBox>,
}

impl<'a> Corners<'a> {
    fn of(mesh: &'a Mesh) -> Self {
        let mut used = vec![false; mesh.positions.len()];
        let mut there = true;
        let mut mark = |corners: &[u32]| {
            for &i in corners {
                match used.get_mut(i as usize) {
                    Some(used) => *used = true,
                    None => there = false,
                }
            }
        };
        mark(mesh.triangles.as_flattened());
        mark(&mesh.polygon_corners);
        let mut corners = Self { mesh, used, bounds: None };
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY, there);
        let grow = |(lo, hi, finite): (Vec3, Vec3, bool), p: &Vec3| (lo.min(*p), hi.max(*p), finite && p.is_finite());
        let (lo, hi, finite) = corners.all().fold(nothing, grow);
        corners.bounds = finite.then_some((lo, hi));
        corners
    }

    /// All vertices that a face uses.
    fn all(&self) -> impl Iterator<Item = &Vec3> {
        self.mesh.positions.iter().zip(&self.used).filter(|(_, used)| **used).map(|(p, _)| p)
    }

    /// A vertex on each side of the box.
    fn outermost(&self) -> Vec<Vec3> {
        let Some((lo, hi)) = self.bounds else { return Vec::new() };
        let on = |side: Vec3, axis: usize| self.all().find(|p| p[axis] == side[axis]).copied();
        (0..3).flat_map(|axis| [on(lo, axis), on(hi, axis)]).flatten().collect()
    }

    /// Whether it is certain that no corner adds anything to the outline.
    fn are_held(&self, instance: &Instance, outline: &impl Outline) -> bool {
        self.bounds.is_some_and(|bounds| placed_box(bounds, instance).iter().all(|p| outline.holds(*p)))
    }

    fn add_to<O: Outline>(&self, instance: &Instance, outline: &mut O) {
        let run = |(positions, used): (&[Vec3], &[bool])| {
            let mut more = outline.clone();
            let used = positions.iter().zip(used).filter(|(_, used)| **used);
            used.for_each(|(p, _)| more.add(place(instance, *p)));
            more
        };
        let runs = self.mesh.positions.par_chunks(RUN).zip(self.used.par_chunks(RUN));
        let more: Vec<O> = runs.map(run).collect();
        more.iter().for_each(|more| outline.join(more));
        if self.bounds.is_none() {
            outline.add(DVec3::NAN);
        }
    }
}

fn place(instance: &Instance, p: Vec3) -> DVec3 {
    instance.world_from_object.transform_point3(p.as_dvec3())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DMat3};
    use std::sync::atomic::{AtomicU64, Ordering};

    /// A mesh of points on a bent sheet, one of which no face uses.
    fn sheet(seed: f32) -> Mesh {
        let at = |i: u32| {
            let t = i as f32 * 0.37 + seed;
            Vec3::new(libm::sinf(t * 1.7), libm::cosf(t * 2.3) * 0.4, libm::sinf(t * 0.9 + 1.0) * 2.0)
        };
        let mut positions: Vec<Vec3> = (0..100).map(at).collect();
        positions.push(Vec3::splat(1e6));
        let triangles = (0..98).map(|i| [i, i + 1, i + 2]).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    /// Meshes in many places, rotated, sheared, mirrored and of all sizes.
    fn crowd(instances: u32) -> Scene {
        let placed = |i: u32| {
            let t = f64::from(i);
            let turn = DMat3::from_rotation_y(t * 0.7) * DMat3::from_rotation_x(t * 1.3);
            let size = DMat3::from_diagonal(DVec3::new(1.0 + 0.1 * (i % 5) as f64, -0.3, 0.01 + (i % 3) as f64));
            let place = DVec3::new((i % 17) as f64, (i % 13) as f64 * 0.7, (i % 19) as f64) * 100.0 + 1e5;
            let world_from_object = DAffine3 { matrix3: turn * size, translation: place };
            Instance { name: String::new(), mesh: i % 3, world_from_object }
        };
        let meshes = (0..4).map(|i| sheet(i as f32)).collect();
        Scene { meshes, instances: (0..instances).map(placed).collect(), ..Scene::default() }
    }

    /// Box of every corner, and the number of corners taken in.
    #[derive(Clone)]
    struct Counted<'a>(Hull, &'a AtomicU64);

    impl Outline for Counted<'_> {
        fn add(&mut self, p: DVec3) {
            self.0.add(p);
            self.1.fetch_add(1, Ordering::Relaxed);
        }

        fn join(&mut self, other: &Self) {
            self.0.join(&other.0);
        }

        fn holds(&self, p: DVec3) -> bool {
            self.0.holds(p)
        }
    }

    fn one_by_one(scene: &Scene) -> Hull {
        let mut hull = Hull::EMPTY;
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let corners = mesh.triangles.iter().flatten().chain(&mesh.polygon_corners);
            corners.for_each(|&i| hull.add(place(instance, mesh.positions[i as usize])));
        }
        hull
    }

    #[test]
    fn the_box_of_many_instances_is_that_of_all_their_corners_bit_for_bit() {
        for instances in [0, 1, 2, 3, 10, 1000] {
            let scene = crowd(instances);
            let placed = AtomicU64::new(0);
            let mut found = Counted(Hull::EMPTY, &placed);
            take_in(&scene, &mut found);
            assert_eq!(found.0, one_by_one(&scene), "{instances}");
            let placed = placed.into_inner();
            assert!(instances < 1000 || placed < 20_000, "{placed} of 100 000 corners were placed");
        }
    }

    #[test]
    fn a_corner_that_is_nowhere_or_not_there_is_told_and_the_others_count() {
        let spoil: [fn(&mut Mesh); 3] = [
            |mesh| mesh.positions[7].y = f32::NAN,
            |mesh| mesh.positions[7].y = f32::INFINITY,
            |mesh| mesh.triangles[5][1] = 101,
        ];
        for spoil in spoil {
            let mut scene = crowd(30);
            spoil(&mut scene.meshes[0]);
            let mut found = Hull::EMPTY;
            take_in(&scene, &mut found);
            assert!(!found.finite && found.lo.is_finite() && found.hi.is_finite());
        }
        let mut scene = crowd(30);
        scene.meshes[0].positions[100] = Vec3::NAN;
        scene.meshes[3].triangles[0] = [200; 3];
        let mut found = Hull::EMPTY;
        take_in(&scene, &mut found);
        assert!(found.finite, "no face uses the vertex, and no instance the mesh");
    }
}
