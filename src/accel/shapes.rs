//! Shapes that a structure culls: flat arrays in one centred `f32` frame.
//!
//! Prim ids run over all kinds in order: triangles, polygons, spheres, cones, planes.

use std::ops::Range;

use crate::math::aabb::Aabb;
use crate::math::bounds::ROUND_ROOM;
use crate::math::cone::{self, Cone};
use crate::math::polygon::{self, Polygon};
use crate::math::shear::RaySpace;
use crate::math::triangle::{self, Triangle};
use crate::math::{Vec3, plane, sphere};

/// All shapes of a scene.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// Corners of triangles and polygons, relative to the scene's centre. Finite.
    pub vertices: Vec<Vec3>,
    /// Prims `0..triangles.len()`: indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Planar n-gons: runs (first, length) of `polygon_corners`.
    pub polygons: Vec<(u32, u32)>,
    /// Indices into `vertices`.
    pub polygon_corners: Vec<u32>,
    /// Spheres.
    pub spheres: Vec<SpherePrim>,
    /// Cones and cylinders, open at both ends.
    pub cones: Vec<Cone>,
    /// Unbounded planes (unit normal n, offset d: n·p = d); tested before every structure.
    pub planes: Vec<(Vec3, f32)>,
    /// One bit per prim, set if it is opaque. Prims beyond its last word are opaque; empty: all are.
    pub opaque: BitSet,
    /// Start of each object made of faces: its first triangle and its first polygon, both counted from 0; ascending. Empty:
    /// all faces are one object.
    pub face_runs: Vec<[u32; 2]>,
}

/// Prims that belong together: a placed glTF primitive or OBJ `o`/`g`/`usemtl` run, or a single other prim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Object {
    triangles: Range<u32>,
    others: Range<u32>,
}

impl Object {
    /// Number of prims.
    pub fn len(&self) -> u32 {
        let length = |range: &Range<u32>| range.end - range.start;
        length(&self.triangles) + length(&self.others)
    }

    /// Whether the object has no prims.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Prims of the object, ascending.
    pub fn prims(&self) -> impl Iterator<Item = u32> + Clone + use<> {
        self.triangles.clone().chain(self.others.clone())
    }
}

/// A sphere in the centred frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpherePrim {
    /// Centre.
    pub center: Vec3,
    /// Radius, greater than 0.
    pub radius: f32,
}

/// One bit per prim.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BitSet {
    words: Vec<u64>,
}

impl BitSet {
    /// Creates `len` bits, all equal to `value`.
    pub fn filled(len: usize, value: bool) -> Self {
        let mut words = vec![if value { u64::MAX } else { 0 }; len.div_ceil(64)];
        // Bits beyond the last read as set.
        if let Some(last) = words.last_mut().filter(|_| !len.is_multiple_of(64)) {
            *last |= u64::MAX << (len % 64);
        }
        Self { words }
    }

    /// Bit `i`.
    ///
    /// # Panics
    ///
    /// If `i` is beyond the last word of 64 bits.
    pub fn get(&self, i: u32) -> bool {
        self.words[i as usize / 64] >> (i % 64) & 1 == 1
    }

    /// Bit `i`, or `true` beyond the last bit.
    #[inline]
    pub fn get_or_set(&self, i: u32) -> bool {
        self.words.get(i as usize / 64).copied().unwrap_or(u64::MAX) >> (i % 64) & 1 == 1
    }

    /// Sets bit `i`.
    ///
    /// # Panics
    ///
    /// If `i` is beyond the last word of 64 bits.
    pub fn set(&mut self, i: u32, value: bool) {
        let mask = 1u64 << (i % 64);
        let word = &mut self.words[i as usize / 64];
        *word = if value { *word | mask } else { *word & !mask };
    }
}

impl Shapes {
    /// Number of prims of all kinds.
    pub fn len(&self) -> usize {
        self.bounded() as usize + self.planes.len()
    }

    /// Whether there are no prims.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of prims that have bounds: all but the planes. They come first.
    pub fn bounded(&self) -> u32 {
        index(self.triangles.len() + self.polygons.len() + self.spheres.len() + self.cones.len())
    }

    /// All objects with bounded prims: those of faces, then each sphere and cone.
    pub fn objects(&self) -> Vec<Object> {
        let (triangles, polygons) = (index(self.triangles.len()), index(self.polygons.len()));
        let mut starts = self.face_runs.clone();
        match starts.first_mut() {
            Some(first) => *first = [0, 0],
            None => starts.push([0, 0]),
        }
        starts.push([triangles, polygons]);
        let run = |ends: &[[u32; 2]]| {
            let [from, to] = [ends[0], ends[1]];
            Object { triangles: from[0]..to[0], others: triangles + from[1]..triangles + to[1] }
        };
        let single = |prim| Object { triangles: 0..0, others: prim..prim + 1 };
        let faces = starts.windows(2).map(run).filter(|o| o.prims().next().is_some());
        faces.chain((triangles + polygons..self.bounded()).map(single)).collect()
    }

