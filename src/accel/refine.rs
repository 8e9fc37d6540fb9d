//! Refinement of the winning hit, computed once in `f64`, with an error bound.

use super::shapes::Prim;
use super::{Hit, Ray, Shapes};
use crate::math::bounds::{CONE_PROJECTION, POSITION_T, U32, U64, above, offset_origin};
use crate::math::inset::{Rim, inset};
use crate::math::shear::RaySpace;
use crate::math::triangle::{Flat, Triangle};
use crate::math::{DVec3, Vec3, cone, plane, polygon, sphere, triangle};

/// Geometry of a hit, in the frame of the shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// Position of the hit.
    pub position: Vec3,
    /// Start of secondary rays before the offset from the surface: `position`, or a point of the same face that keeps away
    /// from its edges ([`inset`]).
    pub start: Vec3,
    /// Bound, on each axis, of the distance of `position` and `start` from exact points of the surface.
    pub error: Vec3,
    /// Unit geometric normal: towards the side from which a face is counter-clockwise, outwards for a sphere or cone. Zero
    /// for a face without area.
    pub normal: Vec3,
    /// Barycentric weight of the second corner; 0 for other prims than triangles.
    pub u: f32,
    /// Barycentric weight of the third corner; 0 for other prims than triangles.
    pub v: f32,
}

impl Refined {
    /// Origin of a secondary ray towards `dir` (of any length): outside the error of the position, on the side of the surface
    /// that the ray leaves to.
    pub fn origin(&self, dir: Vec3) -> Vec3 {
        offset_origin(self.start, self.error, self.normal, dir)
    }
}

impl Shapes {
    /// Position, error bound, normal and barycentric weights of a hit that a query of these shapes found on `ray`.
    ///
    /// # Panics
    ///
    /// For a miss: check [`Hit::is_some`].
    pub fn refine(&self, ray: &Ray, hit: &Hit) -> Refined {
        self.prim(hit.prim).refine(ray, hit)
    }

    /// Barycentric weights of the second and third corner at the ray's hit with triangle `prim`; 0 for other prims.
    pub(super) fn barycentrics(&self, prim: u32, ray: &RaySpace) -> (f32, f32) {
        match self.prim(prim) {
            Prim::Triangle(corners) => triangle::barycentrics(ray, &corners),
            _ => (0.0, 0.0),
        }
    }
}

impl Prim<'_> {
    /// Position, error bound, normal and barycentric weights of a hit with this prim that a query found on `ray`.
    pub fn refine(&self, ray: &Ray, hit: &Hit) -> Refined {
        if let Prim::Triangle(corners) = self {
            let plane = TrianglePlane::of(corners);
            let (position, error, certain) = plane.place(ray.origin, ray.dir, (hit.u, hit.v));
            if certain {
                return Refined { position, start: position, error, normal: plane.flat.unit(), u: hit.u, v: hit.v };
            }
        }
        self.refine_with_care(ray, hit)
    }

    /// Refines a hit of any prim and any ray, without shortcuts.
    fn refine_with_care(&self, ray: &Ray, hit: &Hit) -> Refined {
        let Some(space) = RaySpace::new(ray.origin, ray.dir) else {
            let position = ray.origin;
            return Refined { position, start: position, error: Vec3::ZERO, normal: Vec3::ZERO, u: 0.0, v: 0.0 };
        };
        let on_ray = |t: f64| Located::on_ray(ray, t);
        let (located, normal) = match self {
            Prim::Triangle(corners) => (on_ray(triangle::distance_f64(&space, corners)), triangle::normal(corners)),
            Prim::Polygon(p) => (on_ray(polygon::distance_f64(&space, *p).unwrap_or(f64::from(hit.t))), p.normal()),
            Prim::Plane(normal, offset) => (on_ray(plane::distance_f64(&space, *normal, *offset)), *normal),
            Prim::Sphere(s) => {
                let p = Located::on_ray(ray, f64::from(hit.t));
                let (arm, normal) = sphere::project(p.position, s.center, s.radius);
                let position = s.center.as_dvec3() + arm;
                // One rounding of the sum, three of `arm`.
                let error = (position.abs() + arm.abs() * 3.0) * U64;
                (Located { position, error }, normal.as_vec3())
            }
            Prim::Cone(c) => {
                // The root that was rounded to the hit's t: on a flat cone a rounded t would slide along the mantle.
                let roots = cone::distances(&space, c, false).into_iter().filter(|t| !t.is_nan());
                let off = |t: &f64| (t - f64::from(hit.t)).abs();
                let t = roots.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(f64::from(hit.t));
                let (arm, size, normal) = c.project(Located::on_ray(ray, t).position);
                let position = c.base.as_dvec3() + arm;
                (Located { position, error: position.abs() * U64 + CONE_PROJECTION * size }, normal.as_vec3())
            }
        };
        let (position, error) = located.rounded();
        let mut refined = Refined { position, start: position, error, normal, u: hit.u, v: hit.v };
        if let Prim::Triangle(corners) = self {
            let way = inset(corners, (hit.u, hit.v), error.max_element());
            if way != DVec3::ZERO {
                let (start, error) = located.moved(way).rounded();
                refined = Refined { start, error: error.max(refined.error), ..refined };
            }
        }
        refined
    }
}

