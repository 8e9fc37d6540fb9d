//! One bounding volume for each object: a ray that enters it is tested against every prim of the object.
//!
//! T. Whitted, *An Improved Illumination Model for Shaded Display*, 1980, with spheres; here spheres or boxes. An object is a
//! run of faces of the file (see [`Shapes::objects`]), or a sphere or cone. In a scene of one object only the volume around
//! the whole scene culls.
//!
//! # Why no hit is lost
//! Volumes contain all points of their prims: boxes are unions of the prims' own bounds; for spheres see [`BoundingSphere`].

use super::probe::{Extent, NodeId, Visit};
use super::query::{Culling, Goal, Query};
use super::shapes::{Object, Prim};
use super::slabs::{BoxRay, limit, start};
use super::stats::listed_once;
use super::{Probe, Shapes, StructureStats};
use crate::math::aabb::Aabb;
use crate::math::bounds::U64;
use crate::math::{DVec3, Vec3};

/// Kind of bounding volume.
pub trait Volume: Copy + std::fmt::Debug + Send + Sync {
    /// Data shared by the volume tests of one ray.
    type Ray;

    /// Computes the volume around some prims of `shapes`.
    fn around(shapes: &Shapes, prims: impl Iterator<Item = u32> + Clone) -> Self;

    /// Prepares the ray of a query.
    fn ray<G: Goal>(query: &Query<G>) -> Self::Ray;

    /// Whether the ray is inside the volume anywhere before `limit`.
    fn is_entered(&self, ray: &Self::Ray, limit: f64) -> bool;

    /// Whether the volume contains all of a prim, judged by its corners or bounds.
    fn holds(&self, shapes: &Shapes, prim: u32) -> bool;

    /// Extent of the volume.
    fn extent(&self) -> Extent;
}

/// All objects with their bounding volumes.
#[derive(Clone, Debug)]
pub struct Volumes<'a, V> {
    shapes: &'a Shapes,
    volumes: Vec<(V, Object)>,
}

impl<'a, V: Volume> Volumes<'a, V> {
    /// Computes the volume of each object.
    pub fn build(shapes: &'a Shapes) -> Self {
        let volumes = shapes.objects().into_iter().map(|o| (V::around(shapes, o.prims()), o)).collect();
        Self { shapes, volumes }
    }

    /// Sizes; objects count as cells.
    pub fn summary(&self) -> StructureStats {
        StructureStats {
            n_v: self.volumes.len() as u64,
            n_oiv: self.volumes.iter().map(|(_, o)| o.prims().count() as u64).sum(),
            bytes: size_of_val(&*self.volumes) as u64,
            ..StructureStats::default()
        }
    }

    /// Visits everything: each bounded prim is in exactly one object, whose volume contains it.
    pub fn check(&self) -> Result<StructureStats, String> {
        let mut objects = vec![0u32; self.shapes.bounded() as usize];
        for (volume, object) in &self.volumes {
            for prim in object.prims() {
                objects[prim as usize] += 1;
                if !volume.holds(self.shapes, prim) {
                    return Err(format!("prim {prim} is not inside {volume:?} of {object:?}"));
                }
            }
        }
        listed_once(&objects, "objects").map(|()| self.summary())
    }
}

impl<V: Volume> Culling for Volumes<'_, V> {
    type Scratch = ();

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) {}

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, (): &mut (), probe: &mut P) {
        let ray = V::ray(query);
        for (i, (volume, object)) in (0..).zip(&self.volumes) {
            probe.volume_tests(1);
            if !volume.is_entered(&ray, limit(query)) {
                continue;
            }
            probe.step();
            probe.visit(|| Visit { place: NodeId::Object(i), extent: volume.extent(), listed: Some(object.len()) });
            probe.cell(false);
            for prim in object.prims() {
                if query.test(prim, probe) {
                    return;
                }
            }
        }
    }
}

impl Volume for Aabb {
    type Ray = BoxRay;

