//! The scene is transformed for each ray, so that the ray becomes the third axis.
//!
//! A prim that the ray can hit then straddles the origin on the first two axes: two comparisons each, after every corner has
//! been transformed. The remaining prims are sorted by depth and tested in that order until the next begins beyond the best
//! hit. All prims are examined for every ray: it saves tests, not time.
//!
//! The axes are those of sheared ray space ([`RaySpace`]): a shear keeps the signs of extents, as a rotation does.
//!
//! # Why no hit is lost
//! Let D be the largest coordinate difference between a point and the ray's origin: its sheared coordinates err by
//! [`HEIGHT_F64`] D, its depth by two roundings. For a direction with no component larger than that along the third axis, a
//! point within r of another is within √2 r of it in each sheared axis and r in the third. Extents are widened by `SHADOW` D,
//! depths as in [`slabs`](super::slabs).

use super::query::{Culling, Goal, Query};
use super::shapes::Prim;
use super::slabs::{limit, start};
use super::{Probe, Shapes, StructureStats};
use crate::math::bounds::HEIGHT_F64;
use crate::math::shear::RaySpace;
use crate::math::{DVec3, Vec3};

/// Margin of a sheared coordinate, relative to the distance from the origin: its error, and the much smaller ones of a
/// sphere's or cone's own test, 16 times over.
const SHADOW: f64 = 16.0 * HEIGHT_F64;

/// Structure that builds nothing and transforms all shapes for each ray.
#[derive(Clone, Copy, Debug)]
pub struct Transformed<'a> {
    shapes: &'a Shapes,
}

/// Scratch memory: the scene in the axes of one ray.
#[derive(Clone, Debug, Default)]
pub struct Turned {
    corners: Vec<Shadow>,
    /// Near depth of each prim that may be hit, and the prim.
    order: Vec<(f64, u32)>,
}

/// Extent in the axes of a ray.
#[derive(Clone, Copy, Debug)]
struct Shadow {
    lo: DVec3,
    hi: DVec3,
}

impl Shadow {
    const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    fn join(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Whether the ray passes through the extent.
    fn straddles(&self) -> bool {
        self.lo.x <= 0.0 && self.lo.y <= 0.0 && self.hi.x >= 0.0 && self.hi.y >= 0.0
    }
}

/// Transform into the axes of a ray.
struct Turn<'r> {
    ray: &'r RaySpace,
    shear: (f64, f64),
    /// Factor of depths, which are distances along the ray.
    depth: f64,
}

impl<'r> Turn<'r> {
    fn new(ray: &'r RaySpace) -> Self {
        let [x, y, z] = [ray.x, ray.y, ray.z].map(|k| f64::from(ray.dir[k]));
        Self { ray, shear: (x / z, y / z), depth: z }
    }

    /// Extent of the ball of `radius` around a point.
    fn ball(&self, p: Vec3, radius: f64) -> Shadow {
        let a = p.as_dvec3() - self.ray.origin.as_dvec3();
        let (x, y, z) = (a[self.ray.x], a[self.ray.y], a[self.ray.z]);
        let sheared = DVec3::new(x - self.shear.0 * z, y - self.shear.1 * z, z / self.depth);
        let reach = a.abs().max_element() + radius;
        let across = radius * std::f64::consts::SQRT_2 + reach * SHADOW;
        let along = (radius / self.depth).abs() * (1.0 + SHADOW) + sheared.z.abs() * SHADOW;
        let room = DVec3::new(across, across, along);
        Shadow { lo: sheared - room, hi: sheared + room }
    }
}

impl<'a> Transformed<'a> {
    /// Creates the structure; there is nothing to build.
    pub fn new(shapes: &'a Shapes) -> Self {
        Self { shapes }
    }

    /// Sizes: all zero but the references, because every prim is listed once.
    pub fn summary(&self) -> StructureStats {
        StructureStats::listing(self.shapes.bounded())
    }

    /// Always succeeds: nothing is built that could lose a hit.
    pub fn check(&self) -> Result<StructureStats, String> {
        Ok(self.summary())
    }

    /// Extent of prim `prim`; spheres and cones are transformed here, as one and two points.
    fn shadow<P: Probe>(&self, prim: u32, turn: &Turn, corners: &[Shadow], probe: &mut P) -> Shadow {
        let join = |shadow: Shadow, i: &u32| shadow.join(corners[*i as usize]);
        let (triangles, polygons) = (&self.shapes.triangles, &self.shapes.polygons);
        if let Some(triangle) = triangles.get(prim as usize) {
            return triangle.iter().fold(Shadow::EMPTY, join);
        }
        if let Some(&(first, len)) = polygons.get(prim as usize - triangles.len()) {
            let run = &self.shapes.polygon_corners[first as usize..(first + len) as usize];
            return run.iter().fold(Shadow::EMPTY, join);
        }
        match self.shapes.prim(prim) {
            Prim::Sphere(s) => {
                probe.transforms(1);
                turn.ball(s.center, f64::from(s.radius))
            }
            Prim::Cone(c) => {
                probe.transforms(2);
                turn.ball(c.base, f64::from(c.base_radius)).join(turn.ball(c.apex, f64::from(c.apex_radius)))
            }
            _ => Shadow { lo: DVec3::NEG_INFINITY, hi: DVec3::INFINITY },
        }
    }
}

impl Culling for Transformed<'_> {
    type Scratch = Turned;

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) -> Turned {
        Turned::default()
    }

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, turned: &mut Turned, probe: &mut P) {
        let Turned { corners, order } = turned;
        let ray = query.ray;
        let turn = Turn::new(&ray);
        probe.transforms(self.shapes.vertices.len());
        corners.clear();
        corners.extend(self.shapes.vertices.iter().map(|&p| turn.ball(p, 0.0)));

        let (from, end) = (start(query), limit(query));
        order.clear();
        for prim in 0..self.shapes.bounded() {
            let shadow = self.shadow(prim, &turn, corners, probe);
            if shadow.straddles() && shadow.lo.z <= end && shadow.hi.z >= from {
                order.push((shadow.lo.z, prim));
            }
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(depth, prim) in order.iter() {
            if depth > limit(query) || query.test(prim, probe) {
                return;
            }
        }
    }
}