    /// Prim number `prim`.
    ///
    /// # Panics
    ///
    /// If there is no such prim, for example with [`NO_PRIM`](super::NO_PRIM).
    #[inline]
    pub fn prim(&self, prim: u32) -> Prim<'_> {
        let mut i = prim as usize;
        if i < self.triangles.len() {
            return Prim::Triangle(self.corners(self.triangles[i]));
        }
        i -= self.triangles.len();
        if i < self.polygons.len() {
            let (first, len) = self.polygons[i];
            let corners = &self.polygon_corners[first as usize..(first + len) as usize];
            return Prim::Polygon(Polygon { vertices: &self.vertices, corners });
        }
        i -= self.polygons.len();
        if let Some(&sphere) = self.spheres.get(i) {
            return Prim::Sphere(sphere);
        }
        i -= self.spheres.len();
        if let Some(cone) = self.cones.get(i) {
            return Prim::Cone(cone);
        }
        let (normal, offset) = self.planes[i - self.cones.len()];
        Prim::Plane(normal, offset)
    }

    #[inline]
    pub(super) fn corners(&self, [a, b, c]: [u32; 3]) -> Triangle {
        [self.vertices[a as usize], self.vertices[b as usize], self.vertices[c as usize]]
    }

    /// Corners of triangle `prim`.
    #[inline]
    pub fn triangle(&self, prim: u32) -> Triangle {
        self.corners(self.triangles[prim as usize])
    }

    /// Distances at which the line through the ray meets prim `prim`, which is not a triangle: up to two, NaN for none. A
    /// function of ray and prim alone. With `ahead`, negative distances may be left out.
    #[inline(never)]
    pub(super) fn other_distances(&self, prim: u32, ray: &RaySpace, ahead: bool) -> [f32; 2] {
        self.prim(prim).distances(ray, ahead)
    }

    /// Smallest box around prim `prim`, which is not a plane; boxes of spheres and cones are rounded outwards, by at least
    /// [`ROUND_ROOM`].
    pub fn bounds(&self, prim: u32) -> Aabb {
        match self.prim(prim) {
            Prim::Triangle(corners) => Aabb::around(corners),
            Prim::Polygon(polygon) => Aabb::around(polygon.points()),
            Prim::Sphere(s) => {
                let (lo, hi) = (s.center - s.radius, s.center + s.radius);
                Aabb { lo: lo.map(f32::next_down), hi: hi.map(f32::next_up) }.padded(s.radius * ROUND_ROOM)
            }
            Prim::Cone(cone) => cone.bounds().padded(cone.size() * ROUND_ROOM),
            Prim::Plane(..) => Aabb { lo: Vec3::NEG_INFINITY, hi: Vec3::INFINITY },
        }
    }
}

/// One prim.
#[derive(Clone, Copy, Debug)]
pub enum Prim<'a> {
    /// A triangle by its three corners.
    Triangle(Triangle),
    /// A planar n-gon.
    Polygon(Polygon<'a>),
    /// A sphere.
    Sphere(SpherePrim),
    /// The mantle of a truncated cone; a cylinder has equal radii.
    Cone(&'a Cone),
    /// An unbounded plane: unit normal n, offset d, n·p = d.
    Plane(Vec3, f32),
}

impl Prim<'_> {
    /// Distances at which the line through the ray meets the prim: up to two, NaN for none. With `ahead`, negative distances
    /// may be left out.
    #[inline]
    pub(crate) fn distances(&self, ray: &RaySpace, ahead: bool) -> [f32; 2] {
        match *self {
            Prim::Triangle(corners) => one(triangle::intersect(ray, &corners)),
            Prim::Polygon(polygon) => one(polygon::intersect(ray, polygon)),
            Prim::Sphere(s) => sphere::intersect(ray, s.center, s.radius, ahead).unwrap_or([f32::NAN; 2]),
            Prim::Cone(cone) => cone::intersect(ray, cone, ahead),
            Prim::Plane(normal, offset) => one(plane::intersect(ray, normal, offset)),
        }
    }
}

#[inline]
fn one(t: Option<f32>) -> [f32; 2] {
    [t.unwrap_or(f32::NAN), f32::NAN]
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "`Scene::check` and loading refuse more prims; vertices are no more than their corners"
)]
fn index(i: usize) -> u32 {
    i as u32
}
