//! One bounding volume for each object: a ray that enters it is tested against every prim of the object.
//!
//! T. Whitted, *An Improved Illumination Model for Shaded Display*, 1980, with spheres; here spheres or boxes. An object is
//! a run of faces of the file (see [`Shapes::objects`]), or a sphere or cone. A scene of one object is culled by nothing
//! but the volume around all of it.
//!
//! # Why no hit is lost
//! Volumes hold all points of their prims: boxes are made of the prims' own bounds, and see [`BoundingSphere`].

use super::probe::{Extent, NodeId, Visit};
use super::query::{Culling, Goal, Query};
use super::shapes::{Object, Prim};
use super::slabs::{BoxRay, limit, start};
use super::stats::listed_once;
use super::{Probe, Shapes, StructureStats};
use crate::math::aabb::Aabb;
use crate::math::bounds::U64;
use crate::math::{DVec3, Vec3};

/// A kind of volume.
pub trait Volume: Copy + std::fmt::Debug + Send + Sync {
    /// What the volume tests of one ray share.
    type Ray;

    /// The volume around some prims of `shapes`.
    fn around(shapes: &Shapes, prims: impl Iterator<Item = u32> + Clone) -> Self;

    /// Prepares the ray of a query.
    fn ray<G: Goal>(query: &Query<G>) -> Self::Ray;

    /// Whether the ray is inside it anywhere before `limit`.
    fn is_entered(&self, ray: &Self::Ray, limit: f64) -> bool;

    /// Whether all of a prim is inside, as far as its corners or bounds tell.
    fn holds(&self, shapes: &Shapes, prim: u32) -> bool;

    /// What it looks like.
    fn extent(&self) -> Extent;
}

/// All objects with their volumes.
#[derive(Clone, Debug)]
pub struct Volumes<'a, V> {
    shapes: &'a Shapes,
    volumes: Vec<(V, Object)>,
}

impl<'a, V: Volume> Volumes<'a, V> {
    /// Puts a volume around each object.
    pub fn build(shapes: &'a Shapes) -> Self {
        let volumes = shapes.objects().into_iter().map(|o| (V::around(shapes, o.prims()), o)).collect();
        Self { shapes, volumes }
    }

    /// Objects count as cells.
    pub fn summary(&self) -> StructureStats {
        StructureStats {
            n_v: self.volumes.len() as u64,
            n_oiv: self.volumes.iter().map(|(_, o)| o.prims().count() as u64).sum(),
            bytes: size_of_val(&*self.volumes) as u64,
            ..StructureStats::default()
        }
    }

    /// Visits everything: each bounded prim is in one object, whose volume holds it.
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

/// A bounding sphere around the middle of the prims' box.
#[derive(Clone, Copy, Debug)]
pub struct BoundingSphere {
    center: DVec3,
    radius: f64,
}

/// How much larger than computed a ball is: a distance from the centre errs by 4 u.
const ROOM: f64 = 1.0 + 8.0 * U64;

/// How far from the exact one the point of a ray that is nearest to the centre may be, and its distance, relative to the
/// distance of the centre from the origin: 8 u from the projection, as for spheres (`math::sphere`). That much is also what
/// a sphere's own test errs by. Eight times over.
const PLACE: f64 = 64.0 * U64;

/// A ray and its widened beginning.
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
        // A ball that overflowed is entered.
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

/// The distance from a point to the farthest of a prim: of its corners, of a sphere, of the box of a cone, or of a polygon,
/// which may be hit anywhere in it as its corners need not lie in one plane.
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