    fn around(shapes: &Shapes, prims: impl Iterator<Item = u32> + Clone) -> Self {
        prims.fold(Self::EMPTY, |b, p| b.union(shapes.bounds(p)))
    }

    fn ray<G: Goal>(query: &Query<G>) -> BoxRay {
        BoxRay::new(query)
    }

    fn is_entered(&self, ray: &BoxRay, limit: f64) -> bool {
        ray.enters(self, limit).is_some()
    }

    fn holds(&self, shapes: &Shapes, prim: u32) -> bool {
        self.union(shapes.bounds(prim)) == *self
    }

    fn extent(&self) -> Extent {
        Extent::Box(*self)
    }
}

/// Bounding sphere around the centre of the prims' box.
#[derive(Clone, Copy, Debug)]
pub struct BoundingSphere {
    center: DVec3,
    radius: f64,
}

/// Enlargement factor of a ball: a distance from the centre errs by 4 u.
const ROOM: f64 = 1.0 + 8.0 * U64;

/// Bound, relative to the distance of the centre from the ray's origin, of the error of the ray's point nearest to the
/// centre, and of its distance: 8 u from the projection, as for spheres (`math::sphere`). A sphere's own test errs by as
/// much. Eight times over.
const PLACE: f64 = 64.0 * U64;

/// A ray, and the widened start of its range.
#[derive(Clone, Copy, Debug)]
pub struct BallRay {
    origin: DVec3,
    dir: DVec3,
    from: f64,
}

impl Volume for BoundingSphere {
    type Ray = BallRay;

    fn around(shapes: &Shapes, prims: impl Iterator<Item = u32> + Clone) -> Self {
        let bounds = <Aabb as Volume>::around(shapes, prims.clone());
        let center = (bounds.lo.as_dvec3() + bounds.hi.as_dvec3()) * 0.5;
        let radius = prims.map(|p| reach(shapes, p, center)).fold(0.0, f64::max);
        Self { center, radius: radius * ROOM }
    }

    fn ray<G: Goal>(query: &Query<G>) -> BallRay {
        BallRay { origin: query.ray.origin.as_dvec3(), dir: query.ray.dir.as_dvec3(), from: start(query) }
    }

    fn is_entered(&self, ray: &BallRay, limit: f64) -> bool {
        let to_center = self.center - ray.origin;
        let (speed2, slack) = (ray.dir.length_squared(), PLACE * to_center.length());
        let t = to_center.dot(ray.dir) / speed2;
        let distance = (to_center - ray.dir * t).length();
        let radius = self.radius + slack;
        if distance > radius {
            return false;
        }
        // A ball that overflowed counts as entered.
        let half = ((radius * radius - distance * distance) / speed2).sqrt() + slack / speed2.sqrt();
        let beyond = t - half > limit;
        let before = t + half < ray.from;
        !(beyond || before)
    }

    fn holds(&self, shapes: &Shapes, prim: u32) -> bool {
        reach(shapes, prim, self.center) <= self.radius
    }

    fn extent(&self) -> Extent {
        Extent::Ball { center: self.center, radius: self.radius }
    }
}

/// Largest distance from a point to a prim: to its corners, to a sphere, to the box of a cone, or to that of a polygon, which
/// may be hit anywhere in it because its corners need not be coplanar.
fn reach(shapes: &Shapes, prim: u32, from: DVec3) -> f64 {
    let distance = |p: Vec3| (p.as_dvec3() - from).length();
    match shapes.prim(prim) {
        Prim::Triangle(corners) => corners.into_iter().map(distance).fold(0.0, f64::max),
        Prim::Sphere(s) => distance(s.center) + f64::from(s.radius),
        Prim::Polygon(_) | Prim::Cone(_) | Prim::Plane(..) => {
            let Aabb { lo, hi } = shapes.bounds(prim);
            let (lo, hi) = (lo.as_dvec3() - from, hi.as_dvec3() - from);
            lo.abs().max(hi.abs()).length()
        }
    }
}