/// Data shared by the refinement of all hits on one triangle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TrianglePlane {
    pub flat: Flat,
    pub rim: Rim,
}

impl TrianglePlane {
    pub(crate) fn of(triangle: &Triangle) -> Self {
        let corners = triangle::in_f64(triangle);
        let flat = Flat::of(corners);
        Self { flat, rim: Rim::of(corners, flat.normal) }
    }

    /// Position and error bound of a hit, as in [`Shapes::refine`], and whether they are final: false where the distance
    /// needs more than `f64`, or where secondary rays start elsewhere.
    #[inline(always)]
    pub(crate) fn place(&self, origin: Vec3, dir: Vec3, weights: (f32, f32)) -> (Vec3, Vec3, bool) {
        let t = self.flat.distance(origin, dir);
        let (position, error) = Located::along(origin, dir, t.unwrap_or(0.0)).rounded();
        (position, error, t.is_some() & !self.rim.is_near(weights, error.max_element()))
    }
}

/// A point, and a bound of its error on each axis.
struct Located {
    position: DVec3,
    error: DVec3,
}

impl Located {
    /// Point o + t d for a t with a relative error of [`POSITION_T`]: one rounding of the product, one of the sum.
    fn on_ray(ray: &Ray, t: f64) -> Self {
        Self::along(ray.origin, ray.dir, t)
    }

    #[inline(always)]
    fn along(origin: Vec3, dir: Vec3, t: f64) -> Self {
        let step = dir.as_dvec3() * t;
        let position = origin.as_dvec3() + step;
        Self { position, error: step.abs() * (POSITION_T + U64) + position.abs() * U64 }
    }

    /// Moves the point by a vector whose rounding is far below that of a position in `f32`.
    fn moved(&self, way: DVec3) -> Self {
        Self { position: self.position + way, error: self.error }
    }

    /// Rounds to `f32` and adds the rounding to the error: u of the position, or half the smallest number.
    #[inline(always)]
    fn rounded(&self) -> (Vec3, Vec3) {
        let position = self.position.as_vec3();
        let error = self.error + position.as_dvec3().abs() * f64::from(U32) + f64::from(f32::from_bits(1));
        (position, error.as_vec3().map(above))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn a_hit_that_is_placed_by_its_plane_alone_lies_where_it_does_with_care() {
        let mut random = Random::new(9);
        let mut placed = 0;
        for i in 0..4000 {
            let vertices = vec![random.cube(), random.cube(), random.cube()];
            let shapes = Shapes { vertices, triangles: vec![[0, 1, 2]], ..Shapes::default() };
            // Inside the triangle, and near an edge.
            let near = if i % 2 == 0 { 0.5 } else { 1e-6 };
            let (u, v) = (random.unit() * 0.5, random.unit() * near);
            let origin = random.cube() * 9.0;
            let [a, b, c] = shapes.triangle(0);
            let dir = a * (1.0 - u - v) + b * u + c * v - origin;
            let ray = Ray::new(origin, dir);
            let hit = Hit { t: 1.0, u, v, prim: 0 };
            assert_eq!(shapes.refine(&ray, &hit), shapes.prim(hit.prim).refine_with_care(&ray, &hit));
            placed += usize::from(TrianglePlane::of(&shapes.triangle(0)).place(origin, dir, (u, v)).2);
        }
        assert!((1900..2300).contains(&placed), "{placed}");
    }
}
